// SPDX-License-Identifier: Apache-2.0
// A sample survey. The population are the NLD edges; every split vertex of the result is owned by the NLD edge nearest to the
// edge of the input that it lies on. The edges are walked along a space-filling curve and cut into cells, cells are drawn with a
// probability proportional to a rough forecast of their splits (those with the largest for certain), a piece of the mesh around
// each drawn cell is remeshed by the very code, and the split vertices that the cell owns are counted and scaled up.
#include "algo/estimate.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numeric>

#include "algo/nld_scan.h"
#include "algo/remesh.h"
#include "base/box.h"
#include "mesh/build.h"
#include "mesh/source_map.h"

namespace dm {
namespace {

constexpr int32_t kMostPieceFaces = 20000;
// What the work is reckoned in: a face of the whole mesh. A face of a piece costs more, as there is no other work to share the
// cost of starting; and so does an NLD edge, with the splits that it leads to.
constexpr int64_t kFacesPerFace = 4, kFacesPerEdge = 50;
// Pieces with more than 1/kShare of the faces are no sample; the first 1/kEarly of them should have less.
constexpr int64_t kShare = 2, kEarly = 4, kShareEarly = 6;
constexpr int32_t kRing = 16; // parts in which the way across a ring is measured

// What is not the mesh's or the machine's fault, but what delmesh_remesh will come to.
bool is_outcome(Status status) {
    return status == DELMESH_ERROR_PRECISION || status == DELMESH_ERROR_VERTEX_LIMIT || status == DELMESH_ERROR_TOO_LARGE;
}

struct NldEdge {
    uint64_t place; // along the curve
    double weight;  // forecast of the splits that it owns
    int32_t corner, cell;
};

struct Cell {
    int64_t first, last; // edges [first, last)
    double weight;
    bool certain, drawn;
};

// Spreads the low 21 bits of x to every third place.
uint64_t spread_bits(uint64_t x) {
    x &= 0x1fffff;
    x = (x | x << 32) & 0x1f00000000ffff;
    x = (x | x << 16) & 0x1f0000ff0000ff;
    x = (x | x << 8) & 0x100f00f00f00f00f;
    x = (x | x << 4) & 0x10c30c30c30c30c3;
    return (x | x << 2) & 0x1249249249249249;
}

class Survey {
public:
    Survey(Context& context_, const Mesh& in_, const delmesh_remesh_options& options_, const EstimateSample& sample_,
           delmesh_preserve_estimate& out_)
        : context(context_), in(in_), options(options_), sample(sample_), out(out_), marks(context_.memory()),
          edges(context_.memory()), cell_of(context_.memory()), cells(context_.memory()), piece_of(context_.memory()),
          faces(context_.memory()), distance(context_.memory()), owner(context_.memory()), front(context_.memory()) {}

    // Draws the sample. worth_it: remeshing it is less work than remeshing the mesh.
    Status draw(bool& worth_it) {
        precision = options.precision == DELMESH_FLOAT32 ? Precision::f32 : Precision::f64;
        DM_TRY(context.stage("scan", 0, 0.15));
        measure();
        DM_TRY(find_edges());
        draw_cells();
        piece_of.assign(in.faces(), -1);
        return weigh(worth_it);
    }

    Status run() {
        double total = 0, sum = 0, squares = 0;
        int64_t drawn = 0, done = 0, all = 0;
        for (const Cell& cell : cells) all += cell.drawn ? 1 : 0;
        for (int64_t i = 0; i < cells.size(); ++i) {
            const Cell& cell = cells[i];
            if (!cell.drawn) continue;
            const Context::Part part(context, 0.15 + 0.85 * static_cast<double>(done) / static_cast<double>(all),
                                     0.15 + 0.85 * static_cast<double>(done + 1) / static_cast<double>(all));
            double splits = 0;
            DM_TRY(count_splits(static_cast<int32_t>(i), splits));
            out.sampled_edges += cell.last - cell.first;
            ++done;
            if (cell.certain) {
                total += splits;
            } else {
                const double each = splits * uncertain_weight / cell.weight; // what it says about all of them
                sum += each;
                squares += each * each;
                ++drawn;
            }
        }
        double variance = 0;
        if (drawn > 0) {
            const double n = static_cast<double>(drawn), mean = sum / n;
            total += mean;
            if (drawn > 1) variance = std::max(0.0, (squares - n * mean * mean) / (n * (n - 1)));
        }
        out.nld_edges = edges.size();
        out.vertices_out = in.vertices() + std::llround(std::min(total, 9e15));
        out.deviation = std::sqrt(variance);
        return DELMESH_OK;
    }

private:
    Vec3 at(int32_t v) const { return round_to(precision, in.position(v)); }

