// SPDX-License-Identifier: MIT
#include "shadows_stage.h"

#include "meshes.h"

#include <math.h>

const float stage_ball_radius = 0.25f, stage_ball_height = 0.6f;

// Half the edge of the floor, and the box of the fields above and below it.
static const float half_floor = 1, floor_depth = 0.08f;
static const double box_low[3] = {-1.05, -1.05, -0.12}, box_high[3] = {1.05, 1.05, 1.1};

static const fm_transform3 at_rest = {{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}}};

// Takes the mesh over. The object stands at rest.
static bool add(stage_scene *s, scene_mesh mesh, uint32_t *object) {
    const fm_mesh_desc desc = scene_mesh_describe(&mesh);
    fm_mesh *made = NULL;
    const bool good = mesh.triangle_count > 0 && fm_mesh_create(s->context, &desc, &made) == FM_OK &&
                      fm_scene_add(s->scene, made, &at_rest, object) == FM_OK;
    fm_mesh_destroy(made);
    scene_mesh_free(&mesh);
    return good;
}

static bool add_box(stage_scene *s, float x0, float y0, float z0, float x1, float y1, float z1) {
    return add(s, scene_mesh_box((const float[3]){x0, y0, z0}, (const float[3]){x1, y1, z1}), NULL);
}

static bool add_floor(stage_scene *s) {
    return add_box(s, -half_floor, -half_floor, -floor_depth, half_floor, half_floor, 0);
}

static bool build_table(stage_scene *s, uint32_t triangles) {
    static const float middle[3] = {0, 0, 0};
    const uint32_t edge = (uint32_t)fmax(6, sqrt(triangles / 4.0));
    bool good = add_floor(s) && add(s, scene_mesh_sphere(edge + 1, edge, middle, 0.2f), &s->moving[0]) &&
                add(s, scene_mesh_torus(edge, edge, middle, 0.22f, 0.06f), &s->moving[1]);
    s->moving_count = 2;
    for (int i = 0; i < 4 && good; i++) {
        const float x = -0.75f + 0.5f * (float)i;
        good = add_box(s, x, 0.6f, 0.0f, x + 0.1f, 0.7f, 0.3f + 0.15f * (float)i);
    }
    for (int i = 0; i < 6 && good; i++) {
        const float x = -0.8f + 0.06f * (float)i;
        good = add_box(s, x, -0.85f, 0.15f, x + 0.02f, -0.5f, 0.17f);
    }
    return good && add_box(s, 0.1f, -0.72f, 0.35f, 0.8f, -0.70f, 0.37f);
}

static bool build_ball(stage_scene *s) {
    return add_floor(s) && add(s, scene_mesh_sphere(65, 128, (const float[3]){0, 0, stage_ball_height}, stage_ball_radius), NULL);
}

static bool make_fields(stage_scene *s, const bench_shadow_case *what) {
    double longest = 0;
    for (int i = 0; i < 3; i++) {
        longest = fmax(longest, box_high[i] - box_low[i]);
    }
    // Both fields have the same texels: twice as many along each axis as RTSDF's coarse one.
    const double spacing = longest / what->edge;
    uint32_t coarse[3];
    fm_volume_desc grid = {.type = FM_TYPE_F32};
    fm_rtsdf_desc rtsdf = {.rays = what->rays};
    for (int i = 0; i < 3; i++) {
        coarse[i] = (uint32_t)fmax(1, ceil((box_high[i] - box_low[i]) / (2 * spacing)));
        grid.spacing[i] = spacing;
        grid.origin[i] = box_low[i] + 0.5 * spacing;
        rtsdf.low[i] = box_low[i];
        rtsdf.high[i] = box_low[i] + 2 * spacing * coarse[i];
    }
    rtsdf.coarse = (fm_shape){coarse[0], coarse[1], coarse[2]};
    grid.shape = (fm_shape){2 * coarse[0], 2 * coarse[1], 2 * coarse[2]};
    return fm_volume_create(s->context, &grid, &s->field) == FM_OK && fm_rtsdf_create(s->context, &rtsdf, &s->rtsdf) == FM_OK;
}

bool stage_open(stage_scene *s, fm_context *context, const bench_shadow_case *what, stage_set set) {
    *s = (stage_scene){.context = context};
    return fm_scene_create(context, &s->scene) == FM_OK && (set == STAGE_BALL ? build_ball(s) : build_table(s, what->triangles)) &&
           make_fields(s, what) && fm_deferred_create(context, &s->deferred) == FM_OK && stage_move(s, 0) &&
           fm_scene_update(s->scene, FM_TREE_REBUILD, NULL) == FM_OK;
}

void stage_close(stage_scene *s) {
    fm_deferred_destroy(s->deferred);
    fm_rtsdf_destroy(s->rtsdf);
    fm_volume_destroy(s->field);
    fm_scene_destroy(s->scene);
}

bool stage_move(stage_scene *s, double time) {
    const double angle = 6.283185307179586 * time;
    const float c = (float)cos(angle), n = (float)sin(angle);
    const fm_transform3 places[STAGE_MOVING] = {{{{1, 0, 0, 0.35f * c}, {0, 1, 0, 0.1f + 0.25f * n}, {0, 0, 1, 0.45f + 0.1f * n}}},
                                                // Turned around x, so that its shadow changes.
                                                {{{1, 0, 0, -0.3f * c}, {0, c, -n, -0.1f - 0.2f * n}, {0, n, c, 0.4f}}}};
    for (uint32_t i = 0; i < s->moving_count; i++) {
        if (fm_scene_move(s->scene, s->moving[i], &places[i]) != FM_OK) {
            return false;
        }
    }
    return true;
}
