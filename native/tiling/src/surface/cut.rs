//! Cutting a surface into disks that can be laid flat (section 4.2.1: "subdivide it into sub-surfaces of disk topology").
//!
//! The surface is cut along marked edges first. A piece with several borders is cut by a plane through two of them, which
//! makes two pieces of a ring: one slit along a path would lie beside itself when laid flat. A closed piece, or one with handles,
//! is cut by the plane across the middle of its longest axis. So is a disk whose
//! conformal map folds, overlaps itself or shrinks a part of it too much, and one that is curved so much that the search for
//! partitions, whose cost grows with the defect to be shared out, would find nothing good in it. (The paper cuts a sphere by
//! hand, into six slices of 120 degrees each.)

use super::chart::{Chart, vertex_curvature};
use glam::DMat3;
use mesh::{Cancelled, DVec3, Monitor, NONE, Topology, TriangleMesh, sorted};
use std::collections::{BTreeMap, BTreeSet};

/// Most pieces; a surface that needs more has no patches larger than its panels.
const MOST_PIECES: usize = 96;

/// Pieces smaller than this, in squared edges, are not cut for their curvature; nor are any when there are so many.
const LEAST_AREA: f64 = 30.0;
const MANY_PIECES: usize = 48;

/// A plane is moved to the end of another cut by so many edges at most.
const REACH: f64 = 2.0;

/// A vertex this near to a cutting plane, in the shortest of its edges, counts as on it.
const ON_PLANE: f64 = 0.12;

/// A surface in charts.
pub(super) struct Cut {
    /// The triangles, some of them divided by cuts.
    pub mesh: TriangleMesh,
    /// Marked edges by the vertices of `mesh`.
    pub marked: BTreeSet<[u32; 2]>,
    /// Marked edges and cuts.
    pub edges: BTreeSet<[u32; 2]>,
    pub charts: Vec<Chart>,
}

/// A piece of the surface: triangles that no cut divides, with a vertex of their own for each fan.
pub(super) struct Piece {
    pub mesh: TriangleMesh,
    /// Vertex of the whole for each of the piece's.
    pub origin: Vec<u32>,
}

/// The charts, each with less curvature of one sign than `most_curvature`, in units of 30 degrees, where it is large enough to be
/// cut for that; `None` when the pieces become too many.
pub(super) fn cut(
    mesh: &TriangleMesh,
    marked: &[[u32; 2]],
    edge_length: f64,
    most_curvature: f64,
    monitor: &Monitor,
) -> Result<Option<Cut>, Cancelled> {
    let mut mesh = mesh.clone();
    let mut marked: BTreeSet<[u32; 2]> = marked.iter().copied().collect();
    let mut edges = marked.clone();
    // Charts of pieces that later cuts left as they were, by the triangles of the whole.
    let mut known: BTreeMap<Vec<[u32; 3]>, Chart> = BTreeMap::new();
    loop {
        monitor.stage("cutting", 0.0)?;
        let pieces = pieces(&mesh, &edges);
        if pieces.len() > MOST_PIECES {
            return Ok(None);
        }
        let mut has_cut = false;
        for piece in &pieces {
            monitor.check()?;
            let topology = Topology::of_triangles(&piece.mesh);
            let loops = topology.border_loops();
            if loops.len() > 1 {
                let plane = plane_across_borders(&piece.mesh, &topology, &loops);
                if !divide(&mut mesh, &mut [&mut edges, &mut marked], piece, plane) {
                    return Ok(None);
                }
                has_cut = true;
                break;
            }
        }
        if has_cut {
            continue;
        }
        let curvature = vertex_curvature(&mesh);
        let is_many = pieces.len() >= MANY_PIECES;
        let mut charts: Vec<(Vec<[u32; 3]>, Chart)> = Vec::new();
        for piece in pieces {
            monitor.check()?;
            let key: Vec<[u32; 3]> = piece.triangles_of_whole().collect();
            if let Some(chart) = known.remove(&key) {
                charts.push((key, chart));
                continue;
            }
            let (piece, is_needed) = match Chart::new(piece) {
                Ok(mut chart) => {
                    chart.gather(&curvature, edge_length);
                    let [plus, minus] = chart.whole_curvature();
                    let is_small = chart.area() < LEAST_AREA * edge_length.powi(2);
                    if plus.max(-minus) <= most_curvature || is_small || is_many {
                        charts.push((key, chart));
                        continue;
                    }
                    let piece = Piece { mesh: chart.mesh.clone(), origin: chart.origin.clone() };
                    charts.push((key, chart));
                    (piece, false)
                }
                Err(piece) => (piece, true),
            };
            has_cut = bisect(&mut mesh, &mut [&mut edges, &mut marked], &piece, REACH * edge_length);
            if has_cut {
                break;
            }
            if is_needed {
                return Ok(None);
            }
        }
        if !has_cut {
            let charts = charts.into_iter().map(|(_, chart)| chart).collect();
            return Ok(Some(Cut { mesh, marked, edges, charts }));
        }
        known.extend(charts);
    }
}

