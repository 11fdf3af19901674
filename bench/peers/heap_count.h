/* SPDX-License-Identifier: Apache-2.0
 *
 * heap_count.h: how much heap a piece of the program has at most, whoever asks for it: the C functions and operator new, in this
 * program and in the libraries it loads. While not counting it costs a branch for each call. glibc only.
 */
#ifndef DELMESH_BENCH_HEAP_COUNT_H
#define DELMESH_BENCH_HEAP_COUNT_H

#include <cstdint>

void heap_count_begin();
int64_t heap_count_peak(); /* bytes above what was there at the beginning; ends the counting */

#endif
