// SPDX-License-Identifier: MIT
// Octrees from meshes: the box, the kind, and the run through the chunks.

#include "octree/build.h"

#include "mesh/sdf.h"
#include "mesh/topology.h"
#include "octree/voxels.h"

#include <math.h>
#include <string.h>

static const uint64_t MOST_CHUNKS = UINT64_C(1) << 26;
static const double MARGIN = 4;  // cells beside the mesh in a box of its own

// --- The box ---

static bool no_box(const fm_octree_desc *desc) {
    for (int axis = 0; axis < 3; axis++) {
        if (desc->low[axis] != 0 || desc->high[axis] != 0) {
            return false;
        }
    }
    return true;
}

static fm_result own_box(fm_mesh *mesh, const fm_octree_desc *desc, double low[3], double high[3]) {
    float from[3], to[3];
    fm_mesh_bounds(mesh, from, to);
    double longest = 0, largest = 0;
    for (int axis = 0; axis < 3; axis++) {
        low[axis] = from[axis] <= to[axis] ? (double)from[axis] : 0;
        high[axis] = from[axis] <= to[axis] ? (double)to[axis] : 1;
        longest = fmax(longest, high[axis] - low[axis]);
        largest = fmax(largest, fmax(fabs(low[axis]), fabs(high[axis])));
    }
    // A point gets a box that floats can tell from it.
    longest = longest > 0 ? longest : largest > 0 ? largest * 1e-3 : 1;
    const double margin = fmin(MARGIN, desc->size / 4.0);
    const double cell = longest / (desc->size - 2 * margin);
    for (int axis = 0; axis < 3; axis++) {
        low[axis] = (double)(float)(low[axis] - margin * cell);
        high[axis] = (double)(float)(high[axis] + margin * cell);
    }
    return FM_OK;
}

fm_result fm_octree_given_box(const fm_octree_desc *desc, double low[3], double high[3]) {
    for (int axis = 0; axis < 3; axis++) {
        if (!(desc->low[axis] < desc->high[axis])) {
            return fm_fail(FM_ERROR_INVALID_ARGUMENT, "the box has no volume: along axis %d it runs from %g to %g", axis,
                           (double)desc->low[axis], (double)desc->high[axis]);
        }
        low[axis] = (double)desc->low[axis];
        high[axis] = (double)desc->high[axis];
    }
    return FM_OK;
}

fm_result fm_octree_box_of(fm_mesh *mesh, const fm_octree_desc *desc, double low[3], double high[3]) {
    return no_box(desc) ? own_box(mesh, desc, low, high) : fm_octree_given_box(desc, low, high);
}

// --- Builds of leaves with values ---

fm_result fm_octree_build_begin(fm_octree_build *build, const double low[3], const double high[3]) {
    FM_TRY(fm_octree_new(build->context, build->desc, low, high, &build->octree));
    const fm_octree_info *info = &build->octree->info;
    fm_context *context = build->context;
    build->chunk_count = 1;
    for (int axis = 0; axis < 3; axis++) {
        build->origin[axis] = info->origin[axis];
        build->cells[axis] = info->cells[axis];
        build->chunks[axis] = (uint32_t)fm_div_up(info->cells[axis], FM_CHUNK);
        build->chunk_count *= build->chunks[axis];
    }
    if (build->chunk_count > MOST_CHUNKS) {
        return fm_fail(FM_ERROR_UNSUPPORTED,
                       "%u x %u x %u cells are %llu chunks of 128^3: at most %llu are possible, choose a smaller size",
                       build->cells[0], build->cells[1], build->cells[2], (unsigned long long)build->chunk_count,
                       (unsigned long long)MOST_CHUNKS);
    }
    build->cell = info->cell;
    build->leaf_most = info->kind == FM_OCTREE_BRICKS ? 0 : (int)info->levels < FM_LEAF_MOST ? (int)info->levels : FM_LEAF_MOST;
    build->grain = info->kind == FM_OCTREE_BRICKS ? FM_BRICK_LEVEL : build->leaf_most;
    build->margin = (double)fm_octree_reach(build, build->leaf_most) + 0.5;
    build->roots.size = 4;
    build->slots = fm_octree_alloc_zero(context, build->chunk_count * sizeof *build->slots, "chunks");
    build->errors = fm_octree_alloc_zero(
        context, (uint64_t)fm_pool_threads(build->context->pool) * FM_ERROR_BINS * sizeof *build->errors, "errors of codes");
    if (!build->slots || !build->errors) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    const uint64_t top = (uint64_t)info->top[0] * info->top[1] * info->top[2];
    FM_TRY(fm_octree_more_words(build->octree, top));
    build->octree->words.count = top;
    return fm_octree_far_make(build);
}

