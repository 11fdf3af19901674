# SPDX-License-Identifier: Apache-2.0
"""The command from outside, as a user has it: exit statuses, JSON, files, locale, interrupts. Needs nothing but the command:
    test_command.py DELMESH [--no-limits]
"""
import errno
import gzip
import json
import math
import os
import random
import resource
import signal
import struct
import subprocess
import sys
import time
import unittest
from pathlib import Path

from support import FolderTest

DELMESH = ""
LIMITS = True

SQUARE = "v 0 0 0\nv 4 0 0\nv 2 1 0\nv 2 -1 0\n"  # two obtuse triangles over one edge
OBTUSE = SQUARE + "f 1 2 3\nf 2 1 4\n"
DELAUNAY = "v 0 0 0\nv 1 0 0\nv 0.5 0.9 0\nf 1 2 3\n"


def cube(scale=1.0):
    """A closed cube of quads, as OBJ."""
    points = [(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)]
    faces = ["1 2 4 3", "5 7 8 6", "1 5 6 2", "3 4 8 7", "1 3 7 5", "2 6 8 4"]
    return "".join(f"v {scale * x!r} {scale * y!r} {scale * z!r}\n" for x, y, z in points) + "".join(f"f {f}\n" for f in faces)


def rough_grid(n, seed=1):
    """Heights at random over an n x n grid, as OBJ."""
    rand = random.Random(seed)
    text = [f"v {i} {j} {rand.random() * 3:.6f}\n" for i in range(n) for j in range(n)]
    for i in range(n - 1):
        for j in range(n - 1):
            a = i * n + j + 1
            text.append(f"f {a} {a + n} {a + n + 1}\nf {a} {a + n + 1} {a + 1}\n")
    return "".join(text)


def needle_sheet(n=12, m=80, seed=3):
    """Quads twenty times as long as wide, cut in two, their corners a little off the plane, as OBJ."""
    rand = random.Random(seed)
    text = []
    for i in range(n):
        for j in range(m):
            text.append(f"v {i} {0.05 * j + 0.002 * rand.uniform(-1, 1):.6f} {0.002 * rand.uniform(-1, 1):.6f}\n")
    for i in range(n - 1):
        for j in range(m - 1):
            a = i * m + j + 1
            text.append(f"f {a} {a + m} {a + m + 1}\nf {a} {a + m + 1} {a + 1}\n")
    return "".join(text)


def torus(around, across):
    """A closed surface of triangles, as OBJ."""
    text = []
    for i in range(around):
        for j in range(across):
            u, v = 2 * math.pi * i / around, 2 * math.pi * (j / across + 0.1 * math.sin(4 * math.pi * i / around))
            r = 2 + 0.7 * math.cos(v)
            text.append(f"v {r * math.cos(u)!r} {r * math.sin(u)!r} {0.7 * math.sin(v)!r}\n")
    for i in range(around):
        for j in range(across):
            a, b = i * across + j + 1, (i + 1) % around * across + j + 1
            c, d = (i + 1) % around * across + (j + 1) % across + 1, i * across + (j + 1) % across + 1
            text.append(f"f {a} {b} {c}\nf {a} {c} {d}\n")
    return "".join(text)


def read_numbers(path):
    """Vertices of an OBJ, OFF, ascii or binary PLY file of the command, as Python floats; an own reader, independent of it."""
    data = path.read_bytes()
    if path.suffix == ".obj":
        return [tuple(map(float, line.split()[1:4])) for line in data.decode().splitlines() if line.startswith("v ")]
    if path.suffix == ".off":
        lines = data.decode().splitlines()
        return [tuple(map(float, line.split())) for line in lines[2:2 + int(lines[1].split()[0])]]
    header, _, body = data.partition(b"end_header\n")
    words = header.decode().split()
    count, form = int(words[words.index("vertex") + 1]), words[words.index("format") + 1]
    if form == "ascii":
        return [tuple(map(float, line.split())) for line in body.decode().splitlines()[:count]]
    code = ("<" if "little" in form else ">") + ("3f" if "float" in words else "3d")
    return [struct.unpack_from(code, body, i * struct.calcsize(code)) for i in range(count)]


class CommandTest(FolderTest):
    def run_command(self, *words, status=0, env=None, **named):
        done = subprocess.run([DELMESH, *map(str, words)], capture_output=True, timeout=60, env=env, **named)
        out, err = done.stdout.decode(), done.stderr.decode(errors="replace")
        self.assertEqual(done.returncode, status, f"{words}\n{out}{err}")
        return out, err

    def json_of(self, *words, status=0, **named):
        out, err = self.run_command(*words, "--json", status=status, **named)
        if status != 2:
            self.assertEqual(err, "")
        return json.loads(out)

    def error(self, *words):
        """The sentence of a run that must fail: the same on standard error and in the JSON."""
        out, err = self.run_command(*words, status=2)
        self.assertEqual(out, "")
        self.assertEqual(err.count("\n"), 1, err)
        self.assertTrue(err.startswith("delmesh: "), err)
        sentence = err[len("delmesh: "):-1]
        report = self.json_of(*words, status=2)
        self.assertEqual(report["error"], sentence)
        self.assertRegex(report["status"], "^(USAGE|READ|WRITE|DELMESH)_ERROR")
        return sentence


