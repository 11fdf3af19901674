/* SPDX-License-Identifier: Apache-2.0
 *
 * The readers, from memory: for each format files whose content is known, and the sentence for each kind of mistake.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "bytes.h"
#include "mesh_file.h"

#define COUNT(array) (sizeof(array) / sizeof *(array))

/* A text of the given size in memory of exactly that size and a '\0', so that sanitizers see a read beyond it. */
static bool parse(const char* name, const char* data, size_t size, bool merge, MeshFile* out, Failure* failure) {
    char* copy = malloc(size + 1);
    assert_non_null(copy);
    memcpy(copy, data, size);
    copy[size] = '\0';
    *failure = (Failure){NULL, ""};
    bool ok = mesh_file_parse(name, copy, size, merge, out, failure);
    free(copy);
    return ok;
}

/* Checks vertices (3 numbers each) and faces ("0 1 2|3 4 5 6"). */
static void check_mesh(const MeshFile* mesh, int32_t precision, const double* positions, int64_t vertices, const char* faces) {
    assert_int_equal(mesh->precision, precision);
    assert_int_equal(mesh->vertex_count, vertices);
    for (int64_t i = 0; i < 3 * vertices; ++i) {
        const double x =
            precision == DELMESH_FLOAT32 ? (double)((const float*)mesh->positions)[i] : ((const double*)mesh->positions)[i];
        if (memcmp(&x, &positions[i], sizeof x) != 0) fail_msg("coordinate %d is %.17g, not %.17g", (int)i, x, positions[i]);
    }
    char found[512] = "";
    int64_t corner = 0;
    for (int64_t f = 0; f < mesh->face_count; ++f) {
        const int64_t size = mesh->face_sizes ? mesh->face_sizes[f] : 3;
        for (int64_t k = 0; k < size; ++k)
            sprintf(found + strlen(found), "%s%d", k ? " " : f ? "|" : "", (int)mesh->corner_verts[corner++]);
        if (size == 0) strcat(found, "|");
    }
    assert_int_equal(corner, mesh->corner_count);
    assert_string_equal(found, faces);
}

static const double kTriangle[] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
static const double kSquare[] = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0};

typedef struct GoodText {
    const char *name, *text;
    const double* positions;
    int64_t vertices;
    const char* faces;
} GoodText;

static void check_good(const GoodText* cases, size_t count) {
    for (size_t i = 0; i < count; ++i) {
        MeshFile mesh;
        Failure failure;
        if (!parse(cases[i].name, cases[i].text, strlen(cases[i].text), true, &mesh, &failure))
            fail_msg("case %zu: %s\n%s", i, failure.text, cases[i].text);
        check_mesh(&mesh, DELMESH_FLOAT64, cases[i].positions, cases[i].vertices, cases[i].faces);
        mesh_file_free(&mesh);
    }
}

typedef struct BadText {
    const char *name, *text, *sentence;
} BadText;

static void check_bad(const BadText* cases, size_t count) {
    for (size_t i = 0; i < count; ++i) {
        MeshFile mesh;
        Failure failure;
        if (parse(cases[i].name, cases[i].text, strlen(cases[i].text), true, &mesh, &failure))
            fail_msg("case %zu was read:\n%s", i, cases[i].text);
        assert_string_equal(failure.text, cases[i].sentence);
        assert_string_equal(failure.status, kStatusRead);
        assert_null(mesh.positions);
    }
}

#define V3 "v 0 0 0\nv 1 0 0\nv 0 1 0\n"

