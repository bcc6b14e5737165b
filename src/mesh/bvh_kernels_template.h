// SPDX-License-Identifier: MIT
// The queries, compiled once an instruction set: loops over eight lanes become vectors. No sum is contracted, so that all sets find
// the same. KERNEL(name) names them.

#include "mesh/bvh_layout.h"
#include "mesh/triangle.h"

#if defined(__SSE2__)
#include <immintrin.h>
#endif

typedef struct visit {
    float near;  // lower bound of what lies in the child
    uint32_t child;
} visit;

// The lanes that are below the bound, as bits.
static inline uint32_t below(const float values[FM_BVH_WIDTH], float bound) {
#if defined(__AVX__)
    return (uint32_t)_mm256_movemask_ps(_mm256_cmp_ps(_mm256_loadu_ps(values), _mm256_set1_ps(bound), _CMP_LT_OQ));
#elif defined(__SSE2__)
    const __m128 all = _mm_set1_ps(bound);
    const int first = _mm_movemask_ps(_mm_cmplt_ps(_mm_loadu_ps(values), all));
    return (uint32_t)(first | _mm_movemask_ps(_mm_cmplt_ps(_mm_loadu_ps(values + 4), all)) << 4);
#else
    uint32_t bits = 0;
    for (int i = 0; i < FM_BVH_WIDTH; i++) {
        bits |= (uint32_t)(values[i] < bound) << i;
    }
    return bits;
#endif
}

// Puts the children whose bits are set on the stack, the nearest on top.
static inline int push(visit *stack, int depth, const float *near, const uint32_t *children, uint32_t bits) {
    const int first = depth;
    for (; bits; bits &= bits - 1) {
        const int lane = __builtin_ctz(bits);
        int at = depth++;
        for (; at > first && stack[at - 1].near < near[lane]; at--) {
            stack[at] = stack[at - 1];
        }
        stack[at] = (visit){near[lane], children[lane]};
    }
    return depth;
}

// ---------------------------------------------------------------------------------------------------------------------------
// Nearest
// ---------------------------------------------------------------------------------------------------------------------------

static inline void box_distances(const fm_bvh_node *node, const float p[3], float *restrict distance2) {
    for (int i = 0; i < FM_BVH_WIDTH; i++) {
        float sum = 0;
        for (int axis = 0; axis < 3; axis++) {
            const float under = node->low[axis][i] - p[axis], over = p[axis] - node->high[axis][i];
            float beside = under > over ? under : over;
            beside = beside > 0 ? beside : 0;
            sum += beside * beside;
        }
        distance2[i] = sum;
    }
}

static inline float clamped(float x, float most) {
    x = x > 0 ? x : 0;
    return x < most ? x : most;
}

static inline float least(float a, float b) {
    return a < b ? a : b;
}

static inline void leaf_distances(const fm_bvh_leaf *leaf, const float p[3], float *restrict distance2) {
    for (int i = 0; i < FM_BVH_WIDTH; i++) {
        const float dx = p[0] - leaf->corner[0][i], dy = p[1] - leaf->corner[1][i], dz = p[2] - leaf->corner[2][i];
        const float x = leaf->x[0][i] * dx + leaf->x[1][i] * dy + leaf->x[2][i] * dz;
        const float y = leaf->y[0][i] * dx + leaf->y[1][i] * dy + leaf->y[2][i] * dz;
        const float height = leaf->normal[0][i] * dx + leaf->normal[1][i] * dy + leaf->normal[2][i] * dz;
        const float base = leaf->base[i], cx = leaf->cx[i], cy = leaf->cy[i];

        const float beside = x - clamped(x, base);
        const float to_base = beside * beside + y * y;

        const float along_ca = clamped((x * cx + y * cy) * leaf->over_ca[i], 1);
        const float cax = x - along_ca * cx, cay = y - along_ca * cy;
        const float to_ca = cax * cax + cay * cay;

        const float bx = x - base, bcx = cx - base;
        const float along_cb = clamped((bx * bcx + y * cy) * leaf->over_cb[i], 1);
        const float cbx = bx - along_cb * bcx, cby = y - along_cb * cy;
        const float to_cb = cbx * cbx + cby * cby;

        const float border = least(to_base, least(to_ca, to_cb));
        const float side = least(y, least(cy * x - cx * y, bcx * y - cy * bx));
        distance2[i] = (side > 0 ? 0 : border) + height * height;
    }
}

