// SPDX-License-Identifier: Apache-2.0
// Import, in the order of docs/import.md: check the faces' sizes, read the positions, weld, read the faces and cut polygons into
// triangles, leave out what is no triangle, connect the faces (mesh/connect), count, mark edges and borders (mesh/borders).
#include "mesh/build.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "base/hash.h"
#include "mesh/borders.h"
#include "mesh/connect.h"
#include "mesh/triangulate.h"
#include "mesh/views.h"

namespace dm {
namespace {

using LL = long long; // for %lld

constexpr int64_t kGrain = 1 << 15; // vertices or faces per block

inline uint64_t bits_of(float x) {
    return std::bit_cast<uint32_t>(x);
}
inline uint64_t bits_of(double x) {
    return std::bit_cast<uint64_t>(x);
}

class Import {
public:
    Import(Context& context, const MeshInput& input, Mesh& mesh)
        : context_(context), input_(input), mesh_(mesh), weld_to_(context.memory()) {}

    Status run() {
        DM_TRY(check_sizes());
        mesh_.vertex_count = static_cast<int32_t>(input_.positions.count);
        if (input_.positions.type == DELMESH_FLOAT64)
            DM_TRY(read_positions(Precision::f64, mesh_.pos64));
        else
            DM_TRY(read_positions(Precision::f32, mesh_.pos32));
        DM_TRY(triangles_only_ ? read_triangles() : read_polygons());
        Glance glance(context_.memory());
        DM_TRY(connect_faces(context_, input_.strict, 0.4, 0.9, mesh_, glance));
        mesh_.first_split = mesh_.vertex_count;
        mesh_.imported = true;
        forget_identity(mesh_.face_source);
        forget_identity(mesh_.corner_map);
        mesh_.has_map = true;
        mesh_.source_verts = input_.positions.count;
        mesh_.source_corners = given_corners_;
        mesh_.source_faces = mesh_.counts.polygons;
        DM_TRY(context_.progress(0.9));
        DM_TRY(count_mesh(context_, mesh_, &glance));
        mesh_.source_edges = mesh_.counts.edges;
        DM_TRY(mark_edges(context_, input_, weld_to_, 0.92, 0.96, mesh_));
        DM_TRY(find_borders(context_, input_, 0.96, 1, mesh_));
        log_repairs();
        return DELMESH_OK;
    }

private:
    // The sizes of the faces against each other and the corners, from the caller's arrays alone, before anything is allocated.
    Status check_sizes() {
        given_corners_ = input_.corner_verts.count * input_.corner_verts.components;
        by_offset_ = input_.face_offsets.type != 0;
        if (!by_offset_ && input_.face_sizes.type == 0) {
            mesh_.counts.polygons = given_corners_ / 3;
            return DELMESH_OK;
        }
        int64_t taken = 0; // corners
        if (by_offset_)
            DM_TRY(with_numbers(input_.face_offsets, [&](auto offset) { return check_offsets(offset, taken); }));
        else
            DM_TRY(with_numbers(input_.face_sizes, [&](auto size_of) { return check_face_sizes(size_of, taken); }));
        const char* const name = by_offset_ ? "face_offsets" : "face_sizes";
        if (taken != given_corners_)
            return context_.fail(DELMESH_ERROR_INVALID_ARGUMENT, "%s: the faces took %lld of %lld corners.", name, LL{taken},
                                 LL{given_corners_});
        if (most_triangles_ > std::numeric_limits<int32_t>::max() / 3)
            return context_.fail(DELMESH_ERROR_TOO_LARGE, "%s: the faces made %lld triangles, more than 2^31 - 1 corners.", name,
                                 LL{most_triangles_});
        return DELMESH_OK;
    }

