//! Retopology that is symmetric about a plane: the surface is cut there, one half goes through the whole pipeline, and the
//! other half of the result is its mirror image.
//!
//! Not in Daniels et al. 2011. The cut is a border of the half, and so a feature: quads meet the plane with whole edges. What is
//! mirrored is stitched by index, never by comparing coordinates, and vertices on the plane are put exactly on it. The side that
//! the plane's normal points to decides, as Blender's Symmetrize does; attributes come from each side's own faces.

use crate::failure::{Elements, RetopologizeError};
use crate::features::Features;
use crate::half::{Half, halve};
use crate::input::Placement;
use crate::output::{BasePath, FeatureKind, Output, OutputFeature};
use crate::pipeline::kind_of;
use crate::quads::irregular;
use crate::sources::{CornerSource, INWARDS, source_at};
use crate::templates::TemplatePlace;
use mesh::{DVec3, Monitor, NONE, PolygonMesh, Topology, TriangleMesh, sorted};
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};
use surface::closest::ClosestPoint;
use surface::triangulate::Triangulated;

/// Vertices this near to the plane are on it, fraction of the bounding-box diagonal.
const ON_PLANE: f64 = 1e-6;

/// A plane of symmetry.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plane {
    /// A point of it, scene units.
    pub point: DVec3,
    /// Its normal, of any length; it points to the side that is kept.
    pub normal: DVec3,
}

/// What symmetry is asked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Symmetry {
    /// The plane.
    pub plane: Plane,
    /// How far the mirror image of the surface, and of its marks and borders, may be off, fraction of the bounding-box
    /// diagonal, 0 or more. Infinite: the kept side decides whatever the other is like. [`Symmetry::TOLERANCE`] is customary.
    pub tolerance: f64,
}

impl Symmetry {
    /// What scanned and sculpted models that are meant to be symmetric keep to.
    pub const TOLERANCE: f64 = 0.01;

    /// The plane with a normal of length 1.
    ///
    /// # Errors
    /// [`RetopologizeError::Option`]: no plane, or no tolerance.
    pub(crate) fn plane(&self) -> Result<Plane, RetopologizeError> {
        let normal = self.plane.normal.normalize_or_zero();
        if normal == DVec3::ZERO || !self.plane.point.is_finite() {
            let sentence = "the plane of symmetry needs a finite point and a finite normal that is not zero";
            return Err(RetopologizeError::Option(sentence.into()));
        }
        if self.tolerance.is_nan() || self.tolerance < 0.0 {
            let sentence = "symmetry_tolerance must be 0 or more, a fraction of the bounding-box diagonal";
            return Err(RetopologizeError::Option(sentence.into()));
        }
        Ok(Plane { point: self.plane.point, normal })
    }
}

impl Plane {
    /// Signed distance of a point, for a normal of length 1.
    pub(crate) fn distance(&self, p: DVec3) -> f64 {
        (p - self.point).dot(self.normal)
    }

    pub(crate) fn mirrored(&self, p: DVec3) -> DVec3 {
        p - self.normal * (2.0 * self.distance(p))
    }

    pub(crate) fn foot(&self, p: DVec3) -> DVec3 {
        p - self.normal * self.distance(p)
    }
}

/// A surface and the half of it that is worked on.
#[derive(Debug)]
pub(crate) struct Mirror {
    /// Scene units.
    half: Half,
    /// The half as a mesh.
    pub mesh: PolygonMesh,
    /// The whole surface as triangles, scene units.
    whole: TriangleMesh,
    /// How the unit box of the whole lies in the scene.
    placement: Placement,
    /// Diagonal of the whole beside that of the half.
    pub larger: f64,
    /// How far mirror images may be off, scene units.
    tolerance: f64,
    /// The greatest distance of a mirrored vertex to the surface, scene units.
    deviation: f64,
    /// Triangles of the far side, and closest points among them.
    far: (Vec<u32>, ClosestPoint),
}

