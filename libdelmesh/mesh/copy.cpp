// SPDX-License-Identifier: Apache-2.0
#include "mesh/mesh.h"

namespace dm {

void Mesh::copy_from(const Mesh& o) {
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
    corner_vert.copy_from(o.corner_vert);
    corner_twin.copy_from(o.corner_twin);
    corner_bits.copy_from(o.corner_bits);
    cut_slots.copy_from(o.cut_slots);
    face_source.copy_from(o.face_source);
    vert_source.copy_from(o.vert_source);
    vert_join.copy_from(o.vert_join);
    vert_parent.copy_from(o.vert_parent);
    split_map.copy_from(o.split_map);
    corner_map.copy_from(o.corner_map);
    corner_places.copy_from(o.corner_places);
    edge_source.copy_from(o.edge_source);
    layers.copy_from(o.layers);
    layer_values.copy_from(o.layer_values);
    corner_cage.copy_from(o.corner_cage);
    cage_places.copy_from(o.cage_places);
    face_cage.copy_from(o.face_cage);
}

} // namespace dm
