// SPDX-License-Identifier: Apache-2.0
// A vertex p at a place of the cage goes to p + (q' - q) + (F' o - F o), where q is the limit point of that place, F a frame
// there, o what p - q is in it, and ' is the new pose. Written as differences of the same sums, so that where the pose has not
// moved the surface they are 0, and p stays p bit for bit. Where p is q rounded, it goes to q' rounded, which takes no frames.
#include "subdiv/reevaluate.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "mesh/source_map.h"
#include "subdiv/places.h"

namespace dm {
namespace {

// Axes of one length: along the surface, across it, and normal. The length is that by which the surface is stretched there.
struct Frame {
    Vec3 axis[3];
    double stretch; // 0: there is no frame
};

Frame frame_of(const Vec3& ds, const Vec3& dt) {
    const Vec3 normal = cross(ds, dt);
    const double area = length(normal), along = length(ds);
    if (!(area > 0 && std::isfinite(area))) return {{}, 0};
    const Vec3 x = (1 / along) * ds, z = (1 / area) * normal;
    return {{x, cross(z, x), z}, std::sqrt(area)};
}

Vec3 in_frame(const Frame& frame, const double* offset, double stretch) {
    return stretch * (offset[0] * frame.axis[0] + offset[1] * frame.axis[1] + offset[2] * frame.axis[2]);
}

// How the offset p - q changes from one frame to another. It keeps its length but for the stretch, by 8 at most: where derivatives
// nearly vanish that is no measure of anything.
Vec3 change_of(const Vec3& offset, const Frame& rest, const Frame& posed) {
    constexpr double kMostStretch = 8;
    if (rest.stretch == 0 || posed.stretch == 0) return {0, 0, 0};
    const double of[3] = {dot(offset, rest.axis[0]), dot(offset, rest.axis[1]), dot(offset, rest.axis[2])};
    const double stretch = std::clamp(posed.stretch / rest.stretch, 1 / kMostStretch, kMostStretch);
    return in_frame(posed, of, stretch) - in_frame(rest, of, 1);
}

double moved(double x, double by) {
    return by == 0 ? x : x + by; // -0 too stays what it is
}

bool same_bits(const Vec3& a, const Vec3& b) {
    return std::bit_cast<std::array<uint64_t, 3>>(a) == std::bit_cast<std::array<uint64_t, 3>>(b);
}

} // namespace

Status reevaluate(Context& context, const Cage& cage, const Mesh& mesh, const Array<double>& pose, Mesh& out,
                  delmesh_reevaluate_report& report) {
    Memory& memory = context.memory();
    DM_TRY(context.stage("reevaluate", 0, 0.8));
    out.share(mesh);
    Array<double> both(memory); // rest and pose side by side: one evaluation
    both.resize_uninitialized(2 * pose.size());
    for (int32_t v = 0; v < cage.vertices(); ++v)
        for (int32_t k = 0; k < 3; ++k) {
            both[6 * int64_t{v} + k] = cage.positions[3 * int64_t{v} + k];
            both[6 * int64_t{v} + 3 + k] = pose[3 * int64_t{v} + k];
        }
    // Copies of a vertex, which cutting made, are evaluated as one.
    Array<int32_t> first(memory);
    DM_TRY(first_corners(context, mesh, first));
    const auto is_own = [&](int64_t v) { return first[v] >= 0 && source_of(mesh.vert_join, v) == v; };
    PlaceOrder order(memory);
    DM_TRY(
        order.build(context, cage, mesh.vertices(), [&](int64_t v) { return is_own(v) ? cage_place(mesh, first[v]).face : -1; }));
    struct Found {
        int64_t moved = 0;
        double offset = 0;
        bool lost = false;
    };
    Array<Found> found(memory, cage.faces(), Found());
    DM_TRY(for_limit_faces(context, cage, order.per_face(), 0.2, 1, [&](LimitEvaluator& evaluator, int32_t f) {
        if (order.is_empty(f)) return;
        Found here;
        evaluator.face(f, -1);
        evaluator.take(both.data(), 6);
        order.for_each(f, [&](int32_t v) {
            const CagePlace& place = cage_place(mesh, first[v]);
            const auto vector = [](const double* x) { return Vec3{x[0], x[1], x[2]}; };
            double q[6], ds[6], dt[6];
            evaluator.at(place.s, place.t, q);
            const Vec3 p = mesh.position(v), offset = p - vector(q);
            Vec3 to = round_to(out.precision, vector(q + 3));
            if (!same_bits(p, round_to(out.precision, vector(q)))) { // it is off the surface by more than rounding
                evaluator.at(place.s, place.t, q, ds, dt);
                const Vec3 by = (vector(q + 3) - vector(q)) + change_of(p - vector(q), frame_of(vector(ds), vector(dt)),
                                                                        frame_of(vector(ds + 3), vector(dt + 3)));
                to = round_to(out.precision, Vec3{moved(p.x, by.x), moved(p.y, by.y), moved(p.z, by.z)});
            }
            out.set_position(v, to);
            here.moved += !same_bits(p, to);
            here.offset = std::max(here.offset, length(offset));
            here.lost |= !is_finite(to);
        });
        found.data()[f] = here;
    }));
    for (int32_t f = 0; f < cage.faces(); ++f) {
        report.moved_vertices += found[f].moved;
        report.largest_offset = std::max(report.largest_offset, found[f].offset);
        if (found[f].lost)
            return context.fail(DELMESH_ERROR_INVALID_ARGUMENT,
                                "positions: the limit surface of face %d left the range of the result's precision.", f);
    }
    for (int32_t v = 0; v < mesh.vertices(); ++v) {
        const int32_t join = source_of(mesh.vert_join, v);
        if (join == v || first[v] < 0 || first[join] < 0) continue;
        report.moved_vertices += !same_bits(out.position(v), out.position(join));
        out.set_position(v, out.position(join));
    }
    return DELMESH_OK;
}

} // namespace dm
