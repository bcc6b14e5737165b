# The scenes, the benchmark's statistics, and the program as people meet it.

fathom_test(scenes scenes_test.c)

if(TARGET fathom_cli)
    fathom_test(bench_stats scenes_bench_stats.c)
    target_link_libraries(test_bench_stats PRIVATE fathom_bench)
    fathom_test(image_error scenes_image_error.c)
    target_link_libraries(test_image_error PRIVATE fathom_bench)
    fathom_test(bench_world scenes_bench_world.c)
    target_link_libraries(test_bench_world PRIVATE fathom_bench)
    fathom_test(cli_camera cli_camera.c ${PROJECT_SOURCE_DIR}/cli/camera.c)
    foreach(name usage values files pipes signals json bench render_mesh bench_mesh bench_octree shadows vulkan world tables octree)
        fathom_script_test(cli_${name} cli_${name}.sh $<TARGET_FILE:fathom_cli>)
    endforeach()
endif()
