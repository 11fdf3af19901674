// SPDX-License-Identifier: Apache-2.0
// The C++ runtime that is linked into the library allocates 72 KiB for exceptions at load and would leave them behind at each
// unload: give them back. Only then: the pool of a shared runtime belongs to everybody.
#if defined(DELMESH_STATIC_RUNTIME)

namespace __gnu_cxx {
__attribute__((weak)) void __freeres(); // libstdc++'s own hook for this purpose; other runtimes have none
}

namespace {
__attribute__((destructor)) void free_runtime() {
    if (__gnu_cxx::__freeres != nullptr) __gnu_cxx::__freeres();
}
} // namespace

#endif
