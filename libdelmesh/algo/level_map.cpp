// SPDX-License-Identifier: Apache-2.0
#include "algo/level_map.h"

#include "algo/parallel_slices.h"
#include "mesh/source_map.h"

namespace dm {
namespace {

constexpr int64_t kGrain = 512; // vertices
constexpr int kStarts = 4;      // of ways to the closest point

// Corners of full near a point, the nearest first.
struct Starts {
    int32_t corner[kStarts];
    double distance[kStarts];
    int count = 0;
    bool takes(double d) const { return count < kStarts || d < distance[kStarts - 1]; }
    void add(int32_t c, double d) {
        int k = count < kStarts ? count++ : kStarts - 1;
        for (; k > 0 && distance[k - 1] > d; --k) corner[k] = corner[k - 1], distance[k] = distance[k - 1];
        corner[k] = c, distance[k] = d;
    }
};

} // namespace

LevelMap::LevelMap(Context& context, const Mesh& in, const Mesh& full, EdgeBits kept)
    : context_(context), in_(in), full_(full), kept_(kept), sheets_(context.memory(), in, kept & kEdgeGiven),
      first_(context.memory()), edges_(context.memory()), chart_(context.memory()) {}

Status LevelMap::begin() {
    DM_TRY(sheets_.begin(context_));
    DM_TRY(find_first_corners(context_, full_, first_));
    DM_TRY(edges_.begin(context_, full_));
    for (int32_t c = 0; c < full_.corners(); ++c) {
        if ((c & 0xfffff) == 0) DM_TRY(context_.progress(0));
        int32_t& first = first_[full_.corner_vert[c]];
        if (is_line(c) && !is_line(first)) first = c;
    }
    return find_charts(context_, full_, kept_ & kEdgeGiven, chart_);
}

int32_t LevelMap::source_corner(int32_t c) const {
    return corner_place(full_, c).corner[0];
}

// ---- One level --------------------------------------------------------------------------------------------------------------

class LevelMapping {
public:
    LevelMapping(const LevelMap& map, const LevelTraces& traces, Mesh& level)
        : map_(map), context_(map.context_), full_(map.full_), traces_(traces), level_(level), first_(map.context_.memory()),
          begin_(map.context_.memory()), members_(map.context_.memory()), line_(map.context_.memory()) {}

    Status run() {
        DM_TRY(find_first_corners(context_, level_, first_));
        list_members();
        DM_TRY(context_.progress(0.1));
        const int64_t blocks = block_count(level_.vertices(), kGrain);
        Array<int64_t> places(context_.memory(), blocks + 1, 0);
        DM_TRY(context_.parallel(level_.vertices(), kGrain, [&](int64_t block, int64_t begin, int64_t end) {
            for (int32_t v = static_cast<int32_t>(begin); v < end; ++v)
                if (takes_places(v)) places[block + 1] += sectors(v);
        }));
        for (int64_t b = 0; b < blocks; ++b) places[b + 1] += places[b];
        level_.corner_places.resize_uninitialized(places[blocks]);
        level_.corner_map.resize_uninitialized(level_.corners());
        line_.assign(level_.corners(), -1);
        DM_TRY(parallel_slices(context_, level_.vertices(), kGrain, 0.1, 0.9, [&](int64_t block, int64_t begin, int64_t end) {
            int64_t next = places[block];
            for (int32_t v = static_cast<int32_t>(begin); v < end; ++v)
                if (first_[v] >= 0) map_vertex(v, next);
        }));
        level_.edge_source.reserve(level_.counts.edges);
        for (int32_t c = 0; c < level_.corners(); ++c)
            if (is_first_of_edge(level_, c)) level_.edge_source.push_back(line_[c] < 0 ? -1 : source_edge(line_[c]));
        level_.has_map = true;
        return DELMESH_OK;
    }

private:
    bool is_border(int32_t c) const { return dm::is_border(level_, c, map_.kept_ & kEdgeGiven); }
    bool is_line(int32_t c) const { return dm::is_border(level_, c, map_.kept_); }
    int32_t chart(int32_t c) const { return map_.chart_[traces_.face[face_of(c)]]; } // of the level's corner
    int32_t chart_of_full(int32_t c) const { return map_.chart_[face_of(c)]; }
    int32_t source_edge(int32_t c) const {
        return source_of(full_.edge_source, map_.edges_.of(is_first_of_edge(full_, c) ? c : full_.corner_twin[c]));
    }

    int64_t sectors(int32_t v) const {
        int64_t borders = 0;
        for_corners_around(level_, first_[v], [&](int32_t c) { borders += is_border(c); });
        return borders > 0 ? borders : 1;
    }
    // All but those that are a vertex of the source: these have its corners.
    bool takes_places(int32_t v) const {
        if (first_[v] < 0) return false;
        const int32_t same = traces_.same[v];
        bool takes = same < 0;
        if (!takes) for_corners_around(full_, map_.first_[same], [&](int32_t c) { takes |= full_.corner_map[c] < 0; });
        return takes;
    }

    // Per vertex of the level, those that went into it.
    void list_members() {
        begin_.assign(level_.vertices() + 1, 0);
        for (const int32_t v : traces_.into)
            if (v >= 0) ++begin_[v + 1];
        for (int32_t v = 0; v < level_.vertices(); ++v) begin_[v + 1] += begin_[v];
        members_.resize_uninitialized(begin_[level_.vertices()]);
        Array<int32_t> next(context_.memory());
        next.copy_from(begin_);
        for (int32_t u = 0; u < full_.vertices(); ++u)
            if (traces_.into[u] >= 0) members_[next[traces_.into[u]]++] = u;
    }

