# SPDX-License-Identifier: Apache-2.0
"""Context, Mesh and the operations: one Python call per call of delmesh.h.

What holds for all of them: a mesh is given as two arrays, vertices (n, 3) and faces (m, k), or as one argument: a Mesh, a Result, a
pair of such arrays, or anything with the attributes `vertices` and `faces`. Arrays go in as they lie in memory and are kept alive
during the call; the interpreter lock is released while the library works; `progress`, a callable or a tqdm bar, is told
(fraction, stage) on the calling thread, and cancels by returning False or by raising (the exception comes out of the call); Ctrl-C
cancels; `cancel` is a CancelToken, `context` a Context; what fails raises a subclass of DelmeshError with the library's sentence.
Lengths are in model units, angles in degrees.
"""
from __future__ import annotations

import contextlib
import ctypes as C
import signal
import threading
import typing
import weakref
from types import MappingProxyType
from typing import Any, Callable, Literal, Mapping, NamedTuple, Sequence, TypedDict

import numpy as np

from . import _arrays, _capi, _choices, _polygons, _reports, layers as _layers
from ._choices import names as _names
from ._library import loaded_library
from ._reports import (CertifyReport, DecimateReport, DistanceReport, LevelReport, MeshInfo, PreserveEstimate, QualityReport,
                       RemeshReport)
from .errors import BY_STATUS, Busy, DelmeshError, InvalidArgument
from .layers import Layers


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
            if name == "precision":
                with contextlib.suppress(TypeError):  # what is no dtype is refused below
                    value = np.dtype(value).name
            value = _choices.number(f"The option '{name}'", value, choices)
        elif name == "release":
            value = _choices.release(value)
        setattr(struct, name, value)
        stored = getattr(struct, name)
        if isinstance(stored, int) and stored != value:  # ctypes drops the bits that do not fit
            raise InvalidArgument(f"The option '{name}' was {value}, which is out of the range of its type.")


def _public(struct):
    return [name for name, _ in struct._fields_ if name not in ("struct_size", "reserved0", "reserved1")]


Mode = Literal["preserve", "flip", "feature"]
Boundary = Literal["nonobtuse", "ignore"]
Release = typing.Union[str, Sequence[str], int]
Progress = typing.Union[Callable[[float, str], Any], Any, None]  # the second: a tqdm bar, or its class
if typing.TYPE_CHECKING:
    from typing_extensions import Unpack

_STOPPED_BY = {value: name for name, value in _names("DELMESH_STOPPED_BY_").items()}


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
        self._lock = threading.RLock()  # a signal handler of this thread may cancel while it is held
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


@contextlib.contextmanager
def _told(progress):
    """-> the callable behind `progress`: itself, or what moves a tqdm bar; one that is made here is closed here."""
    if not hasattr(progress, "update"):
        yield progress
        return
    bar = progress(total=100, bar_format="{l_bar}{bar}| {elapsed}") if isinstance(progress, type) else progress

    def move(fraction, stage):
        if bar.total is None:
            bar.total = 100
        bar.set_description_str(stage, refresh=False)
        bar.update(round(fraction * bar.total, 2) - bar.n)

    try:
        yield move
    finally:
        if bar is not progress:
            bar.close()


class _Callbacks:
    """The C callbacks of a context and what they carry during a call. Not the Context itself: they would keep it alive."""

    def __init__(self, log):
        self.progress = None
        self.error = None

        def on_progress(_user, fraction, stage):
            go_on = True
            try:
                if self.error is None and self.progress is not None:
                    go_on = self.progress(fraction, stage.decode()) is not False
            except BaseException as error:
                self.error = error
            return _capi.DELMESH_CONTINUE if go_on and self.error is None else 0

        def on_log(_user, level, text):
            try:
                log(level, text.decode())
            except BaseException as error:
                self.error = error

        self.c_progress = _capi.delmesh_progress_fn(on_progress)
        self.c_log = _capi.delmesh_log_fn(on_log) if log else _capi.delmesh_log_fn()


@contextlib.contextmanager
def _interruptible(callbacks):
    """Ctrl-C cancels the call. Python would raise KeyboardInterrupt between any two steps of a callback, also where ctypes drops
    it; so during a call it is noted, and raised when the call has returned. Who has a handler of their own keeps it."""
    is_main = threading.current_thread() is threading.main_thread()
    if not is_main or signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        yield
        return

    def note(_signal, _frame):
        callbacks.error = callbacks.error or KeyboardInterrupt()

    signal.signal(signal.SIGINT, note)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)


