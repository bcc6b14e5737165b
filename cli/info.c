// SPDX-License-Identifier: MIT
// fathom info: what a file holds.

#include "cli.h"
#include "commands.h"
#include "files.h"
#include "mesh_info.h"
#include "mesh_input.h"
#include "report.h"
#include "stats.h"

#include "fathom/mesh_io.h"

#include <inttypes.h>
#include <stdio.h>

// A value as the options take it, into `text`.
static const char *number(const fm_file_info *info, long double value, char text[64]) {
    const int digits = info->type == FM_TYPE_F32 ? 9 : info->type == FM_TYPE_F64 ? 17 : 0;
    snprintf(text, 64, digits ? "%.*Lg" : "%.*Lf", digits, value);
    return text;
}

static void print_stats(const fm_file_info *info, const stats *s) {
    char least[64], most[64];
    printf("    values    %s to %s", number(info, s->min, least), number(info, s->max, most));
    if (s->integer) {
        printf(s->more ? ", more than %" PRIu64 " different" : ", %" PRIu64 " different", s->distinct);
    }
    printf("\n    non-zero  %" PRIu64 " of %" PRIu64 " (%.1f %%)\n", s->nonzero, s->voxels,
           100 * (double)s->nonzero / (double)s->voxels);
    if (s->nan || s->infinite) {
        printf("    no number %" PRIu64 " NaN, %" PRIu64 " infinite\n", s->nan, s->infinite);
    }
    for (uint32_t i = 0; i < s->listed; i++) {
        printf("%s %s: %" PRIu64 " voxels\n", i == 0 ? "    commonest" : "             ", number(info, s->values[i].value, least),
               s->values[i].voxels);
    }
}

static void print_info(const char *path, const fm_file_info *info) {
    char text[32];
    printf("%s\n", path);
    printf("    format    %s%s%s\n", fm_format_name(info->format), info->compressed ? ", gzipped" : "",
           info->big_endian ? ", big-endian" : "");
    printf("    shape     %u x %u x %u\n", info->shape.x, info->shape.y, info->shape.z);
    printf("    type      %s\n", fm_type_name(info->type));
    printf("    spacing   %g, %g, %g\n", info->spacing[0], info->spacing[1], info->spacing[2]);
    printf("    origin    %g, %g, %g\n", info->origin[0], info->origin[1], info->origin[2]);
    printf("    volume    %s\n", cli_bytes(info->bytes, text));
    printf("    file      %s\n", cli_bytes(info->file_bytes, text));
    if (info->fortran_order) {
        printf("    order     Fortran\n");
    }
    if (info->format == FM_FORMAT_VOX) {
        printf("    models    %u, placed %u, rotated %u, hidden %u\n", info->models, info->placed, info->rotated, info->hidden);
        printf("    palette   %u colours\n", info->palette_count);
    }
    if (info->note[0]) {
        printf("    note      %s\n", info->note);
    }
}

static cJSON *stats_json(const fm_file_info *info, const stats *s) {
    char text[64];
    cJSON *object = cJSON_CreateObject();
    // As text, for integers that a double cannot hold.
    cJSON_AddRawToObject(object, "min", number(info, s->min, text));
    cJSON_AddRawToObject(object, "max", number(info, s->max, text));
    cJSON_AddNumberToObject(object, "voxels", (double)s->voxels);
    cJSON_AddNumberToObject(object, "nonzero", (double)s->nonzero);
    cJSON_AddNumberToObject(object, "nan", (double)s->nan);
    cJSON_AddNumberToObject(object, "infinite", (double)s->infinite);
    if (!s->integer) {
        return object;
    }
    cJSON_AddItemToObject(object, "distinct", s->more ? cJSON_CreateNull() : cJSON_CreateNumber((double)s->distinct));
    cJSON *commonest = cJSON_AddArrayToObject(object, "commonest");
    for (uint32_t i = 0; i < s->listed; i++) {
        cJSON *value = cJSON_CreateObject();
        cJSON_AddRawToObject(value, "value", number(info, s->values[i].value, text));
        cJSON_AddNumberToObject(value, "voxels", (double)s->values[i].voxels);
        cJSON_AddItemToArray(commonest, value);
    }
    return object;
}

