// SPDX-License-Identifier: Apache-2.0
// For passes over all faces whose threads each need an array over all vertices of their own.
#pragma once

#include <algorithm>

#include "base/context.h"

namespace dm {

// How many slices the faces are cut into: as many as there is use for, and few enough that their arrays stay small. How many
// there are must change nothing about the result.
inline int64_t few_slices(const Context& context, int64_t faces, int64_t vertices) {
    constexpr int64_t kFewFaces = 1 << 13, kMost = 4;
    if (vertices > faces) return 1;
    return std::clamp<int64_t>(std::min<int64_t>(context.max_threads(), faces / kFewFaces), 1, kMost);
}

} // namespace dm
