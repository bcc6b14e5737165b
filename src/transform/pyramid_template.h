// SPDX-License-Identifier: MIT
// Passes that search a pyramid of minima, once for each kind of raw distance: define RAW (type), RAW_NONE, NAME(name), STEP(plan,
// metric, axis, steps), WAY_OUT, CAP, FINISH, REACH.
//
// A column's voxel takes the least sum of an element and the steps to it. A node of the pyramid holds the least of FANOUT nodes
// below it; with the steps to its nearest row that bounds its sums from below, for any rounding, as every operation rounds
// monotonically. Nodes are tried in the order of their rows and left out when they can neither beat the best sum nor equal it at a
// lower row. What won one row back makes a tight first guess, so that few nodes stay; where it is near, the rows around are quicker
// tried one by one. All lanes go together.

static FM_INLINE RAW NAME(combine)(fm_metric metric, RAW a, RAW b) {
    return metric != FM_METRIC_LINF ? a + b : a < b ? b : a;
}

// Minima above `field` as levels that follow one another; returns how many.
static uint32_t NAME(build)(uint32_t count, const RAW *field, RAW *minima, const RAW *levels[MAX_LEVELS]) {
    uint32_t level = 0;
    levels[0] = field;
    while (count > 1) {
        const RAW *below = levels[level];
        const uint32_t nodes = (count + FANOUT - 1) / FANOUT;
        for (uint32_t node = 0; node < nodes; node++) {
            RAW *restrict least = minima + (size_t)node * LANES;
            const uint32_t end = count < (node + 1) * FANOUT ? count : (node + 1) * FANOUT;
            memcpy(least, below + (size_t)node * FANOUT * LANES, LANES * sizeof(RAW));
            for (uint32_t child = node * FANOUT + 1; child < end; child++) {
                const RAW *restrict value = below + (size_t)child * LANES;
                for (int lane = 0; lane < LANES; lane++) {
                    least[lane] = value[lane] < least[lane] ? value[lane] : least[lane];
                }
            }
        }
        levels[++level] = minima;
        minima += (size_t)nodes * LANES;
        count = nodes;
    }
    return level;
}

// The lanes' best sum so far, its row and the element there.
typedef struct NAME(found) {
    RAW sum[LANES], element[LANES];
    uint32_t row[LANES];
} NAME(found);

// Whether a node that is `step` away may improve a lane.
static FM_INLINE bool NAME(may_win)(fm_metric metric, const RAW *restrict least, RAW step, uint32_t first,
                                    const NAME(found) *restrict best) {
    uint32_t open = 0;
    for (int lane = 0; lane < LANES; lane++) {
        const RAW bound = NAME(combine)(metric, least[lane], step);
        open |=
            (uint32_t)(least[lane] != RAW_NONE) &
            ((uint32_t)(bound < best->sum[lane]) | ((uint32_t)(bound == best->sum[lane]) & (uint32_t)(first < best->row[lane])));
    }
    return open != 0;
}

static FM_INLINE void NAME(try_row)(fm_metric metric, const RAW *restrict element, RAW step, uint32_t row,
                                    NAME(found) *restrict best) {
    for (int lane = 0; lane < LANES; lane++) {
        const RAW through = element[lane] == RAW_NONE ? RAW_NONE : NAME(combine)(metric, element[lane], step);
        const bool better = (through < best->sum[lane]) | ((through == best->sum[lane]) & (row < best->row[lane]));
        best->sum[lane] = better ? through : best->sum[lane];
        best->element[lane] = better ? element[lane] : best->element[lane];
        best->row[lane] = better ? row : best->row[lane];
    }
}

// Moves from one row to the next: the guesses are the element there and the one that was best before.
static FM_INLINE void NAME(guess)(const fm_plan *plan, fm_metric metric, int axis, uint32_t row, const RAW *restrict element,
                                  NAME(found) *restrict best) {
    for (int lane = 0; lane < LANES; lane++) {
        const uint32_t from = best->row[lane];
        const RAW step = STEP(plan, metric, axis, from < row ? row - from : from - row);
        const RAW before = best->element[lane] == RAW_NONE ? RAW_NONE : NAME(combine)(metric, best->element[lane], step);
        const bool here = (element[lane] < before) | ((element[lane] == before) & (row < from));
        best->sum[lane] = here ? element[lane] : before;
        best->element[lane] = here ? element[lane] : best->element[lane];
        best->row[lane] = here ? row : from;
    }
}

