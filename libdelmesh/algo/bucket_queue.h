// SPDX-License-Identifier: Apache-2.0
// A priority queue for priorities that need not be told apart to the last bit: a bucket for each of the leading bits of the
// float32 (1.6 % wide), found through two levels of bit masks. Push and pop take the same time however much is in it; what is
// pushed below the last popped bucket is popped next. Inside of a bucket the last comes first, so that the order depends on the
// order of the calls alone. Buckets are lists of blocks: entries that are popped together lie together.
#pragma once

#include <algorithm>

#include "base/array.h"

namespace dm {

template <class T>
class BucketQueue {
public:
    explicit BucketQueue(Memory& memory) : buckets_(memory), blocks_(memory), fine_(memory), coarse_(memory) {
        buckets_.assign(kBuckets, Bucket{-1, 0});
        fine_.assign(kBuckets / 64, 0);
        coarse_.assign(kBuckets / 4096, 0);
    }
    static constexpr double kLargest = 1e38; // priorities are below
    // Priorities of one bucket are equal to the queue. priority: 0 or more, not NaN.
    static int32_t bucket(double priority) {
        const float f = static_cast<float>(priority);
        uint32_t bits;
        std::memcpy(&bits, &f, sizeof bits);
        return static_cast<int32_t>(bits >> kDropped);
    }
    // Where the bucket ends.
    static double end_of(int32_t b) {
        const uint32_t bits = static_cast<uint32_t>(b + 1) << kDropped;
        float f;
        std::memcpy(&f, &bits, sizeof f);
        return f;
    }
    void push(double priority, const T& value) { push_to(bucket(priority), value); }
    void push_to(int32_t b, const T& value) {
        Bucket& bucket = buckets_[b];
        if (bucket.block < 0 || bucket.count == kBlock) {
            int32_t fresh = free_;
            if (fresh >= 0) {
                free_ = blocks_[fresh].next;
            } else {
                fresh = static_cast<int32_t>(blocks_.size());
                blocks_.push_back(Block{});
            }
            blocks_[fresh].next = bucket.block;
            bucket = {fresh, 0};
            fine_[b >> 6] |= uint64_t{1} << (b & 63);
            coarse_[b >> 12] |= uint64_t{1} << (b >> 6 & 63);
            first_ = std::min(first_, b >> 12);
        }
        blocks_[bucket.block].values[bucket.count++] = value;
        ++size_;
    }
    // Up to `most` values of the lowest bucket, or as many as lie together; how many there were, 0 only if the queue is empty.
    int pop(int32_t& b, T* values, int most) {
        if (size_ == 0) return 0;
        while (coarse_[first_] == 0) ++first_;
        const int32_t word = first_ * 64 + __builtin_ctzll(coarse_[first_]);
        b = word * 64 + __builtin_ctzll(fine_[word]);
        Bucket& bucket = buckets_[b];
        Block& block = blocks_[bucket.block];
        const int count = std::min(most, bucket.count);
        for (int i = 0; i < count; ++i) values[i] = block.values[--bucket.count];
        size_ -= count;
        if (bucket.count == 0) {
            const int32_t empty = bucket.block;
            bucket = {block.next, kBlock};
            block.next = free_;
            free_ = empty;
            if (bucket.block < 0 && (fine_[word] &= fine_[word] - 1) == 0) coarse_[first_] &= coarse_[first_] - 1;
        }
        return count;
    }
    int64_t size() const { return size_; }
    // Room for about so many values, spread as priorities of one kind are.
    void reserve(int64_t count) { blocks_.reserve(count / kBlock * 3 / 2 + 1024); }

private:
    static constexpr int32_t kDropped = 17; // of 32 bits; the sign is never set
    static constexpr int32_t kBuckets = 1 << (31 - kDropped);
    static constexpr int kBlock = 15;

    struct Block {
        T values[kBlock];
        int32_t next;
    };
    struct Bucket {
        int32_t block; // -1: empty
        int32_t count; // in that block; those behind it are full
    };
    Array<Bucket> buckets_;
    Array<Block> blocks_;
    Array<uint64_t> fine_, coarse_;
    int32_t free_ = -1, first_ = 0;
    int64_t size_ = 0;
};

} // namespace dm
