/* SPDX-License-Identifier: Apache-2.0
 * Cages and their limit surfaces: exact limit points, counts, borders, places carried through remeshing and decimation, both
 * evaluations against each other, every refusal with its sentence. Without OpenSubdiv: that it says so. */
#include "support.h"

#include <math.h>
#include <stdio.h>

static Host host;
static delmesh_context* context;

static int set_up(void** state) {
    (void)state;
    context = host_context(&host, 2);
    return 0;
}
static int tear_down(void** state) {
    (void)state;
    delmesh_context_destroy(context);
    assert_nothing_left(&host);
    return 0;
}

/* ---- Cages ---------------------------------------------------------------------------------------------------------------- */

enum { MOST_VERTS = 64, MOST_FACES = 64, MOST_CORNERS = 256 };
typedef struct {
    double points[MOST_VERTS][3];
    int32_t corners[MOST_CORNERS], sizes[MOST_FACES];
    int32_t verts, faces, corner_count;
} Polygons;

static int32_t add_point(Polygons* p, double x, double y, double z) {
    const double point[3] = {x, y, z};
    memcpy(p->points[p->verts], point, sizeof point);
    return p->verts++;
}
static void add_face(Polygons* p, int32_t size, const int32_t* verts) {
    memcpy(p->corners + p->corner_count, verts, (size_t)size * sizeof *verts);
    p->corner_count += size;
    p->sizes[p->faces++] = size;
}

static Polygons cube(void) {
    static const int32_t faces[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
    Polygons p = {0};
    for (int i = 0; i < 8; ++i) add_point(&p, i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1);
    for (int i = 0; i < 6; ++i) add_face(&p, 4, faces[i]);
    return p;
}
static Polygons square(void) {
    static const int32_t face[4] = {0, 1, 2, 3};
    Polygons p = {0};
    add_point(&p, 0, 0, 0), add_point(&p, 6, 0, 0), add_point(&p, 6, 6, 0), add_point(&p, 0, 6, 0);
    add_face(&p, 4, face);
    return p;
}
/* Two n-gons joined by quads. */
static Polygons prism(int32_t n) {
    Polygons p = {0};
    int32_t low[16] = {0}, high[16] = {0};
    for (int32_t i = 0; i < n; ++i) {
        const double angle = 6.283185307179586 * i / n;
        low[n - 1 - i] = add_point(&p, cos(angle), sin(angle), -0.5);
        high[i] = add_point(&p, cos(angle), sin(angle), 0.5 + 0.1 * i);
    }
    add_face(&p, n, low);
    add_face(&p, n, high);
    for (int32_t i = 0; i < n; ++i) {
        const int32_t quad[4] = {2 * i, 2 * ((i + 1) % n), 2 * ((i + 1) % n) + 1, 2 * i + 1};
        add_face(&p, 4, quad);
    }
    return p;
}
/* Quads around a ring with a triangle on each: irregular vertices, a boundary, three sizes. */
static Polygons crown(void) {
    Polygons p = prism(6);
    /* The lid goes away, and teeth stand on its edge. */
    memmove(p.corners + 6, p.corners + 12, (size_t)(p.corner_count - 12) * sizeof *p.corners);
    memmove(p.sizes + 1, p.sizes + 2, (size_t)(p.faces - 2) * sizeof *p.sizes);
    p.corner_count -= 6;
    p.faces -= 1;
    for (int32_t i = 0; i < 6; ++i) {
        const int32_t top = add_point(&p, 1.2 * cos(1.05 * i + 0.5), 1.2 * sin(1.05 * i + 0.5), 1.8);
        const int32_t tooth[3] = {2 * i + 1, 2 * ((i + 1) % 6) + 1, top};
        add_face(&p, 3, tooth);
    }
    return p;
}
static Polygons tetrahedron(void) {
    static const int32_t faces[4][3] = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};
    Polygons p = {0};
    add_point(&p, 0, 0, 0), add_point(&p, 1, 0, 0), add_point(&p, 0, 1, 0), add_point(&p, 0, 0, 1);
    for (int i = 0; i < 4; ++i) add_face(&p, 3, faces[i]);
    return p;
}

static delmesh_cage_desc desc_of(const Polygons* p) {
    delmesh_cage_desc desc;
    delmesh_cage_desc_init(&desc, sizeof desc);
    desc.positions = (delmesh_view){p->points, p->verts, 0, DELMESH_FLOAT64, 3};
    desc.corner_verts = (delmesh_view){p->corners, p->corner_count, 0, DELMESH_INT32, 1};
    desc.face_sizes = (delmesh_view){p->sizes, p->faces, 0, DELMESH_INT32, 1};
    return desc;
}
static delmesh_cage* make_cage(const delmesh_cage_desc* desc) {
    delmesh_cage* cage = NULL;
    assert_status(delmesh_cage_create(context, desc, &cage), context, DELMESH_OK);
    return cage;
}
static delmesh_cage* cage_of(const Polygons* p) {
    const delmesh_cage_desc desc = desc_of(p);
    return make_cage(&desc);
}

static int32_t try_subdivide(const delmesh_cage* cage, int32_t fineness, double value, int32_t evaluation, delmesh_mesh** out,
                             delmesh_subdivide_report* report) {
    delmesh_subdivide_options options;
    delmesh_subdivide_options_init(&options, sizeof options);
    options.fineness = fineness;
    options.value = value;
    options.evaluation = evaluation;
    options.precision = DELMESH_FLOAT64;
    return delmesh_subdivide(context, cage, &options, out, report);
}
static delmesh_mesh* at_rate(const delmesh_cage* cage, int32_t rate) {
    delmesh_mesh* mesh = NULL;
    assert_status(try_subdivide(cage, DELMESH_FINENESS_RATE, rate, DELMESH_EVALUATION_BFR, &mesh, NULL), context, DELMESH_OK);
    assert_status(delmesh_mesh_validate(context, mesh), context, DELMESH_OK);
    return mesh;
}
static delmesh_mesh* by_far(const delmesh_cage* cage, int32_t rate) {
    delmesh_mesh* mesh = NULL;
    assert_status(try_subdivide(cage, DELMESH_FINENESS_RATE, rate, DELMESH_EVALUATION_FAR, &mesh, NULL), context, DELMESH_OK);
    assert_status(delmesh_mesh_validate(context, mesh), context, DELMESH_OK);
    return mesh;
}

