// SPDX-License-Identifier: MIT

// Writes small valid files, a folder for each fuzz target, for the fuzzers to start from: `fuzz_seeds DIRECTORY`.

#include "fathom/mesh_io.h"
#include "octree_made.h"

#include <stdio.h>
#include <string.h>

static bool write_bytes(const char *directory, const char *name, const void *data, size_t size) {
    char path[1024];
    snprintf(path, sizeof path, "%s/%s", directory, name);
    FILE *file = fopen(path, "wb");
    bool good = file && fwrite(data, 1, size, file) == size;
    return file && fclose(file) == 0 && good;
}

static bool write_volume(const char *directory, const char *folder, const char *name, fm_type type, bool compress) {
    char path[1024];
    fm_volume *volume = NULL;
    const fm_volume_desc desc = {.shape = {5, 3, 2}, .type = type, .storage = FM_STORAGE_HOST, .spacing = {1, 2, 0.5}};
    if (fm_volume_create(NULL, &desc, &volume) != FM_OK) {
        return false;
    }
    uint64_t bytes = 0;
    fm_array_bytes(desc.shape, type, &bytes);
    memset(fm_volume_data(volume), 3, (size_t)bytes);
    const fm_write_desc options = {.compress = compress};
    snprintf(path, sizeof path, "%s/%s/%s", directory, folder, name);
    bool good = fm_file_write(path, volume, &options) == FM_OK;
    snprintf(path, sizeof path, "%s/auto/%s", directory, name);
    good = fm_file_write(path, volume, &options) == FM_OK && good;
    fm_volume_destroy(volume);
    return good;
}

// Strings keep their NULs, so sizes are given.
#define WRITE(directory, name, text) write_bytes(directory, name, text, sizeof(text) - 1)

static bool write_handmade(const char *directory) {
    static const char octomap[] = "# Octomap OcTree binary file\nid OcTree\nsize 19\nres 0.5\ndata\n"
                                  "\3\0\3\0\3\0\3\0\3\0\3\0\3\0\3\0\3\0\3\0\3\0\3\0\3\0\3\0\3\0\x49\0";
    static const char binvox[] = "#binvox 1\ndim 4 4 4\ntranslate -1 0 2\nscale 2\ndata\n\1\x20\0\x20";
    static const char fortran[] = "\x93NUMPY\1\0\x40\0{'descr': '>i2', 'fortran_order': True, 'shape': (2, 3, 4), }  \n"
                                  "0123456789012345678901234567890123456789abcdefgh";
    static const char detached[] =
        "NRRD0004\ntype: short\ndimension: 2\nsizes: 2 2\nencoding: raw\nendian: big\nspacings: 1 nan\nbyte skip: 1\n"
        "line skip: 1\nkey:=value\n# remark\n\nskipped\nx01234567";
    static const char scene[] = "VOX \x96\0\0\0MAIN\0\0\0\0\xd3\0\0\0"
                                "SIZE\x0c\0\0\0\0\0\0\0\2\0\0\0\3\0\0\0\1\0\0\0"
                                "XYZI\x08\0\0\0\0\0\0\0\1\0\0\0\1\2\0\7"
                                "nTRN\x1c\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\1\0\0\0\xff\xff\xff\xff\0\0\0\0\1\0\0\0\0\0\0\0"
                                "nGRP\x10\0\0\0\0\0\0\0\1\0\0\0\0\0\0\0\1\0\0\0\2\0\0\0"
                                "nTRN\x37\0\0\0\0\0\0\0\2\0\0\0\0\0\0\0\3\0\0\0\xff\xff\xff\xff\0\0\0\0\1\0\0\0\2\0\0\0"
                                "\2\0\0\0_r\2\0\0\0"
                                "17"
                                "\2\0\0\0_t\5\0\0\0"
                                "1 2 3"
                                "nSHP\x14\0\0\0\0\0\0\0\3\0\0\0\0\0\0\0\1\0\0\0\0\0\0\0\0\0\0\0";
    static const char map[] = "voxel 4 5 6\n0 0 0\n3 4 5\n";
    static const char sidecar[] =
        "fathom raw 1\nshape 16 16 16\ntype uint8\nbyte_order big\noffset 0\nspacing 1 1 1\norigin 0 0 0\n";
    char folder[5][1024];
    const char *const names[] = {"octomap", "binvox", "npy", "nrrd", "vox"};
    for (int i = 0; i < 5; i++) {
        snprintf(folder[i], sizeof folder[i], "%s/%s", directory, names[i]);
    }
    char raw[1024];
    snprintf(raw, sizeof raw, "%s/raw", directory);
    char text[1024];
    snprintf(text, sizeof text, "%s/3dmap", directory);
    return WRITE(folder[0], "tree.bt", octomap) && WRITE(folder[1], "runs.binvox", binvox) &&
           WRITE(folder[2], "fortran.npy", fortran) && WRITE(folder[3], "skips.nrrd", detached) &&
           WRITE(folder[4], "scene.vox", scene) && WRITE(raw, "sidecar", sidecar) && WRITE(text, "map.3dmap", map);
}

