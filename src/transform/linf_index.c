// SPDX-License-Identifier: MIT
// The lowest index of equally near sites under Linf. Passes along the axes find the lowest slice, but within it the site that is
// nearest in the plane, and a maximum hides that another one comes first. So the slice is searched again with the distance known.

#include "transform/finish.h"
#include "transform/separable.h"

// First site of a row within [begin, end], or UINT32_MAX.
static uint32_t first_site(const fm_sites *sites, uint64_t row, uint32_t begin, uint32_t end) {
    const uint32_t *words = sites->words + row * fm_bits_row_words(sites->shape);
    for (uint32_t i = begin / 32; i <= end / 32; i++) {
        uint32_t word = words[i];
        word = i == begin / 32 ? word & UINT32_MAX << (begin % 32) : word;
        word = i == end / 32 ? word & UINT32_MAX >> (31 - end % 32) : word;
        if (word) {
            return i * 32 + (uint32_t)__builtin_ctz(word);
        }
    }
    return UINT32_MAX;
}

uint64_t fm_linf_index(const fm_sites *sites, uint32_t x, uint32_t y, uint32_t z, uint32_t reach_x, uint32_t reach_y) {
    const fm_shape shape = sites->shape;
    uint32_t begin = x > reach_x ? x - reach_x : 0;
    uint32_t end = shape.x - 1 - x > reach_x ? x + reach_x : shape.x - 1;
    uint32_t last = shape.y - 1 - y > reach_y ? y + reach_y : shape.y - 1;
    for (uint32_t site_y = y > reach_y ? y - reach_y : 0; site_y <= last; site_y++) {
        uint64_t row = (uint64_t)z * shape.y + site_y;
        uint32_t site_x = first_site(sites, row, begin, end);
        if (site_x != UINT32_MAX) {
            return row * shape.x + site_x;
        }
    }
    return UINT64_MAX;
}

uint32_t fm_linf_reach(float weight, uint32_t size, float distance) {
    double guess = (double)distance / (double)weight;
    uint32_t reach = guess < (double)size ? (uint32_t)guess : size;
    while (reach < size && weight * (float)(reach + 1) <= distance) {
        reach++;
    }
    while (reach > 0 && weight * (float)reach > distance) {
        reach--;
    }
    return reach;
}
