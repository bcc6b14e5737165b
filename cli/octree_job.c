// SPDX-License-Identifier: MIT
#include "octree_job.h"
#include "progress.h"
#include "words.h"

#include <inttypes.h>
#include <math.h>
#include <string.h>
#include <strings.h>

// In the order of the enumerations.
const char *const octree_kind_words[] = {"closest", "distance", "voxels", "svo", "dag", "tree64", "bricks", NULL};
static const char *const kind_names[] = {"vectors to closest points",
                                         "signed distances",
                                         "voxels",
                                         "voxels with contours",
                                         "voxels, identical subtrees shared",
                                         "voxels in nodes of 4^3 children",
                                         "signed distances in bricks"};
static const char *const method_words[] = {"exact", "grown", NULL};
static const char *const code_words[] = {"spherical", "octahedral", "floats", "short", NULL};
static const char *const sign_words[] = {"auto", "pseudonormal", "winding", "none", NULL};
static const char *const attribute_words[] = {"none", "triangle", "color", "texture", NULL};
// Mesh files are read without colours and texture coordinates.
static const char *const offered_attributes[] = {"none", "triangle", NULL};

void octree_options_add(cli_args *args, octree_options *o, const char *cells, bool field) {
    static char kinds[256], text[320];
    snprintf(text, sizeof text, "%s%s; default closest; of voxels: voxels", cli_list(octree_kind_words, kinds),
             field ? "; or field: dense, of meshes, no octree" : "");
    o->field = field;
    o->kind = cli_add(args, arg_str0(NULL, "kind", "KIND", text));
    o->cells = cli_add(
        args, arg_str0(NULL, cells, "N",
                       field ? "--size of fathom octree build: finest cells along the longest edge of a mesh's box; default 256"
                             : "finest cells along the longest edge of a mesh's box; default 256"));
    o->box = cli_add(args, arg_str0(NULL, "box", "X0,Y0,Z0,X1,Y1,Z1", "of a mesh: what the octree covers; default: all of it"));
    o->method = cli_add(args, arg_str0(NULL, "method", "exact|grown", "how closest points are found; default exact"));
    o->rounds = cli_add(args, arg_str0(NULL, "rounds", "N", "of growing; default: enough"));
    o->code = cli_add(args, arg_str0(NULL, "code", "spherical|octahedral|floats|short", "how vectors are kept; default spherical"));
    o->band = cli_add(args, arg_str0(NULL, "band", "B",
                                     "leaves with values this near, in cells; default 3.46; 0.05 to "
                                     "0.2: thin, for rays alone"));
    o->threshold = cli_add(
        args,
        arg_str0(NULL, "threshold", "T",
                 "how far off merged leaves may be, in finest cells; default 0.05; below 0: none merge, and svo has no contours"));
    o->share = cli_add(args, arg_lit0(NULL, "share", "keep identical subtrees and leaves of closest and distance once"));
    o->top = cli_add(args, arg_str0(NULL, "top", "KIB", "of the top grid at most; default 1024, of voxels 2"));
    o->sign = cli_add(args, arg_str0(NULL, "sign", "SIGN",
                                     "of distances: auto (default), pseudonormal, winding or none, the fastest of open meshes"));
    o->attribute = cli_add(
        args, arg_str0(NULL, "attribute", "none|triangle", "kept with each vector or, of a mesh, voxel (not dag); default none"));
    o->solid = cli_add(args, arg_str0(NULL, "solid", "T", "of voxels: solid at this value or above; default: if not 0"));
    mesh_input_add_turns(args, &o->mesh);
    cli_device_add(args, &o->device);
    files_input_add(args, &o->input);
    o->quiet = cli_add(args, arg_lit0("q", "quiet", "print nothing but errors and what is asked for"));
}

static bool of_voxels(const char *in) {
    return fm_mesh_format_of(in) == FM_MESH_FORMAT_AUTO && !files_is_octree(in);
}

static bool read_kind(const octree_options *o, octree_job *job) {
    const char *word = cli_given(o->kind, of_voxels(job->in) ? "voxels" : "closest");
    int kind = FM_OCTREE_BRICKS;
    job->field = o->field && strcasecmp(word, "field") == 0;
    if (!job->field && !cli_word("--kind", word, octree_kind_words, &kind)) {
        return false;
    }
    job->desc.kind = (fm_octree_kind)kind;
    return true;
}

