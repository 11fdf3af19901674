# SPDX-License-Identifier: Apache-2.0
"""Context, Mesh and the operations: one Python call per call of delmesh.h.

What holds for all of them: arrays go in as they lie in memory and are kept alive during the call; the interpreter lock is
released while the library works; `progress(fraction, stage)` is called on the calling thread and cancels by returning False or by
raising (the exception comes out of the call); Ctrl-C cancels; what fails raises a subclass of DelmeshError.
"""
import collections
import contextlib
import ctypes as C
import threading
import weakref

import numpy as np

from . import _arrays, _capi
from ._library import library as _default_library
from .errors import BY_STATUS, Busy, DelmeshError, InvalidArgument


def _names(prefix):
    """{"preserve": 0, ...} of the constants that start with prefix."""
    return {key.removeprefix(prefix).lower(): value for key, value in vars(_capi).items() if key.startswith(prefix)}


_CHOICES = {"mode": _names("DELMESH_MODE_"), "placement": _names("DELMESH_PLACEMENT_"), "boundary": _names("DELMESH_BOUNDARY_"),
            "precision": _names("DELMESH_FLOAT"), "weld": _names("DELMESH_WELD_"), "prepare": _names("DELMESH_MODE_"),
            "collapse_placement": _names("DELMESH_COLLAPSE_")}
_CHOICES["precision"] = {"float" + bits: value for bits, value in _CHOICES["precision"].items()}


def _set_options(struct, options):
    fields = dict(struct._fields_)
    for name, value in options.items():
        if name not in fields or name in ("struct_size", "reserved0", "reserved1"):
            raise TypeError(f"there is no option '{name}'; there are {', '.join(_public(type(struct)))}")
        choices = _CHOICES.get(name)
        if choices and not isinstance(value, int):
            text = np.dtype(value).name if name == "precision" else value
            if text not in choices:
                raise InvalidArgument(f"The option '{name}' was {value!r}, which is not one of {', '.join(choices)}.")
            value = choices[text]
        setattr(struct, name, value)


def _public(struct):
    return [name for name, _ in struct._fields_ if name not in ("struct_size", "reserved0", "reserved1")]


_STOPPED_BY = {value: name for name, value in _names("DELMESH_STOPPED_BY_").items()}


def _report_type(name, struct, *more):
    """The named tuple that a report of the library becomes; `more` fields are None unless filled in."""
    cls = collections.namedtuple(name, [*_public(struct), *more], defaults=[None] * len(more))
    cls.__doc__ = f"The fields of {struct.__name__}: see delmesh.h."
    cls.struct = struct
    return cls


MeshInfo = _report_type("MeshInfo", _capi.delmesh_mesh_info)
RemeshReport = _report_type("RemeshReport", _capi.delmesh_remesh_report)
PreserveEstimate = _report_type("PreserveEstimate", _capi.delmesh_preserve_estimate)
LevelReport = _report_type("LevelReport", _capi.delmesh_level_report)
DecimateReport = _report_type("DecimateReport", _capi.delmesh_decimate_report, "levels")
CertifyReport = _report_type("CertifyReport", _capi.delmesh_certify_report, "nld_edges", "zero_area_face_list")
QualityReport = _report_type("QualityReport", _capi.delmesh_quality_report)
DistanceReport = _report_type("DistanceReport", _capi.delmesh_distance_report)


def _values(struct):
    def value_of(name):
        value = getattr(struct, name)
        if name == "stopped_by":
            return _STOPPED_BY.get(value, value)
        return tuple(value) if isinstance(value, C.Array) else value

    return [value_of(name) for name in _public(type(struct))]


class CancelToken:
    """Cancels, from any thread, the calls it is given to, now and later: cancel() is final."""

    def __init__(self):
        self._lock = threading.Lock()
        self._contexts = []
        self.cancelled = False

    def cancel(self):
        with self._lock:
            self.cancelled = True
            for context in self._contexts:
                context._library.cancel(context._handle)

    @contextlib.contextmanager
    def _attached(self, context):
        with self._lock:
            self._contexts.append(context)
            if self.cancelled:
                context._library.cancel(context._handle)
        try:
            yield
        finally:
            with self._lock:
                self._contexts.remove(context)