impl Piece {
    /// Its triangles, by vertices of the whole.
    fn triangles_of_whole(&self) -> impl Iterator<Item = [u32; 3]> {
        self.mesh.triangles.iter().map(|t| t.map(|v| self.origin[v as usize]))
    }
}

/// The parts between cuts.
pub(super) fn pieces(mesh: &TriangleMesh, edges: &BTreeSet<[u32; 2]>) -> Vec<Piece> {
    let topology = Topology::of_triangles(mesh);
    let is_cut =
        |h: u32| topology.twin[h as usize] == NONE || edges.contains(&sorted(topology.from(h), topology.to(h)));
    let mut piece_of = vec![NONE; mesh.triangles.len()];
    let mut triangles: Vec<Vec<u32>> = Vec::new();
    for start in 0..mesh.triangles.len() {
        if piece_of[start] != NONE {
            continue;
        }
        let index = triangles.len() as u32;
        piece_of[start] = index;
        let mut found = vec![start as u32];
        let mut next = 0;
        while next < found.len() {
            for k in 0..3 {
                let h = 3 * found[next] + k;
                if !is_cut(h) {
                    let other = topology.twin[h as usize] / 3;
                    if piece_of[other as usize] == NONE {
                        piece_of[other as usize] = index;
                        found.push(other);
                    }
                }
            }
            next += 1;
        }
        found.sort_unstable();
        triangles.push(found);
    }
    // Corners joined across edges that are not cut are one vertex.
    let mut fan = vec![NONE; topology.len()];
    triangles
        .into_iter()
        .map(|found| {
            let (mut positions, mut origin) = (Vec::new(), Vec::new());
            for corner in found.iter().flat_map(|&t| [3 * t, 3 * t + 1, 3 * t + 2]) {
                if fan[corner as usize] != NONE {
                    continue;
                }
                let vertex = positions.len() as u32;
                let v = topology.from(corner);
                positions.push(mesh.positions[v as usize]);
                origin.push(v);
                let mut open = vec![corner];
                while let Some(c) = open.pop() {
                    if std::mem::replace(&mut fan[c as usize], vertex) != NONE {
                        continue;
                    }
                    if !is_cut(c) {
                        open.push(topology.next[topology.twin[c as usize] as usize]);
                    }
                    let before = topology.prev[c as usize];
                    if !is_cut(before) {
                        open.push(topology.twin[before as usize]);
                    }
                    open.retain(|&c| fan[c as usize] == NONE);
                }
            }
            let corners = found.iter().map(|&t| [0, 1, 2].map(|k| fan[3 * t as usize + k])).collect();
            Piece { mesh: TriangleMesh { positions, triangles: corners }, origin }
        })
        .collect()
}

/// A point of a plane and its normal.
type Plane = [DVec3; 2];

