//! Patch layouts of plane and curved regions, judged by recomputing their topology. Set `QUADLOOM_PICTURES` to a folder to
//! draw them as SVG.

use glam::{DVec2, DVec3};
use mesh::{Monitor, Topology, TriangleMesh};
use quadrangulate::layout::{
    CornerAngles, Fault, LayoutError, LayoutOptions, PatchLayout, SubSideKind, parts, trace_layout,
};
use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::TAU;
use std::fmt::Write;
use testkit::plane_region::{circle, plane_region, subdivided};

fn flat(p: DVec2) -> DVec3 {
    p.extend(0.0)
}

fn dome(p: DVec2) -> DVec3 {
    p.extend(1.2 * (-0.25 * p.length_squared()).exp())
}

fn layout_of(mesh: &TriangleMesh) -> Result<PatchLayout, LayoutError> {
    trace_layout(mesh, &[], &LayoutOptions::default(), &Monitor::new())
}

fn euler_characteristic(triangles: &[[u32; 3]]) -> i32 {
    let vertices: BTreeSet<u32> = triangles.iter().flatten().copied().collect();
    let edges: BTreeSet<[u32; 2]> =
        triangles.iter().flat_map(|t| (0..3).map(|k| sorted(t[k], t[(k + 1) % 3]))).collect();
    vertices.len() as i32 - edges.len() as i32 + triangles.len() as i32
}

fn sorted(a: u32, b: u32) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

/// Checks everything a layout promises, from its arrays alone.
fn check(input: &TriangleMesh, layout: &PatchLayout) {
    let mesh = &layout.mesh;
    assert_eq!(mesh.positions[..input.positions.len()], input.positions[..], "given vertices stay");
    let area = |m: &TriangleMesh| (0..m.triangles.len()).map(|t| m.area_normal(t).length() / 2.0).sum::<f64>();
    assert!((area(mesh) - area(input)).abs() < 1e-9 * area(input), "the surface is only refined");
    assert_eq!(euler_characteristic(&mesh.triangles), euler_characteristic(&input.triangles));
    let border = |m: &TriangleMesh| -> BTreeSet<[u32; 2]> {
        let topology = Topology::of_triangles(m);
        (0..topology.len() as u32)
            .filter(|&h| topology.is_border(h))
            .map(|h| [topology.from(h), topology.to(h)])
            .collect()
    };
    assert_eq!(border(mesh), border(input), "the border keeps its edges");

    let mut owner = vec![u32::MAX; mesh.triangles.len()];
    let mut uses = vec![0; layout.sub_sides.len()];
    for (p, patch) in layout.patches.iter().enumerate() {
        for &t in &patch.triangles {
            assert_eq!(owner[t as usize], u32::MAX);
            owner[t as usize] = p as u32;
        }
        let triangles: Vec<[u32; 3]> = patch.triangles.iter().map(|&t| mesh.triangles[t as usize]).collect();
        assert_eq!(euler_characteristic(&triangles), 1, "patch {p} is a disk");
        assert!((3..=6).contains(&patch.sides.len()), "patch {p} has {} sides", patch.sides.len());
        assert_eq!(patch.sides.len(), patch.corners.len());
        // The sides, joined, are the border of the triangles, in its direction and without repeats.
        let part = TriangleMesh { positions: mesh.positions.clone(), triangles };
        let mut walked = BTreeSet::new();
        let mut starts = BTreeSet::new();
        for side in 0..patch.sides.len() {
            let path = layout.side_path(p, side);
            assert_eq!(path.last(), Some(&patch.corners[(side + 1) % patch.corners.len()]));
            walked.extend(path.windows(2).map(|w| [w[0], w[1]]));
            assert!(path[1..].iter().all(|&v| starts.insert(v)), "patch {p} meets itself");
            patch.sides[side].iter().for_each(|&sub| uses[sub as usize] += 1);
        }
        assert_eq!(walked, border(&part));
    }
    assert!(owner.iter().all(|&p| p != u32::MAX));
    for (sub, count) in layout.sub_sides.iter().zip(uses) {
        assert_eq!(count, if sub.kind == SubSideKind::Border { 1 } else { 2 });
        let on_border = border(input).iter().map(|e| sorted(e[0], e[1])).collect::<BTreeSet<_>>();
        for w in sub.vertices.windows(2) {
            assert_eq!(on_border.contains(&sorted(w[0], w[1])), sub.kind == SubSideKind::Border);
        }
    }
}

