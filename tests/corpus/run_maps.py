# SPDX-License-Identifier: Apache-2.0
"""The law of surface maps over real meshes with UVs and materials (docs/attributes.md): remeshes in all modes, and levels of all
modes with relaxation and without.

    run_maps.py [--short] [--only TEXT] [--verbose]

--short: the tube and the smallest mesh, for ctest; the whole takes about ten minutes on two cores.

A tube that is made here, and meshes of the shared data where these are.
The library is that of DELMESH_LIBRARY, the package that of PYTHONPATH. Borders and charts are found here, by brute force from the
file. For every result:
    weights of the corner map sum to 1, and the three corners are of one polygon
    corners that meet across an edge without a border have the same UVs
    a face's three places, and its source polygon, are in one chart: none straddles a seam or a border of materials
    places are near their corners' vertices: of a level, within what the level is off itself
    inside of faces, UVs are near those of the source's surface in the same chart, there where it is closest
    edges that have a border's flag have an edge of such a border as their source
    same bytes with 1 and 2 threads
The last line is "N passed, N failed, N skipped".
"""
import argparse
import ctypes as C
import gzip
import os
import pathlib
import sys

try:
    import numpy as np
except ImportError:
    print(f"SKIPPED: {sys.executable} has no numpy")
    sys.exit(77)

from delmesh import _capi as capi
from delmesh import _library

ROOT = pathlib.Path(__file__).resolve().parents[2]
DATA = pathlib.Path(os.environ.get("DELMESH_SHARED", ROOT.parent / "shared")) / "data" / "clean"
MESHES = ("pizza.obj.gz", "spot_subdiv.obj.gz", "blub_triangulated.obj", "joint.obj.gz", "spot_control_mesh.obj", "catmark_car.obj")
SHORT = ("spot_control_mesh.obj",)
MODES = {"preserve": 0, "flip": 1, "feature": 2}
RATIOS = (0.5, 0.1, 0.02)
POSITION, CORNER_VERT, CORNER_EDGE, FACE_SOURCE, EDGE_FLAGS, CORNER_TWIN, MAP_CORNER, MAP_WEIGHT, EDGE_SOURCE = \
    1, 2, 4, 5, 8, 11, 13, 14, 15
EDGE_UV, EDGE_MATERIAL = 256, 4096
LAYER_UV, LAYER_MATERIAL = 1, 5
TARGET_FULL, TARGET_RATIO = 0, 3
TYPES = {"float32": 1, "float64": 2, "int32": 3, "uint8": 6}
PROBES = 100  # faces of each result, and as many at borders

library = None


def read_obj(path):
    points, texture, sizes, verts, coordinates, material, names, now = [], [], [], [], [], [], {}, 0
    with (gzip.open(path, "rt") if path.suffix == ".gz" else open(path)) as lines:
        for line in lines:
            word, *rest = line.split() or [""]
            if word == "v":
                points.append([float(x) for x in rest[:3]])
            elif word == "vt":
                texture.append([float(x) for x in rest[:2]])
            elif word == "usemtl":
                now = names.setdefault(" ".join(rest), len(names))
            elif word == "f":
                sizes.append(len(rest))
                material.append(now)
                for item in rest:
                    numbers = item.split("/")
                    verts.append(int(numbers[0]) - 1)
                    coordinates.append(int(numbers[1]) - 1 if len(numbers) > 1 and numbers[1] else 0)
    return Source(path.name, points, sizes, verts, np.array(texture or [[0, 0]], float)[coordinates], material)


def tube(around=24, rows=60):
    """A wavy tube of quads in one chart, which meets itself at a seam from end to end, with islands of another material."""
    angle, row = np.meshgrid(np.arange(around) * 2 * np.pi / around, np.arange(rows + 1))
    radius = 1 + 0.15 * np.sin(0.5 * row + 2 * angle)
    points = np.stack([radius * np.cos(angle + 0.03 * row), radius * np.sin(angle + 0.03 * row), 0.2 * row], -1).reshape(-1, 3)
    cells = [(i, j) for j in range(rows) for i in range(around)]
    steps = ((0, 0), (1, 0), (1, 1), (0, 1))
    verts = [(j + v) * around + (i + u) % around for i, j in cells for u, v in steps]
    uv = np.array([[(i + u) / around, (j + v) / rows] for i, j in cells for u, v in steps])
    return Source("tube", points, [4] * len(cells), verts, uv, [int(i % 7 == 3 and j % 5 == 2) for i, j in cells])


