# SPDX-License-Identifier: Apache-2.0
"""Everything that can lie on a mesh or an object, through every mode and into every level of a family. The model is a sphere with a
half of each material, and what is on it is a linear function of the position, so that what comes out can be told without asking the
add-on."""
import bpy
import numpy as np
from support import MODES, Case, corner_verts, part, points, remesh, select, uv

# Attributes: type, domain, and components where the values are floats
FLOATS = [("FLOAT", 1), ("FLOAT_VECTOR", 3), ("FLOAT2", 2), ("FLOAT_COLOR", 4), ("BYTE_COLOR", 4), ("QUATERNION", 4),
          ("FLOAT4X4", 16)]
WHOLES = ["INT", "INT8", "BOOLEAN", "INT32_2D", "INT16_2D", "STRING"]
PROPERTY = {"FLOAT_VECTOR": "vector", "FLOAT2": "vector", "FLOAT_COLOR": "color", "BYTE_COLOR": "color"}
SIZES = dict(FLOATS, INT32_2D=2, INT16_2D=2)


def linear(places, components):
    """(n, components) in 0.1 .. 0.9 for places in the unit ball."""
    weights = np.array([[np.cos(k + 2 * i) for i in range(3)] for k in range(components)])
    return 0.5 + 0.4 * places @ (weights / np.linalg.norm(weights, axis=1)[:, None]).T


def known_types():
    return {item.identifier for item in bpy.types.Attribute.bl_rna.properties["data_type"].enum_items}


def get(collection, name, count=1, dtype=np.float32):
    values = np.empty(len(collection) * count, dtype)
    collection.foreach_get(name, values)
    return values.reshape(-1, count) if count > 1 else values


def elements(mesh, domain):
    """Places of the elements, in double."""
    place, verts = points(mesh).astype(float), corner_verts(mesh)
    ends = np.array([e.vertices for e in mesh.edges])
    return {"POINT": lambda: place, "CORNER": lambda: place[verts], "EDGE": lambda: place[ends].mean(axis=1),
            "FACE": lambda: np.array([place[list(p.vertices)].mean(axis=0) for p in mesh.polygons])}[domain]()


def edge_marks(mesh):
    """{mark: values per edge}, by whatever way this Blender has."""
    marks = {"seam": get(mesh.edges, "use_seam", dtype=bool), "sharp": get(mesh.edges, "use_edge_sharp", dtype=bool)}
    for name, old in (("crease_edge", "crease"), ("bevel_weight_edge", "bevel_weight"), ("freestyle_edge", "use_freestyle_mark")):
        attribute = mesh.attributes.get(name)
        if attribute:
            values = get(attribute.data, "value", dtype=np.float32 if attribute.data_type == "FLOAT" else bool)
        else:
            values = get(mesh.edges, old, dtype=bool if "use" in old else np.float32)
        marks[name] = values
    return marks


def set_edge_mark(mesh, name, old, values):
    if hasattr(bpy.types.MeshEdge, old) or old in bpy.types.MeshEdge.bl_rna.properties:
        mesh.edges.foreach_set(old, values)
    else:
        kind = "FLOAT" if values.dtype == np.float32 else "BOOLEAN"
        mesh.attributes.new(name, kind, "EDGE").data.foreach_set("value", values)


def length_of(mesh, wanted):
    place = points(mesh)
    ends = np.array([e.vertices for e in mesh.edges])[wanted]
    return float(np.linalg.norm(place[ends[:, 0]] - place[ends[:, 1]], axis=1).sum())


