// SPDX-License-Identifier: MIT
// Octrees of the voxels that a mesh's surface touches. Triangles are sorted into cubes of cells; when the octree asks for the
// voxels of a box, those of its cube are tried. Which voxels a triangle touches is decided as fm_mesh_voxelize does on the
// processor.

#include "mesh/touch.h"
#include "mesh/triangle.h"
#include "octree/voxel_contours.h"
#include "octree/voxels.h"

#include <string.h>

enum { LEAST_CUBE = FM_TILE_LEVEL, GREY = 182 };
static const uint64_t MOST_CUBES = 1 << 22;

typedef struct surface {
    const fm_mesh *mesh;
    const fm_octree_desc *desc;
    fm_grid grid, cubes;
    uint32_t cube;      // level of a cube
    uint64_t *first;    // of each cube, where its triangles begin; one more
    uint32_t *sorted;   // triangles
    uint64_t count;     // cubes
    uint32_t triangle;  // that is being sorted
    bool contours;
} surface;

// What one thread reads: the box that was the last and, where contours are wanted, which triangles touch each of its voxels.
typedef struct reader {
    const surface *of;
    fm_box box;
    uint32_t *voxels;
    uint32_t triangle;
    int32_t *heads;  // FM_TILE_VOXELS; NULL: no contours
    fm_voxel_link *links;
    uint64_t link_count, link_room;
    bool failed;
} reader;

// ---------------------------------------------------------------------------------------------------------------------------
// Cubes
// ---------------------------------------------------------------------------------------------------------------------------

static uint64_t cube_at(const surface *own, uint32_t x, uint32_t y, uint32_t z) {
    return x + (uint64_t)own->cubes.shape.x * (y + (uint64_t)own->cubes.shape.y * z);
}

static void count_cube(void *user, uint32_t x, uint32_t y, uint32_t z) {
    surface *own = user;
    own->first[cube_at(own, x, y, z) + 1]++;
}

static void fill_cube(void *user, uint32_t x, uint32_t y, uint32_t z) {
    surface *own = user;
    own->sorted[own->first[cube_at(own, x, y, z)]++] = own->triangle;
}

// The cube that a triangle is in as a whole, as most are.
static bool in_one_cube(const surface *own, uint64_t triangle, const double half[3], uint32_t cube[3]) {
    const uint32_t size[3] = {own->cubes.shape.x, own->cubes.shape.y, own->cubes.shape.z};
    const uint32_t *corners = own->mesh->triangles[triangle];
    const float *a = own->mesh->vertices[corners[0]], *b = own->mesh->vertices[corners[1]], *c = own->mesh->vertices[corners[2]];
    for (int axis = 0; axis < 3; axis++) {
        const float low = fminf(a[axis], fminf(b[axis], c[axis])), high = fmaxf(a[axis], fmaxf(b[axis], c[axis]));
        const double origin = own->cubes.origin[axis], spacing = own->cubes.spacing[axis];
        const double first = ceil(((double)low - origin) / spacing - half[axis]);
        if (first != floor(((double)high - origin) / spacing + half[axis]) || !(first >= 0 && first < size[axis])) {
            return false;
        }
        cube[axis] = (uint32_t)first;
    }
    return true;
}

static void each_cube(surface *own, fm_touch_fn fn) {
    // A little more than half: what touches a voxel must touch its cube, too, however it is rounded.
    static const double half[3] = {0.500001, 0.500001, 0.500001};
    const fm_shape shape = own->cubes.shape;
    const fm_touch_range all = {{0, 0, 0}, {shape.x - 1, shape.y - 1, shape.z - 1}};
    for (uint64_t i = 0; i < own->mesh->triangle_count; i++) {
        uint32_t cube[3];
        own->triangle = (uint32_t)i;
        if (!fm_triangle_fits(own->mesh, i)) {
            continue;
        }
        if (in_one_cube(own, i, half, cube)) {
            fn(own, cube[0], cube[1], cube[2]);
        } else {
            fm_touch(own->mesh, &own->cubes, (uint32_t)i, half, &all, fn, own);
        }
    }
}

