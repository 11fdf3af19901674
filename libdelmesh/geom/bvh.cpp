// SPDX-License-Identifier: Apache-2.0
#include "geom/bvh.h"

#include <cmath>
#include <utility>

#include "geom/closest_point.h"

namespace dm {

namespace {

constexpr int32_t kLeafSize = 4;
constexpr int32_t kBins = 16;
// From this depth on ranges are halved as they lie. Fewer than 2^31 triangles are then out after 31 more levels, so that no stack
// needs more than 64 places.
constexpr int32_t kHeuristicDepth = 32;
constexpr int32_t kStackSize = 64;
constexpr int64_t kProgressEvery = 4096;   // nodes
constexpr int32_t kFacesBetween = 1 << 16; // in a plain pass over them

// Floats that enclose the double. The relative margin is four times the error of the conversion, the absolute one is for
// subnormals.
float float_below(double x) {
    return static_cast<float>(x - std::fabs(x) * 0x1p-22 - 0x1p-140);
}
float float_above(double x) {
    return static_cast<float>(x + std::fabs(x) * 0x1p-22 + 0x1p-140);
}

double larger(double a, double b) {
    return a > b ? a : b;
}
// How far x lies outside [lo, hi].
double outside(double x, double lo, double hi) {
    return larger(larger(lo - x, x - hi), 0.0);
}

double box_distance_squared(const Vec3& p, const float* lo, const float* hi) {
    const double x = outside(p.x, lo[0], hi[0]), y = outside(p.y, lo[1], hi[1]), z = outside(p.z, lo[2], hi[2]);
    return x * x + y * y + z * z;
}

struct FloatBox {
    float lo[3] = {HUGE_VALF, HUGE_VALF, HUGE_VALF}, hi[3] = {-HUGE_VALF, -HUGE_VALF, -HUGE_VALF};

