// SPDX-License-Identifier: MIT
// Pipelines, made when they are first wanted and kept. The shaders were compiled at build time (see CMakeLists.txt here).

#include "gpu/vk.h"

#include "shaders/include/shared.h"

#include <string.h>

typedef struct kernel_code {
    const uint32_t *words;
    size_t bytes;
} kernel_code;

// Written by the build: `static const uint32_t code_NAME[]` for each module and the table of them by fm_kernel.
#include "fm_shaders.inc"

fm_result fm_pipeline_layout_create(fm_gpu *gpu) {
    VkPushConstantRange push = {.stageFlags = VK_SHADER_STAGE_COMPUTE_BIT, .offset = 0, .size = FM_PUSH_BYTES};
    VkPipelineLayoutCreateInfo info = {
        .sType = VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO, .pushConstantRangeCount = 1, .pPushConstantRanges = &push};
    FM_VK(gpu, CreatePipelineLayout(gpu->device, &info, NULL, &gpu->layout));
    return FM_OK;
}

void fm_pipelines_destroy(fm_gpu *gpu) {
    while (gpu->pipelines) {
        fm_pipeline *pipeline = gpu->pipelines;
        gpu->pipelines = pipeline->next;
        gpu->vk.DestroyPipeline(gpu->device, pipeline->pipeline, NULL);
        fm_free(&gpu->allocator, pipeline, sizeof *pipeline);
    }
    gpu->vk.DestroyPipelineLayout(gpu->device, gpu->layout, NULL);
}

static fm_result create(fm_gpu *gpu, fm_pipeline *pipeline) {
    const kernel_code *code = &kernels[pipeline->kernel];
    VkShaderModuleCreateInfo module_info = {
        .sType = VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO, .codeSize = code->bytes, .pCode = code->words};
    VkShaderModule module;
    FM_VK(gpu, CreateShaderModule(gpu->device, &module_info, NULL, &module));
    VkSpecializationMapEntry entries[FM_MAX_SPECIALIZATION];
    for (uint32_t i = 0; i < pipeline->count; i++) {
        entries[i] = (VkSpecializationMapEntry){i, i * (uint32_t)sizeof(uint32_t), sizeof(uint32_t)};
    }
    VkSpecializationInfo constants = {pipeline->count, entries, pipeline->count * sizeof(uint32_t), pipeline->constants};
    VkComputePipelineCreateInfo info = {.sType = VK_STRUCTURE_TYPE_COMPUTE_PIPELINE_CREATE_INFO,
                                        .stage = {.sType = VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO,
                                                  .stage = VK_SHADER_STAGE_COMPUTE_BIT,
                                                  .module = module,
                                                  .pName = "main",
                                                  .pSpecializationInfo = &constants},
                                        .layout = gpu->layout};
    VkResult result = gpu->vk.CreateComputePipelines(gpu->device, VK_NULL_HANDLE, 1, &info, NULL, &pipeline->pipeline);
    gpu->vk.DestroyShaderModule(gpu->device, module, NULL);
    return result < 0 ? fm_vk_fail(gpu, result, "vkCreateComputePipelines") : FM_OK;
}

fm_result fm_pipeline_get(fm_gpu *gpu, fm_kernel kernel, const uint32_t *constants, uint32_t count, VkPipeline *result) {
    for (fm_pipeline *p = gpu->pipelines; p; p = p->next) {
        bool same = p->kernel == kernel && p->count == count;
        if (same && (count == 0 || memcmp(p->constants, constants, count * sizeof *constants) == 0)) {
            *result = p->pipeline;
            return FM_OK;
        }
    }
    fm_pipeline *pipeline = fm_alloc_zero(&gpu->allocator, sizeof *pipeline, "a pipeline");
    if (!pipeline) {
        return FM_ERROR_OUT_OF_HOST_MEMORY;
    }
    pipeline->kernel = kernel;
    pipeline->count = count;
    for (uint32_t i = 0; i < count; i++) {
        pipeline->constants[i] = constants[i];
    }
    fm_result status = create(gpu, pipeline);
    if (status != FM_OK) {
        fm_free(&gpu->allocator, pipeline, sizeof *pipeline);
        return status;
    }
    pipeline->next = gpu->pipelines;
    gpu->pipelines = pipeline;
    *result = pipeline->pipeline;
    return FM_OK;
}
