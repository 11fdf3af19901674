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
#include <stdlib.h>
#include <string.h>

static void position(const MeshFile* mesh, int64_t vertex, double out[3]) {
    for (int k = 0; k < 3; ++k)
        out[k] = mesh->precision == DELMESH_FLOAT32 ? (double)((const float*)mesh->positions)[3 * vertex + k]
                                                    : ((const double*)mesh->positions)[3 * vertex + k];
}

/* "<prefix>x y z\n" */
static bool put_numbers(Output* out, const char* prefix, const double* numbers, int32_t count) {
    size_t length = strlen(prefix);
    char* begin = output_reserve(out, length + (size_t)count * (kTextDoubleSize + 1) + 1);
    if (!begin) return false;
    char* at = begin;
    memcpy(at, prefix, length);
    at += length;
    for (int32_t k = 0; k < count; ++k) {
        at += text_print_double(at, numbers[k]);
        *at++ = k < count - 1 ? ' ' : '\n';
    }
    out->used += (size_t)(at - begin);
    return true;
}

static bool put_point(Output* out, const char* prefix, const double p[3]) {
    return put_numbers(out, prefix, p, 3);
}

static bool put_text(Output* out, const char* text) {
    return output_write(out, text, strlen(text));
}

static const Layer* find_layer(const MeshFile* mesh, LayerKind kind) {
    for (int32_t i = 0; i < mesh->layers.count; ++i)
        if (mesh->layers.items[i].kind == kind) return &mesh->layers.items[i];
    return NULL;
}

/* The number as it stands in text. Integers that stand for 0 to 1 get as many digits as tell them apart. */
static double color_of(const Layer* layer, int64_t index, int32_t component) {
    const double scale = layer_color_scale(layer), value = layer_get(layer, index, component);
    return scale == 1 ? value : rint(value / scale * 1e6) / 1e6;
}

/* ---- OBJ */

/* The distinct values of a layer, numbered in the order in which they come first. */
typedef struct Distinct {
    int32_t* index; /* of each element: the number of its value; -1: it has none */
    int64_t* first; /* of each value: an element that has it */
    int64_t count;
} Distinct;

static void distinct_free(Distinct* distinct) {
    free(distinct->index);
    free(distinct->first);
}

static bool distinct_make(const Layer* layer, Distinct* out) {
    memset(out, 0, sizeof *out);
    if (!layer) return true;
    const size_t size = layer_element_size(layer);
    size_t slots = 64;
    while (slots < 2 * (size_t)layer->count) slots *= 2;
    int32_t* table = malloc(slots * sizeof *table);
    out->index = malloc((size_t)layer->count * sizeof *out->index + 1);
    out->first = malloc((size_t)layer->count * sizeof *out->first + 1);
    const bool ok = table && out->index && out->first;
    for (size_t i = 0; ok && i < slots; ++i) table[i] = -1;
    for (int64_t i = 0; ok && i < layer->count; ++i) {
        out->index[i] = -1;
        if (layer_is_missing(layer, i)) continue;
        const unsigned char* bytes = (const unsigned char*)layer->values + (size_t)i * size;
        uint64_t hash = 0xcbf29ce484222325u;
        for (size_t k = 0; k < size; ++k) hash = (hash ^ bytes[k]) * 0x100000001b3u;
        size_t slot = (size_t)(hash ^ hash >> 29) & (slots - 1);
        while (table[slot] >= 0 && memcmp((const char*)layer->values + (size_t)out->first[table[slot]] * size, bytes, size) != 0)
            slot = (slot + 1) & (slots - 1);
        if (table[slot] < 0) {
            out->first[out->count] = i;
            table[slot] = (int32_t)out->count++;
        }
        out->index[i] = table[slot];
    }
    free(table);
    return ok;
}

static bool put_distinct(Output* out, const char* prefix, const Layer* layer, const Distinct* distinct) {
    double numbers[kMostComponents];
    for (int64_t i = 0; i < distinct->count; ++i) {
        for (int32_t k = 0; k < layer->components; ++k) numbers[k] = layer_get(layer, distinct->first[i], k);
        if (!put_numbers(out, prefix, numbers, layer->components)) return false;
    }
    return true;
}

/* "12", "12/3", "12//4" or "12/3/4" */
static size_t print_corner(char* at, int64_t vertex, int64_t uv, int64_t normal) {
    char* begin = at;
    at += text_print_integer(at, vertex + 1);
    if (uv >= 0 || normal >= 0) *at++ = '/';
    if (uv >= 0) at += text_print_integer(at, uv + 1);
    if (normal >= 0) {
        *at++ = '/';
        at += text_print_integer(at, normal + 1);
    }
    return (size_t)(at - begin);
}

