// SPDX-License-Identifier: MIT
// Contours around points, and around the triangles that touch a voxel.

#include "octree/voxel_contours.h"
#include "octree/voxels.h"
#include "shaders/include/octree_contours_rule.h"

#include <stdlib.h>
#include <string.h>

enum { AXES = 3, POLYGON = 10, MOST_POINTS = 256 };

// A cell that loses less than this is left as it is.
static const double most_left = 0.9;
// Where cells end: a little farther, so that what touches one by rounding alone has a part in it.
static const double beyond = 1 + 1e-6;
// The normal of less surface than this is rounding's.
static const double least_area = 1e-9;
// Beyond the triangles the planes go on, where a thin part of a surface is thin in more ways than one: other directions than that
// of its normal have to leave so much less.
static const double other_lead = 0.25;

// ---------------------------------------------------------------------------------------------------------------------------
// Planes
// ---------------------------------------------------------------------------------------------------------------------------

static void begin_pair(fm_planes *planes, const double way[3]) {
    const double longest = fmax(fabs(way[0]), fmax(fabs(way[1]), fabs(way[2])));
    for (int axis = 0; axis < 3; axis++) {
        planes->way[planes->count][axis] = (int32_t)lrint(way[axis] / longest * 31);
    }
    planes->low[planes->count] = INFINITY;
    planes->high[planes->count++] = -INFINITY;
}

void fm_planes_begin(fm_planes *planes, const double normal[3]) {
    static const double ways[][3] = {{1, 0, 0}, {0, 1, 0},  {0, 0, 1}, {1, 1, 0},  {1, -1, 0}, {1, 0, 1}, {1, 0, -1},
                                     {0, 1, 1}, {0, 1, -1}, {1, 1, 1}, {1, 1, -1}, {1, -1, 1}, {-1, 1, 1}};
    const bool turned = normal[0] != 0 || normal[1] != 0 || normal[2] != 0;
    const size_t count = turned ? AXES : sizeof ways / sizeof *ways;
    planes->count = 0;
    if (turned) {
        begin_pair(planes, normal);
    }
    for (size_t i = 0; i < count; i++) {
        begin_pair(planes, ways[i]);
    }
}

void fm_planes_hold(fm_planes *planes, const double (*points)[3], uint32_t count) {
    for (uint32_t s = 0; s < planes->count; s++) {
        const double x = planes->way[s][0] / 31.0, y = planes->way[s][1] / 31.0, z = planes->way[s][2] / 31.0;
        double low = planes->low[s], high = planes->high[s];
        for (uint32_t k = 0; k < count; k++) {
            const double at = x * points[k][0] + y * points[k][1] + z * points[k][2];
            low = at < low ? at : low;
            high = at > high ? at : high;
        }
        planes->low[s] = low;
        planes->high[s] = high;
    }
}

static double extent_of(const fm_planes *planes, uint32_t pair) {
    const int32_t *way = planes->way[pair];
    return (planes->high[pair] - planes->low[pair]) * 31 / (2 * (abs(way[0]) + abs(way[1]) + abs(way[2])));
}

uint32_t fm_planes_contour(const fm_planes *planes, double most, double lead) {
    uint32_t best = planes->count;
    for (uint32_t s = 0; s < planes->count; s++) {
        const double extent = extent_of(planes, s) + (s == 0 ? 0 : lead);
        if (extent <= most) {
            best = s;
            most = extent;
        }
    }
    if (best == planes->count) {
        return 0;
    }
    const int32_t *way = planes->way[best];
    const double step = (double)FM_CONTOUR_STEP, low = planes->low[best], high = planes->high[best];
    const int position = (int)fmin(63, fmax(-64, rint((low + high) / 2 / (2 * step))));
    const double middle = position * 2 * step;
    const int thickness = (int)ceil(fmax(high - middle, middle - low) / step + 1e-6);
    return (uint32_t)(thickness < 127 ? thickness : 127) | (uint32_t)(position + 64) << 7 | (uint32_t)(way[0] + 32) << 14 |
           (uint32_t)(way[1] + 32) << 20 | (uint32_t)(way[2] + 32) << 26;
}

void fm_contour_add_normal(const double added[3], double normal[3]) {
    const double along = added[0] * normal[0] + added[1] * normal[1] + added[2] * normal[2];
    for (int axis = 0; axis < 3; axis++) {
        normal[axis] += along < 0 ? -added[axis] : added[axis];
    }
}

uint32_t fm_contour_hull(uint32_t contour, double points[FM_HULL_POINTS][3]) {
    double n[3], product[8];
    for (int i = 0; i < 3; i++) {
        n[i] = contour ? fm_contour_normal(contour, i) / 31.0 : 0;
    }
    const double middle = contour ? (double)fm_contour_position(contour) : 0;
    const double half = contour ? (double)fm_contour_thickness(contour) : 1;
    uint32_t count = 0;
    for (int c = 0; c < 8; c++) {
        const double q[3] = {c & 1 ? 1 : -1, c & 2 ? 1 : -1, c & 4 ? 1 : -1};
        product[c] = n[0] * q[0] + n[1] * q[1] + n[2] * q[2] - middle;
        if (fabs(product[c]) <= half) {
            memcpy(points[count++], q, sizeof q);
        }
    }
    for (int edge = 0; edge < 12; edge++) {
        const int axis = edge / 4, u = edge & 1, v = edge >> 1 & 1;
        const int a = u << (axis + 1) % 3 | v << (axis + 2) % 3, b = a | 1 << axis;
        for (int side = -1; side <= 1; side += 2) {
            const double from = product[a] - side * half, to = product[b] - side * half;
            if ((from < 0) != (to < 0) && count < FM_HULL_POINTS) {
                points[count][axis] = -1 + 2 * from / (from - to);
                points[count][(axis + 1) % 3] = u ? 1 : -1;
                points[count++][(axis + 2) % 3] = v ? 1 : -1;
            }
        }
    }
    return count;
}

