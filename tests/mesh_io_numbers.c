// SPDX-License-Identifier: MIT

// Numbers in text, against the C library.

#include "check.h"
#include "io/blocks.h"
#include "random.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static void check_float(const char *text) {
    float ours = 0;
    const uint8_t *end = fm_parse_float((const uint8_t *)text, &ours);
    char *wanted_end;
    const float wanted = strtof(text, &wanted_end);
    const bool same = memcmp(&ours, &wanted, sizeof ours) == 0 || (isnan(ours) && isnan(wanted));
    if (!CHECK(wanted_end == text ? end == NULL : end == (const uint8_t *)wanted_end && same)) {
        fprintf(stderr, "    \"%s\": %.9g, not %.9g\n", text, (double)ours, (double)wanted);
    }
}

static void numbers(void) {
    static const char *const odd[] = {
        "0",
        "-0",
        "-0.0e5",
        "1",
        ".5",
        "-.5e1",
        "5.",
        "+7",
        "16777217",
        "33554434.5",
        "1e38",
        "3.5e38",
        "1e-46",
        "1.4e-45",
        "1e-40",
        "1.17549e-38",
        "3.4028235e38",
        "3.4028236e38",
        "1e400",
        "1e-400",
        "inf",
        "-INF",
        "nan",
        "0x1p3",
        "",
        "-",
        ".",
        "e5",
        "1e",
        "1e+",
        "1.5x",
        "12/3",
        "1e5e6",
        "00012.50",
        "0.00000000000000000000000000000000000000000001",
        "1234567890123456789012345678901234567890",
        "0.50000002980232238769531250000001",
        "1.00000005960464477539",
        "1.000000059604644775390625",
        "1.0000000596046447753906250000000000001",
        "8.5899346e9",
        "9007199254740993",
        "infinity",
        "--1",
    };
    for (size_t i = 0; i < sizeof odd / sizeof odd[0]; i++) {
        check_float(odd[i]);
    }
    uint64_t state = 5;
    char text[64];
    for (int i = 0; i < 300000; i++) {
        const uint64_t bits = test_random(&state);
        float f;
        double d;
        const uint32_t low = (uint32_t)bits;
        memcpy(&f, &low, sizeof f);
        // Halfway between two floats, and a little beside.
        d = (double)f * (1 + ldexp((double)((int)(bits >> 32 & 7) - 3), -25 - (int)(bits >> 40 & 31)));
        static const char *const forms[] = {"%.9g", "%.6f", "%.17g", "%e", "%.19g", "%.3f", "%.25g"};
        if (fabs(d) < 1e40) {
            snprintf(text, sizeof text, forms[i % 7], fabs(d) > 1e20 && (i % 7 == 1 || i % 7 == 5) ? d * 1e-30 : d);
            check_float(text);
        }
    }
    int64_t whole = 0;
    CHECK(fm_parse_integer((const uint8_t *)"-12/", &whole) && whole == -12);
    CHECK(fm_parse_integer((const uint8_t *)"999999999999999999 ", &whole) && whole == 999999999999999999);
    CHECK(!fm_parse_integer((const uint8_t *)"1000000000000000000", &whole));
    CHECK(!fm_parse_integer((const uint8_t *)"x", &whole) && !fm_parse_integer((const uint8_t *)"-", &whole));
}

int main(void) {
    numbers();
    return check_summary();
}
