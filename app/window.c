// SPDX-License-Identifier: MIT
#include "window.h"

#include "log.h"
#include "panel/gui.h"

#include <stdio.h>

static const double first_repeat = 0.5, repeat = 0.08;  // seconds that a button is held

typedef struct move_key {
    int key, axis;
    float sign;
} move_key;

static const move_key move_keys[] = {
    {GLFW_KEY_D, 0, 1},     {GLFW_KEY_A, 0, -1}, {GLFW_KEY_W, 1, 1},  {GLFW_KEY_S, 1, -1},
    {GLFW_KEY_SPACE, 2, 1}, {GLFW_KEY_E, 2, 1},  {GLFW_KEY_Q, 2, -1}, {GLFW_KEY_LEFT_SHIFT, 2, -1},
};
enum { MOVE_KEYS = sizeof move_keys / sizeof move_keys[0] };

static void on_error(int code, const char *text) {
    fprintf(stderr, "fathom: GLFW %d: %s\n", code, text);
}

static void on_command(window_input *input, int key) {
    switch (key) {
    case GLFW_KEY_Z:
        input->undo = true;
        break;
    case GLFW_KEY_Y:
        input->redo = true;
        break;
    case GLFW_KEY_S:
        input->save = true;
        break;
    case GLFW_KEY_O:
        input->load = true;
        break;
    case GLFW_KEY_Q:
        input->quit = true;
        break;
    default:
        break;
    }
}

static void on_key(GLFWwindow *handle, int key, int code, int action, int modifiers) {
    (void)code;
    window *w = glfwGetWindowUserPointer(handle);
    const bool command = modifiers & GLFW_MOD_CONTROL;
    // A text has an undo of its own, and no use for these.
    const bool any = command && (key == GLFW_KEY_S || key == GLFW_KEY_O || key == GLFW_KEY_Q);
    if (action != GLFW_PRESS || (gui_wants_text() && !any)) {
        return;
    }
    if (command) {
        on_command(&w->pending, key);
        return;
    }
    for (int i = 0; i < MOVE_KEYS; i++) {
        w->tapped |= move_keys[i].key == key ? 1u << i : 0;
    }
    if (key >= GLFW_KEY_1 && key <= GLFW_KEY_9) {
        w->pending.color = key - GLFW_KEY_1;
    } else if (key == GLFW_KEY_TAB) {
        window_capture(w, !w->captured);
    } else if (key == GLFW_KEY_ESCAPE) {
        window_capture(w, false);
    } else if (key == GLFW_KEY_F12) {
        w->pending.screenshot = true;
    } else if (key == GLFW_KEY_F1) {
        w->pending.toggle_panel = true;
    }
}

static void on_button(GLFWwindow *handle, int button, int action, int modifiers) {
    (void)modifiers;
    window *w = glfwGetWindowUserPointer(handle);
    const int side = button == GLFW_MOUSE_BUTTON_LEFT ? 0 : button == GLFW_MOUSE_BUTTON_RIGHT ? 1 : -1;
    if (side < 0) {
        return;
    }
    log_event("%s %d", action == GLFW_RELEASE ? "release" : "press", side);
    if (action == GLFW_RELEASE) {
        w->held_since[side] = 0;
    } else if (w->captured) {
        w->held_since[side] = glfwGetTime();
        w->next_repeat[side] = w->held_since[side] + first_repeat;
        *(side ? &w->pending.erases : &w->pending.places) += 1;
    } else {
        w->clicked = true;
    }
}

static void on_cursor(GLFWwindow *handle, double x, double y) {
    window *w = glfwGetWindowUserPointer(handle);
    if (w->captured) {
        w->pending.look[0] += (float)(x - w->cursor[0]);
        w->pending.look[1] += (float)(y - w->cursor[1]);
    }
    w->cursor[0] = x;
    w->cursor[1] = y;
}

static void on_scroll(GLFWwindow *handle, double x, double y) {
    (void)x;
    window *w = glfwGetWindowUserPointer(handle);
    if (w->captured || !gui_wants_mouse()) {
        w->pending.wheel += y > 0 ? 1 : y < 0 ? -1 : 0;
    }
}

static void on_size(GLFWwindow *handle, int width, int height) {
    (void)width;
    (void)height;
    ((window *)glfwGetWindowUserPointer(handle))->resized = true;
}

