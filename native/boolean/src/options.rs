//! What the caller may choose.

use serde::Serialize;

/// Which boolean operation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Operation {
    /// Everything inside A or B.
    Union,
    /// Everything inside both.
    Intersection,
    /// A without B.
    Difference,
}

/// How the inputs are divided into patches at the start (section 3, Fig. 5).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Layout {
    /// Trace every separatrix to its end: more patches, no T-junctions.
    Separatrices,
    /// Trace all separatrices at once, each stops at the first trace it meets (Eppstein et al. 2008): fewer patches.
    #[default]
    Motorcycle,
}

/// How the quads that survive the cut are regrouped (section 3.1, Fig. 6 d-e).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Regroup {
    /// The paper's rule: in each cut patch, repeatedly take the largest inscribed rectangle; drop small ones.
    Rectangles,
    /// Drop whole rows along a border side where that removes corners, at most two quads a corner.
    #[default]
    Rows,
}

/// Which filler meshes the band along the cut.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Filler {
    /// Every filler that can take a region; the judge picks.
    #[default]
    Auto,
    /// The paper's: traced patches of three to six sides, an integer programme, patterns (3.2 to 3.5).
    Patches,
    /// Concentric rings between a border and the curve; annuli only.
    Rings,
    /// Triangles at the target size, paired by perfect matching; takes any region.
    Matching,
}

/// Options of [`crate::boolean`]. `Default` gives the recommended values.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// Quads nearer to the intersection curve than this are remade; in edge lengths (the larger of the quad's own mean
    /// edge and the curve's), range 0 to 10.
    pub retraction_distance: f64,
    /// Balance of the integer programme (3.3), between 0 (even edge lengths) and 1 (regular patches), exclusive.
    pub alpha: f64,
    /// Radius round the curve within which the surface is smoothed (4.2), scene units; 0 keeps the curve sharp.
    pub blend_radius: f64,
    /// Initial patch layout.
    pub layout: Layout,
    /// Regrouping rule.
    pub regroup: Regroup,
    /// Filler.
    pub filler: Filler,
    /// Edges whose faces meet at more than this angle become edge loops where the band is remade; radians.
    pub sharp_angle: f64,
    /// Edges of A and of B, as vertex pairs, that become edge loops whatever their angle.
    pub feature_edges: [Vec<[u32; 2]>; 2],
}

impl Default for Options {
    fn default() -> Self {
        Self {
            retraction_distance: 1.0,
            alpha: 0.5,
            blend_radius: 0.0,
            layout: Layout::default(),
            regroup: Regroup::default(),
            filler: Filler::default(),
            sharp_angle: 35_f64.to_radians(),
            feature_edges: [Vec::new(), Vec::new()],
        }
    }
}