def model(name="ball"):
    """512 polygons: quads, and triangles at the poles; the equator is marked in every way there is."""
    bpy.ops.mesh.primitive_uv_sphere_add(segments=32, ring_count=16, calc_uvs=True)
    ob = bpy.context.object
    mesh = ob.data
    ob.name = mesh.name = name
    mesh.uv_layers[0].name = "UVMap"
    second = mesh.uv_layers.new(name="flat")
    second.data.foreach_set("uv", linear(elements(mesh, "CORNER"), 2).astype(np.float32).reshape(-1))
    for color in ("north", "south"):
        mesh.materials.append(bpy.data.materials.new(color))
    centers = elements(mesh, "FACE")
    mesh.polygons.foreach_set("material_index", (centers[:, 2] < 0).astype(np.int32))
    mesh.polygons.foreach_set("use_smooth", centers[:, 2] > 0)
    for domain in ("POINT", "CORNER", "FACE", "EDGE"):
        for kind, count in FLOATS:
            if kind in known_types() and not (kind == "FLOAT2" and domain == "CORNER"):
                values = linear(elements(mesh, domain), count).astype(np.float32)
                attribute = mesh.attributes.new(f"{domain} {kind}", kind, domain)
                attribute.data.foreach_set(PROPERTY.get(kind, "value"), values.reshape(-1))
        for kind in WHOLES:
            if kind in known_types():
                attribute = mesh.attributes.new(f"{domain} {kind}", kind, domain)
                half = (elements(mesh, domain)[:, 2] < 0).astype(np.int32)
                if kind == "STRING":
                    for element, value in zip(attribute.data, half):
                        word = ("up", "down")[value]
                        element.value = word if isinstance(element.value, str) else word.encode()
                else:
                    attribute.data.foreach_set("value", np.repeat(half, SIZES.get(kind, 1)).astype(
                        bool if kind == "BOOLEAN" else np.int32))
    ring = np.abs(elements(mesh, "EDGE")[:, 2]) < 1e-6
    ring &= np.abs(points(mesh)[np.array([e.vertices for e in mesh.edges])][..., 2]).max(axis=1) < 1e-6
    assert ring.sum() == 32
    for mark, old in (("uv_seam", "use_seam"), ("sharp_edge", "use_edge_sharp"), ("freestyle_edge", "use_freestyle_mark")):
        set_edge_mark(mesh, mark, old, ring)
    for mark, old, value in (("crease_edge", "crease", 0.75), ("bevel_weight_edge", "bevel_weight", 0.25)):
        set_edge_mark(mesh, mark, old, np.where(ring, value, 0).astype(np.float32))
    place = points(mesh)
    slope, some = ob.vertex_groups.new(name="slope"), ob.vertex_groups.new(name="some")
    for v, weight in enumerate(linear(place.astype(float), 1)[:, 0]):
        slope.add([v], float(weight), "REPLACE")
    some.add([int(v) for v in np.flatnonzero(place[:, 2] > 0.5)], 0.0, "REPLACE")  # with weight 0, but in it
    ob.shape_key_add(name="Basis")
    for key_name, move in (("Wide", (1.5, 1, 1)), ("Tall", (1, 1, 2))):
        key = ob.shape_key_add(name=key_name)
        key.data.foreach_set("co", (place * move).astype(np.float32).reshape(-1))
    keys = mesh.shape_keys
    keys.key_blocks["Tall"].relative_key = keys.key_blocks["Wide"]
    keys.key_blocks["Tall"].vertex_group = "slope"
    keys.key_blocks["Wide"].slider_max = 3
    keys.key_blocks["Wide"].value = 0.25
    keys.key_blocks["Wide"].keyframe_insert("value", frame=1)
    keys.key_blocks["Tall"].driver_add("value").driver.expression = "0.125"
    ob.active_shape_key_index = 2
    mesh["note"], ob["tag"] = "kept", 7
    ob.location, ob.rotation_euler = (1, 2, 3), (0.1, 0.2, 0.3)
    ob.keyframe_insert("location", frame=1)
    ob.modifiers.new("sub", "SUBSURF").levels = 1
    ob.parent = bpy.data.objects.new("root", None)
    bpy.context.scene.collection.objects.link(ob.parent)
    ob.constraints.new("LIMIT_LOCATION").name = "limit"
    return ob


def fcurves(ident):
    data = ident.animation_data
    if not hasattr(data, "action_slot"):  # before 4.4
        return {curve.data_path for curve in data.action.fcurves}
    bags = [strip.channelbag(data.action_slot) for layer in data.action.layers for strip in layer.strips]
    return {curve.data_path for bag in bags if bag for curve in bag.fcurves}


