/* SPDX-License-Identifier: Apache-2.0
 *
 * failure.h: how every function of the command reports that something went wrong: it fills a Failure and returns false.
 */
#ifndef DELMESH_CLI_FAILURE_H
#define DELMESH_CLI_FAILURE_H

#include <stdbool.h>

/* Statuses of the command itself; those of the library keep their DELMESH_ERROR_* names. */
#define kStatusUsage "USAGE_ERROR"
#define kStatusRead "READ_ERROR"
#define kStatusWrite "WRITE_ERROR"
#define kStatusMemory "DELMESH_ERROR_OUT_OF_MEMORY"
#define kStatusCancelled "DELMESH_ERROR_CANCELLED"

typedef struct Failure {
    const char* status; /* static string; NULL while nothing has failed */
    char text[768];     /* one sentence, one line */
} Failure;

/* Records the first failure (later ones are consequences) and returns false. */
bool fail_with(Failure* failure, const char* status, const char* format, ...) __attribute__((format(printf, 3, 4)));
bool fail_memory(Failure* failure);

#endif
