// SPDX-License-Identifier: MIT
// Thin octrees of vectors: whether a coarser leaf gives rays the surface that is there. Ours. The places nearest to the finest
// grid's corners are places of the surface, so that what a leaf says of the surface is held against them, wherever in it they are;
// and what it says of the corners themselves keeps it from having a surface where there is none.

#include "octree/build.h"
#include "shaders/include/octree_closest_rule.h"

#include <math.h>

// What rays will find at a place p of a node, in finest cells from its lower corner: the blend of value + rate p.
typedef struct node_sheet {
    float edge;
    float value[8], rate[3][8];
} node_sheet;

// No place is farther than this from the finest grid's corners around it.
static const float NEAR = 1, SHARE = 0.3f;

// Of vectors as they will be kept.
static bool sheet_of(const fm_octree_build *build, int level, uint32_t x, uint32_t y, uint32_t z, node_sheet *sheet) {
    const fm_octree_field *field = &build->chunk.fields[level];
    const int code = (int)build->desc->code;
    const float scale = 1 / sheet->edge;
    const bool coded = code != FM_GPU_FLOATS;
    fm_vcp_arm arms[8];
    float most = -1;
    int longest = 0;
    for (int i = 0; i < 8; i++) {
        const float *v = field->vectors[fm_node_at(field->shape, x + (i & 1), y + (i >> 1 & 1), z + (i >> 2))];
        const fm_v3 own = {v[0] * scale, v[1] * scale, v[2] * scale};
        const fm_v3 kept = coded ? fm_vcp_decode(fm_vcp_encode(own, code, FM_OCTREE_REACH), code, FM_OCTREE_REACH) : own;
        const float length2 = fm_dot(kept, kept);
        longest = length2 > most ? i : longest;
        most = fmaxf(most, length2);
        arms[i] = fm_vcp_arm_of(kept);
    }
    fm_vcp_plane plane = fm_vcp_plane_of(arms[longest], longest);
    const fm_v3 zero = {0, 0, 0}, axes[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    for (int i = 0; i < 8; i++) {
        plane = fm_vcp_plane_with(plane, arms[i], i);
        for (int axis = 0; axis < 3; axis++) {
            const fm_vcp_pull pull = fm_vcp_pull_of(plane, arms[i], i, zero, axes[axis]);
            sheet->value[i] = pull.value * sheet->edge;
            sheet->rate[axis][i] = pull.rate;
        }
    }
    return fm_vcp_sheets(plane, longest) >= 0;
}

// How far the surface is ahead along the normal, by the leaf.
static float ahead(const node_sheet *sheet, const float at[3], float normal[3]) {
    float sum = 0;
    normal[0] = normal[1] = normal[2] = 0;
    for (uint32_t i = 0; i < 8; i++) {
        float weight = 1, value = sheet->value[i];
        for (uint32_t axis = 0; axis < 3; axis++) {
            const float part = at[axis] / sheet->edge;
            weight *= i >> axis & 1 ? part : 1 - part;
            value += sheet->rate[axis][i] * at[axis];
        }
        sum += weight * value;
        for (int axis = 0; axis < 3; axis++) {
            normal[axis] -= weight * sheet->rate[axis][i];
        }
    }
    return sum;
}

static bool place_stays(const node_sheet *sheet, const float at[3], const float v[3], float threshold) {
    float foot[3], normal[3];
    for (int axis = 0; axis < 3; axis++) {
        foot[axis] = at[axis] + v[axis];
        if (!(foot[axis] >= 0 && foot[axis] <= sheet->edge)) {
            return true;
        }
    }
    return fabsf(ahead(sheet, foot, normal)) <= threshold;
}

// `distance`: what is true of the corner; +infinity where it is not known, so far is it.
static bool corner_stays(const node_sheet *sheet, const float at[3], const float v[3], float distance, float threshold) {
    float normal[3];
    const float said = ahead(sheet, at, normal);
    if (fminf(fabsf(said), distance) > NEAR) {
        return true;
    }
    const float side = normal[0] * v[0] + normal[1] * v[1] + normal[2] * v[2];
    return fabsf(said - (side < 0 ? -distance : distance)) <= threshold + SHARE * distance;
}

fm_sheet_answer fm_octree_sheet(const fm_octree_build *build, int level, uint32_t x, uint32_t y, uint32_t z) {
    const fm_octree_field *field = &build->chunk.fields[0];
    const float threshold = build->desc->threshold;
    const uint32_t edge = 1u << level;
    node_sheet sheet = {.edge = (float)edge};
    if (!sheet_of(build, level, x, y, z, &sheet)) {
        return FM_SHEET_NONE;
    }
    for (uint32_t k = 0; k <= edge; k++) {
        for (uint32_t j = 0; j <= edge; j++) {
            const uint64_t row = fm_node_at(field->shape, x << level, (y << level) + j, (z << level) + k);
            for (uint32_t i = 0; i <= edge; i++) {
                const float at[3] = {(float)i, (float)j, (float)k}, *v = field->vectors[row + i];
                const bool known = field->triangles[row + i] != FM_NO_TRIANGLE;
                const float none[3] = {0}, distance = known ? fabsf(field->distance[row + i]) : INFINITY;
                if (!corner_stays(&sheet, at, known ? v : none, distance, threshold) ||
                    (known && !place_stays(&sheet, at, v, threshold))) {
                    return FM_SHEET_OFF;
                }
            }
        }
    }
    return FM_SHEET_STAYS;
}
