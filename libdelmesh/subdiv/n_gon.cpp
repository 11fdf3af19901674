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
Angle corner_angle(int32_t face_size, int32_t corner) {
    const double angle = 2 * std::numbers::pi * corner / face_size;
    return {std::cos(angle), std::sin(angle)};
}

} // namespace

SubFacePlace sub_face_of(int32_t face_size, double x, double y) {
    SubFacePlace place{0, 0, 0};
    Angle turn{1, 0};
    double most = x;
    for (int32_t corner = 1; corner < face_size; ++corner) {
        const Angle angle = corner_angle(face_size, corner);
        const double along = angle.cosine * x + angle.sine * y;
        if (!(along > most)) continue;
        most = along;
        turn = angle;
        place.corner = corner;
    }
    const double half = std::numbers::pi / face_size, c = std::cos(half), s = std::sin(half);
    const double difference = (turn.cosine * y - turn.sine * x) / (c * s), bend = 1 - 2 * c * c;
    const double constant = 1 - most - bend * difference * difference / 4;
    const double root = std::sqrt(std::max(0.0, s * s * s * s - bend * constant));
    const double sum = 2 * constant / (s * s + root);
    place.u = std::clamp((sum + difference) / 2, 0.0, 1.0);
    place.v = std::clamp((sum - difference) / 2, 0.0, 1.0);
    return place;
}

void place_of(int32_t face_size, const SubFacePlace& place, double& x, double& y) {
    const double half = std::numbers::pi / face_size, c = std::cos(half), s = std::sin(half);
    const double along = 1 - s * s * (place.u + place.v) + (1 - 2 * c * c) * place.u * place.v;
    const double across = c * s * (place.u - place.v);
    const Angle turn = corner_angle(face_size, place.corner);
    x = turn.cosine * along - turn.sine * across;
    y = turn.sine * along + turn.cosine * across;
}

} // namespace dm