class Source:
    """A mesh with UVs and materials, and what brute force finds of its borders and charts."""

    def __init__(self, name, points, sizes, verts, uv, material):
        self.name, self.points = name, np.array(points, np.float32)
        self.sizes, self.verts, self.material = np.array(sizes, np.int32), np.array(verts, np.int32), np.array(material, np.int32)
        self.uv = uv
        self.polygon = np.repeat(np.arange(len(self.sizes)), self.sizes)  # of each corner
        self.diagonal = np.linalg.norm(np.ptp(self.points.astype(float), axis=0))
        self.find_charts()

    def find_charts(self):
        begin = np.cumsum(self.sizes) - self.sizes
        following = np.arange(len(self.verts)) + 1
        following[begin + self.sizes - 1] = begin
        sides = {}
        for c, d in enumerate(following):
            sides.setdefault((min(self.verts[c], self.verts[d]), max(self.verts[c], self.verts[d])), []).append((c, d))
        parent = np.arange(len(self.sizes))

        def root(p):
            while parent[p] != p:
                parent[p] = parent[parent[p]]
                p = parent[p]
            return p

        self.edges, self.is_border = [], []
        for edge, corners in sides.items():
            values = {(self.material[self.polygon[c]],) + tuple(self.uv[c] + 0.0) + tuple(self.uv[d] + 0.0)
                      if self.verts[c] < self.verts[d] else
                      (self.material[self.polygon[c]],) + tuple(self.uv[d] + 0.0) + tuple(self.uv[c] + 0.0) for c, d in corners}
            self.edges.append(edge)
            self.is_border.append(len(values) > 1)
            if len(corners) == 2 and len(values) == 1:
                parent[root(self.polygon[corners[0][0]])] = root(self.polygon[corners[1][0]])
        self.edges, self.is_border = np.array(self.edges, np.int32), np.array(self.is_border)
        self.chart = np.array([root(p) for p in range(len(self.sizes))])


def view(array, struct=capi.delmesh_view):
    made = struct()
    made.data, made.count, made.stride, made.type = array.ctypes.data, len(array), 0, TYPES[str(array.dtype)]
    made.components = 1 if array.ndim == 1 else array.shape[1]
    return made


def made(struct):
    new = struct()
    getattr(library, struct.__name__.removeprefix("delmesh_") + "_init")(C.byref(new), C.sizeof(new))
    return new


class Context:
    def __init__(self, threads):
        options = made(capi.delmesh_context_options)
        options.max_threads = threads
        self.handle = C.c_void_p()
        library.context_create(C.byref(options), C.byref(self.handle))

    def check(self, status):
        if status != 0:
            raise RuntimeError(f"{status}: {library.last_error(self.handle).decode()}")

    def create(self, source):
        desc, layers, mesh = made(capi.delmesh_mesh_desc), (capi.delmesh_layer * 2)(), C.c_void_p()
        for layer, kind, values in zip(layers, (LAYER_UV, LAYER_MATERIAL), (source.uv, source.material)):
            library.layer_init(C.byref(layer), C.sizeof(layer))
            layer.kind, layer.values = kind, view(values)
        desc.positions, desc.corner_verts, desc.face_sizes = view(source.points), view(source.verts), view(source.sizes)
        desc.layers, desc.layer_count, desc.edge_verts = layers, 2, view(source.edges)
        self.check(library.mesh_create(self.handle, C.byref(desc), C.byref(mesh)))
        return mesh

    def remesh(self, mesh, mode):
        options, out = made(capi.delmesh_remesh_options), C.c_void_p()
        options.mode, options.map = MODES[mode], 1
        self.check(library.remesh(self.handle, mesh, C.byref(options), C.byref(out), None))
        return out

    def levels(self, mesh, mode, quality):
        options, count = made(capi.delmesh_decimate_options), len(RATIOS) + 1
        options.prepare, options.quality, options.map = MODES[mode], quality, 1
        targets, out = (capi.delmesh_target * count)(), (C.c_void_p * count)()
        for target, ratio in zip(targets, (None, *RATIOS)):
            target.kind, target.value = (TARGET_FULL, 0) if ratio is None else (TARGET_RATIO, ratio)
        self.check(library.lod_family(self.handle, mesh, targets, count, C.byref(options), out, None, None))
        return [C.c_void_p(each) for each in out]

    def distance(self, a, b):
        options, report = made(capi.delmesh_distance_options), made(capi.delmesh_distance_report)
        options.compute_bound = 1
        self.check(library.measure_distance(self.handle, a, b, C.byref(options), C.byref(report)))
        return report.hausdorff_bound


