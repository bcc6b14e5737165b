# It looks below the public calls, which a shared library hides.
if(NOT BUILD_SHARED_LIBS)
    fathom_test(world_parts world_parts.c)
    fathom_test(world_chunks world_chunks.c)
    fathom_test(world_plan world_plan.c)
    if(FATHOM_VULKAN)
        add_test(NAME world_chunks_vulkan COMMAND test_world_chunks --backend vulkan WORKING_DIRECTORY ${PROJECT_SOURCE_DIR})
        # As on a device whose memory the host does not reach.
        add_test(NAME world_chunks_staging COMMAND test_world_chunks --short --backend vulkan
                 WORKING_DIRECTORY ${PROJECT_SOURCE_DIR})
        set_property(TEST world_chunks_staging PROPERTY ENVIRONMENT FATHOM_STAGING=1)
        add_test(NAME world_plan_vulkan COMMAND test_world_plan --backend vulkan WORKING_DIRECTORY ${PROJECT_SOURCE_DIR})
        set_tests_properties(world_chunks_vulkan world_chunks_staging world_plan_vulkan PROPERTIES SKIP_RETURN_CODE 77 TIMEOUT 1200)
    endif()
endif()
fathom_test(world_transfer world_transfer.c cases.c)
if(FATHOM_VULKAN)
    add_test(NAME world_transfer_vulkan COMMAND test_world_transfer --backend vulkan WORKING_DIRECTORY ${PROJECT_SOURCE_DIR})
    # As on a device whose memory the host does not reach.
    add_test(NAME world_transfer_staging COMMAND test_world_transfer --backend vulkan WORKING_DIRECTORY ${PROJECT_SOURCE_DIR})
    set_tests_properties(world_transfer_vulkan world_transfer_staging PROPERTIES SKIP_RETURN_CODE 77 TIMEOUT 600)
    set_property(TEST world_transfer_staging PROPERTY ENVIRONMENT FATHOM_STAGING=1)
endif()

# Random edit scripts against a fresh transform. A software driver takes a second over each kernel of each shape.
fathom_test(world_exact world_exact.c)
add_test(NAME world_exact_long COMMAND test_world_exact --shape 33,17,9 --steps 2000 WORKING_DIRECTORY ${PROJECT_SOURCE_DIR})
fathom_test(world_args world_args.c)
if(FATHOM_VULKAN)
    if(NOT BUILD_SHARED_LIBS)
        target_compile_definitions(test_world_args PRIVATE WORLD_INTERNALS)
        target_include_directories(test_world_args SYSTEM PRIVATE ${VULKAN_INCLUDE_DIR})
    endif()
    add_test(NAME world_exact_vulkan COMMAND test_world_exact --backend vulkan --stride 3 --steps 60
             WORKING_DIRECTORY ${PROJECT_SOURCE_DIR})
    add_test(NAME world_exact_vulkan_long COMMAND test_world_exact --backend vulkan --shape 33,17,9 --steps 400
             WORKING_DIRECTORY ${PROJECT_SOURCE_DIR})
    add_test(NAME world_args_vulkan COMMAND test_world_args --backend vulkan WORKING_DIRECTORY ${PROJECT_SOURCE_DIR})
    # As on a device whose memory the host does not reach.
    add_test(NAME world_exact_staging COMMAND test_world_exact --backend vulkan --stride 6 --steps 40
             WORKING_DIRECTORY ${PROJECT_SOURCE_DIR})
    add_test(NAME world_args_staging COMMAND test_world_args --backend vulkan WORKING_DIRECTORY ${PROJECT_SOURCE_DIR})
    set_property(TEST world_exact_staging world_args_staging PROPERTY ENVIRONMENT FATHOM_STAGING=1)
    set_tests_properties(world_exact_vulkan world_exact_vulkan_long world_exact_staging world_args_vulkan world_args_staging
                         PROPERTIES SKIP_RETURN_CODE 77 TIMEOUT 1800)
endif()
