// SPDX-License-Identifier: MIT
#ifndef FM_CHECK_H
#define FM_CHECK_H

// Checks for test programs. A failed check prints its place and goes on; `main` ends with `return check_summary();`, or with
// `return check_skip("why")` when the test cannot run here.

#include "fathom/fathom.h"

#include <stdio.h>

enum { CHECK_SKIPPED = 77 };

static int check_failures;
static int check_count;

static inline bool check_report(bool good, const char *file, int line, const char *text) {
    check_count++;
    // A test that fails everywhere need not say so a million times.
    if (!good && ++check_failures <= 50) {
        fprintf(stderr, "%s:%d: failed: %s\n", file, line, text);
    }
    return good;
}

static inline bool check_result(fm_result result, fm_result wanted, const char *file, int line, const char *text) {
    bool good = check_report(result == wanted, file, line, text);
    if (!good && check_failures <= 50) {
        fprintf(stderr, "    got %s, wanted %s", fm_result_name(result), fm_result_name(wanted));
        fprintf(stderr, result == FM_OK ? "\n" : "; last error: %s\n", fm_last_error());
    }
    return good;
}

static inline int check_summary(void) {
    if (check_failures) {
        fprintf(stderr, "%d of %d checks failed\n", check_failures, check_count);
    } else {
        printf("%d checks passed\n", check_count);
    }
    return check_failures ? 1 : 0;
}

static inline int check_skip(const char *why) {
    printf("skipped: %s\n", why);
    return CHECK_SKIPPED;
}

// Each is true when the check held, so that a test can stop where going on makes no sense.
#define CHECK(condition) check_report((condition), __FILE__, __LINE__, #condition)
#define CHECK_OK(call) check_result((call), FM_OK, __FILE__, __LINE__, #call)
#define CHECK_FAILS(call, wanted) check_result((call), (wanted), __FILE__, __LINE__, #call)

#endif
