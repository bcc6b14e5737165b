// SPDX-License-Identifier: MIT
#include "table.h"

#include "cli.h"
#include "files.h"

#include <stdlib.h>

int tables_check(const char *const *paths, int count) {
    for (int i = 0; i < count; i++) {
        int status = paths[i] ? files_output_check(paths[i]) : CLI_DONE;
        if (status != CLI_DONE) {
            return status;
        }
        for (int before = 0; before < i; before++) {
            if (files_same(paths[before], paths[i])) {
                return cli_usage("bench: two tables are the same file: give each its own name");
            }
        }
    }
    return CLI_DONE;
}

bool table_begin(const char *path, table *t) {
    *t = (table){.path = path};
    t->stream = path ? open_memstream(&t->text, &t->size) : NULL;
    return !path || t->stream;
}

bool table_json(table *t, cJSON *value) {
    char *text = value ? cJSON_Print(value) : NULL;
    cJSON_Delete(value);
    if (!text) {
        cli_fail("%s: out of memory for it: free some", t->path);
        return false;
    }
    fprintf(t->stream, "%s\n", text);
    cJSON_free(text);
    return true;
}

int table_end(table *t, bool write, int status) {
    const bool whole = t->stream && !ferror(t->stream);
    if (t->stream && fclose(t->stream) == 0 && whole && write) {
        int written = files_write_text(t->path, t->text, t->size);
        status = status == CLI_DONE ? written : status;
    } else if (t->stream && write) {
        status = cli_fail("%s: out of memory for it: free some", t->path);
    }
    free(t->text);
    return status;
}
