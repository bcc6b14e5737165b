// SPDX-License-Identifier: MIT
#include "message.h"

#include "log.h"

#include "fathom/fathom.h"

#include <stdarg.h>
#include <stdio.h>

static const double again_every = 5;  // seconds

static void put(message *m, double now, bool failed, const char *format, va_list arguments) {
    vsnprintf(m->text, sizeof m->text, format, arguments);
    m->failed = failed;
    m->said = now;
    if (failed) {
        fprintf(stderr, "fathom: %s\n", m->text);
        log_event("failed %s", m->text);
    }
}

void message_say(message *m, double now, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    put(m, now, false, format, arguments);
    va_end(arguments);
}

void message_fail(message *m, double now, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    put(m, now, true, format, arguments);
    va_end(arguments);
}

void message_fail_library(message *m, double now, const char *what) {
    message_fail(m, now, "%s: %s", what, fm_last_error());
}

void message_no_picture(message *m, double now, const char *what) {
    if (!m->broken || now - m->broken_said >= again_every) {
        message_fail_library(m, now, what);
        m->broken_said = now;
    }
    m->broken = true;
}

void message_picture(message *m) {
    if (m->broken) {
        log_event("mended");
    }
    m->broken = false;
}
