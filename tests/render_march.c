// SPDX-License-Identifier: MIT
// The three marches show the same pictures, byte for byte, for every format; and what they hit is what rays hit that are tried
// against every voxel in double precision. CPU and Vulkan agree but for rounding at edges. `--size N` compares the marches in one
// large world instead.

#include "render_common.h"

enum { WIDTH = 41, HEIGHT = 31, CAMERAS = 26 };

static const fm_shape SHAPE = {37, 22, 18};

// What a ray meets, by trying every solid voxel, each made wider by `grow` on all sides.
typedef struct oracle_hit {
    bool hit;
    int32_t voxel[3];
    int face;  // as fm_pick has it
    double distance;
    double edge;  // how much earlier the other axes were entered: at an edge either face is right
} oracle_hit;

static bool try_voxel(const double origin[3], const double way[3], const int32_t at[3], double grow, oracle_hit *best) {
    double enter = -INFINITY, second = -INFINITY, leave = INFINITY;
    int face = 0;
    for (int i = 0; i < 3; i++) {
        const double low = at[i] - 0.5 - grow, high = at[i] + 0.5 + grow;
        if (way[i] == 0) {
            if (origin[i] < low || origin[i] > high) {
                return false;
            }
            continue;
        }
        const double a = ((way[i] > 0 ? low : high) - origin[i]) / way[i];
        const double b = ((way[i] > 0 ? high : low) - origin[i]) / way[i];
        second = fmax(second, fmin(a, enter));
        if (a > enter) {
            enter = a;
            face = way[i] > 0 ? -(i + 1) : i + 1;
        }
        leave = fmin(leave, b);
    }
    if (enter >= leave || leave <= 0) {
        return false;
    }
    const bool within = enter <= 0;
    const double distance = within ? 0 : enter;
    if (!best->hit || distance < best->distance) {
        *best = (oracle_hit){true, {at[0], at[1], at[2]}, within ? 0 : face, distance, within ? INFINITY : enter - second};
    }
    return true;
}

static oracle_hit oracle(const render_stage *s, const double origin[3], const double way[3], double grow) {
    oracle_hit best = {0};
    int32_t at[3];
    for (at[2] = 0; at[2] < (int32_t)s->shape.z; at[2]++) {
        for (at[1] = 0; at[1] < (int32_t)s->shape.y; at[1]++) {
            for (at[0] = 0; at[0] < (int32_t)s->shape.x; at[0]++) {
                if (render_voxel(s, at[0], at[1], at[2])) {
                    try_voxel(origin, way, at, grow, &best);
                }
            }
        }
    }
    return best;
}

// The ray of a pixel, of length 1, by the definition of the camera.
static void pixel_ray(const fm_render_desc *desc, double x, double y, double origin[3], double way[3]) {
    double forward[3], right[3], up[3];
    double length = 0;
    for (int i = 0; i < 3; i++) {
        origin[i] = (double)desc->camera.position[i];
        forward[i] = (double)desc->camera.forward[i];
        length += forward[i] * forward[i];
    }
    for (int i = 0; i < 3; i++) {
        forward[i] /= sqrt(length);
    }
    // With z up.
    const double across = hypot(forward[0], forward[1]);
    right[0] = forward[1] / across;
    right[1] = -forward[0] / across;
    right[2] = 0;
    up[0] = right[1] * forward[2] - right[2] * forward[1];
    up[1] = right[2] * forward[0] - right[0] * forward[2];
    up[2] = right[0] * forward[1] - right[1] * forward[0];
    const double slope = tan((double)desc->camera.fov_y * 3.14159265358979323846 / 360);
    const double h = slope * desc->width / desc->height * ((2 * x + 1) / desc->width - 1),
                 v = slope * (1 - (2 * y + 1) / desc->height);
    length = 0;
    for (int i = 0; i < 3; i++) {
        way[i] = forward[i] + right[i] * h + up[i] * v;
        length += way[i] * way[i];
    }
    for (int i = 0; i < 3; i++) {
        way[i] /= sqrt(length);
    }
}

