// SPDX-License-Identifier: Apache-2.0
// Each triangle of A is cut into convex pieces until every piece has a bound below the goal. The bounds of a piece P:
//  - the distance to one triangle t of B is a convex function, so that no point of P is farther from B than the farthest of P's
//    vertices is from t;
//  - the distance to B grows by at most the way walked: no point is farther than the centre's distance + P's radius.
// t is the triangle closest to P's centre. Where it is too small for P, P is cut along t's prism (the planes through t's edges,
// perpendicular to t): where the surfaces nearly coincide that leaves as many pieces as faces overlap, however small the goal.
// Otherwise P is halved. The distance of each centre is a lower bound, and raises the goal.
//
// Rounding. Each triangle of A is handled relative to its first corner, so that errors are in proportion to the triangles and not
// to the model. With u = 2^-53 and all coordinates at most R: the distance of a vertex of P to t is off by 25 u R
// (geom/closest_point.h); a vertex made by a cut lies within 5 u R of its edge, and by that much the pieces of one generation may
// fail to cover their parent. Hence the allowance u R (32 + 8 generations) on every bound.
#include "algo/distance_bound.h"

#include "algo/parallel_slices.h"
#include "geom/closest_point.h"

namespace dm {
namespace {

constexpr double kUnit = 0x1p-53;
constexpr double kRoundingFloor = 0x1p-40; // of the frame, whose boxes are about as large as 1
constexpr int kMostVertices = 12;          // of a piece
constexpr int kManyVertices = 8;           // from here on a piece is halved: a cut adds three
constexpr int kStackSize = 96;
constexpr int kMostParts = 4; // a piece is cut into the part in the prism and three outside
constexpr int64_t kGrain = 64;
// Triangles are tried with few pieces first, and the unfinished ones again with eight times as many. The first try, and half of
// each later one, is for a tighter goal than was asked for: that costs next to nothing where the surfaces nearly coincide.
constexpr double kAmbition = 0x1p-10; // of the absolute error
constexpr int64_t kFirstPieces = 64, kMostPieces = int64_t{1} << 21;
constexpr int64_t kPiecesPerTriangle = 64, kPiecesBesides = int64_t{1} << 24; // all in all

// A convex polygon. Plain data: a stack of them is made per triangle, and is not to be filled first.
struct Piece {
    int32_t size, generation; // generation: how many cuts made it
    double bound;
    Vec3 vertex[kMostVertices];

    void start(int32_t new_generation, double new_bound) {
        size = 0;
        generation = new_generation;
        bound = new_bound;
    }
    void add(const Vec3& p) { vertex[size++] = p; }
};

// A triangle of B relative to the origin in use.
struct Target {
    Target(const Bvh::Triangle& t, const Vec3& origin)
        : corner{t.corner[0] - origin, t.corner[1] - origin, t.corner[2] - origin}, reach(0) {
        for (const Vec3& p : corner) reach = std::fmax(reach, length(p));
    }
    double distance(const Vec3& p) const { return std::sqrt(triangle_distance_squared(p, corner[0], corner[1], corner[2])); }

    Vec3 corner[3];
    double reach;
};

// Cuts a convex piece along a plane, given the signed distances of its vertices to it. Vertices closer than `tolerance` belong
// to both sides; a side that has nothing beyond it stays empty.
void cut(const Piece& piece, const double* height, double tolerance, Piece& above, Piece& below) {
    above.start(piece.generation + 1, piece.bound);
    below.start(piece.generation + 1, piece.bound);
    bool has_above = false, has_below = false;
    for (int i = 0; i < piece.size; ++i) {
        has_above |= height[i] > tolerance;
        has_below |= height[i] < -tolerance;
    }
    if (!has_below || !has_above) {
        (has_below ? below : above) = piece;
        return;
    }
    for (int i = 0; i < piece.size; ++i) {
        const int j = i + 1 == piece.size ? 0 : i + 1;
        if (height[i] >= -tolerance) above.add(piece.vertex[i]);
        if (height[i] <= tolerance) below.add(piece.vertex[i]);
        if ((height[i] > tolerance && height[j] < -tolerance) || (height[i] < -tolerance && height[j] > tolerance)) {
            const Vec3 p = piece.vertex[i] + (height[i] / (height[i] - height[j])) * (piece.vertex[j] - piece.vertex[i]);
            above.add(p);
            below.add(p);
        }
    }
}

struct Goal {
    double relative, absolute;
    double operator()(double lower) const { return std::fmax((1 + relative) * lower + absolute, kRoundingFloor); }
};

// The search in one triangle of A.
class TriangleSearch {
public:
    TriangleSearch(const Bvh& to, const Bvh::Triangle& triangle, double& lower)
        : to_(to), lower_(lower), origin_(triangle.corner[0]) {
        Piece& root = stack_[top_++];
        root.start(0, HUGE_VAL);
        for (const Vec3& p : triangle.corner) {
            root.add(p - origin_);
            reach_ = std::fmax(reach_, length(root.vertex[root.size - 1]));
        }
    }