/// Draws a layout seen from above.
fn draw(name: &str, layout: &PatchLayout) {
    let Ok(folder) = std::env::var("QUADLOOM_PICTURES") else {
        return;
    };
    let at = |v: u32| layout.mesh.positions[v as usize].truncate();
    let points = || layout.mesh.positions.iter().map(|p| p.truncate());
    let (low, high) = points().fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(l, h), p| (l.min(p), h.max(p)));
    let scale = 900.0 / (high - low).max_element();
    let place = |p: DVec2| DVec2::new(p.x - low.x, high.y - p.y) * scale + 10.0;
    let mut svg =
        format!("<svg xmlns='http://www.w3.org/2000/svg' width='920' height='{}'>", (high.y - low.y) * scale + 20.0);
    for (k, patch) in layout.patches.iter().enumerate() {
        let hue = (k as f64 * 0.618_034).fract() * TAU;
        let colour = [0.0, TAU / 3.0, 2.0 * TAU / 3.0].map(|phase| 195 + (55.0 * (hue + phase).cos()) as i32);
        for &t in &patch.triangles {
            let p = layout.mesh.triangles[t as usize].map(|v| place(at(v)));
            let _ = write!(
                svg,
                "<polygon points='{:.1},{:.1} {:.1},{:.1} {:.1},{:.1}' fill='rgb({},{},{})' stroke='rgb(170,170,170)' stroke-width='0.4'/>",
                p[0].x, p[0].y, p[1].x, p[1].y, p[2].x, p[2].y, colour[0], colour[1], colour[2]
            );
        }
    }
    for sub in &layout.sub_sides {
        let path: Vec<String> =
            sub.vertices.iter().map(|&v| place(at(v))).map(|p| format!("{:.1},{:.1}", p.x, p.y)).collect();
        let colour = if sub.kind == SubSideKind::Border { "black" } else { "rgb(200,0,0)" };
        let _ = write!(svg, "<polyline points='{}' fill='none' stroke='{colour}' stroke-width='2'/>", path.join(" "));
        let p = place(at(sub.vertices[0]));
        let _ = write!(svg, "<circle cx='{:.1}' cy='{:.1}' r='4' fill='{colour}'/>", p.x, p.y);
    }
    svg.push_str("</svg>");
    std::fs::write(format!("{folder}/{name}.svg"), svg).expect("the picture folder exists");
}

fn polygon(corners: &[(f64, f64)], edge: f64) -> Vec<DVec2> {
    subdivided(&corners.iter().map(|&c| DVec2::from(c)).collect::<Vec<_>>(), edge)
}

fn shapes() -> BTreeMap<&'static str, TriangleMesh> {
    let l_shape = polygon(&[(0., 0.), (4., 0.), (4., 2.), (2., 2.), (2., 4.), (0., 4.)], 0.4);
    let hole = polygon(&[(1.5, 1.5), (3., 1.5), (3., 3.), (1.5, 3.)], 0.4);
    let outer = polygon(&[(0., 0.), (5., 0.), (5., 4.5), (0., 4.5)], 0.4);
    let pants =
        [circle(DVec2::ZERO, 3.0, 48), circle(DVec2::new(1.3, 0.2), 0.7, 13), circle(DVec2::new(-1.3, 0.), 0.6, 11)];
    let star: Vec<DVec2> = (0..10).map(|k| [3.0, 1.5][k % 2] * DVec2::from_angle(TAU * k as f64 / 10.0)).collect();
    let staircase = polygon(
        &[(0., 0.), (5., 0.), (5., 1.), (4., 1.), (4., 2.), (3., 2.), (3., 3.), (2., 3.), (2., 4.), (0., 4.)],
        0.5,
    );
    [
        ("l_shape", plane_region(std::slice::from_ref(&l_shape), flat)),
        ("l_shape_curved", plane_region(&[l_shape], dome)),
        ("annulus", plane_region(&[circle(DVec2::ZERO, 2.0, 40), circle(DVec2::ZERO, 1.2, 30)], flat)),
        ("annulus_curved", plane_region(&[circle(DVec2::ZERO, 2.0, 31), circle(DVec2::new(0.2, 0.), 1.0, 17)], dome)),
        ("square_hole", plane_region(&[outer.clone(), hole], flat)),
        ("round_hole", plane_region(&[outer, circle(DVec2::new(2.2, 2.4), 1.0, 16)], dome)),
        ("pants", plane_region(&pants, flat)),
        ("pants_curved", plane_region(&pants, dome)),
        ("disk", plane_region(&[circle(DVec2::ZERO, 2.0, 32)], dome)),
        ("star", plane_region(&[subdivided(&star, 0.35)], flat)),
        ("staircase", plane_region(&[staircase], flat)),
        ("octagon", plane_region(&[subdivided(&circle(DVec2::ZERO, 2.0, 8), 0.4)], flat)),
    ]
    .into()
}