// Whether a little more or less of the voxels makes no difference.
static bool is_sure(const oracle_hit *a, const oracle_hit *b) {
    const bool same = a->hit == b->hit && (!a->hit || (memcmp(a->voxel, b->voxel, sizeof a->voxel) == 0 && a->face == b->face));
    return same && (!a->hit || b->edge > 2e-3);
}

// What FM_VIEW_NORMAL shows of it.
static bool shows(const uint8_t *pixel, const oracle_hit *hit) {
    int wanted[3] = {25, 25, 25};
    for (int i = 0; hit->hit && i < 3; i++) {
        wanted[i] = hit->face == i + 1 ? 242 : hit->face == -(i + 1) ? 13 : 128;
    }
    bool good = pixel[3] == 255;
    for (int i = 0; i < 3; i++) {
        good = good && abs((int)pixel[i] - wanted[i]) <= 1;
    }
    return good;
}

typedef struct tally {
    uint64_t sure, unsure;
} tally;

// Compares a picture of normals with the oracle wherever rays are not too near to edges to tell.
static void check_normals(render_stage *s, const fm_render_desc *desc, tally *count) {
    uint8_t *pixels = render_picture(s, desc);
    for (uint32_t i = 0; pixels && i < desc->width * desc->height; i++) {
        double origin[3], way[3];
        pixel_ray(desc, i % desc->width, i / desc->width, origin, way);
        const oracle_hit wide = oracle(s, origin, way, 1e-3), narrow = oracle(s, origin, way, -1e-3);
        if (!is_sure(&wide, &narrow)) {
            count->unsure++;
            continue;
        }
        count->sure++;
        if (!CHECK(shows(&pixels[4 * i], &narrow))) {
            fprintf(stderr, "    pixel %u, %u: %u %u %u; hit %d, face %d of %d, %d, %d\n", i % desc->width, i / desc->width,
                    pixels[4 * i], pixels[4 * i + 1], pixels[4 * i + 2], narrow.hit, narrow.face, narrow.voxel[0], narrow.voxel[1],
                    narrow.voxel[2]);
        }
    }
    free(pixels);
}

static void check_picks(render_stage *s, const fm_render_desc *desc, uint64_t *state) {
    for (int i = 0; i < 6; i++) {
        const float x = (float)render_part(state) * WIDTH - 0.5f, y = (float)render_part(state) * HEIGHT - 0.5f;
        double origin[3], way[3];
        pixel_ray(desc, (double)x, (double)y, origin, way);
        const oracle_hit wide = oracle(s, origin, way, 1e-3), narrow = oracle(s, origin, way, -1e-3);
        fm_pick pick;
        if (!CHECK_OK(fm_render_pick(s->renderer, s->world, desc, x, y, &pick)) || !is_sure(&wide, &narrow)) {
            continue;
        }
        CHECK(pick.hit == narrow.hit);
        if (pick.hit && narrow.hit) {
            CHECK(memcmp(pick.voxel, narrow.voxel, sizeof pick.voxel) == 0);
            CHECK(pick.face == narrow.face);
            CHECK(fabs((double)pick.distance - narrow.distance) < 0.01 + 1e-4 * narrow.distance);
        }
    }
}

static float anywhere(uint64_t *state, double low, double high) {
    return (float)(low + render_part(state) * (high - low));
}

