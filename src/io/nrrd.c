// SPDX-License-Identifier: MIT

// NRRD, attached and detached, raw and gzip. Each header line is checked here; those that describe the array go on to teem, as text
// in memory and without a file, and the elements are read here, in pieces.

#include "io/file.h"

#include <errno.h>
#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>
#include <teem/nrrd.h>

enum { MAX_LINE = 1024, MAX_HEADER = 8192, MAX_LINES = 1000, MAX_AXES = 16 };

// teem keeps its error messages in one list for the whole process.
static pthread_mutex_t teem_lock = PTHREAD_MUTEX_INITIALIZER;

typedef enum field_use {
    USE_TEEM,  // describes the array
    USE_HERE,  // where and how the elements lie
    USE_NOT,   // known, and of no consequence
} field_use;

typedef struct field {
    const char *name;
    field_use use;
    char slot;  // fields of one slot are other spellings of each other
} field;

static const field fields[] = {
    {"dimension", USE_TEEM, 'a'},
    {"type", USE_TEEM, 'b'},
    {"sizes", USE_TEEM, 'c'},
    {"spacings", USE_TEEM, 'd'},
    {"endian", USE_TEEM, 'e'},
    {"space", USE_TEEM, 'f'},
    {"space dimension", USE_TEEM, 'g'},
    {"space directions", USE_TEEM, 'h'},
    {"space origin", USE_TEEM, 'i'},
    {"encoding", USE_TEEM, 'j'},
    {"byte skip", USE_HERE, 'k'},
    {"byteskip", USE_HERE, 'k'},
    {"line skip", USE_HERE, 'l'},
    {"lineskip", USE_HERE, 'l'},
    {"data file", USE_HERE, 'm'},
    {"datafile", USE_HERE, 'm'},
    {"content", USE_NOT, 'n'},
    {"number", USE_NOT, 'o'},
    {"min", USE_NOT, 'p'},
    {"max", USE_NOT, 'q'},
    {"old min", USE_NOT, 'r'},
    {"oldmin", USE_NOT, 'r'},
    {"old max", USE_NOT, 's'},
    {"oldmax", USE_NOT, 's'},
    {"thicknesses", USE_NOT, 't'},
    {"axis mins", USE_NOT, 'u'},
    {"axismins", USE_NOT, 'u'},
    {"axis maxs", USE_NOT, 'v'},
    {"axismaxs", USE_NOT, 'v'},
    {"centers", USE_NOT, 'w'},
    {"centerings", USE_NOT, 'w'},
    {"labels", USE_NOT, 'x'},
    {"units", USE_NOT, 'y'},
    {"kinds", USE_NOT, 'z'},
    {"sample units", USE_NOT, 'A'},
    {"sampleunits", USE_NOT, 'A'},
    {"space units", USE_NOT, 'B'},
    {"measurement frame", USE_NOT, 'C'},
    {"block size", USE_NOT, 'D'},
    {"blocksize", USE_NOT, 'D'},
};
enum { FIELD_COUNT = sizeof fields / sizeof fields[0] };

typedef struct nrrd_header {
    char teem[MAX_HEADER];  // the lines for teem
    size_t teem_size;
    bool seen[128];  // by slot
    char data_file[MAX_LINE];
    int64_t byte_skip;
    uint64_t line_skip;
    bool gzip;
} nrrd_header;

static bool nrrd_matches(const uint8_t *head, size_t size) {
    return size >= 8 && memcmp(head, "NRRD000", 7) == 0;
}

static const field *find_field(const char *name, size_t length) {
    for (int i = 0; i < FIELD_COUNT; i++) {
        if (strlen(fields[i].name) == length && strncasecmp(fields[i].name, name, length) == 0) {
            return &fields[i];
        }
    }
    return NULL;
}

static bool parse_count(const char *text, int64_t least, int64_t *value) {
    char *end;
    errno = 0;
    long long parsed = strtoll(text, &end, 10);
    *value = parsed;
    return end != text && *end == 0 && errno == 0 && parsed >= least;
}

static fm_result bad_line(const fm_reader *reader, const char *line) {
    return fm_input_fail(reader->input, FM_ERROR_FORMAT, "has a header line that is not understood: \"%.200s\"", line);
}

