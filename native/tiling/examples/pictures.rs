//! Draws sheets of tilings as SVG: the patterns of one outline, fits of drawn curves, and outlines that need thin rhombi.
//!
//! `cargo run -p quadloom-tiling --example pictures -- FOLDER`

use mesh::Monitor;
use std::f64::consts::TAU;
use std::fmt::Write;
use std::path::Path;
use testkit::dodecagonal;
use testkit::random::Random;
use tiling::{Boundary, Fit, FitOptions, Kind, Options, Tiling, Tilings, fit_boundary, repair, tile_with_rhombi};

/// Width of a picture on a sheet, its frame, and the height of a line of text, in pixels.
const WIDTH: f64 = 300.0;
const FRAME: f64 = 20.0;
const LINE: f64 = 18.0;

type Result<T> = std::result::Result<T, Box<dyn std::error::Error>>;

fn main() -> Result<()> {
    let folder = std::env::args().nth(1).ok_or("name the folder to draw into")?;
    let folder = Path::new(&folder);
    std::fs::write(folder.join("tiling-patterns.svg"), sheet(&patterns()?, 4))?;
    std::fs::write(folder.join("tiling-fits.svg"), sheet(&fits()?, 5))?;
    std::fs::write(folder.join("tiling-rhombi.svg"), sheet(&rhombi()?, 3))?;
    Ok(())
}

/// A drawing of some height with what is written below it.
struct Picture {
    svg: String,
    height: f64,
    title: String,
}

impl Picture {
    fn new(tiling: &Tiling, curve: &[[f64; 2]], title: String) -> Self {
        let corners = || tiling.tiles.iter().flat_map(|tile| tile.corners()).map(tiling::Point::position);
        let range = |axis: usize| {
            let fold = |(low, high): (f64, f64), p: [f64; 2]| (low.min(p[axis]), high.max(p[axis]));
            corners().fold((f64::INFINITY, f64::NEG_INFINITY), fold)
        };
        let ((left, right), (bottom, top)) = (range(0), range(1));
        let scale = (WIDTH - 8.0) / (right - left);
        let mut svg = tiling.svg(WIDTH as u32);
        if !curve.is_empty() {
            let mut line = "<polygon fill=\"none\" stroke=\"#c00\" stroke-width=\"1.5\" points=\"".to_owned();
            for [x, y] in curve {
                let _ = write!(line, "{:.2},{:.2} ", 4.0 + (x - left) * scale, 4.0 + (top - y) * scale);
            }
            svg = svg.replace("</svg>", &(line + "\"/>\n</svg>"));
        }
        Self { svg, height: (top - bottom) * scale + 8.0, title }
    }
}

/// Pictures in rows, each with its title below.
fn sheet(pictures: &[Picture], columns: usize) -> String {
    let mut body = String::new();
    let mut y = FRAME;
    for row in pictures.chunks(columns) {
        let height = row.iter().map(|picture| picture.height).fold(0.0, f64::max);
        for (k, picture) in row.iter().enumerate() {
            let x = FRAME + k as f64 * (WIDTH + FRAME);
            let place = format!(
                "<svg overflow=\"visible\" x=\"{x}\" y=\"{:.0}\" width=\"{WIDTH}\" height=\"{:.0}\" ",
                y + (height - picture.height) / 2.0,
                picture.height
            );
            body += &picture.svg.replacen("<svg ", &place, 1);
            let _ = writeln!(
                body,
                "<text x=\"{:.0}\" y=\"{:.0}\" text-anchor=\"middle\" font-family=\"sans-serif\" font-size=\"13\">{}</text>",
                x + WIDTH / 2.0,
                y + height + LINE,
                picture.title
            );
        }
        y += height + LINE + FRAME;
    }
    let width = FRAME + columns as f64 * (WIDTH + FRAME);
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width:.0}\" height=\"{y:.0}\" viewBox=\"0 0 {width:.0} {y:.0}\">\n\
         <rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n{body}</svg>\n"
    )
}

