//! Filling the regions: several fillers behind one interface, one judge (sections 3.2 to 3.5).
//!
//! A region is a piece of the band between lines of the network. Its rim (border and lines) is already made of output
//! vertices, so that whatever fills one region fits its neighbours by vertex index.

mod finish;
mod flat_corners;
mod judge;
mod matching;
mod patches;
mod rings;
#[cfg(test)]
mod test_region;

use crate::band::Band;
use crate::intersect::{Input, Source};
use crate::{Filler, Operation, RegionReport};
use judge::Score;
use mesh::{Cancelled, DVec3, Monitor, Topology, TriangleMesh};
use rayon::prelude::*;
use std::collections::BTreeMap;
use surface::closest::ClosestPoint;
use surface::smooth_star::{Reference, SurfacePoint};

/// A piece of the band to be filled with quads.
#[derive(Debug)]
pub struct Region {
    /// Its surface. The first [`Region::rim_count`] vertices are the rim: output vertices, fixed.
    pub surface: TriangleMesh,
    /// Number of rim vertices.
    pub rim_count: usize,
    /// Band vertex of each rim vertex.
    pub rim: Vec<u32>,
    /// Border loops as rim vertices, the surface on the left.
    pub loops: Vec<Vec<u32>>,
    /// Edges of lines inside the region (creases with this region on both sides); they must become quad edges.
    pub inner_lines: Vec<[u32; 2]>,
    /// Line edges on the rim: the curve and creases, between this region and another.
    pub line_edges: Vec<[u32; 2]>,
    /// Number of kept quads at each rim vertex.
    pub outside: Vec<u32>,
    /// Target edge length at each vertex of the surface.
    pub size: Vec<f64>,
    /// The exact boolean's surface of this region.
    pub under: Under,
}

/// The band with its lines divided, as regions are cut out of it.
#[derive(Debug, Clone, Copy)]
pub struct DividedBand<'a> {
    /// Its surface.
    pub surface: &'a TriangleMesh,
    /// Half-edges of the surface.
    pub topology: &'a Topology,
    /// Half-edges on lines.
    pub is_line: &'a [bool],
    /// Piece between lines that each triangle belongs to.
    pub piece: &'a [u32],
    /// Target edge length at each vertex.
    pub size: &'a [f64],
    /// Kept quads at each vertex.
    pub outside: &'a [u32],
}

/// The exact surface that a region's vertices stay on.
#[derive(Debug)]
pub struct Under {
    closest: ClosestPoint,
    /// Unit normal of each triangle: that of the input triangle it lies on, which is sound where the triangle is a sliver.
    normals: Vec<DVec3>,
    /// Source of each triangle.
    source: Vec<Source>,
}

