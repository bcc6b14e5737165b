// SPDX-License-Identifier: MIT
#define KERNEL(name) name##_portable
#include "mesh/bvh_kernels_template.h"
