// SPDX-License-Identifier: MIT
// From a caller's descriptor to a plan, or the reason why there is none.

#include "transform/finish.h"

#include <assert.h>
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

// By fm_type; the floating point types have none.
static const struct {
    int64_t least;
    uint64_t greatest;
} limits[] = {
    [FM_TYPE_BITS] = {0, 1},
    [FM_TYPE_U8] = {0, UINT8_MAX},
    [FM_TYPE_U16] = {0, UINT16_MAX},
    [FM_TYPE_U32] = {0, UINT32_MAX},
    [FM_TYPE_U64] = {0, UINT64_MAX},
    [FM_TYPE_I8] = {INT8_MIN, INT8_MAX},
    [FM_TYPE_I16] = {INT16_MIN, INT16_MAX},
    [FM_TYPE_I32] = {INT32_MIN, INT32_MAX},
    [FM_TYPE_I64] = {INT64_MIN, INT64_MAX},
};

int64_t fm_type_least(fm_type type) {
    assert(!is_float(type));
    return limits[type].least;
}

uint64_t fm_type_greatest(fm_type type) {
    assert(!is_float(type));
    return limits[type].greatest;
}

static fm_value_range select_floats(const fm_plan *plan, fm_type solid) {
    fm_value_range range = {.outside = true};
    if (plan->select == FM_SELECT_THRESHOLD) {
        range = (fm_value_range){.least.f = plan->threshold, .most.f = INFINITY};
        if (solid == FM_TYPE_F32) {
            const float nearest = (float)plan->threshold;
            range.least.f = (double)nearest < plan->threshold ? nextafterf(nearest, INFINITY) : nearest;
        }
    }
    return range;
}

static fm_value_range select_unsigned(const fm_plan *plan, fm_type solid) {
    const uint64_t greatest = fm_type_greatest(solid);
    fm_value_range range = {.least.u = 1, .most.u = greatest};
    if (plan->select == FM_SELECT_THRESHOLD) {
        const double up = ceil(plan->threshold);
        // 2^64 - 1 becomes 2^64, which no value reaches.
        range.nothing = greatest == UINT64_MAX ? up >= 0x1p64 : up > (double)greatest;
        range.least.u = range.nothing || up <= 0 ? 0 : (uint64_t)up;
    } else if (plan->select == FM_SELECT_LABEL) {
        range.nothing = plan->label < 0 || (uint64_t)plan->label > greatest;
        range.least.u = range.most.u = (uint64_t)plan->label;
    }
    return range;
}

static fm_value_range select_signed(const fm_plan *plan, fm_type solid) {
    const int64_t least = fm_type_least(solid);
    const int64_t greatest = (int64_t)fm_type_greatest(solid);
    fm_value_range range = {.outside = true};
    if (plan->select == FM_SELECT_THRESHOLD) {
        const double up = ceil(plan->threshold);
        // 2^63 - 1 becomes 2^63, which no value reaches.
        const bool nothing = greatest == INT64_MAX ? up >= 0x1p63 : up > (double)greatest;
        range = (fm_value_range){.nothing = nothing, .most.i = greatest};
        range.least.i = nothing || up <= (double)least ? least : (int64_t)up;
    } else if (plan->select == FM_SELECT_LABEL) {
        range = (fm_value_range){.nothing = plan->label < least || plan->label > greatest};
        range.least.i = range.most.i = plan->label;
    }
    return range;
}

fm_value_range fm_plan_selected(const fm_plan *plan, fm_type solid) {
    return is_float(solid)           ? select_floats(plan, solid)
           : limits[solid].least < 0 ? select_signed(plan, solid)
                                     : select_unsigned(plan, solid);
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

// The greatest raw distance whose F32 result is within the limit; FM_RAW_NONE when all are.
static uint32_t greatest_within(const fm_plan *plan) {
    // 0 is within whatever the limit is.
    uint32_t within = 0;
    uint32_t above = FM_RAW_NONE;
    while (above - within > 1) {
        const uint32_t middle = within + (above - within) / 2;
        if (fm_scaled_exact(plan, middle) <= (float)plan->cap) {
            within = middle;
        } else {
            above = middle;
        }
    }
    return above == FM_RAW_NONE ? FM_RAW_NONE : within;
}

static float greatest_within_weighted(const fm_plan *plan) {
    const float cap = (float)plan->cap;
    float raw = plan->metric == FM_METRIC_L2 && !plan->squared ? cap * cap : cap;
    while (fm_scaled_weighted(plan, raw) > cap) {
        raw = nextafterf(raw, 0);
    }
    while (raw < INFINITY && fm_scaled_weighted(plan, nextafterf(raw, INFINITY)) <= cap) {
        raw = nextafterf(raw, INFINITY);
    }
    return raw;
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
    if (plan->weighted) {
        plan->cap_raw_weighted = greatest_within_weighted(plan);
    } else if (integer) {
        const double raw = plan->metric == FM_METRIC_L2 ? limit * limit : limit;
        plan->cap_raw = raw < (double)FM_RAW_NONE ? (uint32_t)raw : FM_RAW_NONE;
    } else {
        plan->cap_raw = greatest_within(plan);
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
