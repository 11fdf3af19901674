/* SPDX-License-Identifier: Apache-2.0 */
#include "cage.h"

#include <stdlib.h>
#include <string.h>

const Choice kSchemeChoices[] = {{"catmull-clark", DELMESH_SCHEME_CATMULL_CLARK},
                                 {"loop", DELMESH_SCHEME_LOOP},
                                 {"bilinear", DELMESH_SCHEME_BILINEAR},
                                 {NULL, 0}};
const Choice kCageBoundaryChoices[] = {{"edge-and-corner", DELMESH_CAGE_BOUNDARY_EDGE_AND_CORNER},
                                       {"edge", DELMESH_CAGE_BOUNDARY_EDGE},
                                       {"none", DELMESH_CAGE_BOUNDARY_NONE},
                                       {NULL, 0}};
const Choice kFaceVaryingChoices[] = {{"boundaries", DELMESH_FACE_VARYING_BOUNDARIES},
                                      {"none", DELMESH_FACE_VARYING_NONE},
                                      {"corners", DELMESH_FACE_VARYING_CORNERS_ONLY},
                                      {"plus1", DELMESH_FACE_VARYING_CORNERS_PLUS1},
                                      {"plus2", DELMESH_FACE_VARYING_CORNERS_PLUS2},
                                      {"all", DELMESH_FACE_VARYING_ALL},
                                      {NULL, 0}};

void cage_options_init(CageOptions* options) {
    memset(options, 0, sizeof *options);
    options->fineness = -1;
    options->precision = DELMESH_FLOAT32;
}

void cage_free(Cage* cage) {
    delmesh_cage_destroy(cage->handle);
    free(cage->layer_of);
    memset(cage, 0, sizeof *cage);
}

static delmesh_view view_of(const void* data, int64_t count, int32_t type, int32_t components) {
    return (delmesh_view){data, count, 0, type, components};
}

static int32_t create(const CageOptions* options, const MeshFile* file, const CarryLayers* layers, delmesh_context* context,
                      delmesh_cage** out) {
    const Tags* tags = &file->tags;
    delmesh_cage_desc desc;
    delmesh_cage_desc_init(&desc, sizeof desc);
    desc.scheme = options->scheme;
    desc.boundary = options->boundary;
    desc.face_varying = options->face_varying;
    desc.positions = view_of(file->positions, file->vertex_count, file->precision, 3);
    desc.corner_verts = view_of(file->corner_verts, file->corner_count, DELMESH_INT32, 1);
    if (file->face_sizes) desc.face_sizes = view_of(file->face_sizes, file->face_count, DELMESH_INT32, 1);
    if (tags->creases.count > 0) {
        desc.crease_edges = view_of(tags->creases.verts, tags->creases.count, DELMESH_INT64, 2);
        desc.crease_sharpness = view_of(tags->creases.sharpness, tags->creases.count, DELMESH_FLOAT64, 1);
    }
    if (tags->corners.count > 0) {
        desc.sharp_verts = view_of(tags->corners.verts, tags->corners.count, DELMESH_INT64, 1);
        desc.vert_sharpness = view_of(tags->corners.sharpness, tags->corners.count, DELMESH_FLOAT64, 1);
    }
    if (tags->holes.count > 0) desc.holes = view_of(tags->holes.verts, tags->holes.count, DELMESH_INT64, 1);
    desc.layers = layers->views;
    desc.layer_count = layers->count;
    return delmesh_cage_create(context, &desc, out);
}

int32_t cage_subdivide(const CageOptions* options, const Carry* carry, delmesh_context* context, MeshFile* file, Cage* out,
                       delmesh_mesh** mesh, Failure* failure) {
    memset(out, 0, sizeof *out);
    out->normals = options->normals;
    if (options->creases_path && !tags_read(options->creases_path, &file->tags, failure)) return DELMESH_OK;
    CarryLayers layers;
    int32_t status = DELMESH_OK;
    out->layer_of = malloc((size_t)file->layers.count * sizeof *out->layer_of + 1);
    const bool ok = carry_describe_cage(carry, file, &layers, failure) && (out->layer_of || fail_memory(failure));
    if (ok) {
        for (int32_t i = 0; i < file->layers.count; ++i) out->layer_of[i] = -1;
        for (int32_t i = 0; i < layers.count; ++i) out->layer_of[layers.from[i]] = i;
        status = create(options, file, &layers, context, &out->handle);
    }
    if (ok && status == DELMESH_OK) {
        delmesh_subdivide_options subdivide;
        delmesh_subdivide_options_init(&subdivide, sizeof subdivide);
        delmesh_subdivide_report_init(&out->report, sizeof out->report);
        subdivide.fineness = options->fineness;
        subdivide.value = options->value;
        subdivide.evaluation = options->evaluation;
        subdivide.precision = options->precision;
        subdivide.measure = options->measure;
        status = delmesh_subdivide(context, out->handle, &subdivide, mesh, &out->report);
    }
    carry_layers_free(&layers);
    return status;
}

