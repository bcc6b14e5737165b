// SPDX-License-Identifier: MIT
// Pictures of octrees: what rays meet against fm_octree_cast and the shape itself, beams, shadows, reflections and refractions
// against what geometry says, views, statistics, the device against the processor, and arguments that are refused.

#include "fathom/octree_render.h"
#include "render/render.h"
#include "shaders/include/octree_pixel_rule.h"

#include "octree_shapes.h"

enum { WIDTH = 83, HEIGHT = 61, PIXELS = WIDTH * HEIGHT };

typedef struct stage {
    fm_context *context;
    fm_octree_renderer *renderer;
} stage;

static fm_octree_hit hits[PIXELS], other_hits[PIXELS];
static uint8_t pixels[4 * PIXELS], other_pixels[4 * PIXELS];

static fm_octree_render_desc view_of(fm_octree *octree) {
    return (fm_octree_render_desc){.camera = {.position = {1.2f, -2.2f, 0.9f}, .forward = {-1.2f, 2.2f, -0.9f}, .fov_y = 45},
                                   .width = WIDTH,
                                   .height = HEIGHT,
                                   .octree = octree,
                                   .count = true};
}

static bool render(stage *s, const fm_octree_render_desc *desc) {
    return CHECK_OK(fm_octree_render(s->renderer, desc, NULL)) && CHECK_OK(fm_octree_renderer_hits(s->renderer, hits)) &&
           CHECK_OK(fm_octree_renderer_read(s->renderer, pixels));
}

// The ways of a picture's rays, of length 1, by the camera's own numbers.
static void way_of(const fm_octree_render_desc *desc, int x, int y, float way[3]) {
    double forward[3], right[3], down[3], v[3];
    for (int i = 0; i < 3; i++) {
        forward[i] = (double)desc->camera.forward[i];
    }
    const double length = shape_length(forward), level = hypot(forward[0], forward[1]);
    for (int i = 0; i < 3; i++) {
        forward[i] /= length;
    }
    right[0] = forward[1] * length / level;
    right[1] = -forward[0] * length / level;
    right[2] = 0;
    down[0] = forward[1] * right[2] - forward[2] * right[1];
    down[1] = forward[2] * right[0] - forward[0] * right[2];
    down[2] = forward[0] * right[1] - forward[1] * right[0];
    const double pixel = 2 * tan((double)desc->camera.fov_y * 3.14159265358979 / 360) / desc->height;
    for (int i = 0; i < 3; i++) {
        v[i] = forward[i] + pixel * (right[i] * (x + 0.5 - 0.5 * desc->width) + down[i] * (y + 0.5 - 0.5 * desc->height));
    }
    const double size = shape_length(v);
    for (int i = 0; i < 3; i++) {
        way[i] = (float)(v[i] / size);
    }
}

// Each pixel's hit is what a ray of its own meets, beams or not.
static void check_rays(stage *s, fm_octree *octree, const fm_octree_render_desc *desc) {
    static fm_mesh_ray rays[PIXELS];
    for (int i = 0; i < PIXELS; i++) {
        rays[i] = (fm_mesh_ray){.last = 1e30f};
        memcpy(rays[i].origin, desc->camera.position, sizeof rays[i].origin);
        way_of(desc, i % WIDTH, i / WIDTH, rays[i].direction);
    }
    if (!render(s, desc) || !CHECK_OK(fm_octree_cast(octree, rays, PIXELS, desc->epsilon, other_hits))) {
        return;
    }
    // Where samples lie, which beams change, the published hit and its normal hang on.
    const double most_off = desc->epsilon < 0 ? 0.5 : 0.05, least_turn = desc->epsilon < 0 ? 0.7 : 0.999;
    int wrong = 0, met = 0;
    uint64_t reads = 0, most = 0;
    for (int i = 0; i < PIXELS; i++) {
        const bool here = hits[i].t < 1e30f, there = other_hits[i].t < 1e30f;
        const double off = here && there ? fabs((double)hits[i].t - (double)other_hits[i].t) : 0;
        double turned = 0;
        for (int k = 0; k < 3; k++) {
            turned += (double)hits[i].normal[k] * (double)other_hits[i].normal[k];
        }
        met += here;
        wrong += here != there || off > most_off * octree->info.cell || (here && turned < least_turn);
        reads += hits[i].reads;
        most = most > hits[i].reads ? most : hits[i].reads;
    }
    CHECK(met > PIXELS / 20 && met < PIXELS);
    if (!CHECK(wrong <= PIXELS / 200)) {
        fprintf(stderr, "    %d of %d pixels\n", wrong, PIXELS);
    }
    fm_octree_render_stats stats;
    if (CHECK_OK(fm_octree_renderer_stats(s->renderer, &stats))) {
        CHECK(stats.rays == PIXELS && stats.hits == (uint64_t)met && stats.reads == reads && stats.most_reads == most);
        CHECK(stats.second_rays == 0 && stats.second_reads == 0);
        CHECK(octree->info.kind > FM_OCTREE_VOXELS || stats.beam_reads > 0);
        printf("reads a ray %.1f with beams, %.2f of them beside\n", (double)reads / PIXELS, (double)stats.beam_reads / PIXELS);
    }
}

