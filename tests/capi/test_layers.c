/* SPDX-License-Identifier: Apache-2.0
 * Layers of the input: which edges are borders, what is kept, and where the corners of a remesh lie on the source. */
#include "support.h"

#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>

HOST_FIXTURE(1)

#define COUNT(array) ((int64_t)(sizeof(array) / sizeof *(array)))

static delmesh_layer layer(int32_t kind, delmesh_view values) {
    delmesh_layer l;
    delmesh_layer_init(&l, sizeof l);
    l.kind = kind;
    l.values = values;
    return l;
}

/* A kite in the plane: 0 left, 1 right, 2 far below, 3 far above, cut along 0 1, which is not Delaunay unless the kite is thin.
 *
 *        3
 *      /   \
 *     0 --- 1
 *      \   /
 *        2
 */
static const float kWide[] = {-4, 0, 0, 4, 0, 0, 0, -1, 0, 0, 1, 0};
static const int32_t kKite[] = {0, 1, 3, 1, 0, 2};

static delmesh_mesh_desc kite(const delmesh_layer* layers, int32_t count) {
    delmesh_mesh_desc desc;
    delmesh_mesh_desc_init(&desc, sizeof desc);
    desc.positions = view(kWide, 4, DELMESH_FLOAT32, 3);
    desc.corner_verts = view(kKite, COUNT(kKite), DELMESH_INT32, 1);
    desc.layers = layers;
    desc.layer_count = count;
    return desc;
}

static delmesh_mesh* make(const delmesh_mesh_desc* desc) {
    delmesh_mesh* mesh = NULL;
    assert_status(delmesh_mesh_create(context, desc, &mesh), context, DELMESH_OK);
    return mesh;
}

/* The flags of the edge p q; -1: no edge. */
static int32_t flags_of(const delmesh_mesh* mesh, int32_t p, int32_t q) {
    const int64_t edges = info_of(mesh).edges;
    static int32_t verts[1024][2], flags[1024];
    assert_true(edges <= 1024);
    const delmesh_view_mut v = {verts, edges, 0, DELMESH_INT32, 2}, f = {flags, edges, 0, DELMESH_INT32, 1};
    assert_int_equal(delmesh_mesh_read(mesh, DELMESH_EDGE_VERT, &v), DELMESH_OK);
    assert_int_equal(delmesh_mesh_read(mesh, DELMESH_EDGE_FLAGS, &f), DELMESH_OK);
    for (int64_t e = 0; e < edges; ++e)
        if ((verts[e][0] == p && verts[e][1] == q) || (verts[e][0] == q && verts[e][1] == p)) return flags[e];
    return -1;
}

static int64_t borders(const delmesh_layer* l, int32_t* flags) {
    const delmesh_mesh_desc desc = kite(l, 1);
    delmesh_mesh* mesh = make(&desc);
    int64_t edges = -1;
    assert_int_equal(delmesh_mesh_layer_borders(mesh, 0, &edges), DELMESH_OK);
    *flags = flags_of(mesh, 0, 1);
    delmesh_mesh_destroy(mesh);
    return edges;
}

/* Corners 0 and 4 are at vertex 0, 1 and 3 at vertex 1. */
static void borders_are_where_values_jump(void** state) {
    (void)state;
    int32_t flags;
    float uv[6][2] = {{0, 0}, {1, 0}, {0, 1}, {1, 0}, {0, 0}, {0, 2}};
    delmesh_layer l = layer(DELMESH_LAYER_UV, view(uv, 6, DELMESH_FLOAT32, 2));
    assert_int_equal(borders(&l, &flags), 0);
    assert_int_equal(flags, 0);
    uv[4][1] = -0.0f; /* the same as 0 */
    assert_int_equal(borders(&l, &flags), 0);
    uv[4][1] = 0.25f;
    assert_int_equal(borders(&l, &flags), 1);
    assert_int_equal(flags, DELMESH_EDGE_UV);
    l.tolerance = 0.25;
    assert_int_equal(borders(&l, &flags), 0);
    l.tolerance = 0.2499;
    assert_int_equal(borders(&l, &flags), 1);
    l.tolerance = 0;
    uv[4][1] = NAN; /* is itself, and nothing else */
    assert_int_equal(borders(&l, &flags), 1);
    uv[0][1] = NAN;
    assert_int_equal(borders(&l, &flags), 0);

    /* Kinds, and what of them is kept. */
    uint8_t colours[6][4] = {{0}};
    colours[3][3] = 1;
    static const int32_t kinds[] = {DELMESH_LAYER_NORMAL, DELMESH_LAYER_COLOR, DELMESH_LAYER_OTHER};
    static const int32_t bits[] = {DELMESH_EDGE_NORMAL, DELMESH_EDGE_COLOR, DELMESH_EDGE_LAYER};
    for (int k = 0; k < 3; ++k) {
        delmesh_layer c = layer(kinds[k], view(colours, 6, DELMESH_UINT8, 4));
        assert_int_equal(borders(&c, &flags), 1);
        assert_int_equal(flags, k == 2 ? bits[k] : 0);
        c.border = DELMESH_BORDER_KEEP;
        assert_int_equal(borders(&c, &flags), 1);
        assert_int_equal(flags, bits[k]);
        c.border = DELMESH_BORDER_FREE;
        assert_int_equal(borders(&c, &flags), 1);
        assert_int_equal(flags, 0);
    }
    static const uint32_t ids[] = {7, 8}, same[] = {7, 7};
    delmesh_layer m = layer(DELMESH_LAYER_MATERIAL, view(ids, 2, DELMESH_UINT32, 1));
    assert_int_equal(borders(&m, &flags), 1);
    assert_int_equal(flags, DELMESH_EDGE_MATERIAL);
    m.values = view(same, 2, DELMESH_UINT32, 1);
    assert_int_equal(borders(&m, &flags), 0);
    m = layer(DELMESH_LAYER_FACE_SET, view(ids, 2, DELMESH_UINT32, 1));
    assert_int_equal(borders(&m, &flags), 1);
    assert_int_equal(flags, DELMESH_EDGE_FACE_SET);
}

