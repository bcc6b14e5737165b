// SPDX-License-Identifier: MIT
#include "parallel.h"

#include <pthread.h>
#include <stdatomic.h>
#include <unistd.h>

enum { MAX_THREADS = 256 };

typedef struct loop {
    _Atomic uint64_t next;
    uint64_t count;
    void (*fn)(void *user, uint64_t i);
    void *user;
} loop;

static void *work(void *argument) {
    loop *shared = argument;
    for (uint64_t i; (i = atomic_fetch_add(&shared->next, 1)) < shared->count;) {
        shared->fn(shared->user, i);
    }
    return NULL;
}

void fm_parallel(uint32_t threads, uint64_t count, void (*fn)(void *user, uint64_t i), void *user) {
    if (threads == 0) {
        long processors = sysconf(_SC_NPROCESSORS_ONLN);
        threads = processors > 0 ? (uint32_t)processors : 1;
    }
    if (threads > count) {
        threads = (uint32_t)count;
    }
    if (threads > MAX_THREADS) {
        threads = MAX_THREADS;
    }
    loop shared = {.count = count, .fn = fn, .user = user};
    pthread_t helpers[MAX_THREADS];
    uint32_t started = 0;
    while (started + 1 < threads && pthread_create(&helpers[started], NULL, work, &shared) == 0) {
        started++;
    }
    work(&shared);
    for (uint32_t i = 0; i < started; i++) {
        pthread_join(helpers[i], NULL);
    }
}
