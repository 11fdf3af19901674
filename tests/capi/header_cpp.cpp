// SPDX-License-Identifier: Apache-2.0
// Compiles: both headers in one C++17 file, with nothing before them.
#include <delmesh/delmesh.hpp>

static_assert(std::is_nothrow_move_constructible_v<delmesh::Mesh> && !std::is_copy_constructible_v<delmesh::Mesh>);
static_assert(std::is_nothrow_move_constructible_v<delmesh::Context> && !std::is_copy_constructible_v<delmesh::Context>);
static_assert(sizeof(delmesh::RemeshOptions) == sizeof(delmesh_remesh_options));
