// SPDX-License-Identifier: MIT
#include "fathom/io.h"
#include "io/sized.h"
#include "io/stream.h"

#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

enum {
    BUFFER = 1 << 16,
    MAX_PATH = 4096,
    PIECE = 1 << 30,
    // Distance fields shrink little more at higher levels, which take several times as long.
    LEVEL = 4,
};

typedef enum slot_state { SLOT_FREE = 0, SLOT_TAKEN, SLOT_LIVE } slot_state;

// Temporary files in flight, where a signal handler finds them.
typedef struct slot {
    atomic_int state;
    char path[MAX_PATH];
} slot;

static slot slots[FM_MAX_TEMPORARIES];

// What a rename has done.
typedef enum placing { PLACED_NOT = 0, PLACED_NEW, PLACED_EXCHANGED, PLACED_OVER } placing;

struct fm_output {
    const fm_allocator *allocator;
    char *target;  // what the file is renamed to
    size_t target_size;
    const char *name;  // for messages: inside `target`
    int fd;
    slot *temporary;  // NULL: the bytes go straight to the target
    placing placed;
    bool gzip;
    z_stream z;
    size_t used;
    uint8_t buffer[BUFFER];
};

void fm_file_abort_all(void) {
    for (int i = 0; i < FM_MAX_TEMPORARIES; i++) {
        if (atomic_load(&slots[i].state) == SLOT_LIVE) {
            unlink(slots[i].path);
        }
    }
}

static slot *slot_take(void) {
    for (int i = 0; i < FM_MAX_TEMPORARIES; i++) {
        int expected = SLOT_FREE;
        if (atomic_compare_exchange_strong(&slots[i].state, &expected, SLOT_TAKEN)) {
            return &slots[i];
        }
    }
    return NULL;
}

static fm_result output_error(const fm_output *output, const char *what, int code) {
    const char *cure = code == ENOSPC || code == EFBIG || code == EDQUOT  ? ": free some space or write elsewhere"
                       : code == EACCES || code == EPERM || code == EROFS ? ": choose a place that you may write to"
                                                                          : "";
    return fm_fail(FM_ERROR_IO, "%s: cannot %s: %s%s", output->name, what, strerror(code), cure);
}

static fm_result random_suffix(const fm_output *output, uint64_t *value) {
    if (getrandom(value, sizeof *value, 0) != (ssize_t)sizeof *value) {
        return output_error(output, "get a random name", errno);
    }
    return FM_OK;
}

