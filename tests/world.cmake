# It looks below the public calls, which a shared library hides.
if(NOT BUILD_SHARED_LIBS)
    fathom_test(world_chunks world_chunks.c)
endif()
