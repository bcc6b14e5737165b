// SPDX-License-Identifier: MIT
#ifndef FM_CLI_REPORT_H
#define FM_CLI_REPORT_H

// What programs print about devices and passes, as text and as JSON.

#include "fathom/fathom.h"

#include <cjson/cJSON.h>
#include <stdio.h>

enum { REPORT_MAX_PASSES = 64 };

// "discrete GPU", "software driver", ...
const char *report_device_kind(fm_device_kind kind);

// A table of passes with a line for their sum.
void report_passes(FILE *stream, const fm_pass *passes, uint32_t count);

cJSON *report_device_json(const fm_device_info *device);
cJSON *report_passes_json(const fm_pass *passes, uint32_t count);
cJSON *report_shape_json(fm_shape shape);

// Prints a JSON value and a newline, and frees it. False when memory ran out; errors of the stream stay with the stream.
bool report_json(FILE *stream, cJSON *value);

#endif
