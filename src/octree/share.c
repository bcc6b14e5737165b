// SPDX-License-Identifier: MIT
// Identical leaves and identical subtrees kept once. A leaf is two columns that follow each other: with columns as places and
// leaves as ways from one to the next, the shortest order of columns in which all leaves are found is one of the fewest trails
// that use each way once, so that leaves share columns beyond those that are neighbours in space. Ours; for voxels the sharing of
// subtrees is that of Kaempe, Sintorn and Assarsson 2013.

#include "octree/build.h"

#include <string.h>

static const uint32_t NONE = UINT32_MAX;

// Numbers for distinct things: a table of them, with linear probing.
typedef struct numbering {
    uint32_t *slots;  // a number, or NONE
    uint64_t size, count;
} numbering;

typedef struct sharing {
    fm_octree *octree;
    uint64_t columns;     // before
    uint32_t *column_of;  // the distinct one of each
    uint32_t *kept;       // of each distinct column: where it stood first
    numbering distinct;   // columns
    numbering leaves;     // pairs of distinct columns
    uint32_t (*pairs)[2];
    uint64_t pair_room;
    uint32_t *placed;  // of each distinct leaf: its number at the end
    uint32_t *words;   // the new ones
    uint64_t word_count;
    numbering groups;  // of eight words
} sharing;

static uint64_t mix(uint64_t hash, uint64_t value) {
    hash = (hash ^ value) * 0x9e3779b97f4a7c15u;
    return hash ^ hash >> 29;
}

static uint64_t hash_words(const void *data, uint64_t bytes) {
    const uint8_t *at = data;
    uint64_t hash = bytes;
    for (uint64_t i = 0; i < bytes; i += 4) {
        uint32_t word;
        memcpy(&word, at + i, sizeof word);
        hash = mix(hash, word);
    }
    return mix(hash, hash >> 32);
}

static bool numbering_make(const sharing *s, numbering *n, uint64_t most) {
    n->size = 16;
    while (n->size < most * 2) {
        n->size *= 2;
    }
    n->slots = fm_octree_alloc(s->octree->context, n->size * sizeof *n->slots, "what is alike");
    if (n->slots) {
        memset(n->slots, 0xff, n->size * sizeof *n->slots);
    }
    return n->slots;
}

static void numbering_free(const sharing *s, numbering *n) {
    fm_octree_free(s->octree->context, n->slots, n->size * sizeof *n->slots);
    n->slots = NULL;
}

typedef bool (*alike_fn)(const sharing *s, uint32_t number, const void *key);

// The place of what is alike, or a free one.
static uint32_t *find(const sharing *s, numbering *n, uint64_t hash, alike_fn alike, const void *key) {
    uint64_t i = hash & (n->size - 1);
    while (n->slots[i] != NONE && !alike(s, n->slots[i], key)) {
        i = (i + 1) & (n->size - 1);
    }
    return &n->slots[i];
}

// --- Columns ---

static uint64_t column_bytes(const sharing *s) {
    return (uint64_t)FM_COLUMN_VALUES * s->octree->values.size;
}

static const uint8_t *column_at(const sharing *s, uint64_t column) {
    return s->octree->values.data + column * column_bytes(s);
}

static const uint32_t *attributes_at(const sharing *s, uint64_t column) {
    return (const uint32_t *)(const void *)s->octree->attributes.data + column * FM_COLUMN_VALUES;
}

static bool columns_alike(const sharing *s, uint32_t number, const void *key) {
    const uint64_t other = *(const uint64_t *)key, own = s->kept[number];
    return memcmp(column_at(s, own), column_at(s, other), column_bytes(s)) == 0 &&
           (s->octree->attributes.count == 0 || memcmp(attributes_at(s, own), attributes_at(s, other), 16) == 0);
}

static bool number_columns(sharing *s) {
    s->columns = s->octree->values.count / FM_COLUMN_VALUES;
    s->column_of = fm_octree_alloc(s->octree->context, s->columns * sizeof *s->column_of, "what is alike");
    s->kept = fm_octree_alloc(s->octree->context, s->columns * sizeof *s->kept, "what is alike");
    if (!s->column_of || !s->kept || !numbering_make(s, &s->distinct, s->columns)) {
        return false;
    }
    for (uint64_t i = 0; i < s->columns; i++) {
        uint64_t hash = hash_words(column_at(s, i), column_bytes(s));
        hash = s->octree->attributes.count > 0 ? mix(hash, hash_words(attributes_at(s, i), 16)) : hash;
        uint32_t *slot = find(s, &s->distinct, hash, columns_alike, &i);
        if (*slot == NONE) {
            *slot = (uint32_t)s->distinct.count;
            s->kept[s->distinct.count++] = (uint32_t)i;
        }
        s->column_of[i] = *slot;
    }
    numbering_free(s, &s->distinct);
    return true;
}

