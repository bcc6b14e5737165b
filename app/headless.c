// SPDX-License-Identifier: MIT
// The benchmark without a window: no call to the window system is made.
#include "run.h"

#include "fathom/io.h"
#include "measure.h"
#include "moving.h"
#include "stage.h"
#include "words.h"

#include <inttypes.h>
#include <stdlib.h>

enum { EDITS_A_FRAME = 64 };

// One of the two is open.
typedef struct shown {
    stage voxels;
    moving_stage meshes;
} shown;

static bool edit_world(stage *s, auto_run *run, double now_ms, auto_frame *frame) {
    fm_brush brushes[EDITS_A_FRAME];
    fm_ticket ticket;
    bool works;
    frame->edits = auto_edits(run, now_ms, brushes, EDITS_A_FRAME);
    if (fm_world_edit(s->world, brushes, frame->edits) != FM_OK || !stage_update(s, frame->edits > 0, &ticket, &works)) {
        return false;
    }
    return !works || measure_ticket(s->context, ticket, &frame->field_ms);
}

static bool voxel_frame(stage *s, const options *o, auto_run *run, double start, auto_frame *frame) {
    fm_render_desc desc = paint_picture(&o->settings);
    desc.width = o->width / o->settings.scale;
    desc.height = o->height / o->settings.scale;
    desc.camera = auto_camera(run, start);
    stage_focus(s, &o->settings, &desc.camera);
    fm_ticket ticket;
    return edit_world(s, run, start, frame) && fm_render(s->renderer, s->world, &desc, &ticket) == FM_OK &&
           measure_ticket(s->context, ticket, &frame->march_ms);
}

static bool mesh_frame(moving_stage *s, const options *o, auto_run *run, double start, auto_frame *frame) {
    const paint_mesh_settings *settings = &o->settings.mesh;
    const fm_camera camera = auto_camera(run, start);
    bool works;
    return moving_update(s, settings, settings->hold ? 0 : auto_seconds(run, start), &works) &&
           (!works || measure_ticket(s->context, s->field_ticket, &frame->field_ms)) &&
           moving_draw(s, settings, &camera, o->width / o->settings.scale, o->height / o->settings.scale) &&
           measure_ticket(s->context, s->picture_ticket, &frame->march_ms);
}

static bool one_frame(shown *s, const options *o, auto_run *run, auto_frame *frame) {
    const double start = fm_now_ms();
    frame->start_ms = start - run->begin_ms;
    const bool good =
        o->settings.meshes ? mesh_frame(&s->meshes, o, run, start, frame) : voxel_frame(&s->voxels, o, run, start, frame);
    frame->delta_ms = fm_now_ms() - start;
    return good;
}

static int save_last(shown *s, const options *o) {
    const uint32_t width = o->width / o->settings.scale, height = o->height / o->settings.scale;
    uint8_t *pixels = malloc((size_t)width * height * 4);
    const bool good = pixels &&
                      (o->settings.meshes ? fm_deferred_read(s->meshes.deferred, pixels)
                                          : fm_renderer_read(s->voxels.renderer, pixels)) == FM_OK &&
                      fm_image_write_png(o->last_frame, width, height, 4, pixels) == FM_OK;
    const int status = good ? CLI_DONE : pixels ? cli_library_failed() : cli_fail("out of memory for the picture: free some");
    free(pixels);
    return status;
}

static int run_all(shown *s, const options *o) {
    auto_run run;
    auto_frame first = {0};
    const fm_shape shape = o->settings.meshes ? moving_shape : s->voxels.shape;
    // The first picture and the first update pay for pipelines and memory.
    if (!o->settings.meshes) {
        fm_world_mark(s->voxels.world, &(fm_box){{0, 0, 0}, {1, 1, 1}});
    }
    auto_begin(&run, &o->benchmark, shape, fm_now_ms());
    run.edits = UINT64_MAX;
    if (!one_frame(s, o, &run, &first)) {
        return cli_library_failed();
    }
    s->meshes.fresh = false;
    auto_begin(&run, &o->benchmark, shape, fm_now_ms());
    int status = CLI_DONE;
    while (status == CLI_DONE && !auto_over(&run, fm_now_ms()) && !run_stopped()) {
        auto_frame frame = {0};
        if (!one_frame(s, o, &run, &frame)) {
            status = cli_library_failed();
        } else if (!auto_record(&run, &frame)) {
            status = CLI_FAILED;
        }
    }
    if (status == CLI_DONE) {
        status = auto_finish(&run, stdout);
    }
    auto_free(&run);
    return status == CLI_DONE && o->last_frame ? save_last(s, o) : status;
}

static bool open_shown(shown *s, fm_context *context, options *o) {
    if (o->settings.meshes) {
        return moving_open(&s->meshes, context, o->mesh, o->mesh_y_up);
    }
    return stage_open(&s->voxels, context) &&
           (o->input ? stage_load(&s->voxels, &o->settings, o->input) : stage_build(&s->voxels, &o->settings));
}

static void print_shown(const shown *s, const options *o) {
    const paint_settings *settings = &o->settings;
    const uint32_t width = o->width / settings->scale, height = o->height / settings->scale;
    if (settings->meshes) {
        bool exact;
        printf("%s, %" PRIu64 " triangles; %s, %s; %u x %u pixels\n", o->mesh ? o->mesh : "meshes", s->meshes.triangles,
               paint_field_truth(&settings->mesh, &exact), paint_shadow_truth(&settings->mesh, &exact), width, height);
        return;
    }
    printf("%s, %u x %u x %u voxels, field %s, %s; %u x %u pixels\n", o->input ? o->input : paint_scene_name(settings->scene),
           s->voxels.shape.x, s->voxels.shape.y, s->voxels.shape.z, fm_field_format_words[settings->format],
           fm_world_algorithm_words[settings->method.algorithm], width, height);
}

int headless_run(const options *o) {
    const fm_context_desc desc = {
        .backend = o->backend, .device = o->device, .threads = o->threads, .validation = o->validation, .log = run_log};
    fm_context *context;
    if (fm_context_create(&desc, &context) != FM_OK) {
        return cli_library_failed();
    }
    fm_device_info device;
    fm_context_device(context, &device);
    options own = *o;
    options_suit(&own.settings, &device, false);
    shown s = {0};
    int status = CLI_DONE;
    if (!open_shown(&s, context, &own)) {
        status = cli_library_failed();
    } else {
        printf("%s, %s\n", device.name, fm_backend_words[fm_context_backend(context)]);
        print_shown(&s, &own);
        status = run_all(&s, &own);
    }
    stage_close(&s.voxels);
    moving_close(&s.meshes);
    const uint64_t messages = fm_context_validation_messages(context);
    fm_context_destroy(context);
    return messages ? cli_fail("%llu messages of the validation layer", (unsigned long long)messages) : status;
}
