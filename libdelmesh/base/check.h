// SPDX-License-Identifier: Apache-2.0
// DM_ASSERT states what the code relies on. It is checked in debug and sanitizer builds (DELMESH_DEBUG_CHECKS) and costs nothing
// elsewhere. Never for the caller's mistakes: those get a status.
#pragma once

#if defined(DELMESH_DEBUG_CHECKS)
#define DM_ASSERT(condition) ((condition) ? (void)0 : __builtin_trap())
#else
#define DM_ASSERT(condition) ((void)0)
#endif
