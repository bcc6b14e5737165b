// SPDX-License-Identifier: MIT
#version 460
#include "memory.glsl"
#include "sites.glsl"

// One invocation owns WORDS words of one row; ROW_THREADS (a power of two) invocations share a row. A pass moves the element size
// plus 1/8 byte of bits and 1/8 byte of carries (1/4 when WIDE) a voxel.

layout(constant_id = 0) const uint TYPE = 0;
layout(constant_id = 1) const bool INVERT = false;
layout(constant_id = 2) const bool WIDE = false;
layout(constant_id = 3) const uint WORDS = 1;
layout(constant_id = 4) const uint ROW_THREADS = 16;
layout(constant_id = 5) const bool NOTHING = false;  // no value of the type is solid

const uint THREADS = 256;
layout(local_size_x = 256) in;

layout(push_constant) uniform push_block {
    fm_encode_push push;
};

shared uint first_site[THREADS];
shared uint last_site[THREADS];
shared uint occupied[THREADS / 32];

bool in_range(uint value) {
    return value - push.low <= push.span;
}

bool in_range_float(uint bits) {
    // low is the least value that counts as solid; a span of 1 asks for every number but 0. NaN fails both.
    float value = uintBitsToFloat(bits);
    return push.span == 1 ? abs(value) > 0 : value >= uintBitsToFloat(push.low);
}

// 0x80 in each byte that is not 0, gathered into four bits.
uint bytes_not_zero(uint v) {
    uint high = (((v & 0x7f7f7f7fu) + 0x7f7f7f7fu) | v) & 0x80808080u;
    return ((high >> 7) * 0x01020408u) >> 24 & 15u;
}

uint bytes_solid(uint v) {
    if (push.low == 1 && push.span >= 254) {
        return bytes_not_zero(v);
    }
    uint bits = 0;
    for (uint i = 0; i < 4; i++) {
        bits |= in_range(v >> (8 * i) & 0xffu) ? 1u << i : 0u;
    }
    return bits;
}

uint halves_solid(uint v) {
    return (in_range(v & 0xffffu) ? 1u : 0u) | (in_range(v >> 16) ? 2u : 0u);
}

// Up to 32 elements of 1 or 2 bytes from an address that need not be aligned: whole 32-bit words are loaded and shifted.
uint packed_word(fm_address from, uint count) {
    const uint per_word = TYPE == FM_GPU_U8 ? 4 : 2;
    uint bits = 0;
    if ((uint(from) & 15u) == 0 && count == 32) {
        [[unroll]] for (uint i = 0; i < 32 / (4 * per_word); i++) {
            uvec4 four = ref_u32x4(from + 16 * i).v;
            [[unroll]] for (uint k = 0; k < 4; k++) {
                uint solid = TYPE == FM_GPU_U8 ? bytes_solid(four[k]) : halves_solid(four[k]);
                bits |= solid << (per_word * (4 * i + k));
            }
        }
        return bits;
    }
    uint offset = uint(from) & 3u;
    fm_address word = from - offset;
    uint shift = 8 * offset;
    uint words = (count + per_word - 1) / per_word;
    uint next = ref_u32(word).v;
    for (uint i = 0; i < words; i++) {
        uint low = next;
        // The word behind is loaded only where it holds wanted bytes, so that no load leaves the buffer.
        bool more = shift != 0 && (4 / per_word) * count > 4 * i + 4 - offset;
        next = more || i + 1 < words ? ref_u32(word + 4 * (i + 1)).v : 0;
        uint v = shift == 0 ? low : low >> shift | next << (32 - shift);
        bits |= (TYPE == FM_GPU_U8 ? bytes_solid(v) : halves_solid(v)) << (per_word * i);
    }
    return bits;
}

