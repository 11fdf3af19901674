/* SPDX-License-Identifier: Apache-2.0
 *
 * session.h: what all subcommands share: common options, the library's context, loading a mesh, and how they end.
 */
#ifndef DELMESH_CLI_SESSION_H
#define DELMESH_CLI_SESSION_H

#include "failure.h"
#include "json.h"
#include "mesh_file.h"
#include "options.h"
#include "progress.h"

#include <delmesh/delmesh.h>

enum { kWeldByFormat = -1 };

typedef struct Session {
    /* options */
    bool json, quiet, strict;
    int32_t weld; /* kWeldByFormat: exact for STL, else none */
    int64_t threads;
    /* state */
    Failure failure;
    Progress progress;
    delmesh_context* context;
    double begin, seconds_read, seconds_create;
} Session;

/* A mesh that was read: its file's properties without the arrays, the handle, and its counts. */
typedef struct Loaded {
    const char* path;
    MeshFormat format;
    int64_t merged_points;     /* of an STL file; counted with info.welded_vertices */
    double largest_coordinate; /* in size, of the finite vertices that faces use */
    delmesh_mesh* mesh;
    delmesh_mesh_info info;
} Loaded;

/* The rows of an option table that every subcommand has. */
#define SESSION_OPTIONS(session)                                                                                                 \
    option_choice("--weld", &(session)->weld, kWeldChoices, "none|exact", "join vertices at equal positions (STL: exact)"),      \
        option_flag("--strict", &(session)->strict, "refuse input that needs a repair"),                                         \
        option_integer("--threads", &(session)->threads, 0, 1024, "N", "0: one per core (default); the result is the same"),     \
        option_flag("--json", &(session)->json, "one JSON object on standard output"),                                           \
        option_flag("--quiet", &(session)->quiet, "no output but --json and errors"), option_end()
extern const Choice kWeldChoices[];
extern const Choice kBoundaryChoices[];
extern const Choice kModeChoices[];
extern const Choice kPrecisionChoices[];
extern const Choice kEncodingChoices[];

void session_init(Session* session);
/* Makes the context, once the options are known. */
bool session_open(Session* session);
bool session_load(Session* session, const char* path, Loaded* out);
/* The arrays of a triangle mesh as they go into a file; free them also after a failure. `path` is what the mesh is of. */
bool session_export(Session* session, const delmesh_mesh* mesh, const char* path, MeshFile* out);
/* A length in model units. *diagonal: of the loaded mesh; 0: not known yet, measured if percents need it. */
bool session_resolve(Session* session, const Loaded* loaded, const Length* length, double* diagonal, double* out);
/* Turns a status of the library into success or the session's failure; `path` is what the call was about. */
bool session_check(Session* session, int32_t status, const char* path);
/* Saves the report of a command at `path` (NULL: nowhere). ok: has all gone well so far? Returns whether it still has; if not for
 * the saving, `json` is emptied, so that the failure takes its place. */
bool session_report(Session* session, Json* json, const char* path, bool ok);
/* Frees the context, prints `json` (with --json), and the failure on standard error; returns the exit status: `success`, 2 after
 * a failure, 128 + signal after an interrupt. */
int session_end(Session* session, Json* json, bool ok, int success);

double seconds_now(void);

/* ---- What reports are made of */

/* {welded_vertices, degenerate_faces, ...}, open: more counts may follow before json_end_object. */
void json_begin_repairs(Json* json, const Loaded* loaded);
/* vertices, faces, edges, ..., euler_characteristic */
void json_counts(Json* json, const delmesh_mesh_info* info);
/* min_angle, max_angle, ... of the measured mesh, into the open object. */
void json_quality(Json* json, const delmesh_quality_report* quality);
void json_deviation(Json* json, const delmesh_distance_report* distance);

/* "  label            1,234,567" on standard output, digits in groups of three. */
void print_count(const char* label, int64_t count);
void print_quality_head(void);
void print_quality(const char* label, const delmesh_quality_report* quality);
void print_deviation(const delmesh_distance_report* distance);
/* One line for each kind of repair that happened. */
void print_repairs(const Loaded* loaded);

#endif
