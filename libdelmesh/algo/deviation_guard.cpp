// SPDX-License-Identifier: Apache-2.0
// Three ways to prove that a triangle is within eps of a mesh, from cheap to dear:
//
// One face. The distance to one triangle is a convex function: three corners within eps of one face of the mesh are enough.
//
// A flood. Project the mesh along the triangle's normal. Take all faces that are connected to a first one through edges whose
// projection meets the triangle. No edge on the rim of that set meets it, so the projection covers all of the triangle as often as
// its centre: if the rim winds around the centre, there is a point of the mesh above (or below) every point of the triangle. It is
// no higher than the highest vertex of the faces, clipped to the prism over the triangle. The work is that of visiting each face
// once, however large the triangle is in comparison, and however small eps. (The argument holds for the continuous, piecewise linear
// map that the rounded projections of the vertices define: rounding only moves points, by what the margins allow for.)
// Where a boundary of the mesh meets the triangle, or what is steep beyond a crease stands over the triangle's rim, a smaller copy
// of the triangle is covered instead, and eps is less by the distance between the two.
//
// Pieces. Halve the triangle until each piece is close to one face, or its centre is by its radius closer than eps. This needs no
// connected surface; it needs many pieces, and gives up after some.
//
// A point of the triangle that is farther than eps ends the search at once.
//
// Rounding, in the frame, where no coordinate exceeds R = 4 + eps, with u = 2^-53: computed distances to triangles are off by
// 25 u R (geom/closest_point.h); halving 30 times moves points by 60 u R, heights and places in a plane are off by some 10 u R.
// The margin of 2^-44 (2 + eps) is more than twice that, and that of the half-planes around a triangle, 2^-46, more than ten times
// what rounding does to a place in them.
#include "algo/deviation_guard.h"

#include <algorithm>

#include "algo/parallel_slices.h"
#include "geom/closest_point.h"

namespace dm {
namespace {

constexpr double kMargin = 0x1p-44, kOutset = 0x1p-46;
constexpr double kLargestLimit = 64; // of the frame: everything is closer than that
constexpr int64_t kMostFlooded = 20000;
constexpr int64_t kPiecesAtBegin = 1 << 13, kPiecesPerFace = 1024;
constexpr int kPiecesPerInputFace = 64;
constexpr int kStackSize = 64;
constexpr uint32_t kLastStamp = UINT32_MAX / 2; // far more are left than one call of accept takes
constexpr int64_t kGrain = 256;
constexpr int64_t kProgressEvery = 64;

double larger(double a, double b) {
    return a > b ? a : b;
}

Vec3 centre_of(const Bvh::Triangle& t) {
    return (1.0 / 3) * (t.corner[0] + t.corner[1] + t.corner[2]);
}

double radius_of(const Bvh::Triangle& t, const Vec3& centre) {
    double most = 0;
    for (const Vec3& p : t.corner) most = larger(most, length_squared(p - centre));
    return std::sqrt(most);
}

// The corner k from which the longest edge starts.
int longest_edge(const Bvh::Triangle& t) {
    int longest = 0;
    double most = -1;
    for (int k = 0; k < 3; ++k) {
        const double l = length_squared(t.corner[(k + 1) % 3] - t.corner[k]);
        if (l > most) {
            most = l;
            longest = k;
        }
    }
    return longest;
}

Vec3 any_perpendicular(const Vec3& a) {
    const double x = std::fabs(a.x), y = std::fabs(a.y), z = std::fabs(a.z);
    return cross(a, x <= y && x <= z ? Vec3{1, 0, 0} : y <= z ? Vec3{0, 1, 0} : Vec3{0, 0, 1});
}

} // namespace

// A triangle with coordinates in its plane, and the prism over it.
struct DeviationGuard::Prism {
    Vec3 origin, across, along, normal;
    double x[3], y[3];               // of the corners
    double inward_x[3], inward_y[3]; // unit normals of the edges k -> k + 1
    double centre_x, centre_y;
    double most; // how high the mesh may be

