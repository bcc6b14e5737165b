// SPDX-License-Identifier: MIT
#define FM_LEVEL(name) name##_avx2
#include "mesh/descent_template.h"
