// SPDX-License-Identifier: MIT
// The tree of a mesh on the device, and how it is walked. Expects memory.glsl.
//
// A node is four times 16 bytes: the boxes of its two children (low, high, low, high), two references, two counts of triangles. A
// child of at most FM_LEAF_TRIANGLES is a leaf, and its reference the first of its records; else it is a node. Node 0 is the root.
// A record is three times 16 bytes: three corners and the triangle's number, or FM_GPU_NONE of one that does not fit; such a one
// has an empty box (low +infinity, high -infinity). Records lie in the order of the leaves, so that two sibling leaves are one run.
//
// The highest bit in which the keys below a node differ falls from node to node down a path. Keys are 32 bits of a code, of which
// 31 ever differ, then the 31 bits of a place: a path has at most 62 nodes. Each of them leaves at most one child waiting.

#include "mesh.glsl"

const uint BVH_STACK = 62;

struct mesh_hit {
    float t;        // +infinity: none
    uint triangle;  // FM_GPU_NONE likewise
    float u, v;     // weights of the second and third corner
    uint back;      // 1: from behind
};

// A node as it lies in memory.
struct bvh_node {
    vec3 low0, high0, low1, high1;
    uvec2 child, count;
};

bvh_node bvh_load(fm_mesh_refs m, uint node) {
    fm_address at = m.nodes + uint64_t(node) * FM_NODE_BYTES;
    vec4 v0 = uintBitsToFloat(ref_u32x4(at).v);
    vec4 v1 = uintBitsToFloat(ref_u32x4(at + 16).v);
    vec4 v2 = uintBitsToFloat(ref_u32x4(at + 32).v);
    uvec4 v3 = ref_u32x4(at + 48).v;
    return bvh_node(v0.xyz, vec3(v0.w, v1.xy), vec3(v1.zw, v2.x), v2.yzw, v3.xy, v3.zw);
}

// Where the records begin.
fm_address bvh_records(fm_mesh_refs m) {
    return m.nodes + uint64_t(max(m.triangle_count, 1u)) * FM_NODE_BYTES;
}

// Returns the triangle's number.
uint bvh_record(fm_address records, uint place, out vec3 a, out vec3 b, out vec3 c) {
    fm_address at = records + uint64_t(place) * FM_RECORD_BYTES;
    vec4 v0 = uintBitsToFloat(ref_u32x4(at).v);
    vec4 v1 = uintBitsToFloat(ref_u32x4(at + 16).v);
    uvec4 v2 = ref_u32x4(at + 32).v;
    a = v0.xyz;
    b = vec3(v0.w, v1.xy);
    c = vec3(v1.zw, uintBitsToFloat(v2.x));
    return v2.y;
}

// What is to be done below a node: a run of records, a node next, a node later.
struct bvh_step {
    uint record, record_end;
    uint next, later;
    float later_key;
};

// Children whose key is below `limit` are entered, the one with the smaller key first.
bvh_step bvh_choose(bvh_node n, float key0, float key1, float limit) {
    bool in0 = key0 < limit;
    bool in1 = key1 < limit;
    bool leaf0 = n.count.x <= FM_LEAF_TRIANGLES;
    bool leaf1 = n.count.y <= FM_LEAF_TRIANGLES;
    bvh_step s;
    bool run0 = in0 && leaf0;
    bool run1 = in1 && leaf1;
    s.record = run0 ? n.child.x : n.child.y;
    s.record_end = run1 ? n.child.y + n.count.y : run0 ? n.child.x + n.count.x : s.record;
    bool node0 = in0 && !leaf0;
    bool node1 = in1 && !leaf1;
    bool swapped = node1 && (!node0 || key1 < key0);
    s.next = swapped ? n.child.y : node0 ? n.child.x : FM_GPU_NONE;
    s.later = !(node0 && node1) ? FM_GPU_NONE : swapped ? n.child.x : n.child.y;
    s.later_key = swapped ? key0 : key1;
    return s;
}

float bvh_box_distance2(vec3 low, vec3 high, vec3 p) {
    vec3 d = max(max(low - p, p - high), vec3(0));
    return dot(d, d);
}

// Replaces `best`, whose point is an offset from p, by the triangle if that is nearer, or as near and of a lower number.
void bvh_try(vec3 p, vec3 a, vec3 b, vec3 c, uint triangle, inout mesh_nearest best) {
    mesh_nearest found = origin_nearest(a - p, b - p, c - p);
    if (found.distance2 < best.distance2 || (found.distance2 == best.distance2 && triangle < best.triangle &&
                                             best.triangle != FM_GPU_NONE)) {
        best = found;
        best.triangle = triangle;
    }
}

