// SPDX-License-Identifier: MIT
// The chunked methods on Vulkan: which kernels a job takes, their tables and scratch memory.
//
// All domains of an algorithm share their dispatches, in batches that scratch memory limits. Relaxation works in the field itself,
// but for halos, whose domains overlap, and takes no scratch memory.

#include "world/chunks.h"
#include "world/gpu_world.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

enum {
    HEADERS = 8192,      // of lists; each round uses one
    BLOCK_EDGE = 8,      // of chunk_relax.comp where domains have several blocks
    ALONE_EDGE = 16,     // domains up to this are one block
    TILE_THREADS = 256,  // of kernels that own a voxel an invocation
    BRUTE_THREADS = 128,
    BRUTE_WORDS = 32768,  // that a dispatch tries at most: software drivers end loops that run too long
    BRUTE_STEP = 256,
};

static const uint64_t scratch_budget = (uint64_t)1 << 30;
static const uint64_t pair_voxels = (uint64_t)1 << 16;  // of a domain, up to which steps of jump flooding go two to a dispatch
static const uint64_t brute_tries = (uint64_t)1 << 36;  // of words, a dispatch: a fraction of a second

_Static_assert(FM_MAX_STEPS < 32 && FM_SITE_BITS == 10, "chunk_sites.comp packs sites so");

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

typedef struct chunk_job {
    fm_world *world;
    struct fm_gpu_chunks *own;
    fm_gpu *gpu;
    fm_slot **slot;
    const fm_world_job *all;
    fm_world_algorithm algorithm;
    bool padded, linked, halo;
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
} chunk_job;

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

// The next update clears the lists: what should have cleared them may never have run.
static void forget_lists(struct fm_gpu_chunks *own) {
    own->next_header = HEADERS;
    own->stamp = 0;
}

static fm_result create_headers(fm_world *world, struct fm_gpu_chunks *own) {
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
    forget_lists(own);
    return status;
}