/* A quad has one value at each of its corners, so the diagonal that cuts it is no border, whichever it is; its corners are the
 * quad's. The second quad is turned over at import. */
static void corners_of_polygons(void** state) {
    (void)state;
    static const float points[] = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, 2, 0, 0, 2, 1, 0, 3, 0, 0, 3, 1, 0};
    static const int32_t corners[] = {0, 1, 2, 3, 1, 2, 5, 4, 4, 6, 7, 5};
    static const uint8_t sizes[] = {4, 4, 4};
    double uv[12][2];
    for (int c = 0; c < 12; ++c) uv[c][0] = points[3 * corners[c]], uv[c][1] = points[3 * corners[c] + 1];
    uv[9][0] += 1; /* a corner inside: no border */
    const delmesh_layer l = layer(DELMESH_LAYER_UV, view(uv, 12, DELMESH_FLOAT64, 2));
    delmesh_mesh_desc desc = kite(&l, 1);
    desc.positions = view(points, 8, DELMESH_FLOAT32, 3);
    desc.corner_verts = view(corners, 12, DELMESH_INT32, 1);
    desc.face_sizes = view(sizes, 3, DELMESH_UINT8, 1);
    delmesh_mesh* mesh = make(&desc);
    const delmesh_mesh_info info = info_of(mesh);
    assert_int_equal(info.reoriented_faces, 2);
    int64_t edges = -1;
    assert_int_equal(delmesh_mesh_layer_borders(mesh, 0, &edges), DELMESH_OK);
    assert_int_equal(edges, 0);
    int32_t verts[18], map[18][3];
    double weights[18][3];
    const delmesh_view_mut v = {verts, 18, 0, DELMESH_INT32, 1}, m = {map, 18, 0, DELMESH_INT32, 3},
                           w = {weights, 18, 0, DELMESH_FLOAT64, 3};
    assert_int_equal(delmesh_mesh_read(mesh, DELMESH_CORNER_VERT, &v), DELMESH_OK);
    assert_int_equal(delmesh_mesh_read(mesh, DELMESH_CORNER_MAP_CORNER, &m), DELMESH_OK);
    assert_int_equal(delmesh_mesh_read(mesh, DELMESH_CORNER_MAP_WEIGHT, &w), DELMESH_OK);
    for (int c = 0; c < 18; ++c) {
        assert_int_equal(corners[map[c][0]], verts[c]);
        assert_int_equal(map[c][0] / 4, c / 6);
        assert_true(weights[c][0] == 1 && weights[c][1] == 0 && weights[c][2] == 0);
    }
    assert_int_equal(delmesh_mesh_layer_borders(mesh, 1, &edges), DELMESH_ERROR_INVALID_ARGUMENT);
    assert_int_equal(delmesh_mesh_layer_borders(mesh, -1, &edges), DELMESH_ERROR_INVALID_ARGUMENT);
    assert_int_equal(delmesh_mesh_layer_borders(mesh, 0, NULL), DELMESH_ERROR_INVALID_ARGUMENT);
    delmesh_mesh_destroy(mesh);
}

static void marks_and_numbers_of_edges(void** state) {
    (void)state;
    /* One is no edge of a face, one comes twice, one is left out. */
    static const int32_t verts[] = {2, 3, 1, 0, 3, 0, 2, 1, 1, 0};
    static const uint8_t marks[] = {DELMESH_EDGE_SHARP, DELMESH_EDGE_SEAM, 0, DELMESH_EDGE_CREASE + DELMESH_EDGE_MARKED,
                                    DELMESH_EDGE_SHARP};
    delmesh_mesh_desc desc = kite(NULL, 0);
    desc.edge_verts = view(verts, 5, DELMESH_INT32, 2);
    desc.edge_marks = view(marks, 5, DELMESH_UINT8, 1);
    delmesh_mesh* mesh = make(&desc);
    assert_int_equal(flags_of(mesh, 0, 1), DELMESH_EDGE_SEAM + DELMESH_EDGE_SHARP);
    assert_int_equal(flags_of(mesh, 0, 3), DELMESH_EDGE_BOUNDARY);
    assert_int_equal(flags_of(mesh, 1, 2), DELMESH_EDGE_BOUNDARY + DELMESH_EDGE_CREASE + DELMESH_EDGE_MARKED);
    int32_t ends[5][2], source[5];
    const delmesh_view_mut e = {ends, 5, 0, DELMESH_INT32, 2}, s = {source, 5, 0, DELMESH_INT32, 1};
    assert_int_equal(delmesh_mesh_read(mesh, DELMESH_EDGE_VERT, &e), DELMESH_OK);
    assert_int_equal(delmesh_mesh_read(mesh, DELMESH_EDGE_SOURCE_EDGE, &s), DELMESH_OK);
    for (int i = 0; i < 5; ++i) {
        const int32_t sum = ends[i][0] * ends[i][0] + ends[i][1] * ends[i][1]; /* 1: 0 1; 9: 0 3; 5: 1 2; others: 4, 10 */
        assert_int_equal(source[i], sum == 1 ? 1 : sum == 9 ? 2 : sum == 5 ? 3 : -1);
    }
    /* As a mark of any kind, it holds in every mode; released, it does not. */
    for (int32_t mode = DELMESH_MODE_PRESERVE; mode <= DELMESH_MODE_FEATURE; ++mode)
        for (int released = 0; released < 3; ++released) {
            delmesh_remesh_options options;
            delmesh_remesh_options_init(&options, sizeof options);
            options.mode = mode;
            options.boundary = DELMESH_BOUNDARY_IGNORE;
            options.release = released == 0 ? 0 : released == 1 ? DELMESH_EDGE_SEAM : DELMESH_EDGE_SEAM + DELMESH_EDGE_SHARP;
            delmesh_mesh* out;
            assert_status(delmesh_remesh(context, mesh, &options, &out, NULL), context, DELMESH_OK);
            assert_true((info_of(out).vertices == 4) == (released == 2));
            delmesh_mesh_destroy(out);
        }
    delmesh_mesh_destroy(mesh);
}

