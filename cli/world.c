// SPDX-License-Identifier: MIT
// fathom world: a world is made, edited, measured, asked and saved.

#include "cli.h"
#include "commands.h"
#include "files.h"
#include "method.h"
#include "words.h"
#include "world_report.h"

#include <stdlib.h>
#include <string.h>

enum { MAX_EDITS = 256, MAX_PLACES = 4096 };

static int update(fm_world *world, world_outcome *outcome) {
    const double start = fm_now_ms();
    if (fm_world_update(world, NULL) != FM_OK) {
        return cli_library_failed();
    }
    outcome->wall_ms += fm_now_ms() - start;
    outcome->updates++;
    return CLI_DONE;
}

static int play(const world_request *request, fm_world *world, world_outcome *outcome) {
    // So that the last update tells what the edits cost, not the start.
    int status = request->script.count == 0 || fm_world_update(world, NULL) == FM_OK ? CLI_DONE : cli_library_failed();
    for (uint32_t i = 0; status == CLI_DONE && i < request->script.count; i++) {
        const world_step *step = &request->script.steps[i];
        if (step->update) {
            status = update(world, outcome);
        } else {
            status = fm_world_edit(world, &step->brush, 1) == FM_OK ? CLI_DONE : cli_library_failed();
            outcome->edits++;
        }
    }
    const bool ended = request->script.count > 0 && request->script.steps[request->script.count - 1].update;
    return status != CLI_DONE || ended ? status : update(world, outcome);
}

static int look(const world_request *request, bench_session *session, fm_context *context, fm_world *world,
                world_outcome *outcome) {
    outcome->pass_count = WORLD_MAX_PASSES;
    outcome->memory_count = BENCH_MAX_MEMORY;
    if (fm_world_stats_get(world, &outcome->stats) != FM_OK ||
        fm_context_passes(context, &outcome->pass_count, outcome->passes) != FM_OK ||
        fm_context_memory(context, &outcome->memory_count, outcome->memory) != FM_OK ||
        (request->place_count &&
         fm_world_query(world, (const float(*)[3])request->places, request->place_count, outcome->samples) != FM_OK)) {
        return cli_library_failed();
    }
    if (request->check) {
        const char *failure = bench_world_check(session, world, UINT64_MAX, &outcome->whole, &outcome->domain);
        return failure ? cli_fail("%s", failure) : CLI_DONE;
    }
    return CLI_DONE;
}

static fm_result make_field(const world_request *request, fm_world *world, fm_volume **volume) {
    fm_volume_desc desc = request->start;
    desc.shape = request->desc.shape;
    desc.type = request->field_type;
    fm_result result = fm_volume_create(NULL, &desc, volume);
    if (result == FM_OK) {
        const fm_array array = {fm_volume_data(*volume), desc.type, desc.shape};
        result = fm_world_read_field(world, NULL, &array, NULL);
    }
    return result;
}

static int write_pending(const world_request *request, fm_world *world, fm_file_batch *batch, fm_slice_info *shown) {
    fm_volume *field = NULL, *voxels = NULL;
    fm_write_desc write = request->write;
    write.batch = batch;
    int status = CLI_DONE;
    if ((request->field || request->slice) && make_field(request, world, &field) != FM_OK) {
        status = cli_library_failed();
    }
    if (status == CLI_DONE && request->slice) {
        const fm_slice_desc slice = {.map = FM_COLOR_SEQUENTIAL, .batch = batch};
        const bool good = fm_slice_png(field, 2, request->desc.shape.z / 2, &slice, request->slice, shown) == FM_OK;
        status = good ? CLI_DONE : cli_library_failed();
    }
    if (status == CLI_DONE && request->field) {
        status = files_write(request->field, field, &write, request->quiet);
    }
    fm_volume_destroy(field);
    if (status == CLI_DONE && request->voxels) {
        fm_volume_desc desc = request->start;
        desc.shape = request->desc.shape;
        desc.type = request->voxel_type;
        const bool good = fm_volume_create(NULL, &desc, &voxels) == FM_OK && fm_world_save(world, voxels) == FM_OK;
        status = good ? files_write(request->voxels, voxels, &write, request->quiet) : cli_library_failed();
        fm_volume_destroy(voxels);
    }
    return status;
}

// All files or none.
static int write_all(const world_request *request, fm_world *world, fm_slice_info *shown) {
    fm_file_batch *batch;
    if (fm_file_batch_create(NULL, &batch) != FM_OK) {
        return cli_library_failed();
    }
    int status = write_pending(request, world, batch, shown);
    if (status == CLI_DONE && fm_file_batch_commit(batch) != FM_OK) {
        status = cli_library_failed();
    }
    fm_file_batch_destroy(batch);
    return status;
}

