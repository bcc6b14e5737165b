// SPDX-License-Identifier: MIT
// Octrees larger than memory: the public calls.

#include "render/octree_stream.h"

#include "gpu/gpu.h"
#include "render/octree_residents.h"
#include "render/octree_wants.h"
#include "render/render.h"

#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static const uint64_t BUDGET = 256 << 20;
static const float FADE_MS = 250, RETRY_MS = 1000, LONGEST_RETRY_MS = 1e9f;
// Of how much a part was wanted before when fewer rays meet it.
static const float KEPT = 0.9f;

struct fm_octree_stream {
    fm_context *context;
    char *name;
    uint64_t name_bytes;
    int file;
    fm_octree *coarse;
    fm_octree_grid grid;
    fm_fmo_part *rows;
    float *scores, *fresh;  // of parts: how much they are wanted; what the newest look at them says
    uint64_t *seen;         // the newest update in which a ray met them
    uint64_t updates;
    fm_octree_residents residents;
    uint64_t budget;
    uint64_t before;   // bytes of octrees that are not the stream's
    uint64_t fixed;    // bytes of all but parts
    uint64_t last_ns;  // when the newest update was; 0: there was none
};

static fm_result check_desc(const fm_octree_stream_desc *desc) {
    if (!isfinite(desc->distance) || desc->distance < 0 || !isfinite(desc->fade_ms) || !(desc->retry_ms <= LONGEST_RETRY_MS)) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT,
                       "distance is %g, fade_ms %g and retry_ms %g: finite numbers, of distances not below 0, are wanted, and no "
                       "more than %g ms to the next try",
                       (double)desc->distance, (double)desc->fade_ms, (double)desc->retry_ms, (double)LONGEST_RETRY_MS);
    }
    return FM_OK;
}

static fm_result open_file(fm_octree_stream *stream, const char *path, uint64_t *bytes) {
    struct stat status;
    stream->name_bytes = strlen(path) + 1;
    stream->name = fm_octree_alloc(stream->context, stream->name_bytes, "a file's name");
    if (!stream->name) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    memcpy(stream->name, path, stream->name_bytes);
    stream->file = open(path, O_RDONLY | O_CLOEXEC);
    if (stream->file < 0 || fstat(stream->file, &status) != 0) {
        return fm_fail(FM_ERROR_IO, "%s: cannot open: %s", path, strerror(errno));
    }
    if (!S_ISREG(status.st_mode)) {
        return fm_fail(FM_ERROR_IO, "%s: is no file that can be read in any order: copy what it gives into one", path);
    }
    *bytes = (uint64_t)status.st_size;
    return FM_OK;
}

static void make_grid(fm_octree_stream *stream, const fm_fmo_header *header, float distance) {
    const fm_octree_info *info = &stream->coarse->info;
    double diagonal2 = 0;
    for (int axis = 0; axis < 3; axis++) {
        stream->grid.count[axis] = (int32_t)header->parts[axis];
        stream->grid.origin[axis] = info->low[axis];
        diagonal2 += pow((double)info->high[axis] - (double)info->low[axis], 2);
    }
    stream->grid.size = (float)header->part_edge;
    stream->grid.distance = distance > 0 ? distance : (float)(0.25 * sqrt(diagonal2));
}

// What counts for the budget.
static uint64_t bytes_held(const fm_context *context) {
    return context->gpu ? fm_gpu_meter(context->gpu, FM_PURPOSE_OCTREES).bytes : context->host[FM_PURPOSE_OCTREES].bytes;
}

static fm_result too_small(const fm_octree_stream *stream, uint64_t needed) {
    return fm_fail(FM_ERROR_INVALID_ARGUMENT, "%s: budget is %llu bytes: the coarse octree and the list of parts take %llu",
                   stream->name, (unsigned long long)stream->budget, (unsigned long long)needed);
}

