// SPDX-License-Identifier: MIT
#ifndef FM_OCTREE_NODES_RULE_H
#define FM_OCTREE_NODES_RULE_H

// How rays go through the nodes that CLOSEST and DISTANCE have in common: one text for C and GLSL. Here places and lengths are in
// finest cells, counted from the octree's origin, and a ray begins where it enters the octree's box, which keeps its numbers small.

#include "octree_rule.h"

// A ray crosses a boundary between cells once, so that what is checked ends long before; what is not ends here.
#define FM_CAST_STEPS 16384

// The ancestor of this level is remembered besides the parent: 8^3 cells around it cost three reads, not all from the top grid.
#define FM_KEPT_LEVEL 3

FM_PUSH_STRUCT(fm_octree_ray) {
    fm_v3 from, way;
    fm_v3 inverse;   // of way; huge where that is 0
    fm_float begin;  // world units along the whole ray to `from`
    fm_float far;    // below 0: it misses the box
    fm_float nudge;  // what is surely behind a boundary, and surely near it
    fm_float empty;  // cells of a unit of an empty leaf's distance
};

FM_RULE fm_float fm_octree_inverse(fm_float x) {
    return FM_SIZE_OF(x) > 1e-20f ? 1 / x : (x < 0 ? -1e20f : 1e20f);
}

FM_RULE fm_float fm_octree_cells(fm_octree_head head, fm_int axis) {
    return FM_F(head.top[axis]) * FM_F(1 << head.levels);
}

// The last place of the box that is in a cell of its own: on the box's upper faces there is none, or one that no build has looked
// at.
FM_RULE fm_v3 fm_octree_last_place(fm_octree_head head) {
    fm_float scale = 0.9999999f / head.cell;
    return fm_v3_of(scale * (head.high[0] - head.origin[0]), scale * (head.high[1] - head.origin[1]),
                    scale * (head.high[2] - head.origin[2]));
}

FM_RULE fm_octree_ray fm_octree_enter(fm_octree_head head, fm_v3 origin, fm_v3 way, fm_float first, fm_float last) {
    fm_octree_span span = fm_octree_clip(head, origin, way, first, last);
    fm_float scale = 1 / head.cell;
    fm_v3 from = fm_add(fm_less(origin, fm_v3_of(head.origin[0], head.origin[1], head.origin[2])), fm_times(way, span.first));
    fm_v3 most = fm_octree_last_place(head);
    fm_octree_ray ray;
    ray.from = fm_v3_of(FM_MIN(FM_MAX(from.x * scale, 0.0f), most.x), FM_MIN(FM_MAX(from.y * scale, 0.0f), most.y),
                        FM_MIN(FM_MAX(from.z * scale, 0.0f), most.z));
    ray.way = way;
    ray.inverse = fm_v3_of(fm_octree_inverse(way.x), fm_octree_inverse(way.y), fm_octree_inverse(way.z));
    ray.begin = span.first;
    ray.far = (span.last - span.first) * scale;
    ray.nudge = 1e-4f + 2.4e-7f * FM_MAX(FM_MAX(most.x, most.y), most.z);
    ray.empty = head.cutoff * scale * (1.0f / 1073741823.0f);
    return ray;
}

// Where a ray is: the leaf, and what finds the next one.
FM_PUSH_STRUCT(fm_octree_spot) {
    fm_uint word;    // of the leaf
    fm_int level;    // its
    fm_int cell[3];  // finest cell that was looked for
    fm_uint parent;  // first child of the leaf's parent; FM_GPU_NONE: the top grid is
    fm_uint kept;    // first child of the ancestor of FM_KEPT_LEVEL; FM_GPU_NONE: there is none
    fm_uint reads;   // of nodes so far
};

FM_RULE fm_octree_spot fm_octree_nowhere(void) {
    fm_octree_spot spot;
    spot.word = 0u;
    spot.level = 0;
    spot.cell[0] = 0;
    spot.cell[1] = 0;
    spot.cell[2] = 0;
    spot.parent = FM_GPU_NONE;
    spot.kept = FM_GPU_NONE;
    spot.reads = 0u;
    return spot;
}

FM_RULE bool fm_octree_is_internal(fm_uint word) {
    return word < FM_U(FM_NODE_EMPTY);
}

FM_RULE bool fm_octree_is_leaf(fm_uint word) {
    return word >= 0x80000000u;
}

FM_RULE fm_int fm_octree_cell_of(fm_float at, fm_float cells) {
    return FM_I(FM_MIN(FM_MAX(at, 0.0f), cells - 1));
}

