/* SPDX-License-Identifier: Apache-2.0 */
#include "names.h"

#include <stdlib.h>
#include <string.h>

static uint32_t hash_of(const char* text, size_t length) {
    uint64_t h = 0xcbf29ce484222325u; /* FNV-1a */
    for (size_t i = 0; i < length; ++i) h = (h ^ (unsigned char)text[i]) * 0x100000001b3u;
    return (uint32_t)(h ^ h >> 32);
}

/* The slot that has the string, or the empty one for it. */
static int32_t slot_of(const Names* names, const char* text, size_t length) {
    const uint32_t mask = (uint32_t)names->slot_count - 1;
    uint32_t slot = hash_of(text, length) & mask;
    for (; names->slots[slot] >= 0; slot = (slot + 1) & mask) {
        const char* there = names_at(names, names->slots[slot]);
        if (strlen(there) == length && memcmp(there, text, length) == 0) break;
    }
    return (int32_t)slot;
}

static bool grow(Names* names, size_t length) {
    if (names->capacity - names->size < length + 1) {
        const size_t wanted = 2 * names->capacity + length + 64;
        char* text = realloc(names->text, wanted);
        if (!text) return false;
        names->text = text;
        names->capacity = wanted;
    }
    if (names->count < names->room) return true;
    const int32_t room = names->room ? 2 * names->room : 8;
    size_t* begins = realloc(names->begins, (size_t)room * sizeof *begins);
    if (!begins) return false;
    names->begins = begins;
    int32_t* slots = malloc((size_t)room * 2 * sizeof *slots);
    if (!slots) return false;
    free(names->slots);
    names->slots = slots;
    names->room = room;
    names->slot_count = 2 * room;
    for (int32_t i = 0; i < names->slot_count; ++i) slots[i] = -1;
    for (int32_t i = 0; i < names->count; ++i) slots[slot_of(names, names_at(names, i), strlen(names_at(names, i)))] = i;
    return true;
}

int32_t names_add(Names* names, const char* text, size_t length) {
    const char* end = memchr(text, '\0', length); /* a zero byte within ends it */
    if (end) length = (size_t)(end - text);
    if (!grow(names, length)) return -1;
    const int32_t slot = slot_of(names, text, length);
    if (names->slots[slot] < 0) {
        memcpy(names->text + names->size, text, length);
        names->text[names->size + length] = '\0';
        names->begins[names->count] = names->size;
        names->size += length + 1;
        names->slots[slot] = names->count++;
    }
    return names->slots[slot];
}

const char* names_at(const Names* names, int32_t number) {
    return names->text + names->begins[number];
}

void names_free(Names* names) {
    free(names->text);
    free(names->begins);
    free(names->slots);
    memset(names, 0, sizeof *names);
}
