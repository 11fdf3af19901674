/* SPDX-License-Identifier: Apache-2.0 */
#include "output.h"

#include "interrupt.h"

#include <errno.h>
#include <fcntl.h>
#include <libgen.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static bool fail_errno(Output* out, const char* what) {
    return fail_with(out->failure, kStatusWrite, "%s: could not be %s: %s", out->path, what, strerror(errno));
}

bool output_check(const char* path, Failure* failure) {
    struct stat info;
    if (stat(path, &info) == 0 && !S_ISREG(info.st_mode))
        return fail_with(failure, kStatusWrite, "%s: is there already and is no file", path);
    char* copy = strdup(path);
    if (!copy) return fail_memory(failure);
    bool ok = access(dirname(copy), W_OK | X_OK) == 0;
    free(copy);
    return ok || fail_with(failure, kStatusWrite, "%s: its folder cannot be written: %s", path, strerror(errno));
}

bool output_open(Output* out, const char* path, Failure* failure) {
    memset(out, 0, sizeof *out);
    out->path = path;
    out->descriptor = -1;
    out->failure = failure;
    if (!output_check(path, failure)) return false;
    struct stat old;
    bool exists = stat(path, &old) == 0;
    out->target = exists ? realpath(path, NULL) : strdup(path);
    out->buffer = malloc(kOutputBuffer);
    size_t room = out->target ? strlen(out->target) + 16 : 0;
    out->temporary = room ? malloc(room) : NULL;
    if (!out->temporary || !out->buffer) {
        fail_memory(failure);
        return output_close(out, false);
    }
    snprintf(out->temporary, room, "%s.XXXXXX", out->target);
    out->descriptor = mkstemp(out->temporary);
    if (out->descriptor < 0) {
        fail_errno(out, "created");
        return output_close(out, false);
    }
    out->written = true;
    interrupt_add_file(out->temporary);
    /* mkstemp makes it private: give it the rights of the file it replaces, or of any new file. */
    mode_t mask = umask(0);
    umask(mask);
    if (fchmod(out->descriptor, exists ? old.st_mode & 0777 : 0666 & ~mask) != 0) {
        fail_errno(out, "given its access rights");
        return output_close(out, false);
    }
    return true;
}

static bool put(Output* out, const char* data, size_t size) {
    while (size > 0) {
        if (interrupt_signal) return fail_with(out->failure, kStatusCancelled, "%s: the write was cancelled", out->path);
        ssize_t n = write(out->descriptor, data, size);
        if (n < 0 && errno == EINTR) continue;
        if (n < 0) return fail_errno(out, "written");
        data += n;
        size -= (size_t)n;
    }
    return true;
}

static bool flush(Output* out) {
    bool ok = put(out, out->buffer, out->used);
    out->used = 0;
    return ok;
}

char* output_reserve(Output* out, size_t size) {
    if (out->used + size > kOutputBuffer && !flush(out)) return NULL;
    return out->buffer + out->used;
}

bool output_write(Output* out, const void* data, size_t size) {
    if (size > kOutputBuffer) return flush(out) && put(out, data, size);
    char* at = output_reserve(out, size);
    if (!at) return false;
    memcpy(at, data, size);
    out->used += size;
    return true;
}

static void release(Output* out) {
    if (out->written) unlink(out->temporary);
    interrupt_remove_file(out->temporary);
    if (out->old) unlink(out->old); /* also where it was put back: two names of one file are not renamed */
    free(out->old);
    free(out->target);
    free(out->temporary);
    free(out->buffer);
    memset(out, 0, sizeof *out);
    out->descriptor = -1;
}

bool output_finish(Output* out, bool ok) {
    ok = ok && out->written && flush(out);
    if (out->descriptor >= 0 && close(out->descriptor) != 0 && ok) ok = fail_errno(out, "written");
    out->descriptor = -1;
    free(out->buffer);
    out->buffer = NULL;
    if (!ok) release(out);
    return ok;
}

/* A second name for what the target is, if there is anything: to take back what is put in its place. No signal removes it: the
 * target may be gone by then. */
static bool keep_old(Output* out) {
    const size_t room = strlen(out->temporary) + 2;
    char* old = malloc(room);
    if (!old) return fail_memory(out->failure);
    snprintf(old, room, "%s~", out->temporary);
    out->old = old;
    if (link(out->target, old) == 0) return true;
    /* Where files have one name only, nothing is at the target for a moment. */
    struct stat is;
    if (errno != ENOENT && lstat(out->target, &is) == 0 && S_ISREG(is.st_mode) && rename(out->target, old) == 0) return true;
    const bool ok = errno == ENOENT || fail_errno(out, "set aside");
    free(old);
    out->old = NULL;
    return ok;
}

static void put_back(Output* out) {
    if (!out->old) {
        unlink(out->target);
    } else if (rename(out->old, out->target) != 0) { /* nothing is lost: it stays under its other name */
        free(out->old);
        out->old = NULL;
    }
}

bool output_commit(Output* outs, int count, bool ok, Failure* failure) {
    if (ok && interrupt_signal) ok = fail_with(failure, kStatusCancelled, "%s: the write was cancelled", outs->path);
    int placed = 0;
    for (int i = 0; i < count && ok; ++i) {
        outs[i].failure = failure;
        if (i + 1 < count) ok = keep_old(&outs[i]); /* what replaces the last one need not be taken back */
        if (ok && rename(outs[i].temporary, outs[i].target) != 0) {
            ok = fail_errno(&outs[i], "renamed into place");
            if (outs[i].old) put_back(&outs[i]);
        }
        if (!ok) break;
        outs[i].written = false;
        ++placed;
    }
    for (int i = 0; i < placed && !ok; ++i) put_back(&outs[i]);
    for (int i = 0; i < count; ++i) release(&outs[i]);
    return ok;
}

bool output_close(Output* out, bool ok) {
    Failure* failure = out->failure;
    return output_finish(out, ok) && output_commit(out, 1, true, failure);
}
