// SPDX-License-Identifier: MIT
#ifndef FM_APP_MESSAGE_H
#define FM_APP_MESSAGE_H

// What the window tells the person before it: one message at a time.

#include <stdbool.h>

enum { MESSAGE_TEXT = 512 };

typedef struct message {
    char text[MESSAGE_TEXT];  // empty at first
    bool failed;              // it is of a failure
    double said;              // seconds, as `now`
    bool broken;              // pictures fail
    double broken_said;
} message;

__attribute__((format(printf, 3, 4))) void message_say(message *m, double now, const char *format, ...);
// Goes to stderr and the log too.
__attribute__((format(printf, 3, 4))) void message_fail(message *m, double now, const char *format, ...);
// The same with what the library has to say of `what`.
void message_fail_library(message *m, double now, const char *what);

// A picture that fails is likely to fail again with the next frame: it is said at once, and then every few seconds.
void message_no_picture(message *m, double now, const char *what);
// There is a picture again.
void message_picture(message *m);

#endif
