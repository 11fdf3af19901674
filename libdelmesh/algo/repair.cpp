// SPDX-License-Identifier: Apache-2.0
#include "algo/repair.h"

#include <utility>

#include "geom/predicates.h"

namespace dm {
namespace {

class Repair {
public:
    Repair(Context& context_, Surface& surface, Array<int32_t>&& zero_area_faces, delmesh_remesh_report& report_)
        : context(context_), s(surface), report(report_), work(std::move(zero_area_faces)) {}

    Status run(bool strict) {
        if (work.empty()) return DELMESH_OK;
        if (work.size() == s.faces())
            return context.fail(DELMESH_ERROR_NO_SURFACE, "No face had any area at the output precision.");
        if (strict)
            return context.fail(DELMESH_ERROR_STRICT, "Face %d had no area at the output precision, and %lld more.",
                                s.face_src[work[0]], static_cast<long long>(work.size() - 1));
        // A repair can make a neighbour repairable, so go on while something happens. Each step removes a face without area.
        bool happened = true;
        int64_t steps = 0;
        const int64_t most = 8 * static_cast<int64_t>(s.faces()); // nothing needs that many; a promise that this ends
        while (happened && !work.empty() && steps < most) {
            happened = false;
            const int64_t round = work.size();
            for (int64_t i = 0; i < round; ++i) {
                if ((++steps & 0xfff) == 0) DM_TRY(context.progress(0.5));
                const int32_t f = work[i];
                if (s.is_dead(f) || !without_area(f)) continue;
                if (mend(f)) happened = true;
                if (!s.is_dead(f) && without_area(f)) work.push_back(f);
            }
            int64_t kept = 0;
            for (int64_t i = round; i < work.size(); ++i) work[kept++] = work[i];
            work.resize_uninitialized(kept);
        }
        return DELMESH_OK;
    }

private:
    bool without_area(int32_t f) const {
        return zero_area(s.at(s.vert(3 * f)), s.at(s.vert(3 * f + 1)), s.at(s.vert(3 * f + 2)));
    }

    bool mend(int32_t f) {
        for (int32_t c = 3 * f; c < 3 * f + 3; ++c) {
            if (!(s.at(s.vert(c)) == s.at(s.head(c)))) continue;
            // The smaller vertex stays: the caller's first of the two, and the same one on all sheets of a cut edge.
            const int32_t p = s.vert(c), q = s.head(c);
            const auto before = [&](int32_t a, int32_t b) {
                const int32_t ra = s.vert_root.empty() ? a : s.root(a), rb = s.vert_root.empty() ? b : s.root(b);
                return ra != rb ? ra < rb : a < b;
            };
            const int32_t t = s.twin(c);
            const bool turn = t >= 0 && before(q, p);
            if (s.collapse_is_legal(turn ? t : c)) {
                s.collapse(turn ? t : c);
                if (t < 0 && before(q, p) && s.vert_corner[p] >= 0) s.rename(p, q);
            } else if (!s.collapse_and_cut(turn ? t : c))
                continue;
            ++report.collapsed_edges;
            return true;
        }
        for (int32_t c = 3 * f; c < 3 * f + 3; ++c) {
            const Vec3 &a = s.at(s.vert(c)), &b = s.at(s.head(c)), &m = s.at(s.apex(c));
            if (!boundary_edge_is_nld(a, b, m)) continue; // m lies between a and b when the angle there is 180
            if (s.is_boundary(c)) {
                s.remove_boundary_face(c);
                ++report.removed_zero_area_faces;
                return true;
            }
            const int32_t t = s.twin(c);
            const int32_t u = s.apex(c), v = s.apex(t);
            if (s.is_kept(c) || u == v || s.adjacent(u, v) || !edge_is_nld(a, b, m, s.at(v))) return false;
            s.flip(c);
            ++report.removed_zero_area_faces;
            if (without_area(face_of(t))) work.push_back(face_of(t));
            return true;
        }
        return false;
    }

    Context& context;
    Surface& s;
    delmesh_remesh_report& report;
    Array<int32_t> work;
};

} // namespace

Status repair_zero_area(Context& context, Surface& surface, Array<int32_t>&& zero_area_faces, bool strict,
                        delmesh_remesh_report& report) {
    DM_TRY(Repair(context, surface, std::move(zero_area_faces), report).run(strict));
    if (surface.faces() == surface.dead_faces)
        return context.fail(DELMESH_ERROR_NO_SURFACE, "No face had any area at the output precision.");
    return DELMESH_OK;
}

} // namespace dm
