// SPDX-License-Identifier: Apache-2.0
#include "algo/hand_out.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "algo/parallel_slices.h"
#include "algo/surface_map.h"
#include "mesh/slices.h"
#include "mesh/source_map.h"

namespace dm {
namespace {

int32_t source_of(const Mesh& in, const Surface& s, int32_t v) {
    v = s.copied(v);
    return in.imported && !in.vert_source.empty() ? in.vert_source[v] : v;
}

// Finds source faces. Made only when a split vertex asks for one, since it takes a pass over the mesh.
class Locator {
public:
    Locator(const Mesh& mesh, Memory& memory) : in(mesh), vert_corner(memory) {}

    // The place of x on the source, by walking through the faces from those around `from`; x lies on it up to `reach`, as
    // points inside flat patches do. False if the walk ends elsewhere.
    bool locate(int32_t from, const Vec3& x, double reach, VertexMap& map) {
        if (vert_corner.empty()) {
            vert_corner.assign(in.vertices(), -1);
            for (int32_t c = in.corners() - 1; c >= 0; --c) vert_corner[in.corner_vert[c]] = c;
        }
        int32_t c = vert_corner[from];
        if (c < 0) return false;
        // Start in the face around `from` that comes nearest to holding x.
        int32_t best = c;
        double best_weight = -std::numeric_limits<double>::infinity();
        for (int32_t k = c, steps = 0; steps < kMostSteps; ++steps) {
            const double weight = weights_in(face_of(k), x).least();
            if (weight > best_weight) best_weight = weight, best = k;
            k = in.corner_twin[prev_corner(k)];
            if (k < 0 || k == c) break;
        }
        int32_t f = face_of(best);
        for (int32_t steps = 0; steps < kMostSteps; ++steps) {
            const Weights w = weights_in(f, x);
            const int least = w.w[0] <= w.w[1] ? (w.w[0] <= w.w[2] ? 0 : 2) : (w.w[1] <= w.w[2] ? 1 : 2);
            if (!(w.w[least] < -1e-9)) {
                if (!(w.height <= reach)) return false;
                const double sum = std::max(0.0, w.w[0]) + std::max(0.0, w.w[1]) + std::max(0.0, w.w[2]);
                for (int k = 0; k < 3; ++k) {
                    const int32_t v = in.corner_vert[3 * f + k];
                    map.vert[k] = in.imported && !in.vert_source.empty() ? in.vert_source[v] : v;
                    map.weight[k] = std::max(0.0, w.w[k]) / sum;
                }
                return true;
            }
            const int32_t beyond = in.corner_twin[3 * f + (least + 1) % 3]; // the edge opposite to that corner
            if (beyond < 0) return false;
            f = face_of(beyond);
        }
        return false;
    }

private:
    static constexpr int32_t kMostSteps = 4096;
    struct Weights {
        double w[3], height;
        double least() const { return std::min({w[0], w[1], w[2]}); }
    };
    Weights weights_in(int32_t f, const Vec3& x) const {
        const Vec3 a = in.position(in.corner_vert[3 * f]), b = in.position(in.corner_vert[3 * f + 1]),
                   c = in.position(in.corner_vert[3 * f + 2]);
        const Vec3 n = cross(b - a, c - a);
        const double n2 = length_squared(n);
        if (!(n2 > 0)) return {{-1, -1, -1}, std::numeric_limits<double>::infinity()};
        const double wb = dot(n, cross(x - a, c - a)) / n2, wc = dot(n, cross(b - a, x - a)) / n2;
        return {{1 - wb - wc, wb, wc}, std::fabs(dot(n, x - a)) / std::sqrt(n2)};
    }