static delmesh_mesh* remeshed(const delmesh_mesh* in, int32_t mode) {
    delmesh_remesh_options options;
    delmesh_remesh_options_init(&options, sizeof options);
    options.mode = mode;
    options.map = 1;
    options.boundary = DELMESH_BOUNDARY_IGNORE;
    delmesh_mesh* out;
    assert_status(delmesh_remesh(context, in, &options, &out, NULL), context, DELMESH_OK);
    return out;
}

/* The texture at the corners of a result. */
static int64_t textured(const delmesh_mesh* out, float (*uv)[2], int32_t* verts, double (*at)[2]) {
    const int64_t corners = info_of(out).corners;
    int32_t map[96][3];
    double weights[96][3];
    assert_true(corners <= 96);
    const delmesh_view_mut v = {verts, corners, 0, DELMESH_INT32, 1}, m = {map, corners, 0, DELMESH_INT32, 3},
                           w = {weights, corners, 0, DELMESH_FLOAT64, 3};
    assert_int_equal(delmesh_mesh_read(out, DELMESH_CORNER_VERT, &v), DELMESH_OK);
    assert_int_equal(delmesh_mesh_read(out, DELMESH_CORNER_MAP_CORNER, &m), DELMESH_OK);
    assert_int_equal(delmesh_mesh_read(out, DELMESH_CORNER_MAP_WEIGHT, &w), DELMESH_OK);
    for (int64_t c = 0; c < corners; ++c)
        for (int k = 0; k < 2; ++k)
            at[c][k] = weights[c][0] * (double)uv[map[c][0]][k] + weights[c][1] * (double)uv[map[c][1]][k] +
                       weights[c][2] * (double)uv[map[c][2]][k];
    return corners;
}

/* Coplanar, so a flip moves no point; but it moves the texture unless that is one affine map. */
static void textures_lie_still(void** state) {
    (void)state;
    float uv[6][2];
    for (int c = 0; c < 6; ++c)
        for (int k = 0; k < 2; ++k) uv[c][k] = kWide[3 * kKite[c] + k];
    const delmesh_layer l = layer(DELMESH_LAYER_UV, view(uv, 6, DELMESH_FLOAT32, 2));
    int32_t verts[96];
    double at[96][2];
    delmesh_mesh_desc desc = kite(&l, 1);
    delmesh_mesh* mesh = make(&desc);
    delmesh_mesh* out = remeshed(mesh, DELMESH_MODE_PRESERVE);
    assert_int_equal(info_of(out).vertices, 4); /* one affine map: flipped */
    assert_int_equal(flags_of(out, 0, 1), -1);
    for (int64_t c = textured(out, uv, verts, at); c-- > 0;)
        for (int k = 0; k < 2; ++k) assert_true(at[c][k] == (double)kWide[3 * verts[c] + k]);
    delmesh_mesh_destroy(out);
    delmesh_mesh_destroy(mesh);

    uv[5][1] -= 1; /* no longer: split where it was, and the texture on the edge stays */
    mesh = make(&desc);
    out = remeshed(mesh, DELMESH_MODE_PRESERVE);
    assert_true(info_of(out).vertices > 4);
    assert_int_equal(flags_of(mesh, 0, 1), 0); /* it is no border */
    for (int64_t c = textured(out, uv, verts, at); c-- > 0;)
        if (verts[c] >= 4) assert_true(at[c][1] == 0);
    delmesh_mesh_destroy(out);
    delmesh_mesh_destroy(mesh);
    /* A wide tolerance lets it go. */
    delmesh_layer wide = l;
    wide.affine_tolerance = 2;
    desc = kite(&wide, 1);
    mesh = make(&desc);
    out = remeshed(mesh, DELMESH_MODE_PRESERVE);
    assert_int_equal(info_of(out).vertices, 4);
    delmesh_mesh_destroy(out);
    delmesh_mesh_destroy(mesh);
}

