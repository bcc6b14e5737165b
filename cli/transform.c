// SPDX-License-Identifier: MIT
// fathom transform: a distance field of a file.

#include "cli.h"
#include "commands.h"
#include "files.h"
#include "report.h"
#include "stats.h"
#include "words.h"

#include <inttypes.h>
#include <stdio.h>
#include <string.h>

typedef struct transform_request {
    const char *in, *out, *indices, *slice;
    fm_read_desc read;
    fm_write_desc write;
    fm_context_desc context;
    fm_transform_desc desc;
    fm_type type;
    bool file_spacing, quiet, json;
} transform_request;

// What was made, for the report.
typedef struct transform_outcome {
    fm_device_info device;
    fm_backend backend;
    fm_file_info input;
    fm_pass passes[REPORT_MAX_PASSES];
    uint32_t pass_count;
    fm_slice_info slice;
    bool any_solid, any_empty;
    double wall_ms;
} transform_outcome;

static fm_array array_of(fm_volume *volume) {
    fm_volume_desc about;
    fm_volume_info(volume, &about);
    return (fm_array){fm_volume_data(volume), about.type, about.shape};
}

static fm_result compute(const transform_request *request, fm_context *context, fm_volume *solid, fm_volume *distance,
                         fm_volume *indices, transform_outcome *outcome) {
    const fm_array from = array_of(solid), to = array_of(distance);
    fm_array nearest = {0};
    if (indices) {
        nearest = array_of(indices);
    }
    const double start = fm_now_ms();
    fm_result result = fm_transform_host(context, &request->desc, &from, &to, indices ? &nearest : NULL);
    outcome->wall_ms = fm_now_ms() - start;
    if (result == FM_OK) {
        outcome->pass_count = REPORT_MAX_PASSES;
        result = fm_context_passes(context, &outcome->pass_count, outcome->passes);
    }
    return result;
}

static int write_pending(const transform_request *request, fm_volume *distance, fm_volume *indices, fm_file_batch *batch,
                         fm_slice_info *shown) {
    if (request->slice) {
        fm_volume_desc about;
        fm_volume_info(distance, &about);
        const bool integer = about.type != FM_TYPE_F32;
        const fm_slice_desc slice = {.map = request->desc.is_signed ? FM_COLOR_DIVERGING : FM_COLOR_AUTO,
                                     .mark_largest = integer && !request->desc.saturate && request->desc.max_distance == 0,
                                     .batch = batch};
        if (fm_slice_png(distance, 2, about.shape.z / 2, &slice, request->slice, shown) != FM_OK) {
            return cli_library_failed();
        }
    }
    const fm_write_desc plain = {.batch = batch};
    int status = indices ? files_write(request->indices, indices, &plain, request->quiet) : CLI_DONE;
    fm_write_desc field = request->write;
    field.batch = batch;
    return status == CLI_DONE ? files_write(request->out, distance, &field, request->quiet) : status;
}

// All files or none.
static int write_all(const transform_request *request, fm_volume *distance, fm_volume *indices, fm_slice_info *shown) {
    fm_file_batch *batch;
    if (fm_file_batch_create(NULL, &batch) != FM_OK) {
        return cli_library_failed();
    }
    int status = write_pending(request, distance, indices, batch, shown);
    if (status == CLI_DONE && fm_file_batch_commit(batch) != FM_OK) {
        status = cli_library_failed();
    }
    fm_file_batch_destroy(batch);
    return status;
}