static fm_result create_temporary(fm_output *output) {
    const char *slash = strrchr(output->target, '/');
    size_t directory = slash ? (size_t)(slash - output->target) + 1 : 0;
    if (directory + 64 > MAX_PATH) {
        return output_error(output, "write", ENAMETOOLONG);
    }
    output->temporary = slot_take();
    if (!output->temporary) {
        return fm_fail(FM_ERROR_IO, "%s: cannot write: %d files are being written already", output->name, FM_MAX_TEMPORARIES);
    }
    slot *temporary = output->temporary;
    memcpy(temporary->path, output->target, directory);
    do {
        uint64_t suffix;
        FM_TRY(random_suffix(output, &suffix));
        snprintf(temporary->path + directory, MAX_PATH - directory, ".fathom-%016llx.tmp", (unsigned long long)suffix);
        // Before the file is there, so that no signal finds a file that the table lacks.
        atomic_store(&temporary->state, SLOT_LIVE);
        output->fd = open(temporary->path, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
        if (output->fd < 0) {
            atomic_store(&temporary->state, SLOT_TAKEN);
        }
    } while (output->fd < 0 && errno == EEXIST);
    return output->fd < 0 ? output_error(output, "create a file in its directory", errno) : FM_OK;
}

// A link is followed, so that it stays one.
static fm_result resolve_link(fm_output *output) {
    struct stat status;
    if (lstat(output->target, &status) != 0 || !S_ISLNK(status.st_mode)) {
        return FM_OK;
    }
    char real[PATH_MAX];
    if (!realpath(output->target, real)) {
        return errno == ENOENT ? FM_OK : output_error(output, "follow the link", errno);
    }
    size_t size = strlen(real) + 1;
    char *target = fm_alloc(output->allocator, size, "a file's name");
    if (!target) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    memcpy(target, real, size);
    fm_free(output->allocator, output->target, output->target_size);
    output->target = target;
    output->target_size = size;
    output->name = target;
    return FM_OK;
}

static fm_result open_target(fm_output *output) {
    if (strcmp(output->target, "-") == 0) {
        output->name = "standard output";
        output->fd = fcntl(STDOUT_FILENO, F_DUPFD_CLOEXEC, 0);
        return output->fd < 0 ? output_error(output, "write", errno) : FM_OK;
    }
    struct stat status;
    if (stat(output->target, &status) != 0) {
        if (errno != ENOENT) {
            return output_error(output, "write", errno);
        }
        return create_temporary(output);
    }
    if (S_ISDIR(status.st_mode)) {
        return fm_fail(FM_ERROR_IO, "%s: cannot write: is a directory: name a file in it", output->name);
    }
    if (!S_ISREG(status.st_mode)) {
        output->fd = open(output->target, O_WRONLY | O_CLOEXEC | O_NOCTTY);
        return output->fd < 0 ? output_error(output, "write", errno) : FM_OK;
    }
    if (faccessat(AT_FDCWD, output->target, W_OK, AT_EACCESS) != 0) {
        return output_error(output, "write", errno);
    }
    FM_TRY(resolve_link(output));
    FM_TRY(create_temporary(output));
    // The replacement keeps the permissions; that it may fail on some file systems does no harm.
    (void)!fchmod(output->fd, status.st_mode & 07777);
    return FM_OK;
}

fm_result fm_output_open(const fm_allocator *allocator, const char *path, bool gzip, fm_output **result) {
    if (path[0] == 0) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "path is empty: name a file, or - for standard output");
    }
    fm_output *output = fm_alloc_zero(allocator, sizeof *output, "a file's buffer");
    if (!output) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    output->allocator = allocator;
    output->fd = -1;
    output->target_size = strlen(path) + 1;
    output->target = fm_alloc(allocator, output->target_size, "a file's name");
    fm_result status = FM_ERROR_OUT_OF_HOST_MEMORY;
    if (output->target) {
        memcpy(output->target, path, output->target_size);
        output->name = output->target;
        status = open_target(output);
    }
    if (status == FM_OK && gzip) {
        status = fm_output_begin_gzip(output);
    }
    if (status != FM_OK) {
        fm_output_destroy(output);
        return status;
    }
    *result = output;
    return FM_OK;
}

static fm_result put(fm_output *output, const uint8_t *data, uint64_t size) {
    while (size > 0) {
        ssize_t count = write(output->fd, data, (size_t)fm_min_u64(size, PIECE));
        if (count < 0 && errno == EINTR) {
            continue;
        }
        if (count <= 0) {
            return output_error(output, "write", count < 0 ? errno : EIO);
        }
        data += count;
        size -= (uint64_t)count;
    }
    return FM_OK;
}

static fm_result flush_buffer(fm_output *output) {
    size_t used = output->used;
    output->used = 0;
    return put(output, output->buffer, used);
}

// Runs deflate until it has taken its input in or, to finish, has given everything out.
static fm_result deflate_all(fm_output *output, int mode) {
    for (;;) {
        output->z.next_out = output->buffer + output->used;
        output->z.avail_out = (uInt)(BUFFER - output->used);
        int status = deflate(&output->z, mode);
        output->used = BUFFER - output->z.avail_out;
        if (mode == Z_FINISH ? status == Z_STREAM_END : output->z.avail_out > 0) {
            return FM_OK;
        }
        FM_TRY(flush_buffer(output));
    }
}