static bool read_words(const octree_options *o, octree_job *job) {
    int method = 0, code = 0, sign = 0, attribute = 0;
    if (!read_kind(o, job) || !cli_word("--method", cli_given(o->method, "exact"), method_words, &method) ||
        !cli_word("--code", cli_given(o->code, "spherical"), code_words, &code) ||
        !cli_word("--sign", cli_given(o->sign, "auto"), sign_words, &sign) ||
        !cli_word("--attribute", cli_given(o->attribute, "none"), offered_attributes, &attribute) ||
        !cli_device_read(&o->device, &job->wanted) || !mesh_input_options_read(&o->mesh, &job->mesh_in)) {
        return false;
    }
    job->desc.method = (fm_octree_method)method;
    job->desc.code = (fm_octree_code)code;
    job->desc.sign = (fm_sign)sign;
    job->desc.attribute = (fm_octree_attribute)attribute;
    job->desc.share = o->share->count > 0;
    job->quiet = job->mesh_in.quiet = o->quiet->count > 0;
    return true;
}

static bool read_box(const octree_options *o, octree_job *job) {
    double box[6];
    job->boxed = o->box->count > 0;
    if (!job->boxed) {
        return true;
    }
    if (!cli_box("--box", o->box->sval[0], box)) {
        return false;
    }
    for (int axis = 0; axis < 3; axis++) {
        job->desc.low[axis] = (float)box[axis];
        job->desc.high[axis] = (float)box[3 + axis];
    }
    return true;
}

static bool read_numbers(const octree_options *o, const char *cells, octree_job *job) {
    char name[32];
    uint32_t top = 0;
    double threshold = 0, band = 0;
    snprintf(name, sizeof name, "--%s", cells);
    job->solid = (double)NAN;
    if ((o->cells->count && !cli_uint32(name, o->cells->sval[0], 1, &job->desc.size)) ||
        (o->rounds->count && !cli_uint32("--rounds", o->rounds->sval[0], 1, &job->desc.rounds)) ||
        (o->top->count && !cli_uint32("--top", o->top->sval[0], 1, &top)) ||
        (o->threshold->count && !cli_double("--threshold", o->threshold->sval[0], &threshold)) ||
        (o->band->count && !cli_double("--band", o->band->sval[0], &band)) ||
        (o->solid->count && !cli_double("--solid", o->solid->sval[0], &job->solid)) || !read_box(o, job)) {
        return false;
    }
    if (job->desc.size > 1 << 20) {
        cli_usage("%s is %u: at most %d is wanted", name, job->desc.size, 1 << 20);
        return false;
    }
    if (o->band->count && !(band >= 0.05 && band <= 3.5)) {
        cli_usage("--band is %g: 0.05 to 3.5 is wanted", band);
        return false;
    }
    if (o->threshold->count && threshold == 0) {
        cli_usage("--threshold is 0: a number above 0 is wanted, or one below 0 for no merging at all");
        return false;
    }
    job->desc.threshold = (float)threshold;
    job->desc.band = (float)band;
    job->desc.top_bytes = 1024ull * top;
    return true;
}

static bool has_voxels(fm_octree_kind kind) {
    return kind == FM_OCTREE_VOXELS || kind == FM_OCTREE_CONTOURS || kind == FM_OCTREE_DAG || kind == FM_OCTREE_TREE64;
}

