/* SPDX-License-Identifier: Apache-2.0
 *
 * layers.h: what a file says about its vertices, corners and faces besides positions: UVs, normals, colours, materials, groups and
 * whatever else has a name, each with the type that the file gives it.
 */
#ifndef DELMESH_CLI_LAYERS_H
#define DELMESH_CLI_LAYERS_H

#include "names.h"

#include <delmesh/delmesh.h>

typedef enum LayerKind {
    kLayerUv,
    kLayerNormal,
    kLayerColor,
    kLayerMaterial, /* this and the next three: ids of faces */
    kLayerGroup,
    kLayerObject,
    kLayerSmoothing,
    kLayerOther,
    kLayerKinds
} LayerKind;

/* The types of PLY files. */
typedef enum StoredType { kInt8, kUint8, kInt16, kUint16, kInt32, kUint32, kFloat32, kFloat64, kNoType } StoredType;

enum { kMostComponents = 4 };

typedef struct Layer {
    LayerKind kind;
    int32_t domain;    /* DELMESH_DOMAIN_VERTEX, _CORNER or _FACE */
    int32_t type;      /* of `values`: DELMESH_FLOAT32... */
    StoredType stored; /* in the file, kNoType: in text without types */
    int32_t components;
    double fill;             /* of elements without a value. UVs and normals: NaN, and they are written without, too */
    char* names;             /* of the components in a PLY file, a blank between; NULL: the usual ones of the kind */
    Names ids;               /* of ids: the name of each, 0 is "", which is none; empty: they are numbers alone */
    int64_t count, capacity; /* elements */
    void* values;
} Layer;

typedef struct Layers {
    Layer* items;
    int32_t count, capacity;
} Layers;

static inline bool layer_is_id(const Layer* layer) {
    return layer->kind >= kLayerMaterial && layer->kind <= kLayerSmoothing;
}
const char* layer_kind_name(LayerKind kind);
/* "uv", "material", ...; of other layers the name in the file. */
const char* layer_name(const Layer* layer);

/* A layer without values, of text files (stored: kNoType; floats are float64) or of PLY's types. */
Layer layer_make(LayerKind kind, int32_t domain, StoredType stored, int32_t components);
size_t layer_element_size(const Layer* layer);
/* Room for `count` elements. False: no memory, as below. */
bool layer_reserve(Layer* layer, int64_t count);
/* Elements from the last up to `count` get `fill`. */
bool layer_extend(Layer* layer, int64_t count);
/* Any number, rounded and kept in the range of what is stored. index < count. */
void layer_set(Layer* layer, int64_t index, int32_t component, double value);
double layer_get(const Layer* layer, int64_t index, int32_t component);
/* Whether a component is NaN: there is no such UV or normal. */
bool layer_is_missing(const Layer* layer, int64_t index);
/* What the largest value of a colour is: 1, or 255, 65535. */
double layer_color_scale(const Layer* layer);
/* The layer of vertices as one of corners. */
bool layer_to_corners(const Layer* layer, const int32_t* corner_verts, int64_t corners, Layer* out);
/* The layer of corners as one of vertices: *same tells whether all corners of each vertex agree, bit for bit. */
bool layer_to_vertices(const Layer* layer, const int32_t* corner_verts, int64_t vertices, Layer* out, bool* same);
void layer_free(Layer* layer);

/* Takes the layer over, also where it fails. */
bool layers_add(Layers* layers, Layer* layer);
void layers_remove(Layers* layers, int32_t index);
void layers_free(Layers* layers);

#endif