// ---------------------------------------------------------------------------------------------------------------------------
// Triangles
// ---------------------------------------------------------------------------------------------------------------------------

// Cuts off what is beyond a face of the cell. Source: Sutherland and Hodgman 1974, "Reentrant polygon clipping".
static uint32_t cut_face(const double (*from)[3], uint32_t count, int axis, double side, double (*to)[3]) {
    uint32_t kept = 0;
    for (uint32_t i = 0; i < count && kept + 2 <= POLYGON; i++) {
        const double *a = from[i], *b = from[i + 1 < count ? i + 1 : 0];
        const double in_a = beyond - side * a[axis], in_b = beyond - side * b[axis];
        if (in_a >= 0) {
            memcpy(to[kept++], a, 3 * sizeof *a);
        }
        if ((in_a < 0) != (in_b < 0)) {
            for (int i3 = 0; i3 < 3; i3++) {
                to[kept][i3] = a[i3] + (b[i3] - a[i3]) * (in_a / (in_a - in_b));
            }
            to[kept++][axis] = side * beyond;
        }
    }
    return kept;
}

// A triangle as a cell sees it.
static void in_cell(const fm_mesh *mesh, const fm_grid *grid, uint32_t triangle, const uint32_t cell[3], double (*corners)[3]) {
    for (int corner = 0; corner < 3; corner++) {
        for (int axis = 0; axis < 3; axis++) {
            const double at = (double)mesh->vertices[mesh->triangles[triangle][corner]][axis];
            corners[corner][axis] = 2 * ((at - grid->origin[axis]) / grid->spacing[axis] - cell[axis]);
        }
    }
}

// The part of a triangle in a cell, from -1 to 1 along each axis. `polygon` has room for POLYGON points.
static uint32_t part_in_cell(const fm_mesh *mesh, const fm_grid *grid, uint32_t triangle, const uint32_t cell[3],
                             double (*polygon)[3]) {
    double other[POLYGON][3];
    uint32_t count = 3;
    in_cell(mesh, grid, triangle, cell, polygon);
    for (int axis = 0; axis < 3 && count > 0; axis++) {
        const double a = polygon[0][axis], b = polygon[1][axis], c = polygon[2][axis];
        count = fmin(a, fmin(b, c)) > beyond || fmax(a, fmax(b, c)) < -beyond ? 0 : count;
    }
    for (int face = 0; face < 6 && count > 0; face++) {
        const int axis = face / 2;
        const double side = face % 2 ? 1 : -1;
        bool cut = false;
        for (uint32_t k = 0; k < count; k++) {
            cut = cut || side * polygon[k][axis] > beyond;
        }
        if (cut) {
            count = cut_face((const double(*)[3])polygon, count, axis, side, other);
            memcpy(polygon, other, count * sizeof *polygon);
        }
    }
    return count;
}

// A polygon's normal, as long as twice its area.
static void normal_of(const double (*polygon)[3], uint32_t count, double normal[3]) {
    memset(normal, 0, 3 * sizeof *normal);
    for (uint32_t i = 0; i < count; i++) {
        const double *a = polygon[i], *b = polygon[i + 1 < count ? i + 1 : 0];
        for (int axis = 0; axis < 3; axis++) {
            const int u = axis < 2 ? axis + 1 : 0, v = axis > 0 ? axis - 1 : 2;
            normal[axis] += a[u] * b[v] - a[v] * b[u];
        }
    }
}

// The mean normal of triangles that only touch the cell, as large as they are.
static void whole_normals(const fm_mesh *mesh, const fm_grid *grid, const fm_voxel_link *links, int32_t first, double normal[3]) {
    memset(normal, 0, 3 * sizeof *normal);
    for (int32_t i = first; i != FM_NO_LINK; i = links[i].next) {
        double corners[3][3], its[3];
        in_cell(mesh, grid, links[i].triangle, (const uint32_t[3]){0}, corners);
        normal_of((const double(*)[3])corners, 3, its);
        fm_contour_add_normal(its, normal);
    }
}

uint32_t fm_contour_fit(const fm_mesh *mesh, const fm_grid *grid, const uint32_t cell[3], const fm_voxel_link *links,
                        int32_t first) {
    double points[MOST_POINTS + POLYGON][3], normal[3] = {0}, its[3];
    uint32_t count = 0;
    int32_t rest = FM_NO_LINK;  // from here on there was no room for the points, which are made again
    for (int32_t i = first; i != FM_NO_LINK; i = links[i].next) {
        const uint32_t corners = part_in_cell(mesh, grid, links[i].triangle, cell, points + count);
        normal_of((const double(*)[3])points + count, corners, its);
        fm_contour_add_normal(its, normal);
        rest = rest == FM_NO_LINK && count + corners > MOST_POINTS ? i : rest;
        count += rest == FM_NO_LINK ? corners : 0;
    }
    if (fabs(normal[0]) + fabs(normal[1]) + fabs(normal[2]) < least_area) {
        whole_normals(mesh, grid, links, first, normal);
    }
    fm_planes planes;
    fm_planes_begin(&planes, normal);
    fm_planes_hold(&planes, (const double(*)[3])points, count);
    bool any = count > 0;
    for (int32_t i = rest; i != FM_NO_LINK; i = links[i].next) {
        count = part_in_cell(mesh, grid, links[i].triangle, cell, points);
        fm_planes_hold(&planes, (const double(*)[3])points, count);
        any = any || count > 0;
    }
    return any ? fm_planes_contour(&planes, most_left, other_lead) : 0;
}