class Context:
    """Threads, limits and logging for the calls made through it. The functions of the package make one per call unless they are
    given one. A context serves one call at a time.

    threads: 0 is one per core; memory_limit: bytes alive at a time in its meshes and calls, 0 is none; log: callable(level,
    text).
    """

    def __init__(self, threads=0, memory_limit=0, allocation_limit=0, log=None, library=None):
        self._library = library or loaded_library()
        self._threads = threads
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

    def _call(self, function, *arguments, progress=None, cancel=None, out=None, destroy="mesh_destroy"):
        """Calls function(context, *arguments), or raises what its status says. out: the handle, or the array of them, among the
        arguments that the call makes; destroy: what such handles go to."""
        if not self._lock.acquire(blocking=False):
            raise Busy("The context was in use: a call on it has not returned yet.")
        try:
            self._callbacks.error = None
            with (_told(progress) as self._callbacks.progress, _interruptible(self._callbacks),
                  cancel._attached(self) if cancel else contextlib.nullcontext()):
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
                    getattr(self._library, destroy)(made)
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
    layers        {name: array or Layer}: values at vertices, corners, faces or edges, which go along to what is made of the
                  mesh. Copied. See Layer for what is read from names and sizes
    edges         (e, 2) vertex pairs: the edges that layers of edges, edge_marks and `edge_source` number
    edge_marks    (e,) for each of `edges` 0 or EDGE_MARKED, EDGE_SHARP, EDGE_SEAM, EDGE_CREASE, added; True is EDGE_MARKED. Kept
                  unless released
    weld          True: corners at bitwise equal positions share the first vertex
    strict        True: refuse what would have to be repaired; else `info` counts the repairs
    """

    def __init__(self, positions, faces=None, *, corner_verts=None, face_offsets=None, face_sizes=None, marked_edges=None,
                 layers: Layers | None = None, edges=None, edge_marks=None, weld=False, strict=False, context=None, progress=None,
                 cancel=None):
        self._create(context or Context(), progress, cancel, positions, faces, corner_verts, face_offsets, face_sizes, marked_edges,
                     layers, edges, edge_marks, weld, strict, copy=True)

    @classmethod
    def _for_one_call(cls, context, cancel, positions, faces, layers, edges, edge_marks):
        """A mesh that is gone before the caller can change its arrays."""
        mesh = cls.__new__(cls)
        mesh._create(context, None, cancel, positions, faces, None, None, None, None, layers, edges, edge_marks, False, False,
                     copy=False)
        return mesh

    def _create(self, context, progress, cancel, positions, faces, corner_verts, face_offsets, face_sizes, marked_edges, layers,
                edges, edge_marks, weld, strict, copy):
        desc = _initialised(context._library, _capi.delmesh_mesh_desc)
        _set_options(desc, {"weld": weld if isinstance(weld, str) else bool(weld), "strict": bool(strict)})
        give = _polygons.Given(desc)
        give("positions", positions, 3, floating=True)
        shape, corners, counts = give.faces(faces, corner_verts, face_offsets, face_sizes)
        give("marked_edges", marked_edges, 2)
        give.edges(edges, edge_marks)
        _polygons.check_names(layers)
        if edges is not None:
            counts["edge"] = desc.edge_verts.count
        resolved = {name: _layers.resolve(name, layer, counts, shape, copy) for name, layer in (layers or {}).items()}
        structs, named = _layers.structs(resolved, corners, give.arrays)
        desc.layers, desc.layer_count = structs, len(structs)
        out = C.c_void_p()
        with _polygons.layers_by_name(named):
            context._call(context._library.mesh_create, desc, out, progress=progress, cancel=cancel, out=out)
        self._adopt(context, out)
        self._sources, self._numbers = resolved, {name: i for i, name in enumerate(named)}

    @classmethod
    def _made(cls, context, pointer):
        mesh = cls.__new__(cls)
        mesh._adopt(context, pointer)
        return mesh

    def _carry(self, context, source, cancel):
        """Gets the layers of the mesh that this one was made of, now: the caller may change their arrays afterwards. Where that
        came from a cage, and this one knows its places there, they are the cage's."""
        self._cage = source._cage
        if self._cage and self._has_places():
            self._sources = self._cage._evaluated(context, self, cancel)
        else:
            self._sources = _layers.carry(context, source, self, source._sources, cancel)

    def _has_places(self):
        return not self._handle.native.mesh_borrow(self._handle.pointer, _capi.DELMESH_FACE_CAGE_FACE, _capi.delmesh_view())

    def _adopt(self, context, pointer):
        library = context._library
        self._threads = context._threads
        self._sources, self._numbers, self._cage = {}, None, None
        self._handle = _Handle(library, pointer)
        info = _initialised(library, _capi.delmesh_mesh_info)
        self._check(library.mesh_get_info(pointer, info), "info")
        self.info = MeshInfo(*_values(info))

    def _check(self, status, what):
        if status == _capi.DELMESH_ERROR_INVALID_ARGUMENT and what.startswith(("cage_", "corner_cage", "vert_cage")):
            raise InvalidArgument(f"The array '{what}' is not there: the mesh does not come from a cage with map=True.")
        if status == _capi.DELMESH_ERROR_INVALID_ARGUMENT and what.startswith(("corner_map", "edge_source")):
            raise InvalidArgument(f"The array '{what}' is not there: the mesh was made without map=True.")
        if status:
            raise BY_STATUS.get(status, DelmeshError)(f"The array '{what}' could not be read: "
                                                      f"{self._handle.native.status_name(status).decode()}.")

    def __repr__(self):
        return f"<delmesh.Mesh: {self.info.vertices} vertices, {self.info.faces} faces, {self.positions.dtype}>"

    # At the elements that the maps of what is made of this mesh lead to: the caller's of an imported mesh, else its own.
    _sources: dict[str, _layers.Resolved]
    # Of an imported mesh, of the layers that the library knows
    _numbers: dict[str, int] | None

    # name -> (number in delmesh.h, columns of the numpy array)
    _ARRAYS = {"positions": (_capi.DELMESH_POSITION, 3), "faces": (_capi.DELMESH_CORNER_VERT, 3),
               "edges": (_capi.DELMESH_EDGE_VERT, 2), "corner_edges": (_capi.DELMESH_CORNER_EDGE, 3),
               "corner_twins": (_capi.DELMESH_CORNER_TWIN, 3), "face_source": (_capi.DELMESH_FACE_SOURCE, 1),
               "vert_source": (_capi.DELMESH_VERT_SOURCE, 1), "vert_join": (_capi.DELMESH_VERT_JOIN, 1),
               "edge_flags": (_capi.DELMESH_EDGE_FLAGS, 1), "vert_map_verts": (_capi.DELMESH_VERT_MAP_VERT, 3),
               "vert_map_weights": (_capi.DELMESH_VERT_MAP_WEIGHT, 3), "vert_parent": (_capi.DELMESH_VERT_PARENT, 1),
               "corner_map_corners": (_capi.DELMESH_CORNER_MAP_CORNER, 3),
               "corner_map_weights": (_capi.DELMESH_CORNER_MAP_WEIGHT, 3), "edge_source": (_capi.DELMESH_EDGE_SOURCE_EDGE, 1),
               "corner_cage_faces": (_capi.DELMESH_CORNER_CAGE_FACE, 3), "corner_cage_places": (_capi.DELMESH_CORNER_CAGE_PLACE, 2),
               "vert_cage_faces": (_capi.DELMESH_VERT_CAGE_FACE, 1), "vert_cage_places": (_capi.DELMESH_VERT_CAGE_PLACE, 2),
               "cage_faces": (_capi.DELMESH_FACE_CAGE_FACE, 1)}

    def _borrow(self, name):
        what, columns = self._ARRAYS[name]
        view = _capi.delmesh_view()
        self._check(self._handle.native.mesh_borrow(self._handle.pointer, what, view), name)
        return _arrays.borrowed(view, self._handle, columns)

    def read(self, name, out):
        """Writes one of the arrays, named like the properties, into `out`: any strides along the first axis, any type of the same
        kind that holds the values."""
        if name not in self._ARRAYS:
            raise InvalidArgument(f"The argument 'name' was {name!r}, which is not one of {', '.join(self._ARRAYS)}.")
        what, columns = self._ARRAYS[name]
        view = _arrays.view_mut(out, "out")
        if view.components != columns:
            raise InvalidArgument(f"The argument 'out' had {view.components} columns and '{name}' has {columns}.")
        status = self._handle.native.mesh_read(self._handle.pointer, what, view)
        if status and len(out) != len(self._borrow(name)):
            raise InvalidArgument(f"The argument 'out' had {len(out)} elements and '{name}' has {len(self._borrow(name))}.")
        self._check(status, name)
        return out

    @property
    def positions(self) -> np.ndarray:
        """(v, 3) in the precision of the mesh."""
        return self._borrow("positions")

    vertices = positions

    @property
    def faces(self) -> np.ndarray:
        """(f, 3) vertices."""
        return self._borrow("faces")

    @property
    def edges(self) -> np.ndarray:
        """(e, 2) vertices of each unique edge."""
        return self._borrow("edges")

    @property
    def corner_edges(self) -> np.ndarray:
        """(f, 3) edge from each corner to the next."""
        return self._borrow("corner_edges")

    @property
    def corner_twins(self) -> np.ndarray:
        """(f, 3) the corner 3 f + k of the same edge in the neighbouring face, -1 on the boundary."""
        return self._borrow("corner_twins")

    @property
    def face_source(self) -> np.ndarray:
        """(f,) polygon of the source."""
        return self._borrow("face_source")

    @property
    def vert_source(self) -> np.ndarray:
        """(v,) vertex of the source, -1 for those made by splits."""
        return self._borrow("vert_source")

    @property
    def vert_join(self) -> np.ndarray:
        """(v,) the vertex to join this one to where a non-manifold place was cut open, itself if none."""
        return self._borrow("vert_join")

    @property
    def vert_parent(self) -> np.ndarray:
        """(v,) of a level of lod_family: the vertex of the next coarser level that this one went into, -1 if its component was
        pruned; of the coarsest level and of other meshes: itself."""
        return self._borrow("vert_parent")

    @property
    def vert_map(self) -> tuple[np.ndarray, np.ndarray]:
        """(v, 3) source vertices and (v, 3) float64 weights: where each vertex lies on the source."""
        return self._borrow("vert_map_verts"), self._borrow("vert_map_weights")

    @property
    def edge_flags(self) -> np.ndarray:
        """(e,) bits delmesh.EDGE_BOUNDARY, EDGE_MARKED, EDGE_FEATURE, EDGE_CUT, EDGE_SOURCE, EDGE_SHARP, EDGE_SEAM, EDGE_CREASE,
        and of kept borders of layers EDGE_UV, EDGE_NORMAL, EDGE_COLOR, EDGE_LAYER, EDGE_MATERIAL, EDGE_FACE_SET."""
        return self._borrow("edge_flags")

    @property
    def corner_map(self) -> tuple[np.ndarray, np.ndarray]:
        """(f, 3, 3) source corners and (f, 3, 3) float64 weights: where each corner lies on the source, on its own side of every
        kept edge. Corners are numbered as the polygons of the source were given. Needs map=True."""
        return self._borrow("corner_map_corners").reshape(-1, 3, 3), self._borrow("corner_map_weights").reshape(-1, 3, 3)

    @property
    def edge_source(self) -> np.ndarray:
        """(e,) the source edge that each edge is a piece of, -1 for none: the row in the source's `edges` argument if it had one,
        else in its array `edges`. Needs map=True."""
        return self._borrow("edge_source")

    @property
    def cage(self):
        """The Cage that the mesh comes from, or None."""
        return self._cage

    @property
    def cage_faces(self) -> np.ndarray:
        """(f,) of a mesh from a cage: the cage's face whose material... each face has."""
        return self._borrow("cage_faces")

    @property
    def corner_cage(self) -> tuple[np.ndarray, np.ndarray]:
        """(f, 3) faces of the cage and (f, 3, 2) float32 places on them, on each corner's own side of every seam and crease."""
        return self._borrow("corner_cage_faces"), self._borrow("corner_cage_places").reshape(-1, 3, 2)

    @property
    def vert_cage(self) -> tuple[np.ndarray, np.ndarray]:
        """(v,) faces of the cage and (v, 2) float32 places on them: those of each vertex's first corner; -1 if it has none."""
        return self._borrow("vert_cage_faces"), self._borrow("vert_cage_places")

    @property
    def layers(self) -> Mapping[str, np.ndarray]:
        """{name: array}, read-only: the layers of the source at the vertices, corners, faces or edges of this mesh, in the same
        types."""
        own = self._sources if self._numbers is None else _layers.carry(self._own_context(), self, self, self._sources)
        return MappingProxyType(_layers.shown(own))

    @property
    def layer_borders(self) -> dict[str, int]:
        """{name: edges across which the layer's values jump, kept or not}, of the layers that have a kind. Only of a Mesh made from
        arrays."""
        count, borders = C.c_int64(), {}
        for name, number in (self._numbers or {}).items():
            self._check(self._handle.native.mesh_layer_borders(self._handle.pointer, number, count), "layer_borders")
            borders[name] = count.value
        return borders

    def transfer(self, values, *, domain: _layers.Domain, policy: _layers.Policy = "linear", cancel: CancelToken | None = None,
                 context: Context | None = None, fit: Mesh | None = None) -> np.ndarray:
        """(n, ...) values at the vertices, corners, faces or edges of the source -> those of this mesh, of the same type. What
        layers do, for values that come later. Corners and edges need map=True. fit: the source; values of vertices or corners then
        fit all over the surface and not only at the vertices (Layer.fit)."""
        _choices.number("The argument 'domain'", domain, _layers.DOMAINS)
        _choices.number("The argument 'policy'", policy, _layers.POLICIES)
        values = _layers.checked(values, "The argument 'values'")
        return _layers.transfer(context or self._own_context(), self, values, domain, policy, cancel, fit)

    def _own_context(self):
        return Context(threads=self._threads, library=self._handle.native)

    def validate(self, context=None):
        """Checks every invariant of the data structure; raises InternalError where one is broken."""
        context = context or Context(library=self._handle.native)
        context._call(self._handle.native.mesh_validate, self._handle.pointer)


