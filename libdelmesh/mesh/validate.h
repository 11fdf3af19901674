// SPDX-License-Identifier: Apache-2.0
// Checks every invariant of a Mesh without trusting any of it: usable on broken data, with bounded loops.
#pragma once

#include "base/context.h"
#include "mesh/mesh.h"

namespace dm {

// DELMESH_OK, or DELMESH_ERROR_INTERNAL with the first broken relation in the error sentence.
Status validate_mesh(Context& context, const Mesh& mesh);

} // namespace dm
