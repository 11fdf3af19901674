# SPDX-License-Identifier: GPL-3.0-or-later
"""What the operators do to a MeshData, with everything on it that can go along: which borders the library is told to keep, and how
layers, weights, shape keys and loose parts get onto its result. Without bpy: runs in a thread or in another process. `delmesh` is
the Python package, given by the caller."""
import dataclasses
import math

import numpy as np

from .limit import Surface
from .meshdata import Layer, MeshData, Rows

_DOMAINS = {"POINT": "vertex", "CORNER": "corner", "FACE": "face", "EDGE": "edge"}
UV_TOLERANCE = 1e-6  # rounding noise is no seam
NORMAL_TOLERANCE = 0.02  # custom normals are stored in 2 x 16 bits, relative to a frame
ALL_WEIGHTS = 65535  # entries per vertex: no limit
# Marks of edges by layer: (name, constant of the package, option that keeps such edges)
_MARKS = [("uv_seam", "EDGE_SEAM", "seams"), ("use_seam", "EDGE_SEAM", "seams"), ("sharp_edge", "EDGE_SHARP", "sharp"),
          ("use_edge_sharp", "EDGE_SHARP", "sharp"), ("crease_edge", "EDGE_CREASE", "creases"),
          ("crease", "EDGE_CREASE", "creases"),
          ("bevel_weight_edge", "EDGE_MARKED", "creases"), ("bevel_weight", "EDGE_MARKED", "creases"),
          ("freestyle_edge", "EDGE_MARKED", "freestyle"), ("use_freestyle_mark", "EDGE_MARKED", "freestyle")]
_BYTES = "BYTE_COLOR"
_COLORS = ("FLOAT_COLOR", _BYTES)
_SEEN = ("UV", *_COLORS)  # and so better right all over a face than at its corners
_TAKING_PART = ("uv_weight", "normal_weight", "fit")
# What edges can be kept for; the options of the operators
KEEP = ("seams", "sharp", "creases", "freestyle", "materials", "uv_borders", "colors", "face_sets", "normals")


class Refused(Exception):
    """Says in a sentence why an object is left alone."""


@dataclasses.dataclass
class Outcome:
    """What a run returns: a MeshData per result, and the package's reports as plain dicts."""

    meshes: list
    report: dict
    levels: list = dataclasses.field(default_factory=list)


# ---- To the library ---------------------------------------------------------------------------------------------------------


def _policy(layer):
    if layer.domain == "FACE":
        return "nearest"
    if layer.kind == "QUATERNION" or (layer.name == "custom_normal" and layer.kind == "FLOAT_VECTOR"):
        return "direction"
    return "linear" if layer.values.dtype.kind == "f" else "nearest"


def _edge_marks(delmesh, data, keep):
    marks = np.zeros(len(data.edges), np.int32)
    for layer in data.layers:
        for name, constant, option in _MARKS:
            if layer.domain == "EDGE" and layer.name == name and option in keep:
                marks |= np.where(layer.values != 0, getattr(delmesh, constant), 0).astype(np.int32)
    marks[data.loose_edges()] = 0
    return marks


def _layers(delmesh, data, keep, uv_weight=0.0, normal_weight=0.0, fit=False):
    """{number: delmesh.Layer} of the layers but those of edges, which follow the edges by their numbers. uv_weight, normal_weight,
    fit: see delmesh.Layer."""
    layers = {}
    for number, layer in enumerate(data.layers):
        given = {"domain": _DOMAINS[layer.domain], "policy": _policy(layer)}
        if layer.domain == "EDGE":
            continue
        if layer.kind in _SEEN and layer.domain in ("POINT", "CORNER"):
            given.update(fit=fit)
        if layer.kind == "UV" and "uv_borders" in keep:
            given.update(kind="uv", tolerance=UV_TOLERANCE, weight=uv_weight)
        elif layer.kind in _COLORS and layer.domain == "CORNER" and "colors" in keep:
            given.update(kind="color", border="keep")
        elif layer.name == "material_index" and layer.domain == "FACE" and "materials" in keep:
            given.update(kind="material")
        elif layer.name == ".sculpt_face_set" and layer.domain == "FACE" and "face_sets" in keep:
            given.update(kind="face_set")
        layers[str(number)] = delmesh.Layer(layer.values, **given)
    if data.normals is not None:
        layers["custom normals"] = delmesh.Layer(
            data.normals, domain="corner", policy="direction", kind="normal", tolerance=NORMAL_TOLERANCE,
            border="keep" if "normals" in keep else "free", weight=normal_weight, fit=fit)
    return layers


