# SPDX-License-Identifier: Apache-2.0
# cmake -DABIDW=... -DABIDIFF=... -DTYPES=libcapi_abi_types.so -DBASELINE=delmesh.abi [-DUPDATE=ON] -P abi.cmake
# Compares the types of the interface with the committed baseline. Any difference fails: one that keeps old callers alive (a field
# at the end, a new function) is then taken into the baseline by UPDATE; any other needs a new DELMESH_ABI_VERSION and SONAME too.
#     ninja update-abi        does so, for symbols.txt as well
set(format --no-show-locs --no-comp-dir-path --no-corpus-path --no-elf-needed --drop-undefined-syms)
if(UPDATE)
  execute_process(COMMAND ${ABIDW} ${format} --out-file ${BASELINE} ${TYPES} COMMAND_ERROR_IS_FATAL ANY)
  file(READ ${BASELINE} description)
  string(REGEX REPLACE " path='[^']*'" "" description "${description}")
  file(WRITE ${BASELINE} "${description}<!-- SPDX-License-Identifier: Apache-2.0. Written by the target update-abi. -->\n")
endif()
execute_process(COMMAND ${ABIDIFF} --no-show-locs ${BASELINE} ${TYPES} OUTPUT_VARIABLE changes RESULT_VARIABLE result)
if(NOT result EQUAL 0)
  message(FATAL_ERROR "The interface is not that of ${BASELINE}:\n${changes}")
endif()