// Takes `count` whole numbers of 1 to 2^31 - 1 out of the text; all that teem multiplies.
static bool plain_sizes(const char *text, int *count) {
    for (*count = 0; *text; ++*count) {
        char *end;
        errno = 0;
        long long value = strtoll(text, &end, 10);
        if (end == text || errno || value < 1 || value > INT32_MAX || *count == MAX_AXES || (*end && *end != ' ' && *end != '\t')) {
            return false;
        }
        text = end + strspn(end, " \t");
    }
    return *count > 0;
}

static bool plain_text(const char *text) {
    for (; *text; text++) {
        if ((*text < ' ' || *text > '~') && *text != '\t') {
            return false;
        }
    }
    return true;
}

static fm_result take_encoding(fm_reader *reader, nrrd_header *header, const char *value) {
    header->gzip = strcasecmp(value, "gzip") == 0 || strcasecmp(value, "gz") == 0;
    if (!header->gzip && strcasecmp(value, "raw") != 0) {
        return fm_input_fail(reader->input, FM_ERROR_UNSUPPORTED,
                             "has the encoding \"%.40s\": raw and gzip are read; convert it with teem's `unu save -f nrrd -e gzip`",
                             value);
    }
    return FM_OK;
}

static fm_result take_field(fm_reader *reader, nrrd_header *header, const field *f, const char *value, const char *line) {
    int64_t number;
    int sizes;
    if (header->seen[(int)f->slot]) {
        return fm_input_fail(reader->input, FM_ERROR_FORMAT, "has two header lines \"%s\"", f->name);
    }
    header->seen[(int)f->slot] = true;
    switch (f->slot) {
    case 'a':
        if (!parse_count(value, 1, &number) || number > MAX_AXES) {
            return bad_line(reader, line);
        }
        break;
    case 'c':
        if (!plain_sizes(value, &sizes)) {
            return bad_line(reader, line);
        }
        break;
    case 'j':
        FM_TRY(take_encoding(reader, header, value));
        break;
    case 'k':
        return parse_count(value, -1, &header->byte_skip) ? FM_OK : bad_line(reader, line);
    case 'l':
        if (!parse_count(value, 0, &number)) {
            return bad_line(reader, line);
        }
        header->line_skip = (uint64_t)number;
        return FM_OK;
    case 'm':
        snprintf(header->data_file, sizeof header->data_file, "%s", value);
        return value[0] ? FM_OK : bad_line(reader, line);
    default:
        break;
    }
    if (f->use == USE_TEEM) {
        if (!plain_text(line)) {
            return bad_line(reader, line);
        }
        int length = snprintf(header->teem + header->teem_size, sizeof header->teem - header->teem_size, "%s\n", line);
        header->teem_size += (size_t)length;
        if (header->teem_size >= sizeof header->teem - 1) {
            return fm_input_fail(reader->input, FM_ERROR_FORMAT, "has a header of over %d bytes", MAX_HEADER);
        }
    }
    return FM_OK;
}

static fm_result read_lines(fm_reader *reader, nrrd_header *header) {
    char line[MAX_LINE];
    bool end = false;
    FM_TRY(fm_input_line(reader->input, line, sizeof line, NULL));
    if (strlen(line) != 8 || line[7] < '1' || line[7] > '5') {
        return fm_input_fail(reader->input, FM_ERROR_UNSUPPORTED, "is of the NRRD version \"%.20s\": NRRD0001 to NRRD0005 are read",
                             line);
    }
    header->teem_size = (size_t)snprintf(header->teem, sizeof header->teem, "NRRD0005\n");
    for (int count = 0;; count++) {
        FM_TRY(fm_input_line(reader->input, line, sizeof line, &end));
        if (end || line[0] == 0) {
            break;
        }
        if (count == MAX_LINES) {
            return fm_input_fail(reader->input, FM_ERROR_FORMAT, "has a header of over %d lines", MAX_LINES);
        }
        // Comments, and keys and values of the user's own.
        if (line[0] == '#' || strstr(line, ":=")) {
            continue;
        }
        char *colon = strstr(line, ": ");
        const field *f = colon ? find_field(line, (size_t)(colon - line)) : NULL;
        if (!f) {
            return bad_line(reader, line);
        }
        const char *value = colon + 2 + strspn(colon + 2, " \t");
        for (size_t length = strlen(line); length > 0 && (line[length - 1] == ' ' || line[length - 1] == '\t'); length--) {
            line[length - 1] = 0;
        }
        FM_TRY(take_field(reader, header, f, value, line));
    }
    if (end && !header->data_file[0]) {
        return fm_input_fail(reader->input, FM_ERROR_FORMAT, "ends within its header: the file is truncated, get it again");
    }
    if (!header->seen['a'] || !header->seen['b'] || !header->seen['c'] || !header->seen['j']) {
        return fm_input_fail(reader->input, FM_ERROR_FORMAT, "lacks a header line: dimension, type, sizes and encoding are needed");
    }
    return FM_OK;
}

