//! A patch graph that the caller gives, taken as the partition (section 4.1; the paper's figures 16 and 19 to 21 are drawn so).
//!
//! The sides are drawn into the surface (`inscribe`) and cut it into patches, each with a chart of its own. A corner lies at
//! every node and where borders bend. Its c-index is the one it had, if it had one and its angle has not changed by much; else its angle,
//! to which the turn of the sides beside it is added, half of each. The nearest c-indices that leave no defect are taken.

use super::chart::{Chart, vertex_curvature};
use super::cut::{Cut, pieces};
use super::input::Input;
use super::inscribe::{Inscribed, Undrawn, inscribe};
use super::layout::{Base, Chains, Draft, LEAST_TURN, TURN, chains, creases, inserted, lines, runs, turns_of_run};
use super::patch_graph::{PatchGraph, Side, closing_c_indices};
use super::region::{Arc, Line, Region};
use super::{SurfaceError, SurfaceOptions};
use mesh::{DVec3, Monitor, sorted};
use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::FRAC_PI_6;
use std::sync::Arc as Shared;

/// A patch graph as it is drawn: nodes and sides, and what is known of its corners.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct DrawnGraph {
    /// Where sides end.
    pub nodes: Vec<DVec3>,
    /// Curves between nodes, near the surface.
    pub sides: Vec<Side>,
    /// C-indices where each side begins, in the patch on its left, and where it ends, in the patch on its right: the corners
    /// from which it leaves, counter-clockwise. `None` where they are not known, as are all that are missing at the end.
    pub c_indices: Vec<[Option<u8>; 2]>,
}

impl From<&PatchGraph> for DrawnGraph {
    fn from(graph: &PatchGraph) -> Self {
        let mut c_indices = vec![[None; 2]; graph.sides.len()];
        for corner in graph.patches.iter().flat_map(|patch| &patch.corners) {
            c_indices[corner.side as usize][usize::from(corner.reversed)] = Some(corner.c_index);
        }
        Self { nodes: graph.nodes.clone(), sides: graph.sides.clone(), c_indices }
    }
}

impl DrawnGraph {
    /// The graph with every point moved.
    #[must_use]
    pub fn moved(&self, to: impl Fn(DVec3) -> DVec3) -> Self {
        let mut moved = self.clone();
        for p in moved.sides.iter_mut().flat_map(|side| &mut side.points).chain(&mut moved.nodes) {
            *p = to(*p);
        }
        moved
    }
}

/// A c-index is kept while the angle differs from it by less than this, in units of 30 degrees.
const KEPT: f64 = 1.5;

/// What is wrong with a given patch graph.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GraphFault {
    /// Sides that name nodes which are not there, or have fewer than two points.
    Malformed,
    /// Nodes far from the surface.
    Far,
    /// Sides between nodes on pieces of the surface that do not hang together.
    Apart,
    /// Sides that end in the open.
    Open,
    /// Patches that are no disks, or cannot be laid flat.
    NotFlat,
    /// Patches whose corners do not close.
    NotClosing,
}

impl GraphFault {
    fn sentence(self) -> &'static str {
        match self {
            Self::Malformed => {
                "sides name nodes that are not there or have less than two points; give each its two nodes"
            }
            Self::Far => "nodes lie far from the surface; move them onto it, or remove them",
            Self::Apart => "sides join parts of the surface that do not hang together; remove them",
            Self::Open => "sides end in the open; join them to others or to the border, or remove them",
            Self::NotFlat => "patches are no disks that can be laid flat; divide them by further sides",
            Self::NotClosing => {
                "patches have no corner angles between 60 and 300 degrees that close; add nodes on their sides, or divide them"
            }
        }
    }
}

