// SPDX-License-Identifier: MIT

// Files that appear together: what a batch leaves when it is committed, dropped, or when one of its names cannot be had.

#include "io_common.h"

#include <fcntl.h>

static bool holds(const char *name, const char *text) {
    size_t size = 0;
    uint8_t *data = io_contents(io_path(name), &size);
    bool same = data && size == strlen(text) && memcmp(data, text, size) == 0;
    free(data);
    return same;
}

static fm_result write_to(fm_file_batch *batch, const char *name, const fm_volume *volume) {
    return fm_file_write(io_path(name), volume, &(fm_write_desc){.batch = batch});
}

static bool reads_as(const char *name, fm_volume *volume) {
    fm_volume *read = NULL;
    bool same = fm_file_read(NULL, io_path(name), NULL, &read, NULL) == FM_OK && io_same(volume, read);
    fm_volume_destroy(read);
    return same;
}

static void committed(fm_volume *volume) {
    fm_file_batch *batch = NULL;
    const fm_slice_desc slice = {.scale = 1};
    CHECK_OK(fm_file_batch_create(NULL, &batch));
    fm_slice_desc pending = slice;
    pending.batch = batch;
    io_store(io_path("a.npy"), "old", 3);
    CHECK_OK(write_to(batch, "a.npy", volume));
    CHECK_OK(write_to(batch, "b.raw", volume));
    CHECK_OK(fm_slice_png(volume, 2, 0, &pending, io_path("c.png"), NULL));
    CHECK(holds("a.npy", "old") && !io_exists(io_path("b.raw")) && !io_exists(io_path("b.raw.txt")) &&
          !io_exists(io_path("c.png")));
    CHECK_OK(fm_file_batch_commit(batch));
    CHECK(io_file_count() == 4 && reads_as("a.npy", volume) && reads_as("b.raw", volume) && io_exists(io_path("c.png")));
    // It is empty, and can be used again.
    CHECK_OK(fm_file_batch_commit(batch));
    CHECK_OK(write_to(batch, "d.nhdr", volume));
    CHECK_OK(fm_file_batch_commit(batch));
    CHECK(io_file_count() == 6 && reads_as("d.nhdr", volume));
    fm_file_batch_destroy(batch);
    io_clear();
}

static void dropped(fm_volume *volume) {
    fm_file_batch *batch = NULL;
    CHECK_OK(fm_file_batch_create(NULL, &batch));
    io_store(io_path("a.npy"), "old", 3);
    CHECK_OK(write_to(batch, "a.npy", volume));
    CHECK_OK(write_to(batch, "b.npy", volume));
    CHECK_FAILS(write_to(batch, "nowhere/c.npy", volume), FM_ERROR_IO);
    fm_file_batch_destroy(batch);
    CHECK(io_file_count() == 1 && holds("a.npy", "old"));
    fm_file_batch_destroy(NULL);
    CHECK_FAILS(fm_file_batch_create(NULL, NULL), FM_ERROR_INVALID_ARGUMENT);
    CHECK_FAILS(fm_file_batch_commit(NULL), FM_ERROR_INVALID_ARGUMENT);
    io_clear();
}

// A directory comes into the way of the last file after it was written: the files before it go back to what they were.
static void undone(fm_volume *volume) {
    fm_file_batch *batch = NULL;
    CHECK_OK(fm_file_batch_create(NULL, &batch));
    io_store(io_path("a.npy"), "old", 3);
    CHECK_OK(write_to(batch, "a.npy", volume));
    CHECK_OK(write_to(batch, "b.npy", volume));
    CHECK_OK(write_to(batch, "c.npy", volume));
    CHECK(mkdir(io_path("c.npy"), 0777) == 0);
    CHECK_FAILS(fm_file_batch_commit(batch), FM_ERROR_IO);
    CHECK(rmdir(io_path("c.npy")) == 0);
    CHECK(io_file_count() == 1);
    // Where two files cannot be exchanged the first one is lost.
    if (io_exists(io_path("a.npy")) && !holds("a.npy", "old")) {
        io_store(io_path("e"), "e", 1);
        io_store(io_path("f"), "f", 1);
        CHECK(renameat2(AT_FDCWD, io_path("e"), AT_FDCWD, io_path("f"), RENAME_EXCHANGE) != 0);
    }
    fm_file_batch_destroy(batch);
    io_clear();
}

static void aborted(fm_volume *volume) {
    fm_file_batch *batch = NULL;
    CHECK_OK(fm_file_batch_create(NULL, &batch));
    CHECK_OK(write_to(batch, "a.npy", volume));
    CHECK_OK(write_to(batch, "b.npy", volume));
    fm_file_abort_all();
    CHECK(io_file_count() == 0);
    CHECK_FAILS(fm_file_batch_commit(batch), FM_ERROR_IO);
    fm_file_batch_destroy(batch);
    CHECK(io_file_count() == 0);
}

// More files than a process may have in flight.
static void crowded(fm_volume *volume) {
    fm_file_batch *batch = NULL;
    CHECK_OK(fm_file_batch_create(NULL, &batch));
    fm_result result = FM_OK;
    int written = 0;
    for (; result == FM_OK && written < 1000; written++) {
        char name[32];
        snprintf(name, sizeof name, "%d.npy", written);
        result = write_to(batch, name, volume);
    }
    CHECK(result == FM_ERROR_IO && written > 10 && written < 1000);
    fm_file_batch_destroy(batch);
    CHECK(io_file_count() == 0);
    CHECK_OK(write_to(NULL, "a.npy", volume));
    io_clear();
}

int main(void) {
    if (!io_begin()) {
        return check_summary();
    }
    fm_volume *volume = io_volume(NULL, (fm_shape){5, 4, 3}, FM_TYPE_U8, 1);
    if (volume) {
        committed(volume);
        dropped(volume);
        undone(volume);
        aborted(volume);
        crowded(volume);
    }
    fm_volume_destroy(volume);
    return io_end();
}