static void test_obj(void** state) {
    (void)state;
    const GoodText good[] = {
        {"a.obj", V3 "f 1 2 3\n", kTriangle, 3, "0 1 2"},
        {"a.obj", "\xef\xbb\xbf" V3 "f 1 2 3", kTriangle, 3, "0 1 2"}, /* UTF-8 mark, no last line end */
        {"a.OBJ", "v 0 0 0\r\nv 1 0 0\r\nv 0 1 0\r\nf 1 2 3\r\n", kTriangle, 3, "0 1 2"},
        {"a.obj", "v 0 0 0\rv 1 0 0\rv 0 1 0\rf 1 2 3\r", kTriangle, 3, "0 1 2"},
        {"a.obj",
         "# c \\\n\n  v\t0 0 0 1.0\nv 1 0 0 .5 .5 .5 # red\nv 0 1 0 nan 0 0\ng v\nvt 0 0\nvn 0 0 1\nf 1/1/1 2//1 3/1 # f\n",
         kTriangle, 3, "0 1 2"},
        {"a.obj", V3 "f -3 -2 -1\n", kTriangle, 3, "0 1 2"},
        {"a.obj", "f 1 2 3\n" V3, kTriangle, 3, "0 1 2"},                                      /* faces first */
        {"a.obj", "v 0 \\\n0 0\nv 1 0 0\nv 0 1 0\nf 1 \\\r\n2\\\n3\n", kTriangle, 3, "0 1 2"}, /* joined lines */
        {"a.obj", V3 "f 1// 2/ 3/1/\n", kTriangle, 3, "0 1 2"},
        {"a.obj", V3 "v 0 0 1\nf 1 2 3\nf 2 1 4 3\nf 1 2\nf 1 2 \\", (const double[]){0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1}, 4,
         "0 1 2|1 0 3 2|0 1|0 1"},
        {"a.obj", V3 "usemtl \\\nf 9 9 9\nfacet\nvp 1\nf 1 1 1\n", kTriangle, 3,
         "0 0 0"}, /* left out: the joined line, other words */
        {"a.obj", "v +0 -0 1e1\n", (const double[]){0, -0.0, 10}, 1, ""},
    };
    check_good(good, COUNT(good));
    static const BadText bad[] = {
        {"a.obj", "v 0 0 0\nv 1 0\nv 1 1 1\n", "line 2: the line ended where a coordinate was expected"},
        {"a.obj", "v 0 0 0\nv", "line 2: the file ended where a coordinate was expected"},
        {"a.obj", "v 0 0 1,5\n", "line 1: expected a coordinate, found '1,5'"},
        {"a.obj", "\n\nv 0 \\\n0 3.1+e2\n", "line 4: expected a coordinate, found '3.1+e2'"},
        {"a.obj", V3 "f 0 1 2\n", "line 4: a face refers to vertex 0, but OBJ counts from 1"},
        {"a.obj", V3 "f -1 -2 -4\n", "line 4: a face refers to vertex -4, but only 3 came before"},
        {"a.obj", V3 "f 1 2 3\nf 1 4 7\nf 1 5 2\n", "line 5: a face refers to vertex 7, but the file has 3 (counting from 1)"},
        {"a.obj", V3 "f 1 2 99999999999999999999\n", "line 4: expected a face corner, found '99999999999999999999'"},
        {"a.obj", V3 "f 1 2 4294967297\n", "line 4: a face refers to vertex 4294967297, but only 3 came before"},
        {"a.obj", V3 "f 1//// 2 3\n", "line 4: expected a face corner, found '1////'"},
        {"a.obj", V3 "f 1 2.5 3\n", "line 4: expected a face corner, found '2.5'"},
        {"a.obj", V3 "f 1/x 2 3\n", "line 4: expected a face corner, found '1/x'"},
        {"a.obj", "\xff\xfev\0", "byte 0: the text is UTF-16, which mesh files do not use"},
        {"a.obj", "", "byte 0: the file is empty"},
        {"a.obj", "hello\nworld\n", "line 3: the file ended without a vertex or a face"},
    };
    check_bad(bad, COUNT(bad));
    MeshFile mesh;
    Failure failure;
    static const char nul[] = "v 0 0 0\nv 0 \0 0\n"; /* a zero byte is no end */
    assert_false(parse("a.obj", nul, sizeof nul - 1, true, &mesh, &failure));
    assert_string_equal(failure.text, "line 2: expected a coordinate, found '?'");
}