class Basics(CommandTest):
    def test_help_and_version(self):
        out, _ = self.run_command("--help")
        for word in ("info", "certify", "remesh", "lod", "measure"):
            self.assertIn(f"delmesh {word}", out)
            self.assertIn("--json", self.run_command(word, "--help")[0])
        self.assertRegex(self.run_command("--version")[0], r"^delmesh \d+\.\d+\.\d+\n$")

    def test_usage_errors(self):
        self.assertIn("no command 'frobnicate'", self.run_command("frobnicate", status=2)[1])
        self.run_command(status=2)
        mesh = self.file("a.obj", DELAUNAY)
        self.assertEqual(self.error("info"), "FILE is missing")
        self.assertEqual(self.error("info", mesh, mesh), f"'{mesh}' is one argument too many")
        self.assertEqual(self.error("certify", mesh, "--nope"), "there is no option '--nope'")
        self.assertEqual(self.error("remesh", mesh, "x.ply", "--mode", "melt"), "--mode takes preserve|flip|feature, not 'melt'")
        self.assertEqual(self.error("remesh", mesh, "x.ply", "--feature-angle", "1,5"),
                         "--feature-angle takes a number from 0 to 180, not '1,5'")
        self.assertIn("the name must end in", self.error("remesh", mesh, self.folder / "x.xyz"))
        self.assertIn("could not be opened", self.error("info", self.folder / "none.obj"))
        self.assertEqual(sorted(p.name for p in self.folder.iterdir()), ["a.obj"])

    def test_closed_output(self):
        mesh = self.file("a.obj", DELAUNAY)
        if os.path.exists("/dev/full"):
            with open("/dev/full", "w") as full:
                done = subprocess.run([DELMESH, "info", mesh], stdout=full, stderr=subprocess.PIPE)
            self.assertEqual(done.returncode, 2)
            self.assertIn(b"standard output could not be written", done.stderr)
        reader, writer = os.pipe()
        os.close(reader)
        done = subprocess.run([DELMESH, "info", mesh], stdout=writer, stderr=subprocess.PIPE)
        os.close(writer)
        self.assertEqual(done.returncode, 2)

    def test_odd_names(self):
        for name in ("-dash.obj", "sp ace\n\x1b[31m.obj", "quote\".obj", "é.obj"):
            self.file(name, DELAUNAY)
            words = ("--json", "--", name) if name.startswith("-") else ("--json", name)
            out, _ = self.run_command("info", *words, cwd=self.folder)
            self.assertEqual(json.loads(out)["file"], name)
        raw = os.fsencode(str(self.folder)) + b"/\xff.obj"
        with open(raw, "w") as out:
            out.write("v 0\n")
        done = subprocess.run([os.fsencode(DELMESH), b"info", raw, b"--json"], capture_output=True)
        self.assertEqual(done.returncode, 2)
        self.assertIn("\ufffd.obj: line 1:", json.loads(done.stdout)["error"])


class InfoAndCertify(CommandTest):
    def test_statuses(self):
        good, bad = self.file("good.obj", DELAUNAY), self.file("bad.obj", OBTUSE)
        self.assertTrue(self.json_of("certify", good)["delaunay"])
        self.assertFalse(self.json_of("certify", bad, status=1)["delaunay"])
        self.assertFalse(self.json_of("info", bad)["delaunay"])
        for word in ("info", "certify"):
            self.assertEqual(self.run_command(word, good, "--quiet"), ("", ""))
        self.assertRegex(self.run_command("certify", bad, status=1)[0], r"Delaunay +no\n")

    def test_counts(self):
        got = self.json_of("info", self.file("cube.obj", cube(2)))
        wanted = {"vertices": 8, "faces": 12, "edges": 18, "boundary_edges": 0, "components": 1, "boundary_loops": 0,
                  "euler_characteristic": 2, "zero_area_faces": 0, "nld_interior": 0, "nld_boundary": 0, "delaunay": True,
                  "polygons": 6, "isolated_vertices": 0, "largest_coordinate": 2, "precision": "f64", "format": "OBJ", "area": 24,
                  "min_angle": 45, "max_angle": 90}
        for key, value in wanted.items():
            self.assertAlmostEqual(got[key], value, msg=key) if isinstance(value, int) else self.assertEqual(got[key], value, key)
        self.assertEqual(sum(got["angle_histogram"]), 36)
        self.assertEqual(set(got["repairs"].values()), {0})

    def test_estimate(self):
        mesh, out = self.file("needles.obj", needle_sheet()), self.folder / "out.ply"
        for words in ([], ["--tolerance", "0"], ["--tolerance", "0.1%"], ["--precision", "f64"], ["--boundary", "ignore"],
                      ["--effort", "0"]):
            got = self.json_of("info", mesh, *words)["preserve_estimate"]
            true = self.json_of("remesh", mesh, out, *words)
            self.assertEqual((got["status"], got["exact"]), ("DELMESH_OK", True))
            self.assertEqual((got["vertices_out"], got["nld_edges"]), (true["vertices_out"], true["nld_in"]), words)
            self.assertAlmostEqual(got["growth"], true["vertices_out"] / true["vertices_in"])
            if got["growth"] > 4:
                tamed = self.json_of("remesh", mesh, out, *words, *got["tamed_by"].split())
                self.assertAlmostEqual(got["tamed_growth"], tamed["vertices_out"] / tamed["vertices_in"])
                self.assertLess(got["tamed_growth"], 4)
            else:
                self.assertNotIn("tamed_by", got)
        self.assertGreater(self.json_of("info", mesh)["preserve_estimate"]["growth"], 4)
        words = r"preserve .* [5-9]\.\d times as large; with --tolerance 0\.\d+%, [12]\.\d times"
        self.assertRegex(self.run_command("info", mesh)[0], words)
        words = r"most new vertices: beside small angles \(\d+ of \d+\); on the edge \d+-"
        self.assertRegex(self.run_command("remesh", mesh, out)[0], words)
        self.assertNotIn("most new", self.run_command("remesh", mesh, out, "--tolerance", "0.1%")[0])
        self.assertNotIn("preserve_estimate", self.json_of("info", mesh, "--no-estimate"))
        self.assertNotIn("preserve", self.run_command("info", mesh, "--no-estimate")[0])
        self.assertIn("--tolerance", self.error("certify", mesh, "--tolerance", "0"))  # not its business

    def test_estimate_of_what_cannot_be_remeshed(self):
        flat = self.file("flat.obj", "v 0 0 0\nv 1 1 1\nv 2 2 2\nf 1 2 3\n")
        got = self.json_of("info", flat)["preserve_estimate"]
        self.assertNotEqual(got["status"], "DELMESH_OK")
        self.assertTrue(got["error"])
        self.assertIn("preserve would not end well", self.run_command("info", flat)[0])

    def test_where_the_vertices_went(self):
        got = self.json_of("remesh", self.file("grid.obj", rough_grid(30)), self.folder / "out.ply")
        self.assertEqual(sum(got["splits_where"].values()), got["splits"])
        self.assertEqual(got["splits_where"]["boundary"], got["boundary_splits"])
        self.assertGreater(got["worst_edge_splits"], 0)
        self.assertGreaterEqual(got["worst_face_splits"], got["worst_edge_splits"])
        self.assertEqual(len(got["worst_edge"]), 2)
        self.assertNotIn("worst_edge", self.json_of("remesh", self.file("ok.obj", DELAUNAY), self.folder / "out.ply"))

    def test_list(self):
        bad = self.file("bad.obj", OBTUSE)
        got = self.json_of("certify", bad, "--list", status=1)
        self.assertEqual((got["nld_interior"], got["nld_boundary"]), (1, 0))
        self.assertEqual([sorted(edge) for edge in got["edges"]], [[0, 1]])
        self.assertEqual(got["zero_area_face_list"], [])
        self.assertIn("edge ", self.run_command("certify", bad, "--list", status=1)[0])

        # A boundary edge counts unless it is ignored; face 1 has no area.
        flat = self.file("flat.obj", "v 0 0 0\nv 4 0 0\nv 2 0.5 0\nv 9 9 9\nv 10 10 10\nv 11 11 11\nf 1 2 3\nf 4 5 6\n")
        got = self.json_of("certify", flat, "--list", status=1)
        self.assertEqual((got["nld_interior"], got["zero_area_faces"], got["zero_area_face_list"]), (0, 1, [1]))
        self.assertIn([0, 1], [sorted(edge) for edge in got["edges"]])
        self.assertEqual(len(got["edges"]), got["nld_boundary"])
        got = self.json_of("certify", flat, "--list", "--boundary", "ignore", status=1)
        self.assertEqual((got["edges"], got["zero_area_faces"]), ([], 1))

        # Three faces on one edge: it is cut, the copies go by the file's vertices.
        book = self.file("book.obj", "v 0 0 0\nv 4 0 0\nv 2 1 0\nv 2 -1 0\nv 2 0 1\nf 1 2 3\nf 1 2 4\nf 1 2 5\n")
        got = self.json_of("certify", book, "--list", status=1)
        self.assertTrue(got["edges"])
        for edge in got["edges"]:
            self.assertEqual(sorted(edge), [0, 1])

    def test_repairs(self):
        text = SQUARE + "v 0 0 0\nf 1 2 3\nf 1 2 3\nf 1 1 2\nf 1 2 4\n"
        got = self.json_of("info", self.file("a.obj", text))["repairs"]
        self.assertEqual((got["duplicate_faces"], got["degenerate_faces"], got["reoriented_faces"]), (1, 1, 1))
        self.assertEqual(self.json_of("info", self.file("b.obj", text), "--weld", "exact")["repairs"]["welded_vertices"], 1)
        self.assertIn("b.obj: ", self.error("info", self.folder / "b.obj", "--strict"))

    def test_stl_points_are_vertices(self):
        self.run_command("remesh", self.file("cube.obj", cube()), self.folder / "cube.stl", "--quiet")
        got = self.json_of("info", self.folder / "cube.stl")
        self.assertEqual((got["vertices"], got["edges"], got["boundary_edges"]), (8, 18, 0))
        self.assertEqual(got["repairs"]["welded_vertices"], 28)
        got = self.json_of("info", self.folder / "cube.stl", "--weld", "none")
        self.assertEqual((got["vertices"], got["edges"], got["boundary_edges"]), (36, 36, 36))


