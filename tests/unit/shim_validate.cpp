// SPDX-License-Identifier: Apache-2.0
// The same interface as for the tests of build_mesh, compiled once more: each test links one shim.
#include "shim_build.cpp"
