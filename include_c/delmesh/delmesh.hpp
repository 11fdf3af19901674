// SPDX-License-Identifier: Apache-2.0
//
// delmesh.hpp: the C interface with C++17 manners: handles that destroy themselves, errors as exceptions, callbacks as
// std::function, arrays as std::vector. Header only; calls nothing but the functions of delmesh.h, where the meaning of every
// field is told.
//
//     delmesh::Context context;
//     delmesh::Mesh in = context.create(positions, corners);     // std::vector<float>, std::vector<int32_t>
//     delmesh::Mesh out = context.remesh(in);
//     std::vector<float> p = out.positions<float>();
#ifndef DELMESH_HPP
#define DELMESH_HPP

#include <cstddef>
#include <cstdint>
#include <exception>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "delmesh.h"

namespace delmesh {

// What every failed call throws. what() is the library's sentence, or the status' name where there is none.
class Error : public std::runtime_error {
public:
    Error(int32_t status, const char* sentence)
        : std::runtime_error(sentence != nullptr && *sentence != 0 ? sentence : delmesh_status_name(status)), status_(status) {}
    int32_t status() const { return status_; }

private:
    int32_t status_;
};

inline void check(int32_t status, const char* sentence = nullptr) {
    if (status != DELMESH_OK) throw Error(status, sentence);
}

// ---- Structs that start out with their defaults -----------------------------------------------------------------------------

#define DELMESH_HPP_STRUCT(Name, name)                                         \
    struct Name : delmesh_##name {                                             \
        Name() { delmesh_##name##_init(this, sizeof(delmesh_##name)); }        \
    }
DELMESH_HPP_STRUCT(ContextOptions, context_options);
DELMESH_HPP_STRUCT(Layer, layer);
DELMESH_HPP_STRUCT(MeshDesc, mesh_desc);
DELMESH_HPP_STRUCT(MeshInfo, mesh_info);
DELMESH_HPP_STRUCT(RemeshOptions, remesh_options);
DELMESH_HPP_STRUCT(RemeshReport, remesh_report);
DELMESH_HPP_STRUCT(PreserveEstimate, preserve_estimate);
DELMESH_HPP_STRUCT(DecimateOptions, decimate_options);
DELMESH_HPP_STRUCT(LevelReport, level_report);
DELMESH_HPP_STRUCT(DecimateReport, decimate_report);
DELMESH_HPP_STRUCT(CertifyOptions, certify_options);
DELMESH_HPP_STRUCT(CertifyReport, certify_report);
DELMESH_HPP_STRUCT(QualityReport, quality_report);
DELMESH_HPP_STRUCT(DistanceOptions, distance_options);
DELMESH_HPP_STRUCT(DistanceReport, distance_report);
DELMESH_HPP_STRUCT(CageDesc, cage_desc);
DELMESH_HPP_STRUCT(SubdivideOptions, subdivide_options);
DELMESH_HPP_STRUCT(SubdivideReport, subdivide_report);
DELMESH_HPP_STRUCT(ReevaluateReport, reevaluate_report);
#undef DELMESH_HPP_STRUCT

// Of a level: target(DELMESH_TARGET_VERTICES, 500).
inline delmesh_target target(int32_t kind, double value = 0) { return {kind, 0, value}; }

// ---- Views ------------------------------------------------------------------------------------------------------------------

template <class T>
constexpr int32_t type_of = 0;
template <>
inline constexpr int32_t type_of<float> = DELMESH_FLOAT32;
template <>
inline constexpr int32_t type_of<double> = DELMESH_FLOAT64;
template <>
inline constexpr int32_t type_of<int32_t> = DELMESH_INT32;
template <>
inline constexpr int32_t type_of<uint32_t> = DELMESH_UINT32;
template <>
inline constexpr int32_t type_of<int64_t> = DELMESH_INT64;
template <>
inline constexpr int32_t type_of<uint8_t> = DELMESH_UINT8;

// `count` elements of `components` numbers; stride in bytes, 0 when packed.
template <class T>
delmesh_view view(const T* data, std::size_t count, int32_t components = 1, std::ptrdiff_t stride = 0) {
    static_assert(type_of<T> != 0, "not a number type of delmesh.h");
    return {data, static_cast<int64_t>(count), stride, type_of<T>, components};
}
template <class T>
delmesh_view view(const std::vector<T>& numbers, int32_t components = 1) {
    const auto width = static_cast<std::size_t>(components);
    if (components < 1 || numbers.size() % width != 0) throw std::invalid_argument("The vector did not hold whole elements.");
    return view(numbers.data(), numbers.size() / width, components);
}
template <class T>
delmesh_view_mut view_mut(T* data, std::size_t count, int32_t components = 1, std::ptrdiff_t stride = 0) {
    static_assert(type_of<T> != 0, "not a number type of delmesh.h");
    return {data, static_cast<int64_t>(count), stride, type_of<T>, components};
}

// Sparse rows, one per vertex: indices[k] and values[k] of vertex v for k from offsets[v] to offsets[v + 1].
template <class Value>
struct Rows {
    std::vector<int64_t> offsets;
    std::vector<int32_t> indices;
    std::vector<Value> values;
};

// ---- Mesh -------------------------------------------------------------------------------------------------------------------

class Mesh {
public:
    Mesh() = default;
    explicit Mesh(delmesh_mesh* handle) : handle_(handle) {} // takes it over
    delmesh_mesh* get() const { return handle_.get(); }
    explicit operator bool() const { return handle_ != nullptr; }

