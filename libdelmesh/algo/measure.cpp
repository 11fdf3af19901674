// SPDX-License-Identifier: Apache-2.0
// Reporting only: nothing here decides anything, so that atan2 is good enough. docs/measure.md has the methods and what they
// guarantee. All sums are made block by block and added in the order of the blocks: the same bytes with any number of threads.
#include "algo/measure.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "algo/certify.h"
#include "algo/distance_bound.h"
#include "algo/parallel_slices.h"
#include "geom/bvh.h"
#include "geom/low_discrepancy.h"
#include "geom/predicates.h"

namespace dm {
namespace {

constexpr double kDegrees = 57.295779513082320877;
constexpr int64_t kQualityGrain = 4096; // faces
constexpr int64_t kSampleGrain = 256;   // triangles or samples: some hundred closest-point queries
constexpr int64_t kSamplesPerFace = 4, kLeastSamples = 100000, kMostSamples = int64_t{1} << 40;

double angle_between(const Vec3& a, const Vec3& b) {
    return kDegrees * std::atan2(length(cross(a, b)), dot(a, b));
}

// ---- Quality ----------------------------------------------------------------------------------------------------------------

struct QualityTally {
    int64_t faces = 0, below_30 = 0, above_120 = 0, edges = 0, histogram[18] = {};
    double area = 0, min_angle = 180, max_angle = 0, sum_min_angle = 0;
    double min_edge = HUGE_VAL, max_edge = 0, sum_edge = 0;

    void add_face(const Vec3 (&p)[3]) {
        area += 0.5 * length(cross(p[1] - p[0], p[2] - p[0]));
        double smallest = 180;
        for (int k = 0; k < 3; ++k) {
            const double angle = angle_between(p[(k + 1) % 3] - p[k], p[(k + 2) % 3] - p[k]);
            smallest = std::fmin(smallest, angle);
            max_angle = std::fmax(max_angle, angle);
            below_30 += angle < 30;
            above_120 += angle > 120;
            ++histogram[angle < 180 ? static_cast<int>(angle / 10) : 17];
        }
        min_angle = std::fmin(min_angle, smallest);
        sum_min_angle += smallest;
        ++faces;
    }
    void add_edge(double edge) {
        min_edge = std::fmin(min_edge, edge);
        max_edge = std::fmax(max_edge, edge);
        sum_edge += edge;
        ++edges;
    }
    void add(const QualityTally& o) {
        faces += o.faces;
        below_30 += o.below_30;
        above_120 += o.above_120;
        edges += o.edges;
        for (int k = 0; k < 18; ++k) histogram[k] += o.histogram[k];
        area += o.area;
        min_angle = std::fmin(min_angle, o.min_angle);
        max_angle = std::fmax(max_angle, o.max_angle);
        sum_min_angle += o.sum_min_angle;
        min_edge = std::fmin(min_edge, o.min_edge);
        max_edge = std::fmax(max_edge, o.max_edge);
        sum_edge += o.sum_edge;
    }
};

// Each edge is seen from one corner: the first of its two, or the only one.
bool owns_edge(const Mesh& mesh, int32_t corner) {
    const int32_t twin = mesh.corner_twin[corner];
    return twin < 0 || corner < twin;
}

int32_t max_valence(Memory& memory, const Mesh& mesh) {
    // A corner counts the edge that leaves its vertex; a boundary edge has no corner at its other end.
    Array<int32_t> valence(memory, mesh.vertices(), 0);
    for (int32_t c = 0; c < mesh.corners(); ++c) {
        ++valence[mesh.corner_vert[c]];
        if (mesh.corner_twin[c] < 0) ++valence[mesh.corner_vert[next_corner(c)]];
    }
    int32_t most = 0;
    for (const int32_t v : valence) most = v > most ? v : most;
    return most;
}

double diagonal(const Box& box, const Frame& frame) {
    return box.empty() ? 0 : length(frame.scale * box.hi - frame.scale * box.lo); // in the frame's units
}

// ---- Distance ---------------------------------------------------------------------------------------------------------------

struct DistanceTally {
    double max_squared = 0;
    double sum_squared = 0, weight = 0;                 // of the samples spread by area
    double spot_sum_squared = 0, spot_weight = 0;       // of vertices and midpoints
    double turn_sum = 0, turn_weight = 0, turn_max = 0; // degrees

