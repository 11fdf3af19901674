/* SPDX-License-Identifier: Apache-2.0 */
#include "carry.h"

#include "cage.h"

#include <libgen.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

void carry_init(Carry* carry) {
    memset(carry, 0, sizeof *carry);
    carry->kept[kLayerUv] = carry->kept[kLayerMaterial] = true;
}

void carry_free(Carry* carry) {
    names_free(&carry->lost);
}

/* Sets what the list names; `given` has what lists named so far. */
static bool parse_kinds(Carry* carry, const char* option, const char* list, bool keep, bool given[kLayerKinds],
                        Failure* failure) {
    for (const char* at = list; at && *at;) {
        const size_t length = strcspn(at, ",");
        int kind = 0;
        while (kind < kLayerOther && !(strlen(layer_kind_name((LayerKind)kind)) == length &&
                                       strncmp(layer_kind_name((LayerKind)kind), at, length) == 0))
            ++kind;
        if (kind == kLayerOther)
            return fail_with(failure, kStatusUsage,
                             "%s takes uv, normal, color, material, group, object, smoothing, with commas between them, not '%s'",
                             option, list);
        if (given[kind] && carry->kept[kind] != keep)
            return fail_with(failure, kStatusUsage, "--keep and --release both name %s", layer_kind_name((LayerKind)kind));
        given[kind] = true;
        carry->kept[kind] = keep;
        at += length + (at[length] == ',');
    }
    return true;
}

bool carry_parse(Carry* carry, Failure* failure) {
    bool given[kLayerKinds] = {false};
    return parse_kinds(carry, "--keep", carry->keep, true, given, failure) &&
           parse_kinds(carry, "--release", carry->release, false, given, failure);
}

/* ---- Into the library */

static delmesh_view view_of(const Layer* layer) {
    return (delmesh_view){layer->values, layer->count, 0, layer->type, layer->components};
}

bool carry_spread(MeshFile* file, Failure* failure) {
    for (int32_t i = 0; i < file->layers.count; ++i) {
        Layer* layer = &file->layers.items[i];
        if (layer->domain != DELMESH_DOMAIN_VERTEX || layer->kind > kLayerColor) continue;
        Layer corners;
        if (!layer_to_corners(layer, file->corner_verts, file->corner_count, &corners)) {
            layer_free(&corners);
            return fail_memory(failure);
        }
        layer_free(layer);
        *layer = corners;
    }
    return true;
}

/* Of values, in decimation. */
static double weight_of(const Carry* carry, const Layer* layer) {
    return layer->kind == kLayerUv ? carry->uv_weight : layer->kind == kLayerNormal ? carry->normal_weight : 0;
}

static bool describe(const Carry* carry, const MeshFile* file, bool cage, CarryLayers* out, Failure* failure) {
    static const int32_t kinds[] = {DELMESH_LAYER_UV,       DELMESH_LAYER_NORMAL,   DELMESH_LAYER_COLOR,   DELMESH_LAYER_MATERIAL,
                                    DELMESH_LAYER_FACE_SET, DELMESH_LAYER_FACE_SET, DELMESH_LAYER_FACE_SET};
    memset(out, 0, sizeof *out);
    out->views = calloc((size_t)file->layers.count + 1, sizeof *out->views);
    out->from = calloc((size_t)file->layers.count + 1, sizeof *out->from);
    if (!out->views || !out->from) return fail_memory(failure);
    for (int32_t i = 0; i < file->layers.count && out->count < 64; ++i) {
        const Layer* layer = &file->layers.items[i];
        const double weight = weight_of(carry, layer);
        const bool kept = carry->kept[layer->kind];
        const bool needed = kept || weight != 0 || (cage && layer->domain == DELMESH_DOMAIN_CORNER);
        if (layer->kind == kLayerOther || !needed) continue;
        if (!layer_is_id(layer) && layer->domain == DELMESH_DOMAIN_FACE) continue;
        if (cage && layer->domain == DELMESH_DOMAIN_VERTEX) continue;
        if (layer->domain == DELMESH_DOMAIN_VERTEX) {
            /* It jumps nowhere; of UVs the library has to know where they are flat. */
            if (layer->kind != kLayerUv && weight == 0) continue;
            Layer corners;
            if (!layer_to_corners(layer, file->corner_verts, file->corner_count, &corners)) {
                layer_free(&corners);
                return fail_memory(failure);
            }
            if (!layers_add(&out->spread, &corners)) return fail_memory(failure);
            layer = &out->spread.items[out->spread.count - 1];
        }
        delmesh_layer* view = &out->views[out->count];
        delmesh_layer_init(view, sizeof *view);
        view->kind = kinds[layer->kind];
        view->border = kept ? DELMESH_BORDER_KEEP : DELMESH_BORDER_FREE;
        view->weight = weight;
        view->values = view_of(layer);
        out->from[out->count++] = i;
    }
    return true;
}

