// SPDX-License-Identifier: MIT
// Relaxation of chunks on Vulkan: rounds of blocks whose lists lie on the device, or as published, an iteration a dispatch. It
// works in the field itself, but for halos, whose domains overlap.

#include "world/gpu_chunks.h"

#include <assert.h>

enum {
    HEADERS = 8192,   // of lists; each round uses one
    ALONE_EDGE = 16,  // domains up to this are one block
};

void fm_chunk_forget_lists(struct fm_gpu_chunks *own) {
    own->next_header = HEADERS;
    own->stamp = 0;
}

fm_result fm_chunk_create_headers(fm_world *world, struct fm_gpu_chunks *own) {
    const fm_allocator *allocator = &world->context->allocator;
    const uint64_t bytes = (uint64_t)HEADERS * FM_LIST_HEADER_BYTES;
    uint32_t(*clear)[4] = fm_alloc(allocator, bytes, "the lists' headers");
    if (!clear) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    fm_gpu_world_empty_lists(clear, HEADERS);
    fm_result status = fm_buffer_create(world->gpu->gpu, FM_PURPOSE_UPDATE, 2 * bytes, false, &own->headers);
    if (status == FM_OK) {
        status = fm_buffer_upload_at(own->headers, bytes, clear, bytes);
    }
    fm_free(allocator, clear, bytes);
    fm_chunk_forget_lists(own);
    return status;
}

static uint64_t world_blocks(const fm_world *world) {
    fm_shape shape = world->desc.shape;
    return fm_div_up(shape.x, FM_BLOCK_EDGE) * fm_div_up(shape.y, FM_BLOCK_EDGE) * fm_div_up(shape.z, FM_BLOCK_EDGE);
}

fm_result fm_chunk_reserve_blocks(fm_chunk_job *job, uint64_t scratch_blocks) {
    struct fm_gpu_chunks *own = job->own;
    const uint64_t blocks = job->halo ? scratch_blocks : world_blocks(job->world);
    if (blocks > UINT32_MAX) {
        return fm_fail(FM_ERROR_UNSUPPORTED, "the world has %llu blocks of 8 x 8 x 8: at most 2^32 - 1 are relaxed at a time",
                       (unsigned long long)blocks);
    }
    if (blocks <= own->blocks) {
        return FM_OK;
    }
    fm_buffer *lists;
    FM_TRY(fm_buffer_create(job->gpu, FM_PURPOSE_UPDATE, 12 * blocks, false, &lists));
    fm_result status = fm_gpu_wait(job->gpu, fm_gpu_newest(job->gpu));
    if (status != FM_OK) {
        fm_buffer_destroy(lists);
        return status;
    }
    fm_buffer_destroy(own->lists);
    own->lists = lists;
    own->blocks = blocks;
    own->stamp = 0;
    return FM_OK;
}

// Rounds of blocks until all distances have arrived: a shortest way of so many steps crosses at most so many faces of blocks.
static uint32_t rounds_of(const fm_chunk_job *job) {
    fm_shape shape = job->world->desc.shape;
    const uint32_t world[3] = {shape.x, shape.y, shape.z};
    uint64_t faces = 0, steps = 0, shortest = UINT32_MAX;
    for (int i = 0; i < 3; i++) {
        uint32_t size = job->linked ? world[i] : job->largest[i];
        faces += fm_div_up(size, FM_BLOCK_EDGE) - 1;
        steps += size - 1;
        shortest = fm_min_u64(shortest, job->largest[i]);
    }
    steps = job->padded ? fm_min_u64(steps, (shortest + 1) / 2) : steps;
    steps = fm_min_u64(steps, fm_world_cap(&job->world->desc) - 1);
    return (uint32_t)fm_min_u64(faces, (steps + 3 * (FM_BLOCK_EDGE - 1)) / FM_BLOCK_EDGE);
}

// Memory of the lists for `rounds` rounds, clear.
static void prepare_rounds(fm_chunk_job *job, uint32_t rounds) {
    struct fm_gpu_chunks *own = job->own;
    assert(rounds < HEADERS);
    bool wrapped = own->next_header + rounds + 1 > HEADERS;
    if (wrapped) {
        const uint64_t bytes = (uint64_t)HEADERS * FM_LIST_HEADER_BYTES;
        fm_commands_copy(job->gpu, *job->slot, own->headers, bytes, own->headers, 0, bytes);
        own->next_header = 0;
    }
    bool cleared = own->stamp == 0 || own->stamp > UINT32_MAX - HEADERS;
    if (cleared) {
        fm_commands_fill(job->gpu, *job->slot, own->lists, 8 * own->blocks, 4 * own->blocks, 0);
        own->stamp = 0;
    }
    if (wrapped || cleared) {
        fm_chunk_barrier(job);
    }
}

// The lists of a round and of the next.
static void set_round(fm_chunk_job *job, uint32_t round) {
    struct fm_gpu_chunks *own = job->own;
    uint64_t lists = fm_buffer_address(own->lists);
    uint64_t header = fm_buffer_address(own->headers) + (uint64_t)own->next_header * FM_LIST_HEADER_BYTES;
    job->push.list = header;
    job->push.next_list = header + FM_LIST_HEADER_BYTES;
    job->push.entries = lists + (round % 2) * 4 * own->blocks;
    job->push.next_entries = lists + (round + 1) % 2 * 4 * own->blocks;
    job->push.stamps = lists + 8 * own->blocks;
    job->push.stamp = ++own->stamp;
    job->push.first = round;
    job->push.counted =
        fm_buffer_address(job->world->gpu->flights[job->world->gpu->next].readback) + 4 * (uint64_t)FM_COUNTED_CHUNKS;
}

