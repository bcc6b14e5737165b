// SPDX-License-Identifier: MIT
// Octrees larger than memory: files with parts, budgets that are kept at every moment, parts that appear and go softly, reads that
// fail, and closing while they are under way.

#include "render/octree_stream.h"
#include "faulty.h"
#include "meshes.h"
#include "octree_made.h"
#include "vulkan_common.h"

#include <fcntl.h>
#include <math.h>
#include <pthread.h>

enum { SIZE = 96, PARTS = 6, COARSE = 24, WIDTH = 96, HEIGHT = 64 };

static fm_context *context;
static bool vulkan;
static vulkan_options options;

static bool open_with(const fm_allocator *allocator, fm_context **opened) {
    const fm_context_desc desc = {.backend = FM_BACKEND_CPU, .threads = 2, .allocator = allocator};
    return (vulkan ? vulkan_open(&options, allocator, opened) : fm_context_create(&desc, opened)) == FM_OK;
}

static bool open_context(fm_context **opened) {
    return open_with(NULL, opened);
}

static void close_context(fm_context *opened) {
    if (vulkan) {
        vulkan_close(opened);
    } else {
        fm_context_destroy(opened);
    }
}

static const float middle[3] = {0.5f, -1, 2};

static fm_mesh *make_mesh(fm_context *owner) {
    scene_mesh scene = scene_mesh_torus(96, 48, middle, 1, 0.35f);
    const fm_mesh_desc desc = scene_mesh_describe(&scene);
    fm_mesh *mesh = NULL;
    CHECK_OK(fm_mesh_create(owner, &desc, &mesh));
    scene_mesh_free(&scene);
    return mesh;
}

// Looks at the torus from all around.
static fm_camera camera_at(double angle, double far_away) {
    fm_camera camera = {.fov_y = 50};
    const double way[3] = {cos(angle), sin(angle), 0.6};
    for (int i = 0; i < 3; i++) {
        camera.position[i] = (float)((double)middle[i] + far_away * way[i]);
        camera.forward[i] = (float)-way[i];
    }
    return camera;
}

static uint64_t octree_bytes(bool peak) {
    fm_memory memory[64];
    uint32_t count = 64;
    uint64_t bytes = 0;
    CHECK_OK(fm_context_memory(context, &count, memory));
    for (uint32_t i = 0; i < count; i++) {
        if (strcmp(memory[i].purpose, "octrees") == 0 && memory[i].device == (context->gpu != NULL)) {
            bytes = peak ? memory[i].peak : memory[i].bytes;
        }
    }
    return bytes;
}

static void write_divided(const char *path, const fm_octree_desc *octree, const fm_octree_parts *parts) {
    fm_context *cpu = NULL;
    const fm_context_desc desc = {.backend = FM_BACKEND_CPU, .threads = 1};
    CHECK_OK(fm_context_create(&desc, &cpu));
    fm_mesh *mesh = make_mesh(cpu);
    CHECK_OK(fm_octree_write_parts(mesh, octree, parts, path));
    fm_mesh_destroy(mesh);
    fm_context_destroy(cpu);
}

static void write_file(const char *path, fm_octree_kind kind) {
    write_divided(path, &(fm_octree_desc){.kind = kind, .size = SIZE}, &(fm_octree_parts){.parts = PARTS, .coarse = COARSE});
}

// ---------------------------------------------------------------------------------------------------------------------------
// Pictures
// ---------------------------------------------------------------------------------------------------------------------------

static void draw(fm_octree_stream *stream, fm_octree *octree, const fm_camera *camera, fm_octree_hit *hits) {
    const fm_octree_render_desc desc = {
        .camera = *camera, .width = WIDTH, .height = HEIGHT, .stream = stream, .octree = octree, .view = FM_OCTREE_NORMALS};
    fm_octree_renderer *renderer = NULL;
    if (CHECK_OK(fm_octree_renderer_create(context, &renderer))) {
        CHECK_OK(fm_octree_render(renderer, &desc, NULL));
        CHECK_OK(fm_octree_renderer_hits(renderer, hits));
    }
    fm_octree_renderer_destroy(renderer);
}

