// SPDX-License-Identifier: Apache-2.0
// What delmesh_certify found, kept until it is known that the call succeeds: the caller's lists stay as they are otherwise.
#pragma once

#include <optional>

#include "algo/certify.h"

namespace dm {

class Findings {
public:
    // Runs the certificate; options have been read but their views not checked.
    Status certify(Context& context, const Mesh& mesh, const delmesh_certify_options& options, delmesh_certify_report& report);
    void write() const; // as many as fit; only after certify() returned DELMESH_OK

private:
    const Mesh* mesh_ = nullptr;
    delmesh_view_mut edges_{}, faces_{};
    std::optional<Array<int32_t>> nld_corners_, zero_faces_; // not asked for: not collected
};

} // namespace dm