/// The plane that cuts two borders of a piece: through the middles of the shortest and of the one nearest to it, upright on
/// the surface; so a tube is halved along, and a frame across.
fn plane_across_borders(mesh: &TriangleMesh, topology: &Topology, loops: &[Vec<u32>]) -> Plane {
    let of_loop = |border: &Vec<u32>| {
        let points: Vec<DVec3> = border.iter().map(|&h| mesh.positions[topology.from(h) as usize]).collect();
        let length = |k: usize| points[k].distance(points[(k + 1) % points.len()]);
        let whole: f64 = (0..points.len()).map(length).sum();
        let middle = |k: usize| length(k) * points[k].midpoint(points[(k + 1) % points.len()]);
        (whole, (0..points.len()).map(middle).sum::<DVec3>() / whole.max(f64::MIN_POSITIVE))
    };
    let middles: Vec<(f64, DVec3)> = loops.iter().map(of_loop).collect();
    let shortest = (0..loops.len()).min_by(|&a, &b| middles[a].0.total_cmp(&middles[b].0)).unwrap_or(0);
    let from = middles[shortest].1;
    let others = (0..loops.len()).filter(|&k| k != shortest).map(|k| middles[k].1);
    let to = others.min_by(|a, b| a.distance(from).total_cmp(&b.distance(from))).unwrap_or(from);
    let areas = (0..mesh.triangles.len()).map(|t| mesh.area_normal(t));
    let (up, area) = areas.fold((DVec3::ZERO, 0.0), |(up, area), a| (up + a, area + a.length()));
    let size = area.sqrt();
    let along = (to - from) / size.max(f64::MIN_POSITIVE);
    let up = if up.length() > 0.1 * area { up.normalize() } else { DVec3::ZERO };
    // Where these leave the plane free, it is the one across the longest axis, made to contain the other.
    let centre = 0.5 * (from + to);
    let across = along.cross(up);
    if across.length() > 0.05 {
        return [centre, across.normalize()];
    }
    let kept = if up == DVec3::ZERO { along.normalize_or_zero() } else { up };
    let axis = longest_axis(mesh, centre, kept);
    [centre, axis]
}

/// The shortest edge at each vertex.
fn shortest_edges(mesh: &TriangleMesh) -> Vec<f64> {
    let mut shortest = vec![f64::INFINITY; mesh.positions.len()];
    for corners in &mesh.triangles {
        for k in 0..3 {
            let ends = [corners[k], corners[(k + 1) % 3]].map(|v| v as usize);
            let length = mesh.positions[ends[0]].distance(mesh.positions[ends[1]]);
            for &v in &ends {
                shortest[v] = shortest[v].min(length);
            }
        }
    }
    shortest
}

/// Divides a piece by the plane across its longest axis, or through the end of another cut within `reach` of that; whether it did.
fn bisect(mesh: &mut TriangleMesh, edge_sets: &mut [&mut BTreeSet<[u32; 2]>; 2], piece: &Piece, reach: f64) -> bool {
    let (mut area, mut centre) = (0.0, DVec3::ZERO);
    for t in 0..piece.mesh.triangles.len() {
        let weight = piece.mesh.area_normal(t).length();
        centre += weight * piece.mesh.points(t).iter().sum::<DVec3>() / 3.0;
        area += weight;
    }
    centre /= area;
    let axis = longest_axis(&piece.mesh, centre, DVec3::ZERO);
    // A cut that ends on the border of the piece near the plane goes on through it: charts had a side shorter than panels else.
    let mut lines_at: BTreeMap<u32, u32> = BTreeMap::new();
    for &v in edge_sets[0].iter().flatten() {
        *lines_at.entry(v).or_default() += 1;
    }
    let nodes = piece.origin.iter().zip(&piece.mesh.positions).filter(|(v, _)| lines_at.get(v).is_some_and(|&n| n > 2));
    let heights = nodes.map(|(_, &p)| (p - centre).dot(axis)).filter(|h| h.abs() < reach);
    let nearest = heights.min_by(|a, b| a.abs().total_cmp(&b.abs())).unwrap_or(0.0);
    let centre = centre + nearest * axis;
    divide(mesh, edge_sets, piece, [centre, axis])
}