fm_result fm_gpu_chunks_prepare(fm_world *world) {
    fm_gpu_world *gpu_world = world->gpu;
    if (gpu_world->chunks) {
        forget_lists(gpu_world->chunks);
        return FM_OK;
    }
    struct fm_gpu_chunks *own = fm_alloc_zero(&world->context->allocator, sizeof *own, "a world's chunks");
    if (!own) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    gpu_world->chunks = own;
    fm_result status = create_headers(world, own);
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

// Lists and stamps for as many blocks.
static fm_result reserve_blocks(chunk_job *job, uint64_t blocks) {
    struct fm_gpu_chunks *own = job->own;
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

static void barrier(chunk_job *job) {
    fm_commands_barrier(job->gpu, *job->slot);
}

static void end_pass(chunk_job *job) {
    if (job->pass) {
        fm_commands_pass(job->gpu, *job->slot, job->pass, job->pass_bytes);
        job->pass = NULL;
        job->pass_bytes = 0;
    }
}

// Begins a step that moves so many bytes. It follows what has been recorded, within one pass where names are the same: there may be
// more batches than passes that are listed. Steps that batches take by turns cannot be told apart.
static void begin_step(chunk_job *job, const char *name, uint64_t bytes) {
    name = job->mixed[job->algorithm] ? "chunks" : name;
    if (job->pass && strcmp(job->pass, name) == 0) {
        barrier(job);
    } else {
        end_pass(job);
    }
    job->pass = name;
    job->pass_bytes += bytes;
}

static uint32_t field_width(const chunk_job *job) {
    return fm_field_width(job->world->desc.format);
}

enum { COMMON_CONSTANTS = 5, MAX_CONSTANTS = 12 };

// A dispatch over the batch, or of a list: `indirect` then holds its group counts. `more` are the kernel's own constants.
static fm_result dispatch(chunk_job *job, fm_kernel kernel, uint32_t threads, const uint32_t *more, uint32_t more_count,
                          const fm_buffer *indirect, uint64_t offset) {
    uint32_t constants[MAX_CONSTANTS] = {threads, job->world->desc.format, job->halo, job->padded, job->linked};
    assert(COMMON_CONSTANTS + more_count <= MAX_CONSTANTS);
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

// Groups of a domain, by tiles of the largest one.
static void set_groups(chunk_job *job, uint32_t x, uint32_t y, uint32_t z) {
    job->push.groups_x = (uint32_t)fm_div_up(job->largest[0], x);
    job->push.groups_y = (uint32_t)fm_div_up(job->largest[1], y);
    job->push.groups = job->push.groups_x * job->push.groups_y * (uint32_t)fm_div_up(job->largest[2], z);
}

// A kernel of which each invocation owns a voxel. Tiles are as wide as rows that the domains have.
static fm_result dispatch_voxels(chunk_job *job, fm_kernel kernel, const uint32_t *more, uint32_t more_count) {
    uint32_t x = job->largest[0] <= 8 ? 8 : job->largest[0] <= 16 ? 16 : 32;
    uint32_t y = x == 8 ? 8 : 4;
    uint32_t constants[MAX_CONSTANTS] = {x, y};
    for (uint32_t i = 0; i < more_count; i++) {
        constants[2 + i] = more[i];
    }
    set_groups(job, x, y, TILE_THREADS / (x * y));
    return dispatch(job, kernel, TILE_THREADS, constants, 2 + more_count, NULL, 0);
}

// Jump flooding, whose last step writes the field unless distances are to be relaxed in scratch memory. They lie in `which` then.
static fm_result flood(chunk_job *job) {
    bool sites = fm_chunk_propagates_sites(job->algorithm);
    bool stays = job->halo && fm_chunk_relaxes(job->algorithm);
    uint32_t steps[FM_MAX_STEPS];
    uint32_t count = fm_chunk_steps(job->world, job->algorithm, steps);
    uint64_t width = sites ? 4 : 2;
    uint64_t largest = (uint64_t)job->largest[0] * job->largest[1] * job->largest[2];
    begin_step(job, "jfa", job->voxels / 8);
    job->push.which = 0;
    for (uint32_t i = 0; i < count;) {
        bool pair = !sites && largest <= pair_voxels && i + 1 < count;
        bool first = i == 0;
        job->push.step = steps[i];
        i += pair ? 2 : 1;
        bool last = i == count && !stays;
        const uint32_t more[] = {first, last, job->algorithm == FM_WORLD_PUBLISHED_FINAL ? 1 : FM_CHUNK_UNKNOWN, pair};
        FM_TRY(dispatch_voxels(job, sites ? FM_KERNEL_CHUNK_SITES : FM_KERNEL_CHUNK_FLOOD, more, sites ? 2 : 4));
        job->push.which ^= first ? 0 : 1;
        job->pass_bytes += (first ? 0 : job->voxels * width) + (last ? job->result_voxels * field_width(job) : job->voxels * width);
        if (i < count) {
            barrier(job);
        }
    }
    return FM_OK;
}

// Rounds of blocks until all distances have arrived: a shortest way of so many steps crosses at most so many faces of blocks.
static uint32_t rounds_of(const chunk_job *job) {
    fm_shape shape = job->world->desc.shape;
    const uint32_t world[3] = {shape.x, shape.y, shape.z};
    uint64_t faces = 0, steps = 0, shortest = UINT32_MAX;
    for (int i = 0; i < 3; i++) {
        uint32_t size = job->linked ? world[i] : job->largest[i];
        faces += fm_div_up(size, BLOCK_EDGE) - 1;
        steps += size - 1;
        shortest = fm_min_u64(shortest, job->largest[i]);
    }
    steps = job->padded ? fm_min_u64(steps, (shortest + 1) / 2) : steps;
    steps = fm_min_u64(steps, fm_world_cap(&job->world->desc) - 1);
    return (uint32_t)fm_min_u64(faces, (steps + 3 * (BLOCK_EDGE - 1)) / BLOCK_EDGE);
}

static uint64_t world_blocks(const fm_world *world) {
    fm_shape shape = world->desc.shape;
    return fm_div_up(shape.x, BLOCK_EDGE) * fm_div_up(shape.y, BLOCK_EDGE) * fm_div_up(shape.z, BLOCK_EDGE);
}

// Memory of the lists for `rounds` rounds, clear.
static void prepare_rounds(chunk_job *job, uint32_t rounds) {
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
        barrier(job);
    }
}

// The lists of a round and of the next.
static void set_round(chunk_job *job, uint32_t round) {
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

// Relaxes all blocks of the batch once, then those that rounds list. `seeded`: distances are there already.
static fm_result relax_on_device(chunk_job *job, bool seeded) {
    struct fm_gpu_chunks *own = job->own;
    uint64_t width = job->halo ? 2 : field_width(job);
    // What the rounds move is known only to the device.
    begin_step(job, "relax", (seeded ? job->voxels * width : job->voxels / 8) + job->voxels * width);
    set_groups(job, BLOCK_EDGE, BLOCK_EDGE, BLOCK_EDGE);
    uint32_t rounds = rounds_of(job);
    prepare_rounds(job, rounds);
    uint32_t more[] = {BLOCK_EDGE, seeded ? FM_CHUNK_SEEDED : FM_CHUNK_INIT};
    for (uint32_t round = 0; round <= rounds; round++, own->next_header++) {
        bool listed = round > 0;
        set_round(job, round);
        more[1] = listed ? FM_CHUNK_LISTED : more[1];
        FM_TRY(dispatch(job, FM_KERNEL_CHUNK_RELAX, 128, more, 2, listed ? own->headers : NULL,
                        (uint64_t)own->next_header * FM_LIST_HEADER_BYTES + 4));
        if (round < rounds) {
            barrier(job);
        }
    }
    own->next_header++;  // the last round's list of what is left, which is empty
    own->iterations = (uint32_t)fm_max_u64(own->iterations, 1);
    return FM_OK;
}

// As published: an iteration a dispatch, and the host looks whether it changed anything.
static fm_result relax_by_host(chunk_job *job, bool seeded) {
    struct fm_gpu_chunks *own = job->own;
    uint64_t width = job->halo ? 2 : field_width(job);
    job->push.counted = fm_buffer_address(own->flag);
    if (!seeded) {
        const uint32_t more[] = {true};
        begin_step(job, "init", job->voxels / 8 + job->voxels * width);
        FM_TRY(dispatch_voxels(job, FM_KERNEL_CHUNK_FIM, more, 1));
    }
    uint32_t iterations = 0;
    for (;;) {
        const uint32_t more[] = {false};
        begin_step(job, "relax", job->voxels * width);
        fm_commands_fill(job->gpu, *job->slot, own->flag, 0, 4, 0);
        barrier(job);
        FM_TRY(dispatch_voxels(job, FM_KERNEL_CHUNK_FIM, more, 1));
        end_pass(job);
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

static fm_result relax(chunk_job *job, bool seeded) {
    bool by_host = job->world->desc.method.convergence == FM_CONVERGE_HOST;
    return by_host ? relax_by_host(job, seeded) : relax_on_device(job, seeded);
}

// Whether each domain is one block of chunk_relax.comp, which then does all there is to do in one dispatch.
static bool is_alone(const chunk_job *job) {
    bool fits = !job->halo && !job->linked;
    for (int i = 0; i < 3; i++) {
        fits = fits && job->largest[i] <= ALONE_EDGE;
    }
    bool by_host = fm_chunk_relaxes(job->algorithm) && job->world->desc.method.convergence == FM_CONVERGE_HOST;
    return fits && !by_host && job->algorithm != FM_WORLD_BRUTE_FORCE && !fm_chunk_propagates_sites(job->algorithm);
}

static fm_result do_alone(chunk_job *job) {
    bool small = job->largest[0] <= BLOCK_EDGE && job->largest[1] <= BLOCK_EDGE && job->largest[2] <= BLOCK_EDGE;
    uint32_t edge = small ? BLOCK_EDGE : ALONE_EDGE;
    uint32_t threads = (uint32_t)fm_min_u64(small ? 128 : 512, job->world->context->device.max_workgroup);
    uint32_t steps[FM_MAX_STEPS];
    fm_chunk_steps(job->world, job->algorithm, steps);
    const uint32_t more[] = {edge,
                             FM_CHUNK_INIT,
                             true,
                             job->algorithm == FM_WORLD_FIM ? 0 : steps[0],
                             fm_chunk_relaxes(job->algorithm),
                             job->algorithm == FM_WORLD_PUBLISHED_FINAL ? 1 : FM_CHUNK_UNKNOWN};
    begin_step(job, "chunks", job->voxels / 8 + job->voxels * field_width(job));
    set_groups(job, edge, edge, edge);
    FM_TRY(dispatch(job, FM_KERNEL_CHUNK_RELAX, threads, more, sizeof more / sizeof more[0], NULL, 0));
    job->own->iterations = (uint32_t)fm_max_u64(job->own->iterations, fm_chunk_relaxes(job->algorithm));
    return FM_OK;
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

// Words of a domain that one dispatch tries, for so many voxels.
static uint64_t words_at_a_time(uint64_t voxels, uint64_t words) {
    if (words <= BRUTE_WORDS && words <= brute_tries / voxels) {
        return words;
    }
    return fm_max_u64(BRUTE_STEP, fm_min_u64(brute_tries / voxels / BRUTE_STEP * BRUTE_STEP, BRUTE_WORDS));
}

static fm_result brute(chunk_job *job) {
    uint64_t step = words_at_a_time(job->result_voxels, job->words);
    if (job->words > UINT32_MAX - BRUTE_WORDS || job->largest_result > UINT32_MAX - BRUTE_THREADS) {
        return fm_fail(FM_ERROR_UNSUPPORTED, "FM_WORLD_BRUTE_FORCE takes domains of at most 2^32 - 1 voxels: this one has %llu",
                       (unsigned long long)job->largest_result);
    }
    begin_step(job, "brute force", job->voxels / 8 + job->result_voxels * field_width(job));
    job->push.groups = (uint32_t)fm_div_up(job->largest_result, BRUTE_THREADS);
    for (uint64_t first = 0; first < job->words; first += step) {
        const uint32_t more[] = {first == 0, first + step >= job->words};
        job->push.first = (uint32_t)first;
        job->push.step = (uint32_t)step;
        FM_TRY(dispatch(job, FM_KERNEL_CHUNK_BRUTE, BRUTE_THREADS, more, 2, NULL, 0));
        if (first + step < job->words) {
            barrier(job);
        }
    }
    return FM_OK;
}

static fm_result do_batch(chunk_job *job) {
    if (is_alone(job)) {
        return do_alone(job);
    }
    switch (job->algorithm) {
    case FM_WORLD_BRUTE_FORCE:
        return brute(job);
    case FM_WORLD_FIM:
        job->push.which = 0;
        FM_TRY(relax(job, false));
        break;
    case FM_WORLD_JFA_FIM:
        FM_TRY(flood(job));
        FM_TRY(job->halo ? relax(job, true) : FM_OK);
        break;
    default:
        return flood(job);
    }
    if (job->halo) {
        begin_step(job, "finish", job->result_voxels * (2 + field_width(job)));
        FM_TRY(dispatch_voxels(job, FM_KERNEL_CHUNK_FINISH, NULL, 0));
    }
    return FM_OK;
}

// Scratch memory of a domain.
static uint64_t scratch_bytes(const chunk_job *job, const fm_world_domain *domain) {
    uint64_t voxels = volume(domain->size);
    switch (job->algorithm) {
    case FM_WORLD_BRUTE_FORCE: {
        uint64_t results = volume(domain->result_size), words = words_of(domain);
        return words_at_a_time(results, words) < words ? fm_round_up(2 * results, 16) : 0;
    }
    case FM_WORLD_FIM:
        return job->halo ? fm_round_up(2 * voxels, 16) : 0;
    default:
        return 2 * fm_round_up((fm_chunk_propagates_sites(job->algorithm) ? 4 : 2) * voxels, 16);
    }
}

static void add_to_batch(chunk_job *job, const fm_world_domain *domain) {
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
static bool is_full(const chunk_job *job) {
    bool tries = job->algorithm == FM_WORLD_BRUTE_FORCE && words_at_a_time(job->result_voxels, job->words) < job->words;
    return job->count > 1 && (tries || job->scratch > job->budget);
}

static void clear_batch(chunk_job *job) {
    job->count = 0;
    job->scratch = job->voxels = job->result_voxels = job->largest_result = job->words = 0;
    memset(job->largest, 0, sizeof job->largest);
}

// Fills the batch with domains of the job's algorithm from `first` on, as many as may be done at a time; returns where it ended.
static uint32_t fill_batch(chunk_job *job, uint32_t first) {
    uint32_t i = first;
    clear_batch(job);
    for (; i < job->all->domain_count; i++) {
        const fm_world_domain *domain = &job->all->domains[i];
        if (domain->algorithm != job->algorithm) {
            continue;
        }
        chunk_job before = *job;
        add_to_batch(job, domain);
        if (is_full(job)) {
            *job = before;
            break;
        }
    }
    return i;
}

// Writes the batch's entries of the table.
static void enter_batch(chunk_job *job, uint32_t first, uint32_t end) {
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
static fm_result relax_seeds(chunk_job *job) {
    clear_batch(job);
    for (uint32_t i = 0; i < job->all->domain_count; i++) {
        if (job->all->domains[i].algorithm == job->algorithm) {
            add_to_batch(job, &job->all->domains[i]);
        }
    }
    job->table_address -= (uint64_t)job->count * sizeof *job->table;
    fm_result status = is_alone(job) ? FM_OK : relax(job, true);
    job->table_address += (uint64_t)job->count * sizeof *job->table;
    return status;
}

// All domains of the job's algorithm, batch by batch; their entries follow each other in the table.
static fm_result do_algorithm(chunk_job *job) {
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
static fm_result reserve(chunk_job *job) {
    uint64_t scratch = 0, blocks = 0;
    bool relaxes = false;
    for (fm_world_algorithm i = FM_WORLD_BRUTE_FORCE; i <= FM_WORLD_PUBLISHED_FINAL; i++) {
        uint32_t batches = 0, alone = 0;
        job->algorithm = i;
        for (uint32_t next = 0; next < job->all->domain_count;) {
            next = fill_batch(job, next);
            batches += job->count > 0;
            alone += job->count > 0 && is_alone(job);
            bool listed = job->count > 0 && fm_chunk_relaxes(i) && !is_alone(job);
            relaxes = relaxes || listed;
            scratch = fm_max_u64(scratch, job->count > 0 && is_alone(job) ? 0 : job->scratch);
            set_groups(job, BLOCK_EDGE, BLOCK_EDGE, BLOCK_EDGE);
            blocks = fm_max_u64(blocks, listed && job->halo ? (uint64_t)job->count * job->push.groups : 0);
        }
        job->mixed[i] = batches > 1 && ((job->halo && fm_chunk_relaxes(i)) || (alone > 0 && alone < batches));
    }
    if (relaxes && job->world->desc.method.convergence == FM_CONVERGE_DEVICE) {
        FM_TRY(reserve_blocks(job, job->halo ? blocks : world_blocks(job->world)));
    }
    return scratch > 0 ? fm_gpu_scratch(job->gpu, scratch, &job->scratch_address) : FM_OK;
}

static fm_result do_job(chunk_job *job) {
    void *table;
    uint64_t bytes = (uint64_t)job->all->domain_count * sizeof *job->table;
    FM_TRY(reserve(job));
    FM_TRY(fm_gpu_world_upload(job->world, job->slot, bytes, &table, &job->table_address));
    job->table = table;
    for (fm_world_algorithm i = FM_WORLD_BRUTE_FORCE; i <= FM_WORLD_PUBLISHED_FINAL; i++) {
        job->algorithm = i;
        FM_TRY(do_algorithm(job));
    }
    end_pass(job);
    return FM_OK;
}

fm_result fm_gpu_chunks_update(fm_world *world, const fm_world_job *all, fm_slot **slot) {
    fm_gpu_world *gpu_world = world->gpu;
    const fm_world_method *method = &world->desc.method;
    fm_shape shape = world->desc.shape;
    struct fm_gpu_chunks *own = gpu_world->chunks;
    if (own->before == world->newest) {
        forget_lists(own);  // that update failed
    }
    own->before = world->newest;
    own->wait_ns = 0;
    own->iterations = 0;
    own->chunks = all->domain_count;
    if (all->domain_count > 0) {
        chunk_job job = {.world = world,
                         .own = own,
                         .gpu = gpu_world->gpu,
                         .slot = slot,
                         .all = all,
                         .budget = budget(),
                         .padded = all->domains[0].padded,
                         .linked = all->domains[0].linked,
                         .halo = method->chunk != 0 && method->border == FM_BORDER_HALO,
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