    const Mesh& in;
    Array<int32_t> vert_corner;
};

constexpr int64_t kGrain = 1 << 14;

// Numbers of vertices in the result. Those before `base` keep theirs.
struct Numbers {
    explicit Numbers(Memory& memory) : moved(memory) {}
    int32_t of(int32_t v) const { return v < base ? v : moved[v - base]; } // -1: left out
    bool stays(int32_t v) const { return of(v) >= 0; }
    int32_t base = 0;
    Array<int32_t> moved;
    int32_t originals = 0, count = 0;
};

// Leaves out split vertices that nobody has, and with `compact` all that no face uses.
Status number_vertices(Context& context, Surface& s, bool compact, Numbers& numbers) {
    const int32_t all = s.vertices();
    int32_t base = compact ? 0 : s.first_split;
    while (base < all && s.vert_corner[base] >= 0) ++base;
    numbers.base = base;
    numbers.moved.resize_uninitialized(all - base);
    numbers.count = base;
    numbers.originals = std::min(base, s.first_split);
    for (int32_t v = base; v < all; ++v) {
        const bool stays = s.vert_corner[v] >= 0;
        numbers.moved[v - base] = stays ? numbers.count++ : -1;
        if (stays && s.is_original(v)) ++numbers.originals;
    }
    if (numbers.count == all) return DELMESH_OK;
    return context.parallel(s.corners(), 3 * kGrain, [&](int64_t, int64_t begin, int64_t end) {
        for (int64_t c = begin; c < end; ++c)
            if (s.corner_vert[c] >= base) s.corner_vert[c] = numbers.moved[s.corner_vert[c] - base];
    });
}

// Which faces are dead, and how many of them there are before a face.
class DeadFaces {
public:
    static constexpr int32_t kGroup = 8; // faces

    explicit DeadFaces(Memory& memory) : dead_(memory), before_(memory) {}

    Status find(Context& context, const Surface& s) {
        const int32_t faces = s.faces();
        const int64_t groups = block_count(faces, kGroup);
        dead_.resize_uninitialized(groups);
        before_.resize_uninitialized(groups);
        DM_TRY(context.parallel(groups, kGrain / kGroup, [&](int64_t, int64_t begin, int64_t end) {
            for (int64_t i = begin; i < end; ++i) {
                const int32_t first = static_cast<int32_t>(i) * kGroup, count = std::min(kGroup, faces - first);
                uint32_t bits = 0;
                for (int32_t k = 0; k < count; ++k) bits |= (s.is_dead(first + k) ? 1u : 0u) << k;
                dead_[i] = static_cast<uint8_t>(bits);
            }
        }));
        int32_t sum = 0;
        for (int64_t i = 0; i < groups; ++i) {
            before_[i] = dead_[i] == 0 ? sum : ~sum;
            sum += std::popcount(dead_[i]);
        }
        return DELMESH_OK;
    }

