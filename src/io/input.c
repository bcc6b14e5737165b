// SPDX-License-Identifier: MIT
#include "io/sized.h"
#include "io/stream.h"

#include <errno.h>
#include <fcntl.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

enum {
    WINDOW = 1 << 16,
    // A deflate stream grows to at most 1,032 times its size: 258 bytes for two bits.
    DEFLATE_MAX_RATIO = 1032,
    PIECE = 1 << 30,  // of one read call or one inflate call
};

// Bytes that have been fetched and not yet taken.
typedef struct window {
    uint8_t bytes[WINDOW];
    size_t begin, end;
} window;

struct fm_input {
    const fm_allocator *allocator;
    const char *name;
    int fd;                 // -1: the source is `memory`
    const uint8_t *memory;  // what is left of it
    uint64_t memory_left;
    uint64_t file_size;  // UINT64_MAX when not known
    uint64_t fetched;    // bytes got from the source
    uint64_t position;
    bool gzip;
    bool member_ended;  // between two members of a gzip stream, or after the last
    z_stream z;
    window source;   // as it lies in the file
    window decoded;  // gzip only
    char *name_copy;
    size_t name_size;
};

fm_result fm_input_fail(const fm_input *input, fm_result result, const char *format, ...) {
    char text[900];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    return fm_fail(result, "%s: %s", input->name, text);
}

