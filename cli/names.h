/* SPDX-License-Identifier: Apache-2.0
 *
 * names.h: distinct strings, numbered in the order in which they came.
 */
#ifndef DELMESH_CLI_NAMES_H
#define DELMESH_CLI_NAMES_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef struct Names {
    char* text; /* one after the other, each with its '\0' */
    size_t size, capacity;
    size_t* begins;
    int32_t* slots; /* of a hash table: a number, or -1 */
    int32_t count, room, slot_count;
} Names;

/* The number of the string, which is new or was there; -1: no memory. */
int32_t names_add(Names* names, const char* text, size_t length);
const char* names_at(const Names* names, int32_t number);
void names_free(Names* names);

#endif
