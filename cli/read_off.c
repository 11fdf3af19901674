/* SPDX-License-Identifier: Apache-2.0
 *
 * read_off.c: OFF, COFF, NOFF, STOFF and their combinations, text and binary. Behind the three coordinates of a vertex stand its
 * normal, colour and texture coordinates, in that order, as far as the keyword announces them; where the line has fewer numbers,
 * the vertex has none. What follows the corners of a face on its line, its colour, and what follows a vertex unannounced, is not
 * read, and said to be left out. Comments run from # to the end.
 *
 * Binary files are big-endian by the format's description, with colours behind each face; others write them little-endian and
 * without. The byte order is the one in which the counts fit the file; the faces are walked once to see if they have colours.
 */
#include "reader.h"

#include "bytes.h"

#include <math.h>
#include <string.h>

typedef struct Header {
    bool binary, colours, normals, texture;
    bool more_of_vertices, more_of_faces; /* that is not read */
    int64_t vertices, faces;
    Layer normal, color, uv;
} Header;

enum { kMostExtras = 9 }; /* 3 of a normal, 4 of a colour, 2 of a texture */

/* The numbers behind the coordinates of a vertex. */
static bool put_extras(Reader* reader, Header* header, int64_t vertex, const double* numbers, int32_t count) {
    const int32_t colour = count - 3 * header->normals - 2 * header->texture;
    if (header->colours ? colour > 4 || colour < header->color.components : colour != 0) return true;
    const struct {
        Layer* layer;
        int32_t count;
    } parts[] = {{&header->normal, 3 * header->normals}, {&header->color, colour}, {&header->uv, 2 * header->texture}};
    for (size_t i = 0; i < sizeof parts / sizeof *parts; ++i) {
        Layer* layer = parts[i].layer;
        if (parts[i].count > 0 && !layer_extend(layer, vertex + 1)) return fail_memory(reader->failure);
        for (int32_t k = 0; k < parts[i].count && k < layer->components; ++k) layer_set(layer, vertex, k, numbers[k]);
        numbers += parts[i].count;
    }
    return true;
}

/* Colours are numbers from 0 to 1, or whole ones from 0 to 255: which of the two, the largest tells. */
static bool settle_colors(Reader* reader, Layer* color) {
    bool whole = true, large = false;
    for (int64_t i = 0; i < color->count; ++i) {
        for (int32_t k = 0; k < color->components; ++k) {
            const double x = layer_get(color, i, k);
            whole &= isnan(x) || (x >= 0 && x <= 255 && x == rint(x));
            large |= x > 1;
        }
    }
    const StoredType stored = whole && large ? kUint8 : color->stored;
    Layer settled = layer_make(kLayerColor, DELMESH_DOMAIN_VERTEX, stored, color->components);
    if (!layer_extend(&settled, color->count)) {
        layer_free(&settled);
        return fail_memory(reader->failure);
    }
    for (int64_t i = 0; i < color->count; ++i)
        for (int32_t k = 0; k < color->components && !isnan(layer_get(color, i, k)); ++k)
            layer_set(&settled, i, k, layer_get(color, i, k));
    layer_free(color);
    *color = settled;
    return true;
}

/* Over the rest of a line; whether there was anything. */
static bool skip_rest(Text* t) {
    text_skip_blanks(t);
    const bool more = !text_at_break(t) && *t->at != '#';
    text_skip_line(t);
    return more;
}

static bool leave_out(Reader* reader, bool more, const char* what) {
    return !more || reader_leave_out(reader, what, strlen(what));
}

static bool add_layers(Reader* reader, Header* header) {
    Layer* layers[] = {&header->normal, &header->color, &header->uv};
    if (!leave_out(reader, header->more_of_vertices, "what follows the coordinates")) return false;
    if (!leave_out(reader, header->more_of_faces, "color of faces")) return false;
    if (!settle_colors(reader, &header->color)) return false;
    for (size_t i = 0; i < sizeof layers / sizeof *layers; ++i)
        if (layers[i]->count > 0 && !reader_add_layer(reader, layers[i])) return false;
    return true;
}

