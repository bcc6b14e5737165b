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

#include "octree_nodes_rule.h"
#include "vcp_rule.h"

// The vectors of a leaf by corner, x + 2 y + 4 z, in edges of its cell.
FM_PUSH_STRUCT(fm_vcp_cell) {
    fm_v3 v[8];
};

FM_RULE fm_v3 fm_vcp_floats(fm_octree_head head, fm_uint leaf, fm_int corner, fm_float scale) {
    uint64_t at = (FM_LONG(leaf) * FM_COLUMN_VALUES + FM_LONG(4 * (corner & 1) + (corner >> 1))) * FM_LONG(3);
    return fm_times(
        fm_v3_of(FM_REAL(head.values, at), FM_REAL(head.values, at + FM_LONG(1)), FM_REAL(head.values, at + FM_LONG(2))), scale);
}

// `size`: the leaf's edge in finest cells.
FM_RULE fm_vcp_cell fm_vcp_cell_of(fm_octree_head head, fm_octree_eight words, fm_uint leaf, fm_float size) {
    fm_vcp_cell cell;
    for (int i = 0; i < 8; i++) {
        cell.v[i] = head.code == FM_GPU_FLOATS ? fm_vcp_floats(head, leaf, i, 1 / (head.cell * size))
                                               : fm_vcp_decode(words.v[i], head.code, FM_OCTREE_REACH);
    }
    return cell;
}

// The length of the vector at corner `i`, in edges of the cell.
FM_RULE fm_float fm_vcp_length(fm_octree_head head, fm_octree_eight words, fm_uint leaf, fm_int i, fm_float size) {
    if (head.code == FM_GPU_FLOATS) {
        return fm_octree_length(fm_vcp_floats(head, leaf, i, 1 / (head.cell * size)));
    }
    fm_uint word = words.v[0];
    for (int k = 1; k < 8; k++) {
        word = k == i ? words.v[k] : word;
    }
    return fm_vcp_radius(word, head.code, FM_OCTREE_REACH);
}

FM_RULE fm_v3 fm_vcp_trilinear(fm_vcp_cell cell, fm_v3 u) {
    fm_v3 sum = fm_v3_of(0, 0, 0);
    for (int i = 0; i < 8; i++) {
        sum = fm_add(sum, fm_times(cell.v[i], fm_octree_weight(i, u)));
    }
    return sum;
}

// What a cell's eight vectors say along a ray where they stand on one sheet: at `s` the blend, by the weights of the place there,
// of value + rate s.
FM_PUSH_STRUCT(fm_vcp_sheet) {
    fm_float value[8];
    fm_float rate[8];
    fm_int corner;     // whose vector is the longest; below 0: they stand on none or on several
    fm_float against;  // below 0: that vector goes against the ray, and what is ahead is negative
};

#define FM_VCP_ALIKE 0.75f  // the cosine to the longest vector that all others have at least, but for the sign, on one sheet
#define FM_VCP_BENT 0.5f    // what the distances may be off the plane that it stands on, in edges of the cell

// Vectors with the longest one's direction are signed distances d to planes, those against it negative ones. Between corners their
// linear blend is too large by half of what curvature makes of the weights, and the blend of the distances to the planes, d - n e
// for a place e off the corner, too small by as much. Their mean, d - n e / 2, is right to the third order, and alike from both
// sides of a face. Two sheets that face each other from outside of a cell have such vectors, too, yet not one plane's distances.
FM_RULE fm_vcp_sheet fm_vcp_sheet_of(fm_vcp_cell cell, fm_v3 u, fm_v3 way) {
    fm_vcp_sheet sheet;
    fm_v3 longest = cell.v[0];
    fm_float most = fm_dot(longest, longest);
    sheet.corner = 0;
    for (int i = 1; i < 8; i++) {
        fm_float length2 = fm_dot(cell.v[i], cell.v[i]);
        if (length2 > most) {
            most = length2;
            longest = cell.v[i];
            sheet.corner = i;
        }
    }
    fm_float least = most > 0 ? 1.0f : 0.0f, bent = 0;
    longest = fm_unit(longest);
    sheet.against = fm_dot(longest, way);
    fm_float plane = FM_SQRT(most) + fm_dot(longest, fm_octree_corner_of(sheet.corner));
    for (int i = 0; i < 8; i++) {
        fm_v3 v = cell.v[i], corner = fm_octree_corner_of(i);
        fm_float length = fm_octree_length(v), alike = fm_dot(v, longest);
        fm_float scale = length > 0 ? (alike < 0 ? -1.0f : 1.0f) / length : 0.0f;
        // A corner on the surface has no direction of its own.
        fm_v3 normal = length > 0 ? fm_times(v, scale) : longest;
        least = length > 0 ? FM_MIN(least, alike * scale) : least;
        length = alike < 0 ? -length : length;
        bent = FM_MAX(bent, FM_SIZE_OF(plane - fm_dot(longest, corner) - length));
        sheet.value[i] = length - 0.5f * fm_dot(normal, fm_less(u, corner));
        sheet.rate[i] = -0.5f * fm_dot(normal, way);
    }
    if (!(least > FM_VCP_ALIKE && bent < FM_VCP_BENT)) {
        sheet.corner = -1;
    }
    return sheet;
}

