/* SPDX-License-Identifier: Apache-2.0
 *
 * write_mesh.c: the four formats. Text holds the shortest decimal that reads back as the same double, also for float32 meshes, so
 * that a reader with floats and one with doubles see the same numbers.
 */
#include "bytes.h"
#include "mesh_file.h"
#include "output.h"
#include "text.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static void position(const MeshFile* mesh, int64_t vertex, double out[3]) {
    for (int k = 0; k < 3; ++k)
        out[k] = mesh->precision == DELMESH_FLOAT32 ? (double)((const float*)mesh->positions)[3 * vertex + k]
                                                    : ((const double*)mesh->positions)[3 * vertex + k];
}

/* "<prefix>x y z\n" */
static bool put_point(Output* out, const char* prefix, const double p[3]) {
    size_t length = strlen(prefix);
    char* begin = output_reserve(out, length + 3 * (kTextDoubleSize + 1));
    if (!begin) return false;
    char* at = begin;
    memcpy(at, prefix, length);
    at += length;
    for (int k = 0; k < 3; ++k) {
        at += text_print_double(at, p[k]);
        *at++ = k < 2 ? ' ' : '\n';
    }
    out->used += (size_t)(at - begin);
    return true;
}

/* "<prefix>a b c\n" with `first` added to each index */
static bool put_triangle(Output* out, const char* prefix, const int32_t* corners, int first) {
    size_t length = strlen(prefix);
    char* begin = output_reserve(out, length + 3 * (kTextDoubleSize + 1));
    if (!begin) return false;
    char* at = begin;
    memcpy(at, prefix, length);
    at += length;
    for (int k = 0; k < 3; ++k) {
        at += text_print_integer(at, (int64_t)corners[k] + first);
        *at++ = k < 2 ? ' ' : '\n';
    }
    out->used += (size_t)(at - begin);
    return true;
}

static bool put_text(Output* out, const char* text) {
    return output_write(out, text, strlen(text));
}

static bool put_list(Output* out, const MeshFile* mesh, const char* vertex_prefix, const char* face_prefix, int first_index) {
    double p[3];
    for (int64_t v = 0; v < mesh->vertex_count; ++v) {
        position(mesh, v, p);
        if (!put_point(out, vertex_prefix, p)) return false;
    }
    for (int64_t f = 0; f < mesh->face_count; ++f)
        if (!put_triangle(out, face_prefix, mesh->corner_verts + 3 * f, first_index)) return false;
    return true;
}

static bool write_off(Output* out, const MeshFile* mesh) {
    char header[96];
    snprintf(header, sizeof header, "OFF\n%lld %lld 0\n", (long long)mesh->vertex_count, (long long)mesh->face_count);
    return put_text(out, header) && put_list(out, mesh, "", "3 ", 0);
}

static bool write_ply(Output* out, const MeshFile* mesh, Encoding encoding) {
    const bool single = mesh->precision == DELMESH_FLOAT32;
    const char* type = single ? "float" : "double";
    const char* format = encoding == kEncodingAscii ? "ascii"
                         : encoding == kEncodingBig ? "binary_big_endian"
                                                    : "binary_little_endian";
    char header[384];
    snprintf(header, sizeof header,
             "ply\nformat %s 1.0\nelement vertex %lld\nproperty %s x\nproperty %s y\nproperty %s z\n"
             "element face %lld\nproperty list uchar int vertex_indices\nend_header\n",
             format, (long long)mesh->vertex_count, type, type, type, (long long)mesh->face_count);
    if (!put_text(out, header)) return false;
    if (encoding == kEncodingAscii) return put_list(out, mesh, "", "3 ", 0);

    const ByteOrder order = encoding == kEncodingBig ? kBigEndian : kLittleEndian;
    const int size = single ? 4 : 8;
    for (int64_t v = 0; v < mesh->vertex_count; ++v) {
        char* at = output_reserve(out, 24);
        if (!at) return false;
        double p[3];
        position(mesh, v, p);
        for (int k = 0; k < 3; ++k, at += size) {
            if (single)
                bytes_put_f32(at, (float)p[k], order);
            else
                bytes_put_f64(at, p[k], order);
        }
        out->used += 3 * (size_t)size;
    }
    for (int64_t f = 0; f < mesh->face_count; ++f) {
        char* at = output_reserve(out, 13);
        if (!at) return false;
        *at = 3;
        for (int k = 0; k < 3; ++k) bytes_put_u32(at + 1 + 4 * k, (uint32_t)mesh->corner_verts[3 * f + k], order);
        out->used += 13;
    }
    return true;
}