impl Mirror {
    /// Cuts a surface. `input` are its triangles, in the unit box; `marked` its features but those that were detected.
    ///
    /// # Errors
    /// [`RetopologizeError`]: nothing on the kept side; not symmetric, with the vertices or edges that are not.
    pub fn new(
        mesh: &PolygonMesh,
        (input, placement): (&Triangulated, Placement),
        marked: &Features,
        symmetry: Symmetry,
        monitor: &Monitor,
    ) -> Result<Self, RetopologizeError> {
        let plane = symmetry.plane()?;
        let mut whole = TriangleMesh { positions: mesh.positions.clone(), triangles: input.mesh.triangles.clone() };
        for ends in &input.halves {
            let [a, b] = ends.map(|v| mesh.positions[v as usize]);
            whole.positions.push(a.midpoint(b));
        }
        let diagonal = diagonal(&whole);
        let half = halve(&whole, plane, ON_PLANE * diagonal);
        if half.mesh.triangles.is_empty() {
            let sentence =
                "has nothing on the kept side of the plane of symmetry; keep the other side, or move the plane";
            return Err(RetopologizeError::Invalid {
                code: "nothing_kept",
                sentence: sentence.into(),
                elements: Elements::from([("faces", (0..mesh.face_count() as u32).collect())]),
            });
        }
        monitor.check()?;
        let far: Vec<u32> = (0..whole.triangles.len() as u32)
            .filter(|&t| whole.points(t as usize).iter().any(|&p| plane.distance(p) < 0.0))
            .collect();
        let far_mesh = TriangleMesh {
            positions: whole.positions.clone(),
            triangles: far.iter().map(|&t| whole.triangles[t as usize]).collect(),
        };
        let polygons = PolygonMesh::from_polygons(half.mesh.positions.clone(), &half.mesh.triangles)
            .map_err(|error| RetopologizeError::bug(&format!("the half is no mesh: {error}")))?;
        let larger = diagonal / self::diagonal(&half.mesh);
        let far = (far, ClosestPoint::new(&far_mesh));
        let mut made = Self {
            half,
            mesh: polygons,
            whole,
            placement,
            larger,
            tolerance: symmetry.tolerance * diagonal,
            deviation: 0.0,
            far,
        };
        made.compare(mesh, marked, monitor)?;
        Ok(made)
    }

    /// Checks that every vertex, mark and border has its like on the other side.
    fn compare(&mut self, mesh: &PolygonMesh, marked: &Features, monitor: &Monitor) -> Result<(), RetopologizeError> {
        monitor.check()?;
        let plane = self.half.plane;
        let closest = ClosestPoint::new(&self.whole);
        let mut used = vec![false; mesh.vertex_count()];
        mesh.corner_verts().iter().for_each(|&v| used[v as usize] = true);
        let away: Vec<f64> = (0..mesh.vertex_count())
            .into_par_iter()
            .map(|v| if used[v] { closest.project(plane.mirrored(mesh.positions[v])).distance } else { 0.0 })
            .collect();
        self.deviation = away.iter().copied().fold(0.0, f64::max);
        let off: Vec<u32> = (0..away.len() as u32).filter(|&v| away[v as usize] > self.tolerance).collect();
        if !off.is_empty() {
            let part = self.deviation / diagonal(&self.whole);
            let sentence = format!(
                "is not symmetric about the plane: the mirror images of {} {} lie off the surface, by up to {part:.2} of its size; choose another plane, mend the surface, or raise the tolerance, so that the kept side decides",
                off.len(),
                if off.len() == 1 { "vertex" } else { "vertices" },
            );
            let elements = Elements::from([("verts", off)]);
            return Err(RetopologizeError::Invalid { code: "not_symmetric", sentence, elements });
        }
        self.compare_marks(marked)
    }

    /// Checks that every mark and border has its like on the other side.
    ///
    /// # Errors
    /// [`RetopologizeError::Feature`] with the edges that have none.
    pub fn compare_marks(&self, marked: &Features) -> Result<(), RetopologizeError> {
        let borders = borders(&self.whole);
        let lone: Vec<[u32; 2]> = [&marked.edges, &borders].into_iter().flat_map(|of| self.lone(of)).collect();
        if lone.is_empty() {
            return Ok(());
        }
        let sentence = format!(
            "{} marked or border {} no like on the other side of the plane of symmetry; mark both sides alike, or raise the tolerance, so that the kept side decides",
            lone.len(),
            if lone.len() == 1 { "edge has" } else { "edges have" },
        );
        let elements = Elements::from([("edges", lone.into_iter().flatten().collect())]);
        Err(RetopologizeError::Feature { code: "features_not_symmetric", sentence, elements })
    }

