// SPDX-License-Identifier: Apache-2.0
#include "api/views.h"

namespace dm {

int64_t type_size(int32_t type) {
    switch (type) {
    case DELMESH_FLOAT32:
    case DELMESH_INT32:
    case DELMESH_UINT32: return 4;
    case DELMESH_FLOAT64:
    case DELMESH_INT64: return 8;
    case DELMESH_UINT8: return 1;
    default: return 0;
    }
}

const char* view_problem(const delmesh_view& view, uint32_t types, int32_t components) {
    const int64_t size = type_size(view.type);
    if (size == 0 || (types & type_bit(view.type)) == 0) return "had a type that is not taken here";
    if (view.components != components) return "had the wrong number of components";
    if (view.count < 0) return "had a negative count";
    if (view.count > 0 && view.data == nullptr) return "had no data";
    const int64_t stride = stride_of(view);
    if (stride < size * components) return "had a stride smaller than its elements";
    if (stride % size != 0 || reinterpret_cast<uintptr_t>(view.data) % static_cast<uint64_t>(size) != 0)
        return "was not aligned to its type";
    if (view.count > INT64_MAX / stride) return "was larger than the address space";
    return nullptr;
}

Status check_view(Context& context, const char* name, const delmesh_view& view, uint32_t types, int32_t components) {
    const char* problem = view_problem(view, types, components);
    if (problem == nullptr) return DELMESH_OK;
    return context.fail(DELMESH_ERROR_INVALID_ARGUMENT, "The view '%s' %s: type %d, components %d, count %lld, stride %lld.",
                        name, problem, view.type, view.components, static_cast<long long>(view.count),
                        static_cast<long long>(view.stride));
}

namespace {

Status check_count(Context& context, const char* name, int64_t count, int64_t most) {
    if (count <= most) return DELMESH_OK;
    return context.fail(DELMESH_ERROR_TOO_LARGE, "The view '%s' had %lld elements, more than %lld.", name,
                        static_cast<long long>(count), static_cast<long long>(most));
}

delmesh_view with_stride(delmesh_view view) {
    view.stride = stride_of(view);
    return view;
}

} // namespace

Status check_mesh(Context& context, const delmesh_mesh_desc& desc, MeshInput& out) {
    const bool offsets = is_given(desc.face_offsets), sizes = is_given(desc.face_sizes), marked = is_given(desc.marked_edges);
    const bool triples = !offsets && !sizes && desc.corner_verts.components == 3;
    DM_TRY(check_view(context, "positions", desc.positions, kFloatTypes, 3));
    DM_TRY(check_view(context, "corner_verts", desc.corner_verts, kIndexTypes, triples ? 3 : 1));
    if (offsets) DM_TRY(check_view(context, "face_offsets", desc.face_offsets, kIndexTypes, 1));
    if (sizes) DM_TRY(check_view(context, "face_sizes", desc.face_sizes, kIndexTypes | type_bit(DELMESH_UINT8), 1));
    if (marked) DM_TRY(check_view(context, "marked_edges", desc.marked_edges, kIndexTypes, 2));
    if (offsets && sizes)
        return context.fail(DELMESH_ERROR_INVALID_ARGUMENT, "Both 'face_offsets' and 'face_sizes' were given.");
    if (offsets && desc.face_offsets.count == 0)
        return context.fail(DELMESH_ERROR_INVALID_ARGUMENT, "The view 'face_offsets' was empty; F faces take F + 1 offsets.");

    DM_TRY(check_count(context, "positions", desc.positions.count, INT32_MAX));
    DM_TRY(check_count(context, "corner_verts", desc.corner_verts.count, triples ? INT32_MAX / 3 : INT32_MAX));
    DM_TRY(check_count(context, "face_offsets", desc.face_offsets.count, INT32_MAX));
    DM_TRY(check_count(context, "face_sizes", desc.face_sizes.count, INT32_MAX));
    if (!offsets && !sizes && !triples && desc.corner_verts.count % 3 != 0)
        return context.fail(DELMESH_ERROR_INVALID_ARGUMENT,
                            "The view 'corner_verts' had %lld corners, which are no whole triangles.",
                            static_cast<long long>(desc.corner_verts.count));

    out.positions = with_stride(desc.positions);
    out.corner_verts = with_stride(desc.corner_verts);
    out.face_offsets = with_stride(desc.face_offsets);
    out.face_sizes = with_stride(desc.face_sizes);
    out.marked_edges = with_stride(desc.marked_edges);
    out.weld = desc.weld == DELMESH_WELD_EXACT;
    out.strict = desc.strict == 1;
    return DELMESH_OK;
}

} // namespace dm