    // False where the triangle is too thin to tell its sides.
    bool set(const Corners& t, double limit) {
        const int k = longest_edge(t);
        origin = t.corner[k];
        const Vec3 edge = t.corner[(k + 1) % 3] - origin, other = t.corner[(k + 2) % 3] - origin;
        double size = length(edge);
        if (!(size > 0)) return false;
        across = (1 / size) * edge;
        Vec3 n = cross(edge, other);
        size = length(n);
        n = size > 0 ? (1 / size) * n : any_perpendicular(across);
        along = cross(n, across);
        size = length(along);
        if (!(size > 0.25)) return false;
        along = (1 / size) * along;
        normal = cross(across, along);
        double flat = 0;
        for (int i = 0; i < 3; ++i) {
            const Vec3 p = t.corner[i] - origin;
            x[i] = dot(across, p);
            y[i] = dot(along, p);
            flat = larger(flat, std::fabs(dot(normal, p)));
        }
        for (int i = 0; i < 3; ++i) {
            const int j = (i + 1) % 3;
            const double dx = x[j] - x[i], dy = y[j] - y[i], l = std::sqrt(dx * dx + dy * dy);
            if (!(l > 0)) return false;
            inward_x[i] = -dy / l;
            inward_y[i] = dx / l;
        }
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 3; ++j)
                if (!(distance_inside(i, x[j], y[j]) > -kOutset / 2)) return false;
        centre_x = (x[0] + x[1] + x[2]) / 3;
        centre_y = (y[0] + y[1] + y[2]) / 3;
        most = limit - flat;
        return most > 0;
    }
    double distance_inside(int edge, double px, double py) const {
        return inward_x[edge] * (px - x[edge]) + inward_y[edge] * (py - y[edge]);
    }
    Place place(const Vec3& p) const {
        const Vec3 d = p - origin;
        Place out;
        out.x = dot(across, d);
        out.y = dot(along, d);
        out.height = dot(normal, d);
        out.beyond = 0;
        for (int k = 0; k < 3; ++k) {
            out.inside[k] = distance_inside(k, out.x, out.y);
            if (out.inside[k] < -kOutset) out.beyond |= 1u << k;
        }
        return out;
    }
    // May the edge a b meet the triangle? The same answer from both sides.
    bool meets(const Place& a, const Place& b) const {
        if ((a.beyond & b.beyond) != 0) return false;
        if (a.beyond == 0 || b.beyond == 0) return true;
        const bool swap = b.x < a.x || (b.x == a.x && b.y < a.y);
        const Place &from = swap ? b : a, &to = swap ? a : b;
        const double dx = to.x - from.x, dy = to.y - from.y, tolerance = kOutset * (std::fabs(dx) + std::fabs(dy));
        bool left = true, right = true;
        for (int k = 0; k < 3; ++k) {
            const double side = dx * (y[k] - from.y) - dy * (x[k] - from.x);
            left &= side > tolerance;
            right &= side < -tolerance;
        }
        return !left && !right;
    }
    // How often the edge a b winds around the centre: crossings of the ray to the right. Edge and reversed edge cancel out exactly.
    int winding(const Place& a, const Place& b) const {
        const bool from_below = a.y <= centre_y, to_below = b.y <= centre_y;
        if (from_below == to_below) return 0;
        const Place &low = from_below ? a : b, &high = from_below ? b : a;
        const double side = (high.x - low.x) * (centre_y - low.y) - (centre_x - low.x) * (high.y - low.y);
        if (!(side > 0)) return 0; // the centre is not to the left
        return from_below ? 1 : -1;
    }
    // Is what the face has over the triangle no higher than `most`? If not: where.
    bool is_low(const Place* corners, Place& where) const {
        if (std::fabs(corners[0].height) <= most && std::fabs(corners[1].height) <= most && std::fabs(corners[2].height) <= most)
            return true;
        if ((corners[0].beyond & corners[1].beyond & corners[2].beyond) != 0) return true;
        Place polygon[2][8];
        int count = 3, now = 0;
        for (int k = 0; k < 3; ++k) polygon[0][k] = corners[k];
        if ((corners[0].beyond | corners[1].beyond | corners[2].beyond) != 0)
            for (int k = 0; k < 3; ++k) {
                const Place* from = polygon[now];
                Place* to = polygon[1 - now];
                int made = 0;
                for (int i = 0; i < count; ++i) {
                    const Place &a = from[i], &b = from[i + 1 == count ? 0 : i + 1];
                    const bool a_in = a.inside[k] >= -kOutset, b_in = b.inside[k] >= -kOutset;
                    if (a_in) to[made++] = a;
                    if (a_in == b_in || made == 8) continue;
                    const Place &in = a_in ? a : b, &out = a_in ? b : a;
                    const double t = (in.inside[k] + kOutset) / (in.inside[k] - out.inside[k]);
                    Place p;
                    p.x = in.x + t * (out.x - in.x);
                    p.y = in.y + t * (out.y - in.y);
                    p.height = in.height + t * (out.height - in.height);
                    for (int j = 0; j < 3; ++j) p.inside[j] = in.inside[j] + t * (out.inside[j] - in.inside[j]);
                    p.beyond = 0;
                    to[made++] = p;
                }
                count = made;
                now = 1 - now;
            }
        double highest = most;
        for (int i = 0; i < count; ++i)
            if (std::fabs(polygon[now][i].height) > highest) {
                highest = std::fabs(polygon[now][i].height);
                where = polygon[now][i];
            }
        return highest == most;
    }
};