impl Under {
    /// Takes some triangles of the band.
    pub fn new(inputs: &[Input<'_>; 2], operation: Operation, band: &Band, triangles: &[u32]) -> Self {
        let mut vertex: BTreeMap<u32, u32> = BTreeMap::new();
        let mut surface = TriangleMesh::default();
        for &t in triangles {
            surface.triangles.push(band.surface.triangles[t as usize].map(|v| {
                *vertex.entry(v).or_insert_with(|| {
                    surface.positions.push(band.surface.positions[v as usize]);
                    surface.positions.len() as u32 - 1
                })
            }));
        }
        let source: Vec<Source> = triangles.iter().map(|&t| band.source[t as usize]).collect();
        let normals = source
            .iter()
            .map(|s| {
                let normal = inputs[s.mesh as usize].triangles.area_normal(s.triangle as usize).normalize_or_zero();
                if s.mesh == 1 && operation == Operation::Difference { -normal } else { normal }
            })
            .collect();
        Self { closest: ClosestPoint::new(&surface), normals, source }
    }

    /// The closest point, and the input triangle it lies on.
    pub fn source_at(&self, p: DVec3) -> (DVec3, Source) {
        let hit = self.closest.project(p);
        (hit.point, self.source[hit.triangle as usize])
    }

    /// How far a point is from the surface, scene units.
    pub fn distance(&self, p: DVec3) -> f64 {
        self.closest.project(p).distance
    }
}

impl Reference for Under {
    fn project_near(&self, point: DVec3, under: &mut u32) -> SurfacePoint {
        let hit = self.closest.project_near(point, *under);
        *under = hit.triangle;
        SurfacePoint { point: hit.point, normal: self.normals[hit.triangle as usize] }
    }
}

/// Quads for one region. Indices below the region's rim count are rim vertices; the rest are new, in order.
#[derive(Debug, Clone, Default)]
pub struct Fill {
    /// New vertices.
    pub positions: Vec<DVec3>,
    /// Quads, facing as the surface does.
    pub quads: Vec<[u32; 4]>,
}

/// Why a filler has no answer.
#[derive(Debug, Clone, thiserror::Error)]
pub enum Declined {
    /// The region is not of the filler's kind, or the filler failed on it.
    #[error("{0}")]
    Because(String),
    /// The caller asked to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// Regions with their fills, as the fillers left them.
#[derive(Debug)]
pub struct Filled {
    /// The regions.
    pub regions: Vec<Region>,
    /// A fill for each.
    pub fills: Vec<Fill>,
    /// Who was asked for them.
    pub filler: Filler,
    /// How each was found.
    pub reports: Vec<RegionReport>,
}

impl Filled {
    /// The fill of a region that is exactly one of these, wherever it lies in the band's numbering.
    fn find(&self, region: &Region) -> Option<(Fill, RegionReport)> {
        let k = self.regions.iter().position(|known| known.is_filled_like(region))?;
        Some((self.fills[k].clone(), self.reports[k].clone()))
    }
}

/// Regions that no filler could take.
#[derive(Debug)]
pub struct Unfilled {
    /// Their indices, ascending.
    pub regions: Vec<u32>,
    /// Why the first of them has no answer.
    pub reason: Declined,
}

impl Region {
    /// Cuts the region that consists of some triangles out of the resampled band.
    pub fn cut_out(band: &DividedBand<'_>, triangles: &[u32], under: Under) -> Self {
        let DividedBand { surface, topology, is_line, piece, size, outside } = *band;
        let same_piece = |h: u32| piece[(topology.twin[h as usize] / 3) as usize] == piece[(h / 3) as usize];
        let on_rim = |h: u32| topology.is_border(h) || is_line[h as usize];
        let is_border = |h: u32| topology.is_border(h) || (is_line[h as usize] && !same_piece(h));
        let half_edges = || triangles.iter().flat_map(|&t| 3 * t..3 * t + 3);
        // A vertex where the region touches itself counts once for each fan of triangles there.
        let fan = |h: u32| {
            let mut first = h;
            while !is_border(first) {
                first = topology.next[topology.twin[first as usize] as usize];
                if first == h {
                    return (topology.from(h), mesh::NONE);
                }
            }
            (topology.from(h), first)
        };
        let fans: BTreeMap<u32, (u32, u32)> = half_edges().map(|h| (h, fan(h))).collect();
        // A half-edge ends in the fan that the next one starts from.
        let mut order: Vec<(u32, u32)> =
            half_edges().filter(|&h| on_rim(h)).flat_map(|h| [fans[&h], fans[&topology.next[h as usize]]]).collect();
        order.sort_unstable();
        order.dedup();
        let rim: Vec<u32> = order.iter().map(|f| f.0).collect();
        let mut local: BTreeMap<(u32, u32), u32> = order.iter().enumerate().map(|(k, &f)| (f, k as u32)).collect();
        for h in half_edges() {
            local.entry(fans[&h]).or_insert_with(|| {
                order.push(fans[&h]);
                order.len() as u32 - 1
            });
        }
        let at = |h: u32| local[&fans[&h]];
        let cut_out = TriangleMesh {
            positions: order.iter().map(|f| surface.positions[f.0 as usize]).collect(),
            triangles: triangles.iter().map(|&t| [3 * t, 3 * t + 1, 3 * t + 2].map(at)).collect(),
        };
        let ends = |h: u32| [at(h), at(topology.next[h as usize])];
        let lines = || half_edges().filter(|&h| is_line[h as usize]);
        let inner_lines = lines().filter(|&h| h < topology.twin[h as usize] && same_piece(h)).map(ends).collect();
        let line_edges = lines().filter(|&h| !same_piece(h)).map(ends).collect();
        let own = Topology::of_triangles(&cut_out);
        let loops =
            own.border_loops().into_iter().map(|walk| walk.into_iter().map(|h| own.from(h)).collect()).collect();
        Self {
            rim_count: rim.len(),
            outside: rim.iter().map(|&v| outside[v as usize]).collect(),
            rim,
            loops,
            inner_lines,
            line_edges,
            size: order.iter().map(|f| size[f.0 as usize]).collect(),
            surface: cut_out,
            under,
        }
    }

