// SPDX-License-Identifier: MIT
#ifndef FM_OCTREE_CLOSEST_RULE_H
#define FM_OCTREE_CLOSEST_RULE_H

// Rays through octrees of vectors to closest points: one text for C and GLSL. A read is that of a node, or of the eight vectors of
// a leaf. Source: Demir and Westermann 2015.
//
// As published (`stepped`), a ray is sampled: the interpolated vector's length is the step, and a length below epsilon is a hit.
// Ours looks at a cell as a whole. Where its eight vectors stand on one sheet of the surface, which almost all do, they are signed
// distances with their gradients, and the surface is where their blend is 0 (fm_vcp_sheet). Elsewhere, at edges and where sheets
// are close, what the eight planes of a cell say along a ray is linear, so that the first place within epsilon of one of them is
// known without steps, and only there the trilinear vector is looked at. A cell that no plane comes near costs no sample at all,
// and a ray along a surface no longer goes in steps of its small distance. Where a corner is so far from the surface that the whole
// way through the cell is clear, its length alone is looked at.

#include "octree_sheet_rule.h"

FM_RULE fm_v3 fm_vcp_trilinear(fm_vcp_cell cell, fm_v3 u) {
    fm_v3 sum = fm_v3_of(0, 0, 0);
    for (int i = 0; i < 8; i++) {
        sum = fm_add(sum, fm_times(cell.v[i], fm_octree_weight(i, u)));
    }
    return sum;
}

// Where a ray first comes within `epsilon` of a plane of the cell's, from u on and in edges of the cell.
FM_PUSH_STRUCT(fm_vcp_near) {
    fm_float s;  // +infinity: nowhere
    fm_int corner;
};

FM_RULE fm_vcp_near fm_vcp_nearest_plane(fm_vcp_cell cell, fm_v3 u, fm_v3 way, fm_float epsilon) {
    fm_vcp_near near;
    near.s = FM_INFINITY_F;
    near.corner = 0;
    for (int i = 0; i < 8; i++) {
        fm_v3 v = cell.v[i];
        fm_float length2 = fm_dot(v, v);
        // Along the vector from u to the plane, and what of it a unit of the ray uses up.
        fm_float scale = length2 > 0 ? 1 / FM_SQRT(length2) : 0.0f;
        fm_float apart = (length2 + fm_dot(v, fm_less(fm_octree_corner_of(i), u))) * scale;
        fm_float rate = fm_dot(v, way) * scale;
        fm_float left = FM_SIZE_OF(apart) - epsilon;
        fm_float s = left <= 0 ? 0.0f : (apart * rate > 0 ? left / FM_SIZE_OF(rate) : FM_INFINITY_F);
        if (length2 > 0 && s < near.s) {
            near.s = s;
            near.corner = i;
        }
    }
    return near;
}

// Where the surface is met in a cell.
FM_PUSH_STRUCT(fm_vcp_found) {
    fm_float s;    // edges of the cell from where the ray was; below 0: nowhere
    fm_float end;  // how far the cell was looked at; above the ray's stay in it: to its end
    fm_int corner;
};

// How far the plane that a vector stands on is along the ray, forwards or back, and at most 2 epsilon.
FM_RULE fm_float fm_vcp_onto(fm_v3 v, fm_v3 way, fm_float epsilon) {
    fm_float along = fm_dot(v, way);
    fm_float on = FM_SIZE_OF(along) > 1e-12f ? fm_dot(v, v) / along : 0.0f;
    return FM_MIN(FM_MAX(on, -2 * epsilon), 2 * epsilon);
}

