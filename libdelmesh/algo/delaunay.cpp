// SPDX-License-Identifier: Apache-2.0
// Algorithms 1 and 2 of Dyer, Zhang, Moeller, "Delaunay Mesh Construction" (2007), as one loop over two queues. What differs
// between the modes is only which edges may be flipped: in `preserve` those inside flat patches; in the flip modes all but kept
// ones. `ready` holds NLD edges that nobody has looked at since they changed; `blocked` those that could not be flipped then.
// Flips come first, always; when none is left, the blocked edge with the largest excess is split and the flipping goes on.
// Flips end because a Delaunay flip never increases the area of the surface (Theorem 1 there) and the test is exact; splits end
// by the rules of split_point.h, then concentric shells, then max_vertices.
#include "algo/delaunay.h"

#include <algorithm>

#include "algo/nld_scan.h"
#include "algo/split_point.h"
#include "geom/predicates.h"

namespace dm {
namespace {

struct Entry {
    double excess; // grows with how far the edge is from Delaunay
    int32_t corner, p, q;
};
// A heap's top is its greatest; ties go to the smaller vertex pair, so that the order does not depend on how the heap was filled.
bool operator<(const Entry& a, const Entry& b) {
    if (a.excess != b.excess) return a.excess < b.excess;
    if (a.p != b.p) return a.p > b.p;
    if (a.q != b.q) return a.q > b.q;
    return a.corner > b.corner;
}

// In units in the last place. Where the precision has no room to split an edge, edges up to kShort may be taken out, and the
// surface may move by kNeed in all (the report says by how much it did); clean meshes get by with the tolerance.
constexpr double kShort = 16, kNeed = 64;
// Splits on one carrier before its splits go to concentric shells. Around a vertex with small angles interval placement can
// spiral inward from edge to edge; points at equal distances from the vertex stop that.
constexpr int32_t kPatience = 40, kPatienceAtVertex = 8;

enum class Verdict { flip, kept, guarded, unflippable };

class Loop {
public:
    Loop(Context& context_, Surface& surface, FlatPatches* flat, const DelaunayRules& rules_, delmesh_remesh_report& report_)
        : context(context_), s(surface), patches(flat), rules(rules_), report(report_), ready(context_.memory()),
          blocked(context_.memory()), pieces(context_.memory()), carrier_splits(context_.memory()), own_patches(context_.memory()) {}

    Status run() {
        DM_TRY(find_nld());
        report.nld_in = ready.size();
        const double all = static_cast<double>(ready.size()) + 1;
        int64_t steps = 0, flips_at_sweep = -1;
        for (;;) {
            if ((++steps & 0x3ff) == 0) {
                // Nobody knows how much is left; what is in the queues against what was there moves in the right direction.
                const double left = static_cast<double>(ready.size() + blocked.size());
                DM_TRY(context.progress(1 - left / (all + left + static_cast<double>(steps))));
            }
            if (!ready.empty()) {
                const Entry e = pop(ready);
                if (!still_nld(e)) continue;
                if (judge(e.corner) == Verdict::flip) do_flip(e.corner);
                else push(blocked, e);
                continue;
            }
            if (blocked.empty()) break;
            // Flips elsewhere may have set blocked edges free: before the first split all are looked at again.
            if (report.splits == 0 && flips_at_sweep != total_flips()) {
                flips_at_sweep = total_flips();
                std::swap(ready, blocked);
                continue;
            }
            const Entry e = pop(blocked);
            if (!still_nld(e)) continue;
            const Verdict verdict = judge(e.corner);
            if (verdict == Verdict::flip) do_flip(e.corner);
            else DM_TRY(do_split(e.corner, verdict));
            if (patches == nullptr && report.unflippable >= rules.split_budget) {
                // Flips and splits could chase each other: from here on it is Algorithm 1, on the surface as it is now.
                DM_TRY(grow_flat_patches(context, s, 0, own_patches));
                patches = &own_patches;
            }
        }
        return DELMESH_OK;
    }

private:
    int64_t total_flips() const { return report.flips + report.flips_after; }

