//! Why an outline has a tiling or none, in words and numbers (the open question of section 6, as far as it goes).

use crate::TilingError;
use crate::boundary::{Boundary, Trace};
use crate::certificate::Certificate;
use crate::options::Options;
use crate::plane::Point;
use crate::tilings::{is_tileable, refute};
use mesh::Monitor;

/// What was found first, from the coarsest fault to none.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// Too few or too many angles, or one that no corner can have.
    Angle,
    /// The exterior angles do not make one turn.
    Turning,
    /// The end is not the beginning.
    Open,
    /// The outline crosses or touches itself.
    NotSimple,
    /// No tiling, proven without a search: see [`refute`].
    Refuted,
    /// A complete search found no tiling.
    Untileable,
    /// There is a tiling.
    Tileable,
}

impl Verdict {
    /// A stable identifier.
    pub fn code(self) -> &'static str {
        match self {
            Self::Angle => "angle",
            Self::Turning => "turning",
            Self::Open => "open",
            Self::NotSimple => "not_simple",
            Self::Refuted => "refuted",
            Self::Untileable => "untileable",
            Self::Tileable => "tileable",
        }
    }
}

/// What [`explain_boundary`] finds.
#[derive(Debug, Clone, PartialEq)]
pub struct Explanation {
    /// The first fault, or none.
    pub verdict: Verdict,
    /// What is wrong and what to change, or what any tiling consists of.
    pub sentence: String,
    /// Corners at fault, as indices into the code; for [`Verdict::NotSimple`] pairs of edges, by the corners they leave; for
    /// [`Verdict::Refuted`] one whose leaving edge no tile fits, if that is the reason.
    pub corners: Vec<u32>,
    /// The corners of the outline, and its end when it does not close; empty for [`Verdict::Angle`].
    pub points: Vec<Point>,
    /// For an outline that closes: the tiles of any tiling.
    pub certificate: Option<Certificate>,
}

/// Says whether a boundary code closes, is simple, and can be tiled; and if not, why not.
///
/// # Errors
/// [`TilingError::Memory`] or [`TilingError::Cancelled`] from the search, which only outlines that pass all other tests
/// need. Those cost O(n log n), the certificate O(n).
pub fn explain_boundary(code: &[u8], options: &Options, monitor: &Monitor) -> Result<Explanation, TilingError> {
    let boundary = Boundary::new(code);
    let trace = Trace::new(code);
    let mut points = trace.as_ref().map_or(Vec::new(), |trace| trace.points.clone());
    if let Err(TilingError::Boundary { code, sentence, corners }) = boundary {
        let verdict = match code {
            "turning" => Verdict::Turning,
            "open" => Verdict::Open,
            "not_simple" => Verdict::NotSimple,
            _ => Verdict::Angle,
        };
        let closed = trace.as_ref().ok().filter(|trace| trace.end == Point::ORIGIN);
        points.extend(trace.as_ref().ok().map(|trace| trace.end).filter(|&end| end != Point::ORIGIN));
        let certificate = closed.filter(|_| verdict == Verdict::NotSimple);
        let certificate = certificate.map(|trace| Certificate::new(&trace.directions));
        return Ok(Explanation { verdict, sentence, corners, points, certificate });
    }
    let boundary = boundary?;
    let certificate = Certificate::new(boundary.directions());
    let mut corners = Vec::new();
    let (verdict, sentence) = if let Some(refutation) = refute(&boundary, monitor)? {
        corners = refutation.corners;
        (Verdict::Refuted, refutation.sentence)
    } else if is_tileable(&boundary, options, monitor)? {
        (Verdict::Tileable, certificate.to_string())
    } else {
        let sentence = format!(
            "no tiling exists: a search through all ways to place tiles found none, though the areas would fit ({} squares and {} triangles)",
            certificate.square_count(),
            certificate.triangle_count()
        );
        (Verdict::Untileable, sentence)
    };
    Ok(Explanation { verdict, sentence, corners, points, certificate: Some(certificate) })
}