    void measure() {
        Box box;
        for (const int32_t v : in.corner_vert) box.extend(at(v));
        low = box.lo;
        extent = box.longest_side();
        whole.largest = box.largest_coordinate();
        whole.diagonal = box.diagonal();
    }

    // -- the population

    Status find_edges() {
        marks.resize_uninitialized(in.faces());
        Certificate found;
        const auto scan = [&](const auto& positions) {
            const ScanView view{in.corner_vert.data(), in.corner_twin.data(), positions.data(), in.faces()};
            return scan_faces(context, view, options.boundary == DELMESH_BOUNDARY_NONOBTUSE, marks.data(), found);
        };
        if (in.precision == precision) {
            DM_TRY(in.precision == Precision::f32 ? scan(in.pos32) : scan(in.pos64));
        } else {
            Array<double> rounded(context.memory());
            rounded.reserve(3 * static_cast<int64_t>(in.vertices()));
            for (int32_t v = 0; v < in.vertices(); ++v)
                for (const double x : {at(v).x, at(v).y, at(v).z}) rounded.push_back(x);
            DM_TRY(scan(rounded));
        }
        flat_height = flat_height_of_tolerance();
        for_each_marked_edge(marks.data(), in.faces(), [&](int32_t c) {
            const Vec3 middle = 0.5 * (at(in.corner_vert[c]) + at(in.corner_vert[next_corner(c)]));
            edges.push_back({place_of(middle), forecast(c), c, -1});
        });
        std::sort(edges.begin(), edges.end(), [](const NldEdge& a, const NldEdge& b) {
            return a.place != b.place ? a.place < b.place : a.corner < b.corner;
        });
        return context.progress(1);
    }

    uint64_t place_of(const Vec3& x) const {
        const double size = extent > 0 ? extent : 1;
        const auto bits = [&](double v, double from) {
            const double t = (v - from) / size * 2097151.0;
            return spread_bits(t >= 0 && t < 2097152.0 ? static_cast<uint64_t>(t) : 0);
        };
        return bits(x.x, low.x) | bits(x.y, low.y) << 1 | bits(x.z, low.z) << 2;
    }

    double flat_height_of_tolerance() const {
        if (options.tolerance >= 0) return options.tolerance;
        return precision == Precision::f32 ? whole.largest * 0x1p-22 : whole.largest * 0x1p-51;
    }

    // Are the two faces so close to one plane that their edge is likely flipped?
    bool is_flat(int32_t c) const {
        const int32_t t = in.corner_twin[c];
        if (t < 0) return false;
        const Vec3 p = at(in.corner_vert[c]), q = at(in.corner_vert[next_corner(c)]), u = at(in.corner_vert[prev_corner(c)]),
                   v = at(in.corner_vert[prev_corner(t)]);
        const Vec3 d = q - p, n = cross(d, u - p), m = cross(v - p, d);
        const double n2 = length_squared(n), m2 = length_squared(m);
        const double volume = std::fabs(n2 > m2 ? dot(n, v - p) : dot(m, u - p));
        return dot(n, m) > 0 && volume <= flat_height * std::sqrt(std::max(n2, m2));
    }

    // How many splits to expect. Points on the edge must come so close together that the angles under which the two faces see a
    // piece of it add up to 180 degrees at most. Where w and w' are the widths of the two faces across from a place on the edge,
    // and both are small, this is when pieces are shorter than about 2 sqrt(w w'): as many as the integral of its inverse. Only
    // the ratio between edges matters; the factors were fitted by eye to the meshes that grow most.
    double forecast(int32_t c) const {
        const int32_t t = in.corner_twin[c];
        if (t < 0) return 1;
        const Vec3 p = at(in.corner_vert[c]), q = at(in.corner_vert[next_corner(c)]), u = at(in.corner_vert[prev_corner(c)]),
                   v = at(in.corner_vert[prev_corner(t)]);
        const Vec3 d = q - p;
        const double size = length(d);
        if (!(size > 0)) return 1;
        struct Side {
            double foot, height; // of the apex, in units of the edge
            double width(double x) const {
                const double near = foot > 0 ? x / foot : 1e6, far = foot < 1 ? (1 - x) / (1 - foot) : 1e6;
                return height * std::min(std::min(near, far), 1e6);
            }
        };
        const auto side = [&](const Vec3& apex) {
            const Vec3 w = apex - p;
            return Side{dot(w, d) / (size * size), std::max(length(cross(d, w)) / (size * size), 1e-12)};
        };
        if (is_flat(c)) return 0.1;
        const Side a = side(u), b = side(v);
        double sum = 0, x = 0.5;
        for (int k = 0; k < 6; ++k, x *= 0.125) // the places x and 1 - x, for [x / 2.8, 2.8 x]
            for (const double y : {x, 1 - x}) sum += 2.5 * x / std::sqrt(std::min(1.0, a.width(y) * b.width(y)));
        return 1 + 0.1 * std::min(sum, 1e5);
    }