def _is_array(mesh):
    """Whether it is vertices rather than a mesh: a pair of arrays is a mesh, of three and more rows is not."""
    return isinstance(mesh, np.ndarray) or (isinstance(mesh, (list, tuple)) and not isinstance(mesh, Result) and len(mesh) != 2)


def _one(mesh, faces):
    """The mesh that two arguments, or the first alone, stand for."""
    if faces is None:
        return mesh
    if not _is_array(mesh):
        raise TypeError(f"the second argument are the faces of the vertices in the first, which was a {type(mesh).__name__}")
    return mesh, faces


def _prepare(context, cancel, *meshes, layers=None, edges=None, edge_marks=None):
    """-> (context, every mesh as a Mesh). layers and the like: of meshes that are made here."""
    meshes = [mesh.mesh if isinstance(mesh, Result) else mesh for mesh in meshes]
    made = [mesh for mesh in meshes if isinstance(mesh, Mesh)]
    context = context or Context(library=made[0]._handle.native if made else None)
    if any(mesh._handle.native is not context._library for mesh in made):
        raise InvalidArgument("The mesh was made by another copy of the library than the context.")
    result = []
    for mesh in meshes:
        if not isinstance(mesh, Mesh):
            try:
                vertices, faces = (mesh.vertices, mesh.faces) if hasattr(mesh, "faces") else mesh
            except (AttributeError, TypeError, ValueError):
                raise TypeError("expected vertices and faces, a pair of them, a delmesh.Mesh or another mesh with `vertices` and "
                                f"`faces`, not {type(mesh).__name__}") from None
            mesh = Mesh._for_one_call(context, cancel, vertices, faces, layers, edges, edge_marks)
        elif layers is not None or edges is not None or edge_marks is not None:
            raise InvalidArgument("'layers', 'edges' and 'edge_marks' go with vertices and faces: a Mesh gets them when it is "
                                  "made.")
        result.append(mesh)
    return context, *result


