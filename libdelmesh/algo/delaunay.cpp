// SPDX-License-Identifier: Apache-2.0
// Algorithms 1 and 2 of Dyer, Zhang, Moeller, "Delaunay Mesh Construction" (2007), as one loop over two queues. What differs
// between the modes is only which edges may be flipped: in `preserve` those inside flat patches; in the flip modes all but kept
// ones. `ready` holds NLD edges that nobody has looked at since they changed; `blocked` those that could not be flipped then.
// Flips come first, always; when none is left, the blocked edge with the largest excess is split and the flipping goes on.
// A large mesh begins in parts (parts.cpp); there the order is that of each part.
// Flips end because a Delaunay flip never increases the area of the surface (Theorem 1 there) and the test is exact; splits end
// by the rules of split_point.h, then concentric shells, then max_vertices.
#include "algo/loop.h"

#include <algorithm>
#include <limits>

#include "algo/nld_scan.h"
#include "algo/parallel_slices.h"
#include "algo/split_point.h"
#include "geom/predicates.h"

namespace dm {
namespace {

constexpr int32_t kMostSheets = 1 << 20; // at one cut edge; a margin before 2^31 corners
// Splits on one carrier before its splits go to concentric shells. Around a vertex with small angles interval placement can
// spiral inward from edge to edge; points at equal distances from the vertex stop that.
constexpr int32_t kPatience = 40, kPatienceAtVertex = 8;

// So many splits per vertex of the input (clean meshes get by with two) are a sign of needles whose rounded spokes are never
// quite Delaunay: from there on flips may use all of rules.need, which ends it where splits would go down to the precision.
// A small mesh can afford more, and keeps its surface.
constexpr int64_t kCrowd = 4, kFewSplits = 20000;

// a + t (b - a), off by hardly more than one rounding: the difference, the product and the sum each keep what they lose.
double point_between(double a, double b, double t) {
    const double d = b - a, back = a + d;
    const double d_lost = (b - back) + (a - (back - d)); // b - a = d + d_lost
    const double step = t * d, step_lost = std::fma(t, d, -step) + t * d_lost;
    const double x = a + step, virtual_step = x - a;
    const double x_lost = (a - (x - virtual_step)) + (step - virtual_step);
    return x + (x_lost + step_lost);
}
Vec3 point_between(const Vec3& a, const Vec3& b, double t) {
    return {point_between(a.x, b.x, t), point_between(a.y, b.y, t), point_between(a.z, b.z, t)};
}

Loop::Entry pop(Array<Loop::Entry>& heap) {
    std::pop_heap(heap.begin(), heap.end());
    return heap.pop_back();
}
void push(Array<Loop::Entry>& heap, const Loop::Entry& e) {
    heap.push_back(e);
    std::push_heap(heap.begin(), heap.end());
}

} // namespace

// A heap's top is its greatest; ties go to the smaller vertex pair, so that the order does not depend on how the heap was filled.
bool operator<(const Loop::Entry& a, const Loop::Entry& b) {
    if (a.excess != b.excess) return a.excess < b.excess;
    if (a.p != b.p) return a.p > b.p;
    if (a.q != b.q) return a.q > b.q;
    return a.corner > b.corner;
}

Loop::Loop(Context& context_, Surface& surface, FlatPatches* flat, const DelaunayRules& rules_, delmesh_remesh_report& report_)
    : context(context_), s(surface), patches(flat), rules(rules_), report(report_), ready(context_.memory()),
      blocked(context_.memory()), pieces(context_.memory()), around(context_.memory()), bubble(context_.memory()),
      cluster(context_.memory()), places(context_.memory()), own_patches(context_.memory()), trial_made(context_.memory()),
      centres(context_.memory()), region(context_.memory()), nld_at_start(context_.memory()), own(context_.memory()),
      deferred(context_.memory()) {}

Status Loop::run() {
    DM_TRY(find_nld());
    report.nld_in = ready.size();
    DM_TRY(patches != nullptr ? run_parts() : flip_parts());
    std::make_heap(ready.begin(), ready.end());
    DM_TRY(drain());
    if (shrinks()) DM_TRY(need_fewer());
    return DELMESH_OK;
}

Status Loop::drain() {
    const double all = static_cast<double>(ready.size()) + 1;
    int64_t steps = 0;
    while (!trial.failed) {
        if (!trial.running && (++steps & 0x3ff) == 0) {
            // Nobody knows how much is left; what is in the queues against what was there moves in the right direction.
            const double left = static_cast<double>(ready.size() + blocked.size());
            DM_TRY(tick(1 - left / (all + left + static_cast<double>(steps))));
        }
        if (!has_room() || (s.is_part() && !trial.running && --steps_left < 0)) { // parts.cpp knows how to go on
            trial.failed = trial.running;
            break;
        }
        const bool first_look = !ready.empty();
        if (!first_look) {
            if (blocked.empty()) break;
            if (trial.running && needs_too_many()) {
                trial.failed = true;
                break;
            }
            // Flips elsewhere may have set blocked edges free: before the first split all are looked at again.
            if (!splitting && flips_at_sweep != report.flips) {
                flips_at_sweep = report.flips;
                std::swap(ready, blocked);
                continue;
            }
        }
        const Entry e = pop(first_look ? ready : blocked);
        if (!trial.running) ask_for_next(first_look ? ready : blocked);
        if (!still_nld(e)) continue;
        if (!s.may_edit(e.corner)) {
            defer(e);
            continue;
        }
        const Judgement judgement = judge(e.corner);
        if (judgement.verdict == Verdict::flip)
            do_flip(e.corner, judgement.free);
        else if (first_look) // in a trial, another order each time
            push(blocked, {trial.running ? random_unit() : e.excess, e.corner, e.p, e.q});
        else
            DM_TRY(do_split(e.corner, judgement.verdict));
        if (patches == nullptr && report.unflippable >= rules.split_budget) {
            // Flips and splits could chase each other: from here on it is Algorithm 1, on the surface as it is now.
            DM_TRY(grow_flat_patches(context, s, 0, nullptr, own_patches));
            patches = &own_patches;
        }
    }
    return DELMESH_OK;
}

// In a trial, with all blocked edges known: each of them takes a vertex of its own.
bool Loop::needs_too_many() const {
    if (wanders() || blocked.size() <= trial.splits_left) return false;
    int64_t edges = 0;
    for (int64_t i = 0; i < blocked.size(); ++i) {
        const Entry& e = blocked[i];
        const auto is_same = [&](const Entry& o) { return VertexPair(o.p, o.q) == VertexPair(e.p, e.q); };
        if (std::none_of(blocked.begin(), blocked.begin() + i, is_same) && still_nld(e)) ++edges;
    }
    return edges > trial.splits_left;
}

// Not a part's to do.
void Loop::defer(const Entry& e) {
    if (trial.running)
        trial.failed = true;
    else
        deferred.push_back(e);
}

// In a part, for one more flip or split without an allocation.
bool Loop::has_room() const {
    if (!s.is_part()) return true;
    constexpr int64_t kOneStep = 32; // more entries than either adds
    return s.has_room() && patches->has_room() && ready.room() >= kOneStep && blocked.room() >= kOneStep && deferred.room() >= 2;
}

Status Loop::tick(double fraction) {
    if (!s.is_part()) return context.progress(fraction);
    return context.cancel_requested() ? DELMESH_ERROR_CANCELLED : DELMESH_OK;
}

Status Loop::find_nld() {
    const int32_t faces = s.faces();
    const uint8_t* marks = rules.nld_marks;
    Array<uint8_t> made(context.memory());
    if (marks == nullptr) {
        made.resize_uninitialized(faces);
        Certificate found;
        const ScanView<double> view{s.corner_vert.data(), s.corner_twin.data(), &s.pos.data()->x, faces};
        DM_TRY(scan_faces(context, view, rules.boundary_rule, made.data(), found));
        marks = made.data();
    }
    // Counted first, so that each block knows the places of its edges.
    constexpr int64_t kGrain = 1 << 14;
    Array<int64_t> place(context.memory(), block_count(faces, kGrain) + 1, 0);
    DM_TRY(context.parallel(faces, kGrain, [&](int64_t block, int64_t begin, int64_t end) {
        int64_t edges = 0;
        for (int64_t f = begin; f < end; ++f) edges += (marks[f] & 1) + (marks[f] >> 1 & 1) + (marks[f] >> 2 & 1);
        place[block + 1] = edges;
    }));
    for (int64_t block = 1; block < place.size(); ++block) place[block] += place[block - 1];
    ready.resize_uninitialized(place.back());
    DM_TRY(context.parallel(faces, kGrain, [&](int64_t block, int64_t begin, int64_t end) {
        Entry* next = ready.data() + place[block];
        for_each_marked_edge(marks + begin, static_cast<int32_t>(end - begin),
                             [&](int32_t c) { *next++ = entry(static_cast<int32_t>(3 * begin) + c); });
    }));
    if (shrinks()) remember_nld();
    return DELMESH_OK;
}

bool Loop::is_nld(int32_t c) const {
    if (s.is_frozen(c)) return false;
    const Vec3 &a = s.at(s.vert(c)), &b = s.at(s.head(c)), &p = s.at(s.apex(c));
    if (s.is_boundary(c)) return rules.boundary_rule && boundary_edge_is_nld(a, b, p);
    return edge_is_nld(a, b, p, s.at(s.apex(s.twin(c))));
}

// Monotone in the sum of the opposite angles over 180 (twice the angle on the boundary), without inverse trigonometry:
// between 180 and 360 the cosine of the sum rises.
Loop::Entry Loop::entry(int32_t c) const {
    const int32_t p = s.vert(c), q = s.head(c);
    const Vec3 &a = s.at(p), &b = s.at(q);
    const auto angle = [&](const Vec3& apex, double& cosine, double& sine) {
        const Vec3 u = a - apex, v = b - apex;
        const double d = dot(u, v), area = length(cross(u, v)), size = std::sqrt(d * d + area * area);
        cosine = size > 0 ? d / size : -1;
        sine = size > 0 ? area / size : 0;
    };
    double c1, s1, c2, s2;
    angle(s.at(s.apex(c)), c1, s1);
    if (s.is_boundary(c))
        c2 = c1, s2 = s1;
    else
        angle(s.at(s.apex(s.twin(c))), c2, s2);
    return {c1 * c2 - s1 * s2, c, p, q};
}

// Edges come in an order that has nothing to do with where they lie in memory. The heap's top is often the next, and one of the two
// below it follows.
void Loop::ask_for_next(const Array<Entry>& heap) const {
    const int64_t soon = std::min<int64_t>(heap.size(), 3);
    for (int64_t i = 0; i < soon; ++i) {
        const Entry& e = heap[i];
        if (i == 0) {
            const int32_t t = s.twin(e.corner), u = s.apex(e.corner);
            if (t >= 0) __builtin_prefetch(s.corner_vert.data() + t);
            if (u >= 0) __builtin_prefetch(s.pos.data() + u);
            if (patches != nullptr && t >= 0) patches->ask_for(face_of(t));
            continue;
        }
        __builtin_prefetch(s.corner_vert.data() + e.corner);
        __builtin_prefetch(s.corner_twin.data() + e.corner);
        __builtin_prefetch(s.corner_bits.data() + e.corner);
        __builtin_prefetch(s.pos.data() + e.p);
        __builtin_prefetch(s.pos.data() + e.q);
        if (patches != nullptr) patches->ask_for(face_of(e.corner));
    }
}

void Loop::look_at(int32_t c) {
    if (is_nld(c)) push(ready, entry(c));
}
void Loop::look_at_face(int32_t f) {
    for (int32_t k = 3 * f; k < 3 * f + 3; ++k) look_at(k);
}
void Loop::look_at_faces_of(int32_t v) {
    const int32_t start = s.vert_corner[v];
    for (int32_t k = start;;) {
        look_at_face(face_of(k));
        k = s.rotate(k);
        if (k < 0 || k == start) break;
    }
}

// -- flips

Judgement Loop::judge(int32_t c) const {
    if (s.is_boundary(c)) return {Verdict::kept, {}};
    const int32_t t = s.twin(c);
    const int32_t p = s.vert(c), q = s.head(c), u = s.apex(c), v = s.apex(t);
    const Vec3 &pp = s.at(p), &qq = s.at(q), &uu = s.at(u), &vv = s.at(v);
    // A feature edge may be flipped where the precision has no room to split it; what came with the mesh may not.
    if (s.is_kept(c)) {
        const bool given = (s.corner_bits[c] & s.kept_bits & kEdgeGiven) != 0;
        if (!in_need || given || flip_displacement(pp, qq, uu, vv) > rules.need) return {Verdict::kept, {}};
    }
    FreeFlip free;
    if (patches != nullptr) {
        const bool crowded = report.splits > kCrowd * static_cast<int64_t>(s.first_split) + kFewSplits;
        const MovementLimit need{rules.need, rules.need, true};
        if (rules.texture && !in_need && !patches->together(face_of(c), face_of(t))) return {Verdict::kept, {}};
        free = judge_free_flip(s, *patches, c, in_need || crowded ? need : rules.free_movement, in_need);
        if (!free.allowed()) return {Verdict::kept, {}};
    } else if (rules.min_turn_cosine > -1.5 && !turns_little(p, q, u, v))
        return {Verdict::guarded, {}};
    if (u == v || s.adjacent(u, v)) return {Verdict::unflippable, {}};
    if (!in_need && (zero_area(pp, vv, uu) || zero_area(qq, uu, vv))) return {Verdict::guarded, {}};
    return {Verdict::flip, free};
}

// The guard: no new normal may differ from an old one by more than the limit.
bool Loop::turns_little(int32_t p, int32_t q, int32_t u, int32_t v) const {
    const Vec3 &pp = s.at(p), &qq = s.at(q), &uu = s.at(u), &vv = s.at(v);
    const Vec3 old_normals[2] = {cross(qq - pp, uu - pp), cross(pp - qq, vv - qq)};
    const Vec3 new_normals[2] = {cross(vv - pp, uu - pp), cross(uu - qq, vv - qq)};
    for (const Vec3& a : old_normals)
        for (const Vec3& b : new_normals) {
            const double sizes = length(a) * length(b);
            if (sizes > 0 && dot(a, b) < rules.min_turn_cosine * sizes) return false;
        }
    return true;
}

void Loop::do_flip(int32_t c, const FreeFlip& free) {
    const int32_t t = s.twin(c);
    s.flip(c);
    ++(splitting ? report.flips_after : report.flips);
    if (patches != nullptr) {
        report.moved_within_tolerance += free.kind == FreeFlip::moves ? 1 : 0;
        book_free_flip(s, *patches, c, free);
    }
    look_at(c);
    look_at(prev_corner(c));
    look_at(t);
    look_at(prev_corner(t));
}

// -- splits

Status Loop::do_split(int32_t c, Verdict verdict) {
    if (trial.running && (trial.splits_left-- == 0 || is_cut(s.twin(c)))) return trial.failed = true, DELMESH_OK;
    splitting = true;
    const int32_t p = s.vert(c), q = s.head(c);
    if (!s.is_part() && s.vertices_in_use() >= rules.max_vertices)
        return context.fail(DELMESH_ERROR_VERTEX_LIMIT,
                            "The limit of %lld vertices was reached with edges still to split (edge %d-%d).",
                            static_cast<long long>(rules.max_vertices), p, q);
    if (!s.is_part() && s.corners() > std::numeric_limits<int32_t>::max() - 6 * kMostSheets)
        return context.fail(DELMESH_ERROR_TOO_LARGE, "The result had more than 2^31 corners.");
    double tp, tq;
    const int32_t carrier = s.carrier_of(p, q, tp, tq);
    const Carrier line = s.carriers[carrier];
    const bool at_original = s.is_original(p) || s.is_original(q);
    const bool spiralling = s.carrier_splits[carrier] >= (at_original ? kPatienceAtVertex : kPatience);
    SplitPlan plan;
    if (rules.shells || spiralling) {
        // Measured from an original vertex where there is one, as the paper says.
        const double edge = length(s.at(q) - s.at(p));
        const double fraction = shell_fraction(edge, rules.shell_unit);
        plan.t[plan.count++] = s.is_original(p) ? fraction : 1 - fraction;
    } else
        plan_split(s, patches, rules.boundary_rule, rules.effort > 0, rules.resolution, c, plan);
    if (trial.running && plan.equals > 0) { // another place that is as good
        const int64_t i = random_below(plan.equals);
        plan.t[0] = plan.from[i] + random_unit() * (plan.to[i] - plan.from[i]);
    }
    for (const double t : {0.5, 0.4, 0.6, 0.3, 0.7, 0.2, 0.8, 0.1, 0.9})
        if (plan.count < SplitPlan::kMost) plan.t[plan.count++] = t;
    const auto place = [&](double fraction) {
        const double t = tp + fraction * (tq - tp);
        return SplitVertex{carrier, t, point_between(s.exact(line.a), s.exact(line.b), t),
                           1 + std::max(s.depth(line.a), s.depth(line.b))};
    };
    const auto commit_if_it_fits = [&](const SplitVertex& where, double rounding) {
        const Vec3 position = round_to(rules.precision, where.exact);
        if (!(length(position - where.exact) <= rounding) || !fits(c, position)) return false;
        commit_split(c, where, position, verdict);
        return true;
    };
    // Where the surface has come so far that a coarse rounding would break the tolerance, a place near by is rounded better.
    const double spare = spare_for_rounding(c);
    const double unit = rules.resolution / length(s.at(q) - s.at(p));
    for (int i = 0; i < plan.count && spare < std::numeric_limits<double>::infinity(); ++i)
        for (const double step : {0.0,  0.37,  -0.37, 0.74,  -0.74, 1.11,  -1.11, 1.48,  -1.48, 1.85, -1.85,
                                  2.22, -2.22, 2.59,  -2.59, 2.96,  -2.96, 3.33,  -3.33, 3.7,   -3.7})
            if (plan.t[i] + step * unit > 0 && plan.t[i] + step * unit < 1 &&
                commit_if_it_fits(place(plan.t[i] + step * unit), spare))
                return DELMESH_OK;
    for (int i = 0; i < plan.count; ++i)
        if (commit_if_it_fits(place(plan.t[i]), std::numeric_limits<double>::infinity())) return DELMESH_OK;
    if (s.carrier_splits[carrier] == 0) s.release_carrier(carrier);
    if (trial.running || s.is_part()) return defer(entry(c)), DELMESH_OK;
    if (make_room(c)) return DELMESH_OK;
    return context.fail(DELMESH_ERROR_PRECISION,
                        "The output precision has no room for a vertex between vertices %d and %d of face %d.", p, q,
                        s.face_src[face_of(c)]);
}

// How far from its place on c a split vertex may be rounded to; infinity where any rounding will do.
double Loop::spare_for_rounding(int32_t c) const {
    const double any = std::numeric_limits<double>::infinity();
    if (patches == nullptr) return any;
    const int32_t t = s.twin(c);
    double moved = patches->moved(face_of(c));
    if (t >= 0) moved = std::max(moved, patches->moved(face_of(t)));
    if (is_cut(t))
        for (int32_t slot = s.cut_slots[cut_slot(t)].next; slot != cut_slot(t); slot = s.cut_slots[slot].next)
            moved = std::max(moved, patches->moved(face_of(s.cut_slots[slot].corner)));
    return moved > rules.free_movement.anywhere && moved < rules.free_movement.rounded ? rules.free_movement.rounded - moved
                                                                                       : any;
}

// May a vertex be put there on c and on all its copies: no face without area, no vertex on another of the faces?
bool Loop::fits(int32_t c, const Vec3& x) const {
    if (!is_finite(x)) return false;
    const auto fits_face = [&](int32_t k) {
        return !zero_area(s.at(s.vert(k)), x, s.at(s.apex(k))) && !zero_area(x, s.at(s.head(k)), s.at(s.apex(k)));
    };
    const int32_t t = s.twin(c);
    if (t >= 0) return fits_face(c) && fits_face(t);
    if (!is_cut(t)) return fits_face(c);
    const int32_t start = cut_slot(t);
    int32_t slot = start;
    do {
        if (!fits_face(s.cut_slots[slot].corner)) return false;
        slot = s.cut_slots[slot].next;
    } while (slot != start);
    return true;
}

void Loop::commit_split(int32_t c, const SplitVertex& where, const Vec3& position, Verdict verdict) {
    if (s.is_boundary(c))
        ++report.boundary_splits;
    else if (s.is_kept(c))
        ++report.kept_splits;
    else if (verdict == Verdict::guarded)
        ++report.guarded;
    else if (verdict == Verdict::unflippable)
        count_unflippable(c);
    s.split_everywhere(c, position, where, pieces);
    report.splits += pieces.size();
    if (trial.running)
        trial_made.push_back(s.head(c));
    else if (shrinks())
        add_own(s.head(c));
    for (const int32_t piece : pieces) {
        const int32_t across = next_corner(piece);        // s -> apex
        const int32_t tail = next_corner(s.twin(across)); // of apex -> s: s -> head
        spread(piece, tail);
        look_at(piece);
        look_at(tail);
        look_at(across);
        look_at(prev_corner(piece));
        look_at(next_corner(tail));
        const int32_t back = s.twin(piece);
        if (back < 0) continue;
        const int32_t other = s.twin(tail); // q -> s
        spread(other, back);
        look_at(next_corner(other));
        look_at(prev_corner(other));
        look_at(next_corner(back));
    }
}
void Loop::spread(int32_t from, int32_t to) {
    if (patches != nullptr) patches->spread(face_of(from), face_of(to));
}

void Loop::count_unflippable(int32_t c) {
    const int32_t t = s.twin(c);
    const int32_t p = s.vert(c), q = s.head(c), u = s.apex(c), v = s.apex(t);
    ++report.unflippable;
    const int faces = 2 + (u != v && s.has_face(u, v, p) ? 1 : 0) + (u != v && s.has_face(u, v, q) ? 1 : 0);
    ++(faces == 2 ? report.unflippable_2 : faces == 3 ? report.unflippable_3 : report.unflippable_4);
}

Status make_delaunay(Context& context, Surface& surface, FlatPatches* patches, const DelaunayRules& rules,
                     delmesh_remesh_report& report) {
    return Loop(context, surface, patches, rules, report).run();
}

} // namespace dm
