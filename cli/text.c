/* SPDX-License-Identifier: Apache-2.0
 *
 * text.c: scanning and printing numbers. Nearly every coordinate has at most 19 digits and a decimal exponent of at most 27 in
 * size: then digits * 5^e or digits / 5^e is exact in 128 bits (with a remainder), and one rounding gives the nearest double.
 * The rest goes to the C library.
 */
#include "text.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef unsigned __int128 Wide;

enum { kMaxPower = 27 }; /* 5^27 < 2^63 */

static const uint64_t kPow5[kMaxPower + 1] = {1ull,
                                              5ull,
                                              25ull,
                                              125ull,
                                              625ull,
                                              3125ull,
                                              15625ull,
                                              78125ull,
                                              390625ull,
                                              1953125ull,
                                              9765625ull,
                                              48828125ull,
                                              244140625ull,
                                              1220703125ull,
                                              6103515625ull,
                                              30517578125ull,
                                              152587890625ull,
                                              762939453125ull,
                                              3814697265625ull,
                                              19073486328125ull,
                                              95367431640625ull,
                                              476837158203125ull,
                                              2384185791015625ull,
                                              11920928955078125ull,
                                              59604644775390625ull,
                                              298023223876953125ull,
                                              1490116119384765625ull,
                                              7450580596923828125ull};

static const double kPow10[23] = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,  1e8,  1e9,  1e10, 1e11,
                                  1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};

static const uint64_t kTen15 = 1000000000000000ull, kTen16 = 10000000000000000ull, kTen17 = 100000000000000000ull;

void text_skip_line(Text* t) {
    while (t->at != t->end && !text_is_newline(*t->at)) ++t->at;
}

bool text_skip_space(Text* t, char comment) {
    for (;;) {
        text_skip_blanks(t);
        if (text_is_newline(*t->at)) {
            text_newline(t);
        } else if (comment && *t->at == comment) {
            text_skip_line(t);
        } else {
            return t->at != t->end;
        }
    }
}

size_t text_word_length(const Text* t) {
    const char* p = t->at;
    while (p != t->end && !text_is_blank(*p) && !text_is_newline(*p)) ++p;
    return (size_t)(p - t->at);
}

static char lower(char c) {
    return c >= 'A' && c <= 'Z' ? (char)(c + 32) : c;
}

/* Length of `word` if the text at p starts with it, ignoring case; else 0. */
static size_t match(const char* p, const char* word) {
    size_t n = 0;
    while (word[n] && lower(p[n]) == word[n]) ++n;
    return word[n] ? 0 : n;
}

bool text_take_word(Text* t, const char* word) {
    Text ahead = *t;
    ahead.at += match(t->at, word);
    if (ahead.at == t->at || !text_at_break(&ahead)) return false;
    *t = ahead;
    return true;
}

