// SPDX-License-Identifier: Apache-2.0
// Reading the caller's strided arrays. Their type and shape were checked by api/; what they say is checked where it is used.
#pragma once

#include <cstring>

#include "base/context.h"

namespace dm {

// The i-th element of a view that api/ found aligned and gave a stride.
template <class T>
const T* element(const delmesh_view& view, int64_t i) {
    return reinterpret_cast<const T*>(static_cast<const char*>(view.data) + i * view.stride);
}
template <class T>
T* element(const delmesh_view_mut& view, int64_t i) {
    return reinterpret_cast<T*>(static_cast<char*>(view.data) + i * view.stride);
}

// Runs body(begin, end) over [0, count) in pieces, with a cancellation point before each. from..to: the part of the stage.
template <class Body>
Status in_pieces(Context& context, int64_t count, double from, double to, Body&& body) {
    constexpr int64_t kPiece = 1 << 16;
    for (int64_t begin = 0; begin < count; begin += kPiece) {
        DM_TRY(context.progress(from + (to - from) * static_cast<double>(begin) / static_cast<double>(count)));
        DM_TRY(body(begin, begin + kPiece < count ? begin + kPiece : count));
    }
    return DELMESH_OK;
}

// The i-th number of a view, counted through its components.
template <class T>
struct PackedNumbers {
    const char* data;
    int64_t operator()(int64_t i) const {
        T value;
        std::memcpy(&value, data + i * static_cast<int64_t>(sizeof(T)), sizeof(T));
        return static_cast<int64_t>(value);
    }
};
template <class T>
struct StridedNumbers {
    const char* data;
    int64_t stride;
    int32_t components;
    int64_t operator()(int64_t i) const {
        T value; // a stride need not be a multiple of the alignment
        std::memcpy(&value, data + i / components * stride + i % components * static_cast<int64_t>(sizeof(T)), sizeof(T));
        return static_cast<int64_t>(value);
    }
};

template <class T, class Use>
Status with_numbers_of(const delmesh_view& view, Use&& use) {
    const char* data = static_cast<const char*>(view.data);
    if (view.stride == 0 || view.stride == view.components * static_cast<int64_t>(sizeof(T))) return use(PackedNumbers<T>{data});
    return use(StridedNumbers<T>{data, view.stride, view.components});
}

// use(numbers), where numbers(i) is an int64_t: one instance per integer type, so that the loops inside stay tight.
template <class Use>
Status with_numbers(const delmesh_view& view, Use&& use) {
    switch (view.type) {
    case DELMESH_INT32:
        return with_numbers_of<int32_t>(view, use);
    case DELMESH_UINT32:
        return with_numbers_of<uint32_t>(view, use);
    case DELMESH_INT64:
        return with_numbers_of<int64_t>(view, use);
    default:
        return with_numbers_of<uint8_t>(view, use);
    }
}

// use(T()) with the integer type T of a checked view.
template <class Use>
auto with_index_type(int32_t type, Use&& use) {
    switch (type) {
    case DELMESH_UINT8:
        return use(uint8_t());
    case DELMESH_UINT32:
        return use(uint32_t());
    case DELMESH_INT64:
        return use(int64_t());
    default:
        return use(int32_t());
    }
}

} // namespace dm
