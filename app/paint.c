// SPDX-License-Identifier: MIT
// The program with its window: opens what it needs, runs frame after frame, and closes everything.
#include "paint.h"

#include "log.h"
#include "words.h"

#include <inttypes.h>
#include <stdio.h>

static bool open_gui(paint *p) {
    const gui_desc desc = {.window = p->window.handle,
                           .instance = p->gpu.instance,
                           .physical = p->gpu.physical,
                           .device = p->gpu.device,
                           .queue = p->gpu.queue,
                           .family = p->gpu.family,
                           .pass = p->present.chain.pass,
                           .images = PRESENT_FRAMES};
    if (!gui_open(&desc) || !present_once(&p->present, gui_upload_font, NULL)) {
        cli_fail("the panel cannot be made");
        return false;
    }
    gui_font_uploaded();
    return true;
}

static bool open_context(paint *p) {
    const options *o = p->options;
    const fm_vulkan_device adopted = gpu_adoptable(&p->gpu);
    const bool cpu = o->backend == FM_BACKEND_CPU;
    const fm_context_desc desc = {.backend = o->backend, .threads = o->threads, .log = run_log, .vulkan = cpu ? NULL : &adopted};
    fm_vulkan_device same;
    void *timeline = NULL;
    if (fm_context_create(&desc, &p->context) != FM_OK || (!cpu && fm_context_vulkan(p->context, &same, &timeline) != FM_OK)) {
        cli_library_failed();
        return false;
    }
    p->timeline = (VkSemaphore)timeline;
    fm_context_device(p->context, &p->readings.device);
    p->readings.backend = fm_context_backend(p->context);
    p->measure.by_clock = p->readings.device.kind == FM_DEVICE_SOFTWARE;
    if (!cpu && p->gpu.info.kind == FM_DEVICE_SOFTWARE) {
        fprintf(stderr, "fathom: no GPU: %s computes on the processor, so the world is small and frames are slow\n",
                p->gpu.info.name);
    }
    return true;
}

static bool open_meshes(paint *p) {
    if (!moving_open(&p->moving, p->context, p->options->mesh, p->options->mesh_y_up)) {
        cli_library_failed();
        return false;
    }
    p->flies[0] = fly_start(p->settings.shape);
    p->active = p->settings;
    log_event("ready %" PRIu64 " triangles backend %s device %s", p->moving.triangles, fm_backend_words[p->readings.backend],
              p->readings.device.name);
    paint_log_settings(p);
    return true;
}

static bool open_stage(paint *p) {
    const options *o = p->options;
    options_suit(&p->settings, &p->readings.device, true);
    p->flies[1] = fly_start(moving_shape);
    if (!stage_open(&p->stage, p->context)) {
        cli_library_failed();
        return false;
    }
    if (p->settings.meshes) {
        return open_meshes(p);
    }
    if (!(o->input ? stage_load(&p->stage, &p->settings, o->input) : stage_build(&p->stage, &p->settings))) {
        cli_library_failed();
        return false;
    }
    paint_world_changed(p, "made");
    log_event("ready %u %u %u backend %s device %s", p->stage.shape.x, p->stage.shape.y, p->stage.shape.z,
              fm_backend_words[p->readings.backend], p->readings.device.name);
    paint_log_settings(p);
    return true;
}

static void close_all(paint *p) {
    // Frames in flight read the picture's buffer.
    if (p->present.gpu && p->gpu.device) {
        vkDeviceWaitIdle(p->gpu.device);
    }
    edit_clear(&p->history);
    moving_close(&p->moving);
    stage_close(&p->stage);
    fm_context_destroy(p->context);
    gui_close();
    present_close(&p->present);
    gpu_close(&p->gpu);
    window_close(&p->window);
}

static void run(paint *p) {
    p->now = p->last = window_seconds();
    auto_begin(&p->run, &p->options->benchmark, paint_shape(p), p->last * 1e3);
    while (!p->over) {
        paint_frame(p);
    }
    if (p->readings.automatic && p->status == CLI_DONE) {
        paint_collect(p, true);
        p->status = auto_finish(&p->run, stdout);
    }
}

int paint_run(const options *o) {
    static paint paint_state;
    paint *p = &paint_state;
    *p = (paint){.options = o,
                 .settings = o->settings,
                 .history.limit = o->history_bytes,
                 .panel = true,
                 .readings.wrong_share = -1,
                 .readings.width = o->width,
                 .readings.height = o->height,
                 .readings.automatic = o->automatic};
    const gpu_desc device = {.device = o->device, .validation = o->validation};
    if (window_open(&p->window, o->width, o->height) && gpu_open(&p->gpu, p->window.handle, &device) &&
        present_open(&p->present, &p->gpu, p->window.handle) && open_gui(p) && open_context(p) && open_stage(p)) {
        run(p);
    } else {
        paint_end_failed(p);
    }
    auto_free(&p->run);
    close_all(p);
    log_event("quit validation %u", p->gpu.messages);
    return p->gpu.messages ? cli_fail("%u messages of the validation layer", p->gpu.messages) : p->status;
}
