// SPDX-License-Identifier: Apache-2.0
// A flip outside of patches replaces the two faces of a tetrahedron by the other two. Adding up what flips do bounds how far they
// move the surface, but after a few that bound has little to do with the surface. So where the sum is too much, the faces as
// they are (K, of one region) are compared with what they were made of (R, its reference).
//
// Both have the same outline. If all their faces look towards the same side of a plane, straight lines perpendicular to it match
// them point by point, and cut both into convex cells r /\ k, one for each face r of R and k of K that lie over each other. The
// distance to the plane triangle k is a convex function, so over a cell the points of r are nowhere farther from k than at the
// cell's corners, and the other way round. These corners are the vertices of R and K, and the crossings of their edges. An edge
// belongs to all faces next to it, so that at a crossing the distance to the other edge bounds those to the faces at once. Lines
// that meet several sheets of a surface only add pairs.
//
// Regions are kept small, since all this is quadratic. All positions are those before rounding to the output precision; what the
// rounding of split vertices adds is the caller's.
#include "algo/movement.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/round.h"
#include "geom/closest_point.h"
#include "geom/predicates.h"

namespace dm {

double distance_to_segment(const Vec3& x, const Vec3& a, const Vec3& b) {
    return std::sqrt(segment_distance_squared(x - a, b - a));
}

// Where the diagonals cross, seen along their common perpendicular, both pairs cover the same quadrilateral and differ most at
// the crossing, by the distance of the diagonals. And if one point is within h of the other diagonal, moving it there makes the
// pairs coincide.
double flip_displacement(const Vec3& p, const Vec3& q, const Vec3& u, const Vec3& v) {
    const auto squared = [](const Vec3& x, const Vec3& a, const Vec3& b) { return segment_distance_squared(x - a, b - a); };
    double least =
        std::sqrt(std::min(std::min(squared(u, p, q), squared(v, p, q)), std::min(squared(p, u, v), squared(q, u, v))));
    const Vec3 n = cross(q - p, v - u);
    const double size = length(n);
    const auto side = [&](const Vec3& a, const Vec3& b, const Vec3& x) { return dot(n, cross(b - a, x - a)); };
    if (size > 0 && side(p, q, u) * side(p, q, v) < 0 && side(u, v, p) * side(u, v, q) < 0)
        least = std::min(least, std::fabs(dot(n, u - p)) / size);
    return least;
}

namespace {

// Is that clearly more than `limit`? No end of a diagonal is nearer to the other one than their two lines are to each other. The
// slack is far more than roundings can do.
bool displaces_more(const Vec3& p, const Vec3& q, const Vec3& u, const Vec3& v, double limit) {
    const Vec3 a = q - p, b = v - u, w = u - p, n = cross(a, b);
    const double volume = dot(n, w), aa = dot(a, a), bb = dot(b, b), nn = dot(n, n);
    constexpr double kSlack = 1e-18; // squared
    return nn > 1e-12 * (aa * bb) && volume * volume > (8 * limit * limit + kSlack * (aa + bb + dot(w, w))) * nn;
}

constexpr double kFar = std::numeric_limits<double>::infinity();
constexpr double kSteep = 1e-6; // cosine; where a line perpendicular to the plane meets steeper faces is not well known
constexpr int32_t kMostReference = 40, kMostFaces = 160; // of a region that is measured
// What adding up spends is gone, and where it is all spent not even a flip that hardly moves anything is possible: edges would be
// split again and again. So but for the first in a place, a flip may take a small part of what is left.
constexpr double kSpare = 30;

// One of the two surfaces over a region.
struct Sheet {
    using Triangle = FlatPatches::Triangle;
    Triangle triangle[kMostFaces];
    int32_t size = 0;