class Remesh(CommandTest):
    REPORT_KEYS = {"vertices_in", "vertices_out", "faces_in", "faces_out", "flips", "flips_after", "splits", "unflippable",
                   "unflippable_kinds", "nld_in", "nld_out", "certified", "repairs", "seconds", "peak_bytes", "mode", "precision",
                   "input", "output", "status"}

    def test_report(self):
        source, report = self.file("bad.obj", OBTUSE), self.folder / "r.json"
        for mode in ("preserve", "flip", "feature"):
            out = self.folder / f"{mode}.ply"
            got = self.json_of("remesh", source, out, "--mode", mode, "--measure", "--report", report)
            self.assertLessEqual(self.REPORT_KEYS, got.keys())
            self.assertEqual(json.loads(report.read_text()), got)
            self.assertEqual((got["vertices_in"], got["faces_in"], got["nld_in"]), (4, 2, 1))
            self.assertEqual((got["flips"], got["splits"], got["nld_out"], got["certified"]), (1, 0, 0, True))
            self.assertEqual((got["mode"], got["precision"], got["status"]), (mode, "f32", "DELMESH_OK"))
            self.assertEqual(got["unflippable_kinds"].keys(), {"2", "3", "4"})
            self.assertLessEqual({"total", "read", "create", "remesh", "write", "measure"}, got["seconds"].keys())
            self.assertGreater(got["peak_bytes"], 0)
            self.assertLessEqual({"hausdorff_sampled", "hausdorff_bound", "rms", "diagonal"}, got["deviation"].keys())
            self.assertEqual(got["deviation"]["diagonal"], math.sqrt(20))
            self.assertLess(got["deviation"]["hausdorff_sampled"], 1e-12)
            self.assertLess(got["quality"]["before"]["min_angle"], got["quality"]["after"]["min_angle"])
            self.assertTrue(self.json_of("certify", out)["delaunay"])
        self.assertEqual(self.run_command("remesh", source, out, "--quiet"), ("", ""))
        self.assertIn("certified", self.run_command("remesh", source, out)[0])

    def test_input_vertices_stay(self):
        source = self.file("grid.obj", rough_grid(12))
        before = read_numbers(source)
        for precision, number in (("f32", lambda x: struct.unpack("f", struct.pack("f", x))[0]), ("f64", float)):
            wanted = [tuple(map(number, p)) for p in before]
            for extension, options in (("obj", ()), ("off", ()), ("ply", ()), ("ply", ("--ascii",)),
                                       ("ply", ("--encoding", "big"))):
                out = self.folder / f"out.{extension}"
                got = self.json_of("remesh", source, out, "--precision", precision, *options)
                self.assertGreater(got["splits"], 0)
                numbers = read_numbers(out)
                self.assertEqual(len(numbers), got["vertices_out"])
                self.assertEqual(numbers[:len(wanted)], wanted)
                self.assertTrue(self.json_of("certify", out)["delaunay"])
                # The same numbers again from the file: nothing is left to do, and nothing changes.
                again = self.folder / f"again.{extension}"
                got = self.json_of("remesh", out, again, "--precision", precision, *options)
                self.assertEqual((got["flips"], got["splits"], got["nld_in"]), (0, 0, 0))
                self.assertEqual(again.read_bytes(), out.read_bytes())

    def test_stl(self):
        source = self.file("cube.obj", cube())
        out = self.folder / "out.stl"
        self.assertIn("binary STL holds float32 only", self.error("remesh", source, out, "--precision", "f64"))
        self.assertFalse(out.exists())
        self.run_command("remesh", source, out, "--quiet")
        self.assertEqual(out.stat().st_size, 84 + 50 * 12)
        self.run_command("remesh", source, out, "--ascii", "--precision", "f64", "--quiet")
        self.assertTrue(out.read_bytes().startswith(b"solid"))
        self.assertTrue(self.json_of("certify", out)["delaunay"])

    def test_options_reach_the_library(self):
        grid = self.file("grid.obj", rough_grid(10))
        out = self.folder / "out.ply"
        base = self.json_of("remesh", grid, out)
        self.assertNotEqual(self.json_of("remesh", grid, out, "--placement", "shells")["splits"], base["splits"])
        self.assertLess(self.json_of("remesh", grid, out, "--boundary", "ignore")["splits"], base["splits"])
        loose = self.json_of("remesh", grid, out, "--tolerance", "50%")
        self.assertLess(loose["splits"], base["splits"])
        flip = self.json_of("remesh", grid, out, "--mode", "flip")
        turned = self.json_of("remesh", grid, out, "--mode", "flip", "--max-normal-turn", "5")
        self.assertGreater(turned["splits"], flip["splits"])
        sharp = self.json_of("remesh", grid, out, "--mode", "feature", "--feature-angle", "1")
        self.assertGreater(sharp["splits"], flip["splits"])
        got = self.json_of("remesh", grid, out, "--max-vertices", "101", status=2)
        self.assertEqual(got["status"], "DELMESH_ERROR_VERTEX_LIMIT")
        self.assertFalse(got["certified"])
        apart = self.file("apart.obj", cube() + "v 9 9 9\n")
        self.assertEqual(self.json_of("remesh", apart, out)["vertices_out"], 9)
        self.assertEqual(self.json_of("remesh", apart, out, "--compact")["vertices_out"], 8)

    def test_threads_make_no_difference(self):
        grid = self.file("grid.obj", rough_grid(40))
        results = set()
        for threads in (1, 2, 4):
            out = self.folder / f"{threads}.ply"
            self.run_command("remesh", grid, out, "--threads", threads, "--quiet")
            results.add(out.read_bytes())
        self.assertEqual(len(results), 1)

    def test_input_may_be_output(self):
        path = self.file("a.obj", OBTUSE)
        self.run_command("remesh", path, path, "--quiet")
        self.assertTrue(self.json_of("certify", path)["delaunay"])
        self.assertEqual([p.name for p in self.folder.iterdir()], ["a.obj"])

    def test_no_surface(self):
        out = self.file("out.obj", "old")
        empty = self.file("empty.off", "OFF\n0 0 0\n")
        self.assertEqual(self.json_of("info", empty)["faces"], 0)
        self.assertEqual(self.json_of("remesh", empty, out, status=2)["status"], "DELMESH_ERROR_NO_SURFACE")
        self.assertEqual(out.read_text(), "old")

    def test_error_report(self):
        report = self.folder / "r.json"
        self.run_command("remesh", self.folder / "none.obj", self.folder / "out.ply", "--report", report, status=2)
        self.assertEqual(json.loads(report.read_text())["status"], "READ_ERROR")

    def test_report_that_cannot_be_saved(self):
        """The meshes are shorter than the limit of a file's size, their report is longer."""
        for words in (["remesh", "out.ply"], ["lod", "out", "--triangles", "2"]):
            mesh, report = self.file("mesh.obj", OBTUSE), self.folder / "r.json"
            done = subprocess.run([DELMESH, words[0], mesh, self.folder / words[1], *words[2:], "--json", "--report", report],
                                  capture_output=True, text=True, timeout=60,
                                  preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (900, 900)))
            self.assertEqual(done.returncode, 2)
            failure = json.loads(done.stdout)
            self.assertEqual((failure.keys(), failure["status"]), ({"error", "status"}, "WRITE_ERROR"))
            self.assertIn("r.json", failure["error"])
            self.assertIn(failure["error"], done.stderr)
            self.assertFalse(report.exists())