static bool type_of(int teem_type, fm_type *type) {
    switch (teem_type) {
    case nrrdTypeChar:
        *type = FM_TYPE_I8;
        return true;
    case nrrdTypeUChar:
        *type = FM_TYPE_U8;
        return true;
    case nrrdTypeShort:
        *type = FM_TYPE_I16;
        return true;
    case nrrdTypeUShort:
        *type = FM_TYPE_U16;
        return true;
    case nrrdTypeInt:
        *type = FM_TYPE_I32;
        return true;
    case nrrdTypeUInt:
        *type = FM_TYPE_U32;
        return true;
    case nrrdTypeLLong:
        *type = FM_TYPE_I64;
        return true;
    case nrrdTypeULLong:
        *type = FM_TYPE_U64;
        return true;
    case nrrdTypeFloat:
        *type = FM_TYPE_F32;
        return true;
    case nrrdTypeDouble:
        *type = FM_TYPE_F64;
        return true;
    default:
        return false;
    }
}

// Spacing and origin from either way of giving them. `kept` lists the axes that became x, y and z.
static void place(fm_reader *reader, const Nrrd *nrrd, const uint32_t kept[3]) {
    bool straight = true;
    for (uint32_t i = 0; i < 3; i++) {
        if (kept[i] >= nrrd->dim) {
            continue;
        }
        const NrrdAxisInfo *axis = &nrrd->axis[kept[i]];
        double step = fabs(axis->spacing);
        if (nrrd->spaceDim > 0) {
            double sum = 0;
            for (unsigned k = 0; k < nrrd->spaceDim && k < NRRD_SPACE_DIM_MAX; k++) {
                sum += axis->spaceDirection[k] * axis->spaceDirection[k];
                straight = straight && (k == i ? axis->spaceDirection[k] > 0 : axis->spaceDirection[k] == 0);
            }
            step = sqrt(sum);
        }
        // Not a number: not given.
        const bool given = isfinite(step) && step > 0;
        reader->info.spacing[i] = given ? step : 1;
        reader->info.has_spacing = reader->info.has_spacing || given;
        if (i < nrrd->spaceDim && isfinite(nrrd->spaceOrigin[i])) {
            reader->info.origin[i] = nrrd->spaceOrigin[i];
        }
    }
    if (!straight) {
        fm_reader_note(reader, "orientation set aside: the axes are those of the voxels");
    }
}

static fm_result take_array(fm_reader *reader, const Nrrd *nrrd, const NrrdIoState *state) {
    uint64_t axes[MAX_AXES];
    uint32_t kept[3];
    for (unsigned i = 0; i < nrrd->dim; i++) {
        axes[i] = nrrd->axis[i].size;
    }
    fm_dense *dense = &reader->dense;
    if (!type_of(nrrd->type, &dense->type)) {
        return fm_input_fail(reader->input, FM_ERROR_UNSUPPORTED,
                             "has elements of a type that is not read: integers of 1 to 8 bytes, float and "
                             "double are");
    }
    FM_TRY(fm_reader_shape(reader, axes, nrrd->dim, kept));
    place(reader, nrrd, kept);
    reader->info.big_endian = fm_type_size(dense->type) > 1 && state->endian == airEndianBig;
    dense->swap = fm_type_size(dense->type) > 1 && reader->info.big_endian != fm_machine_is_big_endian();
    return FM_OK;
}

