// SPDX-License-Identifier: MIT
// The kernels of any processor, in plain C.

#include "transform/kernels_template.h"
