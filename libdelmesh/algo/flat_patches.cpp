// SPDX-License-Identifier: Apache-2.0
#include "algo/flat_patches.h"

#include <algorithm>

#include "geom/predicates.h"

namespace dm {

Status grow_flat_patches(Context& context, const Surface& s, double thickness, FlatPatches& out) {
    const int32_t faces = s.faces();
    struct Seed {
        double altitude; // the smallest of the face, squared: how well its plane is determined
        int32_t face;
    };
    Array<Seed> seeds(context.memory());
    seeds.reserve(faces);
    for (int32_t f = 0; f < faces; ++f) {
        if (s.is_dead(f)) continue;
        const Vec3 &a = s.at(s.vert(3 * f)), &b = s.at(s.vert(3 * f + 1)), &c = s.at(s.vert(3 * f + 2));
        const double longest = std::max({length_squared(b - a), length_squared(c - b), length_squared(a - c)});
        seeds.push_back({longest > 0 ? length_squared(cross(b - a, c - a)) / longest : 0, f});
    }
    if (thickness > 0)
        std::sort(seeds.begin(), seeds.end(), [](const Seed& a, const Seed& b) {
            return a.altitude != b.altitude ? a.altitude > b.altitude : a.face < b.face;
        });
    out.face_patch.assign(faces, -1);
    out.drift.assign(faces, 0);
    out.plane.clear();
    Array<int32_t> front(context.memory());
    int64_t done = 0;
    for (const Seed& seed : seeds) {
        if ((++done & 0xffff) == 0) DM_TRY(context.progress(static_cast<double>(done) / static_cast<double>(seeds.size())));
        if (out.face_patch[seed.face] >= 0) continue;
        const int32_t patch = static_cast<int32_t>(out.plane.size());
        const Vec3 &a = s.at(s.vert(3 * seed.face)), &b = s.at(s.vert(3 * seed.face + 1)), &c = s.at(s.vert(3 * seed.face + 2));
        Vec3 n = cross(b - a, c - a);
        const double size = length(n);
        const bool has_plane = size > 0;
        if (has_plane) n = (1 / size) * n;
        out.plane.push_back({n, 0});
        out.face_patch[seed.face] = patch;
        if (!has_plane) continue;
        double lowest = 0, highest = 0;
        front.clear();
        front.push_back(seed.face);
        while (!front.empty()) {
            const int32_t f = front.pop_back();
            for (int32_t k = 3 * f; k < 3 * f + 3; ++k) {
                if (s.is_boundary(k) || s.is_kept(k)) continue;
                const int32_t t = s.twin(k), g = face_of(t);
                if (out.face_patch[g] >= 0) continue;
                const Vec3& far = s.at(s.apex(t));
                if (thickness > 0) {
                    const double height = dot(n, far - a);
                    if (!(std::max(highest, height) - std::min(lowest, height) <= thickness)) continue;
                    const Vec3 turned = cross(s.at(s.head(t)) - s.at(s.vert(t)), far - s.at(s.vert(t)));
                    if (!(dot(n, turned) >= 0)) continue;
                    lowest = std::min(lowest, height);
                    highest = std::max(highest, height);
                } else if (!flat_edge(s.at(s.vert(k)), s.at(s.head(k)), s.at(s.apex(k)), far))
                    continue;
                out.face_patch[g] = patch;
                front.push_back(g);
            }
        }
        out.plane[patch].thickness = highest - lowest;
    }
    return DELMESH_OK;
}

} // namespace dm
