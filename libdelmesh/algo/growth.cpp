// SPDX-License-Identifier: Apache-2.0
#include "algo/growth.h"

#include <algorithm>

#include "algo/parallel_slices.h"

namespace dm {
namespace {

constexpr double kCrowd = 64;                       // units in the last place
constexpr double kSmallAngle = 0.96592582628906829; // cosine of 15 degrees
constexpr double kCapAngle = -0.86602540378443865;  // cosine of 150 degrees

// What a split vertex is counted as: the first of these that is so.
enum Class { kOnBoundary, kOnKept, kCrowded, kOnCap, kAtSmallAngle, kOnFlipped, kElsewhere, kClasses };

class Inquest {
public:
    Inquest(Context& context_, const Mesh& in_, const Surface& surface, double resolution)
        : context(context_), in(in_), s(surface), crowd(kCrowd * resolution), edge(context_.memory()),
          on_carrier(context_.memory()), first_on(context_.memory()), next_on(context_.memory()) {}

    Status run(delmesh_remesh_report& report) {
        DM_TRY(context.progress(0));
        const int64_t in_use = list_vertices();
        constexpr int64_t kGrain = 256;
        Array<Tally> blocks(context.memory(), block_count(s.carriers.size(), kGrain), Tally{});
        DM_TRY(context.parallel(s.carriers.size(), kGrain, [&](int64_t block, int64_t begin, int64_t end) {
            Tally tally;
            for (int32_t i = static_cast<int32_t>(begin); i < end; ++i) {
                ask_ahead(i, static_cast<int32_t>(end));
                if (first_on[i] < 0) continue;
                edge[i] = edge_near_its_vertices(i);
                if (edge[i] == kUnknown)
                    ++tally.unknown;
                else
                    count(i, tally);
            }
            blocks[block] = tally;
        }));
        Tally all;
        for (const Tally& tally : blocks) all.add(tally);
        if (all.unknown != 0) look_around_ends(all);
        report.split_on_boundary += all.of[kOnBoundary];
        report.split_on_kept += all.of[kOnKept];
        report.split_crowded += all.of[kCrowded];
        report.split_on_caps += all.of[kOnCap];
        report.split_at_small_angles += all.of[kAtSmallAngle];
        report.split_on_flipped += all.of[kOnFlipped];
        report.split_elsewhere += all.of[kElsewhere];
        report.split_merged = report.splits - in_use;
        find_worst(report);
        return DELMESH_OK;
    }

private:
    static constexpr int32_t kUnknown = -2;
    struct Tally {
        int64_t of[kClasses] = {}, unknown = 0;
        void add(const Tally& o) {
            for (int k = 0; k < kClasses; ++k) of[k] += o.of[k];
            unknown += o.unknown;
        }
    };

    // The split vertices in use, per carrier, in their order. Returns how many there are.
    int64_t list_vertices() {
        on_carrier.assign(s.carriers.size(), 0);
        first_on.assign(s.carriers.size(), -1);
        edge.assign(s.carriers.size(), -1);
        next_on.resize_uninitialized(s.vertices() - s.first_split);
        int64_t in_use = 0;
        for (int32_t v = s.vertices() - 1; v >= s.first_split; --v) {
            if (s.vert_corner[v] < 0) continue;
            const int32_t carrier = s.split_vertices[v - s.first_split].carrier;
            next_on[v - s.first_split] = first_on[carrier];
            first_on[carrier] = v;
            ++on_carrier[carrier];
            ++in_use;
        }
        return in_use;
    }
    int32_t next_vertex(int32_t v) const { return next_on[v - s.first_split]; }

    // What is needed of a carrier may lie anywhere, and leads from one place to the next: each is asked for some carriers ahead.
    void ask_ahead(int32_t i, int32_t end) const {
        constexpr int32_t kAhead = 8;
        const auto first_vertex = [&](int32_t carrier) { return carrier < end ? first_on[carrier] : -1; };
        const auto ask_for = [&](int32_t c) {
            __builtin_prefetch(s.corner_vert.data() + c);
            __builtin_prefetch(s.corner_twin.data() + c);
            __builtin_prefetch(s.corner_bits.data() + c);
            __builtin_prefetch(s.face_src.data() + face_of(c));
        };
        if (const int32_t v = first_vertex(i + 4 * kAhead); v >= 0) {
            __builtin_prefetch(s.vert_corner.data() + v);
            __builtin_prefetch(s.pos.data() + v);
        }
        if (const int32_t v = first_vertex(i + 3 * kAhead); v >= 0) ask_for(s.vert_corner[v]);
        if (const int32_t v = first_vertex(i + 2 * kAhead); v >= 0) {
            const int32_t k = s.rotate(s.vert_corner[v]);
            if (k >= 0) ask_for(k);
            __builtin_prefetch(in.corner_vert.data() + 3 * s.face_src[face_of(s.vert_corner[v])]);
            __builtin_prefetch(s.pos.data() + s.head(s.vert_corner[v]));
        }
        if (const int32_t v = first_vertex(i + kAhead); v >= 0) {
            const int32_t k = s.rotate(s.vert_corner[v]), next = k >= 0 ? s.rotate(k) : -1;
            if (next >= 0) ask_for(next);
            if (k >= 0) __builtin_prefetch(s.pos.data() + s.head(k));
        }
    }

