// SPDX-License-Identifier: MIT
// fathom info: what a file holds.

#include "cli.h"
#include "commands.h"
#include "files.h"
#include "report.h"

#include <inttypes.h>
#include <stdio.h>

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

static bool print_json(const char *path, const fm_file_info *info) {
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
    return report_json(stdout, root);
}

int command_info(int argc, char **argv) {
    static const cli_help help = {"info", "Describes a file from its header.",
                                  "fathom info scan.nii.gz\nfathom info scene.vox --json\n"
                                  "fathom info dump.bin --shape 64,64,32 --input-type u16\n"};
    cli_args args = {0};
    files_input input;
    struct arg_str *path = cli_add(&args, arg_str1(NULL, NULL, "FILE", "the file"));
    files_input_add(&args, &input);
    struct arg_lit *json = cli_add(&args, arg_lit0(NULL, "json", "print JSON"));
    int status;
    if (cli_parse(&args, &help, argc, argv, &status)) {
        fm_read_desc desc;
        fm_file_info info;
        status = CLI_USAGE;
        if (files_input_desc(&input, &desc)) {
            if (fm_file_probe(path->sval[0], &desc, &info) != FM_OK) {
                status = cli_library_failed();
            } else if (json->count) {
                status = print_json(path->sval[0], &info) ? CLI_DONE : cli_fail("out of memory for the description: free some");
            } else {
                print_info(path->sval[0], &info);
                status = CLI_DONE;
            }
        }
    }
    cli_free(&args);
    return status;
}