    template <class Numbers>
    Status check_offsets(const Numbers& offset, int64_t& taken) {
        if (offset(0) != 0)
            return context_.fail(DELMESH_ERROR_INVALID_ARGUMENT, "face_offsets: the first was %lld instead of 0.", LL{offset(0)});
        mesh_.counts.polygons = input_.face_offsets.count - 1;
        return in_pieces(context_, mesh_.counts.polygons, 0, 0.02, [&](int64_t begin, int64_t end) -> Status {
            for (int64_t f = begin; f < end; ++f) {
                const int64_t next = offset(f + 1);
                if (next > given_corners_)
                    return context_.fail(DELMESH_ERROR_INDEX_OUT_OF_RANGE,
                                         "face_offsets: offset %lld was %lld; there were %lld corners.", LL{f + 1}, LL{next},
                                         LL{given_corners_});
                if (next < taken)
                    return context_.fail(DELMESH_ERROR_INVALID_ARGUMENT,
                                         "face_offsets: offset %lld was %lld, less than the one before it.", LL{f + 1}, LL{next});
                add_polygon(next - taken);
                taken = next;
            }
            return DELMESH_OK;
        });
    }

    template <class Numbers>
    Status check_face_sizes(const Numbers& size_of, int64_t& taken) {
        mesh_.counts.polygons = input_.face_sizes.count;
        return in_pieces(context_, mesh_.counts.polygons, 0, 0.02, [&](int64_t begin, int64_t end) -> Status {
            for (int64_t f = begin; f < end; ++f) {
                const int64_t size = size_of(f);
                if (size < 0)
                    return context_.fail(DELMESH_ERROR_INVALID_ARGUMENT, "face_sizes: size %lld was %lld.", LL{f}, LL{size});
                if (size > given_corners_ - taken)
                    return context_.fail(DELMESH_ERROR_INDEX_OUT_OF_RANGE,
                                         "face_sizes: face %lld went past the last of %lld corners.", LL{f}, LL{given_corners_});
                add_polygon(size);
                taken += size;
            }
            return DELMESH_OK;
        });
    }

    void add_polygon(int64_t size) {
        triangles_only_ &= size == 3;
        most_triangles_ += size > 2 ? size - 2 : 0;
    }

    template <class T>
    Status read_positions(Precision precision, Array<T>& positions) {
        constexpr int64_t kSize = 3 * sizeof(T);
        const delmesh_view& view = input_.positions;
        const int64_t stride = view.stride == 0 ? kSize : view.stride;
        const char* const source = static_cast<const char*>(view.data);
        mesh_.precision = precision;
        positions.resize_uninitialized(3 * view.count);
        T* const target = positions.data();
        Array<uint8_t> finite_blocks(context_.memory(), (view.count + kGrain - 1) / kGrain, 1);
        DM_TRY(context_.progress(0.02));
        DM_TRY(context_.parallel(view.count, kGrain, [&](int64_t block, int64_t begin, int64_t end) {
            if (stride == kSize) {
                std::memcpy(target + 3 * begin, source + begin * kSize, static_cast<size_t>((end - begin) * kSize));
            } else {
                for (int64_t v = begin; v < end; ++v) std::memcpy(target + 3 * v, source + v * stride, kSize);
            }
            bool finite = true;
            for (int64_t i = 3 * begin; i < 3 * end; ++i) finite &= std::abs(target[i]) <= std::numeric_limits<T>::max();
            finite_blocks[block] = finite;
        }));
        for (const uint8_t finite : finite_blocks) all_finite_ &= finite != 0;
        return input_.weld ? weld(positions) : DELMESH_OK;
    }

    // weld_to_[v]: the first vertex at exactly the position of v.
    template <class T>
    Status weld(const Array<T>& positions) {
        const int64_t slots = table_size(mesh_.vertices());
        Array<int32_t> table(context_.memory(), slots, -1); // open addressing
        weld_to_.resize_uninitialized(mesh_.vertices());
        return in_pieces(context_, mesh_.vertices(), 0.1, 0.2, [&](int64_t begin, int64_t end) {
            for (int64_t v = begin; v < end; ++v) {
                weld_to_[v] = static_cast<int32_t>(v);
                const T* const p = positions.data() + 3 * v;
                if (std::isnan(p[0]) || std::isnan(p[1]) || std::isnan(p[2])) continue; // equal to nothing
                uint64_t hash = 0;
                for (int k = 0; k < 3; ++k) hash = scramble(hash + bits_of(p[k] + T{0})); // -0 + 0 is 0
                int64_t slot = static_cast<int64_t>(hash & static_cast<uint64_t>(slots - 1));
                for (;; slot = (slot + 1) & (slots - 1)) {
                    const int32_t w = table[slot];
                    if (w < 0) {
                        table[slot] = static_cast<int32_t>(v);
                        break;
                    }
                    const T* const q = positions.data() + 3 * static_cast<int64_t>(w);
                    if (p[0] == q[0] && p[1] == q[1] && p[2] == q[2]) {
                        weld_to_[v] = w;
                        ++mesh_.counts.welded_vertices;
                        break;
                    }
                }
            }
            return DELMESH_OK;
        });
    }

