# SPDX-License-Identifier: Apache-2.0
"""Layers: arrays of values at the vertices, corners, faces or edges of a mesh, and how they go along to what is made of it."""
from __future__ import annotations

import dataclasses
from typing import Any, Literal, Mapping, NamedTuple, Union

import numpy as np

from . import _arrays, _capi, _choices
from .errors import InvalidArgument

Domain = Literal["vertex", "corner", "face", "edge"]
Kind = Literal["uv", "normal", "color", "other", "material", "face_set"]
Border = Literal["default", "keep", "free"]
Policy = Literal["linear", "nearest", "direction", "weights"]

DOMAINS, KINDS = _choices.names("DELMESH_DOMAIN_"), _choices.names("DELMESH_LAYER_")
BORDERS, POLICIES = _choices.names("DELMESH_BORDER_"), _choices.names("DELMESH_TRANSFER_")

# How a name begins, in small letters -> what its layer is
NAMES = {"uv": "uv", "texcoord": "uv", "normal": "normal", "color": "color", "colour": "color", "material": "material",
         "face_set": "face_set"}
_OF_FACES = ("material", "face_set")
PLURAL = {"vertex": "vertices", "corner": "corners", "face": "faces", "edge": "edges"}


@dataclasses.dataclass(frozen=True, eq=False)
class Layer:
    """An array of values at the elements of a mesh, where the array alone would not say enough.

    values   (n, ...) any real numbers or booleans, any strides; n is the number of elements. Values of corners may also be
             (m, k, ...) as `faces` is (m, k)
    domain   "vertex", "corner" (in the order of the polygons' vertices), "face" or "edge"; None: the one that has n elements
    kind     what the library keeps borders for: "uv", "normal", "color" or "other" at corners, "material" or "face_set" of faces;
             None: what the layer's name begins with, else nothing: the values go along, and the mesh is made as without them
    border   "keep" edges across which the values jump, "free" them, or "default": free of normals, colours and layers of no kind
    tolerance         values that differ by no more in each component are the same
    affine_tolerance  of UVs, in their units: how far the texture may move on flat places; None: 1e-5 of their range
    weight   decimation: how much an error of this layer counts
    fit      values of vertices or corners, "linear" or "direction": results have those that fit all over the surface, in the mean of
             squares, instead of those at the vertices' places; borders and boundaries keep theirs
    policy   "linear", "nearest", "direction" (of length 1) or "weights" (that sum to 1); None: "direction" for normals of three
             floats, "nearest" for booleans and for integers that are no colours, else "linear"
    """

    values: Any
    domain: Domain | None = None
    kind: Kind | None = None
    border: Border = "default"
    tolerance: float = 0.0
    affine_tolerance: float | None = None
    weight: float = 0.0
    policy: Policy | None = None
    fit: bool = False

    def __post_init__(self):
        for name, choices in (("domain", DOMAINS), ("kind", KINDS), ("border", BORDERS), ("policy", POLICIES)):
            word = getattr(self, name)
            if word is not None or name == "border":
                _choices.number(f"The {name} of a layer", word, choices)


Layers = Mapping[str, Union[Layer, Any]]


class Resolved(NamedTuple):
    """A layer whose domain, kind and policy are known."""

    layer: Layer
    array: np.ndarray  # (n, ...)
    domain: str
    kind: str | None
    policy: str
    by_face: bool  # values of corners as (m, k, ...)


def checked(values, what):
    """`values` as an array that can be carried. what: how the sentence of a refusal begins."""
    array = np.asarray(values)
    if array.dtype.kind not in "iufb" or array.dtype.itemsize > 8:
        raise InvalidArgument(f"{what} had the type {array.dtype}, which is no real number that can be carried.")
    if array.ndim == 0 or (len(array) and array[:1].size == 0):
        raise InvalidArgument(f"{what} had the shape {array.shape} and not (n, ...).")
    return array


