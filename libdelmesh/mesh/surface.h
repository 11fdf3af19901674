// SPDX-License-Identifier: Apache-2.0
// The editable corner table: a Mesh copied out for an operation, in doubles that are all representable in the output precision.
// Edits are the field's three: flip, split, collapse; each assumes that it is legal (the caller asked first) and leaves the
// table valid. Names around an edge, as everywhere in the library:
//
//            u                     c: corner of the edge p -> q in the face (p, q, u)
//          /   *                   twin of c: q -> p in the face (q, p, v)
//        p ----> q
//          *   /
//            v
#pragma once

#include "base/context.h"
#include "mesh/mesh.h"

namespace dm {

// The straight line on which split vertices lie: an edge of the input, or in flip mode an edge that flips made. New points are
// computed from its ends, never from pieces that are already rounded.
struct Carrier {
    int32_t a, b;
};
struct SplitVertex {
    SplitVertex() = default;
    SplitVertex(int32_t carrier_, double t_, const Vec3& exact_, int32_t depth_)
        : carrier(carrier_), depth(depth_), t(t_), exact(exact_) {}
    int32_t carrier;
    int32_t depth; // how many carriers deep: in float64, each adds the rounding of the one below
    double t;      // position = a + t (b - a), rounded
    Vec3 exact;    // the same before it was rounded to the output precision: where further carriers begin
};

class Surface {
public:
    // Copies `in`, coordinates rounded to `precision`. room: for so many more vertices nothing has to be moved.
    Surface(Context& context, const Mesh& in, Precision precision, int64_t room = 0);

    // A part of `whole` for one thread: the same surface under another name, with numbers of its own for what it adds.
    // Parts may be edited at the same time, `whole` not: an edit is allowed where all four vertices around its edge are the
    // part's own. A vertex is owned only if all its neighbours are in the same cell of a partition, so a face with an
    // owned vertex belongs to that part alone. Nothing grows: has_room() says whether an edit may still be made.
    Surface(Surface& whole, uint8_t number);
    struct Range {
        int32_t next, end;
        int32_t size() const { return end - next; }
    };
    struct Supply {
        Range verts, faces, carriers;
    };
    // Adds unused numbers to the ends of all arrays. Parts see them after their next refresh().
    Supply grow_blank(int32_t verts, int32_t faces, int32_t carriers);
    // owner: per vertex the number of its part.
    void refresh(Surface& whole, const uint8_t* owner);
    void supply(const Supply& more);
    void take_back(Surface& part); // what the part did not use
    bool is_part() const { return owner_ != nullptr; }
    bool owns(int32_t v) const { return owner_ == nullptr || owner_[v] == number_; }
    // May the edge c be flipped or split here?
    bool may_edit(int32_t c) const {
        return owner_ == nullptr || (owns(vert(c)) && owns(head(c)) && owns(apex(c)) && (is_boundary(c) || owns(apex(twin(c)))));
    }
    bool has_room() const;             // for one more split, and in a trial for what it overwrites
    void reserve_freed(int64_t verts); // room for the numbers that so many more taken out vertices free

    // -- read
    int32_t vertices() const { return static_cast<int32_t>(pos.size()); }
    int64_t vertices_in_use() const { return pos.size() - new_verts_.again.size(); }
    int32_t corners() const { return static_cast<int32_t>(corner_vert.size()); }
    int32_t faces() const { return corners() / 3; }
    int32_t vert(int32_t c) const { return corner_vert[c]; }
    int32_t head(int32_t c) const { return corner_vert[next_corner(c)]; } // the end of the edge c
    int32_t apex(int32_t c) const { return corner_vert[prev_corner(c)]; } // opposite to the edge c
    int32_t twin(int32_t c) const { return corner_twin[c]; }
    bool is_boundary(int32_t c) const { return corner_twin[c] < 0; }
    bool is_kept(int32_t c) const { return (corner_bits[c] & kept_bits) != 0; }
    bool is_frozen(int32_t c) const { return (corner_bits[c] & kEdgeFrozen) != 0; }
    bool is_dead(int32_t face) const { return corner_vert[3 * static_cast<int64_t>(face)] < 0; }
    bool is_original(int32_t v) const { return v < first_split; }
    // The vertex of the Mesh that an original vertex is, or was copied from by a repair.
    int32_t copied(int32_t v) const {
        while (v >= first_copy) v = copy_of[v - first_copy];
        return v;
    }
    // Where v lies before rounding.
    const Vec3& exact(int32_t v) const { return is_original(v) ? pos[v] : split_vertices[v - first_split].exact; }
    int32_t depth(int32_t v) const { return is_original(v) ? 0 : split_vertices[v - first_split].depth; }
    // The first of all the copies that v has on other sheets, through merges too.
    int32_t root(int32_t v) const {
        while (vert_root[v] != v) v = vert_root[v];
        return v;
    }
    const Vec3& at(int32_t v) const { return pos[v]; }
    // Next outgoing corner counter-clockwise around the vertex of c; negative past the boundary.
    int32_t rotate(int32_t c) const { return corner_twin[prev_corner(c)]; }
    bool adjacent(int32_t a, int32_t b) const;            // is [a, b] an edge? O(valence of a)
    bool has_face(int32_t a, int32_t b, int32_t c) const; // in either orientation
    bool on_boundary(int32_t v) const { return corner_twin[vert_corner[v]] < 0; }