void fm_octree_build_end(fm_octree_build *build) {
    fm_context *context = build->context;
    fm_octree_far_free(build);
    fm_octree_chunk_free(build);
    fm_octree_growth_free(build);
    fm_octree_soup_free(build, &build->soup);
    fm_octree_free(context, build->slots, build->chunk_count * sizeof *build->slots);
    fm_octree_free(context, build->errors, (uint64_t)fm_pool_threads(build->context->pool) * FM_ERROR_BINS * sizeof *build->errors);
    fm_octree_free(context, build->listed, build->first ? build->first[build->chunk_count] * sizeof *build->listed : 0);
    fm_octree_free(context, build->first, (build->chunk_count + 1) * sizeof *build->first);
    if (build->octree) {
        fm_octree_array_free(build->octree, &build->roots);
        fm_octree_destroy(build->octree);
    }
}

static fm_result build_chunk(fm_octree_build *build, uint64_t chunk) {
    fm_octree_chunk_place(build, chunk);
    FM_TRY(build->soup_of(build, chunk, &build->soup));
    if (build->soup.mesh.triangle_count == 0) {
        return FM_OK;
    }
    FM_TRY(build->desc->method == FM_OCTREE_GROWN ? fm_octree_fields_grown(build) : fm_octree_fields_exact(build));
    fm_octree_fields_finish(build);
    if (build->sign == FM_SIGN_WINDING) {
        FM_TRY(fm_octree_fields_wind(build));
    }
    if (build->desc->kind == FM_OCTREE_BRICKS) {
        return fm_octree_bricks_emit(build);
    }
    fm_octree_merge(build);
    return fm_octree_chunk_emit(build, chunk);
}

void fm_octree_tell_errors(fm_octree *octree, const uint64_t bins[FM_ERROR_BINS]) {
    const bool coded = octree->info.kind == FM_OCTREE_CLOSEST && octree->info.code != FM_OCTREE_FLOATS;
    uint64_t count = 0, seen = 0;
    for (uint32_t i = 0; i < FM_ERROR_BINS; i++) {
        count += bins[i];
    }
    for (uint32_t i = 0; coded && i < FM_ERROR_BINS && count > 0; i++) {
        seen += bins[i];
        if (seen * 100 >= count * 99) {
            octree->info.code_error = (i + 1) * (double)FM_ERROR_STEP;
            return;
        }
    }
}

static void tell_errors(fm_octree_build *build) {
    uint64_t bins[FM_ERROR_BINS] = {0};
    for (uint32_t thread = 0; thread < fm_pool_threads(build->context->pool); thread++) {
        for (uint32_t i = 0; i < FM_ERROR_BINS; i++) {
            bins[i] += build->errors[(uint64_t)thread * FM_ERROR_BINS + i];
        }
    }
    fm_octree_tell_errors(build->octree, bins);
}

fm_result fm_octree_finish(fm_octree *octree) {
    fm_octree_info *info = &octree->info;
    fm_octree_counted(octree);
    info->unshared_bytes = info->node_bytes + info->leaf_bytes + info->attribute_bytes;
    if (octree->desc.share && info->kind != FM_OCTREE_BRICKS) {
        FM_TRY(fm_octree_share(octree));
        fm_octree_counted(octree);
    }
    return FM_OK;
}

fm_result fm_octree_build_run(fm_octree_build *build) {
    FM_TRY(fm_octree_far_finish(build));
    FM_TRY(fm_octree_chunk_make(build));
    const bool bricks = build->desc->kind == FM_OCTREE_BRICKS;
    if (bricks) {
        fm_octree_bricks_clear(build);
    }
    for (uint64_t chunk = 0; chunk < build->chunk_count; chunk++) {
        FM_TRY(build_chunk(build, chunk));
    }
    fm_octree_chunk_free(build);
    if (!bricks) {
        FM_TRY(fm_octree_join(build));
    }
    fm_octree_array_free(build->octree, &build->roots);
    tell_errors(build);
    return fm_octree_finish(build->octree);
}

