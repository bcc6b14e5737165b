// SPDX-License-Identifier: MIT
// The columns of a world's passes, the lists of tiles to do, and which of the next pass's tiles a change reaches. A tile is
// TILE_WIDTH columns wide and as long as they are. Expects memory.glsl, the constants ALONG_Z, SEGMENTS, LANES and ROWS.

#include "shared.h"
#include "lists.glsl"

layout(constant_id = 3) const uint FORMAT = FM_GPU_PACKED;
layout(constant_id = 7) const uint TILE_WIDTH = 64;
layout(constant_id = 8) const bool LISTED = false;  // only the tiles of the list are done, and changes are passed on

layout(constant_id = 10) const bool QUADS = false;   // rows are a multiple of four voxels long

layout(push_constant) uniform push_block {
    fm_world_push push;
};

#include "sites.glsl"
#include "rows.glsl"

uint x_end() {
    return push.x;
}

fm_address raw_at(uint64_t row, uint x, uint bytes) {
    return push.raw + (row * push.pitch + x) * bytes;
}

// The change that the listed tile of the pass along z has to follow: its first and last slice, and the least distance there, before
// or after. In memory these are numbers that only rise and are 0 where nothing changed: 2^32 - 1 - first, last + 1,
// 2^32 - 1 - least.
uint change_first, change_last, change_least;

// Whether row n, which is now at distance `value`, may have been at another one: only if a change could be as near.
bool may_have_changed(uint n, uint value) {
    uint gap = n < change_first ? change_first - n : n > change_last ? n - change_last : 0;
    uint nearest = change_least + (FORMAT == FM_GPU_SQUARED_U32 ? gap * gap : gap);
    return nearest <= value && nearest < push.cap;
}

// A bit for each row of a segment that changed, and the least distance there, before or after: of this invocation, and of all.
uint own_rows[(ROWS + 31) / 32];
uint own_least;
shared uint changed_rows[SEGMENTS][(ROWS + 31) / 32];
shared uint changed_least[SEGMENTS];

void clear_changes() {
    if (LISTED && !ALONG_Z) {
        [[unroll]] for (uint i = 0; i < (ROWS + 31) / 32; i++) {
            own_rows[i] = 0;
            if (gl_LocalInvocationID.x == 0) {
                changed_rows[gl_LocalInvocationID.y][i] = 0;
            }
        }
        own_least = FM_GPU_NONE;
        if (gl_LocalInvocationID.x == 0) {
            changed_least[gl_LocalInvocationID.y] = FM_GPU_NONE;
        }
    }
}

// `row` of this invocation's segment changed, where the distance was or is `least`.
void note_change(uint row, uint least) {
    own_rows[row / 32] |= 1u << (row & 31u);
    own_least = min(own_least, least);
}

// Lists the tiles along z that hold a changed row of this tile.
void pass_on_changes(uint slice, uint tile_x) {
    if (!LISTED || ALONG_Z) {
        return;
    }
    uint segment = gl_LocalInvocationID.y;
    barrier();
    if (own_least != FM_GPU_NONE) {
        [[unroll]] for (uint i = 0; i < (ROWS + 31) / 32; i++) {
            atomicOr(changed_rows[segment][i], own_rows[i]);
        }
        atomicMin(changed_least[segment], own_least);
    }
    barrier();
    uint least = changed_least[segment];
    for (uint row = gl_LocalInvocationID.x; row < ROWS; row += LANES) {
        if ((changed_rows[segment][row / 32] >> (row & 31u) & 1u) != 0) {
            uint tile = (segment * ROWS + row) * push.tiles + tile_x;
            fm_address change = push.next_marks + uint64_t(tile) * 16;
            if (atomicMax(ref_u32(change).v, FM_GPU_NONE - slice) == 0) {
                list_append(push.next_list, push.next_entries, tile);
            }
            atomicMax(ref_u32(change + 4).v, slice + 1);
            atomicMax(ref_u32(change + 8).v, FM_GPU_NONE - least);
        }
    }
}

// What a pass does with a tile: the columns of `slice` from `x` on.
void do_tile(uint slice, uint x);

void run_tiles() {
    uint count = LISTED ? list_count(push.list) : push.tiles * column_slices();
    uint groups = gl_NumWorkGroups.x * gl_NumWorkGroups.y;
    bool first = gl_LocalInvocationIndex == 0;
    if (LISTED && first && gl_WorkGroupID.x == 0) {
        ref_u32(push.counted).v = count;
    }
    for (uint i = uint(folded_group(gl_WorkGroupID, gl_NumWorkGroups)); i < count; i += groups) {
        uint tile = LISTED ? ref_u32(push.entries + uint64_t(i) * 4).v : i;
        fm_address mark = push.marks + uint64_t(tile) * (ALONG_Z ? 16 : 4);
        if (LISTED && ALONG_Z) {
            uvec4 change = ref_u32x4(mark).v;
            change_first = FM_GPU_NONE - change.x;
            change_last = change.y - 1;
            change_least = FM_GPU_NONE - change.z;
        }
        clear_changes();
        do_tile(tile / push.tiles, tile % push.tiles * TILE_WIDTH);
        if (!LISTED) {
            break;
        }
        pass_on_changes(tile / push.tiles, tile % push.tiles);
        barrier();
        if (first && ALONG_Z) {
            ref_u32x4(mark).v = uvec4(0);
        } else if (first) {
            ref_u32(mark).v = 0;
        }
    }
}