// The mean of the corners' directions, each turned to the side from which the plane of `corner` was met, and towards the ray where
// it is at right angles to that: directions are kept finely, while those of the short vectors by a surface say little. Its length
// is 1 where the surface is flat, less where faces meet.
FM_RULE fm_v3 fm_vcp_mean(fm_vcp_cell cell, fm_v3 u, fm_v3 ray, fm_int corner) {
    fm_v3 side = cell.v[0], sum = fm_v3_of(0, 0, 0);
    for (int i = 1; i < 8; i++) {
        if (i == corner) {
            side = cell.v[i];
        }
    }
    fm_v3 outside = fm_less(fm_octree_facing(fm_unit(side), ray), fm_times(ray, 0.5f));
    fm_float all = 0;
    fm_v3 in_cell = fm_v3_of(FM_MIN(FM_MAX(u.x, 0.0f), 1.0f), FM_MIN(FM_MAX(u.y, 0.0f), 1.0f), FM_MIN(FM_MAX(u.z, 0.0f), 1.0f));
    for (int i = 0; i < 8; i++) {
        // A vector without length has no direction.
        fm_v3 way = fm_unit(cell.v[i]);
        fm_float weight = fm_dot(way, way) > 0 ? fm_octree_weight(i, in_cell) : 0.0f;
        sum = fm_add(sum, fm_times(way, fm_dot(way, outside) < 0 ? -weight : weight));
        all += weight;
    }
    return all > 0 ? fm_times(sum, 1 / all) : side;
}

// How much farther than epsilon from the trilinear vectors' surface that of a plane may be, in finest cells: along edges vectors to
// both faces meet, which do not cancel, and their surface would have slits.
#define FM_VCP_EDGE 0.15f

// ... at a place: nothing where the surface is flat, all of it in the middle of an edge of 67 degrees or more.
FM_RULE fm_float fm_vcp_slack(fm_vcp_cell cell, fm_v3 u, fm_v3 ray, fm_int corner) {
    fm_v3 mean = fm_vcp_mean(cell, u, ray, corner);
    return FM_VCP_EDGE * FM_MIN(6 * FM_MAX(1 - fm_octree_length(mean), 0.0f), 1.0f);
}

// Where the plane of a corner is, along the ray, forwards or back, and at most 2 epsilon.
FM_RULE fm_float fm_vcp_onto_plane(fm_vcp_cell cell, fm_v3 u, fm_v3 way, fm_int corner, fm_float epsilon) {
    fm_v3 v = cell.v[0];
    for (int i = 1; i < 8; i++) {
        if (i == corner) {
            v = cell.v[i];
        }
    }
    fm_float rate = fm_dot(v, way), apart = fm_dot(v, v) + fm_dot(v, fm_less(fm_octree_corner_of(corner), u));
    fm_float on = FM_SIZE_OF(rate) > 1e-12f ? apart / rate : 0.0f;
    return FM_MIN(FM_MAX(on, -2 * epsilon), 2 * epsilon);
}

#define FM_VCP_TRIES 24

// Whether a place may be of the surface: nothing of it is nearer to a corner than that one's vector's end, but for what curvature
// makes of it.
#define FM_VCP_DEEP 0.15f

FM_RULE bool fm_vcp_is_free(fm_vcp_cell cell, fm_v3 u) {
    fm_float deepest = 0;
    for (int i = 0; i < 8; i++) {
        fm_float deep = fm_octree_length(cell.v[i]) - fm_octree_length(fm_less(u, fm_octree_corner_of(i)));
        deepest = FM_MAX(deepest, deep);
    }
    return deepest < FM_VCP_DEEP;
}

