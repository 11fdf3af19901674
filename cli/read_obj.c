/* SPDX-License-Identifier: Apache-2.0
 *
 * read_obj.c: Wavefront OBJ: `v` with colours, `vt`, `vn`, `f`, and the statements that hold for the faces behind them: `usemtl`,
 * `g`, `o`, `s`; `mtllib`; `t` with the tags of cages. A backslash at the end of a line joins it to the next. Texture and normal
 * indices must be numbers; where there is no such texture vertex or normal, the corner has none.
 */
#include "reader.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* The numbers of vt or vn lines, and which of them each corner so far has. */
typedef struct Table {
    double* values; /* count x 3 */
    int64_t count, capacity;
    int32_t components; /* the most that a line had */
    int32_t* index;     /* of corners, -1: none; NULL: none has one */
    int64_t corners, index_capacity;
} Table;

enum { kIdLayers = 4 };

typedef struct Obj {
    Table uv, normal;
    Layer color;
    Layer ids[kIdLayers];
    int32_t current[kIdLayers]; /* what the faces that come now have */
    bool ids_used[kIdLayers];
} Obj;

static const struct {
    const char* word;
    LayerKind kind;
} kIdStatements[kIdLayers] = {{"usemtl", kLayerMaterial}, {"g", kLayerGroup}, {"o", kLayerObject}, {"s", kLayerSmoothing}};

/* Over blanks and joined lines. */
static void skip_blanks(Text* t) {
    for (;;) {
        text_skip_blanks(t);
        if (*t->at != '\\' || !text_is_newline(t->at[1])) return;
        ++t->at;
        text_newline(t);
    }
}

/* Over the rest of a statement, its joined lines included. */
static void skip_statement(Text* t) {
    for (;;) {
        text_skip_line(t);
        if (t->at == t->end || t->at[-1] != '\\') return;
        text_newline(t);
        if (t->at == t->end) return;
    }
}

static bool at_break(const Text* t) {
    return text_at_break(t) || (*t->at == '\\' && text_is_newline(t->at[1]));
}

/* Up to `most` numbers, as far as there are such. */
static int32_t scan_numbers(Text* t, double* out, int32_t most) {
    int32_t n = 0;
    for (; n < most; ++n) {
        skip_blanks(t);
        const Text word = *t;
        if (text_scan_double(&t->at, &out[n]) && at_break(t)) continue;
        *t = word;
        break;
    }
    return n;
}

/* Behind the coordinates: one number is a weight, which says nothing about the point; three are a colour. */
static bool read_color(Reader* reader, Obj* obj) {
    Text* t = &reader->text;
    const int64_t vertex = reader->mesh->vertex_count;
    double rgb[4];
    skip_blanks(t);
    if (text_is_newline(*t->at)) return true;
    if (scan_numbers(t, rgb, 4) != 3 || !isfinite(rgb[0]) || !isfinite(rgb[1]) || !isfinite(rgb[2])) return true;
    if (!layer_extend(&obj->color, vertex + 1)) return fail_memory(reader->failure);
    for (int32_t k = 0; k < 3; ++k) layer_set(&obj->color, vertex, k, rgb[k]);
    return true;
}

static bool read_vertex(Reader* reader, Obj* obj) {
    Text* t = &reader->text;
    double position[3];
    for (int k = 0; k < 3; ++k) {
        skip_blanks(t);
        const Text word = *t;
        if (!text_scan_double(&t->at, &position[k]) || !at_break(t)) {
            *t = word;
            return reader_expected(reader, "a coordinate");
        }
    }
    if (!read_color(reader, obj)) return false;
    skip_statement(t);
    return reader_add_vertex(reader, position);
}

/* vt or vn. Numbers that are missing are 0: the indices of the others must not change. */
static bool read_table(Reader* reader, Table* table) {
    Text* t = &reader->text;
    double numbers[3] = {0, 0, 0};
    const int32_t n = scan_numbers(t, numbers, 3);
    if (n > table->components) table->components = n;
    skip_statement(t);
    if (table->count == table->capacity &&
        !reader_grow(reader, (void**)&table->values, &table->capacity, sizeof numbers, "texture vertices or normals"))
        return false;
    memcpy(table->values + 3 * table->count++, numbers, sizeof numbers);
    return true;
}

