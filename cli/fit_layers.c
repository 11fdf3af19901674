/* SPDX-License-Identifier: Apache-2.0
 *
 * fit_layers.c: what each format can hold. What a file had and its successor has not is told, never dropped in silence.
 */
#include "mesh_file.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

const char* mesh_format_refuses(MeshFormat format, const Layer* layer) {
    const bool shape = layer->kind == kLayerUv || layer->kind == kLayerNormal || layer->kind == kLayerColor;
    if (format == kFormatPly) return NULL;
    if (format == kFormatStl) return "STL files hold positions only";
    if (format == kFormatOff && !shape) return "OFF files have no place for it";
    if (format == kFormatObj && !shape && !layer_is_id(layer)) return "OBJ files have no place for it";
    if (layer->domain == DELMESH_DOMAIN_FACE && shape)
        return format == kFormatObj ? "OBJ files have no place for it at faces" : "OFF files are written without it at faces";
    return NULL;
}

/* Files of the format have it at vertices where the mesh has it at corners. */
static bool is_for_vertices(MeshFormat format, const Layer* layer) {
    if (layer->domain != DELMESH_DOMAIN_CORNER) return false;
    return format == kFormatOff || layer->kind == kLayerColor || (format == kFormatPly && layer->kind != kLayerUv);
}

/* Files of the format have one such layer, without a name of its own. */
static bool is_single(MeshFormat format, const Layer* layer) {
    return format != kFormatPly || layer->domain == DELMESH_DOMAIN_CORNER || !layer->names;
}

bool mesh_file_lose(Names* lost, Failure* failure, const char* format, ...) {
    char words[256];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(words, sizeof words, format, arguments);
    va_end(arguments);
    for (char* at = words; *at; ++at)
        if ((unsigned char)*at < 32 || *at == 127) *at = '?'; /* names come from files, the words go to a terminal */
    return names_add(lost, words, strlen(words)) >= 0 || fail_memory(failure);
}

/* All but the first components go. *was_zero: they said nothing. */
static bool shrink(Layer* layer, int32_t components, bool* were_zero) {
    Layer small = layer_make(layer->kind, layer->domain, layer->stored, components);
    small.names = layer->names;
    layer->names = NULL;
    *were_zero = true;
    bool ok = layer_reserve(&small, layer->count + 1);
    small.count = layer->count;
    for (int64_t i = 0; ok && i < layer->count; ++i) {
        for (int32_t k = 0; k < components; ++k) layer_set(&small, i, k, layer_get(layer, i, k));
        for (int32_t k = components; k < layer->components && !layer_is_missing(layer, i); ++k)
            *were_zero &= layer_get(layer, i, k) == 0;
    }
    layer_free(layer);
    *layer = small;
    return ok;
}

/* *keep: it stays. */
static bool fit_layer(MeshFormat format, MeshFile* mesh, int32_t index, bool* keep, Names* lost, Failure* failure) {
    Layer* layer = &mesh->layers.items[index];
    const char* name = mesh_format_name(format);
    const char* reason = mesh_format_refuses(format, layer);
    *keep = false;
    if (reason) return mesh_file_lose(lost, failure, "%s: %s", layer_name(layer), reason);
    if (is_for_vertices(format, layer)) {
        Layer moved;
        bool same;
        if (!layer_to_vertices(layer, mesh->corner_verts, mesh->vertex_count, &moved, &same)) {
            layer_free(&moved);
            return fail_memory(failure);
        }
        if (!same) {
            layer_free(&moved);
            return mesh_file_lose(lost, failure, "%s: %s files hold one at each vertex, and its faces' differ", layer_name(layer),
                                  name);
        }
        layer_free(layer);
        *layer = moved;
    }
    for (int32_t i = 0; is_single(format, layer) && i < mesh->layers.count; ++i) {
        const Layer* other = &mesh->layers.items[i];
        if (i == index || other->kind != layer->kind || !is_single(format, other)) continue;
        if (format == kFormatPly && other->domain != layer->domain) continue;
        /* The first stays; but what corners have says more than what vertices have. */
        if (i < index || (other->domain == DELMESH_DOMAIN_CORNER && layer->domain == DELMESH_DOMAIN_VERTEX))
            return mesh_file_lose(lost, failure, "%s: %s files hold one, and there is another", layer_name(layer), name);
    }
    *keep = true;
    const int32_t most = layer->kind == kLayerUv ? (format == kFormatObj ? 3 : 2) : format == kFormatObj ? 3 : kMostComponents;
    if (layer->components > most) {
        bool were_zero;
        if (!shrink(layer, most, &were_zero)) return fail_memory(failure);
        const char* what = layer->kind == kLayerColor ? "alpha" : "third coordinate";
        if (!were_zero) return mesh_file_lose(lost, failure, "%s: %s files hold no %s", layer_name(layer), name, what);
    }
    if (format == kFormatPly && layer->ids.count > 1)
        return mesh_file_lose(lost, failure, "%s: PLY files hold its numbers, not its names", layer_name(layer));
    return true;
}

bool mesh_file_fit(const char* path, MeshFile* mesh, Names* lost, Failure* failure) {
    const MeshFormat format = mesh_format_of_name(path, NULL);
    for (int32_t i = 0; i < mesh->layers.count;) {
        bool keep;
        if (!fit_layer(format, mesh, i, &keep, lost, failure)) return false;
        if (keep)
            ++i;
        else
            layers_remove(&mesh->layers, i);
    }
    if (mesh->libraries.count == 0 || mesh->format == format) return true;
    for (int32_t i = 0; i < mesh->libraries.count; ++i)
        if (!mesh_file_lose(lost, failure, "%s: %s files do not refer to such a file", names_at(&mesh->libraries, i),
                            mesh_format_name(format)))
            return false;
    names_free(&mesh->libraries);
    return true;
}
