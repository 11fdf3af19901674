// SPDX-License-Identifier: Apache-2.0
// A long parallel loop that reports progress and looks for a cancel on the way.
#pragma once

#include "base/context.h"

namespace dm {

// Context::parallel over [0, count) in slices of so many blocks that the host hears of it every few tens of milliseconds when a
// block takes some tenths of one. Blocks are numbered through the whole loop. from, to: the part of the stage.
template <class Body>
Status parallel_slices(Context& context, int64_t count, int64_t grain, double from, double to, Body&& body) {
    constexpr int64_t kBlocksPerSlice = 128;
    for (int64_t start = 0; start < count; start += kBlocksPerSlice * grain) {
        DM_TRY(context.progress(from + (to - from) * static_cast<double>(start) / static_cast<double>(count)));
        const int64_t rest = count - start, size = rest < kBlocksPerSlice * grain ? rest : kBlocksPerSlice * grain;
        DM_TRY(context.parallel(size, grain, [&](int64_t block, int64_t begin, int64_t end) {
            body(start / grain + block, start + begin, start + end);
        }));
    }
    return DELMESH_OK;
}

// Array::assign, with a look for a cancel every few megabytes: the first touch of memory takes time.
template <class T>
Status fill(Context& context, Array<T>& array, int64_t size, const T& value) {
    constexpr int64_t kGrain = (int64_t{1} << 22) / sizeof(T) + 1;
    array.resize_uninitialized(size);
    return context.parallel(size, kGrain, [&](int64_t, int64_t begin, int64_t end) {
        for (int64_t i = begin; i < end; ++i) array[i] = value;
    });
}

inline int64_t block_count(int64_t count, int64_t grain) {
    return (count + grain - 1) / grain;
}

} // namespace dm
