// SPDX-License-Identifier: MIT
// The chunked methods: each against an oracle that knows nothing of chunks but their boxes, after edits too, and Vulkan against the
// CPU. `--short`, the first argument, takes a few of the combinations.

#include "vulkan_common.h"
#include "world/gpu_world.h"
#include "world/host_world.h"
#include "world_common.h"

typedef struct setup {
    fm_shape shape;
    fm_world_method method;
    fm_field_format format;
    uint32_t solid;  // a voxel in this many is solid, about
} setup;

static const char *const names[] = {"exact", "brute force", "FIM",       "published JFA", "JFA",
                                    "1+JFA", "JFA+2",       "JFA + FIM", "selective",     "published final"};

// The worlds under test: the CPU's always, Vulkan's where it is asked for.
typedef struct worlds {
    fm_world *host, *device;
    uint32_t *voxels;  // a model of both
} worlds;

static uint64_t count_of(fm_shape shape) {
    return (uint64_t)shape.x * shape.y * shape.z;
}

static void edit(worlds *w, const setup *s, const fm_brush *brushes, uint32_t count) {
    CHECK_OK(fm_world_edit(w->host, brushes, count));
    if (w->device) {
        CHECK_OK(fm_world_edit(w->device, brushes, count));
    }
    for (uint32_t i = 0; i < count; i++) {
        int32_t at[3];
        uint64_t element = 0;
        for (at[2] = 0; at[2] < (int32_t)s->shape.z; at[2]++) {
            for (at[1] = 0; at[1] < (int32_t)s->shape.y; at[1]++) {
                for (at[0] = 0; at[0] < (int32_t)s->shape.x; at[0]++, element++) {
                    w->voxels[element] = world_covers(&brushes[i], at) ? brushes[i].voxel : w->voxels[element];
                }
            }
        }
    }
}

static bool open_worlds(worlds *w, const setup *s, fm_context *cpu, fm_context *gpu) {
    const fm_world_desc desc = {.shape = s->shape, .format = s->format, .method = s->method};
    *w = (worlds){.voxels = calloc(count_of(s->shape), sizeof *w->voxels)};
    return CHECK(w->voxels != NULL) && CHECK_OK(fm_world_create(cpu, &desc, &w->host)) &&
           (!gpu || CHECK_OK(fm_world_create(gpu, &desc, &w->device)));
}

static void close_worlds(worlds *w) {
    fm_world_destroy(w->host);
    fm_world_destroy(w->device);
    free(w->voxels);
}

static void scatter(worlds *w, const setup *s, uint64_t *seed) {
    uint32_t count = s->solid ? (uint32_t)(count_of(s->shape) / s->solid) : 0;
    fm_brush *brushes = calloc(count + 1, sizeof *brushes);
    if (!CHECK(brushes != NULL)) {
        return;
    }
    for (uint32_t i = 0; i < count; i++) {
        int32_t at[3] = {test_between(seed, 0, (int32_t)s->shape.x - 1), test_between(seed, 0, (int32_t)s->shape.y - 1),
                         test_between(seed, 0, (int32_t)s->shape.z - 1)};
        brushes[i] = (fm_brush){.voxel = (uint32_t)test_random(seed) | 1, .from = {at[0], at[1], at[2]}};
        w->voxels[((uint64_t)at[2] * s->shape.y + (uint64_t)at[1]) * s->shape.x + (uint64_t)at[0]] = brushes[i].voxel;
    }
    CHECK_OK(fm_world_edit(w->host, brushes, count));
    if (w->device) {
        CHECK_OK(fm_world_edit(w->device, brushes, count));
    }
    free(brushes);
}

static void host_field(const setup *s, const fm_world *world, uint32_t *distance, uint32_t *color) {
    for (uint64_t i = 0; i < count_of(s->shape); i++) {
        distance[i] = fm_host_distance(world, i);
        color[i] = world->host->colors ? world->host->colors[i] : ((const uint32_t *)world->host->field)[i] & 0xffffff;
    }
}

