// SPDX-License-Identifier: MIT
#ifndef FM_APP_OPTIONS_H
#define FM_APP_OPTIONS_H

#include "auto.h"
#include "cli.h"
#include "settings.h"

typedef struct options {
    paint_settings settings;  // a shape or scale of 0: see options_suit
    const char *input;        // NULL: the settings' scene
    const char *mesh;         // a file; NULL: the torus
    bool mesh_y_up;           // of the file, whose axis y points up
    fm_backend backend;
    const char *device;
    uint32_t threads;
    bool validation;
    bool headless, automatic;
    auto_desc benchmark;
    uint32_t width, height;  // of the window, or of the picture without one
    const char *pictures;    // directory for screenshots
    const char *log;         // NULL: none
    const char *last_frame;  // NULL: not wanted; without a window only
    uint64_t history_bytes;
    uint32_t broken_pictures;  // so many fail, for a test of what the window does then
} options;

// The options live as long as `args` and argv. Returns true when the program shall run; else `status` is its exit code.
bool options_parse(cli_args *args, int argc, char **argv, options *o, int *status);

// Chooses the size of shadow maps, and of the world, of fields of meshes and of the pixels where these are 0, such that the device
// can show them fluently.
void options_suit(paint_settings *settings, const fm_device_info *device, bool window);

#endif
