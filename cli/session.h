/* SPDX-License-Identifier: Apache-2.0
 *
 * session.h: what all subcommands share: common options, the library's context, loading a mesh, and how they end.
 */
#ifndef DELMESH_CLI_SESSION_H
#define DELMESH_CLI_SESSION_H

#include "cage.h"
#include "carry.h"
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
    Carry carry;      /* of commands that write meshes */
    CageOptions cage; /* of those that subdivide */
    /* state */
    Failure failure;
    Progress progress;
    delmesh_context* context;
    double begin, seconds_read, seconds_create;
} Session;

/* A mesh that was read: its file without positions and faces, the handle, and its counts. */
typedef struct Loaded {
    const char* path;
    MeshFile file;             /* its merged_points are counted with info.welded_vertices */
    int64_t* borders;          /* of each layer of the file: how many edges it has borders at; -1: nobody counted */
    double largest_coordinate; /* in size, of the finite vertices that faces use */
    Cage cage;                 /* that the mesh was subdivided from, if it was */
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
void loaded_free(Loaded* loaded);
/* A triangle mesh made from the loaded one, as it goes into the file `path`; free it also after a failure. */
bool session_export(Session* session, const delmesh_mesh* mesh, const Loaded* loaded, const char* path, MeshFile* out);
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
/* "layers": what the file has besides positions and faces; with `lost` also what of that the result's file has not. */
void json_layers(Json* json, const Loaded* loaded, const Names* lost);
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
/* One line for what the file has besides positions and faces. */
void print_layers(const Loaded* loaded);
/* A line on standard error for each thing that is lost. */
void say_lost(const Session* session, const char* path);
/* One line for each kind of repair that happened. */
void print_repairs(const Loaded* loaded);

#endif