def _initialised(library, struct):
    """A struct with its defaults."""
    value = struct()
    getattr(library, struct.__name__.removeprefix("delmesh_") + "_init")(value, C.sizeof(struct))
    return value


def _run(context, name, arguments, report_type, progress, cancel, out=None):
    """Calls the operation; its last argument is the report, which becomes a report_type, also where the call fails."""
    report = _initialised(context._library, _reports.STRUCTS[report_type])
    try:
        context._call(getattr(context._library, name), *arguments, report, progress=progress, cancel=cancel, out=out)
    except DelmeshError as error:
        error.report = report_type(*_values(report))
        raise
    return report_type(*_values(report))


class RemeshOptions(TypedDict, total=False):
    """The keyword arguments of remesh: the fields of delmesh_remesh_options, choices as words."""

    mode: Mode  # "preserve"
    placement: Literal["interval", "shells"]  # where edges are split
    boundary: Boundary  # whether angles opposite to boundary edges must be at most 90 degrees
    precision: Any  # "float32" or "float64", of the result; here the default is that of the mesh
    strict: bool  # refuse what would have to be repaired
    compact: bool  # leave out vertices that no face uses
    effort: int  # preserve: 0 plain rule, 1 look ahead, more: search for fewer vertices
    feature_angle: float  # degrees; mode "feature" keeps edges whose normals turn more
    max_normal_turn: float  # degrees; flips that turn a normal further are refused
    shell_unit: float  # length; radius of the innermost shell
    tolerance: float  # length; how far "preserve" may move the surface
    max_vertices: int  # of the result
    split_budget: int
    map: bool  # whether the result has corner_map and edge_source; here the default is: if there are layers
    release: Release  # kinds of edges that are not kept: "uv", ("uv", "material"), ...