struct DeviationGuard::InputSide {
    DeviationGuard& guard;
    Vec3 at(int32_t c) const { return guard.points_[guard.in_->corner_vert[c]]; }
    int32_t twin(int32_t c) const { return guard.in_->corner_twin[c]; }
    Array<uint32_t>& stamps() const { return guard.input_stamps_; }
};
struct DeviationGuard::SurfaceSide {
    DeviationGuard& guard;
    Vec3 at(int32_t c) const { return guard.frame_(guard.s_.at(guard.s_.vert(c))); }
    int32_t twin(int32_t c) const { return guard.s_.twin(c); }
    Array<uint32_t>& stamps() const { return guard.face_stamps_; }
};

DeviationGuard::DeviationGuard(Context& context, const Surface& surface)
    : context_(context), s_(surface), bvh_(context.memory()), points_(context.memory()), versions_(context.memory()),
      first_link_(context.memory()), hints_(context.memory()), links_(context.memory()), input_stamps_(context.memory()),
      vert_stamps_(context.memory()), face_stamps_(context.memory()), mask_slots_(context.memory()), masks_(context.memory()),
      changed_(context.memory()), inputs_(context.memory()), met_(context.memory()), new_links_(context.memory()),
      candidates_(context.memory()) {}

DeviationGuard::Corners DeviationGuard::corners_of(int32_t face) const {
    return {{frame_(s_.at(s_.vert(3 * face))), frame_(s_.at(s_.vert(3 * face + 1))), frame_(s_.at(s_.vert(3 * face + 2)))}};
}

DeviationGuard::Corners DeviationGuard::input_corners(int32_t face) const {
    const int32_t* const v = in_->corner_vert.data() + 3 * static_cast<int64_t>(face);
    return {{points_[v[0]], points_[v[1]], points_[v[2]]}};
}

bool DeviationGuard::within(const Vec3& p, const Corners& target) const {
    return triangle_distance_squared(p, target.corner[0], target.corner[1], target.corner[2]) <= near_squared_;
}

bool DeviationGuard::within(const Corners& piece, const Corners& target) const {
    return within(piece.corner[0], target) && within(piece.corner[1], target) && within(piece.corner[2], target);
}

bool DeviationGuard::is_beyond(const Vec3& place, int32_t near) const {
    return !(bvh_.closest(frame_(place), hints_[near]).distance_squared <= near_squared_);
}

