# Tests of reading and writing files.
fathom_test(io_roundtrip io_roundtrip.c)
fathom_test(io_data io_data.c)
fathom_test(io_bad io_bad.c)
fathom_test(io_fail io_fail.c)
fathom_test(io_layouts io_layouts.c)
find_package(PNG REQUIRED)
fathom_test(io_scenes io_scenes.c)
target_link_libraries(test_io_scenes PRIVATE PNG::PNG)
