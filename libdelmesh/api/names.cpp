// SPDX-License-Identifier: Apache-2.0
#include "api/names.h"

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
    if (std::strcmp(name, #type) == 0) return sizeof(type)
    DM_STRUCT(delmesh_view);
    DM_STRUCT(delmesh_view_mut);
    DM_STRUCT(delmesh_context_options);
    DM_STRUCT(delmesh_mesh_desc);
    DM_STRUCT(delmesh_mesh_info);
    DM_STRUCT(delmesh_remesh_options);
    DM_STRUCT(delmesh_remesh_report);
    DM_STRUCT(delmesh_certify_options);
    DM_STRUCT(delmesh_certify_report);
    DM_STRUCT(delmesh_quality_report);
    DM_STRUCT(delmesh_distance_options);
    DM_STRUCT(delmesh_distance_report);
    DM_STRUCT(delmesh_preserve_estimate);
    DM_STRUCT(delmesh_target);
    DM_STRUCT(delmesh_decimate_options);
    DM_STRUCT(delmesh_level_report);
    DM_STRUCT(delmesh_decimate_report);
    DM_STRUCT(delmesh_api);
#undef DM_STRUCT
    return 0;
}

} // namespace dm