static int work(const world_request *request, bench_session *session, const fm_volume *start, world_outcome *outcome) {
    fm_context *context = bench_session_context(session, FM_BACKEND_AUTO);
    fm_world *world = NULL;
    if (!context || fm_world_create(context, &request->desc, &world) != FM_OK) {
        return cli_library_failed();
    }
    fm_context_device(context, &outcome->device);
    outcome->backend = fm_context_backend(context);
    int status = start && fm_world_load(world, start) != FM_OK ? cli_library_failed() : CLI_DONE;
    status = status == CLI_DONE ? play(request, world, outcome) : status;
    status = status == CLI_DONE ? look(request, session, context, world, outcome) : status;
    status = status == CLI_DONE ? write_all(request, world, &outcome->slice) : status;
    fm_world_destroy(world);
    return status;
}

// Leaves of a volume what is at the threshold or above: bytes keep their value, other types become 1. A distance of 0 tells.
static int keep_solid(fm_context *context, double threshold, fm_volume **volume) {
    fm_volume_desc desc;
    fm_volume_info(*volume, &desc);
    const fm_array values = {fm_volume_data(*volume), desc.type, desc.shape};
    const bool bytes = desc.type == FM_TYPE_U8;
    desc.type = FM_TYPE_U8;
    fm_volume *solid;
    if (!context || fm_volume_create(NULL, &desc, &solid) != FM_OK) {
        return cli_library_failed();
    }
    uint8_t *kept = fm_volume_data(solid);
    const fm_array distance = {kept, FM_TYPE_U8, desc.shape};
    const fm_transform_desc select = {
        .metric = FM_METRIC_LINF, .select = FM_SELECT_THRESHOLD, .threshold = threshold, .saturate = true};
    const uint8_t *palette = fm_volume_palette(*volume);
    if (fm_transform_host(context, &select, &values, &distance, NULL) != FM_OK || fm_volume_set_palette(solid, palette) != FM_OK) {
        fm_volume_destroy(solid);
        return cli_library_failed();
    }
    const uint64_t voxels = (uint64_t)desc.shape.x * desc.shape.y * desc.shape.z;
    for (uint64_t i = 0; i < voxels; i++) {
        const uint8_t value = bytes ? ((const uint8_t *)values.data)[i] : 1;
        kept[i] = kept[i] != 0 ? 0 : value != 0 ? value : 1;
    }
    fm_volume_destroy(*volume);
    *volume = solid;
    return CLI_DONE;
}

// What is in the world at first; NULL in `volume`: air. Returns an exit code.
static int start_volume(world_request *request, bench_session *session, fm_volume **volume) {
    enum { OCTOMAP_OCCUPIED = 2 };
    *volume = NULL;
    if (request->in) {
        fm_file_info info;
        int status = files_read(request->in, &request->read, request->quiet, volume, &info);
        request->desc.shape = info.shape;
        memcpy(request->start.spacing, info.spacing, sizeof info.spacing);
        memcpy(request->start.origin, info.origin, sizeof info.origin);
        if (status == CLI_DONE && !request->has_threshold && info.format == FM_FORMAT_OCTOMAP) {
            request->has_threshold = true;
            request->threshold = OCTOMAP_OCCUPIED;
        }
        if (status == CLI_DONE && request->has_threshold) {
            status = keep_solid(bench_session_context(session, FM_BACKEND_CPU), request->threshold, volume);
            if (status != CLI_DONE) {
                fm_volume_destroy(*volume);
            }
        }
        return status;
    }
    if (request->scene) {
        request->scene_desc.shape = request->desc.shape;
        *volume = bench_world_scene(request->scene, &request->scene_desc);
        return *volume ? CLI_DONE : cli_library_failed();
    }
    return CLI_DONE;
}

static int run(world_request *request) {
    const char *const outputs[] = {request->voxels, request->field, request->slice};
    for (int i = 0; i < 3; i++) {
        const int status = !outputs[i] ? CLI_DONE : i == 2 ? files_picture_check(outputs[i]) : files_output_check(outputs[i]);
        if (status != CLI_DONE) {
            return status;
        }
    }
    fm_volume *start;
    static world_outcome outcome;
    bench_session *session = bench_session_create(&request->session);
    outcome.samples = calloc(request->place_count + 1, sizeof *outcome.samples);
    int status = session && outcome.samples ? start_volume(request, session, &start) : cli_fail("out of memory: free some");
    if (status == CLI_DONE) {
        method_focus(request->method, &request->desc);
        status = work(request, session, start, &outcome);
        fm_volume_destroy(start);
    }
    status = status == CLI_DONE ? world_report(request, &outcome) : status;
    free(outcome.samples);
    bench_session_destroy(session);
    return status;
}

