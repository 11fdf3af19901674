/* SPDX-License-Identifier: Apache-2.0
 *
 * read_ply.c: PLY, ascii and binary in both orders, elements and properties of any type in any order; what is not x, y, z or a
 * list of vertex indices is stepped over. Triangle strips (element tristrips; -1 ends a strip) become triangles, every second one
 * turned; triangles with a repeated vertex only stitch strips together and are no faces.
 */
#include "reader.h"

#include "bytes.h"

#include <stdlib.h>
#include <string.h>

typedef enum Type { kInt8, kUint8, kInt16, kUint16, kInt32, kUint32, kFloat32, kFloat64, kNoType } Type;
typedef enum Role { kSkip, kX, kY, kZ, kIndices } Role;
typedef enum Kind { kOther, kVertex, kFace, kStrips } Kind;

static const int kTypeSize[] = {1, 1, 2, 2, 4, 4, 4, 8};

typedef struct Property {
    Type type, count_type; /* count_type: kNoType unless a list */
    Role role;
} Property;

typedef struct Element {
    Kind kind;
    int64_t count;
    int64_t first_property, property_count;
    int64_t lists, bytes; /* bytes: of one in binary, without what is in lists; at least so many characters, halved, in ascii */
} Element;

typedef struct Ply {
    bool ascii, has_vertices;
    ByteOrder order;
    Element* elements;
    Property* properties;
    int64_t element_count, property_count, element_capacity, property_capacity;
} Ply;

/* ---- Header */

static Type type_of(Text* t) {
    static const struct {
        const char* name;
        Type type;
    } names[] = {{"char", kInt8},     {"int8", kInt8},       {"uchar", kUint8},    {"uint8", kUint8},
                 {"short", kInt16},   {"int16", kInt16},     {"ushort", kUint16},  {"uint16", kUint16},
                 {"int", kInt32},     {"int32", kInt32},     {"uint", kUint32},    {"uint32", kUint32},
                 {"float", kFloat32}, {"float32", kFloat32}, {"double", kFloat64}, {"float64", kFloat64}};
    text_skip_blanks(t);
    for (size_t i = 0; i < sizeof names / sizeof *names; ++i)
        if (text_take_word(t, names[i].name)) return names[i].type;
    return kNoType;
}

/* Grows with the header, one line of which is longer than an entry. */
static void* append(Reader* reader, void* array, int64_t* count, int64_t* capacity, size_t size) {
    if (*count == *capacity) {
        int64_t wanted = *capacity * 2 + 16;
        void* grown = realloc(array, (size_t)wanted * size);
        if (!grown) {
            fail_memory(reader->failure);
            return NULL;
        }
        array = grown;
        *capacity = wanted;
    }
    memset((char*)array + (size_t)*count * size, 0, size);
    ++*count;
    return array;
}

static bool read_format(Reader* reader, Ply* ply) {
    Text* t = &reader->text;
    text_skip_blanks(t);
    ply->ascii = text_take_word(t, "ascii");
    if (ply->ascii || text_take_word(t, "binary_little_endian")) {
        ply->order = kLittleEndian;
    } else if (text_take_word(t, "binary_big_endian")) {
        ply->order = kBigEndian;
    } else {
        return reader_expected(reader, "ascii, binary_little_endian or binary_big_endian");
    }
    return true;
}

static bool read_element(Reader* reader, Ply* ply) {
    Text* t = &reader->text;
    void* grown = append(reader, ply->elements, &ply->element_count, &ply->element_capacity, sizeof *ply->elements);
    if (!grown) return false;
    ply->elements = grown;
    Element* element = &ply->elements[ply->element_count - 1];
    text_skip_blanks(t);
    if (text_take_word(t, "vertex"))
        element->kind = kVertex;
    else if (text_take_word(t, "face"))
        element->kind = kFace;
    else if (text_take_word(t, "tristrips"))
        element->kind = kStrips;
    else
        t->at += text_word_length(t);
    text_skip_blanks(t);
    if (!text_scan_integer(&t->at, &element->count) || !text_at_break(t))
        return reader_expected(reader, "the number of elements");
    if (element->count < 0) return reader_fail(reader, "the number of elements is %lld", (long long)element->count);
    element->first_property = ply->property_count;
    if (element->kind == kVertex && ply->has_vertices) return reader_fail(reader, "a second element vertex");
    ply->has_vertices |= element->kind == kVertex;
    return true;
}

