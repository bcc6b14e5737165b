// SPDX-License-Identifier: MIT
// The chunked methods on Vulkan: their memory, and the batches in which a job is done.
//
// All domains of an algorithm share their dispatches, in batches that scratch memory limits. Relaxation works in the field itself,
// but for halos, whose domains overlap, and takes no scratch memory.

#include "world/gpu_chunks.h"

#include <stdlib.h>
#include <string.h>

static const uint64_t scratch_budget = (uint64_t)1 << 30;

void fm_gpu_chunks_destroy(fm_world *world) {
    struct fm_gpu_chunks *own = world->gpu->chunks;
    if (own) {
        fm_buffer_destroy(own->headers);
        fm_buffer_destroy(own->lists);
        fm_buffer_destroy(own->flag);
        fm_buffer_destroy(own->flag_readback);
        fm_free(&world->context->allocator, own, sizeof *own);
        world->gpu->chunks = NULL;
    }
}

fm_result fm_gpu_chunks_prepare(fm_world *world) {
    fm_gpu_world *gpu_world = world->gpu;
    if (gpu_world->chunks) {
        fm_chunk_forget_lists(gpu_world->chunks);
        return FM_OK;
    }
    struct fm_gpu_chunks *own = fm_alloc_zero(&world->context->allocator, sizeof *own, "a world's chunks");
    if (!own) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    gpu_world->chunks = own;
    fm_result status = fm_chunk_create_headers(world, own);
    if (status == FM_OK) {
        status = fm_buffer_create(gpu_world->gpu, FM_PURPOSE_UPDATE, 4, false, &own->flag);
    }
    if (status == FM_OK) {
        status = fm_buffer_create(gpu_world->gpu, FM_PURPOSE_READBACK, 4, false, &own->flag_readback);
    }
    if (status != FM_OK) {
        fm_gpu_chunks_destroy(world);
    }
    return status;
}

// Scratch memory of a batch. Tests set FATHOM_SCRATCH, so that small worlds take several.
static uint64_t budget(void) {
    const char *wish = getenv("FATHOM_SCRATCH");
    return wish ? strtoull(wish, NULL, 10) : scratch_budget;
}

static uint64_t volume(const uint32_t size[3]) {
    return (uint64_t)size[0] * size[1] * size[2];
}

// Words of site bits that hold a domain.
static uint64_t words_of(const fm_world_domain *domain) {
    uint64_t in_row = (domain->begin[0] % 32 + domain->size[0] - 1) / 32 + 1;
    return in_row * domain->size[1] * domain->size[2];
}

static fm_result do_batch(fm_chunk_job *job) {
    if (fm_chunk_is_alone(job)) {
        return fm_chunk_do_alone(job);
    }
    switch (job->algorithm) {
    case FM_WORLD_BRUTE_FORCE:
        return fm_chunk_brute(job);
    case FM_WORLD_FIM:
        job->push.which = 0;
        FM_TRY(fm_chunk_relax(job, false));
        break;
    case FM_WORLD_JFA_FIM:
        FM_TRY(fm_chunk_flood(job));
        FM_TRY(job->halo ? fm_chunk_relax(job, true) : FM_OK);
        break;
    default:
        return fm_chunk_flood(job);
    }
    return job->halo ? fm_chunk_finish(job) : FM_OK;
}

// Scratch memory of a domain.
static uint64_t scratch_bytes(const fm_chunk_job *job, const fm_world_domain *domain) {
    uint64_t voxels = volume(domain->size);
    switch (job->algorithm) {
    case FM_WORLD_BRUTE_FORCE: {
        uint64_t results = volume(domain->result_size), words = words_of(domain);
        return fm_chunk_words_at_a_time(results, words) < words ? fm_round_up(2 * results, 16) : 0;
    }
    case FM_WORLD_FIM:
        return job->halo ? fm_round_up(2 * voxels, 16) : 0;
    default:
        return 2 * fm_round_up((fm_chunk_propagates_sites(job->algorithm) ? 4 : 2) * voxels, 16);
    }
}

