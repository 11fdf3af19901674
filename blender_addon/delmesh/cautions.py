# SPDX-License-Identifier: GPL-3.0-or-later
"""What a user should know before a run, told from the objects without reading their meshes: what cannot survive, and where the
result is not what it seems."""

# Modifiers that are bound to the vertices of a mesh as it is
_BOUND = {"SURFACE_DEFORM", "MESH_DEFORM", "LAPLACIANDEFORM", "MESH_CACHE", "MESH_SEQUENCE_CACHE", "MULTIRES"}
_UNEVEN = 1e-4


def uneven_scale(ob):
    """Whether the certificate, which is about the object's own space, says nothing about the scene's."""
    scale = [abs(value) for value in ob.matrix_world.to_scale()]
    return max(scale) - min(scale) > _UNEVEN * max(scale)


def scale_of(ob):
    """Scene units of an object's unit; with an uneven scale the largest, so that lengths are kept in all directions."""
    return max(abs(value) for value in ob.matrix_world.to_scale()) or 1.0


def losses(ob, numbers_stay, custom_normals=True):
    """What of the object cannot survive, in words. numbers_stay: vertices keep their numbers."""
    mesh, lost = ob.data, []
    for modifier in ob.modifiers:
        if modifier.type in _BOUND:
            lost.append(f"what the modifier {modifier.name} has bound or stored")
        elif modifier.type == "HOOK" and not numbers_stay:
            lost.append(f"the vertices of the modifier {modifier.name}")
    if any(system.settings.type == "HAIR" for system in ob.particle_systems):
        lost.append("the places of hair")
    if not custom_normals and mesh.has_custom_normals:
        lost.append("custom normals")
    if not numbers_stay and any(child.parent_type.startswith("VERTEX") for child in ob.children):
        lost.append("the vertices of children with a vertex parent")
    return lost


def normal_mapped(mesh):
    """Names of the materials with a normal map in tangent space, which was baked for the mesh as it was."""
    return [material.name for material in mesh.materials if material and material.use_nodes and material.node_tree and any(
        node.type == "NORMAL_MAP" and node.space == "TANGENT" and node.inputs["Color"].is_linked
        for node in material.node_tree.nodes)]