    void map_vertex(int32_t v, int64_t& next) {
        int32_t start = -1;
        for_corners_around(level_, first_[v], [&](int32_t c) {
            if (start < 0 && is_border(c)) start = c;
        });
        if (start < 0) start = first_[v];
        const bool has_places = takes_places(v);
        const int32_t same = traces_.same[v];
        const Vec3 x = level_.position(v);
        int32_t own = -1; // the corner of full with which the sector begins at the vertex that this is
        for_corners_around(level_, start, [&](int32_t c) {
            if (is_line(c)) line_[c] = find_line(v, c);
            if (c == start || is_border(c)) {
                const int32_t border = is_border(c) ? line_[c] : -1;
                if (same >= 0) own = corner_on_way(border, v, same);
                if (has_places) {
                    const int32_t in_full = same >= 0 ? corner_of(same, own, c) : -1;
                    level_.corner_places[next++] = in_full >= 0 ? corner_place(full_, in_full) : closest(v, c, border, x);
                }
            }
            level_.corner_map[c] = has_places ? ~static_cast<int32_t>(next - 1) : full_.corner_map[corner_of(same, own, c)];
        });
    }

    // A corner of full whose edge is one of those that the level's line from c became, with the face on the same side. Lines merge
    // only where a chart of one triangle goes, so the chart tells which of them it is.
    int32_t find_line(int32_t v, int32_t c) const {
        const int32_t to = level_.corner_vert[next_corner(c)], wanted = chart(c);
        const bool border = is_border(c);
        int32_t found = -1;
        for (int32_t i = begin_[v]; i < begin_[v + 1] && found < 0; ++i) {
            const int32_t first = map_.first_[members_[i]];
            if (first < 0 || !map_.is_line(first)) continue;
            for_corners_around(full_, first, [&](int32_t k) {
                if (found >= 0 || chart_of_full(k) != wanted || !(border ? map_.is_border(k) : map_.is_line(k))) return;
                if (traces_.into[full_.corner_vert[next_corner(k)]] == to) found = k;
            });
        }
        return found;
    }

    // body(k) for the corners of full with which sectors begin, at the vertices that went into v, along the border's left side.
    template <class Body>
    void along(int32_t border, int32_t v, Body&& body) const {
        if (border < 0) return;
        int32_t k = border;
        do {
            body(k);
            while (!map_.is_border(prev_corner(k))) k = full_.corner_twin[prev_corner(k)];
            k = prev_corner(k);
        } while (k != border && traces_.into[full_.corner_vert[k]] == v);
    }
    int32_t corner_on_way(int32_t border, int32_t v, int32_t vert) const {
        int32_t found = -1;
        along(border, v, [&](int32_t k) {
            if (found < 0 && full_.corner_vert[k] == vert) found = k;
        });
        return found;
    }

    // Of full's corners at `vert` in the sector that begins with `begin` (< 0: in the chart of the level's corner c), the one that
    // looks where c does.
    int32_t corner_of(int32_t vert, int32_t begin, int32_t c) const {
        const Vec3 way = gaze(level_, c);
        const int32_t wanted = chart(c);
        int32_t best = begin >= 0 ? begin : map_.first_[vert];
        double most = -HUGE_VAL;
        bool inside = true;
        for_corners_around(full_, best, [&](int32_t k) {
            if (begin >= 0 ? !inside : chart_of_full(k) != wanted) return;
            const double looks = dot(gaze(full_, k), way);
            if (looks > most) most = looks, best = k;
            inside = !map_.is_border(prev_corner(k));
        });
        return best;
    }

    // The closest point to x in the sector that begins with c.
    CornerPlace closest(int32_t v, int32_t c, int32_t border, const Vec3& x) const {
        Starts starts;
        along(border, v, [&](int32_t k) {
            const double d = length_squared(full_.position(full_.corner_vert[k]) - x);
            if (starts.takes(d)) starts.add(k, d);
        });
        if (starts.count == 0) { // inside of a chart
            const int32_t wanted = chart(c);
            for (int32_t i = begin_[v]; i < begin_[v + 1]; ++i) {
                const int32_t first = map_.first_[members_[i]];
                const double d = length_squared(full_.position(members_[i]) - x);
                if (first < 0 || !starts.takes(d)) continue;
                int32_t found = -1;
                for_corners_around(full_, first, [&](int32_t k) {
                    if (found < 0 && chart_of_full(k) == wanted) found = k;
                });
                if (found >= 0) starts.add(found, d);
            }
        }
        Sheets::Place place;
        for (int i = 0; i < starts.count; ++i) map_.sheets_.look_around(x, map_.source_corner(starts.corner[i]), place);
        if (place.face >= 0) {
            map_.sheets_.descend(x, place.face, place);
            return place.corners();
        }
        const int32_t corner = map_.source_corner(3 * traces_.face[face_of(c)]); // all distances are out of range
        return {{corner, corner, corner}, {1, 0, 0}};
    }

    const LevelMap& map_;
    Context& context_;
    const Mesh& full_;
    const LevelTraces& traces_;
    Mesh& level_;
    Array<int32_t> first_;           // of the level
    Array<int32_t> begin_, members_; // see list_members
    Array<int32_t> line_;            // per corner of the level, see find_line
};

Status LevelMap::map(const LevelTraces& traces, Mesh& level) const {
    return LevelMapping(*this, traces, level).run();
}

} // namespace dm
