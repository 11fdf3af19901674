// SPDX-License-Identifier: Apache-2.0
// The numbers that describe the topology of a finished mesh.
#include "mesh/build.h"
#include "mesh/views.h"

namespace dm {
namespace {

// Components of faces connected through edges.
Status count_components(Context& context, const Mesh& mesh, int64_t& components) {
    const int64_t faces = mesh.faces();
    Array<uint8_t> reached(context.memory(), faces, 0);
    Array<int32_t> stack(context.memory(), faces);
    const int32_t* twin = mesh.corner_twin.data();
    return in_pieces(context, faces, 0.2, 0.8, [&](int64_t begin, int64_t end) {
        for (int64_t seed = begin; seed < end; ++seed) {
            if (reached[seed] != 0) continue;
            ++components;
            reached[seed] = 1;
            stack[0] = static_cast<int32_t>(seed);
            for (int64_t depth = 1; depth != 0;) {
                const int64_t c = 3 * static_cast<int64_t>(stack[--depth]);
                for (int k = 0; k < 3; ++k) {
                    if (twin[c + k] < 0) continue;
                    const int32_t f = face_of(twin[c + k]);
                    if (reached[f] != 0) continue;
                    reached[f] = 1;
                    stack[depth++] = f;
                }
            }
        }
        return DELMESH_OK;
    });
}

Status count_loops(Context& context, const Mesh& mesh, int64_t& boundary_edges, int64_t& loops) {
    const int64_t corners = mesh.corners();
    const int32_t* twin = mesh.corner_twin.data();
    for (int64_t c = 0; c < corners; ++c) boundary_edges += twin[c] < 0;
    if (boundary_edges == 0) return DELMESH_OK;
    Array<uint8_t> walked(context.memory(), corners, 0);
    return in_pieces(context, corners, 0.8, 1, [&](int64_t begin, int64_t end) {
        for (int64_t first = begin; first < end; ++first) {
            if (twin[first] >= 0 || walked[first] != 0) continue;
            ++loops;
            for (int32_t c = static_cast<int32_t>(first); walked[c] == 0;) {
                walked[c] = 1;
                c = next_corner(c); // the boundary goes on where the fan around the next vertex ends
                while (twin[c] >= 0) c = next_corner(twin[c]);
            }
        }
        return DELMESH_OK;
    });
}

} // namespace

Status count_mesh(Context& context, Mesh& mesh) {
    MeshCounts& counts = mesh.counts;
    counts.edges = counts.boundary_edges = counts.isolated_vertices = counts.components = counts.boundary_loops = 0;
    {
        Array<uint8_t> used(context.memory(), mesh.vertices(), 0);
        for (const int32_t v : mesh.corner_vert) used[v] = 1;
        for (const uint8_t u : used) counts.isolated_vertices += u == 0;
    }
    DM_TRY(count_components(context, mesh, counts.components));
    DM_TRY(count_loops(context, mesh, counts.boundary_edges, counts.boundary_loops));
    counts.edges = (mesh.corners() + counts.boundary_edges) / 2;
    counts.euler_characteristic = mesh.vertices() - counts.isolated_vertices - counts.edges + mesh.faces();
    return DELMESH_OK;
}

} // namespace dm