// The nearest point below node `root` if its squared distance is below `bound2`. `hint` is a triangle that may be near, or
// FM_GPU_NONE. `point` is an offset from p: what is computed with it then loses nothing to the distance from the origin.
mesh_nearest bvh_nearest_below(fm_mesh_refs m, uint root, vec3 p, float bound2, uint hint) {
    mesh_nearest best = mesh_nearest(vec3(0), bound2, FM_GPU_NONE, FM_GPU_FACE);
    vec3 a, b, c;
    if (hint != FM_GPU_NONE) {
        mesh_corners(m, hint, a, b, c);
        if (mesh_triangle_fits(a, b, c)) {
            bvh_try(p, a, b, c, hint, best);
        }
    }
    fm_address records = bvh_records(m);
    uint waiting[BVH_STACK];
    float waiting_key[BVH_STACK];
    uint depth = 0;
    uint node = any(isnan(p)) || any(isinf(p)) ? FM_GPU_NONE : root;
    while (node != FM_GPU_NONE || depth > 0) {
        if (node == FM_GPU_NONE) {
            depth--;
            node = waiting_key[depth] < best.distance2 ? waiting[depth] : FM_GPU_NONE;
            continue;
        }
        bvh_node n = bvh_load(m, node);
        bvh_step s = bvh_choose(n, bvh_box_distance2(n.low0, n.high0, p), bvh_box_distance2(n.low1, n.high1, p), best.distance2);
        for (uint i = s.record; i < s.record_end; i++) {
            uint triangle = bvh_record(records, i, a, b, c);
            // Most triangles are not worth the ten times longer look at the triangle itself.
            float box2 = bvh_box_distance2(min(min(a, b), c), max(max(a, b), c), p);
            if (triangle != FM_GPU_NONE && box2 < best.distance2) {
                bvh_try(p, a, b, c, triangle, best);
            }
        }
        if (s.later != FM_GPU_NONE) {
            waiting[depth] = s.later;
            waiting_key[depth] = s.later_key;
            depth++;
        }
        node = s.next;
    }
    best.distance2 = best.triangle == FM_GPU_NONE ? MESH_INFINITY : best.distance2;
    return best;
}

mesh_nearest bvh_nearest(fm_mesh_refs m, vec3 p, float bound2, uint hint) {
    mesh_nearest best = bvh_nearest_below(m, 0, p, bound2, hint);
    best.point += p;
    return best;
}

// The lowest node below `root` that holds all triangles which come within `reach` of p.
uint bvh_descend(fm_mesh_refs m, uint root, vec3 p, float reach) {
    uint node = root;
    bool deeper = true;
    while (deeper) {
        bvh_node n = bvh_load(m, node);
        bool in0 = bvh_box_distance2(n.low0, n.high0, p) <= reach * reach;
        bool in1 = bvh_box_distance2(n.low1, n.high1, p) <= reach * reach;
        deeper = in0 != in1 && (in0 ? n.count.x : n.count.y) > FM_LEAF_TRIANGLES;
        node = !deeper ? node : in0 ? n.child.x : n.child.y;
    }
    return node;
}

// A ray turned so that it runs along its longest axis. Source: Woop, Benthin and Wald 2013.
struct bvh_ray {
    vec3 origin;
    vec3 inverse;  // of the direction, finite
    uvec3 axes;
    vec3 shear;
    float first, last;
};

// False for a ray that hits nothing: with numbers that are not finite, or no direction.
bool bvh_shear(vec3 origin, vec3 direction, float first, float last, out bvh_ray ray) {
    vec3 size = abs(direction);
    uint z = size.x >= size.y ? (size.x >= size.z ? 0 : 2) : (size.y >= size.z ? 1 : 2);
    float along = direction[z];
    if (!mesh_fits(origin) || any(isnan(direction)) || any(isinf(direction)) || along == 0 || !(first <= last)) {
        return false;
    }
    // The handedness stays, so that the sign of an area tells the side.
    uint x = (z + (along < 0 ? 2 : 1)) % 3;
    uint y = 3 - z - x;
    ray.origin = origin;
    // A direction of 0 never leaves its slab; a number so great that it leaves none in time serves.
    [[unroll]] for (uint i = 0; i < 3; i++) {
        ray.inverse[i] = size[i] > 1e-37 ? 1 / direction[i] : direction[i] < 0 ? -1e37 : 1e37;
    }
    ray.axes = uvec3(x, y, z);
    ray.shear = vec3(direction[x] / along, direction[y] / along, 1 / along);
    ray.first = first;
    ray.last = last;
    return true;
}

