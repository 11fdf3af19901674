// SPDX-License-Identifier: Apache-2.0
#include "algo/split_point.h"

#include <algorithm>
#include <cmath>

namespace dm {
namespace {

struct Point2 {
    double x, y;
};

// An edge that a new vertex at (t, 0) would look at, with the inequality t^2 + linear t + constant >= 0 that keeps it Delaunay.
struct Watched {
    double linear, constant;
    bool fixed; // a violation costs a split; otherwise the edge is flipped and the new vertex sees what is behind
    int32_t first_child = 0, children = 0;
    double at(double t) const { return (t + linear) * t + constant; }
};

constexpr int kMostSides = 8;    // sheets of a cut edge looked at
constexpr int kMostWatched = 48; // in all
constexpr double kMargin = 1e-4; // of the edge's length, kept from the ends of cells

class Planner {
public:
    Planner(const Surface& surface, const FlatPatches* flat, bool boundary_rule, bool look_ahead)
        : s(surface), patches(flat), rule(boundary_rule), ahead(look_ahead) {}

    void plan(int32_t c, double resolution, SplitPlan& out) {
        origin = s.at(s.vert(c));
        along = s.at(s.head(c)) - origin;
        length2 = length_squared(along);
        const int32_t t = s.twin(c);
        double sum_k0 = 0, sum_x0 = 0, sum_k1 = 0, sum_x1 = 0; // for the interior edge: both faces together
        const auto side = [&](int32_t k, bool alone) {
            const Point2 u = add_side(k);
            const double h = std::max(u.y, 1e-150), far = 1 - u.x;
            const double k0 = (u.x * u.x + h * h) / h, x0 = u.x / h, k1 = (far * far + h * h) / h, x1 = far / h;
            if (alone) {
                if (!rule) return;
                if (x0 > 0) high = std::min(high, k0 / x0);
                if (x1 > 0) low = std::max(low, 1 - k1 / x1);
            } else {
                sum_k0 += k0, sum_x0 += x0, sum_k1 += k1, sum_x1 += x1;
            }
        };
        if (t >= 0) {
            side(c, false);
            side(t, false);
            if (sum_x0 > 0) high = std::min(high, sum_k0 / sum_x0);
            if (sum_x1 > 0) low = std::max(low, 1 - sum_k1 / sum_x1);
        } else if (is_cut(t)) {
            int32_t slot = cut_slot(t);
            const int32_t start = slot;
            for (int n = 0; n < kMostSides; ++n) {
                side(s.cut_slots[slot].corner, true);
                slot = s.cut_slots[slot].next;
                if (slot == start) break;
            }
        } else {
            side(c, true);
        }
        cut_into_cells(std::max(kMargin, 4 * resolution / std::sqrt(length2)), out);
    }

private:
    // Adds what a new vertex on the edge sees through the face of k. Returns the apex in the plane of that face: x along the
    // edge c, y away from it, in units of the edge's length.
    Point2 add_side(int32_t k) {
        const Vec3 w = s.at(s.apex(k)) - origin;
        const double x = dot(w, along) / length2;
        const Vec3 up = w - x * along;
        const double up_length = length(up);
        const Frame frame{up_length > 0 ? (1 / up_length) * up : Vec3{0, 0, 0}};
        const Point2 u{x, up_length / std::sqrt(length2)};
        // Seen from (t, 0), counter-clockwise: from the head of the edge to the apex, then from the apex to the start. For a
        // corner whose edge runs against c (the twin), start and head change places; the order does not matter to the inequality.
        const Point2 start = flat(s.vert(k), frame), head = flat(s.head(k), frame);
        const int32_t first = watch(next_corner(k), head, u);
        const int32_t second = watch(prev_corner(k), u, start);
        if (first >= 0) roots[root_count++] = first;
        if (second >= 0) roots[root_count++] = second;
        if (ahead && first >= 0) look_behind(first, next_corner(k), frame, 0);
        if (ahead && second >= 0) look_behind(second, prev_corner(k), frame, 0);
        return u;
    }

    struct Frame {
        Vec3 up;
    };
    Point2 flat(int32_t v, const Frame& f) const {
        const Vec3 w = s.at(v) - origin;
        return {dot(w, along) / length2, dot(w, f.up) / std::sqrt(length2)};
    }

    bool free_to_flip(int32_t k) const {
        if (s.is_boundary(k) || s.is_kept(k)) return false;
        if (patches == nullptr) return true;
        return patches->together(face_of(k), face_of(s.twin(k)));
    }

    int32_t watch(int32_t k, const Point2& a, const Point2& b) {
        if (watched_count == kMostWatched) return -1;
        if (!s.owns(s.vert(k)) && !s.owns(s.head(k))) return -1; // what is behind may be another part's
        const bool fixed = !free_to_flip(k);
        if (!fixed && patches == nullptr) return -1; // flip mode: it will be flipped at no cost
        if (s.is_boundary(k) && !rule) return -1;
        double cotangent = 0;
        if (!s.is_boundary(k)) {
            const Vec3 z = s.at(s.apex(s.twin(k)));
            const Vec3 p = s.at(s.vert(k)) - z, q = s.at(s.head(k)) - z;
            const double d = dot(p, q), area = length(cross(p, q));
            if (!(area > 1e-14 * std::fabs(d))) {
                if (d > 0) return -1; // a needle's far end: never violated
                cotangent = -1e14;
            } else
                cotangent = d / area;
        }
        // With the new vertex n = (t, 0): dot(a - n, b - n) + cotangent cross >= 0, where cross is positive in front of the edge.
        Point2 p = a, q = b;
        double cross0 = p.x * q.y - p.y * q.x, cross1 = p.y - q.y;
        if (cross0 + 0.5 * cross1 < 0) cross0 = -cross0, cross1 = -cross1;
        Watched& w = watched[watched_count];
        w.linear = -(p.x + q.x) + cotangent * cross1;
        w.constant = p.x * q.x + p.y * q.y + cotangent * cross0;
        w.fixed = fixed;
        w.children = 0;
        return watched_count++;
    }

