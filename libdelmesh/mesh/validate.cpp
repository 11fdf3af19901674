// SPDX-License-Identifier: Apache-2.0
// The order matters: each check reads only what those before it found in range, and walks only what they found to be a
// permutation. So nothing here reads outside an array or runs for ever, whatever the arrays hold.
#include "mesh/validate.h"

#include <cmath>

#include "mesh/source_map.h"
#include "mesh/views.h"

namespace dm {
namespace {

#define DM_HOLDS(condition, ...)                                                                                                 \
    do {                                                                                                                         \
        if (!(condition)) return context_.fail(DELMESH_ERROR_INTERNAL, __VA_ARGS__);                                             \
    } while (0)

class Validator {
public:
    Validator(Context& context, const Mesh& mesh) : context_(context), mesh_(mesh) {}

    Status run() {
        DM_TRY(check_sizes());
        DM_TRY(for_each(0, 0.1, mesh_.faces(), [&](int32_t f) { return check_face(f); }));
        DM_TRY(for_each(0.1, 0.4, mesh_.corners(), [&](int32_t c) { return check_twin(c); }));
        DM_TRY(check_rings());
        DM_TRY(check_fans());
        DM_TRY(check_maps());
        DM_TRY(check_corner_maps());
        return check_cage_places();
    }

private:
    template <class Body>
    Status for_each(double from, double to, int64_t count, Body&& body) {
        return in_pieces(context_, count, from, to, [&](int64_t begin, int64_t end) -> Status {
            for (int64_t i = begin; i < end; ++i) DM_TRY(body(static_cast<int32_t>(i)));
            return DELMESH_OK;
        });
    }

