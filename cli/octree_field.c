// SPDX-License-Identifier: MIT
#include "octree_field.h"

#include "mesh_job.h"

#include <string.h>

enum { MARGIN = 4, DEFAULT_CELLS = 256 };

// Nearly a point, for octrees' shadows are hard.
static const float SUN_SIZE = 0.1f;

const char *octree_field_wrong(const fm_octree_render_desc *desc) {
    if (desc->view == FM_OCTREE_LEVELS) {
        return "--view levels is of octrees: a dense field has none";
    }
    if (desc->reflection > 0 || desc->refraction > 0 || desc->epsilon != 0) {
        return "--reflection, --refraction and --epsilon are of octrees, not of --kind field";
    }
    return NULL;
}

static fm_result fit(octree_job *job, fm_volume_desc *grid) {
    const uint32_t cells = job->desc.size ? job->desc.size : DEFAULT_CELLS;
    if (!job->boxed) {
        const uint32_t most = (cells - 1) / 2;
        return fm_mesh_fit(job->mesh, cells, most < MARGIN ? most : MARGIN, grid);
    }
    double box[6];
    for (int axis = 0; axis < 3; axis++) {
        box[axis] = (double)job->desc.low[axis];
        box[3 + axis] = (double)job->desc.high[axis];
    }
    mesh_job_fit_box(box, cells, grid);
    return FM_OK;
}

int octree_field_make(octree_job *job, octree_field *field) {
    fm_volume_desc grid = {.type = FM_TYPE_F32};
    const fm_sdf_desc desc = {.far_texels = FM_FAR_FLOODED, .sign = job->desc.sign};
    fm_result result = fit(job, &grid);
    result = result == FM_OK ? fm_volume_create(job->context, &grid, &field->volume) : result;
    result = result == FM_OK ? fm_mesh_sdf(job->mesh, &desc, field->volume, NULL, NULL, NULL) : result;
    result = result == FM_OK ? fm_deferred_create(job->context, &field->deferred) : result;
    const uint32_t axes[3] = {grid.shape.x, grid.shape.y, grid.shape.z};
    for (int axis = 0; axis < 3; axis++) {
        const double low = grid.origin[axis] - 0.5 * grid.spacing[axis];
        job->info.low[axis] = (float)low;
        job->info.high[axis] = (float)(low + grid.spacing[axis] * axes[axis]);
    }
    return result == FM_OK ? CLI_DONE : cli_library_failed();
}

int octree_field_draw(const octree_field *field, const fm_octree_render_desc *desc, uint8_t *pixels) {
    static const fm_deferred_view views[] = {
        [FM_OCTREE_SHADED] = FM_DEFERRED_SHADED, [FM_OCTREE_NORMALS] = FM_DEFERRED_NORMAL, [FM_OCTREE_READS] = FM_DEFERRED_STEPS};
    fm_deferred_desc wanted = {.camera = desc->camera,
                               .width = desc->width,
                               .height = desc->height,
                               .surface = FM_SURFACE_FIELD,
                               .view = views[desc->view],
                               .field = field->volume,
                               .shadows = desc->shadow ? FM_SHADOWS_FIELD : FM_SHADOWS_NONE};
    if (desc->sun[0] != 0 || desc->sun[1] != 0 || desc->sun[2] != 0) {
        wanted.light_count = 1;
        wanted.lights[0] = (fm_light){.size = SUN_SIZE};
        memcpy(wanted.lights[0].way, desc->sun, sizeof desc->sun);
    }
    fm_result result = fm_deferred_render(field->deferred, &wanted, NULL);
    result = result == FM_OK && pixels ? fm_deferred_read(field->deferred, pixels) : result;
    return result == FM_OK ? CLI_DONE : cli_library_failed();
}

void octree_field_end(octree_field *field) {
    fm_deferred_destroy(field->deferred);
    fm_volume_destroy(field->volume);
}
