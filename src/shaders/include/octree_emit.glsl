// SPDX-License-Identifier: MIT
// What ends in the octree's arrays: words of nodes, values of leaves, and what is counted of them. Expects octree_build.glsl.

#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_ballot : require

layout(constant_id = 0) const uint CODE = FM_GPU_SPHERICAL;

// All invocations of a subgroup that are active come here together.
void emit_count(uint what, bool own) {
    uint count = subgroupBallotBitCount(subgroupBallot(own));
    if (subgroupElect() && count > 0) {
        atomicAdd(ref_u32(PLAN.totals + what * 4).v, count);
    }
}

// As fm_octree_bound_word.
uint empty_word(float bound) {
    float cells = max(bound * (1 - 2e-6) - PLAN.slack, 0.0);
    if (PLAN.share != 0 && cells > 0) {
        // The next lower power of 2, or of its root: those of two functions may be too great.
        float power = uintBitsToFloat(floatBitsToUint(cells) & 0x7f800000u);
        cells = cells >= power * 1.4142135 ? power * 1.4142134 : power;
    }
    float part = min(cells * PLAN.cell / PLAN.cutoff, 1.0);
    return FM_NODE_EMPTY + min(uint(part * float(FM_NODE_EMPTY - 1)), FM_NODE_EMPTY - 1);
}

void emit_word(uint place, uint word) {
    ref_u32(PLAN.words + uint64_t(place) * 4).v = word;
}

void count_error(uint64_t value, vec3 stored, vec3 exact, float edge) {
    if ((fm_scramble(uint(value)) & (PLAN.sampled - 1)) == 0) {
        uint bin = min(uint(min(distance(stored, exact) / (edge * FM_BUILD_ERROR_STEP), 1e6)), FM_BUILD_BINS - 1);
        atomicAdd(ref_u32(PLAN.totals + (FM_BUILD_ERRORS + bin) * 4).v, 1u);
    }
}

// Value k of a column: the corner's vector.
void emit_value(uint level, uint column, uint k, build_corner corner) {
    uint64_t value = uint64_t(column) * FM_COLUMN_VALUES + k;
    float edge = float(1u << level);
    if (CODE == FM_GPU_FLOATS) {
        vec3 world = corner.way * PLAN.cell;
        for (uint i = 0; i < 3; i++) {
            ref_u32(PLAN.values + (3 * value + i) * 4).v = floatBitsToUint(world[i]);
        }
    } else {
        uint word = fm_vcp_encode(corner.way, int(CODE), FM_OCTREE_REACH * edge);
        ref_u32(PLAN.values + value * 4).v = word;
        count_error(value, fm_vcp_decode(word, int(CODE), FM_OCTREE_REACH * edge), corner.way, edge);
    }
    if (PLAN.attributes != 0) {
        ref_u32(PLAN.attributes + value * 4).v = corner.triangle;
    }
}

// The corner that value k of a leaf's column stands for: x of the column, then y, then z.
uint value_corner(uint upper, uint k) {
    return upper + 2 * k;
}
