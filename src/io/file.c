// SPDX-License-Identifier: MIT
#include "io/file.h"

#include <locale.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>

static const fm_codec *const codecs[] = {
    &fm_codec_npy,    &fm_codec_raw,     &fm_codec_nrrd,     &fm_codec_nifti, &fm_codec_vox,
    &fm_codec_binvox, &fm_codec_octomap, &fm_codec_voxelmap, &fm_codec_vxl,   &fm_codec_nanovdb,
};
enum { CODEC_COUNT = sizeof codecs / sizeof codecs[0] };

static const fm_codec *codec_of(fm_format format) {
    for (int i = 0; i < CODEC_COUNT; i++) {
        if (codecs[i]->format == format) {
            return codecs[i];
        }
    }
    return NULL;
}

const char *fm_format_name(fm_format format) {
    const fm_codec *codec = codec_of(format);
    return codec ? codec->name : format == FM_FORMAT_AUTO ? "auto" : "unknown format";
}

bool fm_name_ends(const char *name, const char *suffix) {
    size_t length = strlen(name), tail = strlen(suffix);
    return length >= tail && strcasecmp(name + length - tail, suffix) == 0;
}

char *fm_name_with_suffix(const fm_allocator *allocator, const char *name, size_t cut, const char *suffix, uint64_t *size) {
    size_t length = strlen(name) - cut;
    *size = length + strlen(suffix) + 1;
    char *result = fm_alloc(allocator, *size, "a file's name");
    if (result) {
        memcpy(result, name, length);
        strcpy(result + length, suffix);
    }
    return result;
}

// By the name, a .gz at its end aside.
static const fm_codec *codec_by_name(const char *name) {
    size_t length = strlen(name) - (fm_name_ends(name, ".gz") ? 3 : 0);
    for (int i = 0; i < CODEC_COUNT; i++) {
        for (const char *const *extension = codecs[i]->extensions; *extension; extension++) {
            size_t tail = strlen(*extension);
            if (length > tail && strncasecmp(name + length - tail, *extension, tail) == 0) {
                return codecs[i];
            }
        }
    }
    return NULL;
}

void fm_note_append(char note[FM_NOTE_SIZE], const char *format, va_list arguments) {
    size_t used = strlen(note);
    if (used > 0 && used + 2 < FM_NOTE_SIZE) {
        memcpy(note + used, "; ", 3);
        used += 2;
    }
    vsnprintf(note + used, FM_NOTE_SIZE - used, format, arguments);
}

void fm_reader_note(fm_reader *reader, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    fm_note_append(reader->info.note, format, arguments);
    va_end(arguments);
}

void *fm_reader_state(fm_reader *reader, uint64_t bytes) {
    reader->state = fm_alloc_zero(reader->allocator, bytes, "a file's contents");
    reader->state_bytes = reader->state ? bytes : 0;
    return reader->state;
}

// ---------------------------------------------------------------------------------------------------------------------------
// Reading
// ---------------------------------------------------------------------------------------------------------------------------

// Formats that people take for one of ours.
static fm_result refuse_known(const fm_input *input, const uint8_t *head, size_t size) {
    static const struct {
        const char *magic;
        size_t length;
        const char *what;
    } strangers[] = {
        {"PK\3\4", 4, "a zip archive (.npz?): unpack it and name a file from it"},
        {"\x89PNG", 4, "a PNG picture: volumes are read"},
        {"\x89HDF", 4, "an HDF5 file: convert the data set to .npy"},
        {"BZh", 3, "compressed by bzip2: decompress it first"},
        {"\xfd"
         "7zXZ",
         5, "compressed by xz: decompress it first"},
        {"\x28\xb5\x2f\xfd", 4, "compressed by zstd: decompress it first"},
        {"# vtk DataFile", 14, "a VTK file: convert it to .nrrd"},
        {"\x1c\2\0\0", 4, "a NIfTI-2 file: convert it to NIfTI-1"},
        {"\0\0\2\x1c", 4, "a NIfTI-2 file: convert it to NIfTI-1"},
        {"II*", 4, "a TIFF file: convert it to .npy"},
        {"MM\0*", 4, "a TIFF file: convert it to .npy"},
    };
    for (size_t i = 0; i < sizeof strangers / sizeof strangers[0]; i++) {
        if (size >= strangers[i].length && memcmp(head, strangers[i].magic, strangers[i].length) == 0) {
            return fm_input_fail(input, FM_ERROR_UNSUPPORTED, "is %s", strangers[i].what);
        }
    }
    return FM_OK;
}

