// SPDX-License-Identifier: Apache-2.0
#include "shim_deviation.h"

#include "shim_build.cpp" // each test links one shim, and a Surface starts from a mesh

#include "algo/deviation_guard.h"
#include "algo/measure.h"

struct shim_guarded {
    shim_guarded(shim_mesh& m, Precision precision)
        : in(m), surface(m.context, m.mesh, precision), guard(m.context, surface), changed(m.context.memory()) {}

    bool settle() {
        const bool accepted = guard.accept(changed);
        if (accepted)
            surface.keep_trial();
        else
            surface.undo_trial();
        return accepted;
    }

    shim_mesh& in;
    Surface surface;
    DeviationGuard guard;
    Array<int32_t> changed;
};

extern "C" {

shim_guarded* shim_guarded_make(shim_mesh* mesh, int32_t precision) {
    return new shim_guarded(*mesh, precision == DELMESH_FLOAT32 ? Precision::f32 : Precision::f64);
}
void shim_guarded_free(shim_guarded* g) {
    delete g;
}

int32_t shim_guarded_begin(shim_guarded* g, double limit) {
    bool within = false;
    g->in.context.begin_call();
    Status status;
    try {
        status = g->guard.begin(g->in.mesh, limit, within);
    } catch (const AllocationFailure& failure) {
        status = failure.status;
    }
    status = g->in.context.end_call(status);
    return status != DELMESH_OK ? status : within ? 1 : 0;
}

void shim_guarded_move(shim_guarded* g, int32_t vert, double x, double y, double z) {
    g->surface.pos[vert] = {x, y, z};
}

int32_t shim_guarded_collapse(shim_guarded* g, int32_t c, double x, double y, double z) {
    Surface& s = g->surface;
    if (!s.collapse_is_legal(c)) return -1;
    const int32_t p = s.vert(c), q = s.head(c);
    g->changed.clear();
    for (const int32_t v : {p, q}) {
        const int32_t start = s.vert_corner[v];
        int32_t k = start;
        do {
            g->changed.push_back(face_of(k));
            k = s.rotate(k);
        } while (k >= 0 && k != start);
    }
    const Vec3 before = s.at(p);
    s.begin_trial();
    s.collapse(c);
    s.pos[p] = {x, y, z};
    if (g->settle()) return 1;
    s.pos[p] = before;
    return 0;
}

int32_t shim_guarded_flip(shim_guarded* g, int32_t c) {
    Surface& s = g->surface;
    if (s.is_boundary(c) || s.adjacent(s.apex(c), s.apex(s.twin(c)))) return -1;
    g->changed.clear();
    g->changed.push_back(face_of(c));
    g->changed.push_back(face_of(s.twin(c)));
    s.begin_trial();
    s.flip(c);
    return g->settle() ? 1 : 0;
}

int32_t shim_guarded_is_beyond(const shim_guarded* g, int32_t near_face, double x, double y, double z) {
    return g->guard.is_beyond({x, y, z}, near_face) ? 1 : 0;
}

int32_t shim_guarded_corners(const shim_guarded* g) {
    return g->surface.corners();
}
int32_t shim_guarded_vert(const shim_guarded* g, int32_t c) {
    return g->surface.vert(c);
}
void shim_guarded_at(const shim_guarded* g, int32_t vert, double* xyz) {
    const Vec3& p = g->surface.at(vert);
    xyz[0] = p.x;
    xyz[1] = p.y;
    xyz[2] = p.z;
}
int64_t shim_guarded_faces(const shim_guarded* g) {
    return g->surface.faces() - g->surface.dead_faces;
}

int32_t shim_guarded_measure(shim_guarded* g, double absolute, delmesh_distance_report* report) {
    const Surface& s = g->surface;
    Context& context = g->in.context;
    Mesh now(context.memory());
    now.precision = Precision::f64;
    now.vertex_count = s.vertices();
    for (int32_t v = 0; v < s.vertices(); ++v)
        for (const double x : {s.at(v).x, s.at(v).y, s.at(v).z}) now.pos64.push_back(x);
    for (int32_t c = 0; c < s.corners(); ++c)
        if (!s.is_dead(face_of(c))) now.corner_vert.push_back(s.vert(c));
    now.corner_twin.assign(now.corners(), kBoundary);
    delmesh_distance_options options{};
    options.struct_size = sizeof options;
    options.compute_bound = 1;
    options.absolute_error = absolute;
    *report = {};
    report->struct_size = sizeof *report;
    context.begin_call();
    return context.end_call(measure_distance(context, g->in.mesh, now, options, *report));
}
}