static void test_off(void** state) {
    (void)state;
    static const double one_per_line[] = {1, 2, 3};
    const GoodText good[] = {
        {"a.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", kTriangle, 3, "0 1 2"},
        {"a.off", "OFF 3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2", kTriangle, 3, "0 1 2"},
        {"a.off", "OFF3 1 # x\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", kTriangle, 3, "0 1 2"},
        {"a.off", "3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", kTriangle, 3, "0 1 2"},
        {"a.off", "# c\n\n\tOFF # x\n#\n 3 1\n\n0 0 0\n# y\n1 0 0\n0 1 0\n3 0 1 2 255 0 0 # red\n", kTriangle, 3, "0 1 2"},
        {"a.off", "COFF\r\n3 1 0\r\n0 0 0 1 0 0 1\r\n1 0 0 9\r\n0 1 0 9\r\n3 0 1 2 1.0 0.5 0\r\n", kTriangle, 3, "0 1 2"},
        {"a.off", "STCNOFF\n3 1 0\n0 0 0 0 0 1 1 1 1 1 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", kTriangle, 3, "0 1 2"},
        {"a.off", "nOFF 3\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", kTriangle, 3, "0 1 2"},
        {"a.off", "OFF\n4 3 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1\n2 3\n3 0 1 2\n0\n", kSquare, 4, "0 1 2 3|0 1 2|"},
        {"a.off", "OFF\n1\n0\n0\n1\n2\n3\n", one_per_line, 1, ""}, /* one number per line */
        {"a.off", "OFF\n1 0\n1 2 3\n", one_per_line, 1, ""},
        {"a.obj", "OFF\n1 0 0\n1 2 3\n", one_per_line, 1, ""}, /* content outweighs the name */
        {"a", "OFF\n1 0 0\n1 2 3\n", one_per_line, 1, ""},
        {"a.off", "OFF\n0 0 0\n", NULL, 0, ""},
    };
    check_good(good, COUNT(good));
    static const BadText bad[] = {
        {"a.off", "OFX\n", "line 1: expected OFF, found 'OFX'"},
        {"a.off", "4OFF\n1 0 0\n0 0 0 1\n", "line 1: 4OFF: vertices with four coordinates are not points in space"},
        {"a.off", "nOFF\n5\n1 0 0\n", "line 2: nOFF: vertices with 5 coordinates are not points in space"},
        {"a.off", "OFF\n-3 1 0\n", "line 2: the number of vertices is -3"},
        {"a.off", "OFF\n99999999999999999999 1 0\n", "line 2: expected the number of vertices, found '99999999999999999999'"},
        {"a.off", "OFF\n4000000000 1 0\n0 0 0\n",
         "line 2: 4000000000 vertices are announced, but the file has room for 1 at most"},
        {"a.off", "OFF\n1 4000000000 0\n0 0 0\n", "line 2: 4000000000 faces are announced, but the file has room for 1 at most"},
        {"a.off", "OFF\n2 0 0\n0 0 0.0000\n0 x 0\n", "line 4: expected a coordinate, found 'x'"},
        {"a.off", "OFF\n2 0 0\n0 0 0.000000000000\n", "line 4: the file ended in vertex 1 of 2"},
        {"a.off", "OFF\n1 1 0\n0 0 0\n2000000000 0 0 0\n",
         "line 4: face 0 announces 2000000000 corners, but the file ends before"},
        {"a.off", "OFF\n1 1 0\n0 0 0\n-3 0 0 0\n", "line 4: the number of corners is -3"},
        {"a.off", "OFF\n1 2 0\n0 0 0\n3 0 0 0\n3 0 0 1\n", "line 5: face 1 refers to vertex 1 of 1 (counting from 0)"},
        {"a.off", "OFF\n1 1 0\n0 0 0\n3 0 0 -1\n", "line 4: a vertex index is -1"},
        {"a.off", "OFF\n1 2 0\n0 0 0\n3 0 0 0 7 7 7\n", "line 5: the file ended before face 1 of 2"},
    };
    check_bad(bad, COUNT(bad));
}

static size_t put_words(char* at, ByteOrder order, const char* kinds, ...) {
    va_list arguments;
    va_start(arguments, kinds);
    size_t size = 0;
    for (; *kinds; ++kinds, size += 4) {
        if (*kinds == 'i')
            bytes_put_u32(at + size, (uint32_t)va_arg(arguments, int), order);
        else
            bytes_put_f32(at + size, (float)va_arg(arguments, double), order);
    }
    va_end(arguments);
    return size;
}

