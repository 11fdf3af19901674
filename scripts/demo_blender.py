# SPDX-License-Identifier: Apache-2.0
"""Runs in headless Blender: installs the packaged add-on, gives the demo's gear two materials and a UV map with seams, remeshes
it with the operator and renders before and after into one picture; makes a family of five levels of Suzanne, subdivided to a
million triangles, and renders these as a contact sheet, shaded and with wires.

    blender -b --factory-startup --python-exit-code 7 --python demo_blender.py -- ADDON.zip GEAR.obj PICTURE.png FAMILY.png
"""
import math
import sys
import time

import bpy
import mathutils

ADDON, MODEL, PICTURE, FAMILY = sys.argv[sys.argv.index("--") + 1:]
RATIOS = (0.1, 0.03, 0.01, 0.003, 0.001)
STEEL, BRASS, WIRE = (0.30, 0.36, 0.42, 1), (0.78, 0.55, 0.20, 1), (0.02, 0.02, 0.02, 1)


def material(name, color):
    made = bpy.data.materials.new(name)
    made.diffuse_color = color
    made.roughness = 0.7
    return made


def load(path):
    points, faces = [], []
    with open(path) as lines:
        for line in lines:
            word, *rest = line.split() or [""]
            if word == "v":
                points.append([float(x) for x in rest])
            elif word == "f":
                faces.append([int(x.split("/")[0]) - 1 for x in rest])
    mesh = bpy.data.meshes.new("gear")
    mesh.from_pydata(points, [], faces)
    mesh.update()
    return mesh


def dress(mesh):
    """Brass ends, steel flanks; the map unrolls the flanks, cut at one side, and lays the ends flat."""
    mesh.materials.append(material("steel", STEEL))
    mesh.materials.append(material("brass", BRASS))
    layer = mesh.uv_layers.new(name="unrolled")
    for face in mesh.polygons:
        face.material_index = int(abs(face.normal.z) > 0.9)
        turn = math.atan2(face.center.y, face.center.x)
        for corner in face.loop_indices:
            x, y, z = mesh.vertices[mesh.loops[corner].vertex_index].co
            if face.material_index:
                layer.data[corner].uv = (0.2 * x + 0.25 + 0.5 * (z > 0), 0.2 * y + 0.75)
            else:  # the angle of the corner nearest to that of its face: only faces across the cut are torn apart
                angle = math.atan2(y, x)
                angle += math.tau * round((turn - angle) / math.tau)
                layer.data[corner].uv = (angle / math.tau + 0.5, 0.5 * z + 0.25)


def show(name, mesh, place, thickness=0.007):
    """The mesh, and over it its edges as thin tubes if these have a thickness: renders have no wire overlay."""
    ob = bpy.data.objects.new(name, mesh)
    ob.location = place
    bpy.context.scene.collection.objects.link(ob)
    if not thickness:
        return ob
    wires = bpy.data.objects.new(name + " wires", mesh.copy())
    wires.data.materials.clear()
    wires.data.materials.append(bpy.data.materials["wire"])
    modifier = wires.modifiers.new("wires", "WIREFRAME")
    modifier.thickness = thickness
    modifier.use_even_offset = False
    wires.location = place
    bpy.context.scene.collection.objects.link(wires)
    return ob


def render(path, place, tilt, width, pixels):
    scene = bpy.context.scene
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    scene.collection.objects.link(camera)
    camera.location, camera.rotation_euler = place, (math.radians(tilt), 0, 0)
    camera.data.type, camera.data.ortho_scale = "ORTHO", width
    scene.camera = camera
    scene.world = bpy.data.worlds.new("paper")
    scene.world.color = (0.95, 0.95, 0.93)
    scene.render.engine = "BLENDER_WORKBENCH"
    scene.display.render_aa = "16"
    scene.display.shading.color_type = "MATERIAL"
    scene.display.shading.show_cavity = True
    scene.render.resolution_x, scene.render.resolution_y = pixels
    scene.view_settings.view_transform = "Standard"
    scene.render.filepath = path
    bpy.ops.render.render(write_still=True)


def start():
    bpy.ops.wm.read_homefile(use_empty=True)
    bpy.ops.preferences.addon_enable(module="delmesh")
    material("wire", WIRE)


def remesh_gear():
    """-> whether the result is certified."""
    start()
    before = load(MODEL)
    dress(before)
    after = bpy.data.objects.new("gear", before.copy())
    bpy.context.scene.collection.objects.link(after)
    bpy.context.view_layer.objects.active = after
    after.select_set(True)
    bpy.ops.object.delmesh_remesh(mode="FEATURE")

    from delmesh import native  # the add-on's own way to the package
    delmesh = native.load()
    mesh = after.data
    points = [tuple(v.co) for v in mesh.vertices]
    certificate = delmesh.certify((points, [tuple(f.vertices) for f in mesh.polygons]))
    brass = sum(f.area for f in mesh.polygons if f.material_index)
    area = sum(f.area for f in before.polygons if f.material_index)
    bpy.context.scene.collection.objects.unlink(after)
    show("before", before, (-1.33, 0, 0))
    show("after", mesh, (1.33, 0, 0))
    render(PICTURE, (0, -4.2, 4.0), 46, 5.4, (1500, 750))
    print(f"demo: Blender {bpy.app.version_string}: {len(before.polygons)} -> {len(mesh.polygons)} triangles, "
          f"{'certified Delaunay' if certificate.delaunay else 'NOT DELAUNAY'}; {len(mesh.materials)} materials "
          f"(brass {area:.3f} -> {brass:.3f} of area), UV map \"{mesh.uv_layers[0].name}\" kept; picture {PICTURE}")
    return certificate.delaunay


def family():
    start()
    bpy.ops.mesh.primitive_monkey_add()
    ob = bpy.context.object
    ob.data.materials.append(material("clay", STEEL))
    for polygon in ob.data.polygons:
        polygon.use_smooth = True
    ob.modifiers.new("subdivision", "SUBSURF").levels = 5
    bpy.context.view_layer.update()
    began = time.perf_counter()
    bpy.ops.object.delmesh_lod(by="RATIO", ratios=",".join(map(str, RATIOS)), source="EVALUATED", lod0="NONE")
    took = time.perf_counter() - began
    levels = [bpy.data.objects[f"Suzanne_LOD{n}"].data for n in range(1, len(RATIOS) + 1)]
    for level in [ob, *bpy.data.collections["Suzanne_LODs"].objects]:
        bpy.data.objects.remove(level)
    for n, mesh in enumerate(levels):
        mesh.transform(mathutils.Matrix.Rotation(0.4, 4, "Z"))
        show(f"shaded {n}", mesh, (2.8 * n, 0, 1.1), 0)
        show(f"wires {n}", mesh, (2.8 * n, 0, -1.1), 0.006)
    render(FAMILY, (2.8 * (len(levels) - 1) / 2, -9, 0), 90, 2.8 * len(levels) + 0.4, (1800, 620))
    counts = ", ".join(f"{len(mesh.polygons):,}".replace(",", " ") for mesh in levels)
    print(f"demo: Suzanne, subdivided five times -> {counts} triangles in {took:.1f} s; contact sheet {FAMILY}")


def main():
    bpy.ops.preferences.addon_install(filepath=ADDON, overwrite=True)
    certified = remesh_gear()
    family()
    if not certified:
        sys.exit(7)


main()