def _import(delmesh, data, keep=KEEP, taking_part=None, **more):
    """taking_part: the options of _layers."""
    layers = _layers(delmesh, data, keep, **(taking_part or {}))
    return delmesh.Mesh(data.positions, corner_verts=data.corner_verts, face_offsets=data.face_offsets, edges=data.edges,
                        edge_marks=_edge_marks(delmesh, data, keep), layers=layers, **more)


# ---- From the library -------------------------------------------------------------------------------------------------------


def _groups(a, b):
    """Pairs of numbers that are not negative -> a number per pair, equal for equal pairs, and how many have it."""
    _, index, count = np.unique(a.astype(np.int64) * (int(b.max(initial=0)) + 1) + b, return_inverse=True, return_counts=True)
    return index.reshape(-1), count


class _OnSurface:
    """What lies on `source`, at the elements of `made`, which was made of it: by the library's maps."""

    def __init__(self, delmesh, source, made, **more):
        self._delmesh, self._source, self._made, self._more = delmesh, source, made, more
        self._layers = made.layers
        self.verts, self.edges = made.vert_source, made.edge_source  # -1: none

    def layer(self, number):
        """Of faces, vertices or corners."""
        return self._layers[str(number)]

    def normals(self):
        return self._layers["custom normals"]

    def moves(self, values):
        """(v, 3) vectors at vertices."""
        return self._made.transfer(values, domain="vertex", **self._more)

    def rows(self, values):
        """The vertex groups with these values."""
        weights = self._source.weights
        return Rows(*self._delmesh.transfer_rows(self._made, weights.offsets, weights.indices, values, limit=ALL_WEIGHTS,
                                                 normalise=False, **self._more))