/* One of a mesh's arrays, to be freed: doubles or int32. */
static void* array_of(const delmesh_mesh* mesh, int32_t what, int64_t count, int32_t components, int32_t type) {
    void* array = malloc((size_t)count * (size_t)components * (type == DELMESH_INT32 ? 4 : 8) + 1);
    const delmesh_view_mut dst = {array, count, 0, type, components};
    assert_status(delmesh_mesh_read(mesh, what, &dst), NULL, DELMESH_OK);
    return array;
}
static double* positions_of(const delmesh_mesh* mesh) {
    return array_of(mesh, DELMESH_POSITION, info_of(mesh).vertices, 3, DELMESH_FLOAT64);
}
static int64_t edges_with(const delmesh_mesh* mesh, int32_t flag) {
    const int64_t edges = info_of(mesh).edges;
    int32_t* flags = array_of(mesh, DELMESH_EDGE_FLAGS, edges, 1, DELMESH_INT32);
    int64_t count = 0;
    for (int64_t e = 0; e < edges; ++e) count += (flags[e] & flag) != 0;
    free(flags);
    return count;
}
static double distance(const double* a, const double* b) {
    return sqrt((a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1]) + (a[2] - b[2]) * (a[2] - b[2]));
}
/* How near the mesh has a vertex. */
static double nearest(const delmesh_mesh* mesh, double x, double y, double z) {
    const double point[3] = {x, y, z};
    double* positions = positions_of(mesh);
    double least = HUGE_VAL;
    for (int64_t v = 0; v < info_of(mesh).vertices; ++v) least = fmin(least, distance(positions + 3 * v, point));
    free(positions);
    return least;
}
/* The limit surface at the places of the mesh's vertices, by the other call. */
static double* limit_of(const delmesh_cage* cage, const delmesh_mesh* mesh, const Polygons* p) {
    const int64_t verts = info_of(mesh).vertices;
    double* values = malloc((size_t)verts * 24);
    const delmesh_view source = {p->points, p->verts, 0, DELMESH_FLOAT64, 3};
    const delmesh_view_mut target = {values, verts, 0, DELMESH_FLOAT64, 3};
    assert_status(delmesh_limit_values(context, cage, mesh, DELMESH_DOMAIN_VERTEX, -1, &source, &target), context, DELMESH_OK);
    return values;
}
static double largest_distance(const double* a, const double* b, int64_t count) {
    double most = 0;
    for (int64_t i = 0; i < count; ++i) most = fmax(most, distance(a + 3 * i, b + 3 * i));
    return most;
}

/* ---- Shapes --------------------------------------------------------------------------------------------------------------- */

static void limit_points_of_a_cube(void** state) {
    (void)state;
    const Polygons p = cube();
    delmesh_cage* cage = cage_of(&p);
    delmesh_subdivide_report report;
    delmesh_subdivide_report_init(&report, sizeof report);
    delmesh_mesh* mesh = NULL;
    assert_status(try_subdivide(cage, DELMESH_FINENESS_RATE, 7, DELMESH_EVALUATION_BFR, &mesh, &report), context, DELMESH_OK);
    assert_int_equal(report.rate, 7);
    assert_int_equal(report.faces, 6 * 2 * 49);
    assert_int_equal(report.vertices, 8 + 12 * 6 + 6 * 36);
    const delmesh_mesh_info info = info_of(mesh);
    assert_int_equal(info.boundary_edges, 0);
    assert_int_equal(info.euler_characteristic, 2);
    /* (9 v + 4 (1,1,1) + (-1,-1,-1)) / 24 at a corner of three faces */
    assert_true(nearest(mesh, 0.5, 0.5, 0.5) < 1e-9);
    assert_true(nearest(mesh, -0.5, 0.5, -0.5) < 1e-9);
    delmesh_mesh_destroy(mesh);
    /* (16 f + 4 * 4 e + v) / 36 in the middle of a face, whose points are (0,0,1), (0.75..., 0, 0.75...) and the corners */
    mesh = at_rate(cage, 2);
    delmesh_mesh* refined = by_far(cage, 2);
    assert_int_equal(info_of(mesh).vertices, 26);
    assert_int_equal(info_of(refined).vertices, 26);
    double* positions = positions_of(refined);
    for (int v = 0; v < 26; ++v) assert_true(nearest(mesh, positions[3 * v], positions[3 * v + 1], positions[3 * v + 2]) < 1e-8);
    free(positions);
    delmesh_mesh_destroy(mesh);
    delmesh_mesh_destroy(refined);
    delmesh_cage_destroy(cage);
}

static void sharp_for_ever(void** state) {
    (void)state;
    Polygons p = cube();
    int32_t creases[24][2];
    float sharpness[24];
    for (int i = 0; i < 24; ++i) {
        creases[i][0] = p.corners[i];
        creases[i][1] = p.corners[i % 4 == 3 ? i - 3 : i + 1];
        sharpness[i] = 10;
    }
    delmesh_cage_desc desc = desc_of(&p);
    desc.crease_edges = (delmesh_view){creases, 24, 0, DELMESH_INT32, 2};
    desc.crease_sharpness = (delmesh_view){sharpness, 24, 0, DELMESH_FLOAT32, 1};
    delmesh_cage* cage = make_cage(&desc);
    delmesh_mesh* mesh = at_rate(cage, 5);
    assert_int_equal(edges_with(mesh, DELMESH_EDGE_CREASE), 12 * 5);
    double* positions = positions_of(mesh);
    for (int64_t v = 0; v < info_of(mesh).vertices; ++v) { /* on the cube */
        double most = 0;
        for (int k = 0; k < 3; ++k) most = fmax(most, fabs(positions[3 * v + k]));
        assert_true(fabs(most - 1) < 1e-12);
    }
    free(positions);
    assert_true(nearest(mesh, 1, 1, 1) < 1e-12);
    assert_true(nearest(mesh, 1, 1, 0.2) < 1e-7);
    delmesh_mesh_destroy(mesh);
    delmesh_cage_destroy(cage);
    /* Corners alone: the rest stays round. */
    const int32_t verts[2] = {0, 7};
    const double vert_sharpness[2] = {11, 10};
    desc = desc_of(&p);
    desc.sharp_verts = (delmesh_view){verts, 2, 0, DELMESH_INT32, 1};
    desc.vert_sharpness = (delmesh_view){vert_sharpness, 2, 0, DELMESH_FLOAT64, 1};
    cage = make_cage(&desc);
    mesh = at_rate(cage, 4);
    assert_true(nearest(mesh, 1, 1, 1) < 1e-12 && nearest(mesh, -1, -1, -1) < 1e-12);
    assert_true(nearest(mesh, -1, 1, 1) > 0.1);
    delmesh_mesh_destroy(mesh);
    delmesh_cage_destroy(cage);
}

static void boundaries(void** state) {
    (void)state;
    const Polygons p = square();
    delmesh_cage_desc desc = desc_of(&p);
    delmesh_cage* cage = make_cage(&desc);
    delmesh_mesh* mesh = at_rate(cage, 6);
    assert_int_equal(info_of(mesh).boundary_edges, 24);
    assert_true(nearest(mesh, 6, 6, 0) < 1e-12); /* a corner stays */
    delmesh_mesh_destroy(mesh);
    delmesh_cage_destroy(cage);
    desc.boundary = DELMESH_CAGE_BOUNDARY_EDGE;
    cage = make_cage(&desc);
    mesh = at_rate(cage, 6);
    assert_true(nearest(mesh, 5, 5, 0) < 1e-12); /* (v- + 4 v + v+) / 6 of the boundary's spline */
    delmesh_mesh_destroy(mesh);
    delmesh_cage_destroy(cage);
    desc.boundary = DELMESH_CAGE_BOUNDARY_NONE;
    cage = make_cage(&desc);
    mesh = NULL;
    assert_status(try_subdivide(cage, DELMESH_FINENESS_RATE, 4, DELMESH_EVALUATION_BFR, &mesh, NULL), context,
                  DELMESH_ERROR_NO_SURFACE);
    assert_null(mesh);
    delmesh_cage_destroy(cage);
}