class DecimateOptions(TypedDict, total=False):
    """The keyword arguments of lod_family and decimate: the fields of delmesh_decimate_options, choices as words."""

    prepare: Mode  # "flip"; how the input becomes Delaunay
    boundary: Boundary
    precision: Any  # "float32" or "float64", of the result; here the default is that of the mesh
    strict: bool
    collapse_placement: Literal["all", "paper", "endpoints"]  # where the vertex of a collapse may go
    quality: int  # sweeps of relaxation; 6 is most of what there is to gain
    feature_angle: float  # degrees; prepare="feature" keeps edges whose normals turn more
    tolerance: float  # length; how far prepare="preserve" may move the surface
    max_normal_turn: float  # degrees
    boundary_weight: float
    prune: float  # length; components with a smaller diagonal may vanish
    vert_weights: Any  # (v,) numbers over 0 that scale the error around each source vertex
    locked_verts: Any  # (v,) bool or integers: source vertices that stay where they are
    face_mask: Any  # (f,) bool or integers per source polygon: what is 0 stays as it is
    map: bool  # as in RemeshOptions
    release: Release


class DistanceOptions(TypedDict, total=False):
    """The keyword arguments of distance: the fields of delmesh_distance_options."""

    compute_bound: bool  # whether to prove an upper bound
    samples: int  # per direction; 0: 4 per triangle, at least 100,000
    relative_error: float  # 0.1: the bound is at most 10 % over the sampled value ...
    absolute_error: float  # ... and so many percent of the diagonal of the first mesh


