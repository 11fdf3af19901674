/* SPDX-License-Identifier: Apache-2.0
 *
 * commands.h: the subcommands. Each takes the arguments behind its name and returns the exit status.
 */
#ifndef DELMESH_CLI_COMMANDS_H
#define DELMESH_CLI_COMMANDS_H

int command_info(int count, char** arguments);
int command_certify(int count, char** arguments);
int command_remesh(int count, char** arguments);
int command_lod(int count, char** arguments);
int command_subdivide(int count, char** arguments);
int command_measure(int count, char** arguments);

#endif
