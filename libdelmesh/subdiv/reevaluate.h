// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "subdiv/cage.h"

namespace dm {

// `mesh`, which comes from `cage`, in another pose of the cage: 3 V numbers. `out` is empty. Fills the report but for what
// certifying tells. docs/subdivide.md has the method.
Status reevaluate(Context& context, const Cage& cage, const Mesh& mesh, const Array<double>& pose, Mesh& out,
                  delmesh_reevaluate_report& report);

} // namespace dm
