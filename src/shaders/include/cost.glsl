// SPDX-License-Identifier: MIT
// The cost of a site: the raw distance g within its row or slice, and d steps along the pass's axis. COST_F32 holds whole numbers
// exactly below 2^24 and weighted sums rounded step by step; COST_U32 whole numbers below 2^32.
// Expects the constants METRIC and WEIGHTED, row_weight() and column_weight().

#ifdef COST_U32
#define cost_t uint
const cost_t COST_NONE = FM_GPU_NONE;
#else
#define cost_t float
#define COST_NONE uintBitsToFloat(0x7f800000u)
#endif

bool is_none(cost_t g) {
#ifdef COST_U32
    return g == COST_NONE;
#else
    // By its bits: compilers may take a float comparison with infinity for granted.
    return floatBitsToUint(g) >= 0x7f800000u;
#endif
}

cost_t steps_cost(uint d, float weight) {
#ifdef COST_U32
    return METRIC == FM_GPU_L2 ? d * d : d;
#else
    // Rounded in the order in which the CPU rounds: (weight * d) * d.
    precise float along = WEIGHTED ? weight * float(d) : float(d);
    if (METRIC == FM_GPU_L2) {
        along = along * float(d);
    }
    return along;
#endif
}

cost_t add_cost(cost_t g, cost_t steps) {
#ifdef COST_U32
    return METRIC == FM_GPU_LINF ? max(g, steps) : g == COST_NONE ? g : g + steps;
#else
    precise float sum = g + steps;
    return METRIC == FM_GPU_LINF ? max(g, steps) : sum;
#endif
}

// d may be negative.
cost_t cost(cost_t g, int d) {
#ifndef COST_U32
    if (METRIC == FM_GPU_L2 && !WEIGHTED) {
        return fma(float(d), float(d), g);
    }
#endif
    return add_cost(g, steps_cost(uint(abs(d)), column_weight()));
}

// Steps beyond which no site can beat `best`; rounding is on the safe side.
int reach(cost_t best) {
#ifdef COST_U32
    float steps = float(best);
#else
    float steps = WEIGHTED ? best / column_weight() : best;
#endif
    steps = METRIC == FM_GPU_L2 ? sqrt(steps) : steps;
    return int(min(steps * 1.000001, 2.0e9)) + 1;
}

cost_t row_cost(uvec2 ways) {
    uint way = min(ways.x, ways.y);
    return way == FM_GPU_NONE ? COST_NONE : steps_cost(way, row_weight());
}

uint cost_bits(cost_t value) {
#ifdef COST_U32
    return value;
#else
    return floatBitsToUint(value);
#endif
}

cost_t cost_from_bits(uint value) {
#ifdef COST_U32
    return value;
#else
    return uintBitsToFloat(value);
#endif
}

// Whole numbers of COST_F32 become 32-bit ones again.
uint exact_raw(cost_t value) {
#ifdef COST_U32
    return value;
#else
    return is_none(value) ? FM_GPU_NONE : uint(value);
#endif
}
