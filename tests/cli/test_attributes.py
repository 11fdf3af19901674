# SPDX-License-Identifier: Apache-2.0
"""UVs, normals, materials, groups and colours through the command, from outside. This test reads the files with readers of its own.
    test_attributes.py DELMESH [--no-limits]
"""
import gzip
import json
import math
import os
import resource
import struct
import subprocess
import sys
import unittest
from pathlib import Path

from support import FolderTest

DELMESH = ""
LIMITS = True
ROOT = Path(__file__).resolve().parents[2]
DATA = Path(os.environ.get("DELMESH_SHARED", ROOT.parent / "shared")) / "data"


class Mesh:
    """What an OBJ file says, index by index: corners are (vertex, uv or None, normal or None) with the values themselves."""

    def __init__(self, text):
        self.points, self.colors, uvs, normals = [], [], [], []
        self.faces, self.materials, self.groups, self.smoothing, self.libraries = [], [], [], [], []
        material, group, smooth = None, None, "off"
        for line in text.splitlines():
            words = line.split()
            if not words:
                continue
            if words[0] == "v":
                self.points.append(tuple(map(float, words[1:4])))
                self.colors.append(tuple(map(float, words[4:])))
            elif words[0] == "vt":
                uvs.append(tuple(map(float, words[1:])))
            elif words[0] == "vn":
                normals.append(tuple(map(float, words[1:])))
            elif words[0] == "usemtl":
                material = line.partition(" ")[2]
            elif words[0] == "g":
                group = line.partition(" ")[2]
            elif words[0] == "s":
                smooth = words[1]
            elif words[0] == "mtllib":
                self.libraries.append(line.partition(" ")[2])
            elif words[0] == "f":
                face = []
                for corner in words[1:]:
                    parts = (corner.split("/") + ["", ""])[:3]
                    face.append((int(parts[0]) - 1, uvs[int(parts[1]) - 1] if parts[1] else None,
                                 normals[int(parts[2]) - 1] if parts[2] else None))
                self.faces.append(face)
                self.materials.append(material)
                self.groups.append(group)
                self.smoothing.append(smooth)


def read_ply(path):
    """{"vertex": [{name: value}], "face": [...]} of any PLY file."""
    data = path.read_bytes()
    head, _, body = data.partition(b"end_header\n")
    lines = head.decode().splitlines()
    form = lines[1].split()[1]
    codes = {"char": "b", "uchar": "B", "short": "h", "ushort": "H", "int": "i", "uint": "I", "float": "f", "double": "d"}
    order = ">" if "big" in form else "<"
    words, at = iter(body.split()), 0

    def take(kind):
        nonlocal at
        if form == "ascii":
            word = next(words)
            return float(word) if kind in ("float", "double") else int(word)
        value, = struct.unpack_from(order + codes[kind], body, at)
        at += struct.calcsize(codes[kind])
        return value

    elements = []
    for line in map(str.split, lines):
        if line[0] == "element":
            elements.append((line[1], int(line[2]), []))
        elif line[0] == "property":
            elements[-1][2].append(line[1:])
    found = {"comments": [line[8:] for line in lines if line.startswith("comment ")]}
    for name, count, properties in elements:
        rows = found[name] = []
        for _ in range(count):
            row = {}
            for p in properties:
                row[p[-1]] = [take(p[2]) for _ in range(take(p[1]))] if p[0] == "list" else take(p[0])
            rows.append(row)
    return found


# The UVs of a cube's sides: each its own square of the texture, turned so that no two sides agree along an edge.
SIDES = [(1, 2, 4, 3), (5, 7, 8, 6), (1, 5, 6, 2), (3, 4, 8, 7), (1, 3, 7, 5), (2, 6, 8, 4)]


