// SPDX-License-Identifier: MIT
#version 460
#include "memory.glsl"
#include "column.glsl"

// Squared Euclidean distances along a column: out(n) = min over m of in(m) + (n - m)^2, in floats that hold whole numbers below
// 2^24.
//
// One invocation owns ROWS rows of one column; LANES adjacent columns, whole, lie in shared memory, so that a pass reads each raw
// distance (or the bits) once, writes each once (4 bytes either way a voxel) and may work in place.
//
// The row of the nearest site never decreases along a column (Aggarwal et al. 1987). So once it is known for the first row of each
// segment, the sites of a segment lie between its own and the next one's, and these ranges touch only at their ends: together they
// are as long as the column. Every site of its range is then tried against all ROWS rows at once, in registers: with n = n0 + i the
// cost less i^2 is linear in i, one fused multiply-add and one minimum a row. Blocks of ROWS sites are passed over where even at
// the segment's near edge they cannot beat the worst of its rows.

layout(local_size_x_id = 0, local_size_y_id = 1) in;

const uint ROWS = 16;
const uint LANES = gl_WorkGroupSize.x;
const uint SEGMENTS = gl_WorkGroupSize.y;
// A gap of one number a row: rows and columns can both be walked without conflicts between banks.
const uint STRIDE = LANES + 1;

shared float rows[SEGMENTS * ROWS * STRIDE];
shared float block_least[SEGMENTS * LANES];
shared uint block_at[SEGMENTS * LANES];
shared uint boundary[SEGMENTS * LANES];

uint lane;

float row_at(uint n) {
    return rows[n * STRIDE + lane];
}

float least_of(uint block) {
    return block_least[block * LANES + lane];
}

bool could_win(float bound, float best) {
    return SITES ? bound <= best : bound < best;
}

bool wins(float value, uint m, float best, uint at) {
    return value < best || (SITES && value == best && m < at);
}

float way(uint carry) {
    return carry == FM_GPU_NONE ? COST_NONE : float(carry);
}

// Fills the tile from bits: an invocation takes whole rows of it, LANES voxels of one word each, forth for the sites to the left
// and back for those to the right.
void load_from_bits(uint slice, uint x0, uint length) {
    uint shift = x0 & 31u;
    for (uint n = gl_LocalInvocationIndex; n < SEGMENTS * ROWS; n += LANES * SEGMENTS) {
        uint64_t at = row_of(slice, min(n, length - 1)) * push.row_words + (x0 >> 5);
        uint word = ref_u32(push.bits + at * 4).v;
        uvec2 carry = load_carries(push.carries, at, WIDE);
        uint below = word & ~(0xffffffffu << shift);
        uint above = LANES == 32 ? 0 : word >> (shift + LANES - 1) >> 1;
        float left = below != 0 ? float(shift - uint(findMSB(below))) : way(carry.x) + float(shift);
        float right = above != 0 ? float(uint(findLSB(above)) + 1) : way(carry.y) + float(32 - shift - LANES);
        word >>= shift;
        float steps[LANES];
        [[unroll]] for (uint i = 0; i < LANES; i++) {
            left = (word >> i & 1u) != 0 ? 0 : left;
            steps[i] = left;
            left += 1;
        }
        [[unroll]] for (uint i = 0; i < LANES; i++) {
            uint k = LANES - 1 - i;
            right = (word >> k & 1u) != 0 ? 0 : right;
            steps[k] = min(steps[k], right);
            right += 1;
        }
        [[unroll]] for (uint i = 0; i < LANES; i++) {
            rows[n * STRIDE + i] = n < length ? steps[i] * steps[i] : COST_NONE;
        }
    }
}

// The nearest site of a segment's first row n: first the blocks' least rows alone, for a good bound, then every block that can beat
// it.
void find_boundary(uint segment, uint n, inout float best, out uint at) {
    at = n;
    if (best == 0) {
        return;
    }
    float edge = 0;  // of the blocks that are next: rows from n
    for (uint away = 0; away < SEGMENTS && could_win(edge * edge, best); away++) {
        [[unroll]] for (uint side = 0; side < 2; side++) {
            uint block = side == 0 ? segment + away : segment - 1 - away;
            if (block < SEGMENTS) {
                uint m = block_at[block * LANES + lane];
                float d = float(int(m) - int(n));
                float value = fma(d, d, least_of(block));
                if (wins(value, m, best, at)) {
                    best = value;
                    at = m;
                }
            }
        }
        edge += ROWS;
    }
    edge = 0;
    for (uint turn = 0; turn < 2 * SEGMENTS && could_win(edge * edge, best); turn++) {
        uint block = (turn & 1u) == 0 ? segment + (turn >> 1) : segment - 1 - (turn >> 1);
        float gap = (turn & 1u) == 0 ? edge : edge + 1;
        edge += (turn & 1u) == 0 ? 0 : ROWS;
        if (block < SEGMENTS && could_win(fma(gap, gap, least_of(block)), best)) {
            float d = float(int(block * ROWS) - int(n));
            float value[ROWS];
            float nearest = COST_NONE;
            [[unroll]] for (uint i = 0; i < ROWS; i++) {
                value[i] = fma(d + float(i), d + float(i), row_at(block * ROWS + i));
                nearest = min(nearest, value[i]);
            }
            if (could_win(nearest, best)) {
                uint m = 0;
                [[unroll]] for (uint i = 0; i < ROWS; i++) {
                    uint k = ROWS - 1 - i;
                    m = value[k] == nearest ? block * ROWS + k : m;
                }
                at = wins(nearest, m, best, at) ? m : at;
                best = nearest;
            }
        }
    }
}