class Lod(CommandTest):
    def names(self):
        return sorted(p.name for p in self.folder.iterdir())

    def test_a_family(self):
        mesh, report_file = self.file("torus.obj", torus(40, 24)), self.folder / "r.json"
        out, err = self.run_command("lod", mesh, self.folder / "t", "--vertices", "500,200,60", "--report", report_file)
        self.assertEqual(err, "")
        self.assertIn("stopped by", out)
        self.assertEqual(self.names(), ["r.json", "t_LOD0.ply", "t_LOD1.ply", "t_LOD2.ply", "t_LOD3.ply", "torus.obj"])
        report = json.loads(report_file.read_text())
        self.assertEqual((report["status"], report["vertices_in"], report["faces_in"]), ("DELMESH_OK", 960, 1920))
        self.assertEqual([level["vertices"] for level in report["levels"]], [960, 500, 200, 60])
        self.assertEqual([level["target"].get("value") for level in report["levels"]], [None, 500, 200, 60])
        self.assertEqual(report["collapses"], 900)
        for i, level in enumerate(report["levels"]):
            path = self.folder / f"t_LOD{i}.ply"
            self.assertEqual(level["file"], str(path))
            self.assertIs(level["certified"], True)
            self.assertEqual((level["stopped_by"], level["reached"]), ("target", True))
            counts = self.json_of("certify", path)
            self.assertEqual((counts["delaunay"], counts["nld_interior"]), (True, 0))
            info = self.json_of("info", path, "--no-estimate")
            self.assertEqual((info["vertices"], info["faces"]), (level["vertices"], level["faces"]))
            self.assertEqual((info["euler_characteristic"], info["components"]), (0, 1))
            self.assertAlmostEqual(info["min_angle"], level["angles"]["min_angle"], places=9)
            measured = self.json_of("measure", mesh, path)["deviation"]
            for key in ("hausdorff_sampled", "hausdorff_bound", "rms", "diagonal"):
                self.assertEqual(measured[key], level["deviation"][key])
            self.assertGreaterEqual(level["seconds"], 0)
        for key in ("total", "prepare", "decimate", "relax", "export", "measure"):
            self.assertGreaterEqual(report["seconds"][key], 0)
        rms = [level["deviation"]["rms"] for level in report["levels"]]
        self.assertEqual(rms, sorted(rms))
        # The report on standard output is the same but for the seconds.
        again = self.json_of("lod", mesh, self.folder / "t", "--vertices=500,200,60", "--threads=1", "--no-measure")
        self.assertEqual([level["vertices"] for level in again["levels"]], [960, 500, 200, 60])
        self.assertNotIn("deviation", again["levels"][1])

    def test_all_kinds_of_targets_and_files(self):
        mesh = self.file("torus.obj", torus(30, 20))
        for words, check in ((("--triangles", "700,90"), lambda level: level["faces"] <= level["target"]["value"]),
                             (("--ratios", "0.5,0.1"), lambda level: level["faces"] <= 1200 * level["target"]["value"]),
                             (("--vertices", "400,400"), lambda level: level["vertices"] == 400)):
            for suffix in ("ply", "obj", "off", "stl", "stla"):
                prefix = self.folder / "x"
                report = self.json_of("lod", mesh, prefix, *words, "--suffix", suffix, "--no-measure")
                self.assertEqual([Path(level["file"]).name for level in report["levels"]], [f"x_LOD{i}.{suffix}" for i in range(3)])
                self.assertTrue(all(check(level) for level in report["levels"][1:]), report["levels"])
                for level in report["levels"]:
                    found = self.json_of("certify", level["file"])
                    self.assertTrue(found["delaunay"])
                    self.assertEqual(found.get("faces", level["faces"]), level["faces"])
        self.json_of("lod", mesh, self.folder / "y", "--vertices", "99", "--format", ".off", "--precision", "f64", "--quality",
                     "--mode", "feature", "--feature-angle", "80", "--collapse-placement", "paper", "--no-measure")
        self.assertEqual(len(read_numbers(self.folder / "y_LOD1.off")), 99)
        relaxed = self.json_of("lod", mesh, self.folder / "y", "--vertices", "99", "--quality=2", "--no-measure")
        self.assertEqual(relaxed["quality"], 2)

    def test_unreachable(self):
        """No error: the files are there, and what stopped it is said."""
        mesh = self.file("torus.obj", torus(20, 14))
        out, err = self.run_command("lod", mesh, self.folder / "t", "--vertices", "100,3")
        self.assertIn("topology", out)
        self.assertEqual(err.count("\n"), 1)
        self.assertRegex(err, "^delmesh: .*t_LOD2.ply: the target was not reached: further collapses would change the topology")
        report = self.json_of("lod", mesh, self.folder / "t", "--vertices", "100,3")
        self.assertEqual([level["reached"] for level in report["levels"]], [True, True, False])
        self.assertEqual(report["levels"][2]["stopped_by"], "topology")
        self.assertTrue(report["levels"][2]["certified"])
        self.assertEqual(len(read_numbers(self.folder / "t_LOD2.ply")), report["levels"][2]["vertices"])
        self.assertEqual(self.run_command("lod", mesh, self.folder / "t", "--vertices", "3", "--quiet"), ("", ""))

    def test_usage(self):
        mesh, prefix = self.file("torus.obj", torus(8, 6)), self.folder / "t"
        for words, sentence in (
                ((), "one of --vertices, --triangles, --ratios and --deviation is missing"),
                (("--vertices", "9", "--ratios", "0.5"), "--vertices and --ratios do not go together"),
                (("--vertices", "9,x"), "--vertices takes whole numbers, with commas between them, not '9,x'"),
                (("--vertices", "9,"), "--vertices takes whole numbers, with commas between them, not '9,'"),
                (("--vertices", ""), "--vertices takes whole numbers, with commas between them, not ''"),
                (("--vertices", "-9"), "--vertices takes whole numbers, with commas between them, not '-9'"),
                (("--triangles", "9.5"), "--triangles takes whole numbers, with commas between them, not '9.5'"),
                (("--triangles", "9,10"), "--triangles takes the finest level first, not '9,10'"),
                (("--ratios", "0.5,1.5"), "--ratios takes numbers from 0 to 1, with commas between them, not '0.5,1.5'"),
                (("--ratios", "0.5%"), "--ratios takes numbers from 0 to 1, with commas between them, not '0.5%'"),
                (("--deviation", "1%,0.5%"), "--deviation takes the finest level first, not '1%,0.5%'"),
                (("--deviation", "nan"),
                 "--deviation takes lengths or percents of the diagonal, with commas between them, not 'nan'"),
                (("--vertices", ",".join(["5"] * 64)), "--vertices takes at most 63 levels"),
                (("--vertices", "9", "--quality=many"), "--quality takes a whole number from 0 to 2147483647, not 'many'"),
                (("--vertices", "9", "--suffix", "gltf"), "--suffix takes ply|obj|off|stl|stla, not 'gltf'"),
                (("--vertices", "9", "--collapse-placement", "best"),
                 "--collapse-placement takes all|paper|endpoints, not 'best'")):
            self.assertEqual(self.error("lod", mesh, prefix, *words), sentence)
        self.assertIn("binary STL holds float32 only",
                      self.error("lod", mesh, prefix, "--vertices", "9", "--suffix", "stl", "--precision", "f64"))
        self.assertEqual(self.error("lod", mesh, "--vertices", "9"), "OUT_PREFIX is missing")
        self.assertIn("folder cannot be written", self.error("lod", mesh, self.folder / "none" / "t", "--vertices", "9"))
        self.assertRegex(self.error("lod", mesh, prefix, "--deviation", "1%,1e-9"), "'targets' 2, 1e-09, was finer than 1")
        self.assertEqual(self.names(), ["torus.obj"])

    def test_values_per_vertex_and_face(self):
        mesh, prefix = self.file("torus.obj", torus(30, 20)), self.folder / "t"
        points = read_numbers(mesh)
        words = ("lod", mesh, prefix, "--vertices", "150", "--no-measure")

        def right():
            return sum(p[0] > 0 for p in read_numbers(self.folder / "t_LOD1.ply"))

        self.json_of(*words)
        plain = right()
        density = self.file("density.txt", "# a comment\n\n" + "".join(f"{'100 #b' if p[0] > 0 else '1#a'}\n" for p in points))
        self.json_of(*words, "--density", density)
        self.assertGreater(right(), plain + 15)
        packed = self.folder / "density.gz"
        packed.write_bytes(gzip.compress(density.read_bytes()))
        self.json_of(*words, "--density", packed)
        self.assertGreater(right(), plain + 15)

        lock = self.file("lock.txt", "".join(f"{int(i % 10 == 0)}\n" for i in range(len(points))))
        self.json_of(*words, "--lock", lock)
        kept = set(read_numbers(self.folder / "t_LOD1.ply"))
        single = [struct.unpack("3f", struct.pack("3f", *p)) for p in points]
        self.assertLessEqual(set(single[::10]), kept)

        for option, text, sentence in (
                ("--density", "1\n0\n", "line 2: expected a number over 0, found '0'"),
                ("--density", "1\n1,5\n", "line 2: expected a number over 0, found '1,5'"),
                ("--density", "1\n1 2\n", "line 2: expected one number, found '2' too"),
                ("--density", "", "there is no number in it"),
                ("--density", "1\n" * 599, f"there are 599 numbers in it, and {mesh} has 600 vertices"),
                ("--lock", "1\nnan\n", "line 2: expected a number, found 'nan'"),
                ("--region", "1\n" * 600, f"there are 600 numbers in it, and {mesh} has 1200 faces")):
            wrong = self.file("wrong.txt", text)
            self.assertEqual(self.error(*words, option, wrong), f"{wrong}: {sentence}")
        self.assertIn("could not be opened", self.error(*words, "--density", self.folder / "none.txt"))

    def test_region(self):
        mesh, prefix = self.file("grid.obj", rough_grid(24)), self.folder / "t"
        count = 2 * 23 * 23
        region = self.file("region.txt", "".join(f"{int(i > count // 2)}\n" for i in range(count)))
        report = self.json_of("lod", mesh, prefix, "--ratios", "0.7", "--region", region, "--no-measure")
        level = report["levels"][1]
        self.assertEqual(level["certified"], "interior")
        self.assertGreater(level["nld_outside"], 0)
        self.assertEqual(len(level["nld_edges"]), level["nld_outside"])
        found = self.json_of("certify", level["file"], "--list", status=1)
        self.assertEqual(sorted(map(sorted, found["edges"])), sorted(map(sorted, level["nld_edges"])))

    def test_files_appear_together(self):
        """A folder in the place of the last file: nothing is written, also not the first ones."""
        mesh = self.file("torus.obj", torus(8, 6))
        (self.folder / "t_LOD2.ply").mkdir()
        self.assertIn("is there already and is no file", self.error("lod", mesh, self.folder / "t", "--vertices", "20,15"))
        self.assertEqual(self.names(), ["t_LOD2.ply", "torus.obj"])
        (self.folder / "t_LOD2.ply").rmdir()
        self.file("t_LOD0.ply", "old")
        empty = self.file("empty.obj", "v 0 0 0\n")
        self.assertIn("no face", self.error("lod", empty, self.folder / "t", "--vertices", "20,15"))
        # No room for the first file of three.
        done = subprocess.run([DELMESH, "lod", mesh, self.folder / "t", "--vertices", "20,15"], capture_output=True, timeout=60,
                              preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (900, 900)))
        self.assertEqual(done.returncode, 2, done)
        self.assertIn(b"could not be written", done.stderr)
        self.assertEqual((self.folder / "t_LOD0.ply").read_text(), "old")
        self.assertEqual(self.names(), ["empty.obj", "t_LOD0.ply", "torus.obj"])

    def test_threads_make_no_difference(self):
        mesh = self.file("torus.obj", torus(60, 40))
        bytes_of = []
        for threads in (1, 2, 5):
            self.run_command("lod", mesh, self.folder / "t", "--ratios", "0.5,0.1", "--quality=2", "--threads", threads, "--quiet",
                             "--no-measure")
            bytes_of.append([(self.folder / f"t_LOD{i}.ply").read_bytes() for i in range(3)])
        self.assertEqual(bytes_of[0], bytes_of[1])
        self.assertEqual(bytes_of[0], bytes_of[2])