    void extend(const float* other_lo, const float* other_hi) {
        for (int k = 0; k < 3; ++k) {
            if (other_lo[k] < lo[k]) lo[k] = other_lo[k];
            if (other_hi[k] > hi[k]) hi[k] = other_hi[k];
        }
    }
    double half_area() const {
        const double x = hi[0] - lo[0], y = hi[1] - lo[1], z = hi[2] - lo[2];
        return x * y + y * z + z * x;
    }
};

} // namespace

Box used_box(const Mesh& mesh) {
    Box box;
    for (int32_t c = 0; c < mesh.corners(); ++c) box.extend(mesh.position(mesh.corner_vert[c]));
    return box;
}

Frame::Frame(const Box& box) : scale(1), unit(1), shift{0, 0, 0} {
    if (box.empty()) return;
    const double lo[3] = {box.lo.x, box.lo.y, box.lo.z}, hi[3] = {box.hi.x, box.hi.y, box.hi.z};
    double half = 0, farthest = 0;
    for (int k = 0; k < 3; ++k) {
        half = larger(half, 0.5 * hi[k] - 0.5 * lo[k]);
        farthest = larger(farthest, larger(std::fabs(lo[k]), std::fabs(hi[k])));
    }
    int exponent = 0;
    std::frexp(half > 0 ? half : farthest, &exponent);
    if (exponent < -1000) exponent = -1000; // 2^1023 is the largest power there is
    if (exponent > 1000) exponent = 1000;
    scale = std::ldexp(1.0, -exponent);
    unit = std::ldexp(1.0, exponent);
    double s[3];
    for (int k = 0; k < 3; ++k) {
        const double a = scale * lo[k], b = scale * hi[k];
        s[k] = a > 0 && b <= 2 * a ? a : b < 0 && a >= 2 * b ? b : 0;
    }
    shift = {s[0], s[1], s[2]};
}

struct Bvh::Primitive {
    float lo[3], hi[3];
    int32_t face;
    float centre(int axis) const { return lo[axis] + hi[axis]; } // times two
};

// Reorders [begin, end) into two ranges, neither empty, and returns where the second begins.
int64_t Bvh::partition(Primitive* primitives, int64_t begin, int64_t end, int32_t depth) const {
    const int64_t middle = begin + (end - begin) / 2;
    if (depth >= kHeuristicDepth) return middle;
    float lo[3] = {HUGE_VALF, HUGE_VALF, HUGE_VALF}, hi[3] = {-HUGE_VALF, -HUGE_VALF, -HUGE_VALF};
    for (int64_t i = begin; i < end; ++i) {
        for (int k = 0; k < 3; ++k) {
            const float x = primitives[i].centre(k);
            if (x < lo[k]) lo[k] = x;
            if (x > hi[k]) hi[k] = x;
        }
    }
    int axis = 0;
    for (int k = 1; k < 3; ++k)
        if (hi[k] - lo[k] > hi[axis] - lo[axis]) axis = k;
    const float origin = lo[axis], per_bin = kBins / (hi[axis] - lo[axis]);
    if (!(hi[axis] > origin) || !std::isfinite(per_bin)) return middle;
    const auto bin_of = [&](const Primitive& p) {
        const int bin = static_cast<int>((p.centre(axis) - origin) * per_bin);
        return bin < kBins ? bin : kBins - 1;
    };

    FloatBox bins[kBins];
    int64_t counts[kBins] = {};
    for (int64_t i = begin; i < end; ++i) {
        const int bin = bin_of(primitives[i]);
        bins[bin].extend(primitives[i].lo, primitives[i].hi);
        ++counts[bin];
    }
    double right_cost[kBins]; // of the bins [k, kBins)
    FloatBox box;
    int64_t count = 0;
    for (int k = kBins - 1; k > 0; --k) {
        box.extend(bins[k].lo, bins[k].hi);
        count += counts[k];
        right_cost[k] = count == 0 ? 0 : box.half_area() * static_cast<double>(count);
    }
    // The first bin and the last one hold something, so that no split is empty on a side.
    box = FloatBox();
    count = 0;
    int best = 1;
    double best_cost = HUGE_VAL;
    for (int k = 1; k < kBins; ++k) {
        box.extend(bins[k - 1].lo, bins[k - 1].hi);
        count += counts[k - 1];
        const double cost = box.half_area() * static_cast<double>(count) + right_cost[k];
        if (cost < best_cost) {
            best_cost = cost;
            best = k;
        }
    }
    int64_t i = begin, j = end;
    for (;;) {
        while (i < j && bin_of(primitives[i]) < best) ++i;
        while (i < j && bin_of(primitives[j - 1]) >= best) --j;
        if (i >= j) return i > begin && i < end ? i : middle;
        std::swap(primitives[i], primitives[j - 1]);
    }
}

Status Bvh::build(Context& context, const Mesh& mesh, const Frame& frame) {
    const int32_t faces = mesh.faces();
    Memory& memory = nodes_.memory();
    Array<Primitive> primitives(memory, faces);
    for (int32_t f = 0; f < faces; ++f) {
        if (f % kFacesBetween == 0) DM_TRY(context.progress(0));
        Box box;
        for (int32_t c = 3 * f; c < 3 * f + 3; ++c) box.extend(frame(mesh.position(mesh.corner_vert[c])));
        primitives[f] = {{float_below(box.lo.x), float_below(box.lo.y), float_below(box.lo.z)},
                         {float_above(box.hi.x), float_above(box.hi.y), float_above(box.hi.z)},
                         f};
    }

    struct Range {
        int64_t begin, end;
        int32_t node, depth;
    } stack[kStackSize];
    int32_t top = 0;
    stack[top++] = {0, faces, 0, 0};
    nodes_.clear();
    nodes_.push_back(Node{});
    for (int64_t step = 0; top > 0; ++step) {
        if (step % kProgressEvery == 0) DM_TRY(context.progress(static_cast<double>(nodes_.size()) / faces));
        const Range range = stack[--top];
        FloatBox box;
        for (int64_t i = range.begin; i < range.end; ++i) box.extend(primitives[i].lo, primitives[i].hi);
        Node& node = nodes_[range.node];
        for (int k = 0; k < 3; ++k) {
            node.lo[k] = box.lo[k];
            node.hi[k] = box.hi[k];
        }
        node.first = static_cast<int32_t>(range.begin);
        node.count = static_cast<int32_t>(range.end - range.begin);
        if (node.count <= kLeafSize) continue;
        const int64_t middle = partition(primitives.data(), range.begin, range.end, range.depth);
        const int32_t left = static_cast<int32_t>(nodes_.size());
        node.first = left;
        node.count = 0;
        nodes_.push_back(Node{}); // node is not valid any more
        nodes_.push_back(Node{});
        stack[top++] = {middle, range.end, left + 1, range.depth + 1};
        stack[top++] = {range.begin, middle, left, range.depth + 1};
    }

    faces_.resize_uninitialized(faces);
    for (int32_t t = 0; t < faces; ++t) faces_[t] = primitives[t].face;
    primitives.free_storage();
    Array<Node> nodes(memory); // without the room that it grew into
    nodes.copy_from(nodes_);
    nodes_ = std::move(nodes);
    return make_triangles(context, mesh, frame);
}

Status Bvh::make_triangles(Context& context, const Mesh& mesh, const Frame& frame) {
    const int32_t faces = size();
    const auto corner = [&](int32_t t, int32_t k) { return frame(mesh.position(mesh.corner_vert[3 * faces_[t] + k])); };
    triangles_.free_storage();
    narrow_triangles_.resize_uninitialized(faces);
    bool narrow = true; // float32 meshes nearly always are: frames are made so
    for (int32_t t = 0; t < faces && narrow; ++t) {
        if (t % kFacesBetween == 0) DM_TRY(context.progress(1));
        float* x = narrow_triangles_[t].corner;
        for (int32_t k = 0; k < 3; ++k, x += 3) {
            const Vec3 p = corner(t, k);
            x[0] = static_cast<float>(p.x), x[1] = static_cast<float>(p.y), x[2] = static_cast<float>(p.z);
            narrow &= p == Vec3{x[0], x[1], x[2]};
        }
    }
    if (narrow) return DELMESH_OK;
    narrow_triangles_.free_storage();
    triangles_.resize_uninitialized(faces);
    for (int32_t t = 0; t < faces; ++t) {
        if (t % kFacesBetween == 0) DM_TRY(context.progress(1));
        for (int32_t k = 0; k < 3; ++k) triangles_[t].corner[k] = corner(t, k);
    }
    return DELMESH_OK;
}

double Bvh::distance_squared(const Vec3& p, const Node& node) {
    return box_distance_squared(p, node.lo, node.hi);
}

double Bvh::distance_squared(const Vec3& p, int32_t t) const {
    const Triangle triangle = this->triangle(t);
    return triangle_distance_squared(p, triangle.corner[0], triangle.corner[1], triangle.corner[2]);
}

Bvh::Hit Bvh::closest(const Vec3& p, int32_t near) const {
    struct Entry {
        double distance_squared;
        int32_t node;
    } stack[kStackSize];
    Hit hit{distance_squared(p, near), near};
    int32_t top = 0;
    Entry entry{distance_squared(p, nodes_[0]), 0};
    for (;;) {
        if (entry.distance_squared < hit.distance_squared) {
            const Node& node = nodes_[entry.node];
            if (node.count == 0) {
                Entry one{distance_squared(p, nodes_[node.first]), node.first};
                Entry two{distance_squared(p, nodes_[node.first + 1]), node.first + 1};
                if (two.distance_squared < one.distance_squared) std::swap(one, two);
                stack[top++] = two;
                entry = one;
                continue;
            }
            for (int32_t t = node.first; t < node.first + node.count; ++t) {
                const double d = distance_squared(p, t);
                if (d < hit.distance_squared) hit = {d, t};
            }
        }
        if (top == 0) return hit;
        entry = stack[--top];
    }
}

Status FaceTree::build(Context& context, const Mesh& mesh, Array<int32_t> order) {
    mesh_ = &mesh;
    frame_ = Frame(used_box(mesh));
    order_ = std::move(order);
    const auto faces = static_cast<int32_t>(order_.size());
    boxes_.clear();
    levels_ = 0;
    if (faces == 0) return DELMESH_OK;
    int32_t count = (faces - 1) / kLeafSize + 1;
    boxes_.reserve(2 * static_cast<int64_t>(count) + kMostLevels);
    begin_[levels_++] = 0;
    for (int32_t i = 0; i < count; ++i) {
        if (i % kProgressEvery == 0) DM_TRY(context.progress(static_cast<double>(i) / count));
        Box box;
        for (int32_t k = kLeafSize * i; k < kLeafSize * i + kLeafSize && k < faces; ++k)
            for (int32_t c = 3 * order_[k]; c < 3 * order_[k] + 3; ++c) box.extend(frame_(mesh.position(mesh.corner_vert[c])));
        boxes_.push_back({{float_below(box.lo.x), float_below(box.lo.y), float_below(box.lo.z)},
                          {float_above(box.hi.x), float_above(box.hi.y), float_above(box.hi.z)}});
    }
    while (count > 1) {
        const int32_t below = begin_[levels_ - 1], of_below = count;
        begin_[levels_++] = static_cast<int32_t>(boxes_.size());
        count = (of_below + 1) / 2;
        for (int32_t i = 0; i < count; ++i) {
            FloatBox box = boxes_[below + 2 * i];
            if (2 * i + 1 < of_below) {
                const FloatBox& other = boxes_[below + 2 * i + 1];
                for (int k = 0; k < 3; ++k) {
                    if (other.lo[k] < box.lo[k]) box.lo[k] = other.lo[k];
                    if (other.hi[k] > box.hi[k]) box.hi[k] = other.hi[k];
                }
            }
            boxes_.push_back(box);
        }
    }
    return DELMESH_OK;
}

FaceTree::Hit FaceTree::closest(const Vec3& point, int32_t near) const {
    struct Entry {
        double distance_squared;
        int32_t level, number;
    } stack[kStackSize];
    Hit hit;
    if (empty()) return hit;
    const Vec3 p = frame_(point);
    const auto entry_of = [&](int32_t level, int32_t number) {
        const FloatBox& box = boxes_[begin_[level] + number];
        return Entry{box_distance_squared(p, box.lo, box.hi), level, number};
    };
    double least = HUGE_VAL;
    const auto look = [&](int32_t leaf) {
        const int64_t first = static_cast<int64_t>(kLeafSize) * leaf;
        for (int64_t i = first; i < first + kLeafSize && i < order_.size(); ++i) {
            Vec3 x[3];
            for (int32_t k = 0; k < 3; ++k) x[k] = frame_(mesh_->position(mesh_->corner_vert[3 * order_[i] + k]));
            const ClosestPoint c = closest_on_triangle(p, x[0], x[1], x[2]);
            const double d = length_squared(c.residual);
            if (d < least) least = d, hit = {order_[i], {larger(c.weight[0], 0), c.weight[1], c.weight[2]}};
        }
    };
    look(near / kLeafSize);
    int32_t top = 0;
    Entry entry = entry_of(levels_ - 1, 0);
    for (;;) {
        if (entry.distance_squared < least) {
            if (entry.level > 0) {
                Entry one = entry_of(entry.level - 1, 2 * entry.number);
                if (begin_[entry.level - 1] + 2 * entry.number + 1 < begin_[entry.level]) {
                    Entry two = entry_of(entry.level - 1, 2 * entry.number + 1);
                    if (two.distance_squared < one.distance_squared) std::swap(one, two);
                    stack[top++] = two;
                }
                entry = one;
                continue;
            }
            look(entry.number);
        }
        if (top == 0) return hit;
        entry = stack[--top];
    }
}

} // namespace dm
