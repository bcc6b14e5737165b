// SPDX-License-Identifier: MIT
// What is joined to what, on the device: from the host's topology, again when that is made anew. Normals follow the vertices, by a
// kernel.

#include "mesh/gpu_tree.h"
#include "mesh/topology.h"

#include <string.h>

// The buffer's content, in host memory. Its parts lie behind the struct of their addresses; here those are offsets.
typedef struct content {
    fm_joints at;
    uint64_t bytes;
    char *memory;
} content;

static uint32_t *words(const content *c, fm_address offset) {
    return (uint32_t *)(c->memory + offset);
}

static bool is_open(const fm_mesh *mesh, uint64_t triangle, int edge) {
    const uint32_t *vertices = mesh->triangles[triangle];
    const uint32_t *distinct = mesh->topology->distinct;
    return mesh->topology->across[triangle][edge] == FM_NO_TRIANGLE && fm_triangle_fits(mesh, triangle) &&
           distinct[vertices[edge]] != distinct[vertices[(edge + 1) % 3]];
}

static uint32_t count_open(const fm_mesh *mesh) {
    uint64_t count = 0;
    for (uint64_t i = 0; i < 3 * mesh->triangle_count; i++) {
        count += is_open(mesh, i / 3, (int)(i % 3));
    }
    return (uint32_t)fm_min_u64(count, UINT32_MAX);
}

static fm_result lay_out(const fm_mesh *mesh, content *c) {
    const uint64_t corners = fm_round_up(12 * mesh->triangle_count, 16), positions = mesh->topology->positions;
    c->at = (fm_joints){.position_count = (uint32_t)positions, .open_count = count_open(mesh)};
    c->at.across = fm_round_up(sizeof c->at, 16);
    c->at.places = c->at.across + corners;
    c->at.starts = c->at.places + corners;
    c->at.lists = c->at.starts + fm_round_up(4 * (positions + 1), 16);
    c->at.open_edges = c->at.lists + corners;
    c->at.normals = c->at.open_edges + fm_round_up(8 * (uint64_t)c->at.open_count, 16);
    c->bytes = c->at.normals;
    c->memory = fm_alloc_zero(&mesh->context->allocator, c->bytes, "what a mesh joins");
    return c->memory ? FM_OK : FM_ERROR_OUT_OF_HOST_MEMORY;
}

// Whether corner k is the first of the triangle at its position.
static bool is_first(const uint32_t places[3], int k) {
    return !(k > 0 && places[k] == places[0]) && !(k > 1 && places[k] == places[1]);
}

static void list_triangles(const fm_mesh *mesh, const content *c) {
    const uint32_t *places = words(c, c->at.places);
    uint32_t *starts = words(c, c->at.starts), *lists = words(c, c->at.lists);
    const uint64_t corners = 3 * mesh->triangle_count;
    // A position's start is counted one place ahead; while the lists are filled it moves on to its end, the next one's start.
    for (uint64_t i = 0; i < corners; i++) {
        if (is_first(places + i / 3 * 3, (int)(i % 3)) && places[i] + 2 <= c->at.position_count) {
            starts[places[i] + 2]++;
        }
    }
    for (uint64_t i = 2; i <= c->at.position_count; i++) {
        starts[i] += starts[i - 1];
    }
    for (uint64_t i = 0; i < corners; i++) {
        if (is_first(places + i / 3 * 3, (int)(i % 3))) {
            lists[starts[places[i] + 1]++] = (uint32_t)(i / 3);
        }
    }
}

static void fill(const fm_mesh *mesh, const content *c) {
    const fm_topology *topology = mesh->topology;
    uint32_t *places = words(c, c->at.places), *open = words(c, c->at.open_edges);
    memcpy(words(c, c->at.across), topology->across, 12 * mesh->triangle_count);
    for (uint64_t i = 0; i < 3 * mesh->triangle_count; i++) {
        places[i] = topology->distinct[mesh->triangles[i / 3][i % 3]];
        if (is_open(mesh, i / 3, (int)(i % 3))) {
            *open++ = mesh->triangles[i / 3][i % 3];
            *open++ = mesh->triangles[i / 3][(i + 1) % 3];
        }
    }
    list_triangles(mesh, c);
}

static fm_result upload(struct fm_gpu_mesh *own, content *c, uint64_t edition) {
    FM_TRY(fm_buffer_create(own->gpu, FM_PURPOSE_MESHES, c->bytes + 16 * fm_max_u64(c->at.position_count, 1), false, &own->joints));
    const fm_address base = fm_buffer_address(own->joints);
    fm_joints *at = (fm_joints *)(void *)c->memory;
    *at = (fm_joints){.across = base + c->at.across,
                      .places = base + c->at.places,
                      .starts = base + c->at.starts,
                      .lists = base + c->at.lists,
                      .normals = base + c->at.normals,
                      .open_edges = base + c->at.open_edges,
                      .position_count = c->at.position_count,
                      .open_count = c->at.open_count};
    const fm_result status = fm_buffer_upload_at(own->joints, 0, c->memory, c->bytes);
    if (status != FM_OK) {
        fm_buffer_destroy(own->joints);
        own->joints = NULL;
    }
    own->positions = c->at.position_count;
    own->joints_of = edition;
    return status;
}

fm_result fm_gpu_mesh_joints(fm_mesh *mesh) {
    struct fm_gpu_mesh *own = mesh->gpu;
    FM_TRY(fm_topology_prepare(mesh));
    if (own->joints && own->joints_of == mesh->topology->edition) {
        return FM_OK;
    }
    if (own->joints) {
        FM_TRY(fm_gpu_wait(own->gpu, fm_gpu_newest(own->gpu)));
        fm_buffer_destroy(own->joints);
        own->joints = NULL;
        own->normals_of = 0;
    }
    content c;
    FM_TRY(lay_out(mesh, &c));
    fill(mesh, &c);
    const fm_result status = upload(own, &c, mesh->topology->edition);
    fm_free(&mesh->context->allocator, c.memory, c.bytes);
    return status;
}

fm_result fm_gpu_mesh_normals(fm_mesh *mesh, fm_slot *slot) {
    enum { THREADS = 64, MOVED = 3 * 4 + 12 };
    struct fm_gpu_mesh *own = mesh->gpu;
    const uint64_t now = mesh->version + 1;
    if (own->normals_of == now || own->positions == 0) {
        return FM_OK;
    }
    const fm_normals_push push = {.mesh = fm_gpu_mesh_refs(mesh), .joints = fm_buffer_address(own->joints)};
    const fm_dispatch dispatch = {
        .kernel = FM_KERNEL_MESH_NORMALS, .push = &push, .push_bytes = sizeof push, .groups = fm_div_up(own->positions, THREADS)};
    FM_TRY(fm_commands_dispatch(own->gpu, slot, &dispatch));
    fm_commands_pass(own->gpu, slot, "normals", mesh->triangle_count * MOVED + own->positions * UINT64_C(28));
    own->normals_of = now;
    return FM_OK;
}
