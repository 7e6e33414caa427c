//! The pipeline: check, triangulate, intersect, retract, plan the lines, fill, stitch, finish, validate; and the
//! retries when validation finds fault.

use crate::attributes::corner_sources;
use crate::band;
use crate::blend::blend;
use crate::fill::{self, Declined, Filled, Unfilled};
use crate::intersect::{Cut, Input, intersect};
use crate::plan::{self, OddRegions};
use crate::polychord::{Strips, borders};
use crate::resample::resample;
use crate::retract::retract;
use crate::stitch::{Stitched, stitch};
use crate::unique_edges::make_edges_unique;
use crate::validate::{Verdict, validate};
use crate::{BooleanError, Elements, Filler, Operation, Options, Output, Report, inspect};
use mesh::{DVec3, Monitor, PolygonMesh};
use solve::components::connected_components;
use std::collections::BTreeMap;
use std::time::Instant;

/// Attempts after the first that are made for the shape alone.
const TRIES_FOR_SHAPE: usize = 3;

/// Attempts that only make the quads smaller where the one before failed.
const LOCAL_TRIES: usize = 1;

/// More faults than this are not local.
const MOST_SPOTS: usize = 20;

/// What is varied when validation fails: edge length on the lines and in the band, everywhere or about some spots, width of
/// the band, filler.
#[derive(Debug, Clone)]
struct Attempt {
    scale: f64,
    distance: f64,
    filler: Filler,
    spots: Vec<DVec3>,
}

impl Attempt {
    /// The caller's settings.
    fn first(options: &Options) -> Self {
        Self { scale: 1.0, distance: options.retraction_distance, filler: options.filler, spots: vec![] }
    }

    /// The attempts that are made one after another when local ones do not help.
    fn others(options: &Options) -> Vec<Self> {
        let first = Self::first(options);
        let wider = Self { distance: first.distance + 1.0, ..first.clone() };
        let mut list: Vec<Self> = [0.75, 0.5].map(|scale| Self { scale, ..first.clone() }).to_vec();
        list.extend([1.0, 0.6].map(|scale| Self { scale, ..wider.clone() }));
        if first.filler == Filler::Auto {
            list.push(Self { scale: 0.6, filler: Filler::Matching, ..first });
        }
        list
    }
}

/// Boolean of two closed, manifold, pure-quad meshes that keeps every quad the cut does not touch.
///
/// `a` and `b` share one coordinate frame, in scene units. Same input, same output, whatever the number of threads.
/// Costs what the exact boolean costs, O(n log n), plus work in proportion to the band along the cut.
///
/// # Errors
/// [`BooleanError`]: an invalid input with its elements, an option out of range, an empty result, or a region that no
/// filler could mesh.
///
/// # Source
/// Nuvoli et al., `QuadMixer`, 2019; docs/papers.md lists the deviations.
pub fn boolean(
    a: &PolygonMesh,
    b: &PolygonMesh,
    operation: Operation,
    options: &Options,
    monitor: &Monitor,
) -> Result<Output, BooleanError> {
    let mut clock = Clock { last: Some(Instant::now()), ..Clock::default() };
    options.check()?;
    monitor.stage("check", 0.0)?;
    // The stages work at unit size, so that no scale of the scene overflows or underflows. A power of two: nothing is
    // rounded, and kept vertices come back bit for bit.
    let unit = mesh::unit_scale(used_points(a).chain(used_points(b)));
    inspect::inspect(a, 0, unit, monitor)?;
    inspect::inspect(b, 1, unit, monitor)?;
    for (input, mesh) in [a, b].into_iter().enumerate() {
        inspect::inspect_features(mesh, &options.feature_edges[input], input)?;
    }
    clock.lap("check");
    let [a, b] = &[a, b].map(|mesh| at_unit_size(mesh, unit));
    let options = &Options { blend_radius: unit * options.blend_radius, ..options.clone() };
    let first = Input::new(a);
    monitor.check()?;
    let inputs = [first, Input::new(b)];
    clock.lap("triangulate");
    monitor.stage("intersect", 0.1)?;
    let cut = intersect(&inputs, operation, monitor)?;
    clock.lap("intersect");

    let mut job = Job { inputs: &inputs, operation, cut: &cut, options, monitor, clock, retries: vec![] };
    let done = job.run()?;
    let output = job.report(done)?;
    Ok(Output { mesh: output.mesh.scaled(unit.recip()), ..output })
}

/// Positions of the corners of all faces.
fn used_points(mesh: &PolygonMesh) -> impl Iterator<Item = &DVec3> {
    mesh.corner_verts().iter().map(|&v| &mesh.positions[v as usize])
}