/* Two charts that meet at the edge: what is added there has a place in each. */
static void sides_of_a_seam(void** state) {
    (void)state;
    float uv[6][2];
    for (int c = 0; c < 6; ++c) {
        uv[c][0] = kWide[3 * kKite[c]] + (c < 3 ? 0.0f : 100.0f);
        uv[c][1] = c < 3 ? 1.0f : 2.0f;
    }
    const delmesh_layer l = layer(DELMESH_LAYER_UV, view(uv, 6, DELMESH_FLOAT32, 2));
    const delmesh_mesh_desc desc = kite(&l, 1);
    delmesh_mesh* mesh = make(&desc);
    for (int32_t mode = DELMESH_MODE_PRESERVE; mode <= DELMESH_MODE_FEATURE; ++mode) {
        delmesh_mesh* out = remeshed(mesh, mode);
        const int64_t verts_out = info_of(out).vertices;
        assert_true(verts_out > 4 && verts_out <= 32);
        float points[32][3];
        const delmesh_view_mut p = {points, verts_out, 0, DELMESH_FLOAT32, 3};
        assert_int_equal(delmesh_mesh_read(out, DELMESH_POSITION, &p), DELMESH_OK);
        int32_t verts[96];
        double at[96][2];
        const int64_t corners = textured(out, uv, verts, at);
        for (int64_t c = 0; c < corners; ++c) {
            float y = 0;
            for (int k = 0; k < 3; ++k) y += points[verts[c / 3 * 3 + k]][1];
            assert_true(at[c][1] == (y > 0 ? 1 : 2));
            const double u = (double)points[verts[c]][0] + (y > 0 ? 0 : 100);
            assert_true(fabs(at[c][0] - u) <= 1e-5);
        }
        delmesh_mesh_destroy(out);
    }
    delmesh_mesh_destroy(mesh);
}

/* A cube of side 4 in 6 x 16 quads. Texture: in `charts`, six; else four sides as one strip around z with a seam at the edge where
 * it ends, and two lids. */
typedef struct {
    float points[98][3], uv[384][2];
    int32_t quads[384], sizes[96];
} Cube;

static void unwrap(int charts, int side, const double* x, double* uv) {
    const int a = side / 2, s = side % 2;
    if (charts || a == 2) {
        uv[0] = 20.0 * (1 + side) + x[(a + 1) % 3];
        uv[1] = x[(a + 2) % 3];
    } else { /* counter-clockwise from the edge x = 4, y = 0: sides x = 4, y = 4, x = 0, y = 0 */
        const double way = a == 0 ? (s ? x[1] : 12 - x[1]) : (s ? 8 - x[0] : 12 + x[0]);
        uv[0] = way;
        uv[1] = x[2];
    }
}

static void make_cube(int charts, Cube* cube) {
    int32_t number[5][5][5];
    memset(number, -1, sizeof number);
    int32_t verts = 0, quads = 0;
    for (int side = 0; side < 6; ++side)
        for (int q = 0; q < 16; ++q, ++quads) {
            cube->sizes[quads] = 4;
            for (int k = 0; k < 4; ++k) {
                const int a = side / 2, s = side % 2, turned = s ? k : 3 - k;
                int at[3];
                at[a] = 4 * s;
                at[(a + 1) % 3] = q % 4 + (turned == 1 || turned == 2);
                at[(a + 2) % 3] = q / 4 + (turned >= 2);
                int32_t* v = &number[at[0]][at[1]][at[2]];
                if (*v < 0) {
                    *v = verts++;
                    for (int i = 0; i < 3; ++i) cube->points[*v][i] = (float)at[i];
                }
                const double x[3] = {at[0], at[1], at[2]};
                double uv[2];
                unwrap(charts, side, x, uv);
                cube->quads[4 * quads + k] = *v;
                for (int i = 0; i < 2; ++i) cube->uv[4 * quads + k][i] = (float)uv[i];
            }
        }
    assert_int_equal(verts, 98);
}

enum { kMost = 512 };
static struct {
    double points[kMost][3], weights[3 * kMost][3];
    int32_t verts[kMost][3], map[3 * kMost][3], edge_source[3 * kMost], ends[3 * kMost][2];
} level;

/* The texture of a level is that of the place, on every side, whichever edges are left; a source vertex has its own corner. */
static void check_level_of_cube(const delmesh_mesh* mesh, const delmesh_mesh* in, int charts, const Cube* cube) {
    const delmesh_mesh_info info = info_of(mesh);
    assert_true(info.faces <= kMost && info.vertices <= kMost);
    const delmesh_view_mut views[] = {
        {level.points, info.vertices, 0, DELMESH_FLOAT64, 3}, {level.verts, info.corners, 0, DELMESH_INT32, 1},
        {level.map, info.corners, 0, DELMESH_INT32, 3},       {level.weights, info.corners, 0, DELMESH_FLOAT64, 3},
        {level.edge_source, info.edges, 0, DELMESH_INT32, 1}, {level.ends, info.edges, 0, DELMESH_INT32, 2}};
    const int32_t arrays[] = {DELMESH_POSITION,          DELMESH_CORNER_VERT,      DELMESH_CORNER_MAP_CORNER,
                              DELMESH_CORNER_MAP_WEIGHT, DELMESH_EDGE_SOURCE_EDGE, DELMESH_EDGE_VERT};
    for (int i = 0; i < 6; ++i) assert_int_equal(delmesh_mesh_read(mesh, arrays[i], &views[i]), DELMESH_OK);
    for (int64_t f = 0; f < info.faces; ++f) {
        int side = -1;
        for (int s = 0; s < 6; ++s) {
            int on = 0;
            for (int k = 0; k < 3; ++k) on += fabs(level.points[level.verts[f][k]][s / 2] - 4 * (s % 2)) < 1e-5;
            if (on == 3) side = s;
        }
        assert_true(side >= 0);
        for (int k = 0; k < 3; ++k) {
            const int64_t c = 3 * f + k;
            const double* x = level.points[level.verts[f][k]];
            double want[2], have[2] = {0, 0};
            unwrap(charts, side, x, want);
            for (int i = 0; i < 3; ++i)
                for (int j = 0; j < 2; ++j) have[j] += level.weights[c][i] * (double)cube->uv[level.map[c][i]][j];
            assert_true(fabs(have[0] - want[0]) < 1e-5 && fabs(have[1] - want[1]) < 1e-5);
            int whole = 1;
            for (int i = 0; i < 3; ++i) whole = whole && (x[i] == 0 || x[i] == 4);
            if (whole && charts) assert_true(level.weights[c][0] == 1 && have[0] == want[0] && have[1] == want[1]);
        }
    }
    /* Edges of the source: those of seams and features, on the same edge of the cube. */
    static int32_t source_ends[kMost][2];
    const int64_t edges = info_of(in).edges;
    const delmesh_view_mut ends = {source_ends, edges, 0, DELMESH_INT32, 2};
    assert_true(edges <= kMost);
    assert_int_equal(delmesh_mesh_read(in, DELMESH_EDGE_VERT, &ends), DELMESH_OK);
    for (int64_t e = 0; e < info.edges; ++e) {
        const int32_t source = level.edge_source[e], flags = flags_of(mesh, level.ends[e][0], level.ends[e][1]);
        const int line = (flags & (DELMESH_EDGE_UV | DELMESH_EDGE_FEATURE)) != 0;
        assert_true((source >= 0) == (line || (flags & DELMESH_EDGE_SOURCE) != 0)); /* the latter in the full level only */
        if (!line) continue;
        int shared = 0; /* planes of sides with both */
        for (int s = 0; s < 6; ++s) {
            int on = 0;
            for (int k = 0; k < 2; ++k) {
                on += fabs(level.points[level.ends[e][k]][s / 2] - 4 * (s % 2)) < 1e-5;
                on += cube->points[source_ends[source][k]][s / 2] == (float)(4 * (s % 2));
            }
            shared += on == 4;
        }
        assert_true(shared >= 2);
    }
}

