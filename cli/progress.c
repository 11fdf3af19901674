/* SPDX-License-Identifier: Apache-2.0 */
#include "progress.h"

#include <delmesh/delmesh.h>
#include <stdio.h>

int32_t progress_report(void* user, double fraction, const char* stage) {
    enum { kWidth = 40 };
    static const char bar[] = "########################################";
    Progress* progress = user;
    if (progress->enabled) {
        double part = fraction > 0 ? fraction < 1 ? fraction : 1 : 0;
        int done = (int)(part * kWidth);
        fprintf(stderr, "\r[%.*s%*s] %3d %% %-20.20s", done, bar, kWidth - done, "", (int)(part * 100), stage);
        fflush(stderr);
        progress->shown = true;
    }
    return DELMESH_CONTINUE; /* cancelling is delmesh_cancel's business */
}

void progress_clear(Progress* progress) {
    if (!progress->shown) return;
    fprintf(stderr, "\r%70s\r", "");
    fflush(stderr);
    progress->shown = false;
}
