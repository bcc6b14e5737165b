// SPDX-License-Identifier: MIT
// The public calls of voxels and fields: arguments are checked here, and nowhere below.

#include "mesh/sdf.h"

#include "mesh/topology.h"
#include "mesh/voxelize.h"

static fm_result check_place(const fm_context *context, const fm_volume *volume, const char *name) {
    if ((volume->buffer != NULL) != (context->gpu != NULL)) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "%s lies in %s memory: the context computes in %s memory", name,
                       volume->buffer ? "device" : "host", context->gpu ? "device" : "host");
    }
    if (volume->buffer && volume->context != context) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "%s belongs to another context", name);
    }
    return FM_OK;
}

fm_result fm_mesh_voxelize(fm_mesh *mesh, const fm_voxelize_desc *desc, fm_volume *voxels, fm_ticket *ticket) {
    static const fm_voxelize_desc defaults = {0};
    desc = desc ? desc : &defaults;
    if (!mesh || !voxels) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "%s is NULL", mesh ? "voxels" : "mesh");
    }
    if ((unsigned)desc->separation > FM_SEPARATION_6) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "separation is %d: FM_SEPARATION_26 or FM_SEPARATION_6", (int)desc->separation);
    }
    if (voxels->desc.type != FM_TYPE_U8 && voxels->desc.type != FM_TYPE_BITS) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "voxels are %s: uint8 or bits", fm_type_name(voxels->desc.type));
    }
    FM_TRY(check_place(mesh->context, voxels, "voxels"));
    if (mesh->context->gpu) {
        return fm_gpu_mesh_voxelize(mesh, desc, voxels, ticket);
    }
    FM_TRY(fm_host_voxelize(mesh, desc, voxels));
    if (ticket) {
        *ticket = 0;
    }
    return FM_OK;
}

fm_result fm_sign_resolve(fm_mesh *mesh, fm_sign wanted, fm_sdf_info *info) {
    *info = (fm_sdf_info){.sign = wanted, .sign_why = "as asked"};
    if (wanted != FM_SIGN_AUTO) {
        return FM_OK;
    }
    info->sign = FM_SIGN_WINDING;
    fm_mesh_info what;
    FM_TRY(fm_mesh_describe(mesh, &what));
    if (what.triangles == what.dropped) {
        info->sign = FM_SIGN_NONE;
        info->sign_why = "the mesh is empty";
        return FM_OK;
    }
    if (!what.closed || what.dropped > 0) {
        info->sign_why = "the mesh is not closed";
        return FM_OK;
    }
    if (what.degenerate > 0) {
        info->sign_why = "the mesh has triangles without area";
        return FM_OK;
    }
    if (what.components > 1) {
        info->sign_why = "the mesh has several parts, which may lie within each other";
        return FM_OK;
    }
    bool intersects;
    FM_TRY(fm_mesh_intersects(mesh, &intersects));
    if (intersects) {
        info->intersections = 1;
        info->sign_why = "the mesh intersects itself";
        return FM_OK;
    }
    info->sign = FM_SIGN_PSEUDONORMAL;
    info->sign_why = "the mesh is one closed surface that does not intersect itself";
    return FM_OK;
}

static fm_result check_field(const fm_mesh *mesh, const fm_sdf_desc *desc, const fm_volume *distance, const fm_volume *triangles) {
    if (!(desc->band >= 0) || !isfinite(desc->band)) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "band is %g: finite and at least 0 voxels", (double)desc->band);
    }
    if ((unsigned)desc->far_texels > FM_FAR_EXACT) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "far_texels is %d: one of FM_FAR_BAND, _FLOODED, _EXACT", (int)desc->far_texels);
    }
    if ((unsigned)desc->sign > FM_SIGN_NONE) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "sign is %d: one of FM_SIGN_AUTO, _PSEUDONORMAL, _WINDING, _NONE",
                       (int)desc->sign);
    }
    if (distance->desc.type != FM_TYPE_F32) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "distance is %s: float32", fm_type_name(distance->desc.type));
    }
    FM_TRY(check_place(mesh->context, distance, "distance"));
    if (!triangles) {
        return FM_OK;
    }
    if (triangles->desc.type != FM_TYPE_U32) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "triangles are %s: uint32", fm_type_name(triangles->desc.type));
    }
    const fm_shape shape = distance->desc.shape, own = triangles->desc.shape;
    if (!fm_shape_equal(own, shape)) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "triangles: shape is %u x %u x %u where distance has %u x %u x %u", own.x, own.y,
                       own.z, shape.x, shape.y, shape.z);
    }
    return check_place(mesh->context, triangles, "triangles");
}

fm_result fm_mesh_sdf(fm_mesh *mesh, const fm_sdf_desc *desc, fm_volume *distance, fm_volume *triangles, fm_sdf_info *info,
                      fm_ticket *ticket) {
    static const fm_sdf_desc defaults = {0};
    desc = desc ? desc : &defaults;
    if (!mesh || !distance) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "%s is NULL", mesh ? "distance" : "mesh");
    }
    FM_TRY(check_field(mesh, desc, distance, triangles));
    fm_sdf_info resolved;
    FM_TRY(fm_sign_resolve(mesh, desc->sign, &resolved));
    const fm_volume_desc *grid = &distance->desc;
    fm_sdf_plan plan = {.shape = grid->shape, .far_texels = desc->far_texels, .sign = resolved.sign};
    double widest = 0;
    for (int axis = 0; axis < 3; axis++) {
        plan.spacing[axis] = grid->spacing[axis];
        plan.origin[axis] = grid->origin[axis];
        widest = fmax(widest, grid->spacing[axis]);
    }
    plan.band = desc->far_texels == FM_FAR_EXACT ? INFINITY : (float)((desc->band > 0 ? (double)desc->band : 3) * widest);
    if (mesh->context->gpu) {
        if (grid->shape.x > UINT16_MAX || grid->shape.y > UINT16_MAX) {
            return fm_fail(FM_ERROR_UNSUPPORTED, "distance has %u x %u x %u texels: at most %d along x and y on Vulkan",
                           grid->shape.x, grid->shape.y, grid->shape.z, UINT16_MAX);
        }
        FM_TRY(fm_gpu_mesh_sdf(mesh, &plan, distance, triangles, ticket));
    } else {
        FM_TRY(fm_host_sdf(mesh, &plan, distance, triangles));
        if (ticket) {
            *ticket = 0;
        }
    }
    if (info) {
        *info = resolved;
    }
    return FM_OK;
}
