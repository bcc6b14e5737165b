// SPDX-License-Identifier: MIT
// fathom slice: a picture of one slice of a volume.

#include "cli.h"
#include "commands.h"
#include "files.h"

#include <inttypes.h>
#include <stdio.h>

typedef struct slice_options {
    uint32_t axis;
    int64_t index;  // -1: the middle
    fm_slice_desc desc;
    bool quiet;
} slice_options;

static int write_slice(const char *in, const fm_read_desc *read, const char *out, const slice_options *options) {
    int status = files_picture_check(out);
    if (status != CLI_DONE) {
        return status;
    }
    fm_volume *volume;
    status = files_read(in, read, options->quiet, &volume, NULL);
    if (status != CLI_DONE) {
        return status;
    }
    fm_volume_desc about;
    fm_slice_info shown;
    fm_volume_info(volume, &about);
    const uint32_t extents[3] = {about.shape.x, about.shape.y, about.shape.z};
    const uint32_t extent = extents[options->axis];
    const uint32_t index = options->index < 0 ? extent / 2 : (uint32_t)options->index;
    if (options->index >= (int64_t)extent) {
        status = cli_usage("--index is %" PRId64 ": the axis has %u slices, 0 to %u", options->index, extent, extent - 1);
    } else if (options->desc.map == FM_COLOR_PALETTE && !fm_volume_palette(volume)) {
        status = cli_usage("--map is palette: %s has no palette: leave --map out, or say labels", in);
    } else if (fm_slice_png(volume, options->axis, index, &options->desc, out, &shown) != FM_OK) {
        status = cli_library_failed();
    } else if (!options->quiet && !files_is_pipe(out)) {
        printf("%s: slice %u across %c, %u x %u pixels, values %g to %g\n", out, index, "xyz"[options->axis], shown.width,
               shown.height, shown.min, shown.max);
    }
    fm_volume_destroy(volume);
    return status;
}

int command_slice(int argc, char **argv) {
    static const cli_help help = {
        "slice",
        "Writes one slice of a volume as a PNG picture. Across z, x runs to the right and y downwards; across y,\n"
        "x runs to the right and z upwards; across x, y runs to the right and z upwards.",
        "fathom slice field.npy field.png\n"
        "fathom slice labels.npy labels.png --map labels\n"
        "fathom slice field.npy - | display\n"
        "fathom slice field.npy side.png --axis y --index 100 --min 0 --max 40 --scale 2\n"};
    static const char *const axes[] = {"x", "y", "z", NULL};
    static const char *const maps[] = {"auto", "sequential", "diverging", "grey", "palette", "labels", "gray", NULL};
    cli_args args = {0};
    files_input input;
    struct arg_str *in =
        cli_add(&args, arg_str1(NULL, NULL, "IN", "the volume; - reads standard input, .npy unless told otherwise"));
    struct arg_str *out = cli_add(&args, arg_str1(NULL, NULL, "OUT.png", "the picture; - writes it to standard output"));
    struct arg_str *axis = cli_add(&args, arg_str0(NULL, "axis", "x|y|z", "axis across which to cut; default z"));
    struct arg_str *index = cli_add(&args, arg_str0(NULL, "index", "I", "which slice; default the middle one"));
    struct arg_str *least = cli_add(&args, arg_str0(NULL, "min", "V", "value at the low end of the colours"));
    struct arg_str *most = cli_add(&args, arg_str0(NULL, "max", "V", "value at the high end of the colours"));
    struct arg_str *map =
        cli_add(&args, arg_str0(NULL, "map", "MAP", "auto, sequential, diverging, grey, palette or labels (a colour a value)"));
    struct arg_lit *flip = cli_add(&args, arg_lit0(NULL, "flip", "the other way up, as for .vxl, whose z runs down"));
    struct arg_str *scale = cli_add(&args, arg_str0(NULL, "scale", "N", "pixels along the edge of a voxel; default 1"));
    struct arg_lit *mark =
        cli_add(&args, arg_lit0(NULL, "mark-largest", "the largest integer stands for no distance: show it grey"));
    files_input_add(&args, &input);
    struct arg_lit *quiet = cli_add(&args, arg_lit0("q", "quiet", "print nothing but errors"));

    int status;
    if (cli_parse(&args, &help, argc, argv, &status)) {
        slice_options options = {.axis = 2, .index = -1, .quiet = quiet->count > 0};
        fm_read_desc read;
        int axis_place = 2, map_place = 0;
        status = CLI_USAGE;
        if (files_input_desc(&input, &read) && (!axis->count || cli_word("--axis", axis->sval[0], axes, &axis_place)) &&
            (!map->count || cli_word("--map", map->sval[0], maps, &map_place)) &&
            (!index->count || cli_int64("--index", index->sval[0], &options.index)) &&
            (!least->count || cli_double("--min", least->sval[0], &options.desc.min)) &&
            (!most->count || cli_double("--max", most->sval[0], &options.desc.max)) &&
            (!scale->count || cli_uint32("--scale", scale->sval[0], 1, &options.desc.scale))) {
            options.axis = (uint32_t)axis_place;
            options.desc.map = map_place > (int)FM_COLOR_LABELS ? FM_COLOR_GREY : (fm_color_map)map_place;
            options.desc.flip = flip->count > 0;
            options.desc.mark_largest = mark->count > 0;
            if (index->count && options.index < 0) {
                cli_usage("--index is %s: 0 or more is wanted", index->sval[0]);
            } else if ((least->count || most->count) && !(options.desc.min < options.desc.max)) {
                cli_usage("--min is %g and --max is %g: the second must be above the first", options.desc.min, options.desc.max);
            } else {
                status = write_slice(in->sval[0], &read, out->sval[0], &options);
            }
        }
    }
    cli_free(&args);
    return status;
}