static void device_field(const setup *s, const fm_world *world, uint32_t *distance, uint32_t *color) {
    uint64_t voxels = count_of(s->shape);
    uint32_t width = fm_field_width(s->format);
    uint8_t *field = malloc(voxels * width), *colors = malloc(voxels);
    if (CHECK(field && colors) && CHECK_OK(fm_buffer_download_at(world->gpu->field, 0, field, voxels * width)) &&
        (!world->gpu->colors || CHECK_OK(fm_buffer_download_at(world->gpu->colors, 0, colors, voxels)))) {
        for (uint64_t i = 0; i < voxels; i++) {
            uint32_t entry = 0;
            memcpy(&entry, field + i * width, width);
            distance[i] = s->format == FM_FIELD_PACKED ? entry >> 24 : entry;
            color[i] = s->format == FM_FIELD_PACKED ? entry & 0xffffff : colors[i];
        }
    }
    free(field);
    free(colors);
}

static uint32_t apart(uint32_t a, uint32_t b) {
    return a < b ? b - a : a - b;
}

// Distances from the sites of a box, and from what lies beyond it if it is padded, for a box within it.
static void oracle_box(const setup *s, const uint32_t *voxels, const uint32_t box[6], const uint32_t result[6], bool padded,
                       uint32_t cap, uint32_t *distance) {
    uint32_t *sites = malloc(count_of(s->shape) * 3 * sizeof *sites), count = 0;
    for (uint32_t z = box[2]; sites && z < box[5]; z++) {
        for (uint32_t y = box[1]; y < box[4]; y++) {
            for (uint32_t x = box[0]; x < box[3]; x++) {
                if (voxels[((uint64_t)z * s->shape.y + y) * s->shape.x + x]) {
                    memcpy(&sites[3 * count++], (const uint32_t[3]){x, y, z}, 3 * sizeof *sites);
                }
            }
        }
    }
    for (uint32_t z = result[2]; z < result[5]; z++) {
        for (uint32_t y = result[1]; y < result[4]; y++) {
            for (uint32_t x = result[0]; x < result[3]; x++) {
                const uint32_t at[3] = {x, y, z};
                uint32_t best = cap;
                for (uint32_t i = 0; i < count; i++) {
                    uint32_t way = apart(x, sites[3 * i]) + apart(y, sites[3 * i + 1]) + apart(z, sites[3 * i + 2]);
                    best = way < best ? way : best;
                }
                for (int i = 0; padded && i < 3; i++) {
                    uint32_t way = at[i] + 1 - box[i] < box[i + 3] - at[i] ? at[i] + 1 - box[i] : box[i + 3] - at[i];
                    bool solid = voxels[((uint64_t)z * s->shape.y + y) * s->shape.x + x] != 0;
                    best = way < best && !solid ? way : best;
                }
                distance[((uint64_t)z * s->shape.y + y) * s->shape.x + x] = best;
            }
        }
    }
    free(sites);
}

// What an exact algorithm must give, chunk by chunk.
static void oracle(const setup *s, fm_context *cpu, const uint32_t *voxels, uint32_t *distance) {
    const uint32_t shape[3] = {s->shape.x, s->shape.y, s->shape.z};
    const uint32_t cap = s->format == FM_FIELD_SPLIT_U16 ? UINT16_MAX : UINT8_MAX, chunk = s->method.chunk;
    if (chunk == 0 || s->method.border == FM_BORDER_EXCHANGE) {
        const fm_array in = {(void *)voxels, FM_TYPE_U32, s->shape}, out = {distance, FM_TYPE_U32, s->shape};
        const fm_transform_desc desc = {.metric = FM_METRIC_L1};
        CHECK_OK(fm_transform_host(cpu, &desc, &in, &out, NULL));
        for (uint64_t i = 0; i < count_of(s->shape); i++) {
            distance[i] = distance[i] > cap ? cap : distance[i];
        }
        return;
    }
    for (uint32_t z = 0; z < shape[2]; z += chunk) {
        for (uint32_t y = 0; y < shape[1]; y += chunk) {
            for (uint32_t x = 0; x < shape[0]; x += chunk) {
                uint32_t result[6] = {x, y, z}, box[6], halo = s->method.border == FM_BORDER_HALO ? chunk : 0;
                for (int i = 0; i < 3; i++) {
                    result[i + 3] = result[i] + chunk < shape[i] ? result[i] + chunk : shape[i];
                    box[i] = result[i] > halo ? result[i] - halo : 0;
                    box[i + 3] = result[i + 3] + halo < shape[i] ? result[i + 3] + halo : shape[i];
                }
                oracle_box(s, voxels, box, result, s->method.border == FM_BORDER_PADDING, cap, distance);
            }
        }
    }
}

