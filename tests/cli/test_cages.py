# SPDX-License-Identifier: Apache-2.0
"""Control cages through the command, from outside: subdivide, and lod --subdivide.
    test_cages.py DELMESH [--no-limits]
"""
import collections
import gzip
import json
import math
import os
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

DELMESH = ""
ROOT = Path(__file__).resolve().parents[2]
DATA = Path(os.environ.get("DELMESH_SHARED", ROOT.parent / "shared")) / "data" / "clean"

CUBE = """v -1 -1 -1\nv 1 -1 -1\nv -1 1 -1\nv 1 1 -1\nv -1 -1 1\nv 1 -1 1\nv -1 1 1\nv 1 1 1
vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1
usemtl a\nf 1/1 3/2 4/3 2/4\nf 5/1 6/2 8/3 7/4\nusemtl b\nf 1/1 2/2 6/3 5/4\nf 3/1 7/2 8/3 4/4\nf 1/1 5/2 7/3 3/4\nf 2/1 4/2 8/3 6/4
"""


def read_obj(text):
    """points, uvs, faces as lists of (vertex, uv index or None), normals"""
    points, uvs, normals, faces = [], [], [], []
    for words in map(str.split, text.splitlines()):
        if words[:1] == ["v"]:
            points.append(tuple(map(float, words[1:4])))
        elif words[:1] == ["vt"]:
            uvs.append(tuple(map(float, words[1:3])))
        elif words[:1] == ["vn"]:
            normals.append(tuple(map(float, words[1:4])))
        elif words[:1] == ["f"]:
            faces.append([tuple(int(part) - 1 if part else None for part in (corner.split("/") + ["", ""])[:3])
                          for corner in words[1:]])
    return points, uvs, faces, normals


def edges_of(faces):
    """{(low, high): faces}"""
    count = collections.Counter()
    for face in faces:
        for (a, *_), (b, *_) in zip(face, face[1:] + face[:1]):
            count[min(a, b), max(a, b)] += 1
    return count


