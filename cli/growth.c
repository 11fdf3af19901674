/* SPDX-License-Identifier: Apache-2.0 */
#include "growth.h"

#include <stdio.h>
#include <string.h>

enum {
    kMuch = 4,         /* growth that is worth a word */
    kMostWork = 500000 /* for the word about what helps: faces to remesh, times their growth. A few seconds */
};

void growth_init(Growth* growth) {
    memset(growth, 0, sizeof *growth);
    delmesh_remesh_options_init(&growth->options, sizeof growth->options);
    delmesh_preserve_estimate_init(&growth->estimate, sizeof growth->estimate);
    growth->effort = growth->options.effort;
}

static int32_t estimate(Session* session, const Loaded* loaded, const delmesh_remesh_options* options,
                        delmesh_preserve_estimate* out) {
    delmesh_preserve_estimate_init(out, sizeof *out);
    return delmesh_estimate_preserve(session->context, loaded->mesh, options, out);
}

/* Tries what may help, the mildest first, and keeps the first that brings the growth down to a half and below what is much. */
static int32_t find_tamer(Session* session, const Loaded* loaded, double diagonal, Growth* growth) {
    const struct {
        const char* name;
        double percent; /* tolerance; < 0: the default */
        bool ignore_boundary;
    } tamers[] = {{"--boundary ignore", 0, true},       {"the default --tolerance", -1, false},
                  {"--tolerance 0.0001%", 1e-4, false}, {"--tolerance 0.001%", 1e-3, false},
                  {"--tolerance 0.01%", 1e-2, false},   {"--tolerance 0.1%", 0.1, false}};
    const double given = growth->options.tolerance;
    /* A hint is not worth waiting for: on a mesh so bad that the tries would take long, there is none. */
    double work = (double)growth->estimate.faces_run * growth->estimate.growth;
    for (int i = 0; i < (int)(sizeof tamers / sizeof tamers[0]) && work < kMostWork; ++i) {
        delmesh_remesh_options options = growth->options;
        if (tamers[i].ignore_boundary) {
            if (loaded->info.boundary_edges == 0 || options.boundary == DELMESH_BOUNDARY_IGNORE) continue;
            options.boundary = DELMESH_BOUNDARY_IGNORE;
        } else {
            options.tolerance = tamers[i].percent < 0 ? -1 : tamers[i].percent / 100 * diagonal;
            if (options.tolerance < 0 ? given < 0 : options.tolerance <= given) continue;
        }
        delmesh_preserve_estimate tamed;
        int32_t status = estimate(session, loaded, &options, &tamed);
        if (status != DELMESH_OK) return status;
        work += (double)tamed.faces_run * tamed.growth;
        if (tamed.outcome != DELMESH_OK || tamed.growth > kMuch || tamed.growth > growth->estimate.growth / 2) continue;
        growth->tamer = tamers[i].name;
        growth->tamed = tamed.growth;
        break;
    }
    return DELMESH_OK;
}

bool growth_estimate(Session* session, const Loaded* loaded, int32_t boundary, double diagonal, Growth* growth) {
    if (!session_resolve(session, loaded, &growth->tolerance, &diagonal, &growth->options.tolerance)) return false;
    growth->options.boundary = boundary;
    growth->options.effort = (int32_t)growth->effort;
    growth->status = estimate(session, loaded, &growth->options, &growth->estimate);
    if (growth->status == DELMESH_OK && growth->estimate.growth > kMuch)
        growth->status = find_tamer(session, loaded, diagonal, growth);
    switch (growth->status) {
    case DELMESH_ERROR_NO_SURFACE:
    case DELMESH_ERROR_PRECISION:
    case DELMESH_ERROR_TOO_LARGE:
        snprintf(growth->reason, sizeof growth->reason, "%s", delmesh_last_error(session->context));
        return true;
    default:
        return session_check(session, growth->status, loaded->path);
    }
}

void json_growth(Json* json, const Growth* growth) {
    const delmesh_preserve_estimate* e = &growth->estimate;
    json_begin_object(json, "preserve_estimate");
    json_string(json, "status", delmesh_status_name(growth->status != DELMESH_OK ? growth->status : e->outcome));
    if (growth->status != DELMESH_OK) {
        json_string(json, "error", growth->reason);
    } else {
        json_integer(json, "vertices_out", e->vertices_out);
        json_double(json, "growth", e->growth);
        json_double(json, "deviation", e->deviation);
        json_bool(json, "exact", e->exact);
        json_integer(json, "nld_edges", e->nld_edges);
        json_integer(json, "sampled_edges", e->sampled_edges);
        json_integer(json, "faces_run", e->faces_run);
        json_double(json, "seconds", e->seconds);
        if (growth->tamer) {
            json_string(json, "tamed_by", growth->tamer);
            json_double(json, "tamed_growth", growth->tamed);
        }
    }
    json_end_object(json);
}

void print_growth(const Growth* growth) {
    const delmesh_preserve_estimate* e = &growth->estimate;
    if (growth->status != DELMESH_OK) {
        printf("  preserve would not end well: %s\n", growth->reason);
        return;
    }
    print_count(e->exact ? "vertices after preserve" : "vertices after preserve, ~", e->vertices_out);
    if (e->outcome != DELMESH_OK) printf("  ... and it would end with %s\n", delmesh_status_name(e->outcome));
    if (e->growth <= kMuch) return;
    printf("  preserve would make this mesh %.1f times as large", e->growth);
    if (growth->tamer)
        printf("; with %s, %.1f times\n", growth->tamer, growth->tamed);
    else
        printf("; --mode flip or feature adds few vertices\n");
}
