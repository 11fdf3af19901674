// SPDX-License-Identifier: Apache-2.0
// In place of OpenSubdiv's own, where that is compiled in: what it would print is nobody's to read. Cages are checked before it
// sees them, and what it still refuses, it refuses by its return values.
#include <opensubdiv/far/error.h>

namespace OpenSubdiv {
namespace OPENSUBDIV_VERSION {
namespace Far {

void SetErrorCallback(ErrorCallbackFunc) {}
void SetWarningCallback(WarningCallbackFunc) {}
void Error(ErrorType, const char*, ...) {}
void Warning(const char*, ...) {}

} // namespace Far
} // namespace OPENSUBDIV_VERSION
} // namespace OpenSubdiv
