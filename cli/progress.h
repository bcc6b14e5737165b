// SPDX-License-Identifier: MIT
#ifndef FM_CLI_PROGRESS_H
#define FM_CLI_PROGRESS_H

// A line on stderr that grows while a big file is read or written; nothing when stderr is no terminal.

#include <stdbool.h>
#include <stdint.h>

typedef struct progress {
    const char *what;  // "reading a.npy"
    bool enabled, shown;
    double started, drawn;  // in ms
} progress;

progress progress_begin(const char *what, bool enabled);
// The same for work that does not tell how far it is: the line stays as it is until progress_end.
progress progress_wait(const char *what, bool enabled);
// An fm_progress_fn; `user` is the progress.
bool progress_step(void *user, uint64_t done, uint64_t total);
void progress_end(progress *bar);

#endif
