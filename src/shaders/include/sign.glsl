// SPDX-License-Identifier: MIT
// Normals of a triangle's features: its own, that of an edge by the triangles on both sides, that of a corner weighted by angles. A
// flat triangle, whose corners lie on a line, has none, and the triangle behind it takes its place. Expects memory.glsl, mesh.glsl.
// Source: Baerentzen and Aanaes 2005, "Signed distance computation using the angle weighted pseudonormal".

layout(buffer_reference, std430, buffer_reference_align = 8) readonly buffer ref_joints {
    fm_joints v;
};

const uint MOST_FLAT = 16;    // in a row
const float FLAT = 1e-6;      // height over length
const float HALF_TURN = 3.14159265;

uint joint_word(fm_address base, uint64_t i) {
    return ref_u32(base + i * 4).v;
}

// a b - c d with the error of one rounding. Source: Kahan; Jeannerod, Louvet and Muller 2013.
float product_difference(float a, float b, float c, float d) {
    precise float cd = c * d;
    precise float error = fma(-c, d, cd);
    precise float difference = fma(a, b, -cd);
    return difference + error;
}

vec3 exact_cross(vec3 a, vec3 b) {
    return vec3(product_difference(a.y, b.z, a.z, b.y), product_difference(a.z, b.x, a.x, b.z),
                product_difference(a.x, b.y, a.y, b.x));
}

// Scaled, so that no product leaves a float's range.
vec3 unit_or_zero(vec3 v) {
    vec3 size = abs(v);
    float most = max(size.x, max(size.y, size.z));
    return most > 0 ? normalize(v / most) : vec3(0);
}

struct corners3 {
    vec3 a, b, c;
};

corners3 load_corners(fm_mesh_refs m, uint triangle) {
    corners3 t;
    mesh_corners(m, triangle, t.a, t.b, t.c);
    return t;
}

// Of length 1, or 0 where the triangle is flat.
vec3 unit_normal(corners3 t) {
    vec3 ab = t.b - t.a;
    vec3 bc = t.c - t.b;
    vec3 ca = t.a - t.c;
    vec3 size = max(max(abs(ab), abs(bc)), abs(ca));
    float most = max(size.x, max(size.y, size.z));
    if (!(most > 0)) {
        return vec3(0);
    }
    vec3 n = exact_cross(ab / most, bc / most);
    return length(n) > FLAT ? normalize(n) : vec3(0);
}

bool is_zero(vec3 v) {
    return v == vec3(0);
}

uint longest_edge(corners3 t, uint except) {
    vec3 edges[3] = vec3[](t.b - t.a, t.c - t.b, t.a - t.c);
    uint longest = 0;
    float most = -1;
    for (uint k = 0; k < 3; k++) {
        float size = length(edges[k]);
        if (k != except && size > most) {
            most = size;
            longest = k;
        }
    }
    return longest;
}

// The normal of the first triangle with an area on the other side of an edge, 0 where there is none.
vec3 normal_across(fm_mesh_refs m, fm_joints j, uint triangle, uint edge) {
    uint next = joint_word(j.across, uint64_t(triangle) * 3 + edge);
    vec3 normal = vec3(0);
    for (uint i = 0; i <= MOST_FLAT && next != FM_GPU_NONE && is_zero(normal); i++) {
        corners3 t = load_corners(m, next);
        normal = unit_normal(t);
        uint entered = joint_word(j.across, uint64_t(next) * 3) == triangle       ? 0
                       : joint_word(j.across, uint64_t(next) * 3 + 1) == triangle ? 1
                                                                                  : 2;
        triangle = next;
        next = joint_word(j.across, uint64_t(next) * 3 + longest_edge(t, entered));
    }
    return normal;
}

// What a triangle adds to the normal of the position that its corner k has.
vec3 corner_share(fm_mesh_refs m, fm_joints j, uint triangle, uint k) {
    corners3 t = load_corners(m, triangle);
    if (!mesh_triangle_fits(t.a, t.b, t.c)) {
        return vec3(0);
    }
    vec3 normal = unit_normal(t);
    if (is_zero(normal)) {
        uint edge = longest_edge(t, 3);
        return (edge + 2) % 3 == k ? HALF_TURN * normal_across(m, j, triangle, edge) : vec3(0);
    }
    vec3 here = k == 0 ? t.a : k == 1 ? t.b : t.c;
    vec3 next = k == 0 ? t.b : k == 1 ? t.c : t.a;
    vec3 last = k == 0 ? t.c : k == 1 ? t.a : t.b;
    vec3 to = unit_or_zero(next - here);
    vec3 back = unit_or_zero(last - here);
    return atan(length(cross(to, back)), dot(to, back)) * normal;
}

vec3 pseudonormal(fm_mesh_refs m, fm_joints j, uint triangle, uint feature) {
    if (feature >= FM_GPU_CORNER_0) {
        uint place = joint_word(j.places, uint64_t(triangle) * 3 + feature - FM_GPU_CORNER_0);
        return uintBitsToFloat(ref_u32x4(j.normals + uint64_t(place) * 16).v.xyz);
    }
    vec3 normal = unit_normal(load_corners(m, triangle));
    return feature == FM_GPU_FACE ? normal : normal + normal_across(m, j, triangle, feature - FM_GPU_EDGE_0);
}
