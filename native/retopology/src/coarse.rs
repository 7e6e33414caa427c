//! The coarsest layout: of some bases the one whose quads have the fewest patches.
//!
//! Not in Daniels et al. 2011, whose artist sees the base and moves sites. How many patches of its base complex a quad mesh has
//! depends on where its separatrices happen to run, which nothing short of laying the quads tells.

use crate::base::Base;
use crate::base_complex::patches;
use crate::build::BaseOptions;
use crate::density;
use crate::error::LayoutError;
use crate::fill;
use crate::lines;
use crate::measures::Measures;
use crate::pairing::{Given, Pairing, pair_often};
use crate::patch::{Patch, Plan};
use crate::pipeline::NEAR_TARGET;
use crate::quads::{LayoutOptions, Quads};
use mesh::{Monitor, PolygonMesh, scaled_jacobian};

/// Weights of sides other than four that are tried, and runs of the search with each: from the middles of such patches lines run over the
/// whole mesh, and how far they run is known only when all patches are. From the matching of section 5.2, which leaves hardly any such
/// patch, a tray had 271 to 570 patches of the base complex instead of 720, but quads that no place of their vertices made sound.
const OFF_FOUR: [f64; 3] = [2.5, 4.0, 7.0];
const RUNS: u64 = 8;

/// Bases tried: base vertices, and the least length of base edges, in terms of the options'. Measured on 19 meshes none was the
/// best for more than a third.
const TRIES: [(f64, f64); 4] = [(1.0, 1.0), (0.4, 1.0), (0.4, 2.0), (0.6, 1.6)];

/// Of a layout with turned quads, far from its target, or whose first percentile of the scaled Jacobian is below what is fair,
/// each patch counts as so many.
const TURNED: f64 = 100.0;
const MISSED: f64 = 10.0;
const BAD: f64 = 1.6;
const FAIR: f64 = 0.3;
/// And as so many more for each part of the features' length that edges do not follow, beyond what is fair: a tenth lost is worth
/// twice the patches.
const LOST: f64 = 11.0;
const FAIRLY_LOST: f64 = 0.01;

/// Of these, the ones that are tried with lines, too: fewer triangles are fewer patches.
const WITH_LINES: [bool; 4] = [false, false, true, true];

/// Options of the bases to try, and whether lone triangles are joined by lines.
pub(crate) fn tries(base: &BaseOptions, lines: bool) -> Vec<(BaseOptions, bool)> {
    let vertices = f64::from(base.vertices);
    let mut tries: Vec<(BaseOptions, bool)> = Vec::new();
    for ((part, longer), with_lines) in TRIES.into_iter().zip(WITH_LINES) {
        let options = BaseOptions {
            vertices: (vertices * part).round().max(4.0_f64.min(vertices)) as u32,
            least_quads: (base.least_quads * longer).min(20.0_f64.max(base.least_quads)),
            ..base.clone()
        };
        if lines && with_lines {
            tries.push((options.clone(), true));
        }
        tries.push((options, false));
    }
    tries
}

/// What speaks against a coarse layout: its patches, and its faults. `followed` is the share of the features that edges follow.
pub(crate) fn score(quads: &Quads, followed: f64) -> f64 {
    let mut jacobians: Vec<f64> = (0..quads.mesh.face_count()).map(|f| jacobian(&quads.mesh, f)).collect();
    jacobians.sort_by(f64::total_cmp);
    let turned = quads.report.inverted > 0 || jacobians.first().is_none_or(|least| *least <= 0.0);
    let bad = jacobians.get(jacobians.len() / 100).is_none_or(|percentile| *percentile < FAIR);
    let (faces, target) = (quads.report.faces as f64, quads.report.target.unwrap_or(quads.report.faces) as f64);
    let missed = (faces / target - 1.0).abs() > NEAR_TARGET;
    let faults = [(turned, TURNED), (missed, MISSED), (bad, BAD)];
    let lost = 1.0 + LOST * (1.0 - followed - FAIRLY_LOST).max(0.0);
    faults.iter().filter(|fault| fault.0).fold(patches(&quads.mesh) as f64 * lost, |score, fault| score * fault.1)
}

fn jacobian(mesh: &PolygonMesh, face: usize) -> f64 {
    let corners = mesh.face(face);
    scaled_jacobian([corners[0], corners[1], corners[2], corners[3]].map(|v| mesh.positions[v as usize]))
}

/// Pairs of triangles, with lines between those left over where the options say so. Without lines, and for bases too large for them, the
/// patches of those tried whose quads have the fewest patches of their base complex: that does not depend on the number of quads along
/// chords, so it is known before any is laid. `sizes` are as in [`Plan::size`] and [`Plan::plain`].
pub(crate) fn pair(
    base: &Base,
    measures: &Measures,
    options: &LayoutOptions,
    [size, plain]: [&[f64]; 2],
    monitor: &Monitor,
) -> Result<Vec<Patch>, LayoutError> {
    let pairing = options.pairing;
    if options.lines
        && matches!(pairing, Pairing::Programme { .. })
        && let Some(patches) = lines::choose(base, measures, monitor)?
    {
        return Ok(patches);
    }
    let least = vec![1; base.edges.len()];
    let mut best: Option<(usize, Vec<Patch>)> = None;
    for off_four in OFF_FOUR {
        let given = Given { forced: &[], kept: &[], straight_corners: false, off_four };
        for found in pair_often(base, measures, pairing, given, RUNS, monitor)? {
            let plan = Plan { base, measures, patches: &found, templates: &[], size, plain, least: &least };
            let counts = density::coarsest(plan);
            let topologies = fill::topologies(plan, &counts, monitor)?;
            let complex = fill::joined(plan, &counts, &topologies).map_or(usize::MAX, |quads| patches(&quads));
            if best.as_ref().is_none_or(|(least, _)| complex < *least) {
                best = Some((complex, found));
            }
        }
    }
    best.map(|(_, found)| found).ok_or(LayoutError::BadBase { element: "triangle", index: 0, reason: "there are none" })
}
