"""Long native calls on a worker thread, under a modal operator with a progress bar and Esc.

The worker never touches bpy. The operator polls it from a timer on the main thread, where `finish` or `fail` then runs.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any, ClassVar

import bpy
from bpy.app.translations import pgettext_iface as translated

from .native import Cancelled, Progress
from .selection import WhyNot

POLL_SECONDS = 0.05
# Looking around stays possible while a job runs; everything else waits, so that nothing can change under it.
NAVIGATION = {
    "MIDDLEMOUSE", "WHEELUPMOUSE", "WHEELDOWNMOUSE", "WHEELINMOUSE", "WHEELOUTMOUSE",
    "TRACKPADPAN", "TRACKPADZOOM", "MOUSEROTATE", "MOUSESMARTZOOM", "NDOF_MOTION",
}  # fmt: skip


class Job:
    """One call on a worker thread. `stage` and `fraction` say how far it is."""

    def __init__(self, call: Callable[[Progress], Any]) -> None:
        self.stage = ""
        self.fraction = 0.0
        self._call = call
        self._cancelled = threading.Event()
        self._outcome: Any = None
        self._error: BaseException | None = None
        self._thread = threading.Thread(target=self._run, name="quadloom", daemon=True)
        self._thread.start()

    @property
    def finished(self) -> bool:
        """Whether the call has returned or raised."""
        return not self._thread.is_alive()

    def cancel(self) -> None:
        """Asks the call to stop; it raises Cancelled at its next progress report."""
        self._cancelled.set()

    def outcome(self) -> Any:
        """Waits for the call; returns what it returned or raises what it raised."""
        self._thread.join()
        if self._error is not None:
            raise self._error
        return self._outcome

    def _run(self) -> None:
        try:
            self._outcome = self._call(self._progress)
        except BaseException as error:  # handed to the main thread, which raises it there
            self._error = error

    def _progress(self, stage: str, fraction: float) -> bool:
        self.stage, self.fraction = stage, fraction
        return not self._cancelled.is_set()


running: Job | None = None
"""The job under way, for the panel's progress bar; there is at most one."""


class JobOperator:
    """Mixin of an operator whose work is a job. It provides `why_not`, `_prepare(context)`, which reads Blender into `_task` or
    reports why not, `finish(context, outcome)` and `fail(context, error)`."""

    why_not: ClassVar[WhyNot]
    """Why it cannot start."""

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Grey, with the reason, when it cannot start."""
        reason = cls.why_not(context)
        if reason is not None:
            cls.poll_message_set(reason)
        return reason is None

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Runs to the end: scripts, the redo panel, `blender -b`."""
        if not self._prepare(context):
            return {"CANCELLED"}
        return self.conclude(context, lambda: self._task.run(None))

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Runs on a worker thread with a progress bar and Esc."""
        if bpy.app.background:
            return self.execute(context)
        if not self._prepare(context):
            return {"CANCELLED"}
        return self.start(context, self._task.run)

    def start(self, context: bpy.types.Context, call: Callable[[Progress], Any]) -> set[str]:
        """Runs `call` on a worker thread and the operator modally until it ends."""
        global running
        manager = context.window_manager
        running = self._job = Job(call)
        self._timer = manager.event_timer_add(POLL_SECONDS, window=context.window)
        manager.progress_begin(0, 100)
        manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Blender's entry: Esc cancels, the timer watches the job."""
        if event.type == "ESC" and event.value == "PRESS":
            self._job.cancel()
        if event.type != "TIMER":
            return {"PASS_THROUGH"} if event.type in NAVIGATION else {"RUNNING_MODAL"}
        if not self._job.finished:
            self._show(context)
            return {"RUNNING_MODAL"}
        self._end(context)
        return self.conclude(context, self._job.outcome)

    def cancel(self, context: bpy.types.Context) -> None:
        """Blender's entry when it ends the operator itself, e.g. because another file is opened."""
        self._job.cancel()
        self._end(context)

    def conclude(self, context: bpy.types.Context, outcome: Callable[[], Any]) -> set[str]:
        """Finishes with what `outcome` returns, or reports what it raises. Also the whole of a synchronous run."""
        try:
            value = outcome()
        except Cancelled:
            self.report({"INFO"}, translated("Cancelled: nothing was changed"))
            return {"CANCELLED"}
        except Exception as error:
            return self.fail(context, error)
        return self.finish(context, value)

    def _show(self, context: bpy.types.Context) -> None:
        job = self._job
        context.window_manager.progress_update(int(100 * job.fraction))
        if context.workspace is not None:
            text = translated("{stage}: {percent}%   Esc to cancel").format(stage=job.stage, percent=int(100 * job.fraction))
            context.workspace.status_text_set(text)
        _redraw(context)

    def _end(self, context: bpy.types.Context) -> None:
        global running
        running = None
        context.window_manager.progress_end()
        context.window_manager.event_timer_remove(self._timer)
        if context.workspace is not None:
            context.workspace.status_text_set(None)
        _redraw(context)


def _redraw(context: bpy.types.Context) -> None:
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                area.tag_redraw()


def register() -> None:
    """Nothing to register: operators bring their jobs."""


def unregister() -> None:
    """Stops a job that is under way."""
    if running is not None:
        running.cancel()