class Result:
    def __init__(self, mesh):
        info = made(capi.delmesh_mesh_info)
        library.mesh_get_info(mesh, C.byref(info))
        corners = 3 * info.faces

        def read(what, count, components, dtype):
            array = np.zeros((count, components) if components > 1 else count, dtype)
            status = library.mesh_read(mesh, what, C.byref(view(array, capi.delmesh_view_mut)))
            if status != 0:
                raise RuntimeError(f"array {what}: status {status}")
            return array

        self.points = read(POSITION, info.vertices, 3, np.float64)
        self.verts, self.twin = read(CORNER_VERT, corners, 1, np.int32), read(CORNER_TWIN, corners, 1, np.int32)
        self.edge, self.face_source = read(CORNER_EDGE, corners, 1, np.int32), read(FACE_SOURCE, info.faces, 1, np.int32)
        self.flags, self.edge_source = read(EDGE_FLAGS, info.edges, 1, np.int32), read(EDGE_SOURCE, info.edges, 1, np.int32)
        self.map, self.weight = read(MAP_CORNER, corners, 3, np.int32), read(MAP_WEIGHT, corners, 3, np.float64)
        self.faces = info.faces

    def bytes(self):
        return b"".join(a.tobytes() for a in (self.points, self.verts, self.flags, self.edge_source, self.map, self.weight))


def closest(x, a, b, c):
    """The closest point to x on each triangle, as weights: n x 3, by the seven regions."""
    def along(p, q):
        d = q - p
        length = np.maximum((d * d).sum(1), 1e-300)
        return np.clip(((x - p) * d).sum(1) / length, 0, 1)

    n = np.cross(b - a, c - a)
    area = np.maximum((n * n).sum(1), 1e-300)
    wb, wc = (np.cross(x - a, c - a) * n).sum(1) / area, (np.cross(b - a, x - a) * n).sum(1) / area
    inside = np.stack([1 - wb - wc, wb, wc], 1)
    t, zero = [along(a, b), along(b, c), along(c, a)], np.zeros(len(a))
    tries = [inside, np.stack([1 - t[0], t[0], zero], 1), np.stack([zero, 1 - t[1], t[1]], 1), np.stack([t[2], zero, 1 - t[2]], 1)]
    points = [w[:, :1] * a + w[:, 1:2] * b + w[:, 2:] * c for w in tries]
    far = np.stack([((p - x)**2).sum(1) for p in points], 1)
    far[(inside < 0).any(1), 0] = np.inf
    best = far.argmin(1)
    rows = np.arange(len(a))
    return np.stack(tries, 1)[rows, best], far[rows, best]


class Tally:
    def __init__(self, verbose):
        self.passed, self.failed, self.verbose = 0, 0, verbose

    def that(self, name, condition, what):
        if condition:
            self.passed += 1
        else:
            self.failed += 1
            print(f"FAILED {name}: {what}")


def swim(source, triangles, result, uv):
    """How far UVs in the middle of faces are from those of the source's surface, in units of what a face of that size has there."""
    at_border = np.nonzero((result.flags[result.edge].reshape(-1, 3) & (EDGE_UV | EDGE_MATERIAL) != 0).any(1))[0]
    chosen = np.linspace(0, result.faces - 1, PROBES).astype(int)
    if len(at_border):
        chosen = np.concatenate([chosen, at_border[np.linspace(0, len(at_border) - 1, PROBES).astype(int)]])
    chosen = np.unique(chosen)
    corners, charts = triangles
    places = source.points.astype(float)[source.verts[corners]]
    off = []
    for f in chosen:
        own, x = uv[3 * f:3 * f + 3], result.points[result.verts[3 * f:3 * f + 3]]
        which = np.nonzero(charts == source.chart[result.face_source[f]])[0]
        weights, far = closest(x.mean(0), *(places[which, k] for k in range(3)))
        best = which[far.argmin()]
        there = weights[far.argmin()] @ source.uv[corners[best]]
        stretch = max(np.linalg.norm(source.uv[corners[best, i]] - source.uv[corners[best, i - 1]]) /
                      max(np.linalg.norm(places[best, i] - places[best, i - 1]), 1e-300) for i in range(3))
        size = stretch * max(np.linalg.norm(x[i] - x[i - 1]) for i in range(3))
        if size > 0:
            off.append(np.linalg.norm(there - own.mean(0)) / size)
    return np.array(off or [0.0])


