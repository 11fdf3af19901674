// SPDX-License-Identifier: Apache-2.0
#include "algo/surface_map.h"

#include <algorithm>
#include <climits>
#include <utility>

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

Status EdgeNumbers::begin(Context& context, const Mesh& mesh) {
    const int64_t faces = mesh.faces(), groups = block_count(faces, kGroup);
    before_.assign(groups + 1, 0);
    of_face_.resize_uninitialized(faces);
    DM_TRY(context.parallel(faces, kGroup, [&](int64_t group, int64_t begin, int64_t end) {
        const int32_t* const twin = mesh.corner_twin.data();
        uint16_t* const of_face = of_face_.data();
        int32_t edges = 0;
        for (int32_t f = static_cast<int32_t>(begin), c = 3 * f; f < end; ++f, c += 3) {
            const int32_t a = is_first(twin, c), b = is_first(twin, c + 1), d = is_first(twin, c + 2);
            of_face[f] = static_cast<uint16_t>(edges << 3 | d << 2 | b << 1 | a);
            edges += a + b + d;
        }
        before_[group + 1] = edges;
    }));
    for (int64_t group = 0; group < groups; ++group) before_[group + 1] += before_[group];
    return DELMESH_OK;
}

namespace {

class Mapping {
public:
    Mapping(Context& context, const Mesh& in, EdgeBits kept, VertexTraces&& traces, Mesh& out)
        : context_(context), in_(in), kept_(kept), traces_(traces), out_(out), sheets_(in, kept, std::move(traces.first)),
          source_edges_(context.memory()), may_have_borders_(kept != 0 && (traces.merged || !in.corner_bits.empty())) {}

    Status run() {
        DM_TRY(source_edges_.begin(context_, in_));
        Array<int32_t> left(context_.memory()); // faces
        DM_TRY(map_most_faces(left));
        if (!left.empty()) DM_TRY(map_left_faces(left));
        if (traces_.merged && kept_ != 0) DM_TRY(come_back_to_charts(left));
        out_.has_map = true;
        return DELMESH_OK;
    }

private:
    static constexpr int32_t kUnknown = INT32_MIN;
    static constexpr int32_t kFaces = 1 << 13, kBatch = 256; // of map_most_faces, each

    // Most faces are the source's; their corners are too, and their edges, but for those that were flipped away and back. All edges
    // are mapped here, and what can be of the other faces: `left` are those that are not done.
    Status map_most_faces(Array<int32_t>& left) {
        const int32_t faces = out_.faces();
        struct Block {
            int32_t edges, left;
        };
        Array<Block> blocks(context_.memory(), block_count(faces, kFaces), Block{0, 0});
        DM_TRY(context_.parallel(faces, kFaces, [&](int64_t block, int64_t begin, int64_t end) {
            const int32_t* const twin = out_.corner_twin.data();
            int32_t edges = 0;
            for (int32_t c = static_cast<int32_t>(3 * begin); c < 3 * end; ++c) edges += is_first(twin, c) ? 1 : 0;
            blocks[block].edges = edges;
        }));
        int32_t edges = 0;
        for (Block& block : blocks) edges += std::exchange(block.edges, edges);
        out_.corner_map.resize_uninitialized(out_.corners());
        out_.edge_source.resize_uninitialized(edges);
        DM_TRY(context_.progress(0.1));
        DM_TRY(context_.parallel(faces, kFaces, [&](int64_t block, int64_t begin, int64_t end) {
            int32_t* edge = out_.edge_source.data() + blocks[block].edges;
            for (int64_t from = begin; from < end; from += kBatch)
                blocks[block].left +=
                    map_batch(static_cast<int32_t>(from), static_cast<int32_t>(std::min(end, from + kBatch)), edge);
        }));
        int64_t all = 0;
        for (const Block& block : blocks) all += block.left;
        left.reserve(all);
        const int32_t* const map = out_.corner_map.data();
        for (int64_t block = 0; block < blocks.size(); ++block)
            for (int64_t f = block * kFaces; blocks[block].left != 0 && f < std::min<int64_t>(faces, (block + 1) * kFaces); ++f)
                if (std::find(map + 3 * f, map + 3 * f + 3, kUnknown) != map + 3 * f + 3) left.push_back(static_cast<int32_t>(f));
        return DELMESH_OK;
    }

