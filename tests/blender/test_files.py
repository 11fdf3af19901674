# SPDX-License-Identifier: Apache-2.0
"""Results in files: what is read back from .blend, binary PLY and glTF is certified by the independent certifier, which run.py
names (--certifier), else by the library's."""
import json
import os
import struct
import tempfile

import bpy
import numpy as np
import support
from campaign import certify_arrays
from support import Case, corner_verts, folded_sheet, monkey, points, remesh, select


def read_ply(path):
    with open(path, "rb") as file:
        data = file.read()
    end = data.index(b"end_header") + len(b"end_header")
    header, body = data[:end].decode().split("\n"), data[end:].lstrip(b"\r")[1:]
    assert "format binary_little_endian 1.0" in "".join(header), header
    sizes = {"float": 4, "uchar": 1, "int": 4, "uint": 4, "float32": 4, "uint8": 1}
    count, faces, stride, inside = 0, 0, 0, ""
    for words in (line.split() for line in header):
        if words[:1] == ["element"]:
            inside, number = words[1], int(words[2])
            count, faces = (number, faces) if inside == "vertex" else (count, number if inside == "face" else faces)
        elif words[:1] == ["property"] and inside == "vertex":
            stride += sizes[words[1]]
    place = np.frombuffer(body, np.uint8, count * stride).reshape(count, stride)[:, :12].copy().view(np.float32)
    record = np.frombuffer(body, [("n", "u1"), ("v", "<u4", 3)], faces, count * stride)
    assert (record["n"] == 3).all()
    return place, record["v"].astype(np.int32)


def read_glb(path):
    with open(path, "rb") as file:
        data = file.read()
    size = struct.unpack_from("<I", data, 12)[0]
    head, body = json.loads(data[20:20 + size]), data[28 + size:]
    parts, faces, at = [], [], 0
    for primitive in head["meshes"][0]["primitives"]:
        def array(number):
            accessor = head["accessors"][number]
            view = head["bufferViews"][accessor["bufferView"]]
            kind = {5126: np.float32, 5125: np.uint32, 5123: np.uint16, 5121: np.uint8}[accessor["componentType"]]
            return np.frombuffer(body, kind, accessor["count"] * {"VEC3": 3, "SCALAR": 1}[accessor["type"]],
                                 view.get("byteOffset", 0) + accessor.get("byteOffset", 0))
        parts.append(array(primitive["attributes"]["POSITION"]).reshape(-1, 3))
        faces.append(array(primitive["indices"]).astype(np.int64).reshape(-1, 3) + at)
        at += len(parts[-1])
    return np.concatenate(parts), np.concatenate(faces)


def read_head(path):
    with open(path, "rb") as file:
        data = file.read()
    return json.loads(data[20:20 + struct.unpack_from("<I", data, 12)[0]])


def weld(place, faces):
    """Vertices of one place become one: glTF doubles them along seams."""
    _, first, index = np.unique(place.view(np.uint32), axis=0, return_index=True, return_inverse=True)
    return place[first], index.reshape(-1)[faces].astype(np.int32)


class Files(Case):
    def check(self, place, faces, like):
        self.assertEqual(len(faces), len(like))
        self.assertTrue(certify_arrays(np.ascontiguousarray(place), np.ascontiguousarray(faces), "NONOBTUSE",
                                       os.environ.get("DELMESH_CERTIFIER", "")))

    def results(self):
        """A model with seams and materials, remeshed; and a level of it."""
        for make in (folded_sheet, lambda: monkey(1)):
            self.setUp()
            ob = make()
            ob.name = "model"
            remesh(ob, mode="FEATURE")
            yield ob
            bpy.ops.object.delmesh_lod(by="RATIO", ratios="0.6", source="BASE", boundary="NONOBTUSE", lod0="NONE")
            yield bpy.data.objects["model_LOD1"]

    def test_blend(self):
        with tempfile.TemporaryDirectory() as folder:
            for number, ob in enumerate(self.results()):
                faces, name = corner_verts(ob.data).reshape(-1, 3), ob.name
                path = os.path.join(folder, f"saved {number}.blend")
                bpy.ops.wm.save_as_mainfile(filepath=path, copy=True)
                with bpy.data.libraries.load(path) as (_, target):
                    target.objects = [name]
                mesh = target.objects[0].data
                np.testing.assert_array_equal(points(mesh), points(ob.data))
                self.check(points(mesh).astype(np.float32), corner_verts(mesh).reshape(-1, 3), faces)

    def test_ply(self):
        with tempfile.TemporaryDirectory() as folder:
            for ob in self.results():
                path = os.path.join(folder, "saved.ply")
                select(ob)
                if hasattr(bpy.types, "WM_OT_ply_export") or "ply_export" in dir(bpy.ops.wm):
                    bpy.ops.wm.ply_export(filepath=path, export_selected_objects=True, ascii_format=False, export_uv=False,
                                          export_normals=False, forward_axis="Y", up_axis="Z")
                else:
                    bpy.ops.preferences.addon_enable(module="io_mesh_ply")
                    bpy.ops.export_mesh.ply(filepath=path, use_selection=True, use_ascii=False, use_uv_coords=False,
                                            use_normals=False, axis_forward="Y", axis_up="Z")
                place, faces = read_ply(path)
                self.check(*weld(place, faces), ob.data.polygons)

    def test_families_in_gltf(self):
        ob = monkey()
        ob.name = "model"
        select(ob)
        bpy.ops.preferences.addon_enable(module="io_scene_gltf2")
        with tempfile.TemporaryDirectory() as folder:
            for structure in ("COLLECTION", "UNITY"):
                bpy.ops.object.delmesh_lod(by="RATIO", ratios="0.6,0.3", source="BASE", lod0="ORIGINAL", structure=structure)
                for wanted in (False, True):
                    bpy.context.scene.delmesh.gltf_lods = wanted
                    path = os.path.join(folder, "family.glb")
                    bpy.ops.export_scene.gltf(filepath=path, export_format="GLB")
                    head = read_head(path)
                    names = [node["name"] for node in head["nodes"]]
                    reached = set(head["scenes"][0]["nodes"]) | {i for node in head["nodes"] for i in node.get("children", ())}
                    finest = head["nodes"][names.index("model_LOD0")]
                    self.assertEqual("MSFT_lod" in head.get("extensionsUsed", ()), wanted)
                    self.assertEqual({names[i] for i in reached} >= {"model_LOD1", "model_LOD2"}, not wanted)
                    if wanted:
                        self.assertEqual([names[i] for i in finest["extensions"]["MSFT_lod"]["ids"]], ["model_LOD1", "model_LOD2"])

    def test_gltf(self):
        with tempfile.TemporaryDirectory() as folder:
            bpy.ops.preferences.addon_enable(module="io_scene_gltf2")
            for ob in self.results():
                path = os.path.join(folder, "saved.glb")
                select(ob)
                for attempt in range(3):
                    bpy.ops.export_scene.gltf(filepath=path, export_format="GLB", use_selection=True)
                    place, faces = read_glb(path)
                    if faces.max() < len(place):
                        break
                    # Seen once in a dozen runs of Blender 3.4: the same mesh, exported again, is whole.
                    self.assertLess(bpy.app.version, (3, 5), "the exporter wrote indices of vertices that are not there")
                self.check(*weld(place, faces), ob.data.polygons)
