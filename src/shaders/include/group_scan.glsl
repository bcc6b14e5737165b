// SPDX-License-Identifier: MIT
// The exclusive sum over a group's GROUP_SCAN_THREADS invocations, all of which come here.

shared uint group_sums[GROUP_SCAN_THREADS];

uint group_scan(uint value) {
    uint own = gl_LocalInvocationIndex;
    uint sum = value;
    for (uint step = 1; step < GROUP_SCAN_THREADS; step *= 2) {
        group_sums[own] = sum;
        barrier();
        sum += own >= step ? group_sums[own - step] : 0;
        barrier();
    }
    return sum - value;
}
