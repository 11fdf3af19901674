/* SPDX-License-Identifier: Apache-2.0
 *
 * read_obj.c: Wavefront OBJ: `v` and `f`; all other statements are left out. A backslash at the end of a line joins it to the
 * next. Behind the three coordinates a `v` may carry a weight or a colour, which is not read. Texture and normal indices must be
 * numbers and are not used.
 */
#include "reader.h"

/* Over blanks and joined lines. */
static void skip_blanks(Text* t) {
    for (;;) {
        text_skip_blanks(t);
        if (*t->at != '\\' || !text_is_newline(t->at[1])) return;
        ++t->at;
        text_newline(t);
    }
}

/* Over the rest of a statement, its joined lines included. */
static void skip_statement(Text* t) {
    for (;;) {
        text_skip_line(t);
        if (t->at == t->end || t->at[-1] != '\\') return;
        text_newline(t);
        if (t->at == t->end) return;
    }
}

static bool at_break(const Text* t) {
    return text_at_break(t) || (*t->at == '\\' && text_is_newline(t->at[1]));
}

static bool read_vertex(Reader* reader) {
    Text* t = &reader->text;
    double position[3];
    for (int k = 0; k < 3; ++k) {
        skip_blanks(t);
        const Text word = *t;
        if (!text_scan_double(&t->at, &position[k]) || !at_break(t)) {
            *t = word;
            return reader_expected(reader, "a coordinate");
        }
    }
    skip_statement(t);
    return reader_add_vertex(reader, position);
}

/* One corner: v, v/vt, v//vn, v/vt/vn, with empty parts allowed at the end. */
static bool read_corner(Reader* reader) {
    Text* t = &reader->text;
    const Text word = *t;
    int64_t index, unused;
    bool ok = text_scan_integer(&t->at, &index);
    for (int part = 0; ok && part < 2 && *t->at == '/'; ++part) {
        ++t->at;
        if (*t->at != '/' && !at_break(t)) ok = text_scan_integer(&t->at, &unused);
    }
    if (!ok || !at_break(t)) {
        *t = word;
        return reader_expected(reader, "a face corner");
    }
    int64_t vertices = reader->mesh->vertex_count;
    if (index == 0) {
        *t = word;
        return reader_fail(reader, "a face refers to vertex 0, but OBJ counts from 1");
    }
    if (index < -vertices || index > INT32_MAX) {
        *t = word;
        return reader_fail(reader, "a face refers to vertex %lld, but only %lld came before", (long long)index,
                           (long long)vertices);
    }
    return reader_add_corner(reader, index < 0 ? vertices + index : index - 1, word.line);
}

static bool read_face(Reader* reader) {
    Text* t = &reader->text;
    for (;;) {
        skip_blanks(t);
        if (t->at == t->end || text_is_newline(*t->at)) return reader_close_face(reader);
        if (*t->at == '#') { /* a comment behind the statement */
            text_skip_line(t);
            return reader_close_face(reader);
        }
        if (*t->at == '\\' && t->at + 1 == t->end) { /* joined to nothing */
            ++t->at;
            return reader_close_face(reader);
        }
        if (!read_corner(reader)) return false;
    }
}

bool read_obj(Reader* reader) {
    Text* t = &reader->text;
    while (text_skip_space(t, '#')) {
        char keyword = *t->at;
        Text behind = {t->at + 1, t->end, t->line};
        if ((keyword == 'v' || keyword == 'f') && at_break(&behind)) {
            *t = behind;
            if (!(keyword == 'v' ? read_vertex(reader) : read_face(reader))) return false;
        } else {
            skip_statement(t);
        }
    }
    if (reader->mesh->vertex_count == 0 && reader->mesh->face_count == 0)
        return reader_fail(reader, "the file ended without a vertex or a face");
    return true;
}
