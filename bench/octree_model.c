// SPDX-License-Identifier: MIT
// What octrees are made of and looked at: models, cameras, and the truth by ray-traced triangles.

#include "meshes.h"
#include "octree.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

// Turned and lifted as in most portraits; nothing of a model is parallel to the picture.
static const double yaw = 0.9, pitch = 0.35, fov = 45, tight = 0.8, pi = 3.14159265358979323846;

const char *const bench_octree_view_words[] = {"whole", "half", "close", NULL};

// How much nearer than for the whole model, towards what the middle of the picture shows.
static const double nearer[BENCH_OCTREE_VIEWS] = {1, 0.45, 0.08};

// ---------------------------------------------------------------------------------------------------------------------------
// Shapes with a formula, and a building
// ---------------------------------------------------------------------------------------------------------------------------

static const float sphere_radius = 0.45f, torus_radius = 0.35f, torus_tube = 0.13f, box_half[3] = {0.41f, 0.27f, 0.33f};

static double from_sphere(const float p[3]) {
    return fabs(sqrt((double)p[0] * p[0] + (double)p[1] * p[1] + (double)p[2] * p[2]) - sphere_radius);
}

static double from_torus(const float p[3]) {
    const double around = hypot((double)p[0], (double)p[1]) - torus_radius;
    return fabs(hypot(around, (double)p[2]) - torus_tube);
}

static double from_box(const float p[3]) {
    double outside = 0, inside = -INFINITY;
    for (int i = 0; i < 3; i++) {
        const double beyond = fabs((double)p[i]) - box_half[i];
        outside += fmax(beyond, 0) * fmax(beyond, 0);
        inside = fmax(inside, beyond);
    }
    return outside > 0 ? sqrt(outside) : -inside;
}

typedef struct boxes {
    float (*vertices)[3];
    uint32_t (*triangles)[3];
    uint64_t vertex_count, triangle_count, room;
} boxes;

static bool add_box(boxes *all, const double low[3], const double high[3]) {
    const float a[3] = {(float)low[0], (float)low[1], (float)low[2]}, b[3] = {(float)high[0], (float)high[1], (float)high[2]};
    scene_mesh box = scene_mesh_box(a, b);
    if (all->triangle_count + box.triangle_count > all->room) {
        all->room = 2 * all->room + 4096;
        void *vertices = realloc(all->vertices, all->room * sizeof *all->vertices);
        all->vertices = vertices ? vertices : all->vertices;
        void *triangles = realloc(all->triangles, all->room * sizeof *all->triangles);
        all->triangles = triangles ? triangles : all->triangles;
        if (!vertices || !triangles) {
            scene_mesh_free(&box);
            return false;
        }
    }
    for (uint64_t i = 0; i < box.triangle_count; i++) {
        for (int k = 0; k < 3; k++) {
            all->triangles[all->triangle_count + i][k] = (uint32_t)(all->vertex_count + box.triangles[i][k]);
        }
    }
    memcpy(all->vertices + all->vertex_count, box.vertices, box.vertex_count * sizeof *box.vertices);
    all->vertex_count += box.vertex_count;
    all->triangle_count += box.triangle_count;
    scene_mesh_free(&box);
    return true;
}

// A box of a front, `along` and `above` in bays; fronts 0 and 1 go along x, 2 and 3 along y.
static bool add_front(boxes *all, int front, const double along[2], const double above[2], double bay) {
    const int x = front < 2 ? 0 : 1;
    const double wall = front & 1 ? 14 - 0.15 : 2;
    double low[3], high[3];
    low[x] = along[0] * bay;
    high[x] = along[1] * bay;
    low[1 - x] = wall * bay;
    high[1 - x] = (wall + 0.15) * bay;
    low[2] = above[0] * bay;
    high[2] = above[1] * bay;
    return add_box(all, low, high);
}