FM_RULE fm_float fm_vcp_between_two(fm_float a, fm_float b, fm_float part) {
    return a + (b - a) * part;
}

FM_RULE fm_float fm_vcp_sheet_at(fm_vcp_sheet sheet, fm_v3 u, fm_v3 way, fm_float s) {
    fm_v3 at = fm_add(u, fm_times(way, s));
    fm_float side[4];
    for (int i = 0; i < 4; i++) {
        side[i] = fm_vcp_between_two(sheet.value[2 * i] + sheet.rate[2 * i] * s, sheet.value[2 * i + 1] + sheet.rate[2 * i + 1] * s,
                                     at.x);
    }
    return fm_vcp_between_two(fm_vcp_between_two(side[0], side[1], at.y), fm_vcp_between_two(side[2], side[3], at.y), at.z);
}

#define FM_VCP_PIECES 3    // of a ray's stay in a cell, in which a sheet is crossed once
#define FM_VCP_ROOTS 4     // steps to where
#define FM_VCP_SEAM 0.25f  // of epsilon

// Where a ray meets a sheet.
FM_PUSH_STRUCT(fm_vcp_root) {
    fm_float s;     // below 0: nowhere
    fm_float last;  // the blend where the ray leaves the cell
};

// `before`: the blend where the cell before was left, 0 where that was none of a sheet; `slack`: by how much the two may differ.
FM_RULE fm_vcp_root fm_vcp_on_sheet(fm_vcp_sheet sheet, fm_v3 u, fm_v3 way, fm_float stay, fm_float before, fm_float slack) {
    fm_float low = 0, high = 0, at_high = fm_vcp_sheet_at(sheet, u, way, 0.0f), at_low = at_high;
    bool seam = (before == 0 || before * at_high < 0) && FM_MAX(FM_SIZE_OF(before), FM_SIZE_OF(at_high)) < slack;
    for (int i = 1; i <= FM_VCP_PIECES && at_low * at_high > 0; i++) {
        low = high;
        at_low = at_high;
        high = stay * FM_F(i) * (1.0f / FM_VCP_PIECES);
        at_high = fm_vcp_sheet_at(sheet, u, way, high);
    }
    fm_vcp_root root;
    root.last = at_high;
    root.s = seam ? 0.0f : -1.0f;
    if (seam || at_low * at_high > 0) {
        return root;
    }
    for (int i = 0; i < FM_VCP_ROOTS && at_low != at_high; i++) {
        fm_float part = at_low / (at_low - at_high), s = low + (high - low) * part, value = fm_vcp_sheet_at(sheet, u, way, s);
        // The end that stays counts for half of what it is, or it would stay for ever (Illinois).
        if (value * at_high > 0) {
            high = s;
            at_high = value;
            at_low *= 0.5f;
        } else {
            low = s;
            at_low = value;
            at_high *= 0.5f;
        }
    }
    root.s = at_low != at_high ? low + (high - low) * (at_low / (at_low - at_high)) : low;
    return root;
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
    fm_float s;     // edges of the cell from where the ray was; below 0: nowhere
    fm_float end;   // how far the cell was looked at; above the ray's stay in it: to its end
    fm_float last;  // how far the sheet is ahead where the cell is left, behind where below 0, in edges; 0: that is not known
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

FM_RULE fm_vcp_found fm_vcp_among_planes(fm_vcp_cell cell, fm_v3 u, fm_v3 way, fm_float stay, fm_float epsilon, fm_float size) {
    fm_vcp_found found;
    found.s = -1;
    found.last = 0;
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
        if (length <= epsilon + slack) {
            // Published hits are where the length is epsilon. From there the plane leads onto the surface.
            fm_float onto =
                length <= epsilon ? fm_vcp_onto(v, way, epsilon) : fm_vcp_onto_plane(cell, at, way, plane.corner, epsilon);
            found.s = FM_MAX(s + onto, 0.0f);
            break;
        }
        // The length is a step, yet of vectors that are not exact half of one loses fewer edges.
        s += FM_MAX(length * 0.5f, 0.02f);
    }
    found.end = s;
    return found;
}

