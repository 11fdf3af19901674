// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "subdiv/cage.h"

namespace dm {

// The cage's limit surface as a mesh that knows its places on the cage (docs/subdivide.md). `out` is empty.
Status subdivide(Context& context, const Cage& cage, const delmesh_subdivide_options& options, Mesh& out,
                 delmesh_subdivide_report& report);

} // namespace dm