/* The unit normal as far as doubles give it; zero where there is none. Readers are free to compute their own, and do. */
static void normal_of(double p[3][3], double out[3]) {
    double u[3], v[3], scale = 0;
    for (int k = 0; k < 3; ++k) {
        u[k] = p[1][k] - p[0][k];
        v[k] = p[2][k] - p[0][k];
        scale = fmax(scale, fmax(fabs(u[k]), fabs(v[k])));
    }
    if (!(scale > 0 && scale < INFINITY)) scale = 1;
    for (int k = 0; k < 3; ++k) {
        u[k] /= scale;
        v[k] /= scale;
    }
    for (int k = 0; k < 3; ++k) out[k] = u[(k + 1) % 3] * v[(k + 2) % 3] - u[(k + 2) % 3] * v[(k + 1) % 3];
    double length = sqrt(out[0] * out[0] + out[1] * out[1] + out[2] * out[2]);
    for (int k = 0; k < 3; ++k) out[k] = length > 0 && length < INFINITY ? out[k] / length + 0.0 : 0; /* + 0.0: no -0 */
}

static bool write_stl(Output* out, const MeshFile* mesh, Encoding encoding) {
    const bool ascii = encoding == kEncodingAscii;
    if (ascii) {
        if (!put_text(out, "solid delmesh\n")) return false;
    } else {
        char header[84] = "binary STL by delmesh"; /* must not begin with "solid" */
        bytes_put_u32(header + 80, (uint32_t)mesh->face_count, kLittleEndian);
        if (!output_write(out, header, sizeof header)) return false;
    }
    for (int64_t f = 0; f < mesh->face_count; ++f) {
        double p[3][3], normal[3];
        for (int k = 0; k < 3; ++k) position(mesh, mesh->corner_verts[3 * f + k], p[k]);
        normal_of(p, normal);
        if (ascii) {
            for (int k = 0; k < 3; ++k) normal[k] = (double)(float)normal[k]; /* half the digits are enough here */
            bool ok = put_point(out, "facet normal ", normal) && put_text(out, " outer loop\n");
            for (int k = 0; ok && k < 3; ++k) ok = put_point(out, "  vertex ", p[k]);
            if (!ok || !put_text(out, " endloop\nendfacet\n")) return false;
        } else {
            char* at = output_reserve(out, 50);
            if (!at) return false;
            for (int k = 0; k < 3; ++k) bytes_put_f32(at + 4 * k, (float)normal[k], kLittleEndian);
            for (int k = 0; k < 9; ++k) bytes_put_f32(at + 12 + 4 * k, (float)p[k / 3][k % 3], kLittleEndian);
            at[48] = at[49] = 0;
            out->used += 50;
        }
    }
    return !ascii || put_text(out, "endsolid delmesh\n");
}

static Encoding choose(MeshFormat format, bool ascii_name, Encoding encoding) {
    if (encoding != kEncodingDefault) return encoding;
    return format == kFormatObj || format == kFormatOff || ascii_name ? kEncodingAscii : kEncodingLittle;
}

bool mesh_file_can_write(const char* path, Encoding encoding, int32_t precision, Failure* failure) {
    size_t length = strlen(path);
    if (length > 3 && strcmp(path + length - 3, ".gz") == 0)
        return fail_with(failure, kStatusUsage, "%s: compressed files are read only; write it plain and compress it after", path);
    bool ascii_name;
    MeshFormat format = mesh_format_of_name(path, &ascii_name);
    if (format == kFormatUnknown)
        return fail_with(failure, kStatusUsage, "%s: the name must end in .obj, .off, .ply, .stl or .stla", path);
    Encoding chosen = choose(format, ascii_name, encoding);
    if ((format == kFormatObj || format == kFormatOff) && chosen != kEncodingAscii)
        return fail_with(failure, kStatusUsage, "%s: %s is written as text only", path, mesh_format_name(format));
    if (format == kFormatStl && chosen == kEncodingBig)
        return fail_with(failure, kStatusUsage, "%s: STL has no big-endian form", path);
    if (format == kFormatStl && chosen == kEncodingLittle && precision == DELMESH_FLOAT64)
        return fail_with(
            failure, kStatusUsage,
            "%s: binary STL holds float32 only, which would round the float64 mesh: choose --precision f32, --ascii or "
            "another format",
            path);
    return output_check(path, failure);
}

bool mesh_file_prepare(const char* path, Encoding encoding, const MeshFile* mesh, Output* out, Failure* failure) {
    if (!mesh_file_can_write(path, encoding, mesh->precision, failure)) return false;
    bool ascii_name;
    MeshFormat format = mesh_format_of_name(path, &ascii_name);
    Encoding chosen = choose(format, ascii_name, encoding);
    if (!output_open(out, path, failure)) return false;
    bool ok;
    switch (format) {
    case kFormatObj:
        ok = put_list(out, mesh, "v ", "f ", 1);
        break;
    case kFormatOff:
        ok = write_off(out, mesh);
        break;
    case kFormatPly:
        ok = write_ply(out, mesh, chosen);
        break;
    default:
        ok = write_stl(out, mesh, chosen);
        break;
    }
    return output_finish(out, ok);
}

bool mesh_file_write(const char* path, Encoding encoding, const MeshFile* mesh, Failure* failure) {
    Output out;
    return mesh_file_prepare(path, encoding, mesh, &out, failure) && output_commit(&out, 1, true, failure);
}
