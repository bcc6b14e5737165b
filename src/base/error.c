// SPDX-License-Identifier: MIT
#include "base/base.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

enum { MESSAGE_SIZE = 1024 };

static _Thread_local char thread_message[MESSAGE_SIZE];

#define STRINGIZE_VALUE(x) #x
#define STRINGIZE(x) STRINGIZE_VALUE(x)

const char *fm_version(void) {
    return STRINGIZE(FM_VERSION_MAJOR) "." STRINGIZE(FM_VERSION_MINOR) "." STRINGIZE(FM_VERSION_PATCH);
}

const char *fm_result_name(fm_result result) {
    switch (result) {
    case FM_OK:
        return "FM_OK";
    case FM_ERROR_INVALID_ARGUMENT:
        return "FM_ERROR_INVALID_ARGUMENT";
    case FM_ERROR_RANGE:
        return "FM_ERROR_RANGE";
    case FM_ERROR_OUT_OF_HOST_MEMORY:
        return "FM_ERROR_OUT_OF_HOST_MEMORY";
    case FM_ERROR_OUT_OF_DEVICE_MEMORY:
        return "FM_ERROR_OUT_OF_DEVICE_MEMORY";
    case FM_ERROR_NO_DEVICE:
        return "FM_ERROR_NO_DEVICE";
    case FM_ERROR_DEVICE_LOST:
        return "FM_ERROR_DEVICE_LOST";
    case FM_ERROR_UNSUPPORTED:
        return "FM_ERROR_UNSUPPORTED";
    case FM_ERROR_IO:
        return "FM_ERROR_IO";
    case FM_ERROR_FORMAT:
        return "FM_ERROR_FORMAT";
    case FM_ERROR_INTERNAL:
        return "FM_ERROR_INTERNAL";
    }
    return "unknown result";
}

const char *fm_last_error(void) {
    return thread_message;
}

fm_result fm_fail(fm_result result, const char *format, ...) {
    // An argument may be the present message itself, so the new one is made beside it.
    char message[MESSAGE_SIZE];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(message, sizeof message, format, arguments);
    va_end(arguments);
    // What a hostile file names stays on the line.
    for (char *c = message; *c; c++) {
        *c = (unsigned char)*c < ' ' || *c == 0x7f ? '?' : *c;
    }
    memcpy(thread_message, message, sizeof message);
    return result;
}

fm_result fm_fail_prefix(fm_result result, const char *prefix) {
    return fm_fail(result, "%s: %s", prefix, thread_message);
}

void fm_log_write(const fm_log *log, fm_log_level level, const char *format, ...) {
    if (!log->fn) {
        return;
    }
    char message[MESSAGE_SIZE];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(message, sizeof message, format, arguments);
    va_end(arguments);
    log->fn(log->user, level, message);
}

uint64_t fm_now_ns(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (uint64_t)now.tv_sec * 1000000000u + (uint64_t)now.tv_nsec;
}
