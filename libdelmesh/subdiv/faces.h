// SPDX-License-Identifier: Apache-2.0
// Loops over the faces of a cage, in parallel, with what evaluates the limit surface there.
#pragma once

#include <atomic>
#include <exception>

#include "subdiv/cage.h"

namespace dm {

// body(evaluator, f) for every face of the cage that has a limit surface. `samples`: about how many points a face is evaluated at.
template <class Body>
Status for_limit_faces(Context& context, const Cage& cage, int64_t samples, double from, double to, Body&& body) {
    constexpr int64_t kSamplesPerBlock = 2048, kBlocksPerSlice = 128;
    const int64_t grain = samples < kSamplesPerBlock ? kSamplesPerBlock / (samples + 1) + 1 : 1;
    std::atomic<bool> failed{false}; // the evaluator allocates from the C++ runtime, and nothing may leave a thread
    for (int64_t start = 0; start < cage.faces(); start += kBlocksPerSlice * grain) {
        DM_TRY(context.progress(from + (to - from) * static_cast<double>(start) / cage.faces()));
        const int64_t rest = cage.faces() - start, size = rest < kBlocksPerSlice * grain ? rest : kBlocksPerSlice * grain;
        DM_TRY(context.parallel(size, grain, [&](int64_t, int64_t begin, int64_t end) {
            try {
                LimitEvaluator evaluator(cage.limit);
                for (int64_t f = start + begin; f < start + end; ++f)
                    if (cage.has_limit[f] != 0) body(evaluator, static_cast<int32_t>(f));
            } catch (const std::exception&) {
                failed = true;
            }
        }));
        if (failed) return context.fail(DELMESH_ERROR_OUT_OF_MEMORY, "The C++ runtime had no memory left.");
    }
    return DELMESH_OK;
}

} // namespace dm
