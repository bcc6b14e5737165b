// SPDX-License-Identifier: MIT
#define FM_LEVEL(name) name##_portable
#include "mesh/descent_template.h"
