#!/usr/bin/env python3
"""Judge a polygon mesh: validity, quad quality, and fidelity to what it was made from.

    meshcheck.py RESULT.obj
    meshcheck.py RESULT.obj --boolean A.obj B.obj --operation union
    meshcheck.py RESULT.obj --surface INPUT.obj [--features EDGES.txt]

Prints one JSON object. Exit status: 0 measured, 2 unreadable input.
Needs: pip install numpy scipy libigl

Lengths are given as fractions of the bounding-box diagonal of the reference
(or of RESULT when there is none); angles in degrees.

* Self-intersections are found exactly (libigl/CGAL) after splitting each
  polygon along its shorter diagonal (fans for n > 4).
* --boolean compares with the exact boolean of the split inputs
  (Zhou et al. 2016, libigl/CGAL), the reference QuadMixer itself uses.
  `preserved_quads` counts input faces found in RESULT with the very same
  coordinates; `preservable_quads` counts input faces that the exact boolean
  leaves uncut; `new_*` judges the faces that are no input's.
* --features EDGES.txt: vertex pairs of INPUT, one "i j" a line, 0-based: the
  marked edges that RESULT's edges must reproduce.
* `patches` is the size of the base complex of a pure-quad mesh.
"""

import argparse
import json
import sys

import igl
import igl.copyleft.cgal as cgal
import numpy as np
from scipy.spatial import cKDTree


def read_obj(path):
    """Vertices (n,3) float64 and faces as lists of 0-based indices."""
    vertices, faces = [], []
    with open(path) as lines:
        for line in lines:
            word, _, rest = line.partition(" ")
            if word == "v":
                vertices.append([float(x) for x in rest.split()[:3]])
            elif word == "f":
                corner = [int(c.split("/")[0]) for c in rest.split()]
                faces.append([c - 1 if c > 0 else len(vertices) + c for c in corner])
    if not vertices or not faces:
        raise ValueError(f"{path}: no vertices or no faces")
    return np.array(vertices, float), faces


def triangulate(vertices, faces):
    """Triangles (m,3) and, for each, the polygon it came from. Quads split along the shorter diagonal."""
    triangles, origin = [], []
    for index, f in enumerate(faces):
        if len(f) == 4:
            d02 = np.linalg.norm(vertices[f[0]] - vertices[f[2]])
            d13 = np.linalg.norm(vertices[f[1]] - vertices[f[3]])
            parts = [(0, 1, 2), (0, 2, 3)] if d02 <= d13 else [(0, 1, 3), (1, 2, 3)]
        else:
            parts = [(0, k, k + 1) for k in range(1, len(f) - 1)]
        for a, b, c in parts:
            triangles.append((f[a], f[b], f[c]))
            origin.append(index)
    return np.array(triangles, np.int64).reshape(-1, 3), np.array(origin, np.int64)


def find_root(parent, x):
    """The representative of x's set; `parent` maps each element to another of its set, a root to itself."""
    while parent[x] != x:
        parent[x] = parent[parent[x]]
        x = parent[x]
    return x


