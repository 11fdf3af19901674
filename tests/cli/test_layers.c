/* SPDX-License-Identifier: Apache-2.0
 *
 * What files say besides positions and faces: what each reader takes, what each writer writes, what is lost between the formats.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include <math.h>
#include <sys/stat.h>
#include <unistd.h>

#include "carry.h"
#include "mesh_file.h"

#define COUNT(array) (sizeof(array) / sizeof *(array))

static int enter_folder(void** state) {
    char* folder = strdup("cli_test_layers.XXXXXX");
    *state = folder;
    return folder && mkdtemp(folder) && chdir(folder) == 0 ? 0 : -1;
}

static int leave_folder(void** state) {
    static const char* const files[] = {"a.obj", "a.ply", "a.off", "a.stl", "b/c", "b", "d"};
    for (size_t i = 0; i < COUNT(files); ++i) remove(files[i]);
    int result = chdir("..") == 0 ? rmdir(*state) : -1;
    free(*state);
    return result;
}

/* In memory of exactly the text's size. */
static MeshFile parse(const char* name, const char* text) {
    const size_t size = strlen(text);
    char* copy = malloc(size + 1);
    assert_non_null(copy);
    memcpy(copy, text, size + 1);
    MeshFile mesh;
    Failure failure = {NULL, ""};
    if (!mesh_file_parse(name, copy, size, true, &mesh, &failure)) fail_msg("%s\n%s", failure.text, text);
    free(copy);
    return mesh;
}

/* "uv corner f64: 0 1|- -|..." for each layer; ids by their names, "-" is NaN. */
static char* describe(const MeshFile* mesh) {
    static const char* const domains[] = {"vertex", "corner", "face"};
    static const char* const types[] = {"i8", "u8", "i16", "u16", "i32", "u32", "f32", "f64", "text"};
    char* out = calloc(1, 1 << 14);
    assert_non_null(out);
    char* at = out;
    for (int32_t i = 0; i < mesh->layers.count; ++i) {
        const Layer* layer = &mesh->layers.items[i];
        at += sprintf(at, "%s%s %s %s%s%s:", i ? "; " : "", layer_kind_name(layer->kind), domains[layer->domain],
                      types[layer->stored], layer->names ? " " : "", layer->names ? layer->names : "");
        for (int64_t e = 0; e < layer->count; ++e) {
            for (int32_t k = 0; k < layer->components; ++k) {
                const double x = layer_get(layer, e, k);
                const char* before = k > 0 ? " " : e > 0 ? "|" : " ";
                if (layer->ids.count > 0)
                    at += sprintf(at, "%s%s", before, names_at(&layer->ids, (int32_t)x));
                else if (isnan(x))
                    at += sprintf(at, "%s-", before);
                else
                    at += sprintf(at, "%s%.10g", before, x);
            }
        }
    }
    for (int32_t i = 0; i < mesh->libraries.count; ++i) at += sprintf(at, "; library %s", names_at(&mesh->libraries, i));
    for (int32_t i = 0; i < mesh->left_out.count; ++i) at += sprintf(at, "; without %s", names_at(&mesh->left_out, i));
    return out;
}

static void check_layers(const MeshFile* mesh, const char* wanted) {
    char* found = describe(mesh);
    assert_string_equal(found, wanted);
    free(found);
}

static void check_read(const char* name, const char* text, const char* wanted) {
    MeshFile mesh = parse(name, text);
    check_layers(&mesh, wanted);
    mesh_file_free(&mesh);
}

#define V3 "v 0 0 0\nv 1 0 0\nv 0 1 0\n"
#define V4 V3 "v 1 1 0\n"