static bool read_count(Reader* reader, const char* what, int64_t* out) {
    if (!text_skip_space(&reader->text, '#')) return reader_expected(reader, what);
    const Text number = reader->text;
    if (!text_scan_integer(&reader->text.at, out) || !(text_at_break(&reader->text) || *reader->text.at == '#')) {
        reader->text = number;
        return reader_expected(reader, what);
    }
    if (*out < 0) {
        reader->text = number;
        return reader_fail(reader, "%s is %lld", what, (long long)*out);
    }
    return true;
}

static bool read_keyword(Reader* reader, Header* header) {
    Text* t = &reader->text;
    if (!text_skip_space(t, '#')) return reader_expected(reader, "OFF");
    const Text word = *t;
    int64_t count;
    bool no_keyword = text_scan_integer(&t->at, &count) && text_at_break(t); /* it is optional */
    *t = word;
    if (no_keyword) return true;
    bool many = false, four = false;
    if (t->at[0] == 'S' && t->at[1] == 'T') header->texture = true, t->at += 2;
    if (*t->at == 'C') header->colours = true, ++t->at;
    if (*t->at == 'N') header->normals = true, ++t->at;
    if (*t->at == '4') four = true, ++t->at;
    if (*t->at == 'n') many = true, ++t->at;
    if (t->end - t->at < 3 || memcmp(t->at, "OFF", 3) != 0) {
        *t = word;
        return reader_expected(reader, "OFF");
    }
    t->at += 3;
    if (!text_at_break(t) && *t->at != '#' && (*t->at < '0' || *t->at > '9')) { /* "OFF8 6 12" occurs */
        *t = word;
        return reader_expected(reader, "OFF");
    }
    if (four) return reader_fail(reader, "4OFF: vertices with four coordinates are not points in space");
    text_skip_blanks(t);
    if (text_take_word(t, "binary")) {
        header->binary = true;
        if (many) return reader_fail(reader, "nOFF is not read from binary files");
        if (!text_is_newline(*t->at)) return reader_expected(reader, "the end of the line");
        if (t->at[0] == '\r' && t->at[1] == '\n') ++t->at; /* a lone \r ends the line, too */
        ++t->at;
    }
    int64_t dimension = 3;
    if (many && !read_count(reader, "the dimension", &dimension)) return false;
    if (dimension != 3)
        return reader_fail(reader, "nOFF: vertices with %lld coordinates are not points in space", (long long)dimension);
    return true;
}

/* A text file needs 6 bytes for a vertex ("0 0 0\n") and 2 for a face. */
static bool check_counts(Reader* reader, const Header* header, int64_t vertex_bytes, int64_t face_bytes) {
    int64_t left = (int64_t)reader_left(reader) + 1; /* the last line end may be missing */
    if (header->vertices > left / vertex_bytes)
        return reader_fail(reader, "%lld vertices are announced, but the file has room for %lld at most",
                           (long long)header->vertices, (long long)(left / vertex_bytes));
    left -= header->vertices * vertex_bytes;
    if (header->faces > left / face_bytes)
        return reader_fail(reader, "%lld faces are announced, but the file has room for %lld at most", (long long)header->faces,
                           (long long)(left / face_bytes));
    return true;
}