static void bilinear_and_loop(void** state) {
    (void)state;
    const Polygons p = cube();
    delmesh_cage_desc desc = desc_of(&p);
    desc.scheme = DELMESH_SCHEME_BILINEAR;
    delmesh_cage* cage = make_cage(&desc);
    delmesh_mesh* mesh = at_rate(cage, 4);
    assert_true(nearest(mesh, 1, 0.5, -0.5) < 1e-15 && nearest(mesh, 1, 1, 1) < 1e-15);
    delmesh_mesh_destroy(mesh);
    delmesh_cage_destroy(cage);

    const Polygons t = tetrahedron();
    desc = desc_of(&t);
    desc.scheme = DELMESH_SCHEME_LOOP;
    cage = make_cage(&desc);
    mesh = at_rate(cage, 8);
    delmesh_mesh* refined = by_far(cage, 8);
    for (const delmesh_mesh* m = mesh;; m = refined) {
        assert_int_equal(info_of(m).faces, 4 * 64);
        assert_int_equal(info_of(m).vertices, 2 + 2 * 64);
        assert_int_equal(info_of(m).boundary_edges, 0);
        if (m == refined) break;
    }
    double* far_points = positions_of(refined);
    double* bfr_points = limit_of(cage, refined, &t);
    assert_true(largest_distance(far_points, bfr_points, info_of(refined).vertices) < 1e-6);
    free(far_points);
    free(bfr_points);
    delmesh_mesh_destroy(mesh);
    delmesh_mesh_destroy(refined);
    delmesh_cage_destroy(cage);
    desc = desc_of(&p);
    desc.scheme = DELMESH_SCHEME_LOOP;
    assert_status(delmesh_cage_create(context, &desc, &cage), context, DELMESH_ERROR_INVALID_ARGUMENT);
    assert_string_equal(delmesh_last_error(context),
                        "face_sizes: face 0 had 4 corners, and the Loop scheme takes triangles only.");
}

static void holes(void** state) {
    (void)state;
    const Polygons p = cube();
    const uint32_t hole[2] = {1, 1};
    delmesh_cage_desc desc = desc_of(&p);
    desc.holes = (delmesh_view){hole, 2, 0, DELMESH_UINT32, 1};
    delmesh_cage* cage = make_cage(&desc);
    delmesh_subdivide_report report;
    delmesh_subdivide_report_init(&report, sizeof report);
    delmesh_mesh* mesh = NULL;
    for (int32_t evaluation = DELMESH_EVALUATION_BFR; evaluation <= DELMESH_EVALUATION_FAR; ++evaluation) {
        assert_status(try_subdivide(cage, DELMESH_FINENESS_RATE, 4, evaluation, &mesh, &report), context, DELMESH_OK);
        assert_int_equal(report.left_out_faces, 1);
        assert_int_equal(report.faces, 5 * 32);
        assert_int_equal(info_of(mesh).boundary_edges, 16);
        assert_true(nearest(mesh, 0.5, 0.5, 0.5) < 1e-9); /* it still shapes the rest */
        delmesh_mesh_destroy(mesh);
    }
    delmesh_cage_destroy(cage);
}

/* Uniform refinement makes the same mesh, on the same surface. */
static void assert_far_agrees(const delmesh_cage* cage, const Polygons* p) {
    for (int32_t rate = 2; rate <= 16; rate *= 2) {
        delmesh_mesh *mesh = at_rate(cage, rate), *refined = by_far(cage, rate);
        assert_int_equal(info_of(mesh).vertices, info_of(refined).vertices);
        assert_int_equal(info_of(mesh).faces, info_of(refined).faces);
        assert_int_equal(info_of(mesh).edges, info_of(refined).edges);
        assert_int_equal(info_of(mesh).boundary_edges, info_of(refined).boundary_edges);
        assert_int_equal(info_of(mesh).components, info_of(refined).components);
        double *positions = positions_of(refined), *limit = limit_of(cage, refined, p);
        assert_true(largest_distance(positions, limit, info_of(refined).vertices) < 1e-6);
        free(positions);
        free(limit);
        delmesh_mesh_destroy(mesh);
        delmesh_mesh_destroy(refined);
    }
}

/* Faces of any size, at even and odd rates: watertight where the cage is, and every vertex at the limit of its place. */
static void n_gons(void** state) {
    (void)state;
    for (int32_t n = 3; n <= 12; ++n) {
        const Polygons p = n == 12 ? crown() : prism(n);
        delmesh_cage* cage = cage_of(&p);
        for (int32_t rate = 1; rate <= 6; ++rate) {
            delmesh_mesh* mesh = at_rate(cage, rate);
            assert_int_equal(info_of(mesh).boundary_edges, n == 12 ? 12 * rate : 0);
            assert_int_equal(info_of(mesh).euler_characteristic, n == 12 ? 1 : 2);
            assert_int_equal(info_of(mesh).copied_vertices, 0);
            double *positions = positions_of(mesh), *limit = limit_of(cage, mesh, &p);
            assert_memory_equal(positions, limit, (size_t)info_of(mesh).vertices * 24);
            free(positions);
            free(limit);
            delmesh_mesh_destroy(mesh);
        }
        assert_far_agrees(cage, &p);
        delmesh_cage_destroy(cage);
    }
}

/* Four pages at one spine: cut along it, one copy per page. */
static void non_manifold_cages(void** state) {
    (void)state;
    Polygons p = {0};
    add_point(&p, 0, 0, 0), add_point(&p, 0, 0, 1);
    for (int i = 0; i < 3; ++i) {
        const int32_t a = add_point(&p, cos(2.1 * i), sin(2.1 * i), 0), b = add_point(&p, cos(2.1 * i), sin(2.1 * i), 1);
        const int32_t page[4] = {0, a, b, 1};
        add_face(&p, 4, page);
    }
    delmesh_cage* cage = cage_of(&p);
    delmesh_mesh* mesh = at_rate(cage, 4);
    assert_int_equal(info_of(mesh).nonmanifold_edges, 4);
    assert_int_equal(info_of(mesh).components, 3);
    assert_int_equal(edges_with(mesh, DELMESH_EDGE_CUT), 12);
    delmesh_mesh_destroy(mesh);
    assert_far_agrees(cage, &p);
    delmesh_cage_destroy(cage);
    /* A page the other way round is turned, and takes its places along. */
    Polygons q = square();
    const int32_t e = add_point(&q, 12, 0, 3), f = add_point(&q, 12, 6, 3);
    const int32_t turned[4] = {1, 2, f, e};
    add_face(&q, 4, turned);
    cage = cage_of(&q);
    mesh = at_rate(cage, 3);
    assert_int_equal(info_of(mesh).reoriented_faces, 18);
    assert_int_equal(info_of(mesh).components, 1);
    double *positions = positions_of(mesh), *limit = limit_of(cage, mesh, &q);
    assert_memory_equal(positions, limit, (size_t)info_of(mesh).vertices * 24);
    free(positions);
    free(limit);
    delmesh_mesh_destroy(mesh);
    delmesh_cage_destroy(cage);
}

/* ---- Rates ---------------------------------------------------------------------------------------------------------------- */