// A map has no smaller form: one span for each of its columns.
static bool write_vxl(const char *directory) {
    static uint8_t map[512 * 512 * 8];
    char folder[1024];
    for (size_t i = 0; i < sizeof map; i += 8) {
        // One coloured voxel on top, and its colour.
        map[i + 1] = map[i + 2] = (uint8_t)(i / 8 % 64);
    }
    snprintf(folder, sizeof folder, "%s/vxl", directory);
    return write_bytes(folder, "map.vxl", map, sizeof map);
}

static bool write_texts_of_meshes(const char *directory) {
    static const char ply[] =
        "ply\nformat ascii 1.0\ncomment a\nelement vertex 4\nproperty float x\nproperty double z\nproperty list "
        "uchar int junk\nproperty int16 y\nelement face 2\nproperty uchar red\nproperty list uchar int "
        "vertex_indices\nend_header\n0 0 0 0\n1 0 1 7 0\n0 0.5 0 1\n0 -1e3 2 7 8 .5\n9 4 0 1 2 3\n9 3 0 2 1\n";
    static const char strips[] =
        "ply\nformat binary_big_endian 1.0\nelement vertex 3\nproperty uchar x\nproperty uchar y\nproperty "
        "uchar z\nelement tristrips 1\nproperty list uchar char vertex_indices\nend_header\n"
        "\0\0\0\1\0\0\0\1\0\7\0\1\2\xff\0\2\1";
    static const char obj[] = "# a\r\nv 0 0 0\nv 1 0 0 1\nv 0 1.5e-1 -.25\nvt 0 0\nvn 0 0 1\no b\ng c\nusemtl d\ns off\nf 1 2 3\n"
                              "f -1/1/1 -2/1/1 \\\n -3/1/1\nf 1//1 3//1 2//1\nf 1/1 2/1 3/1 1/1\nl 1 2\n";
    static const char stl[] =
        "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1e0 0\nendloop\nendfacet\n"
        "endsolid a\n";
    static const char gltf[] =
        "{\"asset\":{\"version\":\"2.0\"},\"scene\":0,\"scenes\":[{\"nodes\":[0]}],\"nodes\":[{\"children\":[1],\"matrix\":[1,0,0,"
        "0,0,1,0,"
        "0,0,0,1,0,1,2,3,1]},{\"mesh\":0,\"rotation\":[0,0,1,0],\"scale\":[-1,1,1],\"translation\":[0,0,1]}],\"meshes\":[{"
        "\"primitives\":"
        "[{\"attributes\":{\"POSITION\":0},\"indices\":1,\"mode\":5},{\"attributes\":{\"POSITION\":2}}]}],\"accessors\":[{"
        "\"bufferView\":0,"
        "\"componentType\":5126,\"count\":3,\"type\":\"VEC3\"},{\"bufferView\":1,\"componentType\":5121,\"count\":4,\"type\":"
        "\"SCALAR\"},"
        "{\"componentType\":5120,\"count\":3,\"type\":\"VEC3\",\"normalized\":true,\"sparse\":{\"count\":1,\"indices\":{"
        "\"bufferView\":1,"
        "\"componentType\":5121},\"values\":{\"bufferView\":1}}}],\"bufferViews\":[{\"buffer\":0,\"byteLength\":36},{\"buffer\":0,"
        "\"byteOffset\":36,\"byteLength\":4}],\"buffers\":[{\"byteLength\":40,\"uri\":\"data:application/octet-stream;base64,"
        "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAAECAA==\"}]}";
    static const char glb[] =
        "glTF\2\0\0\0\0\0\0\0\x08\1\0\0JSON{\"asset\":{\"version\":\"2.0\"},\"nodes\":[{\"mesh\":0}],\"meshes\":[{"
        "\"primitives\":[{\"attributes\":{\"POSITION\":0}}]}],\"accessors\":[{\"bufferView\":0,\"componentType\":5121,"
        "\"count\":3,\"type\":\"VEC3\"}],\"bufferViews\":[{\"buffer\":0,\"byteLength\":9}],\"buffers\":[{"
        "\"byteLength\":9}]}         \x0c\0\0\0BIN\0\0\0\0\1\0\0\0\1\0\0\0\0";
    char folder[4][1024];
    static const char *const names[] = {"ply", "obj", "stl", "gltf"};
    for (int i = 0; i < 4; i++) {
        snprintf(folder[i], sizeof folder[i], "%s/%s", directory, names[i]);
    }
    return WRITE(folder[0], "text.ply", ply) && WRITE(folder[0], "strips.ply", strips) && WRITE(folder[1], "all.obj", obj) &&
           WRITE(folder[2], "text.stl", stl) && WRITE(folder[3], "scene.gltf", gltf) && WRITE(folder[3], "scene.glb", glb);
}