/* For the corner that comes now. index: as in the file, 0: none. */
static bool put_index(Reader* reader, Table* table, int64_t index) {
    if (!table->index && index == 0) return true;
    index = index < 0 ? table->count + index : index - 1;
    if (index < 0 || index > INT32_MAX) index = -1;
    for (const int64_t corner = reader->mesh->corner_count; table->corners <= corner; ++table->corners) {
        if (table->corners == table->index_capacity &&
            !reader_grow(reader, (void**)&table->index, &table->index_capacity, sizeof *table->index, "face corners"))
            return false;
        table->index[table->corners] = table->corners == corner ? (int32_t)index : -1;
    }
    return true;
}

/* One corner: v, v/vt, v//vn, v/vt/vn, with empty parts allowed at the end. */
static bool read_corner(Reader* reader, Obj* obj) {
    Text* t = &reader->text;
    const Text word = *t;
    int64_t index, others[2] = {0, 0};
    bool ok = text_scan_integer(&t->at, &index);
    for (int part = 0; ok && part < 2 && *t->at == '/'; ++part) {
        ++t->at;
        if (*t->at != '/' && !at_break(t)) ok = text_scan_integer(&t->at, &others[part]);
    }
    if (!ok || !at_break(t)) {
        *t = word;
        return reader_expected(reader, "a face corner");
    }
    int64_t vertices = reader->mesh->vertex_count;
    if (index == 0) {
        *t = word;
        return reader_fail(reader, "a face refers to vertex 0, but OBJ counts from 1");
    }
    if (index < -vertices || index > INT32_MAX) {
        *t = word;
        return reader_fail(reader, "a face refers to vertex %lld, but only %lld came before", (long long)index,
                           (long long)vertices);
    }
    return put_index(reader, &obj->uv, others[0]) && put_index(reader, &obj->normal, others[1]) &&
           reader_add_corner(reader, index < 0 ? vertices + index : index - 1, word.line);
}

static bool close_face(Reader* reader, Obj* obj) {
    const int64_t face = reader->mesh->face_count;
    for (int i = 0; i < kIdLayers; ++i) {
        if (!obj->ids_used[i]) continue;
        if (!layer_extend(&obj->ids[i], face + 1)) return fail_memory(reader->failure);
        layer_set(&obj->ids[i], face, 0, obj->current[i]);
    }
    return reader_close_face(reader);
}

static bool read_face(Reader* reader, Obj* obj) {
    Text* t = &reader->text;
    for (;;) {
        skip_blanks(t);
        if (t->at == t->end || text_is_newline(*t->at)) return close_face(reader, obj);
        if (*t->at == '#') { /* a comment behind the statement */
            text_skip_line(t);
            return close_face(reader, obj);
        }
        if (*t->at == '\\' && t->at + 1 == t->end) { /* joined to nothing */
            ++t->at;
            return close_face(reader, obj);
        }
        if (!read_corner(reader, obj)) return false;
    }
}

/* The rest of the statement, without the blanks around it, as a name; -1: no memory. Names may have blanks within, and a # . */
static int32_t read_name(Text* t, Names* names) {
    skip_blanks(t);
    const char* begin = t->at;
    skip_statement(t);
    const char* end = begin; /* a name over several lines is taken up to the first's end */
    while (end < t->at && !text_is_newline(*end)) ++end;
    if (end < t->at && end > begin && end[-1] == '\\') --end;
    while (end > begin && text_is_blank(end[-1])) --end;
    return names_add(names, begin, (size_t)(end - begin));
}

static bool read_id(Reader* reader, Obj* obj, int i) {
    Layer* layer = &obj->ids[i];
    const Text behind = reader->text;
    int32_t id = names_add(&layer->ids, "", 0) < 0 ? -1 : read_name(&reader->text, &layer->ids);
    if (id < 0) return fail_memory(reader->failure);
    if (kIdStatements[i].kind == kLayerSmoothing) { /* "0" is "off" */
        Text word = behind;
        skip_blanks(&word);
        if (text_take_word(&word, "off") || text_take_word(&word, "0")) id = 0;
    }
    obj->ids_used[i] |= id != 0;
    obj->current[i] = id;
    return true;
}