class _Callbacks:
    """The C callbacks of a context and what they carry during a call. Not the Context itself: they would keep it alive."""

    def __init__(self, log):
        self.progress = None
        self.error = None

        def on_progress(_user, fraction, stage):
            try:  # anything but DELMESH_CONTINUE cancels
                if self.error is None and (self.progress is None or self.progress(fraction, stage.decode()) is not False):
                    return _capi.DELMESH_CONTINUE
            except BaseException as error:  # KeyboardInterrupt too: it arrives here
                self.error = error
            return 0

        def on_log(_user, level, text):
            try:
                log(level, text.decode())
            except BaseException as error:
                self.error = error

        self.c_progress = _capi.delmesh_progress_fn(on_progress)
        self.c_log = _capi.delmesh_log_fn(on_log) if log else _capi.delmesh_log_fn()


class Context:
    """Threads, limits and logging for the calls made through it. The functions of the package make one per call unless they are
    given one. A context serves one call at a time.

    threads: 0 is one per core; memory_limit: bytes alive at a time in its meshes and calls, 0 is none; log: callable(level,
    text).
    """

    def __init__(self, threads=0, memory_limit=0, allocation_limit=0, log=None, library=None):
        self._library = library or _default_library()
        self._callbacks = _Callbacks(log)
        self._lock = threading.Lock()
        options = _initialised(self._library, _capi.delmesh_context_options)
        _set_options(options, {"max_threads": threads, "memory_limit": memory_limit, "allocation_limit": allocation_limit})
        options.progress, options.log = self._callbacks.c_progress, self._callbacks.c_log
        handle = C.c_void_p()
        status = self._library.context_create(options, handle)
        if status:
            raise BY_STATUS.get(status, DelmeshError)(f"The context could not be made: {self._name(status)}.")
        self._handle = handle
        # The callbacks are named here so that they live as long as the handle.
        weakref.finalize(self, _destroy, self._library, "context_destroy", handle, self._callbacks).atexit = False

    def _name(self, status):
        return self._library.status_name(status).decode()

    def _call(self, function, *arguments, progress=None, cancel=None, out=None):
        """Calls function(context, *arguments), or raises what its status says. out: the mesh handle, or the array of them,
        among the arguments that the call makes."""
        if not self._lock.acquire(blocking=False):
            raise Busy("The context was in use: a call on it has not returned yet.")
        try:
            self._callbacks.progress, self._callbacks.error = progress, None
            with cancel._attached(self) if cancel else contextlib.nullcontext():
                status = function(self._handle, *arguments)
                sentence = self._library.last_error(self._handle).decode() if status else ""
            if cancel and cancel.cancelled and status != _capi.DELMESH_ERROR_CANCELLED:
                # The token came when the call was already over: it must not hit the context's next call.
                self._library.mesh_validate(self._handle, None)
            error, self._callbacks.error, self._callbacks.progress = self._callbacks.error, None, None
        finally:
            self._lock.release()
        if error is not None:
            for made in out if isinstance(out, C.Array) else [out]:
                if made:
                    self._library.mesh_destroy(made)
            raise error
        if status:
            error = BY_STATUS.get(status, DelmeshError)(sentence or self._name(status))
            error.status = status
            raise error

    def memory(self):
        """-> (bytes alive now, at most so far, allocations made)."""
        numbers = [C.c_uint64() for _ in range(3)]
        self._library.context_memory(self._handle, *numbers)
        return tuple(number.value for number in numbers)


def _destroy(library, function, handle, _callbacks=None):
    getattr(library, function)(handle)


class _Handle:
    """Owns a delmesh_mesh; arrays lent by it hold it."""

    def __init__(self, library, pointer):
        self.native, self.pointer = library, pointer
        weakref.finalize(self, _destroy, library, "mesh_destroy", pointer).atexit = False


