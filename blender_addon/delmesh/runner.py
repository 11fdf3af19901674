# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs of the library while Blender's window stays alive. A run is a generator: it reads the meshes piece by piece, waits for a
thread, and writes. Scripts take all its steps at once, the window a few at every tick; to stop it is to close it. All is written in
the last step, so that a run that fails or is cancelled leaves nothing behind, and as every element or layer that is added has
Blender draw all its views anew."""
import threading
import time

import bpy

from . import isolation, native, survive

_VIEW = {"MIDDLEMOUSE", "WHEELUPMOUSE", "WHEELDOWNMOUSE", "MOUSEMOVE", "TRACKPADPAN", "TRACKPADZOOM", "MOUSEROTATE", "NDOF_MOTION"}
_AT_ONCE = 0.1  # seconds: what is over by then does not need the window's ticks
_TICK = 0.025  # seconds between two ticks
_SLICE = 0.015  # of steps in each
_NO_MEMORY = "there is not enough memory"
_TELL = 0.5  # and between two texts at least: each is a redraw of the window


class Request:
    """One run on one mesh. run: a name in survive.RUNS; triangles: that it has to do with, if not those of `data`. Afterwards there
    is no data any more, and either an outcome or an error, a sentence."""

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
    """Requests, one after the other, in a thread. prepare(requests): computes what they need, before the first."""

    def __init__(self, package, requests, prepare=lambda requests: None):
        self._package, self.requests, self._prepare = package, requests, prepare
        self._token = package.CancelToken()
        self._thread = self._helper = None
        self._sizes = [1 + request.triangles for request in requests]
        self._isolated = native.isolated()
        self.fraction, self.stage = 0.0, "preparing"
        self.cancelled = False
        self.defect = None  # what ended the thread and should not have

    def _run(self):
        done = 0
        try:
            self._prepare(self.requests)
            for request, size in zip(self.requests, self._sizes):
                if self.cancelled:
                    return

                def progress(fraction, stage):
                    self.fraction, self.stage = (done + size * fraction) / sum(self._sizes), stage
                    return not self.cancelled

                self._one(request, progress)
                request.data = None  # writing needs as much room
                done += size
        except MemoryError:  # of preparing; _one() has told of its own
            for request in self.requests:
                request.data, request.error = None, _NO_MEMORY
        except Exception as error:
            self.defect = error

    def _one(self, request, progress):
        arguments = (request.run, request.data, request.keep, request.options)
        try:
            if self._isolated:
                self._helper = isolation.helper(self._package)
                request.outcome = self._helper.run(*arguments, progress)
            else:
                request.outcome = survive.RUNS[request.run](self._package, *arguments[1:], progress, self._token)
            for data in request.outcome.meshes:
                if self.cancelled:
                    return
                data.prepare()
        except self._package.Cancelled:
            self.cancelled = True
        except (self._package.DelmeshError, survive.Refused, isolation.HelperFailed) as error:
            request.error = "" if self.cancelled else str(error)
        except MemoryError:
            request.outcome, request.error = None, _NO_MEMORY

    def start(self):
        thread = threading.Thread(target=self._run, name="delmesh")
        thread.start()
        self._thread = thread

    def wait(self, seconds):
        """At most so long. -> whether nothing runs any more."""
        self._thread.join(seconds)
        return not self._thread.is_alive()

    def cancel(self):
        """Returns when nothing runs any more."""
        self.cancelled = True
        self._token.cancel()
        if self._helper:
            self._helper.stop()
        if self._thread:
            self._thread.join()


def read_all(meshes, read):
    """meshes: {mesh: objects}; read(mesh, objects): a generator that returns a Request or None. -> the Requests."""
    requests = []
    for mesh, objects in meshes.items():
        request = yield from read(mesh, objects)
        requests += [request] if request else []
    return requests


_running = None  # the Job that has a thread: to be ended when the add-on goes


def end():
    if _running:
        _running.cancel()


class Running:
    """Base of the operators that run the library. They have _requests(context) -> [Request], a generator that yields where the
    window may have a look in between, and may report and return nothing; _prepare(requests), called in the thread of the runs,
    where neither bpy nor the operator's properties may be used; _finish(context, requests) -> result of the operator; and
    _over(), called in the end, whatever became of the run."""

    _job = _steps = _timer = _text = None
    _told_at = 0.0

    def execute(self, context):
        manager = context.window_manager
        manager.progress_begin(0, 100)
        self._steps = self._run(context)
        try:
            while (result := self._advance(_TICK)) is None:
                manager.progress_update(self._percent())
        finally:
            self._steps.close()
            manager.progress_end()
        return result

    def invoke(self, context, _event):
        if bpy.app.background or not context.window:
            return self.execute(context)
        self._steps = self._run(context)
        result = self._advance(_AT_ONCE)
        if result:
            return result
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
            result = {"CANCELLED"}  # should it raise
            try:
                result = self._advance(_SLICE, wait=False)
            finally:
                if result:
                    self._stop(context)
            if result:
                return result
            self._show(context)
        # Nothing may change the meshes meanwhile; looking at them is free.
        return {"PASS_THROUGH"} if event.type in _VIEW | {"TIMER"} else {"RUNNING_MODAL"}

    def cancel(self, context):
        """Also called by Blender, when a window closes or a file is opened."""
        try:
            self._steps.close()
        finally:
            self._stop(context)

    def _advance(self, seconds, wait=True):
        """Takes steps for so long, at least one. wait: for the thread too. -> what the run returns, None if it is not over."""
        until = time.perf_counter() + seconds
        while True:
            try:
                waits = next(self._steps)
            except StopIteration as over:
                return over.value
            left = until - time.perf_counter()
            if left <= 0 or waits and not wait:
                return None
            if waits:
                self._job.wait(left)

    def _percent(self):
        return int(100 * self._job.fraction) if self._job else 0

    def _show(self, context):
        now, percent = time.perf_counter(), self._percent()
        text = f"{self.bl_label}: {self._job.stage if self._job else 'reading'} {percent} %  |  Esc: Cancel"
        if text != self._text and now - self._told_at > _TELL:
            self._text, self._told_at = text, now
            context.workspace.status_text_set(text)
            context.window_manager.progress_update(percent)

    def _stop(self, context):
        context.window_manager.event_timer_remove(self._timer)
        context.window_manager.progress_end()
        if context.workspace:
            context.workspace.status_text_set(None)

    def _prepare(self, requests):
        pass

    def _over(self):
        pass

    def _run(self, context):
        """The generator. Yields whether there is nothing to do but to wait for the job; returns the operator's result."""
        self._job = None
        try:
            package = native.load()
            requests = yield from self._reading(context)
            if not requests:
                return {"CANCELLED"}
            self._job = Job(package, requests, self._prepare)
            yield from self._wait()
            if self._job.cancelled:
                return {"CANCELLED"}
            return self._conclude(context, requests)
        except (native.Unavailable, survive.Refused) as reason:
            self.report({"ERROR"}, str(reason))
            return {"CANCELLED"}
        finally:
            self._over()

    def _reading(self, context):
        try:
            return (yield from self._requests(context))
        except ReferenceError:
            raise survive.Refused("An object or its mesh was removed while it was read") from None
        except MemoryError:
            raise survive.Refused("There is not enough memory") from None

    def _wait(self):
        global _running
        self._job.start()
        _running = self._job
        try:
            while not self._job.wait(0):
                yield True
        finally:
            if not self._job.wait(0):
                self._job.cancel()
            _running = None
        if self._job.defect:
            raise self._job.defect

    def _conclude(self, context, requests):
        """Writes what there is, says what failed."""
        for request in requests:
            if request.outcome and not request.object():
                request.outcome, request.error = None, "it was changed during the run"
        good = [request for request in requests if request.outcome]
        failed = [f"{request.name}: {request.error}" for request in requests if not request.outcome]
        if not good:
            self.report({"ERROR"}, failed[0] if len(failed) == 1 else f"{failed[0]} ({len(failed)} objects failed)")
            return {"CANCELLED"}
        result = self._finish(context, good)
        if failed:
            self.report({"WARNING"}, f"Left as it was: {'; '.join(failed)}")
        return result
