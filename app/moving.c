// SPDX-License-Identifier: MIT
#include "moving.h"

#include "fathom/mesh_io.h"
#include "meshes.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

const fm_shape moving_shape = {64, 64, 36};

static const float floor_edge = 64, floor_depth = 2, gap = 0.3f;
// What stands in the middle is at most this wide, from its axis, and this high.
static const float middle_radius = 9.5f, middle_height = 20;
static const double box_low[3] = {-2, -2, -4}, box_high[3] = {66, 66, 34};
static const fm_transform3 at_rest = {{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}}};

// ---------------------------------------------------------------------------------------------------------------------------
// The scene
// ---------------------------------------------------------------------------------------------------------------------------

// Takes the mesh over.
static bool add(moving_stage *s, scene_mesh mesh, uint32_t *object) {
    const fm_mesh_desc desc = scene_mesh_describe(&mesh);
    fm_mesh *made = NULL;
    const bool good = fm_mesh_create(s->context, &desc, &made) == FM_OK && fm_scene_add(s->scene, made, &at_rest, object) == FM_OK;
    s->triangles += mesh.triangle_count;
    fm_mesh_destroy(made);
    scene_mesh_free(&mesh);
    return good;
}

static bool add_box(moving_stage *s, const float low[3], const float high[3], uint32_t *object) {
    return add(s, scene_mesh_box(low, high), object);
}

static bool add_still(moving_stage *s) {
    bool good = add_box(s, (const float[3]){0, 0, -floor_depth}, (const float[3]){floor_edge, floor_edge, 0}, NULL);
    for (int i = 0; i < 4 && good; i++) {
        const float x = 8 + 14 * (float)i;
        good = add_box(s, (const float[3]){x, 58, gap}, (const float[3]){x + 3, 61, 8 + 5 * (float)i}, NULL);
    }
    for (int i = 0; i < 5 && good; i++) {
        const float x = 2 + 2 * (float)i;
        good = add_box(s, (const float[3]){x, 2, 5}, (const float[3]){x + 0.8f, 11, 5.8f}, NULL);
    }
    return good;
}

// Stands upright, so that turning it shows.
static bool add_torus(moving_stage *s) {
    scene_mesh torus = scene_mesh_torus(96, 48, (const float[3]){0, 0, 0}, 7, 2);
    for (uint64_t i = 0; i < torus.vertex_count; i++) {
        float *v = torus.vertices[i];
        const float y = v[1];
        v[1] = -v[2];
        v[2] = y + 9 + gap;
    }
    return add(s, torus, &s->objects[0]);
}

// The place of a vertex, or its box's, along axis k.
static float turned(const float at[3], int k, bool y_up) {
    return !y_up || k == 0 ? at[k] : k == 1 ? -at[2] : at[1];
}

// Vertices such that what takes part of the mesh stands over the origin. Those of dropped triangles must not become of use.
static void fit(const fm_mesh_info *info, bool y_up, const float (*from)[3], float (*to)[3], uint64_t count) {
    float low[3], edge[3];
    for (int k = 0; k < 3; k++) {
        const float ends[2] = {turned(info->low, k, y_up), turned(info->high, k, y_up)};
        low[k] = fminf(ends[0], ends[1]);
        edge[k] = fabsf(ends[1] - ends[0]);
    }
    const float radius = 0.5f * hypotf(edge[0], edge[1]);
    const float scale = fminf(radius > 0 ? middle_radius / radius : INFINITY, edge[2] > 0 ? middle_height / edge[2] : INFINITY);
    const float by = isfinite(scale) ? scale : 1;
    for (uint64_t i = 0; i < count; i++) {
        for (int k = 0; k < 3; k++) {
            const float base = k < 2 ? low[k] + 0.5f * edge[k] : low[k], at = turned(from[i], k, y_up);
            to[i][k] = fabsf(at) <= 1e18f ? (at - base) * by + (k < 2 ? 0 : gap) : NAN;
        }
    }
}

