// SPDX-License-Identifier: Apache-2.0
// From a list of triangles to an oriented manifold: who is whose neighbour, and what is done where that has no single answer.
#pragma once

#include "base/context.h"
#include "mesh/mesh.h"

namespace dm {

// What need not be counted again.
struct Glance {
    explicit Glance(Memory& memory) : least_neighbour(memory) {}
    Array<int32_t> least_neighbour; // per vertex: of itself and its neighbours, kNoNeighbour where no face has it; or empty
    int64_t boundary_edges = -1;    // -1: not known
};

// Fills corner_twin and cut_slots, turns faces over, leaves out second copies of faces and appends copies of vertices, as
// docs/import.md says, and counts it in mesh.counts. Faces must have three different vertices in range. strict: the first repair
// is DELMESH_ERROR_STRICT. Uses the part from..to of the context's stage.
// One counting sort and one walk around every vertex when the triangles are an oriented manifold already. What that has seen
// on its way goes to `glance`.
Status connect_faces(Context& context, bool strict, double from, double to, Mesh& mesh, Glance& glance);

// Polygon that face f came from.
inline int32_t source_of_face(const Mesh& mesh, int64_t f) {
    return mesh.face_source.empty() ? static_cast<int32_t>(f) : mesh.face_source[f];
}

// Where the mesh's corners and faces are no longer the source's, one by one.
void remember_sources(Mesh& mesh);

// Removes the faces for which leave_out(f) is true from corner_vert, corner_map and face_source; the others keep their order.
template <class LeaveOut>
void leave_out_faces(Mesh& mesh, LeaveOut&& leave_out) {
    const int64_t faces = mesh.faces(); // as it was
    int64_t kept = 0;
    for (int64_t f = 0; f < faces; ++f) {
        if (leave_out(f)) {
            remember_sources(mesh);
            continue;
        }
        if (kept != f) {
            for (int k = 0; k < 3; ++k) mesh.corner_vert[3 * kept + k] = mesh.corner_vert[3 * f + k];
            for (int k = 0; k < 3; ++k) mesh.corner_map[3 * kept + k] = mesh.corner_map[3 * f + k];
            mesh.face_source[kept] = mesh.face_source[f];
        }
        ++kept;
    }
    mesh.corner_vert.resize_uninitialized(3 * kept);
    if (kept == faces) return;
    mesh.face_source.resize_uninitialized(kept);
    mesh.corner_map.resize_uninitialized(3 * kept);
}

} // namespace dm
