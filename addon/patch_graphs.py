"""Patch graphs as meshes of nodes and edges, and back: how a partition of a surface is shown, edited and used again. Runs on a
job's thread: touches no bpy."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from .attributes import Array, Attribute, Snapshot

DEFECT, NODE = "angle_defect", "patch_node"
# On the first and the last edge of a side: the c-indices of the patches on its left where it begins and on its right where it
# ends, in the direction of the edges.
BEGIN, END = "c_index_begin", "c_index_end"


@dataclass(frozen=True)
class Drawn:
    """A mesh of edges as a patch graph."""

    nodes: Array
    """(N,) its vertices that are nodes: where other than two edges meet, those marked as nodes, and one of a loop without."""
    sides: list[Array]
    """Vertices along each side, from node to node."""
    c_indices: Array
    """(S,2) as `quadloom.PatchGraph.side_c_indices`."""
    side_of_edge: Array
    """(E,) the side that each edge belongs to."""
    positions: Array
    """(V,3) of all vertices."""

    def arrays(self) -> dict[str, Array]:
        """What `quadloom.PatchGraph` is made of."""
        index = np.full(len(self.positions), -1)
        index[self.nodes] = np.arange(len(self.nodes))
        sizes = [len(side) for side in self.sides]
        along = np.concatenate(self.sides) if self.sides else np.empty(0, int)
        return {
            "nodes": self.positions[self.nodes],
            "side_nodes": np.array([[index[side[0]], index[side[-1]]] for side in self.sides], np.int32).reshape(-1, 2),
            "side_offsets": np.concatenate([[0], np.cumsum(sizes)]).astype(np.int32),
            "side_points": self.positions[along],
            "side_c_indices": self.c_indices,
        }

    def elements(self, graph: dict[str, Array], edges: Array) -> dict[str, Array]:
        """Vertices and edges of the mesh for "nodes" and "sides" of the graph."""
        found = {"verts": self.nodes[graph["nodes"]] if len(graph.get("nodes", [])) else np.empty(0, int)}
        found["edges"] = edges[np.isin(self.side_of_edge, graph.get("sides", []))]
        if len(found["edges"]):
            del found["verts"]
        return found


def to_text(graph: dict[str, Array] | None) -> dict[str, Any] | None:
    """The arrays of a graph as lists, for JSON."""
    return graph and {name: values.tolist() for name, values in graph.items()}


def from_text(stored: dict[str, Any] | None) -> dict[str, Array] | None:
    """The inverse of `to_text`."""
    if stored is None:
        return None
    rows = {"nodes": (-1, 3), "side_points": (-1, 3), "side_nodes": (-1, 2), "side_c_indices": (-1, 2), "side_offsets": (-1,)}
    kinds = {name: float if name in {"nodes", "side_points"} else np.int32 for name in rows}
    return {name: np.array(stored[name], kinds[name]).reshape(shape) for name, shape in rows.items()}


def snapshot(graph: Any) -> Snapshot:
    """The sides of a `quadloom.PatchGraph` as chains of edges, one side after another; each node knows its curvature."""
    offsets, ends = graph.side_offsets, graph.side_nodes
    node_count, sizes = len(graph.nodes), np.diff(graph.side_offsets)
    # Nodes come first; of each side only the points between its ends are vertices of their own.
    is_end = np.zeros(len(graph.side_points), bool)
    is_end[offsets[:-1]] = is_end[offsets[1:] - 1] = True
    index = np.empty(len(is_end), np.int32)
    index[~is_end] = node_count + np.arange(np.count_nonzero(~is_end))
    index[offsets[:-1]], index[offsets[1:] - 1] = ends[:, 0], ends[:, 1]
    begins = np.ones(len(index), bool)
    begins[np.cumsum(sizes) - 1] = False
    begins = np.flatnonzero(begins)
    positions = np.concatenate([graph.nodes, graph.side_points[~is_end]])
    defects = np.zeros(len(positions), np.int32)
    defects[:node_count] = graph.defects
    first = np.cumsum(sizes - 1) - (sizes - 1)
    c_indices = np.zeros((len(begins), 2), np.int32)
    c_indices[first, 0] = graph.side_c_indices[:, 0]
    c_indices[first + sizes - 2, 1] = graph.side_c_indices[:, 1]
    return Snapshot(
        positions=positions,
        edges=np.stack([index[begins], index[begins + 1]], axis=1).astype(np.int32),
        face_offsets=np.zeros(1, np.int32),
        corner_verts=np.zeros(0, np.int32),
        attributes={
            DEFECT: Attribute("POINT", "INT", defects[:, None]),
            NODE: Attribute("POINT", "BOOLEAN", (np.arange(len(positions)) < node_count)[:, None]),
            BEGIN: Attribute("EDGE", "INT", c_indices[:, :1]),
            END: Attribute("EDGE", "INT", c_indices[:, 1:]),
        },
    )


def drawn(mesh: Snapshot) -> Drawn:
    """The edges of a mesh as a patch graph. Costs O(edges)."""
    edges = mesh.edges
    is_node = np.bincount(edges.ravel(), minlength=len(mesh.positions)) != 2
    marked = mesh.attributes.get(NODE)
    if marked is not None and marked.domain == "POINT":
        is_node |= marked.values[:, 0].astype(bool)
    at: dict[int, list[int]] = {}
    for edge, ends in enumerate(edges.tolist()):
        for end in ends:
            at.setdefault(end, []).append(edge)
    side_of_edge = np.full(len(edges), -1)
    sides, chains = [], []

    def walk(start: int, edge: int) -> None:
        path, chain = [start], []
        while side_of_edge[edge] < 0:
            side_of_edge[edge] = len(sides)
            chain.append(edge)
            a, b = edges[edge].tolist()
            path.append(b if a == path[-1] else a)
            if is_node[path[-1]]:
                break
            edge = next((e for e in at[path[-1]] if side_of_edge[e] < 0), edge)
        # A side runs as its first edge does.
        lowest = int(np.argmin(chain))
        if edges[chain[lowest], 0] != path[lowest]:
            path.reverse()
            chain.reverse()
        sides.append(np.array(path))
        chains.append(chain)

    for start in [*np.flatnonzero(is_node).tolist(), *range(len(mesh.positions))]:
        for edge in at.get(start, []):
            if side_of_edge[edge] < 0:
                # What is left after all nodes are loops without one.
                is_node[start] = True
                walk(start, edge)
    # A vertex without edges is no node.
    nodes = np.flatnonzero(is_node & (np.bincount(edges.ravel(), minlength=len(mesh.positions)) > 0))
    order = np.argsort([min(chain) for chain in chains], kind="stable")
    place = np.empty(len(order), int)
    place[order] = np.arange(len(order))
    sides, chains = [sides[k] for k in order], [chains[k] for k in order]
    known = [_edge_values(mesh, name) for name in (BEGIN, END)]
    c_indices = np.zeros((len(sides), 2), np.int32)
    for s, (path, chain) in enumerate(zip(sides, chains, strict=True)):
        with_edge = [edges[chain[0], 0] == path[0], edges[chain[-1], 1] == path[-1]]
        c_indices[s, 0] = known[0 if with_edge[0] else 1][chain[0]]
        c_indices[s, 1] = known[1 if with_edge[1] else 0][chain[-1]]
    return Drawn(nodes, sides, np.clip(c_indices, 0, 12), place[side_of_edge], mesh.positions)


def _edge_values(mesh: Snapshot, name: str) -> Array:
    layer = mesh.attributes.get(name)
    return np.zeros(len(mesh.edges), np.int32) if layer is None or layer.domain != "EDGE" else layer.values[:, 0]
