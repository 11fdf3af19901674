// SPDX-License-Identifier: Apache-2.0
// Sized structs on their way in and out, and what their fields may be. The checked struct is the very type the algorithms take.
#pragma once

#include <cstring>
#include <type_traits>

#include "base/context.h"

namespace dm {

// The defaults of every options struct and the empty state of every report, struct_size included.
template <class T>
T defaults();

constexpr uint32_t kLargestStruct = 4096; // a larger struct_size is an uninitialised one

// A struct_size that some version of T may have had: whole 8-byte words, so that no field was cut in half.
inline bool is_struct_size(uint32_t size) {
    return size >= 8 && size % 8 == 0 && size <= kLargestStruct;
}

// Copies the common part of `given` over `out`, which holds the defaults. UNSUPPORTED when `given` is longer and not zero there.
Status copy_known_part(const void* given, void* out, uint32_t known_size);

// Fills a caller's struct of `size` bytes with defaults, and with zeros past what is known here.
template <class T>
void init_struct(T* out, uint32_t size) {
    static_assert(std::is_trivially_copyable_v<T> && sizeof(T) % 8 == 0);
    if (out == nullptr) return;
    T full = defaults<T>();
    full.struct_size = size;
    std::memset(static_cast<void*>(out), 0, size);
    std::memcpy(static_cast<void*>(out), &full, size < sizeof(T) ? size : sizeof(T));
}

// A report of the caller's, of whatever size he has. `value` is written to him when the scope is left, after errors too.
template <class T>
class Report {
public:
    explicit Report(T* out) : out_(out) {}
    ~Report() {
        if (out_ == nullptr || !is_struct_size(out_->struct_size)) return;
        const uint32_t size = value.struct_size = out_->struct_size;
        std::memcpy(static_cast<void*>(out_), &value, size < sizeof(T) ? size : sizeof(T));
    }
    Report(const Report&) = delete;
    Report& operator=(const Report&) = delete;

    Status check(Context& context) const {
        if (out_ == nullptr || is_struct_size(out_->struct_size)) return DELMESH_OK;
        return context.fail(DELMESH_ERROR_INVALID_ARGUMENT, "The report's struct_size was %u.", out_->struct_size);
    }

    T value = defaults<T>();

private:
    T* out_;
};

// NULL stands for the defaults. On success every field is in its documented range; sentinels are still sentinels.
Status read_options(const delmesh_context_options* given, delmesh_context_options& out);       // no context yet, so no sentence
Status read_options(Context& context, const delmesh_mesh_desc* given, delmesh_mesh_desc& out); // views: api/views
Status read_options(Context& context, int32_t number, const delmesh_layer* given, delmesh_layer& out); // its view: api/views
Status read_options(Context& context, const delmesh_remesh_options* given, delmesh_remesh_options& out);
Status read_options(Context& context, const delmesh_decimate_options* given, delmesh_decimate_options& out); // views: api/levels
Status read_options(Context& context, const delmesh_cage_desc* given, delmesh_cage_desc& out);               // views: api/cages
Status read_options(Context& context, const delmesh_subdivide_options* given, delmesh_subdivide_options& out);
Status read_options(Context& context, const delmesh_certify_options* given, delmesh_certify_options& out);
Status read_options(Context& context, const delmesh_distance_options* given, delmesh_distance_options& out);

} // namespace dm
