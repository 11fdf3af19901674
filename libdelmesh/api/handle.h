// SPDX-License-Identifier: Apache-2.0
// What the opaque handles of delmesh.h are. All live in the context's Memory, which meshes and cages keep alive, so that they may
// outlive their context.
#pragma once

#include <atomic>
#include <memory>
#include <mutex>

#include "base/context.h"
#include "mesh/mesh.h"
#include "subdiv/cage.h"

struct delmesh_context final : dm::Context {
    using dm::Context::Context;
};

struct delmesh_mesh {
    explicit delmesh_mesh(dm::Memory& from) : memory(from), mesh(from) { memory.retain(); }
    ~delmesh_mesh();

    static constexpr int32_t kArrays = DELMESH_FACE_CAGE_FACE + 1; // the array numbers of delmesh.h are indices below

    // Another mesh whose arrays this one's `mesh` has, too (Mesh::share): it stays until no one has them any more.
    void keep(const delmesh_mesh& lender);

    dm::Memory& memory;
    dm::Mesh mesh;
    const delmesh_mesh* lender = nullptr;
    mutable std::atomic<int64_t> users{1}; // the caller, until he destroys it, and those who share its arrays
    // Arrays that `mesh` does not store, made by the first borrow of each (api/arrays.cpp) and never changed after. Any thread
    // may be the first: the mutex lets one make it, the atomic pointer hands it to the others.
    struct Derived {
        std::atomic<void*> data{nullptr};
        size_t bytes = 0;
    };
    mutable Derived derived[kArrays];
    mutable std::mutex derive;
};

struct delmesh_cage {
    explicit delmesh_cage(dm::Memory& from) : memory(from), cage(from) { memory.retain(); }

    dm::Memory& memory;
    dm::Cage cage;
};

namespace dm {

struct DestroyMesh {
    void operator()(delmesh_mesh* mesh) const { delmesh_mesh_destroy(mesh); }
};
using MeshHandle = std::unique_ptr<delmesh_mesh, DestroyMesh>;
struct DestroyCage {
    void operator()(delmesh_cage* cage) const { delmesh_cage_destroy(cage); }
};
using CageHandle = std::unique_ptr<delmesh_cage, DestroyCage>;

Status create_context(const delmesh_context_options& options, delmesh_context*& out); // options have been checked
void destroy_context(delmesh_context* context);
MeshHandle new_mesh(Memory& memory); // empty; throws AllocationFailure
CageHandle new_cage(Memory& memory); // the same

} // namespace dm