static int64_t value_of(const Layer* layer, const Distinct* distinct, const MeshFile* mesh, int64_t corner) {
    if (!layer) return -1;
    return distinct->index[layer->domain == DELMESH_DOMAIN_VERTEX ? mesh->corner_verts[corner] : corner];
}

/* "usemtl red\n" and the like, where a face has another id than the one before. */
static bool put_ids(Output* out, const MeshFile* mesh, int64_t face, int64_t* current) {
    static const struct {
        LayerKind kind;
        const char *word, *none;
    } statements[] = {
        {kLayerObject, "o", ""}, {kLayerGroup, "g", ""}, {kLayerMaterial, "usemtl", ""}, {kLayerSmoothing, "s", "off"}};
    for (size_t i = 0; i < sizeof statements / sizeof *statements; ++i) {
        const Layer* layer = find_layer(mesh, statements[i].kind);
        if (!layer) continue;
        const int64_t id = (int64_t)layer_get(layer, face, 0);
        if (id == current[i]) continue;
        current[i] = id;
        char number[64];
        const char* name = number;
        const bool named = id >= 0 && id < layer->ids.count;
        if (named)
            name = id == 0 ? statements[i].none : names_at(&layer->ids, (int32_t)id);
        else if (layer->kind == kLayerSmoothing)
            snprintf(number, sizeof number, "%lld", (long long)id);
        else
            snprintf(number, sizeof number, "%s_%lld", layer_kind_name(layer->kind), (long long)id);
        if (!put_text(out, statements[i].word) || !put_text(out, " ") || !put_text(out, name) || !put_text(out, "\n"))
            return false;
    }
    return true;
}

static bool put_obj_faces(Output* out, const MeshFile* mesh, const Layer* uv, const Distinct* uvs, const Layer* normal,
                          const Distinct* normals) {
    /* No statement takes a usemtl back for all readers: faces without a material come first. */
    const Layer* material = find_layer(mesh, kLayerMaterial);
    const bool two = material && material->ids.count > 0;
    int64_t current[4] = {0, 0, 0, 0};
    for (int i = 0; i < 4; ++i) { /* numbers alone have no 0 that is none */
        static const LayerKind kinds[] = {kLayerObject, kLayerGroup, kLayerMaterial, kLayerSmoothing};
        const Layer* layer = find_layer(mesh, kinds[i]);
        if (layer && layer->ids.count == 0 && kinds[i] != kLayerSmoothing) current[i] = INT64_MIN;
    }
    for (int pass = 0; pass < (two ? 2 : 1); ++pass) {
        for (int64_t f = 0; f < mesh->face_count; ++f) {
            if (two && (layer_get(material, f, 0) != 0) != pass) continue;
            if (!put_ids(out, mesh, f, current)) return false;
            char* begin = output_reserve(out, 8 + 9 * (kTextDoubleSize + 1));
            if (!begin) return false;
            char* at = begin;
            *at++ = 'f';
            for (int64_t c = 3 * f; c < 3 * f + 3; ++c) {
                *at++ = ' ';
                at += print_corner(at, mesh->corner_verts[c], value_of(uv, uvs, mesh, c), value_of(normal, normals, mesh, c));
            }
            *at++ = '\n';
            out->used += (size_t)(at - begin);
        }
    }
    return true;
}

static bool write_obj(Output* out, const MeshFile* mesh) {
    const Layer *uv = find_layer(mesh, kLayerUv), *normal = find_layer(mesh, kLayerNormal);
    const Layer* color = find_layer(mesh, kLayerColor);
    for (int32_t i = 0; i < mesh->libraries.count; ++i)
        if (!put_text(out, "mtllib ") || !put_text(out, names_at(&mesh->libraries, i)) || !put_text(out, "\n")) return false;
    for (int64_t v = 0; v < mesh->vertex_count; ++v) {
        double numbers[6];
        position(mesh, v, numbers);
        for (int32_t k = 0; color && k < 3; ++k) numbers[3 + k] = color_of(color, v, k);
        if (!put_numbers(out, "v ", numbers, color ? 6 : 3)) return false;
    }
    Distinct uvs, normals = {NULL, NULL, 0};
    bool ok = (distinct_make(uv, &uvs) && distinct_make(normal, &normals)) || fail_memory(out->failure);
    ok = ok && (!uv || put_distinct(out, "vt ", uv, &uvs)) && (!normal || put_distinct(out, "vn ", normal, &normals)) &&
         put_obj_faces(out, mesh, uv, &uvs, normal, &normals);
    distinct_free(&uvs);
    distinct_free(&normals);
    return ok;
}

/* ---- OFF */

static bool put_triangle(Output* out, const int32_t* corners, bool end) {
    char* begin = output_reserve(out, 4 + 3 * (kTextDoubleSize + 1));
    if (!begin) return false;
    char* at = begin;
    *at++ = '3';
    for (int k = 0; k < 3; ++k) {
        *at++ = ' ';
        at += text_print_integer(at, corners[k]);
    }
    if (end) *at++ = '\n';
    out->used += (size_t)(at - begin);
    return true;
}

