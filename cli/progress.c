// SPDX-License-Identifier: MIT
#include "progress.h"

#include "words.h"

#include <stdio.h>
#include <string.h>
#include <unistd.h>

progress progress_begin(const char *what, bool enabled) {
    const double now = fm_now_ms();
    return (progress){.what = what, .enabled = enabled && isatty(STDERR_FILENO), .started = now, .drawn = now};
}

progress progress_wait(const char *what, bool enabled) {
    progress bar = progress_begin(what, enabled);
    bar.shown = bar.enabled;
    if (bar.shown) {
        fprintf(stderr, "\r%s ...", what);
        fflush(stderr);
    }
    return bar;
}

bool progress_step(void *user, uint64_t done, uint64_t total) {
    enum { WIDTH = 30, INTERVAL_MS = 100, PATIENCE_MS = 300 };
    progress *bar = user;
    const double now = bar->enabled ? fm_now_ms() : 0;
    if (!bar->enabled || total == 0 || now - bar->started < PATIENCE_MS || now - bar->drawn < INTERVAL_MS) {
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
