// SPDX-License-Identifier: Apache-2.0
#include "algo/level.h"

#include <algorithm>
#include <limits>

#include "geom/closest_point.h"
#include "mesh/build.h"

namespace dm {
namespace {

struct Nearest {
    double distance_squared = std::numeric_limits<double>::infinity();
    double weight[3] = {1, 0, 0};
    int32_t face = -1;
};

// The closest point of the triangle; kept if it is closer than what `nearest` has.
void consider(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c, int32_t face, Nearest& nearest) {
    const ClosestPoint closest = closest_on_triangle(p, a, b, c);
    const double d = length_squared(closest.residual);
    if (!(d < nearest.distance_squared)) return;
    nearest = {d, {closest.weight[0], closest.weight[1], closest.weight[2]}, face};
}

} // namespace

LevelMaker::LevelMaker(Context& context_, const Mesh& in_, const Mesh& full_, const SpatialOrder& order_, const Surface& surface,
                       const Decimator& decimator)
    : context(context_), in(in_), full(full_), order(order_), s(surface), d(decimator), in_corner(context_.memory()),
      verts(context_.memory()) {}

// A vertex of the Delaunay mesh that is a source vertex; -1 if it was made by a split.
int32_t LevelMaker::source_of(int32_t v) const {
    const int32_t of_full = order.old_vert[v];
    return full.vert_source.empty() ? of_full : full.vert_source[of_full];
}

VertexMap LevelMaker::map_of(int32_t v) const {
    const int32_t source = source_of(v);
    if (source >= 0) return {{source, source, source}, {1, 0, 0}};
    return full.split_map[order.old_vert[v] - full.first_split];
}

Status LevelMaker::make(Mesh& out, Mesh* before) {
    Memory& memory = context.memory();
    Array<int32_t> number(memory, s.vertices(), -1), face_number(memory, s.faces(), -1);
    const Array<int32_t> verts_of_before = std::move(verts);
    verts = Array<int32_t>(memory);
    for (const int32_t v : order.new_vert) // in the order of the Delaunay mesh
        if (s.vert_corner[v] >= 0) {
            number[v] = static_cast<int32_t>(verts.size());
            verts.push_back(v);
        }
    out.precision = full.precision;
    out.vertex_count = static_cast<int32_t>(verts.size());
    const auto write = [&](auto& positions) {
        positions.reserve(3 * verts.size());
        using Real = std::remove_reference_t<decltype(positions[0])>;
        for (const int32_t v : verts)
            for (const double x : {s.at(v).x, s.at(v).y, s.at(v).z}) positions.push_back(static_cast<Real>(x)); // exact
    };
    if (out.precision == Precision::f32)
        write(out.pos32);
    else
        write(out.pos64);
    DM_TRY(context.progress(0.2));

    int32_t faces = 0;
    for (const int32_t f : order.new_face)
        if (!s.is_dead(f)) face_number[f] = faces++;
    out.corner_vert.resize_uninitialized(3 * static_cast<int64_t>(faces));
    out.corner_twin.resize_uninitialized(3 * static_cast<int64_t>(faces));
    out.corner_bits.resize_uninitialized(3 * static_cast<int64_t>(faces));
    out.face_source.resize_uninitialized(faces);
    for (int32_t f = 0; f < s.faces(); ++f) {
        const int32_t n = face_number[f];
        if (n < 0) continue;
        for (int32_t k = 0; k < 3; ++k) {
            const int32_t c = 3 * f + k, t = s.twin(c);
            out.corner_vert[3 * n + k] = number[s.vert(c)];
            out.corner_twin[3 * n + k] = t < 0 ? t : 3 * face_number[face_of(t)] + t % 3;
            out.corner_bits[3 * n + k] = s.corner_bits[c];
        }
        const int32_t source = order.old_face[s.face_src[f]];
        out.face_source[n] = full.face_source.empty() ? source : full.face_source[source];
    }
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

// Vertices that were moved lie close to the faces around those that went into them. Of these the nearest few are looked at.
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
    if (in_corner.empty()) {
        in_corner.assign(in.vertices(), -1);
        for (int32_t c = in.corners() - 1; c >= 0; --c) in_corner[in.corner_vert[c]] = c;
    }
    constexpr int64_t kGrain = 512;
    return context.parallel(verts.size(), kGrain, [&](int64_t, int64_t begin, int64_t end) {
        for (int64_t i = begin; i < end; ++i) {
            const int32_t v = verts[i];
            const Vec3 x = out.position(static_cast<int32_t>(i));
            const bool moved = d.place_of[v] < 0 || !(x == s.at(v));
            out.vert_source[i] = moved ? -1 : source_of(d.place_of[v]);
            if (!moved) {
                maps[i] = map_of(d.place_of[v]);
                continue;
            }
            constexpr int kFew = 4;
            int32_t near[kFew];
            double how_near[kFew];
            int count = 0;
            const auto add = [&](int32_t source) {
                if (in_corner[source] < 0) return;
                const double square = length_squared(in.position(source) - x);
                if (count == kFew && square >= how_near[kFew - 1]) return;
                for (int k = 0; k < count; ++k)
                    if (near[k] == source) return;
                int k = count < kFew ? count++ : kFew - 1;
                for (; k > 0 && how_near[k - 1] > square; --k) near[k] = near[k - 1], how_near[k] = how_near[k - 1];
                near[k] = source, how_near[k] = square;
            };
            for (int32_t u = v; u >= 0; u = d.next_merged[u]) {
                const VertexMap of_u = map_of(u); // a source vertex, or between which ones a split made it
                add(of_u.vert[0]);
                if (of_u.weight[1] != 0) add(of_u.vert[1]);
                if (of_u.weight[2] != 0) add(of_u.vert[2]);
            }
            Nearest nearest;
            const auto look_around = [&](int32_t vert) {
                const auto look = [&](int32_t c) {
                    const int32_t f = face_of(c);
                    consider(x, in.position(in.corner_vert[3 * f]), in.position(in.corner_vert[3 * f + 1]),
                             in.position(in.corner_vert[3 * f + 2]), f, nearest);
                };
                constexpr int kMostFaces = 128; // of a hub the nearest faces may be any; a few will do
                const int32_t start = in_corner[vert];
                int32_t c = start;
                int left = kMostFaces;
                do { // counter-clockwise
                    look(c);
                    c = in.corner_twin[prev_corner(c)];
                } while (c >= 0 && c != start && --left > 0);
                if (c < 0) // the boundary came first: the rest is on the other side
                    for (c = in.corner_twin[start]; c >= 0 && --left > 0;) {
                        c = next_corner(c);
                        look(c);
                        c = in.corner_twin[c];
                    }
            };
            for (int k = 0; k < count; ++k) look_around(near[k]);
            // And on from there, as long as it gets closer.
            constexpr int kMostSteps = 64;
            for (int step = 0, last = -1; step < kMostSteps && nearest.face != last; ++step) {
                last = nearest.face;
                for (int32_t k = 3 * last; k < 3 * last + 3; ++k) look_around(in.corner_vert[k]);
            }
            if (nearest.face < 0) { // no face is left around the vertices that went into it
                maps[i] = map_of(v);
                continue;
            }
            VertexMap& map = maps[i];
            for (int k = 0; k < 3; ++k) {
                const int32_t u = in.corner_vert[3 * nearest.face + k];
                map.vert[k] = in.imported && !in.vert_source.empty() ? in.vert_source[u] : u;
                map.weight[k] = nearest.weight[k];
            }
        }
    });
}

} // namespace dm
