# SPDX-License-Identifier: Apache-2.0
"""numpy arrays as views of delmesh.h and back, without a copy where the layout allows it."""
import ctypes as C

import numpy as np

from . import _capi
from .errors import InvalidArgument

_TYPES = {("f", 4): _capi.DELMESH_FLOAT32, ("f", 8): _capi.DELMESH_FLOAT64, ("i", 4): _capi.DELMESH_INT32,
          ("u", 4): _capi.DELMESH_UINT32, ("i", 8): _capi.DELMESH_INT64, ("u", 1): _capi.DELMESH_UINT8}
DTYPES = {number: np.dtype(f"{kind}{size}") for (kind, size), number in _TYPES.items()}


def _native(array, name, floating, bytes_too):
    """`array` with a type that a view can have: itself, or a converted copy."""
    if array.dtype.kind == "b" and bytes_too:
        array = array.view(np.uint8)
    kind = array.dtype.kind
    if array.size == 0 and kind not in "iu":  # np.asarray([]) is float64
        array = array.astype(np.float64 if floating else np.int32)
    elif kind not in ("iuf" if floating else "iu"):
        raise InvalidArgument(f"The argument '{name}' had the type {array.dtype}, which is not "
                              f"{'a real number' if floating else 'an integer'}.")
    elif floating:
        if (kind, array.itemsize) not in (("f", 4), ("f", 8)):
            array = array.astype(np.float32 if kind == "f" and array.itemsize < 4 else np.float64)
    elif (kind, array.itemsize) == ("u", 8):
        if int(array.max()) > np.iinfo(np.int64).max:
            raise InvalidArgument(f"The argument '{name}' held an index of 2^63 or more.")
        array = array.astype(np.int64)
    elif array.itemsize < 4 and not (bytes_too and (kind, array.itemsize) == ("u", 1)):
        array = array.astype(np.int32)
    return array if array.dtype.isnative else array.astype(array.dtype.newbyteorder("="))


def view(values, name, components, floating=False, bytes_too=False):
    """-> (delmesh_view, the array behind it, which must outlive the view). bytes_too: uint8 is taken as it is."""
    array = _native(np.asarray(values), name, floating, bytes_too)
    shape = (components,) if components > 1 else ()
    if array.size == 0:
        array = array.reshape((0, *shape))
    if array.shape[1:] != shape or array.ndim == 0:
        expected = f"(n, {components})" if components > 1 else "(n,)"
        raise InvalidArgument(f"The argument '{name}' had the shape {array.shape} and not {expected}.")
    packed_inside = components == 1 or array.strides[1] == array.itemsize
    if not (array.flags.aligned and packed_inside and array.strides[0] >= array.itemsize * components):
        array = np.ascontiguousarray(array)
    return _capi.delmesh_view(array.ctypes.data, len(array), array.strides[0], _TYPES[array.dtype.kind, array.itemsize],
                              components), array


def rows_view(array):
    """-> (delmesh_view, the array behind it) of an (n, ...) array of a type that a view can have: a row is an element."""
    rows = array.reshape(len(array), int(np.prod(array.shape[1:])))
    packed_inside = rows.shape[1] == 1 or rows.strides[1] == rows.itemsize
    if not (rows.flags.aligned and packed_inside and rows.strides[0] >= rows.itemsize * rows.shape[1]):
        rows = np.ascontiguousarray(rows)
    return _capi.delmesh_view(rows.ctypes.data, len(rows), rows.strides[0], _TYPES[rows.dtype.kind, rows.itemsize],
                              rows.shape[1]), rows


def rows_view_mut(array):
    """The same for a contiguous array that is written."""
    view, _ = rows_view(array)
    return _capi.delmesh_view_mut(view.data, view.count, view.stride, view.type, view.components)


def view_mut(array, name):
    """The same for an array that is written; it is taken as it is or refused."""
    usable = isinstance(array, np.ndarray) and array.flags.writeable and array.flags.aligned and array.dtype.isnative
    if not usable or (array.dtype.kind, array.itemsize) not in _TYPES or array.ndim not in (1, 2):
        raise InvalidArgument(f"The argument '{name}' was not a writable, aligned numpy array of one or two dimensions and of "
                              "float32, float64, int32, uint32, int64 or uint8.")
    components = array.shape[1] if array.ndim == 2 else 1
    if len(array) and (array.strides[0] <= 0 or (components > 1 and array.strides[1] != array.itemsize)):
        raise InvalidArgument(f"The argument '{name}' had strides that cannot be written through: {array.strides}.")
    return _capi.delmesh_view_mut(array.ctypes.data, len(array), array.strides[0],
                                  _TYPES[array.dtype.kind, array.itemsize], components)


def borrowed(source, owner, columns):
    """A read-only array over a delmesh_view that keeps `owner` alive."""
    dtype = DTYPES[source.type]
    step = dtype.itemsize * source.components
    count = source.count * source.components // columns
    if count == 0:
        array = np.empty(0, dtype)
    elif source.stride not in (0, step):
        raise NotImplementedError("the library lent an array that is not tightly packed")
    else:
        memory = (C.c_char * (source.count * step)).from_address(source.data)
        memory.owner = owner
        array = np.frombuffer(memory, dtype)
    array.flags.writeable = False
    return array.reshape(count, columns) if columns > 1 else array
