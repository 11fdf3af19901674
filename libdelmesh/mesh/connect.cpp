// SPDX-License-Identifier: Apache-2.0
#include "mesh/connect.h"

#include <algorithm>

#include "mesh/link_fans.h"
#include "mesh/views.h"

namespace dm {
namespace {

// A corner, filed under the lower vertex of its edge. The sign of `code` says which way it runs, so that matching reads nothing
// else: code >= 0 runs from the lower to the upper vertex, ~code the other way.
struct HalfEdge {
    int32_t upper;
    int32_t code;
    int32_t corner() const { return code < 0 ? ~code : code; }
};

inline bool are_opposite(const HalfEdge& a, const HalfEdge& b) {
    return (a.code ^ b.code) < 0;
}

// All corners, sorted by the lower vertex of their edge.
class EdgeBuckets {
public:
    explicit EdgeBuckets(Memory& memory) : ends_(memory), half_edges_(memory) {}

    Status fill(Context& context, double from, double to, const Mesh& mesh) {
        const double middle = from + 0.3 * (to - from);
        const int32_t* vert = mesh.corner_vert.data();
        ends_.assign(mesh.vertices(), 0);
        half_edges_.resize_uninitialized(mesh.corners());
        int32_t* ends = ends_.data();
        HalfEdge* half_edges = half_edges_.data();
        DM_TRY(in_pieces(context, mesh.faces(), from, middle, [&](int64_t begin, int64_t end) {
            for (int64_t f = begin; f < end; ++f) {
                const int32_t a = vert[3 * f], b = vert[3 * f + 1], c = vert[3 * f + 2];
                ++ends[a < b ? a : b];
                ++ends[b < c ? b : c];
                ++ends[c < a ? c : a];
            }
            return DELMESH_OK;
        }));
        int32_t sum = 0;
        for (int32_t& end : ends_) {
            const int32_t size = end;
            end = sum; // where the bucket begins, until all its corners are in
            sum += size;
        }
        const auto file = [&](int32_t p, int32_t q, int64_t corner) { // without a branch: no one can predict which is lower
            const int32_t falls = p > q ? -1 : 0;
            half_edges[ends[std::min(p, q)]++] = {std::max(p, q), static_cast<int32_t>(corner) ^ falls};
        };
        return in_pieces(context, mesh.faces(), middle, to, [&](int64_t begin, int64_t end) {
            for (int64_t f = begin; f < end; ++f) {
                const int32_t a = vert[3 * f], b = vert[3 * f + 1], c = vert[3 * f + 2];
                file(a, b, 3 * f);
                file(b, c, 3 * f + 1);
                file(c, a, 3 * f + 2);
            }
            return DELMESH_OK;
        });
    }

    int64_t size() const { return ends_.size(); }
    HalfEdge* begin(int64_t v) { return half_edges_.data() + (v == 0 ? 0 : ends_.data()[v - 1]); }
    HalfEdge* end(int64_t v) { return half_edges_.data() + ends_.data()[v]; }

    // Calls body(lower, first, last) for every edge with its corners in ascending order.
    template <class Body>
    Status for_each_edge(Context& context, double fraction, Body&& body) {
        return in_pieces(context, size(), fraction, fraction, [&](int64_t from, int64_t to) -> Status {
            for (int64_t v = from; v < to; ++v) {
                HalfEdge* const last = end(v);
                sort(begin(v), last);
                for (HalfEdge* h = begin(v); h != last;) {
                    HalfEdge* const first = h;
                    while (h != last && h->upper == first->upper) ++h;
                    DM_TRY(body(static_cast<int32_t>(v), first, h));
                }
            }
            return DELMESH_OK;
        });
    }

