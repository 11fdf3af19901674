// SPDX-License-Identifier: Apache-2.0
// A priority queue for priorities that need not be told apart to the last bit, of things that each belong to a part of a whole:
// a bucket per part for each of the leading bits of the float32 (3 % wide), found through two levels of bit masks. Push and pop
// take the same time however much is in it.
// One part after the other is emptied up to a common limit, in the order of its priorities; then the limit is raised. What is near
// in space belongs to one part, so what is popped in a row needs the same memory. How far the limit is raised depends on how much is
// still wanted: by a factor of two at first, by a bucket at last, so in the end all parts have come equally far.
// Inside of a bucket the last comes first, so that the order depends on the order of the calls alone. Buckets are lists of blocks:
// entries that are popped together lie together.
#pragma once

#include <algorithm>

#include "base/array.h"

namespace dm {

template <class T>
class BucketQueue {
public:
    explicit BucketQueue(Memory& memory) : heads_(memory), blocks_(memory), fine_(memory), coarse_(memory), counts_(memory) {}
    // Room for about so many values, spread as priorities of one kind are.
    void begin(int32_t parts, int64_t count) {
        parts_ = parts;
        heads_.assign(int64_t{parts} * kBuckets, -1);
        fine_.assign(int64_t{parts} * kFineWords, 0);
        coarse_.assign(int64_t{parts} * kCoarseWords, 0);
        counts_.assign(kBuckets, 0);
        blocks_.reserve(count / kBlock * 3 / 2 + 1024);
        part_ = parts;
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
    void push(int32_t part, int32_t b, const T& value) {
        int32_t& head = heads_[int64_t{part} * kBuckets + b];
        if (count_of(head) == kBlock) {
            int32_t fresh = free_;
            if (fresh >= 0) {
                free_ = blocks_[fresh].next;
            } else {
                fresh = static_cast<int32_t>(blocks_.size());
                blocks_.push_back(Block{});
            }
            blocks_[fresh].next = head;
            head = fresh * (kBlock + 1);
            fine_[part * kFineWords + (b >> 6)] |= uint64_t{1} << (b & 63);
            coarse_[part * kCoarseWords + (b >> 12)] |= uint64_t{1} << (b >> 6 & 63);
        }
        blocks_[block_of(head)].values[count_of(head)] = value;
        ++head;
        ++counts_[b];
        ++size_;
    }
    // Up to `most` values of the lowest buckets of a part, with these; how many there were, 0 only if the queue is empty.
    // wanted: about how many values are still to be of use; may be any number, but decides how evenly the parts are emptied.
    int pop(int64_t wanted, int32_t* buckets, T* values, int most) {
        if (size_ == 0) return 0;
        int32_t b;
        for (;; ++part_) {
            if (part_ >= parts_) {
                raise_limit(wanted);
                part_ = 0;
            }
            b = lowest_of(part_);
            if (b <= limit_) break;
        }
        int count = 0;
        for (const int32_t last = std::min(limit_, b + kSpan); b <= last; b = lowest_of(part_)) {
            int32_t& head = heads_[int64_t{part_} * kBuckets + b];
            Block& block = blocks_[block_of(head)];
            const int before = count;
            while (count < most && count_of(head) > 0) {
                buckets[count] = b;
                values[count++] = block.values[count_of(--head)];
            }
            counts_[b] -= count - before;
            size_ -= count - before;
            if (count_of(head) > 0) break;
            const int32_t empty = block_of(head);
            head = block.next;
            block.next = free_;
            free_ = empty;
            uint64_t& fine = fine_[part_ * kFineWords + (b >> 6)];
            if (head < 0 && (fine &= fine - 1) == 0) {
                uint64_t& coarse = coarse_[part_ * kCoarseWords + (b >> 12)];
                coarse &= coarse - 1;
            }
            if (count == most) break;
        }
        ask_for_next(b);
        return count;
    }
    int64_t size() const { return size_; }
    bool has_begun() const { return !heads_.empty(); }
    // It is empty then, and may not be used before begin().
    void free_storage() {
        heads_.free_storage();
        blocks_.free_storage();
        fine_.free_storage();
        coarse_.free_storage();
        counts_.free_storage();
        size_ = 0;
        free_ = -1;
    }

private:
    static constexpr int32_t kDropped = 18; // of 32 bits; the sign is never set
    static constexpr int32_t kBuckets = 1 << (31 - kDropped), kFineWords = kBuckets / 64, kCoarseWords = kFineWords / 64;
    static constexpr int32_t kOctave = 1 << (23 - kDropped); // buckets to twice the priority
    static constexpr int32_t kSpan = 2;                      // buckets that are popped together
    static constexpr int kBlockBits = 4, kBlock = (1 << kBlockBits) - 1;

    struct Block {
        T values[kBlock];
        int32_t next; // the head of what is behind it, or -1; of a free block the next free one
    };
    // A head is the first block of a list and how many values are in it; those behind it are full. The count is here, so that a push
    // need not read the block. -1: no block, and it is full.
    static int32_t block_of(int32_t head) { return head >> kBlockBits; }
    static int32_t count_of(int32_t head) { return head & kBlock; }

    int32_t lowest_of(int32_t part) const {
        const uint64_t* coarse = &coarse_[part * kCoarseWords];
        for (int32_t i = 0; i < kCoarseWords; ++i) {
            if (coarse[i] == 0) continue;
            const int32_t word = i * 64 + __builtin_ctzll(coarse[i]);
            return word * 64 + __builtin_ctzll(fine_[part * kFineWords + word]);
        }
        return kBuckets;
    }
    // Has those brought from memory that are popped next, from the bucket b on, while these are looked at.
    void ask_for_next(int32_t b) const {
        if (b >= kBuckets) return;
        const uint64_t word = fine_[part_ * kFineWords + (b >> 6)];
        for (const int32_t end = std::min(b | 63, b + kSpan); b <= end; ++b) {
            if ((word >> (b & 63) & 1) == 0) continue;
            const int32_t head = heads_[int64_t{part_} * kBuckets + b];
            const Block& block = blocks_[block_of(head)];
            for (int i = count_of(head) - 1; i >= 0; i -= 64 / static_cast<int>(sizeof(T))) __builtin_prefetch(&block.values[i]);
        }
    }
    void raise_limit(int64_t wanted) {
        int32_t lowest = 0;
        while (counts_[lowest] == 0) ++lowest;
        int64_t below = counts_[lowest];
        limit_ = lowest;
        while (limit_ + 1 < std::min(kBuckets, lowest + kOctave) && (below += counts_[limit_ + 1]) <= wanted) ++limit_;
    }

    Array<int32_t> heads_; // per part and bucket
    Array<Block> blocks_;
    Array<uint64_t> fine_, coarse_;
    Array<int64_t> counts_; // per bucket, of all parts
    int32_t parts_ = 0, part_ = 0, limit_ = 0, free_ = -1;
    int64_t size_ = 0;
};

} // namespace dm
