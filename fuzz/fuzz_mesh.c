// SPDX-License-Identifier: MIT

// Reads the fuzzer's bytes as a mesh file of FUZZ_FORMAT.

#include "io/mesh_file.h"

#include <stdlib.h>

enum { MAX_BYTES = 1 << 24 };

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

// What was read must be whole: every corner names a vertex, and the description agrees with the mesh.
static void examine(const fm_mesh *mesh, const fm_mesh_file_info *info) {
    static volatile float sink;
    const float(*vertices)[3];
    const uint32_t(*triangles)[3];
    uint64_t vertex_count, triangle_count;
    fm_mesh_arrays(mesh, &vertices, &vertex_count, &triangles, &triangle_count);
    if (vertex_count != info->vertices || triangle_count != info->triangles || 12 * (vertex_count + triangle_count) > MAX_BYTES) {
        abort();
    }
    float sum = 0;
    for (uint64_t i = 0; i < triangle_count; i++) {
        for (int k = 0; k < 3; k++) {
            if (triangles[i][k] >= vertex_count) {
                abort();
            }
            sum += vertices[triangles[i][k]][k];
        }
    }
    sink = sum;
    (void)sink;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    static fm_context *context;
    const fm_context_desc cpu = {.backend = FM_BACKEND_CPU, .threads = 1};
    if (!context && fm_context_create(&cpu, &context) != FM_OK) {
        abort();
    }
    fm_input *input = NULL;
    fm_mesh *mesh = NULL;
    fm_mesh_file_info info = {0};
    const fm_mesh_read_desc desc = {.format = FUZZ_FORMAT, .max_bytes = MAX_BYTES};
    fm_result result = fm_input_open_memory(&fm_default_allocator, data, size, "input", &input);
    if (result == FM_OK) {
        result = fm_mesh_read_input(context, input, NULL, &desc, &mesh, &info);
        fm_input_close(input);
    }
    if (result == FM_OK) {
        examine(mesh, &info);
        fm_mesh_destroy(mesh);
    } else if (mesh || fm_last_error()[0] == 0) {
        abort();
    }
    return 0;
}
