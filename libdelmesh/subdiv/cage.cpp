// SPDX-License-Identifier: Apache-2.0
// A cage is checked to the last index before OpenSubdiv sees it, which would print what it finds wrong and go on.
#include "subdiv/cage.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "base/hash.h"
#include "base/number.h"
#include "mesh/borders.h"
#include "mesh/views.h"

namespace dm {
namespace {

using LL = long long; // for %lld

constexpr int64_t kMostAround = 65535; // corners of a face, and faces and edges at a vertex: OpenSubdiv counts them in 16 bits

double real_at(const delmesh_view& view, int64_t element, int32_t component) {
    const char* const at = static_cast<const char*>(view.data) + element * view.stride;
    const auto load = [&](auto value) {
        std::memcpy(&value, at + component * static_cast<int64_t>(sizeof value), sizeof value);
        return static_cast<double>(value);
    };
    switch (view.type) {
    case DELMESH_FLOAT32:
        return load(float());
    case DELMESH_FLOAT64:
        return load(double());
    case DELMESH_INT32:
        return load(int32_t());
    case DELMESH_UINT32:
        return load(uint32_t());
    default:
        return load(uint8_t());
    }
}

class Build {
public:
    Build(Context& context, const CageInput& input, Cage& cage)
        : context_(context), input_(input), in_(input.mesh), cage_(cage), table_(context.memory()) {}

    Status run() {
        cage_.rules = input_.rules;
        DM_TRY(read_positions());
        DM_TRY(read_sizes());
        DM_TRY(read_corners());
        DM_TRY(number_edges());
        DM_TRY(check_valences());
        DM_TRY(read_creases());
        DM_TRY(read_sharp_verts());
        DM_TRY(read_holes());
        DM_TRY(read_marks());
        for (int32_t i = 0; i < in_.layer_count; ++i) DM_TRY(read_layer(in_.layers[i]));
        cage_.fingerprint = fingerprint();
        return context_.progress(0.5);
    }

private:
    Status read_positions() {
        const int64_t count = in_.positions.count;
        cage_.positions.resize_uninitialized(3 * count);
        return in_pieces(context_, count, 0, 0.05, [&](int64_t begin, int64_t end) -> Status {
            for (int64_t v = begin; v < end; ++v)
                for (int32_t k = 0; k < 3; ++k) {
                    const double x = real_at(in_.positions, v, k);
                    cage_.positions[3 * v + k] = x;
                    if (!std::isfinite(x))
                        return context_.fail(DELMESH_ERROR_INVALID_ARGUMENT,
                                             "positions: vertex %lld had a NaN or infinite coordinate.", LL{v});
                }
            return DELMESH_OK;
        });
    }

