// SPDX-License-Identifier: MIT
#ifndef FM_OCTREE_CONTOURS_RULE_H
#define FM_OCTREE_CONTOURS_RULE_H

// CONTOURS: a sparse voxel octree of child descriptors, with pairs of parallel planes that cut cells to what is in them, and the
// way that rays take through it. Source: Laine and Karras 2010, "Efficient sparse voxel octrees", sections 3 and 4. What is ours:
// top grid, children in front of parents, lists in place of blocks, and how planes are chosen (octree/voxel_contours.c).
//
// A descriptor is two words at an even place. The first: where the descriptors of its children begin, in 15 bits, counted backwards
// in pairs of words; a bit, FM_CONTOURS_FAR, that says that those 15 bits are instead how many words behind the descriptor a word
// lies that has the place in full; a byte of the children (x + 2 y + 4 z) that are there; a byte of those that are leaves. Only
// those that are no leaves have descriptors, which follow each other. The second: 24 bits, how many words in front of the
// descriptor its list begins, and a byte of the children that have a contour. A list is where in `values` the numbers of the leaves
// begin (FM_CONTOURS_SAME: they all have that one), then the contours.
//
// Words of the top grid: 0, nothing; FM_CONTOURS_SOLID and where the number is, all solid; else the place of a descriptor.
//
// A contour, seen from a cell as the cube of -1 to 1: |n . q / 31 - position| <= thickness. From the lowest bit on: 7 bits
// thickness, in units of FM_CONTOUR_STEP; 7 position, less 64, in units of twice that; 6 for each coordinate of n, less 32.
//
// A read is a descriptor (8 bytes), a word of the top grid or of a list, or a number.

#include "octree_walk_rule.h"

#define FM_CONTOURS_FAR 0x10000u
#define FM_CONTOURS_SAME 0x80000000u
#define FM_CONTOURS_SOLID 0x80000000u
#define FM_CONTOUR_STEP (3.0f / 128.0f)
#define FM_CONTOUR_SLACK 0.01f  // added to the thickness, so that rounding cuts nothing off

FM_RULE fm_int fm_contour_normal(fm_uint contour, int axis) {
    return FM_I((contour >> (14 + 6 * axis)) & 63u) - 32;
}

FM_RULE fm_float fm_contour_position(fm_uint contour) {
    return FM_F(FM_I((contour >> 7) & 127u) - 64) * (2 * FM_CONTOUR_STEP);
}

FM_RULE fm_float fm_contour_thickness(fm_uint contour) {
    return FM_F(contour & 127u) * FM_CONTOUR_STEP;
}

// A ray in a top cell. Lengths are finest cells from the top cell's corner. Cells on its way are places from 1 to 2 within the top
// cell, mirrored so that the ray never goes down: the bits of their fraction are the path to them.
FM_PUSH_STRUCT(fm_contours_ray) {
    fm_float from[3], along[3], inverse[3];
    fm_float cells;  // of the top cell's edge
    fm_uint turned;  // a bit for each mirrored axis
};

FM_RULE fm_contours_ray fm_contours_enter(fm_octree_head head, fm_octree_walk walk) {
    fm_contours_ray ray;
    ray.cells = FM_F(1 << head.levels);
    ray.turned = 0u;
    for (int i = 0; i < 3; i++) {
        const fm_int corner = (fm_walk_cell(walk, i) >> head.levels) << head.levels;
        ray.from[i] = walk.from[i] - FM_F(corner);
        ray.along[i] = walk.along[i];
        ray.inverse[i] = walk.inverse[i];
        ray.turned |= walk.turned[i] != 0 ? 1u << i : 0u;
    }
    return ray;
}

// A place as it is, not mirrored.
FM_RULE fm_float fm_contours_face(fm_contours_ray ray, int axis, fm_float place) {
    return (((ray.turned >> axis) & 1u) != 0u ? 2 - place : place - 1) * ray.cells;
}

// When the ray passes it.
FM_RULE fm_float fm_contours_time(fm_contours_ray ray, int axis, fm_float place) {
    return (fm_contours_face(ray, axis, place) - ray.from[axis]) * ray.inverse[axis];
}

