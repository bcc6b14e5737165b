// SPDX-License-Identifier: MIT
#version 460
#include "memory.glsl"
#include "march.glsl"
#include "picture.glsl"

// One invocation owns a tile of 8 x 8 pixels: the time up to which all of its rays meet nothing but air. It reads the field a
// dozen times or so, one read after the other (terrain of 1024^3 at 1920 x 1080: 11.6), and writes 4 bytes, a sixteenth of a byte a
// pixel.
//
// All rays of the tile are within `spread` * time of the middle one in the Manhattan sense, for the rays' ends at a time lie in a
// plane and the corners are the farthest.

layout(local_size_x = 32) in;

// The time up to which the tile's rays meet nothing but air; adds to `reads`.
float beam_end(uvec2 tile, inout uint reads) {
    const float half_side = 0.5 * (FM_TILE - 1);
    vec3 origin = camera_place();
    vec3 way = pixel_way(vec2(tile * FM_TILE) + half_side);
    vec3 right = vec3(push.right[0], push.right[1], push.right[2]);
    vec3 down = vec3(push.down[0], push.down[1], push.down[2]);
    float spread = half_side * max(dot(abs(right + down), vec3(1)), dot(abs(right - down), vec3(1))) * 1.001 + 1e-6;
    float speed = dot(abs(way), vec3(1));
    vec3 size = vec3(world_axes());
    float far = (dot(abs(origin - 0.5 * size), vec3(1)) + dot(size, vec3(1))) / speed;
    float time = 0;
    for (uint i = 0; i < FM_BEAM_READS && time < far; i++) {
        ivec3 at = ivec3(floor(origin + way * time));
        ivec3 nearest = clamp(at, ivec3(0), ivec3(world_axes()) - 1);
        ivec3 gap = abs(at - nearest);
        reads++;
        float steps = float(steps_of(load_entry(element_at(nearest)))) + float(gap.x + gap.y + gap.z);
        float room = steps - FM_BEAM_APART - spread * time;
        if (room < FM_BEAM_ROOM) {
            break;
        }
        time += room / (spread + speed);
    }
    return min(time, far);
}

void main() {
    begin_sums();
    uvec2 pixels = uvec2(push.pixels & 0xffffu, push.pixels >> 16);
    uvec2 tiles = (pixels + (FM_TILE - 1)) / FM_TILE;
    uint tile = uint(folded_group(gl_WorkGroupID, gl_NumWorkGroups)) * 32 + gl_LocalInvocationIndex;
    if (tile < tiles.x * tiles.y) {
        uint reads = 0;
        float end = beam_end(uvec2(tile % tiles.x, tile / tiles.x), reads);
        ref_u32(push.beam + uint64_t(tile) * 4).v = floatBitsToUint(end);
        if (COUNT) {
            add_sum(FM_SUM_BEAM, reads);
        }
    }
    end_sums();
}
