// SPDX-License-Identifier: MIT
// The nearest triangles of places near each other, within a bound that all share. The invocations of a subgroup first look for the
// triangles that any of them could want, each at a node or a triangle of its own, and then each tries those that it wants itself.
// Where packet.glsl computes the same for all, here every invocation does something else. Expects memory.glsl, bvh.glsl and groups
// of 64 invocations, all of which come here.

#extension GL_KHR_shader_subgroup_ballot : require
#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_vote : require

// How much fits, for each invocation of a subgroup.
const uint GATHER_NODES = 8;    // that wait
const uint GATHER_RECORDS = 9;  // of triangles whose leaf is near: two leaves' more than were waiting
const uint GATHER_DISCS = 2;    // around triangles that are near

const uint GATHER_THREADS = 64;
const uint GATHER_DEEP = 64;          // nodes that wait when only one is entered at a time, at most: BVH_STACK and some
const float GATHER_WIDER = 1 + 1e-5;  // so that what is as near as the best is tried, whatever rounding does
const float GATHER_SLIM = 1e-2;       // triangles lower than this part of their edges have no plane to speak of, ...
const float GATHER_TILT = 2e-4;       // ... the others' planes are known to this angle

// A disc holds a triangle: its centre, a place of the triangle, and radius; the plane's unit normal, or 0 of a ball.
shared uint gather_nodes[GATHER_THREADS * GATHER_NODES];
shared uint gather_waiting[GATHER_THREADS * GATHER_RECORDS];
shared vec4 gather_spheres[GATHER_THREADS * GATHER_DISCS];
shared vec3 gather_normals[GATHER_THREADS * GATHER_DISCS];
shared uint gather_records[GATHER_THREADS * GATHER_DISCS];
shared uint gather_counts[GATHER_THREADS];  // of a subgroup's records
shared uint gather_far[GATHER_THREADS];     // a float, not negative

struct gather_slice {
    uint nodes, room, waiting, discs, most;  // where the subgroup's parts begin, and what they hold
    uint number;
};

// What an invocation looks for.
struct gather_place {
    vec3 p;
    float slack;             // what rounding does to places as far from the origin
    vec3 middle, half_size;  // of a box that holds the places of the whole subgroup
};

// How far a box is from that of the places.
float gather_box_distance2(vec3 low, vec3 high, gather_place place) {
    vec3 d = max(max(low - (place.middle + place.half_size), (place.middle - place.half_size) - high), vec3(0));
    return dot(d, d);
}

void gather_sync() {
    subgroupMemoryBarrierShared();
    subgroupBarrier();
}

float gather_near(mesh_nearest best, gather_place place) {
    return sqrt(best.distance2) * GATHER_WIDER + place.slack;
}

// The squared distance of a disc's centre.
float centre_distance2(uint i, vec3 p) {
    vec3 way = p - gather_spheres[i].xyz;
    return dot(way, way);
}

bool ball_within(uint i, vec3 p, float near) {
    float reach = near + gather_spheres[i].w;
    return centre_distance2(i, p) <= reach * reach;
}

// The ball around a triangle comes near to many places that the disc does not.
bool disc_within(uint i, vec3 p, float near) {
    vec4 sphere = gather_spheres[i];
    vec3 way = p - sphere.xyz;
    float away2 = dot(way, way);
    float height = dot(gather_normals[i], way);
    float beside = max(sqrt(max(away2 - height * height, 0.0)) - sphere.w, 0.0);
    float reach = near + GATHER_TILT * (near + sphere.w);
    return height * height + beside * beside <= reach * reach;
}

void gather_try_one(fm_address records, uint record, vec3 p, inout mesh_nearest best) {
    vec3 a, b, c;
    uint triangle = bvh_record(records, record, a, b, c);
    bvh_try(p, a, b, c, triangle, best);
}

