// SPDX-License-Identifier: MIT
// The chunked methods within a domain, which the kernels (shaders/chunk_*.comp) equal bit for bit. Relaxation and jump flooding
// read one array and write another, so that results do not depend on the number of threads.

#include "world/host_domain.h"

#include <assert.h>
#include <string.h>

static bool is_solid(const fm_world *world, uint64_t x, uint64_t y, uint64_t z) {
    fm_shape shape = world->desc.shape;
    uint64_t row = z * shape.y + y;
    return world->host->bits[row * fm_bits_row_words(shape) + x / 32] >> (x % 32) & 1;
}

static bool is_domain_solid(const fm_domain_work *w, uint32_t x, uint32_t y, uint32_t z) {
    const uint32_t *begin = w->domain->begin;
    return is_solid(w->world, (uint64_t)begin[0] + x, (uint64_t)begin[1] + y, (uint64_t)begin[2] + z);
}

static uint64_t element_of(const fm_world *world, uint64_t x, uint64_t y, uint64_t z) {
    return (z * world->desc.shape.y + y) * world->desc.shape.x + x;
}

// Of the voxel in the arrays with a rim.
static uint64_t place_of(const fm_domain_work *w, uint32_t x, uint32_t y, uint32_t z) {
    return (z + 1) * w->slice + (y + 1) * w->row + x + 1;
}

static uint64_t site_place_of(const fm_domain_work *w, uint32_t x, uint32_t y, uint32_t z) {
    return ((uint64_t)z * w->size[1] + y) * w->size[0] + x;
}

static uint64_t rimmed_voxels(const uint32_t size[3]) {
    return ((uint64_t)size[0] + 2) * ((uint64_t)size[1] + 2) * ((uint64_t)size[2] + 2);
}

// Two arrays of distances, the slices' flags, two arrays of sites.
uint64_t fm_domain_scratch(const fm_world_domain *domain) {
    uint64_t distances = 2 * fm_round_up(2 * rimmed_voxels(domain->size), FM_ALIGNMENT);
    uint64_t flags = fm_round_up(2 * ((uint64_t)domain->size[2] + 2), FM_ALIGNMENT);
    uint64_t voxels = (uint64_t)domain->size[0] * domain->size[1] * domain->size[2];
    return distances + flags + (fm_chunk_propagates_sites(domain->algorithm) ? 8 * voxels : 0);
}

void fm_domain_lay_out(fm_domain_work *w, const fm_world_domain *domain, void *scratch) {
    w->domain = domain;
    memcpy(w->size, domain->size, sizeof w->size);
    w->row = (uint64_t)w->size[0] + 2;
    w->slice = w->row * ((uint64_t)w->size[1] + 2);
    uint64_t distances = fm_round_up(2 * rimmed_voxels(w->size), FM_ALIGNMENT);
    uint8_t *memory = scratch;
    w->now = (uint16_t *)(void *)memory;
    w->next = (uint16_t *)(void *)(memory + distances);
    w->changed = memory + 2 * distances;
    w->next_changed = w->changed + w->size[2] + 2;
    memory += 2 * distances + fm_round_up(2 * ((uint64_t)w->size[2] + 2), FM_ALIGNMENT);
    w->sites = (uint32_t *)(void *)memory;
    w->next_sites = w->sites + (uint64_t)w->size[0] * w->size[1] * w->size[2];
    w->iterations = 0;
}

static void each_slice(fm_domain_work *w, fm_pool_fn fn) {
    if (w->pool) {
        fm_pool_run(w->pool, w->size[2], 1, fn, w);
    } else {
        fn(w, 0, w->size[2], 0);
    }
}

static void init_slices(void *user, uint64_t begin, uint64_t end, uint32_t worker) {
    (void)worker;
    fm_domain_work *w = user;
    for (uint32_t z = (uint32_t)begin; z < end; z++) {
        for (uint32_t y = 0; y < w->size[1]; y++) {
            uint16_t *row = w->now + place_of(w, 0, y, z);
            for (uint32_t x = 0; x < w->size[0]; x++) {
                row[x] = is_domain_solid(w, x, y, z) ? 0 : (uint16_t)w->initial;
            }
        }
    }
}

static void init(fm_domain_work *w, uint32_t initial) {
    // The rim: padding is solid.
    memset(w->now, w->domain->padded ? 0 : 0xff, 2 * rimmed_voxels(w->size));
    w->initial = initial;
    each_slice(w, init_slices);
    memcpy(w->next, w->now, 2 * rimmed_voxels(w->size));
}

