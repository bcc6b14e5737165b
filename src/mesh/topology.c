// SPDX-License-Identifier: MIT
#include "mesh/topology.h"

#include "mesh/exact.h"

#include <float.h>
#include <stdlib.h>
#include <string.h>

// Triangles that take part in nothing are in no edge, and neither are those of which two corners are one place: what such a
// triangle would join is joined already.
typedef struct half_edge {
    uint32_t other;  // the end with the greater number
    uint32_t triangle;
} half_edge;

typedef struct builder {
    const fm_mesh *mesh;
    fm_topology *topology;
    uint64_t slots;   // of the hash tables, a power of two
    uint32_t *table;  // first vertices, later triangles
    uint32_t *parts;  // union-find over positions
    uint64_t *starts;
    half_edge *edges;
} builder;

static uint32_t bits_of(float x) {
    uint32_t bits;
    x = x == 0 ? 0 : x;
    memcpy(&bits, &x, sizeof bits);
    return bits;
}

static uint64_t hash3(uint32_t a, uint32_t b, uint32_t c) {
    uint64_t hash = (a | (uint64_t)b << 32) * UINT64_C(0x9e3779b97f4a7c15);
    hash = (hash ^ hash >> 29 ^ c) * UINT64_C(0xbf58476d1ce4e5b9);
    return hash ^ hash >> 32;
}

static uint64_t slots_for(uint64_t count) {
    uint64_t slots = 16;
    while (slots < 2 * count) {
        slots *= 2;
    }
    return slots;
}

// Numbers the positions in the order of the vertices.
static void weld(builder *b) {
    const fm_mesh *mesh = b->mesh;
    fm_topology *topology = b->topology;
    memset(b->table, 0xff, b->slots * sizeof *b->table);
    for (uint32_t i = 0; i < mesh->vertex_count; i++) {
        const float *p = mesh->vertices[i];
        const uint32_t x = bits_of(p[0]), y = bits_of(p[1]), z = bits_of(p[2]);
        uint64_t slot = hash3(x, y, z) & (b->slots - 1);
        for (; b->table[slot] != UINT32_MAX; slot = (slot + 1) & (b->slots - 1)) {
            const float *q = mesh->vertices[b->table[slot]];
            if (bits_of(q[0]) == x && bits_of(q[1]) == y && bits_of(q[2]) == z) {
                break;
            }
        }
        if (b->table[slot] == UINT32_MAX) {
            b->table[slot] = i;
            topology->distinct[i] = (uint32_t)topology->positions++;
        } else {
            topology->distinct[i] = topology->distinct[b->table[slot]];
        }
    }
}

static void places_of(const fm_mesh *mesh, const fm_topology *topology, uint64_t triangle, uint32_t places[3]) {
    for (int k = 0; k < 3; k++) {
        places[k] = topology->distinct[mesh->triangles[triangle][k]];
    }
}

static bool has_edges(const fm_mesh *mesh, const fm_topology *topology, uint64_t triangle, uint32_t places[3]) {
    places_of(mesh, topology, triangle, places);
    return places[0] != places[1] && places[1] != places[2] && places[2] != places[0] && fm_triangle_fits(mesh, triangle);
}

static void sort3(const uint32_t from[3], uint32_t to[3]) {
    const uint32_t low = from[0] < from[1] ? from[0] : from[1], high = from[0] < from[1] ? from[1] : from[0];
    to[0] = from[2] < low ? from[2] : low;
    to[1] = from[2] < low ? low : from[2] < high ? from[2] : high;
    to[2] = from[2] > high ? from[2] : high;
}

static void count_duplicates(builder *b) {
    const fm_mesh *mesh = b->mesh;
    memset(b->table, 0xff, b->slots * sizeof *b->table);
    for (uint32_t i = 0; i < mesh->triangle_count; i++) {
        uint32_t places[3], sorted[3], others[3];
        if (!has_edges(mesh, b->topology, i, places)) {
            continue;
        }
        sort3(places, sorted);
        uint64_t slot = hash3(sorted[0], sorted[1], sorted[2]) & (b->slots - 1);
        for (; b->table[slot] != UINT32_MAX; slot = (slot + 1) & (b->slots - 1)) {
            places_of(mesh, b->topology, b->table[slot], places);
            sort3(places, others);
            if (memcmp(sorted, others, sizeof sorted) == 0) {
                break;
            }
        }
        b->topology->info.duplicate += b->table[slot] != UINT32_MAX;
        b->table[slot] = b->table[slot] == UINT32_MAX ? i : b->table[slot];
    }
}