typedef struct world_args {
    struct arg_str *in, *threshold, *size, *scene, *scene_seed, *edits, *edit, *voxels, *voxel_type, *field, *type, *slice, *at;
    cli_device device;
    struct arg_lit *check, *compress, *quiet, *json;
    files_input input;
    method_options method;
} world_args;

static void add_options(cli_args *args, world_args *a) {
    a->in = cli_add(args, arg_str0(NULL, NULL, "IN", "the voxels: 0 is air; - reads standard input, .npy unless told otherwise"));
    a->threshold = cli_add(args, arg_str0(NULL, "threshold", "T",
                                          "of IN: solid at this value or above; default: if not 0, of .bt: if "
                                          "occupied"));
    a->scene = cli_add(args, arg_str0(NULL, "scene", "NAME", "a procedural scene instead; without either: air"));
    a->size = cli_add(args, arg_str0(NULL, "size", "N|X,Y,Z", "of the scene or air"));
    a->scene_seed = cli_add(args, arg_str0(NULL, "scene-seed", "S", "another scene of the same kind; default 0"));
    a->edits = cli_add(args, arg_str0(NULL, "edits", "FILE", "a script of edits; - reads standard input"));
    a->edit = cli_add(args, arg_strn(NULL, "edit", "EDIT", 0, MAX_EDITS, "one more line of it; may be given often"));
    a->at = cli_add(args, arg_strn(NULL, "at", "X,Y,Z", 0, MAX_PLACES, "print distance and gradient there; may be given often"));
    a->voxels = cli_add(args, arg_str0(NULL, "voxels", "FILE", "write the voxels"));
    a->voxel_type = cli_add(args, arg_str0(NULL, "voxel-type", "u8|u32",
                                           "colours with a palette, or voxels as they are; default u8 for "
                                           ".vox, else u32"));
    a->field = cli_add(args, arg_str0(NULL, "field", "FILE", "write the distances"));
    a->type = cli_add(args, arg_str0(NULL, "type", "u8|u16|u32|f32", "of the written distances; default what the format has"));
    a->slice = cli_add(args, arg_str0(NULL, "slice", "FILE.png", "write a picture of the distances' middle slice"));
    a->compress = cli_add(args, arg_lit0(NULL, "compress", "gzip; a name that ends in .gz asks for it too"));
    method_options_add(args, &a->method);
    a->check = cli_add(args, arg_lit0(NULL, "check", "compare the field with the exact distances"));
    cli_device_add(args, &a->device);
    files_input_add(args, &a->input);
    a->quiet = cli_add(args, arg_lit0("q", "quiet", "print nothing but errors and what --at asks for"));
    a->json = cli_add(args, arg_lit0(NULL, "json", "print the report as JSON"));
}

static bool read_start(const world_args *a, world_request *r) {
    int64_t seed = 0;
    r->in = cli_given(a->in, NULL);
    if (r->in && (a->scene->count || a->size->count)) {
        cli_usage("world: IN is given with --scene or --size: the file has its own voxels and size");
        return false;
    }
    if (!r->in && !a->size->count) {
        cli_usage("world: IN or --size is needed: see fathom world --help");
        return false;
    }
    if (a->scene->count) {
        r->scene = cli_scene("--scene", a->scene->sval[0]);
        if (!r->scene) {
            return false;
        }
    }
    if (!cli_int64("--scene-seed", cli_given(a->scene_seed, "0"), &seed)) {
        return false;
    }
    r->scene_desc.seed = (uint64_t)seed;
    r->has_threshold = a->threshold->count > 0;
    if (r->has_threshold && !r->in) {
        cli_usage("--threshold is of a file: name one");
        return false;
    }
    if (r->has_threshold && !cli_double("--threshold", a->threshold->sval[0], &r->threshold)) {
        return false;
    }
    return files_input_desc(&a->input, &r->read) && (!a->size->count || cli_shape("--size", a->size->sval[0], &r->desc.shape));
}

