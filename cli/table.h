// SPDX-License-Identifier: MIT
#ifndef FM_CLI_TABLE_H
#define FM_CLI_TABLE_H

// Tables that a command writes into files when all of it is there, so that old results stay until the new ones are whole.

#include <cjson/cJSON.h>
#include <stdbool.h>
#include <stdio.h>

typedef struct table {
    const char *path;
    FILE *stream;  // NULL: not wanted
    char *text;
    size_t size;
} table;

// Says early which of the files cannot be written, or is named twice; NULL paths are passed over. Returns an exit code.
int tables_check(const char *const *paths, int count);

// Begins a table; nothing for a NULL path. False when out of memory.
bool table_begin(const char *path, table *t);
// Prints a value into the table and frees it. False when out of memory, which has been said.
bool table_json(table *t, cJSON *value);
// Ends a table. `write`: what it holds is worth a file. Returns `status`, or why the file could not be written.
int table_end(table *t, bool write, int status);

#endif
