// SPDX-License-Identifier: MIT

// Numbers in text. Most floats take the short way: their digits as a double, times or over a power of ten. That is within a few
// units in the last place of the double, so it decides the float unless it comes to lie next to the middle between two floats;
// then, and for whatever is unusual, the C library decides.

#include "io/blocks.h"

#include <stdlib.h>
#include <string.h>

enum { MOST_DIGITS = 19, MOST_POWER = 60, DOUBT = 16 };

static const double powers[MOST_POWER + 1] = {
    1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,  1e8,  1e9,  1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20,
    1e21, 1e22, 1e23, 1e24, 1e25, 1e26, 1e27, 1e28, 1e29, 1e30, 1e31, 1e32, 1e33, 1e34, 1e35, 1e36, 1e37, 1e38, 1e39, 1e40, 1e41,
    1e42, 1e43, 1e44, 1e45, 1e46, 1e47, 1e48, 1e49, 1e50, 1e51, 1e52, 1e53, 1e54, 1e55, 1e56, 1e57, 1e58, 1e59, 1e60,
};

static inline bool digit(uint8_t byte) {
    return (uint8_t)(byte - '0') <= 9;
}

static const uint8_t *by_library(const uint8_t *text, float *value) {
    char *end;
    *value = strtof((const char *)text, &end);
    return (const uint8_t *)end == text ? NULL : (const uint8_t *)end;
}

// Adds digits to `*whole`, which may wrap: their number tells.
static inline const uint8_t *digits(const uint8_t *at, uint64_t *whole) {
    uint64_t sum = *whole;
    while (digit(*at)) {
        sum = sum * 10 + (uint64_t)(*at++ - '0');
    }
    *whole = sum;
    return at;
}

// What follows an "e"; `*power` grows by it. NULL: unusual.
static const uint8_t *exponent(const uint8_t *at, int *power) {
    const bool minus = *at == '-';
    at += *at == '-' || *at == '+';
    int value = 0, count = 0;
    for (; digit(*at) && count < 4; at++, count++) {
        value = value * 10 + (*at - '0');
    }
    *power += minus ? -value : value;
    return count == 0 || digit(*at) ? NULL : at;
}

const uint8_t *fm_parse_float(const uint8_t *text, float *value) {
    const uint8_t *at = text;
    const bool minus = *at == '-';
    at += *at == '-' || *at == '+';
    uint64_t whole = 0;
    const uint8_t *first = at;
    at = digits(at, &whole);
    ptrdiff_t count = at - first;
    int power = 0;
    if (*at == '.') {
        const uint8_t *point = ++at;
        at = digits(at, &whole);
        count += at - point;
        power = -(int)(at - point < 1000 ? at - point : 1000);
    }
    // Letters begin words and hexadecimal digits, which the library knows.
    if (count == 0 || count > MOST_DIGITS || *at == 'x' || *at == 'X') {
        return by_library(text, value);
    }
    if (*at == 'e' || *at == 'E') {
        at = exponent(at + 1, &power);
        if (!at) {
            return by_library(text, value);
        }
    }
    if (whole == 0) {
        *value = minus ? -0.0f : 0.0f;
        return at;
    }
    if (power > MOST_POWER || power < -MOST_POWER) {
        return by_library(text, value);
    }
    const double near = power < 0 ? (double)whole / powers[-power] : (double)whole * powers[power];
    uint64_t bits;
    memcpy(&bits, &near, sizeof bits);
    // A double has 29 bits of fraction more than a float.
    const int64_t from_middle = (int64_t)(bits & 0x1fffffff) - 0x10000000;
    if (!(near >= 0x1p-126 && near < 0x1p127) || (from_middle <= DOUBT && from_middle >= -DOUBT)) {
        return by_library(text, value);
    }
    *value = (float)(minus ? -near : near);
    return at;
}

const uint8_t *fm_parse_integer(const uint8_t *text, int64_t *value) {
    const uint8_t *at = text;
    const bool minus = *at == '-';
    at += *at == '-' || *at == '+';
    uint64_t whole = 0;
    const uint8_t *first = at;
    at = digits(at, &whole);
    if (at == first || at - first > 18) {
        return NULL;
    }
    *value = minus ? -(int64_t)whole : (int64_t)whole;
    return at;
}
