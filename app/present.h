// SPDX-License-Identifier: MIT
#ifndef FM_APP_PRESENT_H
#define FM_APP_PRESENT_H

// Frames of the window: the picture is copied into the window's image and the panel drawn over it. Two frames are in flight.

#include "swapchain.h"

enum { PRESENT_FRAMES = 2 };

typedef struct present_frame {
    VkCommandPool pool;
    VkCommandBuffer commands;
    VkSemaphore acquired;
    VkFence done;
    // Where the CPU backend's picture is put; grows.
    VkBuffer staging;
    VkDeviceMemory staging_memory;
    void *mapped;
    uint64_t staging_bytes;
} present_frame;

typedef struct present {
    const gpu *gpu;
    GLFWwindow *window;
    swapchain chain;
    present_frame frames[PRESENT_FRAMES];
    uint32_t current;  // of the frames
    uint32_t image;    // acquired
    bool stale;        // the images do not fit the window any longer
    bool vsync;
    // The picture as an image, for copies convert its order of colours and its size.
    VkImage canvas;
    VkDeviceMemory canvas_memory;
    uint32_t width, height;
} present;

// The pixels: RGBA, 4 bytes each, complete when `timeline` (null: at once) reaches `ticket`. No buffer: there is no picture.
typedef struct present_picture {
    VkBuffer buffer;
    uint64_t offset;
    uint32_t width, height;
    VkSemaphore timeline;
    uint64_t ticket;
} present_picture;

typedef enum present_state { PRESENT_READY = 0, PRESENT_HIDDEN, PRESENT_FAILED } present_state;

// `present_close` frees in any case.
bool present_open(present *p, const gpu *g, GLFWwindow *window);
void present_close(present *p);

// Waits until the frame before the last is done: the first call of a frame.
bool present_wait(present *p);
// Takes an image. HIDDEN: there is nothing to draw on now.
present_state present_begin(present *p, bool vsync);
// Memory of this frame for a picture of the host's; NULL when there is none. Its buffer is `staging`.
void *present_staging(present *p, uint32_t width, uint32_t height);
// Draws and shows what was begun. The picture's buffer may be written by work that is submitted later.
bool present_end(present *p, const present_picture *picture);

// Waits until no frame is in flight.
bool present_idle(present *p);

// Waits until the queue has nothing left to do, be it of a frame or of the library.
bool present_quiet(present *p);

// Runs commands at once and waits.
bool present_once(present *p, bool (*record)(void *user, VkCommandBuffer commands), void *user);

#endif
