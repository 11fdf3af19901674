// SPDX-License-Identifier: Apache-2.0
// Carries a layer over so that it fits all over the surface and not only at the vertices (docs/attributes.md): what is
// interpolated on the mesh's faces comes as close as it can, in the mean of squares, to what the source has at the closest points.
#pragma once

#include "base/context.h"
#include "mesh/mesh.h"

namespace dm {

// domain: vertex or corner; policy: linear or direction. The views were checked by api/; `mesh` was made from `in` and has its map.
Status transfer_fitted(Context& context, const Mesh& in, const Mesh& mesh, int32_t domain, int32_t policy,
                       const delmesh_view& source, const delmesh_view_mut& target);

} // namespace dm
