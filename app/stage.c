// SPDX-License-Identifier: MIT
#include "stage.h"

#include "fathom/io.h"
#include "noise.h"
#include "scenes.h"
#include "world.h"

#include <stdlib.h>
#include <string.h>

enum { JUDGE_WIDTH = 320 };

bool stage_open(stage *s, fm_context *context) {
    *s = (stage){.context = context};
    return fm_renderer_create(context, &s->renderer) == FM_OK && fm_renderer_create(context, &s->judge) == FM_OK;
}

void stage_close(stage *s) {
    fm_renderer_destroy(s->judge);
    fm_renderer_destroy(s->renderer);
    fm_world_destroy(s->world);
    *s = (stage){0};
}

// Puts a new world of the volume's voxels (NULL: air) in place of the old one.
static bool replace(stage *s, const paint_settings *settings, const fm_volume *volume) {
    const fm_world_desc desc = {.shape = settings->shape,
                                .format = settings->format,
                                .max_distance = settings->format == FM_FIELD_SQUARED_U32 ? settings->max_distance : 0,
                                .method = bench_world_method(&settings->method)};
    fm_world *world = NULL;
    if (fm_world_create(s->context, &desc, &world) != FM_OK) {
        return false;
    }
    fm_ticket ticket = 0;
    if ((volume && fm_world_load(world, volume) != FM_OK) || fm_world_update(world, &ticket) != FM_OK) {
        fm_world_destroy(world);
        return false;
    }
    fm_world_destroy(s->world);
    s->world = world;
    s->shape = settings->shape;
    s->newest = ticket;
    s->judging = false;
    return true;
}

bool stage_build(stage *s, const paint_settings *settings) {
    const fm_scene *scene = fm_scene_at(settings->scene);
    if (!scene) {
        return replace(s, settings, NULL);
    }
    const fm_scene_desc desc = {.shape = settings->shape, .seed = settings->scene_seed};
    fm_volume *volume = bench_world_scene(scene, &desc);
    const bool good = volume && replace(s, settings, volume);
    fm_volume_destroy(volume);
    return good;
}

bool stage_load(stage *s, paint_settings *settings, const char *path) {
    fm_volume *volume = NULL;
    fm_file_info info;
    if (fm_file_read(NULL, path, NULL, &volume, &info) != FM_OK) {
        return false;
    }
    paint_settings next = *settings;
    next.shape = info.shape;
    const bool good = replace(s, &next, volume);
    if (good) {
        paint_choose_file(settings, path, info.shape);
    }
    fm_volume_destroy(volume);
    return good;
}

static fm_volume *voxels_of(const stage *s, fm_type type) {
    fm_volume *volume = NULL;
    const fm_volume_desc desc = {.shape = s->shape, .type = type};
    if (fm_volume_create(NULL, &desc, &volume) == FM_OK && fm_world_save(s->world, volume) != FM_OK) {
        fm_volume_destroy(volume);
        volume = NULL;
    }
    return volume;
}

bool stage_reformat(stage *s, const paint_settings *settings) {
    fm_volume *volume = voxels_of(s, FM_TYPE_U32);
    const bool good = volume && replace(s, settings, volume);
    fm_volume_destroy(volume);
    return good;
}

bool stage_set_method(stage *s, const paint_settings *settings) {
    const fm_world_method method = bench_world_method(&settings->method);
    s->judging = false;
    return fm_world_set_method(s->world, &method) == FM_OK;
}

bool stage_save(const stage *s, const char *path) {
    const size_t length = strlen(path);
    const bool vox = length > 4 && strcmp(path + length - 4, ".vox") == 0;
    fm_volume *volume = voxels_of(s, vox ? FM_TYPE_U8 : FM_TYPE_U32);
    const bool good = volume && fm_file_write(path, volume, NULL) == FM_OK;
    fm_volume_destroy(volume);
    return good;
}

bool stage_count(const stage *s, uint64_t *solid, uint64_t *hash) {
    fm_volume *volume = voxels_of(s, FM_TYPE_U32);
    *solid = *hash = 0;
    if (!volume) {
        return false;
    }
    const uint32_t *voxels = fm_volume_data(volume);
    const uint64_t count = (uint64_t)s->shape.x * s->shape.y * s->shape.z;
    for (uint64_t i = 0; i < count; i++) {
        *solid += voxels[i] != 0;
        *hash = fm_mix(*hash + voxels[i]);
    }
    fm_volume_destroy(volume);
    return true;
}

void stage_focus(stage *s, const paint_settings *settings, const fm_camera *camera) {
    if (!settings->focus_stays) {
        const int32_t at[3] = {(int32_t)camera->position[0], (int32_t)camera->position[1], (int32_t)camera->position[2]};
        fm_world_set_focus(s->world, at);
    }
}

bool stage_update(stage *s, bool edited, fm_ticket *ticket, bool *works) {
    if (fm_world_update(s->world, ticket) != FM_OK) {
        return false;
    }
    // The CPU's tickets are all alike.
    *works = *ticket != s->newest || (edited && fm_context_backend(s->context) == FM_BACKEND_CPU);
    s->newest = *ticket;
    return true;
}

bool stage_judge(stage *s, const paint_settings *settings, const fm_camera *camera, double aspect) {
    const fm_render_desc desc = {.camera = *camera,
                                 .march = settings->march,
                                 .view = FM_VIEW_DIFFERENCE,
                                 .width = JUDGE_WIDTH,
                                 .height = (uint32_t)(JUDGE_WIDTH / aspect) + 1,
                                 .count = true};
    s->judging = fm_render(s->judge, s->world, &desc, &s->judged) == FM_OK;
    return s->judging;
}

bool stage_wrong_share(stage *s, double *share) {
    bool complete = false;
    fm_render_stats stats;
    if (!s->judging || fm_poll(s->context, s->judged, &complete) != FM_OK || !complete) {
        return false;
    }
    s->judging = false;
    if (fm_renderer_stats(s->judge, &stats) != FM_OK || stats.rays == 0) {
        return false;
    }
    *share = (double)stats.wrong / (double)stats.rays;
    return true;
}
