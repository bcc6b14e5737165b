// SPDX-License-Identifier: MIT
// fathom: see options.c for what it does.
#include "log.h"
#include "run.h"

#include <signal.h>
#include <stdio.h>

static volatile sig_atomic_t stopped;

static void on_signal(int number) {
    (void)number;
    stopped = 1;
}

bool run_stopped(void) {
    return stopped != 0;
}

void run_log(void *user, fm_log_level level, const char *message) {
    (void)user;
    if (level >= FM_LOG_INFO) {
        fprintf(stderr, "fathom: %s\n", message);
    }
}

int main(int argc, char **argv) {
    // The frame in work is finished first, so that nothing is left half written.
    signal(SIGINT, on_signal);
    signal(SIGTERM, on_signal);
    cli_args args = {0};
    options o;
    int status;
    if (options_parse(&args, argc, argv, &o, &status)) {
        if (!log_open(o.log)) {
            status = cli_fail("%s cannot be written: choose another file for --log", o.log);
        } else {
            status = o.headless ? headless_run(&o) : paint_run(&o);
            log_close();
        }
    }
    cli_free(&args);
    return status;
}
