# SPDX-License-Identifier: Apache-2.0
"""Every way a call can fail, one class per status of delmesh.h. The message is the library's own sentence."""
from __future__ import annotations

from typing import Any

from . import _capi


class DelmeshError(Exception):
    """The base of all errors of this package. `status` is the number of delmesh.h (None where no library was reached), `report`
    the part of a report that was filled before the error, or None."""

    status: int | None = None
    report: Any = None


class LibraryNotFound(DelmeshError):
    """The shared library is not there or cannot be loaded."""


class AbiMismatch(DelmeshError):
    """The shared library was built from another version of delmesh.h than this package."""


class InvalidArgument(DelmeshError, ValueError):
    status = _capi.DELMESH_ERROR_INVALID_ARGUMENT


class OutOfMemory(DelmeshError, MemoryError):
    status = _capi.DELMESH_ERROR_OUT_OF_MEMORY


class MemoryLimit(OutOfMemory):
    """The context's memory_limit would have been exceeded."""
    status = _capi.DELMESH_ERROR_MEMORY_LIMIT


class AllocationLimit(OutOfMemory):
    """The context's allocation_limit was reached."""
    status = _capi.DELMESH_ERROR_ALLOCATION_LIMIT


class Cancelled(DelmeshError):
    """By a CancelToken, or because the progress callback returned False."""
    status = _capi.DELMESH_ERROR_CANCELLED


class IndexOutOfRange(DelmeshError, IndexError):
    status = _capi.DELMESH_ERROR_INDEX_OUT_OF_RANGE


class TooLarge(DelmeshError, OverflowError):
    """More than 2^31 - 1 corners or vertices."""
    status = _capi.DELMESH_ERROR_TOO_LARGE


class NoSurface(DelmeshError):
    """No face has any area at the output precision."""
    status = _capi.DELMESH_ERROR_NO_SURFACE


class NonOrientable(DelmeshError):
    """A component is one-sided, like a Moebius strip."""
    status = _capi.DELMESH_ERROR_NON_ORIENTABLE


class RepairRefused(DelmeshError):
    """The input needs a repair, and `strict` forbids repairs."""
    status = _capi.DELMESH_ERROR_STRICT


class VertexLimit(DelmeshError):
    """max_vertices was reached before the mesh was Delaunay."""
    status = _capi.DELMESH_ERROR_VERTEX_LIMIT


class PrecisionExhausted(DelmeshError):
    """The output precision cannot hold a Delaunay mesh here."""
    status = _capi.DELMESH_ERROR_PRECISION


class Unsupported(DelmeshError):
    """An option is set that this library does not know."""
    status = _capi.DELMESH_ERROR_UNSUPPORTED


class Busy(DelmeshError):
    """The context is in use: by another thread, or by the call whose callback this is."""
    status = _capi.DELMESH_ERROR_BUSY


class InternalError(DelmeshError):
    """A defect of the library: please report it with the sentence."""
    status = _capi.DELMESH_ERROR_INTERNAL


def _subclasses(cls):
    for sub in cls.__subclasses__():
        yield sub
        yield from _subclasses(sub)


BY_STATUS = {cls.status: cls for cls in _subclasses(DelmeshError) if cls.status is not None}