static fm_result sort_triangles(surface *own) {
    fm_context *context = own->mesh->context;
    own->first = fm_octree_alloc_zero(context, (own->count + 1) * sizeof *own->first, "triangles of an octree");
    if (!own->first) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    each_cube(own, count_cube);
    for (uint64_t i = 0; i < own->count; i++) {
        own->first[i + 1] += own->first[i];
    }
    own->sorted = fm_octree_alloc(context, own->first[own->count] * sizeof *own->sorted, "triangles of an octree");
    if (!own->sorted) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    each_cube(own, fill_cube);
    // Each has moved to where the next begins.
    memmove(own->first + 1, own->first, own->count * sizeof *own->first);
    own->first[0] = 0;
    return FM_OK;
}

static uint64_t cube_of(const surface *own, const fm_box *box) {
    return cube_at(own, (uint32_t)(box->begin[0] >> own->cube), (uint32_t)(box->begin[1] >> own->cube),
                   (uint32_t)(box->begin[2] >> own->cube));
}

static bool no_triangles(void *user, const fm_box *box) {
    const surface *own = ((const reader *)user)->of;
    uint32_t end[3];
    for (int axis = 0; axis < 3; axis++) {
        end[axis] = (uint32_t)((box->end[axis] - 1) >> own->cube);
    }
    for (uint32_t z = (uint32_t)(box->begin[2] >> own->cube); z <= end[2]; z++) {
        for (uint32_t y = (uint32_t)(box->begin[1] >> own->cube); y <= end[1]; y++) {
            const uint32_t x = (uint32_t)(box->begin[0] >> own->cube);
            if (own->first[cube_at(own, end[0], y, z) + 1] != own->first[cube_at(own, x, y, z)]) {
                return false;
            }
        }
    }
    return true;
}

// ---------------------------------------------------------------------------------------------------------------------------
// Voxels
// ---------------------------------------------------------------------------------------------------------------------------

// The colour of a triangle where it is nearest to a cell's centre.
static uint32_t color_at(const surface *own, uint32_t triangle, const uint32_t cell[3]) {
    const uint32_t *corners = own->mesh->triangles[triangle];
    float centre[3];
    double edges[2][3], off[3], dots[2][2] = {{0}}, along[2] = {0};
    for (int i = 0; i < 3; i++) {
        centre[i] = (float)fm_grid_at(&own->grid, i, cell[i]);
    }
    const fm_point_on_triangle nearest = fm_triangle_point(own->mesh, triangle, centre);
    for (int i = 0; i < 3; i++) {
        const double from = (double)own->mesh->vertices[corners[0]][i];
        edges[0][i] = (double)own->mesh->vertices[corners[1]][i] - from;
        edges[1][i] = (double)own->mesh->vertices[corners[2]][i] - from;
        off[i] = (double)centre[i] + nearest.offset[i] - from;
        for (int a = 0; a < 2; a++) {
            along[a] += edges[a][i] * off[i];
        }
        dots[0][0] += edges[0][i] * edges[0][i];
        dots[0][1] += edges[0][i] * edges[1][i];
        dots[1][1] += edges[1][i] * edges[1][i];
    }
    const double area = dots[0][0] * dots[1][1] - dots[0][1] * dots[0][1];
    const double b = area > 0 ? (dots[1][1] * along[0] - dots[0][1] * along[1]) / area : 0;
    const double c = area > 0 ? (dots[0][0] * along[1] - dots[0][1] * along[0]) / area : 0;
    const double weights[3] = {1 - b - c, b, c};
    uint32_t color = 0;
    for (int channel = 0; channel < 4; channel++) {
        double sum = 0.5;
        for (int k = 0; k < 3; k++) {
            sum += weights[k] * own->desc->colors[corners[k]][channel];
        }
        color |= (uint32_t)fmin(255, fmax(0, sum)) << 8 * channel;
    }
    return color > 0 ? color : 1u << 24;  // 0 would be air
}

