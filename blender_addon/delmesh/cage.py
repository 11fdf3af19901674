# SPDX-License-Identifier: GPL-3.0-or-later
"""The cage of an object: what a Subdivision Surface modifier gets, and in the library's words what it makes of that."""
from .text import number

BOUNDARIES = {"ALL": "edge", "PRESERVE_CORNERS": "edge_and_corner"}
FACE_VARYING = {"NONE": "all", "PRESERVE_CORNERS": "corners_only", "PRESERVE_CORNERS_AND_JUNCTIONS": "corners_plus1",
                "PRESERVE_CORNERS_JUNCTIONS_AND_CONCAVE": "corners_plus2", "PRESERVE_BOUNDARIES": "boundaries",
                "SMOOTH_ALL": "none"}


def modifier_of(ob):
    """The last Subdivision Surface modifier that is shown, None without one."""
    found = [modifier for modifier in ob.modifiers if modifier.type == "SUBSURF" and modifier.show_viewport]
    return found[-1] if found else None


def around(ob, modifier):
    """-> the modifiers before it and those after it, but armatures, which levels keep."""
    others = [each for each in ob.modifiers if each.type != "ARMATURE"]
    at = others.index(modifier)
    return others[:at], others[at + 1:]


def rate(modifier, level):
    """Into how many pieces edges are cut. level: of subdivision, 0: that of the modifier for renders."""
    return 2 ** (level or modifier.render_levels)


def triangles(mesh, pieces):
    """Of the mesh of the surface, at that rate."""
    return len(mesh.loops) * pieces * pieces // 2


def settings(modifier, level):
    """For survive.lod."""
    return {"scheme": "bilinear" if modifier.subdivision_type == "SIMPLE" else "catmull_clark",
            "boundary": BOUNDARIES[modifier.boundary_smooth], "face_varying": FACE_VARYING[modifier.uv_smooth],
            "use_creases": modifier.use_creases, "rate": rate(modifier, level)}


def missing(ob):
    return f"{ob.name} has no Subdivision Surface modifier that is shown in the viewport"


def told(ob, level):
    """What the levels are made of, in words."""
    modifier = modifier_of(ob)
    if not modifier:
        return missing(ob)
    if any(each.show_viewport for each in around(ob, modifier)[0]):
        return "The cage is what the modifiers before make"
    return f"Surface: {number(triangles(ob.data, rate(modifier, level)))} triangles"