static fm_result build_leaves(fm_mesh *mesh, const fm_octree_desc *desc, const double low[3], const double high[3],
                              fm_octree **octree) {
    if (fm_gpu_octree_builds(mesh, desc)) {
        const fm_result there = fm_gpu_octree_build(mesh, desc, low, high, octree);
        if (there != FM_ERROR_OUT_OF_DEVICE_MEMORY && there != FM_ERROR_UNSUPPORTED) {
            return there;
        }
    }
    fm_octree_build build = {
        .context = mesh->context, .desc = desc, .mesh = mesh, .sign = desc->sign, .soup_of = fm_octree_soup_of_mesh};
    if (build.sign == FM_SIGN_PSEUDONORMAL) {
        FM_TRY(fm_pseudonormals_prepare(mesh));
    }
    fm_result result = fm_octree_build_begin(&build, low, high);
    result = result == FM_OK ? fm_octree_sort_mesh(&build) : result;
    result = result == FM_OK ? fm_octree_build_run(&build) : result;
    if (result == FM_OK) {
        *octree = build.octree;
        build.octree = NULL;
    }
    fm_octree_build_end(&build);
    return result;
}

// --- The call ---

fm_result fm_octree_check_attribute(const fm_octree_desc *desc) {
    const fm_voxel_kind *voxels = fm_voxel_kind_of(desc->kind);
    const bool numbers = voxels && !voxels->colorless && desc->attribute != FM_OCTREE_TEXTURE;
    if (desc->attribute != FM_OCTREE_PLAIN && desc->kind != FM_OCTREE_CLOSEST && !numbers) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT,
                       "attribute is %d with kind %s: FM_OCTREE_CLOSEST keeps all, _VOXELS, _CONTOURS and _TREE64 keep "
                       "FM_OCTREE_TRIANGLE and _COLOR, the others only FM_OCTREE_PLAIN",
                       (int)desc->attribute, fm_octree_kind_name(desc->kind));
    }
    return FM_OK;
}

static fm_result check_attribute(const fm_octree_desc *desc) {
    FM_TRY(fm_octree_check_attribute(desc));
    if (desc->attribute == FM_OCTREE_COLOR && !desc->colors) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "colors is NULL: attribute FM_OCTREE_COLOR needs one of each vertex");
    }
    if (desc->attribute == FM_OCTREE_TEXTURE && !desc->texture) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "texture is NULL: attribute FM_OCTREE_TEXTURE needs two of each vertex");
    }
    return FM_OK;
}

static fm_result check_sign(fm_mesh *mesh, fm_octree_desc *desc) {
    if (desc->kind != FM_OCTREE_DISTANCE && desc->kind != FM_OCTREE_BRICKS) {
        desc->sign = FM_SIGN_NONE;
        return FM_OK;
    }
    // A sheet has no inside: winding numbers reach 1/2 nowhere, and unlike a field an octree of the outside alone shows nothing.
    if (desc->sign == FM_SIGN_AUTO) {
        fm_mesh_info what;
        FM_TRY(fm_mesh_describe(mesh, &what));
        if (what.boundary > 0 || what.misoriented > 0 || what.dropped > 0) {
            desc->sign = FM_SIGN_NONE;
            return FM_OK;
        }
    }
    fm_sdf_info resolved;
    FM_TRY(fm_sign_resolve(mesh, desc->sign, &resolved));
    desc->sign = resolved.sign;
    return FM_OK;
}

fm_result fm_octree_build_mesh(fm_mesh *mesh, const fm_octree_desc *desc, fm_octree **octree) {
    if (!mesh || !octree) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "%s is NULL", mesh ? "octree" : "mesh");
    }
    const uint64_t start = fm_now_ns();
    fm_octree_desc filled;
    double low[3], high[3];
    FM_TRY(fm_octree_check_desc(desc, &filled));
    FM_TRY(check_attribute(&filled));
    if (filled.kind == FM_OCTREE_BRICKS) {
        // The top grid is the only one, and a brick is kept where one of its corners is within the band.
        filled.top_bytes = UINT64_MAX;
        filled.share = false;
        filled.band = 3;
    }
    FM_TRY(fm_octree_box_of(mesh, &filled, low, high));
    FM_TRY(check_sign(mesh, &filled));
    fm_octree *made = NULL;
    switch (filled.kind) {
    case FM_OCTREE_CLOSEST:
    case FM_OCTREE_DISTANCE:
    case FM_OCTREE_BRICKS:
        FM_TRY(build_leaves(mesh, &filled, low, high, &made));
        break;
    default:
        FM_TRY(fm_octree_voxels_from_mesh(mesh, &filled, low, high, &made));
    }
    made->info.build_ms = (double)(fm_now_ns() - start) * 1e-6;
    *octree = made;
    return FM_OK;
}
