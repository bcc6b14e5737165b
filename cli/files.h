// SPDX-License-Identifier: MIT
#ifndef FM_CLI_FILES_H
#define FM_CLI_FILES_H

// Files as subcommands take them: the options of an input, progress on a terminal, and outputs that come all or none.

#include "cli.h"

// The options that say how a file is to be read.
typedef struct files_input {
    struct arg_str *format, *shape, *type, *offset;
    struct arg_lit *big_endian, *hidden;
} files_input;

void files_input_add(cli_args *args, files_input *input);
// Fills a descriptor from the options; false on bad usage.
bool files_input_desc(const files_input *input, fm_read_desc *desc);

// Reads `path` into host memory, with a progress bar when that takes long and stderr is a terminal. Returns an exit code.
int files_read(const char *path, const fm_read_desc *desc, bool quiet, fm_volume **volume, fm_file_info *info);

// Files that a command has written, so that a failure later on leaves none of them.
typedef struct files_outputs {
    const char *paths[4];
    int count;
} files_outputs;

// Says early what would fail only after the work: a directory that is not there or cannot be written. Returns an exit code.
int files_output_check(const char *path);

// Writes like fm_file_write, with a progress bar, and notes the name. Returns an exit code; on failure the files noted are removed.
int files_write(files_outputs *outputs, const char *path, const fm_volume *volume, const fm_write_desc *desc, bool quiet);
// Notes a file that was written otherwise.
void files_written(files_outputs *outputs, const char *path);
void files_discard(const files_outputs *outputs);

bool files_is_pipe(const char *path);

#endif
