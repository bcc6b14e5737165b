// SPDX-License-Identifier: MIT
// What octrees take of host memory is counted by their context: builds of all kinds, triangles that wait, files and streams. And no
// more than is allowed waits in memory.

#include "io_common.h"
#include "measured.h"
#include "meshes.h"

#include "fathom/octree_render.h"

#include <math.h>
#include <string.h>

// Buffers of files, and objects, are not counted.
enum { UNCOUNTED = 256 << 10, WAITING = 512 << 10 };

static const float CENTRE[3] = {0.5f, -1, 2};

static uint64_t counted(fm_context *context, bool peak) {
    fm_memory memory[32];
    uint32_t count = 32;
    uint64_t bytes = 0;
    CHECK_OK(fm_context_memory(context, &count, memory));
    for (uint32_t i = 0; i < count; i++) {
        if (strcmp(memory[i].purpose, "octrees") == 0 && !memory[i].device) {
            bytes += peak ? memory[i].peak : memory[i].bytes;
        }
    }
    return bytes;
}

static fm_mesh *make_mesh(fm_context *context) {
    scene_mesh sphere = scene_mesh_sphere(60, 80, CENTRE, 1);
    const fm_mesh_desc what = scene_mesh_describe(&sphere);
    fm_mesh *mesh = NULL;
    CHECK_OK(fm_mesh_create(context, &what, &mesh));
    scene_mesh_free(&sphere);
    return mesh;
}

static void builds(fm_context *context, fm_mesh *mesh) {
    const fm_octree_desc descs[] = {
        {.size = 96, .threshold = -1, .share = true, .attribute = FM_OCTREE_TRIANGLE},
        {.size = 96, .method = FM_OCTREE_GROWN},
        {.kind = FM_OCTREE_DISTANCE, .size = 96, .sign = FM_SIGN_WINDING},
        {.kind = FM_OCTREE_BRICKS, .size = 96},
        {.kind = FM_OCTREE_VOXELS, .size = 200},
        {.kind = FM_OCTREE_CONTOURS, .size = 200},
        {.kind = FM_OCTREE_DAG, .size = 200},
        {.kind = FM_OCTREE_TREE64, .size = 200},
    };
    for (size_t i = 0; i < sizeof descs / sizeof *descs; i++) {
        fm_octree *octree = NULL;
        const uint64_t before = counted(context, false);
        CHECK_OK(fm_octree_build_mesh(mesh, &descs[i], &octree));
        CHECK(counted(context, false) > before);
        fm_octree_destroy(octree);
        CHECK(counted(context, false) == before);
    }
}

static void streamed(fm_context *context) {
    scene_mesh sphere = scene_mesh_sphere(200, 200, CENTRE, 1);
    const fm_mesh_desc what = scene_mesh_describe(&sphere);
    const fm_octree_desc desc = {.size = 96, .low = {-1, -2.5f, 0.5f}, .high = {2, 0.5f, 3.5f}, .host_bytes = WAITING};
    fm_octree_builder *builder = NULL;
    fm_octree *octree = NULL;
    const uint64_t before = counted(context, false);
    if (CHECK_OK(fm_octree_builder_create(context, &desc, &builder))) {
        const uint64_t begun = counted(context, false);
        CHECK(begun >= before + WAITING);
        CHECK(sphere.triangle_count * 40 > 4 * WAITING);
        CHECK_OK(fm_octree_builder_add(builder, &what, NULL, NULL));
        CHECK(counted(context, false) <= begun + WAITING / 4);
        CHECK_OK(fm_octree_builder_finish(builder, &octree));
    }
    fm_octree_builder_destroy(builder);
    fm_octree_destroy(octree);
    CHECK(counted(context, false) == before);
    scene_mesh_free(&sphere);
}

// On the CPU backend a budget is of all host memory that the stream takes.
static void files(fm_context *context, fm_mesh *mesh) {
    const char *path = io_path("parts.fmo");
    const fm_octree_desc desc = {.size = 96, .threshold = -1};
    const fm_octree_stream_desc streaming = {.distance = 100, .fade_ms = -1, .budget = 1 << 20};
    const fm_camera camera = {.position = {0.5f, -4, 2}, .forward = {0, 1, 0}, .fov_y = 50};
    fm_octree_stream *stream = NULL;
    fm_octree_stream_info info;
    CHECK_OK(fm_octree_write_parts(mesh, &desc, &(fm_octree_parts){.parts = 6}, path));
    const uint64_t before = counted(context, false);
    if (CHECK_OK(fm_octree_stream_open(context, path, &streaming, &stream))) {
        CHECK_OK(fm_octree_stream_update(stream, &camera, true));
        fm_octree_stream_describe(stream, &info);
        CHECK(info.resident > 0 && info.resident < info.wanted);
        CHECK(counted(context, false) - before == info.bytes && info.bytes <= info.budget);
        fm_octree_stream_close(stream);
    }
    CHECK(counted(context, false) == before);
    io_clear();
}

int main(void) {
    measured m;
    fm_allocator allocator;
    fm_context *context = NULL;
    if (!io_begin() || !CHECK_OK(measured_context(&m, &allocator, &context))) {
        return check_summary();
    }
    fm_mesh *mesh = make_mesh(context);
    builds(context, mesh);
    streamed(context);
    files(context, mesh);
    fm_mesh_destroy(mesh);
    if (!CHECK(m.uncounted < UNCOUNTED && counted(context, true) > 8 * UNCOUNTED)) {
        fprintf(stderr, "    %zu bytes are not counted, %llu are\n", m.uncounted, (unsigned long long)counted(context, true));
    }
    CHECK(counted(context, false) == 0);
    fm_context_destroy(context);
    CHECK(m.now == 0);
    return io_end();
}
