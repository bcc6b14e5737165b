// SPDX-License-Identifier: MIT
#ifndef FM_SEPARABLE_H
#define FM_SEPARABLE_H

// What the separable transforms on the CPU call of each other.

#include "transform/plan.h"

// The kernels that exist once an instruction set. Whether they do what a plan asks for; what they need; and the work.
bool fm_kernels_fit(const fm_plan *plan);
uint64_t fm_kernels_scratch_bytes(const fm_context *context, const fm_plan *plan);
void fm_kernels_transform(fm_context *context, const fm_plan *plan, const fm_sites *sites, void *memory, void *distance);

// Element index of the first site in slice z within `reach_x` and `reach_y` steps of column (x, y).
uint64_t fm_linf_index(const fm_sites *sites, uint32_t x, uint32_t y, uint32_t z, uint32_t reach_x, uint32_t reach_y);

// Most steps of a weight that stay within a distance; `size` at most.
uint32_t fm_linf_reach(float weight, uint32_t size, float distance);

#endif
