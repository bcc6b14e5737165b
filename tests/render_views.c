// SPDX-License-Identifier: MIT
// Pictures by their values at chosen pixels: colours, faces, shadows, occlusion, the field's slice, what is tinted and marked; sums
// and picks; and what is refused.

#include "render_common.h"

#include "fathom/io.h"

#include <limits.h>

enum { SIDE = 65, MIDDLE = 32, WORLD = 24 };

static const uint32_t RED = 0xe0, GREEN = 0x1c, GREY = 0x92;

// A floor at z = 2 with a block on it.
static uint32_t *make_voxels(void) {
    uint32_t *voxels = calloc((size_t)WORLD * WORLD * WORLD, sizeof *voxels);
    for (uint32_t i = 0; voxels && i < WORLD * WORLD * WORLD; i++) {
        const uint32_t x = i % WORLD, y = i / WORLD % WORLD, z = i / WORLD / WORLD;
        const bool block = x >= 10 && x < 14 && y >= 10 && y < 14 && z > 2 && z <= 8;
        voxels[i] = z <= 2 ? GREY : block ? (x == 13 ? GREEN : RED) : 0;
    }
    return voxels;
}

// Straight down onto a place, from z = 20, with x to the right and y up: a pixel in the middle is the place itself.
static fm_render_desc down_at(float x, float y) {
    return (fm_render_desc){.camera = {{x, y, 20}, {0, 0, -1}, {0, 1, 0}, 40}, .width = SIDE, .height = SIDE, .sun = {1, 0, 1}};
}

static uint8_t *pixel_at(uint8_t *pixels, uint32_t x, uint32_t y) {
    return pixels + 4 * (x + SIDE * y);
}

static int sum_of(const uint8_t *pixel) {
    return pixel[0] + pixel[1] + pixel[2];
}

// Sum of the middle pixel's channels.
static int middle_sum(render_stage *s, const fm_render_desc *desc) {
    uint8_t *pixels = render_picture(s, desc);
    const int sum = pixels ? sum_of(pixel_at(pixels, MIDDLE, MIDDLE)) : -1;
    free(pixels);
    return sum;
}

static void check_color(render_stage *s) {
    fm_render_desc desc = down_at(11, 11);
    uint8_t *pixels = render_picture(s, &desc);
    if (pixels) {
        const uint8_t *red = pixel_at(pixels, MIDDLE, MIDDLE);
        CHECK(red[0] > 150 && red[1] < 80 && red[2] < 90 && red[3] == 255);
        // The block's row of green lies to the right: x points there.
        bool green = false;
        for (uint32_t x = MIDDLE + 1; x < SIDE; x++) {
            const uint8_t *p = pixel_at(pixels, x, MIDDLE);
            green = green || (p[1] > 150 && p[0] < 80);
        }
        CHECK(green);
    }
    free(pixels);
    // Up into the sky, from within the world and from outside.
    desc.camera = (fm_camera){{11, 11, 15}, {0, 0, 1}, {0, 1, 0}, 40};
    pixels = render_picture(s, &desc);
    CHECK(pixels && pixels[2] > pixels[0]);
    free(pixels);
}

static void check_shadow(render_stage *s) {
    // The sun stands 45 degrees over +x: the block's shadow falls towards -x for 6 voxels.
    for (int shadow = FM_SHADOW_HARD; shadow <= FM_SHADOW_SOFT; shadow++) {
        fm_render_desc dark = down_at(7, 12), light = down_at(18, 12), far = down_at(2, 12);
        const int before[] = {middle_sum(s, &dark), middle_sum(s, &light), middle_sum(s, &far)};
        dark.shadow = light.shadow = far.shadow = (fm_shadow)shadow;
        CHECK(middle_sum(s, &dark) < before[0] - 60);
        CHECK(middle_sum(s, &light) == before[1]);
        CHECK(shadow == FM_SHADOW_HARD ? middle_sum(s, &far) == before[2] : middle_sum(s, &far) <= before[2]);
    }
}

