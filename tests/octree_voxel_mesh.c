// SPDX-License-Identifier: MIT
// Octrees of the voxels of meshes: the voxels that fm_mesh_voxelize sets, their numbers, and how near contours come to the surface.

#include "fathom/sdf.h"
#include "faulty.h"
#include "meshes.h"
#include "octree_voxels_common.h"
#include "vulkan_common.h"

enum { RAYS = 2000 };

static fm_context *context;

static void check_voxels(fm_mesh *mesh, fm_octree *octree) {
    const fm_octree_info *info = &octree->info;
    fm_volume_desc desc = {.shape = {info->cells[0], info->cells[1], info->cells[2]}, .type = FM_TYPE_U8};
    for (int i = 0; i < 3; i++) {
        desc.spacing[i] = info->cell;
        desc.origin[i] = info->origin[i] + 0.5 * info->cell;
    }
    grid g = grid_new(info->cells[0], info->cells[1], info->cells[2]);
    uint8_t *bytes = malloc(grid_count(&g));
    fm_volume *volume = NULL;
    if (CHECK(bytes != NULL) && CHECK_OK(fm_volume_create(context, &desc, &volume)) &&
        CHECK_OK(fm_mesh_voxelize(mesh, NULL, volume, NULL)) && CHECK_OK(fm_volume_download(volume, bytes))) {
        uint64_t set = 0;
        for (uint64_t i = 0; i < grid_count(&g); i++) {
            g.voxels[i] = bytes[i] ? 182 : 0;
            set += bytes[i];
        }
        CHECK(set > 100);
        CHECK(grid_equal(&g, octree));
    }
    fm_volume_destroy(volume);
    free(bytes);
    free(g.voxels);
}

static void check_equal(fm_mesh *mesh, uint32_t size, const float box[2][3]) {
    for (int k = 0; k < GRID_KINDS; k++) {
        fm_octree_desc desc = {.kind = grid_kinds[k], .size = size, .top_bytes = 4096};
        if (box) {
            memcpy(desc.low, box[0], sizeof desc.low);
            memcpy(desc.high, box[1], sizeof desc.high);
        }
        fm_octree *octree = NULL;
        if (CHECK_OK(fm_octree_build_mesh(mesh, &desc, &octree))) {
            check_voxels(mesh, octree);
            fm_octree_destroy(octree);
        }
    }
}

static double sphere_error(fm_octree *octree, double radius, const fm_mesh_ray *rays, int *missed, double *worst) {
    static fm_octree_hit hits[RAYS];
    double sum = 0;
    int hit = 0;
    *missed = 0;
    *worst = 0;
    CHECK_OK(fm_octree_cast(octree, rays, RAYS, 0, hits));
    for (int i = 0; i < RAYS; i++) {
        if (isinf(hits[i].t)) {
            ++*missed;
            continue;
        }
        double square = 0;
        for (int axis = 0; axis < 3; axis++) {
            square += pow((double)rays[i].origin[axis] + (double)hits[i].t * (double)rays[i].direction[axis], 2);
        }
        const double off = fabs(sqrt(square) - radius) / octree->info.cell;
        sum += off;
        *worst = off > *worst ? off : *worst;
        hit++;
    }
    return sum / (hit > 0 ? hit : 1);
}

// Rays towards a ball: cubes are off by a part of a cell, contours by little, and nothing gets through between them.
static void check_contours(void) {
    static fm_mesh_ray rays[RAYS];
    const float centre[3] = {0, 0, 0};
    scene_mesh ball = scene_mesh_sphere(64, 128, centre, 1);
    const fm_mesh_desc described = scene_mesh_describe(&ball);
    fm_mesh *mesh = NULL;
    uint64_t seed = 3;
    for (int i = 0; i < RAYS; i++) {
        double way[3], target[3], square = 0;
        for (int axis = 0; axis < 3; axis++) {
            target[axis] = test_between(&seed, -550, 550) * 0.001;
            rays[i].origin[axis] = (float)test_between(&seed, -1000, 1000) * 0.003f;
        }
        rays[i].origin[i % 3] = i % 2 ? 3 : -3;
        for (int axis = 0; axis < 3; axis++) {
            way[axis] = target[axis] - (double)rays[i].origin[axis];
            square += way[axis] * way[axis];
        }
        for (int axis = 0; axis < 3; axis++) {
            rays[i].direction[axis] = (float)(way[axis] / sqrt(square));
        }
        rays[i].first = 0;
        rays[i].last = INFINITY;
    }
    double mean[2] = {0}, worst[2];
    for (int without = 0; without < 2 && CHECK_OK(fm_mesh_create(context, &described, &mesh)); without++) {
        const fm_octree_desc desc = {.kind = FM_OCTREE_CONTOURS, .size = 64, .threshold = without ? -1 : 0, .top_bytes = 4096};
        fm_octree *octree = NULL;
        if (CHECK_OK(fm_octree_build_mesh(mesh, &desc, &octree))) {
            int missed;
            mean[without] = sphere_error(octree, 1, rays, &missed, &worst[without]);
            CHECK(missed == 0);
            printf("%s contours: %.3f cells off on the average, %.3f at most\n", without ? "without" : "with", mean[without],
                   worst[without]);
        }
        fm_octree_destroy(octree);
        fm_mesh_destroy(mesh);
        mesh = NULL;
    }
    CHECK(mean[0] < 0.3 * mean[1] && worst[0] < 1);
    scene_mesh_free(&ball);
}

