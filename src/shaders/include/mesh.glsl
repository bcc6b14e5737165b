// SPDX-License-Identifier: MIT
// Triangles of a mesh, one at a time: their corners and their nearest points. Expects memory.glsl.

#include "mesh_shared.h"

struct mesh_nearest {
    vec3 point;
    float distance2;  // +infinity: none
    uint triangle;    // FM_GPU_NONE likewise
    uint feature;     // fm_feature
};

const float MESH_INFINITY = 1.0 / 0.0;

vec3 mesh_vertex(fm_mesh_refs m, uint vertex) {
    fm_address at = m.vertices + uint64_t(vertex) * 12;
    return uintBitsToFloat(uvec3(ref_u32(at).v, ref_u32(at + 4).v, ref_u32(at + 8).v));
}

void mesh_corners(fm_mesh_refs m, uint triangle, out vec3 a, out vec3 b, out vec3 c) {
    fm_address at = m.triangles + uint64_t(triangle) * 12;
    a = mesh_vertex(m, ref_u32(at).v);
    b = mesh_vertex(m, ref_u32(at + 4).v);
    c = mesh_vertex(m, ref_u32(at + 8).v);
}

bool mesh_fits(vec3 p) {
    return abs(p.x) <= 1e18 && abs(p.y) <= 1e18 && abs(p.z) <= 1e18;
}

// fm_triangle_fits.
bool mesh_triangle_fits(vec3 a, vec3 b, vec3 c) {
    return mesh_fits(a) && mesh_fits(b) && mesh_fits(c);
}

// The nearest point of a segment, as seen from the origin: `point` is an offset. From the nearer end, so that an end that is far
// away does no harm.
void keep_segment(vec3 a, vec3 b, uint number, inout mesh_nearest best, inout float best_t) {
    vec3 e = b - a;
    float length2 = dot(e, e);
    float along = -dot(a, e);
    float t = along <= 0 ? 0 : along >= length2 ? 1 : along / length2;
    vec3 offset = t > 0.5 ? b + (t - 1) * e : a + t * e;
    float distance2 = dot(offset, offset);
    if (distance2 < best.distance2) {
        best.point = offset;
        best.distance2 = distance2;
        best.feature = t <= 0 ? FM_GPU_CORNER_0 + number : t >= 1 ? FM_GPU_CORNER_0 + (number + 1) % 3 : FM_GPU_EDGE_0 + number;
        best_t = t;
    }
}

// As seen from the origin. The nearest of the three edges comes first. The point's foot on the plane lies within the triangle if
// and only if it is on the inner side of that edge, at one of the edge's inner points; so the way inwards from there is all that is
// left to find. What is found is a point of the triangle however slim that is, and its error is that of the corners.
mesh_nearest origin_nearest(vec3 a, vec3 b, vec3 c) {
    mesh_nearest best;
    best.distance2 = MESH_INFINITY;
    best.triangle = FM_GPU_NONE;
    best.feature = FM_GPU_CORNER_0;
    best.point = a;
    float t = 0;
    keep_segment(a, b, 0, best, t);
    keep_segment(b, c, 1, best, t);
    keep_segment(c, a, 2, best, t);
    if (best.feature >= FM_GPU_CORNER_0) {
        return best;
    }
    vec3 first = best.feature == FM_GPU_EDGE_0 ? a : best.feature == FM_GPU_EDGE_0 + 1 ? b : c;
    vec3 second = best.feature == FM_GPU_EDGE_0 ? b : best.feature == FM_GPU_EDGE_0 + 1 ? c : a;
    vec3 third = best.feature == FM_GPU_EDGE_0 ? c : best.feature == FM_GPU_EDGE_0 + 1 ? a : b;
    vec3 edge = second - first;
    float third_t = dot(third - first, edge) / dot(edge, edge);
    vec3 inwards = (third - first) - third_t * edge;
    float height2 = dot(inwards, inwards);
    float s = -dot(best.point, inwards);
    if (!(s > 0) || !(height2 > 0)) {
        return best;
    }
    // How far the triangle reaches inwards at this place of the edge.
    float reach = t <= third_t ? t / third_t : (1 - t) / (1 - third_t);
    vec3 foot = best.point + min(s / height2, clamp(reach, 0.0, 1.0)) * inwards;
    float distance2 = dot(foot, foot);
    if (distance2 < best.distance2) {
        best.point = foot;
        best.distance2 = distance2;
        best.feature = FM_GPU_FACE;
    }
    return best;
}

// `triangle` is left unset. All is computed relative to p: a mesh far from the origin loses nothing.
mesh_nearest triangle_nearest(vec3 p, vec3 a, vec3 b, vec3 c) {
    mesh_nearest best = origin_nearest(a - p, b - p, c - p);
    best.point += p;
    return best;
}
