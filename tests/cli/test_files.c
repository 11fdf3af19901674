/* SPDX-License-Identifier: Apache-2.0
 *
 * Files on disk: what is written reads back bit for bit, files appear whole or not at all, compressed files, and what is refused.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include <dirent.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

#include "interrupt.h"
#include "mesh_file.h"
#include "output.h"

/* Each test runs in an empty folder of its own. */
static int enter_folder(void** state) {
    char* folder = strdup("cli_test_files.XXXXXX");
    *state = folder;
    return folder && mkdtemp(folder) && chdir(folder) == 0 ? 0 : -1;
}

static int entries(void) {
    int count = 0;
    DIR* folder = opendir(".");
    assert_non_null(folder);
    for (struct dirent* e = readdir(folder); e; e = readdir(folder)) count += e->d_name[0] != '.';
    closedir(folder);
    return count;
}

static int leave_folder(void** state) {
    DIR* folder = opendir(".");
    for (struct dirent* e = readdir(folder); e; e = readdir(folder))
        if (e->d_name[0] != '.') remove(e->d_name);
    closedir(folder);
    int result = chdir("..") == 0 ? rmdir(*state) : -1;
    free(*state);
    return result;
}

static void write_bytes(const char* path, const void* data, size_t size) {
    FILE* file = fopen(path, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(data, 1, size, file), size);
    assert_int_equal(fclose(file), 0);
}

static char* read_bytes(const char* path, size_t* size) {
    FILE* file = fopen(path, "rb");
    assert_non_null(file);
    char* data = calloc(1, 1 << 16);
    *size = fread(data, 1, (1 << 16) - 1, file);
    fclose(file);
    return data;
}

/* Awkward but finite numbers; the last vertex is used by no face. */
static const double kPositions[] = {0,
                                    -0.0,
                                    1.0 / 3,
                                    0x1p-149,
                                    1e-38,
                                    3.4028234663852886e38,
                                    -1e30,
                                    0.1,
                                    123456789.125,
                                    1e-300,
                                    0x1p-1074,
                                    1.797e308,
                                    0.30000000000000004,
                                    5e-5,
                                    1e17,
                                    9.5367431640625e-7,
                                    7,
                                    -7};
static const int32_t kCorners[] = {0, 1, 2, 2, 1, 3, 3, 1, 4};

static MeshFile make_mesh(int32_t precision, float* floats, double* doubles) {
    for (int i = 0; i < 18; ++i) {
        doubles[i] = kPositions[i];
        floats[i] = kPositions[i] > 3.5e38 ? 1.25f : (float)kPositions[i];
    }
    MeshFile mesh = {.precision = precision, .vertex_count = 6, .face_count = 3, .corner_count = 9};
    mesh.positions = precision == DELMESH_FLOAT32 ? (void*)floats : (void*)doubles;
    mesh.corner_verts = (int32_t*)(size_t)kCorners;
    return mesh;
}

static double coordinate(const MeshFile* mesh, int64_t i) {
    return mesh->precision == DELMESH_FLOAT32 ? (double)((const float*)mesh->positions)[i] : ((const double*)mesh->positions)[i];
}

typedef struct Form {
    const char* path;
    Encoding encoding;
    bool f32, f64;    /* can hold it */
    int32_t back_f32; /* precision after reading a float32 mesh */
} Form;

static const Form kForms[] = {
    {"a.obj", kEncodingDefault, true, true, DELMESH_FLOAT64}, {"a.off", kEncodingAscii, true, true, DELMESH_FLOAT64},
    {"a.ply", kEncodingDefault, true, true, DELMESH_FLOAT32}, {"a.ply", kEncodingBig, true, true, DELMESH_FLOAT32},
    {"a.ply", kEncodingAscii, true, true, DELMESH_FLOAT64},   {"a.stl", kEncodingDefault, true, false, DELMESH_FLOAT32},
    {"a.stl", kEncodingAscii, true, true, DELMESH_FLOAT64},   {"a.stla", kEncodingDefault, true, true, DELMESH_FLOAT64},
};

