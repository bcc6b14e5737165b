// SPDX-License-Identifier: MIT
// Voxels of meshes on the CPU against triangles cut by the voxels' boxes in double precision, paths through voxels that are not
// set, and winding numbers.

#include "check.h"
#include "fathom/sdf.h"
#include "mesh_oracle.h"

#include <stdlib.h>
#include <string.h>

static fm_context *context;

static const double SLACK = 1e-6;  // voxels; contacts nearer than this may go either way

enum { MOST_CORNERS = 16 };

// Cuts the polygon by the half space sign * coordinate <= bound.
static int cut(double polygon[MOST_CORNERS][3], int count, int axis, double sign, double bound) {
    double result[MOST_CORNERS][3];
    int left = 0;
    for (int i = 0; i < count; i++) {
        const double *a = polygon[i], *b = polygon[(i + 1) % count];
        const double at = sign * a[axis] - bound, next = sign * b[axis] - bound;
        if (at <= 0) {
            memcpy(result[left++], a, sizeof *result);
        }
        if ((at < 0 && next > 0) || (at > 0 && next < 0)) {
            for (int k = 0; k < 3; k++) {
                result[left][k] = a[k] + (b[k] - a[k]) * (at / (at - next));
            }
            left++;
        }
    }
    memcpy(polygon, result, (size_t)left * sizeof *result);
    return left;
}

// Whether the triangle, in the grid's units, reaches into the box around (x, y, z).
static bool reaches(const double triangle[3][3], const double centre[3], const double half[3]) {
    double polygon[MOST_CORNERS][3];
    int count = 3;
    memcpy(polygon, triangle, 3 * sizeof *polygon);
    for (int axis = 0; axis < 3 && count > 0; axis++) {
        count = cut(polygon, count, axis, 1, centre[axis] + half[axis]);
        count = count > 0 ? cut(polygon, count, axis, -1, half[axis] - centre[axis]) : 0;
    }
    return count > 0;
}

// Whether it surely crosses the voxel's middle line along the axis.
static bool crosses(const double t[3][3], const double centre[3], int axis) {
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    double weight[3], sum = 0, at = 0;
    for (int i = 0; i < 3; i++) {
        const double *a = t[(i + 1) % 3], *b = t[(i + 2) % 3];
        weight[i] = (a[u] - centre[u]) * (b[v] - centre[v]) - (a[v] - centre[v]) * (b[u] - centre[u]);
        sum += weight[i];
    }
    if (fabs(sum) < 1e-9) {
        return false;
    }
    for (int i = 0; i < 3; i++) {
        if (weight[i] / sum < SLACK) {
            return false;
        }
        at += weight[i] / sum * t[i][axis];
    }
    return fabs(at - centre[axis]) < 0.5 - SLACK;
}

static void triangle_of(const scene_mesh *shape, const fm_volume_desc *grid, uint64_t i, double t[3][3]) {
    for (int corner = 0; corner < 3; corner++) {
        for (int axis = 0; axis < 3; axis++) {
            t[corner][axis] =
                ((double)shape->vertices[shape->triangles[i][corner]][axis] - grid->origin[axis]) / grid->spacing[axis];
        }
    }
}

// Sets what a surface must set and what it may set.
static void mark(const scene_mesh *shape, const fm_volume_desc *grid, fm_separation separation, uint8_t *must, uint8_t *may) {
    const fm_shape size = grid->shape;
    for (uint64_t i = 0; i < shape->triangle_count; i++) {
        double t[3][3];
        triangle_of(shape, grid, i, t);
        for (size_t voxel = 0; oracle_fits(shape, i) && voxel < (size_t)size.x * size.y * size.z; voxel++) {
            const double centre[3] = {(double)(voxel % size.x), (double)(voxel / size.x % size.y),
                                      (double)(voxel / size.x / size.y)};
            const double wide = 0.5 + SLACK, narrow = 0.5 - SLACK;
            if (separation == FM_SEPARATION_26) {
                must[voxel] |= reaches((const double(*)[3])t, centre, (double[3]){narrow, narrow, narrow});
                may[voxel] |= reaches((const double(*)[3])t, centre, (double[3]){wide, wide, wide});
                continue;
            }
            for (int axis = 0; axis < 3; axis++) {
                double half[3] = {SLACK, SLACK, SLACK};
                half[axis] = wide;
                must[voxel] |= crosses((const double(*)[3])t, centre, axis);
                may[voxel] |= reaches((const double(*)[3])t, centre, half);
            }
        }
    }
}