static delmesh_mesh* cube_mesh(const Cube* cube, const delmesh_layer* l) {
    delmesh_mesh_desc desc;
    delmesh_mesh_desc_init(&desc, sizeof desc);
    desc.positions = view(cube->points, 98, DELMESH_FLOAT32, 3);
    desc.corner_verts = view(cube->quads, 384, DELMESH_INT32, 1);
    desc.face_sizes = view(cube->sizes, 96, DELMESH_INT32, 1);
    desc.layers = l;
    desc.layer_count = 1;
    return make(&desc);
}

static void levels_know_their_side(void** state) {
    (void)state;
    for (int charts = 0; charts < 2; ++charts) {
        static Cube cube;
        make_cube(charts, &cube);
        const delmesh_layer l = layer(DELMESH_LAYER_UV, view(cube.uv, 384, DELMESH_FLOAT32, 2));
        delmesh_mesh* mesh = cube_mesh(&cube, &l);
        for (int32_t mode = DELMESH_MODE_PRESERVE; mode <= DELMESH_MODE_FEATURE; ++mode)
            for (int32_t quality = 0; quality <= 6; quality += 6) {
                const delmesh_target targets[] = {{DELMESH_TARGET_FULL, 0, 0},
                                                  {DELMESH_TARGET_FACES, 0, 96},
                                                  {DELMESH_TARGET_FACES, 0, 30},
                                                  {DELMESH_TARGET_FACES, 0, 12}};
                delmesh_decimate_options options;
                delmesh_decimate_options_init(&options, sizeof options);
                options.prepare = mode;
                options.quality = quality;
                options.map = 1;
                delmesh_mesh* out[4];
                assert_status(delmesh_lod_family(context, mesh, targets, 4, &options, out, NULL, NULL), context, DELMESH_OK);
                for (int i = 0; i < 4; ++i) {
                    check_level_of_cube(out[i], mesh, charts, &cube);
                    if (i == 3 && charts) assert_int_equal(info_of(out[i]).faces, 12);
                    delmesh_mesh_destroy(out[i]);
                }
            }
        /* Borders hold a level up, until they are released. */
        for (int released = 0; released < 2 * charts; ++released) {
            const delmesh_target least = {DELMESH_TARGET_FACES, 0, 0};
            delmesh_decimate_options options;
            delmesh_decimate_options_init(&options, sizeof options);
            options.map = 1;
            options.release = released ? DELMESH_EDGE_UV : 0;
            delmesh_mesh* out;
            assert_status(delmesh_decimate(context, mesh, &least, &options, &out, NULL, NULL), context, DELMESH_OK);
            assert_true(released ? info_of(out).faces < 12 : info_of(out).faces == 12);
            delmesh_mesh_destroy(out);
        }
        delmesh_mesh_destroy(mesh);
    }
}