class Mesh:
    """A triangle mesh inside the library. It never changes; its arrays are read-only numpy arrays over the library's memory.

    positions     (n, 3) float32 or float64, any strides; the mesh has that precision
    faces         (m, k) vertex indices, counter-clockwise seen from outside; or, for polygons of mixed sizes, instead of it
    corner_verts  (c,) the vertices of all polygons one after the other, with
    face_offsets  (m + 1,) where each begins, or face_sizes (m,)
    marked_edges  (e, 2) vertex pairs that remesh keeps in every mode
    weld          True: corners at bitwise equal positions share the first vertex
    strict        True: refuse what would have to be repaired; else `info` counts the repairs
    """

    def __init__(self, positions, faces=None, *, corner_verts=None, face_offsets=None, face_sizes=None, marked_edges=None,
                 weld=False, strict=False, context=None, progress=None, cancel=None):
        context = context or Context()
        if (faces is None) == (corner_verts is None):
            raise InvalidArgument("Exactly one of 'faces' and 'corner_verts' must be given.")
        desc = _initialised(context._library, _capi.delmesh_mesh_desc)
        _set_options(desc, {"weld": weld if isinstance(weld, str) else bool(weld), "strict": bool(strict)})
        keep = []  # the arrays that the views point into

        def give(name, values, components, **kinds):
            if values is not None:
                view, array = _arrays.view(values, name, components, **kinds)
                setattr(desc, name, view)
                keep.append(array)

        if faces is not None:
            faces = np.asarray(faces)
            if faces.size == 0:
                faces = np.empty((0, 3), np.int32)
            if faces.ndim != 2 or faces.shape[1] < 3:
                raise InvalidArgument(f"The argument 'faces' had the shape {faces.shape} and not (m, 3) or more corners.")
            if faces.shape[1] > 3:
                corner_verts, face_sizes = np.ascontiguousarray(faces).reshape(-1), np.full(len(faces), faces.shape[1], np.int32)
        give("positions", positions, 3, floating=True)
        if corner_verts is None:
            view, array = _arrays.view(faces, "faces", 3)
            desc.corner_verts = view
            keep.append(array)
        give("corner_verts", corner_verts, 1)
        give("face_offsets", face_offsets, 1)
        give("face_sizes", face_sizes, 1, bytes_too=True)
        give("marked_edges", marked_edges, 2)
        out = C.c_void_p()
        context._call(context._library.mesh_create, desc, out, progress=progress, cancel=cancel, out=out)
        self._adopt(context._library, out)

    @classmethod
    def _made(cls, library, pointer):
        mesh = cls.__new__(cls)
        mesh._adopt(library, pointer)
        return mesh

    def _adopt(self, library, pointer):
        self._handle = _Handle(library, pointer)
        info = _initialised(library, _capi.delmesh_mesh_info)
        self._check(library.mesh_get_info(pointer, info), "info")
        self.info = MeshInfo(*_values(info))

    def _check(self, status, what):
        if status:
            raise BY_STATUS.get(status, DelmeshError)(f"The array '{what}' could not be read: "
                                                      f"{self._handle.native.status_name(status).decode()}.")

    def __repr__(self):
        return f"<delmesh.Mesh: {self.info.vertices} vertices, {self.info.faces} faces, {self.positions.dtype}>"

    # name -> (number in delmesh.h, columns of the numpy array)
    _ARRAYS = {"positions": (_capi.DELMESH_POSITION, 3), "faces": (_capi.DELMESH_CORNER_VERT, 3),
               "edges": (_capi.DELMESH_EDGE_VERT, 2), "corner_edges": (_capi.DELMESH_CORNER_EDGE, 3),
               "corner_twins": (_capi.DELMESH_CORNER_TWIN, 3), "face_source": (_capi.DELMESH_FACE_SOURCE, 1),
               "vert_source": (_capi.DELMESH_VERT_SOURCE, 1), "vert_join": (_capi.DELMESH_VERT_JOIN, 1),
               "edge_flags": (_capi.DELMESH_EDGE_FLAGS, 1), "vert_map_verts": (_capi.DELMESH_VERT_MAP_VERT, 3),
               "vert_map_weights": (_capi.DELMESH_VERT_MAP_WEIGHT, 3), "vert_parent": (_capi.DELMESH_VERT_PARENT, 1)}

    def _borrow(self, name):
        what, columns = self._ARRAYS[name]
        view = _capi.delmesh_view()
        self._check(self._handle.native.mesh_borrow(self._handle.pointer, what, view), name)
        return _arrays.borrowed(view, self._handle, columns)

    def read(self, name, out):
        """Writes one of the arrays, named like the properties, into `out`: any strides along the first axis, any type of the same
        kind that holds the values."""
        what, columns = self._ARRAYS[name]
        view = _arrays.view_mut(out, "out")
        if view.components != columns:
            raise InvalidArgument(f"The argument 'out' had {view.components} columns and '{name}' has {columns}.")
        self._check(self._handle.native.mesh_read(self._handle.pointer, what, view), name)
        return out

    @property
    def positions(self):
        """(v, 3) in the precision of the mesh."""
        return self._borrow("positions")

    @property
    def faces(self):
        """(f, 3) vertices."""
        return self._borrow("faces")

    @property
    def edges(self):
        """(e, 2) vertices of each unique edge."""
        return self._borrow("edges")

    @property
    def corner_edges(self):
        """(f, 3) edge from each corner to the next."""
        return self._borrow("corner_edges")

    @property
    def corner_twins(self):
        """(f, 3) the corner 3 f + k of the same edge in the neighbouring face, -1 on the boundary."""
        return self._borrow("corner_twins")

    @property
    def face_source(self):
        """(f,) polygon of the source."""
        return self._borrow("face_source")

    @property
    def vert_source(self):
        """(v,) vertex of the source, -1 for those made by splits."""
        return self._borrow("vert_source")

    @property
    def vert_join(self):
        """(v,) the vertex to join this one to where a non-manifold place was cut open, itself if none."""
        return self._borrow("vert_join")

    @property
    def vert_parent(self):
        """(v,) of a level of lod_family: the vertex of the next coarser level that this one went into, -1 if its component was
        pruned; of the coarsest level and of other meshes: itself."""
        return self._borrow("vert_parent")

    @property
    def vert_map(self):
        """(v, 3) source vertices and (v, 3) float64 weights: where each vertex lies on the source."""
        return self._borrow("vert_map_verts"), self._borrow("vert_map_weights")

    @property
    def edge_flags(self):
        """(e,) bits delmesh.EDGE_BOUNDARY, EDGE_MARKED, EDGE_FEATURE, EDGE_CUT, EDGE_SOURCE."""
        return self._borrow("edge_flags")

    def validate(self, context=None):
        """Checks every invariant of the data structure; raises InternalError where one is broken."""
        context = context or Context(library=self._handle.native)
        context._call(self._handle.native.mesh_validate, self._handle.pointer)


