// SPDX-License-Identifier: MIT
// The transform on Vulkan: site bits and carries ("encode"), then one pass along y and one along z. A signed field does it twice,
// the second time for the empty voxels, and writes only where voxels are solid.

#include "gpu/compute.h"
#include "shaders/include/shared.h"
#include "transform/fit.h"
#include "transform/plan.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
    ENCODE_THREADS = 256,
    SEARCH_THREADS = 64,
    HALVE_VOXELS = 1 << 24,   // measured: fewer leave a big GPU idle, and its pass along x costs more than it saves
    HALVE_LANES = 32,         // x of a tile of halve.comp and ways.comp
    HALVE_PIECE = 8,          // PIECE there
    HALVE_READ_AHEAD = 1024,  // bytes behind its input that halve.comp may load
    HALVE_THREADS = 512,      // more rows an invocation before more invocations
    HALVE_LEAST_ROWS = 4,     // BATCH there
    WAYS_ROWS = 256,          // rows that a group of ways.comp owns
    BIG_SQUARE = 1 << 24,     // floats hold whole numbers up to here
    MAX_SLABS = 16,
    SLAB_STEP = 32,  // voxels; keeps the rows of a slab's raw distances aligned
    // Words of site bits that a dispatch of brute force tries: 33 loop turns each at most, and llvmpipe ends loops at 65,535.
    BRUTE_WORDS = 992,
};

// Pairs of a voxel and a site that a dispatch of brute force tries at most: a GPU's watchdog allows a few seconds.
static const uint64_t brute_pairs = (uint64_t)1 << 36;

_Static_assert(FM_GPU_U8 == (int)FM_TYPE_U8 && FM_GPU_BITS == (int)FM_TYPE_BITS && FM_GPU_I32 == (int)FM_TYPE_I32 &&
                   FM_GPU_U64 == (int)FM_TYPE_U64,
               "shared.h numbers the types as fm_type does");
_Static_assert(FM_GPU_L2 == (int)FM_METRIC_L2 && FM_GPU_L1 == (int)FM_METRIC_L1 && FM_GPU_LINF == (int)FM_METRIC_LINF,
               "shared.h numbers the metrics as fm_metric does");

// How the columns along one axis are computed.
typedef struct column_pass {
    fm_kernel kernel;
    uint32_t lanes;  // HALVE: rows of a segment
    uint32_t segments;
    uint32_t rows;        // of a segment; HALVE: bits of a row's number
    uint32_t tile;        // voxels along x that a group owns
    uint64_t rows_group;  // voxels along the axis that a group owns: 1 for the search, else all
} column_pass;

typedef struct transform_job {
    fm_gpu *gpu;
    fm_slot *slot;
    const fm_plan *plan;
    fm_device_info device;
    fm_type solid_type;
    bool nothing;  // no value of the type is selected
    fm_encode_push encode;
    fm_column_push column;
    bool scan;       // the kernel for Manhattan distances serves
    uint32_t width;  // bytes of a raw distance
    bool wide;       // carries of 32 bits
    bool raw_in_result;
    uint64_t raw;   // of the first slab
    uint32_t slab;  // voxels along x that the passes along y and z take at a time
    column_pass along_y, along_z;
} transform_job;

static void select_values(transform_job *job) {
    fm_value_range range = fm_plan_selected(job->plan, job->solid_type);
    job->nothing = range.nothing;
    if (range.outside) {  // of floats: every number but 0
        job->encode.low = 0;
        job->encode.span = 1;
    } else if (job->solid_type == FM_TYPE_F32) {
        float least = (float)range.least.f;
        memcpy(&job->encode.low, &least, sizeof least);
        job->encode.span = 0;
    } else {
        job->encode.low = (uint32_t)range.least.u;
        job->encode.span = (uint32_t)(range.most.u - range.least.u);
    }
}

