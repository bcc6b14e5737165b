// SPDX-License-Identifier: MIT
#include "mesh_input.h"

#include "files.h"
#include "progress.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

const char *const mesh_sign_words[] = {"auto", "pseudonormal", "winding", "none", NULL};

void mesh_input_add(cli_args *args, mesh_input_options *o) {
    o->format =
        cli_add(args, arg_str0(NULL, "input-format", "FORMAT", "read as ply, obj, stl, gltf or glb; default by what it holds"));
    struct arg_str *const format = o->format;
    mesh_input_add_turns(args, o);
    o->format = format;
}

void mesh_input_add_turns(cli_args *args, mesh_input_options *o) {
    o->format = NULL;
    o->up = cli_add(args,
                    arg_str0(NULL, "up", "y|z", "which axis of a mesh points up: y turns it, (x, y, z) to (x, -z, y); default z"));
    o->flip = cli_add(args, arg_lit0(NULL, "flip", "turn the faces over, of a mesh that looks inwards"));
}

bool mesh_input_format(const char *word, fm_mesh_format *format) {
    static const struct {
        const char *word;
        fm_mesh_format format;
    } known[] = {{"ply", FM_MESH_FORMAT_PLY},
                 {"obj", FM_MESH_FORMAT_OBJ},
                 {"stl", FM_MESH_FORMAT_STL},
                 {"gltf", FM_MESH_FORMAT_GLTF},
                 {"glb", FM_MESH_FORMAT_GLTF}};
    for (size_t i = 0; i < sizeof known / sizeof known[0]; i++) {
        if (strcasecmp(word, known[i].word) == 0) {
            *format = known[i].format;
            return true;
        }
    }
    return false;
}

bool mesh_input_options_read(const mesh_input_options *o, mesh_input *input) {
    static const char *const up_words[] = {"z", "y", NULL};
    int up = 0;
    if (o->format && o->format->count && !mesh_input_format(o->format->sval[0], &input->format)) {
        cli_usage("--input-format is \"%s\": one of ply, obj, stl, gltf, glb is wanted", o->format->sval[0]);
        return false;
    }
    if (!cli_word("--up", cli_given(o->up, "z"), up_words, &up)) {
        return false;
    }
    input->y_up = up == 1;
    input->flip = o->flip->count > 0;
    return true;
}

typedef struct arrays {
    float (*vertices)[3];
    uint32_t (*triangles)[3];
    uint64_t vertex_count, triangle_count;
} arrays;

static void find_box(const arrays *a, double low[3], double high[3]) {
    for (int i = 0; i < 3; i++) {
        low[i] = INFINITY;
        high[i] = -INFINITY;
    }
    for (uint64_t v = 0; v < a->vertex_count; v++) {
        const float *at = a->vertices[v];
        if (isfinite(at[0]) && isfinite(at[1]) && isfinite(at[2])) {
            for (int i = 0; i < 3; i++) {
                low[i] = fmin(low[i], (double)at[i]);
                high[i] = fmax(high[i], (double)at[i]);
            }
        }
    }
}

