#pragma once
/* The codec of Cyclone DDS for types made by idlc, as C functions on bytes behind the encapsulation. */
#include <stdbool.h>
#include <stdint.h>

#include "dds/dds.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Reads `size` bytes of XCDR1, little endian, as a value of the type, and writes that again, little endian and big
   endian, into memory of `size` bytes each. False where Cyclone refuses the bytes, does not need all of them, or writes
   another number of bytes. */
bool cyclone_round_trip(const dds_topic_descriptor_t* type, const uint8_t* bytes, uint32_t size,
                        uint8_t* little, uint8_t* big);

#ifdef __cplusplus
}
#endif