    Status read_sizes() {
        const bool by_offset = in_.face_offsets.type != 0, by_size = in_.face_sizes.type != 0;
        const int64_t corners = in_.corner_verts.count * in_.corner_verts.components;
        const int64_t faces = by_offset ? in_.face_offsets.count - 1 : by_size ? in_.face_sizes.count : corners / 3;
        const char* const name = by_offset ? "face_offsets" : by_size ? "face_sizes" : "corner_verts";
        if (faces == 0) return context_.fail(DELMESH_ERROR_NO_SURFACE, "%s: the cage had no faces.", name);
        cage_.face_first.resize_uninitialized(faces + 1);
        cage_.face_first[0] = 0;
        int64_t taken = 0;
        const auto add = [&](int64_t f, int64_t size) -> Status {
            if (size < 3 || size > kMostAround)
                return context_.fail(size < 3 ? DELMESH_ERROR_INVALID_ARGUMENT : DELMESH_ERROR_TOO_LARGE,
                                     "%s: face %lld had %lld corners, and faces of a cage have 3 to %lld.", name, LL{f}, LL{size},
                                     LL{kMostAround});
            if (size > corners - taken)
                return context_.fail(DELMESH_ERROR_INDEX_OUT_OF_RANGE, "%s: face %lld went past the last of %lld corners.", name,
                                     LL{f}, LL{corners});
            if (cage_.rules.scheme == DELMESH_SCHEME_LOOP && size != 3)
                return context_.fail(DELMESH_ERROR_INVALID_ARGUMENT,
                                     "%s: face %lld had %lld corners, and the Loop scheme takes triangles only.", name, LL{f},
                                     LL{size});
            taken += size;
            cage_.face_first[f + 1] = static_cast<int32_t>(taken);
            return DELMESH_OK;
        };
        const auto read = [&](auto&& size_of) {
            return in_pieces(context_, faces, 0.05, 0.1, [&](int64_t begin, int64_t end) -> Status {
                for (int64_t f = begin; f < end; ++f) DM_TRY(add(f, size_of(f)));
                return DELMESH_OK;
            });
        };
        if (by_offset)
            DM_TRY(with_numbers(in_.face_offsets, [&](auto offset) -> Status {
                if (offset(0) != 0)
                    return context_.fail(DELMESH_ERROR_INVALID_ARGUMENT, "face_offsets: the first was %lld instead of 0.",
                                         LL{offset(0)});
                return read([&](int64_t f) { return offset(f + 1) < 0 ? -1 : offset(f + 1) - offset(f); }); // nothing overflows
            }));
        else if (by_size)
            DM_TRY(with_numbers(in_.face_sizes, read));
        else
            DM_TRY(read([](int64_t) { return int64_t{3}; }));
        if (taken != corners)
            return context_.fail(DELMESH_ERROR_INVALID_ARGUMENT, "%s: the faces took %lld of %lld corners.", name, LL{taken},
                                 LL{corners});
        return DELMESH_OK;
    }

    bool is_vertex(int64_t v) const { return v >= 0 && v < cage_.vertices(); }

    // What `number` i of the view `name` is, if it is no index of a vertex.
    Status no_vertex(const char* name, const char* element, int64_t i, int64_t v) {
        return context_.fail(DELMESH_ERROR_INDEX_OUT_OF_RANGE, "%s: %s %lld had vertex %lld; there were %d vertices.", name,
                             element, LL{i}, LL{v}, cage_.vertices());
    }

    Status read_corners() {
        Array<int32_t> last(context_.memory(), cage_.vertices(), -1); // face that had the vertex
        cage_.corner_vert.resize_uninitialized(cage_.face_first.back());
        return with_numbers(in_.corner_verts, [&](auto number) {
            return in_pieces(context_, cage_.faces(), 0.1, 0.15, [&](int64_t begin, int64_t end) -> Status {
                for (int32_t f = static_cast<int32_t>(begin); f < end; ++f)
                    for (int32_t c = cage_.face_first[f]; c < cage_.face_first[f + 1]; ++c) {
                        const int64_t v = number(c);
                        if (!is_vertex(v)) return no_vertex("corner_verts", "corner", c, v);
                        if (last[v] == f)
                            return context_.fail(DELMESH_ERROR_INVALID_ARGUMENT, "corner_verts: face %d had vertex %lld twice.",
                                                 f, LL{v});
                        last[v] = f;
                        cage_.corner_vert[c] = static_cast<int32_t>(v);
                    }
                return DELMESH_OK;
            });
        });
    }

    // ---- Edges --------------------------------------------------------------------------------------------------------------

    // The slot of an edge, or the free one where it belongs.
    int32_t& slot_of(int64_t p, int64_t q) {
        const int64_t low = std::min(p, q), high = std::max(p, q);
        const uint64_t mask = static_cast<uint64_t>(table_.size() - 1);
        uint64_t slot = scramble(static_cast<uint64_t>(low) << 32 | static_cast<uint64_t>(high)) & mask;
        for (;; slot = (slot + 1) & mask) {
            int32_t& edge = table_[static_cast<int64_t>(slot)];
            if (edge < 0 || (cage_.edge_verts[2 * int64_t{edge}] == low && cage_.edge_verts[2 * int64_t{edge} + 1] == high))
                return edge;
        }
    }
    int32_t corner_after(int32_t f, int32_t c) const { return c + 1 < cage_.face_first[f + 1] ? c + 1 : cage_.face_first[f]; }

