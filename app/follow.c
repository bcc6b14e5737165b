// SPDX-License-Identifier: MIT
// The stage follows what is chosen: method and format at once, worlds between frames. What cannot be is taken back.
#include "log.h"
#include "paint.h"
#include "words.h"

#include <inttypes.h>
#include <stdio.h>
#include <string.h>

static const char *mesh_words(const paint_settings *s) {
    static char text[256];
    char band[16];
    const paint_mesh_settings *m = &s->mesh;
    snprintf(band, sizeof band, m->band ? "%u" : "all", m->band);
    snprintf(text, sizeof text,
             "mode=%s hold=%d field=%s edge=%u band=%s sign=%s rays=%u flood=%s surface=%s seen=%s shadows=%s samples=%u map=%u "
             "light=%.2f "
             "blend=%d",
             s->meshes ? "meshes" : "voxels", m->hold, paint_mesh_field_words[m->field], m->edge, band, paint_sign_words[m->sign],
             m->rays, paint_flood_words[m->flood], paint_mesh_surface_words[m->surface], paint_mesh_view_words[m->view],
             paint_mesh_shadow_words[m->shadows], m->samples, m->map, (double)m->light, m->blend);
    return text;
}

void paint_log_settings(paint *p) {
    p->logged = p->settings;
    const paint_settings *s = &p->settings;
    const fm_world_method *m = &s->method;
    log_event("settings scene=%s size=%ux%ux%u format=%s algorithm=%s chunk=%u border=%s convergence=%s focus=%u march=%s view=%s "
              "shadow=%s occlusion=%d across=%c slice=%d pixels=%u vsync=%d preview=%d crosshair=%d radius=%u color=%s speed=%.1f "
              "%s file=%s",
              paint_world_name(s), s->shape.x, s->shape.y, s->shape.z, fm_field_format_words[s->format],
              fm_world_algorithm_words[m->algorithm], m->chunk, fm_world_border_words[m->border],
              fm_world_convergence_words[m->convergence], m->focus_chunks, fm_march_words[s->march], fm_view_words[s->view],
              fm_shadow_words[s->shadow], s->ambient_occlusion, "xyz"[s->slice_axis], s -> slice_index, s -> scale, s -> vsync,
              s -> preview, s -> crosshair, s -> radius, paint_color_words[s->color], (double)s -> speed, mesh_words(s), s -> path);
}

void paint_world_changed(paint *p, const char *event) {
    uint64_t solid, hash;
    edit_clear(&p->history);
    aim_forget(&p->aim);
    if (memcmp(&p->active.shape, &p->stage.shape, sizeof p->active.shape) != 0) {
        p->flies[0] = fly_start(p->stage.shape);
    }
    p->settings.slice_index = (int32_t)paint_slices(&p->settings, p->stage.shape) / 2;
    p->active = p->settings;
    p->edited = true;
    readings_clear(&p->readings.field_ms);
    if (log_wanted() && stage_count(&p->stage, &solid, &hash)) {
        log_event("%s solid %" PRIu64 " hash %016" PRIx64, event, solid, hash);
    }
}

// What the stage shows stays.
static void keep_world(paint_settings *s, const paint_settings *shown) {
    s->scene = shown->scene;
    s->shape = shown->shape;
    s->scene_shape = shown->scene_shape;
    memcpy(s->loaded, shown->loaded, sizeof s->loaded);
}

void paint_ask_slow(paint *p, bool load) {
    p->slow.load = load;
    p->slow.rebuild = !load;
    p->slow_frames = 2;
    message_say(&p->readings.news, p->now, load ? "loading %s ..." : "making %s ...",
                load ? p->settings.path : paint_scene_name(p->settings.scene));
}

void paint_do_slow(paint *p) {
    if ((!p->slow.rebuild && !p->slow.load) || p->slow_frames-- > 0) {
        return;
    }
    const bool load = p->slow.load, first = !p->stage.world;
    p->slow = (gui_request){0};
    if (!present_idle(&p->present)) {
        paint_end_failed(p);
    } else if (load ? stage_load(&p->stage, &p->settings, p->settings.path) : stage_build(&p->stage, &p->settings)) {
        message_say(&p->readings.news, p->now, "%s %s%s", load ? "loaded" : "made",
                    load ? p->settings.path : paint_scene_name(p->settings.scene),
                    p->history.count > 0 ? "; undo history cleared" : "");
        paint_world_changed(p, load ? "loaded" : "made");
        p->settings.meshes = p->settings.meshes && !first;
    } else {
        paint_failed(p, load ? "load" : "new world");
        keep_world(&p->settings, &p->active);
    }
}

static void follow_format(paint *p) {
    paint_settings *s = &p->settings;
    if (!present_idle(&p->present)) {
        paint_end_failed(p);
    } else if (stage_reformat(&p->stage, s)) {
        aim_forget(&p->aim);
        p->edited = true;
    } else {
        paint_failed(p, "format");
        s->format = p->active.format;
        s->method = p->active.method;
    }
}

static void follow_method(paint *p) {
    paint_settings *s = &p->settings;
    if (stage_set_method(&p->stage, s)) {
        p->edited = true;
        readings_clear(&p->readings.field_ms);
        p->readings.wrong_share = -1;
        readings_clear(&p->readings.wrong);
    } else {
        paint_failed(p, "algorithm");
        s->method = p->active.method;
    }
}

// Voxels and meshes are made when they are first shown, and kept.
static void follow_mode(paint *p) {
    paint_settings *s = &p->settings;
    if (!s->meshes && !p->stage.world) {
        s->meshes = true;
        paint_ask_slow(p, false);
        return;
    }
    if (s->meshes && !p->moving.scene && !moving_open(&p->moving, p->context, p->options->mesh, p->options->mesh_y_up)) {
        paint_failed(p, "meshes");
        moving_close(&p->moving);
        s->meshes = false;
        return;
    }
    p->active.meshes = s->meshes;
    measure_forget(&p->measure);
    readings_clear(&p->readings.field_ms);
    readings_clear(&p->readings.march_ms);
}

static void follow_voxels(paint *p) {
    paint_settings *s = &p->settings;
    if (s->method.algorithm == FM_WORLD_SELECTIVE && s->method.chunk == 0) {
        s->method.chunk = 32;
    }
    if (s->format != p->active.format) {
        follow_format(p);
    }
    if (memcmp(&s->method, &p->active.method, sizeof s->method) != 0) {
        follow_method(p);
    }
    paint_fit(s, p->stage.shape);
}

static bool is_other_field(const paint_mesh_settings *a, const paint_mesh_settings *b) {
    return a->field != b->field || a->edge != b->edge || a->band != b->band || a->sign != b->sign || a->rays != b->rays ||
           a->flood != b->flood;
}

void paint_follow(paint *p) {
    const paint_settings *s = &p->settings;
    if (s->meshes != p->active.meshes) {
        follow_mode(p);
    }
    if (!s->meshes) {
        follow_voxels(p);
    }
    if (is_other_field(&s->mesh, &p->active.mesh)) {
        readings_clear(&p->readings.field_ms);
    }
    // Scene and shape are the stage's once the world has been made.
    const paint_settings before = p->active;
    p->active = *s;
    keep_world(&p->active, &before);
    if (log_wanted() && memcmp(&p->logged, s, sizeof p->logged) != 0) {
        paint_log_settings(p);
    }
}
