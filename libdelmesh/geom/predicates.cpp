// SPDX-License-Identifier: Apache-2.0
// The predicates past their inline fast path: a floating-point filter, then integers, all coordinates times one power of two.
// Most of what gets that far is an exact tie of short coordinates (float32, CAD grids): there products of two fit 128 bits, and
// only products of products go to integers of any length. The bounds are proven in docs/numerics.md.
#include "geom/predicates.h"

#include <algorithm>
#include <bit>
#include <initializer_list>
#include <type_traits>

#include "geom/exact.h"

namespace dm {

namespace {

using detail::cross_size;
using exact::Int128;
using exact::Integer;
using exact::sign;
using exact::Vector;
using exact::Word;

double largest_component(std::initializer_list<Vec3> vectors) {
    double r = 0;
    for (const Vec3& v : vectors) r = std::max({r, std::fabs(v.x), std::fabs(v.y), std::fabs(v.z)});
    return r;
}

// -- exact stage: differences of points as integers

// A finite double as (negative ? -1 : 1) * mantissa * 2^exponent with an odd mantissa; 0 has mantissa 0 and a large exponent.
struct Decoded {
    bool negative;
    Word mantissa;
    int exponent;
};

Decoded decode(double x) {
    const Word bits = std::bit_cast<Word>(x), fraction = bits & ((Word{1} << 52) - 1);
    const bool negative = bits >> 63 != 0;
    const int biased = static_cast<int>(bits >> 52) & 0x7ff;
    const Word mantissa = biased == 0 ? fraction : fraction | Word{1} << 52;
    if (mantissa == 0) return {negative, 0, 1024};
    const int zeros = std::countr_zero(mantissa);
    return {negative, mantissa >> zeros, std::max(biased, 1) - 1075 + zeros};
}

double power_of_two(int exponent) {
    return std::bit_cast<double>(static_cast<Word>(exponent + 1023) << 52);
}

// x * scale as an integer below 2^61, if that is what it is. inverse = 1 / scale, both powers of two.
bool to_integer(double x, double scale, double inverse, int64_t& result) {
    result = static_cast<int64_t>(x * scale);
    return static_cast<double>(result) * inverse == x;
}

// All points times one power of two, as integers below 2^61 in magnitude; false if they span more bits than that.
template <int kPoints>
bool to_integers(const Vec3 (&points)[kPoints], Vector<int64_t> (&result)[kPoints]) {
    double largest = 0;
    for (const Vec3& p : points) largest = std::max(largest, largest_component({p}));
    const int exponent = static_cast<int>(std::bit_cast<Word>(largest) >> 52) - 1023;
    if (exponent < -962 || exponent > 1023) return false; // the scale or its inverse would not be a normal number
    const double scale = power_of_two(60 - exponent), inverse = power_of_two(exponent - 60);
    bool ok = true;
    for (int i = 0; i < kPoints; ++i) {
        ok &= to_integer(points[i].x, scale, inverse, result[i].x);
        ok &= to_integer(points[i].y, scale, inverse, result[i].y);
        ok &= to_integer(points[i].z, scale, inverse, result[i].z);
    }
    return ok;
}

// Any two finite doubles in units of 2^-1074 are integers of at most 2098 bits; their difference has one more.
constexpr int kCoordinateBits = 1074 + 1024;
using Difference = Integer<kCoordinateBits + 1>;

// x - y in units of 2^unit.
Difference difference(double x, double y, int unit) {
    const Decoded a = decode(x), b = decode(y);
    return Integer<kCoordinateBits>(a.negative, a.mantissa, a.exponent - unit) -
           Integer<kCoordinateBits>(b.negative, b.mantissa, b.exponent - unit);
}

struct Pair {
    int head, tail;
};

// formula(d) for the exact vectors d[k] = points[pairs[k].head] - points[pairs[k].tail], all times one positive power of two: in
// 128-bit integers of at most 62 bits where that is possible, so that a dot or cross product of two vectors cannot overflow.
template <int kPoints, int kPairs, class Formula>
auto evaluate(const Vec3 (&points)[kPoints], const Pair (&pairs)[kPairs], Formula formula) {
    Vector<int64_t> integers[kPoints];
    if (to_integers(points, integers)) {
        Vector<Int128> d[kPairs];
        for (int k = 0; k < kPairs; ++k) {
            const Vector<int64_t>& h = integers[pairs[k].head];
            const Vector<int64_t>& t = integers[pairs[k].tail];
            d[k] = {h.x - t.x, h.y - t.y, h.z - t.z};
        }
        return formula(d);
    }

    int unit = 1024; // the exponent of the lowest bit set in any coordinate
    for (const Vec3& p : points) unit = std::min({unit, decode(p.x).exponent, decode(p.y).exponent, decode(p.z).exponent});
    Vector<Difference> d[kPairs];
    for (int k = 0; k < kPairs; ++k) {
        const Vec3& h = points[pairs[k].head];
        const Vec3& t = points[pairs[k].tail];
        d[k].x = difference(h.x, t.x, unit);
        d[k].y = difference(h.y, t.y, unit);
        d[k].z = difference(h.z, t.z, unit);
    }
    return formula(d);
}

// From here on products of products.
Integer<126> unlimited(Int128 a) {
    return Integer<126>(a);
}
template <int kBits>
const Integer<kBits>& unlimited(const Integer<kBits>& a) {
    return a;
}
template <class T>
auto unlimited(const Vector<T>& a) {
    return Vector<std::remove_cvref_t<decltype(unlimited(a.x))>>{unlimited(a.x), unlimited(a.y), unlimited(a.z)};
}

// d = {a - p, b - p, a - q, b - q}. With one cosine negative, the edge is NLD iff the other one is smaller in magnitude:
// cos^2 = (u.v)^2 / (|u|^2 |v|^2), and cross-multiplied this is right for zero lengths too. Degree 8.
template <class T>
bool exactly_nld(const Vector<T> (&d)[4]) {
    const auto d1 = dot(d[0], d[1]), d2 = dot(d[2], d[3]);
    const int sign1 = sign(d1), sign2 = sign(d2);
    if (sign1 >= 0 && sign2 >= 0) return false;
    if (sign1 < 0 && sign2 < 0) return true; // also with s1 = s2 = 0
    const auto squared = [](const auto& x) { return unlimited(x) * unlimited(x); };
    const auto lengths = [](const auto& u, const auto& v) { return unlimited(dot(u, u)) * unlimited(dot(v, v)); };
    const int order = compare_absolute(squared(d1) * lengths(d[2], d[3]), squared(d2) * lengths(d[0], d[1]));
    return sign1 < 0 ? order > 0 : order < 0;
}

// -- filter stage

// One side of an edge: d = u.v and s = |u x v|, and the size of what was added up for them.
struct Side {
    double d, s, size;
};

Side side(const Vec3& u, const Vec3& v) {
    const double d = dot(u, v), s = length(cross(u, v));
    return {d, s, s + std::fabs(d)};
}

// s1 d2 + s2 d1, relative to the product of both sizes; between these sizes nothing overflows and underflow does not count.
constexpr double kNldError = 0x1p-47;
constexpr double kSmallestSize = 0x1p-450, kLargestSize = 0x1p450;

// Products of three and four differences, relative to dot_size of their cross_size; what underflows adds less than kUnderflow if
// no difference exceeds kLargestDifference (the range of float32).
constexpr double kVolumeError = 0x1p-49, kNormalsError = 0x1p-48;
constexpr double kUnderflow = 0x1p-800, kLargestDifference = 0x1p130;

double dot_size(const Vec3& u, const Vec3& v) {
    return std::fabs(u.x * v.x) + std::fabs(u.y * v.y) + std::fabs(u.z * v.z);
}

} // namespace

bool detail::edge_is_nld_unsure(const Vec3& a, const Vec3& b, const Vec3& p, const Vec3& q, int64_t* exact_calls) {
    const Side s1 = side(a - p, b - p), s2 = side(a - q, b - q);
    if (s1.size > kSmallestSize && s1.size < kLargestSize && s2.size > kSmallestSize && s2.size < kLargestSize) {
        const double e = s1.s * s2.d + s2.s * s1.d, error = kNldError * s1.size * s2.size;
        if (e > error) return false;
        if (e < -error) return true;
    }
    if (exact_calls != nullptr) ++*exact_calls;
    return evaluate({a, b, p, q}, {{0, 2}, {1, 2}, {0, 3}, {1, 3}}, [](const auto& d) { return exactly_nld(d); });
}

bool detail::boundary_edge_is_nld_unsure(const Vec3& a, const Vec3& b, const Vec3& p, int64_t* exact_calls) {
    if (surely_acute(p - a, b - p)) return true;
    if (exact_calls != nullptr) ++*exact_calls;
    return evaluate({a, b, p}, {{0, 2}, {1, 2}}, [](const auto& d) { return sign(dot(d[0], d[1])) < 0; });
}

bool detail::zero_area_unsure(const Vec3& a, const Vec3& b, const Vec3& c) {
    return evaluate({a, b, c}, {{1, 0}, {2, 0}}, [](const auto& d) {
        const auto m = cross(d[0], d[1]);
        return sign(m.x) == 0 && sign(m.y) == 0 && sign(m.z) == 0;
    });
}

int orientation(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
    const Vec3 u = b - a, v = c - a, w = d - a;
    if (largest_component({u, v, w}) < kLargestDifference) {
        const double volume = dot(cross(u, v), w), error = kVolumeError * dot_size(cross_size(u, v), w) + kUnderflow;
        if (volume > error) return 1;
        if (volume < -error) return -1;
    }
    return evaluate({a, b, c, d}, {{1, 0}, {2, 0}, {3, 0}},
                    [](const auto& e) { return sign(dot(unlimited(cross(e[0], e[1])), unlimited(e[2]))); });
}

bool flat_edge(const Vec3& a, const Vec3& b, const Vec3& p, const Vec3& q) {
    return orientation(a, b, p, q) == 0 && normals_dot_sign(a, b, p, b, a, q) > 0;
}

int normals_dot_sign(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d, const Vec3& e, const Vec3& f) {
    const Vec3 u1 = b - a, v1 = c - a, u2 = e - d, v2 = f - d;
    if (largest_component({u1, v1, u2, v2}) < kLargestDifference) {
        const double product = dot(cross(u1, v1), cross(u2, v2));
        const double error = kNormalsError * dot_size(cross_size(u1, v1), cross_size(u2, v2)) + kUnderflow;
        if (product > error) return 1;
        if (product < -error) return -1;
    }
    return evaluate({a, b, c, d, e, f}, {{1, 0}, {2, 0}, {4, 3}, {5, 3}},
                    [](const auto& g) { return sign(dot(unlimited(cross(g[0], g[1])), unlimited(cross(g[2], g[3])))); });
}

} // namespace dm
