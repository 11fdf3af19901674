// SPDX-License-Identifier: Apache-2.0
#include "algo/surface_map.h"

#include <algorithm>
#include <climits>

#include "algo/parallel_slices.h"
#include "geom/closest_point.h"
#include "mesh/source_map.h"

namespace dm {
namespace {

constexpr int64_t kGrain = 1 << 12; // vertices
constexpr int kMostSteps = 64;      // of a way over the surface
constexpr int kMostFaces = 128;     // around a vertex: of a hub, a few will do

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

Status find_charts(Context& context, const Mesh& mesh, EdgeBits kept, Array<int32_t>& chart) {
    chart.assign(mesh.faces(), -1);
    Array<int32_t> open(context.memory());
    int32_t charts = 0, seen = 0;
    for (int32_t start = 0; start < mesh.faces(); ++start) {
        if (chart[start] >= 0) continue;
        chart[start] = charts;
        open.push_back(start);
        while (!open.empty()) {
            const int32_t f = open.pop_back();
            if ((++seen & 0xfffff) == 0) DM_TRY(context.progress(0));
            for (int32_t c = 3 * f; c < 3 * f + 3; ++c) {
                if (is_border(mesh, c, kept)) continue;
                const int32_t beside = face_of(mesh.corner_twin[c]);
                if (chart[beside] >= 0) continue;
                chart[beside] = charts;
                open.push_back(beside);
            }
        }
        ++charts;
    }
    return DELMESH_OK;
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
        k = next_around(in, k);
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
        : context_(context), in_(in), kept_(kept), traces_(traces), out_(out), sheets_(context.memory(), in, kept) {}

    Status run() {
        DM_TRY(sheets_.begin(context_));
        Array<int32_t> changed(context_.memory()); // faces
        DM_TRY(map_kept_faces(changed));
        if (!changed.empty()) DM_TRY(map_changed_faces(changed));
        if (traces_.merged && kept_ != 0) DM_TRY(come_back_to_charts(changed));
        DM_TRY(map_edges());
        out_.has_map = true;
        return DELMESH_OK;
    }

private:
    static constexpr int32_t kUnknown = INT32_MIN;

    // Most faces are the source's; their corners are too.
    Status map_kept_faces(Array<int32_t>& changed) {
        const int32_t faces = out_.faces();
        constexpr int64_t kFaces = 1 << 14;
        Array<int32_t> counts(context_.memory(), block_count(faces, kFaces), 0);
        out_.corner_map.resize_uninitialized(out_.corners());
        DM_TRY(context_.parallel(faces, kFaces, [&](int64_t block, int64_t begin, int64_t end) {
            const int32_t *const vert = out_.corner_vert.data(), *const source = in_.corner_vert.data();
            int32_t* const map = out_.corner_map.data();
            int32_t count = 0;
            for (int64_t f = begin; f < end; ++f) {
                const int32_t g = 3 * traces_.face.data()[f];
                bool same = true;
                for (int k = 0; k < 3; ++k) same &= vert[3 * f + k] == source[g + k] && source[g + k] < traces_.same;
                for (int k = 0; k < 3; ++k) map[3 * f + k] = same ? g + k : kUnknown;
                count += !same;
            }
            counts[block] = count;
        }));
        int64_t all = 0;
        for (const int32_t count : counts) all += count;
        changed.reserve(all);
        for (int64_t block = 0; block < counts.size(); ++block)
            for (int64_t f = block * kFaces; counts[block] != 0 && f < std::min<int64_t>(faces, (block + 1) * kFaces); ++f)
                if (out_.corner_map[3 * f] == kUnknown) changed.push_back(static_cast<int32_t>(f));
        return DELMESH_OK;
    }

    Status map_changed_faces(const Array<int32_t>& changed) {
        Memory& memory = context_.memory();
        Array<uint8_t> bordered(memory); // vertices with kept edges; empty: none
        if (std::any_of(out_.corner_bits.begin(), out_.corner_bits.end(), [&](EdgeBits bits) { return (bits & kept_) != 0; })) {
            bordered.assign(out_.vertices(), 0);
            for (int32_t c = 0; c < out_.corners(); ++c)
                if (is_kept(out_, c, kept_)) bordered[out_.corner_vert[c]] = bordered[out_.corner_vert[next_corner(c)]] = 1;
        }
        DM_TRY(context_.progress(0.2));
        // Around a source vertex without kept edges there is one sector, so that every corner can be looked at alone.
        DM_TRY(parallel_slices(context_, changed.size(), kGrain, 0.2, 0.3, [&](int64_t, int64_t begin, int64_t end) {
            for (int64_t i = begin; i < end; ++i)
                for (int32_t c = 3 * changed[i]; c < 3 * changed[i] + 3; ++c) {
                    const int32_t v = out_.corner_vert[c];
                    if (traces_.vert[v] >= 0 && (bordered.empty() || bordered[v] == 0))
                        out_.corner_map[c] = corner_nearby(c, traces_.vert[v]);
                }
        }));
        // Each other vertex once, with one of its corners.
        Array<int32_t> of_source(memory), of_lines(memory, traces_.line.size(), -1);
        for (const int32_t f : changed)
            for (int32_t c = 3 * f; c < 3 * f + 3; ++c) {
                const int32_t v = out_.corner_vert[c];
                if (traces_.vert[v] < 0)
                    of_lines[~traces_.vert[v]] = c;
                else if (!bordered.empty() && bordered[v] == 1) {
                    bordered[v] = 2;
                    of_source.push_back(c);
                }
            }
        DM_TRY(parallel_slices(context_, of_source.size(), kGrain, 0.3, 0.4, [&](int64_t, int64_t begin, int64_t end) {
            for (int64_t i = begin; i < end; ++i) map_source_vertex(of_source[i]);
        }));
        // A vertex that is none of the source's takes a place for each of its sectors.
        const int64_t blocks = block_count(of_lines.size(), kGrain);
        Array<int64_t> places(memory, blocks + 1, 0);
        DM_TRY(context_.parallel(of_lines.size(), kGrain, [&](int64_t block, int64_t begin, int64_t end) {
            for (int64_t i = begin; i < end; ++i)
                if (of_lines[i] >= 0) places[block + 1] += sectors(of_lines[i]);
        }));
        for (int64_t b = 0; b < blocks; ++b) places[b + 1] += places[b];
        out_.corner_places.resize_uninitialized(places[blocks]);
        return parallel_slices(context_, of_lines.size(), kGrain, 0.4, 0.8, [&](int64_t block, int64_t begin, int64_t end) {
            int64_t next = places[block];
            for (int64_t i = begin; i < end; ++i)
                if (of_lines[i] >= 0) map_other_vertex(of_lines[i], traces_.line[i], next);
        });
    }

    bool is_border(int32_t c) const { return dm::is_border(out_, c, kept_); }

    // A corner of the same vertex with which a sector begins, whose edge is a border: where there is a boundary, that of the fan.
    // Any, if there is none.
    int32_t sector_start(int32_t corner) const {
        int32_t start = corner, c = corner;
        do { // clockwise
            if (is_border(c)) start = c;
            if (out_.corner_twin[c] < 0) break;
            c = next_corner(out_.corner_twin[c]);
        } while (c != corner);
        return start;
    }
    int64_t sectors(int32_t corner) const {
        int64_t borders = 0;
        for_corners_around(out_, sector_start(corner), [&](int32_t c) { borders += is_border(c); });
        return borders > 0 ? borders : 1;
    }

    // ---- a vertex of the source

    // The source's corner of that vertex in the face that c's was, or -1 if that has none.
    int32_t own_corner(int32_t c, int32_t source) const {
        const int32_t face = traces_.face.data()[face_of(c)];
        for (int32_t k = 3 * face; k < 3 * face + 3; ++k)
            if (in_.corner_vert.data()[k] == source) return k;
        return -1;
    }
    // Or in a face beside it, or else anywhere.
    int32_t corner_nearby(int32_t c, int32_t source) const {
        const int32_t t = out_.corner_twin[c], r = next_around(out_, c);
        int32_t k = own_corner(c, source);
        if (k < 0 && t >= 0) k = own_corner(next_corner(t), source);
        if (k < 0 && r >= 0) k = own_corner(r, source);
        if (k < 0) k = sheets_.first[source];
        return k >= 0 ? k : 3 * traces_.face[face_of(c)] + c % 3; // a repair took all of its faces away
    }

    // With kept edges, sector by sector.
    void map_source_vertex(int32_t corner) {
        const int32_t source = traces_.vert[out_.corner_vert[corner]];
        const bool any = sheets_.first[source] >= 0;
        int32_t from = -1; // of the source's sector, its first corner
        int32_t last = -1; // the source's corner of the face before, in the sector
        for_corners_around(out_, sector_start(corner), [&](int32_t c) {
            if (any && (from < 0 || is_border(c))) from = sector_of(c, source), last = -1;
            if (out_.corner_map[c] == kUnknown)
                out_.corner_map[c] = any ? corner_in_sector(c, source, from, last) : corner_nearby(c, source);
            last = out_.corner_map[c];
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

    // Where the face is still there, or one in its place, its own; else that of the face before; else the one that looks the same way.
    int32_t corner_in_sector(int32_t c, int32_t source, int32_t from, int32_t last) const {
        const int32_t own = own_corner(c, source);
        if (own < 0 && last >= 0) return last;
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
            k = next_around(in_, k);
            if (k == from || --left == 0) break;
        }
        return best;
    }

    // ---- one that was added

    void map_other_vertex(int32_t corner, const VertexTraces::Line& line, int64_t& next) {
        const Vec3 x = out_.position(out_.corner_vert[corner]);
        const int32_t edge = line.a < 0 ? -1 : sheets_.find_edge(line.a, line.b);
        int64_t place = -1;
        const int32_t start = sector_start(corner);
        for_corners_around(out_, start, [&](int32_t c) {
            if (place < 0 || is_border(c)) {
                place = next++;
                out_.corner_places[place] = edge < 0 ? closest(c, x) : on_edge(edge, line, on_left(c, line));
            }
            out_.corner_map[c] = ~static_cast<int32_t>(place);
        });
    }

    // Does the sector that begins with the corner c lie to the left of the line from a to b? Its first edge then runs along the line, or,
    // where the line is no border, it does not matter. (A boundary has one side.)
    bool on_left(int32_t c, const VertexTraces::Line& line) const {
        const int32_t end = traces_.vert[out_.corner_vert[next_corner(c)]];
        if (end >= 0) return end == line.b;
        const VertexTraces::Line& other = traces_.line[~end];
        const double here = line.t, there = other.a == line.a ? other.t : 1 - other.t;
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
            c = next_around(out_, c);
        } while (c != start);
        if (place.face < 0) return {{3 * last, 3 * last, 3 * last}, {1, 0, 0}}; // a NaN far away
        return place.corners();
    }

    // ---- where vertices were merged

    // A corner that was given a place in another chart than its face comes from goes to the closest place in that.
    Status come_back_to_charts(const Array<int32_t>& changed) {
        Array<int32_t> chart(context_.memory());
        DM_TRY(find_charts(context_, in_, kept_, chart));
        const auto wanted = [&](int32_t c) { return chart[traces_.face[face_of(c)]]; };
        const auto is_away = [&](int32_t c) { return chart[face_of(corner_place(out_, c).corner[0])] != wanted(c); };
        for (int64_t i = 0; i < changed.size(); ++i) {
            if ((i & 0xffff) == 0) DM_TRY(context_.progress(0.8));
            for (int32_t c = 3 * changed[i]; c < 3 * changed[i] + 3; ++c) {
                if (!is_away(c)) continue;
                Sheets::Place place;
                sheets_.descend(out_.position(out_.corner_vert[c]), traces_.face[changed[i]], place);
                if (place.face < 0) continue; // a NaN far away
                const int32_t chart_of_all = wanted(c);
                const auto map = ~static_cast<int32_t>(out_.corner_places.size());
                out_.corner_places.push_back(place.corners());
                int32_t first = c; // all of the sector at once, so that they agree
                while (!is_border(first) && (first = next_corner(out_.corner_twin[first])) != c) {}
                int32_t k = first;
                do {
                    if (wanted(k) == chart_of_all && is_away(k)) out_.corner_map[k] = map;
                    if (is_border(prev_corner(k))) break;
                    k = next_around(out_, k);
                } while (k != first);
            }
        }
        return DELMESH_OK;
    }

    // ---- edges

    // body(c, e) for the first corners of all edges, in parallel: e is the edge's number.
    template <class Body>
    Status for_edges(const Mesh& mesh, Body&& body) {
        constexpr int64_t kCorners = 3 << 14;
        Array<int32_t> edges(context_.memory(), block_count(mesh.corners(), kCorners) + 1, 0);
        DM_TRY(context_.parallel(mesh.corners(), kCorners, [&](int64_t block, int64_t begin, int64_t end) {
            int32_t count = 0;
            for (int32_t c = static_cast<int32_t>(begin); c < end; ++c) count += is_first_of_edge(mesh, c);
            edges[block + 1] = count;
        }));
        for (int64_t b = 1; b < edges.size(); ++b) edges[b] += edges[b - 1];
        return context_.parallel(mesh.corners(), kCorners, [&](int64_t block, int64_t begin, int64_t end) {
            // First found without a branch, then looked at.
            constexpr int32_t kBatch = 256;
            int32_t found[kBatch], edge = edges[block];
            for (int32_t from = static_cast<int32_t>(begin); from < end; from += kBatch) {
                const int32_t to = std::min(from + kBatch, static_cast<int32_t>(end));
                int32_t count = 0;
                for (int32_t c = from; c < to; ++c) {
                    found[count] = c;
                    count += is_first_of_edge(mesh, c);
                }
                for (int32_t i = 0; i < count; ++i) body(found[i], edge++);
            }
        });
    }

    Status map_edges() {
        Array<int32_t> number(context_.memory(), in_.corners()); // of the source's edges, at their first corners
        DM_TRY(for_edges(in_, [&](int32_t c, int32_t edge) { number.data()[c] = edge; }));
        DM_TRY(context_.progress(0.85));
        out_.edge_source.resize_uninitialized(out_.counts.edges);
        return for_edges(out_, [&](int32_t c, int32_t edge) {
            int32_t source = (out_.corner_bits.data()[c] & kEdgeSource) != 0 ? source_edge(c) : -1;
            if (source >= 0 && in_.corner_twin.data()[source] >= 0) source = std::min(source, in_.corner_twin.data()[source]);
            out_.edge_source.data()[edge] = source < 0 ? -1 : number.data()[source];
        });
    }

    // The source's corner of the edge that c's is a piece of.
    int32_t source_edge(int32_t c) const {
        const int32_t p = traces_.vert[out_.corner_vert[c]], q = traces_.vert[out_.corner_vert[next_corner(c)]];
        if (p >= 0 && q >= 0) {
            const int32_t k = out_.corner_map.data()[c]; // mostly the face is still there
            if (k >= 0 && in_.corner_vert.data()[next_corner(k)] == q) return k;
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
};

} // namespace

Status map_corners(Context& context, const Mesh& in, EdgeBits kept, const VertexTraces& traces, Mesh& out) {
    return Mapping(context, in, kept, traces, out).run();
}

Status name_places(Context& context, const Mesh& in, Mesh& out) {
    set_source_counts(in, out);
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