static void test_round_trip(void** state) {
    (void)state;
    for (size_t i = 0; i < sizeof kForms / sizeof *kForms; ++i) {
        for (int double_precision = 0; double_precision < 2; ++double_precision) {
            float floats[18];
            double doubles[18];
            const MeshFile mesh = make_mesh(double_precision ? DELMESH_FLOAT64 : DELMESH_FLOAT32, floats, doubles);
            Failure failure = {NULL, ""};
            const bool holds = double_precision ? kForms[i].f64 : kForms[i].f32;
            remove(kForms[i].path);
            assert_int_equal(mesh_file_write(kForms[i].path, kForms[i].encoding, &mesh, &failure), holds);
            if (!holds) {
                assert_string_equal(failure.status, kStatusUsage);
                assert_int_equal(access(kForms[i].path, F_OK), -1);
                continue;
            }
            MeshFile back;
            if (!mesh_file_read(kForms[i].path, true, &back, &failure)) fail_msg("%s", failure.text);
            assert_int_equal(back.precision, double_precision ? DELMESH_FLOAT64 : kForms[i].back_f32);
            assert_int_equal(back.face_count, 3);
            assert_null(back.face_sizes);
            const bool stl = back.format == kFormatStl; /* no vertices there: corner by corner */
            if (!stl) {
                assert_int_equal(back.vertex_count, 6);
                assert_memory_equal(back.corner_verts, kCorners, sizeof kCorners);
            } else {
                assert_int_equal(back.vertex_count, 5);
            }
            for (int64_t c = 0; c < (stl ? 27 : 18); ++c) {
                const double a = coordinate(&mesh, stl ? 3 * kCorners[c / 3] + c % 3 : c);
                const double b = coordinate(&back, stl ? 3 * back.corner_verts[c / 3] + c % 3 : c);
                if (memcmp(&a, &b, sizeof a) != 0) fail_msg("form %zu, coordinate %d: %.17g, not %.17g", i, (int)c, b, a);
            }
            mesh_file_free(&back);
        }
    }
}

