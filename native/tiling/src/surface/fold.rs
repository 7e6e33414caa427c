//! Foldings (section 5.1, Fig. 15): a plane tiling, cut and glued, becomes a regular mesh in space.
//!
//! Gluing changes the angle sums: where a wedge was cut out and its sides are glued lies a cone, and curvature with it. What
//! was a tile stays one, so the mesh asks for equilateral triangles and squares of one edge length, in whatever shape its
//! angles allow. The shape is found from the distances that one walks along the mesh (`unfold`), and made regular as polyhedra
//! are (`regular`). Deviation: the paper has a cylinder as reference surface instead of a first shape of the mesh's own.

use super::SurfaceError;
use super::panels::{self, Panel};
use super::regular::{REGULAR, irregularity, regularise, tiles_of};
use super::unfold::from_distances;
use crate::Kind;
use mesh::{Cancelled, DVec3, Monitor, NONE, PolygonMesh, Topology, sorted};
use std::collections::{BTreeMap, BTreeSet};

/// A sheet whose edges and diagonals are off by more than this, in edges, is no plane tiling.
const TOLERANCE: f64 = 1e-3;

/// How far tips are lifted before shaping for each 30 degrees of their defect and each of the rings that are lifted with them,
/// in edges.
const LIFT: f64 = 0.15;
const RINGS: u32 = 3;

/// Two runs along borders that become one.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Gluing {
    /// Vertex k of the first becomes vertex k of the second; neighbours in either are joined by an edge of the border.
    Vertices(Vec<u32>, Vec<u32>),
    /// The run of the border from the first vertex to the second with faces on its left, and that from the third to the
    /// fourth with faces on its right.
    Runs([u32; 4]),
    /// The borders to the left and to the right of a vertex, so many edges of them: a wedge closed like a zip.
    Zip {
        /// A vertex of the border.
        vertex: u32,
        /// Edges on either side of it.
        edges: u32,
    },
}

/// What the caller may choose.
#[derive(Debug, Clone, PartialEq)]
pub struct FoldOptions {
    /// Rounds of shaping before Newton's method. Default 400; 0 leaves the first shape as it was found.
    pub rounds: usize,
}

impl Default for FoldOptions {
    fn default() -> Self {
        Self { rounds: 400 }
    }
}

/// A folded sheet.
#[derive(Debug, Clone)]
pub struct Folding {
    /// The mesh: faces in the order of those of the sheet that were not cut out.
    pub mesh: PolygonMesh,
    /// One a face.
    pub panels: Vec<Panel>,
    /// Face of the sheet that each face was.
    pub face_source: Vec<u32>,
    /// Vertex of the mesh that each vertex of the sheet became; `NONE` where all its faces were cut out.
    pub vertex_of: Vec<u32>,
    /// Vertices whose angle defect is not zero, and the defect in units of 30 degrees: true angles where the mesh is regular.
    pub defects: Vec<(u32, i32)>,
    /// The greatest departure of an edge from the mean edge, and of a square's diagonal from sqrt 2, in edges.
    pub irregularity: f64,
}

impl Folding {
    /// Whether all panels are equilateral triangles and squares of one edge length, to a millionth of it.
    pub fn is_regular(&self) -> bool {
        self.irregularity < REGULAR
    }
}

