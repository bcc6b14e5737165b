// SPDX-License-Identifier: MIT
#include "io/vox.h"

#include <string.h>

static const uint64_t max_file = (uint64_t)4 << 30;
static const uint64_t max_voxels = (uint64_t)4 << 30;
static const uint64_t default_limit = (uint64_t)16 << 30;

static bool vox_matches(const uint8_t *head, size_t size) {
    return size >= 8 && memcmp(head, "VOX ", 4) == 0;
}

void fm_vox_default_palette(uint8_t palette[FM_VOX_PALETTE_BYTES]) {
    static const uint8_t ramp[10] = {0xee, 0xdd, 0xbb, 0xaa, 0x88, 0x77, 0x55, 0x44, 0x22, 0x11};
    memset(palette, 0, FM_VOX_PALETTE_BYTES);
    for (int i = 1; i < 256; i++) {
        uint8_t *color = palette + 4 * i;
        color[3] = 255;
        if (i <= 215) {
            // A cube of six steps a channel from white down, black left out.
            color[0] = (uint8_t)(255 - 51 * ((i - 1) / 36));
            color[1] = (uint8_t)(255 - 51 * ((i - 1) / 6 % 6));
            color[2] = (uint8_t)(255 - 51 * ((i - 1) % 6));
        } else {
            int family = (i - 216) / 10;
            for (int channel = 0; channel < 3; channel++) {
                color[channel] = family == channel || family == 3 ? ramp[(i - 216) % 10] : 0;
            }
        }
    }
}

static fm_result describe(fm_reader *reader, const fm_vox_scene *scene) {
    fm_file_info *info = &reader->info;
    info->models = scene->model_count;
    info->placed = scene->place_count;
    info->hidden = scene->hidden_places;
    info->palette_count = 256;
    if (scene->place_count == 0) {
        return fm_input_fail(reader->input, FM_ERROR_FORMAT, "shows no model%s",
                             scene->hidden_places ? ": all are hidden; ask for the hidden ones too" : "");
    }
    int64_t low[3] = {INT64_MAX, INT64_MAX, INT64_MAX}, high[3] = {INT64_MIN, INT64_MIN, INT64_MIN};
    for (uint32_t p = 0; p < scene->place_count; p++) {
        const fm_vox_place *place = &scene->places[p];
        bool turned = false;
        for (int i = 0; i < 3; i++) {
            int64_t end = place->low[i] + place->size[i];
            low[i] = place->low[i] < low[i] ? place->low[i] : low[i];
            high[i] = end > high[i] ? end : high[i];
            turned = turned || place->turn.column[i] != i || place->turn.sign[i] < 0;
        }
        info->rotated += turned;
    }
    uint64_t axes[3];
    for (int i = 0; i < 3; i++) {
        axes[i] = (uint64_t)(high[i] - low[i]);
        info->origin[i] = (double)low[i];
    }
    info->type = FM_TYPE_U8;
    if (scene->hidden_places && !reader->desc->include_hidden) {
        fm_reader_note(reader, "%u hidden placements left out", scene->hidden_places);
    }
    return fm_reader_shape(reader, axes, 3, NULL);
}

static fm_result vox_open(fm_reader *reader) {
    fm_vox_scene *scene = fm_reader_state(reader, sizeof *scene);
    if (!scene) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    reader->default_limit = default_limit;
    FM_TRY(fm_input_slurp(reader->input, max_file, &scene->bytes, &scene->size));
    FM_TRY(fm_vox_parse(reader, scene));
    FM_TRY(fm_vox_walk(reader, scene));
    uint64_t voxels = 0;
    for (uint32_t p = 0; p < scene->place_count; p++) {
        voxels += scene->models[scene->places[p].model].count;
    }
    if (voxels > max_voxels) {
        return fm_input_fail(reader->input, FM_ERROR_RANGE, "places %llu voxels: at most %llu are read", (unsigned long long)voxels,
                             (unsigned long long)max_voxels);
    }
    fm_vox_default_palette(reader->palette);
    if (scene->colors) {
        memcpy(reader->palette + 4, scene->colors, FM_VOX_PALETTE_BYTES - 4);
    }
    reader->has_palette = true;
    return describe(reader, scene);
}

static fm_result vox_load(fm_reader *reader, fm_volume *volume) {
    const fm_vox_scene *scene = reader->state;
    fm_shape shape = reader->info.shape;
    uint8_t *data = volume->data;
    uint64_t total = 0, done = 0;
    for (uint32_t p = 0; p < scene->place_count; p++) {
        total += scene->models[scene->places[p].model].count;
    }
    memset(data, 0, (size_t)volume->bytes);
    if (!fm_reader_progress(reader, 0, total)) {
        return FM_ERROR_IO;
    }
    for (uint32_t p = 0; p < scene->place_count; p++) {
        const fm_vox_place *place = &scene->places[p];
        const fm_vox_model *model = &scene->models[place->model];
        for (uint32_t v = 0; v < model->count; v++) {
            const uint8_t *voxel = model->voxels + 4 * (uint64_t)v;
            int64_t at[3];
            fm_vox_position(place, model->size, voxel, at);
            uint64_t x = (uint64_t)(at[0] - (int64_t)reader->info.origin[0]);
            uint64_t y = (uint64_t)(at[1] - (int64_t)reader->info.origin[1]);
            uint64_t z = (uint64_t)(at[2] - (int64_t)reader->info.origin[2]);
            data[x + shape.x * (y + shape.y * z)] = voxel[3];
        }
        done += model->count;
        if (!fm_reader_progress(reader, done, total)) {
            return FM_ERROR_IO;
        }
    }
    return FM_OK;
}

static void vox_close(fm_reader *reader) {
    fm_vox_free(reader->allocator, reader->state);
}

static const char *const extensions[] = {".vox", NULL};

const fm_codec fm_codec_vox = {
    .format = FM_FORMAT_VOX,
    .name = "MagicaVoxel",
    .extensions = extensions,
    .matches = vox_matches,
    .open = vox_open,
    .load = vox_load,
    .close = vox_close,
    .write = fm_vox_write,
};