static void KERNEL(nearest)(const fm_bvh *bvh, const float position[3], float *distance2, uint32_t *triangle) {
    visit stack[FM_BVH_STACK];
    float found[FM_BVH_WIDTH];
    const float p[3] = {position[0], position[1], position[2]};
    float best = *distance2;
    int depth = 0;
    stack[depth++] = (visit){0, 0};
    while (depth > 0) {
        const visit here = stack[--depth];
        if (!(here.near < best)) {
            continue;
        }
        if (!(here.child & FM_BVH_LEAF)) {
            const fm_bvh_node *node = &bvh->nodes[here.child];
            box_distances(node, p, found);
            depth = push(stack, depth, found, node->child, below(found, best));
            continue;
        }
        const fm_bvh_leaf *leaf = &bvh->leaves[here.child & ~FM_BVH_LEAF];
        leaf_distances(leaf, p, found);
        for (uint32_t bits = below(found, best); bits; bits &= bits - 1) {
            const int lane = __builtin_ctz(bits);
            if (found[lane] < best) {
                best = found[lane];
                *triangle = leaf->triangle[lane];
            }
        }
    }
    *distance2 = best;
}

// ---------------------------------------------------------------------------------------------------------------------------
// Rays
// ---------------------------------------------------------------------------------------------------------------------------

typedef struct slabs {
    float origin[3], inverse[3];
    float scale;  // of times: the longest component of the direction becomes 1 to 2, so that none overflows
    bool falling[3];
} slabs;

static inline slabs make_slabs(const fm_mesh_ray *ray) {
    slabs made;
    const float longest = fmaxf(fabsf(ray->direction[0]), fmaxf(fabsf(ray->direction[1]), fabsf(ray->direction[2])));
    int exponent;
    frexpf(longest, &exponent);
    for (int axis = 0; axis < 3; axis++) {
        made.origin[axis] = ray->origin[axis];
        made.inverse[axis] = 1 / ldexpf(ray->direction[axis], 1 - exponent);
        made.falling[axis] = signbit(ray->direction[axis]);
    }
    made.scale = ldexpf(1, exponent - 1);
    return made;
}

// When the ray enters each box, or infinity. Where it runs along a slab the product may be no number: it then does not count.
static inline void box_times(const fm_bvh_node *node, const slabs *ray, float first, float last, float *restrict enter) {
    const float *near[3], *far[3];
    for (int axis = 0; axis < 3; axis++) {
        near[axis] = ray->falling[axis] ? node->high[axis] : node->low[axis];
        far[axis] = ray->falling[axis] ? node->low[axis] : node->high[axis];
    }
    const float x = ray->origin[0], y = ray->origin[1], z = ray->origin[2];
    const float ix = ray->inverse[0], iy = ray->inverse[1], iz = ray->inverse[2];
    for (int i = 0; i < FM_BVH_WIDTH; i++) {
        const float nx = (near[0][i] - x) * ix, ny = (near[1][i] - y) * iy, nz = (near[2][i] - z) * iz;
        const float fx = (far[0][i] - x) * ix, fy = (far[1][i] - y) * iy, fz = (far[2][i] - z) * iz;
        float from = nx > first ? nx : first, to = fx < last ? fx : last;
        from = ny > from ? ny : from;
        to = fy < to ? fy : to;
        from = nz > from ? nz : from;
        to = fz < to ? fz : to;
        // Each time has three roundings.
        to = to > 0 ? to * (1 + 1e-6f) : to * (1 - 1e-6f);
        enter[i] = from <= to ? from : INFINITY;
    }
}

