/* SPDX-License-Identifier: Apache-2.0
 *
 * geometry-central, single-threaded, in floating point with its own tolerances, no certificate:
 *   fixDelaunay   extrinsic: flips the surface mesh itself, unless the opposing edge exists. Compares angles in float, so that
 *                 ties are flipped to and fro; gives up after 100 flips for each vertex.
 *   simple        intrinsic, edge lengths only: the result cannot be put back onto the surface. Closed meshes only.
 *   signpost      intrinsic, and knows how its edges run over the input (by directions, in floating point).
 *   integer       the same with normal coordinates, which are integers.
 * The intrinsic ones deliver no surface mesh: to get one, the input edges have to be cut along the result.
 */
#include "peers.h"

#include <geometrycentral/surface/integer_coordinates_intrinsic_triangulation.h>
#include <geometrycentral/surface/remeshing.h>
#include <geometrycentral/surface/signpost_intrinsic_triangulation.h>
#include <geometrycentral/surface/simple_idt.h>
#include <geometrycentral/surface/surface_mesh_factories.h>

namespace gc = geometrycentral;
namespace gcs = geometrycentral::surface;

namespace {

struct Shape {
    std::unique_ptr<gcs::ManifoldSurfaceMesh> mesh;
    std::unique_ptr<gcs::VertexPositionGeometry> geometry;
};

Shape make_shape(const Triangles& in) {
    std::vector<std::vector<size_t>> faces(size_t(in.face_count()));
    for (size_t f = 0; f < faces.size(); ++f) {
        const int32_t* v = &in.corners[3 * f];
        faces[f] = {size_t(v[0]), size_t(v[1]), size_t(v[2])};
    }
    std::vector<gc::Vector3> positions(size_t(in.vertex_count()));
    for (size_t v = 0; v < positions.size(); ++v) {
        const double* p = &in.positions[3 * v];
        positions[v] = {p[0], p[1], p[2]};
    }
    Shape shape;
    std::tie(shape.mesh, shape.geometry) = gcs::makeManifoldSurfaceMeshAndGeometry(faces, positions);
    return shape;
}

void deliver_lengths(gcs::SurfaceMesh& mesh, const gcs::EdgeData<double>& lengths, Answer& answer) {
    answer.corners.reserve(3 * mesh.nFaces());
    answer.lengths.reserve(3 * mesh.nFaces());
    answer.edges.reserve(3 * mesh.nFaces());
    for (gcs::Face f : mesh.faces())
        for (gcs::Halfedge h : f.adjacentHalfedges()) {
            answer.corners.push_back(int32_t(h.tailVertex().getIndex()));
            answer.lengths.push_back(lengths[h.edge()]);
            answer.edges.push_back(int32_t(h.edge().getIndex()));
        }
}

void fix_delaunay(const Triangles& in, Answer& answer) {
    Laps laps(answer);
    Shape shape = make_shape(in);
    laps.lap();
    answer.flips = int64_t(gcs::fixDelaunay(*shape.mesh, *shape.geometry));
    laps.lap();
    answer.positions.reserve(3 * shape.mesh->nVertices());
    for (gcs::Vertex v : shape.mesh->vertices()) {
        const gc::Vector3 p = shape.geometry->vertexPositions[v];
        answer.positions.insert(answer.positions.end(), {p.x, p.y, p.z});
    }
    answer.corners.reserve(3 * shape.mesh->nFaces());
    for (gcs::Face f : shape.mesh->faces())
        for (gcs::Vertex v : f.adjacentVertices()) answer.corners.push_back(int32_t(v.getIndex()));
    laps.lap();
}

void simple(const Triangles& in, Answer& answer) {
    Laps laps(answer);
    Shape shape = make_shape(in);
    if (shape.mesh->hasBoundary()) throw std::runtime_error("closed meshes only");
    laps.lap();
    shape.geometry->requireEdgeLengths();
    gcs::EdgeData<double> lengths = shape.geometry->edgeLengths;
    answer.flips = int64_t(gcs::flipToDelaunay(*shape.mesh, lengths));
    laps.lap();
    deliver_lengths(*shape.mesh, lengths, answer);
    laps.lap();
}

template <class Triangulation>
void intrinsic(const Triangles& in, Answer& answer) {
    Laps laps(answer);
    Shape shape = make_shape(in);
    laps.lap();
    Triangulation triangulation(*shape.mesh, *shape.geometry);
    int64_t flips = 0;
    if (answer.want_flips) triangulation.edgeFlipCallbackList.push_back([&](gcs::Edge) { ++flips; });
    triangulation.flipToDelaunay();
    if (answer.want_flips) answer.flips = flips;
    laps.lap();
    deliver_lengths(*triangulation.intrinsicMesh, triangulation.edgeLengths, answer);
    laps.lap();
}

} // namespace

void add_geometry_central(std::vector<Peer>& peers) {
    peers.push_back({"geometry-central fixDelaunay", false, fix_delaunay});
    peers.push_back({"geometry-central simple", true, simple});
    peers.push_back({"geometry-central signpost", true, intrinsic<gcs::SignpostIntrinsicTriangulation>});
    peers.push_back({"geometry-central integer", true, intrinsic<gcs::IntegerCoordinatesIntrinsicTriangulation>});
}
