#include "idl/transport/rtps_guard/rtps_parameters.h"

#include <algorithm>
#include <array>

#include "idl/transport/rtps_guard/wire_cursor.h"

namespace takt {
namespace {

using Bytes = std::span<const std::uint8_t>;

constexpr std::size_t kMaxParameters = 1024;
constexpr std::size_t kMaxLocators = 64;
constexpr std::uint32_t kMaxProperties = 64;
constexpr std::uint32_t kMaxPartitions = 32;
constexpr std::uint32_t kMaxRepresentations = 16;
constexpr std::uint32_t kMaxDataHolders = 16;
constexpr std::uint32_t kLongestName = 256;
constexpr std::uint32_t kLongestPartition = 128;
constexpr std::uint32_t kLongestProperty = 4096;
constexpr std::uint32_t kMaxOctets = 4096;

/// How the value of a parameter is read by Fast DDS 2.9.1.
enum class Form : std::uint8_t {
  fixed,  ///< exactly this number of bytes
  kind,   ///< a choice, up to `most`, in `size` bytes
  time,   ///< a duration that is not negative
  kind_and_time,
  lease,       ///< for how long a participant lives on without a word
  guid,        ///< of the described entity
  locator,     ///< an address
  name,        ///< a short string
  octets,      ///< any bytes, counted
  properties,  ///< pairs of strings
  strings,     ///< partitions
  choices,     ///< data representations
  at_least,    ///< this number of bytes or more
  token,       ///< class, properties, binary properties
  hidden,      ///< becomes padding
};

struct Rule {
  std::uint16_t id;
  Form form;
  std::uint16_t size;
  std::uint8_t most;
};

// Ascending by id. Of the discovery of participants and endpoints alike.
constexpr Rule kRules[] = {
    {0x0002, Form::lease, 8, 0},           // participant lease duration
    {0x0004, Form::time, 8, 0},            // time based filter
    {0x0005, Form::name, 0, 0},            // topic name
    {0x0006, Form::fixed, 4, 0},           // ownership strength
    {0x0007, Form::name, 0, 0},            // type name
    {0x000f, Form::fixed, 4, 0},           // domain id
    {0x0015, Form::fixed, 4, 0},           // protocol version
    {0x0016, Form::fixed, 4, 0},           // vendor id
    {0x001a, Form::kind_and_time, 12, 2},  // reliability
    {0x001b, Form::kind_and_time, 12, 2},  // liveliness
    {0x001d, Form::kind, 4, 3},            // durability
    {0x001e, Form::fixed, 28, 0},          // durability service
    {0x001f, Form::kind, 4, 1},            // ownership
    {0x0021, Form::kind, 8, 2},            // presentation
    {0x0023, Form::time, 8, 0},            // deadline
    {0x0025, Form::kind, 4, 1},            // destination order
    {0x0027, Form::time, 8, 0},            // latency budget
    {0x0029, Form::strings, 0, 0},         // partition
    {0x002b, Form::time, 8, 0},            // lifespan
    {0x002c, Form::octets, 0, 0},          // user data
    {0x002d, Form::octets, 0, 0},          // group data
    {0x002e, Form::octets, 0, 0},          // topic data
    {0x002f, Form::locator, 24, 0},        // unicast
    {0x0030, Form::locator, 24, 0},        // multicast
    {0x0031, Form::locator, 24, 0},        // default unicast
    {0x0032, Form::locator, 24, 0},        // metatraffic unicast
    {0x0033, Form::locator, 24, 0},        // metatraffic multicast
    {0x0034, Form::fixed, 4, 0},           // manual liveliness count
    {0x0035, Form::hidden, 0, 0},          // content filter: readers filter themselves
    {0x0040, Form::kind, 8, 1},            // history
    {0x0041, Form::fixed, 12, 0},          // resource limits
    {0x0043, Form::fixed, 4, 0},           // expects inline QoS
    {0x0048, Form::locator, 24, 0},        // default multicast
    {0x0049, Form::fixed, 4, 0},           // transport priority
    {0x0050, Form::guid, 16, 0},           // participant
    {0x0052, Form::fixed, 16, 0},          // group guid
    {0x0053, Form::fixed, 4, 0},           // group entity
    {0x0058, Form::fixed, 4, 0},           // builtin endpoints
    {0x0059, Form::properties, 0, 0},     {0x005a, Form::guid, 16, 0},  // endpoint
    {0x0060, Form::fixed, 4, 0},                                        // largest serialized size
    {0x0062, Form::name, 0, 0},                                         // entity name
    {0x0069, Form::hidden, 0, 0},                                       // type identifier
    {0x0070, Form::guid, 16, 0},                                        // key hash
    {0x0071, Form::fixed, 4, 0},                                        // status
    {0x0072, Form::hidden, 0, 0},                                       // type object: Fast-DDS issue 3296
    {0x0073, Form::choices, 0, 0},                                      // data representation
    {0x0074, Form::at_least, 4, 0},                                     // type consistency
    {0x0075, Form::hidden, 0, 0},                                       // type information
    {0x0077, Form::fixed, 4, 0},                                        // builtin endpoint QoS
    {0x1001, Form::token, 0, 0},                                        // identity
    {0x1002, Form::token, 0, 0},                                        // permissions
    {0x1004, Form::fixed, 8, 0},                                        // endpoint security
    {0x1005, Form::fixed, 8, 0},                                        // participant security
    {0x1006, Form::token, 0, 0},                                        // identity status
    {0x8002, Form::fixed, 16, 0},                                       // persistence guid
    {0x8005, Form::fixed, 4, 0},                                        // disable positive acknowledgements
    {0x8006, Form::hidden, 0, 0},                                       // data sharing: off here
};
static_assert(std::is_sorted(std::begin(kRules), std::end(kRules),
                             [](const Rule& a, const Rule& b) { return a.id < b.id; }));

const Rule* rule_of(std::uint16_t id) {
  const auto* found = std::lower_bound(std::begin(kRules), std::end(kRules), id,
                                       [](const Rule& r, std::uint16_t i) { return r.id < i; });
  return found != std::end(kRules) && found->id == id ? found : nullptr;
}

/// Length, characters, terminating zero. Fast DDS takes such a string for one of C.
bool read_string(WireCursor& cursor, std::uint32_t longest) {
  const std::uint32_t length = cursor.u32();
  if (length == 0 || length > longest) return false;
  const Bytes text = cursor.bytes(length);
  cursor.align();
  return cursor.ok() && text.back() == 0;
}

bool read_octets(WireCursor& cursor, std::uint32_t most) {
  const std::uint32_t length = cursor.u32();
  if (length > most) return false;
  cursor.skip(length);
  cursor.align();
  return cursor.ok();
}

/// `item` reads one of a counted sequence.
template <typename Item>
bool read_sequence(WireCursor& cursor, std::uint32_t most, Item item) {
  const std::uint32_t count = cursor.u32();
  if (!cursor.ok() || count > most) return false;
  for (std::uint32_t i = 0; i < count; ++i)
    if (!item()) return false;
  return cursor.ok();
}

bool read_properties(WireCursor& cursor) {
  return read_sequence(cursor, kMaxProperties, [&] {
    return read_string(cursor, kLongestProperty) && read_string(cursor, kLongestProperty);
  });
}

bool read_data_holder(WireCursor& cursor) {
  constexpr std::uint32_t most_octets = 1U << 16U;
  return read_string(cursor, kLongestProperty) && read_properties(cursor) &&
         read_sequence(cursor, kMaxProperties, [&] {
           return read_string(cursor, kLongestProperty) && read_octets(cursor, most_octets);
         });
}

RtpsError flaw_unless(bool good, RtpsError flaw = RtpsError::parameter) {
  return good ? RtpsError::none : flaw;
}

RtpsError check_locator(WireCursor& cursor, const GuardLimits& limits) {
  constexpr std::uint32_t invalid = 0xffffffff, reserved = 0, udp4 = 1, udp6 = 2, tcp4 = 4, tcp6 = 8;
  // Fast DDS: 16 in its major 2, 16 + major after.
  constexpr std::uint32_t shared_memory_2 = 16, shared_memory_3 = 16 + 3, shared_memory_standard = 0x02000000;
  const std::uint32_t kind = cursor.u32(), port = cursor.u32();
  switch (kind) {
    case udp4:
    case udp6:
      return flaw_unless(port > 0 && port <= 65535, RtpsError::locator);
    case shared_memory_2:
    case shared_memory_3:
    case shared_memory_standard:
      return flaw_unless(port >= limits.first_shared_memory_port && port <= limits.last_shared_memory_port,
                         RtpsError::locator);
    case invalid:
    case reserved:
    case tcp4:
    case tcp6:
      return RtpsError::none;  // no transport here takes these
    default:
      // Kinds of other vendors: signed numbers, ignored by other implementations.
      return flaw_unless(kind >= 0x01000000, RtpsError::locator);
  }
}

RtpsError check_guid(std::uint16_t id, Bytes value, const ListContext& context) {
  // A GUID prefix has one participant. Fast DDS would accept others as further ones, with the same
  // endpoints.
  constexpr std::array<std::uint8_t, 4> participant{0, 0, 1, 0xc1};
  const bool names_one = context.kind == ListKind::participant && (id == 0x0050 || id == 0x0070);
  if (names_one && !std::equal(participant.begin(), participant.end(), value.begin() + 12))
    return RtpsError::identity;
  if (context.sender == nullptr) return RtpsError::none;
  return flaw_unless(std::equal(context.sender->begin(), context.sender->end(), value.begin()),
                     RtpsError::identity);
}

bool is_duration(WireCursor& cursor) {
  const std::uint32_t seconds = cursor.u32();
  cursor.u32();
  return cursor.ok() && seconds <= 0x7fffffff;
}

RtpsError check_lease(WireCursor& cursor, const GuardLimits& limits) {
  constexpr std::uint32_t tenth_of_a_second = 0x19999999;
  const std::uint32_t seconds = cursor.u32(), fraction = cursor.u32();
  return flaw_unless(seconds <= limits.longest_lease_s && (seconds > 0 || fraction >= tenth_of_a_second),
                     RtpsError::lease);
}

RtpsError check_value(const Rule& rule, Bytes value, bool big_endian, const ListContext& context) {
  WireCursor cursor(value, big_endian);
  if (rule.size > 0 && (rule.form == Form::at_least ? value.size() < rule.size : value.size() != rule.size))
    return RtpsError::parameter;
  switch (rule.form) {
    case Form::fixed:
    case Form::at_least:
    case Form::hidden:
      return RtpsError::none;
    case Form::kind:  // Fast DDS reads and writes the first byte, in any byte order
      return flaw_unless(value[0] <= rule.most);
    case Form::time:
      return flaw_unless(is_duration(cursor));
    case Form::kind_and_time:
      cursor.skip(4);
      return flaw_unless(is_duration(cursor) && value[0] <= rule.most);
    case Form::lease:
      return check_lease(cursor, *context.limits);
    case Form::guid:
      return check_guid(rule.id, value, context);
    case Form::locator:
      return check_locator(cursor, *context.limits);
    case Form::name:
      return flaw_unless(value.size() <= kLongestName && read_string(cursor, kLongestName), RtpsError::text);
    case Form::octets:
      return flaw_unless(read_octets(cursor, kMaxOctets) && cursor.left() == 0);
    case Form::properties:
      // Binary properties may follow; Cyclone DDS sends their number, 0.
      return flaw_unless(read_properties(cursor) && (cursor.left() == 0 || cursor.u32() == 0) &&
                             cursor.ok() && cursor.left() == 0,
                         RtpsError::text);
    case Form::strings:
      return flaw_unless(
          read_sequence(cursor, kMaxPartitions, [&] { return read_string(cursor, kLongestPartition); }) &&
              cursor.left() == 0,
          RtpsError::text);
    case Form::choices:
      return flaw_unless(read_sequence(cursor, kMaxRepresentations, [&] {
        cursor.u16();
        return cursor.ok();
      }));
    case Form::token:
      return flaw_unless(read_data_holder(cursor) && cursor.left() == 0);
  }
  return RtpsError::parameter;
}

/// Fast DDS reads only three inline parameters.
RtpsError check_inline(std::uint16_t id, Bytes value, const ListContext& context) {
  switch (id) {
    case 0x0070:  // key hash: of discovery data the GUID of the announced entity
      if (value.size() != 16) return RtpsError::inline_qos;
      return context.sender == nullptr ? RtpsError::none : check_guid(id, value, context);
    case 0x0071:  // status
      return flaw_unless(value.size() == 4, RtpsError::inline_qos);
    case 0x0083:  // related sample identity, of the standard and of Fast DDS
    case 0x800f:
      return flaw_unless(value.size() >= 24, RtpsError::inline_qos);
    default:
      return RtpsError::none;
  }
}

/// The announced properties of an endpoint. Of a repeated parameter the last one counts, as for Fast DDS.
class EndpointReading {
 public:
  void read(std::uint16_t id, Bytes value) {
    if (id == 0x005a || id == 0x0070) {
      traits_.guid = mixed(value, 0);
      traits_.participant = participant_key(value);
    }
    const auto found = std::find(kUnchanging.begin(), kUnchanging.end(), id);
    if (found == kUnchanging.end()) return;
    const std::uint64_t said = mixed(found < kUnchanging.begin() + kNames ? value : value.first(1), id);
    std::uint64_t& before = values_[static_cast<std::size_t>(found - kUnchanging.begin())];
    traits_.unchanging += said - before;
    before = said;
  }
  const EndpointTraits& traits() const { return traits_; }

