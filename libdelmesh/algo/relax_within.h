// SPDX-License-Identifier: Apache-2.0
// Relaxation where a proven distance has to hold.
#pragma once

#include "algo/relax.h"

namespace dm {

// relax, but the two-sided distance of `level` to `in`, which is proven to be no more than `limit`, stays so. Where moving all of
// the vertices would exceed it, they are moved one after the other, and those that may not stay.
Status relax_within(Context& context, const Mesh& in, const RelaxRules& rules, double limit, const uint8_t* stays, Mesh& level,
                    int64_t& moved);

} // namespace dm
