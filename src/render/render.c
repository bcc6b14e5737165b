// SPDX-License-Identifier: MIT
// The public calls of the renderer. Arguments are checked here, and nowhere below.

#include "render/render.h"

#include "fathom/io.h"
#include "gpu/gpu.h"
#include "world/brush.h"

#include <math.h>
#include <string.h>

_Static_assert(FM_GPU_MARCH_SKIP == FM_MARCH_SKIP && FM_GPU_MARCH_BOX == FM_MARCH_BOX && FM_GPU_MARCH_PLAIN == FM_MARCH_PLAIN,
               "marches are numbered alike");
_Static_assert(FM_GPU_VIEW_COLOR == FM_VIEW_COLOR && FM_GPU_VIEW_STEPS == FM_VIEW_STEPS && FM_GPU_VIEW_NORMAL == FM_VIEW_NORMAL &&
                   FM_GPU_VIEW_DISTANCE == FM_VIEW_DISTANCE && FM_GPU_VIEW_SLICE == FM_VIEW_SLICE &&
                   FM_GPU_VIEW_DIFFERENCE == FM_VIEW_DIFFERENCE,
               "views are numbered alike");
_Static_assert(FM_GPU_SHADOW_NONE == FM_SHADOW_NONE && FM_GPU_SHADOW_HARD == FM_SHADOW_HARD && FM_GPU_SHADOW_SOFT == FM_SHADOW_SOFT,
               "shadows are numbered alike");
_Static_assert(FM_EXTRA_MAP == FM_EXTRA_BRUSH + sizeof(fm_gpu_brush) && FM_EXTRA_BYTES == FM_EXTRA_MAP + 4 * 256,
               "render_shared.h says where the parts lie");

static fm_result check_view(const fm_render_desc *desc, fm_shape shape) {
    if ((unsigned)desc->march > FM_MARCH_PLAIN) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "march is %d: not an fm_march", (int)desc->march);
    }
    if ((unsigned)desc->view > FM_VIEW_DIFFERENCE) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "view is %d: not an fm_view", (int)desc->view);
    }
    if ((unsigned)desc->shadow > FM_SHADOW_SOFT) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "shadow is %d: not an fm_shadow", (int)desc->shadow);
    }
    if (!fm_all_finite(desc->sun)) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "sun is %g, %g, %g: finite numbers are wanted", (double)desc->sun[0],
                       (double)desc->sun[1], (double)desc->sun[2]);
    }
    if (desc->view != FM_VIEW_SLICE) {
        return FM_OK;
    }
    if (desc->slice_axis > 2) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "slice_axis is %u: 0, 1 and 2 are accepted", desc->slice_axis);
    }
    const uint32_t axes[3] = {shape.x, shape.y, shape.z};
    if (desc->slice_index < 0 || (uint32_t)desc->slice_index >= axes[desc->slice_axis]) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "slice_index is %d: the world has slices 0 to %u there", desc->slice_index,
                       axes[desc->slice_axis] - 1);
    }
    return FM_OK;
}

static fm_result make_picture(const fm_renderer *renderer, const fm_world *world, const fm_render_desc *desc, fm_picture *picture) {
    if (!renderer || !world || !desc) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "%s is NULL", !renderer ? "renderer" : world ? "desc" : "world");
    }
    if (world->context != renderer->context) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "world belongs to another context than the renderer");
    }
    if (desc->width - 1 >= FM_MAX_PIXELS || desc->height - 1 >= FM_MAX_PIXELS) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "the picture is %u x %u: 1 to %d pixels a side are accepted", desc->width,
                       desc->height, FM_MAX_PIXELS);
    }
    FM_TRY(fm_camera_check(&desc->camera));
    FM_TRY(check_view(desc, world->desc.shape));
    *picture = (fm_picture){.desc = *desc};
    if (desc->preview) {
        fm_result result = fm_brush_prepare(desc->preview, world->desc.shape, &picture->brush, &picture->preview);
        if (result != FM_OK) {
            return fm_fail_prefix(result, "preview");
        }
    }
    const fm_shape shape = world->desc.shape;
    fm_march_push *push = &picture->push;
    fm_camera_rays(desc, push);
    fm_sun_way(desc->sun, push->sun);
    push->size_xy = shape.x | shape.y << 16;
    push->size_z = shape.z;
    push->pixels = desc->width | desc->height << 16;
    // Beams are those of FM_MARCH_SKIP, and end at the same voxels as it where the field is never too far. The difference is that
    // of the march alone.
    picture->beams =
        desc->march == FM_MARCH_SKIP && desc->view != FM_VIEW_DIFFERENCE && !fm_world_method_overestimates(&world->desc.method);
    push->slice = desc->view == FM_VIEW_SLICE ? desc->slice_axis | (uint32_t)desc->slice_index << 2 : 0;
    return FM_OK;
}

