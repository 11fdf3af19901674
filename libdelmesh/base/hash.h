// SPDX-License-Identifier: Apache-2.0
// For tables with open addressing, whose size is a power of two.
#pragma once

#include <bit>
#include <cstdint>

namespace dm {

// Spreads the bits of `key` over all 64.
inline uint64_t scramble(uint64_t key) {
    key ^= key >> 32;
    key *= 0x9e3779b97f4a7c15u;
    key ^= key >> 29;
    key *= 0xbf58476d1ce4e5b9u;
    return key ^ (key >> 32);
}

inline int64_t table_size(int64_t entries) { // at most two thirds full
    return static_cast<int64_t>(std::bit_ceil(static_cast<uint64_t>(entries + entries / 2 + 2)));
}

} // namespace dm
