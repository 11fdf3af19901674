// SPDX-License-Identifier: Apache-2.0
// Each array of a mesh is one pass that writes through a strided view. A lent array that the mesh does not store is the same pass
// into memory of the mesh's own.
#include "api/arrays.h"

#include <algorithm>

#include "api/options.h"
#include "api/views.h"
#include "mesh/source_map.h"
#include "mesh/views.h"

namespace dm {
namespace {

// ---- What the arrays look like ----------------------------------------------------------------------------------------------

struct Shape {
    int64_t count; // elements
    int32_t components;
    int32_t type;         // as it is lent
    uint32_t types;       // as it can be read; 0: there is no such array
    const void* stored;   // where the mesh has it in this very form
    bool corners = false; // one number per corner: F x 3 will do as well as 3F x 1
};

Shape shape_of(const Mesh& mesh, int32_t what) {
    constexpr int32_t kInt = DELMESH_INT32;
    const int64_t verts = mesh.vertices(), faces = mesh.faces(), corners = mesh.corners(), edges = mesh.counts.edges;
    switch (what) {
    case DELMESH_POSITION:
        if (mesh.precision == Precision::f32) return {verts, 3, DELMESH_FLOAT32, kFloatTypes, mesh.pos32.data()};
        return {verts, 3, DELMESH_FLOAT64, kFloatTypes, mesh.pos64.data()};
    case DELMESH_CORNER_VERT:
        return {corners, 1, kInt, kIndexTypes, mesh.corner_vert.data(), true};
    case DELMESH_EDGE_VERT:
        return {edges, 2, kInt, kIndexTypes, nullptr};
    case DELMESH_CORNER_EDGE:
        return {corners, 1, kInt, kIndexTypes, nullptr, true};
    case DELMESH_FACE_SOURCE:
        return {faces, 1, kInt, kIndexTypes, mesh.face_source.data()};
    case DELMESH_VERT_SOURCE:
        return {verts, 1, kInt, kIndexTypes, mesh.vert_source.data()};
    case DELMESH_VERT_JOIN:
        return {verts, 1, kInt, kIndexTypes, mesh.vert_join.data()};
    case DELMESH_EDGE_FLAGS:
        return {edges, 1, kInt, kIndexTypes | type_bit(DELMESH_UINT8), nullptr};
    case DELMESH_VERT_MAP_VERT:
        return {verts, 3, kInt, kIndexTypes, nullptr};
    case DELMESH_VERT_MAP_WEIGHT:
        return {verts, 3, DELMESH_FLOAT64, kFloatTypes, nullptr};
    case DELMESH_CORNER_TWIN: // with cuts, the mesh's own has more than -1 on the boundary
        return {corners, 1, kInt, kIndexTypes, mesh.cut_slots.empty() ? mesh.corner_twin.data() : nullptr, true};
    case DELMESH_VERT_PARENT:
        return {verts, 1, kInt, kIndexTypes, mesh.vert_parent.data()};
    }
    if (mesh.has_map) switch (what) {
        case DELMESH_CORNER_MAP_CORNER:
            return {corners, 3, kInt, kIndexTypes, nullptr};
        case DELMESH_CORNER_MAP_WEIGHT:
            return {corners, 3, DELMESH_FLOAT64, kFloatTypes, nullptr};
        case DELMESH_EDGE_SOURCE_EDGE:
            return {edges, 1, kInt, kIndexTypes, mesh.edge_source.data()};
        }
    if (mesh.cage != 0) switch (what) {
        case DELMESH_CORNER_CAGE_FACE:
            return {corners, 1, kInt, kIndexTypes, nullptr, true};
        case DELMESH_CORNER_CAGE_PLACE:
            return {corners, 2, DELMESH_FLOAT32, kFloatTypes, nullptr};
        case DELMESH_VERT_CAGE_FACE:
            return {verts, 1, kInt, kIndexTypes, nullptr};
        case DELMESH_VERT_CAGE_PLACE:
            return {verts, 2, DELMESH_FLOAT32, kFloatTypes, nullptr};
        case DELMESH_FACE_CAGE_FACE:
            return {faces, 1, kInt, kIndexTypes, nullptr};
        }
    return {0, 0, 0, 0, nullptr};
}

// ---- Facts about edges and vertices -----------------------------------------------------------------------------------------

int32_t edge_flags(const Mesh& mesh, int32_t c) {
    const int32_t twin = mesh.corner_twin[c];
    return (mesh.corner_bits.empty() ? 0 : mesh.corner_bits[c] & ~kEdgeFrozen) | (twin < 0 ? DELMESH_EDGE_BOUNDARY : 0) |
           (is_cut(twin) ? DELMESH_EDGE_CUT : 0);
}

// Whether an unsigned type cannot hold an array, which has a -1 in it. All other indices fit all types of theirs.
bool has_negative(const Mesh& mesh, int32_t what) {
    if (what == DELMESH_VERT_CAGE_FACE) return mesh.counts.isolated_vertices != 0;
    const Array<int32_t>* const array = what == DELMESH_CORNER_TWIN        ? &mesh.corner_twin
                                        : what == DELMESH_VERT_SOURCE      ? &mesh.vert_source
                                        : what == DELMESH_VERT_PARENT      ? &mesh.vert_parent
                                        : what == DELMESH_EDGE_SOURCE_EDGE ? &mesh.edge_source
                                                                           : nullptr;
    return array != nullptr && std::any_of(array->begin(), array->end(), [](int32_t i) { return i < 0; });
}

// Flags are all that is read as uint8.
bool has_wide_flags(const Mesh& mesh) {
    constexpr EdgeBits kWide = static_cast<EdgeBits>(~0xff & ~kEdgeFrozen);
    return std::any_of(mesh.corner_bits.begin(), mesh.corner_bits.end(), [](EdgeBits bits) { return (bits & kWide) != 0; });
}

// ---- Passes -----------------------------------------------------------------------------------------------------------------

template <class T>
class Strided {
public:
    explicit Strided(const delmesh_view_mut& view)
        : data_(static_cast<unsigned char*>(view.data)), stride_(stride_of(as_view(view))), triples_(view.components == 3) {}
    T* element(int64_t i) const { return reinterpret_cast<T*>(data_ + i * stride_); }
    T& corner(int64_t c) const { return triples_ ? element(c / 3)[c % 3] : *element(c); }

private:
    unsigned char* data_;
    int64_t stride_;
    bool triples_;
};

template <class T>
void write_integers(const Mesh& mesh, int32_t what, const Strided<T>& out) {
    const int32_t verts = mesh.vertices(), faces = mesh.faces(), corners = mesh.corners();
    int64_t edge = 0;
    switch (what) {
    case DELMESH_CORNER_VERT:
        for (int32_t c = 0; c < corners; ++c) out.corner(c) = static_cast<T>(mesh.corner_vert[c]);
        break;
    case DELMESH_EDGE_VERT:
        for (int32_t c = 0; c < corners; ++c) {
            if (!is_first_of_edge(mesh, c)) continue;
            T* pair = out.element(edge++);
            pair[0] = static_cast<T>(mesh.corner_vert[c]);
            pair[1] = static_cast<T>(mesh.corner_vert[next_corner(c)]);
        }
        break;
    case DELMESH_CORNER_EDGE: // the first corner of an edge was written before its twin: read it back
        for (int32_t c = 0; c < corners; ++c)
            out.corner(c) = is_first_of_edge(mesh, c) ? static_cast<T>(edge++) : out.corner(mesh.corner_twin[c]);
        break;
    case DELMESH_FACE_SOURCE:
        for (int32_t f = 0; f < faces; ++f) *out.element(f) = static_cast<T>(source_of(mesh.face_source, f));
        break;
    case DELMESH_VERT_SOURCE:
        for (int32_t v = 0; v < verts; ++v) *out.element(v) = static_cast<T>(source_of(mesh.vert_source, v));
        break;
    case DELMESH_VERT_JOIN:
        for (int32_t v = 0; v < verts; ++v) *out.element(v) = static_cast<T>(source_of(mesh.vert_join, v));
        break;
    case DELMESH_VERT_PARENT:
        for (int32_t v = 0; v < verts; ++v) *out.element(v) = static_cast<T>(source_of(mesh.vert_parent, v));
        break;
    case DELMESH_EDGE_FLAGS:
        for (int32_t c = 0; c < corners; ++c)
            if (is_first_of_edge(mesh, c)) *out.element(edge++) = static_cast<T>(edge_flags(mesh, c));
        break;
    case DELMESH_VERT_MAP_VERT:
        for (int32_t v = 0; v < verts; ++v) {
            const VertexMap map = vertex_map(mesh, v);
            for (int k = 0; k < 3; ++k) out.element(v)[k] = static_cast<T>(map.vert[k]);
        }
        break;
    case DELMESH_CORNER_MAP_CORNER:
        for (int32_t c = 0; c < corners; ++c) {
            const CornerPlace place = corner_place(mesh, c);
            for (int k = 0; k < 3; ++k) out.element(c)[k] = static_cast<T>(place.corner[k]);
        }
        break;
    case DELMESH_EDGE_SOURCE_EDGE:
        for (; edge < mesh.counts.edges; ++edge) *out.element(edge) = static_cast<T>(source_of(mesh.edge_source, edge));
        break;
    case DELMESH_CORNER_CAGE_FACE:
        for (int32_t c = 0; c < corners; ++c) out.corner(c) = static_cast<T>(cage_place(mesh, c).face);
        break;
    case DELMESH_VERT_CAGE_FACE: // of corners from the last on, so that the first is what stays
        for (int32_t v = 0; v < verts; ++v) *out.element(v) = static_cast<T>(-1);
        for (int32_t c = corners - 1; c >= 0; --c) *out.element(mesh.corner_vert[c]) = static_cast<T>(cage_place(mesh, c).face);
        break;
    case DELMESH_FACE_CAGE_FACE:
        for (int32_t f = 0; f < faces; ++f) *out.element(f) = static_cast<T>(cage_face(mesh, f));
        break;
    case DELMESH_CORNER_TWIN:
        for (int32_t c = 0; c < corners; ++c) out.corner(c) = static_cast<T>(mesh.corner_twin[c] < 0 ? -1 : mesh.corner_twin[c]);
        break;
    }
}

template <class T, class Map>
void write_weights(int32_t count, Map&& map, const Strided<T>& out) {
    for (int32_t i = 0; i < count; ++i) {
        const auto place = map(i);
        for (int k = 0; k < 3; ++k) out.element(i)[k] = static_cast<T>(place.weight[k]);
    }
}

// Same type: copied bit for bit, so that the NaNs of unused vertices survive.
template <class From, class To>
void write_positions(const Array<From>& positions, const Strided<To>& out) {
    for (int64_t v = 0; v < positions.size() / 3; ++v) {
        const From* p = positions.data() + 3 * v;
        if constexpr (std::is_same_v<From, To>)
            std::memcpy(out.element(v), p, 3 * sizeof(To));
        else
            for (int k = 0; k < 3; ++k) out.element(v)[k] = static_cast<To>(p[k]);
    }
}

template <class T>
void write_cage_places(const Mesh& mesh, int32_t what, const Strided<T>& out) {
    const auto write = [&](int64_t i, float s, float t) {
        out.element(i)[0] = static_cast<T>(s);
        out.element(i)[1] = static_cast<T>(t);
    };
    const bool of_verts = what == DELMESH_VERT_CAGE_PLACE;
    for (int32_t v = 0; of_verts && v < mesh.vertices(); ++v) write(v, 0, 0);
    for (int32_t c = mesh.corners() - 1; c >= 0; --c)
        write(of_verts ? mesh.corner_vert[c] : c, cage_place(mesh, c).s, cage_place(mesh, c).t);
}

template <class T>
void write_floats(const Mesh& mesh, int32_t what, const Strided<T>& out) {
    if (what == DELMESH_VERT_MAP_WEIGHT)
        write_weights(
            mesh.vertices(), [&](int32_t v) { return vertex_map(mesh, v); }, out);
    else if (what == DELMESH_CORNER_MAP_WEIGHT)
        write_weights(
            mesh.corners(), [&](int32_t c) { return corner_place(mesh, c); }, out);
    else if (what == DELMESH_CORNER_CAGE_PLACE || what == DELMESH_VERT_CAGE_PLACE)
        write_cage_places(mesh, what, out);
    else if (mesh.precision == Precision::f32)
        write_positions(mesh.pos32, out);
    else
        write_positions(mesh.pos64, out);
}

void write_array(const Mesh& mesh, int32_t what, const delmesh_view_mut& dst) {
    if (dst.type == DELMESH_FLOAT32)
        write_floats(mesh, what, Strided<float>(dst));
    else if (dst.type == DELMESH_FLOAT64)
        write_floats(mesh, what, Strided<double>(dst));
    else
        with_index_type(dst.type, [&](auto t) { write_integers(mesh, what, Strided<decltype(t)>(dst)); });
}

} // namespace

Status read_info(const delmesh_mesh& handle, delmesh_mesh_info* info) {
    if (info == nullptr || !is_struct_size(info->struct_size)) return DELMESH_ERROR_INVALID_ARGUMENT;
    Report result(info);
    delmesh_mesh_info& r = result.value;
    const Mesh& mesh = handle.mesh;
    const MeshCounts& counts = mesh.counts;
    r.precision = static_cast<int32_t>(mesh.precision);
    r.vertices = mesh.vertices();
    r.faces = mesh.faces();
    r.corners = mesh.corners();
    r.edges = counts.edges;
    r.boundary_edges = counts.boundary_edges;
    r.isolated_vertices = counts.isolated_vertices;
    r.components = counts.components;
    r.boundary_loops = counts.boundary_loops;
    r.euler_characteristic = counts.euler_characteristic;
    r.polygons = counts.polygons;
    r.welded_vertices = counts.welded_vertices;
    r.degenerate_faces = counts.degenerate_faces;
    r.duplicate_faces = counts.duplicate_faces;
    r.non_finite_faces = counts.non_finite_faces;
    r.reoriented_faces = counts.reoriented_faces;
    r.nonmanifold_edges = counts.nonmanifold_edges;
    r.nonmanifold_vertices = counts.nonmanifold_vertices;
    r.copied_vertices = counts.copied_vertices;
    r.unmatched_marked_edges = counts.unmatched_marked_edges;
    return DELMESH_OK;
}

Status read_array(const delmesh_mesh& mesh, int32_t what, const delmesh_view_mut& dst) {
    const Shape shape = shape_of(mesh.mesh, what);
    const bool triples = shape.corners && dst.components == 3;
    if (view_problem(as_view(dst), shape.types, triples ? 3 : shape.components) != nullptr) return DELMESH_ERROR_INVALID_ARGUMENT;
    if (dst.count != (triples ? shape.count / 3 : shape.count)) return DELMESH_ERROR_INVALID_ARGUMENT;
    if (dst.type == DELMESH_UINT32 && has_negative(mesh.mesh, what)) return DELMESH_ERROR_TOO_LARGE;
    if (dst.type == DELMESH_UINT8 && has_wide_flags(mesh.mesh)) return DELMESH_ERROR_TOO_LARGE;
    const int64_t element = type_size(dst.type) * dst.components;
    if (shape.stored != nullptr && dst.count != 0 && dst.type == shape.type && stride_of(as_view(dst)) == element)
        std::memcpy(dst.data, shape.stored, static_cast<size_t>(dst.count * element));
    else
        write_array(mesh.mesh, what, dst);
    return DELMESH_OK;
}

Status borrow_array(const delmesh_mesh& mesh, int32_t what, delmesh_view& out) {
    out = {};
    const Shape shape = shape_of(mesh.mesh, what);
    if (shape.types == 0) return DELMESH_ERROR_INVALID_ARGUMENT;
    delmesh_view view{shape.stored, shape.count, shape.components * type_size(shape.type), shape.type, shape.components};
    if (view.data == nullptr && view.count != 0) {
        delmesh_mesh::Derived& derived = mesh.derived[what];
        view.data = derived.data.load(std::memory_order_acquire);
        if (view.data == nullptr) {
            const std::lock_guard<std::mutex> lock(mesh.derive);
            view.data = derived.data.load(std::memory_order_relaxed);
            if (view.data == nullptr) {
                derived.bytes = static_cast<size_t>(view.count * view.stride);
                void* made = mesh.memory.allocate(derived.bytes);
                write_array(mesh.mesh, what, {made, view.count, view.stride, view.type, view.components});
                derived.data.store(made, std::memory_order_release);
                view.data = made;
            }
        }
    }
    out = view;
    return DELMESH_OK;
}

void write_indices(const Array<int32_t>& values, const delmesh_view_mut& dst) {
    const int64_t count = values.size() < dst.count ? values.size() : dst.count;
    with_index_type(dst.type, [&](auto t) {
        const Strided<decltype(t)> out(dst);
        for (int64_t i = 0; i < count; ++i) *out.element(i) = static_cast<decltype(t)>(values[i]);
    });
}

void write_edges(const Mesh& mesh, const Array<int32_t>& corners, const delmesh_view_mut& dst) {
    const int64_t count = corners.size() < dst.count ? corners.size() : dst.count;
    with_index_type(dst.type, [&](auto t) {
        const Strided<decltype(t)> out(dst);
        for (int64_t i = 0; i < count; ++i) {
            out.element(i)[0] = static_cast<decltype(t)>(mesh.corner_vert[corners[i]]);
            out.element(i)[1] = static_cast<decltype(t)>(mesh.corner_vert[next_corner(corners[i])]);
        }
    });
}

} // namespace dm