def topology(vertices, faces):
    half_edges = {}
    degenerate = 0
    for index, f in enumerate(faces):
        if len(set(f)) != len(f):
            degenerate += 1
        for a, b in zip(f, f[1:] + f[:1], strict=True):
            half_edges.setdefault((a, b), []).append(index)
    edges = {}
    for (a, b), owners in half_edges.items():
        edges.setdefault((min(a, b), max(a, b)), [0, 0])[0 if a < b else 1] += len(owners)
    boundary = sum(1 for n in edges.values() if sum(n) == 1)
    nonmanifold = sum(1 for n in edges.values() if sum(n) > 2)
    flipped = sum(1 for n in edges.values() if sum(n) == 2 and n[0] != 1)
    used = sorted({v for f in faces for v in f})

    # A vertex is manifold when the faces round it form one fan.
    around = {}
    for f in faces:
        for k, v in enumerate(f):
            around.setdefault(v, []).append((f[k - 1], f[(k + 1) % len(f)]))
    nonmanifold_vertices = 0
    for pairs in around.values():
        parent = {x: x for pair in pairs for x in pair}
        for a, b in pairs:
            parent[find_root(parent, a)] = find_root(parent, b)
        if len({find_root(parent, x) for x in parent}) > 1:
            nonmanifold_vertices += 1

    parent = list(range(len(vertices)))
    for f in faces:
        for v in f[1:]:
            parent[find_root(parent, v)] = find_root(parent, f[0])
    components = len({find_root(parent, v) for v in used})

    valence = {}
    on_boundary = set()
    for (a, b), n in edges.items():
        valence[a] = valence.get(a, 0) + 1
        valence[b] = valence.get(b, 0) + 1
        if sum(n) == 1:
            on_boundary.update((a, b))
    irregular = sum(1 for v in used if v not in on_boundary and valence[v] != 4)
    euler = len(used) - len(edges) + len(faces)
    sizes = [len(f) for f in faces]
    return {
        "vertices": len(used),
        "faces": len(faces),
        "triangles": sizes.count(3),
        "quads": sizes.count(4),
        "ngons": sum(1 for n in sizes if n > 4),
        "components": components,
        "euler": euler,
        "boundary_edges": boundary,
        "nonmanifold_edges": nonmanifold,
        "nonmanifold_vertices": nonmanifold_vertices,
        "flipped_edges": flipped,
        "degenerate_faces": degenerate,
        "closed_manifold": boundary == nonmanifold == nonmanifold_vertices == flipped == degenerate == 0,
        "pure_quad": sizes.count(4) == len(sizes),
        "irregular_vertices": irregular,
    }


def unit(x):
    n = np.linalg.norm(x, axis=-1, keepdims=True)
    return x / np.where(n > 0, n, 1)


def quad_quality(vertices, faces):
    quads = np.array([f for f in faces if len(f) == 4], np.int64)
    if not len(quads):
        return {}
    p = vertices[quads]
    forward = unit(np.roll(p, -1, axis=1) - p)
    backward = unit(np.roll(p, 1, axis=1) - p)
    normal = unit(np.cross(p[:, 2] - p[:, 0], p[:, 3] - p[:, 1]))
    jacobian = np.einsum("qci,qi->qc", np.cross(forward, backward), normal)
    scaled = jacobian.min(axis=1)
    angle = np.degrees(np.arccos(np.clip(np.einsum("qci,qci->qc", forward, backward), -1, 1)))
    centre = p.mean(axis=1, keepdims=True)
    off_plane = np.abs(np.einsum("qci,qi->qc", p - centre, normal)).max(axis=1)
    diagonals = np.linalg.norm(p[:, 2] - p[:, 0], axis=1) + np.linalg.norm(p[:, 3] - p[:, 1], axis=1)
    planarity = off_plane / np.maximum(diagonals / 2, 1e-300)
    return {
        "scaled_jacobian_min": float(scaled.min()),
        "scaled_jacobian_p01": float(np.percentile(scaled, 1)),
        "scaled_jacobian_mean": float(scaled.mean()),
        "inverted_quads": int((scaled <= 0).sum()),
        "angle_deviation_mean": float(np.abs(angle - 90).mean()),
        "planarity_max": float(planarity.max()),
        "planarity_mean": float(planarity.mean()),
    }


def self_intersections(vertices, triangles):
    found = cgal.remesh_self_intersections(vertices, triangles, detect_only=True, first_only=False)
    pairs = np.asarray(found[2]).reshape(-1, 2)
    return len(pairs)


def sample(vertices, triangles, count, rng):
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    if area.sum() == 0:
        return a
    pick = rng.choice(len(triangles), count, p=area / area.sum())
    u, v = rng.random((2, count))
    flip = u + v > 1
    u, v = np.where(flip, 1 - u, u), np.where(flip, 1 - v, v)
    return a[pick] + u[:, None] * (b - a)[pick] + v[:, None] * (c - a)[pick]


