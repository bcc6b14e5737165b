// SPDX-License-Identifier: MIT
#include "transform/plan.h"

#include <float.h>
#include <math.h>
#include <string.h>

static const char *metric_name(fm_metric metric) {
    static const char *const names[] = {"FM_METRIC_L2", "FM_METRIC_L1", "FM_METRIC_LINF"};
    return names[metric];
}

static bool is_float(fm_type type) {
    return type == FM_TYPE_F32 || type == FM_TYPE_F64;
}

uint64_t fm_type_greatest(fm_type type) {
    switch (type) {
    case FM_TYPE_U8:
        return UINT8_MAX;
    case FM_TYPE_I8:
        return INT8_MAX;
    case FM_TYPE_U16:
        return UINT16_MAX;
    case FM_TYPE_I16:
        return INT16_MAX;
    case FM_TYPE_I32:
        return INT32_MAX;
    case FM_TYPE_U32:
        return UINT32_MAX;
    default:
        return UINT64_MAX;
    }
}

static fm_result check_enums(const fm_transform_desc *desc) {
    if ((unsigned)desc->metric > FM_METRIC_LINF) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "metric is %d: one of FM_METRIC_L2, _L1, _LINF", (int)desc->metric);
    }
    if ((unsigned)desc->algorithm > FM_ALGORITHM_BRUTE_FORCE) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "algorithm is %d: one of FM_ALGORITHM_AUTO, _SEPARABLE, _BRUTE_FORCE",
                       (int)desc->algorithm);
    }
    if ((unsigned)desc->select > FM_SELECT_LABEL) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "select is %d: one of FM_SELECT_NONZERO, _THRESHOLD, _LABEL", (int)desc->select);
    }
    if ((unsigned)desc->outside > FM_OUTSIDE_SOLID) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "outside is %d: one of FM_OUTSIDE_EMPTY, _SOLID", (int)desc->outside);
    }
    return FM_OK;
}

static fm_result check_select(const fm_transform_desc *desc, fm_type solid) {
    if (desc->select == FM_SELECT_THRESHOLD && isnan(desc->threshold)) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "threshold is NaN: a number is needed");
    }
    if (desc->select == FM_SELECT_LABEL && is_float(solid)) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "select is FM_SELECT_LABEL with %s voxels: integers or bits are needed",
                       fm_type_name(solid));
    }
    return FM_OK;
}

static fm_result check_distance_type(const fm_transform_desc *desc, fm_type type) {
    bool fits;
    const char *accepted;
    if (desc->squared) {
        fits = type == FM_TYPE_F32 || type == (desc->is_signed ? FM_TYPE_I32 : FM_TYPE_U32);
        accepted = desc->is_signed ? "int32 and float32" : "uint32 and float32";
    } else if (desc->is_signed) {
        fits = type == FM_TYPE_I8 || type == FM_TYPE_I16 || type == FM_TYPE_I32 || type == FM_TYPE_F32;
        accepted = "int8, int16, int32 and float32";
    } else {
        fits = type == FM_TYPE_U8 || type == FM_TYPE_U16 || type == FM_TYPE_U32 || type == FM_TYPE_F32;
        accepted = "uint8, uint16, uint32 and float32";
    }
    if (!fits) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "distance is %s: a%s%s field can be %s", fm_type_name(type),
                       desc->is_signed ? " signed" : "n unsigned", desc->squared ? " squared" : "", accepted);
    }
    return FM_OK;
}

// The greatest raw distance between two voxels; saturates at 2^64 - 1.
static uint64_t greatest_between(fm_metric metric, fm_shape shape) {
    const uint64_t axes[3] = {shape.x - 1, shape.y - 1, shape.z - 1};
    uint64_t greatest = 0;
    for (int i = 0; i < 3; i++) {
        uint64_t term = metric == FM_METRIC_L2 ? axes[i] * axes[i] : axes[i];
        if (metric == FM_METRIC_LINF) {
            greatest = fm_max_u64(greatest, term);
        } else if (fm_add_overflows(greatest, term, &greatest)) {
            return UINT64_MAX;
        }
    }
    return greatest;
}

