// SPDX-License-Identifier: Apache-2.0
#include "shim_build.h"

#include "mesh/build.h"
#include "mesh/validate.h"

using namespace dm;

struct shim_mesh {
    shim_mesh(const delmesh_context_options& options, Memory* memory) : context(options, memory), mesh(*memory) {}
    Context context;
    Mesh mesh;
    Status status = DELMESH_OK;
};

namespace {

template <class Call>
void guarded(shim_mesh& m, Call&& call) {
    try {
        m.status = call();
    } catch (const AllocationFailure& failure) {
        m.status = failure.status;
    }
}

MeshInput input_of(const delmesh_mesh_desc& desc) {
    MeshInput input;
    input.positions = desc.positions;
    input.corner_verts = desc.corner_verts;
    input.face_offsets = desc.face_offsets;
    input.face_sizes = desc.face_sizes;
    input.marked_edges = desc.marked_edges;
    input.weld = desc.weld != 0;
    input.strict = desc.strict != 0;
    input.layer_count = desc.layer_count;
    for (int32_t i = 0; i < desc.layer_count; ++i) input.layers[i] = desc.layers[i];
    return input;
}

} // namespace

extern "C" {

shim_mesh* shim_mesh_make(const delmesh_context_options* options, const delmesh_mesh_desc* desc, int32_t cancel) {
    delmesh_context_options used{};
    if (options != nullptr) used = *options;
    Memory* const memory = Memory::create(used);
    shim_mesh* const m = new shim_mesh(used, memory);
    if (cancel != 0) m->context.request_cancel();
    guarded(*m, [&] { return build_mesh(m->context, input_of(*desc), m->mesh); });
    return m;
}

int32_t shim_mesh_status(const shim_mesh* m) {
    return m->status;
}
const char* shim_mesh_error(const shim_mesh* m) {
    return m->context.error_text();
}
uint64_t shim_mesh_peak(const shim_mesh* m) {
    return m->context.memory().peak();
}

delmesh_mesh_info shim_mesh_info(const shim_mesh* m) {
    const MeshCounts& n = m->mesh.counts;
    delmesh_mesh_info info{};
    info.vertices = m->mesh.vertices();
    info.faces = m->mesh.faces();
    info.corners = m->mesh.corners();
    info.edges = n.edges;
    info.boundary_edges = n.boundary_edges;
    info.isolated_vertices = n.isolated_vertices;
    info.components = n.components;
    info.boundary_loops = n.boundary_loops;
    info.euler_characteristic = n.euler_characteristic;
    info.polygons = n.polygons;
    info.welded_vertices = n.welded_vertices;
    info.degenerate_faces = n.degenerate_faces;
    info.duplicate_faces = n.duplicate_faces;
    info.non_finite_faces = n.non_finite_faces;
    info.reoriented_faces = n.reoriented_faces;
    info.nonmanifold_edges = n.nonmanifold_edges;
    info.nonmanifold_vertices = n.nonmanifold_vertices;
    info.copied_vertices = n.copied_vertices;
    info.unmatched_marked_edges = n.unmatched_marked_edges;
    return info;
}

shim_arrays shim_mesh_arrays(shim_mesh* m) {
    Mesh& a = m->mesh;
    static_assert(sizeof(CutSlot) == 2 * sizeof(int32_t));
    return {a.pos32.data(),       a.pos64.data(),       a.corner_vert.data(),
            a.corner_twin.data(), a.corner_bits.data(), reinterpret_cast<int32_t*>(a.cut_slots.data()),
            a.face_source.data(), a.vert_source.data(), a.vert_join.data(),
            a.pos32.size(),       a.pos64.size(),       a.corner_vert.size(),
            a.corner_twin.size(), a.corner_bits.size(), a.cut_slots.size(),
            a.face_source.size(), a.vert_source.size(), a.vert_join.size(),
            a.vertex_count,       a.first_split};
}

int32_t shim_mesh_validate(shim_mesh* m) {
    guarded(*m, [&] { return validate_mesh(m->context, m->mesh); });
    return m->status;
}

void shim_mesh_free(shim_mesh* m) {
    delete m;
}

void shim_mesh_set(shim_mesh* m, int32_t field, int32_t value) {
    switch (field) {
    case SHIM_VERTEX_COUNT:
        m->mesh.vertex_count = value;
        break;
    case SHIM_FIRST_SPLIT:
        m->mesh.first_split = value;
        break;
    default:
        m->mesh.precision = static_cast<Precision>(value);
        break;
    }
}

void shim_mesh_set_parents(shim_mesh* m, int32_t count, int32_t parent) {
    m->mesh.vert_parent.assign(count, 0);
    if (count > 0) m->mesh.vert_parent[count - 1] = parent;
}

void shim_mesh_shorten(shim_mesh* m, int32_t array) {
    Mesh& a = m->mesh;
    const auto shorten = [](auto& elements) { elements.resize_uninitialized(elements.size() - 1); };
    switch (array) {
    case 0:
        shorten(a.pos32);
        break;
    case 1:
        shorten(a.corner_vert);
        break;
    case 2:
        shorten(a.corner_twin);
        break;
    case 3:
        shorten(a.corner_bits);
        break;
    case 4:
        shorten(a.cut_slots);
        break;
    case 5:
        shorten(a.face_source);
        break;
    case 6:
        shorten(a.vert_source);
        break;
    default:
        shorten(a.vert_join);
        break;
    }
}

void shim_mesh_set_map(shim_mesh* m, int32_t field, int64_t i, double value) {
    Mesh& a = m->mesh;
    const auto identity = [](Array<int32_t>& array, int64_t size) {
        for (int64_t k = 0; array.size() < size; ++k) array.push_back(static_cast<int32_t>(k));
    };
    if (a.corner_places.empty()) a.corner_places.assign(2, {{0, 1, 2}, {0.5, 0.5, 0}});
    if (a.layers.empty()) {
        a.layers.push_back({DELMESH_LAYER_UV, 2, true, 0, 0, 0, 0});
        a.layer_values.assign(2 * a.corners(), 0);
    }
    identity(a.corner_map, a.corners());
    identity(a.edge_source, a.counts.edges);
    const auto number = static_cast<int32_t>(value);
    switch (field) {
    case SHIM_SOURCE_CORNERS:
        a.source_corners = number;
        break;
    case SHIM_SOURCE_EDGES:
        a.source_edges = number;
        break;
    case SHIM_CORNER_MAP:
        a.corner_map[i] = number;
        break;
    case SHIM_PLACE_CORNER:
        a.corner_places[i / 3].corner[i % 3] = number;
        break;
    case SHIM_PLACE_WEIGHT:
        a.corner_places[i / 3].weight[i % 3] = value;
        break;
    case SHIM_EDGE_SOURCE:
        a.edge_source[i] = number;
        break;
    case SHIM_LAYER_KIND:
        a.layers[i].kind = number;
        break;
    case SHIM_LAYER_COMPONENTS:
        a.layers[i].components = number;
        break;
    case SHIM_LAYER_FIRST:
        a.layers[i].first_value = number;
        break;
    default:
        a.has_map = value != 0;
        break;
    }
}

void shim_mesh_set_split(shim_mesh* m, int32_t vert, double weight0, double weight1, double weight2) {
    Mesh& a = m->mesh;
    a.first_split = a.vertex_count - 1;
    a.split_map.clear();
    a.split_map.push_back({{vert, vert, vert}, {weight0, weight1, weight2}});
    if (!a.vert_source.empty()) a.vert_source[a.first_split] = -1;
}

void shim_set_edge_bits(shim_mesh* m, int32_t p, int32_t q, uint16_t bits) {
    Mesh& mesh = m->mesh;
    if (mesh.corner_bits.empty()) mesh.corner_bits.assign(mesh.corners(), 0);
    for (int32_t c = 0; c < mesh.corners(); ++c) {
        const int32_t a = mesh.corner_vert[c], b = mesh.corner_vert[next_corner(c)];
        if ((a == p && b == q) || (a == q && b == p)) mesh.corner_bits[c] |= bits;
    }
}

} // extern "C"
