# SPDX-License-Identifier: MIT
# add_pfunit_ctest(NAME TEST_SOURCES a.pf … [OTHER_SOURCES …] [LINK_LIBRARIES …] [LABELS …] [WORKING_DIRECTORY …])
#
# pFUnit's own function where pFUnit is installed; otherwise a stand-in with the same arguments that runs the same
# files. Either way every test finds the folder of shared reference data in the environment variable ROCKDDA_SHARED.

set(ROCKDDA_SHARED_DIR ${PROJECT_SOURCE_DIR}/../shared CACHE PATH "Folder with legacy data sets for tests that use them")
get_filename_component(rockdda_shared_dir ${ROCKDDA_SHARED_DIR} ABSOLUTE)

find_package(PFUNIT QUIET)
if(PFUNIT_FOUND)
  message(STATUS "Unit tests: pFUnit ${PFUNIT_VERSION}")
else()
  message(STATUS "Unit tests: pFUnit is not installed, its stand-in is used")
  find_package(Python3 3.11 REQUIRED COMPONENTS Interpreter)
  set(rockdda_pf_script ${CMAKE_CURRENT_LIST_DIR}/pf.py)
  set(rockdda_funit_dir ${PROJECT_BINARY_DIR}/funit)
  add_library(rockdda_funit STATIC ${CMAKE_CURRENT_LIST_DIR}/funit.f90)
  set_target_properties(rockdda_funit PROPERTIES Fortran_MODULE_DIRECTORY ${rockdda_funit_dir}/mod)
  target_include_directories(rockdda_funit PUBLIC ${rockdda_funit_dir}/mod)
  target_compile_options(rockdda_funit PRIVATE $<$<COMPILE_LANG_AND_ID:Fortran,GNU>:-std=f2008>)

  function(add_pfunit_ctest name)
    cmake_parse_arguments(PARSE_ARGV 1 arg "" "WORKING_DIRECTORY" "TEST_SOURCES;OTHER_SOURCES;LINK_LIBRARIES;LABELS")
    if(arg_UNPARSED_ARGUMENTS OR NOT arg_TEST_SOURCES)
      message(FATAL_ERROR "add_pfunit_ctest(${name}): unknown or missing arguments: ${arg_UNPARSED_ARGUMENTS}")
    endif()
    set(sources "")
    set(modules "")
    foreach(source IN LISTS arg_TEST_SOURCES)
      get_filename_component(module ${source} NAME_WE)
      set(input ${CMAKE_CURRENT_SOURCE_DIR}/${source})
      set(output ${CMAKE_CURRENT_BINARY_DIR}/${name}.dir/${module}.F90)
      add_custom_command(
        OUTPUT ${output}
        COMMAND Python3::Interpreter ${rockdda_pf_script} convert ${input} ${output}
        DEPENDS ${input} ${rockdda_pf_script}
        COMMENT "Converting ${source}"
        VERBATIM)
      list(APPEND sources ${output})
      list(APPEND modules ${module})
    endforeach()
    set(driver ${CMAKE_CURRENT_BINARY_DIR}/${name}.dir/driver.f90)
    file(MAKE_DIRECTORY ${CMAKE_CURRENT_BINARY_DIR}/${name}.dir)
    add_custom_command(
      OUTPUT ${driver}
      COMMAND Python3::Interpreter ${rockdda_pf_script} driver ${driver} ${modules}
      DEPENDS ${rockdda_pf_script}
      COMMENT "Generating driver of ${name}"
      VERBATIM)
    add_executable(${name} ${driver} ${sources} ${arg_OTHER_SOURCES})
    set_target_properties(${name} PROPERTIES Fortran_MODULE_DIRECTORY ${CMAKE_CURRENT_BINARY_DIR}/mod/${name})
    target_include_directories(${name} PRIVATE ${CMAKE_CURRENT_SOURCE_DIR} ${CMAKE_CURRENT_BINARY_DIR}/mod/${name})
    target_link_libraries(${name} ${arg_LINK_LIBRARIES} rockdda_funit)
    if(NOT arg_WORKING_DIRECTORY)
      set(arg_WORKING_DIRECTORY ${CMAKE_CURRENT_BINARY_DIR})
    endif()
    add_test(NAME ${name} COMMAND ${name} --verbose WORKING_DIRECTORY ${arg_WORKING_DIRECTORY})
    set_tests_properties(${name} PROPERTIES LABELS "${arg_LABELS}"
      FAIL_REGULAR_EXPRESSION "Encountered 1 or more failures/errors during testing")
  endfunction()
endif()

# The mark of a skipped test, for every test.
add_library(rockdda_skipped_tests STATIC ${CMAKE_CURRENT_LIST_DIR}/skipped_tests.f90)
set_target_properties(rockdda_skipped_tests PROPERTIES Fortran_MODULE_DIRECTORY ${PROJECT_BINARY_DIR}/skipped_tests)
target_include_directories(rockdda_skipped_tests PUBLIC ${PROJECT_BINARY_DIR}/skipped_tests)

# CMake keeps a function that is defined again under its name with an underscore in front.
function(add_pfunit_ctest name)
  _add_pfunit_ctest(${name} ${ARGN})
  target_link_libraries(${name} rockdda_skipped_tests)
  set_property(TEST ${name} APPEND PROPERTY ENVIRONMENT "ROCKDDA_SHARED=${rockdda_shared_dir}" OMP_NUM_THREADS=2
    OPENBLAS_NUM_THREADS=1)
endfunction()
