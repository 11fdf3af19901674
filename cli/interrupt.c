/* SPDX-License-Identifier: Apache-2.0
 *
 * interrupt.c: the handler does only what is async-signal-safe: delmesh_cancel is an atomic store; unlink and _exit are safe by
 * POSIX.
 */
#include "interrupt.h"

#include <stddef.h>
#include <string.h>
#include <unistd.h>

volatile sig_atomic_t interrupt_signal = 0;

static delmesh_context* volatile running_context = NULL;
enum { kMostFiles = 80 }; /* at a time; further ones are not unlinked */
static const char* volatile partial_files[kMostFiles];

static void on_signal(int number) {
    if (interrupt_signal) {
        for (int i = 0; i < kMostFiles; ++i)
            if (partial_files[i]) unlink(partial_files[i]);
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

static void replace_file(const char* old, const char* path) {
    for (int i = 0; i < kMostFiles; ++i)
        if (partial_files[i] == old) {
            partial_files[i] = path;
            return;
        }
}

void interrupt_add_file(const char* path) {
    replace_file(NULL, path);
}

void interrupt_remove_file(const char* path) {
    if (path) replace_file(path, NULL);
}