// No ray of a tile truly meets the surface before its beam ends, and beams are of use.
static void check_beams(fm_octree *octree, const shape *of) {
    const fm_octree_head head = fm_octree_host_head(octree);
    const fm_octree_render_desc desc = view_of(octree);
    double far = 0, all = 0;
    for (int zoom = 0; zoom < 3; zoom++) {
        fm_render_desc view = {.camera = desc.camera, .width = zoom ? 1024 : 64, .height = zoom ? 1024 : 64};
        fm_march_push push;
        fm_camera_rays(&view, &push);
        fm_octree_scene scene = {.head = (uint64_t)(uintptr_t)&head, .epsilon = 0.1f};
        scene.width = (int32_t)view.width;
        scene.height = (int32_t)view.height;
        memcpy(scene.origin, desc.camera.position, sizeof scene.origin);
        memcpy(scene.corner, push.corner, sizeof scene.corner);
        memcpy(scene.right, push.right, sizeof scene.right);
        memcpy(scene.down, push.down, sizeof scene.down);
        const int tiles = scene.width / FM_OCTREE_TILE;
        for (int i = 0; i < tiles * tiles; i += zoom ? 37 : 1) {
            const fm_octree_beam beam = fm_tile_beam(&scene, i % tiles, i / tiles);
            double nearest = INFINITY;
            for (int k = 0; k < FM_OCTREE_TILE * FM_OCTREE_TILE; k += zoom ? 9 : 1) {
                const int x = i % tiles * FM_OCTREE_TILE + k % FM_OCTREE_TILE, y = i / tiles * FM_OCTREE_TILE + k / FM_OCTREE_TILE;
                const fm_v3 way = fm_octree_pixel_way(&scene, (float)x, (float)y);
                fm_mesh_ray ray = {.direction = {way.x, way.y, way.z}, .last = 1e30f};
                memcpy(ray.origin, scene.origin, sizeof ray.origin);
                nearest = fmin(nearest, shape_trace(of, &ray).t);
            }
            CHECK((double)beam.t <= nearest);
            far += isfinite(nearest) ? (double)beam.t : 0;
            all += isfinite(nearest) ? nearest : 0;
        }
    }
    printf("beams go %.3f of the way\n", far / all);
    CHECK(all > 0 && far > 0.8 * all);
}

static uint8_t green_at(const uint8_t *picture, int i) {
    return picture[4 * i + 1];
}

// A pixel's place, as its hit says.
static void place_of(const fm_octree_render_desc *desc, int i, double p[3], float way[3]) {
    way_of(desc, i % WIDTH, i / WIDTH, way);
    for (int k = 0; k < 3; k++) {
        p[k] = (double)desc->camera.position[k] + (double)way[k] * (double)hits[i].t;
    }
}

