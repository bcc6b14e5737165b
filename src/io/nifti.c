// SPDX-License-Identifier: MIT

// NIfTI-1 in a single file. Of niftilib only functions without state are used: what reads whole headers prints, by a level that the
// whole program shares. The elements are read here, in pieces.

#include "io/file.h"

#include <math.h>
#include <nifti1_io.h>
#include <stdio.h>
#include <string.h>

enum { HEADER = 348, FIRST_VOXEL = 352 };

static const struct {
    short code;
    fm_type type;
} types[] = {
    {DT_UINT8, FM_TYPE_U8},    {DT_UINT16, FM_TYPE_U16},  {DT_UINT32, FM_TYPE_U32}, {DT_UINT64, FM_TYPE_U64},
    {DT_INT8, FM_TYPE_I8},     {DT_INT16, FM_TYPE_I16},   {DT_INT32, FM_TYPE_I32},  {DT_INT64, FM_TYPE_I64},
    {DT_FLOAT32, FM_TYPE_F32}, {DT_FLOAT64, FM_TYPE_F64},
};
enum { TYPE_COUNT = sizeof types / sizeof types[0] };

static bool nifti_matches(const uint8_t *head, size_t size) {
    static const uint8_t little[4] = {0x5c, 1, 0, 0}, big[4] = {0, 0, 1, 0x5c};
    return size >= HEADER && (memcmp(head, little, 4) == 0 || memcmp(head, big, 4) == 0) &&
           (memcmp(head + 344, "n+1", 4) == 0 || memcmp(head + 344, "ni1", 4) == 0);
}

static fm_result read_header(fm_reader *reader, nifti_1_header *header) {
    FM_TRY(fm_input_read(reader->input, header, sizeof *header, "its header"));
    if (memcmp(header->magic, "n+1", 4) != 0) {
        return fm_input_fail(reader->input, FM_ERROR_UNSUPPORTED,
                             "is the header of a NIfTI pair: join it and its .img to one .nii file");
    }
    reader->dense.swap = header->sizeof_hdr != HEADER;
    if (reader->dense.swap) {
        swap_nifti_header(header, 1);
    }
    reader->info.big_endian = reader->dense.swap != fm_machine_is_big_endian();
    if (header->dim[0] < 1 || header->dim[0] > 7) {
        return fm_input_fail(reader->input, FM_ERROR_FORMAT, "claims %d axes: 1 to 7 are possible", header->dim[0]);
    }
    for (int i = 1; i <= header->dim[0]; i++) {
        if (header->dim[i] < 1) {
            return fm_input_fail(reader->input, FM_ERROR_FORMAT, "claims an axis of %d voxels", header->dim[i]);
        }
    }
    if (!(header->vox_offset >= FIRST_VOXEL && header->vox_offset <= (float)(1 << 30))) {
        return fm_input_fail(reader->input, FM_ERROR_FORMAT, "claims that its elements begin at byte %g: at least %d is possible",
                             (double)header->vox_offset, FIRST_VOXEL);
    }
    return FM_OK;
}

// What the file does not use is often not set.
static void mend_header(nifti_1_header *header) {
    for (int i = 1; i < 8; i++) {
        float step = fabsf(header->pixdim[i]);
        header->pixdim[i] = isfinite(step) && step > 0 ? step : 1;
        if (i > header->dim[0]) {
            header->dim[i] = 1;
        }
    }
}

static bool all_finite(const float *values, int count) {
    for (int i = 0; i < count; i++) {
        if (!isfinite(values[i])) {
            return false;
        }
    }
    return true;
}

static fm_result place(fm_reader *reader, const nifti_1_header *header) {
    const float turn[6] = {header->quatern_b, header->quatern_c, header->quatern_d,
                           header->qoffset_x, header->qoffset_y, header->qoffset_z};
    const float *steps = header->pixdim + 1;
    bool by_matrix = header->sform_code > 0;
    bool oriented = by_matrix || header->qform_code > 0;
    bool finite = by_matrix ? all_finite(header->srow_x, 4) && all_finite(header->srow_y, 4) && all_finite(header->srow_z, 4)
                            : all_finite(turn, 6);
    if (oriented && !finite) {
        return fm_input_fail(reader->input, FM_ERROR_FORMAT, "has an orientation of numbers that are not finite");
    }
    mat44 matrix = {0};
    if (by_matrix) {
        memcpy(matrix.m[0], header->srow_x, sizeof matrix.m[0]);
        memcpy(matrix.m[1], header->srow_y, sizeof matrix.m[1]);
        memcpy(matrix.m[2], header->srow_z, sizeof matrix.m[2]);
    } else if (oriented) {
        matrix = nifti_quatern_to_mat44(turn[0], turn[1], turn[2], turn[3], turn[4], turn[5], steps[0], steps[1], steps[2],
                                        header->pixdim[0] < 0 ? -1.0f : 1.0f);
    }
    bool straight = true;
    reader->info.has_spacing = true;
    for (int i = 0; i < 3; i++) {
        reader->info.spacing[i] = (double)steps[i];
        reader->info.origin[i] = oriented ? (double)matrix.m[i][3] : 0;
        for (int k = 0; k < 3 && oriented; k++) {
            float wanted = i == k ? steps[i] : 0;
            straight = straight && fabsf(matrix.m[i][k] - wanted) <= 1e-4f * steps[k];
        }
    }
    if (!straight) {
        fm_reader_note(reader, "orientation set aside: the axes are those of the voxels");
    }
    return FM_OK;
}

