// SPDX-License-Identifier: Apache-2.0
#include "base/memory.h"

#include <cstdlib>

#if defined(__linux__)
#include <sys/mman.h>
#endif

namespace dm {
namespace {

constexpr uint64_t kAlign = 64; // a cache line; also what the widest vector loads want
// As large as this, the first touch of each small page costs more than most of what is done with it. Huge ones must be whole.
constexpr uint64_t kHugePage = 1 << 21;

void* default_alloc(void*, uint64_t size, uint64_t align) {
#if defined(_WIN32)
    return _aligned_malloc(size, align);
#else
    void* pointer = nullptr;
    const bool huge = size >= kHugePage && size < (uint64_t{1} << 62);
    if (huge) size = (size + kHugePage - 1) / kHugePage * kHugePage;
    if (posix_memalign(&pointer, huge ? kHugePage : align, size) != 0) return nullptr;
#if defined(__linux__)
    if (huge) static_cast<void>(madvise(pointer, size, MADV_HUGEPAGE));
#endif
    return pointer;
#endif
}

void default_free(void*, void* pointer, uint64_t) {
#if defined(_WIN32)
    _aligned_free(pointer);
#else
    std::free(pointer);
#endif
}

} // namespace

Memory* Memory::create(const delmesh_context_options& options) {
    const bool own = options.alloc == nullptr;
    const delmesh_alloc_fn alloc = own ? default_alloc : options.alloc;
    void* place = alloc(options.user, sizeof(Memory), kAlign);
    if (place == nullptr) return nullptr;
    Memory* memory = new (place) Memory;
    memory->alloc_ = alloc;
    memory->free_ = own ? default_free : options.free;
    memory->user_ = options.user;
    memory->memory_limit_ = options.memory_limit;
    memory->allocation_limit_ = options.allocation_limit;
    return memory;
}

void Memory::release() {
    if (references_.fetch_sub(1, std::memory_order_acq_rel) != 1) return;
    const delmesh_free_fn free_fn = free_;
    void* const user = user_;
    this->~Memory();
    free_fn(user, this, sizeof(Memory));
}

bool Memory::lends_to(const Memory& other) const {
    return this == &other || alloc_ == default_alloc;
}

void* Memory::allocate(size_t size) {
    if (size == 0) return nullptr;
    const uint64_t number = allocations_.fetch_add(1, std::memory_order_relaxed) + 1;
    if (allocation_limit_ != 0 && number > allocation_limit_) throw AllocationFailure(DELMESH_ERROR_ALLOCATION_LIMIT);
    const uint64_t now = current_.fetch_add(size, std::memory_order_relaxed) + size;
    if (memory_limit_ != 0 && now > memory_limit_) {
        current_.fetch_sub(size, std::memory_order_relaxed);
        throw AllocationFailure(DELMESH_ERROR_MEMORY_LIMIT);
    }
    void* pointer = alloc_(user_, size, kAlign);
    if (pointer == nullptr) {
        current_.fetch_sub(size, std::memory_order_relaxed);
        throw AllocationFailure(DELMESH_ERROR_OUT_OF_MEMORY);
    }
    raise_peak(now);
    return pointer;
}

void Memory::deallocate(void* pointer, size_t size) noexcept {
    if (pointer == nullptr) return;
    current_.fetch_sub(size, std::memory_order_relaxed);
    free_(user_, pointer, size);
}

void Memory::raise_peak(uint64_t at_least) {
    uint64_t seen = peak_.load(std::memory_order_relaxed);
    while (seen < at_least && !peak_.compare_exchange_weak(seen, at_least, std::memory_order_relaxed)) {}
}

} // namespace dm
