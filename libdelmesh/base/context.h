// SPDX-License-Identifier: Apache-2.0
// What every operation carries: memory, error sentence, progress, cancel flag, log, threads. Passed by reference everywhere;
// there is no global and no thread-local state.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>

#include "base/array.h"
#include "base/memory.h"
#include "base/parallel.h"

namespace dm {

class Context {
public:
    // options have been checked (api/options). memory: one reference is taken over.
    Context(const delmesh_context_options& options, Memory* memory);
    ~Context();
    Context(const Context&) = delete;
    Context& operator=(const Context&) = delete;

    Memory& memory() { return *memory_; }
    const Memory& memory() const { return *memory_; }

    // -- errors: `return ctx.fail(DELMESH_ERROR_..., "Face %lld ...", f);` Doubles go in as "%s", Number(x).text (base/number.h).
    Status fail(Status status, const char* format, ...) __attribute__((format(printf, 3, 4)));
    const char* error_text() const { return error_; }
    void clear_error() { error_[0] = 0; }

    // -- log (repairs): formatted only when the host listens
    void log(int32_t level, const char* format, ...) __attribute__((format(printf, 3, 4)));

    // -- progress and cancel
    // A call is cut into stages: stage("flip", 0.1, 0.6) says that what follows is that part of the whole call.
    // progress(f), f in 0..1 of the stage, asks for cancellation and now and then tells the host; call it every few
    // thousand steps from the calling thread. Both return DELMESH_OK, or DELMESH_ERROR_CANCELLED with the error text set:
    // hand that on at once.
    Status stage(const char* name, double from, double to);
    Status progress(double fraction);
    // While it lives, the stages of what is called are a part of the caller's own call.
    class Part {
    public:
        Part(Context& context, double from, double to) : context_(context), from_(context.part_from_), to_(context.part_to_) {
            context.part_from_ = from_ + (to_ - from_) * from;
            context.part_to_ = from_ + (to_ - from_) * to;
        }
        ~Part() { context_.part_from_ = from_, context_.part_to_ = to_; }
        Part(const Part&) = delete;
        Part& operator=(const Part&) = delete;

    private:
        Context& context_;
        double from_, to_;
    };
    void request_cancel() { cancel_.store(true, std::memory_order_relaxed); }
    bool cancel_requested() const { return cancel_.load(std::memory_order_relaxed); }

    // Every public call is bracketed by these (api/guard.h). begin_call fails when the context is busy. end_call returns what the
    // call is to return: a cancel that came before it belongs to this call, whatever the call did; one after it to the next call.
    bool begin_call();
    Status end_call(Status status);

    // -- threads
    int32_t max_threads() const { return pool_.max_threads(); }
    // Calls body(block, begin, end) for the blocks [k * grain, (k+1) * grain) of [0, count), on any thread, in any order.
    // The partition depends only on count and grain, so results merged by block number are the same for any number of threads.
    // body must not allocate, throw, or touch the context. After a cancel the remaining blocks are skipped and CANCELLED is
    // returned: what body wrote must then not be used.
    template <class Body>
    Status parallel(int64_t count, int64_t grain, Body&& body) {
        struct Job {
            Body* body;
            Context* context;
            int64_t count, grain;
            std::atomic<int64_t> done{0};
        } job{&body, this, count, grain < 1 ? 1 : grain, {}};
        const int64_t blocks = (count + job.grain - 1) / job.grain;
        pool_.run(
            static_cast<int32_t>(blocks),
            [](void* data, int32_t block) {
                Job& j = *static_cast<Job*>(data);
                if (j.context->cancel_requested()) return;
                const int64_t begin = block * j.grain;
                const int64_t end = begin + j.grain < j.count ? begin + j.grain : j.count;
                (*j.body)(static_cast<int64_t>(block), begin, end);
            },
            &job);
        return progress(last_fraction_);
    }

private:
    Status cancelled();

    Memory* memory_;
    delmesh_context_options options_;
    ThreadPool pool_;
    std::atomic<bool> cancel_{false};
    std::atomic<bool> busy_{false};
    const char* stage_name_ = "";
    double part_from_ = 0, part_to_ = 1, stage_from_ = 0, stage_to_ = 1, last_fraction_ = 0, reported_ = 0;
    std::chrono::steady_clock::time_point next_report_{};
    char error_[512] = {0};
};

#define DM_TRY(expression)                                                                                                       \
    do {                                                                                                                         \
        const ::dm::Status dm_try_status = (expression);                                                                         \
        if (dm_try_status != DELMESH_OK) return dm_try_status;                                                                   \
    } while (0)

} // namespace dm
