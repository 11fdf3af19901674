// SPDX-License-Identifier: Apache-2.0
// The predicates against a second implementation that shares nothing with them: GMP integers, and cross products where the
// library compares cosines. Cases are made from a seed; half of the degenerate ones are then moved off by single ulps.
#include "shim_predicates.h"

#include <gmp.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "geom/predicates.h"

using dm::Vec3;

namespace {

// -- exact answers

struct Int {
    mpz_t z;
    Int() { mpz_init(z); }
    ~Int() { mpz_clear(z); }
    Int(const Int&) = delete;
    Int& operator=(const Int&) = delete;
    int sign() const { return mpz_sgn(z); }
};

// A vector of integers, and the few operations; results are always other objects than the operands.
struct IntVec {
    Int x, y, z;
};
void subtract(IntVec& r, const IntVec& a, const IntVec& b) {
    mpz_sub(r.x.z, a.x.z, b.x.z);
    mpz_sub(r.y.z, a.y.z, b.y.z);
    mpz_sub(r.z.z, a.z.z, b.z.z);
}
void cross(IntVec& r, const IntVec& a, const IntVec& b) {
    mpz_mul(r.x.z, a.y.z, b.z.z);
    mpz_submul(r.x.z, a.z.z, b.y.z);
    mpz_mul(r.y.z, a.z.z, b.x.z);
    mpz_submul(r.y.z, a.x.z, b.z.z);
    mpz_mul(r.z.z, a.x.z, b.y.z);
    mpz_submul(r.z.z, a.y.z, b.x.z);
}
void dot(Int& r, const IntVec& a, const IntVec& b) {
    mpz_mul(r.z, a.x.z, b.x.z);
    mpz_addmul(r.z, a.y.z, b.y.z);
    mpz_addmul(r.z, a.z.z, b.z.z);
}
bool is_zero(const IntVec& a) {
    return a.x.sign() == 0 && a.y.sign() == 0 && a.z.sign() == 0;
}

struct Answers {
    int nld, tie, near_tie, boundary_nld, right, zero_area, orientation, flat, fold_sign, other_sign;
};

// All answers for one set of points a, b, p, q.
class Reference {
public:
    Answers solve(const Vec3 (&points)[4]) {
        load(points);
        const IntVec &a = point_[0], &b = point_[1], &p = point_[2], &q = point_[3];
        Answers r{};
        side(d1_, t1_, n1_, a, b, p); // d, s^2, u x v
        side(d2_, t2_, n2_, a, b, q);
        r.boundary_nld = d1_.sign() < 0;
        r.right = d1_.sign() == 0 && !is_zero(u_of_p_) && !is_zero(v_of_p_);
        r.zero_area = t1_.sign() == 0;

        // e = s1 d2 + s2 d1 from the squares and signs of its terms
        mpz_mul(left_.z, d2_.z, d2_.z);
        mpz_mul(left_.z, left_.z, t1_.z);
        mpz_mul(right_.z, d1_.z, d1_.z);
        mpz_mul(right_.z, right_.z, t2_.z);
        const int left = t1_.sign() * d2_.sign(), right = t2_.sign() * d1_.sign();
        const int order = mpz_cmp(left_.z, right_.z); // of |s1 d2| and |s2 d1|
        const int e = left * right >= 0 ? (left + right > 0) - (left + right < 0) : left > 0 ? order : -order;
        r.nld = e < 0 || (t1_.sign() == 0 && t2_.sign() == 0 && d1_.sign() < 0 && d2_.sign() < 0);
        r.tie = e == 0;
        if (left * right < 0 && e != 0) {
            mpz_sub(e_.z, left_.z, right_.z);
            mpz_abs(e_.z, e_.z);
            long order_e = 0, order_l = 0;
            const double m = mpz_get_d_2exp(&order_e, e_.z), l = mpz_get_d_2exp(&order_l, (order > 0 ? left_ : right_).z);
            r.near_tie = std::ldexp(m / l, static_cast<int>(order_e - order_l)) < 2e-12; // squares: twice the relative difference
        }

        subtract(u_, a, q);
        subtract(v_, b, q);
        subtract(w_, p, q);
        cross(n_, u_, v_);
        dot(e_, n_, w_);
        r.orientation = -e_.sign(); // the vectors point away from q

        // n1 is (a - p) x (b - p), the normal of (a, b, p); that of (b, a, q) is minus n2
        dot(e_, n1_, n2_);
        r.fold_sign = -e_.sign();
        r.flat = r.orientation == 0 && r.fold_sign > 0;

        // normals of (a, p, q) and (b, q, p), from other corners than the library's
        subtract(u_, q, p);
        subtract(v_, a, p);
        cross(n1_, u_, v_);
        subtract(w_, b, p);
        cross(n2_, w_, u_);
        dot(e_, n1_, n2_);
        r.other_sign = e_.sign();
        return r;
    }

private:
    void load(const Vec3 (&points)[4]) {
        int unit = 2000;
        for (const Vec3& p : points) {
            for (const double x : {p.x, p.y, p.z}) {
                int e = 0;
                if (std::frexp(x, &e) != 0) unit = std::min(unit, e - 53);
            }
        }
        for (int i = 0; i < 4; ++i) {
            set(point_[i].x, points[i].x, unit);
            set(point_[i].y, points[i].y, unit);
            set(point_[i].z, points[i].z, unit);
        }
    }
    static void set(Int& r, double x, int unit) {
        int e = 0;
        const double m = std::frexp(x, &e);
        mpz_set_d(r.z, std::ldexp(m, 53));
        if (m != 0) mpz_mul_2exp(r.z, r.z, static_cast<mp_bitcnt_t>(e - 53 - unit));
    }
    void side(Int& d, Int& s_squared, IntVec& n, const IntVec& a, const IntVec& b, const IntVec& apex) {
        IntVec &u = &apex == &point_[2] ? u_of_p_ : u_, &v = &apex == &point_[2] ? v_of_p_ : v_;
        subtract(u, a, apex);
        subtract(v, b, apex);
        dot(d, u, v);
        cross(n, u, v);
        dot(s_squared, n, n);
    }

