// SPDX-License-Identifier: Apache-2.0
#include "base/parallel.h"

#include <exception>

#include "base/fp_env.h"

namespace dm {
namespace {

// The host's threads have the host's floating-point environment. (Own threads inherit that of the call that starts them.)
struct HostTask {
    delmesh_task_fn task;
    void* data;
    static void call(void* host_task, int32_t index) {
        const FloatEnvironment environment;
        const HostTask& t = *static_cast<const HostTask*>(host_task);
        t.task(t.data, index);
    }
};

} // namespace

ThreadPool::ThreadPool(int32_t max_threads, delmesh_parallel_for_fn host, void* host_user)
    : max_threads_(max_threads), host_(host), host_user_(host_user) {
    if (max_threads_ == 0)
        max_threads_ = host_ != nullptr ? kMostThreads : static_cast<int32_t>(std::thread::hardware_concurrency());
    if (max_threads_ < 1) max_threads_ = 1; // the system could not tell
    if (max_threads_ > kMostThreads) max_threads_ = kMostThreads;
}

ThreadPool::~ThreadPool() {
    {
        std::lock_guard<std::mutex> lock(mutex_);
        stop_ = true;
    }
    wake_.notify_all();
    for (int32_t i = 0; i < started_; ++i) threads_[i].join();
}

void ThreadPool::start_threads() {
    while (started_ < max_threads_ - 1) {
        try {
            threads_[started_] = std::thread([this] { work(); });
        } catch (const std::exception&) {
            max_threads_ = started_ + 1; // the system has no more threads to give: go on with what there is
            return;
        }
        ++started_;
    }
}

// The caller begins with the first task, the others with the last. So neighbouring tasks, which often write to the same (huge) page
// of new memory, seldom meet there, and from one run to the next a thread finds the end that it had.
void ThreadPool::take_tasks(bool caller) {
    int32_t first = 0;
    while (taken_.fetch_add(1, std::memory_order_relaxed) < count_)
        task_(data_, caller ? first++ : last_.fetch_sub(1, std::memory_order_relaxed));
}

// A thread that sleeps takes some tens of microseconds to wake up, as long as a short run takes. The next run is often near: who
// waits stays awake for about half a millisecond (more where others take the core, which it offers each time): longer than the
// serial parts between most runs.
template <class Done>
void ThreadPool::stay_awake(Done&& done) {
    constexpr int kTurns = 2048; // of some tenths of a microsecond
    for (int i = 0; i < kTurns && !done(); ++i) std::this_thread::yield();
}

void ThreadPool::work() {
    uint64_t seen = 0;
    std::unique_lock<std::mutex> lock(mutex_, std::defer_lock);
    for (;;) {
        stay_awake([&] { return stop_ || generation_ != seen; });
        lock.lock();
        wake_.wait(lock, [&] { return stop_ || generation_ != seen; });
        if (stop_) return;
        seen = generation_;
        ++working_;
        lock.unlock();
        take_tasks(false);
        lock.lock();
        if (--working_ == 0) finished_.notify_one();
        lock.unlock();
    }
}

void ThreadPool::run(int32_t count, delmesh_task_fn task, void* data) {
    if (count <= 0) return;
    if (max_threads_ == 1 || count == 1) {
        for (int32_t i = 0; i < count; ++i) task(data, i);
        return;
    }
    if (host_ != nullptr) {
        HostTask host_task{task, data};
        host_(host_user_, count, HostTask::call, &host_task);
        return;
    }
    start_threads();
    {
        // A thread of the last run may still be on its way out of take_tasks: it would see the new tasks, and the old data.
        std::unique_lock<std::mutex> lock(mutex_);
        finished_.wait(lock, [&] { return working_ == 0; });
        task_ = task;
        data_ = data;
        count_ = count;
        taken_.store(0, std::memory_order_relaxed);
        last_.store(count - 1, std::memory_order_relaxed);
        ++generation_;
    }
    wake_.notify_all();
    take_tasks(true);
    stay_awake([&] { return working_ == 0; });
    std::unique_lock<std::mutex> lock(mutex_);
    finished_.wait(lock, [&] { return working_ == 0; });
    // A thread that wakes only now finds no task left: count_ stays valid and taken_ is past it.
}

} // namespace dm