    static Entry pop(Array<Entry>& heap) {
        std::pop_heap(heap.begin(), heap.end());
        return heap.pop_back();
    }
    static void push(Array<Entry>& heap, const Entry& e) {
        heap.push_back(e);
        std::push_heap(heap.begin(), heap.end());
    }

    Status find_nld() {
        constexpr int64_t kGrain = 8192;
        const int32_t faces = s.faces();
        Array<uint8_t> marks(context.memory(), faces, 0); // bit k: the edge of the k-th corner
        DM_TRY(context.parallel(faces, kGrain, [&](int64_t, int64_t begin, int64_t end) {
            int64_t exact = 0;
            const int32_t* const verts = s.corner_vert.data();
            const int32_t* const twins = s.corner_twin.data();
            const Vec3* const pos = s.pos.data();
            scan_nld(
                static_cast<int32_t>(begin), static_cast<int32_t>(end), [&](int32_t c) { return verts[c]; },
                [&](int32_t c) { return twins[c]; }, [&](int32_t v) { return pos[v]; }, rules.boundary_rule, exact,
                [&](int32_t c) { marks[face_of(c)] |= static_cast<uint8_t>(1 << (c % 3)); }, [](int32_t) {});
        }));
        for (int32_t f = 0; f < faces; ++f)
            for (int32_t k = 0; k < 3; ++k)
                if ((marks[f] >> k & 1) != 0) ready.push_back(entry(3 * f + k));
        std::make_heap(ready.begin(), ready.end());
        return DELMESH_OK;
    }

    bool is_nld(int32_t c) const {
        const Vec3 &a = s.at(s.vert(c)), &b = s.at(s.head(c)), &p = s.at(s.apex(c));
        if (s.is_boundary(c)) return rules.boundary_rule && boundary_edge_is_nld(a, b, p);
        return edge_is_nld(a, b, p, s.at(s.apex(s.twin(c))));
    }

    // Monotone in the sum of the opposite angles over 180 (twice the angle on the boundary), without inverse trigonometry:
    // between 180 and 360 the cosine of the sum rises.
    Entry entry(int32_t c) const {
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
        if (s.is_boundary(c)) c2 = c1, s2 = s1;
        else angle(s.at(s.apex(s.twin(c))), c2, s2);
        return {c1 * c2 - s1 * s2, c, p, q};
    }

    bool still_nld(const Entry& e) const {
        return s.vert(e.corner) == e.p && s.head(e.corner) == e.q && is_nld(e.corner);
    }

    void look_at(int32_t c) {
        if (is_nld(c)) push(ready, entry(c));
    }

    // -- flips

    Verdict judge(int32_t c) {
        if (s.is_boundary(c)) return Verdict::kept;
        const int32_t t = s.twin(c);
        const int32_t p = s.vert(c), q = s.head(c), u = s.apex(c), v = s.apex(t);
        const Vec3 &pp = s.at(p), &qq = s.at(q), &uu = s.at(u), &vv = s.at(v);
        // A feature edge may be flipped where the precision has no room to split it; what the caller marked may not.
        if (s.is_kept(c)) {
            const bool marked = (s.corner_bits[c] & kEdgeMarked) != 0;
            if (!in_need || marked || flip_displacement(pp, qq, uu, vv) > kNeed * rules.resolution) return Verdict::kept;
        }
        new_drift = -1;
        new_patch = -1;
        if (patches != nullptr) {
            if (!may_flip_in_place(c, t, p, q, u, v)) return Verdict::kept;
        } else if (rules.min_turn_cosine > -1.5 && !turns_little(p, q, u, v)) return Verdict::guarded;
        if (u == v || s.adjacent(u, v)) return Verdict::unflippable;
        if (!in_need && (zero_area(pp, vv, uu) || zero_area(qq, uu, vv))) return Verdict::guarded;
        return Verdict::flip;
    }

