// SPDX-License-Identifier: Apache-2.0
#include "mesh/borders.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/hash.h"
#include "mesh/connect.h"
#include "mesh/source_map.h"
#include "mesh/views.h"

namespace dm {
namespace {

using LL = long long; // for %lld

void set_bits(Mesh& mesh, int32_t c, int bits) {
    mesh.corner_bits[c] = static_cast<EdgeBits>(mesh.corner_bits[c] | bits);
}
void make_bits(Mesh& mesh) {
    if (mesh.corner_bits.empty()) mesh.corner_bits.assign(mesh.corners(), 0);
}

// ---- Marks ------------------------------------------------------------------------------------------------------------------

// The caller's edges, found by their ends.
class EdgeTable {
public:
    EdgeTable(Memory& memory, int64_t entries) : slots_(memory, table_size(entries), Slot{0, 0, false, -1}) {}

    struct Slot {
        uint64_t key; // lower vertex, upper vertex; 0: free
        EdgeBits bits;
        bool found;
        int32_t number; // in edge_verts; -1: not there
    };
    Slot& find(int32_t p, int32_t q) { // the edge's, or the free one where it belongs
        const uint64_t key = key_of(p, q), mask = static_cast<uint64_t>(slots_.size() - 1);
        int64_t slot = static_cast<int64_t>(scramble(key) & mask);
        while (slots_[slot].key != 0 && slots_[slot].key != key)
            slot = static_cast<int64_t>((static_cast<uint64_t>(slot) + 1) & mask);
        return slots_[slot];
    }
    Slot& add(int32_t p, int32_t q) {
        Slot& slot = find(p, q);
        slot.key = key_of(p, q);
        return slot;
    }

private:
    static uint64_t key_of(int32_t p, int32_t q) {
        return static_cast<uint64_t>(std::min(p, q)) << 32 | static_cast<uint64_t>(std::max(p, q));
    }
    Array<Slot> slots_;
};

class Marking {
public:
    Marking(Context& context, const MeshInput& input, const Array<int32_t>& weld_to, Mesh& mesh)
        : context_(context), input_(input), weld_to_(weld_to), mesh_(mesh),
          table_(context.memory(), input.marked_edges.count + input.edge_verts.count) {}

    Status run(double from, double to) {
        const double step = (to - from) / 4;
        const bool marked = input_.marked_edges.type != 0;
        if (marked)
            DM_TRY(read("marked_edges", input_.marked_edges, from, from + step, [&](EdgeTable::Slot& slot, int64_t) {
                slot.bits |= kEdgeMarked;
                return DELMESH_OK;
            }));
        if (input_.edge_verts.type != 0)
            DM_TRY(read("edge_verts", input_.edge_verts, from + step, from + 2 * step, [&](EdgeTable::Slot& slot, int64_t e) {
                if (slot.number < 0) slot.number = static_cast<int32_t>(e);
                return DELMESH_OK;
            }));
        if (input_.edge_marks.type != 0) DM_TRY(read_marks(from + 2 * step));
        DM_TRY(write(from + 2 * step, to - step));
        return marked ? count_unmatched(to - step, to) : DELMESH_OK;
    }

private:
    bool is_vertex(int64_t v) const { return v >= 0 && v < input_.positions.count; }
    int32_t welded(int64_t v) const { return weld_to_.empty() ? static_cast<int32_t>(v) : weld_to_[v]; }

    // use(slot, e) for every edge of the view that has two ends.
    template <class Use>
    Status read(const char* name, const delmesh_view& view, double from, double to, Use&& use) {
        return with_numbers(view, [&](auto number) {
            return in_pieces(context_, view.count, from, to, [&](int64_t begin, int64_t end) -> Status {
                for (int64_t e = begin; e < end; ++e) {
                    const int64_t p = number(2 * e), q = number(2 * e + 1);
                    if (!is_vertex(p) || !is_vertex(q))
                        return context_.fail(DELMESH_ERROR_INDEX_OUT_OF_RANGE,
                                             "%s: edge %lld had vertex %lld; there were %lld vertices.", name, LL{e},
                                             LL{is_vertex(p) ? q : p}, LL{input_.positions.count});
                    if (welded(p) != welded(q)) DM_TRY(use(table_.add(welded(p), welded(q)), e));
                }
                return DELMESH_OK;
            });
        });
    }

    Status read_marks(double fraction) {
        return with_numbers(input_.edge_marks, [&](auto mark) {
            return read("edge_verts", input_.edge_verts, fraction, fraction, [&](EdgeTable::Slot& slot, int64_t e) -> Status {
                const int64_t bits = mark(e);
                DM_TRY(check_edge_mark(context_, e, bits));
                slot.bits = static_cast<EdgeBits>(slot.bits | bits);
                return DELMESH_OK;
            });
        });
    }

