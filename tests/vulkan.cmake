# On the software driver where there is no other, with the validation layer: a message of it is a failure.
if(NOT FATHOM_VULKAN)
    return()
endif()
fathom_test(vulkan_context vulkan_context.c)
add_test(NAME vulkan_oracle COMMAND test_transform_oracle --backend vulkan --stride 7 WORKING_DIRECTORY ${PROJECT_SOURCE_DIR})
set_tests_properties(vulkan_oracle PROPERTIES SKIP_RETURN_CODE 77 TIMEOUT 1200)
fathom_test(vulkan_fail vulkan_fail.c)
find_package(Threads REQUIRED)
target_link_libraries(test_vulkan_fail PRIVATE Threads::Threads)
# A machine without a driver, and one without the loader: the file that it would be is not one.
add_test(NAME vulkan_no_driver COMMAND test_vulkan_fail --no-driver)
set_tests_properties(vulkan_no_driver PROPERTIES ENVIRONMENT "VK_DRIVER_FILES=/nonexistent;VK_ICD_FILENAMES=/nonexistent")
