// SPDX-License-Identifier: Apache-2.0
// The functions of delmesh.h, in its order. No logic here: guard, check, convert, call.
#include "algo/decimate.h"
#include "algo/estimate.h"
#include "algo/measure.h"
#include "algo/remesh.h"
#include "algo/surface_map.h"
#include "api/arrays.h"
#include "api/cages.h"
#include "api/findings.h"
#include "api/guard.h"
#include "api/levels.h"
#include "api/names.h"
#include "api/options.h"
#include "api/transfer.h"
#include "api/views.h"
#include "mesh/build.h"
#include "mesh/validate.h"
#include "subdiv/subdivide.h"

using namespace dm;

namespace {

// Both calls that decimate.
int32_t make_levels(delmesh_context* context, const delmesh_mesh* in, const Targets& targets,
                    const delmesh_decimate_options* options, delmesh_mesh** out, LevelReports levels,
                    delmesh_decimate_report* report) {
    Report result(report);
    return guarded(context, out, targets.count, [&](Context& c, Mesh* const* made) {
        delmesh_decimate_options checked;
        SourceValues values(c.memory());
        const Meter meter(c.memory(), result.value.seconds_total, result.value.peak_bytes);
        DM_TRY(require(c, "in", in));
        DM_TRY(result.check(c));
        DM_TRY(levels.check(c));
        DM_TRY(read_options(c, options, checked));
        DM_TRY(check_targets(c, targets, in->mesh));
        DM_TRY(values.read(c, in->mesh, checked));
        return decimate(c, in->mesh, targets.of, targets.count, checked, values.input(), made, levels.values, result.value);
    });
}

} // namespace

