// SPDX-License-Identifier: MIT
#include "render/deferred.h"
#include "render/octree_picture.h"
#include "render/octree_store.h"
#include "render/render.h"

static fm_result unsupported(void) {
    return fm_fail(FM_ERROR_UNSUPPORTED, "this build of Fathom has no Vulkan backend (FATHOM_VULKAN=OFF)");
}

fm_result fm_gpu_render_create(fm_renderer *renderer) {
    (void)renderer;
    return unsupported();
}

void fm_gpu_render_destroy(fm_renderer *renderer) {
    (void)renderer;
}

fm_result fm_gpu_render_picture(fm_renderer *renderer, const fm_world *world, const fm_picture *picture, fm_ticket *ticket) {
    (void)renderer, (void)world, (void)picture, (void)ticket;
    return unsupported();
}

fm_result fm_gpu_pick_begin(fm_renderer *renderer, const fm_world *world, const fm_picture *picture, const float way[3],
                            fm_ticket *ticket) {
    (void)renderer, (void)world, (void)picture, (void)way, (void)ticket;
    return unsupported();
}

fm_result fm_gpu_pick_end(fm_renderer *renderer, fm_ticket ticket, fm_pick *pick) {
    (void)renderer, (void)ticket, (void)pick;
    return unsupported();
}

fm_result fm_gpu_render_read(fm_renderer *renderer, uint8_t *pixels) {
    (void)renderer, (void)pixels;
    return unsupported();
}

void fm_gpu_render_describe(const fm_renderer *renderer, fm_volume_buffer *buffer) {
    (void)renderer, (void)buffer;
}

fm_result fm_gpu_render_stats(fm_renderer *renderer) {
    (void)renderer;
    return unsupported();
}

fm_result fm_gpu_deferred_create(fm_deferred *deferred) {
    (void)deferred;
    return unsupported();
}

void fm_gpu_deferred_destroy(fm_deferred *deferred) {
    (void)deferred;
}

fm_result fm_gpu_deferred_picture(fm_deferred *deferred, fm_deferred_picture *picture, fm_ticket *ticket) {
    (void)deferred, (void)picture, (void)ticket;
    return unsupported();
}

fm_result fm_gpu_deferred_read(fm_deferred *deferred, uint8_t *pixels) {
    (void)deferred, (void)pixels;
    return unsupported();
}

void fm_gpu_deferred_describe(const fm_deferred *deferred, fm_volume_buffer *buffer) {
    (void)deferred, (void)buffer;
}

fm_result fm_gpu_deferred_surfaces(fm_deferred *deferred, fm_defer_surface *surfaces) {
    (void)deferred, (void)surfaces;
    return unsupported();
}

fm_result fm_gpu_deferred_lights(fm_deferred *deferred, float *light) {
    (void)deferred, (void)light;
    return unsupported();
}

fm_result fm_gpu_octree_picture_create(fm_octree_renderer *renderer) {
    (void)renderer;
    return unsupported();
}

void fm_gpu_octree_picture_destroy(fm_octree_renderer *renderer) {
    (void)renderer;
}

fm_result fm_gpu_octree_picture(fm_octree_renderer *renderer, fm_octree_picture *picture, fm_ticket *ticket) {
    (void)renderer, (void)picture, (void)ticket;
    return unsupported();
}

fm_result fm_gpu_octree_picture_read(fm_octree_renderer *renderer, uint8_t *pixels) {
    (void)renderer, (void)pixels;
    return unsupported();
}

void fm_gpu_octree_picture_describe(const fm_octree_renderer *renderer, fm_volume_buffer *buffer) {
    (void)renderer, (void)buffer;
}

fm_result fm_gpu_octree_picture_words(fm_octree_renderer *renderer, fm_octree_pixel *pixels, uint32_t (*seconds)[2],
                                      uint32_t (*beams)[2]) {
    (void)renderer, (void)pixels, (void)seconds, (void)beams;
    return unsupported();
}

fm_result fm_octree_store_create(fm_context *context, uint64_t bytes, uint64_t parts, fm_octree_store **store) {
    (void)context, (void)bytes, (void)parts, (void)store;
    return unsupported();
}

void fm_octree_store_destroy(fm_octree_store *store) {
    (void)store;
}

uint64_t fm_octree_store_tables(uint64_t parts) {
    (void)parts;
    return 0;
}

uint64_t fm_octree_store_most(const fm_context *context) {
    (void)context;
    return 0;
}

fm_result fm_octree_store_put(fm_octree_store *store, uint64_t offset, uint8_t *image, uint64_t bytes, const fm_octree *numbers,
                              uint64_t *head) {
    (void)store, (void)offset, (void)image, (void)bytes, (void)numbers, (void)head;
    return unsupported();
}

fm_result fm_octree_store_table(fm_octree_store *store, const fm_octree_part *rows, uint64_t *address) {
    (void)store, (void)rows, (void)address;
    return unsupported();
}
