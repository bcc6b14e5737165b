// SPDX-License-Identifier: MIT
#include "pictures.h"
#include "cli.h"
#include "files.h"
#include "video.h"

#include <stdio.h>
#include <string.h>

const char *pictures_wrong(const pictures *p) {
    const size_t length = p->out ? strlen(p->out) : 0;
    if (!(p->fps > 0 && p->fps <= 1000)) {
        return "--fps is above 0 and at most 1000";
    }
    if (p->out && !video_name(p->out) && p->frames > 1 &&
        (length < 5 || length > 4000 || strcmp(p->out + length - 4, ".png") != 0)) {
        return "--out with --path is numbered pictures, NAME.png, or a film, NAME.mp4 or NAME.webm";
    }
    return NULL;
}

int pictures_check(const pictures *p) {
    return video_name(p->out) || p->frames > 1 ? files_output_check(p->out) : files_picture_check(p->out);
}

// "a.png" becomes "a0007.png".
static void numbered(const char *path, uint32_t number, char *text, size_t size) {
    const size_t stem = strlen(path) - 4;
    snprintf(text, size, "%.*s%04u%s", (int)stem, path, number, path + stem);
}

static int write_film(const pictures *p, const uint8_t *pixels, int (*draw)(void *user, uint32_t frame), void *user) {
    video *film = video_begin(p->out, p->width, p->height, p->fps);
    if (!film) {
        return CLI_FAILED;
    }
    bool good = true;
    for (uint32_t i = 0; good && i < p->frames; i++) {
        good = draw(user, i) == CLI_DONE && video_frame(film, pixels);
    }
    return video_end(film, good);
}

int pictures_write(const pictures *p, const uint8_t *pixels, int (*draw)(void *user, uint32_t frame), void *user) {
    if (video_name(p->out)) {
        return write_film(p, pixels, draw, user);
    }
    int status = CLI_DONE;
    for (uint32_t i = 0; status == CLI_DONE && i < p->frames; i++) {
        char path[4096];
        numbered(p->out, i, path, sizeof path);
        status = draw(user, i);
        if (status == CLI_DONE && fm_image_write_png(p->frames > 1 ? path : p->out, p->width, p->height, 4, pixels) != FM_OK) {
            status = cli_library_failed();
        }
    }
    return status;
}
