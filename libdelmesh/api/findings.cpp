// SPDX-License-Identifier: Apache-2.0
#include "api/findings.h"

#include <chrono>

#include "api/arrays.h"
#include "api/views.h"

namespace dm {

Status Findings::certify(Context& context, const Mesh& mesh, const delmesh_certify_options& options,
                         delmesh_certify_report& report) {
    const delmesh_view edges = as_view(options.nld_edges), faces = as_view(options.zero_area_faces);
    if (is_given(edges)) DM_TRY(check_view(context, "nld_edges", edges, kIndexTypes, 2));
    if (is_given(faces)) DM_TRY(check_view(context, "zero_area_faces", faces, kIndexTypes, 1));
    mesh_ = &mesh;
    edges_ = options.nld_edges;
    faces_ = options.zero_area_faces;
    if (edges_.count > 0) nld_corners_.emplace(context.memory());
    if (faces_.count > 0) zero_faces_.emplace(context.memory());

    const auto start = std::chrono::steady_clock::now();
    const bool boundary_rule = options.boundary == DELMESH_BOUNDARY_NONOBTUSE;
    Certificate certificate;
    DM_TRY(certify_mesh(context, mesh, boundary_rule, certificate, nld_corners_ ? &*nld_corners_ : nullptr,
                        zero_faces_ ? &*zero_faces_ : nullptr));
    report.delaunay = certificate.delaunay(boundary_rule);
    report.nld_interior = certificate.nld_interior;
    report.nld_boundary = certificate.nld_boundary;
    report.zero_area_faces = certificate.zero_area_faces;
    report.exact_tests = certificate.exact_tests;
    report.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    return DELMESH_OK;
}

void Findings::write() const {
    if (nld_corners_) write_edges(*mesh_, *nld_corners_, edges_);
    if (zero_faces_) write_indices(*zero_faces_, faces_);
}

} // namespace dm
