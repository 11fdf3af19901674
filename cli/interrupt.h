/* SPDX-License-Identifier: Apache-2.0
 *
 * interrupt.h: Ctrl-C, SIGTERM and SIGHUP end the command cleanly: the running library call is cancelled, loops of the command
 * itself look at interrupt_signal, and files that are being written are removed. A second signal ends it at once.
 */
#ifndef DELMESH_CLI_INTERRUPT_H
#define DELMESH_CLI_INTERRUPT_H

#include <delmesh/delmesh.h>
#include <signal.h>

extern volatile sig_atomic_t interrupt_signal; /* 0, or the signal that came */

void interrupt_install(void);
/* The context whose call is to be cancelled; NULL before it is destroyed. */
void interrupt_set_context(delmesh_context* context);
/* A file to unlink should a second signal come, until it is gone or complete. The string must live until then. */
void interrupt_add_file(const char* path);
void interrupt_remove_file(const char* path);

#endif