    // -- the sample

    void draw_cells() {
        double weight = 0;
        for (const NldEdge& e : edges) weight += e.weight;
        const double share = weight / sample.cells;
        for (int64_t i = 0; i < edges.size(); ++i) {
            if (cells.empty() || cells.back().last - cells.back().first >= sample.edges_per_cell ||
                cells.back().weight + edges[i].weight > share)
                cells.push_back({i, i, 0, false, false});
            Cell& cell = cells.back();
            cell.last = i + 1;
            cell.weight += edges[i].weight;
            edges[i].cell = static_cast<int32_t>(cells.size() - 1);
        }
        cell_of.reserve(edges.size());
        for (const NldEdge& e : edges) cell_of.push_back({e.corner, e.cell});
        std::sort(cell_of.begin(), cell_of.end(), [](const CornerCell& a, const CornerCell& b) { return a.corner < b.corner; });
        // Whoever would be drawn more often than once is certain; that leaves less for the others.
        int64_t left = std::min<int64_t>(sample.cells, cells.size());
        uncertain_weight = weight;
        for (bool again = true; again && left > 0;) {
            again = false;
            const double step = uncertain_weight / static_cast<double>(left);
            for (Cell& cell : cells) {
                if (cell.certain || cell.weight < step) continue;
                cell.certain = cell.drawn = true;
                uncertain_weight -= cell.weight;
                --left;
                again = true;
            }
        }
        // The others at equal steps of the summed weight, along the curve.
        const double step = left > 0 ? uncertain_weight / static_cast<double>(left) : 0;
        double sum = 0, next = 0.5 * step;
        for (Cell& cell : cells) {
            if (cell.certain) continue;
            sum += cell.weight;
            if (left > 0 && sum > next) {
                cell.drawn = true;
                next += step;
                --left;
            }
        }
    }

    // Is the sample less work than the mesh? Where flat places hang together the pieces are so large that only gathering them
    // would take as long as to remesh the mesh. So they are gathered in an order that jumps about the mesh, and as soon as those
    // seen so far lead to expect too much it is decided.
    Status weigh(bool& worth_it) {
        Array<int32_t> drawn(context.memory());
        for (int32_t i = 0; i < cells.size(); ++i)
            if (cells[i].drawn) drawn.push_back(i);
        const int64_t count = drawn.size(), edges_of_all = kFacesPerEdge * edges.size();
        int64_t step = static_cast<int64_t>(0.618 * static_cast<double>(count)) + 1; // coprime to the count: each is met once
        while (std::gcd(step, count) > 1) ++step;
        int64_t faces_seen = 0, work = 0;
        worth_it = true;
        for (int64_t seen = 0, next = 0; seen < count && worth_it; next = (next + step) % count) {
            DM_TRY(context.progress(1));
            const bool early = seen * kEarly < count;
            const int64_t limit = in.faces() / (early ? kShareEarly : kShare);
            most_faces = std::min<int64_t>(kMostPieceFaces, limit - faces_seen + 1);
            gather_faces(drawn[next]);
            faces_seen += faces.size();
            work += kFacesPerFace * faces.size();
            for (const int32_t f : faces) work += kFacesPerEdge * std::popcount(static_cast<uint8_t>(marks[f] & 7));
            release_faces();
            ++seen;
            const int64_t to_expect = early ? 0 : work / seen * (count - seen);
            worth_it = faces_seen <= limit && work + to_expect <= in.faces() + edges_of_all;
        }
        most_faces = kMostPieceFaces;
        return DELMESH_OK;
    }

    // -- a piece