uint load_word(uint64_t row, uint word) {
    uint x0 = word * 32;
    uint count = min(32u, push.x - x0);
    uint mask = 0xffffffffu >> (32 - count);
    uint bits = 0;
    if (TYPE == FM_GPU_BITS) {
        bits = ref_u32(push.solid + (row * push.row_words + word) * 4).v;
        // A label or threshold can ask for the zeros.
        bits = in_range(1) ? (in_range(0) ? ~0u : bits) : in_range(0) ? ~bits : 0;
    } else if (TYPE == FM_GPU_U8 || TYPE == FM_GPU_U16) {
        bits = packed_word(push.solid + (row * push.x + x0) * (TYPE == FM_GPU_U8 ? 1 : 2), count);
    } else {
        fm_address from = push.solid + (row * push.x + x0) * 4;
        for (uint i = 0; i < count; i++) {
            uint v = ref_u32(from + 4 * i).v;
            bits |= (TYPE == FM_GPU_F32 ? in_range_float(v) : in_range(v)) ? 1u << i : 0u;
        }
    }
    bits = NOTHING ? 0 : bits;
    return (INVERT ? ~bits : bits) & mask;
}

void main() {
    uint t = gl_LocalInvocationIndex;
    uint lane = t & (ROW_THREADS - 1);
    uint64_t row = folded_group(gl_WorkGroupID, gl_NumWorkGroups) * (THREADS / ROW_THREADS) + t / ROW_THREADS;
    bool inside = row < push.rows;
    uint begin = lane * WORDS;
    uint end = inside ? min(begin + WORDS, push.row_words) : 0;

    if (t < THREADS / 32) {
        occupied[t] = 0;
    }
    barrier();
    uint only = 0;
    uint first = FM_GPU_NONE;
    uint last = FM_GPU_NONE;
    for (uint w = begin; w < end; w++) {
        uint word = load_word(row, w);
        only = word;
        ref_u32(push.bits + (row * push.row_words + w) * 4).v = word;
        if (word != 0) {
            first = first == FM_GPU_NONE ? w * 32 + uint(findLSB(word)) : first;
            last = w * 32 + uint(findMSB(word));
        }
    }
    first_site[t] = first;
    last_site[t] = last;
    if (first != FM_GPU_NONE) {
        atomicOr(occupied[t >> 5], 1u << (t & 31u));
    }
    barrier();

    // The nearest invocations of the row, before and behind, that hold a site.
    uint row_begin = t - lane;
    uint row_end = row_begin + ROW_THREADS;
    uint previous = FM_GPU_NONE;
    for (int i = int(t >> 5); i >= int(row_begin >> 5); i--) {
        uint m = occupied[i] & (i == int(t >> 5) ? (1u << (t & 31u)) - 1u : 0xffffffffu);
        if (m != 0) {
            uint at = uint(i) * 32 + uint(findMSB(m));
            previous = at >= row_begin ? last_site[at] : FM_GPU_NONE;
            break;
        }
    }
    uint following = FM_GPU_NONE;
    for (uint i = t >> 5; i <= (row_end - 1) >> 5; i++) {
        uint m = occupied[i] & (i == t >> 5 ? ~((2u << (t & 31u)) - 1u) : 0xffffffffu);
        if (m != 0) {
            uint at = i * 32 + uint(findLSB(m));
            following = at < row_end ? first_site[at] : FM_GPU_NONE;
            break;
        }
    }

    if (WORDS == 1) {
        if (begin < end) {
            uint left = previous == FM_GPU_NONE ? FM_GPU_NONE : begin * 32 - previous;
            uint right = following == FM_GPU_NONE ? FM_GPU_NONE : following - (begin * 32 + 31);
            store_carries(push.carries, row * push.row_words + begin, uvec2(left, right), WIDE);
        }
        return;
    }
    // Rows too long for one word an invocation: the words are read again, forth for the left carries and back for the right ones.
    for (uint w = begin; w < end; w++) {
        uint64_t at = row * push.row_words + w;
        store_carries(push.carries, at, uvec2(previous == FM_GPU_NONE ? FM_GPU_NONE : w * 32 - previous, FM_GPU_NONE), WIDE);
        uint word = ref_u32(push.bits + at * 4).v;
        previous = word != 0 ? w * 32 + uint(findMSB(word)) : previous;
    }
    for (uint w = end; w-- > begin;) {
        uint64_t at = row * push.row_words + w;
        uint left = load_carries(push.carries, at, WIDE).x;
        store_carries(push.carries, at, uvec2(left, following == FM_GPU_NONE ? FM_GPU_NONE : following - (w * 32 + 31)), WIDE);
        uint word = ref_u32(push.bits + at * 4).v;
        following = word != 0 ? w * 32 + uint(findLSB(word)) : following;
    }
}
