/* SPDX-License-Identifier: Apache-2.0
 *
 * delmesh: the command. A C program on delmesh.h only, and so the first user of the library's interface.
 * It never calls setlocale: numbers are read and written in the "C" locale whatever the environment says.
 */
#include "commands.h"
#include "interrupt.h"

#include <delmesh/delmesh.h>
#include <stdio.h>
#include <string.h>

static const char kUsage[] =
    "delmesh: any mesh, made Delaunay, with an exact certificate\n"
    "\n"
    "  delmesh info FILE            what is in the file, what the import repairs, whether it is Delaunay\n"
    "  delmesh certify FILE         is it Delaunay? exit status 0 yes, 1 no, 2 error\n"
    "  delmesh remesh IN OUT        make it Delaunay\n"
    "  delmesh lod IN OUT_PREFIX    a family of coarser Delaunay meshes, one file per level\n"
    "  delmesh subdivide CAGE OUT   the limit surface of a control cage, as fine as told\n"
    "  delmesh measure A B          angles of both, distance between them\n"
    "  delmesh COMMAND --help       all options\n"
    "  delmesh --version\n"
    "\n"
    "Files: OBJ, OFF, PLY, STL, text and binary; reading also .gz. Exit status 2: error; 130: interrupted.\n";

int main(int argc, char** argv) {
    interrupt_install();
    const char* name = argc > 1 ? argv[1] : "";
    if (strcmp(name, "info") == 0) return command_info(argc - 2, argv + 2);
    if (strcmp(name, "certify") == 0) return command_certify(argc - 2, argv + 2);
    if (strcmp(name, "remesh") == 0) return command_remesh(argc - 2, argv + 2);
    if (strcmp(name, "lod") == 0) return command_lod(argc - 2, argv + 2);
    if (strcmp(name, "subdivide") == 0) return command_subdivide(argc - 2, argv + 2);
    if (strcmp(name, "measure") == 0) return command_measure(argc - 2, argv + 2);
    if (strcmp(name, "--version") == 0) {
        const unsigned version = delmesh_version();
        printf("delmesh %u.%u.%u\n", version >> 16, version >> 8 & 255, version & 255);
        return fflush(stdout) == 0 ? 0 : 2;
    }
    if (strcmp(name, "--help") == 0 || strcmp(name, "-h") == 0 || strcmp(name, "help") == 0) {
        fputs(kUsage, stdout);
        return fflush(stdout) == 0 ? 0 : 2;
    }
    if (argc > 1) fprintf(stderr, "delmesh: there is no command '%s'\n", name);
    fputs(kUsage, stderr);
    return 2;
}
