//! Split and intersect (section 3.1, Fig. 6 b): both quad meshes become triangles along the shorter diagonal, the exact
//! boolean runs on the triangles, and every triangle of the result names the input triangle it lies on.
//!
//! Deviation: the boolean is manifold-rust instead of Zhou et al. 2016 as built into libigl. It carries provenance, so
//! vertices are identified through their source triangle and never by searching for equal coordinates.

use crate::{BooleanError, Operation};
use manifold_rust::cancel::CancelToken;
use manifold_rust::manifold::Manifold;
use manifold_rust::types::{BooleanEngine, Error, MeshGLP, OpType};
use mesh::{Cancelled, Monitor, NONE, PolygonMesh, Topology, TriangleMesh};

/// One input, triangulated.
#[derive(Debug)]
pub struct Input<'a> {
    /// The quads.
    pub quads: &'a PolygonMesh,
    /// Their half-edges.
    pub topology: Topology,
    /// Their triangles.
    pub triangles: TriangleMesh,
    /// Quad of each triangle.
    pub quad_of: Vec<u32>,
    /// Mean edge length round each quad, scene units.
    pub edge_length: Vec<f64>,
}

impl<'a> Input<'a> {
    /// Splits every quad along its shorter diagonal.
    pub fn new(quads: &'a PolygonMesh) -> Self {
        let (triangles, quad_of) = TriangleMesh::from_polygons(quads);
        let edge_length = (0..quads.face_count())
            .map(|f| {
                let p: Vec<_> = quads.face_points(f).collect();
                (0..p.len()).map(|k| p[k].distance(p[(k + 1) % p.len()])).sum::<f64>() / p.len() as f64
            })
            .collect();
        Self { quads, topology: Topology::of(quads), triangles, quad_of, edge_length }
    }
}

/// Where a triangle of the cut surface lies: input mesh and input triangle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Source {
    /// 0 for A, 1 for B.
    pub mesh: u8,
    /// Triangle of that input.
    pub triangle: u32,
}

/// The exact boolean of the triangulated inputs.
#[derive(Debug)]
pub struct Cut {
    /// Closed surface of the result.
    pub surface: TriangleMesh,
    /// Its half-edges: half-edge `3 t + k` starts at corner `k` of triangle `t`.
    pub topology: Topology,
    /// Source of each triangle.
    pub source: Vec<Source>,
    /// Input mesh and vertex that each vertex is, where it survived in place.
    pub input_vertex: Vec<Option<(u8, u32)>>,
    /// For each input and quad, the result triangles that are its two uncut halves; `None` when cut or gone.
    pub whole: [Vec<Option<[u32; 2]>>; 2],
}

impl Cut {
    /// True when the edge of half-edge `h` separates A from B: part of an intersection curve.
    pub fn on_curve(&self, h: u32) -> bool {
        let t = self.topology.twin[h as usize];
        t != NONE && self.source[(h / 3) as usize].mesh != self.source[(t / 3) as usize].mesh
    }
}

fn export(input: &TriangleMesh, id: u32) -> MeshGLP<f64, u32> {
    MeshGLP {
        num_prop: 3,
        vert_properties: input.positions.iter().flat_map(glam::DVec3::to_array).collect(),
        tri_verts: input.triangles.as_flattened().to_vec(),
        run_index: vec![0, 3 * input.triangles.len() as u32],
        run_original_id: vec![id],
        // One identifier a triangle: the boolean then never merges two input triangles, even coplanar ones.
        face_id: (0..input.triangles.len() as u32).collect(),
        ..Default::default()
    }
}

/// The boolean of two triangle meshes by manifold-rust, or what it has against them.
fn solid_boolean(
    meshes: &[MeshGLP<f64, u32>; 2],
    kind: OpType,
    token: &CancelToken,
) -> Result<MeshGLP<f64, u32>, Error> {
    let sound = |solid: Manifold| match solid.status() {
        Error::NoError => Ok(solid),
        error => Err(error),
    };
    // Its check of an import is lost in later operations.
    let a = sound(Manifold::from_mesh_glp(&meshes[0]))?;
    let b = sound(Manifold::from_mesh_glp(&meshes[1]))?;
    // The check has refused inputs that intersect themselves, the only ones that need the robust engine.
    let result = sound(a.boolean_with_engine_and_token(&b, kind, BooleanEngine::Exact, Some(token)))?;
    Ok(result.get_mesh_glp(-1))
}