class _Result:
    """`made`, which the library made of `source`, as MeshData: the sheets joined again where it cut a non-manifold place open, and
    what no face uses put back. carried: what lies on the source, at the elements of `made`."""

    def __init__(self, source, made, carried, borders_are_free):
        self.source, self.made, self.carried = source, made, carried
        self.borders_are_free = borders_are_free
        join = made.vert_join
        self.stays = np.arange(len(join))
        positions, edges, faces, corner_edges = made.positions, made.edges, made.faces, made.corner_edges.reshape(-1)
        self.edge_source = carried.edges
        if (join != self.stays).any():
            positions, edges, faces, corner_edges = self._join(join)
        # A vertex that no face uses stays; so does one at the end of a wire if the mesh has lost it.
        number = np.full(len(source.positions), -1)
        origin = carried.verts[self.stays]
        number[origin[origin >= 0]] = np.flatnonzero(origin >= 0)
        wires = source.loose_edges()
        wanted = np.ones(len(source.positions), bool)
        wanted[source.corner_verts] = False
        wanted[source.edges[wires]] = True
        self.added = np.flatnonzero(wanted & (number < 0))
        number[self.added] = len(self.stays) + np.arange(len(self.added))
        self.edge_source = np.concatenate([self.edge_source, wires])
        self.data = MeshData(
            np.concatenate([positions, source.positions[self.added]]),
            np.concatenate([edges, number[source.edges[wires]]]).astype(np.int32), faces.reshape(-1).astype(np.int32),
            corner_edges.astype(np.int32), np.arange(0, 3 * len(faces) + 1, 3, dtype=np.int32), [])
        self.data.layers = [self._layer(i, layer) for i, layer in enumerate(source.layers)]
        if source.weights:
            self.data.weights = self._weights()
        self.data.keys = [self._key(key) for key in source.keys]
        if source.normals is not None:
            self.data.normals = carried.normals()

    def _join(self, join):
        while (join[join] != join).any():
            join = join[join]
        join = self._apart(join)
        stays = join == np.arange(len(join))
        number = (np.cumsum(stays) - 1)[join]
        self.stays = np.flatnonzero(stays)
        edges, first, index = np.unique(np.sort(number[self.made.edges], axis=1), axis=0, return_index=True, return_inverse=True)
        self.edge_source = self.edge_source[first]
        return (self.made.positions[self.stays], edges, number[self.made.faces],
                index.reshape(-1)[self.made.corner_edges.reshape(-1)])

    def _apart(self, join):
        """Where sheets must not be joined. Blender allows no two faces with the same vertices. And two borders that are left of
        three are an edge inside when joined: if nothing was asked of borders, that need not be Delaunay."""
        join, made = join.copy(), self.made
        while True:
            faces = np.sort(join[made.faces], axis=1)
            index, count = _groups(_groups(faces[:, 0], faces[:, 1])[0], faces[:, 2])
            verts = made.faces[count[index] > 1].reshape(-1)
            if self.borders_are_free:
                edges = np.sort(join[made.edges], axis=1)
                index, count = _groups(edges[:, 0], edges[:, 1])
                sides = np.bincount(index[made.corner_edges.reshape(-1)], minlength=len(count))
                verts = np.concatenate([verts, made.edges[((count == 2) & (sides == 2))[index]].reshape(-1)])
            # All sheets at such a vertex: one by one it would take as many rounds as there are sheets.
            meets = np.zeros(len(join), bool)
            meets[join[verts]] = True
            joined = np.flatnonzero(meets[join] & (join != np.arange(len(join))))
            if not len(joined):
                return join
            join[joined] = joined

    def _layer(self, number, layer):
        if layer.domain == "EDGE":
            values = layer.values[self.edge_source]
            values[self.edge_source < 0] = 0
        elif layer.domain == "POINT":
            values = np.concatenate([self.carried.layer(number)[self.stays], layer.values[self.added]])
        else:
            values = self.carried.layer(number)
        return Layer(layer.name, layer.kind, layer.domain, values, layer.texts)

    def _weights(self):
        source = self.source.weights
        made = self.carried.rows(source.values)
        if (source.values == 0).any():  # to be in a group with weight 0 is not to be out of it
            member = self.carried.rows(np.ones_like(source.values))
            key, within = (np.repeat(np.arange(len(rows.offsets) - 1), np.diff(rows.offsets)) * (1 << 32) + rows.indices
                           for rows in (member, made))
            values = np.zeros(len(key), np.float32)
            values[np.searchsorted(key, within)] = made.values
            made = Rows(member.offsets, member.indices, values)
        return Rows.concatenate([made.take(self.stays), source.take(self.added)])

    def _key(self, key):
        """What a key moves is carried, and added to where the vertex is now: exact in float64 where the vertex has not moved."""
        moves = key - self.source.positions.astype(np.float64)
        moves = np.concatenate([self.carried.moves(moves)[self.stays], moves[self.added]])
        return (self.data.positions + moves).astype(np.float32)


def _told(progress, low, high):
    """`progress` for a part of the run."""
    return lambda fraction, stage: progress(low + (high - low) * fraction, stage)


def _plain(report):
    return {name: value for name, value in report._asdict().items() if isinstance(value, (int, float, str))}


# ---- The runs ---------------------------------------------------------------------------------------------------------------


