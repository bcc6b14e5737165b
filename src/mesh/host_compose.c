// SPDX-License-Identifier: MIT
// Composing on the processor: blocks of texels, shared out among the threads.

#include "mesh/compose.h"

typedef struct compose_job {
    const fm_composed *composed;
    const fm_compose_work *work;
} compose_job;

static float value_at(const fm_compose_object *object, const float *local, int x, int y, int z, float band) {
    const fm_compose_cell cell = fm_compose_find(*object, x, y, z);
    if (!cell.inside) {
        return band;
    }
    const uint64_t row = (uint64_t)object->shape[0], slice = row * (uint64_t)object->shape[1];
    const float *at = local + (uint64_t)cell.first[2] * slice + (uint64_t)cell.first[1] * row + (uint64_t)cell.first[0];
    const float corner[8] = {at[0], at[1], at[row], at[row + 1], at[slice], at[slice + 1], at[slice + row], at[slice + row + 1]};
    return fm_compose_between(corner, cell.weight);
}

static void add_object(const compose_job *job, const fm_composed_item *item, const int first[3], const int end[3], float *least) {
    const fm_compose_object *object = &item->next;
    int from[3], to[3];
    for (int axis = 0; axis < 3; axis++) {
        from[axis] = FM_GREATER(first[axis], object->begin[axis]);
        to[axis] = FM_LESSER(end[axis], object->end[axis]);
    }
    for (int z = from[2]; z < to[2]; z++) {
        for (int y = from[1]; y < to[1]; y++) {
            float *row = least + ((z - first[2]) * FM_COMPOSE_Y + (y - first[1])) * FM_COMPOSE_X;
            for (int x = from[0]; x < to[0]; x++) {
                const float value = value_at(object, item->local->volume->data, x, y, z, job->composed->band);
                row[x - first[0]] = FM_LESSER(row[x - first[0]], value);
            }
        }
    }
}

static void write_block(const fm_composed *composed, const int first[3], const int end[3], const float *least) {
    const fm_shape shape = composed->field->desc.shape;
    float *field = composed->field->data;
    for (int z = first[2]; z < end[2]; z++) {
        for (int y = first[1]; y < end[1]; y++) {
            const float *from = least + ((z - first[2]) * FM_COMPOSE_Y + (y - first[1])) * FM_COMPOSE_X;
            float *to = field + ((uint64_t)z * shape.y + (uint64_t)y) * shape.x;
            for (int x = first[0]; x < end[0]; x++) {
                to[x] = FM_GREATER(from[x - first[0]], -composed->band);
            }
        }
    }
}

static void compose_blocks(void *user, uint64_t begin, uint64_t end, uint32_t worker) {
    const compose_job *job = user;
    const fm_composed *composed = job->composed;
    const fm_shape shape = composed->field->desc.shape;
    const uint32_t sizes[3] = {shape.x, shape.y, shape.z}, edges[3] = {FM_COMPOSE_X, FM_COMPOSE_Y, FM_COMPOSE_Z};
    (void)worker;
    for (uint64_t i = begin; i < end; i++) {
        const uint64_t block = job->work->list ? job->work->list[i] : i;
        const uint64_t at[3] = {block % composed->blocks[0], block / composed->blocks[0] % composed->blocks[1],
                                block / composed->blocks[0] / composed->blocks[1]};
        float least[FM_COMPOSE_TEXELS];
        int first[3], last[3];
        for (int axis = 0; axis < 3; axis++) {
            first[axis] = (int)(at[axis] * edges[axis]);
            last[axis] = (int)fm_min_u64((uint64_t)first[axis] + edges[axis], sizes[axis]);
        }
        for (int k = 0; k < FM_COMPOSE_TEXELS; k++) {
            least[k] = composed->band;
        }
        for (uint64_t k = 0; k < composed->item_count; k++) {
            add_object(job, &composed->items[k], first, last, least);
        }
        write_block(composed, first, last, least);
    }
}

void fm_host_compose(fm_composed *composed, const fm_compose_work *work) {
    compose_job job = {composed, work};
    fm_pool_run(composed->context->pool, work->count, 16, compose_blocks, &job);
}
