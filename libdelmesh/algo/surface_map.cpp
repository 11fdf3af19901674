// SPDX-License-Identifier: Apache-2.0
#include "algo/surface_map.h"

#include "algo/parallel_slices.h"
#include "geom/closest_point.h"

namespace dm {
namespace {

constexpr int64_t kGrain = 1 << 12; // vertices
constexpr int kMostSteps = 64;      // of a way over the surface
constexpr int kMostFaces = 128;     // around a vertex: of a hub, a few will do

// The next corner counter-clockwise around the vertex of c; < 0 past the boundary.
int32_t rotate(const Mesh& mesh, int32_t c) {
    return mesh.corner_twin[prev_corner(c)];
}

Vec3 direction(const Vec3& way) {
    const double l = length(way);
    return l > 0 ? (1 / l) * way : way;
}

bool is_kept(const Mesh& mesh, int32_t c, EdgeBits kept) {
    return !mesh.corner_bits.empty() && (mesh.corner_bits[c] & kept) != 0;
}

} // namespace

Status find_first_corners(Context& context, const Mesh& mesh, Array<int32_t>& first) {
    first.assign(mesh.vertices(), -1);
    constexpr int32_t kPiece = 1 << 18;
    for (int32_t begin = 0; begin < mesh.corners(); begin += kPiece) {
        DM_TRY(context.progress(0));
        for (int32_t c = begin; c < std::min(mesh.corners(), begin + kPiece); ++c) {
            int32_t& place = first[mesh.corner_vert[c]];
            if (place < 0 || mesh.corner_twin[c] < 0) place = c;
        }
    }
    return DELMESH_OK;
}

Vec3 gaze(const Mesh& mesh, int32_t c) {
    const Vec3 x = mesh.position(mesh.corner_vert[c]);
    return direction(direction(mesh.position(mesh.corner_vert[next_corner(c)]) - x) +
                     direction(mesh.position(mesh.corner_vert[prev_corner(c)]) - x));
}

// ---- Ways over the source ---------------------------------------------------------------------------------------------------

int32_t Sheets::find_edge(int32_t a, int32_t b) const {
    const int32_t start = first[a];
    if (start < 0) return -1;
    int32_t c = start;
    do {
        if (in.corner_vert[next_corner(c)] == b) return c;
        const int32_t last = prev_corner(c);
        if (in.corner_twin[last] < 0 && in.corner_vert[last] == b) return last;
        c = in.corner_twin[last];
    } while (c >= 0 && c != start);
    return -1;
}

void Sheets::look_around(const Vec3& x, int32_t c, Place& place) const {
    const auto look = [&](int32_t k) {
        const int32_t f = face_of(k);
        const ClosestPoint point =
            closest_on_triangle(x, in.position(in.corner_vert[3 * f]), in.position(in.corner_vert[3 * f + 1]),
                                in.position(in.corner_vert[3 * f + 2]));
        const double d = length_squared(point.residual);
        if (!(d < place.distance_squared)) return;
        place = {d, f, {point.weight[0], point.weight[1], point.weight[2]}};
    };
    int left = kMostFaces;
    int32_t k = c;
    do { // counter-clockwise
        look(k);
        if (is_border(prev_corner(k))) break;
        k = rotate(in, k);
    } while (k != c && --left > 0);
    if (k == c && left < kMostFaces && !is_border(prev_corner(c))) return; // all the way round
    for (k = c; !is_border(k) && --left > 0;) {
        k = next_corner(in.corner_twin[k]);
        if (k == c) return;
        look(k);
    }
}

void Sheets::descend(const Vec3& x, int32_t face, Place& place) const {
    Place here;
    here.face = face;
    for (int step = 0, last = -1; step < kMostSteps && here.face != last; ++step) {
        last = here.face;
        for (int32_t c = 3 * last; c < 3 * last + 3; ++c) look_around(x, c, here);
    }
    if (here.distance_squared < place.distance_squared) place = here;
}

// ---- The map ----------------------------------------------------------------------------------------------------------------

namespace {

class Mapping {
public:
    Mapping(Context& context, const Mesh& in, EdgeBits kept, const VertexTraces& traces, Mesh& out)
        : context_(context), in_(in), kept_(kept), traces_(traces), out_(out), sheets_(context.memory(), in, kept),
          first_(context.memory()) {}

