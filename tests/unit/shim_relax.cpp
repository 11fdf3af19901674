// SPDX-License-Identifier: Apache-2.0
#include "shim_relax.h"

#include "shim_remesh.cpp" // each test links one shim

#include "algo/measure.h"
#include "algo/relax.h"

extern "C" {

shim_relax_rules shim_relax_defaults(void) {
    const RelaxRules rules;
    return {static_cast<int32_t>(rules.precision), rules.boundary_rule ? 1 : 0, rules.fold_cosine, rules.sweeps};
}

int64_t shim_relax(shim_mesh* level, const shim_mesh* in, const shim_relax_rules* from, const uint8_t* stays) {
    RelaxRules rules;
    rules.precision = static_cast<Precision>(from->precision);
    rules.boundary_rule = from->boundary_rule != 0;
    rules.fold_cosine = from->fold_cosine;
    rules.sweeps = from->sweeps;
    int64_t moved = -1;
    if (!level->context.begin_call()) return -1;
    guarded(*level, [&] { return relax(level->context, in->mesh, rules, stays, level->mesh, moved); });
    level->status = level->context.end_call(level->status);
    return moved;
}

delmesh_distance_report shim_distance(shim_mesh* level, const shim_mesh* in) {
    delmesh_distance_options options{};
    options.struct_size = sizeof options;
    delmesh_distance_report report{};
    report.struct_size = sizeof report;
    guarded(*level, [&] { return measure_distance(level->context, in->mesh, level->mesh, options, report); });
    return report;
}

uint64_t shim_bytes_alive(const shim_mesh* m) {
    return m->context.memory().current();
}

} // extern "C"
