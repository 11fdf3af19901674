# SPDX-License-Identifier: Apache-2.0
"""remesh, certify, measure and distance; progress, cancelling, limits."""
import threading
import time
import unittest

import support
from support import grid, np

import delmesh

MODES = ("preserve", "flip", "feature")


class Remesh(unittest.TestCase):
    def test_certified_in_every_mode_and_precision(self):
        for dtype in (np.float32, np.float64):
            points, faces = grid(40, 30, dtype=dtype)
            before = delmesh.certify((points, faces))
            self.assertFalse(before.delaunay)
            for mode in MODES:
                with self.subTest(mode, dtype=dtype):
                    mesh, report = delmesh.remesh((points, faces), mode=mode)
                    self.assertEqual(mesh.positions.dtype, dtype)  # the precision stays unless another is asked for
                    self.assertTrue(report.certified)
                    self.assertEqual((report.nld_in, report.nld_out), (before.nld_interior + before.nld_boundary, 0))
                    self.assertTrue(delmesh.certify((mesh.positions, mesh.faces)).delaunay)
                    np.testing.assert_array_equal(mesh.positions[:len(points)], points)
                    self.assertEqual((report.vertices_in, report.faces_in), (len(points), len(faces)))
                    self.assertEqual((report.vertices_out, report.faces_out), (len(mesh.positions), len(mesh.faces)))
                    self.assertEqual(report.vertices_out - report.vertices_in, report.splits)
                    np.testing.assert_array_equal(mesh.vert_source, np.r_[np.arange(len(points)), [-1] * report.splits])
                    mesh.validate()
                    again, _ = delmesh.remesh(mesh, mode="flip")
                    np.testing.assert_array_equal(again.faces, mesh.faces)

    def test_options_reach_the_library(self):
        points, faces = grid(20, 20)
        rounded, _ = delmesh.remesh((points, faces), precision="float32")
        self.assertEqual(rounded.positions.dtype, np.float32)
        np.testing.assert_array_equal(rounded.positions[:len(points)], points.astype(np.float32))
        self.assertEqual(delmesh.remesh((points, faces), precision=np.float64)[0].positions.dtype, np.float64)
        counts = {(p, b): delmesh.remesh((points, faces), placement=p, boundary=b)[1].splits
                  for p in ("interval", "shells") for b in ("nonobtuse", "ignore")}
        self.assertEqual(len(set(counts.values())), 4, counts)
        by_number = delmesh.remesh((points, faces), mode=1)[0]  # DELMESH_MODE_FLIP
        np.testing.assert_array_equal(by_number.faces, delmesh.remesh((points, faces), mode="flip")[0].faces)
        isolated = np.vstack([points, [[9, 9, 9]]])
        self.assertEqual(delmesh.remesh((isolated, faces), mode="flip", compact=True)[1].vertices_out,
                         delmesh.remesh((isolated, faces), mode="flip")[1].vertices_out - 1)

    def test_marked_edges_stay(self):
        points, faces = grid(30, 30)
        marked = faces[::3, [0, 2]]
        mesh, _ = delmesh.remesh(delmesh.Mesh(points, faces, marked_edges=marked), mode="flip")
        kept = (mesh.edge_flags & delmesh.EDGE_MARKED) != 0
        length = np.linalg.norm(np.diff(mesh.positions[mesh.edges[kept]], axis=1), axis=2).sum()
        self.assertAlmostEqual(length, np.linalg.norm(points[marked[:, 0]] - points[marked[:, 1]], axis=1).sum(), places=9)

    def test_wrong_options(self):
        mesh = delmesh.Mesh(*grid(3, 3))
        for call, error, sentence in (
                (lambda: delmesh.remesh(mesh, speed=3), TypeError, "no option 'speed'; there are mode, placement"),
                (lambda: delmesh.remesh(mesh, struct_size=3), TypeError, "no option 'struct_size'"),
                (lambda: delmesh.remesh(mesh, mode="smooth"), delmesh.InvalidArgument, "'mode' was 'smooth', .* preserve, flip"),
                (lambda: delmesh.remesh(mesh, mode=7), delmesh.InvalidArgument, "'mode' was 7"),
                (lambda: delmesh.remesh(mesh, precision="float16"), delmesh.InvalidArgument, "'precision'"),
                (lambda: delmesh.remesh(mesh, precision="double double"), delmesh.InvalidArgument,
                 "'precision' was 'double double', which is not one of float32, float64"),
                (lambda: delmesh.remesh(mesh, feature_angle=float("nan")), delmesh.InvalidArgument, "'feature_angle'"),
                (lambda: delmesh.distance(mesh, mesh, relative_error=-1), delmesh.InvalidArgument, "'relative_error'"),
                # what ctypes would store without the bits that do not fit
                (lambda: delmesh.remesh(mesh, effort=2**32), delmesh.InvalidArgument, "'effort' was 4294967296"),
                (lambda: delmesh.remesh(mesh, mode=2**32 + 1), delmesh.InvalidArgument, "'mode' was 4294967297"),
                (lambda: delmesh.remesh(mesh, max_vertices=2**64 + 1), delmesh.InvalidArgument, "'max_vertices'"),
                (lambda: delmesh.remesh(mesh, release=-1), delmesh.InvalidArgument, "'release' was -1"),
                (lambda: delmesh.Context(memory_limit=2**64), delmesh.InvalidArgument, "'memory_limit'"),
                (lambda: delmesh.Context(memory_limit=-1), delmesh.InvalidArgument, "'memory_limit' was -1"),
                (lambda: delmesh.remesh("mesh"), TypeError, "expected vertices and faces, a pair"),
                (lambda: delmesh.certify(None), TypeError, "expected vertices and faces, a pair")):
            with self.subTest(sentence), self.assertRaisesRegex(error, sentence):
                call()

    def test_an_error_carries_its_status_and_report(self):
        with self.assertRaises(delmesh.VertexLimit) as caught:
            delmesh.remesh(grid(20, 20), max_vertices=450)
        self.assertEqual(caught.exception.status, -11)
        self.assertEqual(caught.exception.report.vertices_in, 441)
        self.assertGreater(caught.exception.report.nld_in, 0)

    def test_the_estimate_is_the_truth_for_small_meshes(self):
        points, faces = grid(40, 30)
        _, report = delmesh.remesh((points, faces), tolerance=0)
        estimate = delmesh.estimate_preserve((points, faces), tolerance=0)
        self.assertEqual((estimate.exact, estimate.outcome, estimate.deviation), (1, 0, 0))
        self.assertEqual((estimate.vertices_in, estimate.vertices_out), (len(points), report.vertices_out))
        self.assertEqual((estimate.nld_edges, estimate.faces_run), (report.nld_in, len(faces)))
        self.assertEqual(estimate.growth, report.vertices_out / len(points))
        self.assertEqual(delmesh.estimate_preserve((points, faces), max_vertices=len(points) + 1).outcome, -11)
        with self.assertRaises(delmesh.NoSurface):
            delmesh.estimate_preserve((points, faces[:0]))
        parts = [value for name, value in report._asdict().items() if name.startswith("split_")]
        self.assertEqual((len(parts), sum(parts)), (8, report.splits))

    def test_threads_change_nothing(self):
        points, faces = grid(120, 100)
        results = []
        for threads in (1, 2, 3):
            mesh, _ = delmesh.remesh((points, faces), mode="flip", context=delmesh.Context(threads=threads))
            results.append((mesh.positions.tobytes(), mesh.faces.tobytes()))
        self.assertEqual(results[0], results[1])
        self.assertEqual(results[0], results[2])