static void test_exact_bytes(void** state) {
    (void)state;
    float positions[] = {0, 0, 0, 0.1f, 0, 0, 0, 1.5f, -0.0f};
    int32_t corners[] = {0, 1, 2};
    const MeshFile mesh = {.precision = DELMESH_FLOAT32,
                           .vertex_count = 3,
                           .face_count = 1,
                           .corner_count = 3,
                           .positions = positions,
                           .corner_verts = corners};
    static const struct {
        const char *path, *text;
    } cases[] = {
        {"a.obj", "v 0 0 0\nv 0.10000000149011612 0 0\nv 0 1.5 -0\nf 1 2 3\n"},
        {"a.off", "OFF\n3 1 0\n0 0 0\n0.10000000149011612 0 0\n0 1.5 -0\n3 0 1 2\n"},
        {"a.stla",
         "solid delmesh\nfacet normal 0 0 1\n outer loop\n  vertex 0 0 0\n  vertex 0.10000000149011612 0 0\n  vertex 0 1.5 -0\n"
         " endloop\nendfacet\nendsolid delmesh\n"},
        {"a.ply",
         "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\n"
         "property list uchar int vertex_indices\nend_header\n0 0 0\n0.10000000149011612 0 0\n0 1.5 -0\n3 0 1 2\n"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; ++i) {
        Failure failure = {NULL, ""};
        assert_true(mesh_file_write(cases[i].path, kEncodingAscii, &mesh, &failure));
        size_t size;
        char* text = read_bytes(cases[i].path, &size);
        assert_string_equal(text, cases[i].text);
        free(text);
    }
}

static void test_refused_targets(void** state) {
    (void)state;
    assert_int_equal(mkdir("folder.obj", 0777), 0);
    static const struct {
        const char* path;
        Encoding encoding;
        int32_t precision;
        const char *status, *sentence;
    } cases[] = {
        {"a.xyz", kEncodingDefault, DELMESH_FLOAT32, kStatusUsage, "a.xyz: the name must end in .obj, .off, .ply, .stl or .stla"},
        {"a.obj.gz", kEncodingDefault, DELMESH_FLOAT32, kStatusUsage,
         "a.obj.gz: compressed files are read only; write it plain and compress it after"},
        {"a.obj", kEncodingBig, DELMESH_FLOAT32, kStatusUsage, "a.obj: OBJ is written as text only"},
        {"a.stl", kEncodingBig, DELMESH_FLOAT32, kStatusUsage, "a.stl: STL has no big-endian form"},
        {"a.stl", kEncodingDefault, DELMESH_FLOAT64, kStatusUsage,
         "a.stl: binary STL holds float32 only, which would round the float64 mesh: choose --precision f32, --ascii or another "
         "format"},
        {"folder.obj", kEncodingDefault, DELMESH_FLOAT32, kStatusWrite, "folder.obj: is there already and is no file"},
        {"nowhere/a.obj", kEncodingDefault, DELMESH_FLOAT32, kStatusWrite,
         "nowhere/a.obj: its folder cannot be written: No such file or directory"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; ++i) {
        Failure failure = {NULL, ""};
        assert_false(mesh_file_can_write(cases[i].path, cases[i].encoding, cases[i].precision, &failure));
        assert_string_equal(failure.text, cases[i].sentence);
        assert_string_equal(failure.status, cases[i].status);
    }
}

static bool old_file_is_there(void) {
    size_t size;
    char* text = read_bytes("a.obj", &size);
    bool same = strcmp(text, "old\n") == 0;
    free(text);
    return same && entries() == 1;
}

/* The last of three cannot be put in its place: what was there before is, and what was not, is not. */
static void test_all_or_none(void** state) {
    (void)state;
    float floats[18];
    double doubles[18];
    const MeshFile mesh = make_mesh(DELMESH_FLOAT32, floats, doubles);
    const char* const paths[] = {"a.obj", "b.ply", "c.stl"};
    write_bytes("a.obj", "old\n", 4);
    for (int may = 0; may < 2; ++may) {
        Output outs[3];
        Failure failure = {NULL, ""};
        for (int i = 0; i < 3; ++i) assert_true(mesh_file_prepare(paths[i], kEncodingDefault, &mesh, &outs[i], &failure));
        if (!may) assert_int_equal(mkdir("c.stl", 0700), 0);
        assert_int_equal(output_commit(outs, 3, true, &failure), may);
        if (may) break;
        assert_string_equal(failure.text, "c.stl: could not be renamed into place: Is a directory");
        assert_string_equal(failure.status, kStatusWrite);
        assert_int_equal(rmdir("c.stl"), 0);
        assert_true(old_file_is_there());
    }
    assert_int_equal(entries(), 3);
    for (int i = 0; i < 3; ++i) assert_int_equal(unlink(paths[i]), 0);
}

static void test_atomic(void** state) {
    (void)state;
    float floats[18];
    double doubles[18];
    const MeshFile mesh = make_mesh(DELMESH_FLOAT32, floats, doubles);
    write_bytes("a.obj", "old\n", 4);
    assert_int_equal(chmod("a.obj", 0640), 0);
    Failure failure = {NULL, ""};

    Output both[2]; /* the second is given up: neither appears */
    assert_true(mesh_file_prepare("a.obj", kEncodingDefault, &mesh, &both[0], &failure));
    assert_true(mesh_file_prepare("b.ply", kEncodingDefault, &mesh, &both[1], &failure));
    assert_int_equal(entries(), 3);
    assert_false(output_commit(both, 2, false, &failure));
    assert_true(old_file_is_there());
    assert_null(failure.status);

    Output out; /* given up half way */
    assert_true(output_open(&out, "a.obj", &failure));
    assert_true(output_write(&out, "new", 3));
    assert_int_equal(entries(), 2);
    assert_false(output_close(&out, false));
    assert_true(old_file_is_there());

    interrupt_signal = 2; /* interrupted */
    assert_false(mesh_file_write("a.obj", kEncodingDefault, &mesh, &failure));
    interrupt_signal = 0;
    assert_string_equal(failure.status, kStatusCancelled);
    assert_true(old_file_is_there());

    interrupt_install(); /* no room: with SIGXFSZ ignored, a write error */
    struct rlimit limit, small;
    assert_int_equal(getrlimit(RLIMIT_FSIZE, &limit), 0);
    small = limit;
    small.rlim_cur = 16;
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &small), 0);
    failure = (Failure){NULL, ""};
    const bool ok = mesh_file_write("a.obj", kEncodingDefault, &mesh, &failure);
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &limit), 0);
    assert_false(ok);
    assert_string_equal(failure.text, "a.obj: could not be written: File too large");
    assert_true(old_file_is_there());

    failure = (Failure){NULL, ""};
    assert_int_equal(symlink("a.obj", "link.obj"), 0); /* written through, with the rights of the old file */
    assert_true(mesh_file_write("link.obj", kEncodingDefault, &mesh, &failure));
    assert_int_equal(entries(), 2);
    struct stat info;
    assert_int_equal(lstat("link.obj", &info), 0);
    assert_true(S_ISLNK(info.st_mode));
    assert_int_equal(stat("a.obj", &info), 0);
    assert_int_equal(info.st_mode & 0777, 0640);
    assert_true(info.st_size > 100);
}