static fm_result choose_codec(fm_reader *reader, const fm_codec **chosen) {
    const uint8_t *head;
    size_t size;
    fm_format format = reader->desc->format;
    // A pipe may deliver a small array and then stay open, so no more is asked for than the shortest array has.
    FM_TRY(fm_input_peek(reader->input, format == FM_FORMAT_NPY ? 8 : 512, &head, &size));
    if (format != FM_FORMAT_AUTO) {
        *chosen = codec_of(format);
        if (!*chosen) {
            return fm_fail(FM_ERROR_INVALID_ARGUMENT, "format is %d: not an fm_format", (int)format);
        }
    } else if (reader->desc->shape.x || reader->desc->shape.y || reader->desc->shape.z) {
        *chosen = &fm_codec_raw;
    } else {
        *chosen = NULL;
        for (int i = 0; i < CODEC_COUNT && !*chosen; i++) {
            *chosen = codecs[i]->matches(head, size) ? codecs[i] : NULL;
        }
        const fm_codec *named = reader->path ? codec_by_name(reader->path) : NULL;
        if (!*chosen && !(named && named->no_magic)) {
            FM_TRY(refuse_known(reader->input, head, size));
        }
        *chosen = *chosen ? *chosen : named;
        if (!*chosen) {
            return fm_input_fail(
                reader->input, FM_ERROR_FORMAT,
                size == 0 ? "is empty"
                          : "is of no known format: .npy, .nrrd, .nii, .vox, .binvox, .bt, .3dmap, .vxl and raw are read; "
                            "for a raw file give the shape");
        }
    }
    if (!(*chosen)->no_magic && !(*chosen)->matches(head, size)) {
        return fm_input_fail(reader->input, FM_ERROR_FORMAT, "is no %s file: it does not begin as one", (*chosen)->name);
    }
    return FM_OK;
}

// A header may claim anything: what a volume would refuse is the file's fault here.
static fm_result check_place(const fm_reader *reader) {
    const fm_file_info *info = &reader->info;
    for (int i = 0; i < 3; i++) {
        if (!isfinite(info->origin[i]) || !isfinite(info->spacing[i]) || info->spacing[i] <= 0) {
            return fm_input_fail(reader->input, FM_ERROR_FORMAT,
                                 "has spacing %g, %g, %g and origin %g, %g, %g: spacings must be above 0 and all numbers finite",
                                 info->spacing[0], info->spacing[1], info->spacing[2], info->origin[0], info->origin[1],
                                 info->origin[2]);
        }
    }
    return FM_OK;
}

static fm_result open_reader(fm_reader *reader, const fm_codec **codec) {
    FM_TRY(choose_codec(reader, codec));
    if (!(*codec)->open) {
        return fm_input_fail(reader->input, FM_ERROR_UNSUPPORTED, "%s files are only written: convert it to .npy or .nrrd",
                             (*codec)->name);
    }
    fm_file_info *info = &reader->info;
    info->format = (*codec)->format;
    info->compressed = fm_input_is_gzip(reader->input);
    for (int i = 0; i < 3; i++) {
        info->spacing[i] = 1;
    }
    FM_TRY((*codec)->open(reader));
    FM_TRY(check_place(reader));
    uint64_t file_size = fm_input_file_size(reader->input);
    info->file_bytes = file_size == UINT64_MAX ? 0 : file_size;
    info->compressed = info->compressed || fm_input_is_gzip(reader->input);
    if (fm_array_bytes(info->shape, info->type, &info->bytes) != FM_OK) {
        return fm_fail_prefix(FM_ERROR_RANGE, fm_input_name(reader->input));
    }
    uint64_t limit = reader->desc->max_bytes ? reader->desc->max_bytes : reader->default_limit;
    if (limit && info->bytes > limit) {
        return fm_input_fail(reader->input, FM_ERROR_RANGE,
                             "makes a grid of %u x %u x %u, %llu bytes: over the limit of %llu; raise max_bytes if that is meant",
                             info->shape.x, info->shape.y, info->shape.z, (unsigned long long)info->bytes,
                             (unsigned long long)limit);
    }
    return FM_OK;
}