// Numbers: a triangle that touches the voxel, or a colour between those of its corners.
static void check_numbers(fm_mesh *mesh, const fm_mesh_desc *described) {
    uint8_t(*colors)[4] = malloc(described->vertex_count * sizeof *colors);
    if (!CHECK(colors != NULL)) {
        return;
    }
    for (uint64_t i = 0; i < described->vertex_count; i++) {
        memcpy(colors[i], (const uint8_t[4]){10, 20, 200, 255}, 4);
    }
    for (int k = 0; k < GRID_KINDS; k++) {
        for (int color = 0; grid_kinds[k] != FM_OCTREE_DAG && color < 2; color++) {
            const fm_octree_desc desc = {.kind = grid_kinds[k],
                                         .size = 40,
                                         .attribute = color ? FM_OCTREE_COLOR : FM_OCTREE_TRIANGLE,
                                         .colors = (const uint8_t(*)[4])colors};
            const fm_mesh_ray ray = {.origin = {1, 0.2f, 5}, .direction = {0, 0, -1}, .last = INFINITY};
            fm_octree *octree = NULL;
            fm_octree_hit hit;
            if (!CHECK_OK(fm_octree_build_mesh(mesh, &desc, &octree)) || !CHECK_OK(fm_octree_cast(octree, &ray, 1, 0, &hit))) {
                continue;
            }
            const uint32_t wanted = 10 | 20 << 8 | 200 << 16 | 255u << 24;
            CHECK(!isinf(hit.t));
            CHECK(color ? hit.attribute == wanted : hit.attribute > 0 && hit.attribute <= described->triangle_count);
            fm_octree_destroy(octree);
        }
    }
    free(colors);
}

static fm_result attempt_build(fm_context *faulty_context, void *user) {
    fm_mesh *mesh = NULL;
    FM_TRY(fm_mesh_create(faulty_context, user, &mesh));
    fm_result result = FM_OK;
    for (int k = 0; k < GRID_KINDS && result == FM_OK; k++) {
        fm_octree *octree = NULL;
        result = fm_octree_build_mesh(mesh, &(fm_octree_desc){.kind = grid_kinds[k], .size = 32}, &octree);
        fm_octree_destroy(octree);
    }
    fm_mesh_destroy(mesh);
    return result;
}

int main(void) {
    const fm_context_desc desc = {.backend = FM_BACKEND_CPU, .threads = 1};
    if (!CHECK_OK(fm_context_create(&desc, &context))) {
        return check_summary();
    }
    const float middle[3] = {0.1f, 0.2f, 0}, low[3] = {-0.5f, -0.3f, -1.1f}, high[3] = {2, 0.9f, 1.2f},
                cut[2][3] = {{-0.6f, -0.5f, -0.2f}, {0.8f, 0.7f, 0.5f}};
    scene_mesh torus = scene_mesh_torus(24, 48, middle, 0.9f, 0.35f), block = scene_mesh_box(low, high);
    scene_mesh *const meshes[] = {&torus, &block};
    for (int i = 0; i < 2; i++) {
        const fm_mesh_desc described = scene_mesh_describe(meshes[i]);
        fm_mesh *mesh = NULL;
        if (CHECK_OK(fm_mesh_create(context, &described, &mesh))) {
            check_equal(mesh, 20, NULL);
            check_equal(mesh, 75, NULL);
            check_equal(mesh, 90, cut);
            check_numbers(mesh, &described);
        }
        fm_mesh_destroy(mesh);
        if (i == 0) {
            exhaust("voxels of meshes", attempt_build, (void *)&described, -1);
        }
        scene_mesh_free(meshes[i]);
    }
    check_contours();
    fm_context_destroy(context);
    return check_summary();
}