    IntVec point_[4], u_, v_, w_, u_of_p_, v_of_p_, n_, n1_, n2_;
    Int d1_, d2_, t1_, t2_, left_, right_, e_;
};

// -- cases

class Random {
public:
    explicit Random(uint64_t seed) : state_(seed) {}
    uint64_t bits() { // splitmix64
        uint64_t z = state_ += 0x9e3779b97f4a7c15u;
        z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
        z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
        return z ^ (z >> 31);
    }
    int64_t in(int64_t low, int64_t high) { return low + static_cast<int64_t>(bits() % static_cast<uint64_t>(high - low + 1)); }
    bool one_in(int64_t n) { return in(1, n) == 1; }
    double unit() { return static_cast<double>(bits() >> 11) * 0x1p-53 * 2 - 1; } // -1 .. 1

private:
    uint64_t state_;
};

struct Lattice {
    int64_t x, y, z;
};

class Cases {
public:
    explicit Cases(uint64_t seed) : random_(seed) {
        for (const int64_t r : {5, 25, 65, 325, 1105}) {
            std::vector<Lattice> circle; // counter-clockwise
            for (int64_t x = -r; x <= r; ++x) {
                for (int64_t y = -r; y <= r; ++y) {
                    if (x * x + y * y == r * r) circle.push_back({x, y, 0});
                }
            }
            std::sort(circle.begin(), circle.end(),
                      [](const Lattice& a, const Lattice& b) { return std::atan2(a.y, a.x) < std::atan2(b.y, b.x); });
            circles_.push_back(circle);
        }
    }

    void random_single(Vec3 (&p)[4]) { uniform(p, true, static_cast<int>(random_.in(-149, 127))); }
    void random_double(Vec3 (&p)[4]) { uniform(p, false, static_cast<int>(random_.in(-1074, 1023))); }
    // Every coordinate with an exponent of its own.
    void random_wild(Vec3 (&p)[4]) {
        const bool single = random_.one_in(2);
        const int middle = static_cast<int>(single ? random_.in(-126, 127) : random_.in(-1074, 1023));
        const int spread = static_cast<int>(random_.in(0, single ? 250 : 2100));
        const int lowest = single ? -149 : -1074, highest = single ? 127 : 1023;
        for (Vec3& v : p) {
            for (double* c : {&v.x, &v.y, &v.z}) {
                const int e = middle + static_cast<int>(random_.in(-spread, spread));
                *c = round(std::ldexp(random_.unit(), std::clamp(e, lowest, highest)), single);
            }
        }
    }
    // Apexes within 1e-1 .. 1e-16 of the line of the edge: angles near 0 and 180.
    void random_thin(Vec3 (&p)[4]) {
        const bool single = random_.one_in(2);
        const Vec3 a{random_.unit(), random_.unit(), random_.unit()}, b{random_.unit(), random_.unit(), random_.unit()};
        p[0] = a;
        p[1] = b;
        for (int i = 2; i < 4; ++i) {
            const double t = random_.unit() * 1.5, h = std::pow(10.0, -static_cast<double>(random_.in(1, 16)));
            const Vec3 off{random_.unit() * h, random_.unit() * h, random_.unit() * h};
            p[i] = a + t * (b - a) + off;
        }
        scale(p, single, static_cast<int>(single ? random_.in(-120, 100) : random_.in(-1000, 1000)));
    }

