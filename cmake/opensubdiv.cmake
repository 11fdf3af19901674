# SPDX-License-Identifier: Apache-2.0
# The target delmesh_opensubdiv, if DELMESH_WITH_OPENSUBDIV asks for it and it is there: OpenSubdiv 3.5 or newer, whose Bfr
# evaluates cages. There are two ways to have it:
#  - its source, in DELMESH_OPENSUBDIV_SOURCE: what is needed of it is compiled in, and hidden. What is shipped is built so.
#  - the system's shared library, which brings the C++ runtime along. Not by find_package: Debian's package file names a static
#    library that Debian does not have.
set(DELMESH_WITH_OPENSUBDIV AUTO CACHE STRING "Cages, evaluated by OpenSubdiv: ON, OFF, or AUTO: if it is there")
set_property(CACHE DELMESH_WITH_OPENSUBDIV PROPERTY STRINGS AUTO ON OFF)
file(GLOB found ${CMAKE_CURRENT_SOURCE_DIR}/build/sources/opensubdiv-*) # where scripts/setup puts it
set(DELMESH_OPENSUBDIV_SOURCE "${found}" CACHE PATH "The source of OpenSubdiv, to be compiled in; empty: the system's library")
if(NOT DELMESH_WITH_OPENSUBDIV)
  return()
endif()

if(DELMESH_OPENSUBDIV_SOURCE)
  set(source ${DELMESH_OPENSUBDIV_SOURCE}/opensubdiv)
  if(NOT EXISTS ${source}/bfr/surface.cpp)
    message(FATAL_ERROR "DELMESH_OPENSUBDIV_SOURCE is no source of OpenSubdiv with Bfr: ${DELMESH_OPENSUBDIV_SOURCE}")
  endif()
  file(GLOB opensubdiv_sources ${source}/sdc/*.cpp ${source}/vtr/*.cpp ${source}/far/*.cpp ${source}/bfr/*.cpp)
  list(REMOVE_ITEM opensubdiv_sources ${source}/far/error.cpp) # it prints: libdelmesh/subdiv/osd_error.cpp stands in for it
  add_library(delmesh_opensubdiv STATIC ${opensubdiv_sources})
  target_include_directories(delmesh_opensubdiv SYSTEM PUBLIC ${DELMESH_OPENSUBDIV_SOURCE})
  target_compile_definitions(delmesh_opensubdiv PUBLIC $<$<PLATFORM_ID:Windows>:_USE_MATH_DEFINES>) # for M_PI, in headers
  target_compile_features(delmesh_opensubdiv PRIVATE cxx_std_14)
  target_compile_options(delmesh_opensubdiv PRIVATE -w -ffp-contract=off -ffunction-sections -fdata-sections)
  set_target_properties(delmesh_opensubdiv PROPERTIES POSITION_INDEPENDENT_CODE ON
    CXX_VISIBILITY_PRESET hidden VISIBILITY_INLINES_HIDDEN ON)
  return()
endif()

if(NOT CMAKE_CROSSCOMPILING) # else it would be this system's
  find_path(DELMESH_OPENSUBDIV_INCLUDE opensubdiv/bfr/surface.h)
  find_library(DELMESH_OPENSUBDIV_LIBRARY osdCPU)
endif()
mark_as_advanced(DELMESH_OPENSUBDIV_INCLUDE DELMESH_OPENSUBDIV_LIBRARY)
if(DELMESH_OPENSUBDIV_INCLUDE AND DELMESH_OPENSUBDIV_LIBRARY)
  add_library(delmesh_opensubdiv INTERFACE)
  target_include_directories(delmesh_opensubdiv SYSTEM INTERFACE ${DELMESH_OPENSUBDIV_INCLUDE})
  target_link_libraries(delmesh_opensubdiv INTERFACE ${DELMESH_OPENSUBDIV_LIBRARY})
  set(DELMESH_STATIC_RUNTIME OFF) # of the two there would be
elseif(NOT DELMESH_WITH_OPENSUBDIV STREQUAL AUTO)
  message(FATAL_ERROR "DELMESH_WITH_OPENSUBDIV is ON, and there is neither a DELMESH_OPENSUBDIV_SOURCE nor a libosdCPU with Bfr "
    "(Debian: libosd-dev)")
else()
  message(STATUS "Cages are left out: they take OpenSubdiv 3.5 (Debian: libosd-dev), or its source in DELMESH_OPENSUBDIV_SOURCE")
endif()
