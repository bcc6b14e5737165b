// SPDX-License-Identifier: MIT
// Pictures of octrees: arguments, the constants of a picture, and what is told of it afterwards.

#include "render/octree_picture.h"

#include "render/render.h"
#include "shaders/include/octree_pixel_rule.h"

#include <string.h>

_Static_assert(FM_GPU_OCTREE_SHADED == FM_OCTREE_SHADED && FM_GPU_OCTREE_NORMALS == FM_OCTREE_NORMALS &&
                   FM_GPU_OCTREE_READS == FM_OCTREE_READS && FM_GPU_OCTREE_LEVELS == FM_OCTREE_LEVELS,
               "kernels know these by number");

static const float DEFAULT_EPSILON = 0.1f, MOST_EPSILON = 8, MOST_REFRACTION = 8;

fm_result fm_octree_renderer_create(fm_context *context, fm_octree_renderer **renderer) {
    if (!context || !renderer) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "%s is NULL", context ? "renderer" : "context");
    }
    fm_octree_renderer *made = fm_alloc_zero(&context->allocator, sizeof *made, "a renderer of octrees");
    if (!made) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    made->context = context;
    const fm_result status = context->gpu ? fm_gpu_octree_picture_create(made) : FM_OK;
    if (status != FM_OK) {
        fm_octree_renderer_destroy(made);
        return status;
    }
    *renderer = made;
    return FM_OK;
}

void fm_octree_renderer_destroy(fm_octree_renderer *renderer) {
    if (!renderer) {
        return;
    }
    if (renderer->context->gpu) {
        fm_gpu_octree_picture_destroy(renderer);
    } else {
        fm_host_octree_picture_destroy(renderer);
    }
    fm_free(&renderer->context->allocator, renderer, sizeof *renderer);
}

static fm_result check_numbers(const fm_octree_render_desc *desc) {
    if (desc->width == 0 || desc->height == 0 || desc->width > FM_MAX_PIXELS || desc->height > FM_MAX_PIXELS) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "the picture is %u x %u: 1 to %d each is accepted", desc->width, desc->height,
                       FM_MAX_PIXELS);
    }
    if ((uint32_t)desc->view > FM_OCTREE_LEVELS) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "view is %d, which is no such enumerator", (int)desc->view);
    }
    if (!(fabsf(desc->epsilon) <= MOST_EPSILON)) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "epsilon is %g: -%g to %g cells are accepted", (double)desc->epsilon,
                       (double)MOST_EPSILON, (double)MOST_EPSILON);
    }
    if (!fm_all_finite(desc->sun)) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "sun is not finite");
    }
    if (!(desc->reflection >= 0 && desc->reflection <= 1)) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "reflection is %g: 0 to 1 is accepted", (double)desc->reflection);
    }
    if (!(desc->refraction == 0 || (desc->refraction > 1 && desc->refraction <= MOST_REFRACTION))) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "refraction is %g: 0, or an index above 1 and up to %g, is accepted",
                       (double)desc->refraction, (double)MOST_REFRACTION);
    }
    return FM_OK;
}

static fm_result check(const fm_octree_renderer *renderer, const fm_octree_render_desc *desc, const fm_octree *octree) {
    FM_TRY(fm_camera_check(&desc->camera));
    FM_TRY(check_numbers(desc));
    if (!octree) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "octree and stream are NULL: one of them is wanted");
    }
    return octree->context == renderer->context ? FM_OK
                                                : fm_fail(FM_ERROR_INVALID_ARGUMENT, "the octree belongs to another context");
}

static void make_scene(fm_octree_picture *picture) {
    const fm_octree_render_desc *desc = &picture->desc;
    fm_octree_scene *scene = &picture->scene;
    const fm_render_desc rays = {.camera = desc->camera, .width = desc->width, .height = desc->height};
    fm_march_push push;
    fm_camera_rays(&rays, &push);
    memcpy(scene->origin, desc->camera.position, sizeof scene->origin);
    memcpy(scene->corner, push.corner, sizeof scene->corner);
    memcpy(scene->right, push.right, sizeof scene->right);
    memcpy(scene->down, push.down, sizeof scene->down);
    fm_sun_way(desc->sun, scene->sun);
    scene->width = (int32_t)desc->width;
    scene->height = (int32_t)desc->height;
    scene->epsilon = desc->epsilon == 0 ? DEFAULT_EPSILON : fabsf(desc->epsilon);
    // Above what counts as on the surface, and what the surface of a cell may be off.
    scene->lift = 2.5f * scene->epsilon + 0.05f;
    scene->reflection = desc->reflection;
    scene->refraction = desc->refraction;
    scene->stepped = desc->epsilon < 0;
    picture->beams = fm_octree_has_beams(picture->octree->head.kind);
    picture->second = desc->view == FM_OCTREE_SHADED && (desc->shadow || desc->reflection > 0 || desc->refraction > 0);
}

fm_result fm_octree_render(fm_octree_renderer *renderer, const fm_octree_render_desc *desc, fm_ticket *ticket) {
    if (!renderer || !desc) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "%s is NULL", renderer ? "desc" : "renderer");
    }
    fm_octree_picture picture = {.desc = *desc};
    picture.octree = desc->stream ? fm_octree_stream_coarse(desc->stream) : desc->octree;
    if (desc->stream) {
        picture.scene.grid = fm_octree_stream_grid(desc->stream);
    }
    FM_TRY(check(renderer, desc, picture.octree));
    make_scene(&picture);
    fm_ticket own = 0;
    FM_TRY(renderer->gpu ? fm_gpu_octree_picture(renderer, &picture, &own) : fm_host_octree_picture(renderer, &picture));
    renderer->width = desc->width;
    renderer->height = desc->height;
    renderer->counted = desc->count;
    renderer->has_seconds = picture.second;
    renderer->has_beams = picture.beams;
    if (ticket) {
        *ticket = own;
        return FM_OK;
    }
    return fm_wait(renderer->context, own);
}