static void check_occlusion(render_stage *s) {
    // Beside the block, on a free floor, and on top of the block.
    fm_render_desc beside = down_at(12, 9), open = down_at(19, 19), top = down_at(12, 12);
    const int before[] = {middle_sum(s, &beside), middle_sum(s, &open), middle_sum(s, &top)};
    beside.ambient_occlusion = open.ambient_occlusion = top.ambient_occlusion = true;
    CHECK(middle_sum(s, &beside) < before[0] - 10);
    CHECK(middle_sum(s, &open) == before[1]);
    CHECK(middle_sum(s, &top) == before[2]);
}

static void check_slice(render_stage *s) {
    fm_render_desc desc = down_at(12, 12);
    desc.view = FM_VIEW_SLICE;
    desc.slice_axis = 2;
    desc.slice_index = 5;
    uint8_t *pixels = render_picture(s, &desc);
    if (pixels) {
        // The block is cut: its own colour; beside of it the field, dark near solid voxels and lighter away from them.
        const uint8_t *cut = pixel_at(pixels, MIDDLE, MIDDLE);
        CHECK(cut[0] > 150 && cut[1] < 80);
        desc.slice_index = 20;
        fm_render_desc up = desc;
        up.camera = (fm_camera){{12, 12, 0}, {0, 0, 1}, {0, 1, 0}, 40};
        CHECK(middle_sum(s, &up) > 0);
        desc.camera = (fm_camera){{12, -30, 8}, {0, 1, 0}, {0, 0, 0}, 40};
        desc.slice_axis = 1;
        desc.slice_index = 3;
        uint8_t *side = render_picture(s, &desc);
        if (side) {
            // Upwards from the floor the field grows, and its map gets lighter but for the lines.
            int rises = 0;
            for (uint32_t y = 1; y < MIDDLE; y++) {
                rises += sum_of(pixel_at(side, MIDDLE, y)) - sum_of(pixel_at(side, MIDDLE, y + 1)) >= 0;
            }
            CHECK(rises > 20);
            CHECK(memcmp(pixel_at(side, 0, 0), pixel_at(side, MIDDLE, MIDDLE), 4) != 0);
        }
        free(side);
    }
    free(pixels);
}

static bool is_near(const uint8_t *pixel, const int wanted[3]) {
    bool good = true;
    for (int i = 0; i < 3; i++) {
        good = good && abs((int)pixel[i] - wanted[i]) <= 2;
    }
    if (!good) {
        fprintf(stderr, "%d, %d, %d in place of %d, %d, %d\n", pixel[0], pixel[1], pixel[2], wanted[0], wanted[1], wanted[2]);
    }
    return good;
}

static bool shows_middle(render_stage *s, const fm_render_desc *desc, const int wanted[3]) {
    uint8_t *pixels = render_picture(s, desc);
    const bool good = pixels && is_near(pixel_at(pixels, MIDDLE, MIDDLE), wanted);
    free(pixels);
    return good;
}

// A colour of the map as it is stored, with a part of another light, in squares, laid over it.
static void map_color(double place, const double over[3], double part, int color[3]) {
    uint8_t rgb[3];
    fm_color_map_rgb(FM_COLOR_SEQUENTIAL, floor(place * 255 + 0.5) / 255, rgb);
    for (int i = 0; i < 3; i++) {
        const double light = rgb[i] / 255.0 * rgb[i] / 255.0;
        color[i] = (int)lround(255 * sqrt(light + (over[i] - light) * part));
    }
}

// Straight down onto the floor, 17.5 voxels below, and onto the block, 11.5 below: a voxel at a time, 19 and 13 reads.
static void check_maps(render_stage *s) {
    static const double none[3];
    static const struct {
        float x, y;
        int reads;
        double way;
    } places[] = {{19, 19, 19, 17.5}, {11, 12, 13, 11.5}};
    for (int i = 0; i < 2; i++) {
        int wanted[3];
        fm_render_desc desc = down_at(places[i].x, places[i].y);
        desc.view = FM_VIEW_STEPS;
        desc.march = FM_MARCH_PLAIN;
        map_color(log2(1 + places[i].reads) / 8, none, 0, wanted);
        CHECK(shows_middle(s, &desc, wanted));
        desc.view = FM_VIEW_DISTANCE;
        desc.march = FM_MARCH_SKIP;
        map_color(1 - places[i].way / (places[i].way + WORLD), none, 0, wanted);
        CHECK(shows_middle(s, &desc, wanted));
        desc.march = FM_MARCH_PLAIN;
        desc.width = desc.height = 1;
        desc.count = true;
        fm_render_stats stats = {0};
        CHECK_OK(fm_render(s->renderer, s->world, &desc, NULL));
        CHECK_OK(fm_renderer_stats(s->renderer, &stats));
        CHECK(stats.rays == 1 && stats.hits == 1 && stats.steps == (uint64_t)places[i].reads && stats.most_steps == stats.steps);
    }
    // Of all rays the most: those to the floor.
    fm_render_desc desc = down_at(11, 12);
    desc.march = FM_MARCH_PLAIN;
    desc.count = true;
    fm_render_stats stats = {0};
    CHECK_OK(fm_render(s->renderer, s->world, &desc, NULL));
    CHECK_OK(fm_renderer_stats(s->renderer, &stats));
    CHECK(stats.most_steps >= 19 && stats.most_steps < 60 && stats.steps < stats.rays * stats.most_steps);
}

