//! Divides a triangulated region into disks of three to six sides: `QuadMixer` (Nuvoli et al. 2019), section 3.2.1.
//!
//! [`trace_layout`] classifies the border's corners, computes a cross field that follows the border and turns with them, and cuts along field-aligned
//! traces until every part is a patch that patterns can fill. Traces start and end at border vertices or on other traces
//! (T-junctions); where a T-junction divides a patch's side, the side consists of several sub-sides, the unknowns of the
//! quantisation of section 3.3.
//!
//! Deviations: traces are cut one at a time (see `divide`), so tangential crossings cannot arise; a corner's class is its number of quads
//! (see `region`), so figure 8's rules are one rule; annuli get at least two traces, because a patch must not meet itself;
//! interior feature chains are cut first and become sides; the bends of a coarse round curve are not taken for corners; the field turns at
//! corners as their quarters ask for, see [`field`], and cuts leave the sides that it asks for, where they can, see `divide`.

mod assemble;
mod canvas;
mod divide;
mod preview;
mod refine;
mod region;

pub use region::CornerAngles;

use canvas::Canvas;
use divide::{Step, divide, open_closed};
use glam::DVec3;
use mesh::{Cancelled, Monitor, Topology, TriangleMesh};
use ordered_float::OrderedFloat;
use region::{Bend, Outline, Region};
use solve::components::connected_components;
use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::{FRAC_PI_2, PI};
use surface::cross_field::{CrossFieldError, cross_field, singularities};
use surface::tracing::TraceOptions;

/// Singularities that cancel are left out where they are closer than this, in edge lengths.
const NEAR: f64 = 6.0;

/// How a region is divided.
#[derive(Debug, Clone, Copy)]
pub struct LayoutOptions {
    /// Which corners are convex, flat and concave.
    pub corners: CornerAngles,
    /// How traces follow the field.
    pub trace: TraceOptions,
    /// A patch whose side bends by more than this in total is divided further when a trace allows it, so that its quads can
    /// turn gradually; radians. Default: 135 degrees.
    pub side_turn: f64,
    /// A patch with a longer side is divided further when a trace allows it; scene units. Default: none is too long.
    pub longest: f64,
    /// Times that the interior edges are halved before tracing. Default: 1; more is smoother and four times slower.
    pub refinements: u32,
    /// Whether parts have the sides that the field asks for, where a cut only shortens them, traces end where others do, and the field turns
    /// at corners as their quarters say. Default: no. It made no difference to 200 booleans, whose borders are given edge by edge; where
    /// counts are free, simple sheets have three- and five-sided patches without it.
    pub regular: bool,
    /// Whether a part between features that cannot be divided is left out instead of an error. Default: no.
    pub partial: bool,
}

impl Default for LayoutOptions {
    fn default() -> Self {
        Self {
            corners: CornerAngles::default(),
            trace: TraceOptions::default(),
            side_turn: PI * 0.75,
            longest: f64::INFINITY,
            refinements: 1,
            regular: false,
            partial: false,
        }
    }
}

/// What a sub-side runs along.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SubSideKind {
    /// The border of the region: its number of edges is fixed.
    Border,
    /// An interior feature chain.
    Feature,
    /// A trace.
    Trace,
}

/// A stretch of a side that no other side's end interrupts: one unknown of the quantisation.
#[derive(Debug, Clone, PartialEq)]
pub struct SubSide {
    /// Path in the layout's mesh, both ends included. Along the border, consecutive vertices are the output's vertices.
    pub vertices: Vec<u32>,
    /// What it runs along.
    pub kind: SubSideKind,
    /// Length, scene units.
    pub length: f64,
}

impl SubSide {
    /// The number of quads along it when that is not free.
    pub fn fixed_count(&self) -> Option<usize> {
        (self.kind == SubSideKind::Border).then(|| self.vertices.len() - 1)
    }
}

/// A disk with three to six sides.
#[derive(Debug, Clone, PartialEq)]
pub struct Patch {
    /// Its triangles in the layout's mesh.
    pub triangles: Vec<u32>,
    /// The vertex where each side starts, counter-clockwise.
    pub corners: Vec<u32>,
    /// Sides counter-clockwise, each a list of sub-sides counter-clockwise.
    pub sides: Vec<Vec<u32>>,
    /// The part between features that it belongs to, see [`parts`].
    pub part: u32,
}