// --- Leaves ---

static bool pairs_alike(const sharing *s, uint32_t number, const void *key) {
    return memcmp(s->pairs[number], key, sizeof *s->pairs) == 0;
}

// Leaves' words get the number of the distinct leaf.
static bool number_leaves(sharing *s) {
    uint32_t *words = (uint32_t *)(void *)s->octree->words.data;
    s->pair_room = s->columns;
    s->pairs = fm_octree_alloc(s->octree->context, s->pair_room * sizeof *s->pairs, "what is alike");
    if (!s->pairs || !numbering_make(s, &s->leaves, s->pair_room)) {
        return false;
    }
    for (uint64_t i = 0; i < s->octree->words.count; i++) {
        if (words[i] <= INT32_MAX) {
            continue;
        }
        const uint32_t leaf = ~words[i];
        const uint32_t pair[2] = {s->column_of[leaf], s->column_of[leaf + 1]};
        uint32_t *slot = find(s, &s->leaves, mix(mix(1, pair[0]), pair[1]), pairs_alike, pair);
        if (*slot == NONE) {
            *slot = (uint32_t)s->leaves.count;
            memcpy(s->pairs[s->leaves.count++], pair, sizeof pair);
        }
        words[i] = ~*slot;
    }
    numbering_free(s, &s->leaves);
    return true;
}

// --- Trails ---

typedef struct trails {
    uint32_t *first;     // of each column: its ways out, distinct columns + 1
    uint32_t *ways;      // leaves
    uint32_t *arriving;  // how many ways come in
    uint32_t *next;      // the first way out that is not used
    uint32_t *order;     // columns, as they follow each other
    uint64_t length;
} trails;

static void follow(sharing *s, trails *t, uint32_t column) {
    t->order[t->length++] = column;
    while (t->next[column] < t->first[column + 1]) {
        const uint32_t leaf = t->ways[t->next[column]++];
        s->placed[leaf] = (uint32_t)t->length - 1;
        column = s->pairs[leaf][1];
        t->order[t->length++] = column;
    }
}

static void sort_ways(const sharing *s, trails *t) {
    const uint64_t columns = s->distinct.count;
    memset(t->first, 0, (columns + 1) * sizeof *t->first);
    memset(t->arriving, 0, columns * sizeof *t->arriving);
    for (uint64_t i = 0; i < s->leaves.count; i++) {
        t->first[s->pairs[i][0] + 1]++;
        t->arriving[s->pairs[i][1]]++;
    }
    for (uint64_t i = 0; i < columns; i++) {
        t->first[i + 1] += t->first[i];
        t->next[i] = t->first[i];
    }
    for (uint64_t i = 0; i < s->leaves.count; i++) {
        t->ways[t->next[s->pairs[i][0]]++] = (uint32_t)i;
    }
    memcpy(t->next, t->first, columns * sizeof *t->next);
}

// From columns that more ways leave than reach as many trails as that begin; what then is left are circles.
static void walk(sharing *s, trails *t) {
    const uint64_t columns = s->distinct.count;
    sort_ways(s, t);
    for (uint64_t i = 0; i < columns; i++) {
        const uint32_t leaving = t->first[i + 1] - t->first[i];
        for (uint32_t k = t->arriving[i]; k < leaving && t->next[i] < t->first[i + 1]; k++) {
            follow(s, t, (uint32_t)i);
        }
    }
    for (uint64_t i = 0; i < columns; i++) {
        while (t->next[i] < t->first[i + 1]) {
            follow(s, t, (uint32_t)i);
        }
    }
}

// The array's columns in the order of the trails.
static bool reorder(const sharing *s, const trails *t, fm_octree_array *array) {
    fm_octree_array made = {.size = array->size};
    const uint64_t bytes = (uint64_t)FM_COLUMN_VALUES * array->size;
    if (!fm_octree_reserve(s->octree, &made, t->length * FM_COLUMN_VALUES)) {
        return false;
    }
    for (uint64_t i = 0; i < t->length; i++) {
        memcpy(made.data + i * bytes, array->data + s->kept[t->order[i]] * bytes, bytes);
    }
    made.count = t->length * FM_COLUMN_VALUES;
    fm_octree_array_free(s->octree, array);
    *array = made;
    return true;
}