fm_result fm_output_begin_gzip(fm_output *output) {
    output->z.zalloc = fm_zlib_alloc;
    output->z.zfree = fm_zlib_free;
    output->z.opaque = (void *)(uintptr_t)output->allocator;
    if (deflateInit2(&output->z, LEVEL, Z_DEFLATED, 15 + 16, 8, Z_DEFAULT_STRATEGY) != Z_OK) {
        return fm_fail_prefix(FM_ERROR_OUT_OF_HOST_MEMORY, output->name);
    }
    output->gzip = true;
    return FM_OK;
}

fm_result fm_output_write(fm_output *output, const void *data, uint64_t size) {
    const uint8_t *bytes = data;
    if (output->gzip) {
        while (size > 0) {
            uint64_t piece = fm_min_u64(size, PIECE);
            output->z.next_in = (Bytef *)(uintptr_t)bytes;
            output->z.avail_in = (uInt)piece;
            FM_TRY(deflate_all(output, Z_NO_FLUSH));
            bytes += piece;
            size -= piece;
        }
        return FM_OK;
    }
    if (size >= BUFFER) {
        FM_TRY(flush_buffer(output));
        return put(output, bytes, size);
    }
    if (output->used + size > BUFFER) {
        FM_TRY(flush_buffer(output));
    }
    memcpy(output->buffer + output->used, bytes, (size_t)size);
    output->used += (size_t)size;
    return FM_OK;
}

fm_result fm_output_finish(fm_output *output) {
    if (output->gzip) {
        FM_TRY(deflate_all(output, Z_FINISH));
    }
    FM_TRY(flush_buffer(output));
    int fd = output->fd;
    output->fd = -1;
    // Some file systems report a full disk only here.
    return close(fd) == 0 ? FM_OK : output_error(output, "write", errno);
}

fm_result fm_output_rename(fm_output *output, bool undoable) {
    struct stat status;
    const bool there = lstat(output->target, &status) == 0;
    if (there && !S_ISREG(status.st_mode) && !S_ISLNK(status.st_mode)) {
        return output_error(output, "rename the finished file", S_ISDIR(status.st_mode) ? EISDIR : EEXIST);
    }
    const char *from = output->temporary->path;
    if (there && undoable && renameat2(AT_FDCWD, from, AT_FDCWD, output->target, RENAME_EXCHANGE) == 0) {
        output->placed = PLACED_EXCHANGED;
        return FM_OK;
    }
    if (rename(from, output->target) != 0) {
        return output_error(output, "rename the finished file", errno);
    }
    output->placed = there ? PLACED_OVER : PLACED_NEW;
    return FM_OK;
}

void fm_output_undo(fm_output *output) {
    const char *path = output->temporary->path;
    if (output->placed == PLACED_NEW) {
        (void)!rename(output->target, path);
    } else if (output->placed == PLACED_EXCHANGED && renameat2(AT_FDCWD, path, AT_FDCWD, output->target, RENAME_EXCHANGE) != 0) {
        // The file that was there before is not to be removed under its temporary name.
        atomic_store(&output->temporary->state, SLOT_FREE);
        output->temporary = NULL;
    }
}

void fm_output_destroy(fm_output *output) {
    if (!output) {
        return;
    }
    if (output->gzip) {
        deflateEnd(&output->z);
    }
    if (output->fd >= 0) {
        close(output->fd);
    }
    if (output->temporary) {
        if (atomic_load(&output->temporary->state) == SLOT_LIVE) {
            unlink(output->temporary->path);
        }
        atomic_store(&output->temporary->state, SLOT_FREE);
    }
    if (output->target) {
        fm_free(output->allocator, output->target, output->target_size);
    }
    fm_free(output->allocator, output, sizeof *output);
}

bool fm_output_is_direct(const fm_output *output) {
    return !output->temporary;
}
