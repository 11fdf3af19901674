// SPDX-License-Identifier: Apache-2.0
#include "api/transfer.h"

namespace dm {

Status transfer_layer(Context& context, const Mesh&, int32_t, int32_t, const delmesh_view&, const delmesh_view_mut&) {
    return context.fail(DELMESH_ERROR_UNSUPPORTED, "Not there yet.");
}

Status transfer_rows(Context& context, const Mesh&, const delmesh_rows&, int32_t, int32_t, const delmesh_rows_mut&) {
    return context.fail(DELMESH_ERROR_UNSUPPORTED, "Not there yet.");
}

} // namespace dm
