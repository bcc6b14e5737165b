// SPDX-License-Identifier: MIT
#ifndef FM_STREAM_H
#define FM_STREAM_H

// Files as streams of bytes: gunzipped and gzipped on the way, read in pieces, and written so that a failure leaves nothing behind.

#include "base/base.h"
#include "fathom/io.h"

// ---------------------------------------------------------------------------------------------------------------------------
// Input
// ---------------------------------------------------------------------------------------------------------------------------

typedef struct fm_input fm_input;

enum { FM_PEEK_MAX = 4096 };  // bytes that fm_input_peek can show

// Opens `path` ("-": standard input). A file that begins as gzip does is decompressed from the start. `allocator` must outlive it.
fm_result fm_input_open(const fm_allocator *allocator, const char *path, fm_input **input);
// The same, but never decompressed of itself.
fm_result fm_input_open_plain(const fm_allocator *allocator, const char *path, fm_input **input);
// As fm_input_open, over bytes in memory, which must outlive the input.
fm_result fm_input_open_memory(const fm_allocator *allocator, const void *data, uint64_t size, const char *name, fm_input **input);
void fm_input_close(fm_input *input);

// The next bytes without taking them: as many as `wanted` unless the file ends before. Valid until the next call.
fm_result fm_input_peek(fm_input *input, size_t wanted, const uint8_t **bytes, size_t *available);
// Exactly `size` bytes. A file that ends before is a FM_ERROR_FORMAT that names `part`.
fm_result fm_input_read(fm_input *input, void *target, uint64_t size, const char *part);
// Like fm_input_read, but stops quietly at the end of the file.
fm_result fm_input_read_some(fm_input *input, void *target, uint64_t size, uint64_t *got);
fm_result fm_input_skip(fm_input *input, uint64_t size, const char *part);
// A line without its end ("\n" or "\r\n"), as a string. A line of `capacity` bytes or more, or one with a NUL, is refused.
// `*end` (NULL allowed: the end of the file is an error then) tells that the file ended before any byte of the line.
fm_result fm_input_line(fm_input *input, char *line, size_t capacity, bool *end);
// Past the next newline, however far that is.
fm_result fm_input_skip_line(fm_input *input);
// Fails when bytes are left over. Checks the sum at the end of a gzip stream.
fm_result fm_input_expect_end(fm_input *input);
// All the rest, in memory of `*size` bytes from the allocator; more than `max` bytes are refused.
fm_result fm_input_slurp(fm_input *input, uint64_t max, uint8_t **data, uint64_t *size);

// What comes from here on is a gzip stream.
fm_result fm_input_begin_gzip(fm_input *input);
bool fm_input_is_gzip(const fm_input *input);
// No more than this many bytes can be left: UINT64_MAX when the source is a pipe. Lets a header's claim be checked before memory is
// taken for it.
uint64_t fm_input_bound(const fm_input *input);
// Fails unless `bytes` can still come, naming what claims it.
fm_result fm_input_require(const fm_input *input, uint64_t bytes, const char *claim);
// Bytes of the source as it lies on disk; UINT64_MAX for a pipe.
uint64_t fm_input_file_size(const fm_input *input);
// Bytes taken so far (after decompression).
uint64_t fm_input_position(const fm_input *input);
// Bytes of the source, as it lies on disk, that have been used for them.
uint64_t fm_input_source_position(const fm_input *input);
const char *fm_input_name(const fm_input *input);

// Sets the message "NAME: ..." and returns `result`.
fm_result fm_input_fail(const fm_input *input, fm_result result, const char *format, ...) FM_PRINTF(3, 4);

// ---------------------------------------------------------------------------------------------------------------------------
// Output
// ---------------------------------------------------------------------------------------------------------------------------

typedef struct fm_output fm_output;

// Opens a temporary file beside `path`, or `path` itself when that exists and is no regular file; "-" is standard output.
fm_result fm_output_open(const fm_allocator *allocator, const char *path, bool gzip, fm_output **output);
fm_result fm_output_write(fm_output *output, const void *data, uint64_t size);
// From here on what is written is compressed.
fm_result fm_output_begin_gzip(fm_output *output);
// Flushes and closes, but leaves the temporary name, so that several files can be completed before the first is renamed.
fm_result fm_output_finish(fm_output *output);
// Renames what fm_output_finish has closed. `undoable`: what was there before is kept under the temporary name, if the file system
// can do that.
fm_result fm_output_rename(fm_output *output, bool undoable);
// Puts back what an undoable rename has replaced.
void fm_output_undo(fm_output *output);
// Frees the output and what lies under its temporary name. NULL is fine.
void fm_output_destroy(fm_output *output);
// Whether the bytes go straight to a device, a pipe or standard output.
bool fm_output_is_direct(const fm_output *output);

enum { FM_MAX_TEMPORARIES = 64 };  // of the process, at one time

struct fm_file_batch {
    fm_allocator allocator;
    fm_output *outputs[FM_MAX_TEMPORARIES];
    uint32_t count;
};

// Finishes `output` (NULL is fine), and adds it if it has a temporary name. It is the batch's, or destroyed, from then on.
fm_result fm_batch_add(fm_file_batch *batch, fm_output *output);
// Destroys what is in it.
void fm_batch_clear(fm_file_batch *batch);

#endif
