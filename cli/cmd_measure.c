/* SPDX-License-Identifier: Apache-2.0
 *
 * cmd_measure.c: `delmesh measure A B`: angles of both meshes and the two-sided distance between them.
 */
#include "commands.h"
#include "session.h"

#include <stdio.h>

static void json_mesh(Json* json, const char* key, const Loaded* loaded, const delmesh_quality_report* quality) {
    json_begin_object(json, key);
    json_string(json, "file", loaded->path);
    json_counts(json, &loaded->info);
    json_double(json, "largest_coordinate", loaded->largest_coordinate);
    json_quality(json, quality);
    json_end_object(json);
}

int command_measure(int count, char** arguments) {
    Session session;
    session_init(&session);
    session.carry.bare = true;
    const char *path_a = NULL, *path_b = NULL;
    bool no_bound = false, help;
    delmesh_distance_options distance_options;
    delmesh_distance_options_init(&distance_options, sizeof distance_options);
    const Option options[] = {option_integer("--samples", &distance_options.samples, 0, 1e12, "N",
                                             "points per direction besides the vertices; 0: 4 per face, 100,000 at least"),
                              option_flag("--no-bound", &no_bound, "samples only, no guaranteed upper bound"),
                              SESSION_OPTIONS(&session)};
    const Positional positionals[] = {{"A", &path_a}, {"B", &path_b}, {NULL, NULL}};
    Json json = {0};
    bool ok = options_parse(count, arguments, options, positionals, &help, &session.failure);
    if (ok && help) {
        options_print_help("measure",
                           "Angles of two meshes and the distance between their surfaces; percents are of A's diagonal.", options,
                           positionals);
        return session_end(&session, &json, true, 0);
    }
    distance_options.compute_bound = !no_bound;
    Loaded a = {0}, b = {0};
    delmesh_quality_report quality_a, quality_b;
    delmesh_distance_report distance;
    delmesh_quality_report_init(&quality_a, sizeof quality_a);
    delmesh_quality_report_init(&quality_b, sizeof quality_b);
    delmesh_distance_report_init(&distance, sizeof distance);
    ok = ok && session_open(&session) && session_load(&session, path_a, &a) && session_load(&session, path_b, &b) &&
         session_check(&session, delmesh_measure_quality(session.context, a.mesh, &quality_a), path_a) &&
         session_check(&session, delmesh_measure_quality(session.context, b.mesh, &quality_b), path_b) &&
         session_check(&session, delmesh_measure_distance(session.context, a.mesh, b.mesh, &distance_options, &distance), path_b);

    if (ok && session.json) {
        json_begin_object(&json, NULL);
        json_deviation(&json, &distance);
        json_mesh(&json, "a", &a, &quality_a);
        json_mesh(&json, "b", &b, &quality_b);
        json_double(&json, "seconds", seconds_now() - session.begin);
        json_end_object(&json);
    } else if (ok && !session.quiet) {
        printf("A %s: %lld vertices, %lld faces\nB %s: %lld vertices, %lld faces\n", path_a, (long long)a.info.vertices,
               (long long)a.info.faces, path_b, (long long)b.info.vertices, (long long)b.info.faces);
        print_quality_head();
        print_quality("A", &quality_a);
        print_quality("B", &quality_b);
        print_deviation(&distance);
    }
    loaded_free(&a);
    loaded_free(&b);
    return session_end(&session, &json, ok, 0);
}
