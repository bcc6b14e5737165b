// SPDX-License-Identifier: MIT
#ifndef FM_APP_RUN_H
#define FM_APP_RUN_H

#include "options.h"

// The program with its window, and the benchmark without one. Both return an exit code.
int paint_run(const options *o);
int headless_run(const options *o);

// What the library has to say, on stderr.
void run_log(void *user, fm_log_level level, const char *message);
// Set by signals that ask the program to end.
bool run_stopped(void);

#endif