/// A patch graph that cannot be a partition, and the elements to look at.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("the patch graph cannot be used: {count} {}", fault.sentence())]
pub struct GraphError {
    /// What is wrong.
    pub fault: GraphFault,
    /// How many elements, or patches, it is wrong with.
    pub count: usize,
    /// Nodes to look at: those themselves, or those around the patches.
    pub nodes: Vec<u32>,
    /// Sides to look at: those themselves, or those around the patches.
    pub sides: Vec<u32>,
}

impl GraphError {
    fn of_nodes(fault: GraphFault, nodes: Vec<u32>) -> SurfaceError {
        Self { fault, count: nodes.len(), nodes, sides: Vec::new() }.into()
    }

    fn of_sides(fault: GraphFault, sides: Vec<u32>) -> SurfaceError {
        Self { fault, count: sides.len(), nodes: Vec::new(), sides }.into()
    }
}

/// The draft whose regions are the patches of a given graph.
pub(super) fn draft_of_graph(
    input: &Input,
    graph: &DrawnGraph,
    edge_length: f64,
    options: &SurfaceOptions,
    monitor: &Monitor,
) -> Result<Draft, SurfaceError> {
    check(graph)?;
    let inscribed = inscribe(input, graph, edge_length, monitor).map_err(|undrawn| match undrawn {
        Undrawn::Far(nodes) => GraphError::of_nodes(GraphFault::Far, nodes),
        Undrawn::Apart(sides) => GraphError::of_sides(GraphFault::Apart, sides),
        Undrawn::Cancelled(cancelled) => cancelled.into(),
    })?;
    let open = open_sides(graph, &inscribed);
    if !open.is_empty() {
        return Err(GraphError::of_sides(GraphFault::Open, open));
    }
    let Inscribed { mesh, followed, edges, node_vertices, side_of } = inscribed;
    let mut patches = Faulty { graph, side_of: &side_of, count: 0, sides: BTreeSet::new() };
    let mut charts = Vec::new();
    for piece in pieces(&mesh, &edges) {
        monitor.stage("laying flat", 0.0)?;
        match Chart::new(piece) {
            Ok(chart) => charts.push(chart),
            Err(piece) => {
                let corners = piece.mesh.triangles.iter();
                patches.add(corners.flat_map(|t| {
                    (0..3).map(|k| [t[k], t[(k + 1) % 3]].map(|v| piece.origin[v as usize])).map(|[a, b]| (a, b))
                }));
            }
        }
    }
    patches.none(GraphFault::NotFlat)?;
    let mut cut = Cut { mesh, marked: followed, edges, charts };
    let chains = chains(&cut);
    let curvature = vertex_curvature(&cut.mesh);
    for chart in &mut cut.charts {
        chart.gather(&curvature, edge_length);
    }
    let lines = lines(&cut, &chains);
    let corners = Corners {
        cut: &cut,
        chains: &chains,
        lines: &lines,
        nodes: node_vertices.iter().copied().collect(),
        graph,
        node_vertices: &node_vertices,
        side_of: &side_of,
        edge_length,
        options,
    };
    let mut regions = Vec::new();
    for (c, chart) in cut.charts.iter().enumerate() {
        if let Some(region) = corners.region(c) {
            regions.push(region);
        } else {
            let around = |k: usize| chart.origin[chart.border[k % chart.border.len()] as usize];
            patches.add((0..chart.border.len()).map(|k| (around(k), around(k + 1))));
        }
    }
    patches.none(GraphFault::NotClosing)?;
    let creases = creases(&cut);
    let next = lines.len();
    let base = Shared::new(Base { cut, chains, creases, edge_length, corner_angle: options.corner_angle });
    Ok(Draft { base, regions, next })
}

fn check(graph: &DrawnGraph) -> Result<(), SurfaceError> {
    let is_sound = |side: &Side| {
        side.points.len() > 1
            && side.points.iter().all(|p| p.is_finite())
            && side.ends.iter().all(|&n| (n as usize) < graph.nodes.len())
    };
    let malformed: Vec<u32> = (0..).zip(&graph.sides).filter(|(_, side)| !is_sound(side)).map(|(s, _)| s).collect();
    if malformed.is_empty() { Ok(()) } else { Err(GraphError::of_sides(GraphFault::Malformed, malformed)) }
}