// Bytes of a distance where it is relaxed.
static uint64_t relaxed_width(const fm_chunk_job *job) {
    return job->halo ? 2 : job->field_width;
}

// Relaxes all blocks of the batch once, then those that rounds list.
static fm_result relax_on_device(fm_chunk_job *job, bool seeded) {
    struct fm_gpu_chunks *own = job->own;
    uint64_t width = relaxed_width(job);
    // What the rounds move is known only to the device.
    fm_chunk_begin_step(job, "relax", (seeded ? job->voxels * width : job->voxels / 8) + job->voxels * width);
    fm_chunk_set_groups(job, FM_BLOCK_EDGE, FM_BLOCK_EDGE, FM_BLOCK_EDGE);
    uint32_t rounds = rounds_of(job);
    prepare_rounds(job, rounds);
    uint32_t more[] = {FM_BLOCK_EDGE, seeded ? FM_CHUNK_SEEDED : FM_CHUNK_INIT};
    for (uint32_t round = 0; round <= rounds; round++, own->next_header++) {
        bool listed = round > 0;
        set_round(job, round);
        more[1] = listed ? FM_CHUNK_LISTED : more[1];
        FM_TRY(fm_chunk_dispatch(job, FM_KERNEL_CHUNK_RELAX, 128, more, 2, listed ? own->headers : NULL,
                                 (uint64_t)own->next_header * FM_LIST_HEADER_BYTES + 4));
        if (round < rounds) {
            fm_chunk_barrier(job);
        }
    }
    own->next_header++;  // the last round's list of what is left, which is empty
    own->iterations = (uint32_t)fm_max_u64(own->iterations, 1);
    return FM_OK;
}

// As published: an iteration a dispatch, and the host looks whether it changed anything.
static fm_result relax_by_host(fm_chunk_job *job, bool seeded) {
    struct fm_gpu_chunks *own = job->own;
    uint64_t width = relaxed_width(job);
    job->push.counted = fm_buffer_address(own->flag);
    if (!seeded) {
        const uint32_t more[] = {true};
        fm_chunk_begin_step(job, "init", job->voxels / 8 + job->voxels * width);
        FM_TRY(fm_chunk_dispatch_voxels(job, FM_KERNEL_CHUNK_FIM, more, 1));
    }
    uint32_t iterations = 0;
    for (;;) {
        const uint32_t more[] = {false};
        fm_chunk_begin_step(job, "relax", job->voxels * width);
        fm_commands_fill(job->gpu, *job->slot, own->flag, 0, 4, 0);
        fm_chunk_barrier(job);
        FM_TRY(fm_chunk_dispatch_voxels(job, FM_KERNEL_CHUNK_FIM, more, 1));
        fm_chunk_end_pass(job);
        fm_commands_copy(job->gpu, *job->slot, own->flag, 0, own->flag_readback, 0, 4);
        uint64_t begin = fm_now_ns();
        FM_TRY(fm_commands_flush(job->gpu, job->slot));
        own->wait_ns += fm_now_ns() - begin;
        if (*(const volatile uint32_t *)fm_buffer_mapped(own->flag_readback) == 0) {
            break;
        }
        iterations++;
    }
    own->iterations = (uint32_t)fm_max_u64(own->iterations, iterations);
    return FM_OK;
}

fm_result fm_chunk_relax(fm_chunk_job *job, bool seeded) {
    bool by_host = job->world->desc.method.convergence == FM_CONVERGE_HOST;
    return by_host ? relax_by_host(job, seeded) : relax_on_device(job, seeded);
}

bool fm_chunk_is_alone(const fm_chunk_job *job) {
    bool fits = !job->halo && !job->linked;
    for (int i = 0; i < 3; i++) {
        fits = fits && job->largest[i] <= ALONE_EDGE;
    }
    bool by_host = fm_chunk_relaxes(job->algorithm) && job->world->desc.method.convergence == FM_CONVERGE_HOST;
    return fits && !by_host && job->algorithm != FM_WORLD_BRUTE_FORCE && !fm_chunk_propagates_sites(job->algorithm);
}

fm_result fm_chunk_do_alone(fm_chunk_job *job) {
    bool small = job->largest[0] <= FM_BLOCK_EDGE && job->largest[1] <= FM_BLOCK_EDGE && job->largest[2] <= FM_BLOCK_EDGE;
    uint32_t edge = small ? FM_BLOCK_EDGE : ALONE_EDGE;
    uint32_t threads = (uint32_t)fm_min_u64(small ? 128 : 512, job->world->context->device.max_workgroup);
    uint32_t steps[FM_MAX_STEPS];
    fm_chunk_steps(job->world, job->algorithm, steps);
    const uint32_t more[] = {edge,
                             FM_CHUNK_INIT,
                             true,
                             job->algorithm == FM_WORLD_FIM ? 0 : steps[0],
                             fm_chunk_relaxes(job->algorithm),
                             job->algorithm == FM_WORLD_PUBLISHED_FINAL ? 1 : FM_CHUNK_UNKNOWN};
    fm_chunk_begin_step(job, "chunks", job->voxels / 8 + job->voxels * job->field_width);
    fm_chunk_set_groups(job, edge, edge, edge);
    FM_TRY(fm_chunk_dispatch(job, FM_KERNEL_CHUNK_RELAX, threads, more, sizeof more / sizeof more[0], NULL, 0));
    job->own->iterations = (uint32_t)fm_max_u64(job->own->iterations, fm_chunk_relaxes(job->algorithm));
    return FM_OK;
}
