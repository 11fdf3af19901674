/* SPDX-License-Identifier: Apache-2.0 */
/* Arguments: what is set, and the sentence for each mistake. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "options.h"

typedef struct Values {
    bool flag;
    int32_t mode;
    int64_t count, sweeps;
    double angle;
    Length length;
    const char *name, *in, *out;
} Values;

static const Choice kModes[] = {{"soft", 1}, {"hard", 2}, {NULL, 0}};

/* The arguments, up to NULL, into *values. */
static bool parse(Values* values, Failure* failure, bool* help, const char** words) {
    int count = 0;
    while (words[count]) ++count;
    *values = (Values){.mode = 1};
    *failure = (Failure){NULL, ""};
    const Option options[] = {option_flag("--flag", &values->flag, ""),
                              option_value("--hard", &values->mode, 2, ""),
                              option_choice("--mode", &values->mode, kModes, "soft|hard", ""),
                              option_integer("--count", &values->count, 0, 10, "N", ""),
                              option_count("--sweeps", &values->sweeps, 6, 0, 10, "N", ""),
                              option_number("--angle", &values->angle, 0, 180, "DEG", ""),
                              option_length("--length", &values->length, ""),
                              option_string("--name", &values->name, "NAME", ""),
                              option_end()};
    const Positional positionals[] = {{"IN", &values->in}, {"OUT", &values->out}, {NULL, NULL}};
    return options_parse(count, (char**)(size_t)words, options, positionals, help, failure);
}

static void test_all_kinds(void** state) {
    (void)state;
    Values v;
    Failure failure;
    bool help;
    assert_true(parse(&v, &failure, &help,
                      (const char*[]){"--flag", "in", "--mode", "hard", "--count=7", "--angle", "22.5", "out", "--length=2.5%",
                                      "--name", "-x", NULL}));
    assert_false(help);
    assert_true(v.flag);
    assert_int_equal(v.mode, 2);
    assert_int_equal(v.count, 7);
    assert_true(v.angle == 22.5);
    assert_true(v.length.given && v.length.percent && v.length.value == 2.5);
    assert_string_equal(v.name, "-x");
    assert_string_equal(v.in, "in");
    assert_string_equal(v.out, "out");

    assert_true(parse(&v, &failure, &help, (const char*[]){"--hard", "--length", "1e-3", "--", "-a", "--flag", NULL}));
    assert_int_equal(v.mode, 2);
    assert_false(v.flag);
    assert_true(v.length.given && !v.length.percent && v.length.value == 1e-3);
    assert_string_equal(v.in, "-a");
    assert_string_equal(v.out, "--flag");

    /* The next word is not its value: that comes behind a = only. */
    assert_true(parse(&v, &failure, &help, (const char*[]){"--sweeps", "3", "out", NULL}));
    assert_int_equal(v.sweeps, 6);
    assert_string_equal(v.in, "3");
    assert_true(parse(&v, &failure, &help, (const char*[]){"in", "--sweeps=3", "out", NULL}));
    assert_int_equal(v.sweeps, 3);

    assert_true(parse(&v, &failure, &help, (const char*[]){"in", "--help", "--nonsense", NULL}));
    assert_true(help);
}

static void test_mistakes(void** state) {
    (void)state;
    static const struct {
        const char* words[5];
        const char* sentence;
    } cases[] = {
        {{"in", NULL}, "OUT is missing"},
        {{"in", "out", "more", NULL}, "'more' is one argument too many"},
        {{"--nope", NULL}, "there is no option '--nope'"},
        {{"--fla", NULL}, "there is no option '--fla'"},
        {{"--flag=1", NULL}, "--flag takes no value"},
        {{"in", "out", "--mode", NULL}, "--mode takes a value: soft|hard"},
        {{"--mode", "medium", NULL}, "--mode takes soft|hard, not 'medium'"},
        {{"--count", "11", NULL}, "--count takes a whole number from 0 to 10, not '11'"},
        {{"--count", "1.0", NULL}, "--count takes a whole number from 0 to 10, not '1.0'"},
        {{"--sweeps=11", NULL}, "--sweeps takes a whole number from 0 to 10, not '11'"},
        {{"--sweeps=", NULL}, "--sweeps takes a whole number from 0 to 10, not ''"},
        {{"--angle", "nan", NULL}, "--angle takes a number from 0 to 180, not 'nan'"},
        {{"--angle", "1,5", NULL}, "--angle takes a number from 0 to 180, not '1,5'"},
        {{"--length", "-1", NULL}, "--length takes a length in model units or percent of the diagonal, not '-1'"},
        {{"--length", "1%%", NULL}, "--length takes a length in model units or percent of the diagonal, not '1%%'"},
        {{"--length", "inf", NULL}, "--length takes a length in model units or percent of the diagonal, not 'inf'"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; ++i) {
        Values v;
        Failure failure;
        bool help;
        assert_false(parse(&v, &failure, &help, (const char**)(size_t)cases[i].words));
        assert_string_equal(failure.text, cases[i].sentence);
        assert_string_equal(failure.status, kStatusUsage);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_all_kinds), cmocka_unit_test(test_mistakes)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
