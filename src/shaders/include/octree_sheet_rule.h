// SPDX-License-Identifier: MIT
#ifndef FM_OCTREE_SHEET_RULE_H
#define FM_OCTREE_SHEET_RULE_H

// The eight vectors of a leaf, and rays that meet the one sheet of the surface that they stand on: one text for C and GLSL. Lengths
// are in edges of the cell, places u in it from 0 to 1.

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

// A corner's vector as its direction, of length 1 where it has one, and how far it reaches.
FM_PUSH_STRUCT(fm_vcp_arm) {
    fm_v3 way;
    fm_float reach;
};

FM_RULE fm_vcp_arm fm_vcp_arm_of(fm_v3 v) {
    fm_vcp_arm arm;
    arm.reach = fm_octree_length(v);
    arm.way = fm_times(v, arm.reach > 0 ? 1 / arm.reach : 0.0f);
    return arm;
}

FM_RULE fm_vcp_arm fm_vcp_arm_at(fm_octree_head head, fm_uint word, fm_uint leaf, fm_int i, fm_float size) {
    fm_vcp_arm arm;
    if (head.code == FM_GPU_FLOATS) {
        arm = fm_vcp_arm_of(fm_vcp_floats(head, leaf, i, 1 / (head.cell * size)));
    } else {
        arm.way = fm_vcp_direction(word, head.code);
        arm.reach = fm_vcp_radius(word, head.code, FM_OCTREE_REACH);
    }
    return arm;
}

#define FM_VCP_NO_SHEET -1
#define FM_VCP_SHEETS -2

// What a cell's eight vectors say along a ray where they stand on one sheet: at `s` the blend, by the weights of the place there,
// of value + rate s.
FM_PUSH_STRUCT(fm_vcp_sheet) {
    fm_float value[8];
    fm_float rate[8];
    fm_int corner;     // whose vector is the longest; FM_VCP_SHEETS where they stand on several that are parallel
    fm_float against;  // below 0: that vector goes against the ray, and what is ahead is negative
    fm_float bent;     // what the distances are off those of a sheet that curves evenly, at most
};

#define FM_VCP_ALIKE 0.5f  // the cosine to the longest vector that all others have at least, but for the sign, on one sheet
#define FM_VCP_BENT 0.5f   // what the distances may be off those that a sheet has that curves from one corner to the other

// Vectors with the longest one's direction are signed distances d to planes, those against it negative ones. Between corners their
// linear blend is too large by half of what curvature makes of the weights, and the blend of the distances to the planes, d - n e
// for a place e off the corner, too small by as much. Their mean, d - n e / 2, is right to the third order, and alike from both
// sides of a face. Two sheets that face each other from outside of a cell have such vectors, too, yet not one plane's distances.
FM_PUSH_STRUCT(fm_vcp_plane) {
    fm_v3 along, corner;
    fm_float reach;
    fm_float least, bent;
};

FM_RULE fm_vcp_plane fm_vcp_plane_of(fm_vcp_arm longest, fm_int corner) {
    fm_vcp_plane plane;
    plane.along = longest.way;
    plane.corner = fm_octree_corner_of(corner);
    plane.reach = longest.reach;
    plane.least = longest.reach > 0 ? 1.0f : 0.0f;
    plane.bent = 0;
    return plane;
}

// Whether a corner's vector stands on the sheet, too: the plane with what is known then.
FM_RULE fm_vcp_plane fm_vcp_plane_with(fm_vcp_plane given, fm_vcp_arm arm, fm_int i) {
    fm_vcp_plane plane = given;
    fm_float alike = fm_dot(arm.way, plane.along);
    plane.least = arm.reach > 0 ? FM_MIN(plane.least, FM_SIZE_OF(alike)) : plane.least;
    fm_float sign = alike < 0 ? -1.0f : 1.0f;
    // Half of the way by the one's direction, half by the other's: of a sheet right to the third order.
    fm_v3 mean = fm_times(fm_add(plane.along, arm.reach > 0 ? fm_times(arm.way, sign) : plane.along), 0.5f);
    fm_float reach = plane.reach - fm_dot(mean, fm_less(fm_octree_corner_of(i), plane.corner));
    plane.bent = FM_MAX(plane.bent, FM_SIZE_OF(reach - sign * arm.reach));
    return plane;
}

// Value and rate of a corner.
FM_PUSH_STRUCT(fm_vcp_pull) {
    fm_float value, rate;
};

FM_RULE fm_vcp_pull fm_vcp_pull_of(fm_vcp_plane plane, fm_vcp_arm arm, fm_int i, fm_v3 u, fm_v3 way) {
    fm_float sign = fm_dot(arm.way, plane.along) < 0 ? -1.0f : 1.0f;
    // A corner on the surface has no direction of its own.
    fm_v3 normal = arm.reach > 0 ? fm_times(arm.way, sign) : plane.along;
    fm_vcp_pull pull;
    pull.value = sign * arm.reach - 0.5f * fm_dot(normal, fm_less(u, fm_octree_corner_of(i)));
    pull.rate = -0.5f * fm_dot(normal, way);
    return pull;
}

