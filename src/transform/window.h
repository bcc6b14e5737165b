// SPDX-License-Identifier: MIT
// Passes of the windowed search, once for each kind of raw distance: define RAW (type), RAW_NONE, NAME(name), STEP(plan, axis,
// steps), COMBINE(linf, a, b). Each voxel looks k = 0, 1, 2, ... steps up and down its column until a step alone costs more than
// the best sum found: exact for any rounding of the sums, as each is monotone in both terms.

#define LANES 16

// Columns of `count` rows and LANES lanes: `field` in, `best` and the row it came from out; of equal sums the lowest row.
static void NAME(columns)(const fm_plan *plan, int axis, uint32_t count, const RAW *field, RAW *best, uint32_t *from) {
    const bool linf = plan->metric == FM_METRIC_LINF;
    for (uint32_t row = 0; row < count; row++) {
        RAW *restrict sum = best + (size_t)row * LANES;
        uint32_t *restrict source = from + (size_t)row * LANES;
        for (int lane = 0; lane < LANES; lane++) {
            sum[lane] = field[(size_t)row * LANES + lane];
            source[lane] = row;
        }
        for (uint32_t k = 1; k < count; k++) {
            const RAW step = STEP(plan, axis, k);
            uint32_t open = 0;
            for (int lane = 0; lane < LANES; lane++) {
                open |= step <= sum[lane];
            }
            if (!open || (k > row && k >= count - row)) {
                break;
            }
            if (k <= row) {
                const RAW *restrict low = field + (size_t)(row - k) * LANES;
                for (int lane = 0; lane < LANES; lane++) {
                    RAW through = low[lane] == RAW_NONE ? RAW_NONE : COMBINE(linf, low[lane], step);
                    bool better = through <= sum[lane];
                    sum[lane] = better ? through : sum[lane];
                    source[lane] = better ? row - k : source[lane];
                }
            }
            if (k < count - row) {
                const RAW *restrict high = field + (size_t)(row + k) * LANES;
                for (int lane = 0; lane < LANES; lane++) {
                    RAW through = high[lane] == RAW_NONE ? RAW_NONE : COMBINE(linf, high[lane], step);
                    bool better = through < sum[lane];
                    sum[lane] = better ? through : sum[lane];
                    source[lane] = better ? row + k : source[lane];
                }
            }
        }
    }
}

// Raw distances along a row of bits, and the nearest site's x.
static void NAME(row)(const fm_plan *plan, const fm_sites *sites, uint64_t row, bool invert, RAW *out, uint32_t *from) {
    uint32_t size = plan->shape.x;
    uint32_t last = UINT32_MAX;
    for (uint32_t x = 0; x < size; x++) {
        last = fm_site(sites, row, x) != invert ? x : last;
        from[x] = last;
    }
    last = UINT32_MAX;
    for (uint32_t x = size; x-- > 0;) {
        last = fm_site(sites, row, x) != invert ? x : last;
        if (last != UINT32_MAX && (from[x] == UINT32_MAX || last - x < x - from[x])) {
            from[x] = last;
        }
        uint32_t steps = from[x] < x ? x - from[x] : from[x] - x;
        out[x] = from[x] == UINT32_MAX ? RAW_NONE : STEP(plan, 0, steps);
    }
}

static void NAME(plane)(const pass_job *job, uint64_t z, const pass_scratch *scratch) {
    const fm_plan *plan = job->plan;
    const uint32_t size_x = plan->shape.x;
    const uint32_t size_y = plan->shape.y;
    const uint64_t plane = (uint64_t)size_x * size_y;
    RAW *raw = (RAW *)job->raw + z * plane;
    uint64_t *source = job->source + z * plane;
    for (uint32_t y = 0; y < size_y; y++) {
        NAME(row)(plan, job->sites, z * size_y + y, job->invert, raw + (uint64_t)y * size_x, scratch->row);
        for (uint32_t x = 0; x < size_x; x++) {
            source[(uint64_t)y * size_x + x] = scratch->row[x];
        }
    }
    RAW *field = scratch->field;
    RAW *best = scratch->best;
    uint64_t *moved = scratch->moved;
    for (uint32_t x = 0; x < size_x; x += LANES) {
        uint32_t width = (uint32_t)fm_min_u64(LANES, size_x - x);
        for (uint64_t y = 0; y < size_y; y++) {
            for (uint32_t lane = 0; lane < LANES; lane++) {
                field[y * LANES + lane] = lane < width ? raw[y * size_x + x + lane] : 0;
                moved[y * LANES + lane] = lane < width ? source[y * size_x + x + lane] : 0;
            }
        }
        NAME(columns)(plan, 1, size_y, field, best, scratch->from);
        for (uint64_t y = 0; y < size_y; y++) {
            for (uint32_t lane = 0; lane < width; lane++) {
                uint64_t from = scratch->from[y * LANES + lane];
                raw[y * size_x + x + lane] = best[y * LANES + lane];
                source[y * size_x + x + lane] = from * size_x + moved[from * LANES + lane];
            }
        }
    }
}

static void NAME(depth)(const pass_job *job, uint64_t tile, const pass_scratch *scratch) {
    const fm_plan *plan = job->plan;
    const uint64_t plane = (uint64_t)plan->shape.x * plan->shape.y;
    const uint32_t size_z = plan->shape.z;
    const uint64_t start = tile * LANES;
    const uint32_t width = (uint32_t)fm_min_u64(LANES, plane - start);
    const RAW *raw = (const RAW *)job->raw + start;
    const uint64_t *source = job->source + start;
    RAW *field = scratch->field;
    RAW *best = scratch->best;
    for (uint64_t z = 0; z < size_z; z++) {
        for (uint32_t lane = 0; lane < LANES; lane++) {
            field[z * LANES + lane] = lane < width ? raw[z * plane + lane] : 0;
        }
    }
    NAME(columns)(plan, 2, size_z, field, best, scratch->from);
    for (uint64_t z = 0; z < size_z; z++) {
        for (uint32_t lane = 0; lane < width; lane++) {
            uint64_t from = scratch->from[z * LANES + lane];
            uint64_t at = z * plane + start + lane;
            RAW total = best[z * LANES + lane];
            const uint32_t x = (uint32_t)((start + lane) % plan->shape.x);
            const uint32_t y = (uint32_t)((start + lane) / plan->shape.x);
            const RAW way = job->border ? WAY_OUT(plan, x, y, (uint32_t)z) : RAW_NONE;
            if (job->index) {
                bool dropped = total == RAW_NONE || way < total || total > CAP(plan);
                uint64_t site = from * plane + source[from * plane + lane];
                if (!dropped && plan->metric == FM_METRIC_LINF) {
                    site = fm_linf_index(job->sites, x, y, (uint32_t)from, REACH(plan, 0, total), REACH(plan, 1, total));
                }
                fm_store_index(plan, job->index, at, dropped ? UINT64_MAX : site);
            }
            if (job->distance && (!job->invert || total != 0)) {
                double value = FINISH(plan, way < total ? way : total);
                fm_store_distance(plan, job->distance, at, job->invert ? -value : value);
            }
        }
    }
}

#undef LANES
