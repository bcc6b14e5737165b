// SPDX-License-Identifier: MIT
// The numbers of a header, none of which is trusted. What is let through can be computed with: nothing that a ray makes of the grid
// overflows or is no number, and places in the top grid can be counted.

#include "octree/file.h"

#include <math.h>

enum { MOST_CELLS = 1 << 20, MOST_LEVELS = 20 };
static const uint64_t MOST_TOPS = UINT64_C(1) << 31, MOST_NODES = UINT64_C(1) << 62;

static fm_result check_choices(const fm_fmo_header *header, const char *name) {
    if (header->kind >= FM_OCTREE_KINDS || header->method > FM_OCTREE_GROWN || header->code > FM_OCTREE_SHORT ||
        header->attribute > FM_OCTREE_TEXTURE || header->sign > FM_SIGN_NONE || header->shared > 1) {
        return fm_fail(FM_ERROR_FORMAT,
                       "%s: header: kind %u, method %u, code %u, attribute %u, sign %u, shared %u: one of them is not known", name,
                       header->kind, header->method, header->code, header->attribute, header->sign, header->shared);
    }
    if (header->levels < 1 || header->levels > MOST_LEVELS) {
        return fm_fail(FM_ERROR_FORMAT, "%s: header: %u levels: 1 to %d are possible", name, header->levels, MOST_LEVELS);
    }
    if (header->size < 1 || header->size > MOST_CELLS) {
        return fm_fail(FM_ERROR_FORMAT, "%s: header: size %u: 1 to %d are possible", name, header->size, MOST_CELLS);
    }
    if (header->sections > FM_FMO_MOST_SECTIONS) {
        return fm_fail(FM_ERROR_FORMAT, "%s: header: %u sections: at most %d are possible", name, header->sections,
                       FM_FMO_MOST_SECTIONS);
    }
    return FM_OK;
}

// The box is what its cells fill, the last ones perhaps in part, and begins where they do.
static fm_result check_axis(const fm_fmo_header *header, const char *name, int axis) {
    const double low = (double)header->low[axis], high = (double)header->high[axis], origin = header->origin[axis];
    if (!(fabs(origin) <= FM_OCTREE_FARTHEST && fabs(low) <= FM_OCTREE_FARTHEST && fabs(high) <= FM_OCTREE_FARTHEST &&
          low < high)) {
        return fm_fail(FM_ERROR_FORMAT,
                       "%s: header: the box runs from %g to %g along axis %d, its cells from %g on: %g is the farthest possible",
                       name, low, high, axis, origin, FM_OCTREE_FARTHEST);
    }
    const uint32_t cells = header->cells[axis];
    if (cells < 1 || cells > MOST_CELLS || header->top[axis] != fm_div_up(cells, 1ull << header->levels)) {
        return fm_fail(FM_ERROR_FORMAT, "%s: header: %u cells along axis %d in a top grid of %u of 2^%u each", name, cells, axis,
                       header->top[axis], header->levels);
    }
    const double extent = high - low, slack = 1e-3 * header->cell + 1e-6 * extent;
    if (fabs(low - origin) > slack + 6e-8 * fabs(origin) || extent > cells * header->cell + slack ||
        extent < (cells - 1) * header->cell - slack) {
        return fm_fail(FM_ERROR_FORMAT, "%s: header: the box from %g to %g along axis %d is not that of %u cells of %g from %g on",
                       name, low, high, axis, cells, header->cell, origin);
    }
    return FM_OK;
}