    // Does the flip leave the surface where it is?
    bool may_flip_in_place(int32_t c, int32_t t, int32_t p, int32_t q, int32_t u, int32_t v) {
        const Vec3 &pp = s.at(p), &qq = s.at(q), &uu = s.at(u), &vv = s.at(v);
        const int32_t f = face_of(c), g = face_of(t);
        const int32_t patch = patches->face_patch[f];
        if (s.on_one_carrier(p, v, u) || s.on_one_carrier(q, u, v)) return false;
        if (patch == patches->face_patch[g]) {
            const Vec3& n = patches->plane[patch].normal;
            if (dot(n, cross(vv - pp, uu - pp)) > 0 && dot(n, cross(uu - qq, vv - qq)) > 0) return true;
        }
        // A cap without any area: its apex lies on the edge, so the flip moves nothing.
        const bool cap_f = zero_area(pp, qq, uu), cap_g = zero_area(pp, qq, vv);
        if (cap_f != cap_g) {
            new_patch = patches->face_patch[cap_f ? g : f];
            return true;
        }
        // Within what is left of the tolerance.
        const double before = std::max(patches->moved(f), patches->moved(g));
        const double limit = in_need ? kNeed * rules.resolution : rules.free_movement;
        if (before >= limit) return false;
        const double after = before + flip_displacement(pp, qq, uu, vv);
        if (!(after <= limit)) return false;
        new_drift = after;
        return true;
    }

    static double distance_to_segment(const Vec3& x, const Vec3& a, const Vec3& b) {
        const Vec3 d = b - a;
        const double l2 = length_squared(d);
        double t = l2 > 0 ? dot(x - a, d) / l2 : 0;
        t = std::min(std::max(t, 0.0), 1.0);
        return length(x - (a + t * d));
    }
    // An upper bound on the two-sided distance between the two pairs of faces of the tetrahedron p q u v. Where the diagonals
    // cross, seen along their common perpendicular, both pairs cover the same quadrilateral and differ most at the crossing, by the
    // distance of the diagonals. And if one point is within h of the other diagonal, moving it there makes the pairs coincide.
    static double flip_displacement(const Vec3& p, const Vec3& q, const Vec3& u, const Vec3& v) {
        double least = std::min(std::min(distance_to_segment(u, p, q), distance_to_segment(v, p, q)),
                                std::min(distance_to_segment(p, u, v), distance_to_segment(q, u, v)));
        const Vec3 n = cross(q - p, v - u);
        const double size = length(n);
        const auto side = [&](const Vec3& a, const Vec3& b, const Vec3& x) { return dot(n, cross(b - a, x - a)); };
        if (size > 0 && side(p, q, u) * side(p, q, v) < 0 && side(u, v, p) * side(u, v, q) < 0)
            least = std::min(least, std::fabs(dot(n, u - p)) / size);
        return least;
    }