// The greatest raw way out of the grid.
static uint64_t greatest_way_out(fm_metric metric, fm_shape shape) {
    uint64_t narrow = fm_min_u64(shape.x, fm_min_u64(shape.y, shape.z));
    uint64_t way = (narrow + 1) / 2;
    return metric == FM_METRIC_L2 ? way * way : way;
}

static uint64_t integer_root(uint64_t square) {
    uint64_t root = (uint64_t)sqrt((double)square);
    while (root * root > square) {
        root--;
    }
    while ((root + 1) * (root + 1) <= square) {
        root++;
    }
    return root;
}

// Spacing, weights and scale. Leaves `weighted` false when the raw distances are integers.
static fm_result plan_spacing(const fm_transform_desc *desc, uint64_t greatest, fm_plan *plan) {
    double spacing[3];
    FM_TRY(fm_spacing_resolve(desc->spacing, spacing));
    bool given = desc->spacing[0] != 0;
    if (given && plan->want_distance && plan->distance_type != FM_TYPE_F32) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "spacing is %g, %g, %g with %s distances: world units need float32", spacing[0],
                       spacing[1], spacing[2], fm_type_name(plan->distance_type));
    }
    bool isotropic = spacing[0] == spacing[1] && spacing[1] == spacing[2];
    bool wide = greatest >= FM_RAW_NONE;
    if (wide && plan->want_distance && plan->distance_type != FM_TYPE_F32) {
        return fm_fail(FM_ERROR_RANGE,
                       "shape is %u x %u x %u: the greatest distance under %s needs more than 32 bits; take float32", plan->shape.x,
                       plan->shape.y, plan->shape.z, metric_name(plan->metric));
    }
    plan->weighted = !isotropic || wide;
    plan->scale = plan->squared ? spacing[0] * spacing[0] : spacing[0];
    double sum = plan->weighted ? 0 : plan->scale * (double)greatest;
    bool normal = plan->weighted || (plan->scale >= FLT_MIN && plan->scale <= FLT_MAX);
    const double axes[3] = {plan->shape.x, plan->shape.y, plan->shape.z};
    for (int i = 0; plan->weighted && i < 3; i++) {
        bool square = plan->metric == FM_METRIC_L2;
        double weight = square ? spacing[i] * spacing[i] : spacing[i];
        normal = normal && weight >= FLT_MIN && weight <= FLT_MAX;
        plan->weight[i] = normal ? (float)weight : 0;
        sum += weight * axes[i] * (square ? axes[i] : 1);
    }
    if (!normal || sum > FLT_MAX / 2) {
        return fm_fail(FM_ERROR_RANGE, "spacing is %g, %g, %g: distances of this shape leave the range of float32", spacing[0],
                       spacing[1], spacing[2]);
    }
    if (plan->weighted) {
        plan->scale = 1;
    }
    return FM_OK;
}

// The limit, in raw units and as the value that it leaves.
static fm_result plan_limit(const fm_transform_desc *desc, fm_plan *plan) {
    double limit = desc->max_distance;
    if (!(limit >= 0) || isinf(limit)) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "max_distance is %g: finite and at least 0, where 0 is no limit", limit);
    }
    bool integer = plan->want_distance && plan->distance_type != FM_TYPE_F32;
    if (integer && limit != floor(limit)) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "max_distance is %g with %s distances: a whole number is needed", limit,
                       fm_type_name(plan->distance_type));
    }
    plan->cap_raw = FM_RAW_NONE;
    plan->cap_raw_weighted = INFINITY;
    plan->cap = INFINITY;
    if (limit == 0) {
        return FM_OK;
    }
    plan->cap = plan->squared ? limit * limit : limit;
    // The spacing is isotropic in an exact plan, so that one division turns the limit into voxels.
    double spacing = !plan->weighted && desc->spacing[0] != 0 ? desc->spacing[0] : 1;
    double steps = limit / spacing;
    double raw = plan->metric == FM_METRIC_L2 ? steps * steps : steps;
    if (plan->weighted) {
        plan->cap_raw_weighted = raw <= FLT_MAX ? (float)raw : INFINITY;
    } else if (raw < (double)FM_RAW_NONE) {
        plan->cap_raw = (uint32_t)raw;
    }
    return FM_OK;
}