// Tries `found` triangles, at most 64: first the one whose centre is nearest, for that is a place of the triangle.
void gather_try(fm_address records, uint from, uint found, gather_place place, inout mesh_nearest best) {
    uint next = 0;
    float least2 = MESH_INFINITY;
    for (uint i = 0; i < found; i++) {
        float away2 = centre_distance2(from + i, place.p);
        next = away2 < least2 ? i : next;
        least2 = min(least2, away2);
    }
    float near = min(gather_near(best, place), sqrt(least2) * GATHER_WIDER + 1e-6 * gather_spheres[from + next].w + place.slack);
    uint low = 0, high = 0;
    for (uint i = 0; i < min(found, 32u); i++) {
        low |= ball_within(from + i, place.p, near) ? 1u << i : 0;
    }
    for (uint i = 32; i < found; i++) {
        high |= ball_within(from + i, place.p, near) ? 1u << (i - 32) : 0;
    }
    low &= next < 32 ? ~(1u << next) : ~0u;
    high &= next < 32 ? ~0u : ~(1u << (next - 32));
    bool more = true;
    while (more) {
        gather_try_one(records, gather_records[from + next], place.p, best);
        near = gather_near(best, place);
        more = false;
        while (!more && (low | high) != 0) {
            uint bits = low != 0 ? low : high;
            next = findLSB(bits) + (low != 0 ? 0 : 32);
            high = low != 0 ? high : bits & (bits - 1);
            low = low != 0 ? low & (low - 1) : 0;
            more = disc_within(from + next, place.p, near);
        }
    }
}

// Tries what was found, and says how far from the places' box anything that could be nearer is at most.
float gather_flush(fm_address records, gather_slice s, uint found, gather_place place, inout mesh_nearest best) {
    if (gl_SubgroupInvocationID == 0) {
        gather_far[s.number] = 0;
    }
    gather_sync();
    gather_try(records, s.discs, found, place, best);
    atomicMax(gather_far[s.number], floatBitsToUint(gather_near(best, place) + place.slack));
    gather_sync();
    return uintBitsToFloat(gather_far[s.number]);
}

// A disc around a triangle. False: it is farther from the places' box than `far`.
bool gather_disc(fm_address records, uint record, gather_place place, float far, out vec4 sphere, out vec3 normal) {
    vec3 a, b, c;
    uint triangle = bvh_record(records, record, a, b, c);
    vec3 centre = (a + b + c) * (1.0 / 3.0);
    float radius2 = max(dot(a - centre, a - centre), max(dot(b - centre, b - centre), dot(c - centre, c - centre)));
    sphere = vec4(centre, sqrt(radius2) * GATHER_WIDER);
    vec3 e = b - a;
    vec3 f = c - a;
    vec3 up = cross(e, f);
    float size2 = dot(up, up);
    normal = size2 > GATHER_SLIM * GATHER_SLIM * dot(e, e) * dot(f, f) && size2 > 1e-35 ? up * inversesqrt(size2) : vec3(0);
    vec3 beside = max(abs(centre - place.middle) - place.half_size, vec3(0));
    return triangle != FM_GPU_NONE && dot(beside, beside) <= (far + sphere.w) * (far + sphere.w);
}

