//! Takes a part of a base triangulation out, triangulates it anew, and puts it back. For [`crate::session`].

use crate::base::{Base, BaseEdge};
use crate::base_error::RetopologyError;
use crate::build::{BaseOptions, Part, build_within};
use crate::density;
use crate::features::Features;
use crate::half::come_apart;
use mesh::{DVec3, Monitor, NONE, Topology, TriangleMesh, sorted};
use std::collections::{BTreeMap, BTreeSet};

/// How the marks of a part change; edges and vertices are those of the base's surface.
pub(crate) struct Marks<'a> {
    /// Edges that are no longer marked.
    pub gone: &'a BTreeSet<[u32; 2]>,
    /// Edges that are marked now.
    pub new: &'a BTreeSet<[u32; 2]>,
    /// All marked vertices and corners of features.
    pub vertices: &'a [u32],
}

/// A part of the base's surface by itself.
struct Piece {
    mesh: TriangleMesh,
    source: Vec<u32>,
    /// Its first vertices are the input's.
    fixed: usize,
    /// The vertex of the base's surface at each of its vertices.
    whole: Vec<u32>,
    /// Its edge for each edge of the base's surface.
    edge: BTreeMap<[u32; 2], [u32; 2]>,
}

/// The base with the triangles in `part` made anew; `None` when the result would join two base vertices twice. The first `inputs`
/// vertices of its surface are the input's. Chains that go on in the part keep their numbers.
///
/// # Errors
/// As [`crate::build::build_base`]; [`RetopologyError::Internal`] when the rim of the part is too tight.
#[expect(clippy::too_many_arguments, reason = "one caller; each is a thing of its own")]
pub(crate) fn rebuild(
    base: &Base,
    inputs: usize,
    surface: &Topology,
    part: &BTreeSet<u32>,
    marks: &Marks<'_>,
    even: f64,
    options: &BaseOptions,
    monitor: &Monitor,
) -> Result<Option<Base>, RetopologyError> {
    let piece = Piece::new(base, inputs, part);
    // How many of the base triangles at each base edge are in the part, and how many there are.
    let mut uses = vec![[0_u32; 2]; base.edges.len()];
    for (t, sides) in base.triangle_edges.iter().enumerate() {
        for &e in sides {
            uses[e as usize][0] += u32::from(part.contains(&(t as u32)));
            uses[e as usize][1] += 1;
        }
    }
    let mut rim = BTreeSet::new();
    let mut rim_edge = BTreeMap::<[u32; 2], u32>::new();
    let mut on_rim = BTreeSet::new();
    let mut feature_at = BTreeMap::<[u32; 2], u32>::new();
    for (e, (edge, &[inside, all])) in base.edges.iter().zip(&uses).enumerate().filter(|(_, (_, uses))| uses[0] > 0) {
        let pairs = edge.path.windows(2).map(|pair| sorted(pair[0], pair[1]));
        if inside < all {
            on_rim.extend([edge.path[0], edge.path[edge.path.len() - 1]]);
            rim_edge.extend(pairs.clone().map(|pair| (pair, e as u32)));
            rim.extend(pairs.filter_map(|pair| piece.edge.get(&pair).copied()));
        } else if let Some(chain) = edge.feature {
            feature_at.extend(pairs.map(|pair| (pair, chain)));
        }
    }
    let is_border =
        |&[a, b]: &[u32; 2]| surface.find(a, b).or_else(|| surface.find(b, a)).is_some_and(|h| surface.is_border(h));
    let marked: BTreeSet<[u32; 2]> = feature_at
        .keys()
        .filter(|edge| !marks.gone.contains(*edge) && !is_border(edge))
        .chain(marks.new)
        .copied()
        .collect();
    let edges = marked.iter().map(|edge| piece.edge.get(edge).copied()).collect::<Option<Vec<_>>>();
    let Some(edges) = edges else { return Ok(None) };
    let kept: BTreeSet<u32> = marks.vertices.iter().copied().chain(on_rim).collect();
    let vertices = (0..piece.whole.len() as u32).filter(|&v| kept.contains(&piece.whole[v as usize])).collect();
    let features = Features { edges, vertices };
    // What hangs together outside may look like a crumb in here, and a base edge of the rim may turn at once where it is cut: the
    // corners are those of the whole, which are marked.
    let density = density::spread(&base.surface, &options.density);
    let density = piece.whole.iter().filter_map(|&v| density.get(v as usize).copied()).collect();
    let options = BaseOptions { least_feature: 0.0, corner_angle: std::f64::consts::PI, density, ..options.clone() };
    let start = Part { source: &piece.source, fixed: piece.fixed, rim: &rim, even };
    let (built, number) = build_within(&piece.mesh, &features, &options, Some(&start), monitor)?;
    let mut own = vec![NONE; built.base.surface.positions.len()];
    for (&whole, &v) in piece.whole.iter().zip(&number).filter(|(_, v)| **v != NONE) {
        own[v as usize] = whole;
    }
    Ok(Splicing { base, inputs, part, uses, rim_edge, feature_at }.splice(&built.base, &own))
}

