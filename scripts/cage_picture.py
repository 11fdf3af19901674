# SPDX-License-Identifier: Apache-2.0
"""Draws a control cage, the dense mesh of its limit surface and three Delaunay levels of that side by side, with the borders of the
texture in red and, but for the dense mesh, all edges.

    cage_picture.py [CAGE.obj] [OUT.png]        by default spot of the shared data, and docs/pictures/cage.png

Needs numpy, and the package with cages: PYTHONPATH=bindings/python DELMESH_LIBRARY=FILE.
"""
import os
import sys
from pathlib import Path

import numpy as np
from demo_picture import CAPTION, PAPER, draw, headline, read_obj, view_from, write_png

import delmesh

ROOT = Path(__file__).resolve().parents[1]
DATA = Path(os.environ.get("DELMESH_SHARED", ROOT.parent / "shared")) / "data"
PANEL, RATE, RATIOS = 380, 8, (0.25, 0.07, 0.02)  # pixels; pieces per edge of the cage; of the triangles


def main():
    source, target = (sys.argv[1:] + ["", ""])[:2]
    points, faces, uvs = read_obj(Path(source or DATA / "clean" / "spot_control_mesh.obj"))
    given = {"corner_verts": np.concatenate(faces), "face_sizes": [len(face) for face in faces], "layers": {"uv": uvs}}
    dense = delmesh.Cage(points, **given).subdivide(RATE)
    levels = delmesh.lod_family(dense, ratios=RATIOS).levels
    edges = [(a, b) for face in faces for a, b in zip(face, face[1:] + face[:1])]
    view, columns = view_from([-0.62, 0.3, 0.72], points, 1.12), []
    meshes = [("CAGE", delmesh.Mesh(points, **given)), ("LIMIT", dense.mesh)] + [("LOD", level) for level in levels]
    for name, mesh in meshes:
        if name == "LOD" and not delmesh.certify(mesh).delaunay:
            sys.exit("a level is not Delaunay")
        seams = mesh.edges[(mesh.edge_flags & delmesh.EDGE_UV) != 0].tolist()
        drawn = draw(mesh.positions, mesh.faces.tolist(), seams, view, None, edges if name == "CAGE" else name == "LOD", PANEL)
        columns.append(np.vstack([headline(f"{name}  {len(faces) if name == 'CAGE' else mesh.info.faces}", PANEL), drawn]))
    image = np.hstack(columns)
    drawn = np.flatnonzero((image[CAPTION:] != PAPER).any(axis=(1, 2)))
    image = np.vstack([image[:CAPTION], image[CAPTION:][drawn[0]:drawn[-1] + 12]])
    write_png(target or ROOT / "docs" / "pictures" / "cage.png", image)


if __name__ == "__main__":
    main()
