// SPDX-License-Identifier: MIT
// Octrees of triangles that come piece by piece: each is written down for the chunks that it comes near to, in memory and beyond
// `host_bytes` on disk, and the chunks are built as those of a mesh in memory are, from the same numbers in the same order.

#include "octree/build.h"
#include "octree/spill.h"

#include <inttypes.h>
#include <stddef.h>
#include <string.h>

typedef struct record {
    uint32_t number;
    float corners[3][3];
    uint32_t paint[3][2];  // left out of what is kept where there is none
} record;

struct fm_octree_builder {
    fm_octree_desc desc;
    fm_octree_build build;
    fm_spill *spill;
    uint64_t count;    // of triangles that were added
    uint64_t start;    // of the time
    fm_result broken;  // what adding failed with
    bool finished;
};

static bool has_paint(const fm_octree_builder *builder) {
    return builder->desc.attribute >= FM_OCTREE_COLOR;
}

typedef struct collecting {
    const fm_octree_build *build;
    fm_octree_soup *soup;
    uint64_t chunk;
    bool paint;
} collecting;

static void collect(void *user, const void *data) {
    const collecting *job = user;
    record one;
    memcpy(&one, data, job->paint ? sizeof one : offsetof(record, paint));
    const float *const corners[3] = {one.corners[0], one.corners[1], one.corners[2]};
    const uint64_t at = job->soup->mesh.triangle_count;
    fm_octree_soup_add(job->build, job->soup, job->chunk, one.number, corners);
    if (job->paint) {
        memcpy(job->soup->paint[at], one.paint, sizeof one.paint);
    }
}

static fm_result soup_of_spill(fm_octree_build *build, uint64_t chunk, fm_octree_soup *soup) {
    fm_octree_builder *builder = build->user;
    const collecting job = {build, soup, chunk, has_paint(builder)};
    FM_TRY(fm_octree_soup_reserve(build, soup, fm_spill_count(builder->spill, (uint32_t)chunk), job.paint));
    return fm_spill_read(builder->spill, (uint32_t)chunk, collect, (void *)&job);
}

// --- Create ---

static fm_result check_builder(const fm_octree_desc *desc) {
    if (desc->kind != FM_OCTREE_CLOSEST && desc->kind != FM_OCTREE_DISTANCE) {
        return fm_fail(FM_ERROR_UNSUPPORTED, "kind is %s: streamed builds are of FM_OCTREE_CLOSEST and FM_OCTREE_DISTANCE",
                       fm_octree_kind_name(desc->kind));
    }
    if (desc->kind == FM_OCTREE_DISTANCE && desc->sign != FM_SIGN_NONE) {
        return fm_fail(FM_ERROR_UNSUPPORTED, "sign is %d: triangles that are not all there have no inside, only FM_SIGN_NONE",
                       (int)desc->sign);
    }
    return FM_OK;
}

fm_result fm_octree_builder_create(fm_context *context, const fm_octree_desc *desc, fm_octree_builder **result) {
    if (!context || !result) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "%s is NULL", context ? "builder" : "context");
    }
    fm_octree_desc filled;
    double low[3], high[3];
    FM_TRY(fm_octree_check_desc(desc, &filled));
    FM_TRY(fm_octree_check_attribute(&filled));
    FM_TRY(check_builder(&filled));
    FM_TRY(fm_octree_given_box(&filled, low, high));
    fm_octree_builder *builder = fm_alloc_zero(&context->allocator, sizeof *builder, "an octree's builder");
    if (!builder) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    builder->start = fm_now_ns();
    builder->desc = filled;
    builder->desc.sign = FM_SIGN_NONE;
    builder->build = (fm_octree_build){
        .context = context, .desc = &builder->desc, .sign = FM_SIGN_NONE, .soup_of = soup_of_spill, .user = builder};
    const uint32_t bytes = has_paint(builder) ? sizeof(record) : offsetof(record, paint);
    fm_result status = fm_octree_build_begin(&builder->build, low, high);
    status = status == FM_OK ? fm_spill_create(context, filled.folder, bytes, filled.host_bytes, &builder->spill) : status;
    builder->desc.folder = NULL;
    if (status != FM_OK) {
        fm_octree_builder_destroy(builder);
        return status;
    }
    *result = builder;
    return FM_OK;
}

void fm_octree_builder_destroy(fm_octree_builder *builder) {
    if (!builder) {
        return;
    }
    const fm_allocator *allocator = &builder->build.context->allocator;
    fm_spill_destroy(builder->spill);
    fm_octree_build_end(&builder->build);
    fm_free(allocator, builder, sizeof *builder);
}

// --- Add ---