/// Sides at a vertex that no other edge of the partition leaves.
fn open_sides(graph: &DrawnGraph, drawn: &Inscribed) -> Vec<u32> {
    let topology = mesh::Topology::of_triangles(&drawn.mesh);
    let mut around: BTreeMap<u32, usize> = BTreeMap::new();
    let borders = topology.edges().filter(|&h| topology.is_border(h));
    let borders = borders.map(|h| sorted(topology.from(h), topology.to(h)));
    let lines: BTreeSet<[u32; 2]> = drawn.edges.iter().copied().chain(borders).collect();
    for v in lines.iter().flatten() {
        *around.entry(*v).or_default() += 1;
    }
    let is_open = |side: &Side| {
        side.ends.iter().any(|&n| {
            let v = drawn.node_vertices[n as usize];
            let is_followed = |edge: &[u32; 2]| drawn.followed.contains(edge);
            // A marked line may end where it likes: it divides nothing there, and is cut all the same.
            around.get(&v) == Some(&1) && !lines.iter().filter(|edge| edge.contains(&v)).any(is_followed)
        })
    };
    (0..).zip(&graph.sides).filter(|(_, side)| is_open(side)).map(|(s, _)| s).collect()
}

/// Gathers the sides around patches that something is wrong with.
struct Faulty<'a> {
    graph: &'a DrawnGraph,
    side_of: &'a BTreeMap<(u32, u32), (u32, bool)>,
    count: usize,
    sides: BTreeSet<u32>,
}

impl Faulty<'_> {
    fn add(&mut self, edges: impl Iterator<Item = (u32, u32)>) {
        self.count += 1;
        self.sides.extend(edges.filter_map(|edge| self.side_of.get(&edge)).map(|&(side, _)| side));
    }

    fn none(&self, fault: GraphFault) -> Result<(), SurfaceError> {
        if self.count == 0 {
            return Ok(());
        }
        let nodes: BTreeSet<u32> = self.sides.iter().flat_map(|&s| self.graph.sides[s as usize].ends).collect();
        let (nodes, sides) = (nodes.into_iter().collect(), self.sides.iter().copied().collect());
        Err(GraphError { fault, count: self.count, nodes, sides }.into())
    }
}

/// What the corners of a patch are made of.
struct Corners<'a> {
    cut: &'a Cut,
    chains: &'a Chains,
    lines: &'a [Shared<Line>],
    nodes: BTreeSet<u32>,
    graph: &'a DrawnGraph,
    node_vertices: &'a [u32],
    side_of: &'a BTreeMap<(u32, u32), (u32, bool)>,
    edge_length: f64,
    options: &'a SurfaceOptions,
}

/// A corner whose c-index is to be found, or a turn within a smooth border that is settled.
enum Turn {
    /// The angle in units of 30 degrees, the c-index the graph had there, and the one the caller sets.
    Corner {
        angle: f64,
        known: Option<u8>,
        set: Option<u8>,
    },
    Settled(i32),
}