    Status write(double from, double to) {
        const bool numbers = input_.edge_verts.type != 0;
        if (numbers) {
            mesh_.source_edges = input_.edge_verts.count;
            mesh_.edge_source.resize_uninitialized(mesh_.counts.edges);
        }
        int64_t edge = 0;
        const auto source = [&](int32_t v) { return mesh_.vert_source.empty() ? v : mesh_.vert_source[v]; };
        return in_pieces(context_, mesh_.corners(), from, to, [&](int64_t begin, int64_t end) {
            for (int32_t c = static_cast<int32_t>(begin); c < end; ++c) {
                const int32_t twin = mesh_.corner_twin[c];
                if (twin >= 0 && twin < c) continue;
                EdgeTable::Slot& slot = table_.find(source(mesh_.corner_vert[c]), source(mesh_.corner_vert[next_corner(c)]));
                if (numbers) mesh_.edge_source[edge++] = slot.key == 0 ? -1 : slot.number;
                if (slot.key == 0) continue;
                slot.found = true;
                if (slot.bits == 0) continue;
                make_bits(mesh_);
                set_bits(mesh_, c, slot.bits);
                if (twin >= 0) set_bits(mesh_, twin, slot.bits);
            }
            return DELMESH_OK;
        });
    }

    Status count_unmatched(double from, double to) {
        return with_numbers(input_.marked_edges, [&](auto number) {
            return in_pieces(context_, input_.marked_edges.count, from, to, [&](int64_t begin, int64_t end) {
                for (int64_t e = begin; e < end; ++e) {
                    const int32_t p = welded(number(2 * e)), q = welded(number(2 * e + 1));
                    mesh_.counts.unmatched_marked_edges += p == q || !table_.find(p, q).found;
                }
                return DELMESH_OK;
            });
        });
    }

