/* SPDX-License-Identifier: Apache-2.0
 *
 * libigl's intrinsic_delaunay_triangulation, single-threaded, in floating point without tolerance, no certificate: edge lengths
 * only, so that the result cannot be put back onto the surface.
 */
#include "peers.h"

#include <igl/edge_lengths.h>
#include <igl/intrinsic_delaunay_triangulation.h>

namespace {

void run(const Triangles& in, Answer& answer) {
    Laps laps(answer);
    using Rows3d = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;
    using Rows3i = Eigen::Matrix<int, Eigen::Dynamic, 3, Eigen::RowMajor>;
    const Eigen::MatrixXd V = Eigen::Map<const Rows3d>(in.positions.data(), in.vertex_count(), 3);
    const Eigen::MatrixXi F = Eigen::Map<const Rows3i>(in.corners.data(), in.face_count(), 3);
    laps.lap();

    Eigen::MatrixXd input_lengths, lengths;
    Eigen::MatrixXi faces, directed, unique;
    Eigen::VectorXi edge_of;
    std::vector<std::vector<int>> directed_of;
    igl::edge_lengths(V, F, input_lengths);
    igl::intrinsic_delaunay_triangulation(input_lengths, F, lengths, faces, directed, unique, edge_of, directed_of);
    laps.lap();

    const size_t count = size_t(faces.rows());
    answer.corners.resize(3 * count);
    answer.lengths.resize(3 * count);
    answer.edges.resize(3 * count);
    for (size_t f = 0; f < count; ++f)
        for (size_t k = 0; k < 3; ++k) {
            const Eigen::Index row = Eigen::Index(f),
                               opposite = Eigen::Index((k + 2) % 3); /* it numbers edges by the vertex opposite */
            answer.corners[3 * f + k] = faces(row, Eigen::Index(k));
            answer.lengths[3 * f + k] = lengths(row, opposite);
            answer.edges[3 * f + k] = edge_of(row + Eigen::Index(count) * opposite);
        }
    laps.lap();
}

} // namespace

void add_libigl(std::vector<Peer>& peers) {
    peers.push_back({"libigl intrinsic", true, run});
}