    /// True when the fillers would do the same with both.
    fn is_filled_like(&self, other: &Self) -> bool {
        self.surface == other.surface
            && self.rim_count == other.rim_count
            && self.loops == other.loops
            && self.inner_lines == other.inner_lines
            && self.line_edges == other.line_edges
            && self.outside == other.outside
            && self.size == other.size
    }

    /// Checks that a fill has this region's rim as its border, once round, and is a manifold of the same topology.
    ///
    /// # Errors
    /// A sentence that says what is wrong with the fill.
    pub fn verify(&self, fill: &Fill) -> Result<(), String> {
        let count = self.rim_count + fill.positions.len();
        if fill.quads.iter().flatten().any(|&v| v as usize >= count) {
            return Err("a quad names a vertex that does not exist".into());
        }
        let topology = Topology::new(count, &fill.quads);
        let rim: std::collections::BTreeSet<[u32; 2]> =
            self.loops.iter().flat_map(|walk| (0..walk.len()).map(|k| [walk[k], walk[(k + 1) % walk.len()]])).collect();
        let mut border = 0;
        for h in (0..topology.len() as u32).filter(|&h| topology.is_border(h)) {
            border += 1;
            if !rim.contains(&[topology.from(h), topology.to(h)]) {
                return Err("the border of the fill is not the region's".into());
            }
        }
        if border != rim.len() {
            return Err("the fill does not reach all of the region's border".into());
        }
        for &[a, b] in &self.inner_lines {
            if topology.find(a, b).is_none() && topology.find(b, a).is_none() {
                return Err("an edge of a line is missing".into());
            }
        }
        let mut corners = vec![0; count];
        for &v in &topology.origin {
            corners[v as usize] += 1;
        }
        if let Some(v) = (0..count).find(|&v| corners[v] == 0 || corners[v] != topology.around(v as u32).count()) {
            return Err(format!("the quads at vertex {v} of the fill do not form one fan"));
        }
        let euler = |vertices: usize, edges: usize, faces: usize| vertices as i64 - edges as i64 + faces as i64;
        let surface = Topology::of_triangles(&self.surface);
        let wanted = euler(self.surface.positions.len(), surface.edges().count(), self.surface.triangles.len());
        if euler(count, topology.edges().count(), fill.quads.len()) != wanted {
            return Err("the fill has another topology than the region".into());
        }
        Ok(())
    }

    /// Quads that the target edge lengths ask for: the integral of 1 / size squared.
    pub fn expected_quads(&self) -> f64 {
        (0..self.surface.triangles.len())
            .map(|t| {
                let mean = self.surface.triangles[t].iter().map(|&v| self.size[v as usize]).sum::<f64>() / 3.0;
                self.surface.area_normal(t).length() / (2.0 * mean * mean)
            })
            .sum()
    }

