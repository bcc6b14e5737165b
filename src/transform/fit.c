// SPDX-License-Identifier: MIT
#include "transform/fit.h"

bool fm_fit_scan(const fm_device_info *device, uint32_t longest, uint32_t width, bool half, uint32_t shared_bytes,
                 uint32_t fewest_rows, fm_column_fit *fit) {
    uint64_t limit = fm_min_u64(device->max_workgroup, device->shared_memory / shared_bytes);
    for (uint32_t rows = fewest_rows; rows <= (half ? 64 : 32); rows *= 2) {
        uint32_t segments = (uint32_t)fm_div_up(longest, rows);
        uint32_t lanes = fm_floor_power_of_two(fm_min_u64(half ? 16 : 8, limit / segments));
        // Short columns leave room for more of them in a group.
        while (segments * lanes < 128 && lanes < 32 && 4 * lanes < width) {
            lanes *= 2;
        }
        if ((uint64_t)segments * lanes <= limit && lanes >= 4) {
            *fit = (fm_column_fit){lanes, segments, rows};
            return true;
        }
    }
    return false;
}

bool fm_fit_segments(const fm_device_info *device, uint32_t longest, uint32_t lane_words, uint32_t segment_words,
                     fm_column_fit *fit) {
    uint32_t segments = (uint32_t)fm_div_up(longest, FM_SEGMENT_ROWS);
    for (uint32_t lanes = 32; lanes > 0; lanes /= 2) {
        uint64_t bytes = 4 * (uint64_t)segments * (lane_words * lanes + segment_words);
        if (bytes <= device->shared_memory && (uint64_t)lanes * segments <= FM_MAX_COLUMN_THREADS &&
            lanes * segments <= device->max_workgroup) {
            *fit = (fm_column_fit){lanes, segments, FM_SEGMENT_ROWS};
            return true;
        }
    }
    return false;
}
