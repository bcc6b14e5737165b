// SPDX-License-Identifier: MIT
#ifndef FM_BENCH_STATS_H
#define FM_BENCH_STATS_H

// What a list of timings comes to.

#include <stdint.h>

typedef struct bench_stats {
    uint32_t count;
    double median, least, mean;
    double deviation;  // standard deviation of the sample; 0 for one value
    double p99;        // 99th percentile: the least value that at least 99 % of them do not exceed
    // Confidence interval of the median from order statistics, without any assumption on the distribution. `confidence` is its true
    // level: the narrowest symmetric interval of at least 0.95, or, below six values, that of the whole range.
    double low, high, confidence;
} bench_stats;

// Sorts `values`; `count` is 1 to BENCH_STATS_MAX.
enum { BENCH_STATS_MAX = 1000 };
bench_stats bench_stats_of(double *values, uint32_t count);

#endif
