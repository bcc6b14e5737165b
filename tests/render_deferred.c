// SPDX-License-Identifier: MIT
// Deferred pictures of meshes and fields: surfaces against the sphere that they are of, shadows against what geometry says, the
// device against the processor, and arguments that are refused.

#include "fathom/deferred.h"
#include "fathom/sdf.h"
#include "meshes.h"
#include "vulkan_common.h"

#include <math.h>

enum { WIDTH = 160, HEIGHT = 120, PIXELS = WIDTH * HEIGHT, TEXELS = 72 };

static const float sphere_radius = 0.3f, sphere_z = 0.7f, edge = 2;

// A sphere above the square z = 0, as a mesh and as an exact field.
typedef struct stage {
    fm_context *context;
    fm_mesh *mesh;
    fm_volume *field;
    fm_deferred *deferred;
} stage;

static float field_of(const double p[3]) {
    const double up = p[2] - (double)sphere_z;
    return (float)fmin(sqrt(p[0] * p[0] + p[1] * p[1] + up * up) - (double)sphere_radius, p[2]);
}

static bool make_field(stage *s) {
    const double spacing = (double)edge / TEXELS;
    fm_volume_desc desc = {.shape = {TEXELS, TEXELS, TEXELS}, .type = FM_TYPE_F32};
    static float texels[TEXELS * TEXELS * TEXELS];
    for (int i = 0; i < 3; i++) {
        desc.spacing[i] = spacing;
        desc.origin[i] = (i < 2 ? -0.5 * (double)edge : -0.2) + 0.5 * spacing;
    }
    for (int i = 0; i < TEXELS * TEXELS * TEXELS; i++) {
        const int at[3] = {i % TEXELS, i / TEXELS % TEXELS, i / TEXELS / TEXELS};
        double p[3];
        for (int k = 0; k < 3; k++) {
            p[k] = desc.origin[k] + spacing * at[k];
        }
        texels[i] = field_of(p);
    }
    return CHECK_OK(fm_volume_create(s->context, &desc, &s->field)) && CHECK_OK(fm_volume_upload(s->field, texels));
}

static bool make_mesh(stage *s) {
    const float centre[3] = {0, 0, sphere_z}, low[3] = {-0.5f * edge, -0.5f * edge, -0.05f},
                high[3] = {0.5f * edge, 0.5f * edge, 0};
    scene_mesh ball = scene_mesh_sphere(96, 192, centre, sphere_radius), floor = scene_mesh_box(low, high);
    const fm_mesh_desc parts[] = {scene_mesh_describe(&ball), scene_mesh_describe(&floor)};
    float(*vertices)[3] = malloc((parts[0].vertex_count + parts[1].vertex_count) * sizeof *vertices);
    uint32_t(*triangles)[3] = malloc((parts[0].triangle_count + parts[1].triangle_count) * sizeof *triangles);
    bool good = CHECK(vertices && triangles);
    fm_mesh_desc all = {(const float(*)[3])vertices, 0, (const uint32_t(*)[3])triangles, 0};
    for (int part = 0; part < 2 && good; part++) {
        memcpy(vertices + all.vertex_count, parts[part].vertices, parts[part].vertex_count * sizeof *vertices);
        for (uint64_t i = 0; i < parts[part].triangle_count; i++) {
            for (int k = 0; k < 3; k++) {
                triangles[all.triangle_count + i][k] = parts[part].triangles[i][k] + (uint32_t)all.vertex_count;
            }
        }
        all.vertex_count += parts[part].vertex_count;
        all.triangle_count += parts[part].triangle_count;
    }
    good = good && CHECK_OK(fm_mesh_create(s->context, &all, &s->mesh));
    free(vertices);
    free(triangles);
    scene_mesh_free(&ball);
    scene_mesh_free(&floor);
    return good;
}

static bool open_stage(stage *s, fm_context *context) {
    *s = (stage){.context = context};
    return make_mesh(s) && make_field(s) && CHECK_OK(fm_deferred_create(context, &s->deferred));
}

static void close_stage(stage *s) {
    fm_deferred_destroy(s->deferred);
    fm_volume_destroy(s->field);
    fm_mesh_destroy(s->mesh);
}

