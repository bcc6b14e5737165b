// SPDX-License-Identifier: MIT
#include "mesh/topology.h"

void fm_topology_destroy(const fm_allocator *allocator, fm_mesh *mesh) {
    (void)allocator;
    (void)mesh;
}
