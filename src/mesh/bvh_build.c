// SPDX-License-Identifier: MIT
// Builds the tree: two children a node by the surface area heuristic over bins, then eight.
// Source: Wald 2007, "On fast construction of SAH-based bounding volume hierarchies".

#include "mesh/bvh_layout.h"

#include <float.h>
#include <string.h>

enum { BINS = 16, SERIAL = 2048 };  // triangles that are not worth a thread of their own

typedef struct box {
    float low[3], high[3];
} box;

typedef struct item {
    box box;
    uint32_t triangle;
} item;

// Nodes of two children. A range of n items has room for 2 n - 1 of them: its own, and what `room` of its task is the start of.
typedef struct pair_node {
    box box;
    uint32_t first, count;  // items of a leaf; count 0: the children are pairs `first` and `second`
    uint32_t second;
} pair_node;

typedef struct task {
    uint32_t node, first, count, depth, room;
} task;

typedef struct build {
    const fm_mesh *mesh;
    fm_bvh *bvh;
    item *items;
    pair_node *pairs;
    task *tasks;
    uint32_t task_count;
    uint32_t item_count;
} build;

static const box EMPTY = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};

static inline void grow(box *b, const box *by) {
    for (int axis = 0; axis < 3; axis++) {
        b->low[axis] = by->low[axis] < b->low[axis] ? by->low[axis] : b->low[axis];
        b->high[axis] = by->high[axis] > b->high[axis] ? by->high[axis] : b->high[axis];
    }
}

static inline float half_area(const box *b) {
    const float x = b->high[0] - b->low[0], y = b->high[1] - b->low[1], z = b->high[2] - b->low[2];
    return x < 0 ? 0 : x * y + y * z + z * x;
}

// Twice the middle.
static inline float middle(const item *i, int axis) {
    return i->box.low[axis] + i->box.high[axis];
}

static box box_of_triangle(const fm_mesh *mesh, uint32_t triangle) {
    box b = EMPTY;
    for (int k = 0; k < 3; k++) {
        const float *p = mesh->vertices[mesh->triangles[triangle][k]];
        const box point = {{p[0], p[1], p[2]}, {p[0], p[1], p[2]}};
        grow(&b, &point);
    }
    return b;
}

// ---------------------------------------------------------------------------------------------------------------------------
// Splitting
// ---------------------------------------------------------------------------------------------------------------------------

typedef struct bin {
    box box;
    uint32_t count;
} bin;

typedef struct binning {
    float low[3], scale[3];  // bin = (middle - low) scale
} binning;

static inline int bin_of(const binning *by, const item *i, int axis) {
    const int number = (int)((middle(i, axis) - by->low[axis]) * by->scale[axis]);
    return number < BINS - 1 ? number : BINS - 1;
}

// False when all middles are one.
static bool choose_bins(const item *items, uint32_t count, binning *by) {
    float low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (uint32_t i = 0; i < count; i++) {
        for (int axis = 0; axis < 3; axis++) {
            const float m = middle(&items[i], axis);
            low[axis] = m < low[axis] ? m : low[axis];
            high[axis] = m > high[axis] ? m : high[axis];
        }
    }
    bool any = false;
    for (int axis = 0; axis < 3; axis++) {
        // The reciprocal of a tiny extent is infinite.
        const float scale = BINS / (high[axis] - low[axis]);
        by->low[axis] = low[axis];
        by->scale[axis] = scale <= FLT_MAX ? scale : 0;
        any |= by->scale[axis] > 0;
    }
    return any;
}

// Leaves hold eight triangles at the price of one.
static inline float price(const box *b, uint32_t count) {
    return half_area(b) * (float)((count + FM_BVH_WIDTH - 1) / FM_BVH_WIDTH);
}

// The cheapest of the splits along an axis: behind bin `*at`.
static float cheapest(const bin *bins, int *at) {
    float behind[BINS], best = INFINITY;
    bin sum = {EMPTY, 0};
    for (int i = BINS - 1; i > 0; i--) {
        grow(&sum.box, &bins[i].box);
        sum.count += bins[i].count;
        behind[i] = sum.count > 0 ? price(&sum.box, sum.count) : INFINITY;
    }
    sum = (bin){EMPTY, 0};
    for (int i = 0; i + 1 < BINS; i++) {
        grow(&sum.box, &bins[i].box);
        sum.count += bins[i].count;
        const float both = sum.count > 0 ? price(&sum.box, sum.count) + behind[i + 1] : INFINITY;
        if (both < best) {
            best = both;
            *at = i;
        }
    }
    return best;
}

