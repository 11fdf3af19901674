# SPDX-License-Identifier: Apache-2.0
"""Makes a mesh file Delaunay, with trimesh as reader and writer (pip install delmesh trimesh).

    with_trimesh.py IN OUT [preserve | flip | feature]
"""
import sys

import delmesh
import trimesh

source, target, *mode = sys.argv[1:]
mesh = trimesh.load(source, force="mesh", process=False)  # process would merge vertices and reorder them
result = delmesh.remesh(mesh, mode=mode[0] if mode else "preserve")
report = result.report
print(f"{report.nld_in} edges were not Delaunay, now {report.nld_out}; {report.vertices_in} vertices became {report.vertices_out}")
trimesh.Trimesh(result.vertices, result.faces, process=False).export(target)
