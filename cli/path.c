// SPDX-License-Identifier: MIT
#include "path.h"
#include "camera.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { PITCH = 4, FOV = 5, AROUND_FOV = 60 };

static void add(cli_args *args, path_options *o, double farthest, const char *camera) {
    o->farthest = farthest;
    o->camera = cli_add(args, arg_str0(NULL, "camera", "X,Y,Z,YAW,PITCH[,FOV]", camera));
    o->look_at = cli_add(args, arg_str0(NULL, "look-at", "X,Y,Z[,DISTANCE[,YAW[,PITCH]]]", "a camera around a place"));
    o->path = cli_add(args, arg_str0(NULL, "path", "N", "N pictures, numbered, or frames: once around, or along --keys"));
    o->keys = cli_add(args, arg_str0(NULL, "keys", "FILE", "cameras as in --camera, one a line, # begins a comment; for --path"));
}

void path_options_add(cli_args *args, path_options *o) {
    add(args, o, FM_CAMERA_FARTHEST, "in voxels and degrees: yaw 0 looks along +x, 90 along +y, pitch 90 up; default: all is seen");
}

void path_options_add_mesh(cli_args *args, path_options *o) {
    add(args, o, 1e18,
        "in the mesh's units, or voxels, and degrees: yaw 0 looks along +x, 90 along +y, pitch 90 up; default: all is seen");
}

bool path_numbers(const char *text, int least, int most, double *values) {
    int count = 0;
    for (const char *at = text; count < most; at++) {
        char *end;
        values[count] = strtod(at, &end);
        if (end == at || !isfinite(values[count])) {
            return false;
        }
        count++;
        at = end;
        if (*at != ',') {
            return *at == '\0' && count >= least;
        }
    }
    return false;
}

static bool read_camera(const char *what, const char *text, double farthest, camera_key *key) {
    *key = (camera_key){{0, 0, 0, 0, 0, 60}};
    if (!path_numbers(text, 5, 6, key->v) || !(key->v[FOV] > 0 && key->v[FOV] < 180)) {
        cli_usage("%s is \"%.80s\": X,Y,Z,YAW,PITCH or X,Y,Z,YAW,PITCH,FOV is wanted, the last above 0 and below 180", what, text);
        return false;
    }
    const double most = fmax(fabs(key->v[0]), fmax(fabs(key->v[1]), fabs(key->v[2])));
    if (most > farthest || fabs(key->v[3]) > 1e6 || fabs(key->v[PITCH]) > 90) {
        cli_usage("%s is \"%.80s\": positions from -%g to %g, yaws from -1000000 to 1000000 and pitches from -90 to 90 are wanted",
                  what, text, farthest, farthest);
        return false;
    }
    return true;
}

// A line without its comment and the blanks at its ends; its length is `length`. NULL where it has a NUL.
static const char *trimmed(char *line, size_t length) {
    if (strlen(line) != length) {
        return NULL;
    }
    line[strcspn(line, "#")] = '\0';
    const char *begin = line + strspn(line, " \t\r\n");
    size_t end = strlen(begin);
    while (end > 0 && strchr(" \t\r\n", begin[end - 1])) {
        end--;
    }
    line[begin - line + (ptrdiff_t)end] = '\0';
    return begin;
}

static bool read_line(char *line, size_t length, int number, double farthest, camera_path *path) {
    const char *text = trimmed(line, length);
    char what[64];
    snprintf(what, sizeof what, "line %d of --keys", number);
    if (!text) {
        cli_usage("%s has a character 0: text is wanted", what);
        return false;
    }
    if (text[0] == '\0') {
        return true;
    }
    if (path->key_count == PATH_MAX_KEYS) {
        cli_usage("%s is one camera more than %d: use fewer", what, PATH_MAX_KEYS);
        return false;
    }
    return read_camera(what, text, farthest, &path->keys[path->key_count++]);
}

static bool read_keys(const char *name, double farthest, camera_path *path) {
    FILE *file = fopen(name, "r");
    char *line = NULL;
    size_t room = 0;
    bool good = true;
    errno = file ? 0 : errno;
    for (int number = 1; file && good; number++) {
        const ssize_t length = getline(&line, &room, file);
        if (length < 0) {
            break;
        }
        good = read_line(line, (size_t)length, number, farthest, path);
    }
    free(line);
    if (good && (!file || ferror(file))) {
        cli_usage("--keys is \"%s\": it cannot be read: %s", name, strerror(errno));
        good = false;
    } else if (good && path->key_count == 0) {
        cli_usage("--keys is \"%s\": no line of it is a camera", name);
        good = false;
    }
    if (file) {
        fclose(file);
    }
    return good;
}

