// SPDX-License-Identifier: MIT

// What goes wrong around a file: no memory, a full disk, a place that may not be written to, a reader that goes away, a call that
// is cancelled. Nothing is left behind. And what is no plain file: devices, pipes and links.

#include "faulty.h"
#include "io_common.h"

#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>

// ---------------------------------------------------------------------------------------------------------------------------
// Memory that runs out at the n-th request
// ---------------------------------------------------------------------------------------------------------------------------

static fm_result attempt_read(fm_context *context, void *user) {
    fm_volume *volume = NULL;
    fm_result result = fm_file_read(context, user, NULL, &volume, NULL);
    CHECK((result == FM_OK) == (volume != NULL));
    fm_volume_destroy(volume);
    return result;
}

static fm_result attempt_write(fm_context *context, void *user) {
    const char *path = user;
    const fm_volume_desc desc = {.shape = {70, 3, 2}, .type = FM_TYPE_U8, .storage = FM_STORAGE_HOST};
    fm_volume *volume = NULL;
    fm_result result = fm_volume_create(context, &desc, &volume);
    if (result == FM_OK) {
        memset(fm_volume_data(volume), 1, 70 * 3 * 2);
        bool png = strcmp(path + strlen(path) - 4, ".png") == 0;
        result = png ? fm_slice_png(volume, 2, 0, NULL, path, NULL) : fm_file_write(path, volume, NULL);
    }
    fm_volume_destroy(volume);
    return result;
}

static const char *const names[] = {"a.npy",  "a.npy.gz", "a.raw",    "a.raw.gz", "a.nrrd",
                                    "a.nhdr", "a.nii",    "a.nii.gz", "a.vox",    "a.png"};
enum { NAME_COUNT = sizeof names / sizeof names[0] };

static void failing_memory(void) {
    for (int i = 0; i < NAME_COUNT; i++) {
        char path[512];
        snprintf(path, sizeof path, "%s", io_path(names[i]));
        exhaust(names[i], attempt_write, path, 0);
        if (strcmp(names[i], "a.png") != 0) {
            exhaust(names[i], attempt_read, path, -1);
        }
        io_clear();
    }
    static const char fortran[] = "\x93NUMPY\1\0\x40\0{'descr': '>i2', 'fortran_order': True, 'shape': (2, 3, 4), }  \n"
                                  "0123456789012345678901234567890123456789abcdefgh";
    static const char binvox[] = "#binvox 1\ndim 4 4 4\ndata\n\1\x40";
    static const char octomap[] = "# Octomap OcTree binary file\nid OcTree\nsize 19\nres 0.5\ndata\n"
                                  "\3\0\3\0\3\0\3\0\3\0\3\0\3\0\3\0\3\0\3\0\3\0\3\0\3\0\3\0\3\0\x49\0";
    const struct {
        const char *name, *text;
        size_t size;
    } rows[] = {
        {"f.npy", fortran, sizeof fortran - 1}, {"b.binvox", binvox, sizeof binvox - 1}, {"o.bt", octomap, sizeof octomap - 1}};
    for (int i = 0; i < 3; i++) {
        char path[512];
        snprintf(path, sizeof path, "%s", io_path(rows[i].name));
        io_store(path, rows[i].text, rows[i].size);
        exhaust(rows[i].name, attempt_read, path, -1);
    }
    io_clear();
}

// ---------------------------------------------------------------------------------------------------------------------------
// Places that cannot be written to
// ---------------------------------------------------------------------------------------------------------------------------

static fm_result write_any(const char *path, fm_volume *volume) {
    bool png = strlen(path) > 4 && strcmp(path + strlen(path) - 4, ".png") == 0;
    return png ? fm_slice_png(volume, 2, 0, NULL, path, NULL) : fm_file_write(path, volume, NULL);
}