static fm_result load_volume(fm_reader *reader, const fm_codec *codec, fm_context *context, fm_volume **volume) {
    fm_volume_desc desc = {.shape = reader->info.shape, .type = reader->info.type, .storage = FM_STORAGE_HOST};
    memcpy(desc.spacing, reader->info.spacing, sizeof desc.spacing);
    memcpy(desc.origin, reader->info.origin, sizeof desc.origin);
    fm_volume *loaded = NULL;
    fm_result result = fm_volume_create(context, &desc, &loaded);
    if (result != FM_OK) {
        return fm_fail_prefix(result, fm_input_name(reader->input));
    }
    result = codec->load(reader, loaded);
    // A pipe may stay open behind the last element.
    if (result == FM_OK && fm_input_file_size(reader->input) != UINT64_MAX) {
        result = fm_input_expect_end(reader->input);
    }
    if (result == FM_OK && reader->has_palette) {
        result = fm_volume_set_palette(loaded, reader->palette);
    }
    if (result != FM_OK) {
        fm_volume_destroy(loaded);
        return result;
    }
    *volume = loaded;
    return FM_OK;
}

// `input` stays the caller's unless the codec has replaced it. `volume` NULL: only `info` is wanted.
static fm_result run_reader(fm_reader *reader, fm_context *context, fm_volume **volume, fm_file_info *info) {
    const fm_codec *codec = NULL;
    fm_result result = open_reader(reader, &codec);
    if (result == FM_OK && volume) {
        result = load_volume(reader, codec, context, volume);
    }
    if (codec && codec->close && reader->state) {
        codec->close(reader);
    }
    fm_free(reader->allocator, reader->state, reader->state_bytes);
    if (result == FM_OK && info) {
        *info = reader->info;
    }
    return result;
}

static const fm_allocator *allocator_of(const fm_context *context) {
    return context ? &context->allocator : &fm_default_allocator;
}

static const fm_read_desc read_defaults;

locale_t fm_locale_plain(void) {
    // glibc's C locale is static: this does not fail.
    locale_t plain = newlocale(LC_ALL_MASK, "C", (locale_t)0);
    return plain ? uselocale(plain) : (locale_t)0;
}

void fm_locale_restore(locale_t before) {
    locale_t plain = before ? uselocale(before) : (locale_t)0;
    if (plain) {
        freelocale(plain);
    }
}

fm_result fm_file_read_input(fm_context *context, fm_input *input, const char *path, const fm_read_desc *desc, fm_volume **volume,
                             fm_file_info *info) {
    fm_reader reader = {.allocator = allocator_of(context), .path = path, .desc = desc ? desc : &read_defaults, .input = input};
    fm_result result = run_reader(&reader, context, volume, info);
    if (reader.input != input) {
        fm_input_close(reader.input);
    }
    return result;
}

static fm_result read_path(fm_context *context, const char *path, const fm_read_desc *desc, fm_volume **volume,
                           fm_file_info *info) {
    fm_input *input = NULL;
    FM_TRY(fm_input_open(allocator_of(context), path, &input));
    fm_read_desc standard = desc ? *desc : read_defaults;
    bool piped = strcmp(path, "-") == 0;
    if (piped && standard.format == FM_FORMAT_AUTO) {
        standard.format = FM_FORMAT_NPY;
    }
    locale_t before = fm_locale_plain();
    fm_result result = fm_file_read_input(context, input, piped ? NULL : path, &standard, volume, info);
    fm_locale_restore(before);
    fm_input_close(input);
    return result;
}

