// SPDX-License-Identifier: MIT
#ifndef FM_SCENES_PARALLEL_H
#define FM_SCENES_PARALLEL_H

// A loop shared by threads that live as long as the loop: for programs, which may not use the library's own pool.

#include <stdint.h>

// Calls fn(user, i) once for every i < count, from `threads` threads (0: one a logical processor) of which the caller is one.
// Returns when all calls have. Runs on fewer threads when the system gives no more.
void fm_parallel(uint32_t threads, uint64_t count, void (*fn)(void *user, uint64_t i), void *user);

#endif