static void report_text(FILE *stream, const transform_request *request, const transform_outcome *outcome) {
    const fm_shape shape = outcome->input.shape;
    fprintf(stream, "%s: %u x %u x %u, %s\n", request->in, shape.x, shape.y, shape.z, fm_type_name(outcome->input.type));
    if (outcome->input.note[0]) {
        fprintf(stream, "note: %s\n", outcome->input.note);
    }
    fprintf(stream, "backend: %s, %s (%s)\n\n", fm_backend_words[outcome->backend], outcome->device.name, outcome->device.driver);
    report_passes(stream, outcome->passes, outcome->pass_count);
    const double voxels = (double)shape.x * shape.y * shape.z;
    fprintf(stream, "\nwall time, copies and first use included: %.1f ms, %.4g Mvoxel/s\n", outcome->wall_ms,
            voxels * 1e-3 / outcome->wall_ms);
    fprintf(stream, "%s: %s distances, %s\n", files_is_pipe(request->out) ? "standard output" : request->out,
            fm_metric_words[request->desc.metric], fm_type_name(request->type));
    const double *edges = outcome->input.spacing;
    if (request->desc.spacing[0] == 0 && (edges[0] != 1 || edges[1] != 1 || edges[2] != 1)) {
        fprintf(stream, "note: distances are in voxels, of %g, %g, %g in the file: --spacing file gives world units\n", edges[0],
                edges[1], edges[2]);
    }
    if (request->indices) {
        fprintf(stream, "%s: nearest solid voxels\n", request->indices);
    }
    if (request->slice) {
        fprintf(stream, "%s: middle slice across z, values %g to %g\n", request->slice, outcome->slice.min, outcome->slice.max);
    }
}

static bool print_json(FILE *stream, const transform_request *request, const transform_outcome *outcome) {
    cJSON *root = cJSON_CreateObject();
    cJSON_AddStringToObject(root, "input", request->in);
    cJSON_AddItemToObject(root, "shape", report_shape_json(outcome->input.shape));
    cJSON_AddStringToObject(root, "input_type", fm_type_name(outcome->input.type));
    cJSON_AddStringToObject(root, "note", outcome->input.note);
    cJSON_AddStringToObject(root, "metric", fm_metric_words[request->desc.metric]);
    cJSON_AddBoolToObject(root, "signed", request->desc.is_signed);
    cJSON_AddBoolToObject(root, "squared", request->desc.squared);
    const bool spaced = request->desc.spacing[0] > 0;
    cJSON_AddItemToObject(root, "spacing", spaced ? cJSON_CreateDoubleArray(request->desc.spacing, 3) : cJSON_CreateNull());
    cJSON_AddStringToObject(root, "backend", fm_backend_words[outcome->backend]);
    cJSON_AddItemToObject(root, "device", report_device_json(&outcome->device));
    cJSON_AddItemToObject(root, "passes", report_passes_json(outcome->passes, outcome->pass_count));
    cJSON_AddBoolToObject(root, "any_solid", outcome->any_solid);
    cJSON_AddBoolToObject(root, "any_empty", outcome->any_empty);
    cJSON_AddNumberToObject(root, "wall_milliseconds", outcome->wall_ms);
    cJSON_AddStringToObject(root, "output", request->out);
    cJSON_AddStringToObject(root, "type", fm_type_name(request->type));
    if (request->indices) {
        cJSON_AddStringToObject(root, "indices", request->indices);
    }
    if (request->slice) {
        cJSON_AddStringToObject(root, "slice", request->slice);
    }
    return report_json(stream, root);
}

static int report(const transform_request *request, const transform_outcome *outcome) {
    // What is printed must not get between the bytes of the field.
    FILE *stream = files_is_pipe(request->out) ? stderr : stdout;
    if (!request->quiet && !(outcome->any_solid && outcome->any_empty)) {
        fprintf(stderr, "fathom: note: %s voxel is solid: fathom info --stats shows what values there are\n",
                outcome->any_solid ? "every" : "no");
    }
    if (request->json) {
        return print_json(stream, request, outcome) ? CLI_DONE : cli_fail("out of memory for the report: free some");
    }
    if (!request->quiet) {
        report_text(stream, request, outcome);
    }
    return CLI_DONE;
}

// A host volume where the input lies, with the spacing that the distances are in.
static fm_result create_output(const transform_request *request, const fm_file_info *input, fm_type type, fm_volume **volume) {
    fm_volume_desc desc = {.shape = input->shape, .type = type, .storage = FM_STORAGE_HOST};
    const bool given = request->desc.spacing[0] > 0;
    memcpy(desc.spacing, given ? request->desc.spacing : input->spacing, sizeof desc.spacing);
    memcpy(desc.origin, input->origin, sizeof desc.origin);
    return fm_volume_create(NULL, &desc, volume);
}