// Where the ray of a pixel, as camera.c has it, meets the surface.
static void place_of(const fm_camera *camera, const fm_octree_hit *hit, int pixel, double at[3]) {
    const double slope = tan(50 * 3.14159265358979 / 360), aspect = (double)WIDTH / HEIGHT;
    double f[3], r[3], d[3], length = 0;
    for (int i = 0; i < 3; i++) {
        f[i] = (double)camera->forward[i];
        length += f[i] * f[i];
    }
    for (int i = 0; i < 3; i++) {
        f[i] /= sqrt(length);
    }
    const double side = sqrt(f[0] * f[0] + f[1] * f[1]);
    r[0] = f[1] / side, r[1] = -f[0] / side, r[2] = 0;
    d[0] = f[1] * r[2] - f[2] * r[1], d[1] = f[2] * r[0] - f[0] * r[2], d[2] = f[0] * r[1] - f[1] * r[0];
    const double x = (2 * (pixel % WIDTH + 0.5) / WIDTH - 1) * slope * aspect, y = (2 * (pixel / WIDTH + 0.5) / HEIGHT - 1) * slope;
    length = 0;
    for (int i = 0; i < 3; i++) {
        at[i] = f[i] + x * r[i] + y * d[i];
        length += at[i] * at[i];
    }
    for (int i = 0; i < 3; i++) {
        at[i] = (double)camera->position[i] + (double)hit->t * at[i] / sqrt(length);
    }
}

// From the torus.
static double distance_of(const fm_camera *camera, const fm_octree_hit *hit, int pixel) {
    double at[3];
    place_of(camera, hit, pixel, at);
    const double x = at[0] - (double)middle[0], y = at[1] - (double)middle[1], z = at[2] - (double)middle[2];
    const double ring = sqrt(x * x + y * y) - 1;
    return fabs(sqrt(ring * ring + z * z) - 0.35);
}

// What pictures see of the parts, on the CPU.
static const fm_octree_part *table_of(const fm_octree_stream *stream) {
    return (const fm_octree_part *)(uintptr_t)fm_octree_stream_grid(stream).parts;
}

// The part of a stream that a place is in.
static const fm_octree_part *part_at(const fm_octree_stream *stream, const double at[3]) {
    const fm_octree_grid grid = fm_octree_stream_grid(stream);
    int place[3];
    for (int i = 0; i < 3; i++) {
        place[i] = (int)fmin(fmax((at[i] - (double)grid.origin[i]) / (double)grid.size, 0), grid.count[i] - 1);
    }
    return &table_of(stream)[place[0] + grid.count[0] * (place[1] + grid.count[1] * place[2])];
}

// How far hits are from the surface, in finest cells: the mean.
static double picture_error(const fm_camera *camera, const fm_octree_hit *hits, double cell, int *count) {
    double sum = 0;
    *count = 0;
    for (int i = 0; i < WIDTH * HEIGHT; i++) {
        if (hits[i].t < INFINITY) {
            sum += distance_of(camera, &hits[i], i) / cell;
            ++*count;
        }
    }
    return *count > 0 ? sum / *count : 0;
}

// Pixels that see a part that is not there. What of a part is seen in hardly a pixel may be passed by.
static int count_coarse(const fm_octree_stream *stream, const fm_camera *camera, const fm_octree_hit *hits) {
    int coarse = 0;
    for (int i = 0; i < WIDTH * HEIGHT; i++) {
        double at[3];
        if (hits[i].t < INFINITY) {
            place_of(camera, &hits[i], i, at);
            coarse += !(part_at(stream, at)->shown > 0);
        }
    }
    return coarse;
}

// A camera that stands still comes to see all parts, look by look.
static void look_on(const char *path) {
    static fm_octree_hit hits[WIDTH * HEIGHT];
    const fm_octree_stream_desc all = {.distance = 100, .fade_ms = -1};
    const fm_camera camera = camera_at(2, 2.5);
    fm_octree_stream *stream = NULL;
    int count = 0;
    if (!CHECK_OK(fm_octree_stream_open(context, path, &all, &stream))) {
        return;
    }
    for (int i = 0; i < 400; i++) {
        CHECK_OK(fm_octree_stream_update(stream, &camera, false));
        usleep(500);
    }
    draw(stream, NULL, &camera, hits);
    picture_error(&camera, hits, 1, &count);
    CHECK(count > 500 && count_coarse(stream, &camera, hits) <= count / 100);
    fm_octree_stream_close(stream);
}

// How far what rays hit is from where those of another picture do, in cells along the ray: the mean where both hit.
static double picture_change(const fm_octree_hit *a, const fm_octree_hit *b, double cell) {
    double sum = 0;
    int count = 0;
    for (int i = 0; i < WIDTH * HEIGHT; i++) {
        if (a[i].t < INFINITY && b[i].t < INFINITY) {
            sum += fabs((double)(a[i].t - b[i].t)) / cell;
            count++;
        }
    }
    return count > 0 ? sum / count : INFINITY;
}