    // -- carriers
    // The carrier of the edge p q, made when it is split for the first time, and the parameters of its ends there.
    int32_t carrier_of(int32_t p, int32_t q, double& tp, double& tq);
    // For one without split vertices: an edge again.
    void release_carrier(int32_t carrier);
    // Do three vertices lie on one carrier? Then they never span a face.
    bool on_one_carrier(int32_t a, int32_t b, int32_t c) const;

    // -- edit
    // Replaces p q by u v in the two faces of c. Legal when c is interior and u v is not an edge.
    // Afterwards c is p -> v, next(c) the new edge v -> u, prev(c) u -> p; in the other face t = twin: q -> u, u -> v, v -> q.
    void flip(int32_t c);
    // Inserts vertex s on the edge c: c becomes p -> s; returns the corner s -> q. Works on the boundary too, and keeps what
    // the pieces need to know of the edge; rings of cut copies are the caller's (split_everywhere).
    int32_t split(int32_t c, int32_t s);
    // Undoes a split: s, the head of c, has one spoke left on either side of the line it lies on. Afterwards c is p -> q again.
    // Legal when p q is not an edge, and nothing around s was cut at import.
    void unsplit(int32_t c);
    // Adds a split vertex. copied_from: the vertex of which it is a copy on another sheet, or -1.
    int32_t add_vertex(Vec3 position, SplitVertex where, int32_t copied_from);
    // Splits the edge c and, if it was cut at import, all its copies at the same place. `pieces` gets, per copy, the corner
    // x -> s in the face that kept its number; its other half is next(twin(next(x -> s))).
    void split_everywhere(int32_t c, const Vec3& position, SplitVertex where, Array<int32_t>& pieces);
    // Merges the far end q of the edge c into p and removes the edge's faces. Legal when collapse_is_legal.
    void collapse(int32_t c);
    bool collapse_is_legal(int32_t c) const;
    // The same where it is not legal, for ends that coincide: loops p x q of zero width are cut and closed up on either side, and
    // vertices that this leaves with several fans are split. False, with nothing changed, where a side of such a loop is a
    // boundary.
    bool collapse_and_cut(int32_t c);
    // Lets `heir`, which no face uses, take the place of v.
    void rename(int32_t v, int32_t heir);
    // Removes a whole component, closed or not.
    void remove_component(const Array<int32_t>& faces_of_it);
    // Removes the face of a boundary corner c; splits off a copy of the apex where that pinches it.
    void remove_boundary_face(int32_t c);

    // What a trial overwrites. A part is lent this: trials of different parts need as many as there are threads.
    class TrialLog;
    void swap_log(TrialLog& log);

    // -- trials: between begin and the end, only flip, split, unsplit, add_vertex, collapse and remove_component, on edges that no
    // cut made
    void begin_trial();
    void keep_trial();
    void undo_trial();

    // Checks every relation; a broken one is a trap in debug builds and false elsewhere.
    bool valid() const;

