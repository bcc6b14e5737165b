// SPDX-License-Identifier: MIT
#include "gui.h"

#include "../log.h"

extern "C" {
#include "words.h"
}

#include <backends/imgui_impl_glfw.h>
#include <backends/imgui_impl_vulkan.h>
#include <imgui.h>

#include <cmath>
#include <cstdio>
#include <cstring>

namespace {

VkDevice device;
VkDescriptorPool pool;
bool open_;

const ImVec4 warning(1.00f, 0.72f, 0.30f, 1.0f), failure(1.00f, 0.45f, 0.40f, 1.0f), quiet(0.62f, 0.66f, 0.70f, 1.0f);
const ImU32 line_color = IM_COL32(110, 200, 255, 255);

// Where the last item is, for programs that drive the window. A window is measured in its first frame, which is not shown: a click
// there would go to what lies below.
void note(const char *name) {
    if (log_wanted() && !ImGui::IsWindowAppearing()) {
        const ImVec2 a = ImGui::GetItemRectMin(), b = ImGui::GetItemRectMax();
        log_widget(name, a.x, a.y, b.x, b.y);
    }
}

void note_choice(const char *name, const char *word) {
    char full[64];
    snprintf(full, sizeof full, "%s/%s", name, word);
    note(full);
}

void label(const char *text) {
    const float left = ImGui::GetCursorPosX();
    ImGui::AlignTextToFramePadding();
    ImGui::TextUnformatted(text);
    ImGui::SameLine();
    ImGui::SetCursorPosX(left + ImGui::GetFontSize() * 6.0f);
    ImGui::SetNextItemWidth(-1);
}

// Choices beside each other.
bool begin_pair() {
    return ImGui::BeginTable("pair", 2, ImGuiTableFlags_SizingStretchSame | ImGuiTableFlags_NoPadOuterX);
}

// To be ended by ImGui::EndCombo when it returns true: it is open, and the list itself is hidden from programs that drive the
// window.
bool begin_list(const char *name, const char *shown) {
    char id[48];
    snprintf(id, sizeof id, "##%s", name);
    label(name);
    const bool opened = ImGui::BeginCombo(id, shown, ImGuiComboFlags_HeightLarge);
    if (!opened) {
        note(name);
    }
    return opened;
}

// A list of words that ends with NULL. Returns whether another one was chosen.
bool choose(const char *name, const char *const *words, int *value) {
    bool changed = false;
    if (begin_list(name, words[*value])) {
        for (int i = 0; words[i]; i++) {
            if (ImGui::Selectable(words[i], i == *value)) {
                changed = i != *value;
                *value = i;
            }
            note_choice(name, words[i]);
        }
        ImGui::EndCombo();
    }
    return changed;
}

template <typename Enum> bool choose_enum(const char *name, const char *const *words, Enum *value) {
    int place = static_cast<int>(*value);
    const bool changed = choose(name, words, &place);
    *value = static_cast<Enum>(place);
    return changed;
}

// One of a few numbers; another one that an option gave comes last.
bool choose_number(const char *name, const uint32_t *numbers, int count, const char *zero, uint32_t *value) {
    char texts[16][24];
    const char *words[17] = {};
    int place = count;
    for (int i = 0; i <= count; i++) {
        const uint32_t number = i < count ? numbers[i] : *value;
        snprintf(texts[i], sizeof texts[i], "%u", number);
        words[i] = number == 0 && zero ? zero : texts[i];
        place = number == *value && place == count ? i : place;
    }
    words[count] = place == count ? words[count] : nullptr;
    const bool changed = choose(name, words, &place);
    *value = changed ? numbers[place] : *value;
    return changed;
}

void check(const char *name, const char *text, bool *value) {
    ImGui::Checkbox(text, value);
    note(name);
}

bool button(const char *name, const char *text, bool enabled = true) {
    ImGui::BeginDisabled(!enabled);
    const bool pressed = ImGui::Button(text);
    note(name);
    ImGui::EndDisabled();
    return pressed;
}

float graph_top(const readings_graph &graph) {
    float most = 0;
    for (uint32_t i = 0; i < graph.count; i++) {
        most = fmaxf(most, graph.values[i]);
    }
    // 1, 2 or 5 times a power of ten, so that the scale stays put.
    const float power = powf(10, floorf(log10f(fmaxf(most, 1e-3f))));
    const float steps[] = {1, 2, 5, 10};
    for (float step : steps) {
        if (most <= step * power) {
            return step * power;
        }
    }
    return 10 * power;
}

struct graph_look {
    const char *title, *unit;
    float mark;  // a line is drawn at this value; 0: none
    bool stems;  // values that come now and then stand alone; others are joined
};

void draw_values(ImDrawList *list, const readings_graph &graph, const ImVec2 &at, const ImVec2 &end, float top, bool stems) {
    ImVec2 last;
    for (uint32_t i = 0; i < graph.count; i++) {
        const float value = graph.values[(graph.next + READINGS_GRAPH - graph.count + i) % READINGS_GRAPH];
        const float right = static_cast<float>(READINGS_GRAPH - graph.count + i) / (READINGS_GRAPH - 1);
        const ImVec2 point(at.x + (end.x - at.x) * right, end.y - (end.y - at.y) * fminf(value / top, 1));
        if (stems || i > 0) {
            list->AddLine(stems ? ImVec2(point.x, end.y) : last, point, line_color, 1.5f);
        }
        last = point;
    }
}

void number_text(double value, char text[24]) {
    snprintf(text, 24, value >= 100 ? "%.0f" : value >= 10 ? "%.1f" : value >= 1 ? "%.2f" : "%.3g", value);
}

// The newest value and, where there is room, the mean.
void title_text(const graph_look &look, double newest, double mean, float room, char text[96]) {
    char shown[24], usual[24];
    const bool seconds = strcmp(look.unit, "ms") == 0 && fmax(newest, mean) >= 1000;
    const char *unit = seconds ? "s" : look.unit;
    number_text(seconds ? newest / 1000 : newest, shown);
    number_text(seconds ? mean / 1000 : mean, usual);
    snprintf(text, 96, "%s %s, mean %s %s", look.title, shown, usual, unit);
    if (ImGui::CalcTextSize(text).x > room) {
        snprintf(text, 96, "%s %s %s", look.title, shown, unit);
    }
}

// Newest value and mean above the curve, all values' range when the mouse is over it.
void draw_graph(const graph_look &look, const readings_graph &graph) {
    ImGui::TableNextColumn();
    const float line = ImGui::GetFontSize();
    const ImVec2 at = ImGui::GetCursorScreenPos(), size(ImGui::GetContentRegionAvail().x, line * 3.9f);
    ImGui::Dummy(size);
    ImDrawList *list = ImGui::GetWindowDrawList();
    const ImVec2 end(at.x + size.x, at.y + size.y), low(end.x, end.y - 2), high(at.x, at.y + line * 1.3f);
    const float top = graph_top(graph);
    list->AddRectFilled(at, end, IM_COL32(0, 0, 0, 110), 3);
    list->AddLine(high, ImVec2(end.x, high.y), IM_COL32(255, 255, 255, 35));
    if (look.mark > 0 && look.mark < top) {
        const float y = low.y - (low.y - high.y) * look.mark / top;
        list->AddLine(ImVec2(at.x, y), ImVec2(end.x, y), IM_COL32(120, 230, 140, 110));
    }
    draw_values(list, graph, high, low, top, look.stems);
    double sum = 0, most = 0;
    for (uint32_t i = 0; i < graph.count; i++) {
        const double value = static_cast<double>(graph.values[i]);
        sum += value;
        most = fmax(most, value);
    }
    const double newest = static_cast<double>(graph.values[(graph.next + READINGS_GRAPH - 1) % READINGS_GRAPH]);
    char text[96];
    if (graph.count) {
        title_text(look, newest, sum / graph.count, size.x - 8, text);
    } else {
        snprintf(text, sizeof text, "%s -", look.title);
    }
    list->AddText(ImVec2(at.x + 4, at.y + 1), ImGui::GetColorU32(ImGuiCol_Text), text);
    char scale[32];
    snprintf(scale, sizeof scale, top >= 1 ? "%.0f %s" : "%g %s", static_cast<double>(top), look.unit);
    list->AddText(ImVec2(end.x - ImGui::CalcTextSize(scale).x - 3, high.y), IM_COL32(255, 255, 255, 110), scale);
    if (ImGui::IsItemHovered() && graph.count) {
        ImGui::SetTooltip("%s: newest %.4g, mean %.4g, most %.4g %s of the last %u", look.title, newest, sum / graph.count, most,
                          look.unit, graph.count);
    }
}

const char *bytes_text(uint64_t bytes, char text[32]) {
    static const char *const units[] = {"B", "KiB", "MiB", "GiB", "TiB"};
    double value = static_cast<double>(bytes);
    int unit = 0;
    for (; value >= 1024 && unit < 4; unit++) {
        value /= 1024;
    }
    snprintf(text, 32, unit && value < 100 ? "%.1f %s" : "%.0f %s", value, units[unit]);
    return text;
}

void show_purpose(const char *purpose, const char *where, uint64_t bytes) {
    char text[32];
    ImGui::TableNextColumn();
    const float right = ImGui::GetCursorPosX() + ImGui::GetContentRegionAvail().x;
    ImGui::Text("%s%s", purpose, where);
    ImGui::SameLine();
    ImGui::SetCursorPosX(right - ImGui::CalcTextSize(bytes_text(bytes, text)).x);
    ImGui::TextColored(quiet, "%s", text);
}

void show_memory(const readings *r) {
    if (!begin_pair()) {
        return;
    }
    for (uint32_t i = 0; i < r->memory_count; i++) {
        const fm_memory &memory = r->memory[i];
        if (memory.bytes) {
            show_purpose(memory.purpose, memory.device ? "" : " (host)", memory.bytes);
        }
    }
    char name[32];
    snprintf(name, sizeof name, "undo, %u steps", r->undo + r->redo);
    show_purpose(name, "", r->history_bytes);
    ImGui::EndTable();
}

void show_colors(paint_settings *s) {
    label("color");
    const float edge = ImGui::GetFrameHeight();
    for (int i = 0; i < PAINT_COLORS; i++) {
        const uint8_t c = paint_colors[i];
        const ImVec4 color((c >> 5) / 7.0f, (c >> 2 & 7) / 7.0f, (c & 3) / 3.0f, 1);
        char id[32];
        snprintf(id, sizeof id, "%d %s", i + 1, paint_color_words[i]);
        if (ImGui::ColorButton(id, color, ImGuiColorEditFlags_NoTooltip, ImVec2(edge, edge))) {
            s->color = static_cast<uint32_t>(i);
        }
        note_choice("color", paint_color_words[i]);
        if (ImGui::IsItemHovered()) {
            ImGui::SetTooltip("%s", id);
        }
        if (s->color == static_cast<uint32_t>(i)) {
            const ImVec2 a = ImGui::GetItemRectMin(), b = ImGui::GetItemRectMax();
            ImGui::GetWindowDrawList()->AddRect(ImVec2(a.x - 1, a.y - 1), ImVec2(b.x + 1, b.y + 1), IM_COL32_WHITE, 2, 0, 2);
        }
        if (i + 1 < PAINT_COLORS) {
            ImGui::SameLine(0, 3);
        }
    }
}

void show_brush(paint_settings *s, const readings *r, gui_request *request) {
    show_colors(s);
    if (begin_pair()) {
        ImGui::TableNextColumn();
        label("radius");
        int radius = static_cast<int>(s->radius);
        const ImGuiSliderFlags flags = ImGuiSliderFlags_AlwaysClamp | ImGuiSliderFlags_Logarithmic;
        ImGui::SliderInt("##radius", &radius, 0, PAINT_MOST_RADIUS, "%d", flags);
        note("radius");
        s->radius = static_cast<uint32_t>(radius);
        ImGui::TableNextColumn();
        label("speed");
        ImGui::SliderFloat("##speed", &s->speed, 1, 1000, "%.0f", flags);
        note("speed");
        ImGui::EndTable();
    }
    request->undo = button("undo", "Undo", r->undo > 0);
    ImGui::SameLine();
    request->redo = button("redo", "Redo", r->redo > 0);
    ImGui::SameLine();
    request->screenshot = button("screenshot", "Screenshot");
    ImGui::SameLine();
    request->quit = button("quit", "Quit");
    label("file");
    ImGui::SetNextItemWidth(-ImGui::GetFontSize() * 7.2f);
    ImGui::InputText("##file", s->path, sizeof s->path, ImGuiInputTextFlags_AutoSelectAll);
    note("file");
    ImGui::SameLine();
    request->save = button("save", "Save");
    ImGui::SameLine();
    request->load = button("load", "Load");
}

// Where the world's edges differ, as those of a file may, the list shows none of its numbers until one is chosen.
bool choose_size(paint_settings *s) {
    static const uint32_t sizes[] = {32, 64, 96, 128, 192, 256, 384, 512, 768, 1024};
    char own[64];
    if (s->shape.x == s->shape.y && s->shape.y == s->shape.z) {
        snprintf(own, sizeof own, "%u", s->shape.x);
    } else {
        snprintf(own, sizeof own, "%u x %u x %u", s->shape.x, s->shape.y, s->shape.z);
    }
    bool changed = false;
    if (begin_list("size", own)) {
        for (uint32_t size : sizes) {
            char text[16];
            snprintf(text, sizeof text, "%u", size);
            if (ImGui::Selectable(text, strcmp(text, own) == 0)) {
                s->shape = {size, size, size};
                changed = true;
            }
            note_choice("size", text);
        }
        ImGui::EndCombo();
    }
    return changed;
}

bool choose_scene(paint_settings *s, const char *const *scenes) {
    bool changed = false;
    if (begin_list("scene", paint_world_name(s))) {
        for (uint32_t i = 0; scenes[i]; i++) {
            const bool shown = !s->loaded[0] && i == s->scene;
            if (ImGui::Selectable(scenes[i], shown)) {
                paint_choose_scene(s, i);
                changed = changed || !shown;
            }
            note_choice("scene", scenes[i]);
        }
        ImGui::EndCombo();
    }
    return changed;
}

void show_world(paint_settings *s, gui_request *request) {
    const char *scenes[32] = {};
    const uint32_t count = paint_scene_count();
    for (uint32_t i = 0; i <= count && i < 31; i++) {
        scenes[i] = paint_scene_name(i);
    }
    // What a file has may need the whole width.
    const bool wide = s->loaded[0] || s->shape.x != s->shape.y || s->shape.y != s->shape.z;
    const bool pair = !wide && begin_pair();
    if (pair) {
        ImGui::TableNextColumn();
    }
    request->rebuild |= choose_scene(s, scenes);
    if (pair) {
        ImGui::TableNextColumn();
    }
    ImGui::BeginDisabled(s->loaded[0]);
    request->rebuild |= choose_size(s);
    ImGui::EndDisabled();
    if (pair) {
        ImGui::EndTable();
    }
}

void show_method(paint_settings *s) {
    static const uint32_t chunks[] = {0, 8, 16, 32, 64, 128, 256}, focuses[] = {1, 3, 5, 7, 9};
    fm_world_method *m = &s->method;
    const bool exact = m->algorithm == FM_WORLD_EXACT, selective = m->algorithm == FM_WORLD_SELECTIVE;
    const bool iterates = m->algorithm == FM_WORLD_FIM || m->algorithm == FM_WORLD_JFA_FIM || selective;
    choose_enum("algorithm", fm_world_algorithm_words, &m->algorithm);
    if (!begin_pair()) {
        return;
    }
    ImGui::TableNextColumn();
    choose_enum("format", fm_field_format_words, &s->format);
    ImGui::TableNextColumn();
    ImGui::BeginDisabled(exact);
    choose_number("chunk", chunks, 7, "world", &m->chunk);
    ImGui::EndDisabled();
    ImGui::TableNextColumn();
    ImGui::BeginDisabled(exact || m->chunk == 0);
    choose_enum("border", fm_world_border_words, &m->border);
    ImGui::EndDisabled();
    ImGui::TableNextColumn();
    ImGui::BeginDisabled(!iterates);
    choose_enum("convergence", fm_world_convergence_words, &m->convergence);
    ImGui::EndDisabled();
    ImGui::TableNextColumn();
    ImGui::BeginDisabled(!selective);
    choose_number("focus", focuses, 5, nullptr, &m->focus_chunks);
    ImGui::EndDisabled();
    ImGui::EndTable();
}

void show_slice(paint_settings *s) {
    static const char *const axes[] = {"x", "y", "z", nullptr};
    const uint32_t edges[] = {s->shape.x, s->shape.y, s->shape.z};
    ImGui::TableNextColumn();
    choose_enum("across", axes, &s->slice_axis);
    ImGui::TableNextColumn();
    label("slice");
    ImGui::SliderInt("##slice", &s->slice_index, 0, static_cast<int>(edges[s->slice_axis]) - 1, "%d", ImGuiSliderFlags_AlwaysClamp);
    note("slice");
}

void show_picture(paint_settings *s) {
    static const uint32_t scales[] = {1, 2, 4};
    if (begin_pair()) {
        ImGui::TableNextColumn();
        choose_enum("march", fm_march_words, &s->march);
        ImGui::TableNextColumn();
        choose_enum("view", fm_view_words, &s->view);
        if (s->view == FM_VIEW_SLICE) {
            show_slice(s);
        }
        ImGui::TableNextColumn();
        choose_enum("shadow", fm_shadow_words, &s->shadow);
        ImGui::TableNextColumn();
        choose_number("pixels", scales, 3, nullptr, &s->scale);
        ImGui::TableNextColumn();
        check("occlusion", "ambient occlusion", &s->ambient_occlusion);
        ImGui::TableNextColumn();
        check("preview", "brush preview", &s->preview);
        ImGui::TableNextColumn();
        check("vsync", "wait for the screen", &s->vsync);
        ImGui::TableNextColumn();
        check("crosshair", "cross-hair", &s->crosshair);
        ImGui::EndTable();
    }
}

void show_mode(paint_settings *s, const readings *r) {
    static const char *const modes[] = {"voxels", "meshes", nullptr};
    int mode = s->meshes;
    ImGui::BeginDisabled(r->automatic);
    choose("mode", modes, &mode);
    ImGui::EndDisabled();
    s->meshes = mode != 0;
}

// What is exact is told quietly.
void show_truth(const char *truth, bool exact) {
    ImGui::PushTextWrapPos(0);
    ImGui::TextColored(exact ? quiet : warning, "%s", truth);
    ImGui::PopTextWrapPos();
}

void show_meshes(paint_settings *s, const readings *r, gui_request *request) {
    ImGui::Text("%llu triangles", static_cast<unsigned long long>(r->triangles));
    ImGui::SameLine();
    check("hold", "hold them still", &s->mesh.hold);
    label("speed");
    ImGui::SliderFloat("##speed", &s->speed, 1, 1000, "%.0f", ImGuiSliderFlags_AlwaysClamp | ImGuiSliderFlags_Logarithmic);
    note("speed");
    request->screenshot = button("screenshot", "Screenshot");
    ImGui::SameLine();
    request->quit = button("quit", "Quit");
}

void show_exact_field(paint_mesh_settings *m, const readings *r) {
    static const uint32_t bands[] = {1, 2, 3, 5, 8, 0};
    ImGui::TableNextColumn();
    choose_number("band", bands, 6, "all", &m->band);
    ImGui::TableNextColumn();
    choose_enum("sign", paint_sign_words, &m->sign);
    ImGui::EndTable();
    if (r->sign.sign_why && paint_wants_field(m)) {
        ImGui::PushTextWrapPos(0);
        ImGui::TextColored(quiet, "sign by %s: %s", paint_sign_words[r->sign.sign], r->sign.sign_why);
        ImGui::PopTextWrapPos();
    }
}

void show_mesh_field(paint_mesh_settings *m, const readings *r) {
    static const uint32_t edges[] = {32, 48, 64, 96, 128, 192, 256, 384, 512}, rays[] = {0, 1, 5, 10, 15};
    if (!begin_pair()) {
        return;
    }
    ImGui::TableNextColumn();
    choose_enum("field", paint_mesh_field_words, &m->field);
    ImGui::TableNextColumn();
    choose_number("edge", edges, 9, nullptr, &m->edge);
    if (m->field == PAINT_FIELD_EXACT) {
        show_exact_field(m, r);
    } else {
        ImGui::TableNextColumn();
        ImGui::BeginDisabled(m->field != PAINT_FIELD_RTSDF);
        choose_number("rays", rays, 5, nullptr, &m->rays);
        ImGui::EndDisabled();
        ImGui::TableNextColumn();
        choose_enum("flood", paint_flood_words, &m->flood);
        ImGui::EndTable();
    }
    bool exact;
    const char *truth = paint_field_truth(m, &exact);
    show_truth(truth, exact);
}

void show_mesh_picture(paint_settings *s) {
    static const uint32_t scales[] = {1, 2, 4}, samples[] = {1, 4, 16, 64, 256, 1024}, maps[] = {128, 256, 512, 1024, 2048, 4096};
    paint_mesh_settings *m = &s->mesh;
    if (!begin_pair()) {
        return;
    }
    ImGui::TableNextColumn();
    choose_enum("shadows", paint_mesh_shadow_words, &m->shadows);
    ImGui::TableNextColumn();
    ImGui::BeginDisabled(m->shadows != FM_SHADOWS_FIELD && m->shadows != FM_SHADOWS_DISTRIBUTED);
    choose_number("samples", samples, 6, nullptr, &m->samples);
    ImGui::EndDisabled();
    ImGui::TableNextColumn();
    ImGui::BeginDisabled(m->shadows != FM_SHADOWS_MAP);
    choose_number("map", maps, 6, nullptr, &m->map);
    ImGui::EndDisabled();
    ImGui::TableNextColumn();
    label("light");
    ImGui::SliderFloat("##light", &m->light, 0, PAINT_MOST_LIGHT, "%.1f degrees", ImGuiSliderFlags_AlwaysClamp);
    note("light");
    ImGui::TableNextColumn();
    choose_enum("surface", paint_mesh_surface_words, &m->surface);
    ImGui::TableNextColumn();
    choose_enum("view", paint_mesh_view_words, &m->view);
    ImGui::TableNextColumn();
    choose_number("pixels", scales, 3, nullptr, &s->scale);
    ImGui::TableNextColumn();
    check("blend", "blend pictures", &m->blend);
    ImGui::TableNextColumn();
    check("vsync", "wait for the screen", &s->vsync);
    ImGui::EndTable();
    bool exact;
    const char *truth = paint_shadow_truth(m, &exact);
    show_truth(truth, exact);
}

void show_mesh_graphs(const readings *r) {
    if (begin_pair()) {
        draw_graph({"frame", "ms", 1000.0f / 60, false}, r->frame_ms);
        draw_graph({"picture", "ms", 0, false}, r->march_ms);
        draw_graph({"field", "ms", 0, true}, r->field_ms);
        ImGui::EndTable();
    }
}

void show_device(const readings *r) {
    if (r->backend == FM_BACKEND_CPU) {
        ImGui::TextColored(warning, "Native CPU backend: no GPU computes");
    } else if (r->device.kind == FM_DEVICE_SOFTWARE) {
        ImGui::TextColored(warning, "No GPU: software Vulkan, timed by the clock");
    }
    ImGui::PushTextWrapPos(0);
    ImGui::TextColored(quiet, "%s", r->device.name);
    ImGui::PopTextWrapPos();
}

void show_numbers(const readings *r, bool meshes) {
    const double frames = r->frame_mean_ms > 0 ? 1e3 / r->frame_mean_ms : 0;
    if (meshes) {
        ImGui::Text("%.1f frames/s   %u x %u pixels", frames, r->width, r->height);
        return;
    }
    ImGui::Text("%.1f frames/s   %.1f edits/s   %u x %u pixels", frames, r->edits_per_second, r->width, r->height);
    if (!r->may_be_wrong) {
        ImGui::TextColored(quiet, "the picture is exact: no ray misses a voxel");
    } else if (r->wrong_share < 0) {
        ImGui::TextColored(warning, "approximate field; wrong pixels not counted yet");
    } else {
        ImGui::TextColored(r->wrong_share > 0 ? warning : quiet, "approximate field: %.3f %% of the pixels are wrong",
                           100 * r->wrong_share);
    }
}

void show_graphs(const readings *r) {
    if (begin_pair()) {
        draw_graph({"frame", "ms", 1000.0f / 60, false}, r->frame_ms);
        draw_graph({"march", "ms", 0, false}, r->march_ms);
        draw_graph({"field", "ms", 0, true}, r->field_ms);
        draw_graph({"edits", "/s", 0, false}, r->edits);
        if (r->may_be_wrong) {
            draw_graph({"wrong", "%", 0, false}, r->wrong);
        }
        ImGui::EndTable();
    }
}

void show_voxel_parts(paint_settings *s, const readings *r, gui_request *request) {
    const ImGuiTreeNodeFlags open = ImGuiTreeNodeFlags_DefaultOpen;
    if (ImGui::CollapsingHeader("Brush and file", open)) {
        show_brush(s, r, request);
    }
    if (ImGui::CollapsingHeader("World", open)) {
        show_world(s, request);
        show_method(s);
    }
    if (ImGui::CollapsingHeader("Picture", open)) {
        show_picture(s);
    }
    if (ImGui::CollapsingHeader("Times", open)) {
        show_graphs(r);
    }
}

void show_mesh_parts(paint_settings *s, const readings *r, gui_request *request) {
    const ImGuiTreeNodeFlags open = ImGuiTreeNodeFlags_DefaultOpen;
    if (ImGui::CollapsingHeader("Meshes", open)) {
        show_meshes(s, r, request);
    }
    if (ImGui::CollapsingHeader("Field", open)) {
        show_mesh_field(&s->mesh, r);
    }
    if (ImGui::CollapsingHeader("Light and picture", open)) {
        show_mesh_picture(s);
    }
    if (ImGui::CollapsingHeader("Times of meshes", open)) {
        show_mesh_graphs(r);
    }
}

// Returns where its right side is.
float show_panel(paint_settings *s, const readings *r, gui_request *request) {
    const float width = ImGui::GetFontSize() * 26;
    const ImVec2 screen = ImGui::GetIO().DisplaySize;
    ImGui::SetNextWindowPos(ImVec2(8, 8), ImGuiCond_Always);
    ImGui::SetNextWindowSizeConstraints(ImVec2(width, 0), ImVec2(width, fmaxf(screen.y - 16, 64)));
    ImGui::Begin("Fathom", nullptr, ImGuiWindowFlags_NoMove | ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoSavedSettings);
    show_device(r);
    // What is chosen in this frame shows from the next on.
    const bool meshes = s->meshes;
    show_numbers(r, meshes);
    show_mode(s, r);
    meshes ? show_mesh_parts(s, r, request) : show_voxel_parts(s, r, request);
    const bool memory = ImGui::CollapsingHeader("Memory", ImGuiTreeNodeFlags_DefaultOpen);
    note("memory");
    if (memory) {
        show_memory(r);
    }
    const float right = ImGui::GetWindowPos().x + ImGui::GetWindowWidth();
    ImGui::End();
    return right;
}

// In the window's pixels, so that it is sharp over a coarse picture, and screenshots are without.
void show_crosshair() {
    const ImVec2 screen = ImGui::GetIO().DisplaySize;
    const ImVec2 c(floorf(screen.x / 2), floorf(screen.y / 2));
    ImDrawList *list = ImGui::GetBackgroundDrawList();
    const float far = 9, near = 3;
    for (int i = 0; i < 2; i++) {
        const ImU32 color = i ? IM_COL32(255, 255, 255, 230) : IM_COL32(0, 0, 0, 150);
        const float half = i ? 0.5f : 1.5f, more = i ? 0 : 1;
        list->AddRectFilled(ImVec2(c.x - far - more, c.y - half), ImVec2(c.x - near + more, c.y + half), color);
        list->AddRectFilled(ImVec2(c.x + near - more, c.y - half), ImVec2(c.x + far + more, c.y + half), color);
        list->AddRectFilled(ImVec2(c.x - half, c.y - far - more), ImVec2(c.x + half, c.y - near + more), color);
        list->AddRectFilled(ImVec2(c.x - half, c.y + near - more), ImVec2(c.x + half, c.y + far + more), color);
    }
}

// A line of text over the picture, in the middle of what is right of `left`; `row` counts from below.
void show_line(const char *text, const ImVec4 &color, float left, int row) {
    const ImVec2 screen = ImGui::GetIO().DisplaySize;
    const float width = fmaxf(screen.x - left - 48, 64);
    const ImVec2 size = ImGui::CalcTextSize(text, nullptr, false, width);
    const ImVec2 at(left + (screen.x - left - size.x) / 2,
                    screen.y - size.y - 12 - static_cast<float>(row) * ImGui::GetFontSize() * 2);
    ImDrawList *list = ImGui::GetForegroundDrawList();
    list->AddRectFilled(ImVec2(at.x - 10, at.y - 4), ImVec2(at.x + size.x + 10, at.y + size.y + 4), IM_COL32(0, 0, 0, 150), 5);
    list->AddText(ImGui::GetFont(), ImGui::GetFontSize(), at, ImGui::GetColorU32(color), text, nullptr, width);
}

const ImVec4 white(1, 1, 1, 0.9f);

void show_message(const readings *r, float left) {
    const message &m = r->news;
    if (m.text[0] && r->message_seconds < (m.failed ? 20 : 6)) {
        show_line(m.text, m.failed ? failure : white, left, 2);
    }
}

void show_hints(const readings *r, bool meshes, float left) {
    if (r->automatic) {
        show_line("benchmark: the camera and the edits follow a fixed script", white, left, 0);
    } else if (r->captured && meshes) {
        show_line("W A S D, Space, Shift: fly   Tab: free the cursor   F1: panel   F12: screenshot", white, left, 0);
    } else if (r->captured) {
        show_line("W A S D, Space, Shift: fly   left: place   right: delete   wheel: radius   1-9: color\n"
                  "Ctrl+Z, Ctrl+Y: undo, redo   Tab: free the cursor   F1: panel   F12: screenshot",
                  white, left, 0);
    } else {
        show_line(meshes ? "click into the picture to fly   F1: panel   F12: screenshot"
                         : "click into the picture to fly and paint   F1: panel   F12: screenshot",
                  white, left, 0);
    }
}

void set_style() {
    ImGui::StyleColorsDark();
    ImGuiStyle &style = ImGui::GetStyle();
    style.WindowRounding = 6;
    style.FrameRounding = 3;
    style.GrabRounding = 3;
    style.ItemSpacing = ImVec2(6, 4);
    style.FramePadding = ImVec2(6, 2);
    style.Colors[ImGuiCol_WindowBg] = ImVec4(0.07f, 0.08f, 0.10f, 0.90f);
    style.Colors[ImGuiCol_Header] = ImVec4(0.18f, 0.30f, 0.40f, 0.80f);
    style.Colors[ImGuiCol_PlotHistogram] = ImVec4(0.20f, 0.42f, 0.56f, 1.0f);
}

void load_font(float scale) {
    // From Debian's fonts-dejavu-core where it is installed; ImGui's own is legible too, but smaller.
    static const char *const paths[] = {"/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf"};
    ImGuiIO &io = ImGui::GetIO();
    for (const char *path : paths) {
        FILE *file = fopen(path, "rb");
        if (file) {
            fclose(file);
            io.Fonts->AddFontFromFileTTF(path, roundf(14 * scale));
            return;
        }
    }
    ImFontConfig config;
    config.SizePixels = roundf(13 * scale);
    io.Fonts->AddFontDefault(&config);
}

}  // namespace

