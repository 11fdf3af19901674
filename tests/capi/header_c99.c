/* SPDX-License-Identifier: Apache-2.0
 * Compiles: the header is C99, with nothing before it. */
#include <delmesh/delmesh.h>

#include <stddef.h>

/* Layouts that are part of the ABI, spelled out where a compiler checks them. */
#define CHECK(name, condition) typedef char check_##name[(condition) ? 1 : -1]
CHECK(view, sizeof(delmesh_view) == 32 && offsetof(delmesh_view, type) == 24);
CHECK(view_mut, sizeof(delmesh_view_mut) == sizeof(delmesh_view));
#define SIZED(type) CHECK(type, offsetof(type, struct_size) == 0 && sizeof(type) % 8 == 0)
SIZED(delmesh_context_options);
SIZED(delmesh_mesh_desc);
SIZED(delmesh_mesh_info);
SIZED(delmesh_remesh_options);
SIZED(delmesh_remesh_report);
SIZED(delmesh_certify_options);
SIZED(delmesh_certify_report);
SIZED(delmesh_quality_report);
SIZED(delmesh_distance_options);
SIZED(delmesh_distance_report);
SIZED(delmesh_api);

int delmesh_header_c99(void);
int delmesh_header_c99(void) { return DELMESH_CONTINUE; }
