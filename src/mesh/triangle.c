// SPDX-License-Identifier: MIT
#include "mesh/triangle.h"

// Everything is relative to the query point, so that a mesh far from the origin loses nothing; differences of floats, their
// products and sums of those are exact enough in doubles for slivers too. Where the point lies above the triangle its foot is the
// nearest; elsewhere, and where a sliver's normal may be off, the nearest of three segments as well. A triangle without area needs
// no case of its own.

static double dot(const double a[3], const double b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void cross(const double a[3], const double b[3], double c[3]) {
    c[0] = a[1] * b[2] - a[2] * b[1];
    c[1] = a[2] * b[0] - a[0] * b[2];
    c[2] = a[0] * b[1] - a[1] * b[0];
}

static void keep_nearer(fm_point_on_triangle *best, const double offset[3], fm_feature feature) {
    const double distance2 = dot(offset, offset);
    if (distance2 < best->distance2) {
        best->distance2 = distance2;
        best->feature = feature;
        for (int axis = 0; axis < 3; axis++) {
            best->offset[axis] = offset[axis];
        }
    }
}

static void segment_nearest(const double a[3], const double edge[3], int number, fm_point_on_triangle *best) {
    const double length2 = dot(edge, edge), along = -dot(a, edge);
    const double t = along <= 0 ? 0 : along >= length2 ? 1 : along / length2;
    const double offset[3] = {a[0] + t * edge[0], a[1] + t * edge[1], a[2] + t * edge[2]};
    keep_nearer(best, offset,
                t <= 0   ? (fm_feature)(FM_FEATURE_CORNER_0 + number)
                : t >= 1 ? (fm_feature)(FM_FEATURE_CORNER_0 + (number + 1) % 3)
                         : (fm_feature)(FM_FEATURE_EDGE_0 + number));
}

// The foot on the plane, if it lies within the triangle; true when nothing else can be nearer.
static bool face_nearest(double corners[3][3], double edges[3][3], fm_point_on_triangle *best) {
    double normal[3], side[3];
    cross(edges[0], edges[1], normal);
    const double length2 = dot(normal, normal);
    if (!(length2 > 0)) {
        return false;
    }
    for (int i = 0; i < 3; i++) {
        cross(corners[i], edges[i], side);
        if (dot(side, normal) <= 0) {
            return false;
        }
    }
    const double height = dot(corners[0], normal) / length2;
    const double offset[3] = {height * normal[0], height * normal[1], height * normal[2]};
    keep_nearer(best, offset, FM_FEATURE_FACE);
    return length2 > 1e-20 * dot(edges[0], edges[0]) * dot(edges[1], edges[1]);
}

fm_point_on_triangle fm_point_nearest(const float *const corners[3], const float position[3]) {
    double relative[3][3], edges[3][3];
    for (int i = 0; i < 3; i++) {
        for (int axis = 0; axis < 3; axis++) {
            relative[i][axis] = (double)corners[i][axis] - position[axis];
            edges[i][axis] = (double)corners[(i + 1) % 3][axis] - corners[i][axis];
        }
    }
    fm_point_on_triangle best = {.distance2 = INFINITY};
    if (!face_nearest(relative, edges, &best)) {
        for (int i = 0; i < 3; i++) {
            segment_nearest(relative[i], edges[i], i, &best);
        }
    }
    return best;
}

fm_point_on_triangle fm_triangle_point(const fm_mesh *mesh, uint32_t triangle, const float position[3]) {
    const uint32_t *corners = mesh->triangles[triangle];
    const float *const points[3] = {mesh->vertices[corners[0]], mesh->vertices[corners[1]], mesh->vertices[corners[2]]};
    return fm_point_nearest(points, position);
}

fm_nearest fm_triangle_nearest(const fm_mesh *mesh, uint32_t triangle, const float position[3]) {
    const fm_point_on_triangle found = fm_triangle_point(mesh, triangle, position);
    fm_nearest nearest = {.distance2 = (float)found.distance2, .triangle = triangle, .feature = found.feature};
    for (int axis = 0; axis < 3; axis++) {
        nearest.point[axis] = (float)(position[axis] + found.offset[axis]);
    }
    return nearest;
}

bool fm_ray_shear(const fm_mesh_ray *ray, fm_sheared_ray *sheared) {
    int longest = 0;
    for (int axis = 0; axis < 3; axis++) {
        if (!fm_coordinate_fits(ray->origin[axis]) || !isfinite(ray->direction[axis])) {
            return false;
        }
        longest = fabsf(ray->direction[axis]) > fabsf(ray->direction[longest]) ? axis : longest;
    }
    const double along = ray->direction[longest];
    if (along == 0 || !(ray->first <= ray->last)) {
        return false;
    }
    // The handedness stays, so that the sign of an area tells the side.
    const int next = (longest + (along < 0 ? 2 : 1)) % 3;
    *sheared = (fm_sheared_ray){.axes = {next, 3 - longest - next, longest}, .first = ray->first, .last = ray->last};
    for (int axis = 0; axis < 3; axis++) {
        sheared->origin[axis] = ray->origin[sheared->axes[axis]];
    }
    sheared->shear[0] = ray->direction[sheared->axes[0]] / along;
    sheared->shear[1] = ray->direction[sheared->axes[1]] / along;
    sheared->shear[2] = 1 / along;
    return true;
}

void fm_ray_keep(const fm_sheared_ray *ray, uint32_t triangle, const double weights[3], const double along[3], fm_mesh_hit *hit) {
    const double sum = weights[0] + weights[1] + weights[2];
    if (sum == 0) {
        return;
    }
    const float t = (float)(dot(weights, along) / sum * ray->shear[2]);
    if (t >= ray->first && t <= ray->last && t < hit->t) {
        *hit = (fm_mesh_hit){t, triangle, (float)(weights[1] / sum), (float)(weights[2] / sum), sum < 0};
    }
}