    /// Positions of all vertices of a fill: rim first.
    pub fn points(&self, fill: &Fill) -> Vec<DVec3> {
        self.surface.positions[..self.rim_count].iter().chain(&fill.positions).copied().collect()
    }
}

/// Edge lengths tried inside a region, as parts of the planned one, until a fill is flawless.
const SHRINKS: [f64; 3] = [1.0, 0.7, 0.5];

/// A flawless fill that scores below this needs no rival: fewer than half an irregular vertex for each border edge, and
/// shapes near squares.
const GOOD_SCORE: f64 = 1.2;

/// A fill of more quads than this is not tried with smaller ones.
const MOST_REFINED: usize = 1500;

/// Fills every region with the chosen filler, or with each that can take it until one is good, and keeps the best. A region
/// that is one of the regions `before` gets the fill it got then. Regions are filled in parallel; the result does not depend
/// on the order.
///
/// # Errors
/// [`Unfilled`] when regions get no valid fill, with the reason of the first.
pub fn fill_all(
    regions: &[Region],
    before: Option<&Filled>,
    filler: Filler,
    alpha: f64,
    diagonal: f64,
    monitor: &Monitor,
) -> Result<(Vec<Fill>, Vec<RegionReport>), Unfilled> {
    let known = |region: &Region| before.filter(|known| known.filler == filler)?.find(region);
    // All are waited for: which one fails first would depend on the threads.
    let filled: Vec<Result<(Fill, RegionReport), Declined>> = regions
        .par_iter()
        .map(|region| known(region).map_or_else(|| fill_region(region, filler, alpha, diagonal, monitor), Ok))
        .collect();
    let failed: Vec<u32> = (0..regions.len() as u32).filter(|&r| filled[r as usize].is_err()).collect();
    let filled: Result<Vec<(Fill, RegionReport)>, Declined> = filled.into_iter().collect();
    filled.map(|filled| filled.into_iter().unzip()).map_err(|reason| Unfilled { regions: failed, reason })
}

fn fill_region(
    region: &Region,
    filler: Filler,
    alpha: f64,
    diagonal: f64,
    monitor: &Monitor,
) -> Result<(Fill, RegionReport), Declined> {
    let mut report = RegionReport {
        filler: String::new(),
        quads: 0,
        loops: region.loops.len(),
        scores: BTreeMap::new(),
        declined: BTreeMap::new(),
    };
    let mut best: Option<(Score, Fill)> = None;
    let mut before = f64::INFINITY;
    for shrink in SHRINKS {
        for (name, kind) in [("patches", Filler::Patches), ("rings", Filler::Rings), ("matching", Filler::Matching)] {
            if filler != Filler::Auto && filler != kind {
                continue;
            }
            match fill_with(region, kind, shrink, alpha, monitor) {
                Ok(fill) => {
                    let score = judge::score(region, &fill, diagonal, monitor)?;
                    report.scores.insert(name.into(), score.total);
                    if best.as_ref().is_none_or(|(b, _)| score.total < b.total) {
                        name.clone_into(&mut report.filler);
                        best = Some((score, fill));
                    }
                    if score.flawless && score.total < GOOD_SCORE {
                        break;
                    }
                }
                Err(Declined::Cancelled(c)) => return Err(c.into()),
                Err(Declined::Because(reason)) => {
                    report.declined.insert(name.into(), reason);
                }
            }
        }
        let Some((score, fill)) = &best else { continue };
        // Where smaller quads do not help, the fault lies in the rim: that is for another plan of the lines.
        if score.flawless || score.total > 0.9 * before || fill.quads.len() > MOST_REFINED {
            break;
        }
        before = score.total;
    }
    let Some((_, fill)) = best else {
        let reasons: Vec<String> = report.declined.iter().map(|(name, why)| format!("{name}: {why}")).collect();
        return Err(Declined::Because(reasons.join("; ")));
    };
    report.quads = fill.quads.len();
    Ok((fill, report))
}

/// Smooths a fill whose connections were changed.
///
/// # Errors
/// [`Declined`] when it is no fill of the region any more.
pub fn smooth(region: &Region, fill: &Fill, monitor: &Monitor) -> Result<Fill, Declined> {
    let fill = finish::smooth(region, fill, monitor)?;
    region.verify(&fill).map_err(Declined::Because)?;
    Ok(fill)
}

/// One filler's finished and verified answer.
fn fill_with(region: &Region, kind: Filler, shrink: f64, alpha: f64, monitor: &Monitor) -> Result<Fill, Declined> {
    let raw = match kind {
        Filler::Patches => patches::fill(region, shrink, alpha, monitor),
        Filler::Rings => rings::fill(region, shrink, monitor),
        Filler::Matching | Filler::Auto => matching::fill(region, shrink, monitor),
    }?;
    region.verify(&raw).map_err(|fault| Declined::Because(format!("before finishing, {fault}")))?;
    let mut fill = finish::finish(region, &raw, monitor)?;
    if flat_corners::open(region, &mut fill) {
        fill = finish::smooth(region, &fill, monitor)?;
    }
    region.verify(&fill).map_err(Declined::Because)?;
    Ok(fill)
}

#[cfg(test)]
#[path = "fill/fill_tests.rs"]
mod tests;