    static void sort(HalfEdge* first, HalfEdge* last) {
        std::sort(first, last, [](const HalfEdge& a, const HalfEdge& b) {
            return a.upper != b.upper ? a.upper < b.upper : a.corner() < b.corner();
        });
    }

private:
    Array<int32_t> ends_; // per vertex: one past its last half-edge
    Array<HalfEdge> half_edges_;
};

// ---- Where the faces around an edge give no single answer ---------------------------------------------------------------------

// The three vertices of a face in ascending order. code < 0 (~face): an odd permutation, so the other way round.
struct FaceKey {
    int32_t a, b, c;
    int32_t code;
    int32_t face() const { return code < 0 ? ~code : code; }
    bool same_vertices(const FaceKey& o) const { return a == o.a && b == o.b && c == o.c; }
};

FaceKey key_of(const Mesh& mesh, int32_t f) {
    int32_t v[3];
    for (int k = 0; k < 3; ++k) v[k] = mesh.corner_vert[3 * static_cast<int64_t>(f) + k];
    bool odd = false;
    const auto order = [&](int i, int k) {
        if (v[i] <= v[k]) return;
        std::swap(v[i], v[k]);
        odd = !odd;
    };
    order(0, 1);
    order(1, 2);
    order(0, 1);
    return {v[0], v[1], v[2], odd ? ~f : f};
}

class Repair {
public:
    Repair(Context& context, bool strict, Mesh& mesh, EdgeBuckets& buckets)
        : context_(context), strict_(strict), mesh_(mesh), buckets_(buckets), mate_(context.memory()), apart_(context.memory()) {}

    Status run(double from, double to) {
        const double step = (to - from) / 4;
        DM_TRY(leave_out_second_copies(from, from + step));
        DM_TRY(find_double_sheets(from + step));
        DM_TRY(link_edges(from + 2 * step));
        return inconsistent_ ? make_consistent(from + 3 * step, to) : DELMESH_OK;
    }

private:
    // Only a face with a suspect edge (more than two faces, or two that run the same way) can be a copy of another one.
    Status leave_out_second_copies(double from, double to) {
        const int32_t faces = mesh_.faces();
        mate_.assign(faces, -1);
        Array<FaceKey> keys(context_.memory());
        {
            Array<uint8_t> suspect(context_.memory(), faces, 0);
            DM_TRY(buckets_.for_each_edge(context_, from, [&](int32_t, const HalfEdge* first, const HalfEdge* last) {
                if (last - first > 2 || (last - first == 2 && !are_opposite(first[0], first[1])))
                    for (; first != last; ++first) suspect[face_of(first->corner())] = 1;
                return DELMESH_OK;
            }));
            int64_t count = 0;
            for (const uint8_t s : suspect) count += s;
            keys.reserve(count);
            for (int32_t f = 0; f < faces; ++f)
                if (suspect[f] != 0) keys.push_back(key_of(mesh_, f));
        }
        std::sort(keys.begin(), keys.end(), [](const FaceKey& p, const FaceKey& q) {
            if (p.a != q.a) return p.a < q.a;
            if (p.b != q.b) return p.b < q.b;
            return p.c != q.c ? p.c < q.c : p.face() < q.face();
        });
        Array<int32_t> copies(context_.memory());
        for (const FaceKey* k = keys.begin(); k != keys.end();) {
            const FaceKey* const first = k;
            int32_t back = -1;
            for (++k; k != keys.end() && k->same_vertices(*first); ++k) {
                const bool same_way = (k->code < 0) == (first->code < 0);
                if (same_way || back >= 0)
                    copies.push_back(k->face());
                else
                    back = k->face();
            }
            if (back < 0) continue;
            mate_[first->face()] = back;
            mate_[back] = first->face();
        }
        if (copies.empty()) return DELMESH_OK;
        std::sort(copies.begin(), copies.end());
        if (strict_)
            return context_.fail(DELMESH_ERROR_STRICT,
                                 "Face %d was a second copy of a face, and 'strict' forbids to leave it out.",
                                 source_of_face(mesh_, copies[0]));
        mesh_.counts.duplicate_faces = copies.size();
        Array<int32_t> new_face(context_.memory(), faces);
        const int32_t* copy = copies.begin();
        int32_t kept = 0;
        for (int32_t f = 0; f < faces; ++f) {
            const bool out = copy != copies.end() && *copy == f;
            if (out) ++copy;
            new_face[f] = out ? -1 : kept++;
        }
        leave_out_faces(mesh_, [&](int64_t f) { return new_face[f] < 0; });
        for (int32_t f = 0; f < faces; ++f)
            if (new_face[f] >= 0) mate_[new_face[f]] = mate_[f] < 0 ? -1 : new_face[mate_[f]];
        mate_.resize_uninitialized(kept);
        return buckets_.fill(context_, from, to, mesh_);
    }