// The leaf that holds a place. Begins at the parent of the one before where the place is in it, at the kept ancestor where it is in
// that, else at the top grid. Source: Demir and Westermann 2015, section 4.2, for the parent.
FM_RULE fm_octree_spot fm_octree_seek(fm_octree_head head, fm_octree_spot before, fm_v3 place) {
    fm_octree_spot spot = before;
    spot.cell[0] = fm_octree_cell_of(place.x, fm_octree_cells(head, 0));
    spot.cell[1] = fm_octree_cell_of(place.y, fm_octree_cells(head, 1));
    spot.cell[2] = fm_octree_cell_of(place.z, fm_octree_cells(head, 2));
    fm_int apart = (spot.cell[0] ^ before.cell[0]) | (spot.cell[1] ^ before.cell[1]) | (spot.cell[2] ^ before.cell[2]);
    fm_uint word = before.parent;
    fm_int level = before.level + 1;
    if (word == FM_GPU_NONE || apart >> level != 0) {
        word = before.kept;
        level = FM_KEPT_LEVEL;
        if (word == FM_GPU_NONE || apart >> FM_KEPT_LEVEL != 0) {
            spot.parent = FM_GPU_NONE;
            spot.kept = FM_GPU_NONE;
            level = head.levels;
            uint64_t slice = FM_LONG(spot.cell[2] >> level) * FM_LONG(head.top[1]) + FM_LONG(spot.cell[1] >> level);
            word = FM_WORD(head.words, slice * FM_LONG(head.top[0]) + FM_LONG(spot.cell[0] >> level));
            spot.reads++;
        }
    }
    while (fm_octree_is_internal(word) && level > 0) {
        spot.parent = word;
        spot.kept = level == FM_KEPT_LEVEL ? word : spot.kept;
        level--;
        fm_int child = (spot.cell[0] >> level & 1) | (spot.cell[1] >> level & 1) << 1 | (spot.cell[2] >> level & 1) << 2;
        word = FM_WORD(head.words, FM_LONG(word) + FM_LONG(child));
        spot.reads++;
    }
    spot.word = word;
    spot.level = level;
    return spot;
}

// The lower corner of the leaf.
FM_RULE fm_v3 fm_octree_corner(fm_octree_spot spot) {
    fm_int mask = -(1 << spot.level);
    return fm_v3_of(FM_F(spot.cell[0] & mask), FM_F(spot.cell[1] & mask), FM_F(spot.cell[2] & mask));
}

// How far a ray at a place of a cube goes until it leaves it.
FM_RULE fm_float fm_octree_stay(fm_octree_ray ray, fm_v3 place, fm_v3 corner, fm_float size) {
    fm_float x = ((ray.way.x < 0 ? corner.x : corner.x + size) - place.x) * ray.inverse.x;
    fm_float y = ((ray.way.y < 0 ? corner.y : corner.y + size) - place.y) * ray.inverse.y;
    fm_float z = ((ray.way.z < 0 ? corner.z : corner.z + size) - place.z) * ray.inverse.z;
    return FM_MAX(FM_MIN(FM_MIN(x, y), z), 0.0f);
}

// In an empty leaf: as far as the surface is at least, or out of the leaf. (A word that is neither leaf nor empty, which no checked
// octree has at level 0, is one that says nothing.)
FM_RULE fm_float fm_octree_empty_step(fm_octree_ray ray, fm_octree_spot spot, fm_v3 place) {
    fm_float stay = fm_octree_stay(ray, place, fm_octree_corner(spot), FM_F(1 << spot.level)) + ray.nudge;
    fm_uint distance = fm_octree_is_internal(spot.word) ? 0u : spot.word - FM_U(FM_NODE_EMPTY);
    return FM_MAX(stay, FM_F(distance) * ray.empty);
}

// Eight words of a leaf by corner, x + 2 y + 4 z: in memory one run of 32 bytes.
FM_PUSH_STRUCT(fm_octree_eight) {
    fm_uint v[8];
};

FM_RULE fm_octree_eight fm_octree_words_of(fm_address values, fm_uint leaf) {
    fm_octree_eight eight;
#ifdef __STDC__
    for (int i = 0; i < 8; i++) {
        eight.v[i] = FM_WORD(values, FM_LONG(leaf) * FM_COLUMN_VALUES + FM_LONG(4 * (i & 1) + (i >> 1)));
    }
#else
    uvec4 low = ref_u32x4(values + FM_LONG(leaf) * 16ul).v, high = ref_u32x4(values + FM_LONG(leaf) * 16ul + 16ul).v;
    for (int i = 0; i < 4; i++) {
        eight.v[2 * i] = low[i];
        eight.v[2 * i + 1] = high[i];
    }
#endif
    return eight;
}