    Status number_edges() {
        table_.assign(table_size(cage_.corners()), -1);
        cage_.corner_edge.resize_uninitialized(cage_.corners());
        DM_TRY(in_pieces(context_, cage_.faces(), 0.15, 0.2, [&](int64_t begin, int64_t end) {
            for (int32_t f = static_cast<int32_t>(begin); f < end; ++f)
                for (int32_t c = cage_.face_first[f]; c < cage_.face_first[f + 1]; ++c) {
                    const int32_t p = cage_.corner_vert[c], q = cage_.corner_vert[corner_after(f, c)];
                    int32_t& edge = slot_of(p, q);
                    if (edge < 0) {
                        edge = cage_.edges();
                        cage_.edge_verts.push_back(std::min(p, q));
                        cage_.edge_verts.push_back(std::max(p, q));
                    }
                    cage_.corner_edge[c] = edge;
                }
            return DELMESH_OK;
        }));
        cage_.edge_bits.assign(cage_.edges(), 0);
        return DELMESH_OK;
    }

    Status check_valences() {
        Array<int32_t> edges(context_.memory(), cage_.vertices(), 0), faces(context_.memory(), cage_.vertices(), 0),
            around(context_.memory(), cage_.edges(), 0);
        for (const int32_t v : cage_.edge_verts) ++edges[v];
        for (const int32_t v : cage_.corner_vert) ++faces[v];
        for (const int32_t e : cage_.corner_edge) ++around[e];
        for (int32_t v = 0; v < cage_.vertices(); ++v)
            if (std::max(edges[v], faces[v]) > kMostAround)
                return context_.fail(DELMESH_ERROR_TOO_LARGE, "corner_verts: vertex %d had %d edges, more than %lld.", v,
                                     std::max(edges[v], faces[v]), LL{kMostAround});
        for (int32_t e = 0; e < cage_.edges(); ++e)
            if (around[e] > kMostAround)
                return context_.fail(
                    DELMESH_ERROR_TOO_LARGE, "corner_verts: the edge from vertex %d to %d had %d faces, more than %lld.",
                    cage_.edge_verts[2 * int64_t{e}], cage_.edge_verts[2 * int64_t{e} + 1], around[e], LL{kMostAround});
        return context_.progress(0.22);
    }

    // ---- Sharpness ----------------------------------------------------------------------------------------------------------

    Status read_sharpness(const char* name, const delmesh_view& view, int64_t i, float& sharpness) {
        const double given = real_at(view, i, 0);
        if (!(given >= 0)) // NaN too
            return context_.fail(DELMESH_ERROR_INVALID_ARGUMENT, "%s: sharpness %lld was %s, which is not 0 or more.", name,
                                 LL{i}, Number(given).text);
        constexpr double kInfinite = 10; // OpenSubdiv's
        sharpness = static_cast<float>(std::min(given, kInfinite));
        return DELMESH_OK;
    }

    Status read_creases() {
        if (input_.crease_edges.type == 0) return DELMESH_OK;
        return with_numbers(input_.crease_edges, [&](auto number) {
            return in_pieces(context_, input_.crease_edges.count, 0.22, 0.25, [&](int64_t begin, int64_t end) -> Status {
                for (int64_t i = begin; i < end; ++i) {
                    const int64_t p = number(2 * i), q = number(2 * i + 1);
                    if (!is_vertex(p) || !is_vertex(q)) return no_vertex("crease_edges", "crease", i, is_vertex(p) ? q : p);
                    float sharpness = 0;
                    DM_TRY(read_sharpness("crease_sharpness", input_.crease_sharpness, i, sharpness));
                    const int32_t edge = slot_of(p, q);
                    if (edge < 0) {
                        ++cage_.unmatched_creases;
                        continue;
                    }
                    cage_.crease_verts.push_back(static_cast<int32_t>(p));
                    cage_.crease_verts.push_back(static_cast<int32_t>(q));
                    cage_.crease_sharpness.push_back(sharpness);
                    mark(edge, sharpness > 0 ? DELMESH_EDGE_CREASE : 0);
                }
                return DELMESH_OK;
            });
        });
    }