static fm_result nifti_open(fm_reader *reader) {
    nifti_1_header header;
    FM_TRY(read_header(reader, &header));
    mend_header(&header);
    int row = 0;
    while (row < TYPE_COUNT && types[row].code != header.datatype) {
        row++;
    }
    if (row == TYPE_COUNT) {
        return fm_input_fail(reader->input, FM_ERROR_UNSUPPORTED,
                             "has elements of NIfTI type %d: integers of 1 to 8 bytes, float32 and float64 are read; convert it",
                             header.datatype);
    }
    fm_dense *dense = &reader->dense;
    dense->type = types[row].type;
    uint64_t axes[7];
    for (int i = 0; i < header.dim[0]; i++) {
        axes[i] = (uint64_t)header.dim[i + 1];
    }
    FM_TRY(fm_reader_shape(reader, axes, (uint32_t)header.dim[0], NULL));
    FM_TRY(place(reader, &header));
    bool scales = isfinite(header.scl_slope) && isfinite(header.scl_inter) && header.scl_slope != 0;
    dense->scaled = scales && (header.scl_slope != 1 || header.scl_inter != 0);
    if (dense->scaled) {
        dense->slope = (double)header.scl_slope;
        dense->intercept = (double)header.scl_inter;
        fm_reader_note(reader, "%s scaled by %g, plus %g", fm_type_name(dense->type), dense->slope, dense->intercept);
    }
    FM_TRY(fm_input_skip(reader->input, (uint64_t)header.vox_offset - HEADER, "its header"));
    return fm_dense_require(reader);
}

static fm_result nifti_write(fm_writer *writer) {
    const fm_volume_desc *desc = &writer->volume->desc;
    const uint32_t axes[3] = {desc->shape.x, desc->shape.y, desc->shape.z};
    nifti_1_header header = {.sizeof_hdr = HEADER, .regular = 'r', .vox_offset = FIRST_VOXEL, .scl_slope = 1, .magic = "n+1"};
    header.dim[0] = 3;
    header.pixdim[0] = 1;
    for (int i = 1; i < 8; i++) {
        header.dim[i] = 1;
        header.pixdim[i] = 1;
    }
    for (int i = 0; i < 3; i++) {
        if (axes[i] > INT16_MAX) {
            return fm_fail(FM_ERROR_UNSUPPORTED,
                           "%s: the shape is %u x %u x %u: NIfTI-1 holds at most 32767 along an axis; write .nrrd or .npy",
                           writer->path, axes[0], axes[1], axes[2]);
        }
        header.dim[i + 1] = (short)axes[i];
        header.pixdim[i + 1] = (float)desc->spacing[i];
    }
    fm_type type = fm_writer_type(writer);
    for (int i = 0; i < TYPE_COUNT; i++) {
        header.datatype = types[i].type == type ? types[i].code : header.datatype;
    }
    header.bitpix = (short)(8 * fm_type_size(type));
    header.qform_code = header.sform_code = NIFTI_XFORM_SCANNER_ANAT;
    header.qoffset_x = header.srow_x[3] = (float)desc->origin[0];
    header.qoffset_y = header.srow_y[3] = (float)desc->origin[1];
    header.qoffset_z = header.srow_z[3] = (float)desc->origin[2];
    header.srow_x[0] = header.pixdim[1];
    header.srow_y[1] = header.pixdim[2];
    header.srow_z[2] = header.pixdim[3];
    const uint8_t no_extension[FIRST_VOXEL - HEADER] = {0};
    FM_TRY(fm_writer_open(writer, writer->gzip));
    FM_TRY(fm_output_write(writer->output, &header, sizeof header));
    FM_TRY(fm_output_write(writer->output, no_extension, sizeof no_extension));
    return fm_writer_elements(writer, writer->output, true);
}

static const char *const extensions[] = {".nii", NULL};

const fm_codec fm_codec_nifti = {
    .format = FM_FORMAT_NIFTI,
    .name = "NIfTI",
    .extensions = extensions,
    .matches = nifti_matches,
    .open = nifti_open,
    .load = fm_dense_load,
    .write = nifti_write,
};