static bool read_text(Reader* reader, Header* header) {
    Text* t = &reader->text;
    if (!read_count(reader, "the number of vertices", &header->vertices)) return false;
    int64_t line = t->line;
    if (!read_count(reader, "the number of faces", &header->faces)) return false;
    /* The number of edges means nothing and may be missing. Where all stands on a line of its own, it is on the next. */
    if (line != t->line) {
        int64_t edges;
        Text ahead = *t;
        if (text_skip_space(&ahead, '#') && text_scan_integer(&ahead.at, &edges) && text_at_break(&ahead)) {
            text_skip_blanks(&ahead);
            if (text_is_newline(*ahead.at) || *ahead.at == '#') *t = ahead;
        }
    }
    text_skip_line(t);
    if (!check_counts(reader, header, 6, 2)) return false;
    if (!reader_reserve(reader, header->vertices, header->faces, 3 * header->faces)) return false;

    const bool announced = header->normals || header->colours || header->texture;
    for (int64_t v = 0; v < header->vertices; ++v) {
        double position[3];
        for (int k = 0; k < 3; ++k) {
            if (!text_skip_space(t, '#'))
                return reader_fail(reader, "the file ended in vertex %lld of %lld", (long long)v, (long long)header->vertices);
            const Text word = *t;
            if (!text_scan_double(&t->at, &position[k]) || !(text_at_break(t) || *t->at == '#')) {
                *t = word;
                return reader_expected(reader, "a coordinate");
            }
        }
        double extras[kMostExtras + 1];
        int32_t count = 0;
        for (; announced && count <= kMostExtras; ++count) {
            text_skip_blanks(t);
            if (!text_scan_double(&t->at, &extras[count]) || !isfinite(extras[count])) break;
        }
        if (v == 0 && count == 3 + 3 * header->normals + 2 * header->texture) header->color.components = 3;
        header->more_of_vertices |= skip_rest(t) && !announced;
        if (!put_extras(reader, header, v, extras, count) || !reader_add_vertex(reader, position)) return false;
    }
    for (int64_t f = 0; f < header->faces; ++f) {
        int64_t size, index;
        if (!text_skip_space(t, '#'))
            return reader_fail(reader, "the file ended before face %lld of %lld", (long long)f, (long long)header->faces);
        const Text word = *t;
        if (!read_count(reader, "the number of corners", &size)) return false;
        if (size > (int64_t)reader_left(reader) / 2) {
            *t = word;
            return reader_fail(reader, "face %lld announces %lld corners, but the file ends before", (long long)f,
                               (long long)size);
        }
        for (int64_t k = 0; k < size; ++k) {
            if (!read_count(reader, "a vertex index", &index)) return false;
            if (index >= header->vertices)
                return reader_fail(reader, "face %lld refers to vertex %lld of %lld (counting from 0)", (long long)f,
                                   (long long)index, (long long)header->vertices);
            if (!reader_add_corner(reader, index, reader_place(reader, t))) return false;
        }
        header->more_of_faces |= skip_rest(t);
        if (!reader_close_face(reader)) return false;
    }
    return true;
}

/* Walks the faces of a binary file; colours: an int with the number of float components stands behind each.
 * Returns the bytes left behind the last face, or -1 if the walk leaves the file. */
static int64_t walk_faces(const char* at, const char* end, int64_t faces, ByteOrder order, bool colours) {
    for (int64_t f = 0; f < faces; ++f) {
        for (int part = 0; part < (colours ? 2 : 1); ++part) {
            if (end - at < 4) return -1;
            int64_t words = bytes_u32(at, order);
            at += 4;
            if (words > (end - at) / 4) return -1;
            at += 4 * words;
        }
    }
    return end - at;
}

