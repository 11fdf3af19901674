/* SPDX-License-Identifier: Apache-2.0
 *
 * delmesh: extrinsic flips, decided exactly. It does more than is asked of the others: import does not trust the arrays
 * (manifold, oriented, in range), what cannot be flipped is split, faces without area are taken out, and the result is certified;
 * none of this can be turned off. Boundary edges are ignored here, as all the others ignore them. Float64 in and out, as the
 * others have it.
 */
#include "peers.h"

#include <delmesh/delmesh.h>
#include <memory>
#include <stdexcept>

namespace {

struct Deleter {
    void operator()(delmesh_context* context) const { delmesh_context_destroy(context); }
    void operator()(delmesh_mesh* mesh) const { delmesh_mesh_destroy(mesh); }
};
using Context = std::unique_ptr<delmesh_context, Deleter>;
using Mesh = std::unique_ptr<delmesh_mesh, Deleter>;

void check(const Context& context, int32_t status) {
    if (status != DELMESH_OK) throw std::runtime_error(delmesh_last_error(context.get()));
}

void run(const Triangles& in, Answer& answer, int threads) {
    Laps laps(answer);
    delmesh_context_options context_options;
    delmesh_context_options_init(&context_options, sizeof context_options);
    context_options.max_threads = threads;
    delmesh_context* made = nullptr;
    if (delmesh_context_create(&context_options, &made) != DELMESH_OK) throw std::runtime_error("no context");
    const Context context(made);

    delmesh_mesh_desc desc;
    delmesh_mesh_desc_init(&desc, sizeof desc);
    desc.positions = {in.positions.data(), in.vertex_count(), 0, DELMESH_FLOAT64, 3};
    desc.corner_verts = {in.corners.data(), 3 * in.face_count(), 0, DELMESH_INT32, 1};
    delmesh_mesh* mesh = nullptr;
    check(context, delmesh_mesh_create(context.get(), &desc, &mesh));
    const Mesh input(mesh);
    laps.lap();

    delmesh_remesh_options options;
    delmesh_remesh_options_init(&options, sizeof options);
    options.mode = DELMESH_MODE_FLIP;
    options.precision = DELMESH_FLOAT64;
    options.boundary = DELMESH_BOUNDARY_IGNORE;
    delmesh_remesh_report report;
    delmesh_remesh_report_init(&report, sizeof report);
    mesh = nullptr;
    check(context, delmesh_remesh(context.get(), input.get(), &options, &mesh, &report));
    const Mesh output(mesh);
    answer.flips = report.flips + report.flips_after;
    laps.lap();

    answer.positions.resize(size_t(3 * report.vertices_out));
    answer.corners.resize(size_t(3 * report.faces_out));
    const delmesh_view_mut positions = {answer.positions.data(), report.vertices_out, 0, DELMESH_FLOAT64, 3};
    const delmesh_view_mut corners = {answer.corners.data(), 3 * report.faces_out, 0, DELMESH_INT32, 1};
    check(context, delmesh_mesh_read(output.get(), DELMESH_POSITION, &positions));
    check(context, delmesh_mesh_read(output.get(), DELMESH_CORNER_VERT, &corners));
    laps.lap();
}

} // namespace

void add_delmesh(std::vector<Peer>& peers) {
    peers.push_back({"delmesh flip, 1 thread", false, [](const Triangles& in, Answer& answer) { run(in, answer, 1); }});
    peers.push_back({"delmesh flip, 2 threads", false, [](const Triangles& in, Answer& answer) { run(in, answer, 2); }});
}