    MeshInfo info() const {
        MeshInfo result;
        check(delmesh_mesh_get_info(get(), &result));
        return result;
    }
    // The mesh's own array (DELMESH_POSITION ...), valid as long as the mesh.
    delmesh_view borrow(int32_t what) const {
        delmesh_view result{};
        check(delmesh_mesh_borrow(get(), what, &result));
        return result;
    }
    void read(int32_t what, const delmesh_view_mut& into) const { check(delmesh_mesh_read(get(), what, &into)); }
    // All numbers of an array, one element after the other.
    template <class T>
    std::vector<T> read(int32_t what) const {
        const Shape shape = shape_of(what);
        std::vector<T> numbers(shape.count * static_cast<std::size_t>(shape.components));
        read(what, view_mut(numbers.data(), shape.count, shape.components));
        return numbers;
    }
    // Of the layer with that number in MeshDesc::layers.
    int64_t layer_borders(int32_t layer) const {
        int64_t edges = 0;
        check(delmesh_mesh_layer_borders(get(), layer, &edges));
        return edges;
    }
    // How many elements a domain (DELMESH_DOMAIN_VERTEX ...) has.
    std::size_t count_of(int32_t domain) const {
        const MeshInfo counts = info();
        return static_cast<std::size_t>(domain == DELMESH_DOMAIN_VERTEX   ? counts.vertices
                                        : domain == DELMESH_DOMAIN_CORNER ? counts.corners
                                        : domain == DELMESH_DOMAIN_FACE   ? counts.faces
                                                                          : counts.edges);
    }
    template <class T>
    std::vector<T> positions() const { return read<T>(DELMESH_POSITION); }
    template <class T>
    std::vector<T> corners() const { return read<T>(DELMESH_CORNER_VERT); }

private:
    struct Shape {
        std::size_t count;
        int32_t components;
    };
    Shape shape_of(int32_t what) const {
        const MeshInfo counts = info();
        const auto verts = static_cast<std::size_t>(counts.vertices), faces = static_cast<std::size_t>(counts.faces),
                   edges = static_cast<std::size_t>(counts.edges);
        switch (what) {
        case DELMESH_POSITION:
        case DELMESH_VERT_MAP_VERT:
        case DELMESH_VERT_MAP_WEIGHT: return {verts, 3};
        case DELMESH_VERT_SOURCE:
        case DELMESH_VERT_JOIN:
        case DELMESH_VERT_PARENT: return {verts, 1};
        case DELMESH_FACE_SOURCE: return {faces, 1};
        case DELMESH_EDGE_VERT: return {edges, 2};
        case DELMESH_EDGE_FLAGS:
        case DELMESH_EDGE_SOURCE_EDGE: return {edges, 1};
        case DELMESH_CORNER_MAP_CORNER:
        case DELMESH_CORNER_MAP_WEIGHT: return {3 * faces, 3};
        default: return {3 * faces, 1};
        }
    }
    struct Destroy {
        void operator()(delmesh_mesh* mesh) const { delmesh_mesh_destroy(mesh); }
    };
    std::unique_ptr<delmesh_mesh, Destroy> handle_;
};

// ---- Cage -------------------------------------------------------------------------------------------------------------------

class Cage {
public:
    Cage() = default;
    explicit Cage(delmesh_cage* handle) : handle_(handle) {} // takes it over
    delmesh_cage* get() const { return handle_.get(); }
    explicit operator bool() const { return handle_ != nullptr; }

private:
    struct Destroy {
        void operator()(delmesh_cage* cage) const { delmesh_cage_destroy(cage); }
    };
    std::unique_ptr<delmesh_cage, Destroy> handle_;
};

// ---- Context ----------------------------------------------------------------------------------------------------------------

class Context {
public:
    using Progress = std::function<bool(double fraction, const char* stage)>; // false cancels, and so does an exception
    using Log = std::function<void(int32_t level, const char* text)>;