def resolve(name, given, counts, faces_shape, copy):
    """counts: the elements of each domain; faces_shape: (m, k), or None for polygons of other sizes. copy: the array must not
    change with the caller's."""
    layer = given if isinstance(given, Layer) else Layer(given)
    array = checked(layer.values, f"The layer '{name}'")
    by_face = faces_shape is not None and array.ndim > 1 and array.shape[:2] == faces_shape and (
        layer.domain == "corner" or (layer.domain is None and array.ndim > 2))
    if by_face:
        array = array.reshape(-1, *array.shape[2:])
    kind = layer.kind or next((kind for start, kind in NAMES.items() if name.lower().startswith(start)), None)
    domain = "corner" if by_face else layer.domain or _domain(name, len(array), kind, counts)
    if domain not in counts:
        raise InvalidArgument(f"The layer '{name}' was of edges, and no 'edges' were given.")
    if len(array) != counts[domain]:
        raise InvalidArgument(f"The layer '{name}' had {len(array)} elements, and there were {counts[domain]} {PLURAL[domain]}.")
    is_float = array.dtype.kind == "f"
    policy = layer.policy or ("direction" if kind == "normal" and is_float and np.prod(array.shape[1:]) == 3 else
                              "linear" if is_float or kind == "color" and array.dtype.kind != "b" else
                              "nearest")
    if policy in ("direction", "weights") and not is_float:
        raise InvalidArgument(f"The layer '{name}' had the type {array.dtype}, and the policy '{policy}' is for floats.")
    return Resolved(layer, np.array(array) if copy else array, domain, _kind(name, layer, array, domain, kind), policy, by_face)


def _are_ids(array):
    return array.dtype.kind in "iub" and array[:1].size <= 1


def _domain(name, rows, kind, counts):
    """The only domain with so many elements; what the layer is can rule domains out."""
    fitting = [domain for domain, count in counts.items() if count == rows]
    usual = [domain for domain in fitting if kind is None or (domain == "face") == (kind in _OF_FACES) and domain != "edge"]
    fitting = usual or fitting
    if len(fitting) == 1:
        return fitting[0]
    if not fitting:
        there = ", ".join(f"{count} {PLURAL[domain]}" for domain, count in counts.items())
        raise InvalidArgument(f"The layer '{name}' had {rows} elements, and there were {there}.")
    raise InvalidArgument(f"The layer '{name}' had {rows} elements, as many as there were "
                          f"{' and '.join(PLURAL[domain] for domain in fitting)}: say which with "
                          "delmesh.Layer(values, domain=...).")


def _kind(name, layer, array, domain, kind):
    """What the library is told that the layer is; None: nothing."""
    if domain in ("vertex", "edge") and layer.border == "keep":
        raise InvalidArgument(f"The layer '{name}' was of {PLURAL[domain]}, which have no borders to keep.")
    ids = _are_ids(array)
    if layer.kind and (domain == "face") != (kind in _OF_FACES) or layer.kind and domain == "edge":
        raise InvalidArgument(f"The layer '{name}' was of {PLURAL[domain]}, and the kind '{kind}' is of "
                              f"{'faces' if kind in _OF_FACES else 'corners'}.")
    if domain == "face":
        wanted = layer.border == "keep" or layer.kind is not None
        if wanted and not ids:
            raise InvalidArgument(f"The layer '{name}' had the type {array.dtype} and the shape {array.shape}; borders of faces "
                                  "are those of one integer each.")
        return (kind if kind in _OF_FACES else "face_set" if wanted else None) if ids else None
    if domain == "vertex":  # of these, only what counts inside the faces
        return kind if kind == "uv" or layer.weight != 0 and kind else "other" if layer.weight != 0 else None
    if domain == "corner":
        return kind if kind and kind not in _OF_FACES else "other" if layer.border == "keep" or layer.weight != 0 else None
    return None


