// SPDX-License-Identifier: MIT
// How the places of sorted keys climb to the root. The parent of a range of places is the node at that end of it across which the
// keys differ less; the node between places i and i + 1 has number i + 1, and that of all places lies at number 0 too. Of a node's
// two children the one that comes first stops, the second has seen both and goes on. Source: Apetrei 2014, "Fast and simple
// agglomerative LBVH construction". Expects tree.glsl.

// What another group wrote is read through these.
layout(buffer_reference, std430, buffer_reference_align = 8) coherent buffer shared_f32x2 {
    vec2 v;
};
layout(buffer_reference, std430, buffer_reference_align = 16) coherent buffer shared_f32x4 {
    vec4 v;
};
layout(buffer_reference, std430, buffer_reference_align = 4) coherent buffer shared_u32 {
    uint v;
};

// Whether the two sides of a meeting need a fence around it, as memory models have it. Mesa's llvmpipe takes a fence for a barrier
// that all of a group reach, and loses invocations where some do not; its atomics order all memory by themselves.
layout(constant_id = 0) const bool FENCED = true;

struct climber {
    uint first, last;  // the range
    uint node;         // its parent
    uint side;         // which child of the parent it is
};

// How much the keys at places i and i + 1 differ: those of places break ties.
uint64_t difference(uint i) {
    return uint64_t(word_at(push.keys, i) ^ word_at(push.keys, i + 1)) << 32 | (i ^ (i + 1));
}

// Of a range that is not all.
void find_parent(inout climber c) {
    bool left = c.first == 0 || (c.last != push.mesh.triangle_count - 1 && difference(c.last) < difference(c.first - 1));
    c.node = left ? c.last + 1 : c.first;
    c.side = left ? 0 : 1;
}

void fence() {
    if (FENCED) {
        memoryBarrierBuffer();
    }
}

// False for the child that comes first. The other one's range grows to its parent's, and what the first has written can be read.
bool meet(inout climber c) {
    fence();
    uint met = atomicExchange(ref_u32(push.meetings + uint64_t(c.node) * 4).v, c.side == 0 ? c.first : c.last);
    fence();
    bool second = met != FM_GPU_NONE;
    c.first = second && c.side == 1 ? met : c.first;
    c.last = second && c.side == 0 ? met : c.last;
    return second;
}

bool is_all(climber c) {
    return c.first == 0 && c.last == push.mesh.triangle_count - 1;
}