static int transform_volume(transform_request *request, fm_volume *solid, transform_outcome *outcome) {
    const fm_shape shape = outcome->input.shape;
    const bool wide = (uint64_t)shape.x * shape.y >= UINT32_MAX / (uint64_t)shape.z;
    fm_context *context = NULL;
    fm_volume *distance = NULL, *indices = NULL;
    if (request->file_spacing) {
        memcpy(request->desc.spacing, outcome->input.spacing, sizeof request->desc.spacing);
    }
    fm_result result = fm_context_create(&request->context, &context);
    if (result == FM_OK) {
        fm_context_device(context, &outcome->device);
        outcome->backend = fm_context_backend(context);
        result = create_output(request, &outcome->input, request->type, &distance);
    }
    if (result == FM_OK && request->indices) {
        result = create_output(request, &outcome->input, wide ? FM_TYPE_U64 : FM_TYPE_U32, &indices);
    }
    if (result == FM_OK) {
        result = compute(request, context, solid, distance, indices, outcome);
    }
    if (result == FM_OK) {
        stats_sides(distance, &outcome->any_solid, &outcome->any_empty);
    }
    int status = result == FM_OK ? write_all(request, distance, indices, &outcome->slice) : cli_library_failed();
    fm_volume_destroy(distance);
    fm_volume_destroy(indices);
    fm_context_destroy(context);
    return status;
}

// What only the file can tell to be wrong.
static bool check_input(const transform_request *request, const fm_file_info *input) {
    long double least, most;
    if (request->desc.select == FM_SELECT_LABEL && stats_type_range(input->type, &least, &most) &&
        (request->desc.label < least || request->desc.label > most)) {
        cli_usage("--label is %" PRId64 ": %s holds %s, from %.0Lf to %.0Lf; fathom info --stats lists its values",
                  request->desc.label, request->in, fm_type_name(input->type), least, most);
        return false;
    }
    if (request->file_spacing && !input->has_spacing) {
        cli_usage("--spacing is file: %s tells no voxel size; give X,Y,Z, or leave --spacing out for distances in voxels",
                  request->in);
        return false;
    }
    return true;
}

static int run(transform_request *request) {
    int checked = files_output_check(request->out);
    if (checked == CLI_DONE && request->indices) {
        checked = files_output_check(request->indices);
    }
    if (checked == CLI_DONE && request->slice) {
        checked = files_picture_check(request->slice);
    }
    if (checked != CLI_DONE) {
        return checked;
    }
    transform_outcome outcome = {0};
    fm_volume *solid;
    int status = files_read(request->in, &request->read, request->quiet, &solid, &outcome.input);
    if (status == CLI_DONE) {
        status = check_input(request, &outcome.input) ? transform_volume(request, solid, &outcome) : CLI_USAGE;
        fm_volume_destroy(solid);
    }
    return status == CLI_DONE ? report(request, &outcome) : status;
}

typedef struct transform_args {
    struct arg_str *in, *out, *metric, *algorithm, *spacing, *max_distance, *outside, *threshold, *label, *type, *indices, *slice,
        *format;
    cli_device device;
    struct arg_lit *is_signed, *squared, *saturate, *compress, *quiet, *json;
    files_input input;
} transform_args;

