# SPDX-License-Identifier: Apache-2.0
# Toolchain: the library for another system, by the clang that the Python package ziglang carries together with the headers and
# libraries of every system below.
#     cmake -DCMAKE_TOOLCHAIN_FILE=cmake/zig.cmake -DDELMESH_ZIG=/path/to/zig -DDELMESH_ZIG_TARGET=aarch64-linux-gnu.2.28 ...
# Targets: x86_64 or aarch64, then -linux-gnu.2.28, -windows-gnu or -macos.11.0. scripts/build-wheels uses it.
list(APPEND CMAKE_TRY_COMPILE_PLATFORM_VARIABLES DELMESH_ZIG DELMESH_ZIG_TARGET)
if(NOT DELMESH_ZIG_TARGET MATCHES "^([^-]+)-(linux|windows|macos)")
  message(FATAL_ERROR "DELMESH_ZIG_TARGET was '${DELMESH_ZIG_TARGET}'")
endif()
set(CMAKE_SYSTEM_PROCESSOR ${CMAKE_MATCH_1})
if(CMAKE_MATCH_2 STREQUAL linux)
  set(CMAKE_SYSTEM_NAME Linux)
elseif(CMAKE_MATCH_2 STREQUAL windows)
  set(CMAKE_SYSTEM_NAME Windows)
else()
  set(CMAKE_SYSTEM_NAME Darwin)
endif()

# Without -mcpu zig would take the target's plain baseline too; said here so that no default of another version changes the code.
set(arguments -target ${DELMESH_ZIG_TARGET} -mcpu=baseline)
set(CMAKE_C_COMPILER ${DELMESH_ZIG} cc ${arguments})
set(CMAKE_CXX_COMPILER ${DELMESH_ZIG} c++ ${arguments})
set(CMAKE_AR llvm-ar) # binutils' tools know this system's object files only
set(CMAKE_RANLIB llvm-ranlib)
set(CMAKE_NM llvm-nm)
set(CMAKE_RC_COMPILER ${DELMESH_ZIG}) # asked for on Windows; there is nothing for it to compile
foreach(kind SHARED_LINKER EXE_LINKER)
  set(CMAKE_${kind}_FLAGS_INIT -s) # zig adds what debuggers want, ten times the size of the rest
endforeach()
# On macOS the name by which a library is linked, instead of the build folder's
set(CMAKE_INSTALL_NAME_DIR @rpath)
set(CMAKE_BUILD_WITH_INSTALL_NAME_DIR ON)

# What runs the tests, where this system does not do so by itself
if(CMAKE_SYSTEM_NAME STREQUAL Windows)
  set(CMAKE_CROSSCOMPILING_EMULATOR wine)
elseif(CMAKE_SYSTEM_NAME STREQUAL Linux AND NOT CMAKE_SYSTEM_PROCESSOR STREQUAL CMAKE_HOST_SYSTEM_PROCESSOR)
  set(CMAKE_CROSSCOMPILING_EMULATOR qemu-${CMAKE_SYSTEM_PROCESSOR} -L /usr/${CMAKE_SYSTEM_PROCESSOR}-linux-gnu)
endif()
