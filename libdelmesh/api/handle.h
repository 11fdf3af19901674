// SPDX-License-Identifier: Apache-2.0
// What the two opaque handles of delmesh.h are. Both live in the context's Memory, which a mesh keeps alive, so that meshes may
// outlive their context.
#pragma once

#include <atomic>
#include <memory>
#include <mutex>

#include "base/context.h"
#include "mesh/mesh.h"

struct delmesh_context final : dm::Context {
    using dm::Context::Context;
};

struct delmesh_mesh {
    explicit delmesh_mesh(dm::Memory& from) : memory(from), mesh(from) { memory.retain(); }
    ~delmesh_mesh();

    static constexpr int32_t kArrays = DELMESH_EDGE_SOURCE_EDGE + 1; // the array numbers of delmesh.h are indices below

    dm::Memory& memory;
    dm::Mesh mesh;
    // Arrays that `mesh` does not store, made by the first borrow of each (api/arrays.cpp) and never changed after. Any thread
    // may be the first: the mutex lets one make it, the atomic pointer hands it to the others.
    struct Derived {
        std::atomic<void*> data{nullptr};
        size_t bytes = 0;
    };
    mutable Derived derived[kArrays];
    mutable std::mutex derive;
};

namespace dm {

struct DestroyMesh {
    void operator()(delmesh_mesh* mesh) const { delmesh_mesh_destroy(mesh); }
};
using MeshHandle = std::unique_ptr<delmesh_mesh, DestroyMesh>;

Status create_context(const delmesh_context_options& options, delmesh_context*& out); // options have been checked
void destroy_context(delmesh_context* context);
MeshHandle new_mesh(Memory& memory); // empty; throws AllocationFailure

} // namespace dm
