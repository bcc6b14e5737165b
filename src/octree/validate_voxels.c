// SPDX-License-Identifier: MIT
// Whether DAGs and 64-trees from files are such that rays can go through them, and updates too. Each step down is to a lower level,
// so that no way is endless; marks keep nodes of DAGs that many others share from being gone through again and again, and tell of
// those of 64-trees that are shared, whose copies would be without end.

#include "octree/validate.h"

#include "shaders/include/octree_dag_rule.h"
#include "shaders/include/octree_tree64_rule.h"

typedef struct nodes {
    const uint32_t *words;
    uint64_t count;     // of them
    uint64_t top;       // of the top grid, in which no nodes lie: updates overwrite it
    uint64_t values;    // numbers of voxels
    uint32_t *visited;  // of each node: a bit for each level at which it was found sound
} nodes;

static fm_result nodes_of(const fm_octree *octree, uint8_t *marks, nodes *n) {
    *n = (nodes){.words = (const uint32_t *)(const void *)octree->words.data,
                 .count = octree->words.count,
                 .values = octree->values.count,
                 .visited = (uint32_t *)(void *)marks};
    return fm_octree_check_top(octree, &n->top);
}

// True where it was seen before.
static bool visit(const nodes *n, uint64_t node, int level) {
    const bool seen = n->visited[node] >> level & 1;
    n->visited[node] |= 1u << level;
    return seen;
}

static fm_result outside(const nodes *n, const char *what, uint64_t at, uint64_t end) {
    return fm_fail(FM_ERROR_FORMAT, "%s %llu: has words up to %llu: they are from %llu to %llu", what, (unsigned long long)at,
                   (unsigned long long)end, (unsigned long long)n->top, (unsigned long long)n->count);
}

// Updates relocate what a node says by what it is: leaves have no children.
static fm_result check_one_sort(const nodes *n, uint64_t node) {
    const uint32_t leaf = 1u << FM_DAG_LEAF_LEVEL;
    return !(n->visited[node] & leaf) || n->visited[node] == leaf
               ? FM_OK
               : fm_fail(FM_ERROR_FORMAT, "node %llu: is a leaf and has children", (unsigned long long)node);
}

static fm_result check_dag(const nodes *n, uint64_t node, int level) {
    if (node == FM_DAG_SOLID) {
        return FM_OK;
    }
    if (node < n->top) {
        return fm_fail(FM_ERROR_FORMAT, "node %llu: is in the top grid, and no child", (unsigned long long)node);
    }
    if (node + 2 > n->count) {
        return outside(n, "node", node, node + 2);
    }
    if (visit(n, node, level)) {
        return FM_OK;
    }
    FM_TRY(check_one_sort(n, node));
    const bool leaf = level == FM_DAG_LEAF_LEVEL;
    const uint32_t children = (uint32_t)__builtin_popcount(n->words[node] & 0xff);
    if (leaf ? (n->words[node] | n->words[node + 1]) == 0 : children == 0) {
        return fm_fail(FM_ERROR_FORMAT, "node %llu: holds nothing", (unsigned long long)node);
    }
    if (leaf) {
        return FM_OK;
    }
    if (node + 1 + children > n->count) {
        return outside(n, "node", node, node + 1 + children);
    }
    for (uint32_t i = 0; i < children; i++) {
        FM_TRY(check_dag(n, n->words[node + 1 + i], level - 1));
    }
    return FM_OK;
}

fm_result fm_octree_check_dag(const fm_octree *octree, uint8_t *marks) {
    nodes n;
    const int levels = (int)octree->info.levels;
    FM_TRY(nodes_of(octree, marks, &n));
    if (levels < FM_DAG_LEAF_LEVEL) {
        return fm_fail(FM_ERROR_FORMAT, "%d levels: a DAG has %d at least", levels, FM_DAG_LEAF_LEVEL);
    }
    for (uint64_t i = 0; i < n.top; i++) {
        if (n.words[i] != 0) {
            FM_TRY(check_dag(&n, n.words[i], levels));
        }
    }
    return FM_OK;
}

static fm_result check_numbers(const nodes *n, uint64_t node, uint64_t first, uint64_t numbers) {
    return first + numbers <= n->values
               ? FM_OK
               : fm_fail(FM_ERROR_FORMAT, "node %llu: has values up to %llu, but there are %llu", (unsigned long long)node,
                         (unsigned long long)(first + numbers), (unsigned long long)n->values);
}

// Leaves of two words each, behind the word with the number that they share.
static fm_result check_thin(const nodes *n, uint64_t node, uint64_t first, uint32_t children) {
    if (first <= n->top || first + 2 * (uint64_t)children > n->count) {
        return outside(n, "node", node, first + 2 * (uint64_t)children);
    }
    return check_numbers(n, node, n->words[first - 1], 1);
}

static fm_result check_tree64(const nodes *n, uint64_t node, int level) {
    if (node < n->top || node + FM_TREE64_WORDS > n->count) {
        return outside(n, "node", node, node + FM_TREE64_WORDS);
    }
    if (n->visited[node]) {
        return fm_fail(FM_ERROR_FORMAT, "node %llu: has more than one parent, or is below itself", (unsigned long long)node);
    }
    n->visited[node] = 1;
    const uint32_t base = n->words[node + 2], first = base & FM_TREE64_INDEX;
    const uint32_t children = (uint32_t)(__builtin_popcount(n->words[node]) + __builtin_popcount(n->words[node + 1]));
    if (children == 0) {
        return fm_fail(FM_ERROR_FORMAT, "node %llu: holds nothing", (unsigned long long)node);
    }
    if (base & FM_TREE64_LEAF) {
        return check_numbers(n, node, first, base & FM_TREE64_SAME ? 1 : children);
    }
    if (level < 4) {
        return fm_fail(FM_ERROR_FORMAT, "node %llu: has children below level 0", (unsigned long long)node);
    }
    if (base & FM_TREE64_SAME) {
        return check_thin(n, node, first, children);
    }
    for (uint32_t i = 0; i < children; i++) {
        FM_TRY(check_tree64(n, first + (uint64_t)i * FM_TREE64_WORDS, level - 2));
    }
    return FM_OK;
}

fm_result fm_octree_check_tree64(const fm_octree *octree, uint8_t *marks) {
    nodes n;
    const int levels = (int)octree->info.levels;
    FM_TRY(nodes_of(octree, marks, &n));
    if (levels < 2 || levels % 2 != 0) {
        return fm_fail(FM_ERROR_FORMAT, "%d levels: a 64-tree has an even number of them", levels);
    }
    for (uint64_t i = 0; i < n.top; i++) {
        if (n.words[i] != 0) {
            FM_TRY(check_tree64(&n, n.words[i], levels));
        }
    }
    return FM_OK;
}
