// SPDX-License-Identifier: MIT
// The chunked methods on Vulkan: what is done to a batch of domains once, jump flooding and brute force, and how kernels are run
// over a batch.

#include "world/gpu_chunks.h"

#include <assert.h>
#include <string.h>

enum {
    TILE_THREADS = 256,  // of kernels that own a voxel an invocation
    BRUTE_THREADS = 128,
    BRUTE_WORDS = 32768,  // that a dispatch tries at most: software drivers end loops that run too long
    BRUTE_STEP = 256,
};

static const uint64_t pair_voxels = (uint64_t)1 << 16;  // of a domain, up to which steps of jump flooding go two to a dispatch
static const uint64_t brute_tries = (uint64_t)1 << 36;  // of words, a dispatch: a fraction of a second

_Static_assert(FM_MAX_STEPS < 32 && FM_SITE_BITS == 10, "chunk_sites.comp packs sites so");

void fm_chunk_barrier(fm_chunk_job *job) {
    fm_commands_barrier(job->gpu, *job->slot);
}

void fm_chunk_end_pass(fm_chunk_job *job) {
    if (job->pass) {
        fm_commands_pass(job->gpu, *job->slot, job->pass, job->pass_bytes);
        job->pass = NULL;
        job->pass_bytes = 0;
    }
}

void fm_chunk_begin_step(fm_chunk_job *job, const char *name, uint64_t bytes) {
    name = job->mixed[job->algorithm] ? "chunks" : name;
    if (job->pass && strcmp(job->pass, name) == 0) {
        fm_chunk_barrier(job);
    } else {
        fm_chunk_end_pass(job);
    }
    job->pass = name;
    job->pass_bytes += bytes;
}

enum { COMMON_CONSTANTS = 5 };

fm_result fm_chunk_dispatch(fm_chunk_job *job, fm_kernel kernel, uint32_t threads, const uint32_t *more, uint32_t more_count,
                            const fm_buffer *indirect, uint64_t offset) {
    uint32_t constants[FM_CHUNK_MAX_CONSTANTS] = {threads, job->world->desc.format, job->halo, job->padded, job->linked};
    assert(COMMON_CONSTANTS + more_count <= FM_CHUNK_MAX_CONSTANTS);
    memcpy(constants + COMMON_CONSTANTS, more, more_count * sizeof *more);
    job->push.domains = job->table_address;
    job->push.count = job->count;
    const fm_dispatch what = {.kernel = kernel,
                              .constants = constants,
                              .constant_count = COMMON_CONSTANTS + more_count,
                              .push = &job->push,
                              .push_bytes = sizeof job->push,
                              .groups = (uint64_t)job->count * job->push.groups,
                              .indirect = indirect,
                              .indirect_offset = offset};
    if (!indirect && what.groups > UINT32_MAX) {
        return fm_fail(FM_ERROR_UNSUPPORTED, "the world needs %llu work groups: at most 2^32 - 1 are dispatched at a time",
                       (unsigned long long)what.groups);
    }
    return fm_commands_dispatch(job->gpu, *job->slot, &what);
}

void fm_chunk_set_groups(fm_chunk_job *job, uint32_t x, uint32_t y, uint32_t z) {
    job->push.groups_x = (uint32_t)fm_div_up(job->largest[0], x);
    job->push.groups_y = (uint32_t)fm_div_up(job->largest[1], y);
    job->push.groups = job->push.groups_x * job->push.groups_y * (uint32_t)fm_div_up(job->largest[2], z);
}

fm_result fm_chunk_dispatch_voxels(fm_chunk_job *job, fm_kernel kernel, const uint32_t *more, uint32_t more_count) {
    uint32_t x = job->largest[0] <= 8 ? 8 : job->largest[0] <= 16 ? 16 : 32;
    uint32_t y = x == 8 ? 8 : 4;
    uint32_t constants[FM_CHUNK_MAX_CONSTANTS] = {x, y};
    for (uint32_t i = 0; i < more_count; i++) {
        constants[2 + i] = more[i];
    }
    fm_chunk_set_groups(job, x, y, TILE_THREADS / (x * y));
    return fm_chunk_dispatch(job, kernel, TILE_THREADS, constants, 2 + more_count, NULL, 0);
}

fm_result fm_chunk_flood(fm_chunk_job *job) {
    bool sites = fm_chunk_propagates_sites(job->algorithm);
    bool stays = job->halo && fm_chunk_relaxes(job->algorithm);
    uint32_t steps[FM_MAX_STEPS];
    uint32_t count = fm_chunk_steps(job->world, job->algorithm, steps);
    uint64_t width = sites ? 4 : 2;
    uint64_t largest = (uint64_t)job->largest[0] * job->largest[1] * job->largest[2];
    fm_chunk_begin_step(job, "jfa", job->voxels / 8);
    job->push.which = 0;
    for (uint32_t i = 0; i < count;) {
        bool pair = !sites && largest <= pair_voxels && i + 1 < count;
        bool first = i == 0;
        job->push.step = steps[i];
        i += pair ? 2 : 1;
        bool last = i == count && !stays;
        const uint32_t more[] = {first, last, job->algorithm == FM_WORLD_PUBLISHED_FINAL ? 1 : FM_CHUNK_UNKNOWN, pair};
        FM_TRY(fm_chunk_dispatch_voxels(job, sites ? FM_KERNEL_CHUNK_SITES : FM_KERNEL_CHUNK_FLOOD, more, sites ? 2 : 4));
        job->push.which ^= first ? 0 : 1;
        job->pass_bytes += (first ? 0 : job->voxels * width) + (last ? job->result_voxels * job->field_width : job->voxels * width);
        if (i < count) {
            fm_chunk_barrier(job);
        }
    }
    return FM_OK;
}

uint64_t fm_chunk_words_at_a_time(uint64_t voxels, uint64_t words) {
    if (words <= BRUTE_WORDS && words <= brute_tries / voxels) {
        return words;
    }
    return fm_max_u64(BRUTE_STEP, fm_min_u64(brute_tries / voxels / BRUTE_STEP * BRUTE_STEP, BRUTE_WORDS));
}

fm_result fm_chunk_brute(fm_chunk_job *job) {
    uint64_t step = fm_chunk_words_at_a_time(job->result_voxels, job->words);
    if (job->words > UINT32_MAX - BRUTE_WORDS || job->largest_result > UINT32_MAX - BRUTE_THREADS) {
        return fm_fail(FM_ERROR_UNSUPPORTED, "FM_WORLD_BRUTE_FORCE takes domains of at most 2^32 - 1 voxels: this one has %llu",
                       (unsigned long long)job->largest_result);
    }
    fm_chunk_begin_step(job, "brute force", job->voxels / 8 + job->result_voxels * job->field_width);
    job->push.groups = (uint32_t)fm_div_up(job->largest_result, BRUTE_THREADS);
    for (uint64_t first = 0; first < job->words; first += step) {
        const uint32_t more[] = {first == 0, first + step >= job->words};
        job->push.first = (uint32_t)first;
        job->push.step = (uint32_t)step;
        FM_TRY(fm_chunk_dispatch(job, FM_KERNEL_CHUNK_BRUTE, BRUTE_THREADS, more, 2, NULL, 0));
        if (first + step < job->words) {
            fm_chunk_barrier(job);
        }
    }
    return FM_OK;
}

fm_result fm_chunk_finish(fm_chunk_job *job) {
    fm_chunk_begin_step(job, "finish", job->result_voxels * (2 + job->field_width));
    return fm_chunk_dispatch_voxels(job, FM_KERNEL_CHUNK_FINISH, NULL, 0);
}