def textured_cube(cuts=4):
    """A cube, each side cuts x cuts squares in two triangles each, their points moved within the sides so that some diagonals
    are not Delaunay. Its sides are charts of their own; three are red and three are blue; every side is a group."""
    text, numbers = ["mtllib cube.mtl"], {}
    corners = {i + 1: (x, y, z) for i, (x, y, z) in enumerate((x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1))}
    points, uvs, faces = [], [], []
    for side, (a, b, c, d) in enumerate(SIDES):
        p, q, r = corners[a], corners[b], corners[d]
        grid = {}
        for i in range(cuts + 1):
            for j in range(cuts + 1):
                inside = 0 < i < cuts and 0 < j < cuts
                s = (i + (0.35 * math.sin(7 * i + 3 * j + side) if inside else 0)) / cuts
                t = (j + (0.35 * math.cos(5 * i + 9 * j + side) if inside else 0)) / cuts
                x = tuple(p[k] + s * (q[k] - p[k]) + t * (r[k] - p[k]) for k in range(3))
                key = tuple(round(v * 64) / 64 for v in x) if not inside else (side, i, j)
                if key not in numbers:
                    numbers[key] = len(points) + 1
                    points.append(tuple(round(v * 1024) / 1024 for v in x))
                x = points[numbers[key] - 1]
                along = [sum((x[k] - p[k]) * (e[k] - p[k]) for k in range(3)) for e in (q, r)]
                uvs.append((side / 8 + along[0] / 16, 0.25 + along[1] / 8))  # exact in floats, one affine map of the side
                grid[i, j] = (numbers[key], len(uvs), side + 1)
        for i in range(cuts):
            for j in range(cuts):
                k = [grid[i, j], grid[i + 1, j], grid[i + 1, j + 1], grid[i, j + 1]]
                pair = [(k[0], k[1], k[2]), (k[0], k[2], k[3])] if (i + j) % 2 else [(k[0], k[1], k[3]), (k[1], k[2], k[3])]
                faces += [(side, t) for t in pair]
    text += ["v %r %r %r" % x for x in points] + ["vt %r %r" % x for x in uvs]
    for a, b, c, d in SIDES:
        u, v = ([corners[e][k] - corners[a][k] for k in range(3)] for e in (b, d))
        text.append("vn %d %d %d" % tuple(u[(k + 1) % 3] * v[(k + 2) % 3] - u[(k + 2) % 3] * v[(k + 1) % 3] for k in range(3)))
    side_now = None
    for side, triangle in faces:
        if side != side_now:
            text.append(f"g side {side}\nusemtl {'red' if side < 3 else 'light blue'}\ns {side + 1}")
            side_now = side
        text.append("f " + " ".join("%d/%d/%d" % c for c in triangle))
    return "\n".join(text) + "\n"


class AttributesTest(FolderTest):
    def run_command(self, *words, status=0):
        done = subprocess.run([DELMESH, *map(str, words)], capture_output=True, timeout=120)
        self.assertEqual(done.returncode, status, f"{words}\n{done.stdout.decode()}{done.stderr.decode()}")
        return done.stdout.decode(), done.stderr.decode()

    def json_of(self, *words):
        return json.loads(self.run_command(*words, "--json")[0])

    def check_charts(self, mesh, exact):
        """Of a cube: every corner has the UV of its side's affine map, whatever the side; groups and materials are the side's."""
        corners = [(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)]
        for face, material, group, smooth in zip(mesh.faces, mesh.materials, mesh.groups, mesh.smoothing):
            side = int(group.split()[1])
            self.assertEqual(material, "red" if side < 3 else "light blue")
            self.assertEqual(smooth, str(side + 1))
            a, b, _, d = SIDES[side]
            p, q, r = corners[a - 1], corners[b - 1], corners[d - 1]
            for vertex, uv, normal in face:
                x = mesh.points[vertex]
                along = [sum((x[k] - p[k]) * (e[k] - p[k]) for k in range(3)) for e in (q, r)]
                wanted = (side / 8 + along[0] / 16, 0.25 + along[1] / 8)
                for got, value in zip(uv, wanted):
                    if exact:
                        self.assertEqual(got, value)
                    else:
                        self.assertAlmostEqual(got, value, delta=1e-6)
                self.assertAlmostEqual(math.hypot(*normal), 1, delta=1e-12)


