# SPDX-License-Identifier: Apache-2.0
"""The package as its users meet it: the short calls, the code in the documentation, the examples, bars, Ctrl-C, no growth."""
import contextlib
import gc
import importlib.util
import io
import os
import pathlib
import re
import signal
import subprocess
import sys
import tempfile
import threading
import time
import typing
import unittest

import support
from support import ROOT, cylinder, grid, np

import delmesh
from delmesh import _capi, core


class ShortCalls(unittest.TestCase):
    def setUp(self):
        self.vertices, self.faces = grid(20, 15)

    def test_remesh(self):
        r = delmesh.remesh(self.vertices, self.faces, mode="preserve")
        self.assertIsInstance(r, delmesh.Result)
        self.assertTrue(r.report.certified)
        mesh, report = r
        self.assertIs(report, r.report)
        np.testing.assert_array_equal(r.vertices, mesh.positions)
        np.testing.assert_array_equal(mesh.vertices, mesh.positions)
        np.testing.assert_array_equal(r.faces, mesh.faces)
        self.assertEqual(r.faces.dtype, np.int32)

    def test_a_mesh_can_be_given_in_many_ways(self):
        class Foreign:  # like trimesh.Trimesh
            vertices, faces = self.vertices, self.faces

        expected = delmesh.remesh(self.vertices, self.faces, mode="flip").faces
        for given in ((self.vertices.tolist(), self.faces.tolist()), ((self.vertices, self.faces),), ([self.vertices, self.faces],),
                      (delmesh.Mesh(self.vertices, self.faces),), (Foreign(),)):
            np.testing.assert_array_equal(delmesh.remesh(*given, mode="flip").faces, expected)
        again = delmesh.remesh(delmesh.remesh(self.vertices, self.faces, mode="flip"), mode="flip")
        np.testing.assert_array_equal(again.faces, expected)

    def test_the_other_operations(self):
        v, f = self.vertices, self.faces
        result = delmesh.remesh(v, f)
        self.assertFalse(delmesh.certify(v, f).delaunay)
        self.assertTrue(delmesh.certify(result).delaunay)
        family = delmesh.lod_family(v, f, ratios=[0.5, 0.1])
        self.assertEqual([len(level.faces) <= share * len(f) for level, share in zip(family.levels, (0.5, 0.1))], [True, True])
        self.assertEqual([level.stopped_by for level in family.report.levels], ["target", "target"])
        self.assertEqual(delmesh.decimate(v, f, ratio=0.1).vertices.tobytes(),
                         delmesh.lod_family(v, f, ratios=[0.1]).levels[0].vertices.tobytes())
        self.assertEqual(delmesh.estimate_preserve(v, f).vertices_in, len(v))
        both = delmesh.measure((v, f), result)
        self.assertEqual(both.a, delmesh.measure(v, f))
        self.assertEqual(both.b, delmesh.measure(result))
        self.assertEqual(both.distance.hausdorff_sampled, delmesh.distance((v, f), result).hausdorff_sampled)

    def test_second_arguments_that_are_no_faces(self):
        mesh = delmesh.Mesh(self.vertices, self.faces)
        for call in (lambda: delmesh.remesh(mesh, "flip"), lambda: delmesh.certify(mesh, self.faces),
                     lambda: delmesh.lod_family(mesh, ["full"], ratios=[1])):
            with self.assertRaisesRegex(TypeError, "the faces of the vertices in the first, which was a Mesh"):
                call()
        for options in ({}, {"ratios": [1], "targets": ["full"]}):
            with self.assertRaisesRegex(delmesh.InvalidArgument, "Exactly one of targets, ratios must be given"):
                delmesh.lod_family(mesh, **options)

    def test_the_typed_options_are_those_of_the_library(self):
        for options, struct in ((delmesh.RemeshOptions, _capi.delmesh_remesh_options),
                                (delmesh.DecimateOptions, _capi.delmesh_decimate_options),
                                (delmesh.DistanceOptions, _capi.delmesh_distance_options)):
            self.assertEqual(list(options.__annotations__), core._public(struct))
        for choice, prefix in ((core.Mode, "mode"), (core.Boundary, "boundary")):
            self.assertEqual(list(typing.get_args(choice)), list(core._CHOICES[prefix]))
        self.assertTrue((pathlib.Path(delmesh.__file__).parent / "py.typed").is_file())

    def test_everything_public_is_documented(self):
        for name in delmesh.__all__:
            item = getattr(delmesh, name)
            if isinstance(item, type) and issubclass(item, Exception):
                self.assertTrue(item.status or item.__doc__, name)
            elif callable(item):
                self.assertTrue(item.__doc__, name)