    Status out_of_range(int64_t corner, int64_t vertex) {
        return context_.fail(DELMESH_ERROR_INDEX_OUT_OF_RANGE,
                             "corner_verts: corner %lld had vertex %lld; there were %d vertices.", LL{corner}, LL{vertex},
                             mesh_.vertices());
    }
    bool is_vertex(int64_t v) const { return v >= 0 && v < input_.positions.count; }
    int32_t welded(int64_t v) const { return weld_to_.empty() ? static_cast<int32_t>(v) : weld_to_[v]; }
    bool is_finite_vertex(int32_t v) const { return all_finite_ || is_finite(mesh_.position(v)); }

    // Whole faces left out before anything is connected. `count` is how many triangles that are.
    Status leave_out_degenerate(int64_t face, int64_t count) {
        mesh_.counts.degenerate_faces += count;
        if (!input_.strict) return DELMESH_OK;
        return context_.fail(DELMESH_ERROR_STRICT,
                             "Face %lld had a vertex twice or fewer than three corners, and 'strict' forbids to leave it out.",
                             LL{face});
    }
    Status leave_out_non_finite(int64_t face, int64_t count) {
        mesh_.counts.non_finite_faces += count;
        if (!input_.strict) return DELMESH_OK;
        return context_.fail(DELMESH_ERROR_STRICT,
                             "Face %lld had a NaN or infinite coordinate, and 'strict' forbids to leave it out.", LL{face});
    }

    Status read_triangles() {
        const int64_t faces = mesh_.counts.polygons;
        struct Block {
            int64_t degenerate;
            bool in_range;
        };
        Array<Block> blocks(context_.memory(), (faces + kGrain - 1) / kGrain, Block{0, true});
        mesh_.corner_vert.resize_uninitialized(3 * faces);
        int32_t* const vert = mesh_.corner_vert.data();
        const uint64_t vertices = static_cast<uint64_t>(mesh_.vertices());
        DM_TRY(context_.progress(0.2));
        Status status = with_numbers(input_.corner_verts, [&](auto number) -> Status {
            DM_TRY(context_.parallel(faces, kGrain, [&](int64_t block, int64_t begin, int64_t end) {
                bool in_range = true;
                for (int64_t c = 3 * begin; c < 3 * end; ++c) {
                    const int64_t v = number(c);
                    in_range &= static_cast<uint64_t>(v) < vertices;
                    vert[c] = static_cast<int32_t>(v);
                }
                blocks[block].in_range = in_range;
                if (!in_range) return;
                if (!weld_to_.empty())
                    for (int64_t c = 3 * begin; c < 3 * end; ++c) vert[c] = weld_to_[vert[c]];
                int64_t count = 0;
                for (int64_t f = begin; f < end; ++f) count += is_degenerate(f);
                blocks[block].degenerate = count;
            }));
            for (int64_t block = 0; block < blocks.size(); ++block) {
                if (blocks[block].in_range) continue;
                for (int64_t c = 3 * block * kGrain;; ++c)
                    if (!is_vertex(number(c))) return out_of_range(c, number(c));
            }
            return DELMESH_OK;
        });
        DM_TRY(status);
        int64_t degenerate = 0;
        for (const Block& block : blocks) degenerate += block.degenerate;
        if (degenerate == 0 && all_finite_) return DELMESH_OK;
        leave_out_faces(mesh_, [&](int64_t f) {
            const int32_t* const v = vert + 3 * f;
            const bool finite = is_finite_vertex(v[0]) && is_finite_vertex(v[1]) && is_finite_vertex(v[2]);
            if (finite && !is_degenerate(f)) return false;
            if (status == DELMESH_OK) status = finite ? leave_out_degenerate(f, 1) : leave_out_non_finite(f, 1);
            return true;
        });
        return status;
    }

    bool is_degenerate(int64_t f) const {
        const int32_t* const v = mesh_.corner_vert.data() + 3 * f;
        return v[0] == v[1] || v[1] == v[2] || v[2] == v[0];
    }

