/* SPDX-License-Identifier: Apache-2.0 */
#include "failure.h"

#include <stdarg.h>
#include <stdio.h>

bool fail_with(Failure* failure, const char* status, const char* format, ...) {
    if (failure->status) return false;
    failure->status = status;
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(failure->text, sizeof failure->text, format, arguments);
    va_end(arguments);
    for (char* c = failure->text; *c; ++c) /* file names may hold anything: keep it one line, and no terminal escapes */
        if ((unsigned char)*c < 32 || *c == 127) *c = '?';
    return false;
}

bool fail_memory(Failure* failure) {
    return fail_with(failure, kStatusMemory, "there was not enough memory");
}
