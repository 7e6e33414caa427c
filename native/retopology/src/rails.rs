//! The lines that quads keep to: feature chains and borders as polylines, and the points on them that stay.

use crate::base::Base;
use crate::curvature::mean_along;
use crate::measures::Measures;
use mesh::DVec3;
use std::f64::consts::PI;
use surface::smooth_star::Polyline;

/// A line that turns by more than this at a base vertex has a corner there: 40 degrees.
const CORNER_TURN: f64 = PI * 40.0 / 180.0;

/// Rails between corners.
#[derive(Debug)]
pub(crate) struct Rails {
    /// The lines; closed ones repeat their first point.
    pub lines: Vec<Polyline>,
    /// Their points.
    pub points: Vec<Vec<DVec3>>,
    /// Line of each base edge that is a rail.
    pub of_edge: Vec<Option<u32>>,
    /// Line that each base vertex slides along; `None` for those on no rail and for corners.
    pub of_vertex: Vec<Option<u32>>,
    /// The base edges of each line in order.
    pub steps: Vec<Vec<Step>>,
    /// Base vertices that stay where they are: ends, junctions and bends of rails.
    pub corner: Vec<bool>,
}

/// A base edge on a line.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Step {
    pub edge: u32,
    /// Whether the line runs along it from its first end to its second.
    pub forward: bool,
    /// The base vertex it leads to.
    pub to: u32,
}

impl Rails {
    /// Rails that end at corners and at `fixed` base vertices. O(base edges and their paths).
    pub fn new(base: &Base, measures: &Measures, fixed: &[u32]) -> Self {
        let count = base.vertices.len();
        let mut around: Vec<Vec<u32>> = vec![Vec::new(); count];
        for (e, edge) in (0..).zip(&base.edges).filter(|(e, _)| measures.rails[*e as usize]) {
            edge.ends.iter().for_each(|&v| around[v as usize].push(e));
        }
        let mut corner: Vec<bool> = (0..count)
            .map(|v| match around[v][..] {
                [] => false,
                [a, b] => {
                    let [to, from] = [a, b].map(|e| leaving(base, e, v as u32));
                    base.edges[a as usize].feature != base.edges[b as usize].feature
                        || to.angle_between(-from) > CORNER_TURN
                }
                _ => true,
            })
            .collect();
        for &v in fixed {
            corner[v as usize] = true;
        }
        let mut rails = Self {
            lines: vec![],
            points: vec![],
            steps: vec![],
            of_edge: vec![None; base.edges.len()],
            of_vertex: vec![None; count],
            corner,
        };
        // From corners first; what is left are closed lines without one.
        for from_corners in [true, false] {
            for v in 0..count as u32 {
                if rails.corner[v as usize] != from_corners {
                    continue;
                }
                for &e in &around[v as usize] {
                    if rails.of_edge[e as usize].is_none() {
                        rails.follow(base, &around, v, e);
                    }
                }
            }
        }
        rails
    }

    /// The mean along each line of what `values` has at the vertices of the surface.
    pub fn means(&self, base: &Base, values: &[f64]) -> Vec<f64> {
        let mean = |steps: &Vec<Step>| {
            let of_step = |step: &Step| mean_along(&base.edges[step.edge as usize].path, values);
            steps.iter().map(of_step).sum::<f64>() / steps.len() as f64
        };
        self.steps.iter().map(mean).collect()
    }

    /// Adds the line that leaves `start` along `edge`.
    fn follow(&mut self, base: &Base, around: &[Vec<u32>], start: u32, edge: u32) {
        let line = self.lines.len() as u32;
        let (mut at, mut edge) = (start, Some(edge));
        let mut steps = Vec::new();
        let mut points = vec![base.surface.positions[base.vertices[start as usize] as usize]];
        while let Some(e) = edge {
            self.of_edge[e as usize] = Some(line);
            let BaseWalk { to, path } = walk(base, e, at);
            points.extend(path[1..].iter().map(|&v| base.surface.positions[v as usize]));
            steps.push(Step { edge: e, forward: base.edges[e as usize].ends[0] == at, to });
            at = to;
            if self.corner[at as usize] {
                break;
            }
            self.of_vertex[at as usize] = Some(line);
            edge = around[at as usize].iter().copied().find(|&e| self.of_edge[e as usize].is_none());
        }
        self.lines.push(Polyline::new(points.clone()));
        self.points.push(points);
        self.steps.push(steps);
    }
}

struct BaseWalk {
    to: u32,
    path: Vec<u32>,
}

/// A base edge as seen from one of its ends.
fn walk(base: &Base, e: u32, from: u32) -> BaseWalk {
    let edge = &base.edges[e as usize];
    let mut path = edge.path.clone();
    if edge.ends[0] == from {
        BaseWalk { to: edge.ends[1], path }
    } else {
        path.reverse();
        BaseWalk { to: edge.ends[0], path }
    }
}

/// Direction in which a base edge leaves one of its ends.
fn leaving(base: &Base, e: u32, from: u32) -> DVec3 {
    let path = walk(base, e, from).path;
    let at = |v: u32| base.surface.positions[v as usize];
    path[1..].iter().map(|&v| at(v) - at(path[0])).find(|d| d.length_squared() > 0.0).unwrap_or(DVec3::ZERO)
}