// From the side, the sphere and the middle of its shadow in the picture; the light stands above.
static fm_deferred_desc view_of(const stage *s, fm_surface surface, fm_shadows shadows) {
    return (fm_deferred_desc){.camera = {.position = {0, -2.4f, 1.6f}, .forward = {0, 2.4f, -1.3f}, .up = {0, 0, 1}, .fov_y = 45},
                              .width = WIDTH,
                              .height = HEIGHT,
                              .surface = surface,
                              .mesh = s->mesh,
                              .field = s->field,
                              .shadows = shadows,
                              .light_count = 1,
                              .lights = {{.way = {0, 0, 1}, .size = 10}}};
}

static bool render(stage *s, const fm_deferred_desc *desc, float *shares, float *depths, uint8_t *pixels) {
    return CHECK_OK(fm_deferred_render(s->deferred, desc, NULL)) && CHECK_OK(fm_deferred_shares(s->deferred, shares)) &&
           CHECK_OK(fm_deferred_depths(s->deferred, depths)) && CHECK_OK(fm_deferred_read(s->deferred, pixels));
}

// The way of a pixel's ray, of length 1.
static void way_of(const fm_camera *camera, int x, int y, double way[3]) {
    const double f[3] = {(double)camera->forward[0], (double)camera->forward[1], (double)camera->forward[2]};
    const double size = sqrt(f[1] * f[1] + f[2] * f[2]), pixel = 2 * tan(45 * 3.14159265358979 / 360) / HEIGHT;
    const double right = (x + 0.5 - 0.5 * WIDTH) * pixel, down = (y + 0.5 - 0.5 * HEIGHT) * pixel;
    // forward lies in the plane x = 0: right is x, down is forward turned by a quarter.
    way[0] = right;
    way[1] = f[1] / size + down * f[2] / size;
    way[2] = f[2] / size - down * f[1] / size;
    const double length = sqrt(way[0] * way[0] + way[1] * way[1] + way[2] * way[2]);
    for (int i = 0; i < 3; i++) {
        way[i] /= length;
    }
}

// Where the ray meets the sphere or the square, and how near to the sphere's outline it runs.
static double true_depth(const fm_camera *camera, const double way[3], double *off_outline) {
    double from[3], along = 0, square = 0;
    for (int i = 0; i < 3; i++) {
        from[i] = (double)camera->position[i] - (i == 2 ? (double)sphere_z : 0);
        along += from[i] * way[i];
        square += from[i] * from[i];
    }
    const double radius = (double)sphere_radius, off = sqrt(square - along * along), floor = -(double)camera->position[2] / way[2];
    *off_outline = fabs(off - radius);
    if (off < radius) {
        return -along - sqrt(radius * radius - off * off);
    }
    const double x = (double)camera->position[0] + way[0] * floor, y = (double)camera->position[1] + way[1] * floor;
    *off_outline = fmin(*off_outline, fmin(fabs(fabs(x) - 0.5 * (double)edge), fabs(fabs(y) - 0.5 * (double)edge)));
    return floor > 0 && fabs(x) < 0.5 * (double)edge && fabs(y) < 0.5 * (double)edge ? floor : INFINITY;
}

static float shares[PIXELS], depths[PIXELS], other_shares[PIXELS], other_depths[PIXELS];
static uint8_t pixels[4 * PIXELS], other_pixels[4 * PIXELS];

static void check_surfaces(stage *s) {
    const double voxel = (double)edge / TEXELS;
    for (int kind = 0; kind < 2; kind++) {
        const fm_deferred_desc desc = view_of(s, (fm_surface)kind, FM_SHADOWS_NONE);
        if (!render(s, &desc, shares, depths, pixels)) {
            return;
        }
        int wrong = 0, looked = 0;
        for (int i = 0; i < PIXELS; i++) {
            double way[3], off;
            way_of(&desc.camera, i % WIDTH, i / WIDTH, way);
            const double depth = true_depth(&desc.camera, way, &off);
            if (off > 2 * voxel && !isinf(depth)) {
                // A field between texels is off by what a sphere bends over a cell; a mesh by what its triangles do.
                looked++;
                wrong += !(fabs((double)depths[i] - depth) < (kind ? 0.2 * voxel : 2e-3));
            }
        }
        CHECK(looked > PIXELS / 4);
        CHECK(wrong == 0);
    }
}

