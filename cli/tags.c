/* SPDX-License-Identifier: Apache-2.0 */
#include "tags.h"

#include "source.h"

#include <stdlib.h>
#include <string.h>

bool tags_add(SharpList* list, int32_t width, int64_t first, int64_t second, double sharpness) {
    if (list->count == list->capacity) {
        const int64_t capacity = list->capacity + list->capacity / 2 + 64;
        int64_t* verts = realloc(list->verts, (size_t)(capacity * width) * sizeof *verts);
        if (verts) list->verts = verts;
        double* values = realloc(list->sharpness, (size_t)capacity * sizeof *values);
        if (values) list->sharpness = values;
        if (!verts || !values) return false;
        list->capacity = capacity;
    }
    list->verts[width * list->count] = first;
    if (width == 2) list->verts[2 * list->count + 1] = second;
    list->sharpness[list->count++] = sharpness;
    return true;
}

static void list_free(SharpList* list) {
    free(list->verts);
    free(list->sharpness);
}

void tags_free(Tags* tags) {
    list_free(&tags->creases);
    list_free(&tags->corners);
    list_free(&tags->holes);
    memset(tags, 0, sizeof *tags);
}

/* ---- OBJ */

static bool scan_integer(Text* t, int64_t* out) {
    text_skip_blanks(t);
    return text_scan_integer(&t->at, out);
}
static bool take_slash(Text* t) {
    if (*t->at != '/') return false;
    ++t->at;
    return true;
}

/* The rest of a line whose tag takes `list`. *memory: there was enough. */
static bool scan_tag(Text at, SharpList* list, int32_t width, bool sharp, bool* memory) {
    int64_t integers, reals, strings, index, before = 0;
    if (!scan_integer(&at, &integers) || !take_slash(&at) || !text_scan_integer(&at.at, &reals) || !take_slash(&at) ||
        !text_scan_integer(&at.at, &strings))
        return false;
    const int64_t elements = integers - (width - 1); /* a crease is a line of vertices */
    if (elements < 1 || (sharp && reals != 1 && reals != elements)) return false;
    Text real = at; /* behind the integers */
    for (int64_t i = 0; i < integers; ++i)
        if (!scan_integer(&real, &index)) return false;
    double sharpness = 0;
    for (int64_t i = 0; i < integers; ++i) {
        if (!scan_integer(&at, &index)) return false;
        const int64_t element = i - (width - 1);
        if (sharp && element >= 0 && (element == 0 || reals > 1)) {
            text_skip_blanks(&real);
            if (!text_scan_double(&real.at, &sharpness)) return false;
        }
        if (element >= 0)
            *memory = width == 2 ? tags_add(list, 2, before, index, sharpness) : tags_add(list, 1, index, 0, sharpness);
        if (!*memory) return false;
        before = index;
    }
    return true;
}

bool tags_scan_obj(const Text* text, Tags* tags, bool* taken) {
    Text at = *text;
    text_skip_blanks(&at);
    SharpList* list;
    int32_t width = 1;
    if (text_take_word(&at, "crease"))
        list = &tags->creases, width = 2;
    else if (text_take_word(&at, "corner"))
        list = &tags->corners;
    else if (text_take_word(&at, "hole"))
        list = &tags->holes;
    else
        return !(*taken = false);
    const int64_t before = list->count;
    bool memory = true;
    *taken = scan_tag(at, list, width, list != &tags->holes, &memory);
    if (!*taken) list->count = before;
    return memory;
}

/* ---- A file of their own */

static bool fail_line(const char* path, const Text* at, const char* wanted, Failure* failure) {
    char quote[kTextQuoteSize];
    return fail_with(failure, kStatusRead, "%s: line %lld: expected %s, found '%s'", path, (long long)at->line, wanted,
                     text_quote(at, quote));
}

static bool parse(const char* path, Text text, Tags* tags, Failure* failure) {
    while (text_skip_space(&text, '#')) {
        const int64_t line = text.line;
        SharpList* list = NULL;
        int32_t width = 1;
        if (text_take_word(&text, "crease"))
            list = &tags->creases, width = 2;
        else if (text_take_word(&text, "corner"))
            list = &tags->corners;
        else if (text_take_word(&text, "hole"))
            list = &tags->holes;
        else
            return fail_line(path, &text, "crease, corner or hole", failure);
        int64_t index[2] = {0, 0};
        double sharpness = 0;
        for (int32_t i = 0; i < width; ++i) {
            text_skip_blanks(&text);
            const Text word = text;
            if (text_is_newline(*text.at) || !text_scan_integer(&text.at, &index[i]) || !text_at_break(&text))
                return fail_line(path, &word, list == &tags->holes ? "a face" : "a vertex", failure);
        }
        if (list != &tags->holes) {
            text_skip_blanks(&text);
            const Text word = text;
            if (text_is_newline(*text.at) || !text_scan_double(&text.at, &sharpness) || !text_at_break(&text))
                return fail_line(path, &word, "a sharpness", failure);
        }
        if (!tags_add(list, width, index[0], index[1], sharpness)) return fail_memory(failure);
        if (text_skip_space(&text, '#') && text.line == line) return fail_line(path, &text, "the line's end", failure);
    }
    return true;
}

bool tags_read(const char* path, Tags* tags, Failure* failure) {
    Source source;
    Failure cause = {NULL, ""};
    if (!source_read(path, &source, &cause)) return fail_with(failure, cause.status, "%s: %s", path, cause.text);
    const bool ok = parse(path, (Text){source.data, source.data + source.size, 1}, tags, failure);
    source_free(&source);
    return ok;
}
