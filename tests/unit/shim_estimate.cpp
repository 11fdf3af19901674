// SPDX-License-Identifier: Apache-2.0
#include "shim_estimate.h"

#include <cstring>

#include "shim_build.cpp" // each test links one shim

#include "algo/estimate.h"
#include "algo/remesh.h"

extern "C" {

int32_t shim_estimate(const shim_mesh* in, const delmesh_context_options* context_options, const delmesh_remesh_options* options,
                      const shim_sample* sample, delmesh_preserve_estimate* out, char* error) {
    delmesh_context_options used{};
    if (context_options != nullptr) used = *context_options;
    shim_mesh work(used, Memory::create(used));
    *out = {};
    const EstimateSample s{sample->whole_up_to, sample->cells, sample->edges_per_cell, sample->rings};
    guarded(work, [&] { return estimate_preserve(work.context, in->mesh, *options, s, *out); });
    std::strcpy(error, work.context.error_text());
    return work.status;
}

int32_t shim_preserve(const shim_mesh* in, const delmesh_remesh_options* options, delmesh_remesh_report* report) {
    const delmesh_context_options used{};
    shim_mesh work(used, Memory::create(used));
    *report = {};
    guarded(work, [&] { return remesh(work.context, in->mesh, *options, work.mesh, *report); });
    return work.status;
}

} // extern "C"
