#pragma once
// Plain CDR (XCDR1), the encoding of samples on the wire and in recordings: four bytes with the encoding,
// then the fields in order, each number aligned to its size, counted from the end of those four bytes.
// Source: OMG DDS-XTypes 1.3, 7.4.1. Messages are written little endian and read in either byte order.
//
// Reading checks everything: a sample that ends early, has more elements or bytes than the IDL allows, a
// boolean other than 0 and 1 or a string without its final zero is refused. A sequence is allocated only if
// the rest of the sample is long enough for it, so that memory stays in proportion to the sample. Bytes
// behind the last field are ignored. Unnamed numbers of an enumeration are kept (enumeration.h).
#include <algorithm>
#include <bit>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "idl/common/message.h"

namespace takt::cdr {

static_assert(std::endian::native == std::endian::little, "samples are written as memory has them");

inline constexpr std::size_t kEncapsulation_bytes = 4;

template <typename Type>
concept Number = std::is_arithmetic_v<Type> || std::is_enum_v<Type>;

/// Counts the bytes that a Writer would write.
class Counter {
 public:
  void align(std::size_t size) { bytes_ += (size - bytes_ % size) % size; }
  void put(const void*, std::size_t size) { bytes_ += size; }
  /// No memory is filled.
  std::uint8_t* room(std::size_t size) {
    bytes_ += size;
    return nullptr;
  }
  std::size_t bytes() const { return kEncapsulation_bytes + bytes_; }
  void fail() {}

 private:
  std::size_t bytes_ = 0;
};

/// Writes into memory of fixed size, and stops where that ends.
class Writer {
 public:
  explicit Writer(std::span<std::uint8_t> memory) : memory_(memory) {
    constexpr std::uint8_t kLittleEndian[kEncapsulation_bytes] = {0, 1, 0, 0};
    put(kLittleEndian, kEncapsulation_bytes);
  }
  void align(std::size_t size) {
    constexpr std::uint8_t zeros[8] = {};
    put(zeros, (size - (at_ - kEncapsulation_bytes) % size) % size);
  }
  void put(const void* bytes, std::size_t size) {
    if (!ok_ || memory_.size() - at_ < size) return fail();
    if (size > 0) std::memcpy(memory_.data() + at_, bytes, size);
    at_ += size;
  }
  /// The next bytes, to be filled; nullptr if there are fewer.
  std::uint8_t* room(std::size_t size) {
    if (!ok_ || memory_.size() - at_ < size) {
      fail();
      return nullptr;
    }
    std::uint8_t* const to = memory_.data() + at_;
    at_ += size;
    return to;
  }
  void fail() { ok_ = false; }
  bool ok() const { return ok_; }
  std::size_t bytes() const { return at_; }

 private:
  std::span<std::uint8_t> memory_;
  std::size_t at_ = 0;
  bool ok_ = true;
};

/// Reads numbers and texts of a sample. After a read beyond the end, which gives zero, ok() is false.
class Reader {
 public:
  explicit Reader(std::span<const std::uint8_t> sample) {
    ok_ = sample.size() >= kEncapsulation_bytes && sample[0] == 0 && sample[1] <= 1;
    if (!ok_) return;
    swapped_ = sample[1] == 0;
    bytes_ = sample.subspan(kEncapsulation_bytes);
  }
  explicit Reader(std::string_view sample)
      : Reader(std::span(reinterpret_cast<const std::uint8_t*>(sample.data()), sample.size())) {}

  bool ok() const { return ok_; }
  void fail() { ok_ = false; }
  std::size_t left() const { return bytes_.size() - at_; }

  template <Number Type>
  Type number() {
    Type value{};
    numbers(&value, 1);
    return value;
  }
  template <Number Type>
  void numbers(Type* values, std::size_t count) {
    if (count == 0) return;
    align(sizeof(Type));
    const std::uint8_t* from = count <= left() / sizeof(Type) ? take(count * sizeof(Type)) : nullptr;
    if (from == nullptr) return fail();
    std::memcpy(values, from, count * sizeof(Type));
    if (sizeof(Type) > 1 && swapped_)
      for (std::size_t i = 0; i < count; ++i) {
        auto* bytes = reinterpret_cast<std::uint8_t*>(values + i);
        std::reverse(bytes, bytes + sizeof(Type));
      }
  }
  /// Without its final zero. Some peers send an empty string without one.
  std::string_view text() {
    const auto length = number<std::uint32_t>();
    if (length == 0) return {};
    const std::uint8_t* from = take(length);
    if (from == nullptr || from[length - 1] != 0) {
      fail();
      return {};
    }
    return {reinterpret_cast<const char*>(from), length - 1};
  }
  /// Number of elements of a sequence, each of at least `least_bytes`.
  std::size_t count(std::size_t least_bytes) {
    const auto elements = number<std::uint32_t>();
    if (elements > left() / least_bytes) fail();
    return ok_ ? elements : 0;
  }
  /// Whether numbers are in the byte order of this machine.
  bool as_in_memory() const { return !swapped_; }
  void align(std::size_t size) { take((size - at_ % size) % size); }
  /// The next bytes; nullptr if there are fewer.
  const std::uint8_t* take(std::size_t size) {
    if (!ok_ || left() < size) {
      fail();
      return nullptr;
    }
    const std::uint8_t* from = bytes_.data() + at_;
    at_ += size;
    return from;
  }

