// SPDX-License-Identifier: MIT

// The library's threads leave the program's signals to the program's threads.

#include "check.h"

#include <signal.h>
#include <stdlib.h>
#include <unistd.h>

static volatile sig_atomic_t taken;

static void take(int number) {
    (void)number;
    taken++;
}

int main(void) {
    sigset_t one, mask, waiting;
    signal(SIGUSR1, take);
    sigemptyset(&one);
    sigaddset(&one, SIGUSR1);
    fm_context *context = NULL;
    CHECK_OK(fm_context_create(&(fm_context_desc){.backend = FM_BACKEND_CPU, .threads = 4}, &context));
    CHECK(pthread_sigmask(SIG_SETMASK, NULL, &mask) == 0 && !sigismember(&mask, SIGUSR1));
    // With the only thread of this program not taking it, the signal has to wait.
    pthread_sigmask(SIG_BLOCK, &one, NULL);
    kill(getpid(), SIGUSR1);
    enum { EDGE = 64 };
    const fm_shape shape = {EDGE, EDGE, EDGE};
    uint8_t *solid = calloc(EDGE * EDGE, EDGE);
    float *distance = calloc(EDGE * EDGE * EDGE, sizeof *distance);
    const fm_array from = {solid, FM_TYPE_U8, shape}, to = {distance, FM_TYPE_F32, shape};
    CHECK_OK(fm_transform_host(context, NULL, &from, &to, NULL));
    sigpending(&waiting);
    CHECK(taken == 0 && sigismember(&waiting, SIGUSR1));
    pthread_sigmask(SIG_UNBLOCK, &one, NULL);
    CHECK(taken == 1);
    free(distance);
    free(solid);
    fm_context_destroy(context);
    return check_summary();
}
