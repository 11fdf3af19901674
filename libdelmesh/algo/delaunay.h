// SPDX-License-Identifier: Apache-2.0
// The loop that makes a Surface Delaunay: flip what may be flipped, largest excess first; split what may not.
#pragma once

#include "algo/flat_patches.h"
#include "algo/movement.h"
#include "mesh/surface.h"

namespace dm {

struct DelaunayRules {
    Precision precision = Precision::f32;
    bool boundary_rule = true;
    bool shells = false;
    double shell_unit = 0;
    double min_turn_cosine = -2; // a flip may turn a normal up to the angle with this cosine; -2: any
    double resolution = 0;       // unit in the last place of the largest coordinate, at the output precision
    MovementLimit
        free_movement;  // preserve: how far flips outside of patches may move the surface, where a split would do as well
    double need = 0;    // the same where the precision has no room for a split vertex, or splits crowd
    int32_t effort = 1; // preserve: 0 is the loop alone; 1 takes needless vertices out; each more is a round of search
    int64_t max_vertices = 0;
    int64_t split_budget = 0; // flip modes: after so many splits of unflippable edges, bent edges are not flipped any more
    bool texture = false;     // preserve: patches are flat for UV layers too, and outside of them flips would move these
    const uint8_t* nld_marks = nullptr; // what scan_faces finds on the surface, if that is known
};

// patches: null in the flip modes (every edge that is not kept may be flipped).
// Counts go to the report. Fails with VERTEX_LIMIT or PRECISION when no rule ends it, CANCELLED, or memory.
Status make_delaunay(Context& context, Surface& surface, FlatPatches* patches, const DelaunayRules& rules,
                     delmesh_remesh_report& report);

} // namespace dm
