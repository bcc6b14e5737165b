// SPDX-License-Identifier: MIT
// The chunked methods on the CPU: domains shared out to threads, and the exchange across their faces.

#include "world/host_domain.h"

#include <string.h>

typedef struct domain_loop {
    fm_world *world;
    const fm_world_job *job;
    uint8_t *scratch;
    uint64_t scratch_bytes;  // a worker
    uint32_t iterations;
    // EXCHANGE: the chunks' numbers along each axis, and whether something beyond a chunk's faces changed.
    uint32_t chunks[3];
    uint8_t *active;
    uint32_t colour;
    bool changed;
} domain_loop;

static void raise_to(uint32_t *most, uint32_t value) {
    uint32_t now = __atomic_load_n(most, __ATOMIC_RELAXED);
    while (now < value && !__atomic_compare_exchange_n(most, &now, value, true, __ATOMIC_RELAXED, __ATOMIC_RELAXED)) {
    }
}

static void compute_domains(void *user, uint64_t begin, uint64_t end, uint32_t worker) {
    domain_loop *loop = user;
    for (uint64_t i = begin; i < end; i++) {
        fm_domain_work w = {.world = loop->world};
        fm_domain_lay_out(&w, &loop->job->domains[i], loop->scratch + worker * loop->scratch_bytes);
        fm_domain_compute(&w);
        raise_to(&loop->iterations, w.iterations);
    }
}

static void wake_neighbours(domain_loop *loop, const uint32_t chunk[3]) {
    const uint64_t strides[3] = {1, loop->chunks[0], (uint64_t)loop->chunks[0] * loop->chunks[1]};
    uint64_t at = chunk[0] + chunk[1] * strides[1] + chunk[2] * strides[2];
    for (int i = 0; i < 3; i++) {
        if (chunk[i] > 0) {
            __atomic_store_n(&loop->active[at - strides[i]], 1, __ATOMIC_RELAXED);
        }
        if (chunk[i] + 1 < loop->chunks[i]) {
            __atomic_store_n(&loop->active[at + strides[i]], 1, __ATOMIC_RELAXED);
        }
    }
}

// Chunks of one colour of a checkerboard: they read nothing that others of the colour write.
static void exchange_domains(void *user, uint64_t begin, uint64_t end, uint32_t worker) {
    domain_loop *loop = user;
    for (uint64_t i = begin; i < end; i++) {
        const fm_world_domain *domain = &loop->job->domains[i];
        uint32_t chunk[3];
        for (int k = 0; k < 3; k++) {
            chunk[k] = domain->begin[k] / loop->world->desc.method.chunk;
        }
        uint64_t at = ((uint64_t)chunk[2] * loop->chunks[1] + chunk[1]) * loop->chunks[0] + chunk[0];
        if (((chunk[0] ^ chunk[1] ^ chunk[2]) & 1) != loop->colour || !loop->active[at]) {
            continue;
        }
        loop->active[at] = 0;
        fm_domain_work w = {.world = loop->world};
        fm_domain_lay_out(&w, domain, loop->scratch + worker * loop->scratch_bytes);
        fm_domain_load(&w);
        fm_domain_relax(&w);
        if (w.iterations > 0) {
            fm_domain_store(&w);
            wake_neighbours(loop, chunk);
            __atomic_store_n(&loop->changed, true, __ATOMIC_RELAXED);
        }
    }
}

static fm_result exchange(domain_loop *loop) {
    const fm_world *world = loop->world;
    const fm_allocator *allocator = &world->context->allocator;
    fm_shape shape = world->desc.shape;
    const uint32_t axes[3] = {shape.x, shape.y, shape.z};
    uint64_t count = 1;
    for (int i = 0; i < 3; i++) {
        loop->chunks[i] = (uint32_t)fm_div_up(axes[i], world->desc.method.chunk);
        count *= loop->chunks[i];
    }
    loop->active = fm_alloc(allocator, count, "the active chunks");
    if (!loop->active) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    memset(loop->active, 1, count);
    do {
        loop->changed = false;
        for (loop->colour = 0; loop->colour < 2; loop->colour++) {
            fm_pool_run(world->context->pool, loop->job->domain_count, 1, exchange_domains, loop);
        }
        loop->iterations += loop->changed;
    } while (loop->changed);
    fm_free(allocator, loop->active, count);
    return FM_OK;
}

fm_result fm_host_chunks(fm_world *world, const fm_world_job *job) {
    fm_pool *pool = world->context->pool;
    domain_loop loop = {.world = world, .job = job};
    bool linked = false;
    for (uint32_t i = 0; i < job->domain_count; i++) {
        loop.scratch_bytes = fm_max_u64(loop.scratch_bytes, fm_domain_scratch(&job->domains[i]));
        linked = linked || job->domains[i].linked;
    }
    // Few domains are computed one after the other by all threads, many at the same time by one each.
    bool many = job->domain_count >= 2 * fm_pool_threads(pool);
    uint32_t workers = many || linked ? fm_pool_threads(pool) : 1;
    void *scratch;
    FM_TRY(fm_context_scratch(world->context, loop.scratch_bytes * workers, &scratch));
    loop.scratch = scratch;
    if (many) {
        fm_pool_run(pool, job->domain_count, 1, compute_domains, &loop);
    } else {
        for (uint32_t i = 0; i < job->domain_count; i++) {
            fm_domain_work w = {.world = world, .pool = pool};
            fm_domain_lay_out(&w, &job->domains[i], scratch);
            fm_domain_compute(&w);
            raise_to(&loop.iterations, w.iterations);
        }
    }
    uint64_t voxels = 0;
    for (uint32_t i = 0; i < job->domain_count; i++) {
        const uint32_t *size = job->domains[i].result_size;
        voxels += (uint64_t)size[0] * size[1] * size[2];
    }
    fm_passes_end(world->context, "chunks", voxels * fm_field_width(world->desc.format));
    if (linked) {
        FM_TRY(exchange(&loop));
        fm_passes_end(world->context, "exchange", voxels * fm_field_width(world->desc.format));
    }
    world->stats.chunks = job->domain_count;
    world->stats.iterations = loop.iterations;
    return FM_OK;
}