// `stay` and `epsilon` in edges of the cell, whose edge is `size` finest ones. `several`: the vectors stand on parallel sheets,
// both sides of a thin wall, between which their blend is nowhere short; the planes themselves are the surface then.
FM_RULE fm_vcp_found fm_vcp_among_planes(fm_vcp_cell cell, fm_v3 u, fm_v3 way, fm_float stay, fm_float epsilon, fm_float size,
                                         bool several) {
    fm_vcp_found found;
    found.s = -1;
    found.corner = 0;
    fm_float s = 0;
    for (int i = 0; i < FM_VCP_TRIES; i++) {
        fm_vcp_near plane = fm_vcp_nearest_plane(cell, fm_add(u, fm_times(way, s)), way, epsilon);
        s += plane.s;
        if (!(s <= stay)) {
            break;
        }
        found.corner = plane.corner;
        fm_v3 at = fm_add(u, fm_times(way, s)), v = fm_vcp_trilinear(cell, at);
        fm_float length = fm_octree_length(v), slack = 0;
        if (length > epsilon && length <= epsilon + FM_VCP_EDGE / size) {
            slack = fm_vcp_slack(cell, at, way, plane.corner) / size;
        }
        if (length <= epsilon + slack || (several && fm_vcp_is_free(cell, at))) {
            // Published hits are where the length is epsilon. From there the plane leads onto the surface.
            fm_float onto =
                length <= epsilon ? fm_vcp_onto(v, way, epsilon) : fm_vcp_onto_plane(cell, at, way, plane.corner, epsilon);
            found.s = FM_MAX(s + onto, 0.0f);
            break;
        }
        // The length is a step, yet of vectors that are not exact half of one loses fewer edges.
        s += FM_MAX(length * 0.5f, FM_MIN(epsilon, 0.02f));
    }
    found.end = s;
    return found;
}

// A ray's way to the next cell that must be looked at as a whole.
FM_PUSH_STRUCT(fm_vcp_way) {
    fm_octree_spot spot;
    fm_octree_eight words;
    fm_float t, stay;
    fm_int steps;
    fm_uint leaves;  // read so far
};

// Over empty leaves, and over leaves with a corner that says that the whole way through is clear: no surface is nearer to a place
// than the nearest corner's length less the way to that corner. `t` is above ray.far where there is no such cell.
FM_RULE fm_vcp_way fm_vcp_go(fm_octree_head head, fm_octree_ray ray, fm_vcp_way before, fm_float epsilon) {
    fm_vcp_way go = before;
    for (; go.steps < FM_CAST_STEPS && go.t <= ray.far; go.steps++) {
        fm_v3 place = fm_add(ray.from, fm_times(ray.way, go.t));
        go.spot = fm_octree_seek(head, go.spot, place);
        if (!fm_octree_is_leaf(go.spot.word)) {
            go.t += fm_octree_empty_step(ray, go.spot, place);
            continue;
        }
        fm_float size = FM_F(1 << go.spot.level);
        fm_v3 corner = fm_octree_corner(go.spot), u = fm_times(fm_less(place, corner), 1 / size);
        fm_uint leaf = fm_octree_leaf_of(go.spot);
        fm_int nearest = fm_octree_nearest_corner(u);
        go.words = fm_vcp_words_of(head, leaf);
        go.leaves++;
        go.stay = fm_octree_stay(ray, place, corner, size);
        fm_float room =
            fm_vcp_length(head, go.words, leaf, nearest, size) - fm_octree_length(fm_less(u, fm_octree_corner_of(nearest)));
        if (!(room * size > go.stay + epsilon)) {
            return go;
        }
        go.t += FM_MAX(room * size - epsilon, go.stay + ray.nudge);
    }
    go.t = FM_INFINITY_F;
    return go;
}

// What is known where a ray has met the surface; in edges of the cell from where it was looked at.
FM_PUSH_STRUCT(fm_vcp_end) {
    fm_float s;          // below 0: nothing was met, or a sheet in `piece`
    fm_vcp_piece piece;  // of `line`
    fm_vcp_line line;
    fm_int corner;
};

FM_RULE fm_vcp_end fm_vcp_no_end(void) {
    fm_vcp_end end;
    end.s = -1;
    end.corner = 0;
    end.piece = fm_vcp_no_piece();
    for (int i = 0; i < 5; i++) {
        end.line.c[i] = 0;
    }
    return end;
}

