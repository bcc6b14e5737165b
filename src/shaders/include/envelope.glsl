// SPDX-License-Identifier: MIT
// The lower envelope of every column: out(n) = min over m of cost(in(m), n - m), exact, and the m that gives it.
//
// One invocation owns ROWS rows of one column; LANES adjacent columns, whole, lie in shared memory, so that a pass reads each raw
// distance (or the bits) once, writes each once and may work in place.
//
// The row of the nearest site never decreases along a column, for all three metrics (total monotonicity: Aggarwal et al. 1987), so
// once it is known for the first row of each segment, a segment's other rows need look only between those of its neighbours,
// halving the gap each time. Blocks of ROWS rows know their least cost and are passed over where even that, at the block's near
// edge, cannot win.
//
// Expects cost.glsl, ROWS, LANES, SEGMENTS and SITES, column_rows(), x_end(), load_cost(slice, n, x) and
// store_result(slice, n, x, cost, nearest row).

const uint ROWS_LOG2 = 4;
// A gap of one row a segment keeps segments apart in the banks.
shared cost_t rows[SEGMENTS * (ROWS + 1) * LANES];
shared cost_t block_least[SEGMENTS * LANES];
shared uint block_at[SEGMENTS * LANES];
shared uint boundary[SEGMENTS * LANES];

uint lane;

cost_t row_at(uint n) {
    return rows[(n + (n >> ROWS_LOG2)) * LANES + lane];
}

cost_t least_of(uint block) {
    return block_least[block * LANES + lane];
}

cost_t cost_at(uint m, uint n) {
    return cost(row_at(m), int(m) - int(n));
}

// Whether a cost beats the best so far, or could where `value` is a bound.
bool beats(cost_t value, uint m, cost_t best, uint at) {
    return value < best || (SITES && value == best && m < at);
}

bool could_beat(cost_t bound, cost_t best) {
    return SITES ? bound <= best : bound < best;
}

void try_rows(uint n, uint begin, uint end, inout cost_t best, inout uint at) {
    for (uint m = begin; m < end; m++) {
        cost_t value = cost_at(m, n);
        if (beats(value, m, best, at)) {
            best = value;
            at = m;
        }
    }
}

// The nearest site of a segment's first row n: blocks outward from it, first by their least cost alone to get a good bound.
void find_boundary(uint segment, uint n, out cost_t best, out uint at) {
    at = n;
    best = row_at(n);
    for (uint away = 0; away < SEGMENTS; away++) {
        if (!could_beat(steps_cost(away * ROWS, column_weight()), best)) {
            break;
        }
        [[unroll]] for (uint side = 0; side < 2; side++) {
            uint block = side == 0 ? segment + away : segment - 1 - away;
            if (block < SEGMENTS) {
                uint m = block_at[block * LANES + lane];
                cost_t value = cost(least_of(block), int(m) - int(n));
                if (beats(value, m, best, at)) {
                    best = value;
                    at = m;
                }
            }
        }
    }
    for (uint away = 0; away < SEGMENTS; away++) {
        if (!could_beat(steps_cost(away * ROWS, column_weight()), best)) {
            break;
        }
        uint block = segment + away;
        if (block < SEGMENTS && could_beat(cost(least_of(block), int(away * ROWS)), best)) {
            try_rows(n, block * ROWS, min(block * ROWS + ROWS, column_rows()), best, at);
        }
        block = segment - 1 - away;
        if (block < SEGMENTS && could_beat(cost(least_of(block), int(away * ROWS + 1)), best)) {
            try_rows(n, block * ROWS, min(block * ROWS + ROWS, column_rows()), best, at);
        }
    }
}

// The nearest site of row n, known to lie in rows low to high.
void find_between(uint n, uint low, uint high, out cost_t best, out uint at) {
    at = low;
    best = cost_at(low, n);
    if (low == high) {
        return;
    }
    cost_t value = cost_at(high, n);
    if (value < best) {
        best = value;
        at = high;
    }
    int far = reach(best);
    uint m = uint(max(int(low) + 1, int(n) - far));
    uint end = uint(min(int(high), int(n) + far + 1));
    while (m < end) {
        uint block = m >> ROWS_LOG2;
        uint block_end = min(end, (block + 1) << ROWS_LOG2);
        int gap = max(0, max(int(n) - int(block_end) + 1, int(m) - int(n)));
        if (could_beat(cost(least_of(block), gap), best)) {
            try_rows(n, m, block_end, best, at);
        }
        m = block_end;
    }
}

void envelope_tile(uint slice, uint tile_x) {
    lane = gl_LocalInvocationID.x;
    uint segment = gl_LocalInvocationID.y;
    uint x = tile_x + lane;
    uint n0 = segment * ROWS;
    uint count = x < x_end() && n0 < column_rows() ? min(ROWS, column_rows() - n0) : 0;

    cost_t least = COST_NONE;
    uint least_at = n0;
    // Loads hang on no condition, so that they can be under way together; what lies past the end is replaced.
    cost_t loaded[ROWS];
    [[unroll]] for (uint i = 0; i < ROWS; i++) {
        loaded[i] = load_cost(slice, min(n0 + i, column_rows() - 1), min(x, x_end() - 1));
    }
    [[unroll]] for (uint i = 0; i < ROWS; i++) {
        cost_t g = i < count ? loaded[i] : COST_NONE;
        rows[(n0 + i + segment) * LANES + lane] = g;
        if (g < least) {
            least = g;
            least_at = n0 + i;
        }
    }
    block_least[segment * LANES + lane] = least;
    block_at[segment * LANES + lane] = least_at;
    barrier();

    uint at[ROWS + 1];
    at[0] = n0;
    cost_t value = COST_NONE;
    if (count > 0) {
        find_boundary(segment, n0, value, at[0]);
    }
    boundary[segment * LANES + lane] = at[0];
    barrier();
    at[ROWS] = n0 + ROWS < column_rows() ? boundary[(segment + 1) * LANES + lane] : column_rows() - 1;
    // A column without any site leaves every cost at none; one with a site gives every row a nearest one.
    bool found = !is_none(value);

    // Row 0, then 8, then 4 and 12, and so on; kept a loop, for its body is long. The whole column was read before the first
    // barrier, so the results may take its place.
    [[dont_unroll]] for (uint i = 0; i < ROWS; i++) {
        uint level = i == 0 ? 0 : uint(findMSB(i));
        uint step = (ROWS / 2) >> level;
        uint row = i == 0 ? 0 : step + (i - (1u << level)) * 2 * step;
        if (row < count) {
            if (row > 0 && found) {
                find_between(n0 + row, at[row - step], at[row + step], value, at[row]);
            }
            store_result(slice, n0 + row, x, value, at[row]);
        } else {
            at[row] = at[ROWS];
        }
    }
}
