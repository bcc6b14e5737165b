// SPDX-License-Identifier: MIT
#include "files.h"

#include "progress.h"

#include "fathom/mesh_io.h"

#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>
#include <unistd.h>

bool files_is_pipe(const char *path) {
    return strcmp(path, "-") == 0;
}

bool files_begins(const char *path, const char *bytes, size_t count) {
    char start[16];
    struct stat status;
    if (files_is_pipe(path) || count > sizeof start || stat(path, &status) != 0 || !S_ISREG(status.st_mode)) {
        return false;
    }
    FILE *file = fopen(path, "rb");
    const bool same = file && fread(start, 1, count, file) == count && memcmp(start, bytes, count) == 0;
    if (file) {
        fclose(file);
    }
    return same;
}

static bool ends_in(const char *path, const char *ending) {
    const size_t length = strlen(path), count = strlen(ending);
    return length > count && strcasecmp(path + length - count, ending) == 0;
}

bool files_is_octree(const char *path) {
    const bool named = ends_in(path, ".fmo") || ends_in(path, ".fmo.gz");
    return files_begins(path,
                        "\x89"
                        "FMO",
                        4) ||
           (named && access(path, F_OK) == 0);
}

int files_tell_octree(const char *path, const char *instead_of) {
    return cli_fail("%s: it is an octree, not %s: fathom octree info describes it, and fathom octree render draws it", path,
                    instead_of);
}

void files_input_add(cli_args *args, files_input *input) {
    static char formats[300], list[256];
    snprintf(formats, sizeof formats, "read as one of %s", cli_list(cli_format_words, list));
    input->format = cli_add(args, arg_str0(NULL, "input-format", "FORMAT", formats));
    input->shape = cli_add(args, arg_str0(NULL, "shape", "X,Y,Z", "shape of a bare raw file"));
    input->type = cli_add(args, arg_str0(NULL, "input-type", "TYPE", "element type of a bare raw file, e.g. u8"));
    input->offset = cli_add(args, arg_str0(NULL, "offset", "BYTES", "bytes before the first element of a bare raw file"));
    input->big_endian = cli_add(args, arg_lit0(NULL, "big-endian", "a bare raw file has the highest byte first"));
    input->hidden = cli_add(args, arg_lit0(NULL, "include-hidden", "read the hidden nodes of .vox scenes too"));
}

bool files_input_desc(const files_input *input, fm_read_desc *desc) {
    *desc = (fm_read_desc){.big_endian = input->big_endian->count > 0, .include_hidden = input->hidden->count > 0};
    if (input->format->count && !cli_format("--input-format", input->format->sval[0], &desc->format)) {
        return false;
    }
    const bool raw = input->shape->count || input->type->count || input->offset->count || input->big_endian->count;
    if (raw) {
        if (!input->shape->count || !input->type->count) {
            cli_usage("%s is given without %s: a bare raw file needs --shape and --input-type",
                      input->type->count ? "--input-type" : "a raw layout", input->shape->count ? "--input-type" : "--shape");
            return false;
        }
        if (desc->format != FM_FORMAT_AUTO && desc->format != FM_FORMAT_RAW) {
            cli_usage("--input-format is \"%s\": --shape and --input-type are for raw files", input->format->sval[0]);
            return false;
        }
        desc->format = FM_FORMAT_RAW;
        int64_t offset = 0;
        if (!cli_shape("--shape", input->shape->sval[0], &desc->shape) ||
            !cli_type("--input-type", input->type->sval[0], &desc->type) ||
            (input->offset->count && !cli_int64("--offset", input->offset->sval[0], &offset))) {
            return false;
        }
        if (offset < 0) {
            cli_usage("--offset is %s: 0 or more is wanted", input->offset->sval[0]);
            return false;
        }
        desc->offset = (uint64_t)offset;
    }
    return true;
}

int files_read(const char *path, const fm_read_desc *desc, bool quiet, fm_volume **volume, fm_file_info *info) {
    progress bar = progress_begin("reading", !quiet);
    fm_read_desc told = *desc;
    told.progress = progress_step;
    told.progress_user = &bar;
    fm_result result = fm_file_read(NULL, path, &told, volume, info);
    progress_end(&bar);
    if (result != FM_OK && desc->format == FM_FORMAT_AUTO && files_is_octree(path)) {
        return files_tell_octree(path, "a volume");
    }
    if (result != FM_OK && desc->format == FM_FORMAT_AUTO && fm_mesh_format_of(path) != FM_MESH_FORMAT_AUTO) {
        return cli_fail("%s: it is a mesh, not a volume: make one of it with fathom sdf or fathom voxelize", path);
    }
    return result == FM_OK ? CLI_DONE : cli_library_failed();
}