/// The mesh scaled by `unit`. Vertices without a face go to where one with a face is: they must not count for the extent.
fn at_unit_size(mesh: &PolygonMesh, unit: f64) -> PolygonMesh {
    let anywhere = mesh.corner_verts().first().map_or(DVec3::ZERO, |&v| mesh.positions[v as usize]);
    let mut positions = vec![unit * anywhere; mesh.vertex_count()];
    for &v in mesh.corner_verts() {
        positions[v as usize] = unit * mesh.positions[v as usize];
    }
    mesh.with_positions(positions)
}

#[derive(Debug, Default)]
struct Clock {
    last: Option<Instant>,
    seconds: BTreeMap<String, f64>,
}

impl Clock {
    /// Books the time since the last lap to a stage.
    fn lap(&mut self, stage: &str) {
        let now = Instant::now();
        let start = self.last.replace(now).unwrap_or(now);
        *self.seconds.entry(stage.to_owned()).or_default() += (now - start).as_secs_f64();
    }
}

struct Job<'a> {
    inputs: &'a [Input<'a>; 2],
    operation: Operation,
    cut: &'a Cut,
    options: &'a Options,
    monitor: &'a Monitor,
    clock: Clock,
    retries: Vec<String>,
}

struct Done {
    filled: Filled,
    stitched: Stitched,
    lines: Vec<[u32; 2]>,
    verdict: Verdict,
}

