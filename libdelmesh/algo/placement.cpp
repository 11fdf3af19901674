// SPDX-License-Identifier: Apache-2.0
// The allowable region of a collapse (Dyer, Zhang, Moeller 2007, section 5): half-spaces in which the merged vertex leaves the
// edges around it Delaunay, and the quadric's least point there. The half-spaces of the outer edges are conservative; those of
// the spokes are not where an angle is obtuse, or where the star folds. So what is found is tested like any other place.
#include <algorithm>
#include <cmath>
#include <limits>

#include "algo/decimator.h"

namespace dm {
namespace {

struct HalfSpace {
    Vec3 normal; // of length 1, inwards
    double offset;
    double excess(const Vec3& x) const { return dot(normal, x) - offset; }
};

// Strictly convex quadratic programs in three unknowns, by the dual method (Goldfarb and Idnani 1983): from the unconstrained
// least point, one violated half-space after the other is made active.
class Program {
public:
    explicit Program(const Quadric& q, double stiffness) {
        const double pull = stiffness * (q.xx + q.yy + q.zz);
        const double a = q.xx + pull, d = q.yy + pull, f = q.zz + pull;
        const double co[6] = {d * f - q.yz * q.yz, q.xz * q.yz - q.xy * f, q.xy * q.yz - q.xz * d,
                              a * f - q.xz * q.xz, q.xy * q.xz - a * q.yz, a * d - q.xy * q.xy};
        const double det = a * co[0] + q.xy * co[1] + q.xz * co[2];
        for (int i = 0; i < 6; ++i) inverse_[i] = co[i] / det;
    }

    // x: the unconstrained least point; becomes the constrained one. False if there is none.
    bool solve(const HalfSpace* spaces, int count, double tiny, Vec3& x) {
        int active[3];
        double force[4]; // of the active ones, and of the one that is being added
        int size = 0;
        for (int rounds = 0; rounds < 64; ++rounds) {
            int worst = -1;
            double least = -tiny;
            for (int i = 0; i < count; ++i) {
                const double e = spaces[i].excess(x);
                if (e < least) least = e, worst = i;
            }
            if (worst < 0) return true;
            const Vec3 n = spaces[worst].normal;
            double own = 0;
            for (;;) {
                double r[3] = {0, 0, 0};
                if (!against_active(spaces, active, size, n, r)) return false;
                Vec3 rest = n;
                for (int k = 0; k < size; ++k) rest = rest - r[k] * spaces[active[k]].normal;
                const Vec3 way = times(rest);
                const double slope = dot(way, n);
                const bool moves = size < 3 && slope > 1e-10 * dot(times(n), n);
                double step = moves ? -spaces[worst].excess(x) / slope : std::numeric_limits<double>::infinity();
                int drop = -1;
                for (int k = 0; k < size; ++k)
                    if (r[k] > 0 && force[k] / r[k] < step) step = force[k] / r[k], drop = k;
                if (step == std::numeric_limits<double>::infinity()) return false;
                if (moves) x = x + step * way;
                for (int k = 0; k < size; ++k) force[k] -= step * r[k];
                own += step;
                if (drop < 0) break;
                for (int k = drop; k + 1 < size; ++k) active[k] = active[k + 1], force[k] = force[k + 1];
                --size;
            }
            active[size] = worst;
            force[size++] = own;
        }
        return false;
    }

    // The inverse of the quadratic form.
    Vec3 times(const Vec3& v) const {
        return {inverse_[0] * v.x + inverse_[1] * v.y + inverse_[2] * v.z,
                inverse_[1] * v.x + inverse_[3] * v.y + inverse_[4] * v.z,
                inverse_[2] * v.x + inverse_[4] * v.y + inverse_[5] * v.z};
    }

private:
    // n as it is seen by the active normals, in the metric of the inverse.
    bool against_active(const HalfSpace* spaces, const int* active, int size, const Vec3& n, double* r) const {
        double m[3][4];
        for (int i = 0; i < size; ++i) {
            const Vec3 h = times(spaces[active[i]].normal);
            for (int k = 0; k < size; ++k) m[i][k] = dot(h, spaces[active[k]].normal);
            m[i][size] = dot(h, n);
        }
        for (int i = 0; i < size; ++i) {
            if (!(m[i][i] > 0)) return false;
            for (int k = i + 1; k < size; ++k) {
                const double f = m[k][i] / m[i][i];
                for (int l = i; l <= size; ++l) m[k][l] -= f * m[i][l];
            }
        }
        for (int i = size - 1; i >= 0; --i) {
            r[i] = m[i][size];
            for (int k = i + 1; k < size; ++k) r[i] -= m[i][k] * r[k];
            r[i] /= m[i][i];
        }
        return true;
    }

