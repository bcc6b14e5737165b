// SPDX-License-Identifier: MIT
#ifndef FM_OCTREE_DISTANCE_RULE_H
#define FM_OCTREE_DISTANCE_RULE_H

// Rays through octrees and bricks of signed distances: one text for C and GLSL. A read is that of a node, or of the eight distances
// of a leaf or of a cell of a brick.
//
// In a leaf the field is trilinear, and along a ray a cubic, whose first zero is the surface. Source: Soederlund, Evans and
// Akenine-Moeller 2022, "Ray tracing of signed distance function grids". As published for octrees (`stepped`; Demir and Westermann
// 2015, section 5), the ray is sampled instead, and what is below epsilon is a hit. A ray that begins inside meets the surface from
// there. Distances without a sign have no zero to cross, and between samples they do not come near it: their surface is thick.

#include "cubic_rule.h"
#include "octree_nodes_rule.h"

// How far from the surface distances without a sign are at least held to be on it, in finest cells: between the corners of a cell
// that the surface cuts in half they are no less than half of one.
#define FM_UNSIGNED_THICKNESS 0.75f

// The cell whose corners' distances are known around a place in a leaf: the leaf, or one of a brick's.
FM_RULE fm_octree_spot fm_distance_spot(fm_octree_head head, fm_octree_spot spot) {
    fm_octree_spot cell = spot;
    cell.level = head.kind == FM_GPU_BRICKS ? 0 : spot.level;
    return cell;
}

FM_RULE fm_octree_eight fm_distance_words(fm_octree_head head, fm_octree_spot spot) {
    fm_uint leaf = fm_octree_leaf_of(spot);
    if (head.kind != FM_GPU_BRICKS) {
        return fm_octree_words_of(head.values, leaf);
    }
    fm_int edge = (1 << FM_BRICK_LEVEL) + 1, last = edge - 2;
    uint64_t first = FM_LONG(leaf) * FM_LONG(FM_BRICK_VALUES) +
                     FM_LONG((spot.cell[0] & last) + edge * ((spot.cell[1] & last) + edge * (spot.cell[2] & last)));
    fm_octree_eight eight;
    for (int i = 0; i < 8; i++) {
        eight.v[i] = FM_WORD(head.values, first + FM_LONG((i & 1) + edge * ((i >> 1 & 1) + edge * (i >> 2))));
    }
    return eight;
}

// The distances of a cell in its edges.
FM_RULE fm_cell fm_distance_cell(fm_octree_eight words, fm_v3 u, fm_float scale, fm_float less) {
    fm_cell cell;
    for (int i = 0; i < 8; i++) {
#ifdef __STDC__
        union {
            uint32_t bits;
            float value;
        } word = {words.v[i]};
        cell.v[i] = word.value * scale - less;
#else
        cell.v[i] = uintBitsToFloat(words.v[i]) * scale - less;
#endif
    }
    cell.part[0] = FM_MIN(FM_MAX(u.x, 0.0f), 1.0f);
    cell.part[1] = FM_MIN(FM_MAX(u.y, 0.0f), 1.0f);
    cell.part[2] = FM_MIN(FM_MAX(u.z, 0.0f), 1.0f);
    cell.base[0] = 0;
    cell.base[1] = 0;
    cell.base[2] = 0;
    return cell;
}

FM_RULE fm_cell fm_distance_turned(fm_cell cell, fm_float side) {
    fm_cell turned = cell;
    for (int i = 0; i < 8; i++) {
        turned.v[i] = cell.v[i] * side;
    }
    return turned;
}

FM_RULE fm_cell fm_distance_moved(fm_cell cell, fm_v3 by) {
    fm_cell moved = cell;
    moved.part[0] = cell.part[0] + by.x;
    moved.part[1] = cell.part[1] + by.y;
    moved.part[2] = cell.part[2] + by.z;
    return moved;
}

FM_RULE fm_v3 fm_distance_normal(fm_cell c) {
    fm_float x = c.part[0], y = c.part[1], z = c.part[2];
    return fm_unit(
        fm_v3_of(fm_lerp(fm_lerp(c.v[1] - c.v[0], c.v[3] - c.v[2], y), fm_lerp(c.v[5] - c.v[4], c.v[7] - c.v[6], y), z),
                 fm_lerp(fm_lerp(c.v[2] - c.v[0], c.v[3] - c.v[1], x), fm_lerp(c.v[6] - c.v[4], c.v[7] - c.v[5], x), z),
                 fm_lerp(fm_lerp(c.v[4] - c.v[0], c.v[5] - c.v[1], x), fm_lerp(c.v[6] - c.v[2], c.v[7] - c.v[3], x), y)));
}

FM_RULE fm_float fm_distance_least(fm_cell cell) {
    fm_float least = cell.v[0];
    for (int i = 1; i < 8; i++) {
        least = FM_MIN(least, cell.v[i]);
    }
    return least;
}

