// SPDX-License-Identifier: Apache-2.0
// The kite that a corner of the regular n-gon spans with the middles of its edges and the center is a bilinear map. In the frame in
// which the corner is (1, 0), with c and s the cosine and sine of pi / n, the middles are (c c, +-c s), so that
//     x = 1 - s s (u + v) + (1 - 2 c c) u v,    y = c s (u - v).
#include <algorithm>
#include <cmath>
#include <numbers>

#include "subdiv/limit.h"

namespace dm {
namespace {

struct Angle {
    double cosine, sine;
};

// Of pi k / n, 0 <= k < 2 n, by arithmetic alone: libm's values differ between systems in the last place, and places go into the
// bytes of results.
Angle part_of_turn(int32_t k, int32_t n) {
    const int64_t quarters = 2 * int64_t{k} / n, rest = 2 * int64_t{k} % n; // in halves of pi / n
    const bool turned = 2 * rest > n;                                       // past an eighth of the turn
    const double x = std::numbers::pi / 2 * static_cast<double>(turned ? n - rest : rest) / n, squared = x * x;
    double cosine = 1, sine = 1;
    for (int32_t i = 18; i > 0; i -= 2) {
        cosine = 1 - squared / (i * (i - 1)) * cosine;
        sine = 1 - squared / (i * (i + 1)) * sine;
    }
    sine *= x;
    Angle angle = turned ? Angle{sine, cosine} : Angle{cosine, sine};
    for (int64_t i = 0; i < quarters; ++i) angle = {-angle.sine, angle.cosine};
    return angle;
}

} // namespace

SubFacePlace sub_face_of(int32_t face_size, double x, double y) {
    SubFacePlace place{0, 0, 0};
    Angle turn{1, 0};
    double most = x;
    for (int32_t corner = 1; corner < face_size; ++corner) {
        const Angle angle = part_of_turn(2 * corner, face_size);
        const double along = angle.cosine * x + angle.sine * y;
        if (!(along > most)) continue;
        most = along;
        turn = angle;
        place.corner = corner;
    }
    const auto [c, s] = part_of_turn(1, face_size);
    const double difference = (turn.cosine * y - turn.sine * x) / (c * s), bend = 1 - 2 * c * c;
    const double constant = 1 - most - bend * difference * difference / 4;
    const double root = std::sqrt(std::max(0.0, s * s * s * s - bend * constant));
    const double sum = 2 * constant / (s * s + root);
    place.u = std::clamp((sum + difference) / 2, 0.0, 1.0);
    place.v = std::clamp((sum - difference) / 2, 0.0, 1.0);
    return place;
}

void place_of(int32_t face_size, const SubFacePlace& place, double& x, double& y) {
    const auto [c, s] = part_of_turn(1, face_size);
    const double along = 1 - s * s * (place.u + place.v) + (1 - 2 * c * c) * place.u * place.v;
    const double across = c * s * (place.u - place.v);
    const Angle turn = part_of_turn(2 * place.corner, face_size);
    x = turn.cosine * along - turn.sine * across;
    y = turn.sine * along + turn.cosine * across;
}

} // namespace dm