    bool is_dead(int32_t face) const { return (dead_[face / kGroup] >> face % kGroup & 1) != 0; }
    bool are_some(int32_t group) const { return dead_[group] != 0; }
    int32_t before(int32_t face) const {
        const int32_t group = face / kGroup, of_group = before_[group];
        if (of_group >= 0) return of_group; // nearly always
        return ~of_group + std::popcount(dead_[group] & ((1u << face % kGroup) - 1));
    }

private:
    Array<uint8_t> dead_;   // per group
    Array<int32_t> before_; // per group: the dead faces before it, as a negative number if it has some itself
};

// Dead faces are closed up, in place, keeping the order: the faces of a slice move to its beginning, then all slices but the first
// to where the one before them ends.
Status close_up_faces(Context& context, Surface& s) {
    constexpr int32_t kGroup = DeadFaces::kGroup;
    const int32_t faces = s.faces();
    DeadFaces dead(context.memory());
    DM_TRY(dead.find(context, s));
    const auto moved_corner = [&](int32_t c) { return c - 3 * dead.before(face_of(c)); };
    const auto move = [&](int32_t from, int32_t end, int32_t to) { // faces [from, end)
        const auto move_in = [&](auto& array, int64_t each) {
            if (from != to) std::copy(array.data() + each * from, array.data() + each * end, array.data() + each * to);
        };
        move_in(s.corner_vert, 3);
        move_in(s.corner_bits, 3);
        move_in(s.face_src, 1);
        int32_t* const twin = s.corner_twin.data();
        const int32_t back = 3 * (from - to);
        for (int32_t c = 3 * from; c < 3 * end; ++c) {
            const int32_t t = twin[c];
            twin[c - back] = t < 0 ? t : moved_corner(t);
            if (is_cut(t)) s.cut_slots[cut_slot(t)].corner = moved_corner(c);
        }
    };
    const int64_t slices = few_slices(context, faces, s.vertices());
    const int32_t slice = static_cast<int32_t>(block_count(block_count(faces, slices), kGroup)) * kGroup;
    Array<int32_t> live(context.memory(), slices, 0); // faces
    DM_TRY(context.parallel(slices, 1, [&](int64_t k, int64_t, int64_t) {
        const int32_t begin = static_cast<int32_t>(k) * slice, end = std::min(faces, begin + slice);
        int32_t first = begin, next = begin; // of the faces that move together, and where they go
        const auto move_until = [&](int32_t f) {
            move(first, f, next);
            next += f - first;
            first = f + 1;
        };
        for (int32_t group = begin; group < end; group += kGroup) {
            if (!dead.are_some(group / kGroup)) continue;
            for (int32_t f = group; f < std::min(group + kGroup, end); ++f)
                if (dead.is_dead(f)) move_until(f);
        }
        move_until(end);
        live[k] = next - begin;
    }));
    const auto slide = [&](auto& array, int64_t each) {
        int64_t next = live[0];
        for (int64_t k = 1; k < slices; next += live[k++]) {
            const auto* const from = array.data() + each * k * slice;
            std::copy(from, from + each * live[k], array.data() + each * next);
        }
        array.resize_uninitialized(each * next);
    };
    return context.parallel(3, 1, [&](int64_t task, int64_t, int64_t) { // nothing grows
        if (task == 0)
            slide(s.corner_vert, 3);
        else if (task == 1)
            slide(s.corner_twin, 3);
        else {
            slide(s.corner_bits, 3);
            slide(s.face_src, 1);
        }
    });
}

struct Share {
    int32_t vert;
    double weight;
};
struct Shares {
    Share of[6];
    int count = 0;
    void add(int32_t vert, double weight) {
        for (int i = 0; i < count; ++i)
            if (of[i].vert == vert) {
                of[i].weight += weight;
                return;
            }
        of[count++] = {vert, weight};
    }
    void sort() { // the largest first
        for (int i = 1; i < count; ++i)
            for (int k = i;
                 k > 0 && (of[k].weight > of[k - 1].weight || (of[k].weight == of[k - 1].weight && of[k].vert < of[k - 1].vert));
                 --k)
                std::swap(of[k], of[k - 1]);
    }
    VertexMap first_three() const {
        const int most = std::min(count, 3);
        double sum = 0;
        for (int i = 0; i < most; ++i) sum += of[i].weight;
        VertexMap map{{of[0].vert, of[0].vert, of[0].vert}, {0, 0, 0}};
        for (int i = 0; i < most; ++i) {
            map.vert[i] = of[i].vert;
            map.weight[i] = most == 1 ? 1 : sum == 1 ? of[i].weight : of[i].weight / sum;
        }
        return map;
    }
};

// Where the split vertices lie on the source. The ends of a carrier may be split vertices themselves, older ones.
Status trace_splits(Context& context, const Mesh& in, const Surface& s, const Numbers& numbers, double reach,
                    Array<VertexMap>& maps) {
    const int64_t splits = s.vertices() - s.first_split;
    maps.resize_uninitialized(numbers.count - numbers.originals);
    constexpr int64_t kSplits = 1 << 11;
    Array<uint8_t> has_deep(context.memory(), block_count(splits, kSplits), 0);
    DM_TRY(context.parallel(splits, kSplits, [&](int64_t block, int64_t begin, int64_t end) {
        for (int64_t i = begin; i < end; ++i) {
            const int32_t number = numbers.of(s.first_split + static_cast<int32_t>(i));
            if (number < 0) continue;
            const SplitVertex& split = s.split_vertices[i];
            const Carrier& line = s.carriers[split.carrier];
            if (!s.is_original(line.a) || !s.is_original(line.b)) {
                has_deep[block] = 1;
                continue;
            }
            Shares shares;
            shares.add(source_of(in, s, line.a), 1 - split.t);
            shares.add(source_of(in, s, line.b), split.t);
            shares.sort();
            maps[number - numbers.originals] = shares.first_three();
        }
    }));
    Locator locator(in, context.memory());
    Sheets sheets(context.memory(), in, 0);
    const auto trace = [&](int32_t v, int32_t number) -> Status {
        const SplitVertex& split = s.split_vertices[v - s.first_split];
        const Carrier& line = s.carriers[split.carrier];
        if (s.is_original(line.a) && s.is_original(line.b)) return DELMESH_OK;
        Shares shares;
        for (int end = 0; end < 2; ++end) {
            const int32_t x = end == 0 ? line.a : line.b;
            const double weight = end == 0 ? 1 - split.t : split.t;
            if (s.is_original(x)) {
                shares.add(source_of(in, s, x), weight);
                continue;
            }
            constexpr VertexMap kNone{{0, 0, 0}, {1, 0, 0}}; // a number that nobody has
            const int32_t older = numbers.of(x);
            const VertexMap& m = older < 0 ? kNone : maps[older - numbers.originals];
            for (int k = 0; k < 3; ++k)
                if (m.weight[k] != 0) shares.add(m.vert[k], weight * m.weight[k]);
        }
        // Ends inside different edges make more than three. In a flat patch the point has a place on the source all the same; in
        // the flip modes it may not, and then it is the closest point that is found from there.
        shares.sort();
        VertexMap found;
        bool located = false;
        if (shares.count > 3)
            for (int i = 0; i < shares.count && !located; ++i) located = locator.locate(shares.of[i].vert, s.at(v), reach, found);
        if (shares.count > 3 && !located) {
            if (sheets.first.empty()) DM_TRY(sheets.begin(context));
            Sheets::Place place;
            for (int i = 0; i < shares.count; ++i)
                if (const int32_t c = sheets.first[shares.of[i].vert]; c >= 0) sheets.descend(s.at(v), face_of(c), place);
            located = place.face >= 0;
            for (int k = 0; k < 3 && located; ++k)
                found.vert[k] = source_of(in, s, in.corner_vert[3 * place.face + k]), found.weight[k] = place.weight[k];
        }
        maps[number - numbers.originals] = located ? found : shares.first_three();
        return DELMESH_OK;
    };
    for (int64_t block = 0; block < has_deep.size(); ++block) {
        if (has_deep[block] == 0) continue;
        const int64_t end = std::min(splits, (block + 1) * kSplits);
        for (int64_t i = block * kSplits; i < end; ++i) {
            const int32_t v = s.first_split + static_cast<int32_t>(i), number = numbers.of(v);
            if (number >= 0) DM_TRY(trace(v, number));
        }
    }
    return DELMESH_OK;
}

// What the map of corners needs to know of the vertices and faces that stay.
void trace_vertices(const Surface& s, const Numbers& numbers, VertexTraces& traces) {
    traces.same = std::min(numbers.base, s.first_copy);
    traces.vert.resize_uninitialized(numbers.count - traces.same);
    traces.line.reserve(numbers.count - numbers.originals);
    for (int32_t v = traces.same; v < s.vertices(); ++v) {
        if (!numbers.stays(v)) continue;
        int32_t& trace = traces.vert[numbers.of(v) - traces.same];
        if (s.is_original(v)) {
            trace = s.copied(v);
            continue;
        }
        trace = ~static_cast<int32_t>(traces.line.size());
        const SplitVertex& split = s.split_vertices[v - s.first_split];
        const Carrier& line = s.carriers[split.carrier];
        if (s.is_original(line.a) && s.is_original(line.b))
            traces.line.push_back({s.copied(line.a), s.copied(line.b), split.t});
        else
            traces.line.push_back({-1, -1, 0});
    }
}

} // namespace

Status hand_out(Context& context, const Mesh& in, Surface& s, const delmesh_remesh_options& options, double reach,
                VertexTraces* traces, Mesh& out) {
    Memory& memory = context.memory();
    if (s.dead_faces != 0) DM_TRY(close_up_faces(context, s));
    DM_TRY(context.progress(0.2));
    const int32_t all = s.vertices();
    Numbers numbers(memory);
    DM_TRY(number_vertices(context, s, options.compact != 0, numbers));
    const int32_t count = numbers.count;
    out.precision = options.precision == DELMESH_FLOAT32 ? Precision::f32 : Precision::f64;
    out.vertex_count = count;
    const auto write = [&](auto& positions, const auto& given) {
        positions.resize_uninitialized(3 * static_cast<int64_t>(count));
        // The input's own are handed out as they are.
        const int64_t same = in.precision == out.precision ? std::min(numbers.base, s.first_copy) : 0;
        return context.parallel(all, kGrain, [&](int64_t, int64_t begin, int64_t end) {
            if (begin < same) {
                std::copy(given.data() + 3 * begin, given.data() + 3 * std::min(same, end), positions.data() + 3 * begin);
                begin = std::min(same, end);
            }
            for (int32_t v = static_cast<int32_t>(begin); v < end; ++v) {
                if (!numbers.stays(v)) continue;
                using Real = std::remove_reference_t<decltype(positions[0])>;
                const Vec3 x = s.is_original(v) ? round_to(out.precision, in.position(s.copied(v))) : s.at(v);
                const int64_t i = 3 * static_cast<int64_t>(numbers.of(v));
                positions[i] = static_cast<Real>(x.x); // exact: rounded when it was made
                positions[i + 1] = static_cast<Real>(x.y);
                positions[i + 2] = static_cast<Real>(x.z);
            }
        });
    };
    DM_TRY(out.precision == Precision::f32 ? write(out.pos32, in.pos32) : write(out.pos64, in.pos64));
    DM_TRY(context.progress(0.5));
    // Where everything comes from.
    DM_TRY(trace_splits(context, in, s, numbers, reach, out.split_map));
    set_source_counts(in, out);
    out.first_split = numbers.originals;
    if (options.compact != 0 || (in.imported && !in.vert_source.empty()) || s.first_split != s.first_copy ||
        all != s.first_split) {
        out.vert_source.resize_uninitialized(count);
        DM_TRY(context.parallel(all, kGrain, [&](int64_t, int64_t begin, int64_t end) {
            for (int32_t v = static_cast<int32_t>(begin); v < end; ++v)
                if (numbers.stays(v)) out.vert_source[numbers.of(v)] = s.is_original(v) ? source_of(in, s, v) : -1;
        }));
    }
    if (!s.vert_root.empty() || s.first_split != s.first_copy || !in.vert_join.empty()) {
        out.vert_join.reserve(count);
        Array<int32_t> stand_in(memory); // for a root that is left out: the first of its copies that stays
        if (count != all) stand_in.assign(all, -1);
        for (int32_t v = 0; v < all; ++v) {
            if (!numbers.stays(v)) continue;
            int32_t root = v;
            if (!s.vert_root.empty())
                root = s.root(v);
            else if (s.is_original(v)) {
                root = s.copied(v);
                if (!in.vert_join.empty()) root = in.vert_join[root];
            }
            if (!numbers.stays(root)) {
                if (stand_in[root] < 0) stand_in[root] = v;
                root = stand_in[root];
            }
            out.vert_join.push_back(numbers.of(root));
        }
    }
    if (traces != nullptr) trace_vertices(s, numbers, *traces);
    const bool same_faces = s.faces() == in.faces() && s.dead_faces == 0;
    const bool look_through = in.imported && !in.face_source.empty();
    if (look_through || !same_faces) {
        if (traces != nullptr) traces->face.copy_from(s.face_src);
        if (look_through)
            DM_TRY(context.parallel(s.face_src.size(), kGrain, [&](int64_t, int64_t begin, int64_t end) {
                for (int64_t f = begin; f < end; ++f) s.face_src[f] = in.face_source[s.face_src[f]];
            }));
        out.face_source = std::move(s.face_src);
    } else if (traces != nullptr)
        traces->face = std::move(s.face_src);
    if (traces != nullptr) { // room for the map: about as large, unless the precision or splits left much of it unused
        const int64_t room = 3 * (s.pos.size() + s.pos.room()) * 2; // places of an int32_t
        if (room >= s.corners() && room <= s.corners() + s.corners() / 4)
            out.corner_map.take_storage(std::move(s.pos));
        else
            s.pos.free_storage();
    }
    out.corner_vert = std::move(s.corner_vert);
    out.corner_twin = std::move(s.corner_twin);
    out.corner_bits = std::move(s.corner_bits);
    out.cut_slots = std::move(s.cut_slots);
    return DELMESH_OK;
}

} // namespace dm