static bool read_binary(Reader* reader, Header* header) {
    Text* t = &reader->text;
    reader->binary = true;
    reader->mesh->precision = DELMESH_FLOAT32;
    int64_t vertex_bytes = 4 * (3 + 3 * header->normals + 4 * header->colours + 2 * header->texture);
    if (reader_left(reader) < 12) return reader_fail(reader, "the file ended before the three counts");
    ByteOrder order = kBigEndian;
    int64_t left = (int64_t)reader_left(reader) - 12;
    for (int attempt = 0;; ++attempt) {
        header->vertices = bytes_u32(t->at, order);
        header->faces = bytes_u32(t->at + 4, order);
        if (header->vertices <= left / vertex_bytes && header->faces <= (left - header->vertices * vertex_bytes) / 4) break;
        if (attempt == 1)
            return reader_fail(reader,
                               "the counts (%lld vertices, %lld faces; or in the other byte order %lld, %lld) exceed the file",
                               (long long)bytes_u32(t->at, kBigEndian), (long long)bytes_u32(t->at + 4, kBigEndian),
                               (long long)header->vertices, (long long)header->faces);
        order = kLittleEndian;
    }
    t->at += 12;
    const char* first_face = t->at + header->vertices * vertex_bytes;
    bool colours = order == kBigEndian;
    int64_t rest = walk_faces(first_face, t->end, header->faces, order, colours);
    if (rest != 0) { /* not as this byte order has it: the other layout, if it fits, and better */
        int64_t other = walk_faces(first_face, t->end, header->faces, order, !colours);
        if (other >= 0 && (rest < 0 || other < rest)) colours = !colours;
    }
    if (!reader_reserve(reader, header->vertices, header->faces, 3 * header->faces)) return false;
    for (int64_t v = 0; v < header->vertices; ++v, t->at += vertex_bytes) {
        double position[3];
        for (int k = 0; k < 3; ++k) position[k] = bytes_f32(t->at + 4 * k, order);
        double extras[kMostExtras];
        const int32_t count = (int32_t)(vertex_bytes / 4) - 3;
        for (int32_t k = 0; k < count; ++k) extras[k] = bytes_f32(t->at + 12 + 4 * k, order);
        if (!put_extras(reader, header, v, extras, count) || !reader_add_vertex(reader, position)) return false;
    }
    for (int64_t f = 0; f < header->faces; ++f) {
        if (reader_left(reader) < 4)
            return reader_fail(reader, "the file ended before face %lld of %lld", (long long)f, (long long)header->faces);
        int64_t size = bytes_u32(t->at, order);
        if (size > (int64_t)(reader_left(reader) - 4) / 4)
            return reader_fail(reader, "face %lld announces %lld corners, but the file ends before", (long long)f,
                               (long long)size);
        t->at += 4;
        for (int64_t k = 0; k < size; ++k, t->at += 4) {
            int64_t index = bytes_u32(t->at, order);
            if (index >= header->vertices)
                return reader_fail(reader, "face %lld refers to vertex %lld of %lld (counting from 0)", (long long)f,
                                   (long long)index, (long long)header->vertices);
            if (!reader_add_corner(reader, index, reader_place(reader, t))) return false;
        }
        if (colours) {
            int64_t components = reader_left(reader) < 4 ? INT32_MAX : bytes_u32(t->at, order);
            if (reader_left(reader) < 4 || components > (int64_t)(reader_left(reader) - 4) / 4)
                return reader_fail(reader, "the file ended in the colour of face %lld", (long long)f);
            t->at += 4 + 4 * components;
            header->more_of_faces |= components > 0;
        }
        if (!reader_close_face(reader)) return false;
    }
    return true;
}

bool read_off(Reader* reader) {
    Header header;
    memset(&header, 0, sizeof header);
    if (!read_keyword(reader, &header)) return false;
    const StoredType stored = header.binary ? kFloat32 : kNoType;
    header.normal = layer_make(kLayerNormal, DELMESH_DOMAIN_VERTEX, stored, 3);
    header.color = layer_make(kLayerColor, DELMESH_DOMAIN_VERTEX, stored, 4);
    header.color.fill = NAN; /* until it is known what white is */
    header.uv = layer_make(kLayerUv, DELMESH_DOMAIN_VERTEX, stored, 2);
    const bool ok = (header.binary ? read_binary(reader, &header) : read_text(reader, &header)) && add_layers(reader, &header);
    layer_free(&header.normal);
    layer_free(&header.color);
    layer_free(&header.uv);
    return ok;
}
