// SPDX-License-Identifier: Apache-2.0
// The cage's limit surface at the places of a mesh that comes from it. The mesh has places, on a cage with the same faces; views
// were checked by api/, and have strides. `target` has float32 or float64 elements.
#pragma once

#include "subdiv/cage.h"

namespace dm {

// Per vertex of the mesh: values per vertex of the cage, packed.
Status limit_of_verts(Context& context, const Cage& cage, const Mesh& mesh, const Array<double>& source,
                      const delmesh_view_mut& target);
// Per corner of the mesh: the cage's layer at corners of that number, or other values for it, packed, one per value of the layer.
Status limit_of_layer(Context& context, const Cage& cage, const Mesh& mesh, int32_t layer, const Array<double>* source,
                      const delmesh_view_mut& target);
// Per place of the mesh (cage_places): the cage's layer at corners of that number.
Status limit_at_places(Context& context, const Cage& cage, const Mesh& mesh, int32_t layer, const delmesh_view_mut& target);
// Per corner of the mesh: unit normals in a pose of the cage, 3 V numbers.
Status limit_normals(Context& context, const Cage& cage, const Mesh& mesh, const double* positions,
                     const delmesh_view_mut& target);

} // namespace dm
