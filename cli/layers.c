/* SPDX-License-Identifier: Apache-2.0 */
#include "layers.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

const char* layer_kind_name(LayerKind kind) {
    static const char* const names[kLayerKinds] = {"uv", "normal", "color", "material", "group", "object", "smoothing", "other"};
    return names[kind];
}

const char* layer_name(const Layer* layer) {
    return layer->kind == kLayerOther && layer->names ? layer->names : layer_kind_name(layer->kind);
}

Layer layer_make(LayerKind kind, int32_t domain, StoredType stored, int32_t components) {
    static const int32_t types[] = {DELMESH_INT32,  DELMESH_UINT8,   DELMESH_INT32,   DELMESH_INT32,  DELMESH_INT32,
                                    DELMESH_UINT32, DELMESH_FLOAT32, DELMESH_FLOAT64, DELMESH_FLOAT64};
    Layer layer;
    memset(&layer, 0, sizeof layer);
    layer.kind = kind;
    layer.domain = domain;
    layer.stored = stored;
    layer.type = stored == kNoType && layer_is_id(&layer) ? DELMESH_INT32 : types[stored];
    layer.components = components;
    layer.fill = kind == kLayerUv || kind == kLayerNormal ? (double)NAN : kind == kLayerColor ? layer_color_scale(&layer) : 0;
    return layer;
}

static size_t type_size(int32_t type) {
    return type == DELMESH_UINT8 ? 1 : type == DELMESH_FLOAT64 ? 8 : 4;
}

size_t layer_element_size(const Layer* layer) {
    return type_size(layer->type) * (size_t)layer->components;
}

bool layer_reserve(Layer* layer, int64_t count) {
    if (count <= layer->capacity) return true;
    void* grown = realloc(layer->values, (size_t)count * layer_element_size(layer));
    if (!grown) return false;
    layer->values = grown;
    layer->capacity = count;
    return true;
}

bool layer_extend(Layer* layer, int64_t count) {
    if (count <= layer->count) return true;
    if (count > layer->capacity && !layer_reserve(layer, count + count / 2 + 256)) return false;
    int64_t i = layer->count;
    layer->count = count;
    for (; i < count; ++i)
        for (int32_t k = 0; k < layer->components; ++k) layer_set(layer, i, k, layer->fill);
    return true;
}

void layer_set(Layer* layer, int64_t index, int32_t component, double value) {
    static const double lows[] = {-128, 0, -32768, 0, -2147483648.0, 0};
    static const double highs[] = {127, 255, 32767, 65535, 2147483647.0, 4294967295.0};
    const int64_t at = index * layer->components + component;
    if (layer->type == DELMESH_FLOAT64) {
        ((double*)layer->values)[at] = value;
        return;
    }
    if (layer->type == DELMESH_FLOAT32) {
        ((float*)layer->values)[at] = (float)value;
        return;
    }
    const StoredType stored = layer->stored == kNoType ? kInt32 : layer->stored;
    const double whole = isnan(value) ? 0 : fmin(fmax(rint(value), lows[stored]), highs[stored]);
    if (layer->type == DELMESH_UINT8)
        ((uint8_t*)layer->values)[at] = (uint8_t)whole;
    else if (layer->type == DELMESH_UINT32)
        ((uint32_t*)layer->values)[at] = (uint32_t)whole;
    else
        ((int32_t*)layer->values)[at] = (int32_t)whole;
}

double layer_get(const Layer* layer, int64_t index, int32_t component) {
    const int64_t at = index * layer->components + component;
    switch (layer->type) {
    case DELMESH_FLOAT64:
        return ((const double*)layer->values)[at];
    case DELMESH_FLOAT32:
        return (double)((const float*)layer->values)[at];
    case DELMESH_UINT8:
        return ((const uint8_t*)layer->values)[at];
    case DELMESH_UINT32:
        return ((const uint32_t*)layer->values)[at];
    default:
        return ((const int32_t*)layer->values)[at];
    }
}

bool layer_is_missing(const Layer* layer, int64_t index) {
    for (int32_t k = 0; k < layer->components; ++k)
        if (isnan(layer_get(layer, index, k))) return true;
    return false;
}

double layer_color_scale(const Layer* layer) {
    static const double scales[] = {127, 255, 32767, 65535, 2147483647.0, 4294967295.0, 1, 1, 1};
    return scales[layer->stored];
}

/* The same layer elsewhere, without values. */
static bool copy_shape(const Layer* layer, int32_t domain, int64_t count, Layer* out) {
    *out = layer_make(layer->kind, domain, layer->stored, layer->components);
    if (layer->names && layer->kind == kLayerOther) {
        out->names = strdup(layer->names);
        if (!out->names) return false;
    }
    out->count = count;
    return layer_reserve(out, count + 1);
}

static const char* element(const Layer* layer, int64_t index) {
    return (const char*)layer->values + (size_t)index * layer_element_size(layer);
}

bool layer_to_corners(const Layer* layer, const int32_t* corner_verts, int64_t corners, Layer* out) {
    if (!copy_shape(layer, DELMESH_DOMAIN_CORNER, corners, out)) return false;
    const size_t size = layer_element_size(layer);
    for (int64_t c = 0; c < corners; ++c) memcpy((char*)out->values + (size_t)c * size, element(layer, corner_verts[c]), size);
    return true;
}

bool layer_to_vertices(const Layer* layer, const int32_t* corner_verts, int64_t vertices, Layer* out, bool* same) {
    *same = true;
    if (!copy_shape(layer, DELMESH_DOMAIN_VERTEX, 0, out) || !layer_reserve(out, vertices + 1)) return false;
    char* seen = calloc((size_t)vertices + 1, 1);
    if (!seen || !layer_extend(out, vertices)) {
        free(seen);
        return false;
    }
    const size_t size = layer_element_size(layer);
    for (int64_t c = 0; c < layer->count && *same; ++c) {
        char* there = (char*)out->values + (size_t)corner_verts[c] * size;
        if (seen[corner_verts[c]])
            *same = memcmp(there, element(layer, c), size) == 0;
        else
            memcpy(there, element(layer, c), size);
        seen[corner_verts[c]] = 1;
    }
    free(seen);
    return true;
}

void layer_free(Layer* layer) {
    free(layer->names);
    free(layer->values);
    names_free(&layer->ids);
    memset(layer, 0, sizeof *layer);
}

bool layers_add(Layers* layers, Layer* layer) {
    if (layers->count == layers->capacity) {
        const int32_t wanted = 2 * layers->capacity + 8;
        Layer* grown = realloc(layers->items, (size_t)wanted * sizeof *grown);
        if (!grown) {
            layer_free(layer);
            return false;
        }
        layers->items = grown;
        layers->capacity = wanted;
    }
    layers->items[layers->count++] = *layer;
    memset(layer, 0, sizeof *layer);
    return true;
}

void layers_remove(Layers* layers, int32_t index) {
    layer_free(&layers->items[index]);
    memmove(&layers->items[index], &layers->items[index + 1], (size_t)(--layers->count - index) * sizeof *layers->items);
}

void layers_free(Layers* layers) {
    for (int32_t i = 0; i < layers->count; ++i) layer_free(&layers->items[i]);
    free(layers->items);
    memset(layers, 0, sizeof *layers);
}
