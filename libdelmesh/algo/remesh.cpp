#include "algo/remesh.h"
namespace dm { Status remesh(Context& c, const Mesh&, const delmesh_remesh_options&, Mesh&, delmesh_remesh_report&) { return c.fail(DELMESH_ERROR_INTERNAL, "stub"); } }