static void fineness(void** state) {
    (void)state;
    const Polygons p = cube();
    delmesh_cage_desc desc = desc_of(&p);
    desc.scheme = DELMESH_SCHEME_BILINEAR;
    delmesh_cage* cage = make_cage(&desc);
    static const struct {
        int32_t fineness;
        double value;
        int32_t rate;
    } cases[] = {{DELMESH_FINENESS_EDGE_LENGTH, 0.5, 4},   {DELMESH_FINENESS_EDGE_LENGTH, 0.49, 5},
                 {DELMESH_FINENESS_EDGE_LENGTH, 9, 1},     {DELMESH_FINENESS_FACES, 12 * 25, 5},
                 {DELMESH_FINENESS_FACES, 12 * 25 - 1, 4}, {DELMESH_FINENESS_FACES, 1, 1},
                 {DELMESH_FINENESS_FACES, 12 * 1e4, 100},  {DELMESH_FINENESS_RATE, 1, 1}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; ++i) {
        delmesh_subdivide_report report;
        delmesh_subdivide_report_init(&report, sizeof report);
        delmesh_mesh* mesh = NULL;
        assert_status(try_subdivide(cage, cases[i].fineness, cases[i].value, DELMESH_EVALUATION_BFR, &mesh, &report), context,
                      DELMESH_OK);
        assert_int_equal(report.rate, cases[i].rate);
        assert_int_equal(report.faces, 12 * cases[i].rate * cases[i].rate);
        assert_true(fabs(report.longest_edge - (cases[i].fineness == DELMESH_FINENESS_EDGE_LENGTH ? 2 : 0)) < 1e-12);
        delmesh_mesh_destroy(mesh);
    }
    delmesh_cage_destroy(cage);
}

/* The distance to the limit surface: of a bilinear cage of planes none; else its mean goes down by four where the rate doubles. */
static void distance_to_the_limit(void** state) {
    (void)state;
    Polygons p = cube();
    for (int32_t round = 0; round < 2; ++round) {
        delmesh_cage_desc desc = desc_of(&p);
        desc.scheme = round == 0 ? DELMESH_SCHEME_BILINEAR : DELMESH_SCHEME_CATMULL_CLARK;
        delmesh_cage* cage = make_cage(&desc);
        double before = 0;
        for (int32_t rate = 8; rate <= 32; rate *= 2) {
            delmesh_subdivide_options options;
            delmesh_subdivide_report report;
            delmesh_subdivide_options_init(&options, sizeof options);
            delmesh_subdivide_report_init(&report, sizeof report);
            options.value = rate;
            options.precision = DELMESH_FLOAT64;
            delmesh_mesh* mesh = NULL;
            assert_status(delmesh_subdivide(context, cage, &options, &mesh, &report), context, DELMESH_OK);
            assert_true(report.limit_distance < 0 && report.limit_rms < 0);
            delmesh_mesh_destroy(mesh);
            options.measure = 1;
            assert_status(delmesh_subdivide(context, cage, &options, &mesh, &report), context, DELMESH_OK);
            delmesh_mesh_destroy(mesh);
            if (round == 0) assert_true(report.limit_distance < 1e-7); /* places are float32 */
            if (round == 1 && before > 0) assert_true(before / report.limit_rms > 3.5 && before / report.limit_rms < 4.5);
            assert_true(report.limit_rms <= report.limit_distance && report.limit_rms >= 0);
            before = report.limit_rms;
        }
        delmesh_cage_destroy(cage);
    }
}

/* ---- Layers --------------------------------------------------------------------------------------------------------------- */

/* A square of 2 x 2 quads, a UV seam along its middle, and two materials on either side of the other middle. */
static void layers_and_borders(void** state) {
    (void)state;
    Polygons p = {0};
    float uvs[16][2];
    uint8_t materials[4];
    for (int y = 0; y < 3; ++y)
        for (int x = 0; x < 3; ++x) add_point(&p, x, y, 0.3 * (x == 1 && y == 1));
    for (int y = 0; y < 2; ++y)
        for (int x = 0; x < 2; ++x) {
            const int32_t v = 3 * y + x, quad[4] = {v, v + 1, v + 4, v + 3};
            for (int k = 0; k < 4; ++k) {
                uvs[p.corner_count + k][0] = (float)p.points[quad[k]][0] + (x == 1 ? 10 : 0);
                uvs[p.corner_count + k][1] = (float)p.points[quad[k]][1];
            }
            materials[p.faces] = (uint8_t)y;
            add_face(&p, 4, quad);
        }
    delmesh_layer layers[2];
    for (int i = 0; i < 2; ++i) delmesh_layer_init(&layers[i], sizeof layers[i]);
    layers[0].kind = DELMESH_LAYER_UV;
    layers[0].values = (delmesh_view){uvs, 16, 0, DELMESH_FLOAT32, 2};
    layers[1].kind = DELMESH_LAYER_MATERIAL;
    layers[1].values = (delmesh_view){materials, 4, 0, DELMESH_UINT8, 1};
    const int32_t edges[2][2] = {{0, 1}, {4, 3}};
    const uint8_t marks[2] = {DELMESH_EDGE_SHARP, DELMESH_EDGE_SEAM | DELMESH_EDGE_MARKED};
    delmesh_cage_desc desc = desc_of(&p);
    desc.layers = layers;
    desc.layer_count = 2;
    desc.edge_verts = (delmesh_view){edges, 2, 0, DELMESH_INT32, 2};
    desc.edge_marks = (delmesh_view){marks, 2, 0, DELMESH_UINT8, 1};
    delmesh_cage* cage = make_cage(&desc);
    for (int32_t rate = 4; rate <= 5; ++rate) {
        delmesh_mesh* mesh = at_rate(cage, rate);
        assert_int_equal(edges_with(mesh, DELMESH_EDGE_UV), 2 * rate);
        assert_int_equal(edges_with(mesh, DELMESH_EDGE_MATERIAL), 2 * rate);
        assert_int_equal(edges_with(mesh, DELMESH_EDGE_SHARP), rate);
        assert_int_equal(edges_with(mesh, DELMESH_EDGE_SEAM), rate);
        assert_int_equal(edges_with(mesh, DELMESH_EDGE_MARKED), rate);
        int64_t borders = 0;
        assert_status(delmesh_mesh_layer_borders(mesh, 0, &borders), NULL, DELMESH_OK);
        assert_int_equal(borders, 2 * rate);
        const int64_t corners = info_of(mesh).corners, faces = info_of(mesh).faces;
        double* values = malloc((size_t)corners * 16);
        const delmesh_view_mut target = {values, corners, 0, DELMESH_FLOAT64, 2};
        assert_status(delmesh_limit_values(context, cage, mesh, DELMESH_DOMAIN_CORNER, 0, NULL, &target), context, DELMESH_OK);
        int32_t *on = array_of(mesh, DELMESH_CORNER_CAGE_FACE, corners, 1, DELMESH_INT32),
                *source = array_of(mesh, DELMESH_FACE_SOURCE, faces, 1, DELMESH_INT32),
                *cage_face = array_of(mesh, DELMESH_FACE_CAGE_FACE, faces, 1, DELMESH_INT32);
        double* places = array_of(mesh, DELMESH_CORNER_CAGE_PLACE, corners, 2, DELMESH_FLOAT64);
        for (int64_t c = 0; c < corners; ++c) {
            /* The values are those of a plane, but for the jump; so is their limit, and the place tells where on it. */
            const double u = on[c] % 2 + places[2 * c], v = on[c] / 2 + places[2 * c + 1];
            if (places[2 * c] == 0 || places[2 * c] == 1 || places[2 * c + 1] == 0 || places[2 * c + 1] == 1)
                assert_true(fabs(values[2 * c] - u - (on[c] % 2 == 1 ? 10 : 0)) < 0.2 && fabs(values[2 * c + 1] - v) < 0.2);
            if (places[2 * c] == 0 && on[c] % 2 == 1) assert_true(fabs(values[2 * c] - 11) < 1e-12); /* on the seam */
            if (places[2 * c] == 1 && on[c] % 2 == 0) assert_true(fabs(values[2 * c] - 1) < 1e-12);
            assert_int_equal(on[c], source[c / 3]);
            assert_int_equal(on[c], cage_face[c / 3]);
        }
        /* The same values given anew. */
        double* again = malloc((size_t)corners * 16);
        const delmesh_view_mut target_again = {again, corners, 0, DELMESH_FLOAT64, 2};
        assert_status(delmesh_limit_values(context, cage, mesh, DELMESH_DOMAIN_CORNER, 0, &layers[0].values, &target_again),
                      context, DELMESH_OK);
        assert_memory_equal(values, again, (size_t)corners * 16);
        /* Layers of faces by the ordinary transfer. */
        uint8_t* carried = malloc((size_t)faces);
        const delmesh_view_mut to = {carried, faces, 0, DELMESH_UINT8, 1};
        assert_status(delmesh_transfer(context, mesh, DELMESH_DOMAIN_FACE, DELMESH_TRANSFER_NEAREST, &layers[1].values, &to),
                      context, DELMESH_OK);
        for (int64_t f = 0; f < faces; ++f) assert_int_equal(carried[f], cage_face[f] / 2);
        free(values), free(again), free(on), free(source), free(cage_face), free(places), free(carried);
        delmesh_mesh_destroy(mesh);
    }
    delmesh_cage_destroy(cage);
}