// Where the ray enters a box, +infinity if it does not. The box is widened by what rounding may shift a triangle.
float bvh_box_entry(vec3 low, vec3 high, bvh_ray ray) {
    vec3 l = low - ray.origin;
    vec3 h = high - ray.origin;
    vec3 most = max(abs(l), abs(h));
    float wider = 6e-7 * max(most.x, max(most.y, most.z));
    bvec3 back = lessThan(ray.inverse, vec3(0));
    vec3 enter = mix(l - wider, h + wider, back) * ray.inverse;
    vec3 leave = mix(h + wider, l - wider, back) * ray.inverse;
    float entry = max(max(enter.x, enter.y), max(enter.z, ray.first));
    float exit = min(min(leave.x, leave.y), min(leave.z, ray.last));
    return low.x <= high.x && entry - abs(entry) * 6e-7 <= exit + abs(exit) * 6e-7 ? entry - abs(entry) * 6e-7 : MESH_INFINITY;
}

// A corner as the ray sees it: aside in x and y, ahead in z. Every triangle of a corner must get the same bits. (Not the body of a
// loop: what unrolls one may lose that the operations are precise.)
vec3 bvh_sheared(bvh_ray ray, vec3 corner) {
    precise vec3 p = corner - ray.origin;
    precise float along = p[ray.axes.z];
    precise float shift_x = ray.shear.x * along;
    precise float shift_y = ray.shear.y * along;
    precise float x = p[ray.axes.x] - shift_x;
    precise float y = p[ray.axes.y] - shift_y;
    return vec3(x, y, ray.shear.z * along);
}

// The sign turns exactly with the order of the two corners, so that both triangles of an edge agree.
float bvh_side(vec3 first, vec3 second) {
    precise float left = first.x * second.y;
    precise float right = first.y * second.x;
    precise float side = left - right;
    return side;
}

// Replaces the hit by that of the triangle, if there is one within the range and nearer, or as near and of a lower number.
void bvh_ray_try(bvh_ray ray, vec3 a, vec3 b, vec3 c, uint triangle, inout mesh_hit hit) {
    a = bvh_sheared(ray, a);
    b = bvh_sheared(ray, b);
    c = bvh_sheared(ray, c);
    float u = bvh_side(c, b);
    float v = bvh_side(a, c);
    float w = bvh_side(b, a);
    if ((u < 0 || v < 0 || w < 0) && (u > 0 || v > 0 || w > 0)) {
        return;
    }
    float sum = u + v + w;
    if (sum == 0) {
        return;
    }
    vec3 weights = vec3(u, v, w) / sum;
    float t = dot(weights, vec3(a.z, b.z, c.z));
    if (t >= ray.first && t <= ray.last && (t < hit.t || (t == hit.t && triangle < hit.triangle))) {
        hit = mesh_hit(t, triangle, weights.y, weights.z, sum < 0 ? 1 : 0);
    }
}

mesh_hit bvh_cast(fm_mesh_refs m, vec3 origin, vec3 direction, float first, float last, bool any_hit) {
    mesh_hit hit = mesh_hit(MESH_INFINITY, FM_GPU_NONE, 0, 0, 0);
    bvh_ray ray;
    if (!bvh_shear(origin, direction, first, last, ray)) {
        return hit;
    }
    fm_address records = bvh_records(m);
    uint waiting[BVH_STACK];
    float waiting_key[BVH_STACK];
    uint depth = 0;
    uint node = 0;
    while ((node != FM_GPU_NONE || depth > 0) && !(any_hit && hit.triangle != FM_GPU_NONE)) {
        if (node == FM_GPU_NONE) {
            depth--;
            node = waiting_key[depth] < hit.t ? waiting[depth] : FM_GPU_NONE;
            continue;
        }
        bvh_node n = bvh_load(m, node);
        bvh_step s = bvh_choose(n, bvh_box_entry(n.low0, n.high0, ray), bvh_box_entry(n.low1, n.high1, ray), hit.t);
        for (uint i = s.record; i < s.record_end; i++) {
            vec3 a, b, c;
            uint triangle = bvh_record(records, i, a, b, c);
            if (triangle != FM_GPU_NONE) {
                bvh_ray_try(ray, a, b, c, triangle, hit);
            }
        }
        if (s.later != FM_GPU_NONE) {
            waiting[depth] = s.later;
            waiting_key[depth] = s.later_key;
            depth++;
        }
        node = s.next;
    }
    return hit;
}

// The first hit with first <= t <= last, where the place is origin + t direction.
mesh_hit bvh_first(fm_mesh_refs m, vec3 origin, vec3 direction, float first, float last) {
    return bvh_cast(m, origin, direction, first, last, false);
}

bool bvh_any(fm_mesh_refs m, vec3 origin, vec3 direction, float first, float last) {
    return bvh_cast(m, origin, direction, first, last, true).triangle != FM_GPU_NONE;
}