class Result(NamedTuple):
    """A mesh and the report of how it was made: (mesh, report)."""

    mesh: Mesh
    report: Any  # a RemeshReport of remesh, a DecimateReport of decimate

    @property
    def vertices(self) -> np.ndarray:
        """(v, 3) read-only, in the precision of the mesh: mesh.positions."""
        return self.mesh.positions

    @property
    def faces(self) -> np.ndarray:
        """(f, 3) read-only vertices of each triangle: mesh.faces."""
        return self.mesh.faces

    @property
    def layers(self) -> Mapping[str, np.ndarray]:
        """{name: array}: the layers of the source on the result: mesh.layers."""
        return self.mesh.layers

    @property
    def corner_map(self) -> tuple[np.ndarray, np.ndarray]:
        """(f, 3, 3) source corners and weights of each corner: mesh.corner_map."""
        return self.mesh.corner_map

    @property
    def edge_source(self) -> np.ndarray:
        """(e,) source edge of each edge, or -1: mesh.edge_source."""
        return self.mesh.edge_source


class Family(NamedTuple):
    """The meshes of lod_family, the finest first, and the report: (levels, report)."""

    levels: list[Mesh]
    report: DecimateReport


def _mapped(source, options):
    """The option `map`: if there are layers, or places on a cage, unless told otherwise."""
    wanted = bool(options.get("map", source._sources or source._cage))
    for name, layer in source._sources.items():
        if not wanted and layer.domain in ("corner", "edge"):
            raise InvalidArgument(f"The option 'map' was off, and the layer '{name}' of {_layers.PLURAL[layer.domain]} needs it.")
    return {"map": wanted}


