/* SPDX-License-Identifier: Apache-2.0
 *
 * interrupt.c: the handler does only what is async-signal-safe: delmesh_cancel is an atomic store; unlink and _exit are safe by
 * POSIX.
 */
#include "interrupt.h"

#include <limits.h>
#include <stddef.h>
#include <string.h>
#include <unistd.h>

volatile sig_atomic_t interrupt_signal = 0;

static delmesh_context* volatile running_context = NULL;
static char partial_file[PATH_MAX];
static volatile sig_atomic_t partial_file_set = 0;

static void on_signal(int number) {
    if (interrupt_signal) {
        if (partial_file_set) unlink(partial_file);
        _exit(128 + number);
    }
    interrupt_signal = number;
    if (running_context) delmesh_cancel(running_context);
}

void interrupt_install(void) {
    struct sigaction action;
    memset(&action, 0, sizeof action);
    action.sa_handler = on_signal;
    /* no SA_RESTART: a read that waits for a pipe must end, too */
    sigemptyset(&action.sa_mask);
    const int signals[] = {SIGINT, SIGTERM, SIGHUP};
    for (size_t i = 0; i < sizeof signals / sizeof *signals; ++i) {
        struct sigaction old; /* nohup and background jobs of a shell ignore signals on purpose: leave that */
        if (sigaction(signals[i], NULL, &old) == 0 && old.sa_handler != SIG_IGN) sigaction(signals[i], &action, NULL);
    }
    /* A closed pipe and a file at its size limit are write errors like any other. */
    signal(SIGPIPE, SIG_IGN);
    signal(SIGXFSZ, SIG_IGN);
}

void interrupt_set_context(delmesh_context* context) {
    running_context = context;
    if (context && interrupt_signal) delmesh_cancel(context);
}

void interrupt_set_file(const char* path) {
    partial_file_set = 0;
    if (!path || strlen(path) >= sizeof partial_file) return;
    strcpy(partial_file, path);
    partial_file_set = 1;
}
