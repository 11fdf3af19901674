// SPDX-License-Identifier: Apache-2.0
#include "subdiv/limit_values.h"

#include <memory>

#include "base/hash.h"
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

// The last values at places of one face: neighbouring triangles share most of theirs.
class Recent {
public:
    Recent() : entries_(new Entry[kEntries]) {}
    // The value at a place, made by make(value) where it is not known.
    template <class Make>
    const double* find(const CagePlace& place, Make&& make) {
        uint64_t key;
        static_assert(sizeof key == 2 * sizeof(float));
        std::memcpy(&key, &place.s, sizeof key);
        Entry& entry = entries_[static_cast<size_t>(scramble(key) % kEntries)];
        if (entry.face != place.face || entry.key != key) {
            make(entry.value);
            entry.face = place.face;
            entry.key = key;
        }
        return entry.value;
    }

private:
    static constexpr uint64_t kEntries = 256;
    struct Entry {
        int32_t face = -1;
        uint64_t key = 0;
        double value[LimitEvaluator::kMostComponents];
    };
    std::unique_ptr<Entry[]> entries_;
};

// Values at the corners' places. begin(evaluator, f) makes the evaluator ready for a face, at(evaluator, place, value) takes one.
template <class Begin, class At>
Status for_corners(Context& context, const Cage& cage, const Mesh& mesh, const delmesh_view_mut& target, Begin&& begin, At&& at) {
    PlaceOrder order(context.memory());
    DM_TRY(order.build(context, cage, mesh.corners(), [&](int64_t c) { return cage_place(mesh, c).face; }));
    return for_limit_faces(context, cage, order.per_face(), 0.2, 1, [&](LimitEvaluator& evaluator, int32_t f) {
        if (order.is_empty(f)) return;
        Recent recent;
        begin(evaluator, f);
        order.for_each(f, [&](int32_t c) {
            const CagePlace& place = cage_place(mesh, c);
            write(target, c, recent.find(place, [&](double* value) { at(evaluator, place, value); }));
        });
    });
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
    const CageLayer& of = cage.layers[layer];
    const double* const values = source != nullptr ? source->data() : cage.values.data() + of.first_value;
    return for_corners(
        context, cage, mesh, target,
        [&](LimitEvaluator& evaluator, int32_t f) {
            evaluator.face(f, of.channel);
            evaluator.take(values, target.components);
        },
        [](LimitEvaluator& evaluator, const CagePlace& place, double* value) { evaluator.at(place.s, place.t, value); });
}

Status limit_normals(Context& context, const Cage& cage, const Mesh& mesh, const double* positions,
                     const delmesh_view_mut& target) {
    return for_corners(
        context, cage, mesh, target,
        [&](LimitEvaluator& evaluator, int32_t f) {
            evaluator.face(f, -1);
            evaluator.take(positions, 3);
        },
        [](LimitEvaluator& evaluator, const CagePlace& place, double* value) {
            double x[3], ds[3], dt[3];
            evaluator.at(place.s, place.t, x, ds, dt);
            const Vec3 normal = cross({ds[0], ds[1], ds[2]}, {dt[0], dt[1], dt[2]});
            const double size = length(normal), scale = size > 0 ? 1 / size : 0;
            value[0] = scale * normal.x;
            value[1] = scale * normal.y;
            value[2] = scale * normal.z;
        });
}

} // namespace dm
