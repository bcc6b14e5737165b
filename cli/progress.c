// SPDX-License-Identifier: MIT
#include "progress.h"

#include <stdio.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

static uint64_t now_ns(void) {
    struct timespec time;
    clock_gettime(CLOCK_MONOTONIC, &time);
    return (uint64_t)time.tv_sec * 1000000000u + (uint64_t)time.tv_nsec;
}

progress progress_begin(const char *what, bool enabled) {
    uint64_t now = now_ns();
    return (progress){.what = what, .enabled = enabled && isatty(STDERR_FILENO), .started = now, .drawn = now};
}

bool progress_step(void *user, uint64_t done, uint64_t total) {
    enum { WIDTH = 30, INTERVAL = 100000000, PATIENCE = 300000000 };
    progress *bar = user;
    const uint64_t now = bar->enabled ? now_ns() : 0;
    if (!bar->enabled || total == 0 || now - bar->started < PATIENCE || now - bar->drawn < INTERVAL) {
        return true;
    }
    bar->drawn = now;
    bar->shown = true;
    const double part = (double)done / (double)total;
    char cells[WIDTH + 1];
    memset(cells, '.', WIDTH);
    memset(cells, '#', (size_t)(part * WIDTH));
    cells[WIDTH] = '\0';
    fprintf(stderr, "\r%s [%s] %3.0f %% of %.1f GB ", bar->what, cells, part * 100, (double)total * 1e-9);
    fflush(stderr);
    return true;
}

void progress_end(progress *bar) {
    if (bar->shown) {
        fprintf(stderr, "\r\033[K");
    }
}
