// SPDX-License-Identifier: MIT
// What keys, mouse and buttons ask for: edits, undo and redo, files, pictures.
#include "log.h"
#include "paint.h"

#include "fathom/io.h"

#include <stdio.h>
#include <stdlib.h>

void paint_count_edit(paint *p) {
    p->edit_times[p->edit_count++ % EDIT_TIMES] = p->now;
    p->edited = true;
    p->edits++;
}

static void tell_voxels(paint *p, const char *event) {
    if (log_wanted() && p->told_count < EDITS_A_FRAME) {
        p->told[p->told_count++] = event;
    }
}

// Waits for the device twice: the edit is where the cross-hair is now, and undo needs the voxels before it.
static void edit(paint *p, bool erase) {
    const fm_render_desc desc = paint_picture_desc(p);
    paint_update(p);
    if (!aim_now(&p->aim, p->stage.renderer, p->stage.world, &desc)) {
        paint_failed(p, "pick");
        return;
    }
    const fm_pick *pick = &p->aim.pick;
    if (!pick->hit) {
        message_say(&p->readings.news, p->now, "nothing is under the cross-hair");
        return;
    }
    const fm_brush brush = edit_brush(pick->voxel, pick->face, p->settings.radius, paint_colors[p->settings.color], erase);
    bool changes;
    if (!edit_apply(&p->history, p->stage.world, &brush, &changes)) {
        paint_failed(p, erase ? "delete" : "place");
    } else if (changes) {
        paint_count_edit(p);
        log_event("edit %s %d %d %d radius %u", erase ? "delete" : "place", brush.from[0], brush.from[1], brush.from[2],
                  brush.radius);
        tell_voxels(p, erase ? "deleted" : "placed");
    } else {
        message_say(&p->readings.news, p->now, "nothing changes there");
    }
}

void paint_edits(paint *p, const window_input *input) {
    for (uint32_t i = 0; i < input->places + input->erases && i < EDITS_A_FRAME; i++) {
        edit(p, i >= input->places);
    }
}

static void travel(paint *p, bool back) {
    bool failed;
    paint_update(p);
    if (back ? edit_undo(&p->history, p->stage.world, &failed) : edit_redo(&p->history, p->stage.world, &failed)) {
        paint_count_edit(p);
        tell_voxels(p, back ? "undone" : "redone");
    } else if (failed) {
        paint_failed(p, back ? "undo" : "redo");
    } else {
        message_say(&p->readings.news, p->now, back ? "nothing to undo" : "nothing to redo");
    }
}

static void save(paint *p) {
    if (stage_save(&p->stage, p->settings.path)) {
        message_say(&p->readings.news, p->now, "saved %s", p->settings.path);
        log_event("saved %s", p->settings.path);
    } else {
        paint_failed(p, "save");
    }
}

// The next name in the directory that nothing has.
static void name_screenshot(paint *p, char path[PAINT_PATH]) {
    FILE *taken;
    do {
        snprintf(path, PAINT_PATH, "%s/fathom-%04u.png", p->options->pictures, ++p->screenshots);
        taken = fopen(path, "rb");
        if (taken) {
            fclose(taken);
        }
    } while (taken);
}

// Without the brush's preview, which is in the picture that the window shows.
static bool read_bare(paint *p, uint8_t *pixels) {
    const fm_render_desc desc = paint_picture_desc(p);
    if (!p->active.meshes && p->settings.preview && fm_render(p->stage.renderer, p->stage.world, &desc, NULL) != FM_OK) {
        return false;
    }
    return paint_read_picture(p, pixels) == FM_OK;
}

static void screenshot(paint *p) {
    const uint32_t width = p->readings.width, height = p->readings.height;
    uint8_t *pixels = malloc((size_t)width * height * 4);
    char path[PAINT_PATH];
    name_screenshot(p, path);
    if (!p->drawn || !pixels) {
        message_fail(&p->readings.news, p->now, "screenshot: %s", pixels ? "there is no picture" : "out of memory: free some");
    } else if (read_bare(p, pixels) && fm_image_write_png(path, width, height, 4, pixels) == FM_OK) {
        message_say(&p->readings.news, p->now, "picture in %s", path);
        log_event("screenshot %s %u %u", path, width, height);
    } else {
        paint_failed(p, "screenshot");
    }
    free(pixels);
}

void paint_obey(paint *p, const window_input *input, const gui_request *asked) {
    p->over = p->over || input->quit || asked->quit;
    if (p->readings.automatic) {
        return;
    }
    if (input->screenshot || asked->screenshot) {
        screenshot(p);
    }
    if (p->active.meshes) {
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
        paint_ask_slow(p, true);
    } else if (asked->rebuild) {
        paint_ask_slow(p, false);
    }
}