    /// Those of some edges whose middle has, mirrored, none of them near.
    fn lone(&self, edges: &[[u32; 2]]) -> Vec<[u32; 2]> {
        let at = |v: u32| self.whole.positions[v as usize];
        let closest = self.lines(edges);
        let image = |&[a, b]: &[u32; 2]| self.half.plane.mirrored(at(a).midpoint(at(b)));
        edges.par_iter().filter(|edge| closest.project(image(edge)).distance > self.tolerance).copied().collect()
    }

    /// Closest points on edges, which count as triangles without area.
    fn lines(&self, edges: &[[u32; 2]]) -> ClosestPoint {
        let triangles = edges.iter().map(|&[a, b]| [a, b, b]).collect();
        ClosestPoint::new(&TriangleMesh { positions: self.whole.positions.clone(), triangles })
    }

    /// The features of the kept half.
    pub fn features(&self, all: &Features) -> Features {
        self.half.features(all)
    }

    /// Values at the vertices of the whole's triangles, at those of the half.
    pub fn interpolated(&self, values: &[f64]) -> Vec<f64> {
        if values.is_empty() { vec![] } else { self.half.interpolated(values) }
    }

    /// The vertex of the whole's triangles at a vertex of the half's surface; none where there is none.
    pub fn input_vertex(&self, v: u32) -> Option<u32> {
        let [a, b] = self.half.between(v)?;
        (a == b).then_some(a)
    }

    /// The place of a template, mirrored where it lies on the far side.
    pub fn on_kept_side(&self, place: TemplatePlace) -> TemplatePlace {
        match place {
            TemplatePlace::Point(p) if self.half.plane.distance(p) < 0.0 => {
                TemplatePlace::Point(self.half.plane.mirrored(p))
            }
            kept => kept,
        }
    }

    /// Edges of the half that are features only because it was cut there; `all` are the features of the whole.
    pub fn cut(&self, all: &Features) -> BTreeSet<[u32; 2]> {
        let marked: BTreeSet<[u32; 2]> = self.half.features(all).edges.into_iter().collect();
        let was_border: BTreeSet<[u32; 2]> = borders(&self.whole).into_iter().collect();
        let own = |edge: &&[u32; 2]| self.input_edge(**edge).is_some_and(|edge| was_border.contains(&edge));
        self.half.border_in_plane.iter().filter(|edge| !marked.contains(*edge) && !own(edge)).copied().collect()
    }

    /// The edge of the whole's triangles that an edge of the half lies on.
    fn input_edge(&self, edge: [u32; 2]) -> Option<[u32; 2]> {
        let mut ends: Vec<u32> = edge.iter().filter_map(|&v| self.half.between(v)).flatten().collect();
        ends.sort_unstable();
        ends.dedup();
        <[u32; 2]>::try_from(ends).ok()
    }

    /// Vertices of the half's quads that lie on the plane.
    fn on_plane(&self, made: &Output) -> Vec<bool> {
        let in_plane = &self.half.border_in_plane;
        let mut on_plane = vec![false; made.mesh.vertex_count()];
        for edge in made.feature_edges.iter().filter(|edge| in_plane.contains(&lower_first(edge))) {
            edge.ends.iter().for_each(|&v| on_plane[v as usize] = true);
        }
        on_plane
    }

    /// How many edges off the plane have both ends on it.
    pub fn spans(&self, made: &Output) -> usize {
        let on_plane = self.on_plane(made);
        let along: BTreeSet<[u32; 2]> = made
            .feature_edges
            .iter()
            .filter(|edge| self.half.border_in_plane.contains(&lower_first(edge)))
            .map(|edge| sorted(edge.ends[0], edge.ends[1]))
            .collect();
        let topology = Topology::of(&made.mesh);
        let ends = topology.edges().map(|h| sorted(topology.from(h), topology.to(h)));
        ends.filter(|ends| ends.iter().all(|&v| on_plane[v as usize]) && !along.contains(ends)).count()
    }

