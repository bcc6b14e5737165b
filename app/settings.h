// SPDX-License-Identifier: MIT
#ifndef FM_APP_SETTINGS_H
#define FM_APP_SETTINGS_H

// What the panel, the keys and the options of the command line choose.

#include "fathom/deferred.h"
#include "fathom/sdf.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { PAINT_COLORS = 9, PAINT_MOST_RADIUS = 64, PAINT_PATH = 512, PAINT_MOST_LIGHT = 20 };

// RGB332, by number key.
extern const uint8_t paint_colors[PAINT_COLORS];
extern const char *const paint_color_words[];  // "white", "red", ...

// Where the field of moving meshes comes from.
typedef enum paint_mesh_field {
    PAINT_FIELD_EXACT = 0,  // fm_mesh_sdf
    PAINT_FIELD_RTSDF,      // the fine field of fm_rtsdf
    PAINT_FIELD_COARSE,     // its coarse one, without signs
} paint_mesh_field;

// "exact", ...; "none", "ray", ...; "mesh", ...; "color", ...; "jfa", ...; "auto", ...
extern const char *const paint_mesh_field_words[],
    *const paint_mesh_shadow_words[], *const paint_mesh_surface_words[], *const paint_mesh_view_words[],
                                                                             *const paint_flood_words[], *const paint_sign_words[];

typedef struct paint_mesh_settings {
    bool hold;  // objects stay where they are
    paint_mesh_field field;
    uint32_t edge;   // texels along the field's longest edge; 0: see options_suit
    uint32_t band;   // EXACT: texels on either side of the surface; 0: all
    fm_sign sign;    // EXACT
    uint32_t rays;   // RTSDF: a texel and frame
    fm_flood flood;  // RTSDF
    fm_surface surface;
    fm_deferred_view view;
    fm_shadows shadows;
    uint32_t samples;  // of CONE and RAYS shadows
    uint32_t map;      // texels along an edge of a shadow map; see options_suit
    float light;       // half the angle of the sun's disc in degrees
    bool blend;        // with the pictures before
} paint_mesh_settings;

typedef struct paint_settings {
    bool meshes;  // and not voxels; what follows but for `scale`, `vsync` and `speed` is of voxels
    paint_mesh_settings mesh;
    uint32_t scene;           // number of fm_scene_at; the one past the last is air
    char loaded[PAINT_PATH];  // the file whose voxels stand in its place; empty: none
    fm_shape shape;
    fm_shape scene_shape;  // what scenes are to have again after a file
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

// Whether a field has to be made for the picture.
bool paint_wants_field(const paint_mesh_settings *settings);
// What field and shadows are, in words, and whether nothing about them is approximate.
const char *paint_field_truth(const paint_mesh_settings *settings, bool *exact);
const char *paint_shadow_truth(const paint_mesh_settings *settings, bool *exact);

uint32_t paint_scene_count(void);  // without air
const char *paint_scene_name(uint32_t scene);
// The scene's name, or that of the file without its directory.
const char *paint_world_name(const paint_settings *settings);
// Changes scene or shape by what was chosen; a file's voxels and shape go.
void paint_choose_scene(paint_settings *settings, uint32_t scene);
// A file's voxels and shape come.
void paint_choose_file(paint_settings *settings, const char *path, fm_shape shape);

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