/* A bumpy cube, whose seams and islands of another material move and vanish: no triangle has corners on two sides. */
static void nothing_straddles(void** state) {
    (void)state;
    static Cube cube;
    int32_t material[96];
    make_cube(0, &cube);
    for (int v = 0; v < 98; ++v)
        for (int k = 0; k < 3; ++k) cube.points[v][k] += 0.04f * (float)((v * (7 + 4 * k)) % 11 - 5);
    for (int q = 0; q < 96; ++q) material[q] = q % 16 == 5 || q % 16 == 10;
    const delmesh_layer layers[] = {layer(DELMESH_LAYER_UV, view(cube.uv, 384, DELMESH_FLOAT32, 2)),
                                    layer(DELMESH_LAYER_MATERIAL, view(material, 96, DELMESH_INT32, 1))};
    delmesh_mesh_desc desc;
    delmesh_mesh_desc_init(&desc, sizeof desc);
    desc.positions = view(cube.points, 98, DELMESH_FLOAT32, 3);
    desc.corner_verts = view(cube.quads, 384, DELMESH_INT32, 1);
    desc.face_sizes = view(cube.sizes, 96, DELMESH_INT32, 1);
    desc.layers = layers;
    desc.layer_count = 2;
    delmesh_mesh* mesh = make(&desc);
    for (int32_t mode = DELMESH_MODE_PRESERVE; mode <= DELMESH_MODE_FEATURE; ++mode)
        for (int32_t quality = 0; quality <= 6; quality += 6) {
            enum { kLevels = 6 };
            const delmesh_target targets[kLevels] = {{DELMESH_TARGET_FULL, 0, 0},   {DELMESH_TARGET_FACES, 0, 150},
                                                     {DELMESH_TARGET_FACES, 0, 96}, {DELMESH_TARGET_FACES, 0, 60},
                                                     {DELMESH_TARGET_FACES, 0, 30}, {DELMESH_TARGET_FACES, 0, 0}};
            delmesh_decimate_options options;
            delmesh_decimate_options_init(&options, sizeof options);
            options.prepare = mode;
            options.quality = quality;
            options.map = 1;
            delmesh_mesh* out[kLevels];
            assert_status(delmesh_lod_family(context, mesh, targets, kLevels, &options, out, NULL, NULL), context, DELMESH_OK);
            for (int i = 0; i < kLevels; ++i) {
                const delmesh_mesh_info info = info_of(out[i]);
                static int32_t map[6 * kMost][3], polygon[2 * kMost];
                static double weights[6 * kMost][3];
                assert_true(info.faces <= 2 * kMost);
                const delmesh_view_mut views[] = {{map, info.corners, 0, DELMESH_INT32, 3},
                                                  {weights, info.corners, 0, DELMESH_FLOAT64, 3},
                                                  {polygon, info.faces, 0, DELMESH_INT32, 1}};
                const int32_t arrays[] = {DELMESH_CORNER_MAP_CORNER, DELMESH_CORNER_MAP_WEIGHT, DELMESH_FACE_SOURCE};
                for (int k = 0; k < 3; ++k) assert_int_equal(delmesh_mesh_read(out[i], arrays[k], &views[k]), DELMESH_OK);
                double area = 0, backwards = 0;
                for (int64_t f = 0; f < info.faces; ++f) {
                    double uv[3][2] = {{0, 0}, {0, 0}, {0, 0}};
                    for (int k = 0; k < 9; ++k) {
                        const int64_t c = 3 * f + k / 3;
                        const int32_t corner = map[c][k % 3];
                        assert_int_equal(material[corner / 4], material[polygon[f]]);
                        for (int j = 0; j < 2; ++j) uv[k / 3][j] += weights[c][k % 3] * (double)cube.uv[corner][j];
                    }
                    const double size =
                        0.5 * ((uv[1][0] - uv[0][0]) * (uv[2][1] - uv[0][1]) - (uv[2][0] - uv[0][0]) * (uv[1][1] - uv[0][1]));
                    area += size;
                    backwards -= fmin(size, 0);
                }
                /* The strip has 64, one lid 16, the other, which looks the other way, -16. */
                if (info.faces >= 60) assert_true(fabs(area - 64) < 4 && backwards < 17);
                delmesh_mesh_destroy(out[i]);
            }
        }
    delmesh_mesh_destroy(mesh);
}

/* A flat square of 8 x 8 cells whose texture has a bump of height 1 in the middle, over one ring of cells. */
enum { SIDE = 8, BUMP_VERTS = (SIDE + 1) * (SIDE + 1), BUMP_FACES = 2 * SIDE * SIDE };
static double u_of_bump(int v) {
    return v == BUMP_VERTS / 2 ? 1 : 0;
}
/* What u is in the middle of a square made of at most so many faces. */
static double u_in_the_middle(double weight, int64_t faces) {
    static float points[BUMP_VERTS][3], uv[3 * BUMP_FACES][2];
    static int32_t corners[3 * BUMP_FACES];
    for (int v = 0; v < BUMP_VERTS; ++v) points[v][0] = (float)(v % (SIDE + 1)), points[v][1] = (float)(v / (SIDE + 1));
    for (int q = 0; q < SIDE * SIDE; ++q) {
        const int a = q / SIDE * (SIDE + 1) + q % SIDE, d = a + SIDE + 1;
        const int32_t verts[6] = {a, a + 1, d + 1, a, d + 1, d};
        memcpy(corners + 6 * q, verts, sizeof verts);
    }
    for (int c = 0; c < 3 * BUMP_FACES; ++c) uv[c][0] = (float)u_of_bump(corners[c]), uv[c][1] = 0;
    delmesh_layer l = layer(DELMESH_LAYER_UV, view(uv, 3 * BUMP_FACES, DELMESH_FLOAT32, 2));
    l.weight = weight;
    delmesh_mesh_desc desc;
    delmesh_mesh_desc_init(&desc, sizeof desc);
    desc.positions = view(points, BUMP_VERTS, DELMESH_FLOAT32, 3);
    desc.corner_verts = view(corners, 3 * BUMP_FACES, DELMESH_INT32, 1);
    desc.layers = &l;
    desc.layer_count = 1;
    delmesh_mesh *mesh = make(&desc), *out;
    const delmesh_target target = {DELMESH_TARGET_FACES, 0, (double)faces};
    delmesh_decimate_options options;
    delmesh_decimate_options_init(&options, sizeof options);
    options.map = 1;
    assert_status(delmesh_decimate(context, mesh, &target, &options, &out, NULL, NULL), context, DELMESH_OK);
    const int64_t left = info_of(out).corners;
    assert_true(left <= 3 * faces);
    static float at[BUMP_VERTS][3], values[3 * BUMP_FACES][2];
    static int32_t verts[3 * BUMP_FACES];
    const delmesh_view_mut views[] = {{at, info_of(out).vertices, 0, DELMESH_FLOAT32, 3}, {verts, left, 0, DELMESH_INT32, 1}},
                           to = {values, left, 0, DELMESH_FLOAT32, 2};
    assert_int_equal(delmesh_mesh_read(out, DELMESH_POSITION, &views[0]), DELMESH_OK);
    assert_int_equal(delmesh_mesh_read(out, DELMESH_CORNER_VERT, &views[1]), DELMESH_OK);
    assert_status(delmesh_transfer(context, out, DELMESH_DOMAIN_CORNER, DELMESH_TRANSFER_LINEAR, &l.values, &to), context,
                  DELMESH_OK);
    double found = NAN;
    for (int64_t c = 0; c < left; c += 3) {
        double area[3], sum = 0, u = 0;
        bool inside = true;
        for (int k = 0; k < 3; ++k) {
            const float *a = at[verts[c + (k + 1) % 3]], *b = at[verts[c + (k + 2) % 3]];
            area[k] = (double)((a[0] - SIDE / 2) * (b[1] - SIDE / 2) - (a[1] - SIDE / 2) * (b[0] - SIDE / 2));
            inside = inside && area[k] >= 0;
            sum += area[k];
        }
        for (int k = 0; k < 3; ++k) u += area[k] / sum * (double)values[c + k][0];
        if (inside) found = u;
    }
    delmesh_mesh_destroy(out);
    delmesh_mesh_destroy(mesh);
    return found;
}

