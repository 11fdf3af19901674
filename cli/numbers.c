/* SPDX-License-Identifier: Apache-2.0 */
#include "numbers.h"

#include "interrupt.h"
#include "source.h"
#include "text.h"

#include <math.h>
#include <stdlib.h>

static bool parse(const char* path, Text text, bool positive, Numbers* out, Failure* failure) {
    int64_t capacity = 0;
    char quote[kTextQuoteSize];
    for (int64_t last = 0; text_skip_space(&text, '#'); last = text.line) {
        if (interrupt_signal) return fail_with(failure, kStatusCancelled, "%s: the read was cancelled", path);
        const Text word = text;
        double value;
        const char* wanted = positive ? "a number over 0" : "a number";
        if (!text_scan_double(&text.at, &value) || !(text_at_break(&text) || *text.at == '#') || !isfinite(value) ||
            (positive && !(value > 0)))
            return fail_with(failure, kStatusRead, "%s: line %lld: expected %s, found '%s'", path, (long long)word.line, wanted,
                             text_quote(&word, quote));
        if (text.line == last)
            return fail_with(failure, kStatusRead, "%s: line %lld: expected one number, found '%s' too", path, (long long)last,
                             text_quote(&word, quote));
        if (out->count == capacity) {
            capacity += capacity / 2 + 1024;
            double* grown = realloc(out->values, (size_t)capacity * sizeof *grown);
            if (!grown) return fail_memory(failure);
            out->values = grown;
        }
        out->values[out->count++] = value;
    }
    return out->count > 0 || fail_with(failure, kStatusRead, "%s: there is no number in it", path);
}

bool numbers_read(const char* path, bool positive, Numbers* out, Failure* failure) {
    *out = (Numbers){NULL, 0};
    Source source;
    Failure cause = {NULL, ""};
    if (!source_read(path, &source, &cause)) return fail_with(failure, cause.status, "%s: %s", path, cause.text);
    bool ok = parse(path, (Text){source.data, source.data + source.size, 1}, positive, out, failure);
    source_free(&source);
    if (!ok) numbers_free(out);
    return ok;
}

void numbers_free(Numbers* numbers) {
    free(numbers->values);
    *numbers = (Numbers){NULL, 0};
}