static void test_off_binary(void** state) {
    (void)state;
    for (int variant = 0; variant < 4; ++variant) { /* both orders, with colours and without */
        const ByteOrder order = variant & 1 ? kBigEndian : kLittleEndian;
        char data[256] = "OFF BINARY\n";
        size_t size = strlen(data);
        size += put_words(data + size, order, "iii", 4, 2, 0);
        for (int i = 0; i < 12; ++i) size += put_words(data + size, order, "f", kSquare[i]);
        size += put_words(data + size, order, "iiii", 3, 0, 1, 2);
        if (variant & 2) size += put_words(data + size, order, "iffff", 4, 1.0, 0.0, 0.0, 1.0);
        size += put_words(data + size, order, "iiiii", 4, 0, 1, 2, 3);
        if (variant & 2) size += put_words(data + size, order, "i", 0);
        MeshFile mesh;
        Failure failure;
        if (!parse("a.off", data, size, true, &mesh, &failure)) fail_msg("variant %d: %s", variant, failure.text);
        check_mesh(&mesh, DELMESH_FLOAT32, kSquare, 4, "0 1 2|0 1 2 3");
        mesh_file_free(&mesh);
        /* Cut anywhere it is refused, or (cut behind the last face) the same. */
        for (size_t cut = 12; cut < size - 4; ++cut) assert_false(parse("a.off", data, cut, true, &mesh, &failure));
    }
}

#define PLY(format, body) "ply\nformat " format " 1.0\ncomment c\n" body
#define XYZ "property float x\nproperty float y\nproperty float z\n"
#define LIST "property list uchar int vertex_indices\nend_header\n"

static void test_ply_ascii(void** state) {
    (void)state;
    const GoodText good[] = {
        {"a.ply", PLY("ascii", "element vertex 3\n" XYZ "element face 1\n" LIST "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"), kTriangle, 3,
         "0 1 2"},
        {"a.obj", PLY("ascii", "element vertex 3\n" XYZ "element face 1\n" LIST "0 0 0\n1 0 0\n0 1 0\n3 0 1 2"), kTriangle, 3,
         "0 1 2"},
        {"a.ply",
         "ply\rformat ascii 1.0\relement vertex 1\rproperty double x\rproperty double y\rproperty double z\rend_header\r1 2 3\r",
         (const double[]){1, 2, 3}, 1, ""},
        {"a.ply",
         "ply\r\nformat ascii 1.0\r\nelement vertex 1\r\nproperty int x\r\nproperty int y\r\nproperty int z\r\nend_header\r\n1 2 "
         "3",
         (const double[]){1, 2, 3}, 1, ""},
        /* faces first, other properties, other elements, lists of sizes written as reals */
        {"a.ply",
         PLY("ascii", "element face 2\nproperty uchar red\nproperty list float uint vertex_index\nproperty list int float w\n"
                      "element camera 2\nproperty float a\nproperty list uchar int b\nelement nothing 4000000000\n"
                      "element vertex 4\nproperty double z\nproperty uchar q\nproperty double y\nproperty double x\nend_header\n"
                      "7 3.0 0 1 2 0\n7 4 0 1 2 3 2 .5 .5\n1 0\n2 3 1 2 3\n0 9 0 0\n0 9 0 1\n0 9 1 1\n0 9 1 0\n"),
         kSquare, 4, "0 1 2|0 1 2 3"},
        /* strips: every second triangle is turned; -1 starts anew; a repeated vertex is no face but counts for the turning */
        {"a.ply",
         PLY("ascii", "element vertex 4\n" XYZ "element tristrips 1\nproperty list int int vertex_indices\nend_header\n"
                      "0 0 0 1 0 0 1 1 0 0 1 0\n14 0 1 2 3 -1 1 2 3 -1 0 1 1 2 3\n"),
         kSquare, 4, "0 1 2|2 1 3|1 2 3|1 2 3"},
        {"a.ply", PLY("ascii", "obj_info\nelement vertex 0\n" XYZ "element face 0\n" LIST), NULL, 0, ""},
    };
    check_good(good, COUNT(good));
    static const BadText bad[] = {
        {"a.ply", "\x89PNG\r\n", "line 1: expected ply, found '?PNG'"},
        {"a.ply", "ply\nformat ascii 1.0\nelement vertex 3\n", "line 4: the file ended before end_header"},
        {"a.ply", "ply\nend_header\n", "line 2: end_header came before format"},
        {"a.ply", "ply\nformat utf8 1.0\n", "line 2: expected ascii, binary_little_endian or binary_big_endian, found 'utf8'"},
        {"a.ply", PLY("ascii", "property float x\n"), "line 4: a property before the first element"},
        {"a.ply", PLY("ascii", "element vertex many\n"), "line 4: expected the number of elements, found 'many'"},
        {"a.ply", PLY("ascii", "element vertex -1\n"), "line 4: the number of elements is -1"},
        {"a.ply", PLY("ascii", "element vertex 1\nproperty quad x\n"), "line 5: expected a type, found 'quad'"},
        {"a.ply", PLY("ascii", "element vertex 1\nproperty list x\n"), "line 5: expected the type of a list's size, found 'x'"},
        {"a.ply", PLY("ascii", "element vertex 1\nproperty float x\nproperty float x\n"),
         "line 6: a second property of the same name"},
        {"a.ply", PLY("ascii", "element vertex 1\nelement vertex 1\n"), "line 5: a second element vertex"},
        {"a.ply", PLY("ascii", "junk\n"), "line 4: expected a statement of a PLY header, found 'junk'"},
        {"a.ply", PLY("ascii", "element vertex 1\nproperty float x\nend_header\n0\n"),
         "line 7: element vertex has no properties x, y and z"},
        {"a.ply", PLY("ascii", "element face 1\nproperty int a\nend_header\n0\n"),
         "line 7: element face has no list vertex_indices"},
        {"a.ply", PLY("ascii", "element vertex 4294967295\n" XYZ "end_header\n0 0 0\n"),
         "line 9: 4294967295 elements of kind vertex are announced, but the file has room for 1 at most"},
        {"a.ply", PLY("ascii", "element vertex 2\n" XYZ "end_header\n0 0 0\n0 J 0\n"), "line 10: expected a number, found 'J'"},
        {"a.ply", PLY("ascii", "element vertex 2\n" XYZ "end_header\n0 0 0.0000\n0 0\n"),
         "line 11: the file ended where a number was expected"},
        {"a.ply", PLY("ascii", "element vertex 1\n" XYZ "element face 2\n" LIST "0 0 0\n3 0 0 0\n3 0\n0 5\n"),
         "line 14: a face refers to vertex 5, but the file has 1 (counting from 0)"},
        {"a.ply", PLY("ascii", "element vertex 1\n" XYZ "element face 1\n" LIST "0 0 0\n-3 0 0 0\n"),
         "line 12: -3 is no size for a list"},
        {"a.ply", PLY("ascii", "element vertex 1\n" XYZ "element face 1\n" LIST "0 0 0\n3 0 0.5 0\n"),
         "line 12: 0.5 is no vertex index"},
        {"a.ply", PLY("ascii", "element vertex 1\n" XYZ "element face 1\n" LIST "0 0 0\n3 0 -1 0\n"),
         "line 12: -1 is no vertex index"},
        {"a.ply", PLY("ascii", "element vertex 1\n" XYZ "element face 1\n" LIST "0 0 0\n3 0 nan 0\n"),
         "line 12: nan is no vertex index"},
    };
    check_bad(bad, COUNT(bad));
}