// ---- proofs ------------------------------------------------------------------------------------------------------------------

// The faces met are left in met_, those that are not over the triangle too. where: a point of the triangle that the mesh is too
// high above.
template <class Side>
DeviationGuard::Cover DeviationGuard::flood(const Side& side, const Prism& prism, int32_t seed, Vec3& where) {
    Array<uint32_t>& stamps = side.stamps();
    ++stamp_;
    met_.clear();
    met_.push_back(seed);
    stamps[seed] = stamp_;
    int winding = 0;
    bool open = false;
    for (int64_t i = 0; i < met_.size(); ++i) {
        const int32_t first = 3 * met_[i];
        const Place corners[3] = {prism.place(side.at(first)), prism.place(side.at(first + 1)), prism.place(side.at(first + 2))};
        Place high{};
        if (!prism.is_low(corners, high)) {
            where = prism.origin + (high.x * prism.across + high.y * prism.along);
            return Cover::too_high;
        }
        for (int32_t k = 0; k < 3; ++k) {
            const Place &a = corners[k], &b = corners[k == 2 ? 0 : k + 1];
            winding += prism.winding(a, b);
            if (!prism.meets(a, b)) continue;
            const int32_t beyond = side.twin(first + k);
            if (beyond < 0) {
                open = true;
                continue;
            }
            const int32_t face = face_of(beyond);
            if (stamps[face] == stamp_) continue;
            stamps[face] = stamp_;
            met_.push_back(face);
        }
        if (met_.size() > kMostFlooded) return Cover::missed;
    }
    return open ? Cover::open : winding != 0 ? Cover::covered : Cover::missed;
}

// is_far(p): is this point of the triangle known to be farther than the limit?
template <class Side, class IsFar>
bool DeviationGuard::cover_by_flood(const Side& side, const Corners& triangle, int32_t seed, IsFar&& is_far) {
    Prism prism;
    if (!prism.set(triangle, near_)) return false;
    Vec3 where;
    Cover cover = flood(side, prism, seed, where);
    if (cover == Cover::too_high && is_far(where)) return false;
    for (double part = 0.125; (cover == Cover::open || cover == Cover::too_high) && part < 1; part *= 4) {
        const Vec3 centre = centre_of(triangle);
        const double radius = radius_of(triangle, centre), moved = std::fmin(part * near_, radius / 2), kept = 1 - moved / radius;
        Corners smaller;
        for (int k = 0; k < 3; ++k) smaller.corner[k] = centre + kept * (triangle.corner[k] - centre);
        if (!prism.set(smaller, near_ - moved)) return false;
        cover = flood(side, prism, seed, where);
    }
    return cover == Cover::covered;
}

// found(face): of the mesh that `to` was made from, one that pieces are close to.
template <class Found>
bool DeviationGuard::cover_by_pieces(const Corners& triangle, const Bvh& to, int32_t near, int64_t most, Found&& found) {
    Corners stack[kStackSize];
    int top = 0;
    stack[top++] = triangle;
    for (int64_t pieces = 0; top > 0; ++pieces) {
        if (pieces == most) return false;
        const Corners piece = stack[--top];
        const Vec3 centre = centre_of(piece);
        const Bvh::Hit hit = to.closest(centre, near);
        near = hit.triangle;
        if (!(hit.distance_squared <= near_squared_)) return false;
        if (std::sqrt(hit.distance_squared) + radius_of(piece, centre) <= near_ || within(piece, to.triangle(near))) {
            found(to.face(near));
            continue;
        }
        if (top + 2 > kStackSize) return false;
        const int k = longest_edge(piece), l = (k + 1) % 3;
        const Vec3 middle = 0.5 * (piece.corner[k] + piece.corner[l]);
        stack[top] = stack[top + 1] = piece;
        stack[top++].corner[l] = middle;
        stack[top++].corner[k] = middle;
    }
    return true;
}