static void compare_pictures(const char *path, fm_octree_kind kind) {
    static fm_octree_hit whole[WIDTH * HEIGHT], parts[WIDTH * HEIGHT], coarse[WIDTH * HEIGHT];
    const fm_octree_desc desc = {.kind = kind, .size = SIZE};
    const fm_octree_stream_desc all = {.distance = 100, .fade_ms = -1};
    fm_mesh *mesh = make_mesh(context);
    fm_octree *octree = NULL, *rough = NULL;
    fm_octree_stream *stream = NULL;
    if (!CHECK_OK(fm_octree_build_mesh(mesh, &desc, &octree)) || !CHECK_OK(fm_octree_read(context, path, &rough)) ||
        !CHECK_OK(fm_octree_stream_open(context, path, &all, &stream))) {
        fm_octree_destroy(rough);
        fm_octree_destroy(octree);
        fm_mesh_destroy(mesh);
        return;
    }
    const double cell = octree->info.cell;
    CHECK(rough->info.parts == PARTS * PARTS * 2 && rough->info.cells[0] == COARSE);
    for (int i = 0; i < 3; i++) {
        const fm_camera camera = camera_at(i * 2.0, i == 2 ? 0.9 : 2.5);
        fm_octree_stream_info info;
        int count = 0, whole_count = 0, differ = 0;
        CHECK_OK(fm_octree_stream_update(stream, &camera, true));
        fm_octree_stream_describe(stream, &info);
        CHECK(info.wanted > 0 && info.resident >= info.wanted && info.failed == 0 && info.parts == rough->info.parts);
        draw(NULL, octree, &camera, whole);
        draw(NULL, rough, &camera, coarse);
        draw(stream, NULL, &camera, parts);
        const double fine = picture_error(&camera, parts, cell, &count), wanted = picture_error(&camera, whole, cell, &whole_count);
        const double change = picture_change(parts, whole, cell), was = picture_change(coarse, whole, cell);
        for (int p = 0; p < WIDTH * HEIGHT; p++) {
            const bool hit = parts[p].t < INFINITY, there = whole[p].t < INFINITY;
            differ += hit != there || (hit && fabs((double)(parts[p].t - whole[p].t)) > 2 * cell);
        }
        CHECK(context->gpu || count_coarse(stream, &camera, parts) <= count / 100);
        // As good as the whole one, and far better than the coarse one.
        if (!CHECK(count > 500 && fine < 1.3 * wanted + 0.02 && change < 0.7 * was && differ <= count / 50)) {
            fprintf(stderr, "    camera %d: off by %g cells in parts, %g whole; %g and, coarse, %g apart; %d of %d pixels differ\n",
                    i, fine, wanted, change, was, differ, count);
        }
    }
    fm_octree_stream_close(stream);
    fm_octree_destroy(rough);
    fm_octree_destroy(octree);
    fm_mesh_destroy(mesh);
}

// ---------------------------------------------------------------------------------------------------------------------------
// Budget and fading
// ---------------------------------------------------------------------------------------------------------------------------

// A part's share changes no faster than it may, and none goes while it is seen.
static void check_shares(const fm_octree_part *before, const fm_octree_part *now, uint32_t parts, double most) {
    for (uint32_t i = 0; i < parts; i++) {
        CHECK(now[i].shown >= 0 && now[i].shown <= 1 && (now[i].head != 0 || now[i].shown == 0));
        CHECK(fabs((double)(now[i].shown - before[i].shown)) <= most + 1e-6);
    }
}

static void move(const char *path, uint64_t budget, float fade_ms, bool wait) {
    enum { STEPS = 40, MOST_PARTS = 2 * PARTS * PARTS };
    static fm_octree_part before[MOST_PARTS];
    const fm_octree_stream_desc desc = {.budget = budget, .distance = 100, .fade_ms = fade_ms};
    fm_octree_stream *stream = NULL;
    fm_octree_stream_info info = {0};
    fm_context *const usual = context;
    // One that has had no octrees, so that its peak is the stream's.
    if (!CHECK(open_context(&context)) || !CHECK_OK(fm_octree_stream_open(context, path, &desc, &stream))) {
        context = usual;
        return;
    }
    uint64_t last = 0;
    memset(before, 0, sizeof before);
    for (int i = 0; i < STEPS; i++) {
        const fm_camera camera = camera_at(i * 0.3, 1.6);
        const uint64_t start = fm_now_ns();
        CHECK_OK(fm_octree_stream_update(stream, &camera, wait));
        const uint64_t now = fm_now_ns();
        fm_octree_stream_describe(stream, &info);
        CHECK(info.bytes <= budget && info.budget == budget);
        CHECK(octree_bytes(false) <= budget);
        if (!context->gpu && !wait) {
            // From the start of the update before, at the earliest, to the end of this one.
            const double most = fade_ms < 0 ? 1 : last > 0 ? 1e-6 * (double)(now - last) / (double)fade_ms : 0;
            check_shares(before, table_of(stream), info.parts, most);
            memcpy(before, table_of(stream), info.parts * sizeof *before);
        }
        last = start;
        usleep(1000);
    }
    CHECK(info.loaded > 0 && info.failed == 0);
    CHECK(!wait || (info.dropped > 0 && info.resident > 0));
    CHECK(octree_bytes(true) > 0 && octree_bytes(true) <= budget);
    fm_octree_stream_close(stream);
    CHECK(octree_bytes(false) == 0);
    close_context(context);
    context = usual;
}

