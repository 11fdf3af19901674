/* SPDX-License-Identifier: Apache-2.0 */
#include "source.h"

#include "interrupt.h"

#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

static bool fail_cancelled(Failure* failure) {
    return fail_with(failure, kStatusCancelled, "the read was cancelled");
}

static bool resize(Source* source, size_t capacity, Failure* failure) {
    char* data = realloc(source->data, capacity);
    if (!data) return fail_memory(failure);
    source->data = data;
    return true;
}

static bool read_descriptor(int descriptor, Source* out, Failure* failure) {
    struct stat info;
    if (fstat(descriptor, &info) != 0) return fail_with(failure, kStatusRead, "could not be examined: %s", strerror(errno));
    if (S_ISDIR(info.st_mode)) return fail_with(failure, kStatusRead, "is a directory");
    if (!S_ISREG(info.st_mode) && !S_ISFIFO(info.st_mode)) return fail_with(failure, kStatusRead, "is neither a file nor a pipe");
    size_t capacity = info.st_size > 0 ? (size_t)info.st_size + 1 : 65536; /* one more byte: so the end is seen without growing */
    if (!resize(out, capacity, failure)) return false;
    for (;;) {
        if (interrupt_signal) return fail_cancelled(failure);
        if (out->size == capacity) {
            capacity *= 2;
            if (!resize(out, capacity, failure)) return false;
        }
        size_t room = capacity - out->size;
        ssize_t got = read(descriptor, out->data + out->size, room < (1u << 24) ? room : (1u << 24));
        if (got < 0 && errno == EINTR) continue;
        if (got < 0) return fail_with(failure, kStatusRead, "byte %zu: could not be read: %s", out->size, strerror(errno));
        if (got == 0) return true;
        out->size += (size_t)got;
    }
}

static bool inflate_members(z_stream* z, Source* packed, Source* out, Failure* failure) {
    const size_t floor = (size_t)64 << 20;
    const size_t limit = packed->size > floor / 100 ? packed->size * 100 : floor;
    const unsigned char* input = (const unsigned char*)packed->data;
    size_t capacity = packed->size * 4 + 4096, taken = 0;
    if (!resize(out, capacity, failure)) return false;
    for (;;) {
        if (interrupt_signal) return fail_cancelled(failure);
        if (out->size == capacity) {
            if (capacity >= limit)
                return fail_with(failure, kStatusRead,
                                 "byte %zu of the gzip file: it expands to more than %zu bytes, 100 times its size", taken,
                                 limit);
            capacity = capacity * 2 < limit ? capacity * 2 : limit;
            if (!resize(out, capacity, failure)) return false;
        }
        size_t room = capacity - out->size, left = packed->size - taken;
        const size_t most = (size_t)1 << 24;                  /* zlib counts in unsigned int */
        z->next_in = (unsigned char*)(size_t)(input + taken); /* const in all but type */
        z->avail_in = (unsigned)(left < most ? left : most);
        z->next_out = (unsigned char*)out->data + out->size;
        z->avail_out = (unsigned)(room < most ? room : most);
        int result = inflate(z, Z_NO_FLUSH);
        taken = (size_t)(z->next_in - input);
        out->size = (size_t)((char*)z->next_out - out->data);
        if (result == Z_STREAM_END) {
            /* Further members follow directly; anything else after a member is padding, as for gzip itself. */
            left = packed->size - taken;
            if (left < 3 || input[taken] != 0x1f || input[taken + 1] != 0x8b || input[taken + 2] != 8) return true;
            if (inflateReset(z) != Z_OK) return fail_memory(failure);
        } else if (result == Z_MEM_ERROR) {
            return fail_memory(failure);
        } else if (result == Z_BUF_ERROR && taken == packed->size) {
            return fail_with(failure, kStatusRead, "byte %zu of the gzip file: it ended early", taken);
        } else if (result != Z_OK && result != Z_BUF_ERROR) {
            return fail_with(failure, kStatusRead, "byte %zu of the gzip file: %s", taken,
                             z->msg ? z->msg : "the data are damaged");
        }
    }
}

static bool decompress(Source* source, Failure* failure) {
    z_stream z;
    memset(&z, 0, sizeof z);
    if (inflateInit2(&z, 16 + MAX_WBITS) != Z_OK) return fail_memory(failure);
    Source plain = {NULL, 0, true};
    bool ok = inflate_members(&z, source, &plain, failure);
    inflateEnd(&z);
    source_free(source);
    *source = plain;
    return ok;
}

bool source_read(const char* path, Source* out, Failure* failure) {
    *out = (Source){NULL, 0, false};
    int descriptor;
    do descriptor = open(path, O_RDONLY | O_CLOEXEC);
    while (descriptor < 0 && errno == EINTR && !interrupt_signal); /* a pipe waits for its writer */
    if (descriptor < 0 && interrupt_signal) return fail_cancelled(failure);
    if (descriptor < 0) return fail_with(failure, kStatusRead, "could not be opened: %s", strerror(errno));
    bool ok = read_descriptor(descriptor, out, failure);
    close(descriptor);
    if (ok && out->size >= 3 && memcmp(out->data, "\x1f\x8b\x08", 3) == 0) ok = decompress(out, failure);
    if (ok) ok = resize(out, out->size + 1, failure);
    if (ok)
        out->data[out->size] = '\0';
    else
        source_free(out);
    return ok;
}

void source_free(Source* source) {
    free(source->data);
    *source = (Source){NULL, 0, false};
}
