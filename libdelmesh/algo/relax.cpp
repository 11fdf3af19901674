// SPDX-License-Identifier: Apache-2.0
// Gauss-Seidel on least squares. The input is sampled once; every sample knows the face of the level that it is closest to, and
// every face has a list of its samples. In a sweep each vertex solves for the place where the samples around it, and points of the
// level around it seen from the input, fit best while the others stay. A move is made only if no edge stops being Delaunay,
// nothing folds, and the cost falls. Samples then go to the closest face of the star; the next sweep looks for the closest of all.
//
// Vertices of one colour share neither a face nor an edge that either could make non-Delaunay: they move at the same time, and
// the result does not depend on the number of threads.
#include "algo/relax.h"

#include <algorithm>
#include <climits>
#include <cmath>

#include "algo/parallel_slices.h"
#include "geom/angle.h"
#include "geom/bvh.h"
#include "geom/closest_point.h"
#include "geom/low_discrepancy.h"
#include "geom/predicates.h"

namespace dm {
namespace {

constexpr int kMostSpokes = 64;
constexpr int kMostSpots = 4 * kMostSpokes + 4;
constexpr int kMostLimits = 6;
constexpr int kMostColours = 2 * kMostSpokes + 2; // a star has so many vertices and vertices beyond at most
constexpr uint8_t kNoColour = 255;
constexpr uint8_t kMoved = 1, kMovedNow = 2;                       // ever, in this sweep
constexpr double kLeastSamples = 100000, kMostSamplesPerFace = 64; // of a level that is far coarser than its input
constexpr double kStiffness = 0.01;                                // of moves along the surface, against those off it
constexpr double kFar = 4;            // times the RMS distance: where the cost begins to grow faster than the square,
constexpr double kFarWeight = 2;      // by this at that distance, for every sample alike
constexpr double kLeastMove = 1e-10;  // of the model's size: not worth a move
constexpr int kTries = 5;             // lengths of a step, each half of the one before
constexpr int64_t kSampleGrain = 256; // closest-point queries
constexpr int64_t kMoveGrain = 4;     // vertices
constexpr int64_t kProgressEvery = 1 << 16;

// There are many of both. Where float32 rounds a sample to is as good a place to look from, and that distances are rounded is not
// seen in sums of many; every comparison is between rounded ones.
struct Sample {  // of the input
    float at[3]; // in the frame
    float distance2, new_distance2;
    float weight;
    int32_t face; // of the level; in a trial, the number of the spoke
    int32_t next; // in the face's list