static double from_bits(uint64_t bits) {
    double value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

static int leading_zeros(Wide x) {
    uint64_t high = (uint64_t)(x >> 64);
    return high ? __builtin_clzll(high) : 64 + __builtin_clzll((uint64_t)x);
}

/* The double nearest to (q + something in (0,1) if sticky) * 2^exponent, for q >= 2^63 or not sticky; normal range only. */
static double round_wide(Wide q, int exponent, bool sticky) {
    int shift = 128 - leading_zeros(q) - 53;
    uint64_t mantissa;
    if (shift <= 0) {
        mantissa = (uint64_t)q << -shift;
    } else {
        Wide rest = q & (((Wide)1 << shift) - 1), half = (Wide)1 << (shift - 1);
        mantissa = (uint64_t)(q >> shift);
        if (rest > half || (rest == half && (sticky || (mantissa & 1)))) ++mantissa;
    }
    /* mantissa is in [2^52, 2^53]: its top bit, and a carry out of it, add to the exponent field by themselves. */
    return from_bits(((uint64_t)(exponent + shift + 1074) << 52) + mantissa);
}

/* digits * 10^exponent, exactly rounded; false outside the range that 128 bits carry. */
static bool scale(uint64_t digits, int64_t exponent, double* out) {
    if (digits == 0) {
        *out = 0;
    } else if (digits <= (1ull << 53) && exponent >= -22 && exponent <= 22) { /* both exact: one rounding */
        *out = exponent < 0 ? (double)digits / kPow10[-exponent] : (double)digits * kPow10[exponent];
    } else if (exponent >= 0 && exponent <= kMaxPower) {
        *out = round_wide((Wide)digits * kPow5[exponent], (int)exponent, false);
    } else if (exponent < 0 && exponent >= -kMaxPower) {
        int zeros = __builtin_clzll(digits);
        Wide numerator = (Wide)(digits << zeros) << 63; /* at least 2^126: the quotient has 64 bits or more */
        uint64_t divisor = kPow5[-exponent];
        Wide quotient = numerator / divisor;
        *out = round_wide(quotient, (int)exponent - zeros - 63, quotient * divisor != numerator);
    } else {
        return false;
    }
    return true;
}

static bool scan_special(const char* p, bool negative, const char** at, double* out) {
    size_t n = match(p, "nan");
    double value = NAN;
    if (n == 0) {
        n = match(p, "infinity");
        if (n == 0) n = match(p, "inf");
        value = INFINITY;
    }
    if (n == 0) return false;
    *out = negative ? -value : value;
    *at = p + n;
    return true;
}

bool text_scan_double(const char** at, double* out) {
    const char* p = *at;
    bool negative = *p == '-';
    if (*p == '-' || *p == '+') ++p;
    const char* first = p;
    uint64_t digits = 0;
    int64_t exponent = 0, count = 0;
    bool dropped = false;                        /* a digit other than 0 that does not fit into `digits` */
    const uint64_t full = 999999999999999999ull; /* up to here one more digit fits */
    for (; *p >= '0' && *p <= '9'; ++p, ++count) {
        if (digits <= full) {
            digits = digits * 10 + (uint64_t)(*p - '0');
        } else {
            ++exponent;
            dropped |= *p != '0';
        }
    }
    if (*p == '.') {
        for (++p; *p >= '0' && *p <= '9'; ++p, ++count) {
            if (digits <= full) {
                digits = digits * 10 + (uint64_t)(*p - '0');
                --exponent;
            } else {
                dropped |= *p != '0';
            }
        }
    }
    if (count == 0) return scan_special(first, negative, at, out);
    if (*p == 'e' || *p == 'E') {
        const char* q = p + 1;
        bool down = *q == '-';
        if (*q == '-' || *q == '+') ++q;
        if (*q >= '0' && *q <= '9') {
            int64_t power = 0;
            for (; *q >= '0' && *q <= '9'; ++q)
                if (power < 1000000000000) power = power * 10 + (*q - '0');
            exponent += down ? -power : power;
            p = q;
        }
    }
    double value;
    if (dropped || !scale(digits, exponent, &value)) value = strtod(first, NULL);
    *out = negative ? -value : value;
    *at = p;
    return true;
}

bool text_scan_integer(const char** at, int64_t* out) {
    const char* p = *at;
    bool negative = *p == '-';
    if (*p == '-' || *p == '+') ++p;
    if (*p < '0' || *p > '9') return false;
    int64_t value = 0;
    for (; *p >= '0' && *p <= '9'; ++p) {
        if (value > (INT64_MAX - 9) / 10) return false;
        value = value * 10 + (*p - '0');
    }
    *out = negative ? -value : value;
    *at = p;
    return true;
}

bool text_parse_double(const char* string, double* out) {
    return text_scan_double(&string, out) && *string == '\0';
}
bool text_parse_integer(const char* string, int64_t* out) {
    return text_scan_integer(&string, out) && *string == '\0';
}

/* 17 significant digits of a normal positive double: *digits in [10^16, 10^17), value ~ *digits * 10^(*power - 16).
 * False where 128 bits are too few. */
static bool seventeen_digits(double value, uint64_t* digits, int* power) {
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    int exponent = (int)(bits >> 52) - 1075;
    if (exponent == -1075) return false;
    uint64_t mantissa = (bits & ((1ull << 52) - 1)) | (1ull << 52);
    int guess = (int)floor((exponent + 52) * 0.30102999566398120); /* log10(2): one too low at times, never too high */
    for (;; ++guess) {
        int scaling = 16 - guess;
        if (scaling < -24 || scaling > 24) return false;
        Wide numerator, half, quotient;
        if (scaling >= 0) {
            numerator = (Wide)mantissa * kPow5[scaling];
            int shift = exponent + scaling;
            if (shift >= 0) {
                quotient = numerator << shift;
            } else {
                half = (Wide)1 << (-shift - 1);
                quotient = (numerator + half) >> -shift;
            }
        } else {
            numerator = (Wide)mantissa << (exponent + scaling); /* value >= 10^17 keeps the sum positive */
            quotient = (numerator + kPow5[-scaling] / 2) / kPow5[-scaling];
        }
        if (quotient < kTen17) {
            *digits = (uint64_t)quotient;
            *power = guess;
            return quotient >= kTen16;
        }
    }
}

size_t text_print_integer(char out[kTextDoubleSize], int64_t value) {
    char reversed[24];
    size_t n = 0, length = 0;
    uint64_t rest = value < 0 ? 0 - (uint64_t)value : (uint64_t)value;
    do {
        reversed[n++] = (char)('0' + rest % 10);
        rest /= 10;
    } while (rest);
    if (value < 0) out[length++] = '-';
    while (n) out[length++] = reversed[--n];
    out[length] = '\0';
    return length;
}

/* Writes digits (no trailing zero, first one not 0) with the decimal point behind the (power + 1)-th. */
static size_t layout(char* out, const char* digits, int count, int power) {
    char* p = out;
    if (power < -5 || power > 16) {
        *p++ = digits[0];
        if (count > 1) {
            *p++ = '.';
            memcpy(p, digits + 1, (size_t)count - 1);
            p += count - 1;
        }
        *p++ = 'e';
        p += text_print_integer(p, power);
    } else if (power < 0) {
        *p++ = '0';
        *p++ = '.';
        for (int i = -1; i > power; --i) *p++ = '0';
        memcpy(p, digits, (size_t)count);
        p += count;
    } else {
        for (int i = 0; i < count || i <= power; ++i) {
            if (i == power + 1) *p++ = '.';
            *p++ = i < count ? digits[i] : '0';
        }
    }
    *p = '\0';
    return (size_t)(p - out);
}

size_t text_print_double(char out[kTextDoubleSize], double value) {
    char* p = out;
    if (isnan(value)) return (size_t)(stpcpy(out, "nan") - out);
    if (signbit(value)) *p++ = '-';
    double size = fabs(value);
    if (isinf(size)) return (size_t)(stpcpy(p, "inf") - out);
    if (size == 0) return (size_t)(stpcpy(p, "0") - out);

    uint64_t all;
    int power;
    char digits[kTextDoubleSize];
    if (seventeen_digits(size, &all, &power)) {
        uint64_t shorter = (all + 50) / 100;
        double back;
        if (scale(shorter, power - 14, &back) && back == size) {
            if (shorter == kTen15) ++power; /* 9.99... rounded up to 10 */
        } else {
            shorter = (all + 5) / 10;
            /* A final 5 may be the rounded image of less than a half. */
            if (all % 10 == 5 && !(scale(shorter, power - 15, &back) && back == size)) --shorter;
            if (!(scale(shorter, power - 15, &back) && back == size))
                shorter = all;
            else if (shorter == kTen16)
                ++power;
        }
        while (shorter % 10 == 0) shorter /= 10;
        int count = (int)text_print_integer(digits, (int64_t)shorter);
        return (size_t)(p - out) + layout(p, digits, count, power);
    }
    /* Very large, very small or denormal: d.ddde[+-]x from the C library, taken apart and laid out in the same way. */
    char printed[kTextDoubleSize];
    for (int precision = size < DBL_MIN ? 0 : 14; precision <= 16; ++precision) { /* denormals have fewer digits */
        snprintf(printed, sizeof printed, "%.*e", precision, size);
        if (strtod(printed, NULL) == size) break;
    }
    char* e = strchr(printed, 'e');
    power = atoi(e + 1);
    int count = 0;
    for (const char* c = printed; c != e; ++c)
        if (*c != '.') digits[count++] = *c;
    while (count > 1 && digits[count - 1] == '0') --count;
    return (size_t)(p - out) + layout(p, digits, count, power);
}

const char* text_quote(const Text* t, char out[kTextQuoteSize]) {
    size_t length = text_word_length(t), shown = length < 40 ? length : 40;
    for (size_t i = 0; i < shown; ++i) out[i] = t->at[i] >= 32 && t->at[i] < 127 ? t->at[i] : '?';
    strcpy(out + shown, shown < length ? "..." : "");
    return out;
}