static void swap_distances(fm_domain_work *w) {
    uint16_t *now = w->now;
    w->now = w->next;
    w->next = now;
}

static uint32_t least(uint32_t a, uint32_t b) {
    return a < b ? a : b;
}

static bool relax_row(const fm_domain_work *w, uint32_t y, uint32_t z) {
    uint64_t at = place_of(w, 0, y, z);
    const uint16_t *now = w->now + at;
    uint16_t *next = w->next + at;
    uint32_t lowered = 0;
    for (uint32_t x = 0; x < w->size[0]; x++) {
        const uint16_t *p = now + x;
        uint32_t along_x = least(p[-1], p[1]);
        uint32_t along_y = least(*(p - w->row), p[w->row]);
        uint32_t along_z = least(*(p - w->slice), p[w->slice]);
        uint32_t value = least(*p, least(along_x, least(along_y, along_z)) + 1);
        lowered |= *p - value;
        next[x] = (uint16_t)value;
    }
    return lowered != 0;
}

// A slice that did not change in the iteration before holds the same in both arrays, and stays so if its neighbours did not either.
static void relax_slices(void *user, uint64_t begin, uint64_t end, uint32_t worker) {
    (void)worker;
    fm_domain_work *w = user;
    for (uint32_t z = (uint32_t)begin; z < end; z++) {
        bool lowered = false;
        if (w->changed[z] || w->changed[z + 1] || w->changed[z + 2]) {
            for (uint32_t y = 0; y < w->size[1]; y++) {
                lowered |= relax_row(w, y, z);
            }
        }
        w->next_changed[z + 1] = lowered;
    }
}

// Until nothing changes. Both arrays must be equal, or differ by one step of jump flooding: then all is written anew at first.
void fm_domain_relax(fm_domain_work *w) {
    uint64_t slices = (uint64_t)w->size[2] + 2;
    memset(w->changed, 0, 2 * slices);
    memset(w->changed + 1, 1, w->size[2]);
    bool lowered = true;
    while (lowered) {
        each_slice(w, relax_slices);
        lowered = memchr(w->next_changed, 1, slices) != NULL;
        uint8_t *changed = w->changed;
        w->changed = w->next_changed;
        w->next_changed = changed;
        swap_distances(w);
        w->iterations += lowered;
    }
}

static void flood_slices(void *user, uint64_t begin, uint64_t end, uint32_t worker) {
    (void)worker;
    fm_domain_work *w = user;
    uint32_t beyond = w->domain->padded ? 0 : FM_CHUNK_UNKNOWN;
    for (uint32_t z = (uint32_t)begin; z < end; z++) {
        for (uint32_t y = 0; y < w->size[1]; y++) {
            for (uint32_t x = 0; x < w->size[0]; x++) {
                const uint32_t at[3] = {x, y, z};
                const uint64_t strides[3] = {1, w->row, w->slice};
                uint64_t place = place_of(w, x, y, z);
                uint32_t nearest = FM_CHUNK_UNKNOWN;
                for (int i = 0; i < 3; i++) {
                    uint32_t before = at[i] >= w->step ? w->now[place - w->step * strides[i]] : beyond;
                    uint32_t after = at[i] + w->step < w->size[i] ? w->now[place + w->step * strides[i]] : beyond;
                    nearest = least(nearest, least(before, after));
                }
                w->next[place] = (uint16_t)least(w->now[place], nearest + w->step);
            }
        }
    }
}

static void flood(fm_domain_work *w) {
    uint32_t steps[FM_MAX_STEPS];
    uint32_t count = fm_chunk_steps(w->world, w->domain->algorithm, steps);
    for (uint32_t i = 0; i < count; i++) {
        w->step = steps[i];
        each_slice(w, flood_slices);
        swap_distances(w);
    }
}

static uint32_t pack_site(uint32_t x, uint32_t y, uint32_t z) {
    return x | y << FM_SITE_BITS | z << 2 * FM_SITE_BITS;
}

static uint32_t apart(uint32_t a, uint32_t b) {
    return a < b ? b - a : a - b;
}

static uint32_t site_distance(uint32_t site, uint32_t x, uint32_t y, uint32_t z) {
    const uint32_t mask = (1u << FM_SITE_BITS) - 1;
    return site == fm_site_none
               ? FM_CHUNK_UNKNOWN
               : apart(site & mask, x) + apart(site >> FM_SITE_BITS & mask, y) + apart(site >> 2 * FM_SITE_BITS, z);
}