// What approximate algorithms got wrong, over all scenes.
static struct errors { uint64_t air, wrong, sum, most; } errors[FM_WORLD_PUBLISHED_FINAL + 1];

static uint64_t compare(const setup *s, fm_world_algorithm algorithm, const uint32_t *voxels, const uint32_t *got,
                        const uint32_t *exact) {
    // Jump flooding of sites too: see src/world/chunks.h.
    bool is_exact = algorithm != FM_WORLD_JFA_PUBLISHED;
    uint64_t bad = 0;
    struct errors *sum = &errors[algorithm];
    for (uint64_t i = 0; i < count_of(s->shape); i++) {
        if (voxels[i]) {
            bad += got[i] != 0;
        } else if (algorithm == FM_WORLD_PUBLISHED_FINAL) {
            bad += got[i] != 1;
        } else {
            bad += is_exact ? got[i] != exact[i] : got[i] < exact[i];
            uint64_t error = got[i] - exact[i];
            sum->air++;
            sum->wrong += error != 0;
            sum->sum += error;
            sum->most = error > sum->most ? error : sum->most;
        }
    }
    return bad;
}

static void check_stage(worlds *w, const setup *s, fm_context *cpu, uint32_t stage) {
    uint64_t voxels = count_of(s->shape), bad = 0, unlike = 0, miscoloured = 0;
    uint32_t *memory = malloc(5 * voxels * sizeof *memory);
    if (!CHECK(memory != NULL) || !CHECK_OK(fm_world_update(w->host, NULL))) {
        free(memory);
        return;
    }
    uint32_t *exact = memory, *got = memory + voxels, *color = got + voxels, *other = color + voxels, *other_color = other + voxels;
    host_field(s, w->host, got, color);
    if (s->method.algorithm != FM_WORLD_SELECTIVE) {
        oracle(s, cpu, w->voxels, exact);
        bad = compare(s, s->method.algorithm, w->voxels, got, exact);
    }
    if (w->device && CHECK_OK(fm_world_update(w->device, NULL))) {
        device_field(s, w->device, other, other_color);
        for (uint64_t i = 0; i < voxels; i++) {
            unlike += other[i] != got[i];
            miscoloured += other_color[i] != (w->voxels[i] & 0xff);
        }
    }
    for (uint64_t i = 0; i < voxels; i++) {
        miscoloured += color[i] != (w->voxels[i] & 0xff);
    }
    if (!CHECK(bad == 0 && unlike == 0 && miscoloured == 0)) {
        fprintf(
            stderr,
            "    %s, %u x %u x %u, chunk %u, border %d, convergence %d, format %d, stage %u: %llu wrong, %llu differ on Vulkan, "
            "%llu colours\n",
            names[s->method.algorithm], s->shape.x, s->shape.y, s->shape.z, s->method.chunk, s->method.border,
            s->method.convergence, s->format, stage, (unsigned long long)bad, (unsigned long long)unlike,
            (unsigned long long)miscoloured);
    }
    free(memory);
}

static void run_setup(const setup *s, fm_context *cpu, fm_context *gpu, uint32_t stages, uint64_t seed) {
    worlds w;
    if (open_worlds(&w, s, cpu, gpu)) {
        scatter(&w, s, &seed);
        check_stage(&w, s, cpu, 0);
        for (uint32_t stage = 1; stage <= stages; stage++) {
            fm_brush brushes[2];
            brushes[0] = world_random_brush(&seed, s->shape, 5);
            brushes[1] = world_random_brush(&seed, s->shape, 3);
            // Deletions raise distances: the harder case comes often.
            brushes[1].voxel = 0;
            edit(&w, s, brushes, stage % 2 + 1);
            check_stage(&w, s, cpu, stage);
        }
    }
    close_worlds(&w);
}

