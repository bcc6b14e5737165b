// SPDX-License-Identifier: MIT
#include "mesh/winding.h"

#include "mesh/winding_layout.h"

#include <float.h>
#include <string.h>

// Sums over triangles about a centre, with d the place relative to it and n the normal: of n, d_i n_j, d_i d_j n_k.
typedef struct moments {
    double area, centre[3];
    double zeroth[3], first[3][3], second[3][3][3];
} moments;

static double dot(const double a[3], const double b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

double fm_solid_angle(const fm_mesh *mesh, uint32_t triangle, const float position[3]) {
    double p[3][3], length[3], dots[3];
    for (int i = 0; i < 3; i++) {
        const float *corner = mesh->vertices[mesh->triangles[triangle][i]];
        for (int axis = 0; axis < 3; axis++) {
            p[i][axis] = (double)corner[axis] - position[axis];
        }
        length[i] = sqrt(dot(p[i], p[i]));
    }
    for (int i = 0; i < 3; i++) {
        dots[i] = dot(p[i], p[(i + 1) % 3]);
    }
    const double volume = p[0][0] * (p[1][1] * p[2][2] - p[1][2] * p[2][1]) + p[0][1] * (p[1][2] * p[2][0] - p[1][0] * p[2][2]) +
                          p[0][2] * (p[1][0] * p[2][1] - p[1][1] * p[2][0]);
    const double below = length[0] * length[1] * length[2] + dots[0] * length[2] + dots[1] * length[0] + dots[2] * length[1];
    // In the triangle's plane the solid angle jumps: the middle is 0.
    return volume == 0 ? 0 : 2 * atan2(volume, below);
}

// ---------------------------------------------------------------------------------------------------------------------------
// Moments
// ---------------------------------------------------------------------------------------------------------------------------

// Adds the moments of `from`, which are about another centre.
static void add_shifted(moments *to, const moments *from) {
    double d[3];
    for (int i = 0; i < 3; i++) {
        d[i] = from->centre[i] - to->centre[i];
    }
    for (int i = 0; i < 3; i++) {
        to->zeroth[i] += from->zeroth[i];
        for (int j = 0; j < 3; j++) {
            to->first[i][j] += from->first[i][j] + d[i] * from->zeroth[j];
            for (int k = 0; k < 3; k++) {
                to->second[i][j][k] +=
                    from->second[i][j][k] + d[i] * from->first[j][k] + d[j] * from->first[i][k] + d[i] * d[j] * from->zeroth[k];
            }
        }
    }
}

// Of one triangle about its own middle.
static moments of_triangle(const fm_mesh *mesh, uint32_t triangle) {
    moments m = {0};
    double corners[3][3];
    for (int k = 0; k < 3; k++) {
        const float *p = mesh->vertices[mesh->triangles[triangle][k]];
        for (int axis = 0; axis < 3; axis++) {
            m.centre[axis] += p[axis] / 3.0;
        }
    }
    for (int k = 0; k < 3; k++) {
        const float *p = mesh->vertices[mesh->triangles[triangle][k]];
        for (int axis = 0; axis < 3; axis++) {
            corners[k][axis] = p[axis] - m.centre[axis];
        }
    }
    for (int axis = 0; axis < 3; axis++) {
        const int y = (axis + 1) % 3, z = (axis + 2) % 3;
        for (int k = 0; k < 3; k++) {
            const double *a = corners[k], *b = corners[(k + 1) % 3];
            m.zeroth[axis] += 0.5 * (a[y] * b[z] - a[z] * b[y]);
        }
    }
    m.area = sqrt(dot(m.zeroth, m.zeroth));
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) {
            const double spread =
                (corners[0][i] * corners[0][j] + corners[1][i] * corners[1][j] + corners[2][i] * corners[2][j]) / 12;
            for (int k = 0; k < 3; k++) {
                m.second[i][j][k] = spread * m.zeroth[k];
            }
        }
    }
    return m;
}

// Of several, about the middle of their areas.
static moments sum_of(const moments *parts, int count) {
    moments sum = {0};
    double even[3] = {0};
    for (int i = 0; i < count; i++) {
        sum.area += parts[i].area;
        for (int axis = 0; axis < 3; axis++) {
            sum.centre[axis] += parts[i].area * parts[i].centre[axis];
            even[axis] += parts[i].centre[axis] / count;
        }
    }
    for (int axis = 0; axis < 3; axis++) {
        sum.centre[axis] = sum.area > 0 ? sum.centre[axis] / sum.area : even[axis];
    }
    for (int i = 0; i < count; i++) {
        add_shifted(&sum, &parts[i]);
    }
    return sum;
}

static moments of_leaf(const fm_mesh *mesh, const fm_bvh_leaf *leaf) {
    moments parts[FM_BVH_WIDTH];
    int count = 0;
    for (int k = 0; k < FM_BVH_WIDTH && (k == 0 || leaf->triangle[k] != leaf->triangle[k - 1]); k++) {
        parts[count++] = of_triangle(mesh, leaf->triangle[k]);
    }
    return sum_of(parts, count);
}

// ---------------------------------------------------------------------------------------------------------------------------
// Lanes
// ---------------------------------------------------------------------------------------------------------------------------

