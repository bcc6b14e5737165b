// SPDX-License-Identifier: MIT
// The program with its window: input, edits, what the panel asks for, and the picture, frame after frame.
#include "edit.h"
#include "fly.h"
#include "log.h"
#include "measure.h"
#include "panel/gui.h"
#include "present.h"
#include "run.h"
#include "stage.h"
#include "window.h"
#include "words.h"
#include "world.h"

#include "fathom/io.h"

#include <inttypes.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { EDITS_A_FRAME = 64, EDIT_TIMES = 256 };
static const double judge_every = 0.5, again_every = 5;  // seconds

typedef struct paint {
    const options *options;
    window window;
    gpu gpu;
    present present;
    fm_context *context;
    VkSemaphore timeline;  // null on the CPU backend
    stage stage;
    edit_history history;
    paint_settings settings;  // as chosen
    paint_settings active;    // as the stage has them
    paint_settings logged;    // as the log has them
    gui_request slow;         // what waits until a frame has said that it will take a while
    int slow_frames;
    readings readings;
    fly fly;
    fm_camera camera;
    bool panel;
    auto_run run;
    bool begun;   // the benchmark, with the second picture: the first pays for pipelines and memory
    bool drawn;   // the context's newest operation is a picture
    bool edited;  // since the newest update
    bool broken;  // the newest picture failed
    uint32_t edits;
    double now, last;  // seconds
    double edit_times[EDIT_TIMES];
    uint64_t edit_count;
    double judged;
    double said;  // when the message was
    bool hidden;
    uint32_t screenshots;
    bool over;
    int status;
} paint;

__attribute__((format(printf, 3, 4))) static void say(paint *p, bool failed, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(p->readings.message, sizeof p->readings.message, format, arguments);
    va_end(arguments);
    p->readings.failed = failed;
    p->said = p->now;
    if (failed) {
        fprintf(stderr, "fathom: %s\n", p->readings.message);
        log_event("failed %s", p->readings.message);
    }
}

static void say_library(paint *p, const char *what) {
    say(p, true, "%s: %s", what, fm_last_error());
}

// What cannot be gone on from.
static void end_failed(paint *p) {
    p->over = true;
    p->status = CLI_FAILED;
}

// A picture that fails is likely to fail again with the next frame: it is said once in a while.
static void say_no_picture(paint *p, const char *what) {
    if (!p->broken || p->now - p->said > again_every) {
        say_library(p, what);
    }
    p->broken = true;
}

static void log_voxels(paint *p, const char *event) {
    uint64_t solid, hash;
    if (log_wanted() && stage_count(&p->stage, &solid, &hash)) {
        log_event("%s solid %" PRIu64 " hash %016" PRIx64, event, solid, hash);
    }
}

static void log_settings(paint *p) {
    p->logged = p->settings;
    const paint_settings *s = &p->settings;
    const fm_world_method *m = &s->method;
    log_event("settings scene=%s size=%ux%ux%u field=%s algorithm=%s chunk=%u border=%s convergence=%s focus=%u march=%s view=%s "
              "shadow=%s occlusion=%d across=%c slice=%d pixels=%u vsync=%d preview=%d crosshair=%d radius=%u colour=%s file=%s",
              paint_scene_name(s->scene), s->shape.x, s->shape.y, s->shape.z, fm_field_format_words[s->format],
              fm_world_algorithm_words[m->algorithm], m->chunk, fm_world_border_words[m->border],
              fm_world_convergence_words[m->convergence], m->focus_chunks, paint_march_words[s->march], paint_view_words[s->view],
              paint_shadow_words[s->shadow], s->ambient_occlusion, "xyz"[s->slice_axis], s -> slice_index, s -> scale, s -> vsync,
              s -> preview, s -> crosshair, s -> radius, paint_color_words[s->color], s -> path);
}

// A new world begins: what belonged to the old one is forgotten.
static void world_changed(paint *p, const char *event) {
    edit_clear(&p->history);
    if (memcmp(&p->active.shape, &p->stage.shape, sizeof p->active.shape) != 0) {
        p->fly = fly_start(p->stage.shape);
    }
    p->settings.slice_index = (int32_t)paint_slices(&p->settings, p->stage.shape) / 2;
    p->active = p->settings;
    p->edited = true;
    readings_clear(&p->readings.field_ms);
    log_voxels(p, event);
}