#[test]
fn shapes_become_patches() {
    for (name, mesh) in shapes() {
        let start = std::time::Instant::now();
        match layout_of(&mesh) {
            Ok(layout) => {
                draw(name, &layout);
                check(&mesh, &layout);
                eprintln!(
                    "{name}: {} triangles, {} patches, {} flattened, {:?}",
                    mesh.triangles.len(),
                    layout.patches.len(),
                    layout.flattened.len(),
                    start.elapsed()
                );
            }
            Err(error) => panic!("{name}: {error}"),
        }
    }
}

/// The shortest chain of edges between the vertices nearest to two points, by the straight line's distance.
fn chain(mesh: &TriangleMesh, from: DVec2, to: DVec2) -> Vec<[u32; 2]> {
    let topology = Topology::of_triangles(mesh);
    let at = |v: u32| mesh.positions[v as usize].truncate();
    let near = |p: DVec2| {
        let all = (0..mesh.positions.len() as u32).filter(|&v| !topology.is_border_vertex(v));
        all.min_by(|&a, &b| at(a).distance(p).total_cmp(&at(b).distance(p))).expect("an interior vertex")
    };
    let (mut v, end) = (near(from), near(to));
    let mut edges = Vec::new();
    while v != end {
        let next = topology
            .around(v)
            .map(|h| topology.to(h))
            .min_by(|&a, &b| at(a).distance(at(end)).total_cmp(&at(b).distance(at(end))));
        let next = next.expect("a neighbour");
        edges.push([v, next]);
        v = next;
    }
    edges
}

#[test]
fn features_become_sides() {
    let mesh = plane_region(&[polygon(&[(0., 0.), (6., 0.), (6., 5.), (0., 5.)], 0.4)], dome);
    let corners = [(1.5, 1.5), (4.5, 1.5), (4.5, 3.5), (1.5, 3.5)].map(DVec2::from);
    let dangling = chain(&mesh, corners[0], corners[1]);
    let closed: Vec<[u32; 2]> = (0..4).flat_map(|k| chain(&mesh, corners[k], corners[(k + 1) % 4])).collect();
    for (name, features) in [("dangling_feature", dangling), ("closed_feature", closed)] {
        let layout = trace_layout(&mesh, &features, &LayoutOptions::default(), &Monitor::new()).expect("a layout");
        draw(name, &layout);
        check(&mesh, &layout);
        let length = |edges: &[[u32; 2]]| -> f64 {
            edges.iter().map(|e| mesh.positions[e[0] as usize].distance(mesh.positions[e[1] as usize])).sum()
        };
        let sides = layout.sub_sides.iter().filter(|sub| sub.kind == SubSideKind::Feature);
        assert!((sides.map(|sub| sub.length).sum::<f64>() - length(&features)).abs() < 1e-9);
    }
}

#[test]
fn same_input_gives_the_same_layout() {
    let mesh = random_region(1).expect("a region");
    assert_eq!(layout_of(&mesh), layout_of(&mesh));
}