static void add_options(cli_args *args, transform_args *a) {
    a->in = cli_add(args, arg_str1(NULL, NULL, "IN", "the voxels; - reads standard input, .npy unless told otherwise"));
    a->out = cli_add(args, arg_str1(NULL, NULL, "OUT", "the field; - writes .npy to standard output"));
    a->metric = cli_add(args, arg_str0(NULL, "metric", "l1|l2|linf", "Manhattan, Euclidean (default) or chessboard"));
    a->algorithm = cli_add(args, arg_str0(NULL, "algorithm", "NAME", "auto (default), separable or brute-force; all are exact"));
    a->is_signed = cli_add(args, arg_lit0(NULL, "signed", "negative inside the solid"));
    a->squared = cli_add(args, arg_lit0(NULL, "squared", "squared Euclidean distances"));
    a->spacing =
        cli_add(args, arg_str0(NULL, "spacing", "N|X,Y,Z|file", "edges of a voxel, or the file's own; default voxel units"));
    a->max_distance = cli_add(args, arg_str0(NULL, "max-distance", "D", "greater distances become this"));
    a->outside = cli_add(args, arg_str0(NULL, "outside", "empty|solid", "what lies outside the grid; default empty"));
    a->threshold = cli_add(args, arg_str0(NULL, "threshold", "T", "a voxel is solid at this value or above; default: if not 0"));
    a->label = cli_add(args, arg_str0(NULL, "label", "N", "a voxel is solid at exactly this value"));
    a->type = cli_add(args, arg_str0(NULL, "type", "u8|u16|u32|f32", "type of the field (i8, i16, i32 if signed); default f32"));
    a->saturate = cli_add(args, arg_lit0(NULL, "saturate", "distances too great for the type become its largest value"));
    a->indices = cli_add(args, arg_str0(NULL, "indices", "FILE", "write the index of the nearest solid voxel too"));
    cli_device_add(args, &a->device);
    a->slice = cli_add(args, arg_str0(NULL, "slice", "FILE.png", "write a picture of the middle slice too"));
    a->format = cli_add(args, arg_str0(NULL, "format", "FORMAT", "write npy, raw, nrrd or nifti; default by name"));
    a->compress = cli_add(args, arg_lit0(NULL, "compress", "gzip; a name that ends in .gz asks for it too"));
    files_input_add(args, &a->input);
    a->quiet = cli_add(args, arg_lit0("q", "quiet", "print nothing but errors"));
    a->json = cli_add(args, arg_lit0(NULL, "json", "print the report as JSON"));
}

static const char *value_of(const struct arg_str *option) {
    return option->count ? option->sval[0] : NULL;
}

static bool distance_type(const char *text, bool is_signed, fm_type *type) {
    static const fm_type plain[] = {FM_TYPE_U8, FM_TYPE_U16, FM_TYPE_U32, FM_TYPE_F32};
    static const fm_type with_sign[] = {FM_TYPE_I8, FM_TYPE_I16, FM_TYPE_I32, FM_TYPE_F32};
    const fm_type *accepted = is_signed ? with_sign : plain;
    if (!cli_type("--type", text, type)) {
        return false;
    }
    for (int i = 0; i < 4; i++) {
        if (*type == accepted[i]) {
            return true;
        }
    }
    cli_usage("--type is \"%s\": %s field is wanted as %s", text, is_signed ? "a signed" : "an unsigned",
              is_signed ? "i8, i16, i32 or f32 (or leave --signed out)" : "u8, u16, u32 or f32 (or add --signed)");
    return false;
}

static bool read_words(const transform_args *a, transform_request *r) {
    static const char *const algorithms[] = {"auto", "separable", "brute-force", NULL};
    static const char *const outsides[] = {"empty", "solid", NULL};
    int metric = 0, algorithm = 0, outside = 0;
    if ((a->metric->count && !cli_word("--metric", a->metric->sval[0], fm_metric_words, &metric)) ||
        (a->algorithm->count && !cli_word("--algorithm", a->algorithm->sval[0], algorithms, &algorithm)) ||
        (a->outside->count && !cli_word("--outside", a->outside->sval[0], outsides, &outside)) ||
        !cli_device_read(&a->device, &r->context)) {
        return false;
    }
    r->desc.metric = (fm_metric)metric;
    r->desc.algorithm = (fm_algorithm)algorithm;
    r->desc.outside = (fm_outside)outside;
    return true;
}