bool path_options_read(const path_options *o, camera_path *path) {
    const char *wrong = NULL;
    *path = (camera_path){
        .camera_given = o->camera->count > 0, .around_given = o->look_at->count > 0, .around = {0, 0, 0, 0, 50, -32}, .frames = 1};
    if (path->camera_given + path->around_given + (o->keys->count > 0) > 1) {
        wrong = "--camera, --look-at and --keys: one of them is enough";
    } else if (o->keys->count && !o->path->count) {
        wrong = "--keys is given without --path: how many pictures shall there be?";
    }
    if (wrong) {
        cli_usage("%s", wrong);
        return false;
    }
    if (path->around_given && !path_numbers(o->look_at->sval[0], 3, 6, path->around)) {
        cli_usage("--look-at is \"%s\": X,Y,Z is wanted, then, if you like, a distance, yaw and pitch", o->look_at->sval[0]);
        return false;
    }
    return (!path->camera_given || read_camera("--camera", o->camera->sval[0], o->farthest, &path->camera)) &&
           (!o->path->count || cli_uint32("--path", o->path->sval[0], 1, &path->frames)) &&
           (!o->keys->count || read_keys(o->keys->sval[0], o->farthest, path));
}

// How fast a number changes at a key, from the changes before and after it. Half-way between them (Catmull and Rom 1974); angles
// that have ends stay within their keys' (Steffen 1990, "A simple method for monotonic interpolation in one dimension").
static double speed(double before, double after, bool within) {
    if (!within) {
        return 0.5 * (before + after);
    }
    const double least = fmin(fmin(fabs(before), fabs(after)), 0.25 * fabs(before + after));
    return before * after > 0 ? copysign(2 * least, after) : 0;
}

static camera_key between(const camera_key *keys, uint32_t count, double place) {
    if (count == 1) {
        return keys[0];
    }
    const uint32_t first = place >= count - 1 ? count - 2 : (uint32_t)place;
    const double t = place - first;
    const camera_key *a = &keys[first], *b = a + 1;
    camera_key result;
    for (int i = 0; i < 6; i++) {
        const bool within = i == PITCH || i == FOV;
        const double change = b->v[i] - a->v[i];
        const double from = speed(first > 0 ? a->v[i] - a[-1].v[i] : change, change, within);
        const double to = speed(change, first + 2 < count ? b[1].v[i] - b->v[i] : change, within);
        result.v[i] = a->v[i] + t * (from + t * (3 * change - 2 * from - to + t * (from + to - 2 * change)));
    }
    return result;
}

// Far enough for all of a path, so that the camera goes in a circle.
static double farthest_of(const camera_path *path, const double low[3], const double high[3], double aspect) {
    enum { MOST_TURNS = 360 };
    const uint32_t turns = path->frames < MOST_TURNS ? path->frames : MOST_TURNS;
    double farthest = 0;
    for (uint32_t i = 0; i < turns; i++) {
        const double yaw = path->around[4] + 360.0 * i / turns;
        farthest = fmax(farthest, camera_distance(low, high, path->around, aspect, yaw, path->around[5], AROUND_FOV));
    }
    return farthest;
}

void camera_path_fit(camera_path *path, const double low[3], const double high[3], double aspect) {
    if (path->camera_given || path->key_count) {
        return;
    }
    if (!path->around_given && path->frames == 1) {
        path->around[3] = camera_frame(low, high, aspect, path->around[4], path->around[5], AROUND_FOV, path->around);
    } else if (!path->around_given) {
        for (int i = 0; i < 3; i++) {
            path->around[i] = low[i] + 0.5 * (high[i] - low[i]);
        }
    }
    path->around_given = true;
    if (!(path->around[3] > 0)) {
        path->around[3] = farthest_of(path, low, high, aspect);
    }
}

fm_camera camera_path_at(const camera_path *path, fm_shape shape, double aspect, uint32_t frame) {
    const double turn = 360.0 * frame / path->frames;
    if (path->key_count) {
        const double place = path->frames > 1 ? (double)frame * (path->key_count - 1) / (path->frames - 1) : 0;
        const camera_key key = between(path->keys, path->key_count, place);
        return camera_look(key.v, key.v[3], key.v[PITCH], key.v[FOV]);
    }
    if (path->camera_given) {
        return camera_look(path->camera.v, path->camera.v[3] + turn, path->camera.v[PITCH], path->camera.v[FOV]);
    }
    if (!path->around_given) {
        return camera_fit(shape, aspect, 50 + turn, -32, AROUND_FOV);
    }
    const double longest = fmax(shape.x, fmax(shape.y, shape.z));
    const double *around = path->around;
    return camera_around(around, around[3] > 0 ? around[3] : 0.6 * longest, around[4] + turn, around[5], AROUND_FOV);
}
