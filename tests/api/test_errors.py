"""The exceptions: one base, each with a code, the elements and a sentence; and they can be pickled."""

from __future__ import annotations

import pickle

import pytest
import quadloom


def test_every_error_is_a_quadloom_error():
    for error in (quadloom.InvalidMeshError, quadloom.InfeasibleError, quadloom.Cancelled, quadloom.InternalError):
        assert issubclass(error, quadloom.QuadloomError)
    assert issubclass(quadloom.QuadloomError, Exception)


def test_an_error_survives_pickling():
    with pytest.raises(quadloom.InvalidMeshError) as caught:
        quadloom.Mesh([[0, 0, 0]], [0, 3], [0, 0, 9])
    copy = pickle.loads(pickle.dumps(caught.value))
    assert type(copy) is quadloom.InvalidMeshError
    assert (copy.code, str(copy)) == ("vertex_out_of_range", str(caught.value))
    assert copy.elements["corners"].tolist() == [2]
