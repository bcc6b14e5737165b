// SPDX-License-Identifier: MIT
// Uses the installed library from outside: the distance field of one solid voxel, checked.

#include <fathom/fathom.h>

#include <stdio.h>
#include <string.h>

static int fail(const char *what) {
    fprintf(stderr, "%s: %s\n", what, fm_last_error());
    return 1;
}

int main(void) {
    char compiled[32];
    snprintf(compiled, sizeof compiled, "%d.%d.%d", FM_VERSION_MAJOR, FM_VERSION_MINOR, FM_VERSION_PATCH);
    if (strcmp(compiled, fm_version()) != 0) {
        fprintf(stderr, "the header is of version %s, the library of %s\n", compiled, fm_version());
        return 1;
    }
    fm_context_desc context_desc = {.backend = FM_BACKEND_CPU};
    fm_context *context;
    if (fm_context_create(&context_desc, &context) != FM_OK) {
        return fail("fm_context_create");
    }

    enum { SIZE = 5, CENTRE = 2 };
    const fm_shape shape = {SIZE, SIZE, SIZE};
    uint8_t solid[SIZE][SIZE][SIZE] = {0};
    uint32_t squared[SIZE][SIZE][SIZE];
    solid[CENTRE][CENTRE][CENTRE] = 1;
    const fm_transform_desc transform_desc = {.squared = true};
    const fm_array input = {solid, FM_TYPE_U8, shape};
    const fm_array output = {squared, FM_TYPE_U32, shape};
    if (fm_transform_host(context, &transform_desc, &input, &output, NULL) != FM_OK) {
        return fail("fm_transform_host");
    }
    for (int z = 0; z < SIZE; z++) {
        for (int y = 0; y < SIZE; y++) {
            for (int x = 0; x < SIZE; x++) {
                int dx = x - CENTRE, dy = y - CENTRE, dz = z - CENTRE;
                uint32_t wanted = (uint32_t)(dx * dx + dy * dy + dz * dz);
                if (squared[z][y][x] != wanted) {
                    fprintf(stderr, "voxel %d %d %d: %u instead of %u\n", x, y, z, squared[z][y][x], wanted);
                    return 1;
                }
            }
        }
    }
    fm_context_destroy(context);
    printf("fathom %s: %d voxels are right\n", fm_version(), SIZE * SIZE * SIZE);
    return 0;
}