    // Four points of a circle: a sum of exactly 180 degrees.
    void cocircular(Vec3 (&p)[4]) {
        Lattice c[4];
        four_of_circle(c);
        const Lattice l[4] = {c[0], c[2], c[1], c[3]};
        place(p, l, 0);
    }
    // The same, folded about the edge.
    void folded(Vec3 (&p)[4]) {
        Lattice l[4];
        mirrored_edge(l);
        fold(l);
        place(p, l, 3);
    }
    // The edge is a diameter: two right angles, folded or not.
    void right_angles(Vec3 (&p)[4]) {
        const std::vector<Lattice>& circle = any_circle();
        const int64_t n = static_cast<int64_t>(circle.size()), i = random_.in(0, n - 1);
        const auto at = [&](int64_t k) { return circle[static_cast<size_t>(k % n)]; };
        Lattice l[4] = {at(i), at(i + n / 2), at(i + random_.in(1, n / 2 - 1)), at(i + n / 2 + random_.in(1, n / 2 - 1))};
        if (random_.one_in(2)) { // (0, -y), (0, y) exists on every circle: fold about it
            const int64_t r = std::abs(circle[0].x) + std::abs(circle[0].y);
            l[0] = {0, -r, 0};
            l[1] = {0, r, 0};
            do {
                l[2] = at(random_.in(0, n - 1));
            } while (l[2].x <= 0);
            do {
                l[3] = at(random_.in(0, n - 1));
            } while (l[3].x >= 0);
            fold(l);
        }
        place(p, l, 3);
    }
    // Three or four points on a line, at times coincident.
    void collinear(Vec3 (&p)[4]) {
        const Lattice o{random_.in(-40, 40), random_.in(-40, 40), random_.in(-40, 40)};
        const Lattice d{random_.in(-9, 9), random_.in(-9, 9), random_.in(-9, 9)};
        Lattice l[4];
        for (Lattice& c : l) {
            const int64_t t = random_.in(-6, 6);
            c = {o.x + t * d.x, o.y + t * d.y, o.z + t * d.z};
        }
        if (random_.one_in(2)) l[3] = {random_.in(-40, 40), random_.in(-40, 40), random_.in(-40, 40)};
        if (random_.one_in(4)) std::swap(l[2], l[3]);
        if (random_.one_in(2)) return place(p, l, 6);
        // the same, stretched unevenly to 50 bits: products round
        const int64_t stretch[3] = {random_.in(1, int64_t{1} << 42), random_.in(1, int64_t{1} << 42),
                                    random_.in(1, int64_t{1} << 42)};
        for (int i = 0; i < 4; ++i) p[i] = to_vec({l[i].x * stretch[0], l[i].y * stretch[1], l[i].z * stretch[2]});
        scale(p, false, any_scale(false));
        if (random_.one_in(4)) nudge(p, false);
    }
    // Coplanar, convex or folded over.
    void coplanar(Vec3 (&p)[4]) {
        Lattice l[4];
        for (Lattice& c : l) c = {random_.in(-999, 999), random_.in(-999, 999), 0};
        place(p, l, 2);
    }
    // Few values, so that every kind of degeneracy occurs; far from the origin.
    void tiny_grid(Vec3 (&p)[4]) {
        const int64_t r = random_.in(1, 3);
        const Lattice o{random_.in(-1, 1) << random_.in(2, 22), random_.in(-1, 1) << random_.in(2, 22), 0};
        Lattice l[4];
        for (Lattice& c : l) c = {o.x + random_.in(-r, r), o.y + random_.in(-r, r), o.z + random_.in(-r, r)};
        for (int i = 0; i < 4; ++i) p[i] = to_vec(l[i]);
        const bool single = random_.one_in(2);
        scale(p, single, any_scale(single));
        if (random_.one_in(4)) nudge(p, single);
    }
    // Four points of a circle turned by any angle and rounded: ties but for the rounding.
    void rounded(Vec3 (&p)[4]) {
        Lattice c[4];
        if (random_.one_in(2)) {
            four_of_circle(c);
            std::swap(c[1], c[2]);
        } else {
            mirrored_edge(c);
            fold(c);
        }
        const Vec3 e{random_.unit(), random_.unit(), random_.unit()};
        const Vec3 f = dm::cross(e, Vec3{random_.unit(), random_.unit(), random_.unit()});
        if (dm::length(f) < 1e-3) return rounded(p);
        const Vec3 x = 1 / dm::length(e) * e, y = 1 / dm::length(f) * f, z = dm::cross(x, y);
        for (int i = 0; i < 4; ++i) {
            const Vec3 v = to_vec(c[i]);
            p[i] = v.x * x + v.y * y + v.z * z;
        }
        const bool single = random_.one_in(2);
        scale(p, single, static_cast<int>(single ? random_.in(-130, 100) : random_.in(-1040, 1000)));
    }
    // Coordinates of one axis are multiples of the smallest double, or near the largest: differences overflow.
    void extreme(Vec3 (&p)[4]) {
        Lattice l[4];
        if (random_.one_in(2)) {
            four_of_circle(l);
            std::swap(l[1], l[2]);
        } else {
            for (Lattice& c : l) c = {random_.in(-3, 3), random_.in(-3, 3), random_.in(-3, 3)};
        }
        int64_t largest = 1;
        for (int i = 0; i < 4; ++i) {
            p[i] = to_vec(l[i]);
            largest = std::max({largest, std::abs(l[i].x), std::abs(l[i].y), std::abs(l[i].z)});
        }
        const int top = 1023 - std::ilogb(static_cast<double>(largest));
        const int common = random_.one_in(2) ? top : -1074;
        int e[3];
        for (int& k : e) k = random_.one_in(2) ? common : static_cast<int>(random_.in(-1074, top));
        for (Vec3& v : p) v = {std::ldexp(v.x, e[0]), std::ldexp(v.y, e[1]), std::ldexp(v.z, e[2])};
        if (random_.one_in(2)) nudge(p, false);
    }

private:
    static Vec3 to_vec(const Lattice& l) {
        return {static_cast<double>(l.x), static_cast<double>(l.y), static_cast<double>(l.z)};
    }
    static double round(double x, bool single) {
        if (!single) return x;
        volatile float f = static_cast<float>(x);
        return static_cast<double>(f);
    }
    // Exponents; for doubles also those where products of two, three and four begin to underflow.
    int any_scale(bool single) {
        if (single) return static_cast<int>(random_.in(-149, 100));
        if (random_.one_in(2)) return static_cast<int>(random_.in(-1074, 940));
        return static_cast<int>(-1074 / random_.in(2, 4) - random_.in(-5, 50));
    }