#[test]
fn what_cannot_be_divided_is_named() {
    let monitor = Monitor::new();
    monitor.cancel();
    let disk = plane_region(&[circle(DVec2::ZERO, 1.0, 20)], flat);
    let error = trace_layout(&disk, &[], &LayoutOptions::default(), &monitor).unwrap_err();
    assert_eq!(error, LayoutError::Cancelled(mesh::Cancelled));

    let mut pinched = disk.clone();
    let offset = pinched.positions.len() as u32 - 1;
    pinched.positions.extend(disk.positions[1..].iter().map(|&p| p + 2.0 * DVec3::X));
    pinched.triangles.extend(disk.triangles.iter().map(|t| t.map(|v| if v == 0 { 0 } else { v + offset })));
    assert_eq!(layout_of(&pinched).unwrap_err(), LayoutError::NotManifold { vertex: 0 });

    let tetrahedron = TriangleMesh {
        positions: vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z],
        triangles: vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]],
    };
    assert!(matches!(layout_of(&tetrahedron), Err(LayoutError::NoTrace { .. })), "four triangles leave no room");

    // Two edges that meet at sharp corners leave nothing to start a trace from.
    let lens = TriangleMesh {
        positions: vec![DVec3::ZERO, DVec3::new(1.0, -0.01, 0.0), DVec3::new(2.0, 0.0, 0.0)],
        triangles: vec![[0, 1, 2]],
    };
    let error = layout_of(&lens).unwrap_err();
    assert_eq!(error, LayoutError::NoTrace { fault: Fault::Sides { count: 2 }, triangles: vec![0] });
}

/// Numbers in [0, 1) from a seed (splitmix64).
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }
}

/// Outlines of a set of unit cells, each with the cells on its left. `None` when two cells touch at a corner only.
fn outlines(cells: &BTreeSet<[i32; 2]>) -> Option<Vec<Vec<DVec2>>> {
    let mut next: BTreeMap<[i32; 2], [i32; 2]> = BTreeMap::new();
    for &[x, y] in cells {
        let corners = [[x, y], [x + 1, y], [x + 1, y + 1], [x, y + 1]];
        let beside = [[x, y - 1], [x + 1, y], [x, y + 1], [x - 1, y]];
        for k in 0..4 {
            if !cells.contains(&beside[k]) && next.insert(corners[k], corners[(k + 1) % 4]).is_some() {
                return None;
            }
        }
    }
    let mut loops = Vec::new();
    while let Some((&start, _)) = next.first_key_value() {
        let mut outline = Vec::new();
        let mut at = start;
        while let Some(to) = next.remove(&at) {
            outline.push(DVec2::new(f64::from(at[0]), f64::from(at[1])));
            at = to;
        }
        loops.push(outline);
    }
    Some(loops)
}

/// A region as the boolean leaves it: between a closed curve and the outline of the whole quads some distance away from it,
/// outside or inside the curve, on a bent surface with bent rows of quads.
fn random_region(seed: u64) -> Option<TriangleMesh> {
    let mut random = Random(seed);
    let outside = random.next() < 0.6;
    let (radius, distance) = (1.2 + 6.0 * random.next().powi(2), 0.9 + 1.2 * random.next());
    let (stretch, turn, wave) = (0.5 + random.next(), TAU * random.next(), 0.25 * random.next());
    let centre = DVec2::new(random.next(), random.next());
    let shape = |t: f64| {
        let r = radius * (1.0 + wave * (3.0 * t).sin());
        centre + DVec2::from_angle(turn).rotate(DVec2::new(r * t.cos(), r * stretch * t.sin()))
    };
    let fine: Vec<DVec2> = (0..720).map(|k| shape(TAU * f64::from(k) / 720.0)).collect();
    let perimeter: f64 = (0..720).map(|k| fine[k].distance(fine[(k + 1) % 720])).sum();
    let count = ((perimeter / (0.7 + 0.6 * random.next())) as usize).max(6);
    let mut curve = Vec::new();
    let mut walked = 0.0;
    for k in 0..720 {
        if walked >= perimeter * curve.len() as f64 / count as f64 && curve.len() < count {
            curve.push(fine[k]);
        }
        walked += fine[k].distance(fine[(k + 1) % 720]);
    }
    let inside = |p: DVec2| {
        let crossings = (0..720).filter(|&k| {
            let (a, b) = (fine[k], fine[(k + 1) % 720]);
            (a.y > p.y) != (b.y > p.y) && p.x < a.x + (p.y - a.y) / (b.y - a.y) * (b.x - a.x)
        });
        crossings.count() % 2 == 1
    };
    let near = |p: DVec2| fine.iter().any(|q| q.distance(p) < distance);
    let mut cells = BTreeSet::new();
    for (x, y) in (-16..16).flat_map(|x| (-16..16).map(move |y| (x, y))) {
        let corners = [(0, 0), (1, 0), (1, 1), (0, 1)].map(|(i, j)| DVec2::new(f64::from(x + i), f64::from(y + j)));
        let takes = if outside {
            corners.iter().any(|&p| inside(p) || near(p))
        } else {
            corners.iter().all(|&p| inside(p) && !near(p))
        };
        if takes {
            cells.insert([x, y]);
        }
    }
    let mut loops = outlines(&cells)?;
    if outside && loops.len() != 1 {
        return None;
    }
    loops.push(curve);
    let (bend, height) = (0.06 * random.next(), 2.0 * random.next());
    Some(plane_region(&loops, |p| {
        let bent = DVec2::new(p.x + bend * p.y * p.y, p.y - bend * p.x * p.x / 2.0);
        bent.extend(height * (-0.05 * p.length_squared()).exp())
    }))
}

