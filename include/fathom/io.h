// SPDX-License-Identifier: MIT
#ifndef FATHOM_IO_H
#define FATHOM_IO_H

// Volumes and pictures in files. The conventions of fathom.h hold.
//
// Messages of failed calls begin with the file's name and end with what to do about it. A file that is not what it claims to be is
// FM_ERROR_FORMAT, a valid file of a kind that Fathom does not read is FM_ERROR_UNSUPPORTED, and what the operating system refused
// is FM_ERROR_IO.

#include "fathom/fathom.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef enum fm_format {
    FM_FORMAT_AUTO = 0,  // reading: by the first bytes, then by the name; writing: by the name
    FM_FORMAT_NPY,       // NumPy .npy: read and write
    FM_FORMAT_RAW,       // bare elements, x fastest: read and write
    FM_FORMAT_NRRD,      // .nrrd, or .nhdr with a data file beside it; encodings raw and gzip: read and write
    FM_FORMAT_NIFTI,     // NIfTI-1 single files .nii: read and write
    FM_FORMAT_VOX,       // MagicaVoxel .vox: read and write
    FM_FORMAT_BINVOX,    // .binvox: read
    FM_FORMAT_OCTOMAP,   // OctoMap binary tree .bt: read
    FM_FORMAT_3DMAP,     // text map of the 3D voxel benchmarks for path finding, .3dmap: read
    FM_FORMAT_VXL,       // Ace of Spades map .vxl of 512 x 512 x 64, known by its name only: read
    FM_FORMAT_NANOVDB,   // NanoVDB grid .nvdb of the sparse band of a distance field: write
} fm_format;

// Name as people write it ("npy", "raw", "NRRD"). Never NULL. Thread-safe.
FM_API const char *fm_format_name(fm_format format);

// Told how much has been read or written, of how much: bytes of elements for the dense formats, something that rises as evenly for
// the sparse ones. Called on the calling thread at the start, after each piece of a few MiB and at the end. Returns false to cancel
// the call, which then fails with FM_ERROR_IO and the message "cancelled".
typedef bool (*fm_progress_fn)(void *user, uint64_t done, uint64_t total);

typedef struct fm_read_desc {
    fm_format format;

    // Layout of a raw file; all 0: from its sidecar NAME.txt (see fm_file_write), else from a name such as
    // anything_487x187x39_u8.raw.gz. Ignored by the formats that have a header.
    fm_shape shape;
    fm_type type;
    uint64_t offset;  // bytes before the first element (after decompression)
    bool big_endian;

    // .vox: place the nodes and layers that are marked hidden too.
    bool include_hidden;

    // A volume of more bytes than this is refused with FM_ERROR_RANGE before memory is taken for it. 0: 16 GiB for the sparse
    // formats (.vox, .binvox, .bt, .3dmap), whose files may be tiny beside the grid, and no limit for the others, whose size is
    // checked against the file's.
    uint64_t max_bytes;

    fm_progress_fn progress;  // NULL: nobody is told
    void *progress_user;
} fm_read_desc;

// What a file holds.
typedef struct fm_file_info {
    fm_format format;
    fm_shape shape;
    fm_type type;         // of the volume that fm_file_read makes
    double spacing[3];    // as in fm_volume_desc
    double origin[3];     // as in fm_volume_desc
    uint64_t file_bytes;  // of the file that holds the elements; 0 when it is a pipe
    uint64_t bytes;       // of the volume
    bool has_spacing;     // the file tells its spacing; where it does not, that is 1, 1, 1
    bool compressed;
    bool big_endian;
    bool fortran_order;      // .npy
    uint32_t models;         // .vox: models in the file
    uint32_t placed;         // .vox: models placed in the scene, hidden ones only with `include_hidden`
    uint32_t rotated;        // .vox: of these, how many are not in the orientation they were drawn in
    uint32_t hidden;         // .vox: placed models that are hidden
    uint32_t palette_count;  // .vox: colours of the palette, 256; else 0
    char note[256];          // what was set aside or reinterpreted, in words; empty when nothing was
} fm_file_info;