static bool add_fitted(moving_stage *s, fm_mesh *read, bool y_up) {
    fm_mesh_info info;
    fm_mesh_desc desc;
    const float(*vertices)[3];
    if (fm_mesh_describe(read, &info) != FM_OK) {
        return false;
    }
    fm_mesh_arrays(read, &vertices, &desc.vertex_count, &desc.triangles, &desc.triangle_count);
    float(*fitted)[3] = malloc((size_t)(desc.vertex_count ? desc.vertex_count : 1) * sizeof *fitted);
    fm_mesh *made = NULL;
    if (fitted) {
        fit(&info, y_up, vertices, fitted, desc.vertex_count);
    }
    desc.vertices = (const float(*)[3])fitted;
    const bool good =
        fm_mesh_create(s->context, &desc, &made) == FM_OK && fm_scene_add(s->scene, made, &at_rest, &s->objects[0]) == FM_OK;
    s->triangles += desc.triangle_count;
    fm_mesh_destroy(made);
    free(fitted);
    return good;
}

static bool add_file(moving_stage *s, const char *path, bool y_up) {
    fm_mesh *read = NULL;
    const bool good = fm_mesh_read(s->context, path, NULL, &read, NULL) == FM_OK && add_fitted(s, read, y_up);
    fm_mesh_destroy(read);
    return good;
}

bool moving_open(moving_stage *s, fm_context *context, const char *file, bool y_up) {
    *s = (moving_stage){.context = context, .seconds = NAN};
    return fm_scene_create(context, &s->scene) == FM_OK && fm_deferred_create(context, &s->deferred) == FM_OK && add_still(s) &&
           (file ? add_file(s, file, y_up) : add_torus(s)) &&
           add(s, scene_mesh_sphere(49, 96, (const float[3]){0, 0, 0}, 5), &s->objects[1]) &&
           add_box(s, (const float[3]){-1.5f, -4, -1.5f}, (const float[3]){1.5f, 4, 1.5f}, &s->objects[2]);
}

void moving_close(moving_stage *s) {
    fm_deferred_destroy(s->deferred);
    fm_rtsdf_destroy(s->rtsdf);
    fm_volume_destroy(s->field);
    fm_scene_destroy(s->scene);
    *s = (moving_stage){0};
}

// None comes as near to another, or to what stands still, as to touch it.
fm_transform3 moving_place(uint32_t object, double seconds) {
    const double turn = 6.283185307179586 * seconds;
    const float a = (float)fmod(turn / (object == 0 ? 16 : object == 1 ? 8 : 5), 6.283185307179586);
    const float c = cosf(a), n = sinf(a);
    const fm_transform3 places[MOVING_OBJECTS] = {
        {{{c, -n, 0, 32}, {n, c, 0, 32}, {0, 0, 1, 0}}},
        {{{1, 0, 0, 32 + 18 * c}, {0, 1, 0, 32 + 18 * n}, {0, 0, 1, 10 + 4 * sinf(2 * a)}}},
        {{{1, 0, 0, 52}, {0, c, -n, 12}, {0, n, c, 9 + 3 * n}}},
    };
    return places[object];
}

// ---------------------------------------------------------------------------------------------------------------------------
// The field
// ---------------------------------------------------------------------------------------------------------------------------

static bool is_same_field(const paint_mesh_settings *a, const paint_mesh_settings *b) {
    const bool exact = a->field == PAINT_FIELD_EXACT;
    return a->edge == b->edge && exact == (b->field == PAINT_FIELD_EXACT) &&
           (exact || (a->rays == b->rays && a->flood == b->flood));
}

// The exact field has the texels of RTSDF's fine one: twice as many along each axis as the coarse one.
static bool make_field(moving_stage *s, const paint_mesh_settings *m) {
    const double spacing = (box_high[0] - box_low[0]) / m->edge;
    uint32_t coarse[3];
    fm_volume_desc grid = {.type = FM_TYPE_F32};
    fm_rtsdf_desc rtsdf = {.rays = m->rays, .flood = m->flood};
    for (int i = 0; i < 3; i++) {
        coarse[i] = (uint32_t)ceil((box_high[i] - box_low[i]) / (2 * spacing) - 1e-6);
        grid.spacing[i] = spacing;
        grid.origin[i] = box_low[i] + 0.5 * spacing;
        rtsdf.low[i] = box_low[i];
        rtsdf.high[i] = box_low[i] + 2 * spacing * coarse[i];
    }
    rtsdf.coarse = (fm_shape){coarse[0], coarse[1], coarse[2]};
    grid.shape = (fm_shape){2 * coarse[0], 2 * coarse[1], 2 * coarse[2]};
    return m->field == PAINT_FIELD_EXACT ? fm_volume_create(s->context, &grid, &s->field) == FM_OK
                                         : fm_rtsdf_create(s->context, &rtsdf, &s->rtsdf) == FM_OK;
}