static void init_site_slices(void *user, uint64_t begin, uint64_t end, uint32_t worker) {
    (void)worker;
    fm_domain_work *w = user;
    for (uint32_t z = (uint32_t)begin; z < end; z++) {
        for (uint32_t y = 0; y < w->size[1]; y++) {
            uint32_t *row = w->sites + site_place_of(w, 0, y, z);
            for (uint32_t x = 0; x < w->size[0]; x++) {
                row[x] = is_domain_solid(w, x, y, z) ? pack_site(x, y, z) : fm_site_none;
            }
        }
    }
}

// The neighbour `step` voxels away in one of three places along an axis, or none.
static bool neighbour(uint32_t at, int place, uint32_t step, uint32_t size, uint32_t *result) {
    *result = at + (uint32_t)place * step;
    return place < 0 ? at >= step : *result < size;
}

// The voxel's own site comes first, then those of the neighbours with x fastest; of equally near ones the first stays.
static uint32_t nearest_site(const fm_domain_work *w, uint32_t x, uint32_t y, uint32_t z) {
    uint32_t site = w->sites[site_place_of(w, x, y, z)];
    uint32_t distance = site_distance(site, x, y, z);
    for (int i = 0; i < 9 && distance > 0; i++) {
        uint32_t at[3];
        if (!neighbour(z, i / 3 - 1, w->step, w->size[2], &at[2]) || !neighbour(y, i % 3 - 1, w->step, w->size[1], &at[1])) {
            continue;
        }
        const uint32_t *row = w->sites + site_place_of(w, 0, at[1], at[2]);
        for (int dx = -1; dx <= 1; dx++) {
            uint32_t other = neighbour(x, dx, w->step, w->size[0], &at[0]) ? row[at[0]] : fm_site_none;
            uint32_t way = site_distance(other, x, y, z);
            site = way < distance ? other : site;
            distance = least(distance, way);
        }
    }
    return site;
}

static void flood_site_slices(void *user, uint64_t begin, uint64_t end, uint32_t worker) {
    (void)worker;
    fm_domain_work *w = user;
    for (uint32_t z = (uint32_t)begin; z < end; z++) {
        for (uint32_t y = 0; y < w->size[1]; y++) {
            for (uint32_t x = 0; x < w->size[0]; x++) {
                w->next_sites[site_place_of(w, x, y, z)] = nearest_site(w, x, y, z);
            }
        }
    }
}

static void flood_sites(fm_domain_work *w) {
    uint32_t steps[FM_MAX_STEPS];
    uint32_t count = fm_chunk_steps(w->world, w->domain->algorithm, steps);
    each_slice(w, init_site_slices);
    for (uint32_t i = 0; i < count; i++) {
        w->step = steps[i];
        each_slice(w, flood_site_slices);
        uint32_t *sites = w->sites;
        w->sites = w->next_sites;
        w->next_sites = sites;
    }
}

// Steps to the nearest site of a word whose lowest bit lies at `first`, from x; FM_CHUNK_UNKNOWN if it has none.
static uint32_t word_distance(uint32_t word, int64_t first, int64_t x) {
    uint32_t best = FM_CHUNK_UNKNOWN;
    for (; word != 0; word &= word - 1) {
        int64_t steps = first + __builtin_ctz(word) - x;
        best = least(best, (uint32_t)(steps < 0 ? -steps : steps));
    }
    return best;
}

static uint32_t brute_distance(const fm_domain_work *w, uint32_t x, uint32_t y, uint32_t z) {
    const uint32_t *begin = w->domain->begin;
    fm_shape shape = w->world->desc.shape;
    uint64_t first = begin[0], last = first + w->size[0] - 1;
    uint32_t best = FM_CHUNK_UNKNOWN;
    for (uint32_t sz = 0; sz < w->size[2]; sz++) {
        for (uint32_t sy = 0; sy < w->size[1]; sy++) {
            uint64_t row = ((uint64_t)begin[2] + sz) * shape.y + begin[1] + sy;
            uint32_t across = apart(sy, y) + apart(sz, z);
            for (uint64_t i = first / 32; i <= last / 32; i++) {
                uint32_t word = w->world->host->bits[row * fm_bits_row_words(shape) + i];
                word &= i == first / 32 ? UINT32_MAX << (first % 32) : UINT32_MAX;
                word &= i == last / 32 ? UINT32_MAX >> (31 - last % 32) : UINT32_MAX;
                best = least(best, word_distance(word, (int64_t)(i * 32), (int64_t)(first + x)) + across);
            }
        }
    }
    return best;
}

