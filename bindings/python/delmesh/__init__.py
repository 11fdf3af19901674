# SPDX-License-Identifier: Apache-2.0
"""libdelmesh for numpy: any triangle or polygon mesh made Delaunay, with an exact certificate.

    import delmesh
    result = delmesh.remesh(vertices, faces, mode="flip")
    result.vertices, result.faces, result.report.splits, delmesh.certify(result).delaunay

A layer over the C library (see delmesh.h for what everything means), which is loaded at the first use.
"""
from ._capi import DELMESH_EDGE_BOUNDARY as EDGE_BOUNDARY
from ._capi import DELMESH_EDGE_COLOR as EDGE_COLOR
from ._capi import DELMESH_EDGE_CREASE as EDGE_CREASE
from ._capi import DELMESH_EDGE_CUT as EDGE_CUT
from ._capi import DELMESH_EDGE_FACE_SET as EDGE_FACE_SET
from ._capi import DELMESH_EDGE_FEATURE as EDGE_FEATURE
from ._capi import DELMESH_EDGE_LAYER as EDGE_LAYER
from ._capi import DELMESH_EDGE_MARKED as EDGE_MARKED
from ._capi import DELMESH_EDGE_MATERIAL as EDGE_MATERIAL
from ._capi import DELMESH_EDGE_NORMAL as EDGE_NORMAL
from ._capi import DELMESH_EDGE_SEAM as EDGE_SEAM
from ._capi import DELMESH_EDGE_SHARP as EDGE_SHARP
from ._capi import DELMESH_EDGE_SOURCE as EDGE_SOURCE
from ._capi import DELMESH_EDGE_UV as EDGE_UV
from ._library import load_library, native_path, unload_library
from ._reports import ReevaluateReport, SubdivideReport
from .cage import Cage, subdivide
from .core import (CancelToken, CertifyReport, Context, DecimateOptions, DecimateReport, DistanceOptions, DistanceReport, Family,
                   LevelReport, Measurement, Mesh, MeshInfo, PreserveEstimate, QualityReport, RemeshOptions, RemeshReport, Result,
                   certify, decimate, distance, estimate_preserve, lod_family, measure, remesh, version)
from .errors import (AbiMismatch, AllocationLimit, Busy, Cancelled, DelmeshError, IndexOutOfRange, InternalError, InvalidArgument,
                     LibraryNotFound, MemoryLimit, NonOrientable, NoSurface, OutOfMemory, PrecisionExhausted, RepairRefused,
                     TooLarge, Unsupported, VertexLimit)
from .layers import Layer
from .sparse import Rows, transfer_rows
from .transfer import SurfaceMap

_MODULES = ("cage", "core", "errors", "layers", "sparse", "transfer")
__all__ = [name for name in dir() if not name.startswith("_") and name not in _MODULES]
