// SPDX-License-Identifier: Apache-2.0
#include "subdiv/limit_values.h"

#include "mesh/views.h"
#include "subdiv/faces.h"
#include "subdiv/places.h"

namespace dm {
namespace {

void write(const delmesh_view_mut& target, int64_t i, const double* value) {
    for (int32_t k = 0; k < target.components; ++k) {
        if (target.type == DELMESH_FLOAT32)
            element<float>(target, i)[k] = static_cast<float>(value[k]);
        else
            element<double>(target, i)[k] = value[k];
    }
}

// Values at the mesh's places, each of which many corners have. begin(evaluator, f) makes the evaluator ready for a face,
// at(evaluator, place, value) takes one.
template <class Begin, class At>
Status at_places(Context& context, const Cage& cage, const Mesh& mesh, const delmesh_view_mut& target, Begin&& begin, At&& at) {
    const CagePlace* const places = mesh.cage_places.data();
    PlaceOrder order(context.memory());
    DM_TRY(order.build(context, cage, mesh.cage_places.size(), [&](int64_t i) { return places[i].face; }));
    return for_limit_faces(context, cage, order.per_face(), 0.2, 0.9, [&](LimitEvaluator& evaluator, int32_t f) {
        if (order.is_empty(f)) return;
        begin(evaluator, f);
        order.for_each(f, [&](int32_t i) {
            double value[LimitEvaluator::kMostComponents];
            at(evaluator, places[i], value);
            write(target, i, value);
        });
    });
}

// The same at corners: find(view) finds the values at places.
template <class Find>
Status at_corners(Context& context, const Mesh& mesh, const delmesh_view_mut& target, Find&& find) {
    const int32_t components = target.components;
    Array<double> values(context.memory());
    values.resize_uninitialized(mesh.cage_places.size() * components);
    const int64_t stride = components * static_cast<int64_t>(sizeof(double));
    DM_TRY(find(delmesh_view_mut{values.data(), mesh.cage_places.size(), stride, DELMESH_FLOAT64, components}));
    return context.parallel(mesh.corners(), 1 << 14, [&](int64_t, int64_t begin, int64_t end) {
        for (int64_t c = begin; c < end; ++c) write(target, c, values.data() + int64_t{mesh.corner_cage.data()[c]} * components);
    });
}

Status layer_at_places(Context& context, const Cage& cage, const Mesh& mesh, int32_t layer, const Array<double>* source,
                       const delmesh_view_mut& target) {
    const CageLayer& of = cage.layers[layer];
    const double* const values = source != nullptr ? source->data() : cage.values.data() + of.first_value;
    return at_places(
        context, cage, mesh, target,
        [&](LimitEvaluator& evaluator, int32_t f) {
            evaluator.face(f, of.channel);
            evaluator.take(values, target.components);
        },
        [](LimitEvaluator& evaluator, const CagePlace& place, double* value) { evaluator.at(place.s, place.t, value); });
}

} // namespace

Status limit_of_verts(Context& context, const Cage& cage, const Mesh& mesh, const Array<double>& source,
                      const delmesh_view_mut& target) {
    Array<int32_t> first(context.memory());
    DM_TRY(first_corners(context, mesh, first));
    const double none[LimitEvaluator::kMostComponents] = {};
    for (int32_t v = 0; v < mesh.vertices(); ++v)
        if (first[v] < 0) write(target, v, none);
    PlaceOrder order(context.memory());
    DM_TRY(order.build(context, cage, mesh.vertices(),
                       [&](int64_t v) { return first[v] < 0 ? -1 : cage_place(mesh, first[v]).face; }));
    return for_limit_faces(context, cage, order.per_face(), 0.2, 1, [&](LimitEvaluator& evaluator, int32_t f) {
        if (order.is_empty(f)) return;
        evaluator.face(f, -1);
        evaluator.take(source.data(), target.components);
        order.for_each(f, [&](int32_t v) {
            const CagePlace& place = cage_place(mesh, first[v]);
            double value[LimitEvaluator::kMostComponents];
            evaluator.at(place.s, place.t, value);
            write(target, v, value);
        });
    });
}

Status limit_of_layer(Context& context, const Cage& cage, const Mesh& mesh, int32_t layer, const Array<double>* source,
                      const delmesh_view_mut& target) {
    return at_corners(context, mesh, target, [&](const delmesh_view_mut& values) {
        return layer_at_places(context, cage, mesh, layer, source, values);
    });
}

Status limit_at_places(Context& context, const Cage& cage, const Mesh& mesh, int32_t layer, const delmesh_view_mut& target) {
    return layer_at_places(context, cage, mesh, layer, nullptr, target);
}

Status limit_normals(Context& context, const Cage& cage, const Mesh& mesh, const double* positions,
                     const delmesh_view_mut& target) {
    const auto begin = [&](LimitEvaluator& evaluator, int32_t f) {
        evaluator.face(f, -1);
        evaluator.take(positions, 3);
    };
    const auto at = [](LimitEvaluator& evaluator, const CagePlace& place, double* value) {
        double x[3], ds[3], dt[3];
        evaluator.at(place.s, place.t, x, ds, dt);
        const Vec3 normal = cross({ds[0], ds[1], ds[2]}, {dt[0], dt[1], dt[2]});
        const double size = length(normal), scale = size > 0 ? 1 / size : 0;
        value[0] = scale * normal.x;
        value[1] = scale * normal.y;
        value[2] = scale * normal.z;
    };
    return at_corners(context, mesh, target,
                      [&](const delmesh_view_mut& values) { return at_places(context, cage, mesh, values, begin, at); });
}

} // namespace dm
