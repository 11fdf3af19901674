/* SPDX-License-Identifier: Apache-2.0
 *
 * 113-bit arithmetic where doubles do not tell at once. Differences of the float32 coordinates that most files have are exact in
 * it, and so are most ties; angles are told apart from 1e-15 degrees on. The lengths of intrinsic triangulations are rounded
 * themselves, which decides ties: there an edge counts from 1e-9 degrees on.
 */
#include "nld_count.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace {

using Wide = __float128;
constexpr double kLengthNoise = 1e-9; /* degrees */

/* At an apex: the dot product of the sides, and the product of their squared lengths. */
struct Apex {
    Wide dot, squares;
};

/* cos(t1) + cos(t2) < 0 says t1 + t2 > 180, in squares and without division. */
bool is_nld(const Apex& one, const Apex& two) {
    if (one.dot >= 0 && two.dot >= 0) return false;
    if (one.dot < 0 && two.dot < 0) return true;
    const Wide left = two.squares * one.dot * one.dot, right = one.squares * two.dot * two.dot;
    const Wide most = left > right ? left : right, distance = (one.dot < 0 ? left - right : right - left);
    return distance > most * 0x1p-100;
}

double angle(const Apex& apex) {
    const double length = std::sqrt(double(apex.squares));
    return length > 0 ? std::acos(std::clamp(double(apex.dot) / length, -1.0, 1.0)) : 0;
}

Apex apex_at(const double* p, const double* a, const double* b) {
    Wide dot = 0, u2 = 0, v2 = 0;
    for (int k = 0; k < 3; ++k) {
        const Wide u = Wide(a[k]) - p[k], v = Wide(b[k]) - p[k];
        dot += u * v;
        u2 += u * u;
        v2 += v * v;
    }
    return {dot, u2 * v2};
}

Apex apex_of(double opposite, double side, double other_side) {
    const Wide a = side, b = other_side, c = opposite;
    return {(a * a + b * b - c * c) / 2, a * a * b * b};
}

bool surely_acute(const double* p, const double* a, const double* b) {
    double dot = 0, size = 0;
    for (int k = 0; k < 3; ++k) {
        const double product = (a[k] - p[k]) * (b[k] - p[k]);
        dot += product;
        size += std::abs(product);
    }
    return dot > 1e-12 * size;
}

bool has_area(const double* p, const double* a, const double* b) {
    const Apex apex = apex_at(p, a, b);
    return apex.dot * apex.dot < apex.squares * (1 - Wide(0x1p-100));
}

} // namespace

Count count_nld(const Answer& answer) {
    const bool intrinsic = !answer.lengths.empty();
    const int32_t* const corners = answer.corners.data();
    const double* const positions = answer.positions.data();
    const auto next = [](int32_t c) { return c % 3 == 2 ? c - 2 : c + 1; };
    const auto point = [&](int32_t c) { return positions + 3 * size_t(corners[c]); };

    std::vector<std::pair<std::array<int32_t, 2>, int32_t>> sides(answer.corners.size()); /* edge, corner */
    for (size_t i = 0; i < sides.size(); ++i) {
        const int32_t c = int32_t(i);
        if (intrinsic)
            sides[i] = {{answer.edges[i], 0}, c};
        else
            sides[i] = {{std::min(corners[c], corners[next(c)]), std::max(corners[c], corners[next(c)])}, c};
    }
    std::sort(sides.begin(), sides.end());

    Count count;
    for (size_t i = 0, end; i < sides.size(); i = end) {
        for (end = i + 1; end < sides.size() && sides[end].first == sides[i].first;) ++end;
        if (end - i > 2) ++count.crowded;
        if (end - i != 2) continue;
        Apex apex[2];
        bool acute = !intrinsic;
        for (size_t s = 0; s < 2; ++s) {
            const int32_t c = sides[i + s].second, n = next(c), a = next(n);
            acute = acute && surely_acute(point(a), point(c), point(n));
            if (acute) continue;
            if (intrinsic)
                apex[s] = apex_of(answer.lengths[size_t(c)], answer.lengths[size_t(n)], answer.lengths[size_t(a)]);
            else
                apex[s] = apex_at(point(a), point(c), point(n));
        }
        if (acute) continue;
        for (size_t s = 0; s < 2 && !intrinsic; ++s) { /* one of them may have been skipped as acute */
            const int32_t c = sides[i + s].second;
            apex[s] = apex_at(point(next(next(c))), point(c), point(next(c)));
        }
        if (!is_nld(apex[0], apex[1])) continue;
        const double excess = (angle(apex[0]) + angle(apex[1])) * 180 / std::acos(-1.0) - 180;
        if (intrinsic && excess < kLengthNoise) continue;
        ++count.nld;
        count.worst = std::max(count.worst, excess);
    }
    if (!intrinsic)
        for (int32_t c = 0; c < int32_t(answer.corners.size()); c += 3)
            if (!has_area(point(c), point(c + 1), point(c + 2))) ++count.zero_area;
    return count;
}