    void add(const Vec3& a, const Vec3& b, const Vec3& c) { triangle[size++] = {{a, b, c}}; }
    void add(const Triangle& t) { triangle[size++] = t; }
    Vec3 area() const {
        Vec3 n{0, 0, 0};
        for (int32_t i = 0; i < size; ++i) {
            const Vec3* const x = triangle[i].corner;
            n = n + cross(x[1] - x[0], x[2] - x[0]);
        }
        return n;
    }
    bool looks_towards(const Vec3& n) const {
        for (int32_t i = 0; i < size; ++i) {
            const Vec3* const x = triangle[i].corner;
            const Vec3 m = cross(x[1] - x[0], x[2] - x[0]);
            if (!(dot(n, m) > kSteep * length(n) * length(m))) return false;
        }
        return true;
    }
    bool has_vertex(const Vec3& v) const {
        for (int32_t i = 0; i < size; ++i)
            for (const Vec3& x : triangle[i].corner)
                if (x == v) return true;
        return false;
    }
    double distance(const Vec3& v) const {
        double least = kFar;
        for (int32_t i = 0; i < size; ++i) {
            const Vec3* const x = triangle[i].corner;
            least = std::min(least, triangle_distance_squared(v, x[0], x[1], x[2]));
        }
        return std::sqrt(least);
    }
};

// Between a vertex of one sheet and the other, along n; -1 if nothing of the other lies over it.
double distance_at_vertex(const Vec3& v, const Sheet& other, const Vec3& n) {
    constexpr double kSlack = -1e-9;
    double most = -1;
    for (int32_t i = 0; i < other.size; ++i) {
        const Vec3* const x = other.triangle[i].corner;
        const Vec3 m = cross(x[1] - x[0], x[2] - x[0]);
        const double whole = dot(n, m);
        const double w1 = dot(n, cross(v - x[0], x[2] - x[0])), w2 = dot(n, cross(x[1] - x[0], v - x[0]));
        if (w1 < kSlack * whole || w2 < kSlack * whole || whole - w1 - w2 < kSlack * whole) continue;
        most = std::max(most, std::fabs(dot(m, v - x[0])) / whole); // along n
    }
    return most;
}

// Where two edges cross, seen along n.
double distance_at_crossing(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d, const Vec3& n) {
    const Vec3 along = cross(n, b - a), across = cross(n, d - c);
    const double hc = dot(along, c - a), hd = dot(along, d - a), ha = dot(across, a - c), hb = dot(across, b - c);
    if (hc * hd > 0 || ha * hb > 0 || hc == hd || ha == hb) return 0;
    const Vec3 on_ab = a + (ha / (ha - hb)) * (b - a), on_cd = c + (hc / (hc - hd)) * (d - c);
    return std::max(distance_to_segment(on_ab, c, d), distance_to_segment(on_cd, a, b));
}

// A bound on the two-sided distance of two sheets with the same outline, or if k is only a part of the second, between that and
// what lies over it. kFar where it does not apply, or if it comes out above `enough`.
double sheet_distance(const Sheet& r, const Sheet& k, bool part, double enough) {
    const Vec3 area = r.area();
    const double size = length(area);
    if (!part && !(length(area - k.area()) <= 1e-6 * size)) return kFar; // something is missing in one of them
    const Vec3 n = (1 / size) * area;
    if (!r.looks_towards(n) || !k.looks_towards(n)) return kFar;
    double most = 0;
    for (const bool first : {true, false}) {
        const Sheet &from = first ? r : k, &to = first ? k : r;
        for (int32_t i = 0; i < from.size; ++i)
            for (const Vec3& v : from.triangle[i].corner)
                if (!to.has_vertex(v)) {
                    const double distance = distance_at_vertex(v, to, n);
                    // On the outline a rounding may have put it outside.
                    most = std::max(most, distance < 0 && !(first && part) ? to.distance(v) : distance);
                }
        if (!(most <= enough)) return kFar;
    }
    for (int32_t i = 0; i < r.size; ++i)
        for (int e = 0; e < 3; ++e) {
            const Vec3 &a = r.triangle[i].corner[e], &b = r.triangle[i].corner[e == 2 ? 0 : e + 1];
            for (int32_t j = 0; j < k.size; ++j)
                for (int g = 0; g < 3; ++g) {
                    const Vec3 &c = k.triangle[j].corner[g], &d = k.triangle[j].corner[g == 2 ? 0 : g + 1];
                    if (a == c || a == d || b == c || b == d) continue;
                    most = std::max(most, distance_at_crossing(a, b, c, d, n));
                    if (!(most <= enough)) return kFar;
                }
        }
    return most;
}

// Where v belongs: before it was rounded, unless it was merged with others. (For float64 output that is the same.)
const Vec3& place(const Surface& s, int32_t v) {
    const Vec3 &at = s.at(v), &exact = s.exact(v);
    return round_to(Precision::f32, exact) == at ? exact : at;
}
double rounding(const Surface& s, int32_t v) {
    return length(s.at(v) - place(s, v));
}

// The faces that a flip of c is about, as members of regions.
class Neighbourhood {
public:
    Neighbourhood(const Surface& surface, const FlatPatches& book, int32_t c)
        : s(surface), patches(book), f(face_of(c)), g(face_of(s.twin(c))), p(s.vert(c)), q(s.head(c)), u(s.apex(c)),
          v(s.apex(s.twin(c))) {
        of_f = remembered(f);
        of_g = remembered(g);
        base = std::max(base_of(f, of_f), base_of(g, of_g));
        height = std::max(of_f >= 0 ? patches.region(of_f).height : 0, of_g >= 0 ? patches.region(of_g).height : 0);
        size = (of_f >= 0 ? patches.region(of_f).size : 1) + (of_g == of_f && of_g >= 0 ? 0
                                                              : of_g >= 0               ? patches.region(of_g).size
                                                                                        : 1);
    }

