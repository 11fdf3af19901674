/* SPDX-License-Identifier: Apache-2.0
 *
 * options.h: a subcommand's arguments from one table, which also gives its help text.
 */
#ifndef DELMESH_CLI_OPTIONS_H
#define DELMESH_CLI_OPTIONS_H

#include "failure.h"

#include <stddef.h>
#include <stdint.h>

typedef struct Choice {
    const char* name; /* NULL ends a list */
    int32_t value;
} Choice;

/* A length in model units, or in percent of the bounding box's diagonal. */
typedef struct Length {
    double value;
    bool percent, given;
} Length;

typedef enum OptionKind {
    kOptionFlag,    /* bool: set */
    kOptionValue,   /* int32_t: set to `value`; an alias of a choice */
    kOptionChoice,  /* int32_t: one of `choices` */
    kOptionNumber,  /* double in [low, high] */
    kOptionInteger, /* int64_t in [low, high] */
    kOptionCount,   /* int64_t in [low, high] behind =, or alone: `value` */
    kOptionLength,  /* Length: finite and not negative */
    kOptionString   /* const char* */
} OptionKind;

typedef struct Option {
    const char* name; /* "--mode"; NULL ends a table */
    OptionKind kind;
    void* target;
    const char* argument; /* in the help, "DEG" */
    const char* help;
    const Choice* choices;
    double low, high;
    int32_t value;
} Option;

static inline Option option_flag(const char* name, bool* target, const char* help) {
    return (Option){.name = name, .kind = kOptionFlag, .target = target, .help = help};
}
static inline Option option_value(const char* name, int32_t* target, int32_t value, const char* help) {
    return (Option){.name = name, .kind = kOptionValue, .target = target, .value = value, .help = help};
}
static inline Option option_choice(const char* name, int32_t* target, const Choice* choices, const char* argument,
                                   const char* help) {
    return (Option){
        .name = name, .kind = kOptionChoice, .target = target, .choices = choices, .argument = argument, .help = help};
}
static inline Option option_number(const char* name, double* target, double low, double high, const char* argument,
                                   const char* help) {
    return (Option){
        .name = name, .kind = kOptionNumber, .target = target, .low = low, .high = high, .argument = argument, .help = help};
}
static inline Option option_integer(const char* name, int64_t* target, double low, double high, const char* argument,
                                    const char* help) {
    return (Option){
        .name = name, .kind = kOptionInteger, .target = target, .low = low, .high = high, .argument = argument, .help = help};
}
static inline Option option_count(const char* name, int64_t* target, int32_t alone, double low, double high, const char* argument,
                                  const char* help) {
    return (Option){.name = name,
                    .kind = kOptionCount,
                    .target = target,
                    .value = alone,
                    .low = low,
                    .high = high,
                    .argument = argument,
                    .help = help};
}
static inline Option option_length(const char* name, Length* target, const char* help) {
    return (Option){.name = name, .kind = kOptionLength, .target = target, .argument = "L|P%", .help = help};
}
static inline Option option_string(const char* name, const char** target, const char* argument, const char* help) {
    return (Option){.name = name, .kind = kOptionString, .target = target, .argument = argument, .help = help};
}
static inline Option option_end(void) {
    return (Option){.name = NULL};
}

typedef struct Positional {
    const char* name; /* in capitals, NULL ends a list */
    const char** target;
} Positional;

/* The name of a value, or NULL. */
const char* choice_name(const Choice* choices, int32_t value);

/* Options may stand anywhere, as --name value or --name=value; "--" ends them. Sets *help and stops at -h or --help. */
bool options_parse(int count, char** arguments, const Option* options, const Positional* positionals, bool* help,
                   Failure* failure);
void options_print_help(const char* command, const char* summary, const Option* options, const Positional* positionals);

#endif