// Describes a file from its header, without reading the elements of the dense formats (the sparse ones are read whole, but no grid
// is made). "-" is not accepted: a pipe can be read only once. `desc` may be NULL. Thread-safe.
FM_API fm_result fm_file_probe(const char *path, const fm_read_desc *desc, fm_file_info *info);

// Reads a file into a new volume in host memory, with its spacing, origin and palette. `path` "-" reads .npy from standard input.
// Any format may be gzipped as a whole. `context` (NULL allowed) owns the volume as in fm_volume_create; `desc` and `info` (which
// gets what fm_file_probe tells) may be NULL.
//
// Elements keep their type and value. Exceptions: NumPy and NRRD booleans become U8; NIfTI files with a scale other than
// identity become F32; .vox becomes U8 colour indices, 0 empty, with the palette; .binvox, .3dmap and .vxl become U8, 0 or 1; .bt
// becomes U8, 0 unknown, 1 free, 2 occupied, so that FM_SELECT_THRESHOLD with 2 selects what is occupied. Arrays of fewer than
// three axes get leading axes of 1: (X) is a row, (Y, X) one slice. Axes of 1 beyond three are dropped. .vox scenes are placed by
// MagicaVoxel's rule: a model turns about its voxel size / 2, rounded down; where models overlap the one that is later in the scene
// stays. The volume covers the boxes of all placed models; its origin is the lowest corner's position. .bt volumes cover the known
// part of the tree.
//
// Errors: FM_ERROR_IO, FM_ERROR_FORMAT, FM_ERROR_UNSUPPORTED, FM_ERROR_RANGE (see `max_bytes`), FM_ERROR_OUT_OF_HOST_MEMORY,
// FM_ERROR_INVALID_ARGUMENT. Thread safety: as the context. Sources: NumPy NEP 1; teem.sourceforge.net/nrrd/format.html; nifti1.h;
// MagicaVoxel-file-format-vox.txt and -extension.txt; www.patrickmin.com/binvox; OctoMap's OcTreeBaseImpl.
FM_API fm_result fm_file_read(fm_context *context, const char *path, const fm_read_desc *desc, fm_volume **volume,
                              fm_file_info *info);

// Files that appear together or not at all: written one after the other under temporary names, then renamed by one call.
typedef struct fm_file_batch fm_file_batch;

// An empty batch. It takes its memory as `context` does, and must be destroyed before it; NULL allowed. A batch belongs to one
// thread at a time. Errors: FM_ERROR_OUT_OF_HOST_MEMORY, FM_ERROR_INVALID_ARGUMENT.
FM_API fm_result fm_file_batch_create(fm_context *context, fm_file_batch **batch);

// Renames all files of the batch and leaves it empty, ready for more. When one cannot be renamed, the temporary files are removed
// and those renamed before it are put back to what they were; where the file system cannot exchange two files (network ones
// mostly), what they replaced is lost. Signals are held back from the calling thread meanwhile. Error: FM_ERROR_IO.
FM_API fm_result fm_file_batch_commit(fm_file_batch *batch);

// Removes the temporary files of what has not been committed. NULL is fine.
FM_API void fm_file_batch_destroy(fm_file_batch *batch);

typedef struct fm_write_desc {
    fm_format format;  // AUTO: by the name, with or without .gz at its end; "-" and devices of other names get .npy
    bool compress;     // gzip; a name that ends in .gz asks for it too. Not for .vox
    // The file appears when this is committed. NULL: at the end of the call. What goes straight to a device, a pipe or standard
    // output is there at once in any case.
    fm_file_batch *batch;
    // .nvdb: voxels of a distance below this, in world units, are kept; the others become background of this distance and their
    // sign. 0: the greatest finite distance of the volume, which for a field of a band is the band's width.
    double band;
    fm_progress_fn progress;
    void *progress_user;
} fm_write_desc;

