# SPDX-License-Identifier: Apache-2.0
"""Sparse weights of vertices, as armatures have them."""
from __future__ import annotations

from collections.abc import Hashable
from typing import Any, Literal, NamedTuple

import numpy as np

from . import _arrays, _capi
from .core import CancelToken, Context, Progress, _prepare
from .errors import InvalidArgument


class Rows(NamedTuple):
    """Row v has the entries indices[k], values[k] for k from offsets[v] to offsets[v + 1]."""

    offsets: np.ndarray
    indices: np.ndarray
    values: np.ndarray


_NORMALISE: dict[Any, int] = {False: 0, True: 1, "sum": 2}


def transfer_rows(mesh, offsets, indices, values, *, limit: int = 4, normalise: bool | Literal["sum"] = True,
                  progress: Progress = None, cancel: CancelToken | None = None, context: Context | None = None) -> Rows:
    """Carries sparse vertex weights of the source to `mesh`, a Mesh or Result made of it: (offsets, indices, values).

    offsets    (v + 1,) integers, ascending from 0: row v has the entries offsets[v] to offsets[v + 1] of
    indices    (n,) integers, 0 or more, and
    values     (n,) float32 or float64; anything else is converted
    limit      entries per vertex: the largest are kept
    normalise  True: rows sum to 1; "sum": to what they did before the limit; False: as they are

    The results have the same types; rows ascend by index and hold no 0.
    """
    if not 1 <= limit <= 65535:  # here, as ctypes drops the bits that do not fit
        raise InvalidArgument(f"The argument 'limit' was {limit}, outside 1 to 65535.")
    if not isinstance(normalise, Hashable) or normalise not in _NORMALISE:
        raise InvalidArgument(f"The argument 'normalise' was {normalise!r}, which is not one of True, False, sum.")
    context, mesh = _prepare(context, cancel, mesh)
    source, target, keep = _capi.delmesh_rows(), _capi.delmesh_rows_mut(), []
    for name, array in zip(Rows._fields, (offsets, indices, values)):
        view, array = _arrays.view(array, name, 1, floating=name == "values")
        setattr(source, name, view)
        keep.append(array)
    made = [np.empty(mesh.info.vertices + 1, keep[0].dtype)]
    target.offsets = _arrays.rows_view_mut(made[0])
    arguments = mesh._handle.pointer, source, limit, _NORMALISE[normalise], target
    run = context._library.transfer_sparse
    context._call(run, *arguments, progress=progress, cancel=cancel)  # only counts
    made += [np.empty(int(made[0][-1]), array.dtype) for array in keep[1:]]
    target.indices, target.values = _arrays.rows_view_mut(made[1]), _arrays.rows_view_mut(made[2])
    if len(made[1]):
        context._call(run, *arguments, progress=progress, cancel=cancel)
    return Rows(*made)