static void count_edit(paint *p) {
    p->edit_times[p->edit_count++ % EDIT_TIMES] = p->now;
    p->edited = true;
    p->edits++;
}

static void edit(paint *p, bool erase) {
    const fm_pick *pick = &p->readings.pick;
    if (!pick->hit) {
        say(p, false, "nothing is under the cross-hair");
        return;
    }
    const fm_brush brush = edit_brush(pick->voxel, pick->face, p->settings.radius, paint_colors[p->settings.color], erase);
    bool changes;
    if (!edit_apply(&p->history, p->stage.world, &brush, &changes)) {
        say_library(p, erase ? "delete" : "place");
    } else if (changes) {
        count_edit(p);
        if (log_wanted()) {
            // The log tells of voxels as they are after the edit.
            fm_world_update(p->stage.world, NULL);
            log_event("edit %s %d %d %d radius %u", erase ? "delete" : "place", brush.from[0], brush.from[1], brush.from[2],
                      brush.radius);
            log_voxels(p, erase ? "deleted" : "placed");
        }
    }
}

static void travel(paint *p, bool back) {
    bool failed;
    if (back ? edit_undo(&p->history, p->stage.world, &failed) : edit_redo(&p->history, p->stage.world, &failed)) {
        count_edit(p);
        if (log_wanted()) {
            fm_world_update(p->stage.world, NULL);
            log_voxels(p, back ? "undone" : "redone");
        }
    } else if (failed) {
        say_library(p, back ? "undo" : "redo");
    } else {
        say(p, false, back ? "nothing to undo" : "nothing to redo");
    }
}

static void save(paint *p) {
    if (stage_save(&p->stage, p->settings.path)) {
        say(p, false, "saved %s", p->settings.path);
        log_event("saved %s", p->settings.path);
    } else {
        say_library(p, "save");
    }
}

static void screenshot(paint *p) {
    const uint32_t width = p->readings.width, height = p->readings.height;
    uint8_t *pixels = p->drawn ? malloc((size_t)width * height * 4) : NULL;
    char path[PAINT_PATH];
    FILE *taken;
    do {
        snprintf(path, sizeof path, "%s/fathom-%04u.png", p->options->pictures, ++p->screenshots);
        taken = fopen(path, "rb");
        if (taken) {
            fclose(taken);
        }
    } while (taken);
    if (pixels && fm_renderer_read(p->stage.renderer, pixels) == FM_OK &&
        fm_image_write_png(path, width, height, 4, pixels) == FM_OK) {
        say(p, false, "picture in %s", path);
        log_event("screenshot %s %u %u", path, width, height);
    } else {
        say_library(p, "screenshot");
    }
    free(pixels);
}

// Worlds are made between frames, which takes a while when they are big.
static void do_slow(paint *p) {
    if (!p->slow.rebuild && !p->slow.load) {
        return;
    }
    if (p->slow_frames-- > 0) {
        return;
    }
    const gui_request slow = p->slow;
    p->slow = (gui_request){0};
    if (!present_idle(&p->present)) {
        end_failed(p);
    } else if (slow.load ? stage_load(&p->stage, &p->settings, p->settings.path) : stage_build(&p->stage, &p->settings)) {
        say(p, false, slow.load ? "loaded %s" : "made %s", slow.load ? p->settings.path : paint_scene_name(p->settings.scene));
        world_changed(p, slow.load ? "loaded" : "made");
    } else {
        say_library(p, slow.load ? "load" : "new world");
        p->settings.scene = p->active.scene;
        p->settings.shape = p->active.shape;
    }
}

static void ask_slow(paint *p, bool load) {
    p->slow.load = load;
    p->slow.rebuild = !load;
    p->slow_frames = 2;
    say(p, false, load ? "loading %s ..." : "making %s ...", load ? p->settings.path : paint_scene_name(p->settings.scene));
}