// False when the name is too long.
static bool directory_of(const char *path, char directory[PATH_MAX]) {
    const char *slash = strrchr(path, '/');
    const size_t length = !slash || slash == path ? 1 : (size_t)(slash - path);
    if (length >= PATH_MAX) {
        return false;
    }
    memcpy(directory, slash ? path : ".", length);
    directory[length] = '\0';
    return true;
}

int files_output_check(const char *path) {
    if (files_is_pipe(path)) {
        return CLI_DONE;
    }
    struct stat status;
    if (stat(path, &status) == 0) {
        if (S_ISDIR(status.st_mode)) {
            return cli_fail("%s: is a directory: name a file in it", path);
        }
        if (!S_ISREG(status.st_mode)) {
            return CLI_DONE;
        }
    }
    char directory[PATH_MAX];
    if (!directory_of(path, directory)) {
        return cli_fail("the name of the output has more than %zu bytes: use a shorter one", sizeof directory - 1);
    }
    if (access(directory, W_OK | X_OK) != 0) {
        return cli_fail("%s: %s: make the directory %s, or name one that can be written", path, strerror(errno), directory);
    }
    return CLI_DONE;
}

int files_picture_check(const char *path) {
    const size_t length = strlen(path);
    struct stat status;
    const bool special = files_is_pipe(path) || (stat(path, &status) == 0 && !S_ISREG(status.st_mode));
    if (!special && (length < 4 || strcasecmp(path + length - 4, ".png") != 0)) {
        return cli_usage("%s: pictures are PNG files: end the name in .png", path);
    }
    return files_output_check(path);
}

int files_write(const char *path, const fm_volume *volume, const fm_write_desc *desc, bool quiet) {
    progress bar = progress_begin("writing", !quiet);
    fm_write_desc told = *desc;
    told.progress = progress_step;
    told.progress_user = &bar;
    fm_result result = fm_file_write(path, volume, &told);
    progress_end(&bar);
    return result == FM_OK ? CLI_DONE : cli_library_failed();
}

static bool put_text(int fd, const char *text, size_t size) {
    while (size > 0) {
        ssize_t count = write(fd, text, size);
        if (count < 0 && errno != EINTR) {
            return false;
        }
        text += count < 0 ? 0 : count;
        size -= count < 0 ? 0 : (size_t)count;
    }
    return true;
}

static int replace_text(const char *path, const char *text, size_t size) {
    char temporary[PATH_MAX + 16];
    char real[PATH_MAX];
    // A link stays one.
    const char *target = realpath(path, real) ? real : path;
    snprintf(temporary, sizeof temporary, "%s.XXXXXX", target);
    int fd = mkostemp(temporary, O_CLOEXEC);
    if (fd < 0) {
        return cli_fail("%s: %s: name a file that can be written", path, strerror(errno));
    }
    struct stat status;
    const mode_t mask = umask(0);
    umask(mask);
    bool good = fchmod(fd, stat(path, &status) == 0 ? status.st_mode & 07777 : 0666 & ~mask) == 0;
    good = put_text(fd, text, size) && good;
    good = close(fd) == 0 && good;
    if (!good || rename(temporary, target) != 0) {
        int code = errno;
        unlink(temporary);
        return cli_fail("%s: cannot be written to the end: %s", path, strerror(code));
    }
    return CLI_DONE;
}

int files_write_text(const char *path, const char *text, size_t size) {
    struct stat status;
    if (stat(path, &status) == 0 && !S_ISREG(status.st_mode)) {
        int fd = open(path, O_WRONLY | O_CLOEXEC | O_NOCTTY);
        bool good = fd >= 0 && put_text(fd, text, size);
        int code = errno;
        if (fd >= 0) {
            close(fd);
        }
        return good ? CLI_DONE : cli_fail("%s: cannot be written: %s", path, strerror(code));
    }
    // The text is ready: an interruption can wait for the moment that its file takes.
    sigset_t all, before;
    sigfillset(&all);
    sigprocmask(SIG_SETMASK, &all, &before);
    int result = replace_text(path, text, size);
    sigprocmask(SIG_SETMASK, &before, NULL);
    return result;
}

bool files_same(const char *a, const char *b) {
    if (!a || !b) {
        return false;
    }
    if (files_is_pipe(a) || files_is_pipe(b)) {
        return files_is_pipe(a) && files_is_pipe(b);
    }
    struct stat first, second;
    if (stat(a, &first) == 0 && stat(b, &second) == 0) {
        return first.st_dev == second.st_dev && first.st_ino == second.st_ino;
    }
    const char *slash_a = strrchr(a, '/'), *slash_b = strrchr(b, '/');
    if (strcmp(slash_a ? slash_a + 1 : a, slash_b ? slash_b + 1 : b) != 0) {
        return false;
    }
    char directory[PATH_MAX];
    return directory_of(a, directory) && stat(directory, &first) == 0 && directory_of(b, directory) &&
           stat(directory, &second) == 0 && first.st_dev == second.st_dev && first.st_ino == second.st_ino;
}
