/* SPDX-License-Identifier: Apache-2.0
 * Common ground of the tests of the C interface: shapes, a host that counts and refuses, and whole-mesh snapshots. */
#ifndef DELMESH_TESTS_CAPI_SUPPORT_H
#define DELMESH_TESTS_CAPI_SUPPORT_H

#include <pthread.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>
#include <delmesh/delmesh.h>

/* ---- Shapes: triangles in float64 ---------------------------------------------------------------------------------------- */

typedef struct {
    double* positions; /* verts x 3 */
    int32_t* corners;  /* faces x 3 */
    int32_t verts, faces;
} Shape;

Shape sheet_shape(int32_t side);                   /* a leaning, rolling height field with a boundary */
Shape torus_shape(int32_t around, int32_t across); /* closed, leaning quads cut in two */
Shape book_shape(void); /* four leaning pages at one spine, one of them upside down, a page twice, a loose vertex */
Shape moebius_shape(void);
void free_shape(Shape* shape);

/* ---- A host: counting allocator, progress that can cancel, everything checked for the thread it comes on ----------------- */

typedef struct {
    int64_t live_blocks, live_bytes, allocations;
    int64_t fail_at;   /* this allocation (counted from 1) gets NULL; 0: none */
    int64_t cancel_at; /* this progress call (from 1) does not return DELMESH_CONTINUE; 0: none */
    int64_t progress_calls, log_lines;
    double last_fraction;
    int fraction_fell;
    pthread_t thread; /* where callbacks are expected */
    /* A callback came on another thread or with arguments out of its contract. No assertion inside callbacks, for a failed one
     * longjmps, which must not cross the library's frames. */
    int misused;
    char last_stage[64];
} Host;

/* Fills the host with zeros and the options with its callbacks. */
void host_init(Host* host, delmesh_context_options* options);
delmesh_context* host_context(Host* host, int32_t max_threads);
void assert_nothing_left(const Host* host);

/* Defines host, context, and set_up and tear_down of a group of tests for cmocka, which sees that nothing is left. */
#define HOST_FIXTURE(max_threads)                                                                                                \
    static Host host;                                                                                                            \
    static delmesh_context* context;                                                                                             \
    static int set_up(void** state) {                                                                                            \
        (void)state;                                                                                                             \
        context = host_context(&host, max_threads);                                                                              \
        return 0;                                                                                                                \
    }                                                                                                                            \
    static int tear_down(void** state) {                                                                                         \
        (void)state;                                                                                                             \
        delmesh_context_destroy(context);                                                                                        \
        assert_nothing_left(&host);                                                                                              \
        return 0;                                                                                                                \
    }

/* ---- Meshes -------------------------------------------------------------------------------------------------------------- */

delmesh_view view(const void* data, int64_t count, int32_t type, int32_t components); /* without gaps */
delmesh_mesh_desc shape_desc(const Shape* shape);
delmesh_mesh* shape_mesh(delmesh_context* context, const Shape* shape);
/* 8 vertices, 6 faces of 4 corners; float32, uint32 and uint8. */
int32_t create_quad_cube(delmesh_context* context, delmesh_mesh** out);

/* Every array of a mesh and its counts, one after the other: equal bytes, equal meshes. */
typedef struct {
    unsigned char* bytes;
    size_t size;
} Snapshot;
Snapshot take_snapshot(const delmesh_mesh* mesh);
void assert_same_snapshot(Snapshot a, Snapshot b);

/* malloc that the compiler does not see through: for structs that end before their type does. */
void* exactly(size_t bytes);

delmesh_mesh_info info_of(const delmesh_mesh* mesh);
int has_cages(void);                   /* whether the library was built with OpenSubdiv */
int has_map(const delmesh_mesh* mesh); /* of corners and edges: from mesh_create, or made with the option */
#define assert_status(status, context, expected) assert_status_at(status, context, expected, __FILE__, __LINE__)
void assert_status_at(int32_t status, const delmesh_context* context, int32_t expected, const char* file, int line);

/* ---- All operations, on small inputs ------------------------------------------------------------------------------------- */

typedef struct {
    Shape sheet, book;
    delmesh_mesh *sheet_mesh, *book_mesh;
    delmesh_cage* cage;      /* NULL where the library was built without cages */
    delmesh_mesh* cage_mesh; /* subdivided from it */
} Fixture;
/* context: NULL: the shapes alone. */
void fixture_init(Fixture* fixture, delmesh_context* context);
int32_t fixture_make(Fixture* fixture, delmesh_context* context); /* what is still NULL, until the first failure */
void fixture_free(Fixture* fixture);

enum { OPERATIONS = 20 };
extern const char* const operation_names[OPERATIONS];
/* Runs one; *out is a mesh where the operation makes one. Nothing that it is given changes, also not its own result lists, unless
 * it succeeds: that is asserted inside. */
int32_t run_operation(int operation, delmesh_context* context, const Fixture* fixture, delmesh_mesh** out);

#endif
