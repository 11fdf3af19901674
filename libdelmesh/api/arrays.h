// SPDX-License-Identifier: Apache-2.0
// What a mesh tells its caller: counts, and arrays that are written into his memory or lent.
#pragma once

#include "api/handle.h"

namespace dm {

// These only read the mesh, so any thread may call them at any time.
Status read_info(const delmesh_mesh& mesh, delmesh_mesh_info* info);
Status read_array(const delmesh_mesh& mesh, int32_t what, const delmesh_view_mut& dst);
Status borrow_array(const delmesh_mesh& mesh, int32_t what, delmesh_view& out); // throws AllocationFailure

// Offending edges and faces of a certificate into the caller's lists, as many as fit.
void write_edges(const Mesh& mesh, const Array<int32_t>& corners, const delmesh_view_mut& dst);
void write_indices(const Array<int32_t>& values, const delmesh_view_mut& dst);

} // namespace dm