    // Two faces back to back are a closed pillow when nothing else meets their edges. Else they are pieces of a double-sided
    // sheet, and its two sides are taken apart.
    Status find_double_sheets(double fraction) {
        apart_.assign(mesh_.faces(), 0);
        return buckets_.for_each_edge(context_, fraction, [&](int32_t, const HalfEdge* first, const HalfEdge* last) {
            if (last - first > 2)
                for (; first != last; ++first) {
                    const int32_t f = face_of(first->corner());
                    apart_[f] = mate_[f] >= 0;
                }
            return DELMESH_OK;
        });
    }

    // Twins, also between faces that run the same way (make_consistent turns those), and rings of what is cut open.
    Status link_edges(double fraction) {
        mesh_.corner_twin.resize_uninitialized(mesh_.corners());
        return buckets_.for_each_edge(
            context_, fraction, [&](int32_t lower, const HalfEdge* first, const HalfEdge* last) -> Status {
                const int64_t count = last - first;
                if (count == 1) {
                    mesh_.corner_twin[first->corner()] = kBoundary;
                    return DELMESH_OK;
                }
                if (count == 2 && !(apart_[face_of(first->corner())] != 0 && are_mates(first[0], first[1]))) {
                    inconsistent_ |= !are_opposite(first[0], first[1]);
                    link(first[0], first[1]);
                    return DELMESH_OK;
                }
                if (strict_)
                    return context_.fail(DELMESH_ERROR_STRICT,
                                         "The %lld faces at the edge from vertex %d to %d were no manifold, and 'strict' "
                                         "forbids to cut it.",
                                         static_cast<long long>(count), lower, first->upper);
                ++mesh_.counts.nonmanifold_edges;
                if (count == 4 && link_double_sheets(first)) return DELMESH_OK;
                if (count == 3 && link_beside_double_sheet(first)) return DELMESH_OK;
                cut(first, last);
                return DELMESH_OK;
            });
    }

    bool are_mates(const HalfEdge& a, const HalfEdge& b) const { return mate_[face_of(a.corner())] == face_of(b.corner()); }

    void link(const HalfEdge& a, const HalfEdge& b) {
        mesh_.corner_twin[a.corner()] = b.corner();
        mesh_.corner_twin[b.corner()] = a.corner();
    }

    // Two double-sided faces side by side: each side goes on in the side that runs the other way along the edge.
    bool link_double_sheets(const HalfEdge* h) {
        for (int other = 1; other < 4; ++other) {
            if (!are_mates(h[0], h[other])) continue;
            const HalfEdge& p = h[other == 1 ? 2 : 1];
            const HalfEdge& q = h[other == 3 ? 2 : 3];
            if (!are_mates(p, q)) return false;
            link(h[0], are_opposite(h[0], p) ? p : q);
            link(h[other], are_opposite(h[other], p) ? p : q);
            return true;
        }
        return false;
    }

    // A single face beside a double-sided one goes on in the side that fits it; the other side ends here.
    bool link_beside_double_sheet(const HalfEdge* h) {
        for (int single = 0; single < 3; ++single) {
            const HalfEdge* p = h + (single + 1) % 3;
            const HalfEdge* q = h + (single + 2) % 3;
            if (!are_mates(*p, *q)) continue;
            if (!are_opposite(h[single], *p)) std::swap(p, q);
            link(h[single], *p);
            cut(q, q + 1);
            return true;
        }
        return false;
    }

    // All these corners become boundary, in one ring.
    void cut(const HalfEdge* first, const HalfEdge* last) {
        const int32_t ring = static_cast<int32_t>(mesh_.cut_slots.size());
        for (const HalfEdge* h = first; h != last; ++h) {
            const int32_t slot = static_cast<int32_t>(mesh_.cut_slots.size());
            mesh_.cut_slots.push_back({h->corner(), h + 1 == last ? ring : slot + 1});
            mesh_.corner_twin[h->corner()] = cut_twin(slot);
        }
    }

