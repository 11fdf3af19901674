// SPDX-License-Identifier: Apache-2.0
// Error quadrics (Garland and Heckbert, Surface Simplification Using Quadric Error Metrics, 1997): the sum of the squared
// distances of a point to planes, each weighted by the area it stands for. Ten numbers, in which planes and regions add up.
#pragma once

#include "base/vec.h"

namespace dm {

struct Quadric {
    double xx = 0, xy = 0, xz = 0, yy = 0, yz = 0, zz = 0; // x' A x
    double bx = 0, by = 0, bz = 0, c = 0;                  // + 2 b' x + c

    // The plane through `point` with the unit vector `normal`.
    static Quadric of_plane(const Vec3& normal, const Vec3& point, double weight) {
        const double d = -dot(normal, point);
        const Vec3 n = weight * normal;
        return {n.x * normal.x, n.x * normal.y, n.x * normal.z, n.y * normal.y, n.y * normal.z,
                n.z * normal.z, n.x * d,        n.y * d,        n.z * d,        weight * d * d};
    }
    void operator+=(const Quadric& o) {
        xx += o.xx, xy += o.xy, xz += o.xz, yy += o.yy, yz += o.yz, zz += o.zz;
        bx += o.bx, by += o.by, bz += o.bz, c += o.c;
    }
    Quadric operator+(const Quadric& o) const {
        Quadric sum = *this;
        sum += o;
        return sum;
    }
    void operator*=(double s) {
        xx *= s, xy *= s, xz *= s, yy *= s, yz *= s, zz *= s;
        bx *= s, by *= s, bz *= s, c *= s;
    }
    // Half of the gradient.
    Vec3 slope(const Vec3& p) const {
        return {xx * p.x + xy * p.y + xz * p.z + bx, xy * p.x + yy * p.y + yz * p.z + by, xz * p.x + yz * p.y + zz * p.z + bz};
    }
    // Never below 0, where rounding alone would make it so.
    double at(const Vec3& p) const {
        const double e = dot(p, slope(p)) + bx * p.x + by * p.y + bz * p.z + c;
        return e > 0 ? e : 0;
    }
    // The least point; where A hardly cares (planes, straight edges), the one nearest to `near`: `stiffness` of A's trace pulls
    // towards it. False where A is 0.
    bool least(const Vec3& near, double stiffness, Vec3& out) const {
        const double pull = stiffness * (xx + yy + zz);
        const double a = xx + pull, d = yy + pull, f = zz + pull;
        const Vec3 g = slope(near);
        const double co_a = d * f - yz * yz, co_b = xz * yz - xy * f, co_c = xy * yz - xz * d;
        const double det = a * co_a + xy * co_b + xz * co_c;
        if (!(det > 0)) return false;
        const double co_d = a * f - xz * xz, co_e = xy * xz - a * yz, co_f = a * d - xy * xy, inverse = -1 / det;
        out = near + Vec3{inverse * (co_a * g.x + co_b * g.y + co_c * g.z), inverse * (co_b * g.x + co_d * g.y + co_e * g.z),
                          inverse * (co_c * g.x + co_e * g.y + co_f * g.z)};
        return true;
    }
};

} // namespace dm
