// SPDX-License-Identifier: Apache-2.0
// Fewer split vertices, once there is a Delaunay mesh.
//
// In preserve mode the triangulation of a flat place is the Delaunay triangulation of the vertices on its border. So a further
// split vertex never makes another piece of an edge Delaunay, it can only stop it being so; and a vertex may go as soon as
// the piece of edge that is left in its place is Delaunay. Any few vertices may be taken out together and put back elsewhere by
// the same loop that placed them first, in another order and at other places that are as good. That is a trial: it is done on the
// surface itself, and undone unless it ends with a Delaunay mesh that has no more vertices. Equal numbers are kept, which is what
// lets the search move on. Every NLD edge of the input needs one vertex, so what there is to win is in all others: half of the
// rounds are spent around those. With effort 1 a large mesh has no time for moves that win nothing: there a trial has to end with
// fewer vertices, is given up as soon as more edges are left to split than that allows, and few are made around the same vertex:
// the fewer, the fewer vertices there are around it.
#include "algo/loop.h"

#include <algorithm>
#include <cmath>

#include "base/hash.h"
#include "geom/predicates.h"

namespace dm {
namespace {

constexpr int64_t kLeastRegion = 2;   // vertices taken out together
constexpr double kLeastTrials = 8192; // in a round
// With effort 1.
constexpr double kVerticesPerTrial = 10;     // of the input
constexpr double kVerticesPerShortTrial = 8; // the same where trials do not wander
constexpr int32_t kMostFailures = 3;         // of such trials around one vertex
// Where flips may move the surface by no more than this, in units in the last place, one vertex hardly ever does for two. So a
// trial that has to end with fewer takes out more than two.
constexpr double kHardlyMoves = 8;
constexpr int64_t kLeastToWin = 3;

// Cotangent of the angle at x between a and b: the smaller, the wider.
double cotangent(const Vec3& a, const Vec3& b, const Vec3& x) {
    const Vec3 u = a - x, v = b - x;
    const double d = dot(u, v), area = length(cross(u, v));
    return area > 1e-300 ? d / area : d > 0 ? 1e300 : -1e300;
}

} // namespace

// -- taking one vertex out

// The neighbours of v on its carrier. False where there are none any more, or where an edge at v was cut at import: its copies
// would have to follow.
bool Loop::find_line(int32_t v, Line& line) const {
    if (s.is_original(v) || s.vert_corner[v] < 0) return false;
    const SplitVertex& at = s.split_vertices[v - s.first_split];
    const Carrier& carrier = s.carriers[at.carrier];
    double nearest_back = -1, nearest_ahead = 2;
    line = {-1, -1, -1, -1};
    const auto look = [&](int32_t x, int32_t corner) {
        double t;
        if (x == carrier.a)
            t = 0;
        else if (x == carrier.b)
            t = 1;
        else if (!s.is_original(x) && s.split_vertices[x - s.first_split].carrier == at.carrier)
            t = s.split_vertices[x - s.first_split].t;
        else
            return;
        if (t < at.t && t > nearest_back) nearest_back = t, line.back = x, line.to_back = corner;
        if (t > at.t && t < nearest_ahead) nearest_ahead = t, line.ahead = x, line.to_ahead = corner;
    };
    const int32_t start = s.vert_corner[v];
    for (int32_t k = start;;) {
        look(s.head(k), k);
        const int32_t last = prev_corner(k);
        if (is_cut(s.twin(k)) || is_cut(s.twin(last))) return false;
        k = s.twin(last);
        if (k < 0) look(s.vert(last), -1);
        if (k < 0 || k == start) break;
    }
    return line.back >= 0 && line.ahead >= 0;
}

// Calls visit(corner v -> x, side) for the edges of v that are not on its line, counter-clockwise, until it returns true.
// Sides are numbered from 0; at the boundary there is only one.
template <class Visit>
void Loop::for_spokes(int32_t v, const Line& line, Visit&& visit) const {
    const bool boundary = s.on_boundary(v);
    const int32_t start = boundary ? s.vert_corner[v] : line.to_ahead;
    int side = 0;
    for (int32_t k = start;;) {
        const int32_t x = s.head(k);
        if (x == line.back)
            side = boundary ? 0 : 1;
        else if (x != line.ahead && visit(k, side))
            return;
        k = s.rotate(k);
        if (k < 0 || k == start) return;
    }
}

// Would the piece of edge without v be Delaunay? Up to rounding, which the trial decides. Its apexes would be among the vertices
// that v is joined to.
bool Loop::is_needless(int32_t v) const {
    Line line;
    if (!find_line(v, line)) return false;
    const bool boundary = s.on_boundary(v);
    if (boundary && !rules.boundary_rule) return true;
    const Vec3 &a = s.at(line.back), &b = s.at(line.ahead);
    double least[2] = {1e300, 1e300};
    for_spokes(v, line, [&](int32_t k, int side) {
        least[side] = std::min(least[side], cotangent(a, b, s.at(s.head(k))));
        return false;
    });
    constexpr double kRounding = 1e-12;
    return boundary ? least[0] >= -kRounding : least[0] + least[1] >= -kRounding;
}

// Takes v out of the surface: flips its spokes away, inside the flat places on either side of its line, until it is as a split
// made it. False where that cannot be done; the trial has to be undone then.
bool Loop::take_out(int32_t v) {
    if (s.is_original(v) || s.vert_corner[v] < 0 || s.pins[v - s.first_split] != 0) return false;
    for (;;) {
        Line line;
        if (!find_line(v, line)) return false;
        const int sides = s.on_boundary(v) ? 1 : 2;
        int32_t spokes[2] = {0, 0};
        for_spokes(v, line, [&](int32_t, int side) { return ++spokes[side], false; });
        if (spokes[0] == 0 || (sides == 2 && spokes[1] == 0)) return false;
        if (spokes[0] <= 1 && spokes[1] <= 1) return merge_pieces(v, line);
        bool flipped = false;
        for_spokes(v, line, [&](int32_t k, int side) {
            if (spokes[side] <= 1 || !s.may_edit(k) || !has_room()) return false;
            const Judgement judgement = judge(k);
            if (judgement.verdict != Verdict::flip || judgement.free.kind == FreeFlip::moves) return false;
            do_flip(k, judgement.free);
            return flipped = true;
        });
        if (!flipped) return false;
    }
}

// v has one spoke left on either side.
bool Loop::merge_pieces(int32_t v, const Line& line) {
    // The corner that arrives at v on its line; on the boundary there is only one.
    const int32_t c = s.on_boundary(v) ? prev_corner(s.twin(prev_corner(s.vert_corner[v]))) : s.twin(line.to_back);
    const int32_t p = s.vert(c), q = p == line.back ? line.ahead : line.back;
    const int32_t t = s.twin(next_corner(s.twin(next_corner(c)))); // q -> v
    const bool all_own = s.owns(p) && s.owns(q) && s.owns(v) && s.owns(s.apex(c)) && (t < 0 || s.owns(s.apex(t)));
    if (!all_own || !has_room() || s.adjacent(p, q)) return false;
    const auto may_merge = [&](int32_t k) {
        const int32_t f = face_of(k), g = face_of(s.twin(next_corner(k)));
        const Vec3 &x = s.at(s.vert(k)), &y = s.at(s.vert(k) == p ? q : p), &z = s.at(s.apex(k));
        return patches->together(f, g) && !zero_area(x, y, z) && dot(patches->normal(s, f, g), cross(y - x, z - x)) > 0;
    };
    if (!may_merge(c) || (t >= 0 && !may_merge(t))) return false;
    for (const int32_t k : {c, t})
        if (k >= 0) patches->merge(face_of(k), face_of(s.twin(next_corner(k))));
    --report.splits;
    if (t < 0)
        --report.boundary_splits;
    else if (s.is_kept(c))
        --report.kept_splits;
    s.unsplit(c);
    for (const int32_t k : {c, t})
        if (k >= 0) look_at_face(face_of(k));
    return true;
}

// -- trials

// Takes the vertices out and goes on until the surface is Delaunay again. If that needs more than `most` new vertices, everything
// is as it was before.
Status Loop::try_without(const Array<int32_t>& vertices, int64_t most, bool& kept) {
    const delmesh_remesh_report report_before = report;
    s.begin_trial();
    patches->begin_trial();
    trial_made.clear();
    trial.running = true;
    trial.failed = false;
    trial.splits_left = most;
    for (const int32_t v : vertices) {
        const int32_t c = s.vert_corner[v];
        if (c < 0) continue;
        __builtin_prefetch(s.split_vertices.data() + (v - s.first_split));
        __builtin_prefetch(s.pos.data() + v);
        __builtin_prefetch(s.corner_vert.data() + c);
        __builtin_prefetch(s.corner_twin.data() + c);
        patches->ask_for(face_of(c));
    }
    int64_t taken = 0;
    while (taken < vertices.size() && take_out(vertices[taken])) ++taken;
    if (taken < vertices.size())
        trial.failed = true;
    else
        DM_TRY(drain());
    kept = !trial.failed;
    trial.running = trial.failed = false;
    if (kept) {
        s.keep_trial();
        patches->keep_trial();
        return DELMESH_OK;
    }
    ready.clear();
    blocked.clear();
    report = report_before;
    s.undo_trial();
    patches->undo_trial();
    return DELMESH_OK;
}

// Each effort after the first is four times the last.
int32_t Loop::search_rounds() const {
    return rules.effort == 1 ? 1 : 1 << (2 * std::min(rules.effort - 1, 15));
}

Status Loop::need_fewer() {
    DM_TRY(take_out_needless());
    for (int32_t next = 0; next < search_rounds(); ++next) {
        begin_search(next);
        DM_TRY(search(trials_left));
    }
    return DELMESH_OK;
}

Status Loop::take_out_needless() {
    for (bool again = true; again;) {
        again = false;
        for (int64_t i = 0; i < own.size(); ++i) {
            const int32_t v = own[i];
            if ((i & 0xfff) == 0) DM_TRY(tick(0));
            if (!is_needless(v)) continue;
            region.clear();
            region.push_back(v);
            bool kept = false;
            DM_TRY(try_without(region, 0, kept));
            again |= kept;
        }
    }
    return DELMESH_OK;
}

// Local search: trials around vertices drawn at random, from those in excess and, every other round, from all. A round has as many
// trials as there are split vertices; with effort 1 the only one may not take longer than a part of reading the mesh.
void Loop::begin_search(int32_t next_round) {
    round = next_round;
    tidy_own();
    trials = std::max(own.size(), static_cast<int64_t>(share * kLeastTrials));
    const double vertices_per_trial = wanders() ? kVerticesPerTrial : kVerticesPerShortTrial;
    if (rules.effort == 1) trials = std::min(2 * own.size(), static_cast<int64_t>(share * s.first_split / vertices_per_trial));
    centres.clear();
    if (!s.is_part()) centres.reserve(2 * own.size());
    for (const int32_t v : own)
        if (is_centre(v)) centres.push_back({v, 0});
    trials_left = centres.empty() ? 0 : trials;
}

bool Loop::is_centre(int32_t v) const {
    const bool all = round % 2 == 1;
    return s.vert_corner[v] >= 0 && (all || is_in_excess(v));
}

void Loop::drop_centre(int64_t i) {
    centres[i] = centres.back();
    centres.pop_back();
    if (centres.empty()) trials_left = 1;
}

Status Loop::search(int64_t most) {
    for (; trials_left > 0 && most > 0; --trials_left, --most) {
        if ((trials_left & 0x3f) == 0)
            DM_TRY(tick((round + 1 - static_cast<double>(trials_left) / static_cast<double>(trials)) / search_rounds()));
        const int64_t pick = random_below(centres.size());
        if (!is_centre(centres[pick].vert)) {
            drop_centre(pick);
            continue;
        }
        const bool is_stiff = !wanders() && rules.free_movement.anywhere <= kHardlyMoves * rules.resolution;
        const int64_t least = is_stiff ? kLeastToWin : kLeastRegion;
        const int64_t most_taken = least + random_below(kMostTaken - least + 1);
        gather_region(centres[pick].vert, most_taken);
        if (is_stiff && region.size() < least) {
            drop_centre(pick);
            continue;
        }
        bool kept = false;
        DM_TRY(try_without(region, region.size() - (wanders() ? 0 : 1), kept));
        if (!kept) {
            const bool are_all = is_stiff && region.size() == least && most_taken > least; // there is hardly another way to try
            centres[pick].failures += are_all ? 2 : 1;
            if (centres[pick].failures >= kMostFailures && !wanders()) drop_centre(pick);
            continue;
        }
        for (const int32_t v : trial_made) {
            add_own(v);
            if (centres.room() > 0 && is_centre(v)) centres.push_back({v, 0});
        }
    }
    return DELMESH_OK;
}

void Loop::tidy_own() {
    std::sort(own.begin(), own.end());
    const int32_t* const end = std::unique(own.begin(), own.end());
    own.resize_uninitialized(
        std::remove_if(own.begin(), own.begin() + (end - own.begin()), [this](int32_t v) { return s.vert_corner[v] < 0; }) -
        own.begin());
}

// Split vertices around v, breadth first over the edges of the mesh.
void Loop::gather_region(int32_t v, int64_t most) {
    region.clear();
    region.push_back(v);
    for (int64_t i = 0; i < region.size(); ++i) {
        const int32_t start = s.vert_corner[region[i]];
        for (int32_t k = start; region.size() < most;) {
            const int32_t x = s.head(k);
            if (!s.is_original(x) && s.owns(x) && s.pins[x - s.first_split] == 0 &&
                std::find(region.begin(), region.end(), x) == region.end())
                region.push_back(x);
            k = s.rotate(k);
            if (k < 0 || k == start) break;
        }
    }
}

// Two thirds of the table's slots, at most, hold an edge; the others no vertices.
void Loop::remember_nld() {
    nld_at_start.assign(table_size(ready.size()), {-1, -1});
    for (const Entry& e : ready) nld_at_start[slot_of({e.p, e.q})] = {e.p, e.q};
}
int64_t Loop::slot_of(const VertexPair& edge) const {
    const int64_t last = nld_at_start.size() - 1;
    const uint64_t key = static_cast<uint64_t>(edge.a) << 32 | static_cast<uint32_t>(edge.b);
    int64_t slot = static_cast<int64_t>(scramble(key) & static_cast<uint64_t>(last));
    while (nld_at_start[slot].a >= 0 && !(nld_at_start[slot] == edge)) slot = (slot + 1) & last;
    return slot;
}

// Is v more than the one vertex that each NLD edge of the input needs?
bool Loop::is_in_excess(int32_t v) const {
    const int32_t carrier = s.split_vertices[v - s.first_split].carrier;
    if (s.carrier_splits[carrier] > 1 || nld_at_start.empty()) return true; // empty: a flip mode past its split budget
    const VertexPair edge{s.carriers[carrier].a, s.carriers[carrier].b};
    return nld_at_start[slot_of(edge)].a < 0;
}

// SplitMix64 (Steele, Lea, Flood 2014): the same numbers on every machine.
int64_t Loop::random_below(int64_t end) {
    random_state += 0x9e3779b97f4a7c15u;
    uint64_t z = random_state;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return static_cast<int64_t>((z ^ (z >> 31)) % static_cast<uint64_t>(end));
}

} // namespace dm
