// SPDX-License-Identifier: MIT
#include "mesh_options.h"

enum { MOST_EDGE = 1024, MOST_RAYS = 64, MOST_SAMPLES = 65536, MOST_BAND = 1024 };

void mesh_options_add(cli_args *args, mesh_options *o) {
    o->meshes = cli_add(args, arg_lit0(NULL, "mesh", "moving meshes instead of voxels; IN is then a mesh, .ply, .glb, ..."));
    o->up = cli_add(args, arg_str0(NULL, "up", "y|z", "which axis of the mesh in IN points up; default z"));
    o->hold = cli_add(args, arg_lit0(NULL, "hold", "meshes stand still"));
    o->field = cli_add(args, arg_str0(NULL, "field", "exact|rtsdf|coarse", "of meshes; default exact; coarse: RTSDF without rays"));
    o->edge = cli_add(args, arg_str0(NULL, "edge", "N", "texels along that field's longest edge; default what suits the device"));
    o->band = cli_add(args, arg_str0(NULL, "band", "TEXELS", "exact: half its width, 0: everywhere; default 3"));
    o->sign = cli_add(args, arg_str0(NULL, "sign", "auto|pseudonormal|winding", "exact; default auto"));
    o->rays = cli_add(args, arg_str0(NULL, "rays", "N", "rtsdf: a texel and frame; default 5"));
    o->flood = cli_add(args, arg_str0(NULL, "flood", "jfa|jfa-1+|jfa+2", "rtsdf and coarse; default jfa"));
    o->surface = cli_add(args, arg_str0(NULL, "surface", "mesh|field", "what is seen; default mesh"));
    o->samples = cli_add(args, arg_str0(NULL, "samples", "N", "of cone and rays shadows; default 4"));
    o->light = cli_add(args, arg_str0(NULL, "sun-size", "DEGREES", "half the angle of the sun's disc, for meshes; default 3"));
    o->blend = cli_add(args, arg_lit0(NULL, "blend", "pictures of meshes with those before"));
}

static const char *given(const struct arg_str *option, const char *otherwise) {
    return option->count ? option->sval[0] : otherwise;
}

static bool read_number(const char *name, const struct arg_str *option, const char *otherwise, uint32_t least, uint32_t most,
                        uint32_t *value) {
    if (!cli_uint32(name, given(option, otherwise), least, value)) {
        return false;
    }
    if (*value > most) {
        cli_usage("%s is %u: at most %u is accepted", name, *value, most);
        return false;
    }
    return true;
}

static bool read_numbers(const mesh_options *o, paint_mesh_settings *m) {
    double light = 0;
    if (!read_number("--band", o->band, "3", 0, MOST_BAND, &m->band) ||
        !read_number("--rays", o->rays, "5", 0, MOST_RAYS, &m->rays) ||
        !read_number("--samples", o->samples, "4", 1, MOST_SAMPLES, &m->samples) ||
        (o->edge->count && !read_number("--edge", o->edge, "0", 8, MOST_EDGE, &m->edge)) ||
        !cli_double("--sun-size", given(o->light, "3"), &light)) {
        return false;
    }
    if (light < 0 || light > PAINT_MOST_LIGHT) {
        cli_usage("--sun-size is %g: 0 to %d degrees are accepted", light, PAINT_MOST_LIGHT);
        return false;
    }
    m->light = (float)light;
    return true;
}

bool mesh_options_read(const mesh_options *o, const char *shadow, const char *view, paint_mesh_settings *m) {
    int field = 0, sign = 0, flood = 0, surface = 0, shadows = 0, seen = 0;
    if (!cli_word("--field", given(o->field, "exact"), paint_mesh_field_words, &field) ||
        !cli_word("--sign", given(o->sign, "auto"), paint_sign_words, &sign) ||
        !cli_word("--flood", given(o->flood, "jfa"), paint_flood_words, &flood) ||
        !cli_word("--surface", given(o->surface, "mesh"), paint_mesh_surface_words, &surface) ||
        !cli_word("--shadow", shadow ? shadow : "cone", paint_mesh_shadow_words, &shadows) ||
        !cli_word("--view", view ? view : "color", paint_mesh_view_words, &seen) || !read_numbers(o, m)) {
        return false;
    }
    m->field = (paint_mesh_field)field;
    m->sign = (fm_sign)sign;
    m->flood = (fm_flood)flood;
    m->surface = (fm_surface)surface;
    m->shadows = (fm_shadows)shadows;
    m->view = (fm_deferred_view)seen;
    m->hold = o->hold->count > 0;
    m->blend = o->blend->count > 0;
    return true;
}