bool carry_describe(const Carry* carry, const MeshFile* file, CarryLayers* out, Failure* failure) {
    return describe(carry, file, false, out, failure);
}
bool carry_describe_cage(const Carry* carry, const MeshFile* file, CarryLayers* out, Failure* failure) {
    return describe(carry, file, true, out, failure);
}

void carry_layers_free(CarryLayers* layers) {
    free(layers->views);
    free(layers->from);
    layers_free(&layers->spread);
    memset(layers, 0, sizeof *layers);
}

/* ---- Out of it */

static int32_t policy_of(const Layer* layer) {
    const bool real = layer->type == DELMESH_FLOAT32 || layer->type == DELMESH_FLOAT64;
    if (layer->kind == kLayerNormal && real) return DELMESH_TRANSFER_DIRECTION;
    return real || layer->kind == kLayerColor ? DELMESH_TRANSFER_LINEAR : DELMESH_TRANSFER_NEAREST;
}

/* What is interpolated at vertices and corners can fit. */
static bool is_fitted(const Carry* carry, const Layer* layer) {
    return carry->fit && layer->domain != DELMESH_DOMAIN_FACE && policy_of(layer) != DELMESH_TRANSFER_NEAREST;
}

bool carry_needs_map(const Carry* carry, const MeshFile* source, const char* out_path) {
    const MeshFormat format = mesh_format_of_name(out_path, NULL);
    bool needed = false;
    for (int32_t i = 0; i < source->layers.count; ++i) {
        const Layer* layer = &source->layers.items[i];
        needed |= (layer->domain == DELMESH_DOMAIN_CORNER || is_fitted(carry, layer)) && !mesh_format_refuses(format, layer);
    }
    return needed && !carry->bare;
}

/* The folder of a path without links in it; NULL where there is none. */
static char* folder_of(const char* path) {
    char* copy = strdup(path);
    char* folder = copy ? realpath(dirname(copy), NULL) : NULL;
    free(copy);
    return folder;
}

/* "../" for each step from `from` up to where both meet, then the way down to `to`, ending with a slash unless it is empty. */
static char* way(const char* from, const char* to) {
    size_t same = 0;
    for (size_t i = 0;; ++i) {
        const bool end_a = from[i] == '\0' || from[i] == '/', end_b = to[i] == '\0' || to[i] == '/';
        if (end_a && end_b) same = i;
        if (from[i] != to[i] || from[i] == '\0') break;
    }
    size_t up = 0;
    for (const char* at = from + same; *at; ++at) up += *at == '/' && at[1] != '\0';
    const char* down = to + same + (to[same] == '/');
    char* out = malloc(3 * up + strlen(down) + 2);
    if (!out) return NULL;
    char* at = out;
    for (size_t i = 0; i < up; ++i, at += 3) memcpy(at, "../", 3);
    strcpy(at, down);
    if (*down) strcat(at, "/");
    return out;
}

static bool is_absolute(const char* name) {
    return name[0] == '/' || name[0] == '\\' || (name[0] != '\0' && name[1] == ':');
}

