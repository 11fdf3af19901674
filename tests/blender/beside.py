# SPDX-License-Identifier: Apache-2.0
"""Two OpenSubdivs in one process: the host's, which its Subdivision Surface modifier uses, and the library's own. Each is used
before and after the other, and both give the same limit surface. Run by run.py --beside, in Blender or with the bpy package."""
import os
import pathlib
import sys
import traceback

import bpy
import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "bindings" / "python"))
import delmesh

LEVEL = 3


def cage():
    """A box, bent, without its lid, with a crease around its bottom."""
    points = np.array([[x, y, z + 0.3 * x * y] for z in (-1.0, 0.0, 1.5) for y in (-1.0, 1.0) for x in (-1.0, 1.0)])
    ring = ((0, 1), (1, 3), (3, 2), (2, 0))
    quads = np.array([[0, 2, 3, 1]] + [[a + k, b + k, b + k + 4, a + k + 4] for k in (0, 4) for a, b in ring])
    return points, quads, [(0, 2), (2, 3), (3, 1), (1, 0)]


def by_host(points, quads, creases):
    mesh = bpy.data.meshes.new("cage")
    mesh.from_pydata(points.tolist(), [], quads.tolist())
    mesh.update()
    wanted = {tuple(sorted(edge)) for edge in creases}
    if bpy.app.version < (4, 0):
        for edge in mesh.edges:
            edge.crease = float(tuple(sorted(edge.vertices)) in wanted)
    else:
        layer = mesh.attributes.new("crease_edge", "FLOAT", "EDGE")
        for edge in mesh.edges:
            layer.data[edge.index].value = float(tuple(sorted(edge.vertices)) in wanted)
    thing = bpy.data.objects.new("cage", mesh)
    bpy.context.scene.collection.objects.link(thing)
    modifier = thing.modifiers.new("subdivision", "SUBSURF")
    modifier.levels = modifier.render_levels = LEVEL
    modifier.use_limit_surface = True
    modifier.quality = 6
    modifier.boundary_smooth = "PRESERVE_CORNERS"
    made = thing.evaluated_get(bpy.context.evaluated_depsgraph_get()).to_mesh()
    result = np.empty(3 * len(made.vertices), np.float32)
    made.vertices.foreach_get("co", result)
    bpy.data.objects.remove(thing)
    return result.reshape(-1, 3)


def by_library(points, quads, creases):
    made = delmesh.subdivide(points, quads, 2**LEVEL, creases=(creases, [10.0] * len(creases)))
    assert made.mesh.info.boundary_edges == 4 * 2**LEVEL, made.mesh.info
    level = delmesh.decimate(made, ratio=0.2)
    assert delmesh.certify(level).delaunay
    return made.vertices.copy()


def main():
    try:
        delmesh.Cage(*cage()[:2])
    except delmesh.Unsupported:
        print("SKIPPED: the library was built without OpenSubdiv")
        return 77
    results = [by(*cage()) for by in (by_library, by_host, by_library, by_host)]
    ours, theirs = results[:2]
    assert np.array_equal(ours, results[2]) and np.array_equal(theirs, results[3]), "results changed beside the other"
    assert len(ours) == len(theirs), (len(ours), len(theirs))
    apart = np.abs(ours[:, None, :] - theirs[None, :, :]).max(axis=2)
    worst = max(apart.min(axis=0).max(), apart.min(axis=1).max())
    assert worst < 1e-5, worst
    maps = open("/proc/self/maps", encoding="utf-8").read() if os.path.exists("/proc/self/maps") else ""
    loaded = sorted({line.split("/")[-1] for line in maps.splitlines() if "osdcpu" in line.lower() or "delmesh" in line})
    print(f"Blender {bpy.app.version_string}: {len(ours)} vertices, {worst:.1e} apart at most; loaded: {', '.join(loaded)}")
    return 0


if __name__ == "__main__":
    try:
        status = main()
    except BaseException:
        traceback.print_exc()
        status = 1
    sys.stdout.flush()
    os._exit(status)  # Blender would take the status for its own
