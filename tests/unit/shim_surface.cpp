// SPDX-License-Identifier: Apache-2.0
#include "shim_surface.h"

#include "shim_build.cpp" // each test links one shim, and a Surface starts from a mesh

#include <algorithm>

#include "mesh/surface.h"

struct shim_surface {
    shim_surface(shim_mesh& m, Precision precision) : surface(m.context, m.mesh, precision) {}
    shim_surface(Surface& whole, uint8_t number) : surface(whole, number) {}
    Surface surface;
};

extern "C" {

shim_surface* shim_surface_make(shim_mesh* mesh, int32_t precision) {
    return new shim_surface(*mesh, precision == DELMESH_FLOAT32 ? Precision::f32 : Precision::f64);
}
void shim_surface_free(shim_surface* s) {
    delete s;
}

shim_table shim_surface_table(shim_surface* shim) {
    Surface& s = shim->surface;
    static_assert(sizeof(Vec3) == 3 * sizeof(double) && sizeof(Carrier) == 2 * sizeof(int32_t));
    return {reinterpret_cast<double*>(s.pos.data()),
            s.corner_vert.data(),
            s.corner_twin.data(),
            s.corner_bits.data(),
            s.vert_corner.data(),
            s.face_src.data(),
            reinterpret_cast<int32_t*>(s.cut_slots.data()),
            s.vert_root.data(),
            s.copy_of.data(),
            reinterpret_cast<int32_t*>(s.carriers.data()),
            s.carrier_splits.data(),
            s.pins.data(),
            s.corner_vert.size(),
            s.corner_twin.size(),
            s.corner_bits.size(),
            s.vert_corner.size(),
            s.face_src.size(),
            s.cut_slots.size(),
            s.vert_root.size(),
            s.copy_of.size(),
            s.carriers.size(),
            s.dead_faces,
            s.vertices_in_use(),
            s.pins.size(),
            s.vertices(),
            s.first_copy,
            s.first_split};
}

int32_t shim_surface_valid(const shim_surface* s) {
    return s->surface.valid() ? 1 : 0;
}
int32_t shim_surface_valid_traps(void) {
#if defined(DELMESH_DEBUG_CHECKS)
    return 1;
#else
    return 0;
#endif
}
int32_t shim_surface_adjacent(const shim_surface* s, int32_t a, int32_t b) {
    return s->surface.adjacent(a, b) ? 1 : 0;
}
int32_t shim_surface_has_face(const shim_surface* s, int32_t a, int32_t b, int32_t c) {
    return s->surface.has_face(a, b, c) ? 1 : 0;
}
int32_t shim_surface_on_one_carrier(const shim_surface* s, int32_t a, int32_t b, int32_t c) {
    return s->surface.on_one_carrier(a, b, c) ? 1 : 0;
}

void shim_surface_flip(shim_surface* s, int32_t corner) {
    s->surface.flip(corner);
}

// What the loop in algo/delaunay does to place a vertex.
static SplitVertex place(Surface& s, int32_t corner, double t, Vec3& position) {
    double tp, tq;
    const int32_t carrier = s.carrier_of(s.vert(corner), s.head(corner), tp, tq);
    const Carrier line = s.carriers[carrier];
    SplitVertex where{carrier, tp + t * (tq - tp), {0, 0, 0}, 1 + std::max(s.depth(line.a), s.depth(line.b))};
    const Vec3 &a = s.at(line.a), &b = s.at(line.b);
    position = a + where.t * (b - a);
    where.exact = position;
    return where;
}

int32_t shim_surface_split(shim_surface* shim, int32_t corner) {
    Vec3 position;
    const SplitVertex where = place(shim->surface, corner, 0.5, position);
    return shim->surface.split(corner, shim->surface.add_vertex(position, where, -1));
}

int32_t shim_surface_split_everywhere(shim_surface* shim, int32_t corner, double t, int32_t* pieces, int32_t most) {
    Vec3 position;
    const SplitVertex where = place(shim->surface, corner, t, position);
    Array<int32_t> made(shim->surface.pos.memory());
    shim->surface.split_everywhere(corner, position, where, made);
    for (int32_t i = 0; i < made.size() && i < most; ++i) pieces[i] = made[i];
    return static_cast<int32_t>(made.size());
}

double shim_surface_split_parameter(const shim_surface* shim, int32_t vert, int32_t* carrier) {
    const SplitVertex& where = shim->surface.split_vertices[vert - shim->surface.first_split];
    *carrier = where.carrier;
    return where.t;
}

int32_t shim_surface_collapse_is_legal(const shim_surface* s, int32_t corner) {
    return s->surface.collapse_is_legal(corner) ? 1 : 0;
}
void shim_surface_collapse(shim_surface* s, int32_t corner) {
    s->surface.collapse(corner);
}
int32_t shim_surface_collapse_and_cut(shim_surface* s, int32_t corner) {
    return s->surface.collapse_and_cut(corner) ? 1 : 0;
}
void shim_surface_remove_boundary_face(shim_surface* s, int32_t corner) {
    s->surface.remove_boundary_face(corner);
}

void shim_surface_unsplit(shim_surface* s, int32_t corner) {
    s->surface.unsplit(corner);
}
void shim_surface_begin_trial(shim_surface* s) {
    s->surface.begin_trial();
}
void shim_surface_keep_trial(shim_surface* s) {
    s->surface.keep_trial();
}
void shim_surface_undo_trial(shim_surface* s) {
    s->surface.undo_trial();
}

shim_share shim_surface_grow_blank(shim_surface* whole, int32_t verts, int32_t faces, int32_t carriers) {
    const Surface::Supply s = whole->surface.grow_blank(verts, faces, carriers);
    return {{s.verts.next, s.faces.next, s.carriers.next}, {s.verts.end, s.faces.end, s.carriers.end}};
}
shim_surface* shim_surface_part(shim_surface* whole, uint8_t number) {
    shim_surface* const part = new shim_surface(whole->surface, number);
    Surface::TrialLog log(whole->surface.pos.memory());
    part->surface.swap_log(log);
    return part;
}
void shim_surface_supply(shim_surface* part, shim_surface* whole, const shim_share* share, const uint8_t* owner) {
    part->surface.refresh(whole->surface, owner);
    if (share == nullptr) return;
    part->surface.supply({{share->from[0], share->to[0]}, {share->from[1], share->to[1]}, {share->from[2], share->to[2]}});
    part->surface.reserve_freed(share->to[0]); // more than there are
}
void shim_surface_take_back(shim_surface* whole, shim_surface* part) {
    whole->surface.take_back(part->surface);
}
int32_t shim_surface_may_edit(const shim_surface* s, int32_t corner) {
    return s->surface.may_edit(corner) ? 1 : 0;
}
int32_t shim_surface_has_room(const shim_surface* s) {
    return s->surface.has_room() ? 1 : 0;
}

} // extern "C"