/// One outline, a twelve-sided one: two of its tilings at random, the least and the most fractured, the symmetric ones.
fn patterns() -> Result<Vec<Picture>> {
    let (options, monitor) = (Options::default(), Monitor::new());
    let side = |length: usize| [vec![5], vec![6; length - 1]].concat();
    let outline = Boundary::new(&[side(4), side(4)].concat().repeat(6))?;
    let mut all = Tilings::new(&outline, &options, &monitor)?;
    let mut pictures = Vec::new();
    let indices: Vec<_> = all.sample(2, 3).collect();
    for index in indices {
        let drawn = all.get(&index, &monitor)?.ok_or("an index below the count")?;
        pictures.push(Picture::new(&drawn, &[], format!("pattern {} of {}", index + 1u32, all.count())));
    }
    for (weight, name) in [(1, "least fractured"), (-1, "most fractured")] {
        let (best, cost) = all.best([0, 0, 0, weight], &monitor)?.ok_or("there are tilings")?;
        pictures.push(Picture::new(&best, &[], format!("{name}: {} butterflies", cost.abs())));
    }
    let (disc, _) = dodecagonal_disc(6.4)?;
    let mut random = Tilings::new(&disc, &options, &monitor)?;
    let drawn = random.get(&0u32.into(), &monitor)?.ok_or("it was cut from a tiling")?;
    pictures.push(Picture::new(&drawn, &[], format!("a random outline: {} patterns", random.count())));
    for (weight, name) in [(1, "least fractured"), (-1, "most fractured")] {
        let (best, cost) = random.best([0, 0, 0, weight], &monitor)?.ok_or("there are tilings")?;
        pictures.push(Picture::new(&best, &[], format!("{name}: {} butterflies", cost.abs())));
    }
    let symmetries = outline.symmetries();
    let sixfold = symmetries.iter().find(|g| !g.mirror && g.turn == 2).ok_or("a regular outline")?;
    let mut symmetric = Tilings::symmetric(&outline, &[*sixfold], &options, &monitor)?;
    let drawn = symmetric.get(&0u32.into(), &monitor)?.ok_or("a symmetric tiling")?;
    pictures.push(Picture::new(&drawn, &[], format!("six-fold: {} patterns", symmetric.count())));
    Ok(pictures)
}

fn dodecagonal_disc(radius: f64) -> Result<(Boundary, usize)> {
    let mut random = Random::new(11);
    let plane = dodecagonal::tiling(2, &mut random);
    let mut draw = || dodecagonal::disc(&plane, [random.between(-6.0, 6.0), random.between(-6.0, 6.0)], radius);
    let (code, tiles) = std::iter::from_fn(|| Some(draw())).flatten().next().ok_or("a disc")?;
    Ok((Boundary::new(&code)?, tiles))
}

/// The ten drawn curves, red, and their fits.
fn fits() -> Result<Vec<Picture>> {
    drawn_curves()
        .into_iter()
        .map(|(name, curve)| {
            let fit = fit_boundary(&curve, 1.0, &FitOptions::default(), &Monitor::new())?;
            let title = format!("{name}: within {:.2} edges", fit.greatest_distance);
            Ok(Picture::new(&fit.tiling, &in_tiling(&fit, &curve), title))
        })
        .collect()
}

/// The curve in the coordinates of the fit's tiling.
fn in_tiling(fit: &Fit, curve: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let (sin, cos) = fit.rotation.sin_cos();
    let back = |p: &[f64; 2]| {
        let (x, y) = ((p[0] - fit.origin[0]) / fit.edge_length, (p[1] - fit.origin[1]) / fit.edge_length);
        [cos * x + sin * y, cos * y - sin * x]
    };
    curve.iter().map(back).collect()
}