static void normals(void** state) {
    (void)state;
    const Polygons p = square();
    delmesh_cage* cage = cage_of(&p);
    delmesh_mesh* mesh = at_rate(cage, 3);
    const int64_t corners = info_of(mesh).corners;
    float* values = malloc((size_t)corners * 12);
    const delmesh_view_mut target = {values, corners, 0, DELMESH_FLOAT32, 3};
    assert_status(delmesh_limit_normals(context, cage, mesh, NULL, &target), context, DELMESH_OK);
    for (int64_t c = 0; c < corners; ++c)
        assert_true(values[3 * c] == 0 && values[3 * c + 1] == 0 && fabsf(values[3 * c + 2] - 1) < 1e-6f);
    const float pose[4][3] = {{0, 0, 0}, {0, 6, 0}, {0, 6, 6}, {0, 0, 6}};
    const delmesh_view posed = {pose, 4, 0, DELMESH_FLOAT32, 3};
    assert_status(delmesh_limit_normals(context, cage, mesh, &posed, &target), context, DELMESH_OK);
    for (int64_t c = 0; c < corners; ++c) assert_true(fabsf(values[3 * c] - 1) < 1e-6f);
    free(values);
    delmesh_mesh_destroy(mesh);
    delmesh_cage_destroy(cage);
}

/* ---- Through the chain ---------------------------------------------------------------------------------------------------- */

static void places_go_along(void** state) {
    (void)state;
    const Polygons p = crown();
    delmesh_cage* cage = cage_of(&p);
    delmesh_mesh *mesh = at_rate(cage, 12), *full = NULL, *level = NULL;
    delmesh_remesh_options options;
    delmesh_remesh_options_init(&options, sizeof options);
    options.mode = DELMESH_MODE_FLIP;
    options.precision = DELMESH_FLOAT64;
    options.map = 1;
    assert_status(delmesh_remesh(context, mesh, &options, &full, NULL), context, DELMESH_OK);
    delmesh_decimate_options decimate;
    delmesh_decimate_options_init(&decimate, sizeof decimate);
    decimate.precision = DELMESH_FLOAT64;
    decimate.map = 1;
    const delmesh_target target = {DELMESH_TARGET_RATIO, 0, 0.2};
    assert_status(delmesh_decimate(context, full, &target, &decimate, &level, NULL, NULL), context, DELMESH_OK);
    for (delmesh_mesh* m = full;; m = level) {
        assert_status(delmesh_mesh_validate(context, m), context, DELMESH_OK);
        double *positions = positions_of(m), *limit = limit_of(cage, m, &p);
        double far = largest_distance(positions, limit, info_of(m).vertices);
        print_message("    %lld vertices, at most %g from their places\n", (long long)info_of(m).vertices, far);
        /* `full` adds vertices on chords between points of the surface; a level moves its own, within what it deviates. */
        assert_true(far < (m == full ? 0.01 : 0.08));
        free(positions);
        free(limit);
        if (m == level) break;
    }
    /* Those that stayed are where they were. */
    const int64_t verts = info_of(mesh).vertices;
    double *before = positions_of(mesh), *limit = limit_of(cage, full, &p);
    assert_true(largest_distance(before, limit, verts) < 1e-12);
    free(before);
    free(limit);
    /* Without the map there are no places. */
    delmesh_mesh* bare = NULL;
    assert_status(delmesh_remesh(context, mesh, NULL, &bare, NULL), context, DELMESH_OK);
    delmesh_view borrowed;
    assert_int_equal(delmesh_mesh_borrow(bare, DELMESH_CORNER_CAGE_FACE, &borrowed), DELMESH_ERROR_INVALID_ARGUMENT);
    double none[3];
    const delmesh_view_mut to = {none, 1, 0, DELMESH_FLOAT64, 3};
    assert_status(delmesh_limit_normals(context, cage, bare, NULL, &to), context, DELMESH_ERROR_INVALID_ARGUMENT);
    assert_string_equal(delmesh_last_error(context),
                        "The argument 'mesh' had no places on a cage: delmesh_subdivide makes them, and "
                        "'map' keeps them.");
    delmesh_mesh_destroy(bare);
    /* Nor on another cage. */
    const Polygons other = cube();
    delmesh_cage* other_cage = cage_of(&other);
    assert_status(delmesh_limit_normals(context, other_cage, level, NULL, &to), context, DELMESH_ERROR_INVALID_ARGUMENT);
    delmesh_cage_destroy(other_cage);
    delmesh_mesh_destroy(mesh);
    delmesh_mesh_destroy(full);
    delmesh_mesh_destroy(level);
    delmesh_cage_destroy(cage);
}

/* What the context holds at most from the cage to ten levels, per triangle of the dense mesh, the dense mesh, all levels and their
 * places on the cage included; with a UV layer, which is of the places. The limit is what was measured and a twelfth. */