static uint32_t partition(item *items, uint32_t count, const binning *by, int axis, int at) {
    uint32_t i = 0, j = count;
    for (;;) {
        while (i < j && bin_of(by, &items[i], axis) <= at) {
            i++;
        }
        while (i < j && bin_of(by, &items[j - 1], axis) > at) {
            j--;
        }
        if (i >= j) {
            return i;
        }
        const item moved = items[i];
        items[i++] = items[--j];
        items[j] = moved;
    }
}

// How many of the items go to the first child; they are in front then.
static uint32_t split_items(item *items, uint32_t count, uint32_t depth) {
    binning by;
    if (depth >= FM_BVH_DEEP || !choose_bins(items, count, &by)) {
        return count / 2;
    }
    bin bins[3][BINS];
    for (int i = 0; i < 3 * BINS; i++) {
        bins[i / BINS][i % BINS] = (bin){EMPTY, 0};
    }
    for (uint32_t i = 0; i < count; i++) {
        for (int axis = 0; axis < 3; axis++) {
            bin *into = &bins[axis][bin_of(&by, &items[i], axis)];
            grow(&into->box, &items[i].box);
            into->count++;
        }
    }
    int axis = -1, at = 0;
    float best = INFINITY;
    for (int k = 0; k < 3; k++) {
        int here = 0;
        const float found = by.scale[k] > 0 ? cheapest(bins[k], &here) : INFINITY;
        if (found < best) {
            best = found;
            axis = k;
            at = here;
        }
    }
    const uint32_t front = axis < 0 ? 0 : partition(items, count, &by, axis, at);
    return front > 0 && front < count ? front : count / 2;
}

static box box_of_items(const item *items, uint32_t count) {
    box b = EMPTY;
    for (uint32_t i = 0; i < count; i++) {
        grow(&b, &items[i].box);
    }
    return b;
}

// Makes the node and returns whether it has children, which are to be made.
static bool make_node(build *b, const task *t, task children[2]) {
    pair_node *node = &b->pairs[t->node];
    item *items = b->items + t->first;
    node->box = box_of_items(items, t->count);
    if (t->count <= FM_BVH_WIDTH) {
        node->first = t->first;
        node->count = t->count;
        return false;
    }
    const uint32_t front = split_items(items, t->count, t->depth);
    children[0] = (task){t->room, t->first, front, t->depth + 1, t->room + 1};
    children[1] = (task){t->room + 2 * front - 1, t->first + front, t->count - front, t->depth + 1, t->room + 2 * front};
    node->first = children[0].node;
    node->second = children[1].node;
    node->count = 0;
    return true;
}

static void split_all(build *b, const task *t) {
    task children[2];
    if (make_node(b, t, children)) {
        split_all(b, &children[0]);
        split_all(b, &children[1]);
    }
}

static void split_tasks(void *user, uint64_t begin, uint64_t end, uint32_t worker) {
    (void)worker;
    build *b = user;
    for (uint64_t i = begin; i < end; i++) {
        split_all(b, &b->tasks[i]);
    }
}

// Splits the largest ranges until there are enough for all threads.
static void split_pairs(build *b, uint32_t most_tasks) {
    fm_pool *pool = b->mesh->context->pool;
    b->tasks[b->task_count++] = (task){0, 0, b->item_count, 0, 1};
    while (b->task_count > 0 && b->task_count < most_tasks) {
        uint32_t largest = 0;
        for (uint32_t i = 1; i < b->task_count; i++) {
            largest = b->tasks[i].count > b->tasks[largest].count ? i : largest;
        }
        if (b->tasks[largest].count <= SERIAL) {
            break;
        }
        task children[2];
        const task split = b->tasks[largest];
        make_node(b, &split, children);
        b->tasks[largest] = children[0];
        b->tasks[b->task_count++] = children[1];
    }
    fm_pool_run(pool, b->task_count, 1, split_tasks, b);
}

// ---------------------------------------------------------------------------------------------------------------------------
// Eight children
// ---------------------------------------------------------------------------------------------------------------------------

static uint32_t count_leaves(const build *b, uint32_t pair) {
    const pair_node *node = &b->pairs[pair];
    return node->count > 0 ? 1 : count_leaves(b, node->first) + count_leaves(b, node->second);
}

static void set_box(fm_bvh_node *node, int lane, const box *b) {
    for (int axis = 0; axis < 3; axis++) {
        node->low[axis][lane] = b->low[axis];
        node->high[axis][lane] = b->high[axis];
    }
}

// Up to eight descendants: the largest that has children gives way to them.
static int gather(const build *b, uint32_t pair, uint32_t descendants[FM_BVH_WIDTH]) {
    int count = 1;
    descendants[0] = pair;
    while (count < FM_BVH_WIDTH) {
        int largest = -1;
        float most = -1;
        for (int i = 0; i < count; i++) {
            const pair_node *node = &b->pairs[descendants[i]];
            if (node->count == 0 && half_area(&node->box) > most) {
                most = half_area(&node->box);
                largest = i;
            }
        }
        if (largest < 0) {
            break;
        }
        const pair_node *opened = &b->pairs[descendants[largest]];
        descendants[largest] = opened->first;
        descendants[count++] = opened->second;
    }
    return count;
}