FM_RULE fm_octree_span fm_contour_span(fm_contours_ray ray, const fm_float low[3], fm_float size, fm_uint contour,
                                       fm_octree_span within) {
    const fm_float scale = 2 / (size * ray.cells);
    fm_float at = 0, speed = 0;  // of the product with the normal, when the cell is entered
    for (int i = 0; i < 3; i++) {
        const fm_float towards = FM_F(fm_contour_normal(contour, i)) / 31;
        const fm_float middle = fm_contours_face(ray, i, low[i] + 0.5f * size);
        at += towards * scale * (ray.from[i] + ray.along[i] * within.first - middle);
        speed += towards * scale * ray.along[i];
    }
    const fm_float off = fm_contour_position(contour) - at;
    const fm_float half_width = fm_contour_thickness(contour) + FM_CONTOUR_SLACK;
    fm_octree_span span = within;
    if (FM_SIZE_OF(speed) < 1e-12f) {
        span.last = FM_SIZE_OF(off) > half_width ? -FM_INFINITY_F : span.last;
        return span;
    }
    const fm_float a = (off - half_width) / speed;
    const fm_float b = (off + half_width) / speed;
    span.first = within.first + FM_MAX(FM_MIN(a, b), 0.0f);
    span.last = FM_MIN(within.last, within.first + FM_MAX(a, b));
    return span;
}

// Of a leaf that is met at `t`, through the face of `axis`. Its contour, where it has one, is the surface: its normal counts even
// where the ray is between the planes when it comes in.
FM_RULE fm_octree_met fm_contours_met(fm_octree_walk walk, fm_v3 way, fm_float t, int axis, fm_uint contour, fm_uint number,
                                      fm_uint reads, int level) {
    fm_octree_walk last = walk;
    last.t = t;
    last.axis = axis;
    fm_octree_met met = fm_walk_met(last, way, number, reads, level);
    if (contour != 0u) {
        fm_v3 normal =
            fm_v3_of(FM_F(fm_contour_normal(contour, 0)), FM_F(fm_contour_normal(contour, 1)), FM_F(fm_contour_normal(contour, 2)));
        normal = fm_unit(fm_dot(normal, way) > 0 ? fm_times(normal, -1.0f) : normal);
        met.normal[0] = normal.x;
        met.normal[1] = normal.y;
        met.normal[2] = normal.z;
    }
    return met;
}

// The descriptors of a node's children; a read more where they are far.
FM_RULE fm_uint fm_contours_children(fm_octree_head head, fm_uint node, fm_uint masks) {
    const fm_uint near = masks >> 17;
    return (masks & FM_CONTOURS_FAR) != 0u ? FM_WORD(head.words, node + near) : node - 2u * near;
}

