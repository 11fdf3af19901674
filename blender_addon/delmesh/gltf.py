# SPDX-License-Identifier: GPL-3.0-or-later
"""What Blender's glTF exporter asks of add-ons: families as the extension MSFT_lod, if the scene's setting says so. The node of the
finest level then names those of the others, which are no nodes of the scene any more."""
import bpy

NAME = "MSFT_lod"


class glTF2ExportUserExtension:  # noqa: N801 the exporter looks for this name
    def __init__(self):
        self._levels = {}  # object -> [(level, its name)]

    def gather_node_hook(self, _node, blender_object, _export_settings):
        from .lods import LEVEL, SOURCE
        if blender_object is not None and LEVEL in blender_object:
            self._levels.setdefault(blender_object[SOURCE], []).append((blender_object[LEVEL], blender_object.name))

    def gather_gltf_extensions_hook(self, gltf, _export_settings):
        if not bpy.context.scene.delmesh.gltf_lods:
            return
        number = {node.name: i for i, node in enumerate(gltf.nodes)}
        for levels in self._levels.values():
            finest, *others = (number[name] for _, name in sorted(levels))
            if not others:
                continue
            node = gltf.nodes[finest]
            node.extensions = {**(node.extensions or {}), NAME: {"ids": others}}
            for owner in [*gltf.scenes, *gltf.nodes]:
                below = owner.nodes if hasattr(owner, "nodes") else owner.children
                if below:
                    below[:] = [i for i in below if i not in others]
            if NAME not in gltf.extensions_used:
                gltf.extensions_used.append(NAME)
