/* SPDX-License-Identifier: Apache-2.0
 *
 * read_ply.c: PLY, ascii and binary in both orders, elements and properties of any type in any order. Single numbers of vertices
 * and faces become layers: those with the usual names a normal, a colour or UVs, others one each under their own names. A face's
 * list texcoord has the UVs of its corners. Other lists and elements are stepped over. Triangle strips (element tristrips; -1 ends
 * a strip) become triangles, every second one turned; those with a repeated vertex only stitch strips together and are no faces.
 */
#include "reader.h"

#include "bytes.h"

#include <stdlib.h>
#include <string.h>

typedef StoredType Type;
typedef enum Role { kSkip, kX, kY, kZ, kIndices, kTexcoord, kLayerValue } Role;
typedef enum Kind { kOther, kVertex, kFace, kStrips } Kind;

static const int kTypeSize[] = {1, 1, 2, 2, 4, 4, 4, 8};

typedef struct Property {
    Type type, count_type; /* count_type: kNoType unless a list */
    Role role;
    const char* name; /* in the file */
    int32_t length;
    int32_t layer, component; /* of the mesh's layers: role kLayerValue, kTexcoord */
} Property;

typedef struct Element {
    Kind kind;
    int64_t count;
    int64_t first_property, property_count;
    const char* name; /* in the file */
    int32_t length;
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
    element->name = t->at;
    element->length = (int32_t)(text_word_length(t) < 4096 ? text_word_length(t) : 4096);
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
    Property property = {kNoType, kNoType, kSkip, NULL, 0, -1, 0};
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
    property.name = t->at;
    property.length = (int32_t)(text_word_length(t) < 4096 ? text_word_length(t) : 0);
    if (element->kind == kVertex && !list) {
        if (text_take_word(t, "x"))
            property.role = kX;
        else if (text_take_word(t, "y"))
            property.role = kY;
        else if (text_take_word(t, "z"))
            property.role = kZ;
    } else if ((element->kind == kFace || element->kind == kStrips) && list) {
        if (text_take_word(t, "vertex_indices") || text_take_word(t, "vertex_index"))
            property.role = kIndices;
        else if (element->kind == kFace && (property.type == kFloat32 || property.type == kFloat64) &&
                 text_take_word(t, "texcoord"))
            property.role = kTexcoord;
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

/* "comment TextureFile name": where the texture is, as MeshLab and others write it. */
static bool read_comment(Reader* reader) {
    Text* t = &reader->text;
    text_skip_blanks(t);
    const bool texture = text_take_word(t, "texturefile");
    text_skip_blanks(t);
    const char* begin = t->at;
    text_skip_line(t);
    const char* end = t->at;
    while (end > begin && text_is_blank(end[-1])) --end;
    return !texture || begin == end || names_add(&reader->mesh->libraries, begin, (size_t)(end - begin)) >= 0 ||
           fail_memory(reader->failure);
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
        } else if (text_take_word(t, "comment")) {
            if (!read_comment(reader)) return false;
        } else if (text_take_word(t, "obj_info")) {
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

/* ---- Layers */

static bool is_named(const Property* property, const char* name) {
    return (size_t)property->length == strlen(name) && memcmp(property->name, name, (size_t)property->length) == 0;
}

static Property* find_property(const Ply* ply, const Element* element, const char* name) {
    for (int64_t i = 0; i < element->property_count; ++i) {
        Property* property = &ply->properties[element->first_property + i];
        if (property->count_type == kNoType && property->role == kSkip && is_named(property, name)) return property;
    }
    return NULL;
}

/* The layer takes its values from the properties, whose names it gets. */
static bool add_layer(Reader* reader, LayerKind kind, int32_t domain, Property* const* properties, int32_t count) {
    Layer layer = layer_make(kind, domain, properties[0]->type, count);
    size_t size = 1;
    for (int32_t k = 0; k < count; ++k) size += (size_t)properties[k]->length + 1;
    char* at = layer.names = malloc(size);
    if (!at) return fail_memory(reader->failure);
    for (int32_t k = 0; k < count; ++k) {
        if (k > 0) *at++ = ' ';
        memcpy(at, properties[k]->name, (size_t)properties[k]->length);
        at += properties[k]->length;
        properties[k]->role = kLayerValue;
        properties[k]->layer = reader->mesh->layers.count;
        properties[k]->component = k;
    }
    *at = '\0';
    return reader_add_layer(reader, &layer);
}

/* The properties that belong together under names that are in use. */
static bool add_known_layers(Reader* reader, Ply* ply, const Element* element, int32_t domain) {
    static const struct {
        LayerKind kind;
        int32_t least, most;
        const char* names[kMostComponents];
    } known[] = {{kLayerNormal, 3, 3, {"nx", "ny", "nz"}},
                 {kLayerColor, 3, 4, {"red", "green", "blue", "alpha"}},
                 {kLayerColor, 3, 4, {"diffuse_red", "diffuse_green", "diffuse_blue", "diffuse_alpha"}},
                 {kLayerUv, 2, 2, {"s", "t"}},
                 {kLayerUv, 2, 2, {"u", "v"}},
                 {kLayerUv, 2, 2, {"texture_u", "texture_v"}},
                 {kLayerUv, 2, 2, {"texture_s", "texture_t"}},
                 {kLayerMaterial, 1, 1, {"material_index"}},
                 {kLayerMaterial, 1, 1, {"texnumber"}},
                 {kLayerGroup, 1, 1, {"group_index"}},
                 {kLayerObject, 1, 1, {"object_index"}},
                 {kLayerSmoothing, 1, 1, {"smoothing_group"}}};
    for (size_t i = 0; i < sizeof known / sizeof *known; ++i) {
        const bool ids = known[i].kind >= kLayerMaterial, real = known[i].kind == kLayerUv || known[i].kind == kLayerNormal;
        if (ids != (domain == DELMESH_DOMAIN_FACE) && known[i].kind != kLayerColor) continue;
        Property* found[kMostComponents];
        int32_t count = 0;
        while (count < known[i].most) {
            Property* p = found[count] = find_property(ply, element, known[i].names[count]);
            if (!p || p->type != found[0]->type) break;
            if ((real && p->type < kFloat32) || (ids && p->type >= kFloat32)) break;
            ++count;
        }
        if (count >= known[i].least && !add_layer(reader, known[i].kind, domain, found, count)) return false;
    }
    return true;
}

static bool add_layers(Reader* reader, Ply* ply) {
    bool texcoord = false;
    for (int64_t e = 0; e < ply->element_count; ++e) {
        const Element* element = &ply->elements[e];
        if (element->count == 0) continue;
        if (element->kind != kVertex && element->kind != kFace) {
            if (element->kind == kOther && !reader_leave_out(reader, element->name, (size_t)element->length)) return false;
            continue;
        }
        const int32_t domain = element->kind == kVertex ? DELMESH_DOMAIN_VERTEX : DELMESH_DOMAIN_FACE;
        if (!add_known_layers(reader, ply, element, domain)) return false;
        for (int64_t i = 0; i < element->property_count; ++i) {
            Property* property = &ply->properties[element->first_property + i];
            if (property->role == kTexcoord && !texcoord) {
                texcoord = true;
                property->layer = reader->mesh->layers.count;
                Layer layer = layer_make(kLayerUv, DELMESH_DOMAIN_CORNER, property->type, 2);
                if (!reader_add_layer(reader, &layer)) return false;
            } else if (property->count_type != kNoType && property->role != kIndices) {
                property->role = kSkip;
                if (!reader_leave_out(reader, property->name, (size_t)property->length)) return false;
            } else if (property->role == kSkip && property->length > 0 && !add_layer(reader, kLayerOther, domain, &property, 1)) {
                return false;
            }
        }
    }
    return true;
}

/* What the header announces must be there before anything is allocated for it. */
static bool check_elements(Reader* reader, const Ply* ply) {
    int64_t left = (int64_t)reader_left(reader);
    for (int64_t e = 0; e < ply->element_count; ++e) {
        const Element* element = &ply->elements[e];
        const char* names[] = {"other", "vertex", "face", "tristrips"};
        int roles[kLayerValue + 1] = {0};
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

/* The face that was read last is known only now, if the list came first. */
static bool read_texcoord(Reader* reader, const Ply* ply, const Property* property, int64_t first, int64_t size, Text at) {
    const int64_t corners = reader->mesh->corner_count;
    Layer* layer = &reader->mesh->layers.items[property->layer];
    if (!layer_extend(layer, corners)) return fail_memory(reader->failure);
    if (size != 2 * (corners - first)) return true; /* a face without; or not one UV for each corner */
    const Text behind = reader->text;
    reader->text = at;
    for (int64_t k = 0; k < size; ++k) {
        double value;
        if (!next_value(reader, ply, property->type, &value)) return false;
        layer_set(layer, first + k / 2, (int32_t)(k % 2), value);
    }
    reader->text = behind;
    return true;
}

/* index: that of the vertex or face. */
static bool read_one(Reader* reader, const Ply* ply, const Element* element, int64_t index) {
    double position[3] = {0, 0, 0};
    Layer* const layers = reader->mesh->layers.items;
    const int64_t first_corner = reader->mesh->corner_count;
    const Property* texcoord = NULL;
    Text texcoord_at = reader->text;
    int64_t texcoord_size = 0;
    for (int64_t i = 0; i < element->property_count; ++i) {
        const Property* property = &ply->properties[element->first_property + i];
        if (property->count_type == kNoType) {
            double value;
            if (!next_value(reader, ply, property->type, &value)) return false;
            if (property->role == kLayerValue)
                layer_set(&layers[property->layer], index, property->component, value);
            else if (property->role != kSkip)
                position[property->role - kX] = value;
            continue;
        }
        int64_t size = 0;
        if (!next_list_size(reader, ply, property->count_type, &size)) return false;
        bool ok;
        if (property->role == kTexcoord) {
            texcoord = property;
            texcoord_at = reader->text;
            texcoord_size = size;
        }
        if (property->role != kIndices)
            ok = skip_list(reader, ply, property->type, size);
        else if (element->kind == kFace)
            ok = read_face(reader, ply, property->type, size);
        else
            ok = read_strips(reader, ply, property->type, size);
        if (!ok) return false;
    }
    if (texcoord && !read_texcoord(reader, ply, texcoord, first_corner, texcoord_size, texcoord_at)) return false;
    return element->kind != kVertex || reader_add_vertex(reader, position);
}

/* Room for the layers' values, whose number the file's size has confirmed. */
static bool reserve_layers(Reader* reader, const Ply* ply, const Element* element) {
    const int64_t count = element->count + (element->kind == kFace ? reader->mesh->face_count : 0);
    for (int64_t i = 0; i < element->property_count; ++i) {
        const Property* property = &ply->properties[element->first_property + i];
        if (property->role != kLayerValue) continue;
        Layer* layer = &reader->mesh->layers.items[property->layer];
        if (!layer_reserve(layer, count) || !layer_extend(layer, count)) return fail_memory(reader->failure);
    }
    return true;
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
        if (!reserve_layers(reader, ply, element)) return false;
        const int64_t base = element->kind == kFace ? reader->mesh->face_count : 0;
        for (int64_t i = 0; i < element->count; ++i)
            if (!read_one(reader, ply, element, base + i)) return false;
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
    ok = ok && add_layers(reader, &ply) && read_elements(reader, &ply);
    free(ply.elements);
    free(ply.properties);
    return ok;
}
