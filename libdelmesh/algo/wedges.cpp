// SPDX-License-Identifier: Apache-2.0
#include "algo/wedges.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "mesh/source_map.h"

namespace dm {

bool Wedges::are_needed(const Mesh& in) {
    for (const MeshLayer& layer : in.layers)
        if (layer.first_value >= 0 && layer.weight > 0) return true;
    return false;
}

Status Wedges::begin(Context& context, const Mesh& in, const Mesh& full, const SpatialOrder& order, const Surface& s) {
    components_ = 0;
    for (const MeshLayer& layer : in.layers) components_ += layer.first_value >= 0 && layer.weight > 0 ? layer.components : 0;
    values_.resize_uninitialized(static_cast<int64_t>(s.corners()) * components_);
    int32_t first = 0;
    for (const MeshLayer& layer : in.layers) {
        if (layer.first_value < 0 || !(layer.weight > 0)) continue;
        const float* const given = in.layer_values.data() + layer.first_value;
        const int64_t count = layer_value_count(in) * layer.components;
        double range = 0, middle[16];
        for (int32_t k = 0; k < layer.components; ++k) {
            double low = HUGE_VAL, high = -HUGE_VAL;
            for (int64_t i = k; i < count; i += layer.components) {
                if (!std::isfinite(given[i])) continue;
                low = std::min<double>(low, given[i]);
                high = std::max<double>(high, given[i]);
            }
            middle[k] = high >= low ? 0.5 * (low + high) : 0;
            if (high > low) range = std::max(range, high - low);
        }
        const double scale = range > 0 ? layer.weight / range : 0;
        DM_TRY(context.progress(0));
        DM_TRY(context.parallel(s.faces(), 1 << 13, [&](int64_t, int64_t begin, int64_t end) {
            for (int64_t f = begin; f < end; ++f)
                for (int64_t k = 0; k < 3; ++k) {
                    const int64_t c = 3 * static_cast<int64_t>(order.old_face[f]) + k;
                    const int32_t at = full.corner_map.empty() ? static_cast<int32_t>(c) : full.corner_map[c];
                    double* const to = values_.data() + (3 * f + k) * components_ + first;
                    const auto value = [&](int32_t corner, int32_t i) {
                        return scale * (in.layer_values.data()[layer_value(in, layer, corner) + i] - middle[i]);
                    };
                    for (int32_t i = 0; i < layer.components; ++i) {
                        if (at >= 0) {
                            to[i] = value(at, i);
                            continue;
                        }
                        const CornerPlace& place = full.corner_places[~at];
                        to[i] = 0;
                        for (int j = 0; j < 3; ++j)
                            if (place.weight[j] != 0) to[i] += place.weight[j] * value(place.corner[j], i);
                    }
                }
        }));
        first += layer.components;
    }
    return DELMESH_OK;
}

void Wedges::find_wedges(const Surface& s) {
    wedge_.assign(s.corners(), -1);
    int32_t wedges = 0;
    for (int32_t v = 0; v < s.vertices(); ++v) {
        int32_t start = s.vert_corner[v];
        if (start < 0) continue;
        int32_t c = start;
        if (!s.is_boundary(start)) { // from a kept edge on, where there is one
            while (!s.is_kept(c) && (c = s.rotate(c)) != start) {}
            start = c;
        }
        do {
            if (c != start && s.is_kept(c)) ++wedges;
            wedge_[c] = wedges;
            c = s.rotate(c);
        } while (c >= 0 && c != start);
        ++wedges;
    }
    squares_.assign(wedges, Quadric{});
    areas_.assign(wedges, 0);
    means_.assign(static_cast<int64_t>(wedges) * components_, Mean{{0, 0, 0}, 0});
}

Status Wedges::add_faces(Context& context, const Surface& s, const Vec3& origin, double unit, double size,
                         const double* vert_weights) {
    find_wedges(s);
    origin_ = origin;
    for (int32_t f = 0; f < s.faces(); ++f) {
        if ((f & 0xffff) == 0) DM_TRY(context.progress(0));
        const double* const values = values_.data() + 3 * static_cast<int64_t>(f) * components_;
        const bool known = std::all_of(values, values + 3 * components_, [](double x) { return std::isfinite(x); });
        if (s.is_dead(f) || !known) continue;
        const Vec3 a = s.at(s.vert(3 * f)) - origin, ab = s.at(s.vert(3 * f + 1)) - origin - a,
                   ac = s.at(s.vert(3 * f + 2)) - origin - a, n = cross(ab, ac);
        const double nn = length_squared(n);
        if (!(nn > 0)) continue;
        const Vec3 along_b = (1 / nn) * cross(ac, n), along_c = (1 / nn) * cross(n, ab);
        const double area = unit * std::sqrt(nn) / 6;
        for (int32_t k = 0; k < 3; ++k) {
            const int32_t wedge = wedge_[3 * f + k];
            const double w = vert_weights != nullptr ? area * vert_weights[s.vert(3 * f + k)] : area;
            areas_[wedge] += w;
            for (int32_t i = 0; i < components_; ++i) {
                const double at_a = values[i], at_b = values[components_ + i], at_c = values[2 * components_ + i];
                const Vec3 g = size * ((at_b - at_a) * along_b + (at_c - at_a) * along_c), h = w * g;
                const double d = size * at_a - dot(g, a);
                squares_[wedge] +=
                    {h.x * g.x, h.x * g.y, h.x * g.z, h.y * g.y, h.y * g.z, h.z * g.z, h.x * d, h.y * d, h.z * d, w * d * d};
                Mean& mean = means_[static_cast<int64_t>(wedge) * components_ + i];
                mean.gradient = mean.gradient + h;
                mean.value += w * d;
            }
        }
    }
    values_.free_storage();
    return DELMESH_OK;
}

void Wedges::free_storage() {
    wedge_.free_storage();
    squares_.free_storage();
    areas_.free_storage();
    means_.free_storage();
}

Wedges::Sides Wedges::sides(const Surface& s, int32_t c) const {
    const int32_t t = s.twin(c);
    return {{wedge_[c], t < 0 ? -1 : wedge_[next_corner(t)]}, {wedge_[next_corner(c)], t < 0 ? -1 : wedge_[t]}};
}

Quadric Wedges::of(const Group& group) const {
    Quadric sum;
    double area = 0;
    for (int n = 0; n < group.count; ++n) {
        sum += squares_[group.wedge[n]];
        area += areas_[group.wedge[n]];
    }
    if (!(area > 0)) return {};
    for (int32_t i = 0; i < components_; ++i) {
        Vec3 g{0, 0, 0};
        double d = 0;
        for (int n = 0; n < group.count; ++n) {
            const Mean& mean = means_[static_cast<int64_t>(group.wedge[n]) * components_ + i];
            g = g + mean.gradient;
            d += mean.value;
        }
        const Vec3 h = (-1 / area) * g;
        sum += {h.x * g.x, h.x * g.y, h.x * g.z, h.y * g.y, h.y * g.z, h.z * g.z, h.x * d, h.y * d, h.z * d, -d * d / area};
    }
    return sum;
}

// The wedges that become one on either side. Where a line ends at one of the ends, both sides are the same wedge there, and all
// become one.
int Wedges::groups(const Surface& s, int32_t c, Group* out) const {
    const Sides at = sides(s, c);
    out[0] = {{at.p[0], at.q[0], -1}, 2};
    if (at.p[1] < 0) return 1;
    const bool one_p = at.p[0] == at.p[1], one_q = at.q[0] == at.q[1];
    if (one_p && one_q) return 1;
    if (!one_p && !one_q) return out[1] = {{at.p[1], at.q[1], -1}, 2}, 2;
    return out[0] = {{at.p[0], at.q[0], one_p ? at.q[1] : at.p[1]}, 3}, 1;
}

Quadric Wedges::merged(const Surface& s, int32_t c) const {
    Group group[2];
    const int count = groups(s, c, group);
    const Quadric first = of(group[0]);
    return count == 1 ? first : first + of(group[1]);
}

Wedges::Stand Wedges::stand_after(const Surface& s, int32_t collapsed, int32_t c, const Vec3& at) const {
    Group group[2];
    const int count = groups(s, collapsed, group);
    for (int i = 0; i < count; ++i)
        for (int n = 0; n < group[i].count; ++n)
            if (group[i].wedge[n] == wedge_[c]) return {at, group[i]};
    return {at, {{wedge_[c], -1, -1}, 1}};
}

double Wedges::value(const Stand& stand, int32_t component) const {
    double sum = 0, area = 0;
    for (int n = 0; n < stand.group.count; ++n) {
        const int64_t wedge = stand.group.wedge[n];
        const Mean& mean = means_[wedge * components_ + component];
        sum += dot(mean.gradient, stand.at - origin_) + mean.value;
        area += areas_[wedge];
    }
    return area > 0 ? sum / area : 0;
}

double Wedges::moved_by_flip(const Stand& a, const Stand& b, const Stand& u, const Stand& v) const {
    const Vec3 ab = b.at - a.at, uv = v.at - u.at, au = u.at - a.at, n = cross(ab, uv);
    const double nn = length_squared(n);
    if (!(nn > 0)) return 0;
    const double along_ab = dot(cross(au, uv), n) / nn, along_uv = dot(cross(au, ab), n) / nn;
    double sum = 0;
    for (int32_t i = 0; i < components_; ++i) {
        const double at_a = value(a, i), at_u = value(u, i);
        const double off = at_a + along_ab * (value(b, i) - at_a) - at_u - along_uv * (value(v, i) - at_u);
        sum += off * off;
    }
    return 0.25 * std::sqrt(nn) * sum;
}

void Wedges::flip(const Surface& s, int32_t c) {
    const int32_t t = s.twin(c);
    const int32_t at_u = wedge_[prev_corner(c)], at_v = wedge_[prev_corner(t)];
    put(next_corner(c), at_v);
    put(next_corner(t), at_u);
}

void Wedges::undo() {
    while (!changed_.empty()) {
        const Change change = changed_.pop_back();
        wedge_[change.corner] = change.old;
    }
    while (!merged_.empty()) {
        const Merged was = merged_.pop_back();
        squares_[was.wedge] = was.square;
        areas_[was.wedge] = was.area;
        for (int32_t i = components_; i-- > 0;)
            means_[static_cast<int64_t>(was.wedge) * components_ + i] = merged_means_.pop_back();
    }
}

void Wedges::merge(const Surface& s, int32_t p, const Sides& sides) {
    int32_t of_p[2] = {sides.p[0], sides.p[1]}, of_q[2] = {sides.q[0], sides.q[1]};
    for (int side = 0; side < 2 && of_p[side] >= 0; ++side) {
        const int32_t to = of_p[side], from = of_q[side];
        if (to == from) continue;
        merged_.push_back({to, squares_[to], areas_[to]});
        squares_[to] += squares_[from];
        areas_[to] += areas_[from];
        for (int32_t i = 0; i < components_; ++i) {
            Mean& mean = means_[static_cast<int64_t>(to) * components_ + i];
            const Mean& more = means_[static_cast<int64_t>(from) * components_ + i];
            merged_means_.push_back(mean);
            mean.gradient = mean.gradient + more.gradient;
            mean.value += more.value;
        }
        if (of_q[1] == from) of_q[1] = to;
        int32_t c = s.vert_corner[p];
        const int32_t start = c;
        do {
            if (wedge_[c] == from) put(c, to);
            c = s.rotate(c);
        } while (c >= 0 && c != start);
    }
}

} // namespace dm