    // Turns over the fewer faces of each component, so that all its twins run opposite ways.
    Status make_consistent(double from, double to) {
        enum : uint8_t { kNew, kAsIs, kTurned };
        const int32_t faces = mesh_.faces();
        const int32_t* vert = mesh_.corner_vert.data();
        const int32_t* twin = mesh_.corner_twin.data();
        Array<uint8_t> side(context_.memory(), faces, kNew);
        Array<int32_t> component(context_.memory(), faces); // breadth first; also the queue
        DM_TRY(in_pieces(context_, faces, from, to, [&](int64_t begin, int64_t end) -> Status {
            for (int64_t seed = begin; seed < end; ++seed) {
                if (side[seed] != kNew) continue;
                side[seed] = kAsIs;
                component[0] = static_cast<int32_t>(seed);
                int64_t size = 1, turned = 0;
                for (int64_t i = 0; i < size; ++i) {
                    const int32_t f = component[i];
                    for (int64_t c = 3 * static_cast<int64_t>(f); c < 3 * static_cast<int64_t>(f) + 3; ++c) {
                        if (twin[c] < 0) continue;
                        const int32_t g = face_of(twin[c]);
                        const bool same_way = vert[c] == vert[twin[c]];
                        const uint8_t fits = (side[f] == kTurned) != same_way ? kTurned : kAsIs;
                        if (side[g] == kNew) {
                            side[g] = fits;
                            turned += fits == kTurned;
                            component[size++] = g;
                        } else if (side[g] != fits) {
                            return context_.fail(DELMESH_ERROR_NON_ORIENTABLE,
                                                 "Face %d belongs to a one-sided surface, like a Moebius strip.",
                                                 source_of_face(mesh_, g));
                        }
                    }
                }
                if (2 * turned > size) // the seed, which is the lowest face, stays when it is a tie
                    for (int64_t i = 0; i < size; ++i) side[component[i]] = side[component[i]] == kAsIs ? kTurned : kAsIs;
            }
            return DELMESH_OK;
        }));
        return turn_over(side, kTurned);
    }

    // (a, b, c) becomes (a, c, b), so the edges of a turned face swap the places 0 and 2.
    Status turn_over(const Array<uint8_t>& side, uint8_t turned) {
        const auto moved = [&](int32_t c) {
            const int32_t f = face_of(c);
            return side[f] == turned ? 3 * f + 2 - c % 3 : c;
        };
        for (int32_t& t : mesh_.corner_twin)
            if (t >= 0) t = moved(t);
        for (CutSlot& slot : mesh_.cut_slots) slot.corner = moved(slot.corner);
        for (int32_t f = 0; f < mesh_.faces(); ++f) {
            if (side[f] != turned) continue;
            if (strict_)
                return context_.fail(DELMESH_ERROR_STRICT,
                                     "Face %d was oriented against its component, and 'strict' forbids to turn it.",
                                     source_of_face(mesh_, f));
            const int64_t c = 3 * static_cast<int64_t>(f);
            remember_sources(mesh_);
            std::swap(mesh_.corner_vert[c + 1], mesh_.corner_vert[c + 2]);
            std::swap(mesh_.corner_map[c + 1], mesh_.corner_map[c + 2]);
            std::swap(mesh_.corner_twin[c], mesh_.corner_twin[c + 2]);
            ++mesh_.counts.reoriented_faces;
        }
        return DELMESH_OK;
    }