class TexturedCube(AttributesTest):
    def test_info(self):
        got = self.json_of("info", self.file("cube.obj", textured_cube()))
        found = {layer["name"]: layer for layer in got["layers"]}
        self.assertEqual(set(found), {"uv", "normal", "material", "group", "smoothing"})
        self.assertEqual(found["uv"]["border_edges"], 12 * 4)  # all edges of the cube; sides 0-2 and 3-5 meet at 6 of 12
        self.assertEqual(found["material"]["border_edges"], sum(
            (i < 3) != (j < 3) and len(set(SIDES[i]) & set(SIDES[j])) == 2 for i in range(6) for j in range(i)) * 4)
        self.assertNotIn("border_edges", found["normal"])
        self.assertIn("uv (48 border edges)", self.run_command("info", self.folder / "cube.obj")[0])

    def test_remesh(self):
        source = textured_cube()
        path, out = self.file("cube.obj", source), self.folder / "out.obj"
        before = Mesh(source)
        for mode in ("flip", "preserve", "feature"):
            got = self.json_of("remesh", path, out, "--mode", mode)
            self.assertTrue(got["certified"])
            self.assertGreater(got["nld_in"], 0)
            self.assertEqual(got["lost"], [])
            mesh = Mesh(out.read_text())
            self.assertEqual(mesh.libraries, ["cube.mtl"])
            self.assertEqual(mesh.points[:len(before.points)], before.points)
            self.check_charts(mesh, exact=len(mesh.points) == len(before.points))
            # Corners of a vertex on a side have the value that they had there, bit for bit.
            there = {(v, g): uv for face, g in zip(before.faces, before.groups) for v, uv, _ in face}
            for face, group in zip(mesh.faces, mesh.groups):
                for vertex, uv, _ in face:
                    if vertex < len(before.points):
                        self.assertEqual(uv, there[vertex, group])
            # Nothing is left of what was not there: as many UVs as vertices on each side.
            used = {(g, v) for face, g in zip(mesh.faces, mesh.groups) for v, _, _ in face}
            self.assertEqual(out.read_text().count("\nvt "), len({uv for f in mesh.faces for _, uv, _ in f}))
            self.assertLessEqual(len({uv for f in mesh.faces for _, uv, _ in f}), len(used))

    def test_library_path(self):
        path = self.file("cube.obj", textured_cube(2))
        (self.folder / "deep").mkdir()
        out = self.folder / "deep" / "out.obj"
        self.run_command("remesh", path, out, "--quiet")
        self.assertEqual(Mesh(out.read_text()).libraries, ["../cube.mtl"])

    def test_release(self):
        """Without borders flips may cross them: quads with a material each, on a plane."""
        path = self.file("flat.obj", "v 0 0 0\nv 4 0 0\nv 2 1 0\nv 2 -1 0\nvt 0 0\nvt 1 0\nvt 1 1\nusemtl a\nf 1/1 2/2 3/3\n"
                                     "usemtl b\nf 2/3 1/2 4/1\n")
        out = self.folder / "out.obj"
        kept = self.json_of("remesh", path, out, "--mode", "flip")
        self.assertGreater(kept["kept_splits"], 0)
        for words in (["--release", "uv"], ["--release", "material"]):
            self.assertGreater(self.json_of("remesh", path, out, "--mode", "flip", *words)["kept_splits"], 0)
        free = self.json_of("remesh", path, out, "--mode", "flip", "--release", "uv,material")
        self.assertEqual((free["splits"], free["flips"]), (0, 1))
        self.assertEqual(set(Mesh(out.read_text()).materials), {"a", "b"})
        bare = self.json_of("remesh", path, out, "--mode", "flip", "--bare")
        self.assertEqual((bare["splits"], bare["layers"], bare["lost"]), (0, [], []))
        self.assertNotIn("vt", out.read_text())
        grouped = self.file("groups.obj", "v 0 0 0\nv 4 0 0\nv 2 1 0\nv 2 -1 0\ng a\nf 1 2 3\ng b\nf 2 1 4\n")
        self.assertEqual(self.json_of("remesh", grouped, out, "--mode", "flip")["splits"], 0)
        self.assertGreater(self.json_of("remesh", grouped, out, "--mode", "flip", "--keep", "group")["splits"], 0)
        shaded = self.file("shaded.obj", "v 0 0 0\nv 4 0 0\nv 2 1 0\nv 2 -1 0\nvn 0 0 1\nvn 0 3 4\n"
                                         "f 1//1 2//1 3//1\nf 2//2 1//2 4//2\n")
        self.assertEqual(self.json_of("remesh", shaded, out, "--mode", "flip")["splits"], 0)
        self.assertGreater(self.json_of("remesh", shaded, out, "--mode", "flip", "--keep", "normal")["splits"], 0)
        normals = {tuple(round(n, 12) for n in normal) for face in Mesh(out.read_text()).faces for _, _, normal in face}
        self.assertEqual(normals, {(0, 0, 1), (0, 0.6, 0.8)})
        _, err = self.run_command("remesh", path, out, "--keep", "uv", "--release", "uv", status=2)
        self.assertEqual(err, "delmesh: --keep and --release both name uv\n")
        for command in ("remesh", "lod"):
            for word in ("--keep", "--release", "--bare"):
                self.assertIn(word, self.run_command(command, "--help")[0])

    def test_formats(self):
        path = self.file("cube.obj", textured_cube())
        for encoding in ("ascii", "little", "big"):
            ply, back = self.folder / "cube.ply", self.folder / "back.obj"
            got = self.json_of("remesh", path, ply, "--mode", "flip", "--encoding", encoding)
            self.assertEqual([word.split(":")[0] for word in got["lost"]], ["normal", "material", "group", "smoothing", "cube.mtl"])
            found = read_ply(ply)
            self.assertEqual(set(found["vertex"][0]), {"x", "y", "z"})
            self.assertEqual(set(found["face"][0]),
                             {"vertex_indices", "texcoord", "material_index", "group_index", "smoothing_group"})
            self.run_command("remesh", ply, back, "--mode", "flip", "--quiet")
            mesh = Mesh(back.read_text())
            self.assertEqual(set(mesh.materials), {"material_1", "material_2"})
            mesh.materials = ["red" if m == "material_1" else "light blue" for m in mesh.materials]
            mesh.groups = ["side %d" % (int(g.split("_")[1]) - 1) for g in mesh.groups]
            for face in mesh.faces:  # normals are lost on the way
                for k, (vertex, uv, normal) in enumerate(face):
                    self.assertIsNone(normal)
                    face[k] = (vertex, uv, (0, 0, 1))
            self.check_charts(mesh, exact=False)
        _, err = self.run_command("remesh", path, self.folder / "cube.stl")
        self.assertIn("cube.stl: lost: uv: STL files hold positions only\n", err)
        self.assertEqual(self.run_command("remesh", path, self.folder / "cube.stl", "--quiet"), ("", ""))

    def test_what_is_not_read(self):
        points = ((0, 0, 0), (4, 0, 0), (2, 2, 0))
        corners = struct.pack("<12f", 0, 0, 1, *(x for p in points for x in p))
        off = b"OFF BINARY\n" + struct.pack(">3i", 3, 1, 0) + struct.pack(">9f", *(x for p in points for x in p)) + \
            struct.pack(">4i", 3, 0, 1, 2)
        for name, content, lost in (("plain.stl", bytes(80) + struct.pack("<i", 1) + corners + bytes(2), []),
                                    ("red.stl", bytes(80) + struct.pack("<i", 1) + corners + b"\x1f\xfc",
                                     ["attribute of faces: it is not read"]),
                                    ("plain.off", off + struct.pack(">i", 0), []),
                                    ("red.off", off + struct.pack(">i4f", 4, 1, 0, 0, 1), ["color of faces: it is not read"])):
            self.assertEqual(self.json_of("remesh", self.file(name, content), self.folder / "out.ply")["lost"], lost, name)

    def test_ply_vertices(self):
        head = "ply\nformat ascii 1.0\ncomment TextureFile wood.png\nelement vertex 4\nproperty float x\nproperty float y\n" \
               "property float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nproperty double heat\n" \
               "property short id\nproperty float s\nproperty float t\nelement face 2\nproperty list uchar int vertex_indices\n" \
               "property uchar flag\nproperty float area\nend_header\n"
        rows = ["0 0 0 0 10 20 0.1 -5 0 0.5", "4 0 0 100 11 21 0.2 -6 1 0.5", "2 1 0 200 12 22 0.3 -7 0.5 1",
                "2 -1 0 255 13 23 0.4 -8 0.5 0"]
        path = self.file("a.ply", head + "\n".join(rows) + "\n3 0 1 2 7 1.5\n3 1 0 3 9 2.5\n")
        for encoding in ("ascii", "little"):
            out = self.folder / "out.ply"
            for mode, split in (("flip", False), ("preserve", False)):
                got = self.json_of("remesh", path, out, "--mode", mode, "--encoding", encoding)
                self.assertEqual((got["lost"], got["splits"] > 0), ([], split))
                found = read_ply(out)
                self.assertEqual(found["comments"], ["TextureFile wood.png"])
                for row, line in zip(found["vertex"], rows):
                    names = ("x", "y", "z", "red", "green", "blue", "heat", "id", "s", "t")
                    self.assertEqual(tuple(row[n] for n in names), tuple(map(float, line.split())))
                self.assertEqual({(f["flag"], f["area"]) for f in found["face"]}, {(7, 1.5), (9, 2.5)})
        header = out.read_bytes().partition(b"end_header")[0].decode()
        for line in head.splitlines()[2:-1]:
            self.assertIn(line + "\n", header)

    def test_weld(self):
        """Vertices of one place with two UVs, as files without corner UVs have their seams: welded, the seam is one of corners."""
        path = self.file("a.ply", "ply\nformat ascii 1.0\nelement vertex 6\nproperty float x\nproperty float y\nproperty float z\n"
                                  "property float s\nproperty float t\nelement face 2\nproperty list uchar int vertex_indices\n"
                                  "end_header\n0 0 0 0 0\n4 0 0 1 0\n2 1 1 1 1\n0 0 0 0.5 0.5\n4 0 0 0.25 0.25\n2 -1 1 0 0.5\n"
                                  "3 0 1 2\n3 4 3 5\n")
        out = self.folder / "out.obj"
        got = self.json_of("remesh", path, out, "--mode", "flip", "--weld", "exact", "--boundary", "ignore")
        self.assertEqual(got["layers"][0]["border_edges"], 1)
        corners = {(v, uv) for f in Mesh(out.read_text()).faces for v, uv, _ in f}
        self.assertTrue({(0, (0, 0)), (0, (0.5, 0.5)), (1, (1, 0)), (1, (0.25, 0.25))} <= corners)

    def test_odd_names(self):
        """Names that would speak to a terminal are kept in files, and shown without."""
        path = self.file("a.obj", b"mtllib \x1b[31m.mtl\nv 0 0 0\nv 1 0 0\nv 0.5 1 0\nusemtl \xff\x1b[0m  x\nf 1 2 3\n")
        out = self.folder / "out.obj"
        self.run_command("remesh", path, out, "--quiet")
        self.assertIn(b"usemtl \xff\x1b[0m  x\n", out.read_bytes())
        ply = self.file("a.ply", b"ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
                                 b"property int \x1b[31m\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
                                 b"0 0 0 1\n1 0 0 2\n0.5 1 0 3\n3 0 1 2\n")
        for words in (["remesh", path, self.folder / "o.ply"], ["remesh", ply, out], ["info", ply]):
            self.assertNotIn("\x1b", "".join(self.run_command(*words)))
            self.json_of(*words)

    def test_missing_uvs(self):
        """Faces with UVs beside faces without."""
        path = self.file("a.obj", "v 0 0 0\nv 4 0 0\nv 2 1 0\nv 2 -1 0\nvt 0 0\nvt 1 0\nvt 1 1\nf 1/1 2/2 3/3\nf 2 1 4\n")
        for mode in ("flip", "preserve"):
            out = self.folder / "out.obj"
            self.run_command("remesh", path, out, "--mode", mode, "--quiet")
            mesh = Mesh(out.read_text())
            for face in mesh.faces:
                above = sum(mesh.points[v][1] for v, _, _ in face) > 0
                for vertex, uv, _ in face:
                    self.assertEqual(uv is not None, above)


