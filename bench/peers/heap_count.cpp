/* SPDX-License-Identifier: Apache-2.0 */
#include "heap_count.h"

#include <atomic>
#include <cerrno>
#include <cstddef>
#include <malloc.h>

/* glibc's own names for the functions that are replaced below. */
extern "C" {
void* __libc_malloc(size_t);
void* __libc_calloc(size_t, size_t);
void* __libc_realloc(void*, size_t);
void* __libc_memalign(size_t, size_t);
void __libc_free(void*);
}

namespace {

std::atomic<bool> counting{false};
std::atomic<int64_t> alive{0}, peak{0};

void* count(void* block) {
    if (counting.load(std::memory_order_relaxed) && block != nullptr) {
        const int64_t now = alive += int64_t(malloc_usable_size(block));
        int64_t before = peak;
        while (now > before && !peak.compare_exchange_weak(before, now)) {}
    }
    return block;
}

void discount(void* block) {
    if (counting.load(std::memory_order_relaxed) && block != nullptr) alive -= int64_t(malloc_usable_size(block));
}

} // namespace

void heap_count_begin() {
    alive = 0;
    peak = 0;
    counting = true;
}

int64_t heap_count_peak() {
    counting = false;
    return peak;
}

extern "C" {
void* malloc(size_t size) {
    return count(__libc_malloc(size));
}
void* calloc(size_t n, size_t size) {
    return count(__libc_calloc(n, size));
}
void* memalign(size_t alignment, size_t size) {
    return count(__libc_memalign(alignment, size));
}
void* aligned_alloc(size_t alignment, size_t size) {
    return count(__libc_memalign(alignment, size));
}

int posix_memalign(void** block, size_t alignment, size_t size) {
    void* const made = count(__libc_memalign(alignment, size));
    if (made == nullptr) return ENOMEM;
    *block = made;
    return 0;
}

void* realloc(void* block, size_t size) {
    discount(block);
    void* const made = __libc_realloc(block, size);
    return made != nullptr || size == 0 ? count(made) : (count(block), made);
}

void free(void* block) {
    discount(block);
    __libc_free(block);
}
}
