// SPDX-License-Identifier: Apache-2.0
// The one place where memory comes from: the host's allocator (or the C library's) behind limits and counters.
// A Memory is shared by a context and all its meshes, and lives until the last of them is gone, so that a mesh may outlive its
// context. Worker threads never allocate; the counters are atomic because meshes may be destroyed on any thread.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <new>

#include "delmesh/delmesh.h"

namespace dm {

using Status = int32_t; // DELMESH_OK or one of DELMESH_ERROR_*

// Thrown where an array cannot grow; caught once, in api/guard.h.
struct AllocationFailure : std::bad_alloc {
    explicit AllocationFailure(Status s) : status(s) {}
    const char* what() const noexcept override { return "delmesh allocation failure"; }
    Status status;
};

class Memory {
public:
    // Takes the allocator and the limits out of the options. Returns nullptr when not even this object can be allocated.
    static Memory* create(const delmesh_context_options& options);
    void retain() { references_.fetch_add(1, std::memory_order_relaxed); }
    void release(); // destroys itself with the last reference
    // Whether what is allocated here may be used by what lives in `other`: a host may take an allocator of its own down with the
    // meshes that he made with it.
    bool lends_to(const Memory& other) const;

    // 64-byte aligned; throws AllocationFailure. size 0 gives nullptr.
    void* allocate(size_t size);
    void deallocate(void* pointer, size_t size) noexcept;

    uint64_t current() const { return current_.load(std::memory_order_relaxed); }
    uint64_t peak() const { return peak_.load(std::memory_order_relaxed); }
    uint64_t allocations() const { return allocations_.load(std::memory_order_relaxed); }
    void reset_peak() { peak_.store(current(), std::memory_order_relaxed); }
    void raise_peak(uint64_t at_least); // puts back a larger peak after reset_peak

private:
    Memory() = default;
    ~Memory() = default;

    delmesh_alloc_fn alloc_ = nullptr;
    delmesh_free_fn free_ = nullptr;
    void* user_ = nullptr;
    uint64_t memory_limit_ = 0, allocation_limit_ = 0;
    std::atomic<uint64_t> current_{0}, peak_{0}, allocations_{0};
    std::atomic<int64_t> references_{1};
};

} // namespace dm