char* carry_library(const char* name, const char* in_path, const char* out_path) {
    char *in = folder_of(in_path), *out = folder_of(out_path), *prefix = in && out ? way(out, in) : NULL;
    const bool known = in && out;
    free(in);
    free(out);
    if (known && !prefix) return NULL;
    /* Several files stand on one line with blanks between; but a blank is part of a name where not all words end as files do. */
    bool several = true;
    size_t words = 0;
    for (const char* at = name; *at; ++words) {
        const size_t length = strcspn(at, " \t");
        several &= length > 4 && strncasecmp(at + length - 4, ".mtl", 4) == 0;
        at += length;
        at += strspn(at, " \t");
    }
    const size_t room = strlen(name) + (words + 1) * (prefix ? strlen(prefix) + 1 : 1) + 1;
    char* all = malloc(room);
    char* to = all;
    for (const char* at = name; all && *at;) {
        const size_t length = several ? strcspn(at, " \t") : strlen(at);
        if (prefix && !is_absolute(at)) to = stpcpy(to, prefix);
        memcpy(to, at, length);
        to += length;
        at += length;
        at += strspn(at, " \t");
        if (*at) *to++ = ' ';
    }
    if (all) *to = '\0';
    free(prefix);
    return all;
}

static bool carry_libraries(const MeshFile* source, const char* in_path, const char* out_path, MeshFile* out) {
    for (int32_t i = 0; i < source->libraries.count; ++i) {
        char* name = carry_library(names_at(&source->libraries, i), in_path, out_path);
        const bool ok = name && names_add(&out->libraries, name, strlen(name)) >= 0;
        free(name);
        if (!ok) return false;
    }
    return true;
}

static bool copy_names(const Names* from, Names* to) {
    for (int32_t i = 0; i < from->count; ++i)
        if (names_add(to, names_at(from, i), strlen(names_at(from, i))) < 0) return false;
    return true;
}

int32_t carry_over(Carry* carry, delmesh_context* context, const delmesh_mesh* in, const delmesh_mesh* mesh,
                   const delmesh_mesh_info* info, const MeshFile* source, const Cage* cage, const char* in_path,
                   const char* out_path, MeshFile* out, Failure* failure) {
    if (carry->bare) return DELMESH_OK;
    const MeshFormat format = mesh_format_of_name(out_path, NULL);
    const int64_t counts[] = {info->vertices, info->corners, info->faces};
    out->format = source->format;
    bool ok = carry_libraries(source, in_path, out_path, out);
    for (int32_t i = 0; ok && i < source->layers.count; ++i) {
        const Layer* from = &source->layers.items[i];
        const char* reason = mesh_format_refuses(format, from);
        if (reason) {
            ok = mesh_file_lose(&carry->lost, failure, "%s: %s", layer_name(from), reason);
            continue;
        }
        Layer to = layer_make(from->kind, from->domain, from->stored, from->components);
        if (from->names) to.names = strdup(from->names);
        ok = (!from->names || to.names) && copy_names(&from->ids, &to.ids) && layer_reserve(&to, counts[from->domain] + 1);
        to.count = ok ? counts[from->domain] : 0;
        bool carried = true;
        int32_t status = DELMESH_OK;
        if (ok && cage) {
            status = cage_carry_layer(cage, context, mesh, i, from, &to, &carried, failure);
        } else if (ok) {
            const delmesh_view values = view_of(from);
            const delmesh_view_mut target = {to.values, to.count, 0, to.type, to.components};
            const int32_t policy = policy_of(from);
            status = is_fitted(carry, from) ? delmesh_transfer_fitted(context, in, mesh, from->domain, policy, &values, &target)
                                            : delmesh_transfer(context, mesh, from->domain, policy, &values, &target);
        }
        if (status != DELMESH_OK || failure->status) {
            layer_free(&to);
            return status;
        }
        if (ok && carried) {
            ok = layers_add(&out->layers, &to);
            continue;
        }
        layer_free(&to);
        if (ok) ok = mesh_file_lose(&carry->lost, failure, "%s: there is no limit of it", layer_name(from));
    }
    if (ok && cage && cage->normals) {
        const int32_t status = cage_add_normals(cage, context, mesh, out, failure);
        if (status != DELMESH_OK || failure->status) return status;
    }
    for (int32_t i = 0; ok && i < source->left_out.count; ++i)
        ok = mesh_file_lose(&carry->lost, failure, "%s: it is not read", names_at(&source->left_out, i));
    if (!ok) fail_memory(failure);
    if (ok) mesh_file_fit(out_path, out, &carry->lost, failure);
    return DELMESH_OK;
}
