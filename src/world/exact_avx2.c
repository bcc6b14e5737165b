// SPDX-License-Identifier: MIT
// The kernels of AVX2 (the flags are set in CMakeLists.txt).

#include "world/exact_template.h"
