// SPDX-License-Identifier: MIT
#include "world_report.h"

#include "files.h"
#include "report.h"
#include "tables.h"
#include "words.h"

#include <inttypes.h>

static void print_errors(FILE *stream, const char *against, const bench_world_errors *errors) {
    if (errors->compared) {
        fprintf(stream,
                "against the exact field of %s: %" PRIu64 " voxels, %" PRIu64 " too far (by at most %g), %" PRIu64
                " too near (by at most %g)\n",
                against, errors->compared, errors->above, errors->most_above, errors->below, errors->most_below);
    }
}

static void print_places(FILE *stream, const world_request *request, const world_outcome *outcome) {
    for (uint32_t i = 0; i < request->place_count; i++) {
        const float *place = request->places[i];
        const fm_world_sample *sample = &outcome->samples[i];
        fprintf(stream, "at %g,%g,%g: distance %g, gradient %g,%g,%g\n", (double)place[0], (double)place[1], (double)place[2],
                (double)sample->distance, (double)sample->gradient[0], (double)sample->gradient[1], (double)sample->gradient[2]);
    }
}

static void print_method(FILE *stream, const world_request *request) {
    const fm_world_method *method = &request->desc.method;
    fprintf(stream, "field: %s, %s", fm_field_format_words[request->desc.format], fm_world_algorithm_words[method->algorithm]);
    if (method->algorithm == FM_WORLD_SELECTIVE) {
        fprintf(stream, " (%s near the focus, %s elsewhere)", fm_world_algorithm_words[method->near_algorithm],
                fm_world_algorithm_words[method->far_algorithm]);
    }
    if (method->chunk) {
        fprintf(stream, ", chunks of %u, %s", method->chunk, fm_world_border_words[method->border]);
    }
    fprintf(stream, "\n");
}

static const char *start_name(const world_request *request) {
    return request->in ? request->in : request->scene ? fm_scene_name(request->scene) : "air";
}

static void report_text(FILE *stream, const world_request *request, const world_outcome *outcome) {
    const fm_shape shape = request->desc.shape;
    const fm_world_stats *stats = &outcome->stats;
    char text[32];
    fprintf(stream, "%s: %u x %u x %u\n", start_name(request), shape.x, shape.y, shape.z);
    fprintf(stream, "backend: %s, %s (%s)\n", fm_backend_words[outcome->backend], outcome->device.name, outcome->device.driver);
    print_method(stream, request);
    fprintf(stream, "%u edits in %u updates, %.3f ms of wall time in all; the newest update:\n\n", outcome->edits, outcome->updates,
            outcome->wall_ms);
    report_passes(stream, outcome->passes, outcome->pass_count);
    fprintf(stream,
            "\nrows %" PRIu64 ", tiles along y %" PRIu64 ", along z %" PRIu64 ", chunks %" PRIu64 ", iterations %" PRIu64 "%s\n",
            stats->rows, stats->tiles_y, stats->tiles_z, stats->chunks, stats->iterations,
            stats->full ? "; everything was regenerated" : "");
    for (uint32_t i = 0; i < outcome->memory_count; i++) {
        const fm_memory *memory = &outcome->memory[i];
        if (memory->bytes) {
            fprintf(stream, "%s memory for %s: %s\n", memory->device ? "device" : "host", memory->purpose,
                    cli_bytes(memory->bytes, text));
        }
    }
    print_errors(stream, "the world", &outcome->whole);
    print_errors(stream, "what each chunk sees", &outcome->domain);
    print_places(stream, request, outcome);
    const char *const outputs[] = {request->voxels, request->field};
    static const char *const what[] = {"voxels", "distances"};
    for (int i = 0; i < 2; i++) {
        if (outputs[i]) {
            fprintf(stream, "%s: %s\n", files_is_pipe(outputs[i]) ? "standard output" : outputs[i], what[i]);
        }
    }
    if (request->slice) {
        fprintf(stream, "%s: middle slice of the distances, values %g to %g\n", request->slice, outcome->slice.min,
                outcome->slice.max);
    }
}

static void add_errors(cJSON *root, const char *name, const bench_world_errors *errors) {
    if (errors->compared) {
        cJSON *object = cJSON_AddObjectToObject(root, name);
        cJSON_AddNumberToObject(object, "compared", (double)errors->compared);
        cJSON_AddNumberToObject(object, "above", (double)errors->above);
        cJSON_AddNumberToObject(object, "below", (double)errors->below);
        cJSON_AddNumberToObject(object, "max_above", errors->most_above);
        cJSON_AddNumberToObject(object, "max_below", errors->most_below);
    }
}

