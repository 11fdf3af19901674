// SPDX-License-Identifier: Apache-2.0
#include "api/handle.h"

delmesh_mesh::~delmesh_mesh() {
    for (Derived& array : derived) memory.deallocate(array.data.load(std::memory_order_relaxed), array.bytes);
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
    if (handle == nullptr) return;
    Memory& memory = handle->memory;
    handle->~Handle();
    memory.deallocate(handle, sizeof(Handle));
    memory.release();
}
} // namespace

} // namespace dm

extern "C" {
void delmesh_mesh_destroy(delmesh_mesh* mesh) {
    dm::destroy_handle(mesh);
}
void delmesh_cage_destroy(delmesh_cage* cage) {
    dm::destroy_handle(cage);
}
}