static fm_result check_grid(const fm_fmo_header *header, const char *name) {
    if (!(header->cell >= FM_OCTREE_LEAST_CELL && header->cell <= FM_OCTREE_GREATEST_CELL) || isnan(header->threshold) ||
        !isfinite(header->band)) {
        return fm_fail(
            FM_ERROR_FORMAT, "%s: header: cell %g, threshold %g, band %g: a cell from %g to %g, and numbers, are possible", name,
            header->cell, (double)header->threshold, (double)header->band, FM_OCTREE_LEAST_CELL, FM_OCTREE_GREATEST_CELL);
    }
    double diagonal2 = 0;
    uint64_t tops = 1;
    for (int axis = 0; axis < 3; axis++) {
        FM_TRY(check_axis(header, name, axis));
        diagonal2 += pow(header->cells[axis] * header->cell, 2);
        tops *= header->top[axis];
    }
    if (tops >= MOST_TOPS) {
        return fm_fail(FM_ERROR_FORMAT, "%s: header: a top grid of %u x %u x %u: fewer than 2^31 cells are possible", name,
                       header->top[0], header->top[1], header->top[2]);
    }
    const double most = 1.001 * sqrt(diagonal2);
    if (!((double)header->cutoff > 0 && isnormal(header->cutoff) && (double)header->cutoff <= most)) {
        return fm_fail(FM_ERROR_FORMAT, "%s: header: cutoff %g: above 0, and no more than the box's diagonal, is possible", name,
                       (double)header->cutoff);
    }
    return FM_OK;
}

// They are told, and sums of them are, but nothing is taken or read by them.
static fm_result check_counts(const fm_fmo_header *header, const char *name) {
    uint64_t most = fm_max_u64(header->internal, fm_max_u64(header->empty, header->unshared_bytes));
    bool good = isfinite(header->code_error) && header->code_error >= 0;
    for (uint32_t level = 0; level < sizeof header->leaves / sizeof header->leaves[0]; level++) {
        most = fm_max_u64(most, header->leaves[level]);
        good = good && (level <= header->levels || header->leaves[level] == 0);
    }
    const uint64_t shares = sizeof header->leaves / sizeof header->leaves[0] + 2;
    if (!good || most > MOST_NODES / shares) {
        return fm_fail(FM_ERROR_FORMAT,
                       "%s: header: counts up to %llu and an error of codes of %g: no octree of %u levels has so many nodes", name,
                       (unsigned long long)most, header->code_error, header->levels);
    }
    return FM_OK;
}

// As many parts as there are cover the box, and no fewer would, but for what rounding and the coarse cells may hide.
static bool parts_cover(const fm_fmo_header *header) {
    bool good = header->part_edge >= FM_OCTREE_LEAST_CELL && header->part_edge <= FM_OCTREE_GREATEST_CELL;
    for (int axis = 0; axis < 3; axis++) {
        const double extent = (double)header->high[axis] - (double)header->low[axis];
        const double slack = header->cell + 1e-3 * extent, parts = header->parts[axis];
        good = good && parts * header->part_edge >= extent - slack && (parts - 1) * header->part_edge <= extent + slack;
    }
    return good;
}

static fm_result check_parts(const fm_fmo_header *header, const char *name) {
    const uint32_t *parts = header->parts;
    const bool any = parts[0] > 0 || parts[1] > 0 || parts[2] > 0;
    bool good = any == (header->part_edge > 0) && isfinite((float)header->part_edge) && any == (header->part_cells > 0);
    uint64_t count = 1;
    for (int axis = 0; axis < 3; axis++) {
        good = good && any == (parts[axis] > 0) && parts[axis] <= FM_FMO_MOST_ALONG;
        count *= good ? parts[axis] : 0;
    }
    if (!good || count > FM_FMO_MOST_PARTS) {
        return fm_fail(FM_ERROR_FORMAT, "%s: header: %u x %u x %u parts of %u cells, edge %g: at most %d are possible", name,
                       parts[0], parts[1], parts[2], header->part_cells, header->part_edge, FM_FMO_MOST_PARTS);
    }
    if (any && !parts_cover(header)) {
        return fm_fail(FM_ERROR_FORMAT, "%s: header: %u x %u x %u parts of edge %g do not cover the box, or too many do", name,
                       parts[0], parts[1], parts[2], header->part_edge);
    }
    return FM_OK;
}

fm_result fm_fmo_check_header(const fm_fmo_header *header, const char *name) {
    FM_TRY(check_choices(header, name));
    FM_TRY(check_grid(header, name));
    FM_TRY(check_counts(header, name));
    return check_parts(header, name);
}
