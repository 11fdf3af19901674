// SPDX-License-Identifier: Apache-2.0
// delmesh.hpp at work: a twisted torus of quads, remeshed in the three modes, and what each did to angles and shape.
#include <delmesh/delmesh.hpp>

#include <cmath>
#include <cstdio>

namespace {

constexpr int kAround = 48, kAcross = 16;

struct Torus {
    std::vector<double> positions;
    std::vector<int32_t> corners;
    std::vector<uint8_t> face_sizes;
};

Torus make_torus() {
    Torus torus;
    for (int i = 0; i < kAround; ++i)
        for (int j = 0; j < kAcross; ++j) {
            const double u = 2 * M_PI * i / kAround;
            const double v = 2 * M_PI * (j + 0.7 * std::sin(2 * u)) / kAcross; // the twist that makes the quads lean
            const double r = 2 + 0.7 * std::cos(v);
            torus.positions.insert(torus.positions.end(), {r * std::cos(u), r * std::sin(u), 0.7 * std::sin(v)});
            const int i1 = (i + 1) % kAround, j1 = (j + 1) % kAcross;
            torus.corners.insert(torus.corners.end(), {i * kAcross + j, i1 * kAcross + j, i1 * kAcross + j1, i * kAcross + j1});
            torus.face_sizes.push_back(4);
        }
    return torus;
}

void print(const char* name, const delmesh::MeshInfo& info, const delmesh::QualityReport& quality, double hausdorff_percent) {
    std::printf("%-9s %6lld vertices  angles %5.1f to %5.1f  %5lld negative cotangents  moved by %.4f %%\n", name,
                static_cast<long long>(info.vertices), quality.min_angle, quality.max_angle,
                static_cast<long long>(quality.negative_cotangents), hausdorff_percent);
}

} // namespace

int main() try {
    delmesh::Context context;
    context.on_log([](int32_t, const char* text) { std::printf("note: %s\n", text); });

    const Torus torus = make_torus();
    delmesh::MeshDesc desc;
    desc.positions = delmesh::view(torus.positions, 3);
    desc.corner_verts = delmesh::view(torus.corners);
    desc.face_sizes = delmesh::view(torus.face_sizes);
    const delmesh::Mesh in = context.create(desc);
    print("input", in.info(), context.quality(in), 0);

    delmesh::DistanceOptions fast;
    fast.compute_bound = 0;
    const char* const names[] = {"preserve", "flip", "feature"};
    for (const int32_t mode : {DELMESH_MODE_PRESERVE, DELMESH_MODE_FLIP, DELMESH_MODE_FEATURE}) {
        delmesh::RemeshOptions options;
        options.mode = mode;
        options.precision = DELMESH_FLOAT64;
        const delmesh::Mesh out = context.remesh(in, options);
        if (context.certify(out).delaunay != 1) return 1;
        print(names[mode], out.info(), context.quality(out), context.distance(in, out, fast).hausdorff_percent);
    }
    return 0;
} catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
}
