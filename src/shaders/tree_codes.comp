// SPDX-License-Identifier: MIT
#version 460
#include "tree.glsl"

// One invocation owns a triangle, whose key is the Morton code of its centre in 1024^3 cubes. Reads 12 bytes of indices and the
// corners, writes 8 bytes.

// The lowest ten bits, two zeros between them.
uint spread(uint x) {
    x = (x | x << 16) & 0x030000ffu;
    x = (x | x << 8) & 0x0300f00fu;
    x = (x | x << 4) & 0x030c30c3u;
    return (x | x << 2) & 0x09249249u;
}

void main() {
    uint64_t i = folded_group(gl_WorkGroupID, gl_NumWorkGroups) * FM_TREE_THREADS + gl_LocalInvocationIndex;
    if (i >= push.mesh.triangle_count) {
        return;
    }
    vec3 low, high;
    [[unroll]] for (uint axis = 0; axis < 3; axis++) {
        low[axis] = ordered_float(word_at(push.box, axis));
        high[axis] = ordered_float(word_at(push.box, 3 + axis));
    }
    vec3 size = high - low;
    float edge = max(size.x, max(size.y, size.z));
    vec3 a, b, c;
    mesh_corners(push.mesh, uint(i), a, b, c);
    uint key = FM_KEY_UNFIT;
    if (mesh_triangle_fits(a, b, c)) {
        vec3 centre = 0.5 * min(min(a, b), c) + 0.5 * max(max(a, b), c);
        vec3 cell = edge > 1e-30 ? (centre - low) / edge * 1024 : vec3(0);
        uvec3 at = uvec3(clamp(cell, vec3(0), vec3(1023)));
        key = spread(at.x) | spread(at.y) << 1 | spread(at.z) << 2;
    }
    set_word(push.keys, uint(i), key);
    set_word(push.numbers, uint(i), uint(i));
}