class Lod(AttributesTest):
    def test_cube(self):
        path = self.file("cube.obj", textured_cube(8))
        got = self.json_of("lod", path, self.folder / "cube", "--ratios", "0.5,0.1", "--no-measure")
        names = [f"cube_LOD{i}.obj" for i in range(3)]  # only such files can name the material library
        self.assertEqual([Path(level["file"]).name for level in got["levels"]], names)
        for words in (["--suffix", "ply"], ["--encoding", "big"], ["--bare"]):
            other = self.json_of("lod", path, self.folder / "cube", "--ratios", "0.5,0.1", "--no-measure", *words)
            self.assertTrue(all(level["file"].endswith(".ply") for level in other["levels"]))
        for level in got["levels"]:
            mesh = Mesh(Path(level["file"]).read_text())
            self.assertEqual(mesh.libraries, ["cube.mtl"])
            self.assertEqual(set(mesh.materials), {"red", "light blue"})
            self.assertEqual(got["lost"], [])
            self.check_charts(mesh, exact=False)

    def test_uv_weight(self):
        side = range(9)  # flat: only the texture has a bump, in the middle
        lines = [f"v {x} {y} 0" for y in side for x in side] + ["vt 0 0", "vt 1 0"]
        for y in side[:-1]:
            for x in side[:-1]:
                quad = [9 * y + x + 1, 9 * y + x + 2, 9 * y + x + 11, 9 * y + x + 10]
                lines.append("f " + " ".join(f"{v}/{2 if v == 41 else 1}" for v in quad))
        path = self.file("bump.obj", "\n".join(lines) + "\n")
        for release in ((), ("--release", "uv")):  # the weight is not a matter of borders
            most = {}
            for weight in ("0", "1"):
                got = self.json_of("lod", path, self.folder / "bump", "--ratios", "0.1", "--suffix", "obj", "--no-measure",
                                   "--uv-weight", weight, *release)
                mesh = Mesh(Path(got["levels"][-1]["file"]).read_text())
                most[weight] = max(float(uv[0]) for face in mesh.faces for _, uv, _ in face)
            self.assertLess(most["0"], 0.5)
            self.assertGreater(most["1"], 0.7)
        self.run_command("lod", path, self.folder / "bump", "--ratios", "0.1", "--uv-weight", "-1", status=2)

    def test_normal_weight(self):
        side = range(9)  # flat: only the shading has a bump, in the middle
        points = [f"v {x} {y} 0" for y in side for x in side]
        lines = points + ["vn 0 0 1", "vn 1 0 0"]
        header = ["ply", "format ascii 1.0", "element vertex 81"] + [f"property float {name}" for name in "x y z nx ny nz".split()]
        header += ["element face 64", "property list uchar int vertex_indices", "end_header"]
        faces = [[9 * y + x, 9 * y + x + 1, 9 * y + x + 10, 9 * y + x + 9] for y in side[:-1] for x in side[:-1]]
        lines += ["f " + " ".join(f"{v + 1}//{2 if v == 40 else 1}" for v in face) for face in faces]
        rows = [f"{point[2:]} {'1 0 0' if v == 40 else '0 0 1'}" for v, point in enumerate(points)]
        rows += [" ".join(map(str, [4] + face)) for face in faces]
        for path in (self.file("bump.obj", "\n".join(lines) + "\n"),  # normals of corners, and of vertices
                     self.file("bump.ply", "\n".join(header + rows) + "\n")):
            most = {}
            for weight in ("0", "1"):
                got = self.json_of("lod", path, self.folder / "bump", "--ratios", "0.1", "--suffix", "obj", "--no-measure",
                                   "--normal-weight", weight)
                mesh = Mesh(Path(got["levels"][-1]["file"]).read_text())
                most[weight] = max(float(normal[0]) for face in mesh.faces for _, _, normal in face)
            self.assertLess(most["0"], 0.5)
            self.assertGreater(most["1"], 0.7)

    def test_fit(self):
        side, corners = range(17), []
        lines = [f"v {x} {y} 0" for y in side for x in side]
        lines += [f"vt {(x / 16) ** 2:.6f} {(y / 16) ** 3:.6f}" for y in side for x in side]
        for y in side[:-1]:
            for x in side[:-1]:
                corners.append([17 * y + x + 1, 17 * y + x + 2, 17 * y + x + 19, 17 * y + x + 18])
        path = self.file("bent.obj", "\n".join(lines + ["f " + " ".join(f"{v}/{v}" for v in face) for face in corners]) + "\n")

        def squares(mesh):
            total = 0
            for face in mesh.faces:
                a, b, c = (mesh.points[v] for v, _, _ in face)
                area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
                for u, v in ((i / 8, j / 8) for i in range(1, 8) for j in range(1, 8 - i)):
                    w = (1 - u - v, u, v)
                    x, y = (sum(w[k] * mesh.points[face[k][0]][d] for k in range(3)) / 16 for d in range(2))
                    s, t = (sum(w[k] * face[k][1][d] for k in range(3)) for d in range(2))
                    total += area * ((s - x * x) ** 2 + (t - y * y * y) ** 2)
            return total

        made = []
        for words in ([], ["--fit"]):
            got = self.json_of("lod", path, self.folder / "bent", "--ratios", "0.1", "--suffix", "obj", "--no-measure",
                               "--uv-weight", "1", *words)
            made.append(Mesh(Path(got["levels"][-1]["file"]).read_text()))
        self.assertEqual(made[0].points, made[1].points)
        self.assertLess(squares(made[1]), 0.7 * squares(made[0]))


