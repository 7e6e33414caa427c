//! The band: the triangulated part of the result that is remade (T0 in section 3.1), and the network of lines in it
//! that become edge loops: the intersection curve, sharp edges and marked edges.
//!
//! Deviation: the paper has no features (its limitation, 6.1). Here the curve and every crease are lines of the layout.

use crate::intersect::{Cut, Input, Source};
use crate::polychord::Strips;
use crate::retract::Kept;
use crate::{Elements, Options};
use mesh::{DVec3, NONE, Topology, TriangleMesh, face_normal, sorted};
use std::collections::{BTreeMap, BTreeSet};

/// A crease that ends inside the band is a line only when it is longer than this, in edges of its mesh.
const SHORTEST_CRUMB: f64 = 1.2;

/// The part to remake.
#[derive(Debug)]
pub struct Band {
    /// Its surface; its border is the border of the kept quads.
    pub surface: TriangleMesh,
    /// Half-edges of the surface.
    pub topology: Topology,
    /// Source of each triangle.
    pub source: Vec<Source>,
    /// Input mesh and vertex of each border vertex.
    pub border_vertex: Vec<Option<(u8, u32)>>,
    /// Lines that become edge loops.
    pub arcs: Vec<Arc>,
    /// Region of each triangle: the pieces between the lines.
    pub region: Vec<u32>,
    /// Number of regions.
    pub region_count: usize,
}

