// SPDX-License-Identifier: Apache-2.0
#include "api/transfer.h"

#include "algo/fit.h"
#include "algo/transfer.h"
#include "api/views.h"
#include "mesh/source_map.h"

namespace dm {
namespace {

constexpr uint32_t kLayerTypes = kFloatTypes | kIndexTypes | type_bit(DELMESH_UINT8);
constexpr int32_t kMostComponents = 256, kMostEntries = 65535;

using LL = long long; // for %lld

struct Domain {
    const char *source, *target; // what there is one element for
    int64_t source_count, target_count;
    bool map; // whether the mesh must have one
};

Domain domain_of(const Mesh& mesh, int32_t domain) {
    switch (domain) {
    case DELMESH_DOMAIN_VERTEX:
        return {"source vertices", "vertices", mesh.source_verts, mesh.vertices(), false};
    case DELMESH_DOMAIN_CORNER:
        return {"source corners", "corners", mesh.source_corners, mesh.corners(), true};
    case DELMESH_DOMAIN_FACE:
        return {"source faces", "faces", mesh.source_faces, mesh.faces(), false};
    case DELMESH_DOMAIN_EDGE:
        return {"source edges", "edges", mesh.source_edges, mesh.counts.edges, true};
    default:
        return {};
    }
}

Status check_count(Context& context, const char* name, int64_t count, int64_t expected, const char* elements) {
    if (count == expected) return DELMESH_OK;
    return context.fail(DELMESH_ERROR_INVALID_ARGUMENT, "The view '%s' had %lld elements, and there were %lld %s.", name,
                        LL{count}, LL{expected}, elements);
}

Status check_range(Context& context, const char* name, int32_t value, int32_t least, int32_t most) {
    if (value >= least && value <= most) return DELMESH_OK;
    return context.fail(DELMESH_ERROR_INVALID_ARGUMENT, "The argument '%s' was %d, outside %d to %d.", name, value, least, most);
}

Status check_layer(Context& context, const Mesh& mesh, int32_t domain, int32_t policy, const delmesh_view& source,
                   const delmesh_view_mut& target) {
    const Domain of = domain_of(mesh, domain);
    if (of.source == nullptr)
        return context.fail(DELMESH_ERROR_INVALID_ARGUMENT, "The argument 'domain' was %d, which is no DELMESH_DOMAIN_*.",
                            domain);
    if (policy < DELMESH_TRANSFER_LINEAR || policy > DELMESH_TRANSFER_WEIGHTS)
        return context.fail(DELMESH_ERROR_INVALID_ARGUMENT, "The argument 'policy' was %d, which is no DELMESH_TRANSFER_*.",
                            policy);
    if (of.map && !mesh.has_map)
        return context.fail(DELMESH_ERROR_INVALID_ARGUMENT,
                            "The argument 'mesh' had no map of its %s: it was made without 'map'.", of.target);
    const bool normalised = policy == DELMESH_TRANSFER_DIRECTION || policy == DELMESH_TRANSFER_WEIGHTS;
    const int32_t components = source.components;
    if (components < 1 || components > kMostComponents)
        return context.fail(DELMESH_ERROR_INVALID_ARGUMENT, "The view 'source' had %d components, outside 1 to %d.", components,
                            kMostComponents);
    DM_TRY(check_view(context, "source", source, normalised ? kFloatTypes : kLayerTypes, components));
    DM_TRY(check_view(context, "target", as_view(target), type_bit(source.type), components));
    DM_TRY(check_count(context, "source", source.count, of.source_count, of.source));
    return check_count(context, "target", target.count, of.target_count, of.target);
}

} // namespace

Status transfer_layer(Context& context, const Mesh& mesh, int32_t domain, int32_t policy, const delmesh_view& source,
                      const delmesh_view_mut& target) {
    DM_TRY(check_layer(context, mesh, domain, policy, source, target));
    return transfer(context, mesh, domain, policy, with_stride(source), with_stride(target));
}

Status fit_layer(Context& context, const Mesh& in, const Mesh& mesh, int32_t domain, int32_t policy, const delmesh_view& source,
                 const delmesh_view_mut& target) {
    DM_TRY(check_range(context, "domain", domain, DELMESH_DOMAIN_VERTEX, DELMESH_DOMAIN_CORNER));
    if (policy != DELMESH_TRANSFER_LINEAR && policy != DELMESH_TRANSFER_DIRECTION)
        return context.fail(DELMESH_ERROR_INVALID_ARGUMENT,
                            "The argument 'policy' was %d, and only DELMESH_TRANSFER_LINEAR and _DIRECTION can fit.", policy);
    if (!mesh.has_map)
        return context.fail(DELMESH_ERROR_INVALID_ARGUMENT,
                            "The argument 'mesh' had no map of its corners: it was made without 'map'.");
    Mesh expected(context.memory());
    set_source_counts(in, expected);
    if (expected.source_verts != mesh.source_verts || expected.source_corners != mesh.source_corners ||
        expected.source_faces != mesh.source_faces)
        return context.fail(DELMESH_ERROR_INVALID_ARGUMENT,
                            "The argument 'in' had %lld vertices, %lld corners and %lld faces, and the source of 'mesh' had "
                            "%lld, %lld and %lld.",
                            LL{expected.source_verts}, LL{expected.source_corners}, LL{expected.source_faces},
                            LL{mesh.source_verts}, LL{mesh.source_corners}, LL{mesh.source_faces});
    DM_TRY(check_layer(context, mesh, domain, policy, source, target));
    return transfer_fitted(context, in, mesh, domain, policy, with_stride(source), with_stride(target));
}

Status transfer_rows(Context& context, const Mesh& mesh, const delmesh_rows& source, int32_t limit, int32_t normalise,
                     const delmesh_rows_mut& target) {
    const bool entries = is_given(as_view(target.indices)) || is_given(as_view(target.values));
    DM_TRY(check_range(context, "limit", limit, 1, kMostEntries));
    DM_TRY(check_range(context, "normalise", normalise, 0, 2));
    DM_TRY(check_view(context, "source.offsets", source.offsets, kIndexTypes, 1));
    DM_TRY(check_view(context, "source.indices", source.indices, kIndexTypes, 1));
    DM_TRY(check_view(context, "source.values", source.values, kFloatTypes, 1));
    DM_TRY(check_view(context, "target.offsets", as_view(target.offsets), kIndexTypes, 1));
    if (entries) DM_TRY(check_view(context, "target.indices", as_view(target.indices), kIndexTypes, 1));
    if (entries) DM_TRY(check_view(context, "target.values", as_view(target.values), kFloatTypes, 1));
    DM_TRY(check_count(context, "source.offsets", source.offsets.count, mesh.source_verts + 1, "source vertices and an end"));
    DM_TRY(check_count(context, "source.indices", source.indices.count, source.values.count, "values"));
    DM_TRY(check_count(context, "target.offsets", target.offsets.count, int64_t{mesh.vertices()} + 1, "vertices and an end"));

    SparseTransfer rows(context, mesh);
    DM_TRY(rows.count({with_stride(source.offsets), with_stride(source.indices), with_stride(source.values)}, limit));
    const auto check_fits = [&](const char* name, int32_t type, const char* what, int64_t number) -> Status {
        const int64_t most = type == DELMESH_INT32 ? INT32_MAX : type == DELMESH_UINT32 ? int64_t{UINT32_MAX} : INT64_MAX;
        if (number <= most) return DELMESH_OK;
        return context.fail(DELMESH_ERROR_TOO_LARGE, "The view '%s' had a type that cannot hold %s %lld.", name, what,
                            LL{number});
    };
    const auto check_room = [&](const char* name, int64_t count) -> Status {
        if (rows.entries() <= count) return DELMESH_OK;
        return context.fail(DELMESH_ERROR_TOO_LARGE, "The view '%s' had room for %lld entries, and there were %lld.", name,
                            LL{count}, LL{rows.entries()});
    };
    DM_TRY(check_fits("target.offsets", target.offsets.type, "the offset", rows.entries()));
    if (entries) DM_TRY(check_fits("target.indices", target.indices.type, "the index", rows.largest_index()));
    if (entries) DM_TRY(check_room("target.indices", target.indices.count));
    if (entries) DM_TRY(check_room("target.values", target.values.count));
    return rows.write(normalise, {with_stride(target.offsets), with_stride(target.indices), with_stride(target.values)});
}

} // namespace dm