static bool write_meshes(const char *directory) {
    static const float vertices[4][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    static const uint32_t triangles[4][3] = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
    static const char *const names[] = {"ply/a.ply", "ply/a.ply.gz", "obj/a.obj", "stl/a.stl", "stl/a.stl.gz"};
    const fm_context_desc cpu = {.backend = FM_BACKEND_CPU, .threads = 1};
    const fm_mesh_desc desc = {vertices, 4, triangles, 4};
    fm_context *context = NULL;
    fm_mesh *mesh = NULL;
    bool good = fm_context_create(&cpu, &context) == FM_OK && fm_mesh_create(context, &desc, &mesh) == FM_OK;
    for (int i = 0; good && i < 5; i++) {
        char path[1024];
        snprintf(path, sizeof path, "%s/%s", directory, names[i]);
        good = fm_mesh_write(mesh, path, NULL) == FM_OK;
    }
    fm_mesh_destroy(mesh);
    fm_context_destroy(context);
    return good && write_texts_of_meshes(directory);
}

static bool write_octrees(const char *directory) {
    static const fm_octree_desc kinds[] = {
        {.kind = FM_OCTREE_CLOSEST, .size = 32, .attribute = FM_OCTREE_COLOR},
        {.kind = FM_OCTREE_CLOSEST, .size = 24, .code = FM_OCTREE_FLOATS, .share = true},
        {.kind = FM_OCTREE_DISTANCE, .size = 32, .sign = FM_SIGN_WINDING},
        {.kind = FM_OCTREE_VOXELS, .size = 64, .top_bytes = 32},
        {.kind = FM_OCTREE_DAG, .size = 24, .top_bytes = 64},
        {.kind = FM_OCTREE_TREE64, .size = 24, .top_bytes = 64},
        {.kind = FM_OCTREE_CONTOURS, .size = 24, .top_bytes = 64},
        {.kind = FM_OCTREE_BRICKS, .size = 8},
    };
    const fm_context_desc cpu = {.backend = FM_BACKEND_CPU, .threads = 1};
    fm_context *context = NULL;
    bool good = fm_context_create(&cpu, &context) == FM_OK;
    for (size_t i = 0; good && i < sizeof kinds / sizeof kinds[0]; i++) {
        char path[1024];
        snprintf(path, sizeof path, "%s/fmo/%zu.fmo", directory, i);
        fm_octree *octree = made_octree(context, &kinds[i], i);
        good = octree && fm_octree_write(octree, path) == FM_OK;
        fm_octree_destroy(octree);
    }
    fm_context_destroy(context);
    return good;
}

// Files of two parts, a coarse octree, and a directory.
static bool write_parts(const char *directory) {
    static const float vertices[4][3] = {{0, 0, 0}, {2, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    static const uint32_t triangles[4][3] = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
    const fm_context_desc cpu = {.backend = FM_BACKEND_CPU, .threads = 1};
    const fm_mesh_desc tetrahedron = {vertices, 4, triangles, 4};
    fm_context *context = NULL;
    fm_mesh *mesh = NULL;
    bool good = fm_context_create(&cpu, &context) == FM_OK && fm_mesh_create(context, &tetrahedron, &mesh) == FM_OK;
    for (int kind = FM_OCTREE_CLOSEST; good && kind < FM_OCTREE_KINDS; kind++) {
        char path[1024];
        snprintf(path, sizeof path, "%s/fmo_parts/%d.fmo", directory, kind);
        const fm_octree_desc desc = {
            .kind = (fm_octree_kind)kind, .size = 12, .low = {-0.1f, -0.1f, -0.1f}, .high = {2.1f, 1, 1}, .top_bytes = 64};
        good = fm_octree_write_parts(mesh, &desc, &(fm_octree_parts){.parts = 2, .coarse = 4}, path) == FM_OK;
    }
    fm_mesh_destroy(mesh);
    fm_context_destroy(context);
    return good;
}

int main(int argc, char **argv) {
    if (argc != 2) {
        fprintf(stderr, "usage: %s DIRECTORY\n", argv[0]);
        return 2;
    }
    const char *d = argv[1];
    bool good = write_volume(d, "npy", "a.npy", FM_TYPE_F32, false) && write_volume(d, "npy", "a.npy.gz", FM_TYPE_U16, false) &&
                write_volume(d, "nrrd", "a.nrrd", FM_TYPE_U8, false) && write_volume(d, "nrrd", "b.nrrd", FM_TYPE_I16, true) &&
                write_volume(d, "nifti", "a.nii", FM_TYPE_I16, false) && write_volume(d, "nifti", "a.nii.gz", FM_TYPE_F64, false) &&
                write_volume(d, "vox", "a.vox", FM_TYPE_U8, false) && write_handmade(d) && write_vxl(d) && write_meshes(d) &&
                write_octrees(d) && write_parts(d);
    if (!good) {
        fprintf(stderr, "%s: %s\n", argv[1], fm_last_error());
    }
    return good ? 0 : 1;
}