def remesh(mesh, faces=None, /, *, layers: Layers | None = None, edges: Any = None, edge_marks: Any = None,
           progress: Progress = None, cancel: CancelToken | None = None, context: Context | None = None,
           **options: Unpack[RemeshOptions]) -> Result:
    """Makes a Delaunay mesh: remesh(vertices, faces, mode="preserve") -> Result with .vertices, .faces, .mesh, .report.

    vertices  (n, 3) float32 or float64, any strides; anything else is converted
    faces     (m, k) integers, counter-clockwise seen from outside
    mode      "preserve" (the surface stays), "flip" (the vertices stay) or "feature" (sharp edges stay)
    layers    {name: array or Layer} of vertices, corners, faces or edges: the result's .layers have the same names and types
    edges, edge_marks  as for Mesh

    Vertex i of the input is vertex i of the result; new ones come after. Further options, see RemeshOptions: placement, boundary,
    precision, strict, compact, effort, feature_angle and max_normal_turn (degrees), shell_unit and tolerance (lengths),
    max_vertices, split_budget, map, release. Raises InvalidArgument, IndexOutOfRange, NoSurface, NonOrientable, VertexLimit,
    PrecisionExhausted, Cancelled, ... with the RemeshReport so far as `report`.
    """
    context, source = _prepare(context, cancel, _one(mesh, faces), layers=layers, edges=edges, edge_marks=edge_marks)
    settings, out = _initialised(context._library, _capi.delmesh_remesh_options), C.c_void_p()
    _set_options(settings, {"precision": source.info.precision, **options, **_mapped(source, options)})
    report = _run(context, "remesh", [source._handle.pointer, settings, out], RemeshReport, progress, cancel, out)
    made = Mesh._made(context, out)
    made._carry(context, source, cancel)
    return Result(made, report)


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


def _one_of(**given):
    """-> the name and the value of the one argument that is not None."""
    there = [(name, value) for name, value in given.items() if value is not None]
    if len(there) != 1:
        raise InvalidArgument(f"Exactly one of {', '.join(given)} must be given.")
    return there[0]


def lod_family(mesh, faces=None, /, *, targets: Sequence | None = None, ratios: Sequence[float] | None = None,
               layers: Layers | None = None, edges: Any = None, edge_marks: Any = None, progress: Progress = None,
               cancel: CancelToken | None = None, context: Context | None = None,
               **options: Unpack[DecimateOptions]) -> Family:
    """Coarser and coarser Delaunay meshes in one run: lod_family(vertices, faces, ratios=[0.5, 0.1]) -> Family with .levels, one
    Mesh each, and .report, a DecimateReport.

    ratios   shares of the input's triangles, the largest first; or
    targets  the finest first: "full" (the whole Delaunay mesh), ("vertices", n), ("faces", n), ("ratio", share), ("deviation",
             distance in model units that is proven to be kept)
    layers   as for remesh, as are edges and edge_marks: every level has them on its own elements

    What kept a level from its target is its report.levels[i].stopped_by: "target" (nothing), "topology", "delaunay", "features",
    "bound". A level's vert_parent leads to the next coarser one. Further options, see DecimateOptions: prepare="flip" | "preserve"
    | "feature", quality, vert_weights (n,), locked_verts (n,), face_mask (m,), collapse_placement, precision, boundary, strict,
    feature_angle and max_normal_turn (degrees), tolerance and prune (lengths), boundary_weight, map, release.
    """
    name, values = _one_of(targets=targets, ratios=ratios)
    wanted = _targets([("ratio", value) for value in values] if name == "ratios" else list(values))
    context, source = _prepare(context, cancel, _one(mesh, faces), layers=layers, edges=edges, edge_marks=edge_marks)
    library = context._library
    settings = _initialised(library, _capi.delmesh_decimate_options)
    keep = []  # the arrays that the views point into
    plain = {"precision": source.info.precision, "prepare": "flip"}
    for name, values in options.items():
        if name not in ("vert_weights", "locked_verts", "face_mask"):
            plain[name] = values
        elif values is not None:
            if name != "vert_weights" and np.asarray(values).dtype.kind in "iu":
                values = np.asarray(values) != 0
            view, array = _arrays.view(values, name, 1, floating=name == "vert_weights", bytes_too=True)
            setattr(settings, name, view)
            keep.append(array)
    _set_options(settings, {**plain, **_mapped(source, plain)})
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
    # Each handle has an owner before the first layer is carried.
    meshes = [Mesh._made(context, C.c_void_p(made)) for made in out]
    for mesh in meshes:
        mesh._carry(context, source, cancel)
    return Family(meshes, with_levels(report))