// Whether a row `step` away may improve a lane.
static FM_INLINE bool NAME(reaches)(RAW step, const NAME(found) *restrict best) {
    uint32_t open = 0;
    for (int lane = 0; lane < LANES; lane++) {
        open |= step <= best->sum[lane];
    }
    return open != 0;
}

// Up to NEAR rows up and down.
static FM_INLINE void NAME(look_around)(const fm_plan *plan, fm_metric metric, int axis, uint32_t row, uint32_t count,
                                        const RAW *field, NAME(found) *restrict best) {
    for (uint32_t k = 1; k <= NEAR; k++) {
        const RAW step = STEP(plan, metric, axis, k);
        if (!NAME(reaches)(step, best)) {
            break;
        }
        if (k <= row) {
            NAME(try_row)(metric, field + (size_t)(row - k) * LANES, step, row - k, best);
        }
        if (k < count - row) {
            NAME(try_row)(metric, field + (size_t)(row + k) * LANES, step, row + k, best);
        }
    }
}

static FM_INLINE void NAME(descend)(const fm_plan *plan, fm_metric metric, int axis, uint32_t row, uint32_t count,
                                    const RAW *const levels[MAX_LEVELS], uint32_t top, NAME(found) *restrict best) {
    uint32_t level = top;
    for (uint64_t first = 0; first < count;) {
        const uint32_t shift = level * FANOUT_BITS;
        const uint64_t last = first + (1ull << shift) - 1;
        const RAW step = STEP(plan, metric, axis, (uint32_t)(row < first ? first - row : row > last ? row - last : 0));
        const RAW *least = levels[level] + (size_t)(first >> shift) * LANES;
        if (level > 0 && NAME(may_win)(metric, least, step, (uint32_t)first, best)) {
            level--;
            continue;
        }
        if (level == 0) {
            NAME(try_row)(metric, least, step, (uint32_t)first, best);
        }
        first = last + 1;
        while (level < top && (first >> (level * FANOUT_BITS)) % FANOUT == 0) {
            level++;
        }
    }
}

static FM_INLINE void NAME(search)(const fm_plan *plan, fm_metric metric, int axis, uint32_t count, const RAW *field, RAW *minima,
                                   RAW *best_sum, uint32_t *from) {
    const RAW *levels[MAX_LEVELS];
    const uint32_t top = NAME(build)(count, field, minima, levels);
    const RAW beyond = STEP(plan, metric, axis, NEAR + 1);
    NAME(found) best;
    memcpy(best.element, field, sizeof best.element);
    memset(best.row, 0, sizeof best.row);
    for (uint32_t row = 0; row < count; row++) {
        NAME(guess)(plan, metric, axis, row, field + (size_t)row * LANES, &best);
        if (NAME(reaches)(beyond, &best)) {
            NAME(descend)(plan, metric, axis, row, count, levels, top, &best);
        } else {
            NAME(look_around)(plan, metric, axis, row, count, field, &best);
        }
        memcpy(best_sum + (size_t)row * LANES, best.sum, sizeof best.sum);
        memcpy(from + (size_t)row * LANES, best.row, sizeof best.row);
    }
}

// Columns of `count` rows and LANES lanes: `field` in, `best` and the row it came from out; of equal sums the lowest row.
static void NAME(columns)(const fm_plan *plan, int axis, uint32_t count, const pass_scratch *scratch) {
    const RAW *field = scratch->field;
    switch (plan->metric) {
    case FM_METRIC_L2:
        NAME(search)(plan, FM_METRIC_L2, axis, count, field, scratch->minima, scratch->best, scratch->from);
        break;
    case FM_METRIC_L1:
        NAME(search)(plan, FM_METRIC_L1, axis, count, field, scratch->minima, scratch->best, scratch->from);
        break;
    default:
        NAME(search)(plan, FM_METRIC_LINF, axis, count, field, scratch->minima, scratch->best, scratch->from);
        break;
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
        out[x] = from[x] == UINT32_MAX ? RAW_NONE : STEP(plan, plan->metric, 0, steps);
    }
}