// The vectors of a leaf as they are kept, of FM_GPU_FLOATS without meaning.
FM_RULE fm_octree_eight fm_vcp_words_of(fm_octree_head head, fm_uint leaf) {
    if (head.code != FM_GPU_SHORT) {
        return fm_octree_words_of(head.values, leaf);
    }
    fm_octree_eight eight;
    for (int i = 0; i < 4; i++) {
        fm_uint two = FM_WORD(head.values, FM_LONG(leaf) * FM_LONG(2) + FM_LONG(i));
        eight.v[(i >> 1) + 4 * (i & 1)] = two & 0xffffu;
        eight.v[(i >> 1) + 4 * (i & 1) + 2] = two >> 16;
    }
    return eight;
}

FM_RULE fm_uint fm_octree_leaf_of(fm_octree_spot spot) {
    return 0xffffffffu - spot.word;
}

// Corner `i` of the unit cell.
FM_RULE fm_v3 fm_octree_corner_of(fm_int i) {
    return fm_v3_of(FM_F(i & 1), FM_F(i >> 1 & 1), FM_F(i >> 2));
}

FM_RULE fm_int fm_octree_nearest_corner(fm_v3 u) {
    return (u.x > 0.5f ? 1 : 0) | (u.y > 0.5f ? 2 : 0) | (u.z > 0.5f ? 4 : 0);
}

// The weight of corner `i` at a place of the unit cell.
FM_RULE fm_float fm_octree_weight(fm_int i, fm_v3 u) {
    return ((i & 1) == 1 ? u.x : 1 - u.x) * ((i >> 1 & 1) == 1 ? u.y : 1 - u.y) * (i >> 2 == 1 ? u.z : 1 - u.z);
}

FM_RULE fm_float fm_octree_length(fm_v3 a) {
    return FM_SQRT(fm_dot(a, a));
}

// Towards where the ray came from, and the way there where the surface has no direction.
FM_RULE fm_v3 fm_octree_facing(fm_v3 normal, fm_v3 way) {
    return fm_dot(normal, way) > 0 || fm_dot(normal, normal) < 0.5f ? fm_times(fm_dot(normal, normal) < 0.5f ? way : normal, -1.0f)
                                                                    : normal;
}

FM_RULE fm_octree_met fm_octree_meet(fm_octree_head head, fm_octree_ray ray, fm_float t, fm_v3 normal, fm_int level) {
    fm_octree_met met;
    fm_v3 facing = fm_octree_facing(normal, ray.way);
    met.t = ray.begin + FM_MIN(FM_MAX(t, 0.0f), ray.far) * head.cell;
    met.normal[0] = facing.x;
    met.normal[1] = facing.y;
    met.normal[2] = facing.z;
    met.mark = 0u;
    met.reads = 0u;
    met.level = level;
    return met;
}

// What a leaf says of the surface near a place of its unit cell: the nearest corner's attribute, or colours mixed.
FM_RULE fm_uint fm_octree_attribute_at(fm_octree_head head, fm_uint leaf, fm_v3 u) {
    if (head.attributes == FM_LONG(0)) {
        return 0u;
    }
    fm_octree_eight eight = fm_octree_words_of(head.attributes, leaf);
    fm_v3 at = fm_v3_of(FM_MIN(FM_MAX(u.x, 0.0f), 1.0f), FM_MIN(FM_MAX(u.y, 0.0f), 1.0f), FM_MIN(FM_MAX(u.z, 0.0f), 1.0f));
    if (head.mark != FM_GPU_COLOR) {
        return eight.v[fm_octree_nearest_corner(at)];
    }
    fm_float sum[4];
    sum[0] = 0.5f;
    sum[1] = 0.5f;
    sum[2] = 0.5f;
    sum[3] = 0.5f;
    for (int i = 0; i < 8; i++) {
        fm_float weight = fm_octree_weight(i, at);
        for (int k = 0; k < 4; k++) {
            sum[k] += weight * FM_F(eight.v[i] >> (8 * k) & 255u);
        }
    }
    return FM_U(sum[0]) | FM_U(sum[1]) << 8 | FM_U(sum[2]) << 16 | FM_U(sum[3]) << 24;
}

#endif
