// SPDX-License-Identifier: MIT
#version 460
#include "tree.glsl"

// The box of the triangles' centres. An invocation owns every so manieth triangle, of which it keeps the least and the greatest
// centre; the group's are reduced in shared memory, and six atomics a group go out. Reads 12 bytes of indices a triangle and its
// corners (12 bytes a vertex, if each comes from memory once).

shared vec3 lows[FM_TREE_THREADS];
shared vec3 highs[FM_TREE_THREADS];

void main() {
    uint own = gl_LocalInvocationIndex;
    vec3 low = vec3(MESH_INFINITY);
    vec3 high = vec3(-MESH_INFINITY);
    uint64_t step = uint64_t(gl_NumWorkGroups.x) * FM_TREE_THREADS;
    for (uint64_t i = uint64_t(gl_WorkGroupID.x) * FM_TREE_THREADS + own; i < push.mesh.triangle_count; i += step) {
        vec3 a, b, c;
        mesh_corners(push.mesh, uint(i), a, b, c);
        if (mesh_triangle_fits(a, b, c)) {
            vec3 centre = 0.5 * min(min(a, b), c) + 0.5 * max(max(a, b), c);
            low = min(low, centre);
            high = max(high, centre);
        }
    }
    lows[own] = low;
    highs[own] = high;
    barrier();
    for (uint half_size = FM_TREE_THREADS / 2; half_size > 0; half_size /= 2) {
        if (own < half_size) {
            lows[own] = min(lows[own], lows[own + half_size]);
            highs[own] = max(highs[own], highs[own + half_size]);
        }
        barrier();
    }
    if (own < 3) {
        atomicMin(ref_u32(push.box + own * 4).v, ordered_of(lows[0][own]));
        atomicMax(ref_u32(push.box + 12 + own * 4).v, ordered_of(highs[0][own]));
    }
}