    double inverse_[6];
};

} // namespace

// Moves the least point, along the way that costs least, to where the volume under the star stays what it is (Lindstrom and Turk,
// Fast and Memory Efficient Polygonal Simplification, 1998): quadrics alone shrink what is round.
Vec3 Decimator::keep_volume(const Star& star, const Quadric& quadric, const Vec3& least) const {
    if (star.open) return least;
    const int32_t c = star.c;
    const Vec3 &a = s.at(s.vert(c)), &b = s.at(s.head(c)), middle = 0.5 * (a + b);
    Vec3 n{0, 0, 0};
    double offset = 0;
    const auto add = [&](const Vec3& normal, const Vec3& on) {
        n = n + normal;
        offset += dot(normal, on - middle);
    };
    for (int i = 0; i < star.count; ++i) add(star.spokes[i].normal, star.spokes[i].at_ring);
    for (const int32_t k : {c, s.twin(c)}) {
        const Vec3 &x = s.at(s.vert(k)), &y = s.at(s.head(k)), &u = s.at(s.apex(k));
        add(cross(y - x, u - x), x);
    }
    const Vec3 way = Program(quadric, kStiffness).times(n);
    const double slope = dot(way, n);
    if (!(slope > 0)) return least;
    const Vec3 w = least + ((offset - dot(n, least - middle)) / slope) * way;
    return length_squared(w - middle) <= 4 * length_squared(b - a) ? w : least;
}

bool Decimator::best_allowed(const Star& star, const Quadric& quadric, const Vec3& near, Vec3& out) const {
    HalfSpace spaces[3 * kMostSpokes];
    int count = 0;
    const Vec3 middle = 0.5 * (s.at(s.vert(star.c)) + s.at(s.head(star.c)));
    const auto add = [&](const Vec3& inwards, const Vec3& through, double further) {
        const double size = length(inwards);
        if (!(size > 0)) return;
        const Vec3 n = (1 / size) * inwards;
        spaces[count++] = {n, dot(n, through - origin) + further};
    };
    for (int i = 0; i < star.count; ++i) {
        const Spoke& spoke = star.spokes[i];
        const Vec3 &a = spoke.at_ring, &b = star.after(i).at_ring;
        // The outer edge: the angle at the merged vertex and that on the far side are no more than 180 degrees.
        if (!spoke.link_frozen && (spoke.beyond >= 0 || rules.boundary_rule)) {
            const Vec3 along = b - a, m = 0.5 * (a + b);
            const double l = length(along);
            double reach = 0.5 * l; // on the boundary the angle is at most 90
            if (spoke.beyond >= 0) {
                const Vec3 u = a - spoke.at_beyond, v = b - spoke.at_beyond;
                const double sine = length(cross(u, v)), cosine = dot(u, v), size = std::sqrt(sine * sine + cosine * cosine);
                if (!(size + cosine > 0)) return false;
                reach *= sine / (size + cosine); // tan of half the angle
            }
            const Vec3 in = middle - m;
            add(in - (dot(in, along) / (l * l)) * along, m, reach);
        }
        // The spoke to a, between its neighbours: outside of the circle's far arc.
        const int before = star.before(i);
        if (before < 0) continue;
        const Vec3& o = star.spokes[before].at_ring;
        const Vec3 oa = o - a, ba = b - a, normal = cross(oa, ba);
        const double area = length_squared(normal);
        if (!(area > 0)) continue;
        const Vec3 to_centre = (0.5 / area) * cross(length_squared(oa) * ba - length_squared(ba) * oa, normal);
        const Vec3 centre = a + to_centre;
        Vec3 way = 0.5 * (o + b) - a; // the arc's middle is across [o, b] from a, on its perpendicular bisector
        const Vec3 ob = b - o;
        way = way - (dot(way, ob) / length_squared(ob)) * ob;
        const double size = length(way);
        if (!(size > 0)) continue;
        const Vec3 r = centre + (length(to_centre) / size) * way;
        for (const Vec3& end : {o, b}) {
            const Vec3 chord = r - end, to = centre - end;
            add(to - (dot(to, chord) / length_squared(chord)) * chord, end, 0);
        }
    }
    Vec3 x = near - origin;
    double size = 0;
    for (int i = 0; i < star.count; ++i) size = std::max(size, length_squared(star.spokes[i].at_ring - middle));
    if (!Program(quadric, kStiffness).solve(spaces, count, 1e-9 * std::sqrt(size), x)) return false;
    out = x + origin;
    return true;
}

} // namespace dm