static uint32_t widen(build *b, uint32_t pair) {
    uint32_t descendants[FM_BVH_WIDTH];
    const int count = gather(b, pair, descendants);
    const uint32_t number = b->bvh->node_count++;
    fm_bvh_node *node = &b->bvh->nodes[number];
    for (int i = 0; i < FM_BVH_WIDTH; i++) {
        set_box(node, i, i < count ? &b->pairs[descendants[i]].box : &EMPTY);
        node->child[i] = 0;
    }
    for (int i = 0; i < count; i++) {
        const pair_node *child = &b->pairs[descendants[i]];
        if (child->count == 0) {
            node->child[i] = widen(b, descendants[i]);
            continue;
        }
        fm_bvh_leaf *leaf = &b->bvh->leaves[b->bvh->leaf_count];
        for (uint32_t k = 0; k < FM_BVH_WIDTH; k++) {
            leaf->triangle[k] = b->items[child->first + (k < child->count ? k : child->count - 1)].triangle;
        }
        node->child[i] = FM_BVH_LEAF | b->bvh->leaf_count++;
    }
    return number;
}

// ---------------------------------------------------------------------------------------------------------------------------
// Leaves
// ---------------------------------------------------------------------------------------------------------------------------

static double dot(const double a[3], const double b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void cross(const double a[3], const double b[3], double c[3]) {
    c[0] = a[1] * b[2] - a[2] * b[1];
    c[1] = a[2] * b[0] - a[0] * b[2];
    c[2] = a[0] * b[1] - a[1] * b[0];
}

// Scales to length 1; false for length 0.
static bool normalise(double a[3]) {
    const double length = sqrt(dot(a, a));
    for (int axis = 0; axis < 3 && length > 0; axis++) {
        a[axis] /= length;
    }
    return length > 0;
}

static float reciprocal(double x) {
    return x > 1 / (double)FLT_MAX ? (float)(1 / x) : FLT_MAX;
}

static void place_triangle(const fm_mesh *mesh, fm_bvh_leaf *leaf, int lane) {
    const uint32_t *corners = mesh->triangles[leaf->triangle[lane]];
    double edges[3][3], length2[3];
    int longest = 0;
    for (int k = 0; k < 3; k++) {
        const float *from = mesh->vertices[corners[k]], *to = mesh->vertices[corners[(k + 1) % 3]];
        for (int axis = 0; axis < 3; axis++) {
            edges[k][axis] = (double)to[axis] - from[axis];
        }
        length2[k] = dot(edges[k], edges[k]);
        longest = length2[k] > length2[longest] ? k : longest;
    }
    // The third corner, seen from the end of the longest edge and from its origin.
    const double *second = edges[(longest + 1) % 3], *third = edges[(longest + 2) % 3];
    double x[3] = {edges[longest][0], edges[longest][1], edges[longest][2]}, y[3], normal[3];
    if (!normalise(x)) {
        x[0] = 1;
    }
    cross(edges[longest], second, normal);
    const double noise2 = 1e-28 * length2[longest] * dot(second, second);
    if (dot(normal, normal) <= noise2) {
        // Any will do for a segment or a point.
        const int least = fabs(x[0]) < fabs(x[1]) ? (fabs(x[0]) < fabs(x[2]) ? 0 : 2) : (fabs(x[1]) < fabs(x[2]) ? 1 : 2);
        const double axis[3] = {least == 0, least == 1, least == 2};
        cross(x, axis, normal);
    }
    // What rounding has left along x would count twice.
    normalise(normal);
    const double along = dot(normal, x);
    for (int axis = 0; axis < 3; axis++) {
        normal[axis] -= along * x[axis];
    }
    normalise(normal);
    cross(normal, x, y);
    for (int axis = 0; axis < 3; axis++) {
        leaf->corner[axis][lane] = mesh->vertices[corners[longest]][axis];
        leaf->x[axis][lane] = (float)x[axis];
        leaf->y[axis][lane] = (float)y[axis];
        leaf->normal[axis][lane] = (float)normal[axis];
    }
    leaf->base[lane] = (float)sqrt(length2[longest]);
    leaf->cx[lane] = (float)-dot(third, x);
    leaf->cy[lane] = (float)-dot(third, y);
    leaf->over_ca[lane] = reciprocal(dot(third, third));
    leaf->over_cb[lane] = reciprocal(dot(second, second));
}

static void place_leaves(void *user, uint64_t begin, uint64_t end, uint32_t worker) {
    (void)worker;
    build *b = user;
    for (uint64_t i = begin; i < end; i++) {
        for (int lane = 0; lane < FM_BVH_WIDTH; lane++) {
            place_triangle(b->mesh, &b->bvh->leaves[i], lane);
        }
    }
}

// ---------------------------------------------------------------------------------------------------------------------------

static bool make_items(build *b) {
    const fm_mesh *mesh = b->mesh;
    uint32_t kept = 0;
    for (uint32_t i = 0; i < mesh->triangle_count; i++) {
        if (fm_triangle_fits(mesh, i)) {
            b->items[kept++] = (item){box_of_triangle(mesh, i), i};
        }
    }
    b->item_count = kept;
    return kept > 0;
}

static fm_result build_wide(build *b) {
    fm_context *context = b->mesh->context;
    fm_bvh *bvh = b->bvh;
    const uint32_t leaves = count_leaves(b, 0);
    // The root, and others of at least two children each.
    bvh->node_room = leaves;
    bvh->leaf_room = leaves;
    bvh->nodes = fm_mesh_alloc(context, bvh->node_room * sizeof *bvh->nodes, "a tree's nodes");
    bvh->leaves = fm_mesh_alloc(context, bvh->leaf_room * sizeof *bvh->leaves, "a tree's leaves");
    if (!bvh->nodes || !bvh->leaves) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    widen(b, 0);
    fm_pool_run(b->mesh->context->pool, bvh->leaf_count, 256, place_leaves, b);
    return FM_OK;
}

fm_result fm_bvh_build(const fm_mesh *mesh, fm_bvh *bvh) {
    fm_context *context = mesh->context;
    const uint32_t most_tasks = 8 * fm_pool_threads(mesh->context->pool);
    const uint64_t triangles = mesh->triangle_count;
    build b = {.mesh = mesh, .bvh = bvh};
    b.items = fm_mesh_alloc(context, triangles * sizeof *b.items, "a tree's triangles");
    b.pairs = fm_mesh_alloc(context, 2 * triangles * sizeof *b.pairs, "a tree's first nodes");
    b.tasks = fm_mesh_alloc(context, most_tasks * sizeof *b.tasks, "a tree's tasks");
    fm_result status = b.items && b.pairs && b.tasks ? FM_OK : FM_ERROR_OUT_OF_HOST_MEMORY;
    if (status == FM_OK && make_items(&b)) {
        split_pairs(&b, most_tasks);
        status = build_wide(&b);
    }
    bvh->triangle_count = status == FM_OK ? b.item_count : 0;
    fm_mesh_free(context, b.items, triangles * sizeof *b.items);
    fm_mesh_free(context, b.pairs, 2 * triangles * sizeof *b.pairs);
    fm_mesh_free(context, b.tasks, most_tasks * sizeof *b.tasks);
    return status;
}

bool fm_bvh_refit(const fm_mesh *mesh, fm_bvh *bvh) {
    uint64_t fitting = 0;
    for (uint64_t i = 0; i < mesh->triangle_count; i++) {
        fitting += fm_triangle_fits(mesh, i);
    }
    for (uint32_t i = 0; i < bvh->leaf_count; i++) {
        for (int lane = 0; lane < FM_BVH_WIDTH; lane++) {
            if (!fm_triangle_fits(mesh, bvh->leaves[i].triangle[lane])) {
                return false;
            }
        }
    }
    if (fitting != bvh->triangle_count) {
        return false;
    }
    build b = {.mesh = mesh, .bvh = bvh};
    fm_pool_run(mesh->context->pool, bvh->leaf_count, 256, place_leaves, &b);
    for (uint32_t i = bvh->node_count; i-- > 0;) {
        fm_bvh_node *node = &bvh->nodes[i];
        for (int lane = 0; lane < FM_BVH_WIDTH; lane++) {
            box around = EMPTY;
            if (node->child[lane] & FM_BVH_LEAF) {
                const fm_bvh_leaf *leaf = &bvh->leaves[node->child[lane] & ~FM_BVH_LEAF];
                for (int k = 0; k < FM_BVH_WIDTH; k++) {
                    const box one = box_of_triangle(mesh, leaf->triangle[k]);
                    grow(&around, &one);
                }
            } else if (node->child[lane] != 0) {
                const fm_bvh_node *child = &bvh->nodes[node->child[lane]];
                for (int k = 0; k < FM_BVH_WIDTH; k++) {
                    const box one = {{child->low[0][k], child->low[1][k], child->low[2][k]},
                                     {child->high[0][k], child->high[1][k], child->high[2][k]}};
                    grow(&around, &one);
                }
            }
            set_box(node, lane, &around);
        }
    }
    return true;
}