// As far as the farthest corner of the child's box.
static double radius_of(const fm_bvh_node *node, int lane, const double centre[3]) {
    double sum = 0;
    for (int axis = 0; axis < 3; axis++) {
        const double under = centre[axis] - node->low[axis][lane], over = node->high[axis][lane] - centre[axis];
        sum += fmax(under * under, over * over);
    }
    return sqrt(sum);
}

static void set_lane(fm_winding_lanes *lanes, int lane, const moments *m, double radius) {
    const double one = radius > 0 ? 1 / radius : 0, two = one * one, three = two * one, four = two * two;
    const double(*a)[3] = m->first;
    const double(*t)[3][3] = m->second;
    const double trace = a[0][0] + a[1][1] + a[2][2];
    static const int cross[3][2] = {{0, 1}, {1, 2}, {2, 0}};
    for (int i = 0; i < 3; i++) {
        lanes->centre[i][lane] = (float)m->centre[i];
        lanes->normal[i][lane] = (float)(two * m->zeroth[i]);
        // The trace goes with |u|^2 = 1.
        lanes->square[i][lane] = (float)(three * (trace - 3 * a[i][i]));
        const int p = cross[i][0], q = cross[i][1];
        lanes->square[3 + i][lane] = (float)(three * -3 * (a[p][q] + a[q][p]));
        double sum = 0;
        for (int j = 0; j < 3; j++) {
            sum += 2 * t[i][j][j] + t[j][j][i];
        }
        lanes->vector[i][lane] = (float)(four * -1.5 * sum);
    }
    lanes->radius[lane] = (float)radius;
    static const int cubes[10][3] = {{0, 0, 0}, {1, 1, 1}, {2, 2, 2}, {0, 0, 1}, {0, 0, 2},
                                     {1, 1, 0}, {1, 1, 2}, {2, 2, 0}, {2, 2, 1}, {0, 1, 2}};
    for (int n = 0; n < 10; n++) {
        const int i = cubes[n][0], j = cubes[n][1], k = cubes[n][2];
        // All different orders of the three axes; t does not tell its first two apart.
        const double sum = n < 3 ? t[i][i][i] : n < 9 ? t[i][i][k] + 2 * t[i][k][i] : 2 * (t[i][j][k] + t[j][k][i] + t[k][i][j]);
        lanes->cube[n][lane] = (float)(four * 7.5 * sum);
    }
}

static void fill(const fm_mesh *mesh, fm_winding_lanes *lanes, moments *totals) {
    const fm_bvh *bvh = mesh->bvh;
    static const moments none = {0};
    for (uint32_t i = bvh->node_count; i-- > 0;) {
        const fm_bvh_node *node = &bvh->nodes[i];
        moments parts[FM_BVH_WIDTH];
        int count = 0;
        for (int lane = 0; lane < FM_BVH_WIDTH; lane++) {
            const uint32_t child = node->child[lane];
            if (child == 0) {
                set_lane(&lanes[i], lane, &none, 0);
                continue;
            }
            parts[count] = child & FM_BVH_LEAF ? of_leaf(mesh, &bvh->leaves[child & ~FM_BVH_LEAF]) : totals[child];
            set_lane(&lanes[i], lane, &parts[count], radius_of(node, lane, parts[count].centre));
            count++;
        }
        totals[i] = sum_of(parts, count);
    }
}

void fm_winding_destroy(fm_context *context, fm_winding *winding) {
    if (winding) {
        fm_mesh_free(context, winding->nodes, winding->node_room * sizeof *winding->nodes);
        fm_mesh_free(context, winding, sizeof *winding);
    }
}

fm_result fm_winding_prepare(fm_mesh *mesh) {
    fm_context *context = mesh->context;
    FM_TRY(fm_bvh_prepare(mesh));
    if (mesh->winding && mesh->winding->version == mesh->version) {
        return FM_OK;
    }
    const uint32_t nodes = mesh->bvh->node_count;
    fm_winding *winding = fm_mesh_alloc_zero(context, sizeof *winding, "a mesh's winding numbers");
    if (!winding) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    winding->node_room = nodes;
    winding->nodes = fm_mesh_alloc(context, nodes * sizeof *winding->nodes, "a mesh's moments");
    moments *totals = fm_mesh_alloc(context, nodes * sizeof *totals, "a mesh's moments");
    if (!winding->nodes || !totals) {
        fm_mesh_free(context, totals, nodes * sizeof *totals);
        fm_winding_destroy(context, winding);
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    fill(mesh, winding->nodes, totals);
    fm_mesh_free(context, totals, nodes * sizeof *totals);
    winding->version = mesh->version;
    fm_winding_destroy(context, mesh->winding);
    mesh->winding = winding;
    return FM_OK;
}

float fm_winding_at(const fm_mesh *mesh, const float position[3], float accuracy) {
    if (mesh->bvh->node_count == 0 || !fm_coordinate_fits(position[0]) || !fm_coordinate_fits(position[1]) ||
        !fm_coordinate_fits(position[2])) {
        return 0;
    }
    return (float)(mesh->bvh->kernels->winding(mesh, position, accuracy) / (4 * 3.14159265358979323846));
}