 private:
  std::span<const std::uint8_t> bytes_;
  std::size_t at_ = 0;
  bool swapped_ = false, ok_ = true;
};

namespace detail {

// By FieldKind; of a text its length.
inline constexpr std::size_t kKindBytes[] = {1, 1, 1, 2, 2, 4, 4, 8, 8, 4, 8, 4};

/// Of messages of numbers alone. In a sequence each takes the same bytes, which are written and read without a look at
/// the room for each number: a state of a thousand components has nineteen thousand of them.
struct FixedLayout {
  /// Padding included; 0: texts, sequences, booleans, or elements that would not be alike.
  std::size_t bytes = 0;
  std::size_t alignment = 1;  ///< of the first number, which is the largest
};

template <Message Type>
constexpr FixedLayout fixed_layout() {
  FixedLayout layout;
  bool is_fixed = true;
  std::size_t largest = 1;
  const auto add = [&](const auto& self, const MessageInfo& message) -> void {
    for (const FieldInfo& field : message.fields) {
      if (field.sequence || field.kind == FieldKind::string || field.kind == FieldKind::boolean) {
        is_fixed = false;
      } else if (field.kind == FieldKind::message) {
        self(self, *field.message);
      } else {
        const std::size_t size = kKindBytes[static_cast<std::size_t>(field.kind)];
        if (layout.bytes == 0) layout.alignment = size;
        largest = std::max(largest, size);
        layout.bytes += (size - layout.bytes % size) % size + size;
      }
    }
  };
  add(add, message_info<Type>());
  if (!is_fixed || layout.alignment != largest || layout.bytes % largest != 0) return {};
  return layout;
}

/// Writes `value` at to[at], where `at` counts from the beginning of its element, and moves on.
template <typename Type>
void store(std::uint8_t* to, std::size_t& at, const Type& value) {
  if constexpr (Number<Type>) {
    while (at % sizeof(Type) != 0) to[at++] = 0;
    std::memcpy(to + at, &value, sizeof(Type));
    at += sizeof(Type);
  } else {
    for_each_field(value, [&](const FieldInfo&, const auto& field) { store(to, at, field); });
  }
}
template <typename Type>
void load(const std::uint8_t* from, std::size_t& at, Type& value) {
  if constexpr (Number<Type>) {
    at += (sizeof(Type) - at % sizeof(Type)) % sizeof(Type);
    std::memcpy(&value, from + at, sizeof(Type));
    at += sizeof(Type);
  } else {
    for_each_field(value, [&](const FieldInfo&, auto& field) { load(from, at, field); });
  }
}

/// Smallest size of a value in bytes, without padding.
template <typename Type>
constexpr std::size_t least_bytes() {
  if constexpr (Number<Type>) {
    return sizeof(Type);
  } else if constexpr (Message<Type>) {
    std::size_t sum = 0;
    const auto add = [&](const auto& self, const MessageInfo& message) -> void {
      for (const FieldInfo& field : message.fields) {
        if (field.sequence)
          sum += 4;
        else if (field.kind == FieldKind::message)
          self(self, *field.message);
        else
          sum += kKindBytes[static_cast<std::size_t>(field.kind)];
      }
    };
    add(add, message_info<Type>());
    return sum;
  } else {
    return 4;
  }
}

/// Each kind of value, as a field of the IDL.
struct Values {
  static bool fits(std::size_t size, std::uint32_t bound) { return bound == 0 || size <= bound; }

