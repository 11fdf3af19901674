// SPDX-License-Identifier: Apache-2.0
// The one door between C and C++: every call on a context goes through guarded(), which owns the busy flag, the floating-point
// environment, and the step from exceptions to statuses.
#pragma once

#include <chrono>
#include <exception>

#include "api/handle.h"
#include "api/levels.h"
#include "base/fp_env.h"

namespace dm {

inline const char* allocation_sentence(Status status) {
    if (status == DELMESH_ERROR_MEMORY_LIMIT) return "The context's memory_limit was reached.";
    if (status == DELMESH_ERROR_ALLOCATION_LIMIT) return "The context's allocation_limit was reached.";
    return "The allocator had no memory left.";
}

// Status body(Context&). What it throws becomes a status with a sentence. DELMESH_ERROR_BUSY leaves no sentence: the context's
// text belongs to the call that is running.
template <class Body>
Status guarded(delmesh_context* context, Body&& body) noexcept {
    if (context == nullptr) return DELMESH_ERROR_INVALID_ARGUMENT;
    const FloatEnvironment environment;
    if (!context->begin_call()) return DELMESH_ERROR_BUSY;
    Status status;
    try {
        status = body(static_cast<Context&>(*context));
        if (status == DELMESH_OK) status = context->stage("finish", 1, 1);
    } catch (const AllocationFailure& failure) {
        status = context->fail(failure.status, "%s", allocation_sentence(failure.status));
    } catch (const std::bad_alloc&) {
        status = context->fail(DELMESH_ERROR_OUT_OF_MEMORY, "The C++ runtime had no memory left.");
    } catch (const std::exception& exception) {
        status = context->fail(DELMESH_ERROR_INTERNAL, "An exception was not handled: %s", exception.what());
    } catch (...) {
        status = context->fail(DELMESH_ERROR_INTERNAL, "A callback threw an exception.");
    }
    return context->end_call(status);
}

// The same for calls that make a mesh: Status body(Context&, Mesh& made). *out is NULL unless the call as a whole succeeded.
template <class Body>
Status guarded(delmesh_context* context, delmesh_mesh** out, Body&& body) noexcept {
    if (out != nullptr) *out = nullptr;
    MeshHandle made;
    const Status status = guarded(context, [&](Context& c) {
        if (out == nullptr) return c.fail(DELMESH_ERROR_INVALID_ARGUMENT, "The argument 'out' was NULL.");
        made = new_mesh(c.memory());
        return body(c, made->mesh);
    });
    if (status == DELMESH_OK) *out = made.release();
    return status;
}

// The same for calls that make a cage: Status body(Context&, Cage& made).
template <class Body>
Status guarded(delmesh_context* context, delmesh_cage** out, Body&& body) noexcept {
    if (out != nullptr) *out = nullptr;
    CageHandle made;
    const Status status = guarded(context, [&](Context& c) {
        if (out == nullptr) return c.fail(DELMESH_ERROR_INVALID_ARGUMENT, "The argument 'out' was NULL.");
        made = new_cage(c.memory());
        return body(c, made->cage);
    });
    if (status == DELMESH_OK) *out = made.release();
    return status;
}

// The same for calls that make a family of meshes: Status body(Context&, Mesh* const* made). Where `count` is no level count,
// nothing is known about how long `out` is, and body, which has to refuse it, gets no meshes.
template <class Body>
Status guarded(delmesh_context* context, delmesh_mesh** out, int32_t count, Body&& body) noexcept {
    if (!is_level_count(count) || out == nullptr) count = 0;
    for (int32_t i = 0; i < count; ++i) out[i] = nullptr;
    MeshHandle made[kMostLevels];
    const Status status = guarded(context, [&](Context& c) {
        if (out == nullptr) return c.fail(DELMESH_ERROR_INVALID_ARGUMENT, "The argument 'out' was NULL.");
        Mesh* meshes[kMostLevels] = {};
        for (int32_t i = 0; i < count; ++i) {
            made[i] = new_mesh(c.memory());
            meshes[i] = &made[i]->mesh;
        }
        return body(c, static_cast<Mesh* const*>(meshes));
    });
    for (int32_t i = 0; i < count && status == DELMESH_OK; ++i) out[i] = made[i].release();
    return status;
}

// The same for calls that only read a mesh. They have no context, so no sentence.
template <class Body>
Status guarded(const delmesh_mesh* mesh, Body&& body) noexcept {
    if (mesh == nullptr) return DELMESH_ERROR_INVALID_ARGUMENT;
    const FloatEnvironment environment;
    try {
        return body(*mesh);
    } catch (const AllocationFailure& failure) {
        return failure.status;
    } catch (...) {
        return DELMESH_ERROR_INTERNAL;
    }
}

inline Status require(Context& context, const char* name, const void* argument) {
    if (argument != nullptr) return DELMESH_OK;
    return context.fail(DELMESH_ERROR_INVALID_ARGUMENT, "The argument '%s' was NULL.", name);
}

// Writes what the enclosing scope took, however it is left.
class Meter {
public:
    Meter(Memory& memory, double& seconds, uint64_t& peak_bytes)
        : memory_(memory), seconds_(seconds), peak_bytes_(peak_bytes), peak_before_(memory.peak()) {
        memory.reset_peak();
    }
    ~Meter() {
        peak_bytes_ = memory_.peak();
        memory_.raise_peak(peak_before_);
        seconds_ = std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
    }
    Meter(const Meter&) = delete;
    Meter& operator=(const Meter&) = delete;

private:
    Memory& memory_;
    double& seconds_;
    uint64_t& peak_bytes_;
    uint64_t peak_before_;
    std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

} // namespace dm