static void memory_of_the_chain_stays_low(void** state) {
    (void)state;
    const Polygons p = cube();
    float uvs[24][2];
    for (int c = 0; c < 24; ++c) {
        uvs[c][0] = (float)(c % 4 == 1 || c % 4 == 2) + (float)(c / 4);
        uvs[c][1] = (float)(c % 4 / 2);
    }
    delmesh_layer layer;
    delmesh_layer_init(&layer, sizeof layer);
    layer.kind = DELMESH_LAYER_UV;
    layer.values = (delmesh_view){uvs, 24, 0, DELMESH_FLOAT32, 2};
    delmesh_cage_desc desc = desc_of(&p);
    desc.layers = &layer;
    desc.layer_count = 1;
    Host own_host;
    delmesh_context* own = host_context(&own_host, 2);
    delmesh_cage* cage = NULL;
    delmesh_mesh *dense = NULL, *levels[10] = {NULL};
    delmesh_subdivide_options options;
    delmesh_subdivide_options_init(&options, sizeof options);
    options.value = 100;
    assert_status(delmesh_cage_create(own, &desc, &cage), own, DELMESH_OK);
    assert_status(delmesh_subdivide(own, cage, &options, &dense, NULL), own, DELMESH_OK);
    const int64_t triangles = info_of(dense).faces;
    assert_int_equal(triangles, 6 * 2 * 100 * 100);
    delmesh_target targets[10] = {{DELMESH_TARGET_FULL, 0, 0}};
    for (int i = 1; i < 10; ++i) targets[i] = (delmesh_target){DELMESH_TARGET_RATIO, 0, i == 1 ? 0.5 : targets[i - 1].value / 2};
    delmesh_decimate_options decimate;
    delmesh_decimate_options_init(&decimate, sizeof decimate);
    decimate.map = 1;
    assert_status(delmesh_lod_family(own, dense, targets, 10, &decimate, levels, NULL, NULL), own, DELMESH_OK);
    uint64_t peak;
    delmesh_context_memory(own, NULL, &peak, NULL);
    print_message("    %.0f bytes per triangle\n", (double)peak / (double)triangles);
    assert_in_range(peak, 1, (uint64_t)500 * (uint64_t)triangles);
    for (int i = 0; i < 10; ++i) delmesh_mesh_destroy(levels[i]);
    delmesh_mesh_destroy(dense);
    delmesh_cage_destroy(cage);
    delmesh_context_destroy(own);
    assert_nothing_left(&own_host);
}

/* ---- Poses ---------------------------------------------------------------------------------------------------------------- */

static delmesh_mesh* in_pose(const delmesh_cage* cage, const delmesh_mesh* mesh, const Polygons* p,
                             delmesh_reevaluate_report* report) {
    const delmesh_view pose = {p->points, p->verts, 0, DELMESH_FLOAT64, 3};
    delmesh_mesh* out = NULL;
    if (report != NULL) delmesh_reevaluate_report_init(report, sizeof *report);
    assert_status(delmesh_reevaluate(context, cage, mesh, &pose, &out, report), context, DELMESH_OK);
    assert_status(delmesh_mesh_validate(context, out), context, DELMESH_OK);
    return out;
}

static void poses(void** state) {
    (void)state;
    const Polygons rest = crown();
    delmesh_cage* cage = cage_of(&rest);
    delmesh_mesh *mesh = at_rate(cage, 12), *level = NULL;
    delmesh_decimate_options options;
    delmesh_decimate_options_init(&options, sizeof options);
    options.map = 1;
    options.quality = 2;
    const delmesh_target target = {DELMESH_TARGET_RATIO, 0, 0.2};
    assert_status(delmesh_decimate(context, mesh, &target, &options, &level, NULL, NULL), context, DELMESH_OK);
    delmesh_reevaluate_report report;

    /* The rest pose gives the level's own bytes. */
    delmesh_mesh* again = in_pose(cage, level, &rest, &report);
    const Snapshot before = take_snapshot(level), after = take_snapshot(again);
    assert_same_snapshot(before, after);
    free(before.bytes);
    free(after.bytes);
    assert_int_equal(report.moved_vertices, 0);
    assert_int_equal(report.delaunay, 1);
    assert_true(report.largest_offset > 1e-4 && report.largest_offset < 0.1); /* decimation and relaxation moved them off */
    delmesh_mesh_destroy(again);

    /* A pose turned, enlarged and shifted gives the level turned, enlarged and shifted. */
    Polygons pose = rest;
    for (int32_t v = 0; v < rest.verts; ++v) {
        const double* x = rest.points[v];
        const double turned[3] = {3 - 2 * x[1], 2 * x[0] + 1, 2 * x[2]};
        memcpy(pose.points[v], turned, sizeof turned);
    }
    again = in_pose(cage, level, &pose, &report);
    double *one = positions_of(level), *two = positions_of(again);
    for (int64_t v = 0; v < info_of(level).vertices; ++v) {
        const double turned[3] = {3 - 2 * one[3 * v + 1], 2 * one[3 * v] + 1, 2 * one[3 * v + 2]};
        assert_true(distance(turned, two + 3 * v) < 2e-6);
    }
    free(one);
    free(two);
    delmesh_mesh_destroy(again);

    /* A bent pose: the dense mesh, which lies on the surface, follows it; the counts are those of certify. */
    pose = rest;
    for (int32_t v = 0; v < rest.verts; ++v) pose.points[v][2] += rest.points[v][0] * rest.points[v][0];
    again = in_pose(cage, mesh, &pose, &report);
    one = positions_of(again);
    two = limit_of(cage, mesh, &pose);
    assert_true(largest_distance(one, two, info_of(mesh).vertices) < 1e-12);
    assert_true(report.moved_vertices > info_of(mesh).vertices / 2); /* all but for x = 0 */
    assert_true(report.largest_offset == 0);
    delmesh_certify_report certified;
    delmesh_certify_report_init(&certified, sizeof certified);
    assert_status(delmesh_certify(context, again, NULL, &certified), context, DELMESH_OK);
    assert_int_equal(report.nld_interior, certified.nld_interior);
    assert_int_equal(report.nld_boundary, certified.nld_boundary);
    assert_int_equal(report.zero_area_faces, certified.zero_area_faces);
    assert_int_equal(report.delaunay, certified.delaunay);
    assert_int_equal(report.delaunay, 0);
    free(one);
    free(two);
    delmesh_mesh_destroy(again);

    /* One tooth moves; what it does not reach stays bit for bit. */
    pose = rest;
    pose.points[rest.verts - 1][2] += 1;
    again = in_pose(cage, level, &pose, NULL);
    one = positions_of(level), two = positions_of(again);
    int64_t same = 0;
    for (int64_t v = 0; v < info_of(level).vertices; ++v) same += memcmp(one + 3 * v, two + 3 * v, 24) == 0;
    assert_true(same > info_of(level).vertices / 2 && same < info_of(level).vertices);
    free(one);
    free(two);
    delmesh_mesh_destroy(again);

    const delmesh_view few = {rest.points, rest.verts - 1, 0, DELMESH_FLOAT64, 3};
    assert_status(delmesh_reevaluate(context, cage, level, &few, &again, NULL), context, DELMESH_ERROR_INVALID_ARGUMENT);
    assert_null(again);
    assert_string_equal(delmesh_last_error(context),
                        "The view 'positions' had 17 elements, and there were 18 vertices of the cage.");
    pose.points[4][1] = INFINITY;
    const delmesh_view endless = {pose.points, rest.verts, 0, DELMESH_FLOAT64, 3};
    assert_status(delmesh_reevaluate(context, cage, level, &endless, &again, NULL), context, DELMESH_ERROR_INVALID_ARGUMENT);
    assert_string_equal(delmesh_last_error(context), "positions: vertex 4 had a NaN or infinite coordinate.");
    delmesh_mesh_destroy(mesh);
    delmesh_mesh_destroy(level);
    delmesh_cage_destroy(cage);
}

