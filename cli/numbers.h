/* SPDX-License-Identifier: Apache-2.0
 *
 * numbers.h: a text file with one number per vertex or face, a line each. Blank lines and what follows a # do not count.
 */
#ifndef DELMESH_CLI_NUMBERS_H
#define DELMESH_CLI_NUMBERS_H

#include "failure.h"

#include <stdint.h>

typedef struct Numbers {
    double* values; /* NULL: none were read */
    int64_t count;
} Numbers;

/* All must be finite, and with `positive` over 0. May be compressed. */
bool numbers_read(const char* path, bool positive, Numbers* out, Failure* failure);
void numbers_free(Numbers* numbers);

#endif