bool gui_open(const gui_desc *desc) {
    const VkDescriptorPoolSize size = {VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER, 1};
    VkDescriptorPoolCreateInfo info = {};
    info.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO;
    info.flags = VK_DESCRIPTOR_POOL_CREATE_FREE_DESCRIPTOR_SET_BIT;
    info.maxSets = 1;
    info.poolSizeCount = 1;
    info.pPoolSizes = &size;
    device = desc->device;
    if (vkCreateDescriptorPool(device, &info, nullptr, &pool) != VK_SUCCESS) {
        return false;
    }
    IMGUI_CHECKVERSION();
    ImGui::CreateContext();
    ImGui::GetIO().IniFilename = nullptr;
    set_style();
    float scale = 1, unused;
    glfwGetWindowContentScale(desc->window, &scale, &unused);
    ImGui::GetStyle().ScaleAllSizes(scale);
    load_font(scale);
    ImGui_ImplVulkan_InitInfo vulkan = {};
    vulkan.Instance = desc->instance;
    vulkan.PhysicalDevice = desc->physical;
    vulkan.Device = desc->device;
    vulkan.QueueFamily = desc->family;
    vulkan.Queue = desc->queue;
    vulkan.DescriptorPool = pool;
    vulkan.MinImageCount = desc->images;
    vulkan.ImageCount = desc->images;
    open_ = ImGui_ImplGlfw_InitForVulkan(desc->window, true) && ImGui_ImplVulkan_Init(&vulkan, desc->pass);
    return open_;
}