    /// The whole result from that of the half. `cut` is what [`Mirror::cut`] says, `kinds` why edges of the whole are features.
    ///
    /// # Errors
    /// [`RetopologizeError::Internal`].
    pub fn doubled(
        &self,
        made: Output,
        input: &Triangulated,
        all: &Features,
        cut: &BTreeSet<[u32; 2]>,
        kinds: &BTreeMap<[u32; 2], FeatureKind>,
    ) -> Result<Output, RetopologizeError> {
        let in_plane = &self.half.border_in_plane;
        let on_plane = self.on_plane(&made);
        let (mesh, mirror) = self.mirrored(&made.mesh, &on_plane)?;
        let near: Vec<OutputFeature> =
            made.feature_edges.iter().filter(|edge| !cut.contains(&lower_first(edge))).copied().collect();
        let feature_edges = self.both_features(&near, &mesh, &mirror, &on_plane, all, kinds)?;
        let corner_source = self.both_sources(&made, &mesh, input);

        let lies_there = |path: &BasePath| path.points.iter().all(|&p| self.half.is_on(p));
        let borders: BTreeSet<[u32; 2]> = base_borders(&made.base).into_iter().collect();
        let on = |path: &BasePath| borders.contains(&sorted(path.ends[0], path.ends[1])) && lies_there(path);
        let mut base_on_plane = vec![false; made.base.vertex_count()];
        for path in made.base_paths.iter().filter(|path| on(path)) {
            path.ends.iter().for_each(|&v| base_on_plane[v as usize] = true);
        }
        let (base, image) = self.mirrored(&made.base, &base_on_plane)?;
        let plane = self.half.plane;
        let images = made.base_paths.iter().filter(|path| !on(path)).map(|path| BasePath {
            ends: path.ends.map(|v| image[v as usize]),
            points: path.points.iter().map(|&p| plane.mirrored(p)).collect(),
            chain: path.chain,
        });
        let base_paths = made.base_paths.iter().cloned().chain(images).collect();

        let mut report = made.report;
        report.faces = mesh.face_count();
        report.irregular_vertices = irregular(&Topology::of(&mesh));
        (report.base_vertices, report.base_triangles) = (base.vertex_count(), base.face_count());
        for doubled in [
            &mut report.sites_added,
            &mut report.patches,
            &mut report.patches_kept,
            &mut report.single_patches,
            &mut report.inverted,
        ] {
            *doubled *= 2;
        }
        let marked = self.half.features(all).edges.into_iter().filter(|edge| in_plane.contains(edge));
        let at = |v: u32| self.half.mesh.positions[v as usize];
        let once: f64 = marked.map(|[a, b]| at(a).distance(at(b))).sum();
        report.feature_length = 2.0 * report.feature_length - once;
        report.symmetry_deviation = Some(self.deviation);
        Ok(Output { mesh, base, base_paths, feature_edges, corner_source, mirror, report })
    }

    /// A mesh with its mirror image, stitched at vertices on the plane; and the mirror vertex of each.
    fn mirrored(&self, half: &PolygonMesh, on_plane: &[bool]) -> Result<(PolygonMesh, Vec<u32>), RetopologizeError> {
        let plane = self.half.plane;
        let place = |(&p, &on): (&DVec3, &bool)| if on { plane.foot(p) } else { p };
        let mut positions: Vec<DVec3> = half.positions.iter().zip(on_plane).map(place).collect();
        let mut mirror: Vec<u32> = (0..positions.len() as u32).collect();
        for v in (0..on_plane.len()).filter(|&v| !on_plane[v]) {
            mirror[v] = positions.len() as u32;
            positions.push(plane.mirrored(positions[v]));
            mirror.push(v as u32);
        }
        let image = |face: &[u32]| image_order(face.len()).map(|k| mirror[face[k] as usize]).collect::<Vec<u32>>();
        let faces: Vec<Vec<u32>> = half.faces().map(<[u32]>::to_vec).chain(half.faces().map(image)).collect();
        let whole = PolygonMesh::from_polygons(positions, &faces)
            .map_err(|error| RetopologizeError::bug(&format!("the mirrored mesh is no mesh: {error}")))?;
        Ok((whole, mirror))
    }