static fm_result check_triangles(const fm_octree_builder *builder, const fm_mesh_desc *triangles, const uint8_t (*colors)[4],
                                 const float (*texture)[2]) {
    if ((triangles->vertex_count > 0 && !triangles->vertices) || (triangles->triangle_count > 0 && !triangles->triangles)) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "%s is NULL",
                       triangles->vertex_count > 0 && !triangles->vertices ? "vertices" : "triangles");
    }
    if (triangles->triangle_count >= FM_NO_TRIANGLE - builder->count) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "triangle_count is %" PRIu64 " after %" PRIu64 ": at most %u in all",
                       triangles->triangle_count, builder->count, FM_NO_TRIANGLE - 1);
    }
    if (triangles->triangle_count > 0 &&
        ((builder->desc.attribute == FM_OCTREE_COLOR && !colors) || (builder->desc.attribute == FM_OCTREE_TEXTURE && !texture))) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "%s is NULL: the octree's attribute needs it",
                       builder->desc.attribute == FM_OCTREE_COLOR ? "colors" : "texture");
    }
    for (uint64_t i = 0; i < triangles->triangle_count; i++) {
        for (int k = 0; k < 3; k++) {
            if (triangles->triangles[i][k] >= triangles->vertex_count) {
                return fm_fail(FM_ERROR_INVALID_ARGUMENT,
                               "corner %d of triangle %" PRIu64 " is vertex %u: there are %" PRIu64 " vertices", k, i,
                               triangles->triangles[i][k], triangles->vertex_count);
            }
        }
    }
    return FM_OK;
}

typedef struct adding {
    fm_spill *spill;
    record one;
    fm_result status;
} adding;

static void add_to_chunk(void *user, uint64_t chunk) {
    adding *job = user;
    job->status = job->status == FM_OK ? fm_spill_add(job->spill, (uint32_t)chunk, &job->one) : job->status;
}

static fm_result add_triangle(fm_octree_builder *builder, const float *const corners[3], const uint32_t paint[3][2]) {
    fm_octree_build *build = &builder->build;
    fm_cell_triangle triangle;
    adding job = {builder->spill, {.number = (uint32_t)builder->count++}, FM_OK};
    if (!fm_cell_triangle_of(build, corners, &triangle)) {
        return FM_OK;
    }
    for (int i = 0; i < 3; i++) {
        memcpy(job.one.corners[i], corners[i], sizeof job.one.corners[i]);
        memcpy(job.one.paint[i], paint[i], sizeof job.one.paint[i]);
    }
    fm_octree_far_mark(build, &build->far, &triangle);
    fm_cell_triangle_chunks(build, &triangle, add_to_chunk, &job);
    return job.status;
}

fm_result fm_octree_builder_add(fm_octree_builder *builder, const fm_mesh_desc *triangles, const uint8_t (*colors)[4],
                                const float (*texture)[2]) {
    if (!builder || !triangles) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "%s is NULL", builder ? "triangles" : "builder");
    }
    if (builder->finished || builder->broken != FM_OK) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "the builder %s",
                       builder->finished ? "has finished" : "has failed and is only to be destroyed");
    }
    FM_TRY(check_triangles(builder, triangles, colors, texture));
    for (uint64_t i = 0; i < triangles->triangle_count && builder->broken == FM_OK; i++) {
        const float *corners[3];
        uint32_t paint[3][2] = {{0}};
        for (int k = 0; k < 3; k++) {
            const uint32_t vertex = triangles->triangles[i][k];
            corners[k] = triangles->vertices[vertex];
            if (builder->desc.attribute == FM_OCTREE_COLOR) {
                memcpy(paint[k], colors[vertex], sizeof colors[vertex]);
            } else if (builder->desc.attribute == FM_OCTREE_TEXTURE) {
                memcpy(paint[k], texture[vertex], sizeof texture[vertex]);
            }
        }
        builder->broken = add_triangle(builder, corners, (const uint32_t(*)[2])paint);
    }
    return builder->broken;
}

fm_result fm_octree_builder_finish(fm_octree_builder *builder, fm_octree **octree) {
    if (!builder || !octree) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "%s is NULL", builder ? "octree" : "builder");
    }
    if (builder->finished || builder->broken != FM_OK) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "the builder %s",
                       builder->finished ? "has finished" : "has failed and is only to be destroyed");
    }
    builder->finished = true;
    FM_TRY(fm_spill_finish(builder->spill));
    FM_TRY(fm_octree_build_run(&builder->build));
    *octree = builder->build.octree;
    builder->build.octree = NULL;
    (*octree)->info.build_ms = (double)(fm_now_ns() - builder->start) * 1e-6;
    return FM_OK;
}
