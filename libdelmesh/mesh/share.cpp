// SPDX-License-Identifier: Apache-2.0
#include "mesh/mesh.h"

namespace dm {

void Mesh::share(const Mesh& o) {
    imported = o.imported;
    precision = o.precision;
    first_split = o.first_split;
    has_map = o.has_map;
    source_verts = o.source_verts;
    source_corners = o.source_corners;
    source_faces = o.source_faces;
    source_edges = o.source_edges;
    cage = o.cage;
    vertex_count = o.vertex_count;
    counts = o.counts;
    pos32.copy_from(o.pos32);
    pos64.copy_from(o.pos64);
    // Positions are never shared, so theirs is the Memory of the mesh, whoever's its other arrays are.
    const bool lends = o.pos32.memory().lends_to(pos32.memory());
    const auto take = [lends](auto& to, const auto& from) {
        if (lends)
            to = std::remove_reference_t<decltype(to)>::alias(from);
        else
            to.copy_from(from);
    };
    take(corner_vert, o.corner_vert);
    take(corner_twin, o.corner_twin);
    take(corner_bits, o.corner_bits);
    take(cut_slots, o.cut_slots);
    take(face_source, o.face_source);
    take(vert_source, o.vert_source);
    take(vert_join, o.vert_join);
    take(vert_parent, o.vert_parent);
    take(split_map, o.split_map);
    take(corner_map, o.corner_map);
    take(corner_places, o.corner_places);
    take(edge_source, o.edge_source);
    take(layers, o.layers);
    take(layer_values, o.layer_values);
    take(corner_cage, o.corner_cage);
    take(cage_places, o.cage_places);
    take(face_cage, o.face_cage);
}

} // namespace dm
