# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs of the library: in this thread, or in one of their own while Blender's window stays alive. Meshes are read before and
written after all of them, on Blender's main thread, so a run that fails or is cancelled leaves nothing behind."""
import threading
import time

import bpy

from . import isolation, native, survive

AT_ONCE = 40_000  # triangles: below, a run takes no longer than a look at its progress
_VIEW = {"MIDDLEMOUSE", "WHEELUPMOUSE", "WHEELDOWNMOUSE", "MOUSEMOVE", "TRACKPADPAN", "TRACKPADZOOM", "MOUSEROTATE", "NDOF_MOTION"}
_TICK = 0.05  # seconds between two looks at the progress
_TELL = 0.5  # and between two texts at least: each is a redraw of the window


class Request:
    """One run on one mesh. run: a name in survive.RUNS; triangles: that it has to do with, if not those of `data`. Afterwards there
    is either an outcome or an error, a sentence."""

    def __init__(self, run, data, keep, options, ob, triangles=None, **more):
        self.run, self.data, self.keep, self.options = run, data, keep, options
        self.triangles = triangles or len(data.corner_verts) - 2 * (len(data.face_offsets) - 1)
        self.name, self._was = ob.name, self._state(ob)
        self.more = more
        self.outcome = self.error = None

    def object(self):
        """The object again, None if it or its mesh is not what was read any more."""
        ob = bpy.data.objects.get(self.name)
        return ob if ob and ob.type == "MESH" and self._state(ob) == self._was else None

    @staticmethod
    def _state(ob):
        return ob.data.name, len(ob.data.vertices), len(ob.data.loops)


class Job:
    """Requests, one after the other."""

    def __init__(self, package, requests):
        self._package, self.requests = package, requests
        self._token = package.CancelToken()
        self._thread = self._helper = None
        self._sizes = [1 + request.triangles for request in requests]
        self._isolated = native.isolated()
        self.fraction, self.stage = 0.0, ""
        self.cancelled = False

    def run(self, told=lambda: None):
        """told: called now and then on this thread."""
        done = 0
        for request, size in zip(self.requests, self._sizes):
            if self.cancelled:
                return

            def progress(fraction, stage):
                self.fraction, self.stage = (done + size * fraction) / sum(self._sizes), stage
                told()
                return not self.cancelled

            self._one(request, progress)
            done += size

    def _one(self, request, progress):
        arguments = (request.run, request.data, request.keep, request.options)
        try:
            if self._isolated:
                self._helper = isolation.helper(self._package)
                request.outcome = self._helper.run(*arguments, progress)
            else:
                request.outcome = survive.RUNS[request.run](self._package, *arguments[1:], progress, self._token)
        except self._package.Cancelled:
            self.cancelled = True
        except (self._package.DelmeshError, survive.Refused, isolation.HelperFailed) as error:
            request.error = "" if self.cancelled else str(error)
        except MemoryError:
            request.error = "there is not enough memory"

    def start(self):
        self._thread = threading.Thread(target=self.run, name="delmesh")
        self._thread.start()

    def is_done(self):
        return not self._thread.is_alive()

    def cancel(self):
        """Returns when nothing runs any more."""
        self.cancelled = True
        self._token.cancel()
        if self._helper:
            self._helper.stop()
        if self._thread:
            self._thread.join()


_running = None  # the Job that has a thread: to be ended when the add-on goes


def end():
    if _running:
        _running.cancel()


class Running:
    """Base of the operators that run the library. They have _requests(context) -> [Request], which may report and return nothing,
    _finish(context, requests) -> result of the operator, and _over(), called after requests were made, whatever became of them."""

    _job = _timer = _text = None
    _told_at = 0.0

    def execute(self, context):
        job = self._begin(context)
        if not job:
            return {"CANCELLED"}
        manager = context.window_manager
        manager.progress_begin(0, 100)
        try:
            return self._end(context, job, lambda: manager.progress_update(100 * job.fraction))
        finally:
            manager.progress_end()

    def invoke(self, context, _event):
        if bpy.app.background or not context.window:
            return self.execute(context)
        job = self._begin(context)
        if not job:
            return {"CANCELLED"}
        if sum(request.triangles for request in job.requests) < AT_ONCE:
            return self._end(context, job, lambda: None)
        global _running
        _running = self._job = job
        job.start()
        manager = context.window_manager
        manager.progress_begin(0, 100)
        self._timer = manager.event_timer_add(_TICK, window=context.window)
        manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        if event.type in {"ESC", "RIGHTMOUSE"} and event.value == "PRESS":
            self.cancel(context)
            self.report({"INFO"}, "Cancelled; nothing was changed")
            return {"CANCELLED"}
        if event.type == "TIMER":
            if self._job.is_done():
                self._stop(context)
                return self._end(context, self._job)
            self._show(context)
        # Nothing may change the meshes meanwhile; looking at them is free.
        return {"PASS_THROUGH"} if event.type in _VIEW | {"TIMER"} else {"RUNNING_MODAL"}

    def _over(self):
        pass

    def cancel(self, context):
        """Also called by Blender, when a window closes or a file is opened."""
        self._job.cancel()
        self._stop(context)
        self._over()

    def _show(self, context):
        now, percent = time.perf_counter(), int(100 * self._job.fraction)
        text = f"{self.bl_label}: {self._job.stage} {percent} %  |  Esc: Cancel"
        if text != self._text and now - self._told_at > _TELL:
            self._text, self._told_at = text, now
            context.workspace.status_text_set(text)
            context.window_manager.progress_update(percent)

    def _stop(self, context):
        global _running
        _running = None
        context.window_manager.event_timer_remove(self._timer)
        context.window_manager.progress_end()
        if context.workspace:
            context.workspace.status_text_set(None)

    def _begin(self, context):
        try:
            package = native.load()
        except native.Unavailable as reason:
            self.report({"ERROR"}, str(reason))
            return None
        requests = []
        try:
            requests = self._requests(context)
        finally:
            if not requests:
                self._over()
        return Job(package, requests) if requests else None

    def _end(self, context, job, told=None):
        """told: the job is still to be run, in this thread; called now and then meanwhile."""
        try:
            if told:
                job.run(told)
            return self._conclude(context, job)
        finally:
            self._over()

    def _conclude(self, context, job):
        """Writes what there is, says what failed."""
        if job.cancelled:
            return {"CANCELLED"}
        for request in job.requests:
            if request.outcome and not request.object():
                request.outcome, request.error = None, "it was changed during the run"
        good = [request for request in job.requests if request.outcome]
        failed = [f"{request.name}: {request.error}" for request in job.requests if not request.outcome]
        if not good:
            self.report({"ERROR"}, failed[0] if len(failed) == 1 else f"{failed[0]} ({len(failed)} objects failed)")
            return {"CANCELLED"}
        result = self._finish(context, good)
        if failed:
            self.report({"WARNING"}, f"Left as it was: {'; '.join(failed)}")
        return result
