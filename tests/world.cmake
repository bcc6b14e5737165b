# It looks below the public calls, which a shared library hides.
if(NOT BUILD_SHARED_LIBS)
    fathom_test(world_chunks world_chunks.c)
    if(FATHOM_VULKAN)
        add_test(NAME world_chunks_vulkan COMMAND test_world_chunks --backend vulkan WORKING_DIRECTORY ${PROJECT_SOURCE_DIR})
        set_tests_properties(world_chunks_vulkan PROPERTIES SKIP_RETURN_CODE 77 TIMEOUT 1200)
    endif()
endif()
