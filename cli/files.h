// SPDX-License-Identifier: MIT
#ifndef FM_CLI_FILES_H
#define FM_CLI_FILES_H

// Files as subcommands take them: the options of an input, progress on a terminal, and outputs that appear when they are whole.

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

// Says early what would fail only after the work: a directory that is not there or cannot be written. Returns an exit code.
int files_output_check(const char *path);
// The same for a picture, which must be named as the PNG it is.
int files_picture_check(const char *path);

// Writes like fm_file_write, with a progress bar. Returns an exit code.
int files_write(const char *path, const fm_volume *volume, const fm_write_desc *desc, bool quiet);

// Puts `size` bytes of text into a file that appears when it is whole. Returns an exit code.
int files_write_text(const char *path, const char *text, size_t size);

bool files_is_pipe(const char *path);
// A file that can be read in any order and begins with these bytes.
bool files_begins(const char *path, const char *bytes, size_t count);
// An octree by its name or its first bytes; false for files that are not there.
bool files_is_octree(const char *path);
// Says that the file is an octree, and which commands take it. Returns an exit code.
int files_tell_octree(const char *path, const char *instead_of);
// Whether two names stand for one file, be it there already or not. NULL is the same as nothing.
bool files_same(const char *a, const char *b);

#endif
