// SPDX-License-Identifier: MIT
#version 460
#include "memory.glsl"
#include "shared.h"

// Manhattan distances along a column: out(n) = min over m of in(m) + |n - m|, as two min-plus scans held in registers. One
// invocation owns four adjacent x and ROWS rows of one slice; SEGMENTS invocations make up a column and exchange what leaves their
// ends through shared memory. A pass reads each raw distance (or the bits) once and writes each once: 1 to 4 bytes either way a
// voxel.
//
// SCAN_F16 packs two distances into a pair of halves, offset by 1024: whole numbers stay exact to 2047, the bytes of the packed
// distances are the low bytes of the halves, and 255 stands for 255 and more. The other form counts in 32 bits.

layout(local_size_x_id = 0, local_size_y_id = 1) in;
layout(constant_id = 2) const uint ROWS = 16;
layout(constant_id = 4) const uint WIDTH = 1;  // bytes of a raw distance: the greatest number of that width means none
layout(constant_id = 5) const uint SOURCE = 0;
layout(constant_id = 6) const uint TARGET = 0;
layout(constant_id = 9) const bool ALONG_Z = false;
const uint LANES = gl_WorkGroupSize.x;
const uint SEGMENTS = gl_WorkGroupSize.y;

#ifdef WORLD
const bool WIDE = false;
#include "world_grid.glsl"
#else
layout(constant_id = 3) const uint METRIC = FM_GPU_L1;
layout(constant_id = 7) const bool WIDE = false;
layout(constant_id = 8) const bool PLAIN = false;  // the result is the raw distance, four at a time
layout(constant_id = 10) const bool SQUARED = false;
layout(constant_id = 11) const bool BORDER = false;
layout(constant_id = 12) const uint OUT_TYPE = 0;
layout(constant_id = 13) const uint INDEX_TYPE = 0;
const bool WEIGHTED = false;
const bool BIG = true;

layout(push_constant) uniform push_block {
    fm_column_push push;
};

#include "sites.glsl"
#include "grid.glsl"
#include "finish.glsl"
#endif

#ifdef SCAN_F16
#define QUAD_PARTS 2
#define part_t f16vec2
const float16_t ZERO = 1024.0hf;
const part_t FAR = part_t(1279.0hf);  // 1024 + 255
const uint FAR_STEPS = 255;
#else
#define QUAD_PARTS 4
#define part_t uint
const part_t FAR = 0x40000000u;
const uint FAR_STEPS = 0x20000000u;
#endif

struct quad_t {
    part_t p[QUAD_PARTS];
};

part_t steps_of(uint steps) {
#ifdef SCAN_F16
    return part_t(float16_t(steps));
#else
    return steps;
#endif
}

quad_t far_quad() {
    quad_t q;
    [[unroll]] for (int i = 0; i < QUAD_PARTS; i++) {
        q.p[i] = FAR;
    }
    return q;
}

quad_t nearer(quad_t a, quad_t b, part_t steps) {
    [[unroll]] for (int i = 0; i < QUAD_PARTS; i++) {
        a.p[i] = min(a.p[i], b.p[i] + steps);
    }
    return a;
}

// Four bytes, the first voxel lowest. The halves hold voxels 0 and 2, and 1 and 3, so that a shift and a mask take them apart.
quad_t unpack_bytes(uint v) {
    quad_t q;
#ifdef SCAN_F16
    q.p[0] = unpackFloat2x16((v & 0x00ff00ffu) | 0x64006400u);
    q.p[1] = unpackFloat2x16((v >> 8 & 0x00ff00ffu) | 0x64006400u);
#else
    [[unroll]] for (int i = 0; i < 4; i++) {
        uint byte = v >> (8 * i) & 0xffu;
        q.p[i] = byte == 0xffu ? FAR : byte;
    }
#endif
    return q;
}

uint quad_value(quad_t q, uint i) {
#ifdef SCAN_F16
    uint steps = packFloat2x16(q.p[i & 1]) >> (i >= 2 ? 16 : 0) & 0x3ffu;
    return min(steps, 255u);
#else
    return min(q.p[i], FAR);
#endif
}

uint pack_bytes(quad_t q) {
#ifdef SCAN_F16
    uint low = packFloat2x16(min(q.p[0], FAR)) & 0x00ff00ffu;
    uint high = packFloat2x16(min(q.p[1], FAR)) & 0x00ff00ffu;
    return low | high << 8;
#else
    uint v = 0;
    [[unroll]] for (int i = 0; i < 4; i++) {
        v |= min(q.p[i], 255u) << (8 * i);
    }
    return v;
#endif
}

quad_t quad_of(uvec4 v) {
    quad_t q;
#ifdef SCAN_F16
    q.p[0] = part_t(v.xz) + ZERO;
    q.p[1] = part_t(v.yw) + ZERO;
#else
    q.p[0] = v.x;
    q.p[1] = v.y;
    q.p[2] = v.z;
    q.p[3] = v.w;
#endif
    return q;
}

