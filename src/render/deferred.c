// SPDX-License-Identifier: MIT
#include "render/deferred.h"

#include "mesh/mesh.h"
#include "render/render.h"

#include <math.h>
#include <string.h>

_Static_assert(FM_GPU_SURFACE_MESH == FM_SURFACE_MESH && FM_GPU_SURFACE_FIELD == FM_SURFACE_FIELD &&
                   FM_GPU_SHADOWS_NONE == FM_SHADOWS_NONE && FM_GPU_SHADOWS_RAY == FM_SHADOWS_RAY &&
                   FM_GPU_SHADOWS_RTSDF == FM_SHADOWS_RTSDF && FM_GPU_SHADOWS_FIELD == FM_SHADOWS_FIELD &&
                   FM_GPU_SHADOWS_DISTRIBUTED == FM_SHADOWS_DISTRIBUTED && FM_GPU_SHADOWS_MAP == FM_SHADOWS_MAP &&
                   FM_GPU_LIGHT_DIRECTIONAL == FM_LIGHT_DIRECTIONAL && FM_GPU_LIGHT_AREA == FM_LIGHT_AREA &&
                   FM_GPU_DEFERRED_SHADED == FM_DEFERRED_SHADED && FM_GPU_DEFERRED_NORMAL == FM_DEFERRED_NORMAL &&
                   FM_GPU_DEFERRED_STEPS == FM_DEFERRED_STEPS && FM_GPU_DEFERRED_SHARE == FM_DEFERRED_SHARE &&
                   FM_LIGHTS == FM_MAX_LIGHTS,
               "kernels know these by number");

enum { MAX_SAMPLES = 65536, MAX_STEPS = 4096, MAX_MAP_EDGE = 8192, DEFAULT_MAP_EDGE = 1024 };

// Squares of lengths must stay numbers.
#define FARTHEST 1e18f

fm_result fm_deferred_create(fm_context *context, fm_deferred **deferred) {
    if (!context || !deferred) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "%s is NULL", context ? "deferred" : "context");
    }
    fm_deferred *made = fm_alloc_zero(&context->allocator, sizeof *made, "a deferred renderer");
    if (!made) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    made->context = context;
    const fm_result status = context->gpu ? fm_gpu_deferred_create(made) : FM_OK;
    if (status != FM_OK) {
        fm_deferred_destroy(made);
        return status;
    }
    *deferred = made;
    return FM_OK;
}

void fm_deferred_destroy(fm_deferred *deferred) {
    if (!deferred) {
        return;
    }
    if (deferred->context->gpu) {
        fm_gpu_deferred_destroy(deferred);
    } else {
        fm_host_deferred_destroy(deferred);
    }
    fm_free(&deferred->context->allocator, deferred, sizeof *deferred);
}

static bool wants_mesh(const fm_deferred_desc *desc) {
    return desc->surface == FM_SURFACE_MESH || desc->shadows == FM_SHADOWS_RAY || desc->shadows == FM_SHADOWS_DISTRIBUTED ||
           desc->shadows == FM_SHADOWS_MAP;
}

static bool wants_field(const fm_deferred_desc *desc) {
    return desc->surface == FM_SURFACE_FIELD || desc->shadows == FM_SHADOWS_RTSDF || desc->shadows == FM_SHADOWS_FIELD;
}

