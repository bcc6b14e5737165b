// SPDX-License-Identifier: MIT
#include "image_error.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

static const double pi = 3.14159265358979323846;

enum { MAX_RADIUS = 64, CHANNELS = 3 };

// Weights of an odd number of neighbours along an axis.
typedef struct kernel {
    int radius;
    float weight[2 * MAX_RADIUS + 1];
} kernel;

static size_t pixels(const image *picture) {
    return (size_t)picture->width * picture->height;
}

static int within(int at, int size) {
    return at < 0 ? 0 : at >= size ? size - 1 : at;
}

// target = source filtered along x, then y; pixels beyond the edge are those of the edge. `middle` is scratch memory.
static void filter(const float *source, const image *shape, const kernel *along_x, const kernel *along_y, float *middle,
                   float *target) {
    const int width = (int)shape->width, height = (int)shape->height;
    for (int y = 0; y < height; y++) {
        for (int x = 0; x < width; x++) {
            float sum = 0;
            for (int i = -along_x->radius; i <= along_x->radius; i++) {
                sum += along_x->weight[i + along_x->radius] * source[(size_t)y * width + within(x + i, width)];
            }
            middle[(size_t)y * width + x] = sum;
        }
    }
    for (int y = 0; y < height; y++) {
        float *row = target + (size_t)y * width;
        memset(row, 0, (size_t)width * sizeof *row);
        for (int i = -along_y->radius; i <= along_y->radius; i++) {
            const float *from = middle + (size_t)within(y + i, height) * width, weight = along_y->weight[i + along_y->radius];
            for (int x = 0; x < width; x++) {
                row[x] += weight * from[x];
            }
        }
    }
}

double image_rmse(const image *test, const image *reference) {
    const size_t count = pixels(test) * 3;
    double sum = 0;
    for (size_t i = 0; i < count; i++) {
        const double difference = (double)test->rgb[i] - reference->rgb[i];
        sum += difference * difference;
    }
    return sqrt(sum / (double)count);
}

// ---------------------------------------------------------------------------------------------------------------------------
// Structural similarity
// ---------------------------------------------------------------------------------------------------------------------------

static kernel gaussian(double deviation, int radius) {
    kernel k = {.radius = radius};
    double sum = 0;
    for (int i = -radius; i <= radius; i++) {
        sum += exp(-i * i / (2 * deviation * deviation));
    }
    for (int i = -radius; i <= radius; i++) {
        k.weight[i + radius] = (float)(exp(-i * i / (2 * deviation * deviation)) / sum);
    }
    return k;
}

// The first plane: x; then y, xx, yy, xy.
static void moments(const image *test, const image *reference, float *planes) {
    const size_t count = pixels(test);
    for (size_t i = 0; i < count; i++) {
        const float *a = test->rgb + 3 * i, *b = reference->rgb + 3 * i;
        const float x = 0.299f * a[0] + 0.587f * a[1] + 0.114f * a[2], y = 0.299f * b[0] + 0.587f * b[1] + 0.114f * b[2];
        const float values[5] = {x, y, x * x, y * y, x * y};
        for (int plane = 0; plane < 5; plane++) {
            planes[plane * count + i] = values[plane];
        }
    }
}

double image_ssim(const image *test, const image *reference) {
    enum { PLANES = 5 };
    const size_t count = pixels(test);
    float *memory = malloc((2 * PLANES + 1) * count * sizeof *memory);
    if (!memory) {
        return -1;
    }
    float *planes = memory, *means = memory + PLANES * count, *middle = means + PLANES * count;
    moments(test, reference, planes);
    const kernel k = gaussian(1.5, 5);
    for (int plane = 0; plane < PLANES; plane++) {
        filter(planes + plane * count, test, &k, &k, middle, means + plane * count);
    }
    const double c1 = 0.01 * 0.01, c2 = 0.03 * 0.03;
    double sum = 0;
    for (size_t i = 0; i < count; i++) {
        const double x = means[i], y = means[count + i];
        const double xx = means[2 * count + i] - x * x, yy = means[3 * count + i] - y * y, xy = means[4 * count + i] - x * y;
        sum += (2 * x * y + c1) * (2 * xy + c2) / ((x * x + y * y + c1) * (xx + yy + c2));
    }
    free(memory);
    return sum / (double)count;
}

// ---------------------------------------------------------------------------------------------------------------------------
// FLIP
// ---------------------------------------------------------------------------------------------------------------------------

typedef struct color {
    double v[CHANNELS];
} color;

static const double to_xyz[3][3] = {{10135552.0 / 24577794, 8788810.0 / 24577794, 4435075.0 / 24577794},
                                    {2613072.0 / 12288897, 8788810.0 / 12288897, 887015.0 / 12288897},
                                    {1425312.0 / 73733382, 8788810.0 / 73733382, 70074185.0 / 73733382}};