// 7 and 8 voxels above the floor, far from the block: the colour of the distance, and a line.
static void check_lines(render_stage *s) {
    static const double line[3] = {0.02, 0.02, 0.02};
    for (int distance = 7; distance <= 8; distance++) {
        int wanted[3];
        fm_render_desc desc = down_at(20, 20);
        desc.view = FM_VIEW_SLICE;
        desc.slice_axis = 2;
        desc.slice_index = 2 + distance;
        map_color(distance / (distance + 24.0), line, distance == 8 ? 0.8 : 0, wanted);
        CHECK(shows_middle(s, &desc, wanted));
    }
}

// Red voxels, whose red is 1, in the light of the sky alone: less from the side, least along x.
static void check_ambient(render_stage *s) {
    static const struct {
        fm_camera camera;
        float sun[3];
        double ambient;
    } faces[] = {{{{-9, 12, 5}, {1, 0, 0}, {0, 0, 1}, 20}, {0, 0, 1}, 0.72},
                 {{{11, -9, 5}, {0, 1, 0}, {0, 0, 1}, 20}, {0, 0, 1}, 0.82},
                 {{{11, 12, 20}, {0, 0, -1}, {0, 1, 0}, 20}, {1, 0, 0}, 1.0}};
    static const double light[3] = {0.36, 0.43 * 0.0025, 0.54 * 0.0025};
    for (size_t i = 0; i < sizeof faces / sizeof faces[0]; i++) {
        fm_render_desc desc = {.camera = faces[i].camera, .width = SIDE, .height = SIDE};
        memcpy(desc.sun, faces[i].sun, sizeof desc.sun);
        int wanted[3];
        for (int k = 0; k < 3; k++) {
            wanted[k] = (int)lround(255 * sqrt(light[k] * faces[i].ambient));
        }
        CHECK(shows_middle(s, &desc, wanted));
    }
}

// A voxel within the brush, one at its edge, and one beside it.
static void check_tint(render_stage *s) {
    static const struct {
        float x;
        double part;
    } places[] = {{19, 0.4}, {22, 0.85}, {23, 0}};
    static const double tint[3] = {1, 0.75, 0.1};
    const fm_brush brush = {.from = {19, 19, 2}, .radius = 3};
    for (size_t i = 0; i < sizeof places / sizeof places[0]; i++) {
        fm_render_desc desc = down_at(places[i].x, 19);
        uint8_t *plain = render_picture(s, &desc);
        int wanted[3] = {0};
        for (int k = 0; plain && k < 3; k++) {
            const double stored = pixel_at(plain, MIDDLE, MIDDLE)[k] / 255.0;
            wanted[k] = (int)lround(255 * sqrt(stored * stored + (tint[k] - stored * stored) * places[i].part));
        }
        desc.preview = &brush;
        CHECK(shows_middle(s, &desc, wanted));
        free(plain);
    }
}