static fm_result check_light(const fm_light *light, uint32_t number, fm_shadows shadows) {
    if (light->kind != FM_LIGHT_DIRECTIONAL && light->kind != FM_LIGHT_AREA) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "lights[%u].kind is %d: FM_LIGHT_DIRECTIONAL and FM_LIGHT_AREA are accepted",
                       number, (int)light->kind);
    }
    const bool zero = light->way[0] == 0 && light->way[1] == 0 && light->way[2] == 0;
    if (!fm_all_finite(light->way) || (zero && light->kind == FM_LIGHT_DIRECTIONAL)) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "lights[%u].way is %g, %g, %g: finite numbers%s are wanted", number,
                       (double)light->way[0], (double)light->way[1], (double)light->way[2],
                       light->kind == FM_LIGHT_DIRECTIONAL ? ", not all 0," : "");
    }
    const float most = light->kind == FM_LIGHT_DIRECTIONAL ? 45 : FARTHEST;
    if (!(light->size >= 0 && light->size < most)) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "lights[%u].size is %g: 0 or above and below %g is accepted", number,
                       (double)light->size, (double)most);
    }
    if (!fm_all_finite(light->color)) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "lights[%u].color is not finite", number);
    }
    if (shadows == FM_SHADOWS_MAP && light->kind != FM_LIGHT_DIRECTIONAL) {
        return fm_fail(FM_ERROR_UNSUPPORTED, "lights[%u] is an area light: shadow maps take directional ones", number);
    }
    return FM_OK;
}

static fm_result check_numbers(const fm_deferred_desc *desc) {
    if (desc->width == 0 || desc->height == 0 || desc->width > FM_MAX_PIXELS || desc->height > FM_MAX_PIXELS) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "the picture is %u x %u: 1 to %d each is accepted", desc->width, desc->height,
                       FM_MAX_PIXELS);
    }
    if ((uint32_t)desc->surface > FM_SURFACE_FIELD || (uint32_t)desc->view > FM_DEFERRED_SHARE ||
        (uint32_t)desc->shadows > FM_SHADOWS_MAP) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "surface is %d, view %d, shadows %d: one of them is no such enumerator",
                       (int)desc->surface, (int)desc->view, (int)desc->shadows);
    }
    if (desc->light_count > FM_MAX_LIGHTS || (desc->shadows == FM_SHADOWS_MAP && desc->light_count > 1)) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "light_count is %u: at most %d, and 1 with shadow maps, is accepted",
                       desc->light_count, FM_MAX_LIGHTS);
    }
    if (desc->samples > MAX_SAMPLES || desc->max_steps > MAX_STEPS || desc->map_edge > MAX_MAP_EDGE) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "samples is %u, max_steps %u, map_edge %u: at most %d, %d and %d are accepted",
                       desc->samples, desc->max_steps, desc->map_edge, MAX_SAMPLES, MAX_STEPS, MAX_MAP_EDGE);
    }
    if (!isfinite(desc->level) || !(desc->max_step >= 0 && isfinite(desc->max_step)) ||
        !(desc->extent >= 0 && isfinite(desc->extent))) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT,
                       "level is %g, max_step %g, extent %g: finite numbers, the last two not below 0, are "
                       "accepted",
                       (double)desc->level, (double)desc->max_step, (double)desc->extent);
    }
    return FM_OK;
}

static fm_result check_field(const fm_deferred *deferred, const fm_volume *field) {
    if (field->desc.type != FM_TYPE_F32) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "the field is of %s: float32 is wanted", fm_type_name(field->desc.type));
    }
    const fm_storage wanted = deferred->context->gpu ? FM_STORAGE_DEVICE : FM_STORAGE_HOST;
    if (field->desc.storage != wanted || (field->context && field->context != deferred->context) ||
        (!field->context && wanted == FM_STORAGE_DEVICE)) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "the field is not where the context computes");
    }
    return FM_OK;
}

static fm_result check(const fm_deferred *deferred, const fm_deferred_desc *desc) {
    FM_TRY(fm_camera_check_within(&desc->camera, FARTHEST));
    FM_TRY(check_numbers(desc));
    for (uint32_t i = 0; i < desc->light_count; i++) {
        FM_TRY(check_light(&desc->lights[i], i, desc->shadows));
    }
    if (wants_mesh(desc) && !desc->mesh) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "mesh is NULL: the surface or the shadows that are asked for need one");
    }
    if (wants_field(desc) && !desc->field) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "field is NULL: the surface or the shadows that are asked for need one");
    }
    if (wants_mesh(desc) && desc->mesh->context != deferred->context) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "the mesh belongs to another context");
    }
    return wants_field(desc) ? check_field(deferred, desc->field) : FM_OK;
}

