# Teem, for NRRD headers: TEEM_INCLUDE_DIR and TEEM_LIBRARY. Debian's TeemConfig.cmake leaves out where its library is.
find_path(TEEM_INCLUDE_DIR teem/nrrd.h)
find_library(TEEM_LIBRARY teem)

include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(Teem REQUIRED_VARS TEEM_LIBRARY TEEM_INCLUDE_DIR)
mark_as_advanced(TEEM_INCLUDE_DIR TEEM_LIBRARY)