impl Job<'_> {
    fn run(&mut self) -> Result<Done, BooleanError> {
        let mut best: Option<Done> = None;
        // What is reported when all attempts fail is the first one, which has the caller's own settings.
        let mut blame: Option<(&'static str, [Elements; 2])> = None;
        let mut others = Attempt::others(self.options).into_iter();
        let count = others.len() + LOCAL_TRIES + 1;
        let mut attempt = Attempt::first(self.options);
        let mut local_tries = 0;
        for k in 0..count {
            self.monitor.stage("retract", 0.2 + 0.7 * k as f64 / count as f64)?;
            let mut spots = Vec::new();
            match self.attempt(&attempt, best.as_ref()) {
                Ok(done) => {
                    let verdict = &done.verdict;
                    let (is_valid, is_shapely) = (verdict.is_valid(), verdict.is_shapely());
                    if !is_valid || !is_shapely {
                        self.note(&attempt, &verdict.complaints());
                        spots.clone_from(&verdict.spots);
                    }
                    if best.as_ref().is_none_or(|b| verdict.score() < b.verdict.score()) {
                        best = Some(done);
                    }
                    // For its shape alone a valid result gets only so many more tries.
                    let is_good = best.as_ref().is_some_and(|b| b.verdict.is_valid());
                    if (is_valid && is_shapely) || (is_good && k >= TRIES_FOR_SHAPE) {
                        break;
                    }
                }
                Err(BooleanError::Infeasible { code, sentence, elements }) => {
                    self.note(&attempt, &sentence);
                    blame.get_or_insert((code, elements));
                }
                Err(error) => return Err(error),
            }
            if local_tries < LOCAL_TRIES && (1..=MOST_SPOTS).contains(&spots.len()) {
                local_tries += 1;
                attempt.spots.extend(spots);
            } else if let Some(next) = others.next() {
                local_tries = LOCAL_TRIES;
                attempt = next;
            } else {
                break;
            }
        }
        best.ok_or_else(|| {
            let (code, elements) = blame.unwrap_or_default();
            let tried = self.retries.join("; ");
            let sentence = format!(
                "no valid quad mesh was found along the cut ({tried}); move one object slightly or subdivide the coarser one"
            );
            BooleanError::Infeasible { code, sentence, elements }
        })
    }

    fn note(&mut self, attempt: &Attempt, complaint: &str) {
        let Attempt { scale, distance, filler, spots } = attempt;
        let local = if spots.is_empty() { String::new() } else { format!(", smaller at {} spots", spots.len()) };
        self.retries.push(format!("size {scale}{local} at distance {distance} with {filler:?}: {complaint}"));
    }

    /// One attempt; `before` is one whose fills are taken over where nothing has changed.
    fn attempt(&mut self, attempt: &Attempt, before: Option<&Done>) -> Result<Done, BooleanError> {
        let (inputs, cut, monitor) = (self.inputs, self.cut, self.monitor);
        let curve_edge = attempt.scale * plan::mean_curve_length(inputs, cut);
        let kept = retract(inputs, cut, attempt.distance, curve_edge, self.options, monitor)?;
        self.clock.lap("retract");
        let diagonal = mesh::Aabb::of(cut.surface.positions.iter().copied()).diagonal();
        let volume = mesh::volume(&cut.surface);
        let mut strips = Strips::default();
        let (band, plan) = loop {
            let band = band::extract(inputs, cut, &kept, &strips, self.options);
            match plan::plan(inputs, &band, diagonal, volume, attempt.scale, &attempt.spots, monitor) {
                Ok(plan) => break (band, plan),
                Err(OddRegions(odd)) => {
                    let even = strips.make_borders_even(inputs, &kept, &borders(&band), &|| monitor.is_cancelled());
                    monitor.check()?;
                    if !even {
                        return Err(BooleanError::Infeasible {
                            code: "odd",
                            sentence: format!("{} regions along the cut have an odd border", odd.len()),
                            elements: band.faces_under(inputs, &odd),
                        });
                    }
                }
            }
        };
        let resampled = resample(inputs, &band, &plan, monitor)?;
        self.clock.lap("plan");
        monitor.stage("fill", monitor.progress().1)?;
        let regions = resampled.regions(inputs, self.operation, &kept, &band)?;
        let no_fill = |regions: &[u32], reason| match reason {
            Declined::Cancelled(cancelled) => cancelled.into(),
            Declined::Because(sentence) => {
                let elements = band.faces_under(inputs, regions);
                BooleanError::Infeasible { code: "no_fill", sentence, elements }
            }
        };
        let before = before.map(|done| &done.filled);
        let (raw, mut reports) =
            fill::fill_all(&regions, before, attempt.filler, self.options.alpha, diagonal, monitor)
                .map_err(|Unfilled { regions, reason }| no_fill(&regions, reason))?;
        let mut fills = raw.clone();
        for r in make_edges_unique(inputs, &kept, &strips, &resampled, &regions, &mut fills) {
            fills[r] = fill::smooth(&regions[r], &fills[r], monitor).map_err(|reason| no_fill(&[r as u32], reason))?;
            reports[r].quads = fills[r].quads.len();
        }
        self.clock.lap("fill");
        let stitched = stitch(inputs, self.operation, &kept, &strips, &resampled, &regions, &fills);
        self.clock.lap("stitch");
        let lines = resampled
            .arcs
            .iter()
            .zip(&band.arcs)
            .filter(|(_, arc)| arc.on_curve)
            .flat_map(|(path, _)| path.windows(2).map(|w| [w[0], w[1]].map(|v| stitched.band_vertex[v as usize])))
            .collect();
        monitor.stage("validate", monitor.progress().1)?;
        let verdict = validate(&stitched, cut, &band, diagonal, monitor)?;
        self.clock.lap("validate");
        if let Some(fault) = verdict.topology {
            let everything: Vec<u32> = (0..band.region_count as u32).collect();
            return Err(no_fill(&everything, Declined::Because(fault)));
        }
        Ok(Done { filled: Filled { regions, fills: raw, filler: attempt.filler, reports }, stitched, lines, verdict })
    }

    fn report(mut self, mut done: Done) -> Result<Output, BooleanError> {
        self.monitor.stage("attributes", 0.95)?;
        let corner_source = corner_sources(self.inputs, self.operation, &done.filled.regions, &done.stitched);
        self.clock.lap("attributes");
        let mut faces_moved = 0;
        if self.options.blend_radius > 0.0 {
            self.monitor.stage("blend", 0.97)?;
            faces_moved = blend(&mut done.stitched, &done.lines, self.options.blend_radius, self.monitor)?;
            done.verdict.measure_shape(&done.stitched);
            self.clock.lap("blend");
        }
        let mesh = done.stitched.mesh;
        let faces_kept = done.stitched.face_source.iter().filter(|s| s[0] >= 0).count();
        let mut warnings = Vec::new();
        if !done.verdict.is_valid() {
            warnings.push(format!("the result is not flawless: {}", done.verdict.complaints()));
        }
        if faces_kept == 0 {
            warnings.push("no quad of either input lies beyond the cut: everything was remade".to_owned());
        }
        let ends = done.lines.iter().map(|&[a, b]| (a, b));
        // A vertex off the lines is a component by itself.
        let curves = connected_components(mesh.vertex_count(), ends).iter().filter(|c| c.len() > 1).count();
        let report = Report {
            faces_kept,
            faces_new: mesh.face_count() - faces_kept,
            faces_moved,
            irregular_vertices: done.verdict.irregular,
            scaled_jacobian_min: done.verdict.jacobian_min,
            scaled_jacobian_mean: done.verdict.jacobian_mean,
            regions: done.filled.reports,
            curves,
            quads_whole: self.cut.whole.iter().flatten().flatten().count(),
            retries: self.retries,
            warnings,
            seconds: self.clock.seconds,
        };
        Ok(Output {
            mesh,
            face_source: done.stitched.face_source,
            corner_source,
            intersection_edges: done.lines,
            report,
        })
    }
}
