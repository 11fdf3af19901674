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
from demo_picture import CAPTION, INK, PAPER, caption_rows, draw, write_png

import delmesh

ROOT = Path(__file__).resolve().parents[1]
DATA = Path(os.environ.get("DELMESH_SHARED", ROOT.parent / "shared")) / "data"
PANEL, RATE, RATIOS = 380, 8, (0.25, 0.07, 0.02)  # pixels; pieces per edge of the cage; of the triangles


def read_obj(path):
    """-> points, faces of any size, UVs of their corners one after the other."""
    points, coordinates, faces, uvs = [], [], [], []
    for line in path.read_text().splitlines():
        word, *rest = line.split() or [""]
        if word == "v":
            points.append([float(x) for x in rest[:3]])
        elif word == "vt":
            coordinates.append([float(x) for x in rest[:2]])
        elif word == "f":
            corners = [corner.split("/") for corner in rest]
            faces.append([int(corner[0]) - 1 for corner in corners])
            uvs += [coordinates[int(corner[1]) - 1] for corner in corners]
    return np.array(points), faces, np.array(uvs)


def seams_of(faces, uvs):
    """The edges at which the UVs of the two faces differ."""
    sides, at = {}, 0
    for face in faces:
        for k, a in enumerate(face):
            b = face[(k + 1) % len(face)]
            here = {a: tuple(uvs[at + k]), b: tuple(uvs[at + (k + 1) % len(face)])}
            sides.setdefault(frozenset((a, b)), []).append(here)
        at += len(face)
    return [edge for edge, of in sides.items() if any(other != of[0] for other in of)]


def main():
    source, target = (sys.argv[1:] + ["", ""])[:2]
    points, faces, uvs = read_obj(Path(source or DATA / "clean" / "spot_control_mesh.obj"))
    cage = delmesh.Cage(points, corner_verts=np.concatenate(faces), face_sizes=[len(face) for face in faces], layers={"uv": uvs})
    dense = cage.subdivide(RATE)
    levels = delmesh.lod_family(dense, ratios=RATIOS).levels
    edges = [(a, b) for face in faces for a, b in zip(face, face[1:] + face[:1])]
    fans = [(face[0], b, c) for face in faces for b, c in zip(face[1:], face[2:])]
    panels = [(f"CAGE  {len(faces)}", points, fans, seams_of(faces, uvs), edges)]
    for name, mesh in [("LIMIT", dense.mesh)] + [("LOD", level) for level in levels]:
        if name == "LOD" and not delmesh.certify(mesh).delaunay:
            sys.exit("a level is not Delaunay")
        seams = mesh.edges[(mesh.edge_flags & delmesh.EDGE_UV) != 0].tolist()
        panels.append((f"{name}  {mesh.info.faces}", mesh.positions, mesh.faces.tolist(), seams, name == "LOD"))

    eye = np.array([-0.62, 0.3, 0.72]) / np.linalg.norm([0.62, 0.3, 0.72])
    right = np.cross([0, 1.0, 0], eye)
    right /= np.linalg.norm(right)
    axes = np.array([right, np.cross(eye, right), eye])
    centre = (points.min(0) + points.max(0)) / 2
    half = 1.12 * np.abs((points - centre) @ axes[:2].T).max()
    columns = []
    for caption, positions, triangles, seams, wires in panels:
        head = np.empty((CAPTION, PANEL, 3), np.uint8)
        head[:] = PAPER
        text = caption_rows(caption, 2)
        head[16:16 + text.shape[0], 12:12 + text.shape[1]][text] = INK
        columns.append(np.vstack([head, draw(positions, triangles, seams, (axes, centre, half), None, wires, PANEL)]))
    image = np.hstack(columns)
    drawn = np.flatnonzero((image[CAPTION:] != PAPER).any(axis=(1, 2)))
    image = np.vstack([image[:CAPTION], image[CAPTION:][drawn[0]:drawn[-1] + 12]])
    write_png(target or ROOT / "docs" / "pictures" / "cage.png", image)


if __name__ == "__main__":
    main()
