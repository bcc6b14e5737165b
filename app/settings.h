// SPDX-License-Identifier: MIT
#ifndef FM_APP_SETTINGS_H
#define FM_APP_SETTINGS_H

// What the panel, the keys and the options of the command line choose.

#include "fathom/render.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { PAINT_COLORS = 9, PAINT_MOST_RADIUS = 64, PAINT_PATH = 512 };

// RGB332, by number key.
extern const uint8_t paint_colors[PAINT_COLORS];
extern const char *const paint_color_words[];  // "white", "red", ...

typedef struct paint_settings {
    uint32_t scene;  // number of fm_scene_at; the one past the last is air
    fm_shape shape;
    uint64_t scene_seed;
    fm_field_format format;
    uint32_t max_distance;   // FM_FIELD_SQUARED_U32; 0: none
    fm_world_method method;  // as chosen; `bench_world_method` takes out what has no effect
    bool focus_stays;        // where `method` has it; else it goes with the camera

    fm_march march;
    fm_view view;
    fm_shadow shadow;
    bool ambient_occlusion;
    uint32_t slice_axis;
    int32_t slice_index;
    uint32_t scale;  // pixels of the window along an edge of a pixel of the picture: 1, 2 or 4
    bool crosshair, preview;
    bool vsync;

    uint32_t radius;
    uint32_t color;  // below PAINT_COLORS
    float speed;     // voxels a second
    char path[PAINT_PATH];
} paint_settings;

uint32_t paint_scene_count(void);  // without air
const char *paint_scene_name(uint32_t scene);

// Whether a ray that trusts the field of this method may pass through solid voxels.
bool paint_may_be_wrong(const fm_world_method *method);

// Slices of a world across the axis chosen.
uint32_t paint_slices(const paint_settings *settings, fm_shape shape);
// Brings what depends on the world's shape into its range.
void paint_fit(paint_settings *settings, fm_shape shape);

// The picture that the settings ask for, without camera, size and brush.
fm_render_desc paint_picture(const paint_settings *settings);

#ifdef __cplusplus
}
#endif

#endif
