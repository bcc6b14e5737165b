// SPDX-License-Identifier: MIT
// Compiled once an instruction set; simd.h says which one this is.

#include "transform/kernels.h"

#include "transform/finish.h"
#include "transform/simd.h"

#define KERNEL(name) FM_LEVEL(name)

static inline uint32_t fm_steps_least(uint32_t a, uint32_t b) {
    return a < b ? a : b;
}

// The sites of a row, with clear words behind it; whether there are any.
static inline bool fm_fetch_words(const fm_kernel_job *job, uint64_t row, size_t row_words, uint32_t *words) {
    const uint32_t *from = job->words + row * row_words;
    const uint32_t flip = job->invert ? UINT32_MAX : 0;
    uint32_t any = 0;
    for (size_t i = 0; i < row_words; i++) {
        words[i] = from[i] ^ flip;
        any |= words[i];
    }
    words[row_words] = 0;
    words[row_words + 1] = 0;
    return any != 0;
}

// Writes past the cache where alignment allows: nobody reads it soon.
static inline void fm_copy_out(void *to, const void *from, size_t bytes) {
    uint8_t *out = to;
    const uint8_t *in = from;
    if ((uintptr_t)out % VECTOR_BYTES == 0) {
        for (; bytes >= VECTOR_BYTES; bytes -= VECTOR_BYTES) {
            stream(out, load(in));
            out += VECTOR_BYTES;
            in += VECTOR_BYTES;
        }
    }
    memcpy(out, in, bytes);
}

// Finishing a run of raw distances, in `staged`, to be copied out past the cache; NULL: in place. Values of the inner side of a
// signed field are negative and go where the raw distance is not 0, which is where the outer side left a 0.
#define FINISH_LOOP(type, value)                                                                                                   \
    {                                                                                                                              \
        type *target = (type *)job->distance + at;                                                                                 \
        type *restrict out = job->invert || !staged ? target : staged;                                                             \
        const type none = (type)plan->value_none;                                                                                  \
        if (job->invert) {                                                                                                         \
            for (size_t i = 0; i < count; i++) {                                                                                   \
                const type found = raw[i] > limit ? none : (type)(value);                                                          \
                out[i] = raw[i] ? (type)-found : out[i];                                                                           \
            }                                                                                                                      \
        } else {                                                                                                                   \
            for (size_t i = 0; i < count; i++) {                                                                                   \
                out[i] = raw[i] > limit ? none : (type)(value);                                                                    \
            }                                                                                                                      \
            if (staged) {                                                                                                          \
                fm_copy_out(target, out, count * sizeof(type));                                                                    \
            }                                                                                                                      \
        }                                                                                                                          \
        break;                                                                                                                     \
    }
#define AT_MOST(most) fm_steps_least(raw[i], most)

