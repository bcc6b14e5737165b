// SPDX-License-Identifier: MIT
// The local field of an object, and where it comes to lie in the scene's.

#include "mesh/compose.h"

#include "gpu/gpu.h"

#include <inttypes.h>
#include <string.h>

// Texels beside the band on each side, so that the field is farther than the band at its border however it is interpolated, with
// room for rounding.
enum { BESIDE = 2 };

static const double rigid_within = 1e-4;

fm_result fm_composed_check_place(const fm_scene_object *object, uint64_t number) {
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k <= i; k++) {
            const float *a = object->place.rows[i], *b = object->place.rows[k];
            const double product = (double)a[0] * b[0] + (double)a[1] * b[1] + (double)a[2] * b[2];
            if (!(fabs(product - (i == k)) <= rigid_within)) {
                return fm_fail(FM_ERROR_INVALID_ARGUMENT,
                               "object %" PRIu64 " has a place whose rows %d and %d have the product %g: of a rotation it is %d",
                               number, k, i, product, i == k);
            }
        }
    }
    return FM_OK;
}

// The box of the triangles that take part; false where there are none.
static bool box_of(const fm_mesh *mesh, double low[3], double high[3]) {
    bool any = false;
    for (int axis = 0; axis < 3; axis++) {
        low[axis] = INFINITY;
        high[axis] = -INFINITY;
    }
    for (uint64_t i = 0; i < mesh->triangle_count; i++) {
        const bool fits = fm_triangle_fits(mesh, i);
        any |= fits;
        for (int k = 0; fits && k < 9; k++) {
            const double x = (double)mesh->vertices[mesh->triangles[i][k / 3]][k % 3];
            low[k % 3] = fmin(low[k % 3], x);
            high[k % 3] = fmax(high[k % 3], x);
        }
    }
    return any;
}

// A grid of cubic texels around the box and its band.
static void fit(const fm_composed *composed, const double low[3], const double high[3], fm_volume_desc *grid) {
    const double longest = fmax(high[0] - low[0], fmax(high[1] - low[1], high[2] - low[2])) + 2 * (double)composed->band;
    const double spacing = fmax(composed->spacing, longest / (composed->most - 2 * BESIDE - 2));
    uint32_t *const counts[3] = {&grid->shape.x, &grid->shape.y, &grid->shape.z};
    grid->type = FM_TYPE_F32;
    for (int axis = 0; axis < 3; axis++) {
        const double extent = high[axis] - low[axis] + 2 * (double)composed->band;
        *counts[axis] = (uint32_t)ceil(extent / spacing) + 2 * BESIDE + 1;
        grid->spacing[axis] = spacing;
        grid->origin[axis] = (low[axis] + high[axis]) / 2 - (*counts[axis] - 1) / 2.0 * spacing;
    }
}

static fm_result make_mesh(const fm_composed *composed, const fm_scene_object *object, fm_mesh **mesh) {
    const fm_scene *scene = composed->scene;
    const uint64_t bytes = object->triangle_count * sizeof *scene->triangles;
    uint32_t(*triangles)[3] = fm_mesh_alloc(composed->context, bytes, "an object's triangles");
    if (!triangles) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    for (uint64_t i = 0; i < object->triangle_count; i++) {
        for (int k = 0; k < 3; k++) {
            triangles[i][k] = scene->triangles[object->first_triangle + i][k] - (uint32_t)object->first_vertex;
        }
    }
    const float(*vertices)[3] = object->vertex_count > 0 ? (const float(*)[3])scene->rest + object->first_vertex : NULL;
    const fm_mesh_desc desc = {vertices, object->vertex_count, (const uint32_t(*)[3])triangles, object->triangle_count};
    const fm_result status = fm_mesh_create(composed->context, &desc, mesh);
    fm_mesh_free(composed->context, triangles, bytes);
    return status;
}

void fm_composed_release(fm_composed *composed, fm_composed_item *item) {
    fm_composed_local *local = item->local;
    item->local = NULL;
    if (local && --local->users == 0) {
        fm_volume_destroy(local->volume);
        fm_mesh_free(composed->context, local, sizeof *local);
    }
}

