/* SPDX-License-Identifier: Apache-2.0
 *
 * delmesh.h: the C interface of libdelmesh, which turns any triangle or polygon mesh into a Delaunay mesh and hands it back.
 * This is the library's only ABI. C99, no macros needed to call it, no variadic functions, no inline functions.
 *
 * In one minute
 *     delmesh_context_create(NULL, &ctx);
 *     delmesh_mesh_desc desc;  delmesh_mesh_desc_init(&desc, sizeof desc);
 *     desc.positions = ...;  desc.corner_verts = ...;
 *     delmesh_mesh_create(ctx, &desc, &in);
 *     delmesh_remesh(ctx, in, NULL, &out, NULL);          -> a new mesh; `in` is never changed
 *     delmesh_mesh_read(out, DELMESH_POSITION, &my_array);
 *     delmesh_mesh_destroy(out);  delmesh_mesh_destroy(in);  delmesh_context_destroy(ctx);
 *
 * Rules that hold for every function
 *  - Errors. Fallible functions return an int32_t status: DELMESH_OK is 0, errors are negative and their numbers are fixed for
 *    ever. delmesh_last_error(ctx) then holds one sentence that names the argument and the index (of functions that take a
 *    context, and but for DELMESH_ERROR_BUSY: the text belongs to the call that is running). The lists of errors below do not
 *    repeat what every call may return: BUSY where it takes a context, and INTERNAL. "Memory" stands for OUT_OF_MEMORY,
 *    MEMORY_LIMIT and ALLOCATION_LIMIT. Pointers may be NULL only where that is said. After a failure or a cancel
 *    the handle written through an `out` argument is NULL and everything the caller owns is as it was. Nothing prints, aborts,
 *    throws across this boundary, or leaves a changed floating-point environment behind.
 *  - Ownership. The caller owns what it passes in; the library copies what it needs before the call returns. Handles belong to
 *    the caller and go to their _destroy function, which accepts NULL. Meshes may outlive the context they were made with.
 *  - Threads. A context is used by one thread at a time; different contexts are independent. Meshes never change once made: any
 *    thread may read them. Callbacks run only on the thread that made the call, in the library's floating-point environment.
 *    delmesh_cancel is the one function that may be called for a context that another thread is using.
 *  - Structs. Options and reports start with `struct_size`. Fill options with their _init function (it sets the defaults and the
 *    size), set struct_size of a report to sizeof(the struct) before the call (its _init does). Structs only ever grow at the
 *    end; a caller built against an older or a newer header keeps working: the common part is used, and a newer caller that sets
 *    an option which the library does not know gets DELMESH_ERROR_UNSUPPORTED instead of being ignored.
 *  - Indices count from 0. Lengths are in the units of the positions, angles in degrees.
 *  - Same input, same bytes out, over runs and thread counts.
 *
 * Status of the interface: version 0, everything here may still change before 1.0 (CHANGELOG.md says what did).
 */
#ifndef DELMESH_H
#define DELMESH_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#if defined(DELMESH_STATIC)
#define DELMESH_API
#elif defined(_WIN32)
#ifdef DELMESH_BUILD
#define DELMESH_API __declspec(dllexport)
#else
#define DELMESH_API __declspec(dllimport)
#endif
#else
#define DELMESH_API __attribute__((visibility("default")))
#endif

#define DELMESH_VERSION_MAJOR 0
#define DELMESH_VERSION_MINOR 1
#define DELMESH_VERSION_PATCH 0
/* Grows when a function or a struct changes in a way that an older caller cannot survive. */
#define DELMESH_ABI_VERSION 1

/* ---- Handles, statuses, constants ----------------------------------------------------------------------------------------- */

typedef struct delmesh_context delmesh_context;
typedef struct delmesh_mesh delmesh_mesh;
typedef struct delmesh_cage delmesh_cage;

enum {
    DELMESH_OK = 0,
    DELMESH_ERROR_INVALID_ARGUMENT = -1,   /* a pointer, enum value, number or view is not what the function takes */
    DELMESH_ERROR_OUT_OF_MEMORY = -2,      /* the allocator returned NULL */
    DELMESH_ERROR_MEMORY_LIMIT = -3,       /* the context's memory_limit would be exceeded */
    DELMESH_ERROR_ALLOCATION_LIMIT = -4,   /* the context's allocation_limit was reached */
    DELMESH_ERROR_CANCELLED = -5,          /* by delmesh_cancel or by the progress callback */
    DELMESH_ERROR_INDEX_OUT_OF_RANGE = -6, /* a corner, offset or marked edge refers to something that is not there */
    DELMESH_ERROR_TOO_LARGE = -7,          /* more than 2^31 - 1 corners or vertices, now or in the result */
    DELMESH_ERROR_NO_SURFACE = -8,         /* no face has any area at the output precision: there is nothing to remesh */
    DELMESH_ERROR_NON_ORIENTABLE = -9,     /* a component is one-sided, like a Moebius strip */
    DELMESH_ERROR_STRICT = -10,            /* the input needs a repair, and `strict` forbids repairs */
    DELMESH_ERROR_VERTEX_LIMIT = -11,      /* max_vertices was reached before the mesh was Delaunay */
    DELMESH_ERROR_PRECISION = -12,         /* the output precision cannot hold a Delaunay mesh here; the sentence names the face */
    /* an option of a newer header is set that this library does not know; or what it was built without is asked for */
    DELMESH_ERROR_UNSUPPORTED = -13,
    DELMESH_ERROR_BUSY = -14,              /* the context is in use by another thread, or by the callback's own caller */
    DELMESH_ERROR_INTERNAL = -15           /* a defect of the library: please report it with the sentence */
};

/* Types of the numbers behind a view. */
enum {
    DELMESH_FLOAT32 = 1,
    DELMESH_FLOAT64 = 2,
    DELMESH_INT32 = 3,
    DELMESH_UINT32 = 4,
    DELMESH_INT64 = 5,
    DELMESH_UINT8 = 6
};

/* What a progress callback returns to go on. ANY other value cancels, so that a binding whose callback raises cancels too. */
#define DELMESH_CONTINUE 0x600D

/* A strided array that is read. data: first element, aligned for `type`; count: elements; stride: bytes from one element to the
 * next, a multiple of the type's size and no less than an element's, 0 = tightly packed; type: DELMESH_FLOAT32...; components:
 * numbers per element, consecutive in memory (3 for a position). All zero means "not given". 32 bytes, frozen. */
typedef struct delmesh_view {
    const void* data;
    int64_t count;
    int64_t stride;
    int32_t type;
    int32_t components;
} delmesh_view;

/* The same for an array that is written. */
typedef struct delmesh_view_mut {
    void* data;
    int64_t count;
    int64_t stride;
    int32_t type;
    int32_t components;
} delmesh_view_mut;

/* ---- Context -------------------------------------------------------------------------------------------------------------- */

/* Called on the calling thread, at most about twenty times a second and at the begin of each stage. fraction: 0..1 of the whole
 * call, never falling; stage: a short English name, valid during the callback. Must return DELMESH_CONTINUE to go on. */
typedef int32_t (*delmesh_progress_fn)(void* user, double fraction, const char* stage);

enum { DELMESH_LOG_INFO = 1, DELMESH_LOG_WARNING = 2 };
/* One formatted UTF-8 line without newline, on the calling thread. The library logs what it repaired and nothing else. */
typedef void (*delmesh_log_fn)(void* user, int32_t level, const char* text);

/* alloc and free may be called from several threads at once where several threads use meshes of one context (borrow, destroy).
 * size > 0; returns memory aligned to `align` (a power of two, at most 64) or NULL. */
typedef void* (*delmesh_alloc_fn)(void* user, uint64_t size, uint64_t align);
/* pointer came from delmesh_alloc_fn with the same size; never NULL. */
typedef void (*delmesh_free_fn)(void* user, void* pointer, uint64_t size);

/* The host's own thread pool: must call task(task_data, i) once for every i in [0, count), on any threads, and return after the
 * last has returned. The tasks neither call back nor allocate; the function must not throw. */
typedef void (*delmesh_task_fn)(void* task_data, int32_t index);
typedef void (*delmesh_parallel_for_fn)(void* user, int32_t count, delmesh_task_fn task, void* task_data);