    Vec3 place() const { return {at[0], at[1], at[2]}; }
};

struct Spot { // a point of the level
    float distance2;
    float weight;
    int32_t near; // triangle of the input
};

Vec3 normal(const Bvh::Triangle& t) {
    return cross(t.corner[1] - t.corner[0], t.corner[2] - t.corner[0]);
}

double cotangent(const Vec3& apex, const Vec3& a, const Vec3& b) {
    const Vec3 u = a - apex, v = b - apex;
    return dot(u, v) / length(cross(u, v));
}

Box box_of(const Mesh& a, const Mesh& b) {
    Box box = used_box(a);
    box.extend(used_box(b));
    return box;
}

// The normal equations of one vertex's step.
class Equations {
public:
    // A point that follows `share` of the step is off by `residual`, across n (not normalised; 0: as the residual lies).
    void add(double weight, double share, const Vec3& residual, Vec3 n) {
        double size = length_squared(n);
        if (!(size > 0)) size = length_squared(n = residual);
        if (!(size > 0)) return;
        const double first = weight * share, second = first * share;
        const double across = (1 - kStiffness) * second / size, along = kStiffness * second;
        xx += across * n.x * n.x + along;
        xy += across * n.x * n.y;
        xz += across * n.x * n.z;
        yy += across * n.y * n.y + along;
        yz += across * n.y * n.z;
        zz += across * n.z * n.z + along;
        pull = pull + first * residual;
    }
    bool invert() {
        const double a = yy * zz - yz * yz, b = xz * yz - xy * zz, c = xy * yz - xz * yy;
        const double determinant = xx * a + xy * b + xz * c, d = xx * zz - xz * xz, e = xy * xz - xx * yz, f = xx * yy - xy * xy;
        if (!(determinant > 0)) return false;
        const double inverse = 1 / determinant;
        xx = inverse * a, xy = inverse * b, xz = inverse * c, yy = inverse * d, yz = inverse * e, zz = inverse * f;
        return std::isfinite(inverse);
    }
    Vec3 step(const Vec3& p) const { // for that pull, after invert()
        return {xx * p.x + xy * p.y + xz * p.z, xy * p.x + yy * p.y + yz * p.z, xz * p.x + yz * p.y + zz * p.z};
    }
    Vec3 pull{0, 0, 0};

private:
    double xx = 0, xy = 0, xz = 0, yy = 0, yz = 0, zz = 0;
};

class Relaxation {
public:
    Relaxation(Context& context_, const Mesh& in_, const RelaxRules& rules_, const uint8_t* stays_, Mesh& level_)
        : context(context_), in(in_), rules(rules_), stays(stays_), level(level_), frame(box_of(in_, level_)),
          in_bvh(context_.memory()), samples(context_.memory()), head(context_.memory()), spots(context_.memory()),
          at(context_.memory()), edge_number(context_.memory()), first_corner(context_.memory()), has_moved(context_.memory()),
          order(context_.memory()) {}
    Status run(int64_t& moved);

private:
    struct Spoke {
        int32_t corner; // of a face, at the vertex; -1 for the last of an open star
        int32_t ring;   // the neighbour
        int32_t beyond; // opposite to the face's outer edge; -1: none
    };
    struct Star {
        int count = 0; // faces; a closed star has as many spokes, an open one has one more
        bool open = false;
        Spoke spokes[kMostSpokes + 1];
        int spoke_count() const { return count + (open ? 1 : 0); }
        const Spoke& after(int i) const { return spokes[i + 1 < count || open ? i + 1 : 0]; }
        int before(int i) const { return i > 0 ? i - 1 : open ? -1 : count - 1; } // -1: none
    };
    // A spot around the vertex that moves, and how it follows.
    struct Follower {
        int32_t spot;
        double share;
        Vec3 rest; // spot = share * vertex + rest
        int32_t new_near;
        float new_distance2;
    };

    Status check_count(int64_t count) const {
        if (count <= INT_MAX) return DELMESH_OK;
        return context.fail(DELMESH_ERROR_TOO_LARGE, "The mesh has too many faces for relaxation: it takes %lld samples.",
                            static_cast<long long>(count));
    }
    Status make_samples();
    Status find_places();
    Status find_closest();
    Status look_back();
    Status sweep(double from, double to);
    bool has_moved_now();

    bool gather(int32_t v, Star& star) const;
    void move(int32_t v);
    int follow(const Star& star, int32_t v, Follower* followers) const;
    bool slide(const Star& star, int32_t v, const Equations& equations, const Vec3& step, Vec3& slid) const;
    bool is_allowed(const Star& star, int32_t v, const Vec3& x) const;
    double try_samples(const Star& star, const Vec3& x, double most);
    void hand_over(const Star& star);

    double cost(double weight, double far_weight, double distance2) const {
        const double r = distance2 * per_far2;
        return distance2 * (weight + far_weight * r * r);
    }
    double slope(double weight, double far_weight, double distance2) const { // of the cost over the squared distance
        const double r = distance2 * per_far2;
        return weight + 3 * far_weight * r * r;
    }
    double sample_cost(const Sample& s, double distance2) const { return cost(s.weight, far_sample, distance2); }
    double spot_cost(const Spot& s, double distance2) const { return cost(s.weight, far_spot, distance2); }
    // Spots: a face's centroid, three on every edge, and the vertices.
    int32_t edge_owner(int32_t c) const {
        const int32_t twin = level.corner_twin[c];
        return twin >= 0 && twin < c ? twin : c;
    }
    int64_t edge_spot(int32_t c) const { return level.faces() + 3 * static_cast<int64_t>(edge_number[c]); }
    int64_t vert_spot(int32_t v) const { return level.faces() + 3 * static_cast<int64_t>(edges) + v; }
    Vec3 face_normal(int32_t f) const {
        const Vec3& a = at[level.corner_vert[3 * f]];
        return cross(at[level.corner_vert[3 * f + 1]] - a, at[level.corner_vert[3 * f + 2]] - a);
    }

