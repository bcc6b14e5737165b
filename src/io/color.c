// SPDX-License-Identifier: MIT

// Colour maps as curves in Oklab, where equal steps look equal: lightness runs evenly, hue and chroma give the colour, and chroma
// is lowered where sRGB cannot show it.

#include "fathom/io.h"

#include <math.h>

typedef struct oklch {
    double l, c, h;  // lightness 0..1, chroma, hue in degrees
} oklch;

// Linear-light sRGB from Oklab, after Ottosson 2020.
static void linear_from_oklch(oklch color, double rgb[3]) {
    double radians = color.h * (3.14159265358979323846 / 180);
    double a = color.c * cos(radians), b = color.c * sin(radians);
    double l = color.l + 0.3963377774 * a + 0.2158037573 * b;
    double m = color.l - 0.1055613458 * a - 0.0638541728 * b;
    double s = color.l - 0.0894841775 * a - 1.2914855480 * b;
    l = l * l * l;
    m = m * m * m;
    s = s * s * s;
    rgb[0] = 4.0767416621 * l - 3.3077115913 * m + 0.2309699292 * s;
    rgb[1] = -1.2684380046 * l + 2.6097574011 * m - 0.3413193965 * s;
    rgb[2] = -0.0041960863 * l - 0.7034186147 * m + 1.7076147010 * s;
}

static bool in_gamut(const double rgb[3]) {
    for (int i = 0; i < 3; i++) {
        if (rgb[i] < -1e-6 || rgb[i] > 1 + 1e-6) {
            return false;
        }
    }
    return true;
}

static uint8_t encode(double linear) {
    double clamped = linear < 0 ? 0 : linear > 1 ? 1 : linear;
    double encoded = clamped <= 0.0031308 ? 12.92 * clamped : 1.055 * pow(clamped, 1 / 2.4) - 0.055;
    return (uint8_t)(encoded * 255 + 0.5);
}

static void srgb_from_oklch(oklch color, uint8_t out[3]) {
    double rgb[3];
    linear_from_oklch(color, rgb);
    if (!in_gamut(rgb)) {
        double low = 0, high = color.c;
        for (int step = 0; step < 16; step++) {
            color.c = 0.5 * (low + high);
            linear_from_oklch(color, rgb);
            *(in_gamut(rgb) ? &low : &high) = color.c;
        }
        color.c = low;
        linear_from_oklch(color, rgb);
    }
    for (int i = 0; i < 3; i++) {
        out[i] = encode(rgb[i]);
    }
}

// From dark violet (hue 305) over blue and teal to yellow (hue 103).
static oklch sequential(double t) {
    return (oklch){.l = 0.24 + 0.70 * t, .c = 0.10 + 0.06 * t * t * t, .h = 305 - 202 * t};
}

// Lightness and chroma mirror about the middle.
static oklch diverging(double t) {
    double side = fabs(2 * t - 1);
    return (oklch){.l = 0.97 - 0.57 * side, .c = 0.17 * pow(side, 0.8), .h = t < 0.5 ? 255 : 35};
}

// `k`-th of the label colours: hues a golden angle apart, at four lightnesses.
static oklch label(int k) {
    return (oklch){.l = 0.52 + 0.11 * (k % 4), .c = 0.14, .h = fmod(k * 137.50776405, 360)};
}

void fm_color_map_rgb(fm_color_map map, double t, uint8_t rgb[3]) {
    double clamped = t > 0 ? (t < 1 ? t : 1) : 0;
    switch (map) {
    case FM_COLOR_DIVERGING:
        srgb_from_oklch(diverging(clamped), rgb);
        break;
    case FM_COLOR_GREY:
        rgb[0] = rgb[1] = rgb[2] = (uint8_t)(clamped * 255 + 0.5);
        break;
    case FM_COLOR_LABELS:
        srgb_from_oklch(clamped > 0 ? label((int)(clamped * 1023 + 0.5)) : (oklch){0}, rgb);
        break;
    case FM_COLOR_AUTO:
    case FM_COLOR_SEQUENTIAL:
    case FM_COLOR_PALETTE:
        srgb_from_oklch(sequential(clamped), rgb);
        break;
    }
}
