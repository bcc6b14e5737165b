// SPDX-License-Identifier: MIT
#include "cli.h"
#include "commands.h"

#include <signal.h>
#include <stdio.h>
#include <string.h>

typedef struct command {
    const char *name, *summary;
    int (*run)(int argc, char **argv);
} command;

static int command_help(int argc, char **argv);
static int command_version(int argc, char **argv);

static const command commands[] = {
    {"transform", "compute a distance field", command_transform},
    {"sdf", "compute the signed distance field of a mesh", command_sdf},
    {"voxelize", "set the voxels that a mesh touches", command_voxelize},
    {"octree", "build, describe and draw octrees of surfaces", command_octree},
    {"world", "edit voxels and keep their distance field exact", command_world},
#ifdef CLI_PAINT
    {"paint", "fly through a world, dig and build in it", command_paint},
#endif
    {"render", "make a picture or a film of a world", command_render},
    {"info", "describe a file", command_info},
    {"slice", "write a slice of a volume as PNG", command_slice},
    {"convert", "copy a volume into another format", command_convert},
    {"scene", "make a procedural scene", command_scene},
    {"devices", "list what there is to compute on", command_devices},
    {"bench", "measure engines against each other", command_bench},
    {"version", "print the version", command_version},
    {"help", "print this, or the help of a command", command_help},
};
enum { COMMAND_COUNT = sizeof commands / sizeof commands[0] };

static const command *find_command(const char *name) {
    for (int i = 0; i < COMMAND_COUNT; i++) {
        if (strcmp(commands[i].name, name) == 0) {
            return &commands[i];
        }
    }
    return NULL;
}

static int print_overview(void) {
    printf("Fathom: exact distance fields of voxel grids, on GPUs and CPUs.\n\nusage: fathom COMMAND [ARGUMENTS]\n\n");
    for (int i = 0; i < COMMAND_COUNT; i++) {
        printf("  %-10s %s\n", commands[i].name, commands[i].summary);
    }
    printf("\nfathom COMMAND --help has the arguments and examples. Exit codes: 0 done, 1 failed, 2 bad usage.\n");
    return CLI_DONE;
}

static int command_version(int argc, char **argv) {
    if (argc > 1) {
        return cli_usage("version: unexpected argument \"%s\": it takes none", argv[1]);
    }
    printf("fathom %s\n", fm_version());
    return CLI_DONE;
}

static int command_help(int argc, char **argv) {
    if (argc < 2) {
        return print_overview();
    }
    const command *which = argc == 2 ? find_command(argv[1]) : NULL;
    if (!which) {
        return cli_usage("help: no command \"%s\": fathom help lists them", argv[argc - 1]);
    }
    if (which->run == command_help || which->run == command_version) {
        printf("usage: fathom %s\n", which->name);
        return CLI_DONE;
    }
    char flag[] = "--help";
    return which->run(2, (char *[]){argv[1], flag, NULL});
}

static void end_by_signal(int number) {
    fm_file_abort_all();
    signal(number, SIG_DFL);
    raise(number);
}

static void handle_signals(void) {
    signal(SIGXFSZ, SIG_IGN);  // a limit on file sizes is then an error of the write, with a message
    const int numbers[] = {SIGINT, SIGTERM, SIGHUP, SIGPIPE, SIGQUIT};
    for (size_t i = 0; i < sizeof numbers / sizeof numbers[0]; i++) {
        struct sigaction action = {0};
        // A signal that was ignored when the program started (nohup) stays so.
        if (sigaction(numbers[i], NULL, &action) == 0 && action.sa_handler != SIG_IGN) {
            action.sa_handler = end_by_signal;
            sigemptyset(&action.sa_mask);
            action.sa_flags = 0;
            sigaction(numbers[i], &action, NULL);
        }
    }
}

int main(int argc, char **argv) {
    handle_signals();
    if (argc < 2) {
        return cli_usage("no command given: fathom help lists them");
    }
    const char *name = argv[1];
    if (strcmp(name, "--help") == 0 || strcmp(name, "-h") == 0) {
        name = "help";
    } else if (strcmp(name, "--version") == 0) {
        name = "version";
    }
    const command *which = find_command(name);
    if (!which) {
        return cli_usage("no command \"%s\": fathom help lists them", name);
    }
    int status = which->run(argc - 1, argv + 1);
    if (fflush(stdout) != 0 || ferror(stdout)) {
        status = status == CLI_DONE ? cli_fail("standard output cannot be written: free space there or send it elsewhere") : status;
    }
    return status;
}
