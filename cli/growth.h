/* SPDX-License-Identifier: Apache-2.0
 *
 * growth.h: for `delmesh info`, what preserve would make of a mesh, and which option keeps it small.
 */
#ifndef DELMESH_CLI_GROWTH_H
#define DELMESH_CLI_GROWTH_H

#include "session.h"

typedef struct Growth {
    /* options */
    Length tolerance;
    int64_t effort;
    delmesh_remesh_options options;
    /* results */
    delmesh_preserve_estimate estimate;
    int32_t status;    /* not DELMESH_OK: there is no estimate, and this is why */
    char reason[256];  /* ... in a sentence */
    const char* tamer; /* NULL, or an option with which the mesh ... */
    double tamed;      /* ... grows only this much */
} Growth;

/* The rows of an option table, with the names that `delmesh remesh` has for them. */
#define GROWTH_OPTIONS(growth)                                                                                                   \
    option_length("--tolerance", &(growth)->tolerance, "estimate: how far the surface may move (4 last places)"),                \
        option_integer("--effort", &(growth)->effort, 0, INT32_MAX, "N", "estimate: see remesh (1)"),                            \
        option_choice("--precision", &(growth)->options.precision, kPrecisionChoices, "f32|f64",                                 \
                      "estimate: of the result (f32)")

void growth_init(Growth* growth);
/* diagonal: of the mesh, for a tolerance in percent. What makes remeshing impossible is no failure here. */
bool growth_estimate(Session* session, const Loaded* loaded, int32_t boundary, double diagonal, Growth* growth);
void json_growth(Json* json, const Growth* growth);
void print_growth(const Growth* growth);

#endif