def distances(points, vertices, triangles):
    squared, _, _ = igl.point_mesh_squared_distance(points, vertices, triangles)
    return np.sqrt(np.maximum(squared, 0))


def volume(vertices, triangles):
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6)


def two_way(vertices, triangles, ref_vertices, ref_triangles, diagonal, rng, count=20000):
    to_ref = distances(sample(vertices, triangles, count, rng), ref_vertices, ref_triangles) / diagonal
    from_ref = distances(sample(ref_vertices, ref_triangles, count, rng), vertices, triangles) / diagonal
    return {
        "distance_max": float(max(to_ref.max(), from_ref.max())),
        "distance_mean": float((to_ref.mean() + from_ref.mean()) / 2),
    }


def intersection_curve(vertices, triangles, of_a):
    """Points along the edges between a triangle of A and one of B, closer together than a tenth of the mean such edge, and
    that mean. Empty when the surfaces do not meet."""
    ends = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    side = np.tile(of_a, 3)
    edges, index = np.unique(np.sort(ends, axis=1), axis=0, return_inverse=True)
    from_a = np.bincount(index.ravel(), weights=side, minlength=len(edges))
    total = np.bincount(index.ravel(), minlength=len(edges))
    curve = edges[(from_a > 0) & (from_a < total)]
    if not len(curve):
        return np.empty((0, 3)), 0.0
    p, q = vertices[curve[:, 0]], vertices[curve[:, 1]]
    length = np.linalg.norm(q - p, axis=1)
    count = np.ceil(10 * length / length.mean()).astype(int) + 1
    owner = np.repeat(np.arange(len(curve)), count)
    along = np.concatenate([np.linspace(0, 1, n) for n in count])
    return p[owner] + along[:, None] * (q - p)[owner], float(length.mean())


def exact_boolean(a, b, operation):
    """Vertices and triangles of the boolean of the split inputs, and the input triangle each lies on (B's after A's)."""
    name = {"union": "union", "intersection": "intersect", "difference": "minus"}[operation]
    (va, fa), (vb, fb) = a, b
    made = cgal.mesh_boolean(va, triangulate(va, fa)[0], vb, triangulate(vb, fb)[0], name)
    vertices, triangles, birth = (np.asarray(x) for x in made[:3])
    return vertices, triangles.reshape(-1, 3).astype(np.int64), birth.reshape(-1).astype(np.int64)


