// SPDX-License-Identifier: MIT
#ifndef FM_BENCH_TABLES_H
#define FM_BENCH_TABLES_H

// What the tables of all benchmarks have in common.

#include "fathom/fathom.h"
#include "stats.h"

#include <cjson/cJSON.h>
#include <stdio.h>

// "512x512x64".
void bench_shape_text(fm_shape shape, char text[40]);

// A text in quotes: names of devices have commas and may have quotes.
void bench_csv_text(FILE *stream, const char *text);

// The columns of a list of timings, each with a comma before it; empty where there is none.
void bench_csv_stats_header(FILE *stream, const char *name);
void bench_csv_stats(FILE *stream, const bench_stats *stats);
cJSON *bench_stats_json(const bench_stats *stats);

// What fm_context_memory gave: bytes for one purpose, and all of it as an array of objects.
uint64_t bench_memory_bytes(const fm_memory *memory, uint32_t count, const char *purpose, bool device);
cJSON *bench_memory_json(const fm_memory *memory, uint32_t count);

#endif