// Twelve floors of twelve bays along each front, of edge 1/16 in a box of edge 1, so that parts repeat every so many cells.
static bool building(boxes *all) {
    const double bay = 1.0 / 16;
    bool good = true;
    for (int z = 2; z < 14 && good; z++) {
        good = add_box(all, (const double[3]){2 * bay, 2 * bay, z * bay}, (const double[3]){14 * bay, 14 * bay, (z + 0.1) * bay});
        for (int i = 0; i < 48 && good; i++) {
            const double at = 2 + i % 12;
            good = add_front(all, i / 12, (const double[2]){at, at + 0.3}, (const double[2]){z + 0.1, z + 1}, bay) &&
                   add_front(all, i / 12, (const double[2]){at + 0.3, at + 1}, (const double[2]){z + 0.3, z + 0.35}, bay);
        }
    }
    return good;
}

// ---------------------------------------------------------------------------------------------------------------------------
// Models
// ---------------------------------------------------------------------------------------------------------------------------

static fm_mesh *make_mesh(const char *name, uint32_t triangles, bench_octree_model *model) {
    fm_mesh *made = NULL;
    if (strcmp(name, "building") == 0 || strcmp(name, "box") == 0) {
        boxes all = {0};
        const double low[3] = {-(double)box_half[0], -(double)box_half[1], -(double)box_half[2]},
                     high[3] = {(double)box_half[0], (double)box_half[1], (double)box_half[2]};
        const bool is_box = strcmp(name, "box") == 0;
        if (is_box ? add_box(&all, low, high) : building(&all)) {
            const fm_mesh_desc desc = {(const float(*)[3])all.vertices, all.vertex_count, (const uint32_t(*)[3])all.triangles,
                                       all.triangle_count};
            (void)fm_mesh_create(model->context, &desc, &made);
        }
        if (!is_box) {
            memcpy(model->high, (const float[3]){1, 1, 1}, sizeof model->high);
        }
        free(all.vertices);
        free(all.triangles);
        return made;
    }
    bench_mesh *mesh = bench_mesh_create(name, triangles, true);
    made = mesh ? bench_mesh_on(mesh, model->context, 0) : NULL;
    bench_mesh_destroy(mesh);
    return made;
}

static void measure_box(bench_octree_model *model) {
    const float(*vertices)[3];
    uint64_t vertex_count, triangle_count;
    fm_mesh_arrays(model->mesh, &vertices, &vertex_count, NULL, &triangle_count);
    double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (uint64_t v = 0; v < vertex_count; v++) {
        for (int i = 0; i < 3; i++) {
            if (fabsf(vertices[v][i]) < 1e18f) {
                low[i] = fmin(low[i], (double)vertices[v][i]);
                high[i] = fmax(high[i], (double)vertices[v][i]);
            }
        }
    }
    double square = 0;
    for (int i = 0; i < 3; i++) {
        const double edge = high[i] >= low[i] ? high[i] - low[i] : 0;
        model->middle[i] = high[i] >= low[i] ? (low[i] + high[i]) / 2 : 0;
        model->longest = fmax(model->longest, edge);
        square += edge * edge;
    }
    model->radius = sqrt(square) / 2;
    model->triangles = (double)triangle_count;
}

bench_octree_model *bench_octree_model_create(bench_session *session, const char *name, uint32_t triangles,
                                              const bench_octree_plan *plan) {
    static const struct {
        const char *name;
        double (*distance)(const float place[3]);
    } formulas[] = {{"sphere", from_sphere}, {"torus", from_torus}, {"box", from_box}};
    bench_octree_model *model = calloc(1, sizeof *model);
    if (!model) {
        return NULL;
    }
    snprintf(model->name, sizeof model->name, "%s", name);
    model->context = bench_session_context(session, FM_BACKEND_AUTO);
    model->width = plan->width;
    model->height = plan->height;
    model->upright = plan->upright;
    for (size_t i = 0; i < sizeof formulas / sizeof formulas[0]; i++) {
        model->distance = strcmp(name, formulas[i].name) == 0 ? formulas[i].distance : model->distance;
    }
    model->mesh = model->context ? make_mesh(name, triangles, model) : NULL;
    if (!model->mesh) {
        bench_octree_model_destroy(model);
        return NULL;
    }
    measure_box(model);
    return model;
}

