// SPDX-License-Identifier: MIT
#ifndef FM_POOL_H
#define FM_POOL_H

// A fixed set of worker threads that share loops. A pool runs one loop at a time and is used by one thread at a time.

#include "base/base.h"

typedef struct fm_pool fm_pool;

// Works on items [begin, end) of the loop. `worker` is below fm_pool_threads and no two calls that run at once share it, so that
// it can choose a scratch buffer.
typedef void (*fm_pool_fn)(void *user, uint64_t begin, uint64_t end, uint32_t worker);

// `threads` counts the caller's thread too; 0: one a logical processor.
fm_result fm_pool_create(const fm_allocator *allocator, uint32_t threads, fm_pool **pool);
void fm_pool_destroy(fm_pool *pool);
uint32_t fm_pool_threads(const fm_pool *pool);

// Splits `count` items into runs of `grain` and hands them to the workers and the caller as each becomes free; returns when all are
// done.
void fm_pool_run(fm_pool *pool, uint64_t count, uint64_t grain, fm_pool_fn fn, void *user);

#endif
