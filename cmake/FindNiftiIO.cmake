# niftilib, for NIfTI-1 headers: NIFTIIO_INCLUDE_DIR, and NIFTIIO_LIBRARIES as paths, which a consumer of the static library can use.
find_path(NIFTIIO_INCLUDE_DIR nifti1_io.h PATH_SUFFIXES nifti)
find_library(NIFTIIO_LIBRARY niftiio)
find_library(NIFTIIO_ZNZ_LIBRARY znz)
set(NIFTIIO_LIBRARIES ${NIFTIIO_LIBRARY} ${NIFTIIO_ZNZ_LIBRARY})

include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(NiftiIO REQUIRED_VARS NIFTIIO_LIBRARY NIFTIIO_ZNZ_LIBRARY NIFTIIO_INCLUDE_DIR)
mark_as_advanced(NIFTIIO_INCLUDE_DIR NIFTIIO_LIBRARY NIFTIIO_ZNZ_LIBRARY)