    void uniform(Vec3 (&p)[4], bool single, int exponent) {
        const Vec3 offset = random_.one_in(2) ? Vec3{0, 0, 0} : Vec3{random_.unit(), random_.unit(), random_.unit()};
        const double size = std::ldexp(1.0, -static_cast<int>(random_.in(1, single ? 22 : 50)));
        for (Vec3& v : p) v = 0.5 * offset + size * Vec3{random_.unit(), random_.unit(), random_.unit()};
        scale(p, single, exponent);
    }
    static void scale(Vec3 (&p)[4], bool single, int exponent) {
        for (Vec3& v : p) {
            for (double* c : {&v.x, &v.y, &v.z}) *c = round(std::ldexp(*c, exponent), single);
        }
    }
    // One to three coordinates by one unit in the last place.
    void nudge(Vec3 (&p)[4], bool single) {
        for (int64_t k = random_.in(1, 3); k > 0; --k) {
            Vec3& v = p[random_.in(0, 3)];
            double* const c[3] = {&v.x, &v.y, &v.z};
            double& x = *c[random_.in(0, 2)];
            const double to = random_.one_in(2) ? HUGE_VAL : -HUGE_VAL;
            const double moved = single ? static_cast<double>(std::nextafterf(static_cast<float>(x), static_cast<float>(to)))
                                        : std::nextafter(x, to);
            if (std::isfinite(moved)) x = moved;
        }
    }

