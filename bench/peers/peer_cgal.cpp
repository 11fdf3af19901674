/* SPDX-License-Identifier: Apache-2.0
 *
 * CGAL, single-threaded, no certificate:
 *   flip loop   extrinsic. CGAL has no such function, so this is the loop that one would write with it: Surface_mesh,
 *               Euler::flip_edge, delmesh's test in plain floating point with a small tolerance, no flip where the opposing edge
 *               exists.
 *   intrinsic   Heat_method_3's Intrinsic_Delaunay_triangulation_3: edge lengths and, per face, the corners in the plane. Delivers
 *               no surface mesh. Where a face has no area, all edges are made longer first.
 * Both packages used here are under the GPL: a program that is linked with them is for measuring, not for giving away under
 * another licence.
 */
#include "peers.h"

#include <CGAL/Heat_method_3/internal/Intrinsic_Delaunay_triangulation_3.h>
#include <CGAL/Simple_cartesian.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/boost/graph/Euler_operations.h>
#include <cmath>
#include <stdexcept>

namespace {

using Kernel = CGAL::Simple_cartesian<double>;
using Point = Kernel::Point_3;
using Vector = Kernel::Vector_3;
using Mesh = CGAL::Surface_mesh<Point>;
using Vertex = Mesh::Vertex_index;
using Halfedge = Mesh::Halfedge_index;
using Edge = Mesh::Edge_index;

Mesh make_mesh(const Triangles& in) {
    Mesh mesh;
    mesh.reserve(Mesh::size_type(in.vertex_count()), Mesh::size_type(in.edge_count), Mesh::size_type(in.face_count()));
    for (size_t v = 0; v < in.positions.size(); v += 3)
        mesh.add_vertex(Point(in.positions[v], in.positions[v + 1], in.positions[v + 2]));
    for (size_t c = 0; c < in.corners.size(); c += 3)
        if (mesh.add_face(Vertex(Mesh::size_type(in.corners[c])), Vertex(Mesh::size_type(in.corners[c + 1])),
                          Vertex(Mesh::size_type(in.corners[c + 2]))) == Mesh::null_face())
            throw std::runtime_error("add_face refused a face");
    return mesh;
}

/* The angles opposite to the edge add up to more than 180 degrees, by more than rounding. */
bool is_nld(const Mesh& mesh, Halfedge h) {
    const Halfedge o = mesh.opposite(h);
    const Point &a = mesh.point(mesh.source(h)), &b = mesh.point(mesh.target(h));
    const Point &p = mesh.point(mesh.target(mesh.next(h))), &q = mesh.point(mesh.target(mesh.next(o)));
    const Vector u1 = a - p, v1 = b - p, u2 = a - q, v2 = b - q;
    const double d1 = u1 * v1, d2 = u2 * v2;
    if (d1 >= 0 && d2 >= 0) return false;
    const double s1 = std::sqrt(CGAL::cross_product(u1, v1).squared_length());
    const double s2 = std::sqrt(CGAL::cross_product(u2, v2).squared_length());
    return s1 * d2 + s2 * d1 < -1e-14 * (s1 + std::abs(d1)) * (s2 + std::abs(d2));
}

void flip_loop(const Triangles& in, Answer& answer) {
    Laps laps(answer);
    Mesh mesh = make_mesh(in);
    laps.lap();

    std::vector<char> waits(mesh.number_of_edges(), 1);
    std::vector<Edge> stack(mesh.edges().begin(), mesh.edges().end());
    const int64_t limit = 100 * in.vertex_count(); /* rounding could make it go round in circles */
    answer.flips = 0;
    while (!stack.empty() && answer.flips < limit) {
        const Edge e = stack.back();
        stack.pop_back();
        waits[e] = 0;
        const Halfedge h = mesh.halfedge(e), o = mesh.opposite(h);
        if (mesh.is_border(h) || mesh.is_border(o) || !is_nld(mesh, h)) continue;
        if (mesh.halfedge(mesh.target(mesh.next(h)), mesh.target(mesh.next(o))) != Mesh::null_halfedge()) continue;
        CGAL::Euler::flip_edge(h, mesh);
        ++answer.flips;
        for (const Halfedge side : {mesh.next(h), mesh.prev(h), mesh.next(o), mesh.prev(o)}) {
            const Edge neighbour = mesh.edge(side);
            if (waits[neighbour]) continue;
            waits[neighbour] = 1;
            stack.push_back(neighbour);
        }
    }
    laps.lap();

    answer.positions.reserve(3 * mesh.number_of_vertices());
    for (const Vertex v : mesh.vertices()) {
        const Point& p = mesh.point(v);
        answer.positions.insert(answer.positions.end(), {p.x(), p.y(), p.z()});
    }
    answer.corners.reserve(3 * mesh.number_of_faces());
    for (const auto f : mesh.faces())
        for (const Vertex v : mesh.vertices_around_face(mesh.halfedge(f))) answer.corners.push_back(int32_t(v.idx()));
    laps.lap();
}

void intrinsic(const Triangles& in, Answer& answer) {
    Laps laps(answer);
    const Mesh mesh = make_mesh(in);
    laps.lap();
    const CGAL::Heat_method_3::Intrinsic_Delaunay_triangulation_3<Mesh> triangulation(mesh);
    laps.lap();
    const Mesh& result = triangulation.triangle_mesh();
    const auto& places = triangulation.hcmap();
    answer.corners.reserve(3 * result.number_of_faces());
    answer.lengths.reserve(3 * result.number_of_faces());
    answer.edges.reserve(3 * result.number_of_faces());
    for (const auto f : result.faces())
        for (const Halfedge h : result.halfedges_around_face(result.halfedge(f))) {
            const auto a = get(places, result.prev(h)), b = get(places, h);
            answer.corners.push_back(int32_t(result.source(h).idx()));
            answer.lengths.push_back(std::hypot(b.first - a.first, b.second - a.second));
            answer.edges.push_back(int32_t(result.edge(h).idx()));
        }
    laps.lap();
}

} // namespace

void add_cgal(std::vector<Peer>& peers) {
    peers.push_back({"CGAL flip loop", false, flip_loop});
    peers.push_back({"CGAL intrinsic", true, intrinsic});
}