def remesh(delmesh, data, keep, options, progress, cancel):
    """options: those of delmesh.remesh, and growth_limit: refuse to preserve at the price of more vertices than so many times the
    input's; 0 is no limit; region: (f,) bool, the faces to remesh, whose border stays."""
    options = dict(options)
    limit, region, whole = options.pop("growth_limit", 0), options.pop("region", None), data
    if region is not None:
        data = whole.part(region)
        options["boundary"] = "ignore"
    source = _import(delmesh, data, keep, progress=_told(progress, 0, 0.05), cancel=cancel)
    if limit and options["mode"] == "preserve":
        estimate = delmesh.estimate_preserve(source, cancel=cancel, **options)
        if estimate.growth > limit:
            raise Refused(f"preserving the shape would take about {estimate.growth:.1f} times as many vertices "
                                f"({estimate.vertices_out:,}); Keep Features, a Tolerance, or a higher Growth Limit")
    result, report = delmesh.remesh(source, map=True, progress=_told(progress, 0.05, 0.95), cancel=cancel, **options)
    progress(0.95, "attributes")
    made = _Result(data, result, _OnSurface(delmesh, data, result, cancel=cancel), options["boundary"] == "ignore")
    return Outcome([made.data if region is None else _put_back(whole, ~region, made)], _plain(report) | _repairs(source))


def _put_back(whole, faces, made):
    """The faces of `whole` that were not remeshed, beside the result: vertices have kept their numbers, edges their ends."""
    data, corners = made.data, whole.corners_of(faces)
    edges = whole.corner_edges[corners]
    number = np.full(len(whole.edges), -1)
    number[made.edge_source[made.edge_source >= 0]] = np.flatnonzero(made.edge_source >= 0)
    if (np.sort(data.edges[number[edges]], axis=1) != np.sort(whole.edges[edges], axis=1)).any():
        raise Refused("the border of the selected faces could not be kept: they touch the others in more than an edge")

    def longer(values, more):
        return np.concatenate([values, more])

    chosen = {"FACE": faces, "CORNER": corners}
    data.layers = [dataclasses.replace(layer, values=longer(layer.values, before.values[chosen[layer.domain]]))
                   if layer.domain in chosen else layer for layer, before in zip(data.layers, whole.layers)]
    data.corner_verts = longer(data.corner_verts, whole.corner_verts[corners])
    data.corner_edges = longer(data.corner_edges, number[edges]).astype(np.int32)
    sizes = np.diff(whole.face_offsets)[faces]
    data.face_offsets = longer(data.face_offsets, data.face_offsets[-1] + np.cumsum(sizes)).astype(np.int32)
    if data.normals is not None:
        data.normals = longer(data.normals, whole.normals[corners])
    return data


def lod(delmesh, data, keep, options, progress, cancel):
    """options: those of delmesh.lod_family, and those of _layers; cage: what limit.Surface is told, for levels of the limit surface
    of `data`, whose vertices vert_weights and locked_verts then are of."""
    options = dict(options)
    taking_part = {name: options.pop(name) for name in _TAKING_PART if name in options}
    cage = options.pop("cage", None)
    beside = 0.0  # how far the source is from what the levels are of
    at_first = {"progress": _told(progress, 0, 0.05), "cancel": cancel}
    if cage:
        measure = any(target[0] == "deviation" for target in options["targets"])
        surface = Surface(delmesh, data, _edge_marks(delmesh, data, keep), _layers(delmesh, data, keep),
                          {**cage, "measure": measure}, **at_first)
        source, carried = surface.mesh, surface.at
        options.update(_of_surface(surface, options, keep))
        beside = max(surface.distance, 0.0)
    else:
        source = _import(delmesh, data, keep, taking_part, **at_first)

        def carried(level):
            return _OnSurface(delmesh, data, level, cancel=cancel)

    levels, report = delmesh.lod_family(source, map=True, progress=_told(progress, 0.05, 0.9), cancel=cancel, **options)
    made = []
    for i, level in enumerate(levels):
        progress(0.9 + 0.1 * i / len(levels), "attributes")
        made.append(_Result(data, level, carried(level), options["boundary"] == "ignore").data)
    told = [_plain(level) | {"bound": level.bound + beside if level.bound >= 0 else level.bound} for level in report.levels]
    return Outcome(made, _plain(report) | _repairs(source), told)