// All parts come where the budget has room for all, however small they are; `bytes` are theirs.
static void load_all(uint32_t size, uint32_t along, uint64_t least, uint64_t most) {
    char path[512];
    snprintf(path, sizeof path, "%s", io_path("small.fmo"));
    write_divided(path, &(fm_octree_desc){.size = size}, &(fm_octree_parts){.parts = along, .coarse = 8});
    fm_fmo_header header;
    size_t length = 0;
    uint8_t *contents = io_contents(path, &length);
    memcpy(&header, contents, sizeof header);
    free(contents);
    const uint64_t count = (uint64_t)header.parts[0] * header.parts[1] * header.parts[2];
    const uint64_t bytes = length - header.image_bytes - fm_fmo_directory_bytes(count);
    if (!CHECK(bytes >= least && bytes <= most && bytes % (1 << 16) != 0)) {
        fprintf(stderr, "    %llu bytes of parts\n", (unsigned long long)bytes);
    }
    const fm_octree_stream_desc desc = {.distance = 100, .fade_ms = -1};
    fm_octree_stream *stream = NULL;
    fm_octree_stream_info info = {0};
    if (!CHECK_OK(fm_octree_stream_open(context, path, &desc, &stream))) {
        return;
    }
    for (int i = 0; i < 4; i++) {
        const fm_camera camera = camera_at(i * 1.6 + 0.8, 3);
        CHECK_OK(fm_octree_stream_update(stream, &camera, true));
        fm_octree_stream_describe(stream, &info);
        CHECK(info.wanted > 0 && info.resident >= info.wanted);
    }
    if (!CHECK(info.resident == count && info.dropped == 0 && info.failed == 0)) {
        fprintf(stderr, "    %u of %llu parts\n", info.resident, (unsigned long long)count);
    }
    fm_octree_stream_close(stream);
}

// Between two pictures no more pixels change than the shares of parts do.
static void soft(const char *path) {
    enum { STEPS = 30 };
    static fm_octree_hit hits[2][WIDTH * HEIGHT];
    const fm_octree_stream_desc desc = {.distance = 100, .fade_ms = 400};
    const fm_camera camera = camera_at(1, 2);
    fm_octree_stream *stream = NULL;
    if (!CHECK_OK(fm_octree_stream_open(context, path, &desc, &stream))) {
        return;
    }
    double shown = 0, greatest = 0;
    for (int i = 0; i < STEPS; i++) {
        CHECK_OK(fm_octree_stream_update(stream, &camera, i == 0));
        const fm_octree_part *table = table_of(stream);
        const double shown_before = shown;
        shown = 0;
        for (int p = 0; p < 2 * PARTS * PARTS; p++) {
            shown = fmax(shown, (double)table[p].shown);
        }
        draw(stream, NULL, &camera, hits[i % 2]);
        int changed = 0, count = 0;
        for (int p = 0; p < WIDTH * HEIGHT; p++) {
            changed += hits[0][p].t != hits[1][p].t;
            count += hits[i % 2][p].t < INFINITY;
        }
        CHECK(i > 0 || shown == 0);
        if (i > 0 && !CHECK(changed <= (shown - shown_before) * count * 1.3 + 0.06 * count)) {
            fprintf(stderr, "    %d of %d pixels changed, from %g to %g\n", changed, count, shown_before, shown);
        }
        greatest = fmax(greatest, (double)changed / count);
        usleep(15000);
    }
    CHECK(shown > 0.5 && greatest > 0);
    fm_octree_stream_close(stream);
}

// ---------------------------------------------------------------------------------------------------------------------------
// What goes wrong
// ---------------------------------------------------------------------------------------------------------------------------