    Status read_sharp_verts() {
        if (input_.sharp_verts.type == 0) return DELMESH_OK;
        return with_numbers(input_.sharp_verts, [&](auto number) -> Status {
            for (int64_t i = 0; i < input_.sharp_verts.count; ++i) {
                const int64_t v = number(i);
                if (!is_vertex(v)) return no_vertex("sharp_verts", "number", i, v);
                float sharpness = 0;
                DM_TRY(read_sharpness("vert_sharpness", input_.vert_sharpness, i, sharpness));
                cage_.sharp_verts.push_back(static_cast<int32_t>(v));
                cage_.vert_sharpness.push_back(sharpness);
            }
            return DELMESH_OK;
        });
    }

    Status read_holes() {
        cage_.hole.assign(cage_.faces(), 0);
        if (input_.holes.type == 0) return DELMESH_OK;
        return with_numbers(input_.holes, [&](auto number) -> Status {
            for (int64_t i = 0; i < input_.holes.count; ++i) {
                const int64_t f = number(i);
                if (f < 0 || f >= cage_.faces())
                    return context_.fail(DELMESH_ERROR_INDEX_OUT_OF_RANGE,
                                         "holes: number %lld was face %lld; there were %d faces.", LL{i}, LL{f}, cage_.faces());
                cage_.hole[f] = 1;
            }
            return DELMESH_OK;
        });
    }

    // ---- Marks and layers ---------------------------------------------------------------------------------------------------

    void mark(int32_t edge, int64_t bits) { cage_.edge_bits[edge] = static_cast<EdgeBits>(cage_.edge_bits[edge] | bits); }

    Status read_marks() {
        if (in_.edge_verts.type == 0) return DELMESH_OK;
        return with_numbers(in_.edge_verts, [&](auto number) {
            return with_numbers(in_.edge_marks.type != 0 ? in_.edge_marks : in_.edge_verts, [&](auto given) -> Status {
                for (int64_t e = 0; e < in_.edge_verts.count; ++e) {
                    const int64_t p = number(2 * e), q = number(2 * e + 1);
                    if (!is_vertex(p) || !is_vertex(q)) return no_vertex("edge_verts", "edge", e, is_vertex(p) ? q : p);
                    const int64_t bits = in_.edge_marks.type != 0 ? given(e) : 0;
                    DM_TRY(check_edge_mark(context_, e, bits));
                    const int32_t edge = slot_of(p, q);
                    if (edge >= 0) mark(edge, bits);
                }
                return DELMESH_OK;
            });
        });
    }