/* ---- Layers */

static int64_t elements_of(const delmesh_mesh* mesh, int32_t domain) {
    delmesh_mesh_info info;
    delmesh_mesh_info_init(&info, sizeof info);
    delmesh_mesh_get_info(mesh, &info);
    return domain == DELMESH_DOMAIN_VERTEX ? info.vertices : domain == DELMESH_DOMAIN_CORNER ? info.corners : info.faces;
}

static int32_t carry_faces(const delmesh_mesh* mesh, const Layer* from, Layer* to, Failure* failure) {
    int32_t* face = malloc((size_t)to->count * sizeof *face + 1);
    if (!face) {
        fail_memory(failure);
        return DELMESH_OK;
    }
    const delmesh_view_mut target = {face, to->count, 0, DELMESH_INT32, 1};
    const int32_t status = delmesh_mesh_read(mesh, DELMESH_FACE_CAGE_FACE, &target);
    const size_t size = layer_element_size(from);
    for (int64_t f = 0; f < to->count && status == DELMESH_OK; ++f)
        memcpy((char*)to->values + (size_t)f * size, (const char*)from->values + (size_t)face[f] * size, size);
    free(face);
    return status;
}

/* The limit of anything, by way of doubles. */
static int32_t carry_verts(const Cage* cage, delmesh_context* context, const delmesh_mesh* mesh, const Layer* from, Layer* to,
                           Failure* failure) {
    const int32_t width = from->components;
    double* source = malloc((size_t)(from->count * width) * sizeof *source + 1);
    double* values = malloc((size_t)(to->count * width) * sizeof *values + 1);
    int32_t status = DELMESH_OK;
    if (source && values) {
        for (int64_t i = 0; i < from->count * width; ++i) source[i] = layer_get(from, i / width, (int32_t)(i % width));
        const delmesh_view in = view_of(source, from->count, DELMESH_FLOAT64, width);
        const delmesh_view_mut out = {values, to->count, 0, DELMESH_FLOAT64, width};
        status = delmesh_limit_values(context, cage->handle, mesh, DELMESH_DOMAIN_VERTEX, -1, &in, &out);
        for (int64_t i = 0; i < to->count * width && status == DELMESH_OK; ++i)
            layer_set(to, i / width, (int32_t)(i % width), values[i]);
    } else {
        fail_memory(failure);
    }
    free(source);
    free(values);
    return status;
}

int32_t cage_carry_layer(const Cage* cage, delmesh_context* context, const delmesh_mesh* mesh, int32_t index, const Layer* from,
                         Layer* to, bool* carried, Failure* failure) {
    *carried = true;
    if (!layer_reserve(to, elements_of(mesh, from->domain) + 1)) {
        fail_memory(failure);
        return DELMESH_OK;
    }
    to->count = elements_of(mesh, from->domain);
    if (from->domain == DELMESH_DOMAIN_FACE) return carry_faces(mesh, from, to, failure);
    const bool real = to->type == DELMESH_FLOAT32 || to->type == DELMESH_FLOAT64;
    const delmesh_view_mut target = {to->values, to->count, 0, to->type, to->components};
    if (from->domain == DELMESH_DOMAIN_CORNER && from->kind == kLayerNormal && from->components == 3 && real)
        return delmesh_limit_normals(context, cage->handle, mesh, NULL, &target); /* what the file has are those of flat faces */
    if (from->domain == DELMESH_DOMAIN_CORNER && cage->layer_of[index] >= 0 && real)
        return delmesh_limit_values(context, cage->handle, mesh, DELMESH_DOMAIN_CORNER, cage->layer_of[index], NULL, &target);
    *carried = from->domain == DELMESH_DOMAIN_VERTEX && (real || from->kind == kLayerColor) && from->kind != kLayerNormal;
    return *carried ? carry_verts(cage, context, mesh, from, to, failure) : DELMESH_OK;
}

int32_t cage_add_normals(const Cage* cage, delmesh_context* context, const delmesh_mesh* mesh, MeshFile* out, Failure* failure) {
    for (int32_t i = 0; i < out->layers.count; ++i)
        if (out->layers.items[i].kind == kLayerNormal) return DELMESH_OK; /* the file has some, and these stand in for them */
    Layer layer = layer_make(kLayerNormal, DELMESH_DOMAIN_CORNER, kNoType, 3);
    const int64_t corners = elements_of(mesh, DELMESH_DOMAIN_CORNER);
    if (!layer_reserve(&layer, corners + 1)) {
        fail_memory(failure);
        return DELMESH_OK;
    }
    layer.count = corners;
    const delmesh_view_mut target = {layer.values, corners, 0, layer.type, 3};
    const int32_t status = delmesh_limit_normals(context, cage->handle, mesh, NULL, &target);
    if (status != DELMESH_OK)
        layer_free(&layer);
    else if (!layers_add(&out->layers, &layer))
        fail_memory(failure);
    return status;
}
