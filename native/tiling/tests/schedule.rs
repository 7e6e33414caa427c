//! Schedules of panels, judged by meshes whose parts are known, and drawings read back by other means.

use dxf::Drawing;
use dxf::entities::EntityType;
use mesh::{DVec3, Monitor, PolygonMesh};
use proptest::prelude::*;
use std::collections::BTreeMap;
use tiling::schedule::{Format, Schedule, ScheduleError, ScheduleOptions, SheetOptions, Table};
use tiling::{Boundary, Options, find_tiling};

fn of(mesh: &PolygonMesh, tolerance: f64, mirror: bool) -> Result<Schedule, ScheduleError> {
    Schedule::of(mesh, &ScheduleOptions { tolerance: Some(tolerance), mirror }, &Monitor::new())
}

/// Polygons apart from one another, each turned, moved and tipped by numbers of its own.
fn scattered(shapes: &[Vec<[f64; 3]>]) -> PolygonMesh {
    let mut positions = Vec::new();
    let mut faces = Vec::new();
    for (k, shape) in shapes.iter().enumerate() {
        let turn = glam_rotation(0.7 * k as f64, 1.3 * k as f64 + 0.2);
        let first = positions.len() as u32;
        let n = shape.len();
        // The first corner differs from panel to panel.
        positions.extend((0..n).map(|c| turn(shape[(c + k) % n].into()) + DVec3::new(10.0 * k as f64, 3.0, -2.0)));
        faces.push((first..first + n as u32).collect::<Vec<u32>>());
    }
    PolygonMesh::from_polygons(positions, &faces).expect("indices in range")
}

/// About the z axis, then about the x axis.
fn glam_rotation(about_z: f64, about_x: f64) -> impl Fn(DVec3) -> DVec3 {
    move |p| {
        let (s, c) = about_z.sin_cos();
        let q = DVec3::new(c * p.x - s * p.y, s * p.x + c * p.y, p.z);
        let (s, c) = about_x.sin_cos();
        DVec3::new(q.x, c * q.y - s * q.z, s * q.y + c * q.z)
    }
}

const KITE: [[f64; 3]; 4] = [[0., 0., 0.], [3., 0., 0.], [2., 2., 0.], [0., 1., 0.]];

fn mirrored(shape: &[[f64; 3]]) -> Vec<[f64; 3]> {
    shape.iter().rev().map(|&[x, y, z]| [-x, y, z]).collect()
}

#[test]
fn a_regular_tiling_has_two_types_and_one_class_of_edges() {
    let boundary = Boundary::new(&[5, 6, 5].repeat(6)).expect("an outline");
    let tiling = find_tiling(&boundary, 0, &Options { memory: 1 << 24 }, &Monitor::new()).expect("enough memory");
    let mesh = tiling.expect("it has tilings").mesh(2.0);
    let schedule = of(&mesh, 1e-6, false).expect("triangles and squares");
    let sizes = mesh.faces().fold([0; 2], |mut sizes, face| {
        sizes[face.len() - 3] += 1;
        sizes
    });
    let found: Vec<(String, u32)> = schedule.types.iter().map(|row| (row.name.clone(), row.count)).collect();
    assert_eq!(found, [("T1".to_owned(), sizes[0]), ("Q1".to_owned(), sizes[1])]);
    assert_eq!(schedule.edge_classes.len(), 1);
    assert!((schedule.edge_classes[0].length - 2.0).abs() < 1e-12);
    for panel in &schedule.panels {
        let area = if panel.nodes.len() == 3 { 3f64.sqrt() } else { 4.0 };
        assert!((panel.area - area).abs() < 1e-12);
        assert!(panel.deviation < 1e-12 && panel.misfit < 1e-12 && !panel.mirrored);
    }
    // Each inner edge has two panels, which name one another.
    for edge in &schedule.edges {
        if let [a, b] = edge.panels[..] {
            assert!(schedule.panels[a as usize].neighbours.contains(&Some(b)));
            assert!(schedule.panels[b as usize].neighbours.contains(&Some(a)));
        }
    }
    let borders = schedule.edges.iter().filter(|edge| edge.panels.len() == 1).count();
    assert_eq!(borders, 18);
}

