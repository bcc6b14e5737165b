// SPDX-License-Identifier: MIT
#ifndef FM_VOXEL_RULE_H
#define FM_VOXEL_RULE_H

// Which voxels a triangle sets: the arithmetic of fm_mesh_voxelize on Vulkan and of RTSDF on both backends, one text for C and
// GLSL, so that RTSDF's fields start from the same voxels. fm_mesh_voxelize on the processor has a test of its own in doubles
// (host_voxelize.c), which sets fewer where a contact is closer than floats can tell. Floats, every operation rounded, in the order
// that is written here.
//
// Grid units: voxel i is the interval i ... i + 1. A triangle is moved there with an error of at most `delta` an axis, and so is
// what it is compared with larger by that much: a contact that rounding cannot tell counts as one. A triangle touches a convex
// thing unless one of a few axes separates the two (Gottschalk, Lin and Manocha 1996): the axes of the grid, the triangle's normal,
// and the products of an edge and an axis of the grid. For 26-separation that thing is the voxel, for 6-separation the three lines
// that join the centres of its opposite faces (Laine 2013, "A topological approach to voxelization": a path over faces runs along
// such lines).
//
// Inside is decided a row at a time, at the centres of its voxels. Whether the line through them crosses a triangle is summed from
// its edges, each of which contributes the same to both triangles that share it, with opposite signs: rounding cannot open a closed
// mesh.

#include "rule.h"

// Beyond this a coordinate is cut off, and of the triangle only its box is heeded.
#define FM_VOXEL_FAR 274877906944.0f         // 2^38
#define FM_VOXEL_ULP 5.9604644775390625e-8f  // 2^-24: the error of an operation, relative to its result

// The axes of a grid have at most this many voxels, so that every centre is a float.
#define FM_VOXEL_MOST 4194304

// low + rest: the grid's lower corner, in world units, as precisely as two floats tell; scale: voxels a world unit.
FM_PUSH_STRUCT(fm_voxel_grid) {
    fm_float low[3];
    fm_float rest[3];
    fm_float scale[3];
    fm_int shape[3];
};

// A triangle in grid units.
FM_PUSH_STRUCT(fm_voxel_triangle) {
    fm_float corner[9];  // of corner c along axis i: 3 c + i
    fm_float low[3], high[3];
    fm_float delta[3];
    fm_int begin[3], end[3];  // the voxels that its box touches, `end` excluded; where it lies beside the grid begin = end
    fm_float edge[9];         // of edge e (from corner e) along axis i: 3 e + i; 0 where only the box is heeded
    fm_float normal[3];
    fm_float plane;  // how far the normal's product may be off
    // Along axis a and for edge e, 3 a + e: the range of the triangle's products with the edge's normal in the plane across the
    // axis, as much larger as they may be off.
    fm_float least[9], most[9];
};

FM_RULE float fm_voxel_place(fm_voxel_grid grid, int axis, float position) {
    FM_PRECISE float away = position - grid.low[axis];
    FM_PRECISE float rest = away - grid.rest[axis];
    FM_PRECISE float place = rest * grid.scale[axis];
    return FM_LESSER(FM_GREATER(place, -FM_VOXEL_FAR), FM_VOXEL_FAR);
}

FM_RULE int fm_voxel_clamp(float x, int least, int most) {
    return FM_I(FM_LESSER(FM_GREATER(x, FM_F(least)), FM_F(most)));
}

// Corners, box and the voxels of the box: enough to tell how much work the triangle is.
FM_RULE fm_voxel_triangle fm_voxel_box(fm_voxel_grid grid, const float a[3], const float b[3], const float c[3]) {
    FM_PRECISE fm_voxel_triangle t;
    for (int i = 0; i < 3; i++) {
        t.corner[i] = fm_voxel_place(grid, i, a[i]);
        t.corner[3 + i] = fm_voxel_place(grid, i, b[i]);
        t.corner[6 + i] = fm_voxel_place(grid, i, c[i]);
        t.low[i] = FM_LESSER(FM_LESSER(t.corner[i], t.corner[3 + i]), t.corner[6 + i]);
        t.high[i] = FM_GREATER(FM_GREATER(t.corner[i], t.corner[3 + i]), t.corner[6 + i]);
        float size = FM_GREATER(FM_SIZE_OF(t.low[i]), FM_SIZE_OF(t.high[i]));
        t.delta[i] = 8.0f * FM_VOXEL_ULP * size;
        // Of a grid of n voxels -1 and n stand for all that is outside.
        t.begin[i] = fm_voxel_clamp(FM_FLOOR_OF(t.low[i] - t.delta[i]), -1, grid.shape[i]);
        t.end[i] = fm_voxel_clamp(FM_FLOOR_OF(t.high[i] + t.delta[i]), -1, grid.shape[i]) + 1;
        t.begin[i] = t.begin[i] < 0 ? 0 : t.begin[i];
        t.end[i] = t.end[i] > grid.shape[i] ? grid.shape[i] : t.end[i];
    }
    return t;
}