    // Which faces changed, and which corners are the first of their edges, no one can predict: what is like the source is done
    // without a branch, and then the rest. edge: where the next edge's source goes. Returns how many faces are left.
    int32_t map_batch(int32_t begin, int32_t end, int32_t*& edge) {
        const int32_t *const vert = out_.corner_vert.data(), *const twin = out_.corner_twin.data(), same_verts = traces_.same;
        const int32_t *const source = in_.corner_vert.data(), *const face = traces_.face.data();
        const EdgeBits* const bits = out_.corner_bits.data();
        int32_t* const map = out_.corner_map.data();
        struct Other {
            int32_t face, place, unknown; // its first edge's place, and a bit for each edge that is not known
        } others[kBatch + 1];
        int32_t edges[3 * kBatch + 3], found = 0, other = 0;
        for (int32_t f = begin; f < end; ++f) {
            const int32_t c = 3 * f, g = 3 * face[f], p = source[g], q = source[g + 1], r = source[g + 2];
            const bool same =
                (vert[c] == p) & (vert[c + 1] == q) & (vert[c + 2] == r) & (std::max(std::max(p, q), r) < same_verts);
            const int32_t mask = -static_cast<int32_t>(same);
            map[c] = (g & mask) | (kUnknown & ~mask);
            map[c + 1] = ((g + 1) & mask) | (kUnknown & ~mask);
            map[c + 2] = ((g + 2) & mask) | (kUnknown & ~mask);
            const int32_t first[3] = {is_first(twin, c), is_first(twin, c + 1), is_first(twin, c + 2)};
            int32_t number[3];
            const int32_t whole = has_source(bits[c]) | has_source(bits[c + 1]) << 1 | has_source(bits[c + 2]) << 2;
            const int32_t unknown =
                (first[0] | first[1] << 1 | first[2] << 2) & ~(source_edges_.of(face[f], number) & whole & mask);
            others[other] = {f, found, unknown};
            other += static_cast<int32_t>(unknown != 0) | (1 + mask);
            for (int k = 0; k < 3; ++k) {
                edges[found] = number[k];
                found += first[k];
            }
        }
        // What is beyond their edges may be far away: it is asked for in two steps before it is needed.
        for (int32_t i = 0; i < other; ++i)
            for (int32_t c = 3 * others[i].face; c < 3 * others[i].face + 3; ++c) {
                __builtin_prefetch(face + face_of(std::max(twin[c], 0)));
                __builtin_prefetch(in_.corner_twin.data() + 3 * face[others[i].face]);
            }
        for (int32_t i = 0; i < other; ++i)
            for (int32_t c = 3 * others[i].face; c < 3 * others[i].face + 3; ++c) {
                const int32_t beyond = 3 * face[face_of(std::max(twin[c], 0))];
                __builtin_prefetch(source + beyond);
                __builtin_prefetch(in_.corner_twin.data() + beyond);
            }
        int32_t left = 0;
        for (int32_t i = 0; i < other; ++i)
            left += map_other_face(others[i].face, others[i].unknown, edges + others[i].place) ? 1 : 0;
        edge = std::copy_n(edges, found, edge);
        return left;
    }

    // A face that changed, or with edges whose first corners are not the source's: a bit of `unknown` each. edges: the sources of
    // those that have their first corners in the face. Tells whether corners are left.
    bool map_other_face(int32_t f, int32_t unknown, int32_t* edges) {
        const int32_t g = 3 * traces_.face.data()[f], *const source = in_.corner_vert.data() + g;
        int32_t own[3], traces[3]; // own: which corner of that face has the same vertex, or -1
        for (int k = 0; k < 3; ++k) {
            const int32_t x = traces_.of(out_.corner_vert.data()[3 * f + k]);
            traces[k] = x;
            own[k] = place_of(x, source);
        }
        int32_t* const map = out_.corner_map.data() + 3 * static_cast<int64_t>(f);
        bool left = false;
        if (map[0] == kUnknown)
            for (int k = 0; k < 3; ++k) {
                if (!may_have_borders_ && traces[k] >= 0)
                    map[k] = own[k] >= 0 ? g + own[k] : corner_beside(3 * f + k, traces[k]);
                else
                    left = true;
            }
        for (int k = 0; k < 3; ++k) {
            const int32_t c = 3 * f + k, next = k == 2 ? 0 : k + 1;
            if ((unknown >> k & 1) != 0) {
                const bool is_own = own[k] >= 0 && own[next] == (own[k] == 2 ? 0 : own[k] + 1);
                *edges = has_source(out_.corner_bits.data()[c]) == 0 ? -1 : source_number(is_own ? g + own[k] : source_edge(c));
            }
            edges += is_first(out_.corner_twin.data(), c);
        }
        return left;
    }

