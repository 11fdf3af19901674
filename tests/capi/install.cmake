# SPDX-License-Identifier: Apache-2.0
# Installs the build into a prefix of its own, moves that prefix, and builds and runs every example against it: through
# find_package and through pkg-config, as their users would.
function(run)
  cmake_parse_arguments(PARSE_ARGV 0 run "" "IN" "")
  execute_process(COMMAND ${run_UNPARSED_ARGUMENTS} WORKING_DIRECTORY ${run_IN} COMMAND_ECHO STDOUT COMMAND_ERROR_IS_FATAL ANY)
endfunction()

file(REMOVE_RECURSE ${WORK})
file(MAKE_DIRECTORY ${WORK})
run(${CMAKE_COMMAND} --install ${BUILD} --prefix ${WORK}/first IN ${WORK})
file(RENAME ${WORK}/first ${WORK}/prefix)
set(library ${WORK}/prefix/${LIBDIR}/libdelmesh.so)

foreach(example minimal cpp dlopen)
  run(${CMAKE_COMMAND} -G ${GENERATOR} -S ${EXAMPLES}/${example} -B ${WORK}/${example} -DCMAKE_PREFIX_PATH=${WORK}/prefix
    -DCMAKE_C_COMPILER=${CC} -DCMAKE_CXX_COMPILER=${CXX} IN ${WORK})
  run(${CMAKE_COMMAND} --build ${WORK}/${example} IN ${WORK})
endforeach()
run(${WORK}/minimal/delmesh_minimal IN ${WORK})
run(${WORK}/cpp/delmesh_cpp IN ${WORK})
run(${WORK}/dlopen/delmesh_dlopen ${library} IN ${WORK})

set(ENV{PKG_CONFIG_PATH} ${WORK}/prefix/${LIBDIR}/pkgconfig)
set(ENV{LD_LIBRARY_PATH} ${WORK}/prefix/${LIBDIR})
file(COPY ${EXAMPLES}/minimal DESTINATION ${WORK}/make)
run(make CC=${CC} IN ${WORK}/make/minimal)
run(${WORK}/make/minimal/delmesh_minimal IN ${WORK})