def check_law(tally, name, source, triangles, result, allowed):
    corner = np.arange(3 * result.faces)
    following = np.where(corner % 3 == 2, corner - 2, corner + 1)
    tally.that(name, np.abs(result.weight.sum(1) - 1).max() < 1e-12 and result.weight.min() >= -1e-15,
               f"weights from {result.weight.min():.3g}, sums off by {np.abs(result.weight.sum(1) - 1).max():.3g}")
    used = result.weight > 0
    polygon = source.polygon[result.map]
    first = polygon[corner, used.argmax(1)]
    tally.that(name, (polygon == first[:, None])[used].all(), "places between polygons")
    uv = (source.uv[result.map] * result.weight[:, :, None]).sum(1)
    flags = result.flags[result.edge]
    free = (result.twin > corner) & (flags & (EDGE_UV | EDGE_MATERIAL) == 0)
    a, t = corner[free], result.twin[free]
    apart = np.maximum(np.abs(uv[a] - uv[following[t]]), np.abs(uv[following[a]] - uv[t])).max(initial=0)
    tally.that(name, apart <= 1e-12, f"UVs differ by {apart:.3g} across an edge that is no border")
    chart = source.chart[first].reshape(-1, 3)
    straddling = (chart != source.chart[result.face_source][:, None]).any(1).sum()
    tally.that(name, straddling == 0, f"{straddling} faces straddle a border")
    at = (source.points.astype(float)[source.verts][result.map] * result.weight[:, :, None]).sum(1)
    far = np.linalg.norm(at - result.points[result.verts], axis=1).max() / source.diagonal
    tally.that(name, far <= allowed, f"a place is {far:.3g} of the diagonal off, more than {allowed:.3g}")
    lines = flags & (EDGE_UV | EDGE_MATERIAL) != 0
    sources = result.edge_source[result.edge[lines]]
    tally.that(name, (sources >= 0).all() and source.is_border[sources].all(), "sources of borders")
    off = swim(source, triangles, result, uv)
    # The texture lies still, as far as the surface does: a level of a few faces is another thing than its source.
    median, many = (0.05, 0.01) if result.faces >= 1000 else (0.2, 0.05)
    tally.that(name, np.median(off) < median and np.mean(off > 1) <= many,
               f"UVs off by {np.median(off):.3g} of a face, {np.mean(off > 1):.3g} by more than all of it")
    if tally.verbose:
        print(f"{name}: F {result.faces} far {far:.2e} ({allowed:.2e}) off {np.median(off):.3g} {off.max():.3g} "
              f"over {np.mean(off > 1):.3g} "
              f"exact {np.mean((result.weight == 1).any(1)):.3f} borders {np.count_nonzero(lines)}")


def check_mesh(tally, source):
    contexts = [Context(1), Context(2)]
    meshes = [c.create(source) for c in contexts]
    given = Result(meshes[0])
    triangles = given.map[:, 0].reshape(-1, 3), source.chart[given.face_source]
    for mode in MODES:
        runs = [[("remesh", c.remesh(m, mode))] + [(f"{ratio} quality {quality}", level) for quality in (0, 6)
                for ratio, level in zip((1, *RATIOS), c.levels(m, mode, quality))] for c, m in zip(contexts, meshes)]
        for (what, one), (_, two) in zip(*runs):
            name, result = f"{source.name} {mode} {what}", Result(one)
            allowed = 3 * contexts[1].distance(meshes[1], two) / source.diagonal + 1e-5
            check_law(tally, name, source, triangles, result, allowed)
            tally.that(name, result.bytes() == Result(two).bytes(), "other bytes with 2 threads")
        for _, each in sum(runs, []):
            library.mesh_destroy(each)
    for context, mesh in zip(contexts, meshes):
        library.mesh_destroy(mesh)
        library.context_destroy(context.handle)


def main():
    global library
    parser = argparse.ArgumentParser()
    parser.add_argument("--short", action="store_true")
    parser.add_argument("--only", default="")
    parser.add_argument("--verbose", action="store_true")
    options = parser.parse_args()
    library, tally, skipped = _library.loaded_library(), Tally(options.verbose), 0
    if options.only in "tube":
        check_mesh(tally, tube())
    for name in SHORT if options.short else MESHES:
        if options.only not in name:
            continue
        if (DATA / name).exists():
            check_mesh(tally, read_obj(DATA / name))
        else:
            print(f"SKIPPED: {name} is not here")
            skipped += 1
    print(f"{tally.passed} passed, {tally.failed} failed, {skipped} skipped")
    sys.exit(tally.failed != 0)


if __name__ == "__main__":
    main()