typedef struct delmesh_context_options {
    uint32_t struct_size;
    int32_t max_threads;       /* 0 (default): one per core; 1: only the calling thread */
    uint64_t memory_limit;     /* bytes alive at a time, over all meshes of this context; 0: none */
    uint64_t allocation_limit; /* number of allocations over the context's life; 0: none (for tests) */
    void* user;                /* handed to every callback below */
    delmesh_progress_fn progress;         /* may be NULL, as may all of these */
    delmesh_log_fn log;
    delmesh_alloc_fn alloc;               /* alloc and free go together. Default: the C library's aligned allocator */
    delmesh_free_fn free;                 /* may also be called by delmesh_mesh_destroy, after the context is gone */
    delmesh_parallel_for_fn parallel_for; /* default: own threads, started when first needed, joined by _context_destroy */
} delmesh_context_options;

DELMESH_API void delmesh_context_options_init(delmesh_context_options* options, uint32_t struct_size);

/* options: NULL for the defaults; copied. Every array and all scratch comes from the allocator; a few hundred bytes of
 * bookkeeping (thread handles) come from the C++ runtime. Errors: INVALID_ARGUMENT, UNSUPPORTED, memory. O(1). */
DELMESH_API int32_t delmesh_context_create(const delmesh_context_options* options, delmesh_context** out);
/* Joins the context's threads. Meshes made with it stay valid and are destroyed on their own. NULL is fine. */
DELMESH_API void delmesh_context_destroy(delmesh_context* context);
/* From any thread: the call that runs on this context, or else the next one, returns DELMESH_ERROR_CANCELLED. Sticky until then. */
DELMESH_API void delmesh_cancel(delmesh_context* context);
/* The sentence of the last failed call on this context; "" if the last call succeeded. Valid until the next call on it. */
DELMESH_API const char* delmesh_last_error(const delmesh_context* context);
/* Static name of a status, e.g. "DELMESH_ERROR_CANCELLED"; "DELMESH_ERROR_UNKNOWN" for other numbers. */
DELMESH_API const char* delmesh_status_name(int32_t status);
/* major << 16 | minor << 8 | patch of the library that runs. */
DELMESH_API uint32_t delmesh_version(void);
/* Bytes alive now and at most so far in the context's allocator, and allocations made. Any pointer may be NULL. */
DELMESH_API void delmesh_context_memory(const delmesh_context* context, uint64_t* current, uint64_t* peak, uint64_t* allocations);

/* ---- Mesh ----------------------------------------------------------------------------------------------------------------- */

enum { DELMESH_WELD_NONE = 0, DELMESH_WELD_EXACT = 1 };

/* What a layer of values is, and so which bit its borders have in DELMESH_EDGE_FLAGS. */
enum {
    DELMESH_LAYER_UV = 1,       /* at corners, 2 or 3 components */
    DELMESH_LAYER_NORMAL = 2,   /* at corners */
    DELMESH_LAYER_COLOR = 3,    /* at corners */
    DELMESH_LAYER_OTHER = 4,    /* at corners */
    DELMESH_LAYER_MATERIAL = 5, /* of faces: int32, uint32 or uint8, 1 component */
    DELMESH_LAYER_FACE_SET = 6  /* the same */
};
/* Are edges kept at which the layer's values jump? _DEFAULT: all but those of normals and colours. */
enum { DELMESH_BORDER_DEFAULT = 0, DELMESH_BORDER_KEEP = 1, DELMESH_BORDER_FREE = 2 };

/* Values that the host has at the corners of its polygons, or at the polygons (docs/attributes.md). They are compared across
 * edges when the mesh is made. Kept beyond that, as float32: UV layers, whose texture preserve leaves in its place on flat places,
 * and any layer of corners with a weight. To carry values over to a result: delmesh_transfer. */
typedef struct delmesh_layer {
    uint32_t struct_size;
    int32_t kind;            /* DELMESH_LAYER_* */
    int32_t border;          /* DELMESH_BORDER_* */
    int32_t reserved0;
    double tolerance;        /* values that differ by no more in each component are the same; 0 (default): bitwise, and -0 = 0 */
    double affine_tolerance; /* UV: by how much the texture may move on flat places, in its own units; < 0 (default): 1e-5 of the
                                range of its values */
    double weight;           /* decimation of the mesh: how much an error of this layer counts. 1: one of a hundredth of the range
                                of its values (of the component that has the largest) as much as a distance of a hundredth of
                                the longest side of the mesh's bounding box. 0 (default): not at all. UVs 1, normals 0.1 are a
                                start; of layers of faces it is not looked at */
    delmesh_view values;     /* as many as corners, in their order, 1..16 float32, float64, int32, uint32 or uint8;
                                or as many as faces */
} delmesh_layer;

DELMESH_API void delmesh_layer_init(delmesh_layer* layer, uint32_t struct_size);

/* A mesh as the host has it. Either triangles (corner_verts alone: count = 3 F with 1 component, or F with 3 components), or
 * polygons with face_offsets (F + 1 ascending positions into corner_verts, from 0 to its count) or face_sizes (F sizes). */
typedef struct delmesh_mesh_desc {
    uint32_t struct_size;
    /* DELMESH_WELD_NONE (default), or _EXACT: corners at bitwise equal positions (-0 = 0) share the first vertex */
    int32_t weld;
    int32_t strict; /* 1: any repair that the import would make is refused with DELMESH_ERROR_STRICT. Default 0 */
    int32_t reserved0;
    delmesh_view positions;    /* V x 3, float32 or float64; the mesh has that precision */
    delmesh_view corner_verts; /* int32, uint32 or int64 vertex indices, one per corner, counter-clockwise seen from outside */
    delmesh_view face_offsets; /* optional, int32, uint32 or int64 */
    delmesh_view face_sizes;   /* optional, int32, uint32, int64 or uint8 */
    /* optional, M x 2 int32, uint32 or int64 vertex indices: edges that remesh keeps (never flips) in every mode */
    delmesh_view marked_edges;
    /* optional, layer_count of them, each with struct_size set and the same: what says where textures, materials... have borders */
    const delmesh_layer* layers;
    int32_t layer_count; /* 0..64 */
    int32_t reserved1;
    /* optional, E x 2 vertex indices of the same types: the host's edges, in any order; DELMESH_EDGE_SOURCE_EDGE then has its
     * numbers */
    delmesh_view edge_verts;
    /* optional, one uint8, int32, uint32 or int64 per edge_verts: 0 or DELMESH_EDGE_MARKED, _SHARP, _SEAM, _CREASE, added */
    delmesh_view edge_marks;
} delmesh_mesh_desc;

DELMESH_API void delmesh_mesh_desc_init(delmesh_mesh_desc* desc, uint32_t struct_size);

/* Makes a mesh handle out of any input. Vertex i of the mesh is vertex i of the input, also where no face uses it. What is not
 * an oriented manifold is repaired as docs/import.md says, and counted in delmesh_mesh_info:
 *  - polygons are cut into triangles (fan, or ear clipping where the fan would fold);
 *  - faces with a repeated or non-finite vertex, and second copies of a face, are left out;
 *  - inconsistently oriented faces are turned over, the fewer of each component;
 *  - edges with three and more faces are cut open and pinched vertices split; the copies of vertices come after the input's.
 * Zero-area faces are kept (remesh deals with them, certify reports them).
 * Errors: INVALID_ARGUMENT, UNSUPPORTED, INDEX_OUT_OF_RANGE, TOO_LARGE, NON_ORIENTABLE, STRICT, memory, CANCELLED.
 * O(n) for manifold input, O(n log n) otherwise; about 60 bytes per triangle while it runs, 30 after. */
DELMESH_API int32_t delmesh_mesh_create(delmesh_context* context, const delmesh_mesh_desc* desc, delmesh_mesh** out);
/* Gives the mesh and all that was borrowed from it back to the allocator. Any thread, once no other uses it. NULL is fine. */
DELMESH_API void delmesh_mesh_destroy(delmesh_mesh* mesh);

typedef struct delmesh_mesh_info {
    uint32_t struct_size;
    int32_t precision; /* DELMESH_FLOAT32 or DELMESH_FLOAT64 */
    int64_t vertices, faces, edges, corners;
    int64_t boundary_edges;
    int64_t isolated_vertices;    /* used by no face */
    int64_t components;           /* connected through edges, of faces */
    int64_t boundary_loops;
    int64_t euler_characteristic; /* used vertices - edges + faces */
    /* What mesh_create repaired (0 for meshes made by other functions). */
    int64_t polygons;                /* faces as given, before triangulation */
    int64_t welded_vertices;         /* vertices that another one stands in for */
    int64_t degenerate_faces;        /* triangles left out: a vertex twice, or fewer than three corners */
    int64_t duplicate_faces;         /* triangles left out: the same three vertices, the same way round */
    int64_t non_finite_faces;        /* triangles left out: a NaN or infinite coordinate */
    int64_t reoriented_faces;        /* triangles turned over */
    int64_t nonmanifold_edges;       /* edges cut open */
    int64_t nonmanifold_vertices;    /* vertices split */
    int64_t copied_vertices;         /* vertices appended by cutting and splitting */
    int64_t unmatched_marked_edges;  /* marked edges that are no edge of the mesh */
} delmesh_mesh_info;