// Three pixels wide, four long to each side: the other colour there, and nothing else is changed.
static void check_crosshair(render_stage *s) {
    fm_render_desc desc = down_at(19, 19);
    uint8_t *plain = render_picture(s, &desc);
    desc.crosshair = true;
    uint8_t *marked = render_picture(s, &desc);
    uint32_t wrong = 0;
    for (int i = 0; plain && marked && i < SIDE * SIDE; i++) {
        const int x = abs(i % SIDE - MIDDLE), y = abs(i / SIDE - MIDDLE);
        const bool cross = (x <= 1 && y <= 4) || (y <= 1 && x <= 4);
        for (int k = 0; k < 3; k++) {
            wrong += marked[4 * i + k] != (cross ? 255 - plain[4 * i + k] : plain[4 * i + k]);
        }
    }
    CHECK(plain && marked && wrong == 0);
    free(plain);
    free(marked);
}

static void check_pick(render_stage *s) {
    fm_render_desc desc = down_at(11, 12);
    fm_pick pick;
    fm_pass pass = {0};
    uint32_t passes = 1;
    if (CHECK_OK(fm_render_pick(s->renderer, s->world, &desc, MIDDLE, MIDDLE, &pick))) {
        CHECK(fm_context_passes(s->context, &passes, &pass) == FM_OK && passes == 1 && strcmp(pass.name, "pick") == 0);
        CHECK(pick.hit && pick.voxel[0] == 11 && pick.voxel[1] == 12 && pick.voxel[2] == 8 && pick.face == 3);
        CHECK(fabsf(pick.distance - 11.5f) < 1e-3f);
    }
    desc.camera = (fm_camera){{11, 12, 5}, {1, 0, 0}, {0, 0, 0}, 40};
    if (CHECK_OK(fm_render_pick(s->renderer, s->world, &desc, MIDDLE, MIDDLE, &pick))) {
        CHECK(pick.hit && pick.voxel[0] == 11 && pick.voxel[2] == 5 && pick.face == 0 && pick.distance <= 0);
    }
    desc.camera = (fm_camera){{-9, 12, 5}, {-1, 0, 0}, {0, 0, 0}, 40};
    if (CHECK_OK(fm_render_pick(s->renderer, s->world, &desc, MIDDLE, MIDDLE, &pick))) {
        CHECK(!pick.hit);
    }
    // Questions in flight, answered late.
    const fm_render_desc places[] = {down_at(11, 12), desc, down_at(11, 12)};
    fm_ticket tickets[3] = {0};
    for (int i = 0; i < 3; i++) {
        CHECK_OK(fm_render_pick_begin(s->renderer, s->world, &places[i], MIDDLE, MIDDLE, &tickets[i]));
    }
    const bool keeps = fm_context_backend(s->context) == FM_BACKEND_VULKAN;
    for (int i = keeps ? 0 : 2; i < 3; i++) {
        CHECK_OK(fm_render_pick_end(s->renderer, tickets[i], &pick));
        CHECK(pick.hit == (i != 1) && pick.voxel[2] == (i != 1 ? 8 : 0));
    }
    if (keeps) {
        fm_ticket ticket;
        CHECK_OK(fm_render_pick_begin(s->renderer, s->world, &desc, MIDDLE, MIDDLE, &ticket));
        CHECK_FAILS(fm_render_pick_end(s->renderer, tickets[0], &pick), FM_ERROR_INVALID_ARGUMENT);
        CHECK_FAILS(fm_render_pick_end(s->renderer, 0, &pick), FM_ERROR_INVALID_ARGUMENT);
    }
}

// A picture follows the world's updates, and its sums are those of the picture.
static void check_edit(render_stage *s) {
    fm_render_desc desc = down_at(17, 7);
    desc.count = true;
    const fm_brush brush = {.voxel = RED, .from = {17, 7, 6}, .radius = 2}, dig = {.from = {17, 7, 6}, .radius = 2};
    const int before = middle_sum(s, &desc);
    fm_render_stats stats;
    CHECK_OK(fm_renderer_stats(s->renderer, &stats));
    CHECK(stats.rays == SIDE * SIDE && stats.hits == stats.rays && stats.steps >= stats.rays && stats.most_steps >= 1 &&
          stats.wrong == 0);
    fm_ticket ticket;
    CHECK_OK(fm_world_edit(s->world, &brush, 1));
    CHECK_OK(fm_world_update(s->world, &ticket));
    uint8_t *pixels = render_picture(s, &desc);
    CHECK(pixels && pixel_at(pixels, MIDDLE, MIDDLE)[0] > 150 && pixel_at(pixels, MIDDLE, MIDDLE)[1] < 80);
    free(pixels);
    CHECK_OK(fm_world_edit(s->world, &dig, 1));
    CHECK_OK(fm_world_update(s->world, &ticket));
    CHECK(middle_sum(s, &desc) == before);
}