/// A region divided into patches.
#[derive(Debug, Clone, PartialEq)]
pub struct PatchLayout {
    /// The region's surface, refined: the given vertices first and unmoved, then new ones on its edges.
    pub mesh: TriangleMesh,
    /// Disks of three to six sides that together hold every triangle once.
    pub patches: Vec<Patch>,
    /// Where patches meet the border and one another.
    pub sub_sides: Vec<SubSide>,
    /// Concave corners of the border that no trace could divide: each time one occurs here, it counts a quad less. Their quads
    /// have wide angles.
    pub flattened: Vec<u32>,
    /// Parts between features that have no patches: only with [`LayoutOptions::partial`].
    pub undivided: Vec<Undivided>,
}

/// A part between features, see [`parts`], that could not be divided.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Undivided {
    /// The part.
    pub part: u32,
    /// What is wrong with a piece of it that no trace divides.
    pub fault: Fault,
    /// The given triangles nearest to that piece: those that share a vertex with it.
    pub triangles: Vec<u32>,
}

impl PatchLayout {
    /// The vertices along one side of a patch, counter-clockwise, both corners included.
    pub fn side_path(&self, patch: usize, side: usize) -> Vec<u32> {
        let patch = &self.patches[patch];
        let mut path = vec![patch.corners[side]];
        for &sub in &patch.sides[side] {
            let vertices = &self.sub_sides[sub as usize].vertices;
            if path.last() == vertices.first() {
                path.extend(&vertices[1..]);
            } else {
                path.extend(vertices.iter().rev().skip(1));
            }
        }
        path
    }
}

/// What is wrong with a part that could not be divided further.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum Fault {
    /// No first cut opens it.
    #[error("is closed")]
    Closed,
    /// A slit's tip that no trace leaves.
    #[error("has a concave corner that no trace can divide")]
    Concave,
    /// Holes or handles remain.
    #[error("is not a disk (Euler characteristic {euler_characteristic})")]
    NotDisk {
        /// 1 for a disk.
        euler_characteristic: i64,
    },
    /// It meets itself along a trace.
    #[error("meets itself along a trace")]
    TouchesItself,
    /// Too few or too many sides.
    #[error("has {count} sides instead of 3 to 6")]
    Sides {
        /// Number of convex corners.
        count: usize,
    },
}

