// SPDX-License-Identifier: MIT
// Generalised winding numbers by the moments of groups of triangles. Source: Barill et al. 2018, "Fast winding numbers for soups
// and clouds", with the terms of the area vectors and of their first moments about the group's centre. Expects memory.glsl,
// bvh.glsl.

const float FOUR_PI = 12.566370614359172;

// A child of a node: centre and radius, area vector and area, and the symmetric part of the first moments xx, yy, zz; xy, xz, yz.
// The radius is below 0 for a group without triangles, +infinity for one whose moments a float cannot hold.
struct moments {
    vec3 centre;
    float radius;
    vec3 vector;
    float area;
    vec3 even, odd;
};

fm_address moments_at(fm_address base, uint node, uint side) {
    return base + (uint64_t(node) * 2 + side) * FM_MOMENT_BYTES;
}

moments load_moments(fm_address base, uint node, uint side) {
    fm_address at = moments_at(base, node, side);
    vec4 v0 = uintBitsToFloat(ref_u32x4(at).v);
    vec4 v1 = uintBitsToFloat(ref_u32x4(at + 16).v);
    vec4 v2 = uintBitsToFloat(ref_u32x4(at + 32).v);
    vec2 v3 = uintBitsToFloat(ref_u32x2(at + 48).v);
    return moments(v0.xyz, v0.w, v1.xyz, v1.w, v2.xyz, vec3(v2.w, v3));
}

// The solid angle of a triangle as seen from the origin. Source: van Oosterom and Strackee 1983, "The solid angle of a plane
// triangle". Scaled, so that no product leaves a float's range.
float solid_angle(vec3 a, vec3 b, vec3 c) {
    vec3 most = max(max(abs(a), abs(b)), abs(c));
    float size = max(most.x, max(most.y, most.z));
    if (size == 0) {
        return 0;
    }
    a /= size;
    b /= size;
    c /= size;
    float volume = dot(a, cross(b - a, c - a));
    vec3 l = vec3(length(a), length(b), length(c));
    float beside = l.x * l.y * l.z + dot(a, b) * l.z + dot(b, c) * l.x + dot(c, a) * l.y;
    return volume == 0 && beside == 0 ? 0 : 2 * atan(volume, beside);
}

// What a group far from the origin adds to 4 pi times the winding number; `to` is the way to its centre.
float far_angle(moments m, vec3 to) {
    float inverse = inversesqrt(dot(to, to));
    vec3 way = to * inverse;
    float along = dot(m.even, way * way) + 2 * dot(m.odd, vec3(way.x * way.y, way.x * way.z, way.y * way.z));
    float curve = m.even.x + m.even.y + m.even.z - 3 * along;
    return (dot(m.vector, way) + curve * inverse) * inverse * inverse;
}

float winding_of_run(fm_address records, uint record, uint count, vec3 p) {
    float sum = 0;
    for (uint i = 0; i < count; i++) {
        vec3 a, b, c;
        if (bvh_record(records, record + i, a, b, c) != FM_GPU_NONE) {
            sum += solid_angle(a - p, b - p, c - p);
        }
    }
    return sum;
}

// Groups farther than `accuracy` times their radius count by their moments.
float winding_at(fm_mesh_refs m, fm_address base, vec3 p, float accuracy) {
    fm_address records = bvh_records(m);
    uint waiting[BVH_STACK];
    uint depth = 0;
    uint node = any(isnan(p)) || any(isinf(p)) ? FM_GPU_NONE : 0;
    float sum = 0;
    while (node != FM_GPU_NONE) {
        fm_address links = m.nodes + uint64_t(node) * FM_NODE_BYTES + 48;
        uvec4 link = ref_u32x4(links).v;
        uint next = FM_GPU_NONE;
        for (uint side = 0; side < 2; side++) {
            moments group = load_moments(base, node, side);
            vec3 to = group.centre - p;
            uint child = side == 0 ? link.x : link.y;
            uint count = side == 0 ? link.z : link.w;
            if (group.radius < 0) {
                continue;
            }
            if (length(to) > accuracy * group.radius) {
                sum += far_angle(group, to);
            } else if (count <= FM_LEAF_TRIANGLES) {
                sum += winding_of_run(records, child, count, p);
            } else if (next == FM_GPU_NONE) {
                next = child;
            } else {
                waiting[depth++] = child;
            }
        }
        node = next != FM_GPU_NONE ? next : depth > 0 ? waiting[--depth] : FM_GPU_NONE;
    }
    return sum / FOUR_PI;
}
