// SPDX-License-Identifier: Apache-2.0
// The caller's layers, carried over to a result through its maps (docs/attributes.md). All arguments are checked here.
#pragma once

#include "base/context.h"
#include "mesh/mesh.h"

namespace dm {

Status transfer_layer(Context& context, const Mesh& mesh, int32_t domain, int32_t policy, const delmesh_view& source,
                      const delmesh_view_mut& target);
// in: what `mesh` was made of.
Status fit_layer(Context& context, const Mesh& in, const Mesh& mesh, int32_t domain, int32_t policy, const delmesh_view& source,
                 const delmesh_view_mut& target);
Status transfer_rows(Context& context, const Mesh& mesh, const delmesh_rows& source, int32_t limit, int32_t normalise,
                     const delmesh_rows_mut& target);

} // namespace dm
