// SPDX-License-Identifier: MIT
#include "files.h"

#include "progress.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

bool files_is_pipe(const char *path) {
    return strcmp(path, "-") == 0;
}

void files_input_add(cli_args *args, files_input *input) {
    input->format =
        cli_add(args, arg_str0(NULL, "input-format", "FORMAT", "read as npy, raw, nrrd, nifti, vox, binvox or octomap"));
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
    return result == FM_OK ? CLI_DONE : cli_library_failed();
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
    char directory[4096] = ".";
    const char *slash = strrchr(path, '/');
    if (slash) {
        size_t length = slash == path ? 1 : (size_t)(slash - path);
        if (length >= sizeof directory) {
            return cli_fail("the name of the output has more than %zu bytes: use a shorter one", sizeof directory - 1);
        }
        memcpy(directory, path, length);
        directory[length] = '\0';
    }
    if (access(directory, W_OK | X_OK) != 0) {
        return cli_fail("%s: %s: make the directory %s, or name one that can be written", path, strerror(errno), directory);
    }
    return CLI_DONE;
}

void files_written(files_outputs *outputs, const char *path) {
    outputs->paths[outputs->count++] = path;
}

void files_discard(const files_outputs *outputs) {
    for (int i = 0; i < outputs->count; i++) {
        struct stat status;
        if (!files_is_pipe(outputs->paths[i]) && lstat(outputs->paths[i], &status) == 0 && S_ISREG(status.st_mode)) {
            unlink(outputs->paths[i]);
        }
    }
}

int files_write(files_outputs *outputs, const char *path, const fm_volume *volume, const fm_write_desc *desc, bool quiet) {
    progress bar = progress_begin("writing", !quiet);
    fm_write_desc told = *desc;
    told.progress = progress_step;
    told.progress_user = &bar;
    fm_result result = fm_file_write(path, volume, &told);
    progress_end(&bar);
    if (result != FM_OK) {
        int status = cli_library_failed();
        files_discard(outputs);
        return status;
    }
    files_written(outputs, path);
    return CLI_DONE;
}