static fm_result open_parts(fm_octree_stream *stream, const fm_octree_stream_desc *desc) {
    fm_octree_residents *r = &stream->residents;
    uint64_t all = 0, most = 0;
    for (uint64_t at = 0; at < r->count; at++) {
        all += stream->rows[at].bytes;
        most = fm_max_u64(most, stream->rows[at].bytes);
    }
    r->rows = stream->rows;
    r->fade_ms = desc->fade_ms == 0 ? FADE_MS : desc->fade_ms;
    r->retry_ms = desc->retry_ms == 0 ? RETRY_MS : desc->retry_ms;
    FM_TRY(fm_residents_create(r));
    FM_TRY(fm_octree_loader_create(stream->context, stream->file, stream->name, stream->coarse, &stream->grid, most, &r->loader));
    if (stream->context->gpu) {
        uint64_t head;
        stream->fixed = fm_octree_store_tables(r->count);
        FM_TRY(fm_gpu_octree_head(stream->coarse, &head));
    }
    stream->fixed += bytes_held(stream->context) - stream->before;
    if (stream->fixed > stream->budget) {
        return too_small(stream, stream->fixed);
    }
    r->room = fm_min_u64(all, stream->budget - stream->fixed);
    if (!stream->context->gpu) {
        return FM_OK;
    }
    const uint64_t most_room = fm_min_u64(stream->budget - stream->fixed, fm_octree_store_most(stream->context));
    r->room = fm_min_u64(fm_round_up(all, FM_OCTREE_STORE_PAGE), most_room / FM_OCTREE_STORE_PAGE * FM_OCTREE_STORE_PAGE);
    return fm_octree_store_create(stream->context, r->room, r->count, &r->store);
}

static fm_result open_stream(fm_octree_stream *stream, const char *path, const fm_octree_stream_desc *desc) {
    fm_fmo_header header;
    uint64_t bytes = 0;
    FM_TRY(check_desc(desc));
    FM_TRY(open_file(stream, path, &bytes));
    stream->budget = desc->budget > 0 ? desc->budget : BUDGET;
    FM_TRY(fm_fmo_read_header(stream->file, bytes, path, &header));
    if (header.parts[0] == 0) {
        return fm_fail(FM_ERROR_FORMAT, "%s: has no parts: fm_octree_read reads it, fm_octree_write_parts writes files with parts",
                       path);
    }
    if (header.image_bytes > stream->budget) {
        return too_small(stream, header.image_bytes);
    }
    FM_TRY(fm_fmo_read_coarse(stream->context, stream->file, &header, path, &stream->coarse));
    fm_octree_residents *r = &stream->residents;
    fm_context *context = stream->context;
    r->count = (uint64_t)header.parts[0] * header.parts[1] * header.parts[2];
    stream->rows = fm_octree_alloc(context, r->count * sizeof *stream->rows, "the directory of parts");
    stream->scores = fm_octree_alloc_zero(context, r->count * sizeof *stream->scores, "the directory of parts");
    stream->fresh = fm_octree_alloc(context, r->count * sizeof *stream->fresh, "the directory of parts");
    stream->seen = fm_octree_alloc_zero(context, r->count * sizeof *stream->seen, "the directory of parts");
    if (!stream->rows || !stream->scores || !stream->fresh || !stream->seen) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    FM_TRY(fm_fmo_read_directory(stream->file, bytes, &header, path, stream->rows));
    make_grid(stream, &header, desc->distance);
    return open_parts(stream, desc);
}

fm_result fm_octree_stream_open(fm_context *context, const char *path, const fm_octree_stream_desc *desc,
                                fm_octree_stream **result) {
    static const fm_octree_stream_desc defaults;
    if (!context || !path || !result) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "%s is NULL", !context ? "context" : !path ? "path" : "stream");
    }
    const uint64_t before = bytes_held(context);
    fm_octree_stream *stream = fm_octree_alloc_zero(context, sizeof *stream, "a stream of an octree");
    if (!stream) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    stream->context = stream->residents.context = context;
    stream->before = before;
    stream->file = -1;
    const fm_result status = open_stream(stream, path, desc ? desc : &defaults);
    if (status != FM_OK) {
        fm_octree_stream_close(stream);
        return status;
    }
    *result = stream;
    return FM_OK;
}

