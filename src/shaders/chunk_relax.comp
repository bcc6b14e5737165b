// SPDX-License-Identifier: MIT
#version 460
#include "memory.glsl"
#include "chunk.glsl"
#include "lists.glsl"

// The fast iterative method by blocks: a group owns a block of EDGE^3 voxels, which it relaxes in shared memory, with one voxel of
// its neighbours on each face, until nothing changes in it; then it lists those neighbours for the next round that can be lowered
// by it. Rounds end by themselves: no entries, no groups. A block in the field reads and writes an entry a voxel, in scratch memory
// 2 bytes; the first round reads bits and reads no distances.
//
// A block that no round lists is settled: while it was settled a neighbour can only have been lowered by a group, which compared
// with what it knew of this block, which is never below what the block holds.

layout(constant_id = 5) const uint EDGE = 8;
layout(constant_id = 6) const uint START = FM_CHUNK_LISTED;
layout(constant_id = 7) const bool ALONE = false;        // a block is a whole domain
layout(constant_id = 8) const uint FLOOD = 0;            // ALONE: first step of jump flooding that comes before; 0: none
layout(constant_id = 9) const bool RELAX = true;
layout(constant_id = 10) const uint INITIAL = UNKNOWN;  // distance of air at first

const uint RIM = EDGE + 2;
const uint BLOCK = EDGE * EDGE * EDGE;
const uint OWNED = (BLOCK + THREADS - 1) / THREADS;  // voxels of an invocation, at most 32
const uint AT_Y = RIM;
const uint AT_Z = RIM * RIM;

shared uint values[RIM * RIM * RIM];
shared uint lowered[3];  // whether something changed in an iteration; used in turn
shared uint reached;     // a bit a face whose neighbour is to be listed, and one for the block itself

struct block {
    domain_box box;
    ivec3 origin;                    // within the domain
    ivec3 within_begin, within_end;  // where distances are known: the domain, or the world as seen from it
    uint index;                      // of the domain
    uint id;
};

ivec3 world_blocks() {
    return (world_size() + int(EDGE) - 1) / int(EDGE);
}

ivec3 domain_blocks(domain_box box) {
    return (box.size + int(EDGE) - 1) / int(EDGE);
}

// Blocks are told apart by their place in the world, or in scratch memory by domain and place there.
uint id_of(block b, ivec3 origin) {
    if (SCRATCH) {
        ivec3 at = origin / int(EDGE);
        return b.index * push.groups + (uint(at.z) * push.groups_y + uint(at.y)) * push.groups_x + uint(at.x);
    }
    ivec3 at = (b.box.begin + origin) / int(EDGE);
    ivec3 blocks = world_blocks();
    return (uint(at.z) * uint(blocks.y) + uint(at.y)) * uint(blocks.x) + uint(at.x);
}

void set_bounds(inout block b) {
    bool world = LINKED && START != FM_CHUNK_INIT;
    b.within_begin = world ? -b.box.begin : ivec3(0);
    b.within_end = world ? world_size() - b.box.begin : b.box.size;
}

// The block that an entry of the list stands for.
block listed_block(uint id) {
    block b;
    b.id = id;
    if (SCRATCH) {
        b.index = id / push.groups;
        b.box = load_domain(b.index);
        b.origin = tile_of(id % push.groups) * int(EDGE);
    } else {
        ivec3 blocks = world_blocks();
        uint row = id / uint(blocks.x);
        ivec3 at = ivec3(id % uint(blocks.x), row % uint(blocks.y), row / uint(blocks.y)) * int(EDGE);
        int chunk = int(push.chunk);
        b.box.begin = chunk > 0 ? at / chunk * chunk : ivec3(0);
        b.box.size = chunk > 0 ? min(ivec3(chunk), world_size() - b.box.begin) : world_size();
        b.origin = at - b.box.begin;
    }
    set_bounds(b);
    return b;
}

