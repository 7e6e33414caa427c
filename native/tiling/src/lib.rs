//! Tri-Quad Tiling: meshes of unit equilateral triangles and squares inside a given outline.
//!
//! Follows C.-H. Peng, H. Pottmann, P. Wonka, Designing Patterns using Triangle-Quad Hybrid Meshes, ACM TOG 37(4), 2018,
//! parts 3, 4 and 6; docs/papers.md maps its sections to files. Everything about tilings is
//! exact: only `fit`, whose curves are drawn, decides by rounded numbers.

mod approach;
mod border;
mod boundary;
mod certificate;
mod corner;
mod design;
mod drawn;
mod error;
mod explain;
mod fence;
mod fit;
mod graph;
mod inflate;
mod nearest;
mod options;
mod packed;
mod panel_count;
mod paths;
mod peel;
mod picture;
mod piece;
mod plane;
mod polygons;
mod programme;
mod random;
mod region;
mod repair;
mod rhombi;
pub mod schedule;
mod surface;
mod symmetry;
mod tile;
mod tilings;
mod value;

pub use self::surface::{
    Along, Bar, Corner, DrawnGraph, Edit, EditError, Fill, FoldError, FoldOptions, Folding, Gluing, GraphError,
    GraphFault, MissedBar, NoCIndices, Panel, Partition, Patch, PatchDesign, PatchGraph, PatchTiles, PolyhedronOptions,
    PolyhedronTiling, Proposal, ShapeOptions, Side, SurfaceError, SurfaceOptions, SurfaceTiling, Zigzag, fold,
    tile_surface, zigzags_of_patch,
};
pub use border::Conflict;
pub use boundary::Boundary;
pub use certificate::Certificate;
pub use design::PolygonDesign;
pub use error::TilingError;
pub use explain::{Explanation, Verdict, explain_boundary};
pub use fit::{Fit, FitOptions, fit_boundary};
pub use mesh::Cancelled;
pub use nearest::{NearestLoop, nearest_loop_by_programme};
pub use num_bigint::BigUint;
pub use options::Options;
pub use plane::{Direction, Isometry, Point, Surd};
pub use polygons::{PanelSize, PolygonTiling, PolygonsError, tile_polygons, tile_polyhedron};
pub use programme::tilings_by_programme;
pub use repair::{Repair, repair};
pub use rhombi::{WithRhombi, count_with_rhombi, tile_with_rhombi};
pub use tile::{Configuration, Kind, Tile, Tiling};
pub use tilings::{Refutation, Tilings, count_tilings, find_tiling, is_tileable, refute};