class Memory(AttributesTest):
    def test_all_or_nothing(self):
        """Too little memory, anywhere on the way: the sentence says so, and the old file is there."""
        if not LIMITS:
            self.skipTest("limits of the address space do not go with this build")
        path, out = self.file("cube.obj", textured_cube(40)), self.file("out.obj", "old")
        statuses = set()
        for megabytes in (8, 12, 14, 16, 18, 20, 22, 24, 28, 32, 40, 400):
            def set_limit():
                resource.setrlimit(resource.RLIMIT_AS, (megabytes << 20, megabytes << 20))
            words = [DELMESH, "remesh", path, out, "--mode", "flip", "--threads", "1", "--quiet"]
            done = subprocess.run(words, capture_output=True, timeout=60, preexec_fn=set_limit)
            if done.returncode == 127 or b"error while loading" in done.stderr:
                continue  # not even started
            statuses.add(done.returncode)
            self.assertIn(done.returncode, (0, 2), f"{megabytes} MB: {done.stderr}")
            if done.returncode == 2:
                self.assertRegex(done.stderr, b"memory")
                self.assertEqual(out.read_text(), "old")
            else:
                self.check_charts(Mesh(out.read_text()), exact=False)
                out.write_text("old")
        self.assertEqual(statuses, {0, 2})


