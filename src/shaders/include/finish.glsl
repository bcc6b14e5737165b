// SPDX-License-Identifier: MIT
// From raw distances to the caller's: the way out of the grid, the root, the cap, the scale, the type and the sign.
// Expects `push` (fm_column_push) and the constants METRIC, SQUARED, BORDER, BIG, WEIGHTED, OUT_TYPE, INDEX_TYPE, TARGET.

uint out_size() {
    return OUT_TYPE == FM_GPU_U8 || OUT_TYPE == FM_GPU_I8 ? 1 : OUT_TYPE == FM_GPU_U16 || OUT_TYPE == FM_GPU_I16 ? 2 : 4;
}

uint out_max() {
    switch (OUT_TYPE) {
    case FM_GPU_U8:
        return 0xffu;
    case FM_GPU_I8:
        return 0x7fu;
    case FM_GPU_U16:
        return 0xffffu;
    case FM_GPU_I16:
        return 0x7fffu;
    case FM_GPU_I32:
        return 0x7fffffffu;
    default:
        return 0xffffffffu;
    }
}

// The root of a 32-bit integer, rounded down.
uint root_floor(uint raw) {
    uint root = min(uint(sqrt(float(raw))), 65535u);
    root -= root * root > raw ? 1 : 0;
    return root < 65535u && (root + 1) * (root + 1) <= raw ? root + 1 : root;
}

// The root of a whole number below 2^24, correctly rounded, from a sqrt that is a few units in the last place off. A Newton step
// brings it within one unit; x - r^2 is then exact in one fused operation, and r is right unless that exceeds r units in the last
// place.
float root_small(uint raw) {
    float x = float(raw);
    float r = sqrt(x);
    r = raw == 0 ? 1.0 : r;
    precise float newton = fma(fma(-r, r, x), 0.5 / r, r);
    float unit = uintBitsToFloat((floatBitsToUint(newton) & 0x7f800000u) - (23u << 23));
    precise float rest = fma(-newton, newton, x);
    precise float limit = newton * unit;
    newton += rest > limit ? unit : rest <= -limit ? -unit : 0.0;
    return raw == 0 ? 0.0 : newton;
}

// The same for any 32-bit number, in 64-bit arithmetic: the mantissa m is the one for which (2m - 1)^2 < raw * 4 * 2^(2 * shift) <
// (2m + 1)^2.
float root_large(uint raw) {
    if (raw == 0) {
        return 0;
    }
    uint guess = floatBitsToUint(sqrt(float(raw)));
    uint shift = 150u - (guess >> 23);
    uint64_t mantissa = (guess & 0x7fffffu) | 0x800000u;
    uint64_t square = uint64_t(raw) << (2u * shift + 2u);
    uint64_t above = 2 * mantissa + 1;
    uint64_t below = 2 * mantissa - 1;
    guess += above * above < square ? 1u : below * below > square ? uint(-1) : 0u;
    return uintBitsToFloat(guess);
}

float root_exact(uint raw) {
    return BIG ? root_large(raw) : root_small(raw);
}

// `element` is the voxel's index in the volume.
void store_bits(uint64_t element, uint value) {
    fm_address to = push.distance + element * out_size();
    if (out_size() == 1) {
        ref_u8(to).v = uint8_t(value);
    } else if (out_size() == 2) {
        ref_u16(to).v = uint16_t(value);
    } else {
        ref_u32(to).v = value;
    }
}

bool out_is_float() {
    return OUT_TYPE == FM_GPU_F32;
}

uint signed_bits(uint bits) {
    if (TARGET != FM_TARGET_NEGATE) {
        return bits;
    }
    return out_is_float() ? bits ^ 0x80000000u : uint(-int(bits));
}

// Steps out of the grid along each axis.
uvec3 ways_out(uvec3 at) {
    return min(at + 1u, uvec3(push.x, push.y, push.z) - at);
}

// The raw distance to what lies outside the grid.
uint raw_out(uvec3 at) {
    uvec3 ways = ways_out(at);
    uint way = min(ways.x, min(ways.y, ways.z));
    return METRIC == FM_GPU_L2 ? min(way, 65535u) * min(way, 65535u) : way;
}

void finish_exact(uvec3 at, uint64_t element, uint raw) {
    if (BORDER) {
        raw = min(raw, raw_out(at));
    }
    if (TARGET == FM_TARGET_NEGATE && raw == 0) {
        return;
    }
    uint bits;
    if (raw == FM_GPU_NONE || raw > push.cap_raw) {
        bits = push.none_bits;
    } else if (out_is_float()) {
        precise float value = (METRIC == FM_GPU_L2 && !SQUARED ? root_exact(raw) : float(raw)) * push.scale;
        bits = floatBitsToUint(value);
    } else {
        bits = min(METRIC == FM_GPU_L2 && !SQUARED ? root_floor(raw) : raw, out_max());
    }
    store_bits(element, signed_bits(bits));
}

float root_weighted(float raw) {
    // One Newton step in fused arithmetic takes the error of the device's sqrt to half a unit in the last place.
    float root = sqrt(raw);
    return raw > 0 ? fma(fma(-root, root, raw), 0.5 / root, root) : root;
}

void finish_weighted(uvec3 at, uint64_t element, float raw) {
    if (BORDER) {
        vec3 way = vec3(ways_out(at));
        precise vec3 weighted = vec3(push.weight_x, push.weight_y, push.weight_z) * way;
        if (METRIC == FM_GPU_L2) {
            weighted = weighted * way;
        }
        raw = min(raw, min(weighted.x, min(weighted.y, weighted.z)));
    }
    if (TARGET == FM_TARGET_NEGATE && raw == 0) {
        return;
    }
    uint bits;
    if (floatBitsToUint(raw) >= 0x7f800000u || raw > uintBitsToFloat(push.cap_raw)) {
        bits = push.none_bits;
    } else {
        bits = floatBitsToUint(METRIC == FM_GPU_L2 && !SQUARED ? root_weighted(raw) : raw);
    }
    store_bits(element, signed_bits(bits));
}

void store_index(uint64_t voxel, bool none, uvec3 site) {
    uint64_t index = (uint64_t(site.z) * push.y + site.y) * push.x + site.x;
    if (INDEX_TYPE == FM_GPU_U64) {
        ref_u64(push.index + voxel * 8).v = none ? ~uint64_t(0) : index;
    } else {
        ref_u32(push.index + voxel * 4).v = none ? FM_GPU_NONE : uint(index);
    }
}