bool is_known(block b, ivec3 at) {
    return all(greaterThanEqual(at, b.within_begin)) && all(lessThan(at, b.within_end));
}

uint first_value(block b, ivec3 at) {
    if (!is_known(b, at)) {
        return PADDED ? 0 : UNKNOWN;
    }
    if (START == FM_CHUNK_INIT) {
        return is_solid(b.box.begin + at) ? 0 : INITIAL;
    }
    return SCRATCH ? load_scratch(b.box, push.which, at) : load_field(b.box.begin + at);
}

uint place_of(uvec3 at) {
    return at.z * AT_Z + at.y * AT_Y + at.x;
}

// The k-th voxel of this invocation, within the block.
uvec3 owned(uint k) {
    uint i = k * THREADS + gl_LocalInvocationID.x;
    return uvec3(i % EDGE, i / EDGE % EDGE, i / (EDGE * EDGE));
}

bool owns(uint k) {
    return BLOCK % THREADS == 0 || k * THREADS + gl_LocalInvocationID.x < BLOCK;
}

void load_block(block b) {
    for (uint i = gl_LocalInvocationID.x; i < RIM * RIM * RIM; i += THREADS) {
        ivec3 at = ivec3(i % RIM, i / RIM % RIM, i / (RIM * RIM)) - 1;
        ivec3 off = ivec3(lessThan(at, ivec3(0))) + ivec3(greaterThanEqual(at, ivec3(EDGE)));
        if (off.x + off.y + off.z < 2) {
            values[i] = first_value(b, b.origin + at);
        }
    }
    if (gl_LocalInvocationID.x == 0) {
        lowered[0] = 0;
        reached = 0;
    }
    barrier();
}

uint flood_value(block b, ivec3 at, uint place, int way) {
    return in_box(at, b.box.size) ? values[int(place) + way] : PADDED ? 0 : UNKNOWN;
}

// Jump flooding, where the block holds all of the domain.
void flood_block(block b) {
    for (uint step = FLOOD; step > 0; step /= 2) {
        uint next[OWNED];
        for (uint k = 0; k < OWNED; k++) {
            next[k] = UNKNOWN;
            uvec3 at = owned(k);
            if (!owns(k) || !in_box(ivec3(at), b.box.size)) {
                continue;
            }
            uint place = place_of(at + 1);
            uint least = UNKNOWN;
            [[unroll]] for (int axis = 0; axis < 3; axis++) {
                ivec3 way = ivec3(axis == 0, axis == 1, axis == 2) * int(step);
                int along = int(axis == 0 ? 1 : axis == 1 ? AT_Y : AT_Z) * int(step);
                least = min(least, flood_value(b, ivec3(at) - way, place, -along));
                least = min(least, flood_value(b, ivec3(at) + way, place, along));
            }
            next[k] = min(values[place], least + step);
        }
        barrier();
        for (uint k = 0; k < OWNED; k++) {
            if (owns(k) && in_box(ivec3(owned(k)), b.box.size)) {
                values[place_of(owned(k) + 1)] = next[k];
            }
        }
        barrier();
    }
}

// Relaxes until nothing changes; which of this invocation's voxels fell.
uint relax_block() {
    uint fell = 0;
    // No shortest way within the block has more steps than 3 * EDGE, the one into it included.
    for (uint i = 0; i < 3 * EDGE + 1; i++) {
        bool any = false;
        for (uint k = 0; k < OWNED; k++) {
            if (owns(k)) {
                uint at = place_of(owned(k) + 1);
                uint along_x = min(values[at - 1], values[at + 1]);
                uint along_y = min(values[at - AT_Y], values[at + AT_Y]);
                uint along_z = min(values[at - AT_Z], values[at + AT_Z]);
                uint value = min(along_x, min(along_y, along_z)) + 1;
                if (value < values[at]) {
                    values[at] = value;
                    fell |= 1u << k;
                    any = true;
                }
            }
        }
        if (any) {
            lowered[i % 3] = 1;
        }
        if (gl_LocalInvocationID.x == 0) {
            lowered[(i + 1) % 3] = 0;
        }
        barrier();
        if (lowered[i % 3] == 0) {
            break;
        }
    }
    return fell;
}

