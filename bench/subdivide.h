/* SPDX-License-Identifier: Apache-2.0
 *
 * subdivide.h: makes a big mesh of a real one, so that no big file need be kept: every triangle becomes four at the middles of
 * its edges, and every new vertex moves by up to a twentieth of its edge in each coordinate. The noise is a hash of the vertex
 * number: it keeps the result from being full of similar triangles and of ties, and is the same in every run.
 */
#ifndef DELMESH_BENCH_SUBDIVIDE_H
#define DELMESH_BENCH_SUBDIVIDE_H

#include "mesh_file.h"

#ifdef __cplusplus
extern "C" {
#endif

/* One step; polygons are cut into fans first. False: no memory, or too many vertices for int32; the mesh is as it was, or fans. */
bool subdivide(MeshFile* mesh);
/* Reads a file and takes so many steps. False: said why on standard error, and there is nothing to free. */
bool read_subdivided(const char* path, int steps, MeshFile* mesh);

#ifdef __cplusplus
}
#endif

#endif
