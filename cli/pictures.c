// SPDX-License-Identifier: MIT
#include "pictures.h"
#include "files.h"
#include "video.h"

#include <stdio.h>
#include <string.h>

enum { MAX_PASSES = 128 };

void picture_options_add(cli_args *args, picture_options *o, bool mesh, const char *stats) {
    o->out = cli_add(args, arg_str0("o", "out", "FILE", "the picture, .png; a film, .mp4 or .webm, by ffmpeg"));
    o->size = cli_add(args, arg_str0(NULL, "size", "WxH", "default 1280x720"));
    if (mesh) {
        path_options_add_mesh(args, &o->path);
    } else {
        path_options_add(args, &o->path);
    }
    o->fps = cli_add(args, arg_str0(NULL, "fps", "F", "of a film; default 30"));
    o->stats = cli_add(args, arg_lit0(NULL, "stats", stats));
}

// NULL, or what is wrong, as a message of bad usage.
static const char *wrong_with(const pictures *p) {
    const size_t length = p->out ? strlen(p->out) : 0;
    if (!(p->fps > 0 && p->fps <= 1000)) {
        return "--fps is above 0 and at most 1000";
    }
    if (!p->out && !p->stats) {
        return "nothing to do: give --out FILE, --stats or both";
    }
    if (!p->out && p->frames > 1) {
        return "--path is given without --out";
    }
    if (p->out && !video_name(p->out) && p->frames > 1 &&
        (length < 5 || length > 4000 || strcmp(p->out + length - 4, ".png") != 0)) {
        return "--out with --path is numbered pictures, NAME.png, or a film, NAME.mp4 or NAME.webm";
    }
    return NULL;
}

bool picture_options_read(const picture_options *o, pictures *p, camera_path *path) {
    fm_shape size;
    *p = (pictures){.out = cli_given(o->out, NULL), .stats = o->stats->count > 0};
    if (!cli_picture("--size", cli_given(o->size, "1280x720"), &size) || !cli_double("--fps", cli_given(o->fps, "30"), &p->fps) ||
        !path_options_read(&o->path, path)) {
        return false;
    }
    p->width = size.x;
    p->height = size.y;
    p->frames = path->frames;
    const char *wrong = wrong_with(p);
    if (wrong) {
        cli_usage("%s", wrong);
    }
    return !wrong;
}

int pictures_check(const pictures *p) {
    if (!p->out) {
        return CLI_DONE;
    }
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

int pictures_print_passes(fm_context *context, const char *what) {
    fm_pass passes[MAX_PASSES];
    uint32_t count = MAX_PASSES;
    fm_device_info device;
    if (fm_context_passes(context, &count, passes) != FM_OK) {
        return cli_library_failed();
    }
    fm_context_device(context, &device);
    printf("%s (%s): %s\n", device.name, device.driver, what);
    for (uint32_t i = 0; i < count; i++) {
        printf("  %-10s %9.3f ms\n", passes[i].name, passes[i].milliseconds);
    }
    return CLI_DONE;
}