    bool is_new() const { return of_f < 0 && of_g < 0; }
    bool inside_one_region() const { return of_f >= 0 && of_f == of_g; }

    // The height of the region after the flip, measured; kFar if it is more than the limit, or not known.
    double measured_height(const MovementLimit& limit) const {
        // Lines along the same direction match what is not flipped as they did before. Split vertices there were rounded within
        // what the height left them.
        const bool part = inside_one_region() && patches.region(of_f).measured;
        const double enough = part ? std::max(height, limit.anywhere - base) : limit.tight() - base;
        Sheet r, k;
        add_reference(f, of_f, r);
        if (of_g < 0 || of_g != of_f) add_reference(g, of_g, r);
        const Vec3 &pp = place(s, p), &qq = place(s, q), &uu = place(s, u), &vv = place(s, v);
        if (!(r.distance(0.5 * (uu + vv)) <= enough)) return kFar; // cheap, and most that fail fail here
        k.add(pp, vv, uu);
        k.add(qq, uu, vv);
        if (part) return std::max(height, sheet_distance(r, k, true, enough));
        int32_t faces[kMostFaces] = {f, g};
        int32_t count = 2;
        double rounded = rounding_of_corners();
        for (int32_t i = 0; i < count; ++i)
            for (int32_t c = 3 * faces[i]; c < 3 * faces[i] + 3; ++c) {
                if (s.is_boundary(c)) continue;
                const int32_t next = face_of(s.twin(c)), region = patches.region_of(next);
                if (region < 0 || (region != of_f && region != of_g)) continue;
                if (std::find(faces, faces + count, next) != faces + count) continue;
                if (count == kMostFaces) return kFar;
                faces[count++] = next;
                add_face(next, k);
                for (int32_t corner = 3 * next; corner < 3 * next + 3; ++corner)
                    rounded = std::max(rounded, rounding(s, s.vert(corner)));
            }
        return sheet_distance(r, k, false, std::min(enough, limit.rounded - base - rounded));
    }

    double rounding_of_corners() const {
        return std::max(std::max(rounding(s, p), rounding(s, q)), std::max(rounding(s, u), rounding(s, v)));
    }

    int32_t of_f, of_g; // regions whose reference is known, or -1
    double base, height;
    int32_t size; // of the reference that both have together

private:
    int32_t remembered(int32_t face) const {
        const int32_t r = patches.region_of(face);
        return r >= 0 && patches.region(r).size != 0 ? r : -1;
    }
    double base_of(int32_t face, int32_t r) const {
        return r >= 0 ? patches.region(r).base + patches.own_drift(face) : patches.moved(face);
    }
    void add_face(int32_t face, Sheet& sheet) const {
        sheet.add(place(s, s.vert(3 * face)), place(s, s.vert(3 * face + 1)), place(s, s.vert(3 * face + 2)));
    }
    void add_reference(int32_t face, int32_t r, Sheet& sheet) const {
        if (r < 0) {
            add_face(face, sheet);
            return;
        }
        int32_t stack[kMostReference] = {r};
        for (int32_t top = 1; top > 0;) {
            const FlatPatches::Region& region = patches.region(stack[--top]);
            if (region.triangle >= 0) {
                sheet.add(patches.triangle(region));
                continue;
            }
            stack[top++] = region.left;
            stack[top++] = region.right;
        }
    }

