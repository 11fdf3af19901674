// SPDX-License-Identifier: Apache-2.0
// Integers that are never too small: sign and magnitude in an array whose capacity is part of the type, so that the compiler
// carries the proof that nothing overflows: a product has the bits of both factors, a sum one more than the longer term. Only
// the words in use are touched. No heap, no exceptions. This is the cold path of the predicates; see docs/numerics.md.
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <utility>

#include "base/check.h"

namespace dm::exact {

__extension__ typedef __int128 Int128;
__extension__ typedef unsigned __int128 UInt128;
using Word = uint64_t;

// -- magnitudes: little-endian words; the top word in use is not 0, so that 0 has size 0. Each returns the size of the result.

inline int trim(const Word* a, int size) {
    while (size > 0 && a[size - 1] == 0) --size;
    return size;
}

inline int compare_magnitudes(const Word* a, int a_size, const Word* b, int b_size) {
    if (a_size != b_size) return a_size < b_size ? -1 : 1;
    for (int i = a_size - 1; i >= 0; --i) {
        if (a[i] != b[i]) return a[i] < b[i] ? -1 : 1;
    }
    return 0;
}

// r = a + b, a_size >= b_size.
inline int add_magnitudes(Word* r, const Word* a, int a_size, const Word* b, int b_size) {
    Word carry = 0;
    for (int i = 0; i < a_size; ++i) {
        const UInt128 sum = static_cast<UInt128>(a[i]) + (i < b_size ? b[i] : 0) + carry;
        r[i] = static_cast<Word>(sum);
        carry = static_cast<Word>(sum >> 64);
    }
    if (carry == 0) return a_size;
    r[a_size] = carry;
    return a_size + 1;
}

// r = a - b, a >= b.
inline int subtract_magnitudes(Word* r, const Word* a, int a_size, const Word* b, int b_size) {
    Word borrow = 0;
    for (int i = 0; i < a_size; ++i) {
        const UInt128 difference = static_cast<UInt128>(a[i]) - (i < b_size ? b[i] : 0) - borrow;
        r[i] = static_cast<Word>(difference);
        borrow = static_cast<Word>(difference >> 64) & 1;
    }
    return trim(r, a_size);
}

// r = a * b; r is neither.
inline int multiply_magnitudes(Word* r, const Word* a, int a_size, const Word* b, int b_size) {
    if (a_size == 0 || b_size == 0) return 0;
    for (int i = 0; i < a_size + b_size; ++i) r[i] = 0;
    for (int i = 0; i < a_size; ++i) {
        if (a[i] == 0) continue;
        Word carry = 0;
        for (int j = 0; j < b_size; ++j) {
            const UInt128 sum = static_cast<UInt128>(a[i]) * b[j] + r[i + j] + carry;
            r[i + j] = static_cast<Word>(sum);
            carry = static_cast<Word>(sum >> 64);
        }
        r[i + b_size] = carry;
    }
    return trim(r, a_size + b_size);
}

// -- signed integers of at most kBits bits

template <int kBits>
class Integer {
public:
    static constexpr int kCapacity = (kBits + 63) / 64 + 1; // one more for the top word of a product before trimming, 0 there

    Integer() = default;
    Integer(const Integer& o) { *this = o; }
    Integer& operator=(const Integer& o) {
        if (this == &o) return *this;
        size_ = o.size_;
        negative_ = o.negative_;
        std::copy_n(o.words_, size_, words_);
        return *this;
    }
    explicit Integer(Int128 value) : negative_(value < 0) {
        static_assert(kBits >= 126);
        const UInt128 magnitude = negative_ ? -static_cast<UInt128>(value) : static_cast<UInt128>(value);
        words_[0] = static_cast<Word>(magnitude);
        words_[1] = static_cast<Word>(magnitude >> 64);
        size_ = trim(words_, 2);
    }
    // (negative ? -1 : 1) * mantissa * 2^shift; shift >= 0 unless mantissa is 0
    Integer(bool negative, Word mantissa, int shift) : negative_(negative) {
        if (mantissa == 0) return;
        const int first = shift / 64, offset = shift % 64;
        DM_ASSERT(shift >= 0 && shift + static_cast<int>(std::bit_width(mantissa)) <= kBits);
        std::fill_n(words_, first, 0);
        words_[first] = mantissa << offset;
        size_ = first + 1;
        const Word high = offset == 0 ? 0 : mantissa >> (64 - offset);
        if (high != 0) words_[size_++] = high;
    }

    int sign() const { return size_ == 0 ? 0 : negative_ ? -1 : 1; }

    template <int kA, int kB>
    friend auto operator*(const Integer<kA>& a, const Integer<kB>& b);
    template <int kA, int kB>
    friend auto add(const Integer<kA>& a, const Integer<kB>& b, bool negate_b);
    template <int kA, int kB>
    friend int compare_absolute(const Integer<kA>& a, const Integer<kB>& b);

private:
    int size_ = 0;
    bool negative_ = false;
    Word words_[kCapacity]; // undefined past size_
};

template <int kA, int kB>
auto operator*(const Integer<kA>& a, const Integer<kB>& b) {
    Integer<kA + kB> r;
    r.negative_ = a.negative_ != b.negative_;
    r.size_ = multiply_magnitudes(r.words_, a.words_, a.size_, b.words_, b.size_);
    return r;
}

// a + b, or a - b
template <int kA, int kB>
auto add(const Integer<kA>& a, const Integer<kB>& b, bool negate_b) {
    Integer<std::max(kA, kB) + 1> r;
    const bool b_negative = b.negative_ != negate_b;
    const bool a_larger = compare_magnitudes(a.words_, a.size_, b.words_, b.size_) >= 0;
    const Word *large = a.words_, *small = b.words_;
    int large_size = a.size_, small_size = b.size_;
    if (!a_larger) {
        std::swap(large, small);
        std::swap(large_size, small_size);
    }
    r.negative_ = a_larger ? a.negative_ : b_negative;
    r.size_ = a.negative_ == b_negative ? add_magnitudes(r.words_, large, large_size, small, small_size)
                                        : subtract_magnitudes(r.words_, large, large_size, small, small_size);
    return r;
}

template <int kA, int kB>
auto operator+(const Integer<kA>& a, const Integer<kB>& b) {
    return add(a, b, false);
}
template <int kA, int kB>
auto operator-(const Integer<kA>& a, const Integer<kB>& b) {
    return add(a, b, true);
}

// Sign of |a| - |b|.
template <int kA, int kB>
int compare_absolute(const Integer<kA>& a, const Integer<kB>& b) {
    return compare_magnitudes(a.words_, a.size_, b.words_, b.size_);
}

inline int sign(Int128 a) {
    return (a > 0) - (a < 0);
}
template <int kBits>
int sign(const Integer<kBits>& a) {
    return a.sign();
}

// -- vectors of them: T is Int128, where the caller has checked the range, or Integer<>

template <class T>
struct Vector {
    T x, y, z;
};

template <class T, class U>
auto dot(const Vector<T>& a, const Vector<U>& b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

template <class T>
auto cross(const Vector<T>& a, const Vector<T>& b) {
    using R = decltype(a.y * b.z - a.z * b.y);
    return Vector<R>{a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

} // namespace dm::exact
