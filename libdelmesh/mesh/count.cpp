// SPDX-License-Identifier: Apache-2.0
// The numbers that describe the topology of a finished mesh.
#include <algorithm>
#include <atomic>
#include <utility>

#include "mesh/build.h"
#include "mesh/connect.h"
#include "mesh/link_fans.h"
#include "mesh/slices.h"
#include "mesh/views.h"

namespace dm {
namespace {

constexpr int64_t kVertexGrain = 1 << 14, kFaceGrain = 64, kFacesTogether = 128; // the last: so many times kFaceGrain

// Per vertex the least of itself and its neighbours.
Status find_least_neighbours(Context& context, const Mesh& mesh, Array<int32_t>& least_neighbour) {
    const int64_t faces = mesh.faces(), vertices = mesh.vertices();
    const int32_t* const vert = mesh.corner_vert.data();
    const int64_t slices = few_slices(context, faces, vertices), slice = (faces + slices - 1) / slices;
    least_neighbour.resize_uninitialized(slices * vertices); // of each slice of the faces apart
    DM_TRY(context.parallel(slices, 1, [&](int64_t k, int64_t, int64_t) {
        int32_t* const of = least_neighbour.data() + k * vertices;
        std::fill_n(of, vertices, kNoNeighbour);
        for (int64_t c = 3 * k * slice; c < 3 * std::min(faces, (k + 1) * slice); c += 3) {
            const int32_t p = vert[c], q = vert[c + 1], r = vert[c + 2], least = std::min(std::min(p, q), r);
            of[p] = std::min(of[p], least);
            of[q] = std::min(of[q], least);
            of[r] = std::min(of[r], least);
        }
    }));
    if (slices == 1) return DELMESH_OK;
    int32_t* const all = least_neighbour.data();
    return context.parallel(vertices, kVertexGrain, [&](int64_t, int64_t begin, int64_t end) {
        for (int64_t k = 1; k < slices; ++k)
            for (int64_t v = begin; v < end; ++v) all[v] = std::min(all[v], all[k * vertices + v]);
    });
}

// Components of faces connected through edges. The faces of a vertex are one fan, so these are the components of vertices too:
// each vertex is hung under its least neighbour, which leaves a few trees to be joined.
Status count_components(Context& context, const Mesh& mesh, Array<int32_t> parents, int64_t& components, int64_t& isolated) {
    const int64_t faces = mesh.faces(), vertices = mesh.vertices();
    const int32_t* const vert = mesh.corner_vert.data();
    int32_t* const parent = parents.data();
    // Parents come first, so theirs are roots by now; at the beginning of a block another thread may still be about to find them.
    struct Block {
        int64_t roots = 0, isolated = 0;
    };
    Array<Block> blocks(context.memory(), (vertices + kVertexGrain - 1) / kVertexGrain, Block{});
    DM_TRY(context.parallel(vertices, kVertexGrain, [&](int64_t k, int64_t begin, int64_t end) {
        const auto parent_of = [&](int32_t v) { return std::atomic_ref(parent[v]).load(std::memory_order_relaxed); };
        Block block;
        for (int32_t v = static_cast<int32_t>(begin); v < end; ++v) {
            int32_t p = parent[v];
            if (p == kNoNeighbour) {
                ++block.isolated;
            } else if (p == v) {
                ++block.roots;
            } else {
                for (int32_t next = parent_of(p); next != p; next = parent_of(p)) p = next;
                std::atomic_ref(parent[v]).store(p, std::memory_order_relaxed);
            }
        }
        blocks[k] = block;
    }));
    for (const Block& block : blocks) components += block.roots, isolated += block.isolated;
    if (components == 1) return DELMESH_OK;
    // Faces where trees meet are few and close to each other.
    const auto joins = [&](int64_t c) {
        return parent[vert[c]] != parent[vert[c + 1]] || parent[vert[c]] != parent[vert[c + 2]];
    };
    Array<uint8_t> with_joins(context.memory(), (faces + kFaceGrain - 1) / kFaceGrain);
    DM_TRY(context.parallel(with_joins.size(), kFacesTogether, [&](int64_t, int64_t begin, int64_t end) {
        for (int64_t k = begin; k < end; ++k) {
            bool any = false;
            for (int64_t f = k * kFaceGrain; f < std::min(faces, (k + 1) * kFaceGrain); ++f) any |= joins(3 * f);
            with_joins[k] = any;
        }
    }));
    const auto root = [&](int32_t v) {
        while (parent[v] != v) v = parent[v] = parent[parent[v]];
        return v;
    };
    return in_pieces(context, with_joins.size(), 0.3, 0.6, [&](int64_t begin, int64_t end) {
        for (int64_t k = begin; k < end; ++k) {
            if (with_joins[k] == 0) continue;
            for (int64_t c = 3 * k * kFaceGrain; c < 3 * std::min(faces, (k + 1) * kFaceGrain); c += 3) {
                if (!joins(c)) continue;
                for (int i = 1; i < 3; ++i) {
                    const int32_t p = root(vert[c]), q = root(vert[c + i]);
                    components -= p != q;
                    parent[std::max(p, q)] = std::min(p, q);
                }
            }
        }
        return DELMESH_OK;
    });
}

Status count_loops(Context& context, const Mesh& mesh, int64_t& loops) {
    const int64_t corners = mesh.corners();
    const int32_t* twin = mesh.corner_twin.data();
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

Status count_boundary_edges(Context& context, const Mesh& mesh, int64_t& count) {
    constexpr int64_t kGrain = 1 << 16;
    const int64_t corners = mesh.corners();
    Array<int32_t> blocks(context.memory(), (corners + kGrain - 1) / kGrain);
    DM_TRY(context.parallel(corners, kGrain, [&](int64_t block, int64_t begin, int64_t end) {
        blocks[block] = static_cast<int32_t>(
            std::count_if(mesh.corner_twin.data() + begin, mesh.corner_twin.data() + end, [](int32_t twin) { return twin < 0; }));
    }));
    count = 0;
    for (const int32_t of_block : blocks) count += of_block;
    return DELMESH_OK;
}

Status count_mesh(Context& context, Mesh& mesh, Glance* glance) {
    Glance unknown(context.memory());
    Glance& known = glance != nullptr ? *glance : unknown;
    MeshCounts& counts = mesh.counts;
    counts.edges = counts.boundary_edges = counts.isolated_vertices = counts.components = counts.boundary_loops = 0;
    if (known.least_neighbour.empty()) DM_TRY(find_least_neighbours(context, mesh, known.least_neighbour));
    DM_TRY(count_components(context, mesh, std::move(known.least_neighbour), counts.components, counts.isolated_vertices));
    if (known.boundary_edges < 0) DM_TRY(count_boundary_edges(context, mesh, known.boundary_edges));
    counts.boundary_edges = known.boundary_edges;
    if (counts.boundary_edges != 0) DM_TRY(count_loops(context, mesh, counts.boundary_loops));
    counts.edges = (mesh.corners() + counts.boundary_edges) / 2;
    counts.euler_characteristic = mesh.vertices() - counts.isolated_vertices - counts.edges + mesh.faces();
    return DELMESH_OK;
}

} // namespace dm