static const fm_shape shapes[] = {{40, 33, 17}, {16, 16, 16}, {8, 8, 8},    {45, 20, 24},
                                  {1, 1, 1},    {3, 50, 2},   {32, 32, 32}, {9, 1, 70}};
static const uint32_t chunks[] = {0, 8, 16, 32, 64, 128};

enum { SHAPES = sizeof shapes / sizeof shapes[0], CHUNKS = sizeof chunks / sizeof chunks[0] };

// One chunk holds all of the world, and the next smaller one did already.
static bool is_repeated(fm_shape shape, uint32_t chunk) {
    uint32_t longest = shape.x > shape.y ? shape.x : shape.y;
    longest = longest > shape.z ? longest : shape.z;
    return chunk > chunks[1] && chunk / 2 >= longest;
}

// Every `stride`-th of all combinations.
static void test_all(fm_context *cpu, fm_context *gpu, uint32_t stride) {
    static const fm_world_algorithm algorithms[] = {
        FM_WORLD_BRUTE_FORCE, FM_WORLD_FIM,        FM_WORLD_JFA_PUBLISHED, FM_WORLD_JFA,
        FM_WORLD_JFA_1_PLUS,  FM_WORLD_JFA_PLUS_2, FM_WORLD_JFA_FIM,       FM_WORLD_PUBLISHED_FINAL};
    uint64_t number = 0;
    for (uint32_t a = 0; a < sizeof algorithms / sizeof algorithms[0]; a++) {
        bool relaxes = algorithms[a] == FM_WORLD_FIM || algorithms[a] == FM_WORLD_JFA_FIM;
        for (uint32_t shape = 0; shape < SHAPES; shape++) {
            for (uint32_t c = 0; c < CHUNKS; c++) {
                int borders = chunks[c] == 0 ? FM_BORDER_PADDING : relaxes ? FM_BORDER_EXCHANGE : FM_BORDER_HALO;
                for (int border = 0; border <= borders && !is_repeated(shapes[shape], chunks[c]); border++) {
                    if (++number % stride != 0) {
                        continue;
                    }
                    setup s = {.shape = shapes[shape],
                               .method = {.algorithm = algorithms[a], .chunk = chunks[c], .border = (fm_world_border)border},
                               .format = (fm_field_format)(number % 3),
                               .solid = number % 7 == 0 ? 0
                                        : number % 2    ? 300
                                                        : 20};
                    for (int convergence = 0; convergence <= (gpu && relaxes ? 1 : 0); convergence++) {
                        s.method.convergence = (fm_world_convergence)convergence;
                        run_setup(&s, cpu, gpu, gpu ? 1 : 2, number + 1);
                    }
                }
            }
        }
    }
}

// More words of site bits than a dispatch tries.
static void test_brute_parts(fm_context *cpu, fm_context *gpu) {
    const setup s = {.shape = {1, 182, 182}, .method = {.algorithm = FM_WORLD_BRUTE_FORCE}, .solid = 3000};
    run_setup(&s, cpu, gpu, 0, 1);
}

// The longest ways that there are: from one corner, and then from the one across.
static void test_far(fm_context *cpu, fm_context *gpu) {
    static const fm_shape far[] = {{90, 40, 33}, {300, 9, 17}};
    for (uint32_t i = 0; i < 2 * 2 * 3; i++) {
        fm_shape shape = far[i & 1];
        const setup s = {.shape = shape,
                         .method = {.algorithm = i & 2 ? FM_WORLD_JFA_FIM : FM_WORLD_FIM,
                                    .chunk = i / 4 == 0 ? 0 : 16,
                                    .border = i / 4 == 1 ? FM_BORDER_HALO : FM_BORDER_EXCHANGE},
                         .format = i & 1 ? FM_FIELD_PACKED : FM_FIELD_SPLIT_U16};
        const fm_brush near_corner = {.voxel = 3},
                       far_corner = {.voxel = 4, .from = {(int32_t)shape.x - 1, (int32_t)shape.y - 1, (int32_t)shape.z - 1}};
        const fm_brush moved[] = {{.voxel = 0}, far_corner};
        worlds w;
        if (open_worlds(&w, &s, cpu, gpu)) {
            edit(&w, &s, &near_corner, 1);
            check_stage(&w, &s, cpu, 0);
            edit(&w, &s, moved, 2);
            check_stage(&w, &s, cpu, 1);
        }
        close_worlds(&w);
    }
}