static void add_method(cJSON *root, const world_request *request) {
    const fm_world_method *method = &request->desc.method;
    cJSON_AddStringToObject(root, "format", fm_field_format_words[request->desc.format]);
    cJSON_AddStringToObject(root, "algorithm", fm_world_algorithm_words[method->algorithm]);
    cJSON_AddNumberToObject(root, "chunk", method->chunk);
    cJSON_AddStringToObject(root, "border", fm_world_border_words[method->border]);
    cJSON_AddStringToObject(root, "convergence", fm_world_convergence_words[method->convergence]);
    if (method->algorithm == FM_WORLD_SELECTIVE) {
        cJSON_AddStringToObject(root, "near", fm_world_algorithm_words[method->near_algorithm]);
        cJSON_AddStringToObject(root, "far", fm_world_algorithm_words[method->far_algorithm]);
        cJSON_AddNumberToObject(root, "focus_chunks", method->focus_chunks);
    }
}

static void add_places(cJSON *root, const world_request *request, const world_outcome *outcome) {
    cJSON *array = cJSON_AddArrayToObject(root, "queries");
    for (uint32_t i = 0; i < request->place_count; i++) {
        cJSON *row = cJSON_CreateObject();
        cJSON_AddItemToObject(row, "at", cJSON_CreateFloatArray(request->places[i], 3));
        cJSON_AddNumberToObject(row, "distance", (double)outcome->samples[i].distance);
        cJSON_AddItemToObject(row, "gradient", cJSON_CreateFloatArray(outcome->samples[i].gradient, 3));
        cJSON_AddItemToArray(array, row);
    }
}

static void add_outputs(cJSON *root, const world_request *request, const world_outcome *outcome) {
    if (request->voxels) {
        cJSON_AddStringToObject(root, "voxels", request->voxels);
    }
    if (request->field) {
        cJSON_AddStringToObject(root, "field", request->field);
    }
    if (request->slice) {
        cJSON *slice = cJSON_AddObjectToObject(root, "slice");
        cJSON_AddStringToObject(slice, "file", request->slice);
        cJSON_AddNumberToObject(slice, "min", outcome->slice.min);
        cJSON_AddNumberToObject(slice, "max", outcome->slice.max);
    }
}

static bool print_json(FILE *stream, const world_request *request, const world_outcome *outcome) {
    const fm_world_stats *stats = &outcome->stats;
    cJSON *root = cJSON_CreateObject();
    cJSON_AddStringToObject(root, "start", start_name(request));
    cJSON_AddItemToObject(root, "shape", report_shape_json(request->desc.shape));
    add_method(root, request);
    cJSON_AddStringToObject(root, "backend", fm_backend_words[outcome->backend]);
    cJSON_AddItemToObject(root, "device", report_device_json(&outcome->device));
    cJSON_AddNumberToObject(root, "edits", outcome->edits);
    cJSON_AddNumberToObject(root, "updates", outcome->updates);
    cJSON_AddNumberToObject(root, "wall_milliseconds", outcome->wall_ms);
    cJSON_AddItemToObject(root, "passes", report_passes_json(outcome->passes, outcome->pass_count));
    cJSON_AddNumberToObject(root, "rows", (double)stats->rows);
    cJSON_AddNumberToObject(root, "tiles_y", (double)stats->tiles_y);
    cJSON_AddNumberToObject(root, "tiles_z", (double)stats->tiles_z);
    cJSON_AddNumberToObject(root, "chunks", (double)stats->chunks);
    cJSON_AddNumberToObject(root, "iterations", (double)stats->iterations);
    cJSON_AddBoolToObject(root, "full", stats->full);
    cJSON_AddItemToObject(root, "memory", bench_memory_json(outcome->memory, outcome->memory_count));
    add_errors(root, "errors", &outcome->whole);
    add_errors(root, "errors_of_chunks", &outcome->domain);
    add_places(root, request, outcome);
    add_outputs(root, request, outcome);
    return report_json(stream, root);
}

int world_report(const world_request *request, const world_outcome *outcome) {
    // What is printed must not get between the bytes of a file.
    const bool piped = (request->voxels && files_is_pipe(request->voxels)) || (request->field && files_is_pipe(request->field));
    FILE *stream = piped ? stderr : stdout;
    if (request->json) {
        return print_json(stream, request, outcome) ? CLI_DONE : cli_fail("out of memory for the report: free some");
    }
    if (!request->quiet) {
        report_text(stream, request, outcome);
    } else {
        print_places(stream, request, outcome);
    }
    return CLI_DONE;
}