static bool write_off(Output* out, const MeshFile* mesh) {
    const Layer* layers[] = {find_layer(mesh, kLayerNormal), find_layer(mesh, kLayerColor), find_layer(mesh, kLayerUv)};
    char header[96];
    snprintf(header, sizeof header, "%s%s%sOFF\n%lld %lld 0\n", layers[2] ? "ST" : "", layers[1] ? "C" : "", layers[0] ? "N" : "",
             (long long)mesh->vertex_count, (long long)mesh->face_count);
    if (!put_text(out, header)) return false;
    for (int64_t v = 0; v < mesh->vertex_count; ++v) {
        double numbers[3 + 3 * kMostComponents];
        position(mesh, v, numbers);
        int32_t count = 3;
        for (size_t i = 0; i < sizeof layers / sizeof *layers; ++i) {
            for (int32_t k = 0; layers[i] && k < layers[i]->components; ++k) {
                const bool scaled = layers[i]->kind == kLayerColor && layers[i]->stored != kUint8;
                const double value = scaled ? color_of(layers[i], v, k) : layer_get(layers[i], v, k);
                numbers[count++] = isnan(value) ? 0 : value; /* there is no word for none */
            }
        }
        if (!put_numbers(out, "", numbers, count)) return false;
    }
    for (int64_t f = 0; f < mesh->face_count; ++f)
        if (!put_triangle(out, mesh->corner_verts + 3 * f, true)) return false;
    return true;
}

/* ---- PLY */

static const char* const kTypeNames[] = {"char", "uchar", "short", "ushort", "int", "uint", "float", "double"};

/* Text has no types: its numbers get the precision of the positions. */
static StoredType ply_type(const Layer* layer, int32_t precision) {
    if (layer->stored != kNoType) return layer->stored;
    return layer_is_id(layer) ? kInt32 : precision == DELMESH_FLOAT32 ? kFloat32 : kFloat64;
}

/* The usual names of the kind's components. */
static const char* ply_names(const Layer* layer) {
    switch (layer->kind) {
    case kLayerUv:
        return "s t";
    case kLayerNormal:
        return "nx ny nz";
    case kLayerColor:
        return "red green blue alpha";
    case kLayerMaterial:
        return "material_index";
    case kLayerGroup:
        return "group_index";
    case kLayerObject:
        return "object_index";
    case kLayerSmoothing:
        return "smoothing_group";
    default:
        return "value";
    }
}

static bool put_properties(Output* out, const MeshFile* mesh, int32_t domain) {
    for (int32_t i = 0; i < mesh->layers.count; ++i) {
        const Layer* layer = &mesh->layers.items[i];
        if (layer->domain != domain) continue;
        const char* name = layer->names ? layer->names : ply_names(layer);
        for (int32_t k = 0; k < layer->components && *name; ++k) {
            const size_t length = strcspn(name, " ");
            if (!put_text(out, "property ") || !put_text(out, kTypeNames[ply_type(layer, mesh->precision)]) ||
                !put_text(out, " ") || !output_write(out, name, length) || !put_text(out, "\n"))
                return false;
            name += length + (name[length] == ' ');
        }
    }
    return true;
}

static bool put_ply_header(Output* out, const MeshFile* mesh, Encoding encoding, const Layer* texcoord) {
    const char* type = mesh->precision == DELMESH_FLOAT32 ? "float" : "double";
    const char* format = encoding == kEncodingAscii ? "ascii"
                         : encoding == kEncodingBig ? "binary_big_endian"
                                                    : "binary_little_endian";
    char text[384];
    snprintf(text, sizeof text, "ply\nformat %s 1.0\n", format);
    if (!put_text(out, text)) return false;
    for (int32_t i = 0; i < mesh->libraries.count; ++i)
        if (!put_text(out, "comment TextureFile ") || !put_text(out, names_at(&mesh->libraries, i)) || !put_text(out, "\n"))
            return false;
    snprintf(text, sizeof text, "element vertex %lld\nproperty %s x\nproperty %s y\nproperty %s z\n",
             (long long)mesh->vertex_count, type, type, type);
    if (!put_text(out, text) || !put_properties(out, mesh, DELMESH_DOMAIN_VERTEX)) return false;
    snprintf(text, sizeof text, "element face %lld\nproperty list uchar int vertex_indices\n", (long long)mesh->face_count);
    if (!put_text(out, text)) return false;
    snprintf(text, sizeof text, "property list uchar %s texcoord\n",
             texcoord ? kTypeNames[ply_type(texcoord, mesh->precision)] : "");
    return (!texcoord || put_text(out, text)) && put_properties(out, mesh, DELMESH_DOMAIN_FACE) && put_text(out, "end_header\n");
}