// So many rounds that the device's lists are used again.
static void test_many_updates(fm_context *cpu, fm_context *gpu) {
    const setup s = {
        .shape = {300, 9, 17}, .method = {.algorithm = FM_WORLD_FIM, .chunk = 32, .border = FM_BORDER_EXCHANGE}, .solid = 3000};
    uint64_t seed = 77;
    worlds w;
    if (open_worlds(&w, &s, cpu, gpu)) {
        scatter(&w, &s, &seed);
        check_stage(&w, &s, cpu, 0);
        for (uint32_t i = 1; i <= 300; i++) {
            fm_brush brush = world_random_brush(&seed, s.shape, 2);
            edit(&w, &s, &brush, 1);
            CHECK_OK(fm_world_update(w.device, NULL));
            if (i % 50 == 0) {
                check_stage(&w, &s, cpu, i);
            }
        }
    }
    close_worlds(&w);
}

// Exchange in a world that is larger than what 8 bits tell apart, where an edit must leave distant chunks alone.
static void test_exchange(fm_context *cpu, fm_context *gpu) {
    for (int format = 0; format < 3; format++) {
        for (int host = 0; host <= (gpu ? 1 : 0); host++) {
            const setup s = {.shape = {300, 20, 9},
                             .method = {.algorithm = FM_WORLD_FIM,
                                        .chunk = 16,
                                        .border = FM_BORDER_EXCHANGE,
                                        .convergence = (fm_world_convergence)host},
                             .format = (fm_field_format)format};
            worlds w;
            if (open_worlds(&w, &s, cpu, gpu)) {
                const fm_brush placed[] = {{.voxel = 7, .from = {5, 5, 5}, .radius = 2}, {.voxel = 9, .from = {150, 3, 3}}};
                edit(&w, &s, placed, 2);
                check_stage(&w, &s, cpu, 0);
                const fm_brush deleted = {.from = {5, 5, 5}, .radius = 2};
                edit(&w, &s, &deleted, 1);
                check_stage(&w, &s, cpu, 1);
                uint32_t wanted = (format == FM_FIELD_SPLIT_U16 ? 19 : 17) * 2;  // of 19 x 2 x 1 chunks
                CHECK(w.host->stats.chunks == wanted && !w.host->stats.full);
                check_stage(&w, &s, cpu, 2);
            }
            close_worlds(&w);
        }
    }
}

