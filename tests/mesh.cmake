# Triangle meshes and their fields.
fathom_test(mesh_io mesh_io.c)
fathom_test(mesh_io_bad mesh_io_bad.c)
fathom_test(mesh_io_gltf mesh_io_gltf.c)
if(FATHOM_VULKAN)
    fathom_test(mesh_voxelize_gpu mesh_voxelize_gpu.c)
endif()
if(NOT BUILD_SHARED_LIBS)
    fathom_test(mesh_io_numbers mesh_io_numbers.c)
endif()
# Meshes on the device; these call what a shared library hides.
if(FATHOM_VULKAN AND NOT BUILD_SHARED_LIBS)
    fathom_test(mesh_gpu mesh_gpu.c)
endif()
fathom_test(mesh_rtsdf mesh_rtsdf.c)
fathom_test(mesh_rtsdf_flood mesh_rtsdf_flood.c)
# Queries of the CPU and what a mesh is.
fathom_test(mesh_query mesh_query.c)