    static int32_t is_first(const int32_t* twin, int32_t c) { return EdgeNumbers::is_first(twin, c) ? 1 : 0; }
    static int32_t has_source(EdgeBits bits) { return (bits & kEdgeSource) != 0 ? 1 : 0; }

    Status map_left_faces(const Array<int32_t>& left) {
        Memory& memory = context_.memory();
        Array<uint8_t> bordered(memory); // vertices with kept edges; empty: none
        if (may_have_borders_) {
            bordered.assign(out_.vertices(), 0);
            for (int32_t c = 0; c < out_.corners(); ++c)
                if (is_kept(out_, c, kept_)) bordered[out_.corner_vert[c]] = bordered[out_.corner_vert[next_corner(c)]] = 1;
        }
        DM_TRY(context_.progress(0.2));
        // Around a source vertex without kept edges there is one sector, so that every corner can be looked at alone.
        DM_TRY(parallel_slices(context_, bordered.empty() ? 0 : left.size(), kGrain, 0.2, 0.3,
                               [&](int64_t, int64_t begin, int64_t end) {
                                   for (int64_t i = begin; i < end; ++i)
                                       for (int32_t c = 3 * left[i]; c < 3 * left[i] + 3; ++c) {
                                           const int32_t v = out_.corner_vert[c];
                                           if (traces_.of(v) >= 0 && bordered[v] == 0)
                                               out_.corner_map[c] = corner_nearby(c, traces_.of(v));
                                       }
                               }));
        // Each other vertex once, with one of its corners.
        Array<int32_t> of_source(memory), of_lines(memory, traces_.line.size(), -1);
        for (const int32_t f : left)
            for (int32_t c = 3 * f; c < 3 * f + 3; ++c) {
                const int32_t v = out_.corner_vert[c];
                if (traces_.of(v) < 0)
                    of_lines[~traces_.of(v)] = c;
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

    // Which of three vertices that is, or -1.
    static int32_t place_of(int32_t v, const int32_t* verts) {
        const int32_t first = v == verts[0], second = v == verts[1], third = v == verts[2];
        return second + 2 * third - (1 - (first | second | third));
    }
    // The source's corner of that vertex in the face that c's was, or -1 if that has none.
    int32_t own_corner(int32_t c, int32_t source) const {
        const int32_t first = 3 * traces_.face.data()[face_of(c)], place = place_of(source, in_.corner_vert.data() + first);
        return place < 0 ? -1 : first + place;
    }
    int32_t corner_nearby(int32_t c, int32_t source) const {
        const int32_t k = own_corner(c, source);
        return k >= 0 ? k : corner_beside(c, source);
    }
    // In a face beside it, or else anywhere.
    int32_t corner_beside(int32_t c, int32_t source) const {
        const int32_t t = out_.corner_twin[c], r = next_around(out_, c);
        int32_t k = t >= 0 ? own_corner(next_corner(t), source) : -1;
        if (k < 0 && r >= 0) k = own_corner(r, source);
        if (k < 0) k = sheets_.first[source];
        return k >= 0 ? k : 3 * traces_.face[face_of(c)] + c % 3; // a repair took all of its faces away
    }

    // With kept edges, sector by sector.
    void map_source_vertex(int32_t corner) {
        const int32_t source = traces_.of(out_.corner_vert[corner]);
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
        const int32_t end = traces_.of(out_.corner_vert[next_corner(c)]);
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
        const int32_t end = traces_.of(out_.corner_vert[next_corner(c)]);
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

    // Of a corner of the source, or -1: the number of its edge.
    int32_t source_number(int32_t c) const {
        if (c < 0) return -1;
        const uint32_t corner = static_cast<uint32_t>(c), twin = static_cast<uint32_t>(in_.corner_twin.data()[c]); // < 0 is large
        return source_edges_.of(static_cast<int32_t>(std::min(corner, twin)));
    }

    // The source's corner of the edge that c's is a piece of, if the face that c's was does not have it.
    int32_t source_edge(int32_t c) const {
        const int32_t p = traces_.of(out_.corner_vert.data()[c]), q = traces_.of(out_.corner_vert.data()[next_corner(c)]);
        if (p >= 0 && q >= 0) {
            const int32_t t = out_.corner_twin.data()[c], k = t >= 0 ? own_corner(t, q) : -1; // mostly the face beyond has
            return k >= 0 && in_.corner_vert.data()[next_corner(k)] == p ? k : sheets_.find_edge(p, q);
        }
        const VertexTraces::Line& line = traces_.line[p < 0 ? ~p : ~q];
        return line.a < 0 ? -1 : sheets_.find_edge(line.a, line.b);
    }

    Context& context_;
    const Mesh& in_;
    const EdgeBits kept_;
    const VertexTraces& traces_;
    Mesh& out_;
    const Sheets sheets_;
    EdgeNumbers source_edges_;
    const bool may_have_borders_; // inside of the surface, or charts that met; then all changed faces are left
};

} // namespace

Status map_corners(Context& context, const Mesh& in, EdgeBits kept, VertexTraces&& traces, Mesh& out) {
    return Mapping(context, in, kept, std::move(traces), out).run();
}

namespace {

constexpr int64_t kMany = 1 << 16;

// A corner's place on the source is in one triangle of it, whose corners have their places on one face of the cage: on a face,
// places between places are on it. Corners of one place share it.
Status carry_cage_places(Context& context, const Mesh& in, Mesh& out) {
    const auto weighted = [&](const CornerPlace& place) {
        double s = 0, t = 0;
        for (int k = 0; k < 3; ++k) {
            const CagePlace& of = cage_place(in, place.corner[k]);
            s += place.weight[k] * static_cast<double>(of.s);
            t += place.weight[k] * static_cast<double>(of.t);
        }
        return CagePlace{cage_place(in, place.corner[0]).face, static_cast<float>(s), static_cast<float>(t)};
    };
    out.cage = in.cage;
    // First those of corner_places, then those that `in` has and corners of `out` still use.
    Array<int32_t> used(context.memory());
    DM_TRY(fill(context, used, in.cage_places.size(), -1));
    out.corner_cage.resize_uninitialized(out.corners());
    int64_t places = out.corner_places.size();
    for (int32_t c = 0; c < out.corners(); ++c) {
        if (c % kMany == 0) DM_TRY(context.progress(1));
        const int32_t corner = source_of(out.corner_map, c);
        if (corner < 0) {
            out.corner_cage[c] = ~corner;
            continue;
        }
        int32_t& place = used[in.corner_cage[corner]];
        if (place < 0) place = static_cast<int32_t>(places++);
        out.corner_cage[c] = place;
    }
    out.cage_places.resize_uninitialized(places);
    DM_TRY(context.parallel(out.corner_places.size(), kMany, [&](int64_t, int64_t begin, int64_t end) {
        for (int64_t i = begin; i < end; ++i) out.cage_places.data()[i] = weighted(out.corner_places.data()[i]);
    }));
    DM_TRY(context.parallel(used.size(), kMany, [&](int64_t, int64_t begin, int64_t end) {
        for (int64_t i = begin; i < end; ++i)
            if (used.data()[i] >= 0) out.cage_places.data()[used.data()[i]] = in.cage_places.data()[i];
    }));
    out.face_cage.resize_uninitialized(out.faces());
    return context.parallel(out.faces(), kMany, [&](int64_t, int64_t begin, int64_t end) {
        for (int64_t f = begin; f < end; ++f) out.face_cage.data()[f] = cage_face(in, source_of(out.face_source, f));
    });
}

} // namespace

Status name_places(Context& context, const Mesh& in, Mesh& out) {
    set_source_counts(in, out);
    if (!out.has_map) return DELMESH_OK;
    if (in.cage != 0) DM_TRY(carry_cage_places(context, in, out));
    if (!in.imported) return DELMESH_OK;
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
