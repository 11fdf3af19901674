/* SPDX-License-Identifier: Apache-2.0
 *
 * reader.h: what the four readers share: the mesh under construction, where they stand, and how they say what is wrong.
 */
#ifndef DELMESH_CLI_READER_H
#define DELMESH_CLI_READER_H

#include "interrupt.h"
#include "mesh_file.h"
#include "text.h"

typedef struct Reader {
    Text text;         /* of the whole file; binary readers move text.at themselves */
    const char* begin; /* of the file */
    bool binary;       /* errors name the byte offset of text.at instead of its line */
    bool merge_points;
    int first_index; /* that the format gives to the first vertex: for error sentences */
    MeshFile* mesh;
    Failure* failure;
    int64_t vertex_capacity, face_capacity, corner_capacity;
    int64_t face_begin;    /* first corner of the face that is being read */
    int64_t largest_index; /* of all corners so far, and where it stood */
    int64_t largest_index_place;
} Reader;

bool read_obj(Reader* reader);
bool read_off(Reader* reader);
bool read_ply(Reader* reader);
bool read_stl(Reader* reader);

/* Records "line 12: ..." or "byte 34: ..." for the place where the reader stands. Returns false. */
bool reader_fail(Reader* reader, const char* format, ...) __attribute__((format(printf, 2, 3)));
/* "line 12: expected <what>, found 'blah'", or that the file ended. Returns false. */
bool reader_expected(Reader* reader, const char* what);
static inline size_t reader_left(const Reader* reader) {
    return (size_t)(reader->text.end - reader->text.at);
}

/* Takes the layer over. */
bool reader_add_layer(Reader* reader, Layer* layer);
/* Something that the file has and nobody will see. */
bool reader_leave_out(Reader* reader, const char* what, size_t length);
/* More room for an array of such elements, by a half; `what` they are, for the sentence if there are too many. */
bool reader_grow(Reader* reader, void** array, int64_t* capacity, size_t element, const char* what);
/* Room for so many in all, for counts that the size of the file has confirmed. */
bool reader_reserve(Reader* reader, int64_t vertices, int64_t faces, int64_t corners);
bool reader_grow_vertices(Reader* reader);
bool reader_grow_corners(Reader* reader);
bool reader_note_size(Reader* reader, int64_t size);

static inline bool reader_add_vertex(Reader* reader, const double position[3]) {
    MeshFile* mesh = reader->mesh;
    if (mesh->vertex_count == reader->vertex_capacity && !reader_grow_vertices(reader)) return false;
    if (mesh->precision == DELMESH_FLOAT32) {
        float* p = (float*)mesh->positions + 3 * mesh->vertex_count;
        for (int k = 0; k < 3; ++k) p[k] = (float)position[k]; /* they were floats: exact */
    } else {
        double* p = (double*)mesh->positions + 3 * mesh->vertex_count;
        for (int k = 0; k < 3; ++k) p[k] = position[k];
    }
    ++mesh->vertex_count;
    return true;
}

/* The line, or the byte offset in binary, of a place in the text. */
static inline int64_t reader_place(const Reader* reader, const Text* text) {
    return reader->binary ? text->at - reader->begin : text->line;
}

/* index counts from 0 and is not negative; whether such a vertex exists is checked when all is read, as faces may come first.
 * place: where it was read. */
static inline bool reader_add_corner(Reader* reader, int64_t index, int64_t place) {
    MeshFile* mesh = reader->mesh;
    if (mesh->corner_count == reader->corner_capacity && !reader_grow_corners(reader)) return false;
    if (index > reader->largest_index) {
        reader->largest_index = index;
        reader->largest_index_place = place;
    }
    mesh->corner_verts[mesh->corner_count++] = (int32_t)index;
    return true;
}

/* The corners added since the last call are a face, whatever their number: the library counts what is none. */
static inline bool reader_close_face(Reader* reader) {
    MeshFile* mesh = reader->mesh;
    int64_t size = mesh->corner_count - reader->face_begin;
    if ((size != 3 || mesh->face_sizes) && !reader_note_size(reader, size)) return false;
    ++mesh->face_count;
    reader->face_begin = mesh->corner_count;
    return !interrupt_signal || fail_with(reader->failure, kStatusCancelled, "the read was cancelled");
}

#endif
