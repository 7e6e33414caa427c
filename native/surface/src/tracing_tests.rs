use super::*;
use crate::cross_field::cross_field;
use testkit::plane_region::{circle, plane_region, subdivided};

fn corners_of(mesh: &TriangleMesh, topology: &Topology) -> Vec<Corner> {
    let field = cross_field(mesh, topology, &[], &[]).expect("a field");
    Corner::of_mesh(mesh, &field.face_directions)
}

fn place(mesh: &TriangleMesh, point: TracePoint) -> DVec3 {
    match point {
        TracePoint::Vertex(v) => mesh.positions[v as usize],
        TracePoint::Edge(a, b, t) => mesh.positions[a as usize].lerp(mesh.positions[b as usize], t),
    }
}

/// Lands within 45 degrees of the middle of any border vertex's angle.
fn land(graph: &FieldGraph, topology: &Topology, v: u32, back: f64) -> Visit {
    if !topology.is_border_vertex(v) {
        return Visit::Pass;
    }
    if (back - graph.angle(v) / 2.0).abs() < FRAC_PI_4 { Visit::Land(0.0) } else { Visit::Block }
}

#[test]
fn traces_in_a_rectangle_are_straight() {
    let rectangle = [(0.0, 0.0), (4.0, 0.0), (4.0, 3.0), (0.0, 3.0)].map(DVec2::from);
    let mesh = plane_region(&[subdivided(&rectangle, 0.25)], |p| p.extend(0.0));
    let topology = Topology::of_triangles(&mesh);
    let corners = corners_of(&mesh, &topology);
    let graph = FieldGraph::new(topology.clone(), corners);
    for v in (0..mesh.positions.len() as u32).filter(|&v| topology.is_border_vertex(v)) {
        let p = mesh.positions[v as usize];
        if rectangle.iter().any(|&c| c == p.truncate()) {
            continue;
        }
        let trace = graph.trace(v, graph.angle(v) / 2.0, &TraceOptions::default(), f64::INFINITY, |u, back| {
            land(&graph, &topology, u, back)
        });
        let trace = trace.expect("a trace");
        let width = if p.y == 0.0 || p.y == 3.0 { 3.0 } else { 4.0 };
        let q = mesh.positions[trace.end() as usize];
        assert!((q - p).length() < width * 1.01, "{p} to {q}");
        assert!(trace.length < width * 1.03, "{} for {width}", trace.length);
    }
}

#[test]
fn lengths_and_angles_agree_with_the_points() {
    let mesh = plane_region(&[circle(DVec2::ZERO, 2.0, 36)], |p| p.extend(0.7 * (-0.4 * p.length_squared()).exp()));
    let topology = Topology::of_triangles(&mesh);
    let corners = corners_of(&mesh, &topology);
    let graph = FieldGraph::new(topology.clone(), corners);
    let mut traced = 0;
    for v in 0..36 {
        let Some(trace) = graph.trace(v, graph.angle(v) / 2.0, &TraceOptions::default(), f64::INFINITY, |u, back| {
            land(&graph, &topology, u, back)
        }) else {
            continue;
        };
        traced += 1;
        let points: Vec<DVec3> = trace.points.iter().map(|&p| place(&mesh, p)).collect();
        let length: f64 = points.windows(2).map(|w| w[0].distance(w[1])).sum();
        assert!((length - trace.length).abs() < 1e-9 * length);
        // Straight between vertices when unfolded: consecutive points share a triangle.
        for w in trace.points.windows(2) {
            let on = |p: TracePoint, t: &[u32; 3]| match p {
                TracePoint::Vertex(v) => t.contains(&v),
                TracePoint::Edge(a, b, _) => t.contains(&a) && t.contains(&b),
            };
            assert!(mesh.triangles.iter().any(|t| on(w[0], t) && on(w[1], t)));
        }
        // The angle of arrival, measured with the triangles about the end.
        let end = trace.end();
        let back = points[points.len() - 2] - points[points.len() - 1];
        let mut sum = 0.0;
        let mut seen = None;
        for h in topology.around(end) {
            let [a, b] = [topology.to(h), topology.from(topology.prev[h as usize])]
                .map(|u| mesh.positions[u as usize] - mesh.positions[end as usize]);
            let (left, right) = (a.angle_between(back), back.angle_between(b));
            if (left + right - a.angle_between(b)).abs() < 1e-6 {
                seen.get_or_insert(sum + left);
            }
            sum += a.angle_between(b);
        }
        assert!((seen.expect("between two edges") - trace.arrival()).abs() < 1e-6);
    }
    assert!(traced >= 30, "{traced} of 36");
}

#[test]
fn arcs_see_about_two_dozen_vertices_and_both_ways() {
    let mesh = plane_region(&[circle(DVec2::ZERO, 2.0, 36)], |p| p.extend(0.3 * p.x * p.y));
    let topology = Topology::of_triangles(&mesh);
    let corners = corners_of(&mesh, &topology);
    let graph = FieldGraph::new(topology.clone(), corners);
    let arcs = |v: u32| &graph.arcs(v).arcs;
    let interior: Vec<u32> = (0..mesh.positions.len() as u32).filter(|&v| !topology.is_border_vertex(v)).collect();
    let mean = interior.iter().map(|&v| arcs(v).len()).sum::<usize>() / interior.len();
    assert!((16..40).contains(&mean), "{mean}");
    for v in 0..mesh.positions.len() as u32 {
        for arc in arcs(v) {
            let same = |other: &&Arc| {
                other.to == v
                    && (other.length - arc.length).abs() < 1e-9
                    && graph.difference(v, other.back, arc.leave).abs() < 1e-6
                    && graph.difference(arc.to, other.leave, arc.back).abs() < 1e-6
            };
            assert!(arcs(arc.to).iter().any(|other| same(&other)), "{v} to {}", arc.to);
        }
    }
}

#[test]
fn limits_and_walls_stop_the_search() {
    let mesh = plane_region(&[circle(DVec2::ZERO, 2.0, 36)], |p| p.extend(0.0));
    let topology = Topology::of_triangles(&mesh);
    let corners = corners_of(&mesh, &topology);
    let graph = FieldGraph::new(topology.clone(), corners);
    let from = |limit: f64, wall: bool| {
        graph.trace(0, graph.angle(0) / 2.0, &TraceOptions::default(), limit, |u, back| {
            if wall && topology.is_border_vertex(u) { Visit::Block } else { land(&graph, &topology, u, back) }
        })
    };
    assert!(from(f64::INFINITY, false).is_some());
    assert!(from(0.5, false).is_none());
    assert!(from(f64::INFINITY, true).is_none());
}