// Cameras in and around the world, along axes, at edges and corners of voxels, and along diagonals.
static fm_camera camera_number(uint32_t i, uint64_t *state) {
    static const float special[][6] = {
        {-4, 7, 5, 1, 0, 0},
        {50, 7.5f, 5.5f, -1, 0, 0},
        {18, -9, 9, 0, 1, 0},
        {18.5f, 40, 8.5f, 0, -1, 0},
        {-6.5f, -6.5f, 6, 1, 1, 0},
        {-5.5f, -3.5f, -4.5f, 1, 1, 1},
        {40.5f, 25.5f, 21.5f, -1, -1, -1},
        {36, -1, 9, -1, 1, 0},
        {10, 10, 10, 1, 0, 0},
        {10.5f, 10.5f, 10.5f, -1, -1, 1},
        {300, 200, 150, -1, -0.66f, -0.5f},
        {18, 11, 400, 0.03f, 0, -1},
    };
    const fm_shape s = SHAPE;
    if (i < sizeof special / sizeof special[0]) {
        const float *v = special[i];
        return (fm_camera){{v[0], v[1], v[2]}, {v[3], v[4], v[5]}, {0, 0, 0}, i >= 10 ? 9.0f : 70.0f};
    }
    const double out = i % 2 ? 15 : 0;
    fm_camera camera = {
        .position = {anywhere(state, -out, s.x + out), anywhere(state, -out, s.y + out), anywhere(state, -out, s.z + out)},
        .fov_y = anywhere(state, 30, 100)};
    for (int k = 0; k < 3; k++) {
        const double middle = 0.5 * (k == 0 ? s.x : k == 1 ? s.y : s.z);
        camera.forward[k] = out > 0 ? (float)middle - camera.position[k] : anywhere(state, -1, 1);
    }
    return camera;
}

static fm_render_desc desc_of(fm_camera camera, fm_view view, fm_march march) {
    return (fm_render_desc){.camera = camera, .width = WIDTH, .height = HEIGHT, .view = view, .march = march};
}

static void check_same(render_stage *s, fm_camera camera) {
    fm_render_desc desc = desc_of(camera, FM_VIEW_COLOR, FM_MARCH_PLAIN);
    desc.shadow = FM_SHADOW_HARD;
    uint8_t *plain = render_picture(s, &desc);
    for (int march = FM_MARCH_SKIP; march <= FM_MARCH_BOX; march++) {
        desc.march = (fm_march)march;
        uint8_t *other = render_picture(s, &desc);
        CHECK(plain && other && memcmp(plain, other, 4 * WIDTH * HEIGHT) == 0);
        free(other);
    }
    free(plain);
}

// Sparse voxels, dense ones, walls one voxel thin along diagonals, which rays could slip through, and a solid floor.
static uint32_t *make_voxels(int kind, uint64_t *state) {
    uint32_t *voxels = calloc((size_t)SHAPE.x * SHAPE.y * SHAPE.z, sizeof *voxels);
    for (uint32_t i = 0; i < SHAPE.x * SHAPE.y * SHAPE.z; i++) {
        const uint32_t x = i % SHAPE.x, y = i / SHAPE.x % SHAPE.y, z = i / SHAPE.x / SHAPE.y;
        const uint32_t color = (uint32_t)test_random(state) | 1;
        const bool wall = x == y + 8 || (x + z == 31 && y > 12) || x + y + z == 20;
        const bool solid = kind == 0 ? color >> 8 & 1 && !(color & 0x3e00) : kind == 1 ? wall || z == 0 : z == 4 && x > 3 && y < 17;
        voxels[i] = solid ? color : 0;
    }
    return voxels;
}

static void check_world(fm_context *context, const fm_world_desc *desc, int kind, tally *count) {
    uint64_t state = 11 + (uint64_t)kind;
    uint32_t *voxels = make_voxels(kind, &state);
    render_stage s;
    if (render_open(&s, context, desc, voxels)) {
        // The oracle tries all voxels for all pixels: not everywhere.
        const bool whole = desc->format == FM_FIELD_PACKED && desc->method.chunk == 0;
        for (uint32_t i = 0; i < CAMERAS; i++) {
            const fm_camera camera = camera_number(i, &state);
            check_same(&s, camera);
            if (whole && i % 3 == (uint32_t)kind) {
                const fm_render_desc normals = desc_of(camera, FM_VIEW_NORMAL, FM_MARCH_SKIP);
                check_normals(&s, &normals, count);
                check_picks(&s, &normals, &state);
            }
        }
    }
    render_close(&s);
    free(voxels);
}

static bool near(uint64_t a, uint64_t b) {
    return a <= b + b / 50 + 20 && b <= a + a / 50 + 20;
}

