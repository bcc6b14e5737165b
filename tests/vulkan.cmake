# On the software driver where there is no other, with the validation layer: a message of it is a failure.
if(NOT FATHOM_VULKAN)
    return()
endif()
fathom_test(vulkan_context vulkan_context.c)
add_test(NAME vulkan_oracle COMMAND test_transform_oracle --backend vulkan --stride 7 WORKING_DIRECTORY ${PROJECT_SOURCE_DIR})
set_tests_properties(vulkan_oracle PROPERTIES SKIP_RETURN_CODE 77 TIMEOUT 1200)
