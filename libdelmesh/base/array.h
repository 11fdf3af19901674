// SPDX-License-Identifier: Apache-2.0
// A growing array of plain data on the context's Memory. std::vector is not used for mesh data because its memory would escape
// the host's allocator and limits, and because it clears what is about to be overwritten.
#pragma once

#include <cstring>
#include <type_traits>
#include <utility>

#include "base/check.h"
#include "base/memory.h"

namespace dm {

template <class T>
class Array {
    static_assert(std::is_trivially_copyable_v<T> && std::is_trivially_destructible_v<T>, "plain data only");

public:
    explicit Array(Memory& memory) : memory_(&memory) {}
    Array(Memory& memory, int64_t size) : memory_(&memory) { resize_uninitialized(size); }
    Array(Memory& memory, int64_t size, T value) : memory_(&memory) { assign(size, value); }
    Array(Array&& o) noexcept
        : memory_(o.memory_), data_(std::exchange(o.data_, nullptr)), size_(std::exchange(o.size_, 0)),
          capacity_(std::exchange(o.capacity_, 0)), owns_(o.owns_) {}
    Array& operator=(Array&& o) noexcept {
        if (this != &o) {
            free_storage();
            memory_ = o.memory_;
            data_ = std::exchange(o.data_, nullptr);
            size_ = std::exchange(o.size_, 0);
            capacity_ = std::exchange(o.capacity_, 0);
            owns_ = o.owns_;
        }
        return *this;
    }
    // The same elements under another name, for as long as `o` neither grows nor goes away: may not grow itself.
    static Array alias(const Array& o) {
        Array a(*o.memory_);
        a.data_ = o.data_;
        a.size_ = a.capacity_ = o.size_;
        a.owns_ = false;
        return a;
    }
    Array(const Array&) = delete;
    Array& operator=(const Array&) = delete;
    ~Array() { free_storage(); }

    T* data() { return data_; }
    const T* data() const { return data_; }
    int64_t size() const { return size_; }
    bool empty() const { return size_ == 0; }
    int64_t room() const { return capacity_ - size_; } // so many push_back do not allocate
    T& operator[](int64_t i) {
        DM_ASSERT(i >= 0 && i < size_);
        return data_[i];
    }
    const T& operator[](int64_t i) const {
        DM_ASSERT(i >= 0 && i < size_);
        return data_[i];
    }
    T* begin() { return data_; }
    T* end() { return data_ + size_; }
    const T* begin() const { return data_; }
    const T* end() const { return data_ + size_; }
    T& back() { return (*this)[size_ - 1]; }
    const T& back() const { return (*this)[size_ - 1]; }

    void clear() { size_ = 0; }
    void free_storage() {
        if (data_ != nullptr && owns_) memory_->deallocate(data_, static_cast<size_t>(capacity_) * sizeof(T));
        data_ = nullptr;
        size_ = capacity_ = 0;
    }
    void reserve(int64_t capacity) {
        if (capacity <= capacity_) return;
        DM_ASSERT(owns_);
        T* grown = static_cast<T*>(memory_->allocate(static_cast<size_t>(capacity) * sizeof(T)));
        if (size_ != 0) std::memcpy(static_cast<void*>(grown), data_, static_cast<size_t>(size_) * sizeof(T));
        if (data_ != nullptr) memory_->deallocate(data_, static_cast<size_t>(capacity_) * sizeof(T));
        data_ = grown;
        capacity_ = capacity;
    }
    // Takes the storage of an array that nobody reads any more, of the same Memory. What has been touched needs no clearing by the
    // system.
    template <class U>
    void take_storage(Array<U>&& o) {
        static_assert(sizeof(U) % sizeof(T) == 0, "storage is given back by its size");
        DM_ASSERT(o.owns_ && o.memory_ == memory_);
        free_storage();
        data_ = reinterpret_cast<T*>(std::exchange(o.data_, nullptr));
        capacity_ = static_cast<int64_t>(sizeof(U) / sizeof(T)) * std::exchange(o.capacity_, 0);
        o.size_ = 0;
    }
    // New elements hold garbage: for arrays that are filled at once.
    void resize_uninitialized(int64_t size) {
        reserve(size);
        size_ = size;
    }
    void resize(int64_t size, T value) {
        const int64_t old = size_;
        if (size > capacity_) reserve(grown_capacity(size));
        size_ = size;
        for (int64_t i = old; i < size; ++i) data_[i] = value;
    }
    void assign(int64_t size, T value) {
        clear();
        reserve(size);
        size_ = size;
        for (int64_t i = 0; i < size; ++i) data_[i] = value;
    }
    void push_back(T value) {
        if (size_ == capacity_) reserve(grown_capacity(size_ + 1));
        data_[size_++] = value;
    }
    T pop_back() { return data_[--size_]; }
    void copy_from(const Array& o) {
        resize_uninitialized(o.size_);
        if (o.size_ != 0) std::memcpy(static_cast<void*>(data_), o.data_, static_cast<size_t>(o.size_) * sizeof(T));
    }
    Memory& memory() const { return *memory_; }

private:
    template <class U>
    friend class Array;

    int64_t grown_capacity(int64_t needed) const {
        const int64_t geometric = capacity_ + capacity_ / 2 + 16;
        return geometric > needed ? geometric : needed;
    }

    Memory* memory_;
    T* data_ = nullptr;
    int64_t size_ = 0, capacity_ = 0;
    bool owns_ = true;
};

} // namespace dm