#define FM_VCP_SIDE 0.02f  // edges from a sheet from which on the side of it is sure

// A sheet's normal towards the side that the ray came from, where that is known. What is met a little behind the horizon, as
// interpolation has it, is seen from the side.
FM_RULE fm_v3 fm_vcp_towards(fm_v3 normal, fm_v3 way, fm_float before) {
    if (FM_SIZE_OF(before) < FM_VCP_SIDE) {
        return normal;
    }
    fm_v3 own = fm_times(normal, before > 0 ? -1.0f : 1.0f);
    fm_float along = fm_dot(own, way);
    return along > 0 && along < 0.9f ? fm_unit(fm_less(own, fm_times(way, along))) : own;
}

FM_RULE fm_octree_met fm_vcp_meet(fm_octree_head head, fm_octree_ray ray, fm_vcp_way go, fm_vcp_end end) {
    fm_float size = FM_F(1 << go.spot.level);
    fm_v3 u = fm_times(fm_less(fm_add(ray.from, fm_times(ray.way, go.t)), fm_octree_corner(go.spot)), 1 / size), normal;
    fm_uint leaf = fm_octree_leaf_of(go.spot);
    fm_float s = end.s >= 0 ? end.s : fm_vcp_root(end.line, end.piece);
    u = fm_add(u, fm_times(ray.way, s));
    if (end.s >= 0) {
        normal = fm_unit(fm_vcp_mean(fm_vcp_cell_of(head, go.words, leaf, size), u, ray.way, end.corner));
    } else {
        normal = fm_vcp_towards(fm_vcp_sheet_normal(head, go.words, leaf, size, end.corner, u), ray.way, end.piece.at_low);
    }
    fm_octree_met met = fm_octree_meet(head, ray, go.t + s * size, normal, go.spot.level);
    met.mark = fm_octree_attribute_at(head, leaf, u);
    return met;
}

#define FM_VCP_TRUST 0.05f  // how far a sheet's blend may be off the distance to it beside what it is bent by, in edges of the cell

// Two loops, so that the rays of a group that runs in step look at their cells together, and what comes of it once all know.
FM_RULE fm_octree_met fm_closest_by_cells(fm_octree_head head, fm_octree_ray ray, fm_float epsilon) {
    fm_vcp_way go;
    go.spot = fm_octree_nowhere();
    for (int k = 0; k < 8; k++) {
        go.words.v[k] = 0u;
    }
    go.t = 0;
    go.stay = 0;
    go.steps = 0;
    go.leaves = 0u;
    fm_vcp_end end = fm_vcp_no_end();
    // How far a sheet is ahead where its cell was left, behind where below 0; 0: there was none.
    fm_float last = 0;
    for (int i = 0; i < FM_CAST_STEPS; i++) {
        go = fm_vcp_go(head, ray, go, epsilon);
        if (!(go.t <= ray.far)) {
            break;
        }
        fm_float size = FM_F(1 << go.spot.level), inverse = 1 / size;
        // Not beyond the ray's end, which may be in this cell.
        fm_float left = ray.far - go.t + ray.nudge, stay = FM_MIN(go.stay, left) * inverse;
        fm_v3 u = fm_times(fm_less(fm_add(ray.from, fm_times(ray.way, go.t)), fm_octree_corner(go.spot)), inverse);
        fm_uint leaf = fm_octree_leaf_of(go.spot);
        fm_vcp_sheet sheet = fm_vcp_sheet_in(head, go.words, leaf, size, u, ray.way);
        end.corner = sheet.corner;
        fm_float on = go.stay + ray.nudge;
        if (sheet.corner >= 0) {
            fm_float turned = sheet.against < 0 ? -1.0f : 1.0f, slack = FM_VCP_SEAM * epsilon * inverse;
            end.line = fm_vcp_line_of(sheet, u, ray.way);
            end.piece = fm_vcp_piece_of(end.line, stay, turned * last * inverse, slack, left <= on ? slack : 0.0f);
            last = turned * end.piece.at_high * size;
            on = go.stay + FM_MAX(ray.nudge, FM_SIZE_OF(last) - (FM_VCP_TRUST + sheet.bent) * size);
        } else {
            fm_vcp_found found = fm_vcp_among_planes(fm_vcp_cell_of(head, go.words, leaf, size), u, ray.way, stay,
                                                     epsilon * inverse, size, sheet.corner == FM_VCP_SHEETS);
            end.s = found.s;
            end.corner = found.corner;
            last = 0;
            on = found.end > stay ? on : found.end * size;
        }
        if (end.s >= 0 || end.piece.met == 1) {
            break;
        }
        go.t += on;
        go.steps++;
    }
    fm_octree_met met = fm_octree_nothing();
    if (end.s >= 0 || end.piece.met == 1) {
        met = fm_vcp_meet(head, ray, go, end);
    }
    met.reads = go.spot.reads + go.leaves;
    return met;
}

