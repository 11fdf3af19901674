// SPDX-License-Identifier: Apache-2.0
#include "algo/flat_patches.h"

#include <algorithm>
#include <utility>

#include "geom/predicates.h"

namespace dm {
namespace {

Vec3 area_vector(const Surface& s, int32_t face) {
    const Vec3 &a = s.at(s.vert(3 * face)), &b = s.at(s.vert(3 * face + 1)), &c = s.at(s.vert(3 * face + 2));
    return cross(b - a, c - a);
}

} // namespace

void FlatPatches::set(int32_t face, int32_t patch, double new_drift) {
    if (in_trial) face_changes.push_back({face, face_patch[face], drift[face]});
    face_patch[face] = patch;
    drift[face] = new_drift;
}

FlatPatches::Region& FlatPatches::change(int32_t r) {
    if (in_trial) region_changes.push_back({r, regions[r]});
    return regions[r];
}

Vec3 FlatPatches::normal(const Surface& s, int32_t f, int32_t g) const {
    return is_alone(f) ? area_vector(s, f) + area_vector(s, g) : planes[plane_of(f)].normal;
}

void FlatPatches::raise(int32_t face, double new_moved) {
    const double new_drift = new_moved - moved_with_its_patch(face);
    if (new_drift > drift[face]) set(face, face_patch[face], new_drift);
}

void FlatPatches::own(const Surface& s, int32_t face, double new_moved) {
    const int32_t r = region_of(face);
    if (r >= 0) forget_reference(r);
    enter(s, face, -1);
    drift[face] = new_moved;
}

void FlatPatches::spread(int32_t from, int32_t to) {
    if (face_patch.size() <= to) {
        face_patch.resize(to + 1, 0);
        drift.resize(to + 1, 0);
    }
    set(to, face_patch[from], drift[from]);
}

void FlatPatches::mix(int32_t f, int32_t g, bool same_source) {
    const double most = std::max(drift[f], drift[g]);
    const int32_t flipped = same_source || is_alone(f) ? (face_patch[f] | face_patch[g]) & kFlipped : kFlipped;
    for (const int32_t face : {f, g}) set(face, face_patch[face] | flipped, most);
}

void FlatPatches::merge(int32_t face, int32_t gone) {
    set(face, face_patch[face] | (face_patch[gone] & kFlipped), std::max(drift[face], drift[gone]));
}

void FlatPatches::follow(int32_t face, int32_t other) {
    const double most = std::max(moved(face), moved(other));
    set(face, face_patch[other], drift[other]);
    for (const int32_t f : {face, other}) raise(f, most);
}

int32_t FlatPatches::add_leaf(const Triangle& triangle, double base) {
    Region leaf;
    leaf.triangle = triangles.add(triangle);
    leaf.size = 1;
    leaf.base = base;
    return regions.add(leaf);
}

int32_t FlatPatches::unite(int32_t a, int32_t b) {
    Region both;
    both.left = a;
    both.right = b;
    both.size = regions[a].size + regions[b].size;
    const int32_t r = regions.add(both);
    for (const int32_t part : {a, b}) change(part).parent = r;
    return r;
}

void FlatPatches::set_moved(int32_t r, double base, double height, bool measured) {
    Region& region = change(r);
    region.base = base;
    region.height = height;
    region.measured = measured;
}

void FlatPatches::forget_reference(int32_t r) {
    if (regions[r].size != 0) change(r).size = 0;
}

void FlatPatches::enter(const Surface& s, int32_t face, int32_t r) {
    const Vec3 n = area_vector(s, face);
    const double size = length(n);
    set(face, 2 * planes.add({size > 0 ? (1 / size) * n : n, 0, r}), 0);
}

void FlatPatches::begin_trial() {
    in_trial = true;
    faces_before = face_patch.size();
    planes_before = planes.end();
    regions_before = regions.end();
    triangles_before = triangles.end();
}

void FlatPatches::keep_trial() {
    in_trial = false;
    face_changes.clear();
    region_changes.clear();
}

void FlatPatches::undo_trial() {
    in_trial = false;
    for (int64_t i = face_changes.size() - 1; i >= 0; --i) {
        face_patch[face_changes[i].face] = face_changes[i].patch;
        drift[face_changes[i].face] = face_changes[i].drift;
    }
    for (int64_t i = region_changes.size() - 1; i >= 0; --i) regions[region_changes[i].number] = region_changes[i].before;
    face_changes.clear();
    region_changes.clear();
    if (!is_part) {
        face_patch.resize_uninitialized(faces_before);
        drift.resize_uninitialized(faces_before);
    }
    planes.cut(planes_before);
    regions.cut(regions_before);
    triangles.cut(triangles_before);
}

FlatPatches::FlatPatches(FlatPatches& whole)
    : face_patch(Array<int32_t>::alias(whole.face_patch)), drift(Array<double>::alias(whole.drift)), planes(whole.planes),
      regions(whole.regions), triangles(whole.triangles), is_part(true), face_changes(whole.drift.memory()),
      region_changes(whole.drift.memory()) {}

void FlatPatches::swap_log(TrialLog& log) {
    std::swap(face_changes, log.face_changes);
    std::swap(region_changes, log.region_changes);
}

void FlatPatches::refresh(FlatPatches& whole) {
    face_patch = Array<int32_t>::alias(whole.face_patch);
    drift = Array<double>::alias(whole.drift);
    planes.items = Array<Plane>::alias(whole.planes.items);
    regions.items = Array<Region>::alias(whole.regions.items);
    triangles.items = Array<Triangle>::alias(whole.triangles.items);
}

void FlatPatches::supply(const Share& share) {
    planes.own = share.planes;
    regions.own = share.regions;
    triangles.own = share.triangles;
}

FlatPatches::Share FlatPatches::grow_blank(const Surface& surface, int32_t flips) {
    face_patch.reserve(surface.faces());
    drift.reserve(surface.faces());
    face_patch.resize(surface.faces(), 0);
    drift.resize(surface.faces(), 0);
    return {planes.grow(2 * flips, {{0, 0, 0}, 0, -1}), regions.grow(3 * flips, {}), triangles.grow(2 * flips, {})};
}

bool FlatPatches::has_room() const {
    return !is_part || (planes.has_room(2) && regions.has_room(3) && triangles.has_room(2) &&
                        (!in_trial || (face_changes.room() >= 64 && region_changes.room() >= 16)));
}

void FlatPatches::free_storage() {
    face_patch.free_storage();
    drift.free_storage();
    planes.items.free_storage();
    regions.items.free_storage();
    triangles.items.free_storage();
}

Status grow_flat_patches(Context& context, const Surface& s, double thickness, AffineLayers* layers, FlatPatches& out) {
    constexpr int64_t kGrain = 8192;
    const int32_t faces = s.faces();
    const int64_t room = faces + s.face_src.room();
    out.face_patch.reserve(room);
    out.drift.reserve(room);
    out.face_patch.resize_uninitialized(faces);
    for (int32_t f = 0; f < faces; ++f) out.face_patch[f] = FlatPatches::alone(f);
    out.drift.assign(faces, 0);
    out.planes.cut(0);
    // Nearly all faces stay alone. A seed is a face in whose slab a neighbour lies.
    const auto takes = [&](int32_t k, const Vec3& n, const Vec3& a, double lowest, double highest, double& height) {
        if (s.is_boundary(k) || s.is_kept(k)) return false;
        const int32_t t = s.twin(k);
        const Vec3& far = s.at(s.apex(t));
        if (!(thickness > 0)) return flat_edge(s.at(s.vert(k)), s.at(s.head(k)), s.at(s.apex(k)), far);
        height = dot(n, far - a);
        if (!(std::max(highest, height) - std::min(lowest, height) <= thickness)) return false;
        return dot(n, cross(s.at(s.head(t)) - s.at(s.vert(t)), far - s.at(s.vert(t)))) >= 0;
    };
    const auto unit_normal = [&](int32_t f, Vec3& n) {
        n = area_vector(s, f);
        const double size = length(n);
        if (!(size > 0)) return false;
        n = (1 / size) * n;
        return true;
    };
    Array<uint8_t> is_seed(context.memory(), faces);
    DM_TRY(context.parallel(faces, kGrain, [&](int64_t, int64_t begin, int64_t end) {
        const int32_t *const verts = s.corner_vert.data(), *const twins = s.corner_twin.data();
        const Vec3* const pos = s.pos.data();
        const double slab = thickness * thickness * (1 + 1e-9); // squared; what passes is looked at again
        for (int32_t f = static_cast<int32_t>(begin); f < end; ++f) {
            is_seed[f] = 0;
            if (s.is_dead(f)) continue;
            const Vec3& a = pos[verts[3 * f]];
            const Vec3 area = cross(pos[verts[3 * f + 1]] - a, pos[verts[3 * f + 2]] - a);
            const double most = slab * length_squared(area);
            bool unclear = !(thickness > 0); // nearly always it is clear that no neighbour lies in the slab
            for (int32_t k = 3 * f; k < 3 * f + 3; ++k) {
                if (twins[k] < 0) continue;
                const double volume = dot(area, pos[verts[prev_corner(twins[k])]] - a);
                unclear |= !(volume * volume > most);
            }
            Vec3 n;
            double height;
            if (!unclear || !unit_normal(f, n)) continue;
            for (int32_t k = 3 * f; k < 3 * f + 3 && is_seed[f] == 0; ++k) is_seed[f] = takes(k, n, a, 0, 0, height) ? 1 : 0;
        }
    }));
    struct Seed {
        double altitude; // the smallest of the face, squared: how well its plane is determined
        int32_t face;
    };
    Array<Seed> seeds(context.memory());
    for (int32_t f = 0; f < faces; ++f) {
        if ((f & 0xffff) == 0) DM_TRY(context.progress(0));
        if (is_seed[f] == 0) continue;
        const Vec3 &a = s.at(s.vert(3 * f)), &b = s.at(s.vert(3 * f + 1)), &c = s.at(s.vert(3 * f + 2));
        const double longest = std::max({length_squared(b - a), length_squared(c - b), length_squared(a - c)});
        seeds.push_back({length_squared(cross(b - a, c - a)) / longest, f});
    }
    const auto is_before = [](const Seed& a, const Seed& b) {
        return a.altitude != b.altitude ? a.altitude > b.altitude : a.face < b.face;
    };
    constexpr int64_t kSortedAtOnce = 1 << 18;
    for (int64_t begin = 0; thickness > 0 && begin < seeds.size(); begin += kSortedAtOnce) {
        DM_TRY(context.progress(0));
        const int64_t end = std::min(seeds.size(), begin + kSortedAtOnce);
        if (end < seeds.size()) std::nth_element(seeds.begin() + begin, seeds.begin() + end, seeds.end(), is_before);
        std::sort(seeds.begin() + begin, seeds.begin() + end, is_before);
    }
    Array<int32_t> front(context.memory());
    int64_t done = 0;
    for (const Seed& seed : seeds) {
        if ((++done & 0x3fff) == 0) DM_TRY(context.progress(static_cast<double>(done) / static_cast<double>(seeds.size())));
        Vec3 n;
        if (!out.is_alone(seed.face) || !unit_normal(seed.face, n)) continue;
        if (layers != nullptr && !layers->fit(s, seed.face)) continue;
        const int32_t patch = 2 * static_cast<int32_t>(out.planes.end());
        const Vec3& a = s.at(s.vert(3 * seed.face));
        double lowest = 0, highest = 0;
        bool grown = false;
        front.clear();
        front.push_back(seed.face);
        out.face_patch[seed.face] = patch;
        while (!front.empty()) {
            const int32_t f = front.pop_back();
            for (int32_t k = 3 * f; k < 3 * f + 3; ++k) {
                const int32_t g = s.is_boundary(k) ? f : face_of(s.twin(k));
                double height = 0;
                if (!out.is_alone(g) || !takes(k, n, a, lowest, highest, height)) continue;
                if (layers != nullptr && !layers->agrees(s, g)) continue;
                lowest = std::min(lowest, height);
                highest = std::max(highest, height);
                out.face_patch[g] = patch;
                front.push_back(g);
                grown = true;
            }
        }
        if (grown)
            out.planes.add({n, highest - lowest, -1});
        else
            out.face_patch[seed.face] = FlatPatches::alone(seed.face);
    }
    return DELMESH_OK;
}

} // namespace dm