// Is this face within the limit of the input?
bool DeviationGuard::prove_surface_face(int32_t face, int64_t most_pieces) {
    const Corners corners = corners_of(face);
    const Bvh::Hit hit = bvh_.closest(centre_of(corners), fresh_hint_);
    if (!(hit.distance_squared <= near_squared_)) return false;
    fresh_hint_ = hit.triangle;
    if (within(corners, bvh_.triangle(hit.triangle))) return true;
    bool is_far = false;
    const auto look = [&](const Vec3& p) { return is_far = !(bvh_.closest(p, hit.triangle).distance_squared <= near_squared_); };
    if (cover_by_flood(InputSide{*this}, corners, bvh_.face(hit.triangle), look)) return true;
    if (is_far) return false;
    return cover_by_pieces(corners, bvh_, hit.triangle, most_pieces, [](int32_t) {});
}

DeviationGuard::Mask DeviationGuard::mask_of(const Vec3& p) const {
    uint64_t words[2] = {0, 0};
    for (int64_t i = 0; i < candidates_.size(); ++i) {
        const Candidate& candidate = candidates_[i];
        if (length_squared(p - candidate.centre) > candidate.reach_squared) continue;
        if (within(p, candidate.corners)) words[i >> 6] |= uint64_t{1} << (i & 63);
    }
    return {words[0], words[1]};
}

// The face of the candidate closest to p, -1 if none is within the limit.
int32_t DeviationGuard::nearest_candidate(const Vec3& p) const {
    double least = near_squared_;
    int32_t face = -1;
    for (const Candidate& candidate : candidates_) {
        if (length_squared(p - candidate.centre) > candidate.reach_squared) continue;
        const Corners& t = candidate.corners;
        const double d = triangle_distance_squared(p, t.corner[0], t.corner[1], t.corner[2]);
        if (!(d <= least) || (d == least && face >= 0)) continue;
        least = d;
        face = candidate.face;
    }
    return face;
}

DeviationGuard::Mask DeviationGuard::mask_of_vertex(int32_t v) {
    if (vert_stamps_[v] != mask_stamp_) {
        vert_stamps_[v] = mask_stamp_;
        mask_slots_[v] = static_cast<int32_t>(masks_.size());
        masks_.push_back(mask_of(points_[v]));
    }
    return masks_[mask_slots_[v]];
}

void DeviationGuard::link_used(int32_t input, const Mask& used) {
    uint64_t words[2] = {used.low, used.high};
    for (int w = 0; w < 2; ++w)
        for (; words[w] != 0; words[w] &= words[w] - 1)
            new_links_.push_back({candidates_[64 * w + __builtin_ctzll(words[w])].face, input});
}

// Is this face of the input within the limit of the candidates, or of the surface around them?
bool DeviationGuard::prove_input_face(int32_t input) {
    const int32_t* const v = in_->corner_vert.data() + 3 * static_cast<int64_t>(input);
    const Mask masks[3] = {mask_of_vertex(v[0]), mask_of_vertex(v[1]), mask_of_vertex(v[2])}; // none is empty
    const Mask common = masks[0] & masks[1] & masks[2];
    if (!common.empty()) {
        new_links_.push_back({candidates_[common.first()].face, input});
        return true;
    }
    const Corners corners = input_corners(input);
    const int32_t nearest = nearest_candidate(centre_of(corners));
    if (nearest < 0) return false;
    if (cover_by_flood(SurfaceSide{*this}, corners, nearest, [](const Vec3&) { return false; })) {
        for (const int32_t face : met_) new_links_.push_back({face, input});
        return true;
    }
    // Halves.
    struct Piece {
        Corners corners;
        Mask masks[3];
    } stack[kStackSize];
    int top = 0;
    stack[top++] = {corners, {masks[0], masks[1], masks[2]}};
    Mask used{0, 0};
    for (int pieces = 0; top > 0; ++pieces) {
        if (pieces == kPiecesPerInputFace) return false;
        const Piece piece = stack[--top];
        const Mask shared = piece.masks[0] & piece.masks[1] & piece.masks[2];
        if (!shared.empty()) {
            if ((shared & used).empty()) {
                const int32_t first = shared.first();
                (first < 64 ? used.low : used.high) |= uint64_t{1} << (first & 63);
            }
            continue;
        }
        if (top + 2 > kStackSize) return false;
        const int k = longest_edge(piece.corners), l = (k + 1) % 3;
        const Vec3 middle = 0.5 * (piece.corners.corner[k] + piece.corners.corner[l]);
        const Mask mask = mask_of(middle);
        if (mask.empty()) return false;
        stack[top] = stack[top + 1] = piece;
        stack[top].corners.corner[l] = middle;
        stack[top++].masks[l] = mask;
        stack[top].corners.corner[k] = middle;
        stack[top++].masks[k] = mask;
    }
    link_used(input, used);
    return true;
}

