// SPDX-License-Identifier: MIT
// Parts of the painting program that need no window: undo within its memory, the camera within what fm_camera takes, messages,
// moving meshes and their field, and the benchmark's table and summary.

#include "auto.h"
#include "check.h"
#include "edit.h"
#include "fly.h"
#include "message.h"
#include "moving.h"

#include "cli.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { EDGE = 24, VOXELS = EDGE * EDGE * EDGE, EDITS = 13 };

static const fm_box all = {{0, 0, 0}, {EDGE, EDGE, EDGE}};

static bool read_all(fm_world *world, uint32_t *voxels) {
    return CHECK_OK(fm_world_update(world, NULL)) && CHECK_OK(fm_world_read(world, &all, voxels));
}

static fm_brush brush_at(int32_t i) {
    const int32_t voxel[3] = {2 + i, 12, 12};
    return edit_brush(voxel, 0, 3, (uint32_t)(10 + i), i % 4 == 3);
}

static uint64_t bytes_of(int32_t i) {
    const int32_t low = 2 + i - 3 < 0 ? 0 : 2 + i - 3;
    return (uint64_t)(2 + i + 4 - low) * 7 * 7 * sizeof(uint32_t);
}

// Takes back what can be, comparing with the worlds before, and does it all again.
static void check_travel(edit_history *h, fm_world *world, uint32_t (*worlds)[VOXELS], uint32_t steps) {
    static uint32_t voxels[VOXELS];
    bool failed = true;
    CHECK(h->at == steps && h->count == steps);
    for (uint32_t i = 0; i < steps; i++) {
        CHECK(edit_undo(h, world, &failed) && !failed);
        CHECK(read_all(world, voxels) && memcmp(voxels, worlds[EDITS - 1 - i], sizeof voxels) == 0);
    }
    CHECK(!edit_undo(h, world, &failed) && !failed);
    for (uint32_t i = 0; i < steps; i++) {
        CHECK(edit_redo(h, world, &failed) && !failed);
    }
    CHECK(!edit_redo(h, world, &failed) && !failed);
    CHECK(read_all(world, voxels) && memcmp(voxels, worlds[EDITS], sizeof voxels) == 0);
}

static void test_undo(fm_context *context, uint64_t limit, uint32_t steps) {
    static uint32_t worlds[EDITS + 1][VOXELS];
    const fm_world_desc desc = {.shape = {EDGE, EDGE, EDGE}};
    fm_world *world = NULL;
    edit_history h = {.limit = limit};
    if (CHECK_OK(fm_world_create(context, &desc, &world))) {
        read_all(world, worlds[0]);
        for (int32_t i = 0; i < EDITS; i++) {
            const fm_brush brush = brush_at(i);
            bool changes = false;
            CHECK(edit_apply(&h, world, &brush, &changes) && changes);
            CHECK(h.bytes <= limit);
            read_all(world, worlds[i + 1]);
            CHECK(memcmp(worlds[i + 1], worlds[i], sizeof worlds[i]) != 0);
        }
        check_travel(&h, world, worlds, steps);
        // What is beside the world is no edit, and an edit ends what could be done again.
        const fm_brush beside = {.kind = FM_BRUSH_SPHERE, .voxel = 1, .from = {-9, 0, 0}, .radius = 8};
        bool changes = true, failed;
        CHECK(edit_apply(&h, world, &beside, &changes) && !changes && h.count == steps);
        const fm_brush last = brush_at(0);
        CHECK(steps == 0 || edit_undo(&h, world, &failed));
        CHECK(edit_apply(&h, world, &last, &changes) && changes && h.at == h.count && h.bytes <= limit);
    }
    edit_clear(&h);
    CHECK(h.count == 0 && h.bytes == 0 && h.limit == limit);
    fm_world_destroy(world);
}