// Once nothing in flight reads it.
static fm_result drop_local(fm_composed *composed, fm_composed_item *item) {
    fm_gpu *gpu = composed->context->gpu;
    if (gpu && item->local && item->local->users == 1) {
        FM_TRY(fm_gpu_wait(gpu, fm_gpu_newest(gpu)));
    }
    fm_composed_release(composed, item);
    return FM_OK;
}

static fm_result make_volume(fm_composed *composed, const fm_volume_desc *grid, fm_composed_item *item) {
    fm_composed_local *local = item->local;
    if (local && local->users == 1 && fm_shape_equal(local->volume->desc.shape, grid->shape)) {
        memcpy(local->volume->desc.spacing, grid->spacing, sizeof grid->spacing);
        memcpy(local->volume->desc.origin, grid->origin, sizeof grid->origin);
        return FM_OK;
    }
    FM_TRY(drop_local(composed, item));
    local = fm_mesh_alloc_zero(composed->context, sizeof *local, "a local field");
    if (!local) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    local->users = 1;
    item->local = local;
    const fm_result status = fm_volume_create(composed->context, grid, &local->volume);
    if (status != FM_OK) {
        fm_composed_release(composed, item);
    }
    return status;
}

static fm_result make_field(fm_composed *composed, fm_mesh *mesh, fm_composed_item *item) {
    double low[3], high[3];
    if (!box_of(mesh, low, high)) {
        return drop_local(composed, item);
    }
    fm_volume_desc grid = {0};
    fit(composed, low, high, &grid);
    FM_TRY(make_volume(composed, &grid, item));
    // A cell in which the field is within the band has no corner farther than its diagonal beyond.
    const fm_sdf_desc desc = {.band = (float)((double)composed->band / grid.spacing[0] + BESIDE), .sign = composed->sign};
    fm_ticket ticket;
    return fm_mesh_sdf(mesh, &desc, item->local->volume, NULL, NULL, &ticket);
}

// Whether two objects have the same vertices and triangles, bit for bit.
static bool same_shape(const fm_scene *scene, const fm_scene_object *a, const fm_scene_object *b) {
    if (a->vertex_count != b->vertex_count || a->triangle_count != b->triangle_count ||
        (a->vertex_count > 0 &&
         memcmp(scene->rest + a->first_vertex, scene->rest + b->first_vertex, a->vertex_count * sizeof *scene->rest) != 0)) {
        return false;
    }
    for (uint64_t i = 0; i < 3 * a->triangle_count; i++) {
        if (scene->triangles[a->first_triangle + i / 3][i % 3] - a->first_vertex !=
            scene->triangles[b->first_triangle + i / 3][i % 3] - b->first_vertex) {
            return false;
        }
    }
    return true;
}

// Takes the local field of an object of the same shape, none of which has deformed.
static bool share_local(fm_composed *composed, uint64_t number) {
    const fm_scene *scene = composed->scene;
    fm_composed_item *item = &composed->items[number];
    for (uint64_t i = 0; i < number && scene->objects[number].shape_version == 1 && !item->local; i++) {
        const fm_composed_item *other = &composed->items[i];
        if (other->local && other->shape_version == 1 && scene->objects[i].shape_version == 1 &&
            same_shape(scene, &scene->objects[i], &scene->objects[number])) {
            item->local = other->local;
            item->local->users++;
            item->shape_version = 1;
            return true;
        }
    }
    return false;
}

static fm_result make_local(fm_composed *composed, uint64_t number) {
    const fm_scene_object *object = &composed->scene->objects[number];
    fm_composed_item *item = &composed->items[number];
    fm_mesh *mesh = item->mesh;
    if (share_local(composed, number)) {
        return FM_OK;
    }
    if (mesh) {
        FM_TRY(fm_mesh_deform(mesh, (const float(*)[3])composed->scene->rest + object->first_vertex, FM_TREE_REFIT));
    } else {
        FM_TRY(make_mesh(composed, object, &mesh));
    }
    item->shape_version = 0;
    const fm_result status = make_field(composed, mesh, item);
    const bool keep = object->shape_version > 1;
    item->mesh = keep ? mesh : NULL;
    if (!keep) {
        fm_mesh_destroy(mesh);
    }
    FM_TRY(status);
    item->shape_version = object->shape_version;
    return FM_OK;
}