// The sun is seen from where a ray by true distances gets away: pixels in shadow are darker than without shadows, others are not.
static void check_shadow(stage *s, const shape *of, fm_octree *octree) {
    fm_octree_render_desc desc = view_of(octree);
    const float sun[3] = {0.6f, -0.768f, 0.224f};
    memcpy(desc.sun, sun, sizeof sun);
    if (!render(s, &desc)) {
        return;
    }
    memcpy(other_pixels, pixels, sizeof pixels);
    desc.shadow = true;
    if (!render(s, &desc)) {
        return;
    }
    int lit = 0, dark = 0, wrong = 0;
    for (int i = 0; i < PIXELS; i++) {
        double cosine = 0, p[3];
        float way[3];
        if (!(hits[i].t < 1e30f)) {
            wrong += memcmp(pixels + 4 * i, other_pixels + 4 * i, 4) != 0;
            continue;
        }
        place_of(&desc, i, p, way);
        fm_mesh_ray ray = {.last = 1e30f};
        for (int k = 0; k < 3; k++) {
            cosine += (double)hits[i].normal[k] * (double)sun[k];
            ray.origin[k] = (float)(p[k] + 0.5 * octree->info.cell * (double)hits[i].normal[k]);
            ray.direction[k] = sun[k];
        }
        const shape_truth truth = shape_trace(of, &ray);
        // Rays that nearly touch the shape may go either way.
        if (cosine < 0.1 || (isinf(truth.t) && truth.nearest < 0.45 * octree->info.cell)) {
            continue;
        }
        const bool shadowed = green_at(pixels, i) < green_at(other_pixels, i);
        lit += !shadowed;
        dark += shadowed;
        wrong += shadowed != isfinite(truth.t);
    }
    CHECK(lit > 50 && dark > 15);
    if (!CHECK(wrong <= (lit + dark) / 100)) {
        fprintf(stderr, "    %d of %d pixels\n", wrong, lit + dark);
    }
    fm_octree_render_stats stats;
    CHECK(fm_octree_renderer_stats(s->renderer, &stats) == FM_OK && stats.second_rays > (uint64_t)dark && stats.second_reads > 0);
}

static double light_of(uint8_t byte) {
    const double v = byte / 255.0;
    return v <= 0.04045 ? v / 12.92 : pow((v + 0.055) / 1.055, 2.4);
}

static double sky_green(const double way[3]) {
    return 0.84 + (0.42 - 0.84) * sqrt(fmax(way[2], 0));
}

// A mirror of a ball shows the sky, in which there is nothing else.
static void check_mirror(stage *s, fm_octree *ball) {
    fm_octree_render_desc desc = view_of(ball);
    desc.reflection = 1;
    if (!render(s, &desc)) {
        return;
    }
    int looked = 0, wrong = 0;
    for (int i = 0; i < PIXELS; i++) {
        double p[3], v[3], sign, along = 0, out[3];
        float way[3];
        if (!(hits[i].t < 1e30f)) {
            continue;
        }
        place_of(&desc, i, p, way);
        const double length = shape_length(p);
        shape_sphere(p, v, &sign);
        for (int k = 0; k < 3; k++) {
            along += p[k] / length * (double)way[k];
        }
        for (int k = 0; k < 3; k++) {
            out[k] = (double)way[k] - 2 * along * p[k] / length;
        }
        looked++;
        wrong += fabs(sky_green(out) - light_of(green_at(pixels, i))) > 0.03;
    }
    CHECK(looked > PIXELS / 10);
    if (!CHECK(wrong <= looked / 50)) {
        fprintf(stderr, "    %d of %d pixels\n", wrong, looked);
    }
}

// Light through a ball of glass by Snell and Fresnel, followed by hand.
static double glass_green(const double p[3], const float way[3], double index) {
    const double radius = shape_length(p);
    double n[3], cosine = 0, in[3], out[3], mirrored[3];
    for (int k = 0; k < 3; k++) {
        n[k] = p[k] / radius;
        cosine -= n[k] * (double)way[k];
    }
    for (int k = 0; k < 3; k++) {
        mirrored[k] = (double)way[k] + 2 * cosine * n[k];
    }
    const double bent = sqrt(1 - (1 - cosine * cosine) / (index * index));
    for (int k = 0; k < 3; k++) {
        in[k] = (double)way[k] / index + n[k] * (cosine / index - bent);
    }
    const double across = (cosine / index - bent) / (cosine / index + bent),
                 level = (cosine - bent / index) / (cosine + bent / index);
    const double back = 0.5 * (across * across + level * level);
    // Inside, the chord meets the ball at the angle that it left it at.
    double q[3], turned = 0;
    for (int k = 0; k < 3; k++) {
        q[k] = n[k] + 2 * bent * in[k];
    }
    for (int k = 0; k < 3; k++) {
        turned += in[k] * q[k];
    }
    for (int k = 0; k < 3; k++) {
        out[k] = index * in[k] + q[k] * (cosine - index * turned);
    }
    return back * sky_green(mirrored) + (1 - back) * (1 - back) * sky_green(out);
}

