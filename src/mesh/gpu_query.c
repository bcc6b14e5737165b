// SPDX-License-Identifier: MIT
// The queries of a mesh on Vulkan: one dispatch for as many as fit into a buffer of questions. They all wait.

#include "mesh/gpu_tree.h"

#include <string.h>

_Static_assert(sizeof(fm_closest) == 20 && sizeof(fm_mesh_hit) == 20 && sizeof(fm_mesh_ray) == 32, "as mesh_query.comp has them");

enum { THREADS = 64, MOST_QUESTIONS = 1 << 22 };

static fm_result make_room(fm_gpu *gpu, fm_purpose purpose, uint64_t bytes, fm_buffer **buffer, uint64_t *held) {
    enum { FEWEST_BYTES = 1 << 14 };
    if (*held >= bytes) {
        return FM_OK;
    }
    // Every query waits: no work uses the old one.
    fm_buffer_destroy(*buffer);
    *buffer = NULL;
    *held = 0;
    const uint64_t wanted = fm_max_u64(bytes, FEWEST_BYTES);
    FM_TRY(fm_buffer_create(gpu, purpose, wanted, false, buffer));
    *held = wanted;
    return FM_OK;
}

// A batch of queries of one kind.
typedef struct batch {
    fm_dispatch dispatch;  // without push constants
    const void *questions;
    void *answers;
    uint32_t question_size, answer_size;
    uint32_t count;
    float bound;
    bool moments;
} batch;

static fm_result record(fm_mesh *mesh, fm_slot *slot, const batch *b) {
    const struct fm_gpu_mesh *own = mesh->gpu;
    FM_TRY(fm_gpu_mesh_tree(mesh, slot, true));
    if (b->moments) {
        FM_TRY(fm_gpu_mesh_moments(mesh, slot));
    }
    const fm_query_push push = {.mesh = fm_gpu_mesh_refs(mesh),
                                .moments = own->moments ? fm_buffer_address(own->moments) : 0,
                                .questions = fm_buffer_address(own->questions),
                                .answers = fm_buffer_address(own->answers),
                                .count = b->count,
                                .bound = b->bound};
    fm_dispatch dispatch = b->dispatch;
    dispatch.push = &push;
    dispatch.push_bytes = sizeof push;
    FM_TRY(fm_commands_dispatch(own->gpu, slot, &dispatch));
    fm_commands_pass(own->gpu, slot, "query", b->count * (uint64_t)(b->question_size + b->answer_size));
    return FM_OK;
}

static fm_result ask_batch(fm_mesh *mesh, const batch *b) {
    struct fm_gpu_mesh *own = mesh->gpu;
    const uint64_t question_bytes = b->count * (uint64_t)b->question_size, answer_bytes = b->count * (uint64_t)b->answer_size;
    FM_TRY(make_room(own->gpu, FM_PURPOSE_UPLOAD, question_bytes, &own->questions, &own->question_bytes));
    FM_TRY(make_room(own->gpu, FM_PURPOSE_READBACK, answer_bytes, &own->answers, &own->answer_bytes));
    memcpy(fm_buffer_mapped(own->questions), b->questions, question_bytes);
    fm_slot *slot;
    FM_TRY(fm_commands_begin(own->gpu, &slot));
    fm_result status = record(mesh, slot, b);
    if (status == FM_OK) {
        status = fm_commands_submit(own->gpu, slot, NULL);
    }
    if (status != FM_OK) {
        fm_gpu_mesh_forget(mesh);
        return status;
    }
    memcpy(b->answers, fm_buffer_mapped(own->answers), answer_bytes);
    return FM_OK;
}

// `each`: invocations of a question, 1 or a whole group. `most`: questions at once.
static fm_result ask(fm_mesh *mesh, batch b, uint32_t each, uint64_t most) {
    most = fm_min_u64(fm_max_u64(most, 1), MOST_QUESTIONS);
    for (uint32_t left = b.count; left > 0; left -= b.count) {
        b.count = (uint32_t)fm_min_u64(left, most);
        b.dispatch.groups = fm_div_up(b.count * (uint64_t)each, THREADS);
        FM_TRY(ask_batch(mesh, &b));
        b.questions = (const char *)b.questions + b.count * (uint64_t)b.question_size;
        b.answers = (char *)b.answers + b.count * (uint64_t)b.answer_size;
    }
    return FM_OK;
}

fm_result fm_gpu_mesh_closest(fm_mesh *mesh, const float (*positions)[3], uint32_t count, float bound, fm_closest *closest) {
    const uint32_t constants[] = {FM_QUERY_CLOSEST};
    const batch b = {.dispatch = {.kernel = FM_KERNEL_MESH_QUERY, .constants = constants, .constant_count = 1},
                     .questions = positions,
                     .answers = closest,
                     .question_size = sizeof *positions,
                     .answer_size = sizeof *closest,
                     .count = count,
                     .bound = bound > 0 ? bound : INFINITY};
    return ask(mesh, b, 1, MOST_QUESTIONS);
}

fm_result fm_gpu_mesh_cast(fm_mesh *mesh, const fm_mesh_ray *rays, uint32_t count, bool any, fm_mesh_hit *hits) {
    const uint32_t constants[] = {any ? FM_QUERY_ANY : FM_QUERY_FIRST};
    const batch b = {.dispatch = {.kernel = FM_KERNEL_MESH_QUERY, .constants = constants, .constant_count = 1},
                     .questions = rays,
                     .answers = hits,
                     .question_size = sizeof *rays,
                     .answer_size = sizeof *hits,
                     .count = count};
    return ask(mesh, b, 1, MOST_QUESTIONS);
}

fm_result fm_gpu_mesh_winding(fm_mesh *mesh, const float (*positions)[3], uint32_t count, float accuracy, float *winding) {
    enum { DEFAULT_ACCURACY = 2 };
    // Of a position and a triangle, so that no dispatch holds a device up for long.
    const uint64_t MOST_PAIRS = UINT64_C(1) << 34;
    const bool every = isinf(accuracy);
    const uint32_t constants[] = {every};
    const batch b = {.dispatch = {.kernel = FM_KERNEL_MESH_WINDING, .constants = constants, .constant_count = 1},
                     .questions = positions,
                     .answers = winding,
                     .question_size = sizeof *positions,
                     .answer_size = sizeof *winding,
                     .count = count,
                     .bound = accuracy > 0 ? accuracy : DEFAULT_ACCURACY,
                     .moments = !every};
    return ask(mesh, b, every ? THREADS : 1, every ? MOST_PAIRS / fm_max_u64(mesh->triangle_count, 1) : MOST_QUESTIONS);
}