// Neither an edit that changes no voxel nor one that the world refuses is a step or ends one.
static void test_undo_kept(fm_context *context) {
    const fm_world_desc desc = {.shape = {EDGE, EDGE, EDGE}};
    fm_world *world = NULL;
    static uint32_t before[VOXELS], after[VOXELS];
    const fm_brush first = brush_at(0), second = brush_at(1);
    fm_brush wrong = brush_at(2), smaller = first;
    edit_history h = {.limit = bytes_of(0) + bytes_of(1)};
    bool changes, failed;
    wrong.kind = (fm_brush_kind)99;
    smaller.radius--;
    if (CHECK_OK(fm_world_create(context, &desc, &world))) {
        CHECK(edit_apply(&h, world, &first, &changes) && changes && read_all(world, before));
        CHECK(edit_apply(&h, world, &second, &changes) && changes && read_all(world, after));
        // The oldest step would have to go for it.
        CHECK(!edit_apply(&h, world, &wrong, &changes) && h.count == 2 && h.at == 2);
        CHECK(edit_undo(&h, world, &failed) && read_all(world, after) && memcmp(before, after, sizeof before) == 0);
        CHECK(!edit_apply(&h, world, &wrong, &changes) && h.count == 2 && h.at == 1);
        CHECK(edit_apply(&h, world, &smaller, &changes) && !changes && h.count == 2 && h.at == 1);
        CHECK(edit_apply(&h, world, &first, &changes) && !changes && h.count == 2 && h.at == 1);
        CHECK(read_all(world, after) && memcmp(before, after, sizeof before) == 0);
        h.limit = 0;
        CHECK(!edit_apply(&h, world, &wrong, &changes) && h.count == 2 && h.at == 1);
        h.limit = bytes_of(0) + bytes_of(1);
        CHECK(edit_redo(&h, world, &failed));
    }
    edit_clear(&h);
    fm_world_destroy(world);
}

// As many of the newest edits as `steps` are remembered, and no byte more is there.
static void test_undo_bound(fm_context *context, uint32_t steps) {
    uint64_t limit = 0;
    for (uint32_t i = 0; i < steps; i++) {
        limit += bytes_of((int32_t)(EDITS - 1 - i));
    }
    test_undo(context, limit, steps);
    test_undo(context, limit + bytes_of((int32_t)(EDITS - 1 - steps)) - 1, steps);
}

static void test_fly(void) {
    const float none[2] = {0, 0}, far[3] = {3e5f, 3e5f, 3e5f}, down[2] = {0, 1e6f};
    fly f = fly_start((fm_shape){64, 64, 64});
    fm_context *context = NULL;
    const fm_context_desc desc = {.backend = FM_BACKEND_CPU, .threads = 1};
    for (int i = 0; i < 20; i++) {
        fly_by(&f, none, far);
        for (int axis = 0; axis < 3; axis++) {
            CHECK(fabsf(f.position[axis]) <= 524288);
        }
    }
    CHECK(f.position[2] == 524288);
    fly_by(&f, down, (const float[3]){0, 0, 0});
    CHECK(f.pitch < -1.5f && f.pitch > -1.5708f);
    // A picture can be made from there.
    const fm_world_desc world_desc = {.shape = {8, 8, 8}};
    fm_world *world = NULL;
    fm_renderer *renderer = NULL;
    const fm_render_desc picture = {.camera = fly_camera(&f), .width = 4, .height = 4};
    if (CHECK_OK(fm_context_create(&desc, &context)) && CHECK_OK(fm_world_create(context, &world_desc, &world)) &&
        CHECK_OK(fm_renderer_create(context, &renderer))) {
        CHECK_OK(fm_render(renderer, world, &picture, NULL));
    }
    fm_renderer_destroy(renderer);
    fm_world_destroy(world);
    fm_context_destroy(context);
}