static void refused(render_stage *s, const fm_render_desc *desc) {
    CHECK_FAILS(fm_render(s->renderer, s->world, desc, NULL), FM_ERROR_INVALID_ARGUMENT);
}

static void check_refusals(render_stage *s, fm_context *other) {
    const fm_render_desc good = down_at(12, 12);
    fm_render_desc bad = good;
    bad.width = 0;
    refused(s, &bad);
    bad.width = 16385;
    refused(s, &bad);
    bad = good;
    bad.camera.forward[2] = 0;
    refused(s, &bad);
    bad.camera.forward[2] = NAN;
    refused(s, &bad);
    bad = good;
    bad.camera.position[1] = 1e9f;
    refused(s, &bad);
    bad = good;
    bad.camera.fov_y = 180;
    refused(s, &bad);
    bad = good;
    bad.sun[0] = INFINITY;
    refused(s, &bad);
    bad = good;
    bad.view = (fm_view)9;
    refused(s, &bad);
    bad = good;
    bad.march = (fm_march)3;
    refused(s, &bad);
    bad = good;
    bad.shadow = (fm_shadow)3;
    refused(s, &bad);
    bad = good;
    bad.view = FM_VIEW_SLICE;
    bad.slice_axis = 3;
    refused(s, &bad);
    bad.slice_axis = 0;
    bad.slice_index = WORLD;
    refused(s, &bad);
    bad.slice_index = -1;
    refused(s, &bad);
    bad = good;
    const fm_brush brush = {.kind = (fm_brush_kind)7};
    bad.preview = &brush;
    refused(s, &bad);
    CHECK(strstr(fm_last_error(), "preview") != NULL);
    CHECK_FAILS(fm_render(NULL, s->world, &good, NULL), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_render(s->renderer, NULL, &good, NULL), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_render(s->renderer, s->world, NULL, NULL), FM_ERROR_INVALID_ARGUMENT);
    fm_pick pick;
    CHECK_FAILS(fm_render_pick(s->renderer, s->world, &good, NAN, 0, &pick), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_render_pick(s->renderer, s->world, &good, 0, 0, NULL), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_render_pick_begin(s->renderer, s->world, &good, 0, 0, NULL), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_render_pick_end(s->renderer, 0, NULL), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_render_pick_end(NULL, 0, &pick), FM_ERROR_INVALID_ARGUMENT);
    fm_renderer *fresh = NULL;
    uint8_t pixel[4];
    fm_render_stats stats;
    if (CHECK_OK(fm_renderer_create(other, &fresh))) {
        CHECK_FAILS(fm_render_pick_end(fresh, 0, &pick), FM_ERROR_INVALID_ARGUMENT);
        CHECK_FAILS(fm_render(fresh, s->world, &good, NULL), FM_ERROR_INVALID_ARGUMENT);
        CHECK_FAILS(fm_renderer_read(fresh, pixel), FM_ERROR_INVALID_ARGUMENT);
        CHECK_FAILS(fm_renderer_stats(fresh, &stats), FM_ERROR_INVALID_ARGUMENT);
    }
    fm_renderer_destroy(fresh);
    fm_renderer_destroy(NULL);
}

// Sizes that are no multiples of a tile, one after the other, and one pixel.
static void check_sizes(render_stage *s) {
    static const uint32_t sizes[][2] = {{1, 1}, {17, 3}, {3, 130}, {64, 64}};
    for (size_t i = 0; i < sizeof sizes / sizeof sizes[0]; i++) {
        fm_render_desc desc = down_at(12, 12);
        desc.width = sizes[i][0];
        desc.height = sizes[i][1];
        uint8_t *pixels = render_picture(s, &desc);
        for (uint32_t k = 0; pixels && k < desc.width * desc.height; k++) {
            CHECK(pixels[4 * k + 3] == 255);
        }
        free(pixels);
    }
    fm_volume_buffer buffer;
    if (fm_context_backend(s->context) == FM_BACKEND_CPU) {
        CHECK_FAILS(fm_renderer_vulkan(s->renderer, &buffer), FM_ERROR_UNSUPPORTED);
    } else {
        CHECK_OK(fm_renderer_vulkan(s->renderer, &buffer));
        CHECK(buffer.buffer && buffer.size >= 4 * 64 * 64);
    }
}