    // options.progress, .log and .user are the wrapper's own: set the functions below instead. With an allocator or a pool of the
    // host's, which need `user` too, use the C interface.
    explicit Context(const ContextOptions& options = ContextOptions()) : state_(std::make_unique<State>()) {
        delmesh_context_options own = options;
        own.user = state_.get();
        own.progress = [](void* user, double fraction, const char* stage) -> int32_t {
            State& state = *static_cast<State*>(user);
            bool go_on = true;
            state.guard([&] { go_on = !state.progress || state.progress(fraction, stage); });
            return go_on && state.thrown == nullptr ? DELMESH_CONTINUE : 0;
        };
        own.log = [](void* user, int32_t level, const char* text) {
            State& state = *static_cast<State*>(user);
            state.guard([&] { if (state.log) state.log(level, text); });
        };
        delmesh_context* made = nullptr;
        check(delmesh_context_create(&own, &made));
        handle_.reset(made);
    }
    delmesh_context* get() const { return handle_.get(); }
    void on_progress(Progress progress) { state_->progress = std::move(progress); }
    void on_log(Log log) { state_->log = std::move(log); }
    void cancel() { delmesh_cancel(get()); } // from any thread

    Mesh create(const MeshDesc& desc) {
        delmesh_mesh* made = nullptr;
        finish(delmesh_mesh_create(get(), &desc, &made));
        return Mesh(made);
    }
    // Triangles: x y z of each vertex, three vertex indices of each face.
    template <class Real, class Index>
    Mesh create(const std::vector<Real>& positions, const std::vector<Index>& corner_verts) {
        MeshDesc desc;
        desc.positions = view(positions, 3);
        desc.corner_verts = view(corner_verts);
        return create(desc);
    }
    // report is filled also when this throws.
    Mesh remesh(const Mesh& in, const RemeshOptions& options = RemeshOptions(), RemeshReport* report = nullptr) {
        delmesh_mesh* made = nullptr;
        finish(delmesh_remesh(get(), in.get(), &options, &made, report));
        return Mesh(made);
    }
    PreserveEstimate estimate_preserve(const Mesh& in, const RemeshOptions& options = RemeshOptions()) {
        PreserveEstimate estimate;
        finish(delmesh_estimate_preserve(get(), in.get(), &options, &estimate));
        return estimate;
    }
    // One mesh per target, finest first. levels: gets one report per target; both reports are filled also when this throws.
    std::vector<Mesh> lod_family(const Mesh& in, const std::vector<delmesh_target>& targets,
                                 const DecimateOptions& options = DecimateOptions(), std::vector<LevelReport>* levels = nullptr,
                                 DecimateReport* report = nullptr) {
        static_assert(sizeof(LevelReport) == sizeof(delmesh_level_report), "an array of one is an array of the other");
        if (targets.size() > INT32_MAX) throw std::invalid_argument("The vector held too many targets.");
        if (levels != nullptr) levels->assign(targets.size(), LevelReport());
        std::vector<delmesh_mesh*> made(targets.size());
        std::vector<Mesh> result(targets.size());
        const int32_t status = delmesh_lod_family(get(), in.get(), targets.data(), static_cast<int32_t>(targets.size()), &options,
                                                  made.data(), levels != nullptr ? levels->data() : nullptr, report);
        for (std::size_t i = 0; i < made.size(); ++i) result[i] = Mesh(made[i]);
        finish(status);
        return result;
    }
    Mesh decimate(const Mesh& in, const delmesh_target& target, const DecimateOptions& options = DecimateOptions(),
                  LevelReport* level = nullptr, DecimateReport* report = nullptr) {
        delmesh_mesh* made = nullptr;
        finish(delmesh_decimate(get(), in.get(), &target, &options, &made, level, report));
        return Mesh(made);
    }
    void transfer(const Mesh& mesh, int32_t domain, int32_t policy, const delmesh_view& source, const delmesh_view_mut& target) {
        finish(delmesh_transfer(get(), mesh.get(), domain, policy, &source, &target));
    }
    void transfer_fitted(const Mesh& in, const Mesh& mesh, int32_t domain, int32_t policy, const delmesh_view& source,
                         const delmesh_view_mut& target) {
        finish(delmesh_transfer_fitted(get(), in.get(), mesh.get(), domain, policy, &source, &target));
    }
    // A layer of the source, one element after the other, carried over to a mesh that was made from it.
    template <class T>
    std::vector<T> transfer(const Mesh& mesh, int32_t domain, int32_t policy, const std::vector<T>& source, int32_t components = 1) {
        const std::size_t count = mesh.count_of(domain);
        const delmesh_view from = view(source, components);
        std::vector<T> numbers(count * static_cast<std::size_t>(components));
        transfer(mesh, domain, policy, from, view_mut(numbers.data(), count, components));
        return numbers;
    }
    // The same so that it fits all over the surface; `in` is the source.
    template <class T>
    std::vector<T> transfer_fitted(const Mesh& in, const Mesh& mesh, int32_t domain, int32_t policy, const std::vector<T>& source,
                                   int32_t components = 1) {
        const std::size_t count = mesh.count_of(domain);
        const delmesh_view from = view(source, components);
        std::vector<T> numbers(count * static_cast<std::size_t>(components));
        transfer_fitted(in, mesh, domain, policy, from, view_mut(numbers.data(), count, components));
        return numbers;
    }
    template <class Value>
    Rows<Value> transfer_sparse(const Mesh& mesh, const Rows<Value>& source, int32_t limit, int32_t normalise) {
        const delmesh_rows from = {view(source.offsets), view(source.indices), view(source.values)};
        const std::size_t count = mesh.count_of(DELMESH_DOMAIN_VERTEX) + 1;
        Rows<Value> rows;
        rows.offsets.resize(count);
        delmesh_rows_mut to = {view_mut(rows.offsets.data(), count), {}, {}};
        finish(delmesh_transfer_sparse(get(), mesh.get(), &from, limit, normalise, &to)); // how many there are
        const auto entries = static_cast<std::size_t>(rows.offsets.back());
        rows.indices.resize(entries);
        rows.values.resize(entries);
        to.indices = view_mut(rows.indices.data(), entries);
        to.values = view_mut(rows.values.data(), entries);
        finish(delmesh_transfer_sparse(get(), mesh.get(), &from, limit, normalise, &to));
        return rows;
    }
    Cage create_cage(const CageDesc& desc) {
        delmesh_cage* made = nullptr;
        finish(delmesh_cage_create(get(), &desc, &made));
        return Cage(made);
    }
    Mesh subdivide(const Cage& cage, const SubdivideOptions& options = SubdivideOptions(), SubdivideReport* report = nullptr) {
        delmesh_mesh* made = nullptr;
        finish(delmesh_subdivide(get(), cage.get(), &options, &made, report));
        return Mesh(made);
    }
    // source: of a layer of corners that the cage was made with nullptr is its own values.
    void limit_values(const Cage& cage, const Mesh& mesh, int32_t domain, int32_t layer, const delmesh_view* source,
                      const delmesh_view_mut& target) {
        finish(delmesh_limit_values(get(), cage.get(), mesh.get(), domain, layer, source, &target));
    }
    void limit_normals(const Cage& cage, const Mesh& mesh, const delmesh_view* positions, const delmesh_view_mut& target) {
        finish(delmesh_limit_normals(get(), cage.get(), mesh.get(), positions, &target));
    }
    Mesh reevaluate(const Cage& cage, const Mesh& mesh, const delmesh_view& positions, ReevaluateReport* report = nullptr) {
        delmesh_mesh* made = nullptr;
        finish(delmesh_reevaluate(get(), cage.get(), mesh.get(), &positions, &made, report));
        return Mesh(made);
    }
    CertifyReport certify(const Mesh& mesh, const CertifyOptions& options = CertifyOptions()) {
        CertifyReport report;
        finish(delmesh_certify(get(), mesh.get(), &options, &report));
        return report;
    }
    QualityReport quality(const Mesh& mesh) {
        QualityReport report;
        finish(delmesh_measure_quality(get(), mesh.get(), &report));
        return report;
    }
    DistanceReport distance(const Mesh& a, const Mesh& b, const DistanceOptions& options = DistanceOptions()) {
        DistanceReport report;
        finish(delmesh_measure_distance(get(), a.get(), b.get(), &options, &report));
        return report;
    }
    void validate(const Mesh& mesh) { finish(delmesh_mesh_validate(get(), mesh.get())); }

private:
    struct State { // what the callbacks see; stays where it is when the context is moved
        Progress progress;
        Log log;
        std::exception_ptr thrown; // by a callback, on its way around the C frames
        template <class Call>
        void guard(Call&& call) noexcept {
            try {
                call();
            } catch (...) {
                thrown = std::current_exception();
            }
        }
    };
    void finish(int32_t status) {
        if (std::exception_ptr thrown = std::exchange(state_->thrown, nullptr); thrown && status == DELMESH_ERROR_CANCELLED)
            std::rethrow_exception(thrown);
        check(status, delmesh_last_error(get()));
    }
    struct Destroy {
        void operator()(delmesh_context* context) const { delmesh_context_destroy(context); }
    };
    std::unique_ptr<State> state_; // outlives the handle below
    std::unique_ptr<delmesh_context, Destroy> handle_;
};

} // namespace delmesh

#endif // DELMESH_HPP
