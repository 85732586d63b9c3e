#include "cyclone_codec.h"

#include <stdlib.h>
#include <string.h>

#include "dds/ddsi/ddsi_cdrstream.h"

enum { kXcdr1 = 1 };

bool cyclone_round_trip(const dds_topic_descriptor_t* type, const uint8_t* bytes, uint32_t size,
                        uint8_t* little, uint8_t* big) {
  memcpy(little, bytes, size);
  uint32_t used = 0;
  if (dds_stream_normalize_data((char*)little, &used, size, false, kXcdr1, type->m_ops) == NULL ||
      used != size)
    return false;
  char* const value = calloc(1, type->m_size);
  dds_istream_t from = {little, size, 0, kXcdr1};
  dds_stream_read(&from, value, type->m_ops);
  dds_ostream_t le;
  dds_ostream_init(&le, 0, kXcdr1);
  dds_ostreamBE_t be;
  dds_ostreamBE_init(&be, 0, kXcdr1);
  const bool written = dds_stream_write(&le, value, type->m_ops) != NULL &&
                       dds_stream_writeBE(&be, value, type->m_ops) != NULL && le.m_index == size &&
                       be.x.m_index == size;
  if (written) {
    memcpy(little, le.m_buffer, size);
    memcpy(big, be.x.m_buffer, size);
  }
  dds_ostream_fini(&le);
  dds_ostreamBE_fini(&be);
  dds_stream_free_sample(value, type->m_ops);
  free(value);
  return written;
}