// Brings the stage to what the panel has chosen; what cannot be is taken back.
static void apply_settings(paint *p) {
    paint_settings *s = &p->settings;
    if (s->method.algorithm == FM_WORLD_SELECTIVE && s->method.chunk == 0) {
        s->method.chunk = 32;
    }
    if (s->format != p->active.format) {
        if (!present_idle(&p->present)) {
            end_failed(p);
        } else if (stage_reformat(&p->stage, s)) {
            p->edited = true;
        } else {
            say_library(p, "field");
            s->format = p->active.format;
            s->method = p->active.method;
        }
    }
    if (memcmp(&s->method, &p->active.method, sizeof s->method) != 0) {
        if (stage_set_method(&p->stage, s)) {
            p->edited = true;
            readings_clear(&p->readings.field_ms);
            p->readings.wrong_share = -1;
            readings_clear(&p->readings.wrong);
        } else {
            say_library(p, "algorithm");
            s->method = p->active.method;
        }
    }
    paint_fit(s, p->stage.shape);
    // Scene and shape are the stage's once the world has been made.
    const paint_settings before = p->active;
    p->active = *s;
    p->active.scene = before.scene;
    p->active.shape = before.shape;
    if (log_wanted() && memcmp(&p->logged, s, sizeof p->logged) != 0) {
        log_settings(p);
    }
}

static void obey(paint *p, const window_input *input, const gui_request *asked) {
    if (p->readings.automatic) {
        p->over = p->over || input->quit || asked->quit;
        return;
    }
    if (input->undo || asked->undo) {
        travel(p, true);
    }
    if (input->redo || asked->redo) {
        travel(p, false);
    }
    if (input->save || asked->save) {
        save(p);
    }
    if (input->load || asked->load) {
        ask_slow(p, true);
    } else if (asked->rebuild) {
        ask_slow(p, false);
    }
    if (input->screenshot || asked->screenshot) {
        screenshot(p);
    }
    p->over = p->over || input->quit || asked->quit;
}

static void move(paint *p, const window_input *input) {
    const float step = p->settings.speed * (input->fast ? 4 : 1) * (float)fmin(p->now - p->last, 0.1);
    const float by[3] = {input->move[0] * step, input->move[1] * step, input->move[2] * step};
    const fly before = p->fly;
    fly_by(&p->fly, input->look, by);
    p->camera = fly_camera(&p->fly);
    if (memcmp(&before, &p->fly, sizeof before) != 0) {
        log_event("camera %.2f %.2f %.2f yaw %.3f pitch %.3f", (double)p->fly.position[0], (double)p->fly.position[1],
                  (double)p->fly.position[2], (double)p->fly.yaw, (double)p->fly.pitch);
    }
}

static void choose_brush(paint *p, const window_input *input) {
    if (input->color >= 0) {
        p->settings.color = (uint32_t)input->color;
    }
    const int radius = (int)p->settings.radius + input->wheel;
    p->settings.radius = (uint32_t)(radius < 0 ? 0 : radius > PAINT_MOST_RADIUS ? PAINT_MOST_RADIUS : radius);
    p->panel = p->panel != input->toggle_panel;
}

static fm_render_desc picture_desc(const paint *p) {
    fm_render_desc desc = paint_picture(&p->settings);
    desc.camera = p->camera;
    desc.width = p->readings.width;
    desc.height = p->readings.height;
    return desc;
}

static void look_ahead(paint *p) {
    const fm_render_desc desc = picture_desc(p);
    const fm_pick before = p->readings.pick;
    fm_pick *pick = &p->readings.pick;
    *pick = (fm_pick){0};
    if (fm_render_pick(p->stage.renderer, p->stage.world, &desc, (float)(desc.width / 2), (float)(desc.height / 2), pick) !=
        FM_OK) {
        say_no_picture(p, "pick");
        *pick = (fm_pick){0};
    }
    if (before.hit != pick->hit || memcmp(before.voxel, pick->voxel, sizeof before.voxel) != 0 || before.face != pick->face) {
        log_event("aim %d %d %d %d face %d", pick->hit, pick->voxel[0], pick->voxel[1], pick->voxel[2], pick->face);
    }
}

static void automatic_edits(paint *p) {
    fm_brush brushes[EDITS_A_FRAME];
    const double now_ms = p->now * 1e3;
    const uint32_t count = auto_edits(&p->run, now_ms, brushes, EDITS_A_FRAME);
    if (fm_world_edit(p->stage.world, brushes, count) != FM_OK) {
        say_library(p, "edit");
    }
    for (uint32_t i = 0; i < count; i++) {
        count_edit(p);
    }
}

static double update(paint *p) {
    const int32_t focus[3] = {(int32_t)p->camera.position[0], (int32_t)p->camera.position[1], (int32_t)p->camera.position[2]};
    fm_world_set_focus(p->stage.world, focus);
    double field_ms = 0;
    if (!measure_update(p->context, p->stage.world, p->edited, &p->stage.newest, &field_ms)) {
        say_library(p, "update");
        return 0;
    }
    if (p->edited || field_ms > 0) {
        readings_add(&p->readings.field_ms, field_ms);
        fm_world_stats_get(p->stage.world, &p->readings.update);
    }
    p->edited = false;
    return field_ms;
}