    const Surface& s;
    const FlatPatches& patches;
    int32_t f, g, p, q, u, v;
};

} // namespace

FreeFlip judge_free_flip(const Surface& s, const FlatPatches& patches, int32_t c, const MovementLimit& limit, bool in_need) {
    FreeFlip flip;
    const int32_t t = s.twin(c);
    const int32_t p = s.vert(c), q = s.head(c), u = s.apex(c), v = s.apex(t);
    const Vec3 &pp = s.at(p), &qq = s.at(q), &uu = s.at(u), &vv = s.at(v);
    const int32_t f = face_of(c), g = face_of(t);
    if (!in_need && (s.on_one_carrier(p, v, u) || s.on_one_carrier(q, u, v))) return flip;
    if (patches.together(f, g)) {
        const Vec3 n = patches.normal(s, f, g);
        if (dot(n, cross(vv - pp, uu - pp)) > 0 && dot(n, cross(uu - qq, vv - qq)) > 0) {
            flip.kind = FreeFlip::in_plane;
            return flip;
        }
    }
    // A cap without any area: its apex lies on the edge, so the flip moves nothing.
    const bool cap_f = zero_area(pp, qq, uu), cap_g = zero_area(pp, qq, vv);
    if (cap_f != cap_g) {
        flip.kind = cap_f ? FreeFlip::first_has_no_area : FreeFlip::second_has_no_area;
        return flip;
    }
    // Within what is left of the tolerance.
    const Neighbourhood around(s, patches, c);
    if (around.base >= limit.tight()) return flip;
    flip.base = around.base;
    flip.remembers = around.size <= kMostReference;
    const Vec3 &from = place(s, p), &to = place(s, q), &left = place(s, u), &right = place(s, v);
    if (around.is_new() && displaces_more(from, to, left, right, limit.tight())) return flip;
    const double step = flip_displacement(from, to, left, right);
    flip.height = around.height + step;
    const double sum = flip.base + flip.height;
    const bool sum_will_do =
        around.is_new() ? sum <= limit.anywhere || (sum <= limit.tight() && sum + around.rounding_of_corners() <= limit.rounded)
                        : sum + (limit.hurried ? 0 : kSpare * step) <= limit.anywhere;
    if (!limit.hurried && flip.remembers && (around.inside_one_region() || (!sum_will_do && !around.is_new()))) {
        const double height = around.measured_height(limit);
        flip.measured = height < kFar;
        if (flip.measured) flip.height = height;
    }
    if (!sum_will_do && !flip.measured) return flip;
    flip.kind = FreeFlip::moves;
    if (!flip.remembers) {
        flip.base = std::max(patches.moved(f), patches.moved(g));
        flip.height = step;
    }
    return flip;
}

void book_free_flip(const Surface& s, FlatPatches& patches, int32_t c, const FreeFlip& flip) {
    const int32_t v_u = next_corner(c), u_v = s.twin(v_u);
    const int32_t f = face_of(c), g = face_of(u_v); // its two faces share the new edge
    if (flip.kind == FreeFlip::in_plane) return patches.mix(f, g, s.face_src[f] == s.face_src[g]);
    if (flip.kind == FreeFlip::first_has_no_area) return patches.follow(f, g);
    if (flip.kind == FreeFlip::second_has_no_area) return patches.follow(g, f);
    const Vec3 &p = place(s, s.vert(c)), &v = place(s, s.vert(v_u)), &u = place(s, s.head(v_u)), &q = place(s, s.apex(u_v));
    int32_t parts[2];
    for (const int i : {0, 1}) {
        const int32_t face = i == 0 ? f : g, r = patches.region_of(face);
        parts[i] = r;
        if (r >= 0 && patches.region(r).size != 0) {
            if (flip.remembers) continue;
            patches.forget_reference(r);
        }
        parts[i] = patches.add_leaf(i == 0 ? FlatPatches::Triangle{{p, q, u}} : FlatPatches::Triangle{{q, p, v}}, flip.base);
    }
    const int32_t region = parts[0] == parts[1] ? parts[0] : patches.unite(parts[0], parts[1]);
    patches.set_moved(region, flip.base, flip.height, flip.measured);
    for (const int32_t face : {f, g}) patches.enter(s, face, region);
}

} // namespace dm