    // The corner in `in` of the carrier's edge, in either direction; -1 where the carrier is no edge of it. Most pieces still have
    // a face that was cut from one at their edge; kUnknown where none has.
    int32_t edge_near_its_vertices(int32_t carrier) const {
        const Carrier& line = s.carriers[carrier];
        if (!s.is_original(line.a) || !s.is_original(line.b)) return -1;
        const int32_t a = s.copied(line.a), b = s.copied(line.b);
        for (int32_t v = first_on[carrier]; v >= 0; v = next_vertex(v)) {
            const int32_t start = s.vert_corner[v];
            for (int32_t k = start;;) {
                int32_t found = kUnknown;
                const int32_t f = s.face_src[face_of(k)];
                for (int32_t c = 3 * f; c < 3 * f + 3; ++c) {
                    const int32_t p = in.corner_vert[c], q = in.corner_vert[next_corner(c)];
                    if ((p == a && q == b) || (p == b && q == a)) found = c;
                }
                if (found != kUnknown) return found;
                k = s.rotate(k);
                if (k < 0 || k == start) break;
            }
        }
        return kUnknown;
    }

    // The others are looked for around their ends.
    void look_around_ends(Tally& tally) {
        Array<int32_t> corner_at(context.memory(), in.vertices(), -2); // the first of the vertex's fan; -2: nobody asks
        for (int32_t i = 0; i < s.carriers.size(); ++i)
            if (edge[i] == kUnknown) corner_at[s.copied(s.carriers[i].a)] = -1;
        for (int32_t c = 0; c < in.corners(); ++c) {
            int32_t& at = corner_at[in.corner_vert[c]];
            if (at == -1 || (at >= 0 && in.corner_twin[c] < 0)) at = c;
        }
        for (int32_t i = 0; i < s.carriers.size(); ++i) {
            if (edge[i] != kUnknown) continue;
            const int32_t b = s.copied(s.carriers[i].b), start = corner_at[s.copied(s.carriers[i].a)];
            edge[i] = -1;
            for (int32_t k = start; k >= 0 && edge[i] < 0;) {
                const int32_t last = prev_corner(k);
                if (in.corner_vert[next_corner(k)] == b) edge[i] = k;
                if (in.corner_vert[last] == b) edge[i] = last;
                k = in.corner_twin[last];
                if (k == start) break;
            }
            count(i, tally);
        }
    }

    void count(int32_t carrier, Tally& tally) const {
        const Class cause = cause_of(carrier);
        for (int32_t v = first_on[carrier]; v >= 0; v = next_vertex(v)) ++tally.of[look_around(v, cause)];
    }

    Class cause_of(int32_t carrier) const {
        const int32_t c = edge[carrier];
        if (c < 0) return kOnFlipped;
        bool small_angle = false;
        for (const int32_t k : {c, in.corner_twin[c]}) {
            if (k < 0) continue;
            const Vec3 &a = s.at(in.corner_vert[k]), &b = s.at(in.corner_vert[next_corner(k)]),
                       &o = s.at(in.corner_vert[prev_corner(k)]);
            const Vec3 ab = b - a, ao = o - a, bo = o - b;
            const double e = length(ab), f = length(ao), g = length(bo);
            if (dot(ao, bo) < kCapAngle * (f * g)) return kOnCap;
            small_angle |= dot(ab, ao) > kSmallAngle * (e * f) || -dot(ab, bo) > kSmallAngle * (e * g);
        }
        return small_angle ? kAtSmallAngle : kElsewhere;
    }

    Class look_around(int32_t v, Class cause) const {
        if (s.on_boundary(v)) return kOnBoundary;
        bool kept = false, crowded = false;
        const int32_t start = s.vert_corner[v];
        for (int32_t k = start;;) {
            kept |= s.is_kept(k);
            crowded |= length(s.at(s.head(k)) - s.at(v)) <= crowd;
            k = s.rotate(k);
            if (k < 0 || k == start) break;
        }
        return kept ? kOnKept : crowded ? kCrowded : cause;
    }

    // Of several, the first carrier and the first face.
    void find_worst(delmesh_remesh_report& report) {
        const auto source_vertex = [&](int32_t v) { return in.imported && !in.vert_source.empty() ? in.vert_source[v] : v; };
        Array<int32_t> on_face(context.memory(), in.faces(), 0);
        int32_t worst_face = -1;
        for (int32_t i = 0; i < s.carriers.size(); ++i) {
            const int32_t c = edge[i];
            if (c < 0) continue;
            for (const int32_t k : {c, in.corner_twin[c]}) {
                if (k < 0) continue;
                const int32_t f = face_of(k), sum = on_face[f] += on_carrier[i];
                if (worst_face < 0 || sum > on_face[worst_face] || (sum == on_face[worst_face] && f < worst_face)) worst_face = f;
            }
            if (on_carrier[i] <= report.worst_edge_splits) continue;
            const int32_t a = source_vertex(in.corner_vert[c]), b = source_vertex(in.corner_vert[next_corner(c)]);
            report.worst_edge_splits = on_carrier[i];
            report.worst_edge_from = std::min(a, b);
            report.worst_edge_to = std::max(a, b);
        }
        if (worst_face < 0) return;
        report.worst_face_splits = on_face[worst_face];
        report.worst_face = in.imported && !in.face_source.empty() ? in.face_source[worst_face] : worst_face;
    }

    Context& context;
    const Mesh& in;
    const Surface& s;
    const double crowd;
    Array<int32_t> edge;              // per carrier
    Array<int32_t> on_carrier;        // split vertices
    Array<int32_t> first_on, next_on; // per carrier and per split vertex; -1: none
};

} // namespace

Status where_vertices_went(Context& context, const Mesh& in, const Surface& s, double resolution, delmesh_remesh_report& report) {
    return Inquest(context, in, s, resolution).run(report);
}

} // namespace dm
