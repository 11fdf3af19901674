// SPDX-License-Identifier: Apache-2.0
#include "shim_decimator.h"

#include "shim_remesh.cpp" // each test links one shim

#include <vector>

#include "algo/bucket_queue.h"
#include "algo/decimator.h"
#include "geom/quadric.h"
#include "mesh/spatial_order.h"

struct shim_queue {
    shim_queue() : context(delmesh_context_options{}, Memory::create(delmesh_context_options{})), queue(context.memory()) {}
    Context context;
    BucketQueue<int32_t> queue;
};

struct shim_decimator {
    shim_decimator(const Mesh& mesh, const DecimationRules& rules_)
        : context(options_for(this), Memory::create(delmesh_context_options{})), rules(rules_),
          surface(context, mesh, rules_.precision), decimator(context, surface, rules) {}
    // The run is stopped from where it asks for it: in milliseconds, however it turns in circles.
    static delmesh_context_options options_for(shim_decimator* d) {
        delmesh_context_options options{};
        options.user = d;
        options.progress = [](void* user, double, const char*) -> int32_t {
            const shim_decimator& it = *static_cast<const shim_decimator*>(user);
            return it.running && it.decimator.counts.postponed > it.most_postponed ? DELMESH_CONTINUE + 1 : DELMESH_CONTINUE;
        };
        return options;
    }
    bool running = false; // the surface is copied before there is a decimator
    int64_t most_postponed = 0;
    Context context;
    const DecimationRules rules;
    Surface surface;
    Decimator decimator;
};

namespace {

Quadric quadric_of(const shim_quadric& q) {
    return {q.xx, q.xy, q.xz, q.yy, q.yz, q.zz, q.bx, q.by, q.bz, q.c};
}
shim_quadric laid_open(const Quadric& q) {
    return {q.xx, q.xy, q.xz, q.yy, q.yz, q.zz, q.bx, q.by, q.bz, q.c};
}
Vec3 vec_of(const double* x) {
    return {x[0], x[1], x[2]};
}

} // namespace