class Survival(Case):
    """off: how far the surface and what is on it may be from the source's, which is of diameter 2."""

    def check_all(self, ob, source, off):
        mesh = ob.data
        self.check_uvs(mesh, off)
        self.check_attributes(mesh, off)
        self.check_faces(mesh, off)
        self.check_marks(mesh, source, off)
        self.check_groups(ob, off)
        self.check_keys(ob, off)
        self.check_object(ob, mesh)

    def check_uvs(self, mesh, off):
        self.assertEqual([layer.name for layer in mesh.uv_layers], ["UVMap", "flat"])
        np.testing.assert_allclose(uv(mesh, "flat"), linear(elements(mesh, "CORNER"), 2), atol=off)
        # The sphere's map has a cut along a meridian: no triangle lies on both sides of it.
        u = uv(mesh, "UVMap").reshape(-1, 3, 2)[..., 0]
        self.assertLess(np.ptp(u, axis=1).max(), 0.5)

    def check_attributes(self, mesh, off):
        for domain in ("POINT", "CORNER", "FACE", "EDGE"):
            for kind, count in FLOATS:
                if kind in known_types() and not (kind == "FLOAT2" and domain == "CORNER"):
                    attribute = mesh.attributes[f"{domain} {kind}"]
                    self.assertEqual((attribute.data_type, attribute.domain), (kind, domain))
                    values = get(attribute.data, PROPERTY.get(kind, "value"), count).reshape(-1, count)
                    expected = linear(elements(mesh, domain), count)
                    if kind == "QUATERNION" and domain in ("POINT", "CORNER"):
                        values, expected = (v / np.linalg.norm(v, axis=1)[:, None] for v in (values, expected))
                    if domain == "FACE":  # one value per face of the source, not in between
                        self.assertLess(np.abs(values - expected).max(), 0.2 + off, attribute.name)
                    elif domain == "EDGE":  # edges that are new have 0
                        kept = (values != 0).any(axis=1)
                        self.assertTrue(kept.any(), attribute.name)
                        self.assertLess(np.abs(values - expected)[kept].max(), 0.2 + off, attribute.name)
                    else:
                        np.testing.assert_allclose(values, expected, atol=off + (0.01 if kind == "BYTE_COLOR" else 0),
                                                   err_msg=attribute.name)
            for kind in WHOLES:
                if kind in known_types():
                    self.check_halves(mesh, domain, kind)

    def check_halves(self, mesh, domain, kind):
        """By hemisphere: right for all elements that lie well within one."""
        attribute = mesh.attributes[f"{domain} {kind}"]
        self.assertEqual((attribute.data_type, attribute.domain), (kind, domain))
        if kind == "STRING":
            values = np.array([element.value in ("down", b"down") for element in attribute.data])
        else:
            count = SIZES.get(kind, 1)
            values = get(attribute.data, "value", count, bool if kind == "BOOLEAN" else np.int32).reshape(-1, count)[:, 0]
        height = elements(mesh, domain)[:, 2]
        clear = np.abs(height) > 0.25
        if domain == "EDGE":
            self.assertFalse(values[clear & (height > 0)].any())
            self.assertTrue(values[clear & (height < 0)].any())
        else:
            np.testing.assert_array_equal(values[clear].astype(bool), height[clear] < 0, attribute.name)

    def check_faces(self, mesh, off):
        self.assertEqual([m.name for m in mesh.materials], ["north", "south"])
        south = elements(mesh, "FACE")[:, 2] < 0  # the border is the equator, which is kept
        np.testing.assert_array_equal(get(mesh.polygons, "material_index", dtype=np.int32), south)
        np.testing.assert_array_equal(get(mesh.polygons, "use_smooth", dtype=bool), ~south)

    def check_marks(self, mesh, source, off):
        for name, values in edge_marks(mesh).items():
            marked = values != 0
            self.assertAlmostEqual(length_of(mesh, marked) / source["ring"], 1, delta=1e-5 + off, msg=name)
            self.assertLess(np.abs(elements(mesh, "EDGE")[marked, 2]).max(), 1e-6 + off / 500, name)
            if values.dtype == np.float32:
                self.assertEqual(set(values[marked]), {np.float32({"crease_edge": 0.75, "bevel_weight_edge": 0.25}[name])})

    def check_groups(self, ob, off):
        mesh = ob.data
        self.assertEqual([g.name for g in ob.vertex_groups], ["slope", "some"])
        weights = [{g.group: g.weight for g in v.groups} for v in mesh.vertices]
        np.testing.assert_allclose([w[0] for w in weights], linear(points(mesh).astype(float), 1)[:, 0], atol=off)
        height = points(mesh)[:, 2]
        for w, z in zip(weights, height):
            if z > 0.75:
                self.assertEqual(w[1], 0)
            if z < 0.25:
                self.assertNotIn(1, w)

    def check_keys(self, ob, off):
        mesh, place = ob.data, points(ob.data)
        keys = mesh.shape_keys
        self.assertEqual([key.name for key in keys.key_blocks], ["Basis", "Wide", "Tall"])
        for name, move in (("Basis", (1, 1, 1)), ("Wide", (1.5, 1, 1)), ("Tall", (1, 1, 2))):
            co = get(keys.key_blocks[name].data, "co", 3)
            self.assertEqual(len(co), len(mesh.vertices))
            np.testing.assert_allclose(co, place * move, atol=off)
        self.assertEqual(keys.key_blocks["Tall"].relative_key.name, "Wide")
        self.assertEqual(keys.key_blocks["Tall"].vertex_group, "slope")
        self.assertEqual((keys.key_blocks["Wide"].slider_max, keys.key_blocks["Wide"].value), (3, 0.25))
        self.assertEqual(ob.active_shape_key_index, 2)
        self.assertEqual(fcurves(keys), {'key_blocks["Wide"].value'})
        self.assertEqual([d.data_path for d in keys.animation_data.drivers], ['key_blocks["Tall"].value'])

    def check_object(self, ob, mesh):
        self.assertEqual((mesh["note"], ob["tag"], ob.modifiers["sub"].levels), ("kept", 7, 1))
        self.assertEqual(tuple(ob.location), (1, 2, 3))
        self.assertEqual(fcurves(ob), {"location"})
        self.assertEqual(ob.constraints[0].name, "limit")

    def make(self):
        ob = model()
        return ob, {"ring": length_of(ob.data, edge_marks(ob.data)["seam"])}

    def test_remesh(self):
        for mode in MODES:
            with self.subTest(mode):
                self.setUp()
                ob, source = self.make()
                before = points(ob.data)
                remesh(ob, mode=mode)
                self.check_valid(ob.data)
                np.testing.assert_array_equal(points(ob.data)[:len(before)], before)
                self.check_all(ob, source, 2e-6 if mode == "PRESERVE" else 0.01)
                self.assertEqual(ob.parent.name, "root")

    def test_lod(self):
        ob, source = self.make()
        select(ob)
        bpy.ops.object.delmesh_lod("EXEC_DEFAULT", True, by="RATIO", ratios="0.5,0.25", source="BASE", boundary="NONOBTUSE",
                                   structure="COLLECTION")
        for n, off in ((1, 0.05), (2, 0.08)):
            with self.subTest(level=n):
                level = bpy.data.objects[f"ball_LOD{n}"]
                self.check_valid(level.data)
                self.check_all(level, source, off)
                self.assertEqual(level.parent.name, "root")

    def test_custom_normals(self):
        """Of a sphere that is lit as if it were larger: given at its vertices, and carried wherever these go."""
        for mode in (*MODES, "LOD"):
            with self.subTest(mode):
                self.setUp()
                bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=3)
                ob = bpy.context.object
                ob.name = "ball"
                mesh = ob.data
                mesh.polygons.foreach_set("use_smooth", np.ones(len(mesh.polygons), bool))
                if hasattr(mesh, "use_auto_smooth"):
                    mesh.use_auto_smooth = True
                mesh.normals_split_custom_set([self.normal(mesh.vertices[loop.vertex_index].co) for loop in mesh.loops])
                if mode == "LOD":
                    select(ob)
                    bpy.ops.object.delmesh_lod(by="RATIO", ratios="0.4", source="BASE")
                    ob = bpy.data.objects["ball_LOD1"]
                else:
                    remesh(ob, mode=mode)
                mesh = ob.data
                self.assertTrue(mesh.has_custom_normals)
                if hasattr(mesh, "corner_normals"):
                    normals = get(mesh.corner_normals, "vector", 3)
                else:
                    mesh.calc_normals_split()
                    normals = get(mesh.loops, "normal", 3)
                expected = np.array([self.normal(mesh.vertices[v].co) for v in corner_verts(mesh)])
                self.assertGreater((normals * expected).sum(axis=1).min(), 0.998)
                self.assertFalse(any(edge.use_edge_sharp for edge in mesh.edges))

    @staticmethod
    def normal(place):
        turned = np.array(place) + (0.5, 0, 0)
        return turned / np.linalg.norm(turned)

    def test_round_trip_changes_nothing(self):
        """What is read and written without a run between."""
        ob, _ = self.make()
        exchange = part("exchange")
        before = exchange.read(ob.data, ob)
        exchange.write(before, ob.data, ob, exchange.Settings(ob.data, ob))
        after = exchange.read(ob.data, ob)
        for name in ("positions", "edges", "corner_verts", "corner_edges", "face_offsets"):
            np.testing.assert_array_equal(getattr(after, name), getattr(before, name))
        self.assertEqual({(layer.name, layer.kind, layer.domain) for layer in after.layers},
                         {(layer.name, layer.kind, layer.domain) for layer in before.layers})
        for layer in before.layers:
            again = next(a for a in after.layers if (a.name, a.kind) == (layer.name, layer.kind))
            np.testing.assert_array_equal(again.values, layer.values, layer.name)
        for name in ("offsets", "indices", "values"):
            np.testing.assert_array_equal(getattr(after.weights, name), getattr(before.weights, name))
        np.testing.assert_array_equal(after.keys, before.keys)

    def test_byte_colours_stay_to_the_bit(self):
        """And are interpolated as the light that they stand for."""
        ob, _ = self.make()
        paint = ob.data.attributes.new("paint", "BYTE_COLOR", "POINT")
        count = len(paint.data)
        stored = (np.arange(4 * count) * 37 % 256 / 255).astype(np.float32)
        paint.data.foreach_set("color_srgb", stored)
        linear_ = get(paint.data, "color", 4)
        survive = part("survive")
        np.testing.assert_allclose(survive._to_linear(stored.reshape(-1, 4)), linear_, atol=1e-6)
        np.testing.assert_allclose(survive._to_stored(linear_), stored.reshape(-1, 4), atol=1e-6)
        remesh(ob, mode="PRESERVE", as_copy=False)
        paint = ob.data.attributes["paint"]
        self.assertGreater(len(paint.data), count)
        np.testing.assert_array_equal(get(paint.data, "color_srgb", 4)[:count], stored.reshape(-1, 4))

    def test_linked_duplicates_share_the_result(self):
        ob, _ = self.make()
        twin = ob.copy()
        bpy.context.scene.collection.objects.link(twin)
        remesh(twin, mode="FLIP")
        self.assertEqual(ob.data, twin.data)
        self.assertEqual((ob.active_shape_key_index, twin.active_shape_key_index), (2, 2))
        self.assertEqual([g.name for g in ob.vertex_groups], ["slope", "some"])
        for duplicate in (ob, twin):
            self.check_groups(duplicate, 0.01)

    def test_as_copy(self):
        ob, source = self.make()
        exchange = part("exchange")
        before = exchange.read(ob.data, ob)
        remesh(ob, mode="FLIP", as_copy=True)
        after = exchange.read(ob.data, ob)
        np.testing.assert_array_equal(after.positions, before.positions)
        np.testing.assert_array_equal(after.corner_verts, before.corner_verts)
        copy = bpy.data.objects["ball.001"]
        self.assertNotEqual(copy.data, ob.data)
        self.check_valid(copy.data)
        self.check_all(copy, source, 0.01)
