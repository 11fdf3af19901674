// SPDX-License-Identifier: Apache-2.0
// Where a texture lies on a flat place as one affine map does, so that it stays there whatever triangles the place is cut into.
#pragma once

#include "mesh/source_map.h"
#include "mesh/surface.h"

namespace dm {

// The UV layers of a mesh whose borders are kept.
class AffineLayers {
public:
    AffineLayers(Memory& memory, const Mesh& mesh, EdgeBits kept)
        : in_(mesh), kept_((kept & DELMESH_EDGE_UV) != 0), fits_(memory) {
        if (!kept_) return;
        for (const MeshLayer& layer : in_.layers) count_ += is_looked_at(layer) ? layer.components : 0;
        fits_.resize_uninitialized(count_);
    }
    bool empty() const { return count_ == 0; }

    // The affine maps of this face, which is as it was in the mesh, become those that others are held against. False if it has
    // none: without area, or no longer as it was.
    bool fit(const Surface& s, int32_t face);
    // Do they give the values of this face's corners too, each within its layer's tolerance?
    bool agrees(const Surface& s, int32_t face) const;

private:
    struct Fit { // value + gradient . (x - origin)
        double value;
        Vec3 gradient;
    };
    static bool is_looked_at(const MeshLayer& layer) { return layer.kind == DELMESH_LAYER_UV && layer.keep; }
    bool is_unchanged(const Surface& s, int32_t face) const {
        for (int32_t k = 0; k < 3; ++k)
            if (s.copied(s.vert(3 * face + k)) != in_.corner_vert[3 * s.face_src[face] + k]) return false;
        return true;
    }
    double value(const MeshLayer& layer, int32_t corner, int32_t component) const {
        return in_.layer_values[layer_value(in_, layer, corner) + component];
    }

    const Mesh& in_;
    const bool kept_;
    int32_t count_ = 0; // components, of all
    Vec3 origin_{0, 0, 0};
    Array<Fit> fits_;
};

inline bool AffineLayers::fit(const Surface& s, int32_t face) {
    if (!is_unchanged(s, face)) return false;
    origin_ = s.at(s.vert(3 * face));
    const Vec3 ab = s.at(s.vert(3 * face + 1)) - origin_, ac = s.at(s.vert(3 * face + 2)) - origin_, n = cross(ab, ac);
    const double size = length_squared(n);
    if (!(size > 0)) return false;
    const Vec3 along_b = (1 / size) * cross(ac, n), along_c = (1 / size) * cross(n, ab);
    const int32_t corner = 3 * s.face_src[face];
    Fit* fit = fits_.begin();
    for (const MeshLayer& layer : in_.layers) {
        if (!is_looked_at(layer)) continue;
        for (int32_t k = 0; k < layer.components; ++k, ++fit) {
            fit->value = value(layer, corner, k);
            fit->gradient =
                (value(layer, corner + 1, k) - fit->value) * along_b + (value(layer, corner + 2, k) - fit->value) * along_c;
        }
    }
    return true;
}

inline bool AffineLayers::agrees(const Surface& s, int32_t face) const {
    if (!is_unchanged(s, face)) return false;
    const Fit* fit = fits_.begin();
    for (const MeshLayer& layer : in_.layers) {
        if (!is_looked_at(layer)) continue;
        for (int32_t k = 0; k < layer.components; ++k, ++fit)
            for (int32_t c = 0; c < 3; ++c) {
                const double there = fit->value + dot(fit->gradient, s.at(s.vert(3 * face + c)) - origin_);
                const double off = there - value(layer, 3 * s.face_src[face] + c, k);
                if (!(off <= layer.affine_tolerance && -off <= layer.affine_tolerance)) return false;
            }
    }
    return true;
}

} // namespace dm