static void add_to_batch(fm_chunk_job *job, const fm_world_domain *domain) {
    uint64_t results = volume(domain->result_size);
    job->count++;
    job->scratch += scratch_bytes(job, domain);
    job->voxels += volume(domain->size);
    job->result_voxels += results;
    job->largest_result = fm_max_u64(job->largest_result, results);
    job->words = fm_max_u64(job->words, words_of(domain));
    for (int k = 0; k < 3; k++) {
        job->largest[k] = (uint32_t)fm_max_u64(job->largest[k], domain->size[k]);
    }
}

// Whether the batch has become more than scratch memory allows or, for brute force, more than a dispatch should try.
static bool is_full(const fm_chunk_job *job) {
    bool tries = job->algorithm == FM_WORLD_BRUTE_FORCE && fm_chunk_words_at_a_time(job->result_voxels, job->words) < job->words;
    return job->count > 1 && (tries || job->scratch > job->budget);
}

static void clear_batch(fm_chunk_job *job) {
    job->count = 0;
    job->scratch = job->voxels = job->result_voxels = job->largest_result = job->words = 0;
    memset(job->largest, 0, sizeof job->largest);
}

// Fills the batch with domains of the job's algorithm from `first` on, as many as may be done at a time; returns where it ended.
static uint32_t fill_batch(fm_chunk_job *job, uint32_t first) {
    uint32_t i = first;
    clear_batch(job);
    for (; i < job->all->domain_count; i++) {
        const fm_world_domain *domain = &job->all->domains[i];
        if (domain->algorithm != job->algorithm) {
            continue;
        }
        fm_chunk_job before = *job;
        add_to_batch(job, domain);
        if (is_full(job)) {
            *job = before;
            break;
        }
    }
    return i;
}

// Writes the batch's entries of the table.
static void enter_batch(fm_chunk_job *job, uint32_t first, uint32_t end) {
    uint64_t scratch = job->scratch_address;
    fm_gpu_domain *entry = job->table;
    for (uint32_t i = first; i < end; i++) {
        const fm_world_domain *domain = &job->all->domains[i];
        if (domain->algorithm != job->algorithm) {
            continue;
        }
        entry->scratch = scratch;
        for (int k = 0; k < 3; k++) {
            entry->domain[k] = domain->begin[k] | domain->size[k] << 16;
            entry->result[k] = domain->result_begin[k] | domain->result_size[k] << 16;
        }
        scratch += scratch_bytes(job, domain);
        entry++;
    }
}

// The batches of jump flooding are in the field: all of it is relaxed together.
static fm_result relax_seeds(fm_chunk_job *job) {
    clear_batch(job);
    for (uint32_t i = 0; i < job->all->domain_count; i++) {
        if (job->all->domains[i].algorithm == job->algorithm) {
            add_to_batch(job, &job->all->domains[i]);
        }
    }
    job->table_address -= (uint64_t)job->count * sizeof *job->table;
    fm_result status = fm_chunk_is_alone(job) ? FM_OK : fm_chunk_relax(job, true);
    job->table_address += (uint64_t)job->count * sizeof *job->table;
    return status;
}

// All domains of the job's algorithm, batch by batch; their entries follow each other in the table.
static fm_result do_algorithm(fm_chunk_job *job) {
    bool any = false;
    for (uint32_t next = 0; next < job->all->domain_count;) {
        uint32_t first = next;
        next = fill_batch(job, first);
        if (job->count > 0) {
            any = true;
            enter_batch(job, first, next);
            FM_TRY(do_batch(job));
            job->table += job->count;
            job->table_address += (uint64_t)job->count * sizeof *job->table;
        }
    }
    return any && job->algorithm == FM_WORLD_JFA_FIM && !job->halo ? relax_seeds(job) : FM_OK;
}

