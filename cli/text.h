/* SPDX-License-Identifier: Apache-2.0
 *
 * text.h: numbers and words of text files. Decimal -> double is exactly rounded, double -> decimal reads back as the same
 * double, and neither looks at the locale (the fall-backs call strtod and snprintf, and this program never calls setlocale, so
 * that it stays in the "C" locale it starts in).
 *
 * All scanning relies on a '\0' after the last byte of the text: it is no digit, no blank and no letter, so loops end there
 * without a test. A '\0' inside the text is just another byte that belongs to no number.
 */
#ifndef DELMESH_CLI_TEXT_H
#define DELMESH_CLI_TEXT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef struct Text {
    const char* at;
    const char* end; /* *end == '\0' */
    int64_t line;    /* of `at`, counting from 1; lines end with \n, \r\n or \r */
} Text;

static inline bool text_is_blank(char c) {
    return c == ' ' || c == '\t' || c == '\v' || c == '\f';
}
static inline bool text_is_newline(char c) {
    return c == '\n' || c == '\r';
}
/* At the end of a word: white space or the end of the text. */
static inline bool text_at_break(const Text* t) {
    return text_is_blank(*t->at) || text_is_newline(*t->at) || t->at == t->end;
}
static inline void text_skip_blanks(Text* t) {
    while (text_is_blank(*t->at)) ++t->at;
}
/* Over one line end, at which `at` must stand. */
static inline void text_newline(Text* t) {
    if (t->at[0] == '\r' && t->at[1] == '\n') ++t->at;
    ++t->at;
    ++t->line;
}
/* To the end of the line, before its line end. */
void text_skip_line(Text* t);
/* Over blanks and line ends; with `comment`, also over comments that this character starts. False at the end of the text. */
bool text_skip_space(Text* t, char comment);
/* The word at `at`, up to white space. */
size_t text_word_length(const Text* t);
/* Moves over the word if it is `word`, ignoring the case of ASCII letters. */
bool text_take_word(Text* t, const char* word);

/* Scan a number at *at and move *at behind it; false, with *at unmoved, where there is none. What follows is not looked at.
 * Reals: [+-] digits [. digits] [e [+-] digits], inf, infinity, nan in any case; too large gives infinity.
 * Integers: [+-] digits; what does not fit is false. */
bool text_scan_double(const char** at, double* out);
bool text_scan_integer(const char** at, int64_t* out);
/* The whole of a '\0'-ended string must be the number. */
bool text_parse_double(const char* string, double* out);
bool text_parse_integer(const char* string, int64_t* out);

enum { kTextDoubleSize = 32 };
/* Writes the shortest of the correctly rounded decimals of up to 17 digits that reads back as `value`; "nan", "inf" and "-inf"
 * for the others. Returns the length; '\0' is appended. */
size_t text_print_double(char out[kTextDoubleSize], double value);
size_t text_print_integer(char out[kTextDoubleSize], int64_t value);

/* A copy of what stands at `at` fit for an error sentence: at most 40 bytes up to white space, what cannot be printed as '?'. */
enum { kTextQuoteSize = 48 };
const char* text_quote(const Text* t, char out[kTextQuoteSize]);

#endif
