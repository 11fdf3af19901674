// SPDX-License-Identifier: Apache-2.0
#include "api/options.h"

#include <cmath>
#include <cstdio>

#include "base/number.h"
#include "mesh/mesh.h"

namespace dm {

// ---- Defaults: what is not named here is zero -------------------------------------------------------------------------------

namespace {
template <class T>
T sized() {
    T value{};
    value.struct_size = sizeof(T);
    return value;
}
} // namespace

template <>
delmesh_context_options defaults() {
    return sized<delmesh_context_options>();
}
template <>
delmesh_mesh_desc defaults() {
    return sized<delmesh_mesh_desc>();
}
template <>
delmesh_layer defaults() {
    auto layer = sized<delmesh_layer>();
    layer.affine_tolerance = -1;
    return layer;
}
template <>
delmesh_mesh_info defaults() {
    return sized<delmesh_mesh_info>();
}
template <>
delmesh_certify_options defaults() {
    return sized<delmesh_certify_options>();
}
template <>
delmesh_certify_report defaults() {
    return sized<delmesh_certify_report>();
}
template <>
delmesh_preserve_estimate defaults() {
    return sized<delmesh_preserve_estimate>();
}
template <>
delmesh_quality_report defaults() {
    return sized<delmesh_quality_report>();
}

template <>
delmesh_remesh_options defaults() {
    auto options = sized<delmesh_remesh_options>();
    options.precision = DELMESH_FLOAT32;
    options.effort = 1;
    options.feature_angle = 30;
    options.max_normal_turn = -1;
    options.tolerance = -1;
    return options;
}

template <>
delmesh_remesh_report defaults() {
    auto report = sized<delmesh_remesh_report>();
    report.surface_bound = -1;
    report.worst_edge_from = report.worst_edge_to = report.worst_face = -1;
    return report;
}

template <>
delmesh_decimate_options defaults() {
    auto options = sized<delmesh_decimate_options>();
    options.prepare = DELMESH_MODE_FLIP;
    options.precision = DELMESH_FLOAT32;
    options.feature_angle = 30;
    options.tolerance = -1;
    options.max_normal_turn = 78;
    options.boundary_weight = 1;
    return options;
}

template <>
delmesh_level_report defaults() {
    auto report = sized<delmesh_level_report>();
    report.bound = -1;
    return report;
}

template <>
delmesh_decimate_report defaults() {
    auto report = sized<delmesh_decimate_report>();
    report.prepare_bound = -1;
    return report;
}

template <>
delmesh_cage_desc defaults() {
    return sized<delmesh_cage_desc>();
}
template <>
delmesh_subdivide_options defaults() {
    auto options = sized<delmesh_subdivide_options>();
    options.value = 8;
    options.precision = DELMESH_FLOAT32;
    return options;
}
template <>
delmesh_reevaluate_report defaults() {
    return sized<delmesh_reevaluate_report>();
}
template <>
delmesh_subdivide_report defaults() {
    auto report = sized<delmesh_subdivide_report>();
    report.limit_distance = report.limit_rms = -1;
    return report;
}

template <>
delmesh_distance_options defaults() {
    auto options = sized<delmesh_distance_options>();
    options.compute_bound = 1;
    options.relative_error = 0.1;
    options.absolute_error = 1e-4;
    return options;
}

template <>
delmesh_distance_report defaults() {
    auto report = sized<delmesh_distance_report>();
    report.hausdorff_bound = report.a_to_b_bound = report.b_to_a_bound = -1;
    return report;
}

// ---- Sizes ------------------------------------------------------------------------------------------------------------------

Status copy_known_part(const void* given, void* out, uint32_t known_size) {
    uint32_t size;
    std::memcpy(&size, given, sizeof size);
    if (!is_struct_size(size)) return DELMESH_ERROR_INVALID_ARGUMENT;
    const auto* bytes = static_cast<const unsigned char*>(given);
    for (uint32_t i = known_size; i < size; ++i)
        if (bytes[i] != 0) return DELMESH_ERROR_UNSUPPORTED;
    std::memcpy(out, given, size < known_size ? size : known_size);
    std::memcpy(out, &known_size, sizeof known_size);
    return DELMESH_OK;
}

// ---- Fields -----------------------------------------------------------------------------------------------------------------

namespace {

template <class T>
Status read_sized(Context& context, const char* name, const T* given, T& out) {
    out = defaults<T>();
    if (given == nullptr) return DELMESH_OK;
    const Status status = copy_known_part(given, &out, sizeof(T));
    if (status == DELMESH_ERROR_INVALID_ARGUMENT)
        return context.fail(status, "The struct_size of '%s' was %u: its _init function was not called.", name,
                            given->struct_size);
    if (status == DELMESH_ERROR_UNSUPPORTED)
        return context.fail(status, "A field of '%s' past its first %zu bytes was set, which this older library does not know.",
                            name, sizeof(T));
    return status;
}

Status check_integer(Context& context, const char* name, int64_t value, int64_t least, int64_t most) {
    if (value >= least && value <= most) return DELMESH_OK;
    return context.fail(DELMESH_ERROR_INVALID_ARGUMENT, "The option '%s' was %lld, outside %lld to %lld.", name,
                        static_cast<long long>(value), static_cast<long long>(least), static_cast<long long>(most));
}

Status check_number(Context& context, const char* name, double value, double least, double most) {
    if (value >= least && value <= most && std::isfinite(value)) return DELMESH_OK;
    return context.fail(DELMESH_ERROR_INVALID_ARGUMENT, "The option '%s' was %s, outside %s to %s.", name, Number(value).text,
                        Number(least).text, Number(most).text);
}

constexpr double kInfinity = HUGE_VAL;

Status check_map_and_release(Context& context, int32_t map, uint32_t release) {
    DM_TRY(check_integer(context, "map", map, 0, 1));
    if ((release & ~uint32_t{kEdgeGiven}) == 0) return DELMESH_OK;
    return context.fail(DELMESH_ERROR_INVALID_ARGUMENT,
                        "The option 'release' was %u, which has bits of edges that are not released.", release);
}

} // namespace

Status read_options(const delmesh_context_options* given, delmesh_context_options& out) {
    out = defaults<delmesh_context_options>();
    if (given == nullptr) return DELMESH_OK;
    DM_TRY(copy_known_part(given, &out, sizeof out));
    const bool pair = (out.alloc == nullptr) == (out.free == nullptr);
    return pair && out.max_threads >= 0 ? DELMESH_OK : DELMESH_ERROR_INVALID_ARGUMENT;
}

Status read_options(Context& context, const delmesh_mesh_desc* given, delmesh_mesh_desc& out) {
    if (given == nullptr) return context.fail(DELMESH_ERROR_INVALID_ARGUMENT, "The argument 'desc' was NULL.");
    DM_TRY(read_sized(context, "desc", given, out));
    DM_TRY(check_integer(context, "weld", out.weld, DELMESH_WELD_NONE, DELMESH_WELD_EXACT));
    DM_TRY(check_integer(context, "strict", out.strict, 0, 1));
    DM_TRY(check_integer(context, "reserved0", out.reserved0, 0, 0));
    DM_TRY(check_integer(context, "layer_count", out.layer_count, 0, 64));
    return check_integer(context, "reserved1", out.reserved1, 0, 0);
}

Status read_options(Context& context, int32_t number, const delmesh_layer* given, delmesh_layer& out) {
    char name[32];
    std::snprintf(name, sizeof name, "layers[%d]", number);
    DM_TRY(read_sized(context, name, given, out));
    DM_TRY(check_integer(context, "kind", out.kind, DELMESH_LAYER_UV, DELMESH_LAYER_FACE_SET));
    DM_TRY(check_integer(context, "border", out.border, DELMESH_BORDER_DEFAULT, DELMESH_BORDER_FREE));
    DM_TRY(check_integer(context, "reserved0", out.reserved0, 0, 0));
    DM_TRY(check_number(context, "tolerance", out.tolerance, 0, kInfinity));
    DM_TRY(check_number(context, "affine_tolerance", out.affine_tolerance, -kInfinity, kInfinity));
    return check_number(context, "weight", out.weight, 0, kInfinity);
}

Status read_options(Context& context, const delmesh_remesh_options* given, delmesh_remesh_options& out) {
    DM_TRY(read_sized(context, "options", given, out));
    DM_TRY(check_integer(context, "mode", out.mode, DELMESH_MODE_PRESERVE, DELMESH_MODE_FEATURE));
    DM_TRY(check_integer(context, "placement", out.placement, DELMESH_PLACEMENT_INTERVAL, DELMESH_PLACEMENT_SHELLS));
    DM_TRY(check_integer(context, "boundary", out.boundary, DELMESH_BOUNDARY_NONOBTUSE, DELMESH_BOUNDARY_IGNORE));
    DM_TRY(check_integer(context, "precision", out.precision, DELMESH_FLOAT32, DELMESH_FLOAT64));
    DM_TRY(check_integer(context, "strict", out.strict, 0, 1));
    DM_TRY(check_integer(context, "compact", out.compact, 0, 1));
    DM_TRY(check_integer(context, "effort", out.effort, 0, INT32_MAX));
    DM_TRY(check_number(context, "feature_angle", out.feature_angle, 0, 180));
    DM_TRY(check_number(context, "max_normal_turn", out.max_normal_turn, -kInfinity, 180));
    DM_TRY(check_number(context, "shell_unit", out.shell_unit, -kInfinity, kInfinity));
    DM_TRY(check_number(context, "tolerance", out.tolerance, -kInfinity, kInfinity));
    DM_TRY(check_integer(context, "max_vertices", out.max_vertices, 0, INT64_MAX));
    DM_TRY(check_integer(context, "split_budget", out.split_budget, 0, INT64_MAX));
    return check_map_and_release(context, out.map, out.release);
}

Status read_options(Context& context, const delmesh_decimate_options* given, delmesh_decimate_options& out) {
    DM_TRY(read_sized(context, "options", given, out));
    DM_TRY(check_integer(context, "prepare", out.prepare, DELMESH_MODE_PRESERVE, DELMESH_MODE_FEATURE));
    DM_TRY(check_integer(context, "boundary", out.boundary, DELMESH_BOUNDARY_NONOBTUSE, DELMESH_BOUNDARY_IGNORE));
    DM_TRY(check_integer(context, "precision", out.precision, DELMESH_FLOAT32, DELMESH_FLOAT64));
    DM_TRY(check_integer(context, "strict", out.strict, 0, 1));
    DM_TRY(
        check_integer(context, "collapse_placement", out.collapse_placement, DELMESH_COLLAPSE_ALL, DELMESH_COLLAPSE_ENDPOINTS));
    DM_TRY(check_integer(context, "quality", out.quality, 0, INT32_MAX));
    DM_TRY(check_integer(context, "reserved0", out.reserved0, 0, 0));
    DM_TRY(check_number(context, "feature_angle", out.feature_angle, 0, 180));
    DM_TRY(check_number(context, "tolerance", out.tolerance, -kInfinity, kInfinity));
    DM_TRY(check_number(context, "max_normal_turn", out.max_normal_turn, 0, 90));
    DM_TRY(check_number(context, "boundary_weight", out.boundary_weight, 0, kInfinity));
    DM_TRY(check_number(context, "prune", out.prune, 0, kInfinity));
    return check_map_and_release(context, out.map, out.release);
}

Status read_options(Context& context, const delmesh_cage_desc* given, delmesh_cage_desc& out) {
    if (given == nullptr) return context.fail(DELMESH_ERROR_INVALID_ARGUMENT, "The argument 'desc' was NULL.");
    DM_TRY(read_sized(context, "desc", given, out));
    DM_TRY(check_integer(context, "scheme", out.scheme, DELMESH_SCHEME_CATMULL_CLARK, DELMESH_SCHEME_BILINEAR));
    DM_TRY(check_integer(context, "boundary", out.boundary, DELMESH_CAGE_BOUNDARY_EDGE_AND_CORNER, DELMESH_CAGE_BOUNDARY_NONE));
    DM_TRY(check_integer(context, "face_varying", out.face_varying, DELMESH_FACE_VARYING_BOUNDARIES, DELMESH_FACE_VARYING_ALL));
    DM_TRY(check_integer(context, "creasing", out.creasing, DELMESH_CREASING_UNIFORM, DELMESH_CREASING_CHAIKIN));
    DM_TRY(check_integer(context, "smooth_triangles", out.smooth_triangles, 0, 1));
    DM_TRY(check_integer(context, "layer_count", out.layer_count, 0, 64));
    return check_integer(context, "reserved0", out.reserved0, 0, 0);
}

Status read_options(Context& context, const delmesh_subdivide_options* given, delmesh_subdivide_options& out) {
    constexpr double kHighestRate = 4096;
    DM_TRY(read_sized(context, "options", given, out));
    DM_TRY(check_integer(context, "fineness", out.fineness, DELMESH_FINENESS_RATE, DELMESH_FINENESS_FACES));
    if (out.fineness == DELMESH_FINENESS_RATE) {
        DM_TRY(check_number(context, "value", out.value, 1, kHighestRate));
        if (out.value != std::floor(out.value))
            return context.fail(DELMESH_ERROR_INVALID_ARGUMENT, "The option 'value' was %s, and rates are whole numbers.",
                                Number(out.value).text);
    } else if (!(out.value > 0)) { // NaN too
        return context.fail(DELMESH_ERROR_INVALID_ARGUMENT, "The option 'value' was %s, which is not more than 0.",
                            Number(out.value).text);
    }
    DM_TRY(check_integer(context, "evaluation", out.evaluation, DELMESH_EVALUATION_BFR, DELMESH_EVALUATION_FAR));
    DM_TRY(check_integer(context, "measure", out.measure, 0, 1));
    DM_TRY(check_integer(context, "reserved0", out.reserved0, 0, 0));
    return check_integer(context, "precision", out.precision, DELMESH_FLOAT32, DELMESH_FLOAT64);
}

Status read_options(Context& context, const delmesh_certify_options* given, delmesh_certify_options& out) {
    DM_TRY(read_sized(context, "options", given, out));
    return check_integer(context, "boundary", out.boundary, DELMESH_BOUNDARY_NONOBTUSE, DELMESH_BOUNDARY_IGNORE);
}

Status read_options(Context& context, const delmesh_distance_options* given, delmesh_distance_options& out) {
    DM_TRY(read_sized(context, "options", given, out));
    DM_TRY(check_integer(context, "compute_bound", out.compute_bound, 0, 1));
    DM_TRY(check_integer(context, "samples", out.samples, 0, INT64_MAX));
    DM_TRY(check_number(context, "relative_error", out.relative_error, 0, kInfinity));
    // The bound of a surface to itself comes down to the absolute part alone: at 0 it would be refined for ever.
    return check_number(context, "absolute_error", out.absolute_error, 1e-9, kInfinity);
}

} // namespace dm
