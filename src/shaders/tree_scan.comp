// SPDX-License-Identifier: MIT
#version 460
#include "tree.glsl"

// From a digit's counts by run to how many lie in the runs before. A group owns a digit. Reads and writes 4 bytes a run.

shared uint group_total;

void main() {
    uint own = gl_LocalInvocationIndex;
    fm_address counts = push.counts + uint64_t(gl_WorkGroupID.x) * push.runs * 4;
    uint before = 0;
    for (uint first = 0; first < push.runs; first += FM_TREE_THREADS) {
        uint i = first + own;
        uint value = i < push.runs ? word_at(counts, i) : 0;
        uint sum = group_scan(value);
        if (i < push.runs) {
            set_word(counts, i, before + sum);
        }
        if (own == FM_TREE_THREADS - 1) {
            group_total = sum + value;
        }
        barrier();
        before += group_total;
        barrier();
    }
    if (own == 0) {
        set_word(push.counts, FM_SORT_DIGITS * push.runs + gl_WorkGroupID.x, before);
    }
}