class Corpus(AttributesTest):
    def load(self, name):
        path = DATA / "clean" / name
        if not path.exists():
            self.skipTest(f"the shared test data are not at {DATA}")
        return Mesh((gzip.open(path).read() if name.endswith(".gz") else path.read_bytes()).decode()), path

    def test_uvs_stay(self):
        for name in ("blub_triangulated.obj", "spot_control_mesh.obj"):
            before, path = self.load(name)
            out = self.folder / "out.obj"
            values = {}
            for face in before.faces:
                for v, uv, _ in face:
                    values.setdefault(v, set()).add(uv)
            for mode in ("flip", "preserve"):
                self.run_command("remesh", path, out, "--mode", mode, "--quiet")
                for face in Mesh(out.read_text()).faces:
                    for v, uv, _ in face:
                        if v < len(before.points):
                            self.assertIn(uv, values[v])

    def test_materials_stay(self):
        before, path = self.load("joint.obj.gz")
        out = self.folder / "out.obj"
        self.run_command("remesh", path, out, "--mode", "flip", "--quiet")
        mesh = Mesh(out.read_text())
        self.assertEqual(set(mesh.materials), set(before.materials))

        def area(m):
            total = {}
            for face, material in zip(m.faces, m.materials):
                p, q, r = (m.points[v] for v, _, _ in face)
                u, w = [q[k] - p[k] for k in range(3)], [r[k] - p[k] for k in range(3)]
                n = [u[(k + 1) % 3] * w[(k + 2) % 3] - u[(k + 2) % 3] * w[(k + 1) % 3] for k in range(3)]
                total[material] = total.get(material, 0) + math.hypot(*n) / 2
            return total

        one, two = area(before), area(mesh)
        for material in one:
            self.assertAlmostEqual(two[material], one[material], delta=0.02 * one[material] + 1e-4, msg=material)


if __name__ == "__main__":
    DELMESH, LIMITS = os.path.abspath(sys.argv[1]), "--no-limits" not in sys.argv
    unittest.main(argv=sys.argv[:1])