// Bytes of a raw distance, for which the greatest number that fits means "none or farther than anybody asks".
static uint32_t raw_width(const transform_job *job) {
    const fm_plan *plan = job->plan;
    if (!job->scan) {
        return 4;
    }
    uint64_t wanted = fm_min_u64(plan->greatest, plan->cap_raw);
    if (plan->distance_type != FM_TYPE_F32) {
        wanted = fm_min_u64(wanted, fm_type_greatest(plan->distance_type) - 1);
    }
    return wanted < UINT8_MAX ? 1 : wanted < UINT16_MAX ? 2 : 4;
}

static bool plan_scan(const transform_job *job, uint32_t n, column_pass *pass) {
    bool half = job->width == 1 && job->device.float16;
    fm_column_fit fit;
    if (!fm_fit_scan(&job->device, n, job->plan->shape.x, half, half ? 2 * 2 * 2 * 4 : 2 * 2 * 4 * 4, half ? 32 : 16, &fit)) {
        return false;
    }
    *pass = (column_pass){half ? FM_KERNEL_SCAN_F16 : FM_KERNEL_SCAN_U32, fit.lanes, fit.segments, fit.rows, 4 * fit.lanes, n};
    return true;
}

// halve.comp serves squared distances that fit in a key beside a row's number, the longest way along the axis added, where its
// tiles waste little memory.
static bool plan_halve(const transform_job *job, uint32_t n, column_pass *pass) {
    const fm_plan *plan = job->plan;
    // Tests set FATHOM_HALVE, so that small grids reach both kernels.
    const char *wish = getenv("FATHOM_HALVE");
    bool worth =
        wish ? strcmp(wish, "always") == 0
             : fm_voxels(plan->shape) >= HALVE_VOXELS && plan->shape.x >= 2 * HALVE_LANES && plan->shape.y >= 2 * HALVE_PIECE;
    bool long_enough = plan->shape.y >= HALVE_LEAST_ROWS && (plan->shape.z >= HALVE_LEAST_ROWS || plan->shape.z == 1);
    if (!worth || !long_enough || plan->metric != FM_METRIC_L2 || plan->weighted || plan->want_index || plan->brute_force) {
        return false;
    }
    uint64_t longest = fm_round_up(fm_max_u64(plan->shape.y, plan->shape.z), 64);
    uint32_t bits = 1;
    while ((uint64_t)1 << bits < longest) {
        bits++;
    }
    uint64_t limit = (uint64_t)1 << (bits < 9 ? 23 : 32 - fm_min_u64(bits, 32));
    if (longest > UINT16_MAX || plan->greatest + (longest - 1) * (longest - 1) + 1 >= limit ||
        HALVE_LANES * longest / 64 > job->device.max_workgroup) {
        return false;
    }
    uint32_t rows = HALVE_LANES * fm_div_up(n, 32) <= HALVE_THREADS ? 32 : 64;
    *pass = (column_pass){FM_KERNEL_HALVE, rows, (uint32_t)fm_div_up(n, rows), bits, HALVE_LANES, n};
    return true;
}

// The kernels that keep whole columns in shared memory, or where those are too long for it, a search in device memory.
static void plan_column(const transform_job *job, uint32_t n, column_pass *pass) {
    const fm_plan *plan = job->plan;
    if (job->scan && plan_scan(job, n, pass)) {
        return;
    }
    if (plan_halve(job, n, pass)) {
        return;
    }
    bool floats = plan->weighted || plan->greatest < BIG_SQUARE;
    bool parabola = plan->metric == FM_METRIC_L2 && !plan->weighted && floats;
    // Rows with a gap (one number a row, or one row), and three numbers.
    uint32_t lane_words = parabola ? FM_SEGMENT_ROWS + 3 : FM_SEGMENT_ROWS + 1 + 3;
    fm_column_fit fit;
    if (fm_fit_segments(&job->device, n, lane_words, parabola ? FM_SEGMENT_ROWS : 0, &fit)) {
        fm_kernel kernel = parabola ? FM_KERNEL_PARABOLA : floats ? FM_KERNEL_ENVELOPE_F32 : FM_KERNEL_ENVELOPE_U32;
        *pass = (column_pass){kernel, fit.lanes, fit.segments, fit.rows, fit.lanes, n};
        return;
    }
    *pass = (column_pass){floats ? FM_KERNEL_SEARCH_F32 : FM_KERNEL_SEARCH_U32, SEARCH_THREADS, 1, 1, SEARCH_THREADS, 1};
}

