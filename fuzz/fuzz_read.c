// SPDX-License-Identifier: MIT

// Reads the fuzzer's bytes as a file of FUZZ_FORMAT. For raw they are the sidecar, the only part of that format with a grammar.

#include "io/file.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { MAX_BYTES = 1 << 24, RAW_BYTES = 4096 };

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

// What was read must be whole: every byte is there, and the description agrees with the volume.
static void examine(fm_volume *volume, const fm_file_info *info) {
    static volatile uint8_t sink;
    fm_volume_desc desc;
    uint64_t bytes = 0;
    fm_volume_info(volume, &desc);
    if (fm_array_bytes(desc.shape, desc.type, &bytes) != FM_OK || bytes != info->bytes || bytes > MAX_BYTES ||
        desc.type != info->type) {
        abort();
    }
    const uint8_t *elements = fm_volume_data(volume);
    uint8_t sum = 0;
    for (uint64_t i = 0; i < bytes; i++) {
        sum = (uint8_t)(sum + elements[i]);
    }
    sink = sum;
    (void)sink;
}

static void store(const char *path, const void *data, size_t size) {
    FILE *file = fopen(path, "wb");
    if (!file || fwrite(data, 1, size, file) != size || fclose(file) != 0) {
        abort();
    }
}

static char raw[1024];

static void remove_raw(void) {
    unlink(raw);
}

static fm_result read_with_sidecar(const uint8_t *data, size_t size, fm_volume **volume, fm_file_info *info) {
    static char sidecar[sizeof raw + 4];
    if (!raw[0]) {
        static const uint8_t elements[RAW_BYTES];
        const char *folder = getenv("TMPDIR");
        snprintf(raw, sizeof raw, "%s/fathom-fuzz-%ld.raw", folder && folder[0] ? folder : "/tmp", (long)getpid());
        snprintf(sidecar, sizeof sidecar, "%s.txt", raw);
        store(raw, elements, sizeof elements);
        atexit(remove_raw);
    }
    store(sidecar, data, size);
    fm_result result = fm_file_read(NULL, raw, NULL, volume, info);
    unlink(sidecar);
    return result;
}

static fm_result read_bytes(const uint8_t *data, size_t size, fm_volume **volume, fm_file_info *info) {
    fm_input *input = NULL;
    FM_TRY(fm_input_open_memory(&fm_default_allocator, data, size, "input", &input));
    const fm_read_desc desc = {.format = FUZZ_FORMAT, .max_bytes = MAX_BYTES, .include_hidden = size % 2};
    fm_result result = fm_file_read_input(NULL, input, NULL, &desc, volume, info);
    fm_input_close(input);
    return result;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    fm_volume *volume = NULL;
    fm_file_info info = {0};
    fm_result result =
        FUZZ_FORMAT == FM_FORMAT_RAW ? read_with_sidecar(data, size, &volume, &info) : read_bytes(data, size, &volume, &info);
    if (result == FM_OK) {
        examine(volume, &info);
        fm_volume_destroy(volume);
    } else if (volume || fm_last_error()[0] == 0) {
        abort();
    }
    return 0;
}
