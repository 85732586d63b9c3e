#include "client_lib/gateway/modbus/poller.h"

#include <algorithm>

namespace takt::gateway::modbus {
namespace {

std::size_t most_of(Area area, bool writes) {
  if (is_bits(area)) return writes ? kMostWrittenBits : kMostReadBits;
  return writes ? kMostReadWriteRegisters : kMostReadRegisters;
}

Function reader_of(Area area) {
  switch (area) {
    case Area::coils:
      return Function::read_coils;
    case Area::discrete_inputs:
      return Function::read_discrete_inputs;
    case Area::holding_registers:
      return Function::read_holding_registers;
    case Area::input_registers:
      break;
  }
  return Function::read_input_registers;
}

}  // namespace

Poller::Poller(std::vector<Element> elements, const std::vector<bool>& is_read, PollerOptions options)
    : elements_(std::move(elements)),
      options_(options),
      values_(elements_),
      known_(elements_.size(), 0),
      reads_(blocks_of(is_read, options_.most_gap, false)) {
  std::vector<bool> is_written = is_read;
  is_written.flip();
  writes_ = blocks_of(is_written, 0, true);  // a gap is not ours to write
}

std::vector<Poller::Block> Poller::blocks_of(const std::vector<bool>& wanted, std::size_t most_gap,
                                             bool writes) const {
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < elements_.size(); ++i)
    if (wanted[i]) order.push_back(i);
  std::ranges::sort(order, [this](std::size_t a, std::size_t b) {
    return std::pair(elements_[a].area, elements_[a].address) <
           std::pair(elements_[b].area, elements_[b].address);
  });
  std::vector<Block> blocks;
  for (const std::size_t i : order) {
    const Element& e = elements_[i];
    const std::size_t end = e.address + e.count();
    if (blocks.empty() || blocks.back().area != e.area ||
        e.address > blocks.back().first + blocks.back().count + most_gap ||
        end - blocks.back().first > most_of(e.area, writes))
      blocks.push_back({e.area, e.address, 0});
    blocks.back().count = end - blocks.back().first;
    blocks.back().elements.push_back(i);
  }
  return blocks;
}

void Poller::restart() {
  stream_ = {};
  fault_.clear();
  requests_.clear();
  next_ = 0;
}

std::string Poller::write_pdu(const Block& block, const std::vector<double>& numbers) {
  for (const std::size_t i : block.elements) values_.set(i, numbers[i]);
  if (is_bits(block.area)) {
    std::vector<bool> bits;
    values_.read_bits(true, block.first, block.count, bits);
    return write_coils_request(block.first, bits);
  }
  std::vector<std::uint16_t> registers;
  values_.read_registers(true, block.first, block.count, registers);
  return write_registers_request(block.first, registers);
}

std::string Poller::begin(const std::vector<double>& numbers) {
  requests_.clear();
  next_ = 0;
  std::vector<char> combined(reads_.size(), 0);
  for (const Block& write : writes_) {
    const std::string pdu = write_pdu(write, numbers);
    std::size_t read = reads_.size();
    if (options_.combined && write.area == Area::holding_registers)
      for (std::size_t i = reads_.size(); i-- > 0;)
        if (reads_[i].area == Area::holding_registers && combined[i] == 0) read = i;
    if (read == reads_.size()) {
      requests_.push_back({pdu, -1});
      continue;
    }
    combined[read] = 1;
    std::vector<std::uint16_t> registers;
    values_.read_registers(true, write.first, write.count, registers);
    requests_.push_back({read_write_request(reads_[read].first, reads_[read].count, write.first, registers),
                         static_cast<int>(read)});
  }
  for (std::size_t i = 0; i < reads_.size(); ++i)
    if (combined[i] == 0)
      requests_.push_back(
          {read_request(reader_of(reads_[i].area), reads_[i].first, reads_[i].count), static_cast<int>(i)});
  return send_next();
}

std::string Poller::send_next() {
  if (idle()) return {};
  ++counters_.requests;
  return encode({++transaction_, options_.unit, requests_[next_].pdu});
}

std::string Poller::receive(std::string_view bytes) {
  stream_.add(bytes);
  std::string messages;
  while (fault_.empty()) {
    const auto frame = stream_.next();
    if (!frame) break;
    take(*frame);
    if (fault_.empty()) messages += send_next();
  }
  if (fault_.empty() && !stream_.fault().empty()) fault_ = stream_.fault();
  return messages;
}

void Poller::take(const Frame& frame) {
  if (idle()) {
    fault_ = "a reply without a request";
    return;
  }
  if (frame.transaction != transaction_) {
    fault_ = "transaction " + std::to_string(frame.transaction) + " in the reply to transaction " +
             std::to_string(transaction_);
    return;
  }
  const Request& request = requests_[next_];
  const Reply reply = parse_reply(request.pdu, frame.pdu);
  if (!reply.fault.empty()) {
    fault_ = reply.fault;
    return;
  }
  ++counters_.replies;
  const Block* block = request.block < 0 ? nullptr : &reads_[static_cast<std::size_t>(request.block)];
  if (reply.exception != 0) {
    ++counters_.exceptions;
    const auto function = static_cast<unsigned>(static_cast<unsigned char>(request.pdu[0]));
    const auto first = static_cast<unsigned>(static_cast<unsigned char>(request.pdu[1])) << 8U |
                       static_cast<unsigned char>(request.pdu[2]);
    counters_.exception = "The PLC answers function " + std::to_string(function) + " at address " +
                          std::to_string(first) + " by the exception " + exception_text(reply.exception) +
                          ".";
  }
  if (block != nullptr) {
    for (const std::size_t i : block->elements) {
      known_[i] = reply.exception == 0 ? 1 : 0;
      if (reply.exception != 0) continue;
      const Element& e = elements_[i];
      const std::size_t at = e.address - block->first;
      const double number = is_bits(e.area) ? (reply.bits[at] ? 1.0 : 0.0)
                                            : from_registers(reply.registers.data() + at, e.type, e.order);
      // What is no number, or outside the limits, is not taken.
      if (number >= e.lower && number <= e.upper)
        values_.set(i, number);
      else
        known_[i] = 0;
    }
  }
  if (++next_ == requests_.size()) ++counters_.cycles;
}

}  // namespace takt::gateway::modbus