// What options of kinds are of no effect with this one; NULL: none.
static const char *wrong_kind(const octree_options *o, const octree_job *job) {
    const fm_octree_kind kind = job->desc.kind;
    const bool vectors = kind == FM_OCTREE_CLOSEST, leaves = vectors || kind == FM_OCTREE_DISTANCE;
    if (o->code->count && !vectors) {
        return "--code is of vectors: --kind closest has them";
    }
    if (job->desc.attribute != FM_OCTREE_PLAIN && !vectors && (!has_voxels(kind) || kind == FM_OCTREE_DAG)) {
        return "--attribute is of --kind closest, voxels, svo and tree64: others keep none";
    }
    if (job->desc.code == FM_OCTREE_SHORT && !(job->desc.band > 0 && job->desc.band <= 0.2f)) {
        return "--code short is of thin octrees: --band from 0.05 to 0.2 is wanted";
    }
    if (o->threshold->count && !leaves && !(kind == FM_OCTREE_CONTOURS && job->desc.threshold < 0)) {
        return "--threshold is of --kind closest and distance; below 0, for no contours, of svo";
    }
    if ((o->method->count || o->band->count || o->share->count) && !leaves) {
        return "--method, --band and --share are of --kind closest and distance";
    }
    if (o->rounds->count && job->desc.method != FM_OCTREE_GROWN) {
        return "--rounds is of --method grown";
    }
    if (o->sign->count && kind != FM_OCTREE_DISTANCE && kind != FM_OCTREE_BRICKS) {
        return "--sign is of --kind distance and bricks";
    }
    return job->field && o->top->count ? "--top is of octrees, not of --kind field" : NULL;
}

// The same of what the octree is made of.
static const char *wrong_input(const octree_options *o, const octree_job *job) {
    const files_input *raw = &o->input;
    const bool mesh = fm_mesh_format_of(job->in) != FM_MESH_FORMAT_AUTO;
    if (!mesh && (o->mesh.up->count || o->mesh.flip->count)) {
        return "--up and --flip are of meshes: voxels, and octrees in files, lie as they lie";
    }
    if (mesh && (o->solid->count || raw->format->count || raw->shape->count || raw->hidden->count)) {
        return "--solid, --input-format, --shape and --include-hidden are of voxels, not of meshes";
    }
    if (!of_voxels(job->in)) {
        return NULL;
    }
    if (job->field) {
        return "--kind field is of meshes: fathom render draws voxels by their field";
    }
    if (!has_voxels(job->desc.kind)) {
        return "--kind closest, distance and bricks are of meshes: of voxels, voxels, svo, dag and tree64 are made";
    }
    if (o->cells->count || job->boxed || o->attribute->count) {
        return "the number of cells, --box and --attribute are of meshes: voxels have their own";
    }
    return NULL;
}

// An option that would be of no effect is more likely a mistake.
static bool check_combinations(const octree_options *o, const octree_job *job) {
    const char *wrong = wrong_input(o, job);
    wrong = wrong ? wrong : wrong_kind(o, job);
    if (wrong) {
        cli_usage("%s", wrong);
    }
    return !wrong;
}

bool octree_options_read(const octree_options *o, const char *cells, const char *in, octree_job *job) {
    *job = (octree_job){.in = in, .mesh_in = {.path = in}};
    return read_words(o, job) && read_numbers(o, cells, job) && files_input_desc(&o->input, &job->read) &&
           check_combinations(o, job);
}

int octree_job_begin(octree_job *job) {
    if (fm_context_create(&job->wanted, &job->context) != FM_OK) {
        return cli_library_failed();
    }
    fm_context_device(job->context, &job->device);
    return CLI_DONE;
}

// 1 where the value is at the threshold or above, else 0.
static int keep_solid(octree_job *job, fm_volume **volume) {
    fm_volume_desc desc;
    fm_volume_info(*volume, &desc);
    const fm_array values = {fm_volume_data(*volume), desc.type, desc.shape};
    desc.type = FM_TYPE_U8;
    fm_volume *solid = NULL;
    const fm_transform_desc select = {
        .metric = FM_METRIC_LINF, .select = FM_SELECT_THRESHOLD, .threshold = job->solid, .max_distance = 1};
    if (fm_volume_create(NULL, &desc, &solid) != FM_OK) {
        return cli_library_failed();
    }
    uint8_t *kept = fm_volume_data(solid);
    if (fm_transform_host(job->context, &select, &values, &(fm_array){kept, FM_TYPE_U8, desc.shape}, NULL) != FM_OK) {
        fm_volume_destroy(solid);
        return cli_library_failed();
    }
    const uint64_t voxels = (uint64_t)desc.shape.x * desc.shape.y * desc.shape.z;
    for (uint64_t i = 0; i < voxels; i++) {
        kept[i] = kept[i] == 0;
    }
    fm_volume_destroy(*volume);
    *volume = solid;
    return CLI_DONE;
}

