// SPDX-License-Identifier: MIT
#ifndef FM_OCTREE_BEAM_RULE_H
#define FM_OCTREE_BEAM_RULE_H

// Beams: how far all rays of a tile go before they may meet anything. One text for C and GLSL. All rays of the tile are within
// `spread` * t of the middle one at their places t. What nodes say is a bound for a ball around the middle ray's place, and so for
// the rays as long as they are in it.

#include "octree_cast_rule.h"
#include "octree_picture_shared.h"

// Kinds whose nodes are those of octree_nodes_rule.h.
FM_RULE bool fm_octree_has_beams(fm_int kind) {
    return kind == FM_GPU_CLOSEST || kind == FM_GPU_DISTANCE || kind == FM_GPU_VOXELS || kind == FM_GPU_BRICKS;
}

// A place of the octree's box, and no less than how far the surface is from there; all in finest cells.
FM_RULE fm_float fm_octree_clearance(fm_octree_head head, fm_octree_spot spot, fm_v3 place, fm_float empty) {
    if (!fm_octree_is_leaf(spot.word)) {
        return fm_octree_is_internal(spot.word) ? 0.0f : FM_F(spot.word - FM_U(FM_NODE_EMPTY)) * empty;
    }
    if (head.kind == FM_GPU_VOXELS) {
        return 0;
    }
    fm_octree_spot own = fm_distance_spot(head, spot);
    fm_float size = FM_F(1 << own.level);
    fm_v3 u = fm_times(fm_less(place, fm_octree_corner(own)), 1 / size);
    fm_uint leaf = fm_octree_leaf_of(spot);
    fm_int corner = fm_octree_nearest_corner(u);
    fm_float length = 0;
    if (head.kind != FM_GPU_CLOSEST) {
        fm_octree_eight words = fm_distance_words(head, own);
        length = FM_SIZE_OF(fm_distance_cell(words, u, 1 / (head.cell * size), 0.0f).v[corner]);
    } else {
        length = fm_vcp_length(head, fm_vcp_words_of(head, leaf), leaf, corner, size);
    }
    // Less what the code may have made it longer by.
    return size * (length - fm_octree_length(fm_less(u, fm_octree_corner_of(corner))) - 0.01f);
}

FM_PUSH_STRUCT(fm_octree_beam) {
    fm_float t;  // world units from the camera
    fm_uint reads;
};

FM_RULE fm_float fm_octree_within(fm_float at, fm_float low, fm_float high) {
    return FM_MIN(FM_MAX(at, low), high);
}

// `way` of length 1, in the middle of the tile; `margin` in finest cells.
FM_RULE fm_octree_beam fm_octree_beam_of(fm_octree_head head, fm_v3 origin, fm_v3 way, fm_float spread, fm_float margin) {
    fm_float scale = 1 / head.cell;
    fm_v3 base = fm_v3_of(head.origin[0], head.origin[1], head.origin[2]), from = fm_times(fm_less(origin, base), scale);
    fm_v3 low = fm_times(fm_less(fm_v3_of(head.low[0], head.low[1], head.low[2]), base), scale);
    fm_v3 high = fm_octree_last_place(head);
    fm_v3 middle = fm_times(fm_add(low, high), 0.5f);
    fm_float far = fm_octree_length(fm_less(from, middle)) + fm_octree_length(fm_less(high, middle)) + 1;
    fm_float least = FM_MIN(fm_octree_length(fm_less(high, low)) * FM_OCTREE_BEAM_PART, FM_OCTREE_BEAM_ROOM);
    fm_float empty = head.cutoff * scale * (1.0f / 1073741823.0f), t = 0;
    fm_octree_spot spot = fm_octree_nowhere();
    fm_octree_beam beam;
    beam.reads = 0u;
    for (int i = 0; i < FM_OCTREE_BEAM_STEPS && t < far; i++) {
        fm_v3 at = fm_add(from, fm_times(way, t));
        // From outside of the box no place of the surface, which is in it, is nearer than from the nearest place of the box.
        fm_v3 place = fm_v3_of(fm_octree_within(at.x, low.x, high.x), fm_octree_within(at.y, low.y, high.y),
                               fm_octree_within(at.z, low.z, high.z));
        spot = fm_octree_seek(head, spot, place);
        beam.reads += fm_octree_is_leaf(spot.word) ? 1u : 0u;
        fm_float room = FM_MAX(fm_octree_clearance(head, spot, place, empty), fm_octree_length(fm_less(at, place)));
        room -= spread * t + margin;
        if (!(room > least)) {
            break;
        }
        t += room / (1 + spread);
    }
    beam.t = FM_MIN(t, far) * head.cell;
    beam.reads += spot.reads;
    return beam;
}

#endif
