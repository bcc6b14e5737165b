// SPDX-License-Identifier: MIT

// Reads the fuzzer's bytes as an octree file: as they are, and with checksums made right, so that what lies behind them is
// reached.

#include "octree_made.h"

#include <stdlib.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void keep(fm_octree *octree) {
    (void)octree;
}

static void read_once(fm_context *context, uint8_t *image, size_t size) {
    const fm_fmo_memory memory = {image, size, keep};
    fm_octree *octree = NULL;
    const fm_result result = fm_fmo_read_image(context, &memory, "input", &octree);
    if (result == FM_OK) {
        fm_octree_destroy(octree);
    } else if (octree || fm_last_error()[0] == 0) {
        abort();
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    static fm_context *context;
    const fm_context_desc cpu = {.backend = FM_BACKEND_CPU, .threads = 1};
    if (!context && fm_context_create(&cpu, &context) != FM_OK) {
        abort();
    }
    uint8_t *copy = malloc(size + 1);
    memcpy(copy, data, size);
    read_once(context, copy, size);
    made_seal(copy, size);
    read_once(context, copy, size);
    free(copy);
    return 0;
}