// The penumbra of a long wall is the same all along it, and has no steps: its field's whole numbers must not show.
static void check_penumbra(fm_context *context) {
    enum { EDGE = 96, WALL = 70, HIGH = 40 };
    uint32_t *voxels = calloc((size_t)EDGE * EDGE * EDGE, sizeof *voxels);
    for (uint32_t i = 0; voxels && i < EDGE * EDGE * EDGE; i++) {
        const uint32_t x = i % EDGE, z = i / EDGE / EDGE;
        voxels[i] = z == 0 || (x == WALL && z <= HIGH) ? GREY : 0;
    }
    render_stage s = {0};
    if (voxels && render_open(&s, context, &(fm_world_desc){.shape = {EDGE, EDGE, EDGE}}, voxels)) {
        // Down onto the end of the shadow, about 40 voxels before the wall. A pixel is an eighth of a voxel.
        fm_render_desc desc = {.camera = {{30, 48, 90}, {0, 0, -1}, {0, 1, 0}, 10}, .width = 121, .height = 121};
        desc.sun[0] = 1;
        desc.sun[1] = 0.37f;
        desc.sun[2] = 1;
        desc.shadow = FM_SHADOW_SOFT;
        uint8_t *pixels = render_picture(&s, &desc);
        int most_across = 0, most_along = 0;
        for (uint32_t i = 0; pixels && i < 121 * 121; i++) {
            const int here = sum_of(pixels + 4 * i), row = sum_of(pixels + 4 * (121 * 60 + i % 121));
            most_across = i % 121 > 0 && abs(here - sum_of(pixels + 4 * i - 4)) > most_across
                              ? abs(here - sum_of(pixels + 4 * i - 4))
                              : most_across;
            most_along = abs(here - row) > most_along ? abs(here - row) : most_along;
        }
        const int range = pixels ? abs(sum_of(pixels + 4 * (121 * 60)) - sum_of(pixels + 4 * (121 * 60 + 120))) : 0;
        printf("penumbra: %d between its ends, at most %d between pixels, %d along the wall\n", range, most_across, most_along);
        CHECK(range > 60 && most_across * 10 < range && most_along * 10 < range);
        free(pixels);
    }
    render_close(&s);
    free(voxels);
}

// Before its first update a world shows air, by every march, wherever its memory was before.
static void check_new_world(fm_context *context, const uint32_t *voxels) {
    const fm_world_desc world = {.shape = {WORLD, WORLD, WORLD}, .format = FM_FIELD_SPLIT_U8};
    render_stage s = {0};
    CHECK(render_open(&s, context, &world, voxels));
    render_close(&s);
    const fm_render_desc desc = {.camera = {{12, 12, 20}, {0, 0, -1}, {0, 1, 0}, 40}, .width = 8, .height = 8, .count = true};
    s.context = context;
    if (CHECK_OK(fm_world_create(context, &world, &s.world)) && CHECK_OK(fm_renderer_create(context, &s.renderer))) {
        for (int march = FM_MARCH_SKIP; march <= FM_MARCH_PLAIN; march++) {
            fm_render_desc own = desc;
            own.march = (fm_march)march;
            fm_render_stats stats;
            CHECK_OK(fm_render(s.renderer, s.world, &own, NULL));
            CHECK_OK(fm_renderer_stats(s.renderer, &stats));
            CHECK(stats.rays == 64 && stats.hits == 0);
        }
    }
    render_close(&s);
}

// More workers than there are rows, and than any table of a fixed size would hold.
static void check_threads(const uint32_t *voxels) {
    fm_context *context;
    render_stage s = {0};
    if (!CHECK_OK(fm_context_create(&(fm_context_desc){.backend = FM_BACKEND_CPU, .threads = 300}, &context))) {
        return;
    }
    if (render_open(&s, context, &(fm_world_desc){.shape = {WORLD, WORLD, WORLD}}, voxels)) {
        fm_render_desc desc = down_at(12, 12);
        desc.height = 1800;
        desc.count = true;
        fm_render_stats stats;
        CHECK_OK(fm_render(s.renderer, s.world, &desc, NULL));
        CHECK_OK(fm_renderer_stats(s.renderer, &stats));
        CHECK(stats.rays == SIDE * 1800);
    }
    render_close(&s);
    fm_context_destroy(context);
}

