// SPDX-License-Identifier: MIT
#ifndef FATHOM_MESH_IO_H
#define FATHOM_MESH_IO_H

// Triangle meshes in files. The conventions of fathom.h hold, and for errors and their messages those of io.h.

#include "fathom/io.h"
#include "fathom/mesh.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef enum fm_mesh_format {
    FM_MESH_FORMAT_AUTO = 0,  // reading: by the first bytes, then by the name; writing: by the name
    FM_MESH_FORMAT_PLY,       // .ply, ascii or binary of either byte order: read; binary little-endian: written
    FM_MESH_FORMAT_OBJ,       // .obj: read and write
    FM_MESH_FORMAT_STL,       // .stl, ascii or binary: read; binary: written
    FM_MESH_FORMAT_GLTF,      // glTF 2.0, .gltf with its buffers beside it or inside, or .glb: read
} fm_mesh_format;

// Name as people write it ("PLY", "glTF"). Never NULL. Thread-safe.
FM_API const char *fm_mesh_format_name(fm_mesh_format format);

typedef struct fm_mesh_read_desc {
    fm_mesh_format format;
    // A mesh of more bytes than this (12 a vertex and 12 a triangle) is refused with FM_ERROR_RANGE before memory is taken for it.
    // 0: 4 GiB for glTF, where a small file can place one object many times, and no limit for the others, whose meshes cannot be
    // much larger than the file.
    uint64_t max_bytes;
    fm_progress_fn progress;  // told bytes of the file as it lies on disk; `total` is 0 for a pipe
    void *progress_user;
} fm_mesh_read_desc;

// What a file held.
typedef struct fm_mesh_file_info {
    fm_mesh_format format;
    uint64_t file_bytes;  // of the file named; 0 when it is a pipe
    uint64_t vertices;    // of the mesh
    uint64_t triangles;   // of the mesh
    uint64_t faces;       // polygons, strips and triangles that the triangles were made of
    bool binary;          // and not text
    bool big_endian;      // PLY
    bool compressed;
    char note[256];  // what was set aside, in words; empty when nothing was
} fm_mesh_file_info;

// Which format the file is of, by its first bytes, then by its name; FM_MESH_FORMAT_AUTO when that is no mesh format or the file
// cannot be read. Tells meshes from volumes before either is read. "-" is never a mesh. Thread-safe.
FM_API fm_mesh_format fm_mesh_format_of(const char *path);

// Reads a file into a new mesh. `path` "-" reads standard input, whose format is known by its first bytes or given. Any format may
// be gzipped as a whole. `desc` and `info` may be NULL.
//
// Only positions and faces are read. Vertices are those of the file in its order, STL's three a triangle. Polygons become fans
// about their first corner, faces of fewer than three corners are set aside and counted in `info->note`. OBJ: polylines, groups and
// materials are ignored. PLY: scalar properties of any type give positions, `vertex_indices` of `face` and `tristrips` the
// triangles. glTF: the default scene (without one all root nodes) is placed by its nodes' transforms, triangles of mirrored nodes
// turned so that they still face outwards; points and lines are set aside, skins and morph targets are left at rest; buffers are
// in the file, in data URIs, or in files of the same folder or below.
//
// Positions that are not finite or very large are kept: fm_mesh_info counts the triangles that cannot take part.
//
// Errors: FM_ERROR_IO, FM_ERROR_FORMAT (an index that names no vertex among others: the message names the face or its line),
// FM_ERROR_UNSUPPORTED, FM_ERROR_RANGE (see `max_bytes`, and the limits of fm_mesh_desc), FM_ERROR_INVALID_ARGUMENT, and those of
// fm_mesh_create. Thread safety: as the context. Sources: G. Turk, "The PLY Polygon File Format"; "Object Files (.obj)" of the
// Advanced Visualizer manual; the StereoLithography Interface Specification of 1989; Khronos glTF 2.0.
FM_API fm_result fm_mesh_read(fm_context *context, const char *path, const fm_mesh_read_desc *desc, fm_mesh **mesh,
                              fm_mesh_file_info *info);

typedef struct fm_mesh_write_desc {
    fm_mesh_format format;  // AUTO: by the name, with or without .gz at its end; "-" and devices of other names get PLY
    bool compress;          // gzip; a name that ends in .gz asks for it too
    fm_file_batch *batch;   // as in fm_write_desc
    fm_progress_fn progress;
    void *progress_user;
} fm_mesh_write_desc;

// Writes a mesh's own arrays (fm_mesh_arrays) by the rules of fm_file_write: under a temporary name first. Positions keep every bit
// in PLY and STL, and their value in OBJ. STL has normals of unit length, or 0 where the triangle has no area, and no vertices but
// those of triangles. `desc` may be NULL. Errors: FM_ERROR_IO, FM_ERROR_OUT_OF_HOST_MEMORY, FM_ERROR_INVALID_ARGUMENT,
// FM_ERROR_UNSUPPORTED for a format that is only read. Thread safety: as the mesh's context.
FM_API fm_result fm_mesh_write(const fm_mesh *mesh, const char *path, const fm_mesh_write_desc *desc);

#ifdef __cplusplus
}
#endif

#endif