    const std::vector<Lattice>& any_circle() {
        return circles_[static_cast<size_t>(random_.in(0, static_cast<int64_t>(circles_.size()) - 1))];
    }
    // Four different points in cyclic order.
    void four_of_circle(Lattice (&c)[4]) {
        const std::vector<Lattice>& circle = any_circle();
        int64_t k[4];
        do {
            for (int64_t& i : k) i = random_.in(0, static_cast<int64_t>(circle.size()) - 1);
            std::sort(k, k + 4);
        } while (k[0] == k[1] || k[1] == k[2] || k[2] == k[3]);
        const int64_t turn = random_.in(0, 3);
        for (int64_t i = 0; i < 4; ++i) c[i] = circle[static_cast<size_t>(k[(i + turn) % 4])];
    }
    // a, b one above the other, p and q on the same circle to the left and right.
    void mirrored_edge(Lattice (&l)[4]) {
        const std::vector<Lattice>& circle = any_circle();
        const auto any = [&] { return circle[static_cast<size_t>(random_.in(0, static_cast<int64_t>(circle.size()) - 1))]; };
        const int64_t r = std::abs(circle[0].x) + std::abs(circle[0].y); // circle[0] is on an axis
        do {
            l[0] = any();
        } while (l[0].y == 0 || std::abs(l[0].x) >= r);
        l[1] = {l[0].x, -l[0].y, 0};
        do {
            l[2] = any();
        } while (l[2].x >= l[0].x);
        do {
            l[3] = any();
        } while (l[3].x <= l[0].x);
    }
    // Turns q about the vertical line of the edge by an angle with a rational sine and cosine.
    void fold(Lattice (&l)[4]) {
        static const int64_t triples[][3] = {{3, 4, 5}, {5, 12, 13}, {-3, 4, 5}, {-5, -12, 13},
                                             {0, 1, 1}, {8, 15, 17}, {-1, 0, 1}};
        const int64_t* t = triples[random_.in(0, 6)];
        const int64_t axis = l[0].x;
        for (Lattice& c : l) c = {t[2] * (c.x - axis), t[2] * c.y, 0};
        const int64_t x = l[3].x / t[2];
        l[3].x = x * t[0];
        l[3].z = x * t[1];
    }
    // Turns by an integer quaternion (which scales), moves, and scales by a power of two: exact in the precision drawn. Then one
    // case in two is moved off by an ulp. spare: bits by which the lattice points are longer than 2^11.
    void place(Vec3 (&p)[4], const Lattice (&l)[4], int spare) {
        const int64_t w = random_.in(-2, 2), x = random_.in(-2, 2), y = random_.in(-2, 2), z = random_.in(-2, 2);
        if (w == 0 && x == 0 && y == 0 && z == 0) return place(p, l, spare);
        const int64_t m[3][3] = {{w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)},
                                 {2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)},
                                 {2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z}};
        const bool single = random_.one_in(2);
        const int room = single ? 21 : 50; // the turn adds at most 6 bits, the offset fits below 2^(room + 1)
        const int64_t factor = single ? 1 : random_.in(1, int64_t{1} << (20 - spare));
        const int64_t reach = random_.one_in(3) ? 0 : int64_t{1} << random_.in(0, room);
        const int64_t o[3] = {random_.in(-reach, reach), random_.in(-reach, reach), random_.in(-reach, reach)};
        for (int i = 0; i < 4; ++i) {
            const int64_t c[3] = {l[i].x * factor, l[i].y * factor, l[i].z * factor};
            p[i] = to_vec({m[0][0] * c[0] + m[0][1] * c[1] + m[0][2] * c[2] + o[0],
                           m[1][0] * c[0] + m[1][1] * c[1] + m[1][2] * c[2] + o[1],
                           m[2][0] * c[0] + m[2][1] * c[1] + m[2][2] * c[2] + o[2]});
        }
        scale(p, single, any_scale(single));
        if (random_.one_in(2)) nudge(p, single);
    }

    Random random_;
    std::vector<std::vector<Lattice>> circles_;
};

struct Family {
    const char* name;
    void (Cases::*make)(Vec3 (&)[4]);
};
const Family kFamilies[] = {
    {"random float32", &Cases::random_single},
    {"random float64", &Cases::random_double},
    {"random, an exponent for each coordinate", &Cases::random_wild},
    {"random, thin", &Cases::random_thin},
    {"cocircular", &Cases::cocircular},
    {"cocircular, folded at the edge", &Cases::folded},
    {"right angles", &Cases::right_angles},
    {"collinear", &Cases::collinear},
    {"coplanar", &Cases::coplanar},
    {"tiny grid, far away", &Cases::tiny_grid},
    {"cocircular, turned and rounded", &Cases::rounded},
    {"subnormal and overflowing", &Cases::extreme},
};
constexpr int32_t kRandomFamilies = 4;