// Steps out of the domain.
static uint32_t way_out(const fm_domain_work *w, const uint32_t at[3]) {
    uint32_t way = UINT32_MAX;
    for (int i = 0; i < 3; i++) {
        way = least(way, least(at[i] + 1, w->size[i] - at[i]));
    }
    return way;
}

static uint32_t result_at(const fm_domain_work *w, uint32_t x, uint32_t y, uint32_t z) {
    fm_world_algorithm algorithm = w->domain->algorithm;
    if (algorithm != FM_WORLD_BRUTE_FORCE && !fm_chunk_propagates_sites(algorithm)) {
        return w->now[place_of(w, x, y, z)];
    }
    uint32_t distance = algorithm == FM_WORLD_BRUTE_FORCE ? brute_distance(w, x, y, z)
                                                          : site_distance(w->sites[site_place_of(w, x, y, z)], x, y, z);
    const uint32_t at[3] = {x, y, z};
    return w->domain->padded ? least(distance, way_out(w, at)) : distance;
}

static void finish_slices(void *user, uint64_t begin, uint64_t end, uint32_t worker) {
    (void)worker;
    const fm_domain_work *w = user;
    const fm_world_domain *domain = w->domain;
    uint32_t cap = fm_world_cap(&w->world->desc);
    uint32_t first[3], last[3];
    for (int i = 0; i < 3; i++) {
        first[i] = domain->result_begin[i] - domain->begin[i];
        last[i] = first[i] + domain->result_size[i];
    }
    for (uint32_t z = (uint32_t)fm_max_u64(begin, first[2]); z < fm_min_u64(end, last[2]); z++) {
        for (uint32_t y = first[1]; y < last[1]; y++) {
            uint64_t row = element_of(w->world, domain->begin[0], (uint64_t)domain->begin[1] + y, (uint64_t)domain->begin[2] + z);
            for (uint32_t x = first[0]; x < last[0]; x++) {
                if (!is_domain_solid(w, x, y, z)) {
                    fm_host_set_distance(w->world, row + x, least(result_at(w, x, y, z), cap));
                }
            }
        }
    }
}

void fm_domain_store(fm_domain_work *w) {
    each_slice(w, finish_slices);
}

void fm_domain_compute(fm_domain_work *w) {
    switch (w->domain->algorithm) {
    case FM_WORLD_FIM:
        init(w, FM_CHUNK_UNKNOWN);
        fm_domain_relax(w);
        break;
    case FM_WORLD_JFA_FIM:
        init(w, FM_CHUNK_UNKNOWN);
        flood(w);
        fm_domain_relax(w);
        break;
    case FM_WORLD_JFA_PUBLISHED:
        init(w, FM_CHUNK_UNKNOWN);
        flood(w);
        break;
    case FM_WORLD_PUBLISHED_FINAL:
        init(w, 1);
        flood(w);
        break;
    case FM_WORLD_BRUTE_FORCE:
        break;
    default:
        assert(fm_chunk_propagates_sites(w->domain->algorithm));
        flood_sites(w);
    }
    fm_domain_store(w);
}

// Beyond the world nothing is known.
void fm_domain_load(fm_domain_work *w) {
    fm_shape shape = w->world->desc.shape;
    const uint32_t *begin = w->domain->begin;
    for (uint32_t z = 0; z < w->size[2] + 2; z++) {
        for (uint32_t y = 0; y < w->size[1] + 2; y++) {
            uint64_t gz = (uint64_t)begin[2] + z, gy = (uint64_t)begin[1] + y;  // one too many
            bool outside = gz == 0 || gz > shape.z || gy == 0 || gy > shape.y;
            // Along the edges of the rim lie chunks of the same colour, which nothing here needs.
            int beside = (z == 0 || z > w->size[2]) + (y == 0 || y > w->size[1]);
            for (uint32_t x = 0; x < w->size[0] + 2; x++) {
                uint64_t gx = (uint64_t)begin[0] + x;
                bool none = outside || gx == 0 || gx > shape.x || beside + (x == 0 || x > w->size[0]) > 1;
                uint32_t value = none ? FM_CHUNK_UNKNOWN : fm_host_distance(w->world, element_of(w->world, gx - 1, gy - 1, gz - 1));
                w->now[z * w->slice + y * w->row + x] = (uint16_t)value;
            }
        }
    }
    memcpy(w->next, w->now, 2 * rimmed_voxels(w->size));
}