fm_result fm_renderer_create(fm_context *context, fm_renderer **result) {
    if (!context || !result) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "%s is NULL", context ? "renderer" : "context");
    }
    fm_renderer *renderer = fm_alloc_zero(&context->allocator, sizeof *renderer, "a renderer");
    if (!renderer) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    renderer->context = context;
    for (uint32_t i = 0; i < 256; i++) {
        uint8_t rgb[3];
        fm_color_map_rgb(FM_COLOR_SEQUENTIAL, i / 255.0, rgb);
        renderer->map[i] = (uint32_t)rgb[0] | (uint32_t)rgb[1] << 8 | (uint32_t)rgb[2] << 16 | 0xff000000u;
    }
    fm_result status = context->gpu ? fm_gpu_render_create(renderer) : FM_OK;
    if (status != FM_OK) {
        fm_renderer_destroy(renderer);
        return status;
    }
    *result = renderer;
    return FM_OK;
}

void fm_renderer_destroy(fm_renderer *renderer) {
    if (!renderer) {
        return;
    }
    fm_context *context = renderer->context;
    fm_gpu_render_destroy(renderer);
    fm_free(&context->allocator, renderer->pixels, renderer->pixel_bytes);
    fm_meter_remove(&context->host[FM_PURPOSE_PICTURES], renderer->pixel_bytes);
    fm_free(&context->allocator, renderer, sizeof *renderer);
}

fm_result fm_render(fm_renderer *renderer, fm_world *world, const fm_render_desc *desc, fm_ticket *ticket) {
    fm_picture picture;
    FM_TRY(make_picture(renderer, world, desc, &picture));
    fm_ticket newest = 0;
    if (renderer->gpu) {
        FM_TRY(fm_gpu_render_picture(renderer, world, &picture, &newest));
    } else {
        FM_TRY(fm_host_render(renderer, world, &picture));
    }
    renderer->width = desc->width;
    renderer->height = desc->height;
    renderer->counted = renderer->counted || desc->count;
    if (ticket) {
        *ticket = newest;
        return FM_OK;
    }
    return renderer->gpu ? fm_gpu_wait(renderer->context->gpu, newest) : FM_OK;
}

static fm_result check_rendered(const fm_renderer *renderer, const void *result, const char *name) {
    if (!renderer || !result) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "%s is NULL", renderer ? name : "renderer");
    }
    if (renderer->width == 0) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "renderer has no picture yet: call fm_render first");
    }
    return FM_OK;
}

fm_result fm_renderer_read(fm_renderer *renderer, uint8_t *pixels) {
    FM_TRY(check_rendered(renderer, pixels, "pixels"));
    if (renderer->gpu) {
        return fm_gpu_render_read(renderer, pixels);
    }
    for (uint64_t i = 0; i < (uint64_t)renderer->width * renderer->height; i++) {
        for (int k = 0; k < 4; k++) {
            pixels[4 * i + (uint64_t)k] = (uint8_t)(renderer->pixels[i] >> (8 * k));
        }
    }
    return FM_OK;
}

fm_result fm_renderer_vulkan(const fm_renderer *renderer, fm_volume_buffer *buffer) {
    FM_TRY(check_rendered(renderer, buffer, "buffer"));
    if (!renderer->gpu) {
        return fm_fail(FM_ERROR_UNSUPPORTED, "the picture lies in host memory: use fm_renderer_read");
    }
    fm_gpu_render_describe(renderer, buffer);
    return FM_OK;
}

fm_result fm_renderer_stats(fm_renderer *renderer, fm_render_stats *stats) {
    FM_TRY(check_rendered(renderer, stats, "stats"));
    if (!renderer->counted) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "renderer has counted no picture: set `count` of fm_render_desc");
    }
    if (renderer->gpu) {
        FM_TRY(fm_gpu_render_stats(renderer));
    }
    *stats = renderer->stats;
    return FM_OK;
}

fm_result fm_render_pick_begin(fm_renderer *renderer, fm_world *world, const fm_render_desc *desc, float x, float y,
                               fm_ticket *ticket) {
    fm_picture picture;
    FM_TRY(make_picture(renderer, world, desc, &picture));
    if (!ticket) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "ticket is NULL");
    }
    if (!(fabsf(x) <= FM_MAX_PIXELS && fabsf(y) <= FM_MAX_PIXELS)) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "pixel_x, pixel_y are %g, %g: -%d to %d is accepted", (double)x, (double)y,
                       FM_MAX_PIXELS, FM_MAX_PIXELS);
    }
    float way[3];
    fm_pixel_way(&picture.push, x, y, way);
    if (renderer->gpu) {
        return fm_gpu_pick_begin(renderer, world, &picture, way, ticket);
    }
    fm_host_pick(world, &picture, way, &renderer->pick);
    renderer->picked = true;
    *ticket = 0;
    return FM_OK;
}

fm_result fm_render_pick_end(fm_renderer *renderer, fm_ticket ticket, fm_pick *pick) {
    if (!renderer || !pick) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "%s is NULL", renderer ? "pick" : "renderer");
    }
    if (renderer->gpu) {
        return fm_gpu_pick_end(renderer, ticket, pick);
    }
    if (!renderer->picked) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "renderer has no pick: call fm_render_pick_begin first");
    }
    *pick = renderer->pick;
    return FM_OK;
}

fm_result fm_render_pick(fm_renderer *renderer, fm_world *world, const fm_render_desc *desc, float x, float y, fm_pick *pick) {
    if (!pick) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "pick is NULL");
    }
    fm_ticket ticket;
    FM_TRY(fm_render_pick_begin(renderer, world, desc, x, y, &ticket));
    return fm_render_pick_end(renderer, ticket, pick);
}