// Writes a volume, host or device. `desc` may be NULL; `path` "-" writes to standard output.
//
// The file is written under a temporary name in the same directory and renamed when it is complete, so that a call that fails
// leaves what was there before and nothing else. A name that exists and is not a regular file (a device, a pipe) is written
// directly. Raw files get a sidecar NAME.txt beside them, lines of a key and its values:
//     fathom raw 1
//     shape X Y Z
//     type uint8
//     byte_order little
//     offset 0
//     spacing SX SY SZ
//     origin OX OY OZ
// .nhdr is written with its data in NAME.raw or NAME.raw.gz. FM_TYPE_BITS is written as one byte a voxel, except to raw files.
// Spacing and origin are kept by NRRD, NIfTI (in 32-bit floats), raw with its sidecar and NanoVDB, the palette by .vox. NanoVDB
// files take F32 without NaN; they hold one grid "distance", a level set when any distance is negative, not compressed (`compress`
// gzips the whole file, which other programs do not expect), in the layout of version 32.
//
// Errors: FM_ERROR_IO, FM_ERROR_OUT_OF_HOST_MEMORY, FM_ERROR_UNSUPPORTED when the format cannot hold the volume (.vox takes U8 and
// BITS, NIfTI axes up to 32,767, NanoVDB F32) or is one that Fathom only reads. Thread safety: as the volume's context.
FM_API fm_result fm_file_write(const char *path, const fm_volume *volume, const fm_write_desc *desc);

// Removes the temporary files of all writes in flight in this process. Safe to call from a signal handler; the process is
// expected to end then, as the writes would fail at their end.
FM_API void fm_file_abort_all(void);

// ---------------------------------------------------------------------------------------------------------------------------
// Pictures
// ---------------------------------------------------------------------------------------------------------------------------

// Writes 8-bit pixels as a PNG file under the rules of fm_file_write. `channels` is 1 (grey), 3 (RGB) or 4 (RGBA); rows are
// `width` * `channels` bytes, top row first, without gaps. Thread-safe.
FM_API fm_result fm_image_write_png(const char *path, uint32_t width, uint32_t height, uint32_t channels, const uint8_t *pixels);

typedef enum fm_color_map {
    // The volume's palette if it has one; else, when the slice or `min` is below 0, diverging for floating point and grey for
    // integers, which are heights or measurements more often than signed distances; else sequential.
    FM_COLOR_AUTO = 0,
    FM_COLOR_SEQUENTIAL,  // dark violet over teal to pale yellow, lightness rising evenly
    FM_COLOR_DIVERGING,   // blue below 0, near white at 0, red above; the range is made symmetric about 0
    FM_COLOR_GREY,
    FM_COLOR_PALETTE,  // the volume's
    FM_COLOR_LABELS,   // black for 0, else one of 1,023 colours by a hash of the value, so that neighbours differ
} fm_color_map;

// The colour of `t` (clamped to 0..1) in a map other than AUTO and PALETTE, as sRGB. The maps but LABELS are curves in Oklab (B.
// Ottosson, "A perceptual color space for image processing", 2020) of evenly rising lightness. Thread-safe.
FM_API void fm_color_map_rgb(fm_color_map map, double t, uint8_t rgb[3]);

typedef struct fm_slice_desc {
    fm_color_map map;
    double min, max;       // values at the two ends of the map; both 0: the finite range of the slice
    bool mark_largest;     // the largest value of an integer type means "no solid voxel", as +infinity does in F32
    uint32_t scale;        // pixels along the edge of a voxel, 1 to 64; 0: 1
    bool flip;             // the other way up
    fm_file_batch *batch;  // as in fm_write_desc
} fm_slice_desc;

// What a slice shows.
typedef struct fm_slice_info {
    uint32_t width, height;  // in pixels
    fm_color_map map;        // what AUTO chose
    double min, max;         // values at the two ends of the map
    uint64_t no_site;        // voxels of no finite value, shown in mid grey (NaN in magenta)
} fm_slice_info;

// Writes the slice `index` across `axis` (0: x, 1: y, 2: z) as a PNG file. A slice across z shows x to the right and y downwards;
// across y, x to the right and z upwards; across x, y to the right and z upwards; the other way up where `flip` says so. `desc` and
// `info` may be NULL. Errors: as fm_file_write. Thread safety: as the volume's context.
FM_API fm_result fm_slice_png(const fm_volume *volume, uint32_t axis, uint32_t index, const fm_slice_desc *desc, const char *path,
                              fm_slice_info *info);

#ifdef __cplusplus
}
#endif

#endif