def check_boolean(result, a, b, operation, rng, retraction=1.0, curve_edge=None):
    """Compares with the exact boolean. A face lies beyond the retraction when no vertex of it is nearer to the exact
    intersection curve than `retraction` times the larger of its own mean edge and `curve_edge` (by default the exact
    curve's)."""
    (va, fa), (vb, fb) = a, b
    ta, oa = triangulate(va, fa)
    tb, ob = triangulate(vb, fb)
    rv, rt, birth = exact_boolean(a, b, operation)
    if not len(rt):
        raise ValueError("the exact boolean is empty")
    curve, exact_edge = intersection_curve(rv, rt, birth < len(ta))
    tree = cKDTree(curve) if len(curve) else None
    curve_edge = exact_edge if curve_edge is None else curve_edge

    # An input face is preservable when every triangle of it comes out exactly once, uncut.
    out = {}
    for t, j in zip(rt, birth, strict=True):
        out.setdefault(int(j), []).append(t)
    preservable, beyond = [], []
    for vertices, faces, triangles, origin, offset in ((va, fa, ta, oa, 0), (vb, fb, tb, ob, len(ta))):
        intact = np.zeros(len(triangles), bool)
        for k, t in enumerate(triangles):
            got = out.get(offset + k, [])
            intact[k] = len(got) == 1 and {tuple(rv[i]) for i in got[0]} == {tuple(vertices[i]) for i in t}
        count = np.bincount(origin, minlength=len(faces))
        kept = np.bincount(origin[intact], minlength=len(faces))
        away = tree.query(vertices)[0] if tree else np.full(len(vertices), np.inf)
        for index in np.nonzero((count == kept) & (count > 0))[0]:
            points = vertices[faces[index]]
            edge = np.linalg.norm(np.roll(points, -1, axis=0) - points, axis=1).mean()
            preservable.append(face_key(points))
            if away[faces[index]].min() > retraction * max(edge, curve_edge):
                beyond.append(preservable[-1])

    vertices, faces = result
    have = {face_key(vertices[f]) for f in faces}
    preserved = sum(key in have for key in preservable)

    inputs_have = {face_key(va[f]) for f in fa} | {face_key(vb[f]) for f in fb}
    new = [f for f in faces if face_key(vertices[f]) not in inputs_have]
    quality = {f"new_{name}": value for name, value in quad_quality(vertices, new).items()}

    t, _ = triangulate(vertices, faces)
    diagonal = float(np.linalg.norm(rv.max(axis=0) - rv.min(axis=0)))
    exact = volume(rv, rt)
    used = len(np.unique(rt))
    edges = len(np.unique(np.sort(np.vstack([rt[:, [0, 1]], rt[:, [1, 2]], rt[:, [2, 0]]]), axis=1), axis=0))
    return {
        "reference_euler": int(used - edges + len(rt)),
        "reference_components": int(igl.facet_components(rt)[0]),
        "volume": volume(vertices, t),
        "reference_volume": exact,
        "volume_error": abs(volume(vertices, t) - exact) / max(abs(exact), 1e-300),
        "preservable_quads": len(preservable),
        "preserved_quads": preserved,
        "preserved_ratio": preserved / len(preservable) if preservable else None,
        "beyond_quads": len(beyond),
        "beyond_preserved_quads": sum(key in have for key in beyond),
        "new_faces": len(new),
        **quality,
        **two_way(vertices, t, rv, rt, diagonal, rng),
    }


def face_key(points):
    """The same face whichever corner it starts at and, for a difference, whichever way it turns."""
    return frozenset(tuple(p) for p in points)


def base_complex_patches(faces, edges_of, irregular):
    """Patches left when every separatrix is traced to its end: a small number means a coarse, editable layout."""
    at = {}
    for e in edges_of:
        at.setdefault(e[0], []).append(e)
        at.setdefault(e[1], []).append(e)
    cut = set()
    for v in irregular:
        for first in at[v]:
            edge, vertex = first, v
            while edge not in cut:
                cut.add(edge)
                vertex = edge[0] if edge[1] == vertex else edge[1]
                if vertex in irregular or len(at[vertex]) != 4:
                    break
                ahead = [e for e in at[vertex] if not edges_of[e] & edges_of[edge]]
                if len(ahead) != 1:
                    break
                edge = ahead[0]
    parent = list(range(len(faces)))
    for e, owners in edges_of.items():
        if e not in cut and len(owners) == 2:
            x, y = owners
            parent[find_root(parent, x)] = find_root(parent, y)
    return len({find_root(parent, k) for k in range(len(faces))})


def layout(faces):
    edges_of = {}
    for index, f in enumerate(faces):
        for a, b in zip(f, f[1:] + f[:1], strict=True):
            edges_of.setdefault((min(a, b), max(a, b)), set()).add(index)
    valence, border = {}, set()
    for (a, b), owners in edges_of.items():
        valence[a] = valence.get(a, 0) + 1
        valence[b] = valence.get(b, 0) + 1
        if len(owners) == 1:
            border.update((a, b))
    irregular = {v for v, n in valence.items() if (v not in border and n != 4) or (v in border and n > 4)}
    return base_complex_patches(faces, edges_of, irregular)


def read_edges(path):
    """Vertex pairs, one "i j" a line, 0-based; a first line with a single number (the count) is skipped."""
    with open(path) as lines:
        rows = [line.split() for line in lines]
    return np.array([[int(r[0]), int(r[1])] for r in rows if len(r) >= 2], np.int64).reshape(-1, 2)