FM_RULE fm_int fm_vcp_sheets(fm_vcp_plane plane, fm_int corner) {
    fm_int one = plane.bent < FM_VCP_BENT ? corner : FM_VCP_SHEETS;
    return plane.least > FM_VCP_ALIKE ? one : FM_VCP_NO_SHEET;
}

// Of the vectors of a leaf.
FM_RULE fm_vcp_sheet fm_vcp_sheet_in(fm_octree_head head, fm_octree_eight words, fm_uint leaf, fm_float size, fm_v3 u, fm_v3 way) {
    fm_vcp_sheet sheet;
    fm_float most = -1;
    fm_uint word = 0u;
    sheet.corner = 0;
    for (int i = 0; i < 8; i++) {
        fm_float length = head.code == FM_GPU_FLOATS ? fm_octree_length(fm_vcp_floats(head, leaf, i, 1.0f))
                                                     : fm_vcp_radius(words.v[i], head.code, 1.0f);
        word = length > most ? words.v[i] : word;
        sheet.corner = length > most ? i : sheet.corner;
        most = FM_MAX(most, length);
    }
    fm_vcp_plane plane = fm_vcp_plane_of(fm_vcp_arm_at(head, word, leaf, sheet.corner, size), sheet.corner);
    sheet.against = fm_dot(plane.along, way);
    for (int i = 0; i < 8; i++) {
        fm_vcp_arm arm = fm_vcp_arm_at(head, words.v[i], leaf, i, size);
        fm_vcp_pull pull = fm_vcp_pull_of(plane, arm, i, u, way);
        sheet.value[i] = pull.value;
        sheet.rate[i] = pull.rate;
        plane = fm_vcp_plane_with(plane, arm, i);
    }
    sheet.corner = fm_vcp_sheets(plane, sheet.corner);
    sheet.bent = plane.bent;
    return sheet;
}

// The blend along a ray: c[0] + c[1] s + ... + c[4] s^4.
FM_PUSH_STRUCT(fm_vcp_line) {
    fm_float c[5];
};

// Between neighbours along x values and rates blend to polynomials of degree 2, these along y to degree 3, and so on.
FM_RULE fm_vcp_line fm_vcp_line_of(fm_vcp_sheet sheet, fm_v3 u, fm_v3 way) {
    fm_vcp_line line;
    fm_float two[4][3];
    fm_float three[2][4];
    for (int i = 0; i < 4; i++) {
        fm_float value = sheet.value[2 * i + 1] - sheet.value[2 * i], rate = sheet.rate[2 * i + 1] - sheet.rate[2 * i];
        two[i][0] = sheet.value[2 * i] + u.x * value;
        two[i][1] = sheet.rate[2 * i] + u.x * rate + way.x * value;
        two[i][2] = way.x * rate;
    }
    for (int i = 0; i < 2; i++) {
        fm_float off[3];
        for (int k = 0; k < 3; k++) {
            off[k] = two[2 * i + 1][k] - two[2 * i][k];
        }
        three[i][0] = two[2 * i][0] + u.y * off[0];
        three[i][1] = two[2 * i][1] + u.y * off[1] + way.y * off[0];
        three[i][2] = two[2 * i][2] + u.y * off[2] + way.y * off[1];
        three[i][3] = way.y * off[2];
    }
    fm_float last = 0;
    for (int k = 0; k < 4; k++) {
        fm_float off = three[1][k] - three[0][k];
        line.c[k] = three[0][k] + u.z * off + way.z * last;
        last = off;
    }
    line.c[4] = way.z * last;
    return line;
}

FM_RULE fm_float fm_vcp_line_at(fm_vcp_line line, fm_float s) {
    return (((line.c[4] * s + line.c[3]) * s + line.c[2]) * s + line.c[1]) * s + line.c[0];
}

#define FM_VCP_PIECES 3    // of a ray's stay in a cell, in which a sheet is crossed once
#define FM_VCP_ROOTS 5     // steps to where
#define FM_VCP_SEAM 0.25f  // of epsilon
#define FM_VCP_BESIDE 10   // times that, how far beyond a cell its sheet goes on, for that of the next may end before it

// A piece of a ray's way through a cell, and the blend at its ends.
FM_PUSH_STRUCT(fm_vcp_piece) {
    fm_float low, high;
    fm_float at_low, at_high;
    fm_int met;  // 1: in it the sheet is met; 0: nowhere, and this is the last one
};

FM_RULE fm_vcp_piece fm_vcp_no_piece(void) {
    fm_vcp_piece piece;
    piece.low = 0;
    piece.high = 0;
    piece.at_low = 0;
    piece.at_high = 0;
    piece.met = 0;
    return piece;
}

