// SPDX-License-Identifier: MIT
#include "settings.h"

#include "scenes.h"
#include "world.h"

#include <stddef.h>
#include <stdio.h>
#include <string.h>

const uint8_t paint_colors[PAINT_COLORS] = {0xff, 0xe0, 0xf0, 0xfc, 0x1c, 0x1f, 0x03, 0xe3, 0x6d};

const char *const paint_color_words[] = {"white", "red", "orange", "yellow", "green", "cyan", "blue", "magenta", "grey", NULL};

uint32_t paint_scene_count(void) {
    uint32_t count = 0;
    while (fm_scene_at(count)) {
        count++;
    }
    return count;
}

const char *paint_scene_name(uint32_t scene) {
    const fm_scene *found = fm_scene_at(scene);
    return found ? fm_scene_name(found) : "air";
}

const char *paint_world_name(const paint_settings *settings) {
    const char *directory = strrchr(settings->loaded, '/');
    return !settings->loaded[0] ? paint_scene_name(settings->scene) : directory ? directory + 1 : settings->loaded;
}

void paint_choose_scene(paint_settings *settings, uint32_t scene) {
    settings->scene = scene;
    if (settings->loaded[0]) {
        settings->shape = settings->scene_shape;
        memset(settings->loaded, 0, sizeof settings->loaded);
    }
}

void paint_choose_file(paint_settings *settings, const char *path, fm_shape shape) {
    if (!settings->loaded[0]) {
        settings->scene_shape = settings->shape;
    }
    // Settings are compared as memory.
    memset(settings->loaded, 0, sizeof settings->loaded);
    snprintf(settings->loaded, sizeof settings->loaded, "%s", path);
    settings->shape = shape;
}

bool paint_may_be_wrong(const fm_world_method *chosen) {
    const fm_world_method method = bench_world_method(chosen);
    return fm_world_method_overestimates(&method);
}

uint32_t paint_slices(const paint_settings *settings, fm_shape shape) {
    return settings->slice_axis == 0 ? shape.x : settings->slice_axis == 1 ? shape.y : shape.z;
}

void paint_fit(paint_settings *settings, fm_shape shape) {
    const int32_t last = (int32_t)paint_slices(settings, shape) - 1;
    settings->slice_index = settings->slice_index < 0 ? 0 : settings->slice_index > last ? last : settings->slice_index;
}

fm_render_desc paint_picture(const paint_settings *settings) {
    return (fm_render_desc){
        .march = settings->march,
        .view = settings->view,
        .shadow = settings->shadow,
        .ambient_occlusion = settings->ambient_occlusion,
        .slice_axis = settings->slice_axis,
        .slice_index = settings->slice_index,
    };
}