def _prepare(context, cancel, *meshes):
    """-> (context, every mesh as a Mesh)."""
    made = [mesh for mesh in meshes if isinstance(mesh, Mesh)]
    context = context or Context(library=made[0]._handle.native if made else None)
    if any(mesh._handle.native is not context._library for mesh in made):
        raise InvalidArgument("The mesh was made by another copy of the library than the context.")
    result = []
    for mesh in meshes:
        if not isinstance(mesh, Mesh):
            try:
                positions, faces = mesh
            except (TypeError, ValueError):
                raise TypeError(f"expected a delmesh.Mesh or the pair (positions, faces), not {type(mesh).__name__}") from None
            mesh = Mesh(positions, faces, context=context, cancel=cancel)
        result.append(mesh)
    return context, *result


def _initialised(library, struct):
    """A struct with its defaults."""
    value = struct()
    getattr(library, struct.__name__.removeprefix("delmesh_") + "_init")(value, C.sizeof(struct))
    return value


def _run(context, name, arguments, report_type, progress, cancel, out=None):
    """Calls the operation; its last argument is the report, which becomes a report_type, also where the call fails."""
    report = _initialised(context._library, report_type.struct)
    try:
        context._call(getattr(context._library, name), *arguments, report, progress=progress, cancel=cancel, out=out)
    except DelmeshError as error:
        error.report = report_type(*_values(report))
        raise
    return report_type(*_values(report))


