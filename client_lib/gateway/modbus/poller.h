#pragma once
// The client of a PLC's Modbus server: what it asks in each cycle, one request after the other, and what it makes of the
// replies. Many PLCs serve one request at a time, so that no request waits behind another. Functions on bytes: the owner
// has the socket and the clock.
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "client_lib/gateway/modbus/table.h"

namespace takt::gateway::modbus {

struct PollerOptions {
  std::uint8_t unit = 1;
  bool combined = false;  ///< registers are written and read by function 23 where both are holding registers
  /// Addresses between two elements that a read may include.
  std::size_t most_gap = 16;
};

class Poller {
 public:
  struct Counters {
    std::uint64_t cycles = 0;  ///< completed
    std::uint64_t requests = 0, replies = 0;
    std::uint64_t exceptions = 0;  ///< exception replies
    std::string exception{};       ///< the newest, as a sentence
  };

  /// `is_read[i]`: element i is read from the PLC; else it is written.
  Poller(std::vector<Element> elements, const std::vector<bool>& is_read, PollerOptions options);

  /// Forgets a cycle that has begun: of a new connection.
  void restart();
  bool idle() const { return next_ == requests_.size(); }
  /// Begins a cycle with the numbers of all elements that are written. Returns the first message; empty if the mapping has
  /// no elements.
  std::string begin(const std::vector<double>& numbers);
  /// Takes bytes of the PLC and returns the messages to send next; empty: none. A cycle has ended when idle() is true
  /// again.
  std::string receive(std::string_view bytes);
  /// Why the connection must be made again; empty: it need not.
  const std::string& fault() const { return fault_; }
  /// Numbers of the elements that were read by the last completed cycle; those whose request had an exception keep their
  /// number and are not `known`.
  double number(std::size_t element) const { return values_.number(element); }
  bool known(std::size_t element) const { return known_[element] != 0; }
  const Counters& counters() const { return counters_; }

 private:
  struct Block {
    Area area = Area::coils;
    std::size_t first = 0, count = 0;
    std::vector<std::size_t> elements{};
  };
  std::vector<Block> blocks_of(const std::vector<bool>& wanted, std::size_t most_gap, bool writes) const;
  std::string write_pdu(const Block& block, const std::vector<double>& numbers);
  std::string send_next();
  void take(const Frame& frame);

  std::vector<Element> elements_;
  PollerOptions options_;
  Table values_;
  std::vector<char> known_;
  std::vector<Block> reads_, writes_;
  /// Of this cycle: PDU, and the block that its reply fills (-1: none).
  struct Request {
    std::string pdu;
    int block;
  };
  std::vector<Request> requests_;
  std::size_t next_ = 0;  ///< the request whose reply is awaited
  std::uint16_t transaction_ = 0;
  FrameStream stream_;
  std::string fault_;
  Counters counters_;
};

}  // namespace takt::gateway::modbus
