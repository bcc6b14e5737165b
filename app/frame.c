// SPDX-License-Identifier: MIT
// A frame: input, edits, the world's update, the picture, the panel over it. It begins by waiting for the frame before the last;
// times, answers and counts are taken when they are there. More waits are those of edits, files and screenshots in act.c, and where
// operations are measured by the clock.
#include "log.h"
#include "paint.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

static const double judge_every = 0.5;    // seconds
static const double longest_move = 0.25;  // so that meshes do not jump after a pause

static void move(paint *p, const window_input *input) {
    const float step = p->settings.speed * (input->fast ? 4 : 1) * (float)fmin(p->now - p->last, 0.1);
    const float by[3] = {input->move[0] * step, input->move[1] * step, input->move[2] * step};
    fly *f = &p->flies[p->active.meshes];
    const fly before = *f;
    fly_by(f, input->look, by);
    p->camera = fly_camera(f);
    if (memcmp(&before, f, sizeof before) != 0) {
        log_event("camera %.2f %.2f %.2f yaw %.3f pitch %.3f", (double)f->position[0], (double)f->position[1],
                  (double)f->position[2], (double)f->yaw, (double)f->pitch);
    }
}

static void choose_brush(paint *p, const window_input *input) {
    if (input->color >= 0) {
        p->settings.color = (uint32_t)input->color;
    }
    const int radius = (int)p->settings.radius + input->wheel;
    p->settings.radius = (uint32_t)(radius < 0 ? 0 : radius > PAINT_MOST_RADIUS ? PAINT_MOST_RADIUS : radius);
}

fm_shape paint_shape(const paint *p) {
    return p->active.meshes ? moving_shape : p->stage.shape;
}

fm_result paint_read_picture(paint *p, uint8_t *pixels) {
    return p->active.meshes ? fm_deferred_read(p->moving.deferred, pixels) : fm_renderer_read(p->stage.renderer, pixels);
}

fm_render_desc paint_picture_desc(const paint *p) {
    fm_render_desc desc = paint_picture(&p->settings);
    desc.camera = p->camera;
    desc.width = p->readings.width;
    desc.height = p->readings.height;
    return desc;
}

static void automatic_edits(paint *p) {
    fm_brush brushes[EDITS_A_FRAME];
    const uint32_t count = auto_edits(&p->run, p->now * 1e3, brushes, EDITS_A_FRAME);
    if (fm_world_edit(p->stage.world, brushes, count) != FM_OK) {
        paint_failed(p, "edit");
    }
    for (uint32_t i = 0; i < count; i++) {
        paint_count_edit(p);
    }
}

// What was asked for before is not part of what is measured by the clock.
static void begin_measure(paint *p) {
    if (p->measure.by_clock) {
        if (!present_quiet(&p->present)) {
            paint_end_failed(p);
        }
        measure_begin(&p->measure);
    }
}

void paint_update(paint *p) {
    fm_ticket ticket;
    bool works;
    stage_focus(&p->stage, &p->active, &p->camera);
    begin_measure(p);
    if (!stage_update(&p->stage, p->edited, &ticket, &works)) {
        paint_failed(p, "update");
    } else if (works) {
        measure_expect(&p->measure, p->context, MEASURE_FIELD, p->run.count, ticket);
    }
    p->edited = false;
}

// For programs that drive the window, once the world is up to date.
static void log_told(paint *p) {
    uint64_t solid, hash;
    if (p->told_count > 0 && stage_count(&p->stage, &solid, &hash)) {
        for (uint32_t i = 0; i < p->told_count; i++) {
            log_event("%s solid %" PRIu64 " hash %016" PRIx64, p->told[i], solid, hash);
        }
    }
    p->told_count = 0;
}

static void look_ahead(paint *p) {
    const fm_render_desc desc = paint_picture_desc(p);
    if (!p->readings.automatic && !aim_ask(&p->aim, p->stage.renderer, p->stage.world, &desc)) {
        message_no_picture(&p->readings.news, p->now, "pick");
    }
}

static void judge(paint *p) {
    readings *r = &p->readings;
    r->may_be_wrong = paint_may_be_wrong(&p->active.method);
    if (r->may_be_wrong && !r->automatic && !p->stage.judging && p->now - p->judged >= judge_every) {
        p->judged = p->now;
        stage_judge(&p->stage, &p->active, &p->camera, (double)r->width / (double)r->height);
    }
}

