// SPDX-License-Identifier: Apache-2.0
// Keeps an edited surface within a proven two-sided distance of the mesh it came from. Both halves of the proof are local, so that
// an edit is judged by what is around it:
//  - every live face of the surface is within the limit of the input: this depends on that face alone;
//  - every face of the input is within the limit of the surface faces it is linked to: a surface face knows its links, and where
//    it changes, the input faces at the other end are proven again.
// Proven means up to the rounding of float64 arithmetic, which is allowed for: deviation_guard.cpp says how.
#pragma once

#include "geom/bvh.h"
#include "mesh/surface.h"

namespace dm {

class DeviationGuard {
public:
    DeviationGuard(Context& context, const Surface& surface);

    // Associates the surface as it is with the input, which has to stay; its coordinates may have another precision. limit: in
    // model units. within: is that proven to hold now? If not, nothing else may be called but begin, which starts anew.
    // Progress goes from 0 to 1 of the stage.
    Status begin(const Mesh& in, double limit, bool& within);
    // The surface has changed: these faces (in any order, may repeat, may be dead now) changed or went away. Are the surfaces still
    // proven to be within the limit of each other? If so the books are brought up to date; if not, they are left as they were,
    // and the caller undoes the change. May allocate. The work is about that of visiting the faces of the input that are close to
    // the changed ones. A cancelled call is refused.
    bool accept(const Array<int32_t>& changed_faces);
    // No vertex at `place` can be part of a surface within the limit. A cheap look ahead. near: a live face that may be close.
    bool is_beyond(const Vec3& place, int32_t near) const;

private:
    struct Link {
        int32_t input;
        uint32_t version; // of the input face's links: an older one is void
        int32_t next;
    };
    struct NewLink {
        int32_t face, input;
    };
    using Corners = Bvh::Triangle;
    struct Candidate { // a surface face in question
        Corners corners;
        Vec3 centre;
        double reach_squared; // no point farther from the centre is within the limit
        int32_t face;
    };
    struct Mask { // of candidates
        uint64_t low, high;
        bool empty() const { return (low | high) == 0; }
        Mask operator&(const Mask& o) const { return {low & o.low, high & o.high}; }
        int32_t first() const { return low != 0 ? __builtin_ctzll(low) : 64 + __builtin_ctzll(high); }
    };
    static constexpr int kMostCandidates = 128;
    struct Place { // of a point over a face: coordinates in its plane, height, distances inside its three edges
        double x, y, height, inside[3];
        unsigned beyond; // bits: edges that it is clearly outside of
    };
    struct Prism;
    enum class Cover { covered, too_high, missed, open };
    // The two meshes as a walk over them sees them.
    struct InputSide;
    struct SurfaceSide;

    Corners corners_of(int32_t face) const;
    Corners input_corners(int32_t face) const;
    bool within(const Corners& piece, const Corners& target) const;
    bool within(const Vec3& p, const Corners& target) const;
    template <class Side>
    Cover flood(const Side& side, const Prism& prism, int32_t seed, Vec3& where);
    template <class Side, class IsFar>
    bool cover_by_flood(const Side& side, const Corners& triangle, int32_t seed, IsFar&& is_far);
    template <class Found>
    bool cover_by_pieces(const Corners& triangle, const Bvh& to, int32_t near, int64_t most, Found&& found);

    bool add_candidate(int32_t face);
    void add_ring(int32_t fresh);
    Mask mask_of(const Vec3& p) const;
    int32_t nearest_candidate(const Vec3& p) const;
    Mask mask_of_vertex(int32_t v);
    bool prove_input_face(int32_t input);
    void link_used(int32_t input, const Mask& used);
    bool prove_surface_face(int32_t face, int64_t most_pieces);
    void add_link(const NewLink& link);
    void drop_links(int32_t face);
    void forget_stamps();
    Status find_first_links(const Bvh& surface_bvh, const Array<int32_t>& numbers, bool& within);

    Context& context_;
    const Surface& s_;
    const Mesh* in_ = nullptr;
    Frame frame_{Box{}};
    double near_ = 0, near_squared_ = 0; // the limit in the frame, without what rounding may take
    Bvh bvh_;                            // of the input
    Array<Vec3> points_;                 // of the input, in the frame
    Array<uint32_t> versions_;           // per input face
    Array<int32_t> first_link_;          // per surface face
    Array<int32_t> hints_;               // per surface face: a triangle of bvh_ that is close
    Array<Link> links_;
    int32_t free_link_ = -1;

    // Scratch. What carries the current stamp has been met.
    uint32_t stamp_ = 0;
    Array<uint32_t> input_stamps_, vert_stamps_, face_stamps_;
    Array<int32_t> mask_slots_; // per input vertex that carries the mask stamp
    Array<Mask> masks_;
    uint32_t mask_stamp_ = 0;
    Array<int32_t> changed_, inputs_, met_;
    Array<NewLink> new_links_;
    Array<Candidate> candidates_;
    int32_t fresh_hint_ = 0;
};

} // namespace dm