static void arguments(const char *path, const char *plain) {
    fm_octree_stream *stream = NULL;
    fm_octree_stream_info info;
    const fm_camera camera = camera_at(0, 2), nowhere = {.position = {NAN}};
    CHECK_FAILS(fm_octree_stream_open(NULL, path, NULL, &stream), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_octree_stream_open(context, NULL, NULL, &stream), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_octree_stream_open(context, path, NULL, NULL), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_octree_stream_open(context, io_path("none.fmo"), NULL, &stream), FM_ERROR_IO);
    CHECK_FAILS(fm_octree_stream_open(context, io_directory, NULL, &stream), FM_ERROR_IO);
    CHECK_FAILS(fm_octree_stream_open(context, plain, NULL, &stream), FM_ERROR_FORMAT);
    CHECK_FAILS(fm_octree_stream_open(context, path, &(fm_octree_stream_desc){.budget = 1}, &stream), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_octree_stream_open(context, path, &(fm_octree_stream_desc){.budget = 20000}, &stream),
                FM_ERROR_INVALID_ARGUMENT);
    CHECK(strstr(fm_last_error(), "budget is 20000 bytes: the coarse octree") != NULL);
    CHECK_FAILS(fm_octree_stream_open(context, path, &(fm_octree_stream_desc){.retry_ms = NAN}, &stream),
                FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_octree_stream_open(context, path, &(fm_octree_stream_desc){.distance = -1}, &stream), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_octree_stream_open(context, path, &(fm_octree_stream_desc){.fade_ms = NAN}, &stream), FM_ERROR_INVALID_ARGUMENT);
    CHECK(stream == NULL);
    fm_octree_stream_close(NULL);
    if (!CHECK_OK(fm_octree_stream_open(context, path, NULL, &stream))) {
        return;
    }
    CHECK_FAILS(fm_octree_stream_update(NULL, &camera, false), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_octree_stream_update(stream, NULL, false), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_octree_stream_update(stream, &nowhere, false), FM_ERROR_INVALID_ARGUMENT);
    fm_octree_stream_describe(NULL, &info);
    fm_octree_stream_describe(stream, NULL);
    fm_octree_stream_describe(stream, &info);
    CHECK(info.resident == 0 && info.wanted == 0 && info.budget == 256 << 20);
    fm_octree_stream_close(stream);
}

static void parts_arguments(void) {
    fm_mesh *mesh = make_mesh(context);
    const char *path = io_path("x.fmo");
    const fm_octree_desc desc = {.size = 32};
    CHECK_FAILS(fm_octree_write_parts(NULL, &desc, NULL, path), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_octree_write_parts(mesh, &desc, NULL, NULL), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_octree_write_parts(mesh, &desc, &(fm_octree_parts){.parts = 33}, path), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_octree_write_parts(mesh, &desc, &(fm_octree_parts){.coarse = 33}, path), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_octree_write_parts(mesh, &(fm_octree_desc){.size = 1 << 20}, &(fm_octree_parts){.parts = 1025}, path),
                FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_octree_write_parts(mesh, &desc, NULL, io_path("no/x.fmo")), FM_ERROR_IO);
    CHECK(!io_exists(path));
    fm_octree_parts_info info = {.filled = 7};
    CHECK_FAILS(fm_octree_describe_parts(NULL, path, true, &info), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_octree_describe_parts(context, NULL, true, &info), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_octree_describe_parts(context, path, true, NULL), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_octree_describe_parts(context, path, true, &info), FM_ERROR_IO);
    fm_octree *octree = NULL;
    if (CHECK_OK(fm_octree_build_mesh(mesh, &desc, &octree)) && CHECK_OK(fm_octree_write(octree, path))) {
        CHECK_FAILS(fm_octree_describe_parts(context, path, true, &info), FM_ERROR_FORMAT);
    }
    fm_octree_destroy(octree);
    CHECK(info.filled == 7);
    CHECK_OK(fm_octree_write_parts(mesh, &desc, &(fm_octree_parts){.parts = 4, .coarse = 8}, path));
    CHECK_OK(fm_octree_describe_parts(context, path, true, &info));
    CHECK(info.cells == 8 && info.filled > 0 && info.filled <= info.along[0] * info.along[1] * info.along[2]);
    fm_mesh_destroy(mesh);
}

// The file as bytes, changed, and opened: the result.
static fm_result open_changed(const uint8_t *bytes, size_t size, const fm_octree_stream_desc *desc, fm_octree_stream **stream) {
    const char *path = io_path("changed.fmo");
    io_store(path, bytes, size);
    return fm_octree_stream_open(context, path, desc, stream);
}