void main() {
    lane = gl_LocalInvocationID.x;
    uint segment = gl_LocalInvocationID.y;
    uint slice, x;
    if (!tile_of(gl_WorkGroupID, gl_NumWorkGroups, LANES, x, slice)) {
        return;
    }
    uint length = column_rows();
    uint n0 = segment * ROWS;
    // The cost of each own row less i^2.
    float best[ROWS];
    if (SOURCE == FM_SOURCE_BITS) {
        load_from_bits(slice, x, length);
        barrier();
        [[unroll]] for (uint i = 0; i < ROWS; i++) {
            best[i] = row_at(n0 + i);
        }
    } else {
        // Loads hang on no condition, so that they can be under way together; what lies past the end is replaced.
        uint64_t first = row_of(slice, 0);
        uint64_t step = (row_of(slice, 1) - first) * push.pitch * 4;
        fm_address at = raw_at(first, min(x + lane, push.x_end - 1), 4);
        [[unroll]] for (uint i = 0; i < ROWS; i++) {
            best[i] = uintBitsToFloat(ref_u32(at + min(n0 + i, length - 1) * step).v);
        }
        [[unroll]] for (uint i = 0; i < ROWS; i++) {
            best[i] = n0 + i < length ? best[i] : COST_NONE;
            rows[(n0 + i) * STRIDE + lane] = best[i];
        }
    }
    x += lane;
    uint count = x < push.x_end && n0 < length ? min(ROWS, length - n0) : 0;
    float least = COST_NONE;
    uint least_at = n0;
    [[unroll]] for (uint i = 0; i < ROWS; i++) {
        if (best[i] < least) {
            least = best[i];
            least_at = n0 + i;
        }
    }
    block_least[segment * LANES + lane] = least;
    block_at[segment * LANES + lane] = least_at;
    barrier();

    float first_cost = best[0];
    uint low = n0;
    if (count > 0) {
        find_boundary(segment, n0, first_cost, low);
    }
    boundary[segment * LANES + lane] = low;
    barrier();
    if (count == 0) {
        return;
    }
    uint high = n0 + ROWS < length ? boundary[(segment + 1) * LANES + lane] : length - 1;

    uint at[ROWS];
    [[unroll]] for (uint i = 0; i < ROWS; i++) {
        best[i] -= float(i * i);
        at[i] = n0 + i;
    }
#define TRY(m, g)                                                                                                                  \
    {                                                                                                                              \
        float d = float(int(n0) - int(m));                                                                                         \
        float base = fma(d, d, g);                                                                                                 \
        [[unroll]] for (uint i = 0; i < ROWS; i++) {                                                                               \
            float value = fma(2 * d, float(i), base);                                                                              \
            if (SITES) {                                                                                                           \
                bool better = wins(value, m, best[i], at[i]);                                                                      \
                at[i] = better ? m : at[i];                                                                                        \
            }                                                                                                                      \
            best[i] = min(best[i], value);                                                                                         \
        }                                                                                                                          \
    }
    TRY(low, row_at(low))
    if (low != high) {
        TRY(high, row_at(high))
        float worst = best[0];
        [[unroll]] for (uint i = 1; i < ROWS; i++) {
            worst = max(worst, i < count ? best[i] + float(i * i) : 0);
        }
        // Whole blocks that cannot win are passed over; trying a single site costs less than asking whether it can.
        uint m = low + 1;
        while (m < high) {
            uint block_end = (m / ROWS + 1) * ROWS;
            float gap = float(max(0, max(int(n0) - int(block_end) + 1, int(m) - int(n0 + count - 1))));
            uint end = could_win(fma(gap, gap, least_of(m / ROWS)), worst) ? min(high, block_end) : m;
            for (; m < end; m++) {
                TRY(m, row_at(m))
            }
            m = block_end;
        }
    }

    uint64_t row = row_of(slice, n0);
    uint64_t row_step = row_of(slice, 1) - row_of(slice, 0);
    if (TARGET == FM_TARGET_RAW) {
        fm_address to = raw_at(row, x, 4);
        uint64_t step = row_step * push.pitch * 4;
        [[unroll]] for (uint i = 0; i < ROWS; i++) {
            if (i < count) {
                ref_u32(to + i * step).v = floatBitsToUint(best[i] + float(i * i));
                if (SITES) {
                    ref_u32(site_y_at(row + i * row_step, x)).v = at[i];
                }
            }
        }
        return;
    }
    // The whole column was read before the first barrier, so the results may take its place.
    [[unroll]] for (uint i = 0; i < ROWS; i++) {
        if (i < count) {
            float value = best[i] + float(i * i);
            if (SITES) {
                store_result(slice, n0 + i, x, value, at[i]);
            } else {
                finish_exact(voxel_at(slice, n0 + i, x), (row + i * row_step) * push.x + x, exact_raw(value));
            }
        }
    }
}