// The inverse of the rotation.
static void invert(const fm_transform3 *place, double inverse[3][3]) {
    double m[3][3], determinant = 0;
    for (int i = 0; i < 9; i++) {
        m[i / 3][i % 3] = (double)place->rows[i / 3][i % 3];
    }
    for (int i = 0; i < 9; i++) {
        const int r = i / 3, c = i % 3, r1 = (r + 1) % 3, r2 = (r + 2) % 3, c1 = (c + 1) % 3, c2 = (c + 2) % 3;
        const double cofactor = m[r1][c1] * m[r2][c2] - m[r1][c2] * m[r2][c1];
        inverse[c][r] = cofactor;
        determinant += r == 0 ? m[0][c] * cofactor : 0;
    }
    for (int i = 0; i < 9; i++) {
        inverse[i / 3][i % 3] /= determinant;
    }
}

static int clip(double index, uint32_t size) {
    return (int)fmin(fmax(index, 0), size);
}

// The texels of the scene's field around the local field's box.
static void place_box(const fm_volume_desc *scene, const fm_volume_desc *local, const fm_transform3 *place,
                      fm_compose_object *record) {
    const uint32_t sizes[3] = {scene->shape.x, scene->shape.y, scene->shape.z};
    const uint32_t own[3] = {local->shape.x, local->shape.y, local->shape.z};
    for (int axis = 0; axis < 3; axis++) {
        double least = (double)place->rows[axis][3], most = least;
        for (int k = 0; k < 3; k++) {
            const double begin = local->origin[k], end = begin + (own[k] - 1) * local->spacing[k];
            const double m = (double)place->rows[axis][k];
            least += fmin(m * begin, m * end);
            most += fmax(m * begin, m * end);
        }
        record->begin[axis] = clip(floor((least - scene->origin[axis]) / scene->spacing[axis]), sizes[axis]);
        record->end[axis] = clip(ceil((most - scene->origin[axis]) / scene->spacing[axis]) + 1, sizes[axis]);
    }
}

static void place_local(const fm_composed *composed, const fm_scene_object *object, fm_composed_item *item) {
    item->place = object->place;
    item->next = (fm_compose_object){0};
    if (!item->local) {
        return;
    }
    const fm_volume_desc *scene = &composed->field->desc, *local = &item->local->volume->desc;
    fm_compose_object next = {.shape = {(int)local->shape.x, (int)local->shape.y, (int)local->shape.z}};
    double inverse[3][3];
    bool finite = true;
    invert(&object->place, inverse);
    for (int axis = 0; axis < 3; axis++) {
        double shift = -local->origin[axis];
        for (int k = 0; k < 3; k++) {
            shift += inverse[axis][k] * (scene->origin[k] - (double)object->place.rows[k][3]);
            next.to_local[4 * axis + k] = (float)(inverse[axis][k] * scene->spacing[k] / local->spacing[axis]);
        }
        next.to_local[4 * axis + 3] = (float)(shift / local->spacing[axis]);
    }
    for (int i = 0; i < 12; i++) {
        finite = finite && isfinite(next.to_local[i]);
    }
    place_box(scene, local, &object->place, &next);
    // So far away that floats do not tell, it reaches nothing.
    item->next = finite ? next : (fm_compose_object){0};
}

fm_result fm_composed_prepare(fm_composed *composed, uint64_t number) {
    const fm_scene_object *object = &composed->scene->objects[number];
    fm_composed_item *item = &composed->items[number];
    const bool stale = item->shape_version != object->shape_version;
    if (stale) {
        item->changed = true;
        FM_TRY(make_local(composed, number));
    }
    if (stale || memcmp(&item->place, &object->place, sizeof item->place) != 0) {
        item->changed = true;
        place_local(composed, object, item);
    }
    return FM_OK;
}
