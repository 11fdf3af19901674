// SPDX-License-Identifier: Apache-2.0
#include "base/context.h"

#include <cstdarg>
#include <cstdio>

namespace dm {

namespace {
constexpr std::chrono::milliseconds kReportInterval{50}; // hosts redraw on progress: more often only costs them time
}

Context::Context(const delmesh_context_options& options, Memory* memory)
    : memory_(memory), options_(options), pool_(options.max_threads, options.parallel_for, options.user) {}

Context::~Context() {
    memory_->release();
}

Status Context::fail(Status status, const char* format, ...) {
    va_list arguments;
    va_start(arguments, format);
    std::vsnprintf(error_, sizeof error_, format, arguments);
    va_end(arguments);
    return status;
}

void Context::log(int32_t level, const char* format, ...) {
    if (options_.log == nullptr) return;
    char text[512];
    va_list arguments;
    va_start(arguments, format);
    std::vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    options_.log(options_.user, level, text);
}

Status Context::cancelled() {
    request_cancel(); // workers stop too; end_call clears it
    return fail(DELMESH_ERROR_CANCELLED, "The call was cancelled during '%s'.", stage_name_);
}

Status Context::stage(const char* name, double from, double to) {
    stage_name_ = name;
    stage_from_ = part_from_ + (part_to_ - part_from_) * from;
    stage_to_ = part_from_ + (part_to_ - part_from_) * to;
    next_report_ = {}; // a new stage is always told
    return progress(0);
}

Status Context::progress(double fraction) {
    last_fraction_ = fraction;
    if (cancel_requested()) return cancelled();
    if (options_.progress == nullptr) return DELMESH_OK;
    const auto now = std::chrono::steady_clock::now();
    if (now < next_report_) return DELMESH_OK;
    next_report_ = now + kReportInterval;
    const double clamped = fraction < 0 ? 0 : fraction > 1 ? 1 : fraction;
    const double whole = stage_from_ + (stage_to_ - stage_from_) * clamped;
    if (whole > reported_) reported_ = whole;
    if (options_.progress(options_.user, reported_, stage_name_) != DELMESH_CONTINUE) return cancelled();
    return cancel_requested() ? cancelled() : DELMESH_OK;
}

bool Context::begin_call() {
    if (busy_.exchange(true, std::memory_order_acquire)) return false;
    clear_error();
    stage_name_ = "start";
    stage_from_ = 0;
    stage_to_ = 1;
    last_fraction_ = reported_ = 0;
    next_report_ = {};
    return true;
}

Status Context::end_call(Status status) {
    if (cancel_.exchange(false, std::memory_order_relaxed))
        status = fail(DELMESH_ERROR_CANCELLED, "The call was cancelled during '%s'.", stage_name_);
    busy_.store(false, std::memory_order_release);
    return status;
}

} // namespace dm