FM_RULE fm_octree_met fm_closest_by_samples(fm_octree_head head, fm_octree_ray ray, fm_float epsilon) {
    fm_octree_met met = fm_octree_nothing();
    fm_octree_spot spot = fm_octree_nowhere();
    fm_uint leaves = 0u, held = 0u;
    fm_vcp_cell cell;
    for (int k = 0; k < 8; k++) {
        cell.v[k] = fm_v3_of(0, 0, 0);
    }
    fm_float t = 0, t_before = 0, before = 0;
    for (int i = 0; i < FM_CAST_STEPS && t <= ray.far; i++) {
        fm_v3 place = fm_add(ray.from, fm_times(ray.way, t));
        spot = fm_octree_seek(head, spot, place);
        if (!fm_octree_is_leaf(spot.word)) {
            t_before = t;
            before = 0;
            t += fm_octree_empty_step(ray, spot, place);
            continue;
        }
        fm_float size = FM_F(1 << spot.level);
        fm_uint leaf = fm_octree_leaf_of(spot);
        // Neither a leaf nor eight vectors twice: those of a cell are kept while the ray is in it.
        if (spot.word != held) {
            cell = fm_vcp_cell_of(head, fm_vcp_words_of(head, leaf), leaf, size);
            held = spot.word;
            leaves++;
        }
        fm_v3 u = fm_times(fm_less(place, fm_octree_corner(spot)), 1 / size);
        fm_v3 v = fm_vcp_between(cell.v, u);
        fm_float length = fm_octree_length(v) * size;
        if (length <= epsilon) {
            // Where the length is epsilon, between this sample and the one before.
            fm_float part = before > epsilon ? (before - epsilon) / (before - length) : 1.0f;
            met = fm_octree_meet(head, ray, t_before + (t - t_before) * part, fm_unit(v), spot.level);
            met.mark = fm_octree_attribute_at(head, leaf, u);
            break;
        }
        // The length is always a step; what the plane allows for, up to 2 epsilon.
        fm_float ahead = fm_dot(v, ray.way) * size;
        fm_float plane = ahead > 0 ? length * length / ahead : FM_INFINITY_F;
        t_before = t;
        before = length;
        t += FM_MAX(length, FM_MIN(plane, 2 * epsilon));
    }
    met.reads = spot.reads + leaves;
    return met;
}

// `epsilon`: half of the surface's thickness, in world units.
FM_RULE fm_octree_met fm_cast_closest(fm_octree_head head, fm_v3 origin, fm_v3 way, fm_float first, fm_float last,
                                      fm_float epsilon) {
    fm_octree_ray ray = fm_octree_enter(head, origin, way, first, last);
    fm_float thin = epsilon / head.cell;
    return head.stepped == 1 ? fm_closest_by_samples(head, ray, thin) : fm_closest_by_cells(head, ray, thin);
}

#endif
