// SPDX-License-Identifier: Apache-2.0
// Algorithms 1 and 2 of Dyer, Zhang, Moeller, "Delaunay Mesh Construction" (2007), as one loop over two queues. What differs
// between the modes is only which edges may be flipped: in `preserve` those inside flat patches; in the flip modes all but kept
// ones. `ready` holds NLD edges that nobody has looked at since they changed; `blocked` those that could not be flipped then.
// Flips come first, always; when none is left, the blocked edge with the largest excess is split and the flipping goes on.
// Flips end because a Delaunay flip never increases the area of the surface (Theorem 1 there) and the test is exact; splits end
// by the rules of split_point.h, then concentric shells, then max_vertices.
#include "algo/delaunay.h"

#include <algorithm>
#include <limits>

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

// In units in the last place. Where the precision has no room to split an edge, edges up to kShort may be taken out, vertices
// closer than kMelt become one, and the surface may move by rules.need in all (the report says by how much it did); clean meshes get
// by with the tolerance.
constexpr double kMelt = 4, kShort = 16;
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

enum class Verdict { flip, kept, guarded, unflippable };

class Loop {
public:
    Loop(Context& context_, Surface& surface, FlatPatches* flat, const DelaunayRules& rules_, delmesh_remesh_report& report_)
        : context(context_), s(surface), patches(flat), rules(rules_), report(report_), ready(context_.memory()),
          blocked(context_.memory()), pieces(context_.memory()), carrier_splits(context_.memory()), around(context_.memory()),
          bubble(context_.memory()), cluster(context_.memory()), places(context_.memory()), own_patches(context_.memory()) {}

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
                if (judge(e.corner) == Verdict::flip)
                    do_flip(e.corner);
                else
                    push(blocked, e);
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
            if (verdict == Verdict::flip)
                do_flip(e.corner);
            else
                DM_TRY(do_split(e.corner, verdict));
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
        if (s.is_boundary(c))
            c2 = c1, s2 = s1;
        else
            angle(s.at(s.apex(s.twin(c))), c2, s2);
        return {c1 * c2 - s1 * s2, c, p, q};
    }

    bool still_nld(const Entry& e) const { return s.vert(e.corner) == e.p && s.head(e.corner) == e.q && is_nld(e.corner); }

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
            if (!in_need || marked || flip_displacement(pp, qq, uu, vv) > rules.need) return Verdict::kept;
        }
        new_drift = -1;
        new_patch = -1;
        if (patches != nullptr) {
            if (!may_flip_in_place(c, t, p, q, u, v)) return Verdict::kept;
        } else if (rules.min_turn_cosine > -1.5 && !turns_little(p, q, u, v))
            return Verdict::guarded;
        if (u == v || s.adjacent(u, v)) return Verdict::unflippable;
        if (!in_need && (zero_area(pp, vv, uu) || zero_area(qq, uu, vv))) return Verdict::guarded;
        return Verdict::flip;
    }

    // Does the flip leave the surface where it is?
    bool may_flip_in_place(int32_t c, int32_t t, int32_t p, int32_t q, int32_t u, int32_t v) {
        const Vec3 &pp = s.at(p), &qq = s.at(q), &uu = s.at(u), &vv = s.at(v);
        const int32_t f = face_of(c), g = face_of(t);
        const int32_t patch = patches->face_patch[f];
        if (!in_need && (s.on_one_carrier(p, v, u) || s.on_one_carrier(q, u, v))) return false;
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
        const bool crowded = report.splits > kCrowd * static_cast<int64_t>(s.first_split) + kFewSplits;
        const double limit = in_need || crowded ? rules.need : rules.free_movement;
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
    // cross, seen along their common perpendicular, both pairs cover the same quadrilateral and differ most at the crossing,
    // by the distance of the diagonals. And if one point is within h of the other diagonal, moving it there makes the pairs
    // coincide.
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
                const double moved = std::max(patches->moved(f), patches->moved(g));
                if (new_patch >= 0) patches->face_patch[f] = patches->face_patch[g] = new_patch;
                raise(f, moved);
                raise(g, moved);
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
            return context.fail(DELMESH_ERROR_VERTEX_LIMIT,
                                "The limit of %lld vertices was reached with edges still to split (edge %d-%d).",
                                static_cast<long long>(rules.max_vertices), p, q);
        if (s.corners() > std::numeric_limits<int32_t>::max() - 6 * kMostSheets)
            return context.fail(DELMESH_ERROR_TOO_LARGE, "The result had more than 2^31 corners.");
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
        } else
            plan_split(s, patches, rules.boundary_rule, rules.resolution, c, plan);
        for (const double t : {0.5, 0.4, 0.6, 0.3, 0.7, 0.2, 0.8, 0.1, 0.9})
            if (plan.count < SplitPlan::kMost) plan.t[plan.count++] = t;
        for (int i = 0; i < plan.count; ++i) {
            const double t = tp + plan.t[i] * (tq - tp);
            const SplitVertex where{carrier, t, point_between(s.exact(line.a), s.exact(line.b), t),
                                    1 + std::max(s.depth(line.a), s.depth(line.b))};
            const Vec3 position = round_to(rules.precision, where.exact);
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
        const bool done = s.is_boundary(c) ? remove_ears(c) || collapse(c) : make_room_inside(c);
        in_need = false;
        return done;
    }

    bool make_room_inside(int32_t c) {
        const int32_t t = s.twin(c);
        if (s.at(s.apex(c)) == s.at(s.apex(t))) { // the flip would make an edge of zero length
            if (merge_apexes(c)) return true;
        } else if (judge(c) == Verdict::flip) {
            do_flip(c);
            return true;
        }
        return melt(c);
    }

    // Split vertices on different lines crowd where these lines meet at a small angle, closer than the precision can tell apart.
    // All that is connected within a few units in the last place around c becomes one vertex: the displacement counts once.
    bool melt(int32_t c) {
        const int32_t ends[2] = {s.vert(c), s.head(c)};
        const double reach = std::max(length(s.at(ends[1]) - s.at(ends[0])), kMelt * rules.resolution);
        if (reach > kShort * rules.resolution) return false;
        // A vertex of the input never moves, nor one at the boundary, whose copies would have to follow: there may only be one.
        cluster.clear();
        int32_t anchor = -1;
        const auto add = [&](int32_t v) {
            if (length(s.at(v) - s.at(ends[0])) > reach || std::find(cluster.begin(), cluster.end(), v) != cluster.end()) return;
            const bool anchored = s.is_original(v) || s.on_boundary(v);
            if (anchored && anchor >= 0) return;
            if (anchored) anchor = v;
            cluster.push_back(v);
        };
        add(ends[0]);
        add(ends[1]);
        if (cluster.size() < 2) return collapse(c);
        around.clear(); // faces of the cluster
        for (int64_t i = 0; i < cluster.size(); ++i) {
            const int32_t start = s.vert_corner[cluster[i]];
            for (int32_t k = start;;) {
                add(s.head(k));
                around.push_back(face_of(k));
                k = s.rotate(k);
                if (k < 0 || k == start) break;
            }
        }
        std::sort(around.begin(), around.end());
        around.resize_uninitialized(std::unique(around.begin(), around.end()) - around.begin());
        const int32_t stays = anchor >= 0 ? anchor : *std::min_element(cluster.begin(), cluster.end());
        const Vec3 place = s.at(stays);
        double moved = 0, shift = 0;
        for (const int32_t v : cluster) shift = std::max(shift, length(s.at(v) - place));
        if (patches != nullptr) {
            for (const int32_t f : around) moved = std::max(moved, patches->moved(f));
            moved += shift;
            if (!(moved <= rules.need)) return false;
        }
        places.clear();
        for (const int32_t v : cluster) {
            places.push_back(s.at(v));
            s.pos[v] = place;
        }
        const int32_t first_copy = s.vertices();
        int64_t merged = 0;
        for (bool again = true; again;) {
            again = false;
            for (const int32_t f : around)
                for (int32_t k = 3 * f; k < 3 * f + 3 && !s.is_dead(f); ++k) {
                    const int32_t t = s.twin(k), a = s.vert(k), b = s.head(k);
                    if (t < 0 || !(s.at(a) == s.at(b))) continue;
                    const bool first = s.on_boundary(a) != s.on_boundary(b) ? s.on_boundary(a) : a < b;
                    const int32_t from = first ? k : t;
                    if (s.collapse_is_legal(from))
                        s.collapse(from);
                    else if (!s.collapse_and_cut(from))
                        continue;
                    ++merged;
                    again = true;
                }
        }
        report.collapsed_edges += merged;
        for (int64_t i = 0; i < cluster.size(); ++i) // a vertex of the input that nothing uses any more is handed out as it was
            if (s.vert_corner[cluster[i]] < 0) s.pos[cluster[i]] = places[i];
        if (patches != nullptr)
            for (const int32_t f : around) {
                patches->drift[f] = moved;
                if (!s.is_dead(f)) own_patch(f);
            }
        drop_bubbles(place);
        look_at_changed(first_copy);
        return merged != 0;
    }

    // The faces in `around`, and those of copies that cuts made: entries in the queues do not know their new vertices.
    void look_at_changed(int32_t first_copy) {
        for (const int32_t f : around)
            if (!s.is_dead(f)) look_at_face(f);
        for (int32_t v = first_copy; v < s.vertices(); ++v)
            if (s.vert_corner[v] >= 0) look_at_faces_of(v);
    }
    void look_at_faces_of(int32_t v) {
        const int32_t start = s.vert_corner[v];
        for (int32_t k = start;;) {
            look_at_face(face_of(k));
            k = s.rotate(k);
            if (k < 0 || k == start) break;
        }
    }
    void look_at_face(int32_t f) {
        for (int32_t k = 3 * f; k < 3 * f + 3; ++k) look_at(k);
    }

    // Two faces back to back: their apexes become one vertex and the faces vanish. Where the apexes have further common
    // neighbours the surface is a pocket of zero width there; it is cut off, and goes if it is smaller than the precision.
    bool merge_apexes(int32_t c) {
        const int32_t u = s.apex(c), v = s.apex(s.twin(c));
        if (judge(c) != Verdict::flip) return false;
        around.clear();
        for (const int32_t x : {u, v}) {
            int32_t k = s.vert_corner[x];
            do {
                around.push_back(face_of(k));
                k = s.rotate(k);
            } while (k >= 0 && k != s.vert_corner[x]);
        }
        const Vec3 place = s.at(u);
        do_flip(c);
        const int32_t made = next_corner(c), back = s.twin(made);
        const int32_t from = s.vert(made) < s.head(made) ? made : back; // the younger vertex goes
        const double gone = patches != nullptr ? patches->moved(face_of(made)) : 0;
        for (const int32_t k : {made, back}) {
            raise_beyond(next_corner(k), gone);
            raise_beyond(prev_corner(k), gone);
        }
        const int32_t first_copy = s.vertices();
        // Where neither goes, at a boundary, the flip stands: further ones may take the edge of zero length away again, and the
        // certificate has the last word.
        const bool legal = s.collapse_is_legal(from);
        if (legal) s.collapse(from);
        if (legal || s.collapse_and_cut(from)) ++report.collapsed_edges;
        drop_bubbles(place);
        look_at_changed(first_copy);
        return true;
    }

    // Of the components that the faces in `around` belong to, removes those that fit into a few units in the last place, and
    // those of two faces back to back.
    void drop_bubbles(const Vec3& place) {
        constexpr int64_t kMost = 64;
        double extent = 0;
        for (const int32_t seed : around) {
            if (s.is_dead(seed)) continue;
            bubble.clear();
            bubble.push_back(seed);
            double reach = 0;
            for (int64_t i = 0; i < bubble.size() && bubble.size() <= kMost; ++i)
                for (int32_t k = 3 * bubble[i]; k < 3 * bubble[i] + 3; ++k) {
                    reach = std::max(reach, length(s.at(s.vert(k)) - place));
                    if (s.is_boundary(k)) continue;
                    const int32_t g = face_of(s.twin(k));
                    if (std::find(bubble.begin(), bubble.end(), g) == bubble.end()) bubble.push_back(g);
                }
            if (bubble.size() > kMost || bubble.size() == s.faces() - s.dead_faces) continue;
            double moved = 0;
            if (patches != nullptr)
                for (const int32_t f : bubble) moved = std::max(moved, patches->moved(f));
            if (reach <= kShort * rules.resolution)
                extent = std::max(extent, moved + reach);
            else if (bubble.size() != 2 || !is_covered(moved))
                continue;
            report.removed_zero_area_faces += bubble.size();
            s.remove_component(bubble);
        }
        for (const int32_t f : around) // what is left there is within the extent of what was removed
            if (!s.is_dead(f)) raise(f, extent);
    }

    // Two faces back to back in `bubble`: is their longest side also one of another face in `around`, which can stand for them?
    bool is_covered(double moved) {
        if (patches == nullptr) return true;
        int32_t side = 3 * bubble[0];
        double longest = 0;
        for (int32_t k = side; k < 3 * bubble[0] + 3; ++k) {
            const double size = length(s.at(s.head(k)) - s.at(s.vert(k)));
            if (size > longest) longest = size, side = k;
        }
        const Vec3 &a = s.at(s.vert(side)), &b = s.at(s.head(side));
        moved += distance_to_segment(s.at(s.apex(side)), a, b);
        if (!(moved <= rules.need)) return false;
        for (const int32_t f : around) {
            if (s.is_dead(f) || f == bubble[0] || f == bubble[1]) continue;
            for (int32_t k = 3 * f; k < 3 * f + 3; ++k)
                if ((s.at(s.vert(k)) == a && s.at(s.head(k)) == b) || (s.at(s.vert(k)) == b && s.at(s.head(k)) == a)) {
                    raise(f, moved);
                    return true;
                }
        }
        return false;
    }

    // Where copies of the edge share its split vertices, the face in the way may be another one's.
    bool remove_ears(int32_t c) {
        if (remove_ear(c)) return true;
        if (!is_cut(s.twin(c))) return false;
        const int32_t start = cut_slot(s.twin(c));
        for (int32_t slot = s.cut_slots[start].next; slot != start; slot = s.cut_slots[slot].next) {
            const int32_t k = s.cut_slots[slot].corner;
            if (!remove_ear(k)) continue;
            look_at(c);
            return true;
        }
        return false;
    }

    // A face at the boundary that is flat within the precision: it goes, and its other edges become the boundary.
    bool remove_ear(int32_t c) {
        const double height = distance_to_segment(s.at(s.apex(c)), s.at(s.vert(c)), s.at(s.head(c)));
        if (!(height <= rules.resolution) || (s.corner_bits[c] & kEdgeMarked) != 0) return false;
        const int32_t f = face_of(c), n = s.twin(next_corner(c)), p = s.twin(prev_corner(c));
        if (patches != nullptr) {
            // Either its one long side is still covered by a copy, or its two others by what is there.
            const bool long_side = is_cut(s.twin(c)) && s.cut_slots[cut_slot(s.twin(c))].next != cut_slot(s.twin(c));
            const auto covered = [](int32_t twin) { return twin >= 0 || is_cut(twin); };
            if (!long_side && !(covered(n) && covered(p))) return false;
            const double moved = patches->moved(f) + height;
            if (!(moved <= rules.need)) return false;
            for (int32_t k = 3 * f; k < 3 * f + 3; ++k) raise_beyond(k, moved);
        }
        const int32_t first_copy = s.vertices();
        around.clear();
        for (const int32_t k : {n, p})
            if (k >= 0) around.push_back(face_of(k));
        s.remove_boundary_face(c);
        ++report.removed_zero_area_faces;
        look_at_changed(first_copy);
        return true;
    }

    // The face has come to stand for a part of the surface that is up to `moved` away from it.
    void raise(int32_t face, double moved) {
        if (patches == nullptr) return;
        double& drift = patches->drift[face];
        drift = std::max(drift, moved - patches->plane[patches->face_patch[face]].thickness);
    }
    void raise_beyond(int32_t c, double moved) {
        const int32_t t = s.twin(c);
        if (t >= 0) raise(face_of(t), moved);
        if (!is_cut(t)) return;
        for (int32_t slot = s.cut_slots[cut_slot(t)].next; slot != cut_slot(t); slot = s.cut_slots[slot].next)
            raise(face_of(s.cut_slots[slot].corner), moved);
    }

    // Merges the ends of a very short edge, if that keeps the topology, leaves no face without area, and the tolerance allows it.
    bool collapse(int32_t c) {
        const double size = length(s.at(s.head(c)) - s.at(s.vert(c)));
        if (size > kShort * rules.resolution) return false;
        const int32_t t = s.twin(c);
        // The younger vertex goes: a split vertex rather than one of the input's.
        const int32_t keeps_first = s.vert(c) < s.head(c) || t < 0 ? c : t;
        const int32_t stays = s.vert(keeps_first), goes = s.head(keeps_first);
        if (s.is_original(goes) && t < 0) return false;
        if (!s.collapse_is_legal(keeps_first)) return false;
        around.clear(); // faces of the vertex that goes
        const int32_t start = s.vert_corner[goes];
        for (int32_t k = start;;) {
            if (is_cut(s.twin(k)) || is_cut(s.twin(prev_corner(k)))) return false; // its copies would have to follow
            if (patches != nullptr && !(patches->moved(face_of(k)) + size <= rules.need)) return false;
            const int32_t x = s.head(k), y = s.apex(k);
            if (x != stays && y != stays && zero_area(s.at(stays), s.at(x), s.at(y))) return false;
            around.push_back(face_of(k));
            k = s.rotate(k);
            if (k < 0 || k == start) break;
        }
        if (patches != nullptr) {
            for (const int32_t f : around) patches->drift[f] = patches->moved(f) + size; // of a patch of its own, from here on
            for (const int32_t k : {c, t}) {
                if (k < 0) continue;
                raise_beyond(next_corner(k), patches->drift[face_of(k)]);
                raise_beyond(prev_corner(k), patches->drift[face_of(k)]);
            }
        }
        s.collapse(keeps_first);
        ++report.collapsed_edges;
        if (patches != nullptr)
            for (const int32_t f : around)
                if (!s.is_dead(f)) own_patch(f);
        look_at_faces_of(stays);
        return true;
    }

    // May a vertex be put there on c and on all its copies: no face without area, no vertex on another of the faces?
    bool fits(int32_t c, const Vec3& x) const {
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

    void commit_split(int32_t c, const SplitVertex& where, const Vec3& position, Verdict verdict) {
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
        for (const int32_t piece : pieces) {
            // The faces appended for this copy follow those they were cut from.
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
    Array<int32_t> around, bubble; // faces
    Array<int32_t> cluster;
    Array<Vec3> places;
    FlatPatches own_patches; // for the flip modes, when their split budget is spent
    bool in_need = false;    // the edge at hand has no room for a vertex
    double new_drift = -1;   // what judge() found out for do_flip()
    int32_t new_patch = -1;
};

} // namespace

Status make_delaunay(Context& context, Surface& surface, FlatPatches* patches, const DelaunayRules& rules,
                     delmesh_remesh_report& report) {
    return Loop(context, surface, patches, rules, report).run();
}

} // namespace dm