static bool is_scan(const column_pass *pass) {
    return pass->kernel == FM_KERNEL_SCAN_F16 || pass->kernel == FM_KERNEL_SCAN_U32;
}

static bool is_halve(const column_pass *pass) {
    return pass->kernel == FM_KERNEL_HALVE;
}

static bool is_search(const column_pass *pass) {
    return pass->kernel == FM_KERNEL_SEARCH_F32 || pass->kernel == FM_KERNEL_SEARCH_U32;
}

static uint32_t result_bits(const fm_plan *plan, double value) {
    if (plan->want_distance && plan->distance_type != FM_TYPE_F32) {
        return (uint32_t)value;
    }
    float single = (float)value;
    uint32_t bits;
    memcpy(&bits, &single, sizeof bits);
    return bits;
}

static void fill_column_push(transform_job *job, uint64_t bits, uint64_t carries, uint64_t distance, uint64_t index) {
    const fm_plan *plan = job->plan;
    fm_column_push *push = &job->column;
    push->bits = bits;
    push->carries = carries;
    push->distance = distance;
    push->index = index;
    push->x = plan->shape.x;
    push->y = plan->shape.y;
    push->z = plan->shape.z;
    push->row_words = fm_bits_row_words(plan->shape);
    push->cap_raw = plan->cap_raw;
    if (plan->weighted) {
        memcpy(&push->cap_raw, &plan->cap_raw_weighted, sizeof push->cap_raw);
    }
    push->none_bits = result_bits(plan, plan->value_none);
    push->weight_x = plan->weighted ? plan->weight[0] : 1;
    push->weight_y = plan->weighted ? plan->weight[1] : 1;
    push->weight_z = plan->weighted ? plan->weight[2] : 1;
    push->scale = (float)plan->scale;
}

static uint64_t brute_words(const fm_plan *plan) {
    return fm_max_u64(1, fm_min_u64(BRUTE_WORDS, brute_pairs / 32 / fm_voxels(plan->shape)));
}