    Status run() {
        DM_TRY(sheets_.begin(context_));
        DM_TRY(find_first_corners(context_, out_, first_));
        // A vertex that is none of the source's takes a place for each of its sectors.
        const int64_t blocks = block_count(out_.vertices(), kGrain);
        Array<int64_t> places(context_.memory(), blocks + 1, 0);
        DM_TRY(context_.parallel(out_.vertices(), kGrain, [&](int64_t block, int64_t begin, int64_t end) {
            for (int32_t v = static_cast<int32_t>(begin); v < end; ++v)
                if (first_[v] >= 0 && traces_.vert[v] < 0) places[block + 1] += sectors(v);
        }));
        for (int64_t b = 0; b < blocks; ++b) places[b + 1] += places[b];
        out_.corner_places.resize_uninitialized(places[blocks]);
        out_.corner_map.resize_uninitialized(out_.corners());
        DM_TRY(parallel_slices(context_, out_.vertices(), kGrain, 0.2, 0.8, [&](int64_t block, int64_t begin, int64_t end) {
            int64_t next = places[block];
            for (int32_t v = static_cast<int32_t>(begin); v < end; ++v) {
                if (first_[v] < 0) continue;
                if (traces_.vert[v] >= 0)
                    map_source_vertex(v, traces_.vert[v]);
                else
                    map_other_vertex(v, traces_.line[~traces_.vert[v]], next);
            }
        }));
        DM_TRY(map_edges());
        out_.has_map = true;
        return DELMESH_OK;
    }

private:
    bool is_border(int32_t c) const { return out_.corner_twin[c] < 0 || is_kept(out_, c, kept_); }

    // body(c) for the corners around v, counter-clockwise from `start`; the boundary ends it.
    template <class Body>
    void around(int32_t start, Body&& body) const {
        int32_t c = start;
        do {
            body(c);
            c = rotate(out_, c);
        } while (c >= 0 && c != start);
    }
    // A corner with which a sector begins: whose edge is a border. Any, if there is none.
    int32_t sector_start(int32_t v) const {
        int32_t start = -1;
        around(first_[v], [&](int32_t c) {
            if (start < 0 && is_border(c)) start = c;
        });
        return start < 0 ? first_[v] : start;
    }
    int64_t sectors(int32_t v) const {
        int64_t borders = 0;
        around(first_[v], [&](int32_t c) { borders += is_border(c); });
        return borders > 0 ? borders : 1;
    }

    // ---- a vertex of the source

    void map_source_vertex(int32_t v, int32_t source) {
        if (sheets_.first[source] < 0) return map_anyhow(v, source);
        int32_t from = -1; // of the source's sector, its first corner
        around(sector_start(v), [&](int32_t c) {
            if (from < 0 || is_border(c)) from = sector_of(c, source);
            out_.corner_map[c] = corner_in_sector(c, source, from);
        });
    }

    // The source's corner with which the sector begins that begins with the result's corner c.
    int32_t sector_of(int32_t c, int32_t source) const {
        if (!is_kept(out_, c, kept_)) return sheets_.first[source]; // the boundary, or one sector that has no beginning
        const int32_t end = traces_.vert[out_.corner_vert[next_corner(c)]];
        int32_t to = end;
        if (end < 0) {
            const VertexTraces::Line& line = traces_.line[~end];
            to = line.a == source ? line.b : line.a;
        }
        const int32_t found = to < 0 ? -1 : sheets_.find_edge(source, to);
        return found >= 0 && in_.corner_vert[found] == source ? found : sheets_.first[source];
    }

    int32_t corner_in_sector(int32_t c, int32_t source, int32_t from) const {
        const int32_t face = traces_.face[face_of(c)];
        int32_t own = -1; // where the face is still there, or one in its place
        for (int32_t k = 3 * face; k < 3 * face + 3; ++k)
            if (in_.corner_vert[k] == source) own = k;
        int32_t best = from;
        double most = -HUGE_VAL;
        const Vec3 way = own < 0 ? gaze(out_, c) : Vec3{0, 0, 0};
        for (int32_t k = from, left = kMostFaces;;) {
            if (k == own) return own;
            if (own < 0) {
                const double along = dot(gaze(in_, k), way);
                if (along > most) most = along, best = k;
            }
            if (sheets_.is_border(prev_corner(k))) break;
            k = rotate(in_, k);
            if (k == from || --left == 0) break;
        }
        return best;
    }

    // No face is left there: a repair took them away.
    void map_anyhow(int32_t v, int32_t) {
        around(first_[v], [&](int32_t c) { out_.corner_map[c] = 3 * traces_.face[face_of(c)] + c % 3; });
    }

    // ---- one that was added

    void map_other_vertex(int32_t v, const VertexTraces::Line& line, int64_t& next) {
        const Vec3 x = out_.position(v);
        const int32_t edge = line.a < 0 ? -1 : sheets_.find_edge(line.a, line.b);
        int64_t place = -1;
        const int32_t start = sector_start(v);
        around(start, [&](int32_t c) {
            if (place < 0 || is_border(c)) {
                place = next++;
                out_.corner_places[place] = edge < 0 ? closest(c, x) : on_edge(edge, line, on_left(c, v, line));
            }
            out_.corner_map[c] = ~static_cast<int32_t>(place);
        });
    }

    // Does the sector that begins with the corner c lie to the left of the line from a to b? Its first edge then runs along the line, or,
    // where the line is no border, it does not matter. (A boundary has one side.)
    bool on_left(int32_t c, int32_t v, const VertexTraces::Line& line) const {
        const int32_t end = traces_.vert[out_.corner_vert[next_corner(c)]];
        if (end >= 0) return end == line.b;
        const VertexTraces::Line& other = traces_.line[~end];
        const double here = line.t, there = other.a == line.a ? other.t : 1 - other.t;
        static_cast<void>(v);
        return there > here;
    }

