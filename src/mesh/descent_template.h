// SPDX-License-Identifier: MIT
// The descent, once an instruction set: included with FM_LEVEL(name) set to append its name.

#include "mesh/descent.h"
#include "mesh/lanes.h"

#include <string.h>

// How far points are from a triangle, and their offsets from the nearest point.
typedef struct seen {
    lanes distance2, x, y, z;
} seen;

// A cube of 2^level texels along each axis.
typedef struct cube {
    uint32_t low[3];
    int level;
} cube;

// The eighths of a cube: their middles from that of the grid or a local cube, their half edges and half diagonals. Those beyond the
// grid are not `there`.
typedef struct eighths {
    lanes at[3], half[3], radius;
    uint32_t there;
} eighths;

static cube eighth_of(const cube *whole, int which) {
    const uint32_t edge = UINT32_C(1) << (whole->level - 1);
    return (cube){
        {whole->low[0] + (which & 1 ? edge : 0), whole->low[1] + (which & 2 ? edge : 0), whole->low[2] + (which & 4 ? edge : 0)},
        whole->level - 1};
}

// The middle of the texels [low, low + edge) of an axis that are in the grid, in texels, and half their extent.
static double middle_of(uint32_t low, uint32_t edge, uint32_t size, double *half) {
    const double last = (double)fm_min_u64((uint64_t)low + edge, size) - 1;
    *half = (last - low) / 2;
    return (low + last) / 2;
}

static bool inside_grid(const fm_descent *job, const cube *part) {
    return part->low[0] < job->grid.shape.x && part->low[1] < job->grid.shape.y && part->low[2] < job->grid.shape.z;
}

// `from` is a place in the grid in texels.
static eighths eighths_of(const fm_descent *job, const cube *whole, const double from[3]) {
    const uint32_t size[3] = {job->grid.shape.x, job->grid.shape.y, job->grid.shape.z};
    eighths parts = {0};
    for (int lane = 0; lane < LANES; lane++) {
        const cube part = eighth_of(whole, lane);
        if (!inside_grid(job, &part)) {
            continue;
        }
        parts.there |= 1u << lane;
        double square = 0;
        for (int axis = 0; axis < 3; axis++) {
            const double scale = job->grid.spacing[axis] / job->unit;
            double half;
            const double at = middle_of(part.low[axis], 1u << part.level, size[axis], &half);
            parts.at[axis][lane] = (float)((at - from[axis]) * scale);
            parts.half[axis][lane] = (float)(half * scale);
            square += half * scale * half * scale;
        }
        parts.radius[lane] = (float)sqrt(square) * 1.000001f;
    }
    return parts;
}

// How much farther than the nearest a triangle may be, with what floats lose: the two bounds of descent.h.
typedef struct limits {
    lanes farthest;        // beyond this a triangle is out
    lanes nearest, slack;  // the second bound starts from here
    lanes direction[3];    // of the nearest
} limits;

static inline limits limits_of(const fm_descent *job, const eighths *parts, lanes nearest, lanes x, lanes y, lanes z,
                               float rounding) {
    limits all;
    const lanes scale = lanes_all(1) / lanes_max(nearest, lanes_all(1e-30f));
    all.slack = nearest * 4e-6f + parts->radius * 1e-5f + rounding;
    // What no texel of the band can be nearest to is out too.
    all.farthest = lanes_min(nearest + parts->radius, lanes_all(job->band)) + parts->radius + all.slack;
    all.nearest = nearest + parts->radius * parts->radius * lanes_all(0.5f) * scale + all.slack;
    all.direction[0] = x * scale;
    all.direction[1] = y * scale;
    all.direction[2] = z * scale;
    return all;
}

// Whether the second bound keeps what is `distance` away in the direction (x, y, z) / length.
LANE_OP lane_mask keeps(const limits *all, const eighths *parts, lanes distance, lanes x, lanes y, lanes z, lanes length) {
    const lanes scale = lanes_all(1) / lanes_max(length, lanes_all(1e-30f));
    const lanes turn = lanes_abs(x * scale - all->direction[0]) * parts->half[0] +
                       lanes_abs(y * scale - all->direction[1]) * parts->half[1] +
                       lanes_abs(z * scale - all->direction[2]) * parts->half[2];
    return (distance - all->nearest <= turn) & (distance <= all->farthest);
}

// --- Cubes of many triangles, by spheres ---

