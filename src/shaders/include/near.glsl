// SPDX-License-Identifier: MIT
// Which blocks of 4^3 texels a triangle comes near to: those whose texels' box, thickened by a ball, it touches. Never too few; too
// many only at the corners of that shape. Units and rounding are those of voxel_rule.h, a block being a voxel there. Expects
// memory.glsl and `push` (fm_near_push).

#include "mesh.glsl"
#include "triangle_lists.glsl"

const float NEAR_HALF = 0.375;  // from a block's middle to its outermost texels

// A triangle and what separates it from boxes: its own box, its plane, and for large ones the normals of its edges as seen along
// the axes.
struct near_triangle {
    fm_voxel_triangle t;
    vec3 middle, half_size;
    vec3 extent;  // of a block, with how far corners may be off
    vec3 reach;   // of the ball, a little wider
    vec3 first;   // corner
    vec3 normal, normal_terms;
    float room;  // how far a middle may be from the plane
    ivec3 begin, end;
};

vec3 vector_of(float v[3]) {
    return vec3(v[0], v[1], v[2]);
}

// The blocks in question; false where there are none.
bool near_load(uint triangle, out near_triangle n) {
    vec3 a, b, c;
    mesh_corners(push.mesh, triangle, a, b, c);
    n.t = fm_voxel_box(push.grid, float[3](a.x, a.y, a.z), float[3](b.x, b.y, b.z), float[3](c.x, c.y, c.z));
    vec3 low = vector_of(n.t.low);
    vec3 high = vector_of(n.t.high);
    n.middle = 0.5 * low + 0.5 * high;
    n.half_size = 0.5 * high - 0.5 * low;
    n.extent = NEAR_HALF + vector_of(n.t.delta);
    n.reach = vector_of(push.reach) * 1.0001;
    vec3 wide = n.extent + n.reach + 0.001;
    vec3 size = vec3(push.grid.shape[0], push.grid.shape[1], push.grid.shape[2]);
    n.begin = ivec3(clamp(ceil(low - wide - 0.5), vec3(0), size));
    n.end = ivec3(clamp(floor(high + wide - 0.5) + 1, vec3(0), size));
    return mesh_triangle_fits(a, b, c) && all(lessThan(n.begin, n.end));
}

// The rest, of one that has blocks.
void near_plane(inout near_triangle n) {
    n.first = vec3(n.t.corner[0], n.t.corner[1], n.t.corner[2]);
    vec3 ab = vec3(n.t.corner[3], n.t.corner[4], n.t.corner[5]) - n.first;
    vec3 ac = vec3(n.t.corner[6], n.t.corner[7], n.t.corner[8]) - n.first;
    // Of a triangle that was cut off only the box is heeded.
    bool cut = any(greaterThanEqual(abs(n.middle) + n.half_size, vec3(FM_VOXEL_FAR)));
    vec3 left = ab.yzx * ac.zxy;
    vec3 right = ab.zxy * ac.yzx;
    n.normal = cut ? vec3(0) : left - right;
    n.normal_terms = abs(left) + abs(right);
    n.room = dot(abs(n.normal), n.extent) + length(n.normal * n.reach);
}

bool near_meets(near_triangle n, ivec3 block) {
    vec3 centre = vec3(block) + 0.5;
    vec3 gap = max(abs(centre - n.middle) - (n.half_size + n.extent), vec3(0)) / n.reach;
    vec3 at = centre - n.first;
    return dot(gap, gap) <= 1 && !(abs(dot(n.normal, at)) > n.room + 16 * FM_VOXEL_ULP * dot(n.normal_terms, abs(at)));
}

// Also by the normals of the edges. `n.t` has its axes.
bool near_meets_edges(near_triangle n, ivec3 block) {
    vec3 at = vec3(block) + 0.5 - n.first;
    bool apart = false;
    for (int a = 0; a < 3; a++) {
        int u = (a + 1) % 3;
        int v = (a + 2) % 3;
        for (int e = 0; e < 3; e++) {
            vec2 across = vec2(-n.t.edge[3 * e + v], n.t.edge[3 * e + u]);
            vec2 terms = across * vec2(at[u], at[v]);
            float product = terms.x + terms.y;
            float radius = dot(abs(across), vec2(n.extent[u], n.extent[v])) + length(across * vec2(n.reach[u], n.reach[v])) +
                           16 * FM_VOXEL_ULP * (abs(terms.x) + abs(terms.y));
            apart = apart || product < n.t.least[3 * a + e] - radius || product > n.t.most[3 * a + e] + radius;
        }
    }
    return !apart;
}

// Sets bits of a word of a row. Many triangles are near the same blocks: most find them set.
void near_set(int y, int z, uint word, uint bits) {
    fm_address at = push.bits + ((uint64_t(z) * push.grid.shape[1] + y) * push.row_words + word) * 4;
    if ((ref_u32(at).v & bits) != bits) {
        atomicOr(ref_u32(at).v, bits);
    }
}
