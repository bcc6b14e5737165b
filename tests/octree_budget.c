// SPDX-License-Identifier: MIT
// A model whose parts take more memory than it may have: never is more resident than the budget says, and what is near the camera
// comes to look as it does without one. By default an eighth of 2048 x 1024 x 1024 cells along each axis and, since surfaces go
// by squares, a 64th of 256 MiB. FATHOM_BIG=1 takes the whole, of 1.4 million triangles: minutes on a device, and about 3 GB of
// disk.

#include "fathom/octree_render.h"
#include "io_common.h"
#include "meshes.h"
#include "vulkan_common.h"

#include <math.h>

enum { WIDTH = 192, HEIGHT = 128, PIXELS = WIDTH * HEIGHT, STEPS = 24 };

typedef struct scale {
    uint32_t size, parts, around;
    uint64_t budget;
} scale;

static const float FAR = 8;  // all of the model
static fm_context *context;

// Twice as long as it is wide, and nowhere flat.
static fm_mesh *make_mesh(fm_context *builder, const scale *own) {
    static const float middle[3] = {0};
    scene_mesh scene = scene_mesh_sphere(own->around / 2, own->around, middle, 1);
    for (uint64_t i = 0; i < scene.vertex_count; i++) {
        float *v = scene.vertices[i];
        const float bump = 0.92f + 0.04f * sinf(9 * v[0]) * sinf(11 * v[1] + 7 * v[2]);
        v[0] *= 2 * bump;
        v[1] *= bump;
        v[2] *= bump;
    }
    const fm_mesh_desc desc = scene_mesh_describe(&scene);
    fm_mesh *mesh = NULL;
    CHECK_OK(fm_mesh_create(builder, &desc, &mesh));
    scene_mesh_free(&scene);
    return mesh;
}

static bool write_model(fm_context *builder, const scale *own, const char *path) {
    const fm_octree_desc desc = {.size = own->size, .low = {-2, -1, -1}, .high = {2, 1, 1}, .threshold = -1};
    fm_mesh *mesh = make_mesh(builder, own);
    const bool good = CHECK_OK(fm_octree_write_parts(mesh, &desc, &(fm_octree_parts){.parts = own->parts}, path));
    fm_mesh_destroy(mesh);
    return good;
}

// The most bytes that octrees ever had on the device, or else on the host.
static uint64_t most_bytes(void) {
    fm_memory memory[32];
    uint32_t count = 32;
    uint64_t host = 0, device = 0;
    CHECK_OK(fm_context_memory(context, &count, memory));
    for (uint32_t i = 0; i < count; i++) {
        if (strcmp(memory[i].purpose, "octrees") == 0) {
            *(memory[i].device ? &device : &host) = memory[i].peak;
        }
    }
    return fm_context_backend(context) == FM_BACKEND_VULKAN ? device : host;
}

// Along the model, close to it, and at last close to its middle.
static fm_camera camera_at(int step) {
    const float x = -1.8f + 1.8f * (float)step / (STEPS - 1);
    return (fm_camera){.position = {x, -1.9f, 0.7f}, .forward = {0, 1, -0.37f}, .fov_y = 75};
}

static void draw(fm_octree_stream *stream, fm_octree *octree, const fm_camera *camera, fm_octree_hit *hits) {
    const fm_octree_render_desc desc = {.camera = *camera, .width = WIDTH, .height = HEIGHT, .stream = stream, .octree = octree};
    fm_octree_renderer *renderer = NULL;
    if (CHECK_OK(fm_octree_renderer_create(context, &renderer))) {
        CHECK_OK(fm_octree_render(renderer, &desc, NULL));
        CHECK_OK(fm_octree_renderer_hits(renderer, hits));
    }
    fm_octree_renderer_destroy(renderer);
}