static fm_result input_create(const fm_allocator *allocator, const char *name, fm_input **result) {
    fm_input *input = fm_alloc_zero(allocator, sizeof *input, "a file's buffer");
    if (!input) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    input->allocator = allocator;
    input->fd = -1;
    input->file_size = UINT64_MAX;
    input->name_size = strlen(name) + 1;
    input->name_copy = fm_alloc(allocator, input->name_size, "a file's name");
    if (!input->name_copy) {
        fm_input_close(input);
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    memcpy(input->name_copy, name, input->name_size);
    input->name = input->name_copy;
    *result = input;
    return FM_OK;
}

// Up to `size` bytes straight from the source; 0 at its end.
static fm_result fetch(fm_input *input, uint8_t *target, size_t size, size_t *got) {
    if (input->fd < 0) {
        *got = (size_t)fm_min_u64(size, input->memory_left);
        if (*got) {
            memcpy(target, input->memory, *got);
            input->memory += *got;
        }
        input->memory_left -= *got;
    } else {
        ssize_t count;
        do {
            count = read(input->fd, target, size < PIECE ? size : PIECE);
        } while (count < 0 && errno == EINTR);
        if (count < 0) {
            return fm_input_fail(input, FM_ERROR_IO, "cannot read: %s", strerror(errno));
        }
        *got = (size_t)count;
    }
    input->fetched += *got;
    return FM_OK;
}

// Makes room behind what is left in the window.
static void window_compact(window *w) {
    memmove(w->bytes, w->bytes + w->begin, w->end - w->begin);
    w->end -= w->begin;
    w->begin = 0;
}

static fm_result source_refill(fm_input *input, bool *end) {
    window *w = &input->source;
    window_compact(w);
    size_t got = 0;
    FM_TRY(fetch(input, w->bytes + w->end, WINDOW - w->end, &got));
    w->end += got;
    *end = got == 0;
    return FM_OK;
}

// After a member of a gzip stream: either the file ends or another member begins.
static fm_result next_member(fm_input *input, bool *end) {
    window *w = &input->source;
    while (w->end - w->begin < 2) {
        bool source_end;
        FM_TRY(source_refill(input, &source_end));
        if (source_end) {
            break;
        }
    }
    *end = w->begin == w->end;
    if (*end) {
        return FM_OK;
    }
    if (w->end - w->begin < 2 || w->bytes[w->begin] != 0x1f || w->bytes[w->begin + 1] != 0x8b) {
        return fm_input_fail(input, FM_ERROR_FORMAT,
                             "bytes follow the end of the gzip stream: the file is damaged or was appended to");
    }
    inflateReset(&input->z);
    input->member_ended = false;
    return FM_OK;
}

// Up to `size` decompressed bytes; 0 at the end of the stream.
static fm_result decode(fm_input *input, uint8_t *target, size_t size, size_t *got) {
    window *w = &input->source;
    *got = 0;
    while (*got == 0) {
        if (input->member_ended) {
            bool end;
            FM_TRY(next_member(input, &end));
            if (end) {
                return FM_OK;
            }
        }
        if (w->begin == w->end) {
            bool end;
            FM_TRY(source_refill(input, &end));
            if (end) {
                return fm_input_fail(input, FM_ERROR_FORMAT, "the gzip stream is cut off: the file is truncated, get it again");
            }
        }
        size_t room = size < PIECE ? size : PIECE;
        input->z.next_in = w->bytes + w->begin;
        input->z.avail_in = (uInt)(w->end - w->begin);
        input->z.next_out = target;
        input->z.avail_out = (uInt)room;
        int status = inflate(&input->z, Z_NO_FLUSH);
        w->begin = w->end - input->z.avail_in;
        *got = room - input->z.avail_out;
        if (status == Z_STREAM_END) {
            input->member_ended = true;
        } else if (status == Z_MEM_ERROR) {
            return fm_fail_prefix(FM_ERROR_OUT_OF_HOST_MEMORY, input->name);
        } else if (status != Z_OK && status != Z_BUF_ERROR) {
            return fm_input_fail(input, FM_ERROR_FORMAT, "the gzip stream is damaged (%s): get the file again",
                                 input->z.msg ? input->z.msg : "unknown reason");
        }
    }
    return FM_OK;
}

static window *front(fm_input *input) {
    return input->gzip ? &input->decoded : &input->source;
}

static fm_result refill(fm_input *input, bool *end) {
    if (!input->gzip) {
        return source_refill(input, end);
    }
    window *w = &input->decoded;
    window_compact(w);
    size_t got = 0;
    FM_TRY(decode(input, w->bytes + w->end, WINDOW - w->end, &got));
    w->end += got;
    *end = got == 0;
    return FM_OK;
}

fm_result fm_input_peek(fm_input *input, size_t wanted, const uint8_t **bytes, size_t *available) {
    window *w = front(input);
    while (w->end - w->begin < wanted) {
        bool end;
        FM_TRY(refill(input, &end));
        if (end) {
            break;
        }
    }
    *bytes = w->bytes + w->begin;
    *available = (size_t)fm_min_u64(wanted, w->end - w->begin);
    return FM_OK;
}

fm_result fm_input_begin_gzip(fm_input *input) {
    input->z.zalloc = fm_zlib_alloc;
    input->z.zfree = fm_zlib_free;
    input->z.opaque = (void *)(uintptr_t)input->allocator;
    if (inflateInit2(&input->z, 15 + 16) != Z_OK) {
        return fm_fail_prefix(FM_ERROR_OUT_OF_HOST_MEMORY, input->name);
    }
    input->gzip = true;
    return FM_OK;
}

static fm_result detect_gzip(fm_input *input) {
    const uint8_t *head;
    size_t available;
    FM_TRY(fm_input_peek(input, 2, &head, &available));
    return available == 2 && head[0] == 0x1f && head[1] == 0x8b ? fm_input_begin_gzip(input) : FM_OK;
}

static fm_result open_source(fm_input *input, const char *path) {
    bool standard = strcmp(path, "-") == 0;
    input->fd = standard ? fcntl(STDIN_FILENO, F_DUPFD_CLOEXEC, 0) : open(path, O_RDONLY | O_CLOEXEC);
    if (input->fd < 0) {
        return fm_input_fail(input, FM_ERROR_IO, "cannot open: %s", strerror(errno));
    }
    struct stat status;
    if (fstat(input->fd, &status) != 0) {
        return fm_input_fail(input, FM_ERROR_IO, "cannot open: %s", strerror(errno));
    }
    if (S_ISDIR(status.st_mode)) {
        return fm_input_fail(input, FM_ERROR_IO, "is a directory: name a file in it");
    }
    if (S_ISREG(status.st_mode)) {
        // Standard input may have been read from already.
        off_t at = lseek(input->fd, 0, SEEK_CUR);
        input->file_size = at >= 0 && at <= status.st_size ? (uint64_t)(status.st_size - at) : 0;
    }
    return FM_OK;
}

static fm_result finish_open(fm_input *input, fm_result result, bool detect, fm_input **opened) {
    if (result == FM_OK && detect) {
        result = detect_gzip(input);
    }
    if (result != FM_OK) {
        fm_input_close(input);
        return result;
    }
    *opened = input;
    return FM_OK;
}

fm_result fm_input_open(const fm_allocator *allocator, const char *path, fm_input **result) {
    fm_input *input = NULL;
    FM_TRY(input_create(allocator, strcmp(path, "-") == 0 ? "standard input" : path, &input));
    return finish_open(input, open_source(input, path), true, result);
}

fm_result fm_input_open_plain(const fm_allocator *allocator, const char *path, fm_input **result) {
    fm_input *input = NULL;
    FM_TRY(input_create(allocator, path, &input));
    return finish_open(input, open_source(input, path), false, result);
}

fm_result fm_input_open_memory(const fm_allocator *allocator, const void *data, uint64_t size, const char *name,
                               fm_input **result) {
    fm_input *input = NULL;
    FM_TRY(input_create(allocator, name, &input));
    input->memory = data;
    input->memory_left = size;
    input->file_size = size;
    return finish_open(input, FM_OK, true, result);
}

void fm_input_close(fm_input *input) {
    if (!input) {
        return;
    }
    if (input->gzip) {
        inflateEnd(&input->z);
    }
    if (input->fd >= 0) {
        close(input->fd);
    }
    fm_free(input->allocator, input->name_copy, input->name_size);
    fm_free(input->allocator, input, sizeof *input);
}

fm_result fm_input_read_some(fm_input *input, void *memory, uint64_t size, uint64_t *total) {
    uint8_t *target = memory;
    window *w = front(input);
    uint64_t done = fm_min_u64(size, w->end - w->begin);
    memcpy(target, w->bytes + w->begin, (size_t)done);
    w->begin += (size_t)done;
    fm_result result = FM_OK;
    while (done < size && result == FM_OK) {
        size_t got = 0;
        size_t room = (size_t)fm_min_u64(size - done, PIECE);
        // Small reads go through the window, so that a header does not cost a call of the system for each field.
        if (room < WINDOW) {
            bool end;
            result = refill(input, &end);
            got = (size_t)fm_min_u64(room, w->end - w->begin);
            memcpy(target + done, w->bytes + w->begin, got);
            w->begin += got;
        } else if (input->gzip) {
            result = decode(input, target + done, room, &got);
        } else {
            result = fetch(input, target + done, room, &got);
        }
        done += got;
        if (got == 0) {
            break;
        }
    }
    input->position += done;
    *total = done;
    return result;
}

fm_result fm_input_read(fm_input *input, void *target, uint64_t size, const char *part) {
    uint64_t got = 0;
    if (size == 0) {
        return FM_OK;
    }
    FM_TRY(fm_input_read_some(input, target, size, &got));
    if (got < size) {
        return fm_input_fail(input, FM_ERROR_FORMAT,
                             "ends after %llu bytes, within %s, %llu bytes short: the file is truncated, get it again",
                             (unsigned long long)input->position, part, (unsigned long long)(size - got));
    }
    return FM_OK;
}

fm_result fm_input_skip(fm_input *input, uint64_t size, const char *part) {
    uint8_t bin[4096];
    while (size > 0) {
        uint64_t piece = fm_min_u64(size, sizeof bin);
        FM_TRY(fm_input_read(input, bin, piece, part));
        size -= piece;
    }
    return FM_OK;
}

fm_result fm_input_line(fm_input *input, char *line, size_t capacity, bool *ended) {
    size_t length = 0;
    for (;;) {
        const uint8_t *byte;
        size_t available;
        FM_TRY(fm_input_peek(input, 1, &byte, &available));
        if (available == 0) {
            if (ended) {
                *ended = length == 0;
                break;
            }
            return fm_input_fail(input, FM_ERROR_FORMAT, "ends within the header: the file is truncated, get it again");
        }
        char c = (char)*byte;
        front(input)->begin++;
        input->position++;
        if (ended) {
            *ended = false;
        }
        if (c == '\n') {
            break;
        }
        if (c == 0 || length + 1 >= capacity) {
            return fm_input_fail(input, FM_ERROR_FORMAT,
                                 c == 0 ? "has a NUL byte in its header" : "has a header line of over %zu bytes", capacity - 1);
        }
        line[length++] = c;
    }
    if (length > 0 && line[length - 1] == '\r') {
        length--;
    }
    line[length] = 0;
    return FM_OK;
}

fm_result fm_input_skip_line(fm_input *input) {
    for (;;) {
        const uint8_t *byte;
        size_t available;
        FM_TRY(fm_input_peek(input, 1, &byte, &available));
        if (available == 0) {
            return fm_input_fail(input, FM_ERROR_FORMAT,
                                 "ends within the lines to be skipped: the file is truncated, get it again");
        }
        bool end = *byte == '\n';
        front(input)->begin++;
        input->position++;
        if (end) {
            return FM_OK;
        }
    }
}

fm_result fm_input_expect_end(fm_input *input) {
    const uint8_t *bytes;
    size_t available;
    FM_TRY(fm_input_peek(input, 1, &bytes, &available));
    if (available == 0) {
        return FM_OK;
    }
    if (!input->gzip && input->file_size != UINT64_MAX) {
        return fm_input_fail(input, FM_ERROR_FORMAT, "has %llu bytes after its last element: its header and its size do not agree",
                             (unsigned long long)fm_input_bound(input));
    }
    return fm_input_fail(input, FM_ERROR_FORMAT, "has bytes after its last element: its header and its size do not agree");
}

fm_result fm_input_slurp(fm_input *input, uint64_t max, uint8_t **result, uint64_t *result_size) {
    uint64_t size = 0;
    uint64_t capacity = fm_min_u64(fm_min_u64(fm_input_bound(input), 1 << 20) + 1, max);
    uint8_t *data = fm_alloc(input->allocator, capacity, "a file's contents");
    if (!data) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    for (;;) {
        uint64_t got = 0;
        fm_result status = fm_input_read_some(input, data + size, capacity - size, &got);
        size += got;
        if (status == FM_OK && size < capacity) {
            break;
        }
        uint64_t grown = fm_min_u64(capacity * 2, max);
        if (status == FM_OK && grown == capacity) {
            status = fm_input_fail(input, FM_ERROR_RANGE, "holds over %llu bytes: more than a file of this format may",
                                   (unsigned long long)max - 1);
        }
        uint8_t *larger = status == FM_OK ? fm_alloc(input->allocator, grown, "a file's contents") : NULL;
        if (!larger) {
            fm_free(input->allocator, data, capacity);
            return status == FM_OK ? FM_ERROR_OUT_OF_HOST_MEMORY : status;
        }
        memcpy(larger, data, (size_t)size);
        fm_free(input->allocator, data, capacity);
        data = larger;
        capacity = grown;
    }
    // The caller frees `size` bytes, so the memory must be exactly that.
    uint8_t *exact = fm_alloc(input->allocator, size, "a file's contents");
    if (exact) {
        memcpy(exact, data, (size_t)size);
    }
    fm_free(input->allocator, data, capacity);
    if (!exact) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    *result = exact;
    *result_size = size;
    return FM_OK;
}

bool fm_input_is_gzip(const fm_input *input) {
    return input->gzip;
}

uint64_t fm_input_bound(const fm_input *input) {
    if (input->file_size == UINT64_MAX) {
        return UINT64_MAX;
    }
    uint64_t source =
        (input->source.end - input->source.begin) + (input->file_size > input->fetched ? input->file_size - input->fetched : 0);
    if (!input->gzip) {
        return source;
    }
    // zlib may hold a window's worth that it has taken in but not given out.
    uint64_t product;
    if (fm_mul_overflows(source + WINDOW, DEFLATE_MAX_RATIO, &product)) {
        return UINT64_MAX;
    }
    return product + (input->decoded.end - input->decoded.begin);
}

fm_result fm_input_require(const fm_input *input, uint64_t bytes, const char *claim) {
    uint64_t bound = fm_input_bound(input);
    if (bytes <= bound) {
        return FM_OK;
    }
    return fm_input_fail(input, FM_ERROR_FORMAT,
                         "%s needs %llu bytes, but only %llu%s follow: the file is truncated or its header wrong", claim,
                         (unsigned long long)bytes, (unsigned long long)bound, input->gzip ? " can" : "");
}

uint64_t fm_input_file_size(const fm_input *input) {
    return input->file_size;
}

uint64_t fm_input_source_position(const fm_input *input) {
    return input->fetched - (input->source.end - input->source.begin);
}

uint64_t fm_input_position(const fm_input *input) {
    return input->position;
}

const char *fm_input_name(const fm_input *input) {
    return input->name;
}