static uint8_t *voxels_of(const scene_mesh *shape, const fm_volume_desc *grid, const fm_voxelize_desc *desc) {
    const size_t count = (size_t)grid->shape.x * grid->shape.y * grid->shape.z;
    const size_t words = (grid->shape.x + 31) / 32;
    const fm_mesh_desc about = scene_mesh_describe(shape);
    uint8_t *bytes = malloc(count);
    uint32_t *bits = malloc(words * 4 * grid->shape.y * grid->shape.z);
    fm_mesh *mesh = NULL;
    fm_volume *voxels = NULL, *packed = NULL;
    fm_volume_desc place = *grid;
    place.type = FM_TYPE_U8;
    CHECK_OK(fm_mesh_create(context, &about, &mesh));
    CHECK_OK(fm_volume_create(context, &place, &voxels));
    place.type = FM_TYPE_BITS;
    CHECK_OK(fm_volume_create(context, &place, &packed));
    CHECK_OK(fm_mesh_voxelize(mesh, desc, voxels, NULL));
    CHECK_OK(fm_mesh_voxelize(mesh, desc, packed, NULL));
    CHECK_OK(fm_volume_download(voxels, bytes));
    CHECK_OK(fm_volume_download(packed, bits));
    for (size_t i = 0; i < count; i++) {
        const size_t x = i % grid->shape.x, row = i / grid->shape.x;
        CHECK(bytes[i] == (bits[row * words + x / 32] >> x % 32 & 1));
    }
    free(bits);
    fm_volume_destroy(voxels);
    fm_volume_destroy(packed);
    fm_mesh_destroy(mesh);
    return bytes;
}

static void check_surface(const char *name, const scene_mesh *shape, const fm_volume_desc *grid) {
    const size_t count = (size_t)grid->shape.x * grid->shape.y * grid->shape.z;
    for (fm_separation separation = FM_SEPARATION_26; separation <= FM_SEPARATION_6; separation++) {
        uint8_t *must = calloc(count, 1), *may = calloc(count, 1);
        mark(shape, grid, separation, must, may);
        uint8_t *got = voxels_of(shape, grid, &(fm_voxelize_desc){.separation = separation});
        size_t set = 0, loose = 0;
        for (size_t i = 0; i < count; i++) {
            CHECK(got[i] >= must[i]);
            CHECK(got[i] <= may[i]);
            set += got[i];
            loose += must[i] != may[i];
        }
        printf("%s, %s: %zu set, %zu contacts left to rounding\n", name, separation ? "thin" : "conservative", set, loose);
        CHECK(set > 0);
        free(must);
        free(may);
        free(got);
    }
}

// Whether a path through voxels that are not set leads from one voxel to another, over faces or over corners too.
static bool connected(const uint8_t *set, fm_shape size, size_t from, size_t to, bool corners) {
    const size_t count = (size_t)size.x * size.y * size.z;
    size_t *queue = malloc(count * sizeof *queue), head = 0, tail = 0;
    uint8_t *seen = calloc(count, 1);
    queue[tail++] = from;
    seen[from] = 1;
    while (head < tail) {
        const size_t voxel = queue[head++];
        const int64_t x = (int64_t)(voxel % size.x), y = (int64_t)(voxel / size.x % size.y), z = (int64_t)(voxel / size.x / size.y);
        for (int way = 0; way < 27; way++) {
            const int64_t dx = way % 3 - 1, dy = way / 3 % 3 - 1, dz = way / 9 - 1;
            if (x + dx < 0 || y + dy < 0 || z + dz < 0 || x + dx >= size.x || y + dy >= size.y || z + dz >= size.z ||
                (!corners && dx * dx + dy * dy + dz * dz != 1)) {
                continue;
            }
            const size_t next = (size_t)(x + dx) + size.x * ((size_t)(y + dy) + size.y * (size_t)(z + dz));
            if (!seen[next] && !set[next]) {
                seen[next] = 1;
                queue[tail++] = next;
            }
        }
    }
    const bool reached = seen[to] != 0;
    free(queue);
    free(seen);
    return reached;
}