static int by_time(const void *a, const void *b) {
    const float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

// Until where the nearest quarter of what is seen is.
static float nearest_quarter(const fm_octree_hit *hits) {
    static float times[PIXELS];
    int count = 0;
    for (int i = 0; i < PIXELS; i++) {
        times[count] = hits[i].t;
        count += hits[i].t < INFINITY;
    }
    CHECK(count > PIXELS / 4);
    qsort(times, (size_t)count, sizeof *times, by_time);
    return times[count / 4];
}

// The part of the pixels up to a time that are as in another picture, bit for bit.
static double same_near(const fm_octree_hit *hits, const fm_octree_hit *wanted, float until) {
    int count = 0, same = 0;
    for (int i = 0; i < PIXELS; i++) {
        if (wanted[i].t <= until) {
            count++;
            same += memcmp(&hits[i].t, &wanted[i].t, sizeof hits[i].t) == 0;
        }
    }
    return (double)same / count;
}

static void travel(const char *path, const scale *own, fm_octree_hit *hits) {
    const fm_octree_stream_desc desc = {.budget = own->budget, .distance = FAR, .fade_ms = -1};
    fm_octree_stream *stream = NULL;
    fm_octree_stream_info info = {0};
    uint64_t most = 0;
    if (!CHECK_OK(fm_octree_stream_open(context, path, &desc, &stream))) {
        return;
    }
    for (int step = 0; step < STEPS; step++) {
        const fm_camera camera = camera_at(step);
        for (int look = 0; look < 4; look++) {
            CHECK_OK(fm_octree_stream_update(stream, &camera, look == 3));
            fm_octree_stream_describe(stream, &info);
            most = info.bytes > most ? info.bytes : most;
            CHECK(info.bytes <= own->budget);
        }
    }
    printf("%u of %u parts, %u wanted; at most %.1f of %.1f MiB; %llu loaded, %llu dropped\n", info.resident, info.parts,
           info.wanted, (double)most / (1 << 20), (double)own->budget / (1 << 20), (unsigned long long)info.loaded,
           (unsigned long long)info.dropped);
    CHECK(info.budget == own->budget && info.failed == 0 && info.dropped > 0 && info.resident < info.wanted &&
          most > own->budget / 2);
    const uint64_t peak = most_bytes();
    CHECK(peak > own->budget / 2 && peak <= own->budget);
    const fm_camera camera = camera_at(STEPS - 1);
    draw(stream, NULL, &camera, hits);
    fm_octree_stream_close(stream);
}

static void compare(const char *path, const scale *own) {
    static fm_octree_hit limited[PIXELS], whole[PIXELS], coarse[PIXELS];
    const fm_octree_stream_desc all = {.budget = 64 * own->budget, .distance = FAR, .fade_ms = -1};
    const fm_camera camera = camera_at(STEPS - 1);
    fm_octree_stream *stream = NULL;
    fm_octree *rough = NULL;
    fm_octree_stream_info info = {0};
    travel(path, own, limited);
    if (CHECK_OK(fm_octree_read(context, path, &rough)) && CHECK_OK(fm_octree_stream_open(context, path, &all, &stream))) {
        CHECK_OK(fm_octree_stream_update(stream, &camera, true));
        fm_octree_stream_describe(stream, &info);
        draw(stream, NULL, &camera, whole);
        draw(NULL, rough, &camera, coarse);
        const float until = nearest_quarter(whole);
        const double same = same_near(limited, whole, until), before = same_near(coarse, whole, until);
        printf("without a budget %u parts, %.1f MiB; up to %g from the camera %.2f %% of the pixels are the same, %.2f %% were\n",
               info.resident, (double)info.bytes / (1 << 20), (double)until, 100 * same, 100 * before);
        CHECK(info.resident >= info.wanted && info.bytes > own->budget);
        CHECK(same >= 0.99 && before < 0.2);
    }
    fm_octree_stream_close(stream);
    fm_octree_destroy(rough);
}

static fm_result open_context(bool vulkan, const vulkan_options *options, fm_context **opened) {
    return vulkan ? vulkan_open(options, NULL, opened) : fm_context_create(&(fm_context_desc){.backend = FM_BACKEND_CPU}, opened);
}

static void close_context(bool vulkan, fm_context *opened) {
    if (vulkan) {
        vulkan_close(opened);
    } else {
        fm_context_destroy(opened);
    }
}

int main(int count, char **words) {
    const char *big = getenv("FATHOM_BIG");
    const bool whole = big && strcmp(big, "1") == 0, vulkan = count > 1;
    const scale own = whole ? (scale){2048, 16, 1200, 256 << 20} : (scale){256, 16, 160, 4 << 20};
    vulkan_options options;
    if (!vulkan_parse(count, words, &options)) {
        return 2;
    }
    if (open_context(vulkan, &options, &context) != FM_OK) {
        return vulkan_missing();
    }
    if (io_begin()) {
        const char *path = io_path("model.fmo");
        fm_context *builder = NULL;
        // Small parts are sooner built by a processor. In a context of its own, so that the other's peak is the stream's.
        const bool there = whole && vulkan;
        const bool written = CHECK_OK(open_context(there, &options, &builder)) && write_model(builder, &own, path);
        close_context(there, builder);
        if (written) {
            compare(path, &own);
        }
    }
    close_context(vulkan, context);
    return io_end();
}
