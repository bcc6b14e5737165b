// SPDX-License-Identifier: MIT
// What can be chosen for moving meshes, in words.
#include "settings.h"

#include <stddef.h>

const char *const paint_mesh_field_words[] = {"exact", "rtsdf", "coarse", NULL};
const char *const paint_mesh_shadow_words[] = {"none", "ray", "rtsdf", "cone", "rays", "map", NULL};
const char *const paint_mesh_surface_words[] = {"mesh", "field", NULL};
const char *const paint_mesh_view_words[] = {"color", "normal", "steps", "share", NULL};
const char *const paint_flood_words[] = {"jfa", "jfa-1+", "jfa+2", NULL};
const char *const paint_sign_words[] = {"auto", "pseudonormal", "winding", NULL};

bool paint_wants_field(const paint_mesh_settings *settings) {
    return settings->surface == FM_SURFACE_FIELD || settings->shadows == FM_SHADOWS_RTSDF || settings->shadows == FM_SHADOWS_FIELD;
}

const char *paint_field_truth(const paint_mesh_settings *settings, bool *exact) {
    *exact = true;
    if (!paint_wants_field(settings)) {
        return "no field is made: neither surface nor shadows ask for one";
    }
    if (settings->field == PAINT_FIELD_EXACT) {
        return settings->band ? "exact field within the band, flooded beyond" : "exact field everywhere";
    }
    *exact = false;
    return settings->field == PAINT_FIELD_RTSDF ? "approximate field: RTSDF is noisy, and what moves leaves a trace"
                                                : "approximate field: flooded from voxels, without signs";
}

const char *paint_shadow_truth(const paint_mesh_settings *settings, bool *exact) {
    *exact = settings->shadows == FM_SHADOWS_NONE || (settings->shadows == FM_SHADOWS_RAY && settings->light <= 0);
    switch (settings->shadows) {
    case FM_SHADOWS_NONE:
        return "no shadows";
    case FM_SHADOWS_RAY:
        return *exact ? "exact shadows of a point" : "approximate shadows: of the light's middle only";
    case FM_SHADOWS_RTSDF:
        return "approximate shadows: penumbrae only widen, as published";
    case FM_SHADOWS_FIELD:
        return "approximate shadows: cones, cut by the nearest distance along them";
    case FM_SHADOWS_DISTRIBUTED:
        return "noisy shadows: exact as samples grow";
    case FM_SHADOWS_MAP:
        return "approximate shadows: maps do not heed the light's size";
    }
    return "";
}