static void check_glass(stage *s, fm_octree *ball) {
    fm_octree_render_desc desc = view_of(ball);
    desc.refraction = 1.5f;
    if (!render(s, &desc)) {
        return;
    }
    int looked = 0, wrong = 0;
    for (int i = 0; i < PIXELS; i++) {
        double p[3];
        float way[3];
        if (!(hits[i].t < 1e30f)) {
            continue;
        }
        place_of(&desc, i, p, way);
        looked++;
        const double wanted = glass_green(p, way, 1.5);
        wrong += fabs(wanted - light_of(green_at(pixels, i))) > 0.05;
    }
    CHECK(looked > PIXELS / 10);
    // Towards the outline the way out turns fast.
    if (!CHECK(wrong <= looked / 20)) {
        fprintf(stderr, "    %d of %d pixels\n", wrong, looked);
    }
}

static void check_views(stage *s, fm_octree *octree) {
    fm_octree_render_desc desc = view_of(octree);
    for (int view = FM_OCTREE_SHADED; view <= FM_OCTREE_LEVELS; view++) {
        desc.view = (fm_octree_picture_view)view;
        desc.shadow = view != FM_OCTREE_SHADED;  // of no account there
        if (!render(s, &desc)) {
            return;
        }
        int plain = 0, opaque = 0;
        for (int i = 0; i < PIXELS; i++) {
            opaque += pixels[4 * i + 3] == 255;
            plain += memcmp(pixels + 4 * i, pixels, 4) == 0;
            if (view == FM_OCTREE_NORMALS && hits[i].t < 1e30f) {
                const double half_way = 0.5 + 0.45 * (double)hits[i].normal[1];
                CHECK(fabs(light_of(green_at(pixels, i)) - half_way * half_way) < 0.01);
            }
        }
        CHECK(opaque == PIXELS && plain < PIXELS);
    }
}

static void check_colors(stage *s) {
    const fm_octree_desc desc = {.size = 32, .top_bytes = 256, .attribute = FM_OCTREE_COLOR};
    fm_octree *octree = shape_octree(s->context, &shapes[0], &desc, 0.02);
    fm_octree_render_desc view = octree ? view_of(octree) : (fm_octree_render_desc){0};
    if (octree && render(s, &view)) {
        int red = 0, blue = 0;
        for (int i = 0; i < PIXELS; i++) {
            const bool there = hits[i].t < 1e30f;
            red += there && pixels[4 * i] > 0 && pixels[4 * i + 2] == 0;
            blue += there && pixels[4 * i] == 0 && pixels[4 * i + 2] > 0;
        }
        CHECK(red > 100 && blue > 100);
    }
    fm_octree_destroy(octree);
}

