// SPDX-License-Identifier: MIT
// What the kernels that voxelise share: how a triangle is loaded, and how what it sets is stored. Expects memory.glsl and `push`
// (fm_voxelize_push).

#include "mesh.glsl"

layout(constant_id = 0) const bool THIN = false;
layout(constant_id = 1) const bool BITS = false;
layout(constant_id = 2) const bool SOLID = false;  // crossings of rows are counted, not voxels set

// The triangle's corners with the rest of its box; false where it takes part in nothing.
bool voxel_load(uint triangle, out fm_voxel_triangle t) {
    vec3 a, b, c;
    mesh_corners(push.mesh, triangle, a, b, c);
    t = fm_voxel_box(push.grid, float[3](a.x, a.y, a.z), float[3](b.x, b.y, b.z), float[3](c.x, c.y, c.z));
    return mesh_triangle_fits(a, b, c);
}

// Axes u and v of the columns that a triangle's work is split into run from `begin` on, `size` of each.
struct voxel_columns {
    ivec2 begin;
    ivec2 size;
};

uint64_t voxel_count(voxel_columns columns) {
    return uint64_t(columns.size.x) * columns.size.y;
}

// Rows (y, z) of the grid's slices in question.
voxel_columns voxel_rows(fm_voxel_triangle t) {
    const ivec2 low = ivec2(FM_CROSSING_BEGIN(t, 1), max(FM_CROSSING_BEGIN(t, 2), int(push.z_begin)));
    const ivec2 high =
        ivec2(FM_CROSSING_END(t, 1, push.grid.shape[1]), min(FM_CROSSING_END(t, 2, push.grid.shape[2]), int(push.z_end)));
    return voxel_columns(low, max(high - low, ivec2(0)));
}

void voxel_set(int x, int y, int z) {
    const uint64_t row = uint64_t(z) * push.grid.shape[1] + y;
    if (BITS) {
        atomicOr(ref_u32(push.voxels + (row * push.row_words + uint(x) / 32) * 4).v, 1u << (uint(x) & 31u));
    } else {
        ref_u8(push.voxels + row * push.grid.shape[0] + x).v = uint8_t(1);
    }
}

// A crossing counts for all voxels before it: it is noted at the last of them.
void voxel_cross(fm_voxel_triangle t, int y, int z) {
    const int crossing = fm_voxel_crossing(t, y, z);
    if (crossing == 0) {
        return;
    }
    const int before = fm_voxel_before(t, crossing, y, z, push.grid.shape[0]);
    if (before > 0) {
        const uint64_t row = uint64_t(z - int(push.z_begin)) * push.grid.shape[1] + y;
        atomicAdd(ref_u32(push.voxels + (row * push.grid.shape[0] + (before - 1)) * 4).v, uint(crossing));
    }
}