static void collect_aim(paint *p) {
    fm_pick *was = &p->aim_logged;
    const fm_pick *pick = &p->aim.pick;
    if (!aim_hear(&p->aim, p->context, p->stage.renderer)) {
        message_no_picture(&p->readings.news, p->now, "pick");
    }
    if (was->hit != pick->hit || memcmp(was->voxel, pick->voxel, sizeof was->voxel) != 0 || was->face != pick->face) {
        log_event("aim %d %d %d %d face %d", pick->hit, pick->voxel[0], pick->voxel[1], pick->voxel[2], pick->face);
    }
    *was = *pick;
}

static void collect_wrong(paint *p) {
    const double before = p->readings.wrong_share;
    if (stage_wrong_share(&p->stage, &p->readings.wrong_share)) {
        readings_add(&p->readings.wrong, 100 * p->readings.wrong_share);
    }
    if (before != p->readings.wrong_share) {
        log_event("wrong %.6f", p->readings.wrong_share);
    }
}

void paint_collect(paint *p, bool wait) {
    measured got;
    while (measure_next(&p->measure, p->context, wait, &got)) {
        const bool field = got.kind == MEASURE_FIELD;
        readings_add(field ? &p->readings.field_ms : &p->readings.march_ms, got.milliseconds);
        auto_add(&p->run, got.frame, field ? got.milliseconds : 0, field ? 0 : got.milliseconds);
    }
}

static void read_state(paint *p) {
    readings *r = &p->readings;
    const double frame_ms = (p->now - p->last) * 1e3;
    uint32_t recent = 0;
    const uint64_t kept = p->edit_count < EDIT_TIMES ? p->edit_count : EDIT_TIMES;
    for (uint64_t i = 0; i < kept; i++) {
        recent += p->now - p->edit_times[i] < 1;
    }
    r->edits_per_second = recent;
    r->frame_mean_ms = r->frame_mean_ms > 0 ? 0.9 * r->frame_mean_ms + 0.1 * frame_ms : frame_ms;
    readings_add(&r->frame_ms, frame_ms);
    readings_add(&r->edits, r->edits_per_second);
    r->undo = p->history.at;
    r->redo = p->history.count - p->history.at;
    r->history_bytes = p->history.bytes;
    r->triangles = p->moving.triangles;
    r->sign = p->moving.sign;
    r->captured = p->window.captured;
    r->message_seconds = p->now - r->news.said;
    r->memory_count = READINGS_MEMORY;
    if (fm_context_memory(p->context, &r->memory_count, r->memory) != FM_OK) {
        r->memory_count = 0;
    }
}

// The picture's size follows the window's.
static bool fit_picture(paint *p, present_picture *picture) {
    readings *r = &p->readings;
    const uint32_t width = p->present.chain.extent.width / p->settings.scale,
                   height = p->present.chain.extent.height / p->settings.scale;
    picture->width = width ? width : 1;
    picture->height = height ? height : 1;
    if (picture->width != r->width || picture->height != r->height) {
        // The old picture's buffer may go.
        if (!present_idle(&p->present)) {
            return false;
        }
        log_event("picture %u %u", picture->width, picture->height);
    }
    r->width = picture->width;
    r->height = picture->height;
    return true;
}

// Where the newest picture is. That of a CPU context is copied to where the device reads it.
static bool place_picture(paint *p, fm_ticket ticket, present_picture *picture) {
    fm_volume_buffer buffer;
    if (p->timeline) {
        if ((p->active.meshes ? fm_deferred_vulkan(p->moving.deferred, &buffer) : fm_renderer_vulkan(p->stage.renderer, &buffer)) !=
            FM_OK) {
            return false;
        }
        picture->buffer = (VkBuffer)buffer.buffer;
        picture->offset = buffer.offset;
        picture->timeline = p->timeline;
        picture->ticket = ticket;
        return true;
    }
    uint8_t *pixels = present_staging(&p->present, picture->width, picture->height);
    if (!pixels || paint_read_picture(p, pixels) != FM_OK) {
        return false;
    }
    picture->buffer = p->present.frames[p->present.current].staging;
    return true;
}

static bool draw_voxels(paint *p, uint32_t width, fm_ticket *ticket) {
    fm_render_desc desc = paint_picture_desc(p);
    const fm_pick *pick = &p->aim.pick;
    const fm_brush brush = edit_brush(pick->voxel, pick->face, p->settings.radius, paint_colors[p->settings.color], false);
    desc.preview = p->settings.preview && pick->hit && !p->readings.automatic ? &brush : NULL;
    desc.width = width;
    begin_measure(p);
    return fm_render(p->stage.renderer, p->stage.world, &desc, ticket) == FM_OK;
}