DELMESH_API void delmesh_mesh_info_init(delmesh_mesh_info* info, uint32_t struct_size);
/* Counts of a mesh. info->struct_size must be set. O(1). Errors: INVALID_ARGUMENT. */
DELMESH_API int32_t delmesh_mesh_get_info(const delmesh_mesh* mesh, delmesh_mesh_info* info);

/* How many interior edges have a border of the layer with that number in mesh_create, or in cage_create, kept or not. O(1).
 * Errors: INVALID_ARGUMENT (also for meshes that neither mesh_create nor subdivide made). */
DELMESH_API int32_t delmesh_mesh_layer_borders(const delmesh_mesh* mesh, int32_t layer, int64_t* edges);

/* Arrays of a mesh. V vertices, F triangles, 3 F corners, E edges. Corner 3 f + k is the k-th of face f; "its" edge goes from
 * its vertex to that of the next corner. "Source" is the mesh that the operation was given (for mesh_create: the caller's
 * arrays); copies that mesh_create appended count as the vertex they copy. */
enum {
    DELMESH_POSITION = 1,       /* V x 3 float32 or float64: the mesh's precision (a float64 mesh read as float32 is rounded) */
    DELMESH_CORNER_VERT = 2,    /* 3F x 1, or F x 3: vertex of each corner */
    DELMESH_EDGE_VERT = 3,      /* E x 2: the vertices of each unique edge, in the order of its first corner */
    DELMESH_CORNER_EDGE = 4,    /* 3F x 1, or F x 3: edge from the corner to the next */
    DELMESH_FACE_SOURCE = 5,    /* F: source polygon */
    DELMESH_VERT_SOURCE = 6,    /* V: source vertex; -1 for a vertex made by a split */
    DELMESH_VERT_JOIN = 7,      /* V: the vertex to which this one must be joined to undo the cutting; itself if none */
    DELMESH_EDGE_FLAGS = 8,     /* E, int32: DELMESH_EDGE_*; read as uint8 only where no flag is above 128 (else TOO_LARGE) */
    DELMESH_VERT_MAP_VERT = 9,  /* V x 3: three source vertices ... */
    DELMESH_VERT_MAP_WEIGHT = 10, /* V x 3 float64: ... and weights (sum 1) where the vertex lies; a source vertex: (i,i,i)
                                   (1,0,0) */
    DELMESH_CORNER_TWIN = 11,   /* 3F x 1, or F x 3: the corner of the same edge in the neighbouring face, -1 on the boundary */
    DELMESH_VERT_PARENT = 12,   /* V: of a level of delmesh_lod_family: the vertex of the next coarser level that this one went
                                   into, -1 if it was pruned; the coarsest level's, and other meshes', are themselves */
    /* Only of meshes from mesh_create, and of results that were made with the option `map`: */
    DELMESH_CORNER_MAP_CORNER = 13, /* 3F x 3: three corners of the source, as the caller numbers them ... */
    DELMESH_CORNER_MAP_WEIGHT = 14, /* 3F x 3 float64: ... and weights (sum 1), where the corner lies, on its own side of every
                                       seam */
    DELMESH_EDGE_SOURCE_EDGE = 15,  /* E: the source edge that the edge is a piece of (the number in edge_verts if the caller gave
                                       these, else in the source's EDGE_VERT), -1: none */
    /* Only of meshes from delmesh_subdivide, and of results that were made from these with the option `map`: */
    DELMESH_CORNER_CAGE_FACE = 16,  /* 3F x 1: the face of the cage that the corner lies on ... */
    DELMESH_CORNER_CAGE_PLACE = 17, /* 3F x 2 float32: ... and where on it (see Subdivide), on its own side of every seam, crease */
    DELMESH_VERT_CAGE_FACE = 18,    /* V x 1: those of the vertex's first corner; of a vertex that no face uses -1 ... */
    DELMESH_VERT_CAGE_PLACE = 19,   /* V x 2 float32: ... and (0, 0) */
    DELMESH_FACE_CAGE_FACE = 20     /* F: the face of the cage whose material, face set... the face has */
};

enum {
    DELMESH_EDGE_BOUNDARY = 1, /* one face */
    DELMESH_EDGE_MARKED = 2,   /* a piece of an edge that the caller marked */
    DELMESH_EDGE_FEATURE = 4,  /* a piece of an input edge sharper than feature_angle, in feature mode */
    DELMESH_EDGE_CUT = 8,      /* boundary made by cutting a non-manifold edge */
    DELMESH_EDGE_SOURCE = 16,  /* a piece of an edge of the source */
    DELMESH_EDGE_SHARP = 32,   /* pieces of edges with these edge_marks */
    DELMESH_EDGE_SEAM = 64,
    DELMESH_EDGE_CREASE = 128,
    DELMESH_EDGE_UV = 256,     /* of kept borders of layers, by kind */
    DELMESH_EDGE_NORMAL = 512,
    DELMESH_EDGE_COLOR = 1024,
    DELMESH_EDGE_LAYER = 2048, /* DELMESH_LAYER_OTHER */
    DELMESH_EDGE_MATERIAL = 4096,
    DELMESH_EDGE_FACE_SET = 8192
};

/* Writes one of the arrays above into the caller's memory, converting between the integer types (or the float types) and
 * honouring the stride. dst->count and components must fit the array. Errors: INVALID_ARGUMENT, TOO_LARGE (an index does not
 * fit the type). O(n), no allocation. Any thread. */
DELMESH_API int32_t delmesh_mesh_read(const delmesh_mesh* mesh, int32_t what, const delmesh_view_mut* dst);
/* Points *out at the mesh's own array, as it is stored: valid until the mesh is destroyed. Arrays that are derived are made at
 * the first borrow and kept; O(n) then, else O(1). Errors: INVALID_ARGUMENT, memory. Any thread. */
DELMESH_API int32_t delmesh_mesh_borrow(const delmesh_mesh* mesh, int32_t what, delmesh_view* out);
/* Checks every invariant of the data structure; for tests and bug reports. DELMESH_ERROR_INTERNAL names the first that does not
 * hold. Other errors: INVALID_ARGUMENT, memory, CANCELLED. O(n). */
DELMESH_API int32_t delmesh_mesh_validate(delmesh_context* context, const delmesh_mesh* mesh);

/* ---- Remesh --------------------------------------------------------------------------------------------------------------- */

enum {
    DELMESH_MODE_PRESERVE = 0, /* the surface stays: vertices are added on edges, flips happen inside flat places only */
    DELMESH_MODE_FLIP = 1,     /* edges are flipped; vertices are added only on edges that cannot be flipped */
    DELMESH_MODE_FEATURE = 2   /* flip, but edges sharper than feature_angle stay */
};
enum { DELMESH_PLACEMENT_INTERVAL = 0, DELMESH_PLACEMENT_SHELLS = 1 };
enum { DELMESH_BOUNDARY_NONOBTUSE = 0, DELMESH_BOUNDARY_IGNORE = 1 };