class Documentation(unittest.TestCase):
    def test_the_examples_in_the_readmes_run(self):
        for path in (ROOT / "README.md", ROOT / "bindings" / "python" / "README.md"):
            blocks = re.findall(r"^```python\n(.*?)^```", path.read_text(encoding="utf-8"), re.M | re.S)
            self.assertTrue(blocks, path)
            space = {"__name__": "readme"}
            with contextlib.redirect_stdout(io.StringIO()):
                for block in blocks:  # a later one may go on with what an earlier one made
                    exec(compile(block, str(path), "exec"), space)

    def run_example(self, name, module):
        if not importlib.util.find_spec(module):
            self.skipTest(f"{module} is not installed")
        with tempfile.TemporaryDirectory() as folder:
            points, faces = grid(12, 12)
            source, target = pathlib.Path(folder, "in.obj"), pathlib.Path(folder, "out.ply")
            source.write_text("".join(f"v {x!r} {y!r} {z!r}\n" for x, y, z in points.tolist()) +
                              "".join(f"f {a} {b} {c}\n" for a, b, c in (faces + 1).tolist()))
            done = subprocess.run([sys.executable, ROOT / "examples" / "python" / name, source, target], capture_output=True,
                                  text=True, timeout=120)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertGreater(target.stat().st_size, 1000)

    def test_trimesh_example(self):
        self.run_example("with_trimesh.py", "trimesh")

    def test_meshio_example(self):
        self.run_example("with_meshio.py", "meshio")

    def test_texture_example(self):
        points, quads, uvs, _ = cylinder(24, 9, 0.9, 0.03)
        with tempfile.TemporaryDirectory() as folder:
            source, target = pathlib.Path(folder, "in.obj"), pathlib.Path(folder, "out.obj")
            lines = ["mtllib in.mtl"] + [f"v {x!r} {y!r} {z!r}" for x, y, z in points.tolist()]
            lines += [f"vt {u!r} {v!r}" for u, v in uvs.tolist()]
            for i, quad in enumerate(quads.tolist()):
                lines += [f"usemtl {'ab'[i % 2]}"] if i > 100 and i % 24 == 0 else []
                lines.append("f " + " ".join(f"{v + 1}/{4 * i + k + 1}" for k, v in enumerate(quad)))
            lines[-1] = "f " + " ".join(str(v + 1) for v in quads[-1])  # without UVs
            source.write_text("\n".join(lines))
            done = subprocess.run([sys.executable, ROOT / "examples" / "python" / "texture.py", source, target, "0.5"],
                                  capture_output=True, text=True, timeout=120)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertRegex(done.stdout, "^[0-9]+ edges are seams of the texture, 24 lie between materials\n")
            for i, most in ((0, 10**6), (1, quads.size // 4)):
                text = pathlib.Path(folder, f"out.{i}.obj").read_text().splitlines()
                self.assertEqual(text[0], "mtllib in.mtl")
                self.assertEqual([line for line in text if line.startswith("usemtl")], ["usemtl a"])
                faces = [line for line in text if line.startswith("f ")]
                self.assertTrue(0 < len(faces) <= most)
                bare = [line for line in faces if "/" not in line]
                self.assertTrue(0 < len(bare) < 20)  # what that quad became
                count = sum(line.startswith("vt ") for line in text)
                self.assertLessEqual(max(int(corner.split("/")[1]) for line in faces for corner in line.split()[1:] if "/" in corner),
                                     count)


class Bar:
    """What of tqdm is used."""
    made = []

    def __init__(self, total=None, **_):
        self.total, self.n, self.stages, self.closed = total, 0, [], False
        Bar.made.append(self)

    def update(self, more):
        self.n += more

    def set_description_str(self, text, refresh=True):
        self.stages.append(text)

    def close(self):
        self.closed = True


class Bars(unittest.TestCase):
    def test_a_bar_and_its_class(self):
        mesh = delmesh.Mesh(*grid(30, 30))
        mine = Bar(total=1000)
        delmesh.remesh(mesh, progress=mine)
        self.assertAlmostEqual(mine.n, 1000)
        self.assertTrue(mine.stages and not mine.closed)
        delmesh.certify(mesh, progress=mine)  # the same bar again
        self.assertAlmostEqual(mine.n, 1000)
        untold = Bar()
        delmesh.remesh(mesh, progress=untold)
        self.assertAlmostEqual(untold.n, untold.total)
        delmesh.remesh(mesh, progress=Bar)
        self.assertTrue(Bar.made[-1].closed)
        self.assertAlmostEqual(Bar.made[-1].n, Bar.made[-1].total)

    def test_a_bar_that_fails_is_closed(self):
        class Broken(Bar):
            def update(self, more):
                raise OSError("no terminal")

        with self.assertRaisesRegex(OSError, "no terminal"):
            delmesh.remesh(*grid(30, 30), progress=Broken)
        self.assertTrue(Bar.made[-1].closed)

    def test_tqdm_itself(self):
        try:
            import tqdm
        except ImportError:
            self.skipTest("tqdm is not installed")
        screen = io.StringIO()
        with tqdm.tqdm(file=screen, total=100) as bar:
            delmesh.remesh(*grid(30, 30), progress=bar)
        self.assertAlmostEqual(bar.n, 100)
        self.assertIn("100%", screen.getvalue())


class Interrupt(unittest.TestCase):
    @unittest.skipIf(os.name == "nt", "signals cannot be sent to oneself")
    def test_control_c(self):
        self.addCleanup(signal.signal, signal.SIGINT, signal.getsignal(signal.SIGINT))
        signal.signal(signal.SIGINT, signal.default_int_handler)  # shells have jobs in the background ignore it
        big = delmesh.Mesh(*grid(700, 700))
        began = time.perf_counter()
        delmesh.remesh(big)
        whole = time.perf_counter() - began
        context = delmesh.Context()
        before = context.memory()[0]
        threading.Timer(whole / 10, os.kill, (os.getpid(), signal.SIGINT)).start()
        began = time.perf_counter()
        with self.assertRaises(KeyboardInterrupt):
            delmesh.remesh(big, context=context)
            time.sleep(60)  # a signal that comes too late
        self.assertLess(time.perf_counter() - began, whole * 0.8)
        self.assertEqual(context.memory()[0], before)
        self.assertTrue(delmesh.remesh(*grid(9, 9), context=context).report.certified)


class Growth(unittest.TestCase):
    """Nothing is left behind, in the library's memory, the process's or among Python's objects."""

    def test_an_exception_in_progress_leaves_nothing(self):
        context = delmesh.Context()
        mesh = delmesh.Mesh(*grid(40, 40), context=context)
        before = context.memory()[0]
        for moment in range(1, 12):
            calls = []

            def progress(*_):
                calls.append(1)
                if len(calls) == moment:
                    raise LookupError("enough")

            try:
                delmesh.remesh(mesh, progress=progress, context=context)
            except LookupError:
                pass
            self.assertEqual(context.memory()[0], before)

    @unittest.skipUnless(os.path.exists("/proc/self/statm"), "the resident size is not told here")
    def test_a_thousand_cycles(self):
        points, faces = grid(20, 20)

        def resident():
            gc.collect()
            return int(pathlib.Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")

        def cycle():
            context = delmesh.Context(threads=1)
            mesh = delmesh.Mesh(points, faces, context=context)
            result = delmesh.remesh(mesh, mode="flip", context=context)
            self.assertTrue(delmesh.certify(result, context=context).delaunay)
            level = delmesh.decimate(result, ratio=0.5, context=context, progress=lambda *_: None)
            layered = delmesh.decimate(points, faces, ratio=0.5, context=context, layers={"uv": points[faces][..., :2]})
            return result.vertices, level.faces, layered.layers, layered.corner_map

        for _ in range(200):  # what is made once, and what the allocator keeps
            cycle()
        objects, size = len(gc.get_objects()), resident()
        for _ in range(1000):
            cycle()
        self.assertLess(resident() - size, 1 << 20)
        self.assertLess(len(gc.get_objects()) - objects, 100)


if __name__ == "__main__":
    support.main()