static void set_light(const fm_light *light, fm_defer_light *set) {
    *set = (fm_defer_light){.kind = (int32_t)light->kind, .size = light->size};
    memcpy(set->way, light->way, sizeof set->way);
    if (light->kind == FM_LIGHT_DIRECTIONAL) {
        fm_sun_way(light->way, set->way);
        set->size = (float)tan((double)light->size * (3.14159265358979323846 / 180));
    }
    const bool dark = light->color[0] == 0 && light->color[1] == 0 && light->color[2] == 0;
    for (int i = 0; i < 3; i++) {
        set->color[i] = dark ? 1 : light->color[i];
    }
}

static void set_field(const fm_volume *field, fm_defer_scene *scene) {
    const fm_shape shape = field->desc.shape;
    const uint32_t axes[3] = {shape.x, shape.y, shape.z};
    double least = INFINITY, diagonal = 0, longest = 0;
    for (int i = 0; i < 3; i++) {
        const double spacing = field->desc.spacing[i];
        scene->shape[i] = (int32_t)axes[i];
        scene->field_origin[i] = (float)field->desc.origin[i];
        scene->field_scale[i] = (float)(1 / spacing);
        least = fmin(least, spacing);
        diagonal += spacing * spacing;
        longest = fmax(longest, spacing * axes[i]);
    }
    scene->voxel = (float)least;
    scene->diagonal = (float)sqrt(diagonal);
    scene->max_step = scene->max_step > 0 ? scene->max_step : (float)(0.05 * longest);
    scene->field = (uint64_t)(uintptr_t)field->data;
}

// How far above the surface rays through the mesh begin. A hit of a triangle is off by what rounding makes of its place: a few
// units in the last place. A field's surface is where values between texels cross `level`: off the triangles by up to a cell, and
// below them where `level` is.
static float lift_of(const fm_deferred_desc *desc, const fm_defer_scene *scene, const float low[3], const float high[3]) {
    double size = 0;
    for (int i = 0; i < 3; i++) {
        size = fmax(size, fmax(fabs((double)high[i]), fabs((double)low[i])));
    }
    const float rounding = low[0] <= high[0] ? (float)(1e-6 * size) : 0;
    return desc->surface == FM_SURFACE_FIELD ? rounding + scene->diagonal + fmaxf(-desc->level, 0) : rounding;
}

static fm_result make_picture(const fm_deferred *deferred, const fm_deferred_desc *desc, fm_deferred_picture *picture) {
    picture->desc = *desc;
    // What is not wanted is not looked at: it may be of anywhere.
    picture->desc.mesh = wants_mesh(desc) ? desc->mesh : NULL;
    picture->desc.field = wants_field(desc) ? desc->field : NULL;
    fm_defer_scene *scene = &picture->scene;
    *scene = (fm_defer_scene){.width = (int32_t)desc->width,
                              .height = (int32_t)desc->height,
                              .level = desc->level,
                              .max_step = desc->max_step,
                              .max_steps = desc->max_steps ? desc->max_steps : 128,
                              .frame = desc->frame,
                              .jitter = desc->jitter,
                              .light_count = desc->light_count ? desc->light_count : 1,
                              .map_edge = desc->map_edge ? desc->map_edge : DEFAULT_MAP_EDGE,
                              .samples = desc->samples                             ? desc->samples
                                         : desc->shadows == FM_SHADOWS_DISTRIBUTED ? 1024
                                                                                   : 1};
    const fm_light sun = {.size = 2};
    for (uint32_t i = 0; i < scene->light_count; i++) {
        set_light(desc->light_count ? &desc->lights[i] : &sun, &scene->lights[i]);
    }
    if (wants_field(desc)) {
        set_field(desc->field, scene);
    }
    fm_deferred_camera(deferred, picture);
    if (wants_mesh(desc)) {
        float low[3], high[3];
        fm_mesh_bounds(desc->mesh, low, high);
        scene->lift = lift_of(desc, scene, low, high);
        fm_deferred_cascades(picture, low, high);
    }
    return FM_OK;
}

