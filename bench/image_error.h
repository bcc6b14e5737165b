// SPDX-License-Identifier: MIT
#ifndef FM_BENCH_IMAGE_ERROR_H
#define FM_BENCH_IMAGE_ERROR_H

// How far a picture is from its reference.

#include <stdint.h>

// A picture of three floats a pixel: sRGB as it is shown, 0 to 1, row by row from above.
typedef struct image {
    const float *rgb;
    uint32_t width, height;
} image;

// Both pictures are of one size. All three return a value below 0 when memory lacks.

// Root of the mean squared difference of all numbers.
double image_rmse(const image *test, const image *reference);

// Mean structural similarity of the luma (Rec. 601) of all pixels, 1 for equal pictures. Weights are a Gaussian of 1.5 pixels.
// Source: Wang et al. 2004, "Image quality assessment: from error visibility to structural similarity".
double image_ssim(const image *test, const image *reference);

// Mean perceived difference when one looks to and fro between the two, 0 to 1, at the distance at which `pixels_per_degree` pixels
// span a degree (0: 67, the usual). `map` (NULL allowed) gets it for each pixel.
// Source: Andersson et al. 2020, "FLIP: a difference evaluator for alternating images".
double image_flip(const image *test, const image *reference, double pixels_per_degree, float *map);

#endif
