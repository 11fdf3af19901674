// SPDX-License-Identifier: Apache-2.0
// The one class behind make_delaunay, shared by the files that implement it and by nobody else:
//     delaunay.cpp    the two queues, flips, splits
//     make_room.cpp   what is smaller than the precision
//     fewest.cpp      takes split vertices out again, and searches for ways to need fewer
//     parts.cpp       parts of a large mesh at the same time
#pragma once

#include "algo/delaunay.h"
#include "algo/movement.h"

namespace dm {

enum class Verdict { flip, kept, guarded, unflippable };
struct Judgement {
    Verdict verdict;
    FreeFlip free; // in place: what the flip does to the surface
};

// Two vertices, the smaller first.
struct VertexPair {
    VertexPair(int32_t x, int32_t y) : a(x < y ? x : y), b(x < y ? y : x) {}
    friend bool operator<(const VertexPair& x, const VertexPair& y) { return x.a != y.a ? x.a < y.a : x.b < y.b; }
    friend bool operator==(const VertexPair& x, const VertexPair& y) { return x.a == y.a && x.b == y.b; }
    int32_t a, b;
};

class Loop {
public:
    struct Entry {
        double excess; // grows with how far the edge is from Delaunay
        int32_t corner, p, q;
    };

    Loop(Context& context, Surface& surface, FlatPatches* patches, const DelaunayRules& rules, delmesh_remesh_report& report);
    Status run();

private:
    friend class Parts;
    friend class FlipParts;

    // -- delaunay.cpp
    Status find_nld();
    Status drain(); // flips and splits until no edge is NLD
    bool is_nld(int32_t c) const;
    Entry entry(int32_t c) const;
    bool still_nld(const Entry& e) const { return s.vert(e.corner) == e.p && s.head(e.corner) == e.q && is_nld(e.corner); }
    void ask_for_next(const Array<Entry>& heap) const;
    void look_at(int32_t c);
    void look_at_face(int32_t f);
    void look_at_faces_of(int32_t v);
    bool needs_too_many() const;
    Judgement judge(int32_t c) const;
    bool turns_little(int32_t p, int32_t q, int32_t u, int32_t v) const;
    void do_flip(int32_t c, const FreeFlip& free);
    Status do_split(int32_t c, Verdict verdict);
    double spare_for_rounding(int32_t c) const;
    bool fits(int32_t c, const Vec3& x) const;
    void commit_split(int32_t c, const SplitVertex& where, const Vec3& position, Verdict verdict);
    void spread(int32_t from, int32_t to);
    void count_unflippable(int32_t c);

    void defer(const Entry& e);
    bool has_room() const;
    Status tick(double fraction); // progress and cancel

    // -- make_room.cpp
    bool make_room(int32_t c);
    bool make_room_inside(int32_t c);
    bool melt(int32_t c);
    bool merge_apexes(int32_t c);
    void look_at_changed(int32_t first_copy);
    void drop_bubbles(const Vec3& place);
    bool is_covered(double moved);
    bool remove_ears(int32_t c);
    bool remove_ear(int32_t c);
    void raise(int32_t face, double moved);
    void raise_beyond(int32_t c, double moved);
    bool collapse(int32_t c);

    // -- parts.cpp
    Status run_parts();
    Status flip_parts(); // where all edges may be flipped

    // -- fewest.cpp
    static constexpr int64_t kMostTaken = 13; // vertices that a trial takes out together
    struct Line { // a split vertex's neighbours on its carrier, and the corners that lead there (-1: a boundary edge arrives)
        int32_t back, ahead, to_back, to_ahead;
    };
    bool shrinks() const { return rules.effort > 0 && patches != nullptr && !rules.shells; }
    int32_t search_rounds() const;
    bool wanders() const { return rules.effort > 1 || share == 1; } // share is 1 where there were no parts
    Status need_fewer();
    void add_own(int32_t v) {
        if (!s.is_part() || own.room() > 0) own.push_back(v);
    }
    void tidy_own();
    Status take_out_needless();
    void begin_search(int32_t round);
    Status search(int64_t most); // trials
    Status try_without(const Array<int32_t>& vertices, int64_t most, bool& kept);
    void gather_region(int32_t v, int64_t most);
    void remember_nld();
    int64_t slot_of(const VertexPair& edge) const;
    bool is_in_excess(int32_t v) const;
    bool is_centre(int32_t v) const;
    void drop_centre(int64_t i);
    bool find_line(int32_t v, Line& line) const;
    template <class Visit>
    void for_spokes(int32_t v, const Line& line, Visit&& visit) const;
    bool is_needless(int32_t v) const;
    bool take_out(int32_t v);
    bool merge_pieces(int32_t v, const Line& line);
    int64_t random_below(int64_t end);
    double random_unit() { return static_cast<double>(random_below(int64_t{1} << 52)) * 0x1p-52; }

    Context& context;
    Surface& s;
    FlatPatches* patches; // null where every edge that is not kept may be flipped
    const DelaunayRules& rules;
    delmesh_remesh_report& report;
    Array<Entry> ready, blocked;
    Array<int32_t> pieces;
    Array<int32_t> around, bubble; // faces
    Array<int32_t> cluster;
    Array<Vec3> places;
    FlatPatches own_patches;     // for the flip modes, when their split budget is spent
    bool splitting = false;      // the first vertex has been added
    int64_t flips_at_sweep = -1; // how many there were when all blocked edges were last looked at again
    bool in_need = false;        // the edge at hand has no room for a vertex
    struct {
        bool running = false, failed = false;
        int64_t splits_left = 0;
    } trial;
    Array<int32_t> trial_made; // split vertices
    struct Centre {
        int32_t vert, failures; // of trials around it
    };
    Array<Centre> centres; // of the search
    Array<int32_t> region;
    Array<VertexPair> nld_at_start; // a hash table; a part's is another name for the whole's
    Array<int32_t> own;             // split vertices that this loop made and may take out, some perhaps twice or gone
    double share = 1;               // of the NLD edges of the mesh
    uint64_t random_state = 0;
    int32_t round = 0; // of the search
    int64_t trials = 0, trials_left = 0;
    int64_t steps_left = 0; // a part's, before the host hears of it
    Array<Entry> deferred;  // a part's: edges that are not all its own
};
bool operator<(const Loop::Entry& a, const Loop::Entry& b);

} // namespace dm
