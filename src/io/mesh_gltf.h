// SPDX-License-Identifier: MIT
#ifndef FM_MESH_GLTF_H
#define FM_MESH_GLTF_H

// A glTF document: its lists, its buffers and what accessors take out of them.

#include "io/file.h"
#include "io/mesh_file.h"

#include <cjson/cJSON.h>
#include <math.h>

typedef enum fm_gltf_component {
    FM_GLTF_BYTE = 5120,
    FM_GLTF_UBYTE,
    FM_GLTF_SHORT,
    FM_GLTF_USHORT,
    FM_GLTF_UINT = 5125,
    FM_GLTF_FLOAT,
} fm_gltf_component;

// An array of the document, for access by number.
typedef struct fm_gltf_list {
    const cJSON **items;
    uint64_t count;
} fm_gltf_list;

typedef struct fm_gltf_buffer {
    uint8_t *data;  // NULL until it is needed
    uint64_t size;
} fm_gltf_buffer;

typedef struct fm_gltf {
    fm_mesh_reader *reader;
    cJSON *root;
    fm_gltf_list accessors, views, buffers, meshes, nodes;
    fm_gltf_buffer *loaded;  // one for each of `buffers`
    uint8_t *bin;            // the binary chunk
    uint64_t bin_size;
    uint64_t set_aside;  // primitives of points and lines
} fm_gltf;

// Elements of an accessor, where they lie.
typedef struct fm_gltf_accessor {
    const uint8_t *data;  // NULL: zeros
    uint64_t stride;
    fm_gltf_component type;
    uint64_t parts;  // 1 or 3
    bool normalized;
    uint64_t count;
    const cJSON *sparse;
} fm_gltf_accessor;

// Parses the document and reads a binary file's chunk. fm_gltf_close is to follow whatever it returns.
fm_result fm_gltf_open(fm_gltf *g);
void fm_gltf_close(fm_gltf *g);

// Sets the message "NAME: `what` `number`: ...".
fm_result fm_gltf_fails(const fm_gltf *g, const char *what, uint64_t number);

// A whole number of at least 0; `otherwise` when it is not there. False when it is something else.
bool fm_gltf_number(const cJSON *object, const char *key, uint64_t otherwise, uint64_t *value);
// `count` numbers of the array `key`; `values` stays as it is when there is none.
bool fm_gltf_doubles(const cJSON *object, const char *key, double *values, int count);

// Where the elements of an accessor lie: all of them do lie there.
fm_result fm_gltf_elements(const fm_gltf *g, uint64_t number, fm_gltf_accessor *e);
// All elements as doubles in memory of the reader's, for the rare sparse accessors. `*values` is to be freed whatever it returns.
fm_result fm_gltf_expand(const fm_gltf *g, const fm_gltf_accessor *e, uint64_t accessor, double **values);

static inline uint64_t fm_gltf_size(uint64_t type) {
    return type == FM_GLTF_BYTE || type == FM_GLTF_UBYTE     ? 1
           : type == FM_GLTF_SHORT || type == FM_GLTF_USHORT ? 2
           : type == FM_GLTF_UINT || type == FM_GLTF_FLOAT   ? 4
                                                             : 0;
}

static inline double fm_gltf_value(const uint8_t *at, fm_gltf_component type, bool normalized) {
    union {
        uint32_t bits;
        float number;
    } word;
    switch (type) {
    case FM_GLTF_BYTE:
        return normalized ? fmax((int8_t)at[0] / 127.0, -1) : (int8_t)at[0];
    case FM_GLTF_UBYTE:
        return normalized ? at[0] / 255.0 : at[0];
    case FM_GLTF_SHORT: {
        const int16_t value = (int16_t)(at[0] | at[1] << 8);
        return normalized ? fmax(value / 32767.0, -1) : value;
    }
    case FM_GLTF_USHORT: {
        const uint16_t value = (uint16_t)(at[0] | at[1] << 8);
        return normalized ? value / 65535.0 : value;
    }
    case FM_GLTF_UINT:
        return fm_load_u32(at);
    default:
        word.bits = fm_load_u32(at);
        return (double)word.number;
    }
}

static inline uint32_t fm_gltf_index(const uint8_t *at, fm_gltf_component type) {
    return type == FM_GLTF_UBYTE ? at[0] : type == FM_GLTF_USHORT ? (uint32_t)(at[0] | at[1] << 8) : fm_load_u32(at);
}

#endif
