// SPDX-License-Identifier: MIT
#version 460
#include "memory.glsl"
#include "march.glsl"

// One invocation owns a tile of 8 x 8 pixels: the time up to which all of its rays meet nothing but air. It reads the field about
// forty times and writes 4 bytes, a sixteenth of a byte a pixel.
//
// All rays of the tile are within `spread` * time of the middle one in the Manhattan sense, for the rays' ends at a time lie in a
// plane and the corners are the farthest. Two points whose coordinates differ by m in sum lie in cells at most m + 3 apart.

layout(local_size_x = 32) in;

const float APART = 3.5;  // with the rounding of positions
const uint MOST_READS = 512;

void main() {
    uvec2 pixels = uvec2(push.pixels & 0xffffu, push.pixels >> 16);
    uvec2 tiles = (pixels + 7u) / 8u;
    uint64_t tile = folded_group(gl_WorkGroupID, gl_NumWorkGroups) * 32 + gl_LocalInvocationIndex;
    if (tile >= uint64_t(tiles.x) * tiles.y) {
        return;
    }
    vec2 middle = vec2(uvec2(uint(tile % tiles.x), uint(tile / tiles.x)) * 8u) + 3.5;
    vec3 origin = camera_place();
    vec3 way = pixel_way(middle);
    vec3 right = vec3(push.right[0], push.right[1], push.right[2]);
    vec3 down = vec3(push.down[0], push.down[1], push.down[2]);
    float spread = 3.5 * max(dot(abs(right + down), vec3(1)), dot(abs(right - down), vec3(1))) * 1.001 + 1e-6;
    float speed = dot(abs(way), vec3(1));
    vec3 size = vec3(world_axes());
    float reach = dot(abs(origin - 0.5 * size), vec3(1)) + dot(size, vec3(1));
    float far = reach / speed;
    float time = 0;
    for (uint i = 0; i < MOST_READS && time < far; i++) {
        ivec3 at = ivec3(floor(origin + way * time));
        ivec3 nearest = clamp(at, ivec3(0), ivec3(world_axes()) - 1);
        ivec3 gap = abs(at - nearest);
        float steps = float(steps_of(load_entry(element_at(nearest)))) + float(gap.x + gap.y + gap.z);
        float room = steps - APART - spread * time;
        if (room < 1.0) {
            break;
        }
        time += room / (spread + speed);
    }
    ref_u32(push.beam + tile * 4).v = floatBitsToUint(min(time, far));
}
