"""From a mesh and its marks to quads, with the layout of the last run kept. Runs on a job's thread: touches no bpy.

An artist marks one more edge and runs again: then only the layout near it is made anew, which is quick, and leaves what was
good elsewhere as it was. The result then depends on what was marked before, and its report says so.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from typing import Any

from . import native
from .attributes import Array, Snapshot

# What is looked at after the layout is made.
LATER = {"templates"}


@dataclass
class _Run:
    key: str
    """The mesh and the options."""
    session: Any
    edited: bool = False
    """Whether another order of marks could have given another layout."""


_last: _Run | None = None


def retopologize(
    mesh: Snapshot,
    edges: Array,
    *,
    keep: bool,
    field_of: Array | None,
    progress: native.Progress | None,
    **options: Any,
) -> tuple[Any, Array | None]:
    """The quads, and the harmonic field (V,) of the edges `field_of`, if any. With `keep` the layout of the last run stays
    where no mark changed, if mesh and options are the same; without it the result is the same whatever was run before."""
    global _last
    key = _key(mesh, options)
    run = _last if _last is not None and _last.key == key else None
    if run is not None and not _same(run.session.feature_edges, edges):
        run = _edited(run, edges, progress) if keep else None
    if run is None or (run.edited and not keep):
        _last = None
        run = _last = _Run(key, native.retopology_session(mesh, edges, progress=progress, **options))
    field = None if field_of is None or len(field_of) == 0 else native.harmonic_field(run.session, field_of)
    return native.session_quads(run.session, options.get("templates"), progress=progress), field


def forget() -> None:
    """Frees what was kept of the last run."""
    global _last
    _last = None


def _edited(run: _Run, edges: Array, progress: native.Progress | None) -> _Run:
    """After an error nothing has changed."""
    done = native.set_features(run.session, edges, progress=progress)
    run.edited = not done["whole"] and (run.edited or done["removed"] > 0)
    return run


def _same(first: Array, second: Array) -> bool:
    return {frozenset(edge) for edge in first.tolist()} == {frozenset(edge) for edge in second.tolist()}


def _key(mesh: Snapshot, options: dict[str, Any]) -> str:
    digest = hashlib.sha256()
    for array in (mesh.positions, mesh.face_offsets, mesh.corner_verts, options.get("density")):
        digest.update(b"none" if array is None else array.tobytes())
    digest.update(repr(sorted((k, v) for k, v in options.items() if k not in {"density", *LATER})).encode())
    return digest.hexdigest()