// The share of a disc light of half angle 10 degrees that a place of the floor sees past the sphere, by many rays.
static double true_share(double x, double y) {
    int seen = 0;
    enum { RAYS = 4096 };
    for (int i = 0; i < RAYS; i++) {
        const double r = tan(10 * 3.14159265358979 / 180) * sqrt((i + 0.5) / RAYS), a = 2.39996323 * i;
        double way[3] = {r * cos(a), r * sin(a), 1};
        const double length = sqrt(way[0] * way[0] + way[1] * way[1] + 1);
        const double from[3] = {x, y, -(double)sphere_z};
        double along = 0, square = 0;
        for (int k = 0; k < 3; k++) {
            along += from[k] * way[k] / length;
            square += from[k] * from[k];
        }
        seen += square - along * along > (double)sphere_radius * (double)sphere_radius;
    }
    return (double)seen / RAYS;
}

static double shadow_error(stage *s, fm_shadows shadows, uint32_t samples) {
    fm_deferred_desc desc = view_of(s, FM_SURFACE_MESH, shadows);
    desc.samples = samples;
    if (!render(s, &desc, shares, depths, pixels)) {
        return 1;
    }
    double sum = 0;
    int count = 0;
    for (int i = 0; i < PIXELS; i++) {
        double way[3], at[3];
        way_of(&desc.camera, i % WIDTH, i / WIDTH, way);
        for (int k = 0; k < 3; k++) {
            at[k] = (double)desc.camera.position[k] + way[k] * (double)depths[i];
        }
        if (fabs(at[2]) < 1e-3 && shares[i] >= 0) {
            const double error = (double)shares[i] - true_share(at[0], at[1]);
            sum += error * error;
            count++;
        }
    }
    CHECK(count > PIXELS / 4);
    return sqrt(sum / count);
}

static void check_shadows(stage *s) {
    const double truth = shadow_error(s, FM_SHADOWS_DISTRIBUTED, 256), ours = shadow_error(s, FM_SHADOWS_FIELD, 1);
    const double split = shadow_error(s, FM_SHADOWS_FIELD, 16), published = shadow_error(s, FM_SHADOWS_RTSDF, 0);
    const double hard = shadow_error(s, FM_SHADOWS_RAY, 0), map = shadow_error(s, FM_SHADOWS_MAP, 0);
    printf("error of shadows: rays %.4f, field %.4f, field in 16 %.4f, RTSDF %.4f, one ray %.4f, map %.4f\n", truth, ours, split,
           published, hard, map);
    CHECK(truth < 0.01);
    CHECK(ours < 0.04);
    CHECK(split < 0.04);
    CHECK(published > 2 * ours && published < 0.5);
    CHECK(hard > ours && hard < 0.3);
    CHECK(map > ours && map < 0.3);
}

// Rays that leave the field's surface do not meet the triangles that it stands for: the sphere's upper half and the floor beyond
// the penumbra see all of the light, and the floor under the sphere sees no middle of it.
static void check_rays_from_field(stage *s, fm_shadows shadows, float level) {
    fm_deferred_desc desc = view_of(s, FM_SURFACE_FIELD, shadows);
    desc.samples = 16;
    desc.map_edge = 512;
    desc.level = level;
    if (!render(s, &desc, shares, depths, pixels)) {
        return;
    }
    const double umbra = (double)sphere_radius, voxel = (double)edge / TEXELS, reach = umbra + 0.2 * (double)sphere_z + 4 * voxel;
    int open = 0, shut = 0, wrong = 0;
    for (int i = 0; i < PIXELS; i++) {
        double way[3], at[3];
        way_of(&desc.camera, i % WIDTH, i / WIDTH, way);
        for (int k = 0; k < 3; k++) {
            at[k] = (double)desc.camera.position[k] + way[k] * (double)depths[i];
        }
        const double off = hypot(at[0], at[1]), side = fmax(fabs(at[0]), fabs(at[1]));
        const bool lit = at[2] > (double)sphere_z + 0.1 || (at[2] < 0.1 && off > reach && side < 0.5 * (double)edge - 3 * voxel);
        const bool dark = shadows == FM_SHADOWS_RAY && at[2] < 0.1 && off < umbra - 3 * voxel;
        open += lit;
        shut += dark;
        wrong += (lit && !(shares[i] > 0.999f)) || (dark && shares[i] != 0);
    }
    if (!CHECK(open > PIXELS / 8 && (shut > 100) == (shadows == FM_SHADOWS_RAY) && wrong == 0)) {
        fprintf(stderr, "    shadows %d, level %g: %d open, %d shut, %d wrong\n", (int)shadows, (double)level, open, shut, wrong);
    }
}