 private:
  /// Topic and type; the kinds of reliability, durability and ownership; whether it expects inline QoS, and
  /// whether it omits positive acknowledgements.
  static constexpr std::size_t kNames = 2;
  static constexpr std::array<std::uint16_t, 7> kUnchanging{0x0005, 0x0007, 0x001a, 0x001d,
                                                            0x001f, 0x0043, 0x8005};
  std::array<std::uint64_t, kUnchanging.size()> values_{};
  EndpointTraits traits_;
};

}  // namespace

ListReport inspect_parameters(Bytes bytes, bool big_endian, const ListContext& context,
                              std::uint8_t* rewrite) noexcept {
  constexpr std::uint16_t sentinel = 1;
  ListReport report;
  const bool discovery = context.kind != ListKind::inline_qos;
  const RtpsError broken = discovery ? RtpsError::parameter_list : RtpsError::inline_qos;
  WireCursor cursor(bytes, big_endian);
  EndpointReading endpoint;
  std::size_t locators = 0;
  bool named = false;  // the GUID of the entity is present
  for (std::size_t i = 0; i < kMaxParameters; ++i) {
    const std::size_t start = cursor.position();
    const std::uint16_t id = cursor.u16(), length = cursor.u16();
    if (!cursor.ok()) {
      report.flaw = broken;
      return report;
    }
    if (id == sentinel) {
      report.size = cursor.position();
      report.endpoint = endpoint.traits();
      const bool complete = !discovery || named;
      if (!complete) report.flaw = RtpsError::identity;
      return report;
    }
    const Bytes value = cursor.bytes(length);
    if (!cursor.ok() || length % 4 != 0) {
      report.flaw = broken;
      return report;
    }
    if (!discovery) {
      report.flaw = check_inline(id, value, context);
      if (context.hide_key && id == 0x0070) {
        report.needs_cleaning = true;
        if (rewrite != nullptr) rewrite[start] = rewrite[start + 1] = 0;
      }
    } else if (const Rule* rule = rule_of(id)) {
      report.flaw = check_value(*rule, value, big_endian, context);
      if (rule->form == Form::locator && ++locators > kMaxLocators) report.flaw = RtpsError::locator;
      if (rule->form == Form::hidden) {
        report.needs_cleaning = true;
        if (rewrite != nullptr) rewrite[start] = rewrite[start + 1] = 0;
      }
      named = named || id == 0x0070 || id == (context.kind == ListKind::participant ? 0x0050 : 0x005a);
    }
    if (report.flaw != RtpsError::none) return report;
    if (context.kind == ListKind::endpoint) endpoint.read(id, value);
  }
  report.flaw = broken;
  return report;
}

RtpsError inspect_security_message(Bytes bytes, bool big_endian) noexcept {
  WireCursor cursor(bytes, big_endian);
  constexpr std::size_t identities = 2 * (16 + 8), keys = 3 * 16;
  cursor.skip(identities + keys);
  const bool good = cursor.ok() && read_string(cursor, kLongestProperty) &&
                    read_sequence(cursor, kMaxDataHolders, [&] { return read_data_holder(cursor); });
  return flaw_unless(good);
}

}  // namespace takt