// Both count alike, but for rays at edges.
static void check_sums(render_stage *s, render_stage *t) {
    fm_render_stats a = {0}, b = {0};
    CHECK_OK(fm_renderer_stats(s->renderer, &a));
    CHECK_OK(fm_renderer_stats(t->renderer, &b));
    CHECK(a.rays == WIDTH * HEIGHT && b.rays == a.rays && near(a.hits, b.hits) && near(a.steps, b.steps));
    CHECK(a.beam_reads > 0 && near(a.beam_reads, b.beam_reads) && near(a.sun_reads, b.sun_reads));
    CHECK(near(a.occlusion_reads, b.occlusion_reads) && near(a.occlusion_reads, 12 * a.hits));
    CHECK(near(a.most_steps, b.most_steps) && a.most_steps * a.rays >= a.steps && b.most_steps * b.rays >= b.steps);
}

static uint64_t count_different(const uint8_t *a, const uint8_t *b) {
    uint64_t differ = 0;
    for (uint32_t k = 0; k < WIDTH * HEIGHT; k++) {
        bool same = true;
        for (uint32_t c = 4 * k; c < 4 * k + 4; c++) {
            same = same && abs((int)a[c] - (int)b[c]) <= 2;
        }
        differ += !same;
    }
    return differ;
}

// Every view, with all that it can show.
static fm_render_desc full_desc(fm_camera camera, fm_view view, const fm_brush *brush) {
    fm_render_desc desc = desc_of(camera, view, FM_MARCH_SKIP);
    desc.shadow = FM_SHADOW_SOFT;
    desc.ambient_occlusion = true;
    desc.crosshair = true;
    desc.count = true;
    desc.preview = brush;
    desc.slice_axis = 1;
    desc.slice_index = 9;
    return desc;
}

// The same pictures from the CPU and from the device.
static void check_against_cpu(fm_context *context, fm_context *cpu) {
    const fm_brush brush = {.from = {18, 10, 6}, .radius = 5};
    uint64_t state = 5;
    uint32_t *voxels = make_voxels(1, &state);
    const fm_world_desc desc = {.shape = SHAPE};
    render_stage s, t;
    const bool first = render_open(&s, context, &desc, voxels), second = render_open(&t, cpu, &desc, voxels);
    for (int view = FM_VIEW_COLOR; first && second && view <= FM_VIEW_DIFFERENCE; view++) {
        uint64_t differ = 0, pixels = 0;
        for (uint32_t i = 12; i < CAMERAS; i++) {
            const fm_render_desc picture = full_desc(camera_number(i, &state), (fm_view)view, &brush);
            uint8_t *a = render_picture(&s, &picture), *b = render_picture(&t, &picture);
            if (a && b) {
                differ += count_different(a, b);
                pixels += WIDTH * HEIGHT;
            }
            free(a);
            free(b);
            if (view == FM_VIEW_COLOR) {
                check_sums(&s, &t);
            }
        }
        printf("view %d: CPU and device differ in %llu of %llu pixels\n", view, (unsigned long long)differ,
               (unsigned long long)pixels);
        CHECK(pixels > 0 && differ * 1000 < pixels);
    }
    render_close(&s);
    render_close(&t);
    free(voxels);
}

