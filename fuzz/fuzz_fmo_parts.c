// SPDX-License-Identifier: MIT

// Opens the fuzzer's bytes as a file with parts, all of whose checksums are made right, and looks at it from outside and from
// within, so that parts come, go, and are seen.

#include "fathom/octree_render.h"
#include "octree_made.h"

#include <math.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <unistd.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static fm_context *context;
static fm_octree_renderer *renderer;

// What fails tells why.
static void expect(bool good) {
    if (!good && fm_last_error()[0] == 0) {
        abort();
    }
}

static fm_camera look(const fm_octree_info *info, bool within) {
    fm_camera camera = {.fov_y = 60};
    for (int axis = 0; axis < 3; axis++) {
        const float low = info->low[axis], high = info->high[axis];
        camera.position[axis] = within ? low + (high - low) * 0.4f : low - (high - low) * 0.7f;
        camera.forward[axis] = (high - low) * (axis == 1 ? 0.9f : 1.0f);
    }
    return camera;
}

static void show(fm_octree_stream *stream, const fm_camera *camera) {
    enum { WIDTH = 12, HEIGHT = 8 };
    fm_octree_stream_info info;
    const fm_result updated = fm_octree_stream_update(stream, camera, true);
    expect(updated == FM_OK);
    fm_octree_stream_describe(stream, &info);
    if (info.bytes > info.budget || info.failing > info.parts || info.resident > info.parts ||
        (info.failed > 0) != (info.failure[0] != 0)) {
        abort();
    }
    const fm_octree_render_desc desc = {.camera = *camera, .width = WIDTH, .height = HEIGHT, .stream = stream, .shadow = true};
    expect(updated != FM_OK || fm_octree_render(renderer, &desc, NULL) == FM_OK);
}

static void open_once(const char *path, uint64_t budget) {
    fm_octree *coarse = NULL;
    fm_octree_info info;
    fm_octree_stream *stream = NULL;
    const fm_octree_stream_desc desc = {.budget = budget, .distance = 1e18f, .fade_ms = -1, .retry_ms = -1};
    if (fm_octree_read(context, path, &coarse) != FM_OK) {
        expect(false);
        return;
    }
    fm_octree_describe(coarse, &info);
    fm_octree_destroy(coarse);
    const fm_result result = fm_octree_stream_open(context, path, &desc, &stream);
    if (result != FM_OK) {
        expect(!stream && false);
        return;
    }
    for (int within = 0; within < 2; within++) {
        const fm_camera camera = look(&info, within != 0);
        show(stream, &camera);
    }
    fm_octree_stream_close(stream);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    const fm_context_desc cpu = {.backend = FM_BACKEND_CPU, .threads = 1};
    if (!context && (fm_context_create(&cpu, &context) != FM_OK || fm_octree_renderer_create(context, &renderer) != FM_OK)) {
        abort();
    }
    uint8_t *copy = malloc(size + 1);
    memcpy(copy, data, size);
    made_seal_parts(copy, size);
    const int file = memfd_create("parts", MFD_CLOEXEC);
    char path[64];
    snprintf(path, sizeof path, "/proc/self/fd/%d", file);
    if (file < 0 || write(file, copy, size) != (ssize_t)size) {
        abort();
    }
    open_once(path, 0);
    open_once(path, size);
    close(file);
    free(copy);
    return 0;
}
