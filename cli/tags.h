/* SPDX-License-Identifier: Apache-2.0
 *
 * tags.h: what makes a mesh a cage: edges and vertices that are sharp, faces that are holes. From the `t` lines of OBJ files, as
 * OpenSubdiv's own shapes have them, or from a file of its own (docs/subdivide.md).
 */
#ifndef DELMESH_CLI_TAGS_H
#define DELMESH_CLI_TAGS_H

#include "failure.h"
#include "text.h"

#include <stdbool.h>
#include <stdint.h>

typedef struct SharpList {
    int64_t* verts; /* `width` per element */
    double* sharpness;
    int64_t count, capacity;
} SharpList;

typedef struct Tags {
    SharpList creases; /* width 2 */
    SharpList corners; /* width 1 */
    SharpList holes;   /* width 1: faces; their sharpness says nothing */
} Tags;

/* width: 1 or 2; the second index then counts. False: no memory. */
bool tags_add(SharpList* list, int32_t width, int64_t first, int64_t second, double sharpness);
/* Behind the `t` of an OBJ line: "crease 2/1/0 4 5 2.5", "corner", "hole": numbers of integers, reals and strings, then these,
 * counted from 0. *taken: it was one of these, in order; else nothing was added. False: no memory. */
bool tags_scan_obj(const Text* text, Tags* tags, bool* taken);
/* Adds those of a file: "crease V V SHARPNESS", "corner V SHARPNESS", "hole FACE", a line each, counted from 0. */
bool tags_read(const char* path, Tags* tags, Failure* failure);
void tags_free(Tags* tags);

#endif