/// Runs the exact boolean. Costs O(n log n) in the triangles near the cut plus a scan of both inputs.
///
/// # Errors
/// [`BooleanError::Empty`] when nothing is left, [`BooleanError::Intersect`] when the boolean fails,
/// [`BooleanError::Cancelled`].
pub fn intersect(inputs: &[Input<'_>; 2], operation: Operation, monitor: &Monitor) -> Result<Cut, BooleanError> {
    let id = Manifold::reserve_ids(2);
    let meshes = [export(&inputs[0].triangles, id), export(&inputs[1].triangles, id + 1)];
    let kind = match operation {
        Operation::Union => OpType::Add,
        Operation::Intersection => OpType::Intersect,
        Operation::Difference => OpType::Subtract,
    };
    // Import and export cannot be interrupted, and the boolean looks at its token between long steps only: a cancelled
    // job is left behind and ends at the next such look.
    let token = CancelToken::new();
    let own_token = token.clone();
    let cancelled = || {
        let cancelled = monitor.is_cancelled();
        if cancelled {
            token.cancel();
        }
        cancelled
    };
    let done = solve::worker::run("manifold", &cancelled, move || solid_boolean(&meshes, kind, &own_token));
    monitor.check()?;
    let out = match done {
        Ok(Ok(out)) => out,
        Ok(Err(error)) => return Err(BooleanError::Intersect(format!("{error:?}"))),
        Err(error) => return Err(BooleanError::Intersect(error.to_string())),
    };
    if out.num_tri() == 0 {
        return Err(BooleanError::Empty(match operation {
            Operation::Union => "the union is empty: both objects enclose no volume",
            Operation::Intersection => "the objects do not overlap, so their intersection is empty; move them closer",
            Operation::Difference => "A lies wholly inside B, so nothing of it is left; move B or swap the two",
        }));
    }
    Ok(read(&out, inputs, id, monitor)?)
}

fn read(out: &MeshGLP<f64, u32>, inputs: &[Input<'_>; 2], first_id: u32, monitor: &Monitor) -> Result<Cut, Cancelled> {
    let mut source = Vec::with_capacity(out.num_tri());
    for (run, &id) in out.run_original_id.iter().enumerate() {
        let mesh = u8::from(id != first_id);
        for t in out.run_index[run] / 3..out.run_index[run + 1] / 3 {
            source.push(Source { mesh, triangle: out.face_id[t as usize] });
        }
    }
    let num_prop = out.num_prop as usize;
    let mut positions: Vec<glam::DVec3> =
        out.vert_properties.chunks_exact(num_prop).map(|p| glam::DVec3::new(p[0], p[1], p[2])).collect();
    // Export may repeat a vertex for each run; the merge lists say which are one.
    let mut weld: Vec<u32> = (0..positions.len() as u32).collect();
    for (&from, &to) in out.merge_from_vert.iter().zip(&out.merge_to_vert) {
        weld[from as usize] = to;
    }
    let root = |mut v: u32| {
        while weld[v as usize] != v {
            v = weld[v as usize];
        }
        v
    };
    let triangles: Vec<[u32; 3]> =
        out.tri_verts.chunks_exact(3).map(|t| [root(t[0]), root(t[1]), root(t[2])]).collect();
    let triangles = compact(&mut positions, triangles);

    monitor.check()?;
    // A source that appears once, on its own three corners, is an uncut triangle.
    let mut count = [0, 1].map(|m: usize| vec![0_u32; inputs[m].triangles.triangles.len()]);
    for s in &source {
        count[s.mesh as usize][s.triangle as usize] += 1;
    }
    let mut input_vertex = vec![None; positions.len()];
    let mut whole: [Vec<Option<[u32; 2]>>; 2] = std::array::from_fn(|m| vec![None; inputs[m].quads.face_count()]);
    let mut half: [Vec<u32>; 2] = std::array::from_fn(|m| vec![NONE; inputs[m].quads.face_count()]);
    for (t, (corners, s)) in triangles.iter().zip(&source).enumerate() {
        let input = &inputs[s.mesh as usize];
        let original = input.triangles.triangles[s.triangle as usize];
        let mut matched = 0;
        for &v in corners {
            // Corners of the source triangle are found among its own three, never by searching the mesh.
            if let Some(&o) = original.iter().find(|&&o| input.triangles.positions[o as usize] == positions[v as usize])
            {
                input_vertex[v as usize] = Some((s.mesh, o));
                matched += 1;
            }
        }
        if matched == 3 && count[s.mesh as usize][s.triangle as usize] == 1 {
            let quad = input.quad_of[s.triangle as usize] as usize;
            let first = &mut half[s.mesh as usize][quad];
            if *first == NONE {
                *first = t as u32;
            } else {
                whole[s.mesh as usize][quad] = Some([*first, t as u32]);
            }
        }
    }
    monitor.check()?;
    let topology = Topology::new(positions.len(), &triangles);
    Ok(Cut { surface: TriangleMesh { positions, triangles }, topology, source, input_vertex, whole })
}

/// Drops unused vertices, keeping order.
fn compact(positions: &mut Vec<glam::DVec3>, mut triangles: Vec<[u32; 3]>) -> Vec<[u32; 3]> {
    let mut used = vec![NONE; positions.len()];
    for &v in triangles.as_flattened() {
        used[v as usize] = 0;
    }
    let mut kept = 0;
    for (old, slot) in used.iter_mut().enumerate() {
        if *slot == 0 {
            *slot = kept;
            positions[kept as usize] = positions[old];
            kept += 1;
        }
    }
    positions.truncate(kept as usize);
    for v in triangles.as_flattened_mut() {
        *v = used[*v as usize];
    }
    triangles
}
