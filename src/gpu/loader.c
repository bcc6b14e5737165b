// SPDX-License-Identifier: MIT
// Finds the Vulkan loader at run time and the entry points that Fathom uses.

#include "gpu/vk.h"

#include <dlfcn.h>
#include <pthread.h>

static pthread_once_t once = PTHREAD_ONCE_INIT;
static PFN_vkGetInstanceProcAddr loaded;  // NULL: there is no loader

// It stays open: drivers leave threads and exit handlers behind.
static void load_once(void) {
    void *library = dlopen("libvulkan.so.1", RTLD_NOW | RTLD_LOCAL);
    if (library) {
        // ISO C has no cast from an object pointer to a function's.
        *(void **)&loaded = dlsym(library, "vkGetInstanceProcAddr");
    }
}

fm_result fm_vk_load_global(PFN_vkGetInstanceProcAddr *get_instance_proc_addr) {
    pthread_once(&once, load_once);
    if (!loaded) {
        return fm_fail(FM_ERROR_NO_DEVICE, "no Vulkan loader (libvulkan.so.1) on this machine: install the package libvulkan1");
    }
    *get_instance_proc_addr = loaded;
    return FM_OK;
}

fm_result fm_vk_load_instance(fm_vk_functions *vk, VkInstance instance) {
    const char *missing = NULL;
#define LOAD(name)                                                                                                                 \
    vk->name = (PFN_vk##name)vk->GetInstanceProcAddr(instance, "vk" #name);                                                        \
    missing = vk->name ? missing : "vk" #name;
    FM_VK_INSTANCE_FUNCTIONS(LOAD)
#undef LOAD
    return missing ? fm_fail(FM_ERROR_NO_DEVICE, "the Vulkan instance lacks %s: it must be of Vulkan 1.3", missing) : FM_OK;
}

fm_result fm_vk_load_device(fm_vk_functions *vk, VkDevice device, bool external_memory) {
    const char *missing = NULL;
#define LOAD(name)                                                                                                                 \
    vk->name = (PFN_vk##name)vk->GetDeviceProcAddr(device, "vk" #name);                                                            \
    missing = vk->name ? missing : "vk" #name;
    FM_VK_DEVICE_FUNCTIONS(LOAD)
#undef LOAD
    if (external_memory) {
        vk->GetMemoryFdKHR = (PFN_vkGetMemoryFdKHR)vk->GetDeviceProcAddr(device, "vkGetMemoryFdKHR");
    }
    return missing ? fm_fail(FM_ERROR_NO_DEVICE, "the Vulkan device lacks %s: it must be of Vulkan 1.3", missing) : FM_OK;
}
