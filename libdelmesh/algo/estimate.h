// SPDX-License-Identifier: Apache-2.0
// How much a mesh will grow in preserve mode, before it does. Small meshes are simply remeshed; of large ones a sample of places
// is: see docs/growth.md for why this sample.
#pragma once

#include "base/context.h"
#include "mesh/mesh.h"

namespace dm {

struct EstimateSample {
    int32_t whole_up_to = 50000; // faces: smaller meshes are remeshed whole
    int32_t cells = 40;          // places looked at, besides those that are certain to matter
    int32_t edges_per_cell = 32; // NLD edges of a place, at most
    int32_t rings = 3;           // of faces around them that are remeshed with them
};

// options: of the remesh to come, checked; its mode does not matter. `out` arrives zeroed but for struct_size.
Status estimate_preserve(Context& context, const Mesh& in, const delmesh_remesh_options& options, const EstimateSample& sample,
                         delmesh_preserve_estimate& out);

} // namespace dm