static void judge(paint *p) {
    p->readings.may_be_wrong = paint_may_be_wrong(&p->active.method);
    if (!p->readings.may_be_wrong || p->readings.automatic || p->now - p->judged < judge_every) {
        return;
    }
    const double before = p->readings.wrong_share;
    p->judged = p->now;
    p->drawn = false;
    p->readings.wrong_share =
        stage_wrong_share(&p->stage, &p->active, &p->camera, (double)p->readings.width / (double)p->readings.height);
    if (p->readings.wrong_share >= 0) {
        readings_add(&p->readings.wrong, 100 * p->readings.wrong_share);
    }
    if (before != p->readings.wrong_share) {
        log_event("wrong %.6f", p->readings.wrong_share);
    }
}

static void read_state(paint *p) {
    readings *r = &p->readings;
    uint32_t recent = 0;
    const uint64_t kept = p->edit_count < EDIT_TIMES ? p->edit_count : EDIT_TIMES;
    for (uint64_t i = 0; i < kept; i++) {
        recent += p->now - p->edit_times[i] < 1;
    }
    r->edits_per_second = recent;
    r->frames_per_second = 0.9 * r->frames_per_second + 0.1 / fmax(p->now - p->last, 1e-6);
    readings_add(&r->frame_ms, (p->now - p->last) * 1e3);
    readings_add(&r->edits, r->edits_per_second);
    r->undo = p->history.at;
    r->redo = p->history.count - p->history.at;
    r->history_bytes = p->history.bytes;
    r->captured = p->window.captured;
    r->message_seconds = p->now - p->said;
    r->memory_count = READINGS_MEMORY;
    if (fm_context_memory(p->context, &r->memory_count, r->memory) != FM_OK) {
        r->memory_count = 0;
    }
}

// Draws into what present_begin took. The picture of a CPU context is copied to where the device reads it.
static bool draw(paint *p, bool *rendered) {
    readings *r = &p->readings;
    const uint32_t width = p->present.chain.extent.width / p->settings.scale,
                   height = p->present.chain.extent.height / p->settings.scale;
    present_picture picture = {.width = width ? width : 1, .height = height ? height : 1};
    if (picture.width != r->width || picture.height != r->height) {
        // The old picture's buffer may go.
        if (!present_idle(&p->present)) {
            return false;
        }
        log_event("picture %u %u", picture.width, picture.height);
    }
    r->width = picture.width;
    r->height = picture.height;
    fm_render_desc desc = picture_desc(p);
    fm_brush brush = edit_brush(r->pick.voxel, r->pick.face, p->settings.radius, paint_colors[p->settings.color], false);
    desc.preview = p->settings.preview && r->pick.hit && !r->automatic ? &brush : NULL;
    fm_ticket ticket = 0;
    const fm_result result = fm_render(p->stage.renderer, p->stage.world, &desc, &ticket);
    *rendered = result == FM_OK;
    if (!*rendered) {
        say_no_picture(p, "picture");
        // The panel goes on without a picture; a benchmark has nothing to measure.
        return result != FM_ERROR_DEVICE_LOST && !r->automatic && present_end(&p->present, &picture);
    }
    p->broken = false;
    fm_volume_buffer buffer;
    if (p->timeline) {
        if (fm_renderer_vulkan(p->stage.renderer, &buffer) != FM_OK) {
            return false;
        }
        picture.buffer = (VkBuffer)buffer.buffer;
        picture.offset = buffer.offset;
        picture.timeline = p->timeline;
        picture.ticket = ticket;
    } else {
        uint8_t *pixels = present_staging(&p->present, picture.width, picture.height);
        if (!pixels || fm_renderer_read(p->stage.renderer, pixels) != FM_OK) {
            return false;
        }
        picture.buffer = p->present.frames[p->present.current].staging;
    }
    return present_end(&p->present, &picture);
}

static void record(paint *p, double field_ms, double march_ms) {
    const auto_frame frame = {.start_ms = (p->last - p->run.begin_ms * 1e-3) * 1e3,
                              .delta_ms = (p->now - p->last) * 1e3,
                              .field_ms = field_ms,
                              .march_ms = march_ms,
                              .edits = p->edits};
    if (!auto_record(&p->run, &frame)) {
        end_failed(p);
    }
    p->over = p->over || auto_over(&p->run, p->now * 1e3);
}