static fm_result run_teem(fm_reader *reader, const char *text) {
    Nrrd *nrrd = nrrdNew();
    NrrdIoState *state = nrrdIoStateNew();
    fm_result result = FM_OK;
    if (!nrrd || !state) {
        result = fm_fail(FM_ERROR_OUT_OF_HOST_MEMORY, "%s: out of memory for its header", fm_input_name(reader->input));
    } else if (nrrdIoStateSet(state, nrrdIoStateSkipData, AIR_TRUE) || nrrdStringRead(nrrd, text, state)) {
        char *message = biffGetDone(NRRD);
        // teem's message has a line for each function it passed through; the last one is the cause.
        char *last = message ? message + strlen(message) : NULL;
        while (last && last > message && last[-1] == '\n') {
            *--last = 0;
        }
        last = message ? strrchr(message, '\n') : NULL;
        result = fm_input_fail(reader->input, FM_ERROR_FORMAT, "has a header that teem refuses: %s",
                               last      ? last + 1
                               : message ? message
                                         : "no reason given");
        free(message);
    } else {
        result = take_array(reader, nrrd, state);
    }
    if (state) {
        nrrdIoStateNix(state);
    }
    if (nrrd) {
        nrrdNuke(nrrd);
    }
    return result;
}

static fm_result open_data_file(fm_reader *reader, const nrrd_header *header) {
    const char *name = header->data_file;
    if (strncasecmp(name, "LIST", 4) == 0 || strchr(name, '%')) {
        return fm_input_fail(reader->input, FM_ERROR_UNSUPPORTED,
                             "spreads its elements over several files: join them with teem's `unu save`");
    }
    if (!reader->path) {
        return fm_input_fail(reader->input, FM_ERROR_UNSUPPORTED,
                             "names a data file, but it came through a pipe: name the header's file");
    }
    const char *slash = strrchr(reader->path, '/');
    size_t directory = slash && name[0] != '/' ? (size_t)(slash - reader->path) + 1 : 0;
    uint64_t size;
    char *path = fm_name_with_suffix(reader->allocator, reader->path, strlen(reader->path) - directory, name, &size);
    if (!path) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    fm_input *input = NULL;
    struct stat status;
    fm_result result = FM_OK;
    if (stat(path, &status) == 0 && !S_ISREG(status.st_mode)) {
        result = fm_input_fail(reader->input, FM_ERROR_FORMAT, "names the data file \"%s\", which is no regular file", name);
    } else {
        result = fm_input_open_plain(reader->allocator, path, &input);
    }
    fm_free(reader->allocator, path, size);
    FM_TRY(result);
    reader->input = input;
    return FM_OK;
}

static fm_result seek_elements(fm_reader *reader, const nrrd_header *header) {
    for (uint64_t i = 0; i < header->line_skip; i++) {
        FM_TRY(fm_input_skip_line(reader->input));
    }
    uint64_t bytes;
    if (fm_array_bytes(reader->info.shape, reader->dense.type, &bytes) != FM_OK) {
        return fm_fail_prefix(FM_ERROR_FORMAT, fm_input_name(reader->input));
    }
    if (header->gzip) {
        if (header->byte_skip < 0) {
            return fm_input_fail(reader->input, FM_ERROR_UNSUPPORTED,
                                 "has a byte skip of -1 with the encoding gzip: only raw can have that");
        }
        FM_TRY(fm_input_begin_gzip(reader->input));
    }
    uint64_t skip = (uint64_t)header->byte_skip;
    if (header->byte_skip < 0) {
        // The elements are the last bytes of the file.
        if (fm_input_is_gzip(reader->input) || fm_input_file_size(reader->input) == UINT64_MAX) {
            return fm_input_fail(reader->input, FM_ERROR_UNSUPPORTED, "has a byte skip of -1: that needs a plain file");
        }
        FM_TRY(fm_dense_require(reader));
        skip = fm_input_bound(reader->input) - bytes;
    }
    FM_TRY(fm_input_skip(reader->input, skip, "the bytes before its elements"));
    return fm_dense_require(reader);
}