def decimate(mesh, faces_of_mesh=None, /, *, vertices: int | None = None, faces: int | None = None, ratio: float | None = None,
             deviation: float | None = None, layers: Layers | None = None, edges: Any = None, edge_marks: Any = None,
             progress: Progress = None, cancel: CancelToken | None = None, context: Context | None = None,
             **options: Unpack[DecimateOptions]) -> Result:
    """Decimates to one target: decimate(vertices, faces, ratio=0.1) -> Result with .vertices, .faces, .mesh, .report.

    Exactly one of: vertices or faces (how many), ratio (of the input's triangles), deviation (length, proven to be kept). The
    options are those of lod_family, and layers, edges and edge_marks those of remesh.
    """
    target = _one_of(vertices=vertices, faces=faces, ratio=ratio, deviation=deviation)
    made, report = lod_family(_one(mesh, faces_of_mesh), targets=[target], layers=layers, edges=edges, edge_marks=edge_marks,
                              progress=progress, cancel=cancel, context=context, **options)
    return Result(made[0], report)


def estimate_preserve(mesh, faces=None, /, *, progress: Progress = None, cancel: CancelToken | None = None,
                      context: Context | None = None, **options: Unpack[RemeshOptions]) -> PreserveEstimate:
    """How many vertices remesh(mesh, mode="preserve", **options) would return, without doing all of it."""
    context, source = _prepare(context, cancel, _one(mesh, faces))
    settings = _initialised(context._library, _capi.delmesh_remesh_options)
    _set_options(settings, {"precision": source.info.precision, **options})
    return _run(context, "estimate_preserve", [source._handle.pointer, settings], PreserveEstimate, progress, cancel)


def certify(mesh, faces=None, /, *, boundary: Boundary = "nonobtuse", listed: bool = False, progress: Progress = None,
            cancel: CancelToken | None = None, context: Context | None = None) -> CertifyReport:
    """Decides exactly whether a mesh is Delaunay: certify(vertices, faces).delaunay. With listed, nld_edges (n, 2) and
    zero_area_face_list (n,) of the report hold what offends; else they are None."""
    context, source = _prepare(context, cancel, _one(mesh, faces))
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


class Measurement(NamedTuple):
    """What measure says of two meshes: the quality of each and the distance between them."""

    a: QualityReport
    b: QualityReport
    distance: DistanceReport


def measure(mesh, other=None, /, *, progress: Progress = None, cancel: CancelToken | None = None, context: Context | None = None):
    """Angle statistics (degrees), lengths and area: measure(vertices, faces) or measure(mesh) -> QualityReport.

    measure(a, b) of two meshes, each given as one argument -> Measurement with .a, .b and .distance. `progress` runs once for each
    of the three.
    """
    if other is not None and not _is_array(mesh):
        context, a, b = _prepare(context, cancel, mesh, other)
        more: dict[str, Any] = {"progress": progress, "cancel": cancel, "context": context}
        return Measurement(measure(a, **more), measure(b, **more), distance(a, b, **more))
    context, source = _prepare(context, cancel, _one(mesh, other))
    return _run(context, "measure_quality", [source._handle.pointer], QualityReport, progress, cancel)


def distance(a, b, *, progress: Progress = None, cancel: CancelToken | None = None, context: Context | None = None,
             **options: Unpack[DistanceOptions]) -> DistanceReport:
    """Two-sided distance between two surfaces, each given as one argument. Further options: compute_bound (whether to prove an
    upper bound), samples, relative_error (0.1: the bound is at most 10 % over the sampled value), absolute_error (percent of the
    diagonal of `a`)."""
    context, a, b = _prepare(context, cancel, a, b)
    settings = _initialised(context._library, _capi.delmesh_distance_options)
    _set_options(settings, options)
    return _run(context, "measure_distance", [a._handle.pointer, b._handle.pointer, settings], DistanceReport, progress, cancel)


def version():
    """The version of the library that runs, e.g. "0.1.0"."""
    return loaded_library().version_string