impl Corners<'_> {
    /// The patch of a chart; `None` when no c-indices close.
    fn region(&self, c: usize) -> Option<Region> {
        let (mut arcs, mut turns) = (Vec::new(), Vec::new());
        // What the stretch of border before and after each place turns by, in units of 30 degrees.
        let mut stretches = Vec::new();
        for run in runs(self.cut, self.chains, c) {
            let (line, reversed, first) = run;
            let (of_vertex, lengths) = turns_of_run(self.cut, self.chains, c, run);
            let count = self.chains.paths[line].len();
            let last = self.lines[line].last();
            let at = |k: usize| if reversed { last - k as f64 } else { k as f64 };
            for (k, until) in self.stretches(c, line, first, &of_vertex) {
                // The turns at the vertices strictly within the stretch.
                let inner = &of_vertex[k..until - 1];
                let is_free = self.chains.is_line[line] && k == 0 && until == count - 1;
                let added = if is_free && inner.iter().sum::<f64>().abs() >= LEAST_TURN {
                    inserted(inner, &lengths, self.edge_length)
                } else {
                    Vec::new()
                };
                let mut from = k;
                let mut turn = Some(self.corner(c, first + k));
                for (step, settled) in added.iter().map(|&(step, settled)| (k + step + 1, settled)) {
                    arcs.push(Arc { line: self.lines[line].clone(), reversed, from: at(from), to: at(step) });
                    turns.push(turn.replace(Turn::Settled(settled))?);
                    stretches.push(0.0);
                    from = step;
                }
                arcs.push(Arc { line: self.lines[line].clone(), reversed, from: at(from), to: at(until) });
                turns.push(turn?);
                stretches.push(if added.is_empty() { inner.iter().sum() } else { 0.0 });
            }
        }
        closed(c, arcs, &turns, &stretches)
    }

    /// A run between its nodes and bends: from and to which of its vertices.
    fn stretches(&self, c: usize, line: usize, first: usize, turns: &[f64]) -> Vec<(usize, usize)> {
        let chart = &self.cut.charts[c];
        let is_place = |&k: &usize| {
            let v = chart.origin[chart.border[(first + k) % chart.border.len()] as usize];
            let is_asked = self.options.corners.iter().any(|(vertex, _)| *vertex == v);
            self.nodes.contains(&v) || is_asked || (self.chains.is_line[line] && turns[k - 1].abs() > TURN)
        };
        let mut places = vec![0];
        places.extend((1..=turns.len()).filter(is_place));
        places.push(turns.len() + 1);
        places.windows(2).map(|w| (w[0], w[1])).collect()
    }

    /// What is asked of the corner at a vertex of a chart's border.
    fn corner(&self, c: usize, k: usize) -> Turn {
        let chart = &self.cut.charts[c];
        let n = chart.border.len();
        let [v, next] = [k, k + 1].map(|k| chart.origin[chart.border[k % n] as usize]);
        let angle = chart.angles[k % n] / FRAC_PI_6;
        let set = self.options.corners.iter().find(|(vertex, _)| *vertex == v).map(|&(_, c)| c);
        let known = self.side_of.get(&(v, next)).and_then(|&(side, reversed)| {
            let node = self.graph.sides[side as usize].ends[usize::from(reversed)];
            let c_index = (*self.graph.c_indices.get(side as usize)?)[usize::from(reversed)];
            c_index.filter(|&c| self.node_vertices[node as usize] == v && (f64::from(c) - angle).abs() < KEPT)
        });
        Turn::Corner { angle, known, set }
    }
}

/// A patch with the nearest c-indices that close it.
fn closed(c: usize, arcs: Vec<Arc>, turns: &[Turn], stretches: &[f64]) -> Option<Region> {
    let n = turns.len();
    let (mut angles, mut set, mut settled) = (Vec::new(), Vec::new(), 0);
    for (k, turn) in turns.iter().enumerate() {
        match *turn {
            Turn::Corner { angle, known, set: of_caller } => {
                let beside = f64::midpoint(stretches[k], stretches[(k + n - 1) % n]);
                angles.push(known.map_or(angle - beside, f64::from));
                set.push(of_caller);
            }
            Turn::Settled(turn) => settled += turn,
        }
    }
    let mut chosen = closing_c_indices(&angles, &set, settled)?.into_iter();
    let corners = turns.iter().map(|turn| match turn {
        Turn::Corner { .. } => chosen.next(),
        Turn::Settled(turn) => u8::try_from(6 - turn).ok(),
    });
    Some(Region { chart: c, corners: corners.collect::<Option<Vec<u8>>>()?, arcs })
}
