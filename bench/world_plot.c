// SPDX-License-Identifier: MIT
#include "plot_world.h"
#include "world.h"

#include <errno.h>
#include <spawn.h>
#include <sys/wait.h>

extern char **environ;

bool bench_world_plot(const char *csv, const char *directory) {
    // spawn takes strings that it could write to, and does not.
    char *const arguments[] = {(char *)(uintptr_t) "sh",
                               (char *)(uintptr_t) "-c",
                               (char *)(uintptr_t)plot_world,
                               (char *)(uintptr_t) "plot-world",
                               (char *)(uintptr_t)(csv ? csv : "--check"),
                               (char *)(uintptr_t)directory,
                               NULL};
    pid_t child;
    if (posix_spawnp(&child, "sh", NULL, NULL, arguments, environ) != 0) {
        return false;
    }
    int status;
    while (waitpid(child, &status, 0) < 0) {
        if (errno != EINTR) {
            return false;
        }
    }
    return WIFEXITED(status) && WEXITSTATUS(status) == 0;
}
