// SPDX-License-Identifier: Apache-2.0
// What `preserve` knows of the surface: where flips are free, and how far each face has come from the input.
//
// A patch is a connected set of faces that lie in one plane, exactly or within a tolerance, grown from a seed face while every
// vertex stays within a slab and no face turns its back on the seed. Whatever the triangulation inside, as long as it covers the
// same outline without folding, both surfaces lie in the same slab over the same outline: they are at most the slab's thickness
// apart, and flips do not accumulate. Patches are decided once, before anything is split, so the rounding of split points changes
// nothing about them; the pieces of a face inherit its patch. Most faces have no neighbour in their plane; for these nothing is
// stored but their number.
//
// A region is what flips outside of patches have made of a few faces. It remembers these faces as they were (its reference), so
// that its distance from the input can be measured anew instead of added up: movement.h.
#pragma once

#include "algo/affine_layers.h"
#include "mesh/surface.h"

namespace dm {

class FlatPatches {
public:
    explicit FlatPatches(Memory& memory)
        : face_patch(memory), drift(memory), planes(memory), regions(memory), triangles(memory), face_changes(memory),
          region_changes(memory) {}

    struct Triangle {
        Vec3 corner[3];
    };
    struct Region {
        int32_t parent = -1;           // the region that this one has become a part of
        int32_t left = -1, right = -1; // the two that became this one, or
        int32_t triangle = -1;         // its one triangle
        int32_t size = 0;              // triangles of the reference; 0: no longer known, since faces have left
        bool measured = false;         // height was found along the perpendiculars to the reference as a whole
        double base = 0;               // how far the reference may be from the input
        double height = 0;             // how far the faces may be from the reference
        double moved() const { return base + height; }
    };

    // Proven two-sided distance of what a face belongs to now from the input, the rounding of split points aside.
    double moved(int32_t face) const { return drift[face] + moved_with_its_patch(face); }
    double own_drift(int32_t face) const { return drift[face]; } // besides what it moved with its patch or region
    void ask_for(int32_t face) const {                           // of memory, which takes time
        __builtin_prefetch(face_patch.data() + face);
        __builtin_prefetch(drift.data() + face);
    }
    // Do both lie in one plane, so that a flip between them is free as long as no new face turns its back on it?
    bool together(int32_t f, int32_t g) const { return (face_patch[f] | kFlipped) == (face_patch[g] | kFlipped); }
    // Perpendicular to the plane of two faces that lie in one.
    Vec3 normal(const Surface& surface, int32_t f, int32_t g) const;
    int32_t region_of(int32_t face) const { // -1: none
        if (is_alone(face)) return -1;
        int32_t r = planes[plane_of(face)].region;
        if (r >= 0)
            while (regions[r].parent >= 0) r = regions[r].parent;
        return r;
    }
    const Region& region(int32_t r) const { return regions[r]; }
    const Triangle& triangle(const Region& r) const { return triangles[r.triangle]; }

    // -- edits
    // The face has come to stand for a part of the surface that is up to `new_moved` away from it.
    void raise(int32_t face, double new_moved);
    // The face leaves its patch for one of its own.
    void own(const Surface& surface, int32_t face, double new_moved);
    // A piece of `from` was split off as face `to`.
    void spread(int32_t from, int32_t to);
    // Two faces of one plane were flipped. Pieces of one face of the input stay in that face.
    void mix(int32_t f, int32_t g, bool same_source);
    // Two faces of one plane became one: `face` swallowed `gone`.
    void merge(int32_t face, int32_t gone);
    // `face`, which had no area, was flipped with `other` and lies in its plane now.
    void follow(int32_t face, int32_t other);
    // Regions. A leaf is a face as it was before it was first flipped.
    int32_t add_leaf(const Triangle& triangle, double base);
    int32_t unite(int32_t a, int32_t b);
    void set_moved(int32_t r, double base, double height, bool measured);
    void forget_reference(int32_t r); // faces leave it: from here on it is a bound for the rest, and no more
    void enter(const Surface& surface, int32_t face, int32_t r);

    // -- trials, as of the Surface
    void begin_trial();
    void keep_trial();
    void undo_trial();

    class TrialLog;
    void swap_log(TrialLog& log);