// Lays out the scratch memory: site bits and carries, and for as wide a slab of x as keeps the whole within four bytes a voxel: the
// raw distances, unless the result's own memory can serve, the rows of the nearest sites where indices are wanted, and ways along
// x.
static fm_result lay_out(transform_job *job, uint64_t distance, uint64_t index) {
    const fm_plan *plan = job->plan;
    uint64_t rows = (uint64_t)plan->shape.y * plan->shape.z;
    uint64_t words = rows * fm_bits_row_words(plan->shape);
    uint64_t bits_bytes = fm_round_up(words * 4, 256);
    uint64_t carries_bytes = fm_round_up(words * (job->wide ? 8 : 4), 256);
    bool two_passes = plan->shape.z > 1 && !plan->brute_force;
    bool keeps = two_passes || (plan->brute_force && words > brute_words(plan));
    bool result_fits = plan->want_distance && fm_type_size(plan->distance_type) == 4 && !plan->is_signed;
    bool halve = is_halve(&job->along_y);
    job->raw_in_result = two_passes && job->width == 4 && result_fits && !is_search(&job->along_z) && !is_scan(&job->along_y) &&
                         !is_scan(&job->along_z) && !halve;
    uint64_t raw_bytes = keeps && !job->raw_in_result ? job->width : 0;
    uint64_t site_bytes = keeps && plan->want_index ? (plan->brute_force ? 8 : 4) : 0;
    uint64_t way_bytes = halve ? 2 : 0;
    // halve.comp keeps the rows of a slice in pieces.
    uint64_t raw_rows = halve ? fm_round_up(plan->shape.y, HALVE_PIECE) * plan->shape.z : rows;
    uint64_t width_step = halve ? HALVE_LANES : 16;
    uint64_t read_ahead = halve ? HALVE_READ_AHEAD : 0;
    uint64_t budget = rows * plan->shape.x * 4;
    uint64_t slab_width;
    uint64_t total;
    uint32_t slabs = 0;
    do {
        slabs++;
        job->slab = (uint32_t)fm_min_u64(fm_round_up(fm_div_up(plan->shape.x, slabs), SLAB_STEP), plan->shape.x);
        slab_width = fm_round_up(job->slab, width_step);
        total =
            bits_bytes + carries_bytes + slab_width * (raw_rows * raw_bytes + rows * (site_bytes + way_bytes)) + 256 + read_ahead;
    } while (total > budget && slabs < MAX_SLABS && !plan->brute_force && job->slab > SLAB_STEP);
    uint64_t base;
    FM_TRY(fm_gpu_scratch(job->gpu, total, &base));
    job->encode.bits = base;
    job->encode.carries = base + bits_bytes;
    fill_column_push(job, base, base + bits_bytes, distance, index);
    uint64_t behind = base + bits_bytes + carries_bytes;
    job->raw = job->raw_in_result ? distance : behind;
    job->column.pitch = job->raw_in_result ? plan->shape.x : (uint32_t)fm_round_up(job->slab, 16);
    job->column.sites_y = fm_round_up(behind + slab_width * raw_rows * raw_bytes, 256);
    return FM_OK;
}

static uint64_t carry_bytes(const transform_job *job) {
    return (uint64_t)job->column.row_words * job->plan->shape.y * job->plan->shape.z * (job->wide ? 12 : 8);
}

static fm_result encode(transform_job *job, bool inner) {
    const fm_plan *plan = job->plan;
    uint32_t words = job->encode.row_words;
    uint32_t row_threads = fm_floor_power_of_two(fm_min_u64(words, ENCODE_THREADS));
    row_threads *= row_threads < words && row_threads < ENCODE_THREADS ? 2 : 1;
    uint32_t constants[] = {job->solid_type, inner, job->wide, (uint32_t)fm_div_up(words, row_threads), row_threads, job->nothing};
    uint64_t rows = (uint64_t)plan->shape.y * plan->shape.z;
    fm_dispatch dispatch = {.kernel = FM_KERNEL_ENCODE,
                            .constants = constants,
                            .constant_count = sizeof constants / sizeof constants[0],
                            .push = &job->encode,
                            .push_bytes = sizeof job->encode,
                            .groups = fm_div_up(rows, ENCODE_THREADS / row_threads)};
    FM_TRY(fm_commands_dispatch(job->gpu, job->slot, &dispatch));
    uint64_t solid_bytes;
    FM_TRY(fm_array_bytes(plan->shape, job->solid_type, &solid_bytes));
    fm_commands_pass(job->gpu, job->slot, inner ? "encode inside" : "encode", solid_bytes + carry_bytes(job));
    return FM_OK;
}

static fm_result dispatch_brute(transform_job *job, const fm_dispatch *dispatch) {
    const fm_plan *plan = job->plan;
    uint64_t words = (uint64_t)plan->shape.y * plan->shape.z * job->column.row_words;
    uint64_t step = brute_words(plan);
    for (uint64_t first = 0; first < words; first += step) {
        if (first > 0) {
            fm_commands_barrier(job->gpu, job->slot);
        }
        job->column.first_word = first;
        job->column.word_count = (uint32_t)fm_min_u64(step, words - first);
        FM_TRY(fm_commands_dispatch(job->gpu, job->slot, dispatch));
    }
    return FM_OK;
}