// Far from the origin, floats are a few units of a thousandth apart; a picture is still that of the mesh.
static void check_far_away(fm_context *context) {
    enum { FAR = 1 << 20 };
    const float low[3] = {FAR, FAR, FAR}, high[3] = {FAR + 64, FAR + 64, FAR + 64};
    scene_mesh box = scene_mesh_box(low, high);
    const fm_mesh_desc parts = scene_mesh_describe(&box);
    stage s = {.context = context};
    if (CHECK_OK(fm_mesh_create(context, &parts, &s.mesh)) && CHECK_OK(fm_deferred_create(context, &s.deferred))) {
        fm_deferred_desc desc = view_of(&s, FM_SURFACE_MESH, FM_SHADOWS_RAY);
        desc.camera = (fm_camera){.position = {FAR + 32, FAR + 32, FAR + 200}, .forward = {0, 0, -1}, .up = {0, 1, 0}, .fov_y = 20};
        if (render(&s, &desc, shares, depths, pixels)) {
            const int middle = HEIGHT / 2 * WIDTH + WIDTH / 2;
            CHECK(fabsf(depths[middle] - 136) < 1 && shares[middle] > 0.999f);
        }
        desc.camera.position[0] = 1e19f;
        CHECK_FAILS(fm_deferred_render(s.deferred, &desc, NULL), FM_ERROR_INVALID_ARGUMENT);
    }
    close_stage(&s);
    scene_mesh_free(&box);
}

static double picture_error(const double *reference) {
    double sum = 0;
    for (int i = 0; i < 4 * PIXELS; i++) {
        sum += (pixels[i] - reference[i]) * (pixels[i] - reference[i]);
    }
    return sqrt(sum / (4 * PIXELS));
}

// Blended frames of a camera that rests come to show what a picture of four times as many pixels a side shows.
static void check_blending(stage *s) {
    enum { FINER = 4 };
    static uint8_t fine[FINER * FINER * 4 * PIXELS];
    static double reference[4 * PIXELS];
    fm_deferred_desc desc = view_of(s, FM_SURFACE_MESH, FM_SHADOWS_RAY);
    desc.width *= FINER;
    desc.height *= FINER;
    if (!CHECK_OK(fm_deferred_render(s->deferred, &desc, NULL)) || !CHECK_OK(fm_deferred_read(s->deferred, fine))) {
        return;
    }
    memset(reference, 0, sizeof reference);
    for (int i = 0; i < FINER * FINER * PIXELS; i++) {
        const int x = i % (FINER * WIDTH) / FINER, y = i / (FINER * WIDTH) / FINER;
        for (int k = 0; k < 4; k++) {
            reference[4 * (y * WIDTH + x) + k] += fine[4 * i + k] / (double)(FINER * FINER);
        }
    }
    desc = view_of(s, FM_SURFACE_MESH, FM_SHADOWS_RAY);
    if (!render(s, &desc, shares, depths, pixels)) {
        return;
    }
    const double single = picture_error(reference);
    desc.taa = true;
    for (desc.frame = 0; desc.frame < 32; desc.frame++) {
        if (!render(s, &desc, shares, depths, pixels)) {
            return;
        }
    }
    const double blended = picture_error(reference);
    printf("error of a picture against one of %d x %d times the pixels: %.3f of 255, blended %.3f\n", FINER, FINER, single,
           blended);
    CHECK(blended < 0.6 * single);
}

