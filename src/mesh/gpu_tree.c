// SPDX-License-Identifier: MIT
// A mesh's tree on Vulkan: Morton codes of the triangles' centres, a radix sort of them, and nodes with their boxes from the sorted
// codes. A refit makes nodes and boxes anew from codes that are kept. Nothing is asked of the host in between.

#include "mesh/gpu_tree.h"

#include <assert.h>

// Parts of the buffer `build`, by offset.
typedef struct build_layout {
    uint64_t box, keys, numbers, keys_to, numbers_to, counts, meetings, bytes;
    uint32_t runs, run_tiles;
} build_layout;

static build_layout layout_of(uint64_t triangles) {
    enum { BOX_BYTES = 32 };
    build_layout l = {0};
    const uint64_t tiles = fm_max_u64(fm_div_up(triangles, FM_SORT_TILE), 1);
    l.run_tiles = (uint32_t)fm_div_up(tiles, FM_SORT_MOST_RUNS);
    l.runs = (uint32_t)fm_div_up(tiles, l.run_tiles);
    const uint64_t words = fm_round_up(4 * triangles, 16);
    l.keys = BOX_BYTES;
    l.numbers = l.keys + words;
    l.keys_to = l.numbers + words;
    l.numbers_to = l.keys_to + words;
    l.meetings = l.numbers_to + words;
    l.counts = l.meetings + words;
    l.bytes = l.counts + 4 * (uint64_t)FM_SORT_DIGITS * (l.runs + 1);
    return l;
}

uint64_t fm_gpu_tree_build_bytes(uint64_t triangles) {
    return layout_of(triangles).bytes;
}

static fm_result dispatch(const struct fm_gpu_mesh *own, fm_slot *slot, fm_kernel kernel, const fm_tree_push *push,
                          uint64_t groups) {
    const fm_dispatch d = {.kernel = kernel, .push = push, .push_bytes = sizeof *push, .groups = groups};
    FM_TRY(fm_commands_dispatch(own->gpu, slot, &d));
    fm_commands_barrier(own->gpu, slot);
    return FM_OK;
}

static fm_result record_keys(const struct fm_gpu_mesh *own, fm_slot *slot, const fm_tree_push *push, const build_layout *l) {
    enum { MOST_GROUPS = 1024 };
    const uint64_t groups = fm_div_up(push->mesh.triangle_count, FM_TREE_THREADS);
    fm_commands_fill(own->gpu, slot, own->build, l->box, 12, UINT32_MAX);
    fm_commands_fill(own->gpu, slot, own->build, l->box + 12, 12, 0);
    fm_commands_barrier(own->gpu, slot);
    FM_TRY(dispatch(own, slot, FM_KERNEL_TREE_BOUNDS, push, fm_min_u64(groups, MOST_GROUPS)));
    return dispatch(own, slot, FM_KERNEL_TREE_CODES, push, groups);
}

static fm_result record_sort(const struct fm_gpu_mesh *own, fm_slot *slot, fm_tree_push push) {
    enum { DIGIT_BITS = 8 };
    // An even number of passes: the sorted keys lie where the others did.
    static_assert(FM_KEY_BITS % (2 * DIGIT_BITS) == 0, "keys change places once a pass");
    for (push.shift = 0; push.shift < FM_KEY_BITS; push.shift += DIGIT_BITS) {
        FM_TRY(dispatch(own, slot, FM_KERNEL_TREE_COUNT, &push, push.runs));
        FM_TRY(dispatch(own, slot, FM_KERNEL_TREE_SCAN, &push, FM_SORT_DIGITS));
        FM_TRY(dispatch(own, slot, FM_KERNEL_TREE_SCATTER, &push, push.runs));
        const fm_address keys = push.keys, numbers = push.numbers;
        push.keys = push.keys_to;
        push.numbers = push.numbers_to;
        push.keys_to = keys;
        push.numbers_to = numbers;
    }
    return FM_OK;
}

// The bytes that each kernel's comment counts.
static uint64_t pass_bytes(const fm_mesh *mesh, bool build) {
    enum { LINK = 24 + 48 + 96 + 12, KEYS = 12 + 12 + 8, SORT = (FM_KEY_BITS / 8) * (4 + 16) };
    return mesh->triangle_count * (LINK + (build ? KEYS + SORT : 0)) + 12 * mesh->vertex_count * (build ? 3 : 1);
}