// ---- books -------------------------------------------------------------------------------------------------------------------

void DeviationGuard::add_link(const NewLink& link) {
    const Link made{link.input, versions_[link.input], first_link_[link.face]};
    if (free_link_ < 0) {
        first_link_[link.face] = static_cast<int32_t>(links_.size());
        links_.push_back(made);
        return;
    }
    const int32_t place = free_link_;
    free_link_ = links_[place].next;
    links_[place] = made;
    first_link_[link.face] = place;
}

void DeviationGuard::drop_links(int32_t face) {
    for (int32_t link = first_link_[face]; link >= 0;) {
        const int32_t next = links_[link].next;
        links_[link].next = free_link_;
        free_link_ = link;
        link = next;
    }
    first_link_[face] = -1;
}

bool DeviationGuard::add_candidate(int32_t face) {
    if (face_stamps_[face] == stamp_) return true;
    face_stamps_[face] = stamp_;
    if (candidates_.size() == kMostCandidates) return false;
    Candidate candidate;
    candidate.corners = corners_of(face);
    candidate.centre = centre_of(candidate.corners);
    const double reach = (radius_of(candidate.corners, candidate.centre) + near_) * (1 + 0x1p-40);
    candidate.reach_squared = reach * reach;
    candidate.face = face;
    candidates_.push_back(candidate);
    return true;
}

// The faces around the vertices of the first `fresh` candidates, as far as there is room.
void DeviationGuard::add_ring(int32_t fresh) {
    for (int32_t i = 0; i < fresh; ++i)
        for (int32_t k = 0; k < 3; ++k) {
            const int32_t start = 3 * candidates_[i].face + k;
            int32_t c = start;
            do {
                if (!add_candidate(face_of(c))) return;
                c = s_.rotate(c);
            } while (c >= 0 && c != start);
            if (c >= 0) continue;
            for (c = s_.twin(start); c >= 0; c = s_.twin(next_corner(c))) // the other way round, up to the boundary
                if (!add_candidate(face_of(c))) return;
        }
}

void DeviationGuard::forget_stamps() {
    for (Array<uint32_t>* stamps : {&input_stamps_, &vert_stamps_, &face_stamps_})
        for (uint32_t& stamp : *stamps) stamp = 0;
    stamp_ = mask_stamp_ = 0;
}

