/* SPDX-License-Identifier: Apache-2.0
 *
 * read_stl.c: STL, binary and ascii, told apart by content: many binary files begin with "solid". The normals are not read. Ascii
 * files may hold several solids and loops of more than three vertices.
 */
#include "reader.h"

#include "bytes.h"

#include <stdlib.h>
#include <string.h>

/* Distinct points by open addressing; -0 counts as 0, NaNs by their bits. */
typedef struct PointTable {
    int32_t* slots; /* vertex, or -1 */
    uint64_t mask;
} PointTable;

static uint64_t point_bits(double x) {
    uint64_t bits;
    x = x == 0 ? 0 : x;
    memcpy(&bits, &x, sizeof bits);
    return bits;
}

static uint64_t point_hash(const double p[3]) {
    uint64_t h = 0;
    for (int k = 0; k < 3; ++k) {
        h = (h ^ point_bits(p[k])) * 0x9e3779b97f4a7c15ull;
        h ^= h >> 29;
    }
    h *= 0xbf58476d1ce4e5b9ull;
    return h ^ h >> 32;
}

static void vertex_position(const MeshFile* mesh, int64_t vertex, double out[3]) {
    for (int k = 0; k < 3; ++k)
        out[k] = mesh->precision == DELMESH_FLOAT32 ? (double)((const float*)mesh->positions)[3 * vertex + k]
                                                    : ((const double*)mesh->positions)[3 * vertex + k];
}

static bool table_grow(PointTable* table, const MeshFile* mesh, Failure* failure) {
    uint64_t size = table->slots ? 2 * (table->mask + 1) : 1024;
    int32_t* slots = malloc(size * sizeof *slots);
    if (!slots) return fail_memory(failure);
    memset(slots, 0xff, size * sizeof *slots);
    free(table->slots);
    table->slots = slots;
    table->mask = size - 1;
    for (int64_t v = 0; v < mesh->vertex_count; ++v) {
        double p[3];
        vertex_position(mesh, v, p);
        uint64_t i = point_hash(p) & table->mask;
        while (slots[i] >= 0) i = (i + 1) & table->mask;
        slots[i] = (int32_t)v;
    }
    return true;
}

/* Adds a corner at p: at the vertex that is there already, or at a new one. */
static bool add_point(Reader* reader, PointTable* table, const double p[3]) {
    MeshFile* mesh = reader->mesh;
    if (reader->merge_points) {
        if (2 * (uint64_t)mesh->vertex_count >= table->mask && !table_grow(table, mesh, reader->failure)) return false;
        uint64_t i = point_hash(p) & table->mask;
        for (; table->slots[i] >= 0; i = (i + 1) & table->mask) {
            double q[3];
            vertex_position(mesh, table->slots[i], q);
            if (point_bits(p[0]) == point_bits(q[0]) && point_bits(p[1]) == point_bits(q[1]) &&
                point_bits(p[2]) == point_bits(q[2])) {
                ++mesh->merged_points;
                return reader_add_corner(reader, table->slots[i], 0);
            }
        }
        table->slots[i] = (int32_t)mesh->vertex_count;
    }
    return reader_add_vertex(reader, p) && reader_add_corner(reader, mesh->vertex_count - 1, 0);
}

static bool read_binary(Reader* reader, PointTable* table) {
    enum { kHeader = 84, kTriangle = 50 };
    Text* t = &reader->text;
    reader->binary = true;
    reader->mesh->precision = DELMESH_FLOAT32;
    t->at = reader->begin;
    size_t size = reader_left(reader);
    if (size < kHeader) return reader_fail(reader, "this is no ascii STL, and its %zu bytes are too few for a binary one", size);
    t->at += 80;
    int64_t triangles = bytes_u32(t->at, kLittleEndian), room = (int64_t)((size - kHeader) / kTriangle);
    if (triangles != room)
        return reader_fail(reader, "%lld triangles are announced, but the file has room for %lld", (long long)triangles,
                           (long long)room);
    t->at += 4;
    if (!reader_reserve(reader, reader->merge_points ? triangles / 2 + 16 : 3 * triangles, triangles, 3 * triangles))
        return false;
    bool attributes = false; /* two bytes that the format does not use; some programs keep colours there */
    for (int64_t i = 0; i < triangles; ++i, t->at += kTriangle) {
        for (int k = 0; k < 3; ++k) {
            double p[3];
            for (int axis = 0; axis < 3; ++axis) p[axis] = bytes_f32(t->at + 12 + 12 * k + 4 * axis, kLittleEndian);
            if (!add_point(reader, table, p)) return false;
        }
        attributes |= t->at[48] != 0 || t->at[49] != 0;
        if (!reader_close_face(reader)) return false;
    }
    static const char left_out[] = "attribute of faces";
    return !attributes || reader_leave_out(reader, left_out, strlen(left_out));
}

static bool read_vertex(Reader* reader, PointTable* table) {
    Text* t = &reader->text;
    double p[3];
    for (int k = 0; k < 3; ++k) {
        text_skip_space(t, 0);
        const Text word = *t;
        if (!text_scan_double(&t->at, &p[k]) || !text_at_break(t)) {
            *t = word;
            return reader_expected(reader, "a coordinate");
        }
    }
    return add_point(reader, table, p);
}

static bool take_words(Reader* reader, const char* first, const char* second, int unread) {
    Text* t = &reader->text;
    text_skip_space(t, 0);
    if (!text_take_word(t, first)) return reader_expected(reader, first);
    if (second) {
        text_skip_space(t, 0);
        if (!text_take_word(t, second)) return reader_expected(reader, second);
    }
    for (; unread > 0; --unread) { /* a normal: anything */
        text_skip_space(t, 0);
        t->at += text_word_length(t);
    }
    return true;
}

static bool read_facet(Reader* reader, PointTable* table) {
    Text* t = &reader->text;
    if (!take_words(reader, "normal", NULL, 3) || !take_words(reader, "outer", "loop", 0)) return false;
    text_skip_space(t, 0);
    while (text_take_word(t, "vertex")) {
        if (!read_vertex(reader, table)) return false;
        text_skip_space(t, 0);
    }
    if (!text_take_word(t, "endloop")) return reader_expected(reader, "vertex or endloop");
    return take_words(reader, "endfacet", NULL, 0) && reader_close_face(reader);
}

static bool read_ascii(Reader* reader, PointTable* table) {
    Text* t = &reader->text;
    while (text_skip_space(t, 0)) {
        if (text_take_word(t, "facet")) {
            if (!read_facet(reader, table)) return false;
        } else if (text_take_word(t, "solid") || text_take_word(t, "endsolid")) {
            text_skip_line(t); /* the name */
        } else {
            return reader_expected(reader, "facet, endsolid or solid");
        }
    }
    return true;
}

/* Binary if the size is that of a binary file; else ascii if it begins with "solid" and no byte of its beginning is 0. */
static bool is_ascii(const Reader* reader) {
    Text start = reader->text;
    size_t size = (size_t)(start.end - reader->begin);
    if (size >= 84 && (uint64_t)size == 84 + 50 * (uint64_t)bytes_u32(reader->begin + 80, kLittleEndian)) return false;
    return text_skip_space(&start, 0) && text_take_word(&start, "solid") && !memchr(reader->begin, '\0', size < 256 ? size : 256);
}

bool read_stl(Reader* reader) {
    PointTable table = {NULL, 0};
    bool ok = is_ascii(reader) ? read_ascii(reader, &table) : read_binary(reader, &table);
    free(table.slots);
    return ok;
}
