// SPDX-License-Identifier: MIT
#version 460
#include "tree.glsl"

// A stable pass of the radix sort. A group owns a run and takes its tiles in order; an invocation owns 4 consecutive keys of a
// tile. The tile is sorted by the digit in shared memory, half a digit at a time, and goes out in pieces of equal digits. Reads and
// writes 8 bytes a key.

const uint OWNED = FM_SORT_TILE / FM_TREE_THREADS;
const uint HALF_DIGITS = 16;

shared uint keys[FM_SORT_TILE];
shared uint numbers[FM_SORT_TILE];
// Counts of two half digits, d and d + 8, in 16 bits each: d is the row, the invocation the column.
shared uint pairs[HALF_DIGITS / 2 * FM_TREE_THREADS];
shared uint pairs_total;
shared uint offsets[FM_SORT_DIGITS];  // where the next key of a digit goes
shared uint starts[FM_SORT_DIGITS];   // of the digit in the tile

uint digit_of(uint key) {
    return key >> push.shift & 0xffu;
}

// From counts to how many come before. The second half of the half digits follow all of the first.
void scan_pairs() {
    const uint entries = HALF_DIGITS / 2;
    uint own = gl_LocalInvocationIndex;
    uint sum = 0;
    for (uint i = 0; i < entries; i++) {
        sum += pairs[own * entries + i];
    }
    uint before = group_scan(sum);
    if (own == FM_TREE_THREADS - 1) {
        pairs_total = before + sum;
    }
    barrier();
    before += pairs_total << 16;
    for (uint i = 0; i < entries; i++) {
        uint value = pairs[own * entries + i];
        pairs[own * entries + i] = before;
        before += value;
    }
    barrier();
}

void sort_by_half(uint shift) {
    uint own = gl_LocalInvocationIndex;
    uint key[OWNED];
    uint number[OWNED];
    uint before[OWNED];
    uint64_t counts = 0;  // four bits a half digit
    [[unroll]] for (uint i = 0; i < OWNED; i++) {
        key[i] = keys[own * OWNED + i];
        number[i] = numbers[own * OWNED + i];
        uint at = (key[i] >> shift & 15u) * 4;
        before[i] = uint(counts >> at) & 15u;
        counts += uint64_t(1) << at;
    }
    for (uint i = 0; i < HALF_DIGITS / 2; i++) {
        pairs[i * FM_TREE_THREADS + own] = (uint(counts >> (i * 4)) & 15u) | (uint(counts >> (i * 4 + 32)) & 15u) << 16;
    }
    barrier();
    scan_pairs();
    [[unroll]] for (uint i = 0; i < OWNED; i++) {
        uint half_digit = key[i] >> shift & 15u;
        uint pair = pairs[(half_digit & 7u) * FM_TREE_THREADS + own];
        uint place = (half_digit < 8 ? pair & 0xffffu : pair >> 16) + before[i];
        keys[place] = key[i];
        numbers[place] = number[i];
    }
    barrier();
}

void load_tile(uint64_t first, uint count) {
    for (uint i = gl_LocalInvocationIndex; i < FM_SORT_TILE; i += FM_TREE_THREADS) {
        keys[i] = i < count ? word_at(push.keys, uint(first) + i) : FM_GPU_NONE;
        numbers[i] = i < count ? word_at(push.numbers, uint(first) + i) : FM_GPU_NONE;
    }
    barrier();
}

void store_tile(uint count) {
    for (uint i = gl_LocalInvocationIndex; i < count; i += FM_TREE_THREADS) {
        uint digit = digit_of(keys[i]);
        if (i == 0 || digit_of(keys[i - 1]) != digit) {
            starts[digit] = i;
        }
    }
    barrier();
    for (uint i = gl_LocalInvocationIndex; i < count; i += FM_TREE_THREADS) {
        uint digit = digit_of(keys[i]);
        uint to = offsets[digit] + i - starts[digit];
        set_word(push.keys_to, to, keys[i]);
        set_word(push.numbers_to, to, numbers[i]);
    }
    barrier();
    for (uint i = gl_LocalInvocationIndex; i < count; i += FM_TREE_THREADS) {
        uint digit = digit_of(keys[i]);
        if (i + 1 == count || digit_of(keys[i + 1]) != digit) {
            offsets[digit] += i + 1 - starts[digit];
        }
    }
    barrier();
}

void main() {
    uint own = gl_LocalInvocationIndex;
    uint run = gl_WorkGroupID.x;
    offsets[own] = group_scan(word_at(push.counts, FM_SORT_DIGITS * push.runs + own)) +
                   word_at(push.counts, own * push.runs + run);
    barrier();
    for (uint tile = 0; tile < push.run_tiles; tile++) {
        uint64_t first = (uint64_t(run) * push.run_tiles + tile) * FM_SORT_TILE;
        if (first >= push.mesh.triangle_count) {
            return;
        }
        uint count = uint(min(uint64_t(push.mesh.triangle_count) - first, uint64_t(FM_SORT_TILE)));
        load_tile(first, count);
        sort_by_half(push.shift);
        sort_by_half(push.shift + 4);
        store_tile(count);
    }
}
