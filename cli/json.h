/* SPDX-License-Identifier: Apache-2.0
 *
 * json.h: writes one JSON text into memory. Doubles are the shortest decimals that read back; NaN and infinities become null,
 * names that are no UTF-8 get replacement characters.
 */
#ifndef DELMESH_CLI_JSON_H
#define DELMESH_CLI_JSON_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef struct Json {
    char* text; /* '\0'-ended once anything is written */
    size_t size, capacity;
    int depth;
    int arrays; /* open ones: no line breaks inside */
    bool need_comma;
    bool out_of_memory; /* then `text` is incomplete and must not be used */
} Json;

/* key: NULL inside arrays and for the outermost object. */
void json_begin_object(Json* json, const char* key);
void json_end_object(Json* json);
void json_begin_array(Json* json, const char* key); /* of numbers, or of arrays of numbers: kept on one line */
void json_end_array(Json* json);
void json_begin_list(Json* json, const char* key); /* of objects */
void json_end_list(Json* json);
void json_integer(Json* json, const char* key, int64_t value);
void json_double(Json* json, const char* key, double value);
void json_bool(Json* json, const char* key, bool value);
void json_string(Json* json, const char* key, const char* value);
void json_free(Json* json);

#endif