    // -- parts, as of the Surface: the same arrays, numbers of its own for what it adds. There are no regions before there are
    // parts, and those that a part makes are of faces that belong to it alone.
    struct Share {
        using Range = Surface::Range;
        Range planes, regions, triangles;
        // The first so many flips' part of it, and the rest.
        Share first(int32_t flips) const {
            return {cut(planes, 0, 2 * flips), cut(regions, 0, 3 * flips), cut(triangles, 0, 2 * flips)};
        }
        Share after(int32_t flips) const {
            return {cut(planes, 2 * flips, planes.end - planes.next), cut(regions, 3 * flips, regions.end - regions.next),
                    cut(triangles, 2 * flips, triangles.end - triangles.next)};
        }
        static Range cut(const Range& r, int32_t from, int32_t to) { return {r.next + from, r.next + to}; }
    };
    explicit FlatPatches(FlatPatches& whole);
    // Room for the faces that the surface has now, and for what so many flips that move the surface add.
    Share grow_blank(const Surface& surface, int32_t flips);
    void refresh(FlatPatches& whole);
    void supply(const Share& share);
    bool has_room() const; // for one more edit, and in a trial for what it overwrites

    void free_storage();

private:
    friend Status grow_flat_patches(Context&, const Surface&, double, AffineLayers*, FlatPatches&);
    struct Plane {
        Vec3 normal;      // unit length (zero for a face without area)
        double thickness; // of the slab that holds the patch's faces as given
        int32_t region;   // that its faces belong to, or -1
    };
    struct FaceChange {
        int32_t face, patch;
        double drift;
    };
    struct RegionChange {
        int32_t number;
        Region before;
    };

    // An array that grows at its end; in a part it has its length from the start, and numbers are given out from a range.
    template <class T>
    struct Pool {
        explicit Pool(Memory& memory) : items(memory) {}
        explicit Pool(Pool& whole) : items(Array<T>::alias(whole.items)), is_part(true) {}
        int32_t add(const T& item) {
            if (is_part)
                items[own.next] = item;
            else
                items.push_back(item);
            return is_part ? own.next++ : static_cast<int32_t>(items.size() - 1);
        }
        Share::Range grow(int32_t count, const T& blank) {
            const int32_t first = static_cast<int32_t>(items.size());
            items.resize(first + count, blank);
            return {first, first + count};
        }
        bool has_room(int32_t count) const { return own.next + count <= own.end; }
        int64_t end() const { return is_part ? own.next : items.size(); }
        void cut(int64_t end) {
            if (is_part)
                own.next = static_cast<int32_t>(end);
            else
                items.resize_uninitialized(end);
        }
        T& operator[](int64_t i) { return items[i]; }
        const T& operator[](int64_t i) const { return items[i]; }

        Array<T> items;
        Share::Range own{0, 0};
        bool is_part = false;
    };

    // A face's patch: twice the number of its plane, + 1 once it was flipped there; alone in its plane, a negative number that
    // only its pieces share.
    static constexpr int32_t kFlipped = 1;
    static int32_t alone(int32_t face) { return -2 * face - 1; }
    bool is_alone(int32_t face) const { return face_patch[face] < 0; }
    int32_t plane_of(int32_t face) const { return face_patch[face] >> 1; }
    double moved_with_its_patch(int32_t face) const {
        if (is_alone(face)) return 0;
        const int32_t r = region_of(face);
        return r >= 0 ? regions[r].moved() : (face_patch[face] & kFlipped) != 0 ? planes[plane_of(face)].thickness : 0;
    }
    void set(int32_t face, int32_t patch, double new_drift);
    Region& change(int32_t r);

    Array<int32_t> face_patch;
    Array<double> drift; // besides moved_with_its_patch()
    Pool<Plane> planes;
    Pool<Region> regions;
    Pool<Triangle> triangles;

    bool in_trial = false, is_part = false;
    Array<FaceChange> face_changes; // what a trial overwrote
    Array<RegionChange> region_changes;
    int64_t faces_before = 0, planes_before = 0, regions_before = 0, triangles_before = 0;
};

class FlatPatches::TrialLog {
public:
    explicit TrialLog(Memory& memory) : face_changes(memory), region_changes(memory) {
        face_changes.reserve(8192);
        region_changes.reserve(1024);
    }

private:
    friend class FlatPatches;
    Array<FaceChange> face_changes;
    Array<RegionChange> region_changes;
};

// thickness: of the slab, parallel to the seed, that may hold a patch; 0: exactly coplanar neighbours only.
// Kept edges are not crossed. layers: null, or those whose texture is to lie on a patch as on its seed; the surface is not edited yet.
Status grow_flat_patches(Context& context, const Surface& surface, double thickness, AffineLayers* layers, FlatPatches& out);

} // namespace dm
