// SPDX-License-Identifier: MIT
// fathom info of a mesh: what its triangles are.

#include "mesh_info.h"

#include "cli.h"
#include "mesh_input.h"
#include "report.h"

#include <inttypes.h>

static void print_mesh(const char *path, const fm_mesh_file_info *file, const fm_mesh_info *info, uint64_t pairs) {
    char text[32];
    printf("%s\n", path);
    printf("    format        %s%s%s%s\n", fm_mesh_format_name(file->format), file->binary ? ", binary" : "",
           file->big_endian ? ", big-endian" : "", file->compressed ? ", gzipped" : "");
    printf("    file          %s\n", cli_bytes(file->file_bytes, text));
    printf("    triangles     %" PRIu64, info->triangles);
    if (file->faces != info->triangles) {
        printf(", of %" PRIu64 " faces", file->faces);
    }
    printf("\n    vertices      %" PRIu64 ": %" PRIu64 " places of corners, %" PRIu64 " in no triangle\n", info->vertices,
           info->distinct, info->unused);
    if (info->triangles > info->dropped) {
        printf("    box           %g, %g, %g to %g, %g, %g\n", (double)info->low[0], (double)info->low[1], (double)info->low[2],
               (double)info->high[0], (double)info->high[1], (double)info->high[2]);
        printf("    area          %.9g\n", info->area);
    }
    if (info->closed) {
        printf("    volume        %.9g%s\n", info->volume, info->volume < 0 ? ": its faces look inwards" : "");
    }
    printf("    surface       %s, %" PRIu64 " %s\n", info->closed ? "closed" : "not closed", info->components,
           info->components == 1 ? "component" : "components");
    printf("    edges         %" PRIu64 " at a boundary, %" PRIu64 " of more than two triangles, %" PRIu64 " misoriented\n",
           info->boundary, info->non_manifold, info->misoriented);
    printf("    degenerate    %" PRIu64 "\n    duplicate     %" PRIu64 "\n", info->degenerate, info->duplicate);
    if (info->dropped > 0) {
        printf("    left out      %" PRIu64 " triangles with a coordinate that is not finite or above 1e18\n", info->dropped);
    }
    printf("    intersections %" PRIu64 " pairs of triangles\n", pairs);
    if (file->note[0]) {
        printf("    note          %s\n", file->note);
    }
}

static void add_count(cJSON *object, const char *key, uint64_t value) {
    cJSON_AddNumberToObject(object, key, (double)value);
}

static int print_mesh_json(const char *path, const fm_mesh_file_info *file, const fm_mesh_info *info, uint64_t pairs) {
    cJSON *root = cJSON_CreateObject();
    cJSON_AddStringToObject(root, "path", path);
    cJSON_AddStringToObject(root, "kind", "mesh");
    cJSON_AddStringToObject(root, "format", fm_mesh_format_name(file->format));
    cJSON_AddBoolToObject(root, "binary", file->binary);
    cJSON_AddBoolToObject(root, "big_endian", file->big_endian);
    cJSON_AddBoolToObject(root, "compressed", file->compressed);
    add_count(root, "file_bytes", file->file_bytes);
    add_count(root, "faces", file->faces);
    add_count(root, "triangles", info->triangles);
    add_count(root, "vertices", info->vertices);
    add_count(root, "distinct", info->distinct);
    add_count(root, "unused", info->unused);
    add_count(root, "dropped", info->dropped);
    add_count(root, "degenerate", info->degenerate);
    add_count(root, "duplicate", info->duplicate);
    add_count(root, "boundary", info->boundary);
    add_count(root, "non_manifold", info->non_manifold);
    add_count(root, "misoriented", info->misoriented);
    add_count(root, "components", info->components);
    cJSON_AddBoolToObject(root, "closed", info->closed);
    const bool any = info->triangles > info->dropped;
    cJSON_AddItemToObject(root, "low", any ? cJSON_CreateFloatArray(info->low, 3) : cJSON_CreateNull());
    cJSON_AddItemToObject(root, "high", any ? cJSON_CreateFloatArray(info->high, 3) : cJSON_CreateNull());
    cJSON_AddNumberToObject(root, "area", info->area);
    cJSON_AddItemToObject(root, "volume", info->closed ? cJSON_CreateNumber(info->volume) : cJSON_CreateNull());
    add_count(root, "intersections", pairs);
    cJSON_AddStringToObject(root, "note", file->note);
    return report_json(stdout, root) ? CLI_DONE : cli_fail("out of memory for the description: free some");
}

int mesh_info(const char *path, fm_mesh_format format, bool json) {
    mesh_input input = {.path = path, .format = format, .quiet = true};
    const fm_context_desc desc = {.backend = FM_BACKEND_CPU};
    fm_context *context = NULL;
    fm_mesh *mesh = NULL;
    fm_mesh_file_info file;
    fm_mesh_info info;
    uint64_t pairs = 0;
    if (fm_context_create(&desc, &context) != FM_OK) {
        return cli_library_failed();
    }
    int status = mesh_input_load(&input, context, &mesh, &file);
    if (status == CLI_DONE && (fm_mesh_describe(mesh, &info) != FM_OK || fm_mesh_intersections(mesh, 0, &pairs) != FM_OK)) {
        status = cli_library_failed();
    }
    if (status == CLI_DONE && json) {
        status = print_mesh_json(path, &file, &info, pairs);
    } else if (status == CLI_DONE) {
        print_mesh(path, &file, &info, pairs);
    }
    fm_mesh_destroy(mesh);
    fm_context_destroy(context);
    return status;
}