class Cages(unittest.TestCase):
    def setUp(self):
        self.temporary = tempfile.TemporaryDirectory()
        self.folder = Path(self.temporary.name)
        self.addCleanup(self.temporary.cleanup)

    def run_command(self, *arguments, expected=0):
        done = subprocess.run([DELMESH, *map(str, arguments)], capture_output=True, text=True, timeout=300)
        self.assertEqual(done.returncode, expected, done.stderr)
        return json.loads(done.stdout) if "--json" in arguments else done.stderr

    def write(self, name, text):
        path = self.folder / name
        path.write_text(text)
        return path

    def subdivide(self, cage, *options):
        out = self.folder / "out.obj"
        report = self.run_command("subdivide", cage, out, "--json", *options)
        return report, read_obj(out.read_text())

    def test_counts_and_layers(self):
        cage = self.write("cube.obj", CUBE)
        report, (points, uvs, faces, normals) = self.subdivide(cage, "--rate", "6", "--normals")
        self.assertEqual((report["rate"], report["faces"], report["vertices"]), (6, 6 * 72, 8 + 12 * 5 + 6 * 25))
        self.assertEqual((report["boundary_edges"], report["euler_characteristic"]), (0, 2))
        self.assertEqual(len(points), report["vertices"])
        self.assertEqual(set(edges_of(faces).values()), {2})
        for face in faces:
            for v, uv, n in face:
                self.assertTrue(all(-1e-6 <= x <= 1 + 1e-6 for x in uvs[uv]))
                # the surface is round: normals look where the point is, more or less
                self.assertGreater(sum(a * b for a, b in zip(points[v], normals[n])) / math.hypot(*points[v]), 0.85)
        self.assertEqual([layer["border_edges"] for layer in report["layers"] if layer["kind"] == "uv"], [6 * 12])

    def test_tags(self):
        ring = "t crease 5/1/0 0 1 3 2 0 10\n"
        cage = self.write("creased.obj", CUBE + ring + "t corner 1/1/0 7 10\nt hole 1/0/0 1\nt vertexedit 1/0/0 3\n")
        report, (points, _, faces, _) = self.subdivide(cage, "--rate", "4")
        self.assertEqual(report["left_out_faces"], 1)
        self.assertEqual(report["faces"], 5 * 32)
        self.assertEqual(report["boundary_edges"], 16)
        self.assertTrue(any("t: " in line for line in report["lost"]))
        self.assertIn((1, 1, 1), points)
        # A plane crease: the bottom's outline stays in the plane of the four vertices.
        self.assertGreaterEqual(sum(abs(p[2] + 1) < 1e-6 for p in points), 16)
        # The same from a file of its own, behind a plain OBJ.
        plain = self.write("cube.obj", CUBE)
        side = self.write("sharp.txt", "# the bottom\ncrease 0 1 10\ncrease 1 3 10\ncrease 3 2 10\ncrease 2 0 10\n\n"
                                       "corner 7 1e3\nhole 1")
        again, mesh = self.subdivide(plain, "--rate", "4", "--creases", side)
        self.assertEqual((mesh[0], mesh[2]), (points, faces))
        for text, sentence in (("crease 0 1", "line 1: expected a sharpness, found ''"),
                               ("corner x 1", "line 1: expected a vertex"),
                               ("\nedge 1 2 3", "line 2: expected crease, corner or hole, found 'edge'"),
                               ("hole 1 2", "line 1: expected the line's end, found '2'"),
                               ("crease 0 99 1", "crease 0 had vertex 99"),
                               ("corner 0 -2", "sharpness 0 was -2"),
                               ("hole 6", "number 0 was face 6; there were 6 faces")):
            bad = self.write("bad.txt", text)
            said = self.run_command("subdivide", plain, self.folder / "no.obj", "--rate", "2", "--creases", bad, expected=2)
            self.assertIn(sentence, said)
            self.assertEqual(said.count("\n"), 1)

    def test_broken_tags_are_left_out(self):
        for tag in ("t crease", "t crease 2", "t crease 2/1/0 0", "t crease 2/1/0 0 1", "t crease 1/1/0 0 2",
                    "t corner 2/3/0 0 1 1 1 1", "t crease 99999999999/1/0 0 1 2", "t hole 0/0/0", "t x 1/1/1", "t",
                    "t crease 2/1/0 0 1 x", "t corner -1/1/0 1"):
            for end in ("", "\n"):
                report, _ = self.subdivide(self.write("cube.obj", CUBE + tag + end), "--rate", "2")
                self.assertEqual(report["faces"], 48)
                self.assertTrue(any("t: " in line for line in report["lost"]), tag)

    def test_schemes_and_fineness(self):
        cage = self.write("cube.obj", CUBE)
        report, (points, *_) = self.subdivide(cage, "--edge-length", "0.5", "--scheme", "bilinear")
        self.assertEqual(report["rate"], 4)
        self.assertTrue(all(max(map(abs, p)) == 1 for p in points))
        report, _ = self.subdivide(cage, "--triangles", "300")
        self.assertEqual((report["rate"], report["faces"]), (5, 300))
        one, (points, *_) = self.subdivide(cage, "--rate", "8", "--evaluation", "far")
        two, (others, *_) = self.subdivide(cage, "--rate", "8")
        near = {tuple(round(x, 3) + 0.0 for x in p) for p in points}
        self.assertEqual(near, {tuple(round(x, 3) + 0.0 for x in p) for p in others})

    def test_refusals(self):
        cage = self.write("cube.obj", CUBE)
        out = self.folder / "no.obj"
        for options, sentence in (([], "one of --rate, --edge-length and --triangles is missing"),
                                  (["--rate", "2", "--triangles", "9"], "--rate and --triangles do not go together"),
                                  (["--rate", "0"], "The option 'value' was 0, outside 1 to 4096."),
                                  (["--rate", "1000000"], "The option 'value' was 1000000, outside 1 to 4096."),
                                  (["--rate", "4", "--scheme", "loop"], "the Loop scheme takes triangles only"),
                                  (["--edge-length", "1e-9"], "more than 4096 pieces"),
                                  (["--rate", "3", "--evaluation", "far"], "powers of two")):
            self.assertIn(sentence, self.run_command("subdivide", cage, out, *options, expected=2))
            self.assertFalse(out.exists())
        for options, sentence in ((["--subdivide", "x"], "--subdivide takes N, length=L or triangles=N, not 'x'"),
                                  (["--subdivide", "4", "--lock", "f"], "--subdivide and --lock do not go together"),
                                  (["--normals"], "--normals goes with --subdivide")):
            self.assertIn(sentence, self.run_command("lod", cage, self.folder / "l", "--ratios", "0.5", *options, expected=2))
        none = self.write("none.obj", "v 0 0 0\n")
        self.assertIn("the cage had no faces", self.run_command("subdivide", none, out, "--rate", "2", expected=2))

    def test_a_family(self):
        cage = self.write("cube.obj", CUBE)
        report = self.run_command("lod", cage, self.folder / "cube", "--subdivide", "16", "--ratios", "0.5,0.1,0.02",
                                  "--suffix", "obj", "--normals", "--json")
        self.assertEqual([level["certified"] for level in report["levels"]], [True] * 4)
        self.assertEqual(report["faces_in"], 6 * 512)
        for level in report["levels"]:
            points, uvs, faces, normals = read_obj(Path(level["file"]).read_text())
            self.assertEqual(set(edges_of(faces).values()), {2})
            seams = 0
            values = collections.defaultdict(set)
            for face in faces:
                for v, uv, n in face:
                    self.assertTrue(all(-1e-6 <= x <= 1 + 1e-6 for x in uvs[uv]))
                    values[v].add(uvs[uv])
            seams = sum(len(kinds) > 1 for kinds in values.values())
            self.assertGreater(seams, 8)  # along the twelve edges of the cube; every face of it has a map of its own
            self.assertLess(seams, len(points))

    def test_deviation_from_the_limit(self):
        cage = self.write("cube.obj", CUBE)
        report = self.run_command("lod", cage, self.folder / "cube", "--subdivide", "32", "--deviation", "0.01,0.05", "--json")
        off = report["subdivide"]["limit_distance"]
        self.assertGreater(off, 1e-5)
        self.assertLess(off, 3e-3)
        for level, wanted in zip(report["levels"][1:], (0.01, 0.05)):
            self.assertAlmostEqual(level["target"]["value"], wanted - off, delta=1e-12)
            self.assertLessEqual(level["bound"], wanted - off)
            self.assertAlmostEqual(level["limit_hausdorff_bound"], level["deviation"]["hausdorff_bound"] + off, delta=1e-12)
        said = self.run_command("lod", cage, self.folder / "cube", "--subdivide", "2", "--deviation", "0.0001", expected=2)
        self.assertIn("--subdivide finer", said)
        report, _ = self.subdivide(cage, "--rate", "32", "--measure")
        self.assertAlmostEqual(report["limit_distance"], off, delta=1e-12)

    def test_real_cages(self):
        if not DATA.is_dir():
            self.skipTest("the shared data is missing")
        for name, boundary in (("catmark_car.obj", 60), ("catmark_rook.obj", 24), ("spot_control_mesh.obj", 0),
                               ("fandisk_quads.off", 0)):
            with self.subTest(name):
                report, (points, uvs, faces, _) = self.subdivide(DATA / name, "--rate", "4")
                self.assertEqual(report["boundary_edges"], 4 * boundary)
                self.assertEqual(sum(n == 1 for n in edges_of(faces).values()), 4 * boundary)
                self.assertEqual(report["lost"], [])


if __name__ == "__main__":
    DELMESH = os.path.abspath(sys.argv[1])
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, "cube.obj").write_text(CUBE)
        tried = subprocess.run([DELMESH, "subdivide", "cube.obj", "out.obj", "--rate", "1"], cwd=folder, capture_output=True,
                               text=True)
        if "built without OpenSubdiv" in tried.stderr:
            print("skipped: the library was built without OpenSubdiv")
            sys.exit(77)
    unittest.main(argv=sys.argv[:1])