static void check_arguments(stage *s) {
    fm_deferred_desc desc = view_of(s, FM_SURFACE_FIELD, FM_SHADOWS_FIELD);
    CHECK_FAILS(fm_deferred_render(NULL, &desc, NULL), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_deferred_render(s->deferred, NULL, NULL), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_deferred_read(s->deferred, NULL), FM_ERROR_INVALID_ARGUMENT);
    fm_volume_buffer buffer;
    fm_deferred *fresh = NULL;
    if (CHECK_OK(fm_deferred_create(s->context, &fresh))) {
        CHECK_FAILS(fm_deferred_read(fresh, pixels), FM_ERROR_INVALID_ARGUMENT);
        CHECK_FAILS(fm_deferred_depths(fresh, depths), FM_ERROR_INVALID_ARGUMENT);
        CHECK_FAILS(fm_deferred_vulkan(fresh, &buffer), FM_ERROR_INVALID_ARGUMENT);
        fm_deferred_destroy(fresh);
    }
    CHECK_OK(fm_deferred_render(s->deferred, &desc, NULL));
    CHECK_FAILS(fm_deferred_vulkan(s->deferred, NULL), FM_ERROR_INVALID_ARGUMENT);
    if (fm_context_backend(s->context) == FM_BACKEND_CPU) {
        CHECK_FAILS(fm_deferred_vulkan(s->deferred, &buffer), FM_ERROR_UNSUPPORTED);
    } else if (CHECK_OK(fm_deferred_vulkan(s->deferred, &buffer))) {
        CHECK(buffer.buffer && buffer.size == 4 * (uint64_t)desc.width * desc.height);
    }
    struct {
        int which;
        fm_result wanted;
    } cases[] = {{0, FM_ERROR_INVALID_ARGUMENT},  {1, FM_ERROR_INVALID_ARGUMENT},  {2, FM_ERROR_INVALID_ARGUMENT},
                 {3, FM_ERROR_INVALID_ARGUMENT},  {4, FM_ERROR_INVALID_ARGUMENT},  {5, FM_ERROR_INVALID_ARGUMENT},
                 {6, FM_ERROR_UNSUPPORTED},       {7, FM_ERROR_INVALID_ARGUMENT},  {8, FM_ERROR_INVALID_ARGUMENT},
                 {9, FM_ERROR_INVALID_ARGUMENT},  {10, FM_ERROR_INVALID_ARGUMENT}, {11, FM_ERROR_INVALID_ARGUMENT},
                 {12, FM_ERROR_INVALID_ARGUMENT}, {13, FM_ERROR_INVALID_ARGUMENT}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        desc = view_of(s, FM_SURFACE_FIELD, FM_SHADOWS_FIELD);
        desc.width = cases[i].which == 0 ? 0 : desc.width;
        desc.height = cases[i].which == 1 ? 20000 : desc.height;
        desc.surface = cases[i].which == 2 ? (fm_surface)7 : desc.surface;
        desc.field = cases[i].which == 3 ? NULL : desc.field;
        desc.light_count = cases[i].which == 4 ? 5 : desc.light_count;
        desc.lights[0].size = cases[i].which == 5 ? NAN : desc.lights[0].size;
        desc.lights[0].kind = cases[i].which == 6 ? FM_LIGHT_AREA : desc.lights[0].kind;
        desc.shadows = cases[i].which == 6 ? FM_SHADOWS_MAP : desc.shadows;
        desc.lights[0].way[2] = cases[i].which == 7 ? 0 : desc.lights[0].way[2];
        desc.level = cases[i].which == 8 ? NAN : desc.level;
        desc.max_step = cases[i].which == 9 ? -1 : desc.max_step;
        desc.samples = cases[i].which == 10 ? 100000 : desc.samples;
        desc.camera.forward[1] = cases[i].which == 11 ? INFINITY : desc.camera.forward[1];
        desc.shadows = cases[i].which == 12 ? FM_SHADOWS_DISTRIBUTED : desc.shadows;
        desc.mesh = cases[i].which == 12 ? NULL : desc.mesh;
        desc.view = cases[i].which == 13 ? (fm_deferred_view)9 : desc.view;
        CHECK_FAILS(fm_deferred_render(s->deferred, &desc, NULL), cases[i].wanted);
    }
}

