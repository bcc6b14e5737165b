# Octrees; some tests look inside.
find_package(ZLIB REQUIRED)
fathom_test(octree_code octree_code.c)
if(NOT BUILD_SHARED_LIBS)
    fathom_test(octree_file octree_file.c)
    target_link_libraries(test_octree_file PRIVATE ZLIB::ZLIB)
endif()
