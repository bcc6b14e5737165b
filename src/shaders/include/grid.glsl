// SPDX-License-Identifier: MIT
// The columns of a pass: column (slice, x) runs along y in slice z, or along z in slice y when ALONG_Z. Groups own LANES * `wide`
// adjacent x. Expects `push` (fm_column_push) and the constant ALONG_Z.

uint column_rows() {
    return ALONG_Z ? push.z : push.y;
}

uint x_end() {
    return push.x_end;
}

uint column_slices() {
    return ALONG_Z ? push.y : push.z;
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

// Row of the volume that holds row n of a slice's columns.
uint64_t row_of(uint slice, uint n) {
    return ALONG_Z ? slice + uint64_t(n) * push.y : n + uint64_t(slice) * push.y;
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