    // The cell of the NLD edge of corner c, or -1.
    int32_t cell_at(int32_t c) const {
        for (const int32_t k : {c, in.corner_twin[c]}) {
            if (k < 0 || (marks[face_of(k)] >> (k % 3) & 1) == 0) continue;
            const CornerCell* found = std::lower_bound(cell_of.begin(), cell_of.end(), k,
                                                       [](const CornerCell& a, int32_t corner) { return a.corner < corner; });
            return found->cell;
        }
        return -1;
    }

    Status count_splits(int32_t index, double& splits) {
        gather_faces(index);
        find_owners();
        Mesh piece(context.memory()), result(context.memory());
        Array<int32_t> twin_of_piece(context.memory());
        const bool has_boundary = make_piece(piece);
        delmesh_remesh_options piece_options = options;
        // The border of the piece is no boundary. Where it has some of the mesh's, both are treated as such.
        if (!has_boundary) piece_options.boundary = DELMESH_BOUNDARY_IGNORE;
        piece_options.max_vertices = 64 * static_cast<int64_t>(piece.vertices()) + 20000;
        piece_options.compact = 0;
        piece_options.map = 0;
        piece_options.strict = 0;
        delmesh_remesh_report report{};
        const Status status = remesh(context, piece, piece_options, result, report, &whole);
        out.faces_run += faces.size();
        if (status == DELMESH_OK) {
            splits = static_cast<double>(count_owned(index, piece, result));
        } else if (is_outcome(status)) {
            context.clear_error();
            if (out.outcome == DELMESH_OK) out.outcome = status;
            const double grown = static_cast<double>(std::max<int64_t>(0, report.vertices_out - report.vertices_in));
            splits = grown * static_cast<double>(cells[index].last - cells[index].first) / static_cast<double>(edges_in_piece);
        } else if (status == DELMESH_ERROR_NO_SURFACE) {
            context.clear_error();
            splits = 0;
        } else
            return status;
        release_faces();
        return DELMESH_OK;
    }
    void release_faces() {
        for (const int32_t f : faces) piece_of[f] = -1;
    }

    // The faces of the cell's edges and some rings of faces around them, in the order of the mesh. Points travel far across
    // slender faces, so a ring is as wide as they are long; and flat places are taken whole: their edges are flipped, and what
    // is at one end of them changes what is at the other.
    void gather_faces(int32_t index) {
        faces.clear();
        front.clear();
        const auto later = [](const Reached& a, const Reached& b) {
            return a.cost != b.cost ? a.cost > b.cost : a.face > b.face;
        };
        const auto reach = [&](int32_t f, int32_t cost) {
            front.push_back({cost, f});
            std::push_heap(front.begin(), front.end(), later);
        };
        for (int64_t i = cells[index].first; i < cells[index].last; ++i) {
            const int32_t c = edges[i].corner, t = in.corner_twin[c];
            reach(face_of(c), 0);
            if (t >= 0) reach(face_of(t), 0);
        }
        while (!front.empty() && faces.size() < most_faces) {
            std::pop_heap(front.begin(), front.end(), later);
            const Reached next = front.pop_back();
            if (piece_of[next.face] >= 0) continue;
            piece_of[next.face] = 0;
            faces.push_back(next.face);
            for (int32_t c = 3 * next.face; c < 3 * next.face + 3; ++c) {
                const int32_t t = in.corner_twin[c];
                if (t < 0 || piece_of[face_of(t)] >= 0) continue;
                const int32_t cost = next.cost + cost_of_crossing(t);
                if (cost <= kRing * sample.rings) reach(face_of(t), cost);
            }
        }
        std::sort(faces.begin(), faces.end());
        for (int64_t i = 0; i < faces.size(); ++i) piece_of[faces[i]] = static_cast<int32_t>(i);
    }

    // Into the face of c, through its edge: kRing times its height over the edge, in units of the edge, at most 1.
    int32_t cost_of_crossing(int32_t c) const {
        if (is_flat(c)) return 0;
        const Vec3 p = at(in.corner_vert[c]), q = at(in.corner_vert[next_corner(c)]), u = at(in.corner_vert[prev_corner(c)]);
        const Vec3 d = q - p;
        const double base = length_squared(d), area = length(cross(d, u - p));
        if (!(area < base)) return kRing;
        return std::max(1, static_cast<int32_t>(kRing * area / base));
    }

