// SPDX-License-Identifier: MIT
#version 460
#include "memory.glsl"
#include "shared.h"
#include "sites.glsl"
#include "lists.glsl"
#include "brush.glsl"

// Edits of a world, and what follows from them in a row: voxels, site bits, carries, and the field's entries of solid voxels. A
// group owns 8 rows of a slice, LISTED a bundle's, of which it looks at a range of x; 32 invocations share a row. Reads 4 bytes a
// voxel, writes 4 a solid one and 3/8 for bits and carries.

layout(local_size_x = 256) in;
layout(constant_id = 0) const uint FORMAT = FM_GPU_PACKED;
layout(constant_id = 1) const bool LISTED = false;  // by bundles; tiles along y whose input changes are listed
layout(constant_id = 2) const uint ROW_WORDS = 32;
layout(constant_id = 3) const bool TRACKED = false;  // list the tiles

const uint ROWS = 8;
const uint LANES = 32;
const uint FILLED = (ROW_WORDS + 31) / 32;

layout(push_constant) uniform push_block {
    fm_rows_push push;
};

layout(buffer_reference, std430, buffer_reference_align = 8) buffer ref_bundle {
    fm_gpu_bundle v;
};

shared uint words[ROWS][ROW_WORDS];
shared uint filled[ROWS][FILLED];   // which words hold a site
shared uint changed_words[FILLED];  // of which the distances along x changed, in any of the rows

// The field's entry of a solid voxel, but for the colour in a plane of its own. Those of air follow by the passes behind this one.
void set_entry(uint64_t element, uint voxel) {
    if (FORMAT == FM_GPU_SPLIT_U8) {
        ref_u8(push.field + element).v = uint8_t(0);
    } else if (FORMAT == FM_GPU_SPLIT_U16) {
        ref_u16(push.field + element * 2).v = uint16_t(0);
    } else {
        ref_u32(push.field + element * 4).v = FORMAT == FM_GPU_PACKED ? voxel & 0xffu : 0;
    }
}

// What the bundle's brushes make of `count` voxels from `at` on.
uvec4 edited(uvec4 v, uint count, ivec3 at, fm_gpu_bundle bundle) {
    for (uint i = 0; i < bundle.brush_count; i++) {
        uint number = ref_u32(push.order + (bundle.first_brush + i) * 4).v;
        ref_brush brush = ref_brush(push.brushes + uint64_t(number) * 64);
        // Kept a loop, for its body is long.
        [[dont_unroll]] for (uint k = 0; k < count; k++) {
            if (brush_covers(brush, at + ivec3(k, 0, 0))) {
                v[k] = brush.v.voxel;
            }
        }
    }
    return v;
}

// Four voxels from x on; which of them are solid.
uint do_quad(uint64_t row, ivec3 at, fm_gpu_bundle bundle) {
    uint64_t element = row * push.x + at.x;
    fm_address from = push.voxels + element * 4;
    uint count = min(4u, push.x - at.x);
    bool aligned = (push.x & 3u) == 0;
    uvec4 v = uvec4(0);
    if (aligned) {
        v = ref_u32x4(from).v;
    } else {
        for (uint i = 0; i < count; i++) {
            v[i] = ref_u32(from + 4 * i).v;
        }
    }
    if (LISTED && bundle.brush_count > 0) {
        uvec4 before = v;
        v = edited(v, count, at, bundle);
        for (uint i = 0; i < count; i++) {
            if (v[i] != before[i]) {
                ref_u32(from + 4 * i).v = v[i];
            }
        }
    }
    bvec4 solid = notEqual(v, uvec4(0));
    if (FORMAT != FM_GPU_PACKED && aligned) {
        ref_u32(push.colors + element).v = (v.x & 0xffu) | (v.y & 0xffu) << 8 | (v.z & 0xffu) << 16 | v.w << 24;
    }
    if (FORMAT == FM_GPU_PACKED && aligned && all(solid)) {
        ref_u32x4(push.field + element * 4).v = v & 0xffu;
        return 15u;
    }
    for (uint i = 0; i < count; i++) {
        if (FORMAT != FM_GPU_PACKED && !aligned) {
            ref_u8(push.colors + element + i).v = uint8_t(v[i]);
        }
        if (solid[i]) {
            set_entry(element + i, v[i]);
        }
    }
    return (solid.x ? 1u : 0u) | (solid.y ? 2u : 0u) | (solid.z ? 4u : 0u) | (solid.w ? 8u : 0u);
}

// Steps to the nearest sites in the words before and behind word w of row r.
uvec2 carries_of(uint r, uint w) {
    uvec2 carries = uvec2(FM_GPU_NONE);
    uint above = w & 31u;
    for (int i = int(w >> 5); i >= 0; i--) {
        uint m = filled[r][i] & (i == int(w >> 5) ? (1u << above) - 1u : 0xffffffffu);
        if (m != 0) {
            uint other = uint(i) * 32 + uint(findMSB(m));
            carries.x = w * 32 - (other * 32 + uint(findMSB(words[r][other])));
            break;
        }
    }
    for (uint i = w >> 5; i < FILLED; i++) {
        uint m = filled[r][i] & (i == w >> 5 ? ~((2u << above) - 1u) : 0xffffffffu);
        if (m != 0) {
            uint other = i * 32 + uint(findLSB(m));
            carries.y = other * 32 + uint(findLSB(words[r][other])) - (w * 32 + 31);
            break;
        }
    }
    return carries;
}