// Where a ray meets a sheet. `before`: the blend where the cell before was left, 0 where that was none of a sheet; `slack`: by how
// much the two may differ where that cell is of another level; `closing`: how near to the sheet the ray may end.
FM_RULE fm_vcp_piece fm_vcp_piece_of(fm_vcp_line line, fm_float stay, fm_float before, fm_float slack, fm_float closing) {
    fm_vcp_piece piece = fm_vcp_no_piece();
    piece.at_low = line.c[0];
    piece.at_high = piece.at_low;
    bool seam = (before == 0 || before * piece.at_low < 0) && FM_MAX(FM_SIZE_OF(before), FM_SIZE_OF(piece.at_low)) < slack;
    for (int i = 1; i <= FM_VCP_PIECES && !seam && piece.at_low * piece.at_high > 0; i++) {
        piece.low = piece.high;
        piece.at_low = piece.at_high;
        piece.high = stay * FM_F(i) * (1.0f / FM_VCP_PIECES);
        piece.at_high = fm_vcp_line_at(line, piece.high);
    }
    bool crossed = !(piece.at_low * piece.at_high > 0);
    fm_float behind = stay + FM_VCP_BESIDE * slack, at_behind = fm_vcp_line_at(line, behind);
    if (!seam && !crossed && closing == 0 && piece.at_high * at_behind < 0) {
        crossed = true;
        piece.low = stay;
        piece.at_low = piece.at_high;
        piece.high = behind;
        piece.at_high = at_behind;
    }
    piece.met = seam || crossed || FM_SIZE_OF(piece.at_high) < closing ? 1 : 0;
    return piece;
}

FM_RULE fm_float fm_vcp_root(fm_vcp_line line, fm_vcp_piece given) {
    fm_vcp_piece piece = given;
    if (piece.at_low * piece.at_high > 0) {
        return piece.high;
    }
    for (int i = 0; i < FM_VCP_ROOTS && piece.at_low != piece.at_high; i++) {
        fm_float s = piece.low + (piece.high - piece.low) * (piece.at_low / (piece.at_low - piece.at_high));
        fm_float value = fm_vcp_line_at(line, s);
        // The end that stays counts for half of what it is, or it would stay for ever (Illinois).
        if (value * piece.at_high > 0) {
            piece.high = s;
            piece.at_high = value;
            piece.at_low *= 0.5f;
        } else {
            piece.low = s;
            piece.at_low = value;
            piece.at_high *= 0.5f;
        }
    }
    return piece.at_low != piece.at_high ? piece.low + (piece.high - piece.low) * (piece.at_low / (piece.at_low - piece.at_high))
                                         : piece.low;
}

// The sheet's normal at a place, as its longest vector has it: the blend of the corners' directions, which goes on from cell to
// cell without a step, so that a surface is smooth however near it is looked at. Those of FM_GPU_SHORT are too coarse for that;
// there it is the gradient of the blend of distances.
FM_RULE fm_v3 fm_vcp_sheet_normal(fm_octree_head head, fm_octree_eight words, fm_uint leaf, fm_float size, fm_int longest,
                                  fm_v3 u) {
    fm_uint word = words.v[0];
    for (int i = 1; i < 8; i++) {
        word = i == longest ? words.v[i] : word;
    }
    fm_v3 at = fm_v3_of(FM_MIN(FM_MAX(u.x, 0.0f), 1.0f), FM_MIN(FM_MAX(u.y, 0.0f), 1.0f), FM_MIN(FM_MAX(u.z, 0.0f), 1.0f));
    fm_v3 along = fm_vcp_arm_at(head, word, leaf, longest, size).way, sum = fm_v3_of(0, 0, 0);
    for (int i = 0; i < 8; i++) {
        fm_vcp_arm arm = fm_vcp_arm_at(head, words.v[i], leaf, i, size);
        fm_float sign = fm_dot(arm.way, along) < 0 ? -1.0f : 1.0f;
        fm_v3 normal = arm.reach > 0 ? fm_times(arm.way, sign) : along, off = fm_less(at, fm_octree_corner_of(i));
        fm_float value = sign * arm.reach - 0.5f * fm_dot(normal, off);
        // How the corner's weight grows along the axes.
        fm_float x = 1 - FM_SIZE_OF(off.x), y = 1 - FM_SIZE_OF(off.y), z = 1 - FM_SIZE_OF(off.z);
        fm_v3 grows = fm_v3_of((i & 1) == 1 ? y * z : -y * z, (i >> 1 & 1) == 1 ? x * z : -x * z, i >> 2 == 1 ? x * y : -x * y);
        fm_v3 slope = fm_less(fm_times(normal, 0.5f * x * y * z), fm_times(grows, value));
        sum = fm_add(sum, head.code == FM_GPU_SHORT ? slope : fm_times(normal, x * y * z));
    }
    return fm_unit(sum);
}

#endif