/// Why a region could not be divided.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum LayoutError {
    /// Two fans meet at one vertex, or an edge has more than two triangles.
    #[error("the region is not manifold at vertex {vertex}; separate the parts that meet there")]
    NotManifold {
        /// The first such vertex.
        vertex: u32,
    },
    /// The field could not be computed.
    #[error(transparent)]
    Field(#[from] CrossFieldError),
    /// A part remains that is no patch and that no trace improves.
    #[error("a part of {} triangles {fault}, and no trace divides it; use another filler or a finer mesh", triangles.len())]
    NoTrace {
        /// What is wrong with the part.
        fault: Fault,
        /// The given triangles nearest to the part: those that share a vertex with it.
        triangles: Vec<u32>,
    },
    /// The caller wants to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// Divides a region (any number of components; a closed one is cut open first) into patches. Every border vertex is a vertex of the
/// output; `features` are interior edges (vertex pairs) that must become sides. The mesh should be isotropic with edges about
/// as long as the border's.
///
/// Costs O(traces * n log n) in the triangles n of each region traced: about 10 ms for a region of 150
/// triangles and 10 traces, 0.25 s for 750 triangles and 30 traces.
/// The same input gives the same bytes.
///
/// # Errors
/// [`LayoutError`]; `NoTrace` when the method fails on valid input.
pub fn trace_layout(
    mesh: &TriangleMesh,
    features: &[[u32; 2]],
    options: &LayoutOptions,
    monitor: &Monitor,
) -> Result<PatchLayout, LayoutError> {
    check(mesh)?;
    let (mut fine, mut chains) = (mesh.clone(), features.to_vec());
    for _ in 0..options.refinements {
        (fine, chains) = refine::refine(&fine, &Topology::of_triangles(&fine), &chains);
    }
    let field = if options.regular {
        field(&fine, &chains, &options.corners)?
    } else {
        cross_field(&fine, &Topology::of_triangles(&fine), &chains, &[])?.face_directions
    };
    trace_along(&fine, &chains, &field, options, monitor)
}

/// A surface and its parts between features, with the quarters of their corners. `index` is that of the cross at each vertex.
fn regions(
    mesh: &TriangleMesh,
    features: &[[u32; 2]],
    field: &[DVec3],
    index: Vec<i8>,
    edge_length: f64,
    corners: &CornerAngles,
) -> (Canvas, Vec<Region>) {
    let (mut canvas, regions) = Canvas::new(mesh, features, field, index, edge_length);
    let mut settled = canvas.fixed.clone();
    for region in &regions {
        for v in classify(&mut canvas, region, corners) {
            settled[v as usize] = true;
        }
    }
    even_out(&mut canvas, &settled, corners.slack);
    (canvas, regions)
}

/// A direction of the cross of each triangle: a smooth cross field that follows the border and the features, and turns at their corners
/// as many quarters as quads are to meet there. The cost is that of [`cross_field`].
///
/// # Errors
/// [`LayoutError::Field`].
pub fn field(mesh: &TriangleMesh, features: &[[u32; 2]], corners: &CornerAngles) -> Result<Vec<DVec3>, LayoutError> {
    let blank = vec![DVec3::ZERO; mesh.triangles.len()];
    let (canvas, regions) = regions(mesh, features, &blank, vec![0; mesh.positions.len()], 0.0, corners);
    let given: Vec<(u32, DVec3)> = regions.iter().flat_map(|region| turned(&canvas, region)).collect();
    Ok(cross_field(mesh, &Topology::of_triangles(mesh), features, &given)?.face_directions)
}

/// [`trace_layout`] along a given field, one direction of the cross of each triangle, without refinement.
///
/// # Errors
/// As there.
pub fn trace_along(
    mesh: &TriangleMesh,
    features: &[[u32; 2]],
    field: &[DVec3],
    options: &LayoutOptions,
    monitor: &Monitor,
) -> Result<PatchLayout, LayoutError> {
    check(mesh)?;
    let topology = Topology::of_triangles(mesh);
    let sorted = |[a, b]: [u32; 2]| [a.min(b), a.max(b)];
    let mut kinds: BTreeMap<_, _> = features.iter().map(|&edge| (sorted(edge), SubSideKind::Feature)).collect();
    let border = (0..topology.len() as u32).filter(|&h| topology.is_border(h));
    kinds.extend(border.map(|h| (sorted([topology.from(h), topology.to(h)]), SubSideKind::Border)));
    let edge_length = mean_edge(mesh, &topology, features);
    let index = indices(mesh, &singularities(mesh, &topology, field)?, NEAR * edge_length);
    let (mut canvas, regions) = regions(mesh, features, field, index, edge_length, &options.corners);
    for (&place, &quarters) in canvas.place.iter().zip(&canvas.quarters) {
        canvas.node[place as usize] |= quarters != 0 && quarters != 2;
    }
    let mut pending = Vec::new();
    let mut undivided = Vec::new();
    for region in regions {
        let is_closed = region.triangles.iter().all(|t| (3 * t..3 * t + 3).all(|h| !canvas.topology().is_border(h)));
        if !is_closed {
            pending.push(region);
            continue;
        }
        match open_closed(&region, &mut canvas, options, monitor)? {
            Some(parts) => pending.extend(parts),
            None if options.partial => undivided.push(stuck(mesh, &canvas, &region, Fault::Closed)),
            None => return Err(stuck(mesh, &canvas, &region, Fault::Closed).into()),
        }
    }
    pending.reverse();
    let (mut patches, mut flattened) = (vec![], vec![]);
    while let Some(mut region) = pending.pop() {
        match divide(&region, &mut canvas, options, monitor)? {
            Step::Patch => {
                canvas.split_chords(&mut region);
                patches.push(region);
            }
            Step::Parts(parts) => pending.extend(parts.into_iter().rev()),
            Step::Flattened(v) => {
                flattened.push(v);
                pending.push(region);
            }
            Step::Stuck(fault) if options.partial => {
                undivided.push(stuck(mesh, &canvas, &region, fault));
                patches.retain(|patch: &Region| patch.part != region.part);
                pending.retain(|other| other.part != region.part);
            }
            Step::Stuck(fault) => return Err(stuck(mesh, &canvas, &region, fault).into()),
        }
    }
    Ok(assemble::assemble(&canvas, &patches, &kinds, flattened, undivided))
}

/// The part of each triangle: connected triangles that no feature separates, in the order of their first ones. O(triangles log features).
pub fn parts(mesh: &TriangleMesh, features: &[[u32; 2]]) -> Vec<u32> {
    let topology = Topology::of_triangles(mesh);
    let cut: BTreeSet<[u32; 2]> = features.iter().map(|&[a, b]| [a.min(b), a.max(b)]).collect();
    let joined = topology.edges().filter(|&h| {
        let ends = [topology.from(h), topology.to(h)];
        !topology.is_border(h) && !cut.contains(&[ends[0].min(ends[1]), ends[0].max(ends[1])])
    });
    let joined = joined.map(|h| (h / 3, topology.twin[h as usize] / 3));
    let mut part = vec![0; mesh.triangles.len()];
    for (k, group) in (0..).zip(connected_components(mesh.triangles.len(), joined)) {
        for t in group {
            part[t as usize] = k;
        }
    }
    part
}

/// Crosses of the triangles around corners whose quarters are not those nearest to their angle: they turn evenly from one edge to the other.
/// Left to itself the field would turn the other way, and have a singularity beside each.
fn turned(canvas: &Canvas, region: &Region) -> Vec<(u32, DVec3)> {
    let mut given = vec![];
    for bend in Outline::new(canvas, region).loops.into_iter().flatten() {
        let wanted = f64::from(bend.quarters) * FRAC_PI_2;
        if (bend.angle - wanted).abs() < PI / 4.0 {
            continue;
        }
        let mut passed = 0.0;
        for h in canvas.topology().around(bend.vertex) {
            let angle = canvas.graph.corners[h as usize].angle;
            let turn = angle / 2.0 - wanted * (passed + angle / 2.0) / bend.angle;
            passed += angle;
            let [a, b, c] = [h, canvas.topology().next[h as usize], canvas.topology().prev[h as usize]]
                .map(|h| canvas.at(canvas.topology().from(h)));
            let along = (b - a).normalize();
            let across = (b - a).cross(c - a).normalize().cross(along);
            given.push((h / 3, turn.cos() * along + turn.sin() * across));
        }
    }
    given
}

/// Every vertex must have one fan of triangles.
fn check(mesh: &TriangleMesh) -> Result<(), LayoutError> {
    let topology = Topology::of_triangles(mesh);
    let mut corners = vec![0; mesh.positions.len()];
    mesh.triangles.iter().flatten().for_each(|&v| corners[v as usize] += 1);
    match (0..corners.len()).find(|&v| topology.around(v as u32).count() != corners[v]) {
        Some(v) => Err(LayoutError::NotManifold { vertex: v as u32 }),
        None => Ok(()),
    }
}

/// The index of the cross at each vertex, without neighbours that cancel: no trace comes between them.
fn indices(mesh: &TriangleMesh, singularities: &[(u32, i32)], reach: f64) -> Vec<i8> {
    let mut index = vec![0; mesh.positions.len()];
    for &(v, turns) in singularities {
        index[v as usize] = turns.clamp(-4, 4) as i8;
    }
    let at = |k: usize| mesh.positions[singularities[k].0 as usize];
    let pairs = (0..singularities.len()).flat_map(|a| (0..a).map(move |b| (b, a)));
    let mut near: Vec<(OrderedFloat<f64>, usize, usize)> =
        pairs.map(|(a, b)| (OrderedFloat(at(a).distance(at(b))), a, b)).filter(|pair| pair.0.0 < reach).collect();
    near.sort_unstable();
    for (_, a, b) in near {
        let [a, b] = [a, b].map(|k| singularities[k].0 as usize);
        if index[a] != 0 && index[a] == -index[b] {
            (index[a], index[b]) = (0, 0);
        }
    }
    index
}

/// Mean length of what quads keep to: the border and the features or, without any, all edges.
fn mean_edge(mesh: &TriangleMesh, topology: &Topology, features: &[[u32; 2]]) -> f64 {
    let length = |[a, b]: [u32; 2]| mesh.positions[a as usize].distance(mesh.positions[b as usize]);
    let border =
        (0..topology.len() as u32).filter(|&h| topology.is_border(h)).map(|h| [topology.from(h), topology.to(h)]);
    let mut lengths: Vec<f64> = border.chain(features.iter().copied()).map(length).collect();
    if lengths.is_empty() {
        lengths = topology.edges().map(|h| length([topology.from(h), topology.to(h)])).collect();
    }
    lengths.iter().sum::<f64>() / lengths.len().max(1) as f64
}

/// Gives every border vertex its quarters by how the border turns there. Returns those of the whole mesh's vertices that are part of a bend.
fn classify(canvas: &mut Canvas, region: &Region, corners: &CornerAngles) -> Vec<u32> {
    let mut bends = vec![];
    for border in Outline::new(canvas, region).loops {
        let turns: Vec<f64> = border.iter().map(|bend| PI - bend.angle).collect();
        for (k, bend) in border.iter().enumerate() {
            let before = turns[(k + turns.len() - 1) % turns.len()];
            let quarters = corners.quarters(before, turns[k], turns[(k + 1) % turns.len()]);
            canvas.quarters[bend.vertex as usize] = quarters;
        }
        if corners.fillet > 0.0 {
            bends.extend(join_bends(&mut canvas.quarters, &border, &turns, corners.fillet));
        }
    }
    bends
}

/// Turns by less than this are none, radians.
const STRAIGHT: f64 = PI / 36.0;

/// Bends of a border that turn one way within a length are one: their corners are where it has turned by odd multiples of 45 degrees, one for
/// each right angle.
fn join_bends(quarters: &mut [u8], border: &[Bend], turns: &[f64], length: f64) -> Vec<u32> {
    let n = border.len();
    let mut bends = vec![];
    let at = |k: usize| border[k % n].at;
    let sign = |k: usize| if turns[k % n].abs() < STRAIGHT { 0.0 } else { turns[k % n].signum() };
    // From where the turn changes, so that no bend is cut.
    let goes_on = |k: usize| sign(k) == sign(k - 1) && at(k - 1).distance(at(k)) < length / 2.0;
    let Some(first) = (1..=n).find(|&k| !goes_on(k)) else { return bends };
    let mut from = first;
    while from < first + n {
        let mut to = from + 1;
        while to < first + n && goes_on(to) {
            to += 1;
        }
        let (run, turn): (f64, f64) =
            ((from + 1..to).map(|k| at(k - 1).distance(at(k))).sum(), (from..to).map(|k| turns[k % n]).sum());
        if sign(from) != 0.0 && to > from + 1 && run <= length {
            let count = (turn.abs() / FRAC_PI_2).round();
            let mut passed = 0.0;
            bends.extend((from..to).map(|k| border[k % n].place));
            for k in from..to {
                let before = (passed / turn * count + 0.5).floor();
                passed += turns[k % n];
                let more = ((passed / turn * count + 0.5).floor() - before) as u8;
                quarters[border[k % n].vertex as usize] = if turn > 0.0 { 2 - more.min(1) } else { 2 + more };
            }
        }
        from = to;
    }
    bends
}

/// Gives corners around interior vertices whose angles come nearest to four quarters in all a quarter more or less until they are four,
/// the nearest first, as long as each stays within `slack` of its angle. Rounded one by one they may be three or five, and a bend
/// of a feature would be an irregular vertex.
fn even_out(canvas: &mut Canvas, on_border: &[bool], slack: f64) {
    // Vertices and the quarters nearest to their angles, by place.
    let mut around = BTreeMap::<u32, Vec<(usize, f64)>>::new();
    for (v, &place) in canvas.place.iter().enumerate().filter(|(v, _)| canvas.quarters[*v] > 0) {
        if !on_border[place as usize] {
            around.entry(place).or_default().push((v, canvas.graph.angle(v as u32) / FRAC_PI_2));
        }
    }
    let quarters = &mut canvas.quarters;
    // Elsewhere another number is right: three at a cube's corner.
    let wants_four = |corners: &&Vec<(usize, f64)>| (corners.iter().map(|c| c.1).sum::<f64>() - 4.0).abs() < 0.5;
    for corners in around.values().filter(wants_four) {
        loop {
            let all: u8 = corners.iter().map(|&(v, _)| quarters[v]).sum();
            let step: i8 = if all < 4 { 1 } else { -1 };
            let changed = |corner: &(usize, f64)| quarters[corner.0].saturating_add_signed(step);
            let off = |corner: &(usize, f64)| (corner.1 - f64::from(changed(corner))).abs();
            let nearest = corners.iter().filter(|corner| changed(corner) > 0).min_by(|a, b| off(a).total_cmp(&off(b)));
            let Some(&(v, _)) = nearest.filter(|corner| all != 4 && off(corner) < slack) else { break };
            quarters[v] = quarters[v].saturating_add_signed(step);
        }
    }
}

/// A part that a region of it keeps from being divided, told in the caller's triangles.
fn stuck(mesh: &TriangleMesh, canvas: &Canvas, region: &Region, fault: Fault) -> Undivided {
    let own: BTreeSet<u32> =
        region.triangles.iter().flat_map(|&t| canvas.corners(t)).map(|v| canvas.place[v as usize]).collect();
    let touches = |t: &u32| mesh.triangles[*t as usize].iter().any(|v| own.contains(v));
    Undivided { part: region.part, fault, triangles: (0..mesh.triangles.len() as u32).filter(touches).collect() }
}

impl From<Undivided> for LayoutError {
    fn from(Undivided { fault, triangles, .. }: Undivided) -> Self {
        Self::NoTrace { fault, triangles }
    }
}
