// SPDX-License-Identifier: MIT
// Manhattan distances, for the lanes of transform/lanes.h. Sums saturate at NONE.

enum { W(LANES) = VECTOR_BYTES / sizeof(LANE) };

// A row with room for what the rounds read around it.
typedef struct W(padded) {
    LANE before[TILE], row[TILE], behind[TILE];
} W(padded);

static inline void W(pad)(W(padded) * padded) {
    memset(padded, 0xff, sizeof *padded);
}

// Distances along x. After the round of s every voxel knows the sites of the tile up to 2 s - 1 away; those outside it are known
// before.
static inline void W(distances_x)(row_sites from, W(padded) * padded, LANE *out) {
    static const LANE up[TILE] = {0,  1,  2,  3,  4,  5,  6,  7,  8,  9,  10, 11, 12, 13, 14, 15, 16, 17, 18, 19, 20, 21,
                                  22, 23, 24, 25, 26, 27, 28, 29, 30, 31, 32, 33, 34, 35, 36, 37, 38, 39, 40, 41, 42, 43,
                                  44, 45, 46, 47, 48, 49, 50, 51, 52, 53, 54, 55, 56, 57, 58, 59, 60, 61, 62, 63};
    static const LANE down[TILE] = {63, 62, 61, 60, 59, 58, 57, 56, 55, 54, 53, 52, 51, 50, 49, 48, 47, 46, 45, 44, 43, 42,
                                    41, 40, 39, 38, 37, 36, 35, 34, 33, 32, 31, 30, 29, 28, 27, 26, 25, 24, 23, 22, 21, 20,
                                    19, 18, 17, 16, 15, 14, 13, 12, 11, 10, 9,  8,  7,  6,  5,  4,  3,  2,  1,  0};
    if (from.sites == UINT64_MAX) {
        memset(out, 0, TILE * sizeof(LANE));
        return;
    }
    const vector left = V(set)((LANE)least_of(from.left, NONE));
    const vector right = V(set)((LANE)least_of(from.right, NONE));
    const uint32_t words[4] = {(uint32_t)from.sites, (uint32_t)(from.sites >> 32), 0, 0};
    LANE *row = from.sites ? padded->row : out;
    bool open = false;
    for (ptrdiff_t x = 0; x < TILE; x += W(LANES)) {
        const vector outside = V(min)(V(add)(load(up + x), left), V(add)(load(down + x), right));
        store(row + x, from.sites ? V(min)(outside, CLEAR_WHERE(words, (uint32_t)x)) : outside);
        open |= from.sites != 0;
    }
    for (ptrdiff_t s = 1; s < TILE && open; s *= 2) {
        const vector step = V(set)((LANE)s);
        open = false;
        for (ptrdiff_t x = 0; x < TILE; x += W(LANES)) {
            const vector beside = V(min)(load(row + x - s), load(row + x + s));
            const vector least = V(min)(load(row + x), V(add)(beside, step));
            store(row + x, least);
            open |= V(any_less)(step, least);
        }
    }
    if (row != out) {
        memcpy(out, row, TILE * sizeof(LANE));
    }
}

static inline bool W(differ)(const LANE *a, const LANE *b) {
    bool differ = false;
    for (ptrdiff_t x = 0; x < TILE; x += W(LANES)) {
        differ |= V(any_less)(load(a + x), load(b + x)) || V(any_less)(load(b + x), load(a + x));
    }
    return differ;
}

// out = min(a, b + 1)
static inline void W(sweep)(LANE *out, const LANE *a, const LANE *b) {
    const vector one = V(set)(1);
    for (ptrdiff_t x = 0; x < TILE; x += W(LANES)) {
        store(out + x, V(min)(load(a + x), V(add)(load(b + x), one)));
    }
}

static void W(changed)(const fm_exact_job *job, const uint32_t *before, uint32_t y, uint32_t z) {
    W(padded) padded;
    LANE old_row[TILE], new_row[TILE];
    const uint32_t *now = row_bits(job, y, z);
    W(pad)(&padded);
    for (uint32_t t = 0; t < job->tiles; t++) {
        const row_sites was = sites_of(job, before, t);
        const row_sites is = sites_of(job, now, t);
        uint8_t *flag = &job->dirty_y[(uint64_t)z * job->tiles + t];
        if ((was.sites == is.sites && was.left == is.left && was.right == is.right) || __atomic_load_n(flag, __ATOMIC_RELAXED)) {
            continue;
        }
        W(distances_x)(was, &padded, old_row);
        W(distances_x)(is, &padded, new_row);
        if (W(differ)(old_row, new_row)) {
            set_flag(flag);
        }
    }
}

