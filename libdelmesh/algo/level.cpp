// SPDX-License-Identifier: Apache-2.0
#include "algo/level.h"

#include <algorithm>
#include <utility>

#include "geom/closest_point.h"
#include "mesh/build.h"
#include "mesh/source_map.h"

namespace dm {
namespace {

constexpr int64_t kGrain = 1 << 13, kPlaces = 512; // elements that are copied, or looked for

} // namespace

LevelMaker::LevelMaker(Context& context_, const Mesh& in_, const Mesh& full_, const SpatialOrder& order_, const Surface& surface,
                       const Decimator& decimator)
    : context(context_), in(in_), full(full_), order(order_), s(surface), d(decimator), in_tree(context_.memory()),
      near(context_.memory()), verts(context_.memory()), faces(context_.memory()) {}

// A vertex of the Delaunay mesh that is a source vertex; -1 if it was made by a split.
int32_t LevelMaker::source_of(int32_t v) const {
    const int32_t of_full = order.old_vert[v];
    return full.vert_source.empty() ? of_full : full.vert_source[of_full];
}

Status LevelMaker::make(Mesh& out, Mesh* before) {
    Memory& memory = context.memory();
    Array<int32_t> number(memory, s.vertices(), -1), face_number(memory, s.faces(), -1);
    // What is left of the level before, or of the Delaunay mesh, in that one's order.
    const Array<int32_t> last_verts = std::exchange(verts, Array<int32_t>(memory));
    const Array<int32_t> last_faces = std::exchange(faces, Array<int32_t>(memory));
    const Array<int32_t>& verts_of_before = last_verts.empty() ? order.new_vert : last_verts;
    for (const int32_t v : verts_of_before)
        if (s.vert_corner[v] >= 0) {
            number[v] = static_cast<int32_t>(verts.size());
            verts.push_back(v);
        }
    DM_TRY(context.progress(0.1));
    out.precision = full.precision;
    set_source_counts(in, out);
    out.vertex_count = static_cast<int32_t>(verts.size());
    const auto write = [&](auto& positions) {
        positions.resize_uninitialized(3 * verts.size());
        using Real = std::remove_reference_t<decltype(positions[0])>;
        return context.parallel(verts.size(), kGrain, [&](int64_t, int64_t begin, int64_t end) {
            for (int64_t i = begin; i < end; ++i) {
                const Vec3& x = s.at(verts.data()[i]);
                Real* const to = positions.data() + 3 * i;
                to[0] = static_cast<Real>(x.x), to[1] = static_cast<Real>(x.y), to[2] = static_cast<Real>(x.z); // exact
            }
        });
    };
    DM_TRY(out.precision == Precision::f32 ? write(out.pos32) : write(out.pos64));
    DM_TRY(context.progress(0.2));

    for (const int32_t f : last_faces.empty() ? order.new_face : last_faces)
        if (!s.is_dead(f)) {
            face_number[f] = static_cast<int32_t>(faces.size());
            faces.push_back(f);
        }
    DM_TRY(context.progress(0.3));
    out.corner_vert.resize_uninitialized(3 * faces.size());
    out.corner_twin.resize_uninitialized(3 * faces.size());
    out.corner_bits.resize_uninitialized(3 * faces.size());
    out.face_source.resize_uninitialized(faces.size());
    DM_TRY(context.parallel(faces.size(), kGrain, [&](int64_t, int64_t begin, int64_t end) {
        for (int32_t n = static_cast<int32_t>(begin); n < end; ++n) {
            const int32_t f = faces.data()[n];
            for (int32_t k = 0; k < 3; ++k) {
                const int32_t c = 3 * f + k, t = s.twin(c);
                out.corner_vert[3 * n + k] = number[s.vert(c)];
                out.corner_twin[3 * n + k] = t < 0 ? t : 3 * face_number[face_of(t)] + t % 3;
                out.corner_bits[3 * n + k] = s.corner_bits[c];
            }
            const int32_t source = order.old_face[s.face_src[f]];
            out.face_source[n] = full.face_source.empty() ? source : full.face_source[source];
        }
    }));
    out.cut_slots.copy_from(s.cut_slots);
    for (CutSlot& slot : out.cut_slots)
        if (slot.corner >= 0) slot.corner = 3 * face_number[face_of(slot.corner)] + slot.corner % 3;
    DM_TRY(context.progress(0.4));

    if (before != nullptr) {
        before->vert_parent.reserve(verts_of_before.size());
        for (int32_t v : verts_of_before) {
            while (d.merged_into[v] != v) v = d.merged_into[v];
            before->vert_parent.push_back(number[v]);
        }
    }
    return count_mesh(context, out);
}

void LevelMaker::find_staying(Array<uint8_t>& stays) const {
    stays.clear();
    for (const int32_t v : verts) stays.push_back(d.kind(v) == Decimator::Kind::corner ? 1 : 0);
}

// The source's faces along the order in space that its vertices have been given.
Status LevelMaker::make_tree() {
    Memory& memory = context.memory();
    Array<int32_t> corner(memory, in.vertices(), -1), sorted(memory); // corner: of each vertex one
    for (int32_t c = in.corners() - 1; c >= 0; --c) corner[in.corner_vert[c]] = c;
    Array<uint8_t> seen(memory, in.faces(), 0);
    sorted.reserve(in.faces());
    near.resize_uninitialized(s.vertices());
    const auto add = [&](int32_t f) {
        if (seen[f] == 0) sorted.push_back(f);
        seen[f] = 1;
    };
    for (int32_t v = 0; v < s.vertices(); ++v) {
        if (v % (1 << 16) == 0) DM_TRY(context.progress(0));
        near[v] = static_cast<int32_t>(std::min<int64_t>(sorted.size(), in.faces() - 1));
        const int32_t source = source_of(v);
        if (source < 0 || corner[source] < 0) continue;
        int32_t c = corner[source], left = 64; // of a hub others bring the rest
        do add(face_of(c));
        while (--left > 0 && (c = in.corner_twin[prev_corner(c)]) >= 0 && c != corner[source]);
    }
    for (int32_t f = 0; f < in.faces(); ++f) add(f);
    return in_tree.build(context, in, std::move(sorted));
}

Status LevelMaker::map_to_source(Mesh& out) {
    out.first_split = 0;
    Array<VertexMap>& maps = out.split_map;
    maps.resize_uninitialized(verts.size());
    out.vert_source.resize_uninitialized(verts.size());
    if (!full.vert_join.empty()) {
        // Of the copies of one vertex that are where they were, the first stands for all.
        Array<int32_t> first(context.memory(), full.vertices(), -1);
        out.vert_join.resize_uninitialized(verts.size());
        for (int32_t i = 0; i < out.vertices(); ++i) {
            const int32_t v = verts[i];
            out.vert_join[i] = i;
            if (d.place_of[v] < 0 || !(out.position(i) == s.at(v))) continue;
            int32_t& join = first[full.vert_join[order.old_vert[d.place_of[v]]]];
            if (join < 0) join = i;
            out.vert_join[i] = join;
        }
    }
    for (int32_t i = 0; i < out.vertices(); ++i) {
        const int32_t v = verts[i];
        const bool moved = d.place_of[v] < 0 || !(out.position(i) == s.at(v));
        out.vert_source[i] = moved ? -1 : source_of(d.place_of[v]);
        if (out.vert_source[i] < 0 && in_tree.empty()) DM_TRY(make_tree());
    }
    return context.parallel(verts.size(), kPlaces, [&](int64_t, int64_t begin, int64_t end) {
        for (int64_t i = begin; i < end; ++i) {
            const int32_t source = out.vert_source[i];
            if (source >= 0) {
                maps[i] = {{source, source, source}, {1, 0, 0}};
                continue;
            }
            const FaceTree::Hit nearest = in_tree.closest(out.position(static_cast<int32_t>(i)), near[verts[i]]);
            VertexMap& map = maps[i];
            for (int k = 0; k < 3; ++k) {
                const int32_t u = in.corner_vert[3 * nearest.face + k];
                map.vert[k] = in.imported && !in.vert_source.empty() ? in.vert_source[u] : u;
                map.weight[k] = nearest.weight[k];
            }
        }
    });
}

void LevelMaker::trace(const Mesh& out, LevelTraces& traces) const {
    traces.face.reserve(faces.size());
    for (const int32_t f : faces) traces.face.push_back(order.old_face[s.face_src[f]]);
    traces.same.reserve(out.vertices());
    traces.into.assign(full.vertices(), -1);
    for (int32_t i = 0; i < out.vertices(); ++i) {
        const int32_t v = verts[i];
        traces.same.push_back(d.place_of[v] < 0 || !(out.position(i) == s.at(v)) ? -1 : order.old_vert[d.place_of[v]]);
        for (int32_t u = v; u >= 0; u = d.next_merged[u]) traces.into[order.old_vert[u]] = i;
    }
}

} // namespace dm
