// SPDX-License-Identifier: MIT
#include "mesh/winding.h"

fm_result fm_winding_prepare(fm_mesh *mesh) {
    (void)mesh;
    return FM_OK;
}

void fm_winding_destroy(const fm_allocator *allocator, fm_winding *winding) {
    (void)allocator;
    (void)winding;
}

// Source: van Oosterom and Strackee 1983, "The solid angle of a plane triangle".
static double solid_angle(const fm_mesh *mesh, uint32_t triangle, const float position[3]) {
    double p[3][3], length[3];
    for (int i = 0; i < 3; i++) {
        const float *corner = mesh->vertices[mesh->triangles[triangle][i]];
        for (int axis = 0; axis < 3; axis++) {
            p[i][axis] = (double)corner[axis] - position[axis];
        }
        length[i] = sqrt(p[i][0] * p[i][0] + p[i][1] * p[i][1] + p[i][2] * p[i][2]);
    }
    double dots[3];
    for (int i = 0; i < 3; i++) {
        const double *a = p[i], *b = p[(i + 1) % 3];
        dots[i] = a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    }
    const double volume = p[0][0] * (p[1][1] * p[2][2] - p[1][2] * p[2][1]) + p[0][1] * (p[1][2] * p[2][0] - p[1][0] * p[2][2]) +
                          p[0][2] * (p[1][0] * p[2][1] - p[1][1] * p[2][0]);
    return 2 * atan2(volume, length[0] * length[1] * length[2] + dots[0] * length[2] + dots[1] * length[0] + dots[2] * length[1]);
}

float fm_winding_at(const fm_mesh *mesh, const float position[3], float accuracy) {
    (void)accuracy;
    double sum = 0;
    for (uint64_t i = 0; i < mesh->triangle_count; i++) {
        sum += fm_triangle_fits(mesh, i) ? solid_angle(mesh, (uint32_t)i, position) : 0;
    }
    return (float)(sum / (4 * 3.14159265358979323846));
}