    Status read_layer(const delmesh_layer& given) {
        const bool of_faces = given.kind >= DELMESH_LAYER_MATERIAL;
        CageLayer layer{
            given, -1, given.values.components, 0, cage_.value_index.size(), cage_.values.size(), 0, cage_.value_corner.size()};
        if (!of_faces) {
            for (const CageLayer& other : cage_.layers) layer.channel = std::max(layer.channel, other.channel);
            ++layer.channel;
            DM_TRY(number_values(given, layer));
        }
        const int bits = given.border == DELMESH_BORDER_KEEP ? border_bit(given.kind) : 0;
        // An edge has a border where two of its faces differ: each is compared with the first.
        struct Side {
            int32_t face = -1, at_low = 0, at_high = 0;
            bool border = false;
        };
        Array<Side> sides(context_.memory(), cage_.edges(), Side());
        for (int32_t f = 0; f < cage_.faces(); ++f)
            for (int32_t c = cage_.face_first[f]; c < cage_.face_first[f + 1]; ++c) {
                const int32_t edge = cage_.corner_edge[c], next = corner_after(f, c);
                const bool forward = cage_.corner_vert[c] < cage_.corner_vert[next];
                const int32_t low = forward ? c : next, high = forward ? next : c;
                Side& side = sides[edge];
                if (side.face < 0) {
                    side = {f, low, high, false};
                    continue;
                }
                const int32_t* const index = cage_.index_of(layer);
                const bool same = of_faces ? equal(given, side.face, f)
                                           : index[low] == index[side.at_low] && index[high] == index[side.at_high];
                if (same || side.border) continue;
                side.border = true;
                ++layer.borders;
                mark(edge, bits);
            }
        cage_.layers.push_back(layer);
        return context_.progress(0.3);
    }

    bool equal(const delmesh_layer& layer, int64_t a, int64_t b) const {
        for (int32_t k = 0; k < layer.values.components; ++k) {
            const double x = real_at(layer.values, a, k), y = real_at(layer.values, b, k);
            if (!(x == y || (x != x && y != y) || std::fabs(x - y) <= layer.tolerance)) return false;
        }
        return true;
    }

    // At every vertex the corners' different values, in the order of the corners.
    Status number_values(const delmesh_layer& given, CageLayer& layer) {
        Array<int32_t> first(context_.memory(), cage_.vertices(), -1); // value at a vertex; the others follow by `next`
        Array<int32_t> next(context_.memory());
        cage_.value_index.resize_uninitialized(layer.first_index + cage_.corners());
        int32_t* const index = cage_.value_index.data() + layer.first_index;
        DM_TRY(in_pieces(context_, cage_.corners(), 0.3, 0.3, [&](int64_t begin, int64_t end) {
            for (int32_t c = static_cast<int32_t>(begin); c < end; ++c) {
                int32_t* at = &first[cage_.corner_vert[c]];
                while (*at >= 0 && !equal(given, cage_.value_corner[layer.first_corner + *at], c)) at = &next[*at];
                if (*at < 0) {
                    *at = static_cast<int32_t>(next.size());
                    index[c] = *at;
                    next.push_back(-1); // `at` may point into what this moves
                    cage_.value_corner.push_back(c);
                    for (int32_t k = 0; k < layer.components; ++k) cage_.values.push_back(real_at(given.values, c, k));
                } else {
                    index[c] = *at;
                }
            }
            return DELMESH_OK;
        }));
        layer.value_count = next.size();
        return DELMESH_OK;
    }

    uint64_t fingerprint() const {
        uint64_t hash = scramble(static_cast<uint64_t>(cage_.vertices()) << 32 | static_cast<uint64_t>(cage_.rules.scheme));
        for (const int32_t first : cage_.face_first) hash = scramble(hash + static_cast<uint64_t>(first));
        for (const int32_t v : cage_.corner_vert) hash = scramble(hash + static_cast<uint64_t>(v));
        return hash | 1;
    }

    Context& context_;
    const CageInput& input_;
    const MeshInput& in_;
    Cage& cage_;
    Array<int32_t> table_; // of edges, by their ends
};

} // namespace

Status Cage::build(Context& context, const CageInput& input) {
    DM_TRY(context.stage("cage", 0, 1));
    DM_TRY(Build(context, input, *this).run());
    DM_TRY(limit.build(context, *this));
    has_limit.resize_uninitialized(faces());
    return in_pieces(context, faces(), 0.9, 1, [&](int64_t begin, int64_t end) {
        for (int64_t f = begin; f < end; ++f) has_limit[f] = limit.has_face(static_cast<int32_t>(f)) ? 1 : 0;
        return DELMESH_OK;
    });
}

} // namespace dm