def remesh(mesh, mode="preserve", *, progress=None, cancel=None, context=None, **options):
    """Makes a Delaunay mesh out of a Mesh or (positions, faces): -> (Mesh, RemeshReport).

    mode: "preserve", "flip" or "feature". Options are the fields of delmesh_remesh_options, by name, with the choices as words:
    placement="interval" | "shells", boundary="nonobtuse" | "ignore", precision="float32" | "float64" (here the default is that of
    the mesh), strict, compact, feature_angle, max_normal_turn, shell_unit, tolerance, max_vertices, split_budget,
    effort (preserve: 0 plain rule, 1 look ahead, more: search for fewer vertices).
    """
    context, source = _prepare(context, cancel, mesh)
    settings, out = _initialised(context._library, _capi.delmesh_remesh_options), C.c_void_p()
    _set_options(settings, {"precision": source.info.precision, **options, "mode": mode})
    report = _run(context, "remesh", [source._handle.pointer, settings, out], RemeshReport, progress, cancel, out)
    return Mesh._made(context._library, out), report


_TARGETS = _names("DELMESH_TARGET_")


def _targets(targets):
    """["full", ("vertices", 500), ...] as an array of delmesh_target."""
    made = (_capi.delmesh_target * len(targets))()
    for struct, target in zip(made, targets):
        kind, value = (target, 0) if isinstance(target, str) else target
        if kind not in _TARGETS:
            raise InvalidArgument(f"The target {target!r} was of no kind that there is: {', '.join(_TARGETS)}.")
        struct.kind, struct.value = _TARGETS[kind], value
    return made


def lod_family(mesh, targets, prepare="flip", *, vert_weights=None, locked_verts=None, face_mask=None, progress=None, cancel=None,
               context=None, **options):
    """Decimates a Mesh or (positions, faces) to each target in one run, every level Delaunay: -> ([Mesh, ...], DecimateReport).

    targets       the finest first: "full" (the whole Delaunay mesh), ("vertices", n), ("faces", n), ("ratio", share of the
                  input's triangles), ("deviation", distance in model units that is proven to be kept). What kept a level from
                  its target is its report.levels[i].stopped_by: "target" (nothing), "topology", "delaunay", "features", "bound"
    vert_weights  (v,) numbers over 0 that scale the error around each source vertex
    locked_verts  (v,) bool or integers: source vertices that stay where they are
    face_mask     (f,) bool or integers per source polygon: what is 0 stays as it is
    Options are the fields of delmesh_decimate_options, by name, with the choices as words: prepare="flip" | "preserve" | "feature",
    collapse_placement="all" | "paper" | "endpoints", precision (here the default is that of the mesh), quality (sweeps of
    relaxation; 6 is most of what there is to gain), boundary, strict, feature_angle, tolerance, max_normal_turn, boundary_weight,
    prune. A level's vert_parent leads to the next coarser one.
    """
    context, source = _prepare(context, cancel, mesh)
    library = context._library
    settings = _initialised(library, _capi.delmesh_decimate_options)
    _set_options(settings, {"precision": source.info.precision, **options, "prepare": prepare})
    keep = []  # the arrays that the views point into
    for name, values in (("vert_weights", vert_weights), ("locked_verts", locked_verts), ("face_mask", face_mask)):
        if values is not None:
            if name != "vert_weights" and np.asarray(values).dtype.kind in "iu":
                values = np.asarray(values) != 0
            view, array = _arrays.view(values, name, 1, floating=name == "vert_weights", bytes_too=True)
            setattr(settings, name, view)
            keep.append(array)
    wanted = _targets(list(targets))
    out, levels = (C.c_void_p * len(wanted))(), (_capi.delmesh_level_report * len(wanted))()
    for level in levels:
        library.level_report_init(level, C.sizeof(level))

    def with_levels(report):
        return report._replace(levels=tuple(LevelReport(*_values(level)) for level in levels))

    try:
        report = _run(context, "lod_family", [source._handle.pointer, wanted, len(wanted), settings, out, levels], DecimateReport,
                      progress, cancel, out)
    except DelmeshError as error:
        error.report = with_levels(error.report)
        raise
    return [Mesh._made(library, C.c_void_p(made)) for made in out], with_levels(report)