static uint32_t part_of(uint32_t *parts, uint32_t place) {
    while (parts[place] != place) {
        parts[place] = parts[parts[place]];
        place = parts[place];
    }
    return place;
}

static void count_components(builder *b) {
    fm_mesh_info *info = &b->topology->info;
    const uint64_t positions = b->topology->positions;
    uint32_t *parts = b->parts, places[3];
    for (uint32_t i = 0; i < positions; i++) {
        parts[i] = i;
    }
    for (uint64_t i = 0; i < b->mesh->triangle_count; i++) {
        if (!fm_triangle_fits(b->mesh, i)) {
            continue;
        }
        places_of(b->mesh, b->topology, i, places);
        for (int k = 1; k < 3; k++) {
            const uint32_t one = part_of(parts, places[0]), other = part_of(parts, places[k]);
            parts[one > other ? one : other] = one > other ? other : one;
        }
    }
    // The starts of edges are not in use yet: which positions triangles name, and which parts.
    memset(b->starts, 0, (positions + 1) * sizeof *b->starts);
    for (uint64_t i = 0; i < b->mesh->triangle_count; i++) {
        const bool fits = fm_triangle_fits(b->mesh, i);
        places_of(b->mesh, b->topology, i, places);
        for (int k = 0; k < 3; k++) {
            b->starts[places[k]] |= fits ? 3 : 1;
        }
    }
    for (uint32_t i = 0; i < positions; i++) {
        info->distinct += b->starts[i] & 1;
        info->components += (b->starts[i] & 2) && parts[i] == i;
    }
}

static void count_unused(builder *b) {
    const fm_mesh *mesh = b->mesh;
    fm_mesh_info *info = &b->topology->info;
    memset(b->table, 0, mesh->vertex_count * sizeof *b->table);
    for (uint64_t i = 0; i < mesh->triangle_count; i++) {
        for (int k = 0; k < 3; k++) {
            b->table[mesh->triangles[i][k]] = 1;
        }
    }
    for (uint64_t i = 0; i < mesh->vertex_count; i++) {
        info->unused += !b->table[i];
    }
}

static int by_other(const void *one, const void *another) {
    const half_edge *a = one, *b = another;
    return a->other != b->other ? (a->other > b->other) - (a->other < b->other)
                                : (a->triangle > b->triangle) - (a->triangle < b->triangle);
}

static void sort_edges(half_edge *edges, uint64_t count) {
    if (count > 64) {
        qsort(edges, count, sizeof *edges, by_other);
        return;
    }
    for (uint64_t i = 1; i < count; i++) {
        const half_edge moved = edges[i];
        uint64_t at = i;
        for (; at > 0 && by_other(&moved, &edges[at - 1]) < 0; at--) {
            edges[at] = edges[at - 1];
        }
        edges[at] = moved;
    }
}

// Number of the triangle's edge between two places, and whether the triangle runs from the first to the second.
static int edge_between(const builder *b, uint32_t triangle, uint32_t place, uint32_t other, bool *forward) {
    uint32_t places[3];
    places_of(b->mesh, b->topology, triangle, places);
    int k = 0;
    while (places[k] == place || places[k] == other) {
        k++;
    }
    *forward = places[(k + 1) % 3] == place;
    return (k + 1) % 3;
}

static void classify_edges(builder *b, uint32_t place, const half_edge *edges, uint64_t count) {
    fm_mesh_info *info = &b->topology->info;
    uint32_t(*across)[3] = b->topology->across;
    for (uint64_t i = 0, end; i < count; i = end) {
        for (end = i + 1; end < count && edges[end].other == edges[i].other; end++) {
        }
        info->boundary += end - i == 1;
        info->non_manifold += end - i > 2;
        if (end - i == 2) {
            const uint32_t one = edges[i].triangle, other = edges[i + 1].triangle;
            bool one_forward, other_forward;
            across[one][edge_between(b, one, place, edges[i].other, &one_forward)] = other;
            across[other][edge_between(b, other, place, edges[i].other, &other_forward)] = one;
            info->misoriented += one_forward == other_forward;
        }
    }
}

