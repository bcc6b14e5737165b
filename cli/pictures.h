// SPDX-License-Identifier: MIT
#ifndef FM_CLI_PICTURES_H
#define FM_CLI_PICTURES_H

// Where rendered pictures go: a PNG, numbered PNGs, or a film.

#include <stdbool.h>
#include <stdint.h>

typedef struct pictures {
    const char *out;  // a name that ends in .png, or that of a film
    uint32_t width, height, frames;
    double fps;
} pictures;

// NULL, or what is wrong with the name or the rate, as a message of bad usage. `out` NULL is fine.
const char *pictures_wrong(const pictures *p);
// Says early what would fail only after the work. Returns an exit code.
int pictures_check(const pictures *p);
// Calls `draw` for each frame, which puts RGBA pixels into its memory and returns an exit code. Returns an exit code.
int pictures_write(const pictures *p, const uint8_t *pixels, int (*draw)(void *user, uint32_t frame), void *user);

#endif
