// SPDX-License-Identifier: MIT
#ifndef FM_OCTREE_STREAM_H
#define FM_OCTREE_STREAM_H

// A stream as pictures see it: the coarse octree, and the parts that are there as the newest update has left them.

#include "fathom/octree_render.h"
#include "octree/octree.h"

// The coarse octree, the stream's.
fm_octree *fm_octree_stream_coarse(fm_octree_stream *stream);
// Where rays find the parts: addresses are the host's on the CPU backend, else the device's. Valid until the next update of the
// stream, which waits for nothing that is submitted before it.
fm_octree_grid fm_octree_stream_grid(const fm_octree_stream *stream);

#endif