// `inner` is a voxel inside the shape.
static void check_separates(const scene_mesh *shape, const fm_volume_desc *grid, size_t inner) {
    for (fm_separation separation = FM_SEPARATION_26; separation <= FM_SEPARATION_6; separation++) {
        uint8_t *got = voxels_of(shape, grid, &(fm_voxelize_desc){.separation = separation});
        CHECK(!got[0] && !got[inner]);
        CHECK(!connected(got, grid->shape, 0, inner, separation == FM_SEPARATION_26));
        free(got);
    }
}

static void check_solid(const scene_mesh *shape, const fm_volume_desc *grid) {
    uint8_t *surface = voxels_of(shape, grid, &(fm_voxelize_desc){.separation = FM_SEPARATION_6});
    uint8_t *solid = voxels_of(shape, grid, &(fm_voxelize_desc){.separation = FM_SEPARATION_6, .solid = true});
    const fm_shape size = grid->shape;
    for (size_t i = 0; i < (size_t)size.x * size.y * size.z; i++) {
        const size_t index[3] = {i % size.x, i / size.x % size.y, i / size.x / size.y};
        const oracle_point p = {grid->origin[0] + (double)index[0] * grid->spacing[0],
                                grid->origin[1] + (double)index[1] * grid->spacing[1],
                                grid->origin[2] + (double)index[2] * grid->spacing[2]};
        if (!surface[i]) {
            CHECK(solid[i] == (oracle_winding(shape, p) > 0.5));
        } else {
            CHECK(solid[i]);
        }
    }
    free(surface);
    free(solid);
}

static void run_shapes(void) {
    static const float centre[3] = {0.01f, -0.02f, 0.03f};
    static const float box_low[3] = {-1, -0.75f, -0.5f}, box_high[3] = {1, 0.5f, 0.75f};
    const fm_volume_desc cubes = {.shape = {21, 22, 23}, .spacing = {0.125, 0.125, 0.125}, .origin = {-1.31, -1.32, -1.33}};
    const fm_volume_desc boxes = {.shape = {40, 17, 9}, .spacing = {0.0625, 0.15, 0.3}, .origin = {-1.25, -1.2, -1.2}};
    const fm_volume_desc aligned = {.shape = {19, 19, 19}, .spacing = {0.125, 0.125, 0.125}, .origin = {-1.125, -1.0625, -1.125}};
    scene_mesh sphere = scene_mesh_sphere(9, 14, centre, 1);
    scene_mesh torus = scene_mesh_torus(16, 9, centre, 0.8f, 0.35f);
    scene_mesh box = scene_mesh_box(box_low, box_high);
    scene_mesh tubes = scene_mesh_tubes(12, centre, 2);
    scene_mesh soup = scene_mesh_soup(60, 3, centre, 2, 0.7f);
    memcpy(soup.vertices[soup.triangles[4][1]], soup.vertices[soup.triangles[4][0]], sizeof *soup.vertices);
    soup.vertices[soup.triangles[9][2]][1] = NAN;
    soup.vertices[soup.triangles[11][0]][0] = 1e3f;
    check_surface("sphere", &sphere, &cubes);
    check_surface("torus, flat voxels", &torus, &boxes);
    check_surface("box, on the voxels' faces and centres", &box, &aligned);
    check_surface("soup", &soup, &cubes);
    check_separates(&sphere, &cubes, 10 + 21 * (10 + 22 * 10));
    check_separates(&torus, &cubes, 17 + 21 * (10 + 22 * 11));
    check_separates(&box, &aligned, 9 + 19 * (8 + 19 * 10));
    check_solid(&sphere, &cubes);
    check_solid(&torus, &boxes);
    check_solid(&box, &aligned);
    check_solid(&tubes, &cubes);
    scene_mesh_free(&sphere);
    scene_mesh_free(&torus);
    scene_mesh_free(&box);
    scene_mesh_free(&tubes);
    scene_mesh_free(&soup);
}

int main(void) {
    const fm_context_desc desc = {.backend = FM_BACKEND_CPU, .threads = 3};
    if (CHECK_OK(fm_context_create(&desc, &context))) {
        run_shapes();
        fm_context_destroy(context);
    }
    return check_summary();
}