    void add(const DistanceTally& o) {
        max_squared = std::fmax(max_squared, o.max_squared);
        sum_squared += o.sum_squared;
        weight += o.weight;
        spot_sum_squared += o.spot_sum_squared;
        spot_weight += o.spot_weight;
        turn_sum += o.turn_sum;
        turn_weight += o.turn_weight;
        turn_max = std::fmax(turn_max, o.turn_max);
    }
    // A surface without area is measured by its vertices and midpoints.
    double rms() const {
        if (weight > 0) return std::sqrt(sum_squared / weight);
        return spot_weight > 0 ? std::sqrt(spot_sum_squared / spot_weight) : 0;
    }
};

DistanceTally sum(const Array<DistanceTally>& tallies) {
    DistanceTally all;
    for (const DistanceTally& tally : tallies) all.add(tally);
    return all;
}

Vec3 normal(const Bvh::Triangle& t) {
    return cross(t.corner[1] - t.corner[0], t.corner[2] - t.corner[0]);
}

// Which vertices and edges are looked at from which triangle, so that each is looked at once: bit k is corner k's vertex,
// bit 3 + k the edge from corner k on.
Array<uint8_t> assign_spots(Memory& memory, const Mesh& mesh, const Bvh& bvh) {
    Array<uint8_t> spots(memory, bvh.size(), 0), seen(memory, mesh.vertices(), 0);
    for (int32_t t = 0; t < bvh.size(); ++t) {
        for (int32_t k = 0; k < 3; ++k) {
            const int32_t c = 3 * bvh.face(t) + k, v = mesh.corner_vert[c];
            if (seen[v] == 0) spots[t] |= static_cast<uint8_t>(1 << k);
            seen[v] = 1;
            if (owns_edge(mesh, c)) spots[t] |= static_cast<uint8_t>(8 << k);
        }
    }
    return spots;
}

// Distances from vertices and edge midpoints. near[t] becomes a triangle of `to` that is close to t.
Status measure_spots(Context& context, const Array<uint8_t>& spots, const Bvh& from, const Bvh& to, double start, double end,
                     Array<int32_t>& near, DistanceTally& out) {
    Array<DistanceTally> tallies(context.memory(), block_count(from.size(), kSampleGrain), DistanceTally{});
    DM_TRY(parallel_slices(context, from.size(), kSampleGrain, start, end, [&](int64_t block, int64_t first, int64_t last) {
        DistanceTally tally;
        int32_t guess = 0;
        for (int64_t t = first; t < last; ++t) {
            const Bvh::Triangle& triangle = from.triangle(static_cast<int32_t>(t));
            for (int k = 0; k < 6; ++k) {
                if ((spots[t] >> k & 1) == 0) continue;
                const Vec3& p = triangle.corner[k % 3];
                const Bvh::Hit hit = to.closest(k < 3 ? p : p + 0.5 * (triangle.corner[(k + 1) % 3] - p), guess);
                guess = hit.triangle;
                tally.max_squared = std::fmax(tally.max_squared, hit.distance_squared);
                tally.spot_sum_squared += hit.distance_squared;
                tally.spot_weight += 1;
            }
            near[t] = guess;
        }
        tallies[block] = tally;
    }));
    out.add(sum(tallies));
    return DELMESH_OK;
}

// Distances from `samples` points, one in each of as many consecutive parts of equal area.
Status measure_samples(Context& context, const Bvh& from, const Bvh& to, int64_t samples, double start, double end,
                       const Array<int32_t>& near, DistanceTally& out) {
    Memory& memory = context.memory();
    const int32_t triangles = from.size();
    Array<double> area(memory, triangles); // of all triangles up to this one, itself included
    double total = 0;
    for (int32_t t = 0; t < triangles; ++t) area[t] = total += length(normal(from.triangle(t)));
    if (!(total > 0)) return DELMESH_OK;
    // The number of the first sample beyond this triangle. Sample i stands at (i + 1/2) / samples of the area.
    const auto samples_up_to = [&](int32_t t) {
        return t == triangles - 1 ? samples : static_cast<int64_t>(area[t] / total * static_cast<double>(samples) + 0.5);
    };
    const int64_t grain = std::max(kSampleGrain, samples >> 16); // bounds the tallies' memory
    Array<DistanceTally> tallies(memory, block_count(samples, grain), DistanceTally{});
    DM_TRY(parallel_slices(context, samples, grain, start, end, [&](int64_t block, int64_t first, int64_t last) {
        DistanceTally tally;
        int32_t t = 0; // the first triangle that ends beyond sample `first`
        for (int32_t beyond = triangles - 1; t < beyond;) {
            const int32_t middle = t + (beyond - t) / 2;
            if (samples_up_to(middle) > first)
                beyond = middle;
            else
                t = middle + 1;
        }
        int32_t guess = near[t];
        for (int64_t i = first; i < last; ++i) {
            while (samples_up_to(t) <= i) ++t;
            const Bvh::Triangle& triangle = from.triangle(t);
            const Bvh::Hit hit = to.closest(low_discrepancy_point(triangle.corner, static_cast<uint64_t>(i)), guess);
            guess = hit.triangle;
            tally.max_squared = std::fmax(tally.max_squared, hit.distance_squared);
            tally.sum_squared += hit.distance_squared;
            tally.weight += 1;
            const Vec3 here = normal(triangle), there = normal(to.triangle(hit.triangle));
            if (dot(there, there) > 0 && dot(here, here) > 0) {
                const double turn = angle_between(here, there);
                tally.turn_sum += turn;
                tally.turn_weight += 1;
                tally.turn_max = std::fmax(tally.turn_max, turn);
            }
        }
        tallies[block] = tally;
    }));
    out.add(sum(tallies));
    return DELMESH_OK;
}

struct Direction {
    DistanceTally tally;
    DistanceBound bound{0, -1};
};

// From `mesh`, whose hierarchy is `from`, to the other surface. absolute: in the frame's units.
Status measure_direction(Context& context, const Mesh& mesh, const Bvh& from, const Bvh& to,
                         const delmesh_distance_options& options, double absolute, Direction& out) {
    int64_t samples = options.samples;
    if (samples == 0) samples = std::max(kLeastSamples, kSamplesPerFace * mesh.faces());
    Array<int32_t> near(context.memory(), from.size());
    const double sampled = options.compute_bound != 0 ? 0.6 : 1; // part of the time
    {
        const Array<uint8_t> spots = assign_spots(context.memory(), mesh, from);
        DM_TRY(measure_spots(context, spots, from, to, 0, sampled / 3, near, out.tally));
    }
    DM_TRY(measure_samples(context, from, to, samples, sampled / 3, sampled, near, out.tally));
    out.bound.lower = std::sqrt(out.tally.max_squared);
    if (options.compute_bound == 0) return DELMESH_OK;
    return bound_distance(context, from, to, near, options.relative_error, absolute, sampled, 1, out.bound);
}

} // namespace

Status measure_quality(Context& context, const Mesh& mesh, delmesh_quality_report& report) {
    const Box box = used_box(mesh);
    if (box.empty()) return DELMESH_OK; // no face: everything is 0
    const Frame frame(box);
    DM_TRY(context.stage("angles", 0, 0.6));
    Array<QualityTally> tallies(context.memory(), block_count(mesh.faces(), kQualityGrain), QualityTally{});
    DM_TRY(parallel_slices(context, mesh.faces(), kQualityGrain, 0, 1, [&](int64_t block, int64_t begin, int64_t end) {
        QualityTally tally;
        for (int32_t f = static_cast<int32_t>(begin); f < end; ++f) {
            Vec3 p[3];
            for (int32_t k = 0; k < 3; ++k) p[k] = frame(mesh.position(mesh.corner_vert[3 * f + k]));
            if (!zero_area(p[0], p[1], p[2])) tally.add_face(p);
            for (int32_t k = 0; k < 3; ++k)
                if (owns_edge(mesh, 3 * f + k)) tally.add_edge(length(p[(k + 1) % 3] - p[k]));
        }
        tallies[block] = tally;
    }));
    QualityTally all;
    for (const QualityTally& tally : tallies) all.add(tally);

    DM_TRY(context.stage("cotangents", 0.6, 1));
    Certificate certificate;
    DM_TRY(certify_mesh(context, mesh, false, certificate, nullptr, nullptr));

    report.area = all.area * frame.unit * frame.unit;
    report.diagonal = diagonal(box, frame) * frame.unit;
    if (all.faces > 0) {
        const double faces = static_cast<double>(all.faces);
        report.min_angle = all.min_angle;
        report.max_angle = all.max_angle;
        report.mean_min_angle = all.sum_min_angle / faces;
        report.percent_below_30 = 100 * static_cast<double>(all.below_30) / (3 * faces);
        report.percent_above_120 = 100 * static_cast<double>(all.above_120) / (3 * faces);
    }
    report.min_edge = all.min_edge * frame.unit;
    report.max_edge = all.max_edge * frame.unit;
    report.mean_edge = all.sum_edge / static_cast<double>(all.edges) * frame.unit;
    report.negative_cotangents = certificate.nld_interior;
    report.max_valence = max_valence(context.memory(), mesh);
    for (int k = 0; k < 18; ++k) report.angle_histogram[k] = all.histogram[k];
    return DELMESH_OK;
}

Status measure_distance(Context& context, const Mesh& a, const Mesh& b, const delmesh_distance_options& options,
                        delmesh_distance_report& report) {
    const auto start = std::chrono::steady_clock::now();
    if (a.faces() == 0) return context.fail(DELMESH_ERROR_NO_SURFACE, "Mesh a has no faces.");
    if (b.faces() == 0) return context.fail(DELMESH_ERROR_NO_SURFACE, "Mesh b has no faces.");
    if (options.samples > kMostSamples)
        return context.fail(DELMESH_ERROR_INVALID_ARGUMENT, "samples was %lld, more than 2^40.",
                            static_cast<long long>(options.samples));

    DM_TRY(context.stage("search trees", 0, 0.05));
    const Box box_a = used_box(a);
    Box both = box_a;
    both.extend(used_box(b));
    const Frame frame(both);
    Bvh bvh_a(context.memory()), bvh_b(context.memory());
    DM_TRY(bvh_a.build(context, a, frame));
    DM_TRY(context.stage("search trees", 0.05, 0.1));
    DM_TRY(bvh_b.build(context, b, frame));

    const double diagonal_a = diagonal(box_a, frame), absolute = options.absolute_error / 100 * diagonal_a;
    Direction ab, ba;
    DM_TRY(context.stage("distance from a to b", 0.1, 0.55));
    DM_TRY(measure_direction(context, a, bvh_a, bvh_b, options, absolute, ab));
    DM_TRY(context.stage("distance from b to a", 0.55, 1));
    DM_TRY(measure_direction(context, b, bvh_b, bvh_a, options, absolute, ba));

    const auto percent = [&](double x) { return diagonal_a > 0 ? 100 * x / diagonal_a : 0; };
    const double hausdorff = std::fmax(ab.bound.lower, ba.bound.lower), rms = std::fmax(ab.tally.rms(), ba.tally.rms());
    report.diagonal = diagonal_a * frame.unit;
    report.a_to_b_max = ab.bound.lower * frame.unit;
    report.b_to_a_max = ba.bound.lower * frame.unit;
    report.hausdorff_sampled = hausdorff * frame.unit;
    report.a_to_b_rms = ab.tally.rms() * frame.unit;
    report.b_to_a_rms = ba.tally.rms() * frame.unit;
    report.rms = rms * frame.unit;
    report.hausdorff_percent = percent(hausdorff);
    report.rms_percent = percent(rms);
    const bool bounded = options.compute_bound != 0;
    report.a_to_b_bound = bounded ? ab.bound.upper * frame.unit : -1;
    report.b_to_a_bound = bounded ? ba.bound.upper * frame.unit : -1;
    report.hausdorff_bound = std::fmax(report.a_to_b_bound, report.b_to_a_bound);
    DistanceTally turns = ab.tally;
    turns.add(ba.tally);
    report.normal_deviation_mean = turns.turn_weight > 0 ? turns.turn_sum / turns.turn_weight : 0;
    report.normal_deviation_max = turns.turn_max;
    report.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    return DELMESH_OK;
}

Status bound_distance(Context& context, const Mesh& a, const Mesh& b, double& bound) {
    delmesh_distance_options how{};
    how.struct_size = sizeof how;
    how.compute_bound = 1;
    how.relative_error = 0.01;
    how.absolute_error = 1e-4;
    delmesh_distance_report distance{};
    DM_TRY(measure_distance(context, a, b, how, distance));
    bound = distance.hausdorff_bound;
    return DELMESH_OK;
}

} // namespace dm