    // sizes
    Status check_sizes() {
        const int64_t corners = mesh_.corner_vert.size(), vertices = mesh_.vertex_count;
        const bool single = mesh_.precision == Precision::f32;
        DM_HOLDS(single || mesh_.precision == Precision::f64, "The precision was %d.", static_cast<int>(mesh_.precision));
        DM_HOLDS(vertices >= 0, "The vertex count was %d.", mesh_.vertex_count);
        DM_HOLDS(mesh_.pos32.size() == (single ? 3 * vertices : 0), "pos32 had %lld numbers.", LL{mesh_.pos32.size()});
        DM_HOLDS(mesh_.pos64.size() == (single ? 0 : 3 * vertices), "pos64 had %lld numbers.", LL{mesh_.pos64.size()});
        DM_HOLDS(corners % 3 == 0 && corners <= INT32_MAX, "corner_vert had %lld corners.", LL{corners});
        DM_HOLDS(mesh_.corner_twin.size() == corners, "corner_twin had %lld corners of %lld.", LL{mesh_.corner_twin.size()},
                 LL{corners});
        DM_HOLDS(fits_or_empty(mesh_.corner_bits, corners), "corner_bits had %lld corners of %lld.", LL{mesh_.corner_bits.size()},
                 LL{corners});
        DM_HOLDS(fits_or_empty(mesh_.face_source, corners / 3), "face_source had %lld faces of %lld.",
                 LL{mesh_.face_source.size()}, LL{corners / 3});
        DM_HOLDS(fits_or_empty(mesh_.vert_source, vertices), "vert_source had %lld vertices of %lld.",
                 LL{mesh_.vert_source.size()}, LL{vertices});
        DM_HOLDS(fits_or_empty(mesh_.vert_join, vertices), "vert_join had %lld vertices of %lld.", LL{mesh_.vert_join.size()},
                 LL{vertices});
        DM_HOLDS(fits_or_empty(mesh_.vert_parent, vertices), "vert_parent had %lld vertices of %lld.",
                 LL{mesh_.vert_parent.size()}, LL{vertices});
        DM_HOLDS(mesh_.first_split >= 0 && mesh_.first_split + mesh_.split_map.size() == vertices,
                 "first_split was %d with %lld split vertices of %lld.", mesh_.first_split, LL{mesh_.split_map.size()},
                 LL{vertices});
        const int64_t edges = mesh_.counts.edges;
        DM_HOLDS(mesh_.source_verts >= 0 && mesh_.source_corners >= 0 && mesh_.source_faces >= 0 && mesh_.source_edges >= 0,
                 "The source had less than no vertices, corners, faces or edges.");
        DM_HOLDS(mesh_.has_map || (mesh_.corner_map.empty() && mesh_.corner_places.empty() && mesh_.edge_source.empty()),
                 "The mesh had no map, and corners or edges that had a source.");
        DM_HOLDS(mesh_.corner_places.size() <= INT32_MAX, "corner_places had %lld places.", LL{mesh_.corner_places.size()});
        DM_HOLDS(fits_or_empty(mesh_.corner_map, corners), "corner_map had %lld corners of %lld.", LL{mesh_.corner_map.size()},
                 LL{corners});
        DM_HOLDS(fits_or_empty(mesh_.edge_source, edges), "edge_source had %lld edges of %lld.", LL{mesh_.edge_source.size()},
                 LL{edges});
        // The identity needs a source that is as large.
        DM_HOLDS(!has_source() || !mesh_.vert_source.empty() || mesh_.first_split <= mesh_.source_verts,
                 "Vertex %lld had no source.", LL{mesh_.source_verts});
        DM_HOLDS(!has_source() || !mesh_.face_source.empty() || corners / 3 <= mesh_.source_faces, "Face %lld had no source.",
                 LL{mesh_.source_faces});
        DM_HOLDS(!mesh_.has_map || !mesh_.corner_map.empty() || corners <= mesh_.source_corners, "Corner %lld had no source.",
                 LL{mesh_.source_corners});
        DM_HOLDS(!mesh_.has_map || !mesh_.edge_source.empty() || edges <= mesh_.source_edges, "Edge %lld had no source.",
                 LL{mesh_.source_edges});
        for (int64_t i = 0; i < mesh_.layers.size(); ++i) {
            const MeshLayer& layer = mesh_.layers[i];
            DM_HOLDS(layer.kind >= DELMESH_LAYER_UV && layer.kind <= DELMESH_LAYER_FACE_SET, "Layer %lld had kind %d.", LL{i},
                     layer.kind);
            DM_HOLDS(layer.components >= 1 && layer.components <= 16, "Layer %lld had %d components.", LL{i}, layer.components);
            DM_HOLDS(layer.borders >= 0 && layer.borders <= edges, "Layer %lld had %lld borders.", LL{i}, LL{layer.borders});
            DM_HOLDS(layer.first_value == -1 ||
                         (layer.first_value >= 0 && layer.first_value <= mesh_.layer_values.size() &&
                          layer.components * layer_value_count(mesh_) <= mesh_.layer_values.size() - layer.first_value),
                     "Layer %lld had its values at %lld of %lld.", LL{i}, LL{layer.first_value}, LL{mesh_.layer_values.size()});
        }
        DM_HOLDS(mesh_.corner_cage.size() == (mesh_.cage != 0 ? corners : 0), "corner_cage had %lld corners of %lld.",
                 LL{mesh_.corner_cage.size()}, LL{corners});
        DM_HOLDS(mesh_.cage != 0 ? fits_or_empty(mesh_.face_cage, corners / 3) : mesh_.face_cage.empty(),
                 "face_cage had %lld faces of %lld.", LL{mesh_.face_cage.size()}, LL{corners / 3});
        DM_HOLDS(mesh_.cut_slots.size() <= INT32_MAX, "cut_slots had %lld slots.", LL{mesh_.cut_slots.size()});
        return DELMESH_OK;
    }
    template <class T>
    static bool fits_or_empty(const Array<T>& array, int64_t size) {
        return array.empty() || array.size() == size;
    }

    // faces: three different vertices in range, with finite positions
    Status check_face(int32_t f) {
        int32_t v[3];
        for (int k = 0; k < 3; ++k) {
            v[k] = mesh_.corner_vert[3 * static_cast<int64_t>(f) + k];
            DM_HOLDS(v[k] >= 0 && v[k] < mesh_.vertices(), "Corner %d of face %d had vertex %d of %d.", k, f, v[k],
                     mesh_.vertices());
            DM_HOLDS(is_finite(mesh_.position(v[k])), "Vertex %d of face %d had a NaN or infinite coordinate.", v[k], f);
        }
        DM_HOLDS(v[0] != v[1] && v[1] != v[2] && v[2] != v[0], "Face %d had a vertex twice.", f);
        DM_HOLDS(mesh_.face_source.empty() || is_source_face(mesh_.face_source[f]), "Face %d had source %d.", f,
                 mesh_.face_source[f]);
        return DELMESH_OK;
    }

