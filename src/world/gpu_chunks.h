// SPDX-License-Identifier: MIT
#ifndef FM_GPU_CHUNKS_H
#define FM_GPU_CHUNKS_H

// What the parts of the chunked methods on Vulkan share: gpu_chunks.c divides a job into batches, gpu_chunk_steps.c records what is
// done to a batch once, gpu_chunk_relax.c what is done until nothing changes.

#include "world/chunks.h"
#include "world/gpu_world.h"

enum {
    FM_BLOCK_EDGE = 8,  // of chunk_relax.comp where domains have several blocks
    FM_CHUNK_MAX_CONSTANTS = 12,
};

struct fm_gpu_chunks {
    fm_buffer *headers;    // of lists, cleared, and as many cleared ones to clear them with
    uint32_t next_header;  // the first one that is not used yet
    fm_buffer *lists;      // two arrays of entries and the stamps, for `blocks` blocks
    uint64_t blocks;
    uint32_t stamp;                   // the last one used; 0 when the stamps must be cleared
    fm_buffer *flag, *flag_readback;  // FM_CONVERGE_HOST: whether an iteration changed something
    uint64_t wait_ns;
    uint64_t chunks;
    uint32_t iterations;  // counted by the host; the device counts its rounds from there
    fm_ticket before;     // world->newest when the newest update was recorded
};

typedef struct fm_chunk_job {
    fm_world *world;
    struct fm_gpu_chunks *own;
    fm_gpu *gpu;
    fm_slot **slot;
    const fm_world_job *all;
    fm_world_algorithm algorithm;
    bool padded, linked, halo;
    uint32_t field_width;
    fm_chunk_push push;
    // The batch.
    fm_gpu_domain *table;
    uint64_t table_address, scratch_address;
    uint64_t budget;
    uint32_t count;
    uint32_t largest[3];             // edges
    uint64_t scratch;                // bytes
    uint64_t voxels, result_voxels;  // of all domains
    uint64_t largest_result, words;  // of the largest one: voxels of the result, words of site bits
    // The pass that is being recorded, or NULL, and the bytes of its steps.
    const char *pass;
    uint64_t pass_bytes;
    bool mixed[FM_WORLD_PUBLISHED_FINAL + 1];  // an algorithm's batches take unlike steps by turns
} fm_chunk_job;

// gpu_chunk_relax.c.
// Memory of the lists' headers.
fm_result fm_chunk_create_headers(fm_world *world, struct fm_gpu_chunks *own);
// The next update clears the lists: what should have cleared them may never have run.
void fm_chunk_forget_lists(struct fm_gpu_chunks *own);
// Lists and stamps for all blocks that are relaxed together: the world's, or so many in scratch memory.
fm_result fm_chunk_reserve_blocks(fm_chunk_job *job, uint64_t scratch_blocks);
// Relaxes the batch's distances. `seeded`: there are some already.
fm_result fm_chunk_relax(fm_chunk_job *job, bool seeded);
// Whether each domain of the batch is one block of chunk_relax.comp, which then does all there is to do in one dispatch.
bool fm_chunk_is_alone(const fm_chunk_job *job);
fm_result fm_chunk_do_alone(fm_chunk_job *job);

// gpu_chunk_steps.c.
// Jump flooding, whose last step writes the field unless distances are to be relaxed in scratch memory. They lie in `which` then.
fm_result fm_chunk_flood(fm_chunk_job *job);
fm_result fm_chunk_brute(fm_chunk_job *job);
// From scratch memory to the field.
fm_result fm_chunk_finish(fm_chunk_job *job);
// Words of a domain that one dispatch of brute force tries, for so many voxels.
uint64_t fm_chunk_words_at_a_time(uint64_t voxels, uint64_t words);
// Begins a step that moves so many bytes. It follows what has been recorded, within one pass where names are the same: there may be
// more batches than passes that are listed. Steps that batches take by turns cannot be told apart.
void fm_chunk_begin_step(fm_chunk_job *job, const char *name, uint64_t bytes);
void fm_chunk_end_pass(fm_chunk_job *job);
void fm_chunk_barrier(fm_chunk_job *job);
// Groups of a domain, by tiles of the largest one.
void fm_chunk_set_groups(fm_chunk_job *job, uint32_t x, uint32_t y, uint32_t z);
// A dispatch over the batch, or of a list: `indirect` then holds its group counts. `more` are the kernel's own constants.
fm_result fm_chunk_dispatch(fm_chunk_job *job, fm_kernel kernel, uint32_t threads, const uint32_t *more, uint32_t more_count,
                            const fm_buffer *indirect, uint64_t offset);
// A kernel of which each invocation owns a voxel. Tiles are as wide as rows that the domains have.
fm_result fm_chunk_dispatch_voxels(fm_chunk_job *job, fm_kernel kernel, const uint32_t *more, uint32_t more_count);

#endif
