/* SPDX-License-Identifier: Apache-2.0
 *
 * Numbers as text: answers known by hand, and many random ones against the C library, which is exact (in the "C" locale, in which
 * a C program starts).
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include <math.h>

#include "text.h"

#define COUNT(array) (sizeof(array) / sizeof *(array))

static uint64_t next_random(uint64_t* state) { /* xorshift */
    *state ^= *state << 13;
    *state ^= *state >> 7;
    *state ^= *state << 17;
    return *state;
}

static void same_double(double a, double b, const char* text) {
    if (memcmp(&a, &b, sizeof a) != 0) fail_msg("%s: %.17g, not %.17g", text, a, b);
}

static void test_known_decimals(void** state) {
    (void)state;
    static const struct {
        const char* text;
        double value;
    } cases[] = {{"0", 0.0},
                 {"-0", -0.0},
                 {"+1", 1.0},
                 {".5", 0.5},
                 {"5.", 5.0},
                 {"1e3", 1000.0},
                 {"1E+03", 1000.0},
                 {"2.e-1", 0.2},
                 {"0.1", 0x1.999999999999ap-4},
                 {"9007199254740993", 9007199254740992.0},            /* 2^53 + 1: a tie, to even */
                 {"9007199254740995", 9007199254740996.0},            /* 2^53 + 3: a tie, to even */
                 {"9007199254740993.0000000001", 9007199254740994.0}, /* just above the tie */
                 {"18446744073709551616", 0x1p64},
                 {"1e22", 1e22},
                 {"1e23", 0x1.52d02c7e14af6p+76}, /* below the tie that 10^23 nearly is */
                 {"8.5e-27", 0x1.50b83da615fd1p-87},
                 {"0.000000000000000000000000000000000000000000001401298464324817070923729583289916131280", 0x1p-149},
                 {"4.9406564584124654e-324", 0x1p-1074},
                 {"2.4703282292062327e-324", 0.0}, /* half the smallest: a tie, just below */
                 {"2.2250738585072011e-308", 0x0.fffffffffffffp-1022},
                 {"1.7976931348623157e308", 0x1.fffffffffffffp1023},
                 {"1e309", INFINITY},
                 {"-1e999999999999999999999", -INFINITY},
                 {"1e-999999999999999999999", 0.0},
                 {"0e999999999999999999999", 0.0},
                 {"inf", INFINITY},
                 {"-Infinity", -INFINITY}};
    for (size_t i = 0; i < COUNT(cases); ++i) {
        double value = 42;
        assert_true(text_parse_double(cases[i].text, &value));
        same_double(value, cases[i].value, cases[i].text);
    }
    double value;
    assert_true(text_parse_double("NaN", &value) && isnan(value));
    static const char* const none[] = {"",    "-",   ".",     "+.",   "e5", "1e", "1e+",  "0x10",
                                       "1,5", "--1", "1.2.3", "nano", " 1", "1 ", "infi", "1f"};
    for (size_t i = 0; i < COUNT(none); ++i)
        if (text_parse_double(none[i], &value)) fail_msg("'%s' was taken for a number", none[i]);
}

static void test_scanning_stops_behind_the_number(void** state) {
    (void)state;
    static const char* const texts[] = {"12.5/3", "12.5e", "12.5e+x", "12.5,", "12.5-1"};
    for (size_t i = 0; i < COUNT(texts); ++i) {
        const char* at = texts[i];
        double value;
        assert_true(text_scan_double(&at, &value));
        assert_int_equal(at - texts[i], 4);
        same_double(value, 12.5, texts[i]);
    }
    const char *text = "x1", *at = text;
    double value;
    assert_false(text_scan_double(&at, &value));
    assert_ptr_equal(at, text);
}

static void test_integers(void** state) {
    (void)state;
    int64_t value;
    assert_true(text_parse_integer("-12", &value) && value == -12);
    assert_true(text_parse_integer("+007", &value) && value == 7);
    assert_true(text_parse_integer("922337203685477580", &value) && value == 922337203685477580);
    assert_false(text_parse_integer("18446744073709551617", &value));
    assert_false(text_parse_integer("99999999999999999999999", &value));
    assert_false(text_parse_integer("1.0", &value));
    assert_false(text_parse_integer("", &value));
    assert_false(text_parse_integer("-", &value));
}

static void test_known_prints(void** state) {
    (void)state;
    static const struct {
        double value;
        const char* text;
    } cases[] = {{0.0, "0"},
                 {-0.0, "-0"},
                 {1.0, "1"},
                 {-12.5, "-12.5"},
                 {0.1, "0.1"},
                 {(double)0.1f, "0.10000000149011612"},
                 {1.0 / 3, "0.3333333333333333"},
                 {123456789.0, "123456789"},
                 {1e16, "10000000000000000"},
                 {1e17, "1e17"},
                 {1e-5, "0.00001"},
                 {1e-6, "1e-6"},
                 {1.5e-7, "1.5e-7"},
                 {9007199254740993.0, "9007199254740992"},
                 {0x1p-149, "1.401298464324817e-45"},
                 {0x1p-1074, "5e-324"},
                 {0x1.fffffffffffffp1023, "1.7976931348623157e308"},
                 {1e30, "1e30"},
                 {9.9999999999999995, "10"},
                 {0.99999999999999989, "0.9999999999999999"},
                 {INFINITY, "inf"},
                 {-INFINITY, "-inf"},
                 {NAN, "nan"}};
    for (size_t i = 0; i < COUNT(cases); ++i) {
        char text[kTextDoubleSize];
        const size_t length = text_print_double(text, cases[i].value);
        assert_string_equal(text, cases[i].text);
        assert_int_equal(length, strlen(text));
    }
    char text[kTextDoubleSize];
    text_print_integer(text, INT64_MIN);
    assert_string_equal(text, "-9223372036854775808");
}