impl Band {
    /// The input faces that some triangles of the band lie on: `"faces"` of A and of B.
    pub fn input_faces(&self, inputs: &[Input<'_>; 2], wanted: impl Fn(usize) -> bool) -> [Elements; 2] {
        let mut faces = [vec![], vec![]];
        for s in (0..self.source.len()).filter(|&t| wanted(t)).map(|t| self.source[t]) {
            faces[s.mesh as usize].push(inputs[s.mesh as usize].quad_of[s.triangle as usize]);
        }
        faces.map(|mut list| {
            list.sort_unstable();
            list.dedup();
            if list.is_empty() { Elements::new() } else { Elements::from([("faces", list)]) }
        })
    }

    /// The input faces under some regions.
    pub fn faces_under(&self, inputs: &[Input<'_>; 2], regions: &[u32]) -> [Elements; 2] {
        self.input_faces(inputs, |t| regions.contains(&self.region[t]))
    }
}

/// A line of the network, from node to node.
#[derive(Debug, Clone, PartialEq)]
pub struct Arc {
    /// Band vertices along it; the first is repeated at the end of a closed one.
    pub vertices: Vec<u32>,
    /// True for the intersection curve, false for a crease.
    pub on_curve: bool,
    /// Regions to its left and right.
    pub regions: [u32; 2],
}

impl Arc {
    /// True for a loop.
    pub fn is_closed(&self) -> bool {
        self.vertices.first() == self.vertices.last()
    }

    /// Points along it.
    pub fn points<'a>(&'a self, surface: &'a TriangleMesh) -> impl Iterator<Item = DVec3> + 'a {
        self.vertices.iter().map(|&v| surface.positions[v as usize])
    }
}

/// Input edges that stay edge loops: those sharper than the option, and the marked ones. By sorted vertex pair.
pub fn creases(input: &Input<'_>, marked: &[[u32; 2]], sharp_angle: f64) -> BTreeSet<[u32; 2]> {
    let normals: Vec<DVec3> =
        (0..input.quads.face_count()).map(|f| face_normal(&input.quads.face_points(f).collect::<Vec<_>>())).collect();
    let t = &input.topology;
    let mut sharp: BTreeSet<[u32; 2]> = marked.iter().map(|&[a, b]| sorted(a, b)).collect();
    for h in t.edges() {
        let o = t.twin[h as usize];
        let cosine = normals[t.face[h as usize] as usize].dot(normals[t.face[o as usize] as usize]);
        if cosine < sharp_angle.cos() {
            sharp.insert(sorted(t.from(h), t.to(h)));
        }
    }
    sharp
}

/// Cuts the band out of the exact boolean and finds its lines and regions.
/// `strips` are kept quads that were split: border edges of the band that they end at are split alike.
pub fn extract(inputs: &[Input<'_>; 2], cut: &Cut, kept: &Kept, strips: &Strips, options: &Options) -> Band {
    let is_kept = |t: usize| {
        let s = cut.source[t];
        kept[s.mesh as usize][inputs[s.mesh as usize].quad_of[s.triangle as usize] as usize]
    };
    let mut vertex = vec![NONE; cut.surface.positions.len()];
    let mut surface = TriangleMesh::default();
    let mut source = Vec::new();
    let mut cut_vertex = Vec::new();
    for t in (0..cut.surface.triangles.len()).filter(|&t| !is_kept(t)) {
        surface.triangles.push(cut.surface.triangles[t].map(|v| {
            if vertex[v as usize] == NONE {
                vertex[v as usize] = surface.positions.len() as u32;
                surface.positions.push(cut.surface.positions[v as usize]);
                cut_vertex.push(v);
            }
            vertex[v as usize]
        }));
        source.push(cut.source[t]);
    }
    let mut topology = Topology::of_triangles(&surface);
    let mut border_vertex: Vec<Option<(u8, u32)>> = (0..surface.positions.len() as u32)
        .map(|v| topology.is_border_vertex(v).then(|| cut.input_vertex[cut_vertex[v as usize] as usize]).flatten())
        .collect();
    if !strips.is_empty() {
        split_border(inputs, strips, &topology, &mut surface, &mut source, &mut border_vertex);
        topology = Topology::of_triangles(&surface);
    }

    let sharp: [_; 2] = std::array::from_fn(|m| creases(&inputs[m], &options.feature_edges[m], options.sharp_angle));
    let mut lines = network(inputs, &topology, &source, &sharp);
    let own_edge = |h: u32| {
        let s = source[(h / 3) as usize];
        inputs[s.mesh as usize].edge_length[inputs[s.mesh as usize].quad_of[s.triangle as usize] as usize]
    };
    prune_crumbs(&topology, &mut lines, &surface, &|h| SHORTEST_CRUMB * own_edge(h));
    let (region, region_count) = flood(&topology, |h| lines[h as usize] != Line::None, surface.triangles.len());
    let arcs = arcs(&topology, &lines, &region);
    Band { surface, topology, source, border_vertex, arcs, region, region_count }
}

/// Puts the middle vertices of split strips into the border of the band.
fn split_border(
    inputs: &[Input<'_>; 2],
    strips: &Strips,
    topology: &Topology,
    surface: &mut TriangleMesh,
    source: &mut Vec<Source>,
    border_vertex: &mut Vec<Option<(u8, u32)>>,
) {
    let mut middle: BTreeMap<[u32; 2], u32> = BTreeMap::new();
    for h in (0..topology.len() as u32).filter(|&h| topology.is_border(h)) {
        let (a, b) = (topology.from(h), topology.to(h));
        if let (Some((m, p)), Some((_, q))) = (border_vertex[a as usize], border_vertex[b as usize])
            && let Some(&v) = strips.middle[m as usize].get(&sorted(p, q))
        {
            middle.insert([a, b], surface.positions.len() as u32);
            surface.positions.push(strips.position(&inputs[m as usize], m as usize, v));
            border_vertex.push(Some((m, v)));
        }
    }
    let mut t = 0;
    while t < surface.triangles.len() {
        let corners = surface.triangles[t];
        let split = (0..3).find_map(|k| middle.get(&[corners[k], corners[(k + 1) % 3]]).map(|&v| (k, v)));
        if let Some((k, v)) = split {
            let [a, b, c] = [corners[k], corners[(k + 1) % 3], corners[(k + 2) % 3]];
            surface.triangles[t] = [a, v, c];
            surface.triangles.push([v, b, c]);
            source.push(source[t]);
        } else {
            t += 1;
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Line {
    None,
    Curve,
    Crease,
}

/// Kind of line that each half-edge lies on.
fn network(
    inputs: &[Input<'_>; 2],
    topology: &Topology,
    source: &[Source],
    sharp: &[BTreeSet<[u32; 2]>; 2],
) -> Vec<Line> {
    let mut lines = vec![Line::None; topology.len()];
    for h in topology.edges() {
        let o = topology.twin[h as usize];
        if o == NONE {
            continue;
        }
        let (s, r) = (source[(h / 3) as usize], source[(o / 3) as usize]);
        let line = if s.mesh != r.mesh {
            Line::Curve
        } else if is_crease(&inputs[s.mesh as usize], s, r, &sharp[s.mesh as usize]) {
            Line::Crease
        } else {
            Line::None
        };
        lines[h as usize] = line;
        lines[o as usize] = line;
    }
    lines
}

/// True when two triangles of one mesh belong to quads that meet in a sharp edge.
fn is_crease(input: &Input<'_>, s: Source, r: Source, sharp: &BTreeSet<[u32; 2]>) -> bool {
    let [p, q] = [s, r].map(|x| input.quad_of[x.triangle as usize]);
    if p == q || sharp.is_empty() {
        return false;
    }
    input.quads.face_corners(p as usize).any(|h| {
        let o = input.topology.twin[h];
        let edge = sorted(input.topology.from(h as u32), input.topology.to(h as u32));
        o != NONE && input.topology.face[o as usize] == q && sharp.contains(&edge)
    })
}

/// Removes creases that end inside the band soon after they leave another line or the border: crumbs of a bend that
/// is just about sharp. Longer ones stay, as lines inside a region.
fn prune_crumbs(topology: &Topology, lines: &mut [Line], surface: &TriangleMesh, shortest: &dyn Fn(u32) -> f64) {
    let on_line = |lines: &[Line], v: u32| -> Vec<u32> {
        topology.around(v).filter(|&h| lines[h as usize] != Line::None).collect()
    };
    let is_node = |lines: &[Line], v: u32| topology.is_border_vertex(v) || on_line(lines, v).len() != 2;
    loop {
        let mut pruned = false;
        for v in 0..surface.positions.len() as u32 {
            if topology.is_border_vertex(v) || on_line(lines, v).len() != 1 {
                continue;
            }
            let mut walk = vec![on_line(lines, v)[0]];
            let mut length = 0.0;
            loop {
                let h = walk[walk.len() - 1];
                let (from, to) = (topology.from(h), topology.to(h));
                length += surface.positions[from as usize].distance(surface.positions[to as usize]);
                if is_node(lines, to) {
                    break;
                }
                let back = topology.twin[h as usize];
                walk.extend(on_line(lines, to).into_iter().find(|&g| g != back));
            }
            if length < shortest(walk[0]) {
                for h in walk {
                    lines[h as usize] = Line::None;
                    lines[topology.twin[h as usize] as usize] = Line::None;
                }
                pruned = true;
            }
        }
        if !pruned {
            return;
        }
    }
}

/// Labels the pieces of a triangle surface between lines; also returns how many there are.
pub fn flood(topology: &Topology, is_line: impl Fn(u32) -> bool, triangles: usize) -> (Vec<u32>, usize) {
    let mut region = vec![NONE; triangles];
    let mut count = 0;
    for start in 0..triangles {
        if region[start] != NONE {
            continue;
        }
        region[start] = count;
        let mut stack = vec![start as u32];
        while let Some(t) = stack.pop() {
            for h in 3 * t..3 * t + 3 {
                let o = topology.twin[h as usize];
                if o != NONE && !is_line(h) && region[(o / 3) as usize] == NONE {
                    region[(o / 3) as usize] = count;
                    stack.push(o / 3);
                }
            }
        }
        count += 1;
    }
    (region, count as usize)
}

fn arcs(topology: &Topology, lines: &[Line], region: &[u32]) -> Vec<Arc> {
    let mut outgoing: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for h in (0..topology.len() as u32).filter(|&h| lines[h as usize] != Line::None) {
        outgoing.entry(topology.from(h)).or_default().push(h);
    }
    let is_node = |v: u32| outgoing[&v].len() != 2 || topology.is_border_vertex(v);
    let mut seen = vec![false; topology.len()];
    let mut arcs = Vec::new();
    // Open arcs start at nodes; what is left are loops.
    let starts = outgoing.iter().filter(|(v, _)| is_node(**v)).chain(outgoing.iter()).flat_map(|(_, hs)| hs.clone());
    for start in starts {
        if seen[start as usize] {
            continue;
        }
        let (first, mut h) = (topology.from(start), start);
        let mut vertices = vec![first];
        loop {
            seen[h as usize] = true;
            seen[topology.twin[h as usize] as usize] = true;
            let v = topology.to(h);
            vertices.push(v);
            if v == first || is_node(v) {
                break;
            }
            let back = topology.twin[h as usize];
            h = outgoing[&v].iter().copied().find(|&g| g != back).expect("a vertex with two lines");
        }
        let o = topology.twin[start as usize];
        arcs.push(Arc {
            vertices,
            on_curve: lines[start as usize] == Line::Curve,
            regions: [region[(start / 3) as usize], region[(o / 3) as usize]],
        });
    }
    arcs
}