static const double from_xyz[3][3] = {
    {3.241003275, -1.537398934, -0.498615861}, {-0.969224334, 1.875930071, 0.041554224}, {0.055639423, -0.204011202, 1.057148933}};

static color transform(const double matrix[3][3], color c) {
    color result;
    for (int row = 0; row < 3; row++) {
        result.v[row] = matrix[row][0] * c.v[0] + matrix[row][1] * c.v[1] + matrix[row][2] * c.v[2];
    }
    return result;
}

// White's place in XYZ.
static color white(void) {
    return transform(to_xyz, (color){{1, 1, 1}});
}

static double linear(double shown) {
    return shown <= 0.04045 ? shown / 12.92 : pow((shown + 0.055) / 1.055, 2.4);
}

// From linear RGB to the opponent space in which contrast is seen, and back.
static color opponent(color rgb) {
    const color xyz = transform(to_xyz, rgb), w = white();
    const double x = xyz.v[0] / w.v[0], y = xyz.v[1] / w.v[1], z = xyz.v[2] / w.v[2];
    return (color){{116 * y - 16, 500 * (x - y), 200 * (y - z)}};
}

static color from_opponent(color c) {
    const color w = white();
    const double y = (c.v[0] + 16) / 116, x = y + c.v[1] / 500, z = y - c.v[2] / 200;
    return transform(from_xyz, (color){{x * w.v[0], y * w.v[1], z * w.v[2]}});
}

static double lab_part(double t) {
    const double delta = 6.0 / 29;
    return t > delta * delta * delta ? cbrt(t) : t / (3 * delta * delta) + 4.0 / 29;
}

// CIELAB of linear RGB, with colours weaker in the dark (Hunt effect).
static color lab(color rgb) {
    const color xyz = transform(to_xyz, rgb), w = white();
    const double x = lab_part(xyz.v[0] / w.v[0]), y = lab_part(xyz.v[1] / w.v[1]), z = lab_part(xyz.v[2] / w.v[2]);
    const double lightness = 116 * y - 16;
    return (color){{lightness, 0.01 * lightness * 500 * (x - y), 0.01 * lightness * 200 * (y - z)}};
}

static double hyab(color a, color b) {
    return fabs(a.v[0] - b.v[0]) + hypot(a.v[1] - b.v[1], a.v[2] - b.v[2]);
}

// A channel's contrast sensitivity: a sum of two Gaussians in space, each of them a product of one along x and one along y.
typedef struct sensitivity {
    double a[2], b[2];
} sensitivity;

static const sensitivity sensitivities[CHANNELS] = {
    {{1, 0}, {0.0047, 1e-5}}, {{1, 0}, {0.0053, 1e-5}}, {{34.1, 13.5}, {0.04, 0.025}}};

// The terms as kernels, weighted so that both together sum to 1. Returns how many there are.
static int sensitivity_kernels(const sensitivity *s, double pixels_per_degree, kernel terms[2]) {
    const int radius = (int)ceil(3 * sqrt(0.04 / (2 * pi * pi)) * pixels_per_degree);
    double total = 0, factor[2];
    int count = 0;
    for (int term = 0; term < 2 && s->a[term] > 0; term++) {
        double sum = 0;
        terms[term].radius = radius < MAX_RADIUS ? radius : MAX_RADIUS;
        for (int i = -terms[term].radius; i <= terms[term].radius; i++) {
            const double at = i / pixels_per_degree, value = exp(-pi * pi * at * at / s->b[term]);
            terms[term].weight[i + terms[term].radius] = (float)value;
            sum += value;
        }
        factor[term] = s->a[term] * sqrt(pi / s->b[term]);
        total += factor[term] * sum * sum;
        count = term + 1;
    }
    for (int term = 0; term < count; term++) {
        for (int i = 0; i <= 2 * terms[term].radius; i++) {
            terms[term].weight[i] *= (float)sqrt(factor[term] / total);
        }
    }
    return count;
}

// What of a picture the eye tells apart, as CIELAB: three planes in `seen`. `scratch` holds six.
static void perceive(const image *picture, double pixels_per_degree, float *scratch, float *seen) {
    const size_t count = pixels(picture);
    for (size_t i = 0; i < count; i++) {
        const float *p = picture->rgb + 3 * i;
        const color c = opponent((color){{linear(p[0]), linear(p[1]), linear(p[2])}});
        for (int channel = 0; channel < CHANNELS; channel++) {
            scratch[channel * count + i] = (float)c.v[channel];
        }
    }
    float *middle = scratch + 3 * count, *part = scratch + 4 * count;
    for (int channel = 0; channel < CHANNELS; channel++) {
        kernel terms[2];
        const int term_count = sensitivity_kernels(&sensitivities[channel], pixels_per_degree, terms);
        float *plane = seen + channel * count;
        memset(plane, 0, count * sizeof *plane);
        for (int term = 0; term < term_count; term++) {
            filter(scratch + channel * count, picture, &terms[term], &terms[term], middle, part);
            for (size_t i = 0; i < count; i++) {
                plane[i] += part[i];
            }
        }
    }
    for (size_t i = 0; i < count; i++) {
        color rgb = from_opponent((color){{seen[i], seen[count + i], seen[2 * count + i]}});
        for (int channel = 0; channel < CHANNELS; channel++) {
            rgb.v[channel] = fmin(fmax(rgb.v[channel], 0), 1);
        }
        const color c = lab(rgb);
        for (int channel = 0; channel < CHANNELS; channel++) {
            seen[channel * count + i] = (float)c.v[channel];
        }
    }
}

