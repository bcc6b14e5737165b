// SPDX-License-Identifier: MIT
#include "video.h"
#include "cli.h"

#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <signal.h>
#include <spawn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/wait.h>
#include <unistd.h>

extern char **environ;

struct video {
    char path[PATH_MAX], temporary[PATH_MAX + 32];
    pid_t child;
    int pipe;
    size_t bytes;  // of a frame
};

// The film in the making, for a signal that ends the program.
static video *volatile current;

enum { SIGNALS = 4 };
static const int signals[SIGNALS] = {SIGINT, SIGTERM, SIGHUP, SIGQUIT};
static struct sigaction before[SIGNALS];

// Leaves no part of a film, then does what would have been done without one.
static void end_by_signal(int number) {
    const video *film = current;
    current = NULL;
    if (film) {
        kill(film->child, SIGKILL);
        waitpid(film->child, NULL, 0);
        unlink(film->temporary);
    }
    for (int i = 0; i < SIGNALS; i++) {
        if (signals[i] == number) {
            sigaction(number, &before[i], NULL);
        }
    }
    raise(number);
}

static void catch_signals(video *film) {
    struct sigaction action = {0};
    action.sa_handler = end_by_signal;
    sigemptyset(&action.sa_mask);
    current = film;
    for (int i = 0; i < SIGNALS; i++) {
        sigaction(signals[i], NULL, &before[i]);
        // A signal that was ignored when the program started (nohup) stays so.
        if (before[i].sa_handler != SIG_IGN) {
            sigaction(signals[i], &action, NULL);
        }
    }
}

static void release_signals(void) {
    for (int i = 0; i < SIGNALS; i++) {
        sigaction(signals[i], &before[i], NULL);
    }
    current = NULL;
}

static const char *ending(const char *path) {
    const char *dot = strrchr(path, '.');
    return dot ? dot : "";
}

bool video_name(const char *path) {
    return strcasecmp(ending(path), ".mp4") == 0 || strcasecmp(ending(path), ".webm") == 0;
}

static int spawn(video *film, const char *size, const char *rate, int input) {
    const bool webm = strcasecmp(ending(film->path), ".webm") == 0;
    // A name may begin with "-" or have a ":", which are options and protocols to ffmpeg.
    char target[sizeof film->temporary + 8];
    snprintf(target, sizeof target, "file:%s", film->temporary);
    const char *const words[] = {
        "ffmpeg", "-loglevel", "error", "-y", "-f", "rawvideo", "-pix_fmt", "rgba", "-s", size, "-r", rate, "-i", "-",
        // Both codecs want even sides.
        "-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2", "-pix_fmt", "yuv420p", "-c:v", webm ? "libvpx-vp9" : "libx264", "-crf",
        webm ? "28" : "18", "-b:v", "0", "-f", webm ? "webm" : "mp4", target, NULL};
    posix_spawn_file_actions_t actions;
    posix_spawnattr_t attributes;
    int result = posix_spawn_file_actions_init(&actions);
    if (result != 0) {
        return result;
    }
    result = posix_spawnattr_init(&attributes);
    if (result != 0) {
        posix_spawn_file_actions_destroy(&actions);
        return result;
    }
    // A group of its own: Ctrl-C is for us to hear.
    posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);
    result = posix_spawn_file_actions_adddup2(&actions, input, STDIN_FILENO);
    // spawn takes strings that it could write to, and does not.
    char *arguments[sizeof words / sizeof words[0]];
    memcpy(arguments, words, sizeof words);
    result = result == 0 ? posix_spawnp(&film->child, "ffmpeg", &actions, &attributes, arguments, environ) : result;
    posix_spawn_file_actions_destroy(&actions);
    posix_spawnattr_destroy(&attributes);
    return result;
}

video *video_begin(const char *path, uint32_t width, uint32_t height, double fps) {
    video *film = calloc(1, sizeof *film);
    char size[32], rate[32];
    int ends[2];
    if (!film || strlen(path) >= sizeof film->path || pipe2(ends, O_CLOEXEC) != 0) {
        cli_fail("%s: no film can be begun: %s", path, film ? strerror(errno) : "out of memory");
        free(film);
        return NULL;
    }
    strcpy(film->path, path);
    snprintf(film->temporary, sizeof film->temporary, "%s.%ld.part", path, (long)getpid());
    snprintf(size, sizeof size, "%ux%u", width, height);
    snprintf(rate, sizeof rate, "%g", fps);
    film->bytes = 4 * (size_t)width * height;
    film->pipe = ends[1];
    const int error = spawn(film, size, rate, ends[0]);
    close(ends[0]);
    if (error != 0) {
        close(ends[1]);
        free(film);
        cli_fail(error == ENOENT ? "%s: films are made by ffmpeg, which is not installed: install it, or write numbered .png files"
                                 : "%s: ffmpeg cannot be started",
                 path);
        return NULL;
    }
    catch_signals(film);
    return film;
}

bool video_frame(video *film, const uint8_t *pixels) {
    // When ffmpeg has ended, that is an error of the write.
    struct sigaction ignore = {0}, broken;
    ignore.sa_handler = SIG_IGN;
    sigemptyset(&ignore.sa_mask);
    sigaction(SIGPIPE, &ignore, &broken);
    size_t left = film->bytes;
    bool good = true;
    while (good && left > 0) {
        const ssize_t count = write(film->pipe, pixels, left);
        good = count >= 0 || errno == EINTR;
        pixels += count > 0 ? count : 0;
        left -= count > 0 ? (size_t)count : 0;
    }
    sigaction(SIGPIPE, &broken, NULL);
    if (!good) {
        cli_fail("%s: ffmpeg takes no more frames: its own message says why", film->path);
    }
    return good;
}

int video_end(video *film, bool good) {
    close(film->pipe);
    int status = 0;
    while (waitpid(film->child, &status, 0) < 0 && errno == EINTR) {
    }
    int result = good ? CLI_DONE : CLI_FAILED;
    if (good && !(WIFEXITED(status) && WEXITSTATUS(status) == 0)) {
        result = cli_fail("%s: ffmpeg failed: its own message says why", film->path);
    }
    if (result == CLI_DONE && rename(film->temporary, film->path) != 0) {
        result = cli_fail("%s: %s", film->path, strerror(errno));
    }
    if (result != CLI_DONE) {
        unlink(film->temporary);
    }
    release_signals();
    free(film);
    return result;
}