static void bad_directory(const uint8_t *bytes, size_t size) {
    fm_fmo_header header;
    memcpy(&header, bytes, sizeof header);
    const uint64_t count = (uint64_t)header.parts[0] * header.parts[1] * header.parts[2];
    const size_t begin = size - fm_fmo_directory_bytes(count), end = begin + count * sizeof(fm_fmo_part);
    uint8_t *copy = malloc(size);
    fm_octree_stream *stream = NULL;
    for (size_t cut = 1; cut < size; cut += size / 20 + 1) {
        CHECK_FAILS(open_changed(bytes, size - cut, NULL, &stream), FM_ERROR_FORMAT);
    }
    CHECK_FAILS(open_changed(bytes, size - FM_FMO_PAGE, NULL, &stream), FM_ERROR_FORMAT);
    CHECK_FAILS(open_changed((const uint8_t *)"\x1f\x8b\x08", 3, NULL, &stream), FM_ERROR_FORMAT);
    CHECK(strstr(fm_last_error(), "gunzip") != NULL);
    memcpy(copy, bytes, size);
    copy[begin + 5] ^= 1;
    CHECK_FAILS(open_changed(copy, size, NULL, &stream), FM_ERROR_FORMAT);
    const fm_fmo_part wrong[] = {{.offset = begin, .bytes = FM_FMO_PAGE},
                                 {.offset = 0, .bytes = FM_FMO_PAGE},
                                 {.offset = header.image_bytes + 1, .bytes = FM_FMO_PAGE},
                                 {.offset = header.image_bytes, .bytes = 100},
                                 {.offset = UINT64_MAX - 4095, .bytes = FM_FMO_PAGE},
                                 {.offset = header.image_bytes, .bytes = UINT64_MAX - 4095}};
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        memcpy(copy, bytes, size);
        memcpy(copy + begin, &wrong[i], sizeof wrong[i]);
        const uint32_t sum = (uint32_t)crc32_z(0, copy + begin, end - begin);
        memcpy(copy + end, &sum, sizeof sum);
        CHECK_FAILS(open_changed(copy, size, NULL, &stream), FM_ERROR_FORMAT);
        CHECK(strstr(fm_last_error(), "part 0") != NULL);
    }
    CHECK(stream == NULL);
    free(copy);
}

static void bad_edges(const uint8_t *bytes, size_t size) {
    static const double wrong[] = {1e-44, 1e-30, 1e30, 1e300, NAN, 0.5, 2};  // the last two: times what it is
    uint8_t *copy = malloc(size);
    fm_octree_stream *stream = NULL;
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        fm_fmo_header header;
        memcpy(copy, bytes, size);
        memcpy(&header, copy, sizeof header);
        header.part_edge = i < 5 ? wrong[i] : wrong[i] * header.part_edge;
        memcpy(copy, &header, sizeof header);
        fm_fmo_seal(copy);
        CHECK_FAILS(open_changed(copy, size, NULL, &stream), FM_ERROR_FORMAT);
        CHECK(strstr(fm_last_error(), "parts of") != NULL);
    }
    CHECK(stream == NULL);
    free(copy);
}

// Parts that fail stay coarse, are counted once and told of; others come, and pictures can be made.
static void check_failing(fm_octree_stream *stream, uint64_t least, const char *says) {
    static fm_octree_hit hits[WIDTH * HEIGHT];
    fm_octree_stream_info info;
    const fm_camera camera = camera_at(0.4, 2.5);
    for (int i = 0; i < 3; i++) {
        CHECK_OK(fm_octree_stream_update(stream, &camera, true));
        fm_octree_stream_describe(stream, &info);
        if (!CHECK(info.failed >= least && info.failed <= info.parts && info.failing == info.failed &&
                   strstr(info.failure, says) != NULL)) {
            fprintf(stderr, "    %llu failed: %s\n", (unsigned long long)info.failed, info.failure);
        }
        CHECK(info.resident >= info.wanted);
        draw(stream, NULL, &camera, hits);
        int count = 0;
        picture_error(&camera, hits, 1, &count);
        CHECK(count > 500);
    }
    fm_octree_stream_close(stream);
}

// A wrong byte in every part, at a place in it.
static uint8_t *spoil(const uint8_t *bytes, size_t size, uint64_t at) {
    fm_fmo_header header;
    memcpy(&header, bytes, sizeof header);
    const uint64_t count = (uint64_t)header.parts[0] * header.parts[1] * header.parts[2];
    uint8_t *copy = malloc(size);
    memcpy(copy, bytes, size);
    for (uint64_t part = 0; part < count; part++) {
        fm_fmo_part row;
        memcpy(&row, bytes + size - fm_fmo_directory_bytes(count) + part * sizeof row, sizeof row);
        if (row.bytes > 0) {
            copy[row.offset + at] ^= 0x10;
        }
    }
    return copy;
}

