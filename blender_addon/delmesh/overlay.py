# SPDX-License-Identifier: GPL-3.0-or-later
"""Draws the edges that Check Delaunay found over the models, until the mesh changes."""
import bpy

_lines = {}  # name of a mesh -> (size it had, places in its space)
_handle = None
_COLOR, _WIDTH = (1.0, 0.25, 0.1, 1.0), 2.5


def _size(mesh):
    return len(mesh.vertices), len(mesh.polygons), len(mesh.loops)


def show(mesh, pairs):
    """pairs: (n, 2, 3) ends of edges."""
    _lines[mesh.name] = (_size(mesh), pairs.reshape(-1, 3).copy())
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                area.tag_redraw()


def _draw():
    import gpu
    from gpu_extras.batch import batch_for_shader

    context = bpy.context
    settings = context.scene.delmesh
    if not settings.show_overlay or not context.space_data.overlay.show_overlays:
        return
    name = "POLYLINE_UNIFORM_COLOR" if bpy.app.version >= (4, 0) else "3D_POLYLINE_UNIFORM_COLOR"
    for ob in context.visible_objects:
        size, places = _lines.get(ob.data.name, (None, ())) if ob.type == "MESH" else (None, ())
        if not len(places) or size != _size(ob.data):
            continue
        shader = gpu.shader.from_builtin(name)
        batch = batch_for_shader(shader, "LINES", {"pos": places})
        with gpu.matrix.push_pop():
            gpu.matrix.multiply_matrix(ob.matrix_world)
            shader.bind()
            shader.uniform_float("color", _COLOR)
            shader.uniform_float("lineWidth", _WIDTH)
            shader.uniform_float("viewportSize", gpu.state.viewport_get()[2:])
            gpu.state.depth_test_set("LESS_EQUAL")
            batch.draw(shader)
            gpu.state.depth_test_set("NONE")


def register():
    global _handle
    if not bpy.app.background:
        _handle = bpy.types.SpaceView3D.draw_handler_add(_draw, (), "WINDOW", "POST_VIEW")


def unregister():
    global _handle
    if _handle:
        bpy.types.SpaceView3D.draw_handler_remove(_handle, "WINDOW")
    _handle = None
    _lines.clear()