static void test_ply_binary(void** state) {
    (void)state;
    static const char* const formats[] = {"binary_little_endian", "binary_big_endian"};
    for (int order = 0; order < 2; ++order) {
        char data[640];
        int header =
            sprintf(data,
                    "ply\nformat %s 1.0\nelement extra 2\nproperty short a\nproperty list uchar double b\nelement vertex 4\n"
                    "property uchar q\nproperty float x\nproperty float y\nproperty float z\nelement face 2\n"
                    "property list ushort uint vertex_indices\nproperty float w\nend_header\n",
                    formats[order]);
        char* at = data + header;
        const ByteOrder o = order ? kBigEndian : kLittleEndian;
        for (int i = 0; i < 2; ++i) { /* extra: a list of i doubles */
            memset(at, 0x55, 2);
            at[2] = (char)i;
            at += 3;
            for (int k = 0; k < i; ++k, at += 8) bytes_put_f64(at, 1.5, o);
        }
        for (int v = 0; v < 4; ++v) {
            *at++ = '\n'; /* a byte that must not be taken for a line end */
            for (int k = 0; k < 3; ++k, at += 4) bytes_put_f32(at, (float)kSquare[3 * v + k], o);
        }
        for (int f = 0; f < 2; ++f) {
            at[order] = (char)(3 + f);
            at[1 - order] = 0;
            at += 2;
            for (int k = 0; k < 3 + f; ++k, at += 4) bytes_put_u32(at, (uint32_t)k, o);
            bytes_put_f32(at, 9, o);
            at += 4;
        }
        const size_t size = (size_t)(at - data);
        MeshFile mesh;
        Failure failure;
        if (!parse("a.ply", data, size, true, &mesh, &failure)) fail_msg("%s", failure.text);
        check_mesh(&mesh, DELMESH_FLOAT32, kSquare, 4, "0 1 2|0 1 2 3");
        mesh_file_free(&mesh);
        for (size_t cut = 0; cut < size; ++cut) assert_false(parse("a.ply", data, cut, true, &mesh, &failure));

        bytes_put_u32(data + size - 8, 4, o); /* the last corner: one too many */
        assert_false(parse("a.ply", data, size, true, &mesh, &failure));
        char sentence[128];
        sprintf(sentence, "byte %d: a face refers to vertex 4, but the file has 4 (counting from 0)", (int)size - 8);
        assert_string_equal(failure.text, sentence);
        bytes_put_u32(data + size - 8, 0xffffffffu, o);
        assert_false(parse("a.ply", data, size, true, &mesh, &failure));
        sprintf(sentence, "byte %d: 4294967295 is no vertex index", (int)size - 8);
        assert_string_equal(failure.text, sentence);
    }
}

