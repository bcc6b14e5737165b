// SPDX-License-Identifier: MIT
#include "world/host_world.h"