    // The bound for the whole triangle, after at most `most_pieces` pieces.
    double run(int32_t near, const Goal& goal, int64_t most_pieces) {
        goal_ = {goal.relative, kAmbition * goal.absolute};
        bound_by(stack_[0], Target(to_.triangle(near), origin_));
        for (int64_t pieces = 0; top_ > 0; ++pieces) {
            if (pieces == most_pieces / 2 && most_pieces > kFirstPieces) goal_ = goal;
            Piece piece = stack_[--top_];
            if (piece.bound > goal_(lower_) && (pieces >= most_pieces || top_ + kMostParts > kStackSize)) {
                ++top_;
                break;
            }
            refine(piece, near);
        }
        for (int i = 0; i < top_; ++i) finished_ = std::fmax(finished_, stack_[i].bound);
        return finished_;
    }

private:
    double allowance(const Piece& piece, double reach) const {
        return kUnit * (32 + 8 * piece.generation) * std::fmax(reach, reach_);
    }

    // Lowers the bound of the piece by the distances of its vertices to t, and returns the number of the farthest vertex.
    int bound_by(Piece& piece, const Target& t) const {
        double most = -1;
        int farthest = 0;
        for (int i = 0; i < piece.size; ++i) {
            const double d = t.distance(piece.vertex[i]);
            if (d > most) {
                most = d;
                farthest = i;
            }
        }
        piece.bound = std::fmin(piece.bound, most + allowance(piece, t.reach));
        return farthest;
    }

    bool finish(const Piece& piece) {
        if (piece.bound > goal_(lower_)) return false;
        finished_ = std::fmax(finished_, piece.bound);
        return true;
    }
    void keep(const Piece& piece) {
        if (!finish(piece)) stack_[top_++] = piece;
    }

    // Finishes the piece, or pushes its parts.
    void refine(Piece& piece, int32_t& near) {
        if (finish(piece)) return;
        Vec3 centre{0, 0, 0};
        for (int i = 0; i < piece.size; ++i) centre = centre + piece.vertex[i];
        centre = (1.0 / piece.size) * centre;
        double radius = 0;
        int rim = 0;
        for (int i = 0; i < piece.size; ++i) {
            const double r = length(piece.vertex[i] - centre);
            if (r > radius) {
                radius = r;
                rim = i;
            }
        }

        near = to_.closest(origin_ + centre, near).triangle;
        const Target target(to_.triangle(near), origin_);
        const double at_centre = target.distance(centre);
        lower_ = std::fmax(lower_, at_centre);
        piece.bound = std::fmin(piece.bound, at_centre + radius + allowance(piece, target.reach));
        const int farthest = bound_by(piece, target);
        if (finish(piece)) return;
        if (piece.size >= kManyVertices) return halve_by_chord(piece);
        if (cut_by_prism(piece, target)) return;

        const Vec3 tip = piece.vertex[farthest];
        const int32_t other = to_.closest(origin_ + tip, near).triangle;
        if (other != near) {
            const Target second(to_.triangle(other), origin_);
            lower_ = std::fmax(lower_, second.distance(tip));
            bound_by(piece, second);
            if (finish(piece) || cut_by_prism(piece, second)) return;
        }
        halve(piece, centre, piece.vertex[rim] - centre);
    }

