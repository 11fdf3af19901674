// SPDX-License-Identifier: Apache-2.0
#include "subdiv/limit_osd.h"

#include <opensubdiv/far/primvarRefiner.h>

namespace dm {
namespace {

struct Point {
    double at[3];
    void Clear(void* = nullptr) { at[0] = at[1] = at[2] = 0; }
    void AddWithWeight(const Point& other, double weight) {
        for (int k = 0; k < 3; ++k) at[k] += weight * other.at[k];
    }
};

// The place of each corner of a level's faces; those of the cage's own faces that are no n-gons are what they are.
class Places {
public:
    Places(Memory& memory, bool triangles) : faces(memory), size_(triangles ? 3 : 4) {}

    struct Face {
        int32_t source, corner; // corner: of an n-gon, whose sub-face the places are in; -1: of no n-gon
        double at[4][2];
    };
    Array<Face> faces;

    void begin(const Cage& cage) {
        for (int32_t f = 0; f < cage.faces(); ++f) {
            const bool regular = cage.face_size(f) == size_;
            faces.push_back({f, -1, {{0, 0}, {1, 0}, {size_ == 3 ? 0.0 : 1.0, 1}, {0, 1}}});
            if (!regular) faces.back().corner = cage.face_size(f); // not yet a corner's
        }
    }
    // From the faces of a level to those of the next.
    Status descend(Context& context, const Osd::Far::TopologyLevel& level, int32_t children) {
        Array<Face> next(context.memory());
        next.resize_uninitialized(children);
        for (int32_t f = 0; f < level.GetNumFaces(); ++f) {
            if (f % (1 << 14) == 0) DM_TRY(context.progress(0.5));
            const Face& parent = faces[f];
            const auto child = level.GetFaceChildFaces(f);
            const bool n_gon = level.GetFaceVertices(f).size() != size_;
            for (int32_t i = 0; i < child.size(); ++i) {
                if (child[i] < 0) continue;
                Face& made = next[child[i]];
                made = parent;
                if (n_gon) {
                    made.corner = i;
                    const double square[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
                    std::memcpy(made.at, square, sizeof square);
                    continue;
                }
                for (int32_t k = 0; k < size_; ++k)
                    for (int32_t j = 0; j < 2; ++j)
                        made.at[k][j] = size_ == 4 ? quad(parent, i, k, j) : triangle(parent, i, k, j);
            }
        }
        std::swap(faces, next);
        return DELMESH_OK;
    }

private:
    // Child i of a quad has the quad's corner i for its own, and the center opposite to it. The weights of the quad's corners:
    static double quad(const Face& parent, int32_t child, int32_t k, int32_t j) {
        const int32_t away = (k - child + 4) % 4;
        if (away == 2) return (parent.at[0][j] + parent.at[1][j] + parent.at[2][j] + parent.at[3][j]) / 4;
        return (parent.at[child][j] + parent.at[k][j]) / 2;
    }
    // Child 3 of a triangle is that in the middle, whose corner k is on the edge opposite to the triangle's corner k.
    static double triangle(const Face& parent, int32_t child, int32_t k, int32_t j) {
        if (child == 3) return (parent.at[(k + 1) % 3][j] + parent.at[(k + 2) % 3][j]) / 2;
        return (parent.at[child][j] + parent.at[k][j]) / 2;
    }

    const int32_t size_;
};

} // namespace

Status refine_cage(Context& context, const Cage& cage, int32_t levels, RefinedCage& out) {
    using namespace Osd::Far;
    const std::unique_ptr<TopologyRefiner> refiner(
        TopologyRefinerFactory<TopologyDescriptor>::Create(*cage.limit.made().refiner));
    TopologyRefiner::UniformOptions options(levels);
    options.fullTopologyInLastLevel = true; // which limit points need
    refiner->RefineUniform(options);
    DM_TRY(context.progress(0.3));

    Memory& memory = context.memory();
    Array<Point> coarse(memory), fine(memory);
    coarse.resize_uninitialized(cage.vertices());
    std::memcpy(coarse.data(), cage.positions.data(), static_cast<size_t>(cage.positions.size()) * sizeof(double));
    const PrimvarRefinerReal<double> values(*refiner);
    Places places(memory, cage.rules.scheme == DELMESH_SCHEME_LOOP);
    places.begin(cage);
    Array<int32_t> edge_of(memory), next_edge(memory); // per edge of a level: that of the cage, or -1
    const TopologyLevel& base = refiner->GetLevel(0);
    edge_of.assign(base.GetNumEdges(), -1);
    for (int32_t f = 0; f < cage.faces(); ++f) {
        const auto edges = base.GetFaceEdges(f);
        for (int32_t k = 0; k < edges.size(); ++k) edge_of[edges[k]] = cage.corner_edge[cage.face_first[f] + k];
    }
    for (int32_t level = 1; level <= levels; ++level) {
        const TopologyLevel &parent = refiner->GetLevel(level - 1), &child = refiner->GetLevel(level);
        fine.resize_uninitialized(child.GetNumVertices());
        Point *const from = coarse.data(), *to = fine.data();
        values.Interpolate(level, from, to);
        std::swap(coarse, fine);
        next_edge.assign(child.GetNumEdges(), -1);
        for (int32_t e = 0; e < parent.GetNumEdges(); ++e)
            for (const int32_t half : parent.GetEdgeChildEdges(e))
                if (half >= 0) next_edge[half] = edge_of[e];
        std::swap(edge_of, next_edge);
        DM_TRY(places.descend(context, parent, child.GetNumFaces()));
        DM_TRY(context.progress(0.3 + 0.4 * level / levels));
    }
    const TopologyLevel& last = refiner->GetLevel(levels);
    fine.resize_uninitialized(last.GetNumVertices());
    Point *const from = coarse.data(), *to = fine.data();
    values.Limit(from, to);
    out.positions.resize_uninitialized(3 * fine.size());
    std::memcpy(out.positions.data(), fine.data(), static_cast<size_t>(out.positions.size()) * sizeof(double));

    out.face_size = cage.rules.scheme == DELMESH_SCHEME_LOOP ? 3 : 4;
    for (int32_t f = 0; f < last.GetNumFaces(); ++f) {
        const Places::Face& face = places.faces[f];
        if (!cage.limit.has_face(face.source)) continue;
        const auto verts = last.GetFaceVertices(f);
        const auto edges = last.GetFaceEdges(f);
        for (int32_t k = 0; k < out.face_size; ++k) {
            double place[2] = {face.at[k][0], face.at[k][1]};
            if (face.corner >= 0)
                place_of(cage.face_size(face.source), {face.corner, face.at[k][0], face.at[k][1]}, place[0], place[1]);
            out.face_verts.push_back(verts[k]);
            out.places.push_back(static_cast<float>(place[0]));
            out.places.push_back(static_cast<float>(place[1]));
            out.corner_edge.push_back(edge_of[edges[k]]);
        }
        out.face_source.push_back(face.source);
    }
    return DELMESH_OK;
}

} // namespace dm