def _of_surface(surface, options, keep):
    """The options for the mesh of the limit surface, of those that are for the cage. Deviations are from the surface itself."""
    made = {}
    if "vert_weights" in options:
        made["vert_weights"] = surface.values(options["vert_weights"])
    if "locked_verts" in options:
        made["locked_verts"] = surface.borders(options["locked_verts"])
    if "creases" not in keep:
        made["release"] = ["crease"]
    made["targets"] = []
    for target in options["targets"]:
        if target[0] == "deviation":
            if target[1] <= surface.distance:
                raise Refused(f"at this Level the mesh of the smooth surface is off by {surface.distance:.4g} already, and "
                              f"{target[1]:.4g} were asked for")
            target = ("deviation", target[1] - surface.distance)
        made["targets"].append(target)
    return made


def check(delmesh, data, keep, options, progress, cancel):
    """options: those of delmesh.certify. The report also has the places of the ends of edges that are not Delaunay, (n, 2, 3), and
    what is to be selected in Blender: bool per vertex, edge, and face."""
    source = _import(delmesh, data, (), progress=_told(progress, 0, 0.3), cancel=cancel)
    certificate = delmesh.certify(source, listed=True, progress=_told(progress, 0.3, 0.7), cancel=cancel, **options)
    quality = delmesh.measure(source, progress=_told(progress, 0.7, 1), cancel=cancel)
    report = _plain(quality) | _plain(certificate) | _repairs(source)
    pairs = source.vert_source[certificate.nld_edges]  # cut places have more vertices than the mesh
    report["places"] = data.positions[pairs]
    report["selected"] = _selection(data, pairs, source.face_source[certificate.zero_area_face_list])
    return Outcome([], report)


def _selection(data, pairs, chosen):
    """Edges by their two vertices (n, 2), diagonals of polygons as well as they can be, and faces by their numbers."""
    verts, faces = np.zeros(len(data.positions), bool), np.zeros(len(data.face_offsets) - 1, bool)
    verts[pairs] = True
    faces[chosen] = True
    edges = np.isin(np.sort(data.edges, axis=1).astype(np.int64) @ (len(verts), 1),
                    np.sort(pairs, axis=1).astype(np.int64) @ (len(verts), 1))
    edges[data.corner_edges[data.corners_of(faces)]] = True
    verts[data.edges[edges]] = True
    return verts, edges, faces


def _repairs(source):
    """What import had to leave out or turn over."""
    return {name: getattr(source.info, name)
            for name in ("degenerate_faces", "duplicate_faces", "non_finite_faces", "reoriented_faces", "nonmanifold_edges")}


def _to_linear(values):
    """Of colours as bytes are stored, (n, 4): sRGB and alpha."""
    byte = np.arange(256) / 255
    table = np.where(byte < 0.04045, byte / 12.92, ((byte + 0.055) / 1.055)**2.4).astype(np.float32)
    made = values.copy()
    made[:, :3] = table[np.rint(255 * values[:, :3]).astype(np.uint8)]
    return made


def _to_stored(values):
    """The other way."""
    made = np.clip(values, 0, 1)
    color = made[:, :3]
    made[:, :3] = np.where(color < 0.0031308, 12.92 * color, 1.055 * color**np.float32(1 / 2.4) - 0.055)
    return made


def _with_bytes(data, convert):
    """`data` with its layers of bytes converted."""
    return dataclasses.replace(data, layers=[
        dataclasses.replace(layer, values=convert(layer.values)) if layer.kind == _BYTES else layer for layer in data.layers])


def _linear(run):
    """The run on linear colours, of which alone means are right."""
    def on_linear(delmesh, data, *arguments):
        outcome = run(delmesh, _with_bytes(data, _to_linear), *arguments)
        outcome.meshes = [_with_bytes(made, _to_stored) for made in outcome.meshes]
        return outcome

    return on_linear


RUNS = {"remesh": _linear(remesh), "lod": _linear(lod), "check": check}


def to_degrees(angle):
    """An angle of an option in radians; all the way round is no limit."""
    return -1.0 if angle >= math.pi - 1e-6 else math.degrees(angle)