    Array<Vec3> pos;
    Array<int32_t> corner_vert, corner_twin;
    Array<EdgeBits> corner_bits;
    Array<int32_t> vert_corner; // an outgoing corner, the boundary one where there is one; -1 for unused vertices
    Array<int32_t> face_src;    // face of the Mesh it was copied from
    Array<CutSlot> cut_slots;
    Array<int32_t> vert_root; // empty, or per vertex one of which it is a copy on another sheet (itself if none): see root()
    Array<int32_t> copy_of;   // vertices [first_copy, first_split): made by repairs, copies of these
    Array<Carrier> carriers;
    Array<int32_t> carrier_splits;                  // per carrier: split vertices on it, with those that collapses took since
    Array<SplitVertex> split_vertices;              // of vertices [first_split, vertices()), used or not
    Array<int32_t> pins;                            // per split vertex: carriers that end there
    EdgeBits kept_bits = kEdgeGiven | kEdgeFeature; // an edge with one of these is kept
    int32_t first_copy = 0, first_split = 0;
    int64_t dead_faces = 0;

private:
    // What a trial overwrote.
    struct Change {
        Array<int32_t> Surface::*array;
        int32_t index, old;
    };
    void put(Array<int32_t> Surface::*array, int32_t index, int32_t value) {
        int32_t& place = (this->*array)[index];
        if (in_trial_) changes_.push_back({array, index, place});
        place = value;
    }
    void put_bits(int32_t c, EdgeBits bits) {
        if (in_trial_) changed_bits_.push_back({c, corner_bits[c]});
        corner_bits[c] = bits;
    }
    struct BitsChange {
        int32_t corner;
        EdgeBits old;
    };
    struct SlotChange {
        int32_t slot, old;
    };
    // Numbers for what is added: given back by trials, then those of a part's range. A whole surface then grows.
    struct Numbers {
        explicit Numbers(Memory& memory) : again(memory), freed(memory) {}
        Array<int32_t> again, freed; // freed: in the running trial, so not to be used before it is kept
        Range range{0, 0};
        int64_t supplied = 0; // to a part, in all
        struct {
            int64_t size, again;
            Range range;
        } before{}; // the trial
        bool take(int32_t& number) {
            if (!again.empty()) return number = again.pop_back(), true;
            if (range.next < range.end) return number = range.next++, true;
            return false;
        }
        void begin(int64_t size) { before = {size, again.size(), range}; }
        void keep() {
            for (const int32_t n : freed) again.push_back(n);
            freed.clear();
        }
        void undo() { // what was taken from `again` is still there, behind its end
            again.resize_uninitialized(before.again);
            range = before.range;
            freed.clear();
        }
        int64_t room() const { return again.size() + range.end - range.next; }
    };
    int32_t add_face(int32_t a, int32_t b, int32_t c, int32_t source); // without twins; returns its first corner
    void set_twin(int32_t c, int32_t twin);                            // both directions, or the slot's reference
    void kill_face(int32_t face);
    void unite(int32_t a, int32_t b);                                  // what were copies of either are now copies of one
    void gather_corners(int32_t v, Array<int32_t>& out) const;         // all outgoing corners of v
    void separate_fans(int32_t v, const Array<int32_t>& corners_of_v); // further fans around v get copies of v
    void add_copy(int32_t v, int32_t start);                           // of v, for the fan that begins with the corner `start`
    void drop_from_ring(int32_t c); // a boundary corner that goes away leaves the ring of its copies

    void resize_all(int64_t verts, int64_t faces, int64_t carriers_size);
    int32_t add_carrier(int32_t a, int32_t b);
    int32_t append_vertex(Vec3 position, SplitVertex where, int32_t copied_from);

    bool in_trial_ = false;
    Array<Change> changes_;
    Array<BitsChange> changed_bits_;
    Array<SlotChange> changed_slots_;
    Numbers new_verts_, new_faces_, new_carriers_;
    int64_t dead_faces_before_ = 0;
    const uint8_t* owner_ = nullptr; // of a part
    uint8_t number_ = 0;
};

class Surface::TrialLog {
public:
    explicit TrialLog(Memory& memory) : changes_(memory), changed_bits_(memory) {
        constexpr int64_t kMost = 16384;
        changes_.reserve(kMost);
        changed_bits_.reserve(kMost);
    }

private:
    friend class Surface;
    Array<Change> changes_;
    Array<BitsChange> changed_bits_;
};

} // namespace dm
