// SPDX-License-Identifier: Apache-2.0
#include "api/views.h"

#include <cstdio>

#include "api/options.h"

namespace dm {

int64_t type_size(int32_t type) {
    switch (type) {
    case DELMESH_FLOAT32:
    case DELMESH_INT32:
    case DELMESH_UINT32:
        return 4;
    case DELMESH_FLOAT64:
    case DELMESH_INT64:
        return 8;
    case DELMESH_UINT8:
        return 1;
    default:
        return 0;
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

Status check_layers(Context& context, const delmesh_mesh_desc& desc, int64_t corners, int64_t faces, MeshInput& out) {
    constexpr uint32_t kIdTypes = type_bit(DELMESH_INT32) | type_bit(DELMESH_UINT32) | type_bit(DELMESH_UINT8);
    constexpr int32_t kMostComponents = 16;
    if (desc.layer_count > 0 && desc.layers == nullptr)
        return context.fail(DELMESH_ERROR_INVALID_ARGUMENT, "The argument 'layers' was NULL, and 'layer_count' %d.",
                            desc.layer_count);
    out.layer_count = desc.layer_count;
    for (int32_t i = 0; i < desc.layer_count; ++i) {
        const uint32_t size = desc.layers->struct_size; // all have it, so that it is the way to the next
        const char* const at = reinterpret_cast<const char*>(desc.layers) + static_cast<int64_t>(i) * size;
        delmesh_layer& layer = out.layers[i];
        DM_TRY(read_options(context, i, reinterpret_cast<const delmesh_layer*>(at), layer));
        char name[32];
        std::snprintf(name, sizeof name, "layers[%d].values", i);
        const bool of_faces = layer.kind >= DELMESH_LAYER_MATERIAL;
        const delmesh_view& values = layer.values;
        const bool fits = values.components >= 1 && values.components <= (of_faces ? 1 : kMostComponents);
        DM_TRY(check_view(context, name, values, of_faces ? kIdTypes : kIdTypes | kFloatTypes, fits ? values.components : 1));
        if (layer.kind == DELMESH_LAYER_UV && values.components != 2 && values.components != 3)
            return context.fail(DELMESH_ERROR_INVALID_ARGUMENT, "The view '%s' had %d components; UV maps have 2 or 3.", name,
                                values.components);
        if (values.count != (of_faces ? faces : corners))
            return context.fail(DELMESH_ERROR_INVALID_ARGUMENT, "The view '%s' had %lld elements, and there were %lld %s.", name,
                                static_cast<long long>(values.count), static_cast<long long>(of_faces ? faces : corners),
                                of_faces ? "faces" : "corners");
        layer.values = with_stride(values);
        if (layer.border == DELMESH_BORDER_DEFAULT) {
            const bool free = layer.kind == DELMESH_LAYER_NORMAL || layer.kind == DELMESH_LAYER_COLOR;
            layer.border = free ? DELMESH_BORDER_FREE : DELMESH_BORDER_KEEP;
        }
    }
    return DELMESH_OK;
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
    if (offsets && sizes) return context.fail(DELMESH_ERROR_INVALID_ARGUMENT, "Both 'face_offsets' and 'face_sizes' were given.");
    if (offsets && desc.face_offsets.count == 0)
        return context.fail(DELMESH_ERROR_INVALID_ARGUMENT, "The view 'face_offsets' was empty; F faces take F + 1 offsets.");

    const bool edges = is_given(desc.edge_verts), marks = is_given(desc.edge_marks);
    if (edges) DM_TRY(check_view(context, "edge_verts", desc.edge_verts, kIndexTypes, 2));
    if (marks) DM_TRY(check_view(context, "edge_marks", desc.edge_marks, kIndexTypes | type_bit(DELMESH_UINT8), 1));
    if (marks && desc.edge_marks.count != (edges ? desc.edge_verts.count : 0))
        return context.fail(
            DELMESH_ERROR_INVALID_ARGUMENT, "The view 'edge_marks' had %lld elements, and 'edge_verts' %lld edges.",
            static_cast<long long>(desc.edge_marks.count), static_cast<long long>(edges ? desc.edge_verts.count : 0));

    DM_TRY(check_count(context, "positions", desc.positions.count, INT32_MAX));
    DM_TRY(check_count(context, "corner_verts", desc.corner_verts.count, triples ? INT32_MAX / 3 : INT32_MAX));
    DM_TRY(check_count(context, "face_offsets", desc.face_offsets.count, INT32_MAX));
    DM_TRY(check_count(context, "face_sizes", desc.face_sizes.count, INT32_MAX));
    DM_TRY(check_count(context, "edge_verts", desc.edge_verts.count, INT32_MAX));
    if (!offsets && !sizes && !triples && desc.corner_verts.count % 3 != 0)
        return context.fail(DELMESH_ERROR_INVALID_ARGUMENT,
                            "The view 'corner_verts' had %lld corners, which are no whole triangles.",
                            static_cast<long long>(desc.corner_verts.count));

    out.positions = with_stride(desc.positions);
    out.corner_verts = with_stride(desc.corner_verts);
    out.face_offsets = with_stride(desc.face_offsets);
    out.face_sizes = with_stride(desc.face_sizes);
    out.marked_edges = with_stride(desc.marked_edges);
    out.edge_verts = with_stride(desc.edge_verts);
    out.edge_marks = with_stride(desc.edge_marks);
    out.weld = desc.weld == DELMESH_WELD_EXACT;
    out.strict = desc.strict == 1;
    const int64_t corners = desc.corner_verts.count * desc.corner_verts.components;
    return check_layers(context, desc, corners,
                        offsets ? desc.face_offsets.count - 1
                        : sizes ? desc.face_sizes.count
                                : corners / 3,
                        out);
}

} // namespace dm