static bool read_property(Reader* reader, Ply* ply) {
    Text* t = &reader->text;
    if (ply->element_count == 0) return reader_fail(reader, "a property before the first element");
    Property property = {kNoType, kNoType, kSkip};
    text_skip_blanks(t);
    bool list = text_take_word(t, "list");
    if (list) {
        property.count_type = type_of(t);
        if (property.count_type == kNoType) return reader_expected(reader, "the type of a list's size");
    }
    property.type = type_of(t);
    if (property.type == kNoType) return reader_expected(reader, "a type");

    Element* element = &ply->elements[ply->element_count - 1];
    text_skip_blanks(t);
    if (element->kind == kVertex && !list) {
        if (text_take_word(t, "x"))
            property.role = kX;
        else if (text_take_word(t, "y"))
            property.role = kY;
        else if (text_take_word(t, "z"))
            property.role = kZ;
    } else if ((element->kind == kFace || element->kind == kStrips) && list) {
        if (text_take_word(t, "vertex_indices") || text_take_word(t, "vertex_index")) property.role = kIndices;
    }
    if (property.role != kSkip)
        for (int64_t i = element->first_property; i < ply->property_count; ++i)
            if (ply->properties[i].role == property.role) return reader_fail(reader, "a second property of the same name");
    void* grown = append(reader, ply->properties, &ply->property_count, &ply->property_capacity, sizeof property);
    if (!grown) return false;
    ply->properties = grown;
    ply->properties[ply->property_count - 1] = property;
    ++element->property_count;
    element->lists += list;
    element->bytes += kTypeSize[list ? property.count_type : property.type];
    return true;
}

static bool read_header(Reader* reader, Ply* ply) {
    Text* t = &reader->text;
    if (!text_take_word(t, "ply")) return reader_expected(reader, "ply");
    text_skip_blanks(t);
    if (!text_is_newline(*t->at)) return reader_expected(reader, "the end of the line");
    /* All lines end as the first: behind "end_header\r" a byte 10 may already belong to the data. */
    const bool carriage_only = t->at[0] == '\r' && t->at[1] != '\n';
    bool format = false;
    for (;;) {
        if (t->at == t->end) return reader_fail(reader, "the file ended before end_header");
        if (!text_is_newline(*t->at)) return reader_expected(reader, "the end of the line");
        if (carriage_only)
            ++t->at, ++t->line;
        else
            text_newline(t);
        text_skip_blanks(t);
        if (text_take_word(t, "end_header")) break;
        if (text_take_word(t, "format")) {
            if (!read_format(reader, ply)) return false;
            format = true;
            text_skip_line(t);
        } else if (text_take_word(t, "element")) {
            if (!read_element(reader, ply)) return false;
            text_skip_blanks(t);
        } else if (text_take_word(t, "property")) {
            if (!read_property(reader, ply)) return false;
            text_skip_line(t); /* the name */
        } else if (text_take_word(t, "comment") || text_take_word(t, "obj_info")) {
            text_skip_line(t);
        } else if (t->at != t->end && !text_is_newline(*t->at)) {
            return reader_expected(reader, "a statement of a PLY header");
        }
    }
    if (!format) return reader_fail(reader, "end_header came before format");
    text_skip_line(t);
    if (t->at == t->end) return true;
    if (carriage_only)
        ++t->at, ++t->line;
    else
        text_newline(t);
    return true;
}