// See gather_nearest.
mesh_nearest gather_walk(fm_mesh_refs m, gather_slice s, gather_place place, float bound) {
    mesh_nearest best = mesh_nearest(vec3(0), bound * bound, FM_GPU_NONE, FM_GPU_FACE);
    const fm_address records = bvh_records(m);
    const uint own = gl_SubgroupInvocationID;
    float far = bound * GATHER_WIDER + 2 * place.slack;  // what is nearer to the places' box is gathered
    uint nodes = 1;
    uint waiting = 0;
    uint found = 0;
    if (own == 0) {
        gather_nodes[s.nodes] = 0;
    }
    while (nodes > 0 || waiting > 0) {
        if (own == 0) {
            gather_counts[s.number] = waiting;
        }
        gather_sync();
        // Nodes before records, unless a subgroup's worth of these waits. A node that is entered leaves at most one more than
        // before; the last places are for going down one path at a time.
        bool deeper = nodes > 0 && waiting < gl_SubgroupSize;
        uint take = !deeper                      ? 0
                    : nodes + GATHER_DEEP < s.room ? min(min(nodes, gl_SubgroupSize), s.room - GATHER_DEEP - nodes)
                                                   : 1;
        uint node = own < take ? gather_nodes[s.nodes + nodes - 1 - own] : FM_GPU_NONE;
        nodes -= take;
        uint look = deeper ? 0 : min(waiting, gl_SubgroupSize);
        waiting -= look;
        bool looks = own < look;
        uint record = looks ? gather_waiting[s.waiting + waiting + own] : 0;
        gather_sync();
        if (deeper) {
            bool node0 = false, node1 = false;
            uvec2 child = uvec2(0);
            if (node != FM_GPU_NONE) {
                bvh_node n = bvh_load(m, node);
                bool in0 = gather_box_distance2(n.low0, n.high0, place) <= far * far;
                bool in1 = gather_box_distance2(n.low1, n.high1, place) <= far * far;
                bool run0 = in0 && n.count.x <= FM_LEAF_TRIANGLES;
                bool run1 = in1 && n.count.y <= FM_LEAF_TRIANGLES;
                node0 = in0 && !run0;
                node1 = in1 && !run1;
                child = n.child;
                // Two sibling leaves are one run.
                uint run = run0 ? n.child.x : n.child.y;
                uint count = (run0 ? n.count.x : 0) + (run1 ? n.count.y : 0);
                uint at = count > 0 ? s.waiting + atomicAdd(gather_counts[s.number], count) : 0;
                for (uint i = 0; i < count; i++) {
                    gather_waiting[at + i] = run + i;
                }
            }
            uvec4 some0 = subgroupBallot(node0);
            uvec4 some1 = subgroupBallot(node1);
            uint after = nodes + subgroupBallotBitCount(some0);
            if (node0) {
                gather_nodes[s.nodes + nodes + subgroupBallotExclusiveBitCount(some0)] = child.x;
            }
            if (node1) {
                gather_nodes[s.nodes + after + subgroupBallotExclusiveBitCount(some1)] = child.y;
            }
            nodes = after + subgroupBallotBitCount(some1);
            gather_sync();
            waiting = gather_counts[s.number];
            continue;
        }
        vec4 sphere = vec4(0);
        vec3 normal = vec3(0);
        bool near = looks && gather_disc(records, record, place, far, sphere, normal);
        uvec4 some = subgroupBallot(near);
        if (near) {
            uint at = s.discs + found + subgroupBallotExclusiveBitCount(some);
            gather_spheres[at] = sphere;
            gather_normals[at] = normal;
            gather_records[at] = record;
        }
        found += subgroupBallotBitCount(some);
        if (found + gl_SubgroupSize > s.most) {
            far = min(far, gather_flush(records, s, found, place, best));
            found = 0;
        }
    }
    gather_sync();
    if (found > 0) {
        gather_try(records, s.discs, found, place, best);
    }
    best.distance2 = best.triangle == FM_GPU_NONE ? MESH_INFINITY : best.distance2;
    return best;
}

// The nearest point below `bound`, as bvh_nearest_below finds it from the root. The box of `middle` and `half_size` holds the
// places of all invocations of the subgroup, which all name the same. Ends with a barrier of the group.
mesh_nearest gather_nearest(fm_mesh_refs m, vec3 p, float bound, vec3 middle, vec3 half_size) {
    // Slices hold GATHER_DEEP nodes and more.
    const uint width = max(gl_SubgroupSize, GATHER_DEEP / GATHER_NODES + 1);
    const uint slices = GATHER_THREADS / width;
    gather_place place = gather_place(p, 1e-6 * dot(abs(middle) + half_size, vec3(1)), middle, half_size);
    gather_slice s;
    s.number = gl_SubgroupID % slices;
    s.room = width * GATHER_NODES;
    s.nodes = s.number * s.room;
    s.waiting = s.number * width * GATHER_RECORDS;
    s.discs = s.number * width * GATHER_DISCS;
    s.most = min(width * GATHER_DISCS, 64);
    mesh_nearest best;
    for (uint round = 0; round * slices < gl_NumSubgroups; round++) {
        if (gl_SubgroupID / slices == round) {
            best = gather_walk(m, s, place, bound);
        }
        barrier();
    }
    return best;
}
