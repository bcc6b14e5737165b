// SPDX-License-Identifier: MIT

// Files that appear together.

#include "io/stream.h"
#include "volume/context.h"

#include <signal.h>

fm_result fm_file_batch_create(fm_context *context, fm_file_batch **result) {
    if (!result) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "batch is NULL");
    }
    const fm_allocator *allocator = context ? &context->allocator : &fm_default_allocator;
    fm_file_batch *batch = fm_alloc_zero(allocator, sizeof *batch, "a batch of files");
    if (!batch) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    batch->allocator = *allocator;
    *result = batch;
    return FM_OK;
}

fm_result fm_batch_add(fm_file_batch *batch, fm_output *output) {
    fm_result result = output ? fm_output_finish(output) : FM_OK;
    // Each of them has one of the process' temporary names, so there is room.
    if (result == FM_OK && output && !fm_output_is_direct(output)) {
        batch->outputs[batch->count++] = output;
    } else {
        fm_output_destroy(output);
    }
    return result;
}

void fm_batch_clear(fm_file_batch *batch) {
    while (batch->count > 0) {
        fm_output_destroy(batch->outputs[--batch->count]);
    }
}

fm_result fm_file_batch_commit(fm_file_batch *batch) {
    if (!batch) {
        return fm_fail(FM_ERROR_INVALID_ARGUMENT, "batch is NULL");
    }
    // A signal that ends the program must not come between two names.
    sigset_t all, before;
    sigfillset(&all);
    pthread_sigmask(SIG_SETMASK, &all, &before);
    fm_result result = FM_OK;
    uint32_t done = 0;
    while (result == FM_OK && done < batch->count) {
        // When the last one succeeds nothing has to be undone.
        result = fm_output_rename(batch->outputs[done], done + 1 < batch->count);
        done += result == FM_OK;
    }
    while (result != FM_OK && done > 0) {
        fm_output_undo(batch->outputs[--done]);
    }
    fm_batch_clear(batch);
    pthread_sigmask(SIG_SETMASK, &before, NULL);
    return result;
}

void fm_file_batch_destroy(fm_file_batch *batch) {
    if (!batch) {
        return;
    }
    fm_batch_clear(batch);
    fm_allocator allocator = batch->allocator;
    fm_free(&allocator, batch, sizeof *batch);
}