def decimate(mesh, prepare="flip", *, vertices=None, faces=None, ratio=None, deviation=None, **options):
    """Decimates to one target, as lod_family does, with its options: -> (Mesh, DecimateReport)."""
    given = {"vertices": vertices, "faces": faces, "ratio": ratio, "deviation": deviation}
    targets = [(kind, value) for kind, value in given.items() if value is not None]
    if len(targets) != 1:
        raise InvalidArgument(f"Exactly one of {', '.join(given)} must be given.")
    made, report = lod_family(mesh, targets, prepare, **options)
    return made[0], report


def estimate_preserve(mesh, *, progress=None, cancel=None, context=None, **options):
    """How many vertices remesh(mesh, "preserve", **options) would return, without doing all of it: -> PreserveEstimate."""
    context, source = _prepare(context, cancel, mesh)
    settings = _initialised(context._library, _capi.delmesh_remesh_options)
    _set_options(settings, {"precision": source.info.precision, **options})
    return _run(context, "estimate_preserve", [source._handle.pointer, settings], PreserveEstimate, progress, cancel)


def certify(mesh, *, boundary="nonobtuse", listed=False, progress=None, cancel=None, context=None):
    """Decides exactly whether a mesh is Delaunay: -> CertifyReport. With listed, its nld_edges (n, 2) and zero_area_face_list
    (n,) hold what offends; else they are None."""
    context, source = _prepare(context, cancel, mesh)
    settings = _initialised(context._library, _capi.delmesh_certify_options)
    _set_options(settings, {"boundary": boundary})
    arguments = [source._handle.pointer, settings]
    report = _run(context, "certify", arguments, CertifyReport, progress, cancel)
    if not listed:
        return report
    edges = np.empty((report.nld_interior + report.nld_boundary, 2), np.int32)
    faces = np.empty(report.zero_area_faces, np.int32)
    if len(edges) or len(faces):
        settings.nld_edges, settings.zero_area_faces = _arrays.view_mut(edges, "edges"), _arrays.view_mut(faces, "faces")
        report = _run(context, "certify", arguments, CertifyReport, progress, cancel)
    return report._replace(nld_edges=edges, zero_area_face_list=faces)


def measure(mesh, *, progress=None, cancel=None, context=None):
    """Angle statistics, lengths and area: -> QualityReport."""
    context, source = _prepare(context, cancel, mesh)
    return _run(context, "measure_quality", [source._handle.pointer], QualityReport, progress, cancel)


def distance(a, b, *, progress=None, cancel=None, context=None, **options):
    """Two-sided distance between two surfaces: -> DistanceReport. Options are the fields of delmesh_distance_options:
    compute_bound, samples, relative_error, absolute_error."""
    context, a, b = _prepare(context, cancel, a, b)
    settings = _initialised(context._library, _capi.delmesh_distance_options)
    _set_options(settings, options)
    return _run(context, "measure_distance", [a._handle.pointer, b._handle.pointer, settings], DistanceReport, progress, cancel)


def version():
    """The version of the library that runs, e.g. "0.1.0"."""
    return _default_library().version_string