def torus(around, across, dtype=np.float64):
    """A closed surface."""
    u, v = np.meshgrid(np.arange(around), np.arange(across), indexing="ij")
    u, v = 2 * np.pi * u / around, 2 * np.pi * (v / across + 0.1 * np.sin(4 * np.pi * u / around))
    points = np.stack([(2 + 0.7 * np.cos(v)) * np.cos(u), (2 + 0.7 * np.cos(v)) * np.sin(u), 0.7 * np.sin(v)], -1)
    i, j = np.meshgrid(np.arange(around), np.arange(across), indexing="ij")
    k, m = (i + 1) % around, (j + 1) % across
    quads = np.stack([i * across + j, k * across + j, k * across + m, i * across + m], -1).reshape(-1, 4)
    return points.reshape(-1, 3).astype(dtype), np.vstack([quads[:, :3], quads[:, [0, 2, 3]]])


class Decimate(unittest.TestCase):
    def test_a_family(self):
        points, faces = torus(40, 24)
        targets = ["full", ("ratio", 0.5), ("faces", 300), ("vertices", 60), ("faces", 0)]
        levels, report = delmesh.lod_family((points, faces), targets=targets)
        self.assertEqual([type(level) for level in levels], [delmesh.Mesh] * 5)
        self.assertEqual((report.vertices_in, report.faces_in, len(report.levels)), (len(points), len(faces), 5))
        self.assertGreater(report.prepare_nld, 0)
        self.assertGreater(report.prepare_flips, 0)
        self.assertEqual((report.prepare_splits, report.prepare_bound, report.topology_kept), (0, -1, 1))
        self.assertNotIn("reserved1", report._fields)
        for level, told in zip(levels, report.levels):
            self.assertTrue(told.certified)
            self.assertTrue(delmesh.certify((level.positions, level.faces)).delaunay)
            self.assertEqual((told.vertices, told.faces), (len(level.positions), len(level.faces)))
            self.assertEqual((level.info.euler_characteristic, level.info.components), (0, 1))
            self.assertEqual(level.positions.dtype, np.float64)  # the precision stays unless another is asked for
            same = level.vert_source >= 0
            np.testing.assert_array_equal(level.positions[same], points[level.vert_source[same]])
            verts, weights = level.vert_map
            np.testing.assert_allclose(weights.sum(axis=1), 1)
            self.assertLess(np.linalg.norm((points[verts] * weights[..., None]).sum(axis=1) - level.positions, axis=1).max(), 1)
            level.validate()
        self.assertEqual([told.stopped_by for told in report.levels], ["target"] * 4 + ["topology"])
        self.assertEqual(len(levels[0].faces), len(faces))
        self.assertLessEqual(len(levels[1].faces), len(faces) // 2)
        self.assertLessEqual(len(levels[2].faces), 300)
        self.assertEqual(len(levels[3].positions), 60)
        for fine, coarse in zip(levels, levels[1:]):
            np.testing.assert_array_equal(np.unique(fine.vert_parent), np.arange(len(coarse.positions)))
        np.testing.assert_array_equal(levels[-1].vert_parent, np.arange(len(levels[-1].positions)))
        np.testing.assert_array_equal(delmesh.Mesh(points, faces).vert_parent, np.arange(len(points)))

    def test_one_target(self):
        points, faces = torus(30, 20, np.float32)
        mesh, report = delmesh.decimate((points, faces), vertices=80)
        self.assertEqual((len(mesh.positions), mesh.positions.dtype), (80, np.float32))
        self.assertEqual((report.levels[0].stopped_by, len(report.levels)), ("target", 1))
        for placement in ("paper", "endpoints"):
            other = delmesh.decimate((points, faces), ratio=0.2, collapse_placement=placement, precision="float64")[0]
            self.assertLessEqual(len(other.faces), len(faces) // 5)
        self.assertTrue((other.vert_source >= 0).all())  # end points are source vertices
        self.assertEqual(delmesh.decimate((points, faces), faces=10**9)[1].collapses, 0)

    def test_values_per_element(self):
        points, faces = torus(40, 24)
        plain, _ = delmesh.decimate((points, faces), vertices=200)
        weighted, _ = delmesh.decimate((points, faces), vertices=200, vert_weights=np.where(points[:, 0] > 0, 100, 1))
        self.assertGreater((weighted.positions[:, 0] > 0).sum(), (plain.positions[:, 0] > 0).sum() + 20)
        for kind in (bool, np.uint8, np.int64, list):
            locked = np.arange(len(points)) % 10 == 0
            values = locked.tolist() if kind is list else locked.astype(kind)
            mesh, _ = delmesh.decimate((points, faces), vertices=200, locked_verts=values)
            self.assertLessEqual(set(np.flatnonzero(locked)), set(mesh.vert_source))

    def test_quads_have_a_mask_per_quad(self):
        points, quads, _, _ = support.cylinder(24, 16, 1.0, 0.01)
        mask = np.arange(len(quads)) >= len(quads) // 2
        delmesh.decimate((points, quads), ratio=0.8, face_mask=mask)
        with self.assertRaisesRegex(delmesh.InvalidArgument, f"'face_mask' had {2 * len(quads)} elements"):
            delmesh.decimate((points, quads), ratio=0.8, face_mask=np.ones(2 * len(quads), bool))

    def test_wrong_arguments(self):
        mesh = delmesh.Mesh(*torus(8, 6))
        for call, error, sentence in (
                (lambda: delmesh.decimate(mesh), delmesh.InvalidArgument, "Exactly one of vertices, faces, ratio, deviation"),
                (lambda: delmesh.decimate(mesh, vertices=5, ratio=0.5), delmesh.InvalidArgument, "Exactly one of"),
                (lambda: delmesh.decimate(mesh, ratio=2), delmesh.InvalidArgument, "ratio of 'targets' 0 was 2"),
                (lambda: delmesh.decimate(mesh, prepare="melt", ratio=0.5), delmesh.InvalidArgument, "'prepare' was 'melt'"),
                (lambda: delmesh.decimate(mesh, ratio=0.5, speed=1), TypeError, "no option 'speed'"),
                (lambda: delmesh.decimate(mesh, ratio=0.5, vert_weights=[1, 2]), delmesh.InvalidArgument, "'vert_weights' had 2"),
                (lambda: delmesh.decimate(mesh, ratio=0.5, vert_weights=[0] * 48), delmesh.InvalidArgument, "weight 0 of"),
                (lambda: delmesh.decimate(mesh, ratio=0.5, locked_verts=[0.5] * 48), delmesh.InvalidArgument, "not an integer"),
                (lambda: delmesh.lod_family(mesh, targets=["half"]), delmesh.InvalidArgument, "'half' was of no kind .* full, ver"),
                (lambda: delmesh.lod_family(mesh, targets=[]), delmesh.InvalidArgument, "'count' was 0"),
                (lambda: delmesh.lod_family(mesh, targets=[("faces", 5), ("faces", 9)]), delmesh.InvalidArgument, "was finer")):
            with self.subTest(sentence), self.assertRaisesRegex(error, sentence):
                call()
        with self.assertRaises(delmesh.InvalidArgument) as caught:
            delmesh.lod_family(mesh, targets=["full", ("ratio", -1)])
        self.assertEqual(len(caught.exception.report.levels), 2)

    def test_cancelling_leaves_nothing(self):
        context = delmesh.Context()
        mesh = delmesh.Mesh(*torus(40, 24), context=context)
        before = context.memory()[0]
        with self.assertRaises(delmesh.Cancelled):
            delmesh.lod_family(mesh, targets=["full", ("vertices", 100)], context=context,
                               progress=lambda fraction, _: fraction < 0.4)
        self.assertEqual(context.memory()[0], before)
        levels, _ = delmesh.lod_family(mesh, targets=["full", ("vertices", 100)], context=context)
        self.assertGreater(context.memory()[0], before)
        del levels
        self.assertEqual(context.memory()[0], before)


class Measuring(unittest.TestCase):
    def test_certify_lists_what_offends(self):
        # A flat kite, wider than high, cut the wrong way; the fifth vertex makes a face of zero area beside it.
        points = [[0, 0, 0], [4, 0, 0], [2, 1, 0], [2, -1, 0], [10, 0, 0], [11, 0, 0], [12, 0, 0]]
        faces = [[0, 1, 2], [1, 0, 3], [4, 5, 6]]
        report = delmesh.certify((points, faces), boundary="ignore", listed=True)
        self.assertEqual((report.delaunay, report.nld_interior, report.zero_area_faces), (0, 1, 1))
        self.assertEqual(sorted(report.nld_edges[0]), [0, 1])
        np.testing.assert_array_equal(report.zero_area_face_list, [2])
        flipped = delmesh.certify((points[:4], [[2, 3, 1], [3, 2, 0]]), listed=True)
        self.assertTrue(flipped.delaunay)
        self.assertEqual((flipped.nld_edges.shape, flipped.zero_area_face_list.shape), ((0, 2), (0,)))
        unlisted = delmesh.certify((points, faces))
        self.assertIsNone(unlisted.nld_edges)

    def test_measure_of_a_square(self):
        report = delmesh.measure(([[0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0]], [[0, 1, 2], [0, 2, 3]]))
        self.assertEqual((report.area, report.min_edge, report.max_valence), (4, 2, 3))
        self.assertAlmostEqual(report.min_angle, 45)
        self.assertAlmostEqual(report.max_angle, 90)
        self.assertAlmostEqual(report.diagonal, 8**0.5)
        self.assertEqual((len(report.angle_histogram), sum(report.angle_histogram)), (18, 6))

    def test_distance_of_two_squares(self):
        square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float)
        faces = [[0, 1, 2], [0, 2, 3]]
        report = delmesh.distance((square, faces), (square + [0, 0, 0.25], faces), samples=1000)
        for value in (report.hausdorff_sampled, report.rms, report.a_to_b_max, report.b_to_a_max):
            self.assertAlmostEqual(value, 0.25, places=12)
        self.assertGreaterEqual(report.hausdorff_bound, 0.25)
        self.assertLessEqual(report.hausdorff_bound, 0.25 * 1.1 + 1e-6 * 2**0.5)
        self.assertLess(delmesh.distance((square, faces), (square, faces), compute_bound=False).hausdorff_bound, 0)


class Progress(unittest.TestCase):
    def setUp(self):
        self.mesh = delmesh.Mesh(*grid(60, 60))

    def test_it_rises_to_the_end(self):
        for name, call in {"remesh": lambda p: delmesh.remesh(self.mesh, progress=p),
                           "certify": lambda p: delmesh.certify(self.mesh, progress=p),
                           "measure": lambda p: delmesh.measure(self.mesh, progress=p),
                           "distance": lambda p: delmesh.distance(self.mesh, self.mesh, samples=1000, progress=p),
                           "create": lambda p: delmesh.Mesh(*grid(9, 9), progress=p)}.items():
            with self.subTest(name):
                seen = []
                call(lambda fraction, stage: seen.append((fraction, stage)))  # returns None: goes on
                fractions = [fraction for fraction, _ in seen]
                self.assertEqual(fractions, sorted(fractions))
                self.assertEqual(fractions[-1], 1)
                self.assertTrue(all(isinstance(stage, str) and stage for _, stage in seen))

    def test_false_cancels_and_other_values_do_not(self):
        for value in (True, None, 0, "", 1):
            delmesh.remesh(self.mesh, progress=lambda *_: value)
        with self.assertRaises(delmesh.Cancelled):
            delmesh.remesh(self.mesh, progress=lambda *_: False)

    def test_an_exception_comes_out(self):
        class Stop(Exception):
            pass

        for error in (Stop("here"), KeyboardInterrupt(), SystemExit(3)):
            context = delmesh.Context()
            for fail_at in (1, 2, 3):
                calls = []

                def progress(*_):
                    calls.append(1)
                    if len(calls) == fail_at:
                        raise error

                with self.assertRaises(type(error)) as caught:
                    delmesh.remesh(self.mesh, progress=progress, context=context)
                self.assertIs(caught.exception, error)
                self.assertEqual(len(calls), fail_at)  # nothing was called after it
            self.assertTrue(delmesh.remesh(self.mesh, context=context)[1].certified)

    def test_a_context_serves_one_call_at_a_time(self):
        context = delmesh.Context()
        with self.assertRaises(delmesh.Busy):
            delmesh.remesh(self.mesh, context=context, progress=lambda *_: delmesh.measure(self.mesh, context=context))
        inner = []
        delmesh.remesh(self.mesh, progress=lambda *_: inner.append(delmesh.measure(self.mesh).area))  # another context is free
        self.assertTrue(inner)


class Cancel(unittest.TestCase):
    def setUp(self):
        self.mesh = delmesh.Mesh(*grid(60, 60))

    def test_from_another_thread_at_any_moment(self):
        for moment in range(1, 5):
            token, calls = delmesh.CancelToken(), []

            def progress(*_):
                calls.append(1)
                if len(calls) == moment:
                    thread = threading.Thread(target=token.cancel)
                    thread.start()
                    thread.join()

            with self.assertRaises(delmesh.Cancelled):
                delmesh.remesh(self.mesh, progress=progress, cancel=token)
            self.assertTrue(token.cancelled)

    def test_a_running_call_stops_early(self):
        big = delmesh.Mesh(*grid(700, 700))
        began = time.perf_counter()
        delmesh.remesh(big)
        whole = time.perf_counter() - began
        token = delmesh.CancelToken()
        timer = threading.Timer(whole / 10, token.cancel)
        began = time.perf_counter()
        timer.start()
        with self.assertRaises(delmesh.Cancelled):
            delmesh.remesh(big, cancel=token)
        self.assertLess(time.perf_counter() - began, whole * 0.8)

    def test_the_interpreter_runs_on_meanwhile(self):
        big = delmesh.Mesh(*grid(500, 500))
        thread = threading.Thread(target=delmesh.remesh, args=(big,))
        thread.start()
        ticks = 0
        while thread.is_alive():
            time.sleep(0.001)
            ticks += 1
        self.assertGreater(ticks, 5)

    def test_a_used_token_cancels_at_once_and_only_its_calls(self):
        token, context = delmesh.CancelToken(), delmesh.Context()
        token.cancel()
        for call in (lambda: delmesh.remesh(self.mesh, cancel=token, context=context),
                     lambda: delmesh.certify(self.mesh, cancel=token, context=context),
                     lambda: delmesh.Mesh(*grid(3, 3), cancel=token, context=context)):
            with self.assertRaises(delmesh.Cancelled):
                call()
            self.assertTrue(delmesh.remesh(self.mesh, context=context)[1].certified)

    def test_a_token_that_comes_too_late_hits_nothing(self):
        token, context = delmesh.CancelToken(), delmesh.Context()

        def over_when_it_comes(_handle):
            token.cancel()
            return 0

        context._call(over_when_it_comes, cancel=token)
        self.assertTrue(delmesh.remesh(self.mesh, context=context)[1].certified)


class Limits(unittest.TestCase):
    def test_memory_limit(self):
        context = delmesh.Context(memory_limit=100_000)
        with self.assertRaises(delmesh.MemoryLimit):
            delmesh.Mesh(*grid(200, 200), context=context)
        self.assertLess(context.memory()[0], 10_000)
        small = delmesh.Mesh(*grid(3, 3), context=context)
        self.assertTrue(delmesh.remesh(small, mode="flip", context=context)[1].certified)

    def test_every_allocation_may_fail(self):
        points, faces = grid(4, 4)
        for limit in range(1, 1000):
            context = delmesh.Context(threads=1, allocation_limit=limit)
            try:
                mesh = delmesh.Mesh(points, faces, context=context)
                result = delmesh.remesh(mesh, context=context)
                break
            except delmesh.AllocationLimit:
                mesh = None
        self.assertGreater(limit, 10)
        self.assertTrue(result[1].certified)

    def test_the_log_says_what_was_repaired(self):
        lines = []
        context = delmesh.Context(log=lambda level, text: lines.append((level, text)))
        delmesh.Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2], [0, 1, 2]], context=context)
        self.assertTrue(lines and all(level in (1, 2) and text for level, text in lines), lines)

    def test_a_log_that_raises(self):
        def log(_level, _text):
            raise LookupError("no log")

        context = delmesh.Context(log=log)
        with self.assertRaisesRegex(LookupError, "no log"):
            delmesh.Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2], [0, 1, 2]], context=context)

    def test_contexts_can_be_made_by_the_thousand(self):
        mesh = delmesh.Mesh(*grid(3, 3))
        for _ in range(2000):
            delmesh.measure(mesh, context=delmesh.Context())


if __name__ == "__main__":
    support.main()