// The field of an empty mesh is infinite everywhere: all light arrives.
static void check_empty_field(stage *s) {
    static float texels[TEXELS * TEXELS * TEXELS];
    for (int i = 0; i < TEXELS * TEXELS * TEXELS; i++) {
        texels[i] = INFINITY;
    }
    const fm_deferred_desc desc = view_of(s, FM_SURFACE_MESH, FM_SHADOWS_FIELD);
    if (!CHECK_OK(fm_volume_upload(s->field, texels)) || !render(s, &desc, shares, depths, pixels)) {
        return;
    }
    int dark = 0;
    for (int i = 0; i < PIXELS; i++) {
        dark += shares[i] > 0 && shares[i] < 1;
    }
    CHECK(dark == 0);
}

static void check_one(fm_context *context) {
    stage s;
    if (open_stage(&s, context)) {
        check_surfaces(&s);
        check_shadows(&s);
        const fm_shadows by_rays[] = {FM_SHADOWS_RAY, FM_SHADOWS_DISTRIBUTED};
        for (int i = 0; i < 4; i++) {
            check_rays_from_field(&s, by_rays[i % 2], i / 2 ? -0.04f : 0);
        }
        check_blending(&s);
        check_arguments(&s);
        check_empty_field(&s);
    }
    close_stage(&s);
    check_far_away(context);
}

// Pictures of the device differ from the processor's by rounding only.
static void check_agreement(fm_context *host, fm_context *device) {
    stage a, b;
    if (open_stage(&a, host) && open_stage(&b, device)) {
        for (int shadows = 0; shadows <= FM_SHADOWS_MAP; shadows++) {
            fm_deferred_desc desc = view_of(&a, (fm_surface)(shadows % 2), (fm_shadows)shadows);
            desc.samples = shadows == FM_SHADOWS_DISTRIBUTED ? 16 : 2;
            desc.map_edge = 256;
            fm_deferred_desc same = desc;
            same.mesh = b.mesh;
            same.field = b.field;
            if (!render(&a, &desc, shares, depths, pixels) || !render(&b, &same, other_shares, other_depths, other_pixels)) {
                break;
            }
            int different = 0;
            for (int i = 0; i < PIXELS; i++) {
                different += !(fabsf(shares[i] - other_shares[i]) < 2e-3f) || isinf(depths[i]) != isinf(other_depths[i]) ||
                             fabsf(depths[i] - other_depths[i]) > 1e-4f || abs(pixels[4 * i] - other_pixels[4 * i]) > 1;
            }
            if (!CHECK(different <= PIXELS / 500)) {
                fprintf(stderr, "    shadows %d: %d pixels differ\n", shadows, different);
            }
        }
    }
    // What a picture does not need may lie anywhere.
    fm_deferred_desc mixed = view_of(&b, FM_SURFACE_MESH, FM_SHADOWS_NONE);
    mixed.field = a.field;
    CHECK_OK(fm_deferred_render(b.deferred, &mixed, NULL));
    mixed = view_of(&b, FM_SURFACE_FIELD, FM_SHADOWS_FIELD);
    mixed.mesh = a.mesh;
    CHECK_OK(fm_deferred_render(b.deferred, &mixed, NULL));
    mixed.surface = FM_SURFACE_MESH;
    CHECK_FAILS(fm_deferred_render(b.deferred, &mixed, NULL), FM_ERROR_INVALID_ARGUMENT);
    close_stage(&b);
    close_stage(&a);
}

int main(int count, char **arguments) {
    fm_context *host = NULL;
    if (!CHECK_OK(fm_context_create(&(fm_context_desc){.backend = FM_BACKEND_CPU}, &host))) {
        return check_summary();
    }
    if (count > 1) {
        vulkan_options options;
        fm_context *device = NULL;
        if (!vulkan_parse(count, arguments, &options)) {
            return 1;
        }
        if (vulkan_open(&options, NULL, &device) != FM_OK) {
            fm_context_destroy(host);
            return vulkan_missing();
        }
        check_agreement(host, device);
        CHECK(fm_context_validation_messages(device) == 0);
        fm_context_destroy(device);
    } else {
        check_one(host);
    }
    fm_context_destroy(host);
    return check_summary();
}