static bool draw_meshes(paint *p, uint32_t width, fm_ticket *ticket) {
    const paint_mesh_settings *m = &p->settings.mesh;
    bool works;
    begin_measure(p);
    if (!moving_update(&p->moving, m, p->moved, &works)) {
        return false;
    }
    if (works) {
        measure_expect(&p->measure, p->context, MEASURE_FIELD, p->run.count, p->moving.field_ticket);
        begin_measure(p);
    }
    const bool good = moving_draw(&p->moving, m, &p->camera, width, p->readings.height);
    *ticket = p->moving.picture_ticket;
    return good;
}

// Draws into what present_begin took.
static bool draw(paint *p) {
    readings *r = &p->readings;
    present_picture picture = {0};
    if (!fit_picture(p, &picture)) {
        return false;
    }
    // A test wants the first pictures to fail.
    const uint32_t width = p->pictures++ < p->options->broken_pictures ? 0 : r->width;
    fm_ticket ticket = 0;
    p->drawn = p->active.meshes ? draw_meshes(p, width, &ticket) : draw_voxels(p, width, &ticket);
    if (!p->drawn) {
        message_no_picture(&r->news, p->now, "picture");
        // The panel goes on without a picture, which fails where the device is lost; a benchmark has nothing to measure.
        return !r->automatic && present_end(&p->present, &picture);
    }
    message_picture(&r->news);
    measure_expect(&p->measure, p->context, MEASURE_MARCH, p->run.count, ticket);
    return place_picture(p, ticket, &picture) && present_end(&p->present, &picture);
}

static void show(paint *p) {
    const present_state state = present_begin(&p->present, p->settings.vsync);
    p->drawn = false;
    if (state == PRESENT_FAILED || (state == PRESENT_READY && !draw(p))) {
        paint_end_failed(p);
    }
}

// The frame before is over, now that its time is known.
static void record(paint *p) {
    if (!p->drawn || !p->readings.automatic) {
        return;
    }
    if (!p->begun) {
        p->begun = true;
        measure_forget(&p->measure);
        auto_begin(&p->run, &p->options->benchmark, paint_shape(p), p->now * 1e3);
        p->run.by_clock = p->measure.by_clock;
        return;
    }
    const auto_frame frame = {.start_ms = p->last * 1e3 - p->run.begin_ms, .delta_ms = (p->now - p->last) * 1e3, .edits = p->edits};
    p->edits = 0;
    if (!auto_record(&p->run, &frame)) {
        paint_end_failed(p);
    }
}

// Whether there is nothing to draw on.
static bool is_hidden(paint *p) {
    const bool hidden = window_hidden(&p->window);
    if (p->hidden) {
        auto_pause(&p->run, (p->now - p->last) * 1e3);
    }
    if (hidden != p->hidden) {
        log_event(hidden ? "hidden" : "shown");
        p->drawn = false;
        if (hidden && p->readings.automatic) {
            fprintf(stderr, "fathom: the benchmark waits while its window is hidden\n");
        }
    }
    p->hidden = hidden;
    return hidden;
}

static void act(paint *p, const window_input *input) {
    if (input->toggle_panel) {
        p->panel = !p->panel;
        log_event("panel %d", p->panel);
    }
    if (!p->active.meshes) {
        choose_brush(p, input);
    }
    const gui_request asked = gui_frame(p->panel, &p->settings, &p->readings);
    paint_follow(p);
    if (p->readings.automatic) {
        p->camera = auto_camera(&p->run, p->now * 1e3);
    } else {
        move(p, input);
    }
    if (p->active.meshes) {
        const double passed = p->settings.mesh.hold ? 0 : fmin(p->now - p->last, longest_move);
        p->moved = p->readings.automatic && passed > 0 ? auto_seconds(&p->run, p->now * 1e3) : p->moved + passed;
    } else if (!p->readings.automatic) {
        paint_edits(p, input);
    } else if (p->begun) {
        automatic_edits(p);
    }
    paint_obey(p, input, &asked);
}

void paint_frame(paint *p) {
    if (!present_wait(&p->present)) {
        paint_end_failed(p);
        return;
    }
    const window_input input = window_poll(&p->window, p->hidden ? 0.1 : 0);
    p->now = window_seconds();
    p->over = p->over || input.quit || run_stopped();
    if (p->window.resized) {
        p->present.stale = true;
        p->window.resized = false;
    }
    record(p);
    if (is_hidden(p)) {
        p->last = p->now;
        return;
    }
    p->over = p->over || (p->begun && auto_over(&p->run, p->now * 1e3));
    paint_collect(p, false);
    collect_aim(p);
    collect_wrong(p);
    read_state(p);
    paint_do_slow(p);
    if (p->over) {
        return;
    }
    act(p, &input);
    if (!p->active.meshes) {
        paint_update(p);
        log_told(p);
        look_ahead(p);
        judge(p);
    }
    show(p);
    p->last = p->now;
}
