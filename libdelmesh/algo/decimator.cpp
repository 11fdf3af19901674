// SPDX-License-Identifier: Apache-2.0
#include "algo/decimator.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "algo/parallel_slices.h"
#include "base/box.h"
#include "geom/angle.h"
#include "geom/predicates.h"

namespace dm {
Decimator::Decimator(Context& context_, Surface& surface, const DecimationRules& rules_)
    : wedges(context_.memory()), merged_into(context_.memory()), next_merged(context_.memory()), last_merged(context_.memory()),
      place_of(context_.memory()), context(context_), s(surface), rules(rules_), verts(context_.memory()),
      quadrics(context_.memory()), queue(context_.memory()), to_flip(context_.memory()), flipped(context_.memory()),
      changed(context_.memory()) {}

Status Decimator::begin(const double* vert_weights, const uint8_t* locked_verts) {
    const int32_t all = s.vertices(), faces = s.faces();
    Box box;
    vertices_left = 0;
    DM_TRY(context.progress(0));
    for (int32_t v = 0; v < all; ++v) {
        if (s.vert_corner[v] < 0) continue;
        ++vertices_left;
        box.extend(s.at(v));
    }
    faces_left = faces - s.dead_faces;
    origin = 0.5 * (box.lo + box.hi);
    // Errors are areas times squared lengths: in units of the model's size they are numbers that a float32 can hold.
    const double size_of_all = box.longest_side();
    const double unit = 1 / (size_of_all * size_of_all) / (size_of_all * size_of_all);
    flip_weight = rules.flip_weight * unit;
    DM_TRY(fill(context, verts, all, Vertex{}));
    DM_TRY(fill(context, quadrics, all, Quadric{}));
    DM_TRY(fill(context, next_merged, all, -1));
    for (Array<int32_t>* each : {&merged_into, &last_merged, &place_of}) {
        each->resize_uninitialized(all);
        for (int32_t v = 0; v < all; ++v) (*each)[v] = v;
    }
    DM_TRY(context.progress(0));
    // Only their ratios matter, and the queue has a range.
    const double most_weight = vert_weights == nullptr || all == 0 ? 1 : *std::max_element(vert_weights, vert_weights + all);
    Array<uint8_t> special(context.memory(), all, 0);
    for (const EdgeBits bits : s.corner_bits) has_marks |= (bits & (s.kept_bits | kEdgeFrozen)) != 0;
    for (int32_t f = 0; f < faces; ++f) {
        if ((f & 0xffff) == 0) DM_TRY(context.progress(0.3 * f / faces));
        if (s.is_dead(f)) continue;
        const int32_t v[3] = {s.vert(3 * f), s.vert(3 * f + 1), s.vert(3 * f + 2)};
        const Vec3 x[3] = {s.at(v[0]) - origin, s.at(v[1]) - origin, s.at(v[2]) - origin};
        const Vec3 n = cross(x[1] - x[0], x[2] - x[0]);
        const double size = length(n);
        if (!(size > 0)) continue;
        const Vec3 normal = (1 / size) * n;
        const Quadric q = Quadric::of_plane(normal, x[0], unit * size / 6);
        for (const int32_t w : v) quadrics[w] += q;
        for (int k = 0; k < 3; ++k) {
            const int32_t c = 3 * f + k;
            if (s.is_frozen(c)) special[v[k]] = special[v[(k + 1) % 3]] = 255;
            has_lines |= s.is_kept(c);
            if (!s.is_boundary(c) && !s.is_kept(c)) continue;
            const int32_t a = v[k], b = v[(k + 1) % 3];
            if (is_cut(s.twin(c))) special[a] = special[b] = 255;
            for (const int32_t w : {a, b})
                if (s.is_boundary(c) || c < s.twin(c)) special[w] = static_cast<uint8_t>(std::min(255, special[w] + 1));
            const Vec3 along = x[(k + 1) % 3] - x[k], across = cross(along, normal);
            const double l = length(across);
            if (!(l > 0)) continue;
            const Quadric edge = Quadric::of_plane((1 / l) * across, x[k], unit * rules.boundary_weight * l * l);
            quadrics[a] += edge;
            quadrics[b] += edge;
        }
    }
    for (int32_t v = 0; v < all; ++v) {
        verts[v].locked = special[v] == 255 || (locked_verts != nullptr && locked_verts[v] != 0);
        verts[v].kind = verts[v].locked ? Kind::corner : kind_among(special[v]);
        if (vert_weights != nullptr) quadrics[v] *= vert_weights[v] / most_weight;
    }
    if (wedges.has_values()) DM_TRY(wedges.add_faces(context, s, origin, unit / most_weight, size_of_all, vert_weights));
    return fill_queue();
}

Status Decimator::fill_queue() {
    queue.begin((s.vertices() >> kPartBits) + 1, (s.corners() / 3 - s.dead_faces) * 3 / 2);
    return sweep();
}

// The lines at a vertex merge and end as the mesh gets coarser. Whoever has fewer of them now may do more; its edges are looked at
// again.
void Decimator::find_kind_again(int32_t v) {
    Vertex& vert = verts[v];
    if (vert.kind == Kind::smooth || vert.locked) return;
    const int32_t start = s.vert_corner[v];
    int lines = 0;
    int32_t c = start;
    do {
        lines += s.is_boundary(c) || s.is_kept(c);
        const int32_t last = prev_corner(c);
        c = s.twin(last);
        lines += c < 0;
    } while (c >= 0 && c != start);
    const Kind kind = kind_among(lines);
    if (kind == vert.kind) return;
    vert.kind = kind;
    ++vert.version;
    push_around(v);
}

// Which of the two is it, and may it be at all?
bool Decimator::ends_may_merge(int32_t c, bool& stays_at_p, bool& stays_at_q) const {
    const Kind p = verts[s.vert(c)].kind, q = verts[s.head(c)].kind;
    stays_at_p = stays_at_q = false;
    if (p == Kind::smooth && q == Kind::smooth) return true;
    const bool along = s.is_boundary(c) || s.is_kept(c);
    if (p == Kind::corner) return stays_at_p = true, q == Kind::smooth || (q == Kind::crease && along);
    if (q == Kind::corner) return stays_at_q = true, p == Kind::smooth || (p == Kind::crease && along);
    if (p == Kind::crease && q == Kind::crease) return along;
    (p == Kind::crease ? stays_at_p : stays_at_q) = true;
    return true;
}

Vec3 Decimator::optimum(const Quadric& q, int32_t p_vert, int32_t q_vert) const {
    const Vec3 &a = s.at(p_vert), &b = s.at(q_vert);
    const Vec3 middle = 0.5 * (a + b);
    Vec3 w;
    if (!q.least(middle - origin, kStiffness, w)) return middle;
    w = w + origin;
    if (!(length_squared(w - middle) <= 4 * length_squared(b - a))) w = middle;
    if (verts[p_vert].kind != Kind::crease) return w;
    // On boundaries and kept edges the stiffness may have pulled away from a corner. (Inside that does not matter as much, and the
    // middle leaves better triangles.)
    double least = 0.01 * q.at(w - origin) - 1e-12 * (q.xx + q.yy + q.zz) * length_squared(b - a);
    for (const Vec3& end : {a, b}) {
        const double at_end = q.at(end - origin);
        if (at_end < least) least = at_end, w = end;
    }
    return w;
}

void Decimator::push(int32_t c) {
    bool at_p, at_q;
    if (!ends_may_merge(c, at_p, at_q)) {
        ++refusals[DELMESH_STOPPED_BY_FEATURES];
        return;
    }
    const int32_t p = s.vert(c), q = s.head(c);
    const Quadric sum = merged(c);
    const Vec3 w = at_p ? s.at(p) : at_q ? s.at(q) : optimum(sum, p, q);
    enqueue(BucketQueue<Entry>::bucket(sum.at(w - origin)), {c, p, q, stamp_of(p, q), kNothing});
}

void Decimator::push_around(int32_t v) {
    const int32_t start = s.vert_corner[v];
    int32_t c = start;
    do {
        push(c);
        const int32_t last = prev_corner(c);
        c = s.twin(last);
        if (c < 0) push(last);
    } while (c >= 0 && c != start);
}

// The edge of an entry, or -1 if it is gone or has changed.
int32_t Decimator::find(const Entry& e) const {
    if (stamp_of(e.p, e.q) != e.stamp) return -1;
    if (s.vert(e.corner) == e.p && s.head(e.corner) == e.q) return e.corner;
    const int32_t start = s.vert_corner[e.p];
    if (start < 0) return -1;
    int32_t c = start;
    do {
        if (s.head(c) == e.q) return c;
        const int32_t last = prev_corner(c);
        c = s.twin(last);
        if (c < 0 && s.vert(last) == e.q) return last;
    } while (c >= 0 && c != start);
    return -1;
}

// Every edge that is there goes into the queue.
Status Decimator::sweep() {
    std::fill(refusals, refusals + 5, 0);
    for (int32_t c = 0; c < s.corners(); ++c) {
        if ((c & 0x1ffff) == 0) DM_TRY(context.progress(1));
        if (!s.is_dead(face_of(c)) && s.twin(c) < c) push(c);
    }
    return DELMESH_OK;
}

// Finds the edges of entries, and has what their collapses will look at brought from memory: at each step what the one before has
// brought leads to the next, for all entries at a time.
void Decimator::ask_for(const Entry* entries, int count, int32_t* corners) const {
    for (int i = 0; i < count; ++i) {
        __builtin_prefetch(&verts[entries[i].p]);
        __builtin_prefetch(&verts[entries[i].q]);
        __builtin_prefetch(&s.corner_vert[entries[i].corner]);
    }
    for (int i = 0; i < count; ++i) {
        corners[i] = find(entries[i]);
        if (corners[i] < 0) continue;
        for (const int32_t v : {entries[i].p, entries[i].q}) {
            __builtin_prefetch(&quadrics[v]);
            __builtin_prefetch(&quadrics[v].c);
            __builtin_prefetch(&s.pos[v]);
            __builtin_prefetch(&s.vert_corner[v]);
        }
        __builtin_prefetch(&s.corner_twin[corners[i]]);
    }
    for (int i = 0; i < count; ++i) {
        if (corners[i] < 0) continue;
        for (const int32_t side : {corners[i], s.twin(corners[i])}) {
            if (side < 0) continue;
            for (const int32_t beyond : {s.twin(next_corner(side)), s.twin(prev_corner(side))}) {
                if (beyond < 0) continue;
                __builtin_prefetch(&s.corner_twin[beyond]);
                __builtin_prefetch(&s.corner_vert[beyond]);
            }
        }
    }
}

void Decimator::rest() {
    queue.free_storage();
    Array<Quadric> left(context.memory());
    left.reserve(vertices_left);
    for (int32_t v = 0; v < s.vertices(); ++v)
        if (s.vert_corner[v] >= 0) left.push_back(quadrics[v]);
    quadrics = std::move(left);
}

Status Decimator::wake() {
    if (queue.has_begun()) return DELMESH_OK;
    Array<Quadric> again(context.memory());
    DM_TRY(fill(context, again, s.vertices(), Quadric{}));
    int64_t next = 0;
    for (int32_t v = 0; v < s.vertices(); ++v)
        if (s.vert_corner[v] >= 0) again[v] = quadrics[next++];
    quadrics = std::move(again);
    return fill_queue();
}

Status Decimator::run(int64_t most_vertices, int64_t most_faces) {
    constexpr int kBatch = 16;
    const double from = static_cast<double>(vertices_left);
    const double to = static_cast<double>(std::max<int64_t>(0, std::min(most_vertices, most_faces / 2)));
    const auto reached = [&] { return vertices_left <= most_vertices && faces_left <= most_faces; };
    const auto wanted = [&] { return std::max(vertices_left - most_vertices, (faces_left - most_faces) / 2); };
    int64_t at_sweep = -1;
    stopped_by = DELMESH_STOPPED_BY_TARGET;
    int64_t look_at = guard == nullptr && has_lines ? vertices_left : -1; // a guard says itself what is out of proportion
    while (!reached()) {
        if (vertices_left <= look_at) {
            constexpr int64_t kMany = 4; // one of them for so many vertices
            const int64_t held = lines_that_hold_back();
            if (kMany * held > vertices_left) {
                stopped_by = DELMESH_STOPPED_BY_FEATURES;
                return DELMESH_OK;
            }
            // The last collapses before that are the worst ones, so it is looked for more often when it is near.
            look_at = vertices_left - 1 - vertices_left / (2 * kMany * held > vertices_left ? 128 : 16);
        }
        DM_TRY(context.progress((from - static_cast<double>(vertices_left)) / (from - to + 1)));
        const int rounds_between = guard != nullptr ? 1 : 64; // a guard may take milliseconds for one collapse
        for (int rounds = 0; rounds < rounds_between && vertices_left > look_at && !reached(); ++rounds) {
            // A few at a time, so that what they need is on its way from memory while others are looked at.
            Entry batch[kBatch];
            int32_t buckets[kBatch];
            const int count = queue.pop(wanted(), buckets, batch, guard != nullptr ? 1 : kBatch);
            if (count == 0) {
                // What was refused may be possible by now.
                // A guard looks hard at all of that, so not for a few more.
                const int64_t worth_it = guard != nullptr ? 1 + vertices_left / 50 : 1;
                if (at_sweep >= 0 && counts.collapses - at_sweep < worth_it) {
                    stopped_by = static_cast<int32_t>(std::max_element(refusals + 1, refusals + 5) - refusals);
                    return DELMESH_OK;
                }
                at_sweep = counts.collapses;
                DM_TRY(sweep());
                continue;
            }
            int32_t corners[kBatch];
            ask_for(batch, count, corners);
            for (int i = 0; i < count; ++i) {
                if (corners[i] < 0) continue;
                if (reached())
                    enqueue(buckets[i], batch[i]);
                else if ((corners[i] = find(batch[i])) >= 0) // the batch's first may have changed it
                    attempt(corners[i], static_cast<Tried>(batch[i].tried), buckets[i]);
            }
        }
    }
    return DELMESH_OK;
}

// Kept edges may not be flipped, so lines that are close to each other cannot get coarser than they are far apart. What the rest is
// made to pay for that is out of proportion where many of them would have gone long ago. Features by their angle end a run as soon as
// that shows; what came with the mesh, such as a texture's seams, has to be paid for, and does only where the surface is about to go.
int64_t Decimator::lines_that_hold_back() const {
    constexpr double kCheap = 0.01; // of the dearest collapse: a tenth of the distance
    constexpr double kSeen = 1e-12; // a thousandth of the model's size over a millionth of its square; below that it may be noise
    constexpr double kFar =
        1e-5; // a distance of 0.3 % of the model's size, squared, for each vertex's share of a square of that size
    if (cost < kSeen) return 0;
    const bool is_far = cost * static_cast<double>(vertices_left) > kFar;
    int64_t held = 0;
    for (int32_t c = 0; c < s.corners(); ++c) {
        const bool looked_at = (s.corner_bits[c] & kEdgeFeature) != 0 || (is_far && s.is_kept(c));
        if (!looked_at || s.twin(c) < c || s.is_dead(face_of(c))) continue;
        const Vertex &p = verts[s.vert(c)], &q = verts[s.head(c)];
        if (p.kind == Kind::corner && q.kind == Kind::corner) continue; // that is what corners are for
        const Quadric sum = merged(c);
        const double at_p = sum.at(s.at(s.vert(c)) - origin), at_q = sum.at(s.at(s.head(c)) - origin);
        const double error = p.kind == Kind::corner ? at_p : q.kind == Kind::corner ? at_q : std::min(at_p, at_q);
        held += error < kCheap * cost;
    }
    return held;
}

Status Decimator::prune(double diagonal, int64_t& pruned) {
    pruned = 0;
    if (!(diagonal > 0)) return DELMESH_OK;
    Memory& memory = context.memory();
    Array<uint8_t> seen(memory, s.faces(), 0);
    Array<int32_t> faces(memory), starts(memory); // of all components, one after the other
    for (int32_t first = 0; first < s.faces(); ++first) {
        if (seen[first] != 0 || s.is_dead(first)) continue;
        starts.push_back(static_cast<int32_t>(faces.size()));
        seen[first] = 1;
        faces.push_back(first);
        for (int64_t next = starts.back(); next < faces.size(); ++next) {
            if ((next & 0xffff) == 0) DM_TRY(context.progress(0));
            for (int32_t k = 0; k < 3; ++k) {
                const int32_t t = s.twin(3 * faces[next] + k);
                if (t < 0 || seen[face_of(t)] != 0) continue;
                seen[face_of(t)] = 1;
                faces.push_back(face_of(t));
            }
        }
    }
    const int64_t components = starts.size();
    starts.push_back(static_cast<int32_t>(faces.size()));
    Array<double> sizes(memory, components);
    int64_t largest = 0;
    for (int64_t i = 0; i < components; ++i) {
        Box box;
        bool stays = false; // so do the sheets of a cut edge
        for (int32_t n = starts[i]; n < starts[i + 1]; ++n) {
            if ((n & 0xffff) == 0) DM_TRY(context.progress(0));
            for (int32_t k = 3 * faces[n]; k < 3 * faces[n] + 3; ++k) {
                box.extend(s.at(s.vert(k)));
                stays |= s.is_frozen(k) || is_cut(s.twin(k)) || verts[s.vert(k)].locked;
            }
        }
        sizes[i] = stays ? HUGE_VAL : box.diagonal();
        if (sizes[i] > sizes[largest]) largest = i;
    }
    Array<int32_t> component(memory);
    for (int64_t i = 0; i < components; ++i) {
        if (i == largest || !(sizes[i] < diagonal)) continue;
        component.clear();
        for (int32_t n = starts[i]; n < starts[i + 1]; ++n) component.push_back(faces[n]);
        for (const int32_t f : component)
            for (int32_t k = 3 * f; k < 3 * f + 3; ++k) {
                const int32_t v = s.vert(k);
                if (s.vert_corner[v] != k) continue;
                ++verts[v].version;
                --vertices_left;
            }
        s.remove_component(component);
        faces_left -= component.size();
        ++pruned;
    }
    return DELMESH_OK;
}

void Decimator::attempt(int32_t c, Tried tried, int32_t bucket) {
    constexpr double kNever = std::numeric_limits<double>::infinity();
    bool at_p, at_q;
    if (!ends_may_merge(c, at_p, at_q)) return;
    Star star;
    if (!gather(c, star)) {
        ++refusals[DELMESH_STOPPED_BY_TOPOLOGY];
        return;
    }
    const int32_t p = s.vert(c), q = s.head(c);
    const Quadric sum = merged(c);
    const Vec3 a = s.at(p), b = s.at(q);
    Place best;
    best.cost = kNever;
    guard_refused = false;
    const auto consider = [&](const Vec3& where) {
        const Vec3 w = round_to(rules.precision, where);
        if (!is_finite(w)) return;
        if (guard != nullptr && guard->is_beyond(w, face_of(c))) {
            guard_refused = true;
            return;
        }
        const double error = sum.at(w - origin);
        if (error >= best.cost) return;
        const Trial trial = try_place(star, w);
        if (!trial.possible || (trial.nld != 0 && !rules.flips)) return;
        const double total = error + flip_weight * trial.flips;
        if (total < best.cost && total < BucketQueue<Entry>::kLargest) best = {w, total, trial};
    };
    const auto good_enough = [&] { return BucketQueue<Entry>::bucket(best.cost / rules.slack) <= bucket; };
    const auto postpone = [&](double cost_now, Tried known) {
        ++counts.postponed;
        const Entry again{c, p, q, stamp_of(p, q), known};
        enqueue(std::max(bucket + 1, BucketQueue<Entry>::bucket(cost_now)), again); // below infinity's, as cost_now is
    };
    if (at_p || at_q) {
        consider(at_p ? a : b);
    } else {
        const Vec3 least = keep_volume(star, sum, optimum(sum, p, q));
        if (rules.optimum) consider(least);
        // The other places take longer. Most entries change before they are met again.
        if (tried == kNothing && best.cost < kNever && !good_enough()) return postpone(best.cost, kOptimum);
        Vec3 allowed;
        if (rules.region && !good_enough() && best_allowed(star, sum, least, allowed)) consider(allowed);
        if (rules.ends && !good_enough()) {
            consider(a);
            consider(b);
        }
        if (rules.middle && !good_enough()) consider(0.5 * (a + b));
    }
    if (best.cost < kNever) {
        if (!good_enough()) return postpone(best.cost, kOptimum);
        double total = best.cost;
        const double most = rules.slack * std::max(rules.slack * best.cost, BucketQueue<Entry>::end_of(bucket));
        guard_refused = false;
        if (commit(star, best, most, total)) return;
        if (total < BucketQueue<Entry>::kLargest) return postpone(total, kOptimum);
        // The guard, a fold, or a flip that may not be, objects to the place, perhaps not to the collapse.
        const Vec3 refused = best.at;
        double least = kNever;
        const Vec3 places[3] = {a, b, 0.5 * (a + b)};
        for (int i = 0; i < 3 && !at_p && !at_q; ++i) {
            if (!(i < 2 ? rules.ends : rules.middle)) continue;
            best.cost = kNever;
            consider(places[i]);
            if (best.cost == kNever || best.at == refused) continue;
            if (!good_enough())
                least = std::min(least, best.cost);
            else if (commit(star, best, most, total))
                return;
        }
        if (least < kNever) return postpone(least, kOptimum);
    }
    ++refusals[guard_refused ? DELMESH_STOPPED_BY_BOUND : DELMESH_STOPPED_BY_DELAUNAY];
}

// Collapses the edge, and flips what is not Delaunay then. If that costs more than `most`, or cannot be, everything is as before,
// and `total` is what it would have cost, as far as it came; infinity if it cannot be.
bool Decimator::commit(const Star& star, const Place& place, double most, double& total) {
    if (folds(star, place.at)) return total = std::numeric_limits<double>::infinity(), false;
    const int32_t c = star.c, p = s.vert(c), q = s.head(c);
    const Vec3 before = s.at(p), at_q = s.at(q);
    const int32_t apexes[2] = {s.apex(c), s.twin(c) < 0 ? -1 : s.apex(s.twin(c))};
    const bool needs_flips = place.trial.nld != 0, may_fail = needs_flips || guard != nullptr;
    if (may_fail) s.begin_trial();
    const int32_t t = s.twin(c), gone = t < 0 ? 1 : 2;
    for (int i = 0; i < star.count; ++i) { // for push_around
        __builtin_prefetch(&verts[star.spokes[i].ring]);
        __builtin_prefetch(&quadrics[star.spokes[i].ring]);
        __builtin_prefetch(&quadrics[star.spokes[i].ring].c);
    }
    const Wedges::Sides sides = wedges.empty() ? Wedges::Sides{} : wedges.sides(s, c);
    s.collapse(c);
    s.pos[p] = place.at == before ? before : place.at == at_q ? at_q : place.at; // -0 is 0, but not its bits
    if (!wedges.empty()) wedges.merge(s, p, sides);
    flipped.clear();
    changed.clear();
    bool done = true;
    if (needs_flips) {
        to_flip.clear();
        for (int i = 0; i < star.count; ++i) {
            to_flip.push_back(star.spokes[i].corner);
            to_flip.push_back(next_corner(star.spokes[i].corner));
        }
        const double error = place.cost - flip_weight * place.trial.flips;
        double moved = 0;
        done = flip_until_delaunay((most - error) / flip_weight, moved);
        total = error + flip_weight * moved;
    }
    if (done && guard != nullptr) {
        changed.push_back(face_of(c));
        if (t >= 0) changed.push_back(face_of(t));
        for (int i = 0; i < star.count; ++i) changed.push_back(face_of(star.spokes[i].corner));
        if (!guard->accept(changed)) {
            done = false;
            total = std::numeric_limits<double>::infinity();
            guard_refused = true;
        }
    }
    if (may_fail && !done) {
        s.undo_trial();
        s.pos[p] = before;
        wedges.undo();
        ++counts.undone;
        return false;
    }
    if (may_fail) s.keep_trial();
    quadrics[p] += quadrics[q];
    wedges.keep();
    verts[p].kind = std::max(verts[p].kind, verts[q].kind);
    verts[p].locked |= verts[q].locked;
    ++verts[p].version;
    ++verts[q].version;
    merged_into[q] = p;
    next_merged[last_merged[p]] = q;
    last_merged[p] = last_merged[q];
    if (!(place.at == before)) place_of[p] = place.at == at_q ? place_of[q] : -1;
    --vertices_left;
    faces_left -= gone;
    ++counts.collapses;
    counts.flips += flipped.size();
    if (place.cost > cost) cost = place.cost;
    push_around(p);
    for (const int32_t k : flipped)
        if (s.vert(k) != p && s.head(k) != p) push(k);
    if (verts[p].kind != Kind::smooth) // no line is near otherwise
        for (const int32_t v : {p, apexes[0], apexes[1]})
            if (v >= 0) find_kind_again(v);
    return true;
}

// The edges of to_flip, and what flipping them makes NLD. moved: as moved_by_flip, in all; infinity where a flip may not be.
bool Decimator::flip_until_delaunay(double budget, double& moved) {
    constexpr int64_t kMostFlips = 64;
    constexpr double kNever = std::numeric_limits<double>::infinity();
    while (!to_flip.empty()) {
        const int32_t c = to_flip.pop_back(), t = s.twin(c);
        const int32_t p = s.vert(c), q = s.head(c), u = s.apex(c);
        const Vec3 &a = s.at(p), &b = s.at(q), &x = s.at(u);
        if (s.is_frozen(c)) continue;
        if (t < 0) {
            if (rules.boundary_rule && boundary_edge_is_nld(a, b, x)) return moved = kNever, false;
            continue;
        }
        const int32_t v = s.apex(t);
        const Vec3& y = s.at(v);
        if (!edge_is_nld(a, b, x, y)) continue;
        if (s.is_kept(c) || flipped.size() == kMostFlips || u == v || s.adjacent(u, v)) return moved = kNever, false;
        const Vec3 old_normals[2] = {cross(b - a, x - a), cross(a - b, y - b)};
        const Vec3 new_normals[2] = {cross(y - a, x - a), cross(x - b, y - b)};
        for (const Vec3& m : new_normals)
            for (const Vec3& n : old_normals)
                if (!turns_less(m, n, rules.fold_cosine)) return moved = kNever, false;
        if (zero_area(a, y, x) || zero_area(b, x, y) || flip_folds(c)) return moved = kNever, false;
        moved += moved_by_flip(a, b, x, y);
        if (!wedges.empty())
            moved += wedges.moved_by_flip(wedges.stand(s, c), wedges.stand(s, t), wedges.stand(s, prev_corner(c)),
                                          wedges.stand(s, prev_corner(t)));
        if (moved > budget) return false;
        if (!wedges.empty()) wedges.flip(s, c);
        s.flip(c);
        changed.push_back(face_of(c));
        changed.push_back(face_of(t));
        flipped.push_back(next_corner(c));
        to_flip.push_back(c);
        to_flip.push_back(prev_corner(c));
        to_flip.push_back(t);
        to_flip.push_back(prev_corner(t));
    }
    return true;
}

} // namespace dm