/* A number in binary, or behind a blank in text. */
static bool put_value(Output* out, Encoding encoding, StoredType type, double value) {
    char* at = output_reserve(out, kTextDoubleSize + 1);
    if (!at) return false;
    const ByteOrder order = encoding == kEncodingBig ? kBigEndian : kLittleEndian;
    if (encoding == kEncodingAscii) {
        *at = ' ';
        out->used += 1 + text_print_double(at + 1, value);
        return true;
    }
    switch (type) {
    case kFloat64:
        bytes_put_f64(at, value, order);
        out->used += 8;
        return true;
    case kFloat32:
        bytes_put_f32(at, (float)value, order);
        out->used += 4;
        return true;
    case kInt32:
    case kUint32:
        bytes_put_u32(at, (uint32_t)(int64_t)value, order);
        out->used += 4;
        return true;
    case kInt16:
    case kUint16:
        bytes_put_u16(at, (uint32_t)(int64_t)value, order);
        out->used += 2;
        return true;
    default:
        *at = (char)(unsigned char)(uint32_t)(int64_t)value;
        out->used += 1;
        return true;
    }
}

static bool put_element(Output* out, const MeshFile* mesh, Encoding encoding, int32_t domain, int64_t index) {
    for (int32_t i = 0; i < mesh->layers.count; ++i) {
        const Layer* layer = &mesh->layers.items[i];
        if (layer->domain != domain) continue;
        const StoredType type = ply_type(layer, mesh->precision);
        const bool none = layer->stored == kNoType && layer_is_missing(layer, index); /* there is no word for that */
        for (int32_t k = 0; k < layer->components; ++k)
            if (!put_value(out, encoding, type, none ? 0 : layer_get(layer, index, k))) return false;
    }
    return encoding != kEncodingAscii || put_text(out, "\n");
}

/* The UVs of a face's corners, or an empty list where one has none. */
static bool put_texcoord(Output* out, const MeshFile* mesh, Encoding encoding, const Layer* layer, int64_t face) {
    if (!layer) return true;
    bool missing = false;
    for (int64_t c = 3 * face; c < 3 * face + 3; ++c) missing |= layer_is_missing(layer, c);
    if (!put_value(out, encoding, kUint8, missing ? 0 : 6)) return false;
    for (int64_t k = 0; k < 6 && !missing; ++k)
        if (!put_value(out, encoding, ply_type(layer, mesh->precision), layer_get(layer, 3 * face + k / 2, (int32_t)(k % 2))))
            return false;
    return true;
}

static bool write_ply(Output* out, const MeshFile* mesh, Encoding encoding) {
    const bool ascii = encoding == kEncodingAscii;
    const Layer* texcoord = NULL;
    for (int32_t i = 0; i < mesh->layers.count; ++i)
        if (mesh->layers.items[i].domain == DELMESH_DOMAIN_CORNER) texcoord = &mesh->layers.items[i];
    if (!put_ply_header(out, mesh, encoding, texcoord)) return false;
    const ByteOrder order = encoding == kEncodingBig ? kBigEndian : kLittleEndian;
    const bool single = mesh->precision == DELMESH_FLOAT32;
    const int size = single ? 4 : 8;
    for (int64_t v = 0; v < mesh->vertex_count; ++v) {
        char* at = output_reserve(out, 3 * (kTextDoubleSize + 1));
        if (!at) return false;
        char* const begin = at;
        double p[3];
        position(mesh, v, p);
        for (int k = 0; k < 3; ++k) {
            if (ascii) {
                if (k > 0) *at++ = ' ';
                at += text_print_double(at, p[k]);
                continue;
            }
            if (single)
                bytes_put_f32(at, (float)p[k], order);
            else
                bytes_put_f64(at, p[k], order);
            at += size;
        }
        out->used += (size_t)(at - begin);
        if (!put_element(out, mesh, encoding, DELMESH_DOMAIN_VERTEX, v)) return false;
    }
    for (int64_t f = 0; f < mesh->face_count; ++f) {
        if (ascii) {
            if (!put_triangle(out, mesh->corner_verts + 3 * f, false)) return false;
        } else {
            char* at = output_reserve(out, 13);
            if (!at) return false;
            *at = 3;
            for (int k = 0; k < 3; ++k) bytes_put_u32(at + 1 + 4 * k, (uint32_t)mesh->corner_verts[3 * f + k], order);
            out->used += 13;
        }
        if (!put_texcoord(out, mesh, encoding, texcoord, f) || !put_element(out, mesh, encoding, DELMESH_DOMAIN_FACE, f))
            return false;
    }
    return true;
}

/* ---- STL */

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
        ok = write_obj(out, mesh);
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