#[test]
fn known_shapes_are_known_types_however_they_lie() {
    let triangle = vec![[0., 0., 0.], [1., 0., 0.], [0., 2., 0.]];
    let square = vec![[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.]];
    let longer = vec![[0., 0., 0.], [1.1, 0., 0.], [1.1, 1., 0.], [0., 1., 0.]];
    let kite = KITE.to_vec();
    let image = mirrored(&kite);
    let mesh = scattered(&[&kite, &square, &image, &triangle, &kite, &longer, &square, &square].map(Clone::clone));
    let kinds = |schedule: &Schedule| {
        let names = schedule.panels.iter().map(|panel| schedule.types[panel.kind as usize].name.clone());
        names.collect::<Vec<_>>()
    };
    let apart = of(&mesh, 1e-6, false).expect("panels");
    assert_eq!(kinds(&apart), ["Q2", "Q1", "Q3", "T1", "Q2", "Q4", "Q1", "Q1"]);
    let alike = of(&mesh, 1e-6, true).expect("panels");
    assert_eq!(kinds(&alike), ["Q1", "Q2", "Q1", "T1", "Q1", "Q3", "Q2", "Q2"]);
    let is_mirrored: Vec<bool> = alike.panels.iter().map(|panel| panel.mirrored).collect();
    assert_eq!(is_mirrored, [false, false, true, false, false, false, false, false]);
    // The longer one is 0.1 wider: each corner is 0.05 off.
    let loose = of(&mesh, 0.0501, false).expect("panels");
    assert_eq!(loose.types.len(), 4);
    assert_eq!(of(&mesh, 0.0499, false).expect("panels").types.len(), 5);
}

/// Greatest distance of a corner after the best of many turns: by trying, about the middle, without a formula.
fn misfit_by_trying(a: &[DVec3], b: &[DVec3]) -> f64 {
    let middle = |p: &[DVec3]| p.iter().sum::<DVec3>() / p.len() as f64;
    let (ma, mb) = (middle(a), middle(b));
    let n = a.len();
    (0..n)
        .flat_map(|first| (0..7200).map(move |turn| (first, f64::from(turn) * std::f64::consts::TAU / 7200.0)))
        .map(|(first, angle)| {
            let turn = glam_rotation(angle, 0.0);
            (0..n).map(|k| turn(a[(k + first) % n] - ma).distance(b[k] - mb)).fold(0.0, f64::max)
        })
        .fold(f64::INFINITY, f64::min)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    #[test]
    fn every_panel_is_within_the_tolerance_of_its_type_and_no_two_models_are(
        bumps in prop::collection::vec(-0.1..0.1f64, 8 * 12), tolerance in 0.02..0.15f64
    ) {
        let mut positions = Vec::new();
        for (k, bump) in bumps.chunks_exact(8).enumerate() {
            for (c, [x, y]) in [[0., 0.], [1., 0.], [1., 1.], [0., 1.]].into_iter().enumerate() {
                positions.push(DVec3::new(x + bump[2 * c] + 5.0 * k as f64, y + bump[2 * c + 1], 0.0));
            }
        }
        let faces: Vec<[u32; 4]> = (0..12).map(|k| [4 * k, 4 * k + 1, 4 * k + 2, 4 * k + 3]).collect();
        let mesh = PolygonMesh::from_polygons(positions, &faces).unwrap();
        let schedule = of(&mesh, tolerance, false).unwrap();
        let points = |f: u32| mesh.face_points(f as usize).collect::<Vec<_>>();
        for panel in &schedule.panels {
            let row = &schedule.types[panel.kind as usize];
            prop_assert!(panel.misfit <= tolerance);
            // Squared distances are made least, the greatest is judged: a little above the best.
            prop_assert!(misfit_by_trying(&points(panel.id), &points(row.model)) <= panel.misfit + 1e-3);
        }
        for (k, a) in schedule.types.iter().enumerate() {
            for b in &schedule.types[..k] {
                prop_assert!(misfit_by_trying(&points(a.model), &points(b.model)) > 0.7 * tolerance);
            }
        }
        prop_assert_eq!(schedule.types.iter().map(|row| row.count).sum::<u32>(), 12);
        for edge in &schedule.edges {
            let class = &schedule.edge_classes[edge.class as usize];
            prop_assert!((edge.length - class.length).abs() <= tolerance * (1.0 + 1e-12));
        }
        // All of it comes back from JSON, digit for digit.
        let text = schedule.to_json().unwrap();
        prop_assert_eq!(Schedule::from_json(&text).unwrap(), schedule);
    }
}

#[test]
fn tables_have_a_row_a_part_and_say_what_the_schedule_says() {
    let schedule = of(&scattered(&[KITE.to_vec(), mirrored(&KITE), KITE[..3].to_vec()]), 1e-6, true).expect("panels");
    let rows = |table: Table| {
        let text = schedule.to_csv(table).expect("a table");
        let mut lines = text.lines().map(|line| line.split(',').map(str::to_owned).collect::<Vec<_>>());
        let heads = lines.next().expect("headings");
        lines.map(|cells| heads.iter().cloned().zip(cells).collect::<BTreeMap<_, _>>()).collect::<Vec<_>>()
    };
    let panels = rows(Table::Panels);
    assert_eq!(panels.len(), 3);
    assert_eq!(panels[1]["mirrored"], "true");
    assert_eq!(panels[2]["node_4"], "");
    for (row, panel) in panels.iter().zip(&schedule.panels) {
        assert_eq!(row["area"].parse::<f64>().expect("a number"), panel.area);
        assert_eq!(row["edge_1"].parse::<f64>().expect("a number"), panel.edges[0]);
        assert_eq!(row["type"], schedule.types[panel.kind as usize].name);
    }
    assert_eq!(rows(Table::Types).iter().map(|row| row["count"].clone()).collect::<Vec<_>>(), ["1", "2"]);
    assert_eq!(rows(Table::Nodes).len(), 11);
    assert_eq!(rows(Table::Edges).len(), 11);
}

