// SPDX-License-Identifier: Apache-2.0
// The driver: copy in, repair, keep edges, make Delaunay, hand out, certify. Each pass has its own file; this one decides nothing
// about geometry but the meaning of the options.
#include "algo/remesh.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

#include "algo/certify.h"
#include "algo/delaunay.h"
#include "algo/flat_patches.h"
#include "algo/repair.h"
#include "geom/predicates.h"
#include "mesh/build.h"
#include "mesh/surface.h"
#include "mesh/validate.h"

namespace dm {
namespace {

// How far the surface may move in all where float32 or float64 have no room for a split vertex, in units in the last place.
constexpr double kNeed = 64;
constexpr double kSplitRounding = 0.87; // units in the last place a rounded point may be off its place: sqrt(3) / 2

class Stopwatch {
public:
    double lap() {
        const auto now = std::chrono::steady_clock::now();
        const double seconds = std::chrono::duration<double>(now - last_).count();
        last_ = now;
        return seconds;
    }

private:
    std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

// Of the vertices that faces use.
double largest_coordinate(const Surface& s) {
    double largest = 0;
    for (int32_t v = 0; v < s.vertices(); ++v) {
        if (s.vert_corner[v] < 0) continue;
        const Vec3& x = s.at(v);
        largest = std::max({largest, std::fabs(x.x), std::fabs(x.y), std::fabs(x.z)});
    }
    return largest;
}

// Of their bounding box.
double diagonal(const Surface& s) {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    Vec3 low{kInfinity, kInfinity, kInfinity}, high{-kInfinity, -kInfinity, -kInfinity};
    for (int32_t v = 0; v < s.vertices(); ++v) {
        if (s.vert_corner[v] < 0) continue;
        const Vec3& x = s.at(v);
        low = {std::min(low.x, x.x), std::min(low.y, x.y), std::min(low.z, x.z)};
        high = {std::max(high.x, x.x), std::max(high.y, x.y), std::max(high.z, x.z)};
    }
    const Vec3 d = high - low;
    const double size = std::max({d.x, d.y, d.z});
    return size > 0 ? size * length((1 / size) * d) : 0; // float32 models can be too small for squares
}

// Distance from the largest coordinate to the next number of the precision.
double last_place(Precision precision, double largest) {
    if (precision == Precision::f64) return std::nextafter(largest, std::numeric_limits<double>::infinity()) - largest;
    const float f = static_cast<float>(largest);
    return static_cast<double>(std::nextafter(f, std::numeric_limits<float>::infinity())) - static_cast<double>(f);
}

// A power of two that brings a coordinate of this size near 1, if it is far from it.
double range_scale(double largest) {
    int exponent;
    std::frexp(largest, &exponent);
    return exponent > -200 && exponent < 200 ? 1 : std::ldexp(1.0, -std::min(std::max(exponent, -1000), 1000));
}

// cos of an angle in degrees, 0..180, by arithmetic alone: libm's differs between systems in the last place, and a decision
// must not.
double cosine_of_degrees(double degrees) {
    const bool obtuse = degrees > 90;
    const double x = (obtuse ? 180 - degrees : degrees) * 0.017453292519943295;
    double term = 1, sum = 1;
    for (int k = 2; k <= 24; k += 2) {
        term *= -x * x / static_cast<double>(k * (k - 1));
        sum += term;
    }
    return obtuse ? -sum : sum;
}

// Marks what the result's edges should tell about: which of them are edges of the source (diagonals of its polygons are not), and
// in feature mode those sharper than the angle.
Status mark_edges(Context& context, const Mesh& in, Surface& s, bool features, double feature_angle) {
    const double limit = features ? cosine_of_degrees(feature_angle) : 0;
    const bool polygons = in.imported && !in.face_source.empty();
    if (!features && !polygons) {
        for (uint8_t& bits : s.corner_bits) bits |= kEdgeSource;
        return DELMESH_OK;
    }
    for (int32_t c = 0; c < s.corners(); ++c) {
        if ((c & 0xfffff) == 0) DM_TRY(context.progress(0.5));
        const int32_t f = face_of(c), t = s.twin(c);
        if (s.is_dead(f) || (t >= 0 && t < c)) continue;
        uint8_t bits = s.corner_bits[c];
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

// -- hand out

int32_t source_of(const Mesh& in, const Surface& s, int32_t v) {
    v = s.copied(v);
    return in.imported && !in.vert_source.empty() ? in.vert_source[v] : v;
}

// Finds source faces. Made only when a split vertex asks for one, since it takes a pass over the mesh.
class Locator {
public:
    Locator(const Mesh& mesh, Memory& memory) : in(mesh), vert_corner(memory) {}

    // The place of x on the source, by walking through the faces from those around `from`; x lies on it up to `reach`, as
    // points inside flat patches do. False if the walk ends elsewhere.
    bool locate(int32_t from, const Vec3& x, double reach, VertexMap& map) {
        if (vert_corner.empty()) {
            vert_corner.assign(in.vertices(), -1);
            for (int32_t c = in.corners() - 1; c >= 0; --c) vert_corner[in.corner_vert[c]] = c;
        }
        int32_t c = vert_corner[from];
        if (c < 0) return false;
        // Start in the face around `from` that comes nearest to holding x.
        int32_t best = c;
        double best_weight = -std::numeric_limits<double>::infinity();
        for (int32_t k = c, steps = 0; steps < kMostSteps; ++steps) {
            const double weight = weights_in(face_of(k), x).least();
            if (weight > best_weight) best_weight = weight, best = k;
            k = in.corner_twin[prev_corner(k)];
            if (k < 0 || k == c) break;
        }
        int32_t f = face_of(best);
        for (int32_t steps = 0; steps < kMostSteps; ++steps) {
            const Weights w = weights_in(f, x);
            const int least = w.w[0] <= w.w[1] ? (w.w[0] <= w.w[2] ? 0 : 2) : (w.w[1] <= w.w[2] ? 1 : 2);
            if (!(w.w[least] < -1e-9)) {
                if (!(w.height <= reach)) return false;
                const double sum = std::max(0.0, w.w[0]) + std::max(0.0, w.w[1]) + std::max(0.0, w.w[2]);
                for (int k = 0; k < 3; ++k) {
                    const int32_t v = in.corner_vert[3 * f + k];
                    map.vert[k] = in.imported && !in.vert_source.empty() ? in.vert_source[v] : v;
                    map.weight[k] = std::max(0.0, w.w[k]) / sum;
                }
                return true;
            }
            const int32_t beyond = in.corner_twin[3 * f + (least + 1) % 3]; // the edge opposite to that corner
            if (beyond < 0) return false;
            f = face_of(beyond);
        }
        return false;
    }

private:
    static constexpr int32_t kMostSteps = 4096;
    struct Weights {
        double w[3], height;
        double least() const { return std::min({w[0], w[1], w[2]}); }
    };
    Weights weights_in(int32_t f, const Vec3& x) const {
        const Vec3 a = in.position(in.corner_vert[3 * f]), b = in.position(in.corner_vert[3 * f + 1]),
                   c = in.position(in.corner_vert[3 * f + 2]);
        const Vec3 n = cross(b - a, c - a);
        const double n2 = length_squared(n);
        if (!(n2 > 0)) return {{-1, -1, -1}, std::numeric_limits<double>::infinity()};
        const double wb = dot(n, cross(x - a, c - a)) / n2, wc = dot(n, cross(b - a, x - a)) / n2;
        return {{1 - wb - wc, wb, wc}, std::fabs(dot(n, x - a)) / std::sqrt(n2)};
    }

    const Mesh& in;
    Array<int32_t> vert_corner;
};

// Where the split vertices lie on the source, through carriers whose ends may be split vertices themselves (older ones).
void trace_splits(const Mesh& in, const Surface& s, double reach, Array<VertexMap>& maps) {
    Locator locator(in, maps.memory());
    maps.reserve(s.vertices() - s.first_split);
    for (int32_t v = s.first_split; v < s.vertices(); ++v) {
        const SplitVertex& split = s.split_vertices[v - s.first_split];
        const Carrier& line = s.carriers[split.carrier];
        struct Share {
            int32_t vert;
            double weight;
        } shares[6];
        int count = 0;
        const auto add = [&](int32_t vert, double weight) {
            for (int i = 0; i < count; ++i)
                if (shares[i].vert == vert) {
                    shares[i].weight += weight;
                    return;
                }
            shares[count++] = {vert, weight};
        };
        for (int end = 0; end < 2; ++end) {
            const int32_t x = end == 0 ? line.a : line.b;
            const double weight = end == 0 ? 1 - split.t : split.t;
            if (s.is_original(x))
                add(source_of(in, s, x), weight);
            else {
                const VertexMap& m = maps[x - s.first_split];
                for (int k = 0; k < 3; ++k)
                    if (m.weight[k] != 0) add(m.vert[k], weight * m.weight[k]);
            }
        }
        // Ends inside different edges make more than three. In a flat patch the point has a place on the source all the same; in
        // the flip modes it may not, and then it is the three that matter most.
        for (int i = 1; i < count; ++i)
            for (int k = i; k > 0 && (shares[k].weight > shares[k - 1].weight ||
                                      (shares[k].weight == shares[k - 1].weight && shares[k].vert < shares[k - 1].vert));
                 --k)
                std::swap(shares[k], shares[k - 1]);
        VertexMap found;
        if (count > 3) {
            bool located = false;
            for (int i = 0; i < count && !located; ++i) located = locator.locate(shares[i].vert, s.at(v), reach, found);
            if (located) {
                maps.push_back(found);
                continue;
            }
        }
        count = std::min(count, 3);
        double sum = 0;
        for (int i = 0; i < count; ++i) sum += shares[i].weight;
        VertexMap map{{shares[0].vert, shares[0].vert, shares[0].vert}, {0, 0, 0}};
        for (int i = 0; i < count; ++i) {
            map.vert[i] = shares[i].vert;
            map.weight[i] = count == 1 ? 1 : sum == 1 ? shares[i].weight : shares[i].weight / sum;
        }
        maps.push_back(map);
    }
}

Status hand_out(Context& context, const Mesh& in, Surface& s, const delmesh_remesh_options& options, double reach, Mesh& out) {
    Memory& memory = context.memory();
    // Faces: dead ones are closed up, in place, keeping the order.
    if (s.dead_faces != 0) {
        Array<int32_t> moved(memory, s.faces(), -1);
        int32_t live = 0;
        for (int32_t f = 0; f < s.faces(); ++f)
            if (!s.is_dead(f)) moved[f] = live++;
        for (int32_t f = 0; f < s.faces(); ++f) {
            if (moved[f] < 0) continue;
            for (int32_t k = 0; k < 3; ++k) {
                const int32_t from = 3 * f + k, to = 3 * moved[f] + k, t = s.corner_twin[from];
                s.corner_vert[to] = s.corner_vert[from];
                s.corner_bits[to] = s.corner_bits[from];
                s.corner_twin[to] = t >= 0 ? 3 * moved[face_of(t)] + t % 3 : t;
                if (is_cut(t)) s.cut_slots[cut_slot(t)].corner = to;
            }
            s.face_src[moved[f]] = s.face_src[f];
        }
        s.corner_vert.resize_uninitialized(3 * static_cast<int64_t>(live));
        s.corner_bits.resize_uninitialized(3 * static_cast<int64_t>(live));
        s.corner_twin.resize_uninitialized(3 * static_cast<int64_t>(live));
        s.face_src.resize_uninitialized(live);
    }
    DM_TRY(context.progress(0.2));
    // Vertices.
    const int32_t all = s.vertices();
    Array<int32_t> moved(memory);
    int32_t count = all;
    bool unused_splits = false; // a split vertex that was collapsed away is nobody's vertex
    for (int32_t v = s.first_split; v < all; ++v) unused_splits |= s.vert_corner[v] < 0;
    if (options.compact != 0 || unused_splits) {
        moved.assign(all, -1);
        for (const int32_t v : s.corner_vert) moved[v] = 0;
        if (options.compact == 0)
            for (int32_t v = 0; v < s.first_split; ++v) moved[v] = 0;
        count = 0;
        for (int32_t v = 0; v < all; ++v)
            if (moved[v] == 0) moved[v] = count++;
        for (int32_t& v : s.corner_vert) v = moved[v];
    }
    const auto stays = [&](int32_t v) { return moved.empty() || moved[v] >= 0; };
    out.precision = options.precision == DELMESH_FLOAT32 ? Precision::f32 : Precision::f64;
    out.vertex_count = count;
    const auto write = [&](auto& positions) {
        positions.resize_uninitialized(3 * static_cast<int64_t>(count));
        int64_t i = 0;
        for (int32_t v = 0; v < all; ++v) {
            if (!stays(v)) continue;
            using Real = std::remove_reference_t<decltype(positions[0])>;
            const Vec3 x = s.is_original(v) ? round_to(out.precision, in.position(s.copied(v))) : s.at(v);
            positions[i++] = static_cast<Real>(x.x); // exact: rounded when it was made
            positions[i++] = static_cast<Real>(x.y);
            positions[i++] = static_cast<Real>(x.z);
        }
    };
    if (out.precision == Precision::f32)
        write(out.pos32);
    else
        write(out.pos64);
    DM_TRY(context.progress(0.5));
    // Where everything comes from.
    Array<VertexMap> maps(memory);
    trace_splits(in, s, reach, maps);
    if (options.compact != 0 || (in.imported && !in.vert_source.empty()) || s.first_split != s.first_copy || !maps.empty()) {
        out.vert_source.reserve(count);
        for (int32_t v = 0; v < all; ++v)
            if (stays(v)) out.vert_source.push_back(s.is_original(v) ? source_of(in, s, v) : -1);
    }
    if (!s.vert_root.empty() || s.first_split != s.first_copy || !in.vert_join.empty()) {
        out.vert_join.reserve(count);
        Array<int32_t> stand_in(memory); // for a root that is left out: the first of its copies that stays
        if (!moved.empty()) stand_in.assign(all, -1);
        for (int32_t v = 0; v < all; ++v) {
            if (!stays(v)) continue;
            int32_t root = v;
            if (!s.vert_root.empty())
                root = s.root(v);
            else if (s.is_original(v)) {
                root = s.copied(v);
                if (!in.vert_join.empty()) root = in.vert_join[root];
            }
            if (!stays(root)) {
                if (stand_in[root] < 0) stand_in[root] = v;
                root = stand_in[root];
            }
            out.vert_join.push_back(moved.empty() ? root : moved[root]);
        }
    }
    if (unused_splits) {
        int64_t kept = 0;
        for (int32_t v = s.first_split; v < all; ++v)
            if (stays(v)) maps[kept++] = maps[v - s.first_split];
        maps.resize_uninitialized(kept);
    }
    out.split_map = std::move(maps);
    out.first_split = count - static_cast<int32_t>(out.split_map.size());
    const bool same_faces = s.faces() == in.faces() && s.dead_faces == 0;
    const bool look_through = in.imported && !in.face_source.empty();
    if (look_through || !same_faces) {
        if (look_through)
            for (int32_t& f : s.face_src) f = in.face_source[f];
        out.face_source = std::move(s.face_src);
    }
    out.corner_vert = std::move(s.corner_vert);
    out.corner_twin = std::move(s.corner_twin);
    out.corner_bits = std::move(s.corner_bits);
    out.cut_slots = std::move(s.cut_slots);
    return DELMESH_OK;
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
    for (const int32_t twin : out.corner_twin) n.boundary_edges += twin < 0 ? 1 : 0;
    n.edges = (out.corners() + n.boundary_edges) / 2;
    n.components = in.counts.components;
    n.boundary_loops = in.counts.boundary_loops;
    n.euler_characteristic = in.counts.euler_characteristic;
    n.isolated_vertices = out.vertices() - (n.euler_characteristic + n.edges - out.faces());
    return DELMESH_OK;
}

} // namespace

Status remesh(Context& context, const Mesh& in, const delmesh_remesh_options& options, Mesh& out, delmesh_remesh_report& report) {
    Stopwatch watch;
    const Precision precision = options.precision == DELMESH_FLOAT32 ? Precision::f32 : Precision::f64;
    const bool preserve = options.mode == DELMESH_MODE_PRESERVE;
    report.vertices_in = in.vertices();
    report.faces_in = in.faces();
    report.surface_bound = -1;
    if (in.faces() == 0) return context.fail(DELMESH_ERROR_NO_SURFACE, "The mesh had no face.");

    DM_TRY(context.stage("repair", 0, 0.1));
    Surface surface(context, in, precision);
    for (int32_t v = 0; v < surface.vertices(); ++v)
        if (surface.vert_corner[v] >= 0 && !is_finite(surface.at(v)))
            return context.fail(DELMESH_ERROR_PRECISION, "Vertex %d was out of the output precision's range.", v);
    DM_TRY(repair_zero_area(context, surface, options.strict != 0, report));
    // Far from 1, float64 lengths lose the range that their products need. Input vertices are handed out as they were given, and
    // the certificate looks at those.
    double largest = largest_coordinate(surface);
    const double scale = precision == Precision::f64 ? range_scale(largest) : 1;
    if (scale != 1) {
        for (Vec3& x : surface.pos) x = scale * x;
        largest *= scale;
    }
    DelaunayRules rules;
    rules.precision = precision;
    rules.boundary_rule = options.boundary == DELMESH_BOUNDARY_NONOBTUSE;
    rules.shells = options.placement == DELMESH_PLACEMENT_SHELLS;
    rules.shell_unit = options.shell_unit > 0 ? scale * options.shell_unit : diagonal(surface) / 1024;
    rules.min_turn_cosine =
        options.max_normal_turn >= 0 && options.max_normal_turn < 180 ? cosine_of_degrees(options.max_normal_turn) : -2;
    rules.resolution = last_place(precision, largest);
    const int64_t most = std::numeric_limits<int32_t>::max() / 6; // corners stay below 2^31
    if (in.vertices() > most)
        return context.fail(DELMESH_ERROR_TOO_LARGE, "The mesh had more than %lld vertices.", static_cast<long long>(most));
    rules.max_vertices =
        std::min(options.max_vertices > 0 ? options.max_vertices : 16 * static_cast<int64_t>(in.vertices()) + 10000, most);
    rules.split_budget = options.split_budget > 0 ? options.split_budget : in.vertices() / 50 + 200;
    DM_TRY(mark_edges(context, in, surface, options.mode == DELMESH_MODE_FEATURE, options.feature_angle));
    report.seconds_repair = watch.lap();

    // The tolerance is spent on three things that add up: the slab of a patch, flips outside of patches, and the rounding of
    // split vertices (half a unit in each coordinate, so less than 0.87 in all). A part is kept back for the places where the
    // precision has no room for a split vertex.
    const double tolerance = options.tolerance < 0 ? 4 * rules.resolution : scale * options.tolerance;
    if (preserve) rules.free_movement = 0.85 * std::max(0.0, tolerance - kSplitRounding * rules.resolution);
    // A tolerance that the caller gave is kept, but for what the rounding of coordinates alone can do.
    rules.need = options.tolerance < 0 ? kNeed * rules.resolution : std::max(tolerance, 4 * rules.resolution);
    FlatPatches patches(context.memory());
    if (preserve) {
        DM_TRY(context.stage("flat patches", 0.1, 0.2));
        DM_TRY(grow_flat_patches(context, surface, rules.free_movement, patches));
    }
    DM_TRY(context.stage(preserve ? "split" : "flip", 0.2, 0.9));
    const Status status = make_delaunay(context, surface, preserve ? &patches : nullptr, rules, report);
    (report.splits == 0 ? report.seconds_flip : report.seconds_split) = watch.lap();
    report.vertices_out = surface.vertices();
    report.faces_out = surface.faces() - surface.dead_faces;
    DM_TRY(status);
    DM_ASSERT(surface.valid());
    if (preserve) {
        // In float32 a split point is rounded once; in float64 so are the ends of the line it lies on, if they are split points.
        int32_t roundings = 0;
        for (const SplitVertex& split : surface.split_vertices)
            roundings = std::max(roundings, precision == Precision::f32 ? 1 : split.depth);
        double moved = 0;
        for (int32_t f = 0; f < surface.faces(); ++f)
            if (!surface.is_dead(f)) moved = std::max(moved, patches.moved(f));
        report.surface_bound = (moved + roundings * kSplitRounding * rules.resolution) / scale;
    }
    patches.face_patch.free_storage();
    patches.plane.free_storage();
    patches.drift.free_storage();

    DM_TRY(context.stage("export", 0.9, 0.95));
    const bool repaired = surface.dead_faces != 0 || surface.first_split != surface.first_copy;
    if (scale != 1)
        for (Vec3& x : surface.pos) x = (1 / scale) * x;
    DM_TRY(hand_out(context, in, surface, options, 16 * rules.resolution / scale, out));
    DM_TRY(count(context, in, repaired, out));
#if defined(DELMESH_DEBUG_CHECKS)
    DM_TRY(validate_mesh(context, out));
#endif
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
    DM_TRY(certify_mesh(context, out, rules.boundary_rule, certificate, nullptr, nullptr));
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
