// SPDX-License-Identifier: MIT
#include "cli.h"

#include "words.h"

#include <assert.h>
#include <errno.h>
#include <inttypes.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

static void say(const char *format, va_list arguments) {
    char line[1024];
    vsnprintf(line, sizeof line, format, arguments);
    for (char *c = line; *c; c++) {
        if ((unsigned char)*c < ' ' || *c == 127) {
            *c = '?';
        }
    }
    fprintf(stderr, "fathom: %s\n", line);
}

int cli_fail(const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    say(format, arguments);
    va_end(arguments);
    return CLI_FAILED;
}

int cli_usage(const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    say(format, arguments);
    va_end(arguments);
    return CLI_USAGE;
}

int cli_library_failed(void) {
    return cli_fail("%s", fm_last_error());
}

void *cli_add(cli_args *args, void *entry) {
    // Room for --help and the end mark stays.
    assert(args->count < (int)(sizeof args->entries / sizeof args->entries[0]) - 2);
    args->entries[args->count++] = entry;
    return entry;
}

static void print_usage(const cli_args *args, const char *command) {
    enum { WIDTH = 100 };
    char *syntax = NULL;
    size_t size = 0;
    FILE *stream = open_memstream(&syntax, &size);
    if (!stream) {
        return;
    }
    arg_print_syntax(stream, (void **)args->entries, "");
    fclose(stream);
    int column = printf("usage: fathom %s", command);
    const int indent = column;
    for (const char *word = syntax; syntax && *word;) {
        const int length = (int)strcspn(word + 1, " ") + 1;
        if (column + length > WIDTH) {
            printf("\n%*s", indent, "");
            column = indent;
        }
        column += printf("%.*s", length, word);
        word += length;
    }
    printf("\n\n");
    free(syntax);
}

static void print_help(const cli_args *args, const cli_help *help) {
    print_usage(args, help->command);
    printf("%s\n\n", help->summary);
    arg_print_glossary(stdout, (void **)args->entries, "  %-30s %s\n");
    if (help->examples) {
        printf("\nexamples:\n");
        for (const char *line = help->examples; *line;) {
            const char *end = strchr(line, '\n');
            int length = end ? (int)(end - line) : (int)strlen(line);
            printf("  %.*s\n", length, line);
            line += length + (end ? 1 : 0);
        }
    }
}

// argtable prints an error a line; the first one is enough.
static int first_error(struct arg_end *end, const char *command) {
    char *text = NULL;
    size_t size = 0;
    FILE *stream = open_memstream(&text, &size);
    if (stream) {
        arg_print_errors(stream, end, command);
        fclose(stream);
        text[strcspn(text, "\n")] = '\0';
    }
    // It calls every missing thing an option.
    static const char missing[] = "missing option ", excess[] = "excess option ";
    char *lacking = text ? strstr(text, missing) : NULL, *twice = text ? strstr(text, excess) : NULL;
    int status;
    if (lacking && lacking[strlen(missing)] != '-') {
        status = cli_usage("%.*smissing argument %s: see fathom %s --help", (int)(lacking - text), text, lacking + strlen(missing),
                           command);
    } else if (twice && twice[strlen(excess)] == '-') {
        status =
            cli_usage("%.*s%s is given twice: see fathom %s --help", (int)(twice - text), text, twice + strlen(excess), command);
    } else {
        status = cli_usage("%s: see fathom %s --help", text && *text ? text : command, command);
    }
    free(text);
    return status;
}

bool cli_parse(cli_args *args, const cli_help *help, int argc, char **argv, int *status) {
    struct arg_lit *wants_help = cli_add(args, arg_lit0("h", "help", "print this help"));
    struct arg_end *end = arg_end(20);
    args->entries[args->count] = end;
    if (arg_nullcheck(args->entries) != 0) {
        *status = cli_fail("out of memory for the arguments: free some");
        return false;
    }
    args->count++;
    int errors = arg_parse(argc, argv, args->entries);
    if (wants_help->count > 0) {
        print_help(args, help);
        *status = CLI_DONE;
        return false;
    }
    if (errors > 0) {
        *status = first_error(end, help->command);
        return false;
    }
    return true;
}

void cli_free(cli_args *args) {
    arg_freetable(args->entries, (size_t)args->count);
}

const char *cli_given(const struct arg_str *option, const char *otherwise) {
    return option->count ? option->sval[0] : otherwise;
}

bool cli_double(const char *option, const char *text, double *value) {
    char *end;
    *value = strtod(text, &end);
    if (end == text || *end || !isfinite(*value)) {
        cli_usage("%s is \"%s\": a finite number is wanted", option, text);
        return false;
    }
    return true;
}