// Memory for the largest batch of all algorithms. What is recorded already must not lose its own.
static fm_result reserve(fm_chunk_job *job) {
    uint64_t scratch = 0, blocks = 0;
    bool relaxes = false;
    for (fm_world_algorithm i = FM_WORLD_BRUTE_FORCE; i <= FM_WORLD_PUBLISHED_FINAL; i++) {
        uint32_t batches = 0, alone = 0;
        job->algorithm = i;
        for (uint32_t next = 0; next < job->all->domain_count;) {
            next = fill_batch(job, next);
            batches += job->count > 0;
            alone += job->count > 0 && fm_chunk_is_alone(job);
            bool listed = job->count > 0 && fm_chunk_relaxes(i) && !fm_chunk_is_alone(job);
            relaxes = relaxes || listed;
            scratch = fm_max_u64(scratch, job->count > 0 && fm_chunk_is_alone(job) ? 0 : job->scratch);
            fm_chunk_set_groups(job, FM_BLOCK_EDGE, FM_BLOCK_EDGE, FM_BLOCK_EDGE);
            blocks = fm_max_u64(blocks, listed && job->halo ? (uint64_t)job->count * job->push.groups : 0);
        }
        job->mixed[i] = batches > 1 && ((job->halo && fm_chunk_relaxes(i)) || (alone > 0 && alone < batches));
    }
    if (relaxes && job->world->desc.method.convergence == FM_CONVERGE_DEVICE) {
        FM_TRY(fm_chunk_reserve_blocks(job, blocks));
    }
    return scratch > 0 ? fm_gpu_scratch(job->gpu, scratch, &job->scratch_address) : FM_OK;
}

static fm_result do_job(fm_chunk_job *job) {
    void *table;
    uint64_t bytes = (uint64_t)job->all->domain_count * sizeof *job->table;
    FM_TRY(reserve(job));
    FM_TRY(fm_gpu_world_upload(job->world, job->slot, bytes, &table, &job->table_address));
    job->table = table;
    for (fm_world_algorithm i = FM_WORLD_BRUTE_FORCE; i <= FM_WORLD_PUBLISHED_FINAL; i++) {
        job->algorithm = i;
        FM_TRY(do_algorithm(job));
    }
    fm_chunk_end_pass(job);
    return FM_OK;
}

fm_result fm_gpu_chunks_update(fm_world *world, const fm_world_job *all, fm_slot **slot) {
    fm_gpu_world *gpu_world = world->gpu;
    const fm_world_method *method = &world->desc.method;
    fm_shape shape = world->desc.shape;
    struct fm_gpu_chunks *own = gpu_world->chunks;
    if (own->before == world->newest) {
        fm_chunk_forget_lists(own);  // that update failed
    }
    own->before = world->newest;
    own->wait_ns = 0;
    own->iterations = 0;
    own->chunks = all->domain_count;
    if (all->domain_count > 0) {
        fm_chunk_job job = {.world = world,
                            .own = own,
                            .gpu = gpu_world->gpu,
                            .slot = slot,
                            .all = all,
                            .budget = budget(),
                            .padded = all->domains[0].padded,
                            .linked = all->domains[0].linked,
                            .halo = method->chunk != 0 && method->border == FM_BORDER_HALO,
                            .field_width = fm_field_width(world->desc.format),
                            .push = {.bits = fm_buffer_address(gpu_world->bits),
                                     .field = fm_buffer_address(gpu_world->field),
                                     .x = shape.x,
                                     .y = shape.y,
                                     .z = shape.z,
                                     .row_words = fm_bits_row_words(shape),
                                     .chunk = method->chunk,
                                     .cap = fm_world_cap(&world->desc)}};
        return do_job(&job);
    }
    return FM_OK;
}

void fm_gpu_chunks_stats(fm_world *world, fm_world_stats *stats) {
    const struct fm_gpu_chunks *own = world->gpu->chunks;
    if (own) {
        const uint32_t *counted = fm_buffer_mapped(world->gpu->flights[world->gpu->flight].readback);
        stats->chunks = own->chunks;
        stats->iterations = own->iterations + counted[FM_COUNTED_CHUNKS];
        stats->host_wait_ms = (double)own->wait_ns * 1e-6;
    }
}
