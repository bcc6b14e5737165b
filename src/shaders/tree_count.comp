// SPDX-License-Identifier: MIT
#version 460
#include "tree.glsl"

// How often each digit occurs among a run's keys. A group owns a run. Reads 4 bytes a key, writes 1 KiB a run.

shared uint counts[FM_SORT_DIGITS];

void main() {
    uint own = gl_LocalInvocationIndex;
    counts[own] = 0;
    barrier();
    uint64_t first = uint64_t(gl_WorkGroupID.x) * push.run_tiles * FM_SORT_TILE;
    uint64_t end = min(first + uint64_t(push.run_tiles) * FM_SORT_TILE, uint64_t(push.mesh.triangle_count));
    for (uint64_t i = first + own; i < end; i += FM_TREE_THREADS) {
        atomicAdd(counts[word_at(push.keys, uint(i)) >> push.shift & 0xffu], 1u);
    }
    barrier();
    set_word(push.counts, own * push.runs + gl_WorkGroupID.x, counts[own]);
}
