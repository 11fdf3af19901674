# SPDX-License-Identifier: Apache-2.0
"""Draws a textured model, what the modes make of it and its LOD of a tenth, side by side: a checkerboard through the UVs as the layers
of the Python package carry them. Below, closer, with edges, and the seams of the texture in red. Prints how many of the input's pixels
have another colour of the board.

    texture_picture.py [MODEL.obj] [OUT.png]        by default blub of the shared data, and docs/pictures/texture.png

Needs numpy, and the package: PYTHONPATH=bindings/python DELMESH_LIBRARY=FILE.
"""
import os
import sys
from pathlib import Path

import numpy as np
from demo_picture import PAPER, draw, headline, read_obj, view_from, write_png

import delmesh

ROOT = Path(__file__).resolve().parents[1]
DATA = Path(os.environ.get("DELMESH_SHARED", ROOT.parent / "shared")) / "data"
PANEL, SQUARES = 400, 32  # pixels; squares of the board over the texture's width


def board(uvs, flat=False):
    """The painter of a checkerboard, its dark squares tinted by where they lie on the texture; flat: only 0 and 255."""
    def paint(f, weights):
        u, v = (sum(weight * uvs[f, corner, axis] for corner, weight in enumerate(weights)) for axis in (0, 1))
        a, b = np.floor(u * SQUARES), np.floor(v * SQUARES)
        dark = (a + b) % 2 == 1
        if flat:
            return np.where(dark[..., None], 0.0, 255.0) * np.ones(3)
        tint = np.stack([60 + 150 * a / SQUARES, 110 + 0 * a, 60 + 150 * b / SQUARES], axis=-1)
        return np.where(dark[..., None], tint, (238, 232, 218))

    return paint


def main():
    model, target = (sys.argv[1:] + ["", ""])[:2]
    points, faces, uvs = read_obj(Path(model or DATA / "clean" / "blub_triangulated.obj"))
    faces = np.array(faces)
    given = {"layers": {"uv": uvs.reshape(*faces.shape, 2)}}
    meshes = [("INPUT", delmesh.Mesh(points, faces, **given))]
    meshes += [(mode, delmesh.remesh(points, faces, mode=mode, **given).mesh) for mode in ("preserve", "flip")]
    meshes.append(("LOD 10 %", delmesh.decimate(points, faces, ratio=0.1, **given).mesh))

    axes, centre, half = view_from([0.86, 0.22, 0.46], points, 1.06)
    near = centre + axes.T @ (np.array([-0.52, 0.05, 0.3]) * half)
    columns, first, rows = [], None, slice(None)
    for name, mesh in meshes:
        uv = np.asarray(mesh.layers["uv"], float)
        seams = mesh.edges[(mesh.edge_flags & delmesh.EDGE_UV) != 0].tolist()
        triangles = mesh.faces.tolist()
        whole = draw(mesh.positions, triangles, [], (axes, centre, half), board(uv), False, PANEL)
        if first is None:  # without most of the paper above and below
            drawn = np.flatnonzero((whole != PAPER).any(axis=(1, 2)))
            rows = slice(max(drawn[0] - 12, 0), drawn[-1] + 24)
        close = draw(mesh.positions, triangles, seams, (axes, near, 0.24 * half), board(uv), True, PANEL)
        columns.append(np.vstack([headline(f"{name}  {len(triangles)}", PANEL), whole[rows], close]))
        plain = draw(mesh.positions, triangles, [], (axes, centre, half), board(uv, True), False, PANEL).astype(int)
        first = plain if first is None else first
        seen = ~((first == PAPER).all(axis=2) | (plain == PAPER).all(axis=2))
        other = np.abs(first - plain).max(axis=2) > 100
        print(f"{name}: {len(triangles)} triangles, {100 * other[seen].mean():.2f} % of the pixels differ")
    write_png(target or ROOT / "docs" / "pictures" / "texture.png", np.hstack(columns))


if __name__ == "__main__":
    main()