typedef struct delmesh_remesh_options {
    uint32_t struct_size;
    int32_t mode;          /* DELMESH_MODE_PRESERVE */
    int32_t placement;     /* where edges are split: DELMESH_PLACEMENT_INTERVAL (fewest), or the paper's concentric shells */
    int32_t boundary;      /* DELMESH_BOUNDARY_NONOBTUSE: angles opposite to boundary edges are at most 90; or not looked at */
    int32_t precision;     /* of the result: DELMESH_FLOAT32 (default) or DELMESH_FLOAT64 */
    int32_t strict;        /* 1: refuse input whose faces have zero area at the output precision, instead of repairing it */
    int32_t compact;       /* 1: leave out vertices that no face uses. Default 0: vertex i stays vertex i */
    int32_t effort;        /* preserve: 0: the plain rule; 1 (default): look-ahead, and vertices that turn out needless are taken
                              out; N > 1: 4^(N-1) rounds of search for ways to need fewer; the same bytes for the same N */
    double feature_angle;  /* degrees between the normals of the faces, 0 is flat; feature mode keeps what is sharper. 30 */
    /* flip and feature: degrees by which a flip may turn a normal; edges whose flip would turn more are split. < 0: any
       (default) */
    double max_normal_turn;
    double shell_unit;     /* radius of a shell, in model units; <= 0 (default): 1/1024 of the bounding box's diagonal */
    double tolerance;      /* preserve: how far the surface may move, in model units; 0: exact planarity only, so that only the
                              rounding of new vertices moves it; < 0 (default): 4 units in the last place of the largest
                              coordinate at the output precision, and up to 64 where the precision has no room for the vertices
                              that this would need (surface_bound tells; clean meshes do not come to it) */
    int64_t max_vertices;  /* of the result; 0 (default): 16 x the input's + 10,000 */
    int64_t split_budget;  /* flip, feature: after so many splits of unflippable edges, bent edges are no longer flipped;
                              0 (default): V / 50 + 200 */
    int32_t map;           /* 1: the result has DELMESH_CORNER_MAP_* and DELMESH_EDGE_SOURCE_EDGE. Default 0 */
    uint32_t release;      /* DELMESH_EDGE_MARKED, _SHARP ... _FACE_SET, added: edges that have no other of these bits are not
                              kept */
} delmesh_remesh_options;

DELMESH_API void delmesh_remesh_options_init(delmesh_remesh_options* options, uint32_t struct_size);

typedef struct delmesh_remesh_report {
    uint32_t struct_size;
    int32_t certified;  /* 1: an exact test of the returned coordinates found no NLD edge and no zero-area face */
    int64_t vertices_in, vertices_out, faces_in, faces_out;
    int64_t nld_in;     /* edges not locally Delaunay at the start, at the output precision, boundary rule included */
    int64_t nld_out;    /* ... in the result: 0 whenever the status is OK */
    int64_t flips;      /* before the first split */
    int64_t flips_after;
    int64_t splits;     /* vertices added; copies on the other sheets of a cut edge count */
    int64_t unflippable;                /* NLD edges whose opposing edge existed when they were looked at, and of these: */
    /* 2-, 3-, 4-exposed (how many of the four faces of the flip's tetrahedron exist) */
    int64_t unflippable_2, unflippable_3, unflippable_4;
    int64_t guarded;                    /* flips refused by max_normal_turn or because a face would have had zero area */
    int64_t boundary_splits, kept_splits; /* splits of boundary and of kept edges */
    /* Repairs at the output precision. */
    int64_t collapsed_edges;            /* edges of zero length collapsed */
    int64_t removed_zero_area_faces;    /* caps flipped away and folded ears removed */
    int64_t moved_within_tolerance;     /* preserve: flips that moved the surface, within the tolerance */
    double surface_bound;               /* preserve: bound on the two-sided distance to the input as rounded to the output
                                           precision, proven up to the rounding of float64 arithmetic; else < 0 */
    /* seconds_flip: the loop of flips and splits where it made no split; else seconds_split has all of it */
    double seconds_total, seconds_repair, seconds_flip, seconds_split, seconds_certify;
    uint64_t peak_bytes;                /* of the context's allocator, during this call */
    int32_t topology_kept;              /* 1: components, boundary loops and Euler characteristic are the input's; 0: a repair
                                           of what is smaller than the precision cut or removed something (counted above) */
    int32_t worst_face;                 /* the source face with the most split vertices on its edges; -1: none (see below) */
    /* Where the vertices went. Every split counts once, for the first of these that holds: the sum is `splits`. Edges and angles
     * are the input's. */
    int64_t split_on_boundary;
    int64_t split_on_kept;         /* on marked and feature edges */
    int64_t split_crowded;         /* within 64 units in the last place of a neighbour in the result */
    int64_t split_on_caps;         /* on an edge opposite to an angle over 150 degrees */
    int64_t split_at_small_angles; /* on an edge that meets another one of its faces' at less than 15 degrees: needles */
    int64_t split_on_flipped;      /* on edges that flips made */
    int64_t split_elsewhere;
    int64_t split_merged;          /* gone again: merged where the precision had no room (less the copies that cuts made there) */
    /* The source edge and the source face whose edges got the most; -1 and 0 where there is none. */
    int32_t worst_edge_from, worst_edge_to;
    int64_t worst_edge_splits, worst_face_splits;
} delmesh_remesh_report;

DELMESH_API void delmesh_remesh_report_init(delmesh_remesh_report* report, uint32_t struct_size);

/* Makes a Delaunay mesh: no interior edge whose opposite angles sum to more than 180, no boundary edge opposite to more than 90
 * degrees (unless ignored), no face of zero area, decided exactly on the coordinates that are returned, with the topology of
 * the input (unless something smaller than the precision had to be cut: topology_kept). Ties count as Delaunay. Input vertex i is
 * output vertex i, bit for bit at the output precision.
 * options: NULL for the defaults; report: may be NULL, is filled also after an error, as far as the call got.
 * Errors: INVALID_ARGUMENT, NO_SURFACE, STRICT, VERTEX_LIMIT, PRECISION, TOO_LARGE, UNSUPPORTED, memory, CANCELLED.
 * O(n log n) in practice. Method: Dyer, Zhang, Moeller 2007 (Algorithms 1 and 2); split points after Liu, Xu, Fan, He 2015. */
DELMESH_API int32_t delmesh_remesh(delmesh_context* context, const delmesh_mesh* in, const delmesh_remesh_options* options,
                                   delmesh_mesh** out, delmesh_remesh_report* report);

/* ---- Estimate ------------------------------------------------------------------------------------------------------------- */

typedef struct delmesh_preserve_estimate {
    uint32_t struct_size;
    int32_t exact;         /* 1: the mesh was small enough to be remeshed, and these are the numbers; 0: a sample of it was */
    /* DELMESH_OK, or the error that delmesh_remesh is to be expected to end with: PRECISION, VERTEX_LIMIT, TOO_LARGE. Where that
     * stopped the run, vertices_out is how far it came. */
    int32_t outcome;
    int32_t reserved0;
    int64_t vertices_in, vertices_out;
    double growth;         /* vertices_out / vertices_in */
    double deviation;      /* standard deviation of vertices_out, from how the places of the sample differ; 0 if exact */
    int64_t nld_edges;     /* edges not locally Delaunay, at the output precision */
    int64_t sampled_edges; /* of them, those whose vertices were counted */
    int64_t faces_run;     /* faces that were remeshed for it */
    double seconds;
    uint64_t peak_bytes;   /* of the context's allocator, during this call */
} delmesh_preserve_estimate;

DELMESH_API void delmesh_preserve_estimate_init(delmesh_preserve_estimate* estimate, uint32_t struct_size);

/* Foretells how many vertices delmesh_remesh would return in preserve mode, whatever the mode in `options` (NULL: the defaults);
 * an `effort` over 1 counts as 1. Up to 50,000 faces it runs, without a result; larger meshes in a sample of places, which
 * takes the time of a look at every edge and of remeshing that sample. What delmesh_remesh would end
 * with is the `outcome`, not an error. Errors: INVALID_ARGUMENT, UNSUPPORTED, NO_SURFACE, memory, CANCELLED. */
DELMESH_API int32_t delmesh_estimate_preserve(delmesh_context* context, const delmesh_mesh* in,
                                              const delmesh_remesh_options* options, delmesh_preserve_estimate* out);

/* ---- Decimate ------------------------------------------------------------------------------------------------------------- */

/* How far a level goes. */
enum {
    DELMESH_TARGET_FULL = 0,     /* nothing is taken away: the Delaunay mesh that decimation begins with */
    DELMESH_TARGET_VERTICES = 1, /* at most so many vertices */
    DELMESH_TARGET_FACES = 2,    /* at most so many triangles */
    DELMESH_TARGET_RATIO = 3,    /* at most this share of the input's triangles, 0..1 */
    DELMESH_TARGET_DEVIATION = 4 /* as few as can be while no point of either surface is farther than this from the other, in
                                    model units: proven, against the input as given */
};
/* 16 bytes, frozen. */
typedef struct delmesh_target {
    int32_t kind;
    int32_t reserved0;
    double value;
} delmesh_target;

enum { DELMESH_COLLAPSE_ALL = 0, DELMESH_COLLAPSE_PAPER = 1, DELMESH_COLLAPSE_ENDPOINTS = 2 };

/* Why a level ended where it did. Where several reasons refused collapses, the one that refused most. A deviation target ends with
 * TARGET where the deviation is kept and spent, and with BOUND only where making the mesh Delaunay, or a level before, had spent it
 * already: the level is then the Delaunay mesh, or the level before once more, and its `bound` the larger distance that is
 * proven. */
