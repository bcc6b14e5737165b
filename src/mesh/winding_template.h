// SPDX-License-Identifier: MIT
// The winding number at a position, compiled once an instruction set: bvh_kernels_template.h includes it.

#include "mesh/winding_layout.h"

// Where a child counts as far its sum, elsewhere 0; `near` is what is left to look into.
static inline void winding_of_far(const fm_winding_lanes *lanes, const float p[3], float accuracy, float *restrict sums,
                                  float *restrict near) {
    for (int i = 0; i < FM_BVH_WIDTH; i++) {
        const float dx = lanes->centre[0][i] - p[0], dy = lanes->centre[1][i] - p[1], dz = lanes->centre[2][i] - p[2];
        const float distance = sqrtf(dx * dx + dy * dy + dz * dz);
        const float over = 1 / distance, s = lanes->radius[i] * over;
        const float x = dx * over, y = dy * over, z = dz * over;
        const float linear = lanes->normal[0][i] * x + lanes->normal[1][i] * y + lanes->normal[2][i] * z;
        const float square = lanes->square[0][i] * x * x + lanes->square[1][i] * y * y + lanes->square[2][i] * z * z +
                             lanes->square[3][i] * x * y + lanes->square[4][i] * y * z + lanes->square[5][i] * z * x;
        const float cube = x * x * (lanes->cube[0][i] * x + lanes->cube[3][i] * y + lanes->cube[4][i] * z) +
                           y * y * (lanes->cube[1][i] * y + lanes->cube[5][i] * x + lanes->cube[6][i] * z) +
                           z * z * (lanes->cube[2][i] * z + lanes->cube[7][i] * x + lanes->cube[8][i] * y) +
                           lanes->cube[9][i] * x * y * z;
        const float vector = lanes->vector[0][i] * x + lanes->vector[1][i] * y + lanes->vector[2][i] * z;
        const bool far = distance > accuracy * lanes->radius[i];
        sums[i] = far ? s * s * (linear + s * (square + s * (cube + vector))) : 0;
        near[i] = far ? 1.0f : 0.0f;
    }
}

static double KERNEL(winding)(const fm_mesh *mesh, const float position[3], float accuracy) {
    const fm_bvh *bvh = mesh->bvh;
    uint32_t stack[FM_BVH_STACK];
    float sums[FM_BVH_WIDTH], near[FM_BVH_WIDTH];
    double total = 0;
    int depth = 0;
    stack[depth++] = 0;
    while (depth > 0) {
        const uint32_t here = stack[--depth];
        winding_of_far(&mesh->winding->nodes[here], position, accuracy, sums, near);
        for (int i = 0; i < FM_BVH_WIDTH; i++) {
            total += sums[i];
        }
        for (uint32_t bits = below(near, 0.5f); bits; bits &= bits - 1) {
            const int lane = __builtin_ctz(bits);
            const uint32_t child = bvh->nodes[here].child[lane];
            if (!(child & FM_BVH_LEAF)) {
                // Unused lanes name the root, which is nobody's child.
                stack[depth] = child;
                depth += child != 0;
                continue;
            }
            const fm_bvh_leaf *leaf = &bvh->leaves[child & ~FM_BVH_LEAF];
            for (int k = 0; k < FM_BVH_WIDTH && (k == 0 || leaf->triangle[k] != leaf->triangle[k - 1]); k++) {
                total += fm_solid_angle(mesh, leaf->triangle[k], position);
            }
        }
    }
    return total;
}
