/* SPDX-License-Identifier: Apache-2.0 */
#include "options.h"

#include "text.h"

#include <float.h>
#include <stdio.h>
#include <string.h>

static bool takes_argument(const Option* option) {
    return option->kind != kOptionFlag && option->kind != kOptionValue && option->kind != kOptionCount;
}

const char* choice_name(const Choice* choices, int32_t value) {
    while (choices->name && choices->value != value) ++choices;
    return choices->name;
}

static bool fail_range(const Option* option, const char* text, Failure* failure) {
    char low[kTextDoubleSize], high[kTextDoubleSize];
    text_print_double(low, option->low);
    text_print_double(high, option->high);
    return fail_with(failure, kStatusUsage, "%s takes %s from %s to %s, not '%s'", option->name,
                     option->kind == kOptionNumber ? "a number" : "a whole number", low, high, text);
}

static bool set_choice(const Option* option, const char* text, Failure* failure) {
    for (const Choice* c = option->choices; c->name; ++c) {
        if (strcmp(c->name, text) == 0) {
            *(int32_t*)option->target = c->value;
            return true;
        }
    }
    return fail_with(failure, kStatusUsage, "%s takes %s, not '%s'", option->name, option->argument, text);
}

static bool set_length(const Option* option, const char* text, Failure* failure) {
    Length* length = option->target;
    const char* at = text;
    bool ok = text_scan_double(&at, &length->value) && length->value >= 0 && length->value <= DBL_MAX;
    length->given = true;
    length->percent = *at == '%';
    if (ok && at[length->percent] == '\0') return true;
    return fail_with(failure, kStatusUsage, "%s takes a length in model units or percent of the diagonal, not '%s'", option->name,
                     text);
}

static bool set(const Option* option, const char* text, Failure* failure) {
    int64_t integer;
    double number;
    switch (option->kind) {
    case kOptionFlag:
        *(bool*)option->target = true;
        return true;
    case kOptionValue:
        *(int32_t*)option->target = option->value;
        return true;
    case kOptionChoice:
        return set_choice(option, text, failure);
    case kOptionNumber:
        if (!text_parse_double(text, &number) || !(number >= option->low && number <= option->high))
            return fail_range(option, text, failure);
        *(double*)option->target = number;
        return true;
    case kOptionCount:
        if (!text) {
            *(int64_t*)option->target = option->value;
            return true;
        } /* fall through */
    case kOptionInteger:
        if (!text_parse_integer(text, &integer) || !((double)integer >= option->low && (double)integer <= option->high))
            return fail_range(option, text, failure);
        *(int64_t*)option->target = integer;
        return true;
    case kOptionLength:
        return set_length(option, text, failure);
    case kOptionString:
        *(const char**)option->target = text;
        return true;
    }
    return false;
}

static bool parse(int count, char** arguments, const Option* options, const Positional* positionals, bool* help,
                  Failure* failure) {
    bool options_ended = false;
    *help = false;
    for (int i = 0; i < count; ++i) {
        const char* word = arguments[i];
        if (options_ended || word[0] != '-' || word[1] == '\0') {
            if (!positionals->name) return fail_with(failure, kStatusUsage, "'%s' is one argument too many", word);
            *(positionals++)->target = word;
            continue;
        }
        if (strcmp(word, "--") == 0) {
            options_ended = true;
            continue;
        }
        if (strcmp(word, "--help") == 0 || strcmp(word, "-h") == 0) {
            *help = true;
            return true;
        }
        const char* equals = strchr(word, '=');
        size_t length = equals ? (size_t)(equals - word) : strlen(word);
        const Option* option = options;
        while (option->name && !(strncmp(option->name, word, length) == 0 && option->name[length] == '\0')) ++option;
        if (!option->name) return fail_with(failure, kStatusUsage, "there is no option '%.*s'", (int)length, word);
        const char* value = equals ? equals + 1 : NULL;
        if (takes_argument(option) && !value) {
            if (i + 1 == count) return fail_with(failure, kStatusUsage, "%s takes a value: %s", option->name, option->argument);
            value = arguments[++i];
        } else if (!takes_argument(option) && value && option->kind != kOptionCount) {
            return fail_with(failure, kStatusUsage, "%s takes no value", option->name);
        }
        if (!set(option, value, failure)) return false;
    }
    if (positionals->name) return fail_with(failure, kStatusUsage, "%s is missing", positionals->name);
    return true;
}

bool options_parse(int count, char** arguments, const Option* options, const Positional* positionals, bool* help,
                   Failure* failure) {
    if (parse(count, arguments, options, positionals, help, failure)) return true;
    /* Flags behind the mistake still count: --json says how the mistake is to be reported. */
    for (int i = 0; i < count && strcmp(arguments[i], "--") != 0; ++i)
        for (const Option* o = options; o->name; ++o)
            if (o->kind == kOptionFlag && strcmp(o->name, arguments[i]) == 0) *(bool*)o->target = true;
    return false;
}

void options_print_help(const char* command, const char* summary, const Option* options, const Positional* positionals) {
    printf("delmesh %s", command);
    for (const Positional* p = positionals; p->name; ++p) printf(" %s", p->name);
    printf(" [options]\n%s\n\nOptions\n", summary);
    for (const Option* o = options; o->name; ++o) {
        char left[64];
        const bool counts = o->kind == kOptionCount, shown = takes_argument(o) || counts;
        snprintf(left, sizeof left, "%s%s%s%s", o->name,
                 counts  ? "[="
                 : shown ? " "
                         : "",
                 shown ? o->argument : "", counts ? "]" : "");
        if (strlen(left) < 34)
            printf("  %-34s%s\n", left, o->help);
        else
            printf("  %s\n  %-34s%s\n", left, "", o->help);
    }
}
