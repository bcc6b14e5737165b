// SPDX-License-Identifier: MIT
#ifndef FM_FINISH_H
#define FM_FINISH_H

// From raw distances to the caller's values, one voxel at a time: what every kernel's finish must agree with.

#include "transform/plan.h"

#include <math.h>

// Steps out of the grid from a voxel, along the axis that is nearest to its end.
static inline uint32_t fm_steps_out(uint32_t at, uint32_t size) {
    return at + 1 < size - at ? at + 1 : size - at;
}

static inline uint32_t fm_raw_step(fm_metric metric, uint32_t steps) {
    return metric == FM_METRIC_L2 ? steps * steps : steps;
}

static inline float fm_weighted_step(fm_metric metric, float weight, uint32_t steps) {
    float along = weight * (float)steps;
    return metric == FM_METRIC_L2 ? along * (float)steps : along;
}

static inline uint32_t fm_way_out(const fm_plan *plan, uint32_t x, uint32_t y, uint32_t z) {
    uint32_t steps = fm_steps_out(x, plan->shape.x);
    uint32_t along_y = fm_steps_out(y, plan->shape.y);
    uint32_t along_z = fm_steps_out(z, plan->shape.z);
    steps = along_y < steps ? along_y : steps;
    steps = along_z < steps ? along_z : steps;
    return fm_raw_step(plan->metric, steps);
}

static inline float fm_way_out_weighted(const fm_plan *plan, uint32_t x, uint32_t y, uint32_t z) {
    float way = fm_weighted_step(plan->metric, plan->weight[0], fm_steps_out(x, plan->shape.x));
    way = fminf(way, fm_weighted_step(plan->metric, plan->weight[1], fm_steps_out(y, plan->shape.y)));
    return fminf(way, fm_weighted_step(plan->metric, plan->weight[2], fm_steps_out(z, plan->shape.z)));
}

static inline uint32_t fm_floor_root(uint32_t square) {
    return (uint32_t)sqrt((double)square);
}

// F32 results below the cap.
static inline float fm_scaled_exact(const fm_plan *plan, uint32_t raw) {
    const bool root = plan->metric == FM_METRIC_L2 && !plan->squared;
    return (root ? (float)sqrt((double)raw) : (float)raw) * (float)plan->scale;
}

static inline float fm_scaled_weighted(const fm_plan *plan, float raw) {
    return plan->metric == FM_METRIC_L2 && !plan->squared ? sqrtf(raw) : raw;
}

// The unsigned value of an exact raw distance, `plan->border` being dealt with.
static inline double fm_finish_exact(const fm_plan *plan, uint32_t raw) {
    if (raw == FM_RAW_NONE || raw > plan->cap_raw) {
        return plan->value_none;
    }
    if (plan->distance_type == FM_TYPE_F32) {
        return (double)fm_scaled_exact(plan, raw);
    }
    const bool root = plan->metric == FM_METRIC_L2 && !plan->squared;
    double value = root ? (double)fm_floor_root(raw) : (double)raw;
    double most = (double)fm_type_greatest(plan->distance_type);
    return value < most ? value : most;
}

static inline double fm_finish_weighted(const fm_plan *plan, float raw) {
    return raw == INFINITY || raw > plan->cap_raw_weighted ? plan->value_none : (double)fm_scaled_weighted(plan, raw);
}

static inline void fm_store_distance(const fm_plan *plan, void *distance, uint64_t at, double value) {
    switch (plan->distance_type) {
    case FM_TYPE_U8:
        ((uint8_t *)distance)[at] = (uint8_t)value;
        break;
    case FM_TYPE_U16:
        ((uint16_t *)distance)[at] = (uint16_t)value;
        break;
    case FM_TYPE_U32:
        ((uint32_t *)distance)[at] = (uint32_t)value;
        break;
    case FM_TYPE_I8:
        ((int8_t *)distance)[at] = (int8_t)value;
        break;
    case FM_TYPE_I16:
        ((int16_t *)distance)[at] = (int16_t)value;
        break;
    case FM_TYPE_I32:
        ((int32_t *)distance)[at] = (int32_t)value;
        break;
    default:
        ((float *)distance)[at] = (float)value;
        break;
    }
}

// `at` UINT64_MAX: none.
static inline void fm_store_index(const fm_plan *plan, void *index, uint64_t at, uint64_t value) {
    if (plan->index_type == FM_TYPE_U32) {
        ((uint32_t *)index)[at] = (uint32_t)value;
    } else {
        ((uint64_t *)index)[at] = value;
    }
}

static inline bool fm_site(const fm_sites *sites, uint64_t row, uint32_t x) {
    return sites->words[row * fm_bits_row_words(sites->shape) + x / 32] >> (x % 32) & 1;
}

#endif
