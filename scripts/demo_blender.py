# SPDX-License-Identifier: Apache-2.0
"""Runs in headless Blender: installs the packaged add-on, gives the demo's gear two materials and a UV map with seams, remeshes
it with the operator and renders before and after into one picture.

    blender -b --factory-startup --python-exit-code 7 --python demo_blender.py -- ADDON.zip GEAR.obj PICTURE.png
"""
import math
import sys

import bpy

ADDON, MODEL, PICTURE = sys.argv[sys.argv.index("--") + 1:]
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


def show(name, mesh, place):
    """The mesh, and over it its edges as thin tubes: renders have no wire overlay."""
    ob = bpy.data.objects.new(name, mesh)
    wires = bpy.data.objects.new(name + " wires", mesh.copy())
    wires.data.materials.clear()
    wires.data.materials.append(bpy.data.materials["wire"])
    modifier = wires.modifiers.new("wires", "WIREFRAME")
    modifier.thickness = 0.007
    modifier.use_even_offset = False
    for each in (ob, wires):
        each.location = place
        bpy.context.scene.collection.objects.link(each)
    return ob


def render():
    scene = bpy.context.scene
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    scene.collection.objects.link(camera)
    camera.location, camera.rotation_euler = (0, -4.2, 4.0), (math.radians(46), 0, 0)
    camera.data.type, camera.data.ortho_scale = "ORTHO", 5.4
    scene.camera = camera
    scene.world = bpy.data.worlds.new("paper")
    scene.world.color = (0.95, 0.95, 0.93)
    scene.render.engine = "BLENDER_WORKBENCH"
    scene.display.render_aa = "16"
    scene.display.shading.color_type = "MATERIAL"
    scene.display.shading.show_cavity = True
    scene.render.resolution_x, scene.render.resolution_y = 1500, 750
    scene.view_settings.view_transform = "Standard"
    scene.render.filepath = PICTURE
    bpy.ops.render.render(write_still=True)


def main():
    bpy.ops.wm.read_homefile(use_empty=True)
    bpy.ops.preferences.addon_install(filepath=ADDON, overwrite=True)
    bpy.ops.preferences.addon_enable(module="delmesh")
    material("wire", WIRE)
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
    render()
    print(f"demo: Blender {bpy.app.version_string}: {len(before.polygons)} -> {len(mesh.polygons)} triangles, "
          f"{'certified Delaunay' if certificate.delaunay else 'NOT DELAUNAY'}; {len(mesh.materials)} materials "
          f"(brass {area:.3f} -> {brass:.3f} of area), UV map \"{mesh.uv_layers[0].name}\" kept; picture {PICTURE}")
    if not certificate.delaunay:
        sys.exit(7)


main()