static bool read_numbers(const transform_args *a, transform_request *r) {
    if (a->spacing->count) {
        r->file_spacing = strcmp(a->spacing->sval[0], "file") == 0;
        if (!r->file_spacing && !cli_triple("--spacing", a->spacing->sval[0], r->desc.spacing)) {
            return false;
        }
        for (int i = 0; i < 3 && !r->file_spacing; i++) {
            if (r->desc.spacing[i] <= 0) {
                cli_usage("--spacing is \"%s\": X,Y,Z or one number, all above 0, or the word file, are wanted",
                          a->spacing->sval[0]);
                return false;
            }
        }
    }
    if (a->max_distance->count) {
        if (!cli_double("--max-distance", a->max_distance->sval[0], &r->desc.max_distance)) {
            return false;
        }
        if (r->desc.max_distance <= 0) {
            cli_usage("--max-distance is %s: a number above 0 is wanted", a->max_distance->sval[0]);
            return false;
        }
    }
    if (a->threshold->count) {
        r->desc.select = FM_SELECT_THRESHOLD;
        if (!cli_double("--threshold", a->threshold->sval[0], &r->desc.threshold)) {
            return false;
        }
    }
    if (a->label->count) {
        r->desc.select = FM_SELECT_LABEL;
        if (!cli_int64("--label", a->label->sval[0], &r->desc.label)) {
            return false;
        }
    }
    return true;
}

// What contradicts itself whatever the file holds.
static bool check_combinations(const transform_args *a, const transform_request *r) {
    const char *wrong = NULL;
    if (a->threshold->count && a->label->count) {
        wrong = "--threshold and --label are both given: choose one";
    } else if (r->desc.squared && r->desc.metric != FM_METRIC_L2) {
        wrong = "--squared is given with another metric than l2: leave one of the two out";
    } else if (a->spacing->count && r->type != FM_TYPE_F32) {
        wrong = "--spacing is given with an integer --type: distances in world units need --type f32";
    } else if (files_same(r->out, r->indices) || files_same(r->out, r->slice) || files_same(r->indices, r->slice)) {
        wrong = "two outputs are the same file: give each its own name";
    } else if (r->slice && files_is_pipe(r->slice)) {
        wrong = "--slice is -: a picture needs a file name";
    }
    if (wrong) {
        cli_usage("%s", wrong);
    }
    return !wrong;
}

static bool read_request(const transform_args *a, transform_request *r) {
    *r = (transform_request){.in = a->in->sval[0], .out = a->out->sval[0], .type = FM_TYPE_F32};
    r->indices = value_of(a->indices);
    r->slice = value_of(a->slice);
    r->desc.is_signed = a->is_signed->count > 0;
    r->desc.squared = a->squared->count > 0;
    r->desc.saturate = a->saturate->count > 0;
    r->write.compress = a->compress->count > 0;
    r->quiet = a->quiet->count > 0;
    r->json = a->json->count > 0;
    return files_input_desc(&a->input, &r->read) && read_words(a, r) && read_numbers(a, r) &&
           (!a->format->count || cli_format("--format", a->format->sval[0], &r->write.format)) &&
           (!a->type->count || distance_type(a->type->sval[0], r->desc.is_signed, &r->type)) && check_combinations(a, r);
}

int command_transform(int argc, char **argv) {
    static const cli_help help = {
        "transform",
        "Computes the distance from every voxel to the nearest solid one, exactly. Solid voxels get 0.\n\n"
        "The report times each pass: \"encode\" makes a bit of each voxel, the passes named by axes carry the distances along\n"
        "those, and a signed field adds \"inside\" ones, from the solid voxels to the nearest empty one.",
        "fathom transform scene.vox field.npy --slice field.png\n"
        "fathom transform scan.nii.gz depth.nrrd --threshold 300 --signed --spacing file\n"
        "fathom transform labels.npy field.npy --label 17 --metric l1 --type u16 --indices nearest.npy\n"
        "fathom transform dump.bin field.npy --shape 512,512,300 --input-type u8 --type u8 --saturate --metric linf\n"
        "fathom transform - - < voxels.npy > field.npy\n"};
    cli_args args = {0};
    transform_args options;
    add_options(&args, &options);
    int status;
    if (cli_parse(&args, &help, argc, argv, &status)) {
        transform_request request;
        status = read_request(&options, &request) ? run(&request) : CLI_USAGE;
    }
    cli_free(&args);
    return status;
}