static size_t compress_to(const char* path, const char* text, size_t size, const char* mode) {
    gzFile file = gzopen(path, mode);
    assert_non_null(file);
    assert_int_equal(gzwrite(file, text, (unsigned)size), size);
    assert_int_equal(gzclose(file), Z_OK);
    struct stat info;
    assert_int_equal(stat(path, &info), 0);
    return (size_t)info.st_size;
}

static void test_gzip(void** state) {
    (void)state;
    static const char text[] = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    MeshFile mesh;
    Failure failure = {NULL, ""};
    size_t size = compress_to("a.obj.gz", text, sizeof text - 1, "wb");
    assert_true(mesh_file_read("a.obj.gz", true, &mesh, &failure));
    assert_int_equal(mesh.face_count, 1);
    mesh_file_free(&mesh);
    assert_int_equal(rename("a.obj.gz", "a.obj"), 0); /* by content, whatever the name */
    assert_true(mesh_file_read("a.obj", true, &mesh, &failure));
    mesh_file_free(&mesh);

    char* packed = read_bytes("a.obj", &size); /* cut anywhere: never read, never more than one sentence */
    for (size_t cut = 3; cut < size; ++cut) {
        write_bytes("cut.obj", packed, cut);
        failure = (Failure){NULL, ""};
        assert_false(mesh_file_read("cut.obj", true, &mesh, &failure));
        assert_non_null(strstr(failure.text, "cut.obj: byte "));
    }
    packed[size - 8] ^= 1; /* the checksum */
    write_bytes("cut.obj", packed, size);
    failure = (Failure){NULL, ""};
    assert_false(mesh_file_read("cut.obj", true, &mesh, &failure));
    assert_non_null(strstr(failure.text, "of the gzip file: incorrect data check"));
    free(packed);

    compress_to("two.obj", text, 24, "wb"); /* two members: vertices, face */
    compress_to("two.obj", text + 24, sizeof text - 1 - 24, "ab");
    failure = (Failure){NULL, ""};
    assert_true(mesh_file_read("two.obj", true, &mesh, &failure));
    assert_int_equal(mesh.vertex_count, 3);
    assert_int_equal(mesh.face_count, 1);
    mesh_file_free(&mesh);

    compress_to("bad.obj", "v 0 0\n", 6, "wb");
    assert_false(mesh_file_read("bad.obj", true, &mesh, &failure));
    assert_string_equal(failure.text, "bad.obj: line 1: the line ended where a coordinate was expected (decompressed)");
}

static void test_gzip_bomb(void** state) {
    (void)state;
    const size_t size = (size_t)80 << 20;
    char* blanks = calloc(1, size);
    assert_non_null(blanks);
    memset(blanks, '\n', size);
    compress_to("bomb.obj.gz", blanks, size, "wb9");
    free(blanks);
    MeshFile mesh;
    Failure failure = {NULL, ""};
    assert_false(mesh_file_read("bomb.obj.gz", true, &mesh, &failure));
    assert_non_null(strstr(failure.text, "of the gzip file: it expands to more than 67108864 bytes"));
}

static void test_unreadable(void** state) {
    (void)state;
    MeshFile mesh;
    Failure failure = {NULL, ""};
    assert_false(mesh_file_read("none.obj", true, &mesh, &failure));
    assert_string_equal(failure.text, "none.obj: could not be opened: No such file or directory");
    failure = (Failure){NULL, ""};
    assert_false(mesh_file_read(".", true, &mesh, &failure));
    assert_string_equal(failure.text, ".: is a directory");
    failure = (Failure){NULL, ""};
    assert_false(mesh_file_read("/dev/zero", true, &mesh, &failure));
    assert_string_equal(failure.text, "/dev/zero: is neither a file nor a pipe");
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(test_round_trip, enter_folder, leave_folder),
        cmocka_unit_test_setup_teardown(test_exact_bytes, enter_folder, leave_folder),
        cmocka_unit_test_setup_teardown(test_refused_targets, enter_folder, leave_folder),
        cmocka_unit_test_setup_teardown(test_all_or_none, enter_folder, leave_folder),
        cmocka_unit_test_setup_teardown(test_atomic, enter_folder, leave_folder),
        cmocka_unit_test_setup_teardown(test_gzip, enter_folder, leave_folder),
        cmocka_unit_test_setup_teardown(test_gzip_bomb, enter_folder, leave_folder),
        cmocka_unit_test_setup_teardown(test_unreadable, enter_folder, leave_folder),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