// Approximate fields: the wrong pixels are counted and red, and there are such. Returns how many.
static uint64_t check_difference(fm_context *context) {
    uint64_t state = 3;
    uint32_t *voxels = make_voxels(0, &state);
    const fm_world_desc desc = {.shape = SHAPE, .method = {.algorithm = FM_WORLD_JFA_PUBLISHED}};
    render_stage s;
    uint64_t wrong = 0;
    if (render_open(&s, context, &desc, voxels)) {
        for (uint32_t i = 13; i < 22; i++) {
            const fm_camera camera = camera_number(i, &state);
            fm_render_desc picture = desc_of(camera, FM_VIEW_DIFFERENCE, FM_MARCH_SKIP);
            picture.count = true;
            uint8_t *pixels = render_picture(&s, &picture);
            fm_render_stats stats = {0};
            CHECK_OK(fm_renderer_stats(s.renderer, &stats));
            picture.march = FM_MARCH_PLAIN;
            uint8_t *right = render_picture(&s, &picture);
            fm_render_stats none = {.wrong = 1};
            CHECK_OK(fm_renderer_stats(s.renderer, &none));
            CHECK(none.wrong == 0 && none.rays == WIDTH * HEIGHT && none.hits == stats.hits && none.steps >= stats.rays);
            uint64_t red = 0;
            for (uint32_t k = 0; pixels && right && k < 4 * WIDTH * HEIGHT; k += 4) {
                const bool is_red = pixels[k] == 255 && pixels[k + 1] == 0 && pixels[k + 2] == 0;
                red += is_red;
                CHECK(is_red || memcmp(pixels + k, right + k, 4) == 0);
            }
            CHECK(red == stats.wrong);
            wrong += stats.wrong;
            free(pixels);
            free(right);
        }
    }
    printf("%llu pixels are wrong with published jump flooding\n", (unsigned long long)wrong);
    CHECK(wrong > 0);
    render_close(&s);
    free(voxels);
    return wrong;
}

static uint64_t wrong_pixels(render_stage *s) {
    uint64_t state = 8, wrong = 0;
    for (uint32_t i = 13; i < 22; i++) {
        fm_render_desc picture = desc_of(camera_number(i, &state), FM_VIEW_DIFFERENCE, FM_MARCH_SKIP);
        picture.count = true;
        fm_render_stats stats = {0};
        CHECK_OK(fm_render(s->renderer, s->world, &picture, NULL));
        CHECK_OK(fm_renderer_stats(s->renderer, &stats));
        wrong += stats.wrong;
    }
    return wrong;
}

// A ray goes wrong nowhere but in fields that may be too far.
static void check_trust(fm_context *context) {
    uint64_t state = 3;
    uint32_t *voxels = make_voxels(0, &state);
    const fm_world_desc desc = {.shape = SHAPE};
    render_stage s;
    if (render_open(&s, context, &desc, voxels)) {
        uint64_t trusted = 0, wrong = 0;
        for (int algorithm = FM_WORLD_BRUTE_FORCE; algorithm <= FM_WORLD_PUBLISHED_FINAL; algorithm++) {
            // The whole world, padding, halo.
            for (int way = algorithm == FM_WORLD_SELECTIVE; way < 3; way++) {
                const fm_world_method method = {.algorithm = (fm_world_algorithm)algorithm,
                                                .chunk = way ? 8 : 0,
                                                .border = way == 2 ? FM_BORDER_HALO : FM_BORDER_PADDING,
                                                .focus_chunks = 1};
                CHECK_OK(fm_world_set_method(s.world, &method));
                CHECK_OK(fm_world_update(s.world, NULL));
                const uint64_t found = wrong_pixels(&s);
                CHECK(found == 0 || fm_world_method_overestimates(&method));
                trusted += !fm_world_method_overestimates(&method);
                wrong += found;
            }
        }
        CHECK(trusted == 14 && wrong > 0 && !fm_world_method_overestimates(NULL));
    }
    render_close(&s);
    free(voxels);
}

// Hills, walls one voxel thin, and dust.
static bool large_solid(uint32_t size, uint32_t x, uint32_t y, uint32_t z, uint64_t *state) {
    const double wave = sin(x * 25.0 / size) + cos(y * 18.0 / size);
    const bool wall = (x + 2 * y) % 211 == 0 && z < size / 2 && (x / 16 + z / 8) % 5 != 0;
    return z < (0.25 + 0.08 * wave) * size || wall || test_random(state) % 4096 == 0;
}

static bool fill_large(fm_world *world, uint32_t size) {
    uint64_t state = 21;
    uint32_t *slice = malloc((size_t)size * size * sizeof *slice);
    bool good = CHECK(slice != NULL);
    for (uint32_t z = 0; good && z < size; z++) {
        for (uint32_t i = 0; i < size * size; i++) {
            slice[i] = large_solid(size, i % size, i / size, z, &state) ? 0x100 | (i & 0xff) : 0;
        }
        good = CHECK_OK(fm_world_write(world, &(fm_box){{0, 0, z}, {size, size, z + 1}}, slice));
    }
    free(slice);
    return good && CHECK_OK(fm_world_update(world, NULL));
}

