// SPDX-License-Identifier: MIT
#include "stats.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>

static int compare(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

// Ranks (from 0) `rank` and count - 1 - rank enclose the median with probability 1 - 2 P(fewer than rank + 1 of count values lie
// below it), where that number is binomial with one half. Returns the largest rank that keeps at least 0.95, or 0.
static uint32_t interval_rank(uint32_t count, double *confidence) {
    double term = pow(0.5, count), below = term;
    uint32_t rank = 0;
    *confidence = 1 - 2 * below;
    while (2 * (rank + 1) < count) {
        term *= (double)(count - rank) / (rank + 1);
        below += term;
        if (1 - 2 * below < 0.95) {
            break;
        }
        rank++;
        *confidence = 1 - 2 * below;
    }
    return rank;
}

bench_stats bench_stats_of(double *values, uint32_t count) {
    assert(count >= 1 && count <= BENCH_STATS_MAX);
    qsort(values, count, sizeof *values, compare);
    bench_stats stats = {.count = count, .least = values[0]};
    stats.median = (values[(count - 1) / 2] + values[count / 2]) / 2;
    stats.p99 = values[(99 * count + 99) / 100 - 1];
    double sum = 0;
    for (uint32_t i = 0; i < count; i++) {
        sum += values[i];
    }
    stats.mean = sum / count;
    double squares = 0;
    for (uint32_t i = 0; i < count; i++) {
        squares += (values[i] - stats.mean) * (values[i] - stats.mean);
    }
    stats.deviation = count > 1 ? sqrt(squares / (count - 1)) : 0;
    const uint32_t rank = interval_rank(count, &stats.confidence);
    stats.low = values[rank];
    stats.high = values[count - 1 - rank];
    return stats;
}