/* Fewest digits, of the correctly rounded decimals, that read back; what the C library says. */
static int fewest_digits(double value) {
    char text[64];
    for (int digits = 1; digits < 17; ++digits) {
        snprintf(text, sizeof text, "%.*e", digits - 1, value);
        if (strtod(text, NULL) == value) return digits;
    }
    return 17;
}

static int digits_of(const char* text) {
    int count = 0, zeros = 0;
    bool started = false;
    for (; *text && *text != 'e'; ++text) {
        if (*text < '0' || *text > '9') continue;
        started |= *text != '0';
        if (!started) continue;
        ++count;
        zeros = *text == '0' ? zeros + 1 : 0;
    }
    return count - zeros;
}

static void test_random_prints_read_back(void** state) {
    (void)state;
    uint64_t random = 88172645463325252ull;
    for (int i = 0; i < 400000; ++i) {
        const uint64_t bits = next_random(&random);
        const int64_t whole = (int64_t)next_random(&random);
        double value;
        memcpy(&value, &bits, sizeof value);
        switch (i % 5) {
        case 1:
            value = (double)(float)((double)whole * 1e-18);
            break;
        case 2:
            value = (double)whole * pow(10, (int)(bits % 50) - 35);
            break;
        case 3:
            value = (double)(bits % 2000000) / 1e4 - 100;
            break;
        case 4:
            value = (double)(float)ldexp((double)(int32_t)whole, (int)(bits % 60) - 50);
            break;
        default:
            break; /* any bits */
        }
        if (isnan(value)) continue;
        char text[kTextDoubleSize];
        const size_t length = text_print_double(text, value);
        assert_int_equal(length, strlen(text));
        same_double(strtod(text, NULL), value, text);
        double back;
        assert_true(text_parse_double(text, &back));
        same_double(back, value, text);
        if (i % 8 == 0 && value != 0 && isfinite(value) && digits_of(text) > fewest_digits(value))
            fail_msg("%s is not short", text);
    }
}

static void test_random_decimals(void** state) {
    (void)state;
    uint64_t random = 1234567890123ull;
    for (int i = 0; i < 400000; ++i) {
        char text[64];
        int length = 0;
        const int digits = 1 + (int)(next_random(&random) % 26), point = (int)(next_random(&random) % (unsigned)(digits + 1));
        if (next_random(&random) & 1) text[length++] = '-';
        for (int k = 0; k < digits; ++k) {
            if (k == point) text[length++] = '.';
            text[length++] = (char)('0' + next_random(&random) % 10);
        }
        text[length] = '\0';
        if (next_random(&random) & 1) sprintf(text + length, "e%d", (int)(next_random(&random) % 90) - 45);
        double value;
        assert_true(text_parse_double(text, &value));
        same_double(value, strtod(text, NULL), text);
    }
}

/* Decimals on, and a hair beside, the middle between two neighbouring doubles. */
static void test_ties(void** state) {
    (void)state;
    uint64_t random = 99887766554433ull;
    for (int i = 0; i < 100000; ++i) {
        const uint64_t odd = (next_random(&random) >> 10 | 1ull << 53) | 1; /* 54 bits, the last one set: a tie */
        char text[64];
        sprintf(text, "%llu%s", (unsigned long long)odd, i % 3 == 0 ? "" : i % 3 == 1 ? ".0000000000000001" : "e-3");
        double value;
        assert_true(text_parse_double(text, &value));
        same_double(value, strtod(text, NULL), text);
    }
}

static void test_lines(void** state) {
    (void)state;
    const char text[] = "a\n b\r\nc\rd # e\n\n#f\nfacet\t";
    Text t = {text, text + sizeof text - 1, 1};
    const char* words[] = {"a", "b", "c", "d"};
    for (int i = 0; i < 4; ++i) {
        assert_true(text_skip_space(&t, '#'));
        assert_int_equal(t.line, i + 1);
        assert_true(text_take_word(&t, words[i]));
    }
    assert_true(text_skip_space(&t, '#'));
    assert_int_equal(t.line, 7);
    assert_false(text_take_word(&t, "face"));
    assert_true(text_take_word(&t, "facet"));
    assert_false(text_skip_space(&t, '#'));
    assert_ptr_equal(t.at, t.end);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_known_decimals),
        cmocka_unit_test(test_scanning_stops_behind_the_number),
        cmocka_unit_test(test_integers),
        cmocka_unit_test(test_known_prints),
        cmocka_unit_test(test_random_prints_read_back),
        cmocka_unit_test(test_random_decimals),
        cmocka_unit_test(test_ties),
        cmocka_unit_test(test_lines),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
