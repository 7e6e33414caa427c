"""Progress, cancelling and Ctrl-C of a long call; the interpreter stays free meanwhile."""

from __future__ import annotations

import os
import signal
import threading
import time

import numpy as np
import pytest
import quadloom
from meshes import CUBE_FACES, cube_positions

# Time from asking to stop until the call has ended; the second value allows for a busy machine.
CANCEL_SECONDS = 0.2
SLACK = 0.3


@pytest.fixture(scope="module")
def long_job() -> quadloom.Mesh:
    """A mesh whose check takes seconds: thousands of cubes that all intersect one another."""
    count = 1500
    shift = np.random.default_rng(5).uniform(0, 0.5, (count, 1, 3))
    positions = (cube_positions() + shift).reshape(-1, 3)
    faces = (np.array(CUBE_FACES) + 8 * np.arange(count)[:, None, None]).reshape(-1, 4)
    return quadloom.Mesh.from_polygons(positions, faces)


def test_progress_tells_stage_and_fraction(long_job):
    heard = []

    def progress(stage, fraction):
        heard.append((stage, fraction, time.monotonic()))
        return len(heard) < 4

    with pytest.raises(quadloom.Cancelled) as caught:
        quadloom.check(long_job, progress=progress)
    assert caught.value.code == "cancelled"
    assert len(heard) == 4
    assert all(isinstance(stage, str) and 0 <= fraction <= 1 for stage, fraction, _ in heard)
    gaps = np.diff([moment for *_, moment in heard])
    assert gaps.max() < 0.05 + SLACK


def test_false_cancels_within_the_limit(long_job):
    asked = None

    def progress(*_):
        nonlocal asked
        if time.monotonic() - start < 0.3:
            return True
        asked = asked or time.monotonic()
        return False

    start = time.monotonic()
    with pytest.raises(quadloom.Cancelled):
        quadloom.check(long_job, progress=progress)
    assert time.monotonic() - asked < CANCEL_SECONDS + SLACK


def test_none_goes_on(cube):
    assert quadloom.check(cube, progress=lambda *_: None).is_valid


def test_false_at_the_first_call_cancels_even_a_short_job(cube):
    with pytest.raises(quadloom.Cancelled):
        quadloom.check(cube, progress=lambda *_: False)


def test_an_exception_from_progress_comes_out(long_job):
    def progress(stage, _):
        if stage != "start":
            raise LookupError("from progress")

    with pytest.raises(LookupError, match="from progress"):
        quadloom.check(long_job, progress=progress)


def test_ctrl_c_interrupts(long_job):
    # A shell that starts the tests in the background has them ignore Ctrl-C.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    timer = threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT))
    start = time.monotonic()
    timer.start()
    try:
        with pytest.raises(KeyboardInterrupt):
            quadloom.check(long_job)
    finally:
        signal.signal(signal.SIGINT, before)
    assert time.monotonic() - start < 0.3 + CANCEL_SECONDS + SLACK


def test_other_python_threads_run_meanwhile(long_job):
    ticks = 0
    stop = threading.Event()

    def count():
        nonlocal ticks
        while not stop.wait(0.01):
            ticks += 1

    other = threading.Thread(target=count)
    other.start()
    start = time.monotonic()
    try:
        with pytest.raises(quadloom.Cancelled):
            quadloom.check(long_job, progress=lambda *_: time.monotonic() - start < 0.5)
    finally:
        stop.set()
        other.join()
    assert ticks > 10