/* A pose shares what it has with its mesh, and so does a pose of that: each stays whole when the others are gone, in any order,
 * also in other contexts. What has an allocator of a host's lends nothing out of its context. */
static void poses_outlive_their_mesh(void** state) {
    (void)state;
    const Polygons p = crown();
    for (int round = 0; round < 8; ++round) {
        const int last = round % 4;
        Host other_host;
        delmesh_context *other = host_context(&other_host, 1), *plain = NULL, *plainer = NULL;
        assert_status(delmesh_context_create(NULL, &plain), NULL, DELMESH_OK);
        assert_status(delmesh_context_create(NULL, &plainer), NULL, DELMESH_OK);
        delmesh_context* const mine[4] = {context, context, context, other};
        delmesh_context* const ours[4] = {plain, other, plainer, plain};
        delmesh_context* const* with = round < 4 ? mine : ours;
        delmesh_cage* cage = cage_of(&p);
        delmesh_mesh* meshes[4] = {NULL};
        assert_status(delmesh_subdivide(with[0], cage, NULL, &meshes[0], NULL), with[0], DELMESH_OK);
        Polygons pose = p;
        delmesh_reevaluate_report report;
        for (int i = 1; i < 4; ++i) {
            pose.points[0][2] += i;
            const delmesh_view view = {pose.points, p.verts, 0, DELMESH_FLOAT64, 3};
            delmesh_reevaluate_report_init(&report, sizeof report);
            assert_status(delmesh_reevaluate(with[i], cage, meshes[i - 1], &view, &meshes[i], &report), with[i], DELMESH_OK);
            assert_true(report.moved_vertices > 0);
        }
        const Snapshot before = take_snapshot(meshes[last]);
        for (int i = 0; i < 4; ++i)
            if (i != last) delmesh_mesh_destroy(meshes[i]);
        const Snapshot after = take_snapshot(meshes[last]);
        assert_same_snapshot(before, after);
        free(before.bytes);
        free(after.bytes);
        assert_status(delmesh_mesh_validate(context, meshes[last]), context, DELMESH_OK);
        delmesh_mesh_destroy(meshes[last]);
        delmesh_cage_destroy(cage);
        delmesh_context_destroy(plain);
        delmesh_context_destroy(plainer);
        delmesh_context_destroy(other);
        assert_nothing_left(&other_host);
    }
}

static void same_bytes_for_any_threads(void** state) {
    (void)state;
    const Polygons p = crown();
    Snapshot first = {0};
    for (int32_t threads = 1; threads <= 8; threads += 1 + threads / 2) {
        Host other;
        delmesh_context* own = host_context(&other, threads);
        const delmesh_cage_desc desc = desc_of(&p);
        delmesh_cage* cage = NULL;
        delmesh_mesh* mesh = NULL;
        delmesh_subdivide_options options;
        delmesh_subdivide_options_init(&options, sizeof options);
        options.value = 24;
        assert_status(delmesh_cage_create(own, &desc, &cage), own, DELMESH_OK);
        assert_status(delmesh_subdivide(own, cage, &options, &mesh, NULL), own, DELMESH_OK);
        delmesh_cage_destroy(cage); /* the mesh does not need it */
        const Snapshot snapshot = take_snapshot(mesh);
        if (first.bytes == NULL) {
            first = snapshot;
        } else {
            assert_same_snapshot(first, snapshot);
            free(snapshot.bytes);
        }
        delmesh_mesh_destroy(mesh);
        delmesh_context_destroy(own);
        assert_nothing_left(&other);
    }
    free(first.bytes);
}

/* ---- Refusals ------------------------------------------------------------------------------------------------------------- */

static void refused(const delmesh_cage_desc* desc, int32_t status, const char* sentence) {
    delmesh_cage* cage = (delmesh_cage*)(uintptr_t)1;
    assert_status(delmesh_cage_create(context, desc, &cage), context, status);
    assert_null(cage);
    assert_string_equal(delmesh_last_error(context), sentence);
}

static void bad_cages(void** state) {
    (void)state;
    const Polygons p = cube();
    const delmesh_cage_desc good = desc_of(&p);
    delmesh_cage_desc desc = good;
    desc.corner_verts.count = desc.face_sizes.count = 0;
    refused(&desc, DELMESH_ERROR_NO_SURFACE, "face_sizes: the cage had no faces.");

    const int32_t creases[2][2] = {{0, 1}, {1, 8}};
    double sharpness[2] = {2, 3};
    desc = good;
    desc.crease_edges = (delmesh_view){creases, 2, 0, DELMESH_INT32, 2};
    desc.crease_sharpness = (delmesh_view){sharpness, 2, 0, DELMESH_FLOAT64, 1};
    refused(&desc, DELMESH_ERROR_INDEX_OUT_OF_RANGE, "crease_edges: crease 1 had vertex 8; there were 8 vertices.");
    sharpness[0] = -1;
    refused(&desc, DELMESH_ERROR_INVALID_ARGUMENT, "crease_sharpness: sharpness 0 was -1, which is not 0 or more.");
    sharpness[0] = NAN;
    refused(&desc, DELMESH_ERROR_INVALID_ARGUMENT, "crease_sharpness: sharpness 0 was nan, which is not 0 or more.");
    desc.crease_sharpness.count = 1;
    refused(&desc, DELMESH_ERROR_INVALID_ARGUMENT, "The view 'crease_edges' had 2 elements, and 'crease_sharpness' 1.");

    const int32_t verts[1] = {-1};
    desc = good;
    desc.sharp_verts = (delmesh_view){verts, 1, 0, DELMESH_INT32, 1};
    desc.vert_sharpness = (delmesh_view){sharpness, 1, 0, DELMESH_FLOAT64, 1};
    refused(&desc, DELMESH_ERROR_INDEX_OUT_OF_RANGE, "sharp_verts: number 0 had vertex -1; there were 8 vertices.");
    desc.sharp_verts.data = creases;
    refused(&desc, DELMESH_ERROR_INVALID_ARGUMENT, "vert_sharpness: sharpness 0 was nan, which is not 0 or more.");
    sharpness[0] = -0.5;
    refused(&desc, DELMESH_ERROR_INVALID_ARGUMENT, "vert_sharpness: sharpness 0 was -0.5, which is not 0 or more.");
    desc = good;
    const int32_t hole[2] = {5, 6};
    desc.holes = (delmesh_view){hole, 2, 0, DELMESH_INT32, 1};
    refused(&desc, DELMESH_ERROR_INDEX_OUT_OF_RANGE, "holes: number 1 was face 6; there were 6 faces.");
    desc.holes = (delmesh_view){verts, 1, 0, DELMESH_INT32, 1};
    refused(&desc, DELMESH_ERROR_INDEX_OUT_OF_RANGE, "holes: number 0 was face -1; there were 6 faces.");
    desc = good;
    desc.scheme = 3;
    refused(&desc, DELMESH_ERROR_INVALID_ARGUMENT, "The option 'scheme' was 3, outside 0 to 2.");

    Polygons q = cube();
    q.sizes[2] = 2;
    desc = desc_of(&q);
    refused(&desc, DELMESH_ERROR_INVALID_ARGUMENT, "face_sizes: face 2 had 2 corners, and faces of a cage have 3 to 65535.");
    q.sizes[2] = 4;
    q.corners[9] = 0;
    refused(&desc, DELMESH_ERROR_INVALID_ARGUMENT, "corner_verts: face 2 had vertex 0 twice.");
    q.corners[9] = 99;
    refused(&desc, DELMESH_ERROR_INDEX_OUT_OF_RANGE, "corner_verts: corner 9 had vertex 99; there were 8 vertices.");
    q = cube();
    q.points[3][1] = NAN;
    refused(&desc, DELMESH_ERROR_INVALID_ARGUMENT, "positions: vertex 3 had a NaN or infinite coordinate.");
    q = cube();
    const int64_t offsets[] = {0, 4, INT64_MIN, 12, 16, 20, 24}; /* less than 4 by more than there are numbers */
    desc.face_sizes = (delmesh_view){NULL, 0, 0, 0, 0};
    desc.face_offsets = (delmesh_view){offsets, 7, 0, DELMESH_INT64, 1};
    refused(&desc, DELMESH_ERROR_INVALID_ARGUMENT, "face_offsets: face 1 had -1 corners, and faces of a cage have 3 to 65535.");
    desc = desc_of(&q);
    q.sizes[5] = 5;
    refused(&desc, DELMESH_ERROR_INDEX_OUT_OF_RANGE, "face_sizes: face 5 went past the last of 24 corners.");
}