static void sphere_offsets(const fm_sphere *sphere, const eighths *parts, lanes *x, lanes *y, lanes *z, lanes *distance2) {
    *x = parts->at[0] - sphere->centre[0];
    *y = parts->at[1] - sphere->centre[1];
    *z = parts->at[2] - sphere->centre[2];
    *distance2 = *x * *x + *y * *y + *z * *z;
}

static inline uint32_t sphere_of(const fm_descent_worker *own, int level, uint64_t i) {
    return own->list[level] ? own->list[level][i] : (uint32_t)i;
}

// Notes for each of the level's list which eighths of the cube it may be nearest in. Returns the eighths that are computed at all.
static uint32_t split_spheres(const fm_descent *job, fm_descent_worker *own, const cube *whole) {
    const double middle[3] = {(job->grid.shape.x - 1.0) / 2, (job->grid.shape.y - 1.0) / 2, (job->grid.shape.z - 1.0) / 2};
    const eighths parts = eighths_of(job, whole, middle);
    const int level = whole->level;
    lanes best = lanes_all(INFINITY), best_x = {0}, best_y = {0}, best_z = {0}, x, y, z, distance2;
    for (uint64_t i = 0; i < own->count[level]; i++) {
        sphere_offsets(&job->spheres[sphere_of(own, level, i)], &parts, &x, &y, &z, &distance2);
        const lane_mask nearer = distance2 < best;
        best = lanes_min(best, distance2);
        best_x = lanes_select(nearer, best_x, x);
        best_y = lanes_select(nearer, best_y, y);
        best_z = lanes_select(nearer, best_z, z);
    }
    const lanes nearest = lanes_sqrt(best);
    const limits all = limits_of(job, &parts, nearest, best_x, best_y, best_z, job->half_grid * 1e-6f);
    uint32_t wanted = 0;
    for (uint64_t i = 0; i < own->count[level]; i++) {
        const fm_sphere *sphere = &job->spheres[sphere_of(own, level, i)];
        sphere_offsets(sphere, &parts, &x, &y, &z, &distance2);
        const lanes length = lanes_sqrt(distance2);
        const lanes distance = length - sphere->radius;
        const uint32_t kept = lanes_bits(keeps(&all, &parts, distance, x, y, z, length)) & parts.there;
        own->mask[level][i] = (uint8_t)kept;
        // A cube is computed when one of its texels may lie in the band.
        wanted |= lanes_bits(distance - parts.radius - all.slack <= lanes_all(job->band)) & kept;
    }
    return wanted;
}

static void draw_spheres(fm_descent_worker *own, int level, int which) {
    uint32_t *list = own->list[level - 1];
    uint64_t count = 0;
    for (uint64_t i = 0; i < own->count[level]; i++) {
        list[count] = sphere_of(own, level, i);
        count += (uint64_t)own->mask[level][i] >> which & 1;
    }
    own->count[level - 1] = count;
}

// --- One triangle ---

static void cross(const double a[3], const double b[3], double result[3]) {
    for (int axis = 0; axis < 3; axis++) {
        const int next = (axis + 1) % 3, last = (axis + 2) % 3;
        result[axis] = a[next] * b[last] - a[last] * b[next];
    }
}