// A box under the mesh, a hair below it, so that nothing touches.
static void lay_floor(arrays *a, const double low[3], const double high[3]) {
    static const uint32_t faces[12][3] = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                                          {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
    const double longest = fmax(high[0] - low[0], fmax(high[1] - low[1], high[2] - low[2]));
    const double beside = 0.6 * longest, top = low[2] - 1e-4 * longest, bottom = top - 0.08 * longest;
    for (int i = 0; i < 12; i++) {
        for (int k = 0; k < 3; k++) {
            a->triangles[a->triangle_count][k] = (uint32_t)a->vertex_count + faces[i][k];
        }
        a->triangle_count++;
    }
    for (int i = 0; i < 8; i++) {
        float *at = a->vertices[a->vertex_count++];
        at[0] = (float)(i & 1 ? high[0] + beside : low[0] - beside);
        at[1] = (float)(i >> 1 & 1 ? high[1] + beside : low[1] - beside);
        at[2] = (float)(i >> 2 ? top : bottom);
    }
}

static void copy_turned(const mesh_input *input, const float (*vertices)[3], const uint32_t (*triangles)[3], arrays *a) {
    for (uint64_t i = 0; i < a->vertex_count; i++) {
        const float *from = vertices[i];
        a->vertices[i][0] = from[0];
        a->vertices[i][1] = input->y_up ? -from[2] : from[1];
        a->vertices[i][2] = input->y_up ? from[1] : from[2];
    }
    for (uint64_t i = 0; i < a->triangle_count; i++) {
        a->triangles[i][0] = triangles[i][0];
        a->triangles[i][1] = triangles[i][input->flip ? 2 : 1];
        a->triangles[i][2] = triangles[i][input->flip ? 1 : 2];
    }
}

// Returns an exit code.
static int change(mesh_input *input, fm_context *context, fm_mesh **mesh) {
    enum { FLOOR_VERTICES = 8, FLOOR_TRIANGLES = 12 };
    const float(*vertices)[3];
    const uint32_t(*triangles)[3];
    arrays a;
    fm_mesh_arrays(*mesh, &vertices, &a.vertex_count, &triangles, &a.triangle_count);
    a.vertices = malloc((a.vertex_count + FLOOR_VERTICES) * sizeof *a.vertices);
    a.triangles = malloc((a.triangle_count + FLOOR_TRIANGLES) * sizeof *a.triangles);
    const bool good = a.vertices && a.triangles;
    int status = good ? CLI_DONE : cli_fail("out of memory for a copy of the mesh: free some");
    if (good) {
        copy_turned(input, vertices, triangles, &a);
        find_box(&a, input->low, input->high);
        if (input->floor && input->low[0] <= input->high[0]) {
            lay_floor(&a, input->low, input->high);
        }
        const fm_mesh_desc desc = {(const float(*)[3])a.vertices, a.vertex_count, (const uint32_t(*)[3])a.triangles,
                                   a.triangle_count};
        fm_mesh *changed = NULL;
        if (fm_mesh_create(context, &desc, &changed) == FM_OK) {
            fm_mesh_destroy(*mesh);
            *mesh = changed;
        } else {
            status = cli_library_failed();
        }
    }
    free(a.vertices);
    free(a.triangles);
    return status;
}

int mesh_input_load(mesh_input *input, fm_context *context, fm_mesh **mesh, fm_mesh_file_info *info) {
    progress bar = progress_begin("reading", !input->quiet);
    const fm_mesh_read_desc desc = {.format = input->format, .progress = progress_step, .progress_user = &bar};
    const fm_result result = fm_mesh_read(context, input->path, &desc, mesh, info);
    progress_end(&bar);
    if (result != FM_OK) {
        const bool octree = input->format == FM_MESH_FORMAT_AUTO && files_is_octree(input->path);
        return octree ? files_tell_octree(input->path, "a mesh") : cli_library_failed();
    }
    return input->y_up || input->flip || input->floor ? change(input, context, mesh) : CLI_DONE;
}

static fm_result least_of(fm_volume *field, double *least) {
    fm_volume_desc about;
    fm_volume_info(field, &about);
    const uint64_t count = (uint64_t)about.shape.x * about.shape.y * about.shape.z;
    float *copy = about.storage == FM_STORAGE_DEVICE ? malloc(count * sizeof *copy) : NULL;
    const float *texels = copy ? copy : fm_volume_data(field);
    fm_result result = texels ? FM_OK : FM_ERROR_OUT_OF_HOST_MEMORY;
    if (copy) {
        result = fm_volume_download(field, copy);
    }
    *least = INFINITY;
    for (uint64_t i = 0; i < count && result == FM_OK; i++) {
        *least = fmin(*least, (double)texels[i]);
    }
    free(copy);
    return result;
}

fm_result mesh_input_note(fm_mesh *mesh, fm_volume *field, fm_sign sign, double level, char note[MESH_NOTE]) {
    fm_mesh_info info;
    note[0] = '\0';
    fm_result result = fm_mesh_describe(mesh, &info);
    if (result != FM_OK || info.triangles == info.dropped || sign == FM_SIGN_NONE) {
        return result;
    }
    if (info.closed && info.volume < 0) {
        snprintf(note, MESH_NOTE, "the mesh's faces look inwards, so that inside and outside are swapped: --flip turns them over");
    } else if (!info.closed) {
        double least;
        result = least_of(field, &least);
        if (result == FM_OK && least >= level) {
            snprintf(note, MESH_NOTE,
                     "the mesh is not closed, and nothing of the field is inside it: fathom render --surface mesh shows its "
                     "triangles, --sign pseudonormal takes the side of the nearest, --flip turns faces that look inwards");
        }
    }
    return result;
}