bool DeviationGuard::accept(const Array<int32_t>& changed_faces) {
    if (s_.faces() > first_link_.size()) {
        first_link_.resize(s_.faces(), -1);
        hints_.resize(s_.faces(), 0);
        face_stamps_.resize(s_.faces(), 0);
    }
    if (stamp_ > kLastStamp) forget_stamps();
    ++stamp_;
    changed_.clear();
    inputs_.clear();
    candidates_.clear();
    new_links_.clear();
    masks_.clear();
    bool room = true;
    for (const int32_t face : changed_faces) {
        if (face >= s_.faces() || face_stamps_[face] == stamp_) continue;
        if (!s_.is_dead(face))
            room &= add_candidate(face);
        else
            face_stamps_[face] = stamp_;
        changed_.push_back(face);
        for (int32_t link = first_link_[face]; link >= 0; link = links_[link].next) {
            const int32_t input = links_[link].input;
            if (links_[link].version != versions_[input] || input_stamps_[input] == stamp_) continue;
            input_stamps_[input] = stamp_;
            inputs_.push_back(input);
        }
    }
    if (!room) return false;
    const int32_t fresh = static_cast<int32_t>(candidates_.size());
    add_ring(fresh);
    mask_stamp_ = ++stamp_;
    // Most refusals show at a vertex.
    for (const int32_t input : inputs_) {
        if (context_.cancel_requested()) return false;
        for (int32_t k = 0; k < 3; ++k)
            if (mask_of_vertex(in_->corner_vert[3 * static_cast<int64_t>(input) + k]).empty()) return false;
    }
    for (const int32_t input : inputs_)
        if (context_.cancel_requested() || !prove_input_face(input)) return false;
    fresh_hint_ = changed_.empty() ? 0 : hints_[changed_[0]];
    for (int32_t i = 0; i < fresh; ++i)
        if (context_.cancel_requested() || !prove_surface_face(candidates_[i].face, kPiecesPerFace)) return false;
    for (const int32_t face : changed_) drop_links(face);
    for (const int32_t input : inputs_) ++versions_[input];
    for (const NewLink& link : new_links_) add_link(link);
    for (int32_t i = 0; i < fresh; ++i) hints_[candidates_[i].face] = fresh_hint_;
    return true;
}

// ---- the beginning -----------------------------------------------------------------------------------------------------------

Status DeviationGuard::begin(const Mesh& in, double limit, bool& within_limit) {
    Memory& memory = context_.memory();
    in_ = &in;
    within_limit = false;
    links_.clear();
    free_link_ = -1;
    stamp_ = mask_stamp_ = 0;
    const int32_t faces = s_.faces();
    if (in.faces() == 0 || s_.dead_faces == faces) {
        within_limit = in.faces() == 0 && s_.dead_faces == faces;
        first_link_.assign(faces, -1);
        hints_.assign(faces, 0);
        face_stamps_.assign(faces, 0);
        return DELMESH_OK;
    }

    // The surface as a mesh, for the hierarchy. numbers: of its faces.
    Mesh copy(memory);
    Array<int32_t> numbers(memory);
    numbers.reserve(faces - s_.dead_faces);
    copy.precision = Precision::f64;
    copy.vertex_count = s_.vertices();
    copy.pos64.resize_uninitialized(3 * static_cast<int64_t>(s_.vertices()));
    DM_TRY(context_.progress(0));
    for (int32_t v = 0; v < s_.vertices(); ++v) {
        const Vec3& p = s_.at(v);
        double* const to = copy.pos64.data() + 3 * static_cast<int64_t>(v);
        to[0] = p.x;
        to[1] = p.y;
        to[2] = p.z;
    }
    copy.corner_vert.reserve(3 * static_cast<int64_t>(faces - s_.dead_faces));
    for (int32_t face = 0; face < faces; ++face) {
        if (face % (1 << 18) == 0) DM_TRY(context_.progress(0));
        if (s_.is_dead(face)) continue;
        numbers.push_back(face);
        for (int32_t k = 0; k < 3; ++k) copy.corner_vert.push_back(s_.vert(3 * face + k));
    }

    DM_TRY(context_.progress(0));
    Box box = used_box(in);
    box.extend(used_box(copy));
    frame_ = Frame(box);
    const double e = std::fmin(limit * frame_.scale, kLargestLimit);
    near_ = e - kMargin * (2 + e);
    near_squared_ = near_ * near_;
    DM_TRY(bvh_.build(context_, in, frame_));
    Bvh surface_bvh(memory);
    DM_TRY(surface_bvh.build(context_, copy, frame_));
    copy = Mesh(memory);

    DM_TRY(context_.progress(0));
    points_.resize_uninitialized(in.vertices());
    for (int32_t v = 0; v < in.vertices(); ++v) points_[v] = frame_(in.position(v));
    DM_TRY(context_.progress(0));
    versions_.assign(in.faces(), 0);
    input_stamps_.assign(in.faces(), 0);
    vert_stamps_.assign(in.vertices(), 0);
    mask_slots_.resize_uninitialized(in.vertices());
    first_link_.assign(faces, -1);
    hints_.assign(faces, 0);
    face_stamps_.assign(faces, 0);
    DM_TRY(context_.progress(0));
    if (!(near_ > 0)) return DELMESH_OK;
    DM_TRY(find_first_links(surface_bvh, numbers, within_limit));
    return context_.progress(1);
}