class Measure(CommandTest):
    def test_known_distance(self):
        low = self.file("low.obj", "v 0 0 0\nv 4 0 0\nv 0 3 0\nf 1 2 3\n")
        high = self.file("high.obj", "v 0 0 0.5\nv 4 0 0.5\nv 0 3 0.5\nf 1 2 3\n")
        got = self.json_of("measure", low, high)
        deviation = got["deviation"]
        self.assertEqual((deviation["hausdorff_sampled"], deviation["diagonal"]), (0.5, 5))
        self.assertAlmostEqual(deviation["rms"], 0.5)
        self.assertTrue(0.5 <= deviation["hausdorff_bound"] <= 0.55 + 5e-6)
        self.assertAlmostEqual(got["a"]["max_angle"], 90)
        self.assertAlmostEqual(got["b"]["min_angle"], math.degrees(math.atan2(3, 4)))
        self.assertEqual(got["a"]["faces"], 1)
        self.assertNotIn("hausdorff_bound", self.json_of("measure", low, high, "--no-bound")["deviation"])
        self.assertIn("distance", self.run_command("measure", low, high)[0])
        self.assertEqual(self.run_command("measure", low, high, "--quiet"), ("", ""))

    def test_errors(self):
        mesh = self.file("a.obj", DELAUNAY)
        self.assertEqual(self.error("measure", mesh), "B is missing")
        self.assertIn("bad.obj: line 1:", self.error("measure", mesh, self.file("bad.obj", "v 0\n")))


