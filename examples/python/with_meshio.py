# SPDX-License-Identifier: Apache-2.0
"""Writes a mesh file at a tenth of its triangles, still Delaunay, with meshio as reader and writer (pip install delmesh meshio).

    with_meshio.py IN OUT [RATIO]
"""
import sys

import delmesh
import meshio

source, target, *ratio = sys.argv[1:]
mesh = meshio.read(source)
faces = mesh.cells_dict.get("triangle")
if faces is None:
    sys.exit(f"{source} has no triangles")
result = delmesh.decimate(mesh.points, faces, ratio=float(ratio[0]) if ratio else 0.1)
level = result.report.levels[0]
print(f"{len(faces)} triangles became {level.faces}; stopped by: {level.stopped_by}")
meshio.write(target, meshio.Mesh(result.vertices, {"triangle": result.faces}))