  template <typename Sink, Number Type>
  static void put(Sink& sink, const FieldInfo&, const Type& value) {
    sink.align(sizeof(Type));
    sink.put(&value, sizeof(Type));
  }
  template <typename Sink>
  static void put(Sink& sink, const FieldInfo& field, const std::string& text) {
    if (!fits(text.size(), field.string_bound)) return sink.fail();
    put(sink, field, static_cast<std::uint32_t>(text.size() + 1));
    sink.put(text.c_str(), text.size() + 1);
  }
  template <typename Sink, Message Type>
  static void put(Sink& sink, const FieldInfo&, const Type& message) {
    for_each_field(message, [&](const FieldInfo& field, const auto& value) { put(sink, field, value); });
  }
  template <typename Sink, typename Type>
  static void put(Sink& sink, const FieldInfo& field, const std::vector<Type>& values) {
    if (!fits(values.size(), field.bound)) return sink.fail();
    put(sink, field, static_cast<std::uint32_t>(values.size()));
    if constexpr (Number<Type>) {
      if (values.empty()) return;
      sink.align(sizeof(Type));
      sink.put(values.data(), values.size() * sizeof(Type));
    } else if constexpr (is_fixed<Type>()) {
      put_fixed(sink, values);
    } else {
      for (const Type& value : values) put(sink, field, value);
    }
  }
  template <typename Type>
  static constexpr bool is_fixed() {
    if constexpr (Message<Type>)
      return fixed_layout<Type>().bytes > 0;
    else
      return false;
  }
  template <typename Sink, Message Type>
  static void put_fixed(Sink& sink, const std::vector<Type>& values) {
    constexpr FixedLayout layout = fixed_layout<Type>();
    if (values.empty()) return;
    sink.align(layout.alignment);
    std::uint8_t* to = sink.room(values.size() * layout.bytes);
    if (to == nullptr) return;
    for (const Type& value : values) {
      std::size_t at = 0;
      store(to, at, value);
      to += layout.bytes;
    }
  }
  template <Message Type>
  static void get_fixed(Reader& reader, std::vector<Type>& values) {
    constexpr FixedLayout layout = fixed_layout<Type>();
    if (values.empty()) return;
    reader.align(layout.alignment);
    const std::uint8_t* from =
        values.size() <= reader.left() / layout.bytes ? reader.take(values.size() * layout.bytes) : nullptr;
    if (from == nullptr) return reader.fail();
    for (Type& value : values) {
      std::size_t at = 0;
      load(from, at, value);
      from += layout.bytes;
    }
  }

  template <Number Type>
  static void get(Reader& reader, const FieldInfo&, Type& value) {
    value = reader.number<Type>();
  }
  static void get(Reader& reader, const FieldInfo&, bool& value) {
    const auto byte = reader.number<std::uint8_t>();
    if (byte > 1) reader.fail();
    value = byte == 1;
  }
  static void get(Reader& reader, const FieldInfo& field, std::string& text) {
    const std::string_view read = reader.text();
    if (!fits(read.size(), field.string_bound)) return reader.fail();
    text = read;
  }
  template <Message Type>
  static void get(Reader& reader, const FieldInfo&, Type& message) {
    for_each_field(message, [&](const FieldInfo& field, auto& value) {
      if (reader.ok()) get(reader, field, value);
    });
  }
  template <typename Type>
  static void get(Reader& reader, const FieldInfo& field, std::vector<Type>& values) {
    const std::size_t count = reader.count(least_bytes<Type>());
    if (!fits(count, field.bound)) return reader.fail();
    values.resize(count);
    if constexpr (Number<Type>) {
      reader.numbers(values.data(), count);
      return;
    }
    if constexpr (is_fixed<Type>())
      if (reader.as_in_memory()) return get_fixed(reader, values);
    if constexpr (!Number<Type>)
      for (Type& value : values)
        if (reader.ok()) get(reader, field, value);
  }
};

inline constexpr FieldInfo kWhole{};

}  // namespace detail

/// Bytes of the sample, encapsulation included.
template <Message Type>
std::size_t size(const Type& message) {
  Counter counter;
  detail::Values::put(counter, detail::kWhole, message);
  return counter.bytes();
}

/// Bytes written, at the beginning of `memory`; 0 if it is too small, or a string or sequence is longer than
/// the IDL allows. Does not allocate.
template <Message Type>
std::size_t write(const Type& message, std::span<std::uint8_t> memory) {
  Writer writer(memory);
  detail::Values::put(writer, detail::kWhole, message);
  return writer.ok() ? writer.bytes() : 0;
}

/// The sample in `bytes`, whose capacity is reused; false as above.
template <Message Type>
bool write(const Type& message, std::string& bytes) {
  bytes.resize(size(message));
  return write(message, std::span(reinterpret_cast<std::uint8_t*>(bytes.data()), bytes.size())) > 0;
}

/// @max_bytes of the IDL: largest size of a sample.
template <Message Type>
constexpr std::size_t max_bytes() {
  std::size_t most = 0;
  for (const char digit : annotation(message_info<Type>().annotations, "max_bytes"))
    most = 10 * most + static_cast<std::size_t>(digit - '0');
  return most == 0 ? SIZE_MAX : most;
}

/// False if the sample is refused (see above); `message` is then partly filled.
template <Message Type>
bool read(std::span<const std::uint8_t> sample, Type& message) {
  if (sample.size() > max_bytes<Type>()) return false;
  Reader reader(sample);
  detail::Values::get(reader, detail::kWhole, message);
  return reader.ok();
}

}  // namespace takt::cdr
