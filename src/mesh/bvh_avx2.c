// SPDX-License-Identifier: MIT
#define KERNEL(name) name##_avx2
#include "mesh/bvh_kernels_template.h"
