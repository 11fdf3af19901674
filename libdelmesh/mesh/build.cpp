#include "mesh/build.h"
namespace dm {
Status build_mesh(Context& c, const MeshInput&, Mesh&) { return c.fail(DELMESH_ERROR_INTERNAL, "stub"); }
Status count_mesh(Context& c, Mesh&) { return c.fail(DELMESH_ERROR_INTERNAL, "stub"); }
}
