// SPDX-License-Identifier: MIT
#ifndef FM_VULKAN_COMMON_H
#define FM_VULKAN_COMMON_H

#include "check.h"

#include <stdlib.h>
#include <string.h>

// How a test ends that found no driver or no validation layer: a failure where continuous integration promises both, a skip
// elsewhere.
static inline int vulkan_missing(void) {
    const char *ci = getenv("CI");
    if (ci && strcmp(ci, "true") == 0) {
        fprintf(stderr, "failed: CI is true, yet there is nothing to test on: %s\n", fm_last_error());
        return 1;
    }
    return check_skip(fm_last_error());
}

#endif
