// SPDX-License-Identifier: MIT
#include "method.h"
#include "words.h"
#include "world.h"

#include <math.h>
#include <string.h>

void method_options_add(cli_args *args, method_options *o) {
    o->algorithm = cli_add(args, arg_str0(NULL, "algorithm", "NAME", METHOD_ALGORITHMS));
    o->chunk = cli_add(args, arg_str0(NULL, "chunk", "EDGE", "8 to 256, or 0: the whole world; default 0, selective 32"));
    o->border = cli_add(args, arg_str0(NULL, "border", "padding|halo|exchange", "of chunks; default padding"));
    o->convergence = cli_add(args, arg_str0(NULL, "convergence", "device|host", "of fim and jfa-fim; default device"));
    o->format = cli_add(args, arg_str0(NULL, "format", "packed|split-u8|split-u16|squared", "of the field; default packed"));
    o->focus = cli_add(args, arg_str0(NULL, "focus", "CHUNKS", "selective: edge of the focus; default 3"));
    o->focus_at = cli_add(args, arg_str0(NULL, "focus-at", "X,Y,Z", "selective: where it is; default the middle"));
    o->near = cli_add(args, arg_str0(NULL, "near", "NAME", "selective: in the focus; default jfa-fim"));
    o->far = cli_add(args, arg_str0(NULL, "far", "NAME", "selective: elsewhere; default jfa-published"));
    o->max_distance = cli_add(args, arg_str0(NULL, "max-distance", "D", "squared: greater distances become this; default none"));
}

static bool read_focus(const method_options *o, fm_world_method *method) {
    double place[3] = {0};
    if (o->focus_at->count && !cli_triple("--focus-at", o->focus_at->sval[0], place)) {
        return false;
    }
    for (int i = 0; i < 3; i++) {
        if (fabs(place[i]) > 1 << 30 || place[i] != floor(place[i])) {
            cli_usage("--focus-at is \"%s\": whole numbers from -%d to %d are wanted", o->focus_at->sval[0], 1 << 30, 1 << 30);
            return false;
        }
        method->focus[i] = (int32_t)place[i];
    }
    return cli_uint32("--focus", cli_given(o->focus, "3"), 1, &method->focus_chunks);
}

bool method_options_read(const method_options *o, fm_world_desc *desc) {
    int algorithm = 0, border = 0, convergence = 0, format = 0, near = 0, far = 0;
    fm_world_method *method = &desc->method;
    if (!cli_word("--algorithm", cli_given(o->algorithm, "exact"), fm_world_algorithm_words, &algorithm) ||
        !cli_word("--border", cli_given(o->border, "padding"), fm_world_border_words, &border) ||
        !cli_word("--convergence", cli_given(o->convergence, "device"), fm_world_convergence_words, &convergence) ||
        !cli_word("--format", cli_given(o->format, "packed"), fm_field_format_words, &format) ||
        !cli_word("--near", cli_given(o->near, "exact"), fm_world_algorithm_words, &near) ||
        !cli_word("--far", cli_given(o->far, "exact"), fm_world_algorithm_words, &far) ||
        !cli_chunk("--chunk", cli_given(o->chunk, algorithm == FM_WORLD_SELECTIVE ? "32" : "0"), &method->chunk) ||
        !cli_uint32("--max-distance", cli_given(o->max_distance, "0"), 0, &desc->max_distance) || !read_focus(o, method)) {
        return false;
    }
    desc->format = (fm_field_format)format;
    method->algorithm = (fm_world_algorithm)algorithm;
    method->border = (fm_world_border)border;
    method->convergence = (fm_world_convergence)convergence;
    method->near_algorithm = (fm_world_algorithm)near;
    method->far_algorithm = (fm_world_algorithm)far;
    if (method->algorithm == FM_WORLD_EXACT && method->chunk) {
        cli_usage("--chunk is given with --algorithm exact, which has none: leave it out, or name another algorithm");
        return false;
    }
    *method = bench_world_method(method);
    const char *refusal = bench_world_refuses(desc);
    if (refusal) {
        cli_usage("%s", refusal);
    }
    return !refusal;
}

void method_focus(const method_options *o, fm_world_desc *desc) {
    if (o->focus_at->count == 0) {
        const fm_shape shape = desc->shape;
        const int32_t middle[3] = {(int32_t)(shape.x / 2), (int32_t)(shape.y / 2), (int32_t)(shape.z / 2)};
        memcpy(desc->method.focus, middle, sizeof middle);
    }
}