enum {
    DELMESH_STOPPED_BY_TARGET = 0,   /* the target was reached; a deviation: no collapse was left that keeps it */
    DELMESH_STOPPED_BY_TOPOLOGY = 1, /* any further collapse would change components, boundary loops or genus */
    DELMESH_STOPPED_BY_DELAUNAY = 2, /* ... or leave an edge that is not Delaunay and may not be flipped, or a fold */
    DELMESH_STOPPED_BY_FEATURES = 3, /* ... or move what stays: corners, features, boundaries, locked vertices, the region's border;
                                      * or the rest would have to pay for features that cannot get coarser */
    DELMESH_STOPPED_BY_BOUND = 4     /* the deviation had been exceeded before the first collapse */
};

typedef struct delmesh_decimate_options {
    uint32_t struct_size;
    int32_t prepare;            /* how the input becomes Delaunay: DELMESH_MODE_FLIP (default), _FEATURE or _PRESERVE */
    int32_t boundary;           /* as for delmesh_remesh, as are precision, strict, feature_angle, tolerance */
    int32_t precision;          /* DELMESH_FLOAT32 */
    int32_t strict;
    /* Where the vertex goes that two become: DELMESH_COLLAPSE_ALL (default): what costs least of the quadrics' optimum, the best
     * place in the paper's allowable region, the ends and the middle, with flips where none of these is Delaunay as it is;
     * _PAPER: the allowable region alone; _ENDPOINTS: one of the two ends, with flips */
    int32_t collapse_placement;
    int32_t quality;            /* sweeps of relaxation over each level: vertices move to where the level fits the input better.
                                   0 (default): none; 6 is most of what there is to gain */
    int32_t reserved0;
    double feature_angle;       /* prepare = feature: edges sharper than this are kept. 30 */
    double tolerance;           /* prepare = preserve. < 0 (default): the rounding of the output */
    double max_normal_turn;     /* degrees by which a collapse or one of its flips may turn a normal, 0..90: the fold-over limit.
                                   78 */
    double boundary_weight;     /* of the quadrics of boundary and kept edges, against those of faces. 1 */
    double prune;               /* components whose bounding box has a smaller diagonal go away before the first level that is not
                                   full or a deviation's; the largest stays, and what is locked, cut or outside; 0 (default):
                                   none */
    delmesh_view vert_weights;  /* optional, V x 1 float32 or float64, > 0: scales the error around each source vertex */
    delmesh_view locked_verts;  /* optional, V x 1 uint8 or int32: where not 0, the source vertex stays where it is */
    delmesh_view face_mask;     /* optional, one uint8 or int32 per source polygon: faces with 0 stay as they are, their edges too,
                                   Delaunay or not; what is NLD there is counted in nld_outside */
    int32_t map;                /* as for delmesh_remesh, as is release */
    uint32_t release;
} delmesh_decimate_options;

DELMESH_API void delmesh_decimate_options_init(delmesh_decimate_options* options, uint32_t struct_size);

typedef struct delmesh_level_report {
    uint32_t struct_size;
    int32_t certified;  /* 1: an exact test of the returned coordinates found no NLD edge (but outside of face_mask) and no
                           zero-area face */
    int32_t stopped_by; /* DELMESH_STOPPED_BY_* */
    int32_t reserved0;
    int64_t vertices, faces;
    int64_t nld_outside;    /* edges of faces outside of face_mask, and on their border, that are NLD: those that delmesh_certify
                               lists on the level, by the same boundary rule */
    int64_t pruned_components;
    int64_t relaxed_vertices; /* moved by relaxation */
    double bound;           /* deviation targets: the distance that is proven to be kept, model units: the target's, or where
                               stopped_by is BOUND a larger one; else < 0 */
    double seconds;         /* since the level before was done */
} delmesh_level_report;

DELMESH_API void delmesh_level_report_init(delmesh_level_report* report, uint32_t struct_size);

typedef struct delmesh_decimate_report {
    uint32_t struct_size;
    int32_t reserved0;
    int64_t vertices_in, faces_in;
    int64_t collapses, flips;    /* that stayed */
    int64_t undone;              /* collapses taken back because of the flips that they needed, or the bound */
    double seconds_total, seconds_prepare, seconds_decimate, seconds_relax, seconds_export; /* export: with map and certificate */
    uint64_t peak_bytes;         /* of the context's allocator, during this call */
    /* What making the input Delaunay did: edges that were not, flips, vertices added; prepare = preserve: how far it moved the
     * surface at most (surface_bound of delmesh_remesh_report), else < 0. */
    int64_t prepare_nld, prepare_flips, prepare_splits;
    double prepare_bound;
    int32_t topology_kept;       /* 1: that left the input's topology as it was, as in delmesh_remesh_report */
    int32_t reserved1;
} delmesh_decimate_report;

DELMESH_API void delmesh_decimate_report_init(delmesh_decimate_report* report, uint32_t struct_size);

/* Decimates by edge collapses to each of `count` targets (1..64) in one run, finest first: out[i] is the level of targets[i], made
 * from the one before. Every level is Delaunay as delmesh_remesh promises it, with the topology of the input; an unreachable target
 * is no error: stopped_by says why. A level that its predecessor satisfies already is that once more.
 * Levels leave out vertices that no face uses; DELMESH_VERT_SOURCE is the source vertex that a vertex is, bit for bit, or -1;
 * DELMESH_VERT_MAP_* where on the source it lies (a close point, found from the faces around the source vertices that went into
 * it); DELMESH_FACE_SOURCE a source polygon close to the face; DELMESH_VERT_PARENT the vertex of the next coarser level it went
 * into. A first level of DELMESH_TARGET_FULL is what delmesh_remesh makes with `compact`, with all that it says of the source.
 * options, report: may be NULL; levels: NULL, or `count` of them, each with struct_size set.
 * After an error or a cancel all of out[] is NULL. Errors: INVALID_ARGUMENT (also a target of a finer kind than its predecessor's
 * where both count the same), and those of delmesh_remesh.
 * O(n log n) in practice; about 250 bytes per triangle, 500 with a deviation or relaxation. Method: Garland and Heckbert 1997;
 * Lindstrom and Turk 1998 (volume); the allowable regions of Dyer, Zhang, Moeller 2007, section 5. docs/decimate.md. */
DELMESH_API int32_t delmesh_lod_family(delmesh_context* context, const delmesh_mesh* in, const delmesh_target* targets,
                                       int32_t count, const delmesh_decimate_options* options, delmesh_mesh** out,
                                       delmesh_level_report* levels, delmesh_decimate_report* report);
/* The same for one target. */
DELMESH_API int32_t delmesh_decimate(delmesh_context* context, const delmesh_mesh* in, const delmesh_target* target,
                                     const delmesh_decimate_options* options, delmesh_mesh** out, delmesh_level_report* level,
                                     delmesh_decimate_report* report);

/* ---- Transfer ------------------------------------------------------------------------------------------------------------- */

enum { DELMESH_DOMAIN_VERTEX = 0, DELMESH_DOMAIN_CORNER = 1, DELMESH_DOMAIN_FACE = 2, DELMESH_DOMAIN_EDGE = 3 };
enum {
    DELMESH_TRANSFER_LINEAR = 0,    /* weighted sums; integers are rounded, and kept in their type's range */
    DELMESH_TRANSFER_NEAREST = 1,   /* the value of the largest weight, bit for bit: ids, names, flags */
    DELMESH_TRANSFER_DIRECTION = 2, /* weighted sums, of length 1; floats. Where the sum is 0 it stays so */
    DELMESH_TRANSFER_WEIGHTS = 3    /* weighted sums of the components as far as they are positive, made to sum to 1; floats */
};

/* Carries a layer of the source over to `mesh`, which was made from it: vertex layers through DELMESH_VERT_MAP_*, corner layers
 * through DELMESH_CORNER_MAP_*, face layers through DELMESH_FACE_SOURCE, edge layers through DELMESH_EDGE_SOURCE_EDGE (0 where
 * there is no source edge). source: one element per element of the source as the caller gave it (vertices, corners, polygons,
 * edges); target: one per vertex, corner, face or edge of `mesh`; the same type (float32, float64, int32, uint32, int64 or uint8)
 * and number of components (1..256), any strides, not overlapping. Faces and edges have one source each: all policies copy it,
 * then normalise. Corner and edge layers need a `mesh` that has those maps. Elements of weight 0 do not count, whatever they hold;
 * sums stay between what they were made of (int64 as float64: beyond 2^53 they are rounded); of equal weights the first is the
 * largest; what has length 1 or sums to 1 but for rounding stays as it is. O(n), parallel, allocates nothing.
 * Errors: INVALID_ARGUMENT, CANCELLED (target is then partly written). */