// Distance that is left at a place of the cell from its nearest corner's value.
FM_RULE fm_float fm_distance_room(fm_cell cell, fm_v3 u) {
    fm_int nearest = fm_octree_nearest_corner(u);
    fm_float value = cell.v[0];
    for (int i = 1; i < 8; i++) {
        value = i == nearest ? cell.v[i] : value;
    }
    return FM_SIZE_OF(value) - fm_octree_length(fm_less(u, fm_octree_corner_of(nearest)));
}

FM_RULE fm_octree_met fm_distance_by_cells(fm_octree_head head, fm_octree_ray ray, fm_float less) {
    fm_octree_met met = fm_octree_nothing();
    fm_octree_spot spot = fm_octree_nowhere();
    fm_uint leaves = 0u;
    fm_float t = 0, side = head.sign == 0 ? 1.0f : 0.0f;
    for (int i = 0; i < FM_CAST_STEPS && t <= ray.far; i++) {
        fm_v3 place = fm_add(ray.from, fm_times(ray.way, t));
        spot = fm_octree_seek(head, spot, place);
        if (!fm_octree_is_leaf(spot.word)) {
            t += fm_octree_empty_step(ray, spot, place);
            continue;
        }
        fm_octree_spot own = fm_distance_spot(head, spot);
        fm_float size = FM_F(1 << own.level), inverse = 1 / size;
        fm_v3 corner = fm_octree_corner(own), u = fm_times(fm_less(place, corner), inverse);
        fm_cell cell = fm_distance_cell(fm_distance_words(head, own), u, inverse / head.cell, less * inverse);
        leaves++;
        // Which side of the surface the ray is on is known when it first comes near.
        side = side != 0 ? side : (fm_cell_value(cell) < 0 ? -1.0f : 1.0f);
        cell = fm_distance_turned(cell, side);
        // Not beyond the ray's end, which may be in this cell.
        fm_float stay = FM_MIN(fm_octree_stay(ray, place, corner, size), ray.far - t + ray.nudge) * inverse;
        if (fm_distance_least(cell) <= 0) {
            fm_float s = fm_cubic_first(fm_cell_cubic(cell, ray.way), stay);
            if (s >= 0) {
                fm_v3 normal = fm_distance_normal(fm_distance_moved(cell, fm_times(ray.way, s)));
                met = fm_octree_meet(head, ray, t + s * size, normal, own.level);
                break;
            }
        }
        t += size * FM_MAX(stay, fm_distance_room(cell, u)) + ray.nudge;
    }
    met.reads = spot.reads + leaves;
    return met;
}

FM_RULE fm_octree_met fm_distance_by_samples(fm_octree_head head, fm_octree_ray ray, fm_float epsilon) {
    fm_octree_met met = fm_octree_nothing();
    fm_octree_spot spot = fm_octree_nowhere();
    fm_uint leaves = 0u, held = 0u;
    fm_octree_eight words;
    for (int k = 0; k < 8; k++) {
        words.v[k] = 0u;
    }
    fm_float t = 0, t_before = 0, before = 0, side = head.sign == 0 ? 1.0f : 0.0f;
    for (int i = 0; i < FM_CAST_STEPS && t <= ray.far; i++) {
        fm_v3 place = fm_add(ray.from, fm_times(ray.way, t));
        spot = fm_octree_seek(head, spot, place);
        if (!fm_octree_is_leaf(spot.word)) {
            t_before = t;
            before = 0;
            t += fm_octree_empty_step(ray, spot, place);
            continue;
        }
        fm_octree_spot own = fm_distance_spot(head, spot);
        if (spot.word != held || head.kind == FM_GPU_BRICKS) {
            words = fm_distance_words(head, own);
            held = spot.word;
            leaves++;
        }
        fm_v3 u = fm_times(fm_less(place, fm_octree_corner(own)), 1 / FM_F(1 << own.level));
        fm_cell cell = fm_distance_cell(words, u, 1 / head.cell, 0.0f);
        fm_float value = fm_cell_value(cell);
        side = side != 0 ? side : (value < 0 ? -1.0f : 1.0f);
        if (value * side <= epsilon) {
            fm_float part = before > epsilon ? (before - epsilon) / (before - value * side) : 1.0f;
            met = fm_octree_meet(head, ray, t_before + (t - t_before) * part, fm_distance_normal(cell), own.level);
            break;
        }
        t_before = t;
        before = value * side;
        t += before;
    }
    met.reads = spot.reads + leaves;
    return met;
}

// `epsilon` in world units.
FM_RULE fm_octree_met fm_cast_distance(fm_octree_head head, fm_v3 origin, fm_v3 way, fm_float first, fm_float last,
                                       fm_float epsilon) {
    fm_octree_ray ray = fm_octree_enter(head, origin, way, first, last);
    fm_float thin = FM_MAX(epsilon / head.cell, head.sign == 0 ? FM_UNSIGNED_THICKNESS : 0.0f);
    return head.stepped == 1 ? fm_distance_by_samples(head, ray, thin)
                             : fm_distance_by_cells(head, ray, head.sign == 0 ? thin : 0.0f);
}

#endif
