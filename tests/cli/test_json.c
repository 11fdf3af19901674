/* SPDX-License-Identifier: Apache-2.0 */
/* The JSON writer: exact texts. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <math.h>

#include "json.h"

static void test_layout(void** state) {
    (void)state;
    Json json = {0};
    json_begin_object(&json, NULL);
    json_integer(&json, "n", -3);
    json_begin_object(&json, "inner");
    json_bool(&json, "yes", true);
    json_double(&json, "x", 0.1);
    json_double(&json, "none", NAN);
    json_end_object(&json);
    json_begin_array(&json, "pairs");
    for (int i = 0; i < 2; ++i) {
        json_begin_array(&json, NULL);
        json_integer(&json, NULL, i);
        json_integer(&json, NULL, i + 1);
        json_end_array(&json);
    }
    json_end_array(&json);
    json_begin_array(&json, "empty");
    json_end_array(&json);
    json_string(&json, "last", "end");
    json_end_object(&json);
    assert_false(json.out_of_memory);
    assert_string_equal(json.text,
                        "{\n  \"n\": -3,\n  \"inner\": {\n    \"yes\": true,\n    \"x\": 0.1,\n    \"none\": null\n  },\n"
                        "  \"pairs\": [[0, 1], [1, 2]],\n  \"empty\": [],\n  \"last\": \"end\"\n}\n");
    json_free(&json);
}

static void test_strings(void** state) {
    (void)state;
    static const struct {
        const char *in, *out;
    } cases[] = {
        {"a\"b\\c", "\"a\\\"b\\\\c\""},
        {"tab\tbell\a", "\"tab\\u0009bell\\u0007\""},
        {"\xc3\xa9 \xe2\x82\xac \xf0\x9f\x98\x80", "\"\xc3\xa9 \xe2\x82\xac \xf0\x9f\x98\x80\""},
        {"\xff", "\"\\ufffd\""},
        {"\xc3", "\"\\ufffd\""},                       /* cut off */
        {"\xc0\xaf", "\"\\ufffd\\ufffd\""},            /* overlong */
        {"\xed\xa0\x80", "\"\\ufffd\\ufffd\\ufffd\""}, /* a surrogate */
        {"\xf5\x80\x80\x80", "\"\\ufffd\\ufffd\\ufffd\\ufffd\""},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; ++i) {
        Json json = {0};
        json_string(&json, NULL, cases[i].in);
        assert_string_equal(json.text, cases[i].out);
        json_free(&json);
    }
}

static void test_lists_of_objects(void** state) {
    (void)state;
    Json json = {0};
    json_begin_object(&json, NULL);
    json_begin_list(&json, "levels");
    for (int i = 0; i < 2; ++i) {
        json_begin_object(&json, NULL);
        json_integer(&json, "n", i);
        json_begin_array(&json, "row");
        json_integer(&json, NULL, i);
        json_end_array(&json);
        json_end_object(&json);
    }
    json_end_list(&json);
    json_begin_list(&json, "none");
    json_end_list(&json);
    json_bool(&json, "last", true);
    json_end_object(&json);
    assert_string_equal(json.text,
                        "{\n  \"levels\": [\n    {\n      \"n\": 0,\n      \"row\": [0]\n    },\n    {\n      \"n\": 1,\n"
                        "      \"row\": [1]\n    }\n  ],\n  \"none\": [],\n  \"last\": true\n}\n");
    json_free(&json);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_layout), cmocka_unit_test(test_strings),
                                       cmocka_unit_test(test_lists_of_objects)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