static void test_messages(void) {
    message m = {0};
    message_say(&m, 1, "saved %s", "a.vox");
    CHECK(strcmp(m.text, "saved a.vox") == 0 && !m.failed && m.said == 1);
    CHECK_FAILS(fm_wait(NULL, 1), FM_ERROR_INVALID_ARGUMENT);
    message_no_picture(&m, 2, "picture");
    CHECK(strncmp(m.text, "picture: ", 9) == 0 && m.failed && m.said == 2);
    // The next ones come with every frame. What is said between them stays.
    message_say(&m, 3, "made %s", "city");
    message_no_picture(&m, 4, "picture");
    CHECK(strcmp(m.text, "made city") == 0 && !m.failed);
    message_no_picture(&m, 7.5, "picture");
    CHECK(m.failed && m.said == 7.5);
    message_picture(&m);
    message_no_picture(&m, 8, "picture");
    CHECK(m.failed && m.said == 8);
}

// Whatever the time, objects stay within the box of their field and do not touch each other.
static void check_paths(moving_stage *s) {
    const paint_mesh_settings none = {0};
    for (int i = 0; i < 24; i++) {
        uint64_t pairs = 1;
        fm_mesh_info info;
        bool works = true;
        CHECK(moving_update(s, &none, 1.7 * i, &works) && !works);
        fm_mesh *mesh = fm_scene_mesh(s->scene);
        CHECK_OK(fm_mesh_intersections(mesh, 1, &pairs));
        CHECK(pairs == 0);
        CHECK_OK(fm_mesh_describe(mesh, &info));
        CHECK(info.triangles == s->triangles && info.low[2] == -2 && info.high[2] < 34);
        for (int axis = 0; axis < 2; axis++) {
            CHECK(info.low[axis] >= 0 && info.high[axis] <= 64);
        }
    }
}

// A field is made where something asks for it, and an exact one again only when something has changed.
static void check_fields(moving_stage *s) {
    paint_mesh_settings m = {.edge = 16, .band = 2, .rays = 1, .samples = 1, .shadows = FM_SHADOWS_FIELD};
    const fly above = fly_start(moving_shape);
    const fm_camera camera = fly_camera(&above);
    bool works = false, exact = false;
    CHECK(moving_update(s, &m, 1, &works) && works);
    CHECK(moving_update(s, &m, 1, &works) && !works);
    CHECK(moving_update(s, &m, 2, &works) && works);
    CHECK(s->sign.sign_why != NULL);
    fm_volume_desc grid;
    fm_volume_info(s->field, &grid);
    CHECK(grid.shape.x == 16 && grid.shape.y == 16 && grid.shape.z == 10);
    m.band = 0;
    CHECK(moving_update(s, &m, 2, &works) && works);
    CHECK(moving_draw(s, &m, &camera, 8, 8));
    CHECK(paint_field_truth(&m, &exact) && exact && paint_shadow_truth(&m, &exact) && !exact);
    m.field = PAINT_FIELD_RTSDF;
    for (int i = 0; i < 2; i++) {
        CHECK(moving_update(s, &m, 2, &works) && works && s->rtsdf && !s->field);
        CHECK(moving_draw(s, &m, &camera, 8, 8));
    }
    fm_rtsdf *before = s->rtsdf;
    m.field = PAINT_FIELD_COARSE;
    CHECK(moving_update(s, &m, 2, &works) && works && s->rtsdf == before);
    CHECK(paint_field_truth(&m, &exact) && !exact);
    m.shadows = FM_SHADOWS_RAY;
    CHECK(moving_update(s, &m, 3, &works) && !works && moving_draw(s, &m, &camera, 8, 8));
    CHECK(!moving_draw(s, &m, &camera, 0, 8));
}

