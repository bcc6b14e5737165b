// SPDX-License-Identifier: MIT
#ifndef FM_PLAN_H
#define FM_PLAN_H

// A transform after validation: what every backend works from. See docs/architecture.md for the passes.
//
// All backends compute a raw distance a voxel, then finish it:
//   exact:    raw is a uint32: L1 or Linf steps, or the squared L2 distance; FM_RAW_NONE where there is no site.
//   weighted: raw is a float: sums of weight[axis] * |d| (L1, Linf) or weight[axis] * d * d (L2), each operation rounded to float,
//             added in the order x, y, z; +infinity where there is no site.
// The index is the lowest among sites of equal raw distance. For L1 and L2 that is what passes in the order x, y, z find when each
// keeps the lowest of its equals (weighted: by the partial sums, so that within a slice or a row the smaller partial sum comes
// first). For Linf the last pass gives the slice only: see linf_index.c. Finishing, in this order: the way out of the grid where
// `border` is set, the root of L2 unless squared, the cap, the scale, the conversion to the distance type, the sign. Exact F32
// results are (float)root * (float)scale.

#include "volume/volume.h"

#define FM_RAW_NONE UINT32_MAX

// For functions whose arguments choose a variant: a copy each, with the choice made.
#define FM_INLINE inline __attribute__((always_inline))

typedef struct fm_plan {
    fm_shape shape;
    fm_metric metric;
    bool brute_force;
    bool weighted;
    float weight[3];  // weighted only: spacing, or its square for L2
    bool is_signed;
    bool squared;
    bool border;  // for unsigned fields and the outer side of signed ones: what lies outside counts as a site
                  // (the inner side of a signed field has the opposite rule)
    fm_select select;
    double threshold;
    int64_t label;

    bool want_distance;
    fm_type distance_type;
    bool want_index;
    fm_type index_type;

    uint32_t greatest;  // exact only: the greatest raw distance that the shape allows; below FM_RAW_NONE
    // A raw distance above this is capped; FM_RAW_NONE (exact) or +infinity (weighted) for no limit.
    uint32_t cap_raw;
    float cap_raw_weighted;
    double cap;    // the limit itself in the units of the result; +infinity for none
    double scale;  // exact F32 results: isotropic spacing (its square when squared); else 1
    // The result where there is no site or the raw distance is above cap_raw: the cap; without one the largest value of the type,
    // +infinity for F32.
    double value_none;
} fm_plan;

// The limits of an integer type; bits are 0 and 1.
int64_t fm_type_least(fm_type type);
uint64_t fm_type_greatest(fm_type type);

// The values that are solid, as a range of the element's own type: `least` to `most`, both included, of that member which the type
// belongs to. `outside`: all but these and NaN (FM_SELECT_NONZERO of signed and floating point types; both ends are 0 then).
typedef struct fm_value_range {
    bool nothing;  // no value of the type is solid; the ends mean nothing
    bool outside;
    union fm_value {
        uint64_t u;  // U8, U16, U32, U64, BITS
        int64_t i;   // I8, I16, I32, I64
        double f;    // F32 (exact in that type), F64
    } least, most;
} fm_value_range;

fm_value_range fm_plan_selected(const fm_plan *plan, fm_type solid);

// Checks a descriptor against a shape and types and derives the plan. `distance` or `index` NULL: not wanted.
fm_result fm_plan_make(const fm_transform_desc *desc, fm_shape shape, fm_type solid, const fm_type *distance, const fm_type *index,
                       fm_plan *plan);

// Sites as bits in host memory: FM_TYPE_BITS layout, bits past the row end zero.
typedef struct fm_sites {
    fm_shape shape;
    const uint32_t *words;
} fm_sites;

static inline uint64_t fm_sites_bytes(fm_shape shape) {
    return (uint64_t)fm_bits_row_words(shape) * shape.y * shape.z * sizeof(uint32_t);
}

// Host backend: fills `distance` and `index` (either may be NULL) from the sites, with `scratch` of fm_cpu_scratch_bytes bytes.
// Cannot fail: whatever it needs is in the scratch.
fm_result fm_cpu_scratch_bytes(const fm_context *context, const fm_plan *plan, uint64_t *bytes);
void fm_cpu_transform(fm_context *context, const fm_plan *plan, const fm_sites *sites, void *scratch, void *distance, void *index);

// The oracle: every site against every voxel. Needs no scratch.
void fm_brute_transform(fm_context *context, const fm_plan *plan, const fm_sites *sites, void *distance, void *index);

// Bits of the sites of an array of any type, bits past the row end zero. Errors: FM_ERROR_INVALID_ARGUMENT for NaN, unless
// `nan_is_empty`.
fm_result fm_sites_encode(fm_context *context, const fm_plan *plan, fm_type type, const void *solid, bool nan_is_empty,
                          uint32_t *words);

// Vulkan backend: volumes in device memory; `solid` of type U8, U16, U32, F32 or BITS. Asynchronous, complete at `ticket`.
fm_result fm_gpu_transform(fm_context *context, const fm_plan *plan, const fm_volume *solid, fm_volume *distance, fm_volume *index,
                           fm_ticket *ticket);

#endif
