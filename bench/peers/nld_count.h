/* SPDX-License-Identifier: Apache-2.0
 *
 * nld_count.h: what an answer is worth, counted from its arrays alone, with no code of any of the libraries.
 */
#ifndef DELMESH_BENCH_NLD_COUNT_H
#define DELMESH_BENCH_NLD_COUNT_H

#include "peers.h"

struct Count {
    int64_t nld = 0;       /* edges of two faces whose opposite angles add up to more than 180 degrees */
    double worst = 0;      /* degrees by which the worst of them does */
    int64_t crowded = 0;   /* edges of more than two faces: a surface mesh that is no manifold any more */
    int64_t zero_area = 0; /* faces, of surface meshes only */
};

Count count_nld(const Answer& answer);

#endif
