// SPDX-License-Identifier: MIT
#include "base/pool.h"

#include <pthread.h>
#include <signal.h>
#include <stdatomic.h>
#include <unistd.h>

typedef struct fm_worker {
    fm_pool *pool;
    pthread_t thread;
    uint32_t index;
} fm_worker;

struct fm_pool {
    fm_allocator allocator;
    uint32_t threads;  // the caller included
    uint32_t started;
    uint64_t bytes;

    pthread_mutex_t mutex;
    pthread_cond_t work;
    pthread_cond_t done;
    uint64_t generation;  // rises with every loop
    uint32_t busy;
    bool stop;

    // The loop under way; written under the mutex while no worker is busy.
    fm_pool_fn fn;
    void *user;
    uint64_t count;
    uint64_t grain;
    atomic_uint_fast64_t next;

    fm_worker workers[];
};

static void take_runs(fm_pool *pool, uint32_t worker) {
    for (;;) {
        uint64_t begin = atomic_fetch_add_explicit(&pool->next, pool->grain, memory_order_relaxed);
        if (begin >= pool->count) {
            return;
        }
        pool->fn(pool->user, begin, fm_min_u64(begin + pool->grain, pool->count), worker);
    }
}

static void *worker_main(void *argument) {
    fm_worker *worker = argument;
    fm_pool *pool = worker->pool;
    uint64_t seen = 0;
    pthread_mutex_lock(&pool->mutex);
    for (;;) {
        while (!pool->stop && pool->generation == seen) {
            pthread_cond_wait(&pool->work, &pool->mutex);
        }
        if (pool->stop) {
            break;
        }
        seen = pool->generation;
        pthread_mutex_unlock(&pool->mutex);
        take_runs(pool, worker->index);
        pthread_mutex_lock(&pool->mutex);
        if (--pool->busy == 0) {
            pthread_cond_signal(&pool->done);
        }
    }
    pthread_mutex_unlock(&pool->mutex);
    return NULL;
}

// The program's signals are for its own threads: a worker takes only those that its own faults raise.
static bool start_workers(fm_pool *pool) {
    static const int faults[] = {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGTRAP, SIGABRT, SIGSYS};
    sigset_t blocked, before;
    sigfillset(&blocked);
    for (size_t i = 0; i < sizeof faults / sizeof faults[0]; i++) {
        sigdelset(&blocked, faults[i]);
    }
    pthread_sigmask(SIG_BLOCK, &blocked, &before);
    bool good = true;
    for (uint32_t i = 1; good && i < pool->threads; i++) {
        fm_worker *worker = &pool->workers[i];
        worker->pool = pool;
        worker->index = i;
        good = pthread_create(&worker->thread, NULL, worker_main, worker) == 0;
        pool->started += good;
    }
    pthread_sigmask(SIG_SETMASK, &before, NULL);
    return good;
}

fm_result fm_pool_create(const fm_allocator *allocator, uint32_t threads, fm_pool **result) {
    if (threads == 0) {
        long online = sysconf(_SC_NPROCESSORS_ONLN);
        threads = online > 0 ? (uint32_t)online : 1;
    }
    if (threads > 1024) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "threads is %u: at most 1024", threads);
    }
    uint64_t bytes = sizeof(fm_pool) + threads * sizeof(fm_worker);
    fm_pool *pool = fm_alloc_zero(allocator, bytes, "the thread pool");
    if (!pool) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    pool->allocator = *allocator;
    pool->threads = threads;
    pool->bytes = bytes;
    pthread_mutex_init(&pool->mutex, NULL);
    pthread_cond_init(&pool->work, NULL);
    pthread_cond_init(&pool->done, NULL);
    if (!start_workers(pool)) {
        const uint32_t started = pool->started;
        fm_pool_destroy(pool);
        return fm_fail(FM_ERROR_OUT_OF_HOST_MEMORY, "thread %u of %u could not be started", started + 2, threads);
    }
    *result = pool;
    return FM_OK;
}

void fm_pool_destroy(fm_pool *pool) {
    if (!pool) {
        return;
    }
    pthread_mutex_lock(&pool->mutex);
    pool->stop = true;
    pthread_cond_broadcast(&pool->work);
    pthread_mutex_unlock(&pool->mutex);
    for (uint32_t i = 1; i <= pool->started; i++) {
        pthread_join(pool->workers[i].thread, NULL);
    }
    pthread_mutex_destroy(&pool->mutex);
    pthread_cond_destroy(&pool->work);
    pthread_cond_destroy(&pool->done);
    fm_allocator allocator = pool->allocator;
    fm_free(&allocator, pool, pool->bytes);
}

uint32_t fm_pool_threads(const fm_pool *pool) {
    return pool->threads;
}

void fm_pool_run(fm_pool *pool, uint64_t count, uint64_t grain, fm_pool_fn fn, void *user) {
    if (count == 0) {
        return;
    }
    grain = fm_max_u64(grain, 1);
    if (pool->threads == 1 || count <= grain) {
        fn(user, 0, count, 0);
        return;
    }
    pthread_mutex_lock(&pool->mutex);
    pool->fn = fn;
    pool->user = user;
    pool->count = count;
    pool->grain = grain;
    atomic_store_explicit(&pool->next, 0, memory_order_relaxed);
    pool->busy = pool->threads - 1;
    pool->generation++;
    pthread_cond_broadcast(&pool->work);
    pthread_mutex_unlock(&pool->mutex);

    take_runs(pool, 0);

    pthread_mutex_lock(&pool->mutex);
    while (pool->busy != 0) {
        pthread_cond_wait(&pool->done, &pool->mutex);
    }
    pthread_mutex_unlock(&pool->mutex);
}