fm_result fm_deferred_render(fm_deferred *deferred, const fm_deferred_desc *desc, fm_ticket *ticket) {
    if (!deferred || !desc) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "%s is NULL", deferred ? "desc" : "deferred");
    }
    FM_TRY(check(deferred, desc));
    fm_deferred_picture picture;
    FM_TRY(make_picture(deferred, desc, &picture));
    fm_ticket own = 0;
    FM_TRY(deferred->gpu ? fm_gpu_deferred_picture(deferred, &picture, &own) : fm_host_deferred(deferred, &picture));
    deferred->width = desc->width;
    deferred->height = desc->height;
    deferred->newest = picture.scene;
    deferred->has_history = desc->taa;
    deferred->history ^= 1;
    if (ticket) {
        *ticket = own;
        return FM_OK;
    }
    return fm_wait(deferred->context, own);
}

static fm_result check_read(const fm_deferred *deferred, const void *target) {
    if (!deferred || !target) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "%s is NULL", deferred ? "the target" : "deferred");
    }
    return deferred->width > 0 ? FM_OK
                               : fm_fail(FM_ERROR_INVALID_ARGUMENT, "there is no picture yet: call fm_deferred_render first");
}

fm_result fm_deferred_read(fm_deferred *deferred, uint8_t *pixels) {
    FM_TRY(check_read(deferred, pixels));
    if (deferred->gpu) {
        return fm_gpu_deferred_read(deferred, pixels);
    }
    memcpy(pixels, deferred->room.picture, 4 * (uint64_t)deferred->width * deferred->height);
    return FM_OK;
}

fm_result fm_deferred_vulkan(const fm_deferred *deferred, fm_volume_buffer *buffer) {
    FM_TRY(check_read(deferred, buffer));
    if (!deferred->gpu) {
        return fm_fail(FM_ERROR_UNSUPPORTED, "the picture lies in host memory: use fm_deferred_read");
    }
    fm_gpu_deferred_describe(deferred, buffer);
    return FM_OK;
}

fm_result fm_deferred_shares(fm_deferred *deferred, float *shares) {
    FM_TRY(check_read(deferred, shares));
    const uint64_t count = (uint64_t)deferred->width * deferred->height;
    float *light = deferred->room.light;
    if (deferred->gpu) {
        light = fm_alloc(&deferred->context->allocator, 4 * count * sizeof *light, "the light of a picture");
        if (!light) {
            return FM_ERROR_OUT_OF_HOST_MEMORY;
        }
    }
    const fm_result status = deferred->gpu ? fm_gpu_deferred_lights(deferred, light) : FM_OK;
    for (uint64_t i = 0; i < count && status == FM_OK; i++) {
        shares[i] = light[4 * i + 3];
    }
    if (deferred->gpu) {
        fm_free(&deferred->context->allocator, light, 4 * count * sizeof *light);
    }
    return status;
}

fm_result fm_deferred_depths(fm_deferred *deferred, float *depths) {
    FM_TRY(check_read(deferred, depths));
    const uint64_t count = (uint64_t)deferred->width * deferred->height;
    fm_defer_surface *surfaces = deferred->room.surfaces;
    if (deferred->gpu) {
        surfaces = fm_alloc(&deferred->context->allocator, count * sizeof *surfaces, "the surfaces of a picture");
        if (!surfaces) {
            return FM_ERROR_OUT_OF_HOST_MEMORY;
        }
    }
    const fm_result status = deferred->gpu ? fm_gpu_deferred_surfaces(deferred, surfaces) : FM_OK;
    for (uint64_t i = 0; i < count && status == FM_OK; i++) {
        depths[i] = surfaces[i].depth;
    }
    if (deferred->gpu) {
        fm_free(&deferred->context->allocator, surfaces, count * sizeof *surfaces);
    }
    return status;
}
