// SPDX-License-Identifier: Apache-2.0
// The caller's strided arrays: checked before anything is read or written through them.
#pragma once

#include "base/context.h"
#include "mesh/build.h"

namespace dm {

constexpr uint32_t type_bit(int32_t type) { return 1u << type; }
constexpr uint32_t kFloatTypes = type_bit(DELMESH_FLOAT32) | type_bit(DELMESH_FLOAT64);
constexpr uint32_t kIndexTypes = type_bit(DELMESH_INT32) | type_bit(DELMESH_UINT32) | type_bit(DELMESH_INT64);

int64_t type_size(int32_t type); // 0 for unknown types

inline bool is_given(const delmesh_view& view) {
    return view.data != nullptr || view.count != 0 || view.stride != 0 || view.type != 0 || view.components != 0;
}
inline delmesh_view as_view(const delmesh_view_mut& view) {
    return {view.data, view.count, view.stride, view.type, view.components};
}
inline int64_t stride_of(const delmesh_view& view) {
    return view.stride != 0 ? view.stride : type_size(view.type) * view.components;
}

// With the stride that 0 stands for.
inline delmesh_view with_stride(delmesh_view view) {
    view.stride = stride_of(view);
    return view;
}
inline delmesh_view_mut with_stride(delmesh_view_mut view) {
    view.stride = stride_of(as_view(view));
    return view;
}

// What is wrong with a view that must have one of `types` and so many components, as the end of a sentence; or nullptr.
const char* view_problem(const delmesh_view& view, uint32_t types, int32_t components);
// The same as a status with a sentence.
Status check_view(Context& context, const char* name, const delmesh_view& view, uint32_t types, int32_t components);

// The shape of a whole mesh description; the contents are build_mesh's business. On success every given view has its stride.
Status check_mesh(Context& context, const delmesh_mesh_desc& desc, MeshInput& out);

} // namespace dm