    // Per face of the piece, the cell of the nearest NLD edge (the smaller number at a tie).
    void find_owners() {
        owner.assign(faces.size(), std::numeric_limits<int32_t>::max());
        distance.assign(faces.size(), -1);
        edges_in_piece = 0;
        Array<int32_t> wave(context.memory());
        for (int64_t i = 0; i < faces.size(); ++i)
            for (int32_t c = 3 * faces[i]; c < 3 * faces[i] + 3; ++c) {
                const int32_t cell = cell_at(c);
                if (cell < 0) continue;
                if (distance[i] < 0) wave.push_back(static_cast<int32_t>(i));
                distance[i] = 0;
                owner[i] = std::min(owner[i], cell);
                edges_in_piece += (marks[face_of(c)] >> (c % 3) & 1) != 0 ? 1 : 0;
            }
        for (int64_t i = 0; i < wave.size(); ++i) {
            const int32_t at_face = wave[i];
            for (int32_t c = 3 * faces[at_face]; c < 3 * faces[at_face] + 3; ++c) {
                const int32_t t = in.corner_twin[c];
                const int32_t g = t >= 0 ? piece_of[face_of(t)] : -1;
                if (g < 0) continue;
                if (distance[g] < 0) {
                    distance[g] = distance[at_face] + 1;
                    wave.push_back(g);
                }
                if (distance[g] == distance[at_face] + 1) owner[g] = std::min(owner[g], owner[at_face]);
            }
        }
    }

    // A mesh of its own out of the gathered faces; says whether some of the mesh's boundary is in it.
    bool make_piece(Mesh& piece) const {
        const int64_t corners = 3 * faces.size();
        bool has_boundary = false;
        piece.precision = in.precision;
        piece.corner_twin.resize_uninitialized(corners);
        if (!in.corner_bits.empty()) piece.corner_bits.resize_uninitialized(corners);
        for (int64_t i = 0; i < corners; ++i) {
            const int32_t c = 3 * faces[i / 3] + static_cast<int32_t>(i % 3), t = in.corner_twin[c];
            const int32_t g = t >= 0 ? piece_of[face_of(t)] : -1;
            has_boundary |= t < 0;
            piece.corner_twin[i] = g >= 0 ? 3 * g + t % 3 : kBoundary;
            if (!in.corner_bits.empty()) piece.corner_bits[i] = in.corner_bits[c];
        }
        // Textures limit what is flipped in flat places.
        for (MeshLayer layer : in.layers) {
            if (layer.first_value >= 0) {
                const MeshLayer given = layer;
                layer.first_value = piece.layer_values.size();
                piece.layer_values.reserve(layer.first_value + corners * layer.components);
                for (int64_t i = 0; i < corners; ++i) {
                    const int32_t c = 3 * faces[i / 3] + static_cast<int32_t>(i % 3);
                    for (int32_t k = 0; k < layer.components; ++k)
                        piece.layer_values.push_back(in.layer_values[layer_value(in, given, c) + k]);
                }
            }
            piece.layers.push_back(layer);
        }
        // Where only some of the faces around a vertex are taken, each fan of them gets a vertex of its own.
        piece.corner_vert.assign(corners, -1);
        for (int32_t c = 0; c < corners; ++c) {
            if (piece.corner_vert[c] >= 0) continue;
            const int32_t v = piece.vertex_count++;
            const Vec3 x = in.position(in.corner_vert[3 * faces[c / 3] + c % 3]);
            for (const double coordinate : {x.x, x.y, x.z})
                if (in.precision == Precision::f32)
                    piece.pos32.push_back(static_cast<float>(coordinate)); // exact: it is one
                else
                    piece.pos64.push_back(coordinate);
            int32_t k = c;
            do {
                piece.corner_vert[k] = v;
                k = piece.corner_twin[prev_corner(k)];
            } while (k >= 0 && k != c);
            if (k == c) continue;
            for (k = piece.corner_twin[c]; k >= 0; k = piece.corner_twin[k]) {
                k = next_corner(k);
                piece.corner_vert[k] = v;
            }
        }
        piece.first_split = piece.vertex_count;
        return has_boundary;
    }

    int64_t count_owned(int32_t index, const Mesh& piece, const Mesh& result) const {
        Array<int32_t> corner_at(context.memory(), piece.vertices(),
                                 -1); // an outgoing corner, the first of the fan if it has one
        for (int32_t c = piece.corners() - 1; c >= 0; --c)
            if (corner_at[piece.corner_vert[c]] < 0 || piece.corner_twin[c] < 0) corner_at[piece.corner_vert[c]] = c;
        int64_t count = 0;
        for (const VertexMap& map : result.split_map) count += owner_of(map, piece, corner_at) == index ? 1 : 0;
        return count;
    }

