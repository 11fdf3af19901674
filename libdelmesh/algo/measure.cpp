#include "algo/measure.h"
namespace dm {
Status measure_quality(Context& c, const Mesh&, delmesh_quality_report&) { return c.fail(DELMESH_ERROR_INTERNAL, "stub"); }
Status measure_distance(Context& c, const Mesh&, const Mesh&, const delmesh_distance_options&, delmesh_distance_report&) { return c.fail(DELMESH_ERROR_INTERNAL, "stub"); }
}
