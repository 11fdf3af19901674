// SPDX-License-Identifier: Apache-2.0
#include "api/names.h"

#include <cstddef>
#include <cstring>

#include "delmesh/delmesh.h"

namespace dm {

const char* status_name(int32_t status) {
    switch (status) {
#define DM_STATUS(name)                                                                                                          \
    case name:                                                                                                                   \
        return #name
        DM_STATUS(DELMESH_OK);
        DM_STATUS(DELMESH_ERROR_INVALID_ARGUMENT);
        DM_STATUS(DELMESH_ERROR_OUT_OF_MEMORY);
        DM_STATUS(DELMESH_ERROR_MEMORY_LIMIT);
        DM_STATUS(DELMESH_ERROR_ALLOCATION_LIMIT);
        DM_STATUS(DELMESH_ERROR_CANCELLED);
        DM_STATUS(DELMESH_ERROR_INDEX_OUT_OF_RANGE);
        DM_STATUS(DELMESH_ERROR_TOO_LARGE);
        DM_STATUS(DELMESH_ERROR_NO_SURFACE);
        DM_STATUS(DELMESH_ERROR_NON_ORIENTABLE);
        DM_STATUS(DELMESH_ERROR_STRICT);
        DM_STATUS(DELMESH_ERROR_VERTEX_LIMIT);
        DM_STATUS(DELMESH_ERROR_PRECISION);
        DM_STATUS(DELMESH_ERROR_UNSUPPORTED);
        DM_STATUS(DELMESH_ERROR_BUSY);
        DM_STATUS(DELMESH_ERROR_INTERNAL);
#undef DM_STATUS
    default:
        return "DELMESH_ERROR_UNKNOWN";
    }
}

uint32_t struct_size(const char* name) {
    if (name == nullptr) return 0;
#define DM_STRUCT(type)                                                                                                          \
    if (std::strcmp(name, #type) == 0) return sizeof(type);
#define DM_FIELD(type, member)
#include "api/fields.inc"
#undef DM_STRUCT
#undef DM_FIELD
    return 0;
}

uint32_t field_offset(const char* name) {
    if (name == nullptr) return UINT32_MAX;
#define DM_STRUCT(type)
#define DM_FIELD(type, member)                                                                                                   \
    if (std::strcmp(name, #type "." #member) == 0) return offsetof(type, member);
#include "api/fields.inc"
#undef DM_STRUCT
#undef DM_FIELD
    return UINT32_MAX;
}

} // namespace dm