static bool order_columns(sharing *s) {
    const uint64_t columns = s->distinct.count, leaves = s->leaves.count;
    trails t = {.first = fm_octree_alloc(s->octree->context, (columns + 1) * 4, "what is alike"),
                .ways = fm_octree_alloc(s->octree->context, leaves * 4, "what is alike"),
                .arriving = fm_octree_alloc(s->octree->context, columns * 4, "what is alike"),
                .next = fm_octree_alloc(s->octree->context, columns * 4, "what is alike"),
                .order = fm_octree_alloc(s->octree->context, leaves * 8, "what is alike")};
    s->placed = fm_octree_alloc(s->octree->context, leaves * sizeof *s->placed, "what is alike");
    bool good = t.first && t.ways && t.arriving && t.next && t.order && s->placed;
    if (good) {
        walk(s, &t);
        good = reorder(s, &t, &s->octree->values);
        good = good && (s->octree->attributes.count == 0 || reorder(s, &t, &s->octree->attributes));
    }
    fm_octree_free(s->octree->context, t.first, (columns + 1) * 4);
    fm_octree_free(s->octree->context, t.ways, leaves * 4);
    fm_octree_free(s->octree->context, t.arriving, columns * 4);
    fm_octree_free(s->octree->context, t.next, columns * 4);
    fm_octree_free(s->octree->context, t.order, leaves * 8);
    return good;
}

// --- Subtrees ---

static bool groups_alike(const sharing *s, uint32_t number, const void *key) {
    return memcmp(s->words + number, key, 8 * sizeof *s->words) == 0;
}

static uint32_t shared_word(sharing *s, uint32_t word) {
    if (word > INT32_MAX) {
        return ~s->placed[~word];
    }
    if (word >= FM_NODE_EMPTY) {
        return word;
    }
    const uint32_t *old = (const uint32_t *)(const void *)s->octree->words.data + word;
    uint32_t children[8];
    for (int i = 0; i < 8; i++) {
        children[i] = shared_word(s, old[i]);
    }
    uint32_t *slot = find(s, &s->groups, hash_words(children, sizeof children), groups_alike, children);
    if (*slot == NONE) {
        *slot = (uint32_t)s->word_count;
        memcpy(s->words + s->word_count, children, sizeof children);
        s->word_count += 8;
    }
    return *slot;
}

static bool share_words(sharing *s) {
    fm_octree *octree = s->octree;
    const uint32_t *top = octree->info.top, *old = (const uint32_t *)(const void *)octree->words.data;
    const uint64_t first = (uint64_t)top[0] * top[1] * top[2];
    fm_octree_array made = {.size = octree->words.size};
    if (!fm_octree_reserve(octree, &made, octree->words.count) ||
        !numbering_make(s, &s->groups, (octree->words.count - first) / 8)) {
        fm_octree_array_free(octree, &made);
        return false;
    }
    s->words = (uint32_t *)(void *)made.data;
    s->word_count = first;
    for (uint64_t i = 0; i < first; i++) {
        s->words[i] = shared_word(s, old[i]);
    }
    made.count = s->word_count;
    octree->info.internal = (s->word_count - first) / 8;
    fm_octree_array_free(octree, &octree->words);
    octree->words = made;
    numbering_free(s, &s->groups);
    return true;
}

fm_result fm_octree_share(fm_octree *octree) {
    sharing s = {.octree = octree};
    const bool good = number_columns(&s) && number_leaves(&s) && order_columns(&s) && share_words(&s);
    numbering_free(&s, &s.distinct);
    numbering_free(&s, &s.leaves);
    fm_octree_free(s.octree->context, s.column_of, s.columns * sizeof *s.column_of);
    fm_octree_free(s.octree->context, s.kept, s.columns * sizeof *s.kept);
    fm_octree_free(s.octree->context, s.pairs, s.pair_room * sizeof *s.pairs);
    fm_octree_free(s.octree->context, s.placed, s.leaves.count * sizeof *s.placed);
    return good ? FM_OK : FM_ERROR_OUT_OF_HOST_MEMORY;
}
