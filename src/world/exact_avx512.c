// SPDX-License-Identifier: MIT
// The kernels of AVX-512 (the flags are set in CMakeLists.txt).

#include "world/exact_template.h"