    Context& context_;
    const bool strict_;
    Mesh& mesh_;
    EdgeBuckets& buckets_;
    Array<int32_t> mate_;  // per face: the face with the same vertices, the other way round; -1 if none
    Array<uint8_t> apart_; // per face: 1 where the face and its mate are two sides of a sheet, not a pillow
    bool inconsistent_ = false;
};

// ---- Vertices ---------------------------------------------------------------------------------------------------------------

// Gives every fan of faces around a vertex a vertex of its own. The fan with the lowest corner keeps the vertex.
Status split_fans(Context& context, bool strict, double from, double to, Mesh& mesh) {
    enum : uint8_t { kUnused, kUsed, kSplit };
    const int32_t* twin = mesh.corner_twin.data();
    const int32_t original_vertices = mesh.vertex_count;
    Array<uint8_t> walked(context.memory(), mesh.corners(), 0);
    Array<uint8_t> state(context.memory(), original_vertices, kUnused);
    Array<int32_t> copy_source(context.memory());
    DM_TRY(in_pieces(context, mesh.corners(), from, to, [&](int64_t begin, int64_t end) -> Status {
        for (int64_t first = begin; first < end; ++first) {
            if (walked[first] != 0) continue;
            const int32_t v = mesh.corner_vert[first];
            int32_t own = v;
            if (state[v] == kUnused) {
                state[v] = kUsed;
            } else {
                if (strict)
                    return context.fail(DELMESH_ERROR_STRICT,
                                        "Vertex %d joined several fans of faces, and 'strict' forbids to split it.", v);
                if (original_vertices + copy_source.size() >= INT32_MAX)
                    return context.fail(DELMESH_ERROR_TOO_LARGE, "Splitting vertex %d made more than 2147483647 vertices.", v);
                if (state[v] == kUsed) ++mesh.counts.nonmanifold_vertices;
                state[v] = kSplit;
                own = static_cast<int32_t>(original_vertices + copy_source.size());
                copy_source.push_back(v);
            }
            const auto give = [&](int32_t c) {
                walked[c] = 1;
                if (own != v) mesh.corner_vert[c] = own;
            };
            // Counter-clockwise to the end of the fan or all the way round, then clockwise from the start.
            int32_t c = static_cast<int32_t>(first);
            do {
                give(c);
                c = twin[prev_corner(c)];
            } while (c >= 0 && c != first);
            if (c >= 0) continue;
            for (c = twin[first]; c >= 0; c = twin[c]) {
                c = next_corner(c);
                give(c);
            }
        }
        return DELMESH_OK;
    }));
    if (copy_source.empty()) return DELMESH_OK;
    mesh.counts.copied_vertices = copy_source.size();
    mesh.vertex_count = static_cast<int32_t>(original_vertices + copy_source.size());
    const auto append_positions = [&](auto& positions) {
        positions.resize_uninitialized(3 * static_cast<int64_t>(mesh.vertex_count));
        auto* copy = positions.data() + 3 * static_cast<int64_t>(original_vertices);
        for (const int32_t v : copy_source)
            for (int k = 0; k < 3; ++k) *copy++ = positions[3 * static_cast<int64_t>(v) + k];
    };
    if (mesh.precision == Precision::f32)
        append_positions(mesh.pos32);
    else
        append_positions(mesh.pos64);
    mesh.vert_source.resize_uninitialized(mesh.vertex_count);
    for (int32_t v = 0; v < mesh.vertex_count; ++v)
        mesh.vert_source[v] = v < original_vertices ? v : copy_source[v - original_vertices];
    mesh.vert_join.copy_from(mesh.vert_source);
    return DELMESH_OK;
}

} // namespace

void remember_sources(Mesh& mesh) {
    const auto fill = [](Array<int32_t>& map, int64_t count) {
        if (!map.empty()) return;
        map.resize_uninitialized(count);
        for (int64_t i = 0; i < count; ++i) map[i] = static_cast<int32_t>(i);
    };
    fill(mesh.face_source, mesh.faces());
    fill(mesh.corner_map, mesh.corners());
}

Status connect_faces(Context& context, bool strict, double from, double to, Mesh& mesh, Glance& glance) {
    const double step = (to - from) / 4;
    FanLinks links;
    DM_TRY(link_fans(context, from, from + step, mesh, links, glance.least_neighbour));
    if (links.oriented_manifold && !links.several_fans) {
        glance.boundary_edges = links.boundary_edges;
        return DELMESH_OK;
    }
    glance.least_neighbour.free_storage();
    if (!links.oriented_manifold) {
        EdgeBuckets buckets(context.memory());
        DM_TRY(buckets.fill(context, from + step, from + 2 * step, mesh));
        DM_TRY(Repair(context, strict, mesh, buckets).run(from + 2 * step, from + 3 * step));
    }
    return split_fans(context, strict, from + 3 * step, to, mesh);
}

} // namespace dm
