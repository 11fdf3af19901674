/* SPDX-License-Identifier: Apache-2.0
 *
 * mesh_file.c: choice of the reader, and the growing arrays that the readers fill.
 */
#include "mesh_file.h"

#include "reader.h"
#include "source.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

static bool ends_with(const char* name, size_t length, const char* ending) {
    size_t n = strlen(ending);
    return length > n && strncasecmp(name + length - n, ending, n) == 0;
}

MeshFormat mesh_format_of_name(const char* path, bool* ascii) {
    size_t length = strlen(path);
    if (ends_with(path, length, ".gz")) length -= 3;
    if (ascii) *ascii = ends_with(path, length, ".stla");
    if (ends_with(path, length, ".obj")) return kFormatObj;
    if (ends_with(path, length, ".off")) return kFormatOff;
    if (ends_with(path, length, ".ply")) return kFormatPly;
    if (ends_with(path, length, ".stl") || ends_with(path, length, ".stla")) return kFormatStl;
    return kFormatUnknown;
}

const char* mesh_format_name(MeshFormat format) {
    static const char* const names[] = {"unknown", "OBJ", "OFF", "PLY", "STL"};
    return names[format];
}

/* [ST][C][N][4][n]OFF as the first word that is no comment. */
static bool looks_like_off(Text text) {
    if (!text_skip_space(&text, '#')) return false;
    size_t length = text_word_length(&text);
    return length >= 3 && length <= 8 && memcmp(text.at + length - 3, "OFF", 3) == 0 && strspn(text.at, "STCN4n") >= length - 3;
}

static MeshFormat choose_format(const char* path, const Text* text) {
    size_t size = (size_t)(text->end - text->at);
    if (size >= 4 && memcmp(text->at, "ply", 3) == 0 && text_is_newline(text->at[3])) return kFormatPly;
    MeshFormat named = mesh_format_of_name(path, NULL);
    if (named != kFormatStl && looks_like_off(*text)) return kFormatOff;
    if (named != kFormatUnknown) return named;
    if (size >= 84) {
        const unsigned char* n = (const unsigned char*)text->at + 80;
        uint64_t triangles = n[0] | (uint64_t)n[1] << 8 | (uint64_t)n[2] << 16 | (uint64_t)n[3] << 24;
        if (size == 84 + 50 * triangles) return kFormatStl;
    }
    Text word = *text;
    return text_skip_space(&word, 0) && text_take_word(&word, "solid") ? kFormatStl : kFormatUnknown;
}

/* Elements that the file said nothing about. */
static bool finish_layers(MeshFile* mesh, Failure* failure) {
    const int64_t counts[] = {mesh->vertex_count, mesh->corner_count, mesh->face_count};
    for (int32_t i = 0; i < mesh->layers.count; ++i)
        if (!layer_extend(&mesh->layers.items[i], counts[mesh->layers.items[i].domain])) return fail_memory(failure);
    return true;
}

bool mesh_file_parse(const char* path, const char* data, size_t size, bool merge_points, MeshFile* out, Failure* failure) {
    memset(out, 0, sizeof *out);
    out->precision = DELMESH_FLOAT64;
    Reader reader;
    memset(&reader, 0, sizeof reader);
    reader.text = (Text){data, data + size, 1};
    reader.begin = data;
    reader.merge_points = merge_points;
    reader.mesh = out;
    reader.failure = failure;
    reader.largest_index = -1;

    if (size == 0) return fail_with(failure, kStatusRead, "byte 0: the file is empty");
    if (size >= 2 && (memcmp(data, "\xff\xfe", 2) == 0 || memcmp(data, "\xfe\xff", 2) == 0))
        return fail_with(failure, kStatusRead, "byte 0: the text is UTF-16, which mesh files do not use");
    if (size >= 3 && memcmp(data, "\xef\xbb\xbf", 3) == 0) reader.text.at += 3; /* UTF-8 mark */

    bool ok;
    out->format = choose_format(path, &reader.text);
    switch (out->format) {
    case kFormatObj:
        reader.first_index = 1;
        ok = read_obj(&reader);
        break;
    case kFormatOff:
        ok = read_off(&reader);
        break;
    case kFormatPly:
        ok = read_ply(&reader);
        break;
    case kFormatStl:
        ok = read_stl(&reader);
        break;
    default:
        ok =
            fail_with(failure, kStatusRead, "byte 0: the name ends in none of .obj .off .ply .stl, and the content is not known");
    }
    if (ok && reader.largest_index >= out->vertex_count)
        ok = fail_with(failure, kStatusRead, "%s %lld: a face refers to vertex %lld, but the file has %lld (counting from %d)",
                       reader.binary ? "byte" : "line", (long long)reader.largest_index_place,
                       (long long)reader.largest_index + reader.first_index, (long long)out->vertex_count, reader.first_index);
    ok = ok && finish_layers(out, failure);
    if (!ok) mesh_file_free(out);
    return ok;
}

