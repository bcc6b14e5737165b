// SPDX-License-Identifier: MIT
#include "world_script.h"

#include "cli.h"
#include "files.h"
#include "words.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_WORDS = 8, MAX_LINE = 512, MAX_COORDINATE = 1 << 30 };

typedef struct words {
    char text[MAX_LINE];
    const char *at[MAX_WORDS];
    int count;
} words;

// False when the line has too many words or letters for any edit.
static bool split(const char *line, words *w) {
    static const char blank[] = " \t\r\n";
    const size_t length = strcspn(line, "#\r\n");
    if (length >= sizeof w->text) {
        return false;
    }
    memcpy(w->text, line, length);
    w->text[length] = '\0';
    w->count = 0;
    char *rest = NULL;
    for (char *word = strtok_r(w->text, blank, &rest); word; word = strtok_r(NULL, blank, &rest)) {
        if (w->count == MAX_WORDS) {
            return false;
        }
        w->at[w->count++] = word;
    }
    return true;
}

static bool position(const char *text, int32_t place[3]) {
    for (int axis = 0; axis < 3; axis++) {
        char *end;
        errno = 0;
        const long long value = strtoll(text, &end, 10);
        if (end == text || errno || value < -MAX_COORDINATE || value > MAX_COORDINATE || *end != (axis < 2 ? ',' : '\0')) {
            return false;
        }
        place[axis] = (int32_t)value;
        text = end + 1;
    }
    return true;
}

static bool number(const char *text, int base, long long least, uint32_t *value) {
    char *end;
    errno = 0;
    const long long parsed = strtoll(text, &end, base);
    *value = (uint32_t)parsed;
    return end != text && !*end && !errno && parsed >= least && parsed <= (long long)UINT32_MAX;
}

// What the words of a brush are: positions, and a radius or not.
typedef struct form {
    const char *name;
    fm_brush_kind kind;
    int positions;
    bool radius;
} form;

static const form forms[] = {
    {"sphere", FM_BRUSH_SPHERE, 1, true},
    {"box", FM_BRUSH_BOX, 2, false},
    {"line", FM_BRUSH_LINE, 2, true},
    {"voxel", FM_BRUSH_SPHERE, 1, false},
};

static int wrong_form(const char *where, const form *f, bool place) {
    return cli_usage("%s: %s %s is followed by %s%s%s: see fathom world --help", where, place ? "place" : "delete", f->name,
                     f->positions == 1 ? "X,Y,Z" : "X,Y,Z X,Y,Z", f->radius ? " RADIUS" : "", place ? " [VALUE]" : "");
}

static int read_brush(const char *where, const words *w, bool place, fm_brush *brush) {
    const form *f = NULL;
    for (size_t i = 0; w->count > 1 && i < sizeof forms / sizeof forms[0]; i++) {
        f = strcmp(w->at[1], forms[i].name) == 0 ? &forms[i] : f;
    }
    if (!f) {
        return cli_usage("%s: \"%s\": sphere, box, line or voxel is wanted after %s", where, w->count > 1 ? w->at[1] : "",
                         w->at[0]);
    }
    const int least = 2 + f->positions + f->radius;
    if (w->count < least || w->count > least + place) {
        return wrong_form(where, f, place);
    }
    *brush = (fm_brush){.kind = f->kind, .voxel = place ? 0xff : 0};
    int32_t *const places[2] = {brush->from, brush->to};
    for (int i = 0; i < f->positions; i++) {
        if (!position(w->at[2 + i], places[i])) {
            return cli_usage("%s: \"%s\": X,Y,Z is wanted, whole numbers from -%d to %d without spaces", where, w->at[2 + i],
                             MAX_COORDINATE, MAX_COORDINATE);
        }
    }
    if (f->radius && !number(w->at[2 + f->positions], 10, 0, &brush->radius)) {
        return cli_usage("%s: \"%s\": a radius is a whole number, 0 or more", where, w->at[2 + f->positions]);
    }
    if (w->count > least && !number(w->at[least], 0, 1, &brush->voxel)) {
        return cli_usage("%s: \"%s\": a voxel is a number from 1 to 4294967295; delete makes air", where, w->at[least]);
    }
    return CLI_DONE;
}

static int add_step(world_script *script, const world_step *step) {
    if (script->count == script->room) {
        const uint32_t room = script->room ? 2 * script->room : 64;
        world_step *grown = room > script->room ? realloc(script->steps, room * sizeof *grown) : NULL;
        if (!grown) {
            return cli_fail("out of memory for %u edits: free some", script->count);
        }
        script->steps = grown;
        script->room = room;
    }
    script->steps[script->count++] = *step;
    return CLI_DONE;
}

int world_script_line(world_script *script, const char *where, const char *line) {
    words w;
    world_step step = {0};
    if (!split(line, &w)) {
        return cli_usage("%s: no edit is that long: see fathom world --help", where);
    }
    if (w.count == 0) {
        return CLI_DONE;
    }
    const bool place = strcmp(w.at[0], "place") == 0;
    step.update = strcmp(w.at[0], "update") == 0;
    if (step.update && w.count > 1) {
        return cli_usage("%s: \"%s\" after update: nothing is wanted there", where, w.at[1]);
    }
    if (!step.update && !place && strcmp(w.at[0], "delete") != 0) {
        return cli_usage("%s: \"%s\": place, delete or update is wanted", where, w.at[0]);
    }
    const int status = step.update ? CLI_DONE : read_brush(where, &w, place, &step.brush);
    return status == CLI_DONE ? add_step(script, &step) : status;
}

static int read_lines(world_script *script, const char *name, FILE *file) {
    char *line = NULL, where[300];
    size_t room = 0;
    int status = CLI_DONE;
    for (unsigned long number_of_line = 1; status == CLI_DONE && getline(&line, &room, file) >= 0; number_of_line++) {
        snprintf(where, sizeof where, "%s, line %lu", name, number_of_line);
        status = world_script_line(script, where, line);
    }
    free(line);
    return status == CLI_DONE && ferror(file) ? cli_fail("%s: cannot be read: %s", name, strerror(errno)) : status;
}

int world_script_file(world_script *script, const char *path) {
    if (files_is_pipe(path)) {
        return read_lines(script, "standard input", stdin);
    }
    FILE *file = fopen(path, "r");
    if (!file) {
        return cli_fail("%s: %s: name a file of edits that can be read", path, strerror(errno));
    }
    const int status = read_lines(script, path, file);
    fclose(file);
    return status;
}

void world_script_free(world_script *script) {
    free(script->steps);
}