static fm_tree_push push_of(const fm_mesh *mesh, const build_layout *l) {
    const struct fm_gpu_mesh *own = mesh->gpu;
    const fm_address base = fm_buffer_address(own->build);
    return (fm_tree_push){.mesh = fm_gpu_mesh_refs(mesh),
                          .box = base + l->box,
                          .keys = base + l->keys,
                          .numbers = base + l->numbers,
                          .keys_to = base + l->keys_to,
                          .numbers_to = base + l->numbers_to,
                          .counts = base + l->counts,
                          .meetings = base + l->meetings,
                          .moments = own->moments ? fm_buffer_address(own->moments) : 0,
                          .runs = l->runs,
                          .run_tiles = l->run_tiles};
}

// A kernel that climbs from every triangle.
static fm_result record_climb(const struct fm_gpu_mesh *own, fm_slot *slot, fm_kernel kernel, const fm_tree_push *push,
                              const build_layout *l) {
    const uint64_t triangles = push->mesh.triangle_count;
    fm_commands_fill(own->gpu, slot, own->build, l->meetings, 4 * triangles, FM_GPU_NONE);
    fm_commands_barrier(own->gpu, slot);
    fm_device_info info;
    fm_gpu_describe(own->gpu, &info);
    const uint32_t constants[] = {info.kind != FM_DEVICE_SOFTWARE};
    const fm_dispatch d = {.kernel = kernel,
                           .constants = constants,
                           .constant_count = 1,
                           .push = push,
                           .push_bytes = sizeof *push,
                           .groups = fm_max_u64(fm_div_up(triangles, FM_TREE_THREADS), 1)};
    FM_TRY(fm_commands_dispatch(own->gpu, slot, &d));
    fm_commands_barrier(own->gpu, slot);
    return FM_OK;
}

static fm_result record(const fm_mesh *mesh, fm_slot *slot, bool build) {
    const struct fm_gpu_mesh *own = mesh->gpu;
    const build_layout l = layout_of(mesh->triangle_count);
    const fm_tree_push push = push_of(mesh, &l);
    if (build && mesh->triangle_count > 1) {
        FM_TRY(record_keys(own, slot, &push, &l));
        FM_TRY(record_sort(own, slot, push));
    } else if (build) {
        fm_commands_fill(own->gpu, slot, own->build, l.numbers, 4 * mesh->triangle_count, 0);
    }
    FM_TRY(record_climb(own, slot, FM_KERNEL_TREE_LINK, &push, &l));
    fm_commands_pass(own->gpu, slot, "tree", pass_bytes(mesh, build));
    return FM_OK;
}

fm_result fm_gpu_mesh_tree(fm_mesh *mesh, fm_slot *slot, bool refit) {
    struct fm_gpu_mesh *own = mesh->gpu;
    const uint64_t now = mesh->version + 1;
    if (own->fitted == now) {
        return FM_OK;
    }
    const bool build = !refit || own->built <= mesh->rebuild_version;
    const fm_result status = record(mesh, slot, build);
    if (status != FM_OK) {
        fm_gpu_mesh_forget(mesh);
        return status;
    }
    own->fitted = now;
    own->built = build ? now : own->built;
    return FM_OK;
}

fm_result fm_gpu_mesh_moments(fm_mesh *mesh, fm_slot *slot) {
    struct fm_gpu_mesh *own = mesh->gpu;
    const uint64_t now = mesh->version + 1;
    if (own->moments_of == now) {
        return FM_OK;
    }
    if (!own->moments) {
        const uint64_t bytes = fm_max_u64(mesh->triangle_count, 1) * 2 * FM_MOMENT_BYTES;
        FM_TRY(fm_buffer_create(own->gpu, FM_PURPOSE_MESHES, bytes, false, &own->moments));
    }
    enum { MOVED = 48 + 8 + 12 + 48 + 192 };
    const build_layout l = layout_of(mesh->triangle_count);
    const fm_tree_push push = push_of(mesh, &l);
    FM_TRY(record_climb(own, slot, FM_KERNEL_TREE_MOMENTS, &push, &l));
    fm_commands_pass(own->gpu, slot, "moments", mesh->triangle_count * MOVED);
    own->moments_of = now;
    return FM_OK;
}