static bool follow_field(moving_stage *s, const paint_mesh_settings *m) {
    if ((s->field || s->rtsdf) && is_same_field(&s->has, m)) {
        s->fresh = s->fresh && s->has.band == m->band && s->has.sign == m->sign;
        s->has = *m;
        return true;
    }
    // Pictures in flight read the old one.
    if (fm_wait(s->context, s->picture_ticket) != FM_OK || fm_wait(s->context, s->field_ticket) != FM_OK) {
        return false;
    }
    fm_rtsdf_destroy(s->rtsdf);
    fm_volume_destroy(s->field);
    s->rtsdf = NULL;
    s->field = NULL;
    s->fresh = false;
    s->has = *m;
    return make_field(s, m);
}

static bool compute_field(moving_stage *s, const paint_mesh_settings *m) {
    fm_mesh *mesh = fm_scene_mesh(s->scene);
    if (m->field != PAINT_FIELD_EXACT) {
        return fm_rtsdf_update(s->rtsdf, mesh, &s->field_ticket) == FM_OK;
    }
    const fm_sdf_desc desc = {.band = (float)m->band, .far_texels = m->band ? FM_FAR_FLOODED : FM_FAR_EXACT, .sign = m->sign};
    s->fresh = fm_mesh_sdf(mesh, &desc, s->field, NULL, &s->sign, &s->field_ticket) == FM_OK;
    return s->fresh;
}

static bool place_all(moving_stage *s, double seconds) {
    if (s->seconds == seconds) {
        return true;
    }
    for (uint32_t i = 0; i < MOVING_OBJECTS; i++) {
        const fm_transform3 place = moving_place(i, seconds);
        if (fm_scene_move(s->scene, s->objects[i], &place) != FM_OK) {
            return false;
        }
    }
    fm_ticket unused;
    if (fm_scene_update(s->scene, FM_TREE_REFIT, &unused) != FM_OK) {
        return false;
    }
    s->seconds = seconds;
    s->fresh = false;
    return true;
}

bool moving_update(moving_stage *s, const paint_mesh_settings *settings, double seconds, bool *works) {
    *works = false;
    if (!place_all(s, seconds)) {
        return false;
    }
    if (!paint_wants_field(settings)) {
        return true;
    }
    if (!follow_field(s, settings)) {
        return false;
    }
    // RTSDF gathers more rays with every frame.
    *works = settings->field != PAINT_FIELD_EXACT || !s->fresh;
    return !*works || compute_field(s, settings);
}

static const fm_volume *field_of(const moving_stage *s, const paint_mesh_settings *m) {
    fm_volume *coarse = NULL, *fine = NULL;
    if (s->rtsdf) {
        fm_rtsdf_fields(s->rtsdf, &coarse, &fine);
    }
    return m->field == PAINT_FIELD_EXACT ? s->field : m->field == PAINT_FIELD_COARSE ? coarse : fine;
}

bool moving_draw(moving_stage *s, const paint_mesh_settings *m, const fm_camera *camera, uint32_t width, uint32_t height) {
    const fm_deferred_desc desc = {.camera = *camera,
                                   .width = width,
                                   .height = height,
                                   .surface = m->surface,
                                   .view = m->view,
                                   .mesh = fm_scene_mesh(s->scene),
                                   .field = paint_wants_field(m) ? field_of(s, m) : NULL,
                                   .shadows = m->shadows,
                                   .samples = m->samples,
                                   .jitter = m->blend,
                                   .taa = m->blend,
                                   // Where nothing is blended and nothing moves, the picture rests too.
                                   .frame = m->blend ? s->pictures : 0,
                                   .map_edge = m->map,
                                   .light_count = 1,
                                   .lights = {{.way = {0.55f, -0.35f, 0.9f}, .size = m->light}}};
    const bool good = fm_deferred_render(s->deferred, &desc, &s->picture_ticket) == FM_OK;
    s->pictures += good;
    return good;
}