static void on_focus(GLFWwindow *handle, int focused) {
    if (!focused) {
        window_capture(glfwGetWindowUserPointer(handle), false);
    }
}

bool window_open(window *w, uint32_t width, uint32_t height) {
    *w = (window){.pending.color = -1};
    glfwSetErrorCallback(on_error);
    if (!glfwInit()) {
        fprintf(stderr, "fathom: no window system: start it on a desktop, or give --headless\n");
        return false;
    }
    if (!glfwVulkanSupported()) {
        fprintf(stderr, "fathom: no Vulkan for windows: install a driver, e.g. Debian's mesa-vulkan-drivers\n");
        return false;
    }
    glfwWindowHint(GLFW_CLIENT_API, GLFW_NO_API);
    w->handle = glfwCreateWindow((int)width, (int)height, "Fathom", NULL, NULL);
    if (!w->handle) {
        return false;
    }
    glfwSetWindowUserPointer(w->handle, w);
    glfwSetKeyCallback(w->handle, on_key);
    glfwSetMouseButtonCallback(w->handle, on_button);
    glfwSetCursorPosCallback(w->handle, on_cursor);
    glfwSetScrollCallback(w->handle, on_scroll);
    glfwSetFramebufferSizeCallback(w->handle, on_size);
    glfwSetWindowFocusCallback(w->handle, on_focus);
    return true;
}

void window_close(window *w) {
    if (w->handle) {
        glfwDestroyWindow(w->handle);
    }
    glfwTerminate();
}

void window_capture(window *w, bool captured) {
    if (w->captured == captured) {
        return;
    }
    w->captured = captured;
    log_event("captured %d", captured);
    w->held_since[0] = w->held_since[1] = 0;
    glfwSetInputMode(w->handle, GLFW_CURSOR, captured ? GLFW_CURSOR_DISABLED : GLFW_CURSOR_NORMAL);
    if (captured && glfwRawMouseMotionSupported()) {
        glfwSetInputMode(w->handle, GLFW_RAW_MOUSE_MOTION, GLFW_TRUE);
    }
    glfwGetCursorPos(w->handle, &w->cursor[0], &w->cursor[1]);
    gui_ignore_mouse(captured);
}

static bool is_down(const window *w, int key) {
    return glfwGetKey(w->handle, key) == GLFW_PRESS;
}

static void read_movement(window *w, window_input *input) {
    const bool command = is_down(w, GLFW_KEY_LEFT_CONTROL) || is_down(w, GLFW_KEY_RIGHT_CONTROL);
    for (int i = 0; i < MOVE_KEYS && !command && !gui_wants_text(); i++) {
        const move_key *key = &move_keys[i];
        if (is_down(w, key->key) || (w->tapped >> i & 1)) {
            input->move[key->axis] += key->sign;
        }
    }
    for (int axis = 0; axis < 3; axis++) {
        const float value = input->move[axis];
        input->move[axis] = value > 1 ? 1 : value < -1 ? -1 : value;
    }
    input->fast = is_down(w, GLFW_KEY_LEFT_ALT);
    w->tapped = 0;
}

// At most one a poll, so that a slow frame is not followed by a burst.
static void repeat_edits(window *w, window_input *input) {
    const double now = glfwGetTime();
    for (int side = 0; side < 2; side++) {
        if (w->held_since[side] > 0 && now >= w->next_repeat[side]) {
            w->next_repeat[side] = now + repeat;
            *(side ? &input->erases : &input->places) += 1;
        }
    }
}

window_input window_poll(window *w, double wait_seconds) {
    // The panel has seen by now where the mouse was at the click before.
    if (w->clicked && !gui_wants_mouse()) {
        window_capture(w, true);
    }
    w->clicked = false;
    if (wait_seconds > 0) {
        glfwWaitEventsTimeout(wait_seconds);
    } else {
        glfwPollEvents();
    }
    window_input input = w->pending;
    w->pending = (window_input){.color = -1};
    input.quit = input.quit || glfwWindowShouldClose(w->handle);
    read_movement(w, &input);
    repeat_edits(w, &input);
    return input;
}

bool window_hidden(const window *w) {
    int width, height;
    glfwGetFramebufferSize(w->handle, &width, &height);
    return width == 0 || height == 0 || glfwGetWindowAttrib(w->handle, GLFW_ICONIFIED);
}

double window_seconds(void) {
    return glfwGetTime();
}
