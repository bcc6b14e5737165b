// SPDX-License-Identifier: MIT
#include "render/octree_loader.h"

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
        load->result = fm_fmo_read_part(loader->file, load->part, &load->row, &loader->grid, &loader->like, loader->name,
                                        load->image, loader->marks, &load->numbers);
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