extern "C" {

shim_quadric shim_quadric_of_plane(const double normal[3], const double point[3], double weight) {
    return laid_open(Quadric::of_plane(vec_of(normal), vec_of(point), weight));
}
shim_quadric shim_quadric_sum(const shim_quadric* a, const shim_quadric* b) {
    return laid_open(quadric_of(*a) + quadric_of(*b));
}
shim_quadric shim_quadric_scaled(const shim_quadric* a, double by) {
    Quadric q = quadric_of(*a);
    q *= by;
    return laid_open(q);
}
double shim_quadric_at(const shim_quadric* q, const double point[3]) {
    return quadric_of(*q).at(vec_of(point));
}
int32_t shim_quadric_least(const shim_quadric* q, const double near[3], double stiffness, double out[3]) {
    Vec3 x{0, 0, 0};
    const bool found = quadric_of(*q).least(vec_of(near), stiffness, x);
    out[0] = x.x, out[1] = x.y, out[2] = x.z;
    return found ? 1 : 0;
}

shim_queue* shim_queue_make(void) {
    shim_queue* const q = new shim_queue;
    q->queue.begin(1, 0);
    return q;
}
void shim_queue_free(shim_queue* q) {
    delete q;
}
int32_t shim_queue_bucket(double priority) {
    return BucketQueue<int32_t>::bucket(priority);
}
double shim_queue_end_of(int32_t bucket) {
    return BucketQueue<int32_t>::end_of(bucket);
}
void shim_queue_push(shim_queue* q, double priority, int32_t value) {
    q->queue.push(0, BucketQueue<int32_t>::bucket(priority), value);
}
void shim_queue_push_to(shim_queue* q, int32_t bucket, int32_t value) {
    q->queue.push(0, bucket, value);
}
int32_t shim_queue_pop(shim_queue* q, int32_t* bucket, int32_t* values, int32_t most) {
    return q->queue.pop(1, bucket, values, std::min(most, 1)); // more of them may be from several buckets
}
int64_t shim_queue_size(const shim_queue* q) {
    return q->queue.size();
}
uint64_t shim_queue_bytes(const shim_queue* q) {
    return q->context.memory().current();
}

shim_mesh* shim_sort_in_space(shim_mesh* in, int32_t* old_vert, int32_t* new_vert, int32_t* old_face, int32_t* new_face) {
    const delmesh_context_options none{};
    shim_mesh* const out = shim_mesh_blank(&none);
    SpatialOrder order(out->context.memory());
    guarded(*out, [&] { return sort_in_space(out->context, in->mesh, order, out->mesh); });
    const auto give = [](const Array<int32_t>& from, int32_t* to) {
        for (int64_t i = 0; i < from.size(); ++i) to[i] = from[i];
    };
    // Which vertices are copies of one is no part of the order; what checks cut edges wants to know.
    const Array<int32_t>& joins = in->mesh.vert_join;
    std::vector<int32_t> first(static_cast<size_t>(joins.size()), -1);
    for (int32_t v = 0; v < joins.size(); ++v) {
        int32_t& least = first[static_cast<size_t>(joins[order.old_vert[v]])];
        if (least < 0) least = v;
        out->mesh.vert_join.push_back(least);
    }
    out->mesh.first_split = out->mesh.vertex_count; // it has no maps
    give(order.old_vert, old_vert);
    give(order.new_vert, new_vert);
    give(order.old_face, old_face);
    give(order.new_face, new_face);
    return out;
}

shim_decimation_rules shim_decimation_defaults(void) {
    const DecimationRules r;
    return {static_cast<int32_t>(r.precision),
            r.boundary_rule ? 1 : 0,
            r.optimum ? 1 : 0,
            r.region ? 1 : 0,
            r.ends ? 1 : 0,
            r.middle ? 1 : 0,
            r.flips ? 1 : 0,
            r.fold_cosine,
            r.boundary_weight,
            r.flip_weight,
            r.slack};
}

shim_decimator* shim_decimator_make(const shim_mesh* mesh, const shim_decimation_rules* from, const double* weights,
                                    const uint8_t* locked) {
    DecimationRules rules;
    rules.precision = static_cast<Precision>(from->precision);
    rules.boundary_rule = from->boundary_rule != 0;
    rules.optimum = from->optimum != 0;
    rules.region = from->region != 0;
    rules.ends = from->ends != 0;
    rules.middle = from->middle != 0;
    rules.flips = from->flips != 0;
    rules.fold_cosine = from->fold_cosine;
    rules.boundary_weight = from->boundary_weight;
    rules.flip_weight = from->flip_weight;
    rules.slack = from->slack;
    shim_decimator* const d = new shim_decimator(mesh->mesh, rules);
    if (d->decimator.begin(weights, locked) != DELMESH_OK) {
        delete d;
        return nullptr;
    }
    return d;
}
void shim_decimator_free(shim_decimator* d) {
    delete d;
}

int32_t shim_decimator_run(shim_decimator* d, int64_t most_vertices, int64_t most_faces, int64_t most_postponed) {
    d->most_postponed = d->decimator.counts.postponed + most_postponed;
    d->running = true;
    const Status status = d->decimator.run(most_vertices, most_faces);
    return d->decimator.counts.postponed > d->most_postponed ? static_cast<Status>(DELMESH_ERROR_CANCELLED) : status;
}
int32_t shim_decimator_prune(shim_decimator* d, double diagonal, int64_t* pruned) {
    return d->decimator.prune(diagonal, *pruned);
}

shim_decimation shim_decimator_state(const shim_decimator* shim) {
    const Decimator& d = shim->decimator;
    const Surface& s = shim->surface;
    static_assert(sizeof(Vec3) == 3 * sizeof(double));
    return {d.vertices_left,      d.faces_left,         d.counts.collapses,   d.counts.flips,      d.counts.undone,
            d.counts.postponed,   d.stopped_by,         s.vertices(),         s.corners(),         d.cost,
            d.merged_into.data(), d.next_merged.data(), d.last_merged.data(), d.place_of.data(),   &s.pos.data()->x,
            s.corner_vert.data(), s.corner_twin.data(), s.vert_corner.data(), s.corner_bits.data()};
}
int32_t shim_decimator_valid(const shim_decimator* d) {
    return d->surface.valid() ? 1 : 0;
}
int32_t shim_decimator_kind(const shim_decimator* d, int32_t vert) {
    return static_cast<int32_t>(d->decimator.kind(vert));
}

shim_mesh* shim_decimator_level(const shim_decimator* d) {
    const delmesh_context_options none{};
    shim_mesh* const out = shim_mesh_blank(&none);
    const Surface& s = d->surface;
    Mesh& mesh = out->mesh;
    std::vector<int32_t> vert(static_cast<size_t>(s.vertices()), -1), face(static_cast<size_t>(s.faces()), -1);
    mesh.precision = d->rules.precision;
    for (int32_t v = 0; v < s.vertices(); ++v) {
        if (s.vert_corner[v] < 0) continue;
        vert[static_cast<size_t>(v)] = mesh.vertex_count++;
        for (const double x : {s.pos[v].x, s.pos[v].y, s.pos[v].z})
            if (mesh.precision == Precision::f32)
                mesh.pos32.push_back(static_cast<float>(x));
            else
                mesh.pos64.push_back(x);
    }
    mesh.first_split = mesh.vertex_count;
    int32_t faces = 0;
    for (int32_t f = 0; f < s.faces(); ++f)
        if (!s.is_dead(f)) face[static_cast<size_t>(f)] = faces++;
    const auto moved = [&](int32_t c) { return 3 * face[static_cast<size_t>(face_of(c))] + c % 3; };
    mesh.cut_slots.copy_from(s.cut_slots);
    for (CutSlot& slot : mesh.cut_slots)
        if (slot.corner >= 0) slot.corner = moved(slot.corner);
    for (int32_t c = 0; c < s.corners(); ++c) {
        if (s.is_dead(face_of(c))) continue;
        mesh.corner_vert.push_back(vert[static_cast<size_t>(s.vert(c))]);
        mesh.corner_twin.push_back(s.twin(c) < 0 ? s.twin(c) : moved(s.twin(c)));
        mesh.corner_bits.push_back(s.corner_bits[c]);
    }
    return out;
}

} // extern "C"