/// Why a sheet cannot be folded so.
#[derive(Debug, thiserror::Error)]
pub enum FoldError {
    /// The sheet is no plane tiling.
    #[error(
        "{} faces of the sheet are no equilateral triangles or squares with one edge length, the first is {}; give a tiling",
        faces.len(), faces[0]
    )]
    NotTiles {
        /// The faces.
        faces: Vec<u32>,
    },
    /// The sheet is no oriented manifold.
    #[error("{} edges of the sheet have more than two faces or faces that run the same way; give a tiling", edges.len())]
    NotManifold {
        /// Vertex pairs.
        edges: Vec<[u32; 2]>,
    },
    /// A face to cut out is none.
    #[error("face {face} cannot be cut out: the sheet has faces 0 to {}", count.saturating_sub(1))]
    NoSuchFace {
        /// As given.
        face: u32,
        /// Number of faces.
        count: usize,
    },
    /// Nothing is left.
    #[error("all faces are cut out; leave some")]
    Nothing,
    /// A vertex is not on the border.
    #[error("gluing {gluing} cannot be made: vertex {vertex} is on no border of what is left of the sheet")]
    NotOnBorder {
        /// Index of the gluing.
        gluing: usize,
        /// The vertex.
        vertex: u32,
    },
    /// Neighbours in a run are not.
    #[error(
        "gluing {gluing} cannot be made: vertices {} and {} are joined by no edge of the border; name every vertex of the run",
        edge[0], edge[1]
    )]
    NotAnEdge {
        /// Index of the gluing.
        gluing: usize,
        /// The two vertices.
        edge: [u32; 2],
    },
    /// The runs have different lengths.
    #[error(
        "gluing {gluing} cannot be made: its runs have {first} and {second} edges; both need as many, and at least one"
    )]
    Lengths {
        /// Index of the gluing.
        gluing: usize,
        /// Edges of the first run.
        first: usize,
        /// Edges of the second.
        second: usize,
    },
    /// The runs would make a Moebius strip.
    #[error(
        "gluing {gluing} cannot be made: edges {} to {} and {} to {} have their faces on the same hand, so that the sheet \
         would have one side only; reverse one run", first[0], first[1], second[0], second[1]
    )]
    Orientation {
        /// Index of the gluing.
        gluing: usize,
        /// An edge of the first run.
        first: [u32; 2],
        /// The edge it would be glued to.
        second: [u32; 2],
    },
    /// An edge is glued twice.
    #[error("gluing {gluing} cannot be made: the edge from {} to {} is glued already", edge[0], edge[1])]
    Twice {
        /// Index of the gluing.
        gluing: usize,
        /// The edge.
        edge: [u32; 2],
    },
    /// What is glued is no surface.
    #[error(
        "the glued sheet is no surface: {} faces have a corner twice, {} edges have more than two faces, {} vertices have \
         faces that hang together there alone; leave out the gluings there or glue the rest of their borders",
        faces.len(), edges.len(), vertices.len()
    )]
    NoSurface {
        /// Faces of the sheet.
        faces: Vec<u32>,
        /// Vertex pairs of the sheet.
        edges: Vec<[u32; 2]>,
        /// Vertices of the sheet.
        vertices: Vec<u32>,
    },
    /// Shaping failed.
    #[error(transparent)]
    Shaping(#[from] SurfaceError),
    /// The caller asked to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// Cuts faces out of a plane tiling, glues borders and shapes the result to equilateral triangles and squares.
///
/// The sheet is a mesh of triangles and squares of one edge length, in the plane or already bent. Gluings name vertices of the
/// sheet; they are made together, each on the border that is there once the faces are cut out.
///
/// Where no regular mesh of these combinatorics is found the nearest one is returned: see [`Folding::irregularity`]. Panels
/// may pass through one another.
///
/// # Errors
/// [`FoldError`], naming what cannot be glued.
///
/// # Source
/// Peng et al. 2018, section 5.1, Fig. 15. Costs O(n log n) and a few dozen factorisations.
pub fn fold(
    sheet: &PolygonMesh,
    cut_out: &[u32],
    gluings: &[Gluing],
    options: &FoldOptions,
    monitor: &Monitor,
) -> Result<Folding, FoldError> {
    monitor.stage("gluing", 0.0)?;
    check_tiles(sheet)?;
    let count = sheet.face_count();
    if let Some(&face) = cut_out.iter().find(|&&face| face as usize >= count) {
        return Err(FoldError::NoSuchFace { face, count });
    }
    let cut: BTreeSet<u32> = cut_out.iter().copied().collect();
    let face_source: Vec<u32> = (0..count as u32).filter(|face| !cut.contains(face)).collect();
    if face_source.is_empty() {
        return Err(FoldError::Nothing);
    }
    let faces: Vec<&[u32]> = face_source.iter().map(|&f| sheet.face(f as usize)).collect();
    let border = Border::of(&faces);
    let glued = glue(sheet.vertex_count(), &border, gluings)?;
    check_surface(&faces, &face_source, &glued)?;
    let mut vertex_of = vec![NONE; sheet.vertex_count()];
    let mut number: BTreeMap<u32, u32> = BTreeMap::new();
    for &v in faces.iter().copied().flatten() {
        let next = number.len() as u32;
        vertex_of[v as usize] = *number.entry(glued[v as usize]).or_insert(next);
    }
    let tiles: Vec<Vec<u32>> = faces.iter().map(|face| face.iter().map(|&v| vertex_of[v as usize]).collect()).collect();
    let mut positions = from_distances(&tiles, number.len(), monitor)?;
    lift_tips(&tiles, &mut positions)?;
    // As large as the sheet.
    let edge = super::regular::mean_edge(&tiles_of(sheet), &sheet.positions);
    let irregularity = regularise(&tiles, &mut positions, options.rounds, monitor)?;
    let scale = edge / super::regular::mean_edge(&tiles, &positions);
    let up: DVec3 = tiles.iter().map(|tile| area_normal(tile, &positions)).sum();
    for p in &mut positions {
        // Outside up, and to the scale of the sheet.
        *p *= if up.z < 0.0 { DVec3::new(scale, -scale, -scale) } else { DVec3::splat(scale) };
    }
    let mesh = PolygonMesh::from_polygons(positions, &tiles).map_err(SurfaceError::from)?;
    let kinds: Vec<Kind> =
        tiles.iter().map(|tile| if tile.len() == 3 { Kind::Triangle } else { Kind::Square }).collect();
    Ok(Folding {
        panels: Panel::all(&mesh, &kinds),
        defects: panels::defects(&mesh).0.into_iter().collect(),
        mesh,
        face_source,
        vertex_of,
        irregularity,
    })
}

/// Moves vertices inside with a positive defect outwards, and those about them less, so that they become tips and not dimples.
fn lift_tips(tiles: &[Vec<u32>], positions: &mut [DVec3]) -> Result<(), FoldError> {
    let flat = PolygonMesh::from_polygons(positions.to_vec(), tiles).map_err(SurfaceError::from)?;
    let topology = Topology::of(&flat);
    let mut normals = vec![DVec3::ZERO; positions.len()];
    for tile in tiles {
        for &v in tile {
            normals[v as usize] += area_normal(tile, &flat.positions);
        }
    }
    let tips = panels::defects(&flat).0.into_iter().filter(|&(v, defect)| defect > 0 && !topology.is_border_vertex(v));
    for (tip, defect) in tips {
        let (mut ring, mut met) = (vec![tip], BTreeSet::from([tip]));
        for near in (1..=RINGS).rev() {
            for &v in &ring {
                let lift = LIFT * f64::from(defect) * f64::from(near);
                positions[v as usize] += lift * normals[v as usize].normalize_or_zero();
            }
            ring = ring.iter().flat_map(|&v| topology.neighbours(v)).filter(|&w| met.insert(w)).collect();
        }
    }
    Ok(())
}

fn area_normal(tile: &[u32], positions: &[DVec3]) -> DVec3 {
    let at = |k: usize| positions[tile[k] as usize] - positions[tile[0] as usize];
    (1..tile.len() - 1).map(|k| at(k).cross(at(k + 1)) / 2.0).sum()
}

/// Faces are equilateral triangles and squares of one size, and make an oriented manifold.
fn check_tiles(sheet: &PolygonMesh) -> Result<(), FoldError> {
    let tiles = tiles_of(sheet);
    // The edge that most have, so that crooked faces do not make others look so.
    let mut lengths: Vec<f64> =
        tiles.iter().map(|tile| super::regular::mean_edge(std::slice::from_ref(tile), &sheet.positions)).collect();
    lengths.sort_by(f64::total_cmp);
    let edge = lengths.get(lengths.len() / 2).copied().unwrap_or(0.0);
    let is_tile = |tile: &Vec<u32>| {
        (3..=4).contains(&tile.len()) && edge > 0.0 && {
            // A tile on its own, with the edge of all.
            let off = irregularity(std::slice::from_ref(tile), &sheet.positions);
            let own = super::regular::mean_edge(std::slice::from_ref(tile), &sheet.positions);
            off < TOLERANCE && (own / edge - 1.0).abs() < TOLERANCE
        }
    };
    let faces: Vec<u32> = (0..).zip(&tiles).filter(|(_, tile)| !is_tile(tile)).map(|(f, _)| f).collect();
    if !faces.is_empty() {
        return Err(FoldError::NotTiles { faces });
    }
    let mut seen = BTreeSet::new();
    let mut edges = Vec::new();
    for tile in &tiles {
        for k in 0..tile.len() {
            let edge = [tile[k], tile[(k + 1) % tile.len()]];
            if !seen.insert(edge) {
                edges.push(edge);
            }
        }
    }
    if edges.is_empty() { Ok(()) } else { Err(FoldError::NotManifold { edges }) }
}

/// The border of the faces: each edge as it runs with its face on the left.
struct Border {
    edges: BTreeSet<[u32; 2]>,
    /// Vertices after and before each one; where borders touch in a vertex there are several.
    after: BTreeMap<u32, Vec<u32>>,
    before: BTreeMap<u32, Vec<u32>>,
}

impl Border {
    fn of(faces: &[&[u32]]) -> Self {
        let all: BTreeSet<[u32; 2]> =
            faces.iter().flat_map(|face| (0..face.len()).map(|k| [face[k], face[(k + 1) % face.len()]])).collect();
        let edges: BTreeSet<[u32; 2]> = all.iter().copied().filter(|&[a, b]| !all.contains(&[b, a])).collect();
        let (mut after, mut before): (BTreeMap<u32, Vec<u32>>, BTreeMap<u32, Vec<u32>>) = Default::default();
        for &[a, b] in &edges {
            after.entry(a).or_default().push(b);
            before.entry(b).or_default().push(a);
        }
        Self { edges, after, before }
    }

    /// The border from a vertex on, with faces on the left or else on the right, until `stop`.
    fn walk(
        &self,
        gluing: usize,
        from: u32,
        is_forward: bool,
        stop: impl Fn(&[u32]) -> bool,
    ) -> Result<Vec<u32>, FoldError> {
        let mut run = vec![from];
        while !stop(&run) {
            let here = run[run.len() - 1];
            let next = if is_forward { &self.after } else { &self.before };
            // Where borders touch the run is not known, and past one round there is nothing new.
            let next = next.get(&here).filter(|next| next.len() == 1 && run.len() <= self.edges.len());
            run.push(next.ok_or(FoldError::NotOnBorder { gluing, vertex: here })?[0]);
        }
        Ok(run)
    }

    /// The runs of a gluing, the first with faces on one hand, the second with faces on the other.
    fn runs(&self, gluing: usize, wish: &Gluing) -> Result<[Vec<u32>; 2], FoldError> {
        Ok(match wish {
            Gluing::Vertices(first, second) => [first.clone(), second.clone()],
            &Gluing::Runs([a, b, c, d]) => {
                let until = |end: u32| move |run: &[u32]| run[run.len() - 1] == end && run.len() > 1;
                for end in [b, d] {
                    if !self.after.contains_key(&end) {
                        return Err(FoldError::NotOnBorder { gluing, vertex: end });
                    }
                }
                [self.walk(gluing, a, true, until(b))?, self.walk(gluing, c, false, until(d))?]
            }
            &Gluing::Zip { vertex, edges } => {
                let far = |run: &[u32]| run.len() > edges as usize;
                [self.walk(gluing, vertex, true, far)?, self.walk(gluing, vertex, false, far)?]
            }
        })
    }
}

/// The vertex that each vertex becomes: the least of those it is glued to.
fn glue(count: usize, border: &Border, gluings: &[Gluing]) -> Result<Vec<u32>, FoldError> {
    let mut parent: Vec<u32> = (0..count as u32).collect();
    let mut used: BTreeSet<[u32; 2]> = BTreeSet::new();
    for (gluing, wish) in gluings.iter().enumerate() {
        let [first, second] = border.runs(gluing, wish)?;
        if first.len() != second.len() || first.len() < 2 {
            let [first, second] = [first.len(), second.len()].map(|n| n.saturating_sub(1));
            return Err(FoldError::Lengths { gluing, first, second });
        }
        for (one, other) in first.windows(2).zip(second.windows(2)) {
            let (one, other) = ([one[0], one[1]], [other[0], other[1]]);
            let runs_forward = |[a, b]: [u32; 2]| match [[a, b], [b, a]].map(|edge| border.edges.contains(&edge)) {
                [true, _] => Ok(true),
                [_, true] => Ok(false),
                _ => Err(FoldError::NotAnEdge { gluing, edge: [a, b] }),
            };
            if runs_forward(one)? == runs_forward(other)? {
                return Err(FoldError::Orientation { gluing, first: one, second: other });
            }
            for edge in [one, other] {
                if !used.insert(sorted(edge[0], edge[1])) {
                    return Err(FoldError::Twice { gluing, edge });
                }
            }
        }
        for (&a, &b) in first.iter().zip(&second) {
            let (a, b) = (root(&parent, a), root(&parent, b));
            parent[a.max(b) as usize] = a.min(b);
        }
    }
    Ok((0..count as u32).map(|v| root(&parent, v)).collect())
}

fn root(parent: &[u32], mut v: u32) -> u32 {
    while parent[v as usize] != v {
        v = parent[v as usize];
    }
    v
}

/// Each glued edge has two faces at most, each vertex one fan of them, each face its own corners.
fn check_surface(faces: &[&[u32]], face_source: &[u32], glued: &[u32]) -> Result<(), FoldError> {
    let tiles: Vec<Vec<u32>> = faces.iter().map(|face| face.iter().map(|&v| glued[v as usize]).collect()).collect();
    let is_degenerate = |tile: &Vec<u32>| tile.iter().collect::<BTreeSet<_>>().len() < tile.len();
    let degenerate: Vec<u32> =
        tiles.iter().zip(face_source).filter(|(tile, _)| is_degenerate(tile)).map(|(_, &f)| f).collect();
    let mut seen = BTreeSet::new();
    let mut edges = Vec::new();
    for (tile, face) in tiles.iter().zip(faces) {
        for k in 0..tile.len() {
            let next = (k + 1) % tile.len();
            if !seen.insert([tile[k], tile[next]]) {
                edges.push([face[k], face[next]]);
            }
        }
    }
    let mut vertices = Vec::new();
    if degenerate.is_empty() && edges.is_empty() {
        // A vertex has one fan when walking round it from one of its half-edges meets all its faces.
        let topology = Topology::new(glued.len(), &tiles);
        let mut corners = vec![0usize; glued.len()];
        for &v in tiles.iter().flatten() {
            corners[v as usize] += 1;
        }
        vertices = (0..glued.len() as u32)
            .filter(|&v| corners[v as usize] > 0)
            .filter(|&v| {
                topology.around(v).filter(|&h| topology.face[h as usize] != NONE).count() != corners[v as usize]
            })
            .collect();
    }
    if degenerate.is_empty() && edges.is_empty() && vertices.is_empty() {
        return Ok(());
    }
    Err(FoldError::NoSurface { faces: degenerate, edges, vertices })
}