// `s` NULL: not wanted.
static bool print_json(const char *path, const fm_file_info *info, const stats *s) {
    cJSON *root = cJSON_CreateObject();
    cJSON_AddStringToObject(root, "path", path);
    cJSON_AddStringToObject(root, "format", fm_format_name(info->format));
    cJSON_AddItemToObject(root, "shape", report_shape_json(info->shape));
    cJSON_AddStringToObject(root, "type", fm_type_name(info->type));
    cJSON_AddItemToObject(root, "spacing", cJSON_CreateDoubleArray(info->spacing, 3));
    cJSON_AddItemToObject(root, "origin", cJSON_CreateDoubleArray(info->origin, 3));
    cJSON_AddNumberToObject(root, "bytes", (double)info->bytes);
    cJSON_AddNumberToObject(root, "file_bytes", (double)info->file_bytes);
    cJSON_AddBoolToObject(root, "compressed", info->compressed);
    cJSON_AddBoolToObject(root, "big_endian", info->big_endian);
    cJSON_AddBoolToObject(root, "fortran_order", info->fortran_order);
    if (info->format == FM_FORMAT_VOX) {
        cJSON_AddNumberToObject(root, "models", info->models);
        cJSON_AddNumberToObject(root, "placed", info->placed);
        cJSON_AddNumberToObject(root, "rotated", info->rotated);
        cJSON_AddNumberToObject(root, "hidden", info->hidden);
        cJSON_AddNumberToObject(root, "palette_count", info->palette_count);
    }
    cJSON_AddStringToObject(root, "note", info->note);
    if (s) {
        cJSON_AddItemToObject(root, "stats", stats_json(info, s));
    }
    return report_json(stdout, root);
}

// Looks at the header, and at the voxels only where that is needed: for their statistics, and as a pipe can be read only once.
static int describe(const char *path, const fm_read_desc *desc, bool wants_stats, bool json) {
    fm_file_info info;
    stats found;
    if (wants_stats || files_is_pipe(path)) {
        fm_volume *volume;
        int status = files_read(path, desc, false, &volume, &info);
        if (status != CLI_DONE) {
            return status;
        }
        const bool counted = !wants_stats || stats_of(volume, &found);
        fm_volume_destroy(volume);
        if (!counted) {
            return cli_fail("out of memory for the statistics: free some");
        }
    } else if (fm_file_probe(path, desc, &info) != FM_OK) {
        const bool octree = desc->format == FM_FORMAT_AUTO && files_is_octree(path);
        return octree ? files_tell_octree(path, "a volume or a mesh") : cli_library_failed();
    }
    if (json) {
        const bool printed = print_json(path, &info, wants_stats ? &found : NULL);
        return printed ? CLI_DONE : cli_fail("out of memory for the description: free some");
    }
    print_info(path, &info);
    if (wants_stats) {
        print_stats(&info, &found);
    }
    return CLI_DONE;
}

int command_info(int argc, char **argv) {
    static const cli_help help = {"info", "Describes a file: a volume from its header, a mesh from its triangles.",
                                  "fathom info scan.nii.gz\nfathom info scene.vox --json\nfathom info bunny.ply\n"
                                  "fathom info labels.npy --stats\n"
                                  "gunzip -c part.stl.gz | fathom info - --input-format stl\n"
                                  "fathom info dump.bin --shape 64,64,32 --input-type u16\n"};
    cli_args args = {0};
    files_input input;
    struct arg_str *path = cli_add(
        &args,
        arg_str1(NULL, NULL, "FILE",
                 "the file; - reads standard input, .npy unless told otherwise; --input-format takes ply, obj, stl, glb too"));
    struct arg_lit *wants_stats = cli_add(
        &args, arg_lit0(NULL, "stats", "read the voxels too: their range, how many are not 0, and the commonest whole numbers"));
    files_input_add(&args, &input);
    struct arg_lit *json = cli_add(&args, arg_lit0(NULL, "json", "print JSON"));
    int status;
    if (cli_parse(&args, &help, argc, argv, &status)) {
        fm_read_desc desc;
        fm_mesh_format format;
        if (input.format->count && mesh_input_format(input.format->sval[0], &format)) {
            status = mesh_info(path->sval[0], format, json->count > 0);
        } else if (!files_input_desc(&input, &desc)) {
            status = CLI_USAGE;
        } else if (desc.format == FM_FORMAT_AUTO && fm_mesh_format_of(path->sval[0]) != FM_MESH_FORMAT_AUTO) {
            status = mesh_info(path->sval[0], FM_MESH_FORMAT_AUTO, json->count > 0);
        } else {
            status = describe(path->sval[0], &desc, wants_stats->count > 0, json->count > 0);
        }
    }
    cli_free(&args);
    return status;
}