static int read_voxels(octree_job *job) {
    fm_volume *volume = NULL;
    fm_file_info file;
    int status = files_read(job->in, &job->read, job->quiet, &volume, &file);
    if (status != CLI_DONE) {
        return status;
    }
    if (!isnan(job->solid)) {
        status = keep_solid(job, &volume);
    }
    const fm_world_desc desc = {.shape = file.shape};
    if (status == CLI_DONE &&
        (fm_world_create(job->context, &desc, &job->world) != FM_OK || fm_world_load(job->world, volume) != FM_OK)) {
        status = cli_library_failed();
    }
    fm_volume_destroy(volume);
    return status;
}

int octree_job_source(octree_job *job) {
    if (files_is_octree(job->in)) {
        return files_tell_octree(job->in, "a mesh or a volume");
    }
    if (of_voxels(job->in)) {
        return read_voxels(job);
    }
    return mesh_input_load(&job->mesh_in, job->context, &job->mesh, NULL);
}

static uint64_t leaves_of(const fm_octree_info *info) {
    uint64_t leaves = 0;
    for (size_t level = 0; level < sizeof info->leaves / sizeof info->leaves[0]; level++) {
        leaves += info->leaves[level];
    }
    return leaves;
}

void octree_job_look_for_leaves(const octree_job *job, const fm_octree_info *info) {
    if (leaves_of(info) == 0 && !job->quiet) {
        fprintf(stderr, "fathom: nothing of %s is in the octree%s\n", job->in, job->boxed ? ": does --box miss it?" : "");
    }
}

int octree_job_build(octree_job *job) {
    const double started = fm_now_ms();
    progress line = progress_wait("building", !job->quiet);
    const fm_result result = job->mesh ? fm_octree_build_mesh(job->mesh, &job->desc, &job->octree)
                                       : fm_octree_build_world(job->world, &job->desc, &job->octree);
    progress_end(&line);
    job->wall_ms = fm_now_ms() - started;
    if (result != FM_OK) {
        return cli_library_failed();
    }
    fm_octree_describe(job->octree, &job->info);
    octree_job_look_for_leaves(job, &job->info);
    return CLI_DONE;
}

void octree_job_end(octree_job *job) {
    fm_octree_destroy(job->octree);
    fm_world_destroy(job->world);
    fm_mesh_destroy(job->mesh);
    fm_context_destroy(job->context);
}

static bool of_corners(const fm_octree_info *info) {
    return info->kind == FM_OCTREE_CLOSEST || info->kind == FM_OCTREE_DISTANCE;
}

void octree_text(FILE *stream, const fm_octree_info *info) {
    char nodes[32], values[32], attributes[32], alone[32];
    const uint64_t bytes = info->node_bytes + info->leaf_bytes + info->attribute_bytes;
    fprintf(stream, "    kind        %s: %s", octree_kind_words[info->kind], kind_names[info->kind]);
    if (info->kind == FM_OCTREE_CLOSEST) {
        fprintf(stream, ", %s code", code_words[info->code]);
    }
    if (of_corners(info)) {
        fprintf(stream, ", %s", method_words[info->method]);
    }
    if (info->kind == FM_OCTREE_DISTANCE || info->kind == FM_OCTREE_BRICKS) {
        fprintf(stream, ", sign: %s", sign_words[info->sign]);
    }
    fprintf(stream, "\n    box         %g, %g, %g to %g, %g, %g\n", (double)info->low[0], (double)info->low[1],
            (double)info->low[2], (double)info->high[0], (double)info->high[1], (double)info->high[2]);
    fprintf(stream, "    cells       %u x %u x %u of %.6g, from %.6g, %.6g, %.6g\n", info->cells[0], info->cells[1], info->cells[2],
            info->cell, info->origin[0], info->origin[1], info->origin[2]);
    fprintf(stream, "    top grid    %u x %u x %u of level %u\n", info->top[0], info->top[1], info->top[2], info->levels);
    fprintf(stream, "    nodes       %" PRIu64 " with children, %" PRIu64 " empty\n    leaves      %" PRIu64, info->internal,
            info->empty, leaves_of(info));
    for (int level = 0; level < 24; level++) {
        if (info->leaves[level] > 0) {
            fprintf(stream, ", level %d: %" PRIu64, level, info->leaves[level]);
        }
    }
    fprintf(stream, "\n    memory      nodes %s, leaves %s", cli_bytes(info->node_bytes, nodes),
            cli_bytes(info->leaf_bytes, values));
    if (info->attribute_bytes > 0) {
        fprintf(stream, ", %s %s", attribute_words[info->attribute], cli_bytes(info->attribute_bytes, attributes));
    }
    if (info->shared && bytes > 0) {
        fprintf(stream, "; without sharing %s, %.2f times as much", cli_bytes(info->unshared_bytes, alone),
                (double)info->unshared_bytes / (double)bytes);
    }
    fprintf(stream, "\n");
    if (info->kind == FM_OCTREE_CLOSEST) {
        fprintf(stream, "    code error  %.3g cells, 99th percentile\n", info->code_error);
    }
}

