// SPDX-License-Identifier: MIT
// The rows of columns along y or z, of a transform or a world: column (slice, x) runs along y in slice z, or along z in slice y
// when ALONG_Z. Expects memory.glsl, `push` with the grid's axes, and the constant ALONG_Z.

uint column_rows() {
    return ALONG_Z ? push.z : push.y;
}

uint column_slices() {
    return ALONG_Z ? push.y : push.z;
}

// Row of the volume that holds row n of a slice's columns.
uint64_t row_of(uint slice, uint n) {
    return ALONG_Z ? slice + uint64_t(n) * push.y : n + uint64_t(slice) * push.y;
}