// Notes the first wrong answer.
void check(shim_campaign& r, const char* what, const Vec3 (&p)[4], int got, int expected) {
    ++r.checks;
    if (got == expected) return;
    if (r.wrong++ != 0) return;
    int n = std::snprintf(r.first_wrong, sizeof r.first_wrong, "%s: %d instead of %d for", what, got, expected);
    for (const Vec3& v : p) {
        n += std::snprintf(r.first_wrong + n, sizeof r.first_wrong - static_cast<size_t>(n), " (%a, %a, %a)", v.x, v.y, v.z);
    }
}

Vec3 vec(const double* a) {
    return {a[0], a[1], a[2]};
}

} // namespace

extern "C" {

int shim_edge_is_nld(const double* a, const double* b, const double* p, const double* q) {
    return dm::edge_is_nld(vec(a), vec(b), vec(p), vec(q));
}
int shim_edge_needs_exact(const double* a, const double* b, const double* p, const double* q) {
    int64_t exact_calls = 0;
    dm::edge_is_nld(vec(a), vec(b), vec(p), vec(q), exact_calls);
    return static_cast<int>(exact_calls);
}
int shim_boundary_edge_is_nld(const double* a, const double* b, const double* p) {
    return dm::boundary_edge_is_nld(vec(a), vec(b), vec(p));
}
int shim_zero_area(const double* a, const double* b, const double* c) {
    return dm::zero_area(vec(a), vec(b), vec(c));
}
int shim_orientation(const double* a, const double* b, const double* c, const double* d) {
    return dm::orientation(vec(a), vec(b), vec(c), vec(d));
}
int shim_flat_edge(const double* a, const double* b, const double* p, const double* q) {
    return dm::flat_edge(vec(a), vec(b), vec(p), vec(q));
}
int shim_normals_dot_sign(const double* a, const double* b, const double* c, const double* d, const double* e, const double* f) {
    return dm::normals_dot_sign(vec(a), vec(b), vec(c), vec(d), vec(e), vec(f));
}

int32_t shim_families(void) {
    return static_cast<int32_t>(sizeof kFamilies / sizeof *kFamilies);
}
int32_t shim_random_families(void) {
    return kRandomFamilies;
}
const char* shim_family_name(int32_t family) {
    return kFamilies[family].name;
}

shim_campaign shim_run_campaign(int32_t family, uint64_t seed, int64_t cases) {
    shim_campaign r = {};
    Cases source(seed * 1000003 + static_cast<uint64_t>(family));
    Reference reference;
    for (r.cases = 0; r.cases < cases; ++r.cases) {
        Vec3 points[4];
        (source.*kFamilies[family].make)(points);
        const Vec3 &a = points[0], &b = points[1], &p = points[2], &q = points[3];
        const Answers e = reference.solve(points);
        r.nld += e.nld;
        r.ties += e.tie;
        r.near_ties += e.near_tie;
        r.right += e.right;
        r.flat += e.flat;
        r.zero_areas += e.zero_area;
        check(r, "edge_is_nld", points, dm::edge_is_nld(a, b, p, q, r.exact_calls), e.nld);
        check(r, "edge_is_nld (b, a)", points, dm::edge_is_nld(b, a, p, q), e.nld);
        check(r, "edge_is_nld (q, p)", points, dm::edge_is_nld(a, b, q, p), e.nld);
        check(r, "boundary_edge_is_nld", points, dm::boundary_edge_is_nld(a, b, p), e.boundary_nld);
        check(r, "zero_area", points, dm::zero_area(a, b, p), e.zero_area);
        check(r, "orientation", points, dm::orientation(a, b, p, q), e.orientation);
        check(r, "flat_edge", points, dm::flat_edge(a, b, p, q), e.flat);
        check(r, "normals_dot_sign", points, dm::normals_dot_sign(a, b, p, b, a, q), e.fold_sign);
        check(r, "normals_dot_sign (2)", points, dm::normals_dot_sign(a, p, q, b, q, p), e.other_sign);
    }
    return r;
}

} // extern "C"
