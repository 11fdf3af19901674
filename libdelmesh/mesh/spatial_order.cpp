// SPDX-License-Identifier: Apache-2.0
#include "mesh/spatial_order.h"

#include <algorithm>
#include <cmath>

#include "base/box.h"

namespace dm {
namespace {

constexpr int kBits = 10; // per axis: cells of a thousandth of the mesh

// 10 bits, spread to every third place.
uint32_t spread(uint32_t x) {
    x = (x | x << 16) & 0x030000ff;
    x = (x | x << 8) & 0x0300f00f;
    x = (x | x << 4) & 0x030c30c3;
    return (x | x << 2) & 0x09249249;
}

// Stable, by 10 bits of the codes at a time.
void radix_sort(const Array<uint32_t>& codes, Array<int32_t>& verts) {
    constexpr int32_t kSize = 1 << kBits;
    Array<int32_t> other(verts.memory(), verts.size());
    Array<int64_t> place(verts.memory());
    for (int pass = 0; pass < 3; ++pass) {
        const auto digit = [&](int32_t v) { return codes[v] >> (kBits * pass) & (kSize - 1); };
        place.assign(kSize + 1, 0);
        for (const int32_t v : verts) ++place[digit(v) + 1];
        for (int32_t i = 0; i < kSize; ++i) place[i + 1] += place[i];
        for (const int32_t v : verts) other[place[digit(v)]++] = v;
        std::swap(verts, other);
    }
}

} // namespace

Status sort_in_space(Context& context, const Mesh& in, SpatialOrder& order, Mesh& out) {
    Memory& memory = context.memory();
    const int32_t verts = in.vertices(), faces = in.faces();
    Box box;
    for (int32_t v = 0; v < verts; ++v) {
        const Vec3 x = in.position(v);
        if (is_finite(x)) box.extend(x); // else used by no face
    }
    const double size = box.longest_side();
    const double cells = size > 0 && std::isfinite(size) ? ((1 << kBits) - 1) / size : 0;
    Array<uint32_t> codes(memory, verts);
    constexpr int64_t kGrain = 1 << 14;
    DM_TRY(context.parallel(verts, kGrain, [&](int64_t, int64_t begin, int64_t end) {
        for (int32_t v = static_cast<int32_t>(begin); v < end; ++v) {
            const Vec3 x = in.position(v);
            const auto cell = [&](double a, double b) { return spread(static_cast<uint32_t>((a - b) * cells)); };
            codes[v] = is_finite(x) ? cell(x.x, box.lo.x) | cell(x.y, box.lo.y) << 1 | cell(x.z, box.lo.z) << 2 : 0;
        }
    }));
    order.old_vert.resize_uninitialized(verts);
    for (int32_t v = 0; v < verts; ++v) order.old_vert[v] = v;
    DM_TRY(context.progress(0.2));
    radix_sort(codes, order.old_vert);
    DM_TRY(context.progress(0.5));
    codes.free_storage();
    order.new_vert.resize_uninitialized(verts);
    for (int32_t v = 0; v < verts; ++v) order.new_vert[order.old_vert[v]] = v;
    DM_TRY(context.progress(0.55));

    // Faces, counted into their first vertices.
    const auto first_vert = [&](int32_t f) {
        const int32_t* v = in.corner_vert.data() + 3 * static_cast<int64_t>(f);
        return std::min({order.new_vert[v[0]], order.new_vert[v[1]], order.new_vert[v[2]]});
    };
    Array<int32_t> place(memory, static_cast<int64_t>(verts) + 1, 0);
    for (int32_t f = 0; f < faces; ++f) ++place[first_vert(f) + 1];
    for (int32_t v = 0; v < verts; ++v) place[v + 1] += place[v];
    DM_TRY(context.progress(0.6));
    order.old_face.resize_uninitialized(faces);
    order.new_face.resize_uninitialized(faces);
    for (int32_t f = 0; f < faces; ++f) {
        if ((f & 0xffff) == 0) DM_TRY(context.progress(0.6));
        const int32_t n = place[first_vert(f)]++;
        order.new_face[f] = n;
        order.old_face[n] = f;
    }

    DM_TRY(context.progress(0.7));
    out.precision = in.precision;
    out.vertex_count = verts;
    const auto move = [&](const auto& from, auto& to) {
        to.resize_uninitialized(from.size());
        for (int64_t v = 0; v < verts; ++v)
            for (int64_t k = 0; k < 3; ++k) to[3 * v + k] = from[3 * static_cast<int64_t>(order.old_vert[v]) + k];
    };
    if (in.precision == Precision::f32)
        move(in.pos32, out.pos32);
    else
        move(in.pos64, out.pos64);
    out.corner_vert.resize_uninitialized(in.corners());
    out.corner_twin.resize_uninitialized(in.corners());
    if (!in.corner_bits.empty()) out.corner_bits.resize_uninitialized(in.corners());
    const auto moved = [&](int32_t c) { return 3 * order.new_face[face_of(c)] + c % 3; };
    DM_TRY(context.parallel(faces, kGrain, [&](int64_t, int64_t begin, int64_t end) {
        for (int64_t f = begin; f < end; ++f)
            for (int32_t k = 0; k < 3; ++k) {
                const int64_t to = 3 * f + k, from = 3 * static_cast<int64_t>(order.old_face[f]) + k;
                const int32_t twin = in.corner_twin[from];
                out.corner_vert[to] = order.new_vert[in.corner_vert[from]];
                out.corner_twin[to] = twin < 0 ? twin : moved(twin);
                if (!in.corner_bits.empty()) out.corner_bits[to] = in.corner_bits[from];
            }
    }));
    out.cut_slots.copy_from(in.cut_slots);
    for (CutSlot& slot : out.cut_slots)
        if (slot.corner >= 0) slot.corner = moved(slot.corner);
    return DELMESH_OK;
}

} // namespace dm