// Allocations fail from the `fail_at`th on.
typedef struct failing {
    unsigned long calls, fail_at;
} failing;

static void *failing_alloc(void *user, size_t size, size_t alignment) {
    failing *f = user;
    return f->calls++ >= f->fail_at ? NULL : aligned_alloc(alignment, (size + alignment - 1) / alignment * alignment);
}

static void failing_free(void *user, void *memory, size_t size) {
    (void)user;
    (void)size;
    free(memory);
}

// A picture that fails leaves the one before it, whatever its size.
static void check_memory_ends(const fm_context_desc *like, const uint32_t *voxels) {
    failing allocations = {.fail_at = ULONG_MAX};
    const fm_allocator allocator = {failing_alloc, failing_free, &allocations};
    fm_context_desc with = *like;
    with.allocator = &allocator;
    with.threads = 1;
    fm_context *context;
    render_stage s = {0};
    if (!CHECK_OK(fm_context_create(&with, &context))) {
        return;
    }
    if (render_open(&s, context, &(fm_world_desc){.shape = {WORLD, WORLD, WORLD}}, voxels)) {
        static const uint32_t sides[][2] = {{300, 8}, {8, 300}};
        for (int grows = 0; grows < 2; grows++) {
            fm_render_desc desc = down_at(12, 12), next = desc;
            desc.width = desc.height = sides[grows][0];
            next.width = next.height = sides[grows][1];
            next.view = FM_VIEW_NORMAL;
            next.count = true;
            uint8_t *before = render_picture(&s, &desc), *after = calloc(4, (size_t)desc.width * desc.height);
            fm_result result = FM_ERROR_OUT_OF_HOST_MEMORY;
            unsigned long failures = 0;
            for (unsigned long n = 0; before && after && n < 50 && result != FM_OK; n++) {
                allocations = (failing){.fail_at = n};
                result = fm_render(s.renderer, s.world, &next, NULL);
                allocations.fail_at = ULONG_MAX;
                if (result != FM_OK) {
                    failures++;
                    CHECK(result == FM_ERROR_OUT_OF_HOST_MEMORY);
                    CHECK_OK(fm_renderer_read(s.renderer, after));
                    CHECK(memcmp(before, after, 4 * (size_t)desc.width * desc.height) == 0);
                }
            }
            CHECK(result == FM_OK && failures >= 2);
            free(before);
            free(after);
        }
    }
    render_close(&s);
    fm_context_destroy(context);
}

static void check_all(fm_context *context, fm_context *cpu, const render_options *options) {
    const fm_context_desc like = {.backend = fm_context_backend(context),
                                  .device = options->vulkan.device,
                                  .validation = context != cpu && !options->vulkan.no_validation,
                                  .log = vulkan_log};
    uint32_t *voxels = make_voxels();
    render_stage s = {0};
    if (voxels && render_open(&s, context, &(fm_world_desc){.shape = {WORLD, WORLD, WORLD}, .format = FM_FIELD_SPLIT_U8}, voxels)) {
        fm_context *other;
        check_color(&s);
        check_shadow(&s);
        check_occlusion(&s);
        check_slice(&s);
        check_maps(&s);
        check_lines(&s);
        check_ambient(&s);
        check_tint(&s);
        check_crosshair(&s);
        check_pick(&s);
        check_edit(&s);
        check_sizes(&s);
        check_penumbra(context);
        check_new_world(context, voxels);
        check_threads(voxels);
        check_memory_ends(&like, voxels);
        if (CHECK_OK(fm_context_create(&(fm_context_desc){.backend = FM_BACKEND_CPU, .threads = 1}, &other))) {
            check_refusals(&s, other);
            fm_context_destroy(other);
        }
    }
    render_close(&s);
    free(voxels);
}

int main(int count, char **arguments) {
    return render_main(count, arguments, check_all);
}
