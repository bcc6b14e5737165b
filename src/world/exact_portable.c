// SPDX-License-Identifier: MIT
// The kernels of plain C (the flags are set in CMakeLists.txt).

#include "world/exact_template.h"