    CornerPlace on_edge(int32_t edge, const VertexTraces::Line& line, bool left) const {
        const bool runs_along = in_.corner_vert[edge] == line.a;
        const int32_t twin = in_.corner_twin[edge];
        const bool same_face = left == runs_along || twin < 0;
        const int32_t c = same_face ? edge : twin; // the corner whose face is on that side
        const bool from_a = in_.corner_vert[c] == line.a;
        const double at_a = 1 - line.t, at_b = line.t;
        return {{c, next_corner(c), prev_corner(c)}, {from_a ? at_a : at_b, from_a ? at_b : at_a, 0}};
    }

    CornerPlace closest(int32_t start, const Vec3& x) const {
        Sheets::Place place;
        int32_t c = start, last = -1;
        do {
            const int32_t face = traces_.face[face_of(c)];
            if (face != last) sheets_.descend(x, face, place);
            last = face;
            if (is_border(prev_corner(c))) break;
            c = rotate(out_, c);
        } while (c != start);
        if (place.face < 0) return {{3 * last, 3 * last, 3 * last}, {1, 0, 0}}; // a NaN far away
        return place.corners();
    }

    // ---- edges

    Status map_edges() {
        Array<int32_t> number(context_.memory(), in_.corners()); // of the source's edges
        const auto is_first = [](const Mesh& mesh, int32_t c) { return mesh.corner_twin[c] < 0 || c < mesh.corner_twin[c]; };
        int32_t edges = 0;
        for (int32_t c = 0; c < in_.corners(); ++c) number[c] = is_first(in_, c) ? edges++ : number[in_.corner_twin[c]];
        DM_TRY(context_.progress(0.85));
        Array<int32_t>& source = out_.edge_source;
        source.reserve((out_.corners() + 1) / 2);
        constexpr int32_t kPiece = 1 << 16;
        for (int32_t begin = 0; begin < out_.corners(); begin += kPiece) {
            DM_TRY(context_.progress(0.85 + 0.15 * begin / out_.corners()));
            for (int32_t c = begin; c < std::min(out_.corners(), begin + kPiece); ++c) {
                if (!is_first(out_, c)) continue;
                const int32_t edge = (out_.corner_bits[c] & kEdgeSource) != 0 ? source_edge(c) : -1;
                source.push_back(edge < 0 ? -1 : number[edge]);
            }
        }
        return DELMESH_OK;
    }

    // The source's corner of the edge that c's is a piece of.
    int32_t source_edge(int32_t c) const {
        const int32_t p = traces_.vert[out_.corner_vert[c]], q = traces_.vert[out_.corner_vert[next_corner(c)]];
        if (p >= 0 && q >= 0) {
            // Mostly the face is still there.
            const int32_t face = traces_.face[face_of(c)];
            for (int32_t k = 3 * face; k < 3 * face + 3; ++k)
                if (in_.corner_vert[k] == p && in_.corner_vert[next_corner(k)] == q) return k;
            return sheets_.find_edge(p, q);
        }
        const VertexTraces::Line& line = traces_.line[p < 0 ? ~p : ~q];
        return line.a < 0 ? -1 : sheets_.find_edge(line.a, line.b);
    }

    Context& context_;
    const Mesh& in_;
    const EdgeBits kept_;
    const VertexTraces& traces_;
    Mesh& out_;
    Sheets sheets_;
    Array<int32_t> first_; // of the result
};

} // namespace

Status map_corners(Context& context, const Mesh& in, EdgeBits kept, const VertexTraces& traces, Mesh& out) {
    return Mapping(context, in, kept, traces, out).run();
}

Status name_places(Context& context, const Mesh& in, Mesh& out) {
    out.source_verts = in.imported ? in.source_verts : in.vertices();
    out.source_corners = in.imported ? in.source_corners : in.corners();
    out.source_faces = in.imported ? in.source_faces : in.faces();
    out.source_edges = in.imported ? in.source_edges : in.counts.edges;
    if (!out.has_map || !in.imported) return DELMESH_OK;
    constexpr int64_t kMany = 1 << 16;
    if (!in.corner_map.empty()) {
        DM_TRY(context.parallel(out.corner_map.size(), kMany, [&](int64_t, int64_t begin, int64_t end) {
            for (int64_t c = begin; c < end; ++c)
                if (out.corner_map[c] >= 0) out.corner_map[c] = in.corner_map[out.corner_map[c]];
        }));
        DM_TRY(context.parallel(out.corner_places.size(), kMany, [&](int64_t, int64_t begin, int64_t end) {
            for (int64_t i = begin; i < end; ++i)
                for (int32_t& corner : out.corner_places[i].corner) corner = in.corner_map[corner];
        }));
    }
    if (in.edge_source.empty()) return DELMESH_OK;
    return context.parallel(out.edge_source.size(), kMany, [&](int64_t, int64_t begin, int64_t end) {
        for (int64_t e = begin; e < end; ++e)
            if (out.edge_source[e] >= 0) out.edge_source[e] = in.edge_source[out.edge_source[e]];
    });
}

} // namespace dm
