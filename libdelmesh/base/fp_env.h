// SPDX-License-Identifier: Apache-2.0
// The host's floating-point environment is not ours: inside a call it is round-to-nearest, no traps, no flush-to-zero.
#pragma once

#include <cstdint>

#if !(defined(__GNUC__) && defined(__x86_64__))
#include <cfenv>
#endif

namespace dm {

// Saves the calling thread's environment, sets the IEEE default one, and puts the saved one back, sticky flags included, without
// raising anything.
class FloatEnvironment {
public:
    FloatEnvironment(const FloatEnvironment&) = delete;
    FloatEnvironment& operator=(const FloatEnvironment&) = delete;

#if defined(__GNUC__) && defined(__x86_64__)
    // glibc's fesetenv leaves the x87 precision control as it finds it, and FE_DFL_ENV changes it: so by hand. The memory
    // clobbers keep the compiler, which knows nothing of the environment, from moving loads of the caller's numbers across.
    FloatEnvironment() {
        const uint16_t default_control = 0x037f;
        const uint32_t default_mxcsr = 0x1f80;
        __asm__ volatile("fnstenv %0\n\tfldcw %2\n\tstmxcsr %1\n\tldmxcsr %3"
                         : "=m"(x87_), "=m"(mxcsr_)
                         : "m"(default_control), "m"(default_mxcsr)
                         : "memory");
    }
    ~FloatEnvironment() {
        __asm__ volatile("fldenv %0\n\tldmxcsr %1" : : "m"(x87_), "m"(mxcsr_) : "memory");
    }

private:
    struct X87 {
        uint32_t words[7];
    };
    X87 x87_;
    uint32_t mxcsr_;
#else
    FloatEnvironment() {
        std::fegetenv(&saved_);
        std::fesetenv(FE_DFL_ENV);
    }
    ~FloatEnvironment() {
        std::fesetenv(&saved_);
    }

private:
    std::fenv_t saved_;
#endif
};

} // namespace dm