// The rest of a triangle whose box is there.
FM_RULE fm_voxel_triangle fm_voxel_axes(fm_voxel_triangle given) {
    FM_PRECISE fm_voxel_triangle t = given;
    float reach[3];  // from the first corner to a centre of the box's voxels, at most
    float minor[3];  // sizes of the normal's terms
    bool wide = false;
    for (int i = 0; i < 3; i++) {
        wide = wide || t.low[i] <= -FM_VOXEL_FAR || t.high[i] >= FM_VOXEL_FAR;
    }
    for (int i = 0; i < 3; i++) {
        t.edge[i] = wide ? 0.0f : t.corner[3 + i] - t.corner[i];
        t.edge[3 + i] = wide ? 0.0f : t.corner[6 + i] - t.corner[3 + i];
        t.edge[6 + i] = wide ? 0.0f : t.corner[i] - t.corner[6 + i];
        reach[i] = (t.high[i] - t.low[i]) + (1.0f + 2.0f * t.delta[i]);
    }
    for (int a = 0; a < 3; a++) {
        const int u = (a + 1) % 3;
        const int v = (a + 2) % 3;
        FM_PRECISE float left = t.edge[u] * t.edge[6 + v];
        FM_PRECISE float right = t.edge[v] * t.edge[6 + u];
        t.normal[a] = right - left;
        minor[a] = FM_SIZE_OF(left) + FM_SIZE_OF(right);
        for (int e = 0; e < 3; e++) {
            FM_PRECISE float across_u = -t.edge[3 * e + v];
            FM_PRECISE float across_v = t.edge[3 * e + u];
            // At the first corner 0, at the second, at the third.
            FM_PRECISE float second = across_u * t.edge[u] + across_v * t.edge[v];
            FM_PRECISE float third = -(across_u * t.edge[6 + u] + across_v * t.edge[6 + v]);
            FM_PRECISE float slack = 8.0f * FM_VOXEL_ULP * (FM_SIZE_OF(across_u) * reach[u] + FM_SIZE_OF(across_v) * reach[v]);
            t.least[3 * a + e] = FM_LESSER(FM_LESSER(second, third), 0.0f) - slack;
            t.most[3 * a + e] = FM_GREATER(FM_GREATER(second, third), 0.0f) + slack;
        }
    }
    t.plane = 8.0f * FM_VOXEL_ULP * ((minor[0] * reach[0] + minor[1] * reach[1]) + minor[2] * reach[2]);
    return t;
}

// Whether the triangle touches the box of half extents `half` around the voxel's centre.
FM_RULE bool fm_voxel_meets(fm_voxel_triangle t, float half_x, float half_y, float half_z, int x, int y, int z) {
    FM_PRECISE float extent[3];
    FM_PRECISE float at[3];  // of the centre, seen from the first corner
    extent[0] = half_x + t.delta[0];
    extent[1] = half_y + t.delta[1];
    extent[2] = half_z + t.delta[2];
    FM_PRECISE float centre[3];
    centre[0] = FM_F(x) + 0.5f;
    centre[1] = FM_F(y) + 0.5f;
    centre[2] = FM_F(z) + 0.5f;
    bool apart = false;
    for (int i = 0; i < 3; i++) {
        at[i] = centre[i] - t.corner[i];
        apart = apart || centre[i] < t.low[i] - extent[i] || centre[i] > t.high[i] + extent[i];
    }
    FM_PRECISE float off = (t.normal[0] * at[0] + t.normal[1] * at[1]) + t.normal[2] * at[2];
    FM_PRECISE float room =
        ((FM_SIZE_OF(t.normal[0]) * extent[0] + FM_SIZE_OF(t.normal[1]) * extent[1]) + FM_SIZE_OF(t.normal[2]) * extent[2]) +
        t.plane;
    apart = apart || FM_SIZE_OF(off) > room;
    for (int a = 0; a < 3; a++) {
        const int u = (a + 1) % 3;
        const int v = (a + 2) % 3;
        for (int e = 0; e < 3; e++) {
            FM_PRECISE float across_u = -t.edge[3 * e + v];
            FM_PRECISE float across_v = t.edge[3 * e + u];
            FM_PRECISE float product = across_u * at[u] + across_v * at[v];
            FM_PRECISE float radius = FM_SIZE_OF(across_u) * extent[u] + FM_SIZE_OF(across_v) * extent[v];
            apart = apart || product < t.least[3 * a + e] - radius || product > t.most[3 * a + e] + radius;
        }
    }
    return !apart;
}

