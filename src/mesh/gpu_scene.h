// SPDX-License-Identifier: MIT
#ifndef FM_GPU_SCENE_H
#define FM_GPU_SCENE_H

// The vertices of a scene's objects on the device. In a build without Vulkan gpu_none.c answers.

#include "mesh/scene.h"

// Records and submits that the objects that have moved move on the device too, and that the tree of the scene's mesh follows: a
// refit, unless the mesh's `rebuild_version` asks for more. Raises the mesh's version; the objects' flags are the caller's. Passes
// "scene", "tree". Complete at `ticket` (NULL: waits).
fm_result fm_gpu_scene_update(fm_scene *scene, fm_ticket *ticket);
// Waits for work in flight that reads it.
void fm_gpu_scene_destroy(fm_scene *scene);

#endif