/// The numbers of the outlines in an SVG drawing.
fn outlines_of_svg(text: &str) -> Vec<Vec<[f64; 2]>> {
    let points = text.split("points=\"").skip(1).filter_map(|rest| rest.split('"').next());
    points
        .map(|list| {
            let pair = |word: &str| {
                let (x, y) = word.split_once(',').expect("x,y");
                [x.parse().expect("a number"), y.parse().expect("a number")]
            };
            list.split(' ').map(pair).collect()
        })
        .collect()
}

fn area(outline: &[[f64; 2]]) -> f64 {
    let n = outline.len();
    (0..n).map(|k| (outline[k], outline[(k + 1) % n])).map(|([a, b], [c, d])| (a * d - b * c) / 2.0).sum()
}

fn bounds(outline: &[[f64; 2]]) -> [f64; 4] {
    outline.iter().fold([f64::MAX, f64::MAX, f64::MIN, f64::MIN], |[a, b, c, d], p| {
        [a.min(p[0]), b.min(p[1]), c.max(p[0]), d.max(p[1])]
    })
}

fn many() -> Schedule {
    let shapes: Vec<Vec<[f64; 3]>> =
        (0..30).map(|k| if k % 3 == 0 { KITE[..3].to_vec() } else { KITE.to_vec() }).collect();
    of(&scattered(&shapes), 1e-6, false).expect("panels")
}

#[test]
fn drawings_hold_every_panel_once_at_its_size_and_apart() {
    let schedule = many();
    let options = SheetOptions { sheet: Some([12.0, 9.0]), gap: Some(0.25), ..SheetOptions::default() };
    let svg = schedule.unrolled(Format::Svg, &options, &Monitor::new()).expect("a drawing");
    assert_eq!(svg, schedule.unrolled(Format::Svg, &options, &Monitor::new()).expect("a drawing"));
    let text = schedule.unrolled(Format::Dxf, &options, &Monitor::new()).expect("a drawing");
    std::thread::sleep(std::time::Duration::from_millis(20));
    assert_eq!(text, schedule.unrolled(Format::Dxf, &options, &Monitor::new()).expect("a drawing"));
    let drawing = Drawing::load(&mut text.as_bytes()).expect("a DXF file");
    let lines = |layer: &str| {
        let own = drawing.entities().filter(|entity| entity.common.layer == layer);
        own.filter_map(|entity| match &entity.specific {
            EntityType::LwPolyline(line) if line.is_closed() => {
                Some(line.vertices.iter().map(|v| [v.x, v.y]).collect::<Vec<_>>())
            }
            _ => None,
        })
        .collect::<Vec<_>>()
    };
    let sheets: Vec<[f64; 4]> = lines("SHEET").iter().map(|sheet| bounds(sheet)).collect();
    assert!(sheets.len() > 1);
    for (k, (outlines, upwards)) in [(outlines_of_svg(&svg), -1.0), (lines("CUT"), 1.0)].into_iter().enumerate() {
        assert_eq!(outlines.len(), 30);
        let drawn: f64 = outlines.iter().map(|outline| upwards * area(outline)).sum();
        let real: f64 = schedule.panels.iter().map(|panel| panel.area * 1e6).sum();
        assert!((drawn - real).abs() < 1e-4 * real, "{drawn} {real}");
        assert!(outlines.iter().all(|outline| upwards * area(outline) > 0.0), "none is mirrored");
        let boxes: Vec<[f64; 4]> = outlines.iter().map(|outline| bounds(outline)).collect();
        for (i, a) in boxes.iter().enumerate() {
            if k == 1 {
                let inside = |s: &[f64; 4]| a[0] > s[0] && a[1] > s[1] && a[2] < s[2] && a[3] < s[3];
                assert_eq!(sheets.iter().filter(|sheet| inside(sheet)).count(), 1);
            }
            for b in &boxes[..i] {
                let gap = (a[0] - b[2]).max(b[0] - a[2]).max(a[1] - b[3]).max(b[1] - a[3]);
                assert!(gap > 249.0, "panels {gap} mm apart");
            }
        }
    }
    let ids = drawing.entities().filter_map(|entity| match &entity.specific {
        EntityType::Text(text) => Some(text.value.clone()),
        _ => None,
    });
    let mut ids: Vec<u32> = ids.filter_map(|text| text.split(' ').next()?.parse().ok()).collect();
    ids.sort_unstable();
    assert_eq!(ids, (0..30).collect::<Vec<_>>());
}

