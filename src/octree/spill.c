// SPDX-License-Identifier: MIT
#include "octree/spill.h"

#include "octree/octree.h"

#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { LEAST_RECORDS = 16, STAGING_RECORDS = 1024, DIGIT = 1 << 16 };

// Records of one key that follow each other, in the file or, of the last run, in the order of memory.
typedef struct piece {
    uint64_t first;
    uint32_t key, count;
} piece;

// What memory held when it was full: pieces [first, end), sorted by key. `next`: the first that may still be asked for.
typedef struct run {
    uint64_t first, end, next;
} run;

struct fm_spill {
    fm_context *context;
    char *folder;
    uint64_t folder_bytes;
    uint32_t record_bytes;
    int file;          // below 0: none yet
    uint64_t written;  // records in the file

    uint64_t room, count;  // of records in memory
    uint8_t *records;
    uint32_t *keys, *order, *other;  // `order`: the records by key; `other` as long
    uint32_t *digits;
    uint8_t *staging;

    piece *pieces;
    run *runs;
    uint64_t piece_count, piece_room, run_count, run_room;
    bool in_memory;  // the last run is
};

fm_result fm_spill_create(fm_context *context, const char *folder, uint32_t record_bytes, uint64_t bytes, fm_spill **result) {
    const char *fallback = getenv("TMPDIR");
    folder = folder ? folder : fallback && *fallback ? fallback : "/tmp";
    fm_spill *spill = fm_octree_alloc_zero(context, sizeof *spill, "waiting triangles");
    if (!spill) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    spill->context = context;
    spill->file = -1;
    spill->record_bytes = record_bytes;
    spill->room = fm_min_u64(fm_max_u64(bytes / (record_bytes + 3 * sizeof *spill->keys), LEAST_RECORDS), UINT32_MAX);
    spill->folder_bytes = strlen(folder) + 1;
    spill->folder = fm_octree_alloc(context, spill->folder_bytes, "waiting triangles");
    spill->records = fm_octree_alloc(context, spill->room * record_bytes, "waiting triangles");
    spill->keys = fm_octree_alloc(context, spill->room * sizeof *spill->keys, "waiting triangles");
    spill->order = fm_octree_alloc(context, spill->room * sizeof *spill->order, "waiting triangles");
    spill->other = fm_octree_alloc(context, spill->room * sizeof *spill->other, "waiting triangles");
    spill->digits = fm_octree_alloc(context, DIGIT * sizeof *spill->digits, "waiting triangles");
    spill->staging = fm_octree_alloc(context, (uint64_t)STAGING_RECORDS * record_bytes, "waiting triangles");
    if (!spill->folder || !spill->records || !spill->keys || !spill->order || !spill->other || !spill->digits || !spill->staging) {
        fm_spill_destroy(spill);
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    memcpy(spill->folder, folder, spill->folder_bytes);
    *result = spill;
    return FM_OK;
}

void fm_spill_destroy(fm_spill *spill) {
    if (!spill) {
        return;
    }
    fm_context *context = spill->context;
    if (spill->file >= 0) {
        close(spill->file);
    }
    fm_octree_free(context, spill->folder, spill->folder_bytes);
    fm_octree_free(context, spill->records, spill->room * spill->record_bytes);
    fm_octree_free(context, spill->keys, spill->room * sizeof *spill->keys);
    fm_octree_free(context, spill->order, spill->room * sizeof *spill->order);
    fm_octree_free(context, spill->other, spill->room * sizeof *spill->other);
    fm_octree_free(context, spill->digits, DIGIT * sizeof *spill->digits);
    fm_octree_free(context, spill->staging, (uint64_t)STAGING_RECORDS * spill->record_bytes);
    fm_octree_free(context, spill->pieces, spill->piece_room * sizeof *spill->pieces);
    fm_octree_free(context, spill->runs, spill->run_room * sizeof *spill->runs);
    fm_octree_free(context, spill, sizeof *spill);
}

// --- The file ---

static fm_result io_failed(const fm_spill *spill, const char *what) {
    return fm_fail(FM_ERROR_IO, "%s: %s a file for triangles: %s", spill->folder, what, strerror(errno));
}

static fm_result open_file(fm_spill *spill) {
    char path[PATH_MAX];
    const int length = snprintf(path, sizeof path, "%s/.fathom-XXXXXX", spill->folder);
    if (length < 0 || (size_t)length >= sizeof path) {
        errno = ENAMETOOLONG;
        return io_failed(spill, "cannot name");
    }
    spill->file = mkstemp(path);
    if (spill->file < 0) {
        return io_failed(spill, "cannot make");
    }
    // Without a name it goes when it is closed, however the program ends.
    unlink(path);
    return FM_OK;
}

static fm_result write_all(const fm_spill *spill, const uint8_t *data, uint64_t bytes, uint64_t at) {
    while (bytes > 0) {
        const ssize_t done = pwrite(spill->file, data, bytes, (off_t)at);
        if (done < 0 && errno == EINTR) {
            continue;
        }
        if (done <= 0) {
            errno = done == 0 ? ENOSPC : errno;
            return io_failed(spill, "cannot write");
        }
        data += done;
        at += (uint64_t)done;
        bytes -= (uint64_t)done;
    }
    return FM_OK;
}

static fm_result read_all(const fm_spill *spill, uint8_t *data, uint64_t bytes, uint64_t at) {
    while (bytes > 0) {
        const ssize_t done = pread(spill->file, data, bytes, (off_t)at);
        if (done < 0 && errno == EINTR) {
            continue;
        }
        if (done <= 0) {
            errno = done == 0 ? EIO : errno;
            return io_failed(spill, "cannot read");
        }
        data += done;
        at += (uint64_t)done;
        bytes -= (uint64_t)done;
    }
    return FM_OK;
}

// --- Runs ---

// A pass of a stable sort.
static void sort_by(fm_spill *spill, int shift) {
    memset(spill->digits, 0, DIGIT * sizeof *spill->digits);
    for (uint64_t i = 0; i < spill->count; i++) {
        spill->digits[spill->keys[i] >> shift & (DIGIT - 1)]++;
    }
    uint32_t sum = 0;
    for (uint32_t i = 0; i < DIGIT; i++) {
        const uint32_t own = spill->digits[i];
        spill->digits[i] = sum;
        sum += own;
    }
    for (uint64_t i = 0; i < spill->count; i++) {
        const uint32_t record = spill->order[i];
        spill->other[spill->digits[spill->keys[record] >> shift & (DIGIT - 1)]++] = record;
    }
    uint32_t *sorted = spill->other;
    spill->other = spill->order;
    spill->order = sorted;
}

// A longer array with what was in it; NULL: no memory, and the old one stays.
static void *grown(const fm_spill *spill, void *array, uint64_t size, uint64_t count, uint64_t room, uint64_t wanted) {
    fm_context *context = spill->context;
    void *made = fm_octree_alloc(context, wanted * size, "waiting triangles");
    if (made) {
        if (count > 0) {
            memcpy(made, array, count * size);
        }
        fm_octree_free(context, array, room * size);
    }
    return made;
}

static bool reserve_pieces(fm_spill *spill, uint64_t more) {
    if (spill->piece_count + more > spill->piece_room) {
        const uint64_t wanted = fm_max_u64(spill->piece_count + more, spill->piece_room + spill->piece_room / 2);
        piece *made = grown(spill, spill->pieces, sizeof *made, spill->piece_count, spill->piece_room, wanted);
        if (!made) {
            return false;
        }
        spill->pieces = made;
        spill->piece_room = wanted;
    }
    return true;
}

static bool reserve_run(fm_spill *spill) {
    if (spill->run_count == spill->run_room) {
        const uint64_t wanted = spill->run_room + spill->run_room / 2 + 16;
        run *made = grown(spill, spill->runs, sizeof *made, spill->run_count, spill->run_room, wanted);
        if (!made) {
            return false;
        }
        spill->runs = made;
        spill->run_room = wanted;
    }
    return true;
}

// Sorts what is in memory and tells its pieces, whose records count from `first`.
static fm_result make_run(fm_spill *spill, uint64_t first) {
    for (uint64_t i = 0; i < spill->count; i++) {
        spill->order[i] = (uint32_t)i;
    }
    sort_by(spill, 0);
    sort_by(spill, 16);
    uint64_t distinct = 0;
    for (uint64_t i = 0; i < spill->count; i++) {
        distinct += i == 0 || spill->keys[spill->order[i]] != spill->keys[spill->order[i - 1]];
    }
    if (!reserve_pieces(spill, distinct) || !reserve_run(spill)) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    run *own = &spill->runs[spill->run_count++];
    own->first = own->next = spill->piece_count;
    for (uint64_t i = 0; i < spill->count; i++) {
        const uint32_t key = spill->keys[spill->order[i]];
        if (spill->piece_count == own->first || spill->pieces[spill->piece_count - 1].key != key) {
            spill->pieces[spill->piece_count++] = (piece){first + i, key, 0};
        }
        spill->pieces[spill->piece_count - 1].count++;
    }
    own->end = spill->piece_count;
    return FM_OK;
}

static fm_result write_run(fm_spill *spill) {
    if (spill->file < 0) {
        FM_TRY(open_file(spill));
    }
    FM_TRY(make_run(spill, spill->written));
    const uint64_t bytes = spill->record_bytes;
    for (uint64_t i = 0; i < spill->count; i += STAGING_RECORDS) {
        const uint64_t count = fm_min_u64(STAGING_RECORDS, spill->count - i);
        for (uint64_t k = 0; k < count; k++) {
            memcpy(spill->staging + k * bytes, spill->records + spill->order[i + k] * bytes, bytes);
        }
        FM_TRY(write_all(spill, spill->staging, count * bytes, (spill->written + i) * bytes));
    }
    spill->written += spill->count;
    spill->count = 0;
    return FM_OK;
}

fm_result fm_spill_add(fm_spill *spill, uint32_t key, const void *record) {
    if (spill->count == spill->room) {
        FM_TRY(write_run(spill));
    }
    memcpy(spill->records + spill->count * spill->record_bytes, record, spill->record_bytes);
    spill->keys[spill->count++] = key;
    return FM_OK;
}

fm_result fm_spill_finish(fm_spill *spill) {
    FM_TRY(make_run(spill, 0));
    spill->in_memory = true;
    return FM_OK;
}

// --- Reading ---

// The run's records of the key; NULL: it has none.
static const piece *piece_of(fm_spill *spill, run *own, uint32_t key) {
    while (own->next < own->end && spill->pieces[own->next].key < key) {
        own->next++;
    }
    return own->next < own->end && spill->pieces[own->next].key == key ? &spill->pieces[own->next] : NULL;
}

uint64_t fm_spill_count(fm_spill *spill, uint32_t key) {
    uint64_t count = 0;
    for (uint64_t i = 0; i < spill->run_count; i++) {
        const piece *own = piece_of(spill, &spill->runs[i], key);
        count += own ? own->count : 0;
    }
    return count;
}

static fm_result read_piece(fm_spill *spill, const piece *own, bool in_memory, void (*fn)(void *user, const void *record),
                            void *user) {
    const uint64_t bytes = spill->record_bytes;
    for (uint64_t i = 0; i < own->count; i += STAGING_RECORDS) {
        const uint64_t count = fm_min_u64(STAGING_RECORDS, own->count - i);
        if (!in_memory) {
            FM_TRY(read_all(spill, spill->staging, count * bytes, (own->first + i) * bytes));
        }
        for (uint64_t k = 0; k < count; k++) {
            fn(user, in_memory ? spill->records + spill->order[own->first + i + k] * bytes : spill->staging + k * bytes);
        }
    }
    return FM_OK;
}

fm_result fm_spill_read(fm_spill *spill, uint32_t key, void (*fn)(void *user, const void *record), void *user) {
    for (uint64_t i = 0; i < spill->run_count; i++) {
        const piece *own = piece_of(spill, &spill->runs[i], key);
        if (own) {
            FM_TRY(read_piece(spill, own, spill->in_memory && i + 1 == spill->run_count, fn, user));
        }
    }
    return FM_OK;
}
