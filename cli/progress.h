/* SPDX-License-Identifier: Apache-2.0
 *
 * progress.h: a bar on the terminal's last line, on standard error, while the library works.
 */
#ifndef DELMESH_CLI_PROGRESS_H
#define DELMESH_CLI_PROGRESS_H

#include <stdbool.h>
#include <stdint.h>

typedef struct Progress {
    bool enabled; /* standard error is a terminal, and --quiet is not given */
    bool shown;
} Progress;

/* A delmesh_progress_fn; user is a Progress. */
int32_t progress_report(void* user, double fraction, const char* stage);
/* Before anything else is printed. */
void progress_clear(Progress* progress);

#endif