    Context& context_;
    const MeshInput& input_;
    const Array<int32_t>& weld_to_;
    Mesh& mesh_;
    EdgeTable table_;
};

// ---- Layers -----------------------------------------------------------------------------------------------------------------

// Components of a view's elements as doubles, which hold all types that layers have.
class Values {
public:
    explicit Values(const delmesh_view& view) : view_(view) {}
    double operator()(int64_t element, int32_t component) const {
        const char* const at = static_cast<const char*>(view_.data) + element * view_.stride;
        switch (view_.type) {
        case DELMESH_FLOAT32:
            return load<float>(at, component);
        case DELMESH_FLOAT64:
            return load<double>(at, component);
        case DELMESH_INT32:
            return load<int32_t>(at, component);
        case DELMESH_UINT32:
            return load<uint32_t>(at, component);
        default:
            return load<uint8_t>(at, component);
        }
    }
    bool same(int64_t a, int64_t b, double tolerance) const {
        if (a == b) return true;
        for (int32_t k = 0; k < view_.components; ++k) {
            const double x = (*this)(a, k), y = (*this)(b, k);
            const bool equal = x == y || (x != x && y != y) || std::fabs(x - y) <= tolerance;
            if (!equal) return false;
        }
        return true;
    }

private:
    template <class T>
    static double load(const char* at, int32_t component) {
        T value; // a stride need not be a multiple of the alignment
        std::memcpy(&value, at + component * static_cast<int64_t>(sizeof(T)), sizeof(T));
        return static_cast<double>(value);
    }
    const delmesh_view view_;
};

constexpr int64_t kGrain = 1 << 14;

// jumps(c, twin) of every interior edge, counted, and marked with the bits.
template <class Jumps>
Status mark_jumps(Context& context, Mesh& mesh, int bits, int64_t& borders, Jumps&& jumps) {
    if (bits != 0) make_bits(mesh);
    Array<int64_t> counts(context.memory(), (mesh.corners() + kGrain - 1) / kGrain, 0);
    DM_TRY(context.parallel(mesh.corners(), kGrain, [&](int64_t block, int64_t begin, int64_t end) {
        int64_t count = 0;
        for (int32_t c = static_cast<int32_t>(begin); c < end; ++c) {
            const int32_t twin = mesh.corner_twin[c];
            if (twin < c || !jumps(c, twin)) continue; // each edge's two corners are this block's alone
            ++count;
            if (bits == 0) continue;
            set_bits(mesh, c, bits);
            set_bits(mesh, twin, bits);
        }
        counts[block] = count;
    }));
    borders = 0;
    for (const int64_t count : counts) borders += count;
    return DELMESH_OK;
}

Status look_at_layer(Context& context, const delmesh_layer& given, MeshLayer& layer, Mesh& mesh) {
    const Values values(given.values);
    const int bits = given.border == DELMESH_BORDER_KEEP ? border_bit(given.kind) : 0;
    if (given.kind >= DELMESH_LAYER_MATERIAL)
        return mark_jumps(context, mesh, bits, layer.borders, [&](int32_t c, int32_t twin) {
            return !values.same(source_of_face(mesh, face_of(c)), source_of_face(mesh, face_of(twin)), given.tolerance);
        });
    DM_TRY(mark_jumps(context, mesh, bits, layer.borders, [&](int32_t c, int32_t twin) {
        const auto same = [&](int32_t a, int32_t b) {
            return values.same(source_of(mesh.corner_map, a), source_of(mesh.corner_map, b), given.tolerance);
        };
        return !same(c, next_corner(twin)) || !same(next_corner(c), twin);
    }));
    if (given.kind != DELMESH_LAYER_UV && !(given.weight > 0)) return DELMESH_OK;

    layer.first_value = mesh.layer_values.size();
    mesh.layer_values.resize_uninitialized(layer.first_value + static_cast<int64_t>(mesh.corners()) * layer.components);
    float* const kept = mesh.layer_values.data() + layer.first_value;
    DM_TRY(context.parallel(mesh.corners(), kGrain, [&](int64_t, int64_t begin, int64_t end) {
        for (int64_t c = begin; c < end; ++c)
            for (int32_t k = 0; k < layer.components; ++k)
                kept[c * layer.components + k] = static_cast<float>(values(source_of(mesh.corner_map, c), k));
    }));
    if (!(given.affine_tolerance < 0)) return DELMESH_OK;
    layer.affine_tolerance = default_affine_tolerance(kept, mesh.corners(), layer.components);
    return DELMESH_OK;
}

} // namespace

double default_affine_tolerance(const float* values, int64_t count, int32_t components) {
    double range = 0;
    for (int32_t k = 0; k < components; ++k) {
        float low = std::numeric_limits<float>::infinity(), high = -low;
        for (int64_t i = k; i < count * components; i += components) {
            if (!std::isfinite(values[i])) continue;
            low = std::min(low, values[i]);
            high = std::max(high, values[i]);
        }
        if (high > low) range = std::max(range, static_cast<double>(high) - low);
    }
    return 1e-5 * range;
}

Status check_edge_mark(Context& context, int64_t e, int64_t bits) {
    constexpr int64_t kKnown = DELMESH_EDGE_MARKED | DELMESH_EDGE_SHARP | DELMESH_EDGE_SEAM | DELMESH_EDGE_CREASE;
    if ((bits & ~kKnown) == 0) return DELMESH_OK;
    return context.fail(DELMESH_ERROR_INVALID_ARGUMENT,
                        "edge_marks: mark %lld was %lld, which is no sum of DELMESH_EDGE_MARKED, _SHARP, _SEAM and _CREASE.",
                        LL{e}, LL{bits});
}

EdgeBits border_bit(int32_t kind) {
    switch (kind) {
    case DELMESH_LAYER_UV:
        return DELMESH_EDGE_UV;
    case DELMESH_LAYER_NORMAL:
        return DELMESH_EDGE_NORMAL;
    case DELMESH_LAYER_COLOR:
        return DELMESH_EDGE_COLOR;
    case DELMESH_LAYER_MATERIAL:
        return DELMESH_EDGE_MATERIAL;
    case DELMESH_LAYER_FACE_SET:
        return DELMESH_EDGE_FACE_SET;
    default:
        return DELMESH_EDGE_LAYER;
    }
}

Status mark_edges(Context& context, const MeshInput& input, const Array<int32_t>& weld_to, double from, double to, Mesh& mesh) {
    if (input.marked_edges.type == 0 && input.edge_verts.type == 0) return DELMESH_OK;
    return Marking(context, input, weld_to, mesh).run(from, to);
}

Status find_borders(Context& context, const MeshInput& input, double from, double to, Mesh& mesh) {
    for (int32_t i = 0; i < input.layer_count; ++i) {
        DM_TRY(context.progress(from + (to - from) * i / input.layer_count));
        const delmesh_layer& given = input.layers[i];
        MeshLayer layer{
            given.kind, given.values.components, given.border == DELMESH_BORDER_KEEP, given.affine_tolerance, given.weight, 0,
            -1};
        DM_TRY(look_at_layer(context, given, layer, mesh));
        mesh.layers.push_back(layer);
    }
    return DELMESH_OK;
}

} // namespace dm
