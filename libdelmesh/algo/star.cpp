// SPDX-License-Identifier: Apache-2.0
// What is around an edge, gathered once, so that places for the merged vertex can be tried without touching the surface.
#include "algo/decimator.h"
#include "geom/predicates.h"

namespace dm {

// The ring around the edge, counter-clockwise: from v along q's faces to u, then along p's back to v. Where one of them is on the
// boundary, the star is open and begins there.
bool Decimator::gather(int32_t c, Star& star) const {
    const int32_t t = s.twin(c);
    star.c = c;
    star.count = 0;
    star.open = t < 0;
    const auto add = [&](int32_t k) {
        if (star.count == kMostSpokes) return false;
        star.spokes[star.count++].corner = k;
        // What is read below is asked for here, while the walk waits for its next step.
        const int32_t beyond = s.twin(next_corner(k));
        if (beyond >= 0) __builtin_prefetch(&s.corner_vert[beyond]);
        if (has_marks) __builtin_prefetch(&s.corner_bits[k]);
        return true;
    };
    // From the corner after `k` counter-clockwise up to `end`, or the boundary; false if there are too many.
    const auto add_from = [&](int32_t k, int32_t end) {
        for (k = s.rotate(k); k != end && k >= 0; k = s.rotate(k))
            if (!add(k)) return false;
        return true;
    };
    // The corners before `end` back to the boundary.
    const auto add_before = [&](int32_t end) {
        const int32_t first = star.count;
        for (int32_t k = end; s.twin(k) >= 0;) {
            k = next_corner(s.twin(k));
            if (!add(k)) return false;
        }
        for (int32_t i = first, j = star.count - 1; i < j; ++i, --j) std::swap(star.spokes[i].corner, star.spokes[j].corner);
        return true;
    };
    const int32_t at_q = next_corner(c); // q -> u
    if (t < 0) {
        if (!add_before(at_q)) return false;
        if (!add_from(c, c)) return false;
    } else {
        const int32_t p = s.vert(c), q = s.head(c);
        const bool q_open = s.on_boundary(q), p_open = s.on_boundary(p);
        if (q_open && p_open) return false; // would pinch the boundary
        star.open = q_open || p_open;
        if (q_open) {
            if (!add_before(at_q)) return false;
            if (!add_from(c, next_corner(t))) return false;
            if (!add_from(t, at_q)) return false;
        } else if (p_open) {
            // p's faces behind t's, q's, p's up to the boundary
            if (!add_before(next_corner(t))) return false;
            if (!add_from(t, at_q)) return false;
            if (!add_from(c, next_corner(t))) return false;
        } else {
            if (!add_from(t, at_q)) return false;
            if (!add_from(c, next_corner(t))) return false;
        }
    }
    if (star.count < (star.open ? 1 : 3)) return false;
    // Every neighbour may appear once: those of both ends are the two apexes, where the faces of one follow those of the other.
    const int32_t p = s.vert(c), q = s.head(c);
    for (int i = 0; i < star.count; ++i) {
        Spoke& spoke = star.spokes[i];
        const int32_t k = spoke.corner;
        spoke.ring = s.head(k);
        const int32_t outer = next_corner(k), beyond = s.twin(outer);
        spoke.beyond = beyond < 0 ? -1 : s.apex(beyond);
        __builtin_prefetch(&s.pos[spoke.ring]);
        if (spoke.beyond >= 0) __builtin_prefetch(&s.pos[spoke.beyond]);
        spoke.kept = has_marks && s.is_kept(k);
        spoke.link_kept = has_marks && s.is_kept(outer);
        spoke.frozen = has_marks && s.is_frozen(k);
        spoke.link_frozen = has_marks && s.is_frozen(outer);
    }
    if (star.open) {
        Spoke& last = star.spokes[star.count];
        last.corner = -1;
        last.ring = s.apex(star.spokes[star.count - 1].corner);
        last.beyond = -1;
        last.kept = last.link_kept = last.link_frozen = false;
        last.frozen = has_marks && s.is_frozen(prev_corner(star.spokes[star.count - 1].corner));
        last.at_ring = s.at(last.ring);
    }
    const int spokes = star.count + (star.open ? 1 : 0);
    uint64_t met[4] = {0, 0, 0, 0}; // by their last bits: most are the first with these
    for (int i = 0; i < spokes; ++i) {
        const int32_t x = star.spokes[i].ring;
        if (x == p || x == q) return false;
        uint64_t& word = met[x >> 6 & 3];
        const uint64_t bit = uint64_t{1} << (x & 63);
        for (int j = 0; (word & bit) != 0 && j < i; ++j)
            if (star.spokes[j].ring == x) return false;
        word |= bit;
    }
    for (int i = 0; i < star.count; ++i) {
        Spoke& spoke = star.spokes[i];
        spoke.at_ring = s.at(spoke.ring);
        if (spoke.beyond >= 0) spoke.at_beyond = s.at(spoke.beyond);
    }
    for (int i = 0; i < star.count; ++i) {
        Spoke& spoke = star.spokes[i];
        const Vec3& x = s.at(s.vert(spoke.corner));
        // Where both edges of a vanishing face are the same spoke, either may be kept.
        const int before = star.before(i);
        if (has_marks && before >= 0 && s.vert(star.spokes[before].corner) != s.vert(spoke.corner)) {
            const int32_t k = prev_corner(star.spokes[before].corner);
            spoke.kept |= s.is_kept(k);
            spoke.frozen |= s.is_frozen(k);
        }
        spoke.normal = cross(spoke.at_ring - x, star.after(i).at_ring - x);
    }
    return true;
}

Decimator::Trial Decimator::try_place(const Star& star, const Vec3& w) const {
    // Of each face (w, a, b), which of its angles are surely acute. Every one of them is asked for, most of them are, and no edge
    // between two of these is NLD.
    enum : uint8_t { kAtPlace = 1, kAtRing = 2, kAtNext = 4 };
    uint8_t acute[kMostSpokes];
    Trial trial;
    Vec3 to_ring = star.spokes[0].at_ring - w;
    for (int i = 0; i < star.count; ++i) {
        const Spoke& spoke = star.spokes[i];
        const Spoke& next = star.after(i);
        const Vec3 to_next = next.at_ring - w;
        const Vec3 normal = cross(to_ring, to_next);
        if (!turns_less(normal, spoke.normal, rules.fold_cosine)) return trial;
        if (zero_area(w, spoke.at_ring, next.at_ring)) return trial;
        const Vec3 outer = next.at_ring - spoke.at_ring;
        acute[i] =
            static_cast<uint8_t>((surely_acute(to_ring, to_next) ? kAtPlace : 0) | (surely_acute(-to_ring, outer) ? kAtRing : 0) |
                                 (surely_acute(to_next, outer) ? kAtNext : 0));
        to_ring = to_next;
    }
    for (int i = 0; i < star.count; ++i) {
        const Spoke& spoke = star.spokes[i];
        const Spoke& next = star.after(i);
        // The outer edge of the face.
        const Vec3 &a = spoke.at_ring, &b = next.at_ring;
        if (spoke.beyond >= 0) {
            const Vec3& y = spoke.at_beyond;
            const bool surely_not = (acute[i] & kAtPlace) != 0 && surely_acute(a - y, b - y);
            if (!surely_not && !spoke.link_frozen && edge_is_nld_past_acute(a, b, w, y)) {
                if (spoke.link_kept) return trial;
                ++trial.nld;
                trial.flips += moved_by_flip(a, b, w, y);
                if (!wedges.empty()) {
                    const int32_t k = spoke.corner, outer = next_corner(k);
                    trial.flips +=
                        wedges.moved_by_flip(wedges.stand(s, outer), wedges.stand(s, prev_corner(k)),
                                             wedges.stand_after(s, star.c, k, w), wedges.stand(s, prev_corner(s.twin(outer))));
                }
            }
        } else if (rules.boundary_rule && !spoke.link_frozen && boundary_edge_is_nld(a, b, w))
            return trial;
        // The spoke.
        const int before = star.before(i);
        if (spoke.frozen) continue;
        if (before < 0) {
            if (rules.boundary_rule && boundary_edge_is_nld(w, a, b)) return trial;
        } else {
            const Vec3& o = star.spokes[before].at_ring;
            const bool surely_not = (acute[i] & kAtNext) != 0 && (acute[before] & kAtRing) != 0;
            if (!surely_not && edge_is_nld_past_acute(w, a, o, b)) {
                if (spoke.kept) return trial;
                ++trial.nld;
                trial.flips += moved_by_flip(w, a, o, b);
                if (!wedges.empty()) {
                    const int32_t k = spoke.corner;
                    trial.flips += wedges.moved_by_flip(wedges.stand_after(s, star.c, k, w), wedges.stand(s, next_corner(k)),
                                                        wedges.stand(s, next_corner(star.spokes[before].corner)),
                                                        wedges.stand(s, prev_corner(k)));
                }
            }
        }
    }
    if (star.open && rules.boundary_rule && !star.spokes[star.count].frozen &&
        boundary_edge_is_nld(w, star.spokes[star.count].at_ring, star.spokes[star.count - 1].at_ring))
        return trial;
    trial.possible = true;
    return trial;
}

// The cosine between the normals on both sides; 1 on the boundary.
double Decimator::bend(int32_t c) const {
    const int32_t t = s.twin(c);
    if (t < 0) return 1;
    const Vec3 &a = s.at(s.vert(c)), &b = s.at(s.head(c));
    return cosine_between(cross(b - a, s.at(s.apex(c)) - a), cross(a - b, s.at(s.apex(t)) - b));
}

// Every face may turn a little in every collapse, and after many of these the surface lies on itself. So no edge may become sharper
// than the limit where none is yet. Where one is, on blades, the next is as well.
bool Decimator::folds(const Star& star, const Vec3& w) const {
    double sharpest = kSharpest;
    const auto normal = [&](int i) { return cross(star.spokes[i].at_ring - w, star.after(i).at_ring - w); };
    Vec3 before = star.open ? Vec3{0, 0, 0} : normal(star.count - 1);
    for (int i = 0; i < star.count; ++i) {
        const Vec3 now = normal(i);
        look_at_bend(now, before, sharpest);
        const Vec3 &a = star.spokes[i].at_ring, &b = star.after(i).at_ring;
        if (star.spokes[i].beyond >= 0) look_at_bend(now, cross(a - b, star.spokes[i].at_beyond - b), sharpest);
        before = now;
    }
    if (sharpest == kSharpest) return false;
    double was = bend(star.c);
    for (int i = 0; i < star.count; ++i)
        for (int32_t k = star.spokes[i].corner, j = 0; j < 3; k = next_corner(k), ++j) was = std::min(was, bend(k));
    return was >= kSharpest;
}

// The same of a flip.
bool Decimator::flip_folds(int32_t c) const {
    const int32_t t = s.twin(c), around[4] = {next_corner(c), prev_corner(c), next_corner(t), prev_corner(t)};
    const Vec3 &a = s.at(s.vert(c)), &b = s.at(s.head(c)), &x = s.at(s.apex(c)), &y = s.at(s.apex(t));
    const Vec3 at_a = cross(y - a, x - a), at_b = cross(x - b, y - b);
    double sharpest = kSharpest;
    look_at_bend(at_a, at_b, sharpest);
    for (int i = 0; i < 4; ++i) {
        const int32_t k = s.twin(around[i]);
        if (k < 0) continue;
        const Vec3& o = s.at(s.vert(k));
        look_at_bend(i == 1 || i == 2 ? at_a : at_b, cross(s.at(s.head(k)) - o, s.at(s.apex(k)) - o), sharpest);
    }
    if (sharpest == kSharpest) return false;
    double was = bend(c);
    for (const int32_t k : around) was = std::min(was, bend(k));
    return was >= kSharpest;
}

} // namespace dm