#[test]
fn random_regions_become_patches() {
    let cases = std::env::var("QUADLOOM_CASES").ok().and_then(|n| n.parse().ok()).unwrap_or(60);
    let (mut tried, mut failed, mut patches, mut seconds, mut flattened) = (0, 0, 0, 0.0, 0);
    for seed in 0..cases {
        let Some(mesh) = random_region(seed) else {
            continue;
        };
        tried += 1;
        let start = std::time::Instant::now();
        match layout_of(&mesh) {
            Ok(layout) => {
                seconds += start.elapsed().as_secs_f64();
                patches += layout.patches.len();
                flattened += layout.flattened.len();
                check(&mesh, &layout);
                if seed < 24 {
                    draw(&format!("random_{seed:02}"), &layout);
                }
            }
            Err(error) => {
                failed += 1;
                eprintln!("seed {seed}: {error}");
            }
        }
    }
    eprintln!("{tried} regions, {failed} failed, {patches} patches, {flattened} corners flattened, {seconds:.1} s");
    assert!(failed * 20 <= tried, "{failed} of {tried} failed");
}

#[test]
fn closed_surfaces_are_opened_and_divided() {
    for mesh in [testkit::shapes::sphere(8), testkit::shapes::cylinder(1.0, 4.0, 24, 12)] {
        let (mesh, _) = TriangleMesh::from_polygons(&mesh);
        check(&mesh, &layout_of(&mesh).expect("a layout"));
    }
}

#[test]
fn long_sides_are_divided_where_that_is_asked_for() {
    let mesh = plane_region(&[circle(DVec2::ZERO, 3.0, 60), circle(DVec2::ZERO, 1.0, 20)], |p| p.extend(0.0));
    let longest = |longest: f64| {
        let options = LayoutOptions { longest, ..LayoutOptions::default() };
        let layout = trace_layout(&mesh, &[], &options, &Monitor::new()).expect("a layout");
        check(&mesh, &layout);
        let length = |side: &Vec<u32>| side.iter().map(|&s| layout.sub_sides[s as usize].length).sum::<f64>();
        layout.patches.iter().flat_map(|patch| &patch.sides).map(length).fold(0.0, f64::max)
    };
    let [any, short] = [f64::INFINITY, 2.0].map(longest);
    assert!(short < 0.75 * any, "{short} of {any}");
}