void bench_octree_model_destroy(bench_octree_model *model) {
    if (model) {
        for (int i = 0; i < BENCH_OCTREE_VIEWS; i++) {
            free(model->views[i].truth);
            free(model->views[i].picture);
        }
        fm_mesh_destroy(model->mesh);
        free(model);
    }
}

// ---------------------------------------------------------------------------------------------------------------------------
// Views
// ---------------------------------------------------------------------------------------------------------------------------

// The ball's rim is cut off: what fills its box rarely comes near it.
fm_camera bench_octree_camera(const double middle[3], double radius, double aspect, bool upright) {
    const double half = atan(tan(fov * pi / 360) * fmin(aspect, 1)), away = tight * radius / sin(half);
    const double level = -cos(pitch) * sin(yaw), down = -sin(pitch);
    const double way[3] = {-cos(pitch) * cos(yaw), upright ? down : level, upright ? -level : down};
    fm_camera camera = {.fov_y = (float)fov};
    camera.up[upright ? 1 : 2] = 1;
    for (int i = 0; i < 3; i++) {
        camera.forward[i] = (float)way[i];
        camera.position[i] = (float)(middle[i] - away * way[i]);
    }
    return camera;
}

static void cross(const double a[3], const double b[3], double out[3]) {
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        out[i] = a[j] * b[k] - a[k] * b[j];
    }
}

static double unit(double v[3]) {
    const double length = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    for (int i = 0; i < 3; i++) {
        v[i] /= length > 0 ? length : 1;
    }
    return length;
}

void bench_octree_rays(const fm_camera *camera, uint32_t width, uint32_t height, fm_mesh_ray *rays, double *step) {
    double forward[3], up[3], right[3], down[3];
    for (int i = 0; i < 3; i++) {
        forward[i] = (double)camera->forward[i];
        up[i] = (double)camera->up[i];
    }
    unit(forward);
    cross(forward, up, right);
    unit(right);
    cross(forward, right, down);
    const double pixel = 2 * tan((double)camera->fov_y * pi / 360) / height;
    for (uint64_t at = 0; at < (uint64_t)width * height; at++) {
        const double x = pixel * ((double)(at % width) + 0.5 - 0.5 * width),
                     y = pixel * ((double)(at / width) + 0.5 - 0.5 * height);
        double way[3];
        for (int i = 0; i < 3; i++) {
            way[i] = forward[i] + x * right[i] + y * down[i];
        }
        unit(way);
        rays[at] = (fm_mesh_ray){{camera->position[0], camera->position[1], camera->position[2]},
                                 0,
                                 {(float)way[0], (float)way[1], (float)way[2]},
                                 1e30f};
    }
    if (step) {
        *step = pixel;
    }
}

static float shown(double light) {
    const double v = fmin(fmax(light, 0), 1);
    return (float)(v <= 0.0031308 ? 12.92 * v : 1.055 * pow(v, 1 / 2.4) - 0.055);
}

void bench_octree_shade(const fm_camera *camera, const bench_octree_seen *seen, const fm_mesh_ray *rays, uint64_t count,
                        float *picture) {
    static const double clay[3] = {0.72, 0.66, 0.60}, sky[3] = {0.60, 0.68, 0.78};
    double back[3], up[3], left[3], sun[3];
    for (int k = 0; k < 3; k++) {
        back[k] = -(double)camera->forward[k];
        up[k] = (double)camera->up[k];
    }
    cross(back, up, left);
    for (int k = 0; k < 3; k++) {
        sun[k] = 0.55 * back[k] + 0.6 * up[k] + 0.6 * left[k];
    }
    unit(sun);
    for (uint64_t i = 0; i < count; i++) {
        double toward_sun = 0, toward_eye = 0, above = 0;
        for (int k = 0; k < 3; k++) {
            const double n = (double)seen[i].normal[k];
            toward_sun += sun[k] * n;
            toward_eye -= (double)rays[i].direction[k] * n;
            above += up[k] * n;
        }
        const double light = 0.16 + 0.08 * above + 0.6 * fmax(toward_sun, 0) + 0.2 * fmax(toward_eye, 0);
        for (int k = 0; k < 3; k++) {
            picture[3 * i + (uint64_t)k] = shown(isfinite(seen[i].t) ? light * clay[k] : sky[k]);
        }
    }
}

