/* SPDX-License-Identifier: Apache-2.0
 *
 * mesh_file.h: a mesh as a file has it: positions at the precision in which they are stored, faces of any size, the order kept.
 *
 * Why own readers: of the readers at hand, over 259 odd and broken files, assimp 5.2.5 was killed by a signal on 2 and hung on 2,
 * CGAL 5.5's died on 8 and OpenMesh 9's on 10; and none keeps order, precision and the place of an error at once.
 *
 * What all readers here promise: the answer is a mesh or one sentence with the line (text) or byte offset (binary) of the first
 * error; time is linear in the size of the (decompressed) file; nothing is allocated on the word of a header alone, so that
 * memory stays below 20 bytes per byte of it, 60 where an OBJ file has UVs and normals. What a file says about its layers never
 * makes it unreadable, as long as numbers stand where numbers belong.
 */
#ifndef DELMESH_CLI_MESH_FILE_H
#define DELMESH_CLI_MESH_FILE_H

#include "failure.h"
#include "layers.h"
#include "output.h"
#include "tags.h"

#include <delmesh/delmesh.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef enum MeshFormat { kFormatUnknown, kFormatObj, kFormatOff, kFormatPly, kFormatStl } MeshFormat;
typedef enum Encoding { kEncodingDefault, kEncodingAscii, kEncodingLittle, kEncodingBig } Encoding;

typedef struct MeshFile {
    MeshFormat format;
    int32_t
        precision; /* of `positions`: DELMESH_FLOAT32 (binary STL, PLY floats) or DELMESH_FLOAT64 (text, PLY doubles, integers) */
    int64_t vertex_count, face_count, corner_count;
    void* positions;       /* vertex_count x 3 */
    int32_t* corner_verts; /* corner_count, all in [0, vertex_count) */
    int32_t* face_sizes;   /* face_count; NULL: all are triangles */
    int64_t merged_points; /* STL: corners that an earlier corner at the same point stands for */
    Layers layers;         /* each with as many elements as there are of its domain */
    Names libraries;       /* OBJ: the files that mtllib lines name, as they stand there; PLY: those of TextureFile comments */
    Tags tags;             /* OBJ: of cages; indices may be out of range */
    Names left_out;        /* what the file has besides, in words: it is not read */
} MeshFile;

/* By the end of the name (.gz left off); kFormatUnknown if there is none of ours. `ascii`, if not NULL, is set for .stla. */
MeshFormat mesh_format_of_name(const char* path, bool* ascii);
const char* mesh_format_name(MeshFormat format);

/* The format is that of the name, unless the file begins with the mark of a PLY or OFF file (or, under a name that says nothing,
 * of an STL file). STL has no vertices of its own: with merge_points its distinct points, in order of first appearance, are the
 * vertices (-0 counts as 0); without, every corner is a vertex. */
bool mesh_file_read(const char* path, bool merge_points, MeshFile* out, Failure* failure);
/* The same from memory; data[size] must be '\0'. */
bool mesh_file_parse(const char* path, const char* data, size_t size, bool merge_points, MeshFile* out, Failure* failure);
void mesh_file_free(MeshFile* mesh);

/* Whether this mesh can be written so; format from the name. Says no with a sentence, before any work is done. */
bool mesh_file_can_write(const char* path, Encoding encoding, int32_t precision, Failure* failure);
/* Writes a triangle mesh (face_sizes NULL) atomically: the file at `path` is the old one or the whole new one.
 * Default encodings: text for OBJ and OFF, little-endian binary for PLY and STL. Reading it gives the same numbers,
 * bit for bit. */
bool mesh_file_write(const char* path, Encoding encoding, const MeshFile* mesh, Failure* failure);
/* Why files of the format cannot hold the layer; NULL: they can, at least if it is the first of its kind and, for normals and
 * colours of corners, where the corners of each vertex agree. */
const char* mesh_format_refuses(MeshFormat format, const Layer* layer);
/* Brings the layers into the form that the format of `path` has, and takes out those that it cannot hold; what is lost by that is
 * added to `lost`, in words. mesh_file_write needs it. */
bool mesh_file_fit(const char* path, MeshFile* mesh, Names* lost, Failure* failure);
/* Adds such words. */
bool mesh_file_lose(Names* lost, Failure* failure, const char* format, ...) __attribute__((format(printf, 3, 4)));
/* The same up to output_finish: `out` waits for its output_commit. */
bool mesh_file_prepare(const char* path, Encoding encoding, const MeshFile* mesh, Output* out, Failure* failure);

#endif