// Parts that cannot be read are tried again, ever less often, and come once they can be. Until then the picture is coarse.
static void recover(const uint8_t *bytes, size_t size) {
    enum { MOST_LOOKS = 4000 };
    static fm_octree_hit hits[WIDTH * HEIGHT];
    const fm_octree_stream_desc desc = {.distance = 100, .fade_ms = -1, .retry_ms = 20};
    const fm_camera camera = camera_at(0.4, 2.5);
    const char *path = io_path("changed.fmo");
    fm_octree_stream *stream = NULL;
    fm_octree_stream_info info = {0};
    uint8_t *copy = spoil(bytes, size, FM_FMO_PAGE + 9);
    const uint64_t start = fm_now_ns();
    if (!CHECK_OK(open_changed(copy, size, &desc, &stream))) {
        free(copy);
        return;
    }
    for (int i = 0; i < MOST_LOOKS && info.failed <= 5 * (uint64_t)info.parts; i++) {
        CHECK_OK(fm_octree_stream_update(stream, &camera, true));
        fm_octree_stream_describe(stream, &info);
        usleep(1000);
    }
    const double tries = 2 + log2(1 + 1e-6 * (double)(fm_now_ns() - start) / 20);
    if (!CHECK(info.failing > 10 && info.failed > info.failing && (double)info.failed <= tries * info.parts)) {
        fprintf(stderr, "    %u of %u parts failed %llu times\n", info.failing, info.parts, (unsigned long long)info.failed);
    }
    CHECK(info.resident == 0 && info.loaded == 0 && info.bytes <= info.budget && strstr(info.failure, "checksum") != NULL);
    int count = 0;
    draw(stream, NULL, &camera, hits);
    picture_error(&camera, hits, 1, &count);
    CHECK(count > 500);
    const int file = open(path, O_WRONLY | O_CLOEXEC);
    CHECK(file >= 0 && pwrite(file, bytes, size, 0) == (ssize_t)size && close(file) == 0);
    for (int i = 0; i < MOST_LOOKS && (info.failing > 0 || info.resident < info.wanted || info.resident == 0); i++) {
        CHECK_OK(fm_octree_stream_update(stream, &camera, false));
        fm_octree_stream_describe(stream, &info);
        usleep(1000);
    }
    CHECK(info.failing == 0 && info.resident >= info.wanted && info.resident > 10 && strstr(info.failure, "checksum") != NULL);
    draw(stream, NULL, &camera, hits);
    CHECK(context->gpu || count_coarse(stream, &camera, hits) <= count / 100);
    fm_octree_stream_close(stream);
    free(copy);
}

static void failing_reads(const uint8_t *bytes, size_t size) {
    const fm_octree_stream_desc desc = {.distance = 100, .fade_ms = -1, .retry_ms = -1};
    const char *path = io_path("changed.fmo");
    fm_fmo_header header;
    memcpy(&header, bytes, sizeof header);
    const uint64_t count = (uint64_t)header.parts[0] * header.parts[1] * header.parts[2];
    fm_fmo_part *rows = malloc(count * sizeof *rows);
    uint8_t *copy = malloc(size);
    fm_octree_stream *stream = NULL;
    memcpy(rows, bytes + size - fm_fmo_directory_bytes(count), count * sizeof *rows);
    // Cut while it is open.
    if (CHECK_OK(open_changed(bytes, size, &desc, &stream))) {
        CHECK(truncate(path, (off_t)(header.image_bytes + (size - header.image_bytes) / 2)) == 0);
        check_failing(stream, 5, "truncated");
    }
    if (CHECK_OK(open_changed(bytes, size, &desc, &stream))) {
        CHECK(truncate(path, 0) == 0);
        check_failing(stream, 10, "truncated");
    }
    // A wrong byte in every part, in its header, in its nodes, or another part in its place.
    const struct {
        uint64_t at;
        const char *says;
    } spots[] = {{FM_FMO_PAGE + 9, "checksum of section"}, {60, "checksum of its header"}, {0, "does not begin"}};
    for (size_t i = 0; i < sizeof spots / sizeof *spots; i++) {
        uint8_t *spoilt = spoil(bytes, size, spots[i].at);
        if (CHECK_OK(open_changed(spoilt, size, &desc, &stream))) {
            check_failing(stream, 10, spots[i].says);
        }
        free(spoilt);
    }
    memcpy(copy, bytes, size);
    for (uint64_t part = 0; part < count; part++) {
        if (rows[part].bytes > 0) {
            memcpy(copy + rows[part].offset, bytes, FM_FMO_PAGE);
        }
    }
    if (CHECK_OK(open_changed(copy, size, &desc, &stream))) {
        check_failing(stream, 10, "part");
    }
    // A directory that tells of every part in another's place.
    const size_t begin = size - fm_fmo_directory_bytes(count);
    memcpy(copy, bytes, size);
    for (uint64_t part = 0; part < count; part++) {
        memcpy(copy + begin + part * sizeof *rows, &rows[count - 1 - part], sizeof *rows);
    }
    const uint32_t sum = (uint32_t)crc32_z(0, copy + begin, count * sizeof *rows);
    memcpy(copy + begin + count * sizeof *rows, &sum, sizeof sum);
    if (CHECK_OK(open_changed(copy, size, &desc, &stream))) {
        check_failing(stream, 10, "its place among the parts");
    }
    free(copy);
    free(rows);
}

