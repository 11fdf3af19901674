// SPDX-License-Identifier: Apache-2.0
// A double as text for error sentences. printf's %g alone would write the host's decimal comma, and std::to_chars would bring a
// hundred kilobytes of tables.
#pragma once

#include <cstdio>

namespace dm {

// fail(..., "%s", Number(x).text)
struct Number {
    explicit Number(double x) {
        std::snprintf(text, sizeof text, "%.9g", x);
        char* end = text;
        for (const char* p = text; *p != 0; ++p) {
            if ((*p >= '0' && *p <= '9') || (*p >= 'a' && *p <= 'z') || *p == '-' || *p == '+')
                *end++ = *p;
            else if (end == text || end[-1] != '.')
                *end++ = '.'; // the locale's decimal point, in however many bytes
        }
        *end = 0;
    }
    char text[40];
};

} // namespace dm
