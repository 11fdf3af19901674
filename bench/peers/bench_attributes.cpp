/* SPDX-License-Identifier: Apache-2.0
 *
 * bench_attributes.cpp: how well textures and normals stay where they were when a mesh is decimated, beside meshoptimizer's
 * meshopt_simplifyWithAttributes where its source is there.
 *     bench_attributes [--ratio R] [--preserve 1] [--fit 1] [--uv-weight W] [--normal-weight W] [--peer-uv-weight W]
 *                      [--peer-normal-weight W] FILE...
 * Files need UVs at their corners; normals are the source's smooth ones, weighted by area, and a layer like any other. Both go to the
 * same number of triangles: the peer to what the library left. Its vertices are split where UVs jump, as it wants them.
 * --preserve: the mesh is made Delaunay by splits and not by flips; --fit: layers come by delmesh_transfer_fitted. The last row is the
 * peer's function that also moves vertices and their values, meshopt_simplifyWithUpdate, if it is one that has it.
 * A peer's UV weight below 0 is what its README proposes: that times -1 over the root of the mean area of a triangle in UVs.
 *
 * What is measured: points spread evenly over one surface, the closest point of the other, and the root of the mean square of the
 * difference between what is interpolated at both; from the level to the source and back. UVs in their own units, normals as the
 * length of the difference of unit vectors. Close to a seam the closest point may be on its other side, so the surface within half
 * a percent of the diagonal is looked at: of each part that hangs together without a seam the closest point, and of these the
 * one whose UV differs least. That is the same for both.
 */
extern "C" {
#include "mesh_file.h"
}

#include <algorithm>
#include <array>
#include <cfloat>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <map>
#include <numeric>
#include <stdexcept>
#include <string>
#include <vector>

#include <delmesh/delmesh.h>
#ifdef BENCH_MESHOPT
#include <meshoptimizer.h>
#endif