// A file of any size, with a triangle that takes no part, stands over the middle of the floor.
static void check_file(fm_context *context) {
    static const char text[] = "v 1000 1000 1000\nv 5000 1000 1000\nv 1000 5000 1000\nv 1000 1000 9000\nv 2e18 0 0\n"
                               "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\nf 1 2 5\n";
    char path[] = "/tmp/fathom-parts-XXXXXX.obj";
    const int fd = mkstemps(path, 4);
    moving_stage with, without;
    CHECK(fd >= 0 && write(fd, text, sizeof text - 1) == (ssize_t)(sizeof text - 1) && close(fd) == 0);
    const bool opened = CHECK(moving_open(&with, context, path, false));
    bool works;
    fm_mesh_info info;
    const paint_mesh_settings none = {0};
    if (opened && CHECK(moving_update(&with, &none, 0, &works)) && CHECK_OK(fm_mesh_describe(fm_scene_mesh(with.scene), &info))) {
        CHECK(info.dropped == 1 && info.high[0] <= 64 && info.high[2] <= 24 && info.low[2] == -2);
    }
    moving_close(&with);
    CHECK(!moving_open(&without, context, "/nonexistent/mesh.ply", false));
    moving_close(&without);
    moving_close(&without);
    unlink(path);
}

static void test_moving(fm_context *context) {
    moving_stage s;
    if (CHECK(moving_open(&s, context, NULL, false))) {
        check_paths(&s);
        check_fields(&s);
    }
    moving_close(&s);
    check_file(context);
}

static void put_frames(auto_run *run, uint32_t count) {
    for (uint32_t i = 0; i < count; i++) {
        const auto_frame frame = {.start_ms = i, .delta_ms = i + 1, .edits = i % 2};
        // Times come a frame late, or before their frame is recorded.
        auto_add(run, i + (i % 2 ? 0 : 1), 0, i % 2 ? 0.5 : 0);
        CHECK(auto_record(run, &frame));
        auto_add(run, i, 2, 0);
    }
}

static void test_summary(uint32_t count, const char *p99) {
    char csv[] = "/tmp/fathom-parts-XXXXXX", line[256] = "", wanted[32];
    const int fd = mkstemp(csv);
    const auto_desc desc = {.seed = 1, .frames = count, .radius = 3, .csv = csv};
    auto_run run;
    FILE *text = tmpfile();
    CHECK(fd >= 0 && close(fd) == 0);
    CHECK(auto_check(&desc) == CLI_DONE);
    auto_begin(&run, &desc, (fm_shape){32, 32, 32}, 0);
    put_frames(&run, count);
    CHECK(run.frames[0].march_ms == 0 && run.frames[1].march_ms == 0.5 && run.frames[2].march_ms == 0);
    CHECK(run.frames[0].field_ms == 2);
    if (CHECK(text)) {
        CHECK(auto_finish(&run, text) == CLI_DONE);
        rewind(text);
        while (fgets(line, sizeof line, text) && strncmp(line, "delta ms", 8) != 0) {
        }
        snprintf(wanted, sizeof wanted, " %s ", p99);
        CHECK(strstr(line, wanted));
        fclose(text);
    }
    FILE *table = fopen(csv, "r");
    uint32_t lines = 0;
    while (table && fgets(line, sizeof line, table)) {
        lines++;
    }
    CHECK(lines == count + 1);
    if (table) {
        fclose(table);
    }
    unlink(csv);
    auto_free(&run);
}

static void test_refused_table(void) {
    const auto_desc desc = {.csv = "/nonexistent/frames.csv"}, none = {0};
    CHECK(auto_check(&desc) == CLI_FAILED);
    CHECK(auto_check(&none) == CLI_DONE);
}

int main(void) {
    const fm_context_desc desc = {.backend = FM_BACKEND_CPU, .threads = 2};
    fm_context *context = NULL;
    if (CHECK_OK(fm_context_create(&desc, &context))) {
        test_undo(context, UINT64_MAX / 2, EDITS);
        test_undo_kept(context);
        test_undo_bound(context, 5);
        test_undo_bound(context, 1);
        test_undo_bound(context, 0);
        test_moving(context);
    }
    fm_context_destroy(context);
    test_fly();
    test_messages();
    // Delta is 1, 2, ... ms: the least value that 99 % do not exceed.
    test_summary(40, "40.0000");
    test_summary(100, "99.0000");
    test_summary(101, "100.0000");
    test_summary(200, "198.0000");
    test_refused_table();
    return check_summary();
}