/* The statement of that name, if the text is at it, and over its name. */
static bool take(Text* t, const char* word) {
    const size_t length = strlen(word);
    if (strncmp(t->at, word, length) != 0) return false;
    const Text behind = {t->at + length, t->end, t->line};
    if (!at_break(&behind)) return false;
    *t = behind;
    return true;
}

static bool read_statement(Reader* reader, Obj* obj) {
    Text* t = &reader->text;
    if (take(t, "v")) return read_vertex(reader, obj);
    if (take(t, "f")) return read_face(reader, obj);
    if (take(t, "vt")) return read_table(reader, &obj->uv);
    if (take(t, "vn")) return read_table(reader, &obj->normal);
    for (int i = 0; i < kIdLayers; ++i)
        if (take(t, kIdStatements[i].word)) return read_id(reader, obj, i);
    if (take(t, "t")) {
        bool taken;
        if (!tags_scan_obj(t, &reader->mesh->tags, &taken)) return fail_memory(reader->failure);
        skip_statement(t);
        return taken || reader_leave_out(reader, "t", 1);
    }
    if (take(t, "mtllib")) return read_name(t, &reader->mesh->libraries) >= 0 || fail_memory(reader->failure);
    static const char* const others[] = {"l", "p", "vp", "curv", "surf"};
    for (size_t i = 0; i < sizeof others / sizeof *others; ++i) {
        if (!take(t, others[i])) continue;
        skip_statement(t);
        return reader_leave_out(reader, others[i], strlen(others[i]));
    }
    skip_statement(t);
    return true;
}

/* The corners' values, where one has any. */
static bool add_table(Reader* reader, Table* table, LayerKind kind) {
    const MeshFile* mesh = reader->mesh;
    bool used = false;
    for (int64_t c = 0; c < table->corners && !used; ++c) used = table->index[c] >= 0 && table->index[c] < table->count;
    if (!used) return true;
    const int32_t components = kind == kLayerUv && table->components < 3 ? 2 : 3;
    Layer layer = layer_make(kind, DELMESH_DOMAIN_CORNER, kNoType, components);
    if (!layer_reserve(&layer, mesh->corner_count) || !layer_extend(&layer, mesh->corner_count)) {
        layer_free(&layer);
        return fail_memory(reader->failure);
    }
    for (int64_t c = 0; c < table->corners; ++c)
        for (int32_t k = 0; k < components && table->index[c] >= 0 && table->index[c] < table->count; ++k)
            layer_set(&layer, c, k, table->values[3 * (int64_t)table->index[c] + k]);
    return reader_add_layer(reader, &layer);
}

static bool add_layers(Reader* reader, Obj* obj) {
    bool ok = add_table(reader, &obj->uv, kLayerUv) && add_table(reader, &obj->normal, kLayerNormal);
    if (ok && obj->color.count > 0) ok = reader_add_layer(reader, &obj->color);
    for (int i = 0; ok && i < kIdLayers; ++i)
        if (obj->ids_used[i] && obj->ids[i].count > 0) ok = reader_add_layer(reader, &obj->ids[i]);
    return ok;
}

bool read_obj(Reader* reader) {
    Obj obj;
    memset(&obj, 0, sizeof obj);
    obj.color = layer_make(kLayerColor, DELMESH_DOMAIN_VERTEX, kNoType, 3);
    for (int i = 0; i < kIdLayers; ++i) obj.ids[i] = layer_make(kIdStatements[i].kind, DELMESH_DOMAIN_FACE, kNoType, 1);
    bool ok = true;
    while (ok && text_skip_space(&reader->text, '#')) ok = read_statement(reader, &obj);
    if (ok && reader->mesh->vertex_count == 0 && reader->mesh->face_count == 0)
        ok = reader_fail(reader, "the file ended without a vertex or a face");
    ok = ok && add_layers(reader, &obj);
    for (int i = 0; i < kIdLayers; ++i) layer_free(&obj.ids[i]);
    layer_free(&obj.color);
    free(obj.uv.values);
    free(obj.uv.index);
    free(obj.normal.values);
    free(obj.normal.index);
    return ok;
}