#[test]
fn a_sheet_too_small_names_the_panels() {
    let options = SheetOptions { sheet: Some([2.5, 2.5]), gap: Some(0.1), ..SheetOptions::default() };
    let error = many().unrolled(Format::Svg, &options, &Monitor::new()).expect_err("too small");
    assert!(matches!(error, ScheduleError::Sheet { ref panels, .. } if !panels.is_empty()), "{error}");
    for bad in [
        SheetOptions { sheet: Some([0.0, 1.0]), ..SheetOptions::default() },
        SheetOptions { gap: Some(-1.0), ..SheetOptions::default() },
        SheetOptions { millimetres: f64::NAN, ..SheetOptions::default() },
    ] {
        let error = many().unrolled(Format::Svg, &bad, &Monitor::new()).expect_err("out of range");
        assert!(matches!(error, ScheduleError::Option(_)), "{error}");
    }
}

#[test]
fn unusable_meshes_are_named() {
    let mut points: Vec<DVec3> = (0..6).map(|k| DVec3::new(f64::from(k), f64::from(k * k), 0.0)).collect();
    let mesh =
        |points: &[DVec3], faces: &[Vec<u32>]| PolygonMesh::from_polygons(points.to_vec(), faces).expect("indices");
    let good = vec![vec![0, 1, 2]];
    assert_eq!(of(&mesh(&points, &[]), 0.1, false), Err(ScheduleError::Empty));
    let pentagon = vec![vec![0, 1, 2], vec![0, 1, 2, 3, 4]];
    assert_eq!(of(&mesh(&points, &pentagon), 0.1, false), Err(ScheduleError::Ngons(vec![1])));
    let twice = vec![vec![0, 1, 2], vec![0, 1, 2, 1]];
    assert_eq!(of(&mesh(&points, &twice), 0.1, false), Err(ScheduleError::Degenerate(vec![1])));
    assert!(matches!(of(&mesh(&points, &good), 0.0, false), Err(ScheduleError::Option(_))));
    points[5].y = f64::NAN;
    assert_eq!(of(&mesh(&points, &good), 0.1, false), Err(ScheduleError::NotFinite(vec![5])));
    let line: Vec<DVec3> = (0..3).map(|k| DVec3::new(f64::from(k), 0.0, 0.0)).collect();
    assert_eq!(of(&mesh(&line, &good), 0.1, false), Err(ScheduleError::NoArea(vec![0])));
}

#[test]
fn texts_that_are_no_schedule_are_refused() {
    let text = of(&scattered(&[KITE.to_vec()]), 1e-6, false).expect("a panel").to_json().expect("text");
    assert!(Schedule::from_json(&text).is_ok());
    for (from, to) in [
        ("{", "["),
        ("\"version\": 1", "\"version\": 99"),
        ("\"kind\": 0", "\"kind\": 7"),
        ("\"model\": 0", "\"model\": 3"),
        ("\"first\": 0", "\"first\": 4"),
        ("\"class\": 0", "\"class\": 44"),
    ] {
        assert!(text.contains(from), "{from}");
        let error = Schedule::from_json(&text.replacen(from, to, 1)).expect_err("broken");
        assert!(matches!(error, ScheduleError::Text(_)), "{error}");
    }
}

#[test]
fn many_different_panels_take_no_quadratic_time() {
    // 20,000 panels of about as many types.
    let n = 142_u32;
    let height = |i: u32, j: u32| (f64::from(i * i) * 0.37).sin() * 0.05 + (f64::from(j * j) * 0.73).cos() * 0.05;
    let positions = (0..=n)
        .flat_map(|i| {
            (0..=n).map(move |j| DVec3::new(f64::from(i) + height(j, i), f64::from(j) + height(i, j), height(i, j)))
        })
        .collect();
    let at = |i: u32, j: u32| i * (n + 1) + j;
    let faces: Vec<[u32; 4]> = (0..n)
        .flat_map(|i| (0..n).map(move |j| (i, j)))
        .map(|(i, j)| [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)])
        .collect();
    let mesh = PolygonMesh::from_polygons(positions, &faces).expect("a grid");
    let start = std::time::Instant::now();
    let schedule = of(&mesh, 1e-3, false).expect("panels");
    assert!(schedule.types.len() > 10_000, "{}", schedule.types.len());
    assert!(start.elapsed().as_secs() < 20, "{:?}", start.elapsed());
}