void fm_octree_stream_close(fm_octree_stream *stream) {
    if (!stream) {
        return;
    }
    fm_context *context = stream->context;
    fm_residents_destroy(&stream->residents);
    fm_octree_destroy(stream->coarse);
    fm_octree_free(context, stream->rows, stream->residents.count * sizeof *stream->rows);
    fm_octree_free(context, stream->scores, stream->residents.count * sizeof *stream->scores);
    fm_octree_free(context, stream->fresh, stream->residents.count * sizeof *stream->fresh);
    fm_octree_free(context, stream->seen, stream->residents.count * sizeof *stream->seen);
    if (stream->file >= 0) {
        close(stream->file);
    }
    fm_octree_free(context, stream->name, stream->name_bytes);
    fm_octree_free(context, stream, sizeof *stream);
}

// Each update looks with other rays than the one before: a part stays wanted until all of them have passed it by.
static void look(fm_octree_stream *stream, const fm_camera *camera, bool wait) {
    const fm_octree_wants wants = {fm_octree_host_head(stream->coarse), stream->grid};
    const uint64_t count = stream->residents.count;
    if (wait) {
        memset(stream->scores, 0, count * sizeof *stream->scores);
    }
    for (int turns = wait ? FM_WANT_TURNS : 1; turns > 0; turns--) {
        stream->updates++;
        fm_octree_want(stream->context->pool, &wants, camera, (uint32_t)(stream->updates % FM_WANT_TURNS), stream->fresh);
        for (uint64_t at = 0; at < count; at++) {
            if (stream->fresh[at] > 0) {
                stream->scores[at] = fmaxf(stream->fresh[at], stream->scores[at] * KEPT);
                stream->seen[at] = stream->updates;
            } else if (stream->updates - stream->seen[at] >= FM_WANT_TURNS) {
                stream->scores[at] = 0;
            }
        }
    }
}

static fm_result load_wanted(fm_octree_stream *stream, bool wait) {
    fm_octree_residents *r = &stream->residents;
    const bool at_once = wait || r->fade_ms < 0;
    FM_TRY(fm_residents_settle(r, false));
    FM_TRY(fm_residents_choose(r, stream->scores, at_once));
    while (wait && r->loading > 0) {
        FM_TRY(fm_residents_settle(r, true));
        FM_TRY(fm_residents_choose(r, stream->scores, at_once));
    }
    return FM_OK;
}

// Also after an error: parts that a table of before tells of may have gone, and others may be in their places.
static fm_result tell_pictures(fm_octree_stream *stream) {
    const fm_octree_residents *r = &stream->residents;
    if (!r->store) {
        stream->grid.parts = (uintptr_t)r->table;
        return FM_OK;
    }
    const fm_result result = fm_octree_store_table(r->store, r->table, &stream->grid.parts);
    if (result != FM_OK) {
        stream->grid.parts = 0;
    }
    return result;
}

fm_result fm_octree_stream_update(fm_octree_stream *stream, const fm_camera *camera, bool wait) {
    if (!stream || !camera) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "%s is NULL", stream ? "camera" : "stream");
    }
    FM_TRY(fm_camera_check(camera));
    fm_octree_residents *r = &stream->residents;
    look(stream, camera, wait);
    const uint64_t now = fm_now_ns();
    fm_residents_fade(r, stream->last_ns > 0 ? 1e-6 * (double)(now - stream->last_ns) : 0);
    stream->last_ns = r->now = now;
    const fm_result loaded = load_wanted(stream, wait);
    const fm_result told = tell_pictures(stream);
    return told != FM_OK ? told : loaded;
}

void fm_octree_stream_describe(const fm_octree_stream *stream, fm_octree_stream_info *info) {
    if (!stream || !info) {
        return;
    }
    const fm_octree_residents *r = &stream->residents;
    *info = (fm_octree_stream_info){.parts = (uint32_t)r->count,
                                    .resident = r->resident,
                                    .wanted = r->wanted,
                                    .bytes = stream->fixed + r->used,
                                    .budget = stream->budget,
                                    .loaded = r->loaded,
                                    .dropped = r->dropped,
                                    .failed = r->failed,
                                    .failing = r->failing};
    snprintf(info->failure, sizeof info->failure, "%s", r->failure);
}

fm_octree *fm_octree_stream_coarse(fm_octree_stream *stream) {
    return stream->coarse;
}

fm_octree_grid fm_octree_stream_grid(const fm_octree_stream *stream) {
    return stream->grid;
}
