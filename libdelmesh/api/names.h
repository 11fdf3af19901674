// SPDX-License-Identifier: Apache-2.0
// Look-ups by number and by name.
#pragma once

#include <cstdint>

namespace dm {

const char* status_name(int32_t status);
uint32_t struct_size(const char* name);  // 0 for unknown names
uint32_t field_offset(const char* name); // of "struct.member"; UINT32_MAX for unknown names

} // namespace dm
