// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "subdiv/cage.h"

namespace dm {

// How far a mesh that was subdivided from the cage is from the limit surface: between points with the same place, at the middles of
// edges and of faces. Every point of either surface has its like on the other, so the largest of these distances over all points
// would bound the surfaces' distance both ways; this is the largest, and the root mean square, over the samples.
Status limit_distance(Context& context, const Cage& cage, const Mesh& mesh, double& largest, double& rms);

} // namespace dm