def structs(layers, corner_verts, keep):
    """-> array of delmesh_layer for those of `layers`, {name: Resolved}, that have a kind, and their names. corner_verts: (c,) of
    the polygons; keep: gets the arrays that the views point into."""
    named = [(name, resolved) for name, resolved in layers.items() if resolved.kind]
    made = (_capi.delmesh_layer * len(named))()
    for struct, (name, (layer, array, domain, kind, _, _)) in zip(made, named):
        if array.dtype.kind in "iu" and array.dtype.itemsize == 8:
            if len(array) and (array.max() > np.iinfo(np.int32).max or array.min() < np.iinfo(np.int32).min):
                raise InvalidArgument(f"The layer '{name}' held a number that is not in the range of int32.")
            array = array.astype(np.int32)
        array = _carried(array)
        if domain == "vertex":  # an index out of range is the library's to tell
            index = corner_verts.astype(np.int64, copy=False)
            array = array.take(index, axis=0, mode="clip") if len(array) else np.zeros((len(index), *array.shape[1:]))
        struct.kind, struct.border = KINDS[kind], BORDERS[layer.border]
        struct.tolerance, struct.weight = layer.tolerance, layer.weight
        struct.affine_tolerance = -1 if layer.affine_tolerance is None else layer.affine_tolerance
        struct.struct_size = _capi.C.sizeof(struct)
        struct.values, array = _arrays.rows_view(array)
        keep.append(array)
    return made, [name for name, _ in named]


def _carried(array):
    """The same values in a type that the library knows."""
    kind, size = array.dtype.kind, array.dtype.itemsize
    if kind == "b":
        return array.view(np.uint8)
    if kind == "u" and size == 8:
        return array.astype(np.int64, copy=False)
    if kind == "f":
        return array.astype(np.float32 if size < 4 else array.dtype.newbyteorder("="), copy=False)
    return array.astype(np.int32 if size < 4 and (kind, size) != ("u", 1) else array.dtype.newbyteorder("="), copy=False)


def transfer(context, mesh, values, domain, policy, cancel=None, fit=None):
    """(n, ...) values of the source -> the same type and further dimensions at the elements of `mesh`. fit: None, or the source."""
    count = {"vertex": mesh.info.vertices, "corner": mesh.info.corners, "face": mesh.info.faces, "edge": mesh.info.edges}[domain]
    source = _carried(values)
    if values.dtype == np.uint64 and policy == "linear" and len(values) and values.max() > np.iinfo(np.int64).max:
        raise InvalidArgument("The values held a number of 2^63 or more, which can be carried with the policy 'nearest' only.")
    target = np.empty((count, *values.shape[1:]), source.dtype)
    view, kept = _arrays.rows_view(source)
    call, meshes = (context._library.transfer, []) if fit is None else (context._library.transfer_fitted, [fit._handle.pointer])
    context._call(call, *meshes, mesh._handle.pointer, DOMAINS[domain], POLICIES[policy], view, _arrays.rows_view_mut(target),
                  cancel=cancel)
    del kept
    if target.dtype == values.dtype:
        return target
    if values.dtype.kind == "b" or values.dtype == np.uint64:
        return target.view(values.dtype)
    return target.astype(values.dtype)


def carry(context, source, mesh, layers, cancel=None):
    """{name: Resolved} of the mesh `source` -> the same for `mesh`, which was made from it."""
    carried = {name: resolved._replace(array=transfer(context, mesh, resolved.array, resolved.domain, resolved.policy, cancel,
                                                      source if resolved.layer.fit else None))
               for name, resolved in layers.items()}
    for resolved in carried.values():
        resolved.array.flags.writeable = False  # a mesh never changes, and these go on to what is made of it
    return carried


def shown(layers):
    """{name: array} as the user sees them."""
    return {name: (r.array.reshape(-1, 3, *r.array.shape[1:]) if r.by_face else r.array) for name, r in layers.items()}
