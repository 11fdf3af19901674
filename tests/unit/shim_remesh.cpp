// SPDX-License-Identifier: Apache-2.0
#include "shim_remesh.h"

#include "shim_build.cpp" // each test links one shim

#include "algo/certify.h"
#include "algo/remesh.h"
#include "geom/predicates.h"

extern "C" {

shim_mesh* shim_remesh(const shim_mesh* in, const delmesh_remesh_options* options, int32_t threads,
                       delmesh_remesh_report* report) {
    delmesh_context_options used{};
    used.max_threads = threads;
    shim_mesh* const out = shim_mesh_blank(&used);
    shim_remesh_into(out, in, options, report);
    return out;
}

shim_mesh* shim_mesh_blank(const delmesh_context_options* options) {
    return new shim_mesh(*options, Memory::create(*options));
}
void shim_remesh_into(shim_mesh* out, const shim_mesh* in, const delmesh_remesh_options* options, delmesh_remesh_report* report) {
    *report = {};
    report->struct_size = sizeof *report;
    report->worst_face = report->worst_edge_from = report->worst_edge_to = -1; // what a caller's report begins with
    guarded(*out, [&] { return remesh(out->context, in->mesh, *options, out->mesh, *report); });
}
void shim_mesh_cancel(shim_mesh* m) {
    m->context.request_cancel();
}

int32_t shim_vertex_map(const shim_mesh* m, int32_t vert, int32_t verts[3], double weights[3]) {
    const bool split = vert >= m->mesh.first_split;
    const VertexMap map = split ? m->mesh.split_map[vert - m->mesh.first_split] : VertexMap{{vert, vert, vert}, {1, 0, 0}};
    for (int k = 0; k < 3; ++k) {
        verts[k] = map.vert[k];
        weights[k] = map.weight[k];
    }
    return split ? 1 : 0;
}

// Of a set of edges and faces: which of an interior edge's two corners stands for it is certify's own business.
static uint64_t sum_of(const Mesh& mesh, const Array<int32_t>& corners, const Array<int32_t>& faces) {
    const auto mix = [](uint64_t x) {
        x = (x ^ x >> 30) * 0xbf58476d1ce4e5b9;
        x = (x ^ x >> 27) * 0x94d049bb133111eb;
        return x ^ x >> 31;
    };
    uint64_t sum = 0;
    for (const int32_t c : corners) {
        const int32_t t = mesh.corner_twin[c];
        sum += mix(static_cast<uint64_t>(t >= 0 && t < c ? t : c));
    }
    for (const int32_t f : faces) sum += mix(0x100000000u + static_cast<uint64_t>(f));
    return sum;
}

static shim_certificate certificate_of(const Mesh& mesh, const Certificate& c, bool boundary_rule, const Array<int32_t>& corners,
                                       const Array<int32_t>& faces) {
    bool in_order = true;
    for (int64_t i = 1; i < corners.size(); ++i) in_order &= corners[i - 1] < corners[i];
    for (int64_t i = 1; i < faces.size(); ++i) in_order &= faces[i - 1] < faces[i];
    const bool first = corners.empty() || c.first_bad_corner == corners[0];
    return {
        c.nld_interior, c.nld_boundary, c.zero_area_faces,         c.first_zero_face,           c.delaunay(boundary_rule) ? 1 : 0,
        corners.size(), faces.size(),   in_order && first ? 1 : 0, sum_of(mesh, corners, faces)};
}

shim_certificate shim_certify(shim_mesh* m, int32_t boundary_rule, int32_t lists) {
    Certificate c;
    Array<int32_t> corners(m->context.memory()), faces(m->context.memory());
    guarded(*m, [&] {
        return certify_mesh(m->context, m->mesh, boundary_rule != 0, c, lists != 0 ? &corners : nullptr,
                            lists != 0 ? &faces : nullptr);
    });
    return certificate_of(m->mesh, c, boundary_rule != 0, corners, faces);
}

shim_certificate shim_scan_all(const shim_mesh* m, int32_t boundary_rule) {
    const Mesh& mesh = m->mesh;
    Certificate c;
    Array<int32_t> corners(const_cast<shim_mesh*>(m)->context.memory()), faces(corners.memory());
    const auto at = [&](int32_t corner) { return mesh.position(mesh.corner_vert[corner]); };
    for (int32_t k = 0; k < mesh.corners(); ++k) {
        const Vec3 a = at(k), b = at(next_corner(k)), p = at(prev_corner(k));
        const int32_t t = mesh.corner_twin[k];
        if (k % 3 == 0 && zero_area(a, b, p)) {
            ++c.zero_area_faces;
            faces.push_back(k / 3);
            if (c.first_zero_face < 0) c.first_zero_face = k / 3;
        }
        if (t < 0) {
            if (boundary_rule == 0 || !boundary_edge_is_nld(a, b, p)) continue;
            ++c.nld_boundary;
        } else {
            if (t < k || !edge_is_nld(a, b, p, at(prev_corner(t)))) continue;
            ++c.nld_interior;
        }
        corners.push_back(k);
        if (c.first_bad_corner < 0) c.first_bad_corner = k;
    }
    return certificate_of(m->mesh, c, boundary_rule != 0, corners, faces);
}

} // extern "C"