// `stay`, `epsilon` and `before`, what the cell before said last, in edges of the cell, whose edge is `size` finest ones.
FM_RULE fm_vcp_found fm_vcp_in_cell(fm_vcp_cell cell, fm_v3 u, fm_v3 way, fm_float stay, fm_float epsilon, fm_float size,
                                    fm_float before) {
    fm_vcp_sheet sheet = fm_vcp_sheet_of(cell, u, way);
    if (sheet.corner < 0) {
        return fm_vcp_among_planes(cell, u, way, stay, epsilon, size);
    }
    fm_float turned = sheet.against < 0 ? -1.0f : 1.0f;
    fm_vcp_root root = fm_vcp_on_sheet(sheet, u, way, stay, before * turned, FM_VCP_SEAM * epsilon);
    fm_vcp_found found;
    found.s = root.s;
    found.end = FM_INFINITY_F;
    found.last = root.last * turned;
    found.corner = sheet.corner;
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
        go.words = fm_octree_words_of(head.values, leaf);
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

// Two loops, so that the rays of a group that runs in step look at their cells together.
FM_RULE fm_octree_met fm_closest_by_cells(fm_octree_head head, fm_octree_ray ray, fm_float epsilon) {
    fm_octree_met met = fm_octree_nothing();
    fm_vcp_way go;
    go.spot = fm_octree_nowhere();
    for (int k = 0; k < 8; k++) {
        go.words.v[k] = 0u;
    }
    go.t = 0;
    go.stay = 0;
    go.steps = 0;
    go.leaves = 0u;
    fm_float last = 0, left = -1;
    for (int i = 0; i < FM_CAST_STEPS; i++) {
        go = fm_vcp_go(head, ray, go, epsilon);
        if (!(go.t <= ray.far)) {
            break;
        }
        fm_float size = FM_F(1 << go.spot.level), inverse = 1 / size;
        fm_v3 place = fm_add(ray.from, fm_times(ray.way, go.t));
        fm_v3 u = fm_times(fm_less(place, fm_octree_corner(go.spot)), inverse);
        fm_uint leaf = fm_octree_leaf_of(go.spot);
        fm_vcp_cell cell = fm_vcp_cell_of(head, go.words, leaf, size);
        fm_float before = go.t - left < 2 * ray.nudge ? last * inverse : 0.0f;
        fm_vcp_found found = fm_vcp_in_cell(cell, u, ray.way, go.stay * inverse, epsilon * inverse, size, before);
        if (found.s >= 0) {
            u = fm_add(u, fm_times(ray.way, found.s));
            met = fm_octree_meet(head, ray, go.t + found.s * size, fm_unit(fm_vcp_mean(cell, u, ray.way, found.corner)),
                                 go.spot.level);
            met.mark = fm_octree_attribute_at(head, leaf, u);
            break;
        }
        last = found.last * size;
        left = go.t + go.stay;
        go.t += found.end * size > go.stay ? go.stay + ray.nudge : found.end * size;
        go.steps++;
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
            cell = fm_vcp_cell_of(head, fm_octree_words_of(head.values, leaf), leaf, size);
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
