// SPDX-License-Identifier: Apache-2.0
// First all vertices move, as if there were no limit, and the distance is bounded. If it is too large, they go back, a
// DeviationGuard looks at the level as it was, and every vertex takes its way again: all of it, half or a quarter. Neighbours may
// have stayed, so every step is tested again.
#include "algo/relax_within.h"

#include <algorithm>

#include "algo/deviation_guard.h"
#include "algo/measure.h"
#include "geom/angle.h"
#include "geom/predicates.h"
#include "mesh/surface.h"

namespace dm {
namespace {

class Steps {
public:
    Steps(Context& context_, const RelaxRules& rules_, const Mesh& level)
        : context(context_), rules(rules_), s(context_, level, level.precision), guard(context_, s), star(context_.memory()) {}

    Status run(const Mesh& in, double limit, const Array<Vec3>& wanted, Mesh& level, int64_t& moved) {
        bool within = true;
        DM_TRY(guard.begin(in, limit, within));
        if (!within) return DELMESH_OK;
        Array<uint8_t> there(context.memory(), wanted.size(), 0);
        constexpr int kPasses = 3; // who was in the way may have moved
        for (int pass = 0; pass < kPasses; ++pass) {
            bool any = false;
            for (int32_t v = 0; v < s.vertices(); ++v) {
                if (v % 64 == 0) DM_TRY(context.progress(static_cast<double>(v) / s.vertices()));
                if (there[v] != 0 || s.vert_corner[v] < 0 || wanted[v] == s.at(v)) continue;
                const Vec3 way = wanted[v] - s.at(v);
                for (double part = 1; part > 0.2 && there[v] == 0; part *= 0.5)
                    there[v] = take(v, part == 1 ? wanted[v] : round_to(rules.precision, s.at(v) + part * way)) ? 1 : 0;
                any |= there[v] != 0;
            }
            if (!any) break;
        }
        for (int32_t v = 0; v < s.vertices(); ++v) {
            if (there[v] == 0) continue;
            ++moved;
            level.set_position(v, s.at(v));
        }
        return DELMESH_OK;
    }

private:
    bool take(int32_t v, const Vec3& x) {
        const Vec3 before = s.at(v);
        const double was = sharpest(v);
        star.clear();
        int32_t c = s.vert_corner[v];
        do star.push_back(face_of(c));
        while ((c = s.rotate(c)) >= 0 && c != s.vert_corner[v]);
        s.pos[v] = x;
        if (is_allowed(v, before) && (sharpest(v) >= std::min(was, rules.sharpest)) && guard.accept(star)) return true;
        s.pos[v] = before;
        return false;
    }

    Vec3 normal(int32_t c) const {
        const Vec3& x = s.at(s.vert(c));
        return cross(s.at(s.head(c)) - x, s.at(s.apex(c)) - x);
    }
    // The least cosine between neighbouring normals in the star and at its rim.
    double sharpest(int32_t v) const {
        double least = 1;
        int32_t c = s.vert_corner[v];
        do
            for (const int32_t k : {c, next_corner(c)})
                if (s.twin(k) >= 0) least = std::min(least, cosine_between(normal(k), normal(s.twin(k))));
        while ((c = s.rotate(c)) >= 0 && c != s.vert_corner[v]);
        return least;
    }
    bool is_nld(int32_t c) const {
        if (s.is_frozen(c)) return false;
        const Vec3 &a = s.at(s.vert(c)), &b = s.at(s.head(c)), &x = s.at(s.apex(c));
        const int32_t t = s.twin(c);
        return t < 0 ? rules.boundary_rule && boundary_edge_is_nld(a, b, x) : edge_is_nld(a, b, x, s.at(s.apex(t)));
    }
    bool is_allowed(int32_t v, const Vec3& before) const {
        int32_t c = s.vert_corner[v];
        do {
            const Vec3 &x = s.at(v), &a = s.at(s.head(c)), &b = s.at(s.apex(c));
            if (!turns_less(cross(a - x, b - x), cross(a - before, b - before), rules.fold_cosine) || zero_area(x, a, b))
                return false;
            for (const int32_t k : {c, next_corner(c), prev_corner(c)})
                if (is_nld(k)) return false;
        } while ((c = s.rotate(c)) >= 0 && c != s.vert_corner[v]);
        return true;
    }

    Context& context;
    const RelaxRules& rules;
    Surface s;
    DeviationGuard guard;
    Array<int32_t> star;
};

} // namespace

Status relax_within(Context& context, const Mesh& in, const RelaxRules& rules, double limit, const uint8_t* stays, Mesh& level,
                    int64_t& moved) {
    Array<Vec3> before(context.memory()), wanted(context.memory());
    for (int32_t v = 0; v < level.vertices(); ++v) before.push_back(level.position(v));
    DM_TRY(relax(context, in, rules, stays, level, moved));
    if (moved == 0) return DELMESH_OK;
    double bound;
    DM_TRY(bound_distance(context, in, level, bound));
    if (bound <= limit) return DELMESH_OK;
    moved = 0;
    for (int32_t v = 0; v < level.vertices(); ++v) {
        wanted.push_back(level.position(v));
        level.set_position(v, before[v]);
    }
    Steps steps(context, rules, level);
    return steps.run(in, limit, wanted, level, moved);
}

} // namespace dm
