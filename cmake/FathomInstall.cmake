# `cmake --install`: headers, library, program, the CMake package and the pkg-config file.
#
# A static library leaves its own dependencies to whoever links it. Both files list them from the library's link line, so that
# they cannot fall behind it.

include(CMakePackageConfigHelpers)

set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/fathom)

install(TARGETS fathom EXPORT fathom-targets
    ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR}
    LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR}
    RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
install(DIRECTORY include/ DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} FILES_MATCHING PATTERN "*.h")
install(EXPORT fathom-targets NAMESPACE fathom:: DESTINATION ${package_dir})
if(TARGET fathom_cli)
    install(TARGETS fathom_cli RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
endif()
if(TARGET fathom_paint)
    install(TARGETS fathom_paint RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
endif()
install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR})

set(FATHOM_PC_REQUIRES "")
set(FATHOM_PC_LIBS "")
set(FATHOM_FIND_DEPENDENCIES "")
get_target_property(link_libraries fathom LINK_LIBRARIES)
foreach(library IN LISTS link_libraries)
    # What only the build tree uses, such as fathom_flags, does not concern a consumer; "::@" is CMake's mark for a change of folder.
    if(library MATCHES "BUILD_INTERFACE|^::@")
        continue()
    elseif(library STREQUAL "Threads::Threads")
        list(APPEND FATHOM_PC_LIBS -pthread)
        list(APPEND FATHOM_FIND_DEPENDENCIES "set(THREADS_PREFER_PTHREAD_FLAG ON)" "find_dependency(Threads)")
    elseif(library STREQUAL "ZLIB::ZLIB")
        list(APPEND FATHOM_PC_REQUIRES zlib)
        list(APPEND FATHOM_FIND_DEPENDENCIES "find_dependency(ZLIB)")
    elseif(library STREQUAL "PNG::PNG")
        list(APPEND FATHOM_PC_REQUIRES libpng)
        list(APPEND FATHOM_FIND_DEPENDENCIES "find_dependency(PNG)")
    elseif(library MATCHES "^/.*/lib([^/]+)\\.(so|a)$")
        list(APPEND FATHOM_PC_LIBS -l${CMAKE_MATCH_1})
    elseif(library MATCHES "^[A-Za-z0-9_+.-]+$" AND NOT TARGET ${library})
        list(APPEND FATHOM_PC_LIBS -l${library})
    else()
        message(FATAL_ERROR "FathomInstall.cmake: how does a consumer of the static library get \"${library}\"? Say so here.")
    endif()
endforeach()
list(REMOVE_DUPLICATES FATHOM_PC_LIBS)
list(REMOVE_DUPLICATES FATHOM_PC_REQUIRES)
list(REMOVE_DUPLICATES FATHOM_FIND_DEPENDENCIES)
list(JOIN FATHOM_PC_LIBS " " FATHOM_PC_LIBS)
list(JOIN FATHOM_PC_REQUIRES " " FATHOM_PC_REQUIRES)
list(JOIN FATHOM_FIND_DEPENDENCIES "\n" FATHOM_FIND_DEPENDENCIES)
if(BUILD_SHARED_LIBS)
    set(FATHOM_FIND_DEPENDENCIES "")
endif()

# Paths relative to the file itself, so that an installed tree can be moved.
file(RELATIVE_PATH FATHOM_PC_PREFIX /prefix/${CMAKE_INSTALL_LIBDIR}/pkgconfig /prefix)

configure_file(cmake/fathom.pc.in fathom.pc @ONLY)
install(FILES ${PROJECT_BINARY_DIR}/fathom.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)

configure_package_config_file(cmake/fathom-config.cmake.in fathom-config.cmake INSTALL_DESTINATION ${package_dir})
# Until 1.0 a minor version may change the interface.
write_basic_package_version_file(fathom-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/fathom-config.cmake ${PROJECT_BINARY_DIR}/fathom-config-version.cmake
    DESTINATION ${package_dir})