static uint32_t number_of(const surface *own, uint32_t triangle, const uint32_t cell[3]) {
    switch (own->desc->attribute) {
    case FM_OCTREE_TRIANGLE:
        return triangle + 1;
    case FM_OCTREE_COLOR:
        return color_at(own, triangle, cell);
    default:
        return GREY;
    }
}

static void keep_link(reader *own, uint64_t voxel) {
    if (own->link_count == own->link_room) {
        fm_context *context = own->of->mesh->context;
        const uint64_t room = own->link_room > 0 ? 2 * own->link_room : 1 << 14;
        fm_voxel_link *links = fm_octree_alloc(context, room * sizeof *links, "contours of an octree");
        if (!links) {
            own->failed = true;
            return;
        }
        if (own->link_count > 0) {
            memcpy(links, own->links, own->link_count * sizeof *links);
        }
        fm_octree_free(context, own->links, own->link_room * sizeof *links);
        own->links = links;
        own->link_room = room;
    }
    own->links[own->link_count] = (fm_voxel_link){own->triangle, own->heads[voxel]};
    own->heads[voxel] = (int32_t)own->link_count++;
}

static uint64_t voxel_at(const reader *own, uint32_t x, uint32_t y, uint32_t z) {
    const fm_box *box = &own->box;
    const uint64_t row = (uint64_t)(box->end[0] - box->begin[0]), slice = row * (uint64_t)(box->end[1] - box->begin[1]);
    return (x - (uint64_t)box->begin[0]) + row * (y - (uint64_t)box->begin[1]) + slice * (z - (uint64_t)box->begin[2]);
}

static void set_voxel(void *user, uint32_t x, uint32_t y, uint32_t z) {
    reader *own = user;
    const uint64_t voxel = voxel_at(own, x, y, z);
    if (own->voxels[voxel] == 0) {
        const uint32_t cell[3] = {x, y, z};
        own->voxels[voxel] = number_of(own->of, own->triangle, cell);
    }
    if (own->heads) {
        keep_link(own, voxel);
    }
}

static fm_result read_surface(void *user, const fm_box *box, uint32_t *voxels) {
    reader *own = user;
    const surface *of = own->of;
    static const double half[3] = {0.5, 0.5, 0.5};
    fm_touch_range range;
    uint64_t count = 1;
    for (int axis = 0; axis < 3; axis++) {
        range.from[axis] = (uint32_t)box->begin[axis];
        range.to[axis] = (uint32_t)box->end[axis] - 1;
        count *= (uint64_t)(box->end[axis] - box->begin[axis]);
    }
    own->box = *box;
    own->voxels = voxels;
    own->link_count = 0;
    memset(voxels, 0, count * sizeof *voxels);
    for (uint64_t i = 0; own->heads && i < count; i++) {
        own->heads[i] = FM_NO_LINK;
    }
    const uint64_t cube = cube_of(of, box);
    for (uint64_t i = of->first[cube]; i < of->first[cube + 1]; i++) {
        own->triangle = of->sorted[i];
        fm_touch(of->mesh, &of->grid, own->triangle, half, &range, set_voxel, own);
    }
    return own->failed ? FM_ERROR_OUT_OF_HOST_MEMORY : FM_OK;
}

// ---------------------------------------------------------------------------------------------------------------------------
// Contours
// ---------------------------------------------------------------------------------------------------------------------------

static uint32_t contour_at(void *user, const uint32_t cell[3]) {
    const reader *own = user;
    const int32_t first = own->heads[voxel_at(own, cell[0], cell[1], cell[2])];
    return fm_contour_fit(own->of->mesh, &own->of->grid, cell, own->links, first);
}

// ---------------------------------------------------------------------------------------------------------------------------
// The call
// ---------------------------------------------------------------------------------------------------------------------------