/* What the header announces must be there before anything is allocated for it. */
static bool check_elements(Reader* reader, const Ply* ply) {
    int64_t left = (int64_t)reader_left(reader);
    for (int64_t e = 0; e < ply->element_count; ++e) {
        const Element* element = &ply->elements[e];
        const char* names[] = {"other", "vertex", "face", "tristrips"};
        int roles[kIndices + 1] = {0};
        for (int64_t i = 0; i < element->property_count; ++i) roles[ply->properties[element->first_property + i].role] = 1;
        if (element->kind == kVertex && element->count > 0 && !(roles[kX] && roles[kY] && roles[kZ]))
            return reader_fail(reader, "element vertex has no properties x, y and z");
        if ((element->kind == kFace || element->kind == kStrips) && element->count > 0 && !roles[kIndices])
            return reader_fail(reader, "element %s has no list vertex_indices", names[element->kind]);
        /* Text: a number and what separates it are two bytes, but for the very last. */
        int64_t bytes = ply->ascii ? 2 * element->property_count : element->bytes;
        if (bytes > 0 && element->count > (left + ply->ascii) / bytes)
            return reader_fail(reader, "%lld elements of kind %s are announced, but the file has room for %lld at most",
                               (long long)element->count, names[element->kind], (long long)((left + ply->ascii) / bytes));
        left -= element->count * bytes;
    }
    return true;
}

/* ---- Body */

/* Where the next number stands. */
static int64_t next_place(Reader* reader, const Ply* ply) {
    if (ply->ascii) text_skip_space(&reader->text, 0);
    return reader_place(reader, &reader->text);
}

/* The next number of the file, whatever its type. */
static bool next_value(Reader* reader, const Ply* ply, Type type, double* out) {
    Text* t = &reader->text;
    if (ply->ascii) {
        text_skip_space(t, 0);
        const Text word = *t;
        if (text_scan_double(&t->at, out) && text_at_break(t)) return true;
        *t = word;
        return reader_expected(reader, "a number");
    }
    if (reader_left(reader) < (size_t)kTypeSize[type]) return reader_fail(reader, "the file ended in the data");
    switch (type) {
    case kInt8:
        *out = (signed char)*t->at;
        break;
    case kUint8:
        *out = (unsigned char)*t->at;
        break;
    case kInt16:
        *out = (int16_t)bytes_u16(t->at, ply->order);
        break;
    case kUint16:
        *out = bytes_u16(t->at, ply->order);
        break;
    case kInt32:
        *out = (int32_t)bytes_u32(t->at, ply->order);
        break;
    case kUint32:
        *out = bytes_u32(t->at, ply->order);
        break;
    case kFloat32:
        *out = bytes_f32(t->at, ply->order);
        break;
    default:
        *out = bytes_f64(t->at, ply->order);
        break;
    }
    t->at += kTypeSize[type];
    return true;
}

static bool next_list_size(Reader* reader, const Ply* ply, Type type, int64_t* out) {
    const Text before = reader->text;
    double value;
    if (!next_value(reader, ply, type, &value)) return false;
    if (!(value >= 0 && value <= INT32_MAX) || value != (double)(int64_t)value) {
        reader->text = before;
        if (ply->ascii) text_skip_space(&reader->text, 0);
        return reader_fail(reader, "%.12g is no size for a list", value);
    }
    *out = (int64_t)value;
    return true;
}

static bool next_index(Reader* reader, const Ply* ply, Type type, bool strip, int64_t* out) {
    const Text before = reader->text;
    double value;
    if (!next_value(reader, ply, type, &value)) return false;
    if (!(value >= (strip ? -1 : 0) && value <= INT32_MAX) || value != (double)(int64_t)value) {
        reader->text = before;
        if (ply->ascii) text_skip_space(&reader->text, 0);
        return reader_fail(reader, "%.12g is no vertex index", value);
    }
    *out = (int64_t)value;
    return true;
}