static fm_result parse(fm_reader *reader, nrrd_header *header) {
    FM_TRY(read_lines(reader, header));
    if (header->gzip && !header->data_file[0] && fm_input_is_gzip(reader->input)) {
        return fm_input_fail(reader->input, FM_ERROR_UNSUPPORTED, "is compressed twice: gunzip it once");
    }
    pthread_mutex_lock(&teem_lock);
    fm_result result = run_teem(reader, header->teem);
    pthread_mutex_unlock(&teem_lock);
    FM_TRY(result);
    if (header->data_file[0]) {
        FM_TRY(open_data_file(reader, header));
    }
    return seek_elements(reader, header);
}

static fm_result nrrd_open(fm_reader *reader) {
    nrrd_header *header = fm_alloc_zero(reader->allocator, sizeof *header, "a header");
    if (!header) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    fm_result result = parse(reader, header);
    fm_free(reader->allocator, header, sizeof *header);
    return result;
}

static const char *type_name(fm_type type) {
    switch (type) {
    case FM_TYPE_BITS:
    case FM_TYPE_U8:
        return "uint8";
    case FM_TYPE_F32:
        return "float";
    case FM_TYPE_F64:
        return "double";
    default:
        return fm_type_name(type);
    }
}

static fm_result write_header(fm_writer *writer, const char *encoding, const char *data_file) {
    const fm_volume_desc *desc = &writer->volume->desc;
    const double *s = desc->spacing, *o = desc->origin;
    FM_TRY(fm_writer_text(
        writer->output,
        "NRRD0004\ntype: %s\ndimension: 3\nspace dimension: 3\nsizes: %u %u %u\n"
        "space directions: (%.17g,0,0) (0,%.17g,0) (0,0,%.17g)\nspace origin: (%.17g,%.17g,%.17g)\nencoding: %s\n",
        type_name(desc->type), desc->shape.x, desc->shape.y, desc->shape.z, s[0], s[1], s[2], o[0], o[1], o[2], encoding));
    if (fm_type_size(fm_writer_type(writer)) > 1) {
        FM_TRY(fm_writer_text(writer->output, "endian: %s\n", fm_machine_is_big_endian() ? "big" : "little"));
    }
    return data_file ? fm_writer_text(writer->output, "data file: %s\n", data_file) : fm_writer_text(writer->output, "\n");
}

static fm_result write_attached(fm_writer *writer) {
    // A name that ends in .gz asks for the whole file to be compressed.
    bool whole = fm_name_ends(writer->path, ".gz");
    bool inside = writer->gzip && !whole;
    FM_TRY(fm_writer_open(writer, whole));
    FM_TRY(write_header(writer, inside ? "gzip" : "raw", NULL));
    if (inside) {
        FM_TRY(fm_output_begin_gzip(writer->output));
    }
    return fm_writer_elements(writer, writer->output, true);
}

static fm_result write_detached(fm_writer *writer) {
    uint64_t size;
    char *data_path =
        fm_name_with_suffix(writer->allocator, writer->path, strlen(".nhdr"), writer->gzip ? ".raw.gz" : ".raw", &size);
    if (!data_path) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    const char *slash = strrchr(data_path, '/');
    fm_result result = fm_writer_open(writer, false);
    if (result == FM_OK) {
        result = write_header(writer, writer->gzip ? "gzip" : "raw", slash ? slash + 1 : data_path);
    }
    if (result == FM_OK) {
        result = fm_output_open(writer->allocator, data_path, writer->gzip, &writer->second);
    }
    fm_free(writer->allocator, data_path, size);
    FM_TRY(result);
    return fm_writer_elements(writer, writer->second, true);
}

static fm_result nrrd_write(fm_writer *writer) {
    return fm_name_ends(writer->path, ".nhdr") ? write_detached(writer) : write_attached(writer);
}

static const char *const extensions[] = {".nrrd", ".nhdr", NULL};

const fm_codec fm_codec_nrrd = {
    .format = FM_FORMAT_NRRD,
    .name = "NRRD",
    .extensions = extensions,
    .matches = nrrd_matches,
    .open = nrrd_open,
    .load = fm_dense_load,
    .write = nrrd_write,
};
