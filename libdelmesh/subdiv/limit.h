// SPDX-License-Identifier: Apache-2.0
// The limit surface of a cage, face by face. What evaluates it is OpenSubdiv, of which nothing shows here; without it
// (limit_none.cpp) there is no Limit to be had.
#pragma once

#include "base/context.h"
#include "mesh/mesh.h"

namespace dm {

class Cage;

struct CageRules { // the values of delmesh.h
    int32_t scheme, boundary, face_varying, creasing, smooth_triangles;
};

// How faces of one size are cut at a rate: points first along the boundary, from corner 0 on and counter-clockwise, `rate` per
// edge; then those inside.
struct FacePattern {
    explicit FacePattern(Memory& memory) : places(memory), facets(memory) {}
    Array<float> places;   // 2 per point
    Array<int32_t> facets; // 4 per facet, the last -1 for triangles
};

class Limit {
public:
    Limit() = default;
    ~Limit();
    Limit(const Limit&) = delete;
    Limit& operator=(const Limit&) = delete;

    // The cage must outlive it; all but its `limit` is made.
    Status build(Context& context, const Cage& cage);
    bool has_face(int32_t f) const; // false for holes, and for faces that have no limit surface
    struct Counts {
        int64_t points, triangles;
    };
    Counts count(int32_t face_size, int32_t rate) const; // of a pattern
    void cut(int32_t face_size, int32_t rate, FacePattern& pattern) const;

    struct Made;
    const Made& made() const { return *made_; }

private:
    Made* made_ = nullptr;
};

// Evaluates face after face; each thread has one of its own. Allocates from the C++ runtime.
class LimitEvaluator {
public:
    static constexpr int32_t kMostComponents = 16;

    explicit LimitEvaluator(const Limit& limit);
    ~LimitEvaluator();
    LimitEvaluator(const LimitEvaluator&) = delete;
    LimitEvaluator& operator=(const LimitEvaluator&) = delete;

    // Goes to a face that the limit has. channel: of a face-varying layer; -1: what is smooth as positions are.
    void face(int32_t f, int32_t channel);
    // Takes the values to evaluate there, of the whole cage, `components` numbers each.
    void take(const double* values, int32_t components);
    // The limit at a place of the face, and the derivatives by OpenSubdiv's (s, t).
    void at(float s, float t, double* value);
    void at(float s, float t, double* value, double* ds, double* dt);

private:
    struct Made;
    Made* made_;
};

// Uniform refinement, and its limit points.
struct RefinedCage {
    explicit RefinedCage(Memory& memory)
        : positions(memory), face_verts(memory), places(memory), corner_edge(memory), face_source(memory) {}
    int32_t face_size = 0;      // 4, or 3 for Loop
    Array<double> positions;    // 3 per vertex
    Array<int32_t> face_verts;  // face_size per face
    Array<float> places;        // 2 per corner
    Array<int32_t> corner_edge; // per corner: the cage's edge (as Cage numbers them) that the corner's edge is a piece of, or -1
    Array<int32_t> face_source; // the face of the cage
};
Status refine_cage(Context& context, const Cage& cage, int32_t levels, RefinedCage& out);

// n-gons ----------------------------------------------------------------------------------------------------------------------

// A place of a regular n-gon (delmesh.h) as a sub-face, of the corner that is nearest, and (u, v) in it: (0, 0) is the corner,
// (1, 0) the middle of the edge that begins there, (1, 1) the center.
struct SubFacePlace {
    int32_t corner;
    double u, v;
};
SubFacePlace sub_face_of(int32_t face_size, double x, double y);
void place_of(int32_t face_size, const SubFacePlace& place, double& x, double& y);

} // namespace dm