static fm_result run_ways(transform_job *job, bool inner) {
    const fm_shape shape = job->plan->shape;
    uint64_t tiles = fm_div_up(job->column.x_end - job->column.x_begin, HALVE_LANES);
    fm_dispatch dispatch = {.kernel = FM_KERNEL_WAYS,
                            .push = &job->column,
                            .push_bytes = sizeof job->column,
                            .groups = tiles * shape.z * fm_div_up(shape.y, WAYS_ROWS)};
    FM_TRY(fm_commands_dispatch(job->gpu, job->slot, &dispatch));
    uint64_t written = (uint64_t)shape.y * shape.z * tiles * HALVE_LANES * 2;
    uint64_t part = carry_bytes(job) * (job->column.x_end - job->column.x_begin) / shape.x;
    fm_commands_pass(job->gpu, job->slot, inner ? "x inside" : "x", part + written);
    return FM_OK;
}

// What the kernels of a pass are specialised by; the ids are those of column.glsl and scan.comp.
static fm_result run_column(transform_job *job, const column_pass *pass, bool along_z, uint32_t source, uint32_t target,
                            bool border) {
    const fm_plan *plan = job->plan;
    bool finishes = target != FM_TARGET_RAW;
    bool sites = plan->want_index && target != FM_TARGET_NEGATE;
    uint32_t type = plan->want_distance ? plan->distance_type : FM_TYPE_U8;
    bool bare = target == FM_TARGET_FINISH && !border && plan->cap_raw == FM_RAW_NONE && plan->scale == 1 && plan->want_distance;
    bool plain = bare && plan->shape.x % 4 == 0 && type <= FM_TYPE_U32 && fm_type_size(type) == job->width;
    uint32_t constants[] = {pass->lanes,
                            pass->segments,
                            pass->rows,
                            plan->metric,
                            is_scan(pass) ? job->width : plan->weighted,
                            source,
                            target,
                            job->wide,
                            is_scan(pass) ? plain : sites,
                            along_z,
                            finishes && plan->squared,
                            finishes && border,
                            finishes ? type : 0,
                            finishes && sites ? plan->index_type : 0,
                            plan->greatest >= BIG_SQUARE,
                            bare && (type == FM_TYPE_U32 || type == FM_TYPE_F32)};
    uint64_t slices = along_z ? plan->shape.y : plan->shape.z;
    uint64_t n = along_z ? plan->shape.z : plan->shape.y;
    uint64_t tiles = fm_div_up(job->column.x_end - job->column.x_begin, pass->tile);
    fm_dispatch dispatch = {.kernel = pass->kernel,
                            .constants = constants,
                            .constant_count = sizeof constants / sizeof constants[0],
                            .push = &job->column,
                            .push_bytes = sizeof job->column,
                            .groups = tiles * slices * (n / pass->rows_group)};
    FM_TRY(plan->brute_force ? dispatch_brute(job, &dispatch) : fm_commands_dispatch(job->gpu, job->slot, &dispatch));

    uint64_t voxels = slices * n * (job->column.x_end - job->column.x_begin);
    uint64_t part = carry_bytes(job) * (job->column.x_end - job->column.x_begin) / plan->shape.x;
    uint64_t read = is_halve(pass) && source == FM_SOURCE_BITS ? voxels * 2
                    : source == FM_SOURCE_BITS                 ? part
                                                               : voxels * job->width + (sites ? voxels * 4 + part : 0);
    uint64_t distance_bytes = plan->want_distance ? fm_type_size(plan->distance_type) : 0;
    uint64_t index_bytes = sites ? fm_type_size(plan->index_type) : 0;
    uint64_t written = voxels * (finishes ? distance_bytes + index_bytes : job->width + (sites ? 4 : 0));
    // Only the inner side of a signed field has the opposite rule for what lies outside.
    bool inner = border != plan->border;
    const char *name = plan->brute_force ? (inner ? "brute force inside" : "brute force")
                       : along_z         ? (inner ? "z inside" : "z")
                                         : (inner ? "y inside" : "y");
    fm_commands_pass(job->gpu, job->slot, name, read + written);
    return FM_OK;
}