/* A flat place is nothing to the quadrics of distances. */
static void weights_hold_textures(void** state) {
    (void)state;
    assert_true(u_in_the_middle(0, 24) < 0.3);
    assert_true(u_in_the_middle(1, 24) > 0.7);
    assert_true(u_in_the_middle(0.01, 24) > 0.7); /* there is nothing else to pay for */
    /* With seams, which merge and end: each side has its own values. */
    for (int charts = 0; charts < 2; ++charts) {
        static Cube cube;
        make_cube(charts, &cube);
        delmesh_layer l = layer(DELMESH_LAYER_UV, view(cube.uv, 384, DELMESH_FLOAT32, 2));
        l.weight = 1;
        delmesh_mesh* mesh = cube_mesh(&cube, &l);
        for (int32_t mode = DELMESH_MODE_PRESERVE; mode <= DELMESH_MODE_FEATURE; ++mode) {
            const delmesh_target targets[] = {{DELMESH_TARGET_FACES, 0, 96}, {DELMESH_TARGET_FACES, 0, 12}};
            delmesh_decimate_options options;
            delmesh_decimate_options_init(&options, sizeof options);
            options.prepare = mode;
            options.map = 1;
            delmesh_mesh* out[2];
            assert_status(delmesh_lod_family(context, mesh, targets, 2, &options, out, NULL, NULL), context, DELMESH_OK);
            for (int i = 0; i < 2; ++i) {
                check_level_of_cube(out[i], mesh, charts, &cube);
                delmesh_mesh_destroy(out[i]);
            }
        }
        delmesh_mesh_destroy(mesh);
    }
}

static void expect(const delmesh_mesh_desc* desc, int32_t status, const char* sentence) {
    delmesh_mesh* mesh = (delmesh_mesh*)(uintptr_t)1;
    assert_int_equal(delmesh_mesh_create(context, desc, &mesh), status);
    assert_null(mesh);
    assert_string_equal(delmesh_last_error(context), sentence);
}

static void wrong_layers(void** state) {
    (void)state;
    float uv[7][2] = {{0}};
    static const int64_t ids[2] = {1, 2};
    delmesh_layer l[2] = {layer(DELMESH_LAYER_UV, view(uv, 6, DELMESH_FLOAT32, 2)),
                          layer(DELMESH_LAYER_UV, view(uv, 6, DELMESH_FLOAT32, 2))};
    const delmesh_layer right = l[1];
    const delmesh_mesh_desc desc = kite(l, 2);
    l[1].kind = 0;
    expect(&desc, DELMESH_ERROR_INVALID_ARGUMENT, "The option 'kind' was 0, outside 1 to 6.");
    l[1] = right;
    l[1].border = 3;
    expect(&desc, DELMESH_ERROR_INVALID_ARGUMENT, "The option 'border' was 3, outside 0 to 2.");
    l[1] = right;
    l[1].tolerance = -1;
    expect(&desc, DELMESH_ERROR_INVALID_ARGUMENT, "The option 'tolerance' was -1, outside 0 to inf.");
    l[1] = right;
    l[1].struct_size = 4;
    expect(&desc, DELMESH_ERROR_INVALID_ARGUMENT, "The struct_size of 'layers[1]' was 4: its _init function was not called.");
    l[1] = right;
    l[1].values.count = 7;
    expect(&desc, DELMESH_ERROR_INVALID_ARGUMENT, "The view 'layers[1].values' had 7 elements, and there were 6 corners.");
    l[1].values = view(uv, 3, DELMESH_FLOAT32, 4);
    expect(&desc, DELMESH_ERROR_INVALID_ARGUMENT, "The view 'layers[1].values' had 4 components; UV maps have 2 or 3.");
    l[1] = layer(DELMESH_LAYER_MATERIAL, view(ids, 2, DELMESH_INT64, 1));
    expect(&desc, DELMESH_ERROR_INVALID_ARGUMENT,
           "The view 'layers[1].values' had a type that is not taken here: type 5, components 1, count 2, stride 0.");
    delmesh_mesh_desc none = kite(NULL, 1);
    expect(&none, DELMESH_ERROR_INVALID_ARGUMENT, "The argument 'layers' was NULL, and 'layer_count' 1.");
    none = kite(NULL, 65);
    expect(&none, DELMESH_ERROR_INVALID_ARGUMENT, "The option 'layer_count' was 65, outside 0 to 64.");

    static const int32_t verts[] = {0, 1, 0, 4};
    static const uint8_t marks[] = {DELMESH_EDGE_BOUNDARY, 0};
    delmesh_mesh_desc edges = kite(NULL, 0);
    edges.edge_marks = view(marks, 2, DELMESH_UINT8, 1);
    expect(&edges, DELMESH_ERROR_INVALID_ARGUMENT, "The view 'edge_marks' had 2 elements, and 'edge_verts' 0 edges.");
    edges.edge_verts = view(verts, 2, DELMESH_INT32, 2);
    expect(&edges, DELMESH_ERROR_INDEX_OUT_OF_RANGE, "edge_verts: edge 1 had vertex 4; there were 4 vertices.");
    edges.edge_verts = view(verts, 1, DELMESH_INT32, 2);
    edges.edge_marks.count = 1;
    expect(&edges, DELMESH_ERROR_INVALID_ARGUMENT,
           "edge_marks: mark 0 was 1, which is no sum of DELMESH_EDGE_MARKED, _SHARP, _SEAM and _CREASE.");
    delmesh_remesh_options options;
    delmesh_remesh_options_init(&options, sizeof options);
    options.release = DELMESH_EDGE_FEATURE;
    const delmesh_mesh_desc plain = kite(NULL, 0);
    delmesh_mesh *mesh = make(&plain), *out;
    assert_int_equal(delmesh_remesh(context, mesh, &options, &out, NULL), DELMESH_ERROR_INVALID_ARGUMENT);
    assert_string_equal(delmesh_last_error(context),
                        "The option 'release' was 4, which has bits of edges that are not released.");
    delmesh_mesh_destroy(mesh);
}

