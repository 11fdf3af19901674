# SPDX-License-Identifier: Apache-2.0
"""Runs in steps, in a thread and in the helper process: the same results, cancelling, crashes."""
import os
import signal
import threading
import time
import types
import unittest
from unittest import mock

import bpy
import numpy as np
import support
from support import Case, fingerprint, folded_sheet, monkey, part, remesh, select

LONG = 900  # columns and rows: enough that a run takes a second and more


def preferences():
    return bpy.context.preferences.addons[support.ADDON].preferences


class Runs(Case):
    def setUp(self):
        super().setUp()
        preferences().isolate = True

    tearDown = setUp

    def job(self, ob, run="remesh", **options):
        runner, exchange = part("runner"), part("exchange")
        options = {"mode": "preserve", "boundary": "nonobtuse", **options} if run == "remesh" else options
        return runner.Job(part("native").load(), [runner.Request(run, exchange.read(ob.data, ob), (), options, ob)])

    @staticmethod
    def bumpy():
        """A large mesh, made fast."""
        n = LONG
        x, y = np.meshgrid(np.arange(n, dtype=np.float32), np.arange(n, dtype=np.float32))
        z = 3 * np.sin(0.3 * x) * np.cos(0.2 * y) + np.random.default_rng(1).random((n, n), np.float32)
        a = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).reshape(-1)
        mesh = bpy.data.meshes.new("bumpy")
        mesh.vertices.add(n * n)
        mesh.vertices.foreach_set("co", np.stack([x + 0.9 * y, y, z], axis=-1).reshape(-1))
        corners = np.stack([a, a + 1, a + n + 1, a + n], axis=-1).astype(np.int32).reshape(-1)
        mesh.loops.add(len(corners))
        mesh.loops.foreach_set("vertex_index", corners)
        mesh.polygons.add(len(a))
        mesh.polygons.foreach_set("loop_start", np.arange(0, len(corners), 4, dtype=np.int32))
        if bpy.app.version < (4, 0):
            mesh.polygons.foreach_set("loop_total", np.full(len(a), 4, np.int32))
        mesh.update(calc_edges=True)
        ob = bpy.data.objects.new("bumpy", mesh)
        bpy.context.scene.collection.objects.link(ob)
        return ob

    def test_isolated_or_not_is_the_same(self):
        results = []
        for isolate in (True, False):
            preferences().isolate = isolate
            ob = monkey(1)
            remesh(ob, mode="FEATURE")
            results.append(fingerprint(ob.data))
        self.assertEqual(*results)

    def test_cancelling_is_quick(self):
        ob = self.bumpy()
        for isolate in (True, False):
            with self.subTest(isolate=isolate):
                preferences().isolate = isolate
                for wait in (0.01, 0.3, 0.8):
                    job = self.job(ob)
                    threads = threading.active_count()
                    job.start()
                    time.sleep(wait)
                    self.assertFalse(job.wait(0))
                    began = time.perf_counter()
                    job.cancel()
                    took = time.perf_counter() - began
                    self.assertTrue(job.wait(0))
                    self.assertTrue(job.cancelled)
                    self.assertIsNone(job.requests[0].outcome)
                    self.assertLess(took, 2)  # below 0.2 where the machine is not shared
                    self.assertEqual(threading.active_count(), threads)

    def test_progress_rises(self):
        for isolate in (True, False):
            preferences().isolate = isolate
            seen = []
            job = self.job(self.bumpy(), mode="flip")
            job.start()
            while not job.wait(0.002):
                seen.append((job.fraction, job.stage))
            self.assertIsNotNone(job.requests[0].outcome)
            fractions = [fraction for fraction, _ in seen]
            self.assertEqual(fractions, sorted(fractions))
            self.assertGreater(len(set(fractions)), 5)
            self.assertLessEqual(fractions[-1], 1)
            self.assertTrue(all(stage for _, stage in seen))

    def test_errors_come_through(self):
        for isolate in (True, False):
            preferences().isolate = isolate
            ob = support.moebius()
            with self.assertRaisesRegex(RuntimeError, "one-sided"):
                remesh(ob)

    def test_growth_is_refused(self):
        ob = folded_sheet()
        before = fingerprint(ob.data)
        with self.assertRaisesRegex(RuntimeError, "times as many vertices"):
            remesh(ob, mode="PRESERVE", growth_limit=1.2)
        self.assertEqual(fingerprint(ob.data), before)
        self.assertEqual(remesh(ob, mode="PRESERVE"), {"FINISHED"})

    @unittest.skipIf(os.name == "nt", "signals")
    def test_a_crash_stays_in_the_helper(self):
        isolation = part("isolation")
        small, big = folded_sheet(), self.bumpy()
        before = fingerprint(small.data)
        remesh(small, mode="FLIP")
        for sent in (signal.SIGSEGV, signal.SIGABRT, signal.SIGKILL):
            remesh(folded_sheet("any"), mode="FLIP")
            helper = isolation.helper(part("native").load())
            job = self.job(big)
            threading.Timer(0.4, os.kill, (helper.pid, sent)).start()
            job.start()
            job.wait(None)
            self.assertRegex(job.requests[0].error, f"crashed .signal {int(sent)}. in its own process")
            self.assertTrue(helper.has_ended())
        self.assertNotEqual(fingerprint(small.data), before)
        remesh(folded_sheet("again"), mode="FLIP")  # with a new helper

    @unittest.skipIf(os.name == "nt", "signals")
    def test_a_helper_that_died_between_runs_is_started_again(self):
        isolation = part("isolation")
        package = part("native").load()
        remesh(folded_sheet("any"), mode="FLIP")
        first = isolation.helper(package)
        os.kill(first.pid, signal.SIGKILL)
        first._process.wait()
        remesh(folded_sheet(), mode="FLIP")
        self.assertNotEqual(isolation.helper(package).pid, first.pid)

    def test_without_a_python_it_says_so(self):
        isolation = part("isolation")
        isolation.close()
        pythons, isolation._pythons = isolation._pythons, lambda: []
        ob = folded_sheet()
        before = fingerprint(ob.data)
        try:
            with self.assertRaisesRegex(RuntimeError, "helper process could not be started; Isolation can be switched off"):
                remesh(ob)
        finally:
            isolation._pythons = pythons
        self.assertEqual(fingerprint(ob.data), before)

    def test_memory_files_without_room(self):
        shared = part("shared")
        write = shared._write

        def full(buffers, folder):
            if folder:
                raise OSError(28, "No space left on device")
            return write(buffers, folder)

        shared._write = full
        try:
            self.assertEqual(remesh(folded_sheet(), mode="FLIP"), {"FINISHED"})
        finally:
            shared._write = write

    def test_nothing_is_left_in_memory_files(self):
        isolation = part("isolation")
        remesh(folded_sheet(), mode="FLIP")
        helper = isolation.helper(part("native").load())
        self.assertEqual(os.listdir(helper._folder), [])
        isolation.close()
        self.assertFalse(os.path.exists(helper._folder))
        self.assertTrue(helper.has_ended())