fm_result fm_file_probe(const char *path, const fm_read_desc *desc, fm_file_info *info) {
    if (!path || !info) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "%s is NULL", path ? "info" : "path");
    }
    if (strcmp(path, "-") == 0) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "path is \"-\": standard input can be read only once; name a file");
    }
    return read_path(NULL, path, desc, NULL, info);
}

fm_result fm_file_read(fm_context *context, const char *path, const fm_read_desc *desc, fm_volume **volume, fm_file_info *info) {
    if (!path || !volume) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "%s is NULL", path ? "volume" : "path");
    }
    return read_path(context, path, desc, volume, info);
}

// ---------------------------------------------------------------------------------------------------------------------------
// Writing
// ---------------------------------------------------------------------------------------------------------------------------

static fm_result choose_writer(const char *path, const fm_write_desc *desc, const fm_codec **codec) {
    *codec = desc->format == FM_FORMAT_AUTO ? codec_by_name(path) : codec_of(desc->format);
    if (!*codec && desc->format != FM_FORMAT_AUTO) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "format is %d: not an fm_format", (int)desc->format);
    }
    if (!*codec && (strcmp(path, "-") == 0 || strncmp(path, "/dev/", 5) == 0)) {
        *codec = &fm_codec_npy;
    }
    if (!*codec) {
        return fm_fail(
            FM_ERROR_INVALID_ARGUMENT,
            "%s: the name does not say the format: end it in .npy, .raw, .nrrd, .nhdr, .nii, .vox or .nvdb, with or without .gz",
            path);
    }
    if (!(*codec)->write) {
        return fm_fail(FM_ERROR_UNSUPPORTED, "%s: %s files are only read: write .npy, .raw, .nrrd, .nii or .vox", path,
                       (*codec)->name);
    }
    return FM_OK;
}

// The second file goes first: a header must not come before what it describes.
static fm_result complete(fm_writer *writer, fm_file_batch *batch) {
    fm_output *outputs[] = {writer->second, writer->output};
    writer->output = writer->second = NULL;
    fm_result result = fm_batch_add(batch, outputs[0]);
    if (result != FM_OK) {
        fm_output_destroy(outputs[1]);
        return result;
    }
    return fm_batch_add(batch, outputs[1]);
}

fm_result fm_file_write(const char *path, const fm_volume *volume, const fm_write_desc *desc) {
    static const fm_write_desc defaults;
    if (!path || !volume) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "%s is NULL", path ? "volume" : "path");
    }
    desc = desc ? desc : &defaults;
    const fm_codec *codec;
    FM_TRY(choose_writer(path, desc, &codec));
    fm_file_batch own = {.allocator = volume->allocator};
    fm_file_batch *batch = desc->batch ? desc->batch : &own;
    fm_writer writer = {
        .allocator = &batch->allocator,
        .path = path,
        .desc = desc,
        .volume = volume,
        .data = volume->data,
        .gzip = desc->compress || fm_name_ends(path, ".gz"),
    };
    void *copy = NULL;
    if (!volume->data) {
        copy = fm_alloc(writer.allocator, volume->bytes, "a copy of a device volume");
        if (!copy) {
            return FM_ERROR_OUT_OF_HOST_MEMORY;
        }
        writer.data = copy;
    }
    // Downloading does not change a volume, but its type does not say so.
    fm_result result = copy ? fm_volume_download((fm_volume *)(uintptr_t)volume, copy) : FM_OK;
    if (result == FM_OK) {
        locale_t before = fm_locale_plain();
        result = codec->write(&writer);
        fm_locale_restore(before);
    }
    if (result == FM_OK) {
        result = complete(&writer, batch);
    }
    if (result == FM_OK && batch == &own) {
        result = fm_file_batch_commit(&own);
    }
    fm_batch_clear(&own);
    fm_output_destroy(writer.output);
    fm_output_destroy(writer.second);
    fm_free(writer.allocator, copy, volume->bytes);
    return result;
}