#ifdef SCAN_F16
// Steps to the nearest set bit of four, a byte each; 255 where none is set.
const uint NEAREST_OF_FOUR[16] = {
    0xffffffffu, 0x03020100u, 0x02010001u, 0x02010000u, 0x01000102u, 0x01000100u, 0x01000001u, 0x01000000u,
    0x00010203u, 0x00010100u, 0x00010001u, 0x00010000u, 0x00000102u, 0x00000100u, 0x00000001u, 0x00000000u};
shared uint nearest_of_four[16];
#endif

// Steps along x to the nearest site for four voxels of one word, from the bits and the word's carries.
quad_t quad_of_bits(uint word, uvec2 carry, uint shift) {
    uint below = word & ~(0xffffffffu << shift);
    uint above = word >> shift >> 4;
    uint left = below != 0 ? shift - uint(findMSB(below)) : min(carry.x, FAR_STEPS) + shift;
    uint right = above != 0 ? uint(findLSB(above)) + 1 : min(carry.y, FAR_STEPS) + 28u - shift;
    uint four = word >> shift & 15u;
#ifdef SCAN_F16
    quad_t q = unpack_bytes(nearest_of_four[four]);
    f16vec2 from_left = unpackFloat2x16(left * 0x00010001u | 0x64006400u);
    f16vec2 from_right = unpackFloat2x16(right * 0x00010001u | 0x64006400u);
    q.p[0] = min(q.p[0], min(from_left + f16vec2(0, 2), from_right + f16vec2(3, 1)));
    q.p[1] = min(q.p[1], min(from_left + f16vec2(1, 3), from_right + f16vec2(2, 0)));
    return q;
#else
    uvec4 d;
    d.x = (four & 1u) != 0 ? 0 : left;
    d.y = (four & 2u) != 0 ? 0 : d.x + 1;
    d.z = (four & 4u) != 0 ? 0 : d.y + 1;
    d.w = (four & 8u) != 0 ? 0 : min(d.z + 1, right);
    d.z = min(d.z, d.w + 1);
    d.y = min(d.y, d.z + 1);
    d.x = min(d.x, d.y + 1);
    return quad_of(min(d, uvec4(FAR_STEPS)));
#endif
}

// What is loaded of four voxels before anything is done with it, so that the loads of all rows are under way together.
struct fetched_t {
    uvec4 v;
};

fetched_t fetch(fm_address at, fm_address carry_at) {
    fetched_t f;
    if (SOURCE == FM_SOURCE_BITS) {
        f.v.x = ref_u32(at).v;
        f.v.yz = load_carries(carry_at, 0, WIDE);
    } else if (WIDTH == 1) {
        f.v.x = ref_u32(at).v;
    } else if (WIDTH == 2) {
        f.v.xy = ref_u32x2(at).v;
    } else {
        f.v = ref_u32x4(at).v;
    }
    return f;
}

quad_t quad_of_fetched(fetched_t f, uint shift) {
    if (SOURCE == FM_SOURCE_BITS) {
        return quad_of_bits(f.v.x, f.v.yz, shift);
    }
    if (WIDTH == 1) {
        return unpack_bytes(f.v.x);
    }
    if (WIDTH == 2) {
        uvec4 v = uvec4(f.v.x & 0xffffu, f.v.x >> 16, f.v.y & 0xffffu, f.v.y >> 16);
        return quad_of(mix(v, uvec4(FAR_STEPS), equal(v, uvec4(0xffffu))));
    }
    return quad_of(min(f.v, uvec4(FAR_STEPS)));
}

void store_packed(fm_address to, quad_t q) {
    if (WIDTH == 1) {
        ref_u32(to).v = pack_bytes(q);
        return;
    }
    uvec4 v = uvec4(quad_value(q, 0), quad_value(q, 1), quad_value(q, 2), quad_value(q, 3));
    if (WIDTH == 2) {
        v = min(v, uvec4(0xffffu));
        ref_u32x2(to).v = uvec2(v.x | v.y << 16, v.z | v.w << 16);
    } else {
        ref_u32x4(to).v = mix(v, uvec4(FM_GPU_NONE), greaterThanEqual(v, uvec4(FAR_STEPS)));
    }
}

#ifdef WORLD
#include "world_scan.glsl"
#else
void store_quad(uint slice, uint n, uint x, quad_t q) {
    uint64_t row = row_of(slice, n);
    if (TARGET == FM_TARGET_RAW) {
        store_packed(raw_at(row, x, WIDTH), q);
        return;
    }
    if (PLAIN) {
        store_packed(push.distance + (row * push.x + x) * WIDTH, q);
        return;
    }
    uint none = WIDTH == 1 ? 0xffu : WIDTH == 2 ? 0xffffu : FAR_STEPS;
    [[unroll]] for (uint i = 0; i < 4; i++) {
        if (x + i < push.x) {
            uint steps = quad_value(q, i);
            finish_exact(voxel_at(slice, n, x + i), row * push.x + x + i, steps >= none ? FM_GPU_NONE : steps);
        }
    }
}
#endif