static void check_arguments(stage *s, fm_octree *octree) {
    const fm_octree_render_desc good = view_of(octree);
    fm_octree_renderer *fresh = NULL;
    fm_octree_render_stats stats;
    CHECK_FAILS(fm_octree_renderer_create(NULL, &fresh), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_octree_renderer_create(s->context, NULL), FM_ERROR_INVALID_ARGUMENT);
    if (!CHECK_OK(fm_octree_renderer_create(s->context, &fresh))) {
        return;
    }
    CHECK_FAILS(fm_octree_renderer_read(fresh, pixels), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_octree_renderer_hits(fresh, hits), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_octree_render(NULL, &good, NULL), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_octree_render(fresh, NULL, NULL), FM_ERROR_INVALID_ARGUMENT);
    fm_octree_render_desc bad[9];
    for (int i = 0; i < 9; i++) {
        bad[i] = good;
    }
    bad[0].width = 0;
    bad[1].height = 16385;
    bad[2].view = (fm_octree_picture_view)9;
    bad[3].epsilon = NAN;
    bad[4].reflection = 1.5f;
    bad[5].refraction = 0.7f;
    bad[6].octree = NULL;
    bad[7].camera.position[1] = INFINITY;
    bad[8].sun[0] = NAN;
    for (int i = 0; i < 9; i++) {
        CHECK_FAILS(fm_octree_render(fresh, &bad[i], NULL), FM_ERROR_INVALID_ARGUMENT);
    }
    const fm_octree_desc desc = {.size = 16, .top_bytes = 256};
    const fm_context_desc elsewhere = {.backend = FM_BACKEND_CPU, .threads = 1};
    fm_context *stranger = NULL;
    CHECK_OK(fm_context_create(&elsewhere, &stranger));
    fm_octree *foreign = shape_octree(stranger, &shapes[0], &desc, 0.02);
    fm_octree_render_desc of_other = good;
    of_other.octree = foreign;
    CHECK_FAILS(fm_octree_render(fresh, &of_other, NULL), FM_ERROR_INVALID_ARGUMENT);
    fm_octree_destroy(foreign);
    fm_context_destroy(stranger);
    fm_octree_render_desc uncounted = good;
    uncounted.count = false;
    CHECK_OK(fm_octree_render(fresh, &uncounted, NULL));
    CHECK_FAILS(fm_octree_renderer_stats(fresh, &stats), FM_ERROR_INVALID_ARGUMENT);
    fm_volume_buffer buffer;
    const bool on_device = fm_octree_renderer_vulkan(fresh, &buffer) == FM_OK;
    CHECK(!on_device || buffer.size == 4 * PIXELS);
    fm_octree_renderer_destroy(fresh);
    fm_octree_renderer_destroy(NULL);
}

// Bytes of pictures, on the device or the host, that the context holds.
static uint64_t picture_bytes(fm_context *context) {
    fm_memory memory[64];
    uint32_t count = 64;
    uint64_t bytes = 0;
    if (CHECK_OK(fm_context_memory(context, &count, memory))) {
        for (uint32_t i = 0; i < count; i++) {
            bytes += strcmp(memory[i].purpose, "pictures") == 0 ? memory[i].bytes : 0;
        }
    }
    return bytes;
}

// Second rays take memory where they are counted, and only there.
static void check_memory(stage *s, fm_octree *octree) {
    enum { SLACK = 8192 };  // what a device rounds to, and the beams
    fm_octree_renderer *fresh = NULL;
    fm_octree_render_desc desc = view_of(octree);
    fm_octree_render_stats stats;
    const uint64_t before = picture_bytes(s->context);
    uint64_t bytes[3];
    fm_volume_buffer buffers[3];
    if (!CHECK_OK(fm_octree_renderer_create(s->context, &fresh))) {
        return;
    }
    desc.shadow = true;
    for (int i = 0; i < 3; i++) {
        desc.count = i == 1;
        CHECK_OK(fm_octree_render(fresh, &desc, NULL));
        bytes[i] = picture_bytes(s->context) - before;
        const bool on_device = fm_octree_renderer_vulkan(fresh, &buffers[i]) == FM_OK;
        CHECK(!on_device || buffers[i].buffer == buffers[0].buffer);
        CHECK(i == 1 ? fm_octree_renderer_stats(fresh, &stats) == FM_OK && stats.second_rays > 0 : true);
    }
    CHECK(bytes[0] >= 20 * PIXELS && bytes[0] < 20 * PIXELS + SLACK);
    CHECK(bytes[1] >= 28 * PIXELS && bytes[1] < 28 * PIXELS + SLACK && bytes[2] == bytes[1]);
    fm_octree_renderer_destroy(fresh);
    CHECK(picture_bytes(s->context) == before);
}

// As the header names them.
static void check_passes(stage *s, fm_octree *octree, bool vulkan) {
    static const char *const names[] = {"beams", "primary", "second"};
    fm_octree_render_desc desc = view_of(octree);
    fm_pass passes[8];
    uint32_t count = 8;
    desc.shadow = true;
    if (CHECK_OK(fm_octree_render(s->renderer, &desc, NULL)) && CHECK_OK(fm_context_passes(s->context, &count, passes)) &&
        CHECK(count == (vulkan ? 3 : 2))) {
        for (uint32_t i = 0; i < count; i++) {
            CHECK(strcmp(passes[i].name, names[vulkan ? i : i + 1]) == 0);
        }
    }
}