void octree_json(cJSON *root, const fm_octree_info *info) {
    cJSON_AddStringToObject(root, "kind", octree_kind_words[info->kind]);
    cJSON_AddStringToObject(root, "method", method_words[info->method]);
    cJSON_AddStringToObject(root, "code", code_words[info->code]);
    cJSON_AddStringToObject(root, "attribute", attribute_words[info->attribute]);
    cJSON_AddStringToObject(root, "sign", sign_words[info->sign]);
    cJSON_AddBoolToObject(root, "shared", info->shared);
    cJSON_AddItemToObject(root, "low", cJSON_CreateFloatArray(info->low, 3));
    cJSON_AddItemToObject(root, "high", cJSON_CreateFloatArray(info->high, 3));
    cJSON_AddItemToObject(root, "origin", cJSON_CreateDoubleArray(info->origin, 3));
    cJSON_AddNumberToObject(root, "cell", info->cell);
    cJSON_AddItemToObject(root, "cells", report_shape_json((fm_shape){info->cells[0], info->cells[1], info->cells[2]}));
    cJSON_AddItemToObject(root, "top", report_shape_json((fm_shape){info->top[0], info->top[1], info->top[2]}));
    cJSON_AddNumberToObject(root, "levels", info->levels);
    cJSON_AddNumberToObject(root, "internal", (double)info->internal);
    cJSON_AddNumberToObject(root, "empty", (double)info->empty);
    cJSON_AddNumberToObject(root, "leaves", (double)leaves_of(info));
    cJSON *levels = cJSON_AddArrayToObject(root, "leaves_of_levels");
    for (uint32_t level = 0; level <= info->levels && level < 24; level++) {
        cJSON_AddItemToArray(levels, cJSON_CreateNumber((double)info->leaves[level]));
    }
    cJSON_AddNumberToObject(root, "node_bytes", (double)info->node_bytes);
    cJSON_AddNumberToObject(root, "leaf_bytes", (double)info->leaf_bytes);
    cJSON_AddNumberToObject(root, "attribute_bytes", (double)info->attribute_bytes);
    cJSON_AddNumberToObject(root, "unshared_bytes", (double)info->unshared_bytes);
    cJSON_AddNumberToObject(root, "code_error", info->code_error);
    cJSON_AddNumberToObject(root, "parts", info->parts);
}

void octree_parts_text(FILE *stream, const fm_octree_parts_info *info) {
    char bytes[32];
    const uint32_t most = info->along[0] * info->along[1] * info->along[2];
    fprintf(stream,
            "    parts       %u x %u x %u of %u cells of %.6g along their edges; %u of %u hold some of the surface, %s;\n"
            "                what is above is of the coarse octree\n",
            info->along[0], info->along[1], info->along[2], info->cells, info->cell, info->filled, most,
            cli_bytes(info->bytes, bytes));
}

void octree_parts_json(cJSON *root, const fm_octree_parts_info *info) {
    cJSON_AddItemToObject(root, "parts_along", report_shape_json((fm_shape){info->along[0], info->along[1], info->along[2]}));
    cJSON_AddNumberToObject(root, "parts_filled", info->filled);
    cJSON_AddNumberToObject(root, "part_cells", info->cells);
    cJSON_AddNumberToObject(root, "part_cell", info->cell);
    cJSON_AddNumberToObject(root, "part_bytes", (double)info->bytes);
}