static void test_selective(fm_context *cpu, fm_context *gpu) {
    static const fm_world_algorithm nears[] = {FM_WORLD_FIM, FM_WORLD_JFA_FIM}, fars[] = {FM_WORLD_JFA_PUBLISHED, FM_WORLD_JFA};
    static const int32_t focus[][3] = {{20, 20, 20}, {28, 20, 20}, {-100, 3, 9}, {20, 20, 20}, {1000, -5, 17}};
    uint64_t seed = 5;
    for (uint32_t i = 0; i < 4 * 3; i++) {
        setup s = {.shape = {40, 41, 24},
                   .method = {.algorithm = FM_WORLD_SELECTIVE,
                              .chunk = 8,
                              .border = i / 4 == 1 ? FM_BORDER_HALO : FM_BORDER_PADDING,
                              .near_algorithm = nears[i & 1],
                              .far_algorithm = fars[i >> 1 & 1],
                              .focus_chunks = i / 4 + 1},
                   .solid = 60};
        worlds w;
        if (open_worlds(&w, &s, cpu, gpu)) {
            scatter(&w, &s, &seed);
            for (uint32_t k = 0; k < sizeof focus / sizeof focus[0]; k++) {
                fm_world_set_focus(w.host, focus[k]);
                if (w.device) {
                    fm_world_set_focus(w.device, focus[k]);
                }
                if (k == 3) {
                    fm_brush brush = world_random_brush(&seed, s.shape, 4);
                    edit(&w, &s, &brush, 1);
                }
                check_stage(&w, &s, cpu, k);
                memcpy(s.method.focus, focus[k], sizeof focus[k]);
                // The same from nothing.
                worlds fresh;
                uint64_t voxels = count_of(s.shape);
                uint32_t *memory = malloc(4 * voxels * sizeof *memory);
                if (CHECK(memory != NULL) && open_worlds(&fresh, &s, cpu, NULL)) {
                    memcpy(fresh.host->host->voxels, w.voxels, voxels * sizeof *w.voxels);
                    CHECK_OK(fm_world_update(fresh.host, NULL));
                    host_field(&s, w.host, memory, memory + voxels);
                    host_field(&s, fresh.host, memory + 2 * voxels, memory + 3 * voxels);
                    CHECK(memcmp(memory, memory + 2 * voxels, 2 * voxels * sizeof *memory) == 0);
                    CHECK(fresh.host->stats.chunks == 5 * 6 * 3 && (k == 0 || w.host->stats.chunks < 5 * 6 * 3));
                    close_worlds(&fresh);
                }
                free(memory);
            }
        }
        close_worlds(&w);
    }
}

// Random voxels at three densities: the share that the published form gets wrong.
static void print_errors(fm_context *cpu) {
    for (uint32_t chunk = 0; chunk <= 32; chunk += 16) {
        memset(errors, 0, sizeof errors);
        for (uint32_t solid = 30; solid <= 3000; solid *= 10) {
            const setup s = {
                .shape = {48, 48, 48}, .method = {.algorithm = FM_WORLD_JFA_PUBLISHED, .chunk = chunk}, .solid = solid};
            run_setup(&s, cpu, NULL, 0, solid);
        }
        const struct errors *e = &errors[FM_WORLD_JFA_PUBLISHED];
        printf("published JFA, 48^3, chunk %u: %.2f %% of air voxels wrong, by %.2f on average and %llu at most\n", chunk,
               100.0 * (double)e->wrong / (double)e->air, e->wrong ? (double)e->sum / (double)e->wrong : 0.0,
               (unsigned long long)e->most);
        CHECK(e->wrong > 0);
    }
}

int main(int count, char **arguments) {
    vulkan_options options;
    const bool brief = count > 1 && strcmp(arguments[1], "--short") == 0;
    if (!vulkan_parse(count - brief, arguments + brief, &options)) {
        return 2;
    }
    const fm_context_desc desc = {.backend = FM_BACKEND_CPU, .threads = 2};
    fm_context *cpu = NULL, *gpu = NULL;
    if (!CHECK_OK(fm_context_create(&desc, &cpu))) {
        return check_summary();
    }
    if (count - brief > 1) {
        fm_result result = vulkan_open(&options, NULL, &gpu);
        if (result == FM_ERROR_NO_DEVICE) {
            fm_context_destroy(cpu);
            return vulkan_missing();
        }
        CHECK_OK(result);
    }
    if (brief) {
        test_all(cpu, gpu, 17);
    } else if (count == 1 || gpu) {
        test_all(cpu, gpu, gpu ? 4 : 7);
        if (gpu) {
            // Batches of a few chunks.
            setenv("FATHOM_SCRATCH", "30000", 1);
            test_all(cpu, gpu, 9);
            unsetenv("FATHOM_SCRATCH");
            test_brute_parts(cpu, gpu);
            test_many_updates(cpu, gpu);
        }
        test_far(cpu, gpu);
        test_exchange(cpu, gpu);
        test_selective(cpu, gpu);
    }
    if (count == 1) {
        print_errors(cpu);
    }
    vulkan_close(gpu);
    fm_context_destroy(cpu);
    return check_summary();
}