    int32_t owner_of(const VertexMap& map, const Mesh& piece, const Array<int32_t>& corner_at) const {
        // The edge (or the face, within flat patches) of the two greatest weights.
        int first = 0;
        for (int k = 1; k < 3; ++k)
            if (map.weight[k] > map.weight[first]) first = k;
        int second = first == 0 ? 1 : 0;
        for (int k = 0; k < 3; ++k)
            if (k != first && map.weight[k] > map.weight[second]) second = k;
        const int32_t a = map.vert[first], b = map.vert[second];
        const int32_t start = corner_at[a];
        for (int32_t k = start; k >= 0;) {
            const int32_t last = prev_corner(k);
            const bool forward = piece.corner_vert[next_corner(k)] == b, backward = piece.corner_vert[last] == b;
            if (forward || backward) {
                const int32_t c = forward ? k : last, f = face_of(c), t = piece.corner_twin[c];
                const int32_t cell = cell_at(3 * faces[f] + c % 3);
                if (cell >= 0) return cell;
                if (t < 0) return owner[f];
                const int32_t g = face_of(t);
                const bool nearer = distance[g] >= 0 && (distance[f] < 0 || distance[g] < distance[f]);
                if (distance[f] == distance[g]) return std::min(owner[f], owner[g]);
                return owner[nearer ? g : f];
            }
            k = piece.corner_twin[last];
            if (k == start) break;
        }
        return start >= 0 ? owner[face_of(start)] : -1;
    }

    Context& context;
    const Mesh& in;
    const delmesh_remesh_options& options;
    const EstimateSample& sample;
    delmesh_preserve_estimate& out;
    Precision precision = Precision::f32;
    Vec3 low{};
    double extent = 0, flat_height = 0, uncertain_weight = 0;
    int64_t most_faces = kMostPieceFaces; // of a piece
    ModelSize whole{};
    Array<uint8_t> marks; // per face, bit k: the edge of the k-th corner is NLD (on one of its corners only)
    Array<NldEdge> edges; // along the curve
    struct CornerCell {
        int32_t corner, cell;
    };
    Array<CornerCell> cell_of; // of `edges`, by corner
    Array<Cell> cells;
    Array<int32_t> piece_of;               // per face of the mesh: its number in the piece, or -1
    Array<int32_t> faces, distance, owner; // of the piece
    struct Reached {
        int32_t cost, face;
    };
    Array<Reached> front;
    int64_t edges_in_piece = 0;
};

} // namespace

Status estimate_preserve(Context& context, const Mesh& in, const delmesh_remesh_options& options, const EstimateSample& sample,
                         delmesh_preserve_estimate& out) {
    delmesh_remesh_options settings = options;
    settings.mode = DELMESH_MODE_PRESERVE;
    settings.effort = std::min(settings.effort, 1); // a search would take longer than it could change the answer
    out.vertices_in = in.vertices();
    if (in.faces() == 0) return context.fail(DELMESH_ERROR_NO_SURFACE, "The mesh had no face.");
    bool sampled = in.faces() > sample.whole_up_to;
    if (sampled) {
        Survey survey(context, in, settings, sample, out);
        DM_TRY(survey.draw(sampled));
        if (sampled) DM_TRY(survey.run());
        if (settings.max_vertices > 0 && out.vertices_out > settings.max_vertices && out.outcome == DELMESH_OK)
            out.outcome = DELMESH_ERROR_VERTEX_LIMIT;
    }
    if (!sampled) {
        const Context::Part part(context, 0.15, 1);
        Mesh result(context.memory());
        delmesh_remesh_report report{};
        const Status status = remesh(context, in, settings, result, report);
        if (status != DELMESH_OK && !is_outcome(status)) return status;
        context.clear_error();
        out.outcome = status;
        out.exact = settings.effort == options.effort ? 1 : 0;
        out.vertices_out = report.vertices_out;
        out.nld_edges = out.sampled_edges = report.nld_in;
        out.faces_run = in.faces();
    }
    out.growth = static_cast<double>(out.vertices_out) / static_cast<double>(std::max<int64_t>(1, out.vertices_in));
    return DELMESH_OK;
}

} // namespace dm
