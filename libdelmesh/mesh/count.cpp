// SPDX-License-Identifier: Apache-2.0
// The numbers that describe the topology of a finished mesh.
#include <algorithm>
#include <limits>

#include "mesh/build.h"
#include "mesh/slices.h"
#include "mesh/views.h"

namespace dm {
namespace {

// Components of faces connected through edges. The faces of a vertex are one fan, so these are the components of vertices too:
// each vertex is hung under its least neighbour, which leaves a few trees to be joined.
Status count_components(Context& context, const Mesh& mesh, int64_t& components, int64_t& isolated) {
    constexpr int32_t kUnused = std::numeric_limits<int32_t>::max();
    const int64_t faces = mesh.faces(), vertices = mesh.vertices();
    const int32_t* const vert = mesh.corner_vert.data();
    const int64_t slices = few_slices(context, faces, vertices), slice = (faces + slices - 1) / slices;
    Array<int32_t> parents(context.memory(), slices * vertices); // of each slice of the faces apart
    DM_TRY(context.parallel(slices, 1, [&](int64_t k, int64_t, int64_t) {
        int32_t* const parent = parents.data() + k * vertices;
        std::fill_n(parent, vertices, kUnused);
        for (int64_t c = 3 * k * slice; c < 3 * std::min(faces, (k + 1) * slice); c += 3) {
            const int32_t p = vert[c], q = vert[c + 1], r = vert[c + 2], least = std::min(std::min(p, q), r);
            parent[p] = std::min(parent[p], least);
            parent[q] = std::min(parent[q], least);
            parent[r] = std::min(parent[r], least);
        }
    }));
    int32_t* const parent = parents.data();
    for (int64_t k = 1; k < slices; ++k)
        for (int64_t v = 0; v < vertices; ++v) parent[v] = std::min(parent[v], parents[k * vertices + v]);
    for (int32_t v = 0; v < mesh.vertices(); ++v) { // parents come first, so theirs are roots by now
        if (parent[v] == kUnused)
            ++isolated;
        else if (parent[v] == v)
            ++components;
        else
            parent[v] = parent[parent[v]];
    }
    if (components == 1) return DELMESH_OK;
    const auto root = [&](int32_t v) {
        while (parent[v] != v) v = parent[v] = parent[parent[v]];
        return v;
    };
    return in_pieces(context, faces, 0.3, 0.6, [&](int64_t begin, int64_t end) {
        for (int64_t c = 3 * begin; c < 3 * end; c += 3) {
            if (parent[vert[c]] == parent[vert[c + 1]] && parent[vert[c]] == parent[vert[c + 2]]) continue;
            for (int k = 1; k < 3; ++k) {
                const int32_t p = root(vert[c]), q = root(vert[c + k]);
                components -= p != q;
                parent[std::max(p, q)] = std::min(p, q);
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
    DM_TRY(count_components(context, mesh, counts.components, counts.isolated_vertices));
    DM_TRY(count_loops(context, mesh, counts.boundary_edges, counts.boundary_loops));
    counts.edges = (mesh.corners() + counts.boundary_edges) / 2;
    counts.euler_characteristic = mesh.vertices() - counts.isolated_vertices - counts.edges + mesh.faces();
    return DELMESH_OK;
}

} // namespace dm
