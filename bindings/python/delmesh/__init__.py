# SPDX-License-Identifier: Apache-2.0
"""libdelmesh for numpy: any triangle or polygon mesh made Delaunay, with an exact certificate.

    import delmesh
    result = delmesh.remesh(vertices, faces, mode="flip")
    result.vertices, result.faces, result.report.splits, delmesh.certify(result).delaunay

A layer over the C library (see delmesh.h for what everything means), which is loaded at the first use.
"""
from ._capi import DELMESH_EDGE_BOUNDARY as EDGE_BOUNDARY
from ._capi import DELMESH_EDGE_CUT as EDGE_CUT
from ._capi import DELMESH_EDGE_FEATURE as EDGE_FEATURE
from ._capi import DELMESH_EDGE_MARKED as EDGE_MARKED
from ._capi import DELMESH_EDGE_SOURCE as EDGE_SOURCE
from ._library import load_library, unload_library
from .core import (CancelToken, CertifyReport, Context, DecimateOptions, DecimateReport, DistanceOptions, DistanceReport, Family,
                   LevelReport, Measurement, Mesh, MeshInfo, PreserveEstimate, QualityReport, RemeshOptions, RemeshReport, Result,
                   certify, decimate, distance, estimate_preserve, lod_family, measure, remesh, version)
from .errors import (AbiMismatch, AllocationLimit, Busy, Cancelled, DelmeshError, IndexOutOfRange, InternalError, InvalidArgument,
                     LibraryNotFound, MemoryLimit, NonOrientable, NoSurface, OutOfMemory, PrecisionExhausted, RepairRefused,
                     TooLarge, Unsupported, VertexLimit)
from .transfer import SurfaceMap

__all__ = [name for name in dir() if not name.startswith("_") and name not in ("core", "errors", "transfer")]