static void bad_subdivisions(void** state) {
    (void)state;
    const Polygons p = cube();
    delmesh_cage* cage = cage_of(&p);
    static const struct {
        int32_t fineness;
        double value;
        int32_t evaluation, status;
        const char* sentence;
    } cases[] = {
        {DELMESH_FINENESS_RATE, 0, 0, DELMESH_ERROR_INVALID_ARGUMENT, "The option 'value' was 0, outside 1 to 4096."},
        {DELMESH_FINENESS_RATE, 1e6, 0, DELMESH_ERROR_INVALID_ARGUMENT, "The option 'value' was 1000000, outside 1 to 4096."},
        {DELMESH_FINENESS_RATE, 2.5, 0, DELMESH_ERROR_INVALID_ARGUMENT,
         "The option 'value' was 2.5, and rates are whole numbers."},
        {DELMESH_FINENESS_FACES, 0, 0, DELMESH_ERROR_INVALID_ARGUMENT, "The option 'value' was 0, which is not more than 0."},
        {DELMESH_FINENESS_EDGE_LENGTH, NAN, 0, DELMESH_ERROR_INVALID_ARGUMENT,
         "The option 'value' was nan, which is not more than 0."},
        {DELMESH_FINENESS_EDGE_LENGTH, 1e-9, 0, DELMESH_ERROR_TOO_LARGE,
         "The longest edge would be cut into more than 4096 pieces of the edge length 'value'."},
        {DELMESH_FINENESS_RATE, 6, DELMESH_EVALUATION_FAR, DELMESH_ERROR_INVALID_ARGUMENT,
         "The rate was 6, and DELMESH_EVALUATION_FAR takes powers of two from 2 on."},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; ++i) {
        delmesh_mesh* mesh = (delmesh_mesh*)(uintptr_t)1;
        assert_status(try_subdivide(cage, cases[i].fineness, cases[i].value, cases[i].evaluation, &mesh, NULL), context,
                      cases[i].status);
        assert_null(mesh);
        assert_string_equal(delmesh_last_error(context), cases[i].sentence);
    }
    delmesh_cage_destroy(cage);
    /* 70 x 2 x 4096 x 4096 is more than fits. */
    Polygons q = {0};
    for (int i = 0; i < 21; ++i) add_point(&q, i, 0, 0), add_point(&q, i, 1, i & 1), add_point(&q, i, 2, 0);
    for (int i = 0; i < 20; ++i)
        for (int k = 0; k < 2; ++k) {
            const int32_t quad[4] = {3 * i + k, 3 * i + 3 + k, 3 * i + 4 + k, 3 * i + 1 + k};
            add_face(&q, 4, quad);
        }
    cage = cage_of(&q);
    delmesh_mesh* mesh = NULL;
    assert_status(try_subdivide(cage, DELMESH_FINENESS_RATE, 4096, 0, &mesh, NULL), context, DELMESH_ERROR_TOO_LARGE);
    assert_string_equal(delmesh_last_error(context), "The rate 4096 made 1342177280 triangles, more than 2^31 - 1 corners.");
    /* Loose edges may have creases. */
    const int32_t creases[2][2] = {{0, 62}, {0, 1}};
    const float sharpness[2] = {1, 1};
    delmesh_cage_desc desc = desc_of(&q);
    desc.crease_edges = (delmesh_view){creases, 2, 0, DELMESH_INT32, 2};
    desc.crease_sharpness = (delmesh_view){sharpness, 2, 0, DELMESH_FLOAT32, 1};
    delmesh_cage_destroy(cage);
    cage = make_cage(&desc);
    delmesh_subdivide_report report;
    delmesh_subdivide_report_init(&report, sizeof report);
    assert_status(try_subdivide(cage, DELMESH_FINENESS_RATE, 2, 0, &mesh, &report), context, DELMESH_OK);
    assert_int_equal(report.unmatched_creases, 1);
    delmesh_mesh_destroy(mesh);
    delmesh_cage_destroy(cage);
}

static void says_what_it_was_built_without(void** state) {
    (void)state;
    const Polygons p = cube();
    const delmesh_cage_desc desc = desc_of(&p);
    refused(&desc, DELMESH_ERROR_UNSUPPORTED, "This library was built without OpenSubdiv, which evaluates cages.");
}

int main(void) {
    const struct CMUnitTest without[] = {cmocka_unit_test(says_what_it_was_built_without), cmocka_unit_test(bad_cages)};
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(limit_points_of_a_cube),
        cmocka_unit_test(sharp_for_ever),
        cmocka_unit_test(boundaries),
        cmocka_unit_test(bilinear_and_loop),
        cmocka_unit_test(holes),
        cmocka_unit_test(n_gons),
        cmocka_unit_test(non_manifold_cages),
        cmocka_unit_test(fineness),
        cmocka_unit_test(layers_and_borders),
        cmocka_unit_test(normals),
        cmocka_unit_test(places_go_along),
        cmocka_unit_test(memory_of_the_chain_stays_low),
        cmocka_unit_test(same_bytes_for_any_threads),
        cmocka_unit_test(bad_cages),
        cmocka_unit_test(bad_subdivisions),
        cmocka_unit_test(poses),
        cmocka_unit_test(poses_outlive_their_mesh),
        cmocka_unit_test(distance_to_the_limit),
    };
    if (!has_cages()) return cmocka_run_group_tests_name("no cages", without, set_up, tear_down);
    return cmocka_run_group_tests_name("subdivide", tests, set_up, tear_down);
}
