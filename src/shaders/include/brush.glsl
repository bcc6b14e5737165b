// SPDX-License-Identifier: MIT
// Whether an edit covers a voxel: as fm_brush_covers of world/brush.c, voxel for voxel. Expects memory.glsl.

#include "shared.h"

layout(buffer_reference, std430, buffer_reference_align = 8) readonly buffer ref_brush {
    fm_gpu_brush v;
};

const uint FM_BRUSH_SPHERE = 0;
const uint FM_BRUSH_BOX = 1;
const uint FM_BRUSH_LINE = 2;

int64_t dot_wide(ivec3 a, ivec3 b) {
    return int64_t(a.x) * b.x + int64_t(a.y) * b.y + int64_t(a.z) * b.z;
}

bool line_covers(ivec3 way, ivec3 d, int64_t radius2) {
    int64_t along = dot_wide(way, d);
    int64_t length2 = dot_wide(d, d);
    if (along <= 0) {
        return dot_wide(way, way) <= radius2;
    }
    if (along >= length2) {
        return dot_wide(way - d, way - d) <= radius2;
    }
    return dot_wide(way, way) * length2 - along * along <= radius2 * length2;
}

bool brush_covers(ref_brush brush, ivec3 at) {
    ivec3 begin = ivec3(brush.v.begin[0], brush.v.begin[1], brush.v.begin[2]);
    ivec3 end = ivec3(brush.v.end[0], brush.v.end[1], brush.v.end[2]);
    if (any(lessThan(at, begin)) || any(greaterThan(at, end))) {
        return false;
    }
    if (brush.v.kind == FM_BRUSH_BOX) {
        return true;
    }
    ivec3 from = ivec3(brush.v.from[0], brush.v.from[1], brush.v.from[2]);
    ivec3 way = at - from;
    int64_t radius2 = int64_t(brush.v.radius2);
    if (brush.v.kind == FM_BRUSH_SPHERE) {
        return dot_wide(way, way) <= radius2;
    }
    return line_covers(way, ivec3(brush.v.to[0], brush.v.to[1], brush.v.to[2]) - from, radius2);
}