// A list of each position's edges to positions of greater number.
static void join_edges(builder *b) {
    const fm_mesh *mesh = b->mesh;
    const uint64_t positions = b->topology->positions;
    uint32_t places[3];
    memset(b->topology->across, 0xff, mesh->triangle_count * sizeof *b->topology->across);
    memset(b->starts, 0, (positions + 1) * sizeof *b->starts);
    for (uint64_t i = 0; i < mesh->triangle_count; i++) {
        for (int k = 0; has_edges(mesh, b->topology, i, places) && k < 3; k++) {
            const uint32_t from = places[k], to = places[(k + 1) % 3];
            b->starts[from < to ? from : to]++;
        }
    }
    uint64_t total = 0;
    for (uint64_t i = 0; i <= positions; i++) {
        const uint64_t count = b->starts[i];
        b->starts[i] = total;
        total += count;
    }
    for (uint64_t i = 0; i < mesh->triangle_count; i++) {
        for (int k = 0; has_edges(mesh, b->topology, i, places) && k < 3; k++) {
            const uint32_t from = places[k], to = places[(k + 1) % 3];
            b->edges[b->starts[from < to ? from : to]++] = (half_edge){from < to ? to : from, (uint32_t)i};
        }
    }
    // Each start is the end of its list now.
    for (uint32_t i = 0; i < positions; i++) {
        const uint64_t first = i > 0 ? b->starts[i - 1] : 0;
        sort_edges(b->edges + first, b->starts[i] - first);
        classify_edges(b, i, b->edges + first, b->starts[i] - first);
    }
}

