// SPDX-License-Identifier: MIT
// The benchmark without a window: no call to the window system is made.
#include "run.h"

#include "fathom/io.h"
#include "measure.h"
#include "stage.h"
#include "words.h"

#include <stdlib.h>

enum { EDITS_A_FRAME = 64 };

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

static bool one_frame(stage *s, const options *o, auto_run *run, auto_frame *frame) {
    const double start = fm_now_ms();
    frame->start_ms = start - run->begin_ms;
    fm_render_desc desc = paint_picture(&o->settings);
    desc.width = o->width / o->settings.scale;
    desc.height = o->height / o->settings.scale;
    desc.camera = auto_camera(run, start);
    stage_focus(s, &o->settings, &desc.camera);
    fm_ticket ticket;
    if (!edit_world(s, run, start, frame) || fm_render(s->renderer, s->world, &desc, &ticket) != FM_OK ||
        !measure_ticket(s->context, ticket, &frame->march_ms)) {
        return false;
    }
    frame->delta_ms = fm_now_ms() - start;
    return true;
}

static int save_last(stage *s, const options *o) {
    const uint32_t width = o->width / o->settings.scale, height = o->height / o->settings.scale;
    uint8_t *pixels = malloc((size_t)width * height * 4);
    const bool good = pixels && fm_renderer_read(s->renderer, pixels) == FM_OK &&
                      fm_image_write_png(o->last_frame, width, height, 4, pixels) == FM_OK;
    const int status = good ? CLI_DONE : pixels ? cli_library_failed() : cli_fail("out of memory for the picture: free some");
    free(pixels);
    return status;
}

static int run_all(stage *s, const options *o) {
    auto_run run;
    auto_frame first = {0};
    // The first picture and the first update pay for pipelines and memory.
    fm_world_mark(s->world, &(fm_box){{0, 0, 0}, {1, 1, 1}});
    auto_begin(&run, &o->benchmark, s->shape, fm_now_ms());
    run.edits = UINT64_MAX;
    if (!one_frame(s, o, &run, &first)) {
        return cli_library_failed();
    }
    auto_begin(&run, &o->benchmark, s->shape, fm_now_ms());
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
    stage s;
    int status = CLI_DONE;
    if (!stage_open(&s, context) || !(o->input ? stage_load(&s, &own.settings, o->input) : stage_build(&s, &own.settings))) {
        status = cli_library_failed();
    } else {
        printf("%s, %s\n%s, %u x %u x %u voxels, field %s, %s; %u x %u pixels\n", device.name,
               fm_backend_words[fm_context_backend(context)], o->input ? o->input : paint_scene_name(own.settings.scene), s.shape.x,
               s.shape.y, s.shape.z, fm_field_format_words[own.settings.format],
               fm_world_algorithm_words[own.settings.method.algorithm], own.width / own.settings.scale,
               own.height / own.settings.scale);
        status = run_all(&s, &own);
    }
    stage_close(&s);
    const uint64_t messages = fm_context_validation_messages(context);
    fm_context_destroy(context);
    return messages ? cli_fail("%llu messages of the validation layer", (unsigned long long)messages) : status;
}