#define DEFINE_FINISH(name, lane, narrow_root)                                                                                     \
    static inline void name(const fm_kernel_job *job, uint64_t at, size_t count, const lane *restrict raw, void *staged) {         \
        const fm_plan *plan = job->plan;                                                                                           \
        const uint32_t limit = job->limit;                                                                                         \
        const float scale = (float)plan->scale;                                                                                    \
        const bool root = plan->metric == FM_METRIC_L2 && !plan->squared;                                                          \
        switch (plan->distance_type) {                                                                                             \
        case FM_TYPE_F32:                                                                                                          \
            if (!root) {                                                                                                           \
                FINISH_LOOP(float, (float)raw[i] * scale)                                                                          \
            } else if (narrow_root) {                                                                                              \
                FINISH_LOOP(float, sqrtf((float)raw[i]) * scale)                                                                   \
            } else {                                                                                                               \
                FINISH_LOOP(float, (float)sqrt((double)raw[i]) * scale)                                                            \
            }                                                                                                                      \
        case FM_TYPE_U8:                                                                                                           \
            if (root) {                                                                                                            \
                FINISH_LOOP(uint8_t, fm_root_at_most(raw[i], UINT8_MAX))                                                           \
            } else {                                                                                                               \
                FINISH_LOOP(uint8_t, AT_MOST(UINT8_MAX))                                                                           \
            }                                                                                                                      \
        case FM_TYPE_U16:                                                                                                          \
            if (root) {                                                                                                            \
                FINISH_LOOP(uint16_t, fm_root_at_most(raw[i], UINT16_MAX))                                                         \
            } else {                                                                                                               \
                FINISH_LOOP(uint16_t, AT_MOST(UINT16_MAX))                                                                         \
            }                                                                                                                      \
        case FM_TYPE_U32:                                                                                                          \
            if (root) {                                                                                                            \
                FINISH_LOOP(uint32_t, fm_root_at_most(raw[i], UINT32_MAX))                                                         \
            } else {                                                                                                               \
                FINISH_LOOP(uint32_t, raw[i])                                                                                      \
            }                                                                                                                      \
        case FM_TYPE_I8:                                                                                                           \
            if (root) {                                                                                                            \
                FINISH_LOOP(int8_t, fm_root_at_most(raw[i], INT8_MAX))                                                             \
            } else {                                                                                                               \
                FINISH_LOOP(int8_t, AT_MOST(INT8_MAX))                                                                             \
            }                                                                                                                      \
        case FM_TYPE_I16:                                                                                                          \
            if (root) {                                                                                                            \
                FINISH_LOOP(int16_t, fm_root_at_most(raw[i], INT16_MAX))                                                           \
            } else {                                                                                                               \
                FINISH_LOOP(int16_t, AT_MOST(INT16_MAX))                                                                           \
            }                                                                                                                      \
        default:                                                                                                                   \
            if (root) {                                                                                                            \
                FINISH_LOOP(int32_t, fm_root_at_most(raw[i], INT32_MAX))                                                           \
            } else {                                                                                                               \
                FINISH_LOOP(int32_t, AT_MOST(INT32_MAX))                                                                           \
            }                                                                                                                      \
        }                                                                                                                          \
    }

static inline uint32_t fm_root_at_most(uint32_t square, uint32_t most) {
    return fm_steps_least(fm_floor_root(square), most);
}

DEFINE_FINISH(finish_u8, uint8_t, true)
DEFINE_FINISH(finish_u16, uint16_t, true)
DEFINE_FINISH(finish_u32, uint32_t, false)

#define l1_u8_finish finish_u8
#define l1_u16_finish finish_u16
#define LANE_TEMPLATE "transform/l1_template.h"
#include "transform/lanes.h"

// The first pass's share of a sum. What the lanes do not hold cannot be told from none: plane_runs takes wider ones then.
static inline uint16_t window_u15_first(uint16_t steps, bool linf) {
    return linf ? (steps > INT16_MAX ? INT16_MAX : steps) : steps > 181 ? INT16_MAX : (uint16_t)(steps * steps);
}

static inline uint16_t window_u16_first(uint16_t steps, bool linf) {
    return linf ? steps : steps > 255 ? UINT16_MAX : (uint16_t)(steps * steps);
}

// 15 bits: a sum of two cannot overflow, and processors add without saturating twice as fast.
#define LANE uint16_t
#define NONE INT16_MAX
#define W(name) window_u15_##name
#define V(name) name##_u15
#define STEPS(job) ((job)->steps_u15)
#define window_u15_finish finish_u16
#include "transform/window_template.h"
#undef NONE
#undef W
#undef V
#undef STEPS

#define NONE UINT16_MAX
#define W(name) window_u16_##name
#define V(name) name##_u16
#define STEPS(job) ((job)->steps_u16)
#define window_u16_finish finish_u16
#include "transform/window_template.h"
#undef LANE
#undef NONE
#undef W
#undef V
#undef STEPS

static inline uint32_t window_u32_first(uint16_t steps, bool linf) {
    return steps == UINT16_MAX ? FM_WIDE_NONE : linf ? steps : (uint32_t)steps * steps;
}

#define LANE uint32_t
#define NONE FM_WIDE_NONE
#define W(name) window_u32_##name
#define V(name) name##_u32
#define STEPS(job) ((job)->steps_u32)
#define window_u32_finish finish_u32
#include "transform/window_template.h"