// Pictures on the device are those of the processor but for rounding.
static void check_same(stage *s, stage *cpu, const shape *of, const fm_octree_desc *desc) {
    fm_octree *here = shape_octree(s->context, of, desc, 0.02), *there = shape_octree(cpu->context, of, desc, 0.02);
    for (int second = 0; second < 3 && here && there; second++) {
        fm_octree_render_desc view = view_of(there);
        view.shadow = second == 1;
        view.reflection = second == 1 ? 0.3f : 0;
        view.refraction = second == 2 ? 1.3f : 0;
        if (!render(cpu, &view)) {
            break;
        }
        memcpy(other_pixels, pixels, sizeof pixels);
        view.octree = here;
        if (!render(s, &view)) {
            break;
        }
        int apart = 0;
        for (int i = 0; i < 4 * PIXELS; i++) {
            apart += abs(pixels[i] - other_pixels[i]) > 3;
        }
        if (!CHECK(apart <= 4 * PIXELS / 100)) {
            fprintf(stderr, "    %d bytes of %d, second rays %d\n", apart, 4 * PIXELS, second);
        }
    }
    fm_octree_destroy(here);
    fm_octree_destroy(there);
}

static void check_all(stage *s, stage *cpu) {
    static const fm_octree_desc descs[] = {{.size = 64, .top_bytes = 256},
                                           {.size = 64, .top_bytes = 256, .code = FM_OCTREE_OCTAHEDRAL},
                                           {.kind = FM_OCTREE_DISTANCE, .size = 64, .top_bytes = 256}};
    for (int i = 0; i < 3; i++) {
        fm_octree *torus = shape_octree(s->context, &shapes[1], &descs[i], 0.02);
        fm_octree *ball = shape_octree(s->context, &shapes[0], &descs[i], 0.02);
        if (torus && ball) {
            fm_octree_render_desc desc = view_of(torus);
            check_rays(s, torus, &desc);
            // So near that beams end among the leaves, where they are as long as the surface allows.
            fm_octree_render_desc close = desc;
            const float towards[3] = {-0.62f, 2.05f, -0.72f};
            memcpy(close.camera.forward, towards, sizeof towards);
            close.camera.fov_y = 5;
            check_rays(s, torus, &close);
            check_shadow(s, &shapes[1], torus);
            if (s == cpu) {
                check_beams(torus, &shapes[1]);
            }
        }
        // A driver compiles a kernel for each of these: seconds on one that is software.
        if (torus && ball && (i == 0 || s == cpu)) {
            fm_octree_render_desc desc = view_of(torus);
            desc.epsilon = -0.1f;
            check_rays(s, torus, &desc);
            check_mirror(s, ball);
            check_glass(s, ball);
            check_views(s, torus);
        }
        fm_octree_destroy(torus);
        if (ball && i == 0) {
            check_arguments(s, ball);
            check_memory(s, ball);
            check_passes(s, ball, s != cpu);
        }
        fm_octree_destroy(ball);
        if (s != cpu && i == 0) {
            check_same(s, cpu, &shapes[1], &descs[i]);
        }
    }
    check_colors(s);
}

int main(int count, char **arguments) {
    vulkan_options options;
    const bool vulkan = count > 1;
    if (!vulkan_parse(count, arguments, &options)) {
        return 2;
    }
    stage cpu = {0}, gpu = {0};
    const fm_context_desc desc = {.backend = FM_BACKEND_CPU, .threads = 2};
    if (!CHECK_OK(fm_context_create(&desc, &cpu.context)) || !CHECK_OK(fm_octree_renderer_create(cpu.context, &cpu.renderer))) {
        return check_summary();
    }
    if (vulkan && vulkan_open(&options, NULL, &gpu.context) != FM_OK) {
        return vulkan_missing();
    }
    if (vulkan && !CHECK_OK(fm_octree_renderer_create(gpu.context, &gpu.renderer))) {
        return check_summary();
    }
    check_all(vulkan ? &gpu : &cpu, &cpu);
    fm_octree_renderer_destroy(gpu.renderer);
    fm_octree_renderer_destroy(cpu.renderer);
    if (vulkan) {
        vulkan_close(gpu.context);
    }
    fm_context_destroy(cpu.context);
    return check_summary();
}