static bool read_types(const world_args *a, world_request *r) {
    static const fm_type of_format[] = {FM_TYPE_U8, FM_TYPE_U8, FM_TYPE_U16, FM_TYPE_U32};
    r->field_type = of_format[r->desc.format];
    if (a->type->count && !cli_type("--type", a->type->sval[0], &r->field_type)) {
        return false;
    }
    if (r->field_type != FM_TYPE_U8 && r->field_type != FM_TYPE_U16 && r->field_type != FM_TYPE_U32 &&
        r->field_type != FM_TYPE_F32) {
        cli_usage("--type is \"%s\": u8, u16, u32 or f32 is wanted", a->type->sval[0]);
        return false;
    }
    const size_t length = r->voxels ? strlen(r->voxels) : 0;
    r->voxel_type = length > 4 && strcmp(r->voxels + length - 4, ".vox") == 0 ? FM_TYPE_U8 : FM_TYPE_U32;
    if (a->voxel_type->count && !cli_type("--voxel-type", a->voxel_type->sval[0], &r->voxel_type)) {
        return false;
    }
    if (r->voxel_type != FM_TYPE_U8 && r->voxel_type != FM_TYPE_U32) {
        cli_usage("--voxel-type is \"%s\": u8 or u32 is wanted", a->voxel_type->sval[0]);
        return false;
    }
    return true;
}

static bool read_outputs(const world_args *a, world_request *r) {
    r->voxels = cli_given(a->voxels, NULL);
    r->field = cli_given(a->field, NULL);
    r->slice = cli_given(a->slice, NULL);
    r->write.compress = a->compress->count > 0;
    r->check = a->check->count > 0;
    r->quiet = a->quiet->count > 0;
    r->json = a->json->count > 0;
    const char *wrong = NULL;
    if (files_same(r->voxels, r->field) || files_same(r->voxels, r->slice) || files_same(r->field, r->slice)) {
        wrong = "two outputs are the same file: give each its own name";
    } else if (r->slice && files_is_pipe(r->slice)) {
        wrong = "--slice is -: a picture needs a file name";
    } else if (r->in && a->edits->count && files_is_pipe(r->in) && files_is_pipe(a->edits->sval[0])) {
        wrong = "IN and --edits are both -: standard input can be read once";
    }
    if (wrong) {
        cli_usage("%s", wrong);
    }
    return !wrong && read_types(a, r);
}

static bool read_backend(const world_args *a, world_request *r) {
    fm_context_desc wanted = {0};
    if (!cli_device_read(&a->device, &wanted)) {
        return false;
    }
    r->session.backend = wanted.backend;
    r->session.device = wanted.device;
    r->session.threads = wanted.threads;
    return true;
}

static bool read_places(const world_args *a, world_request *r) {
    r->places = calloc((size_t)a->at->count + 1, sizeof *r->places);
    if (!r->places) {
        cli_fail("out of memory: free some");
        return false;
    }
    for (; r->place_count < (uint32_t)a->at->count; r->place_count++) {
        double place[3];
        if (!cli_triple("--at", a->at->sval[r->place_count], place)) {
            return false;
        }
        for (int i = 0; i < 3; i++) {
            r->places[r->place_count][i] = (float)place[i];
        }
    }
    return true;
}

static int read_script(const world_args *a, world_request *r) {
    int status = a->edits->count ? world_script_file(&r->script, a->edits->sval[0]) : CLI_DONE;
    for (int i = 0; status == CLI_DONE && i < a->edit->count; i++) {
        status = world_script_line(&r->script, "--edit", a->edit->sval[i]);
    }
    return status;
}

int command_world(int argc, char **argv) {
    static const cli_help help = {
        "world",
        "Makes an editable world, edits it by a script while its distance field is kept up to date, and tells what that cost.\n"
        "Distances are Manhattan ones; squared Euclidean ones with --format squared.\n\n"
        "Colours have 8 bits, RGB332: three of red, three of green, two of blue. Those of a palette are cut to "
        "them.\n\n" WORLD_SCRIPT_HELP,
        "fathom world --scene terrain --size 128 --edit 'delete sphere 64,64,70 20' --at 64,64,70 --voxels dug.vox --field "
        "dug.npy\n"
        "fathom world city.vox --edits changes.txt --format squared --type f32 --field field.nrrd\n"
        "fathom world --scene terrain --size 64 --algorithm jfa-published --chunk 16 --border halo --check\n"
        "printf 'place box 0,0,0 9,9,0\\nupdate\\ndelete voxel 4,4,0\\n' | fathom world --size 10 --edits - --json\n"};
    cli_args args = {0};
    world_args options;
    add_options(&args, &options);
    int status;
    if (cli_parse(&args, &help, argc, argv, &status)) {
        world_request request = {.method = &options.method};
        status = CLI_USAGE;
        if (read_start(&options, &request) && method_options_read(&options.method, &request.desc) &&
            read_backend(&options, &request) && read_outputs(&options, &request) && read_places(&options, &request)) {
            status = read_script(&options, &request);
        }
        status = status == CLI_DONE ? run(&request) : status;
        world_script_free(&request.script);
        free(request.places);
    }
    cli_free(&args);
    return status;
}