    Status read_polygons() {
        mesh_.corner_vert.reserve(3 * most_triangles_);
        mesh_.face_source.reserve(most_triangles_);
        mesh_.corner_map.reserve(3 * most_triangles_);
        return with_numbers(input_.corner_verts, [&](auto vertex) {
            return with_numbers(by_offset_ ? input_.face_offsets : input_.face_sizes, [&](auto number) {
                Array<int32_t> polygon(context_.memory()), corners(context_.memory());
                Triangulator triangulator(context_.memory());
                int64_t corner = 0;
                return in_pieces(context_, mesh_.counts.polygons, 0.2, 0.4, [&](int64_t begin, int64_t end) -> Status {
                    for (int64_t f = begin; f < end; ++f) {
                        const int64_t last = by_offset_ ? number(f + 1) : corner + number(f);
                        const int64_t size = last - corner;
                        bool finite = true;
                        polygon.clear();
                        corners.clear();
                        for (; corner < last; ++corner) {
                            const int64_t given = vertex(corner);
                            if (!is_vertex(given)) return out_of_range(corner, given);
                            const int32_t v = welded(given);
                            finite &= is_finite_vertex(v);
                            if (!polygon.empty() && polygon.back() == v) continue;
                            polygon.push_back(v);
                            corners.push_back(static_cast<int32_t>(corner));
                        }
                        while (polygon.size() > 1 && polygon.back() == polygon[0]) polygon.pop_back();
                        DM_TRY(append_polygon(f, size, finite,
                                              {polygon.data(), corners.data(), static_cast<int32_t>(polygon.size())},
                                              triangulator));
                    }
                    return DELMESH_OK;
                });
            });
        });
    }

    Status append_polygon(int64_t f, int64_t size, bool finite, const Triangulator::Polygon& polygon,
                          Triangulator& triangulator) {
        const int64_t expected = size > 3 ? size - 2 : 1;
        if (!finite) return leave_out_non_finite(f, expected);
        const int64_t before = mesh_.faces();
        if (polygon.count >= 3) {
            const double fraction = 0.2 + 0.2 * static_cast<double>(f) / static_cast<double>(mesh_.counts.polygons);
            DM_TRY(triangulator.triangulate(context_, fraction, polygon, mesh_));
        }
        const int64_t made = mesh_.faces() - before;
        for (int64_t i = 0; i < made; ++i) mesh_.face_source.push_back(static_cast<int32_t>(f));
        return made == expected ? DELMESH_OK : leave_out_degenerate(f, expected - made);
    }

    static void forget_identity(Array<int32_t>& map) {
        for (int64_t i = 0; i < map.size(); ++i)
            if (map[i] != i) return;
        map.free_storage();
    }

    void log_repairs() {
        const MeshCounts& n = mesh_.counts;
        const auto say = [&](int64_t count, const char* one, const char* many) {
            if (count != 0) context_.log(DELMESH_LOG_WARNING, "%lld %s", LL{count}, count == 1 ? one : many);
        };
        say(n.degenerate_faces, "degenerate triangle was left out.", "degenerate triangles were left out.");
        say(n.non_finite_faces, "triangle with a NaN or infinite coordinate was left out.",
            "triangles with a NaN or infinite coordinate were left out.");
        say(n.duplicate_faces, "duplicate face was left out.", "duplicate faces were left out.");
        say(n.reoriented_faces, "face was turned over.", "faces were turned over.");
        say(n.nonmanifold_edges, "non-manifold edge was cut open.", "non-manifold edges were cut open.");
        say(n.nonmanifold_vertices, "non-manifold vertex was split.", "non-manifold vertices were split.");
        say(n.unmatched_marked_edges, "marked edge was no edge of the mesh.", "marked edges were no edges of the mesh.");
    }

    Context& context_;
    const MeshInput& input_;
    Mesh& mesh_;
    Array<int32_t> weld_to_;                         // empty when nothing is welded
    int64_t given_corners_ = 0, most_triangles_ = 0; // the latter only of polygons
    bool by_offset_ = false, triangles_only_ = true, all_finite_ = true;
};

} // namespace

Status build_mesh(Context& context, const MeshInput& input, Mesh& out) {
    return Import(context, input, out).run();
}

} // namespace dm