// The grid of cells, and that of cubes.
static void make_grids(surface *own, const fm_octree_info *info) {
    const uint32_t *cells = info->cells;
    own->cube = LEAST_CUBE;
    own->grid.shape = (fm_shape){cells[0], cells[1], cells[2]};
    for (;; own->cube++) {
        const uint64_t edge = 1ull << own->cube;
        own->cubes.shape = (fm_shape){(uint32_t)fm_div_up(cells[0], edge), (uint32_t)fm_div_up(cells[1], edge),
                                      (uint32_t)fm_div_up(cells[2], edge)};
        own->count = fm_voxels(own->cubes.shape);
        if (own->count <= MOST_CUBES) {
            break;
        }
    }
    for (int axis = 0; axis < 3; axis++) {
        const double edge = (double)(1ull << own->cube);
        own->grid.spacing[axis] = info->cell;
        own->grid.origin[axis] = info->origin[axis] + 0.5 * info->cell;
        own->cubes.spacing[axis] = info->cell * edge;
        own->cubes.origin[axis] = info->origin[axis] + 0.5 * info->cell * edge;
    }
}

static fm_result prepare(surface *own, const double low[3], const double high[3]) {
    fm_octree *model = NULL;
    FM_TRY(fm_octree_new(own->mesh->context, own->desc, low, high, &model));
    make_grids(own, &model->info);
    fm_octree_destroy(model);
    own->contours = own->desc->kind == FM_OCTREE_CONTOURS && !(own->desc->threshold < 0);
    return sort_triangles(own);
}

static void release(surface *own) {
    fm_context *context = own->mesh->context;
    fm_octree_free(context, own->sorted, own->first ? own->first[own->count] * sizeof *own->sorted : 0);
    fm_octree_free(context, own->first, (own->count + 1) * sizeof *own->first);
}

// One for each worker.
typedef struct readers {
    reader *all;
    void **users;
    uint32_t count;
} readers;

static fm_result open_readers(const surface *own, readers *made) {
    fm_context *context = own->mesh->context;
    made->count = fm_pool_threads(context->pool);
    made->all = fm_octree_alloc_zero(context, made->count * sizeof *made->all, "threads of an octree");
    made->users = fm_octree_alloc(context, made->count * sizeof *made->users, "threads of an octree");
    if (!made->all || !made->users) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    for (uint32_t i = 0; i < made->count; i++) {
        reader *one = &made->all[i];
        one->of = own;
        made->users[i] = one;
        if (own->contours) {
            one->heads = fm_octree_alloc(context, FM_TILE_VOXELS * sizeof *one->heads, "contours of an octree");
            FM_TRY(one->heads ? FM_OK : FM_ERROR_OUT_OF_HOST_MEMORY);
        }
    }
    return FM_OK;
}

static void close_readers(const surface *own, readers *made) {
    fm_context *context = own->mesh->context;
    for (uint32_t i = 0; made->all && i < made->count; i++) {
        fm_octree_free(context, made->all[i].links, made->all[i].link_room * sizeof *made->all[i].links);
        fm_octree_free(context, made->all[i].heads, FM_TILE_VOXELS * sizeof *made->all[i].heads);
    }
    fm_octree_free(context, made->users, made->count * sizeof *made->users);
    fm_octree_free(context, made->all, made->count * sizeof *made->all);
}

fm_result fm_octree_voxels_from_mesh(fm_mesh *mesh, const fm_octree_desc *desc, const double low[3], const double high[3],
                                     fm_octree **octree) {
    surface own = {.mesh = mesh, .desc = desc};
    readers made = {0};
    fm_result result = prepare(&own, low, high);
    result = result == FM_OK ? open_readers(&own, &made) : result;
    if (result == FM_OK) {
        const fm_voxel_source source = {
            .shape = {own.grid.shape.x, own.grid.shape.y, own.grid.shape.z}, .read = read_surface, .air = no_triangles};
        fm_voxel_feed feed = {
            .source = &source, .user = made.users[0], .users = made.users, .contour = own.contours ? contour_at : NULL};
        result = fm_voxel_build(mesh->context, &feed, desc, low, high, octree);
    }
    close_readers(&own, &made);
    release(&own);
    return result;
}
