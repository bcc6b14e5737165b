// SPDX-License-Identifier: MIT
// Boxes around meshes: from the host's positions, or for a scene that moved on the device alone from its objects' boxes.

#include "mesh/scene.h"

#include <string.h>

typedef struct box {
    float low[3], high[3];
} box;

static const box nothing = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};

static void include(box *b, const float p[3]) {
    for (int axis = 0; axis < 3; axis++) {
        b->low[axis] = p[axis] < b->low[axis] ? p[axis] : b->low[axis];
        b->high[axis] = p[axis] > b->high[axis] ? p[axis] : b->high[axis];
    }
}

static void include_triangles(box *b, const float (*vertices)[3], const uint32_t (*triangles)[3], uint64_t count) {
    for (uint64_t i = 0; i < count; i++) {
        const float *corners[3] = {vertices[triangles[i][0]], vertices[triangles[i][1]], vertices[triangles[i][2]]};
        bool fits = true;
        for (int k = 0; k < 9; k++) {
            fits &= fm_coordinate_fits(corners[k / 3][k % 3]);
        }
        for (int k = 0; fits && k < 3; k++) {
            include(b, corners[k]);
        }
    }
}

void fm_mesh_bounds(fm_mesh *mesh, float low[3], float high[3]) {
    if (mesh->box_version != mesh->version + 1) {
        box b = nothing;
        include_triangles(&b, (const float(*)[3])mesh->vertices, (const uint32_t(*)[3])mesh->triangles, mesh->triangle_count);
        memcpy(mesh->low, b.low, sizeof b.low);
        memcpy(mesh->high, b.high, sizeof b.high);
        mesh->box_version = mesh->version + 1;
    }
    memcpy(low, mesh->low, sizeof mesh->low);
    memcpy(high, mesh->high, sizeof mesh->high);
}

// The box at rest, turned and moved, and larger by what floats may make of a vertex: four roundings of the sum of its parts' sizes.
static void include_object(box *all, const fm_scene_object *object) {
    if (object->low[0] > object->high[0]) {
        return;
    }
    float low[3], high[3];
    for (int row = 0; row < 3; row++) {
        const float *m = object->place.rows[row];
        double middle = m[3], reach = 0, size = fabs((double)m[3]);
        for (int axis = 0; axis < 3; axis++) {
            const double first = (double)m[axis] * object->low[axis], last = (double)m[axis] * object->high[axis];
            middle += (first + last) / 2;
            reach += fabs(last - first) / 2;
            size += fmax(fabs(first), fabs(last));
        }
        reach += 5e-7 * size;
        low[row] = (float)fmax(middle - reach, -1e18);
        high[row] = (float)fmin(middle + reach, 1e18);
    }
    include(all, low);
    include(all, high);
}

void fm_scene_bound(fm_scene *scene) {
    box all = nothing;
    for (uint64_t i = 0; i < scene->object_count; i++) {
        fm_scene_object *object = &scene->objects[i];
        if (object->boxed != object->shape_version) {
            box b = nothing;
            include_triangles(&b, (const float(*)[3])scene->rest, (const uint32_t(*)[3])scene->triangles + object->first_triangle,
                              object->triangle_count);
            memcpy(object->low, b.low, sizeof b.low);
            memcpy(object->high, b.high, sizeof b.high);
            object->boxed = object->shape_version;
        }
        include_object(&all, object);
    }
    memcpy(scene->mesh->low, all.low, sizeof all.low);
    memcpy(scene->mesh->high, all.high, sizeof all.high);
    scene->mesh->box_version = scene->mesh->version + 1;
}
