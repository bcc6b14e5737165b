// SPDX-License-Identifier: MIT
#version 460
#include "memory.glsl"
#include "sdf.glsl"

// The texels of listed blocks of 4^3: exact distances with their sign. A group owns a block, an invocation a texel. Writes 4 bytes
// a texel, and 4 for its triangle; reads 16 bytes a block and what the walk visits.

layout(local_size_x = 64) in;

void do_texel(ivec3 at, vec3 centre, block_state block) {
    vec3 p = texel_place(vec3(at));
    // Beyond the band only the side counts. There it is that of the centre, if that is nearer than the band is wide: no surface
    // comes between. So the walk need not go beyond the band.
    bool bounded = FAR == FAR_BAND && (SIGN == FM_SDF_UNSIGNED || (SIGN == FM_SDF_PSEUDONORMAL || CLOSED) &&
                                                                      distance(p, centre) < 0.9999 * band());
    float limit = bounded ? band() * 1.00001 : MESH_INFINITY;
    mesh_nearest n = bvh_nearest_below(push.mesh, block.node, p, limit * limit, block.triangle);
    float value = sqrt(n.distance2);
    // No surface between this texel and the centre: they are on one side.
    bool with_centre = SIGN != FM_SDF_UNSIGNED && (bounded && n.triangle == FM_GPU_NONE ||
                                                   SIGN == FM_SDF_WINDING && CLOSED &&
                                                       distance(p, centre) < 0.9999 * max(value, block.distance));
    bool inside = with_centre ? (block.flags & BLOCK_INSIDE) != 0 : is_inside(p, n);
    bool within = value <= band();
    if (FAR == FAR_BAND) {
        value = min(value, band());
    }
    ivec3 size = field_size();
    uint64_t element = (uint64_t(at.z) * size.y + at.y) * size.x + at.x;
    ref_u32(push.distance + element * 4).v = floatBitsToUint(inside ? -value : value);
    if (push.triangles != 0) {
        ref_u32(push.triangles + element * 4).v = within ? n.triangle : FM_GPU_NONE;
    }
}

void main() {
    uint count = list_count(push.scratch + FM_SDF_LIST_MIDDLE);
    for (uint i = gl_WorkGroupID.x; i < count; i += gl_NumWorkGroups.x) {
        uint block = ref_u32(entries_of(false) + uint64_t(i) * 4).v;
        ivec3 first = coarse_first(block / 64) + child_first(block % 64, FM_SDF_MIDDLE);
        ivec3 last = min(first + FM_SDF_MIDDLE, field_size()) - 1;
        ivec3 at = first + child_first(gl_LocalInvocationIndex, 1);
        if (all(lessThan(at, field_size()))) {
            do_texel(at, texel_place(0.5 * vec3(first + last)), load_state(false, block));
        }
    }
}
