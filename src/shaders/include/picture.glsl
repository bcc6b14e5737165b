// SPDX-License-Identifier: MIT
// What the kernels of a picture have in common: the rays of pixels, and sums over the picture. Expects march.glsl.

layout(constant_id = 3) const bool COUNT = false;

shared uint sums[FM_STATS_WORDS];  // of the work group, laid out as the picture's

vec3 pixel_way(vec2 pixel) {
    vec3 corner = vec3(push.corner[0], push.corner[1], push.corner[2]);
    vec3 right = vec3(push.right[0], push.right[1], push.right[2]);
    vec3 down = vec3(push.down[0], push.down[1], push.down[2]);
    precise vec3 way = (corner + right * pixel.x) + down * pixel.y;
    return way;
}

void begin_sums() {
    if (COUNT) {
        if (gl_LocalInvocationIndex < FM_STATS_WORDS) {
            sums[gl_LocalInvocationIndex] = 0;
        }
        barrier();
    }
}

void add_sum(uint sum, uint value) {
    uint before = atomicAdd(sums[2 * sum], value);
    if (before + value < before) {
        atomicAdd(sums[2 * sum + 1], 1u);
    }
}

void end_sums() {
    if (!COUNT) {
        return;
    }
    barrier();
    if (gl_LocalInvocationIndex > 0) {
        return;
    }
    fm_address stats = ref_u64(push.extra + FM_EXTRA_STATS).v;
    for (uint sum = 0; sum < FM_SUM_COUNT; sum++) {
        fm_address low = stats + sum * 8;
        uint before = atomicAdd(ref_u32(low).v, sums[2 * sum]);
        uint high = sums[2 * sum + 1] + (before + sums[2 * sum] < before ? 1 : 0);
        if (high > 0) {
            atomicAdd(ref_u32(low + 4).v, high);
        }
    }
    atomicMax(ref_u32(stats + FM_STATS_MOST * 4).v, sums[FM_STATS_MOST]);
}
