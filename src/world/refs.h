// SPDX-License-Identifier: MIT
#ifndef FM_WORLD_REFS_H
#define FM_WORLD_REFS_H

// What octrees and pictures on the device ask of a world beside the public calls. How it keeps these is its own business.

#include "fathom/world.h"
#include "shaders/include/shared.h"

// Addresses on the device. They stay as they are while the world lives.
typedef struct fm_world_refs {
    fm_address voxels;  // 32 bits each, x fastest, without gaps
    fm_address bits;    // of sites: see shaders/include/sites.glsl
    fm_address field;   // in the world's format
    fm_address colors;  // 0 where the field holds them
} fm_world_refs;

fm_context *fm_world_context(const fm_world *world);
// Of a world on Vulkan.
fm_world_refs fm_gpu_world_refs(const fm_world *world);

#endif