extern "C" {

// ---- Context ----------------------------------------------------------------------------------------------------------------

void delmesh_context_options_init(delmesh_context_options* options, uint32_t struct_size) {
    init_struct(options, struct_size);
}

int32_t delmesh_context_create(const delmesh_context_options* options, delmesh_context** out) {
    if (out == nullptr) return DELMESH_ERROR_INVALID_ARGUMENT;
    *out = nullptr;
    delmesh_context_options checked;
    DM_TRY(read_options(options, checked));
    return create_context(checked, *out);
}

void delmesh_context_destroy(delmesh_context* context) {
    destroy_context(context);
}

void delmesh_cancel(delmesh_context* context) {
    if (context != nullptr) context->request_cancel();
}

const char* delmesh_last_error(const delmesh_context* context) {
    return context != nullptr ? context->error_text() : "";
}

const char* delmesh_status_name(int32_t status) {
    return status_name(status);
}

uint32_t delmesh_version(void) {
    return DELMESH_VERSION_MAJOR << 16 | DELMESH_VERSION_MINOR << 8 | DELMESH_VERSION_PATCH;
}

void delmesh_context_memory(const delmesh_context* context, uint64_t* current, uint64_t* peak, uint64_t* allocations) {
    if (current != nullptr) *current = context != nullptr ? context->memory().current() : 0;
    if (peak != nullptr) *peak = context != nullptr ? context->memory().peak() : 0;
    if (allocations != nullptr) *allocations = context != nullptr ? context->memory().allocations() : 0;
}

// ---- Mesh -------------------------------------------------------------------------------------------------------------------

void delmesh_layer_init(delmesh_layer* layer, uint32_t struct_size) {
    init_struct(layer, struct_size);
}
void delmesh_mesh_desc_init(delmesh_mesh_desc* desc, uint32_t struct_size) {
    init_struct(desc, struct_size);
}
void delmesh_mesh_info_init(delmesh_mesh_info* info, uint32_t struct_size) {
    init_struct(info, struct_size);
}

int32_t delmesh_mesh_create(delmesh_context* context, const delmesh_mesh_desc* desc, delmesh_mesh** out) {
    return guarded(context, out, [&](Context& c, Mesh& made) {
        delmesh_mesh_desc checked;
        MeshInput input;
        DM_TRY(read_options(c, desc, checked));
        DM_TRY(check_mesh(c, checked, input));
        return build_mesh(c, input, made);
    });
}

int32_t delmesh_mesh_get_info(const delmesh_mesh* mesh, delmesh_mesh_info* info) {
    return guarded(mesh, [&](const delmesh_mesh& m) { return read_info(m, info); });
}

int32_t delmesh_mesh_layer_borders(const delmesh_mesh* mesh, int32_t layer, int64_t* edges) {
    if (edges == nullptr) return DELMESH_ERROR_INVALID_ARGUMENT;
    *edges = 0;
    return guarded(mesh, [&](const delmesh_mesh& m) {
        if (layer < 0 || layer >= m.mesh.layers.size()) return DELMESH_ERROR_INVALID_ARGUMENT;
        *edges = m.mesh.layers[layer].borders;
        return DELMESH_OK;
    });
}

int32_t delmesh_mesh_read(const delmesh_mesh* mesh, int32_t what, const delmesh_view_mut* dst) {
    if (dst == nullptr) return DELMESH_ERROR_INVALID_ARGUMENT;
    return guarded(mesh, [&](const delmesh_mesh& m) { return read_array(m, what, *dst); });
}

int32_t delmesh_mesh_borrow(const delmesh_mesh* mesh, int32_t what, delmesh_view* out) {
    if (out == nullptr) return DELMESH_ERROR_INVALID_ARGUMENT;
    *out = {};
    return guarded(mesh, [&](const delmesh_mesh& m) { return borrow_array(m, what, *out); });
}

int32_t delmesh_mesh_validate(delmesh_context* context, const delmesh_mesh* mesh) {
    return guarded(context, [&](Context& c) {
        DM_TRY(require(c, "mesh", mesh));
        return validate_mesh(c, mesh->mesh);
    });
}

// ---- Remesh -----------------------------------------------------------------------------------------------------------------

void delmesh_remesh_options_init(delmesh_remesh_options* options, uint32_t struct_size) {
    init_struct(options, struct_size);
}
void delmesh_remesh_report_init(delmesh_remesh_report* report, uint32_t struct_size) {
    init_struct(report, struct_size);
}

int32_t delmesh_remesh(delmesh_context* context, const delmesh_mesh* in, const delmesh_remesh_options* options,
                       delmesh_mesh** out, delmesh_remesh_report* report) {
    Report result(report);
    return guarded(context, out, [&](Context& c, Mesh& made) {
        delmesh_remesh_options checked;
        const Meter meter(c.memory(), result.value.seconds_total, result.value.peak_bytes);
        DM_TRY(require(c, "in", in));
        DM_TRY(result.check(c));
        DM_TRY(read_options(c, options, checked));
        DM_TRY(remesh(c, in->mesh, checked, made, result.value));
        return name_places(c, in->mesh, made);
    });
}

// ---- Estimate ---------------------------------------------------------------------------------------------------------------

void delmesh_preserve_estimate_init(delmesh_preserve_estimate* estimate, uint32_t struct_size) {
    init_struct(estimate, struct_size);
}

int32_t delmesh_estimate_preserve(delmesh_context* context, const delmesh_mesh* in, const delmesh_remesh_options* options,
                                  delmesh_preserve_estimate* out) {
    Report result(out);
    return guarded(context, [&](Context& c) {
        delmesh_remesh_options checked;
        const Meter meter(c.memory(), result.value.seconds, result.value.peak_bytes);
        DM_TRY(require(c, "in", in));
        DM_TRY(require(c, "out", out));
        DM_TRY(result.check(c));
        DM_TRY(read_options(c, options, checked));
        return estimate_preserve(c, in->mesh, checked, EstimateSample(), result.value);
    });
}

// ---- Decimate ---------------------------------------------------------------------------------------------------------------

void delmesh_decimate_options_init(delmesh_decimate_options* options, uint32_t struct_size) {
    init_struct(options, struct_size);
}
void delmesh_level_report_init(delmesh_level_report* report, uint32_t struct_size) {
    init_struct(report, struct_size);
}
void delmesh_decimate_report_init(delmesh_decimate_report* report, uint32_t struct_size) {
    init_struct(report, struct_size);
}

int32_t delmesh_lod_family(delmesh_context* context, const delmesh_mesh* in, const delmesh_target* targets, int32_t count,
                           const delmesh_decimate_options* options, delmesh_mesh** out, delmesh_level_report* levels,
                           delmesh_decimate_report* report) {
    return make_levels(context, in, {"targets", targets, count}, options, out, {"levels", levels, count}, report);
}

int32_t delmesh_decimate(delmesh_context* context, const delmesh_mesh* in, const delmesh_target* target,
                         const delmesh_decimate_options* options, delmesh_mesh** out, delmesh_level_report* level,
                         delmesh_decimate_report* report) {
    return make_levels(context, in, {"target", target, 1}, options, out, {"level", level, 1}, report);
}

// ---- Transfer ---------------------------------------------------------------------------------------------------------------

int32_t delmesh_transfer(delmesh_context* context, const delmesh_mesh* mesh, int32_t domain, int32_t policy,
                         const delmesh_view* source, const delmesh_view_mut* target) {
    return guarded(context, [&](Context& c) {
        DM_TRY(require(c, "mesh", mesh));
        DM_TRY(require(c, "source", source));
        DM_TRY(require(c, "target", target));
        return transfer_layer(c, mesh->mesh, domain, policy, *source, *target);
    });
}

int32_t delmesh_transfer_fitted(delmesh_context* context, const delmesh_mesh* in, const delmesh_mesh* mesh, int32_t domain,
                                int32_t policy, const delmesh_view* source, const delmesh_view_mut* target) {
    return guarded(context, [&](Context& c) {
        DM_TRY(require(c, "in", in));
        DM_TRY(require(c, "mesh", mesh));
        DM_TRY(require(c, "source", source));
        DM_TRY(require(c, "target", target));
        return fit_layer(c, in->mesh, mesh->mesh, domain, policy, *source, *target);
    });
}

int32_t delmesh_transfer_sparse(delmesh_context* context, const delmesh_mesh* mesh, const delmesh_rows* source, int32_t limit,
                                int32_t normalise, const delmesh_rows_mut* target) {
    return guarded(context, [&](Context& c) {
        DM_TRY(require(c, "mesh", mesh));
        DM_TRY(require(c, "source", source));
        DM_TRY(require(c, "target", target));
        return transfer_rows(c, mesh->mesh, *source, limit, normalise, *target);
    });
}

// ---- Subdivide --------------------------------------------------------------------------------------------------------------

void delmesh_cage_desc_init(delmesh_cage_desc* desc, uint32_t struct_size) {
    init_struct(desc, struct_size);
}
void delmesh_subdivide_options_init(delmesh_subdivide_options* options, uint32_t struct_size) {
    init_struct(options, struct_size);
}
void delmesh_subdivide_report_init(delmesh_subdivide_report* report, uint32_t struct_size) {
    init_struct(report, struct_size);
}

int32_t delmesh_cage_create(delmesh_context* context, const delmesh_cage_desc* desc, delmesh_cage** out) {
    return guarded(context, out, [&](Context& c, Cage& made) {
        delmesh_cage_desc checked;
        CageInput input;
        DM_TRY(read_options(c, desc, checked));
        DM_TRY(check_cage(c, checked, input));
        return made.build(c, input);
    });
}

int32_t delmesh_subdivide(delmesh_context* context, const delmesh_cage* cage, const delmesh_subdivide_options* options,
                          delmesh_mesh** out, delmesh_subdivide_report* report) {
    Report result(report);
    return guarded(context, out, [&](Context& c, Mesh& made) {
        delmesh_subdivide_options checked;
        const Meter meter(c.memory(), result.value.seconds_total, result.value.peak_bytes);
        DM_TRY(require(c, "cage", cage));
        DM_TRY(result.check(c));
        DM_TRY(read_options(c, options, checked));
        return subdivide(c, cage->cage, checked, made, result.value);
    });
}

int32_t delmesh_limit_values(delmesh_context* context, const delmesh_cage* cage, const delmesh_mesh* mesh, int32_t domain,
                             int32_t layer, const delmesh_view* source, const delmesh_view_mut* target) {
    return guarded(context, [&](Context& c) {
        DM_TRY(require(c, "cage", cage));
        DM_TRY(require(c, "mesh", mesh));
        DM_TRY(require(c, "target", target));
        return limit_values(c, cage->cage, mesh->mesh, domain, layer, source, *target);
    });
}

int32_t delmesh_limit_normals(delmesh_context* context, const delmesh_cage* cage, const delmesh_mesh* mesh,
                              const delmesh_view* positions, const delmesh_view_mut* target) {
    return guarded(context, [&](Context& c) {
        DM_TRY(require(c, "cage", cage));
        DM_TRY(require(c, "mesh", mesh));
        DM_TRY(require(c, "target", target));
        return limit_normals(c, cage->cage, mesh->mesh, positions, *target);
    });
}

void delmesh_reevaluate_report_init(delmesh_reevaluate_report* report, uint32_t struct_size) {
    init_struct(report, struct_size);
}

int32_t delmesh_reevaluate(delmesh_context* context, const delmesh_cage* cage, const delmesh_mesh* mesh,
                           const delmesh_view* positions, delmesh_mesh** out, delmesh_reevaluate_report* report) {
    Report result(report);
    const int32_t status = guarded(context, out, [&](Context& c, Mesh& made) {
        const Meter meter(c.memory(), result.value.seconds_total, result.value.peak_bytes);
        DM_TRY(require(c, "cage", cage));
        DM_TRY(require(c, "mesh", mesh));
        DM_TRY(require(c, "positions", positions));
        DM_TRY(result.check(c));
        return reevaluate(c, cage->cage, mesh->mesh, *positions, made, report != nullptr, result.value);
    });
    if (status == DELMESH_OK) (*out)->keep(*mesh);
    return status;
}

// ---- Certify ----------------------------------------------------------------------------------------------------------------

void delmesh_certify_options_init(delmesh_certify_options* options, uint32_t struct_size) {
    init_struct(options, struct_size);
}
void delmesh_certify_report_init(delmesh_certify_report* report, uint32_t struct_size) {
    init_struct(report, struct_size);
}

int32_t delmesh_certify(delmesh_context* context, const delmesh_mesh* mesh, const delmesh_certify_options* options,
                        delmesh_certify_report* report) {
    Report result(report);
    Findings findings;
    const Status status = guarded(context, [&](Context& c) {
        delmesh_certify_options checked;
        DM_TRY(require(c, "mesh", mesh));
        DM_TRY(result.check(c));
        DM_TRY(read_options(c, options, checked));
        return findings.certify(c, mesh->mesh, checked, result.value);
    });
    if (status == DELMESH_OK) findings.write();
    return status;
}

// ---- Measure ----------------------------------------------------------------------------------------------------------------

void delmesh_quality_report_init(delmesh_quality_report* report, uint32_t struct_size) {
    init_struct(report, struct_size);
}
void delmesh_distance_options_init(delmesh_distance_options* options, uint32_t struct_size) {
    init_struct(options, struct_size);
}
void delmesh_distance_report_init(delmesh_distance_report* report, uint32_t struct_size) {
    init_struct(report, struct_size);
}

int32_t delmesh_measure_quality(delmesh_context* context, const delmesh_mesh* mesh, delmesh_quality_report* report) {
    Report result(report);
    return guarded(context, [&](Context& c) {
        DM_TRY(require(c, "mesh", mesh));
        DM_TRY(require(c, "report", report));
        DM_TRY(result.check(c));
        return measure_quality(c, mesh->mesh, result.value);
    });
}

int32_t delmesh_measure_distance(delmesh_context* context, const delmesh_mesh* a, const delmesh_mesh* b,
                                 const delmesh_distance_options* options, delmesh_distance_report* report) {
    Report result(report);
    return guarded(context, [&](Context& c) {
        delmesh_distance_options checked;
        DM_TRY(require(c, "a", a));
        DM_TRY(require(c, "b", b));
        DM_TRY(require(c, "report", report));
        DM_TRY(result.check(c));
        DM_TRY(read_options(c, options, checked));
        return measure_distance(c, a->mesh, b->mesh, checked, result.value);
    });
}

// ---- Everything through one symbol ------------------------------------------------------------------------------------------

const delmesh_api* delmesh_get_api(uint32_t abi_version) {
    static constexpr delmesh_api kApi = {
        sizeof(delmesh_api),
        DELMESH_ABI_VERSION,
        delmesh_version,
        delmesh_status_name,
        delmesh_context_options_init,
        delmesh_context_create,
        delmesh_context_destroy,
        delmesh_cancel,
        delmesh_last_error,
        delmesh_context_memory,
        delmesh_mesh_desc_init,
        delmesh_mesh_create,
        delmesh_mesh_destroy,
        delmesh_mesh_info_init,
        delmesh_mesh_get_info,
        delmesh_mesh_read,
        delmesh_mesh_borrow,
        delmesh_mesh_validate,
        delmesh_remesh_options_init,
        delmesh_remesh_report_init,
        delmesh_remesh,
        delmesh_certify_options_init,
        delmesh_certify_report_init,
        delmesh_certify,
        delmesh_quality_report_init,
        delmesh_measure_quality,
        delmesh_distance_options_init,
        delmesh_distance_report_init,
        delmesh_measure_distance,
        delmesh_preserve_estimate_init,
        delmesh_estimate_preserve,
        delmesh_decimate_options_init,
        delmesh_level_report_init,
        delmesh_decimate_report_init,
        delmesh_lod_family,
        delmesh_decimate,
        delmesh_layer_init,
        delmesh_mesh_layer_borders,
        delmesh_transfer,
        delmesh_transfer_sparse,
        delmesh_transfer_fitted,
        delmesh_cage_desc_init,
        delmesh_cage_create,
        delmesh_cage_destroy,
        delmesh_subdivide_options_init,
        delmesh_subdivide_report_init,
        delmesh_subdivide,
        delmesh_limit_values,
        delmesh_limit_normals,
        delmesh_reevaluate_report_init,
        delmesh_reevaluate,
    };
    return abi_version == DELMESH_ABI_VERSION ? &kApi : nullptr;
}

uint32_t delmesh_struct_size(const char* name) {
    return struct_size(name);
}

uint32_t delmesh_field_offset(const char* name) {
    return field_offset(name);
}

} // extern "C"