// Weights of a derivative of a Gaussian: what is above 0 sums to 1, what is below to -1.
static kernel derivative(double deviation, int order) {
    kernel k = {.radius = (int)ceil(3 * deviation)};
    k.radius = k.radius < MAX_RADIUS ? k.radius : MAX_RADIUS;
    double above = 0, below = 0;
    for (int i = -k.radius; i <= k.radius; i++) {
        const double g = exp(-i * i / (2 * deviation * deviation));
        const double value = order == 1 ? -i * g : (i * i / (deviation * deviation) - 1) * g;
        k.weight[i + k.radius] = (float)value;
        above += value > 0 ? value : 0;
        below -= value < 0 ? value : 0;
    }
    for (int i = 0; i <= 2 * k.radius; i++) {
        k.weight[i] /= (float)(k.weight[i] > 0 ? above : below);
    }
    return k;
}

// Strength of edges (order 1) or points (order 2) in a plane of luminance.
static void features(const float *luminance, const image *shape, double deviation, int order, float *scratch, float *strength) {
    const size_t count = pixels(shape);
    const kernel across = derivative(deviation, order), along = gaussian(deviation, across.radius);
    float *middle = scratch, *part = scratch + count;
    filter(luminance, shape, &across, &along, middle, strength);
    filter(luminance, shape, &along, &across, middle, part);
    for (size_t i = 0; i < count; i++) {
        strength[i] = hypotf(strength[i], part[i]);
    }
}

// The greatest difference in strength of edges or points between both pictures: `difference`. `scratch` holds five planes.
static void feature_differences(const image *test, const image *reference, double pixels_per_degree, float *scratch,
                                float *difference) {
    const size_t count = pixels(test);
    float *luminance = scratch, *work = scratch + count, *first = scratch + 3 * count, *second = scratch + 4 * count;
    memset(difference, 0, count * sizeof *difference);
    for (int order = 1; order <= 2; order++) {
        for (int which = 0; which < 2; which++) {
            const image *picture = which ? reference : test;
            for (size_t i = 0; i < count; i++) {
                const float *p = picture->rgb + 3 * i;
                luminance[i] = (float)((opponent((color){{linear(p[0]), linear(p[1]), linear(p[2])}}).v[0] + 16) / 116);
            }
            features(luminance, test, 0.5 * 0.082 * pixels_per_degree, order, work, which ? second : first);
        }
        for (size_t i = 0; i < count; i++) {
            difference[i] = fmaxf(difference[i], fabsf(first[i] - second[i]));
        }
    }
}

double image_flip(const image *test, const image *reference, double pixels_per_degree, float *map) {
    const size_t count = pixels(test);
    const double degree = pixels_per_degree > 0 ? pixels_per_degree : 0.7 * 3840 / 0.7 * pi / 180;
    float *memory = malloc(13 * count * sizeof *memory);
    if (!memory) {
        return -1;
    }
    float *seen[2] = {memory, memory + 3 * count}, *difference = memory + 6 * count, *scratch = memory + 7 * count;
    perceive(test, degree, scratch, seen[0]);
    perceive(reference, degree, scratch, seen[1]);
    feature_differences(test, reference, degree, scratch, difference);
    const double color_power = 0.7, knee = 0.4, knee_value = 0.95;
    const double most = pow(hyab(lab((color){{0, 1, 0}}), lab((color){{0, 0, 1}})), color_power);
    double sum = 0;
    for (size_t i = 0; i < count; i++) {
        color c[2];
        for (int channel = 0; channel < CHANNELS; channel++) {
            c[0].v[channel] = seen[0][channel * count + i];
            c[1].v[channel] = seen[1][channel * count + i];
        }
        const double error = pow(hyab(c[0], c[1]), color_power);
        const double by_color = error < knee * most ? error * knee_value / (knee * most)
                                                    : knee_value + (error - knee * most) / (most - knee * most) * (1 - knee_value);
        const double by_feature = sqrt(difference[i] / sqrt(2));
        const double value = by_color > 0 ? pow(by_color, 1 - by_feature) : 0;
        sum += value;
        if (map) {
            map[i] = (float)value;
        }
    }
    free(memory);
    return sum / (double)count;
}