static fm_result check_read(const fm_octree_renderer *renderer, const void *target) {
    if (!renderer || !target) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "%s is NULL", renderer ? "the target" : "renderer");
    }
    return renderer->width > 0 ? FM_OK : fm_fail(FM_ERROR_INVALID_ARGUMENT, "there is no picture yet: call fm_octree_render first");
}

fm_result fm_octree_renderer_read(fm_octree_renderer *renderer, uint8_t *pixels) {
    FM_TRY(check_read(renderer, pixels));
    if (renderer->gpu) {
        return fm_gpu_octree_picture_read(renderer, pixels);
    }
    memcpy(pixels, renderer->room.picture, 4 * (uint64_t)renderer->width * renderer->height);
    return FM_OK;
}

fm_result fm_octree_renderer_vulkan(const fm_octree_renderer *renderer, fm_volume_buffer *buffer) {
    FM_TRY(check_read(renderer, buffer));
    if (!renderer->gpu) {
        return fm_fail(FM_ERROR_UNSUPPORTED, "the picture lies in host memory: use fm_octree_renderer_read");
    }
    fm_gpu_octree_picture_describe(renderer, buffer);
    return FM_OK;
}

// What a picture leaves behind, on the host: the renderer's own on the CPU, else a copy.
typedef struct words {
    fm_octree_pixel *pixels;
    uint32_t (*seconds)[2], (*beams)[2];
    uint64_t count, tiles;
} words;

static void free_words(const fm_octree_renderer *renderer, const words *w) {
    if (renderer->gpu) {
        const fm_allocator *allocator = &renderer->context->allocator;
        fm_free(allocator, w->pixels, w->count * sizeof *w->pixels);
        fm_free(allocator, w->seconds, w->count * sizeof *w->seconds);
        fm_free(allocator, w->beams, w->tiles * sizeof *w->beams);
    }
}

static fm_result get_words(fm_octree_renderer *renderer, bool all, words *w) {
    *w = (words){.pixels = renderer->room.pixels,
                 .seconds = renderer->room.seconds,
                 .beams = renderer->room.beams,
                 .count = (uint64_t)renderer->width * renderer->height,
                 .tiles = fm_div_up(renderer->width, FM_OCTREE_TILE) * fm_div_up(renderer->height, FM_OCTREE_TILE)};
    if (!renderer->gpu) {
        return FM_OK;
    }
    const fm_allocator *allocator = &renderer->context->allocator;
    w->pixels = fm_alloc(allocator, w->count * sizeof *w->pixels, "what a picture's rays met");
    w->seconds = all ? fm_alloc(allocator, w->count * sizeof *w->seconds, "the second rays of a picture") : NULL;
    w->beams = all ? fm_alloc(allocator, w->tiles * sizeof *w->beams, "the beams of a picture") : NULL;
    fm_result status = w->pixels && (!all || (w->seconds && w->beams)) ? FM_OK : FM_ERROR_OUT_OF_HOST_MEMORY;
    if (status == FM_OK) {
        status = fm_gpu_octree_picture_words(renderer, w->pixels, w->seconds, w->beams);
    }
    if (status != FM_OK) {
        free_words(renderer, w);
    }
    return status;
}

fm_result fm_octree_renderer_hits(fm_octree_renderer *renderer, fm_octree_hit *hits) {
    FM_TRY(check_read(renderer, hits));
    words w;
    FM_TRY(get_words(renderer, false, &w));
    for (uint64_t i = 0; i < w.count; i++) {
        const fm_octree_pixel *pixel = &w.pixels[i];
        const fm_v3 normal = pixel->t < INFINITY ? fm_unpack_way(pixel->normal) : (fm_v3){0, 0, 0};
        hits[i] = (fm_octree_hit){pixel->t, {normal.x, normal.y, normal.z}, pixel->mark, pixel->reads >> 5};
    }
    free_words(renderer, &w);
    return FM_OK;
}

fm_result fm_octree_renderer_stats(fm_octree_renderer *renderer, fm_octree_render_stats *stats) {
    FM_TRY(check_read(renderer, stats));
    if (!renderer->counted) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "the newest picture was rendered without `count`");
    }
    words w;
    FM_TRY(get_words(renderer, true, &w));
    fm_octree_render_stats sum = {.rays = w.count};
    for (uint64_t i = 0; i < w.count; i++) {
        const uint64_t reads = w.pixels[i].reads >> 5;
        sum.hits += w.pixels[i].t < INFINITY;
        sum.reads += reads;
        sum.most_reads = fm_max_u64(sum.most_reads, reads);
        sum.second_rays += renderer->has_seconds ? w.seconds[i][0] : 0;
        sum.second_reads += renderer->has_seconds ? w.seconds[i][1] : 0;
    }
    for (uint64_t i = 0; i < w.tiles && renderer->has_beams; i++) {
        sum.beam_reads += w.beams[i][1];
    }
    free_words(renderer, &w);
    *stats = sum;
    return FM_OK;
}
