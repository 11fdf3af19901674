/* SPDX-License-Identifier: Apache-2.0
 *
 * fuzz_readers.c: any bytes through each reader; the first byte chooses the name's ending and whether points are merged. Besides
 * what the sanitizers see: a mesh that is returned must be consistent, and a refusal must be one sentence that names a place.
 */
#include "mesh_file.h"

#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t* bytes, size_t size);

static void require(bool condition) {
    if (!condition) abort();
}

int LLVMFuzzerTestOneInput(const uint8_t* bytes, size_t size) {
    static const char* const names[] = {"a.obj", "a.off", "a.ply", "a.stl", "a"};
    if (size == 0) return 0;
    const char* name = names[bytes[0] % 5];
    char* text = malloc(size); /* exactly as large as allowed: one byte further is an error that is seen */
    memcpy(text, bytes + 1, size - 1);
    text[size - 1] = '\0';
    MeshFile mesh;
    Failure failure = {NULL, ""};
    if (mesh_file_parse(name, text, size - 1, bytes[0] & 128, &mesh, &failure)) {
        require(!failure.status);
        int64_t corners = 0;
        for (int64_t f = 0; mesh.face_sizes && f < mesh.face_count; ++f) {
            require(mesh.face_sizes[f] >= 0);
            corners += mesh.face_sizes[f];
        }
        require(mesh.corner_count == (mesh.face_sizes ? corners : 3 * mesh.face_count));
        for (int64_t c = 0; c < mesh.corner_count; ++c)
            require(mesh.corner_verts[c] >= 0 && mesh.corner_verts[c] < mesh.vertex_count);
        volatile char sum = 0; /* all positions are there */
        const size_t real = mesh.precision == DELMESH_FLOAT32 ? 4 : 8;
        for (size_t i = 0; i < 3 * real * (size_t)mesh.vertex_count; ++i) sum = (char)(sum + ((const char*)mesh.positions)[i]);
        const int64_t counts[] = {mesh.vertex_count, mesh.corner_count, mesh.face_count};
        for (int32_t i = 0; i < mesh.layers.count; ++i) {
            const Layer* layer = &mesh.layers.items[i];
            require(layer->count == counts[layer->domain]);
            const size_t bytes = (size_t)layer->count * layer_element_size(layer);
            for (size_t b = 0; b < bytes; ++b) sum = (char)(sum + ((const char*)layer->values)[b]);
            for (int64_t e = 0; e < layer->count && layer->ids.count > 0; ++e)
                require(layer_get(layer, e, 0) >= 0 && layer_get(layer, e, 0) < layer->ids.count);
        }
        mesh_file_free(&mesh);
    } else {
        require(failure.status != NULL && strchr(failure.text, '\n') == NULL);
        require(strncmp(failure.text, "line ", 5) == 0 || strncmp(failure.text, "byte ", 5) == 0 ||
                strcmp(failure.status, kStatusRead) != 0);
        require(mesh.positions == NULL && mesh.corner_verts == NULL && mesh.face_sizes == NULL && mesh.layers.items == NULL);
    }
    free(text);
    return 0;
}