    // The planes lie a little outside of the prism: that costs nothing where the goal allows it, and spares slivers.
    bool cut_by_prism(const Piece& piece, const Target& t) {
        const double margin = goal_(lower_) / 8, tolerance = margin / 16;
        const Vec3 n = cross(t.corner[1] - t.corner[0], t.corner[2] - t.corner[0]);
        Piece parts[3], inside = piece;
        int count = 0;
        for (int k = 0; k < 3; ++k) {
            const Vec3 inwards = cross(n, t.corner[(k + 1) % 3] - t.corner[k]);
            const double size = length(inwards);
            if (!(size > 0)) continue;
            double height[kMostVertices];
            for (int i = 0; i < inside.size; ++i) height[i] = dot(inwards, inside.vertex[i] - t.corner[k]) / size + margin;
            Piece above;
            cut(inside, height, tolerance, above, parts[count]);
            if (above.size == 0) return false;
            if (parts[count].size != 0) ++count;
            inside = above;
        }
        if (count == 0) return false;
        bound_by(inside, t);
        keep(inside);
        for (int k = 0; k < count; ++k) {
            bound_by(parts[k], t);
            keep(parts[k]);
        }
        return true;
    }

    void halve(const Piece& piece, const Vec3& centre, const Vec3& direction) {
        const double size = length(direction);
        double height[kMostVertices];
        for (int i = 0; i < piece.size; ++i) height[i] = dot(direction, piece.vertex[i] - centre) / size;
        Piece above, below;
        cut(piece, height, 0, above, below);
        if (above.size != 0) keep(above);
        if (below.size != 0) keep(below);
    }

    void halve_by_chord(const Piece& piece) {
        const int middle = piece.size / 2;
        Piece one, two;
        one.start(piece.generation, piece.bound);
        two.start(piece.generation, piece.bound);
        for (int i = 0; i <= middle; ++i) one.add(piece.vertex[i]);
        for (int i = middle; i <= piece.size; ++i) two.add(piece.vertex[i % piece.size]);
        keep(one);
        keep(two);
    }

    const Bvh& to_;
    Goal goal_{0, 0};
    double& lower_; // of the block: the searches before this one may have raised it
    Vec3 origin_;
    double reach_ = 0, finished_ = 0;
    int top_ = 0;
    Piece stack_[kStackSize];
};

} // namespace

Status bound_distance(Context& context, const Bvh& from, const Bvh& to, const Array<int32_t>& near, double relative,
                      double absolute, double start, double end, DistanceBound& bound) {
    const int64_t triangles = from.size();
    Memory& memory = context.memory();
    Array<double> upper(memory, triangles); // per triangle
    Array<int32_t> open(memory, triangles); // triangles whose bound is above the goal
    for (int32_t t = 0; t < triangles; ++t) open[t] = t;
    const Goal goal{relative, absolute};
    int64_t budget = kPiecesPerTriangle * (triangles + to.size()) + kPiecesBesides;
    int64_t grain = kGrain;
    for (int64_t pieces = kFirstPieces; !open.empty() && pieces <= kMostPieces && budget > 0; pieces *= 8) {
        Array<double> lower(memory, block_count(open.size(), grain));
        const double middle = (start + end) / 2; // later rounds have less to do
        DM_TRY(parallel_slices(context, open.size(), grain, start, middle, [&](int64_t block, int64_t first, int64_t last) {
            double local = bound.lower; // raised block by block only, so that the result does not depend on who was first
            for (int64_t i = first; i < last; ++i) {
                const int32_t t = open[i];
                upper[t] = TriangleSearch(to, from.triangle(t), local).run(near[t], goal, pieces);
            }
            lower[block] = local;
        }));
        start = middle;
        for (const double l : lower) bound.lower = std::fmax(bound.lower, l);
        int64_t still = 0;
        for (int64_t i = 0; i < open.size(); ++i)
            if (upper[open[i]] > goal(bound.lower)) open[still++] = open[i];
        open.resize_uninitialized(still);
        budget -= 8 * pieces * still; // what the next round may take
        grain = grain > 8 ? grain / 8 : 1;
    }
    bound.upper = bound.lower; // both are right; the rounding of a sample may put it above a bound of the same place
    for (const double u : upper) bound.upper = std::fmax(bound.upper, u);
    return DELMESH_OK;
}

} // namespace dm
