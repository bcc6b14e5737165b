// SPDX-License-Identifier: MIT
#include "shadows.h"
#include "tables.h"

#include <math.h>

void bench_shadow_print_header(FILE *stream) {
    fprintf(stream, "%-27s %8s %8s %8s %8s %8s | %7s %7s %7s %7s %7s %7s %8s\n", "shadows", "update", "field", "surface", "light",
            "frame", "share", "picture", "FLIP", "SSIM", "noise", "moving", "width");
    fprintf(stream, "%-27s %8s %8s %8s %8s %8s | %7s %7s %7s %7s %7s %7s %8s\n", "", "ms", "ms", "ms", "ms", "ms", "RMSE", "RMSE",
            "", "", "", "RMSE", "error");
}

void bench_shadow_print(FILE *stream, const bench_shadow_result *r) {
    if (r->failure[0]) {
        fprintf(stream, "%-27s failed: %s\n", r->way->name, r->failure);
        return;
    }
    char width[32] = "-", field[32] = "-";
    if (!isnan(r->width_error)) {
        snprintf(width, sizeof width, "%+.1f%%", 100 * r->width_error);
    }
    if (r->way->field) {
        snprintf(field, sizeof field, "%.3f", r->field.median);
    }
    fprintf(stream, "%-27s %8.3f %8s %8.3f %8.3f %8.3f | %7.4f %7.4f %7.4f %7.4f %7.4f %7.4f %8s\n", r->way->name, r->update.median,
            field, r->surface.median, r->light.median, r->frame.median, r->share_error, r->picture_error, r->flip, r->ssim,
            r->noise, r->moving_error, width);
}

void bench_shadow_csv_header(FILE *stream) {
    fputs("shadows,device,triangles,edge,rays,width,height,truth,light_degrees", stream);
    static const char *const stats[] = {"update", "field", "surface", "light", "frame"};
    for (int i = 0; i < 5; i++) {
        bench_csv_stats_header(stream, stats[i]);
    }
    fputs(",share_rmse,picture_rmse,flip,ssim,noise,moving_rmse,width_error,failure\n", stream);
}

void bench_shadow_csv(FILE *stream, const bench_shadow_case *what, const char *device, const bench_shadow_result *r) {
    bench_csv_text(stream, r->way->name);
    fputc(',', stream);
    bench_csv_text(stream, device);
    fprintf(stream, ",%u,%u,%u,%u,%u,%u,%g", what->triangles, what->edge, what->rays, what->width, what->height, what->truth,
            (double)what->light);
    const bench_stats *stats[] = {&r->update, &r->field, &r->surface, &r->light, &r->frame};
    for (int i = 0; i < 5; i++) {
        bench_csv_stats(stream, stats[i]);
    }
    fprintf(stream, ",%.6f,%.6f,%.6f,%.6f,%.6f,%.6f,", r->share_error, r->picture_error, r->flip, r->ssim, r->noise,
            r->moving_error);
    if (!isnan(r->width_error)) {
        fprintf(stream, "%.6f", r->width_error);
    }
    fputc(',', stream);
    bench_csv_text(stream, r->failure);
    fputc('\n', stream);
}
