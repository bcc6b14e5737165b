// SPDX-License-Identifier: MIT
#include "render/octree_loader.h"

#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <string.h>

struct fm_octree_loader {
    fm_context *context;  // not the thread's
    int file;
    const char *name;
    fm_octree_info like;
    fm_octree_grid grid;
    uint8_t *marks;
    uint64_t marks_bytes;
    pthread_t thread;
    pthread_mutex_t lock;
    pthread_cond_t asked, done;
    bool started, stop;
    // A ring: those from `taken` on are done, from `next` on they wait, up to `end`.
    fm_octree_load loads[FM_LOADS];
    uint64_t taken, next, end;
};

static bool alike(const fm_octree_info *a, const fm_octree_info *b) {
    return a->kind == b->kind && a->code == b->code && a->attribute == b->attribute && a->sign == b->sign;
}

// Whether a part's box is its cube and no more than a border of cells around it.
static bool in_place(const fm_octree_grid *grid, uint64_t part, const fm_octree_info *info) {
    enum { MOST_BORDER = 8 };
    const double edge = (double)grid->size;
    const uint64_t x = (uint64_t)grid->count[0], y = (uint64_t)grid->count[1];
    const uint64_t place[3] = {part % x, part / x % y, part / x / y};
    bool good = true;
    for (int axis = 0; axis < 3; axis++) {
        const double low = (double)grid->origin[axis] + (double)place[axis] * edge, high = low + edge;
        const double slack = 1e-3 * edge + 1e-5 * fmax(fabs(low), fabs(high)), border = MOST_BORDER * info->cell + slack;
        const double below = low - (double)info->low[axis], above = (double)info->high[axis] - high;
        good = good && below >= -slack && below <= border && above >= -slack && above <= border;
    }
    return good;
}

static fm_result read_part(const fm_octree_loader *loader, fm_octree_load *load) {
    char name[200];
    fm_fmo_header header;
    snprintf(name, sizeof name, "%.150s: part %llu", loader->name, (unsigned long long)load->part);
    FM_TRY(fm_fmo_read_at(loader->file, load->row.offset, load->image, load->row.bytes, name));
    FM_TRY(fm_fmo_open_image(load->image, load->row.bytes, name, &load->numbers, &header));
    if (header.header_sum != load->row.header_sum || header.image_bytes != load->row.bytes ||
        !alike(&load->numbers.info, &loader->like)) {
        return fm_fail(FM_ERROR_FORMAT, "%s: is not the one that the directory tells of: the file is damaged", name);
    }
    if (!in_place(&loader->grid, load->part, &load->numbers.info)) {
        return fm_fail(FM_ERROR_FORMAT, "%s: its box is not that of its place among the parts: the file is damaged", name);
    }
    const uint64_t marks = fm_octree_marks(&load->numbers);
    memset(loader->marks, 0, marks);
    return fm_fmo_check_image(load->image, name, &load->numbers, loader->marks);
}

static void *work(void *user) {
    fm_octree_loader *loader = user;
    pthread_mutex_lock(&loader->lock);
    while (!loader->stop) {
        if (loader->next == loader->end) {
            pthread_cond_wait(&loader->asked, &loader->lock);
            continue;
        }
        fm_octree_load *load = &loader->loads[loader->next % FM_LOADS];
        pthread_mutex_unlock(&loader->lock);
        load->result = read_part(loader, load);
        if (load->result != FM_OK) {
            snprintf(load->message, sizeof load->message, "%s", fm_last_error());
        }
        pthread_mutex_lock(&loader->lock);
        loader->next++;
        pthread_cond_signal(&loader->done);
    }
    pthread_mutex_unlock(&loader->lock);
    return NULL;
}

fm_result fm_octree_loader_create(fm_context *context, int file, const char *name, const fm_octree *like,
                                  const fm_octree_grid *grid, uint64_t most, fm_octree_loader **result) {
    fm_octree_loader *loader = fm_octree_alloc_zero(context, sizeof *loader, "the loader of an octree's parts");
    if (!loader) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    *loader =
        (fm_octree_loader){.context = context, .file = file, .name = name, .like = like->info, .grid = *grid, .marks_bytes = most};
    pthread_mutex_init(&loader->lock, NULL);
    pthread_cond_init(&loader->asked, NULL);
    pthread_cond_init(&loader->done, NULL);
    // A part has nodes of four bytes, each of which has a mark of four.
    loader->marks = fm_octree_alloc(context, most, "the check of an octree");
    fm_result status = loader->marks ? FM_OK : FM_ERROR_OUT_OF_HOST_MEMORY;
    if (status == FM_OK) {
        loader->started = pthread_create(&loader->thread, NULL, work, loader) == 0;
        status = loader->started ? FM_OK : fm_fail(FM_ERROR_OUT_OF_HOST_MEMORY, "out of memory for a thread that loads parts");
    }
    if (status != FM_OK) {
        fm_octree_loader_destroy(loader);
        return status;
    }
    *result = loader;
    return FM_OK;
}

void fm_octree_loader_destroy(fm_octree_loader *loader) {
    if (!loader) {
        return;
    }
    if (loader->started) {
        pthread_mutex_lock(&loader->lock);
        loader->stop = true;
        pthread_cond_signal(&loader->asked);
        pthread_mutex_unlock(&loader->lock);
        pthread_join(loader->thread, NULL);
    }
    pthread_cond_destroy(&loader->asked);
    pthread_cond_destroy(&loader->done);
    pthread_mutex_destroy(&loader->lock);
    fm_octree_free(loader->context, loader->marks, loader->marks_bytes);
    fm_octree_free(loader->context, loader, sizeof *loader);
}

bool fm_octree_loader_ask(fm_octree_loader *loader, uint64_t part, const fm_fmo_part *row, uint8_t *image) {
    pthread_mutex_lock(&loader->lock);
    const bool room = loader->end - loader->taken < FM_LOADS;
    if (room) {
        loader->loads[loader->end++ % FM_LOADS] = (fm_octree_load){.part = part, .row = *row, .image = image};
        pthread_cond_signal(&loader->asked);
    }
    pthread_mutex_unlock(&loader->lock);
    return room;
}

bool fm_octree_loader_take(fm_octree_loader *loader, bool wait, fm_octree_load *load) {
    pthread_mutex_lock(&loader->lock);
    while (wait && loader->taken == loader->next && loader->next < loader->end) {
        pthread_cond_wait(&loader->done, &loader->lock);
    }
    const bool any = loader->taken < loader->next;
    if (any) {
        *load = loader->loads[loader->taken++ % FM_LOADS];
    }
    pthread_mutex_unlock(&loader->lock);
    return any;
}
