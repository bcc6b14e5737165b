// SPDX-License-Identifier: MIT
// Where the bits of near blocks lie, and how they are looked up. Expects memory.glsl and sdf.glsl.

uvec3 near_grid() {
    return (uvec3(field_size()) + (FM_SDF_MIDDLE - 1)) / FM_SDF_MIDDLE;
}

uint near_words(uint bits) {
    return (bits + 31) / 32;
}

uint64_t near_padded(uint64_t words) {
    return (words * 4 + 15) & ~uint64_t(15);
}

// Bits of the blocks of row (y, z).
fm_address near_row(uvec3 grid, uint y, uint z) {
    return push.scratch + FM_SDF_HEADER_BYTES + (uint64_t(z) * grid.y + y) * near_words(grid.x) * 4;
}

// Bits of the rows of slice z.
fm_address near_slice(uvec3 grid, uint z) {
    return push.scratch + FM_SDF_HEADER_BYTES + near_padded(uint64_t(grid.z) * grid.y * near_words(grid.x)) +
           uint64_t(z) * near_words(grid.y) * 4;
}

// Bits of the slices.
fm_address near_slices(uvec3 grid) {
    return near_slice(grid, 0) + near_padded(uint64_t(grid.z) * near_words(grid.y));
}

fm_address near_entries(uvec3 grid) {
    return near_slices(grid) + near_padded(near_words(grid.z));
}

// What a block knows of the surface, before and after it was flooded.
struct near_cell {
    vec3 point;
    uint triangle;
};

fm_address near_cells(uvec3 grid, uint which) {
    uint64_t blocks = uint64_t(grid.x) * grid.y * grid.z;
    return near_entries(grid) + near_padded(blocks) + which * blocks * FM_NEAR_CELL_BYTES;
}

void near_store_cell(uvec3 grid, uvec3 block, near_cell cell) {
    uint64_t number = (uint64_t(block.z) * grid.y + block.y) * grid.x + block.x;
    ref_u32x4(near_cells(grid, 0) + number * FM_NEAR_CELL_BYTES).v = uvec4(floatBitsToUint(cell.point), cell.triangle);
}

// The triangle that was flooded to a block, FM_GPU_NONE of an empty mesh.
uint near_flooded(uvec3 grid, uvec3 block) {
    uint64_t number = (uint64_t(block.z) * grid.y + block.y) * grid.x + block.x;
    return ref_u32(near_cells(grid, EDGE) + number * FM_NEAR_CELL_BYTES + 12).v;
}

float near_reach() {
    return uintBitsToFloat(ref_u32(push.scratch + FM_NEAR_REACH).v);
}

bool near_bit(fm_address bits, uint i) {
    return (ref_u32(bits + (i >> 5) * 4).v >> (i & 31u) & 1) != 0;
}

// The highest bit that is set below bit i, -1 where there is none.
int near_before(fm_address bits, uint i) {
    int word = int(i >> 5);
    uint v = ref_u32(bits + word * 4).v & ((1u << (i & 31u)) - 1);
    while (v == 0 && word > 0) {
        word--;
        v = ref_u32(bits + word * 4).v;
    }
    return v == 0 ? -1 : word * 32 + findMSB(v);
}

// The lowest one from bit i on, of `count`.
int near_from(fm_address bits, uint i, uint count) {
    uint word = i >> 5;
    uint v = ref_u32(bits + word * 4).v & (0xffffffffu << (i & 31u));
    while (v == 0 && word + 1 < near_words(count)) {
        word++;
        v = ref_u32(bits + word * 4).v;
    }
    return v == 0 ? -1 : int(word) * 32 + findLSB(v);
}