/* Doubles, and a mix of types, are kept as doubles. */
static void test_ply_precision(void** state) {
    (void)state;
    static const char* const types[] = {"double", "double", "double", "float", "float", "double", "int", "uchar", "short"};
    for (int i = 0; i < 9; i += 3) {
        char data[256];
        int size = sprintf(
            data,
            "ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty %s x\nproperty %s y\nproperty %s z\nend_header\n",
            types[i], types[i + 1], types[i + 2]);
        double expected[3];
        for (int k = 0; k < 3; ++k) {
            const char* type = types[i + k];
            if (*type == 'd')
                bytes_put_f64(data + size, expected[k] = 0.1 + k, kLittleEndian), size += 8;
            else if (*type == 'f')
                bytes_put_f32(data + size, 0.1f, kLittleEndian), expected[k] = (double)0.1f, size += 4;
            else if (*type == 'i')
                bytes_put_u32(data + size, 0x80000001u, kLittleEndian), expected[k] = -2147483647.0, size += 4;
            else if (*type == 'u')
                data[size++] = (char)200, expected[k] = 200;
            else
                data[size] = 0, data[size + 1] = (char)0x80, expected[k] = -32768, size += 2;
        }
        MeshFile mesh;
        Failure failure;
        assert_true(parse("a.ply", data, (size_t)size, true, &mesh, &failure));
        check_mesh(&mesh, DELMESH_FLOAT64, expected, 1, "");
        mesh_file_free(&mesh);
    }
}

#define FACET(a, b, c) "facet normal 0 0 1\nouter loop\nvertex " a "\nvertex " b "\nvertex " c "\nendloop\nendfacet\n"

static void test_stl_ascii(void** state) {
    (void)state;
    static const double with_zero[] = {0, -0.0, 0, 1, 0, 0, 0, 1, 0};
    const GoodText good[] = {
        {"a.stl", "solid a b c\n" FACET("0 0 0", "1 0 0", "1 1 0") FACET("0 0 0", "1 1 0", "0 1 0") "endsolid a b c\n", kSquare,
         4, "0 1 2|0 2 3"},
        {"a", "solid\r\nFACET NORMAL nan nan nan OUTER LOOP VERTEX 0 0 0 VERTEX 1 0 0\r\nVERTEX 0 1 0 ENDLOOP ENDFACET ENDSOLID",
         kTriangle, 3, "0 1 2"},
        {"a.stl",
         "solid a\n" FACET("0 0 0", "1 0 0", "1 1 0") "endsolid\nsolid b\n" FACET("0 0 0", "1 1 0", "0 1 0") "endsolid\n",
         kSquare, 4, "0 1 2|0 2 3"},
        {"a.stl",
         "solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 1 1 0\nvertex 0 1 "
         "0\nendloop\nendfacet\nendsolid\n",
         kSquare, 4, "0 1 2 3"},
        {"a.stl", "solid\n" FACET("0 -0 0", "1 0 0", "0 1 -0") FACET("-0 0 0", "0 1 0", "1 -0 0") "endsolid\n", with_zero, 3,
         "0 1 2|0 2 1"},
        {"a.stl", "solid empty\nendsolid empty\n", NULL, 0, ""},
    };
    /* The third vertex of the signed-zero case keeps its own -0. */
    double third[9];
    memcpy(third, with_zero, sizeof third);
    third[8] = -0.0;
    GoodText cases[COUNT(good)];
    memcpy(cases, good, sizeof cases);
    cases[4].positions = third;
    check_good(cases, COUNT(cases));
    static const BadText bad[] = {
        {"a.stl", "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 blah 0\n", "line 4: expected a coordinate, found 'blah'"},
        {"a.stl", "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nendfacet\n",
         "line 5: expected vertex or endloop, found 'endfacet'"},
        {"a.stl", "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\n",
         "line 5: the file ended where vertex or endloop was expected"},
        {"a.stl", "solid a\ntriangle\n", "line 2: expected facet, endsolid or solid, found 'triangle'"},
        {"a.stl", "hello", "byte 0: this is no ascii STL, and its 5 bytes are too few for a binary one"},
    };
    check_bad(bad, COUNT(bad));
}

