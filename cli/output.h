/* SPDX-License-Identifier: Apache-2.0
 *
 * output.h: a file that appears whole or not at all: written beside the target under another name, renamed over it at the end.
 */
#ifndef DELMESH_CLI_OUTPUT_H
#define DELMESH_CLI_OUTPUT_H

#include "failure.h"

#include <stddef.h>

typedef struct Output {
    const char* path; /* as the user gave it */
    char* target;     /* with symbolic links followed */
    char* temporary;
    char* old; /* what was at the target, while several files are put in their places */
    char* buffer;
    size_t used;
    int descriptor;
    bool written; /* the temporary file is there */
    Failure* failure;
} Output;

enum { kOutputBuffer = 1 << 18 };

/* Whether a file can be made at `path`: its folder is there and writable, and it is no folder or device itself. */
bool output_check(const char* path, Failure* failure);

bool output_open(Output* out, const char* path, Failure* failure);
/* Room for `size` (at most kOutputBuffer) bytes: write there, then add the length to out->used. NULL after an error. */
char* output_reserve(Output* out, size_t size);
bool output_write(Output* out, const void* data, size_t size);
/* Ends the file if `ok` and all was written, else removes it; frees. Returns whether the file is there. */
bool output_close(Output* out, bool ok);

/* The same in two steps, so that several files appear together: the whole file under its other name, and frees if that
 * fails; ... */
bool output_finish(Output* out, bool ok);
/* ... all of them, each finished, under their own names, or removed; frees. `failure` gets the first that fails: then what was
 * there before is there again. */
bool output_commit(Output* outs, int count, bool ok, Failure* failure);

#endif