static void full_disk(void) {
    fm_volume *volume = io_volume(NULL, (fm_shape){200, 200, 10}, FM_TYPE_U8, 5);
    CHECK_FAILS(fm_file_write("/dev/full", volume, NULL), FM_ERROR_IO);
    CHECK(strstr(fm_last_error(), "No space left") != NULL);
    CHECK_FAILS(fm_slice_png(volume, 2, 0, NULL, "/dev/full", NULL), FM_ERROR_IO);
    struct stat status;
    CHECK(stat("/dev/full", &status) == 0 && S_ISCHR(status.st_mode));

    struct rlimit before, small;
    getrlimit(RLIMIT_FSIZE, &before);
    void (*handler)(int) = signal(SIGXFSZ, SIG_IGN);
    for (int i = 0; i < NAME_COUNT; i++) {
        // Whatever was there before stays as it was.
        for (int there = 0; there < 2; there++) {
            if (there) {
                io_store(io_path(names[i]), "before", 6);
            }
            small = before;
            small.rlim_cur = 4096;
            setrlimit(RLIMIT_FSIZE, &small);
            bool good = CHECK_FAILS(write_any(io_path(names[i]), volume), FM_ERROR_IO);
            setrlimit(RLIMIT_FSIZE, &before);
            size_t size = 0;
            uint8_t *bytes = io_contents(io_path(names[i]), &size);
            good = CHECK(there ? bytes && size == 6 && memcmp(bytes, "before", 6) == 0 : !bytes) && good;
            good = CHECK(io_file_count() == there) && good;
            free(bytes);
            if (!good) {
                fprintf(stderr, "    %s\n", names[i]);
            }
            io_clear();
        }
    }
    signal(SIGXFSZ, handler);
    fm_volume_destroy(volume);
}

static void forbidden_places(void) {
    fm_volume *volume = io_volume(NULL, (fm_shape){4, 4, 4}, FM_TYPE_U8, 5);
    CHECK_FAILS(fm_file_write(io_path("missing/a.npy"), volume, NULL), FM_ERROR_IO);
    CHECK_FAILS(fm_file_write(io_directory, volume, &(fm_write_desc){.format = FM_FORMAT_NPY}), FM_ERROR_IO);
    CHECK(strstr(fm_last_error(), "directory") != NULL);
    io_store(io_path("closed.npy"), "before", 6);
    chmod(io_path("closed.npy"), 0444);
    chmod(io_directory, 0555);
    // Root may write anywhere.
    bool root = geteuid() == 0;
    if (!root || seteuid(65534) == 0) {
        for (int i = 0; i < NAME_COUNT; i++) {
            CHECK_FAILS(write_any(io_path(names[i]), volume), FM_ERROR_IO);
            CHECK(strstr(fm_last_error(), "Permission denied") != NULL);
        }
        CHECK_FAILS(fm_file_write(io_path("closed.npy"), volume, NULL), FM_ERROR_IO);
    }
    if (root) {
        CHECK(seteuid(0) == 0);
    }
    chmod(io_directory, 0755);
    CHECK(io_file_count() == 1);
    io_clear();
    fm_volume_destroy(volume);
}

// ---------------------------------------------------------------------------------------------------------------------------
// Devices, pipes and links
// ---------------------------------------------------------------------------------------------------------------------------

// A child process that copies one file to another; either may be a pipe.
static pid_t copy_in_child(const char *from, const char *to) {
    pid_t child = fork();
    if (child == 0) {
        FILE *in = fopen(from, "rb"), *out = in ? fopen(to, "wb") : NULL;
        char bytes[1000];
        for (size_t got; out && (got = fread(bytes, 1, sizeof bytes, in)) > 0;) {
            fwrite(bytes, 1, got, out);
        }
        _exit(out && fclose(out) == 0 ? 0 : 1);
    }
    return child;
}

