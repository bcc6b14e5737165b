// SPDX-License-Identifier: MIT
#ifndef FM_CLI_STATS_H
#define FM_CLI_STATS_H

// What the voxels of a volume are, so that a person can choose what is solid.

#include "fathom/fathom.h"

#include <stdbool.h>

enum {
    STATS_MAX_DISTINCT = 65536,  // distinct values that are counted
    STATS_LISTED = 16,           // of these, the ones that are kept: the commonest
};

typedef struct stats_value {
    long double value;  // wide enough for 64-bit integers
    uint64_t voxels;
} stats_value;

typedef struct stats {
    uint64_t voxels, nonzero;  // NaN is not zero
    uint64_t nan, infinite;
    long double min, max;  // of the finite values; 0 when there is none
    bool integer;          // integers or bits: the rest is known
    bool more;             // more than STATS_MAX_DISTINCT values
    uint64_t distinct;
    uint32_t listed;  // in `values`, the commonest first; none when there are `more`
    stats_value values[STATS_LISTED];
} stats;

// Of a host volume. False when memory ran out.
bool stats_of(fm_volume *volume, stats *result);

// Whether a field, unsigned or signed, has a solid voxel and whether it has an empty one. Stops at the first of both.
void stats_sides(fm_volume *field, bool *solid, bool *empty);

// The values that an integer type or bits can have; false for floating point.
bool stats_type_range(fm_type type, long double *least, long double *most);

#endif