def everything():
    """What there is, and the meshes."""
    return ({mesh.name: fingerprint(mesh) for mesh in bpy.data.meshes},
            *(sorted(each.name for each in data) for data in (bpy.data.objects, bpy.data.collections, bpy.context.scene.objects)))


class Reading(Case):
    """Piece by piece, as between the ticks of a window."""

    def setUp(self):
        super().setUp()
        self.exchange = part("exchange")

    def model(self):
        ob = monkey()
        mesh = ob.data
        ob.vertex_groups.new(name="all").add(range(len(mesh.vertices)), 0.25, "REPLACE")
        ob.vertex_groups.new(name="some").add(range(0, len(mesh.vertices), 3), 0.5, "REPLACE")
        for number, element in enumerate(mesh.attributes.new("name", "STRING", "POINT").data):
            element.value = f"{number % 5}" if isinstance(element.value, str) else b"%d" % (number % 5)
        mesh.attributes.new("paint", "BYTE_COLOR", "CORNER").data.foreach_set(
            "color", np.linspace(0, 1, 4 * len(mesh.loops), dtype=np.float32))
        for name in ("Basis", "Key"):
            ob.shape_key_add(name=name)
        return ob

    def test_small_pieces_are_the_whole(self):
        ob = self.model()
        whole = self.exchange.read(ob.data, ob)
        before = fingerprint(ob.data)
        with mock.patch.multiple(self.exchange, _ELEMENTS=50, _BYTES=1000):
            steps = self.exchange.reading(ob.data, ob)
            count = 0
            while True:
                try:
                    next(steps)
                except StopIteration as over:
                    pieces = over.value
                    break
                count += 1
        self.assertGreater(count, 100)
        self.assertEqual(fingerprint(ob.data), before)
        for name in ("positions", "edges", "corner_verts", "corner_edges", "face_offsets", "keys"):
            np.testing.assert_array_equal(getattr(pieces, name), getattr(whole, name), name)
        for name in ("offsets", "indices", "values"):
            np.testing.assert_array_equal(getattr(pieces.weights, name), getattr(whole.weights, name), name)
        self.assertEqual(whole.weights.offsets[-1], len(whole.positions) + -(-len(whole.positions) // 3))
        self.assertEqual([(a.name, a.kind, a.domain, a.texts) for a in pieces.layers],
                         [(a.name, a.kind, a.domain, a.texts) for a in whole.layers])
        self.assertIn("STRING", [layer.kind for layer in whole.layers])
        for a, b in zip(pieces.layers, whole.layers):
            np.testing.assert_array_equal(a.values, b.values, a.name)

    def test_what_changes_meanwhile_is_refused(self):
        for what, change in (("vertices", lambda mesh: mesh.vertices.add(1)),
                             ("maps", lambda mesh: mesh.uv_layers.remove(mesh.uv_layers[0])),
                             ("attributes", lambda mesh: mesh.attributes.new("new", "FLOAT", "POINT")),
                             ("all", lambda mesh: mesh.clear_geometry())):
            for taken in (0, 1, 7):
                with self.subTest(what, taken=taken):
                    ob = monkey()
                    steps = self.exchange.reading(ob.data, ob)
                    for _ in range(1 + taken):
                        next(steps)
                    change(ob.data)
                    with self.assertRaisesRegex(part("survive").Refused, "changed while it was read"):
                        self.exchange.drained(steps)


class Stopping(Case):
    """Operators are closed after any number of steps, as Esc, a closed window or another file do."""

    def setUp(self):
        super().setUp()
        preferences().isolate = False

    def tearDown(self):
        preferences().isolate = True

    def after(self, count, call):
        """-> what the call returns whose run is closed after so many steps, or is over before; and how often _over was called."""
        runner = part("runner")
        overs = []

        def execute(operator, context):
            operator._steps = operator._run(context)
            try:
                for _ in range(count):
                    if next(operator._steps):
                        operator._job.wait(None if count % 2 else 0)  # even: stopped in the midst of it
            except StopIteration as over:
                return over.value
            operator._steps.close()
            return {"CANCELLED"}

        def over(cls):
            there = cls._over
            return mock.patch.object(cls, "_over", lambda operator: (there(operator), overs.append(1)))

        with mock.patch.object(runner.Running, "execute", execute), over(part("lods").OBJECT_OT_delmesh_lod), \
                over(runner.Running):
            return call(), len(overs)

    def check_operator(self, call, makes):
        threads = threading.active_count()
        for count in (1, 2, 13, 55, 100, 10_001):
            with self.subTest(count):
                before = everything()
                result, overs = self.after(count, call)
                self.assertEqual(overs, 1)
                self.assertEqual(threading.active_count(), threads)
                if result == {"FINISHED"}:
                    return makes(before)
                self.assertEqual(everything(), before)
        self.fail("it never ends")

    def changed(self, before):
        self.assertNotEqual(everything()[0], before[0])

    def test_remesh(self):
        for as_copy, isolate in ((False, False), (False, True), (True, False)):
            self.setUp()
            preferences().isolate = isolate
            objects = monkey(), folded_sheet()
            with mock.patch.multiple(part("exchange"), _BYTES=4000):
                self.check_operator(lambda: remesh(*objects, mode="FLIP", as_copy=as_copy), self.changed)

    def test_lod(self):
        ob = monkey()
        ob.modifiers.new("sub", "SUBSURF").levels = 1
        for source in ("BASE", "EVALUATED", "CAGE"):
            def call():
                select(ob)
                return bpy.ops.object.delmesh_lod("EXEC_DEFAULT", True, by="RATIO", ratios="0.5,0.2", source=source, replace=True,
                                                  lod0="ORIGINAL", boundary="IGNORE", prepare="FLIP", cage_level=1)
            with mock.patch.multiple(part("exchange"), _BYTES=20_000):
                self.check_operator(call, self.changed)
            part("lods").remove_levels(ob.name)

    def test_check(self):
        ob = monkey()

        def call():
            select(ob)
            return bpy.ops.object.delmesh_check("EXEC_DEFAULT", True, select=False)

        self.check_operator(call, lambda before: self.assertEqual(ob.data.delmesh_check.vertices, len(ob.data.vertices)))

    def refused(self, call, steps, change, sentence):
        """After so many steps others do `change`."""
        def execute(operator, context):
            operator._steps = operator._run(context)
            try:
                for _ in range(steps):
                    next(operator._steps)
                change()
                while True:
                    if next(operator._steps):
                        operator._job.wait(None)
            except StopIteration as over:
                return over.value

        with mock.patch.object(part("runner").Running, "execute", execute), mock.patch.multiple(part("exchange"), _BYTES=4000), \
                self.assertRaisesRegex(RuntimeError, sentence):
            call()

    def test_objects_that_others_remove_meanwhile(self):
        for steps in (1, 8, 30):
            for which in range(2):
                with self.subTest(steps, which=which):
                    self.setUp()
                    objects = monkey(), folded_sheet()

                    def change():
                        mesh = objects[which].data
                        bpy.data.objects.remove(objects[which])
                        bpy.data.meshes.remove(mesh)

                    self.refused(lambda: remesh(*objects, mode="FLIP"), steps, change, "(changed|removed) while it was read")
        for removed in (True, False):  # an object whose mesh has other users; a mesh that was made for the run
            self.setUp()
            ob = monkey()
            ob.vertex_groups.new(name="all").add([0], 1, "REPLACE")
            other = ob.copy()
            before, mesh = {each.name for each in bpy.data.meshes}, fingerprint(other.data)

            def change():
                if removed:
                    return bpy.data.objects.remove(ob)
                made, = (each for each in bpy.data.meshes if each.name not in before)
                bpy.data.meshes.remove(made)

            def call():
                select(ob)
                return bpy.ops.object.delmesh_lod("EXEC_DEFAULT", True, ratios="0.5", source="EVALUATED")

            self.refused(call, 8, change, "(changed|removed) while it was read")
            self.assertEqual({each.name for each in bpy.data.meshes}, before)
            self.assertEqual(fingerprint(other.data), mesh)

    def test_the_last_step_is_the_only_one_that_writes(self):
        ob = monkey()
        runner, seen = part("runner"), []

        def execute(operator, context):
            steps = operator._run(context)
            while True:
                seen.append(everything())
                try:
                    next(steps)
                except StopIteration as over:
                    return over.value

        with mock.patch.object(runner.Running, "execute", execute):
            self.assertEqual(remesh(ob, mode="FLIP"), {"FINISHED"})
        self.assertTrue(all(each == seen[0] for each in seen))
        self.assertNotEqual(everything(), seen[0])


class Modal(Case):
    """What a window does, with an operator of our own."""

    def tearDown(self):
        preferences().isolate = True

    def operator(self, run, error=None, finish=lambda: {"FINISHED"}):
        """It reads in five steps. run(progress): in the place of the library's."""
        runner, survive = part("runner"), part("survive")
        ob = folded_sheet()

        class Operator(runner.Running):
            bl_label = "Test"
            said, overs, read = (), 0, 0

            def report(self, _kind, text):
                self.said = (*self.said, text)

            def _requests(self, _context):
                for _ in range(5):
                    self.read += 1
                    yield
                if error:
                    raise survive.Refused(error)
                data = yield from part("exchange").reading(ob.data, ob)
                return [runner.Request("test", data, (), {}, ob)]

            def _finish(self, _context, _requests):
                return finish()

            def _over(self):
                self.overs += 1

        preferences().isolate = False
        runs = mock.patch.dict(survive.RUNS, test=lambda delmesh, data, keep, options, progress, cancel: run(progress, delmesh))
        runs.start()
        self.addCleanup(runs.stop)
        self.calls = mock.Mock()
        self.context = types.SimpleNamespace(window_manager=self.calls, workspace=self.calls, window=self.calls)
        return Operator()

    def send(self, operator, kind, value="NOTHING"):
        return operator.modal(self.context, types.SimpleNamespace(type=kind, value=value))

    def begin(self, operator):
        operator._steps, operator._timer = operator._run(self.context), "timer"

    def to_the_end(self, operator):
        while (result := self.send(operator, "TIMER")) == {"PASS_THROUGH"}:
            time.sleep(0.001)
        return result

    def check_over(self, operator):
        self.assertEqual(operator.overs, 1)
        self.calls.event_timer_remove.assert_called_once_with("timer")
        self.calls.status_text_set.assert_called_with(None)
        self.assertIsNone(part("runner")._running)
        self.assertFalse(any(thread.name == "delmesh" for thread in threading.enumerate()))

    @staticmethod
    def outcome(_progress=None, _delmesh=None):
        return part("survive").Outcome([], {})

    @staticmethod
    def for_ever(progress, delmesh):
        while progress(0.5, "at it"):
            time.sleep(0.001)
        raise delmesh.Cancelled()

    def test_to_the_end(self):
        operator = self.operator(self.outcome)
        self.begin(operator)
        self.assertEqual(self.to_the_end(operator), {"FINISHED"})
        self.check_over(operator)

    def test_blocking(self):
        operator = self.operator(self.outcome)
        self.assertEqual(operator.execute(self.context), {"FINISHED"})
        self.assertEqual(operator.overs, 1)

    def test_events_that_could_change_meshes_are_kept_back(self):
        operator = self.operator(self.for_ever)
        self.begin(operator)
        self.send(operator, "TIMER")
        for kind, result in (("G", "RUNNING_MODAL"), ("LEFTMOUSE", "RUNNING_MODAL"), ("WHEELUPMOUSE", "PASS_THROUGH")):
            self.assertEqual(self.send(operator, kind, "PRESS"), {result})
        operator.cancel(self.context)  # as Blender does when the window closes
        self.check_over(operator)

    def test_esc_at_any_time(self):
        for ready in (lambda operator: operator.read == 0, lambda operator: operator.read == 3,
                      lambda operator: operator._job and operator._job.stage == "at it"):
            operator = self.operator(self.for_ever)
            self.begin(operator)
            with mock.patch.object(part("runner"), "_SLICE", 1e-9):  # one step for each tick
                while not ready(operator):
                    self.send(operator, "TIMER")
            self.assertEqual(self.send(operator, "ESC", "PRESS"), {"CANCELLED"})
            self.assertEqual(operator.said, ("Cancelled; nothing was changed",))
            self.assertEqual(operator.overs, 1 if operator.read else 0)  # what has not begun need not end
            operator.overs = 1
            self.check_over(operator)

    def test_what_is_refused_and_what_fails(self):
        def fails(_progress, delmesh):
            raise delmesh.DelmeshError("no")

        for options, said in (({"run": self.outcome, "error": "not this"}, "not this"), ({"run": fails}, "sheet.001: no")):
            operator = self.operator(**options)
            self.begin(operator)
            self.assertEqual(self.to_the_end(operator), {"CANCELLED"})
            self.assertEqual(operator.said, (said,))
            self.check_over(operator)

    def test_defects_are_told_and_leave_no_timer(self):
        def defect(*_):
            raise ZeroDivisionError("a defect")

        for options in ({"run": defect}, {"run": self.outcome, "finish": defect}):
            operator = self.operator(**options)
            self.begin(operator)
            with self.assertRaisesRegex(ZeroDivisionError, "a defect"):
                self.to_the_end(operator)
            self.check_over(operator)

    def test_the_add_on_goes_meanwhile(self):
        operator = self.operator(self.for_ever)
        self.begin(operator)
        while not operator._job:
            self.send(operator, "TIMER")
        part("runner").end()
        self.assertEqual(self.to_the_end(operator), {"CANCELLED"})
        self.check_over(operator)