static bool child_ended_well(pid_t child) {
    int status = 0;
    return waitpid(child, &status, 0) == child && WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

static void pipes(void) {
    fm_volume *volume = io_volume(NULL, (fm_shape){50, 60, 70}, FM_TYPE_U16, 9);
    fm_volume *read = NULL;
    char fifo[512], copy[512], plain[512];
    snprintf(fifo, sizeof fifo, "%s", io_path("pipe.npy"));
    snprintf(copy, sizeof copy, "%s", io_path("copy.npy"));
    snprintf(plain, sizeof plain, "%s", io_path("plain.npy"));
    CHECK(mkfifo(fifo, 0600) == 0);
    pid_t child = copy_in_child(fifo, copy);
    CHECK_OK(fm_file_write(fifo, volume, NULL));
    CHECK(child_ended_well(child));
    struct stat status;
    CHECK(stat(fifo, &status) == 0 && S_ISFIFO(status.st_mode));
    CHECK(CHECK_OK(fm_file_read(NULL, copy, NULL, &read, NULL)) && io_same(volume, read));
    fm_volume_destroy(read);
    read = NULL;
    CHECK_OK(fm_file_write(plain, volume, NULL));
    child = copy_in_child(plain, fifo);
    CHECK(CHECK_OK(fm_file_read(NULL, fifo, NULL, &read, NULL)) && io_same(volume, read));
    CHECK(child_ended_well(child));
    fm_volume_destroy(read);
    read = NULL;
    // A pipe that ends too soon.
    CHECK(truncate(plain, 10000) == 0);
    child = copy_in_child(plain, fifo);
    CHECK_FAILS(fm_file_read(NULL, fifo, NULL, &read, NULL), FM_ERROR_FORMAT);
    CHECK(child_ended_well(child));
    // A raw file to a device has no sidecar beside it.
    CHECK_OK(fm_file_write("/dev/null", volume, &(fm_write_desc){.format = FM_FORMAT_RAW}));
    CHECK(!io_exists("/dev/null.txt"));
    fm_volume_destroy(volume);
    io_clear();
}

static void standard_streams(void) {
    fm_volume *volume = io_volume(NULL, (fm_shape){5, 6, 7}, FM_TYPE_F32, 9);
    fm_volume *read = NULL;
    fflush(stdout);
    int saved_in = dup(STDIN_FILENO), saved_out = dup(STDOUT_FILENO);
    int file = open(io_path("out.npy"), O_WRONLY | O_CREAT | O_TRUNC, 0600);
    dup2(file, STDOUT_FILENO);
    close(file);
    fm_result written = fm_file_write("-", volume, NULL);
    dup2(saved_out, STDOUT_FILENO);
    close(saved_out);
    CHECK(written == FM_OK);
    file = open(io_path("out.npy"), O_RDONLY);
    dup2(file, STDIN_FILENO);
    close(file);
    CHECK(CHECK_OK(fm_file_read(NULL, "-", NULL, &read, NULL)) && io_same(volume, read));
    dup2(saved_in, STDIN_FILENO);
    close(saved_in);
    fm_volume_destroy(read);
    fm_volume_destroy(volume);
    io_clear();
}

// The smallest array is read as soon as it is there, though the writer keeps the pipe open.
static void pipe_that_stays_open(void) {
    fm_volume *volume = io_volume(NULL, (fm_shape){1, 1, 1}, FM_TYPE_U8, 9);
    fm_volume *read_back = NULL;
    int ends[2];
    size_t size = 0;
    CHECK_OK(fm_file_write(io_path("one.npy"), volume, NULL));
    uint8_t *bytes = io_contents(io_path("one.npy"), &size);
    CHECK(pipe(ends) == 0 && write(ends[1], bytes, size) == (ssize_t)size);
    int saved = dup(STDIN_FILENO);
    dup2(ends[0], STDIN_FILENO);
    // A read that waits for more ends the test.
    alarm(60);
    CHECK(CHECK_OK(fm_file_read(NULL, "-", NULL, &read_back, NULL)) && io_same(volume, read_back));
    alarm(0);
    dup2(saved, STDIN_FILENO);
    close(saved);
    close(ends[0]);
    close(ends[1]);
    free(bytes);
    fm_volume_destroy(read_back);
    fm_volume_destroy(volume);
    io_clear();
}

static void reader_goes_away(void) {
    fm_volume *volume = io_volume(NULL, (fm_shape){200, 200, 50}, FM_TYPE_U8, 9);
    void (*handler)(int) = signal(SIGPIPE, SIG_IGN);
    int ends[2];
    CHECK(pipe(ends) == 0);
    int saved = dup(STDOUT_FILENO);
    fflush(stdout);
    dup2(ends[1], STDOUT_FILENO);
    close(ends[0]);
    close(ends[1]);
    fm_result result = fm_file_write("-", volume, NULL);
    dup2(saved, STDOUT_FILENO);
    close(saved);
    signal(SIGPIPE, handler);
    CHECK(result == FM_ERROR_IO);
    fm_volume_destroy(volume);
}

static void links_and_modes(void) {
    fm_volume *volume = io_volume(NULL, (fm_shape){4, 4, 4}, FM_TYPE_U8, 5);
    struct stat status;
    io_store(io_path("real.npy"), "before", 6);
    chmod(io_path("real.npy"), 0640);
    CHECK(symlink("real.npy", io_path("link.npy")) == 0);
    CHECK_OK(fm_file_write(io_path("link.npy"), volume, NULL));
    CHECK(lstat(io_path("link.npy"), &status) == 0 && S_ISLNK(status.st_mode));
    CHECK(lstat(io_path("real.npy"), &status) == 0 && status.st_size == 128 + 64 && (status.st_mode & 07777) == 0640);
    CHECK(io_file_count() == 2);
    fm_volume_destroy(volume);
    io_clear();
}

// ---------------------------------------------------------------------------------------------------------------------------
// Calls that are stopped
// ---------------------------------------------------------------------------------------------------------------------------

typedef struct stopper {
    int calls, stop_at;
    bool abort;
    uint64_t last, total;
    bool backwards;
} stopper;

static bool on_progress(void *user, uint64_t done, uint64_t total) {
    stopper *s = user;
    s->backwards = s->backwards || done < s->last || done > total;
    s->last = done;
    s->total = total;
    if (s->abort) {
        fm_file_abort_all();
    }
    return s->calls++ != s->stop_at;
}

static void cancelled(void) {
    // Over one piece, so that there are several steps.
    fm_volume *volume = io_volume(NULL, (fm_shape){300, 300, 60}, FM_TYPE_U8, 5);
    for (int i = 0; i < NAME_COUNT; i++) {
        if (strcmp(names[i], "a.png") == 0) {
            continue;
        }
        stopper s = {.stop_at = -1};
        fm_write_desc write = {.progress = on_progress, .progress_user = &s};
        CHECK_OK(fm_file_write(io_path(names[i]), volume, &write));
        CHECK(s.calls >= 2 && s.last == s.total && s.total > 0 && !s.backwards);
        int steps = s.calls;
        fm_volume *read = NULL;
        s = (stopper){.stop_at = -1};
        fm_read_desc desc = {.progress = on_progress, .progress_user = &s};
        CHECK_OK(fm_file_read(NULL, io_path(names[i]), &desc, &read, NULL));
        CHECK(s.calls >= 2 && s.last == s.total && s.total > 0 && !s.backwards);
        fm_volume_destroy(read);
        int read_steps = s.calls;
        for (int stop = 0; stop < read_steps; stop++) {
            read = NULL;
            s = (stopper){.stop_at = stop};
            CHECK_FAILS(fm_file_read(NULL, io_path(names[i]), &desc, &read, NULL), FM_ERROR_IO);
            CHECK(read == NULL && strstr(fm_last_error(), "cancelled") != NULL);
        }
        io_clear();
        for (int stop = 0; stop < steps; stop++) {
            s = (stopper){.stop_at = stop};
            CHECK_FAILS(fm_file_write(io_path(names[i]), volume, &write), FM_ERROR_IO);
            CHECK(strstr(fm_last_error(), "cancelled") != NULL);
            CHECK(io_file_count() == 0);
        }
        // What a signal handler does: the temporary files are gone at once, and the call does not bring them back.
        s = (stopper){.stop_at = -1, .abort = true};
        CHECK_FAILS(fm_file_write(io_path(names[i]), volume, &write), FM_ERROR_IO);
        if (!CHECK(io_file_count() == 0)) {
            fprintf(stderr, "    %s\n", names[i]);
        }
        io_clear();
    }
    fm_volume_destroy(volume);
}

int main(void) {
    if (!io_begin()) {
        return check_summary();
    }
    failing_memory();
    full_disk();
    forbidden_places();
    pipes();
    standard_streams();
    pipe_that_stays_open();
    reader_goes_away();
    links_and_modes();
    cancelled();
    return io_end();
}
