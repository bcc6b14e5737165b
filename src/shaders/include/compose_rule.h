// SPDX-License-Identifier: MIT
#ifndef FM_COMPOSE_RULE_H
#define FM_COMPOSE_RULE_H

// The arithmetic of fm_composed, one text for C and GLSL: where a texel of the scene's field lies in an object's local field, and
// what that says there. Floats, every operation rounded, in the order that is written here.

#include "rtsdf_rule.h"

// Work goes by blocks of texels, one a work group.
#define FM_COMPOSE_X 16
#define FM_COMPOSE_Y 4
#define FM_COMPOSE_Z 4
#define FM_COMPOSE_TEXELS 256

// An object's local field and the texels of the scene's field that it can matter to: begin ... end - 1, none where it is empty.
FM_PUSH_STRUCT(fm_compose_object) {
    fm_address field;
    fm_float to_local[12];  // rows: from a texel's numbers to the place among the local field's texels
    fm_int shape[3];        // of the local field, at least 2
    fm_int begin[3], end[3];
    fm_uint unused;
};

FM_PUSH_STRUCT(fm_compose_push) {
    fm_address objects;
    fm_address blocks;  // numbers of the blocks to be done, a word each; 0: all
    fm_address field;
    fm_int shape[3];
    fm_uint object_count;
    fm_uint block_count;
    fm_float band;
};

// A cell between eight texels and the place in it, or that the place lies beside the local field.
FM_PUSH_STRUCT(fm_compose_cell) {
    fm_int inside;
    fm_int first[3];
    fm_float weight[3];
};

// What is beside the local field is farther away than the band: nothing is lost there.
FM_RULE fm_compose_cell fm_compose_find(fm_compose_object object, int x, int y, int z) {
    fm_compose_cell cell;
    cell.inside = 1;
    for (int axis = 0; axis < 3; axis++) {
        const int row = 4 * axis;
        FM_PRECISE float along_x = object.to_local[row] * FM_F(x);
        FM_PRECISE float along_y = object.to_local[row + 1] * FM_F(y);
        FM_PRECISE float along_z = object.to_local[row + 2] * FM_F(z);
        FM_PRECISE float place = ((along_x + along_y) + along_z) + object.to_local[row + 3];
        const int last = object.shape[axis] - 1;
        cell.inside = place >= 0.0f && place <= FM_F(last) ? cell.inside : 0;
        const int whole = fm_voxel_clamp(place, 0, last);
        cell.first[axis] = whole < last ? whole : last - 1;
        FM_PRECISE float weight = place - FM_F(cell.first[axis]);
        cell.weight[axis] = weight;
    }
    return cell;
}

// Between the values of the eight texels, x fastest.
FM_RULE float fm_compose_between(const float corner[8], const float weight[3]) {
    const float a = fm_coarse_mix(corner[0], corner[1], weight[0]);
    const float b = fm_coarse_mix(corner[2], corner[3], weight[0]);
    const float c = fm_coarse_mix(corner[4], corner[5], weight[0]);
    const float d = fm_coarse_mix(corner[6], corner[7], weight[0]);
    return fm_coarse_mix(fm_coarse_mix(a, b, weight[1]), fm_coarse_mix(c, d, weight[1]), weight[2]);
}

#ifdef __STDC__
_Static_assert(sizeof(fm_compose_object) == 96, "as std430 lays it out");
_Static_assert(sizeof(fm_compose_push) <= 128, "push constants are 128 bytes on every device");
#endif

#endif
