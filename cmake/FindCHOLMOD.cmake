# SPDX-License-Identifier: MIT
# FindCHOLMOD: the sparse Cholesky solver of SuiteSparse, with or without SuiteSparse's own CMake files
# (Debian 12 has SuiteSparse 5 without them, Ubuntu 24.04 has SuiteSparse 7).
#
# Target:    CHOLMOD::CHOLMOD
# Variables: CHOLMOD_FOUND, CHOLMOD_VERSION (CHOLMOD's own), CHOLMOD_SUITESPARSE_VERSION

find_path(CHOLMOD_INCLUDE_DIR cholmod.h PATH_SUFFIXES suitesparse)
find_library(CHOLMOD_LIBRARY cholmod)
mark_as_advanced(CHOLMOD_INCLUDE_DIR CHOLMOD_LIBRARY)

# "#define PREFIX_MAIN_VERSION 5" and so on, in any of the given headers
function(cholmod_read_version variable prefix)
  set(version "")
  foreach(header IN LISTS ARGN)
    if(NOT version AND EXISTS ${CHOLMOD_INCLUDE_DIR}/${header})
      file(STRINGS ${CHOLMOD_INCLUDE_DIR}/${header} lines REGEX "define ${prefix}_(MAIN|SUB|SUBSUB)_VERSION")
      if(lines MATCHES "_MAIN_VERSION +([0-9]+).*_SUB_VERSION +([0-9]+).*_SUBSUB_VERSION +([0-9]+)")
        set(version ${CMAKE_MATCH_1}.${CMAKE_MATCH_2}.${CMAKE_MATCH_3})
      endif()
    endif()
  endforeach()
  set(${variable} "${version}" PARENT_SCOPE)
endfunction()
cholmod_read_version(CHOLMOD_VERSION CHOLMOD cholmod_core.h cholmod.h)
cholmod_read_version(CHOLMOD_SUITESPARSE_VERSION SUITESPARSE SuiteSparse_config.h)

include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(CHOLMOD
  REQUIRED_VARS CHOLMOD_LIBRARY CHOLMOD_INCLUDE_DIR
  VERSION_VAR CHOLMOD_VERSION
  REASON_FAILURE_MESSAGE "install libsuitesparse-dev, or configure with -DROCKDDA_WITH_CHOLMOD=OFF")

if(CHOLMOD_FOUND AND NOT TARGET CHOLMOD::CHOLMOD)
  add_library(CHOLMOD::CHOLMOD UNKNOWN IMPORTED)
  set_target_properties(CHOLMOD::CHOLMOD PROPERTIES
    IMPORTED_LOCATION ${CHOLMOD_LIBRARY}
    INTERFACE_INCLUDE_DIRECTORIES ${CHOLMOD_INCLUDE_DIR})
endif()
