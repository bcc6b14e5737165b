// SPDX-License-Identifier: MIT
// What scan.comp does with a world's distances: along y they go to `raw`, and changes are passed on; along z into the field, where
// solid voxels' entries are right already.

void scan_tile(uint slice, uint x);

void do_tile(uint slice, uint x) {
    scan_tile(slice, x);
}

uvec2 pack_quad(quad_t q) {
    if (WIDTH == 1) {
        return uvec2(pack_bytes(q), 0);
    }
    uvec4 v = min(uvec4(quad_value(q, 0), quad_value(q, 1), quad_value(q, 2), quad_value(q, 3)), uvec4(0xffffu));
    return uvec2(v.x | v.y << 16, v.z | v.w << 16);
}

// What the pass along y stored the last time, loaded before it is needed.
struct stored_t {
    uvec2 v;
};

stored_t fetch_stored(uint slice, uint n, uint x) {
    stored_t stored;
    if (LISTED && TARGET == FM_TARGET_RAW) {
        fm_address at = raw_at(row_of(slice, n), x, WIDTH);
        stored.v = WIDTH == 1 ? uvec2(ref_u32(at).v, 0) : ref_u32x2(at).v;
    }
    return stored;
}

// The least distance, before or after, of those that differ between two packed quads.
uint least_change(uvec2 before, uvec2 after) {
    const uint bits = WIDTH == 1 ? 8 : 16;
    const uint mask = WIDTH == 1 ? 0xffu : 0xffffu;
    uint least = FM_GPU_NONE;
    [[unroll]] for (uint i = 0; i < 4; i++) {
        uint word = i * bits / 32;
        uint b = before[word] >> (i * bits & 31u) & mask;
        uint a = after[word] >> (i * bits & 31u) & mask;
        least = min(least, a != b ? min(a, b) : FM_GPU_NONE);
    }
    return least;
}

void store_middle(uint64_t row, uint row_in_segment, uint x, quad_t q, stored_t stored) {
    fm_address to = raw_at(row, x, WIDTH);
    uvec2 after = pack_quad(q);
    if (LISTED && stored.v == after) {
        return;
    }
    if (LISTED) {
        note_change(row_in_segment, least_change(stored.v, after));
    }
    if (WIDTH == 1) {
        ref_u32(to).v = after.x;
    } else {
        ref_u32x2(to).v = after;
    }
}

uvec4 values_of(quad_t q) {
    return uvec4(quad_value(q, 0), quad_value(q, 1), quad_value(q, 2), quad_value(q, 3));
}

// Solid voxels keep their entries, which hold their colour. Loading those to store whole quads would make every row wait.
void store_packed_field(uint64_t element, uint x, quad_t q) {
    fm_address to = push.distance + element * 4;
    uvec4 v = values_of(q);
    if (QUADS && all(notEqual(v, uvec4(0)))) {
        ref_u32x4(to).v = v << 24;
        return;
    }
    [[unroll]] for (uint i = 0; i < 4; i++) {
        if (v[i] != 0 && (QUADS || x + i < push.x)) {
            ref_u32(to + 4 * i).v = v[i] << 24;
        }
    }
}

void store_split_field(uint64_t element, uint x, quad_t q) {
    fm_address to = push.distance + element * WIDTH;
    uvec2 v = pack_quad(q);
    if (QUADS) {
        if (WIDTH == 1) {
            ref_u32(to).v = v.x;
        } else {
            ref_u32x2(to).v = v;
        }
        return;
    }
    [[dont_unroll]] for (uint i = 0; i < min(4, push.x - x); i++) {
        if (WIDTH == 1) {
            ref_u8(to + i).v = uint8_t(v.x >> (8 * i));
        } else {
            ref_u16(to + 2 * i).v = uint16_t(v[i / 2] >> (16 * (i & 1u)));
        }
    }
}

uint greatest_of(quad_t q) {
    uvec4 v = values_of(q);
    return max(max(v.x, v.y), max(v.z, v.w));
}

void store_quad(uint slice, uint n, uint x, quad_t q, stored_t stored) {
    uint64_t row = row_of(slice, n);
    if (TARGET == FM_TARGET_RAW) {
        store_middle(row, n % ROWS, x, q, stored);
    } else if (!LISTED || may_have_changed(n, greatest_of(q))) {
        if (FORMAT == FM_GPU_PACKED) {
            store_packed_field(row * push.x + x, x, q);
        } else {
            store_split_field(row * push.x + x, x, q);
        }
    }
}
