// SPDX-License-Identifier: MIT
#ifndef FM_CLI_VIDEO_H
#define FM_CLI_VIDEO_H

// Films through ffmpeg, which gets raw frames. The file appears when it is whole.

#include <stdbool.h>
#include <stdint.h>

typedef struct video video;

// Whether the name is that of a film: .mp4 or .webm.
bool video_name(const char *path);

// Starts ffmpeg. NULL after the reason has been said.
video *video_begin(const char *path, uint32_t width, uint32_t height, double fps);
// Adds a frame of RGBA pixels. False after the reason has been said.
bool video_frame(video *film, const uint8_t *pixels);
// Ends the film and frees it; `good` false: it is thrown away. Returns an exit code.
int video_end(video *film, bool good);

#endif
