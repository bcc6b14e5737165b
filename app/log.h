// SPDX-License-Identifier: MIT
#ifndef FM_APP_LOG_H
#define FM_APP_LOG_H

// What happens, a line an event, for programs that drive the window and want to see what came of it (--log).

#include <stdbool.h>

#ifdef __cplusplus
extern "C" {
#endif

// NULL: nothing is logged.
bool log_open(const char *path);
void log_close(void);
bool log_wanted(void);

__attribute__((format(printf, 1, 2))) void log_event(const char *format, ...);

// Where a part of the panel is, in pixels of the window: told each frame, logged as "widget NAME X0 Y0 X1 Y1" when it has appeared
// or moved. Names have no blanks.
void log_widget(const char *name, float x0, float y0, float x1, float y1);
// A frame is over: parts that were not told in it are gone. After a few frames without any line the log says "rest".
void log_frame_end(void);

#ifdef __cplusplus
}
#endif

#endif