void bench_octree_bytes(const float *picture, uint64_t numbers, uint8_t *bytes) {
    for (uint64_t i = 0; i < numbers; i++) {
        bytes[i] = (uint8_t)(picture[i] * 255 + 0.5f);
    }
}

static void normal_of(const bench_octree_model *model, uint32_t triangle, const float way[3], float normal[3]) {
    const float(*v)[3];
    const uint32_t(*t)[3];
    fm_mesh_arrays(model->mesh, &v, NULL, &t, NULL);
    double edges[2][3], n[3], along = 0;
    for (int e = 0; e < 2; e++) {
        for (int k = 0; k < 3; k++) {
            edges[e][k] = (double)v[t[triangle][e + 1]][k] - (double)v[t[triangle][0]][k];
        }
    }
    cross(edges[0], edges[1], n);
    unit(n);
    for (int k = 0; k < 3; k++) {
        along += n[k] * (double)way[k];
    }
    for (int k = 0; k < 3; k++) {
        normal[k] = (float)(along > 0 ? -n[k] : n[k]);
    }
}

static bool place_camera(bench_octree_model *model, uint32_t view) {
    fm_camera *camera = &model->views[view].camera;
    *camera = bench_octree_camera(model->middle, model->radius, (double)model->width / model->height, model->upright);
    if (nearer[view] < 1) {
        fm_mesh_ray ray;
        fm_mesh_hit hit;
        bench_octree_rays(camera, 1, 1, &ray, NULL);
        if (fm_mesh_cast(model->mesh, &ray, 1, false, &hit) != FM_OK) {
            return false;
        }
        double away = 0;
        for (int i = 0; i < 3; i++) {
            away += pow((double)camera->position[i] - model->middle[i], 2);
        }
        // Through a hole: what is behind it is the middle.
        const double depth = isfinite(hit.t) ? (double)hit.t : sqrt(away);
        for (int i = 0; i < 3; i++) {
            camera->position[i] += (float)((1 - nearer[view]) * depth * (double)ray.direction[i]);
        }
    }
    return true;
}

static bool trace(bench_octree_model *model, bench_octree_view *view, fm_mesh_ray *rays, fm_mesh_hit *hits) {
    const uint64_t count = (uint64_t)model->width * model->height;
    bench_octree_rays(&view->camera, model->width, model->height, rays, NULL);
    if (fm_mesh_cast(model->mesh, rays, (uint32_t)count, false, hits) != FM_OK) {
        return false;
    }
    for (uint64_t i = 0; i < count; i++) {
        view->truth[i] = (bench_octree_seen){.t = hits[i].t};
        if (isfinite(hits[i].t)) {
            normal_of(model, hits[i].triangle, rays[i].direction, view->truth[i].normal);
        }
    }
    bench_octree_shade(&view->camera, view->truth, rays, count, view->picture);
    return true;
}

const bench_octree_view *bench_octree_view_of(bench_octree_model *model, uint32_t view) {
    bench_octree_view *v = &model->views[view];
    if (v->truth) {
        return v;
    }
    const uint64_t count = (uint64_t)model->width * model->height;
    v->truth = malloc(count * sizeof *v->truth);
    v->picture = malloc(3 * count * sizeof *v->picture);
    fm_mesh_ray *rays = malloc(count * sizeof *rays);
    fm_mesh_hit *hits = malloc(count * sizeof *hits);
    const bool good = v->truth && v->picture && rays && hits && place_camera(model, view) && trace(model, v, rays, hits);
    free(rays);
    free(hits);
    if (good) {
        return v;
    }
    free(v->truth);
    free(v->picture);
    v->truth = NULL;
    v->picture = NULL;
    return NULL;
}