static void W(along_y)(void *user, uint64_t begin, uint64_t end, uint32_t worker) {
    const fm_exact_job *job = user;
    const uint64_t rows = job->shape.y, depth = job->shape.z;
    LANE *column = worker_memory(job, worker);
    W(padded) padded;
    W(pad)(&padded);
    for (uint64_t item = begin; item < end; item++) {
        const uint64_t tile = item_tile(job, item);
        const uint32_t t = (uint32_t)(tile % job->tiles);
        const uint64_t z = tile / job->tiles;
        for (uint64_t y = 0; y < rows; y++) {
            LANE *row = column + y * TILE;
            W(distances_x)(sites_of(job, row_bits(job, y, z), t), &padded, row);
            W(sweep)(row, row, y > 0 ? row - TILE : row);
        }
        for (uint64_t y = rows; y-- > 0;) {
            LANE *row = column + y * TILE;
            LANE *middle = (LANE *)job->middle + ((t + job->tiles * y) * depth + z) * TILE;
            W(sweep)(row, row, y + 1 < rows ? row + TILE : row);
            if (job->full) {
                write_past(middle, row, TILE * sizeof(LANE));
            } else if (W(differ)(row, middle)) {
                memcpy(middle, row, TILE * sizeof(LANE));
                set_flag(&job->dirty_z[t + job->tiles * y]);
            }
        }
    }
    stream_fence();
}

// Writes `count` distances to the field where these differ from what is there; whether any did. `full`: nothing is there yet.
static FM_INLINE bool W(write_run)(const fm_exact_job *job, uint64_t element, uint32_t count, const LANE *from, bool full) {
    if (job->format != FM_FIELD_PACKED) {
        LANE *to = (LANE *)job->field + element;
        const bool differs = full || memcmp(to, from, count * sizeof(LANE)) != 0;
        if (differs) {
            memcpy(to, from, count * sizeof(LANE));
        }
        return differs;
    }
    uint32_t *to = (uint32_t *)job->field + element;
    if (full) {
        const uint32_t *voxels = job->voxels + element;
        uint32_t entries[TILE];
        for (uint32_t i = 0; i < count; i++) {
            entries[i] = (uint32_t)from[i] << 24 | (voxels[i] & 0xff);
        }
        write_past(to, entries, count * sizeof *entries);
        return true;
    }
    uint32_t differs = 0;
    for (uint32_t i = 0; i < count; i++) {
        differs |= to[i] >> 24 ^ from[i];
    }
    for (uint32_t i = 0; differs && i < count; i++) {
        to[i] = (to[i] & 0xffffff) | (uint32_t)from[i] << 24;
    }
    return differs != 0;
}

static inline bool W(write)(const fm_exact_job *job, uint32_t t, uint64_t y, uint64_t z, const LANE *from) {
    const uint64_t element = (uint64_t)t * TILE + job->shape.x * (y + job->shape.y * z);
    const uint32_t width = tile_width(job, t);
    // Loops of a known length need no rest.
    if (width == TILE) {
        return W(write_run)(job, element, TILE, from, job->full);
    }
    return W(write_run)(job, element, width, from, job->full);
}

// Beyond the slices that changed, a voxel's distance changes only if that of its neighbour on their side does: a slice that does
// not change in this tile ends it.
static void W(write_column)(const fm_exact_job *job, uint32_t t, uint64_t y, const LANE *column) {
    const uint64_t first = job->full ? 0 : job->range[2 * t];
    const uint64_t last = job->full ? job->shape.z - 1 : job->range[2 * t + 1];
    for (uint64_t z = first; z <= last; z++) {
        W(write)(job, t, y, z, column + z * TILE);
    }
    for (uint64_t z = first; z > 0 && W(write)(job, t, y, z - 1, column + (z - 1) * TILE); z--) {
    }
    for (uint64_t z = last + 1; z < job->shape.z && W(write)(job, t, y, z, column + z * TILE); z++) {
    }
}

static void W(along_z)(void *user, uint64_t begin, uint64_t end, uint32_t worker) {
    const fm_exact_job *job = user;
    const uint64_t depth = job->shape.z;
    LANE *column = worker_memory(job, worker);
    for (uint64_t item = begin; item < end; item++) {
        const uint64_t tile = item_tile(job, item);
        const LANE *middle = (const LANE *)job->middle + tile * depth * TILE;
        for (uint64_t z = 0; z < depth; z++) {
            W(sweep)(column + z * TILE, middle + z * TILE, z > 0 ? column + (z - 1) * TILE : middle);
        }
        for (uint64_t z = depth - 1; z-- > 0;) {
            W(sweep)(column + z * TILE, column + z * TILE, column + (z + 1) * TILE);
        }
        W(write_column)(job, (uint32_t)(tile % job->tiles), tile / job->tiles, column);
    }
    stream_fence();
}
