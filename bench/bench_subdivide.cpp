// SPDX-License-Identifier: Apache-2.0
// bench_subdivide: what a cage's limit surface costs, through the C interface, beside OpenSubdiv's own uniform refinement where
// that can be linked; and another pose of what was made of it, beside making it anew.
//     bench_subdivide [--rate N] [--levels N] [--mode preserve|flip] [--threads N] [--repeat N] CAGE...
// Rate: if not told, the power of two that comes nearest to a million triangles (the peer has no others). Creases, corners and
// holes are those of the file; layers are left out, which the peer would not have. Times are processor time, the fastest
// repetition; what is compared takes turns.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <memory>
#include <string_view>
#include <vector>

#include <delmesh/delmesh.h>
extern "C" {
#include "mesh_file.h"
}
#ifdef BENCH_OPENSUBDIV
#include <opensubdiv/far/primvarRefiner.h>
#include <opensubdiv/far/topologyDescriptor.h>
#include <opensubdiv/far/topologyRefinerFactory.h>
#endif

namespace {

struct Settings {
    int rate = 0, levels = 10, threads = 1, repeat = 5;
    int32_t mode = DELMESH_MODE_PRESERVE; // of the remesh
};

double cpu_now() {
    timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

// The fastest of several runs.
struct Fastest {
    double seconds = HUGE_VAL;
    template <class Work>
    bool run(Work&& work) {
        const double begin = cpu_now();
        const bool ok = work();
        seconds = std::min(seconds, cpu_now() - begin);
        return ok;
    }
};

// ---- The cage ---------------------------------------------------------------------------------------------------------------

struct Cage {
    std::vector<float> positions;
    std::vector<int32_t> corners, sizes, crease_edges, sharp_verts, holes;
    std::vector<float> crease_sharpness, vert_sharpness;
    int32_t verts() const { return static_cast<int32_t>(positions.size() / 3); }
    int32_t faces() const { return static_cast<int32_t>(sizes.size()); }
    int64_t triangles(int64_t rate) const {
        int64_t sum = 0;
        for (const int32_t size : sizes) sum += size == 4 ? 2 * rate * rate : size * rate * rate / 2;
        return sum;
    }
};

bool read_cage(const char* path, Cage& cage) {
    MeshFile file;
    Failure failure = {nullptr, ""};
    if (!mesh_file_read(path, true, &file, &failure)) return std::fprintf(stderr, "%s\n", failure.text), false;
    for (int64_t i = 0; i < 3 * file.vertex_count; ++i)
        cage.positions.push_back(file.precision == DELMESH_FLOAT32
                                     ? static_cast<const float*>(file.positions)[i]
                                     : static_cast<float>(static_cast<const double*>(file.positions)[i]));
    cage.corners.assign(file.corner_verts, file.corner_verts + file.corner_count);
    for (int64_t f = 0; f < file.face_count; ++f) cage.sizes.push_back(file.face_sizes != nullptr ? file.face_sizes[f] : 3);
    const auto take = [](const SharpList& list, int32_t width, std::vector<int32_t>& verts, std::vector<float>* sharpness) {
        for (int64_t i = 0; i < list.count * width; ++i) verts.push_back(static_cast<int32_t>(list.verts[i]));
        for (int64_t i = 0; sharpness != nullptr && i < list.count; ++i)
            sharpness->push_back(static_cast<float>(list.sharpness[i]));
    };
    take(file.tags.creases, 2, cage.crease_edges, &cage.crease_sharpness);
    take(file.tags.corners, 1, cage.sharp_verts, &cage.vert_sharpness);
    take(file.tags.holes, 1, cage.holes, nullptr);
    mesh_file_free(&file);
    return true;
}

// ---- The library ------------------------------------------------------------------------------------------------------------

struct DestroyContext {
    void operator()(delmesh_context* context) const { delmesh_context_destroy(context); }
};
struct DestroyMesh {
    void operator()(delmesh_mesh* mesh) const { delmesh_mesh_destroy(mesh); }
};
struct DestroyCage {
    void operator()(delmesh_cage* cage) const { delmesh_cage_destroy(cage); }
};
using Mesh = std::unique_ptr<delmesh_mesh, DestroyMesh>;
using Levels = std::vector<Mesh>;

class Library {
public:
    explicit Library(int threads) {
        delmesh_context_options options;
        delmesh_context_options_init(&options, sizeof options);
        options.max_threads = threads;
        delmesh_context* made = nullptr;
        delmesh_context_create(&options, &made);
        context_.reset(made);
    }

    // From the cage's arrays to the handle.
    bool create(const Cage& cage) {
        delmesh_cage_desc desc;
        delmesh_cage_desc_init(&desc, sizeof desc);
        const auto view = [](const auto& of, int32_t type, int32_t components) {
            return delmesh_view{of.data(), static_cast<int64_t>(of.size()) / components, 0, type, components};
        };
        desc.positions = view(cage.positions, DELMESH_FLOAT32, 3);
        desc.corner_verts = view(cage.corners, DELMESH_INT32, 1);
        desc.face_sizes = view(cage.sizes, DELMESH_INT32, 1);
        if (!cage.crease_edges.empty()) {
            desc.crease_edges = view(cage.crease_edges, DELMESH_INT32, 2);
            desc.crease_sharpness = view(cage.crease_sharpness, DELMESH_FLOAT32, 1);
        }
        if (!cage.sharp_verts.empty()) {
            desc.sharp_verts = view(cage.sharp_verts, DELMESH_INT32, 1);
            desc.vert_sharpness = view(cage.vert_sharpness, DELMESH_FLOAT32, 1);
        }
        if (!cage.holes.empty()) desc.holes = view(cage.holes, DELMESH_INT32, 1);
        delmesh_cage* made = nullptr;
        const bool ok = check(delmesh_cage_create(context_.get(), &desc, &made));
        cage_.reset(made);
        return ok;
    }
    bool subdivide(int32_t rate, Mesh& out) {
        delmesh_subdivide_options options;
        delmesh_subdivide_options_init(&options, sizeof options);
        options.value = rate;
        delmesh_mesh* made = nullptr;
        const bool ok = check(delmesh_subdivide(context_.get(), cage_.get(), &options, &made, nullptr));
        out.reset(made);
        return ok;
    }
    bool remesh(const delmesh_mesh* dense, int32_t mode, Mesh& out) {
        delmesh_remesh_options options;
        delmesh_remesh_options_init(&options, sizeof options);
        options.mode = mode;
        options.map = 1;
        delmesh_mesh* made = nullptr;
        const bool ok = check(delmesh_remesh(context_.get(), dense, &options, &made, nullptr));
        out.reset(made);
        return ok;
    }
    // All of the dense mesh, then half of it, a quarter...
    bool family(const delmesh_mesh* dense, int count, Levels& out) {
        std::vector<delmesh_target> targets(1, {DELMESH_TARGET_FULL, 0, 0});
        for (double ratio = 0.5; static_cast<int>(targets.size()) < count; ratio /= 2)
            targets.push_back({DELMESH_TARGET_RATIO, 0, ratio});
        delmesh_decimate_options options;
        delmesh_decimate_options_init(&options, sizeof options);
        options.map = 1;
        std::vector<delmesh_mesh*> made(targets.size(), nullptr);
        const bool ok =
            check(delmesh_lod_family(context_.get(), dense, targets.data(), count, &options, made.data(), nullptr, nullptr));
        out.clear();
        for (delmesh_mesh* level : made) out.emplace_back(level);
        return ok;
    }
    // With the certificate.
    bool pose(const delmesh_mesh* mesh, const std::vector<float>& positions, delmesh_reevaluate_report& report) {
        const delmesh_view view = {positions.data(), static_cast<int64_t>(positions.size() / 3), 0, DELMESH_FLOAT32, 3};
        delmesh_reevaluate_report_init(&report, sizeof report);
        delmesh_mesh* made = nullptr;
        const bool ok = check(delmesh_reevaluate(context_.get(), cage_.get(), mesh, &view, &made, &report));
        Mesh moved(made);
        return ok && (positions_of(moved.get()), true);
    }
    // What a host does with a mesh.
    std::vector<float> positions_of(const delmesh_mesh* mesh) const {
        std::vector<float> positions(static_cast<size_t>(3 * info(mesh).vertices));
        const delmesh_view_mut view = {positions.data(), info(mesh).vertices, 0, DELMESH_FLOAT32, 3};
        delmesh_mesh_read(mesh, DELMESH_POSITION, &view);
        return positions;
    }
    std::vector<int32_t> corners_of(const delmesh_mesh* mesh) const {
        std::vector<int32_t> corners(static_cast<size_t>(info(mesh).corners));
        const delmesh_view_mut view = {corners.data(), info(mesh).corners, 0, DELMESH_INT32, 1};
        delmesh_mesh_read(mesh, DELMESH_CORNER_VERT, &view);
        return corners;
    }
    static delmesh_mesh_info info(const delmesh_mesh* mesh) {
        delmesh_mesh_info of;
        delmesh_mesh_info_init(&of, sizeof of);
        delmesh_mesh_get_info(mesh, &of);
        return of;
    }
    uint64_t peak() const {
        uint64_t bytes = 0;
        delmesh_context_memory(context_.get(), nullptr, &bytes, nullptr);
        return bytes;
    }

private:
    bool check(int32_t status) const {
        if (status == DELMESH_OK) return true;
        std::fprintf(stderr, "%s: %s\n", delmesh_status_name(status), delmesh_last_error(context_.get()));
        return false;
    }
    std::unique_ptr<delmesh_context, DestroyContext> context_;
    std::unique_ptr<delmesh_cage, DestroyCage> cage_;
};

// ---- The peer ---------------------------------------------------------------------------------------------------------------

#ifdef BENCH_OPENSUBDIV
struct Point {
    float x[3];
    void Clear(void* = nullptr) { x[0] = x[1] = x[2] = 0; }
    void AddWithWeight(const Point& o, float weight) {
        for (int k = 0; k < 3; ++k) x[k] += weight * o.x[k];
    }
};

// Far's uniform refinement and its limit, from the same arrays to positions and quads; a host cuts these in two as it likes.
size_t refine_by_far(const Cage& cage, int levels) {
    namespace Far = OpenSubdiv::Far;
    namespace Sdc = OpenSubdiv::Sdc;
    Far::TopologyDescriptor d;
    d.numVertices = cage.verts();
    d.numFaces = cage.faces();
    d.numVertsPerFace = cage.sizes.data();
    d.vertIndicesPerFace = cage.corners.data();
    d.numCreases = static_cast<int>(cage.crease_sharpness.size());
    d.creaseVertexIndexPairs = cage.crease_edges.data();
    d.creaseWeights = cage.crease_sharpness.data();
    d.numCorners = static_cast<int>(cage.vert_sharpness.size());
    d.cornerVertexIndices = cage.sharp_verts.data();
    d.cornerWeights = cage.vert_sharpness.data();
    d.numHoles = static_cast<int>(cage.holes.size());
    d.holeIndices = cage.holes.data();
    Sdc::Options how;
    how.SetVtxBoundaryInterpolation(Sdc::Options::VTX_BOUNDARY_EDGE_AND_CORNER);
    using Factory = Far::TopologyRefinerFactory<Far::TopologyDescriptor>;
    const std::unique_ptr<Far::TopologyRefiner> refiner(Factory::Create(d, Factory::Options(Sdc::SCHEME_CATMARK, how)));
    if (refiner == nullptr) return 0;
    Far::TopologyRefiner::UniformOptions options(levels);
    options.fullTopologyInLastLevel = true; // which limit points need
    refiner->RefineUniform(options);
    const Far::PrimvarRefiner values(*refiner);
    std::vector<Point> from(static_cast<size_t>(cage.verts())), to;
    std::memcpy(from.data(), cage.positions.data(), cage.positions.size() * sizeof(float));
    for (int level = 1; level <= levels; ++level) {
        to.resize(static_cast<size_t>(refiner->GetLevel(level).GetNumVertices()));
        Point *const source = from.data(), *target = to.data();
        values.Interpolate(level, source, target);
        from.swap(to);
    }
    to.resize(from.size());
    Point *const source = from.data(), *target = to.data();
    values.Limit(source, target);
    const Far::TopologyLevel& last = refiner->GetLevel(levels);
    std::vector<int32_t> quads;
    quads.reserve(4 * static_cast<size_t>(last.GetNumFaces()));
    for (int f = 0; f < last.GetNumFaces(); ++f)
        for (const int v : last.GetFaceVertices(f)) quads.push_back(v);
    return quads.size() / 4;
}
#endif

// ---- The table --------------------------------------------------------------------------------------------------------------

void print_heading() {
    std::printf("%-28s %5s %9s %9s %6s %9s %6s %9s %7s %6s %9s %7s %6s %8s\n", "cage", "rate", "triangles", "subdivide", "B/tri",
                "Far", "times", "remesh", "pose", "times", "family", "poses", "times", "NLD");
}

bool bench(const char* path, const Settings& settings) {
    Cage cage;
    if (!read_cage(path, cage)) return false;
    int rate = settings.rate, powers = 0;
    if (rate == 0) {
        rate = 1;
        while (std::abs(std::log2(static_cast<double>(cage.triangles(2 * rate)) / 1e6)) <
               std::abs(std::log2(static_cast<double>(cage.triangles(rate)) / 1e6)))
            rate *= 2;
    }
    while (1 << powers < rate) ++powers;
    [[maybe_unused]] const bool has_peer = powers > 0 && 1 << powers == rate;

    std::vector<float> pose = cage.positions; // a wave of a fiftieth of the largest coordinate
    float largest = 0;
    for (const float x : pose) largest = std::max(largest, std::abs(x));
    for (size_t i = 0; i < pose.size(); i += 3) pose[i] += 0.02F * largest * std::sin(4 * cage.positions[i + 1] / largest);

    Fastest subdivide, far, remesh, family, one, all;
    uint64_t peak = 0;
    int64_t triangles = 0, nld = 0;
    bool ok = true;
    for (int i = 0; i < settings.repeat && ok; ++i) {
        Mesh dense, delaunay;
        Levels levels;
        delmesh_reevaluate_report report;
        {
            Library library(settings.threads);
            ok = subdivide.run([&] {
                return library.create(cage) && library.subdivide(rate, dense) && !library.positions_of(dense.get()).empty() &&
                       !library.corners_of(dense.get()).empty();
            });
            if (!ok) break;
            peak = library.peak();
            triangles = Library::info(dense.get()).faces;
            dense.reset();
        }
#ifdef BENCH_OPENSUBDIV
        if (has_peer) ok = far.run([&] { return refine_by_far(cage, powers) > 0; });
#endif
        Library library(settings.threads);
        ok = ok && remesh.run([&] {
            return library.create(cage) && library.subdivide(rate, dense) &&
                   library.remesh(dense.get(), settings.mode, delaunay) && !library.positions_of(delaunay.get()).empty();
        });
        ok = ok && one.run([&] { return library.pose(delaunay.get(), pose, report); });
        nld = ok ? report.nld_interior + report.nld_boundary : 0;
        delaunay.reset();
        ok = ok && family.run([&] {
            if (!library.create(cage) || !library.subdivide(rate, dense) || !library.family(dense.get(), settings.levels, levels))
                return false;
            for (const Mesh& level : levels) library.positions_of(level.get());
            return true;
        });
        ok = ok && all.run([&] {
            bool each = true;
            for (const Mesh& level : levels) each = each && library.pose(level.get(), pose, report);
            return each;
        });
    }
    if (!ok) return std::fprintf(stderr, "%s: given up\n", path), false;
    std::string_view name = path;
    name.remove_prefix(name.rfind('/') == name.npos ? 0 : name.rfind('/') + 1);
    std::printf("%-28.*s %5d %9lld %9.1f %6.0f", static_cast<int>(name.size()), name.data(), rate,
                static_cast<long long>(triangles), 1e3 * subdivide.seconds,
                static_cast<double>(peak) / static_cast<double>(triangles));
    if (std::isfinite(far.seconds))
        std::printf(" %9.1f %6.2f", 1e3 * far.seconds, subdivide.seconds / far.seconds);
    else
        std::printf(" %9s %6s", "-", "-");
    std::printf(" %9.1f %7.1f %6.1f %9.1f %7.1f %6.1f %8lld\n", 1e3 * remesh.seconds, 1e3 * one.seconds,
                remesh.seconds / one.seconds, 1e3 * family.seconds, 1e3 * all.seconds, family.seconds / all.seconds,
                static_cast<long long>(nld));
    std::fflush(stdout);
    return true;
}

bool set_option(Settings& settings, std::string_view name, const char* value) {
    if (name == "--mode") {
        const std::string_view mode = value;
        settings.mode = mode == "flip" ? DELMESH_MODE_FLIP : DELMESH_MODE_PRESERVE;
        return mode == "flip" || mode == "preserve";
    }
    const int number = std::atoi(value);
    if (number < 1) return false;
    if (name == "--rate") return settings.rate = number, true;
    if (name == "--levels") return settings.levels = number, true;
    if (name == "--threads") return settings.threads = number, true;
    if (name == "--repeat") return settings.repeat = number, true;
    return false;
}

} // namespace

int main(int argc, char** argv) {
    Settings settings;
    int at = 1;
    bool ok = true;
    for (; ok && at < argc && std::strncmp(argv[at], "--", 2) == 0; at += 2)
        ok = at + 1 < argc && set_option(settings, argv[at], argv[at + 1]);
    if (!ok || at >= argc) {
        std::fprintf(
            stderr, "usage: bench_subdivide [--rate N] [--levels N] [--mode preserve|flip] [--threads N] [--repeat N] CAGE...\n");
        return 2;
    }
    print_heading();
    int failed = 0;
    for (; at < argc; ++at) failed |= bench(argv[at], settings) ? 0 : 1;
    return failed;
}
