/* SPDX-License-Identifier: Apache-2.0
 *
 * source.h: a whole input file in memory, decompressed if it is a gzip file, with a '\0' after its last byte.
 * The file is read, not mapped: a mapped file that someone truncates meanwhile ends the program with a signal.
 */
#ifndef DELMESH_CLI_SOURCE_H
#define DELMESH_CLI_SOURCE_H

#include "failure.h"

#include <stddef.h>

typedef struct Source {
    char* data;
    size_t size;
    bool compressed; /* was a gzip file: offsets count in the decompressed bytes */
} Source;

/* Memory: the file and, if it is compressed, what it expands to, for which there is a limit: 100 times the file's size, or 64 MiB
 * if that is more (deflate can reach 1030 times; no mesh does). */
bool source_read(const char* path, Source* out, Failure* failure);
void source_free(Source* source);

#endif