    /// The features of both sides. A chain that meets the plane alone goes on beyond it under its number.
    fn both_features(
        &self,
        near: &[OutputFeature],
        mesh: &PolygonMesh,
        mirror: &[u32],
        on_plane: &[bool],
        all: &Features,
        kinds: &BTreeMap<[u32; 2], FeatureKind>,
    ) -> Result<Vec<OutputFeature>, RetopologizeError> {
        let is_on = |v: u32| on_plane.get(v as usize).copied().unwrap_or(false);
        let lies = |edge: &OutputFeature| self.half.border_in_plane.contains(&lower_first(edge));
        let mut meeting: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
        for edge in near {
            for v in edge.ends.into_iter().filter(|&v| is_on(v)) {
                meeting.entry(v).or_default().push(edge.chain);
            }
        }
        let passing: BTreeSet<u32> =
            meeting.values().filter(|chains| chains.len() == 1).map(|chains| chains[0]).collect();
        let chains = near.iter().map(|edge| edge.chain + 1).max().unwrap_or(0);
        let mut both: Vec<OutputFeature> = Vec::with_capacity(2 * near.len());
        for edge in near {
            let at = self.input_edge(edge.input_edge);
            let input_edge = at.ok_or_else(|| RetopologizeError::bug("a feature of the half lies on no edge"))?;
            both.push(OutputFeature { input_edge, kind: kind_of(kinds, input_edge), ..*edge });
        }
        let lines: Vec<[u32; 2]> = all.edges.iter().map(|&[a, b]| sorted(a, b)).chain(borders(&self.whole)).collect();
        let closest = self.lines(&lines);
        for k in (0..near.len()).filter(|&k| !lies(&near[k])) {
            let ends = near[k].ends.map(|v| mirror[v as usize]);
            let [a, b] = ends.map(|v| mesh.positions[v as usize]);
            let found = closest.project(a.midpoint(b)).triangle;
            let input_edge = if found == NONE { both[k].input_edge } else { lines[found as usize] };
            let chain = if passing.contains(&near[k].chain) { near[k].chain } else { chains + near[k].chain };
            both.push(OutputFeature { ends, chain, kind: kind_of(kinds, input_edge), input_edge });
        }
        Ok(both)
    }

    /// Sources of the corners of both sides, each from its own.
    fn both_sources(&self, made: &Output, mesh: &PolygonMesh, input: &Triangulated) -> Vec<CornerSource> {
        let (near, far) = (made.corner_source.len(), &self.far);
        let own = |source: &CornerSource| {
            let corners =
                source.corners.map(|c| self.half.mesh.positions[self.mesh.corner_verts()[c as usize] as usize]);
            let point =
                corners[0] * source.weights[0] + corners[1] * source.weights[1] + corners[2] * source.weights[2];
            source_at(input, self.half.source[source.face as usize], self.placement.to_working(point))
        };
        let mut both: Vec<CornerSource> = made.corner_source.par_iter().map(own).collect();
        let images: Vec<CornerSource> = (near..mesh.corner_verts().len())
            .into_par_iter()
            .map(|corner| {
                let (face, k) = (corner / 4, corner % 4);
                let at = mesh.positions[mesh.corner_verts()[corner] as usize];
                let middle = mesh.face_points(face).sum::<DVec3>() / 4.0;
                let found = far.1.project(at.lerp(middle, INWARDS));
                if found.triangle == NONE {
                    let like = image_order(4).nth(k).unwrap_or(0);
                    return both[corner - near - k + like];
                }
                source_at(input, far.0[found.triangle as usize], self.placement.to_working(at))
            })
            .collect();
        both.extend(images);
        both
    }
}

fn lower_first(edge: &OutputFeature) -> [u32; 2] {
    sorted(edge.input_edge[0], edge.input_edge[1])
}

/// The corners of a mirrored face, as those of the face: the first stays the first.
fn image_order(corners: usize) -> impl Iterator<Item = usize> {
    (0..corners).map(move |k| (corners - k) % corners)
}

/// Border edges, lower vertex first.
fn borders(mesh: &TriangleMesh) -> Vec<[u32; 2]> {
    border_edges(&Topology::of_triangles(mesh))
}

fn base_borders(base: &PolygonMesh) -> Vec<[u32; 2]> {
    border_edges(&Topology::of(base))
}

fn border_edges(topology: &Topology) -> Vec<[u32; 2]> {
    let borders = (0..topology.len() as u32).filter(|&h| topology.is_border(h));
    borders.map(|h| sorted(topology.from(h), topology.to(h))).collect()
}

fn diagonal(mesh: &TriangleMesh) -> f64 {
    mesh::Aabb::of(mesh.triangles.iter().flatten().map(|&v| mesh.positions[v as usize])).diagonal()
}

#[cfg(test)]
#[path = "symmetry_tests.rs"]
mod tests;
