/* SPDX-License-Identifier: Apache-2.0
 *
 * bytes.h: numbers of binary files, in either byte order, at any alignment.
 */
#ifndef DELMESH_CLI_BYTES_H
#define DELMESH_CLI_BYTES_H

#include <stdint.h>
#include <string.h>

typedef enum ByteOrder { kLittleEndian, kBigEndian } ByteOrder;

static inline uint32_t bytes_u16(const char* p, ByteOrder order) {
    const unsigned char* b = (const unsigned char*)p;
    return order == kLittleEndian ? b[0] | (uint32_t)b[1] << 8 : b[1] | (uint32_t)b[0] << 8;
}

static inline uint32_t bytes_u32(const char* p, ByteOrder order) {
    return order == kLittleEndian ? bytes_u16(p, order) | bytes_u16(p + 2, order) << 16
                                  : bytes_u16(p + 2, order) | bytes_u16(p, order) << 16;
}

static inline uint64_t bytes_u64(const char* p, ByteOrder order) {
    uint64_t first = bytes_u32(p, order), second = bytes_u32(p + 4, order);
    return order == kLittleEndian ? first | second << 32 : second | first << 32;
}

static inline float bytes_f32(const char* p, ByteOrder order) {
    uint32_t bits = bytes_u32(p, order);
    float value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

static inline double bytes_f64(const char* p, ByteOrder order) {
    uint64_t bits = bytes_u64(p, order);
    double value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

static inline void bytes_put_u16(char* p, uint32_t bits, ByteOrder order) {
    for (int i = 0; i < 2; ++i) p[i] = (char)(bits >> (order == kLittleEndian ? 8 * i : 8 - 8 * i));
}

static inline void bytes_put_u32(char* p, uint32_t bits, ByteOrder order) {
    for (int i = 0; i < 4; ++i) p[i] = (char)(bits >> (order == kLittleEndian ? 8 * i : 24 - 8 * i));
}

static inline void bytes_put_f32(char* p, float value, ByteOrder order) {
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    bytes_put_u32(p, bits, order);
}

static inline void bytes_put_f64(char* p, double value, ByteOrder order) {
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    for (int i = 0; i < 8; ++i) p[i] = (char)(bits >> (order == kLittleEndian ? 8 * i : 56 - 8 * i));
}

#endif