namespace {

using Vec = std::array<double, 3>;
Vec operator-(const Vec& a, const Vec& b) {
    return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
double dot(const Vec& a, const Vec& b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
Vec cross(const Vec& a, const Vec& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

struct Settings {
    double ratio = 0.1, uv_weight = 0, normal_weight = 0, peer_uv_weight = -1, peer_normal_weight = 0, preserve = 0, fit = 0;
    int64_t samples = 100000;
};

/* Triangles with a UV and a normal at every corner. */
struct Textured {
    std::vector<float> positions;
    std::vector<int32_t> corners;
    std::vector<float> uv, normals; /* 2 and 3 per corner */
    double seconds = 0;

    int32_t faces() const { return int32_t(corners.size() / 3); }
    Vec at(int32_t corner) const {
        const float* p = &positions[3 * size_t(corners[size_t(corner)])];
        return {p[0], p[1], p[2]};
    }
    Vec normal_of(int32_t face) const { return cross(at(3 * face + 1) - at(3 * face), at(3 * face + 2) - at(3 * face)); }
    double diagonal() const {
        Vec lo{HUGE_VAL, HUGE_VAL, HUGE_VAL}, hi{-HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
        for (int32_t c = 0; c < 3 * faces(); ++c)
            for (size_t k = 0; k < 3; ++k) {
                lo[k] = std::min(lo[k], at(c)[k]);
                hi[k] = std::max(hi[k], at(c)[k]);
            }
        return std::sqrt(dot(hi - lo, hi - lo));
    }
    /* Vertices that are one where position and UV are. */
    std::vector<int32_t> split(std::vector<int32_t>* first = nullptr) const {
        std::map<std::array<float, 3>, int32_t> numbers;
        std::vector<int32_t> out;
        for (size_t c = 0; c < corners.size(); ++c) {
            const std::array<float, 3> key{float(corners[c]), uv[2 * c] + 0.0f, uv[2 * c + 1] + 0.0f}; /* exact up to 2^24 */
            const auto found = numbers.emplace(key, int32_t(numbers.size()));
            if (found.second && first != nullptr) first->push_back(int32_t(c));
            out.push_back(found.first->second);
        }
        return out;
    }
};

/* A tree of boxes over the triangles. */
class Tree {
public:
    explicit Tree(const Textured& mesh) : mesh_(mesh), order_(size_t(mesh.faces())) {
        std::iota(order_.begin(), order_.end(), 0);
        build(0, mesh.faces());
    }
    struct Hit {
        int32_t face;
        double distance;
        Vec weight;
    };
    /* All triangles within the distance; with `nearest` that shrinks to the closest. */
    void look(const Vec& x, double& distance, bool nearest, std::vector<Hit>& hits) const { look(0, x, distance, nearest, hits); }

private:
    struct Node {
        Vec lo{HUGE_VAL, HUGE_VAL, HUGE_VAL}, hi{-HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
        int32_t begin, end, right;
        double distance(const Vec& x) const {
            double sum = 0;
            for (size_t k = 0; k < 3; ++k) {
                const double d = std::max({lo[k] - x[k], 0.0, x[k] - hi[k]});
                sum += d * d;
            }
            return std::sqrt(sum);
        }
    };
    int32_t build(int32_t begin, int32_t end) {
        const int32_t at = int32_t(nodes_.size());
        Node node;
        node.begin = begin, node.end = end, node.right = -1;
        for (int32_t i = begin; i < end; ++i)
            for (int32_t k = 0; k < 3; ++k) {
                const Vec x = mesh_.at(3 * order_[size_t(i)] + k);
                for (size_t d = 0; d < 3; ++d) {
                    node.lo[d] = std::min(node.lo[d], x[d]);
                    node.hi[d] = std::max(node.hi[d], x[d]);
                }
            }
        nodes_.push_back(node);
        if (end - begin <= 4) return at;
        const Vec size = node.hi - node.lo;
        const size_t axis = size_t(std::max_element(size.begin(), size.end()) - size.begin());
        const int32_t middle = (begin + end) / 2;
        const auto key = [&](int32_t f) { return mesh_.at(3 * f)[axis] + mesh_.at(3 * f + 1)[axis] + mesh_.at(3 * f + 2)[axis]; };
        std::nth_element(order_.begin() + begin, order_.begin() + middle, order_.begin() + end,
                         [&](int32_t f, int32_t g) { return key(f) < key(g); });
        build(begin, middle);
        const int32_t right = build(middle, end);
        nodes_[size_t(at)].right = right;
        return at;
    }
    Hit closest(int32_t face, const Vec& x) const {
        const Vec a = mesh_.at(3 * face), b = mesh_.at(3 * face + 1), c = mesh_.at(3 * face + 2);
        const Vec ab = b - a, ac = c - a, ap = x - a, n = cross(ab, ac);
        const double nn = dot(n, n), wb = dot(n, cross(ap, ac)), wc = dot(n, cross(ab, ap)), wa = nn - wb - wc;
        Hit best{face, HUGE_VAL, {1, 0, 0}};
        const auto take = [&](const Vec& w) {
            Vec y{0, 0, 0};
            for (size_t k = 0; k < 3; ++k) y[k] = w[0] * a[k] + w[1] * b[k] + w[2] * c[k];
            const double d = std::sqrt(dot(x - y, x - y));
            if (d < best.distance) best = {face, d, w};
        };
        if (nn > 0 && wa >= 0 && wb >= 0 && wc >= 0) {
            take({wa / nn, wb / nn, wc / nn});
            return best;
        }
        const auto along = [](const Vec& from, const Vec& to, const Vec& p) {
            const double l = dot(to - from, to - from);
            return l > 0 ? std::clamp(dot(p - from, to - from) / l, 0.0, 1.0) : 0.0;
        };
        const double t = along(a, b, x), u = along(b, c, x), v = along(c, a, x);
        take({1 - t, t, 0});
        take({0, 1 - u, u});
        take({v, 0, 1 - v});
        return best;
    }
    void look(int32_t at, const Vec& x, double& distance, bool nearest, std::vector<Hit>& hits) const {
        const Node& node = nodes_[size_t(at)];
        if (node.right < 0) {
            for (int32_t i = node.begin; i < node.end; ++i) {
                const Hit hit = closest(order_[size_t(i)], x);
                if (!(hit.distance <= distance)) continue;
                if (nearest) {
                    distance = hit.distance;
                    hits.clear();
                }
                hits.push_back(hit);
            }
            return;
        }
        int32_t first = at + 1, second = node.right;
        double near = nodes_[size_t(first)].distance(x), far = nodes_[size_t(second)].distance(x);
        if (far < near) {
            std::swap(first, second);
            std::swap(near, far);
        }
        if (near <= distance) look(first, x, distance, nearest, hits);
        if (far <= distance) look(second, x, distance, nearest, hits);
    }

    const Textured& mesh_;
    std::vector<int32_t> order_;
    std::vector<Node> nodes_;
};

struct Values {
    double uv[2];
    Vec normal;
};

Values values_at(const Textured& mesh, int32_t face, const Vec& w) {
    Values v{{0, 0}, {0, 0, 0}};
    for (size_t k = 0; k < 3; ++k) {
        const size_t c = 3 * size_t(face) + k;
        for (size_t d = 0; d < 2; ++d) v.uv[d] += w[k] * double(mesh.uv[2 * c + d]);
        for (size_t d = 0; d < 3; ++d) v.normal[d] += w[k] * double(mesh.normals[3 * c + d]);
    }
    const double l = std::sqrt(dot(v.normal, v.normal));
    for (double& x : v.normal) x = l > 0 ? x / l : 0;
    return v;
}

struct Errors {
    double uv = 0, uv_most = 0, normal = 0, distance = 0;
};

/* From points of `from` to the closest ones of `to`. */
Errors errors(const Textured& from, const Textured& to, double reach, int64_t samples) {
    const Tree tree(to);
    const std::vector<int32_t> split = to.split();
    std::vector<double> areas;
    double area = 0;
    for (int32_t f = 0; f < from.faces(); ++f) areas.push_back(area += std::sqrt(dot(from.normal_of(f), from.normal_of(f))));
    Errors sum;
    std::vector<Tree::Hit> hits;
    std::vector<size_t> part;
    std::map<std::pair<int32_t, int32_t>, size_t> edges;
    for (int64_t i = 0; i < samples; ++i) {
        const int32_t face =
            int32_t(std::lower_bound(areas.begin(), areas.end(), (double(i) + 0.5) / double(samples) * area) - areas.begin());
        double s = std::fmod(0.5 + 0.7548776662466927 * double(i), 1.0), t = std::fmod(0.5 + 0.5698402909980532 * double(i), 1.0);
        if (s + t > 1) s = 1 - s, t = 1 - t;
        const Vec w{1 - s - t, s, t};
        Vec x{0, 0, 0};
        for (int32_t k = 0; k < 3; ++k)
            for (size_t d = 0; d < 3; ++d) x[d] += w[size_t(k)] * from.at(3 * face + k)[d];
        const Values here = values_at(from, face, w);
        double distance = HUGE_VAL;
        hits.clear();
        tree.look(x, distance, true, hits);
        sum.distance += distance * distance;
        distance += reach;
        hits.clear();
        tree.look(x, distance, false, hits);
        std::sort(hits.begin(), hits.end(), [](const Tree::Hit& a, const Tree::Hit& b) { return a.distance < b.distance; });
        part.resize(hits.size());
        std::iota(part.begin(), part.end(), size_t{0});
        const auto root = [&](size_t h) {
            while (part[h] != h) h = part[h] = part[part[h]];
            return h;
        };
        edges.clear();
        for (size_t h = 0; h < hits.size(); ++h)
            for (size_t k = 0; k < 3; ++k) {
                const size_t c = 3 * size_t(hits[h].face);
                const int32_t a = split[c + k], b = split[c + (k + 1) % 3];
                const auto found = edges.emplace(std::minmax(a, b), h);
                if (found.second) continue;
                const size_t p = root(h), q = root(found.first->second);
                part[std::max(p, q)] = std::min(p, q); /* so that the root is the closest */
            }
        double least = HUGE_VAL, normal = 0;
        for (size_t h = 0; h < hits.size(); ++h) {
            if (part[h] != h) continue;
            const Values there = values_at(to, hits[h].face, hits[h].weight);
            const double u = here.uv[0] - there.uv[0], v = here.uv[1] - there.uv[1];
            if (u * u + v * v >= least) continue;
            least = u * u + v * v;
            normal = dot(here.normal - there.normal, here.normal - there.normal);
        }
        sum.uv += least;
        sum.uv_most = std::max(sum.uv_most, std::sqrt(least));
        sum.normal += normal;
    }
    for (double* each : {&sum.uv, &sum.normal, &sum.distance}) *each = std::sqrt(*each / double(samples));
    return sum;
}

/* ---- Input */

Textured read(const char* path) {
    Failure failure = {nullptr, ""};
    MeshFile file;
    if (!mesh_file_read(path, true, &file, &failure)) throw std::runtime_error(failure.text);
    const Layer* uv = nullptr;
    for (int32_t i = 0; i < file.layers.count; ++i)
        if (file.layers.items[i].kind == kLayerUv && file.layers.items[i].domain == DELMESH_DOMAIN_CORNER)
            uv = &file.layers.items[i];
    if (uv == nullptr) {
        mesh_file_free(&file);
        throw std::runtime_error(std::string(path) + ": no UVs");
    }
    Textured mesh;
    for (int64_t i = 0; i < 3 * file.vertex_count; ++i)
        mesh.positions.push_back(file.precision == DELMESH_FLOAT32 ? static_cast<const float*>(file.positions)[i]
                                                                   : float(static_cast<const double*>(file.positions)[i]));
    int64_t begin = 0;
    for (int64_t f = 0; f < file.face_count; ++f) {
        const int32_t size = file.face_sizes != nullptr ? file.face_sizes[f] : 3;
        for (int32_t k = 2; k < size; ++k)
            for (const int64_t c : {begin, begin + k - 1, begin + k}) {
                mesh.corners.push_back(file.corner_verts[c]);
                for (int32_t d = 0; d < 2; ++d) mesh.uv.push_back(float(layer_get(uv, c, d)));
            }
        begin += size;
    }
    mesh_file_free(&file);
    std::vector<Vec> smooth(mesh.positions.size() / 3, Vec{0, 0, 0});
    for (int32_t c = 0; c < 3 * mesh.faces(); ++c)
        for (size_t d = 0; d < 3; ++d) smooth[size_t(mesh.corners[size_t(c)])][d] += mesh.normal_of(c / 3)[d];
    for (const int32_t v : mesh.corners) {
        const Vec& n = smooth[size_t(v)];
        const double l = std::sqrt(dot(n, n));
        for (const double x : n) mesh.normals.push_back(l > 0 ? float(x / l) : 0);
    }
    return mesh;
}

/* ---- The library */

void check(int32_t status, const delmesh_context* context) {
    if (status != DELMESH_OK) throw std::runtime_error(delmesh_last_error(context));
}

Textured decimate(const Textured& source, const Settings& settings) {
    delmesh_context* context = nullptr;
    check(delmesh_context_create(nullptr, &context), nullptr);
    const int64_t corners = int64_t(source.corners.size());
    delmesh_layer layers[2];
    for (delmesh_layer& layer : layers) delmesh_layer_init(&layer, sizeof layer);
    layers[0].kind = DELMESH_LAYER_UV;
    layers[0].values = {source.uv.data(), corners, 0, DELMESH_FLOAT32, 2};
    layers[0].weight = settings.uv_weight;
    layers[1].kind = DELMESH_LAYER_NORMAL;
    layers[1].values = {source.normals.data(), corners, 0, DELMESH_FLOAT32, 3};
    layers[1].weight = settings.normal_weight;
    delmesh_mesh_desc desc;
    delmesh_mesh_desc_init(&desc, sizeof desc);
    desc.positions = {source.positions.data(), int64_t(source.positions.size() / 3), 0, DELMESH_FLOAT32, 3};
    desc.corner_verts = {source.corners.data(), corners, 0, DELMESH_INT32, 1};
    desc.layers = layers;
    desc.layer_count = 2;
    delmesh_mesh *in = nullptr, *out = nullptr;
    check(delmesh_mesh_create(context, &desc, &in), context);
    delmesh_decimate_options options;
    delmesh_decimate_options_init(&options, sizeof options);
    options.map = 1;
    if (settings.preserve != 0) options.prepare = DELMESH_MODE_PRESERVE;
    const delmesh_target target = {DELMESH_TARGET_RATIO, 0, settings.ratio};
    delmesh_decimate_report report;
    delmesh_decimate_report_init(&report, sizeof report);
    check(delmesh_decimate(context, in, &target, &options, &out, nullptr, &report), context);
    delmesh_mesh_info info;
    delmesh_mesh_info_init(&info, sizeof info);
    check(delmesh_mesh_get_info(out, &info), context);
    Textured level;
    level.seconds = report.seconds_decimate;
    level.positions.resize(size_t(3 * info.vertices));
    level.corners.resize(size_t(info.corners));
    level.uv.resize(size_t(2 * info.corners));
    level.normals.resize(size_t(3 * info.corners));
    const delmesh_view_mut positions = {level.positions.data(), info.vertices, 0, DELMESH_FLOAT32, 3},
                           verts = {level.corners.data(), info.corners, 0, DELMESH_INT32, 1},
                           uv = {level.uv.data(), info.corners, 0, DELMESH_FLOAT32, 2},
                           normals = {level.normals.data(), info.corners, 0, DELMESH_FLOAT32, 3};
    check(delmesh_mesh_read(out, DELMESH_POSITION, &positions), context);
    check(delmesh_mesh_read(out, DELMESH_CORNER_VERT, &verts), context);
    const auto carry = [&](const delmesh_view& from, int32_t policy, const delmesh_view_mut& to) {
        check(settings.fit != 0 ? delmesh_transfer_fitted(context, in, out, DELMESH_DOMAIN_CORNER, policy, &from, &to)
                                : delmesh_transfer(context, out, DELMESH_DOMAIN_CORNER, policy, &from, &to),
              context);
    };
    const auto begin = std::chrono::steady_clock::now();
    carry(layers[0].values, DELMESH_TRANSFER_LINEAR, uv);
    carry(layers[1].values, DELMESH_TRANSFER_DIRECTION, normals);
    if (settings.fit != 0) level.seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    delmesh_mesh_destroy(out);
    delmesh_mesh_destroy(in);
    delmesh_context_destroy(context);
    return level;
}

/* ---- The peer */

#ifdef BENCH_MESHOPT
double uv_scale(const Textured& mesh) { /* as its README proposes */
    double area = 0;
    for (size_t f = 0; f < size_t(mesh.faces()); ++f) {
        const float* u = &mesh.uv[6 * f];
        area += 0.5 * std::fabs(double((u[2] - u[0]) * (u[5] - u[1]) - (u[4] - u[0]) * (u[3] - u[1])));
    }
    return 1 / std::sqrt(area / mesh.faces());
}

/* update: also moves vertices and their values. */
Textured simplify(const Textured& source, int64_t faces, const Settings& settings, bool update) {
    std::vector<int32_t> first;
    const std::vector<int32_t> split = source.split(&first);
    std::vector<unsigned> indices(split.begin(), split.end());
    std::vector<float> positions, attributes;
    for (const int32_t c : first) {
        for (const double x : source.at(c)) positions.push_back(float(x));
        for (size_t d = 0; d < 3; ++d) attributes.push_back(source.normals[3 * size_t(c) + d]);
        for (size_t d = 0; d < 2; ++d) attributes.push_back(source.uv[2 * size_t(c) + d]);
    }
    const float normal = float(settings.peer_normal_weight);
    const float uv = float(settings.peer_uv_weight < 0 ? -settings.peer_uv_weight * uv_scale(source) : settings.peer_uv_weight);
    const float weights[5] = {normal, normal, normal, uv, uv};
    const size_t target = size_t(3 * faces), position = 3 * sizeof(float), attribute = 5 * sizeof(float);
    const auto begin = std::chrono::steady_clock::now();
#if MESHOPTIMIZER_VERSION >= 1000
    if (update)
        indices.resize(meshopt_simplifyWithUpdate(indices.data(), indices.size(), positions.data(), first.size(), position,
                                                  attributes.data(), attribute, weights, 5, nullptr, target, FLT_MAX, 0,
                                                  nullptr));
#endif
    if (!update)
        indices.resize(meshopt_simplifyWithAttributes(indices.data(), indices.data(), indices.size(), positions.data(),
                                                      first.size(), position, attributes.data(), attribute, weights, 5, nullptr,
                                                      target, FLT_MAX, 0, nullptr));
    Textured level;
    level.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    level.positions = positions;
    for (const unsigned v : indices) {
        const float* const values = &attributes[5 * size_t(v)];
        level.corners.push_back(int32_t(v));
        level.normals.insert(level.normals.end(), values, values + 3);
        level.uv.insert(level.uv.end(), values + 3, values + 5);
    }
    return level;
}
#endif

/* ---- The table */

void print_row(const char* name, const Textured& source, const Textured& level, const Settings& settings) {
    const double diagonal = source.diagonal();
    const Errors there = errors(level, source, 0.005 * diagonal, settings.samples),
                 back = errors(source, level, 0.005 * diagonal, settings.samples);
    std::printf("%-22s %8d | %9.2e %9.2e %7.4f %7.4f | %9.2e %9.2e %7.4f %7.4f | %6.0f\n", name, level.faces(), there.uv,
                there.uv_most, there.normal, 100 * there.distance / diagonal, back.uv, back.uv_most, back.normal,
                100 * back.distance / diagonal, 1e3 * level.seconds);
    std::fflush(stdout);
}

void bench_file(const char* path, const Settings& settings) {
    const char* slash = std::strrchr(path, '/');
    const char* name = slash != nullptr ? slash + 1 : path;
    const Textured source = read(path), level = decimate(source, settings);
    print_row(name, source, level, settings);
#ifdef BENCH_MESHOPT
    print_row("  meshoptimizer", source, simplify(source, level.faces(), settings, false), settings);
#if MESHOPTIMIZER_VERSION >= 1000
    print_row("  with update", source, simplify(source, level.faces(), settings, true), settings);
#endif
#endif
}

} // namespace

int main(int argc, char** argv) {
    Settings settings;
    const std::map<std::string, double*> options = {{"--ratio", &settings.ratio},
                                                    {"--preserve", &settings.preserve},
                                                    {"--fit", &settings.fit},
                                                    {"--uv-weight", &settings.uv_weight},
                                                    {"--normal-weight", &settings.normal_weight},
                                                    {"--peer-uv-weight", &settings.peer_uv_weight},
                                                    {"--peer-normal-weight", &settings.peer_normal_weight}};
    int at = 1;
    for (; at + 1 < argc && options.count(argv[at]) != 0; at += 2) *options.at(argv[at]) = std::atof(argv[at + 1]);
    if (at >= argc || argv[at][0] == '-') {
        std::fprintf(stderr, "usage: bench_attributes [--ratio R] [--preserve 1] [--fit 1] [--uv-weight W] [--normal-weight W] "
                             "[--peer-uv-weight W] [--peer-normal-weight W] FILE...\n");
        return 2;
    }
    std::printf("%-22s %8s | %9s %9s %7s %7s | %9s %9s %7s %7s | %6s\n", "to the source, and back", "left", "UV RMS", "most",
                "normals", "H RMS %", "UV RMS", "most", "normals", "H RMS %", "ms");
    bool all = true;
    for (; at < argc; ++at) {
        try {
            bench_file(argv[at], settings);
        } catch (const std::exception& problem) {
            std::fprintf(stderr, "%s: %s\n", argv[at], problem.what());
            all = false;
        }
    }
    return all ? 0 : 1;
}