impl Piece {
    fn new(base: &Base, inputs: usize, part: &BTreeSet<u32>) -> Self {
        let own = (0..base.owner.len()).filter(|&f| part.contains(&base.owner[f]));
        let faces: Vec<usize> = own.collect();
        let mut whole: Vec<u32> = faces.iter().flat_map(|&f| base.surface.triangles[f]).collect();
        // Ascending: the input's come first.
        whole.sort_unstable();
        whole.dedup();
        let local = |v: u32| whole.binary_search(&v).map_or(NONE, |k| k as u32);
        let mut triangles: Vec<[u32; 3]> = faces.iter().map(|&f| base.surface.triangles[f].map(local)).collect();
        let fixed = whole.partition_point(|&v| (v as usize) < inputs);
        let mut positions: Vec<DVec3> = whole.iter().map(|&v| base.surface.positions[v as usize]).collect();
        come_apart(&mut triangles, &mut positions, &mut whole);
        let edge = triangles
            .iter()
            .flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]])
            .map(|[a, b]| (sorted(whole[a as usize], whole[b as usize]), sorted(a, b)))
            .collect();
        let source = faces.iter().map(|&f| base.source[f]).collect();
        Self { mesh: TriangleMesh { positions, triangles }, source, fixed, whole, edge }
    }
}

struct Splicing<'a> {
    base: &'a Base,
    inputs: usize,
    part: &'a BTreeSet<u32>,
    uses: Vec<[u32; 2]>,
    /// The base edge of each surface edge on the rim.
    rim_edge: BTreeMap<[u32; 2], u32>,
    /// The chain of each surface edge that was on a feature inside the part.
    feature_at: BTreeMap<[u32; 2], u32>,
}