// Source: Woop, Benthin and Wald 2013, in doubles. Which side of an edge the ray passes is the same number, but for its sign, for
// both triangles of the edge: their corners are the same doubles after the shear, and products are not contracted.
static void hit_leaf(const fm_mesh *mesh, const fm_bvh_leaf *leaf, const fm_sheared_ray *ray, fm_mesh_hit *hit) {
    double x[3][FM_BVH_WIDTH], y[3][FM_BVH_WIDTH], z[3][FM_BVH_WIDTH], weights[3][FM_BVH_WIDTH];
    float sides[FM_BVH_WIDTH];
    for (int i = 0; i < FM_BVH_WIDTH; i++) {
        const uint32_t *corners = mesh->triangles[leaf->triangle[i]];
        for (int k = 0; k < 3; k++) {
            const float *p = mesh->vertices[corners[k]];
            x[k][i] = p[ray->axes[0]];
            y[k][i] = p[ray->axes[1]];
            z[k][i] = p[ray->axes[2]];
        }
    }
    for (int k = 0; k < 3; k++) {
        for (int i = 0; i < FM_BVH_WIDTH; i++) {
            z[k][i] -= ray->origin[2];
            x[k][i] = (x[k][i] - ray->origin[0]) - ray->shear[0] * z[k][i];
            y[k][i] = (y[k][i] - ray->origin[1]) - ray->shear[1] * z[k][i];
        }
    }
    for (int i = 0; i < FM_BVH_WIDTH; i++) {
        const double u = x[2][i] * y[1][i] - y[2][i] * x[1][i], v = x[0][i] * y[2][i] - y[0][i] * x[2][i];
        const double w = x[1][i] * y[0][i] - y[1][i] * x[0][i];
        weights[0][i] = u;
        weights[1][i] = v;
        weights[2][i] = w;
        const double low = u < v ? (u < w ? u : w) : (v < w ? v : w), high = u > v ? (u > w ? u : w) : (v > w ? v : w);
        sides[i] = low < 0 && high > 0 ? 1.0f : 0.0f;
    }
    for (uint32_t bits = below(sides, 0.5f); bits; bits &= bits - 1) {
        const int i = __builtin_ctz(bits);
        const double u = weights[0][i], v = weights[1][i], w = weights[2][i];
        fm_ray_keep(ray, leaf->triangle[i], (const double[3]){u, v, w}, (const double[3]){z[0][i], z[1][i], z[2][i]}, hit);
    }
}

static fm_mesh_hit KERNEL(cast)(const fm_mesh *mesh, const fm_mesh_ray *ray, bool any) {
    const fm_bvh *bvh = mesh->bvh;
    fm_mesh_hit hit = {.t = INFINITY, .triangle = FM_NO_TRIANGLE};
    fm_sheared_ray sheared;
    visit stack[FM_BVH_STACK];
    float enter[FM_BVH_WIDTH];
    if (!fm_ray_shear(ray, &sheared)) {
        return hit;
    }
    const slabs box_ray = make_slabs(ray);
    const float first = ray->first * box_ray.scale;
    float last = ray->last * box_ray.scale;
    int depth = 0;
    stack[depth++] = (visit){first, 0};
    while (depth > 0) {
        const visit here = stack[--depth];
        if (here.near > last) {
            continue;
        }
        if (!(here.child & FM_BVH_LEAF)) {
            const fm_bvh_node *node = &bvh->nodes[here.child];
            box_times(node, &box_ray, first, last, enter);
            depth = push(stack, depth, enter, node->child, below(enter, INFINITY));
            continue;
        }
        hit_leaf(mesh, &bvh->leaves[here.child & ~FM_BVH_LEAF], &sheared, &hit);
        if (hit.triangle != FM_NO_TRIANGLE) {
            if (any) {
                return hit;
            }
            last = least(last, (hit.t + fabsf(hit.t) * 1e-6f) * box_ray.scale);
        }
    }
    return hit;
}

#include "mesh/winding_template.h"

const fm_bvh_kernels KERNEL(fm_bvh_kernels) = {KERNEL(nearest), KERNEL(cast), KERNEL(winding)};
