// SPDX-License-Identifier: MIT
// fathom paint: the painting program is one of its own, so that this one needs no window system.

#include "cli.h"
#include "commands.h"

#include <errno.h>
#include <limits.h>
#include <string.h>
#include <unistd.h>

int command_paint(int argc, char **argv) {
    (void)argc;
    static const char name[] = "fathom-paint";
    char path[PATH_MAX];
    const ssize_t length = readlink("/proc/self/exe", path, sizeof path - sizeof name);
    if (length > 0) {
        path[length] = '\0';
        char *slash = strrchr(path, '/');
        memcpy(slash ? slash + 1 : path, name, sizeof name);
        execv(path, argv);
    }
    execvp(name, argv);
    return cli_fail("paint: %s cannot be started: %s: it belongs beside this program", name, strerror(errno));
}
