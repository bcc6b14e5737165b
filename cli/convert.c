// SPDX-License-Identifier: MIT
// fathom convert: the same volume in another format.

#include "cli.h"
#include "commands.h"
#include "files.h"

#include <stdio.h>

static int convert(const char *in, const fm_read_desc *read, const char *out, const fm_write_desc *write, bool quiet) {
    int status = files_output_check(out);
    if (status != CLI_DONE) {
        return status;
    }
    fm_volume *volume;
    fm_file_info info;
    status = files_read(in, read, quiet, &volume, &info);
    if (status != CLI_DONE) {
        return status;
    }
    status = files_write(out, volume, write, quiet);
    fm_volume_destroy(volume);
    if (status == CLI_DONE && !quiet && !files_is_pipe(out)) {
        printf("%s: %u x %u x %u, %s%s%s\n", out, info.shape.x, info.shape.y, info.shape.z, fm_type_name(info.type),
               info.note[0] ? "; " : "", info.note);
    }
    return status;
}

int command_convert(int argc, char **argv) {
    static const cli_help help = {"convert", "Copies a volume into a file of another format, values unchanged.",
                                  "fathom convert scene.vox scene.npy\n"
                                  "fathom convert dump.bin scan.nrrd --shape 512,512,300 --input-type i16 --compress\n"};
    cli_args args = {0};
    files_input input;
    struct arg_str *in =
        cli_add(&args, arg_str1(NULL, NULL, "IN", "the volume; - reads standard input, .npy unless told otherwise"));
    struct arg_str *out = cli_add(&args, arg_str1(NULL, NULL, "OUT", "the copy; - writes .npy to standard output"));
    files_input_add(&args, &input);
    struct arg_str *format =
        cli_add(&args, arg_str0(NULL, "format", "FORMAT", "write npy, raw, nrrd, nifti, vox or nanovdb; default by name"));
    struct arg_lit *compress = cli_add(&args, arg_lit0(NULL, "compress", "gzip; a name that ends in .gz asks for it too"));
    struct arg_lit *quiet = cli_add(&args, arg_lit0("q", "quiet", "print nothing but errors"));
    int status;
    if (cli_parse(&args, &help, argc, argv, &status)) {
        fm_read_desc read;
        fm_write_desc write = {.compress = compress->count > 0};
        status = CLI_USAGE;
        if (files_input_desc(&input, &read) && (!format->count || cli_format("--format", format->sval[0], &write.format))) {
            status = convert(in->sval[0], &read, out->sval[0], &write, quiet->count > 0);
        }
    }
    cli_free(&args);
    return status;
}
