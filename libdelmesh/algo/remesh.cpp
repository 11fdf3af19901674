// SPDX-License-Identifier: Apache-2.0
// The driver: copy in, repair, keep edges, make Delaunay, hand out, certify. Each pass has its own file; this one decides nothing
// about geometry but the meaning of the options.
#include "algo/remesh.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "algo/certify.h"
#include "algo/delaunay.h"
#include "algo/flat_patches.h"
#include "algo/growth.h"
#include "algo/hand_out.h"
#include "algo/nld_scan.h"
#include "algo/parallel_slices.h"
#include "algo/repair.h"
#include "base/box.h"
#include "base/stopwatch.h"
#include "geom/angle.h"
#include "geom/predicates.h"
#include "mesh/build.h"
#include "mesh/surface.h"
#include "mesh/validate.h"

namespace dm {
namespace {

// How far the surface may move in all where float32 or float64 have no room for a split vertex, in units in the last place.
constexpr double kNeed = 64;
constexpr double kSplitRounding = 0.87; // units in the last place a rounded point may be off its place: sqrt(3) / 2

// Of the vertices that faces use.
struct Extent {
    Box box;
    int32_t first_not_finite = -1;

    void add(const Extent& o) {
        box.extend(o.box);
        if (first_not_finite < 0) first_not_finite = o.first_not_finite;
    }
};

Status find_extent(Context& context, const Surface& s, Extent& out) {
    constexpr int64_t kGrain = 1 << 15;
    Array<Extent> blocks(context.memory(), (s.vertices() + kGrain - 1) / kGrain, Extent{});
    DM_TRY(context.parallel(s.vertices(), kGrain, [&](int64_t block, int64_t begin, int64_t end) {
        Extent extent;
        for (int32_t v = static_cast<int32_t>(begin); v < end; ++v) {
            if (s.vert_corner[v] < 0) continue;
            const Vec3& x = s.at(v);
            extent.box.extend(x);
            if (extent.first_not_finite < 0 && !is_finite(x)) extent.first_not_finite = v;
        }
        blocks[block] = extent;
    }));
    out = Extent{};
    for (const Extent& extent : blocks) out.add(extent);
    return DELMESH_OK;
}

// Distance from the largest coordinate to the next number of the precision.
double last_place(Precision precision, double largest) {
    if (precision == Precision::f64) return std::nextafter(largest, std::numeric_limits<double>::infinity()) - largest;
    const float f = static_cast<float>(largest);
    return static_cast<double>(std::nextafter(f, std::numeric_limits<float>::infinity())) - static_cast<double>(f);
}

// Patches as thick as the rounding of coordinates make stored CAD flat. Beyond that most of the tolerance is left to flips outside
// of them, which measure what they do instead of taking it as spent wherever a flip has been.
double patch_thickness(double most_moved, double resolution) {
    return std::max(0.25 * most_moved, std::min(most_moved, 4 * resolution));
}

// The largest over all faces of how far flips have moved it, and how far its split vertices were rounded from where they belong.
// In float32 a split vertex is rounded once, by a known amount; in float64 so are the ends of the line it lies on, if they are
// split vertices.
Status find_surface_bound(Context& context, const Surface& s, const FlatPatches& patches, double resolution,
                          double last_place_of_double, double& bound) {
    constexpr int64_t kGrain = 1 << 14;
    Array<double> blocks(context.memory(), block_count(s.faces(), kGrain), 0);
    DM_TRY(context.parallel(s.faces(), kGrain, [&](int64_t block, int64_t begin, int64_t end) {
        double most = 0;
        for (int32_t f = static_cast<int32_t>(begin); f < end; ++f) {
            if (s.is_dead(f)) continue;
            double rounding = 0;
            for (int32_t k = 3 * f; k < 3 * f + 3; ++k) {
                const int32_t v = s.vert(k);
                if (s.is_original(v)) continue;
                const double known = std::min(length(s.at(v) - s.exact(v)), kSplitRounding * resolution);
                rounding = std::max(rounding, known + kSplitRounding * s.depth(v) * last_place_of_double);
            }
            most = std::max(most, patches.moved(f) + rounding);
        }
        blocks[block] = most;
    }));
    bound = 0;
    for (const double most : blocks) bound = std::max(bound, most);
    return DELMESH_OK;
}

// A power of two that brings a coordinate of this size near 1, if it is far from it.
double range_scale(double largest) {
    int exponent;
    std::frexp(largest, &exponent);
    return exponent > -200 && exponent < 200 ? 1 : std::ldexp(1.0, -std::min(std::max(exponent, -1000), 1000));
}

// What scan_faces finds on the mesh or on its copy.
template <class Real>
Status scan(Context& context, const ScanView<Real>& view, const delmesh_remesh_options& options, Array<uint8_t>& marks,
            Certificate& found) {
    marks.resize_uninitialized(view.faces);
    return scan_faces(context, view, options.boundary == DELMESH_BOUNDARY_NONOBTUSE, marks.data(), found);
}
Status scan(Context& context, const Mesh& in, const delmesh_remesh_options& options, Array<uint8_t>& marks, Certificate& found) {
    const auto view = [&](const auto& positions) {
        return ScanView{in.corner_vert.data(), in.corner_twin.data(), positions.data(), in.faces()};
    };
    return in.precision == Precision::f32 ? scan(context, view(in.pos32), options, marks, found)
                                          : scan(context, view(in.pos64), options, marks, found);
}

// How many vertices `preserve` may be expected to add where so many edges are NLD.
int64_t room_for_splits(const Certificate& found) {
    const int64_t nld = found.nld_interior + found.nld_boundary;
    return nld + nld / 2;
}

// The copy as it is, and without what its precision made degenerate. marks: what scan_faces found on the mesh, if the copy is the
// same; then what it finds on the copy, empty if that was so before a repair only.
Status look_and_repair(Context& context, const delmesh_remesh_options& options, Surface& s, Extent& extent, Array<uint8_t>& marks,
                       Certificate& given, delmesh_remesh_report& report) {
    DM_TRY(find_extent(context, s, extent));
    if (extent.first_not_finite >= 0)
        return context.fail(DELMESH_ERROR_PRECISION, "Vertex %d was out of the output precision's range.",
                            extent.first_not_finite);
    if (marks.empty())
        DM_TRY(scan(context, ScanView<double>{s.corner_vert.data(), s.corner_twin.data(), &s.pos.data()->x, s.faces()}, options,
                    marks, given));
    if (given.zero_area_faces == 0) return DELMESH_OK;
    Array<int32_t> zero_area(context.memory());
    for_each_marked(marks.data(), s.faces(), [&](int32_t f) {
        if ((marks[f] & kMarkNoArea) != 0) zero_area.push_back(f);
    });
    marks.clear();
    DM_TRY(repair_zero_area(context, s, std::move(zero_area), options.strict != 0, report));
    return find_extent(context, s, extent);
}

// Marks what the result's edges should tell about: which of them are edges of the source (diagonals of its polygons are not), and
// in feature mode those sharper than the angle.
Status mark_edges(Context& context, const Mesh& in, Surface& s, bool features, double feature_angle) {
    const double limit = features ? cosine_of_degrees(feature_angle) : 0;
    const bool polygons = in.imported && !in.face_source.empty();
    if (!features && !polygons) {
        return context.parallel(s.corners(), 1 << 17, [&](int64_t, int64_t begin, int64_t end) {
            for (int64_t c = begin; c < end; ++c) s.corner_bits[c] |= kEdgeSource;
        });
    }
    for (int32_t c = 0; c < s.corners(); ++c) {
        if ((c & 0xfffff) == 0) DM_TRY(context.progress(0.5));
        const int32_t f = face_of(c), t = s.twin(c);
        if (s.is_dead(f) || (t >= 0 && t < c)) continue;
        EdgeBits bits = s.corner_bits[c];
        const bool diagonal = polygons && t >= 0 && in.face_source[s.face_src[f]] == in.face_source[s.face_src[face_of(t)]];
        if (!diagonal) bits |= kEdgeSource;
        if (features && t >= 0) {
            const Vec3 &a = s.at(s.vert(c)), &b = s.at(s.head(c)), &u = s.at(s.apex(c)), &v = s.at(s.apex(t));
            const Vec3 n = cross(b - a, u - a), m = cross(v - a, b - a);
            const bool sharp = dot(n, m) < limit * (length(n) * length(m));
            if (sharp && !flat_edge(a, b, u, v)) bits |= kEdgeFeature; // what is exactly flat is none, whatever the angle
        }
        s.corner_bits[c] = bits;
        if (t >= 0) s.corner_bits[t] = bits;
    }
    return DELMESH_OK;
}

// The edges of faces that stay as they are, and all copies of those that were cut at import.
void freeze(Surface& s, const uint8_t* face_mask) {
    const auto freeze_edge = [&](int32_t c) {
        s.corner_bits[c] |= kEdgeFrozen;
        if (s.twin(c) >= 0) s.corner_bits[s.twin(c)] |= kEdgeFrozen;
    };
    for (int32_t c = 0; c < s.corners(); ++c) {
        const int32_t f = face_of(c);
        if (s.is_dead(f) || face_mask[s.face_src[f]] != 0) continue;
        freeze_edge(c);
        if (!is_cut(s.twin(c))) continue;
        const int32_t start = cut_slot(s.twin(c));
        for (int32_t slot = s.cut_slots[start].next; slot != start; slot = s.cut_slots[slot].next)
            freeze_edge(s.cut_slots[slot].corner);
    }
}

// Cuts can leave two edges between the same two vertices, which a list of faces cannot tell apart: a corner of one, or -1.
int32_t edge_met_twice(const Mesh& mesh) {
    struct Edge {
        int32_t from, to, corner;
    };
    Array<Edge> edges(mesh.corner_vert.memory());
    edges.reserve(mesh.corners());
    for (int32_t c = 0; c < mesh.corners(); ++c) edges.push_back({mesh.corner_vert[c], mesh.corner_vert[next_corner(c)], c});
    std::sort(edges.begin(), edges.end(), [](const Edge& a, const Edge& b) {
        return a.from != b.from ? a.from < b.from : a.to != b.to ? a.to < b.to : a.corner < b.corner;
    });
    const Edge* twice = std::adjacent_find(edges.begin(), edges.end(),
                                           [](const Edge& a, const Edge& b) { return a.from == b.from && a.to == b.to; });
    return twice == edges.end() ? -1 : twice->corner;
}

// Flips and splits keep the topology, so only a repair asks for a new look at it.
Status count(Context& context, const Mesh& in, bool repaired, Mesh& out) {
    if (repaired) return count_mesh(context, out);
    MeshCounts& n = out.counts;
    if (in.counts.boundary_edges != 0) DM_TRY(count_boundary_edges(context, out, n.boundary_edges));
    n.edges = (out.corners() + n.boundary_edges) / 2;
    n.components = in.counts.components;
    n.boundary_loops = in.counts.boundary_loops;
    n.euler_characteristic = in.counts.euler_characteristic;
    n.isolated_vertices = out.vertices() - (n.euler_characteristic + n.edges - out.faces());
    return DELMESH_OK;
}

} // namespace

Status remesh(Context& context, const Mesh& in, const delmesh_remesh_options& options, Mesh& out, delmesh_remesh_report& report,
              const ModelSize* whole, const uint8_t* face_mask) {
    Stopwatch watch;
    const Precision precision = options.precision == DELMESH_FLOAT32 ? Precision::f32 : Precision::f64;
    const bool preserve = options.mode == DELMESH_MODE_PRESERVE;
    report.vertices_in = in.vertices();
    report.faces_in = in.faces();
    report.surface_bound = -1;
    if (in.faces() == 0) return context.fail(DELMESH_ERROR_NO_SURFACE, "The mesh had no face.");

    DM_TRY(context.stage("repair", 0, 0.1));
    Array<uint8_t> marks(context.memory());
    Certificate given;
    if (in.precision == precision) DM_TRY(scan(context, in, options, marks, given));
    Surface surface(context, in, precision, preserve ? room_for_splits(given) : 0);
    VertexTraces traces(context.memory());
    if (options.map != 0) traces.first.copy_from(surface.vert_corner);
    Extent extent;
    DM_TRY(look_and_repair(context, options, surface, extent, marks, given, report));
    // Far from 1, float64 lengths lose the range that their products need. Input vertices are handed out as they were given, and
    // the certificate looks at those.
    double largest = whole != nullptr ? whole->largest : extent.box.largest_coordinate();
    const double scale = precision == Precision::f64 ? range_scale(largest) : 1;
    if (scale != 1) {
        for (Vec3& x : surface.pos) x = scale * x;
        largest *= scale;
        extent.box.lo = scale * extent.box.lo;
        extent.box.hi = scale * extent.box.hi;
        marks.clear();
    }
    DelaunayRules rules;
    rules.precision = precision;
    rules.boundary_rule = options.boundary == DELMESH_BOUNDARY_NONOBTUSE;
    rules.nld_marks = marks.empty() ? nullptr : marks.data();
    rules.shells = options.placement == DELMESH_PLACEMENT_SHELLS;
    const double size = whole != nullptr ? scale * whole->diagonal : extent.box.diagonal();
    rules.shell_unit = options.shell_unit > 0 ? scale * options.shell_unit : size / 1024;
    rules.min_turn_cosine =
        options.max_normal_turn >= 0 && options.max_normal_turn < 180 ? cosine_of_degrees(options.max_normal_turn) : -2;
    rules.resolution = last_place(precision, largest);
    const int64_t most = std::numeric_limits<int32_t>::max() / 6; // corners stay below 2^31
    if (in.vertices() > most)
        return context.fail(DELMESH_ERROR_TOO_LARGE, "The mesh had more than %lld vertices.", static_cast<long long>(most));
    rules.max_vertices =
        std::min(options.max_vertices > 0 ? options.max_vertices : 16 * static_cast<int64_t>(in.vertices()) + 10000, most);
    rules.effort = preserve ? options.effort : 1;
    rules.split_budget = options.split_budget > 0 ? options.split_budget : in.vertices() / 50 + 200;
    surface.kept_bits = static_cast<EdgeBits>(surface.kept_bits & ~options.release);
    DM_TRY(mark_edges(context, in, surface, options.mode == DELMESH_MODE_FEATURE, options.feature_angle));
    if (face_mask != nullptr) freeze(surface, face_mask);
    report.seconds_repair = watch.lap();

    // The tolerance is spent on two things that add up: flips, inside of patches or outside, and the rounding of split vertices
    // (half a unit in each coordinate, so less than 0.87 in all). In float32 it is known how a vertex was rounded; in float64 it
    // is not, and the worst counts.
    const double tolerance = options.tolerance < 0 ? 4 * rules.resolution : scale * options.tolerance;
    const double most_moved = preserve ? std::max(0.0, tolerance - kSplitRounding * rules.resolution) : 0;
    rules.free_movement.anywhere = rules.free_movement.rounded = most_moved;
    if (most_moved > 0 && precision == Precision::f32) rules.free_movement.rounded = tolerance;
    // A tolerance that the caller gave is kept, but for what the rounding of coordinates alone can do.
    rules.need = options.tolerance < 0 ? kNeed * rules.resolution : std::max(most_moved, 4 * rules.resolution);
    FlatPatches patches(context.memory());
    if (preserve) {
        DM_TRY(context.stage("flat patches", 0.1, 0.2));
        AffineLayers layers(context.memory(), in, surface.kept_bits);
        rules.texture = !layers.empty();
        DM_TRY(grow_flat_patches(context, surface, patch_thickness(most_moved, rules.resolution),
                                 rules.texture ? &layers : nullptr, patches));
    }
    DM_TRY(context.stage(preserve ? "split" : "flip", 0.2, 0.9));
    const Status status = make_delaunay(context, surface, preserve ? &patches : nullptr, rules, report);
    (report.splits == 0 ? report.seconds_flip : report.seconds_split) = watch.lap();
    report.vertices_out = surface.vertices_in_use();
    report.faces_out = surface.faces() - surface.dead_faces;
    const bool tells_where = status == DELMESH_OK || status == DELMESH_ERROR_VERTEX_LIMIT || status == DELMESH_ERROR_PRECISION;
    if (tells_where && !surface.carriers.empty()) DM_TRY(where_vertices_went(context, in, surface, rules.resolution, report));
    DM_TRY(status);
    DM_ASSERT(surface.valid());
    if (preserve) {
        DM_TRY(find_surface_bound(context, surface, patches, rules.resolution, last_place(Precision::f64, largest),
                                  report.surface_bound));
        report.surface_bound /= scale;
    }
    patches.free_storage();

    DM_TRY(context.stage("export", 0.9, options.map != 0 ? 0.93 : 0.95));
    const bool repaired =
        report.collapsed_edges != 0 || report.removed_zero_area_faces != 0 || surface.first_split != surface.first_copy;
    if (scale != 1)
        for (Vec3& x : surface.pos) x = (1 / scale) * x;
    const EdgeBits kept = surface.kept_bits;
    DM_TRY(hand_out(context, in, surface, options, 16 * rules.resolution / scale, options.map != 0 ? &traces : nullptr, out));
    DM_TRY(count(context, in, repaired, out));
#if defined(DELMESH_DEBUG_CHECKS)
    DM_TRY(validate_mesh(context, out)); // before the map, which does not have its names yet
#endif
    if (options.map != 0) {
        DM_TRY(context.stage("map", 0.93, 0.95));
        traces.merged = repaired;
        DM_TRY(map_corners(context, in, kept & kEdgeGiven, std::move(traces), out));
    }
    report.vertices_out = out.vertices();
    report.faces_out = out.faces();
    const MeshCounts &before = in.counts, &after = out.counts;
    report.topology_kept = before.components == after.components && before.boundary_loops == after.boundary_loops &&
                           before.euler_characteristic == after.euler_characteristic;

    DM_TRY(context.stage("certify", 0.95, 1));
    if (repaired) {
        const int32_t twice = edge_met_twice(out);
        if (twice >= 0)
            return context.fail(DELMESH_ERROR_PRECISION, "The output precision could not hold a manifold at face %d.",
                                out.face_source.empty() ? face_of(twice) : out.face_source[face_of(twice)]);
    }
    Certificate certificate;
    int64_t frozen = 0;
    DM_TRY(certify_unfrozen(context, out, rules.boundary_rule, certificate, frozen));
    report.nld_out = certificate.nld_interior + certificate.nld_boundary;
    report.certified = certificate.delaunay(rules.boundary_rule) ? 1 : 0;
    report.seconds_certify = watch.lap();
    if (report.certified == 0) {
        const int32_t face =
            certificate.first_zero_face >= 0 ? certificate.first_zero_face : face_of(certificate.first_bad_corner);
        const int32_t source = out.face_source.empty() ? face : out.face_source[face];
        return context.fail(DELMESH_ERROR_PRECISION,
                            "The output precision could not hold a Delaunay mesh at face %d: %lld NLD edges and %lld faces "
                            "without area were left.",
                            source, static_cast<long long>(report.nld_out), static_cast<long long>(certificate.zero_area_faces));
    }
    return DELMESH_OK;
}

} // namespace dm