// Whether the triangle sets voxel (x, y, z) of its box; `thin`: for 6-separation.
FM_RULE bool fm_voxel_sets(fm_voxel_triangle t, bool thin, int x, int y, int z) {
    if (!thin) {
        return fm_voxel_meets(t, 0.5f, 0.5f, 0.5f, x, y, z);
    }
    return fm_voxel_meets(t, 0.5f, 0.0f, 0.0f, x, y, z) || fm_voxel_meets(t, 0.0f, 0.5f, 0.0f, x, y, z) ||
           fm_voxel_meets(t, 0.0f, 0.0f, 0.5f, x, y, z);
}

// Rows (y, z) that may cross a triangle, from the voxels of its box: `fm_voxel_crossing` is 0 in all others. A triangle behind the
// grid along x counts too.
#define FM_CROSSING_BEGIN(t, axis) ((t).begin[axis] > 0 ? (t).begin[axis] - 1 : 0)
#define FM_CROSSING_END(t, axis, shape) ((t).end[axis] < (shape) ? (t).end[axis] + 1 : (shape))

// How often the line of row (y, z) leaves through the triangle, seen along x: 1, -1 where it enters, 0 where it passes by.
FM_RULE int fm_voxel_crossing(fm_voxel_triangle t, int y, int z) {
    FM_PRECISE float at_y = FM_F(y) + 0.5f;
    FM_PRECISE float at_z = FM_F(z) + 0.5f;
    int sum = 0;
    for (int e = 0; e < 3; e++) {
        const int first = 3 * e;
        const int second = e < 2 ? 3 * e + 3 : 0;
        const bool up = t.corner[first + 2] <= at_z && t.corner[second + 2] > at_z;
        const bool down = t.corner[second + 2] <= at_z && t.corner[first + 2] > at_z;
        // From the lower end to the upper one, whichever triangle asks.
        float lower_y = up ? t.corner[first + 1] : t.corner[second + 1];
        float lower_z = up ? t.corner[first + 2] : t.corner[second + 2];
        float upper_y = up ? t.corner[second + 1] : t.corner[first + 1];
        float upper_z = up ? t.corner[second + 2] : t.corner[first + 2];
        FM_PRECISE float side = (upper_y - lower_y) * (at_z - lower_z) - (upper_z - lower_z) * (at_y - lower_y);
        sum += side > 0.0f ? (up ? 1 : down ? -1 : 0) : 0;
    }
    return sum;
}

// How many voxels of row (y, z), from x = 0 on, have their centre before the triangle, through which the row's line goes with
// `crossing` (not 0).
FM_RULE int fm_voxel_before(fm_voxel_triangle t, int crossing, int y, int z, int shape_x) {
    const float sign = FM_F(crossing);
    FM_PRECISE float along = sign * t.normal[0];
    int least = fm_voxel_clamp(-FM_FLOOR_OF(0.5f - t.low[0]), 0, shape_x);
    int most = fm_voxel_clamp(-FM_FLOOR_OF(0.5f - t.high[0]), 0, shape_x);
    FM_PRECISE float at_y = (FM_F(y) + 0.5f) - t.corner[1];
    FM_PRECISE float at_z = (FM_F(z) + 0.5f) - t.corner[2];
    FM_PRECISE float across = sign * (t.normal[1] * at_y + t.normal[2] * at_z);
    // The product rises along x, rounded too.
    while (along > 0.0f && least < most) {
        const int middle = (least + most) / 2;
        FM_PRECISE float at_x = (FM_F(middle) + 0.5f) - t.corner[0];
        FM_PRECISE float product = along * at_x + across;
        if (product < 0.0f) {
            least = middle + 1;
        } else {
            most = middle;
        }
    }
    return least;
}

#endif
