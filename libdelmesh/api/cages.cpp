// SPDX-License-Identifier: Apache-2.0
#include "api/cages.h"

#include <cmath>

#include "algo/certify.h"
#include "api/options.h"
#include "api/views.h"
#include "mesh/views.h"
#include "subdiv/limit_values.h"
#include "subdiv/reevaluate.h"

namespace dm {
namespace {

using LL = long long; // for %lld

// Both views of a list of what is sharp, or neither.
Status check_sharp(Context& context, const char* name, const delmesh_view& verts, int32_t components, const char* sharpness_name,
                   const delmesh_view& sharpness) {
    if (!is_given(verts) && !is_given(sharpness)) return DELMESH_OK;
    DM_TRY(check_view(context, name, verts, kIndexTypes, components));
    DM_TRY(check_view(context, sharpness_name, sharpness, kFloatTypes, 1));
    if (verts.count == sharpness.count && verts.count <= INT32_MAX) return DELMESH_OK;
    return context.fail(DELMESH_ERROR_INVALID_ARGUMENT, "The view '%s' had %lld elements, and '%s' %lld.", name, LL{verts.count},
                        sharpness_name, LL{sharpness.count});
}

Status check_count(Context& context, const char* name, int64_t count, int64_t expected, const char* elements) {
    if (count == expected) return DELMESH_OK;
    return context.fail(DELMESH_ERROR_INVALID_ARGUMENT, "The view '%s' had %lld elements, and there were %lld %s.", name,
                        LL{count}, LL{expected}, elements);
}

Status check_places(Context& context, const Cage& cage, const Mesh& mesh) {
    if (mesh.cage == 0)
        return context.fail(DELMESH_ERROR_INVALID_ARGUMENT,
                            "The argument 'mesh' had no places on a cage: delmesh_subdivide makes them, and 'map' keeps them.");
    if (mesh.cage == cage.fingerprint) return DELMESH_OK;
    return context.fail(DELMESH_ERROR_INVALID_ARGUMENT, "The argument 'mesh' came from a cage of other faces than 'cage'.");
}

double number_at(const delmesh_view& view, int64_t i, int32_t component) {
    return view.type == DELMESH_FLOAT32 ? static_cast<double>(element<float>(view, i)[component])
                                        : element<double>(view, i)[component];
}

} // namespace

Status check_cage(Context& context, const delmesh_cage_desc& desc, CageInput& out) {
    auto mesh = defaults<delmesh_mesh_desc>();
    mesh.positions = desc.positions;
    mesh.corner_verts = desc.corner_verts;
    mesh.face_offsets = desc.face_offsets;
    mesh.face_sizes = desc.face_sizes;
    mesh.edge_verts = desc.edge_verts;
    mesh.edge_marks = desc.edge_marks;
    mesh.layers = desc.layers;
    mesh.layer_count = desc.layer_count;
    DM_TRY(check_mesh(context, mesh, out.mesh));
    DM_TRY(check_sharp(context, "crease_edges", desc.crease_edges, 2, "crease_sharpness", desc.crease_sharpness));
    DM_TRY(check_sharp(context, "sharp_verts", desc.sharp_verts, 1, "vert_sharpness", desc.vert_sharpness));
    if (is_given(desc.holes)) DM_TRY(check_view(context, "holes", desc.holes, kIndexTypes, 1));
    out.rules = {desc.scheme, desc.boundary, desc.face_varying, desc.creasing, desc.smooth_triangles};
    out.crease_edges = with_stride(desc.crease_edges);
    out.crease_sharpness = with_stride(desc.crease_sharpness);
    out.sharp_verts = with_stride(desc.sharp_verts);
    out.vert_sharpness = with_stride(desc.vert_sharpness);
    out.holes = with_stride(desc.holes);
    return DELMESH_OK;
}

Status limit_values(Context& context, const Cage& cage, const Mesh& mesh, int32_t domain, int32_t layer,
                    const delmesh_view* source, const delmesh_view_mut& target) {
    DM_TRY(check_places(context, cage, mesh));
    const bool of_corners = domain == DELMESH_DOMAIN_CORNER;
    if (domain != DELMESH_DOMAIN_VERTEX && !of_corners)
        return context.fail(DELMESH_ERROR_INVALID_ARGUMENT,
                            "The argument 'domain' was %d, which is not DELMESH_DOMAIN_VERTEX or _CORNER.", domain);
    if (of_corners ? layer < 0 || layer >= cage.layers.size() || cage.layers[layer].channel < 0 : layer != -1)
        return context.fail(DELMESH_ERROR_INVALID_ARGUMENT, "The argument 'layer' was %d, which is no layer of that domain.",
                            layer);
    if (source == nullptr && !of_corners) return context.fail(DELMESH_ERROR_INVALID_ARGUMENT, "The argument 'source' was NULL.");
    const int32_t components = source != nullptr ? source->components : cage.layers[layer].components;
    if (components < 1 || components > LimitEvaluator::kMostComponents)
        return context.fail(DELMESH_ERROR_INVALID_ARGUMENT, "The view 'source' had %d components, outside 1 to %d.", components,
                            LimitEvaluator::kMostComponents);
    DM_TRY(check_view(context, "target", as_view(target), kFloatTypes, components));
    DM_TRY(check_count(context, "target", target.count, of_corners ? mesh.corners() : mesh.vertices(),
                       of_corners ? "corners" : "vertices"));
    DM_TRY(context.stage("limit", 0, 1));
    if (source == nullptr) return limit_of_layer(context, cage, mesh, layer, nullptr, with_stride(target));
    DM_TRY(check_view(context, "source", *source, kFloatTypes, components));
    DM_TRY(check_count(context, "source", source->count, of_corners ? cage.corners() : cage.vertices(),
                       of_corners ? "corners of the cage" : "vertices of the cage"));
    const delmesh_view from = with_stride(*source);
    Array<double> values(context.memory());
    const auto take = [&](int64_t i) {
        for (int32_t k = 0; k < components; ++k) values.push_back(number_at(from, i, k));
    };
    if (!of_corners) {
        for (int32_t v = 0; v < cage.vertices(); ++v) take(v);
        return limit_of_verts(context, cage, mesh, values, with_stride(target));
    }
    const CageLayer& of = cage.layers[layer];
    for (int64_t i = 0; i < of.value_count; ++i) take(cage.value_corner[of.first_corner + i]);
    return limit_of_layer(context, cage, mesh, layer, &values, with_stride(target));
}

Status limit_normals(Context& context, const Cage& cage, const Mesh& mesh, const delmesh_view* positions,
                     const delmesh_view_mut& target) {
    DM_TRY(check_places(context, cage, mesh));
    DM_TRY(check_view(context, "target", as_view(target), kFloatTypes, 3));
    DM_TRY(check_count(context, "target", target.count, mesh.corners(), "corners"));
    DM_TRY(context.stage("normals", 0, 1));
    if (positions == nullptr) return limit_normals(context, cage, mesh, cage.positions.data(), with_stride(target));
    Array<double> pose(context.memory());
    DM_TRY(read_pose(context, cage, *positions, pose));
    return limit_normals(context, cage, mesh, pose.data(), with_stride(target));
}

Status read_pose(Context& context, const Cage& cage, const delmesh_view& positions, Array<double>& pose) {
    DM_TRY(check_view(context, "positions", positions, kFloatTypes, 3));
    DM_TRY(check_count(context, "positions", positions.count, cage.vertices(), "vertices of the cage"));
    const delmesh_view from = with_stride(positions);
    pose.resize_uninitialized(3 * from.count);
    for (int64_t v = 0; v < from.count; ++v)
        for (int32_t k = 0; k < 3; ++k) {
            pose[3 * v + k] = number_at(from, v, k);
            if (!std::isfinite(pose[3 * v + k]))
                return context.fail(DELMESH_ERROR_INVALID_ARGUMENT, "positions: vertex %lld had a NaN or infinite coordinate.",
                                    LL{v});
        }
    return DELMESH_OK;
}

Status reevaluate(Context& context, const Cage& cage, const Mesh& mesh, const delmesh_view& positions, Mesh& out, bool certify,
                  delmesh_reevaluate_report& report) {
    Array<double> pose(context.memory());
    DM_TRY(check_places(context, cage, mesh));
    DM_TRY(read_pose(context, cage, positions, pose));
    DM_TRY(reevaluate(context, cage, mesh, pose, out, report));
    if (!certify) return DELMESH_OK;
    Certificate certificate;
    DM_TRY(context.stage("certify", 0.8, 1));
    DM_TRY(certify_mesh(context, out, true, certificate, nullptr, nullptr));
    report.nld_interior = certificate.nld_interior;
    report.nld_boundary = certificate.nld_boundary;
    report.zero_area_faces = certificate.zero_area_faces;
    report.delaunay = certificate.nld_interior + certificate.nld_boundary + certificate.zero_area_faces == 0;
    return DELMESH_OK;
}

} // namespace dm
