// SPDX-License-Identifier: Apache-2.0
// Runs numbered tasks on the calling thread, on own threads, or on the host's pool.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <thread>

#include "delmesh/delmesh.h"

namespace dm {

class ThreadPool {
public:
    // max_threads 0: one per core, or as the host's pool sees fit. Own threads start with the first run() that has use for them.
    ThreadPool(int32_t max_threads, delmesh_parallel_for_fn host, void* host_user);
    ~ThreadPool(); // joins
    ThreadPool(const ThreadPool&) = delete;
    ThreadPool& operator=(const ThreadPool&) = delete;

    // Calls task(data, i) for every i in [0, count) and returns after the last one. One run at a time.
    void run(int32_t count, delmesh_task_fn task, void* data);
    int32_t max_threads() const { return max_threads_; }

private:
    static constexpr int32_t kMostThreads = 64;

    void start_threads();
    void work();                  // a thread's life
    void take_tasks(bool caller); // until none is left
    template <class Done>
    static void stay_awake(Done&& done);

    int32_t max_threads_;
    delmesh_parallel_for_fn host_;
    void* host_user_;

    std::thread threads_[kMostThreads];
    int32_t started_ = 0;

    std::mutex mutex_;
    std::condition_variable wake_, finished_;
    // Written under the lock; atomic for those who look without it.
    std::atomic<uint64_t> generation_{0}; // counts runs; threads wait for it to move
    std::atomic<int32_t> working_{0};     // threads inside take_tasks
    std::atomic<bool> stop_{false};
    delmesh_task_fn task_ = nullptr;
    void* data_ = nullptr;
    int32_t count_ = 0;
    std::atomic<int32_t> taken_{0}; // or more: a thread that finds none has counted too
    std::atomic<int32_t> last_{-1}; // for threads that are not the caller
};

} // namespace dm
