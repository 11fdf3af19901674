// SPDX-License-Identifier: Apache-2.0
// What calls on cages are given, checked and converted.
#pragma once

#include "base/context.h"
#include "subdiv/cage.h"

namespace dm {

// The shape of a whole description of a cage, whose numbers were checked; the contents are Cage::build's business.
Status check_cage(Context& context, const delmesh_cage_desc& desc, CageInput& out);

// Positions of the cage's vertices in a pose.
Status read_pose(Context& context, const Cage& cage, const delmesh_view& positions, Array<double>& pose);

Status limit_values(Context& context, const Cage& cage, const Mesh& mesh, int32_t domain, int32_t layer,
                    const delmesh_view* source, const delmesh_view_mut& target);
Status limit_normals(Context& context, const Cage& cage, const Mesh& mesh, const delmesh_view* positions,
                     const delmesh_view_mut& target);

Status reevaluate(Context& context, const Cage& cage, const Mesh& mesh, const delmesh_view& positions, Mesh& out, bool certify,
                  delmesh_reevaluate_report& report);

} // namespace dm
