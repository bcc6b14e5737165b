// SPDX-License-Identifier: MIT
// fathom scene: procedural scenes as files.

#include "cli.h"
#include "commands.h"
#include "files.h"
#include "scenes.h"

#include <stdio.h>

static void list_scenes(void) {
    for (uint32_t i = 0; fm_scene_at(i); i++) {
        printf("%-8s  %s\n", fm_scene_name(fm_scene_at(i)), fm_scene_summary(fm_scene_at(i)));
    }
}

static int write_scene(const fm_scene *scene, const fm_scene_desc *desc, const char *path, const fm_write_desc *write, bool quiet) {
    int status = files_output_check(path);
    if (status != CLI_DONE) {
        return status;
    }
    fm_volume *volume;
    if (fm_volume_create(NULL, &(fm_volume_desc){.shape = desc->shape, .type = FM_TYPE_U8}, &volume) != FM_OK) {
        return cli_library_failed();
    }
    fm_scene_fill_threads(scene, desc, 0, desc->shape.z, 0, fm_volume_data(volume));
    if (fm_volume_set_palette(volume, fm_scene_palette()) != FM_OK) {
        status = cli_library_failed();
    } else {
        status = files_write(path, volume, write, quiet);
    }
    fm_volume_destroy(volume);
    if (status == CLI_DONE && !quiet && !files_is_pipe(path)) {
        printf("%s: %s, %u x %u x %u, uint8\n", path, fm_scene_name(scene), desc->shape.x, desc->shape.y, desc->shape.z);
    }
    return status;
}

int command_scene(int argc, char **argv) {
    static const cli_help help = {"scene",
                                  "Writes a procedural scene: 0 is empty, other values are materials. The same everywhere for "
                                  "the same name, size and seed.",
                                  "fathom scene terrain terrain.npy --size 256\n"
                                  "fathom scene sparse points.nrrd --size 640,480,128 --density 0.01 --seed 7\n"
                                  "fathom scene city - --size 128 | fathom transform - field.npy\n"
                                  "fathom scene --list\n"};
    cli_args args = {0};
    struct arg_str *name = cli_add(&args, arg_str0(NULL, NULL, "NAME", "the scene"));
    struct arg_str *path = cli_add(&args, arg_str0(NULL, NULL, "OUT", "the file; - writes .npy to standard output"));
    struct arg_str *size = cli_add(&args, arg_str0(NULL, "size", "N|X,Y,Z", "voxels along each axis"));
    struct arg_str *seed = cli_add(&args, arg_str0(NULL, "seed", "S", "another scene of the same kind; default 0"));
    struct arg_str *density = cli_add(&args, arg_str0(NULL, "density", "D", "share of solid voxels of sparse; default 0.001"));
    struct arg_str *format =
        cli_add(&args, arg_str0(NULL, "format", "FORMAT", "write npy, raw, nrrd, nifti or vox; default by name"));
    struct arg_lit *compress = cli_add(&args, arg_lit0(NULL, "compress", "gzip; a name that ends in .gz asks for it too"));
    struct arg_lit *list = cli_add(&args, arg_lit0(NULL, "list", "list the scenes"));
    struct arg_lit *quiet = cli_add(&args, arg_lit0("q", "quiet", "print nothing but errors"));

    int status;
    if (!cli_parse(&args, &help, argc, argv, &status)) {
        goto done;
    }
    if (list->count) {
        list_scenes();
        status = CLI_DONE;
        goto done;
    }
    status = CLI_USAGE;
    fm_scene_desc desc = {0};
    fm_write_desc write = {.compress = compress->count > 0};
    int64_t seed_value = 0;
    if (!name->count || !path->count || !size->count) {
        cli_usage("scene: NAME, OUT and --size are needed: see fathom scene --help");
        goto done;
    }
    const fm_scene *scene = cli_scene("NAME", name->sval[0]);
    if (!scene) {
        goto done;
    }
    if (!cli_shape("--size", size->sval[0], &desc.shape) || (seed->count && !cli_int64("--seed", seed->sval[0], &seed_value)) ||
        (density->count && !cli_double("--density", density->sval[0], &desc.density)) ||
        (format->count && !cli_format("--format", format->sval[0], &write.format))) {
        goto done;
    }
    if (density->count && !(desc.density > 0 && desc.density <= 1)) {
        cli_usage("--density is %s: above 0 and at most 1 is wanted", density->sval[0]);
        goto done;
    }
    desc.seed = (uint64_t)seed_value;
    status = write_scene(scene, &desc, path->sval[0], &write, quiet->count > 0);
done:
    cli_free(&args);
    return status;
}