static fm_result run_brute(transform_job *job, uint32_t target, bool border) {
    const fm_plan *plan = job->plan;
    bool floats = plan->weighted || plan->greatest < BIG_SQUARE;
    column_pass pass = {floats ? FM_KERNEL_BRUTE_F32 : FM_KERNEL_BRUTE_U32, SEARCH_THREADS, 1, 1, SEARCH_THREADS, 1};
    job->column.x_begin = 0;
    job->column.x_end = plan->shape.x;
    job->column.raw = job->raw;
    return run_column(job, &pass, false, FM_SOURCE_BITS, target, border);
}

static fm_result run_side(transform_job *job, bool inner) {
    const fm_plan *plan = job->plan;
    uint32_t target = inner ? FM_TARGET_NEGATE : FM_TARGET_FINISH;
    bool border = inner ? !plan->border : plan->border;
    FM_TRY(encode(job, inner));
    if (plan->brute_force) {
        return run_brute(job, target, border);
    }
    for (uint32_t x = 0; x < plan->shape.x; x += job->slab) {
        job->column.x_begin = x;
        job->column.x_end = (uint32_t)fm_min_u64((uint64_t)x + job->slab, plan->shape.x);
        job->column.raw = job->raw + (job->raw_in_result ? 4 * (uint64_t)x : 0);
        if (is_halve(&job->along_y)) {
            FM_TRY(run_ways(job, inner));
        }
        if (plan->shape.z == 1) {
            FM_TRY(run_column(job, &job->along_y, false, FM_SOURCE_BITS, target, border));
        } else {
            FM_TRY(run_column(job, &job->along_y, false, FM_SOURCE_BITS, FM_TARGET_RAW, border));
            FM_TRY(run_column(job, &job->along_z, true, FM_SOURCE_RAW, target, border));
        }
    }
    return FM_OK;
}

fm_result fm_gpu_transform(fm_context *context, const fm_plan *plan, const fm_volume *solid, fm_volume *distance, fm_volume *index,
                           fm_ticket *ticket) {
    transform_job job = {.gpu = context->gpu, .plan = plan, .device = context->device, .solid_type = solid->desc.type};
    uint32_t row_words = fm_bits_row_words(plan->shape);
    job.wide = plan->shape.x >= UINT16_MAX;
    job.scan = plan->metric == FM_METRIC_L1 && !plan->weighted && !plan->want_index && !plan->brute_force;
    job.width = raw_width(&job);
    plan_column(&job, plan->shape.y, &job.along_y);
    plan_column(&job, plan->shape.z, &job.along_z);
    if (job.scan && is_scan(&job.along_y) != is_scan(&job.along_z)) {
        // Raw distances have one form: both axes take the general kernels when one is too long for the scan.
        job.scan = false;
        job.width = 4;
        plan_column(&job, plan->shape.y, &job.along_y);
        plan_column(&job, plan->shape.z, &job.along_z);
    }
    job.encode.solid = fm_buffer_address(solid->buffer);
    job.encode.x = plan->shape.x;
    job.encode.row_words = row_words;
    job.encode.rows = (uint64_t)plan->shape.y * plan->shape.z;
    select_values(&job);
    FM_TRY(lay_out(&job, distance ? fm_buffer_address(distance->buffer) : 0, index ? fm_buffer_address(index->buffer) : 0));
    FM_TRY(fm_commands_begin(context->gpu, &job.slot));
    FM_TRY(run_side(&job, false));
    if (plan->is_signed) {
        FM_TRY(run_side(&job, true));
    }
    return fm_commands_submit(context->gpu, job.slot, ticket);
}