Status DeviationGuard::find_first_links(const Bvh& surface_bvh, const Array<int32_t>& numbers, bool& within_limit) {
    Memory& memory = context_.memory();
    // What one face of the other mesh proves, all at once: its number there; else the number of one that is close, as ~number.
    Array<int32_t> forward(memory, bvh_.size()), backward(memory, surface_bvh.size());
    Array<uint8_t> far(memory, block_count(std::max(bvh_.size(), surface_bvh.size()), kGrain), 0); // per block
    const auto match = [&](const Bvh& from, const Bvh& to, double start, double end, Array<int32_t>& out) {
        return parallel_slices(context_, from.size(), kGrain, start, end, [&](int64_t block, int64_t first, int64_t last) {
            int32_t near = static_cast<int32_t>(first * to.size() / from.size());
            for (int64_t i = first; i < last; ++i) {
                const Corners& t = from.triangle(static_cast<int32_t>(i));
                const Bvh::Hit hit = to.closest(centre_of(t), near);
                near = hit.triangle;
                if (!(hit.distance_squared <= near_squared_)) far[block] = 1;
                out[i] = within(t, to.triangle(near)) ? near : ~near;
            }
        });
    };
    DM_TRY(match(bvh_, surface_bvh, 0, 0.3, forward));
    DM_TRY(match(surface_bvh, bvh_, 0.3, 0.6, backward));
    for (const uint8_t f : far)
        if (f != 0) return DELMESH_OK;

    links_.reserve(bvh_.size() + bvh_.size() / 2);
    Array<int32_t> found(memory);
    for (int32_t t = 0; t < bvh_.size(); ++t) {
        if (t % kProgressEvery == 0) DM_TRY(context_.progress(0.6 + 0.2 * t / bvh_.size()));
        const int32_t input = bvh_.face(t), near = forward[t];
        if (near >= 0) {
            add_link({numbers[surface_bvh.face(near)], input});
            continue;
        }
        const Corners& corners = bvh_.triangle(t);
        if (cover_by_flood(SurfaceSide{*this}, corners, numbers[surface_bvh.face(~near)], [](const Vec3&) { return false; })) {
            for (const int32_t face : met_) add_link({face, input});
            continue;
        }
        found.clear();
        if (!cover_by_pieces(corners, surface_bvh, ~near, kPiecesAtBegin, [&](int32_t f) { found.push_back(numbers[f]); }))
            return DELMESH_OK;
        std::sort(found.begin(), found.end());
        const int32_t* const end = std::unique(found.begin(), found.end());
        for (const int32_t* face = found.begin(); face != end; ++face) add_link({*face, input});
    }
    for (int32_t t = 0; t < surface_bvh.size(); ++t) {
        if (t % kProgressEvery == 0) DM_TRY(context_.progress(0.8 + 0.2 * t / surface_bvh.size()));
        const int32_t face = numbers[surface_bvh.face(t)], near = backward[t];
        hints_[face] = near >= 0 ? near : ~near;
        if (near >= 0) continue;
        fresh_hint_ = ~near;
        if (!prove_surface_face(face, kPiecesAtBegin)) return DELMESH_OK;
    }
    within_limit = true;
    return DELMESH_OK;
}

} // namespace dm
