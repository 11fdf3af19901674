// SPDX-License-Identifier: Apache-2.0
// The library without OpenSubdiv: no cage can be made, so nothing else here is ever called.
#include "subdiv/cage.h"

namespace dm {

struct Limit::Made {};
struct LimitEvaluator::Made {};

Limit::~Limit() = default;
Status Limit::build(Context& context, const Cage&) {
    return context.fail(DELMESH_ERROR_UNSUPPORTED, "This library was built without OpenSubdiv, which evaluates cages.");
}
bool Limit::has_face(int32_t) const {
    return false;
}
Limit::Counts Limit::count(int32_t, int32_t) const {
    return {0, 0};
}
void Limit::cut(int32_t, int32_t, FacePattern&) const {}

LimitEvaluator::LimitEvaluator(const Limit&) : made_(nullptr) {}
LimitEvaluator::~LimitEvaluator() = default;
void LimitEvaluator::face(int32_t, int32_t) {}
void LimitEvaluator::take(const double*, int32_t) {}
void LimitEvaluator::at(float, float, double*) {}
void LimitEvaluator::at(float, float, double*, double*, double*) {}

Status refine_cage(Context& context, const Cage& cage, int32_t, RefinedCage&) {
    Limit none;
    return none.build(context, cage);
}

} // namespace dm
