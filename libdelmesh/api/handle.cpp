// SPDX-License-Identifier: Apache-2.0
#include "api/handle.h"

#include <type_traits>

delmesh_mesh::~delmesh_mesh() {
    for (Derived& array : derived) memory.deallocate(array.data.load(std::memory_order_relaxed), array.bytes);
}

void delmesh_mesh::keep(const delmesh_mesh& of) {
    if (!of.memory.lends_to(memory)) return; // nothing was shared
    lender = of.lender != nullptr ? of.lender : &of;
    lender->users.fetch_add(1, std::memory_order_relaxed);
}

namespace dm {

Status create_context(const delmesh_context_options& options, delmesh_context*& out) {
    Memory* memory = Memory::create(options);
    if (memory == nullptr) return DELMESH_ERROR_OUT_OF_MEMORY;
    try {
        out = new (memory->allocate(sizeof(delmesh_context))) delmesh_context(options, memory);
        return DELMESH_OK;
    } catch (const AllocationFailure& failure) {
        memory->release();
        return failure.status;
    }
}

void destroy_context(delmesh_context* context) {
    if (context == nullptr) return;
    Memory& memory = context->memory();
    memory.retain(); // the context's own reference goes with it
    context->~delmesh_context();
    memory.deallocate(context, sizeof(delmesh_context));
    memory.release();
}

MeshHandle new_mesh(Memory& memory) {
    return MeshHandle(new (memory.allocate(sizeof(delmesh_mesh))) delmesh_mesh(memory));
}
CageHandle new_cage(Memory& memory) {
    return CageHandle(new (memory.allocate(sizeof(delmesh_cage))) delmesh_cage(memory));
}

namespace {
template <class Handle>
void destroy_handle(Handle* handle) {
    Memory& memory = handle->memory;
    handle->~Handle();
    memory.deallocate(const_cast<std::remove_const_t<Handle>*>(handle), sizeof(Handle));
    memory.release();
}
void release_mesh(const delmesh_mesh* mesh) {
    if (mesh == nullptr || mesh->users.fetch_sub(1, std::memory_order_acq_rel) != 1) return;
    const delmesh_mesh* const lender = mesh->lender;
    destroy_handle(mesh);
    release_mesh(lender);
}
} // namespace

} // namespace dm

extern "C" {
void delmesh_mesh_destroy(delmesh_mesh* mesh) {
    dm::release_mesh(mesh);
}
void delmesh_cage_destroy(delmesh_cage* cage) {
    if (cage != nullptr) dm::destroy_handle(cage);
}
}
