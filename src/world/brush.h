// SPDX-License-Identifier: MIT
#ifndef FM_BRUSH_H
#define FM_BRUSH_H

#include "world/world.h"

// Checks a brush and prepares it for a world of this shape. `reaches` false: it touches nothing of the world. Errors:
// FM_ERROR_INVALID_ARGUMENT, without the brush's number.
fm_result fm_brush_prepare(const fm_brush *brush, fm_shape shape, fm_gpu_brush *prepared, bool *reaches);

// Whether a brush may touch rows y_begin ... y_end - 1 of slice z; then the range of x, as tight as is cheap.
bool fm_brush_rows(const fm_gpu_brush *brush, int32_t y_begin, int32_t y_end, int32_t z, int32_t *x_begin, int32_t *x_end);

// Whether it covers a voxel; the kernels compute the same (shaders/include/brush.glsl).
bool fm_brush_covers(const fm_gpu_brush *brush, int32_t x, int32_t y, int32_t z);

#endif
