// SPDX-License-Identifier: MIT
#include "log.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

enum { MAX_WIDGETS = 256, NAME = 48, REST_FRAMES = 4 };

typedef struct widget {
    char name[NAME];
    int place[4];
    bool seen;
} widget;

static FILE *stream;
static widget widgets[MAX_WIDGETS];
static int widget_count;
static int quiet_frames;

bool log_open(const char *path) {
    stream = path ? fopen(path, "w") : NULL;
    if (stream) {
        setvbuf(stream, NULL, _IOLBF, 0);
    }
    return stream || !path;
}

void log_close(void) {
    if (stream) {
        fclose(stream);
    }
    stream = NULL;
}

bool log_wanted(void) {
    return stream != NULL;
}

void log_event(const char *format, ...) {
    if (stream) {
        va_list arguments;
        va_start(arguments, format);
        vfprintf(stream, format, arguments);
        va_end(arguments);
        fputc('\n', stream);
        quiet_frames = 0;
    }
}

static widget *find_widget(const char *name) {
    for (int i = 0; i < widget_count; i++) {
        if (strcmp(widgets[i].name, name) == 0) {
            return &widgets[i];
        }
    }
    if (widget_count == MAX_WIDGETS) {
        return NULL;
    }
    widget *added = &widgets[widget_count++];
    *added = (widget){.place = {-1, -1, -1, -1}};
    snprintf(added->name, sizeof added->name, "%s", name);
    return added;
}

void log_widget(const char *name, float x0, float y0, float x1, float y1) {
    widget *w = stream ? find_widget(name) : NULL;
    const int place[4] = {(int)x0, (int)y0, (int)x1, (int)y1};
    if (!w) {
        return;
    }
    w->seen = true;
    if (memcmp(w->place, place, sizeof place) != 0) {
        memcpy(w->place, place, sizeof place);
        log_event("widget %s %d %d %d %d", name, place[0], place[1], place[2], place[3]);
    }
}

static void drop_widgets(void) {
    int kept = 0;
    for (int i = 0; i < widget_count; i++) {
        if (widgets[i].seen) {
            widgets[kept] = widgets[i];
            widgets[kept++].seen = false;
        }
    }
    widget_count = kept;
}

void log_frame_end(void) {
    drop_widgets();
    if (quiet_frames < REST_FRAMES && ++quiet_frames == REST_FRAMES) {
        log_event("rest");
        quiet_frames = REST_FRAMES;
    }
}