/* Four squares of which two are gone at one place and along one side: what a repair leaves comes from polygons that are not the ones
 * around their vertices. */
static void merged_vertices_keep_their_materials(void** state) {
    (void)state;
    static const float points[9][3] = {{0, 0, 0},     {0, 0, 0},     {0, 0.25f, 0}, {0, 0, 0},        {0, 0, 0},
                                       {0, 0.25f, 0}, {0.25f, 0, 0}, {0.25f, 0, 0}, {0.25f, 0.25f, 0}};
    static const int32_t corners[] = {0, 3, 4, 1, 1, 4, 5, 2, 3, 6, 7, 4, 4, 7, 8, 5}, sizes[] = {4, 4, 4, 4};
    static const uint32_t materials[] = {0, 1, 0, 2};
    const delmesh_layer l = layer(DELMESH_LAYER_MATERIAL, view(materials, 4, DELMESH_UINT32, 1));
    delmesh_mesh_desc desc = kite(&l, 1);
    desc.positions = view(points, 9, DELMESH_FLOAT32, 3);
    desc.corner_verts = view(corners, 16, DELMESH_INT32, 1);
    desc.face_sizes = view(sizes, 4, DELMESH_INT32, 1);
    delmesh_mesh* const mesh = make(&desc);
    for (int32_t mode = DELMESH_MODE_PRESERVE; mode <= DELMESH_MODE_FEATURE; ++mode) {
        delmesh_remesh_options options;
        delmesh_remesh_options_init(&options, sizeof options);
        options.mode = mode;
        options.map = 1;
        delmesh_mesh* out = NULL;
        delmesh_remesh_report report;
        delmesh_remesh_report_init(&report, sizeof report);
        assert_status(delmesh_remesh(context, mesh, &options, &out, &report), context, DELMESH_OK);
        assert_true(report.collapsed_edges > 0);
        const int64_t faces = info_of(out).faces;
        int32_t source[16], map[48][3];
        double weight[48][3];
        assert_true(faces > 0 && faces <= 16);
        const delmesh_view_mut f = {source, faces, 0, DELMESH_INT32, 1}, m = {map, 3 * faces, 0, DELMESH_INT32, 3},
                               w = {weight, 3 * faces, 0, DELMESH_FLOAT64, 3};
        assert_int_equal(delmesh_mesh_read(out, DELMESH_FACE_SOURCE, &f), DELMESH_OK);
        assert_int_equal(delmesh_mesh_read(out, DELMESH_CORNER_MAP_CORNER, &m), DELMESH_OK);
        assert_int_equal(delmesh_mesh_read(out, DELMESH_CORNER_MAP_WEIGHT, &w), DELMESH_OK);
        for (int64_t c = 0; c < 3 * faces; ++c)
            for (int k = 0; k < 3; ++k)
                if (weight[c][k] > 0) assert_int_equal(materials[map[c][k] / 4], materials[source[c / 3]]);
        delmesh_mesh_destroy(out);
    }
    delmesh_mesh_destroy(mesh);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(borders_are_where_values_jump),
        cmocka_unit_test(corners_of_polygons),
        cmocka_unit_test(marks_and_numbers_of_edges),
        cmocka_unit_test(textures_lie_still),
        cmocka_unit_test(sides_of_a_seam),
        cmocka_unit_test(levels_know_their_side),
        cmocka_unit_test(nothing_straddles),
        cmocka_unit_test(weights_hold_textures),
        cmocka_unit_test(merged_vertices_keep_their_materials),
        cmocka_unit_test(wrong_layers),
    };
    return cmocka_run_group_tests_name("layers", tests, set_up, tear_down);
}