static double dot(const double a[3], const double b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

// The cross product of two edges, of twice the triangle's area as its length.
static void scaled_normal(const fm_mesh *mesh, uint64_t triangle, double normal[3]) {
    const uint32_t *corners = mesh->triangles[triangle];
    double ab[3], ac[3];
    for (int axis = 0; axis < 3; axis++) {
        ab[axis] = (double)mesh->vertices[corners[1]][axis] - mesh->vertices[corners[0]][axis];
        ac[axis] = (double)mesh->vertices[corners[2]][axis] - mesh->vertices[corners[0]][axis];
    }
    normal[0] = ab[1] * ac[2] - ab[2] * ac[1];
    normal[1] = ab[2] * ac[0] - ab[0] * ac[2];
    normal[2] = ab[0] * ac[1] - ab[1] * ac[0];
}

// Box, area and volume; the latter seen from the middle of the box, so that a mesh far away loses nothing.
static void measure(const fm_mesh *mesh, fm_mesh_info *info) {
    info->degenerate = 0;
    info->area = info->volume = 0;
    for (int axis = 0; axis < 3; axis++) {
        info->low[axis] = FLT_MAX;
        info->high[axis] = -FLT_MAX;
    }
    for (uint64_t i = 0; i < mesh->triangle_count; i++) {
        if (!fm_triangle_fits(mesh, i)) {
            continue;
        }
        const uint32_t *corners = mesh->triangles[i];
        info->degenerate += fm_collinear(mesh->vertices[corners[0]], mesh->vertices[corners[1]], mesh->vertices[corners[2]]);
        for (int k = 0; k < 3; k++) {
            for (int axis = 0; axis < 3; axis++) {
                const float x = mesh->vertices[corners[k]][axis];
                info->low[axis] = x < info->low[axis] ? x : info->low[axis];
                info->high[axis] = x > info->high[axis] ? x : info->high[axis];
            }
        }
    }
    for (uint64_t i = 0; i < mesh->triangle_count; i++) {
        if (!fm_triangle_fits(mesh, i)) {
            continue;
        }
        double normal[3], corner[3];
        scaled_normal(mesh, i, normal);
        info->area += 0.5 * sqrt(dot(normal, normal));
        for (int axis = 0; axis < 3; axis++) {
            const double middle = 0.5 * ((double)info->low[axis] + info->high[axis]);
            corner[axis] = mesh->vertices[mesh->triangles[i][0]][axis] - middle;
        }
        info->volume += dot(normal, corner) / 6;
    }
    info->volume = info->closed ? info->volume : 0;
}

static uint64_t dropped_words(const fm_mesh *mesh) {
    return fm_div_up(mesh->triangle_count, 32);
}

static void note_dropped(const fm_mesh *mesh, fm_topology *topology) {
    memset(topology->dropped, 0, dropped_words(mesh) * sizeof *topology->dropped);
    for (uint64_t i = 0; i < mesh->triangle_count; i++) {
        const bool fits = fm_triangle_fits(mesh, i);
        topology->info.dropped += !fits;
        topology->dropped[i / 32] |= (uint32_t)!fits << i % 32;
    }
}

static bool drops_the_same(const fm_mesh *mesh, const fm_topology *topology) {
    for (uint64_t i = 0; i < mesh->triangle_count; i++) {
        if (fm_triangle_fits(mesh, i) == (topology->dropped[i / 32] >> i % 32 & 1)) {
            return false;
        }
    }
    return true;
}

static void fill(builder *b) {
    fm_mesh_info *info = &b->topology->info;
    info->vertices = b->mesh->vertex_count;
    info->triangles = b->mesh->triangle_count;
    note_dropped(b->mesh, b->topology);
    weld(b);
    count_duplicates(b);
    count_unused(b);
    count_components(b);
    join_edges(b);
    const bool whole = info->boundary == 0 && info->non_manifold == 0 && info->misoriented == 0;
    info->closed = whole && info->triangles > info->dropped;
}

static void free_topology(fm_context *context, const fm_mesh *mesh, fm_topology *topology) {
    if (!topology) {
        return;
    }
    fm_mesh_free(context, topology->dropped, dropped_words(mesh) * sizeof *topology->dropped);
    fm_mesh_free(context, topology->distinct, mesh->vertex_count * sizeof *topology->distinct);
    fm_mesh_free(context, topology->across, mesh->triangle_count * sizeof *topology->across);
    fm_mesh_free(context, topology->corner_normals, topology->positions * sizeof *topology->corner_normals);
    fm_mesh_free(context, topology, sizeof *topology);
}

void fm_topology_destroy(fm_mesh *mesh) {
    free_topology(mesh->context, mesh, mesh->topology);
    mesh->topology = NULL;
}

// Takes the place of what there was, which stays if memory runs out.
static fm_result make(fm_mesh *mesh) {
    fm_context *context = mesh->context;
    const uint64_t vertices = mesh->vertex_count, triangles = mesh->triangle_count;
    fm_topology *topology = fm_mesh_alloc_zero(context, sizeof *topology, "a mesh's topology");
    if (!topology) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    builder b = {.mesh = mesh, .topology = topology, .slots = slots_for(fm_max_u64(vertices, triangles))};
    topology->dropped = fm_mesh_alloc(context, dropped_words(mesh) * sizeof *topology->dropped, "a mesh's dropped triangles");
    topology->distinct = fm_mesh_alloc(context, vertices * sizeof *topology->distinct, "a mesh's positions");
    topology->across = fm_mesh_alloc(context, triangles * sizeof *topology->across, "a mesh's neighbours");
    b.table = fm_mesh_alloc(context, b.slots * sizeof *b.table, "a table of positions");
    b.parts = fm_mesh_alloc(context, vertices * sizeof *b.parts, "a mesh's parts");
    b.starts = fm_mesh_alloc(context, (vertices + 1) * sizeof *b.starts, "a mesh's edges");
    b.edges = fm_mesh_alloc(context, 3 * triangles * sizeof *b.edges, "a mesh's edges");
    const bool good = topology->dropped && topology->distinct && topology->across && b.table && b.parts && b.starts && b.edges;
    if (good) {
        fill(&b);
        topology->edition = mesh->topology ? mesh->topology->edition + 1 : 1;
        topology->checked_version = mesh->host_version;
        fm_topology_destroy(mesh);
        mesh->topology = topology;
    } else {
        free_topology(context, mesh, topology);
    }
    fm_mesh_free(context, b.table, b.slots * sizeof *b.table);
    fm_mesh_free(context, b.parts, vertices * sizeof *b.parts);
    fm_mesh_free(context, b.starts, (vertices + 1) * sizeof *b.starts);
    fm_mesh_free(context, b.edges, 3 * triangles * sizeof *b.edges);
    return good ? FM_OK : FM_ERROR_OUT_OF_HOST_MEMORY;
}

fm_result fm_topology_prepare(fm_mesh *mesh) {
    fm_topology *topology = mesh->topology;
    if (topology && topology->checked_version == mesh->host_version) {
        return FM_OK;
    }
    if (!topology || !drops_the_same(mesh, topology)) {
        return make(mesh);
    }
    topology->checked_version = mesh->host_version;
    return FM_OK;
}

fm_result fm_mesh_describe(fm_mesh *mesh, fm_mesh_info *info) {
    if (!mesh || !info) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "%s is NULL", mesh ? "info" : "mesh");
    }
    FM_TRY(fm_topology_prepare(mesh));
    fm_topology *topology = mesh->topology;
    if (topology->measured_version != mesh->host_version + 1) {
        measure(mesh, &topology->info);
        topology->measured_version = mesh->host_version + 1;
    }
    *info = topology->info;
    return FM_OK;
}