bool mesh_file_read(const char* path, bool merge_points, MeshFile* out, Failure* failure) {
    Source source;
    memset(out, 0, sizeof *out);
    Failure cause = {NULL, ""};
    bool ok = source_read(path, &source, &cause) && mesh_file_parse(path, source.data, source.size, merge_points, out, &cause);
    if (!ok) fail_with(failure, cause.status, "%s: %s%s", path, cause.text, source.compressed ? " (decompressed)" : "");
    source_free(&source);
    return ok;
}

void mesh_file_free(MeshFile* mesh) {
    free(mesh->positions);
    free(mesh->corner_verts);
    free(mesh->face_sizes);
    layers_free(&mesh->layers);
    names_free(&mesh->libraries);
    names_free(&mesh->left_out);
    tags_free(&mesh->tags);
    memset(mesh, 0, sizeof *mesh);
}

bool reader_fail(Reader* reader, const char* format, ...) {
    char sentence[512];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(sentence, sizeof sentence, format, arguments);
    va_end(arguments);
    return fail_with(reader->failure, kStatusRead, "%s %lld: %s", reader->binary ? "byte" : "line",
                     (long long)reader_place(reader, &reader->text), sentence);
}

bool reader_add_layer(Reader* reader, Layer* layer) {
    return layers_add(&reader->mesh->layers, layer) || fail_memory(reader->failure);
}

bool reader_leave_out(Reader* reader, const char* what, size_t length) {
    char words[96];
    size_t n = 0;
    for (; n < length && n < sizeof words; ++n) words[n] = what[n] > 31 && what[n] != 127 ? what[n] : '?';
    return names_add(&reader->mesh->left_out, words, n) >= 0 || fail_memory(reader->failure);
}

bool reader_expected(Reader* reader, const char* what) {
    char quote[kTextQuoteSize];
    if (reader->text.at == reader->text.end) return reader_fail(reader, "the file ended where %s was expected", what);
    if (text_is_newline(*reader->text.at)) return reader_fail(reader, "the line ended where %s was expected", what);
    return reader_fail(reader, "expected %s, found '%s'", what, text_quote(&reader->text, quote));
}

static bool resize(Reader* reader, void** array, int64_t* capacity, int64_t wanted, size_t element) {
    if (wanted <= *capacity) return true;
    void* grown = realloc(*array, (size_t)wanted * element);
    if (!grown) return fail_memory(reader->failure);
    *array = grown;
    *capacity = wanted;
    return true;
}

bool reader_grow(Reader* reader, void** array, int64_t* capacity, size_t element, const char* what) {
    if (interrupt_signal) return fail_with(reader->failure, kStatusCancelled, "the read was cancelled");
    if (*capacity >= INT32_MAX) return reader_fail(reader, "more than 2147483647 %s", what);
    int64_t wanted = *capacity + *capacity / 2 + 256;
    return resize(reader, array, capacity, wanted < INT32_MAX ? wanted : INT32_MAX, element);
}

static size_t position_size(const Reader* reader) {
    return 3 * (reader->mesh->precision == DELMESH_FLOAT32 ? sizeof(float) : sizeof(double));
}

bool reader_reserve(Reader* reader, int64_t vertices, int64_t faces, int64_t corners) {
    MeshFile* mesh = reader->mesh;
    if (vertices > INT32_MAX || corners > INT32_MAX || faces > INT32_MAX)
        return reader_fail(reader, "more than 2147483647 vertices, faces or corners");
    int64_t face_capacity = reader->face_capacity;
    if (!mesh->face_sizes) reader->face_capacity = faces > face_capacity ? faces : face_capacity;
    return resize(reader, &mesh->positions, &reader->vertex_capacity, vertices, position_size(reader)) &&
           resize(reader, (void**)&mesh->corner_verts, &reader->corner_capacity, corners, sizeof(int32_t));
}

bool reader_grow_vertices(Reader* reader) {
    return reader_grow(reader, &reader->mesh->positions, &reader->vertex_capacity, position_size(reader), "vertices");
}

bool reader_grow_corners(Reader* reader) {
    return reader_grow(reader, (void**)&reader->mesh->corner_verts, &reader->corner_capacity, sizeof(int32_t), "face corners");
}

/* The array of sizes starts with the first face that is no triangle: most files have none. */
bool reader_note_size(Reader* reader, int64_t size) {
    MeshFile* mesh = reader->mesh;
    if (!mesh->face_sizes) {
        int64_t capacity = mesh->face_count + 256;
        if (capacity < reader->face_capacity) capacity = reader->face_capacity;
        reader->face_capacity = 0;
        if (!resize(reader, (void**)&mesh->face_sizes, &reader->face_capacity, capacity, sizeof(int32_t))) return false;
        for (int64_t i = 0; i < mesh->face_count; ++i) mesh->face_sizes[i] = 3;
    }
    if (mesh->face_count == reader->face_capacity &&
        !reader_grow(reader, (void**)&mesh->face_sizes, &reader->face_capacity, sizeof(int32_t), "faces"))
        return false;
    mesh->face_sizes[mesh->face_count] = (int32_t)size;
    return true;
}