DELMESH_API int32_t delmesh_transfer(delmesh_context* context, const delmesh_mesh* mesh, int32_t domain, int32_t policy,
                                     const delmesh_view* source, const delmesh_view_mut* target);

/* The same for a layer that is to fit all over the surface and not only at the vertices: vertex or corner layers,
 * DELMESH_TRANSFER_LINEAR or _DIRECTION. What is interpolated on the faces of `mesh` comes as close as it can, in the mean of
 * squares, to what the source has at the closest points of the same chart. in: the source, of which `mesh` was made with `map`.
 * Where delmesh_transfer gives several values around a vertex (at the layer's borders), and on boundaries, they stay as that gives
 * them, as do those that are not finite. With LINEAR no component leaves the range that it has in the layer. Nothing changes, but
 * for rounding, where interpolation is exact already. 9 to 256 points per face, by how much smaller `mesh` is than `in`, each in
 * less than a microsecond; parallel, the same bytes for any number of threads; 48 bytes per face and 32 per face and component
 * meanwhile. Errors: INVALID_ARGUMENT (also an `in` with other counts than the source), memory, CANCELLED (target is then partly
 * written). docs/attributes.md. */
DELMESH_API int32_t delmesh_transfer_fitted(delmesh_context* context, const delmesh_mesh* in, const delmesh_mesh* mesh,
                                            int32_t domain, int32_t policy, const delmesh_view* source,
                                            const delmesh_view_mut* target);

/* Sparse vertex layers (an armature's weights): row v of the source has the entries indices[k], values[k] for k from offsets[v] to
 * offsets[v + 1]. */
typedef struct delmesh_rows {
    delmesh_view offsets; /* V + 1 int32, uint32 or int64, ascending from 0 */
    delmesh_view indices; /* int32, uint32 or int64, >= 0 */
    delmesh_view values;  /* float32 or float64, as many */
} delmesh_rows;
typedef struct delmesh_rows_mut {
    delmesh_view_mut offsets;
    delmesh_view_mut indices; /* with room for V x limit entries, or for as many as the last offset of a first call said; */
    delmesh_view_mut values;  /* both all zero: only the offsets are written */
} delmesh_rows_mut;

/* Weighted sums of the rows, entries of one index added up, ascending by index; of more than `limit` (1..65535) the largest in
 * magnitude are kept, of equal ones those of the lower index. Entries that are 0 are left out. normalise: 1: every row sums to 1,
 * but for those whose sum is 0; 2: to what its whole sum was, before the limit; 0: as they are. O(n log n), parallel; 16 bytes per
 * source entry. Errors: INVALID_ARGUMENT (also a value that is NaN or infinite), INDEX_OUT_OF_RANGE, TOO_LARGE (no room, or a
 * number that does not fit target's type), memory: nothing was written then; CANCELLED (target is then partly written). */
DELMESH_API int32_t delmesh_transfer_sparse(delmesh_context* context, const delmesh_mesh* mesh, const delmesh_rows* source,
                                            int32_t limit, int32_t normalise, const delmesh_rows_mut* target);

/* ---- Subdivide ------------------------------------------------------------------------------------------------------------ */

/* A cage is a polygon mesh that stands for the smooth surface which subdividing it for ever would lead to, its limit surface
 * (docs/subdivide.md). Evaluation is OpenSubdiv's; a library that was built without it answers UNSUPPORTED.
 *
 * A place on a face of a cage is two numbers. On quads, and on triangles of the Loop scheme, they are OpenSubdiv's (s, t): corners
 * at (0,0) (1,0) (1,1) (0,1), of triangles (0,0) (1,0) (0,1). On other polygons, n-gons, they are a point of the regular n-gon with
 * corner i at (cos 2 pi i / n, sin 2 pi i / n). Places between places of one face are on the face. */
enum { DELMESH_SCHEME_CATMULL_CLARK = 0, DELMESH_SCHEME_LOOP = 1, DELMESH_SCHEME_BILINEAR = 2 };
/* What becomes of the cage's boundary. _AND_CORNER: boundary edges are sharp, and so are vertices of one face; _EDGE: edges only;
 * _NONE: faces at the boundary have no limit surface and are left out. */
enum { DELMESH_CAGE_BOUNDARY_EDGE_AND_CORNER = 0, DELMESH_CAGE_BOUNDARY_EDGE = 1, DELMESH_CAGE_BOUNDARY_NONE = 2 };
/* Where face-varying layers (UV maps) are linear instead of smooth, OpenSubdiv's FVarLinearInterpolation: on the boundaries of
 * their islands; nowhere; at their corners; also at ... (1 and 2); everywhere. */
enum {
    DELMESH_FACE_VARYING_BOUNDARIES = 0,
    DELMESH_FACE_VARYING_NONE = 1,
    DELMESH_FACE_VARYING_CORNERS_ONLY = 2,
    DELMESH_FACE_VARYING_CORNERS_PLUS1 = 3,
    DELMESH_FACE_VARYING_CORNERS_PLUS2 = 4,
    DELMESH_FACE_VARYING_ALL = 5
};
enum { DELMESH_CREASING_UNIFORM = 0, DELMESH_CREASING_CHAIKIN = 1 };

typedef struct delmesh_cage_desc {
    uint32_t struct_size;
    int32_t scheme;           /* DELMESH_SCHEME_*; Loop takes triangles only */
    int32_t boundary;         /* DELMESH_CAGE_BOUNDARY_* */
    int32_t face_varying;     /* DELMESH_FACE_VARYING_* */
    int32_t creasing;         /* DELMESH_CREASING_*: how sharpness changes along a crease */
    int32_t smooth_triangles; /* 1: Catmull-Clark treats triangles so that they leave less of a bump. Default 0 */
    delmesh_view positions;   /* V x 3, float32 or float64, finite */
    /* Faces as in delmesh_mesh_desc, of 3 corners and more, none with a vertex twice. Edges may have any number of faces: where
     * more than two meet, and around pinched vertices, the surface is creased, and cut as delmesh_mesh_create would. */
    delmesh_view corner_verts;
    delmesh_view face_offsets;
    delmesh_view face_sizes;
    delmesh_view crease_edges;     /* optional, M x 2 vertex indices */
    delmesh_view crease_sharpness; /* M float32 or float64, >= 0: so many subdivisions an edge stays sharp; 10 and more: for ever */
    delmesh_view sharp_verts;      /* optional, N vertex indices */
    delmesh_view vert_sharpness;   /* N, in the same unit */
    delmesh_view holes;            /* optional, face indices: faces that shape the surface, and are left out of it */
    /* Optional, as in delmesh_mesh_desc: marks, which the pieces of an edge inherit. Creases have DELMESH_EDGE_CREASE anyway. */
    delmesh_view edge_verts;
    delmesh_view edge_marks;
    /* Optional, as in delmesh_mesh_desc. Layers at corners are face-varying: values at a vertex that are equal, or within their
     * `tolerance`, are one value */
    const delmesh_layer* layers;
    int32_t layer_count; /* 0..64 */
    int32_t reserved0;
} delmesh_cage_desc;

DELMESH_API void delmesh_cage_desc_init(delmesh_cage_desc* desc, uint32_t struct_size);

/* Copies and prepares a cage. It never changes once made: any thread may read it, and it may outlive its context.
 * Errors: INVALID_ARGUMENT, INDEX_OUT_OF_RANGE, NO_SURFACE (no face), TOO_LARGE (more than 65,535 corners of a face or at a
 * vertex), UNSUPPORTED, memory. O(n). Some 500 bytes per face, of which OpenSubdiv takes its part from the C++ runtime. */
DELMESH_API int32_t delmesh_cage_create(delmesh_context* context, const delmesh_cage_desc* desc, delmesh_cage** out);
DELMESH_API void delmesh_cage_destroy(delmesh_cage* cage); /* NULL is fine */

/* How fine. */
enum {
    DELMESH_FINENESS_RATE = 0,        /* so many pieces per edge of the cage, 1..4096 */
    DELMESH_FINENESS_EDGE_LENGTH = 1, /* the lowest rate that cuts every edge of the cage, as it lies on the limit surface, into
                                         pieces of at most this length on average */
    DELMESH_FINENESS_FACES = 2        /* the highest rate that makes at most so many triangles (1, if none does) */
};
/* DELMESH_EVALUATION_BFR: every point on its own, any rate. _FAR: OpenSubdiv's uniform refinement, then its limit: rates that are
 * powers of two from 2 on, memory outside of the context's limit, one thread; the cross-check. */
