// SPDX-License-Identifier: MIT
// The columns of a transform's pass. Expects memory.glsl, `push` (fm_column_push) and the constant ALONG_Z.

#include "rows.glsl"

uint x_end() {
    return push.x_end;
}

float row_weight() {
    return push.weight_x;
}

float column_weight() {
    return ALONG_Z ? push.weight_z : push.weight_y;
}

uvec3 voxel_at(uint slice, uint n, uint x) {
    return ALONG_Z ? uvec3(x, slice, n) : uvec3(x, n, slice);
}

fm_address raw_at(uint64_t row, uint x, uint bytes) {
    return push.raw + (row * push.pitch + (x - push.x_begin)) * bytes;
}

fm_address site_y_at(uint64_t row, uint x) {
    return push.sites_y + (row * (push.x_end - push.x_begin) + (x - push.x_begin)) * 4;
}

// The first x and the slice of this group, whose tile is `width` voxels wide; false for the groups past the last.
bool tile_of(uvec3 group, uvec3 groups, uint width, out uint x, out uint slice) {
    uint tiles = (push.x_end - push.x_begin + width - 1) / width;
    uint64_t tile = folded_group(group, groups);
    slice = uint(tile / tiles);
    x = push.x_begin + uint(tile % tiles) * width;
    return tile < uint64_t(tiles) * column_slices();
}
