/* SPDX-License-Identifier: Apache-2.0
 * What abi.cmake describes: variables whose types reach every function signature and every struct of delmesh.h. The library
 * itself would bring its C++ insides into the description; that it has these very signatures is what its compiler checks, and that
 * it exports the names is what symbols.cmake checks. */
#include <delmesh/delmesh.h>

delmesh_api delmesh_abi_table;
const delmesh_api* (*delmesh_abi_get_api)(uint32_t) = delmesh_get_api;
uint32_t (*delmesh_abi_struct_size)(const char*) = delmesh_struct_size;
uint32_t (*delmesh_abi_field_offset)(const char*) = delmesh_field_offset;