enum { DELMESH_EVALUATION_BFR = 0, DELMESH_EVALUATION_FAR = 1 };

typedef struct delmesh_subdivide_options {
    uint32_t struct_size;
    int32_t fineness;   /* DELMESH_FINENESS_RATE */
    double value;       /* of it. 8 */
    int32_t evaluation; /* DELMESH_EVALUATION_BFR */
    int32_t precision;  /* of the result: DELMESH_FLOAT32 (default) or DELMESH_FLOAT64 */
    int32_t measure;    /* 1: also limit_distance and limit_rms, which takes as long as the rest. Default 0 */
    int32_t reserved0;
} delmesh_subdivide_options;

DELMESH_API void delmesh_subdivide_options_init(delmesh_subdivide_options* options, uint32_t struct_size);

typedef struct delmesh_subdivide_report {
    uint32_t struct_size;
    int32_t rate;              /* that was taken */
    int64_t vertices, faces;
    int64_t left_out_faces;    /* of the cage: holes, and those without a limit surface */
    int64_t unmatched_creases; /* crease_edges that are no edge of a face */
    double longest_edge;       /* of the cage's edges on the limit surface, as found for _EDGE_LENGTH; else 0 */
    /* With `measure`, else < 0: the largest distance, and the root mean square, between points of the mesh and of the limit surface
     * that have the same place, at the middles of all edges and faces. The limit surface is from what is made of the mesh at most
     * that thing's distance to the mesh and this; but this is sampled, where delmesh_measure_distance proves a bound */
    double limit_distance, limit_rms;
    double seconds_total;
    uint64_t peak_bytes;       /* of the context's allocator, during this call */
} delmesh_subdivide_report;

DELMESH_API void delmesh_subdivide_report_init(delmesh_subdivide_report* report, uint32_t struct_size);

/* Triangles with their vertices on the limit surface, `rate` pieces per edge of the cage; watertight where the cage is: what
 * faces of the cage share is made once. Pieces of creased and marked edges, and of borders of layers, have their bits in
 * DELMESH_EDGE_FLAGS. DELMESH_FACE_SOURCE is the cage's face, so delmesh_transfer carries layers of faces over; for others:
 * delmesh_limit_values. The mesh's own source is itself. options: NULL for the defaults; report: may be NULL. Errors:
 * INVALID_ARGUMENT, TOO_LARGE, NO_SURFACE (every face is left out), NON_ORIENTABLE, memory, CANCELLED. O(n), parallel. */
DELMESH_API int32_t delmesh_subdivide(delmesh_context* context, const delmesh_cage* cage, const delmesh_subdivide_options* options,
                                      delmesh_mesh** out, delmesh_subdivide_report* report);

/* Values of the cage on its limit surface, at the places of `mesh`, which has these (DELMESH_CORNER_CAGE_*) on a cage with the
 * same faces. source: float32 or float64, 1..16 components; target: the same components, float32 or float64.
 * domain VERTEX: source has one element per vertex of the cage, and is smooth as its positions are (weights, colours, other
 * poses); target one per vertex of `mesh`, at DELMESH_VERT_CAGE_*. layer: -1.
 * domain CORNER: source has one element per corner of the cage, for the face-varying `layer` of that number; target one per
 * corner of `mesh`. Corners that are one value in the layer have that of the first of them. source may be NULL: the layer's own.
 * Errors: INVALID_ARGUMENT, memory, CANCELLED (target is then partly written). O(n), parallel. */
DELMESH_API int32_t delmesh_limit_values(delmesh_context* context, const delmesh_cage* cage, const delmesh_mesh* mesh,
                                         int32_t domain, int32_t layer, const delmesh_view* source,
                                         const delmesh_view_mut* target);
/* Unit normals of the limit surface at the corners of `mesh`, 3F x 3; (0, 0, 0) where it has none. positions: V x 3 of the cage, in
 * another pose; NULL: those it was made with. Otherwise as delmesh_limit_values. */
DELMESH_API int32_t delmesh_limit_normals(delmesh_context* context, const delmesh_cage* cage, const delmesh_mesh* mesh,
                                          const delmesh_view* positions, const delmesh_view_mut* target);

typedef struct delmesh_reevaluate_report {
    uint32_t struct_size;
    int32_t delaunay;          /* 1: the mesh is Delaunay in the new pose, too; what is not is counted below */
    int64_t nld_interior, nld_boundary, zero_area_faces;
    int64_t moved_vertices;    /* whose coordinates are others than before */
    double largest_offset;     /* from a vertex to its place on the limit surface, in the rest pose */
    double seconds_total;
    uint64_t peak_bytes;       /* of the context's allocator, during this call */
} delmesh_reevaluate_report;

DELMESH_API void delmesh_reevaluate_report_init(delmesh_reevaluate_report* report, uint32_t struct_size);

/* `mesh`, subdivided from `cage` or made from that with `map`, in another pose of the cage: positions V x 3, float32 or float64,
 * for the vertices that the cage was made with. Vertices and faces, marks and maps stay as they are; every vertex goes with its
 * place on the limit surface, and keeps its offset from it in the frame of the surface there. In the pose that the cage was made
 * with, the result is `mesh` bit for bit; so it is where the surface has not moved. report: may be NULL; without it the result
 * is not certified, which takes part of the time. All but positions (12 or 24 bytes per vertex) the two share, unless they are of
 * two contexts and that of `mesh` has an allocator of the host's. They may be destroyed in any order; the memory of `mesh`, with its
 * positions, goes back with the last of them.
 * Errors: INVALID_ARGUMENT, memory, CANCELLED. O(n), parallel. */
DELMESH_API int32_t delmesh_reevaluate(delmesh_context* context, const delmesh_cage* cage, const delmesh_mesh* mesh,
                                       const delmesh_view* positions, delmesh_mesh** out, delmesh_reevaluate_report* report);

/* ---- Certify -------------------------------------------------------------------------------------------------------------- */

typedef struct delmesh_certify_options {
    uint32_t struct_size;
    int32_t boundary;                 /* DELMESH_BOUNDARY_NONOBTUSE (default) or _IGNORE */
    delmesh_view_mut nld_edges;       /* optional, n x 2 int32/uint32/int64: the first n offending edges as vertex pairs */
    delmesh_view_mut zero_area_faces; /* optional, n x 1: the first n faces of zero area */
} delmesh_certify_options;

DELMESH_API void delmesh_certify_options_init(delmesh_certify_options* options, uint32_t struct_size);

typedef struct delmesh_certify_report {
    uint32_t struct_size;
    int32_t delaunay; /* 1: nothing below is counted (boundary edges only when the rule asks for them) */
    int64_t nld_interior, nld_boundary, zero_area_faces;
    int64_t exact_tests; /* how many signs needed the exact path */
    double seconds;
} delmesh_certify_report;

DELMESH_API void delmesh_certify_report_init(delmesh_certify_report* report, uint32_t struct_size);

/* Decides exactly, on the mesh's own coordinates, whether it is Delaunay. DELMESH_OK whatever the answer is. O(n), parallel.
 * options: NULL for the defaults; report: may be NULL. The lists of `options` are written after success only.
 * Errors: INVALID_ARGUMENT, UNSUPPORTED, memory, CANCELLED. */
DELMESH_API int32_t delmesh_certify(delmesh_context* context, const delmesh_mesh* mesh, const delmesh_certify_options* options,
                                    delmesh_certify_report* report);

/* ---- Measure -------------------------------------------------------------------------------------------------------------- */

typedef struct delmesh_quality_report {
    uint32_t struct_size;
    int32_t reserved0;
    double area, diagonal;                /* of the used vertices' bounding box */
    double min_angle, max_angle;          /* degrees, over all corners of faces with area */
    double mean_min_angle;                /* mean over faces of the smallest angle */
    double percent_below_30, percent_above_120; /* percent of all corner angles */
    double min_edge, max_edge, mean_edge;
    int64_t negative_cotangents;          /* edges whose cotangent weight is negative: the interior NLD edges */
    int64_t max_valence;
    int64_t angle_histogram[18];          /* corner angles by ten degrees */
} delmesh_quality_report;