// Lists the tiles along y that hold a changed word.
void list_tiles(uint z, uint t) {
    uint tiles = (push.x + push.tile_width - 1) / push.tile_width;
    for (uint tile_x = t; tile_x < tiles; tile_x += ROWS * LANES) {
        uint last = min(tile_x * push.tile_width + push.tile_width, push.x) - 1;
        bool changed = false;
        for (uint w = tile_x * push.tile_width / 32; w <= last / 32; w++) {
            changed = changed || (changed_words[w / 32] >> (w & 31u) & 1u) != 0;
        }
        uint tile = z * tiles + tile_x;
        if (changed && atomicExchange(ref_u32(push.flags + uint64_t(tile) * 4).v, 1u) == 0) {
            list_append(push.lists + push.parity * FM_LIST_HEADER_BYTES, push.entries, tile);
        }
    }
}

fm_gpu_bundle bundle_of(uint64_t group) {
    if (LISTED) {
        return ref_bundle(push.bundles + group * 24).v;
    }
    uint y_bundles = (push.y + ROWS - 1) / ROWS;
    fm_gpu_bundle bundle;
    bundle.y = uint(group % y_bundles) * ROWS;
    bundle.z = uint(group / y_bundles);
    bundle.x_begin = 0;
    bundle.x_end = push.x;
    bundle.first_brush = 0;
    bundle.brush_count = 0;
    return bundle;
}

void main() {
    uint t = gl_LocalInvocationIndex;
    uint r = t / LANES;
    uint lane = t % LANES;
    uint64_t group = folded_group(gl_WorkGroupID, gl_NumWorkGroups);
    if (group >= push.groups) {
        return;
    }
    if (TRACKED && group == 0 && t == 0) {
        list_clear(push.lists + (push.parity ^ 1u) * FM_LIST_HEADER_BYTES);
        list_clear(push.lists + FM_LIST_Z * FM_LIST_HEADER_BYTES);
    }
    fm_gpu_bundle bundle = bundle_of(group);
    uint y = bundle.y + r;
    bool inside = y < push.y;
    uint64_t row = uint64_t(bundle.z) * push.y + min(y, push.y - 1);
    fm_address bits = push.bits + row * push.row_words * 4;
    uint first_word = bundle.x_begin / 32;
    uint end_word = (bundle.x_end + 31) / 32;

    // What was there is loaded before it is needed.
    uint bits_before[FILLED];
    uvec2 carries_before[FILLED];
    [[unroll]] for (uint i = 0; i < FILLED; i++) {
        uint w = min(i * LANES + lane, push.row_words - 1);
        bits_before[i] = LISTED ? ref_u32(bits + w * 4).v : 0;
        carries_before[i] = TRACKED ? load_carries(push.carries, row * push.row_words + w, false) : uvec2(0);
    }
    [[unroll]] for (uint i = 0; i < FILLED; i++) {
        uint w = i * LANES + lane;
        if (w < push.row_words) {
            words[r][w] = w >= first_word && w < end_word ? 0 : bits_before[i];
        }
    }
    for (uint i = lane; i < FILLED; i += LANES) {
        filled[r][i] = 0;
        changed_words[i] = 0;
    }
    barrier();
    if (inside) {
        for (uint x = first_word * 32 + lane * 4; x < min(end_word * 32, push.x); x += LANES * 4) {
            uint solid = do_quad(row, ivec3(x, y, bundle.z), bundle);
            if (solid != 0) {
                atomicOr(words[r][x / 32], solid << (x & 31u));
            }
        }
    }
    barrier();
    [[unroll]] for (uint i = 0; i < FILLED; i++) {
        uint w = i * LANES + lane;
        if (w < push.row_words && words[r][w] != 0) {
            atomicOr(filled[r][i], 1u << lane);
        }
    }
    barrier();
    [[unroll]] for (uint i = 0; i < FILLED; i++) {
        uint w = i * LANES + lane;
        if (inside && w < push.row_words) {
            uint word = words[r][w];
            uvec2 carries = carries_of(r, w);
            bool differs = !LISTED || word != bits_before[i];
            if (differs) {
                ref_u32(bits + w * 4).v = word;
            }
            store_carries(push.carries, row * push.row_words + w, carries, false);
            if (TRACKED && (differs || min(carries_before[i], uvec2(push.reach)) != min(carries, uvec2(push.reach)))) {
                atomicOr(changed_words[i], 1u << lane);
            }
        }
    }
    if (TRACKED) {
        barrier();
        list_tiles(bundle.z, t);
    }
}
