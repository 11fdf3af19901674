/* SPDX-License-Identifier: Apache-2.0
 *
 * carry.h: what a file says besides its shape, through the library and into the files of the result. Layers with borders go into
 * the mesh, which keeps the edges where they jump; all are gathered through the result's map (docs/attributes.md).
 */
#ifndef DELMESH_CLI_CARRY_H
#define DELMESH_CLI_CARRY_H

#include "json.h"
#include "mesh_file.h"
#include "options.h"

struct Cage;

typedef struct Carry {
    const char *keep, *release; /* as given: kinds with commas between */
    bool bare;
    bool kept[kLayerKinds];          /* whether the borders of that kind stay */
    double uv_weight, normal_weight; /* in decimation */
    bool fit;                        /* layers that are interpolated fit all over the surface */
    Names lost;                      /* in words */
} Carry;

/* Of commands that write meshes. */
#define CARRY_OPTIONS(carry)                                                                                                     \
    option_string("--keep", &(carry)->keep, "KIND,...", "edges stay where these jump (uv,material)"),                            \
        option_string("--release", &(carry)->release, "KIND,...",                                                                \
                      "... or may go; also normal, color, group, object, smoothing"),                                            \
        option_flag("--bare", &(carry)->bare, "positions and faces only: no uv, material, ...")

void carry_init(Carry* carry);
bool carry_parse(Carry* carry, Failure* failure);
void carry_free(Carry* carry);

/* What mesh_create has to know of a file's layers, in the order of file->layers; free `views` and `spread` after it. */
typedef struct CarryLayers {
    delmesh_layer* views;
    int32_t count;
    int32_t* from; /* of each the number in file->layers */
    Layers spread; /* layers of vertices, as those of corners that the library takes */
} CarryLayers;
bool carry_describe(const Carry* carry, const MeshFile* file, CarryLayers* out, Failure* failure);
/* The same for cage_create: all UVs and other real layers of corners, whose borders may be free; none of vertices. */
bool carry_describe_cage(const Carry* carry, const MeshFile* file, CarryLayers* out, Failure* failure);
void carry_layers_free(CarryLayers* layers);
/* Vertices that are going to be joined may differ in their layers: those are of corners from now on. */
bool carry_spread(MeshFile* file, Failure* failure);

/* Whether a result must have a map of its corners, for what files of this name hold. */
bool carry_needs_map(const Carry* carry, const MeshFile* source, const char* out_path);
/* Fills out->layers and out->libraries, of a mesh made from `in`, that of `source`, or of its cage if that is not NULL, read from
 * `in_path`, as the file `out_path` holds them. Returns a status of the library, of which the sentence is in its context; or
 * DELMESH_OK with *failure. */
int32_t carry_over(Carry* carry, delmesh_context* context, const delmesh_mesh* in, const delmesh_mesh* mesh,
                   const delmesh_mesh_info* info, const MeshFile* source, const struct Cage* cage, const char* in_path,
                   const char* out_path, MeshFile* out, Failure* failure);
/* The name of a file, as it stands in one folder, from that of `out_path`; to be freed. NULL: no memory. */
char* carry_library(const char* name, const char* in_path, const char* out_path);

#endif