static void NAME(plane)(const pass_job *job, uint64_t z, const pass_scratch *scratch) {
    const fm_plan *plan = job->plan;
    const uint32_t size_x = plan->shape.x;
    const uint32_t size_y = plan->shape.y;
    const uint64_t plane = (uint64_t)size_x * size_y;
    RAW *raw = (RAW *)job->raw + z * plane;
    uint64_t *source = job->source ? job->source + z * plane : NULL;
    for (uint32_t y = 0; y < size_y; y++) {
        NAME(row)(plan, job->sites, z * size_y + y, job->invert, raw + (uint64_t)y * size_x, scratch->row);
        for (uint32_t x = 0; source && x < size_x; x++) {
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
                field[y * LANES + lane] = lane < width ? raw[y * size_x + x + lane] : RAW_NONE;
            }
            if (source) {
                memcpy(moved + y * LANES, source + y * size_x + x, width * sizeof *moved);
            }
        }
        NAME(columns)(plan, 1, size_y, scratch);
        for (uint64_t y = 0; y < size_y; y++) {
            memcpy(raw + y * size_x + x, best + y * LANES, width * sizeof *raw);
            for (uint32_t lane = 0; source && lane < width; lane++) {
                uint64_t from = scratch->from[y * LANES + lane];
                source[y * size_x + x + lane] = from * size_x + moved[from * LANES + lane];
            }
        }
    }
}

// The index of the site at raw distance `total`, in slice `from`.
static uint64_t NAME(site)(const pass_job *job, uint64_t in_plane, uint64_t from, RAW total) {
    const fm_plan *plan = job->plan;
    if (plan->metric == FM_METRIC_LINF) {
        const uint32_t x = (uint32_t)(in_plane % plan->shape.x);
        const uint32_t y = (uint32_t)(in_plane / plan->shape.x);
        return fm_linf_index(job->sites, x, y, (uint32_t)from, REACH(plan, 0, total), REACH(plan, 1, total));
    }
    const uint64_t plane = (uint64_t)plan->shape.x * plan->shape.y;
    return from * plane + job->source[from * plane + in_plane];
}

static void NAME(depth)(const pass_job *job, uint64_t tile, const pass_scratch *scratch) {
    const fm_plan *plan = job->plan;
    const uint64_t plane = (uint64_t)plan->shape.x * plan->shape.y;
    const uint32_t size_z = plan->shape.z;
    const uint64_t start = tile * LANES;
    const uint32_t width = (uint32_t)fm_min_u64(LANES, plane - start);
    const RAW *raw = (const RAW *)job->raw + start;
    RAW *field = scratch->field;
    const RAW *best = scratch->best;
    for (uint64_t z = 0; z < size_z; z++) {
        for (uint32_t lane = 0; lane < LANES; lane++) {
            field[z * LANES + lane] = lane < width ? raw[z * plane + lane] : RAW_NONE;
        }
    }
    NAME(columns)(plan, 2, size_z, scratch);
    for (uint64_t z = 0; z < size_z; z++) {
        for (uint32_t lane = 0; lane < width; lane++) {
            const uint64_t in_plane = start + lane;
            const uint64_t at = z * plane + in_plane;
            const RAW total = best[z * LANES + lane];
            RAW way = RAW_NONE;
            if (job->border) {
                way = WAY_OUT(plan, (uint32_t)(in_plane % plan->shape.x), (uint32_t)(in_plane / plan->shape.x), (uint32_t)z);
            }
            if (job->index) {
                const bool dropped = total == RAW_NONE || way < total || total > CAP(plan);
                const uint64_t from = scratch->from[z * LANES + lane];
                fm_store_index(plan, job->index, at, dropped ? UINT64_MAX : NAME(site)(job, in_plane, from, total));
            }
            if (job->distance && (!job->invert || total != 0)) {
                double value = FINISH(plan, way < total ? way : total);
                fm_store_distance(plan, job->distance, at, job->invert ? -value : value);
            }
        }
    }
}