#[test]
fn sides_are_those_that_the_field_asks_for() {
    // Borders of a square, curved inwards so that its corners are sharper by twice the angle whose tangent this is.
    let square = |slope: f64| -> Vec<DVec2> {
        let side = |k: usize| {
            let turn = DVec2::from_angle(TAU * k as f64 / 4.0);
            let along = (0..20).map(|i| f64::from(i) / 10.0 - 1.0);
            along.map(move |x| turn.rotate(DVec2::new(4.0 * x, -4.0 + 2.0 * slope * (1.0 - x * x))))
        };
        (0..4).flat_map(side).collect()
    };
    // A saddle, where a trace round a corner is shorter than one across.
    let saddle = plane_region(&[square(0.0)], |p| p.extend(0.2 * p.x * p.y));
    // Corners of 28 degrees, nearer to none than to the quad they have.
    let sharp = plane_region(&[square(0.6)], flat);
    for (name, mesh) in [("saddle", saddle), ("sharp", sharp)] {
        let options = LayoutOptions { longest: 2.0, regular: true, ..LayoutOptions::default() };
        let layout = trace_layout(&mesh, &[], &options, &Monitor::new()).expect("a layout");
        check(&mesh, &layout);
        draw(name, &layout);
        let sides: Vec<usize> = layout.patches.iter().map(|patch| patch.sides.len()).collect();
        assert!(sides.len() > 3 && sides.iter().all(|&n| n == 4), "{name}: {sides:?}");
    }
}

#[test]
fn a_part_without_a_layout_is_named_and_the_others_have_theirs() {
    // Seven corners leave nothing to start a trace from; a square beside them, across a feature, is a patch.
    let corner = |k: u32| (2.0 * DVec2::from_angle(TAU * f64::from(k) / 7.0)).extend(0.0);
    let mut positions: Vec<DVec3> = (0..7).map(corner).collect();
    let out = (corner(0) + corner(1)).normalize();
    positions.extend([corner(0) + out, corner(1) + out]);
    let mut triangles: Vec<[u32; 3]> = (1..6).map(|k| [0, k, k + 1]).collect();
    triangles.extend([[0, 7, 1], [7, 8, 1]]);
    let mesh = TriangleMesh { positions, triangles };
    let features = [[0, 1]];
    assert_eq!(parts(&mesh, &features), [0, 0, 0, 0, 0, 1, 1]);
    let options = LayoutOptions { partial: true, refinements: 0, ..LayoutOptions::default() };
    let layout = trace_layout(&mesh, &features, &options, &Monitor::new()).expect("a layout");
    let [undivided] = &layout.undivided[..] else { panic!("{:?}", layout.undivided) };
    assert!(undivided.part == 0 && undivided.fault == Fault::Sides { count: 7 }, "{undivided:?}");
    assert!(!layout.patches.is_empty() && layout.patches.iter().all(|patch| patch.part == 1));
}

#[test]
fn a_part_with_two_corners_is_given_a_third_where_all_must_be_divided() {
    // Two edges that meet at sharp corners leave nothing to start a trace from.
    let mesh = TriangleMesh {
        positions: [[0.0, 0.0], [2.0, 0.0], [1.0, 0.05], [2.0, 2.0], [0.0, 2.0]]
            .map(|[x, y]| DVec3::new(x, y, 0.0))
            .to_vec(),
        triangles: vec![[0, 1, 2], [0, 2, 4], [2, 3, 4], [2, 1, 3]],
    };
    let features = [[0, 2], [2, 1]];
    assert_eq!(parts(&mesh, &features), [0, 1, 1, 1]);
    let divided = |partial: bool| {
        let options = LayoutOptions { partial, refinements: 0, ..LayoutOptions::default() };
        trace_layout(&mesh, &features, &options, &Monitor::new())
    };
    assert!(matches!(divided(false), Err(LayoutError::NoTrace { fault: Fault::Sides { count: 2 }, .. })));
    let layout = divided(true).expect("a layout");
    assert_eq!((&layout.undivided[..], &layout.flattened[..]), (&[][..], &[2][..]));
    assert!(layout.patches.iter().any(|patch| patch.part == 0 && patch.corners.contains(&2)));
}