static void close_early(const char *path) {
    for (int i = 0; i < 30; i++) {
        fm_octree_stream *stream = NULL;
        const fm_octree_stream_desc desc = {.distance = 100, .fade_ms = i % 2 ? -1.0f : 0.0f};
        const fm_camera camera = camera_at(i, 2);
        CHECK_OK(fm_octree_stream_open(context, path, &desc, &stream));
        for (int k = 0; k < i % 4; k++) {
            CHECK_OK(fm_octree_stream_update(stream, &camera, false));
        }
        fm_octree_stream_close(stream);
    }
}

static fm_result attempt(fm_context *owner, void *user) {
    fm_octree_stream *stream = NULL;
    const fm_octree_stream_desc desc = {.distance = 100, .fade_ms = -1};
    const fm_camera camera = camera_at(0, 3);
    fm_result result = fm_octree_stream_open(owner, user, &desc, &stream);
    result = result == FM_OK ? fm_octree_stream_update(stream, &camera, true) : result;
    fm_octree_stream_close(stream);
    return result;
}

// Whenever memory runs out, pictures show the surface as the coarse octree has it: no part where another one was before.
static void failing_memory(const char *path) {
    enum { STEPS = 48 };
    static fm_octree_hit hits[WIDTH * HEIGHT], coarse[WIDTH * HEIGHT];
    faulty f = {.left = -1};
    const fm_allocator allocator = {faulty_alloc, faulty_free, &f};
    const fm_octree_stream_desc desc = {.budget = 500000, .distance = 100, .fade_ms = -1};
    fm_octree_stream *stream = NULL;
    fm_octree *rough = NULL;
    fm_octree_stream_info info = {0};
    fm_context *const usual = context;
    int failures = 0;
    if (!CHECK(open_with(&allocator, &context)) || !CHECK_OK(fm_octree_read(context, path, &rough)) ||
        !CHECK_OK(fm_octree_stream_open(context, path, &desc, &stream))) {
        context = usual;
        return;
    }
    for (int i = 0; i < STEPS; i++) {
        const fm_camera camera = camera_at(i * 0.4, 1.8);
        f.left = i % 8 > 1 ? 1 + i % 2 : -1;
        const fm_result result = fm_octree_stream_update(stream, &camera, true);
        f.left = -1;
        CHECK(result == FM_OK || result == FM_ERROR_OUT_OF_HOST_MEMORY);
        failures += result != FM_OK;
        draw(stream, NULL, &camera, hits);
        draw(NULL, rough, &camera, coarse);
        int count = 0, off = 0;
        for (int p = 0; p < WIDTH * HEIGHT; p++) {
            const bool hit = hits[p].t < INFINITY, there = coarse[p].t < INFINITY;
            count += there;
            off += hit != there || (hit && fabs((double)(hits[p].t - coarse[p].t)) > 0.1);
        }
        if (!CHECK(count > 2000 && off <= count / 40)) {
            fprintf(stderr, "    step %d: %d of %d pixels are off the surface\n", i, off, count);
        }
    }
    fm_octree_stream_describe(stream, &info);
    CHECK(failures > STEPS / 4 && info.dropped > 10 && info.failed == 0);
    fm_octree_stream_close(stream);
    fm_octree_destroy(rough);
    close_context(context);
    CHECK(f.live == 0);
    context = usual;
}

static void run(void) {
    char path[512], plain[512];
    snprintf(path, sizeof path, "%s", io_path("parts.fmo"));
    snprintf(plain, sizeof plain, "%s", io_path("plain.fmo"));
    fm_octree *octree = made_octree(context, &(fm_octree_desc){.size = 32}, 1);
    CHECK_OK(fm_octree_write(octree, plain));
    fm_octree_destroy(octree);
    write_file(path, FM_OCTREE_DISTANCE);
    compare_pictures(path, FM_OCTREE_DISTANCE);
    write_file(path, FM_OCTREE_CLOSEST);
    compare_pictures(path, FM_OCTREE_CLOSEST);
    arguments(path, plain);
    parts_arguments();
    load_all(20, 2, 1 << 16, 1 << 20);
    load_all(16, 1, 1, (1 << 16) - 1);
    failing_memory(path);
    move(path, 400000, 20, false);
    move(path, 300000, -1, false);
    move(path, 500000, 30, true);
    if (!context->gpu) {
        look_on(path);
        soft(path);
        exhaust("a stream", attempt, path, -1);
    }
    size_t size = 0;
    uint8_t *bytes = io_contents(path, &size);
    bad_directory(bytes, size);
    bad_edges(bytes, size);
    failing_reads(bytes, size);
    recover(bytes, size);
    close_early(path);
    free(bytes);
}

int main(int count, char **words) {
    vulkan = count > 1;
    if (!vulkan_parse(count, words, &options)) {
        return 2;
    }
    if (!open_context(&context)) {
        return vulkan_missing();
    }
    if (io_begin()) {
        run();
    }
    close_context(context);
    return io_end();
}
