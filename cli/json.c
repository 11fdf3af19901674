/* SPDX-License-Identifier: Apache-2.0 */
#include "json.h"

#include "text.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void put(Json* json, const char* text, size_t size) {
    if (json->out_of_memory) return;
    if (json->capacity - json->size < size + 1) {
        size_t wanted = 2 * json->capacity + size + 256;
        char* grown = realloc(json->text, wanted);
        if (!grown) {
            json->out_of_memory = true;
            return;
        }
        json->text = grown;
        json->capacity = wanted;
    }
    memcpy(json->text + json->size, text, size);
    json->size += size;
    json->text[json->size] = '\0';
}

static void put_string(Json* json, const char* text) {
    put(json, text, strlen(text));
}

/* Length of the well-formed UTF-8 sequence at s, or 0. */
static size_t utf8_length(const unsigned char* s) {
    if (s[0] < 0x80) return 1;
    size_t n = s[0] >= 0xc2 && s[0] <= 0xdf ? 2 : (s[0] & 0xf0) == 0xe0 ? 3 : s[0] >= 0xf0 && s[0] <= 0xf4 ? 4 : 0;
    for (size_t i = 1; i < n; ++i)
        if ((s[i] & 0xc0) != 0x80) return 0;
    if ((s[0] == 0xe0 && s[1] < 0xa0) || (s[0] == 0xed && s[1] > 0x9f) || (s[0] == 0xf0 && s[1] < 0x90) ||
        (s[0] == 0xf4 && s[1] > 0x8f))
        return 0; /* overlong, surrogate, beyond Unicode */
    return n;
}

static void put_quoted(Json* json, const char* text) {
    put(json, "\"", 1);
    for (const unsigned char* s = (const unsigned char*)text; *s;) {
        size_t n = utf8_length(s);
        if (n == 0) {
            put_string(json, "\\ufffd");
            n = 1;
        } else if (*s < 32 || *s == 127) {
            char escape[8];
            snprintf(escape, sizeof escape, "\\u%04x", *s);
            put_string(json, escape);
        } else {
            if (*s == '"' || *s == '\\') put(json, "\\", 1);
            put(json, (const char*)s, n);
        }
        s += n;
    }
    put(json, "\"", 1);
}

static void newline(Json* json) {
    put(json, "\n", 1);
    for (int i = 0; i < json->depth; ++i) put(json, "  ", 2);
}

static void begin_value(Json* json, const char* key) {
    if (json->need_comma) put_string(json, json->arrays > 0 ? ", " : ",");
    if (json->depth > 0 && json->arrays == 0) newline(json);
    if (key) {
        put_quoted(json, key);
        put_string(json, ": ");
    }
    json->need_comma = true;
}

void json_begin_object(Json* json, const char* key) {
    begin_value(json, key);
    put(json, "{", 1);
    ++json->depth;
    json->need_comma = false;
}

void json_end_object(Json* json) {
    --json->depth;
    newline(json);
    put_string(json, json->depth == 0 ? "}\n" : "}");
    json->need_comma = true;
}

void json_begin_array(Json* json, const char* key) {
    begin_value(json, key);
    put(json, "[", 1);
    ++json->depth;
    ++json->arrays;
    json->need_comma = false;
}

void json_end_array(Json* json) {
    --json->depth;
    --json->arrays;
    put(json, "]", 1);
    json->need_comma = true;
}

void json_begin_list(Json* json, const char* key) {
    begin_value(json, key);
    put(json, "[", 1);
    ++json->depth;
    json->need_comma = false;
}

void json_end_list(Json* json) {
    --json->depth;
    if (json->need_comma) newline(json);
    put(json, "]", 1);
    json->need_comma = true;
}

void json_integer(Json* json, const char* key, int64_t value) {
    char text[kTextDoubleSize];
    begin_value(json, key);
    put(json, text, text_print_integer(text, value));
}

void json_double(Json* json, const char* key, double value) {
    char text[kTextDoubleSize];
    begin_value(json, key);
    if (isfinite(value))
        put(json, text, text_print_double(text, value));
    else
        put_string(json, "null");
}

void json_bool(Json* json, const char* key, bool value) {
    begin_value(json, key);
    put_string(json, value ? "true" : "false");
}

void json_string(Json* json, const char* key, const char* value) {
    begin_value(json, key);
    put_quoted(json, value);
}

void json_free(Json* json) {
    free(json->text);
    memset(json, 0, sizeof *json);
}
