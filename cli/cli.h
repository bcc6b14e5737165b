// SPDX-License-Identifier: MIT
#ifndef FM_CLI_H
#define FM_CLI_H

// What the subcommands share: exit codes, one-line errors and the parsing of arguments. Programs use the public headers only.

#include "fathom/fathom.h"
#include "fathom/io.h"
#include "scenes.h"

#include <argtable2.h>

enum { CLI_DONE = 0, CLI_FAILED = 1, CLI_USAGE = 2 };

#define CLI_PRINTF(string, first) __attribute__((format(printf, string, first)))

// Prints one line "fathom: ..." on stderr, control characters replaced, and returns CLI_FAILED or CLI_USAGE.
int cli_fail(const char *format, ...) CLI_PRINTF(1, 2);
int cli_usage(const char *format, ...) CLI_PRINTF(1, 2);
// The same with the library's message of the call that just failed.
int cli_library_failed(void);

// The arguments of one subcommand: options are added one by one, parsed together and freed together.
typedef struct cli_args {
    void *entries[64];
    int count;
} cli_args;

typedef struct cli_help {
    const char *command;   // "transform"
    const char *summary;   // one sentence
    const char *examples;  // lines without indent, each ended by a newline
} cli_help;

// Adds an argtable entry and gives it back: struct arg_lit *quiet = cli_add(&args, arg_lit0(...)).
void *cli_add(cli_args *args, void *entry);

// Adds --help and parses. Returns true when the command shall run; else `status` is the exit code: --help has been printed or an
// error said.
bool cli_parse(cli_args *args, const cli_help *help, int argc, char **argv, int *status);
void cli_free(cli_args *args);

// The option's word, or `otherwise` where it is not given.
const char *cli_given(const struct arg_str *option, const char *otherwise);

// Values of options. Each says what is wrong, naming `option`, and returns false on bad usage.
bool cli_shape(const char *option, const char *text, fm_shape *shape);                   // "N" or "X,Y,Z"
bool cli_triple(const char *option, const char *text, double values[3]);                 // "N" or "X,Y,Z"
bool cli_box(const char *option, const char *text, double box[6]);                       // "X0,Y0,Z0,X1,Y1,Z1", low, then high
bool cli_double(const char *option, const char *text, double *value);                    // finite
bool cli_int64(const char *option, const char *text, int64_t *value);                    // decimal or 0x...
bool cli_uint32(const char *option, const char *text, uint32_t least, uint32_t *value);  // at least `least`
bool cli_type(const char *option, const char *text, fm_type *type);                      // "u8" to "f64", "bits", or NumPy's names
bool cli_format(const char *option, const char *text, fm_format *format);                // see cli_format_words
extern const char *const cli_format_words[];

// A word, in either case, out of a list that ends with NULL; `value` gets its place in the list.
bool cli_word(const char *option, const char *text, const char *const *words, int *value);

// The same of "a,b,c", at most `most` words: `values` gets their places, `count` how many there are.
bool cli_words(const char *option, const char *list, const char *const *words, int most, int *values, int *count);

// Splits "a,b,c", at most `most` words, and hands each to `take`, which says what is wrong with it. False on bad usage.
bool cli_each(const char *option, const char *list, int most, bool (*take)(const char *option, const char *word, void *user),
              void *user);
// A word of such a list: "N" or "XxYxZ".
bool cli_shape_word(const char *option, const char *word, fm_shape *shape);

// The size of a picture, "1920x1080", as a shape with z 1.
bool cli_picture(const char *option, const char *text, fm_shape *shape);

// The edge of chunks: 0, 8, 16, ..., 256.
bool cli_chunk(const char *option, const char *text, uint32_t *chunk);
// The scene of that name; NULL on bad usage.
const fm_scene *cli_scene(const char *option, const char *name);

// "12.3 GiB".
const char *cli_bytes(uint64_t bytes, char text[32]);

// Where to compute: the options, and what they say.
typedef struct cli_device {
    struct arg_str *backend, *device, *threads;
} cli_device;
void cli_device_add(cli_args *args, cli_device *options);
bool cli_device_read(const cli_device *options, fm_context_desc *wanted);

// The words of a list that ends with NULL, with commas between them.
const char *cli_list(const char *const *words, char text[256]);

#endif
