/* SPDX-License-Identifier: Apache-2.0
 * The smallest useful program: a saddle of long thin triangles goes in, a Delaunay mesh of the same vertices comes out. */
#include <delmesh/delmesh.h>

#include <stdio.h>
#include <stdlib.h>

enum { ROWS = 40, COLUMNS = 10, VERTS = (ROWS + 1) * (COLUMNS + 1), FACES = 2 * ROWS * COLUMNS };

static float positions[VERTS][3];
static int32_t corners[FACES][3];

static void make_saddle(void) {
    for (int r = 0; r <= ROWS; ++r)
        for (int c = 0; c <= COLUMNS; ++c) {
            const float x = 2.0f * (float)c / COLUMNS - 1.0f, y = 2.0f * (float)r / ROWS - 1.0f;
            float* p = positions[r * (COLUMNS + 1) + c];
            p[0] = x + 0.4f * y; /* the shear is what makes the triangles bad */
            p[1] = y;
            p[2] = x * x - y * y;
        }
    for (int r = 0; r < ROWS; ++r)
        for (int c = 0; c < COLUMNS; ++c) {
            const int32_t a = r * (COLUMNS + 1) + c, b = a + 1, d = a + COLUMNS + 1, e = d + 1;
            int32_t* pair = corners[2 * (r * COLUMNS + c)];
            pair[0] = a, pair[1] = b, pair[2] = e;
            pair[3] = a, pair[4] = e, pair[5] = d;
        }
}

static void stop(int32_t status, const delmesh_context* context) {
    fprintf(stderr, "%s: %s\n", delmesh_status_name(status), delmesh_last_error(context));
    exit(1);
}

int main(void) {
    delmesh_context* context = NULL;
    delmesh_mesh *in = NULL, *out = NULL;
    int32_t status = delmesh_context_create(NULL, &context);
    if (status != DELMESH_OK) stop(status, context);

    make_saddle();
    delmesh_mesh_desc desc;
    delmesh_mesh_desc_init(&desc, sizeof desc);
    desc.positions = (delmesh_view){positions, VERTS, 0, DELMESH_FLOAT32, 3};
    desc.corner_verts = (delmesh_view){corners, FACES, 0, DELMESH_INT32, 3};
    status = delmesh_mesh_create(context, &desc, &in);
    if (status != DELMESH_OK) stop(status, context);

    delmesh_remesh_options options;
    delmesh_remesh_report report;
    delmesh_remesh_options_init(&options, sizeof options);
    delmesh_remesh_report_init(&report, sizeof report);
    options.mode = DELMESH_MODE_FLIP;
    status = delmesh_remesh(context, in, &options, &out, &report);
    if (status != DELMESH_OK) stop(status, context);

    printf("before: %lld vertices, %lld faces, %lld edges not Delaunay\n", (long long)report.vertices_in,
           (long long)report.faces_in, (long long)report.nld_in);
    printf("after:  %lld vertices, %lld faces, %lld edges not Delaunay (%lld flips, %lld splits)\n",
           (long long)report.vertices_out, (long long)report.faces_out, (long long)report.nld_out,
           (long long)(report.flips + report.flips_after), (long long)report.splits);

    delmesh_mesh_destroy(out);
    delmesh_mesh_destroy(in);
    delmesh_context_destroy(context);
    return report.certified ? 0 : 1;
}