// One world of any size, where rays are long and places coarse: all marches show the same, and their wrong pixels are none.
static void check_large(fm_context *context, uint32_t size) {
    const fm_world_desc desc = {.shape = {size, size, size}, .format = FM_FIELD_SPLIT_U8};
    render_stage s = {.context = context, .shape = desc.shape};
    uint64_t state = 31, pixels = 0;
    const bool good = CHECK_OK(fm_world_create(context, &desc, &s.world)) && CHECK_OK(fm_renderer_create(context, &s.renderer));
    for (uint32_t i = 0; good && (i > 0 || fill_large(s.world, size)) && i < 12; i++) {
        fm_render_desc picture = {.width = 320, .height = 180, .march = FM_MARCH_PLAIN, .shadow = FM_SHADOW_HARD, .count = true};
        const double out = i % 2 ? 0.3 * size : 0;
        for (int k = 0; k < 3; k++) {
            picture.camera.position[k] = anywhere(&state, -out, size + out);
            picture.camera.forward[k] =
                i % 2 ? 0.5f * (float)size - picture.camera.position[k] : anywhere(&state, -1, k == 2 ? 0.2 : 1);
        }
        uint8_t *plain = render_picture(&s, &picture);
        for (int march = FM_MARCH_SKIP; march <= FM_MARCH_BOX; march++) {
            picture.march = (fm_march)march;
            uint8_t *other = render_picture(&s, &picture);
            CHECK(plain && other && memcmp(plain, other, 4 * 320 * 180) == 0);
            free(other);
        }
        fm_render_stats stats;
        picture.view = FM_VIEW_DIFFERENCE;
        picture.march = FM_MARCH_SKIP;
        CHECK_OK(fm_render(s.renderer, s.world, &picture, NULL));
        CHECK(fm_renderer_stats(s.renderer, &stats) == FM_OK && stats.wrong == 0);
        pixels += stats.hits;
        free(plain);
    }
    printf("%llu pixels of solid voxels, edge %u\n", (unsigned long long)pixels, size);
    CHECK(pixels > 100000);
    render_close(&s);
}

static void check_all(fm_context *context, fm_context *cpu, const render_options *options) {
    if (options->size) {
        check_large(context, options->size);
        return;
    }
    tally rays = {0};
    for (int format = FM_FIELD_PACKED; format <= FM_FIELD_SQUARED_U32; format++) {
        for (int kind = 0; kind < (format == FM_FIELD_PACKED ? 3 : 1 + format % 2); kind++) {
            check_world(context, &(fm_world_desc){.shape = SHAPE, .format = (fm_field_format)format}, kind, &rays);
        }
    }
    // A chunk's distances end at its faces; a field of 1 everywhere is one too.
    check_world(context, &(fm_world_desc){.shape = SHAPE, .method = {.algorithm = FM_WORLD_FIM, .chunk = 8}}, 1, &rays);
    check_world(context, &(fm_world_desc){.shape = SHAPE, .method = {.algorithm = FM_WORLD_PUBLISHED_FINAL, .chunk = 8}}, 0, &rays);
    printf("%llu rays against the oracle, %llu too near to an edge\n", (unsigned long long)rays.sure,
           (unsigned long long)rays.unsure);
    CHECK(rays.sure > 20000 && rays.unsure * 4 < rays.sure);
    check_trust(context);
    const uint64_t wrong = check_difference(context);
    if (context != cpu) {
        // What is wrong is the field's, not the backend's.
        const uint64_t here = check_difference(cpu);
        CHECK(wrong <= here + here / 50 && here <= wrong + wrong / 50);
        check_against_cpu(context, cpu);
    }
}

int main(int count, char **arguments) {
    return render_main(count, arguments, check_all);
}