    // twins: symmetric, running opposite ways between the same vertices in different faces, with the same bits
    Status check_twin(int32_t c) {
        const int32_t t = mesh_.corner_twin[c];
        constexpr int kKnownBits = kEdgeGiven | kEdgeFeature | kEdgeSource | kEdgeFrozen;
        const int bits = mesh_.corner_bits.empty() ? 0 : mesh_.corner_bits[c];
        DM_HOLDS((bits & ~kKnownBits) == 0, "Corner %d had edge bits %d.", c, bits);
        if (t == kBoundary) return DELMESH_OK;
        if (is_cut(t)) {
            const int64_t slot = -2 - static_cast<int64_t>(t);
            DM_HOLDS(slot < mesh_.cut_slots.size() && mesh_.cut_slots[slot].corner == c,
                     "Corner %d had slot %lld, which was not its own.", c, LL{slot});
            return DELMESH_OK;
        }
        DM_HOLDS(t < mesh_.corners() && mesh_.corner_twin[t] == c, "Corner %d had twin %d, which was not its own.", c, t);
        DM_HOLDS(face_of(t) != face_of(c), "Corner %d had its twin %d in the same face.", c, t);
        DM_HOLDS(mesh_.corner_vert[t] == mesh_.corner_vert[next_corner(c)] &&
                     mesh_.corner_vert[next_corner(t)] == mesh_.corner_vert[c],
                 "Corner %d and its twin %d had different vertices.", c, t);
        DM_HOLDS(mesh_.corner_bits.empty() || mesh_.corner_bits[t] == bits, "Corner %d and its twin %d had different bits.", c,
                 t);
        return DELMESH_OK;
    }

    // rings: every slot has one before it, and stands for a copy of the same edge as that one. A slot without a corner (its face
    // was removed) stands alone.
    Status check_rings() {
        const int64_t slots = mesh_.cut_slots.size();
        Array<uint8_t> follows(context_.memory(), slots, 0);
        return for_each(0.4, 0.5, slots, [&](int32_t s) -> Status {
            const CutSlot slot = mesh_.cut_slots[s];
            DM_HOLDS(slot.next >= 0 && slot.next < slots && follows[slot.next] == 0, "Slot %d had no right successor: %d.", s,
                     slot.next);
            follows[slot.next] = 1;
            if (slot.corner == -1 && slot.next == s) return DELMESH_OK;
            DM_HOLDS(slot.corner >= 0 && slot.corner < mesh_.corners() && mesh_.corner_twin[slot.corner] == cut_twin(s),
                     "Slot %d had corner %d, which was not its own.", s, slot.corner);
            const int32_t other = mesh_.cut_slots[slot.next].corner;
            DM_HOLDS(other >= 0 && other < mesh_.corners(), "Slot %d had corner %d.", slot.next, other);
            const int32_t p = joined(slot.corner), q = joined(next_corner(slot.corner)), x = joined(other),
                          y = joined(next_corner(other));
            DM_HOLDS((p == x && q == y) || (p == y && q == x), "Slots %d and %d were no copies of one edge.", s, slot.next);
            return DELMESH_OK;
        });
    }
    int32_t joined(int32_t c) const {
        const int32_t v = mesh_.corner_vert[c];
        return mesh_.vert_join.empty() ? v : mesh_.vert_join[v];
    }

    // vertices: all faces of one form one fan. Rotation is a permutation of the corners as far as it goes, because twins are.
    Status check_fans() {
        Array<uint8_t> walked(context_.memory(), mesh_.corners(), 0);
        Array<uint8_t> used(context_.memory(), mesh_.vertices(), 0);
        return for_each(0.5, 0.9, mesh_.corners(), [&](int32_t first) -> Status {
            if (walked[first] != 0) return DELMESH_OK;
            uint8_t& mark = used[mesh_.corner_vert[first]];
            DM_HOLDS(mark == 0, "Vertex %d had several fans of faces.", mesh_.corner_vert[first]);
            mark = 1;
            int32_t c = first;
            do {
                walked[c] = 1;
                c = mesh_.corner_twin[prev_corner(c)];
            } while (c >= 0 && c != first);
            if (c >= 0) return DELMESH_OK;
            for (c = mesh_.corner_twin[first]; c >= 0; c = mesh_.corner_twin[c]) {
                c = next_corner(c);
                walked[c] = 1;
            }
            return DELMESH_OK;
        });
    }