// Takes the narrowest lanes that hold the slice. Neighbouring slices are alike, so that the width of the last one is tried first,
// and now and then the next narrower one.
static FM_INLINE void plane_runs(const fm_kernel_job *job, uint64_t begin, uint64_t end, uint32_t worker, bool linf) {
    uint32_t *width = &job->widths[worker * FM_WIDTHS_STRIDE];
    for (uint64_t z = begin; z < end; z++) {
        uint32_t tried = *width - (*width > 0 && z % 8 == 0);
        if (tried == 0 && !window_u15_plane(job, (uint32_t)z, worker, linf)) {
            tried = 1;
        }
        if (tried == 1 && !window_u16_plane(job, (uint32_t)z, worker, linf)) {
            tried = 2;
        }
        if (tried == 2) {
            window_u32_plane(job, (uint32_t)z, worker, linf);
        }
        *width = tried;
    }
    stream_fence();
}

static void l2_plane(void *user, uint64_t begin, uint64_t end, uint32_t worker) {
    plane_runs(user, begin, end, worker, false);
}

static void linf_plane(void *user, uint64_t begin, uint64_t end, uint32_t worker) {
    plane_runs(user, begin, end, worker, true);
}

static void z_distances(void *user, uint64_t begin, uint64_t end, uint32_t worker) {
    const fm_kernel_job *job = user;
    const fm_shape shape = job->plan->shape;
    const uint64_t plane_words = (uint64_t)fm_bits_row_words(shape) * shape.y;
    const vector one = set_u16(1);
    const size_t run = (size_t)job->depth_words * 32;
    enum { LANES = VECTOR_BYTES / 2 };
    uint16_t *edge = (uint16_t *)(void *)(job->workers + worker * job->worker_bytes);
    uint16_t *tile = edge + run;
    uint32_t *words = (uint32_t *)(void *)(tile + run * shape.z);
    for (size_t i = 0; i < run; i++) {
        edge[i] = job->border ? 0 : UINT16_MAX;
    }
    for (uint64_t item = begin; item < end; item++) {
        const uint64_t start = item * job->depth_words;
        const size_t count = (size_t)fm_min_u64(job->depth_words, plane_words - start);
        for (size_t z = 0; z < shape.z; z++) {
            uint16_t *to = tile + z * run;
            const uint16_t *last = z == 0 ? edge : to - run;
            const uint32_t *from = job->words + z * plane_words + start;
            for (size_t i = 0; i < count; i++) {
                words[i] = job->invert ? ~from[i] : from[i];
            }
            for (size_t x = 0; x < count * 32; x += LANES) {
                store(to + x, min_u16(clear_where_u16(words, (uint32_t)x), add_u16(load(last + x), one)));
            }
        }
        for (size_t z = shape.z; z-- > 0;) {
            uint16_t *to = tile + z * run;
            const uint16_t *last = z + 1 == shape.z ? edge : to + run;
            uint16_t *out = (uint16_t *)job->middle + (z * plane_words + start) * 32;
            for (size_t x = 0; x < count * 32; x += LANES) {
                const vector least = min_u16(load(to + x), add_u16(load(last + x), one));
                store(to + x, least);
                stream(out + x, least);
            }
        }
    }
    stream_fence();
}

static void differs_u8(const uint8_t *values, uint64_t words, uint8_t key, uint32_t *out) {
    for (uint64_t i = 0; i < words; i++) {
        out[i] = ~equals_32(values + 32 * i, key);
    }
}

static void equals_u8(const uint8_t *values, uint64_t words, uint8_t key, uint32_t *out) {
    for (uint64_t i = 0; i < words; i++) {
        out[i] = equals_32(values + 32 * i, key);
    }
}

static void at_least_u8(const uint8_t *values, uint64_t words, uint8_t key, uint32_t *out) {
    for (uint64_t i = 0; i < words; i++) {
        out[i] = at_least_32(values + 32 * i, key);
    }
}

const fm_kernels KERNEL(fm_kernels) = {
    .l1_plane_u8 = l1_u8_plane,
    .l1_depth_u8 = l1_u8_depth,
    .l1_plane_u16 = l1_u16_plane,
    .l1_depth_u16 = l1_u16_depth,
    .z_distances = z_distances,
    .l2_plane = l2_plane,
    .linf_plane = linf_plane,
    .differs_u8 = differs_u8,
    .equals_u8 = equals_u8,
    .at_least_u8 = at_least_u8,
};