shared part_t tails[2][SEGMENTS][LANES][QUAD_PARTS];
shared part_t heads[2][SEGMENTS][LANES][QUAD_PARTS];

void scan_tile(uint slice, uint tile_x) {
    uint lane = gl_LocalInvocationID.x;
    uint segment = gl_LocalInvocationID.y;
    uint x = tile_x + 4 * lane;
    uint n0 = segment * ROWS;
    bool inside = x < x_end();

#ifdef SCAN_F16
    if (SOURCE == FM_SOURCE_BITS) {
        for (uint t = gl_LocalInvocationIndex; t < 16; t += LANES * SEGMENTS) {
            nearest_of_four[t] = NEAREST_OF_FOUR[t];
        }
        barrier();
    }
#endif
    // Rows and columns past the end load what the last ones do and are made far afterwards: a load that hangs on no condition can
    // be started before the one in front has arrived.
    uint rows = column_rows();
    uint load_x = min(x, (x_end() - 1) & ~3u);
    uint64_t row_first = row_of(slice, 0);
    uint64_t row_step = row_of(slice, 1) - row_first;
    uint64_t first_word = row_first * push.row_words + (load_x >> 5);
    fm_address at = SOURCE == FM_SOURCE_BITS ? push.bits + first_word * 4 : raw_at(row_first, load_x, WIDTH);
    fm_address carry_at = push.carries + first_word * (WIDE ? 8 : 4);
    uint64_t step = row_step * (SOURCE == FM_SOURCE_BITS ? push.row_words * 4 : push.pitch * WIDTH);
    uint64_t carry_step = row_step * push.row_words * (WIDE ? 8 : 4);
    fetched_t fetched[ROWS];
    [[unroll]] for (uint i = 0; i < ROWS; i++) {
        uint n = min(n0 + i, rows - 1);
        fetched[i] = fetch(at + n * step, carry_at + n * carry_step);
    }
#ifdef WORLD
    stored_t stored[ROWS];
    [[unroll]] for (uint i = 0; i < ROWS; i++) {
        stored[i] = fetch_stored(slice, min(n0 + i, rows - 1), load_x);
    }
#endif
    quad_t q[ROWS];
    [[unroll]] for (uint i = 0; i < ROWS; i++) {
        q[i] = quad_of_fetched(fetched[i], load_x & 31u);
        if (n0 + i >= rows || !inside) {
            q[i] = far_quad();
        }
    }
    const part_t one = steps_of(1);
    [[unroll]] for (uint i = 1; i < ROWS; i++) {
        q[i] = nearer(q[i], q[i - 1], one);
    }
    [[unroll]] for (uint i = 1; i < ROWS; i++) {
        q[ROWS - 1 - i] = nearer(q[ROWS - 1 - i], q[ROWS - i], one);
    }

    // What reaches each segment's end from all segments before it, and its start from all behind: doubling scans over the segments.
    quad_t tail = q[ROWS - 1];
    quad_t head = q[0];
    uint buffer_at = 0;
    tails[0][segment][lane] = tail.p;
    heads[0][segment][lane] = head.p;
    barrier();
    for (uint reach = 1; reach < SEGMENTS && reach * ROWS < FAR_STEPS; reach *= 2) {
        quad_t other;
        if (segment >= reach) {
            other.p = tails[buffer_at][segment - reach][lane];
            tail = nearer(tail, other, steps_of(reach * ROWS));
        }
        if (segment + reach < SEGMENTS) {
            other.p = heads[buffer_at][segment + reach][lane];
            head = nearer(head, other, steps_of(reach * ROWS));
        }
        buffer_at ^= 1;
        tails[buffer_at][segment][lane] = tail.p;
        heads[buffer_at][segment][lane] = head.p;
        barrier();
    }
    quad_t before = far_quad();
    quad_t behind = far_quad();
    if (segment > 0) {
        before.p = tails[buffer_at][segment - 1][lane];
    }
    if (segment + 1 < SEGMENTS) {
        behind.p = heads[buffer_at][segment + 1][lane];
    }

    [[unroll]] for (uint i = 0; i < ROWS; i++) {
        if (inside && n0 + i < rows) {
            quad_t out_quad = nearer(q[i], before, steps_of(i + 1));
            out_quad = nearer(out_quad, behind, steps_of(ROWS - i));
#ifdef WORLD
            store_quad(slice, n0 + i, x, out_quad, stored[i]);
#else
            store_quad(slice, n0 + i, x, out_quad);
#endif
        }
    }
}

void main() {
#ifdef WORLD
    run_tiles();
#else
    uint slice, x;
    if (tile_of(gl_WorkGroupID, gl_NumWorkGroups, 4 * LANES, x, slice)) {
        scan_tile(slice, x);
    }
#endif
}