/// Divides a piece by a plane, splitting the edges that the plane meets; whether it did.
fn divide(
    mesh: &mut TriangleMesh,
    edge_sets: &mut [&mut BTreeSet<[u32; 2]>; 2],
    piece: &Piece,
    [centre, axis]: Plane,
) -> bool {
    let near = shortest_edges(&piece.mesh);
    // The height over the plane, by vertices of the whole: those of other pieces are not cut.
    let mut height: BTreeMap<u32, f64> = BTreeMap::new();
    for ((&v, p), near) in piece.origin.iter().zip(&piece.mesh.positions).zip(near) {
        let h = (*p - centre).dot(axis);
        height.insert(v, if h.abs() < ON_PLANE * near { 0.0 } else { h });
    }
    let inside: BTreeSet<[u32; 3]> = piece.triangles_of_whole().collect();
    let mut middle: BTreeMap<[u32; 2], u32> = BTreeMap::new();
    for corners in &inside {
        for k in 0..3 {
            let (a, b) = (corners[k], corners[(k + 1) % 3]);
            let (low, high) = (height[&a.min(b)], height[&a.max(b)]);
            if low * high < 0.0 {
                middle.entry(sorted(a, b)).or_insert_with(|| {
                    let [p, q] = sorted(a, b).map(|v| mesh.positions[v as usize]);
                    mesh.positions.push(p.lerp(q, low / (low - high)));
                    mesh.positions.len() as u32 - 1
                });
            }
        }
    }
    let mut added: BTreeSet<[u32; 2]> = BTreeSet::new();
    let new: BTreeSet<u32> = middle.values().copied().collect();
    let is_zero = |v: u32| height.get(&v) == Some(&0.0) || new.contains(&v);
    let mut triangles = Vec::with_capacity(mesh.triangles.len());
    for &corners in &mesh.triangles {
        let is_inside = inside.contains(&corners);
        let made = divided(corners, &middle);
        if is_inside && made.iter().all(|t| !t.iter().all(|&v| is_zero(v))) {
            for t in &made {
                for k in 0..3 {
                    if is_zero(t[k]) && is_zero(t[(k + 1) % 3]) {
                        added.insert(sorted(t[k], t[(k + 1) % 3]));
                    }
                }
            }
        }
        triangles.extend(made);
    }
    mesh.triangles = triangles;
    for set in edge_sets.iter_mut() {
        for (&[a, b], &m) in &middle {
            if set.remove(&[a, b]) {
                set.extend([sorted(a, m), sorted(b, m)]);
            }
        }
    }
    let border: BTreeSet<[u32; 2]> = {
        let topology = Topology::of_triangles(mesh);
        topology.edges().filter(|&h| topology.is_border(h)).map(|h| sorted(topology.from(h), topology.to(h))).collect()
    };
    let before = edge_sets[0].len();
    edge_sets[0].extend(added.difference(&border));
    edge_sets[0].len() > before
}

/// A triangle with some edges split.
fn divided(corners: [u32; 3], middle: &BTreeMap<[u32; 2], u32>) -> Vec<[u32; 3]> {
    let at = |k: usize| middle.get(&sorted(corners[k % 3], corners[(k + 1) % 3])).copied();
    let split: Vec<usize> = (0..3).filter(|&k| at(k).is_some()).collect();
    match split.as_slice() {
        [] => vec![corners],
        &[k] => {
            let m = at(k).expect("split");
            let (a, b, c) = (corners[k], corners[(k + 1) % 3], corners[(k + 2) % 3]);
            vec![[a, m, c], [m, b, c]]
        }
        _ => {
            // Two: the corner between them comes off, the rest is halved.
            let k = (0..3).find(|&k| at(k).is_some() && at(k + 2).is_some()).expect("two split edges share a corner");
            let (a, b, c) = (corners[k], corners[(k + 1) % 3], corners[(k + 2) % 3]);
            let (after, before) = (at(k).expect("split"), at(k + 2).expect("split"));
            vec![[a, after, before], [after, b, c], [after, c, before]]
        }
    }
}

/// Direction in which the triangles spread most, of those at right angles to `kept`.
fn longest_axis(mesh: &TriangleMesh, centre: DVec3, kept: DVec3) -> DVec3 {
    let mut spread = DMat3::ZERO;
    for t in 0..mesh.triangles.len() {
        let weight = mesh.area_normal(t).length();
        let d = mesh.points(t).iter().sum::<DVec3>() / 3.0 - centre;
        let d = d - d.dot(kept) * kept;
        spread += DMat3::from_cols(d.x * d, d.y * d, d.z * d) * weight;
    }
    // Power iteration; ties, as on a sphere, are broken by where it starts.
    let start = DVec3::new(0.3, 0.2, 1.0);
    let mut axis = (start - start.dot(kept) * kept).normalize();
    for _ in 0..64 {
        axis = (spread * axis).try_normalize().unwrap_or(axis);
    }
    axis
}
