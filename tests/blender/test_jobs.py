"""Jobs: results, errors and cancelling on the worker thread, and what a cancelled operator leaves."""

import time

import bpy
import pytest
import shapes


def wait_for(job, seconds: float = 10.0) -> None:
    deadline = time.monotonic() + seconds
    while not job.finished:
        assert time.monotonic() < deadline, "waited too long"
        time.sleep(0.005)


def test_returns_what_the_call_returns(module):
    job = module("jobs").Job(lambda progress: progress("half", 0.5) and 42)
    assert job.outcome() == 42
    assert (job.stage, job.fraction) == ("half", 0.5)


def test_raises_what_the_call_raises(module):
    def call(progress):
        raise ValueError("no")

    with pytest.raises(ValueError, match="no"):
        module("jobs").Job(call).outcome()


def test_cancels_the_library_within_200_ms(module):
    bridge, jobs, native = module("bridge"), module("jobs"), module("native")
    # Big enough that it cannot be done before it is cancelled.
    a = shapes.add("A", shapes.ball(60))
    b = shapes.add("B", shapes.ball(60), offset=(0.9, 0.3, 0.2))
    depsgraph = bpy.context.evaluated_depsgraph_get()
    operands = [bridge.read(obj, depsgraph) for obj in (a, b)]
    for wait in (0.0, 0.05, 0.2):
        job = jobs.Job(lambda progress: native.boolean(*operands, progress=progress, operation="union"))
        time.sleep(wait)
        assert not job.finished
        start = time.monotonic()
        job.cancel()
        wait_for(job)
        assert time.monotonic() - start < 0.2
        with pytest.raises(native.Cancelled):
            job.outcome()


def test_a_cancelled_operator_changes_nothing(module, balls, monkeypatch):
    native = module("native")

    def cancelled(*args, **options):
        raise native.Cancelled

    monkeypatch.setattr(native, "boolean", cancelled)
    before = [shapes.fingerprint(obj) for obj in balls]
    assert bpy.ops.quadloom.boolean() == {"CANCELLED"}
    assert (len(bpy.data.objects), len(bpy.data.meshes)) == (2, 2)
    assert [shapes.fingerprint(obj) for obj in balls] == before
    assert not any(obj.hide_get() for obj in balls)


def test_a_bug_is_raised_and_not_reported_as_the_artists_fault(module, balls, monkeypatch):
    def broken(*args, **options):
        raise ZeroDivisionError("a bug")

    monkeypatch.setattr(module("native"), "boolean", broken)
    with pytest.raises(RuntimeError, match="a bug"):
        bpy.ops.quadloom.boolean()
