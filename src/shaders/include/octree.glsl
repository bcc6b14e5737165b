// SPDX-License-Identifier: MIT
// What kernels that go through octrees share: the head in memory, and which kind of octree they are compiled for.

#include "memory.glsl"
#include "octree_cast_rule.h"

layout(constant_id = 0) const uint KIND = FM_GPU_CLOSEST;
layout(constant_id = 1) const uint CODE = FM_GPU_SPHERICAL;
layout(constant_id = 2) const uint STEPPED = 0;

layout(buffer_reference, std430, buffer_reference_align = 8) buffer ref_head {
    fm_octree_head v;
};

fm_octree_head octree_head(fm_address at) {
    fm_octree_head head = ref_head(at).v;
    head.kind = int(KIND);
    head.code = int(CODE);
    head.stepped = int(STEPPED);
    return head;
}
