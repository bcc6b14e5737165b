// SPDX-License-Identifier: MIT
#include "transform/kernel_passes.h"