#[test]
fn a_bend_of_a_feature_has_four_quads_around_it_where_its_angles_allow() {
    // The apex of a cone with 325 degrees around it, where a feature leaves 125 on one side and 200 on the other.
    let (spokes, rings) = (13, 4);
    let slope = 325.0 / 360.0_f64;
    let ring = |r: u32| {
        (0..spokes).map(move |s| {
            let (length, at) = (f64::from(r), TAU * f64::from(s) / f64::from(spokes));
            length * DVec3::new(slope * at.cos(), slope * at.sin(), -(1.0 - slope * slope).sqrt())
        })
    };
    let positions: Vec<DVec3> = std::iter::once(DVec3::ZERO).chain((1..=rings).flat_map(ring)).collect();
    let at = |r: u32, s: u32| if r == 0 { 0 } else { 1 + (r - 1) * spokes + s % spokes };
    let mut triangles: Vec<[u32; 3]> = (0..spokes).map(|s| [0, at(1, s), at(1, s + 1)]).collect();
    for (r, s) in (1..rings).flat_map(|r| (0..spokes).map(move |s| (r, s))) {
        triangles.push([at(r, s), at(r + 1, s), at(r + 1, s + 1)]);
        triangles.push([at(r, s), at(r + 1, s + 1), at(r, s + 1)]);
    }
    let mesh = TriangleMesh { positions, triangles };
    let features: Vec<[u32; 2]> =
        [0, 5].into_iter().flat_map(|s| (0..rings).map(move |r| [at(r, s), at(r + 1, s)])).collect();
    let quads_at_apex = |slack: f64| {
        let corners =
            CornerAngles { convex: 0.75 * TAU / 2.0, concave: 1.25 * TAU / 2.0, slack, ..CornerAngles::default() };
        let options = LayoutOptions { corners, refinements: 0, ..LayoutOptions::default() };
        let layout = trace_layout(&mesh, &features, &options, &Monitor::new()).expect("a layout");
        check(&mesh, &layout);
        let touches = |patch: &Vec<u32>| patch.iter().any(|&t| layout.mesh.triangles[t as usize].contains(&0));
        let own = layout.patches.iter().filter(|patch| touches(&patch.triangles));
        own.map(|patch| if patch.corners.contains(&0) { 1 } else { 2 }).sum::<u32>()
    };
    assert_eq!([0.0, 0.8].map(quads_at_apex), [3, 4]);
}

#[test]
fn short_fillets_are_corners_and_small_holes_are_not() {
    // A square of 8 by 8 whose corners turn in four steps within half an edge, round a hole of ten edges.
    let ends = [DVec2::ZERO, 8.0 * DVec2::X, 8.0 * DVec2::ONE, 8.0 * DVec2::Y];
    let mut outline = Vec::new();
    for k in 0..4 {
        let [before, at, after] = [(k + 3) % 4, k, (k + 1) % 4].map(|k| ends[k]);
        let [back, on] = [before, after].map(|other| (other - at) / 8.0);
        outline.extend([[0.3, 0.0], [0.12, 0.05], [0.06, 0.13], [0.0, 0.3]].map(|[a, b]| at + a * back + b * on));
        outline.extend((1..8).map(|step| at + f64::from(step) * on));
    }
    let hole = circle(DVec2::splat(4.0), 1.0, 10);
    let on_border = (outline.len() + hole.len()) as u32;
    let mesh = plane_region(&[outline, hole], flat);
    let corners_of = |fillet: f64| {
        let corners =
            CornerAngles { convex: 0.75 * TAU / 2.0, concave: 1.25 * TAU / 2.0, fillet, ..CornerAngles::default() };
        let options = LayoutOptions { corners, regular: true, ..LayoutOptions::default() };
        let layout = trace_layout(&mesh, &[], &options, &Monitor::new()).expect("a layout");
        check(&mesh, &layout);
        // Border vertices where a single patch has a corner.
        let mut quarters = BTreeMap::<u32, u32>::new();
        for patch in &layout.patches {
            let own: BTreeSet<u32> = patch.triangles.iter().flat_map(|&t| layout.mesh.triangles[t as usize]).collect();
            for v in own.into_iter().filter(|&v| v < on_border) {
                *quarters.entry(v).or_default() += if patch.corners.contains(&v) { 1 } else { 2 };
            }
        }
        quarters.into_iter().filter(|(_, quarters)| *quarters != 2).collect::<Vec<_>>()
    };
    assert_eq!(corners_of(0.0), []);
    assert_eq!(corners_of(1.0), [1, 12, 23, 34].map(|v| (v, 1)));
}