    // The guard: no new normal may differ from an old one by more than the limit.
    bool turns_little(int32_t p, int32_t q, int32_t u, int32_t v) const {
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

    void do_flip(int32_t c) {
        const int32_t t = s.twin(c);
        s.flip(c);
        ++(report.splits == 0 ? report.flips : report.flips_after);
        if (patches != nullptr) {
            const int32_t f = face_of(c), g = face_of(t);
            if (new_drift >= 0) {
                ++report.moved_within_tolerance;
                patches->drift[f] = patches->drift[g] = new_drift;
                own_patch(f);
                own_patch(g);
            } else {
                if (new_patch >= 0) patches->face_patch[f] = patches->face_patch[g] = new_patch;
                patches->drift[f] = patches->drift[g] = std::max(patches->drift[f], patches->drift[g]);
            }
        }
        look_at(c);
        look_at(prev_corner(c));
        look_at(t);
        look_at(prev_corner(t));
    }

    void own_patch(int32_t face) {
        const Vec3 &a = s.at(s.vert(3 * face)), &b = s.at(s.vert(3 * face + 1)), &c = s.at(s.vert(3 * face + 2));
        const Vec3 n = cross(b - a, c - a);
        const double size = length(n);
        patches->face_patch[face] = static_cast<int32_t>(patches->plane.size());
        patches->plane.push_back({size > 0 ? (1 / size) * n : n, 0});
    }

    // -- splits

    Status do_split(int32_t c, Verdict verdict) {
        const int32_t p = s.vert(c), q = s.head(c);
        if (s.vertices() >= rules.max_vertices)
            return context.fail(DELMESH_ERROR_VERTEX_LIMIT, "The limit of %lld vertices was reached with edges still to split (edge %d-%d).",
                                static_cast<long long>(rules.max_vertices), p, q);
        double tp, tq;
        const int32_t carrier = s.carrier_of(p, q, tp, tq);
        while (carrier_splits.size() < s.carriers.size()) carrier_splits.push_back(0);
        const Carrier line = s.carriers[carrier];
        SplitPlan plan;
        const bool at_original = s.is_original(p) || s.is_original(q);
        if (rules.shells || ++carrier_splits[carrier] > (at_original ? kPatienceAtVertex : kPatience)) {
            // Measured from an original vertex where there is one, as the paper says.
            const double edge = length(s.at(q) - s.at(p));
            const double fraction = shell_fraction(edge, rules.shell_unit);
            plan.t[plan.count++] = s.is_original(p) ? fraction : 1 - fraction;
        } else plan_split(s, patches, rules.boundary_rule, rules.resolution, c, plan);
        for (const double t : {0.5, 0.4, 0.6, 0.3, 0.7, 0.2, 0.8, 0.1, 0.9})
            if (plan.count < SplitPlan::kMost) plan.t[plan.count++] = t;
        for (int i = 0; i < plan.count; ++i) {
            const SplitVertex where{carrier, tp + plan.t[i] * (tq - tp)};
            const Vec3 &a = s.at(line.a), &b = s.at(line.b);
            const Vec3 position = round_to(rules.precision, a + where.t * (b - a));
            if (!fits(c, position)) continue;
            commit_split(c, where, position, verdict);
            return DELMESH_OK;
        }
        if (make_room(c)) return DELMESH_OK;
        return context.fail(DELMESH_ERROR_PRECISION,
                            "The output precision has no room for a vertex between vertices %d and %d of face %d.", p, q,
                            s.face_src[face_of(c)]);
    }

    // No representable point lies between the ends of c: what is smaller than the precision is flipped or taken out.
    bool make_room(int32_t c) {
        in_need = true;
        const int32_t t = s.twin(c);
        const bool coincident = t >= 0 && s.at(s.apex(c)) == s.at(s.apex(t)); // the flip would make an edge of zero length
        bool done = coincident && collapse(c);
        if (!done && judge(c) == Verdict::flip && (!coincident || may_merge_apexes(c))) {
            do_flip(c);
            done = !coincident || collapse(next_corner(c));
        }
        if (!done && !coincident) done = collapse(c);
        in_need = false;
        return done;
    }

    // After a flip of c: would the link condition let its new edge be collapsed?
    bool may_merge_apexes(int32_t c) const {
        const int32_t p = s.vert(c), q = s.head(c), u = s.apex(c), v = s.apex(s.twin(c));
        if (s.on_boundary(u) || s.on_boundary(v)) return false;
        const int32_t start = s.vert_corner[u];
        int32_t k = start;
        do {
            const int32_t x = s.head(k);
            if (x != p && x != q && s.adjacent(v, x)) return false;
            k = s.rotate(k);
        } while (k != start);
        return true;
    }

    // Merges the ends of a very short edge, if that keeps the topology, leaves no face without area, and the tolerance allows it.
    bool collapse(int32_t c) {
        if (length(s.at(s.head(c)) - s.at(s.vert(c))) > kShort * rules.resolution) return false;
        const int32_t t = s.twin(c);
        // The younger vertex goes: a split vertex rather than one of the input's.
        const int32_t keeps_first = s.vert(c) < s.head(c) || t < 0 ? c : t;
        const int32_t stays = s.vert(keeps_first), goes = s.head(keeps_first);
        if (s.is_original(goes) && t < 0) return false;
        if (!s.collapse_is_legal(keeps_first)) return false;
        double moved = 0;
        const int32_t start = s.vert_corner[goes];
        for (int32_t k = start;;) {
            if (is_cut(s.twin(k)) || is_cut(s.twin(prev_corner(k)))) return false; // its copies would have to follow
            if (patches != nullptr) moved = std::max(moved, patches->moved(face_of(k)));
            const int32_t x = s.head(k), y = s.apex(k);
            if (x != stays && y != stays && zero_area(s.at(stays), s.at(x), s.at(y))) return false;
            k = s.rotate(k);
            if (k < 0 || k == start) break;
        }
        moved += length(s.at(goes) - s.at(stays));
        if (patches != nullptr && !(moved <= kNeed * rules.resolution)) return false;
        s.collapse(keeps_first);
        ++report.collapsed_edges;
        const int32_t first = s.vert_corner[stays];
        for (int32_t k = first;;) {
            if (patches != nullptr) {
                patches->drift[face_of(k)] = moved;
                own_patch(face_of(k));
            }
            look_at(k);
            look_at(next_corner(k));
            look_at(prev_corner(k));
            k = s.rotate(k);
            if (k < 0 || k == first) break;
        }
        return true;
    }

    // May a vertex be put there on c and on all its copies: no face without area, no vertex on another of the faces?
    bool fits(int32_t c, const Vec3& x) const {
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

    void commit_split(int32_t c, const SplitVertex& where, const Vec3& position, Verdict verdict) {
        if (s.is_boundary(c)) ++report.boundary_splits;
        else if (s.is_kept(c)) ++report.kept_splits;
        else if (verdict == Verdict::guarded) ++report.guarded;
        else if (verdict == Verdict::unflippable) count_unflippable(c);
        s.split_everywhere(c, position, where, pieces);
        report.splits += pieces.size();
        for (const int32_t piece : pieces) {
            // The faces appended for this copy follow those they were cut from.
            const int32_t across = next_corner(piece);           // s -> apex
            const int32_t tail = next_corner(s.twin(across));    // of apex -> s: s -> head
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
    void spread(int32_t from, int32_t to) {
        if (patches == nullptr) return;
        const int32_t f = face_of(from), g = face_of(to);
        if (patches->face_patch.size() <= g) {
            patches->face_patch.resize(g + 1, -1);
            patches->drift.resize(g + 1, 0);
        }
        patches->face_patch[g] = patches->face_patch[f];
        patches->drift[g] = patches->drift[f];
    }

    void count_unflippable(int32_t c) {
        const int32_t t = s.twin(c);
        const int32_t p = s.vert(c), q = s.head(c), u = s.apex(c), v = s.apex(t);
        ++report.unflippable;
        const int faces = 2 + (u != v && s.has_face(u, v, p) ? 1 : 0) + (u != v && s.has_face(u, v, q) ? 1 : 0);
        ++(faces == 2 ? report.unflippable_2 : faces == 3 ? report.unflippable_3 : report.unflippable_4);
    }

    Context& context;
    Surface& s;
    FlatPatches* patches;
    const DelaunayRules& rules;
    delmesh_remesh_report& report;
    Array<Entry> ready, blocked;
    Array<int32_t> pieces, carrier_splits;
    FlatPatches own_patches; // for the flip modes, when their split budget is spent
    bool in_need = false;   // the edge at hand has no room for a vertex
    double new_drift = -1;  // what judge() found out for do_flip()
    int32_t new_patch = -1;
};

} // namespace

Status make_delaunay(Context& context, Surface& surface, FlatPatches* patches, const DelaunayRules& rules,
                     delmesh_remesh_report& report) {
    return Loop(context, surface, patches, rules, report).run();
}

} // namespace dm