static void test_obj(void** state) {
    (void)state;
    static const struct {
        const char *text, *wanted;
    } cases[] = {
        {V3 "f 1 2 3\n", ""},
        {V3 "vt 0 0\nvt 1 0.5\nvt 2 2\nf 1/1 2/2 3/3\nf 3/3 2/-2 1/-3\n", "uv corner text: 0 0|1 0.5|2 2|2 2|1 0.5|0 0"},
        {V3 "vt 7\nvt 1 2 3\nf 1/1 2/2 3/2\n", "uv corner text: 7 0 0|1 2 3|1 2 3"},
        {V3 "f 1/1 2/2 3/2\nvt 7 8\nvt 1 2\n", "uv corner text: 7 8|1 2|1 2"},               /* faces first */
        {V3 "vt 1 2\nf 1 2 3\nf 1/1 2/9 3/-9\n", "uv corner text: - -|- -|- -|1 2|- -|- -"}, /* missing, and out of range */
        {V3 "vt 1 2\nf 1/2 2/3 3\nf 1/0 2/99999999999 3/-4\n", ""},                          /* none at all */
        {V3 "vt 1 2\nvn 0 0 2\nf 1//1 2/1/1 3/1/\n", "uv corner text: - -|1 2|1 2; normal corner text: 0 0 2|0 0 2|- - -"},
        {"v 0 0 0 1 0 .5\nv 1 0 0 0.25 1 1 # c\nv 0 1 0\nf 1 2 3\n", "color vertex text: 1 0 0.5|0.25 1 1|1 1 1"},
        {"v 0 0 0 1\nv 1 0 0 nan 1 1\nv 0 1 0 1 1 1 1\nf 1 2 3\n", ""}, /* weights, no colours */
        {"v 0 0 0 \\\n1 0 .5\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "color vertex text: 1 0 0.5|1 1 1|1 1 1"},
        {"mtllib a b.mtl  \nmtllib c.mtl\n" V3
         "f 1 2 3\nusemtl red wood\nf 1 2 3\nusemtl blue\nf 1 2 3\nusemtl red wood\nf 1 2 3\n"
         "usemtl\nf 1 2 3\n",
         "material face text: |red wood|blue|red wood|; library a b.mtl; library c.mtl"},
        {V3 "g a b\ns 1\nf 1 2 3\no box\ns off\nf 1 2 3\ng\ns 01\nf 1 2 3\ns 0\nf 1 2 3\n",
         "group face text: a b|a b||; object face text: |box|box|box; smoothing face text: 1||01|"},
        {V3 "usemtl a\nf 1 2 3\nusemtl b \\\n c\nf 1 2 3\n", "material face text: a|b"},
        {V3 "usemtl a\nl 1 2\np 1\nl 2 3\n", "; without l; without p"},
        {"usemtl a\nvt 0 0\n" V3, ""},
        {V3 "usemtl a\r\nf 1 2 3\r\nusemtl", "material face text: a"},
        {V4 "vt 0 0\nvt 1 0\nvt 0 1\nvt 1 1\nf 1/1 2/2 4/4 3/3\nf 1 2\nf 1/4 2/4 3/4\n",
         "uv corner text: 0 0|1 0|1 1|0 1|- -|- -|1 1|1 1|1 1"},
    };
    for (size_t i = 0; i < COUNT(cases); ++i) check_read("a.obj", cases[i].text, cases[i].wanted);
}

static void test_ply(void** state) {
    (void)state;
    check_read("a.ply",
               "ply\nformat ascii 1.0\ncomment TextureFile my wood.png \ncomment other\nelement vertex 3\nproperty float x\n"
               "property float nx\nproperty float y\nproperty float ny\nproperty float z\nproperty float nz\nproperty uchar red\n"
               "property uchar green\nproperty uchar blue\nproperty uchar alpha\nproperty double quality\nproperty short flags\n"
               "property float s\nproperty float t\nelement face 2\nproperty uchar before\nproperty list uchar float texcoord\n"
               "property list uchar int vertex_indices\nproperty int material_index\nproperty uint big\n"
               "property list uchar int more\nelement edge 1\nproperty int a\nend_header\n"
               "0 0 0 0 0 1 1 2 3 4 0.5 -7 0 1\n1 0 0 0 0 1 5 6 7 300 1.5 40000 .5 1\n0 0 1 0 0 1 9 -4 2.6 nan nan nan 0 0\n"
               "1 6 0 0 1 0 0 1 3 0 1 2 5 4294967295 2 1 2\n2 0 3 0 2 1 -6 7 0\n1\n",
               "normal vertex f32 nx ny nz: 0 0 1|0 0 1|0 0 1; color vertex u8 red green blue alpha: 1 2 3 4|5 6 7 255|9 0 3 0; "
               "uv vertex f32 s t: 0 1|0.5 1|0 0; other vertex f64 quality: 0.5|1.5|-; other vertex i16 flags: -7|32767|0; "
               "material face i32 material_index: 5|-6; other face u8 before: 1|2; uv corner f32: 0 0|1 0|0 1|- -|- -|- -; "
               "other face u32 big: 4294967295|7; library my wood.png; without more; without edge");
    /* Colours of two types, UVs that are integers: no colour, no UVs. */
    check_read(
        "a.ply",
        "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nproperty uchar red\n"
        "property uchar green\nproperty float blue\nproperty int u\nproperty int v\nend_header\n1 2 3 4 5 6 7 8\n",
        "other vertex u8 red: 4; other vertex u8 green: 5; other vertex f32 blue: 6; other vertex i32 u: 7; other vertex i32 v: "
        "8");
    /* Two face elements: what the first has not, is 0 or none there; strips have nothing. */
    check_read(
        "a.ply",
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\n"
        "property list uchar int vertex_indices\nelement tristrips 1\nproperty list int int vertex_indices\nelement face 1\n"
        "property list uchar int vertex_indices\nproperty list uchar float texcoord\nproperty uchar mark\nend_header\n"
        "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n3 2 1 0\n3 0 1 2 6 0 0 1 1 2 2 9\n",
        "uv corner f32: - -|- -|- -|- -|- -|- -|0 0|1 1|2 2; other face u8 mark: 0|0|9");
}

static void test_off(void** state) {
    (void)state;
    check_read("a.off", "COFF\n3 1 0\n0 0 0 255 0 9\n1 0 0 1 2 3\n0 1 0\n3 0 1 2\n",
               "color vertex u8: 255 0 9|1 2 3|255 255 255");
    check_read("a.off", "COFF\n3 1 0\n0 0 0 1 0 0 1\n1 0 0 0.5 0 0 0.25\n0 1 0 x\n3 0 1 2\n",
               "color vertex text: 1 0 0 1|0.5 0 0 0.25|1 1 1 1");
    check_read("a.off", "STCNOFF\n3 1 0\n0 0 0 0 0 1 9 8 7 0.5 1\n1 0 0 0 1 0 6 5 4 2 3\n0 1 0 1 0 0 3 2 1 # 4\n3 0 1 2\n",
               "normal vertex text: 0 0 1|0 1 0|- - -; color vertex u8: 9 8 7|6 5 4|255 255 255; uv vertex text: 0.5 1|2 3|- -");
    check_read("a.off", "OFF\n3 1 0\n0 0 0 255 0 9\n1 0 0 1 2 3\n0 1 0\n3 0 1 2 1 0 0\n",
               "; without what follows the coordinates; without color of faces");
    check_read("a.off", "OFF\n3 2 0\n0 0 0 # 1\n1 0 0 \n0 1 0\n3 0 1 2\t# 1 0 0\n3 0 2 1", "");
}

/* Writes, reads back. */
static MeshFile pass(MeshFile* mesh, const char* path, Encoding encoding, Names* lost) {
    Failure failure = {NULL, ""};
    MeshFile back = {0};
    if (!mesh_file_fit(path, mesh, lost, &failure) || !mesh_file_write(path, encoding, mesh, &failure) ||
        !mesh_file_read(path, true, &back, &failure))
        fail_msg("%s", failure.text);
    return back;
}

/* The same layers in the same format, whatever the encoding. */
static void check_round_trip(const char* path, const char* text, const char* wanted, Encoding encoding) {
    MeshFile mesh = parse(path, text);
    Names lost = {0};
    mesh.precision = DELMESH_FLOAT64;
    MeshFile back = pass(&mesh, path, encoding, &lost);
    assert_int_equal(lost.count, 0);
    check_layers(&back, wanted);
    names_free(&lost);
    mesh_file_free(&mesh);
    mesh_file_free(&back);
}

#define PLY_HEAD                                                                                                                 \
    "ply\nformat ascii 1.0\ncomment TextureFile a.png\nelement vertex 3\nproperty double x\nproperty double y\n"                 \
    "property double z\n"

static void test_round_trips(void** state) {
    (void)state;
    check_round_trip(
        "a.obj",
        "mtllib m.mtl\nv 0 0 0 .1 .2 .3\nv 1 0 0 1 1 1\nv 0 1 0 0 0 0\nv 1 1 0 0 0 0\nvt 0.1 0.2\nvt 1 1\nvt 0 -0\n"
        "vn 0 0 1\nf 1/1/1 2/2/1 3/3\no box\ng a b\nusemtl red\ns 1\nf 2//1 4/2 3\nusemtl blue\ns 2\ng\nf 1 2 4\n",
        "uv corner text: 0.1 0.2|1 1|0 -0|- -|1 1|- -|- -|- -|- -; normal corner text: 0 0 1|0 0 1|- - -|0 0 1|- - -|- - "
        "-|- - -|- - -|- - -; color vertex text: 0.1 0.2 0.3|1 1 1|0 0 0|0 0 0; material face text: |red|blue; group face "
        "text: |a b|; object face text: |box|box; smoothing face text: |1|2; library m.mtl",
        kEncodingDefault);
    static const Encoding encodings[] = {kEncodingAscii, kEncodingLittle, kEncodingBig};
    for (size_t i = 0; i < COUNT(encodings); ++i)
        check_round_trip(
            "a.ply",
            PLY_HEAD "property char a\nproperty short b\nproperty ushort c\nproperty int d\nproperty uint e\nproperty float f\n"
                     "property double g\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nelement face 2\n"
                     "property list uchar int vertex_indices\nproperty list uchar double texcoord\nproperty uchar mark\n"
                     "property float w\nend_header\n0 0 0 -128 -32768 65535 -2147483648 4294967295 0.1 0.1 1 2 3\n"
                     "1 0 0 127 32767 0 2147483647 0 1e-40 1e300 255 0 128\n0 1 0 0 0 0 0 0 0 0 0 0 0\n"
                     "3 0 1 2 6 0.1 0 1 0 0 1 7 0.5\n3 2 1 0 0 255 -0.5\n",
            "color vertex u8 red green blue: 1 2 3|255 0 128|0 0 0; other vertex i8 a: -128|127|0; other vertex i16 b: "
            "-32768|32767|0; other vertex u16 c: 65535|0|0; other vertex i32 d: -2147483648|2147483647|0; other vertex u32 e: "
            "4294967295|0|0; other vertex f32 f: 0.1000000015|9.999946101e-41|0; other vertex f64 g: 0.1|1e+300|0; uv corner "
            "f64: 0.1 "
            "0|1 0|0 1|- -|- -|- -; other face u8 mark: 7|255; other face f32 w: 0.5|-0.5; library a.png",
            encodings[i]);
    check_round_trip("a.off",
                     "STCNOFF\n3 1 0\n0 0 0 0 0 1 9 8 7 0.5 1\n1 0 0 0 1 0 6 5 4 2 3\n0 1 0 1 0 0 3 2 1 4 0.1\n3 0 1 2\n",
                     "normal vertex text: 0 0 1|0 1 0|1 0 0; color vertex u8: 9 8 7|6 5 4|3 2 1; uv vertex text: 0.5 1|2 3|4 0.1",
                     kEncodingDefault);
}

typedef struct Conversion {
    const char *from, *text, *to, *wanted, *lost;
} Conversion;

#define OBJ_ALL                                                                                                                  \
    "mtllib m.mtl\nv 0 0 0 1 0 1\nv 1 0 0 0 0 0\nv 0 1 0 0 0 0\nvt 0 0 5\nvt 1 0 0\nvt 0 1 0\nvn 0 0 1\nvn 0 1 0\nusemtl a\ns "  \
    "3\n"                                                                                                                        \
    "f 1/1/1 2/2/2 3/3/1\n"
#define OBJ_CREASE V3 "vn 0 0 1\nvn 0 1 0\nvt 0 0\nvt 1 1\nf 1/1/1 2/1/1 3/1/1\nf 2/1/2 1/2/2 3/1/2\n"

static void test_conversions(void** state) {
    (void)state;
    static const Conversion cases[] = {
        {"a.obj", OBJ_ALL, "a.ply",
         "normal vertex f64 nx ny nz: 0 0 1|0 1 0|0 0 1; color vertex f64 red green blue: 1 0 1|0 0 0|0 0 0; material face i32 "
         "material_index: 1; smoothing face i32 smoothing_group: 1; uv corner f64: 0 0|1 0|0 1",
         "uv: PLY files hold no third coordinate|material: PLY files hold its numbers, not its names|smoothing: PLY files hold "
         "its "
         "numbers, not its names|m.mtl: PLY files do not refer to such a file"},
        {"a.obj", OBJ_CREASE, "a.ply", "uv corner f64: 0 0|0 0|0 0|0 0|1 1|0 0",
         "normal: PLY files hold one at each vertex, and its faces' differ"},
        {"a.obj", OBJ_CREASE, "a.off", "",
         "uv: OFF files hold one at each vertex, and its faces' differ|normal: OFF files hold one at each vertex, and its faces' "
         "differ"},
        {"a.obj", OBJ_ALL, "a.off",
         "normal vertex text: 0 0 1|0 1 0|0 0 1; color vertex text: 1 0 1|0 0 0|0 0 0; uv vertex text: 0 0|1 0|0 1",
         "uv: OFF files hold no third coordinate|material: OFF files have no place for it|smoothing: OFF files have no place for "
         "it|"
         "m.mtl: OFF files do not refer to such a file"},
        {"a.obj", OBJ_ALL, "a.stl", "",
         "uv: STL files hold positions only|normal: STL files hold positions only|color: STL files hold positions only|material: "
         "STL "
         "files hold positions only|smoothing: STL files hold positions only|m.mtl: STL files do not refer to such a file"},
        {"a.ply",
         PLY_HEAD "property float u\nproperty float v\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n"
                  "property uchar alpha\nproperty float q\nelement face 2\nproperty list uchar int vertex_indices\n"
                  "property int texnumber\nproperty list uchar float texcoord\nproperty uchar red\nproperty uchar green\n"
                  "property uchar blue\nend_header\n0 0 0 0 0 255 0 51 9 1\n1 0 0 1 0 1 2 3 0 1\n0 1 0 0 .5 0 0 0 0 1\n"
                  "3 0 1 2 0 6 0 0 0 0 0 0 1 2 3\n3 2 1 0 3 6 0 0 0 0 0 0 1 2 3\n",
         "a.obj",
         "uv corner text: 0 0|0 0|0 0|0 0|0 0|0 0; color vertex text: 1 0 0.2|0.003922 0.007843 0.011765|0 0 0; material "
         "face "
         "text: material_0|material_3",
         "color: OBJ files hold no alpha|uv: OBJ files hold one, and there is another|q: OBJ files have no place for it|"
         "color: OBJ files have no place for it at faces|a.png: OBJ files do not refer to such a file"},
    };
    for (size_t i = 0; i < COUNT(cases); ++i) {
        MeshFile mesh = parse(cases[i].from, cases[i].text);
        mesh.precision = strcmp(cases[i].to, "a.stl") == 0 ? DELMESH_FLOAT32 : DELMESH_FLOAT64;
        Names lost = {0};
        MeshFile back = pass(&mesh, cases[i].to, kEncodingDefault, &lost);
        check_layers(&back, cases[i].wanted);
        char words[2048] = "";
        for (int32_t k = 0; k < lost.count; ++k) sprintf(words + strlen(words), "%s%s", k ? "|" : "", names_at(&lost, k));
        assert_string_equal(words, cases[i].lost);
        names_free(&lost);
        mesh_file_free(&mesh);
        mesh_file_free(&back);
    }
}

static void test_exact_obj(void** state) {
    (void)state;
    MeshFile mesh = parse("a.obj", "mtllib m.mtl\n" V3 "vt 0.5 0\nvt 1 1\nvt 0.5 0\nvn 0 0 1\nusemtl b\nf 1/1/1 2/2/1 3/3/1\n"
                                   "usemtl\nf 1/2 3/1 2/3\nusemtl b\nf 3//1 2 1\ns 2\nf 3//1 2 1\n");
    Names lost = {0};
    MeshFile back = pass(&mesh, "a.obj", kEncodingDefault, &lost);
    FILE* file = fopen("a.obj", "rb");
    char text[1024] = "";
    assert_true(fread(text, 1, sizeof text - 1, file) > 0);
    fclose(file);
    /* UVs of one value are one; the face without a material comes first; statements only where something changes. */
    assert_string_equal(text, "mtllib m.mtl\n" V3 "vt 0.5 0\nvt 1 1\nvn 0 0 1\nf 1/2 3/1 2/1\nusemtl b\nf 1/1/1 2/2/1 3/1/1\n"
                              "f 3//1 2 1\ns 2\nf 3//1 2 1\n");
    names_free(&lost);
    mesh_file_free(&mesh);
    mesh_file_free(&back);
}

static void test_names(void** state) {
    (void)state;
    Names names = {0};
    char text[32];
    for (int round = 0; round < 2; ++round)
        for (int i = 0; i < 5000; ++i) assert_int_equal(names_add(&names, text, (size_t)sprintf(text, "n%d", i)), i);
    assert_int_equal(names_add(&names, "n17xyz", 3), 17);
    assert_int_equal(names_add(&names, "", 0), 5000);
    assert_int_equal(names_add(&names, "a\0b", 3), 5001);
    assert_string_equal(names_at(&names, 5001), "a");
    assert_string_equal(names_at(&names, 4999), "n4999");
    names_free(&names);
}

static void test_libraries(void** state) {
    (void)state;
    assert_int_equal(mkdir("b", 0777), 0);
    assert_int_equal(mkdir("b/c", 0777), 0);
    assert_int_equal(mkdir("d", 0777), 0);
    static const struct {
        const char *name, *in, *out, *wanted;
    } cases[] = {
        {"m.mtl", "a.obj", "b.obj", "m.mtl"},
        {"m.mtl", "a.obj", "b/a.obj", "../m.mtl"},
        {"m.mtl", "b/a.obj", "a.obj", "b/m.mtl"},
        {"m.mtl", "./b/../b/c/a.obj", "d/a.obj", "../b/c/m.mtl"},
        {"m.mtl", "b/a.obj", "b/c/a.obj", "../m.mtl"},
        {"x/m.mtl", "d/a.obj", "b/c/a.obj", "../../d/x/m.mtl"},
        {"/abs/m.mtl", "b/a.obj", "a.obj", "/abs/m.mtl"},
        {"C:\\m.mtl", "b/a.obj", "a.obj", "C:\\m.mtl"},
        {"a.mtl b.MTL", "b/a.obj", "a.obj", "b/a.mtl b/b.MTL"},
        {"my wood.mtl", "b/a.obj", "a.obj", "b/my wood.mtl"},
        {"m.mtl", "nowhere/a.obj", "a.obj", "m.mtl"},
    };
    for (size_t i = 0; i < COUNT(cases); ++i) {
        char* found = carry_library(cases[i].name, cases[i].in, cases[i].out);
        assert_string_equal(found, cases[i].wanted);
        free(found);
    }
}

static void test_options(void** state) {
    (void)state;
    static const struct {
        const char *keep, *release, *sentence;
        bool uv, normal, material;
    } cases[] = {
        {NULL, NULL, "", true, false, true},
        {"normal,group", "uv", "", false, true, true},
        {NULL, "uv,material", "", false, false, false},
        {"uv", "uv", "--keep and --release both name uv", true, false, true},
        {"uv,wood", NULL,
         "--keep takes uv, normal, color, material, group, object, smoothing, with commas between them, not 'uv,wood'", true,
         false, true},
    };
    for (size_t i = 0; i < COUNT(cases); ++i) {
        Carry carry;
        carry_init(&carry);
        carry.keep = cases[i].keep;
        carry.release = cases[i].release;
        Failure failure = {NULL, ""};
        assert_int_equal(carry_parse(&carry, &failure), cases[i].sentence[0] == '\0');
        assert_string_equal(failure.text, cases[i].sentence);
        assert_int_equal(carry.kept[kLayerUv], cases[i].uv);
        assert_int_equal(carry.kept[kLayerNormal], cases[i].normal);
        assert_int_equal(carry.kept[kLayerMaterial], cases[i].material);
        carry_free(&carry);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_obj),
        cmocka_unit_test(test_ply),
        cmocka_unit_test(test_off),
        cmocka_unit_test_setup_teardown(test_round_trips, enter_folder, leave_folder),
        cmocka_unit_test_setup_teardown(test_conversions, enter_folder, leave_folder),
        cmocka_unit_test_setup_teardown(test_exact_obj, enter_folder, leave_folder),
        cmocka_unit_test(test_names),
        cmocka_unit_test_setup_teardown(test_libraries, enter_folder, leave_folder),
        cmocka_unit_test(test_options),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