def check_features(vertices, faces, ref_vertices, pairs, diagonal):
    """Share of the feature length that RESULT's edges reproduce: within 1% and 5% of the mean edge, parallel to 10 degrees."""
    edges = np.array(sorted({(min(a, b), max(a, b)) for f in faces for a, b in zip(f, f[1:] + f[:1], strict=True)}))
    p, q = vertices[edges[:, 0]], vertices[edges[:, 1]]
    length = np.linalg.norm(q - p, axis=1)
    mean = length.mean()
    axis = unit(q - p)
    steps = np.maximum(2, np.ceil(length / (0.15 * mean)).astype(int)) + 1
    owner = np.repeat(np.arange(len(edges)), steps)
    along = np.concatenate([np.linspace(0, 1, n) for n in steps])
    tree = cKDTree(p[owner] + along[:, None] * (q - p)[owner])

    a, b = ref_vertices[pairs[:, 0]], ref_vertices[pairs[:, 1]]
    size = np.linalg.norm(b - a, axis=1)
    count = np.maximum(2, np.ceil(size / (0.2 * mean)).astype(int))
    segment = np.repeat(np.arange(len(pairs)), count)
    t = np.concatenate([(np.arange(n) + 0.5) / n for n in count])
    points = a[segment] + t[:, None] * (b - a)[segment]
    tangent = unit(b - a)[segment]
    weight = (size / count)[segment]
    best = np.full(len(points), np.inf)
    _, near = tree.query(points, k=min(24, len(owner)))
    for column in np.asarray(near).reshape(len(points), -1).T:
        e = owner[column]
        s = np.clip(np.einsum("ij,ij->i", points - p[e], axis[e]), 0, length[e])
        away = np.linalg.norm(p[e] + s[:, None] * axis[e] - points, axis=1)
        parallel = np.abs(np.einsum("ij,ij->i", axis[e], tangent)) >= np.cos(np.radians(10))
        best = np.where(parallel & (away < best), away, best)
    total = weight.sum()
    return {
        "feature_length": float(total / diagonal),
        "feature_reproduced_1": float(weight[best <= 0.01 * mean].sum() / total),
        "feature_reproduced_5": float(weight[best <= 0.05 * mean].sum() / total),
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("result")
    parser.add_argument("--boolean", nargs=2, metavar=("A", "B"))
    parser.add_argument("--operation", choices=["union", "intersection", "difference"], default="union")
    parser.add_argument("--surface", metavar="INPUT")
    parser.add_argument("--features", metavar="EDGES", help="needs --surface")
    parser.add_argument("--seed", type=int, default=1)
    args = parser.parse_args()
    rng = np.random.default_rng(args.seed)
    try:
        vertices, faces = read_obj(args.result)
        report = {**topology(vertices, faces), **quad_quality(vertices, faces)}
        if report["pure_quad"]:
            report["patches"] = layout(faces)
        triangles, _ = triangulate(vertices, faces)
        report["self_intersections"] = self_intersections(vertices, triangles)
        diagonal = float(np.linalg.norm(vertices.max(axis=0) - vertices.min(axis=0)))
        if args.boolean:
            a, b = (read_obj(p) for p in args.boolean)
            report.update(check_boolean((vertices, faces), a, b, args.operation, rng))
        if args.surface:
            ref_vertices, ref_faces = read_obj(args.surface)
            ref_triangles, _ = triangulate(ref_vertices, ref_faces)
            diagonal = float(np.linalg.norm(ref_vertices.max(axis=0) - ref_vertices.min(axis=0)))
            report.update(two_way(vertices, triangles, ref_vertices, ref_triangles, diagonal, rng))
            report["reference_euler"] = topology(ref_vertices, ref_faces)["euler"]
            if args.features:
                pairs = read_edges(args.features)
                report.update(check_features(vertices, faces, ref_vertices, pairs, diagonal))
    except (OSError, ValueError, IndexError, KeyError) as error:
        print(f"meshcheck: {error}", file=sys.stderr)
        return 2
    print(json.dumps(report, indent=1))
    return 0


if __name__ == "__main__":
    sys.exit(main())