    // Faces behind an edge that would be flipped.
    void look_behind(int32_t index, int32_t k, const Frame& frame, int depth) {
        if (watched[index].fixed || depth == 6) return;
        if (!has_roots(watched[index])) return;
        const int32_t t = s.twin(k);
        const Point2 a = flat(s.vert(t), frame), b = flat(s.head(t), frame), z = flat(s.apex(t), frame);
        const int32_t first = watch(next_corner(t), b, z);
        const int32_t second = watch(prev_corner(t), z, a);
        watched[index].first_child = child_count;
        if (first >= 0) children[child_count++] = first, ++watched[index].children;
        if (second >= 0) children[child_count++] = second, ++watched[index].children;
        if (first >= 0) look_behind(first, next_corner(t), frame, depth + 1);
        if (second >= 0) look_behind(second, prev_corner(t), frame, depth + 1);
    }

    static bool has_roots(const Watched& w) { return w.linear * w.linear > 4 * w.constant; }

    int violations(int32_t index, double t) const {
        const Watched& w = watched[index];
        if (w.at(t) >= 0) return 0;
        if (w.fixed) return 1;
        int n = 0;
        for (int32_t i = 0; i < w.children; ++i) n += violations(children[w.first_child + i], t);
        return n;
    }
    int cost(double t) const {
        int n = ((t > high ? 1 : 0) + (t < low ? 1 : 0)) * (ahead ? 1 : kMostWatched);
        for (int i = 0; i < root_count; ++i) n += violations(roots[i], t);
        return n;
    }

    void cut_into_cells(double margin, SplitPlan& out) {
        double cuts[2 * kMostWatched + 4];
        int n = 0;
        const double end = std::min(0.25, margin);
        const auto add = [&](double t) {
            if (t > end && t < 1 - end) cuts[n++] = t;
        };
        cuts[n++] = end;
        cuts[n++] = 1 - end;
        add(low);
        add(high);
        for (int i = 0; i < watched_count; ++i) {
            const Watched& w = watched[i];
            if (!has_roots(w)) continue;
            const double root = std::sqrt(w.linear * w.linear - 4 * w.constant);
            add(0.5 * (-w.linear - root));
            add(0.5 * (-w.linear + root));
        }
        std::sort(cuts, cuts + n);
        struct Candidate {
            int cost;
            double t, off_middle, from, to;
        } candidates[2 * kMostWatched + 4];
        int found = 0;
        for (int i = 0; i + 1 < n; ++i) {
            const double width = cuts[i + 1] - cuts[i];
            if (!(width > 0)) continue;
            const double keep = std::min(margin, 0.25 * width);
            const double from = cuts[i] + keep, to = cuts[i + 1] - keep;
            const double t = std::min(std::max(0.5, from), to);
            candidates[found++] = {cost(t), t, std::fabs(t - 0.5), from, to};
        }
        std::sort(candidates, candidates + found, [](const Candidate& a, const Candidate& b) {
            if (a.cost != b.cost) return a.cost < b.cost;
            if (a.off_middle != b.off_middle) return a.off_middle < b.off_middle;
            return a.t < b.t;
        });
        out.count = std::min(found, SplitPlan::kMost);
        for (int i = 0; i < out.count; ++i) {
            out.t[i] = candidates[i].t;
            out.from[i] = candidates[i].from;
            out.to[i] = candidates[i].to;
        }
        out.equals = 0;
        while (out.equals < out.count && candidates[out.equals].cost == candidates[0].cost) ++out.equals;
    }

    const Surface& s;
    const FlatPatches* patches;
    const bool rule, ahead;
    Vec3 origin{}, along{};
    double length2 = 0;
    double low = 0, high = 1; // both pieces are Delaunay between these
    Watched watched[kMostWatched];
    int32_t roots[2 * kMostSides], children[2 * kMostWatched];
    int watched_count = 0, root_count = 0, child_count = 0;
};

} // namespace

void plan_split(const Surface& surface, const FlatPatches* patches, bool boundary_rule, bool look_ahead, double resolution,
                int32_t c, SplitPlan& plan) {
    Planner(surface, patches, boundary_rule, look_ahead).plan(c, resolution, plan);
}

double shell_fraction(double length, double unit) {
    const double half = 0.5 * length / unit;
    int exponent;
    std::frexp(half, &exponent); // half in [2^(e-1), 2^e)
    const double below = std::ldexp(1.0, exponent - 1), above = 2 * below;
    const double shell = half - below <= above - half ? below : above;
    const double fraction = shell / (length / unit);
    return fraction > 0 && fraction < 1 ? fraction : 0.5; // a unit out of all proportion
}

} // namespace dm