    // maps: sources, parents (in another mesh: how many it has is not known), joins to a lower vertex at the same place, and
    // weights that sum to 1
    Status check_maps() {
        const bool has_source = !mesh_.vert_source.empty(), has_parent = !mesh_.vert_parent.empty(),
                   has_join = !mesh_.vert_join.empty();
        return for_each(0.9, 0.95, mesh_.vertices(), [&](int32_t v) -> Status {
            if (has_source) {
                const int32_t source = mesh_.vert_source[v];
                DM_HOLDS(is_source_vert(source) || (v >= mesh_.first_split && source == -1), "Vertex %d had source %d.", v,
                         source);
            }
            DM_HOLDS(!has_parent || mesh_.vert_parent[v] >= -1, "Vertex %d had parent %d.", v, mesh_.vert_parent[v]);
            if (has_join) {
                const int32_t join = mesh_.vert_join[v];
                DM_HOLDS(join >= 0 && join <= v && mesh_.vert_join[join] == join, "Vertex %d was joined to %d.", v, join);
                DM_HOLDS(same_position(v, join), "Vertex %d was joined to %d, which lay elsewhere.", v, join);
            }
            if (v < mesh_.first_split) return DELMESH_OK;
            const VertexMap& map = mesh_.split_map[v - mesh_.first_split];
            for (const int32_t source : map.vert) DM_HOLDS(is_source_vert(source), "Vertex %d lay on a vertex out of range.", v);
            const double sum = map.weight[0] + map.weight[1] + map.weight[2];
            DM_HOLDS(std::abs(sum - 1) < 1e-9, "Vertex %d had weights that did not sum to 1.", v); // false for NaN too
            return DELMESH_OK;
        });
    }
    static bool in_range(int32_t i, int64_t count) { return i >= 0 && i < count; }
    // Meshes that an operation keeps to itself have none whose size they know.
    bool has_source() const { return mesh_.imported || mesh_.has_map || mesh_.source_verts != 0; }
    bool is_source_vert(int32_t v) const { return has_source() ? in_range(v, mesh_.source_verts) : v >= 0; }
    bool is_source_face(int32_t f) const { return has_source() ? in_range(f, mesh_.source_faces) : f >= 0; }

    // places: on a face of the cage, between its corners
    Status check_cage_places() {
        DM_TRY(for_each(0.98, 0.99, mesh_.corner_cage.size(), [&](int32_t c) -> Status {
            DM_HOLDS(in_range(mesh_.corner_cage[c], mesh_.cage_places.size()), "Corner %d had place %d on the cage.", c,
                     mesh_.corner_cage[c]);
            return DELMESH_OK;
        }));
        return for_each(0.99, 1, mesh_.cage_places.size(), [&](int32_t i) -> Status {
            const CagePlace& place = mesh_.cage_places[i];
            constexpr float kMost = 1.000001f;                                                    // where places were weighted
            DM_HOLDS(place.face >= 0 && std::abs(place.s) <= kMost && std::abs(place.t) <= kMost, // false for NaN too
                     "Place %d was on face %d of the cage at no place of it.", i, place.face);
            return DELMESH_OK;
        });
    }

    // corners: on a source corner, or at a place on three of them, with weights that sum to 1; edges: on a source edge or none
    Status check_corner_maps() {
        DM_TRY(for_each(0.95, 0.97, mesh_.corner_map.size(), [&](int32_t c) -> Status {
            const int32_t source = mesh_.corner_map[c];
            DM_HOLDS(in_range(source, mesh_.source_corners) || in_range(~source, mesh_.corner_places.size()),
                     "Corner %d had source %d.", c, source);
            return DELMESH_OK;
        }));
        DM_TRY(for_each(0.97, 0.98, mesh_.corner_places.size(), [&](int32_t i) -> Status {
            const CornerPlace& place = mesh_.corner_places[i];
            for (const int32_t source : place.corner)
                DM_HOLDS(in_range(source, mesh_.source_corners), "Place %d was on corner %d.", i, source);
            const double sum = place.weight[0] + place.weight[1] + place.weight[2];
            DM_HOLDS(std::abs(sum - 1) <= 1e-12, "Place %d had weights that did not sum to 1.", i); // false for NaN too
            return DELMESH_OK;
        }));
        return for_each(0.98, 1, mesh_.edge_source.size(), [&](int32_t e) -> Status {
            const int32_t source = mesh_.edge_source[e];
            DM_HOLDS(source == -1 || in_range(source, mesh_.source_edges), "Edge %d had source %d.", e, source);
            return DELMESH_OK;
        });
    }
    bool same_position(int32_t v, int32_t w) const { // -0 is 0, as everywhere
        const Vec3 x = mesh_.position(v), y = mesh_.position(w);
        return v == w || (x.x == y.x && x.y == y.y && x.z == y.z);
    }

    using LL = long long; // for %lld
    Context& context_;
    const Mesh& mesh_;
};

#undef DM_HOLDS

} // namespace

Status validate_mesh(Context& context, const Mesh& mesh) {
    return Validator(context, mesh).run();
}

} // namespace dm
