# SPDX-License-Identifier: Apache-2.0
"""What meshes and cages are given alike: views of arrays, faces in any of their forms, edges with marks, and layers, which errors
call by their names."""
import contextlib
import re
from collections.abc import Mapping

import numpy as np

from . import _arrays, _capi
from .errors import DelmeshError, InvalidArgument


class Given:
    """Fills the views of a desc, and holds the arrays that they point into."""

    def __init__(self, desc):
        self.desc, self.arrays = desc, []

    def __call__(self, name, values, components, called=None, **kinds):
        """called: what the caller knows it by."""
        if values is not None:
            view, array = _arrays.view(values, called or name, components, **kinds)
            setattr(self.desc, name, view)
            self.arrays.append(array)

    def faces(self, faces, corner_verts, face_offsets, face_sizes):
        """-> (shape of `faces` or None, the corners' vertices one after the other, {domain: count}); the positions
        were given before."""
        if (faces is None) == (corner_verts is None):
            raise InvalidArgument("Exactly one of 'faces' and 'corner_verts' must be given.")
        shape = None
        if faces is not None:
            faces = np.asarray(faces)
            if faces.size == 0:
                faces = np.empty((0, 3), np.int32)
            if faces.ndim != 2 or faces.shape[1] < 3:
                raise InvalidArgument(f"The argument 'faces' had the shape {faces.shape} and not (m, 3) or more corners.")
            shape = faces.shape
            if shape[1] > 3:
                corner_verts, face_sizes = np.ascontiguousarray(faces).reshape(-1), np.full(len(faces), shape[1], np.int32)
        if corner_verts is None:
            self("corner_verts", faces, 3, called="faces")
            corner_verts = faces
        else:
            self("corner_verts", corner_verts, 1, called="corner_verts" if faces is None else "faces")
        self("face_offsets", face_offsets, 1)
        self("face_sizes", face_sizes, 1, bytes_too=True)
        corners = np.asarray(corner_verts).reshape(-1)
        count = self.desc.face_sizes.count or max(self.desc.face_offsets.count - 1, 0) or len(corners) // 3
        return shape, corners, {"vertex": self.desc.positions.count, "corner": len(corners), "face": count}

    def edges(self, edges, edge_marks):
        self("edge_verts", edges, 2)
        if edge_marks is not None:
            edge_marks = np.asarray(edge_marks)
            if edge_marks.dtype.kind == "b":
                edge_marks = edge_marks * np.int32(_capi.DELMESH_EDGE_MARKED)
            self("edge_marks", edge_marks, 1, bytes_too=True)


def check_names(layers):
    """layers: a mapping from names, or None for none."""
    if layers and not (isinstance(layers, Mapping) and all(isinstance(name, str) for name in layers)):
        raise TypeError("expected 'layers' as {name: array}")


@contextlib.contextmanager
def layers_by_name(names):
    """The library knows the numbers of layers only."""
    try:
        yield
    except DelmeshError as error:
        error.args = (re.sub(r"\blayers\[(\d+)\]", lambda found: f"layers[{names[int(found[1])]}]", str(error)),)
        raise
