// SPDX-License-Identifier: MIT
#ifndef FM_MESH_COMPOSE_H
#define FM_MESH_COMPOSE_H

// A scene's field from its objects' local ones: what is kept of each object, and which texels an update touches.

#include "fathom/sdf.h"
#include "mesh/scene.h"
#include "shaders/include/compose_rule.h"
#include "volume/volume.h"

typedef struct fm_gpu_composed fm_gpu_composed;

// The local field of an object, or of several that were added with the same shape.
typedef struct fm_composed_local {
    fm_volume *volume;
    uint64_t users;
} fm_composed_local;

typedef struct fm_composed_item {
    uint64_t shape_version;          // of the local field; 0: it is to be made
    fm_mesh *mesh;                   // kept of an object that has deformed
    fm_composed_local *local;        // NULL: of an object without triangles
    fm_transform3 place;             // with which `record` was made
    bool changed;                    // since the field was composed
    fm_compose_object record, next;  // as the field has it, and as it is to be
} fm_composed_item;

// The blocks of texels that an update does; `list` in ascending order, NULL for all of them.
typedef struct fm_compose_work {
    uint32_t *list;
    uint64_t count;
} fm_compose_work;

struct fm_composed {
    fm_context *context;
    fm_scene *scene;
    fm_volume *field;
    double spacing;  // of local fields, when `most` allows it
    float band;      // in world units
    uint32_t most;
    fm_sign sign;
    fm_composed_item *items;
    uint64_t item_count, item_room;
    uint32_t blocks[3];
    uint8_t *marks;  // a byte a block, 0 between updates
    uint32_t *list;  // room for all blocks
    bool fresh;      // all texels are to be done
    uint64_t touched;
    fm_gpu_composed *gpu;
};

// compose_local.c: makes the local field of object `number` fit its present shape and works out `next` for its present place.
fm_result fm_composed_prepare(fm_composed *composed, uint64_t number);
// Of an item; the last user destroys it. Nothing may be in flight.
void fm_composed_release(fm_composed *composed, fm_composed_item *item);
// FM_ERROR_INVALID_ARGUMENT unless the object's place is a rotation or reflection and a shift.
fm_result fm_composed_check_place(const fm_scene_object *object, uint64_t number);

// The texels of the work's blocks, of the items' `next`.
void fm_host_compose(fm_composed *composed, const fm_compose_work *work);
fm_result fm_gpu_compose(fm_composed *composed, const fm_compose_work *work, fm_ticket *ticket);
// Nothing may be in flight.
void fm_gpu_compose_destroy(fm_composed *composed);

#endif