// Through the top cell that the walk is in, whose descriptor is `node`.
FM_RULE fm_octree_met fm_contours_top(fm_octree_head head, fm_octree_walk walk, fm_v3 way, fm_uint top, fm_float last,
                                      fm_uint reads_before) {
    const fm_contours_ray ray = fm_contours_enter(head, walk);
    fm_uint nodes[FM_WALK_LEVELS + 3];   // by the scale of their children, which is what the last bit of their places stands for:
    fm_float leave[FM_WALK_LEVELS + 3];  // of half the top cell's size 22. And when the ray leaves what is in them
    fm_uint reads = reads_before + 1u, node = top;
    fm_uint masks = FM_WORD(head.words, node);
    fm_uint list = FM_WORD(head.words, node + 1u);
    fm_float low[3];
    fm_float size = 0.5f;
    fm_octree_span span;
    span.first = walk.t;
    span.last = last;
    int scale = 22, axis = walk.axis;
    const int least_scale = 23 - head.levels;
    bool down = true;
    for (int i = 0; i < 3; i++) {
        low[i] = 1;
    }
    while (reads < FM_WALK_READS) {
        if (down) {
            // Into the child that the ray is in.
            for (int i = 0; i < 3; i++) {
                low[i] += fm_contours_time(ray, i, low[i] + size) <= span.first ? size : 0.0f;
            }
            down = false;
        }
        fm_uint child = 0u;
        fm_float corner[3];  // when the far faces are passed
        for (int i = 0; i < 3; i++) {
            child |= ((FM_BITS_OF(low[i]) >> scale) & 1u) << i;
            corner[i] = fm_contours_time(ray, i, low[i] + size);
        }
        child ^= ray.turned;
        const fm_float end = FM_MIN(corner[0], FM_MIN(corner[1], corner[2]));
        const fm_uint bit = 1u << child;
        if (((masks >> 8) & bit) != 0u && span.first <= span.last) {
            fm_octree_span in_child = span;
            in_child.last = FM_MIN(span.last, end);
            fm_uint contour = 0u;
            const fm_uint place = node - (list >> 8);
            if ((list & bit) != 0u) {
                contour = FM_WORD(head.words, place + 1u + FM_ONES(list & (bit - 1u)));
                reads++;
                in_child = fm_contour_span(ray, low, size, contour, in_child);
            }
            if (in_child.first <= in_child.last) {
                if ((masks & bit) != 0u) {
                    const fm_uint base = FM_WORD(head.words, place);
                    const fm_uint before = (base & FM_CONTOURS_SAME) != 0u ? 0u : FM_ONES(masks & 255u & (bit - 1u));
                    const fm_uint number = FM_WORD(head.values, (base & ~FM_CONTOURS_SAME) + before);
                    return fm_contours_met(walk, way, in_child.first, axis, contour, number, reads + 2u, scale - least_scale);
                }
                if (scale > least_scale) {
                    nodes[scale] = node;
                    leave[scale] = span.last;
                    const fm_uint below = (masks >> 8) & ~masks & (bit - 1u) & 255u;
                    reads += (masks & FM_CONTOURS_FAR) != 0u ? 2u : 1u;
                    node = fm_contours_children(head, node, masks) + 2u * FM_ONES(below);
                    masks = FM_WORD(head.words, node);
                    list = FM_WORD(head.words, node + 1u);
                    scale--;
                    size *= 0.5f;
                    span = in_child;
                    down = true;
                    continue;
                }
            }
        }
        // On to the next child, or out of as many parents as end here too.
        fm_uint differ = 0u;
        axis = corner[0] <= corner[1] && corner[0] <= corner[2] ? 0 : corner[1] <= corner[2] ? 1 : 2;
        for (int i = 0; i < 3; i++) {
            const fm_uint before = FM_BITS_OF(low[i]);
            low[i] += corner[i] <= end ? size : 0.0f;
            differ |= before ^ FM_BITS_OF(low[i]);
        }
        span.first = FM_MAX(span.first, end);
        const int highest = FM_HIGHEST(differ);
        if (highest > 22 || span.first > last) {
            return fm_walk_missed(reads);
        }
        if (highest > scale) {
            scale = highest;
            size = FM_REAL_OF(FM_U(scale - 23 + 127) << 23);
            node = nodes[scale];
            span.last = leave[scale];
            masks = FM_WORD(head.words, node);
            list = FM_WORD(head.words, node + 1u);
            reads++;
            for (int i = 0; i < 3; i++) {
                low[i] = FM_REAL_OF((FM_BITS_OF(low[i]) >> scale) << scale);
            }
        }
    }
    return fm_walk_missed(reads);
}

FM_RULE fm_octree_met fm_cast_contours(fm_octree_head head, fm_v3 origin, fm_v3 way, fm_float first, fm_float last) {
    fm_octree_walk walk = fm_walk_begin(head, origin, way, first);
    fm_uint reads = 0u;
    while (fm_walk_inside(walk) && walk.t <= last && reads < FM_WALK_READS) {
        const fm_uint word = FM_WORD(head.words, fm_walk_top(head, walk));
        reads++;
        if (word >= FM_CONTOURS_SOLID) {
            const fm_uint number = FM_WORD(head.values, word & ~FM_CONTOURS_SOLID);
            return fm_walk_met(walk, way, number, reads + 1u, head.levels);
        }
        if (word != 0u) {
            const fm_octree_met met = fm_contours_top(head, walk, way, word, last, reads);
            if (met.t < FM_INFINITY_F) {
                return met;
            }
            reads = met.reads;
        }
        walk = fm_walk_leave(walk, head.levels);
    }
    return fm_walk_missed(reads);
}

#endif