// Whether the type holds every answer, and the answers at the two ends of the range.
static fm_result plan_range(const fm_transform_desc *desc, uint64_t inner, uint64_t outer, fm_plan *plan) {
    if (!plan->want_distance) {
        return FM_OK;
    }
    if (plan->distance_type == FM_TYPE_F32) {
        if (plan->cap < INFINITY && (plan->cap > FLT_MAX || plan->cap < FLT_MIN)) {
            return fm_fail(FM_ERROR_RANGE, "max_distance is %g: it leaves the range of float32", desc->max_distance);
        }
        plan->value_none = plan->cap < INFINITY ? (double)(float)plan->cap : INFINITY;
        plan->value_cap = plan->value_none;
        return FM_OK;
    }
    uint64_t greatest = fm_max_u64(inner, outer);
    if (plan->metric == FM_METRIC_L2 && !plan->squared) {
        greatest = integer_root(greatest);
    }
    uint64_t most = fm_type_greatest(plan->distance_type);
    bool capped = plan->cap < INFINITY;
    double needed = capped ? plan->cap : (double)greatest;
    if (needed > (double)most && !desc->saturate) {
        return fm_fail(FM_ERROR_RANGE, "distance is %s: distances up to %.0f do not fit; take a wider type or set saturate",
                       fm_type_name(plan->distance_type), needed);
    }
    plan->value_none = capped ? fmin(plan->cap, (double)most) : (double)most;
    plan->value_cap = plan->value_none;
    return FM_OK;
}

fm_result fm_plan_make(const fm_transform_desc *desc, fm_shape shape, fm_type solid, const fm_type *distance, const fm_type *index,
                       fm_plan *plan) {
    static const fm_transform_desc defaults = {0};
    desc = desc ? desc : &defaults;
    memset(plan, 0, sizeof *plan);
    uint64_t bytes;
    FM_TRY(fm_array_bytes(shape, solid, &bytes));
    FM_TRY(check_enums(desc));
    FM_TRY(check_select(desc, solid));
    if (!distance && !index) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "distance and indices are both NULL: at least one is needed");
    }
    if (desc->squared && desc->metric != FM_METRIC_L2) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "squared is set with %s: only FM_METRIC_L2 has squares",
                       metric_name(desc->metric));
    }
    if (distance) {
        FM_TRY(check_distance_type(desc, *distance));
        plan->want_distance = true;
        plan->distance_type = *distance;
    }
    if (index) {
        if (*index != FM_TYPE_U32 && *index != FM_TYPE_U64) {
            return fm_fail(FM_ERROR_INVALID_ARGUMENT, "indices are %s: uint32 or uint64 is needed", fm_type_name(*index));
        }
        if (*index == FM_TYPE_U32 && fm_voxels(shape) >= FM_NO_INDEX_32) {
            return fm_fail(FM_ERROR_RANGE, "indices are uint32: a grid of %llu voxels needs uint64",
                           (unsigned long long)fm_voxels(shape));
        }
        plan->want_index = true;
        plan->index_type = *index;
    }
    plan->shape = shape;
    plan->metric = desc->metric;
    plan->brute_force = desc->algorithm == FM_ALGORITHM_BRUTE_FORCE;
    plan->is_signed = desc->is_signed;
    plan->squared = desc->squared;
    plan->border = desc->outside == FM_OUTSIDE_SOLID;
    plan->select = desc->select;
    plan->threshold = desc->threshold;
    plan->label = desc->label;

    uint64_t between = greatest_between(plan->metric, shape);
    uint64_t way_out = greatest_way_out(plan->metric, shape);
    uint64_t greatest = fm_max_u64(between, way_out);
    FM_TRY(plan_spacing(desc, greatest, plan));
    plan->greatest = plan->weighted ? 0 : (uint32_t)greatest;
    FM_TRY(plan_limit(desc, plan));
    uint64_t outer = plan->border ? way_out : between;
    uint64_t inner = !plan->is_signed ? 0 : plan->border ? between : way_out;
    return plan_range(desc, inner, outer, plan);
}
