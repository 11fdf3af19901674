// SPDX-License-Identifier: Apache-2.0
// What is smaller than the output precision: edges of zero length and faces without area, after rounding. A Delaunay mesh has
// neither, so they are taken out before anything else; a mesh without any is left alone.
#pragma once

#include "mesh/surface.h"

namespace dm {

// Collapses edges of zero length, flips caps (three points on a line) away, and removes caps on the boundary. Counts go to the
// report. STRICT when there is something to repair and strict is set; NO_SURFACE when nothing is left.
// What cannot be repaired here is left for the flips, and reported by the certificate.
// zero_area_faces: all there are, in ascending order.
Status repair_zero_area(Context& context, Surface& surface, Array<int32_t>&& zero_area_faces, bool strict,
                        delmesh_remesh_report& report);

} // namespace dm