bool cli_int64(const char *option, const char *text, int64_t *value) {
    char *end;
    errno = 0;
    *value = strtoll(text, &end, 0);
    if (end == text || *end || errno) {
        cli_usage("%s is \"%s\": a whole number of 64 bits is wanted", option, text);
        return false;
    }
    return true;
}

bool cli_uint32(const char *option, const char *text, uint32_t least, uint32_t *value) {
    char *end;
    errno = 0;
    long long parsed = strtoll(text, &end, 10);
    if (end == text || *end || errno || parsed < (long long)least || parsed > (long long)UINT32_MAX) {
        cli_usage("%s is \"%s\": a whole number from %u to 4294967295 is wanted", option, text, least);
        return false;
    }
    *value = (uint32_t)parsed;
    return true;
}

// Reads up to three numbers separated by commas; returns how many there are, 0 when the text is something else.
static int list_of_numbers(const char *text, double values[3]) {
    for (int count = 0; count < 3; count++) {
        char *end;
        values[count] = strtod(text, &end);
        if (end == text || !isfinite(values[count])) {
            return 0;
        }
        if (!*end) {
            return count + 1;
        }
        if (*end != ',') {
            return 0;
        }
        text = end + 1;
    }
    return 0;
}

bool cli_triple(const char *option, const char *text, double values[3]) {
    const int count = list_of_numbers(text, values);
    if (count != 1 && count != 3) {
        cli_usage("%s is \"%s\": three numbers X,Y,Z, or one for all axes, are wanted", option, text);
        return false;
    }
    if (count == 1) {
        values[1] = values[2] = values[0];
    }
    return true;
}

bool cli_shape(const char *option, const char *text, fm_shape *shape) {
    double values[3];
    int count = list_of_numbers(text, values);
    bool good = count == 1 || count == 3;
    for (int i = 0; good && i < count; i++) {
        good = values[i] >= 1 && values[i] <= INT32_MAX && values[i] == floor(values[i]);
    }
    if (!good) {
        cli_usage("%s is \"%s\": N or X,Y,Z is wanted, each a whole number from 1 to 2147483647", option, text);
        return false;
    }
    *shape = (fm_shape){(uint32_t)values[0], (uint32_t)values[count == 3 ? 1 : 0], (uint32_t)values[count == 3 ? 2 : 0]};
    return true;
}

bool cli_type(const char *option, const char *text, fm_type *type) {
    int place = 0;
    while (fm_type_words[place] && strcmp(text, fm_type_name((fm_type)place)) != 0) {
        place++;
    }
    if (!fm_type_words[place] && !cli_word(option, text, fm_type_words, &place)) {
        return false;
    }
    *type = (fm_type)place;
    return true;
}

const char *const cli_format_words[] = {
    [FM_FORMAT_AUTO] = "auto",   [FM_FORMAT_NPY] = "npy", [FM_FORMAT_RAW] = "raw",         [FM_FORMAT_NRRD] = "nrrd",
    [FM_FORMAT_NIFTI] = "nifti", [FM_FORMAT_VOX] = "vox", [FM_FORMAT_BINVOX] = "binvox",   [FM_FORMAT_OCTOMAP] = "octomap",
    [FM_FORMAT_3DMAP] = "3dmap", [FM_FORMAT_VXL] = "vxl", [FM_FORMAT_NANOVDB] = "nanovdb", NULL,
};

bool cli_format(const char *option, const char *text, fm_format *format) {
    int place = 0;
    // As its files are named.
    const bool alias = strcasecmp(text, "nvdb") == 0;
    bool good = cli_word(option, alias ? "nanovdb" : text, cli_format_words, &place);
    *format = (fm_format)place;
    return good;
}

const char *cli_list(const char *const *words, char text[256]) {
    size_t used = 0;
    text[0] = '\0';
    for (int i = 0; words[i] && used < 256; i++) {
        used += (size_t)snprintf(text + used, 256 - used, "%s%s", i ? ", " : "", words[i]);
    }
    return text;
}

bool cli_word(const char *option, const char *text, const char *const *words, int *value) {
    for (int i = 0; words[i]; i++) {
        if (strcasecmp(text, words[i]) == 0) {
            *value = i;
            return true;
        }
    }
    char list[256];
    cli_usage("%s is \"%s\": one of %s is wanted", option, text, cli_list(words, list));
    return false;
}

bool cli_each(const char *option, const char *list, int most, bool (*take)(const char *option, const char *word, void *user),
              void *user) {
    char word[64];
    int count = 0;
    for (const char *at = list;; at++) {
        const size_t length = strcspn(at, ",");
        if (length == 0 || length >= sizeof word || ++count > most) {
            cli_usage("%s is \"%s\": up to %d words separated by commas are wanted", option, list, most);
            return false;
        }
        memcpy(word, at, length);
        word[length] = '\0';
        if (!take(option, word, user)) {
            return false;
        }
        at += length;
        if (!*at) {
            return true;
        }
    }
}

