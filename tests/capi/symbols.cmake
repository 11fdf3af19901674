# SPDX-License-Identifier: Apache-2.0
# cmake -DNM=... -DLIBRARY=... -DLIST=symbols.txt [-DUPDATE=ON] -P symbols.cmake
# Compares what the library exports, with versions, with the committed list; UPDATE writes the list anew.
execute_process(COMMAND ${NM} -D --defined-only ${LIBRARY} OUTPUT_VARIABLE output COMMAND_ERROR_IS_FATAL ANY)
string(REGEX MATCHALL "[^\n ]+\n" symbols "${output}")
list(SORT symbols)
list(JOIN symbols "" exported)
string(PREPEND exported "# SPDX-License-Identifier: Apache-2.0\n# Written by the target update-abi.\n")
if(UPDATE)
  file(WRITE ${LIST} "${exported}")
endif()
file(READ ${LIST} expected)
if(NOT exported STREQUAL expected)
  message(FATAL_ERROR "The library exports\n${exported}\nand not, as ${LIST} has it,\n${expected}")
endif()