void store_block(block b, uint fell) {
    for (uint k = 0; k < OWNED; k++) {
        ivec3 at = b.origin + ivec3(owned(k));
        if (!owns(k) || !is_known(b, at)) {
            continue;
        }
        uint value = values[place_of(owned(k) + 1)];
        bool fresh = START == FM_CHUNK_INIT && (SCRATCH || value > 0);
        if (fresh || (fell >> k & 1u) != 0) {
            if (SCRATCH) {
                store_scratch(b.box, push.which, at, value);
            } else {
                store_field(b.box.begin + at, value);
            }
        }
    }
}

const ivec3 faces[6] =
    ivec3[](ivec3(-1, 0, 0), ivec3(1, 0, 0), ivec3(0, -1, 0), ivec3(0, 1, 0), ivec3(0, 0, -1), ivec3(0, 0, 1));

// Where a neighbour may be listed: in the domain, or in the world.
bool is_open(block b, ivec3 at) {
    return in_box(at, b.box.size) || (LINKED && in_box(b.box.begin + at, world_size()));
}

void find_reached(block b) {
    uint found = 0;
    for (uint k = 0; k < OWNED; k++) {
        ivec3 within = ivec3(owned(k));
        if (!owns(k) || !is_open(b, b.origin + within)) {
            continue;
        }
        uint value = values[place_of(uvec3(within) + 1)];
        [[unroll]] for (uint face = 0; face < 6; face++) {
            ivec3 at = within + faces[face];
            if (!in_box(at, ivec3(EDGE)) && is_open(b, b.origin + at)) {
                bool lowers = value + 1 < min(values[place_of(uvec3(at + 1))], push.cap);
                // What lies beyond the domain is right, but was not looked at.
                bool linked = LINKED && START == FM_CHUNK_INIT && !in_box(b.origin + at, b.box.size);
                found |= (lowers ? 1u << face : 0) | (linked ? 1u << 6 : 0);
            }
        }
    }
    if (found != 0) {
        atomicOr(reached, found);
    }
    barrier();
}

void list_reached(block b) {
    uint lane = gl_LocalInvocationID.x;
    if (lane < 7 && (reached >> lane & 1u) != 0) {
        uint id = lane == 6 ? b.id : id_of(b, b.origin + faces[min(lane, 5)] * int(EDGE));
        if (atomicExchange(ref_u32(push.stamps + uint64_t(id) * 4).v, push.stamp) != push.stamp) {
            list_append(push.next_list, push.next_entries, id);
        }
    }
}

void do_block(block b) {
    load_block(b);
    if (FLOOD > 0) {
        flood_block(b);
    }
    uint fell = 0;
    if (RELAX) {
        fell = relax_block();
    }
    store_block(b, fell);
    if (!ALONE) {
        find_reached(b);
        list_reached(b);
    }
}

void main() {
    if (START != FM_CHUNK_LISTED) {
        block b;
        uint group;
        if (!own_domain(b.box, b.index, group)) {
            return;
        }
        b.origin = tile_of(group) * int(EDGE);
        if (any(greaterThanEqual(b.origin, b.box.size))) {
            return;
        }
        b.id = id_of(b, b.origin);
        set_bounds(b);
        do_block(b);
        return;
    }
    uint count = list_count(push.list);
    if (gl_WorkGroupID.x == 0 && gl_LocalInvocationID.x == 0) {
        ref_u32(push.counted).v = max(ref_u32(push.counted).v, push.first);
    }
    for (uint i = gl_WorkGroupID.x; i < count; i += gl_NumWorkGroups.x) {
        do_block(listed_block(ref_u32(push.entries + uint64_t(i) * 4).v));
        barrier();
    }
}