static bool take_number(const char *option, const char *word, void *user) {
    double **next = user;
    return cli_double(option, word, (*next)++);
}

bool cli_box(const char *option, const char *text, double box[6]) {
    double values[6] = {0}, *next = values;
    if (!cli_each(option, text, 6, take_number, &next)) {
        return false;
    }
    const bool all = next == values + 6;
    if (!all || !(values[0] < values[3] && values[1] < values[4] && values[2] < values[5])) {
        cli_usage("%s is \"%s\": X0,Y0,Z0,X1,Y1,Z1 is wanted, the low corner and then the high one, which is above it", option,
                  text);
        return false;
    }
    memcpy(box, values, sizeof values);
    return true;
}

typedef struct word_list {
    const char *const *words;
    int *values;
    int count;
} word_list;

static bool take_word(const char *option, const char *word, void *user) {
    word_list *list = user;
    return cli_word(option, word, list->words, &list->values[list->count++]);
}

bool cli_words(const char *option, const char *list, const char *const *words, int most, int *values, int *count) {
    word_list taken = {words, values, 0};
    const bool good = cli_each(option, list, most, take_word, &taken);
    *count = taken.count;
    return good;
}

bool cli_shape_word(const char *option, const char *word, fm_shape *shape) {
    // Commas are taken: a shape that is no cube is written 512x512x64.
    char text[64];
    snprintf(text, sizeof text, "%s", word);
    for (char *c = text; *c; c++) {
        *c = *c == 'x' ? ',' : *c;
    }
    return cli_shape(option, text, shape);
}

bool cli_picture(const char *option, const char *text, fm_shape *shape) {
    uint32_t sides[2];
    int used = 0;
    if (sscanf(text, "%5" SCNu32 "x%5" SCNu32 "%n", &sides[0], &sides[1], &used) != 2 || text[used] != '\0' ||
        sides[0] - 1 > 16383 || sides[1] - 1 > 16383) {
        cli_usage("%s is \"%s\": WIDTHxHEIGHT is wanted, each from 1 to 16384", option, text);
        return false;
    }
    *shape = (fm_shape){sides[0], sides[1], 1};
    return true;
}

bool cli_chunk(const char *option, const char *text, uint32_t *chunk) {
    if (!cli_uint32(option, text, 0, chunk)) {
        return false;
    }
    if (*chunk != 0 && (*chunk < 8 || *chunk > 256 || (*chunk & (*chunk - 1)))) {
        cli_usage("%s is %s: 8, 16, 32, 64, 128 or 256 is wanted, or 0 for the whole world", option, text);
        return false;
    }
    return true;
}

const fm_scene *cli_scene(const char *option, const char *name) {
    const fm_scene *scene = fm_scene_find(name);
    char list[256] = "";
    for (uint32_t i = 0; !scene && fm_scene_at(i); i++) {
        const size_t used = strlen(list);
        snprintf(list + used, sizeof list - used, "%s%s", i ? ", " : "", fm_scene_name(fm_scene_at(i)));
    }
    if (!scene) {
        cli_usage("%s is \"%s\": one of %s is wanted", option, name, list);
    }
    return scene;
}

const char *cli_bytes(uint64_t bytes, char text[32]) {
    static const char *const units[] = {"bytes", "KiB", "MiB", "GiB", "TiB", "PiB", "EiB"};
    double value = (double)bytes;
    int unit = 0;
    for (; value >= 1024 && unit < 6; unit++) {
        value /= 1024;
    }
    snprintf(text, 32, unit ? "%.1f %s" : "%.0f %s", value, units[unit]);
    return text;
}

void cli_device_add(cli_args *args, cli_device *o) {
    o->backend = cli_add(args, arg_str0(NULL, "backend", "auto|cpu|vulkan", "default auto: a real GPU, else the CPU"));
    o->device = cli_add(args, arg_str0(NULL, "device", "D", "Vulkan device: index or part of its name"));
    o->threads = cli_add(args, arg_str0(NULL, "threads", "N", "threads of the CPU backend; default one a processor"));
}

bool cli_device_read(const cli_device *o, fm_context_desc *wanted) {
    int backend = 0;
    if (!cli_word("--backend", cli_given(o->backend, "auto"), fm_backend_words, &backend) ||
        (o->threads->count && !cli_uint32("--threads", o->threads->sval[0], 1, &wanted->threads))) {
        return false;
    }
    wanted->backend = (fm_backend)backend;
    wanted->device = cli_given(o->device, NULL);
    if (wanted->device && wanted->backend == FM_BACKEND_CPU) {
        cli_usage("--device is given with --backend cpu: it names a Vulkan device");
        return false;
    }
    return true;
}