DELMESH_API void delmesh_quality_report_init(delmesh_quality_report* report, uint32_t struct_size);
/* Angle statistics, lengths, area; all 0 for a mesh without faces. O(n). Errors: INVALID_ARGUMENT, memory, CANCELLED. */
DELMESH_API int32_t delmesh_measure_quality(delmesh_context* context, const delmesh_mesh* mesh, delmesh_quality_report* report);

typedef struct delmesh_distance_options {
    uint32_t struct_size;
    int32_t compute_bound;  /* 1 (default): also the guaranteed bound; 0: samples only */
    /* per direction, spread by area, besides vertices and edge midpoints; 0 (default): 4 per triangle, at least 100,000 */
    int64_t samples;
    double relative_error;  /* the bound ends at (1 + this) x the sampled value + absolute_error. 0.1 */
    double absolute_error;  /* in percent of the first mesh's diagonal, at least 1e-9. 1e-4 (1e-6 of the diagonal) */
} delmesh_distance_options;

DELMESH_API void delmesh_distance_options_init(delmesh_distance_options* options, uint32_t struct_size);

typedef struct delmesh_distance_report {
    uint32_t struct_size;
    int32_t reserved0;
    double diagonal;             /* of the first mesh */
    double hausdorff_sampled;    /* the larger of the two directions, with compute_bound also over what the search met beyond the
                                    samples; below the true distance but for rounding (on slivers, 1e-8 of their length) */
    double hausdorff_bound;      /* guaranteed upper bound (two-sided); < 0 if not computed */
    double rms;                  /* the larger of the two directions' root mean square */
    double a_to_b_max, a_to_b_rms, b_to_a_max, b_to_a_rms;
    double a_to_b_bound, b_to_a_bound;
    double normal_deviation_mean, normal_deviation_max; /* degrees between the normals at sample and closest point, both ways */
    double hausdorff_percent, rms_percent;              /* of the diagonal */
    double seconds;
} delmesh_distance_report;

DELMESH_API void delmesh_distance_report_init(delmesh_distance_report* report, uint32_t struct_size);
/* Two-sided distance between two surfaces. O((n + samples) log n). options: NULL for the defaults.
 * Errors: INVALID_ARGUMENT, UNSUPPORTED, NO_SURFACE (a mesh without faces), memory, CANCELLED. */
DELMESH_API int32_t delmesh_measure_distance(delmesh_context* context, const delmesh_mesh* a, const delmesh_mesh* b,
                                             const delmesh_distance_options* options, delmesh_distance_report* report);

/* ---- Everything through one symbol ------------------------------------------------------------------------------------------ */

/* For hosts that load the library at run time: all functions in one table, in this order for ever, new ones at the end. */
typedef struct delmesh_api {
    uint32_t struct_size;
    uint32_t abi_version;
    uint32_t (*version)(void);
    const char* (*status_name)(int32_t);
    void (*context_options_init)(delmesh_context_options*, uint32_t);
    int32_t (*context_create)(const delmesh_context_options*, delmesh_context**);
    void (*context_destroy)(delmesh_context*);
    void (*cancel)(delmesh_context*);
    const char* (*last_error)(const delmesh_context*);
    void (*context_memory)(const delmesh_context*, uint64_t*, uint64_t*, uint64_t*);
    void (*mesh_desc_init)(delmesh_mesh_desc*, uint32_t);
    int32_t (*mesh_create)(delmesh_context*, const delmesh_mesh_desc*, delmesh_mesh**);
    void (*mesh_destroy)(delmesh_mesh*);
    void (*mesh_info_init)(delmesh_mesh_info*, uint32_t);
    int32_t (*mesh_get_info)(const delmesh_mesh*, delmesh_mesh_info*);
    int32_t (*mesh_read)(const delmesh_mesh*, int32_t, const delmesh_view_mut*);
    int32_t (*mesh_borrow)(const delmesh_mesh*, int32_t, delmesh_view*);
    int32_t (*mesh_validate)(delmesh_context*, const delmesh_mesh*);
    void (*remesh_options_init)(delmesh_remesh_options*, uint32_t);
    void (*remesh_report_init)(delmesh_remesh_report*, uint32_t);
    int32_t (*remesh)(delmesh_context*, const delmesh_mesh*, const delmesh_remesh_options*, delmesh_mesh**, delmesh_remesh_report*);
    void (*certify_options_init)(delmesh_certify_options*, uint32_t);
    void (*certify_report_init)(delmesh_certify_report*, uint32_t);
    int32_t (*certify)(delmesh_context*, const delmesh_mesh*, const delmesh_certify_options*, delmesh_certify_report*);
    void (*quality_report_init)(delmesh_quality_report*, uint32_t);
    int32_t (*measure_quality)(delmesh_context*, const delmesh_mesh*, delmesh_quality_report*);
    void (*distance_options_init)(delmesh_distance_options*, uint32_t);
    void (*distance_report_init)(delmesh_distance_report*, uint32_t);
    int32_t (*measure_distance)(delmesh_context*, const delmesh_mesh*, const delmesh_mesh*, const delmesh_distance_options*,
                                delmesh_distance_report*);
    void (*preserve_estimate_init)(delmesh_preserve_estimate*, uint32_t);
    int32_t (*estimate_preserve)(delmesh_context*, const delmesh_mesh*, const delmesh_remesh_options*, delmesh_preserve_estimate*);
    void (*decimate_options_init)(delmesh_decimate_options*, uint32_t);
    void (*level_report_init)(delmesh_level_report*, uint32_t);
    void (*decimate_report_init)(delmesh_decimate_report*, uint32_t);
    int32_t (*lod_family)(delmesh_context*, const delmesh_mesh*, const delmesh_target*, int32_t, const delmesh_decimate_options*,
                          delmesh_mesh**, delmesh_level_report*, delmesh_decimate_report*);
    int32_t (*decimate)(delmesh_context*, const delmesh_mesh*, const delmesh_target*, const delmesh_decimate_options*,
                        delmesh_mesh**, delmesh_level_report*, delmesh_decimate_report*);
    void (*layer_init)(delmesh_layer*, uint32_t);
    int32_t (*mesh_layer_borders)(const delmesh_mesh*, int32_t, int64_t*);
    int32_t (*transfer)(delmesh_context*, const delmesh_mesh*, int32_t, int32_t, const delmesh_view*, const delmesh_view_mut*);
    int32_t (*transfer_sparse)(delmesh_context*, const delmesh_mesh*, const delmesh_rows*, int32_t, int32_t,
                               const delmesh_rows_mut*);
    int32_t (*transfer_fitted)(delmesh_context*, const delmesh_mesh*, const delmesh_mesh*, int32_t, int32_t, const delmesh_view*,
                               const delmesh_view_mut*);
    void (*cage_desc_init)(delmesh_cage_desc*, uint32_t);
    int32_t (*cage_create)(delmesh_context*, const delmesh_cage_desc*, delmesh_cage**);
    void (*cage_destroy)(delmesh_cage*);
    void (*subdivide_options_init)(delmesh_subdivide_options*, uint32_t);
    void (*subdivide_report_init)(delmesh_subdivide_report*, uint32_t);
    int32_t (*subdivide)(delmesh_context*, const delmesh_cage*, const delmesh_subdivide_options*, delmesh_mesh**,
                         delmesh_subdivide_report*);
    int32_t (*limit_values)(delmesh_context*, const delmesh_cage*, const delmesh_mesh*, int32_t, int32_t, const delmesh_view*,
                            const delmesh_view_mut*);
    int32_t (*limit_normals)(delmesh_context*, const delmesh_cage*, const delmesh_mesh*, const delmesh_view*,
                             const delmesh_view_mut*);
    void (*reevaluate_report_init)(delmesh_reevaluate_report*, uint32_t);
    int32_t (*reevaluate)(delmesh_context*, const delmesh_cage*, const delmesh_mesh*, const delmesh_view*, delmesh_mesh**,
                          delmesh_reevaluate_report*);
} delmesh_api;

/* The table, static in the library; NULL if the library does not speak this abi_version (pass DELMESH_ABI_VERSION). */
DELMESH_API const delmesh_api* delmesh_get_api(uint32_t abi_version);
/* sizeof of the struct of that name, e.g. "delmesh_remesh_options", as the library was built; 0 for unknown names. For bindings
 * that mirror the structs, to check themselves. */
DELMESH_API uint32_t delmesh_struct_size(const char* name);
/* The same for where a member begins, e.g. "delmesh_view.stride"; UINT32_MAX for unknown names. */
DELMESH_API uint32_t delmesh_field_offset(const char* name);

#ifdef __cplusplus
}
#endif

#endif /* DELMESH_H */