// Waits while there is nothing to draw on. Returns whether that is so.
static bool wait_hidden(paint *p) {
    const bool hidden = window_hidden(&p->window);
    if (hidden != p->hidden) {
        log_event(hidden ? "hidden" : "shown");
    }
    p->hidden = hidden;
    return hidden;
}

static void frame(paint *p, double *field_ms) {
    const window_input input = window_poll(&p->window, p->hidden ? 0.1 : 0);
    p->over = p->over || input.quit || run_stopped();
    if (p->window.resized) {
        p->present.stale = true;
        p->window.resized = false;
    }
    if (wait_hidden(p)) {
        p->last = window_seconds();
        return;
    }
    p->now = window_seconds();
    double march_ms = 0;
    if (p->drawn && measure_newest(p->context, &march_ms)) {
        readings_add(&p->readings.march_ms, march_ms);
    }
    if (p->begun && p->drawn) {
        record(p, *field_ms, march_ms);
    } else if (p->readings.automatic && p->drawn) {
        p->begun = true;
        auto_begin(&p->run, &p->options->benchmark, p->stage.shape, p->now * 1e3);
    }
    p->edits = 0;
    read_state(p);
    do_slow(p);
    if (p->over) {
        return;
    }
    choose_brush(p, &input);
    const gui_request asked = gui_frame(p->panel, &p->settings, &p->readings);
    apply_settings(p);
    if (p->readings.automatic) {
        p->camera = auto_camera(&p->run, p->now * 1e3);
        if (p->begun) {
            automatic_edits(p);
        }
    } else {
        move(p, &input);
        *field_ms = update(p);
        look_ahead(p);
        for (uint32_t i = 0; i < input.places + input.erases && i < EDITS_A_FRAME; i++) {
            edit(p, i >= input.places);
        }
    }
    obey(p, &input, &asked);
    *field_ms = update(p);
    judge(p);
    const present_state state = present_begin(&p->present, p->settings.vsync);
    p->drawn = false;
    if (state == PRESENT_FAILED || (state == PRESENT_READY && !draw(p, &p->drawn))) {
        end_failed(p);
    }
    p->last = p->now;
}

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
    if (!cpu && p->gpu.info.kind == FM_DEVICE_SOFTWARE) {
        fprintf(stderr, "fathom: no GPU: %s computes on the processor, so the world is small and frames are slow\n",
                p->gpu.info.name);
    }
    return true;
}

static bool open_stage(paint *p) {
    const options *o = p->options;
    options_suit(&p->settings, &p->readings.device, true);
    if (!stage_open(&p->stage, p->context) ||
        !(o->input ? stage_load(&p->stage, &p->settings, o->input) : stage_build(&p->stage, &p->settings))) {
        cli_library_failed();
        return false;
    }
    world_changed(p, "made");
    log_event("ready %u %u %u backend %s device %s", p->stage.shape.x, p->stage.shape.y, p->stage.shape.z,
              fm_backend_words[p->readings.backend], p->readings.device.name);
    log_settings(p);
    return true;
}

static void close_all(paint *p) {
    // Frames in flight read the picture's buffer.
    if (p->present.gpu && p->gpu.device) {
        vkDeviceWaitIdle(p->gpu.device);
    }
    edit_clear(&p->history);
    stage_close(&p->stage);
    fm_context_destroy(p->context);
    gui_close();
    present_close(&p->present);
    gpu_close(&p->gpu);
    window_close(&p->window);
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
    if (!window_open(&p->window, o->width, o->height) || !gpu_open(&p->gpu, p->window.handle, &device) ||
        !present_open(&p->present, &p->gpu, p->window.handle) || !open_gui(p) || !open_context(p) || !open_stage(p)) {
        end_failed(p);
    }
    double field_ms = 0;
    p->last = window_seconds();
    auto_begin(&p->run, &o->benchmark, p->stage.shape, p->last * 1e3);
    while (!p->over) {
        frame(p, &field_ms);
    }
    if (o->automatic && p->status == CLI_DONE && !auto_finish(&p->run, stdout)) {
        p->status = CLI_FAILED;
    }
    auto_free(&p->run);
    close_all(p);
    log_event("quit validation %u", p->gpu.messages);
    return p->gpu.messages ? cli_fail("%u messages of the validation layer", p->gpu.messages) : p->status;
}