static double dot(const double a[3], const double b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

// The frame of a triangle whose longest edge is `edge`, `length` long. A triangle that is thinner than what doubles can tell its
// normal from counts as a line.
static bool frame_of(const double e[3][3], int edge, double length, double u[3], double v[3], double n[3]) {
    for (int axis = 0; axis < 3; axis++) {
        u[axis] = length > 0 ? e[edge][axis] / length : axis == 0;
    }
    cross(e[edge], e[(edge + 1) % 3], n);
    const double area = sqrt(dot(n, n));
    const bool flat = !(area > 1e-9 * length * length);
    if (flat) {
        // Any normal does.
        const double other[3] = {fabs(u[0]) < 0.5, fabs(u[0]) >= 0.5, 0};
        cross(u, other, n);
    }
    const double scale = 1 / (flat ? sqrt(dot(n, n)) : area);
    for (int axis = 0; axis < 3; axis++) {
        n[axis] *= scale;
    }
    cross(n, u, v);
    return flat;
}

// The point of the triangle that is nearest to (x, y) in its plane.
static void nearest_in_plane(const double at[3][2], const double direction[3][2], const double length[3], bool flat, double *x,
                             double *y) {
    double best = INFINITY, best_x = *x, best_y = *y;
    bool inside = !flat;
    for (int i = 0; i < 3; i++) {
        const double dx = *x - at[i][0], dy = *y - at[i][1];
        const double along = fmin(fmax(dx * direction[i][0] + dy * direction[i][1], 0), length[i]);
        const double px = at[i][0] + along * direction[i][0], py = at[i][1] + along * direction[i][1];
        const double distance2 = (*x - px) * (*x - px) + (*y - py) * (*y - py);
        inside = inside && direction[i][0] * dy - direction[i][1] * dx > 0;
        if (distance2 < best) {
            best = distance2;
            best_x = px;
            best_y = py;
        }
    }
    *x = inside ? *x : best_x;
    *y = inside ? *y : best_y;
}

// `middle` of the local cube in world units.
static void prepare(const fm_descent *job, uint32_t triangle, const double middle[3], fm_prepared *result) {
    const double scale = 1 / job->unit;
    double corners[3][3], e[3][3], length[3], u[3], v[3], n[3];
    for (int i = 0; i < 3; i++) {
        const float *vertex = job->mesh->vertices[job->mesh->triangles[triangle][i]];
        for (int axis = 0; axis < 3; axis++) {
            corners[i][axis] = ((double)vertex[axis] - middle[axis]) * scale;
        }
    }
    int longest = 0;
    for (int i = 0; i < 3; i++) {
        for (int axis = 0; axis < 3; axis++) {
            e[i][axis] = corners[(i + 1) % 3][axis] - corners[i][axis];
        }
        length[i] = sqrt(dot(e[i], e[i]));
        longest = length[i] > length[longest] ? i : longest;
    }
    const bool flat = frame_of((const double(*)[3])e, longest, length[longest], u, v, n);
    double at[3][2], direction[3][2];
    for (int i = 0; i < 3; i++) {
        double offset[3];
        for (int axis = 0; axis < 3; axis++) {
            offset[axis] = corners[i][axis] - corners[longest][axis];
        }
        at[i][0] = dot(offset, u);
        at[i][1] = flat ? 0 : dot(offset, v);
        const double ahead = dot(e[i], u);
        // Edges without length run against the longest, so that nothing is to the left of all three.
        const double forward = i == longest || ahead > 0 ? 1 : -1;
        length[i] = flat ? fabs(ahead) : length[i];
        const bool line = flat || !(length[i] > 0);
        direction[i][0] = line ? forward : ahead / length[i];
        direction[i][1] = line ? 0 : dot(e[i], v) / length[i];
    }
    double x = -dot(corners[longest], u), y = -dot(corners[longest], v);
    nearest_in_plane((const double(*)[2])at, (const double(*)[2])direction, length, flat, &x, &y);
    for (int axis = 0; axis < 3; axis++) {
        result->origin[axis] = (float)(corners[longest][axis] + x * u[axis] + y * v[axis]);
        result->u[axis] = (float)u[axis];
        result->v[axis] = (float)v[axis];
        result->n[axis] = (float)n[axis];
    }
    for (int i = 0; i < 3; i++) {
        const double dx = at[i][0] - x, dy = at[i][1] - y;
        result->direction[i][0] = (float)direction[i][0];
        result->direction[i][1] = (float)direction[i][1];
        const double start = direction[i][0] * dx + direction[i][1] * dy;
        result->start[i] = (float)start;
        result->end[i] = (float)(start + length[i]);
        result->aside[i] = (float)(direction[i][0] * dy - direction[i][1] * dx);
    }
    result->triangle = triangle;
    result->longest = longest;
}

// A point in the triangle's frame.
typedef struct framed {
    lanes x, y, z;
} framed;

LANE_OP framed frame_point(const fm_prepared *t, const lanes at[3]) {
    const lanes x = at[0] - t->origin[0], y = at[1] - t->origin[1], z = at[2] - t->origin[2];
    return (framed){x * t->u[0] + y * t->u[1] + z * t->u[2], x * t->v[0] + y * t->v[1] + z * t->v[2],
                    x * t->n[0] + y * t->n[1] + z * t->n[2]};
}

// How far the point is over the end of an edge, with the end's sign, and how far to the left of it.
LANE_OP void beside_edge(const fm_prepared *t, int i, const framed *p, lanes *over, lanes *aside) {
    const lanes along = p->x * t->direction[i][0] + p->y * t->direction[i][1];
    *over = along - lanes_min(lanes_max(along, lanes_all(t->start[i])), lanes_all(t->end[i]));
    *aside = p->y * t->direction[i][0] - p->x * t->direction[i][1] - t->aside[i];
}

// Above 0 for all three edges of what is inside. Beyond the tip of a needle, whose long edges are one but for rounding, `aside`
// alone does not tell.
LANE_OP lanes within_edge(const fm_prepared *t, int i, lanes over, lanes aside) {
    return i == t->longest ? aside - lanes_abs(over) * 1e30f : aside;
}

LANE_OP lanes distance2_to(const fm_prepared *t, const lanes at[3]) {
    const framed p = frame_point(t, at);
    lanes over, aside;
    beside_edge(t, 0, &p, &over, &aside);
    lanes planar = over * over + aside * aside, inside = within_edge(t, 0, over, aside);
    for (int i = 1; i < 3; i++) {
        beside_edge(t, i, &p, &over, &aside);
        planar = lanes_min(planar, over * over + aside * aside);
        inside = lanes_min(inside, within_edge(t, i, over, aside));
    }
    return lanes_select(inside > 0, planar, lanes_all(0)) + p.z * p.z;
}

// The offset from the nearest point too.
LANE_OP seen see(const fm_prepared *t, const lanes at[3]) {
    const framed p = frame_point(t, at);
    lanes planar = lanes_all(INFINITY), inside = lanes_all(INFINITY), x = {0}, y = {0};
    for (int i = 0; i < 3; i++) {
        lanes over, aside;
        beside_edge(t, i, &p, &over, &aside);
        const lanes distance2 = over * over + aside * aside;
        const lane_mask nearer = distance2 < planar;
        planar = lanes_min(planar, distance2);
        inside = lanes_min(inside, within_edge(t, i, over, aside));
        x = lanes_select(nearer, x, over * t->direction[i][0] - aside * t->direction[i][1]);
        y = lanes_select(nearer, y, over * t->direction[i][1] + aside * t->direction[i][0]);
    }
    const lane_mask face = inside > 0;
    planar = lanes_select(face, planar, lanes_all(0));
    x = lanes_select(face, x, lanes_all(0));
    y = lanes_select(face, y, lanes_all(0));
    return (seen){planar + p.z * p.z, x * t->u[0] + y * t->v[0] + p.z * t->n[0], x * t->u[1] + y * t->v[1] + p.z * t->n[1],
                  x * t->u[2] + y * t->v[2] + p.z * t->n[2]};
}

// --- Cubes of few triangles, prepared ---

// Whether the texel lies inside, by the pseudonormal of the feature that its nearest point is on.
static bool is_inside(const fm_descent *job, const fm_prepared *t, const float at[3]) {
    float q[3], p[3];
    for (int axis = 0; axis < 3; axis++) {
        q[axis] = at[axis] - t->origin[axis];
    }
    p[0] = q[0] * t->u[0] + q[1] * t->u[1] + q[2] * t->u[2];
    p[1] = q[0] * t->v[0] + q[1] * t->v[1] + q[2] * t->v[2];
    p[2] = q[0] * t->n[0] + q[1] * t->n[1] + q[2] * t->n[2];
    float best = INFINITY, x = 0, y = 0;
    bool face = true;
    fm_feature feature = FM_FEATURE_FACE;
    for (int i = 0; i < 3; i++) {
        const float along = p[0] * t->direction[i][0] + p[1] * t->direction[i][1];
        const float over = along - fminf(fmaxf(along, t->start[i]), t->end[i]);
        const float aside = p[1] * t->direction[i][0] - p[0] * t->direction[i][1] - t->aside[i];
        const float distance2 = over * over + aside * aside;
        face = face && aside > 0 && (i != t->longest || over == 0);
        if (distance2 < best) {
            best = distance2;
            x = over * t->direction[i][0] - aside * t->direction[i][1];
            y = over * t->direction[i][1] + aside * t->direction[i][0];
            feature = over < 0   ? FM_FEATURE_CORNER_0 + (unsigned)i
                      : over > 0 ? FM_FEATURE_CORNER_0 + (unsigned)(i + 1) % 3
                                 : FM_FEATURE_EDGE_0 + (unsigned)i;
        }
    }
    if (face) {
        return p[2] < 0;
    }
    double normal[3], side = 0;
    fm_pseudonormal(job->mesh, t->triangle, feature, normal);
    for (int axis = 0; axis < 3; axis++) {
        side += normal[axis] * (double)(x * t->u[axis] + y * t->v[axis] + p[2] * t->n[axis]);
    }
    return side < 0;
}

static void write_texel(const fm_descent *job, const cube *whole, int lane, const fm_prepared *t, const lanes at[3],
                        float distance2) {
    if (!(distance2 <= job->band2)) {
        return;
    }
    const cube part = eighth_of(whole, lane);
    const uint64_t texel = part.low[0] + job->grid.shape.x * (part.low[1] + (uint64_t)job->grid.shape.y * part.low[2]);
    const float distance = (float)((double)sqrtf(distance2) * job->unit);
    const float place[3] = {at[0][lane], at[1][lane], at[2][lane]};
    job->distance[texel] = job->sided && is_inside(job, t, place) ? -distance : distance;
    if (job->triangles && distance <= job->hide_beyond) {
        job->triangles[texel] = t->triangle;
    }
}

static void leaf(const fm_descent *job, const fm_descent_worker *own, const cube *whole, const double from[3], const uint32_t *list,
                 uint64_t count) {
    const fm_prepared *all = own->prepared;
    const eighths parts = eighths_of(job, whole, from);
    lanes best = lanes_all(INFINITY);
    lane_mask which = {0};
    for (uint64_t i = 0; i < count; i++) {
        const lanes distance2 = distance2_to(&all[list[i]], parts.at);
        const lane_mask nearer = distance2 < best;
        const lane_mask index = (lane_mask){0} + (int32_t)list[i];
        best = lanes_min(best, distance2);
        which = (index & nearer) | (which & ~nearer);
    }
    for (int lane = 0; lane < LANES; lane++) {
        if (parts.there >> lane & 1) {
            write_texel(job, whole, lane, &all[which[lane]], parts.at, best[lane]);
        }
    }
}

static void descend_local(const fm_descent *job, fm_descent_worker *own, const cube *whole, const double from[3],
                          const uint32_t *list, uint64_t count) {
    if (whole->level == 1) {
        leaf(job, own, whole, from, list, count);
        return;
    }
    const fm_prepared *all = own->prepared;
    const eighths parts = eighths_of(job, whole, from);
    lanes *distances = own->distances;
    lanes best = lanes_all(INFINITY);
    lane_mask which = {0};
    for (uint64_t i = 0; i < count; i++) {
        distances[i] = distance2_to(&all[list[i]], parts.at);
        const lane_mask nearer = distances[i] < best;
        const lane_mask index = (lane_mask){0} + (int32_t)list[i];
        best = lanes_min(best, distances[i]);
        which = (index & nearer) | (which & ~nearer);
    }
    lanes x = {0}, y = {0}, z = {0};
    for (int lane = 0; lane < LANES; lane++) {
        const lanes at[3] = {lanes_all(parts.at[0][lane]), lanes_all(parts.at[1][lane]), lanes_all(parts.at[2][lane])};
        const seen nearest = see(&all[which[lane]], at);
        x[lane] = nearest.x[0];
        y[lane] = nearest.y[0];
        z[lane] = nearest.z[0];
    }
    const lanes nearest = lanes_sqrt(best);
    const limits limit = limits_of(job, &parts, nearest, x, y, z, 0);
    const uint32_t wanted = lanes_bits(nearest - parts.radius - limit.slack <= lanes_all(job->band)) & parts.there;
    const lanes farthest2 = limit.farthest * limit.farthest;
    uint8_t *mask = own->local_mask[whole->level];
    for (uint64_t i = 0; wanted && i < count; i++) {
        mask[i] = 0;
        if (lanes_bits(distances[i] <= farthest2) & wanted) {
            const seen other = see(&all[list[i]], parts.at);
            const lanes distance = lanes_sqrt(other.distance2);
            mask[i] = (uint8_t)lanes_bits(keeps(&limit, &parts, distance, other.x, other.y, other.z, distance));
        }
    }
    for (int lane = 0; lane < LANES; lane++) {
        if (!(wanted >> lane & 1)) {
            continue;
        }
        uint32_t *drawn = own->local_list[whole->level - 1];
        uint64_t left = 0;
        for (uint64_t i = 0; i < count; i++) {
            drawn[left] = list[i];
            left += (uint64_t)mask[i] >> lane & 1;
        }
        const cube part = eighth_of(whole, lane);
        descend_local(job, own, &part, from, drawn, left);
    }
}

static void place_of(const fm_descent *job, const cube *whole, double texel[3], double world[3]) {
    const uint32_t size[3] = {job->grid.shape.x, job->grid.shape.y, job->grid.shape.z};
    for (int axis = 0; axis < 3; axis++) {
        double half;
        texel[axis] = middle_of(whole->low[axis], 1u << whole->level, size[axis], &half);
        world[axis] = job->grid.origin[axis] + texel[axis] * job->grid.spacing[axis];
    }
}

static void prepare_local(const fm_descent *job, fm_descent_worker *own, const cube *whole) {
    double texel[3], world[3];
    place_of(job, whole, texel, world);
    fm_prepared *all = own->prepared;
    uint32_t *list = own->local_list[DESCENT_LOCAL_LEVEL];
    const uint64_t count = own->count[whole->level];
    for (uint64_t i = 0; i < count; i++) {
        prepare(job, job->ids[sphere_of(own, whole->level, i)], world, &all[i]);
        list[i] = (uint32_t)i;
    }
    descend_local(job, own, whole, texel, list, count);
}

// The texels of a cube with more triangles than are prepared at once: each is prepared when its turn comes.
static void leaf_of_many(const fm_descent *job, const fm_descent_worker *own, const cube *whole) {
    double texel[3], world[3];
    place_of(job, whole, texel, world);
    const eighths parts = eighths_of(job, whole, texel);
    lanes best = lanes_all(INFINITY);
    fm_prepared nearest[LANES], t;
    for (uint64_t i = 0; i < own->count[1]; i++) {
        prepare(job, job->ids[sphere_of(own, 1, i)], world, &t);
        const lanes distance2 = distance2_to(&t, parts.at);
        const uint32_t nearer = lanes_bits(distance2 < best);
        best = lanes_min(best, distance2);
        for (int lane = 0; lane < LANES; lane++) {
            nearest[lane] = nearer >> lane & 1 ? t : nearest[lane];
        }
    }
    for (int lane = 0; lane < LANES; lane++) {
        if (parts.there >> lane & 1) {
            write_texel(job, whole, lane, &nearest[lane], parts.at, best[lane]);
        }
    }
}

static void descend_spheres(const fm_descent *job, fm_descent_worker *own, const cube *whole) {
    const int level = whole->level;
    if (level <= DESCENT_LOCAL_LEVEL && own->count[level] <= DESCENT_LOCAL_MOST) {
        prepare_local(job, own, whole);
    } else if (level == 1) {
        leaf_of_many(job, own, whole);
    } else {
        const uint32_t wanted = split_spheres(job, own, whole);
        for (int which = 0; which < 8; which++) {
            if (wanted >> which & 1) {
                const cube part = eighth_of(whole, which);
                draw_spheres(own, level, which);
                descend_spheres(job, own, &part);
            }
        }
    }
}

// --- The way down to an item ---

static cube cube_of(uint64_t code, int level) {
    cube whole = {{0, 0, 0}, level};
    for (int bit = 0; code >> 3 * bit != 0; bit++) {
        for (int axis = 0; axis < 3; axis++) {
            whole.low[axis] |= (uint32_t)(code >> (3 * bit + axis) & 1) << (bit + level);
        }
    }
    return whole;
}

// Draws the item's list, level by level, from where its way parts from that of the worker's last item. False where nothing of the
// item can lie in the band.
static bool reach_item(const fm_descent *job, fm_descent_worker *own, uint64_t code, int item_level) {
    for (int level = job->levels; level >= item_level; level--) {
        const uint64_t at = code >> 3 * (level - item_level);
        if (own->known[level] == DESCENT_NOTHING || own->code[level] != at) {
            if (level == job->levels) {
                own->count[level] = job->count;
            } else {
                draw_spheres(own, level + 1, (int)(at & 7));
            }
            own->code[level] = at;
            own->known[level] = DESCENT_LIST;
        }
        if (level == item_level) {
            break;
        }
        if (own->known[level] == DESCENT_LIST) {
            const cube whole = cube_of(at, level);
            own->wanted[level] = split_spheres(job, own, &whole);
            own->known[level] = DESCENT_SPLIT;
        }
        if (!(own->wanted[level] >> (code >> 3 * (level - 1 - item_level) & 7) & 1)) {
            return false;
        }
    }
    return true;
}

void FM_LEVEL(fm_descend)(void *user, uint64_t begin, uint64_t end, uint32_t worker) {
    const fm_descent *job = user;
    fm_descent_worker *own = &job->workers[worker];
    const int item_level = job->levels < DESCENT_ITEM_LEVEL ? job->levels : DESCENT_ITEM_LEVEL;
    for (uint64_t i = begin; i < end; i++) {
        if (reach_item(job, own, job->items[i], item_level)) {
            const cube whole = cube_of(job->items[i], item_level);
            descend_spheres(job, own, &whole);
        }
    }
}