impl Splicing<'_> {
    /// `own` is the vertex of the old surface at each vertex of the new part, or [`NONE`].
    fn splice(self, part: &Base, own: &[u32]) -> Option<Base> {
        let base = self.base;
        let outside = |f: &usize| !self.part.contains(&base.owner[*f]);
        // Surface vertices: the input's, then what is left of the old, then the new.
        let mut stays: Vec<bool> = (0..base.surface.positions.len()).map(|v| v < self.inputs).collect();
        for &v in (0..base.owner.len()).filter(outside).flat_map(|f| &base.surface.triangles[f]) {
            stays[v as usize] = true;
        }
        for &v in own.iter().filter(|&&v| v != NONE) {
            stays[v as usize] = true;
        }
        let mut old = vec![NONE; stays.len()];
        let mut positions = Vec::new();
        for v in (0..stays.len()).filter(|&v| stays[v]) {
            old[v] = positions.len() as u32;
            positions.push(base.surface.positions[v]);
        }
        let new: Vec<u32> = own
            .iter()
            .zip(&part.surface.positions)
            .map(|(&whole, &position)| {
                if whole != NONE {
                    return old[whole as usize];
                }
                positions.push(position);
                positions.len() as u32 - 1
            })
            .collect();
        // Base triangles, edges and vertices the same way.
        let kept: Vec<usize> = (0..base.triangles.len()).filter(|&t| !self.part.contains(&(t as u32))).collect();
        let mut result = Base::default();
        let mut vertex_at = BTreeMap::<u32, u32>::new();
        let mut vertex = |result: &mut Base, at: u32| {
            *vertex_at.entry(at).or_insert_with(|| {
                result.vertices.push(at);
                result.vertices.len() as u32 - 1
            })
        };
        let mut old_edge = vec![NONE; base.edges.len()];
        for (e, edge) in base.edges.iter().enumerate().filter(|(e, _)| self.uses[*e][0] < self.uses[*e][1]) {
            old_edge[e] = result.edges.len() as u32;
            let ends = edge.ends.map(|v| vertex(&mut result, old[base.vertices[v as usize] as usize]));
            let path = edge.path.iter().map(|&v| old[v as usize]).collect();
            result.edges.push(BaseEdge { ends, path, feature: edge.feature });
        }
        let chains = base.edges.iter().filter_map(|edge| edge.feature).max().map_or(0, |last| last + 1);
        let mut new_edge = Vec::with_capacity(part.edges.len());
        for edge in &part.edges {
            let before = |pair: &[u32]| sorted(own[pair[0] as usize], own[pair[1] as usize]);
            if let Some(&e) = self.rim_edge.get(&before(&edge.path)) {
                let ends = [edge.path[0], edge.path[edge.path.len() - 1]].map(|v| own[v as usize]);
                let path = &base.edges[e as usize].path;
                if sorted(ends[0], ends[1]) != sorted(path[0], path[path.len() - 1]) {
                    return None;
                }
                new_edge.push(old_edge[e as usize]);
                continue;
            }
            let known = || edge.path.windows(2).find_map(|pair| self.feature_at.get(&before(pair)).copied());
            let feature = edge.feature.map(|chain| known().unwrap_or(chains + chain));
            let ends = edge.ends.map(|v| vertex(&mut result, new[part.vertices[v as usize] as usize]));
            let path = edge.path.iter().map(|&v| new[v as usize]).collect();
            new_edge.push(result.edges.len() as u32);
            result.edges.push(BaseEdge { ends, path, feature });
        }
        let mut number = vec![NONE; base.triangles.len()];
        for &t in &kept {
            number[t] = result.triangles.len() as u32;
            let corners = base.triangles[t].map(|v| vertex(&mut result, old[base.vertices[v as usize] as usize]));
            result.triangles.push(corners);
            result.triangle_edges.push(base.triangle_edges[t].map(|e| old_edge[e as usize]));
        }
        for (corners, sides) in part.triangles.iter().zip(&part.triangle_edges) {
            let corners = corners.map(|v| vertex(&mut result, new[part.vertices[v as usize] as usize]));
            result.triangles.push(corners);
            result.triangle_edges.push(sides.map(|e| new_edge[e as usize]));
        }
        let mut triangles = Vec::new();
        for f in (0..base.owner.len()).filter(outside) {
            triangles.push(base.surface.triangles[f].map(|v| old[v as usize]));
            result.source.push(base.source[f]);
            result.owner.push(number[base.owner[f] as usize]);
        }
        for (f, corners) in part.surface.triangles.iter().enumerate() {
            triangles.push(corners.map(|v| new[v as usize]));
            result.source.push(part.source[f]);
            result.owner.push(kept.len() as u32 + part.owner[f]);
        }
        result.surface = TriangleMesh { positions, triangles };
        is_simple(&result).then_some(result)
    }
}

/// True when no two base edges have the same ends and no two base triangles the same corners.
fn is_simple(base: &Base) -> bool {
    let mut ends: Vec<[u32; 2]> = base.edges.iter().map(|edge| sorted(edge.ends[0], edge.ends[1])).collect();
    ends.sort_unstable();
    let mut corners: Vec<[u32; 3]> = base.triangles.clone();
    for triangle in &mut corners {
        triangle.sort_unstable();
    }
    corners.sort_unstable();
    ends.iter().all(|[a, b]| a != b)
        && ends.windows(2).all(|pair| pair[0] != pair[1])
        && corners.windows(2).all(|pair| pair[0] != pair[1])
}
