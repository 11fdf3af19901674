// SPDX-License-Identifier: Apache-2.0
// The host's floating-point environment is not ours: inside a call it is round-to-nearest, no traps, no flush-to-zero.
#pragma once

#include <cfenv>
#include <cstdint>

#if defined(__x86_64__) || defined(__i386__) || defined(_M_X64)
#include <immintrin.h>
#define DM_HAS_MXCSR 1
#endif

namespace dm {

// Saves the calling thread's environment, sets the IEEE default one, and puts the saved one back (without raising anything).
class FloatEnvironment {
public:
    FloatEnvironment() {
        std::fegetenv(&saved_);
        std::fesetenv(FE_DFL_ENV);
#if defined(DM_HAS_MXCSR)
        _mm_setcsr(0x1f80); // all exceptions masked, nearest, neither FTZ nor DAZ
#endif
    }
    ~FloatEnvironment() { std::fesetenv(&saved_); }
    FloatEnvironment(const FloatEnvironment&) = delete;
    FloatEnvironment& operator=(const FloatEnvironment&) = delete;

private:
    std::fenv_t saved_; // on x86 this includes MXCSR
};

} // namespace dm