static void test_stl_binary(void** state) {
    (void)state;
    static const int corners[] = {0, 1, 2, 0, 2, 3};
    char data[84 + 100] = "solid is how some binary files begin";
    bytes_put_u32(data + 80, 2, kLittleEndian);
    for (int t = 0; t < 2; ++t)
        for (int k = 0; k < 9; ++k)
            bytes_put_f32(data + 84 + 50 * t + 12 + 4 * k, (float)kSquare[3 * corners[3 * t + k / 3] + k % 3], kLittleEndian);
    MeshFile mesh;
    Failure failure;
    const char* const names[] = {"a.stl", "a.STL.gz", "a"};
    for (int i = 0; i < 3; ++i) {
        assert_true(parse(names[i], data, sizeof data, true, &mesh, &failure));
        check_mesh(&mesh, DELMESH_FLOAT32, kSquare, 4, "0 1 2|0 2 3");
        assert_int_equal(mesh.merged_points, 2);
        mesh_file_free(&mesh);
    }
    assert_true(parse("a.stl", data, sizeof data, false, &mesh, &failure)); /* every corner a vertex */
    assert_int_equal(mesh.vertex_count, 6);
    assert_int_equal(mesh.corner_verts[5], 5);
    assert_int_equal(mesh.merged_points, 0);
    mesh_file_free(&mesh);

    memset(data, 0, 80);
    assert_false(parse("a.stl", data, sizeof data - 1, true, &mesh, &failure));
    assert_string_equal(failure.text, "byte 80: 2 triangles are announced, but the file has room for 1");
    bytes_put_u32(data + 80, 0xffffffffu, kLittleEndian);
    assert_false(parse("a.stl", data, sizeof data, true, &mesh, &failure));
    assert_string_equal(failure.text, "byte 80: 4294967295 triangles are announced, but the file has room for 2");
    assert_false(parse("a.stl", data, 83, true, &mesh, &failure));
    assert_string_equal(failure.text, "byte 0: this is no ascii STL, and its 83 bytes are too few for a binary one");
}

static void test_unknown(void** state) {
    (void)state;
    static const BadText bad[] = {
        {"a.xyz", "1 2 3\n", "byte 0: the name ends in none of .obj .off .ply .stl, and the content is not known"},
        {"obj", "v 1 2 3\n", "byte 0: the name ends in none of .obj .off .ply .stl, and the content is not known"},
    };
    check_bad(bad, COUNT(bad));
    bool ascii;
    assert_int_equal(mesh_format_of_name("x/y.ObJ.GZ", NULL), kFormatObj);
    assert_int_equal(mesh_format_of_name("a.stla", &ascii), kFormatStl);
    assert_true(ascii);
    assert_int_equal(mesh_format_of_name("a.stl", &ascii), kFormatStl);
    assert_false(ascii);
    assert_int_equal(mesh_format_of_name(".ply", NULL), kFormatUnknown);
    assert_int_equal(mesh_format_of_name("a.gz", NULL), kFormatUnknown);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_obj),       cmocka_unit_test(test_off),        cmocka_unit_test(test_off_binary),
        cmocka_unit_test(test_ply_ascii), cmocka_unit_test(test_ply_binary), cmocka_unit_test(test_ply_precision),
        cmocka_unit_test(test_stl_ascii), cmocka_unit_test(test_stl_binary), cmocka_unit_test(test_unknown),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