fn drawn_curves() -> Vec<(&'static str, Vec<[f64; 2]>)> {
    let angle = |k: u32| TAU * (f64::from(k) + 0.5) / 240.0;
    let polar = |radius: &dyn Fn(f64) -> f64, stretch: f64| -> Vec<[f64; 2]> {
        (0..240).map(angle).map(|a| [stretch * radius(a) * a.cos(), radius(a) * a.sin()]).collect()
    };
    let rounded = |width: f64, height: f64, corner: f64| -> Vec<[f64; 2]> {
        let at = |a: f64| {
            let (sin, cos) = a.sin_cos();
            let middle = [cos.signum() * (width / 2.0 - corner), sin.signum() * (height / 2.0 - corner)];
            [middle[0] + corner * cos, middle[1] + corner * sin]
        };
        (0..240).map(angle).map(at).collect()
    };
    vec![
        ("circle", polar(&|_| 7.0, 1.0)),
        ("ellipse", polar(&|_| 5.0, 1.8)),
        ("stadium", rounded(22.0, 10.0, 5.0)),
        ("L", vec![[0.0, 0.0], [14.0, 0.0], [14.0, 6.0], [6.0, 6.0], [6.0, 14.0], [0.0, 14.0]]),
        ("star", polar(&|a| 8.0 + 2.5 * (5.0 * a).cos(), 1.0)),
        ("kidney", polar(&|a| 7.0 + 3.0 * a.cos() - 1.5 * (2.0 * a).cos(), 1.0)),
        ("rounded rectangle", rounded(16.0, 11.0, 3.0)),
        ("leaf", polar(&|a| 4.0 + 6.0 * a.cos().powi(2), 1.0)),
        ("tower", polar(&|a| 13.0 + 1.5 * (4.0 * a).cos(), 1.0)),
        ("sports stadium", polar(&|_| 8.5, 1.25)),
    ]
}

/// Outlines without tilings: with rhombi, and after the smallest change that does without them.
fn rhombi() -> Result<Vec<Picture>> {
    let (options, monitor) = (Options::default(), Monitor::new());
    let mut pictures = Vec::new();
    let zonogon = |sides: [usize; 6]| {
        let side = |&length: &usize| [vec![5], vec![6; length - 1]].concat();
        sides.iter().flat_map(side).collect::<Vec<u8>>().repeat(2)
    };
    // Three corners of 150 degrees pushed in.
    let mut spoilt = zonogon([3; 6]);
    for corner in [6, 15, 27] {
        spoilt[corner] = 7;
        spoilt[corner - 1] -= 1;
        spoilt[corner + 1] -= 1;
    }
    for (code, repairs) in [(spoilt, true), (zonogon([4, 3, 1, 3, 2, 2]), false)] {
        let outline = Boundary::new(&code)?;
        let found = tile_with_rhombi(&outline, 1, &options, &monitor)?.ok_or("rhombi help")?;
        let title = format!("rhombi: {}, at least {}", found.tiling.count(Kind::Rhombus), found.at_least);
        pictures.push(Picture::new(&found.tiling, &[], title));
        if let Some(repaired) = if repairs { repair(&outline, &options, &monitor)? } else { None } {
            let mut all = Tilings::new(&repaired.boundary, &options, &monitor)?;
            let drawn = all.get(&0u32.into(), &monitor)?.ok_or("a repaired outline can be tiled")?;
            let before: Vec<[f64; 2]> = outline.points().iter().map(|p| p.position()).collect();
            // An exchange at the first corner or the last turns or shifts the frame: then the old outline is left out.
            let last = code.len() as u32 - 1;
            let frame_kept = repaired.corners.iter().all(|&corner| corner != 0 && corner != last && corner != 1);
            let title = format!("exchanges that repair it: {}", repaired.corners.len());
            pictures.push(Picture::new(&drawn, if frame_kept { &before } else { &[] }, title));
        }
    }
    Ok(pictures)
}