static bool read_face(Reader* reader, const Ply* ply, Type type, int64_t size) {
    for (int64_t k = 0; k < size; ++k) {
        int64_t index = 0, place = next_place(reader, ply);
        if (!next_index(reader, ply, type, false, &index) || !reader_add_corner(reader, index, place)) return false;
    }
    return reader_close_face(reader);
}

static bool read_strips(Reader* reader, const Ply* ply, Type type, int64_t size) {
    int64_t a = -1, b = -1; /* the last two of the strip */
    bool turned = false;
    for (int64_t k = 0; k < size; ++k) {
        int64_t c = 0, place = next_place(reader, ply);
        if (!next_index(reader, ply, type, true, &c)) return false;
        if (c < 0) {
            a = b = -1;
            continue;
        }
        if (a < 0) {
            turned = false;
        } else {
            if (a != b && b != c && c != a &&
                !(reader_add_corner(reader, turned ? b : a, place) && reader_add_corner(reader, turned ? a : b, place) &&
                  reader_add_corner(reader, c, place) && reader_close_face(reader)))
                return false;
            turned = !turned;
        }
        a = b;
        b = c;
    }
    return true;
}

static bool skip_list(Reader* reader, const Ply* ply, Type type, int64_t size) {
    if (!ply->ascii) {
        if (size > (int64_t)(reader_left(reader) / (size_t)kTypeSize[type]))
            return reader_fail(reader, "the file ended in the data");
        reader->text.at += size * kTypeSize[type];
        return true;
    }
    double unused;
    for (int64_t k = 0; k < size; ++k)
        if (!next_value(reader, ply, type, &unused)) return false;
    return true;
}

static bool read_one(Reader* reader, const Ply* ply, const Element* element) {
    double position[3] = {0, 0, 0};
    for (int64_t i = 0; i < element->property_count; ++i) {
        const Property* property = &ply->properties[element->first_property + i];
        if (property->count_type == kNoType) {
            double value;
            if (!next_value(reader, ply, property->type, &value)) return false;
            if (property->role != kSkip) position[property->role - kX] = value;
            continue;
        }
        int64_t size = 0;
        if (!next_list_size(reader, ply, property->count_type, &size)) return false;
        bool ok;
        if (property->role != kIndices)
            ok = skip_list(reader, ply, property->type, size);
        else if (element->kind == kFace)
            ok = read_face(reader, ply, property->type, size);
        else
            ok = read_strips(reader, ply, property->type, size);
        if (!ok) return false;
    }
    return element->kind != kVertex || reader_add_vertex(reader, position);
}

static bool read_elements(Reader* reader, const Ply* ply) {
    for (int64_t e = 0; e < ply->element_count; ++e) {
        const Element* element = &ply->elements[e];
        if (element->property_count == 0) continue; /* nothing is stored for these, however many */
        if (element->kind == kVertex && !reader_reserve(reader, element->count, 0, 0)) return false;
        if (element->kind == kFace && !reader_reserve(reader, 0, element->count, 3 * element->count)) return false;
        if (element->kind == kOther && element->lists == 0 && !ply->ascii) {
            reader->text.at += element->count * element->bytes; /* check_elements made sure of these */
            if (reader->text.at > reader->text.end) return reader_fail(reader, "the file ended in the data");
            continue;
        }
        for (int64_t i = 0; i < element->count; ++i)
            if (!read_one(reader, ply, element)) return false;
    }
    return true;
}

bool read_ply(Reader* reader) {
    Ply ply;
    memset(&ply, 0, sizeof ply);
    bool ok = read_header(reader, &ply) && check_elements(reader, &ply);
    if (ok && !ply.ascii) {
        reader->binary = true;
        bool all_float = true;
        for (int64_t i = 0; i < ply.property_count; ++i) {
            const Property* p = &ply.properties[i];
            all_float &= p->role != kX && p->role != kY && p->role != kZ ? true : p->type == kFloat32;
        }
        if (all_float) reader->mesh->precision = DELMESH_FLOAT32;
    }
    ok = ok && read_elements(reader, &ply);
    free(ply.elements);
    free(ply.properties);
    return ok;
}
