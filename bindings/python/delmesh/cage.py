# SPDX-License-Identifier: Apache-2.0
"""Control cages: their limit surface as a mesh, what they have at the places of meshes that come from them, other poses."""
from __future__ import annotations

import ctypes as C
import weakref
from typing import Any, Literal, Mapping

import numpy as np

from . import _arrays, _capi, _choices, _polygons, layers as _layers
from ._reports import ReevaluateReport, SubdivideReport
from .core import CancelToken, Context, Mesh, Progress, Result, _destroy, _initialised, _run
from .errors import InvalidArgument
from .layers import Layers

Scheme = Literal["catmull_clark", "loop", "bilinear"]
_CHOICES = {"scheme": _choices.names("DELMESH_SCHEME_"), "boundary": _choices.names("DELMESH_CAGE_BOUNDARY_"),
            "face_varying": _choices.names("DELMESH_FACE_VARYING_"), "creasing": _choices.names("DELMESH_CREASING_"),
            "evaluation": _choices.names("DELMESH_EVALUATION_"),
            "precision": {"float32": _capi.DELMESH_FLOAT32, "float64": _capi.DELMESH_FLOAT64}}


class Cage:
    """A polygon mesh that stands for the smooth surface that subdividing it leads to. It never changes.

    positions     (n, 3) float32 or float64
    faces         (m, k) vertex indices; or for polygons of mixed sizes corner_verts (c,) with face_offsets or face_sizes, as Mesh
    creases       (edges (e, 2), sharpness (e,)): how many subdivisions an edge stays sharp; 10 and more: for ever
    corners       (vertices (v,), sharpness (v,))
    holes         (h,) faces that shape the surface, and are left out of it
    scheme        "catmull_clark", "loop" (triangles) or "bilinear"
    boundary      "edge_and_corner", "edge" or "none"
    face_varying  where layers at corners are linear instead of smooth: "boundaries", "none", "corners_only", "corners_plus1",
                  "corners_plus2" or "all"
    creasing      "uniform" or "chaikin"
    smooth_triangles  True: Catmull-Clark leaves less of a bump on triangles
    layers        {name: array or Layer}, copied, as of Mesh. Those at corners are face-varying
    edges, edge_marks  as of Mesh
    """

    def __init__(self, positions, faces=None, *, corner_verts=None, face_offsets=None, face_sizes=None, creases=None, corners=None,
                 holes=None, scheme: Scheme = "catmull_clark", boundary="edge_and_corner", face_varying="boundaries",
                 creasing="uniform", smooth_triangles=False, layers: Layers | None = None, edges=None, edge_marks=None,
                 context: Context | None = None, progress: Progress = None, cancel: CancelToken | None = None):
        context = context or Context()
        desc = _initialised(context._library, _capi.delmesh_cage_desc)
        for name, word in (("scheme", scheme), ("boundary", boundary), ("face_varying", face_varying), ("creasing", creasing)):
            setattr(desc, name, _choices.number(f"The option '{name}'", word, _CHOICES[name]))
        desc.smooth_triangles = bool(smooth_triangles)
        give = _polygons.Given(desc)
        give("positions", positions, 3, floating=True)
        shape, _, self._counts = give.faces(faces, corner_verts, face_offsets, face_sizes)
        if creases is not None:
            give("crease_edges", creases[0], 2)
            give("crease_sharpness", creases[1], 1, floating=True)
        if corners is not None:
            give("sharp_verts", corners[0], 1)
            give("vert_sharpness", corners[1], 1, floating=True)
        give("holes", holes, 1)
        give.edges(edges, edge_marks)
        _polygons.check_names(layers)
        self._layers = {name: _layers.resolve(name, layer, self._counts, shape, True) for name, layer in (layers or {}).items()}
        # All at corners are face-varying, whatever their kind; those of vertices are evaluated as positions are.
        told = {name: r if r.kind or r.domain == "face" else r._replace(kind="other") for name, r in self._layers.items()
                if r.domain in ("corner", "face")}
        for name, r in told.items():
            if r.domain == "corner" and r.kind == "other" and self._layers[name].kind is None:
                told[name] = r._replace(layer=_layers.Layer(r.array, border="free"))
        structs, named = _layers.structs(told, None, give.arrays)
        desc.layers, desc.layer_count = structs, len(structs)
        self._numbers = {name: i for i, name in enumerate(named)}
        handle = C.c_void_p()
        with _polygons.layers_by_name(named):
            context._call(context._library.cage_create, desc, handle, progress=progress, cancel=cancel, destroy="cage_destroy",
                          out=handle)
        self._library, self._handle, self._threads = context._library, handle, context._threads
        weakref.finalize(self, _destroy, context._library, "cage_destroy", handle).atexit = False

    def __repr__(self):
        return f"<delmesh.Cage: {self._counts['vertex']} vertices, {self._counts['face']} faces>"

    def _context(self, context):
        return context or Context(threads=self._threads, library=self._library)

    def subdivide(self, rate: int | None = None, *, edge_length: float | None = None, triangles: int | None = None,
                  evaluation="bfr", precision="float32", measure=False, progress: Progress = None,
                  cancel: CancelToken | None = None, context: Context | None = None) -> Result:
        """The limit surface: cage.subdivide(16) -> Result with .vertices, .faces, .mesh, .report (a SubdivideReport), .layers.

        Exactly one of: rate (pieces per edge of the cage), edge_length (of them, at most, on average) and triangles (at most so
        many). With measure, the report also says how far the mesh is from the limit surface. What is made of the result (remesh,
        lod_family, decimate) knows its places on the cage, too.
        """
        given = {name: value for name, value in (("rate", rate), ("edge_length", edge_length), ("faces", triangles))
                 if value is not None}
        if len(given) != 1:
            raise TypeError("expected exactly one of rate, edge_length and triangles")
        context = self._context(context)
        options = _initialised(context._library, _capi.delmesh_subdivide_options)
        (kind, options.value), = given.items()
        options.fineness = _choices.names("DELMESH_FINENESS_")[kind]
        options.evaluation = _choices.number("The option 'evaluation'", evaluation, _CHOICES["evaluation"])
        options.precision = _choices.number("The option 'precision'", np.dtype(precision).name, _CHOICES["precision"])
        options.measure = bool(measure)
        out = C.c_void_p()
        report = _run(context, "subdivide", [self._handle, options, out], SubdivideReport, progress, cancel, out)
        mesh = Mesh._made(context, out)
        mesh._cage = self
        mesh._sources = self._evaluated(context, mesh, cancel)
        return Result(mesh, report)

    def values(self, mesh, values, *, layer: str | None = None, cancel: CancelToken | None = None,
               context: Context | None = None) -> np.ndarray:
        """(n, ...) floats at the cage's vertices -> the same type at the vertices of `mesh`, on the limit surface as positions
        are. With `layer`, the name of one at corners: at the cage's corners -> (f, 3, ...) at those of `mesh`."""
        mesh = mesh.mesh if isinstance(mesh, Result) else mesh
        array = np.asarray(values)
        if array.dtype.kind != "f":
            raise InvalidArgument(f"The values had the type {array.dtype}, and limits are of floats.")
        if layer is not None and layer not in self._numbers:
            raise InvalidArgument(f"The argument 'layer' was {layer!r}, and the cage has {', '.join(self._numbers) or 'none'}.")
        made = self._limit(self._context(context), mesh, array, layer, cancel)
        return made if layer is None else made.reshape(-1, 3, *array.shape[1:])

    def _limit(self, context, mesh, array, layer, cancel):
        source = _layers._carried(array)
        domain = "vertex" if layer is None else "corner"
        target = np.empty((mesh.info.vertices if layer is None else mesh.info.corners, *array.shape[1:]), source.dtype)
        view, kept = _arrays.rows_view(source)
        context._call(context._library.limit_values, self._handle, mesh._handle.pointer, _layers.DOMAINS[domain],
                      -1 if layer is None else self._numbers[layer], view, _arrays.rows_view_mut(target), cancel=cancel)
        del kept
        return target.astype(array.dtype, copy=False)

    def normals(self, mesh, positions=None, *, cancel: CancelToken | None = None, context: Context | None = None) -> np.ndarray:
        """(f, 3, 3) float64 unit normals of the limit surface at the corners of `mesh`; in another pose of the cage with
        positions (n, 3)."""
        mesh, context = mesh.mesh if isinstance(mesh, Result) else mesh, self._context(context)
        target = np.empty((mesh.info.corners, 3))
        view, kept = (None, None) if positions is None else _arrays.view(positions, "positions", 3, floating=True)
        context._call(context._library.limit_normals, self._handle, mesh._handle.pointer, view, _arrays.rows_view_mut(target),
                      cancel=cancel)
        del kept
        return target.reshape(-1, 3, 3)

    def reevaluate(self, mesh, positions, *, progress: Progress = None, cancel: CancelToken | None = None,
                   context: Context | None = None) -> Result:
        """A mesh that comes from the cage, in another pose of it, positions (n, 3) -> Result with .vertices, .faces, .mesh and
        .report (a ReevaluateReport). The faces stay; in the pose of the cage itself the result has the mesh's own bytes."""
        mesh, context = mesh.mesh if isinstance(mesh, Result) else mesh, self._context(context)
        view, kept = _arrays.view(positions, "positions", 3, floating=True)
        out = C.c_void_p()
        arguments = [self._handle, mesh._handle.pointer, view, out]
        report = _run(context, "reevaluate", arguments, ReevaluateReport, progress, cancel, out)
        del kept
        made = Mesh._made(context, out)
        made._cage, made._sources = mesh._cage, mesh._sources
        return Result(made, report)

    def _evaluated(self, context, mesh, cancel) -> Mapping[str, Any]:
        """{name: Resolved}: the cage's layers at the elements of a mesh that has its places."""
        made = {}
        for name, r in self._layers.items():
            if r.domain == "face":
                made[name] = r._replace(array=r.array[mesh.cage_faces])
            elif r.array.dtype.kind == "f" and r.domain in ("vertex", "corner"):
                array = self._limit(context, mesh, r.array, name if r.domain == "corner" else None, cancel)
                made[name] = r._replace(array=array, by_face=r.domain == "corner")
        return made


def subdivide(positions, faces=None, rate: int | None = None, *, edge_length: float | None = None, triangles: int | None = None,
              evaluation="bfr", precision="float32", measure=False, progress: Progress = None, cancel: CancelToken | None = None,
              context: Context | None = None, **cage) -> Result:
    """Cage(positions, faces, **cage).subdivide(rate, ...): delmesh.subdivide(positions, faces, 16).vertices. The cage is
    result.mesh.cage."""
    context = context or Context()
    made = Cage(positions, faces, cancel=cancel, context=context, **cage)
    return made.subdivide(rate, edge_length=edge_length, triangles=triangles, evaluation=evaluation, precision=precision,
                          measure=measure, progress=progress, cancel=cancel, context=context)