    Context& context;
    const Mesh& in;
    const RelaxRules& rules;
    const uint8_t* stays;
    Mesh& level;
    const Frame frame;
    Bvh in_bvh;
    Array<Sample> samples;
    Array<int32_t> head; // per face, of the list of its samples
    Array<Spot> spots;
    Array<Vec3> at;             // of the level's vertices, in the frame; what exact tests see are its positions
    Array<int32_t> edge_number; // per corner
    int32_t edges = 0;
    Array<int32_t> first_corner; // of a vertex; at the boundary the one where its star begins
    Array<uint8_t> has_moved;    // kMoved*
    Array<int32_t> order;        // vertices that may move, by colours
    int64_t colour_begin[kMostColours + 1] = {};
    int colours = 0;
    double per_far2 = 0, far_sample = 0, far_spot = 0;
};

// All vertices, weighted by the quadrature rule of degree two, and points spread over the faces by area. In the order of the
// hierarchy: neighbours in number are neighbours in space.
Status Relaxation::make_samples() {
    Memory& memory = context.memory();
    const double wanted = std::max<double>(in.faces(), std::min(kLeastSamples, kMostSamplesPerFace * level.faces()));
    double total = 0;
    for (int32_t t = 0; t < in_bvh.size(); ++t) total += length(normal(in_bvh.triangle(t)));
    if (!(total > 0)) return DELMESH_OK;
    DM_TRY(context.progress(0));
    const auto count_in = [&](double share) { return std::max<int64_t>(1, static_cast<int64_t>(share * wanted + 0.5)); };
    Array<float> weights(memory, in.vertices(), -1.0f); // of vertices, while they have none
    int64_t count = 0;
    for (int32_t t = 0; t < in_bvh.size(); ++t) {
        if (t % kProgressEvery == 0) DM_TRY(context.progress(0.5 * t / in_bvh.size()));
        const double share = length(normal(in_bvh.triangle(t))) / total;
        count += count_in(share);
        for (int32_t k = 0; k < 3; ++k) {
            float& weight = weights[in.corner_vert[3 * in_bvh.face(t) + k]];
            if (weight < 0) weight = 0, ++count;
            weight += static_cast<float>(share / 12);
        }
    }
    DM_TRY(check_count(count));
    samples.reserve(count);
    const auto add = [&](const Vec3& p, float weight) {
        samples.push_back({{static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)}, 0, 0, weight, -1, -1});
    };
    for (int32_t t = 0; t < in_bvh.size(); ++t) {
        if (t % kProgressEvery == 0) DM_TRY(context.progress(0.5 + 0.5 * t / in_bvh.size()));
        const Bvh::Triangle& triangle = in_bvh.triangle(t);
        const double share = length(normal(triangle)) / total;
        for (int32_t k = 0; k < 3; ++k) {
            float& weight = weights[in.corner_vert[3 * in_bvh.face(t) + k]];
            if (weight >= 0) add(triangle.corner[k], weight);
            weight = -1;
        }
        const int64_t inside = count_in(share);
        const float weight = static_cast<float>(0.75 * share / static_cast<double>(inside));
        for (int64_t i = 0; i < inside; ++i) add(low_discrepancy_point(triangle.corner, static_cast<uint64_t>(i)), weight);
    }
    return DELMESH_OK;
}

// Who may move, and the colours.
Status Relaxation::find_places() {
    Memory& memory = context.memory();
    const int32_t verts = level.vertices();
    at.resize_uninitialized(verts);
    has_moved.assign(verts, 0);
    first_corner.assign(verts, -1);
    edge_number.resize_uninitialized(level.corners());
    edges = 0;
    Array<uint8_t> creases(memory, verts, 0), colour(memory, verts, kNoColour);
    for (int32_t v = 0; v < verts; ++v) {
        if (v % kProgressEvery == 0) DM_TRY(context.progress(0));
        at[v] = frame(level.position(v));
        if (stays != nullptr && stays[v] != 0) creases[v] = 3;
    }
    for (int32_t c = 0; c < level.corners(); ++c) {
        if (c % kProgressEvery == 0) DM_TRY(context.progress(0.25));
        const int32_t v = level.corner_vert[c], w = level.corner_vert[next_corner(c)];
        const bool boundary = level.corner_twin[c] < 0;
        if (first_corner[v] < 0 || boundary) first_corner[v] = c;
        const int32_t owner = edge_owner(c);
        edge_number[c] = owner == c ? edges++ : edge_number[owner];
        if (owner != c) continue;
        const EdgeBits bits = level.corner_bits.empty() ? 0 : level.corner_bits[c];
        if (!boundary && (bits & rules.kept_bits) == 0) continue;
        const int step = (bits & rules.kept_bits & kEdgeGiven) != 0 ? 3 : 1;
        creases[v] = static_cast<uint8_t>(std::min(3, creases[v] + step));
        creases[w] = static_cast<uint8_t>(std::min(3, creases[w] + step));
    }
    DM_TRY(context.progress(0.5));
    Star star;
    int64_t count[kMostColours] = {};
    for (int32_t v = 0; v < verts; ++v) {
        if (v % kProgressEvery == 0) DM_TRY(context.progress(0.5 + 0.5 * v / verts));
        if (first_corner[v] < 0 || creases[v] == 1 || creases[v] > 2 || !gather(v, star)) continue;
        bool used[kNoColour + 1] = {};
        for (int i = 0; i < star.spoke_count(); ++i) {
            used[colour[star.spokes[i].ring]] = true;
            if (star.spokes[i].beyond >= 0) used[colour[star.spokes[i].beyond]] = true;
        }
        int k = 0;
        while (used[k]) ++k;
        colour[v] = static_cast<uint8_t>(k);
        ++count[k];
        colours = std::max(colours, k + 1);
    }
    int64_t place[kMostColours];
    for (int k = 0; k < colours; ++k) {
        place[k] = colour_begin[k];
        colour_begin[k + 1] = colour_begin[k] + count[k];
    }
    order.resize_uninitialized(colour_begin[colours]);
    for (int32_t v = 0; v < verts; ++v)
        if (colour[v] != kNoColour) order[place[colour[v]]++] = v;
    return DELMESH_OK;
}

Status Relaxation::find_closest() {
    Bvh bvh(context.memory());
    DM_TRY(bvh.build(context, level, frame));
    Array<int32_t> place(context.memory(), level.faces());
    for (int32_t t = 0; t < bvh.size(); ++t) place[bvh.face(t)] = t;
    DM_TRY(context.progress(1));
    const bool known = !head.empty();
    for (int32_t f = 0; known && f < level.faces(); ++f) { // trials leave other numbers there
        if (f % kProgressEvery == 0) DM_TRY(context.progress(1));
        for (int32_t i = head[f]; i >= 0; i = samples[i].next) samples[i].face = f;
    }
    DM_TRY(parallel_slices(context, samples.size(), kSampleGrain, 1, 1, [&](int64_t, int64_t begin, int64_t end) {
        int32_t near = 0;
        for (int64_t i = begin; i < end; ++i) {
            Sample& s = samples[i];
            const Bvh::Hit hit = bvh.closest(s.place(), known ? place[s.face] : near);
            near = hit.triangle;
            s.face = bvh.face(near);
            s.distance2 = static_cast<float>(hit.distance_squared);
        }
    }));
    head.assign(level.faces(), -1);
    for (int64_t i = samples.size() - 1; i >= 0; --i) {
        if (i % kProgressEvery == 0) DM_TRY(context.progress(1));
        samples[i].next = head[samples[i].face];
        head[samples[i].face] = static_cast<int32_t>(i);
    }
    return context.progress(1);
}

// How far the level's own points are from the input. Later on every move keeps that up to date.
Status Relaxation::look_back() {
    const int32_t faces = level.faces();
    DM_TRY(check_count(vert_spot(level.vertices())));
    DM_TRY(fill(context, spots, vert_spot(level.vertices()), Spot{0, 0, 0}));
    double total = 0;
    for (int32_t f = 0; f < faces; ++f) total += length(face_normal(f));
    if (!(total > 0)) total = 1;
    DM_TRY(context.progress(0));
    for (int32_t f = 0; f < faces; ++f) {
        if (f % kProgressEvery == 0) DM_TRY(context.progress(0));
        const double share = length(face_normal(f)) / total;
        const auto add = [&](int64_t spot, double weight) { spots[spot].weight += static_cast<float>(weight); };
        add(f, 0.45 * share);
        for (int32_t c = 3 * f; c < 3 * f + 3; ++c) {
            for (int j = 0; j < 3; ++j) add(edge_spot(c) + j, (j == 1 ? 2 : 1) * share / 30);
            add(vert_spot(level.corner_vert[c]), 0.05 * share);
        }
    }
    return parallel_slices(context, faces, 32, 0, 1, [&](int64_t, int64_t begin, int64_t end) {
        int32_t near = 0;
        const auto look = [&](int64_t spot, const Vec3& p) {
            const Bvh::Hit hit = in_bvh.closest(p, near);
            spots[spot].distance2 = static_cast<float>(hit.distance_squared);
            spots[spot].near = near = hit.triangle;
        };
        for (int32_t f = static_cast<int32_t>(begin); f < end; ++f) {
            Vec3 p[3];
            for (int k = 0; k < 3; ++k) p[k] = at[level.corner_vert[3 * f + k]];
            look(f, (1.0 / 3) * (p[0] + p[1] + p[2]));
            for (int k = 0; k < 3; ++k) {
                const int32_t c = 3 * f + k, v = level.corner_vert[c];
                if (edge_owner(c) == c)
                    for (int j = 0; j < 3; ++j)
                        look(edge_spot(c) + j, (0.75 - 0.25 * j) * p[k] + (0.25 + 0.25 * j) * p[(k + 1) % 3]);
                if (first_corner[v] == c) look(vert_spot(v), p[k]);
            }
        }
    });
}

bool Relaxation::gather(int32_t v, Star& star) const {
    const int32_t first = first_corner[v];
    star.count = 0;
    star.open = level.corner_twin[first] < 0;
    int32_t c = first;
    do {
        if (star.count == kMostSpokes) return false;
        const int32_t across = level.corner_twin[next_corner(c)];
        star.spokes[star.count++] = {c, level.corner_vert[next_corner(c)],
                                     across < 0 ? -1 : level.corner_vert[prev_corner(across)]};
        c = level.corner_twin[prev_corner(c)];
    } while (c >= 0 && c != first);
    if (star.open) star.spokes[star.count] = {-1, level.corner_vert[prev_corner(star.spokes[star.count - 1].corner)], -1};
    return true;
}

int Relaxation::follow(const Star& star, int32_t v, Follower* followers) const {
    int count = 0;
    const auto add = [&](int64_t spot, double share, const Vec3& rest) {
        followers[count++] = {static_cast<int32_t>(spot), share, rest, 0, 0};
    };
    const auto add_edge = [&](int32_t c, bool leaves_v, const Vec3& end) {
        const bool first_is_near = (edge_owner(c) == c) == leaves_v;
        for (int j = 0; j < 3; ++j) {
            const double share = first_is_near ? 0.75 - 0.25 * j : 0.25 + 0.25 * j;
            add(edge_spot(c) + j, share, (1 - share) * end);
        }
    };
    add(vert_spot(v), 1, {0, 0, 0});
    for (int i = 0; i < star.count; ++i) {
        const int32_t c = star.spokes[i].corner;
        const Vec3 &a = at[star.spokes[i].ring], &b = at[star.after(i).ring];
        add(face_of(c), 1.0 / 3, (1.0 / 3) * (a + b));
        add_edge(c, true, a);
        if (star.open && i == star.count - 1) add_edge(prev_corner(c), false, b);
    }
    return count;
}

// Where the step would make edges non-Delaunay: the best step, by the same equations, that to first order keeps the sums of their
// cotangents from falling below 0. False if there are no such edges.
bool Relaxation::slide(const Star& star, int32_t v, const Equations& equations, const Vec3& step, Vec3& slid) const {
    struct Limit {
        int edge;
        double left;        // cotangents now
        Vec3 gradient, way; // way: the step for that pull
        double per_pull;
    } limits[kMostLimits];
    int count = 0;
    const Vec3& o = at[v];
    slid = step;
    for (int round = 0; round < 3; ++round) {
        const int known = count;
        for (int edge = 0; edge < 2 * star.spoke_count() && count < kMostLimits; ++edge) {
            const int i = edge / 2, before = star.before(i);
            const bool outer = edge % 2 != 0, has_face = i < star.count;
            if (outer && !has_face) continue;
            const Vec3& ring = at[star.spokes[i].ring];
            // The edge's other end or its apexes.
            const Vec3* next = has_face ? &at[star.after(i).ring] : nullptr;
            const int32_t other = outer ? star.spokes[i].beyond : before >= 0 ? star.spokes[before].ring : -1;
            if ((other < 0 || next == nullptr) && !rules.boundary_rule) continue;
            const auto cotangents = [&](const Vec3& x) {
                const double sum = next == nullptr ? 0 : outer ? cotangent(x, ring, *next) : cotangent(*next, x, ring);
                if (other < 0) return sum;
                return sum + (outer ? cotangent(at[other], ring, *next) : cotangent(at[other], x, ring));
            };
            if (!(cotangents(o + slid) < 0)) continue;
            bool again = false;
            for (int k = 0; k < count; ++k) again = again || limits[k].edge == edge;
            if (again) continue;
            const double h = 1e-6 * length(ring - o);
            const Vec3 dx{h, 0, 0}, dy{0, h, 0}, dz{0, 0, h};
            const Vec3 gradient =
                (0.5 / h) * Vec3{cotangents(o + dx) - cotangents(o - dx), cotangents(o + dy) - cotangents(o - dy),
                                 cotangents(o + dz) - cotangents(o - dz)};
            const Vec3 way = equations.step(gradient);
            const double per_pull = dot(gradient, way);
            if (per_pull > 0) limits[count++] = {edge, cotangents(o), gradient, way, per_pull};
        }
        if (count == known) break;
        slid = step;
        for (int pass = 0; pass < 4; ++pass)
            for (int k = 0; k < count; ++k) {
                const Limit& limit = limits[k];
                const double change = dot(limit.gradient, slid), below = change + 0.9 * limit.left;
                if (below < 0) slid = slid + ((0.02 * std::fabs(change) - below) / limit.per_pull) * limit.way;
            }
    }
    return count > 0 && is_finite(slid);
}

// May v be at x? The exact tests see the positions as rounded.
bool Relaxation::is_allowed(const Star& star, int32_t v, const Vec3& x) const {
    const Vec3 old = level.position(v);
    Vec3 now[kMostSpokes], was[kMostSpokes];
    for (int i = 0; i < star.count; ++i) {
        const Vec3 a = level.position(star.spokes[i].ring), b = level.position(star.after(i).ring);
        now[i] = cross(a - x, b - x);
        was[i] = cross(a - old, b - old);
        if (!turns_less(now[i], was[i], rules.fold_cosine) || zero_area(x, a, b)) return false;
    }
    // Many small turns must not fold either: no edge becomes sharper than the limit, or than it is.
    const auto folds = [&](const Vec3& m, const Vec3& n, const Vec3& m_was, const Vec3& n_was) {
        const double bend = cosine_between(m, n);
        return bend < rules.sharpest && bend < cosine_between(m_was, n_was);
    };
    for (int i = 0; i < star.count; ++i) {
        const Spoke& spoke = star.spokes[i];
        const Vec3 a = level.position(spoke.ring), b = level.position(star.after(i).ring);
        if (spoke.beyond >= 0) {
            const Vec3 o = level.position(spoke.beyond);
            const Vec3 outside = cross(o - a, b - a);
            if (folds(now[i], outside, was[i], outside) || edge_is_nld(a, b, x, o)) return false;
        } else if (rules.boundary_rule && boundary_edge_is_nld(a, b, x))
            return false;
        const int before = star.before(i);
        if (before >= 0) {
            if (folds(now[i], now[before], was[i], was[before])) return false;
            if (edge_is_nld(x, a, level.position(star.spokes[before].ring), b)) return false;
        } else if (rules.boundary_rule && boundary_edge_is_nld(x, a, b))
            return false;
    }
    return !star.open || !rules.boundary_rule ||
           !boundary_edge_is_nld(x, level.position(star.spokes[star.count].ring),
                                 level.position(star.spokes[star.count - 1].ring));
}

// What the samples of the star would cost with its vertex at x, and which face each would be closest to. No further than `most`.
double Relaxation::try_samples(const Star& star, const Vec3& x, double most) {
    Vec3 normals[kMostSpokes];
    double sizes[kMostSpokes], sum = 0;
    for (int i = 0; i < star.count; ++i) {
        normals[i] = cross(at[star.spokes[i].ring] - x, at[star.after(i).ring] - x);
        sizes[i] = length_squared(normals[i]);
    }
    for (int i = 0; i < star.count && sum < most; ++i) {
        for (int32_t k = head[face_of(star.spokes[i].corner)]; k >= 0; k = samples[k].next) {
            Sample& sample = samples[k];
            const Vec3 place = sample.place(), off = place - x;
            int closest = i;
            double best = triangle_distance_squared(place, x, at[star.spokes[i].ring], at[star.after(i).ring]);
            for (int j = 0; j < star.count; ++j) {
                if (j == i) continue;
                const double height = dot(off, normals[j]);
                if (height * height >= best * sizes[j]) continue; // the plane is farther already
                const double d = triangle_distance_squared(place, x, at[star.spokes[j].ring], at[star.after(j).ring]);
                if (d < best) best = d, closest = j;
            }
            sample.new_distance2 = static_cast<float>(best);
            sample.face = closest;
            sum += sample_cost(sample, sample.new_distance2);
        }
    }
    return sum;
}

void Relaxation::hand_over(const Star& star) {
    int32_t heads[kMostSpokes];
    std::fill(heads, heads + star.count, -1);
    for (int i = 0; i < star.count; ++i) {
        for (int32_t k = head[face_of(star.spokes[i].corner)], next; k >= 0; k = next) {
            Sample& sample = samples[k];
            next = sample.next;
            sample.distance2 = sample.new_distance2;
            sample.next = heads[sample.face];
            heads[sample.face] = k;
        }
    }
    for (int i = 0; i < star.count; ++i) head[face_of(star.spokes[i].corner)] = heads[i];
}

void Relaxation::move(int32_t v) {
    Star star;
    gather(v, star);
    Follower followers[kMostSpots];
    const int follower_count = follow(star, v, followers);
    const Vec3 o = at[v];
    Equations equations;
    double before = 0;
    for (int i = 0; i < star.count; ++i) {
        const Vec3 &a = at[star.spokes[i].ring], &b = at[star.after(i).ring];
        const Vec3 n = cross(a - o, b - o);
        for (int32_t k = head[face_of(star.spokes[i].corner)]; k >= 0; k = samples[k].next) {
            const Sample& sample = samples[k];
            before += sample_cost(sample, sample.distance2);
            const ClosestPoint c = closest_on_triangle(sample.place(), o, a, b);
            equations.add(slope(sample.weight, far_sample, sample.distance2), c.weight[0], c.residual,
                          c.inside ? n : Vec3{0, 0, 0});
        }
    }
    for (int i = 0; i < follower_count; ++i) {
        const Follower& follower = followers[i];
        const Spot& spot = spots[follower.spot];
        before += spot_cost(spot, spot.distance2);
        const Bvh::Triangle& t = in_bvh.triangle(spot.near);
        const ClosestPoint c = closest_on_triangle(follower.share * o + follower.rest, t.corner[0], t.corner[1], t.corner[2]);
        equations.add(slope(spot.weight, far_spot, spot.distance2), follower.share, -c.residual,
                      c.inside ? normal(t) : Vec3{0, 0, 0});
    }
    if (!equations.invert()) return;
    const Vec3 step = equations.step(equations.pull);
    if (!is_finite(step) || length_squared(step) < kLeastMove * kLeastMove) return;
    Vec3 slid;
    const bool slides = slide(star, v, equations, step, slid);

    double length = 1;
    for (int attempt = 0; attempt < kTries; ++attempt, length *= 0.5) {
        for (int kind = slides ? 0 : 1; kind < 2; ++kind) {
            const Vec3 x = round_to(rules.precision, level.position(v) + (length * frame.unit) * (kind == 0 ? slid : step));
            if (x == level.position(v) || !is_allowed(star, v, x)) continue;
            const Vec3 there = frame(x);
            double after = try_samples(star, there, before);
            for (int i = 0; i < follower_count && after < before; ++i) {
                Follower& follower = followers[i];
                const Spot& spot = spots[follower.spot];
                const Bvh::Hit hit = in_bvh.closest(follower.share * there + follower.rest, spot.near);
                follower.new_near = hit.triangle;
                follower.new_distance2 = static_cast<float>(hit.distance_squared);
                after += spot_cost(spot, follower.new_distance2);
            }
            if (!(after < before)) continue;
            for (int i = 0; i < follower_count; ++i) {
                Spot& spot = spots[followers[i].spot];
                spot.distance2 = followers[i].new_distance2;
                spot.near = followers[i].new_near;
            }
            hand_over(star);
            level.set_position(v, x);
            has_moved[v] = kMoved | kMovedNow;
            at[v] = there;
            return;
        }
    }
}

Status Relaxation::sweep(double from, double to) {
    DM_TRY(context.stage("relaxation", from, from + 0.3 * (to - from)));
    DM_TRY(find_closest());
    if (!(per_far2 > 0)) { // the first one says what is far
        double mean = 0;
        for (const Sample& s : samples) mean += static_cast<double>(s.weight) * s.distance2;
        if (mean > 0) per_far2 = 1 / (kFar * kFar * mean);
        if (!std::isfinite(per_far2)) per_far2 = 0;
        far_sample = kFarWeight / static_cast<double>(samples.size());
        far_spot = kFarWeight / (6.0 * level.faces());
    }
    DM_TRY(context.stage("relaxation", from + 0.3 * (to - from), to));
    for (int k = 0; k < colours; ++k) {
        const int64_t first = colour_begin[k], count = colour_begin[k + 1] - first;
        const double all = static_cast<double>(order.size());
        DM_TRY(parallel_slices(context, count, kMoveGrain, static_cast<double>(first) / all,
                               static_cast<double>(first + count) / all, [&](int64_t, int64_t begin, int64_t end) {
                                   for (int64_t i = begin; i < end; ++i) move(order[first + i]);
                               }));
    }
    return DELMESH_OK;
}

// Since it was last asked.
bool Relaxation::has_moved_now() {
    bool any = false;
    for (uint8_t& moved : has_moved) {
        any |= (moved & kMovedNow) != 0;
        moved &= static_cast<uint8_t>(~kMovedNow);
    }
    return any;
}

Status Relaxation::run(int64_t& moved) {
    moved = 0;
    if (in.faces() == 0 || level.faces() == 0) return DELMESH_OK;
    DM_TRY(context.stage("search tree", 0, 0.05));
    DM_TRY(in_bvh.build(context, in, frame));
    DM_TRY(context.stage("samples", 0.05, 0.08));
    DM_TRY(make_samples());
    DM_TRY(context.stage("vertices", 0.08, 0.1));
    DM_TRY(find_places());
    if (samples.empty() || order.empty()) return DELMESH_OK;
    DM_TRY(context.stage("distances", 0.1, 0.15));
    DM_TRY(look_back());
    for (int32_t i = 0; i < rules.sweeps; ++i) {
        DM_TRY(sweep(0.15 + 0.85 * i / rules.sweeps, 0.15 + 0.85 * (i + 1) / rules.sweeps));
        if (!has_moved_now()) break;
    }
    for (const uint8_t m : has_moved) moved += m & kMoved;
    return DELMESH_OK;
}

} // namespace

Status relax(Context& context, const Mesh& in, const RelaxRules& rules, const uint8_t* stays, Mesh& level, int64_t& moved) {
    Relaxation relaxation(context, in, rules, stays, level);
    return relaxation.run(moved);
}

} // namespace dm
