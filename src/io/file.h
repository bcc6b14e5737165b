// SPDX-License-Identifier: MIT
#ifndef FM_FILE_H
#define FM_FILE_H

// What the formats have in common: a table row each, a reader, a writer, and the dense arrays that most of them wrap.

#include "fathom/io.h"
#include "io/stream.h"
#include "volume/volume.h"

#include <locale.h>
#include <stdarg.h>

// An array of elements as it lies in a file, x fastest unless `fortran_order`.
typedef struct fm_dense {
    fm_type type;
    bool swap;           // not in the machine's byte order
    bool fortran_order;  // z fastest, then y, then x
    bool scaled;         // value = stored * slope + intercept, into F32
    double slope, intercept;
} fm_dense;

// One file being read. `open` of a codec fills in `info`, `load` the volume made from it.
typedef struct fm_reader {
    const fm_allocator *allocator;
    const char *path;
    const fm_read_desc *desc;  // never NULL
    fm_input *input;
    fm_file_info info;
    uint64_t default_limit;  // for `max_bytes` 0; 0: none
    fm_dense dense;
    bool has_palette;
    uint8_t palette[1024];
    void *state;  // of the codec
    uint64_t state_bytes;
} fm_reader;

// One file being written.
typedef struct fm_writer {
    const fm_allocator *allocator;
    const char *path;
    const fm_write_desc *desc;  // never NULL
    const fm_volume *volume;
    const void *data;  // the volume's elements, in host memory
    bool gzip;
    fm_output *output;
    fm_output *second;  // sidecar or data file; NULL: none
} fm_writer;

typedef struct fm_codec {
    fm_format format;
    const char *name;
    const char *const *extensions;  // with the dot, lower case; ends with NULL
    bool no_magic;                  // any bytes may be a file of this format
    bool (*matches)(const uint8_t *head, size_t size);
    // Parses the header and fills `info` but for format, file_bytes, bytes and compressed. Leaves the input at the first element,
    // or keeps what it needs in `state`.
    fm_result (*open)(fm_reader *reader);  // NULL: only written
    fm_result (*load)(fm_reader *reader, fm_volume *volume);
    void (*close)(fm_reader *reader);  // frees what `state` points to; NULL: nothing to do
    fm_result (*write)(fm_writer *writer);
} fm_codec;

extern const fm_codec fm_codec_npy;
extern const fm_codec fm_codec_raw;
extern const fm_codec fm_codec_nrrd;
extern const fm_codec fm_codec_nifti;
extern const fm_codec fm_codec_vox;
extern const fm_codec fm_codec_binvox;
extern const fm_codec fm_codec_octomap;
extern const fm_codec fm_codec_voxelmap;
extern const fm_codec fm_codec_vxl;
extern const fm_codec fm_codec_nanovdb;

// Reads from an input that is open already and stays the caller's; `path` is for formats that look beside the file, NULL where
// there is nothing beside.
fm_result fm_file_read_input(fm_context *context, fm_input *input, const char *path, const fm_read_desc *desc, fm_volume **volume,
                             fm_file_info *info);

// Whether `name` ends in `suffix`, whatever the case.
bool fm_name_ends(const char *name, const char *suffix);
// `name` less its last `cut` bytes and with `suffix` put on, of `*size` bytes from the allocator.
char *fm_name_with_suffix(const fm_allocator *allocator, const char *name, size_t cut, const char *suffix, uint64_t *size);

enum { FM_NOTE_SIZE = 256 };

// Appends a clause to a note.
void fm_note_append(char note[FM_NOTE_SIZE], const char *format, va_list arguments) FM_PRINTF(2, 0);
// Appends to `info.note`.
void fm_reader_note(fm_reader *reader, const char *format, ...) FM_PRINTF(2, 3);
// Memory of the codec's own, freed with the reader.
void *fm_reader_state(fm_reader *reader, uint64_t bytes);

// Shape from axes in file order, fastest first. Where there are more than three, axes of 1 are dropped, the slowest first. `kept`
// (NULL allowed) gets which axes became x, y and z; `count` or more for those that are not in the file.
fm_result fm_reader_shape(fm_reader *reader, const uint64_t *axes, uint32_t count, uint32_t kept[3]);
// Finishes the description of a dense file: `bytes`, and whether the file can hold them.
fm_result fm_dense_require(fm_reader *reader);
// `load` of the dense formats: reads in pieces, swaps, transposes and scales.
fm_result fm_dense_load(fm_reader *reader, fm_volume *volume);

// Tells the progress; false: cancelled, with the message set.
bool fm_reader_progress(const fm_reader *reader, uint64_t done, uint64_t total);
bool fm_writer_progress(const fm_writer *writer, uint64_t done, uint64_t total);

// The type that `dense` formats write a volume as: its own, but U8 for BITS.
fm_type fm_writer_type(const fm_writer *writer);
// Opens `writer->output` on its path.
fm_result fm_writer_open(fm_writer *writer, bool gzip);
fm_result fm_writer_text(fm_output *output, const char *format, ...) FM_PRINTF(2, 3);
// All elements, in the machine's byte order; `unpack` writes a byte for each bit.
fm_result fm_writer_elements(fm_writer *writer, fm_output *output, bool unpack);

// Numbers in files have a decimal point, whatever the program's locale. Returns what to give to fm_locale_restore.
locale_t fm_locale_plain(void);
void fm_locale_restore(locale_t before);

// Bit `x` of a row of FM_TYPE_BITS.
static inline bool fm_bit(const uint32_t *row, uint32_t x) {
    return row[x / 32] >> (x % 32) & 1;
}

// Reverses the bytes of each of `count` elements.
void fm_swap_elements(void *data, uint64_t count, size_t size);

static inline bool fm_machine_is_big_endian(void) {
    const uint16_t one = 1;
    return *(const uint8_t *)&one == 0;
}

static inline uint32_t fm_load_u32(const uint8_t *bytes) {
    return bytes[0] | (uint32_t)bytes[1] << 8 | (uint32_t)bytes[2] << 16 | (uint32_t)bytes[3] << 24;
}

static inline void fm_store_u32(uint8_t *bytes, uint32_t value) {
    for (int i = 0; i < 4; i++) {
        bytes[i] = (uint8_t)(value >> 8 * i);
    }
}

#endif
