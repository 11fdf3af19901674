# SPDX-License-Identifier: Apache-2.0
"""Makes LODs of a textured OBJ file that load with the same texture (pip install delmesh). Reads and writes positions, texture
coordinates and materials by itself; the command `delmesh lod` does the same and more.

    texture.py IN.obj OUT.obj [RATIO...]            OUT.0.obj is Delaunay with all details, OUT.1.obj the first ratio, ...
"""
import pathlib
import sys

import delmesh
import numpy as np


def read(path):
    """-> positions, corners' vertices, faces' sizes, corners' UVs (NaN: none), faces' materials, names of these, mtllib lines."""
    points, coordinates, verts, texture, sizes, materials, names, libraries = [], [], [], [], [], [], [], []
    for line in path.read_text().splitlines():
        word, *rest = line.split() or [""]
        if word == "v":
            points.append([float(x) for x in rest[:3]])
        elif word == "vt":
            coordinates.append([float(x) for x in rest[:2]])
        elif word == "mtllib":
            libraries.append(line)
        elif word == "usemtl":
            names.append(line)
        elif word == "f":
            sizes.append(len(rest))
            materials.append(len(names) - 1)
            for corner in rest:
                v, vt, *_ = [int(number or 0) for number in corner.split("/")] + [0]
                verts.append(v - 1 if v > 0 else len(points) + v)
                texture.append(vt - 1 if vt > 0 else len(coordinates) + vt if vt < 0 else -1)
    uvs = np.array(coordinates + [[np.nan, np.nan]])[texture]
    unique, number = np.unique(names, return_inverse=True)  # a material may be named many times
    return np.array(points), verts, sizes, uvs, np.append(number, -1)[materials], list(unique), libraries


def write(path, mesh, names, libraries):
    uvs, index = np.unique(mesh.layers["uv"].reshape(-1, 2), axis=0, return_inverse=True)
    corners = np.stack([mesh.faces.reshape(-1), index.reshape(-1)], axis=1).reshape(-1, 3, 2) + 1
    lines = list(libraries)
    lines += ["v %.9g %.9g %.9g" % tuple(point) for point in mesh.positions.tolist()]
    lines += ["vt %.9g %.9g" % tuple(uv) for uv in uvs.tolist()]
    before = -1
    order = np.argsort(mesh.layers["material"], kind="stable")  # faces without one first: nothing takes a usemtl back
    for face, material in zip(corners[order].tolist(), mesh.layers["material"][order].tolist()):
        if material != before:
            lines.append(names[material])
            before = material
        lines.append("f " + " ".join(str(v) if np.isnan(uvs[vt - 1]).any() else f"{v}/{vt}" for v, vt in face))
    path.write_text("\n".join(lines) + "\n")


source, target, *ratios = sys.argv[1:]
points, verts, sizes, uvs, materials, names, libraries = read(pathlib.Path(source))
mesh = delmesh.Mesh(points, corner_verts=verts, face_sizes=sizes, layers={"uv": uvs, "material": materials})
print(f"{mesh.layer_borders['uv']} edges are seams of the texture, {mesh.layer_borders['material']} lie between materials")
targets = ["full", *(("ratio", float(ratio)) for ratio in ratios or ["0.5", "0.1"])]
family = delmesh.lod_family(mesh, targets=targets)
for i, level in enumerate(family.levels):
    path = pathlib.Path(target).with_suffix(f".{i}.obj")
    write(path, level, names, libraries)
    print(f"{path}: {len(level.faces)} triangles")
