// SPDX-License-Identifier: MIT
#ifndef FM_APP_GUI_H
#define FM_APP_GUI_H

// The panel over the picture, by Dear ImGui: the one part of the program in C++.

#include "../readings.h"
#include "../settings.h"

#define GLFW_INCLUDE_VULKAN
#include <GLFW/glfw3.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct gui_desc {
    GLFWwindow *window;  // its callbacks must be set already
    VkInstance instance;
    VkPhysicalDevice physical;
    VkDevice device;
    VkQueue queue;
    uint32_t family;
    VkRenderPass pass;
    uint32_t images;  // frames that may be in flight, at least 2
} gui_desc;

// What was asked for by buttons.
typedef struct gui_request {
    bool rebuild, save, load, undo, redo, screenshot, quit;
} gui_request;

bool gui_open(const gui_desc *desc);
// Records the copy of the font to the device. For present_once.
bool gui_upload_font(void *unused, VkCommandBuffer commands);
void gui_font_uploaded(void);
void gui_close(void);

// Builds the panel of this frame, or with `visible` false only messages; changes `settings` by what was chosen.
gui_request gui_frame(bool visible, paint_settings *settings, const readings *shown);
// Records it, in the render pass.
void gui_draw(VkCommandBuffer commands);

// All are false before gui_open.
bool gui_wants_mouse(void);
bool gui_wants_text(void);
void gui_ignore_mouse(bool ignored);

#ifdef __cplusplus
}
#endif

#endif