class Files(CommandTest):
    def test_gzip(self):
        path = self.file("a.obj.gz", gzip.compress(OBTUSE.encode()))
        self.assertEqual(self.json_of("info", path)["faces"], 2)
        path = self.file("b.obj.gz", gzip.compress(OBTUSE.encode())[:-9])
        self.assertIn("of the gzip file", self.error("info", path))

    def test_pipe(self):
        fifo = self.folder / "pipe.obj"
        os.mkfifo(fifo)
        process = subprocess.Popen([DELMESH, "info", fifo, "--json"], stdout=subprocess.PIPE)
        fifo.write_text(OBTUSE)
        out, _ = process.communicate(timeout=30)
        self.assertEqual(json.loads(out)["faces"], 2)

    def test_comma_locale(self):
        names = subprocess.run(["locale", "-a"], capture_output=True, text=True).stdout.split()
        comma = [n for n in names if n.startswith(("de_", "fr_", "it_", "es_"))]
        env = dict(os.environ, LC_ALL=comma[0] if comma else "de_DE.UTF-8")
        source = self.file("a.obj", rough_grid(6))
        words = ("remesh", source, self.folder / "a.off", "--json", "--measure")
        plain = json.loads(self.run_command(*words)[0])
        bytes_plain = (self.folder / "a.off").read_bytes()
        other = json.loads(self.run_command(*words, env=env)[0])
        self.assertEqual((self.folder / "a.off").read_bytes(), bytes_plain)
        self.assertEqual(other["quality"], plain["quality"])

    def test_large_obj_is_read_fast(self):
        if not LIMITS:
            self.skipTest("timing means nothing under sanitizers")
        rand = random.Random(7)
        rows = "".join(f"v {rand.random():.17f} {-rand.random():.17f} {rand.random():.17f}\n" for _ in range(20000))
        text = rows * 14 + "".join(f"f {i} {i + 1} {i + 2}\n" for i in range(1, 60000, 3))
        path = self.file("large.obj", text)
        self.assertGreater(path.stat().st_size, 17e6)
        out = self.folder / "out.json"
        # Refused after the read: more vertices are there than may be.
        self.run_command("remesh", path, self.folder / "o.ply", "--max-vertices", "1", "--report", out, "--quiet", status=2)
        self.assertLess(json.loads(out.read_text())["seconds"]["read"], 1.0)


    def test_time_is_linear(self):
        """Files made to make readers slow: 3 MB each, far more than a quadratic step anywhere would bear."""
        n = 3 * 10 ** 6
        ply = b"ply\nformat %s 1.0\n"
        ascii_ply, binary_ply = ply % b"ascii", ply % b"binary_little_endian"
        cases = {
            "digits.obj": b"v " + b"1" * n + b" 0 0\n",
            "zeros.obj": b"v 0." + b"0" * n + b"1e%d 0 0\n" % n,
            "long_numbers.obj": (b"v 0." + b"37" * 400 + b" 1" + b"0" * 790 + b"1 .1e-300\n") * (n // 1600),
            "joined.obj": b"v 0 0 0\nf " + b"\\\n" * (n // 2),
            "carriages.obj": b"v 0 0 0\r" + b"x\r" * (n // 2),
            "no_corners.obj": b"v 0 0 0\n" + b"f\n" * (n // 2),
            "materials.obj": b"v 0 0 0\n" + b"".join(b"usemtl %d\nf 1 1 1\n" % i for i in range(n // 20)),
            "joined_name.obj": b"v 0 0 0\ng a" + b"\\\n" * (n // 2),
            "textures.obj": b"v 0 0 0\n" + b"vt 0\nvn\n" * (n // 16) + b"f" + b" 1/1/1" * (n // 12) + b"\n",
            "comments.off": b"OFF\n" + b"#\n" * (n // 2),
            "no_corners.off": b"OFF\n0 %d 0\n" % (n // 2) + b"0\n" * (n // 2),
            "elements.ply": ascii_ply + b"element a 1\n" * (n // 12) + b"end_header\n",
            "huge_elements.ply": ascii_ply + b"element a 4000000000000\n" * (n // 24) + b"end_header\n",
            "properties.ply": ascii_ply + b"element vertex 0\n" + b"property int a\n" * (n // 15) + b"end_header\n",
            "values.ply": ascii_ply + b"element vertex 1\nproperty float x\nproperty float y\nproperty float z\n" +
                          b"property int a\n" * (n // 17) + b"end_header\n" + b"0 " * (n // 17 + 3),
            "no_corners.ply": binary_ply + b"element face %d\nproperty list uchar uchar vertex_index\nend_header\n" % n +
                              bytes(n),
            "strip.ply": binary_ply + b"element vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
                         b"element tristrips 1\nproperty list int uchar vertex_indices\nend_header\n" + bytes(36) +
                         struct.pack("<i", n // 3 * 3) + b"\0\1\2" * (n // 3),
            "one_point.stl": bytes(80) + struct.pack("<I", n // 50) + bytes(n // 50 * 50),
            "solids.stl": b"solid\n" + b"endsolid\n" * (n // 9),
        }
        for name, data in cases.items():
            done = subprocess.run([DELMESH, "certify", self.file(name, data), "--quiet"], capture_output=True,
                                  timeout=10 if LIMITS else 60)
            self.assertIn(done.returncode, (0, 1, 2), name)


class Interrupts(CommandTest):
    def finish(self, process, number, status):
        began = time.monotonic()
        process.send_signal(number)
        out, err = process.communicate(timeout=30)
        self.assertLess(time.monotonic() - began, 10)
        self.assertEqual(process.returncode, status, err)
        return out, err

    def test_while_reading(self):
        for number in (signal.SIGINT, signal.SIGTERM):
            fifo, out = self.folder / f"{number}.obj", self.file("out.ply", "old")
            os.mkfifo(fifo)
            process = subprocess.Popen([DELMESH, "remesh", fifo, out, "--json"], stdout=subprocess.PIPE, stderr=subprocess.PIPE)
            writer = os.open(fifo, os.O_WRONLY)
            os.write(writer, OBTUSE.encode())
            time.sleep(0.2)  # it waits for more
            text, _ = self.finish(process, number, 128 + number)
            os.close(writer)
            self.assertEqual(json.loads(text)["status"], "DELMESH_ERROR_CANCELLED")
            self.assertEqual(out.read_text(), "old")
            fifo.unlink()
        self.assertEqual([p.name for p in self.folder.iterdir()], ["out.ply"])

    def test_while_waiting_for_a_writer(self):
        fifo = self.folder / "a.obj"
        os.mkfifo(fifo)
        process = subprocess.Popen([DELMESH, "info", fifo], stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        time.sleep(0.5)
        self.finish(process, signal.SIGINT, 130)

    def test_while_the_library_works(self):
        mesh = self.file("grid.obj", rough_grid(30))
        process = subprocess.Popen([DELMESH, "measure", mesh, mesh, "--samples", "1000000000"], stdout=subprocess.PIPE,
                                   stderr=subprocess.PIPE)
        time.sleep(1)
        self.assertIsNone(process.poll(), "it was too fast to be interrupted")
        out, err = self.finish(process, signal.SIGINT, 130)
        self.assertEqual(out, b"")
        self.assertEqual(err.count(b"\n"), 1)

    def test_remesh_at_many_moments(self):
        """Whenever it comes: either the whole new file or the old one, and nothing beside it."""
        mesh, out = self.file("grid.obj", rough_grid(120)), self.folder / "out.obj"
        began = time.monotonic()
        self.run_command("remesh", mesh, out, "--quiet")
        seconds = time.monotonic() - began
        whole = out.read_bytes()
        cancelled = 0
        for k in range(16):
            out.write_text("old")
            process = subprocess.Popen([DELMESH, "remesh", mesh, out, "--quiet"], stdout=subprocess.PIPE, stderr=subprocess.PIPE)
            time.sleep(seconds * (k + 0.5) / 16)
            process.send_signal(signal.SIGINT)
            process.communicate(timeout=60)
            # Before the handler is there, the signal itself ends the process; then nothing has been written either.
            self.assertIn(process.returncode, (0, 130, -signal.SIGINT))
            self.assertEqual(out.read_bytes(), whole if process.returncode == 0 else b"old")
            self.assertEqual(sorted(p.name for p in self.folder.iterdir()), ["grid.obj", "out.obj"])
            cancelled += process.returncode != 0
        self.assertGreater(cancelled, 4)

    def test_lod_at_many_moments(self):
        """Whenever it comes: either all of the new files or the old ones, and nothing beside them."""
        mesh = self.file("torus.obj", torus(100, 70))
        names = [f"o_LOD{i}.obj" for i in range(6)]
        words = [DELMESH, "lod", mesh, self.folder / "o", "--ratios", "0.8,0.6,0.4,0.2,0.1", "--suffix", "obj", "--quiet",
                 "--no-measure"]
        began = time.monotonic()
        subprocess.run(words, check=True)
        seconds = time.monotonic() - began
        whole = [(self.folder / name).read_bytes() for name in names]
        cancelled = 0
        for k in range(16):
            for name in names:
                (self.folder / name).write_text("old")
            process = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
            time.sleep(seconds * (k + 0.5) / 16)
            process.send_signal(signal.SIGINT)
            process.communicate(timeout=60)
            self.assertIn(process.returncode, (0, 130, -signal.SIGINT))
            self.assertEqual([(self.folder / name).read_bytes() for name in names],
                             whole if process.returncode == 0 else [b"old"] * 6)
            self.assertEqual(sorted(p.name for p in self.folder.iterdir()), [*names, "torus.obj"])
            cancelled += process.returncode != 0
        self.assertGreater(cancelled, 4)

    def test_progress_bar(self):
        import pty
        mesh = self.file("grid.obj", rough_grid(60))
        for quiet in (False, True):
            master, slave = pty.openpty()
            words = [DELMESH, "remesh", mesh, self.folder / "o.ply"] + (["--quiet"] if quiet else [])
            process = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=slave)
            os.close(slave)
            process.communicate(timeout=60)
            shown = b""
            try:
                while chunk := os.read(master, 65536):
                    shown += chunk
            except OSError as error:  # the other end is closed
                self.assertEqual(error.errno, errno.EIO)
            os.close(master)
            self.assertEqual(b"[#" in shown, not quiet, shown[-200:])
            if not quiet:
                self.assertTrue(shown.endswith(b" \r"), "the bar is not wiped")


class Memory(CommandTest):
    def test_out_of_memory(self):
        if not LIMITS:
            self.skipTest("no address-space limits here")
        mesh, out = self.file("grid.obj", rough_grid(150)), self.file("out.ply", "old")
        statuses = set()
        for megabytes in (8, 12, 16, 20, 24, 28, 32, 40, 48, 64, 96):
            limit = megabytes << 20
            done = subprocess.run([DELMESH, "remesh", mesh, out, "--threads", "1", "--quiet"], capture_output=True, timeout=60,
                                  preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (limit, limit)))
            statuses.add(done.returncode)
            if done.returncode == 127 or b"error while loading" in done.stderr:
                continue  # not even started
            self.assertIn(done.returncode, (0, 2), f"{megabytes} MB: {done.stderr}")
            if done.returncode == 2:
                self.assertRegex(done.stderr, b"memory")
                self.assertEqual(out.read_text(), "old")
        self.assertIn(2, statuses)


if __name__ == "__main__":
    DELMESH, LIMITS = os.path.abspath(sys.argv[1]), "--no-limits" not in sys.argv
    unittest.main(argv=sys.argv[:1], verbosity=1)
