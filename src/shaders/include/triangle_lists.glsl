// SPDX-License-Identifier: MIT
// Triangles that are too much for one invocation, listed for a group or many each (FM_VOXELIZE_LARGE and what follows it). Expects
// memory.glsl and mesh_shared.h.

// Entries of those that take many groups grow from the back.
void list_triangle(fm_address lists, uint triangle_count, uint triangle, bool huge) {
    const fm_address count = lists + (huge ? FM_VOXELIZE_HUGE : FM_VOXELIZE_LARGE);
    const fm_address groups = lists + (huge ? FM_VOXELIZE_HUGE_GROUPS : FM_VOXELIZE_LARGE_GROUPS);
    const uint parts = huge ? FM_VOXELIZE_PARTS : 1;
    const uint i = atomicAdd(ref_u32(count).v, 1u);
    if (i < FM_LIST_MAX_GROUPS / parts) {
        atomicAdd(ref_u32(groups).v, parts);
    }
    const uint place = huge ? triangle_count - 1 - i : i;
    ref_u32(lists + FM_VOXELIZE_ENTRIES + uint64_t(place) * 4).v = triangle;
}

uint listed_triangles(fm_address lists, bool huge) {
    return ref_u32(lists + (huge ? FM_VOXELIZE_HUGE : FM_VOXELIZE_LARGE)).v;
}

uint listed_triangle(fm_address lists, uint triangle_count, uint i, bool huge) {
    return ref_u32(lists + FM_VOXELIZE_ENTRIES + uint64_t(huge ? triangle_count - 1 - i : i) * 4).v;
}