bool gui_upload_font(void *unused, VkCommandBuffer commands) {
    (void)unused;
    return ImGui_ImplVulkan_CreateFontsTexture(commands);
}

void gui_font_uploaded(void) {
    ImGui_ImplVulkan_DestroyFontUploadObjects();
}

void gui_close(void) {
    if (open_) {
        ImGui_ImplVulkan_Shutdown();
        ImGui_ImplGlfw_Shutdown();
        ImGui::DestroyContext();
    }
    if (pool) {
        vkDestroyDescriptorPool(device, pool, nullptr);
    }
    open_ = false;
    pool = VK_NULL_HANDLE;
}

gui_request gui_frame(bool visible, paint_settings *settings, const readings *shown) {
    gui_request request = {};
    ImGui_ImplVulkan_NewFrame();
    ImGui_ImplGlfw_NewFrame();
    ImGui::NewFrame();
    if (settings->crosshair && !settings->meshes && !shown->automatic) {
        show_crosshair();
    }
    const float right = visible ? show_panel(settings, shown, &request) : 0;
    if (visible) {
        show_hints(shown, settings->meshes, right);
    }
    show_message(shown, right);
    ImGui::Render();
    log_frame_end();
    return request;
}

void gui_draw(VkCommandBuffer commands) {
    ImGui_ImplVulkan_RenderDrawData(ImGui::GetDrawData(), commands);
}

bool gui_wants_mouse(void) {
    return open_ && ImGui::GetIO().WantCaptureMouse;
}

bool gui_wants_text(void) {
    return open_ && ImGui::GetIO().WantTextInput;
}

void gui_ignore_mouse(bool ignored) {
    if (open_) {
        ImGuiIO &io = ImGui::GetIO();
        io.ConfigFlags = ignored ? io.ConfigFlags | ImGuiConfigFlags_NoMouse : io.ConfigFlags & ~ImGuiConfigFlags_NoMouse;
    }
}
