# Octrees; tests of files look inside.
find_package(ZLIB REQUIRED)
if(NOT BUILD_SHARED_LIBS)
    fathom_test(octree_file octree_file.c)
    target_link_libraries(test_octree_file PRIVATE ZLIB::ZLIB)
endif()
