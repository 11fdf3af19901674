// SPDX-License-Identifier: Apache-2.0
#include "subdiv/limit_distance.h"

#include <algorithm>
#include <cmath>

#include "subdiv/places.h"

namespace dm {

Status limit_distance(Context& context, const Cage& cage, const Mesh& mesh, double& largest, double& rms) {
    PlaceOrder order(context.memory());
    DM_TRY(order.build(context, cage, mesh.faces(), [&](int64_t f) { return cage_face(mesh, f); }));
    struct Found {
        double largest = 0, squares = 0;
        int64_t samples = 0;
    };
    Array<Found> found(context.memory(), cage.faces(), Found());
    DM_TRY(for_limit_faces(context, cage, 3 * order.per_face(), 0.2, 1, [&](LimitEvaluator& evaluator, int32_t of) {
        if (order.is_empty(of)) return;
        Found here;
        evaluator.face(of, -1);
        evaluator.take(cage.positions.data(), 3);
        const auto look_between = [&](const int32_t* corners, int32_t count) {
            Vec3 middle{0, 0, 0};
            double s = 0, t = 0;
            for (int32_t k = 0; k < count; ++k) {
                middle = middle + mesh.position(mesh.corner_vert[corners[k]]);
                s += static_cast<double>(cage_place(mesh, corners[k]).s);
                t += static_cast<double>(cage_place(mesh, corners[k]).t);
            }
            double limit[3];
            evaluator.at(static_cast<float>(s / count), static_cast<float>(t / count), limit);
            const double squared = length_squared((1.0 / count) * middle - Vec3{limit[0], limit[1], limit[2]});
            here.largest = std::max(here.largest, std::sqrt(squared));
            here.squares += squared;
            ++here.samples;
        };
        order.for_each(of, [&](int32_t f) {
            const int32_t corners[3] = {3 * f, 3 * f + 1, 3 * f + 2};
            look_between(corners, 3);
            for (const int32_t c : corners) {
                const int32_t twin = mesh.corner_twin[c], edge[2] = {c, next_corner(c)};
                if (twin < c || cage_face(mesh, face_of(twin)) != of)
                    look_between(edge, 2); // each edge once per face of the cage
            }
        });
        found.data()[of] = here;
    }));
    Found all;
    for (const Found& here : found) {
        all.largest = std::max(all.largest, here.largest);
        all.squares += here.squares;
        all.samples += here.samples;
    }
    largest = all.largest;
    rms = all.samples > 0 ? std::sqrt(all.squares / static_cast<double>(all.samples)) : 0;
    return DELMESH_OK;
}

} // namespace dm
