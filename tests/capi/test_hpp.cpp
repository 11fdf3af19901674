// SPDX-License-Identifier: Apache-2.0
// The C++ wrapper. No cmocka: its assertions longjmp over C++ frames.
#include <delmesh/delmesh.hpp>

#include <cstdio>
#include <cstring>

namespace {

int failures = 0;

void expect(bool condition, const char* text, int line) {
    if (condition) return;
    std::fprintf(stderr, "line %d: not so: %s\n", line, text);
    ++failures;
}
#define EXPECT(condition) expect(condition, #condition, __LINE__)

// Runs call() and returns what it threw as an E, or stops being sure.
template <class E, class Call>
E thrown_by(Call&& call) {
    try {
        call();
    } catch (const E& error) {
        return error;
    }
    EXPECT(!"nothing of that type was thrown");
    throw std::logic_error("the test cannot go on");
}

const std::vector<double> kPositions = {-2, 0, 0, 2, 0, 0, 0, 1, 0, 0, -1, 0};
const std::vector<int32_t> kCorners = {0, 1, 2, 1, 0, 3};

void round_trip() {
    delmesh::Context context;
    const delmesh::Mesh in = context.create(kPositions, kCorners);
    EXPECT(in.positions<double>() == kPositions);
    EXPECT(in.corners<int32_t>() == kCorners);
    EXPECT(in.corners<int64_t>().size() == 6);
    EXPECT(in.read<int32_t>(DELMESH_EDGE_VERT).size() == 10);
    EXPECT(in.read<uint8_t>(DELMESH_EDGE_FLAGS).size() == 5);
    EXPECT(in.read<double>(DELMESH_VERT_MAP_WEIGHT).size() == 12);
    EXPECT(in.borrow(DELMESH_FACE_SOURCE).count == 2);
    EXPECT(in.info().edges == 5);
    context.validate(in);
    EXPECT(context.certify(in).nld_interior == 1);
    EXPECT(context.quality(in).negative_cotangents == 1);

    delmesh::RemeshOptions options;
    options.mode = DELMESH_MODE_FLIP;
    options.boundary = DELMESH_BOUNDARY_IGNORE;
    delmesh::RemeshReport report;
    delmesh::Mesh out = context.remesh(in, options, &report);
    EXPECT(report.flips == 1 && report.certified == 1);
    EXPECT(context.distance(in, out).hausdorff_sampled < 1e-12);
    delmesh::Mesh moved = std::move(out);
    EXPECT(!out && moved && moved.info().faces == 2);

    delmesh::Context other = std::move(context); // callbacks and meshes do not care
    other.on_log([](int32_t, const char*) {});
    delmesh::CertifyOptions certify;
    certify.boundary = DELMESH_BOUNDARY_IGNORE;
    EXPECT(other.certify(moved, certify).delaunay == 1);
    delmesh::RemeshOptions rules;
    rules.boundary = DELMESH_BOUNDARY_IGNORE;
    const delmesh::PreserveEstimate estimate = other.estimate_preserve(moved, rules);
    const std::vector<delmesh_target> targets = {delmesh::target(DELMESH_TARGET_FULL), delmesh::target(DELMESH_TARGET_FACES, 1)};
    std::vector<delmesh::LevelReport> levels;
    delmesh::DecimateReport decimated;
    const std::vector<delmesh::Mesh> family = other.lod_family(moved, targets, delmesh::DecimateOptions(), &levels, &decimated);
    EXPECT(family.size() == 2 && levels.size() == 2 && levels[0].certified == 1 && decimated.faces_in == 2);
    EXPECT(family[0].read<int32_t>(DELMESH_VERT_PARENT).size() == static_cast<std::size_t>(levels[0].vertices));
    EXPECT(levels[1].stopped_by != DELMESH_STOPPED_BY_TARGET || family[1].info().faces == 1);
    delmesh::LevelReport level;
    EXPECT(other.decimate(moved, targets[1], delmesh::DecimateOptions(), &level).info().faces == level.faces);
    EXPECT(thrown_by<delmesh::Error>([&] {
               other.lod_family(moved, {targets[1], targets[0]});
           }).status() == DELMESH_ERROR_INVALID_ARGUMENT);
    thrown_by<delmesh::Error>([&] { other.lod_family(moved, {}); });
    EXPECT(estimate.exact == 1 && estimate.nld_edges == 0 && estimate.vertices_out == estimate.vertices_in);
}

void layers() {
    delmesh::Context context;
    const std::vector<int32_t> materials = {4, 5};
    delmesh::Layer layer;
    layer.kind = DELMESH_LAYER_MATERIAL;
    layer.values = delmesh::view(materials);
    delmesh::MeshDesc desc;
    desc.positions = delmesh::view(kPositions, 3);
    desc.corner_verts = delmesh::view(kCorners);
    desc.layers = &layer;
    desc.layer_count = 1;
    const delmesh::Mesh mesh = context.create(desc);
    EXPECT(mesh.layer_borders(0) == 1);
    thrown_by<delmesh::Error>([&] { mesh.layer_borders(1); });
    EXPECT(mesh.read<int32_t>(DELMESH_CORNER_MAP_CORNER).size() == 18);
    EXPECT(mesh.read<double>(DELMESH_CORNER_MAP_WEIGHT).size() == 18);
    EXPECT(mesh.read<int32_t>(DELMESH_EDGE_SOURCE_EDGE) == (std::vector<int32_t>{0, 1, 2, 3, 4}));
    EXPECT(context.transfer(mesh, DELMESH_DOMAIN_FACE, DELMESH_TRANSFER_NEAREST, materials) == materials);
    EXPECT(context.transfer(mesh, DELMESH_DOMAIN_VERTEX, DELMESH_TRANSFER_LINEAR, kPositions, 3) == kPositions);
    const std::vector<float> uvs(12, 0.25f);
    EXPECT(context.transfer(mesh, DELMESH_DOMAIN_CORNER, DELMESH_TRANSFER_LINEAR, uvs, 2) == uvs);
    thrown_by<delmesh::Error>([&] { context.transfer(mesh, DELMESH_DOMAIN_EDGE, DELMESH_TRANSFER_LINEAR, uvs); });
    EXPECT(context.transfer_fitted(mesh, mesh, DELMESH_DOMAIN_CORNER, DELMESH_TRANSFER_LINEAR, uvs, 2) == uvs);
    thrown_by<delmesh::Error>([&] { context.transfer_fitted(mesh, mesh, DELMESH_DOMAIN_EDGE, DELMESH_TRANSFER_LINEAR, uvs); });
    delmesh::Rows<float> rows;
    rows.offsets = {0, 2, 2, 3, 3};
    rows.indices = {7, 1, 4};
    rows.values = {0.75f, 0.25f, 1};
    const delmesh::Rows<float> all = context.transfer_sparse(mesh, rows, 4, 1), one = context.transfer_sparse(mesh, rows, 1, 1);
    EXPECT(all.offsets == rows.offsets && all.indices == (std::vector<int32_t>{1, 7, 4}) &&
           all.values == (std::vector<float>{0.25f, 0.75f, 1}));
    EXPECT(one.indices == (std::vector<int32_t>{7, 4}) && one.values == (std::vector<float>{1, 1}));
}

void errors() {
    delmesh::Context context;
    const auto missing = thrown_by<delmesh::Error>([&] { context.create(kPositions, std::vector<int32_t>{0, 1, 7}); });
    EXPECT(missing.status() == DELMESH_ERROR_INDEX_OUT_OF_RANGE);
    EXPECT(std::strlen(missing.what()) > 10 && std::strstr(missing.what(), "7") != nullptr);
    const delmesh::Mesh mesh = context.create(kPositions, kCorners);
    const auto unread = thrown_by<delmesh::Error>([&] { mesh.read<float>(DELMESH_CORNER_VERT); });
    EXPECT(unread.status() == DELMESH_ERROR_INVALID_ARGUMENT);
    EXPECT(std::strcmp(unread.what(), "DELMESH_ERROR_INVALID_ARGUMENT") == 0);
    thrown_by<std::invalid_argument>([&] { context.create(std::vector<double>(4), kCorners); });
    for (const int32_t components : {0, -1}) {
        const auto transfer = [&] { context.transfer(mesh, DELMESH_DOMAIN_VERTEX, 0, std::vector<float>(4), components); };
        thrown_by<std::invalid_argument>(transfer);
    }
    delmesh::RemeshOptions options;
    options.max_vertices = 3;
    delmesh::RemeshReport report;
    const delmesh::Mesh obtuse = context.create(std::vector<float>{0, 0, 0, 4, 0, 0, 2, 0.5f, 0}, std::vector<uint32_t>{0, 1, 2});
    EXPECT(thrown_by<delmesh::Error>([&] { context.remesh(obtuse, options, &report); }).status() == DELMESH_ERROR_VERTEX_LIMIT);
    EXPECT(report.vertices_in == 3 && report.nld_in == 1);
    delmesh::ContextOptions bad;
    bad.max_threads = -1;
    EXPECT(thrown_by<delmesh::Error>([&] { delmesh::Context refused(bad); }).status() == DELMESH_ERROR_INVALID_ARGUMENT);
}

void progress() {
    delmesh::Context context;
    double last = -1;
    context.on_progress([&](double fraction, const char*) {
        last = fraction;
        return true;
    });
    const delmesh::Mesh mesh = context.create(kPositions, kCorners);
    EXPECT(last == 1);
    context.on_progress([](double, const char*) { return false; });
    EXPECT(thrown_by<delmesh::Error>([&] { context.remesh(mesh); }).status() == DELMESH_ERROR_CANCELLED);
    // What the callback throws comes out of the call, after the C frames have been left in order.
    context.on_progress([](double, const char*) -> bool { throw std::out_of_range("from the callback"); });
    EXPECT(std::strcmp(thrown_by<std::out_of_range>([&] { context.remesh(mesh); }).what(), "from the callback") == 0);
    context.on_progress(nullptr);
    EXPECT(static_cast<bool>(context.remesh(mesh)));
    context.cancel();
    EXPECT(thrown_by<delmesh::Error>([&] { context.remesh(mesh); }).status() == DELMESH_ERROR_CANCELLED);
    EXPECT(static_cast<bool>(context.remesh(mesh)));
}

// One bilinear quad, which is its own limit.
void cages() {
    delmesh::Context context;
    const std::vector<double> positions{0, 0, 0, 2, 0, 0, 2, 2, 0, 0, 2, 0};
    const std::vector<int32_t> corners{0, 1, 2, 3}, sizes{4};
    delmesh::CageDesc desc;
    desc.scheme = DELMESH_SCHEME_BILINEAR;
    desc.positions = delmesh::view(positions, 3);
    desc.corner_verts = delmesh::view(corners);
    desc.face_sizes = delmesh::view(sizes);
    delmesh::Cage cage;
    try {
        cage = context.create_cage(desc);
    } catch (const delmesh::Error& error) {
        EXPECT(error.status() == DELMESH_ERROR_UNSUPPORTED);
        return;
    }
    delmesh::SubdivideOptions options;
    delmesh::SubdivideReport report;
    options.value = 2;
    const delmesh::Mesh mesh = context.subdivide(cage, options, &report);
    EXPECT(report.rate == 2 && report.vertices == 9 && report.faces == 8);
    std::vector<double> normals(72);
    context.limit_normals(cage, mesh, nullptr, delmesh::view_mut(normals.data(), 24, 3));
    EXPECT(normals[2] == 1 && normals[71] == 1);
    std::vector<double> limit(27);
    const delmesh_view source = delmesh::view(positions, 3);
    context.limit_values(cage, mesh, DELMESH_DOMAIN_VERTEX, -1, &source, delmesh::view_mut(limit.data(), 9, 3));
    EXPECT(limit == mesh.positions<double>());
    delmesh::ReevaluateReport pose;
    EXPECT(context.reevaluate(cage, mesh, source, &pose).positions<double>() == limit);
    EXPECT(pose.moved_vertices == 0 && pose.delaunay == 1);
}

// Without the wrapper: a callback that throws into the C frames, which is against the rules, still comes back as a status.
void throwing_c_callback() {
    delmesh_context_options options;
    delmesh_context_options_init(&options, sizeof options);
    options.progress = [](void*, double, const char*) -> int32_t { throw std::out_of_range("not caught"); };
    delmesh_context* context = nullptr;
    EXPECT(delmesh_context_create(&options, &context) == DELMESH_OK);
    delmesh::MeshDesc desc;
    desc.positions = delmesh::view(kPositions, 3);
    desc.corner_verts = delmesh::view(kCorners);
    delmesh_mesh* mesh = nullptr;
    EXPECT(delmesh_mesh_create(context, &desc, &mesh) == DELMESH_ERROR_INTERNAL && mesh == nullptr);
    delmesh_context_destroy(context);
}

} // namespace

int main() {
    round_trip();
    layers();
    errors();
    progress();
    cages();
    throwing_c_callback();
    return failures == 0 ? 0 : 1;
}
